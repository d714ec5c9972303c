//! Steps to displacements and stresses: T ᵀ K T q = Tᵀ (f − K c), factorised.

use std::collections::HashMap;

use glam::DVec3;
use intrados_stage::{Cancelled, Job};

use super::{
    constraint::{Bound, Equation, Sum},
    element::{Element, Folded, Warmth},
    free::Free,
    heat,
    model::{Deck, Procedure, Step},
    modes,
};
use crate::{
    sparse::{BlockMatrix, Constraints, Method, SolveError, solve},
    tensor::{self, Voigt},
};

/// What a step ends in.
#[derive(Debug, Clone, Default)]
pub struct Solved {
    /// Its name.
    pub name: String,
    /// Of the nodes that the deck names, m.
    pub displacements: Vec<DVec3>,
    /// Pa at every point of every element.
    pub stresses: Vec<Vec<Voigt>>,
    /// Of the nodes that the deck names, where the step is one of heat.
    pub temperatures: Vec<f64>,
    /// The smallest, ascending: squares of angular frequencies, 1/s²; factors at which loads buckle.
    pub eigenvalues: Vec<f64>,
    /// Unknowns that were solved for.
    pub unknowns: usize,
}

/// Why a step has no solution. One line.
#[derive(Debug, thiserror::Error)]
pub enum LinearError {
    /// Supports and equations say two things.
    #[error("{step}: the support or equation of line {line} contradicts those before it")]
    Contradiction {
        /// Name of the step.
        step: String,
        /// Line of the deck; 0: of a beam or a shell.
        line: u32,
    },
    /// An element that is flat or turned inside out.
    #[error("element {0} is flat, folded, or its nodes are in the wrong order")]
    Folded(u32),
    /// A force where nothing resists.
    #[error("{step}: a force or a moment acts on node {node} in a way that no element resists")]
    Idle {
        /// Name of the step.
        step: String,
        /// Number of the node.
        node: u32,
    },
    /// Weight of what has none.
    #[error("{step}: weight acts on element {element}, whose material {material} has no *DENSITY")]
    Weightless {
        /// Name of the step.
        step: String,
        /// Number of the element.
        element: u32,
        /// Its material.
        material: String,
    },
    /// Parts that nothing holds.
    #[error(
        "{step}: a part of the model can move freely: hold it by supports (of a deck *BOUNDARY, *EQUATION or *TIE)"
    )]
    Floating {
        /// Name of the step.
        step: String,
    },
    /// Temperatures that nothing ties to anything.
    #[error(
        "{step}: a part of the model has no temperature to settle at: hold one by *BOUNDARY, or give it a *FILM"
    )]
    Adrift {
        /// Name of the step.
        step: String,
    },
    /// Modes of something that its stresses make unstable.
    #[error(
        "{step}: the stresses before it are beyond buckling: there are no vibrations about them"
    )]
    Unstable {
        /// Name of the step.
        step: String,
    },
    /// Temperatures or modes that do not settle.
    #[error("{step}: {what} do not converge")]
    NotConverged {
        /// Name of the step.
        step: String,
        /// What.
        what: &'static str,
    },
    /// The equations could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl LinearError {
    /// What a step does not come to an end with.
    pub(super) fn unsettled(step: &Step, what: &'static str) -> Self {
        Self::NotConverged { step: step.name.clone(), what }
    }
}

/// ‖f − K u‖ / ‖f‖ of a solution: slender solids of millions of entries lose six digits of sixteen,
/// and a part that nothing holds all of them.
const TOLERANCE: f64 = 1e-6;

/// What the steps before leave to the next.
#[derive(Default)]
struct Past {
    /// Of every unknown; empty before the first step.
    displacements: Vec<f64>,
    stresses: Vec<Vec<Voigt>>,
    /// Of every node.
    temperatures: Vec<f64>,
}

impl Past {
    /// Before the first step.
    fn of(deck: &Deck) -> Self {
        Self { temperatures: deck.cold.clone(), ..Self::default() }
    }
}

impl Deck {
    /// Computes every step: what it ends in.
    ///
    /// # Errors
    /// [`LinearError`].
    pub fn solve(&self, job: &Job) -> Result<Vec<Solved>, LinearError> {
        let mut past = Past::of(self);
        let share = self.steps.len() as f64;
        let mut solved = Vec::new();
        for (i, step) in self.steps.iter().enumerate() {
            job.step(i, self.steps.len())?;
            let part = job.part(i as f64 / share, (i + 1) as f64 / share);
            solved.push(self.step(step, &mut past, &part)?);
        }
        Ok(solved)
    }

