//! Smoothed aggregation (Vaněk, Mandel and Brezina 1996): groups of nodes move rigidly on the next
//! level, errors that this cannot represent are smoothed by Chebyshev polynomials of D⁻¹A, and the
//! coarsest level is factorised. The number of iterations does not grow with the mesh.

use std::sync::Arc;

use intrados_stage::{Job, random::Key};
use rayon::prelude::*;

use super::{
    BlockMatrix, Pattern, Place, SolveError,
    aggregate::{Aggregates, NONE, aggregate},
    block::{Block, add_product, add_transposed_product, inverse},
    body::rigid_modes,
    clusters::Clusters,
    constraint::Mask,
    direct::Factor,
    krylov::{Operator, Precondition, Until, conjugate_gradients},
    prolong::{Prolongation, Tentative, entry, row_of, rows_in_chunks},
};

/// Strength of connection on the finest level; half of it on each coarser one.
const STRONG: f64 = 0.01;
/// Unknowns of a level that is factorised.
const BOTTOM: usize = 1500;
/// Degree of the smoothing polynomial.
const DEGREE: usize = 3;
/// Errors between λ_max / RANGE and λ_max are the smoother's.
const RANGE: f64 = 20.0;
/// Steps of Lanczos for λ_max, and by how much its estimate is raised.
const LANCZOS: (usize, f64) = (10, 1.1);

/// One level, and the way to the next.
struct Level<const B: usize, const K: usize> {
    inverse: Clusters<B>,
    /// λ_max(D⁻¹A)
    largest: f64,
    prolongation: Prolongation<B, K>,
}

/// The hierarchy; the finest matrix is not in it.
pub(super) struct Multigrid<const B: usize, const K: usize> {
    fine: Level<B, K>,
    coarse: Vec<(BlockMatrix<K>, Level<K, K>)>,
    /// The factor of the coarsest matrix, if it has any unknowns.
    bottom: Option<Factor>,
    free: Mask<K>,
    bytes: usize,
}

impl<const B: usize, const K: usize> Multigrid<B, K> {
    /// Builds all levels.
    ///
    /// # Errors
    /// [`SolveError::NoStiffness`], [`SolveError::Indefinite`], [`SolveError::Cancelled`].
    pub(super) fn new(
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        job: &Job,
    ) -> Result<Self, SolveError> {
        let free = Mask::free();
        let operator = Operator { matrix, mask };
        let inverse = Clusters::new(operator, &mask.inverse_diagonal(matrix)?);
        let (fine, mut next) =
            Level::new(operator, inverse, fine_modes(matrix, mask), STRONG, job)?;
        let mut bytes = fine.bytes();
        let mut coarse = Vec::new();
        let mut threshold = STRONG;
        while next.matrix.unknowns() > BOTTOM {
            threshold *= 0.5;
            let operator = Operator { matrix: &next.matrix, mask: &free };
            let (level, mut after) = Level::new(
                operator,
                Clusters::new(operator, &lenient_inverses(&next.matrix)),
                next.modes,
                threshold,
                job,
            )
            .map_err(|e| at_node(e, &next.first))?;
            after.first.iter_mut().for_each(|n| *n = next.first[*n as usize]);
            // A level that saves little costs more than it gives.
            let enough = 4 * after.matrix.nodes() > 3 * next.matrix.nodes();
            bytes += level.bytes() + next.matrix.bytes();
            coarse.push((next.matrix, level));
            next = after;
            if enough {
                break;
            }
        }
        let bottom = if next.matrix.nodes() == 0 {
            None
        } else {
            Some(Factor::new(&next.matrix, &free, false, job)?)
        };
        bytes += bottom.as_ref().map_or(0, Factor::bytes);
        Ok(Self { fine, coarse, bottom, free, bytes })
    }

