//! The smallest transport problem: a dense kernel on n states, with its exact solution. It judges every estimator.

use std::ops::Range;

use intrados_stage::random::Key;
use nalgebra::{DMatrix, DVector};

use crate::{Ends, Links, Problem, Side, States, Steps, dimension, keep};

/// Φ_i = Σ_j K_ij Φ_j + σ_i, I = Σ_i g_i Φ_i. All entries ≥ 0, spectral radius of K below 1.
#[derive(Debug, Clone)]
pub struct MatrixProblem {
    kernel: DMatrix<f64>,
    source: DVector<f64>,
    response: DVector<f64>,
}

/// What the linear algebra says.
#[derive(Debug, Clone)]
pub struct Exact {
    /// Φ.
    pub field: DVector<f64>,
    /// Φ*.
    pub importance: DVector<f64>,
    /// I.
    pub reading: f64,
    /// ρ(K).
    pub spectral_radius: f64,
}

impl Exact {
    /// L* = ⟨Φ, Φ*⟩/I: the mean number of events of the zero-variance walk, from either side.
    #[must_use]
    pub fn zero_variance_length(&self) -> f64 {
        self.field.dot(&self.importance) / self.reading
    }
}

impl MatrixProblem {
    /// A problem from its parts.
    ///
    /// # Panics
    /// If the sizes differ: a mistake of the caller, not of data.
    #[must_use]
    pub fn new(kernel: DMatrix<f64>, source: DVector<f64>, response: DVector<f64>) -> Self {
        assert!(kernel.is_square() && kernel.nrows() == source.len() && source.len() == response.len(), "sizes of K, σ and g differ");
        Self { kernel, source, response }
    }

    /// A chain of `n` states whose kernel falls off with distance (e-folding 2 states, random factors .5–1.5), scaled to spectral radius `rho`.
    /// Source at one end, response at the other: deep, I falls to 1e-10 (`research/light.md` §1).
    #[must_use]
    pub fn chain(n: usize, rho: f64, seed: u64) -> Self {
        let kernel =
            DMatrix::from_fn(n, n, |i, j| (-(i.abs_diff(j) as f64) / 2.0).exp() * (0.5 + Key::new(seed, (i * n + j) as u64).unit64(0)));
        let kernel = &kernel * (rho / spectral_radius(&kernel));
        let end = |near: bool| DVector::from_fn(n, |i, _| if (if near { i } else { n - 1 - i }) < 3 { 1.0 / 3.0 } else { 0.0 });
        Self::new(kernel, end(true), end(false))
    }

    /// Number of states.
    #[must_use]
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// Whether it has no states.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// Solves both equations by LU.
    ///
    /// # Panics
    /// If 1 − K is singular, that is, if the spectral radius is not below 1.
    #[must_use]
    pub fn solve(&self) -> Exact {
        let a = DMatrix::identity(self.len(), self.len()) - &self.kernel;
        let (Some(field), Some(importance)) = (a.clone().lu().solve(&self.source), a.transpose().lu().solve(&self.response)) else {
            panic!("1 − K is singular");
        };
        let reading = self.response.dot(&field);
        Exact { field, importance, reading, spectral_radius: spectral_radius(&self.kernel) }
    }

    /// Kernel as the walk of `side` sees it: from i to j.
    fn towards(&self, side: Side, i: usize, j: usize) -> f64 {
        match side {
            Side::Primal => self.kernel[(i, j)],
            Side::Dual => self.kernel[(j, i)],
        }
    }

    /// Where walks start.
    fn near(&self, side: Side) -> &DVector<f64> {
        if side == Side::Primal { &self.response } else { &self.source }
    }

    /// What walks look for.
    fn far(&self, side: Side) -> &DVector<f64> {
        if side == Side::Primal { &self.source } else { &self.response }
    }

    /// Kernel from state `from`, or from the start, to `j`.
    fn step(&self, side: Side, from: u32, j: usize) -> f64 {
        if from == START { self.near(side)[j] } else { self.towards(side, from as usize, j) }
    }

    /// Picks j with probability ∝ `weight(j)` and returns (j, probability, Σ weight).
    fn pick(&self, u: f64, weight: impl Fn(usize) -> f64) -> Option<(usize, f64, f64)> {
        let total: f64 = (0..self.len()).map(&weight).sum();
        let mut rest = u * total;
        let mut chosen = None;
        for j in 0..self.len() {
            let w = weight(j);
            if w > 0.0 {
                chosen = Some((j, w / total, total));
                if rest < w {
                    break;
                }
            }
            rest -= w;
        }
        chosen
    }
}

/// Largest modulus of the eigenvalues.
pub(crate) fn spectral_radius(matrix: &DMatrix<f64>) -> f64 {
    matrix.complex_eigenvalues().iter().map(|z| z.norm()).fold(0.0, f64::max)
}

/// The state before the first one.
const START: u32 = u32::MAX;

/// Columns of a walk on the matrix.
#[derive(Debug, Default)]
pub struct MatrixStates {
    at: Vec<u32>,
    /// Probability of the step that led here.
    density: Vec<f64>,
}

