//! Lobes: what shines on a cell (or, for importance, what looks at it), as flat pieces of known
//! radiance.
//!
//! A lobe lies in the *focus plane* of a bundle of flights: the surface that they come from, or the
//! opening that they all pass. It holds a radiance for each of its boxes, so that what arrives at a
//! point y of the cell, L·A·cosθ·cosθ′/r², is right for every y: where a density over directions
//! would be smeared by parallax, this is not.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use serde::{Deserialize, Serialize};
use wide::{f32x8, i32x8, u16x8};

use crate::{
    bsdf::{Frame, warp},
    eight::WIDE,
};

/// Steps of a lobe's rectangle in each direction: boxes begin and end at whole ones, so that two
/// bytes tell where.
pub(crate) const STEPS: f32 = 65535.0;

/// A partition of a rectangle into 2^depth boxes: halves of equal counts of records, and so on.
/// Boxes are small where records are dense, and neighbours in number are neighbours in place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Boxes {
    depth: u32,
    /// Where node i is cut, and in bit 16 across which axis; its halves are 2i + 1 and 2i + 2.
    cuts: Vec<u32>,
    /// Corners of each box, steps.
    extents: Vec<[[u16; 2]; 2]>,
}

/// A place in a rectangle, steps, and its flux.
type Record = ([f32; 2], f32);

/// Share of what a lobe sends that is spread evenly over its boxes, since a box where nothing was
/// seen may not be dark.
const EVEN: f32 = 0.1;
/// Records that a box should have.
const PER_BOX: usize = 24;
/// Most boxes are two to this power.
const DEPTH: u32 = 8;
/// Levels of the tree within a block of boxes.
const BLOCK: u32 = WIDE.ilog2();
/// Thinner boxes, steps, would be missed by rounding on the way from a place to a direction and
/// back.
const THIN: u16 = 64;

impl Boxes {
    /// From records, which it reorders; deterministic in their order. Also returns the share of
    /// each box.
    fn new(records: &mut [Record]) -> (Self, Vec<f32>) {
        let depth = (records.len() / PER_BOX).max(1).ilog2().min(DEPTH);
        let leaves = 1 << depth;
        let mut boxes =
            Self { depth, cuts: vec![0; leaves - 1], extents: Vec::with_capacity(leaves) };
        let total: f32 = records.iter().map(|r| r.1).sum::<f32>().max(f32::MIN_POSITIVE);
        let mut shares = Vec::with_capacity(leaves);
        boxes.halve(records, [[0; 2], [u16::MAX; 2]], 0, &mut |flux| {
            shares.push((1.0 - EVEN) * flux / total + EVEN / leaves as f32)
        });
        (boxes, shares)
    }

    fn halve(
        &mut self,
        records: &mut [Record],
        [lo, hi]: [[u16; 2]; 2],
        node: usize,
        leaf: &mut impl FnMut(f32),
    ) {
        if node >= self.cuts.len() {
            self.extents.push([lo, hi]);
            leaf(records.iter().map(|r| r.1).sum());
            return;
        }
        let axis = usize::from(hi[1] - lo[1] > hi[0] - lo[0]);
        let half = records.len() / 2;
        let median = if records.is_empty() {
            0.5 * (f32::from(lo[axis]) + f32::from(hi[axis]))
        } else {
            records.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis])).1.0[axis]
        };
        // At least a quarter of what is left on each side, so that eight cuts leave a step of the
        // thinnest.
        let least = THIN.min((hi[axis] - lo[axis]) / 4);
        let at = (median.round() as u16).clamp(lo[axis] + least, hi[axis] - least);
        self.cuts[node] = (axis as u32) << 16 | u32::from(at);
        let (below, above) = part(records, |r| r.0[axis] < f32::from(at));
        let (mut left, mut right) = (hi, lo);
        (left[axis], right[axis]) = (at, at);
        self.halve(below, [lo, left], 2 * node + 1, leaf);
        self.halve(above, [right, hi], 2 * node + 2, leaf);
    }

    /// Area of box `k`, square steps.
    fn area(&self, k: usize) -> f32 {
        let [lo, hi] = self.extents[k].map(|corner| corner.map(f32::from));
        (hi[0] - lo[0]) * (hi[1] - lo[1])
    }

    /// A place in box `k`, steps.
    fn place(&self, k: usize, v: [f32; 2]) -> [f32; 2] {
        let [lo, hi] = self.extents[k].map(|corner| corner.map(f32::from));
        [0, 1].map(|i| lo[i] + (hi[i] - lo[i]) * v[i])
    }
}

