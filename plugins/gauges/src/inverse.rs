//! The inverse: which zones are softened, and by how much, given readings with known noise.
//!
//! Sparse damage is stated as a finite set of hypotheses: none, one zone, two zones, or whole
//! sections from one tenth to another. For each the severities 0 ≤ d ≤ 1 are fitted by Gauss and
//! Newton, and the hypotheses are weighed by their evidence
//!
//! ```text
//! p(m | h) = ∫ exp(−½ ‖C^-½ (m − I(d))‖²) dd        over 0 ≤ d ≤ 1, flat in d
//! ```
//!
//! with the exponent taken quadratic about its minimum (Laplace's method with the bounds kept; Kass
//! and Raftery 1995). Sums over hypotheses then give the probability that a zone is damaged and its
//! severity with an honest error.

use intrados_stage::Job;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    GaugeError,
    rig::{FACES, TENTHS, mean_share},
    unknown::Priors,
};

/// What readings follow from damage.
pub trait Forward: Sync {
    /// How many zones there are.
    fn zones(&self) -> usize;

    /// How much besides damage is not known exactly (modulus, loads, supports): each in standard
    /// deviations of its prior, called z.
    fn unknowns(&self) -> usize {
        0
    }

    /// Readings under damage of a few zones and the unknowns `z` (none: all zero), and their
    /// derivatives by each of these zones, by damage that reaches a tenth further across `borders`
    /// (border = tenth × 4 + face, the zone's own number where it begins), and by `z`. `None` where
    /// the model breaks down.
    fn read(
        &self,
        damage: &[(usize, f64)],
        borders: &[usize],
        z: &[f64],
    ) -> Option<(DVector<f64>, DMatrix<f64>)>;

    /// Solves the full problem at a damage, so that [`Forward::read`] is exact to first order about
    /// it.
    ///
    /// # Errors
    /// [`GaugeError`].
    fn visit(&mut self, damage: &[(usize, f64)]) -> Result<(), GaugeError>;
}

/// How to invert.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseSettings {
    /// Prior probabilities of: no damage, one zone, two zones, whole sections.
    pub prior: [f64; 4],
    /// Damage never has the shape of zones: by what share of its effect the model may be wrong.
    pub shape_error: f64,
    /// Damage does not end where zones do: standard deviation of either end, in tenths of the axis.
    pub border_error: f64,
    /// Damage does not fill a zone evenly: by what share of itself a zone's severity is uncertain
    /// beyond what the readings tell.
    pub severity_error: f64,
    /// How far off modulus, loads and supports may be.
    pub priors: Priors,
    /// Most damages at which the full problem is solved again.
    pub visits: usize,
    /// A zone counts as damaged from this probability on.
    pub found_from: f64,
}

impl Default for InverseSettings {
    fn default() -> Self {
        Self {
            prior: [0.25, 0.35, 0.3, 0.1],
            shape_error: 0.03,
            border_error: 0.08,
            severity_error: 0.08,
            priors: Priors::default(),
            visits: 6,
            found_from: 0.5,
        }
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
    /// The unknowns there, in standard deviations of their priors.
    pub z: Vec<f64>,
    /// Logarithm of prior times evidence.
    pub log_weight: f64,
    /// Posterior probability.
    pub probability: f64,
    /// Means and mean squares of the severities, and of the largest of them.
    moments: Vec<[f64; 2]>,
    look: Look,
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
    /// Of every unknown: mean and standard deviation, in those of its prior.
    pub unknowns: Vec<[f64; 2]>,
    /// Standard errors of the readings as used.
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
    let double =
        (0..zones).flat_map(|a| (a + 1..zones).map(move |b| vec![vec![a], vec![b]])).collect();
    let section = |from: usize, to: usize| vec![(FACES * from..FACES * to).collect()];
    let sections = (0..TENTHS).flat_map(|a| (a + 1..=TENTHS).map(move |b| section(a, b))).collect();
    class(vec![vec![]], prior[0])
        .chain(class(single, prior[1]))
        .chain(class(double, prior[2]))
        .chain(class(sections, prior[3]))
        .collect()
}

/// The largest severity that is tried: beyond, a zone is a hole.
const MOST: f64 = 0.95;
/// Hypotheses less probable than the best by more than e to this are dropped.
const FAR: f64 = 14.0;
/// At most so many are kept.
const MANY: usize = 80;
/// Where fits begin besides where they were.
const HALF: f64 = 0.45;
/// A fit as near as this to a visited damage is as good as exact.
const NEAR: f64 = 0.03;

/// Measurements ready to be fitted.
struct Data<'a> {
    data: &'a [Datum],
    std_errors: Vec<f64>,
    /// χ² of the best fit over the number of readings, at least 1: where no hypothesis fits, none
    /// is excluded for fitting a little worse (Birge 1932).
    scale: f64,
    border_error: f64,
}

