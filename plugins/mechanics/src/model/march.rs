//! From one equilibrium to the next: Newton's iteration, smaller steps where it does not converge,
//! and control of a displacement instead of a load where the structure softens (de Borst 1987).

use std::collections::BTreeSet;

use intrados_stage::{Cancelled, Job, time::DAY};

use super::{Action, History, System, Trial, anderson::Anderson, nonlocal::Nonlocal};
use crate::{
    element::ElementError,
    mesh::MeshError,
    sparse::{BlockMatrix, Constraints, Method, SolveError, Solver},
};

/// How to march.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarchSettings {
    /// Largest |load − internal force| over all that acts at which a step counts as in equilibrium.
    pub tolerance: f64,
    /// Iterations of a step before it is cut.
    pub iterations: usize,
    /// How many times the tolerance a step may be off whose iterations have run out, and yet be
    /// taken rather than cut: while many cracks open at once, the last per mille costs most.
    /// [`Step::residual`] tells.
    pub loose: f64,
    /// Out of balance by no more than this, an iteration that gains nothing any more has come down
    /// to rounding, and is taken.
    pub floor: f64,
    /// How often a step may be halved.
    pub cuts: u32,
    /// Part of a step from which on cracks that jump are followed one by one (see `avalanche`): 1
    /// where steps are short anyhow.
    pub jump: f64,
    /// How linear systems are solved.
    pub method: Method,
    /// To which part of what is out of balance they are solved: no closer than an iteration of
    /// Newton's comes anyway (Dembo, Eisenstat and Steihaug 1982).
    pub linear: f64,
    /// What all steps may take: iterations of linear solvers, an assembly counting
    /// [`ASSEMBLY`] of them, times unknowns. About 1.5e-6 CPU-seconds each.
    pub work: f64,
}

/// What an assembly of the equations counts, in iterations of the linear solver.
const ASSEMBLY: f64 = 4.0;

impl Default for MarchSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            iterations: 30,
            loose: 1.0,
            floor: 0.0,
            cuts: 8,
            jump: 0.25,
            method: Method::Auto,
            linear: 1e-8,
            work: f64::INFINITY,
        }
    }
}

impl MarchSettings {
    /// For the life of a member, wherever it is computed: forces within a per mille, and a step
    /// whose iterations run out is taken at ten times that. Its moments are near each other.
    #[must_use]
    pub fn of_life() -> Self {
        Self { tolerance: 1e-3, loose: 10.0, linear: 1e-3, jump: 1.0, ..Self::default() }
    }

    /// For a deck, which other programs solve to their last digits: what flat or slender bricks are
    /// out of balance by, they move by many times over (bricks of 1:14, a thousandth out of
    /// balance: 5e-4 of the displacements). Bricks of 1:1000 leave more than that to rounding.
    #[must_use]
    pub fn of_deck() -> Self {
        let method = Method::Once;
        Self { tolerance: 1e-8, floor: 1e-5, linear: 1e-6, method, ..Self::default() }
    }
}

/// What is given along the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Drive {
    /// The loads, by their histories.
    #[default]
    Loads,
    /// How far the structure moves: some loads are raised beside what their histories say, all in
    /// one proportion, whose factor is found.
    Raised {
        /// Which, of [`super::Model::loads`], and how much of each one of the factor is.
        loads: Vec<(usize, f64)>,
        /// What is meant by how far.
        control: Control,
    },
}

/// What tells how far a structure has moved.
#[derive(Debug, Clone, PartialEq)]
pub enum Control {
    /// A weighted sum of displacements (an opening, a deflection): node, component, weight.
    Row(Vec<(u32, u8, f64)>),
    /// All displacements along the direction of the step before (arc length, with the normal plane
    /// of Riks 1979): it follows a structure that snaps back.
    Arc,
}

/// One step that has converged.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// s.
    pub time: f64,
    /// By which loads are raised ([`Drive::Raised`]).
    pub factor: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Iterations of the linear solver, in all.
    pub linear: usize,
    /// |load − internal force| over all that acts.
    pub residual: f64,
    /// Equilibria on the way during which time stood still and cracks grew (see `avalanche`); zero:
    /// none were needed.
    pub avalanche: usize,
}