    /// Keeps the coarse levels for another matrix of the pattern, but lets the smoother know it.
    ///
    /// # Errors
    /// As [`Multigrid::new`].
    pub(super) fn refresh(
        &mut self,
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        job: &Job,
    ) -> Result<(), SolveError> {
        let operator = Operator { matrix, mask };
        self.fine.inverse = Clusters::new(operator, &mask.inverse_diagonal(matrix)?);
        self.fine.largest = largest_eigenvalue(operator, &self.fine.inverse, job)?;
        Ok(())
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Solves approximately on coarse level `depth`.
    fn descend(&self, depth: usize, r: &[f64]) -> Result<Vec<f64>, SolveError> {
        match self.coarse.get(depth) {
            Some((matrix, level)) => {
                let mut z = vec![0.0; r.len()];
                level.cycle(Operator { matrix, mask: &self.free }, r, &mut z, |r| {
                    self.descend(depth + 1, r)
                })?;
                Ok(z)
            }
            None => {
                let mut z = r.to_vec();
                self.bottom.as_ref().map_or(Ok(()), |bottom| bottom.solve_in_place(&mut z))?;
                Ok(z)
            }
        }
    }
}

impl<const B: usize, const K: usize> Precondition<B> for Multigrid<B, K> {
    fn apply(&self, operator: Operator<B>, r: &[f64], z: &mut [f64]) -> Result<(), SolveError> {
        self.fine.cycle(operator, r, z, |r| self.descend(0, r))
    }
}

/// The rigid motions of what is free, about the middle of all nodes.
fn fine_modes<const B: usize, const K: usize>(
    matrix: &BlockMatrix<B>,
    mask: &Mask<B>,
) -> Vec<Block<B, K>> {
    let places = &matrix.pattern().places;
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for place in places {
        for c in 0..3 {
            low[c] = low[c].min(place.position[c]);
            high[c] = high[c].max(place.position[c]);
        }
    }
    let centre = std::array::from_fn(|c| 0.5 * (low[c] + high[c]));
    let size = (0..3).map(|c| (high[c] - low[c]).powi(2)).sum::<f64>().sqrt();
    let size = if size > 0.0 { size } else { 1.0 };
    let mode = |i: usize| {
        let modes = rigid_modes::<B, K>(&places[i], centre, size);
        mask.at(i).map_or(modes, |p| super::block::product(p, &modes))
    };
    (0..matrix.nodes()).into_par_iter().map(mode).collect()
}

/// λ_max(D⁻¹A), from a few steps of Lanczos on a random vector.
fn largest_eigenvalue<const B: usize>(
    operator: Operator<B>,
    inverse: &Clusters<B>,
    job: &Job,
) -> Result<f64, SolveError> {
    let mut r: Vec<f64> = (0..operator.matrix.unknowns() as u64)
        .into_par_iter()
        .map(|i| Key::new(1, i).unit64(0) - 0.5)
        .collect();
    operator.mask.project(&mut r);
    let mut x = vec![0.0; r.len()];
    let until = Until { goal: 0.0, limit: LANCZOS.0, instead: None };
    let history = conjugate_gradients(operator, inverse, &mut x, &mut r, until, job)?;
    let largest = LANCZOS.1 * history.largest_eigenvalue();
    Ok(if largest > 0.0 { largest } else { 1.0 })
}

/// Inverse diagonal blocks of a coarse level; where a block is singular to rounding, of its
/// diagonal alone.
fn lenient_inverses<const K: usize>(matrix: &BlockMatrix<K>) -> Vec<Block<K, K>> {
    let diagonal_only = |d: &Block<K, K>| {
        let positive = |v: f64| if v > 0.0 { 1.0 / v } else { 0.0 };
        std::array::from_fn(|r| {
            std::array::from_fn(|c| if r == c { positive(d[r][r]) } else { 0.0 })
        })
    };
    let of = |i| inverse(matrix.diagonal(i)).unwrap_or_else(|| diagonal_only(matrix.diagonal(i)));
    (0..matrix.nodes()).into_par_iter().map(of).collect()
}

/// An error of a coarse level in terms of the finest.
fn at_node(error: SolveError, first: &[u32]) -> SolveError {
    match error {
        SolveError::Indefinite { node, .. } => SolveError::Indefinite {
            method: "multigrid",
            node: first.get(node).map_or(0, |&n| n as usize),
        },
        other => other,
    }
}

/// What the next level begins with.
struct Next<const K: usize> {
    matrix: BlockMatrix<K>,
    modes: Vec<Block<K, K>>,
    /// A node of each group.
    first: Vec<u32>,
}

impl<const B: usize, const K: usize> Level<B, K> {
    /// A level, and the beginning of the next one.
    fn new(
        operator: Operator<B>,
        inverse: Clusters<B>,
        modes: Vec<Block<B, K>>,
        threshold: f64,
        job: &Job,
    ) -> Result<(Self, Next<K>), SolveError> {
        let largest = largest_eigenvalue(operator, &inverse, job)?;
        let groups = aggregate(operator.matrix, operator.mask, threshold);
        job.step(0, 1)?;
        let tentative = Tentative::new(&groups, &modes);
        drop(modes);
        // ω = 4/3 / λ_max makes the largest energy of a smoothed mode smallest; the safety of λ_max
        // is not wanted here.
        let prolongation = Prolongation::smoothed(
            operator,
            &inverse,
            &groups,
            &tentative,
            4.0 / 3.0 / largest * LANCZOS.1,
        );
        job.step(0, 1)?;
        let matrix =
            galerkin(operator.matrix, &prolongation, centres(operator.matrix.pattern(), &groups));
        job.step(0, 1)?;
        let next = Next { matrix, modes: tentative.coarse_modes, first: groups.first() };
        Ok((Self { inverse, largest, prolongation }, next))
    }

