//! Scattering by a free electron at rest (Klein and Nishina 1929), forward and backward.
//!
//! k = E′/E = 1/(1 + α(1 − c)), α = E/m_e c², c = cosθ; dσ/dΩ = (r_e²/2) k²(k + 1/k − sin²θ).
//! [`shape`] is what stands behind r_e²/2.

use intrados_stage::random::Draw;
use std::f64::consts::{PI, TAU};

/// m_e c², keV.
pub(crate) const ELECTRON: f64 = 510.998_95;

/// E′/E for the cosine `c`.
#[inline]
#[must_use]
pub fn ratio(kev: f64, c: f64) -> f64 {
    1.0 / (1.0 + kev / ELECTRON * (1.0 - c))
}

/// E of a photon that is left with `kev` after being turned by `c`; infinite where no energy is
/// enough.
#[inline]
#[must_use]
pub(crate) fn energy_before(kev: f64, c: f64) -> f64 {
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
    2.0 * TAU
        * ((1.0 + a) / (a * a) * (2.0 * (1.0 + a) / b - l / a) + l / (2.0 * a)
            - (1.0 + 3.0 * a) / (b * b))
}

/// The two laws in k between `low` and 1 that both ways are drawn from: 1/k and k, with their
/// integrals.
#[derive(Debug, Clone, Copy)]
struct Laws {
    low: f64,
    log: f64,
    square: f64,
}

impl Laws {
    fn new(low: f64) -> Self {
        Self { low, log: -low.ln(), square: 0.5 * (1.0 - low * low) }
    }

    /// One of the two, by inversion.
    #[inline]
    fn sample(&self, draw: &mut Draw) -> f64 {
        if draw.unit() * (self.log + self.square) < self.log {
            (-self.log * draw.unit()).exp()
        } else {
            (self.low * self.low + 2.0 * self.square * draw.unit()).sqrt()
        }
    }
}

/// Photons of one energy that are about to scatter. In k the density is (1/k + k)(1 − k sin²θ/(1 +
/// k²)): one of the first two by inversion, the last by rejection (Butcher and Messel 1960).
#[derive(Debug, Clone, Copy)]
pub struct Forward {
    /// E, keV.
    pub kev: f64,
    laws: Laws,
}

impl Forward {
    /// Of `kev`.
    #[must_use]
    pub fn new(kev: f64) -> Self {
        Self { kev, laws: Laws::new(1.0 / (1.0 + 2.0 * kev / ELECTRON)) }
    }

    /// The cosine after scattering.
    #[must_use]
    pub fn sample(&self, draw: &mut Draw) -> f64 {
        let a = self.kev / ELECTRON;
        loop {
            let k = self.laws.sample(draw);
            let t = (1.0 - k) / (a * k);
            if draw.unit() < 1.0 - k * t * (2.0 - t) / (1.0 + k * k) {
                return 1.0 - t;
            }
        }
    }
}

/// The way back: photons that are left with one energy and had at most another. Cosines are drawn
/// by the density k + 1/k over c = 1 − (1 − k)·m_e c²/E′.
///
/// The adjoint kernel is dσ/dΩ(E, c)·dE/dE′ = dσ/dΩ/k², that is k + 1/k − sin²θ, between half of it
/// and all of it.
#[derive(Debug, Clone, Copy)]
pub struct Backward {
    /// E′, keV.
    pub kev: f64,
    laws: Laws,
    /// ∫ (k + 1/k) dΩ over the ways back: what is drawn from.
    pub total: f64,
}

impl Backward {
    /// Left with `kev`, of at most `most`.
    #[must_use]
    pub fn new(kev: f64, most: f64) -> Self {
        // The least k with which that can be.
        let laws = Laws::new((kev / most).max(1.0 - 2.0 * kev / ELECTRON).min(1.0));
        Self { kev, laws, total: TAU * ELECTRON / kev * (laws.square + laws.log) }
    }

    /// The cosine before.
    #[must_use]
    pub fn sample(&self, draw: &mut Draw) -> f64 {
        (1.0 - (1.0 - self.laws.sample(draw)) * ELECTRON / self.kev).clamp(-1.0, 1.0)
    }

    /// Its density per sr.
    #[must_use]
    pub fn density(&self, c: f64) -> f64 {
        let k = 1.0 - self.kev / ELECTRON * (1.0 - c);
        if k < self.laws.low * (1.0 - 1e-12) || self.total <= 0.0 {
            0.0
        } else {
            (k + 1.0 / k) / self.total
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;
    use intrados_transport::chi2::{Grid, rectangle};

    /// Thomson's limit 8π/3 r_e² = 6.652e-29 m², and quadrature over the angle (trapezoid in c, 2e5
    /// points, error 1e-9).
    #[test]
    fn total_is_the_integral() {
        let r = 2.817_940_3e-15_f64;
        assert!((0.5 * r * r * total(1e-6) / 6.652_458e-29 - 1.0).abs() < 1e-6);
        for kev in [0.4, 0.6, 10.0, 59.3, 300.0, 450.0] {
            let n = 200_000;
            let sum: f64 =
                (0..n).map(|i| shape(kev, -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n))).sum();
            assert!((TAU * sum * 2.0 / f64::from(n) / total(kev) - 1.0).abs() < 1e-7, "{kev}");
        }
    }

    const GRID: Grid = Grid { bounds: [[-1.0, 1.0], [0.0, 1.0]], cells: [200, 4] };

    #[test]
    fn samples_follow_the_density() {
        for kev in [10.0, 100.0, 450.0] {
            let draw = |i| {
                let mut draw = Draw::new(Key::new(1, i));
                Some([Forward::new(kev).sample(&mut draw), draw.unit()])
            };
            // Density of a direction, per sr, all around the axis.
            let density = |c| TAU * shape(kev, c) / total(kev);
            let chi = rectangle(GRID, 1_000_000, draw, |[c, _]| density(c));
            assert!(chi.passes(6), "{kev}: {chi:?}");
            let backward = Backward::new(kev, 460.0);
            let back = |i| {
                let mut draw = Draw::new(Key::new(2, i));
                Some([backward.sample(&mut draw), draw.unit()])
            };
            let chi = rectangle(GRID, 1_000_000, back, |[c, _]| TAU * backward.density(c));
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
