//! Prescribed unknowns. With P the projector onto what is free at each node, u = u_c + P z and P K
//! P z = P (f − K u_c): symmetric elimination without touching the matrix, in any direction.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{
    BlockMatrix, SolveError,
    block::{Block, apply, identity, inverse, mean_diagonal, product},
};

/// Directions at one node, orthonormal, with the value along each.
#[derive(Debug, Clone, PartialEq)]
struct Hold<const B: usize> {
    held: Vec<([f64; B], f64)>,
}

/// Unknowns with prescribed values.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraints<const B: usize> {
    nodes: usize,
    holds: BTreeMap<u32, Hold<B>>,
}

impl<const B: usize> Constraints<B> {
    /// None yet, for a matrix of this many nodes.
    pub fn new(nodes: usize) -> Self {
        Self { nodes, holds: BTreeMap::new() }
    }

    /// Prescribes one component of a node.
    ///
    /// # Errors
    /// [`SolveError::NoSuchNode`] (also for a component beyond B), [`SolveError::NotFinite`], or
    /// [`SolveError::Contradiction`].
    pub fn fix(&mut self, node: usize, component: usize, value: f64) -> Result<(), SolveError> {
        if component >= B {
            return Err(SolveError::Length {
                what: "component of a constraint",
                found: component,
                expected: B,
            });
        }
        self.fix_along(node, std::array::from_fn(|i| if i == component { 1.0 } else { 0.0 }), value)
    }

    /// Prescribes all components of a node.
    ///
    /// # Errors
    /// As [`Constraints::fix`].
    pub fn fix_all(&mut self, node: usize, values: [f64; B]) -> Result<(), SolveError> {
        values.into_iter().enumerate().try_for_each(|(c, v)| self.fix(node, c, v))
    }

    /// Prescribes n·u = value for a direction n of any length: a roller on a skew plane.
    ///
    /// # Errors
    /// As [`Constraints::fix`].
    pub(crate) fn fix_along(
        &mut self,
        node: usize,
        direction: [f64; B],
        value: f64,
    ) -> Result<(), SolveError> {
        if node >= self.nodes {
            return Err(SolveError::NoSuchNode {
                element: self.holds.len(),
                node,
                nodes: self.nodes,
            });
        }
        let length = dot(&direction, &direction).sqrt();
        if !(value.is_finite() && length.is_finite() && length > 0.0) {
            return Err(SolveError::NotFinite { what: "prescribed value", node });
        }
        let hold = self.holds.entry(node as u32).or_insert(Hold { held: Vec::new() });
        // What the directions held before leave of this one (Gram and Schmidt).
        let (mut n, mut v) = (direction.map(|x| x / length), value / length);
        for (q, w) in &hold.held {
            let share = dot(&n, q);
            n = std::array::from_fn(|i| n[i] - share * q[i]);
            v -= share * w;
        }
        let rest = dot(&n, &n).sqrt();
        if rest > 1e-9 {
            hold.held.push((n.map(|x| x / rest), v / rest));
        } else {
            let (asked, largest) = (
                value / length,
                hold.held.iter().fold(value / length, |m: f64, (_, w)| m.abs().max(w.abs())),
            );
            if v.abs() > 1e-9 * largest.abs() {
                return Err(SolveError::Contradiction { node, first: asked - v, second: asked });
            }
        }
        Ok(())
    }

    /// Number of nodes of the matrix that it belongs to.
    pub(super) fn nodes(&self) -> usize {
        self.nodes
    }

    /// The vector with the prescribed values, nought elsewhere.
    pub(super) fn values(&self) -> Vec<f64> {
        let mut u = vec![0.0; self.nodes * B];
        let blocks = u.as_chunks_mut::<B>().0;
        for (&node, hold) in &self.holds {
            for (q, v) in &hold.held {
                blocks[node as usize].iter_mut().zip(q).for_each(|(u, q)| *u += v * q);
            }
        }
        u
    }

    /// Every held direction with its node.
    pub(super) fn directions(&self) -> impl Iterator<Item = (usize, &[f64; B])> {
        self.holds
            .iter()
            .flat_map(|(&node, hold)| hold.held.iter().map(move |(q, _)| (node as usize, q)))
    }
}

