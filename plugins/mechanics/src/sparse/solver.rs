//! One entry for all methods.

use std::sync::OnceLock;

use intrados_stage::Job;

use super::{
    BlockMatrix, Constraints, SolveError,
    block::Block,
    body,
    constraint::Mask,
    direct::Factor,
    krylov::{Jacobi, Operator, Precondition, Until, conjugate_gradients},
    multigrid::Multigrid,
    order::{nested_dissection, work},
    vector::{axpy, largest, norm, not_finite},
};

/// Unknowns up to which a factorisation is cheaper than a hierarchy and its iterations.
const SMALL: usize = 6_000;
/// Iterations after which conjugate gradients give up, with multigrid and without.
const LIMIT: (usize, usize) = (1_000, 20_000);
/// Iterations of multigrid after which a factorisation is cheaper than waiting, where one can be
/// had: on bricks of fair shape it takes ten to forty.
const PATIENCE: usize = 200;
/// Unknowns up to which a factorisation is tried where multigrid gave up.
const FACTORABLE: usize = 150_000;
/// Iterations of multigrid that a hierarchy and the fewest of them cost.
const HIERARCHY: f64 = 12.0;
/// What a factorisation multiplies while multigrid goes through an iteration, for every unknown:
/// 5e9 a second, and 1.5e-6 s.
const MULTIPLIED: f64 = 7_500.0;

/// How to solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Direct if the system is small, else multigrid; direct where multigrid gives up (an
    /// indefinite matrix), if the factor can fit.
    #[default]
    Auto,
    /// The same for few systems that are solved closely: direct also where that costs less than a
    /// hierarchy (thin sheets), or than the iterations that multigrid has left at its rate (needles).
    Once,
    /// A factorisation.
    Direct,
    /// Conjugate gradients with smoothed-aggregation multigrid.
    Multigrid,
    /// Conjugate gradients with the inverse blocks of the diagonal.
    Jacobi,
}

impl Method {
    /// What it chooses by, in words.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::Auto => format!(
                "direct up to {SMALL} unknowns, else multigrid, and up to {FACTORABLE} direct where that gives up"
            ),
            Self::Once => format!(
                "direct up to {SMALL} unknowns, else multigrid, and up to {FACTORABLE} direct where that costs less or multigrid gives up"
            ),
            Self::Direct => "direct".into(),
            Self::Multigrid => "multigrid".into(),
            Self::Jacobi => "jacobi".into(),
        }
    }

    /// Whether what solves may change.
    fn may_change(self) -> bool {
        matches!(self, Self::Auto | Self::Once)
    }
}

/// What is asked of a pattern at most once: in which order its nodes are eliminated, and what a
/// factor in that order costs.
#[derive(Default)]
struct Elimination {
    order: OnceLock<Vec<u32>>,
    cost: OnceLock<f64>,
}

impl Elimination {
    fn order<const B: usize>(&self, matrix: &BlockMatrix<B>) -> &[u32] {
        self.order.get_or_init(|| nested_dissection(matrix.pattern()))
    }

    /// In iterations of multigrid.
    fn cost<const B: usize>(&self, matrix: &BlockMatrix<B>) -> f64 {
        let nodes = matrix.nodes().max(1) as f64;
        let work = || work(matrix.pattern(), self.order(matrix));
        *self.cost.get_or_init(|| (B * B) as f64 * work() / (MULTIPLIED * nodes))
    }

    /// A factor of a matrix of the pattern.
    fn factor<const B: usize>(
        &self,
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        job: &Job,
    ) -> Result<Factor, SolveError> {
        Factor::in_order(matrix, mask, false, self.order(matrix), job)
    }
}

/// A solution, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// B values for each node.
    pub x: Vec<f64>,
    /// Iterations (of refinement, for a direct method).
    pub iterations: usize,
    /// ‖f − K x‖ / ‖f − K u_c‖ over what is free, computed anew from x.
    pub relative_residual: f64,
    /// Which method solved.
    pub method: &'static str,
    /// Negative eigenvalues of the matrix, where a factorisation met some; iterative methods refuse
    /// such a matrix.
    pub negative_eigenvalues: usize,
    /// Estimate of the most bytes held at a time: matrix, hierarchy or factor, vectors.
    pub peak_bytes: usize,
}

