//! Lobes: what shines on a cell (or, for importance, what looks at it), as flat pieces of known radiance.
//!
//! A lobe lies in the *focus plane* of a bundle of flights: the surface that they come from, or the opening that they all pass. It holds a
//! radiance for each of its boxes, so that what arrives at a point y of the cell, L·A·cosθ·cosθ′/r², is right for every y:
//! where a density over directions would be smeared by parallax, this is not.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use wide::f32x8;

use crate::{
    bsdf::{Frame, warp},
    eight::WIDE,
};

/// A partition of a rectangle into 2^depth boxes: halves of equal counts of records, and so on. Boxes are small where records are dense, and
/// neighbours in number are neighbours in place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Boxes {
    depth: u32,
    lo: [f32; 2],
    hi: [f32; 2],
    /// Where node i is cut, and across which axis; its halves are 2i + 1 and 2i + 2.
    cuts: Vec<(u32, f32)>,
    /// Corners of each box.
    extents: Vec<[[f32; 2]; 2]>,
}

/// Share of what a lobe sends that is spread evenly over its boxes, since a box where nothing was seen may not be dark.
const EVEN: f32 = 0.1;
/// Records that a box should have.
const PER_BOX: usize = 24;
/// Most boxes are two to this power.
const DEPTH: u32 = 8;

impl Boxes {
    /// From places and weights of records within `[lo, hi]`; reorders them. Deterministic in their order. Also returns the share of each
    /// box.
    fn new(records: &mut [([f32; 2], f32)], lo: [f32; 2], hi: [f32; 2]) -> (Self, Vec<f32>) {
        let depth = (records.len() / PER_BOX).max(1).ilog2().min(DEPTH);
        let leaves = 1 << depth;
        let mut boxes = Self { depth, lo, hi, cuts: vec![(0, 0.0); leaves - 1], extents: Vec::with_capacity(leaves) };
        let total: f32 = records.iter().map(|r| r.1).sum::<f32>().max(f32::MIN_POSITIVE);
        // Thinner boxes would be missed by rounding on the way from a place to a direction and back.
        let thin = [0, 1].map(|k| (1e-3 * (hi[k] - lo[k])).max(1e-5 * hi[k].abs().max(lo[k].abs())));
        let mut shares = Vec::with_capacity(leaves);
        boxes.halve(records, [lo, hi], 0, thin, &mut |flux| shares.push((1.0 - EVEN) * flux / total + EVEN / leaves as f32));
        (boxes, shares)
    }

    fn halve(&mut self, records: &mut [([f32; 2], f32)], [lo, hi]: [[f32; 2]; 2], node: usize, thin: [f32; 2], leaf: &mut impl FnMut(f32)) {
        if node >= self.cuts.len() {
            self.extents.push([lo, hi]);
            leaf(records.iter().map(|r| r.1).sum());
            return;
        }
        let axis = usize::from((hi[1] - lo[1]) * thin[0] > (hi[0] - lo[0]) * thin[1]);
        records.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
        let middle = records.len() / 2;
        let median = records.get(middle).map_or(0.5 * (lo[axis] + hi[axis]), |r| r.0[axis]);
        let least = thin[axis].min(0.25 * (hi[axis] - lo[axis]));
        let at = median.clamp(lo[axis] + least, hi[axis] - least);
        self.cuts[node] = (axis as u32, at);
        let middle = records.partition_point(|r| r.0[axis] < at);
        let (below, above) = records.split_at_mut(middle);
        let (mut left, mut right) = (hi, lo);
        (left[axis], right[axis]) = (at, at);
        self.halve(below, [lo, left], 2 * node + 1, thin, leaf);
        self.halve(above, [right, hi], 2 * node + 2, thin, leaf);
    }

    /// The box at a place.
    #[inline]
    fn find(&self, place: [f32; 2]) -> Option<usize> {
        if !(place[0] >= self.lo[0] && place[0] <= self.hi[0] && place[1] >= self.lo[1] && place[1] <= self.hi[1]) {
            return None;
        }
        let mut node = 0;
        for _ in 0..self.depth {
            let (axis, at) = self.cuts[node];
            node = 2 * node + 1 + usize::from(place[axis as usize & 1] >= at);
        }
        Some(node + 1 - self.extents.len())
    }

    fn area(&self, k: usize) -> f32 {
        let [lo, hi] = self.extents[k];
        (hi[0] - lo[0]) * (hi[1] - lo[1])
    }

