use std::ops::Range;

use intrados_stage::random::Key;
use nalgebra::{DMatrix, DVector};

use super::{Exact, MatrixField, MatrixProblem, MatrixStates, START, spectral_radius};
use crate::{
    Ends, Links, Problem, Rule, Side, Steps, dimension,
    field::Field,
    walk::{COPIES, window},
};

/// Least probability with which a field lets a walk go on: one that is wrong must not kill it (theory §4).
const SURVIVAL: f64 = 0.05;

/// The matrix problem with its walks steered by a field (eq. 2.39–2.41), for the last-event estimator.
///
/// With weight 1 − `defence` it follows p_ij ∝ K_ij F_j; with `defence` it follows K alone, so that a wrong field costs
/// variance and never bias.
#[derive(Debug, Clone)]
pub struct SteeredMatrix<'a> {
    problem: &'a MatrixProblem,
    side: Side,
    field: MatrixField,
    defence: f64,
    /// What walks are expected to score, if they split and play roulette by what they promise.
    reading: Option<f64>,
    /// Probability to go on, one a state, and the last from the start.
    survival: Vec<f64>,
    /// Probabilities to go to each state, if it goes on, by place.
    ways: Vec<Vec<f64>>,
}

impl<'a> SteeredMatrix<'a> {
    /// Steers the walks of `side` by `field`: Φ̃ for the primal, Φ̃* for the dual.
    #[must_use]
    pub fn new(problem: &'a MatrixProblem, side: Side, field: MatrixField, defence: f64) -> Self {
        let mut steered = Self { problem, side, field, defence, reading: None, survival: Vec::new(), ways: Vec::new() };
        let n = problem.len() as u32;
        let places = || (0..n).chain([START]);
        steered.survival = places().map(|from| steered.survival_from(from)).collect();
        steered.ways = places().map(|from| (0..n).map(|j| steered.way(from, j)).collect()).collect();
        steered
    }

    /// The same with weight windows: walks split and play roulette by what they promise over `reading`.
    #[must_use]
    pub fn windowed(self, reading: f64) -> Self {
        Self { reading: Some(reading), ..self }
    }

    /// The reading that the field promises, Ĩ.
    #[must_use]
    pub fn promise(&self) -> f64 {
        self.field.value(&START)
    }

    fn far(&self, from: u32) -> f64 {
        self.problem.far(self.side).get(from as usize).copied().unwrap_or(0.0)
    }

    fn survival_from(&self, from: u32) -> f64 {
        let (steered, far) = (self.field.value(&from), self.far(from));
        // A field that predicts nothing must not kill the walk.
        let floor = if self.defence > 0.0 { SURVIVAL } else { 0.0 };
        let survival =
            if steered > 0.0 { (steered / (steered + far)).max(floor) } else { self.problem.row(self.side, from).total().min(0.95) };
        // Where there is something to score, absorption must stay possible.
        if far > 0.0 { survival.min(1.0 - 1e-9) } else { survival }
    }

    /// The share of walks that ignore the field at a place: all where it knows nothing.
    fn defence_at(&self, from: u32) -> f64 {
        if self.field.value(&from) > 0.0 { self.defence } else { 1.0 }
    }

    /// Probability of going from a place, a state or the start, to `j`, if the walk goes on.
    fn density(&self, from: u32, j: u32) -> f64 {
        self.ways[(from as usize).min(self.problem.len())][j as usize]
    }

    fn way(&self, from: u32, j: u32) -> f64 {
        let (value, kernel) = (self.field.value(&from), self.problem.row(self.side, from).p(j as usize));
        if value > 0.0 { self.field.mixed(&from, value, j, kernel, self.defence) } else { kernel }
    }

    fn kernel(&self, from: u32, j: u32) -> f64 {
        self.problem.row(self.side, from).weights[j as usize]
    }

    fn go_on(&self, from: u32) -> f64 {
        self.survival[(from as usize).min(self.problem.len())]
    }

    /// What a walk of weight `weight` promises at a place, over the reading: by N = KF + far, one step better than F itself.
    fn worth_of(&self, from: u32, weight: f64, reading: f64) -> f64 {
        let value = self.field.value(&from);
        if value > 0.0 { (weight * (value + self.far(from)) / reading).max(f64::MIN_POSITIVE) } else { -self.go_on(from) }
    }

    /// The exact expectation of the score without windows, from the very probabilities that the walk uses (theory §7, "unbiased under a
    /// wrong field").
    ///
    /// # Panics
    /// If the linear system is singular.
    #[must_use]
    pub fn expectation(&self) -> f64 {
        let n = self.problem.len();
        // v_i = q_i · far_i/q_i + Σ_j P_ij (K_ij/P_ij) v_j over the j that the walk can reach
        let expected = DMatrix::from_fn(n, n, |i, j| {
            let p = self.go_on(i as u32) * self.density(i as u32, j as u32);
            if p > 0.0 { p * (self.kernel(i as u32, j as u32) / p) } else { 0.0 }
        });
        let scored = DVector::from_fn(n, |i, _| {
            let q = 1.0 - self.go_on(i as u32);
            if q > 0.0 { q * (self.far(i as u32) / q) } else { 0.0 }
        });
        let Some(v) = (DMatrix::identity(n, n) - expected).lu().solve(&scored) else { panic!("1 − K is singular") };
        let begin = |j: usize| (self.density(START, j as u32), self.kernel(START, j as u32));
        (0..n).map(|j| (begin(j), v[j])).filter(|((p, _), _)| *p > 0.0).map(|((p, k), v)| p * (k / p) * v).sum()
    }

