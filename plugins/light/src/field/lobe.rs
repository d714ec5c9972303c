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

/// A partition of a rectangle: strips of equal counts of records, boxes of equal counts in each. Boxes are small where records are dense.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Boxes {
    /// Strips, and boxes in a strip.
    n: usize,
    /// n + 1 bounds of the strips.
    strips: Vec<f32>,
    /// n times n + 1 bounds of boxes.
    bounds: Vec<f32>,
}

/// Share of what a lobe sends that is spread evenly over its boxes, since a box where nothing was seen may not be dark.
const EVEN: f32 = 0.1;
/// Records that a box should have.
const PER_BOX: usize = 16;
/// Most strips.
const STRIPS: usize = 12;

impl Boxes {
    /// From places and weights of records within `[lo, hi]`; reorders them. Deterministic in their order. Also returns the share of each
    /// box.
    fn new(records: &mut [([f32; 2], f32)], lo: [f32; 2], hi: [f32; 2]) -> (Self, Vec<f32>) {
        let n = (((records.len() / PER_BOX) as f32).sqrt() as usize).clamp(1, STRIPS);
        let (mut boxes, mut shares) = (Self { n, strips: vec![lo[0]], bounds: Vec::new() }, Vec::new());
        let total: f32 = records.iter().map(|r| r.1).sum::<f32>().max(f32::MIN_POSITIVE);
        records.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let count = records.len();
        // Thinner boxes would be missed by rounding on the way from a place to a direction and back.
        let thin = [0, 1].map(|k| (1e-3 * (hi[k] - lo[k])).max(1e-5 * hi[k].abs().max(lo[k].abs())));
        for i in 0..n {
            let strip = &mut records[i * count / n..(i + 1) * count / n];
            let right = strip.last().map_or(hi[0], |r| r.0[0]);
            boxes.strips.push(if i + 1 == n { hi[0] } else { right.max(boxes.strips[i] + thin[0]).min(hi[0]) });
            let width = boxes.strips[i + 1] - boxes.strips[i];
            strip.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
            let m = strip.len();
            let mut low = lo[1];
            boxes.bounds.push(low);
            for k in 0..n {
                let part = &strip[k * m / n..(k + 1) * m / n];
                let top = part.last().map_or(low, |r| r.0[1]);
                let bottom = low;
                low = if k + 1 == n { hi[1] } else { top.max(low + thin[1]).min(hi[1]) };
                boxes.bounds.push(low);
                // A box without an area would be an atom, whose density nobody can tell.
                let share = (1.0 - EVEN) * part.iter().map(|r| r.1).sum::<f32>() / total + EVEN / (n * n) as f32;
                shares.push(if width * (low - bottom) > 0.0 { share } else { 0.0 });
            }
        }
        (boxes, shares)
    }

    /// Corners of box `k`.
    fn extent(&self, k: usize) -> [[f32; 2]; 2] {
        let (i, j) = (k / self.n, k % self.n);
        let row = i * (self.n + 1) + j;
        [[self.strips[i], self.bounds[row]], [self.strips[i + 1], self.bounds[row + 1]]]
    }

    /// The box at a place.
    #[inline]
    fn find(&self, [x, y]: [f32; 2]) -> Option<usize> {
        if !(x >= self.strips[0] && x <= self.strips[self.n]) {
            return None;
        }
        let i = search(&self.strips[1..self.n], x);
        let row = &self.bounds[i * (self.n + 1)..(i + 1) * (self.n + 1)];
        (y >= row[0] && y <= row[self.n]).then(|| i * self.n + search(&row[1..self.n], y))
    }
}

/// How many of `bounds` are below `x`.
#[inline]
fn search(bounds: &[f32], x: f32) -> usize {
    bounds.iter().map(|&b| usize::from(b < x)).sum()
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
    fn meet(&self, y: Vec3, d: Vec3) -> Option<(f32, [f32; 2])> {
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

/// Eight boxes: centres, L·A, A/π.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Eight {
    centre: [f32x8; 3],
    power: f32x8,
    size: f32x8,
}

/// Flat pieces of known radiance.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lobe {
    plane: Plane,
    boxes: Boxes,
    eights: Vec<Eight>,
}

/// A point that light arrives at, and the normal of the side where it does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spot {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

/// cosθ·cosθ′/r² of small pieces, bounded where they are near: A/(πr² + A) is what a disk of area A sends.
#[inline]
fn geometry(spot: &Spot, plane: &Plane, centre: [f32x8; 3], size: f32x8) -> f32x8 {
    let c = f32x8::splat;
    let (y, n, m) = (spot.position, spot.normal, plane.frame.z);
    let d = [centre[0] - c(y.x), centre[1] - c(y.y), centre[2] - c(y.z)];
    let dot = |v: Vec3| d[0].mul_add(c(v.x), d[1].mul_add(c(v.y), d[2] * c(v.z)));
    let squared = d[0].mul_add(d[0], d[1].mul_add(d[1], d[2] * d[2]));
    let cos = dot(n).fast_max(f32x8::ZERO) * dot(m).abs();
    cos / (squared * (squared + size)).fast_max(c(1e-30))
}

