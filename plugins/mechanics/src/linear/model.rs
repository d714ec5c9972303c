//! What a deck says, in SI and by positions.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::{constraint::Equation, shape::Shape};
use crate::tensor::{self, Frame, Tangent, Voigt};

/// A linear elastic model and its steps.
#[derive(Debug, Clone, Default)]
pub struct Deck {
    /// m.
    pub(super) nodes: Vec<DVec3>,
    /// Numbers of the nodes that the deck has; nodes that thicken flat elements follow.
    pub(super) labels: Vec<u32>,
    pub(super) cells: Vec<Cell>,
    pub(super) materials: Vec<Material>,
    pub(super) orientations: Vec<Orientation>,
    /// What holds in every step: equations, ties, thickened elements.
    pub(super) equations: Vec<Equation>,
    /// Axes in which supports, forces and equations of a node are given.
    pub(super) turned: HashMap<u32, Frame>,
    /// Temperature of every node at which the body has no strain.
    pub(super) cold: Vec<f64>,
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
}

/// A linear elastic material.
#[derive(Debug, Clone)]
pub(super) struct Material {
    pub(super) name: String,
    /// Along its own axes, Pa.
    pub(super) stiffness: Tangent,
    /// Along its own axes, 1/K.
    pub(super) expansion: [f64; 3],
    /// kg/m³.
    pub(super) density: f64,
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

/// Force on a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pull {
    /// m/s².
    Weight(DVec3),
    /// About an axis: a point of it, its direction, the square of the angular velocity.
    Spin { origin: DVec3, axis: DVec3, squared: f64 },
}

impl Pull {
    /// So many times as much.
    pub(super) fn times(self, factor: f64) -> Self {
        match self {
            Self::Weight(acceleration) => Self::Weight(factor * acceleration),
            Self::Spin { origin, axis, squared } => {
                Self::Spin { origin, axis, squared: factor * squared }
            }
        }
    }

    /// m/s².
    pub(super) fn at(self, place: DVec3) -> DVec3 {
        match self {
            Self::Weight(acceleration) => acceleration,
            Self::Spin { origin, axis, squared } => {
                squared * (place - origin).reject_from_normalized(axis)
            }
        }
    }
}

/// A step at its end.
#[derive(Debug, Clone, Default)]
pub(super) struct Step {
    pub(super) name: String,
    /// Components (in the node's own axes) and values, m.
    pub(super) held: BTreeMap<(u32, u8), f64>,
    /// N.
    pub(super) forces: BTreeMap<(u32, u8), f64>,
    /// Pa, by element and face.
    pub(super) pressures: BTreeMap<(u32, u8), f64>,
    pub(super) pulls: Vec<(u32, Pull)>,
    /// Of every node; empty: as at the beginning.
    pub(super) warm: Vec<f64>,
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
