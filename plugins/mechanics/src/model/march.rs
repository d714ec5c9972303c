//! From one equilibrium to the next: Newton's iteration, smaller steps where it does not converge, and control of a displacement
//! instead of a load where the structure softens (de Borst 1987).

use intrados_stage::{Cancelled, Job};

use super::{Action, History, Structure, Trial};
use crate::{
    element::ElementError,
    mesh::MeshError,
    sparse::{BlockMatrix, Constraints, Method, SolveError, Solver},
};

/// How to march.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest |load − internal force| over all that acts at which a step counts as in equilibrium.
    pub tolerance: f64,
    /// Iterations of a step before it is cut.
    pub iterations: usize,
    /// How often a step may be halved.
    pub cuts: u32,
    /// How linear systems are solved.
    pub method: Method,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-6, iterations: 40, cuts: 8, method: Method::Auto }
    }
}

/// What is given along the way.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Drive {
    /// The loads, by their histories.
    #[default]
    Loads,
    /// A weighted sum of displacements (an opening, a deflection): the factor of one load is found, all others follow their histories.
    Indirect {
        /// Which load, of [`super::Model::loads`].
        load: usize,
        /// Node, component, weight.
        row: Vec<(u32, u8, f64)>,
    },
}

/// One step that has converged.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// s.
    pub time: f64,
    /// Of the load that is found ([`Drive::Indirect`]).
    pub factor: f64,
    /// Newton iterations.
    pub iterations: usize,
    /// Iterations of the linear solver, in all.
    pub linear: usize,
    /// |load − internal force| over all that acts.
    pub residual: f64,
}

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
    /// An element cannot answer.
    #[error("{element}: {source}")]
    Element {
        /// Its name.
        element: String,
        /// Why.
        source: ElementError,
    },
    /// The linear system has no solution.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Steps became too small.
    #[error("no equilibrium at {time:.6e} s even in steps of {step:.1e} s: {quantity} of {node} is {residual:.1e} of all that acts, and {tolerance:.1e} is allowed")]
    NotConverged {
        /// Where it was to go, s.
        time: f64,
        /// Last step tried, s.
        step: f64,
        /// What is out of balance.
        quantity: &'static str,
        /// Where it is worst.
        node: String,
        /// How much.
        residual: f64,
        /// How much is allowed.
        tolerance: f64,
    },
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A structure on its way.
pub struct March<'s, 'm> {
    structure: &'s Structure<'m>,
    settings: Settings,
    drive: Drive,
    /// The last equilibrium.
    pub history: History,
    matrix: BlockMatrix<3>,
    solver: Option<Solver<3>>,
}

/// Forces that were found not to balance.
struct Unbalanced {
    residual: f64,
    worst: usize,
}

impl<'s, 'm> March<'s, 'm> {
    /// Starts from a history.
    #[must_use]
    pub fn new(structure: &'s Structure<'m>, history: History, drive: Drive, settings: Settings) -> Self {
        Self { structure, settings, drive, history, matrix: structure.matrix(), solver: None }
    }

