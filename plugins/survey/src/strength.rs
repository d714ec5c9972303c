//! Strength and stiffness against what the class promises.
//!
//! | reading | becomes | source |
//! |---|---|---|
//! | core | cylinder's strength: × .82 of a core as long as wide, × 1 of one twice as long | EN 13791:2019, 8 |
//! | in a structure | .85 of the mean strength of the class, ± 15 % between structures, 8 % within one | EN 13791:2019, 8.1; errors ours |
//! | rebound | cube = 1.05 (.01078 R² + .904 R − 12.91) MPa, mean curve of the hammer's maker, R from 15 to 55; cylinder .8 of it; ± 25 % | Proceq's curve B; error ours (RILEM TC 249 finds 15 to 40 %) |
//! | velocity | stiffness goes with v²; of sound concrete v = √(E_d (1 − ν)/(ρ (1 + ν)(1 − 2ν))), E_d = E_c/.83; ± 4 % | EN 12504-4; Lydon and Balendran 1986; error ours |
//!
//! Where the class itself is assumed, what it promises is off by four tenths more.

use intrados_mechanics::material::concrete::{Class, secant_modulus};
use intrados_scene::{
    Scene,
    structure::{Course, Shows},
};
use intrados_stage::Estimate;

use crate::site::{ByZone, Placed};

/// Mean strength in a structure over that of the class.
const IN_STRUCTURE: f64 = 0.85;
/// Relative error of that between structures, and of a place within one.
const BETWEEN: f64 = 0.15;
const WITHIN: f64 = 0.08;
/// Relative error of the hammer's curve.
const CURVE: f64 = 0.25;
/// Relative error of the velocity that a class promises.
const PROMISED_VELOCITY: f64 = 0.04;
/// What an assumed class is off by: see `forecast`.
const ASSUMED: f64 = 0.4;
/// Rebound numbers that the maker's curve holds for.
const NUMBERS: std::ops::RangeInclusive<f64> = 15.0..=55.0;

/// What a member's class promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Concrete {
    /// Mean strength of cylinders, MPa.
    pub(crate) mean_mpa: f64,
    /// Of a pulse in sound concrete, m/s.
    pub(crate) velocity: f64,
    /// Relative error of the strength, and of the velocity, of an assumed class; else 0.
    assumed: [f64; 2],
}

impl Concrete {
    pub(crate) fn of(scene: &Scene, index: usize) -> Self {
        let member = &scene.members[index];
        let own = scene.structure.concrete(&member.concrete).map(|c| f64::from(c.fck_mpa) * 1e6);
        let class = member.concrete.parse::<Class>().ok().map(|c| c.fck);
        let known = own.or(class);
        Self::of_strength(known.unwrap_or(30e6), member.concrete_assumed || known.is_none())
    }

    /// Of a class by its name.
    #[cfg(test)]
    pub(crate) fn named(class: &str) -> Self {
        Self::of_strength(class.parse::<Class>().unwrap().fck, false)
    }

    fn of_strength(fck: f64, is_assumed: bool) -> Self {
        // The modulus goes with the strength's .3th power, the velocity with its root.
        let assumed = if is_assumed { [ASSUMED, 0.15 * ASSUMED] } else { [0.0; 2] };
        let mean = fck + 8e6;
        let dynamic = secant_modulus(mean) / 0.83;
        let (poisson, density) = (0.2, 2400.0);
        let velocity = (dynamic * (1.0 - poisson)
            / (density * (1.0 + poisson) * (1.0 - 2.0 * poisson)))
            .sqrt();
        Self { mean_mpa: 1e-6 * mean, velocity, assumed }
    }
}

/// A ratio of what was found to what was promised, and its own error and that which others of its
/// kind share.
struct Ratio {
    value: f64,
    own: f64,
    shared: f64,
}

