//! The smallest eigenvalues λ of K φ = λ G φ: squares of frequencies (G the mass), factors of buckling (G what stresses take from the stiffness).
//!
//! K⁻¹ G is symmetric in the scalar product of K. Its largest eigenvalues 1/λ are taken from a
//! Krylov space of blocks (Golub and Underwood 1977), which finds as many equal ones as a block
//! has vectors, orthogonal to all that went before. By Sylvester's law of inertia the number of
//! negative pivots of K − σ G then says whether one below σ was missed.

use intrados_stage::Job;
use nalgebra::DMatrix;

use crate::sparse::{BlockMatrix, Constraints, Method, SolveError, Solver, solve};

/// Vectors of a block.
const BLOCK: usize = 6;
/// ‖f − K x‖ / ‖f‖ of every solution: a strip 300 times as long as thick comes near 1e-7, and what
/// nothing holds to no digit at all.
const TOLERANCE: f64 = 1e-6;
/// By how much an eigenvalue may change from one block to the next, over itself.
const SETTLED: f64 = 1e-10;
/// What of a vector is left counts as nothing, over what it was.
const NOTHING: f64 = 1e-9;
/// Vectors, beside eight for each eigenvalue, that are enough for all but what does not converge.
const ENOUGH: usize = 600;
/// Stiffness by mass that is added where parts can move freely, over the ratio of both traces.
const SHIFT: f64 = 1e-6;
/// By how much an eigenvalue of nothing may be below it, over that.
const ROUNDING: f64 = 1e-6;

/// Why there are no eigenvalues.
#[derive(Debug)]
pub(super) enum Failed {
    /// K is not positive definite.
    Indefinite,
    NotConverged,
    Solve(SolveError),
}

impl From<SolveError> for Failed {
    fn from(error: SolveError) -> Self {
        Self::Solve(error)
    }
}

/// The smallest positive eigenvalues, ascending; fewer where there are not as many.
/// Where K is singular, those of K + s G, less s.
pub(super) fn smallest(
    mut k: BlockMatrix<1>,
    g: &BlockMatrix<1>,
    count: usize,
    job: &Job,
) -> Result<Vec<f64>, Failed> {
    match Krylov::new(&k, g, job) {
        Ok(krylov) => krylov.smallest(count, job),
        Err(
            Failed::Indefinite
            | Failed::Solve(
                SolveError::Indefinite { .. }
                | SolveError::Floating { .. }
                | SolveError::NoStiffness { .. }
                | SolveError::NotConverged { .. },
            ),
        ) if g.trace() > 0.0 => {
            let shift = SHIFT * k.trace() / g.trace();
            k.add(shift, g);
            let mut found = Krylov::new(&k, g, job)?.smallest(count, job)?;
            found.iter_mut().for_each(|value| *value -= shift);
            // What moves freely differs from nothing by rounding alone.
            let is_unstable = found.iter().any(|value| *value < -ROUNDING * shift);
            if is_unstable { Err(Failed::Indefinite) } else { Ok(found) }
        }
        Err(other) => Err(other),
    }
}

/// A basis that is orthonormal in the scalar product of K.
struct Krylov<'a> {
    k: &'a BlockMatrix<1>,
    g: &'a BlockMatrix<1>,
    solver: Solver<1>,
    basis: Vec<Vec<f64>>,
    /// K and G times each.
    stiff: Vec<Vec<f64>>,
    pushed: Vec<Vec<f64>>,
}

impl<'a> Krylov<'a> {
    fn new(k: &'a BlockMatrix<1>, g: &'a BlockMatrix<1>, job: &Job) -> Result<Self, Failed> {
        let none = Constraints::new(k.unknowns());
        let mut solver = Solver::new(k, &none, Method::Direct, job)?;
        // A first solution shows whether something can move freely.
        let tried = solver.solve(k, &start(k.unknowns(), 0), &none, TOLERANCE, job)?;
        if tried.negative_eigenvalues > 0 {
            return Err(Failed::Indefinite);
        }
        Ok(Self { k, g, solver, basis: Vec::new(), stiff: Vec::new(), pushed: Vec::new() })
    }