/// Whitened residual and derivatives, and the logarithm of the determinant of what whitened them
/// over that of the noise.
#[derive(Debug, Clone)]
struct Look {
    residual: DVector<f64>,
    slopes: DMatrix<f64>,
    log_det: f64,
    /// The unknowns that explain the residual best, how uncertain they are with the damage held,
    /// and how they move with it.
    z: Vec<f64>,
    held: Vec<f64>,
    moves: DMatrix<f64>,
}

impl Look {
    fn new(residual: DVector<f64>, slopes: DMatrix<f64>) -> Self {
        Self {
            residual,
            slopes,
            log_det: 0.0,
            z: Vec::new(),
            held: Vec::new(),
            moves: DMatrix::zeros(0, 0),
        }
    }

    /// What is minimised: −2 log likelihood but for a constant.
    fn misfit(&self) -> f64 {
        self.residual.norm_squared() + self.log_det
    }

    /// Takes errors w of standard deviation 1 along the columns of A into the covariance, C = 1 + A
    /// Aᵀ: with G = (1 + AᵀA)⁻¹Aᵀ, which finds the most probable w, xᵀC⁻¹y is the product of (x − A
    /// G x, G x) and (y − A G y, G y). The last `unknowns` columns are kept as z.
    fn doubt(&mut self, doubt: &DMatrix<f64>, unknowns: usize) {
        let all = doubt.ncols();
        let factor = if all == 0 {
            None
        } else {
            Cholesky::new(DMatrix::identity(all, all) + doubt.tr_mul(doubt))
        };
        let Some(factor) = factor else { return };
        let first = doubt.ncols() - unknowns;
        let most = factor.solve(&doubt.tr_mul(&self.residual));
        let left = &self.residual - doubt * &most;
        self.residual = DVector::from_iterator(
            left.len() + most.len(),
            left.iter().chain(most.iter()).copied(),
        );
        let moves = factor.solve(&doubt.tr_mul(&self.slopes));
        self.slopes = stack(&(&self.slopes - doubt * &moves), &moves);
        self.log_det += 2.0 * factor.l_dirty().diagonal().iter().map(|l| l.ln()).sum::<f64>();
        self.z = most.as_slice()[first..].to_vec();
        self.held = factor.inverse().diagonal().as_slice()[first..].to_vec();
        self.moves = moves.rows(first, unknowns).into_owned();
    }
}

/// Rows below rows.
fn stack(above: &DMatrix<f64>, below: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = above.clone().insert_rows(above.nrows(), below.nrows(), 0.0);
    all.rows_mut(above.nrows(), below.nrows()).copy_from(below);
    all
}

/// How often the unknowns are sought about where they were found, and how near is near enough.
const SEEK: (usize, f64) = (4, 0.02);
/// How far off they may at most be, in standard deviations of their priors.
const FARTHEST: f64 = 6.0;

