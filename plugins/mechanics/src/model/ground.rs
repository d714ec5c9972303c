//! What a face rests on: ground around a lining, or springs under a footing.

use glam::DVec3;

use crate::{
    element::{
        Element, ElementError,
        quad::{self, Quadrature},
        spring::{self, Winkler},
    },
    mesh::HexFace,
};

/// Springs on a face, towards the ground.
#[derive(Debug, Clone, Copy)]
pub struct Ground {
    /// The face of the brick that it lies on.
    pub face: HexFace,
    /// What is there.
    pub bedding: Bedding,
}

/// Kinds of springs.
#[derive(Debug, Clone, Copy)]
pub enum Bedding {
    /// Ground around an axis, which pushes and never pulls.
    Around {
        /// A point of the axis that the ground lies around, and its direction: springs are radial
        /// to it.
        axis: [DVec3; 2],
        /// Stiffness, and the pressure of the ground at rest.
        springs: Winkler,
        /// From when to when that pressure comes, s.
        comes: [f64; 2],
    },
    /// Springs along the axes of the world.
    Springs {
        /// Along x, y, z, Pa/m.
        stiffness: DVec3,
        /// Whether the face may lift off: then nothing acts but a millionth of the springs, which
        /// keeps the equations solvable.
        lifts: bool,
    },
}

/// What is left of springs that a face has lifted off.
const OPEN: f64 = 1e-6;

impl Ground {
    /// The springs of a lining at a time.
    fn pressed(springs: Winkler, [from, to]: [f64; 2], time: f64) -> Winkler {
        let share = if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        Winkler { pressure: share * springs.pressure, ..springs }
    }

    /// Stiffness and force on the face's nodes, which have moved by `u`.
    ///
    /// # Errors
    /// As [`spring::ground`].
    pub(super) fn element(
        &self,
        nodes: &[DVec3; 4],
        u: &[f64; 12],
        time: f64,
    ) -> Result<Element<12>, ElementError> {
        match self.bedding {
            Bedding::Around { axis: [origin, axis], springs, comes } => {
                let springs = Self::pressed(springs, comes, time);
                let outward = |spot: &quad::Spot| (spot.at - origin).reject_from(axis);
                spring::ground(nodes, u, &Quadrature::gauss(2), outward, |_, moved| {
                    springs.respond(moved)
                })
            }
            Bedding::Springs { stiffness, lifts } => {
                let mut element = Element::zero();
                for (point, natural) in Quadrature::gauss(2).points().enumerate() {
                    let spot = quad::spot(nodes, natural, point)?;
                    let rows: [[f64; 12]; 3] = std::array::from_fn(|axis| {
                        std::array::from_fn(|c| if c % 3 == axis { spot.shape[c / 3] } else { 0.0 })
                    });
                    let moved = DVec3::from_array(
                        rows.map(|row| row.iter().zip(u).map(|(r, u)| r * u).sum()),
                    );
                    let left = if lifts && moved.dot(spot.normal) < 0.0 { OPEN } else { 1.0 };
                    let k = left * stiffness;
                    let tangent = [[k.x, 0.0, 0.0], [0.0, k.y, 0.0], [0.0, 0.0, k.z]];
                    element.add(&rows, &(k * moved).to_array(), &tangent, spot.area);
                }
                element.finite()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACE: [DVec3; 4] =
        [DVec3::ZERO, DVec3::Z, DVec3::new(2.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 0.0)];

    fn forces(moved: DVec3, lifts: bool) -> DVec3 {
        let bedding = Bedding::Springs { stiffness: DVec3::new(3e6, 50e6, 4e6), lifts };
        let ground = Ground { face: HexFace { hex: 0, face: 0 }, bedding };
        let u: [f64; 12] = std::array::from_fn(|c| moved[c % 3]);
        let element = ground.element(&FACE, &u, 0.0).unwrap();
        element.force.chunks_exact(3).map(DVec3::from_slice).sum()
    }

    /// 2 m² under a footing that looks down: springs resist in every direction, those that let go
    /// only where it is pressed.
    #[test]
    fn a_footing_presses_and_may_lift_off() {
        let normal = (FACE[1] - FACE[0]).cross(FACE[2] - FACE[0]);
        assert!(normal.y > 0.0, "this face looks up: pressed upwards");
        let pressed = DVec3::new(1e-3, 2e-3, 1e-3);
        let expected = 2.0 * DVec3::new(3e3, 100e3, 4e3);
        assert!(
            (forces(pressed, true) - expected).length() < 1e-6
                && (forces(pressed, false) - expected).length() < 1e-6
        );
        assert!((forces(-pressed, false) + expected).length() < 1e-6);
        assert!(forces(-pressed, true).length() < 1.0);
    }
}
