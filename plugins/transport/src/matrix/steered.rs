use std::ops::Range;

use intrados_stage::random::Key;
use nalgebra::{DMatrix, DVector};

use super::{Exact, MatrixField, MatrixProblem, MatrixStates, START, spectral_radius};
use crate::{
    Ends, Links, Side, Steps, TransportProblem, WalkRule, dimension,
    field::{Field, promise},
    walk::{COPIES, split, window},
};

/// Least probability with which a field lets a walk go on: one that is wrong must not kill it
/// (theory §4).
const SURVIVAL: f64 = 0.05;

/// The matrix problem with its walks steered by a field (eq. 2.39–2.41), for the last-event
/// estimator.
///
/// With weight 1 − `defence` it follows p_ij ∝ K_ij F_j; with `defence` it follows K alone, so that
/// a wrong field costs variance and never bias.
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
        let mut steered = Self {
            problem,
            side,
            field,
            defence,
            reading: None,
            survival: Vec::new(),
            ways: Vec::new(),
        };
        let n = problem.len() as u32;
        let places = || (0..n).chain([START]);
        steered.survival = places().map(|from| steered.survival_from(from)).collect();
        steered.ways =
            places().map(|from| (0..n).map(|j| steered.way(from, j)).collect()).collect();
        steered
    }

    /// The same with weight windows: walks split and play roulette by what they promise over
    /// `reading`.
    #[must_use]
    pub(crate) fn windowed(self, reading: f64) -> Self {
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
        let survival = if steered > 0.0 {
            (steered / (steered + far)).max(floor)
        } else {
            self.problem.row(self.side, from).total().min(0.95)
        };
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
        let (value, kernel) =
            (self.field.value(&from), self.problem.row(self.side, from).p(j as usize));
        if value > 0.0 { self.field.mixed(&from, value, j, kernel, self.defence) } else { kernel }
    }

    fn kernel(&self, from: u32, j: u32) -> f64 {
        self.problem.row(self.side, from).weights[j as usize]
    }

    fn go_on(&self, from: u32) -> f64 {
        self.survival[(from as usize).min(self.problem.len())]
    }

    /// What a walk of weight `weight` promises at a place, over the reading: by N = KF + far, one
    /// step better than F itself.
    fn expected_of(&self, from: u32, weight: f64, reading: f64) -> f64 {
        let value = self.field.value(&from);
        if value > 0.0 {
            promise(weight * (value + self.far(from)), reading)
        } else {
            -self.go_on(from)
        }
    }

    /// Whether a walk ignores the field at a place, by a number in [0, 1).
    fn ignores(&self, from: u32, number: f64) -> bool {
        number < self.defence_at(from)
    }

    /// Where a walk goes on to, by a number in [0, 1).
    fn pick(&self, from: u32, ignores: bool, number: f64) -> Option<u32> {
        if ignores {
            self.problem.row(self.side, from).pick(number).map(|j| j as u32)
        } else {
            self.field.sample(&from, self.field.value(&from), [number, 0.0, 0.0, 0.0])
        }
    }

    /// With what probabilities walks *go* from a place to each state: measured on the routine that
    /// draws, whatever density they are weighed by.
    fn drawn(&self, from: u32) -> Vec<f64> {
        let ignoring = share(|u| self.ignores(from, u));
        let below = |j: u32| {
            let of = |ignores: bool| share(|u| self.pick(from, ignores, u).is_some_and(|k| k <= j));
            ignoring * if ignoring > 0.0 { of(true) } else { 0.0 }
                + (1.0 - ignoring) * if ignoring < 1.0 { of(false) } else { 0.0 }
        };
        let sums: Vec<f64> = (0..self.problem.len() as u32).map(below).collect();
        (0..sums.len()).map(|j| sums[j] - if j > 0 { sums[j - 1] } else { 0.0 }).collect()
    }

    /// What a walk's weight is multiplied by where it goes from a place to `j`, but for survival.
    fn factor(&self, from: u32, j: u32) -> f64 {
        self.kernel(from, j) / self.density(from, j)
    }

    /// The exact expectation of the score without windows (theory §7, "unbiased under a wrong
    /// field"): the ways that the walk draws, each weighed as the walk weighs it. What survival
    /// takes, the walk gives back for itself.
    ///
    /// # Panics
    /// If the linear system is singular.
    #[must_use]
    pub(crate) fn expectation(&self) -> f64 {
        let n = self.problem.len();
        let way = |from: u32| -> Vec<f64> {
            let weighed =
                |(j, p): (usize, f64)| if p > 0.0 { p * self.factor(from, j as u32) } else { 0.0 };
            self.drawn(from).into_iter().enumerate().map(weighed).collect()
        };
        // v_i = far_i + Σ_j P_ij w_ij v_j
        let rows: Vec<Vec<f64>> = (0..n as u32).map(way).collect();
        let expected = DMatrix::from_fn(n, n, |i, j| rows[i][j]);
        let scored = DVector::from_fn(n, |i, _| self.far(i as u32));
        let Some(v) = (DMatrix::identity(n, n) - expected).lu().solve(&scored) else {
            panic!("1 − K is singular")
        };
        way(START).iter().zip(v.iter()).map(|(p, v)| p * v).sum()
    }

    /// The exact expectation of the score with windows, over all ways that a walk can take, for
    /// walks of few states and orders (the work grows with states to the power of
    /// `rule.max_order`). Without bias it is Σ I_k over the orders below `max_order`.
    #[must_use]
    pub(crate) fn expectation_of_walks(&self, rule: &WalkRule) -> f64 {
        let drawn: Vec<Vec<f64>> =
            (0..self.problem.len() as u32).chain([START]).map(|from| self.drawn(from)).collect();
        self.expect_from(START, 1.0, 0, COPIES, rule, &drawn)
    }

    fn expect_from(
        &self,
        at: u32,
        weight: f64,
        event: u32,
        left: u32,
        rule: &WalkRule,
        drawn: &[Vec<f64>],
    ) -> f64 {
        if event == rule.max_order {
            return weight * self.far(at);
        }
        let expected = self.reading.map_or(1.0, |reading| self.expected_of(at, weight, reading));
        let window = window(expected, event, rule.roulette_from, left);
        let survive = share(|u| split(window, || u).0 > 0);
        let (copies, carried) = split(window, || 0.0);
        if survive <= 0.0 || copies == 0 {
            return 0.0;
        }
        let weight = weight * carried;
        let way = |(j, &p): (usize, &f64)| {
            let on = |j: u32| {
                self.expect_from(
                    j,
                    weight * self.factor(at, j) / self.goes_on(at, event),
                    event + 1,
                    left / copies,
                    rule,
                    drawn,
                )
            };
            if p > 0.0 { self.goes_on(at, event) * p * on(j as u32) } else { 0.0 }
        };
        let scored = if event == 0 { 0.0 } else { weight * self.far(at) };
        let ways = &drawn[(at as usize).min(self.problem.len())];
        survive * f64::from(copies) * (scored + ways.iter().enumerate().map(way).sum::<f64>())
    }

    /// The start is drawn, and walks on from there in any case.
    fn goes_on(&self, at: u32, event: u32) -> f64 {
        if event == 0 { 1.0 } else { self.go_on(at) }
    }

    /// The exact relVar of one walk without windows, or infinity: h_i = far_i²/q_i + Σ_j K_ij²/P_ij
    /// h_j. Without defence it is the [oracle](Self::oracle) of theory §5 by another way.
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
        let Some(h) = (DMatrix::identity(n, n) - step).lu().solve(&stop) else {
            return f64::INFINITY;
        };
        let begin = |j: usize| {
            let p = self.density(START, j as u32);
            if p > 0.0 { self.kernel(START, j as u32).powi(2) / p * h[j] } else { 0.0 }
        };
        let reading = self.problem.solve().reading;
        (0..n).map(begin).sum::<f64>() / (reading * reading) - 1.0
    }

    /// The exact relVar of one walk without defence, or infinity (theory §5, the oracle).
    #[must_use]
    pub(crate) fn oracle(&self) -> f64 {
        let n = self.problem.len();
        let (far, field) = (self.problem.far(self.side), self.field.table());
        let next = |i: usize| {
            (0..n).map(|j| self.kernel(i as u32, j as u32) * field[j]).sum::<f64>() + far[i]
        };
        let total: Vec<f64> = (0..n).map(next).collect();
        let r2: Vec<f64> = (0..n).map(|i| (total[i] / field[i]).powi(2)).collect();
        let step = DMatrix::from_fn(n, n, |i, j| {
            r2[i] * self.kernel(i as u32, j as u32) * field[j] / total[i]
        });
        if spectral_radius(&step) >= 1.0 {
            return f64::INFINITY;
        }
        let stop = DVector::from_fn(n, |i, _| r2[i] * far[i] / total[i]);
        let Some(h) = (DMatrix::identity(n, n) - step).lu().solve(&stop) else {
            return f64::INFINITY;
        };
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
            let (m1, m2) = (0..n)
                .fold((0.0, 0.0), |(a, b), j| (a + p(j) * eps[j], b + p(j) * eps[j] * eps[j]));
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

impl TransportProblem for SteeredMatrix<'_> {
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

    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &MatrixStates,
        ends: &mut Ends<f64>,
    ) -> bool {
        self.problem.arrive(side, channel, states, ends)
    }

    fn link(
        &self,
        _: Side,
        _: usize,
        _: u32,
        _: &[Key],
        _: &mut MatrixStates,
        _: &mut Links<f64>,
    ) -> bool {
        false
    }

    fn reveal(&self, _: Side, _: &mut MatrixStates, _: &mut Links<f64>) {}

    fn expected_contribution(
        &self,
        _: Side,
        _: u32,
        weight: &[f64],
        states: &mut MatrixStates,
        expected: &mut [f64],
    ) -> bool {
        let Some(reading) = self.reading else { return false };
        for ((expected, &weight), &at) in expected.iter_mut().zip(weight).zip(&states.at) {
            *expected = self.expected_of(at, weight, reading);
        }
        true
    }

    fn scatter(
        &self,
        _: Side,
        event: u32,
        keys: &[Key],
        states: &mut MatrixStates,
        steps: &mut Steps<f64>,
    ) {
        for (i, key) in keys.iter().enumerate() {
            let from = states.at[i];
            let number = |k: u32| key.unit64(dimension(event, k));
            let Some(j) = self.pick(from, self.ignores(from, number(1)), number(0)) else {
                continue;
            };
            steps.factor[i] = self.factor(from, j);
            steps.survival[i] = self.go_on(from);
            (states.at[i], states.density[i]) = (j, self.density(from, j));
        }
    }

    fn fly(&self, _: Side, _: &mut MatrixStates) {}
}