impl Lobe {
    /// A lobe in `plane` from the coordinates and fluxes of flights that cross it, which arrive at `spots`. `flux` in all.
    pub(crate) fn new(plane: Plane, records: &mut [([f32; 2], f32)], spots: &[Spot]) -> Self {
        let flux: f32 = records.iter().map(|r| r.1).sum();
        let [lo, hi] = records.iter().fold([[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]], |[lo, hi], (p, _)| {
            [[lo[0].min(p[0]), lo[1].min(p[1])], [hi[0].max(p[0]), hi[1].max(p[1])]]
        });
        let margin = 0.02 + 1.0 / records.len() as f32;
        let pad = [0, 1].map(|k| margin * (hi[k] - lo[k]) + 1e-5 * hi[k].abs().max(lo[k].abs()) + 1e-9);
        let (boxes, shares) = Boxes::new(records, [lo[0] - pad[0], lo[1] - pad[1]], [hi[0] + pad[0], hi[1] + pad[1]]);
        let mut lobe = Self { plane, boxes, eights: Vec::new() };
        for first in (0..shares.len()).step_by(WIDE) {
            let (mut centres, mut power, mut size) = ([[0.0; WIDE]; 3], [0.0; WIDE], [1.0; WIDE]);
            for (lane, k) in (first..shares.len().min(first + WIDE)).enumerate() {
                let [lo, hi] = lobe.boxes.extent(k);
                let centre = plane.point([0.5 * (lo[0] + hi[0]), 0.5 * (lo[1] + hi[1])]);
                (0..3).for_each(|i| centres[i][lane] = centre[i]);
                size[lane] = ((hi[0] - lo[0]) * (hi[1] - lo[1]) * FRAC_1_PI).max(1e-12);
                power[lane] = flux * shares[k];
            }
            let (centre, size) = (centres.map(f32x8::from), f32x8::from(size));
            // flux = power · mean geometry
            let mean = spots.iter().fold(f32x8::ZERO, |sum, spot| sum + geometry(spot, &plane, centre, size)) / f32x8::splat(spots.len() as f32);
            let power = f32x8::from(power);
            let power = mean.simd_gt(f32x8::splat(1e-20)).select(power / mean, f32x8::ZERO);
            lobe.eights.push(Eight { centre, power, size });
        }
        lobe
    }

    /// What arrives at `spot` from all its boxes.
    #[inline]
    pub(crate) fn arrives(&self, spot: &Spot) -> f32 {
        let mut sum = f32x8::ZERO;
        for eight in &self.eights {
            sum = eight.power.mul_add(geometry(spot, &self.plane, eight.centre, eight.size), sum);
        }
        sum.reduce_add()
    }

    /// A direction from `spot` to the box where the sum of what arrives passes `rest`, to the place in it that `v` says.
    pub(crate) fn sample(&self, spot: &Spot, mut rest: f32, v: [f32; 2]) -> Vec3 {
        let mut chosen = None;
        'search: for (i, eight) in self.eights.iter().enumerate() {
            let sends = eight.power * geometry(spot, &self.plane, eight.centre, eight.size);
            let all = sends.reduce_add();
            if rest >= all && chosen.is_some() {
                rest -= all;
                if all > 0.0 {
                    chosen = Some(i * WIDE + last(sends));
                }
                continue;
            }
            for (lane, w) in sends.to_array().into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
                chosen = Some(i * WIDE + lane);
                if rest < w {
                    break 'search;
                }
                rest -= w;
            }
        }
        let Some(k) = chosen else { return Vec3::ZERO };
        let [lo, hi] = self.boxes.extent(k);
        let between = |k: usize| lo[k] + (hi[k] - lo[k]) * v[k];
        (self.plane.point([between(0), between(1)]) - spot.position).normalize_or_zero()
    }

    /// What arrives at `spot` from the box in direction `d`, per sr of the box seen from there: with what arrives in all, a density.
    #[inline]
    pub(crate) fn density(&self, spot: &Spot, d: Vec3) -> f32 {
        let Some((t, place)) = self.plane.meet(spot.position, d) else { return 0.0 };
        let Some(k) = self.boxes.find(place) else { return 0.0 };
        let eight = &self.eights[k / WIDE];
        let sends = eight.power * geometry(spot, &self.plane, eight.centre, eight.size);
        let [lo, hi] = self.boxes.extent(k);
        let area = (hi[0] - lo[0]) * (hi[1] - lo[1]);
        sends.as_array()[k % WIDE] * t * t / (area * self.plane.frame.z.dot(d).abs())
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.eights.capacity() * size_of::<Eight>() + 4 * (self.boxes.strips.capacity() + self.boxes.bounds.capacity())
    }
}

/// The last lane that is not 0.
fn last(of: f32x8) -> usize {
    of.to_array().iter().rposition(|&w| w > 0.0).unwrap_or(0)
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
        let [lo, hi] = self.boxes.extent(k);
        self.frame.to_world(warp::cosine_hemisphere([0, 1].map(|k| lo[k] + (hi[k] - lo[k]) * v[k])))
    }

    /// Density per sr.
    #[inline]
    pub(crate) fn density(&self, d: Vec3) -> f32 {
        let local = self.frame.to_local(d);
        if local.z <= 0.0 {
            return 0.0;
        }
        let Some(k) = self.boxes.find(square(local)) else { return 0.0 };
        let [lo, hi] = self.boxes.extent(k);
        let p = self.sums[k] - if k == 0 { 0.0 } else { self.sums[k - 1] };
        p / ((hi[0] - lo[0]) * (hi[1] - lo[1])) * local.z * FRAC_1_PI
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + 4 * (self.sums.capacity() + self.boxes.strips.capacity() + self.boxes.bounds.capacity())
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