    /// To the time `to`, by as few steps as converge; under [`Drive::Indirect`] the controlled sum of displacements grows by `amount` on
    /// the way. `each` hears every equilibrium.
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
        let (begin, mut done, mut part) = (self.history.time, 0.0_f64, 1.0_f64);
        while done < 1.0 {
            let next = if done + part > 1.0 - 1e-9 { 1.0 } else { done + part };
            let time = if next == 1.0 { to } else { begin + next * (to - begin) };
            let born = self.history.born.len();
            let before = self.history.born.clone();
            self.structure.bear(&mut self.history, time);
            match self.attempt(time, (next - done) * amount, job)? {
                Ok((history, step)) => {
                    self.history = history;
                    each(&self.history, &step)?;
                    done = next;
                    // Easy steps may grow again.
                    part = if step.iterations <= self.settings.iterations / 3 { 2.0 * part } else { part };
                }
                Err(why) => {
                    if self.history.born.len() != born {
                        self.history.born = before;
                    }
                    part = 0.5 * (next - done);
                    if part < 0.5_f64.powi(self.settings.cuts as i32) {
                        return Err(self.stuck(time, part * (to - begin), &why));
                    }
                    tracing::debug!("step to {time:.4e} s cut to {part:.2e}: residual {:.1e}", why.residual);
                }
            }
        }
        Ok(())
    }

    fn stuck(&self, time: f64, step: f64, why: &Unbalanced) -> Failure {
        let node = self.structure.model.mesh.node_name((why.worst / 3) as u32);
        let quantity = ["the force along x", "the force along y", "the force along z"][why.worst % 3];
        Failure::NotConverged { time, step, quantity, node, residual: why.residual, tolerance: self.settings.tolerance }
    }

    /// One step. The inner error: not to be had in one.
    fn attempt(&mut self, time: f64, amount: f64, job: &Job) -> Result<Result<(History, Step), Unbalanced>, Failure> {
        let structure = self.structure;
        let apart = match &self.drive {
            Drive::Loads => None,
            Drive::Indirect { load, .. } => Some(*load),
        };
        let warmth = structure.warmth(time);
        let trial = Trial { history: &self.history, time, warmth: &warmth };
        let given = structure.loads(time, apart)?;
        let prescribed = structure.prescribed(time, apart);
        let reference = apart.map(|load| self.reference(load, time)).transpose()?;
        let (mut x, mut factor, mut force) = (self.history.x.clone(), self.history.factor, Vec::new());
        let goal = self.controlled(&x) + amount;
        let (mut scale, mut linear, mut last) = (0.0_f64, 0, f64::INFINITY);
        for iteration in 0..=self.settings.iterations {
            job.step(iteration, self.settings.iterations)?;
            match structure.assemble(trial, &x, &mut self.matrix, &mut force, job) {
                Ok(()) => {}
                // A trial far from equilibrium may fold an element or leave the numbers: a smaller step will not.
                Err(Failure::Element { source: ElementError::NotFinite, .. }) if iteration > 0 => {
                    return Ok(Err(Unbalanced { residual: f64::INFINITY, worst: 0 }));
                }
                Err(other) => return Err(other),
            }
            let constraints = self.steps_of_constraints(&prescribed, apart, factor, &x)?;
            let acting = |i: usize| given[i] + reference.as_ref().map_or(0.0, |r| factor * r[i]);
            let out: Vec<f64> = (0..x.len()).map(|i| acting(i) - force[i]).collect();
            let (free, held) = self.split(&out, &prescribed);
            scale = scale.max((0..x.len()).map(|i| acting(i).powi(2)).sum::<f64>().sqrt()).max(held).max(if iteration == 0 { free } else { 0.0 });
            let residual = if scale > 0.0 { free / scale } else { 0.0 };
            let rests = self.rests(&constraints, goal, &x, scale);
            if residual <= self.settings.tolerance && rests {
                let step = Step { time, factor, iterations: iteration, linear, residual };
                return Ok(Ok((structure.commit(trial, x, factor, force)?, step)));
            }
            let diverges = !residual.is_finite() || (iteration > 3 && residual > 1e3 * last.max(1e-3));
            if iteration == self.settings.iterations || diverges {
                let worst = self.worst(&out, &prescribed);
                return Ok(Err(Unbalanced { residual, worst }));
            }
            last = last.min(residual);
            linear += match self.correct(&mut x, &mut factor, &out, &constraints, reference.as_deref(), apart, goal, job) {
                Ok(iterations) => iterations,
                // Past a limit point, or a trial that went astray.
                Err(Failure::Solve(SolveError::Indefinite { .. } | SolveError::NotConverged { .. } | SolveError::Singular { .. })) if iteration > 0 => {
                    return Ok(Err(Unbalanced { residual, worst: self.worst(&out, &prescribed) }));
                }
                Err(other) => return Err(other),
            };
        }
        unreachable!("the last iteration returns")
    }

    /// One correction K δx = out, with δλ such that the controlled sum reaches its goal. Iterations of the linear solver.
    fn correct(
        &mut self,
        x: &mut [f64],
        factor: &mut f64,
        out: &[f64],
        constraints: &Constraints<3>,
        reference: Option<&[f64]>,
        apart: Option<usize>,
        goal: f64,
        job: &Job,
    ) -> Result<usize, Failure> {
        match &mut self.solver {
            Some(solver) => solver.update(&self.matrix, constraints, job)?,
            None => self.solver = Some(Solver::new(&self.matrix, constraints, self.settings.method, job)?),
        }
        let tolerance = (0.01 * self.settings.tolerance).clamp(1e-12, 1e-6);
        let Some(solver) = &mut self.solver else { return Ok(0) };
        let change = solver.solve(&self.matrix, out, constraints, tolerance, job)?;
        let mut linear = change.iterations;
        x.iter_mut().zip(&change.x).for_each(|(x, dx)| *x += dx);
        if let (Some(reference), Some(load)) = (reference, apart) {
            // The displacements that one more of the reference load brings.
            let unit = unit_constraints(self.structure, load)?;
            let Some(solver) = &mut self.solver else { return Ok(0) };
            let along = solver.solve(&self.matrix, reference, &unit, tolerance, job)?;
            linear += along.iterations;
            let (missing, slope) = (goal - self.controlled(x), self.controlled(&along.x));
            let step = missing / slope;
            if step.is_finite() {
                x.iter_mut().zip(&along.x).for_each(|(x, dx)| *x += step * dx);
                *factor += step;
            }
        }
        Ok(linear)
    }

    /// Forces of a load at factor 1.
    fn reference(&self, load: usize, time: f64) -> Result<Vec<f64>, Failure> {
        let mut sum = vec![0.0; self.structure.unknowns()];
        self.structure.add_load(&self.structure.model.loads[load].action, 1.0, time, &mut sum)?;
        Ok(sum)
    }

    /// From where the held unknowns are to where they belong.
    fn steps_of_constraints(
        &self,
        prescribed: &[(u32, u8, f64)],
        apart: Option<usize>,
        factor: f64,
        x: &[f64],
    ) -> Result<Constraints<3>, Failure> {
        let mut all = prescribed.to_vec();
        if let Some(Action::Displacement(values)) = apart.map(|load| &self.structure.model.loads[load].action) {
            // They were counted as 0; their factor is being found.
            for entry in &mut all {
                if let Some(v) = values.iter().find(|v| (v.0, v.1) == (entry.0, entry.1)) {
                    entry.2 = factor * v.2;
                }
            }
        }
        self.structure.constraints(&all, x)
    }

    /// Norms of what is out of balance where the structure is free, and where it is held (reactions).
    fn split(&self, out: &[f64], prescribed: &[(u32, u8, f64)]) -> (f64, f64) {
        let all: f64 = out.iter().map(|r| r * r).sum();
        let mut held: Vec<usize> = prescribed.iter().map(|p| 3 * p.0 as usize + usize::from(p.1)).collect();
        held.sort_unstable();
        held.dedup();
        let held: f64 = held.into_iter().map(|i| out[i] * out[i]).sum();
        ((all - held).max(0.0).sqrt(), held.sqrt())
    }

    /// Whether every prescribed displacement is where it belongs.
    fn rests(&self, constraints: &Constraints<3>, goal: f64, x: &[f64], scale: f64) -> bool {
        let size = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let controlled = match self.drive {
            Drive::Loads => true,
            Drive::Indirect { .. } => (goal - self.controlled(x)).abs() <= 1e-9 * goal.abs().max(1e-12),
        };
        let _ = scale;
        controlled && constraints.largest_value() <= 1e-9 * size.max(1e-15)
    }

    /// Where the largest unbalanced force is that no support bears.
    fn worst(&self, out: &[f64], prescribed: &[(u32, u8, f64)]) -> usize {
        let mut out = out.to_vec();
        prescribed.iter().for_each(|p| out[3 * p.0 as usize + usize::from(p.1)] = 0.0);
        (0..out.len()).max_by(|&a, &b| out[a].abs().total_cmp(&out[b].abs())).unwrap_or(0)
    }

    /// The controlled sum of displacements.
    fn controlled(&self, x: &[f64]) -> f64 {
        match &self.drive {
            Drive::Loads => 0.0,
            Drive::Indirect { row, .. } => row.iter().map(|&(node, component, w)| w * x[3 * node as usize + usize::from(component)]).sum(),
        }
    }
}

/// Held unknowns at what one unit of a load prescribes of them.
fn unit_constraints(structure: &Structure, load: usize) -> Result<Constraints<3>, Failure> {
    let mut all: Vec<_> = structure.prescribed(0.0, None).into_iter().map(|(node, component, _)| (node, component, 0.0)).collect();
    if let Action::Displacement(values) = &structure.model.loads[load].action {
        for entry in &mut all {
            if let Some(v) = values.iter().find(|v| (v.0, v.1) == (entry.0, entry.1)) {
                entry.2 = v.2;
            }
        }
    }
    structure.constraints(&all, &vec![0.0; structure.unknowns()])
}
