//! Grains and pores: ellipsoids, of which planes may have cut pieces.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};
use intrados_stage::random::Key;

/// What a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A grain of aggregate.
    Rock,
    /// A pore.
    Pore,
}

/// An ellipsoid ∩ half-spaces: convex, and star-shaped about its centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// What it is.
    pub kind: Kind,
    /// m.
    pub centre: DVec3,
    /// Of the ball of the same volume, m.
    pub diameter: f64,
    /// Density over that of its rock.
    pub tone: f32,
    /// From an offset to the frame in which the ellipsoid is the unit ball.
    unit: DMat3,
    /// In that frame: normals and distances.
    cuts: Vec<(DVec3, f64)>,
    /// Half axes and their directions, m.
    axes: DMat3,
    /// Half axes, m.
    half: DVec3,
}

/// Directions over the ball, evenly (Fibonacci's spiral).
fn directions(n: usize) -> impl Iterator<Item = DVec3> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    (0..n).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let (s, c) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * c, r * s, z)
    })
}

impl Body {
    /// Of `diameter` with half axes in the proportion of `shape`, turned at random; `cuts` planes
    /// make it angular.
    #[must_use]
    pub fn new(kind: Kind, diameter: f64, shape: DVec3, cuts: usize, key: Key) -> Self {
        let u = |d: u32| key.unit64(d);
        // A quaternion evenly over all rotations (Shoemake 1992).
        let (a, b, c) = (u(0), TAU * u(1), TAU * u(2));
        let (r, s) = ((1.0 - a).sqrt(), a.sqrt());
        let turn = DMat3::from_quat(
            DQuat::from_xyzw(r * b.sin(), r * b.cos(), s * c.sin(), s * c.cos()).normalize(),
        );
        let cuts: Vec<(DVec3, f64)> = (0..cuts as u32)
            .map(|i| {
                let (z, phi) = (2.0 * u(16 + 3 * i) - 1.0, TAU * u(17 + 3 * i));
                let across = (1.0 - z * z).sqrt();
                (DVec3::new(across * phi.cos(), across * phi.sin(), z), 0.62 + 0.3 * u(18 + 3 * i))
            })
            .collect();
        // Volume over the ball's, from the radius in all directions of the unit frame.
        let left = match cuts.len() {
            0 => 1.0,
            _ => directions(256).map(|d| radius(&cuts, d).powi(3)).sum::<f64>() / 256.0,
        };
        let half = shape * (0.5 * diameter / (left * shape.element_product()).cbrt());
        let axes = turn * DMat3::from_diagonal(half);
        let unit = DMat3::from_diagonal(half.recip()) * turn.transpose();
        Self { kind, centre: DVec3::ZERO, diameter, tone: 1.0, unit, cuts, axes, half }
    }

    /// The same, scaled to another diameter.
    #[must_use]
    pub(crate) fn scaled(mut self, diameter: f64) -> Self {
        let by = diameter / self.diameter;
        (self.unit, self.axes) = (self.unit * by.recip(), self.axes * by);
        self.half *= by;
        self.diameter = diameter;
        self
    }

    /// m³.
    #[must_use]
    pub fn volume(&self) -> f64 {
        PI / 6.0 * self.diameter.powi(3)
    }

    /// Half axes, m.
    #[must_use]
    pub fn half(&self) -> DVec3 {
        self.half
    }

    /// Half sides of a box around it, m.
    #[must_use]
    pub fn extent(&self) -> DVec3 {
        let rows = self.axes.transpose();
        DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length())
    }

    /// Largest distance of a point from the centre, m.
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.half.max_element()
    }

    /// Negative within; in units of the half axes, changing by at most |Δp|/`least` from point to
    /// point.
    #[inline]
    #[must_use]
    pub fn depth(&self, p: DVec3) -> f64 {
        let q = self.unit * (p - self.centre);
        self.cuts.iter().fold(q.length() - 1.0, |m, (n, d)| m.max(n.dot(q) - d))
    }

    /// The smallest half axis, m.
    #[inline]
    #[must_use]
    pub fn least(&self) -> f64 {
        self.half.min_element()
    }

    /// Whether `p` lies within.
    #[inline]
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        let q = self.unit * (p - self.centre);
        q.length_squared() < 1.0 && self.cuts.iter().all(|(n, d)| n.dot(q) < *d)
    }

    /// Where the line through `p` along `way` is within: distances from `p`.
    #[must_use]
    pub(crate) fn crossed(&self, p: DVec3, way: DVec3) -> Option<[f64; 2]> {
        let (q, w) = (self.unit * (p - self.centre), self.unit * way);
        let (a, b, c) = (w.length_squared(), q.dot(w), q.length_squared() - 1.0);
        let root = b * b - a * c;
        if root <= 0.0 {
            return None;
        }
        let root = root.sqrt();
        let (mut from, mut to) = ((-b - root) / a, (-b + root) / a);
        for (n, d) in &self.cuts {
            let (along, rest) = (n.dot(w), d - n.dot(q));
            if along > 1e-12 {
                to = to.min(rest / along);
            } else if along < -1e-12 {
                from = from.max(rest / along);
            } else if rest < 0.0 {
                return None;
            }
        }
        (from < to).then_some([from, to])
    }

    /// Share of its volume between two heights: exact for ellipsoids, which pores are.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> f64 {
        let extent = self.extent().z;
        // Share of a ball below the height t (−1 to 1).
        let below = |z: f64| {
            let t = ((z - self.centre.z) / extent).clamp(-1.0, 1.0);
            0.25 * (t + 1.0).powi(2) * (2.0 - t)
        };
        below(to) - below(from)
    }

    /// Points of its surface, evenly over the directions of its own frame.
    pub(super) fn surface(&self, n: usize) -> impl Iterator<Item = DVec3> + '_ {
        directions(n).map(|d| self.centre + self.axes * (d * radius(&self.cuts, d)))
    }
}

/// Distance of the surface along the unit vector `d`, in the unit frame.
fn radius(cuts: &[(DVec3, f64)], d: DVec3) -> f64 {
    cuts.iter().fold(
        1.0,
        |r: f64, (n, distance)| if n.dot(d) * r > *distance { distance / n.dot(d) } else { r },
    )
}