/// Solves K u = f once.
///
/// # Errors
/// Everything in [`SolveError`].
pub fn solve<const B: usize>(
    matrix: &BlockMatrix<B>,
    rhs: &[f64],
    constraints: &Constraints<B>,
    method: Method,
    tolerance: f64,
    job: &Job,
) -> Result<Solution, SolveError> {
    Solver::new(matrix, constraints, method, job)?.solve(matrix, rhs, constraints, tolerance, job)
}

/// What is kept between right-hand sides and between matrices of one pattern: the factor or the
/// hierarchy.
pub struct Solver<const B: usize> {
    mask: Mask<B>,
    method: Method,
    elimination: Elimination,
    engine: Engine<B>,
    /// Iterations that the hierarchy needed when it was new.
    at_first: Option<usize>,
    /// Whether it has become too old.
    stale: bool,
    /// Whether multigrid has ended because a factorisation costs less.
    slow: bool,
    /// Whether multigrid has given up; from then on everything is factorised.
    fell_back: bool,
}

enum Engine<const B: usize> {
    Factor(Factor),
    /// Inverse blocks of the diagonal.
    Jacobi(Vec<Block<B, B>>),
    /// Displacements: six rigid motions.
    Elastic(Multigrid<B, 6>),
    /// Everything else: constants.
    Scalar(Multigrid<B, B>),
}

impl<const B: usize> Engine<B> {
    fn new(
        matrix: &BlockMatrix<B>,
        mask: &Mask<B>,
        method: Method,
        elimination: &Elimination,
        job: &Job,
    ) -> Result<Self, SolveError> {
        let by = |method| Self::new(matrix, mask, method, elimination, job);
        let unknowns = matrix.unknowns();
        match method {
            Method::Auto | Method::Once if unknowns <= SMALL => by(Method::Direct),
            Method::Once if unknowns <= FACTORABLE && elimination.cost(matrix) < HIERARCHY => {
                by(Method::Direct)
            }
            Method::Auto | Method::Once => match by(Method::Multigrid) {
                Err(SolveError::Indefinite { .. }) => by(Method::Direct),
                other => other,
            },
            Method::Direct => Ok(Self::Factor(elimination.factor(matrix, mask, job)?)),
            Method::Multigrid if B == 3 => Ok(Self::Elastic(Multigrid::new(matrix, mask, job)?)),
            Method::Multigrid => Ok(Self::Scalar(Multigrid::new(matrix, mask, job)?)),
            Method::Jacobi => Ok(Self::Jacobi(mask.inverse_diagonal(matrix)?)),
        }
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Factor(factor) if factor.negative() > 0 => "direct LBLt",
            Self::Factor(_) => "direct",
            Self::Jacobi(_) => "jacobi",
            Self::Elastic(_) | Self::Scalar(_) => "multigrid",
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Factor(factor) => factor.bytes(),
            Self::Jacobi(inverse) => size_of_val(&inverse[..]),
            Self::Elastic(grid) => grid.bytes(),
            Self::Scalar(grid) => grid.bytes(),
        }
    }

    /// Improves x from the residual r; returns the iterations, and whether something else would cost
    /// less than those that are left.
    fn improve(
        &self,
        operator: Operator<B>,
        x: &mut [f64],
        r: &mut [f64],
        until: Until<'_>,
        job: &Job,
    ) -> Result<(usize, bool), SolveError> {
        let jacobi;
        let precondition: &dyn Precondition<B> = match self {
            Self::Factor(factor) => {
                factor.solve_in_place(r)?;
                operator.mask.project(r);
                axpy(1.0, r, x);
                return Ok((1, false));
            }
            Self::Jacobi(inverse) => {
                jacobi = Jacobi { inverse };
                &jacobi
            }
            Self::Elastic(grid) => grid,
            Self::Scalar(grid) => grid,
        };
        let history = conjugate_gradients(operator, precondition, x, r, until, job)?;
        Ok((history.iterations, history.slow))
    }
}

