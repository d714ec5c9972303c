use serde::{Deserialize, Serialize};

use crate::Exact;

/// Number, mean and sum of squared deviations, merged by Chan, Golub and LeVeque (1979).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Moments {
    /// How many.
    pub n: u64,
    /// Mean.
    pub mean: f64,
    /// Σ (x − mean)².
    pub m2: f64,
}

impl Moments {
    /// Takes one more number (Welford 1962).
    pub fn add(&mut self, x: f64) {
        self.n += 1;
        let delta = x - self.mean;
        self.mean += delta / self.n as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// Takes all numbers of `other`.
    pub fn merge(&mut self, other: &Self) {
        if other.n == 0 {
            return;
        }
        let n = self.n + other.n;
        let delta = other.mean - self.mean;
        let share = other.n as f64 / n as f64;
        self.m2 += other.m2 + delta * delta * self.n as f64 * share;
        self.mean += delta * share;
        self.n = n;
    }

    /// Unbiased variance of one number; infinite below two numbers.
    #[must_use]
    pub fn variance(&self) -> f64 {
        if self.n < 2 { f64::INFINITY } else { self.m2 / (self.n - 1) as f64 }
    }

    /// Standard error of the mean.
    #[must_use]
    pub fn std_error(&self) -> f64 {
        (self.variance() / self.n.max(1) as f64).sqrt()
    }
}

/// Sixteen bins an octave, from 2^-64 to 2^64 of the unit.
const BINS_PER_OCTAVE: f64 = 16.0;
const BINS: usize = 2048;

/// Σ x and Σ x² of the scores of one half of a run, without rounding: shards, a resumed run and the
/// whole agree to the last bit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Sums {
    n: u64,
    sum: Exact,
    square: Exact,
}

impl Sums {
    fn add(&mut self, x: f64) {
        let square = x * x;
        self.n += 1;
        self.sum.add(x);
        self.square.add(square);
        // What rounding took from the square.
        self.square.add(x.mul_add(x, -square));
    }

    fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum.merge(&other.sum);
        self.square.merge(&other.square);
    }

    /// Σ (x − mean)² = Σ x² − (Σ x)²/n, of some hundred bits, so that scores that differ in their
    /// last digits only keep their variance.
    fn moments(&self) -> Moments {
        if self.n == 0 {
            return Moments::default();
        }
        let n = self.n as f64;
        let [sum, rest] = self.sum.double();
        let [square, square_rest] = self.square.double();
        let high = sum * sum;
        let low = sum.mul_add(sum, -high) + 2.0 * sum * rest;
        let ratio = high / n;
        let ratio_rest = ((-ratio).mul_add(n, high) + low) / n;
        let m2 = (square - ratio) + (square_rest - ratio_rest);
        // Less than that is rounding after all.
        let m2 = if m2 > square * NOTHING { m2 } else { 0.0 };
        Moments { n: self.n, mean: sum / n, m2 }
    }

    fn is_consistent(&self) -> bool {
        let moments = self.moments();
        self.sum.is_consistent()
            && self.square.is_consistent()
            && moments.mean.is_finite()
            && moments.m2.is_finite()
    }
}

/// A variance that is less than this of the square is none.
const NOTHING: f64 = 1e-30;

/// All that is kept of the scores of one reading: the two halves, the largest score and a histogram
/// of their size.
///
/// Everything in it merges to the same bits in any order, so that threads, shards and a resumed run
/// agree.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    halves: [Sums; 2],
    largest: f64,
    /// Counts of positive scores by log2; empty until the first one.
    sizes: Vec<u64>,
    /// Scores that were no finite numbers: an error of the problem, never hidden.
    invalid: u64,
}

impl Default for Scores {
    fn default() -> Self {
        Self { halves: Default::default(), largest: 0.0, sizes: vec![0; BINS], invalid: 0 }
    }
}

fn bin_of(x: f64) -> usize {
    ((x.log2() + 64.0) * BINS_PER_OCTAVE).clamp(0.0, (BINS - 1) as f64) as usize
}

/// Natural logarithm of the middle of a bin.
fn ln_of(bin: usize) -> f64 {
    ((bin as f64 + 0.5) / BINS_PER_OCTAVE - 64.0) * std::f64::consts::LN_2
}

impl Scores {
    /// Takes the score of one walk, of half 0 or 1 of the run.
    pub fn add(&mut self, x: f64, half: usize) {
        self.add_with_chance(x, x, half);
    }

