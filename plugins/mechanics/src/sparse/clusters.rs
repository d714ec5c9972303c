//! The diagonal that smoothing divides by. Where a stiff part of low rank passes through something
//! soft (a tendon through damaged concrete, a thin layer across its thickness), a node's own block
//! is nearly all that stiff part, and the soft motions of its neighbours against each other would
//! be smoothed as slowly as the stiff is stiff. Such nodes are inverted together.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::{
    block::{Block, apply, product, square},
    krylov::{Operator, Precondition},
};

/// Nodes belong together if ‖A_ij‖ > TIGHT √(‖A_ii‖ ‖A_jj‖): 1 is a pair that can only move
/// together, a chain of equal springs has 1/2, cubes of one material have less than 0.2.
const TIGHT: f64 = 0.65;
/// Nodes of a cluster.
const MOST: usize = 16;
/// Rows at a time.
const ROWS: usize = 1 << 10;

/// D⁻¹ with dense blocks for clusters, in block rows.
pub(super) struct Clusters<const B: usize> {
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<Block<B, B>>,
}

impl<const B: usize> Clusters<B> {
    /// Finds the clusters; `inverse` has the inverse of every node's own block.
    pub(super) fn new(operator: Operator<B>, inverse: &[Block<B, B>]) -> Self {
        let groups = groups(operator);
        let dense: Vec<Option<DMatrix<f64>>> =
            groups.par_iter().map(|nodes| inverse_of(operator, nodes)).collect();
        let mut of = vec![(u32::MAX, 0_u32); inverse.len()];
        for (g, nodes) in groups.iter().enumerate().filter(|(g, _)| dense[*g].is_some()) {
            nodes.iter().enumerate().for_each(|(a, &i)| of[i] = (g as u32, a as u32));
        }
        let (mut starts, mut columns, mut values) =
            (vec![0], Vec::with_capacity(inverse.len()), Vec::with_capacity(inverse.len()));
        for (i, own) in inverse.iter().enumerate() {
            let (g, a) = (of[i].0 as usize, of[i].1 as usize);
            match dense.get(g) {
                Some(Some(d)) => {
                    for (b, &j) in groups[g].iter().enumerate() {
                        columns.push(j as u32);
                        values.push(std::array::from_fn(|r| {
                            std::array::from_fn(|c| d[(a * B + r, b * B + c)])
                        }));
                    }
                }
                _ => {
                    columns.push(i as u32);
                    values.push(*own);
                }
            }
            starts.push(columns.len() as u32);
        }
        Self { starts, columns, values }
    }

    /// Columns and blocks of a row.
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, &Block<B, B>)> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.columns[range.clone()].iter().map(|&j| j as usize).zip(&self.values[range])
    }

    /// Calls `then((D⁻¹ r)ᵢ, &mut dᵢ, &mut zᵢ)` for each node.
    pub(super) fn by_rows(
        &self,
        r: &[f64],
        d: &mut [f64],
        z: &mut [f64],
        then: impl Fn([f64; B], &mut [f64; B], &mut [f64; B]) + Sync,
    ) {
        let r = r.as_chunks::<B>().0;
        let (d, z) = (
            d.as_chunks_mut::<B>().0.par_chunks_mut(ROWS),
            z.as_chunks_mut::<B>().0.par_chunks_mut(ROWS),
        );
        d.zip(z).enumerate().for_each(|(c, (d, z))| {
            for (i, (d, z)) in d.iter_mut().zip(z).enumerate() {
                let mut sum = [0.0; B];
                for (j, block) in self.row(c * ROWS + i) {
                    let part = apply(block, &r[j]);
                    sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
                }
                then(sum, d, z);
            }
        });
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.starts[..])
            + size_of_val(&self.columns[..])
            + size_of_val(&self.values[..])
    }
}

impl<const B: usize> Precondition<B> for Clusters<B> {
    fn apply(&self, _: Operator<B>, r: &[f64], z: &mut [f64]) -> Result<(), super::SolveError> {
        let r = r.as_chunks::<B>().0;
        z.as_chunks_mut::<B>().0.par_chunks_mut(ROWS).enumerate().for_each(|(c, z)| {
            for (i, z) in z.iter_mut().enumerate() {
                *z = [0.0; B];
                for (j, block) in self.row(c * ROWS + i) {
                    let part = apply(block, &r[j]);
                    z.iter_mut().zip(part).for_each(|(z, p)| *z += p);
                }
            }
        });
        Ok(())
    }
}

/// Nodes that are tightly joined, at most [`MOST`] together, each node in one group; single nodes
/// are in none.
fn groups<const B: usize>(operator: Operator<B>) -> Vec<Vec<usize>> {
    let (matrix, mask) = (operator.matrix, operator.mask);
    let diagonal: Vec<f64> =
        (0..matrix.nodes()).into_par_iter().map(|i| square(matrix.diagonal(i))).collect();
    let tight = |i: usize, j: usize, s: f64| {
        i != j && s * s > TIGHT * TIGHT * TIGHT * TIGHT * diagonal[i] * diagonal[j]
    };
    let partners = |i: usize| {
        matrix.row_blocks(i).filter(move |(j, b)| tight(i, *j, square(b))).map(|(j, _)| j)
    };
    let tied: Vec<bool> = (0..matrix.nodes())
        .into_par_iter()
        .map(|i| !mask.is_fixed(i) && partners(i).next().is_some())
        .collect();
    let mut taken = vec![false; matrix.nodes()];
    let mut groups = Vec::new();
    for start in 0..matrix.nodes() {
        if !tied[start] || taken[start] {
            continue;
        }
        taken[start] = true;
        let mut group = vec![start];
        let mut next = 0;
        while next < group.len() {
            for j in partners(group[next]) {
                if group.len() < MOST && tied[j] && !taken[j] {
                    taken[j] = true;
                    group.push(j);
                }
            }
            next += 1;
        }
        if group.len() > 1 {
            group.sort_unstable();
            groups.push(group);
        }
    }
    groups
}

/// The inverse of the part of P A P + d (1 − P) that joins these nodes; `None` if it is not
/// positive definite.
fn inverse_of<const B: usize>(operator: Operator<B>, nodes: &[usize]) -> Option<DMatrix<f64>> {
    let mut dense = DMatrix::zeros(nodes.len() * B, nodes.len() * B);
    for (a, &i) in nodes.iter().enumerate() {
        for (j, block) in operator.matrix.row_blocks(i) {
            let Ok(b) = nodes.binary_search(&j) else { continue };
            let block = if i == j {
                operator.mask.diagonal(operator.matrix, i)
            } else {
                let left = operator.mask.at(i).map_or(*block, |p| product(p, block));
                operator.mask.at(j).map_or(left, |p| product(&left, p))
            };
            for r in 0..B {
                for c in 0..B {
                    dense[(a * B + r, b * B + c)] = block[r][c];
                }
            }
        }
    }
    dense.cholesky().map(|factor| factor.inverse())
}
