//! Acceleration of a fixed-point iteration x ← x + f(x) (Anderson 1965; Walker and Ni 2011): the
//! next step is the one that would have been best for a linear f with the last steps as its
//! samples. Newton with secant stiffness, which damage needs, gains most of what a consistent
//! tangent would bring, and keeps matrices symmetric and positive.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

/// How many steps are remembered.
const DEPTH: usize = 6;
/// Singular values below this share of the largest are noise.
const NOISE: f64 = 1e-10;

/// The last steps of an iteration.
#[derive(Debug, Default)]
pub(super) struct Anderson {
    last: Option<(Vec<f64>, Vec<f64>)>,
    /// (Δx, Δf).
    changes: VecDeque<(Vec<f64>, Vec<f64>)>,
}

impl Anderson {
    /// Forgets all.
    pub(super) fn restart(&mut self) {
        *self = Self::default();
    }

    /// Takes a step f at x and answers a better one. Anything that all steps keep (an affine
    /// constraint) the better one keeps too.
    pub(super) fn improve(&mut self, x: &[f64], f: Vec<f64>) -> Vec<f64> {
        if let Some((x0, f0)) = self.last.take() {
            let minus =
                |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
            self.changes.push_back((minus(x, &x0), minus(&f, &f0)));
            if self.changes.len() > DEPTH {
                self.changes.pop_front();
            }
        }
        self.last = Some((x.to_vec(), f.clone()));
        let n = self.changes.len();
        if n == 0 {
            return f;
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let gram = DMatrix::from_fn(n, n, |i, j| dot(&self.changes[i].1, &self.changes[j].1));
        let along = DVector::from_fn(n, |i, _| dot(&self.changes[i].1, &f));
        let svd = gram.svd(true, true);
        let cut = NOISE * svd.singular_values.iter().fold(0.0, |m: f64, s| m.max(*s));
        let Ok(weights) = svd.solve(&along, cut) else { return f };
        let mut step = f;
        for ((dx, df), w) in self.changes.iter().zip(weights.iter()) {
            step.iter_mut().zip(dx.iter().zip(df)).for_each(|(s, (dx, df))| *s -= w * (dx + df));
        }
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear map in three dimensions that converges by a factor .9 alone is solved in a handful
    /// of steps.
    #[test]
    fn a_linear_iteration_ends_early() {
        let (rates, target) = ([0.9, 0.5, -0.7], [1.0, 2.0, 3.0]);
        let step =
            |x: &[f64]| (0..3).map(|i| (rates[i] - 1.0) * (x[i] - target[i])).collect::<Vec<_>>();
        let mut anderson = Anderson::default();
        let mut x = vec![0.0; 3];
        for _ in 0..5 {
            let better = anderson.improve(&x, step(&x));
            x.iter_mut().zip(better).for_each(|(x, s)| *x += s);
        }
        assert!(x.iter().zip(target).all(|(x, t)| (x - t).abs() < 1e-6), "{x:?}");
    }
}