impl States for MatrixStates {
    fn gather(&mut self, rows: &[u32]) {
        keep(&mut self.at, rows);
        keep(&mut self.density, rows);
    }
}

impl MatrixStates {
    fn start(&mut self, n: usize) {
        self.at.clear();
        self.at.resize(n, START);
        self.density.clear();
        self.density.resize(n, 1.0);
    }
}

impl Problem for MatrixProblem {
    type Value = f64;
    type States = MatrixStates;

    fn channels(&self, _: Side) -> usize {
        1
    }

    fn bins(&self) -> usize {
        1
    }

    fn start(&self, _: Side, _: Range<u64>, keys: &[Key], states: &mut MatrixStates) {
        states.start(keys.len());
    }

    fn arrive(&self, side: Side, _: usize, states: &MatrixStates, ends: &mut Ends<f64>) -> bool {
        let far = self.far(side);
        let total = far.sum();
        for (i, &at) in states.at.iter().enumerate() {
            ends.value[i] = far[at as usize];
            ends.kernel_density[i] = states.density[i];
            ends.link_density[i] = far[at as usize] / total;
        }
        true
    }

    fn link(&self, side: Side, _: usize, event: u32, keys: &[Key], states: &mut MatrixStates, links: &mut Links<f64>) -> bool {
        let far = self.far(side);
        for (i, &at) in states.at.iter().enumerate() {
            let Some((j, p, total)) = self.pick(keys[i].unit64(dimension(event, 8)), |j| far[j]) else { return false };
            let k = self.step(side, at, j);
            links.value[i] = k * total;
            links.link_density[i] = p;
            links.kernel_density[i] = k / (0..self.len()).map(|j| self.step(side, at, j)).sum::<f64>();
        }
        true
    }

    fn reveal(&self, _: Side, _: &mut MatrixStates, _: &mut Links<f64>) {}

    fn scatter(&self, side: Side, event: u32, keys: &[Key], states: &mut MatrixStates, steps: &mut Steps<f64>) {
        for (i, key) in keys.iter().enumerate() {
            let at = states.at[i];
            if let Some((j, p, total)) = self.pick(key.unit64(dimension(event, 0)), |j| self.step(side, at, j)) {
                steps.factor[i] = total;
                steps.survival[i] = total.min(0.95);
                (states.at[i], states.density[i]) = (j as u32, p);
            }
        }
    }

    fn fly(&self, _: Side, _: &mut MatrixStates) {}
}

/// The matrix problem with its walks steered by a field (eq. 2.39–2.41), for the last-event estimator.
///
/// With weight 1 − `defence` it follows p_ij ∝ K_ij F_j; with `defence` it follows K alone, so that a wrong field costs
/// variance and never bias.
#[derive(Debug, Clone)]
pub struct SteeredMatrix<'a> {
    problem: &'a MatrixProblem,
    side: Side,
    field: DVector<f64>,
    defence: f64,
    /// One a state, and the last from the start.
    ways: Vec<Way>,
}

/// Where a steered walk goes from one state.
#[derive(Debug, Clone)]
struct Way {
    /// Probability to go on.
    survival: f64,
    /// Probability of each next state, if it goes on.
    p: Vec<f64>,
}

impl<'a> SteeredMatrix<'a> {
    /// Steers the walks of `side` by `field`: Φ̃ for the primal, Φ̃* for the dual.
    #[must_use]
    pub fn new(problem: &'a MatrixProblem, side: Side, field: DVector<f64>, defence: f64) -> Self {
        let mut steered = Self { problem, side, field, defence, ways: Vec::new() };
        steered.ways = (0..problem.len() as u32).chain([START]).map(|from| steered.way(from)).collect();
        steered
    }

    fn way_from(&self, from: u32) -> &Way {
        &self.ways[(from as usize).min(self.problem.len())]
    }

    fn way(&self, from: u32) -> Way {
        let n = self.problem.len();
        let plain: Vec<f64> = (0..n).map(|j| self.problem.step(self.side, from, j)).collect();
        let steered: Vec<f64> = plain.iter().zip(self.field.iter()).map(|(k, f)| k * f).collect();
        let (all_plain, all_steered) = (plain.iter().sum::<f64>(), steered.iter().sum::<f64>());
        let far = if from == START { 0.0 } else { self.problem.far(self.side)[from as usize] };
        // A field that predicts nothing must not kill the walk.
        let lost = all_steered <= 0.0;
        let defence = if lost { 1.0 } else { self.defence };
        let floor = if self.defence > 0.0 { 0.05 } else { 0.0 };
        let survival = if lost { all_plain.min(0.95) } else { (all_steered / (all_steered + far)).max(floor) };
        // Where there is something to score, absorption must stay possible.
        let survival = if far > 0.0 { survival.min(1.0 - 1e-9) } else { survival };
        let p = (0..n)
            .map(|j| {
                let a = if lost { 0.0 } else { steered[j] / all_steered };
                let b = if all_plain > 0.0 { plain[j] / all_plain } else { 0.0 };
                (1.0 - defence) * a + defence * b
            })
            .collect();
        Way { survival, p }
    }