/// What the constraints leave free: a projector for each node that is held somehow.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mask<const B: usize> {
    /// Ascending by node.
    held: Vec<(u32, Block<B, B>)>,
    /// Nodes without any stiffness, ascending: they rest, and may carry no load.
    idle: Vec<u32>,
}

impl<const B: usize> Mask<B> {
    /// Everything is free.
    pub(super) fn free() -> Self {
        Self { held: Vec::new(), idle: Vec::new() }
    }

    /// Free is what the constraints leave; nodes without any stiffness rest too.
    pub(super) fn new(constraints: &Constraints<B>, matrix: &BlockMatrix<B>) -> Self {
        let zero: Vec<bool> =
            (0..matrix.nodes()).into_par_iter().map(|i| matrix.is_zero_row(i)).collect();
        let idle: Vec<u32> =
            zero.iter().enumerate().filter_map(|(i, zero)| zero.then_some(i as u32)).collect();
        let mut held: BTreeMap<u32, Block<B, B>> = BTreeMap::new();
        for (node, q) in constraints.directions() {
            let p = held.entry(node as u32).or_insert_with(identity);
            for i in 0..B {
                for j in 0..B {
                    p[i][j] -= q[i] * q[j];
                }
            }
        }
        held.extend(idle.iter().map(|&node| (node, [[0.0; B]; B])));
        // Projectors along the axes are zeros and ones exactly.
        let exact = |v: f64| if v.abs() < 1e-14 { 0.0 } else { v };
        Self {
            held: held.into_iter().map(|(node, p)| (node, p.map(|row| row.map(exact)))).collect(),
            idle,
        }
    }

    /// A node that carries a load but has no stiffness at all.
    pub(super) fn loaded_void(&self, rhs: &[f64]) -> Option<usize> {
        let rhs = rhs.as_chunks::<B>().0;
        self.idle.iter().map(|&i| i as usize).find(|&i| rhs[i] != [0.0; B])
    }

    /// x ← P x
    pub(super) fn project(&self, x: &mut [f64]) {
        let x = x.as_chunks_mut::<B>().0;
        for (node, p) in &self.held {
            let x = &mut x[*node as usize];
            *x = apply(p, x);
        }
    }

    /// The projector of node `i`, unless it is free.
    pub(super) fn at(&self, i: usize) -> Option<&Block<B, B>> {
        self.held.binary_search_by_key(&(i as u32), |h| h.0).ok().map(|at| &self.held[at].1)
    }

    /// Nodes of which nothing is free.
    pub(super) fn is_fixed(&self, i: usize) -> bool {
        self.at(i).is_some_and(|p| p.iter().flatten().all(|&v| v == 0.0))
    }

    /// The diagonal block P D P + d (1 − P): the held directions get the mean stiffness of the node
    /// (1 where it has none), so that the inverse maps free to free.
    pub(super) fn diagonal(&self, matrix: &BlockMatrix<B>, i: usize) -> Block<B, B> {
        let d = matrix.diagonal(i);
        let Some(p) = self.at(i) else { return *d };
        let mean = mean_diagonal(d);
        let mean = if mean > 0.0 { mean } else { 1.0 };
        let inner = product(&product(p, d), p);
        std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                inner[r][c] + mean * ((if r == c { 1.0 } else { 0.0 }) - p[r][c])
            })
        })
    }

    /// The inverses of all diagonal blocks.
    ///
    /// # Errors
    /// [`SolveError::NoStiffness`] or [`SolveError::Indefinite`] for the first node whose block is
    /// not positive definite.
    pub(super) fn inverse_diagonal(
        &self,
        matrix: &BlockMatrix<B>,
    ) -> Result<Vec<Block<B, B>>, SolveError> {
        let rows = (0..matrix.nodes()).into_par_iter();
        let all: Vec<_> = rows.map(|i| inverse(&self.diagonal(matrix, i))).collect();
        match all.iter().position(Option::is_none) {
            None => Ok(all.into_iter().flatten().collect()),
            Some(node) if (0..B).any(|c| self.diagonal(matrix, node)[c][c] < 0.0) => {
                Err(SolveError::Indefinite { method: "the diagonal", node })
            }
            Some(node) => Err(SolveError::NoStiffness { node }),
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.held[..])
    }
}

/// a·b
fn dot<const B: usize>(a: &[f64; B], b: &[f64; B]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