impl Data<'_> {
    /// About the damage, with the unknowns where they explain the readings best; `z`: where to
    /// begin with them.
    fn look<F: Forward>(
        &self,
        forward: &F,
        groups: &[Vec<usize>],
        severity: &[f64],
        z: &[f64],
    ) -> Option<Look> {
        let (times, near) = SEEK;
        let mut z = z.to_vec();
        for _ in 1..times {
            let look = self.look_at(forward, groups, severity, &z)?;
            if look.z.iter().zip(&z).all(|(new, old)| (new - old).abs() < near) {
                return Some(look);
            }
            z = look.z;
        }
        self.look_at(forward, groups, severity, &z)
    }

    /// The same with readings that are straight in the unknowns about `z`.
    fn look_at<F: Forward>(
        &self,
        forward: &F,
        groups: &[Vec<usize>],
        severity: &[f64],
        z: &[f64],
    ) -> Option<Look> {
        let damage = spread(groups, severity);
        // Either end of a damage is in doubt.
        let ends: Vec<(Vec<usize>, f64)> =
            groups.iter().zip(severity).flat_map(|(g, &d)| ends(g).map(|end| (end, d))).collect();
        let borders: Vec<usize> = ends.iter().flat_map(|end| end.0.iter().copied()).collect();
        let (readings, slopes) = forward.read(&damage, &borders, z)?;
        let n = self.data.len();
        let starts: Vec<usize> =
            groups.iter().scan(0, |at, g| Some(std::mem::replace(at, *at + g.len()))).collect();
        let by =
            |i: usize, column: usize| slopes[(self.data[i].reading, column)] / self.std_errors[i];
        let last = damage.len() + borders.len();
        let off = |i: usize| (0..z.len()).map(|k| by(i, last + k) * z[k]).sum::<f64>();
        let residual = DVector::from_fn(n, |i, _| {
            (self.data[i].value - readings[self.data[i].reading]) / self.std_errors[i] + off(i)
        });
        let by_group = DMatrix::from_fn(n, groups.len(), |i, k| {
            (starts[k]..starts[k] + groups[k].len()).map(|z| by(i, z)).sum()
        });
        let firsts: Vec<usize> = ends
            .iter()
            .scan(damage.len(), |at, e| Some(std::mem::replace(at, *at + e.0.len())))
            .collect();
        let doubt = DMatrix::from_fn(n, ends.len() + z.len(), |i, k| match ends.get(k) {
            Some(end) => {
                self.border_error
                    * end.1
                    * (firsts[k]..firsts[k] + end.0.len()).map(|column| by(i, column)).sum::<f64>()
            }
            None => by(i, last + k - ends.len()),
        });
        let mut look = Look::new(residual, by_group);
        look.doubt(&doubt, z.len());
        look.z.iter_mut().for_each(|z| *z = z.clamp(-FARTHEST, FARTHEST));
        Some(look)
    }

    /// Gauss and Newton within the bounds, the step halved where it does not help.
    fn fit<F: Forward>(
        &self,
        forward: &F,
        hypothesis: &Hypothesis,
        start: &[f64],
        z: &[f64],
    ) -> Option<Fit> {
        let groups = &hypothesis.groups;
        let mut at = start.to_vec();
        let mut look = self.look(forward, groups, &at, z)?;
        for _ in 0..12 {
            let before = look.misfit();
            let step = bounded_step(&look.slopes, &look.residual, &at);
            if step.iter().all(|s| s.abs() < 1e-4) {
                break;
            }
            let mut share = 1.0;
            let next = loop {
                let trial: Vec<f64> =
                    at.iter().zip(&step).map(|(d, s)| (d + share * s).clamp(0.0, MOST)).collect();
                match self.look(forward, groups, &trial, &look.z) {
                    Some(look) if look.misfit() < before => break Some((trial, look)),
                    _ if share < 0.05 => break None,
                    _ => share *= 0.5,
                }
            };
            let Some((trial, better)) = next else { break };
            (at, look) = (trial, better);
            if before - look.misfit() < 1e-3 {
                break;
            }
        }
        Some(Fit {
            chi2: look.residual.norm_squared(),
            z: look.z.clone(),
            log_weight: f64::NEG_INFINITY,
            hypothesis: hypothesis.clone(),
            severity: at,
            probability: 0.0,
            moments: Vec::new(),
            look,
        })
    }
}

/// The borders where a group of zones begins and where it ends along the axis.
fn ends(group: &[usize]) -> [Vec<usize>; 2] {
    let tenths = || group.iter().map(|z| z / FACES);
    let (first, last) = (tenths().min().unwrap_or(0), tenths().max().unwrap_or(0));
    let of = |tenth: usize| group.iter().copied().filter(move |z| z / FACES == tenth);
    [of(first).collect(), of(last).map(|z| z + FACES).collect()]
}