    /// The same where only the part `chance` of the score is left to chance: the rest (a lamp that
    /// a pixel sees directly) may be large without being a tail.
    pub fn add_with_chance(&mut self, x: f64, chance: f64, half: usize) {
        if !(x * x).is_finite() {
            self.invalid += 1;
            return;
        }
        self.halves[half & 1].add(x);
        if chance > 0.0 {
            self.largest = self.largest.max(chance);
            self.sizes[bin_of(chance)] += 1;
        }
    }

    /// Takes all scores of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.halves[0].merge(&other.halves[0]);
        self.halves[1].merge(&other.halves[1]);
        self.largest = self.largest.max(other.largest);
        self.invalid += other.invalid;
        for (mine, theirs) in self.sizes.iter_mut().zip(&other.sizes) {
            *mine += theirs;
        }
    }

    /// Whether all parts have the sizes that they must have: what scores from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.sizes.len() == BINS
            && self.halves.iter().all(Sums::is_consistent)
            && self.halves[0].n.checked_add(self.halves[1].n).is_some()
    }

    /// Walks, zeros included.
    #[must_use]
    pub fn walks(&self) -> u64 {
        self.halves.iter().map(|half| half.n).sum()
    }

    /// Mean score: the estimate of the reading.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.all().mean
    }

    /// Standard error of the mean, from independent walks.
    #[must_use]
    pub fn std_error(&self) -> f64 {
        self.all().std_error()
    }

    /// Both, and the walks behind them.
    #[must_use]
    pub fn reading(&self) -> WalkEstimate {
        let all = self.all();
        WalkEstimate { mean: all.mean, std_error: all.std_error(), walks: all.n }
    }

    /// The whole run.
    fn all(&self) -> Moments {
        let [mut all, other] = self.halves.clone();
        all.merge(&other);
        all.moments()
    }

    /// The two halves of the run.
    #[must_use]
    pub fn halves(&self) -> [Moments; 2] {
        self.halves.each_ref().map(Sums::moments)
    }

    /// Whether the error bar may be trusted.
    #[must_use]
    pub fn converged(&self) -> Converged {
        let ([a, b], all) = (self.halves(), self.all());
        Converged {
            largest_share: if all.n == 0 {
                1.0
            } else {
                self.largest / (all.mean * all.n as f64).max(f64::MIN_POSITIVE)
            },
            halves_z: duality_z(a.mean, a.std_error(), b.mean, b.std_error()),
            tail_index: self.tail_index(),
            invalid: self.invalid,
        }
    }

    /// Hill's (1975) estimate α of P(score > x) ~ x^-α, from the largest 1 % of the positive scores
    /// (at least 20): below 2 the variance does not exist, near 2 its estimate lies. Infinite where
    /// the largest scores are all alike.
    #[must_use]
    pub(crate) fn tail_index(&self) -> f64 {
        let positive: u64 = self.sizes.iter().sum();
        let wanted = (self.walks() / 100).max(20).min(positive);
        if wanted < 2 {
            return 0.0;
        }
        let (mut taken, mut sum, mut threshold) = (0, 0.0, 0.0);
        for bin in (0..BINS).rev().filter(|&b| self.sizes[b] > 0) {
            let count = self.sizes[bin].min(wanted - taken);
            sum += count as f64 * ln_of(bin);
            taken += count;
            threshold = ln_of(bin);
            if taken == wanted {
                break;
            }
        }
        let mean_excess = sum / taken as f64 - threshold;
        if mean_excess > 0.0 { 1.0 / mean_excess } else { f64::INFINITY }
    }
}

/// The evidence that an error bar can be trusted, with the thresholds of design §5.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Converged {
    /// Largest score over the sum of all.
    pub largest_share: f64,
    /// z between the two halves of the run.
    pub halves_z: f64,
    /// Tail index of the largest 1 % of scores.
    pub tail_index: f64,
    /// Scores that were not finite.
    pub invalid: u64,
}

impl Converged {
    /// The largest score may be this share of the sum.
    pub const LARGEST_SHARE: f64 = 1e-3;
    /// The halves may differ by this many standard errors.
    pub const HALVES_Z: f64 = 3.0;
    /// The tail index must be above this.
    pub const TAIL_INDEX: f64 = 2.5;

