//! The deformed frame as points, lines and plates.

use glam::DVec3;

use super::{
    draft::{Built, Draft},
    shape::Shape,
};
use crate::mesh::{Cell, Mesh};

/// Points, lines and plates where they are, and how far they have moved.
#[derive(Debug, Clone, Default)]
pub(super) struct Picture {
    pub(super) mesh: Mesh,
    pub(super) lines: Vec<[u32; 2]>,
    pub(super) moved: Vec<f64>,
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
    pub(super) fn at(&self, times: f64) -> Vec<DVec3> {
        let by = self.moved.as_chunks::<3>().0.iter().map(|u| DVec3::from_array(*u));
        self.mesh.nodes.iter().zip(by).map(|(p, u)| *p + times * u).collect()
    }
}