/// Severities by zone.
fn spread(groups: &[Vec<usize>], severity: &[f64]) -> Vec<(usize, f64)> {
    groups.iter().zip(severity).flat_map(|(zones, &d)| zones.iter().map(move |&z| (z, d))).collect()
}

/// The Gauss-Newton step; what is at a bound and wants out stays.
fn bounded_step(slopes: &DMatrix<f64>, residual: &DVector<f64>, at: &[f64]) -> Vec<f64> {
    let (normal, pull) = (slopes.tr_mul(slopes), slopes.tr_mul(residual));
    let mut free: Vec<usize> = (0..at.len())
        .filter(|&k| !(at[k] <= 0.0 && pull[k] < 0.0 || at[k] >= MOST && pull[k] > 0.0))
        .collect();
    loop {
        let small = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            normal[(free[i], free[j])] * if i == j { 1.0 + 1e-9 } else { 1.0 }
        });
        let right = DVector::from_fn(free.len(), |i, _| pull[free[i]]);
        let found =
            small.cholesky().map(|c| c.solve(&right)).unwrap_or_else(|| DVector::zeros(free.len()));
        // A step that leaves at a bound it stands on is no step.
        let leaving = (0..free.len()).find(|&i| {
            at[free[i]] <= 0.0 && found[i] < 0.0 || at[free[i]] >= MOST && found[i] > 0.0
        });
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

