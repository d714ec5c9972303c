//! The Kelvin chain: creep in constant time and memory a step.
//!
//! Strain under a varying stress is the superposition ε(t) = ∫ J(t, t′) dσ(t′), which would
//! remember every step. A chain of Kelvin units replaces it: J(t, t′) = 1/E(t′) + Σ_μ (1 −
//! e^(−(t−t′)/τ_μ))/E_μ(t′) with retardation times τ_μ spread over the logarithm of time and
//! compliances fitted for every age t′ at loading by non-negative least squares, so that the
//! material never gives energy back. Integrated exactly for stress that changes linearly over a
//! step (exponential algorithm, Bažant 1971), it is stable for steps of any length:
//!
//! β = e^(−Δt/τ),  λ = (1 − β) τ/Δt,  Δε = Δσ/E + Σ (1−λ)/E_μ Δσ + Σ (1−β) γ_μ,  γ_μ ← β γ_μ + λ
//! Δσ/E_μ.
//!
//! The chain is driven by a strain-like `drive` = C_ν·σ with the unit compliance C_ν (modulus 1),
//! in Pa, so that creep in three dimensions keeps the elastic Poisson's ratio.

use super::DAY;
use super::creep::Creep;
use crate::tensor::{Voigt, ZERO};
use nalgebra::{DMatrix, DVector};

/// Number of Kelvin units.
pub(crate) const UNITS: usize = 10;

/// Retardation time of the first unit of a fitted chain, s.
const FIRST: f64 = 2e-3 * DAY;

/// Each following unit is slower by this factor: the last one has 2e4 days. (A factor of ten leaves
/// ripples of 1.2 % in J.)
const FACTOR: f64 = 6.0;

/// Ages at loading of the table, per decade.
const AGES_PER_DECADE: i32 = 8;

/// The tabulated ages, days: 10^−0.5 to 10^5.
const AGES: std::ops::RangeInclusive<i32> = -AGES_PER_DECADE / 2..=5 * AGES_PER_DECADE;

/// Strain in the units: what the chain remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History(pub [Voigt; UNITS]);

impl Default for History {
    fn default() -> Self {
        Self([ZERO; UNITS])
    }
}

/// A chain of Kelvin units whose compliances depend on age.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Retardation times τ_μ, s.
    times: [f64; UNITS],
    /// 1/E_μ (1/Pa) at the ages of `AGES`; a single row for a chain that does not age.
    table: Vec<[f64; UNITS]>,
}

/// What a chain does in one step, for all points of equal age.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Increment {
    /// Creep strain per change of `drive` within the step, Σ(1−λ)/E_μ, 1/Pa.
    pub delayed: f64,
    /// β_μ.
    decay: [f64; UNITS],
    /// λ_μ/E_μ, 1/Pa.
    gain: [f64; UNITS],
}

impl Chain {
    /// A chain that does not creep.
    #[must_use]
    pub(crate) fn rigid() -> Self {
        Self { times: [DAY; UNITS], table: vec![[0.0; UNITS]] }
    }

    /// A chain that does not age, of units (E_μ in Pa, τ_μ in s); at most [`UNITS`] of them count.
    #[must_use]
    pub(crate) fn constant(units: &[(f64, f64)]) -> Self {
        let mut chain = Self::rigid();
        for (i, &(modulus, time)) in units.iter().take(UNITS).enumerate() {
            chain.times[i] = time;
            chain.table[0][i] = 1.0 / modulus;
        }
        chain
    }

    /// The chain that creeps as the code says, at any age at loading. Its compliance is within .5 %
    /// of the code's J from a quarter of an hour to a century.
    #[must_use]
    pub(crate) fn fit(creep: &Creep) -> Self {
        let times = std::array::from_fn(|i| FIRST * FACTOR.powi(i as i32));
        let table = AGES
            .map(|k| {
                fit_at(creep, &times, DAY * 10f64.powf(f64::from(k) / f64::from(AGES_PER_DECADE)))
            })
            .collect();
        Self { times, table }
    }

    /// 1/E_μ at `age` (s), linear in its logarithm.
    fn compliances(&self, age: f64) -> [f64; UNITS] {
        let last = self.table.len() - 1;
        let position =
            (age / DAY).max(1e-9).log10() * f64::from(AGES_PER_DECADE) - f64::from(*AGES.start());
        let position = position.clamp(0.0, last as f64);
        let below = (position as usize).min(last);
        let (a, b, w) =
            (&self.table[below], &self.table[(below + 1).min(last)], position - below as f64);
        std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
    }

