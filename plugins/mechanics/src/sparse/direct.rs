//! Factorisation by `faer`: LLᵀ of what is positive definite, else LBLᵀ with pivots of one and two,
//! whose signs tell how many eigenvalues are negative. On one thread: in parts, faer's kernels cost
//! 1.4 to 2 times the CPU-seconds, and the bits would depend on the number of parts.

use faer::{
    MatMut, Par, Side,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    linalg::cholesky::llt::factor::LltError,
    perm::PermRef,
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            SupernodalThreshold,
            cholesky::{
                CholeskySymbolicParams, IntranodeLbltRef, LltRef, SymbolicCholesky,
                SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
                supernodal::SupernodalIntranodeLbltRef,
            },
        },
    },
};
use intrados_stage::Job;

use super::{
    BlockMatrix, SolveError,
    block::{Block, product},
    constraint::Mask,
    order::nested_dissection,
};

/// The factor of P A P + d (1 − P).
pub(super) struct Factor {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    pivots: Option<Pivots>,
    scratch: usize,
}

/// What LBLᵀ has beside L.
struct Pivots {
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    negative: usize,
}

/// The upper triangle by columns.
struct Upper {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Factor {
    /// Orders, analyses and factorises. `definite`: an indefinite matrix is an error, not a reason
    /// for LBLᵀ.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`], [`SolveError::Indefinite`], [`SolveError::Cancelled`] (asked
    /// between the parts only).
    pub(super) fn new<const B: usize>(
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        definite: bool,
        job: &Job,
    ) -> Result<Self, SolveError> {
        Self::in_order(matrix, mask, definite, &nested_dissection(matrix.pattern()), job)
    }

    /// The same in an order of nodes that is known.
    ///
    /// # Errors
    /// As [`Factor::new`].
    pub(super) fn in_order<const B: usize>(
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        definite: bool,
        order: &[u32],
        job: &Job,
    ) -> Result<Self, SolveError> {
        let unknowns = matrix.unknowns();
        let large = |why: String| SolveError::TooLarge { unknowns, why };
        let upper =
            Upper::new(matrix, mask).ok_or_else(|| large("more than 2³² entries".into()))?;
        job.step(1, 10)?;
        let mut forward = Vec::with_capacity(unknowns);
        order.iter().for_each(|&n| forward.extend((0..B as u32).map(|c| n * B as u32 + c)));
        let mut inverse = vec![0; unknowns];
        forward.iter().enumerate().for_each(|(new, &old)| inverse[old as usize] = new as u32);
        job.step(2, 10)?;
        let pattern = SymbolicSparseColMatRef::new_checked(
            unknowns,
            unknowns,
            &upper.starts,
            None,
            &upper.rows,
        );
        let ordering =
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, unknowns));
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Upper, ordering, params)
            .map_err(|e| large(format!("{e:?}")))?;
        job.step(3, 10)?;
        let a = SparseColMatRef::new(pattern, &upper.values);
        let mut factor = Self { values: Vec::new(), symbolic, pivots: None, scratch: 0 };
        match factor.cholesky(a)? {
            None => Ok(factor),
            Some(pivot) if definite => {
                let node = forward.get(pivot).map_or(0, |&old| old as usize / B);
                Err(SolveError::Indefinite { method: "Cholesky", node })
            }
            Some(_) => {
                job.step(6, 10)?;
                factor.pivots = Some(factor.pivoted(a)?);
                Ok(factor)
            }
        }
    }

    /// Takes LLᵀ; the index of the pivot that was not positive, if one was.
    fn cholesky(&mut self, a: SparseColMatRef<u32, f64>) -> Result<Option<usize>, SolveError> {
        let need = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let (mut values, mut buffer) = (self.room()?, self.memory(need)?);
        let stack = MemStack::new(&mut buffer);
        let result = self.symbolic.factorize_numeric_llt(
            &mut values,
            a,
            Side::Upper,
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        let failed = result.err().map(|LltError::NonPositivePivot { index }| index);
        (self.values, self.scratch) = (values, need.unaligned_bytes_required());
        Ok(failed)
    }

    /// Takes LBLᵀ.
    fn pivoted(&mut self, a: SparseColMatRef<u32, f64>) -> Result<Pivots, SolveError> {
        let need = self
            .symbolic
            .factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default());
        self.values = Vec::new();
        let (mut values, mut buffer) = (self.room()?, self.memory(need)?);
        let n = self.symbolic.nrows();
        let (mut subdiagonal, mut forward, mut inverse) = (vec![0.0; n], vec![0; n], vec![0; n]);
        let factor = self.symbolic.factorize_numeric_intranode_lblt(
            &mut values,
            &mut subdiagonal,
            &mut forward,
            &mut inverse,
            a,
            Side::Upper,
            Par::Seq,
            MemStack::new(&mut buffer),
            Default::default(),
        );
        let _ = factor;
        let negative = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(raw) => {
                let permutation = PermRef::new_checked(&forward, &inverse, n);
                negative_pivots(
                    SupernodalIntranodeLbltRef::new(raw, &values, &subdiagonal, permutation),
                    &subdiagonal,
                )
            }
            // The analysis was told to make supernodes.
            SymbolicCholeskyRaw::Simplicial(_) => 0,
        };
        self.values = values;
        Ok(Pivots { subdiagonal, forward, inverse, negative })
    }

    /// Room for the entries of L.
    fn room(&self) -> Result<Vec<f64>, SolveError> {
        let (len, unknowns) = (self.symbolic.len_val(), self.symbolic.nrows());
        let mut values = Vec::new();
        let why =
            |e| SolveError::TooLarge { unknowns, why: format!("{:.1} GB: {e}", len as f64 * 8e-9) };
        values.try_reserve_exact(len).map_err(why)?;
        values.resize(len, 0.0);
        Ok(values)
    }

    fn memory(&self, need: StackReq) -> Result<MemBuffer, SolveError> {
        let why = |_| SolveError::TooLarge {
            unknowns: self.symbolic.nrows(),
            why: format!("{:.1} GB of work space", need.unaligned_bytes_required() as f64 * 1e-9),
        };
        MemBuffer::try_new(need).map_err(why)
    }

    /// x ← A⁻¹ x
    pub(super) fn solve_in_place(&self, x: &mut [f64]) -> Result<(), SolveError> {
        let n = x.len();
        let need = self.symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        let mut buffer = self.memory(need)?;
        let (stack, x) = (MemStack::new(&mut buffer), MatMut::from_column_major_slice_mut(x, n, 1));
        match &self.pivots {
            None => LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
                faer::Conj::No,
                x,
                Par::Seq,
                stack,
            ),
            Some(p) => {
                let permutation = PermRef::new_checked(&p.forward, &p.inverse, n);
                IntranodeLbltRef::new(&self.symbolic, &self.values, &p.subdiagonal, permutation)
                    .solve_in_place_with_conj(faer::Conj::No, x, Par::Seq, stack);
            }
        }
        Ok(())
    }

    /// How many eigenvalues are negative.
    pub(super) fn negative(&self) -> usize {
        self.pivots.as_ref().map_or(0, |p| p.negative)
    }

    /// Entries of L.
    #[cfg(test)]
    pub(super) fn entries(&self) -> usize {
        self.values.len()
    }

    /// Bytes held while factorising.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + self.scratch
    }
}