/// Those for which `first` holds, and the others.
fn part(records: &mut [Record], first: impl Fn(&Record) -> bool) -> (&mut [Record], &mut [Record]) {
    let mut n = 0;
    for i in 0..records.len() {
        if first(&records[i]) {
            records.swap(n, i);
            n += 1;
        }
    }
    records.split_at_mut(n)
}

/// The box, or the node at depth `levels`, at a place within the rectangle.
#[inline]
fn find(cuts: &[u32], levels: u32, place: [f32; 2]) -> usize {
    let place = place.map(|q| q as u32);
    let packed = place[1] << 16 | place[0];
    let mut node = 0;
    for _ in 0..levels {
        let cut = cuts[node];
        node = 2 * node + 1 + usize::from(packed >> (cut >> 12 & 16) & 0xffff >= cut & 0xffff);
    }
    node + 1 - (1 << levels)
}

/// A plane with coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    pub(crate) frame: Frame,
    /// n·x of its points.
    pub(crate) at: f32,
}

impl Plane {
    /// Coordinates of where the line of `y` and `d` meets it.
    pub(crate) fn coordinates(&self, y: Vec3, d: Vec3) -> [f32; 2] {
        let t = (self.at - self.frame.z.dot(y)) / self.frame.z.dot(d);
        let z = y + t * d;
        [self.frame.x.dot(z), self.frame.y.dot(z)]
    }

    fn point(&self, [a, b]: [f32; 2]) -> Vec3 {
        self.frame.x * a + self.frame.y * b + self.frame.z * self.at
    }
}

/// Eight pieces of planes: centres, normals, L·A, A/π.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Eight {
    centre: [f32x8; 3],
    normal: [f32x8; 3],
    power: f32x8,
    size: f32x8,
}

/// A piece of a lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    centre: Vec3,
    normal: Vec3,
    area: f32,
    /// L·A.
    power: f32,
}

/// Flat pieces of known radiance, in two layers: what arrives from a *block* of eight neighbouring
/// boxes is asked of all eight as one. This is a lobe while a field is built; [`Header`] is what is
/// left of it afterwards.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lobe {
    plane: Plane,
    /// A corner of its rectangle in the plane, and the size of a step.
    lo: [f32; 2],
    step: [f32; 2],
    /// The cuts that lead to a block.
    cuts: Vec<u32>,
    levels: u32,
    /// One a block, and the same eight together.
    blocks: Vec<Piece>,
    packs: Vec<Eight>,
    /// The boxes of each block.
    boxes: Vec<Eight16>,
}

/// A lobe whose cuts and boxes lie with those of all others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Header {
    /// Of its rectangle.
    corner: Vec3,
    /// Along its sides.
    x: Vec3,
    y: Vec3,
    step: [f32; 2],
    /// First cut, levels of them, and first block.
    cut: u32,
    levels: u32,
    block: u32,
}

/// Eight boxes of a lobe: corners in steps, L·A.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Eight16 {
    lo: [u16x8; 2],
    hi: [u16x8; 2],
    power: f32x8,
}

/// The rectangles of eight lobes of a cell, with what most directions ask of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gates {
    corner: [f32x8; 3],
    normal: [f32x8; 3],
    /// Along its sides, over a step.
    x: [f32x8; 3],
    y: [f32x8; 3],
    /// Which lobes.
    pub(crate) lobe: [u32; WIDE],
    /// The first block of each among those of the cell.
    pub(crate) block: [u32; WIDE],
}

