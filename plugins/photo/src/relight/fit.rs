//! How brightly each lamp burnt, and what the lens took away: y = v Σ a_k L_k by channel.

use nalgebra::{DMatrix, DVector};

/// Unknowns of the vignetting.
pub(super) const BENDS: usize = 2;
/// What v1 and v2 of a lens are likely to be, either way: corners lose a fifth or so.
const USUAL_BEND: f64 = 0.2;
/// Tukey's limit, in robust standard deviations (95 % efficient where nothing is an outlier).
const TUKEY: f64 = 4.685;
/// Least scatter of the ratio that outliers are judged by.
const LEAST_SCATTER: f64 = 3e-3;
const ROUNDS: usize = 60;
/// Rounds of least absolute values that find where to begin.
const FIRST: usize = 15;

/// What the fit knows of a pixel.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    /// The photograph's light, by channel.
    pub(super) y: [f64; 3],
    /// Each lamp's, by channel.
    pub(super) light: Vec<[f64; 3]>,
    /// Squared distance from the middle; 1 in the corners.
    pub(super) radius2: f64,
    /// Which part of the picture it is in: what is not modelled goes together within.
    pub(super) tile: u32,
}

/// What was fitted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fit {
    /// By lamp and channel.
    pub(super) strength: Vec<[f64; 3]>,
    /// v = 1 + v₁r² + v₂r⁴.
    pub(super) bends: [f64; BENDS],
    /// Of all unknowns: strengths by lamp, red before green before blue; the bends.
    pub(super) covariance: DMatrix<f64>,
    /// Robust standard deviation of y/ŷ about 1, by channel.
    pub(super) scatter: [f64; 3],
}

/// v at a place.
pub(super) fn vignetting(bends: [f64; BENDS], radius2: f64) -> f64 {
    (1.0 + bends[0] * radius2 + bends[1] * radius2 * radius2).max(0.05)
}

impl Fit {
    /// Of samples that some lamp lights in every channel, by iteratively reweighted least squares:
    /// residuals count as shares of what was expected, since reflectance scatters so; after some
    /// rounds of least absolute values a redescending loss takes over, so that damage, stains and
    /// unknown objects do not count at all.
    pub(super) fn new(samples: &[Sample], lamps: usize) -> Self {
        let mut fit = Self {
            strength: vec![[0.0; 3]; lamps],
            bends: [0.0; BENDS],
            covariance: DMatrix::zeros(0, 0),
            scatter: [1.0; 3],
        };
        // Before anything is known residuals count as shares of y.
        let mut weights: Vec<[f64; 3]> =
            samples.iter().map(|s| s.y.map(|y| 1.0 / (y * y))).collect();
        for round in 0..ROUNDS {
            for c in 0..3 {
                fit.solve_strengths(samples, &weights, c);
            }
            if round >= FIRST {
                fit.solve_bends(samples, &weights);
            }
            let residuals: Vec<[f64; 3]> = samples.iter().map(|s| fit.residuals(s)).collect();
            let scatter = std::array::from_fn(|c| deviation(residuals.iter().map(|r| r[c])));
            let is_done =
                round > FIRST && (0..3).all(|c| (scatter[c] / fit.scatter[c] - 1.0).abs() < 1e-5);
            fit.scatter = scatter;
            for ((weight, sample), residual) in weights.iter_mut().zip(samples).zip(&residuals) {
                let expected = fit.expected(sample);
                for c in 0..3 {
                    let r = residual[c] / scatter[c].max(LEAST_SCATTER);
                    let share = if round < FIRST { 1.0 / r.abs().max(0.1) } else { tukey(r) };
                    weight[c] = if expected[c] > 0.0 { share / expected[c].powi(2) } else { 0.0 };
                }
            }
            if is_done {
                break;
            }
        }
        fit.covariance = fit.sandwich(samples, &weights);
        fit
    }

    /// ŷ.
    pub(super) fn expected(&self, sample: &Sample) -> [f64; 3] {
        let v = vignetting(self.bends, sample.radius2);
        self.lit(sample).map(|s| v * s)
    }

    /// Σ a_k L_k.
    fn lit(&self, sample: &Sample) -> [f64; 3] {
        let lamps = self.strength.iter().zip(&sample.light);
        lamps.fold([0.0; 3], |sum, (a, l)| [0, 1, 2].map(|c| sum[c] + a[c] * l[c]))
    }

    /// y/ŷ − 1; far off where nothing is expected.
    fn residuals(&self, sample: &Sample) -> [f64; 3] {
        let expected = self.expected(sample);
        [0, 1, 2].map(|c| if expected[c] > 0.0 { sample.y[c] / expected[c] - 1.0 } else { 1e6 })
    }

