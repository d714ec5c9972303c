//! Geometry of the trilinear hexahedron: x(ξ) = Σ Nᵢ(ξ) xᵢ with Nᵢ = ⅛ (1 + ξξᵢ)(1 + ηηᵢ)(1 + ζζᵢ),
//! ξ in [−1, 1]³.

use glam::DVec3;

pub(crate) use crate::element::hex8::{CORNERS, jacobian, position as place};
#[cfg(test)]
use crate::element::hex8::{shape, slopes as gradients};

/// Corners of the faces S1 to S6 of Abaqus, counterclockwise seen from outside: ζ = −1, ζ = 1, η =
/// −1, ξ = 1, η = 1, ξ = −1.
pub const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// Ends of the edges: four along ξ, four along η, four along ζ.
pub const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [3, 2],
    [4, 5],
    [7, 6],
    [0, 3],
    [1, 2],
    [4, 7],
    [5, 6],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// The three corners next to each corner, in right-handed order.
const NEXT: [[usize; 3]; 8] =
    [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]];

/// Volume, m³. The determinant is of degree 2 in each coordinate, so 2³ Gauss points are exact.
#[must_use]
pub(crate) fn volume(corners: &[DVec3; 8]) -> f64 {
    CORNERS.iter().map(|c| jacobian(corners, *c / 3f64.sqrt()).determinant()).sum()
}

/// Jacobian at a corner over the product of the lengths of its three edges: 1 for a right angle, 0
/// for a flat corner, below 0 inverted.
#[must_use]
pub(crate) fn corner_quality(corners: &[DVec3; 8], corner: usize) -> f64 {
    let [a, b, c] = NEXT[corner].map(|n| corners[n] - corners[corner]);
    let lengths = a.length() * b.length() * c.length();
    if lengths > 0.0 { a.dot(b.cross(c)) / lengths } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bent() -> [DVec3; 8] {
        CORNERS.map(|c| {
            DVec3::new(2.0 * c.x + 0.3 * c.y * c.z, c.y + 0.2 * c.x, 0.5 * c.z + 0.1 * c.x * c.y)
        })
    }

    #[test]
    fn shapes_are_one_at_their_corner_and_sum_to_one() {
        for (i, c) in CORNERS.iter().enumerate() {
            for (j, n) in shape(*c).iter().enumerate() {
                assert_eq!(*n, f64::from(u8::from(i == j)));
            }
        }
        let xi = DVec3::new(0.3, -0.7, 0.1);
        assert!((shape(xi).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!(gradients(xi).iter().sum::<DVec3>().length() < 1e-15);
    }

    #[test]
    fn jacobian_is_the_derivative_of_place() {
        let (corners, xi, d) = (bent(), DVec3::new(0.2, 0.5, -0.4), 1e-6);
        for axis in DVec3::AXES {
            let slope =
                (place(&corners, xi + d * axis) - place(&corners, xi - d * axis)) / (2.0 * d);
            assert!((jacobian(&corners, xi) * axis - slope).length() < 1e-9);
        }
    }

    #[test]
    fn volume_is_the_divergence_theorem_over_the_faces() {
        // A bilinear face encloses with the origin the mean of its two splits into triangles.
        let corners = bent();
        let cone =
            |a: usize, b: usize, c: usize| corners[a].dot(corners[b].cross(corners[c])) / 6.0;
        let expected: f64 = FACES
            .iter()
            .map(|&[a, b, c, d]| {
                0.5 * (cone(a, b, c) + cone(a, c, d) + cone(a, b, d) + cone(b, c, d))
            })
            .sum();
        assert!((volume(&corners) - expected).abs() < 1e-12 * expected);
    }

    #[test]
    fn natural_inverts_place_inside_and_somewhat_outside() {
        let corners = bent();
        for xi in [
            DVec3::ZERO,
            DVec3::new(1.0, -1.0, 1.0),
            DVec3::new(0.9, 0.99, -0.3),
            DVec3::new(1.4, 0.0, -1.3),
        ] {
            assert!(
                (crate::element::hex8::locate(&corners, place(&corners, xi)).unwrap() - xi)
                    .length()
                    < 1e-10
            );
        }
    }

    #[test]
    fn faces_look_outward_and_corners_are_right_handed() {
        for (f, face) in FACES.iter().enumerate() {
            let [a, b, c, d] = face.map(|i| CORNERS[i]);
            assert!((c - a).cross(d - b).dot(a + b + c + d) > 0.0, "face {f}");
        }
        for corner in 0..8 {
            assert_eq!(corner_quality(&CORNERS, corner), 1.0, "corner {corner}");
        }
    }
}
