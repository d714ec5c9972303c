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
use wide::f32x8;

use crate::eight::WIDE;

pub(crate) use build::Extra;
pub(crate) use charts::Charts;
use lobe::{Eight, Haze, Lobe, Piece, Plane, Spot, choose};
pub use train::{Culprit, Guide, Residual, Round, Schedule, Steering, learn};

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
    /// The blocks of all lobes of a cell, eight together, and which they are: lobe and block.
    packs: Vec<Eight>,
    blocks: Vec<[(u32, u32); WIDE]>,
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
    /// Entries.
    first: u32,
    end: u32,
    /// Packs.
    pack: u32,
    packs: u32,
    /// What arrives besides, and from where.
    rest: f32,
    haze: u32,
}

/// A lobe of a cell, with what most directions ask of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    plane: Plane,
    lo: [f32; 2],
    hi: [f32; 2],
    lobe: u32,
    /// Its first block among those of the cell.
    block: u32,
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

    /// Makes a cell of lobes with what part of them it sees, and of the rest.
    fn add_cell(&mut self, seen: &[(u32, f32)], rest: f32, haze: u32) {
        let (first, pack) = (self.entries.len() as u32, self.packs.len() as u32);
        let (mut pieces, mut names): (Vec<Piece>, Vec<(u32, u32)>) = (Vec::new(), Vec::new());
        for &(lobe, scale) in seen {
            let Lobe { plane, .. } = self.lobes[lobe as usize];
            let [lo, hi] = self.lobes[lobe as usize].extent();
            self.entries.push(Entry { plane, lo, hi, lobe, block: pieces.len() as u32 });
            for (i, block) in self.lobes[lobe as usize].blocks().iter().enumerate() {
                pieces.push(block.scaled(scale));
                names.push((lobe, i as u32));
            }
        }
        self.packs.extend(pieces.chunks(WIDE).map(Eight::new));
        self.blocks.extend(names.chunks(WIDE).map(|names| std::array::from_fn(|lane| names.get(lane).copied().unwrap_or((0, 0)))));
        let packs = self.packs.len() as u32 - pack;
        self.cells.push(Cell { first, end: self.entries.len() as u32, pack, packs, rest, haze });
    }

    /// Multiplies what the k-th eight of blocks sends, and of every other cell the haze: for tests of wrong fields.
    #[cfg(test)]
    pub(crate) fn spoil(&mut self, factor: impl Fn(u64) -> f32) {
        for (k, pack) in (0..).zip(&mut self.packs) {
            pack.spoil(factor(k));
        }
        for (k, cell) in (0..).zip(&mut self.cells) {
            cell.rest *= factor(k);
        }
    }

    fn packs(&self, cell: &Cell) -> &[Eight] {
        &self.packs[cell.pack as usize..(cell.pack + cell.packs) as usize]
    }

    /// What arrives at a spot of `cell` by flights, ∫ L cosθ dω (of what links find better, a part).
    #[inline]
    pub(crate) fn irradiance(&self, cell: u32, spot: &Spot) -> f32 {
        let cell = &self.cells[cell as usize];
        cell.rest + self.packs(cell).iter().fold(f32x8::ZERO, |sum, pack| sum + pack.arrives(spot)).reduce_add()
    }

    /// A direction from a spot where `total` arrives: where from by `u`, the place in the box by `v`. Zero where rounding leaves none.
    pub(crate) fn sample(&self, cell: u32, spot: &Spot, total: f32, u: [f32; 2], v: [f32; 2]) -> Vec3 {
        let cell = &self.cells[cell as usize];
        let mut rest = u[0] * total - cell.rest;
        if rest < 0.0 && cell.haze != NONE {
            return self.hazes[cell.haze as usize].sample(u[1], v);
        }
        let mut chosen = None;
        for (i, pack) in self.packs(cell).iter().enumerate() {
            let sends = pack.arrives(spot);
            let all = sends.reduce_add();
            if rest < all || i + 1 == cell.packs as usize {
                chosen = choose(sends, rest).map(|(lane, _)| self.blocks[cell.pack as usize + i][lane]);
                break;
            }
            rest -= all;
        }
        chosen.map_or(Vec3::ZERO, |(lobe, block)| self.lobes[lobe as usize].sample(block as usize, spot, u[1], v))
    }

    /// Its density, per sr.
    #[inline]
    pub(crate) fn density(&self, cell: u32, spot: &Spot, total: f32, d: Vec3) -> f32 {
        let cell = &self.cells[cell as usize];
        let mut sum = if cell.haze == NONE { 0.0 } else { cell.rest * self.hazes[cell.haze as usize].density(d) };
        for entry in &self.entries[cell.first as usize..cell.end as usize] {
            let Some((t, [u, v])) = entry.plane.meet(spot.position, d) else { continue };
            if u < entry.lo[0] || u > entry.hi[0] || v < entry.lo[1] || v > entry.hi[1] {
                continue;
            }
            let (block, density) = self.lobes[entry.lobe as usize].density(spot, [u, v]);
            let k = entry.block as usize + block;
            let sends = self.packs[cell.pack as usize + k / WIDE].arrives_from(k % WIDE, spot);
            sum += sends * density * t * t / entry.plane.frame.z.dot(d).abs();
        }
        sum / total
    }

    /// A number that tells fields apart.
    fn fingerprint(&self) -> u64 {
        let spots = self.packs.iter().flat_map(|pack| pack.fingerprint());
        train::blake(&spots.chain([self.cells.len() as u64, self.nodes.len() as u64]).collect::<Vec<_>>())
    }

    /// Memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + 4 * self.roots.capacity()
            + self.cells.capacity() * size_of::<Cell>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.packs.capacity() * size_of::<Eight>()
            + self.blocks.capacity() * size_of::<[(u32, u32); WIDE]>()
            + self.lobes.iter().map(Lobe::bytes).sum::<usize>()
            + self.hazes.iter().map(Haze::bytes).sum::<usize>()
    }

    /// Cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Lobes, and packs of blocks, of an average cell; lobes and boxes in all.
    #[must_use]
    pub fn sizes(&self) -> [f64; 4] {
        let n = self.cells.len().max(1) as f64;
        [
            self.entries.len() as f64 / n,
            self.packs.len() as f64 / n,
            self.lobes.len() as f64,
            self.lobes.iter().map(|l| 8.0 * l.blocks().len() as f64).sum(),
        ]
    }

    /// Whether nothing has been learnt.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }
}