/// Where a line meets eight rectangles.
pub(crate) struct Crossing {
    /// Which it meets.
    pub(crate) mask: u32,
    /// t²/|cosθ′| there: density per m² to density per sr.
    pub(crate) spread: f32x8,
    /// Where, steps.
    pub(crate) place: [f32x8; 2],
}

/// A point that light arrives at, and the normal of the side where it does.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Spot {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

/// cosθ′/(r (r² + A/π)) of a piece whose plane is `far` away: with r·cosθ, about π times its form
/// factor, bounded where it is near. A piece seen edge-on from nearby still has an inner half that
/// faces the spot, which the cosine toward its centre alone would miss: cosθ′ = far/r + A/(πr² +
/// A), at most 1.
#[inline]
fn facing(far: f32x8, squared: f32x8, size: f32x8) -> f32x8 {
    let squared = squared.fast_max(f32x8::splat(1e-20));
    let disk = f32x8::ONE / (squared + size);
    let inverse = f32x8::ONE / squared.sqrt();
    far.mul_add(inverse, size * disk).fast_min(f32x8::ONE) * inverse * disk
}

impl Eight {
    /// Eight pieces (fewer: the rest sends nothing).
    pub(crate) fn new(pieces: &[Piece]) -> Self {
        let column = |of: &dyn Fn(&Piece) -> f32| {
            f32x8::from(std::array::from_fn(|lane| pieces.get(lane).map_or(0.0, of)))
        };
        let vector = |of: &dyn Fn(&Piece) -> Vec3| [0, 1, 2].map(|k| column(&|p| of(p)[k]));
        Self {
            centre: vector(&|p| p.centre),
            normal: vector(&|p| p.normal),
            power: column(&|p| p.power),
            size: column(&|p| (p.area * FRAC_1_PI).max(1e-12)),
        }
    }

    /// cosθ·cosθ′/r² of each, bounded where it is near: A/(πr² + A) is what a disk of area A sends.
    #[inline]
    fn geometry(&self, spot: &Spot) -> f32x8 {
        let c = f32x8::splat;
        let (y, n) = (spot.position, spot.normal);
        let d = [self.centre[0] - c(y.x), self.centre[1] - c(y.y), self.centre[2] - c(y.z)];
        let cos = d[0].mul_add(c(n.x), d[1].mul_add(c(n.y), d[2] * c(n.z)));
        let far = d[0].mul_add(self.normal[0], d[1].mul_add(self.normal[1], d[2] * self.normal[2]));
        let squared = d[0].mul_add(d[0], d[1].mul_add(d[1], d[2] * d[2]));
        cos.fast_max(f32x8::ZERO) * facing(far.abs(), squared, self.size)
    }

    /// What arrives at `spot` from each.
    #[inline]
    pub(crate) fn arrives(&self, spot: &Spot) -> f32x8 {
        self.power * self.geometry(spot)
    }

    /// Numbers that tell it from others.
    pub(crate) fn fingerprint(&self) -> [u64; 4] {
        let bits = |v: &f32x8| {
            v.as_array().iter().fold(0_u64, |sum, x| sum.rotate_left(7) ^ u64::from(x.to_bits()))
        };
        [bits(&self.power), bits(&self.centre[0]), bits(&self.centre[1]), bits(&self.centre[2])]
    }

    #[cfg(test)]
    pub(crate) fn spoil(&mut self, factor: f32) {
        self.power *= f32x8::splat(factor);
    }
}

impl Piece {
    /// Scaled by what part of it is seen.
    pub(crate) fn scaled(self, scale: f32) -> Self {
        Self { power: self.power * scale, ..self }
    }
}