    /// One V-cycle: z ≈ A⁻¹ r.
    fn cycle(
        &self,
        operator: Operator<B>,
        r: &[f64],
        z: &mut [f64],
        next: impl FnOnce(&[f64]) -> Result<Vec<f64>, SolveError>,
    ) -> Result<(), SolveError> {
        z.fill(0.0);
        let (mut rest, mut step) = (r.to_vec(), vec![0.0; r.len()]);
        self.smooth(operator, &mut rest, &mut step, z);
        operator.subtract_product(&step, &mut rest);
        let coarse = next(&self.prolongation.restrict(&rest))?;
        self.prolongation.add_prolonged(&coarse, z);
        rest.copy_from_slice(r);
        operator.subtract_product(z, &mut rest);
        self.smooth(operator, &mut rest, &mut step, z);
        Ok(())
    }

    /// z ← z + p(D⁻¹A) D⁻¹ r with the Chebyshev polynomial of the upper part of the spectrum (Saad,
    /// Iterative Methods, algorithm 12.1). `r` is the residual at z; it follows all steps but the
    /// last, which is left in `step`.
    fn smooth(&self, operator: Operator<B>, r: &mut [f64], step: &mut [f64], z: &mut [f64]) {
        let (high, low) = (self.largest, self.largest / RANGE);
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let (mut rho, mut keep, mut turn) = (half / middle, 0.0, 1.0 / middle);
        for degree in 0..DEGREE {
            if degree > 0 {
                operator.subtract_product(step, r);
                let next = 1.0 / (2.0 * middle / half - rho);
                (keep, turn) = (next * rho, 2.0 * next / half);
                rho = next;
            }
            self.inverse.by_rows(r, step, z, |turned, step, z| {
                for c in 0..B {
                    step[c] = keep * step[c] + turn * turned[c];
                    z[c] += step[c];
                }
            });
        }
    }

