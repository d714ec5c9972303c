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
use lobe::{Haze, Lobe, Spot};

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
    hazes: Vec<Haze>,
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
    first: u32,
    end: u32,
    /// What arrives besides, and from where.
    rest: f32,
    haze: u32,
}

/// A lobe of a cell, and how much of it the cell sees.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    lobe: u32,
    scale: f32,
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

    fn lobes(&self, cell: &Cell) -> impl Iterator<Item = (&Lobe, f32)> {
        self.entries[cell.first as usize..cell.end as usize].iter().map(|e| (&self.lobes[e.lobe as usize], e.scale))
    }

    /// What arrives at a spot of `cell` by flights, ∫ L cosθ dω (of what links find better, a part).
    #[inline]
    pub(crate) fn irradiance(&self, cell: u32, spot: &Spot) -> f32 {
        let cell = &self.cells[cell as usize];
        cell.rest + self.lobes(cell).map(|(lobe, scale)| scale * lobe.arrives(spot)).sum::<f32>()
    }

    /// A direction from a spot where `total` arrives: where from by `u`, the place in the box by `v`. Zero where rounding leaves none.
    pub(crate) fn sample(&self, cell: u32, spot: &Spot, total: f32, u: [f32; 2], v: [f32; 2]) -> Vec3 {
        let cell = &self.cells[cell as usize];
        let mut rest = u[0] * total - cell.rest;
        if rest < 0.0 && cell.haze != NONE {
            return self.hazes[cell.haze as usize].sample(u[1], v);
        }
        let mut chosen = None;
        for (lobe, scale) in self.lobes(cell) {
            let sends = scale * lobe.arrives(spot);
            if sends > 0.0 {
                chosen = Some((lobe, rest / scale));
                if rest < sends {
                    break;
                }
                rest -= sends;
            }
        }
        chosen.map_or(Vec3::ZERO, |(lobe, rest)| lobe.sample(spot, rest, v))
    }

    /// Its density, per sr.
    #[inline]
    pub(crate) fn density(&self, cell: u32, spot: &Spot, total: f32, d: Vec3) -> f32 {
        let cell = &self.cells[cell as usize];
        let haze = if cell.haze == NONE { 0.0 } else { cell.rest * self.hazes[cell.haze as usize].density(d) };
        (haze + self.lobes(cell).map(|(lobe, scale)| scale * lobe.density(spot, d)).sum::<f32>()) / total
    }

    /// Memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + 4 * self.roots.capacity()
            + self.cells.capacity() * size_of::<Cell>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.lobes.iter().map(Lobe::bytes).sum::<usize>()
            + self.hazes.iter().map(Haze::bytes).sum::<usize>()
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
