//! One entry for all methods.

use intrados_stage::Job;

use super::{
    BlockMatrix, Constraints, SolveError, body,
    constraint::Mask,
    krylov::{Jacobi, Operator, Precondition, conjugate_gradients},
    vector::{largest, norm, not_finite},
};

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Whichever is expected to be cheapest; direct if the matrix turns out to be indefinite.
    #[default]
    Auto,
    /// A factorisation.
    Direct,
    /// Conjugate gradients with smoothed-aggregation multigrid.
    Multigrid,
    /// Conjugate gradients with the inverse blocks of the diagonal.
    Jacobi,
}

/// A solution, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// B values for each node.
    pub x: Vec<f64>,
    /// Iterations (of refinement, for a direct method).
    pub iterations: usize,
    /// ‖f − K x‖ / ‖f − K u_c‖ over what is free, computed anew from x.
    pub relative_residual: f64,
    /// Which method solved.
    pub method: &'static str,
    /// Estimate of the most bytes held at a time: matrix, hierarchy or factor, vectors.
    pub peak_bytes: usize,
}

/// Solves K u = f once.
///
/// # Errors
/// Everything in [`SolveError`].
pub fn solve<const B: usize>(
    matrix: &BlockMatrix<B>,
    rhs: &[f64],
    constraints: &Constraints<B>,
    method: Method,
    tolerance: f64,
    job: &Job,
) -> Result<Solution, SolveError> {
    Solver::new(matrix, constraints, method, job)?.solve(matrix, rhs, constraints, tolerance, job)
}

/// What is kept between right-hand sides and between matrices of one pattern: the factor or the hierarchy.
pub struct Solver<const B: usize> {
    mask: Mask<B>,
    method: Method,
    engine: Engine<B>,
}

enum Engine<const B: usize> {
    Jacobi(Jacobi<B>),
}

impl<const B: usize> Solver<B> {
    /// Checks matrix and constraints, and prepares the method.
    ///
    /// # Errors
    /// [`SolveError::Length`], [`SolveError::NotFinite`], [`SolveError::Floating`], [`SolveError::NoStiffness`], [`SolveError::Cancelled`].
    pub fn new(matrix: &BlockMatrix<B>, constraints: &Constraints<B>, method: Method, job: &Job) -> Result<Self, SolveError> {
        inside(|| {
            let mask = checked(matrix, constraints)?;
            job.step(0, 1)?;
            let engine = Engine::Jacobi(Jacobi { inverse: mask.inverse_diagonal(matrix)? });
            Ok(Self { mask, method, engine })
        })
    }

    /// Takes new values of the matrix (same pattern) and new constraints.
    ///
    /// # Errors
    /// As [`Solver::new`].
    pub fn update(&mut self, matrix: &BlockMatrix<B>, constraints: &Constraints<B>, job: &Job) -> Result<(), SolveError> {
        *self = Self::new(matrix, constraints, self.method, job)?;
        Ok(())
    }

    /// Solves for one right-hand side; `matrix` is the one of [`Solver::new`] or of the last [`Solver::update`], `constraints` have the
    /// same directions, with any values.
    ///
    /// # Errors
    /// [`SolveError::Length`], [`SolveError::NotFinite`], [`SolveError::Indefinite`], [`SolveError::NotConverged`], [`SolveError::Cancelled`].
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix<B>,
        rhs: &[f64],
        constraints: &Constraints<B>,
        tolerance: f64,
        job: &Job,
    ) -> Result<Solution, SolveError> {
        let expected = matrix.unknowns();
        if rhs.len() != expected {
            return Err(SolveError::Length { what: "right-hand side", found: rhs.len(), expected });
        }
        inside(|| {
            if let Some(i) = not_finite(rhs) {
                return Err(SolveError::NotFinite { what: "right-hand side", node: i / B });
            }
            if let Some(node) = self.mask.loaded_void(rhs) {
                return Err(SolveError::NoStiffness { node });
            }
            let operator = Operator { matrix, mask: &self.mask };
            let mut x = constraints.values();
            let mut r = residual(operator, rhs, &x);
            let scale = norm(&r);
            let goal = tolerance * scale;
            let engine = match &self.engine {
                Engine::Jacobi(jacobi) => jacobi as &dyn Precondition<B>,
            };
            let (mut iterations, limit) = (0, 20_000);
            // The recurrence drifts from the truth on long runs: start again from the true residual, at most a few times.
            for _ in 0..4 {
                if norm(&r) <= goal {
                    break;
                }
                iterations += conjugate_gradients(operator, engine, &mut x, &mut r, (0.5 * goal, limit - iterations), job)?.iterations;
                r = residual(operator, rhs, &x);
            }
            let relative_residual = if scale > 0.0 { norm(&r) / scale } else { 0.0 };
            if norm(&r) > goal {
                let node = largest(&r) / B;
                return Err(SolveError::NotConverged { method: "jacobi", iterations, residual: relative_residual, tolerance, node });
            }
            let peak_bytes = matrix.bytes() + self.mask.bytes() + 6 * size_of_val(rhs);
            Ok(Solution { x, iterations, relative_residual, method: "jacobi", peak_bytes })
        })
    }
}

/// P (f − A x)
fn residual<const B: usize>(operator: Operator<B>, rhs: &[f64], x: &[f64]) -> Vec<f64> {
    let mut r = vec![0.0; x.len()];
    let f = rhs.as_chunks::<B>().0;
    operator.matrix.by_rows(x, &mut r, |i, ax, r| *r = std::array::from_fn(|c| f[i][c] - ax[c]));
    operator.mask.project(&mut r);
    r
}

/// What is free, if the system is one.
fn checked<const B: usize>(matrix: &BlockMatrix<B>, constraints: &Constraints<B>) -> Result<Mask<B>, SolveError> {
    if constraints.nodes() != matrix.nodes() {
        return Err(SolveError::Length { what: "set of constraints", found: constraints.nodes(), expected: matrix.nodes() });
    }
    if let Some(node) = matrix.not_finite() {
        return Err(SolveError::NotFinite { what: "matrix", node });
    }
    body::check(matrix, constraints)?;
    Ok(Mask::new(constraints, matrix))
}

/// Runs in a worker of the pool: a solve is thousands of short parallel loops, each of which would otherwise wake it.
fn inside<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}
