//! Bars with ribs, and what corrosion leaves of them.

use std::f64::consts::TAU;

use glam::DVec3;
use intrados_stage::random::Key;

use super::recipe::Bar;

/// Waves of the pattern of pits round and along a bar.
const WAVES: usize = 12;
/// Volume of rust over that of the steel it came from, as far as it stays at the bar.
const SWELLING: f64 = 1.6;

/// A bar ready to be asked.
#[derive(Debug, Clone)]
pub(super) struct Rod {
    bar: Bar,
    /// Round number, along (rad/m), phase.
    waves: [[f64; 3]; WAVES],
}

/// What is at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    Steel,
    Rust,
    Nothing,
}

impl Rod {
    pub(super) fn new(bar: &Bar, seed: u64, number: usize) -> Self {
        let key = Key::new(seed, number as u64 | 2 << 40);
        let waves = std::array::from_fn(|i| {
            let u = |k: u32| key.unit64(3 * i as u32 + k);
            let length = bar.radius * (1.5 + 8.0 * u(0));
            [(4.0 * u(1)).floor(), TAU / length, TAU * u(2)]
        });
        Self { bar: bar.clone(), waves }
    }

    /// Largest distance from the line at which there may be anything.
    pub(super) fn reach(&self) -> f64 {
        self.bar.radius * (1.0 + SWELLING * self.bar.loss).sqrt() * 1.08
    }

    /// Boxes that together hold all of it.
    pub(super) fn boxes(&self) -> impl Iterator<Item = [DVec3; 2]> + '_ {
        let reach = DVec3::splat(1.5 * self.reach());
        self.bar.line.windows(2).map(move |w| [w[0].min(w[1]) - reach, w[0].max(w[1]) + reach])
    }

    /// Distance from its outermost surface, negative within.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        self.bar
            .line
            .windows(2)
            .map(|w| (p - nearest(w[0], w[1], p).0).length())
            .fold(f64::INFINITY, f64::min)
            - self.reach()
    }

    /// Whether piece `piece` of the line may have anything within `half` of `p`.
    pub(super) fn near(&self, piece: usize, p: DVec3, half: f64) -> bool {
        (p - nearest(self.bar.line[piece], self.bar.line[piece + 1], p).0).length()
            < self.reach() + half
    }

    /// What piece `piece` of the line has at `p`.
    pub(super) fn at(&self, piece: usize, p: DVec3) -> Found {
        let (a, b) = (self.bar.line[piece], self.bar.line[piece + 1]);
        let (foot, along) = nearest(a, b, p);
        let off = p - foot;
        let r = off.length();
        let bar = self.bar.radius;
        if r > self.reach() {
            return Found::Nothing;
        }
        let (u, v) = (b - a).normalize_or_zero().any_orthonormal_pair();
        let angle = off.dot(v).atan2(off.dot(u));
        let mut outer = bar;
        if self.bar.ribbed {
            // Two rows of slanting ribs, 0.6 diameters apart and 6 % of the radius high (EN 10080);
            // core and ribs have the nominal area together.
            let phase = (along / (1.2 * bar) + 0.35 * angle.sin()).rem_euclid(1.0);
            let rib = if phase < 0.2 && angle.sin().abs() > 0.25 { 0.06 } else { 0.0 };
            outer *= 0.991 + rib;
        }
        if self.bar.loss <= 0.0 {
            return if r < outer { Found::Steel } else { Found::Nothing };
        }
        // Pits: the loss times a pattern of mean 1 that never is below 0 or above what there is.
        let swing = (1.0_f64).min(0.98 / self.bar.loss - 1.0).max(0.0);
        let wave: f64 =
            self.waves.iter().map(|[n, k, phase]| (n * angle + k * along + phase).cos()).sum();
        let pits = 1.0 + swing * (wave * (2.0 / WAVES as f64).sqrt() * 0.45).clamp(-1.0, 1.0);
        if r < outer * (1.0 - self.bar.loss * pits).max(0.0).sqrt() {
            return Found::Steel;
        }
        let rust = bar * (1.0 + (SWELLING - 1.0) * self.bar.loss * pits).sqrt();
        if r < rust { Found::Rust } else { Found::Nothing }
    }

    /// Pieces of the line that come into a range of heights, with their boxes.
    pub(super) fn pieces(
        &self,
        from: f64,
        to: f64,
    ) -> impl Iterator<Item = (usize, [DVec3; 2])> + '_ {
        self.boxes().enumerate().filter(move |(_, [a, b])| a.z < to && b.z > from)
    }
}

/// The nearest point of a piece of line, and how far along it is.
fn nearest(a: DVec3, b: DVec3, p: DVec3) -> (DVec3, f64) {
    let d = b - a;
    let length = d.length();
    let t = ((p - a).dot(d) / (length * length).max(1e-30)).clamp(0.0, 1.0);
    (a + t * d, t * length)
}
