//! What is cut out of a surface: a piece of a crack's mouth, or missing cover.

use glam::{DVec2, DVec3, dvec2, vec2};
use intrados_stage::random::Key;

use super::course::Rib;
use crate::finish::noise::{octaves, smooth};

/// Corners of a spall's rim.
const ROUND: usize = 40;

/// A piece of surface that is pushed inward.
#[derive(Debug, Clone)]
pub(super) enum Zone {
    /// A crack's mouth between two ribs.
    Slot([Rib; 2]),
    /// Missing cover.
    Bowl(Bowl),
}

/// Missing cover, with a rough rim and a rough floor.
#[derive(Debug, Clone)]
pub(super) struct Bowl {
    pub(super) centre: DVec3,
    /// Unit, out of the concrete.
    pub(super) outward: DVec3,
    /// m.
    pub(super) radius: f64,
    /// m.
    pub(super) depth: f64,
    /// Which mesh its floor goes to; none: to that of the cracks.
    pub(super) spall: Option<usize>,
    pub(super) key: Key,
}

impl Bowl {
    fn axes(&self) -> (DVec3, DVec3) {
        self.outward.any_orthonormal_pair()
    }

    /// Distance of the rim from the centre at an angle, m.
    fn rim(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let p = vec2(cos as f32, sin as f32);
        let rough = 0.35 * smooth(self.key, p * 1.1) + 0.3 * octaves(self.key, p, 0.4, 3, 0.6, 0.0);
        self.radius * f64::from(0.85 + rough).clamp(0.45, 1.1)
    }

    fn corner(&self, k: usize) -> DVec3 {
        let angle = std::f64::consts::TAU * k as f64 / ROUND as f64;
        let ((u, v), (sin, cos)) = (self.axes(), angle.sin_cos());
        self.centre + self.rim(angle) * (cos * u + sin * v)
    }

    /// How deep the floor is below a place of the surface, m: steep at the rim, uneven in the
    /// middle.
    fn depth_at(&self, p: DVec3) -> f64 {
        let (u, v) = self.axes();
        let flat = dvec2((p - self.centre).dot(u), (p - self.centre).dot(v));
        let share = flat.length() / self.rim_of_corners(flat).max(1e-9);
        if share >= 1.0 {
            return 0.0;
        }
        let at = (flat / self.radius).as_vec2();
        let rough = octaves(Key(self.key.0, !self.key.1), at, 0.9, 5, 0.6, 0.0);
        let form = (1.0 - share.powi(3)).powf(0.6);
        self.depth * form * f64::from(0.8 + 0.55 * rough).clamp(0.25, 1.0)
    }

    /// The rim as it is cut, straight between corners.
    fn rim_of_corners(&self, flat: DVec2) -> f64 {
        let (u, v) = self.axes();
        let angle = flat.y.atan2(flat.x).rem_euclid(std::f64::consts::TAU);
        let k = (angle / std::f64::consts::TAU * ROUND as f64) as usize;
        let corner = |k: usize| {
            let p = self.corner(k % ROUND) - self.centre;
            dvec2(p.dot(u), p.dot(v))
        };
        let (a, b) = (corner(k), corner(k + 1));
        let way = flat.normalize_or(DVec2::X);
        // The ray from the centre meets the side a–b.
        a.perp_dot(b - a) / way.perp_dot(b - a)
    }
}

impl Zone {
    /// Unit, out of the concrete: along it the zone is laid onto triangles.
    pub(super) fn outward(&self) -> DVec3 {
        match self {
            Self::Slot([a, b]) => (a.outward + b.outward).normalize_or(a.outward),
            Self::Bowl(bowl) => bowl.outward,
        }
    }

    /// How far from a triangle's plane it may be to lie on it, m.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Self::Slot([a, b]) => 1e-3 + 0.5 * a.at.distance(b.at),
            Self::Bowl(bowl) => 2e-3 + 0.4 * bowl.radius,
        }
    }

    /// Lowest and highest corner.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        match self {
            Self::Slot([a, b]) => {
                let all = [a.lips[0], a.lips[1], b.lips[0], b.lips[1]];
                let low = all.into_iter().reduce(DVec3::min).unwrap_or(a.at);
                let high = all.into_iter().reduce(DVec3::max).unwrap_or(a.at);
                let slack = DVec3::splat(self.reach());
                [low - slack, high + slack]
            }
            Self::Bowl(bowl) => {
                let slack = DVec3::splat(1.2 * bowl.radius);
                [bowl.centre - slack, bowl.centre + slack]
            }
        }
    }

    /// The triangles that make it up.
    pub(super) fn triangles(&self) -> Vec<[DVec3; 3]> {
        match self {
            Self::Slot([a, b]) => {
                vec![[a.lips[0], b.lips[0], b.lips[1]], [a.lips[0], b.lips[1], a.lips[1]]]
            }
            Self::Bowl(bowl) => (0..ROUND)
                .map(|k| [bowl.centre, bowl.corner(k), bowl.corner((k + 1) % ROUND)])
                .collect(),
        }
    }

    /// Its border, but for where the next piece of the same crack begins.
    pub(super) fn border(&self) -> Vec<[DVec3; 2]> {
        match self {
            Self::Slot([a, b]) => (0..2).map(|k| [a.lips[k], b.lips[k]]).collect(),
            Self::Bowl(bowl) => {
                (0..ROUND).map(|k| [bowl.corner(k), bowl.corner((k + 1) % ROUND)]).collect()
            }
        }
    }

    /// Where a place of its mouth lies on its floor.
    pub(super) fn floor(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Slot([a, b]) => {
                let way = b.at - a.at;
                let t = ((p - a.at).dot(way) / way.length_squared().max(1e-18)).clamp(0.0, 1.0);
                let outward = a.outward.lerp(b.outward, t).normalize_or(a.outward);
                p - (a.depth + (b.depth - a.depth) * t) * outward
            }
            Self::Bowl(bowl) => p - bowl.depth_at(p) * bowl.outward,
        }
    }

    /// Points that its floor needs to be rough: each with the distance that it keeps, m.
    pub(super) fn inner(&self) -> Vec<(DVec3, f64)> {
        let Self::Bowl(bowl) = self else { return Vec::new() };
        let pitch = (bowl.radius / if bowl.spall.is_some() { 16.0 } else { 5.0 }).max(1e-3);
        let n = (bowl.radius / pitch).ceil() as i32;
        let (u, v) = bowl.axes();
        let mut points = Vec::new();
        for i in -n..=n {
            for j in -n..=n {
                let number = ((i + n) * (2 * n + 1) + j + n) as u32;
                let jitter = bowl.key.pair(2 * number);
                let [x, y] = [(i, jitter[0]), (j, jitter[1])]
                    .map(|(i, u)| (f64::from(i) + 0.8 * (f64::from(u) - 0.5)) * pitch);
                if x.hypot(y) < 0.95 * bowl.rim_of_corners(dvec2(x, y)) {
                    points.push((bowl.centre + x * u + y * v, 0.3 * pitch));
                }
            }
        }
        points
    }
}
