//! The inverse: which zones are softened, and by how much, given readings with known noise.
//!
//! Sparse damage is stated as a finite set of hypotheses: none, one zone, two zones, or whole sections from one tenth to another. For each the severities
//! 0 ≤ d ≤ 1 are fitted by Gauss and Newton, and the hypotheses are weighed by their evidence
//!
//! ```text
//! p(m | h) = ∫ exp(−½ ‖C^-½ (m − I(d))‖²) dd        over 0 ≤ d ≤ 1, flat in d
//! ```
//!
//! with the exponent taken quadratic about its minimum (Laplace's method with the bounds kept; Kass and Raftery 1995). Sums over hypotheses then give the
//! probability that a zone is damaged and its severity with an honest error.

use intrados_stage::Job;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{
    FeltError,
    rig::{FACES, TENTHS},
};

/// What readings follow from damage.
pub trait Forward: Sync {
    /// How many zones there are.
    fn zones(&self) -> usize;

    /// Readings under damage of a few zones, and their derivatives by each of these. `None` where the model breaks down.
    fn read(&self, damage: &[(usize, f64)]) -> Option<(DVector<f64>, DMatrix<f64>)>;

    /// Solves the full problem at a damage, so that [`Forward::read`] is exact to first order about it.
    ///
    /// # Errors
    /// [`FeltError`].
    fn visit(&mut self, damage: &[(usize, f64)]) -> Result<(), FeltError>;
}

/// How to invert.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Prior probabilities of: no damage, one zone, two zones, whole sections.
    pub prior: [f64; 4],
    /// Damage never has the shape of zones: by what share of its effect the model may be wrong.
    pub shape_error: f64,
    /// Damage does not fill a zone evenly: by what share of itself a zone's severity is uncertain beyond what the readings tell.
    pub severity_error: f64,
    /// Most damages at which the full problem is solved again.
    pub visits: usize,
    /// A zone counts as damaged from this probability on.
    pub found_from: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { prior: [0.25, 0.35, 0.3, 0.1], shape_error: 0.05, severity_error: 0.1, visits: 6, found_from: 0.5 }
    }
}

/// What was measured: which of the model's readings, its value and standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Datum {
    /// Index among the model's readings.
    pub reading: usize,
    /// SI.
    pub value: f64,
    /// Of the value.
    pub std_error: f64,
}

/// Groups of zones that are damaged alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Hypothesis {
    /// The groups.
    pub groups: Vec<Vec<usize>>,
    /// Logarithm of its prior probability.
    pub log_prior: f64,
}

/// A hypothesis and the damage that fits it best.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Which hypothesis.
    pub hypothesis: Hypothesis,
    /// Severities of its groups.
    pub severity: Vec<f64>,
    /// χ² there.
    pub chi2: f64,
    /// Logarithm of prior times evidence.
    pub log_weight: f64,
    /// Posterior probability.
    pub probability: f64,
    /// Means and mean squares of the severities, and of the largest of them.
    moments: Vec<[f64; 2]>,
    /// Whitened, and its derivatives.
    residual: DVector<f64>,
    slopes: DMatrix<f64>,
}

/// What the readings say.
#[derive(Debug, Clone)]
pub struct Posterior {
    /// The hypotheses worth a look, most probable first.
    pub fits: Vec<Fit>,
    /// By zone: probability that it is damaged.
    pub probability: Vec<f64>,
    /// By zone: mean and standard deviation of d, over all hypotheses.
    pub damage: Vec<[f64; 2]>,
    /// By zone: the same, given that it is damaged.
    pub severity: Vec<[f64; 2]>,
    /// Of the worst zone: mean and standard deviation.
    pub worst: [f64; 2],
    /// Readings and their standard errors as used.
    pub std_errors: Vec<f64>,
}