    /// A place in box `k`.
    fn place(&self, k: usize, v: [f32; 2]) -> [f32; 2] {
        let [lo, hi] = self.extents[k];
        [0, 1].map(|i| lo[i] + (hi[i] - lo[i]) * v[i])
    }

    fn bytes(&self) -> usize {
        8 * self.cuts.capacity() + 16 * self.extents.capacity()
    }
}

/// A plane with coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    pub(crate) frame: Frame,
    /// n·x of its points.
    pub(crate) at: f32,
}

impl Plane {
    /// Where the line from `y` along `d` meets it, in front of `y`: distance and coordinates.
    #[inline]
    pub(crate) fn meet(&self, y: Vec3, d: Vec3) -> Option<(f32, [f32; 2])> {
        let t = (self.at - self.frame.z.dot(y)) / self.frame.z.dot(d);
        let z = y + t * d;
        (t > 0.0 && t.is_finite()).then(|| (t, [self.frame.x.dot(z), self.frame.y.dot(z)]))
    }

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
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// Flat pieces of known radiance, in two layers: what arrives from a *block* of eight neighbouring boxes is asked of all eight as one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lobe {
    pub(crate) plane: Plane,
    boxes: Boxes,
    /// One a block.
    blocks: Vec<Piece>,
    /// The boxes of each block.
    eights: Vec<Eight>,
}

/// A point that light arrives at, and the normal of the side where it does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

impl Eight {
    /// Eight pieces (fewer: the rest sends nothing).
    pub(crate) fn new(pieces: &[Piece]) -> Self {
        let column = |of: &dyn Fn(&Piece) -> f32| f32x8::from(std::array::from_fn(|lane| pieces.get(lane).map_or(0.0, of)));
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
        cos.fast_max(f32x8::ZERO) * far.abs() / (squared * (squared + self.size)).fast_max(c(1e-30))
    }

    /// What arrives at `spot` from each.
    #[inline]
    pub(crate) fn arrives(&self, spot: &Spot) -> f32x8 {
        self.power * self.geometry(spot)
    }

    #[cfg(test)]
    pub(crate) fn spoil(&mut self, factor: f32) {
        self.power *= f32x8::splat(factor);
    }

    /// Numbers that tell it from others.
    pub(crate) fn fingerprint(&self) -> [u64; 4] {
        let bits = |v: &f32x8| v.as_array().iter().fold(0_u64, |sum, x| sum.rotate_left(7) ^ u64::from(x.to_bits()));
        [bits(&self.power), bits(&self.centre[0]), bits(&self.centre[1]), bits(&self.centre[2])]
    }

    /// What arrives from lane `lane`.
    #[inline]
    pub(crate) fn arrives_from(&self, lane: usize, spot: &Spot) -> f32 {
        let pick = |v: &f32x8| v.as_array()[lane % WIDE];
        let vector = |v: &[f32x8; 3]| Vec3::new(pick(&v[0]), pick(&v[1]), pick(&v[2]));
        let d = vector(&self.centre) - spot.position;
        let squared = d.length_squared();
        let cos = d.dot(spot.normal).max(0.0) * d.dot(vector(&self.normal)).abs();
        pick(&self.power) * cos / (squared * (squared + pick(&self.size))).max(1e-30)
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
        out.extend(eight.iter().zip(mean).map(|(p, mean)| Piece { power: if mean > 1e-20 { p.power / mean } else { 0.0 }, ..*p }));
    }
    out
}

/// The lane where the running sum of `of` passes `rest`, and what is left of `rest` there; the last one that is not 0 if it does not.
#[inline]
pub(crate) fn choose(of: f32x8, mut rest: f32) -> Option<(usize, f32)> {
    let mut chosen = None;
    for (lane, w) in of.to_array().into_iter().enumerate() {
        if w > 0.0 {
            chosen = Some((lane, rest));
            if rest < w {
                break;
            }
            rest -= w;
        }
    }
    chosen
}