    /// Strengths of one channel at given bends, none below 0: by coordinates (V. Franc et al.,
    /// "Sequential coordinate-wise algorithm for the non-negative least squares problem", 2005).
    fn solve_strengths(&mut self, samples: &[Sample], weights: &[[f64; 3]], c: usize) {
        let n = self.strength.len();
        let (mut gram, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for (sample, weight) in samples.iter().zip(weights) {
            let v = vignetting(self.bends, sample.radius2);
            for k in 0..n {
                let wl = weight[c] * v * sample.light[k][c];
                right[k] += wl * sample.y[c];
                (0..=k).for_each(|l| gram[k * n + l] += wl * v * sample.light[l][c]);
            }
        }
        let of = |k: usize, l: usize| gram[k.max(l) * n + k.min(l)];
        let mut a = vec![0.0; n];
        for _ in 0..2000 {
            let mut moved: f64 = 0.0;
            for k in (0..n).filter(|k| of(*k, *k) > 0.0) {
                let slope = right[k] - (0..n).map(|l| of(k, l) * a[l]).sum::<f64>();
                let next = f64::max(a[k] + slope / of(k, k), 0.0);
                moved = moved.max((next - a[k]).abs() * of(k, k).sqrt());
                a[k] = next;
            }
            if moved < 1e-10 * right.iter().fold(0.0, |m: f64, r| m.max(*r)).sqrt() {
                break;
            }
        }
        for (strength, a) in self.strength.iter_mut().zip(a) {
            strength[c] = a;
        }
    }

    /// The bends at given strengths, with what is usual as if measured.
    fn solve_bends(&mut self, samples: &[Sample], weights: &[[f64; 3]]) {
        let mut gram = [0.0; 3];
        let mut right = [0.0; BENDS];
        for (sample, weight) in samples.iter().zip(weights) {
            let (lit, r2) = (self.lit(sample), sample.radius2);
            let by = [r2, r2 * r2];
            for c in 0..3 {
                let w = weight[c] / self.scatter[c].max(LEAST_SCATTER).powi(2) * lit[c];
                let rest = sample.y[c] - lit[c];
                gram[0] += w * lit[c] * by[0] * by[0];
                gram[1] += w * lit[c] * by[0] * by[1];
                gram[2] += w * lit[c] * by[1] * by[1];
                (0..BENDS).for_each(|k| right[k] += w * rest * by[k]);
            }
        }
        let prior = USUAL_BEND.powi(-2);
        let [a, b, d] = [gram[0] + prior, gram[1], gram[2] + prior];
        let det = a * d - b * b;
        self.bends = [(d * right[0] - b * right[1]) / det, (a * right[1] - b * right[0]) / det];
    }

    /// Slopes of log ŷ of one channel by all unknowns: those that are not 0.
    pub(super) fn slopes(&self, light: &[[f64; 3]], c: usize, radius2: f64) -> Vec<(usize, f64)> {
        let n = self.strength.len();
        let lit: f64 = self.strength.iter().zip(light).map(|(a, l)| a[c] * l[c]).sum();
        let v = vignetting(self.bends, radius2);
        let lamps = (0..n).map(|k| (c * n + k, light[k][c] / lit));
        lamps.chain([(3 * n, radius2 / v), (3 * n + 1, radius2 * radius2 / v)]).collect()
    }

    /// Variance of log ŷ by the fit.
    pub(super) fn variance(&self, light: &[[f64; 3]], c: usize, radius2: f64) -> f64 {
        let slopes = self.slopes(light, c, radius2);
        let of = |(i, a): &(usize, f64)| {
            slopes.iter().map(|(j, b)| a * b * self.covariance[(*i, *j)]).sum::<f64>()
        };
        slopes.iter().map(of).sum::<f64>().max(0.0)
    }

    /// H⁻¹ (Σ g gᵀ) H⁻¹, H by the loss's own second derivative, with g summed over each tile (K.-Y. Liang and S. Zeger, "Longitudinal data
    /// analysis using generalized linear models", 1986): residuals of neighbours go together. The
    /// prior of the bends adds to H.
    fn sandwich(&self, samples: &[Sample], weights: &[[f64; 3]]) -> DMatrix<f64> {
        let n = 3 * self.strength.len() + BENDS;
        let tiles = samples.iter().map(|s| s.tile as usize + 1).max().unwrap_or(0);
        let mut pull = vec![DVector::<f64>::zeros(n); tiles];
        let mut curve = DMatrix::<f64>::zeros(n, n);
        for (sample, weight) in samples.iter().zip(weights) {
            let (expected, residual) = (self.expected(sample), self.residuals(sample));
            for c in 0..3 {
                let scatter = self.scatter[c].max(LEAST_SCATTER);
                let w = weight[c] * (expected[c] / scatter).powi(2);
                if w > 0.0 && w.is_finite() {
                    let bend = tukey_slope(residual[c] / scatter) / scatter.powi(2);
                    let slopes = self.slopes(&sample.light, c, sample.radius2);
                    for (i, a) in &slopes {
                        pull[sample.tile as usize][*i] += w * residual[c] * a;
                        slopes.iter().for_each(|(j, b)| curve[(*i, *j)] += bend * a * b);
                    }
                }
            }
        }
        for k in n - BENDS..n {
            curve[(k, k)] += USUAL_BEND.powi(-2);
        }
        // A lamp without any light of a colour has no strength in it.
        for k in 0..n {
            if curve[(k, k)] <= 0.0 {
                curve[(k, k)] = f64::MAX.sqrt();
            }
        }
        let size: Vec<f64> = (0..n).map(|k| curve[(k, k)].sqrt()).collect();
        let even = DMatrix::from_fn(n, n, |i, j| {
            curve[(i, j)] / (size[i] * size[j]) + if i == j { 1e-9 } else { 0.0 }
        });
        let Some(inverse) = even.try_inverse() else { return DMatrix::zeros(n, n) };
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (size[i] * size[j]));
        let mut middle = DMatrix::<f64>::zeros(n, n);
        pull.iter().for_each(|g| middle += g * g.transpose());
        for k in n - BENDS..n {
            middle[(k, k)] += USUAL_BEND.powi(-2);
        }
        &inverse * middle * &inverse
    }
}

