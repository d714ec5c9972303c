//! Cracks: rough surfaces.
//!
//! Fracture surfaces of concrete are self-affine: heights at a distance r differ by r^H, with H
//! about 0.8 for all brittle matter (Bouchaud 1997, J. Phys. Condens. Matter 9, 4319). The relief
//! is a sum of waves whose lengths halve and whose amplitudes follow that law (Weierstrass and
//! Mandelbrot's function).

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use intrados_stage::random::Key;
use rayon::prelude::*;

use super::{Body, Kind, Recipe, recipe};

/// Hurst's exponent.
pub(super) const HURST: f64 = 0.8;
/// Waves of one length.
const WAVES: u32 = 7;
/// Distance at which the roughness is given, m.
pub(super) const SPAN: f64 = 0.016;
/// Most nodes of a map along one side.
const NODES: f64 = 1600.0;
/// Steepest slope.
const STEEPEST: f64 = 3.0;

/// How a crack takes the grains in its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// Along their surface.
    Round,
    /// Through them.
    Through,
}

/// A self-affine height over the plane.
#[derive(Debug, Clone)]
pub struct Relief {
    /// Wave vectors, amplitudes, phases.
    waves: Vec<(DVec2, f64, f64)>,
}

impl Relief {
    /// With waves from `longest` down to `shortest` (m), whose heights at two points 16 mm apart
    /// differ by `roughness` (root mean square, m).
    #[must_use]
    pub fn new(longest: f64, shortest: f64, roughness: f64, key: Key) -> Self {
        let mut waves = Vec::new();
        let mut length = longest;
        while length >= shortest && waves.len() < 20 * WAVES as usize {
            for _ in 0..WAVES {
                let i = waves.len() as u32;
                let (phi, phase) = (PI * key.unit64(4 * i), TAU * key.unit64(4 * i + 1));
                let stretched = length * (0.75 + 0.5 * key.unit64(4 * i + 2));
                waves.push((
                    TAU / stretched * DVec2::from_angle(phi),
                    stretched.powf(HURST),
                    phase,
                ));
            }
            length *= 0.5;
        }
        let mut relief = Self { waves };
        let scale = roughness / relief.difference(SPAN).max(1e-300);
        relief.waves.iter_mut().for_each(|w| w.1 *= scale);
        relief
    }

    /// Root mean square difference of the heights of two points `r` apart, over all phases and
    /// directions of r.
    #[must_use]
    pub(crate) fn difference(&self, r: f64) -> f64 {
        let n = 24;
        let mean = |k: DVec2| {
            (0..n)
                .map(|i| (k.dot(DVec2::from_angle(PI * f64::from(i) / f64::from(n))) * r).cos())
                .sum::<f64>()
                / f64::from(n)
        };
        self.waves.iter().map(|(k, a, _)| a * a * (1.0 - mean(*k))).sum::<f64>().sqrt()
    }

    /// m.
    #[must_use]
    pub fn height(&self, p: DVec2) -> f64 {
        self.waves.iter().map(|(k, a, phase)| a * (k.dot(p) + phase).cos()).sum()
    }
}

/// A crack with the heights of its middle over its mean plane, on a map.
#[derive(Debug, Clone)]
pub(super) struct Surface {
    plan: recipe::Crack,
    across: DVec3,
    /// First node, pitch, nodes along `inward` and `across`.
    from: DVec2,
    pitch: f64,
    nodes: [usize; 2],
    heights: Vec<f64>,
    /// Lowest and highest.
    range: [f64; 2],
}

