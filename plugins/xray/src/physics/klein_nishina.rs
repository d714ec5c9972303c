//! Scattering by a free electron at rest (Klein and Nishina 1929), forward and backward.
//!
//! k = E′/E = 1/(1 + α(1 − c)), α = E/m_e c², c = cosθ; dσ/dΩ = (r_e²/2) k²(k + 1/k − sin²θ). [`shape`] is what stands behind r_e²/2.

use std::f64::consts::{PI, TAU};

use super::Draw;

/// m_e c², keV.
pub const ELECTRON: f64 = 510.998_95;

/// E′/E for the cosine `c`.
#[inline]
#[must_use]
pub fn ratio(kev: f64, c: f64) -> f64 {
    1.0 / (1.0 + kev / ELECTRON * (1.0 - c))
}

/// E of a photon that is left with `kev` after being turned by `c`; infinite where no energy is enough.
#[inline]
#[must_use]
pub fn energy_before(kev: f64, c: f64) -> f64 {
    let k = 1.0 - kev / ELECTRON * (1.0 - c);
    if k > 0.0 { kev / k } else { f64::INFINITY }
}

/// k²(k + 1/k − sin²θ): the cross section per sr over r_e²/2.
#[inline]
#[must_use]
pub fn shape(kev: f64, c: f64) -> f64 {
    let k = ratio(kev, c);
    k * k * (k + 1.0 / k - 1.0 + c * c)
}

/// ∫ [`shape`] dΩ.
#[must_use]
pub fn total(kev: f64) -> f64 {
    let a = kev / ELECTRON;
    if a < 1e-3 {
        // The closed form cancels; the series does not: σ = (8π/3) r_e² (1 − 2α + 26α²/5 …).
        return 16.0 * PI / 3.0 * (1.0 - 2.0 * a + 5.2 * a * a);
    }
    let (b, l) = (1.0 + 2.0 * a, (2.0 * a).ln_1p());
    2.0 * TAU * ((1.0 + a) / (a * a) * (2.0 * (1.0 + a) / b - l / a) + l / (2.0 * a) - (1.0 + 3.0 * a) / (b * b))
}

/// Density of a direction, per sr.
#[derive(Debug, Clone, Copy)]
pub struct KleinNishina {
    kev: f64,
    total: f64,
}

impl KleinNishina {
    /// For photons of `kev`.
    #[must_use]
    pub fn new(kev: f64) -> Self {
        Self { kev, total: total(kev) }
    }

    /// Per sr.
    #[must_use]
    pub fn pdf(&self, c: f64) -> f64 {
        shape(self.kev, c) / self.total
    }
}

/// The cosine after scattering. In k the density is (1/k + k)(1 − k sin²θ/(1 + k²)): one of the first two by inversion, the last by rejection
/// (Butcher and Messel 1960).
#[must_use]
pub fn sample(kev: f64, draw: &mut Draw) -> f64 {
    let a = kev / ELECTRON;
    let low = 1.0 / (1.0 + 2.0 * a);
    let (log, square) = (-low.ln(), 0.5 * (1.0 - low * low));
    loop {
        let k = if draw.unit() * (log + square) < log {
            (-log * draw.unit()).exp()
        } else {
            (low * low + (1.0 - low * low) * draw.unit()).sqrt()
        };
        let t = (1.0 - k) / (a * k);
        if draw.unit() < 1.0 - k * t * (2.0 - t) / (1.0 + k * k) {
            return 1.0 - t;
        }
    }
}

/// Least k = E′/E with which a photon of at most `most` keV can be left with `kev`.
fn least(kev: f64, most: f64) -> f64 {
    (kev / most).max(1.0 - 2.0 * kev / ELECTRON).min(1.0)
}

/// The way back: cosine of a photon that is left with `kev` and had at most `most`, by the density k + 1/k over c = 1 − (1 − k)·m_e c²/E′.
///
/// The adjoint kernel is dσ/dΩ(E, c)·dE/dE′ = dσ/dΩ/k², that is k + 1/k − sin²θ, between half of it and all of it.
#[must_use]
pub fn adjoint_sample(kev: f64, most: f64, draw: &mut Draw) -> f64 {
    let low = least(kev, most);
    let (log, square) = (-low.ln(), 0.5 * (1.0 - low * low));
    let k =
        if draw.unit() * (log + square) < log { (-log * draw.unit()).exp() } else { (low * low + (1.0 - low * low) * draw.unit()).sqrt() };
    (1.0 - (1.0 - k) * ELECTRON / kev).clamp(-1.0, 1.0)
}

/// ∫ (k + 1/k) dΩ over the ways back: what [`adjoint_sample`] draws from.
#[must_use]
pub fn adjoint_total(kev: f64, most: f64) -> f64 {
    let low = least(kev, most);
    TAU * ELECTRON / kev * (0.5 * (1.0 - low * low) - low.ln())
}

/// Density per sr of [`adjoint_sample`].
#[must_use]
pub fn adjoint_density(kev: f64, most: f64, c: f64) -> f64 {
    let low = least(kev, most);
    let k = 1.0 - kev / ELECTRON * (1.0 - c);
    let norm = adjoint_total(kev, most);
    if k < low * (1.0 - 1e-12) || norm <= 0.0 { 0.0 } else { (k + 1.0 / k) / norm }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;
    use intrados_transport::chi2::{Grid, rectangle};

    /// Thomson's limit 8π/3 r_e² = 6.652e-29 m², and quadrature over the angle (trapezoid in c, 2e5 points, error 1e-9).
    #[test]
    fn total_is_the_integral() {
        let r = 2.817_940_3e-15_f64;
        assert!((0.5 * r * r * total(1e-6) / 6.652_458e-29 - 1.0).abs() < 1e-6);
        for kev in [0.4, 0.6, 10.0, 59.3, 300.0, 450.0] {
            let n = 200_000;
            let sum: f64 = (0..n).map(|i| shape(kev, -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n))).sum();
            assert!((TAU * sum * 2.0 / f64::from(n) / total(kev) - 1.0).abs() < 1e-7, "{kev}");
        }
    }

    const GRID: Grid = Grid { bounds: [[-1.0, 1.0], [0.0, 1.0]], cells: [200, 4] };

    #[test]
    fn samples_follow_the_density() {
        for kev in [10.0, 100.0, 450.0] {
            let draw = |i| {
                let mut draw = Draw::new(Key::new(1, i));
                Some([sample(kev, &mut draw), draw.unit()])
            };
            let density = KleinNishina::new(kev);
            let chi = rectangle(GRID, 1_000_000, draw, |[c, _]| TAU * density.pdf(c));
            assert!(chi.passes(6), "{kev}: {chi:?}");
            let back = |i| {
                let mut draw = Draw::new(Key::new(2, i));
                Some([adjoint_sample(kev, 460.0, &mut draw), draw.unit()])
            };
            let chi = rectangle(GRID, 1_000_000, back, |[c, _]| TAU * adjoint_density(kev, 460.0, c));
            assert!(chi.passes(6), "adjoint {kev}: {chi:?}");
        }
    }

    #[test]
    fn back_and_forth() {
        for (kev, c) in [(450.0, -1.0), (100.0, 0.3), (30.0, 1.0)] {
            assert!((energy_before(kev * ratio(kev, c), c) / kev - 1.0).abs() < 1e-12);
        }
        assert!(energy_before(300.0, -1.0).is_infinite());
    }
}