    fn step(&self, step: &Step, past: &mut Past, job: &Job) -> Result<Solved, LinearError> {
        match step.procedure {
            Procedure::Modes { count, stressed } => {
                let system = System::new(self, step, past)?;
                let stresses = if stressed { past.stresses.as_slice() } else { &[] };
                Ok(system.eigenvalues(system.vibrating(count, stresses, job)?))
            }
            Procedure::Buckling { count } => {
                let system = System::new(self, step, past)?;
                Ok(system.eigenvalues(system.buckling(count, job)?))
            }
            Procedure::Heat { steady, first, duration } => {
                let time = (!steady).then_some([first, duration]);
                heat::solve(self, step, time, &mut past.temperatures, job)
            }
            Procedure::Static => System::new(self, step, past)?.solve(past, job),
        }
    }

    /// What is held in a step, then what binds the rest.
    fn constraints(&self, step: &Step, past: &Past) -> Vec<Equation> {
        let equation = |(node, component), value| Equation {
            terms: self.component(node, component),
            value,
            line: 0,
        };
        let held = step.held.iter().map(|(&at, &value)| equation(at, value));
        let kept = step.kept.iter().map(|&(node, component)| {
            let place = |&(u, f): &(u32, f64)| past.displacements.get(u as usize).map(|d| f * d);
            let terms = self.component(node, component);
            equation((node, component), terms.iter().filter_map(place).sum())
        });
        let later = self.later.iter().filter(|l| l.0 <= step.number).map(|l| &l.1);
        let own = self.equations.iter().enumerate().map(|(i, equation)| {
            // What holds no more says nothing.
            let is_over = self.until.get(&i).is_some_and(|until| *until <= step.number);
            let nothing = || Equation { terms: Vec::new(), value: 0.0, line: equation.line };
            if is_over { nothing() } else { equation.clone() }
        });
        held.chain(kept).chain(own).chain(later.cloned()).collect()
    }
}

/// A step and its constraints.
struct System<'a> {
    deck: &'a Deck,
    step: &'a Step,
    /// Temperature of every node.
    warm: Vec<f64>,
    /// What is solved for, by elements and after them by springs.
    free: Free<'a>,
}

impl<'a> System<'a> {
    fn new(deck: &'a Deck, step: &'a Step, past: &Past) -> Result<Self, LinearError> {
        let sums = sums(deck, step, &deck.constraints(step, past))?;
        let warm = if step.warm.is_empty() { &past.temperatures } else { &step.warm };
        let count = deck.cells.len() + deck.springs.len();
        let elements = (0..count).map(|e| unknowns(deck, e));
        let free = Free::new(deck, sums, elements, |unknown| unknown / 3);
        Ok(Self { deck, step, warm: warm.clone(), free })
    }

    /// Temperatures of the nodes of an element.
    fn warmth(&self, e: usize) -> Warmth {
        let of = |all: &[f64]| self.deck.cells[e].nodes.iter().map(|&n| all[n as usize]).collect();
        Warmth { now: of(&self.warm), cold: of(&self.deck.cold) }
    }

