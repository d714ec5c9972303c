//! What steers the walks: a cache of radiance for those from the camera, one of importance for
//! those from the lamps.
//!
//! A field knows, for every *cell* (a piece of one side of a chart), how much arrives there and
//! from where. It is learnt from both walks: the other side's, which bring what arrives here
//! (photons), and its own, which find what they looked for (suffixes).

mod build;
mod charts;
mod guide;
mod lobe;
pub(crate) mod recorder;
pub(crate) mod steer;
pub(crate) mod train;
mod view;

use glam::Vec3;
use intrados_transport::Field;
use serde::{Deserialize, Serialize};
use wide::f32x8;

use crate::eight::{WIDE, lanes};

use build::{Charted, TrainingSample};

pub(crate) use build::Extra;
pub(crate) use charts::Charts;
pub use guide::{Culprit, Guide};
use lobe::{Eight, Eight16, Gates, Haze, Header, Lobe, Piece, Spot, choose};
pub use train::{Effort, learn};
pub use view::{false_colours, spread};

/// No cell, no chart.
pub(crate) const NONE: u32 = u32::MAX;

/// One side's far field.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LightField {
    nodes: Vec<Node>,
    /// By key (2 · chart + side; sensors behind them): root, or [`NONE`].
    roots: Vec<u32>,
    pub(crate) cells: Vec<Cell>,
    /// The lobes of a cell, eight together.
    gates: Vec<Gates>,
    /// The blocks of all lobes of a cell, eight together, and whose they are: the how-manieth lobe
    /// of the cell.
    packs: Vec<Eight>,
    owners: Vec<[u32; WIDE]>,
    /// The lobes, and the cuts and boxes of all of them.
    lobes: Vec<Header>,
    cuts: Vec<u32>,
    boxes: Vec<Eight16>,
    hazes: Vec<Haze>,
}

/// Splits space, or is a cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Node {
    Split { axis: u8, at: f32, left: u32, right: u32 },
    Leaf(u32),
}

/// What is known of one piece of surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cell {
    /// Lobes: how many, and where their gates begin.
    lobes: u32,
    gate: u32,
    /// Packs.
    pack: u32,
    packs: u32,
    /// What arrives besides, and from where.
    rest: f32,
    haze: u32,
}

impl Cell {
    /// Packs of a part.
    #[inline]
    fn part(&self) -> usize {
        (self.packs as usize).div_ceil(PARTS).max(1)
    }
}

/// Parts of a cell's packs whose sums a view remembers.
const PARTS: usize = 4;

/// What arrives at one spot by its cell: from each part of the packs, and in all.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct View {
    pub(crate) spot: Spot,
    parts: [f32; PARTS],
    pub(crate) total: f32,
}

/// A field of the transport problem: places are a cell and what a spot of it sees, ways are
/// directions.
impl Field for LightField {
    type Real = f32;
    type Place = (u32, View);
    type Way = Vec3;
    type TrainingSample = TrainingSample;
    type Domain<'g> = Charted<'g>;

    fn learn(domain: &Charted<'_>, lessons: Vec<TrainingSample>) -> Self {
        build::build(domain, lessons)
    }

    fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    fn value(&self, (cell, view): &Self::Place) -> f32 {
        if *cell == NONE { 0.0 } else { view.total }
    }

    fn sample(&self, (cell, view): &Self::Place, _: f32, [u, v, a, b]: [f32; 4]) -> Option<Vec3> {
        self.pick(*cell, view, [u, v], [a, b]).map(|(d, _)| d)
    }

    fn density(&self, (cell, view): &Self::Place, total: f32, d: Vec3) -> f32 {
        self.sum(&self.cells[*cell as usize], view, NONE, d) / total
    }
}