    /// The exact expectation of the score, from the very probabilities that the walk uses (theory §7, "unbiased under a wrong field").
    ///
    /// # Panics
    /// If the linear system is singular.
    #[must_use]
    pub fn expectation(&self) -> f64 {
        let n = self.problem.len();
        let far = self.problem.far(self.side);
        // v_i = q_i · far_i/q_i + Σ_j P_ij (K_ij/P_ij) v_j over the j that the walk can reach
        let expected = DMatrix::from_fn(n, n, |i, j| {
            let p = self.ways[i].survival * self.ways[i].p[j];
            if p > 0.0 { p * (self.problem.towards(self.side, i, j) / p) } else { 0.0 }
        });
        let scored = DVector::from_fn(n, |i, _| {
            let q = 1.0 - self.ways[i].survival;
            if q > 0.0 { q * (far[i] / q) } else { 0.0 }
        });
        let Some(v) = (DMatrix::identity(n, n) - expected).lu().solve(&scored) else { panic!("1 − K is singular") };
        let begin = self.way_from(START);
        (0..n).filter(|&j| begin.p[j] > 0.0).map(|j| begin.p[j] * (self.problem.near(self.side)[j] / begin.p[j]) * v[j]).sum()
    }

    /// The exact relVar of one walk without defence, or infinity (theory §5, the oracle).
    #[must_use]
    pub fn oracle(&self) -> f64 {
        let n = self.problem.len();
        let far = self.problem.far(self.side);
        let next = |i: usize| (0..n).map(|j| self.problem.towards(self.side, i, j) * self.field[j]).sum::<f64>() + far[i];
        let total: Vec<f64> = (0..n).map(next).collect();
        let r2: Vec<f64> = (0..n).map(|i| (total[i] / self.field[i]).powi(2)).collect();
        let step = DMatrix::from_fn(n, n, |i, j| r2[i] * self.problem.towards(self.side, i, j) * self.field[j] / total[i]);
        if spectral_radius(&step) >= 1.0 {
            return f64::INFINITY;
        }
        let stop = DVector::from_fn(n, |i, _| r2[i] * far[i] / total[i]);
        let Some(h) = (DMatrix::identity(n, n) - step).lu().solve(&stop) else { return f64::INFINITY };
        let near = self.problem.near(self.side);
        let guess = near.dot(&self.field);
        let second = guess * (0..n).map(|i| near[i] * self.field[i] * h[i]).sum::<f64>();
        let reading = self.problem.solve().reading;
        second / (reading * reading) - 1.0
    }

    /// The law's V₂ for the error ε of the field (theory §5).
    #[must_use]
    pub fn law(&self, exact: &Exact) -> f64 {
        let n = self.problem.len();
        let (steers, other) = match self.side {
            Side::Primal => (&exact.field, &exact.importance),
            Side::Dual => (&exact.importance, &exact.field),
        };
        let eps = self.field.component_div(steers).add_scalar(-1.0);
        let variance = |p: &dyn Fn(usize) -> f64| {
            let (m1, m2) = (0..n).fold((0.0, 0.0), |(a, b), j| (a + p(j) * eps[j], b + p(j) * eps[j] * eps[j]));
            m2 - m1 * m1
        };
        let near = self.problem.near(self.side);
        variance(&|j| near[j] * steers[j] / exact.reading)
            + (0..n)
                .map(|i| {
                    let p = |j: usize| self.problem.towards(self.side, i, j) * steers[j] / steers[i];
                    steers[i] * other[i] / exact.reading * variance(&p)
                })
                .sum::<f64>()
    }
}

impl Problem for SteeredMatrix<'_> {
    type Value = f64;
    type States = MatrixStates;

    fn channels(&self, _: Side) -> usize {
        1
    }

    fn bins(&self) -> usize {
        1
    }

    fn start(&self, _: Side, _: Range<u64>, keys: &[Key], states: &mut MatrixStates) {
        states.start(keys.len());
    }

    fn arrive(&self, side: Side, channel: usize, states: &MatrixStates, ends: &mut Ends<f64>) -> bool {
        self.problem.arrive(side, channel, states, ends)
    }

    fn link(&self, _: Side, _: usize, _: u32, _: &[Key], _: &mut MatrixStates, _: &mut Links<f64>) -> bool {
        false
    }

    fn reveal(&self, _: Side, _: &mut MatrixStates, _: &mut Links<f64>) {}

    fn scatter(&self, side: Side, event: u32, keys: &[Key], states: &mut MatrixStates, steps: &mut Steps<f64>) {
        for (i, key) in keys.iter().enumerate() {
            let from = states.at[i];
            let way = self.way_from(from);
            // Renormalises by Σp = 1 up to rounding, which the factor below must not see.
            let Some((j, ..)) = self.problem.pick(key.unit64(dimension(event, 0)), |j| way.p[j]) else { continue };
            steps.factor[i] = self.problem.step(side, from, j) / way.p[j];
            steps.survival[i] = way.survival;
            (states.at[i], states.density[i]) = (j as u32, way.p[j]);
        }
    }

    fn fly(&self, _: Side, _: &mut MatrixStates) {}
}
