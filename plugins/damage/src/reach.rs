//! How far a slice's word reaches along its member.
//!
//! Damage of a cause is taken for a field along the axis with mean nothing, the standard deviation
//! σ that the profile declares for what nobody looked at, and the correlation exp(−r/L), L the
//! profile's length. Slices are points of it, a zone is its mean correlation with them. Where no
//! slice lies, damage is the best linear estimate from all of them (simple kriging: Chilès and
//! Delfiner 2012, Geostatistics, 3.2), Σ w d with C w = c, whose variance σ²(1 − c·w) grows from
//! that of the slices to σ². In a zone with slices the worst of them counts in full, and what lies
//! between, σ²(1 − ρ²), widens its error. A core of which nobody knows the place may have been
//! anywhere: its correlations are means over the axis.

use intrados_stage::Estimate;
use nalgebra::{DMatrix, DVector};

use crate::{
    evidence::{Cause, Stands},
    grading::Profile,
    zone::{ZONES, Zones, zone_at},
};

/// Places that stand for an unknown one.
const PLACES: usize = 40;

/// A field along a member's axis.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Standard deviation of damage where nothing is known.
    pub sd: f64,
    /// Correlation length as a share of the axis.
    pub reach: f64,
}

/// What a slice says, and where it lies on the axis (0 to 1), if anybody knows.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    /// Place on the axis, 0 to 1.
    pub along: Option<f64>,
    /// Damage there.
    pub reading: Estimate,
    /// Number of its core: slices of one core lie in one place, known or not.
    pub core: usize,
}

impl Field {
    /// Of a cause on a member `length` m long. A profile that says nothing means what the usual one
    /// says of concrete.
    pub fn of(profile: &Profile, cause: Cause, length: f64) -> Self {
        let sd = profile.fusion.unknown.get(&cause).copied().unwrap_or(0.3);
        let reach = profile.fusion.correlation_m.get(&cause).copied().unwrap_or(0.5);
        Self { sd, reach: reach / length.max(1e-3) }
    }

    fn at(&self, a: f64, b: f64) -> f64 {
        (-(a - b).abs() / self.reach).exp()
    }

    /// Correlation of two places; of an unknown one the mean over all.
    fn between(&self, a: Option<f64>, b: Option<f64>) -> f64 {
        match (a, b) {
            (Some(a), Some(b)) => self.at(a, b),
            (Some(a), None) | (None, Some(a)) => mean(|u| self.at(a, u)),
            (None, None) => mean(|u| mean(|v| self.at(u, v))),
        }
    }

    /// Mean correlation of a zone with a place.
    fn with_zone(&self, zone: usize, place: Option<f64>) -> f64 {
        mean(|t| self.between(Some((zone as f64 + t) / ZONES as f64), place))
    }

    /// What lies between a slice and the rest of its zone.
    fn rest(&self, zone: usize, own: &Word) -> f64 {
        self.sd * (1.0 - self.with_zone(zone, own.along).powi(2)).max(0.0).sqrt()
    }

    /// How far slices stand for their zones, and what others were given beforehand.
    pub fn stands(&self, words: &[Word]) -> [Stands; ZONES] {
        let words = worst(words);
        std::array::from_fn(|zone| match own(&words, zone) {
            Some(own) => Stands { between: self.rest(zone, own), prior: None },
            None => Stands { between: 0.0, prior: Some(self.sd) },
        })
    }

    /// Damage of every zone.
    pub fn zones(&self, words: &[Word]) -> Zones {
        let words = worst(words);
        let known = DVector::from_iterator(words.len(), words.iter().map(|w| w.reading.value));
        let noise = |i: usize| (words[i].reading.std_error / self.sd.max(1e-9)).powi(2).max(1e-6);
        let covariance = DMatrix::from_fn(words.len(), words.len(), |i, j| match i == j {
            true => 1.0 + noise(i),
            false => self.between(words[i].along, words[j].along),
        });
        let Some(factor) = covariance.cholesky().filter(|_| !words.is_empty()) else {
            return Zones::default();
        };
        Zones(std::array::from_fn(|zone| {
            let with = DVector::from_iterator(
                words.len(),
                words.iter().map(|w| self.with_zone(zone, w.along)),
            );
            if let Some(own) = own(&words, zone) {
                let Estimate { value, std_error } = own.reading;
                return Some(Estimate { value, std_error: std_error.hypot(self.rest(zone, own)) });
            }
            let weights = factor.solve(&with);
            let variance = (1.0 - with.dot(&weights)).clamp(0.0, 1.0);
            Some(Estimate {
                value: weights.dot(&known).clamp(0.0, 1.0),
                std_error: self.sd * variance.sqrt(),
            })
        }))
    }
}