/// Pieces whose powers are fluxes, with powers such that these fluxes arrive on average at `spots`.
fn calibrated(pieces: &[Piece], spots: &[Spot]) -> Vec<Piece> {
    let mut out = Vec::with_capacity(pieces.len());
    for eight in pieces.chunks(WIDE) {
        let packed = Eight::new(eight);
        let sum = spots.iter().fold(f32x8::ZERO, |sum, spot| sum + packed.geometry(spot));
        let mean = (sum / f32x8::splat(spots.len() as f32)).to_array();
        out.extend(eight.iter().zip(mean).map(|(p, mean)| Piece {
            power: if mean > 1e-20 { p.power / mean } else { 0.0 },
            ..*p
        }));
    }
    out
}

/// The lane where the running sum of `of` passes `rest` ≥ 0; the last one that is not 0 if it does
/// not. Nobody can foretell which, so no branch asks.
#[inline]
pub(crate) fn choose(of: f32x8, rest: f32) -> Option<usize> {
    let w = of.to_array();
    let mut sums = w;
    (1..WIDE).for_each(|i| sums[i] = sums[i - 1] + w[i]);
    let lane = f32x8::from(sums).simd_le(f32x8::splat(rest)).to_bitmask().trailing_ones() as usize;
    if lane < WIDE { Some(lane) } else { w.iter().rposition(|&w| w > 0.0) }
}

#[inline]
fn dot(a: [f32x8; 3], b: [f32x8; 3]) -> f32x8 {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline]
fn splat(v: Vec3) -> [f32x8; 3] {
    v.to_array().map(f32x8::splat)
}

impl Lobe {
    /// A lobe in `plane` from the coordinates and fluxes of flights that cross it and arrive at
    /// `spots`.
    pub(crate) fn new(plane: Plane, records: &mut [Record], spots: &[Spot]) -> Self {
        let flux: f32 = records.iter().map(|r| r.1).sum();
        let [lo, hi] = records.iter().fold(
            [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]],
            |[lo, hi], (p, _)| {
                [[lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])]]
            },
        );
        let margin = 0.02 + 1.0 / records.len() as f32;
        let pad =
            [0, 1].map(|k| margin * (hi[k] - lo[k]) + 1e-5 * hi[k].abs().max(lo[k].abs()) + 1e-9);
        let lo = [0, 1].map(|k| lo[k] - pad[k]);
        let step = [0, 1].map(|k| (hi[k] + pad[k] - lo[k]) / STEPS);
        records.iter_mut().for_each(|r| r.0 = [0, 1].map(|k| (r.0[k] - lo[k]) / step[k]));
        let (boxes, shares) = Boxes::new(records);
        let normal = plane.frame.z;
        let centre = |k: usize| {
            let [u, v] = boxes.place(k, [0.5; 2]);
            plane.point([lo[0] + step[0] * u, lo[1] + step[1] * v])
        };
        let piece = |k: usize| Piece {
            centre: centre(k),
            normal,
            area: boxes.area(k) * step[0] * step[1],
            power: flux * shares[k],
        };
        let pieces: Vec<Piece> = (0..shares.len()).map(piece).collect();
        let block = |pieces: &[Piece]| {
            let power: f32 = pieces.iter().map(|p| p.power).sum();
            let centre = pieces.iter().map(|p| p.centre * p.power).sum::<Vec3>()
                / power.max(f32::MIN_POSITIVE);
            Piece { centre, normal, area: pieces.iter().map(|p| p.area).sum(), power }
        };
        let blocks = calibrated(&pieces.chunks(WIDE).map(block).collect::<Vec<_>>(), spots);
        let levels = boxes.depth.saturating_sub(BLOCK);
        Self {
            plane,
            lo,
            step,
            packs: blocks.chunks(WIDE).map(Eight::new).collect(),
            blocks,
            boxes: calibrated(&pieces, spots)
                .chunks(WIDE)
                .zip(boxes.extents.chunks(WIDE))
                .map(|(p, e)| Eight16::new(p, e))
                .collect(),
            cuts: boxes.cuts[..(1 << levels) - 1].to_vec(),
            levels,
        }
    }

    /// Its blocks.
    pub(crate) fn blocks(&self) -> &[Piece] {
        &self.blocks
    }

    /// What arrives on average at `spots`, and the part of the hemisphere that it fills there.
    pub(crate) fn mean(&self, spots: &[Spot]) -> [f32; 2] {
        let mut sums = [f32x8::ZERO; 2];
        for spot in spots {
            for eight in &self.packs {
                let geometry = eight.geometry(spot);
                sums =
                    [geometry.mul_add(eight.power, sums[0]), geometry.mul_add(eight.size, sums[1])];
            }
        }
        sums.map(|sum| sum.reduce_add() / spots.len() as f32)
    }

    /// Puts it with others.
    pub(crate) fn put(&self, cuts: &mut Vec<u32>, boxes: &mut Vec<Eight16>) -> Header {
        let Plane { frame, .. } = self.plane;
        let (cut, block) = (cuts.len() as u32, boxes.len() as u32);
        cuts.extend(&self.cuts);
        boxes.extend(&self.boxes);
        Header {
            corner: self.plane.point(self.lo),
            x: frame.x,
            y: frame.y,
            step: self.step,
            cut,
            levels: self.levels,
            block,
        }
    }
}