/// [`Trial::hold`] of the iteration. With their true tangent alone, all joints of a part open at
/// once when it comes away in some iteration; nothing but a millionth then holds it, its next place
/// is a metre off, and it never comes back. A hundredth lets it go a hundredth of a millimetre for
/// each kPa, and where a joint gapes for good the iteration only becomes slower by that hundredth
/// over the stiffness of what is joined (a ring of .45 m at 3 m: 1.5 GPa/m, the cushion 10): a
/// factor of some .07 an iteration, most of which the acceleration takes back.
const HOLD: f64 = 0.01;
/// By so much the most excessive strain may outgrow its damage between two equilibria of an
/// avalanche: all others grow in proportion.
const GROWTH: f64 = 1.0;
/// Excess below which the iteration is tried again.
const CALM: f64 = 0.1;
/// [`Goal::patience`] of a first attempt, which an avalanche can replace.
const PATIENCE: usize = 6;
/// Tolerance of equilibria with given damage, which are but a way.
const GIVEN: f64 = 1e-3;
/// So many equilibria, and an avalanche is a collapse.
const COLLAPSE: usize = 400;

/// Why there is no next equilibrium.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The mesh is wrong.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Every region needs a material.
    #[error("the mesh has {regions} regions, but {bodies} materials are given: one each")]
    Bodies {
        /// Of the mesh.
        regions: usize,
        /// Of the model.
        bodies: usize,
    },
    /// A material cannot be in this element.
    #[error("{element}: {source}")]
    Material {
        /// Its name.
        element: String,
        /// What the system says.
        source: crate::material::Error,
    },
    /// The implicit gradient's length does not suit an element.
    #[error(
        "{element}: the length of the implicit gradient must be at least twice the element's size, {:.3} m, and at most a quarter of E G_f/f_t², {:.3} m: take \
         another length or smaller elements",
        between[0],
        between[1]
    )]
    Length {
        /// Its name.
        element: String,
        /// Smallest and largest length, m.
        between: [f64; 2],
    },
    /// A joint's law for a brick, or a brick's for a joint.
    #[error(
        "{element} has a material that is not for elements of its kind: bricks take elastic or concrete laws, joints, shells and rods those named after them"
    )]
    Kind {
        /// Its name.
        element: String,
    },
    /// An element cannot answer.
    #[error("{element}: {source}")]
    Element {
        /// Its name.
        element: String,
        /// What the system says.
        source: ElementError,
    },
    /// The linear system has no solution.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Steps became too small.
    #[error(
        "no equilibrium is found on day {:.2}, however small the steps: perhaps it does not bear what acts then (look at units and factors of its loads); {quantity} of {node} is out of balance by \
         {residual:.1e} of all that acts, and {tolerance:.1e} is allowed", time / DAY
    )]
    NotConverged {
        /// Where it was to go, s.
        time: f64,
        /// What is out of balance.
        quantity: &'static str,
        /// Where it is worst.
        node: String,
        /// How much.
        residual: f64,
        /// How much is allowed.
        tolerance: f64,
    },
    /// An equilibrium of small displacements that the member does not have.
    #[error("{0}")]
    Beyond(String),
    /// It takes more work than it may.
    #[error(
        "its cracks take more work than this life may have (it is one of many): `intrados analyze --member` gives it all it needs"
    )]
    Laborious,
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A structure on its way.
pub struct March<'s, 'm> {
    /// The last equilibrium.
    pub history: History,
    way: Way<'s, 'm>,
}

/// How to get from one equilibrium to the next.
struct Way<'s, 'm> {
    structure: &'s System<'m>,
    settings: MarchSettings,
    drive: Drive,
    system: Equations,
    /// None: cracks are bands.
    nonlocal: Option<Nonlocal>,
    /// Work so far, as [`MarchSettings::work`] counts it.
    spent: f64,
    /// Where the last step went under [`Control::Arc`], of length 1; empty: there is none yet.
    ahead: Vec<f64>,
}

/// Stiffness, and what solves with it.
pub(crate) struct Equations {
    pub(super) matrix: BlockMatrix<3>,
    pub(super) solver: Option<Solver<3>>,
    /// Whether the matrix is still the one that the solver was made for.
    pub(super) stays: bool,
    method: Method,
    tolerance: f64,
    /// What has solved, by name.
    by: BTreeSet<&'static str>,
}

