//! Steps to displacements and stresses: T ᵀ K T q = Tᵀ (f − K c), factorised.

use std::collections::HashMap;

use glam::DVec3;
use intrados_stage::{Cancelled, Job};

use super::{
    constraint::{Bound, Equation, Sum},
    element::{Element, Folded},
    model::{Cell, Deck, Step},
};
use crate::{
    sparse::{BlockMatrix, Connectivity, Constraints, Method, Pattern, Place, SolveError, solve},
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
        /// Line of the deck; 0: of a tie or a flat element.
        line: u32,
    },
    /// An element that is flat or turned inside out.
    #[error("element {0} is flat, folded, or its nodes are in the wrong order")]
    Folded(u32),
    /// A force where nothing resists.
    #[error("{step}: a force acts on node {node}, which belongs to no element")]
    Idle {
        /// Name of the step.
        step: String,
        /// Number of the node.
        node: u32,
    },
    /// Weight of what has none.
    #[error(
        "{step}: weight or spin acts on element {element}, whose material {material} has no *DENSITY"
    )]
    Weightless {
        /// Name of the step.
        step: String,
        /// Number of the element.
        element: u32,
        /// Its material.
        material: String,
    },
    /// Parts that nothing holds.
    #[error("{step}: a part of the model can move freely: hold it by *BOUNDARY, *EQUATION or *TIE")]
    Floating {
        /// Name of the step.
        step: String,
    },
    /// The equations could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// ‖f − K u‖ / ‖f‖ of a solution: slender solids of millions of entries lose six digits of sixteen,
/// and a part that nothing holds all of them.
const TOLERANCE: f64 = 1e-7;

impl Deck {
    /// Computes every step.
    ///
    /// # Errors
    /// [`LinearError`].
    pub fn solve(&self, job: &Job) -> Result<Vec<Solved>, LinearError> {
        let solved = self.steps.iter().enumerate().map(|(i, step)| {
            job.step(i, self.steps.len())?;
            let share = self.steps.len() as f64;
            System::new(self, step)?.solve(&job.part(i as f64 / share, (i + 1) as f64 / share))
        });
        solved.collect()
    }

    /// What is held in a step, as equations.
    fn held(&self, step: &Step) -> Vec<Equation> {
        let held = step.held.iter().map(|(&(node, component), &value)| Equation {
            terms: self.component(node, component),
            value,
            line: 0,
        });
        held.collect()
    }
}

/// A step and its constraints.
struct System<'a> {
    deck: &'a Deck,
    step: &'a Step,
    /// Of every unknown of every node.
    sums: Vec<Sum>,
    /// Number of each free unknown among those that are solved for.
    numbers: HashMap<u32, u32>,
    places: Vec<Place>,
    elements: Connectivity,
}

impl<'a> System<'a> {
    fn new(deck: &'a Deck, step: &'a Step) -> Result<Self, LinearError> {
        let held = deck.held(step);
        // Supports first: equations then bind what is left.
        let bound = Bound::new(held.iter().chain(&deck.equations))
            .map_err(|e| LinearError::Contradiction { step: step.name.clone(), line: e.line })?;
        let sums: Vec<Sum> = (0..3 * deck.nodes.len() as u32).map(|u| bound.of(u)).collect();
        let mut system = Self {
            deck,
            step,
            sums,
            numbers: HashMap::new(),
            places: Vec::new(),
            elements: Connectivity::default(),
        };
        for cell in &deck.cells {
            let free = system.free(cell);
            let numbered: Vec<u32> = free.into_iter().map(|u| system.number(u)).collect();
            system.elements.push(&numbered);
        }
        Ok(system)
    }

    /// Unknowns of an element.
    fn unknowns(cell: &Cell) -> impl Iterator<Item = u32> {
        cell.nodes.iter().flat_map(|&n| (0..3).map(move |i| 3 * n + i))
    }

    /// The free unknowns that an element moves with, ascending.
    fn free(&self, cell: &Cell) -> Vec<u32> {
        let sums = Self::unknowns(cell).map(|u| &self.sums[u as usize]);
        let mut free: Vec<u32> = sums.flat_map(|s| s.terms.iter().map(|t| t.0)).collect();
        free.sort_unstable();
        free.dedup();
        free
    }

    fn number(&mut self, free: u32) -> u32 {
        let next = self.places.len() as u32;
        let number = *self.numbers.entry(free).or_insert(next);
        if number == next {
            self.places.push(Place::point(self.deck.nodes[free as usize / 3].to_array()));
        }
        number
    }

    /// Warmth of the nodes of an element.
    fn warmth(&self, cell: &Cell) -> Vec<f64> {
        let warm = |&n: &u32| {
            self.step.warm.get(n as usize).map_or(0.0, |t| t - self.deck.cold[n as usize])
        };
        cell.nodes.iter().map(warm).collect()
    }

