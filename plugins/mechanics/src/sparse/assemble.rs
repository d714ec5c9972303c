//! From dense matrices of elements to rows of the sparse one: a batch of elements is computed in
//! parallel, then each row that the batch touches gathers what belongs to it. Every entry is the
//! sum over its elements in ascending order, whoever computed them.

use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use super::{BlockMatrix, Connectivity, block::Block};

/// Elements of a batch: their matrices (4.6 kB for a hexahedron) stay in the cache between
/// computing and gathering.
const BATCH: usize = 512;
/// Rows that one task gathers.
const ROWS: usize = 64;

impl<const B: usize> BlockMatrix<B> {
    /// Adds the matrix of every element. `element(e, k)` fills `k`, zeroed before: rows and columns
    /// run over the nodes of the element, B components each.
    ///
    /// # Errors
    /// The error of the element of smallest number in the first batch that fails, or [`Cancelled`];
    /// the values are then incomplete.
    ///
    /// # Panics
    /// If an element joins nodes that the pattern does not.
    pub fn assemble<E: From<Cancelled> + Send>(
        &mut self,
        elements: &Connectivity,
        job: &Job,
        element: impl Fn(usize, &mut [f64]) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        Assembly::<B> { matrix: Some(self), vector: None }
            .run(elements, job, |e, k, _| element(e, k))
    }

    /// As [`BlockMatrix::assemble`], with the forces of every element added to `forces` in the same
    /// sweep: `element(e, k, f)`.
    ///
    /// # Errors
    /// As [`BlockMatrix::assemble`].
    ///
    /// # Panics
    /// As [`BlockMatrix::assemble`], or if `forces` has not [`BlockMatrix::unknowns`] entries.
    pub(crate) fn assemble_with<E: From<Cancelled> + Send>(
        &mut self,
        elements: &Connectivity,
        forces: &mut [f64],
        job: &Job,
        element: impl Fn(usize, &mut [f64], &mut [f64]) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        assert_eq!(forces.len(), self.unknowns());
        Assembly { matrix: Some(self), vector: Some(forces.as_chunks_mut::<B>().0) }
            .run(elements, job, element)
    }
}

/// Adds the forces of every element, `element(e, f)`, to `forces` (B for each node).
///
/// # Errors
/// As [`BlockMatrix::assemble`].
///
/// # Panics
/// If an element joins a node beyond the vector.
pub(crate) fn assemble_vector<const B: usize, E: From<Cancelled> + Send>(
    elements: &Connectivity,
    forces: &mut [f64],
    job: &Job,
    element: impl Fn(usize, &mut [f64]) -> Result<(), E> + Sync,
) -> Result<(), E> {
    Assembly::<B> { matrix: None, vector: Some(forces.as_chunks_mut::<B>().0) }.run(
        elements,
        job,
        |e, _, f| element(e, f),
    )
}

/// What is assembled: matrix, vector, or both.
struct Assembly<'a, const B: usize> {
    matrix: Option<&'a mut BlockMatrix<B>>,
    vector: Option<&'a mut [[f64; B]]>,
}

/// One place where an element contributes: node, element, index of the node in it.
type Share = (u32, u32, u32);

/// A row of the matrix and the vector, and what adds to it.
struct Row<'a, const B: usize> {
    shares: &'a [Share],
    blocks: &'a mut [Block<B, B>],
    force: Option<&'a mut [f64; B]>,
}

