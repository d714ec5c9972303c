//! From coarse to fine and back: P = (1 − ω D⁻¹ A) T. T reproduces the rigid motions within each
//! group of nodes, the step of damped Jacobi smooths its jumps between groups.

use rayon::prelude::*;

use super::{
    aggregate::{Aggregates, NONE},
    block::{Block, add_product, product},
    clusters::Clusters,
    krylov::Operator,
};

/// A sparse matrix of B × K blocks with the list of its entries by column.
pub(super) struct Prolongation<const B: usize, const K: usize> {
    pub(super) starts: Vec<usize>,
    pub(super) columns: Vec<u32>,
    pub(super) values: Vec<Block<B, K>>,
    /// For each column, where its entries are.
    back_starts: Vec<usize>,
    back: Vec<(u32, u32)>,
}

/// The orthonormal rigid motions of each group, one block for each node, and the modes of the
/// coarse level in them.
pub(super) struct Tentative<const B: usize, const K: usize> {
    pub(super) values: Vec<Block<B, K>>,
    pub(super) coarse_modes: Vec<Block<K, K>>,
}

/// A column that loses more than this of its length to those before is a combination of them.
const DEPENDENT: f64 = 1e-7;
/// Rows at a time.
const ROWS: usize = 1 << 10;

impl<const B: usize, const K: usize> Tentative<B, K> {
    /// Orthonormalises the modes within each group (Gram and Schmidt, twice).
    pub(super) fn new(groups: &Aggregates, modes: &[Block<B, K>]) -> Self {
        let members = members(groups);
        let parts: Vec<(Vec<Block<B, K>>, Block<K, K>)> = members
            .par_iter()
            .map(|list| {
                let mut q: Vec<Block<B, K>> = list.iter().map(|&i| modes[i as usize]).collect();
                let r = orthonormalise(&mut q);
                (q, r)
            })
            .collect();
        let mut values = vec![[[0.0; K]; B]; modes.len()];
        let mut coarse_modes = Vec::with_capacity(parts.len());
        for (list, (q, r)) in members.iter().zip(parts) {
            list.iter().zip(q).for_each(|(&i, q)| values[i as usize] = q);
            coarse_modes.push(r);
        }
        Self { values, coarse_modes }
    }
}

/// The nodes of each group, ascending.
fn members(groups: &Aggregates) -> Vec<Vec<u32>> {
    let mut members = vec![Vec::new(); groups.count];
    for (i, &g) in groups.of.iter().enumerate() {
        if g != NONE {
            members[g as usize].push(i as u32);
        }
    }
    members
}

/// Q R = the stacked blocks; a dependent column becomes nought.
fn orthonormalise<const B: usize, const K: usize>(q: &mut [Block<B, K>]) -> Block<K, K> {
    let dot = |q: &[Block<B, K>], a: usize, b: usize| {
        q.iter().flatten().map(|row| row[a] * row[b]).sum::<f64>()
    };
    let mut r = [[0.0; K]; K];
    for k in 0..K {
        let before = dot(q, k, k).sqrt();
        for _ in 0..2 {
            for j in 0..k {
                let share = dot(q, j, k);
                r[j][k] += share;
                q.iter_mut().flatten().for_each(|row| row[k] -= share * row[j]);
            }
        }
        let length = dot(q, k, k).sqrt();
        if length > DEPENDENT * before {
            r[k][k] = length;
            q.iter_mut().flatten().for_each(|row| row[k] /= length);
        } else {
            q.iter_mut().flatten().for_each(|row| row[k] = 0.0);
        }
    }
    r
}

impl<const B: usize, const K: usize> Prolongation<B, K> {
    /// Smooths T by one step of Jacobi with the weight ω.
    pub(super) fn smoothed(
        operator: Operator<B>,
        inverse: &Clusters<B>,
        groups: &Aggregates,
        tentative: &Tentative<B, K>,
        omega: f64,
    ) -> Self {
        let nodes = operator.matrix.nodes();
        // P A T, then D⁻¹ of it: a cluster needs the rows of all its nodes.
        let at = rows_in_chunks(nodes, |i, columns, values| {
            let first = columns.len();
            for (j, block) in operator.matrix.row_blocks(i).filter(|(j, _)| groups.of[*j] != NONE) {
                let at = entry(first, groups.of[j], columns, values);
                add_product(1.0, block, &tentative.values[j], &mut values[at]);
            }
            if let Some(p) = operator.mask.at(i) {
                values[first..].iter_mut().for_each(|value| *value = product(p, value));
            }
        });
        let row = |i: usize, columns: &mut Vec<u32>, values: &mut Vec<Block<B, K>>| {
            let first = columns.len();
            for (j, block) in inverse.row(i) {
                for (column, right) in row_of(&at, j) {
                    let at = entry(first, column as u32, columns, values);
                    add_product(-omega, block, right, &mut values[at]);
                }
            }
            if groups.of[i] != NONE {
                let at = entry(first, groups.of[i], columns, values);
                for (to, from) in
                    values[at].iter_mut().flatten().zip(tentative.values[i].iter().flatten())
                {
                    *to += from;
                }
            }
        };
        let parts = rows_in_chunks(nodes, row);
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        values.reserve_exact(parts.iter().map(|p| p.columns.len()).sum());
        for part in parts {
            let first = columns.len();
            starts.extend(part.starts[1..].iter().map(|s| first + *s as usize));
            columns.extend_from_slice(&part.columns);
            values.extend_from_slice(&part.values);
        }
        let (back_starts, back) = transposed(&starts, &columns, groups.count);
        Self { starts, columns, values, back_starts, back }
    }