impl Surface {
    pub(super) fn new(
        recipe: &Recipe,
        plan: &recipe::Crack,
        number: usize,
        bodies: &[Body],
    ) -> Self {
        let across = plan.normal.cross(plan.inward);
        let reach = 2.0 * recipe.outline.reach() + recipe.height;
        let side = if plan.normal.z.abs() > 0.7 {
            recipe.outline.reach()
        } else {
            recipe.outline.reach().max(0.5 * recipe.height)
        };
        let from = DVec2::new(-0.1 * plan.depth.min(reach), -side);
        let size = DVec2::new(1.1 * plan.depth.min(reach), 2.0 * side);
        let pitch = (0.5 * recipe.finest).max(size.max_element() / NODES);
        let nodes = [0, 1].map(|k| (size[k] / pitch).ceil() as usize + 2);
        let key = Key::new(recipe.seed, number as u64 | 4 << 40);
        let relief = Relief::new(size.max_element(), 2.0 * pitch, plan.roughness, key);
        let row = |j: usize| {
            let relief = &relief;
            (0..nodes[0]).map(move |i| relief.height(from + pitch * DVec2::new(i as f64, j as f64)))
        };
        // The mouth's own place is where it was planted.
        let zero = relief.height(DVec2::ZERO);
        let heights: Vec<f64> =
            (0..nodes[1]).into_par_iter().flat_map_iter(row).map(|h| h - zero).collect();
        let mut surface =
            Self { plan: *plan, across, from, pitch, nodes, heights, range: [0.0; 2] };
        if plan.round {
            surface.round(bodies);
        }
        surface.range = surface
            .heights
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| [a.min(*h), b.max(*h)]);
        surface
    }

    /// Lifts the surface over the grains whose middle lies below it, and lowers it under the
    /// others.
    fn round(&mut self, bodies: &[Body]) {
        let before = self.clone();
        for body in bodies.iter().filter(|b| b.kind == Kind::Rock) {
            let [a, b, c] = self.local(body.centre);
            let Some((h, _)) = before.height(a, b).filter(|(h, _)| (c - h).abs() < body.reach())
            else {
                continue;
            };
            let reach = body.reach();
            let at = |v: f64, k: usize| {
                (((v - self.from[k]) / self.pitch).max(0.0) as usize).min(self.nodes[k] - 1)
            };
            for j in at(b - reach, 1)..=at(b + reach, 1) {
                for i in at(a - reach, 0)..=at(a + reach, 0) {
                    let [u, v] =
                        [self.from.x + self.pitch * i as f64, self.from.y + self.pitch * j as f64];
                    let foot = self.plan.mouth + u * self.plan.inward + v * self.across;
                    let node = j * self.nodes[0] + i;
                    let height = before.heights[node];
                    if let Some([low, high]) = body
                        .crossed(foot, self.plan.normal)
                        .filter(|[low, high]| (low..=high).contains(&&height))
                    {
                        self.heights[node] = if h > c { high } else { low };
                    }
                }
            }
        }
    }

    /// Coordinates along `inward`, across, and normal.
    fn local(&self, p: DVec3) -> [f64; 3] {
        let d = p - self.plan.mouth;
        [d.dot(self.plan.inward), d.dot(self.across), d.dot(self.plan.normal)]
    }

    /// Height and slopes; None beyond the map.
    fn height(&self, a: f64, b: f64) -> Option<(f64, DVec2)> {
        let at = (DVec2::new(a, b) - self.from) / self.pitch;
        if at.x < 0.0
            || at.y < 0.0
            || at.x >= (self.nodes[0] - 1) as f64
            || at.y >= (self.nodes[1] - 1) as f64
        {
            return None;
        }
        let (i, j, t) = (at.x as usize, at.y as usize, at.fract());
        let h = |di: usize, dj: usize| self.heights[(j + dj) * self.nodes[0] + i + di];
        let (low, high) =
            (h(0, 0) + t.x * (h(1, 0) - h(0, 0)), h(0, 1) + t.x * (h(1, 1) - h(0, 1)));
        let along = (1.0 - t.y) * (h(1, 0) - h(0, 0)) + t.y * (h(1, 1) - h(0, 1));
        Some((low + t.y * (high - low), DVec2::new(along, high - low) / self.pitch))
    }

    /// Area of the surface over that of its plane, within the planted depth.
    #[cfg(test)]
    pub(super) fn stretch(&self) -> f64 {
        let (mut sum, mut n) = (0.0, 0);
        for j in 0..self.nodes[1] - 1 {
            for i in 0..self.nodes[0] - 1 {
                let at = self.from + self.pitch * DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
                if let Some((_, slope)) =
                    self.height(at.x, at.y).filter(|_| (0.0..self.plan.depth).contains(&at.x))
                {
                    sum += (1.0 + slope.length_squared()).sqrt();
                    n += 1;
                }
            }
        }
        sum / f64::from(n)
    }

    /// Opening at a depth below the mouth.
    fn width(&self, a: f64) -> f64 {
        let left = (self.plan.depth - a) / (0.1 * self.plan.depth);
        self.plan.width * left.clamp(0.0, 1.0)
    }

    /// Whether any of it may be within `reach` of `p`.
    pub(super) fn near(&self, p: DVec3, reach: f64) -> bool {
        let [a, _, c] = self.local(p);
        let wide = reach + 0.5 * self.plan.width * (1.0 + STEEPEST);
        a < self.plan.depth + reach && c > self.range[0] - wide && c < self.range[1] + wide
    }

    /// Which of 64 points of a voxel at `p` with the given sides lie in the opening. Cracks are
    /// thinner than the points are apart, so each point stands anywhere in its own 64th of the
    /// voxel: without bias on average.
    pub(super) fn mask(&self, p: DVec3, voxel: DVec3, key: Key) -> u64 {
        let half = 0.5 * voxel.length();
        if !self.near(p, half) {
            return 0;
        }
        let [a, b, c] = self.local(p);
        let Some((h, slope)) = self.height(a, b) else { return 0 };
        let slope = slope.clamp_length_max(STEEPEST);
        let steep = (1.0 + slope.length_squared()).sqrt();
        if (c - h).abs() / steep > 0.5 * self.plan.width + half {
            return 0;
        }
        let mut mask = 0;
        for i in 0..64_u32 {
            let at = |shift: u32, d: u32| {
                (f64::from(i >> shift & 3) + f64::from(key.unit(3 * i + d))) * 0.25 - 0.5
            };
            let offset = voxel * DVec3::new(at(0, 0), at(2, 1), at(4, 2));
            let [u, v] = [offset.dot(self.plan.inward), offset.dot(self.across)];
            let off = c + offset.dot(self.plan.normal) - h - slope.dot(DVec2::new(u, v));
            if off.abs() < 0.5 * steep * self.width(a + u) {
                mask |= 1 << i;
            }
        }
        mask
    }
}
