//! The symmetric matrix of B × B blocks, all of them stored, row by row.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Pattern, block, block::Block};

/// A symmetric matrix of B × B blocks. Its pattern stays, its values are cleared and assembled
/// again at every step of Newton.
#[derive(Debug, Clone)]
pub struct BlockMatrix<const B: usize> {
    pub(super) pattern: Arc<Pattern>,
    pub(super) values: Vec<Block<B, B>>,
}

impl<const B: usize> BlockMatrix<B> {
    /// Rows that one task multiplies: some hundred kilobytes of blocks.
    pub(super) const ROWS: usize = if B * B < 2048 { 2048 / (B * B) } else { 1 };

    /// All blocks of the pattern, zero.
    pub fn zeros(pattern: Arc<Pattern>) -> Self {
        let values = vec![[[0.0; B]; B]; pattern.blocks()];
        Self { pattern, values }
    }

    /// The blocks that it has.
    pub(crate) fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.pattern.nodes()
    }

    /// Number of rows: nodes × B.
    pub fn unknowns(&self) -> usize {
        self.nodes() * B
    }

    /// Sets every value to zero; the pattern stays.
    pub(crate) fn clear(&mut self) {
        self.values.par_chunks_mut(1 << 12).for_each(|c| c.fill([[0.0; B]; B]));
    }

    /// Adds `factor` times another matrix of the same pattern.
    ///
    /// # Panics
    /// If it has another number of blocks.
    pub(crate) fn add(&mut self, factor: f64, other: &Self) {
        assert_eq!(self.values.len(), other.values.len());
        let to = self.values.as_flattened_mut().as_flattened_mut();
        let from = other.values.as_flattened().as_flattened();
        to.iter_mut().zip(from).for_each(|(a, b)| *a += factor * b);
    }

    /// So many times as much.
    pub(crate) fn scale(&mut self, factor: f64) {
        let values = self.values.as_flattened_mut().as_flattened_mut();
        values.iter_mut().for_each(|a| *a *= factor);
    }

    /// Sum of the diagonal.
    pub(crate) fn trace(&self) -> f64 {
        let own = |i| self.diagonal(i).iter().enumerate().map(|(r, row)| row[r]).sum::<f64>();
        (0..self.nodes()).map(own).sum()
    }

    /// A spring to the ground: adds `stiffness` to the diagonal at this component of this node.
    ///
    /// # Panics
    /// If there is no such node or component.
    #[cfg(test)]
    pub(crate) fn add_spring(&mut self, node: usize, component: usize, stiffness: f64) {
        let d = self.diagonal_at(node);
        self.values[d][component][component] += stiffness;
    }

    /// The block that joins two nodes; `None` where the pattern has none.
    #[cfg(test)]
    pub(crate) fn block(&self, row: usize, column: usize) -> Option<&[[f64; B]; B]> {
        let at = self.pattern.row(row).binary_search(&(column as u32)).ok()?;
        self.values.get(self.pattern.starts[row] + at)
    }

    /// y = A x
    ///
    /// # Panics
    /// If a length is not [`BlockMatrix::unknowns`].
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        assert_eq!((x.len(), y.len()), (self.unknowns(), self.unknowns()));
        self.by_rows(x, y, |_, ax, y| *y = ax);
    }

    /// Calls `then(i, (A x)ᵢ, &mut yᵢ)` for each node.
    pub(super) fn by_rows(
        &self,
        x: &[f64],
        y: &mut [f64],
        then: impl Fn(usize, [f64; B], &mut [f64; B]) + Sync,
    ) {
        let x = x.as_chunks::<B>().0;
        y.as_chunks_mut::<B>().0.par_chunks_mut(Self::ROWS).enumerate().for_each(|(c, rows)| {
            for (i, y) in rows.iter_mut().enumerate() {
                let i = c * Self::ROWS + i;
                then(i, self.row_times(i, x), y);
            }
        });
    }

    /// (A x)ᵢ. Every product has a sum of its own, so that the processor need not wait for one
    /// addition to begin the next.
    #[inline]
    pub(super) fn row_times(&self, i: usize, x: &[[f64; B]]) -> [f64; B] {
        let mut sums = [[0.0; B]; B];
        for (block, x) in self.row_blocks(i).map(|(j, block)| (block, &x[j])) {
            for r in 0..B {
                for c in 0..B {
                    sums[r][c] += block[r][c] * x[c];
                }
            }
        }
        std::array::from_fn(|r| sums[r].iter().sum())
    }

    /// Columns and blocks of row `i`.
    #[inline]
    pub(super) fn row_blocks(&self, i: usize) -> impl Iterator<Item = (usize, &Block<B, B>)> {
        let range = self.pattern.starts[i]..self.pattern.starts[i + 1];
        self.pattern.columns[range.clone()].iter().map(|&j| j as usize).zip(&self.values[range])
    }

    /// The block on the diagonal of row `i`.
    pub(super) fn diagonal(&self, i: usize) -> &Block<B, B> {
        &self.values[self.diagonal_at(i)]
    }

    /// Index of the block on the diagonal; the pattern has it always.
    fn diagonal_at(&self, i: usize) -> usize {
        let row = self.pattern.row(i);
        self.pattern.starts[i] + row.partition_point(|&j| (j as usize) < i)
    }

    /// The first row with an entry that is not a finite number.
    pub(super) fn not_finite(&self) -> Option<usize> {
        let chunks = self.nodes().div_ceil(Self::ROWS);
        (0..chunks).into_par_iter().find_map_first(|c| {
            let mut rows = c * Self::ROWS..((c + 1) * Self::ROWS).min(self.nodes());
            // A sum is finite only if all its terms are; huge terms of both signs cannot hide,
            // because magnitudes are summed.
            rows.find(|&i| {
                !self
                    .row_blocks(i)
                    .map(|(_, b)| b.iter().flatten().map(|v| v.abs()).sum::<f64>())
                    .sum::<f64>()
                    .is_finite()
            })
        })
    }

    /// Whether row `i` has no entry but zeros.
    pub(super) fn is_zero_row(&self, i: usize) -> bool {
        self.row_blocks(i).all(|(_, b)| block::square(b) == 0.0)
    }

    /// Bytes held, the pattern included.
    pub(super) fn bytes(&self) -> usize {
        self.pattern.bytes() + size_of_val(&self.values[..])
    }
}