/// All hypotheses with their priors.
#[must_use]
pub fn hypotheses(zones: usize, prior: [f64; 4]) -> Vec<Hypothesis> {
    let class = |groups: Vec<Vec<Vec<usize>>>, probability: f64| {
        let log_prior = (probability / groups.len().max(1) as f64).ln();
        groups.into_iter().map(move |groups| Hypothesis { groups, log_prior })
    };
    let single = (0..zones).map(|z| vec![vec![z]]).collect();
    let double = (0..zones).flat_map(|a| (a + 1..zones).map(move |b| vec![vec![a], vec![b]])).collect();
    let section = |from: usize, to: usize| vec![(FACES * from..FACES * to).collect()];
    let sections = (0..TENTHS).flat_map(|a| (a + 1..=TENTHS).map(move |b| section(a, b))).collect();
    class(vec![vec![]], prior[0]).chain(class(single, prior[1])).chain(class(double, prior[2])).chain(class(sections, prior[3])).collect()
}

/// The largest severity that is tried: beyond, a zone is a hole.
const MOST: f64 = 0.95;
/// Hypotheses less probable than the best by more than e to this are dropped.
const FAR: f64 = 14.0;
/// At most so many are kept.
const MANY: usize = 150;
/// Where fits begin besides where they were.
const HALF: f64 = 0.45;
/// A fit as near as this to a visited damage is as good as exact.
const NEAR: f64 = 0.03;

/// Measurements ready to be fitted.
struct Data<'a> {
    data: &'a [Datum],
    std_errors: Vec<f64>,
    /// χ² of the best fit over the number of readings, at least 1: where no hypothesis fits, none is excluded for fitting a little worse (Birge 1932).
    scale: f64,
}

impl Data<'_> {
    /// Whitened residual and derivatives by group.
    fn look<F: Forward>(&self, forward: &F, groups: &[Vec<usize>], severity: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let damage = spread(groups, severity);
        let (readings, slopes) = forward.read(&damage)?;
        let mut residual = DVector::zeros(self.data.len());
        let mut by_group = DMatrix::zeros(self.data.len(), groups.len());
        let starts: Vec<usize> = groups.iter().scan(0, |at, g| Some(std::mem::replace(at, *at + g.len()))).collect();
        for (i, (datum, sd)) in self.data.iter().zip(&self.std_errors).enumerate() {
            residual[i] = (datum.value - readings[datum.reading]) / sd;
            for (k, group) in groups.iter().enumerate() {
                by_group[(i, k)] = (starts[k]..starts[k] + group.len()).map(|z| slopes[(datum.reading, z)]).sum::<f64>() / sd;
            }
        }
        Some((residual, by_group))
    }

    /// Gauss and Newton within the bounds, the step halved where it does not help.
    fn fit<F: Forward>(&self, forward: &F, hypothesis: &Hypothesis, start: &[f64]) -> Option<Fit> {
        let groups = &hypothesis.groups;
        let mut at = start.to_vec();
        let (mut residual, mut slopes) = self.look(forward, groups, &at)?;
        for _ in 0..12 {
            let before = residual.norm_squared();
            let step = bounded_step(&slopes, &residual, &at);
            if step.iter().all(|s| s.abs() < 1e-4) {
                break;
            }
            let mut share = 1.0;
            let next = loop {
                let trial: Vec<f64> = at.iter().zip(&step).map(|(d, s)| (d + share * s).clamp(0.0, MOST)).collect();
                match self.look(forward, groups, &trial) {
                    Some(look) if look.0.norm_squared() < before => break Some((trial, look)),
                    _ if share < 0.05 => break None,
                    _ => share *= 0.5,
                }
            };
            let Some((trial, look)) = next else { break };
            (at, (residual, slopes)) = (trial, look);
            if before - residual.norm_squared() < 1e-6 * before.max(1.0) {
                break;
            }
        }
        Some(Fit {
            chi2: residual.norm_squared(),
            log_weight: f64::NEG_INFINITY,
            hypothesis: hypothesis.clone(),
            severity: at,
            probability: 0.0,
            moments: Vec::new(),
            residual,
            slopes,
        })
    }
}

/// Severities by zone.
fn spread(groups: &[Vec<usize>], severity: &[f64]) -> Vec<(usize, f64)> {
    groups.iter().zip(severity).flat_map(|(zones, &d)| zones.iter().map(move |&z| (z, d))).collect()
}

