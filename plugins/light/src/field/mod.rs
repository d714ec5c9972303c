//! What steers the walks: a cache of radiance for those from the camera, one of importance for those from the lamps.
//!
//! A field knows, for every *cell* (a piece of one side of a chart), how much arrives there and from where. It is learnt from both walks: the
//! other side's, which bring what arrives here (photons), and its own, which find what they looked for (suffixes).

mod build;
mod charts;
mod lobe;
pub(crate) mod steer;
pub(crate) mod train;

use glam::Vec3;

pub(crate) use build::Extra;
pub(crate) use charts::Charts;
pub use train::{Culprit, Guide, Residual, Round, Schedule, learn};
use lobe::Lobe;

/// No cell, no chart.
pub(crate) const NONE: u32 = u32::MAX;

/// One side's far field.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightField {
    nodes: Vec<Node>,
    /// By key (2 · chart + side; sensors behind them): root, or [`NONE`].
    roots: Vec<u32>,
    pub(crate) cells: Vec<Cell>,
    entries: Vec<Entry>,
    lobes: Vec<Lobe>,
}

/// Splits space, or is a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Node {
    Split { axis: u8, at: f32, left: u32, right: u32 },
    Leaf(u32),
}

/// What is known of one piece of surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cell {
    /// What arrives by flights, ∫ L cosθ dω (the part that links find better left out).
    pub(crate) irradiance: f32,
    first: u32,
    end: u32,
}

/// A lobe of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    lobe: u32,
    /// Of it and those before.
    sum: f32,
    p: f32,
}

impl LightField {
    /// The cell at `position` on the side of a chart that `key` names; [`NONE`] where nothing is known.
    #[inline]
    pub(crate) fn cell(&self, key: u32, position: Vec3) -> u32 {
        let Some(&root) = self.roots.get(key as usize) else { return NONE };
        if root == NONE {
            return NONE;
        }
        let mut node = root;
        loop {
            match self.nodes[node as usize] {
                Node::Leaf(cell) => return cell,
                Node::Split { axis, at, left, right } => node = if position[axis as usize] < at { left } else { right },
            }
        }
    }

    fn entries(&self, cell: u32) -> &[Entry] {
        let cell = &self.cells[cell as usize];
        &self.entries[cell.first as usize..cell.end as usize]
    }

    /// A direction from `y` in `cell`: lobe and box by `u`, the rest by `v`.
    pub(crate) fn sample(&self, cell: u32, y: Vec3, u: [f32; 2], v: [f32; 2]) -> Vec3 {
        let entries = self.entries(cell);
        let k = entries.partition_point(|e| e.sum <= u[0]).min(entries.len() - 1);
        self.lobes[entries[k].lobe as usize].sample(y, u[1], v)
    }

    /// Its density, per sr.
    pub(crate) fn density(&self, cell: u32, y: Vec3, d: Vec3) -> f32 {
        self.entries(cell).iter().map(|e| e.p * self.lobes[e.lobe as usize].density(y, d)).sum()
    }

    /// Memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + 4 * self.roots.capacity()
            + self.cells.capacity() * size_of::<Cell>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.lobes.iter().map(Lobe::bytes).sum::<usize>()
    }

    /// Cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether nothing has been learnt.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }
}
