//! What steers walks: caches of what a walk will find, learnt from walks.

use crate::Real;

/// A cache of the far field (radiance for walks from the camera, importance for walks from the
/// lamps): what a walk that goes on from a place may expect, and where from. It is built from what
/// walks of both sides have found and then never changes.
///
/// It may hold anything: the mixture with the kernel ([`Field::mixed`]) makes a wrong field cost
/// variance and never bias.
pub trait Field: Sync + Sized {
    /// Its numbers.
    type Real: Real;
    /// Where a walk stands, found once an event.
    type Place;
    /// A way on: a direction, a next state.
    type Way: Copy;
    /// What one walk has found at one place.
    type TrainingSample;
    /// What the field is spread over: surfaces, voxels, states.
    type Domain<'g>;

    /// Learns from lessons. The same field from the same lessons on any number of threads.
    fn learn(domain: &Self::Domain<'_>, lessons: Vec<Self::TrainingSample>) -> Self;

    /// Whether it has learnt nothing.
    fn is_empty(&self) -> bool;

    /// What going on from `place` is expected to bring; 0 where nothing is known.
    fn value(&self, place: &Self::Place) -> Self::Real;

    /// A way on from `place`, whose [value](Self::value) is `value` > 0, from four uniform numbers.
    /// None where rounding leaves none.
    fn sample(
        &self,
        place: &Self::Place,
        value: Self::Real,
        u: [Self::Real; 4],
    ) -> Option<Self::Way>;

    /// Its density, in the kernel's measure.
    fn density(&self, place: &Self::Place, value: Self::Real, way: Self::Way) -> Self::Real;

    /// Density of a way that the kernel alone takes with density `kernel`, where a share `defence`
    /// of the walks ignores the field.
    fn mixed(
        &self,
        place: &Self::Place,
        value: Self::Real,
        way: Self::Way,
        kernel: Self::Real,
        defence: Self::Real,
    ) -> Self::Real {
        defence * kernel + (Self::Real::ONE - defence) * self.density(place, value, way)
    }
}

/// What a steered walk promises over the reading that it is expected to score, for
/// [`expected_contribution`](crate::TransportProblem::expected_contribution). What is too little to
/// be a number stays above nothing, which would end the walk; where no reading is known yet it is
/// NaN, which neither splits nor ends one.
#[must_use]
pub fn promise<R: Real>(expected: R, reading: R) -> R {
    let share = expected / reading;
    if share < R::LEAST { R::LEAST } else { share }
}

/// Numbers that together say how large one value of a field is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FieldEvidence {
    /// How many.
    pub n: u64,
    /// Σ v.
    pub sum: f64,
    /// Σ v².
    pub squares: f64,
}

impl FieldEvidence {
    /// Takes one more; what is no number says nothing.
    pub fn add(&mut self, v: f64) {
        if !v.is_finite() {
            return;
        }
        self.n += 1;
        self.sum += v;
        self.squares += v * v;
    }

    /// How many equally large numbers they amount to: (Σv)²/Σv².
    #[must_use]
    pub(crate) fn effective(&self) -> f64 {
        if self.squares > 0.0 { self.sum * self.sum / self.squares } else { 0.0 }
    }

    /// 1/relVar of their *sum*, as of photons: how many come is itself a matter of chance (a
    /// compound Poisson number, relVar = Σv²/(Σv)²).
    #[must_use]
    pub(crate) fn precision_of_sum(&self) -> f64 {
        self.effective()
    }

    /// 1/relVar of their *mean*, as of suffix scores: that n of them were asked for brings no
    /// error, so that numbers that are all alike are (nearly) exact. relVar = (n/n_eff − 1)/n, and
    /// 1/n² more, because few that agree prove little.
    #[must_use]
    pub(crate) fn precision_of_mean(&self) -> f64 {
        let n = self.n as f64;
        let effective = self.effective();
        if effective > 0.0 { n / ((n / effective - 1.0).max(0.0) + 1.0 / n) } else { 0.0 }
    }
}

/// The shares of what photons (the other side's walks, by their sum) and suffixes (the own side's,
/// by their mean) say of one value.
///
/// By inverse variance: while walks find little, photons say more; once they are steered well,
/// suffixes scatter less and less, and learning converges geometrically where photons alone would
/// stop at the noise of their number (theory §4).
#[must_use]
pub fn shares(photons: &FieldEvidence, suffixes: &FieldEvidence) -> [f64; 2] {
    let precision = [photons.precision_of_sum(), suffixes.precision_of_mean()];
    let all = precision[0] + precision[1];
    if all > 0.0 { precision.map(|p| p / all) } else { [0.0; 2] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(numbers: &[f64]) -> FieldEvidence {
        let mut evidence = FieldEvidence::default();
        numbers.iter().for_each(|&v| evidence.add(v));
        evidence
    }

    /// n numbers that are all alike: as photons n_eff = n of them, as suffixes nearly exact.
    #[test]
    fn suffixes_that_agree_are_trusted() {
        let alike = of(&[0.3; 100]);
        assert!((alike.effective() - 100.0).abs() < 1e-9);
        assert!((alike.precision_of_mean() / 1e4 - 1.0).abs() < 1e-6);
        assert!(shares(&alike, &alike)[1] > 0.98);
        assert_eq!(of(&[2.0]).precision_of_mean(), 1.0, "one proves as little as one photon");
        // One hit among a hundred: relVar of the mean is (100 − 1)/100 + 1e-4.
        let mut rare = [0.0; 100];
        rare[7] = 5.0;
        assert!((of(&rare).precision_of_mean() - 1.0 / 0.9901).abs() < 1e-9);
    }

    /// The precision of a mean is what its name says: 1/relVar over 4000 repetitions of 50
    /// exponential numbers, true value 50; relative error of a variance from 4000 is 2.2 %, and few
    /// that agree cost a little more.
    #[test]
    fn precision_is_one_over_the_variance() {
        use intrados_stage::random::Key;
        let runs: Vec<FieldEvidence> = (0..4000)
            .map(|run| {
                of(&(0..50).map(|i| -(1.0 - Key::new(run, i).unit64(0)).ln()).collect::<Vec<_>>())
            })
            .collect();
        let means: Vec<f64> = runs.iter().map(|e| e.sum / 50.0).collect();
        let variance = means.iter().map(|m| (m - 1.0).powi(2)).sum::<f64>() / 4000.0;
        assert!((variance * 50.0 - 1.0).abs() < 0.1, "{variance}");
        let precision = runs.iter().map(FieldEvidence::precision_of_mean).sum::<f64>() / 4000.0;
        assert!((precision * variance - 1.0).abs() < 0.15, "{precision}");
    }

    /// A lesson of infinite weight would be all that a cell ever knew.
    #[test]
    fn what_is_no_number_teaches_nothing() {
        let evidence = of(&[0.3, f64::INFINITY, f64::NAN]);
        assert_eq!((evidence.n, evidence.sum), (1, 0.3));
    }

    #[test]
    fn a_walk_of_little_promise_is_not_ended() {
        assert_eq!(promise(1e-300, 1e100), f64::MIN_POSITIVE);
        assert_eq!(promise(3.0_f32, 2.0), 1.5);
        assert!(promise(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn nothing_says_nothing() {
        assert_eq!(shares(&FieldEvidence::default(), &FieldEvidence::default()), [0.0; 2]);
        assert_eq!(shares(&of(&[1.0]), &of(&[0.0, 0.0])), [1.0, 0.0]);
    }
}