/// A spot in the coordinates of a lobe: the way to its corner, and the normal.
#[derive(Clone, Copy)]
struct Local {
    way: Vec3,
    normal: Vec3,
}

impl Header {
    #[inline]
    fn local(&self, spot: &Spot) -> Local {
        let frame = Frame { x: self.x, y: self.y, z: self.x.cross(self.y) };
        Local { way: frame.local(self.corner - spot.position), normal: frame.local(spot.normal) }
    }

    /// A direction from `spot` to a place in block `block`, the box by `u`, the place in it by `v`,
    /// and its density per sr.
    #[inline]
    pub(crate) fn sample(
        &self,
        boxes: &[Eight16],
        block: usize,
        spot: &Spot,
        u: f32,
        v: [f32; 2],
    ) -> Option<(Vec3, f32)> {
        let (boxes, local) = (&boxes[self.block as usize + block], self.local(spot));
        let (sends, area) = boxes.sends(&local, self.step);
        let all = sends.reduce_add();
        let lane = choose(sends, u * all)? % WIDE;
        let place = |k: usize| {
            let [lo, hi] = [boxes.lo[k], boxes.hi[k]].map(|c| f32::from(c.as_array()[lane]));
            (lo + (hi - lo) * v[k]) * self.step[k]
        };
        let way = self.corner - spot.position + self.x * place(0) + self.y * place(1);
        let t = way.length();
        let density =
            sends.as_array()[lane] / (all * area.as_array()[lane]) * t * t * t / local.way.z.abs();
        (density > 0.0 && density.is_finite()).then_some((way / t, density))
    }

    /// Block of the box at `place`, and the density per m² of [`Self::sample`] there if it goes to
    /// that block.
    #[inline]
    pub(crate) fn density(
        &self,
        cuts: &[u32],
        boxes: &[Eight16],
        spot: &Spot,
        place: [f32; 2],
    ) -> (usize, f32) {
        let block = find(&cuts[self.cut as usize..], self.levels, place);
        let boxes = &boxes[self.block as usize + block];
        let (sends, area) = boxes.sends(&self.local(spot), self.step);
        let all = sends.reduce_add();
        let here = boxes.at(place).select(sends / area, f32x8::ZERO).reduce_add();
        (block, if all > 0.0 { here / all } else { 0.0 })
    }
}

impl Eight16 {
    /// Eight boxes (fewer: the rest is empty).
    fn new(pieces: &[Piece], extents: &[[[u16; 2]; 2]]) -> Self {
        let corner = |end: usize| {
            [0, 1].map(|k| {
                u16x8::from(std::array::from_fn(|lane| extents.get(lane).map_or(0, |e| e[end][k])))
            })
        };
        Self {
            lo: corner(0),
            hi: corner(1),
            power: f32x8::from(std::array::from_fn(|lane| {
                pieces.get(lane).map_or(0.0, |p| p.power)
            })),
        }
    }

