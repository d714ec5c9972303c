//! Conjugate gradients (Hestenes and Stiefel 1952) on the free unknowns.

use intrados_stage::Job;

use super::{
    BlockMatrix, SolveError,
    block::{Block, apply},
    constraint::Mask,
    vector::{advance, dot, largest, norm, xpby},
};
use rayon::prelude::*;

/// The matrix between what is free: P A P.
#[derive(Clone, Copy)]
pub(super) struct Operator<'a, const B: usize> {
    pub(super) matrix: &'a BlockMatrix<B>,
    pub(super) mask: &'a Mask<B>,
}

impl<const B: usize> Operator<'_, B> {
    /// y = P A x, for x that is free.
    pub(super) fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.matrix.multiply(x, y);
        self.mask.project(y);
    }

    /// r ← r − P A x, for x and r that are free.
    pub(super) fn subtract_product(&self, x: &[f64], r: &mut [f64]) {
        self.matrix.by_rows(x, r, |_, ax, r| r.iter_mut().zip(ax).for_each(|(r, ax)| *r -= ax));
        self.mask.project(r);
    }
}

/// z ≈ A⁻¹ r, symmetric and positive, free to free.
pub(super) trait Precondition<const B: usize>: Send + Sync {
    /// Writes z.
    fn apply(&self, operator: Operator<B>, r: &[f64], z: &mut [f64]) -> Result<(), SolveError>;
}

/// The inverse blocks of the diagonal.
pub(super) struct Jacobi<'a, const B: usize> {
    pub(super) inverse: &'a [Block<B, B>],
}

impl<const B: usize> Precondition<B> for Jacobi<'_, B> {
    fn apply(&self, _: Operator<B>, r: &[f64], z: &mut [f64]) -> Result<(), SolveError> {
        scale(self.inverse, r, z);
        Ok(())
    }
}

/// zᵢ = Dᵢ rᵢ
pub(super) fn scale<const B: usize>(d: &[Block<B, B>], r: &[f64], z: &mut [f64]) {
    let rows = z
        .as_chunks_mut::<B>()
        .0
        .par_chunks_mut(1 << 11)
        .zip(r.as_chunks::<B>().0.par_chunks(1 << 11))
        .zip(d.par_chunks(1 << 11));
    rows.for_each(|((z, r), d)| {
        z.iter_mut().zip(r).zip(d).for_each(|((z, r), d)| *z = apply(d, r))
    });
}

/// When conjugate gradients end.
pub(super) struct Until<'a> {
    /// ‖r‖ that is enough.
    pub(super) goal: f64,
    /// Iterations at most.
    pub(super) limit: usize,
    /// How many iterations something else costs that would do as well: where more than these are
    /// left, they end.
    pub(super) instead: Option<&'a dyn Fn() -> f64>,
}

/// Iterations after which it is asked for the first time what is left, then after twice as many.
const TRIAL: usize = 12;

/// Iterations that are left if they go on as so many have from the residual at the start to now.
fn left(iterations: usize, [start, now, goal]: [f64; 3]) -> f64 {
    let rate = (start / now).ln() / iterations as f64;
    if rate > 0.0 { (now / goal).ln() / rate } else { f64::INFINITY }
}

/// How the iterations went.
#[derive(Debug, Default)]
pub(super) struct History {
    pub(super) iterations: usize,
    /// ‖r‖ / ‖b‖ of the recurrence at the end.
    pub(super) residual: f64,
    /// Whether they ended because something else costs less.
    pub(super) slow: bool,
    /// Step lengths α and ratios β: the Lanczos matrix of the preconditioned operator.
    pub(super) coefficients: Vec<(f64, f64)>,
}

impl History {
    /// The largest eigenvalue of the Lanczos matrix, T_jj = 1/α_j + β_{j−1}/α_{j−1}, T_{j,j+1} =
    /// √β_j/α_j: a lower bound of the operator's largest that is close after ten steps.
    pub(super) fn largest_eigenvalue(&self) -> f64 {
        let n = self.coefficients.len();
        let mut t = nalgebra::DMatrix::zeros(n, n);
        for (j, (alpha, beta)) in self.coefficients.iter().enumerate() {
            t[(j, j)] += 1.0 / alpha;
            if j + 1 < n {
                t[(j + 1, j + 1)] += beta / alpha;
                t[(j, j + 1)] = beta.sqrt() / alpha;
                t[(j + 1, j)] = t[(j, j + 1)];
            }
        }
        if n == 0 {
            return 0.0;
        }
        t.symmetric_eigenvalues().iter().fold(0.0, |m: f64, v| m.max(*v))
    }
}

/// Improves x until ‖b − A x‖ ≤ tolerance ‖b‖ by the recurrence, or the iterations run out; `r`
/// comes in as b − A x and leaves as the recurrence's residual.
pub(super) fn conjugate_gradients<const B: usize>(
    operator: Operator<B>,
    precondition: &dyn Precondition<B>,
    x: &mut [f64],
    r: &mut [f64],
    Until { goal, limit, instead }: Until<'_>,
    job: &Job,
) -> Result<History, SolveError> {
    let mut history = History::default();
    let mut z = vec![0.0; x.len()];
    let mut p = vec![0.0; x.len()];
    let mut q = vec![0.0; x.len()];
    history.residual = norm(r);
    let start = history.residual;
    let mut before = 1.0;
    while history.residual > goal && history.iterations < limit {
        precondition.apply(operator, r, &mut z)?;
        let rz = dot(r, &z);
        let beta = if history.iterations == 0 { 0.0 } else { rz / before };
        if let Some(last) = history.coefficients.last_mut() {
            last.1 = beta;
        }
        xpby(&z, beta, &mut p);
        operator.multiply(&p, &mut q);
        let curvature = dot(&p, &q);
        if !(curvature > 0.0 && rz > 0.0) {
            return Err(SolveError::Indefinite {
                method: "conjugate gradients",
                node: largest(&p) / B,
            });
        }
        let alpha = rz / curvature;
        history.residual = advance(alpha, &p, &q, x, r).sqrt();
        history.coefficients.push((alpha, 0.0));
        history.iterations += 1;
        before = rz;
        let trials = history.iterations / TRIAL;
        if history.iterations.is_multiple_of(TRIAL)
            && trials.is_power_of_two()
            && let Some(cost) = instead
            && left(history.iterations, [start, history.residual, goal]) > cost()
        {
            history.slow = true;
            break;
        }
        let (done, total) = ((start / history.residual.max(goal)).ln(), (start / goal).ln());
        job.step((1e4 * done.max(0.0)) as usize, (1e4 * total) as usize)?;
    }
    Ok(history)
}
