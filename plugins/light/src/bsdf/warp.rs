//! From the unit square to disks, hemispheres, cones, spheres and triangles, and orthonormal
//! frames: what BSDFs and lamps share.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// The largest f32 below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// An orthonormal frame whose z axis is a given normal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent.
    pub y: Vec3,
    /// The normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit vector `z`, without branches (Duff et al., "Building an orthonormal
    /// basis, revisited", JCGT 2017).
    #[inline]
    #[must_use]
    pub fn new(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// World → local.
    #[inline]
    #[must_use]
    pub(crate) fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Local → world.
    #[inline]
    #[must_use]
    pub(crate) fn to_world(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// sin and cos of x within ±π/4, by their series to x⁹ and x⁸: within an f32 rounding, and far
/// cheaper than the general ones.
#[inline]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let q = x * x;
    let sin = x
        * (1.0
            + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q * (1.0 / 362_880.0)))));
    let cos = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q * (1.0 / 40_320.0))));
    (sin, cos)
}

/// Uniform in the unit disk, density 1/π: the concentric map of Shirley & Chiu (1997), which keeps
/// neighbours together.
#[inline]
#[must_use]
pub(crate) fn disk(u: [f32; 2]) -> Vec2 {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    let across = a.abs() > b.abs();
    let (r, t) = if across { (a, b) } else { (b, a) };
    let (sin, cos) = sin_cos_octant(if r == 0.0 { 0.0 } else { FRAC_PI_4 * (t / r) });
    if across { Vec2::new(r * cos, r * sin) } else { Vec2::new(r * sin, r * cos) }
}

/// Cosine-weighted on the upper hemisphere, density cosθ/π (Malley): z is never negative.
#[inline]
#[must_use]
pub(crate) fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let d = disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of `cosine_hemisphere`, per sr, at a direction with this cosine to the normal; 0 below.
#[inline]
#[must_use]
pub(crate) fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// Direction at height `z` and azimuth 2π`u`.
#[inline]
pub(crate) fn at_height(z: f32, u: f32) -> Vec3 {
    let (sin, cos) = (2.0 * PI * u).sin_cos();
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// Uniform on the unit sphere, density 1/4π.
#[inline]
#[must_use]
pub(crate) fn sphere(u: [f32; 2]) -> Vec3 {
    at_height(1.0 - 2.0 * u[0], u[1])
}

/// Uniform in the cone around z whose half angle has cosine `cos_max`; density `cone_pdf`.
#[inline]
#[must_use]
pub(crate) fn cone(u: [f32; 2], cos_max: f32) -> Vec3 {
    at_height(1.0 - u[0] * (1.0 - cos_max), u[1])
}

/// Density of `cone`, per sr.
#[inline]
#[must_use]
pub(crate) fn cone_pdf(cos_max: f32) -> f32 {
    1.0 / (2.0 * PI * (1.0 - cos_max))
}

/// Barycentric weights of the second and third corner, uniform over a triangle (Turk 1990).
#[inline]
#[must_use]
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    let s = u[0].sqrt();
    [s * (1.0 - u[1]), s * u[1]]
}

/// A choice among finitely many things with fixed probabilities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Discrete {
    /// `cdf[i]` is the probability of all before i; one longer than the choices, the last entry 1.
    cdf: Vec<f32>,
    /// Probability of each.
    probability: Vec<f32>,
    /// Entry k of n: the choice of u = k/n, from where it is not far to that of any u up to (k +
    /// 1)/n.
    guide: Vec<u32>,
    total: f64,
}

impl Discrete {
    /// Probabilities in proportion to `weights`: what is negative or not finite counts as 0. `None`
    /// where nothing is left to choose.
    #[must_use]
    pub(crate) fn new(weights: &[f32]) -> Option<Self> {
        let clean = |w: f32| if w.is_finite() && w > 0.0 { f64::from(w) } else { 0.0 };
        let total: f64 = weights.iter().map(|&w| clean(w)).sum();
        if total <= 0.0 {
            return None;
        }
        let mut sum = 0.0;
        let mut cdf = Vec::with_capacity(weights.len() + 1);
        cdf.push(0.0);
        for &w in weights {
            sum += clean(w);
            cdf.push((sum / total) as f32);
        }
        // The probability that a uniform number really meets, rounding of the sums included.
        let probability = cdf.windows(2).map(|c| c[1] - c[0]).collect();
        let n = weights.len();
        let guide = (0..n)
            .map(|k| cdf[1..n].partition_point(|&c| c <= k as f32 / n as f32) as u32)
            .collect();
        Some(Self { cdf, probability, guide, total })
    }

