//! Loads on bricks: forces on the nodes that do the same work as weight, pressure or traction.

use super::{ElementError, hex8, quad};
use crate::mesh::hex::FACES;
use glam::DVec3;

/// A face of a brick in Abaqus' numbering: 1 bottom (ζ = −1), 2 top, 3 (η = −1), 4 (ξ = 1), 5 (η =
/// 1), 6 (ξ = −1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Face(u8);

impl Face {
    /// All six, in order.
    pub(crate) const ALL: [Self; 6] = [Self(0), Self(1), Self(2), Self(3), Self(4), Self(5)];

    /// The face that Abaqus calls S1…S6 (or its pressure P1…P6).
    #[must_use]
    #[cfg(test)]
    pub(crate) fn abaqus(number: usize) -> Option<Self> {
        number.checked_sub(1).and_then(|n| Self::ALL.get(n)).copied()
    }

    /// Its number in Abaqus, 1…6.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn number(self) -> usize {
        usize::from(self.0) + 1
    }

    /// Its nodes among the eight (from 0); their right-handed normal points into the element.
    #[must_use]
    pub(crate) fn nodes(self) -> [usize; 4] {
        let [a, b, c, d] = FACES[usize::from(self.0)];
        [a, d, c, b]
    }

    /// Their positions.
    #[must_use]
    pub(crate) fn of(self, nodes: &[DVec3; 8]) -> [DVec3; 4] {
        self.nodes().map(|n| nodes[n])
    }
}

/// ∫ N b dV of a force per volume (N/m³), b of the place.
///
/// # Errors
/// [`ElementError::Inverted`].
pub(crate) fn body(
    nodes: &[DVec3; 8],
    mut force: impl FnMut(DVec3) -> DVec3,
) -> Result<[f64; 24], ElementError> {
    let mut load = [0.0; 24];
    for (point, natural) in hex8::GAUSS.into_iter().enumerate() {
        let volume = hex8::right_way_round(hex8::jacobian(nodes, natural).determinant(), point)?;
        let b = volume * force(hex8::position(nodes, natural));
        for (a, n) in hex8::shape(natural).into_iter().enumerate() {
            load[3 * a..3 * a + 3].iter_mut().zip((n * b).to_array()).for_each(|(l, f)| *l += f);
        }
    }
    Ok(load)
}

/// ∫ N t dA of a force per area (N/m²) on a face, t of the place and of the normal that points into
/// the element.
///
/// # Errors
/// [`ElementError::Degenerate`] for a face without area.
pub(crate) fn traction(
    nodes: &[DVec3; 8],
    face: Face,
    mut force: impl FnMut(DVec3, DVec3) -> DVec3,
) -> Result<[f64; 24], ElementError> {
    let (corners, mut load) = (face.of(nodes), [0.0; 24]);
    for (point, gauss) in quad::GAUSS.into_iter().enumerate() {
        let spot = quad::spot(&corners, gauss, point)?;
        let t = spot.area * force(spot.at, spot.normal);
        for (a, n) in face.nodes().into_iter().zip(spot.shape) {
            load[3 * a..3 * a + 3].iter_mut().zip((n * t).to_array()).for_each(|(l, f)| *l += f);
        }
    }
    Ok(load)
}

/// The load of a pressure (Pa, positive: pushes into the element), which may depend on the place.
///
/// # Errors
/// As [`traction`].
pub(crate) fn pressure(
    nodes: &[DVec3; 8],
    face: Face,
    mut pressure: impl FnMut(DVec3) -> f64,
) -> Result<[f64; 24], ElementError> {
    traction(nodes, face, |at, inward| pressure(at) * inward)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::crooked;

    fn total(load: &[f64; 24]) -> DVec3 {
        load.chunks_exact(3).map(DVec3::from_slice).sum()
    }

    fn moment(nodes: &[DVec3; 8], load: &[f64; 24]) -> DVec3 {
        nodes.iter().zip(load.chunks_exact(3)).map(|(x, f)| x.cross(DVec3::from_slice(f))).sum()
    }

    #[test]
    fn uniform_pressure_around_a_crooked_brick_is_in_balance() {
        let nodes = crooked();
        let mut sum = [0.0; 24];
        for face in Face::ALL {
            let load = pressure(&nodes, face, |_| 2.0).unwrap();
            sum.iter_mut().zip(load).for_each(|(s, l)| *s += l);
        }
        assert!(total(&sum).length() < 1e-13 && moment(&nodes, &sum).length() < 1e-13);
    }

    /// Archimedes: hydrostatic pressure ρ g (−y) lifts the volume's weight, and the moment is that
    /// of the body force.
    #[test]
    fn hydrostatic_pressure_lifts_the_weight() {
        let nodes = crooked();
        let mut sum = [0.0; 24];
        for face in Face::ALL {
            let load = pressure(&nodes, face, |x| 9810.0 * (5.0 - x.y)).unwrap();
            sum.iter_mut().zip(load).for_each(|(s, l)| *s += l);
        }
        let weight = body(&nodes, |_| DVec3::new(0.0, -9810.0, 0.0)).unwrap();
        assert!((total(&sum) + total(&weight)).length() < 1e-9 * total(&weight).length());
        assert!((total(&weight).y + 9810.0 * hex8::volume(&nodes).unwrap()).abs() < 1e-9);
    }

    #[test]
    fn faces_look_inward_and_have_abaqus_numbers() {
        for (number, outward) in [
            (1, -DVec3::Z),
            (2, DVec3::Z),
            (3, -DVec3::Y),
            (4, DVec3::X),
            (5, DVec3::Y),
            (6, -DVec3::X),
        ] {
            let face = Face::abaqus(number).unwrap();
            let load = pressure(&hex8::CORNERS, face, |_| 1.0).unwrap();
            assert!((total(&load) + 4.0 * outward).length() < 1e-14, "face {number}");
            assert!(face.nodes().iter().all(|&n| hex8::CORNERS[n].dot(outward) == 1.0));
            assert_eq!(face.number(), number);
        }
        assert_eq!((Face::abaqus(0), Face::abaqus(7)), (None, None));
    }
}