/// Share of the numbers in [0, 1) for which `holds`, which does up to one of them and not from
/// there on.
fn share(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    if !holds(0.0) {
        return 0.0;
    }
    while high > f64::MIN_POSITIVE && high - low > f64::EPSILON * high {
        let middle = 0.5 * (low + high);
        if holds(middle) { low = middle } else { high = middle }
    }
    if high == 1.0 { 1.0 } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a walk draws is what it says that it draws; a density that is a thousandth too large,
    /// or a way that is never drawn, makes a mean that is wrong by as much.
    #[test]
    fn a_wrong_sampler_or_a_wrong_density_is_found() {
        let problem = MatrixProblem::chain(12, 0.8, 2);
        let reading = problem.solve().reading;
        let field = DVector::from_fn(12, |i, _| 1.0 + (i % 3) as f64);
        for side in Side::BOTH {
            let right = SteeredMatrix::new(
                &problem,
                side,
                MatrixField::new(&problem, side, field.clone()),
                0.1,
            );
            for from in (0..12).chain([START]) {
                let apart = right
                    .drawn(from)
                    .iter()
                    .enumerate()
                    .map(|(j, p)| (p - right.density(from, j as u32)).abs())
                    .fold(0.0, f64::max);
                assert!(apart < 1e-14, "{side:?} from {from}: {apart:e}");
            }
            assert!(
                (right.expectation() / reading - 1.0).abs() < 1e-11,
                "{}",
                right.expectation() / reading - 1.0
            );
            let mut denser = right.clone();
            denser.ways.iter_mut().flatten().for_each(|p| *p *= 1.001);
            assert!((denser.expectation() / reading - 1.0).abs() > 1e-3);
            let small = WalkRule { max_order: 4, roulette_from: 2, ..WalkRule::default() };
            let truth = problem.reading_up_to(4);
            assert!(
                (right.clone().windowed(truth).expectation_of_walks(&small) / truth - 1.0).abs()
                    < 1e-11
            );
            assert!(
                (denser.windowed(truth).expectation_of_walks(&small) / truth - 1.0).abs() > 1e-3
            );
            // Steered by another field than it is weighed by.
            let mut biased = right.clone();
            biased.field = MatrixField::new(&problem, side, field.map(|f| f * f));
            assert!((biased.expectation() / reading - 1.0).abs() > 1e-3);
            // More walks ignore the field than is said.
            let mut bold = right.clone();
            bold.defence = 0.2;
            assert!((bold.expectation() / reading - 1.0).abs() > 1e-6);
        }
    }
}