impl LightField {
    /// The cell at `position` on the side of a chart that `key` names; [`NONE`] where nothing is
    /// known.
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
                Node::Split { axis, at, left, right } => {
                    node = if position[axis as usize] < at { left } else { right }
                }
            }
        }
    }

    /// Makes a cell of lobes, which have the numbers `seen` in the field, with what part of them it
    /// sees, and of the rest.
    fn add_cell(&mut self, seen: &[(u32, &Lobe, f32)], rest: f32, haze: u32) {
        let (gate, pack) = (self.gates.len() as u32, self.packs.len() as u32);
        let (mut pieces, mut owners, mut first): (Vec<Piece>, Vec<u32>, Vec<u32>) =
            (Vec::new(), Vec::new(), Vec::new());
        for (i, (_, lobe, scale)) in seen.iter().enumerate() {
            first.push(pieces.len() as u32);
            pieces.extend(lobe.blocks().iter().map(|block| block.scaled(*scale)));
            owners.resize(pieces.len(), i as u32);
        }
        let lobes: Vec<_> = seen
            .iter()
            .zip(first)
            .map(|(s, first)| (s.0, first, &self.lobes[s.0 as usize]))
            .collect();
        self.gates.extend(lobes.chunks(WIDE).map(Gates::new));
        self.packs.extend(pieces.chunks(WIDE).map(Eight::new));
        self.owners.extend(
            owners
                .chunks(WIDE)
                .map(|owners| std::array::from_fn(|lane| owners.get(lane).copied().unwrap_or(0))),
        );
        let packs = self.packs.len() as u32 - pack;
        self.cells.push(Cell { lobes: seen.len() as u32, gate, pack, packs, rest, haze });
    }

    fn packs(&self, cell: &Cell) -> &[Eight] {
        &self.packs[cell.pack as usize..(cell.pack + cell.packs) as usize]
    }

    fn gates(&self, cell: &Cell) -> &[Gates] {
        &self.gates[cell.gate as usize..cell.gate as usize + (cell.lobes as usize).div_ceil(WIDE)]
    }

    /// Looks around at a spot of `cell`: ∫ L cosθ dω by flights (of what links find better, a
    /// part).
    #[inline]
    pub(crate) fn look(&self, cell: u32, spot: &Spot) -> View {
        let cell = &self.cells[cell as usize];
        let mut parts = [0.0; PARTS];
        for (part, packs) in parts.iter_mut().zip(self.packs(cell).chunks(cell.part())) {
            *part =
                packs.iter().fold(f32x8::ZERO, |sum, pack| sum + pack.arrives(spot)).reduce_add();
        }
        View { spot: *spot, parts, total: cell.rest + parts.iter().sum::<f32>() }
    }

    /// [`Field::sample`] with the density per sr, which picking nearly knows: where from by `u`,
    /// the place in the box by `v`. None where rounding leaves none.
    #[inline]
    pub(crate) fn pick(
        &self,
        cell: u32,
        view: &View,
        u: [f32; 2],
        v: [f32; 2],
    ) -> Option<(Vec3, f32)> {
        let cell = &self.cells[cell as usize];
        let rest = u[0] * view.total - cell.rest;
        if rest < 0.0 && cell.haze != NONE {
            let d = self.hazes[cell.haze as usize].sample(u[1], v);
            return Some((d, self.sum(cell, view, NONE, d) / view.total));
        }
        let mut rest = rest.max(0.0);
        let mut part = 0;
        while part + 1 < PARTS
            && rest >= view.parts[part]
            && view.parts[part + 1..].iter().any(|&p| p > 0.0)
        {
            rest -= view.parts[part];
            part += 1;
        }
        let begin = cell.pack as usize + part * cell.part();
        let end = (begin + cell.part()).min((cell.pack + cell.packs) as usize);
        let mut pack = begin;
        let sends = loop {
            let sends = self.packs.get(pack)?.arrives(&view.spot);
            let all = sends.reduce_add();
            if rest < all || pack + 1 >= end {
                break sends;
            }
            rest -= all;
            pack += 1;
        };
        let lane = choose(sends, rest)? % WIDE;
        let lobe = self.owners[pack][lane];
        let gates = &self.gates[cell.gate as usize + lobe as usize / WIDE];
        let (number, first) = (gates.lobe[lobe as usize % WIDE], gates.block[lobe as usize % WIDE]);
        let block = (pack - cell.pack as usize) * WIDE + lane - first as usize;
        let (d, density) =
            self.lobes[number as usize].sample(&self.boxes, block, &view.spot, u[1], v)?;
        // Of the lobe itself it is known; it need not be found again, and rounding cannot move it
        // to the next box.
        Some((d, (sends.as_array()[lane] * density + self.sum(cell, view, lobe, d)) / view.total))
    }

    /// What arrives from `d`, per sr, but for the how-manieth lobe `but`.
    #[inline]
    fn sum(&self, cell: &Cell, view: &View, but: u32, d: Vec3) -> f32 {
        let mut sum = if cell.haze == NONE {
            0.0
        } else {
            cell.rest * self.hazes[cell.haze as usize].density(d)
        };
        for (i, gates) in self.gates(cell).iter().enumerate() {
            let crossing = gates.meet(view.spot.position, d);
            let mask = if but as usize / WIDE == i {
                crossing.mask & !(1 << (but as usize % WIDE))
            } else {
                crossing.mask
            };
            for lane in lanes(mask) {
                let lane = lane % WIDE;
                let place = crossing.place.map(|q| q.as_array()[lane]);
                let (block, density) = self.lobes[gates.lobe[lane] as usize].density(
                    &self.cuts,
                    &self.boxes,
                    &view.spot,
                    place,
                );
                let k = gates.block[lane] as usize + block;
                let sends = self.packs[cell.pack as usize + k / WIDE].arrives(&view.spot);
                sum += sends.as_array()[k % WIDE] * density * crossing.spread.as_array()[lane];
            }
        }
        sum
    }

    /// Whether it has a root for each of so many sides of charts, or is empty; and whether all that
    /// is numbered in it is there, so that no walk leaves its tables or goes round in its trees.
    fn fits(&self, sides: usize) -> bool {
        let is_there = |first: u32, count: usize, all: usize| {
            (first as usize).checked_add(count).is_some_and(|end| end <= all)
        };
        let nodes = self.nodes.len();
        // Trees are built from their roots on.
        let is_node = |(i, node): (usize, &Node)| match node {
            Node::Leaf(cell) => *cell == NONE || is_there(*cell, 1, self.cells.len()),
            Node::Split { axis, left, right, .. } => {
                let is_below = |next: &u32| *next as usize > i && is_there(*next, 1, nodes);
                *axis < 3 && is_below(left) && is_below(right)
            }
        };
        let is_cell = |cell: &Cell| {
            is_there(cell.gate, (cell.lobes as usize).div_ceil(WIDE), self.gates.len())
                && is_there(cell.pack, cell.packs as usize, self.packs.len())
                && (cell.haze == NONE || is_there(cell.haze, 1, self.hazes.len()))
        };
        let is_root = |root: &u32| *root == NONE || is_there(*root, 1, nodes);
        let is_gate = |g: &Gates| g.lobe.iter().all(|lobe| is_there(*lobe, 1, self.lobes.len()));
        (self.cells.is_empty() || self.roots.len() >= sides)
            && self.owners.len() == self.packs.len()
            && self.roots.iter().all(is_root)
            && self.nodes.iter().enumerate().all(is_node)
            && self.cells.iter().all(is_cell)
            && (self.lobes.is_empty() || self.gates.iter().all(is_gate))
    }

    /// A number that tells fields apart.
    fn fingerprint(&self) -> u64 {
        let spots = self.packs.iter().flat_map(|pack| pack.fingerprint());
        guide::blake(
            &spots.chain([self.cells.len() as u64, self.nodes.len() as u64]).collect::<Vec<_>>(),
        )
    }

    /// Multiplies what the k-th eight of blocks sends, and of every other cell the haze: for tests
    /// of wrong fields.
    #[cfg(test)]
    pub(crate) fn spoil(&mut self, factor: impl Fn(u64) -> f32) {
        for (k, pack) in (0..).zip(&mut self.packs) {
            pack.spoil(factor(k));
        }
        for (k, cell) in (0..).zip(&mut self.cells) {
            cell.rest *= factor(k);
        }
    }

    /// Memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + 4 * self.roots.capacity()
            + self.cells.capacity() * size_of::<Cell>()
            + self.gates.capacity() * size_of::<Gates>()
            + self.packs.capacity() * size_of::<Eight>()
            + self.owners.capacity() * size_of::<[u32; WIDE]>()
            + self.lobes.capacity() * size_of::<Header>()
            + 4 * self.cuts.capacity()
            + self.boxes.capacity() * size_of::<Eight16>()
            + self.hazes.iter().map(Haze::bytes).sum::<usize>()
    }

    /// Cells.
    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;
    use intrados_transport::chi2;
    use lobe::Plane;

    use super::*;
    use crate::bsdf::{Frame, warp};

    /// A lobe of flights from a rectangle about `centre`, denser toward one corner, that arrive at
    /// `spot`.
    fn lobe(normal: Vec3, centre: Vec3, size: f32, n: u64, spot: &Spot) -> Lobe {
        let frame = Frame::new(normal);
        let plane = Plane { frame, at: normal.dot(centre) };
        let middle = [frame.x.dot(centre), frame.y.dot(centre)];
        let mut records: Vec<([f32; 2], f32)> = (0..n)
            .map(|i| {
                let [u, v] = Key::new(n, i).pair(0);
                ([middle[0] + size * (u * u - 0.5), middle[1] + size * (v - 0.5)], 1.0 + u)
            })
            .collect();
        Lobe::new(plane, &mut records, &[*spot])
    }

    /// Cells at the origin that look up: an opening before a wall, a wall that goes below the
    /// horizon, more lobes than one gate holds; with and without haze.
    fn fields(spot: &Spot) -> Vec<LightField> {
        let wall = lobe(Vec3::X, Vec3::new(2.0, 0.0, 0.5), 3.0, 24 * 16, spot);
        let opening = lobe(Vec3::new(0.8, 0.0, 0.6), Vec3::new(0.9, 0.1, 0.6), 0.7, 24 * 8, spot);
        let few = lobe(Vec3::Z, Vec3::new(-0.3, 0.4, 1.5), 1.0, 30, spot);
        let more: Vec<Lobe> = (0..7)
            .map(|i| lobe(Vec3::Y, Vec3::new(i as f32 - 3.0, -1.5, 0.8), 0.9, 60, spot))
            .collect();
        let flights =
            |i: u64| (warp::cosine_hemisphere(Key::new(9, i).pair(0).map(f32::sqrt)), 1.0);
        let field = |lobes: &[&Lobe], rest: f32| {
            let mut field = LightField::default();
            for lobe in lobes {
                let header = lobe.put(&mut field.cuts, &mut field.boxes);
                field.lobes.push(header);
            }
            field.hazes.push(Haze::new(spot.normal, (0..200).map(flights)));
            let seen: Vec<(u32, &Lobe, f32)> =
                lobes.iter().zip(0..).map(|(lobe, i)| (i, *lobe, 1.0 / (1 + i) as f32)).collect();
            field.add_cell(&seen, rest, if rest > 0.0 { 0 } else { NONE });
            field
        };
        let all: Vec<&Lobe> = [&wall, &opening, &few].into_iter().chain(&more).collect();
        vec![
            field(&[&wall], 0.0),
            field(&[&few], 0.0),
            field(&all[..3], 300.0),
            field(&all, 50.0),
            field(&[], 1.0),
        ]
    }

    /// Directions have the density that the field says. One test at 1 % for the whole family; the
    /// numbers are fixed, so it passes always or never.
    #[test]
    fn directions_follow_the_density() {
        // Where the lobes were not calibrated, too.
        let learnt = Spot { position: Vec3::ZERO, normal: Vec3::Z };
        let tilted = Spot {
            position: Vec3::new(0.1, -0.2, 0.05),
            normal: Vec3::new(0.1, -0.3, 1.0).normalize(),
        };
        let fields = fields(&learnt);
        for (i, field) in fields.iter().enumerate() {
            for spot in [learnt, tilted] {
                let view = field.look(0, &spot);
                let sample = |n| {
                    let key = Key::new(i as u64, n);
                    field.pick(0, &view, key.pair(0), key.pair(2))
                };
                // With more samples the quadrature over the edges of so many boxes would be what is
                // tested.
                let chi = chi2::sphere(
                    50_000,
                    |n| sample(n).map(|s| s.0.to_array()),
                    |d| field.density(&(0, view), view.total, d.into()),
                );
                assert!(chi.passes(2 * fields.len()), "field {i}: {chi:?}");
                // What sampling says of its direction is what the density says there, but for
                // places within rounding of the edge of a box.
                let differ = |s: &(Vec3, f32)| {
                    (s.1 / field.density(&(0, view), view.total, s.0) - 1.0).abs() > 1e-2
                };
                let off = (0..10_000).filter_map(sample).filter(differ).count();
                assert!(off <= 10, "field {i}: {off} of 10000");
            }
        }
    }
}
