//! Symmetric sparse equations K u = f with B unknowns a node, and what solves them. No word about
//! elements: B = 3 for displacements (and, in shells, rotations), B = 1 for temperature and for
//! gradient damage.
//!
//! | method | what | where it pays |
//! |---|---|---|
//! | [`Method::Direct`] | Cholesky by `faer` on a nested-dissection ordering of our own; LBLᵀ where the matrix is indefinite | small systems, many right-hand sides, snap-back |
//! | [`Method::Multigrid`] | conjugate gradients with smoothed aggregation on the rigid-body modes | large systems: iterations do not grow with the mesh |
//! | [`Method::Once`] | the one of both that costs less | decks |
//! | [`Method::Jacobi`] | conjugate gradients with the inverse blocks of the diagonal | a check of the others |
//!
//! ```
//! # use intrados_mechanics::sparse::*;
//! # use intrados_stage::Job;
//! // Three springs of 2 N/m in a row, the first node held, 1 N pulls the last.
//! let places: Vec<_> = (0..4).map(|i| Place::point([f64::from(i), 0.0, 0.0])).collect();
//! let springs: Connectivity = [[0, 1], [1, 2], [2, 3]].into_iter().collect();
//! let mut matrix = BlockMatrix::<1>::zeros(Pattern::new(places, &springs)?.into());
//! matrix.assemble(&springs, &Job::default(), |_, k| Ok::<_, SolveError>(k.copy_from_slice(&[2.0, -2.0, -2.0, 2.0])))?;
//! let mut constraints = Constraints::new(4);
//! constraints.fix(0, 0, 0.0)?;
//! let solution = solve(&matrix, &[0.0, 0.0, 0.0, 1.0], &constraints, Method::Auto, 1e-10, &Job::default())?;
//! assert!((solution.x[3] - 1.5).abs() < 1e-9);
//! # Ok::<(), SolveError>(())
//! ```
//!
//! Same bits for any number of threads: rows are summed in the order of their columns, entries in
//! the order of the elements, scalar products over chunks of fixed size.

mod aggregate;
mod assemble;
mod block;
mod body;
mod clusters;
mod constraint;
mod direct;
mod error;
mod krylov;
mod matrix;
mod multigrid;
mod order;
mod pattern;
mod prolong;
mod solver;
mod vector;

pub(crate) use assemble::assemble_vector;
pub use constraint::Constraints;
pub use error::SolveError;
pub use matrix::BlockMatrix;
pub use pattern::{Connectivity, Kind, Pattern, Place};
pub use solver::{Method, Solution, Solver, solve};

#[cfg(test)]
#[allow(dead_code, reason = "tests and benches take different parts")]
#[path = "../../benches/brick/mod.rs"]
mod brick;
#[cfg(test)]
mod tests;