/// log ∫ exp(−½ χ²) over the bounds with χ² quadratic about `at`, and the moments of the severities
/// and of the largest mean over a zone, which is `means` of the severity.
fn evidence(
    residual: &DVector<f64>,
    slopes: &DMatrix<f64>,
    at: &[f64],
    means: &[f64],
) -> (f64, Vec<[f64; 2]>) {
    let n = at.len();
    let base = -0.5 * residual.norm_squared();
    let (normal, pull) = (slopes.tr_mul(slopes), slopes.tr_mul(residual));
    // How far each severity is uncertain: its marginal deviation, or how fast it falls off at a
    // bound.
    let spreads = (normal.clone() + DMatrix::identity(n, n) * 1e-3)
        .try_inverse()
        .unwrap_or_else(|| DMatrix::identity(n, n));
    let axis = |k: usize| {
        let sd = spreads[(k, k)].max(0.0).sqrt().min(3.0);
        let reach = if (at[k] <= 0.0 || at[k] >= MOST) && n == 1 {
            (5.0 * sd).min(12.0 / pull[k].abs().max(1e-9))
        } else {
            5.0 * sd
        };
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
        let largest = place.iter().zip(means).map(|(d, mean)| d * mean).fold(0.0, f64::max);
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
/// [`GaugeError`].
pub fn invert<F: Forward>(
    forward: &mut F,
    data: &[Datum],
    settings: &InverseSettings,
    job: &Job,
) -> Result<Posterior, GaugeError> {
    let mut used = Data {
        data,
        std_errors: data.iter().map(|d| d.std_error).collect(),
        scale: 1.0,
        border_error: settings.border_error,
    };
    let all = hypotheses(forward.zones(), settings.prior);
    // Everywhere the unknowns begin where they explain the readings best without any damage.
    let none =
        used.look(forward, &[], &[], &vec![0.0; forward.unknowns()]).ok_or(GaugeError::Broken)?.z;
    let start = |h: &Hypothesis| Start {
        severity: vec![0.1; h.groups.len()],
        z: none.clone(),
        hypothesis: h.clone(),
    };
    let mut fits = weigh(&mut used, forward, all.iter().map(start).collect(), true);
    let mut visited: Vec<(Vec<Vec<usize>>, Vec<f64>)> = Vec::new();
    for visit in 0..settings.visits {
        job.step(visit, settings.visits)?;
        // The most probable hypothesis whose damage has not been visited, as long as it matters.
        let new = |fit: &&Fit| {
            let near = |(groups, severity): &(Vec<Vec<usize>>, Vec<f64>)| {
                *groups == fit.hypothesis.groups
                    && severity.iter().zip(&fit.severity).all(|(a, b)| (a - b).abs() < NEAR)
            };
            fit.probability > 0.02 && !fit.severity.is_empty() && !visited.iter().any(near)
        };
        let Some(next) = fits.iter().find(new).cloned() else { break };
        forward.visit(&spread(&next.hypothesis.groups, &next.severity))?;
        visited.push((next.hypothesis.groups.clone(), next.severity.clone()));
        let best = fits.first().unwrap_or(&next);
        let (readings, _) = forward
            .read(&spread(&best.hypothesis.groups, &best.severity), &[], &best.z)
            .ok_or(GaugeError::Broken)?;
        let (sound, _) = forward.read(&[], &[], &best.z).ok_or(GaugeError::Broken)?;
        for (datum, sd) in data.iter().zip(&mut used.std_errors) {
            *sd = datum
                .std_error
                .hypot(settings.shape_error * (readings[datum.reading] - sound[datum.reading]));
        }
        let again = |f: &Fit| Start {
            severity: f.severity.clone(),
            z: f.z.clone(),
            hypothesis: f.hypothesis.clone(),
        };
        let mut next: Vec<Start> = fits.iter().map(again).collect();
        let z = best.z.clone();
        next.extend(all.iter().filter_map(|h| {
            Some(Start { severity: like(h, &fits)?, z: z.clone(), hypothesis: h.clone() })
        }));
        fits = weigh(&mut used, forward, next, visit == 0);
    }
    Ok(posterior(fits, forward.zones(), used.std_errors, settings.severity_error))
}

/// Where to begin with a hypothesis that was dropped but shares a group with the best one: what was
/// far from the readings may be near now that the model knows more. None: it shares nothing, or is
/// there already.
fn like(hypothesis: &Hypothesis, fits: &[Fit]) -> Option<Vec<f64>> {
    let best = fits.first()?;
    let severity = |group: &Vec<usize>| {
        best.hypothesis.groups.iter().position(|g| g == group).map(|k| best.severity[k])
    };
    let shared: Vec<Option<f64>> = hypothesis.groups.iter().map(severity).collect();
    let is_new = shared.iter().any(Option::is_some)
        && fits.iter().all(|f| f.hypothesis.groups != hypothesis.groups);
    is_new.then(|| shared.into_iter().map(|d| d.unwrap_or(0.1)).collect())
}

/// Where the fit of a hypothesis begins.
struct Start {
    severity: Vec<f64>,
    z: Vec<f64>,
    hypothesis: Hypothesis,
}

/// Fits hypotheses from where they were, at first (`anew`) also from the middle; the probable ones,
/// best first.
fn weigh<F: Forward>(data: &mut Data, forward: &F, hypotheses: Vec<Start>, anew: bool) -> Vec<Fit> {
    let known = &*data;
    let fit = |start: &Start| {
        let starts = [start.severity.clone(), vec![HALF; start.severity.len()]];
        starts
            .iter()
            .take(1 + usize::from(anew))
            .filter_map(|s| known.fit(forward, &start.hypothesis, s, &start.z))
            .min_by(|a, b| a.look.misfit().total_cmp(&b.look.misfit()))
    };
    let mut fits: Vec<Fit> = hypotheses.par_iter().filter_map(fit).collect();
    let least = fits.iter().map(|f| f.chi2).fold(f64::INFINITY, f64::min);
    data.scale = (least / data.data.len() as f64).max(1.0);
    for fit in &mut fits {
        let root = data.scale.sqrt();
        let means: Vec<f64> = fit
            .hypothesis
            .groups
            .iter()
            .map(|g| g.iter().map(|&z| mean_share(g, z)).fold(0.0, f64::max))
            .collect();
        let (log_evidence, moments) = evidence(
            &(&fit.look.residual / root),
            &(&fit.look.slopes / root),
            &fit.severity,
            &means,
        );
        (fit.log_weight, fit.moments) =
            (fit.hypothesis.log_prior + log_evidence - 0.5 * fit.look.log_det, moments);
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
                let mean = mean_share(group, zone);
                let add = [
                    1.0,
                    mean * moments[0],
                    mean * mean * moments[1] * (1.0 + severity_error * severity_error),
                ];
                sums[zone].iter_mut().zip(add).for_each(|(s, a)| *s += fit.probability * a);
            }
        }
        if let Some(largest) = fit.moments.last().filter(|_| !fit.hypothesis.groups.is_empty()) {
            let largest = [largest[0], largest[1] * (1.0 + severity_error * severity_error)];
            worst.iter_mut().zip(largest).for_each(|(s, a)| *s += fit.probability * a);
        }
    }
    let spread = |mean: f64, square: f64| [mean, (square - mean * mean).max(0.0).sqrt()];
    let unknown = |k: usize| {
        let sums = fits.iter().fold([0.0; 2], |[mean, square], fit| {
            // Its spread with the damage held, and what the damage's own adds.
            let moved = fit
                .moments
                .iter()
                .zip(fit.look.moves.row(k).iter())
                .map(|(m, by)| by * by * (m[1] - m[0] * m[0]).max(0.0))
                .sum::<f64>();
            [
                mean + fit.probability * fit.z[k],
                square + fit.probability * (fit.z[k] * fit.z[k] + fit.look.held[k] + moved),
            ]
        });
        spread(sums[0], sums[1])
    };
    let unknowns = fits.first().map_or(0, |f| f.z.len());
    Posterior {
        unknowns: (0..unknowns).map(unknown).collect(),
        probability: sums.iter().map(|s| s[0]).collect(),
        damage: sums.iter().map(|s| spread(s[1], s[2])).collect(),
        severity: sums
            .iter()
            .map(|s| if s[0] > 0.0 { spread(s[1] / s[0], s[2] / s[0]) } else { [0.0; 2] })
            .collect(),
        worst: spread(worst[0], worst[1]),
        fits,
        std_errors,
    }
}