    /// Whether all of it is well.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.largest_share < Self::LARGEST_SHARE
            && self.halves_z.abs() < Self::HALVES_Z
            && self.tail_index > Self::TAIL_INDEX
            && self.invalid == 0
    }

    /// What is not well, in words; empty if it [holds](Self::holds).
    #[must_use]
    pub fn complaint(&self) -> String {
        let mut words = Vec::new();
        if self.largest_share >= Self::LARGEST_SHARE {
            words.push(format!(
                "one walk carries {:.2} % of the sum (limit {} %)",
                100.0 * self.largest_share,
                100.0 * Self::LARGEST_SHARE
            ));
        }
        if self.halves_z.abs() >= Self::HALVES_Z || self.halves_z.is_nan() {
            words.push(format!(
                "the halves differ by {:.1} standard errors (limit {})",
                self.halves_z.abs(),
                Self::HALVES_Z
            ));
        }
        if self.tail_index <= Self::TAIL_INDEX {
            words.push(format!(
                "heavy tail, index {:.2} (limit {})",
                self.tail_index,
                Self::TAIL_INDEX
            ));
        }
        if self.invalid > 0 {
            words.push(format!("{} scores were not finite", self.invalid));
        }
        words.join("; ")
    }
}

/// A mean with its standard error: what every reading is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WalkEstimate {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
    /// Walks behind it.
    pub walks: u64,
}

impl WalkEstimate {
    /// Relative standard error.
    #[must_use]
    pub fn rel_error(&self) -> f64 {
        self.std_error / self.mean.abs()
    }

    /// relVar of one walk: n·Var(mean)/mean².
    #[must_use]
    pub fn rel_var_per_walk(&self) -> f64 {
        self.walks as f64 * self.rel_error().powi(2)
    }
}

/// 1/(relVar of the value · CPU-seconds).
#[must_use]
pub fn figure_of_merit(rel_error: f64, cpu_seconds: f64) -> f64 {
    1.0 / (rel_error * rel_error * cpu_seconds)
}

/// z = (a − b)/√(s²_a + s²_b): N(0,1) if both are right.
#[must_use]
pub fn duality_z(a: f64, s_a: f64, b: f64, s_b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b) / s_a.hypot(s_b) }
}

/// Two independent readings of the same thing as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Combined {
    /// The mean and its error.
    pub reading: WalkEstimate,
    /// Weight of the first.
    pub share: f64,
}

/// Combines two readings with the weight `share` of the first. Unbiased only if `share` was fixed
/// without looking at these very scores.
#[must_use]
pub fn combine(a: &WalkEstimate, b: &WalkEstimate, share: f64) -> Combined {
    let other = 1.0 - share;
    Combined {
        reading: WalkEstimate {
            mean: share * a.mean + other * b.mean,
            std_error: (share * a.std_error).hypot(other * b.std_error),
            walks: a.walks + b.walks,
        },
        share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    #[test]
    fn merging_is_adding() {
        let xs: Vec<f64> = (0..1000).map(|i| Key::new(1, i).unit64(0).powi(3)).collect();
        let (mut all, mut a, mut b) = (Scores::default(), Scores::default(), Scores::default());
        for (i, &x) in xs.iter().enumerate() {
            all.add(x, i % 2);
            if i < 300 { a.add(x, i % 2) } else { b.add(x, i % 2) }
        }
        b.merge(&a);
        assert_eq!(b, all);
        // As by Welford's rule, but for its rounding.
        let mut welford = Moments::default();
        xs.iter().for_each(|&x| welford.add(x));
        assert!(
            (all.mean() - welford.mean).abs() < 1e-15
                && (all.std_error() / welford.std_error() - 1.0).abs() < 1e-13
        );
    }

    /// 1 + k·2^-45 for k = 0, 1, 2: variance 2^-90. Plain sums of squares would have none left.
    #[test]
    fn scores_that_hardly_differ_keep_their_variance() {
        let mut scores = Scores::default();
        let step = 2_f64.powi(-45);
        [0.0, 1.0, 2.0].into_iter().for_each(|k: f64| scores.add(k.mul_add(step, 1.0), 0));
        assert!((scores.halves()[0].variance() / step.powi(2) - 1.0).abs() < 0.01);
        let mut alike = Scores::default();
        (0..1000).for_each(|_| alike.add(0.1, 0));
        assert_eq!((alike.halves()[0].mean, alike.halves()[0].m2), (0.1, 0.0));
    }

    /// Pareto scores of index 1.5 have no variance and must not pass; of index 6 they must.
    /// Relative error of Hill's estimate from 1000 scores is 3 %.
    #[test]
    fn heavy_tails_are_found() {
        for (alpha, fine) in [(1.5, false), (6.0, true)] {
            let mut scores = Scores::default();
            for i in 0..100_000 {
                scores.add((1.0 - Key::new(5, i).unit64(0)).powf(-1.0 / alpha), (i % 2) as usize);
            }
            assert!((scores.tail_index() / alpha - 1.0).abs() < 0.15, "{}", scores.tail_index());
            assert_eq!(scores.converged().holds(), fine, "{}", scores.converged().complaint());
        }
    }
}