impl<const B: usize> Assembly<'_, B> {
    fn run<E: From<Cancelled> + Send>(
        &mut self,
        elements: &Connectivity,
        job: &Job,
        element: impl Fn(usize, &mut [f64], &mut [f64]) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        let (mut matrices, mut forces, mut shares) = (Vec::new(), Vec::new(), Vec::<Share>::new());
        for first in (0..elements.len()).step_by(BATCH) {
            job.step(first, elements.len())?;
            let batch = first..(first + BATCH).min(elements.len());
            shares.clear();
            shares.extend(batch.clone().flat_map(|e| {
                elements.get(e).iter().enumerate().map(move |(a, &n)| (n, e as u32, a as u32))
            }));
            shares.sort_unstable();

            let size = |e: usize| elements.get(e).len() * B;
            reset(
                &mut matrices,
                if self.matrix.is_some() {
                    batch.clone().map(|e| size(e) * size(e)).sum()
                } else {
                    0
                },
            );
            reset(
                &mut forces,
                if self.vector.is_some() { batch.clone().map(size).sum() } else { 0 },
            );
            let mut work = split(&batch, size, &mut matrices, &mut forces);
            // The first error in the order of the elements, not of the clock.
            work.par_iter_mut()
                .enumerate()
                .map(|(i, (k, f))| element(first + i, k, f))
                .collect::<Vec<_>>()
                .into_iter()
                .collect::<Result<(), E>>()?;

            self.gather(elements, first, &work, &shares);
        }
        Ok(job.step(1, 1)?)
    }

    /// Adds a batch, every row by itself.
    fn gather(
        &mut self,
        elements: &Connectivity,
        first: usize,
        work: &[(&mut [f64], &mut [f64])],
        shares: &[Share],
    ) {
        let pattern = self.matrix.as_deref().map(|m| m.pattern.clone());
        let mut blocks = Cursor {
            rest: self.matrix.as_deref_mut().map_or(&mut [][..], |m| &mut m.values),
            at: 0,
        };
        let mut vector = Cursor { rest: self.vector.as_deref_mut().unwrap_or_default(), at: 0 };
        let parts = shares.chunk_by(|a, b| a.0 == b.0).map(|shares| {
            let node = shares[0].0 as usize;
            let blocks = pattern
                .as_ref()
                .map_or(&mut [][..], |p| blocks.take(p.starts[node]..p.starts[node + 1]));
            let force =
                if vector.rest.is_empty() { None } else { vector.take(node..node + 1).first_mut() };
            Row { shares, blocks, force }
        });
        let mut rows: Vec<Row<B>> = parts.collect();
        rows.par_chunks_mut(ROWS).for_each(|rows| {
            for row in rows {
                let columns = pattern.as_ref().map_or(&[][..], |p| p.row(row.shares[0].0 as usize));
                for &(_, e, a) in row.shares {
                    let (k, f) = &work[e as usize - first];
                    row.add(columns, elements.get(e as usize), a as usize, k, f);
                }
            }
        });
    }
}

/// Hands out ascending parts of a slice.
struct Cursor<'a, T> {
    rest: &'a mut [T],
    /// Index of the first element of `rest` in the whole.
    at: usize,
}

impl<'a, T> Cursor<'a, T> {
    fn take(&mut self, range: std::ops::Range<usize>) -> &'a mut [T] {
        let (_, rest) = std::mem::take(&mut self.rest).split_at_mut(range.start - self.at);
        let (part, rest) = rest.split_at_mut(range.len());
        (self.rest, self.at) = (rest, range.end);
        part
    }
}

impl<const B: usize> Row<'_, B> {
    /// Adds row `a` of an element's matrix `k` and vector `f`.
    fn add(&mut self, columns: &[u32], nodes: &[u32], a: usize, k: &[f64], f: &[f64]) {
        if let Some(force) = &mut self.force {
            for (to, from) in force.iter_mut().zip(&f[a * B..]) {
                *to += from;
            }
        }
        if columns.is_empty() {
            return;
        }
        let width = nodes.len() * B;
        for (b, node) in nodes.iter().enumerate() {
            let column = columns.partition_point(|c| c < node);
            assert_eq!(
                columns.get(column),
                Some(node),
                "the pattern does not join two nodes of an element"
            );
            let to = &mut self.blocks[column];
            for (r, to) in to.iter_mut().enumerate() {
                let from = &k[(a * B + r) * width + b * B..];
                for (to, from) in to.iter_mut().zip(from) {
                    *to += from;
                }
            }
        }
    }
}

/// Zeros, this many.
fn reset(buffer: &mut Vec<f64>, len: usize) {
    buffer.clear();
    buffer.resize(len, 0.0);
}

/// The part of each buffer that belongs to each element.
fn split<'a>(
    batch: &std::ops::Range<usize>,
    size: impl Fn(usize) -> usize,
    mut matrices: &'a mut [f64],
    mut forces: &'a mut [f64],
) -> Vec<(&'a mut [f64], &'a mut [f64])> {
    let (with_matrix, with_force) = (!matrices.is_empty(), !forces.is_empty());
    let parts = batch.clone().map(|e| {
        let (k, rest) = std::mem::take(&mut matrices).split_at_mut(if with_matrix {
            size(e) * size(e)
        } else {
            0
        });
        let (f, rest_f) =
            std::mem::take(&mut forces).split_at_mut(if with_force { size(e) } else { 0 });
        (matrices, forces) = (rest, rest_f);
        (k, f)
    });
    parts.collect()
}