impl Lobe {
    /// A lobe in `plane` from the coordinates and fluxes of flights that cross it and arrive at `spots`.
    pub(crate) fn new(plane: Plane, records: &mut [([f32; 2], f32)], spots: &[Spot]) -> Self {
        let flux: f32 = records.iter().map(|r| r.1).sum();
        let [lo, hi] = records.iter().fold([[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]], |[lo, hi], (p, _)| {
            [[lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])]]
        });
        let margin = 0.02 + 1.0 / records.len() as f32;
        let pad = [0, 1].map(|k| margin * (hi[k] - lo[k]) + 1e-5 * hi[k].abs().max(lo[k].abs()) + 1e-9);
        let (boxes, shares) = Boxes::new(records, [lo[0] - pad[0], lo[1] - pad[1]], [hi[0] + pad[0], hi[1] + pad[1]]);
        let normal = plane.frame.z;
        let piece =
            |k: usize| Piece { centre: plane.point(boxes.place(k, [0.5; 2])), normal, area: boxes.area(k), power: flux * shares[k] };
        let pieces: Vec<Piece> = (0..shares.len()).map(piece).collect();
        let block = |pieces: &[Piece]| {
            let power: f32 = pieces.iter().map(|p| p.power).sum();
            let centre = pieces.iter().map(|p| p.centre * p.power).sum::<Vec3>() / power.max(f32::MIN_POSITIVE);
            Piece { centre, normal, area: pieces.iter().map(|p| p.area).sum(), power }
        };
        let blocks: Vec<Piece> = pieces.chunks(WIDE).map(block).collect();
        Self { plane, boxes, blocks: calibrated(&blocks, spots), eights: calibrated(&pieces, spots).chunks(WIDE).map(Eight::new).collect() }
    }

    /// Its blocks.
    pub(crate) fn blocks(&self) -> &[Piece] {
        &self.blocks
    }

    /// Its rectangle in the plane.
    pub(crate) fn extent(&self) -> [[f32; 2]; 2] {
        [self.boxes.lo, self.boxes.hi]
    }

    /// What arrives on average at `spots`.
    pub(crate) fn mean(&self, spots: &[Spot]) -> f32 {
        let packed: Vec<Eight> = self.blocks.chunks(WIDE).map(Eight::new).collect();
        let arrives = |spot: &Spot| packed.iter().map(|eight| eight.arrives(spot).reduce_add()).sum::<f32>();
        spots.iter().map(arrives).sum::<f32>() / spots.len() as f32
    }

    /// A direction from `spot` to a place in block `block`: the box by `u`, the place in it by `v`. Zero where there is none.
    pub(crate) fn sample(&self, block: usize, spot: &Spot, u: f32, v: [f32; 2]) -> Vec3 {
        let sends = self.eights[block].arrives(spot);
        let Some((lane, _)) = choose(sends, u * sends.reduce_add()) else { return Vec3::ZERO };
        (self.plane.point(self.boxes.place(block * WIDE + lane, v)) - spot.position).normalize_or_zero()
    }

    /// Block of the box at `place`, and the density per m² of [`Self::sample`] there if it goes to that block.
    #[inline]
    pub(crate) fn density(&self, spot: &Spot, place: [f32; 2]) -> (usize, f32) {
        let Some(k) = self.boxes.find(place) else { return (0, 0.0) };
        let sends = self.eights[k / WIDE].arrives(spot);
        let all = sends.reduce_add();
        (k / WIDE, if all > 0.0 { sends.as_array()[k % WIDE] / (all * self.boxes.area(k)) } else { 0.0 })
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.blocks.capacity() * size_of::<Piece>() + self.eights.capacity() * size_of::<Eight>() + self.boxes.bytes()
    }
}

/// Directions about a normal where nothing better is known: boxes over the unit square of the cosine law, each with what arrives from it.
#[derive(Debug, Clone, PartialEq)]
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
        let mut records: Vec<([f32; 2], f32)> = flights.map(|(d, w)| (square(frame.to_local(d)), w)).collect();
        let (boxes, shares) = Boxes::new(&mut records, [0.0; 2], [1.0; 2]);
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
        self.frame.to_world(warp::cosine_hemisphere(self.boxes.place(k, v)))
    }

    /// Density per sr.
    #[inline]
    pub(crate) fn density(&self, d: Vec3) -> f32 {
        let local = self.frame.to_local(d);
        if local.z <= 0.0 {
            return 0.0;
        }
        let Some(k) = self.boxes.find(square(local)) else { return 0.0 };
        let p = self.sums[k] - if k == 0 { 0.0 } else { self.sums[k - 1] };
        p / self.boxes.area(k) * local.z * FRAC_1_PI
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + 4 * self.sums.capacity() + self.boxes.bytes()
    }
}

/// The square's point that the cosine law maps to `d`: the inverse of the concentric map (Shirley and Chiu 1997).
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
