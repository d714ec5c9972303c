//! Lobes: where the light (or the importance) that reaches a cell comes from, as densities over directions.
//!
//! A *focus plane* is the place where the flights of a bundle come closest to each other: the opening that they all pass, or the surface that they
//! come from. A density over that plane is right for every point of the cell, where one over directions would be smeared by parallax.

use glam::Vec3;

/// A plane across a coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Focus {
    pub(crate) axis: usize,
    pub(crate) at: f32,
}

/// A density over a rectangle: strips of equal counts of records, boxes of equal counts in each. The boxes are small where records are dense,
/// and each has the share of their sum that fell into it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Boxes {
    /// Strips, and boxes in a strip.
    n: usize,
    /// n + 1 bounds of the strips.
    strips: Vec<f32>,
    /// n times n + 1 bounds of boxes.
    bounds: Vec<f32>,
    /// Summed probabilities of the n² boxes, the last is 1.
    sums: Vec<f32>,
}

/// Share of a density that is spread evenly over its boxes, since a box where nothing was seen may not be dark.
const EVEN: f32 = 0.1;
/// Records that a box should have.
const PER_BOX: usize = 20;
/// Most strips.
const STRIPS: usize = 16;

impl Boxes {
    /// From places and weights (not all 0) of records within `[lo, hi]`; reorders them. Deterministic in their order.
    pub(crate) fn new(records: &mut [([f32; 2], f32)], lo: [f32; 2], hi: [f32; 2]) -> Self {
        let n = (((records.len() / PER_BOX) as f32).sqrt() as usize).clamp(1, STRIPS);
        let mut boxes = Self { n, strips: vec![lo[0]], bounds: Vec::new(), sums: Vec::new() };
        let total: f32 = records.iter().map(|r| r.1).sum::<f32>().max(f32::MIN_POSITIVE);
        records.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let count = records.len();
        // Thinner boxes would be missed by rounding on the way from a place to a direction and back.
        let thin = [0, 1].map(|k| 1e-3 * (hi[k] - lo[k]));
        let mut sum = 0.0;
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
                if width * (low - bottom) > 0.0 {
                    sum += (1.0 - EVEN) * part.iter().map(|r| r.1).sum::<f32>() / total + EVEN / (n * n) as f32;
                }
                boxes.sums.push(sum);
            }
        }
        for s in &mut boxes.sums {
            *s /= sum;
        }
        boxes
    }

    /// A place: the box by `u`, the place in it by `v`. Density is [`Self::density`].
    pub(crate) fn sample(&self, u: f32, v: [f32; 2]) -> [f32; 2] {
        let k = self.sums.partition_point(|&s| s <= u).min(self.sums.len() - 1);
        let (i, j) = (k / self.n, k % self.n);
        let row = &self.bounds[i * (self.n + 1)..(i + 1) * (self.n + 1)];
        let between = |a: f32, b: f32, t: f32| a + (b - a) * t;
        [between(self.strips[i], self.strips[i + 1], v[0]), between(row[j], row[j + 1], v[1])]
    }

    /// Probability density at a place, 0 outside.
    #[inline]
    pub(crate) fn density(&self, [x, y]: [f32; 2]) -> f32 {
        if !(x >= self.strips[0] && x <= self.strips[self.n]) {
            return 0.0;
        }
        let i = search(&self.strips[1..self.n], x);
        let row = &self.bounds[i * (self.n + 1)..(i + 1) * (self.n + 1)];
        if !(y >= row[0] && y <= row[self.n]) {
            return 0.0;
        }
        let j = search(&row[1..self.n], y);
        let k = i * self.n + j;
        let p = self.sums[k] - if k == 0 { 0.0 } else { self.sums[k - 1] };
        let area = (self.strips[i + 1] - self.strips[i]) * (row[j + 1] - row[j]);
        if area > 0.0 { p / area } else { 0.0 }
    }

    fn bytes(&self) -> usize {
        4 * (self.strips.capacity() + self.bounds.capacity() + self.sums.capacity()) + size_of::<Self>()
    }
}

/// How many of `bounds` are below `x`.
#[inline]
fn search(bounds: &[f32], x: f32) -> usize {
    bounds.iter().map(|&b| usize::from(b < x)).sum()
}

/// A density over directions from any point of a cell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Lobe {
    /// Over the places of a plane.
    Focus(Focus, Boxes),
    /// Over the unit square of the cosine law about a normal, where nothing better is known.
    Square(crate::bsdf::Frame, Boxes),
}

impl Lobe {
    /// A unit direction from `y`, if there is one.
    pub(crate) fn sample(&self, y: Vec3, u: f32, v: [f32; 2]) -> Vec3 {
        match self {
            Self::Focus(focus, boxes) => {
                let [a, b] = boxes.sample(u, v);
                let mut z = Vec3::splat(focus.at);
                z[(focus.axis + 1) % 3] = a;
                z[(focus.axis + 2) % 3] = b;
                (z - y).normalize_or_zero()
            }
            Self::Square(frame, boxes) => frame.to_world(crate::bsdf::warp::cosine_hemisphere(boxes.sample(u, v))),
        }
    }

    /// Density per sr of going from `y` toward the unit vector `d`.
    #[inline]
    pub(crate) fn density(&self, y: Vec3, d: Vec3) -> f32 {
        match self {
            Self::Focus(Focus { axis, at }, boxes) => {
                let t = (at - y[*axis]) / d[*axis];
                if t.is_nan() || t <= 0.0 || t.is_infinite() {
                    return 0.0;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                boxes.density([y[u] + t * d[u], y[v] + t * d[v]]) * t * t / d[*axis].abs()
            }
            Self::Square(frame, boxes) => {
                let local = frame.to_local(d);
                if local.z <= 0.0 {
                    return 0.0;
                }
                boxes.density(square(local)) * local.z * std::f32::consts::FRAC_1_PI
            }
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Focus(_, boxes) | Self::Square(_, boxes) => boxes.bytes(),
        }
    }
}

/// The square's point that the cosine law maps to `d`: the inverse of the concentric map (Shirley and Chiu 1997).
#[inline]
pub(crate) fn square(d: Vec3) -> [f32; 2] {
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