    fn smallest(mut self, count: usize, job: &Job) -> Result<Vec<f64>, Failed> {
        let unknowns = self.k.unknowns();
        let mut seeds = 0;
        let mut last: Vec<f64> = Vec::new();
        let mut begin = 0;
        while self.basis.len() < unknowns {
            job.step(self.basis.len(), unknowns).map_err(SolveError::from)?;
            if self.basis.len() > ENOUGH + 8 * count {
                return Err(Failed::NotConverged);
            }
            let end = self.basis.len();
            for j in begin..end {
                let next = self.solved(&self.pushed[j].clone(), job)?;
                self.take(next);
            }
            begin = end;
            if self.basis.len() == end {
                // The space is closed: what it lacks begins anew.
                let before = self.basis.len();
                for _ in 0..BLOCK {
                    seeds += 1;
                    let seed = self.solved(&start(unknowns, seeds), job)?;
                    self.take(seed);
                }
                if self.basis.len() == before {
                    break;
                }
                continue;
            }
            let found = self.ritz();
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= SETTLED * a.abs();
            let enough = found.len() > count && last.len() > count;
            if enough
                && found[..=count].iter().zip(&last).all(near)
                && self.is_whole(&found, count, job)
            {
                return Ok(first(found, count));
            }
            last = found;
        }
        Ok(first(self.ritz(), count))
    }

    fn solved(&mut self, rhs: &[f64], job: &Job) -> Result<Vec<f64>, Failed> {
        let none = Constraints::new(self.k.unknowns());
        Ok(self.solver.solve(self.k, rhs, &none, TOLERANCE, job)?.x)
    }

    /// Adds what of a vector is orthogonal to the basis.
    fn take(&mut self, mut v: Vec<f64>) {
        let length = |k: &BlockMatrix<1>, v: &[f64]| {
            let kv = times(k, v);
            (dot(&kv, v).max(0.0).sqrt(), kv)
        };
        let (whole, _) = length(self.k, &v);
        // Twice is enough (Kahan, by Parlett 1980).
        for _ in 0..2 {
            for (b, kb) in self.basis.iter().zip(&self.stiff) {
                let share = dot(kb, &v);
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= share * b);
            }
        }
        let (left, mut kv) = length(self.k, &v);
        if whole.is_nan() || left <= NOTHING * whole || left == 0.0 {
            return;
        }
        v.iter_mut().for_each(|v| *v /= left);
        kv.iter_mut().for_each(|v| *v /= left);
        self.pushed.push(times(self.g, &v));
        self.basis.push(v);
        self.stiff.push(kv);
    }

    /// G as the basis sees it.
    fn projected(&self) -> DMatrix<f64> {
        let n = self.basis.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| dot(&self.basis[i], &self.pushed[j]));
        0.5 * (&matrix + matrix.transpose())
    }

    /// λ of the basis, those above 0, ascending (Rayleigh and Ritz).
    fn ritz(&self) -> Vec<f64> {
        let all = self.projected().symmetric_eigenvalues();
        above_nothing(all.as_slice())
    }

    /// Whether K − σ G has as many negative eigenvalues as were found below σ.
    fn is_whole(&self, found: &[f64], count: usize, job: &Job) -> bool {
        // σ lies in the first gap after what is asked for.
        let gap = |&i: &usize| found[i] > found[i - 1] * (1.0 + 1e-6);
        let Some(below) = (count..found.len()).find(gap) else { return true };
        let mut shifted = self.k.clone();
        shifted.add(-0.5 * (found[below - 1] + found[below]), self.g);
        let unknowns = self.k.unknowns();
        let (rhs, none) = (start(unknowns, 0), Constraints::new(unknowns));
        match solve(&shifted, &rhs, &none, Method::Direct, 1e-3, job) {
            Ok(solution) => solution.negative_eigenvalues == below,
            // Too near to an eigenvalue to say.
            Err(_) => true,
        }
    }
}

/// λ of 1/λ, those above 0, ascending.
fn above_nothing(inverse: &[f64]) -> Vec<f64> {
    let largest = inverse.iter().fold(0.0, |a: f64, b| a.max(*b));
    let above = inverse.iter().filter(|m| **m > 1e-12 * largest);
    let mut found: Vec<f64> = above.map(|m| 1.0 / m).collect();
    found.sort_unstable_by(f64::total_cmp);
    found
}

/// So many of them.
fn first(mut values: Vec<f64>, count: usize) -> Vec<f64> {
    values.truncate(count);
    values
}

/// A vector without symmetries: Weyl's sequence of the golden ratio.
fn start(unknowns: usize, number: usize) -> Vec<f64> {
    let golden = 0.618_033_988_749_894_9;
    let value = |i: usize| ((i * (2 * number + 1) + number) as f64 * golden).fract() - 0.5;
    (1..=unknowns).map(value).collect()
}

fn times(matrix: &BlockMatrix<1>, v: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; v.len()];
    matrix.multiply(v, &mut result);
    result
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
