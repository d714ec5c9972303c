//! What a structure has been through: the last state in equilibrium.

use std::collections::BTreeMap;

use super::{law::Memory, steel::Piecework};
use crate::{element::hex8::Modes, material::steel::BarState, tensor::Voigt};

/// A state in equilibrium, from which the next step starts. Steps are tried on it, and it is
/// replaced once they have converged.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// s.
    pub time: f64,
    /// By which loads are raised beside their histories ([`super::Drive::Raised`]).
    pub factor: f64,
    /// Displacements (and rotations), three a node, m.
    pub x: Vec<f64>,
    /// Whether bricks turn with what they are in: second order. Joints, springs, shells and rods
    /// do not.
    pub turned: bool,
    /// Internal forces, three a node, N: what supports bear where nothing else acts.
    pub force: Vec<f64>,
    /// One a brick.
    pub(crate) modes: Vec<Modes>,
    /// One a brick.
    pub points: Vec<Memory>,
    /// Of bricks that are damaged the strain of their points that goes on beside what they are
    /// displaced by: that of their modes when they were first damaged.
    pub(crate) softened: BTreeMap<u32, [Voigt; 8]>,
    /// Of bricks that crush by themselves how much of what lies along their pressure does so with
    /// them, at most 1.
    pub(crate) crushing: BTreeMap<u32, f64>,
    /// Displacements in which an element was born, for those that were born after the beginning:
    /// they are its natural shape. By number in the order of elements: bricks first.
    pub born: BTreeMap<u32, [f64; 24]>,
    /// By bar or tendon, and piece.
    pub steel: Vec<Vec<Piecework>>,
    /// By interface and point: slip, m.
    pub slips: Vec<[[f64; 2]; 4]>,
    /// One a rod of the mesh.
    pub bars: Vec<BarState>,
    /// Non-local strain of the nodes; empty: [`super::Regularisation::Band`].
    pub nonlocal: Vec<f64>,
}

impl History {
    /// By what share the most excessive strain is beyond what its damage can carry.
    #[must_use]
    pub(crate) fn excess(&self) -> f64 {
        self.points.iter().map(Memory::excess).fold(0.0, f64::max)
    }
}