/// The Gauss-Newton step; what is at a bound and wants out stays.
fn bounded_step(slopes: &DMatrix<f64>, residual: &DVector<f64>, at: &[f64]) -> Vec<f64> {
    let (normal, pull) = (slopes.tr_mul(slopes), slopes.tr_mul(residual));
    let mut free: Vec<usize> = (0..at.len()).filter(|&k| !(at[k] <= 0.0 && pull[k] < 0.0 || at[k] >= MOST && pull[k] > 0.0)).collect();
    loop {
        let small = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[(free[i], free[j])] * if i == j { 1.0 + 1e-9 } else { 1.0 });
        let right = DVector::from_fn(free.len(), |i, _| pull[free[i]]);
        let found = small.cholesky().map(|c| c.solve(&right)).unwrap_or_else(|| DVector::zeros(free.len()));
        // A step that leaves at a bound it stands on is no step.
        let leaving = (0..free.len()).find(|&i| at[free[i]] <= 0.0 && found[i] < 0.0 || at[free[i]] >= MOST && found[i] > 0.0);
        match leaving {
            Some(i) => drop(free.remove(i)),
            None => {
                let mut step = vec![0.0; at.len()];
                free.iter().zip(found.iter()).for_each(|(&k, s)| step[k] = *s);
                return step;
            }
        }
    }
}

/// Points per severity at which the evidence is summed.
const GRID: usize = 33;

/// log ∫ exp(−½ χ²) over the bounds with χ² quadratic about `at`, and the moments of the severities and of their largest.
fn evidence(residual: &DVector<f64>, slopes: &DMatrix<f64>, at: &[f64]) -> (f64, Vec<[f64; 2]>) {
    let n = at.len();
    let base = -0.5 * residual.norm_squared();
    let (normal, pull) = (slopes.tr_mul(slopes), slopes.tr_mul(residual));
    // How far each severity is uncertain: its marginal deviation, or how fast it falls off at a bound.
    let spreads = (normal.clone() + DMatrix::identity(n, n) * 1e-3).try_inverse().unwrap_or_else(|| DMatrix::identity(n, n));
    let axis = |k: usize| {
        let sd = spreads[(k, k)].max(0.0).sqrt().min(3.0);
        let reach = if (at[k] <= 0.0 || at[k] >= MOST) && n == 1 { (5.0 * sd).min(12.0 / pull[k].abs().max(1e-9)) } else { 5.0 * sd };
        let (low, high) = ((at[k] - reach).max(0.0), (at[k] + reach).min(1.0));
        (low, (high - low) / GRID as f64)
    };
    let axes: Vec<(f64, f64)> = (0..n).map(axis).collect();
    let cell: f64 = axes.iter().map(|a| a.1).product();
    let (mut sum, mut sums) = (0.0, vec![[0.0; 2]; n + 1]);
    let mut place = vec![0.0; n];
    for index in 0..GRID.pow(n as u32) {
        let mut rest = index;
        for (k, (low, step)) in axes.iter().enumerate() {
            place[k] = low + (0.5 + (rest % GRID) as f64) * step;
            rest /= GRID;
        }
        let away = DVector::from_fn(n, |k, _| place[k] - at[k]);
        let weight = (pull.dot(&away) - 0.5 * away.dot(&(&normal * &away))).min(50.0).exp() * cell;
        sum += weight;
        let largest = place.iter().copied().fold(0.0, f64::max);
        for (sums, d) in sums.iter_mut().zip(place.iter().copied().chain([largest])) {
            sums[0] += weight * d;
            sums[1] += weight * d * d;
        }
    }
    sums.iter_mut().flatten().for_each(|s| *s /= sum);
    (base + sum.ln(), sums)
}

