//! The whole as others read it: VTU of the deformed frame, CSV of end forces.

use std::path::Path;

use glam::DVec3;
use intrados_stage::{
    csv::{Table, number},
    file::WriteError,
};

use super::whole::{SectionForces, Whole};
use crate::{
    mesh::Mesh,
    write::{Field, Grid},
};

impl Whole {
    /// By how much displacements are drawn larger than they are: the largest becomes a twentieth of
    /// the structure's size.
    #[must_use]
    pub(crate) fn exaggeration(&self) -> f64 {
        let nodes = &self.picture.mesh.nodes;
        let bounds = nodes
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
        let moved = self.picture.moved.as_chunks::<3>().0;
        let most = moved.iter().map(|u| DVec3::from_array(*u).length()).fold(0.0, f64::max);
        if most > 0.0 { 0.05 * (bounds[1] - bounds[0]).length() / most } else { 1.0 }
    }

    /// Writes its bars and its plates, drawn deformed, each file with the displacements as they
    /// are and with the hash of its scene.
    ///
    /// # Errors
    /// [`WriteError`].
    pub fn write_vtu(&self, bars: &Path, plates: &Path, scene: &str) -> Result<(), WriteError> {
        let picture = &self.picture;
        let points = picture.at(self.exaggeration());
        let field = Field { name: "displacement_m", components: 3, values: &picture.moved };
        let lines = Grid::rods(&points, &picture.lines).of_scene(scene);
        lines.write(bars, &[field], &[])?;
        let mesh = Mesh { nodes: points, ..picture.mesh.clone() };
        Grid::solids(&mesh).of_scene(scene).write(plates, &[field], &[])
    }

    /// End forces of every bar at every moment, as a table.
    #[must_use]
    pub fn csv(&self) -> String {
        let header = [
            "member", "kind", "day", "end", "at_m", "n_n", "v_y_n", "v_z_n", "t_nm", "m_y_nm",
            "m_z_nm",
        ];
        let mut table = Table::new(&header);
        for member in &self.members {
            for (time, ends) in self.times_s.iter().zip(&member.ends) {
                for (end, forces) in ["start", "end"].iter().zip(ends) {
                    let day = number(Some(time / intrados_stage::time::DAY));
                    let mut row = vec![
                        member.name.clone(),
                        format!("{:?}", member.kind).to_lowercase(),
                        day,
                        (*end).to_owned(),
                    ];
                    row.extend(forces.numbers().map(|f| number(Some(f))));
                    table.row(&row);
                }
            }
        }
        table.text()
    }
}

impl SectionForces {
    fn numbers(&self) -> [f64; 7] {
        [self.at_m, self.n, self.v_y, self.v_z, self.t, self.m_y, self.m_z]
    }
}