/// A state and how it was found, or what keeps it from being one.
type Attempt = Result<Result<(History, Step), Unbalanced>, Failure>;

/// Forces that were found not to balance.
struct Unbalanced {
    residual: f64,
    worst: usize,
}

/// Where an attempt is to get from a history, and how.
struct Goal {
    /// When, s.
    time: f64,
    /// By so much the controlled displacement is to grow.
    amount: f64,
    /// Share of what is out of balance at the beginning that stays so: a step without duration has
    /// nothing else that could be cut.
    left: f64,
    /// See [`Trial::growth`].
    growth: Option<f64>,
    /// So many iterations must halve what is out of balance, or the attempt is given up.
    patience: usize,
}

/// What one step aims at.
struct Aim {
    /// Forces that follow their histories, N.
    given: Vec<f64>,
    /// What the ground at rest presses with, N.
    pressing: f64,
    /// Forces of the load whose factor is found; empty: there is none.
    reference: Vec<f64>,
    /// Held unknowns: which, value, and value for one unit of the load whose factor is found.
    held: Vec<(usize, f64, f64)>,
    /// Weights of displacements in what is controlled; empty: nothing is, or they are found.
    row: Vec<(usize, f64)>,
    /// By how much that is to grow from where the step begins.
    amount: f64,
    /// Displacements where the step begins, m.
    begin: Vec<f64>,
    /// See [`Goal::left`].
    left: f64,
    /// What is out of balance at the beginning; empty: not known yet, or of no interest.
    at_first: Vec<f64>,
    /// What one of the factor counts among displacements, m.
    unit: f64,
}

/// How far a trial is from equilibrium.
struct Balance {
    /// load − internal force, N.
    out: Vec<f64>,
    /// Its norm where the structure is free, over all that acts.
    residual: f64,
    /// Whether prescribed and controlled displacements are where they belong.
    rests: bool,
}

impl Failure {
    /// Whether somebody asked the work to stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(self, Self::Cancelled(_) | Self::Solve(SolveError::Cancelled(_)))
    }
}

impl<'s, 'm> March<'s, 'm> {
    /// Starts from a history.
    #[must_use]
    pub fn new(
        structure: &'s System<'m>,
        history: History,
        drive: Drive,
        settings: MarchSettings,
    ) -> Self {
        Self {
            history,
            way: Way {
                structure,
                settings,
                drive,
                system: Equations::new(structure, &settings),
                nonlocal: Nonlocal::new(structure),
                spent: 0.0,
                ahead: Vec::new(),
            },
        }
    }

    /// Whether multigrid did not converge somewhere on the way, so that a factorisation solved
    /// instead.
    #[must_use]
    pub(crate) fn fell_back(&self) -> bool {
        self.way.system.solver.as_ref().is_some_and(Solver::fell_back)
    }

    /// What has solved linear systems so far, by name.
    #[must_use]
    pub(crate) fn solved_by(&self) -> String {
        Vec::from_iter(self.way.system.by.iter().copied()).join(", ")
    }

    /// The last equilibrium; what solved on the way there is let go.
    #[must_use]
    pub(crate) fn into_history(self) -> History {
        self.history
    }

    /// Work so far, as [`MarchSettings::work`] counts it.
    #[must_use]
    pub(crate) fn spent(&self) -> f64 {
        self.way.spent
    }

    /// From now on all steps together, those so far included, may take so much.
    pub(crate) fn limit(&mut self, work: f64) {
        self.way.settings.work = work;
    }

    /// To the time `to`, by as few steps as converge; under [`Drive::Raised`] the controlled
    /// displacement grows by `amount` on the way. `each` hears every equilibrium.
    ///
    /// # Errors
    /// [`Failure`]; the history stays at the last equilibrium.
    pub fn advance(
        &mut self,
        to: f64,
        amount: f64,
        job: &Job,
        mut each: impl FnMut(&History, &Step) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        self.advance_with(to, amount, job, |history, step, _| each(history, step))
    }

