//! The whole as others read it: VTU of the deformed frame, CSV of end forces.

use std::path::Path;

use glam::DVec3;
use intrados_stage::{
    csv::{Table, number},
    file::WriteError,
};

use super::{
    draft::{Built, Draft},
    shape::Shape,
    whole::{SectionForces, Whole},
};
use crate::{
    mesh::{Cell, Mesh},
    write::{Field, Grid},
};

/// Points, lines and plates where they are, and how far they have moved.
#[derive(Debug, Clone, Default)]
pub(super) struct Picture {
    mesh: Mesh,
    lines: Vec<[u32; 2]>,
    moved: Vec<f64>,
}

impl Picture {
    pub(super) fn new(draft: &Draft, built: &Built, x: &[f64]) -> Self {
        let mut picture = Self::default();
        for (p, part) in draft.parts.iter().enumerate() {
            if built.hanging.contains(&p) {
                continue;
            }
            let region = picture.mesh.region(&part.assembly.id);
            let first = picture.mesh.nodes.len() as u32;
            picture.mesh.nodes.extend(&part.points);
            for end in &built.ends[part.first..part.first + part.points.len()] {
                picture.moved.extend(end.moved(&built.model, x)[0].to_array());
            }
            match &part.shape {
                Shape::Bar(_) => {
                    let last = first + part.points.len() as u32 - 1;
                    picture.lines.extend((first..last).map(|a| [a, a + 1]));
                }
                Shape::Sheet(sheet) => picture.mesh.shells.extend(
                    sheet.plates.iter().map(|(c, _)| Cell { nodes: c.map(|c| c + first), region }),
                ),
            }
        }
        picture
    }

    /// Where everything is, moved by so many times as much as it is.
    fn at(&self, times: f64) -> Vec<DVec3> {
        let by = self.moved.as_chunks::<3>().0.iter().map(|u| DVec3::from_array(*u));
        self.mesh.nodes.iter().zip(by).map(|(p, u)| *p + times * u).collect()
    }
}

impl Whole {
    /// By how much displacements are drawn larger than they are: the largest becomes a twentieth of
    /// the structure's size.
    #[must_use]
    pub fn exaggeration(&self) -> f64 {
        let nodes = &self.picture.mesh.nodes;
        let bounds = nodes
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
        let moved = self.picture.moved.as_chunks::<3>().0;
        let most = moved.iter().map(|u| DVec3::from_array(*u).length()).fold(0.0, f64::max);
        if most > 0.0 { 0.05 * (bounds[1] - bounds[0]).length() / most } else { 1.0 }
    }

    /// Writes its bars and its plates, drawn deformed, each file with the displacements as they
    /// are.
    ///
    /// # Errors
    /// [`WriteError`].
    pub fn write_vtu(&self, bars: &Path, plates: &Path) -> Result<(), WriteError> {
        let picture = &self.picture;
        let points = picture.at(self.exaggeration());
        let field = Field { name: "displacement_m", components: 3, values: &picture.moved };
        Grid::rods(&points, &picture.lines).write(bars, &[field], &[])?;
        let mesh = Mesh { nodes: points, ..picture.mesh.clone() };
        Grid::solids(&mesh).write(plates, &[field], &[])
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