    fn initial(&self, cell: usize) -> impl Fn(usize) -> Voigt + '_ {
        move |p| self.deck.stress.get(&(cell as u32, p as u32)).copied().unwrap_or(tensor::ZERO)
    }

    fn solve(self, job: &Job) -> Result<Solved, LinearError> {
        let loads = self.distributed()?;
        let pattern = Pattern::new(self.places.clone(), &self.elements)?;
        let mut matrix = BlockMatrix::<1>::zeros(pattern.into());
        let mut rhs = vec![0.0; self.places.len()];
        matrix.assemble_with(&self.elements, &mut rhs, job, |e, k, f| {
            self.reduced(e, &loads, k, f)
        })?;
        self.nodal(&mut rhs)?;
        let none = Constraints::new(self.places.len());
        let solution = if rhs.is_empty() {
            Vec::new()
        } else {
            let floating = || LinearError::Floating { step: self.step.name.clone() };
            let found = solve(&matrix, &rhs, &none, Method::Direct, TOLERANCE, job);
            let found = found.map_err(|e| match e {
                SolveError::Indefinite { .. }
                | SolveError::NoStiffness { .. }
                | SolveError::NotConverged { .. } => floating(),
                other => other.into(),
            })?;
            if found.negative_eigenvalues > 0 {
                return Err(floating());
            }
            found.x
        };
        self.gather(&solution)
    }

    /// Tᵀ K T and Tᵀ (f − K c) of an element.
    fn reduced(
        &self,
        e: usize,
        loads: &Loads<'_>,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), LinearError> {
        let cell = &self.deck.cells[e];
        let n = 3 * cell.nodes.len();
        let element = Element::new(self.deck, cell);
        let (mut full, mut force) = (vec![0.0; n * n], vec![0.0; n]);
        let folded = |Folded| LinearError::Folded(cell.label);
        element
            .stiffness(&self.warmth(cell), self.initial(e), &mut full, &mut force)
            .map_err(folded)?;
        loads.add(e, &element, &mut force).map_err(folded)?;
        let sums: Vec<&Sum> = Self::unknowns(cell).map(|u| &self.sums[u as usize]).collect();
        let members = self.elements.get(e);
        // Places of every unknown's terms among those of the element.
        let shares: Vec<Vec<(usize, f64)>> = sums
            .iter()
            .map(|s| {
                s.terms.iter().filter_map(|(u, c)| Some((self.place(members, *u)?, *c))).collect()
            })
            .collect();
        for (i, share) in shares.iter().enumerate() {
            let row = &full[i * n..(i + 1) * n];
            let moved: f64 = row.iter().zip(&sums).map(|(k, s)| k * s.constant).sum();
            for &(a, c) in share {
                f[a] += c * (force[i] - moved);
                for (value, other) in row.iter().zip(&shares) {
                    other.iter().for_each(|&(b, d)| k[a * members.len() + b] += c * d * value);
                }
            }
        }
        Ok(())
    }

    /// Where a free unknown stands among those of an element.
    fn place(&self, members: &[u32], free: u32) -> Option<usize> {
        let number = self.numbers.get(&free)?;
        members.iter().position(|m| m == number)
    }

    /// What acts on elements.
    fn distributed(&self) -> Result<Loads<'a>, LinearError> {
        let mut loads = Loads { by_cell: HashMap::new() };
        for (&(cell, face), &value) in &self.step.pressures {
            loads.by_cell.entry(cell).or_default().0.push((face, value));
        }
        for (cell, pull) in &self.step.pulls {
            let of = &self.deck.cells[*cell as usize];
            let material = &self.deck.materials[of.material as usize];
            if material.density <= 0.0 {
                return Err(LinearError::Weightless {
                    step: self.step.name.clone(),
                    element: of.label,
                    material: material.name.clone(),
                });
            }
            loads.by_cell.entry(*cell).or_default().1.push(pull);
        }
        Ok(loads)
    }

    /// Adds forces at nodes.
    fn nodal(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        for (&(node, component), &force) in &self.step.forces {
            for (unknown, share) in self.deck.component(node, component) {
                for (free, factor) in &self.sums[unknown as usize].terms {
                    let Some(&number) = self.numbers.get(free) else {
                        if force == 0.0 {
                            continue;
                        }
                        let node = self.deck.labels.get(node as usize).copied().unwrap_or(0);
                        return Err(LinearError::Idle { step: self.step.name.clone(), node });
                    };
                    rhs[number as usize] += factor * share * force;
                }
            }
        }
        Ok(())
    }

    /// Displacements and stresses.
    fn gather(&self, solution: &[f64]) -> Result<Solved, LinearError> {
        let value = |sum: &Sum| {
            let part = |(u, c): &(u32, f64)| {
                self.numbers.get(u).map_or(0.0, |&n| c * solution[n as usize])
            };
            sum.constant + sum.terms.iter().map(part).sum::<f64>()
        };
        let all: Vec<f64> = self.sums.iter().map(value).collect();
        let stress = |(e, cell): (usize, &Cell)| {
            let own: Vec<f64> = Self::unknowns(cell).map(|u| all[u as usize]).collect();
            Element::new(self.deck, cell)
                .stresses(&own, &self.warmth(cell), self.initial(e))
                .map_err(|Folded| LinearError::Folded(cell.label))
        };
        let stresses = self.deck.cells.iter().enumerate().map(stress).collect::<Result<_, _>>()?;
        let displacements =
            all.as_chunks::<3>().0[..self.deck.labels.len()].iter().copied().map(DVec3::from_array);
        Ok(Solved {
            name: self.step.name.clone(),
            displacements: displacements.collect(),
            stresses,
            unknowns: solution.len(),
        })
    }
}

/// Pressures (face, Pa) and pulls of elements.
struct Loads<'a> {
    by_cell: HashMap<u32, (Vec<(u8, f64)>, Vec<&'a super::model::Pull>)>,
}

impl Loads<'_> {
    fn add(&self, e: usize, element: &Element<'_>, force: &mut [f64]) -> Result<(), Folded> {
        let Some((pressures, pulls)) = self.by_cell.get(&(e as u32)) else { return Ok(()) };
        pressures.iter().for_each(|&(face, p)| element.pressure(usize::from(face), p, force));
        for pull in pulls {
            element.volume_force(|at| element.density() * pull.at(at), force)?;
        }
        Ok(())
    }
}
