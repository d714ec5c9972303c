//! Salt: from the surface to the bar, and what rust takes from it then.
//!
//! Chloride follows Fick's second law from a constant surface content, with a diffusion coefficient
//! that falls with age (fib Bulletin 34, model code for service life design): C(x, t) = C₀ + (C_s −
//! C₀)(1 − erf(x/(2√(D t)))), D(t) = D₀ (t₀/t)^a.

use super::{DAY, Error, YEAR, checked};
use statrs::function::erf::{erf, erfc_inv};

/// Ingress of chloride through a face. Contents are in per cent of the cement, or in any other unit
/// that all of them share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ingress {
    /// Content at the surface.
    pub surface: f64,
    /// Content that was mixed in.
    pub initial: f64,
    /// Apparent diffusion coefficient D₀ at the reference age, environment included (k_e k_t
    /// D_RCM), m²/s.
    pub diffusion: f64,
    /// Reference age t₀, s; 28 days.
    pub reference: f64,
    /// Exponent of ageing a: about .3 for CEM I, .45 with fly ash or slag, below 1.
    pub ageing: f64,
}

impl Ingress {
    /// Ingress with D₀ at 28 days.
    ///
    /// # Errors
    ///
    /// If contents are negative, the diffusion coefficient is not between 1e-15 and 1e-8 m²/s, or
    /// ageing not in 0..=.95.
    pub fn new(surface: f64, initial: f64, diffusion: f64, ageing: f64) -> Result<Self, Error> {
        checked("chloride at the surface", surface, 0.0, 100.0, "0 to 100")?;
        checked("initial chloride", initial, 0.0, 100.0, "0 to 100")?;
        checked("chloride diffusion coefficient", diffusion, 1e-15, 1e-8, "1e-15 to 1e-8 m²/s")?;
        checked("exponent of ageing", ageing, 0.0, 0.95, "0 to 0.95")?;
        Ok(Self { surface, initial, diffusion, reference: 28.0 * DAY, ageing })
    }

    /// Apparent diffusion coefficient at `age` (s), m²/s.
    #[must_use]
    pub(crate) fn diffusion_at(&self, age: f64) -> f64 {
        self.diffusion * (self.reference / age.max(1.0)).powf(self.ageing)
    }

    /// Content at `depth` (m) after `time` (s).
    #[must_use]
    pub fn content(&self, depth: f64, time: f64) -> f64 {
        if time <= 0.0 {
            return self.initial;
        }
        let spread = 2.0 * (self.diffusion_at(time) * time).sqrt();
        self.initial + (self.surface - self.initial) * (1.0 - erf(depth.max(0.0) / spread))
    }

    /// When the content at `cover` (m) reaches `critical`, s; infinite if it never does.
    #[must_use]
    pub fn initiation(&self, cover: f64, critical: f64) -> f64 {
        if critical <= self.initial || cover <= 0.0 {
            return 0.0;
        }
        if critical >= self.surface {
            return f64::INFINITY;
        }
        // D t = (x/2z)² with erfc(z) the share of the surface's content; D t = D₀ t₀^a t^(1−a).
        let z = erfc_inv((critical - self.initial) / (self.surface - self.initial));
        let product = (cover / (2.0 * z)).powi(2);
        (product / (self.diffusion * self.reference.powf(self.ageing)))
            .powf(1.0 / (1.0 - self.ageing))
    }
}

/// Depth of steel that a corrosion current (A/m²; 1 µA/cm² is .01 A/m²) takes in `time` (s), m:
/// Faraday's 11.6 µm a year for 1 µA/cm². Times `pitting` (4 to 8 for chloride, González 1995) it
/// is the depth of the deepest pit.
#[must_use]
pub(crate) fn corroded(current: f64, time: f64, pitting: f64) -> f64 {
    1.16e-3 * current.max(0.0) * (time.max(0.0) / YEAR) * pitting.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ingress(ageing: f64) -> Ingress {
        Ingress::new(3.0, 0.1, 5e-12, ageing).unwrap()
    }

    #[test]
    fn content_solves_the_diffusion_equation() {
        let c = ingress(0.0);
        let (x, t) = (0.03, 20.0 * YEAR);
        let by_time = (c.content(x, t * 1.001) - c.content(x, t * 0.999)) / (0.002 * t);
        let curvature =
            (c.content(x + 1e-3, t) - 2.0 * c.content(x, t) + c.content(x - 1e-3, t)) / 1e-6;
        assert!((by_time / (5e-12 * curvature) - 1.0).abs() < 2e-3);
        assert!((c.content(0.0, t) - 3.0).abs() < 1e-12 && (c.content(5.0, t) - 0.1).abs() < 1e-12);
        assert_eq!(c.content(x, 0.0), 0.1);
    }

    #[test]
    fn initiation_is_when_the_critical_content_arrives() {
        for ageing in [0.0, 0.3, 0.6] {
            let c = ingress(ageing);
            let t = c.initiation(0.045, 0.6);
            assert!((c.content(0.045, t) - 0.6).abs() < 1e-8, "{ageing}");
            assert!(c.initiation(0.055, 0.6) > t);
        }
        assert!(ingress(0.6).initiation(0.045, 0.6) > ingress(0.3).initiation(0.045, 0.6));
        assert_eq!(ingress(0.3).initiation(0.045, 3.5), f64::INFINITY);
        assert_eq!(ingress(0.3).initiation(0.045, 0.05), 0.0);
    }

    /// 1 µA/cm² takes 11.6 µm a year (re-derived: M/(2Fρ) = 55.85e-3/(2·96485·7870) m³/C).
    #[test]
    fn faraday() {
        let derived = 0.01 * YEAR * 55.85e-3 / (2.0 * 96_485.0 * 7870.0);
        assert!((corroded(0.01, YEAR, 1.0) / derived - 1.0).abs() < 5e-3);
        assert!((corroded(0.01, 10.0 * YEAR, 1.0) - 0.0116e-3 * 10.0).abs() < 1e-12);
    }
}