/// Share of the stiffness that is lost, by zone: by velocities, and where cracks make a net.
pub(crate) fn stiffness(concrete: &Concrete, placed: &[Placed]) -> ByZone {
    let velocity = |p: &Placed| match p.shows {
        Shows::Velocity { m_s, std_error_m_s } => {
            let value = (m_s / concrete.velocity).powi(2);
            let [own, shared] = [std_error_m_s / m_s, PROMISED_VELOCITY.hypot(concrete.assumed[1])];
            Some(Ratio { value, own: 2.0 * value * own, shared: 2.0 * value * shared })
        }
        // Expansion that has opened a net of cracks of half a millimetre has taken about a third of
        // the modulus (Institution of Structural Engineers 1992, in proportion; ± .2 ours).
        Shows::Crack { width_mm, course: Course::Map, .. } => {
            let value = 1.0 - 0.33 * (width_mm / 0.5).min(2.0);
            Some(Ratio { value, own: 0.2, shared: 0.0 })
        }
        _ => None,
    };
    by_zone(placed, &[&velocity])
}

/// Share of the strength that is lost, by zone: by cores and rebound numbers.
pub(crate) fn strength(concrete: &Concrete, placed: &[Placed]) -> ByZone {
    let promised = IN_STRUCTURE * concrete.mean_mpa;
    let shared = |value: f64, more: f64| value * BETWEEN.hypot(concrete.assumed[0]).hypot(more);
    let core = |p: &Placed| match *p.shows {
        Shows::CoreStrength { mpa, std_error_mpa, diameter_mm, length_mm } => {
            let slender = (length_mm / diameter_mm.max(1.0)).clamp(1.0, 2.0);
            let value = (0.82 + 0.18 * (slender - 1.0)) * mpa / promised;
            // Cores thinner than thrice the largest grain of 32 mm scatter the more.
            let thin = (100.0 / diameter_mm.max(10.0)).max(1.0);
            let own = value * (std_error_mpa / mpa).hypot(WITHIN * thin);
            Some(Ratio { value, own, shared: shared(value, 0.0) })
        }
        _ => None,
    };
    let rebound = |p: &Placed| match *p.shows {
        Shows::Rebound { number, std_error } => {
            let n = number.clamp(*NUMBERS.start(), *NUMBERS.end());
            let cylinder = 0.8 * 1.05 * (0.01078 * n * n + 0.904 * n - 12.91);
            let slope = 0.8 * 1.05 * (0.02156 * n + 0.904);
            let value = cylinder / promised;
            let own = (slope * std_error / promised).hypot(value * WITHIN);
            Some(Ratio { value, own, shared: shared(value, CURVE) })
        }
        _ => None,
    };
    by_zone(placed, &[&core, &rebound])
}

/// The loss of each zone by several kinds of readings: the mean of each kind, and kinds by inverse
/// variance. More than was promised is no loss.
fn by_zone(placed: &[Placed], kinds: &[&dyn Fn(&Placed) -> Option<Ratio>]) -> ByZone {
    std::array::from_fn(|zone| {
        let inside = |p: &&Placed| (p.zones[0]..=p.zones[1]).contains(&zone);
        let means: Vec<Estimate> = kinds
            .iter()
            .filter_map(|kind| {
                let ratios: Vec<Ratio> = placed.iter().filter(inside).filter_map(kind).collect();
                let n = ratios.len() as f64;
                let mean = |of: fn(&Ratio) -> f64| ratios.iter().map(of).sum::<f64>() / n;
                let own = ratios.iter().map(|r| r.own * r.own).sum::<f64>().sqrt() / n;
                (n > 0.0).then(|| Estimate {
                    value: 1.0 - mean(|r| r.value),
                    std_error: own.hypot(mean(|r| r.shared)),
                })
            })
            .collect();
        let precision: f64 = means.iter().map(|m| m.std_error.powi(-2)).sum();
        let sum: f64 = means.iter().map(|m| m.value * m.std_error.powi(-2)).sum();
        (precision > 0.0).then(|| Estimate {
            value: (sum / precision).clamp(0.0, 1.0),
            std_error: precision.sqrt().recip(),
        })
    })
}