    fn bytes(&self) -> usize {
        self.inverse.bytes() + self.prolongation.bytes()
    }
}

/// The middle of each group.
fn centres(pattern: &Pattern, groups: &Aggregates) -> Vec<Place> {
    let mut sums = vec![([0.0; 3], 0.0); groups.count];
    for (place, &g) in pattern.places.iter().zip(&groups.of) {
        if g != NONE {
            let (sum, count) = &mut sums[g as usize];
            (0..3).for_each(|c| sum[c] += place.position[c]);
            *count += 1.0;
        }
    }
    sums.into_iter()
        .map(|(sum, count)| Place::point(sum.map(|s| s / f64::max(count, 1.0))))
        .collect()
}

/// Pᵀ A P. Only blocks on and above the diagonal are computed; the others are their transposes, so
/// that the matrix is symmetric to the bit.
fn galerkin<const B: usize, const K: usize>(
    matrix: &BlockMatrix<B>,
    p: &Prolongation<B, K>,
    places: Vec<Place>,
) -> BlockMatrix<K> {
    let times = |i: usize, columns: &mut Vec<u32>, values: &mut Vec<Block<B, K>>| {
        let first = columns.len();
        for (j, block) in matrix.row_blocks(i) {
            for (column, right) in p.row(j) {
                let at = entry(first, column as u32, columns, values);
                add_product(1.0, block, right, &mut values[at]);
            }
        }
    };
    let ap = rows_in_chunks::<B, K>(matrix.nodes(), times);
    let row = |group: usize| {
        let mut row: Vec<(u32, Block<K, K>)> = Vec::new();
        for (i, entry) in p.column(group) {
            for (column, right) in row_of(&ap, i).filter(|(column, _)| *column >= group) {
                let at = row.iter().position(|(c, _)| *c as usize == column).unwrap_or_else(|| {
                    row.push((column as u32, [[0.0; K]; K]));
                    row.len() - 1
                });
                add_transposed_product(&p.values[entry], right, &mut row[at].1);
            }
        }
        row.sort_unstable_by_key(|(c, _)| *c);
        row
    };
    let upper: Vec<Vec<(u32, Block<K, K>)>> =
        (0..p.coarse_nodes()).into_par_iter().map(row).collect();
    drop(ap);
    mirrored(upper, places)
}

/// The symmetric matrix of these upper rows. A motion that no fine node makes gets a stiffness, so
/// that it can rest.
fn mirrored<const K: usize>(
    mut upper: Vec<Vec<(u32, Block<K, K>)>>,
    places: Vec<Place>,
) -> BlockMatrix<K> {
    let mut lower: Vec<Vec<u32>> = vec![Vec::new(); upper.len()];
    for (i, row) in upper.iter_mut().enumerate() {
        row.iter()
            .filter(|(j, _)| *j as usize > i)
            .for_each(|(j, _)| lower[*j as usize].push(i as u32));
        if let Some((_, diagonal)) = row.first_mut() {
            let largest = (0..K).fold(0.0, |m: f64, k| m.max(diagonal[k][k]));
            for (k, row) in diagonal.iter_mut().enumerate().filter(|(k, row)| row[*k] == 0.0) {
                row[k] = if largest > 0.0 { largest } else { 1.0 };
            }
        }
    }
    let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
    let mut next = vec![1_usize; upper.len()];
    for i in 0..upper.len() {
        for &j in &lower[i] {
            // Rows are visited in ascending order: the entries of row j beyond the diagonal come up
            // one after the other.
            let at = &mut next[j as usize];
            let block = upper[j as usize][*at].1;
            *at += 1;
            columns.push(j);
            values.push(std::array::from_fn(|r| std::array::from_fn(|c| block[c][r])));
        }
        columns.extend(upper[i].iter().map(|(j, _)| *j));
        values.extend(upper[i].iter().map(|(_, block)| *block));
        starts.push(columns.len());
    }
    BlockMatrix { pattern: Arc::new(Pattern { places, starts, columns }), values }
}