    /// The same; `each` may also use the equations, which the next step assembles anew.
    ///
    /// # Errors
    /// As [`March::advance`].
    pub(crate) fn advance_with(
        &mut self,
        to: f64,
        amount: f64,
        job: &Job,
        mut each: impl FnMut(&History, &Step, &mut Equations) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let Self { history, way } = self;
        let (begin, mut done, mut part) = (history.time, 0.0_f64, 1.0_f64);
        while done < 1.0 {
            let next = if done + part > 1.0 - 1e-9 { 1.0 } else { done + part };
            let time = if next == 1.0 { to } else { begin + next * (to - begin) };
            let before = history.born.clone();
            way.structure.bear(history, time);
            let left = if to > begin { 0.0 } else { (1.0 - next) / (1.0 - done) };
            let amount = (next - done) * amount;
            let goal = Goal { time, amount, left, growth: None, patience: PATIENCE };
            let mut tried = way.attempt(history, &goal, job);
            if matches!(tried, Ok(Err(_))) && part <= way.settings.jump {
                tried = way.avalanche(history, &goal, job);
            }
            match tried.map_err(|why| way.structure.labelled(why))? {
                Ok((found, step)) => {
                    way.look_ahead(history, &found);
                    *history = found;
                    each(history, &step, &mut way.system)?;
                    done = next;
                    // Easy steps may grow again.
                    part = if step.avalanche > 0 || step.iterations <= way.settings.iterations / 3 {
                        2.0 * part
                    } else {
                        part
                    };
                }
                Err(why) => {
                    history.born = before;
                    part = 0.5 * (next - done);
                    if part < 0.5_f64.powi(way.settings.cuts as i32) {
                        return Err(way.stuck(time, &why));
                    }
                    tracing::debug!(
                        "step to {time:.4e} s cut to {part:.2e}: residual {:.1e}",
                        why.residual
                    );
                }
            }
        }
        Ok(())
    }
}

impl Way<'_, '_> {
    /// A step whose cracks jump: several states would be in equilibrium, and the iteration wanders
    /// between them. So time passes first while damage stands still, then cracks grow while time
    /// does: in each of many equilibria with given damage that point's grows most which is most
    /// beyond what it can carry, and none heals, until the iteration finds what is left. In the
    /// limit of small growth this is the overdamped motion of the structure from one equilibrium to
    /// the next (cf. sequentially linear analysis, Rots and Invernizzi 2004).
    fn avalanche(&mut self, history: &History, goal: &Goal, job: &Job) -> Attempt {
        let passed = Goal { growth: Some(0.0), patience: self.settings.iterations, ..*goal };
        let (mut history, mut step) = match self.attempt(history, &passed, job)? {
            Ok(done) => done,
            Err(why) => return Ok(Err(why)),
        };
        let (mut calm, mut why) = (CALM, Unbalanced { residual: f64::INFINITY, worst: 0 });
        let found = Goal { amount: 0.0, growth: None, patience: PATIENCE, ..*goal };
        for equilibria in 1..=COLLAPSE {
            let excess = history.excess();
            // Given damage is as good as found.
            if excess.max(step.residual) <= self.settings.tolerance {
                return Ok(Ok((history, Step { avalanche: equilibria, ..step })));
            }
            if excess < calm {
                match self.attempt(&history, &found, job)? {
                    Ok((history, last)) => {
                        let linear = step.linear + last.linear;
                        return Ok(Ok((history, Step { linear, avalanche: equilibria, ..last })));
                    }
                    Err(still) => (why, calm) = (still, 0.5 * excess),
                }
            }
            let grown = Goal { amount: 0.0, growth: Some((GROWTH / excess).min(1.0)), ..passed };
            match self.attempt(&history, &grown, job)? {
                Ok((found, one)) => {
                    history = found;
                    step = Step { linear: step.linear + one.linear, ..one };
                }
                Err(why) => return Ok(Err(why)),
            }
        }
        Ok(Err(why))
    }

    /// Keeps the direction in which a step went.
    fn look_ahead(&mut self, from: &History, to: &History) {
        let is_arc = matches!(self.drive, Drive::Raised { control: Control::Arc, .. });
        let moved: Vec<f64> = to.x.iter().zip(&from.x).map(|(b, a)| b - a).collect();
        let length = norm(&moved);
        if is_arc && length > 0.0 {
            self.ahead = moved.into_iter().map(|x| x / length).collect();
        }
    }