impl<const B: usize> Solver<B> {
    /// Checks matrix and constraints, and prepares the method.
    ///
    /// # Errors
    /// [`SolveError::Length`], [`SolveError::NotFinite`], [`SolveError::Floating`],
    /// [`SolveError::NoStiffness`], [`SolveError::Indefinite`], [`SolveError::TooLarge`],
    /// [`SolveError::Cancelled`].
    pub fn new(
        matrix: &BlockMatrix<B>,
        constraints: &Constraints<B>,
        method: Method,
        job: &Job,
    ) -> Result<Self, SolveError> {
        inside(|| {
            let mask = checked(matrix, constraints)?;
            job.step(0, 1)?;
            let elimination = Elimination::default();
            let engine = Engine::new(matrix, &mask, method, &elimination, job)?;
            let (at_first, stale, slow, fell_back) = (None, false, false, false);
            Ok(Self { mask, method, elimination, engine, at_first, stale, slow, fell_back })
        })
    }

    /// Whether multigrid gave up on a system within [`Method::Auto`], which was factorised then, as
    /// all after it.
    #[must_use]
    pub(crate) fn fell_back(&self) -> bool {
        self.fell_back
    }

    /// Lets go of a factor, which [`Solver::update`] makes anew in any case and which must come
    /// before the next solution. A hierarchy stays.
    pub(crate) fn release(&mut self) {
        if let Engine::Factor(_) = self.engine {
            self.engine = Engine::Jacobi(Vec::new());
        }
    }

    /// Takes new values of the matrix (same pattern) and new constraints. A factor is made anew; a
    /// hierarchy is kept, with its smoother brought up to date, until it needs half as many
    /// iterations again as when it was new.
    ///
    /// # Errors
    /// As [`Solver::new`].
    pub(crate) fn update(
        &mut self,
        matrix: &BlockMatrix<B>,
        constraints: &Constraints<B>,
        job: &Job,
    ) -> Result<(), SolveError> {
        inside(|| {
            let mask = checked(matrix, constraints)?;
            let keep = !self.stale && mask == self.mask;
            let refreshed = match &mut self.engine {
                Engine::Elastic(grid) if keep => grid.refresh(matrix, &mask, job),
                Engine::Scalar(grid) if keep => grid.refresh(matrix, &mask, job),
                _ => {
                    // The old factor goes before the new one comes.
                    self.engine = Engine::Jacobi(Vec::new());
                    (self.at_first, self.stale) = (None, false);
                    Engine::new(matrix, &mask, self.method, &self.elimination, job)
                        .map(|engine| self.engine = engine)
                }
            };
            self.mask = mask;
            match refreshed {
                Err(SolveError::Indefinite { .. }) if self.method.may_change() => {
                    self.factorise(matrix, job)
                }
                other => other,
            }
        })
    }

    /// Solves for one right-hand side; `matrix` is the one of [`Solver::new`] or of the last
    /// [`Solver::update`], `constraints` have the same directions, with any values.
    ///
    /// # Errors
    /// [`SolveError::Length`], [`SolveError::NotFinite`], [`SolveError::Indefinite`],
    /// [`SolveError::Singular`], [`SolveError::NotConverged`], [`SolveError::Cancelled`].
    pub fn solve(
        &mut self,
        matrix: &BlockMatrix<B>,
        rhs: &[f64],
        constraints: &Constraints<B>,
        tolerance: f64,
        job: &Job,
    ) -> Result<Solution, SolveError> {
        let expected = matrix.unknowns();
        if rhs.len() != expected {
            return Err(SolveError::Length { what: "right-hand side", found: rhs.len(), expected });
        }
        if let Some(i) = not_finite(rhs) {
            return Err(SolveError::NotFinite { what: "right-hand side", node: i / B });
        }
        if let Some(node) = self.mask.loaded_void(rhs) {
            return Err(SolveError::NoStiffness { node });
        }
        let factorable = self.method.may_change()
            && !matches!(self.engine, Engine::Factor(_))
            && expected <= FACTORABLE;
        inside(|| match self.iterate(matrix, rhs, constraints, tolerance, job) {
            Err(why @ (SolveError::Indefinite { .. } | SolveError::NotConverged { .. }))
                if factorable =>
            {
                if let SolveError::NotConverged { iterations, .. } = why {
                    if self.slow {
                        tracing::debug!("slow after {iterations} iterations of multigrid");
                    } else {
                        tracing::warn!(
                            "multigrid has not converged in {iterations} iterations: the system of {expected} unknowns is factorised"
                        );
                    }
                    (self.method, self.fell_back) = (Method::Direct, !self.slow);
                }
                self.factorise(matrix, job)?;
                self.iterate(matrix, rhs, constraints, tolerance, job)
            }
            other => other,
        })
    }