    /// A step of `duration` (s) at the age of [`middle`]; of no length, it is the moment of
    /// loading.
    ///
    /// Duration and age are apart because heat makes concrete older than its duration.
    #[must_use]
    pub(crate) fn increment(&self, duration: f64, age: f64) -> Increment {
        let dt = duration.max(0.0);
        let mut increment = Increment { delayed: 0.0, decay: [1.0; UNITS], gain: [0.0; UNITS] };
        for (i, &compliance) in self.compliances(age).iter().enumerate() {
            let x = dt / self.times[i];
            // λ = (1 − e^(−x))/x; its series where the quotient would cancel.
            let lambda = if x > 1e-5 { -(-x).exp_m1() / x } else { 1.0 - 0.5 * x };
            increment.decay[i] = (-x).exp();
            increment.gain[i] = lambda * compliance;
            increment.delayed += (1.0 - lambda) * compliance;
        }
        increment
    }
}

/// The age at which a step is evaluated: the geometric mean, since ageing runs on a logarithmic
/// clock.
#[must_use]
pub(crate) fn middle(from: f64, to: f64) -> f64 {
    if to > from { (from.max(0.01 * to) * to).sqrt() } else { to }
}

impl Increment {
    /// Creep strain of the step that comes from the past alone, Σ(1−β)γ.
    #[must_use]
    pub(crate) fn past(&self, history: &History) -> Voigt {
        std::array::from_fn(|c| (0..UNITS).map(|i| (1.0 - self.decay[i]) * history.0[i][c]).sum())
    }

    /// What the chain remembers after a step in which `drive` changed by `change`.
    #[must_use]
    pub(crate) fn advance(&self, history: &History, change: &Voigt) -> History {
        History(std::array::from_fn(|i| {
            std::array::from_fn(|c| self.decay[i] * history.0[i][c] + self.gain[i] * change[c])
        }))
    }
}

/// Compliances of the units under load since age `t0`: least relative error of J over load
/// durations from 10^−2.5 to 10^4.6 days.
fn fit_at(creep: &Creep, times: &[f64; UNITS], t0: f64) -> [f64; UNITS] {
    let durations: Vec<f64> = (-25..=46).map(|k| DAY * 10f64.powf(f64::from(k) / 10.0)).collect();
    let weight = |t: f64| 1.0 / creep.compliance(t0 + t, t0);
    let modulus = creep.reference_modulus();
    let matrix = DMatrix::from_fn(durations.len(), UNITS, |r, c| {
        -(-durations[r] / times[c]).exp_m1() * weight(durations[r]) / modulus
    });
    let right = DVector::from_fn(durations.len(), |r, _| {
        creep.phi(t0 + durations[r], t0) * weight(durations[r]) / modulus
    });
    let x = non_negative_least_squares(&matrix, &right);
    std::array::from_fn(|i| x[i] / modulus)
}