/// The same readings explained by damage everywhere: min ‖C^-½ (m − I(d))‖² + α ‖d‖² over 0 ≤ d ≤ 1
/// of all zones (Tikhonov), re-linearised at every step, with the largest α by which the misfit is
/// no larger than the number of readings (Morozov). For comparison: a sparse damage is smeared over
/// its neighbours.
///
/// # Errors
/// [`GaugeError`].
pub fn tikhonov<F: Forward>(
    forward: &mut F,
    data: &[Datum],
    job: &Job,
) -> Result<Vec<f64>, GaugeError> {
    let zones = forward.zones();
    let all: Vec<Vec<usize>> = (0..zones).map(|z| vec![z]).collect();
    let used = Data {
        data,
        std_errors: data.iter().map(|d| d.std_error).collect(),
        scale: 1.0,
        border_error: 0.0,
    };
    let (mut at, mut alpha) = (vec![0.0; zones], 1e4);
    for step in 0..30 {
        job.step(step, 30)?;
        let mut next = at.clone();
        for _ in 0..4 {
            let look = used.look(forward, &all, &next, &[]).ok_or(GaugeError::Broken)?;
            let root = f64::sqrt(alpha);
            let rows = data.len();
            let slopes = DMatrix::from_fn(rows + zones, zones, |i, k| {
                if i < rows {
                    look.slopes[(i, k)]
                } else {
                    f64::from(u8::from(i - rows == k)) * root
                }
            });
            let residual = DVector::from_fn(rows + zones, |i, _| {
                if i < rows { look.residual[i] } else { -root * next[i - rows] }
            });
            let moved = bounded_step(&slopes, &residual, &next);
            next.iter_mut().zip(moved).for_each(|(d, s)| *d = (*d + s).clamp(0.0, MOST));
        }
        at = next;
        if step == 8 || step == 16 {
            forward.visit(&at.iter().copied().enumerate().collect::<Vec<_>>())?;
        }
        let look = used.look(forward, &all, &at, &[]).ok_or(GaugeError::Broken)?;
        if look.residual.norm_squared() <= data.len() as f64 {
            break;
        }
        alpha *= 0.6;
    }
    Ok(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings that answer to each zone by a curve of its own, 1/(1 − d) steep, and to borders as
    /// to a part of the zones beside.
    struct Toy;

    impl Toy {
        fn row(reading: usize, zone: usize) -> f64 {
            (1.3 * (reading as f64 + 1.0) * (zone as f64 + 1.0)).sin()
        }
    }

    impl Forward for Toy {
        fn zones(&self) -> usize {
            TENTHS * FACES
        }

        fn read(
            &self,
            damage: &[(usize, f64)],
            borders: &[usize],
            _: &[f64],
        ) -> Option<(DVector<f64>, DMatrix<f64>)> {
            let readings = DVector::from_fn(60, |i, _| {
                damage.iter().map(|&(z, d)| Self::row(i, z) * d / (1.0 - 0.5 * d)).sum()
            });
            let slope = |i: usize, k: usize| match damage.get(k) {
                Some(&(z, d)) => Self::row(i, z) / (1.0 - 0.5 * d).powi(2),
                None => 0.3 * Self::row(i, borders[k - damage.len()].min(39)),
            };
            Some((readings, DMatrix::from_fn(60, damage.len() + borders.len(), slope)))
        }

        fn visit(&mut self, _: &[(usize, f64)]) -> Result<(), GaugeError> {
            Ok(())
        }
    }

    fn data(damage: &[(usize, f64)], sd: f64) -> Vec<Datum> {
        let readings = Toy.read(damage, &[], &[]).unwrap().0;
        let noise = |i: usize| sd * 1.4 * (7.7 * i as f64 + 1.0).sin();
        (0..60)
            .map(|reading| Datum {
                reading,
                value: readings[reading] + noise(reading),
                std_error: sd,
            })
            .collect()
    }

    fn found(damage: &[(usize, f64)]) -> Posterior {
        invert(&mut Toy, &data(damage, 0.02), &InverseSettings::default(), &Job::default()).unwrap()
    }

    #[test]
    fn one_two_and_no_damaged_zones_are_told_apart() {
        for damage in [vec![], vec![(17, 0.35)], vec![(3, 0.2), (30, 0.5)]] {
            let posterior = found(&damage);
            for zone in 0..40 {
                let truth = damage.iter().find(|d| d.0 == zone);
                assert_eq!(
                    posterior.probability[zone] > 0.5,
                    truth.is_some(),
                    "{damage:?}, zone {zone}: {}",
                    posterior.probability[zone]
                );
                if let Some((_, d)) = truth {
                    let [mean, sd] = posterior.severity[zone];
                    assert!((mean - d).abs() < 3.0 * sd && sd < 0.1, "{damage:?}: {mean} ± {sd}");
                }
            }
            let sum: f64 = posterior.fits.iter().map(|f| f.probability).sum();
            assert!((sum - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn whole_sections_are_a_hypothesis() {
        let damage: Vec<(usize, f64)> = (8..20).map(|z| (z, 0.4)).collect();
        let posterior = found(&damage);
        assert!(
            (0..40).all(|z| (posterior.probability[z] > 0.5) == (8..20).contains(&z)),
            "{:?}",
            posterior.probability
        );
        assert!((posterior.worst[0] - 0.4).abs() < 0.1, "{:?}", posterior.worst);
    }

    /// A zone that no reading knows keeps its prior: any severity.
    #[test]
    fn what_is_not_felt_is_not_known() {
        let (log_evidence, moments) =
            evidence(&DVector::zeros(3), &DMatrix::zeros(3, 1), &[0.2], &[1.0]);
        assert!(log_evidence.abs() < 0.01, "{log_evidence}");
        assert!(
            (moments[0][0] - 0.5).abs() < 0.01 && (moments[0][1] - 1.0 / 3.0).abs() < 0.01,
            "{moments:?}"
        );
    }

    /// Against the closed form: Gaussian within the bounds.
    #[test]
    fn evidence_of_a_sharp_fit() {
        let slopes = DMatrix::from_column_slice(2, 1, &[30.0, 40.0]);
        let (log_evidence, moments) =
            evidence(&DVector::from_column_slice(&[0.8, -0.6]), &slopes, &[0.3], &[1.0]);
        let expected = -0.5 + (std::f64::consts::TAU.sqrt() / 50.0).ln();
        assert!((log_evidence - expected).abs() < 1e-4, "{log_evidence} {expected}");
        assert!(
            (moments[0][0] - 0.3).abs() < 1e-6
                && ((moments[0][1] - 0.09).sqrt() - 0.02).abs() < 1e-5
        );
    }

    #[test]
    fn doubt_widens_along_its_columns_only() {
        let mut look = Look::new(
            DVector::from_column_slice(&[3.0, 1.0]),
            DMatrix::from_column_slice(2, 1, &[1.0, 2.0]),
        );
        look.doubt(&DMatrix::from_column_slice(2, 1, &[3.0_f64.sqrt(), 0.0]), 1);
        // Covariance 1 + 3 = 4 along the first reading.
        let products = [
            look.residual.norm_squared(),
            look.slopes.norm_squared(),
            look.slopes.column(0).dot(&look.residual),
        ];
        for (found, expected) in
            products.into_iter().zip([9.0 / 4.0 + 1.0, 1.0 / 4.0 + 4.0, 3.0 / 4.0 + 2.0])
        {
            assert!((found - expected).abs() < 1e-12, "{products:?}");
        }
        assert!((look.log_det - 4.0_f64.ln()).abs() < 1e-12);
        // Of a residual of 3 most is the unknown's, √3 w = 3 · 3/4, and a quarter of its variance
        // is left.
        assert!(
            (look.z[0] - 0.75 * 3.0_f64.sqrt()).abs() < 1e-12
                && (look.held[0] - 0.25).abs() < 1e-12
        );
    }

    /// Readings of the toy, all of them times exp(0.15 z), which nobody knows.
    struct Scaled;

    impl Forward for Scaled {
        fn zones(&self) -> usize {
            Toy.zones()
        }

        fn unknowns(&self) -> usize {
            1
        }

        fn read(
            &self,
            damage: &[(usize, f64)],
            borders: &[usize],
            z: &[f64],
        ) -> Option<(DVector<f64>, DMatrix<f64>)> {
            let factor = (0.15 * z.first().copied().unwrap_or(0.0)).exp();
            let (readings, slopes) = Toy.read(damage, borders, &[])?;
            let readings =
                DVector::from_fn(60, |i, _| factor * (readings[i] + 2.0 * (0.7 * i as f64).cos()));
            let slopes =
                (slopes * factor).insert_columns(damage.len() + borders.len(), z.len(), 0.0);
            let by_z = DMatrix::from_fn(60, slopes.ncols(), |i, k| {
                if k < damage.len() + borders.len() { slopes[(i, k)] } else { 0.15 * readings[i] }
            });
            Some((readings, by_z))
        }

        fn visit(&mut self, _: &[(usize, f64)]) -> Result<(), GaugeError> {
            Ok(())
        }
    }

    /// What scales all readings is told from what damages a zone, up and down.
    #[test]
    fn an_unknown_scale_is_no_damage() {
        for scale in [0.75_f64, 0.9, 1.1, 1.3] {
            for damage in [vec![], vec![(17, 0.35)]] {
                let readings = Scaled.read(&damage, &[], &[scale.ln() / 0.15]).unwrap().0;
                let noise = |i: usize| 0.02 * 1.4 * (7.7 * i as f64 + 1.0).sin();
                let data: Vec<Datum> = (0..60)
                    .map(|reading| Datum {
                        reading,
                        value: readings[reading] + noise(reading),
                        std_error: 0.02,
                    })
                    .collect();
                let posterior =
                    invert(&mut Scaled, &data, &InverseSettings::default(), &Job::default())
                        .unwrap();
                let found: Vec<usize> =
                    (0..40).filter(|&z| posterior.probability[z] > 0.5).collect();
                assert_eq!(found, damage.iter().map(|d| d.0).collect::<Vec<_>>(), "{scale}");
                let [z, sd] = posterior.unknowns[0];
                assert!(
                    (z - scale.ln() / 0.15).abs() < 4.0 * sd && sd < 0.2,
                    "{scale}: {z} ± {sd}"
                );
            }
        }
    }

    #[test]
    fn tikhonov_finds_the_strongest_zone() {
        let damage = tikhonov(&mut Toy, &data(&[(17, 0.5)], 0.02), &Job::default()).unwrap();
        let worst = (0..40).max_by(|&a, &b| damage[a].total_cmp(&damage[b])).unwrap();
        assert_eq!(worst, 17, "{damage:?}");
    }
}