    fn initial(&self, e: usize) -> impl Fn(usize) -> Voigt + '_ {
        move |p| self.deck.stress.get(&(e as u32, p as u32)).copied().unwrap_or(tensor::ZERO)
    }

    fn element(&self, e: usize) -> Element<'a> {
        Element::new(self.deck, e)
    }

    /// Stiffness and forces of every element, and the stiffness of every spring.
    fn stiffness(&self, job: &Job) -> Result<(BlockMatrix<1>, Vec<f64>), LinearError> {
        let loads = self.distributed()?;
        self.assembled(job, |e, k, f| match e.checked_sub(self.deck.cells.len()) {
            None => {
                let (element, warmth) = (self.element(e), self.warmth(e));
                element.stiffness(&warmth, self.initial(e), k, f)?;
                loads.add(e, &element, &warmth, f)
            }
            Some(spring) => {
                self.deck.springs[spring].resist(k);
                Ok(())
            }
        })
    }

    fn mass(&self, job: &Job) -> Result<(BlockMatrix<1>, Vec<f64>), LinearError> {
        let cells = self.deck.cells.len();
        self.assembled(job, |e, m, _| {
            if e >= cells {
                return Ok(());
            }
            self.element(e).mass(&self.warmth(e), m)
        })
    }

    /// Tᵀ K T and Tᵀ (f − K c) of what `fill` says of elements and springs.
    fn assembled(
        &self,
        job: &Job,
        fill: impl Fn(usize, &mut [f64], &mut [f64]) -> Result<(), Folded> + Sync,
    ) -> Result<(BlockMatrix<1>, Vec<f64>), LinearError> {
        self.free.assembled(job, |e| unknowns(self.deck, e), fill)
    }

    fn solve(self, past: &mut Past, job: &Job) -> Result<Solved, LinearError> {
        let all = self.moved(job)?;
        let solved = self.finish_step(&all)?;
        past.displacements = all;
        past.stresses.clone_from(&solved.stresses);
        Ok(solved)
    }

    /// Displacements of the nodes that the deck names, and stresses, from those of every unknown.
    fn finish_step(&self, all: &[f64]) -> Result<Solved, LinearError> {
        let places: Vec<DVec3> =
            all.as_chunks::<3>().0.iter().copied().map(DVec3::from_array).collect();
        let displacement = |n: u32| match self.deck.means.get(&n) {
            None => places[n as usize],
            Some(mean) => mean.iter().map(|&(m, share)| share * places[m as usize]).sum(),
        };
        let displacements = (0..self.deck.labels.len() as u32).map(displacement).collect();
        let (name, unknowns) = (self.step.name.clone(), self.free.count());
        let stresses = self.stresses(all)?;
        Ok(Solved { name, displacements, stresses, unknowns, ..Solved::default() })
    }

    /// Displacements of every unknown.
    fn moved(&self, job: &Job) -> Result<Vec<f64>, LinearError> {
        let (matrix, mut rhs) = self.stiffness(job)?;
        self.nodal(&mut rhs)?;
        let none = Constraints::new(self.free.count());
        let solution = if rhs.is_empty() {
            Vec::new()
        } else {
            let found = solve(&matrix, &rhs, &none, Method::Direct, TOLERANCE, job);
            let found = found.map_err(|e| self.explained(e))?;
            if found.negative_eigenvalues > 0 {
                return Err(self.floating());
            }
            found.x
        };
        Ok(self.free.expanded(&solution))
    }

    fn floating(&self) -> LinearError {
        LinearError::Floating { step: self.step.name.clone() }
    }

    /// What it says of a structure that its matrix is singular.
    fn explained(&self, error: SolveError) -> LinearError {
        match error {
            SolveError::Indefinite { .. }
            | SolveError::Floating { .. }
            | SolveError::NoStiffness { .. }
            | SolveError::NotConverged { .. } => self.floating(),
            other => other.into(),
        }
    }

    /// The smallest squares of angular frequencies, with these stresses or without:
    /// (K + K_σ − ω² M) φ = 0.
    fn vibrating(
        &self,
        count: usize,
        stresses: &[Vec<Voigt>],
        job: &Job,
    ) -> Result<Vec<f64>, LinearError> {
        let (mut stiffness, _) = self.stiffness(job)?;
        if !stresses.is_empty() {
            stiffness.add(1.0, &self.stress_stiffness(stresses, job)?);
        }
        let (mass, _) = self.mass(job)?;
        self.smallest(stiffness, &mass, count, job)
    }

    /// The smallest factors at which the loads of the step make the structure unstable:
    /// (K + λ K_σ) φ = 0.
    fn buckling(&self, count: usize, job: &Job) -> Result<Vec<f64>, LinearError> {
        let stresses = self.stresses(&self.moved(job)?)?;
        let (stiffness, _) = self.stiffness(job)?;
        let mut softening = self.stress_stiffness(&stresses, job)?;
        softening.scale(-1.0);
        self.smallest(stiffness, &softening, count, job)
    }

    fn smallest(
        &self,
        stiffness: BlockMatrix<1>,
        other: &BlockMatrix<1>,
        count: usize,
        job: &Job,
    ) -> Result<Vec<f64>, LinearError> {
        modes::smallest(stiffness, other, count, job).map_err(|failed| match failed {
            modes::Failed::Solve(error) => self.explained(error),
            modes::Failed::Indefinite => LinearError::Unstable { step: self.step.name.clone() },
            modes::Failed::NotConverged => LinearError::unsettled(self.step, "eigenvalues"),
        })
    }

    fn eigenvalues(&self, eigenvalues: Vec<f64>) -> Solved {
        let (name, unknowns) = (self.step.name.clone(), self.free.count());
        Solved { name, eigenvalues, unknowns, ..Solved::default() }
    }

    fn stress_stiffness(
        &self,
        stresses: &[Vec<Voigt>],
        job: &Job,
    ) -> Result<BlockMatrix<1>, LinearError> {
        let (matrix, _) = self.assembled(job, |e, k, _| match stresses.get(e) {
            Some(stress) => self.element(e).stress_stiffness(stress, k),
            None => Ok(()),
        })?;
        Ok(matrix)
    }

    /// What acts on elements.
    fn distributed(&self) -> Result<Loads, LinearError> {
        let mut loads = Loads { by_cell: HashMap::new() };
        for (&(cell, face), &value) in &self.step.pressures {
            loads.by_cell.entry(cell).or_default().0.push((face, value));
        }
        for &(cell, pull) in &self.step.pulls {
            let element = self.element(cell as usize);
            if element.material().density.is_none() {
                return Err(LinearError::Weightless {
                    step: self.step.name.clone(),
                    element: self.deck.cells[cell as usize].label,
                    material: element.material().name.clone(),
                });
            }
            loads.by_cell.entry(cell).or_default().1.push(pull);
        }
        Ok(loads)
    }

    /// Adds forces at nodes.
    fn nodal(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        for (&(node, component), &force) in &self.step.forces {
            let own = [(node, 1.0)];
            let on = self.deck.shares.get(&node).map_or(&own[..], Vec::as_slice);
            for (unknown, share) in self.deck.component(node, component) {
                for &(other, part) in on {
                    self.push(3 * other + unknown % 3, share * part * force, node, rhs)?;
                }
            }
        }
        Ok(())
    }

    /// Adds a force at an unknown, which is that of a node of the deck.
    fn push(
        &self,
        unknown: u32,
        force: f64,
        node: u32,
        rhs: &mut [f64],
    ) -> Result<(), LinearError> {
        for &(free, factor) in &self.free.sum(unknown).terms {
            match self.free.number(free) {
                Some(number) => rhs[number] += factor * force,
                None if force == 0.0 => {}
                None => {
                    // Angles are components of hidden nodes, at the place of their own.
                    let node = self.deck.twins.get(&node).copied().unwrap_or(node);
                    let node = self.deck.labels.get(node as usize).copied().unwrap_or(0);
                    return Err(LinearError::Idle { step: self.step.name.clone(), node });
                }
            }
        }
        Ok(())
    }

    /// Stresses of every element for these displacements.
    fn stresses(&self, all: &[f64]) -> Result<Vec<Vec<Voigt>>, LinearError> {
        let stress = |e: usize| {
            let own: Vec<f64> =
                unknowns(self.deck, e).into_iter().map(|u| all[u as usize]).collect();
            let found = self.element(e).stresses(&own, &self.warmth(e), self.initial(e));
            found.map_err(|Folded| LinearError::Folded(self.deck.cells[e].label))
        };
        (0..self.deck.cells.len()).map(stress).collect()
    }
}