    /// The exact expectation of the score with windows, over all ways that a walk can take, for walks of few states and orders (the work
    /// grows with states to the power of `rule.max_order`). Without bias it is Σ I_k over the orders below `max_order`.
    #[must_use]
    pub fn expectation_of_walks(&self, rule: &Rule) -> f64 {
        self.expect_from(START, 1.0, 0, COPIES, rule)
    }

    fn expect_from(&self, at: u32, weight: f64, event: u32, left: u32, rule: &Rule) -> f64 {
        if event == rule.max_order {
            return weight * self.far(at);
        }
        let worth = self.reading.map_or(1.0, |reading| self.worth_of(at, weight, reading));
        let (survival, copies) = window(worth, event, rule.roulette_from, left);
        let goes_on = if event == 0 { 1.0 } else { self.go_on(at) };
        let (all, weight) = (survival * f64::from(copies), weight / (survival * f64::from(copies)));
        let stops = 1.0 - goes_on;
        let scored = if stops > 0.0 { stops * (weight * self.far(at) / stops) } else { 0.0 };
        let way = |j: u32| {
            let p = self.density(at, j);
            let carried = weight * self.kernel(at, j) / (p * goes_on);
            if p * goes_on > 0.0 { p * goes_on * self.expect_from(j, carried, event + 1, left / copies, rule) } else { 0.0 }
        };
        all * (scored + (0..self.problem.len() as u32).map(way).sum::<f64>())
    }

    /// The exact relVar of one walk without windows, or infinity: h_i = far_i²/q_i + Σ_j K_ij²/P_ij h_j. Without defence it is the
    /// [oracle](Self::oracle) of theory §5 by another way.
    #[must_use]
    pub fn rel_var(&self) -> f64 {
        let n = self.problem.len();
        let step = DMatrix::from_fn(n, n, |i, j| {
            let p = self.go_on(i as u32) * self.density(i as u32, j as u32);
            if p > 0.0 { self.kernel(i as u32, j as u32).powi(2) / p } else { 0.0 }
        });
        if spectral_radius(&step) >= 1.0 {
            return f64::INFINITY;
        }
        let stop = DVector::from_fn(n, |i, _| {
            let far = self.far(i as u32);
            if far > 0.0 { far * far / (1.0 - self.go_on(i as u32)) } else { 0.0 }
        });
        let Some(h) = (DMatrix::identity(n, n) - step).lu().solve(&stop) else { return f64::INFINITY };
        let begin = |j: usize| {
            let p = self.density(START, j as u32);
            if p > 0.0 { self.kernel(START, j as u32).powi(2) / p * h[j] } else { 0.0 }
        };
        let reading = self.problem.solve().reading;
        (0..n).map(begin).sum::<f64>() / (reading * reading) - 1.0
    }

    /// The exact relVar of one walk without defence, or infinity (theory §5, the oracle).
    #[must_use]
    pub fn oracle(&self) -> f64 {
        let n = self.problem.len();
        let (far, field) = (self.problem.far(self.side), self.field.table());
        let next = |i: usize| (0..n).map(|j| self.kernel(i as u32, j as u32) * field[j]).sum::<f64>() + far[i];
        let total: Vec<f64> = (0..n).map(next).collect();
        let r2: Vec<f64> = (0..n).map(|i| (total[i] / field[i]).powi(2)).collect();
        let step = DMatrix::from_fn(n, n, |i, j| r2[i] * self.kernel(i as u32, j as u32) * field[j] / total[i]);
        if spectral_radius(&step) >= 1.0 {
            return f64::INFINITY;
        }
        let stop = DVector::from_fn(n, |i, _| r2[i] * far[i] / total[i]);
        let Some(h) = (DMatrix::identity(n, n) - step).lu().solve(&stop) else { return f64::INFINITY };
        let near = self.problem.near(self.side);
        let guess = near.dot(field);
        let second = guess * (0..n).map(|i| near[i] * field[i] * h[i]).sum::<f64>();
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
        let eps = self.field.table().component_div(steers).add_scalar(-1.0);
        let variance = |p: &dyn Fn(usize) -> f64| {
            let (m1, m2) = (0..n).fold((0.0, 0.0), |(a, b), j| (a + p(j) * eps[j], b + p(j) * eps[j] * eps[j]));
            m2 - m1 * m1
        };
        let near = self.problem.near(self.side);
        variance(&|j| near[j] * steers[j] / exact.reading)
            + (0..n)
                .map(|i| {
                    let p = |j: usize| self.kernel(i as u32, j as u32) * steers[j] / steers[i];
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

    fn worth(&self, _: Side, _: u32, weight: &[f64], states: &mut MatrixStates, worth: &mut [f64]) -> bool {
        let Some(reading) = self.reading else { return false };
        for ((worth, &weight), &at) in worth.iter_mut().zip(weight).zip(&states.at) {
            *worth = self.worth_of(at, weight, reading);
        }
        true
    }

    fn scatter(&self, side: Side, event: u32, keys: &[Key], states: &mut MatrixStates, steps: &mut Steps<f64>) {
        for (i, key) in keys.iter().enumerate() {
            let from = states.at[i];
            let number = |k: u32| key.unit64(dimension(event, k));
            let defence = self.defence_at(from);
            let way = if defence > 0.0 && number(1) < defence {
                self.problem.row(side, from).pick(number(0)).map(|j| j as u32)
            } else {
                self.field.sample(&from, self.field.value(&from), [number(0), 0.0, 0.0, 0.0])
            };
            let Some(j) = way else { continue };
            let p = self.density(from, j);
            steps.factor[i] = self.kernel(from, j) / p;
            steps.survival[i] = self.go_on(from);
            (states.at[i], states.density[i]) = (j, p);
        }
    }

    fn fly(&self, _: Side, _: &mut MatrixStates) {}
}