fn tukey(r: f64) -> f64 {
    let u = r / TUKEY;
    if u.abs() < 1.0 { (1.0 - u * u).powi(2) } else { 0.0 }
}

/// d/dr of r times the weight.
fn tukey_slope(r: f64) -> f64 {
    let u2 = (r / TUKEY).powi(2);
    if u2 < 1.0 { (1.0 - u2) * (1.0 - 5.0 * u2) } else { 0.0 }
}

/// 1.4826 times the median of absolute values.
fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let mut sizes: Vec<f64> = values.map(f64::abs).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    /// Two lamps of crossing slopes, a lens that darkens, a fifth of all pixels dark by damage.
    fn planted(seed: u64) -> (Vec<Sample>, [[f64; 3]; 2], [f64; BENDS]) {
        let (strength, bends) = ([[0.5, 0.4, 0.3], [0.2, 0.3, 0.6]], [-0.15, -0.05]);
        let side = 60_u32;
        let sample = |k: u32| {
            let [x, y] = [k % side, k / side].map(|i| (f64::from(i) + 0.5) / f64::from(side) - 0.5);
            let light = vec![[1.0 + x, 1.0 + x, 1.2 + x], [0.6 - x + y, 0.7 - x + y, 0.6 - x]]
                .into_iter()
                .map(|l: [f64; 3]| l.map(|v| v.max(0.0)))
                .collect::<Vec<_>>();
            let radius2 = 2.0 * (x * x + y * y);
            let key = Key::new(seed, u64::from(k));
            let damaged = (k % side < 12 && k / side < 36) as u32;
            let rho = (1.0 + 0.05 * key.normal(0)) * 0.4_f64.powi(damaged as i32);
            let v = vignetting(bends, radius2);
            let y = [0, 1, 2]
                .map(|c| rho * v * (strength[0][c] * light[0][c] + strength[1][c] * light[1][c]));
            Sample { y, light, radius2, tile: k % side / 10 + 6 * (k / side / 10) }
        };
        ((0..side * side).map(sample).collect(), strength, bends)
    }

    /// Over hundred seeds the strengths scatter as their covariance says, and damage does not move
    /// them.
    #[test]
    fn strengths_are_found_within_their_errors_whatever_is_damaged() {
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..100 {
            let (samples, strength, bends) = planted(seed);
            let fit = Fit::new(&samples, 2);
            for (k, c) in (0..2).flat_map(|k| (0..3).map(move |c| (k, c))) {
                let error = fit.covariance[(2 * c + k, 2 * c + k)].sqrt();
                let off = fit.strength[k][c] - strength[k][c];
                assert!(off.abs() < 0.05 * strength[k][c], "{seed}: {fit:?}");
                squares += (off / error).powi(2);
                count += 1.0;
            }
            assert!((fit.bends[0] - bends[0]).abs() < 0.05, "{:?}", fit.bends);
            // A normal's is .05; the fifth that is damaged widens the median.
            assert!(fit.scatter.iter().all(|s| (0.045..0.08).contains(s)), "{:?}", fit.scatter);
        }
        let mean: f64 = squares / count;
        assert!((0.7..1.6).contains(&mean), "{mean}");
    }

    /// A lamp that was off gets nothing, never less.
    #[test]
    fn no_lamp_takes_light_away() {
        let (mut samples, strength, _) = planted(7);
        for sample in &mut samples {
            sample.y = [0, 1, 2].map(|c| strength[0][c] * sample.light[0][c]);
        }
        let fit = Fit::new(&samples, 2);
        assert!(fit.strength[1].iter().all(|a| (0.0..1e-3).contains(a)), "{:?}", fit.strength);
        assert!((fit.strength[0][0] - 0.5).abs() < 1e-3);
    }
}