/// Every unknown by what is free.
fn sums(deck: &Deck, step: &Step, equations: &[Equation]) -> Result<Vec<Sum>, LinearError> {
    // Supports first: equations then bind what is left.
    let bound = Bound::new(equations)
        .map_err(|e| LinearError::Contradiction { step: step.name.clone(), line: e.line })?;
    Ok((0..3 * deck.nodes.len() as u32).map(|u| bound.of(u)).collect())
}

/// Unknowns of an element or, after the elements, of a spring.
fn unknowns(deck: &Deck, e: usize) -> Vec<u32> {
    match e.checked_sub(deck.cells.len()) {
        None => deck.cells[e].nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n + i)).collect(),
        Some(spring) => deck.springs[spring].terms.iter().map(|t| t.0).collect(),
    }
}

/// Pressures (face, Pa) and accelerations of elements.
struct Loads {
    by_cell: HashMap<u32, (Vec<(u8, f64)>, Vec<DVec3>)>,
}

impl Loads {
    fn add(
        &self,
        e: usize,
        element: &Element<'_>,
        warmth: &Warmth,
        force: &mut [f64],
    ) -> Result<(), Folded> {
        let Some((pressures, pulls)) = self.by_cell.get(&(e as u32)) else { return Ok(()) };
        pressures.iter().for_each(|&(face, p)| element.pressure(usize::from(face), p, force));
        let warm = warmth.now.iter().sum::<f64>() / warmth.now.len() as f64;
        let density = element.density(warm);
        for &pull in pulls {
            element.volume_force(density * pull, force)?;
        }
        Ok(())
    }
}
