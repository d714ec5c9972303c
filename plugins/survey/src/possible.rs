//! What may be of the rust of a member: states drawn from all that its exposure class leaves open.

use intrados_mechanics::material::durability::{Corrosion, Other};
use intrados_stage::random::Key;
use statrs::distribution::{ContinuousCDF, Normal};

/// Of a front or profile, relative to itself.
pub(crate) const MODEL: f64 = 0.15;

/// Share of all that may be in which something attacks that the class does not know of, and the
/// share of the draws that are spent on it.
const UNFORESEEN: f64 = 0.05;
const DRAWN: f64 = 0.25;
/// Its rust, µm a year: of chloride, dried and wetted (fib MC2020, table 30.1-6).
const SALT_RATE: [f64; 2] = [30.0, 40.0];
/// Seed of when it begins and how fast it goes.
const SEED: u64 = 0x006c_6561_6b73;

/// One of the things that may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Possible {
    pub(crate) other: Other,
    /// Logarithm of its weight before anything is read.
    pub(crate) prior: f64,
}

/// All that may be of a corrosion, of steel that is `age` (s) old.
pub(crate) fn possible(corrosion: &Corrosion, count: usize, age: f64) -> Vec<Possible> {
    let is_drawn = |k: usize| k % 4 == 3;
    let one = |(k, other): (usize, Other)| {
        if !is_drawn(k) {
            return Possible { other, prior: ((1.0 - UNFORESEEN) / (1.0 - DRAWN)).ln() };
        }
        let key = Key::new(SEED, k as u64);
        let since = Some(age * key.unit64(0));
        let other = Other { current: salt_rate(key.unit64(1)), since, ..other };
        Possible { other, prior: (UNFORESEEN / DRAWN).ln() }
    };
    corrosion.possible(count).into_iter().enumerate().map(one).collect()
}

/// A corrosion current of [`SALT_RATE`], A/m² (11.6 µm a year are .01 A/m²), at a share of its
/// distribution.
fn salt_rate(share: f64) -> f64 {
    let [mean, deviation] = SALT_RATE;
    let variance = (1.0 + (deviation / mean).powi(2)).ln();
    let z = Normal::standard().inverse_cdf(share.clamp(1e-6, 1.0 - 1e-6));
    0.01 / 11.6 * mean * (variance.sqrt() * z - 0.5 * variance).exp()
}

#[cfg(test)]
impl Possible {
    pub(crate) fn is_unforeseen(&self) -> bool {
        self.other.since.is_some()
    }
}