    /// Number of coarse nodes.
    pub(super) fn coarse_nodes(&self) -> usize {
        self.back_starts.len() - 1
    }

    /// Fine node and index of the block, for each entry of a column.
    pub(super) fn column(&self, group: usize) -> impl Iterator<Item = (usize, usize)> {
        self.back[self.back_starts[group]..self.back_starts[group + 1]]
            .iter()
            .map(|&(row, entry)| (row as usize, entry as usize))
    }

    /// Columns and blocks of a row.
    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (usize, &Block<B, K>)> {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].iter().map(|&j| j as usize).zip(&self.values[range])
    }

    /// Pᵀ r
    pub(super) fn restrict(&self, r: &[f64]) -> Vec<f64> {
        let r = r.as_chunks::<B>().0;
        let mut coarse = vec![0.0; self.coarse_nodes() * K];
        coarse.as_chunks_mut::<K>().0.par_chunks_mut(64).enumerate().for_each(|(c, rows)| {
            for (g, to) in rows.iter_mut().enumerate() {
                for (i, entry) in self.column(64 * c + g) {
                    let block = &self.values[entry];
                    for b in 0..B {
                        for k in 0..K {
                            to[k] += block[b][k] * r[i][b];
                        }
                    }
                }
            }
        });
        coarse
    }

    /// z ← z + P c
    pub(super) fn add_prolonged(&self, coarse: &[f64], z: &mut [f64]) {
        let coarse = coarse.as_chunks::<K>().0;
        z.as_chunks_mut::<B>().0.par_chunks_mut(ROWS).enumerate().for_each(|(c, rows)| {
            for (i, z) in rows.iter_mut().enumerate() {
                for (j, block) in self.row(ROWS * c + i) {
                    for b in 0..B {
                        z[b] += (0..K).map(|k| block[b][k] * coarse[j][k]).sum::<f64>();
                    }
                }
            }
        });
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.values[..])
            + size_of_val(&self.back[..])
            + size_of_val(&self.columns[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.back_starts[..])
    }
}

/// Where the entry of `column` is in the row that begins at `first`; a new one is zero.
pub(super) fn entry<const B: usize, const K: usize>(
    first: usize,
    column: u32,
    columns: &mut Vec<u32>,
    values: &mut Vec<Block<B, K>>,
) -> usize {
    let at = columns[first..].iter().position(|&c| c == column);
    first
        + at.unwrap_or_else(|| {
            columns.push(column);
            values.push([[0.0; K]; B]);
            columns.len() - 1 - first
        })
}

/// Some rows of a sparse matrix of blocks.
pub(super) struct Rows<const B: usize, const K: usize> {
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<Block<B, K>>,
}

/// Makes rows in parallel: `row(i, columns, values)` appends to both.
pub(super) fn rows_in_chunks<const B: usize, const K: usize>(
    nodes: usize,
    row: impl Fn(usize, &mut Vec<u32>, &mut Vec<Block<B, K>>) + Sync,
) -> Vec<Rows<B, K>> {
    let chunk = |c: usize| {
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for i in c * ROWS..((c + 1) * ROWS).min(nodes) {
            row(i, &mut columns, &mut values);
            starts.push(columns.len() as u32);
        }
        values.shrink_to_fit();
        Rows { starts, columns, values }
    };
    (0..nodes.div_ceil(ROWS)).into_par_iter().map(chunk).collect()
}

/// Columns and blocks of row `i` of what [`rows_in_chunks`] made.
pub(super) fn row_of<const B: usize, const K: usize>(
    rows: &[Rows<B, K>],
    i: usize,
) -> impl Iterator<Item = (usize, &Block<B, K>)> {
    let (part, i) = (&rows[i / ROWS], i % ROWS);
    let range = part.starts[i] as usize..part.starts[i + 1] as usize;
    part.columns[range.clone()].iter().map(|&j| j as usize).zip(&part.values[range])
}

/// The entries of each column: (row, index of the entry), rows ascending.
fn transposed(starts: &[usize], columns: &[u32], count: usize) -> (Vec<usize>, Vec<(u32, u32)>) {
    let mut ends = vec![0; count + 1];
    columns.iter().for_each(|&c| ends[c as usize + 1] += 1);
    for c in 0..count {
        ends[c + 1] += ends[c];
    }
    let mut next = ends.clone();
    let mut back = vec![(0, 0); columns.len()];
    for (i, range) in starts.windows(2).enumerate() {
        for entry in range[0]..range[1] {
            let at = &mut next[columns[entry] as usize];
            back[*at] = (i as u32, entry as u32);
            *at += 1;
        }
    }
    (ends, back)
}