    /// Whether what was stored can choose: no search leaves its tables.
    #[must_use]
    pub(crate) fn is_consistent(&self) -> bool {
        let n = self.probability.len();
        n > 0
            && self.cdf.len() == n + 1
            && self.guide.len() == n
            && self.guide.iter().all(|i| (*i as usize) < n)
            && self.cdf.first() == Some(&0.0)
            && self.cdf.last().is_some_and(|last| *last > BELOW_ONE)
            && self.cdf.windows(2).all(|c| c[0] <= c[1])
    }

    /// Sum of the weights.
    #[must_use]
    pub(crate) fn total(&self) -> f64 {
        self.total
    }

    /// Number of things.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.probability.len()
    }

    /// Probability of `index`; 0 beyond the end.
    #[inline]
    #[must_use]
    pub(crate) fn probability(&self, index: usize) -> f32 {
        self.probability.get(index).copied().unwrap_or(0.0)
    }

    /// Which one the uniform number `u` chooses.
    #[inline]
    #[must_use]
    pub(crate) fn choose(&self, u: f32) -> usize {
        // Below the last entry of the table, which is 1: no search leaves it.
        let u = u.clamp(0.0, BELOW_ONE);
        let mut index = self.guide[((u * self.len() as f32) as usize).min(self.len() - 1)] as usize;
        while self.cdf[index + 1] <= u {
            index += 1;
        }
        // The product may have been rounded up.
        while self.cdf[index] > u {
            index -= 1;
        }
        index
    }

    /// Which one the uniform number `u` chooses, its probability, and what is left of `u`: uniform
    /// again.
    #[inline]
    #[must_use]
    pub(crate) fn sample(&self, u: f32) -> (usize, f32, f32) {
        let index = self.choose(u);
        let p = self.probability[index];
        (index, p, ((u - self.cdf[index]) / p).clamp(0.0, BELOW_ONE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for i in 0..10_000 {
            let n = sphere(Key::new(1, i).pair(0));
            let f = Frame::new(n);
            assert!((f.x.cross(f.y) - f.z).length() < 2e-6, "{f:?}");
            assert!((f.x.length() - 1.0).abs() < 1e-6 && f.x.dot(f.z).abs() < 1e-6);
            let v = sphere(Key::new(2, i).pair(0));
            assert!((f.to_world(f.local(v)) - v).length() < 2e-6);
        }
        for n in [
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::new(0.0, 0.0, -1.0).normalize(),
            Vec3::new(1e-5, 0.0, -1.0).normalize(),
        ] {
            assert!((Frame::new(n).x.cross(Frame::new(n).y) - n).length() < 1e-6);
        }
    }

    #[test]
    fn the_short_series_is_as_good_as_the_library() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (s, c) = sin_cos_octant(x);
            assert!((s - x.sin()).abs() < 1.3e-7 && (c - x.cos()).abs() < 1.3e-7, "{x}");
        }
    }

    #[test]
    fn a_discrete_choice_never_takes_the_impossible() {
        let choice = Discrete::new(&[0.0, 1.0, 0.0, 3.0, f32::NAN, -1.0, 0.0]).unwrap();
        for i in 0..=1000 {
            let (index, p, rest) = choice.sample((i as f32 / 1000.0).min(BELOW_ONE));
            assert!(p > 0.0 && p == choice.probability(index) && (0.0..1.0).contains(&rest));
            assert_eq!(index, if (i as f32 / 1000.0) < 0.25 { 1 } else { 3 });
        }
        let weights: Vec<f32> = (0..1000).map(|i| Key::new(4, i).unit(0).powi(8)).collect();
        let choice = Discrete::new(&weights).unwrap();
        for i in 0..100_000 {
            let u = Key::new(5, i).unit(0);
            assert_eq!(
                choice.sample(u).0,
                choice.cdf[1..choice.len()].partition_point(|&c| c <= u)
            );
        }
        assert!(Discrete::new(&[0.0, f32::INFINITY]).is_none() && Discrete::new(&[]).is_none());
    }
}
