//! Scalar fields on bricks (temperature, humidity, non-local strain): ∫ c N Nᵀ, ∫ k ∇N ∇Nᵀ, ∫ q N,
//! and the same on faces.

use super::load::Face;
use super::{ElementError, hex8, quad};
use glam::DVec3;

/// A matrix over the eight nodes.
pub(crate) type Matrix = [[f64; 8]; 8];

/// A point of the brick: shape functions, their gradients (1/m), volume (m³).
struct Spot {
    shape: [f64; 8],
    gradients: [DVec3; 8],
    volume: f64,
}

fn spot(nodes: &[DVec3; 8], point: usize, natural: DVec3) -> Result<Spot, ElementError> {
    let matrix = hex8::jacobian(nodes, natural);
    let volume = hex8::right_way_round(matrix.determinant(), point)?;
    let turn = matrix.inverse().transpose();
    Ok(Spot {
        shape: hex8::shape(natural),
        gradients: hex8::slopes(natural).map(|d| turn * d),
        volume,
    })
}

/// ∫ c N_a N_b dV, c of the integration point: heat capacity, density (mass of each displacement
/// component), or 1. Its entries add up to ∫ c dV, its row sums are the lumped matrix.
///
/// # Errors
/// [`ElementError::Inverted`], as all functions here.
pub(crate) fn mass(
    nodes: &[DVec3; 8],
    mut density: impl FnMut(usize) -> f64,
) -> Result<Matrix, ElementError> {
    let mut sum = [[0.0; 8]; 8];
    for (point, natural) in hex8::GAUSS.into_iter().enumerate() {
        let spot = spot(nodes, point, natural)?;
        let c = density(point) * spot.volume;
        for (row, a) in sum.iter_mut().zip(spot.shape) {
            row.iter_mut().zip(spot.shape).for_each(|(m, b)| *m += c * a * b);
        }
    }
    Ok(sum)
}

/// ∫ k ∇N_a·∇N_b dV: conduction, or c of the implicit gradient.
///
/// # Errors
/// As [`mass`].
pub(crate) fn laplace(
    nodes: &[DVec3; 8],
    mut conductivity: impl FnMut(usize) -> f64,
) -> Result<Matrix, ElementError> {
    let mut sum = [[0.0; 8]; 8];
    for (point, natural) in hex8::GAUSS.into_iter().enumerate() {
        let spot = spot(nodes, point, natural)?;
        let k = conductivity(point) * spot.volume;
        for (row, a) in sum.iter_mut().zip(spot.gradients) {
            row.iter_mut().zip(spot.gradients).for_each(|(m, b)| *m += k * a.dot(b));
        }
    }
    Ok(sum)
}

/// ∫ q N_a dV: heat of hydration, or the local strain that the implicit gradient smooths.
///
/// # Errors
/// As [`mass`].
pub(crate) fn source(
    nodes: &[DVec3; 8],
    mut density: impl FnMut(usize) -> f64,
) -> Result<[f64; 8], ElementError> {
    let mut sum = [0.0; 8];
    for (point, natural) in hex8::GAUSS.into_iter().enumerate() {
        let spot = spot(nodes, point, natural)?;
        let q = density(point) * spot.volume;
        sum.iter_mut().zip(spot.shape).for_each(|(s, n)| *s += q * n);
    }
    Ok(sum)
}

/// A face that exchanges h (T − T_air): ∫ h N_a N_b dA and ∫ h N_a dA, the latter to be multiplied
/// by T_air (or, with h = 1, by a flux).
///
/// # Errors
/// [`ElementError::Degenerate`] for a face without area.
pub(crate) fn film(
    nodes: &[DVec3; 8],
    face: Face,
    exchange: f64,
) -> Result<(Matrix, [f64; 8]), ElementError> {
    let (corners, places) = (face.of(nodes), face.nodes());
    let (mut matrix, mut vector) = ([[0.0; 8]; 8], [0.0; 8]);
    for (point, gauss) in quad::GAUSS.into_iter().enumerate() {
        let spot = quad::spot(&corners, gauss, point)?;
        for (&a, na) in places.iter().zip(spot.shape) {
            vector[a] += exchange * spot.area * na;
            for (&b, nb) in places.iter().zip(spot.shape) {
                matrix[a][b] += exchange * spot.area * na * nb;
            }
        }
    }
    Ok((matrix, vector))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::crooked;

    /// A linear field has constant gradient: Tᵀ L T = k |∇T|² V and Tᵀ M 1 = ∫ T dV on any shape.
    #[test]
    fn linear_fields_are_exact_on_a_crooked_brick() {
        let nodes = crooked();
        let slope = DVec3::new(1.0, -2.0, 0.5);
        let t = nodes.map(|x| slope.dot(x) + 3.0);
        let volume = hex8::volume(&nodes).unwrap();
        let energy = |m: &Matrix, a: &[f64; 8], b: &[f64; 8]| -> f64 {
            (0..8).map(|i| a[i] * (0..8).map(|j| m[i][j] * b[j]).sum::<f64>()).sum()
        };
        let laplace = laplace(&nodes, |_| 2.0).unwrap();
        assert!((energy(&laplace, &t, &t) - 2.0 * slope.length_squared() * volume).abs() < 1e-12);
        assert!(laplace.iter().all(|row| row.iter().sum::<f64>().abs() < 1e-13));
        let mass = mass(&nodes, |_| 1.0).unwrap();
        assert!((energy(&mass, &[1.0; 8], &[1.0; 8]) - volume).abs() < 1e-13);
        let source =
            source(&nodes, |point| hex8::position(&nodes, hex8::GAUSS[point]).dot(slope) + 3.0)
                .unwrap();
        let by_mass: f64 = energy(&mass, &[1.0; 8], &t);
        assert!((source.iter().sum::<f64>() - by_mass).abs() < 1e-12);
    }

    /// A wall with film on one side and fixed on the other: T falls linearly, h (T_s − T_air) = k
    /// (T_0 − T_s)/L.
    #[test]
    fn wall_with_film() {
        let (k, h, length) = (2.0, 5.0, 0.4);
        let nodes = hex8::CORNERS.map(|c| 0.5 * (c + DVec3::ONE) * DVec3::new(length, 1.0, 1.0));
        let (film, air) = film(&nodes, Face::abaqus(4).unwrap(), h).unwrap();
        let conduction = laplace(&nodes, |_| k).unwrap();
        let warm = [1, 2, 5, 6];
        let matrix = nalgebra::SMatrix::<f64, 4, 4>::from_fn(|i, j| {
            conduction[warm[i]][warm[j]] + film[warm[i]][warm[j]]
        });
        let cold: [usize; 4] = [0, 3, 4, 7];
        let right = nalgebra::SVector::<f64, 4>::from_fn(|i, _| {
            10.0 * air[warm[i]] - 30.0 * cold.iter().map(|&c| conduction[warm[i]][c]).sum::<f64>()
        });
        let t = matrix.lu().solve(&right).unwrap();
        let exact = (k * 30.0 / length + h * 10.0) / (k / length + h);
        assert!(t.iter().all(|t| (t - exact).abs() < 1e-12));
    }
}