/// Signs of the pivots (Sylvester): a 2 × 2 pivot of negative determinant has one negative
/// eigenvalue.
fn negative_pivots(factor: SupernodalIntranodeLbltRef<u32, f64>, subdiagonal: &[f64]) -> usize {
    let mut diagonal = Vec::with_capacity(subdiagonal.len());
    for s in 0..factor.symbolic().n_supernodes() {
        let values = factor.supernode(s).val();
        diagonal.extend((0..values.ncols()).map(|c| values[(c, c)]));
    }
    let (mut negative, mut i) = (0, 0);
    while i < diagonal.len() {
        let off = subdiagonal[i];
        if off == 0.0 || i + 1 == diagonal.len() {
            negative += usize::from(diagonal[i] < 0.0);
            i += 1;
        } else {
            let determinant = diagonal[i] * diagonal[i + 1] - off * off;
            negative += if determinant < 0.0 { 1 } else { 2 * usize::from(diagonal[i] < 0.0) };
            i += 2;
        }
    }
    negative
}

impl Upper {
    /// The entries, without those that constraints along the axes make zero; `None` if they are too
    /// many for 32 bits.
    fn new<const B: usize>(matrix: &BlockMatrix<B>, mask: &Mask<B>) -> Option<Self> {
        let projectors: Vec<Option<&Block<B, B>>> =
            (0..matrix.nodes()).map(|i| mask.at(i)).collect();
        let held = |i: usize, c: usize| projectors[i].is_some_and(|p| p[c] == [0.0; B]);
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..matrix.nodes() {
            let diagonal = mask.diagonal(matrix, j);
            // Column j of the upper triangle is row j of the lower one.
            let blocks: Vec<(usize, Block<B, B>)> = matrix
                .row_blocks(j)
                .take_while(|(i, _)| *i <= j)
                .map(|(i, block)| {
                    let left = projectors[j].map_or(*block, |p| product(p, block));
                    (
                        i,
                        if i == j {
                            diagonal
                        } else {
                            projectors[i].map_or(left, |p| product(&left, p))
                        },
                    )
                })
                .collect();
            for c in 0..B {
                for (i, block) in &blocks {
                    for (r, value) in block[c].iter().enumerate() {
                        let (row, column) = (i * B + r, j * B + c);
                        if row == column || (row < column && !held(j, c) && !held(*i, r)) {
                            rows.push(row as u32);
                            values.push(*value);
                        }
                    }
                }
                starts.push(u32::try_from(rows.len()).ok()?);
            }
        }
        Some(Self { starts, rows, values })
    }
}