/// min ‖A x − b‖ with x ≥ 0 (Lawson and Hanson 1974, algorithm NNLS).
fn non_negative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let n = a.ncols();
    let mut x = DVector::zeros(n);
    let mut free: Vec<usize> = Vec::new();
    for _ in 0..10 * n {
        let gradient = a.transpose() * (b - a * &x);
        let tolerance = 1e-12 * b.norm();
        let Some(best) = (0..n)
            .filter(|i| !free.contains(i))
            .max_by(|&i, &j| gradient[i].total_cmp(&gradient[j]))
        else {
            break;
        };
        if gradient[best] <= tolerance {
            break;
        }
        free.push(best);
        while !free.is_empty() {
            let columns = a.select_columns(&free);
            let Ok(z) = columns.svd(true, true).solve(b, 1e-14) else { return x };
            let blocking = (0..free.len()).filter(|&k| z[k] <= 0.0);
            let step = blocking.map(|k| x[free[k]] / (x[free[k]] - z[k])).fold(1.0, f64::min);
            for (k, &i) in free.iter().enumerate() {
                x[i] += step * (z[k] - x[i]);
            }
            if step >= 1.0 {
                break;
            }
            for &i in &free {
                if x[i] <= 1e-15 {
                    x[i] = 0.0;
                }
            }
            free.retain(|&i| x[i] > 0.0);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::super::concrete::Code;
    use super::super::creep::tests::member;
    use super::*;

    /// One stress component through the chain: strain under `stress(t)` given at the ends of steps.
    fn strain(chain: &Chain, modulus: impl Fn(f64) -> f64, ages: &[f64], stress: f64) -> Vec<f64> {
        let mut history = History::default();
        let load = [stress, 0.0, 0.0, 0.0, 0.0, 0.0];
        let first = chain.increment(0.0, ages[0]);
        let mut total =
            stress / modulus(ages[0]) + first.delayed * stress + first.past(&history)[0];
        history = first.advance(&history, &load);
        let mut out = vec![total];
        for pair in ages.windows(2) {
            let step = chain.increment(pair[1] - pair[0], middle(pair[0], pair[1]));
            total += step.past(&history)[0];
            history = step.advance(&history, &ZERO);
            out.push(total);
        }
        out
    }

    /// Both codes, young and old, over load durations of .01 to 4e4 days: within .5 % of J.
    #[test]
    fn chain_follows_the_compliance_of_the_codes() {
        for code in [Code::Ec2, Code::Mc2010] {
            for (fcm, size) in [(30.0, 0.1), (38.0, 0.3), (58.0, 1.0)] {
                let creep = member(code, fcm, size);
                let chain = Chain::fit(&creep);
                for t0 in [1.0, 7.0, 28.0, 100.0, 3650.0] {
                    let durations: Vec<f64> =
                        (-20..=46).map(|k| 10f64.powf(f64::from(k) / 10.0)).collect();
                    let mut ages = vec![t0 * DAY];
                    ages.extend(durations.iter().map(|d| (t0 + d) * DAY));
                    let strains = strain(&chain, |t| creep.concrete.modulus_at(t), &ages, 1.0);
                    for (age, strain) in ages.iter().zip(strains) {
                        let error = strain / creep.compliance(*age, t0 * DAY) - 1.0;
                        assert!(
                            error.abs() < 5e-3,
                            "{code:?} fcm {fcm} t0 {t0} at {} d: {error}",
                            age / DAY
                        );
                    }
                }
            }
        }
    }

    /// OOFEM's reference values for `EC2creep.in`, through the chain.
    #[test]
    fn chain_agrees_with_oofem() {
        let creep = member(Code::Ec2, 30.0, 0.1);
        let chain = Chain::fit(&creep);
        let ages = [7.0, 7.1, 12.0, 10_007.0].map(|d| d * DAY);
        let strains = strain(&chain, |t| creep.concrete.modulus_at(t), &ages, 1.0);
        for (strain, expected) in strains[1..].iter().zip([4.5603e-11, 6.8940e-11, 1.592_03e-10]) {
            assert!((strain / expected - 1.0).abs() < 5e-3, "{strain} {expected}");
        }
    }

    /// Relaxation of the standard linear solid E₀ = 30, E₁ = 20, τ = 100: σ = ε(12 + 18 e^(−t/40)).
    /// The error falls as Δt².
    #[test]
    fn standard_linear_solid_relaxes() {
        let chain = Chain::constant(&[(20.0, 100.0)]);
        let error = |steps: usize| {
            let mut history = History::default();
            let mut stress = 30.0;
            history =
                chain.increment(0.0, 1.0).advance(&history, &[stress, 0.0, 0.0, 0.0, 0.0, 0.0]);
            for k in 0..steps {
                let at = |k: usize| 40.0 * k as f64 / steps as f64;
                let step = chain.increment(at(k + 1) - at(k), 1.0);
                let change = -step.past(&history)[0] / (1.0 / 30.0 + step.delayed);
                history = step.advance(&history, &[change, 0.0, 0.0, 0.0, 0.0, 0.0]);
                stress += change;
            }
            stress - (12.0 + 18.0 * (-1f64).exp())
        };
        let (coarse, fine) = (error(10), error(20));
        assert!(fine.abs() < 1e-2 && (coarse / fine - 4.0).abs() < 0.1, "{coarse} {fine}");
        assert!(error(4000).abs() < 1e-6);
    }

    /// Relaxation of ageing concrete by the chain: the ageing coefficient χ = 1/(1 − R/E) − 1/φ
    /// lies where the literature has it.
    #[test]
    fn ageing_coefficient_is_about_four_fifths() {
        let creep = member(Code::Ec2, 38.0, 0.3);
        let chain = Chain::fit(&creep);
        let t0 = 28.0 * DAY;
        let modulus = creep.concrete.modulus_at(t0);
        let mut stress = modulus;
        let mut history = chain
            .increment(0.0, t0)
            .advance(&History::default(), &[stress, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let at = |k: i32| t0 + DAY * 10f64.powf(-3.0 + 7.0 * f64::from(k) / 200.0);
        let mut from = t0;
        for k in 0..=200 {
            let step = chain.increment(at(k) - from, middle(from, at(k)));
            let change = -step.past(&history)[0]
                / (1.0 / creep.concrete.modulus_at(middle(from, at(k))) + step.delayed);
            history = step.advance(&history, &[change, 0.0, 0.0, 0.0, 0.0, 0.0]);
            stress += change;
            from = at(k);
        }
        let phi = creep.phi(from, t0) * modulus / creep.reference_modulus();
        let chi = 1.0 / (1.0 - stress / modulus) - 1.0 / phi;
        assert!((0.7..0.9).contains(&chi), "{chi}");
    }

    #[test]
    fn least_squares_never_goes_negative() {
        let a = DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        // The free solution is 4 − x, whose slope has the wrong sign: the best constant is 2.
        let x = non_negative_least_squares(&a, &DVector::from_row_slice(&[3.0, 2.0, 1.0]));
        assert!((x[0] - 2.0).abs() < 1e-12 && x[1] == 0.0, "{x}");
    }
}