    fn stuck(&self, time: f64, why: &Unbalanced) -> Failure {
        let (node, axis) = ((why.worst / 3) as u32, why.worst % 3);
        let (node, quantity) = match self.structure.rotations.owner(node) {
            Some(owner) => {
                (owner, ["the moment about x", "the moment about y", "the moment about z"][axis])
            }
            None => (node, ["the force along x", "the force along y", "the force along z"][axis]),
        };
        let node = self.structure.model.mesh.node_name(node);
        Failure::NotConverged {
            time,
            quantity,
            node,
            residual: why.residual,
            tolerance: self.settings.tolerance,
        }
    }

    /// One step. The inner error: not to be had in one.
    fn attempt(&mut self, history: &History, goal: &Goal, job: &Job) -> Attempt {
        let &Goal { time, growth, patience, .. } = goal;
        let Self { structure, settings, drive, system, nonlocal, spent, ahead } = self;
        system.stays = structure.keeps_stiffness() && !history.turned;
        let warmth = structure.warmth([history.time, time]);
        let (trial, mut field) = (
            Trial { time, warmth: &warmth, growth, hold: HOLD, ..Trial::still(history, &warmth) },
            history.nonlocal.clone(),
        );
        let tolerance =
            if growth.is_some() { settings.tolerance.max(GIVEN) } else { settings.tolerance };
        let mut aim = Aim::new(structure, drive, history, goal, ahead)?;
        let (mut x, mut factor, mut force) = (history.x.clone(), history.factor, Vec::new());
        let (mut scale, mut linear, mut best, mut earlier) = (0.0, 0, f64::INFINITY, f64::INFINITY);
        let mut anderson = Anderson::default();
        for iteration in 0.. {
            let smoothed = match nonlocal {
                Some(nonlocal) => nonlocal
                    .solve(structure, Trial { nonlocal: &field, ..trial }, &x, job)
                    .map(|found| field = found),
                None => Ok(()),
            };
            let trial = Trial { nonlocal: &field, ..trial };
            match smoothed
                .and_then(|()| structure.assemble(trial, &x, &mut system.matrix, &mut force, job))
            {
                Ok(()) => {}
                // A trial far from equilibrium may leave the numbers: a smaller step will not.
                Err(Failure::Element { source: ElementError::NotFinite, .. }) if iteration > 0 => {
                    return Ok(Err(Unbalanced { residual: f64::INFINITY, worst: 0 }));
                }
                Err(other) => return Err(other),
            }
            let balance = aim.balance(&x, factor, &force, &mut scale);
            let residual = balance.residual;
            let enough =
                tolerance * if iteration == settings.iterations { settings.loose } else { 1.0 };
            if residual <= enough && balance.rests {
                let step =
                    Step { time, factor, iterations: iteration, linear, residual, avalanche: 0 };
                return Ok(Ok((structure.commit(trial, x, factor, force)?, step)));
            }
            let unbalanced = |aim: &Aim| Unbalanced { residual, worst: aim.worst(&balance.out) };
            let diverges =
                !residual.is_finite() || (iteration > 3 && residual > 1e3 * f64::max(best, 1e-3));
            let stalls = iteration > 0
                && iteration % patience == 0
                && best > 0.5 * std::mem::replace(&mut earlier, best);
            if (stalls || iteration == settings.iterations)
                && residual <= settings.floor
                && balance.rests
            {
                let step =
                    Step { time, factor, iterations: iteration, linear, residual, avalanche: 0 };
                return Ok(Ok((structure.commit(trial, x, factor, force)?, step)));
            }
            if iteration == settings.iterations || diverges || stalls {
                return Ok(Err(unbalanced(&aim)));
            }
            if residual > 4.0 * best {
                anderson.restart();
            }
            // Before prescribed displacements are where they belong, forces are still in the
            // balance of the step before. Where a displacement is controlled indirectly that
            // balance counts, so that the acceleration begins anew and anew: its factor leads it
            // astray where little stress is left.
            if balance.rests || !aim.reference.is_empty() {
                best = best.min(residual);
            }
            match system.correct(structure, &mut aim, &balance.out, &x, factor, job) {
                Ok((step, iterations)) => {
                    linear += iterations;
                    *spent += (iterations as f64 + ASSEMBLY) * structure.unknowns() as f64;
                    if *spent > settings.work {
                        return Err(Failure::Laborious);
                    }
                    // The factor goes along as one more unknown, on the scale of displacements.
                    x.push(factor * aim.unit);
                    let step = if iteration == 0 { step } else { anderson.improve(&x, step) };
                    add(&mut x, 1.0, &step);
                    factor = x.pop().map_or(factor, |scaled| scaled / aim.unit);
                }
                // Past a limit point, or a trial that went astray.
                Err(Failure::Solve(
                    SolveError::Indefinite { .. }
                    | SolveError::NotConverged { .. }
                    | SolveError::Singular { .. }
                    | SolveError::Floating { .. },
                )) if iteration > 0 => {
                    return Ok(Err(unbalanced(&aim)));
                }
                Err(other) => return Err(other),
            }
        }
        unreachable!("the last iteration returns")
    }
}

