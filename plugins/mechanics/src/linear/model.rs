//! What a deck says, in SI and by positions.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::DVec3;

use super::{
    constraint::Equation,
    law::{Elastic, Expansion, Table},
    shape::{Point, Shape},
};
use crate::{
    tensor::{self, Frame, Voigt},
    write::Grid,
};

/// A model and its steps.
#[derive(Debug, Clone, Default)]
pub struct Deck {
    /// m.
    pub(super) nodes: Vec<DVec3>,
    /// Numbers of the nodes that the deck has; nodes around those of beams and shells follow.
    pub(super) labels: Vec<u32>,
    pub(super) cells: Vec<Cell>,
    pub(super) materials: Vec<Material>,
    pub(super) orientations: Vec<Orientation>,
    pub(super) springs: Vec<Spring>,
    /// What holds in every step: equations, ties, beams and shells.
    pub(super) equations: Vec<Equation>,
    /// Steps from which on equations do not hold any more.
    pub(super) until: HashMap<usize, u32>,
    /// Nodes around those of beams and shells, and the node that each has its temperature from.
    pub(super) twins: HashMap<u32, u32>,
    /// Nodes whose displacement is given as the mean of others.
    pub(super) means: HashMap<u32, Vec<(u32, f64)>>,
    /// Nodes whose forces act on others, by their shares.
    pub(super) shares: HashMap<u32, Vec<(u32, f64)>>,
    /// What holds from a step on, counted from 1.
    pub(super) later: Vec<(u32, Equation)>,
    /// Axes in which supports, forces and equations of a node are given.
    pub(super) turned: HashMap<u32, Frame>,
    /// Temperature of every node at which the body has no strain.
    pub(super) cold: Vec<f64>,
    /// The temperature that radiation counts from.
    pub(super) absolute_zero: f64,
    /// Stress before the first step, by element and point.
    pub(super) stress: HashMap<(u32, u32), Voigt>,
    pub(super) steps: Vec<Step>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// A solid element.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    pub(super) label: u32,
    pub(super) shape: Shape,
    pub(super) nodes: Vec<u32>,
    pub(super) material: u32,
    pub(super) orientation: Option<u32>,
    /// Section of a bar, m².
    pub(super) across: f64,
    /// Points of integration, where they are not those of its shape.
    pub(super) points: Vec<Point>,
}

/// A linear spring: its force is k times a sum of displacements, and acts on each by its factor.
#[derive(Debug, Clone)]
pub(super) struct Spring {
    pub(super) terms: Vec<(u32, f64)>,
    /// N/m.
    pub(super) stiffness: f64,
}

impl Spring {
    /// Adds its stiffness, row by row.
    pub(super) fn resist(&self, k: &mut [f64]) {
        for (row, a) in k.chunks_mut(self.terms.len()).zip(&self.terms) {
            let force = self.stiffness * a.1;
            row.iter_mut().zip(&self.terms).for_each(|(k, b)| *k += force * b.1);
        }
    }
}

/// What a material is; a step asks for what it needs.
#[derive(Debug, Clone, Default)]
pub(super) struct Material {
    pub(super) name: String,
    pub(super) elastic: Option<Elastic>,
    pub(super) expansion: Option<Expansion>,
    /// kg/m³.
    pub(super) density: Option<Table<1>>,
    /// Along its own axes, W/(m·K).
    pub(super) conductivity: Option<Table<3>>,
    /// J/(kg·K).
    pub(super) specific_heat: Option<Table<1>>,
}

/// The axes of a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Orientation {
    /// The same everywhere.
    Straight(Frame),
    /// r, θ, z about an axis.
    Around {
        /// A point of it.
        origin: [f64; 3],
        /// Its direction.
        axis: [f64; 3],
    },
}

impl Orientation {
    /// The axes there, as rows.
    pub(super) fn frame(&self, at: DVec3) -> Frame {
        match *self {
            Self::Straight(frame) => frame,
            Self::Around { origin, axis } => tensor::cylindrical(at.to_array(), origin, axis),
        }
    }
}

/// What a step computes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) enum Procedure {
    /// Displacements and stresses.
    #[default]
    Static,
    /// Temperatures.
    Heat {
        /// Those at which nothing changes any more.
        steady: bool,
        /// s.
        first: f64,
        /// s.
        duration: f64,
    },
    /// The smallest eigenvalues of motion.
    Modes {
        count: usize,
        /// With the stresses of the step before.
        stressed: bool,
    },
    /// The smallest factors of the loads at which the structure buckles.
    Buckling { count: usize },
}

/// A way of heating.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Heating {
    /// W, into a node.
    Node,
    /// W/m³, in an element.
    Volume,
    /// W/m², into a face.
    Face,
    /// Through a film on a face: W/(m²·K), and the temperature beyond it.
    Film,
    /// By radiation from what is around a face: W/(m²·K⁴), and its temperature.
    Radiation,
}

/// What is heated: how, which node or element, and which of its faces.
pub(super) type Heated = (Heating, u32, u8);

/// A step at its end.
#[derive(Debug, Clone, Default)]
pub(super) struct Step {
    pub(super) name: String,
    /// From 1.
    pub(super) number: u32,
    pub(super) procedure: Procedure,
    /// Components (in the node's own axes) and values, m.
    pub(super) held: BTreeMap<(u32, u8), f64>,
    /// Components that stay where the step before has left them.
    pub(super) kept: BTreeSet<(u32, u8)>,
    /// N.
    pub(super) forces: BTreeMap<(u32, u8), f64>,
    /// Pa, by element and face.
    pub(super) pressures: BTreeMap<(u32, u8), f64>,
    /// Accelerations of elements by which they weigh, m/s².
    pub(super) pulls: Vec<(u32, DVec3)>,
    /// Of every node; empty: as at the beginning, or as the last heat step has left it.
    pub(super) warm: Vec<f64>,
    /// Temperatures that a heat step holds.
    pub(super) temperatures: BTreeMap<u32, f64>,
    pub(super) heating: BTreeMap<Heated, [f64; 2]>,
}

impl Deck {
    /// Numbers of the nodes that the deck names.
    #[must_use]
    pub fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// Numbers of its elements.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = u32> {
        self.cells.iter().map(|c| c.label)
    }

    /// Its elements as a picture, whose regions are their materials; none where beams or shells
    /// have become solids with nodes that the deck does not name.
    #[must_use]
    pub fn grid(&self) -> Option<Grid<'_>> {
        let cells = self.cells.iter().map(|c| (c.shape.vtk(), c.nodes.as_slice(), c.material));
        (self.nodes.len() == self.labels.len()).then(|| Grid::of(&self.nodes, cells))
    }

    /// Gives nodes around those of beams and shells the temperature of these.
    pub(super) fn spread(&self, temperatures: &mut [f64]) {
        for (&twin, &node) in &self.twins {
            temperatures[twin as usize] = temperatures[node as usize];
        }
    }

    /// The unknowns of a component of a node in its own axes.
    pub(super) fn component(&self, node: u32, component: u8) -> Vec<(u32, f64)> {
        match self.turned.get(&node) {
            None => vec![(3 * node + u32::from(component), 1.0)],
            Some(frame) => {
                let row = frame[usize::from(component)];
                (0u32..3).zip(row).filter(|t| t.1 != 0.0).map(|(i, f)| (3 * node + i, f)).collect()
            }
        }
    }
}
