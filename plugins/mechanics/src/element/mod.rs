//! Finite elements as pure functions: positions of nodes, nodal unknowns and a point-wise law (a
//! closure) in, stiffness and force out.
//!
//! They know no material, no mesh and no solver. `force` is the internal force ∂W/∂u, so
//! equilibrium is force = load, and `stiffness` its derivative with respect to the unknowns,
//! symmetric where the law's tangent is. A law is asked for trial states and must not move its
//! history: the caller commits when the step has converged. Initial strains (heat, shrinkage,
//! creep, birth) are the law's affair: it subtracts them from the strain that it is given.
//!
//! | module | element |
//! |---|---|
//! | [`hex8`] | brick of eight nodes: plain, mean dilatation, incompatible modes; its loads are in [`load`], its scalar matrices in [`scalar`]; [`assumed`] is its shear where it softens |
//! | [`rod`] | bar of two nodes; [`embed`] lays bars and tendons through bricks, bonded or slipping |
//! | [`interface`] | joint of zero thickness between two faces |
//! | [`spring`] | ground on a face |
//! | [`shell`] | MITC4 shell with drilling rotations |
//! | [`turn`] | what makes a brick, and steel in it, turn with what they are in |

pub(crate) mod assumed;
pub mod embed;
pub mod hex8;
pub(crate) mod interface;
pub(crate) mod load;
pub(crate) mod quad;
pub mod rod;
pub(crate) mod scalar;
pub(crate) mod shell;
pub(crate) mod spring;
pub(crate) mod turn;

#[cfg(test)]
mod bench_mesh;

/// Stiffness and internal force of an element of N unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Element<const N: usize> {
    /// ∂force/∂unknown, row = force (N/m where the unknown is a displacement).
    pub stiffness: [[f64; N]; N],
    /// Internal force (N).
    pub force: [f64; N],
}

impl<const N: usize> Element<N> {
    /// An element that resists nothing.
    #[must_use]
    pub(crate) fn zero() -> Self {
        Self { stiffness: [[0.0; N]; N], force: [0.0; N] }
    }

    /// Adds weight · rowᵀ (traction, tangent) row of a point where `rows` turn unknowns into the
    /// law's strains.
    pub(crate) fn add<const M: usize>(
        &mut self,
        rows: &[[f64; N]; M],
        stress: &[f64; M],
        tangent: &[[f64; M]; M],
        weight: f64,
    ) {
        let mut moved = [[0.0; N]; M];
        for (moved, tangent) in moved.iter_mut().zip(tangent) {
            for (row, d) in rows.iter().zip(tangent) {
                for (m, r) in moved.iter_mut().zip(row) {
                    *m += weight * d * r;
                }
            }
        }
        for ((row, moved), stress) in rows.iter().zip(&moved).zip(stress) {
            for ((force, stiffness), r) in self.force.iter_mut().zip(&mut self.stiffness).zip(row) {
                *force += weight * stress * r;
                for (k, m) in stiffness.iter_mut().zip(moved) {
                    *k += r * m;
                }
            }
        }
    }

    pub(crate) fn finite(self) -> Result<Self, ElementError> {
        if self.force.iter().chain(self.stiffness.iter().flatten()).all(|x| x.is_finite()) {
            Ok(self)
        } else {
            Err(ElementError::NotFinite)
        }
    }
}

/// Why an element has no stiffness.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ElementError {
    /// The map from natural to real coordinates folds.
    #[error(
        "the Jacobian at integration point {point} is {jacobian:.3e} m³: the element is flat, folded or its nodes are in the wrong order"
    )]
    Inverted {
        /// Integration point, from 0.
        point: usize,
        /// Determinant of ∂x/∂ξ there.
        jacobian: f64,
    },
    /// A side or an area is zero.
    #[error(
        "the element has no length or area at integration point {point}: two of its nodes coincide"
    )]
    Degenerate {
        /// Integration point, from 0.
        point: usize,
    },
    /// Not a number in unknowns, nodes or what the law answered.
    #[error("stress or stiffness is not a finite number: check displacements and material values")]
    NotFinite,
}