    #[inline]
    fn corners(&self) -> [[f32x8; 2]; 2] {
        [self.lo, self.hi].map(|corner| corner.map(|k| f32x8::from_i32x8(i32x8::from_u16x8(k))))
    }

    /// Which one `place` is in.
    #[inline]
    fn at(&self, place: [f32; 2]) -> f32x8 {
        let ([lo, hi], place) = (self.corners(), place.map(f32x8::splat));
        (place[0].simd_ge(lo[0]) & place[0].simd_lt(hi[0]))
            & (place[1].simd_ge(lo[1]) & place[1].simd_lt(hi[1]))
    }

    /// What arrives from each as [`Eight::arrives`] has it, up to one factor, and their areas.
    #[inline]
    fn sends(&self, local: &Local, step: [f32; 2]) -> (f32x8, f32x8) {
        let c = f32x8::splat;
        let [lo, hi] = self.corners();
        let d = [0, 1].map(|k| (lo[k] + hi[k]).mul_add(c(0.5 * step[k]), c(local.way[k])));
        let area = (hi[0] - lo[0]) * (hi[1] - lo[1]) * c(step[0] * step[1]);
        let (n, h) = (local.normal, local.way.z);
        let cos = d[0].mul_add(c(n.x), d[1].mul_add(c(n.y), c(n.z * h)));
        let squared = d[0].mul_add(d[0], d[1].mul_add(d[1], c(h * h)));
        let size = (area * c(FRAC_1_PI)).fast_max(c(1e-12));
        (self.power * cos.fast_max(f32x8::ZERO) * facing(c(h.abs()), squared, size), area)
    }
}

impl Gates {
    /// Eight lobes (fewer: the rest is never met), with their numbers, and their first blocks among
    /// those of the cell.
    pub(crate) fn new(lobes: &[(u32, u32, &Header)]) -> Self {
        let column = |of: &dyn Fn(&Header) -> f32| {
            f32x8::from(std::array::from_fn(|lane| lobes.get(lane).map_or(0.0, |l| of(l.2))))
        };
        let vector = |of: &dyn Fn(&Header) -> Vec3| [0, 1, 2].map(|k| column(&|l| of(l)[k]));
        Self {
            corner: vector(&|l| l.corner),
            normal: vector(&|l| l.x.cross(l.y)),
            x: vector(&|l| l.x / l.step[0]),
            y: vector(&|l| l.y / l.step[1]),
            lobe: std::array::from_fn(|lane| lobes.get(lane).map_or(0, |l| l.0)),
            block: std::array::from_fn(|lane| lobes.get(lane).map_or(0, |l| l.1)),
        }
    }

    /// Where the line from `y` along `d` meets them, in front of `y`.
    #[inline]
    pub(crate) fn meet(&self, y: Vec3, d: Vec3) -> Crossing {
        let (y, d, steps) = (splat(y), splat(d), f32x8::splat(STEPS));
        let way = [0, 1, 2].map(|k| self.corner[k] - y[k]);
        let cos = dot(self.normal, d);
        let t = dot(self.normal, way) / cos;
        let z = [0, 1, 2].map(|k| t * d[k] - way[k]);
        let place = [dot(self.x, z), dot(self.y, z)];
        // Parallel to it, t is infinite or no number, and so are the coordinates.
        let within = |q: f32x8| q.simd_ge(f32x8::ZERO) & q.simd_lt(steps);
        let mask = (t.simd_gt(f32x8::ZERO) & within(place[0]) & within(place[1])).to_bitmask();
        Crossing { mask, spread: t * t / cos.abs(), place }
    }
}

/// Directions about a normal where nothing better is known: boxes over the unit square of the
/// cosine law, each with what arrives from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Haze {
    frame: Frame,
    boxes: Boxes,
    /// Summed shares of the boxes.
    sums: Vec<f32>,
}