impl Aim {
    fn new(
        structure: &System,
        drive: &Drive,
        history: &History,
        goal: &Goal,
        ahead: &[f64],
    ) -> Result<Self, Failure> {
        let &Goal { time, amount, left, .. } = goal;
        let mut held: Vec<_> = structure
            .prescribed(time)
            .into_iter()
            .map(|(n, c, v)| (unknown(n, c), v, 0.0))
            .collect();
        let (mut reference, mut row) = (Vec::new(), Vec::new());
        if let Drive::Raised { loads, control } = drive {
            reference = vec![0.0; structure.unknowns()];
            for &(load, share) in loads {
                let action = &structure.model.loads[load].action;
                structure.add_load(action, share, time, &mut reference)?;
                if let Action::Displacement(values) = action {
                    held.extend(values.iter().map(|&(n, c, v)| (unknown(n, c), 0.0, share * v)));
                }
            }
            row = match control {
                Control::Row(row) => row.iter().map(|&(n, c, w)| (unknown(n, c), w)).collect(),
                Control::Arc => ahead.iter().copied().enumerate().collect(),
            };
        }
        // What several loads prescribe for one displacement adds up.
        held.sort_by_key(|h| h.0);
        held.dedup_by(|b, a| {
            let same = a.0 == b.0 && (a.2 != 0.0 || b.2 != 0.0);
            if same {
                (a.1, a.2) = (a.1 + b.1, a.2 + b.2);
            }
            same
        });
        held.iter_mut().for_each(|h| h.1 += left * (history.x[h.0] - h.1 - history.factor * h.2));
        Ok(Self {
            given: structure.loads(time)?,
            pressing: structure.pressing(time)?,
            reference,
            held,
            row,
            amount,
            begin: history.x.clone(),
            left,
            at_first: Vec::new(),
            unit: if amount == 0.0 { 1e-3 } else { amount.abs() },
        })
    }

    /// How much is missing of what the controlled displacement is to grow by.
    fn missing(&self, x: &[f64]) -> f64 {
        let controlled = |x: &[f64]| self.row.iter().map(|&(i, w)| w * x[i]).sum::<f64>();
        controlled(&self.begin) + self.amount - controlled(x)
    }

    /// What is out of balance at `x`; `scale` keeps the largest of all that has acted in this step.
    fn balance(&mut self, x: &[f64], factor: f64, force: &[f64], scale: &mut f64) -> Balance {
        let acting: Vec<f64> = (0..x.len())
            .map(|i| self.given[i] + self.reference.get(i).map_or(0.0, |r| factor * r))
            .collect();
        let mut out: Vec<f64> = acting.iter().zip(force).map(|(a, f)| a - f).collect();
        if self.left > 0.0 {
            if self.at_first.is_empty() {
                self.at_first.clone_from(&out);
            }
            out.iter_mut().zip(&self.at_first).for_each(|(out, first)| *out -= self.left * first);
        }
        let mut free = out.clone();
        self.held.iter().for_each(|h| free[h.0] = 0.0);
        // What supports bear counts as acting, and what the ground presses with; so does what is
        // out of balance at first, where nothing else acts (heat, shrinkage).
        let reactions: Vec<f64> = out.iter().zip(&free).map(|(all, free)| all - free).collect();
        let free = norm(&free);
        *scale = scale
            .max(norm(&acting))
            .max(norm(&reactions))
            .max(self.pressing)
            .max(if *scale == 0.0 { free } else { 0.0 });
        let size = x.iter().fold(1e-15_f64, |m, x| m.max(x.abs()));
        let at_ease = |distance: f64| distance.abs() <= 1e-9 * size;
        let rests =
            self.held.iter().all(|&(i, v, by_factor)| at_ease(v + factor * by_factor - x[i]))
                && (self.reference.is_empty()
                    || (!self.row.is_empty() && at_ease(self.missing(x))));
        Balance { out, residual: if *scale > 0.0 { free / *scale } else { 0.0 }, rests }
    }

