//! Damage is a perturbation of the kernel: one interface for what damage does to readings, whatever
//! the physics.
//!
//! A damage changes the kernel by δK, the source by δσ and the response by δg. To first order
//!
//! ```text
//! δI = ⟨Φ*, δK Φ + δσ⟩ + ⟨δg, Φ⟩
//! ```
//!
//! with Φ and Φ* of the structure as it is: one primal and one dual solution tell what every damage
//! does to every reading. Where the solutions are matrices' (mechanics), they are multiplied; where
//! they are walks (light, X-rays), every walk has both: [`SensitivityTally`].

mod ledger;

pub use ledger::{Change, SensitivityTally, differentiate, severity};

/// What damages do to readings, to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensitivities {
    /// I, one a reading.
    pub readings: Vec<f64>,
    /// ∂I/∂d, by reading and damage.
    pub by_damage: Vec<Vec<f64>>,
    /// Standard errors of the readings; 0 where chance has no part in them.
    pub reading_errors: Vec<f64>,
    /// Standard errors of ∂I/∂d.
    pub errors: Vec<Vec<f64>>,
}

impl Sensitivities {
    /// Without chance.
    #[must_use]
    pub fn exact(readings: Vec<f64>, by_damage: Vec<Vec<f64>>) -> Self {
        let errors = by_damage.iter().map(|row| vec![0.0; row.len()]).collect();
        Self { reading_errors: vec![0.0; readings.len()], errors, readings, by_damage }
    }

    /// Takes further readings of the same damages.
    pub fn extend(&mut self, more: Self) {
        self.readings.extend(more.readings);
        self.by_damage.extend(more.by_damage);
        self.reading_errors.extend(more.reading_errors);
        self.errors.extend(more.errors);
    }

    /// Those of readings that are sums of two, with independent errors.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        let join =
            |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a = a.hypot(*b));
        add(&mut self.readings, &other.readings);
        join(&mut self.reading_errors, &other.reading_errors);
        self.by_damage.iter_mut().zip(&other.by_damage).for_each(|(a, b)| add(a, b));
        self.errors.iter_mut().zip(&other.errors).for_each(|(a, b)| join(a, b));
        self
    }
}

/// A transport problem whose kernel damages perturb, each by a number: softening of an element, air
/// in a voxel, a stain on a patch.
pub trait Perturbed {
    /// Why there is no answer.
    type Error;

    /// How many damages there are.
    fn damages(&self) -> usize;

    /// I(d), by a full primal solution of the damaged problem.
    ///
    /// # Errors
    /// The problem's own.
    fn readings(&mut self, damage: &[f64]) -> Result<Vec<f64>, Self::Error>;

    /// I(d) and ∂I/∂d by primal and dual solutions at `damage`.
    ///
    /// # Errors
    /// The problem's own.
    fn sensitivities(&mut self, damage: &[f64]) -> Result<Sensitivities, Self::Error>;
}

/// How exact first order is, for each reading: the remainder I(d + δv) − I(d) − δ ∂I/∂d·v at δ and
/// at δ/2, by full solutions. The second is a quarter of the first where sensitivities are right.
/// Walks must be the same in all three solutions (they are, of one seed), or their noise is the
/// remainder.
///
/// # Errors
/// The problem's own.
pub fn remainders<P: Perturbed>(
    problem: &mut P,
    at: &[f64],
    towards: &[f64],
    delta: f64,
) -> Result<Vec<[f64; 2]>, P::Error> {
    let known = problem.sensitivities(at)?;
    let slopes: Vec<f64> = known
        .by_damage
        .iter()
        .map(|row| row.iter().zip(towards).map(|(j, v)| j * v).sum())
        .collect();
    let mut errors = vec![[0.0; 2]; slopes.len()];
    for (k, delta) in [delta, 0.5 * delta].into_iter().enumerate() {
        let there: Vec<f64> = at.iter().zip(towards).map(|(d, v)| d + delta * v).collect();
        let found = problem.readings(&there)?;
        for (i, error) in errors.iter_mut().enumerate() {
            error[k] = found[i] - known.readings[i] - delta * slopes[i];
        }
    }
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two states, of which damages change a row of the kernel, the source, and the response.
    struct Two;

    impl Two {
        fn parts(d: &[f64]) -> ([[f64; 2]; 2], [f64; 2], [f64; 2]) {
            (
                [[0.3 * (1.0 - d[0]), 0.4 * (1.0 - d[0])], [0.2, 0.1]],
                [1.0, 0.5 * (1.0 - d[1])],
                [0.7, 0.2 * (1.0 - d[2])],
            )
        }

        /// (1 − K) x = b.
        fn solve(k: [[f64; 2]; 2], b: [f64; 2]) -> [f64; 2] {
            let a = [[1.0 - k[0][0], -k[0][1]], [-k[1][0], 1.0 - k[1][1]]];
            let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
            [(b[0] * a[1][1] - a[0][1] * b[1]) / det, (a[0][0] * b[1] - a[1][0] * b[0]) / det]
        }
    }

    impl Perturbed for Two {
        type Error = std::convert::Infallible;

        fn damages(&self) -> usize {
            3
        }

        fn readings(&mut self, d: &[f64]) -> Result<Vec<f64>, Self::Error> {
            let (k, source, response) = Self::parts(d);
            let field = Self::solve(k, source);
            Ok(vec![response[0] * field[0] + response[1] * field[1]])
        }

        fn sensitivities(&mut self, d: &[f64]) -> Result<Sensitivities, Self::Error> {
            let (k, source, response) = Self::parts(d);
            let field = Self::solve(k, source);
            let importance = Self::solve([[k[0][0], k[1][0]], [k[0][1], k[1][1]]], response);
            let row = [
                -importance[0] * (0.3 * field[0] + 0.4 * field[1]),
                -0.5 * importance[1],
                -0.2 * field[1],
            ];
            Ok(Sensitivities::exact(self.readings(d)?, vec![row.to_vec()]))
        }
    }

    #[test]
    fn first_order_of_kernel_source_and_response() {
        for towards in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.3], [0.5, 0.7, 0.2]] {
            let [[large, small]] =
                remainders(&mut Two, &[0.1, 0.2, 0.05], &towards, 0.01).unwrap()[..]
            else {
                panic!("one reading")
            };
            // Source and response alone are bilinear: with both, second order; the first direction
            // curves by the kernel.
            assert!((large / small - 4.0).abs() < 0.05, "{towards:?}: {large:e} {small:e}");
        }
    }
}