impl Haze {
    /// From directions and fluxes of flights that arrive on the side of `normal`.
    pub(crate) fn new(normal: Vec3, flights: impl Iterator<Item = (Vec3, f32)>) -> Self {
        let frame = Frame::new(normal);
        let mut records: Vec<Record> =
            flights.map(|(d, w)| (square(frame.local(d)).map(|u| u * STEPS), w)).collect();
        let (boxes, shares) = Boxes::new(&mut records);
        let total: f32 = shares.iter().sum();
        let mut sum = 0.0;
        let sums = shares.iter().map(|s| {
            sum += s / total;
            sum
        });
        Self { frame, sums: sums.collect(), boxes }
    }

    pub(crate) fn sample(&self, u: f32, v: [f32; 2]) -> Vec3 {
        let k = self.sums.partition_point(|&s| s <= u).min(self.sums.len() - 1);
        self.frame.to_world(warp::cosine_hemisphere(self.boxes.place(k, v).map(|q| q / STEPS)))
    }

    /// Density per sr.
    #[inline]
    pub(crate) fn density(&self, d: Vec3) -> f32 {
        let local = self.frame.local(d);
        if local.z <= 0.0 {
            return 0.0;
        }
        let k = find(&self.boxes.cuts, self.boxes.depth, square(local).map(|u| u * STEPS));
        let p = self.sums[k] - if k == 0 { 0.0 } else { self.sums[k - 1] };
        p * (STEPS * STEPS) / self.boxes.area(k) * local.z * FRAC_1_PI
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>()
            + 4 * (self.sums.capacity() + self.boxes.cuts.capacity())
            + 8 * self.boxes.extents.capacity()
    }
}

/// The square's point that the cosine law maps to `d`: the inverse of the concentric map (Shirley
/// and Chiu 1997).
#[inline]
fn square(d: Vec3) -> [f32; 2] {
    use std::f32::consts::FRAC_PI_4;
    let (x, y) = (d.x, d.y);
    let across = x.abs() > y.abs();
    let (near, far) = if across { (x, y) } else { (y, x) };
    if near == 0.0 {
        return [0.5; 2];
    }
    let r = x.hypot(y).copysign(near);
    let other = r * ((far / near).atan() / FRAC_PI_4);
    let (a, b) = if across { (r, other) } else { (other, r) };
    [0.5 + 0.5 * a, 0.5 + 0.5 * b].map(|u| u.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    /// Records all over, on one line, in one point.
    #[test]
    fn boxes_fill_the_rectangle_and_are_found() {
        for narrow in [[1.0, 1.0], [1.0, 0.0], [0.0, 0.0]] {
            let place = |i| Key::new(1, i).pair(0).map(|u| u * STEPS);
            let mut records: Vec<Record> =
                (0..10_000).map(|i| ([0, 1].map(|k| narrow[k] * place(i)[k] + 7.0), 1.0)).collect();
            let (boxes, shares) = Boxes::new(&mut records);
            assert_eq!(boxes.extents.len(), 256);
            assert!((shares.iter().sum::<f32>() - 1.0).abs() < 1e-4);
            assert!((0..256).all(|k| boxes.area(k) > 0.0));
            let area: f64 = (0..256).map(|k| f64::from(boxes.area(k))).sum();
            assert!((area / f64::from(STEPS * STEPS) - 1.0).abs() < 1e-5);
            for q in (0..1000).map(place) {
                let [lo, hi] =
                    boxes.extents[find(&boxes.cuts, boxes.depth, q)].map(|c| c.map(f32::from));
                assert!((0..2).all(|k| lo[k] <= q[k] && q[k] < hi[k]), "{lo:?} {q:?} {hi:?}");
            }
        }
    }

    #[test]
    fn lanes_are_chosen_by_their_parts() {
        let of = f32x8::from([0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0]);
        for (rest, lane) in [(0.0, 1), (0.9, 1), (1.0, 3), (2.9, 3), (3.0, 6), (5.9, 6), (6.1, 6)] {
            assert_eq!(choose(of, rest), Some(lane), "{rest}");
        }
        assert_eq!(choose(f32x8::ZERO, 0.0), None);
    }
}