    /// Puts a factor in the place of what did not solve, which goes before it comes.
    fn factorise(&mut self, matrix: &BlockMatrix<B>, job: &Job) -> Result<(), SolveError> {
        self.engine = Engine::Jacobi(Vec::new());
        self.engine = Engine::Factor(self.elimination.factor(matrix, &self.mask, job)?);
        Ok(())
    }

    /// Iterations after which the engine gives up.
    fn limit(&self, unknowns: usize) -> usize {
        match self.engine {
            Engine::Jacobi(_) => LIMIT.1,
            _ if self.method.may_change() && unknowns <= FACTORABLE => PATIENCE,
            _ => LIMIT.0,
        }
    }

    fn iterate(
        &mut self,
        matrix: &BlockMatrix<B>,
        rhs: &[f64],
        constraints: &Constraints<B>,
        tolerance: f64,
        job: &Job,
    ) -> Result<Solution, SolveError> {
        let operator = Operator { matrix, mask: &self.mask };
        let mut x = constraints.values();
        let mut r = residual(operator, rhs, &x);
        let scale = norm(&r);
        let goal = tolerance * scale;
        let (mut iterations, mut reached, limit) = (0, scale, self.limit(rhs.len()));
        let elimination = &self.elimination;
        let cost = || elimination.cost(matrix);
        let is_worth_asking = self.method == Method::Once && rhs.len() <= FACTORABLE;
        // What rounding makes of the recurrence is repaired from the true residual, as long as that
        // gains anything. Sums in more digits would gain no more: the exact solution itself, once it
        // is rounded to doubles, leaves 5e-6 of the load of a clamped row of 1000 squares, 6e-5 of
        // one of 2000.
        while reached > goal && iterations < limit {
            let until = Until {
                goal: 0.7 * goal,
                limit: limit - iterations,
                instead: if is_worth_asking { Some(&cost) } else { None },
            };
            let (more, is_slow) = self.engine.improve(operator, &mut x, &mut r, until, job)?;
            iterations += more;
            self.slow = is_slow;
            r = residual(operator, rhs, &x);
            let before = std::mem::replace(&mut reached, norm(&r));
            if let Some(i) = not_finite(&x) {
                return Err(SolveError::Singular { node: i / B });
            }
            if is_slow || reached.is_nan() || reached > 0.5 * before {
                break;
            }
            job.step(1, 2)?;
        }
        let method = self.engine.name();
        let relative_residual = if scale > 0.0 { reached / scale } else { 0.0 };
        if reached.is_nan() || reached > goal {
            let node = largest(&r) / B;
            return Err(SolveError::NotConverged {
                method,
                iterations,
                residual: relative_residual,
                tolerance,
                node,
            });
        }
        let first = *self.at_first.get_or_insert(iterations);
        self.stale = 2 * iterations > 3 * first + 10;
        let negative_eigenvalues =
            if let Engine::Factor(factor) = &self.engine { factor.negative() } else { 0 };
        let peak_bytes =
            matrix.bytes() + self.mask.bytes() + self.engine.bytes() + 8 * size_of_val(rhs);
        Ok(Solution { x, iterations, relative_residual, method, negative_eigenvalues, peak_bytes })
    }
}

/// P (f − A x)
fn residual<const B: usize>(operator: Operator<B>, rhs: &[f64], x: &[f64]) -> Vec<f64> {
    let mut r = vec![0.0; x.len()];
    let f = rhs.as_chunks::<B>().0;
    operator.matrix.by_rows(x, &mut r, |i, ax, r| *r = std::array::from_fn(|c| f[i][c] - ax[c]));
    operator.mask.project(&mut r);
    r
}

/// What is free, if the system is one.
fn checked<const B: usize>(
    matrix: &BlockMatrix<B>,
    constraints: &Constraints<B>,
) -> Result<Mask<B>, SolveError> {
    if constraints.nodes() != matrix.nodes() {
        return Err(SolveError::Length {
            what: "set of constraints",
            found: constraints.nodes(),
            expected: matrix.nodes(),
        });
    }
    if let Some(node) = matrix.not_finite() {
        return Err(SolveError::NotFinite { what: "matrix", node });
    }
    body::check(matrix, constraints)?;
    Ok(Mask::new(constraints, matrix))
}

/// Runs in a worker of the pool: a solve is thousands of short parallel loops, each of which would
/// otherwise wake it.
fn inside<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::scope(|_| work())
}
