//! The smallest transport problem: a dense kernel on n states, with its exact solution. It judges
//! every estimator, and the two walks that steer each other.

mod field;
mod steered;
mod trainer;

use std::ops::Range;

use intrados_stage::random::Key;
use nalgebra::{DMatrix, DVector};

use crate::{Ends, Links, Side, States, Steps, TransportProblem, dimension, keep, spread};

pub use field::{MatrixField, MatrixSample};
pub use steered::SteeredMatrix;
pub use trainer::{Learns, Trainer};

/// Φ_i = Σ_j K_ij Φ_j + σ_i, I = Σ_i g_i Φ_i. All entries ≥ 0, spectral radius of K below 1.
#[derive(Debug, Clone)]
pub struct MatrixProblem {
    kernel: DMatrix<f64>,
    source: DVector<f64>,
    response: DVector<f64>,
    /// By side, one a state and the last from the start: K or g, σ.
    rows: [Vec<Row>; 2],
}

/// Weights of states to go to.
#[derive(Debug, Clone)]
struct Row {
    weights: Vec<f64>,
    /// Sums of all up to each.
    sums: Vec<f64>,
}

impl Row {
    fn new(weights: Vec<f64>) -> Self {
        let mut sum = 0.0;
        let sums = weights.iter().map(|w| {
            sum += w;
            sum
        });
        Self { sums: sums.collect(), weights }
    }

    fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// State j with probability `weights[j]/total`, never one of weight 0.
    fn pick(&self, u: f64) -> Option<usize> {
        let total = self.total();
        let j = self.sums.partition_point(|&sum| sum <= u * total);
        if total > 0.0 { Some(j.min(self.weights.len() - 1)) } else { None }
    }

    fn p(&self, j: usize) -> f64 {
        let total = self.total();
        if total > 0.0 { self.weights[j] / total } else { 0.0 }
    }
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
    pub(crate) fn zero_variance_length(&self) -> f64 {
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
        assert!(
            kernel.is_square() && kernel.nrows() == source.len() && source.len() == response.len(),
            "sizes of K, σ and g differ"
        );
        let rows = Side::BOTH.map(|side| {
            let (near, kernel) = if side == Side::Primal {
                (&response, kernel.transpose())
            } else {
                (&source, kernel.clone())
            };
            kernel
                .column_iter()
                .map(|from| Row::new(from.iter().copied().collect()))
                .chain([Row::new(near.as_slice().to_vec())])
                .collect()
        });
        Self { kernel, source, response, rows }
    }

    /// A chain of `n` states whose kernel falls off with distance (e-folding 2 states, random
    /// factors .5–1.5), scaled to spectral radius `rho`. Source at one end, response at the other:
    /// deep, I falls to 1e-10 (`research/light.md` §1).
    #[must_use]
    pub fn chain(n: usize, rho: f64, seed: u64) -> Self {
        let kernel = DMatrix::from_fn(n, n, |i, j| {
            (-(i.abs_diff(j) as f64) / 2.0).exp()
                * (0.5 + Key::new(seed, (i * n + j) as u64).unit64(0))
        });
        let kernel = &kernel * (rho / spectral_radius(&kernel));
        let end = |near: bool| {
            DVector::from_fn(n, |i, _| {
                if (if near { i } else { n - 1 - i }) < 3 { 1.0 / 3.0 } else { 0.0 }
            })
        };
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
        let (Some(field), Some(importance)) =
            (a.clone().lu().solve(&self.source), a.transpose().lu().solve(&self.response))
        else {
            panic!("1 − K is singular");
        };
        let reading = self.response.dot(&field);
        Exact { field, importance, reading, spectral_radius: spectral_radius(&self.kernel) }
    }

    /// Σ I_k over the first `orders` orders.
    #[must_use]
    pub(crate) fn reading_up_to(&self, orders: u32) -> f64 {
        let (mut term, mut sum) = (self.source.clone(), 0.0);
        for _ in 0..orders {
            sum += self.response.dot(&term);
            term = &self.kernel * term;
        }
        sum
    }

    /// Where walks start.
    fn near(&self, side: Side) -> &DVector<f64> {
        if side == Side::Primal { &self.response } else { &self.source }
    }

    /// What walks look for.
    fn far(&self, side: Side) -> &DVector<f64> {
        self.near(side.other())
    }

    /// Kernel from a place, a state or the start, as the walk of `side` sees it.
    fn row(&self, side: Side, from: u32) -> &Row {
        &self.rows[side as usize][(from as usize).min(self.len())]
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

    fn repeat(&mut self, rows: &[u32]) {
        spread(&mut self.at, rows);
        spread(&mut self.density, rows);
    }
}

impl MatrixStates {
    /// Where the walks are.
    #[must_use]
    pub fn places(&self) -> &[u32] {
        &self.at
    }

    fn start(&mut self, n: usize) {
        self.at.clear();
        self.at.resize(n, START);
        self.density.clear();
        self.density.resize(n, 1.0);
    }
}

impl TransportProblem for MatrixProblem {
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

    fn link(
        &self,
        side: Side,
        _: usize,
        event: u32,
        keys: &[Key],
        states: &mut MatrixStates,
        links: &mut Links<f64>,
    ) -> bool {
        let far = self.row(side.other(), START);
        for (i, &at) in states.at.iter().enumerate() {
            let Some(j) = far.pick(keys[i].unit64(dimension(event, 8))) else { return false };
            let row = self.row(side, at);
            links.value[i] = row.weights[j] * far.total();
            links.link_density[i] = far.p(j);
            links.kernel_density[i] = row.p(j);
        }
        true
    }

    fn reveal(&self, _: Side, _: &mut MatrixStates, _: &mut Links<f64>) {}

    fn scatter(
        &self,
        side: Side,
        event: u32,
        keys: &[Key],
        states: &mut MatrixStates,
        steps: &mut Steps<f64>,
    ) {
        for (i, key) in keys.iter().enumerate() {
            let row = self.row(side, states.at[i]);
            if let Some(j) = row.pick(key.unit64(dimension(event, 0))) {
                steps.factor[i] = row.total();
                steps.survival[i] = row.total().min(0.95);
                (states.at[i], states.density[i]) = (j as u32, row.p(j));
            }
        }
    }

    fn fly(&self, _: Side, _: &mut MatrixStates) {}
}