/// Weighs all hypotheses.
///
/// # Errors
/// [`FeltError`].
pub fn invert<F: Forward>(forward: &mut F, data: &[Datum], settings: &Settings, job: &Job) -> Result<Posterior, FeltError> {
    let sound = forward.read(&[]).ok_or(FeltError::Broken)?.0;
    let mut used = Data { data, std_errors: data.iter().map(|d| d.std_error).collect(), scale: 1.0 };
    let all = hypotheses(forward.zones(), settings.prior);
    let mut fits = weigh(&mut used, forward, all.into_iter().map(|h| (vec![0.1; h.groups.len()], h)).collect());
    let mut visited: Vec<(Vec<Vec<usize>>, Vec<f64>)> = Vec::new();
    for visit in 0..settings.visits {
        job.step(visit, settings.visits)?;
        // The most probable hypothesis whose damage has not been visited, as long as it matters.
        let new = |fit: &&Fit| {
            let near = |(groups, severity): &(Vec<Vec<usize>>, Vec<f64>)| {
                *groups == fit.hypothesis.groups && severity.iter().zip(&fit.severity).all(|(a, b)| (a - b).abs() < NEAR)
            };
            fit.probability > 0.02 && !fit.severity.is_empty() && !visited.iter().any(near)
        };
        let Some(next) = fits.iter().find(new).cloned() else { break };
        forward.visit(&spread(&next.hypothesis.groups, &next.severity))?;
        visited.push((next.hypothesis.groups.clone(), next.severity.clone()));
        let best = fits.first().unwrap_or(&next);
        let (readings, _) = forward.read(&spread(&best.hypothesis.groups, &best.severity)).ok_or(FeltError::Broken)?;
        for (datum, sd) in data.iter().zip(&mut used.std_errors) {
            *sd = datum.std_error.hypot(settings.shape_error * (readings[datum.reading] - sound[datum.reading]));
        }
        fits = weigh(&mut used, forward, fits.into_iter().map(|f| (f.severity, f.hypothesis)).collect());
    }
    Ok(posterior(fits, forward.zones(), used.std_errors, settings.severity_error))
}

/// Fits hypotheses from where they were and from the middle; the probable ones, best first.
fn weigh<F: Forward>(data: &mut Data, forward: &F, hypotheses: Vec<(Vec<f64>, Hypothesis)>) -> Vec<Fit> {
    let known = &*data;
    let fit = |(start, h): &(Vec<f64>, Hypothesis)| {
        let starts = [start.clone(), vec![HALF; start.len()]];
        starts.iter().filter_map(|s| known.fit(forward, h, s)).min_by(|a, b| a.chi2.total_cmp(&b.chi2))
    };
    let mut fits: Vec<Fit> = hypotheses.par_iter().filter_map(fit).collect();
    let least = fits.iter().map(|f| f.chi2).fold(f64::INFINITY, f64::min);
    data.scale = (least / data.data.len() as f64).max(1.0);
    for fit in &mut fits {
        let (log_evidence, moments) = evidence(&(&fit.residual / data.scale.sqrt()), &(&fit.slopes / data.scale.sqrt()), &fit.severity);
        (fit.log_weight, fit.moments) = (fit.hypothesis.log_prior + log_evidence, moments);
    }
    fits.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    fits.truncate(MANY);
    let best = fits.first().map_or(0.0, |f| f.log_weight);
    fits.retain(|f| best - f.log_weight < FAR);
    let sum: f64 = fits.iter().map(|f| (f.log_weight - best).exp()).sum();
    fits.iter_mut().for_each(|f| f.probability = (f.log_weight - best).exp() / sum);
    fits
}

fn posterior(fits: Vec<Fit>, zones: usize, std_errors: Vec<f64>, severity_error: f64) -> Posterior {
    let mut sums = vec![[0.0; 3]; zones];
    let mut worst = [0.0; 2];
    for fit in &fits {
        for (group, moments) in fit.hypothesis.groups.iter().zip(&fit.moments) {
            for &zone in group {
                let add = [1.0, moments[0], moments[1] * (1.0 + severity_error * severity_error)];
                sums[zone].iter_mut().zip(add).for_each(|(s, a)| *s += fit.probability * a);
            }
        }
        if let Some(largest) = fit.moments.last().filter(|_| !fit.hypothesis.groups.is_empty()) {
            let largest = [largest[0], largest[1] * (1.0 + severity_error * severity_error)];
            worst.iter_mut().zip(largest).for_each(|(s, a)| *s += fit.probability * a);
        }
    }
    let spread = |mean: f64, square: f64| [mean, (square - mean * mean).max(0.0).sqrt()];
    Posterior {
        probability: sums.iter().map(|s| s[0]).collect(),
        damage: sums.iter().map(|s| spread(s[1], s[2])).collect(),
        severity: sums.iter().map(|s| if s[0] > 0.0 { spread(s[1] / s[0], s[2] / s[0]) } else { [0.0; 2] }).collect(),
        worst: spread(worst[0], worst[1]),
        fits,
        std_errors,
    }
}