    /// Where the largest unbalanced force is that no support bears.
    fn worst(&self, out: &[f64]) -> usize {
        let mut out = out.to_vec();
        self.held.iter().for_each(|h| out[h.0] = 0.0);
        (0..out.len()).max_by(|&a, &b| out[a].abs().total_cmp(&out[b].abs())).unwrap_or(0)
    }

    /// Constraints that take every held unknown to `to(value, value of one unit)`, from where it
    /// is.
    fn constraints(
        &self,
        nodes: usize,
        to: impl Fn(usize, f64, f64) -> f64,
    ) -> Result<Constraints<3>, Failure> {
        let mut constraints = Constraints::new(nodes);
        for &(i, value, by_factor) in &self.held {
            constraints.fix(i / 3, i % 3, to(i, value, by_factor))?;
        }
        Ok(constraints)
    }
}

impl Equations {
    /// Nothing is assembled yet.
    pub(crate) fn new(structure: &System, settings: &MarchSettings) -> Self {
        Self {
            matrix: structure.matrix(),
            solver: None,
            stays: false,
            method: settings.method,
            tolerance: settings.linear,
            by: BTreeSet::new(),
        }
    }

    /// One correction K δx = out, and of the factor that is found so much that the controlled sum
    /// reaches its goal (last entry, in units). Iterations of the linear solver.
    fn correct(
        &mut self,
        structure: &System,
        aim: &mut Aim,
        out: &[f64],
        x: &[f64],
        factor: f64,
        job: &Job,
    ) -> Result<(Vec<f64>, usize), Failure> {
        let nodes = structure.unknowns() / 3;
        let constraints =
            aim.constraints(nodes, |i, value, by_factor| value + factor * by_factor - x[i])?;
        match &mut self.solver {
            Some(_) if self.stays => {}
            Some(solver) => solver.update(&self.matrix, &constraints, job)?,
            None => self.solver = Some(Solver::new(&self.matrix, &constraints, self.method, job)?),
        }
        let Some(solver) = &mut self.solver else { return Ok((vec![0.0; x.len() + 1], 0)) };
        let change = solver.solve(&self.matrix, out, &constraints, self.tolerance, job)?;
        self.by.insert(change.method);
        let (mut step, mut linear) = (change.x, change.iterations);
        if aim.reference.is_empty() {
            step.push(0.0);
            return Ok((step, linear));
        }
        // Displacements that one more of the reference load brings.
        let unit = aim.constraints(nodes, |_, _, by_factor| by_factor)?;
        let along = solver.solve(&self.matrix, &aim.reference, &unit, self.tolerance, job)?;
        linear += along.iterations;
        if aim.row.is_empty() {
            let length = norm(&along.x);
            aim.row = along.x.iter().map(|x| x / length).enumerate().collect();
        }
        let dot = |x: &[f64]| aim.row.iter().map(|&(i, w)| w * x[i]).sum::<f64>();
        let more = Some((aim.missing(x) - dot(&step)) / dot(&along.x))
            .filter(|more| more.is_finite())
            .unwrap_or(0.0);
        add(&mut step, more, &along.x);
        step.push(more * aim.unit);
        Ok((step, linear))
    }
}

/// The number of a component of a node.
fn unknown(node: u32, component: u8) -> usize {
    3 * node as usize + usize::from(component)
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn add(x: &mut [f64], factor: f64, dx: &[f64]) {
    x.iter_mut().zip(dx).for_each(|(x, dx)| *x += factor * dx);
}
