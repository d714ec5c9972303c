//! What can be wrong with a system of equations.

use intrados_stage::Cancelled;

/// Why a system was refused or could not be solved; nodes are numbered from 0 in the order of the
/// matrix.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// An element joins a node that does not exist.
    #[error("element {element} joins node {node}, but there are {nodes} nodes")]
    NoSuchNode {
        /// Number of the element.
        element: usize,
        /// The node that it names.
        node: usize,
        /// How many there are.
        nodes: usize,
    },
    /// A vector or a set of constraints that belongs to another matrix.
    #[error("{what} has {found} entries where {expected} are needed")]
    Length {
        /// Which vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length of the system.
        expected: usize,
    },
    /// NaN or infinity.
    #[error("the {what} is not a finite number at node {node}")]
    NotFinite {
        /// Matrix, right-hand side, or prescribed value.
        what: &'static str,
        /// The node.
        node: usize,
    },
    /// Two constraints contradict each other.
    #[error(
        "node {node} is held at two different values in one direction ({first:.6e} and {second:.6e})"
    )]
    Contradiction {
        /// The node.
        node: usize,
        /// Value prescribed first.
        first: f64,
        /// Value prescribed later.
        second: f64,
    },
    /// A part of the model can move as a rigid body.
    #[error(
        "the body of {size} nodes around node {node} is free to {motion}: hold it, or give it springs"
    )]
    Floating {
        /// A node of the body.
        node: usize,
        /// How many nodes the body has.
        size: usize,
        /// The motion, for example `"move along (1.00, 0.00, 0.00)"`.
        motion: String,
    },
    /// No element gives this node stiffness.
    #[error("node {node} has no stiffness in some direction: no element that lives holds it there")]
    NoStiffness {
        /// The node.
        node: usize,
    },
    /// Conjugate gradients met a direction of negative energy, Cholesky a negative pivot.
    #[error(
        "the stiffness is not positive definite (seen by {method}, near node {node}): past a limit point, or an unheld mechanism"
    )]
    Indefinite {
        /// Which solver saw it.
        method: &'static str,
        /// Where the direction is largest.
        node: usize,
    },
    /// The factor has a zero pivot.
    #[error("the stiffness is singular: the solution is not finite at node {node}")]
    Singular {
        /// The node.
        node: usize,
    },
    /// The iterations ran out or stagnated.
    #[error(
        "{method} stopped after {iterations} iterations at a relative residual of {residual:.1e} instead of {tolerance:.1e}, \
         the largest at node {node}"
    )]
    NotConverged {
        /// Which solver.
        method: &'static str,
        /// How many.
        iterations: usize,
        /// ‖f − K u‖ / ‖f‖ reached.
        residual: f64,
        /// ‖f − K u‖ / ‖f‖ wanted.
        tolerance: f64,
        /// Where the residual is largest.
        node: usize,
    },
    /// The factor would not fit.
    #[error("the factor of {unknowns} unknowns cannot be built ({why}): take the multigrid method")]
    TooLarge {
        /// Number of unknowns.
        unknowns: usize,
        /// Memory or index range.
        why: String,
    },
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl SolveError {
    /// The node that it names, so that whoever knows a better name can put that.
    pub(crate) fn node_mut(&mut self) -> Option<&mut usize> {
        match self {
            Self::NotFinite { node, .. }
            | Self::Contradiction { node, .. }
            | Self::Floating { node, .. }
            | Self::NoStiffness { node }
            | Self::Indefinite { node, .. }
            | Self::Singular { node }
            | Self::NotConverged { node, .. } => Some(node),
            Self::NoSuchNode { .. }
            | Self::Length { .. }
            | Self::TooLarge { .. }
            | Self::Cancelled(_) => None,
        }
    }
}