/// The slice in a zone.
fn own(words: &[Word], zone: usize) -> Option<&Word> {
    words.iter().find(|w| w.along.map(zone_at) == Some(zone))
}

/// Mean over the axis.
fn mean(of: impl Fn(f64) -> f64) -> f64 {
    (0..PLACES).map(|n| of((n as f64 + 0.5) / PLACES as f64)).sum::<f64>() / PLACES as f64
}

/// Of the slices of a zone, and of those of a core that may be anywhere, the worst.
fn worst(words: &[Word]) -> Vec<Word> {
    let place = |w: &Word| w.along.map_or(Err(w.core), |along| Ok(zone_at(along)));
    let mut worst: Vec<Word> = Vec::new();
    for word in words {
        match worst.iter_mut().find(|w| place(w) == place(word)) {
            Some(known) if known.reading.value < word.reading.value => *known = *word,
            Some(_) => {}
            None => worst.push(*word),
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIELD: Field = Field { sd: 0.3, reach: 0.1 };

    fn word(along: impl Into<Option<f64>>, value: f64) -> Word {
        Word { along: along.into(), reading: Estimate { value, std_error: 0.02 }, core: 0 }
    }

    /// One core at .25 of an axis of ten correlation lengths: full in its zone, e⁻¹ of it a zone
    /// away, nothing known at the end.
    #[test]
    fn a_core_speaks_of_where_it_was_drilled() {
        let zones = FIELD.zones(&[word(0.25, 0.4)]).0.map(Option::unwrap);
        assert_eq!(zones[2].value, 0.4);
        // The mean of e^−|t| over ± half a length is 2 (1 − e^−½).
        let inside = 2.0 * (1.0 - (-0.5_f64).exp());
        assert!(
            (zones[2].std_error - 0.02_f64.hypot(0.3 * (1.0 - inside * inside).sqrt())).abs()
                < 1e-3,
            "{:?}",
            zones[2]
        );
        // And over half a length to one and a half.
        let beside = (-0.5_f64).exp() - (-1.5_f64).exp();
        assert!(
            (zones[3].value - 0.4 * beside).abs() < 3e-3
                && (zones[1].value - zones[3].value).abs() < 1e-9,
            "{:?}",
            zones[3]
        );
        assert!(
            zones[3].std_error > 0.27
                && zones[9].value < 1e-3
                && (zones[9].std_error - 0.3).abs() < 1e-3,
            "{zones:?}"
        );
        assert!(
            zones
                .windows(2)
                .skip(2)
                .all(|w| w[1].value < w[0].value && w[1].std_error > w[0].std_error)
        );
    }

    /// It says the same little of every place, but for the ends; two cores say more than one.
    #[test]
    fn a_core_from_anywhere_says_little() {
        let one = FIELD.zones(&[word(None, 0.4)]).0.map(Option::unwrap);
        assert!(
            one.iter()
                .all(|z| (0.03..0.09).contains(&z.value) && (0.28..0.3).contains(&z.std_error)),
            "{one:?}"
        );
        // Slices of one core are no two cores.
        assert_eq!(
            FIELD.zones(&[word(None, 0.4), word(None, 0.1)]),
            FIELD.zones(&[word(None, 0.4)])
        );
        let two = FIELD
            .zones(&[word(None, 0.4), Word { core: 1, ..word(None, 0.4) }])
            .0
            .map(Option::unwrap);
        assert!(
            (0..ZONES).all(|z| two[z].value > one[z].value && two[z].std_error < one[z].std_error)
        );
        assert_eq!(FIELD.zones(&[]), Zones::default());
    }

    #[test]
    fn the_worst_slice_of_a_zone_counts() {
        let zones =
            FIELD.zones(&[word(0.21, 0.1), word(0.29, 0.5), word(0.22, 0.2), word(0.71, 0.3)]);
        assert_eq!([2, 7].map(|z| zones.0[z].unwrap().value), [0.5, 0.3]);
    }
}
