//! A brick whose shear strain does not see bending: what a plain brick lets vary along the two edges
//! that it shears, it takes from the middle of them (assumed natural strains: MacNeal 1982, Dvorkin
//! and Bathe 1984). A plain brick that bends is held by shear that is not there, its incompatible
//! modes would free it; but in a brick that softens they would let one crack be two halves. Normal
//! strain is that of the plain brick, so that what softens does so over the whole of it.
//!
//! In axes of the brick's own, orthonormal and along its edges as nearly as can be, γ₁₂ at (ξ, η, ζ)
//! is that at (0, 0, ζ): constant strain stays exact whatever the shape, and twisting keeps its
//! stiffness.

use glam::{DMat3, DVec3};

use super::{
    Element, ElementError,
    hex8::{GAUSS, gradients, jacobian},
};
use crate::tensor::{self, Frame, Tangent, Voigt};

/// The planes of each component of shear, and the edge across both.
const PAIRS: [(usize, usize, usize); 3] = [(0, 1, 2), (1, 2, 0), (2, 0, 1)];

/// Strain at a natural coordinate as rows over the nodes' displacements (1/m).
///
/// # Errors
/// [`ElementError::Inverted`].
pub(crate) fn rows(nodes: &[DVec3; 8], natural: DVec3) -> Result<[[f64; 24]; 6], ElementError> {
    let axes = axes(nodes);
    let slopes = |natural: DVec3| along(nodes, natural, 0, &axes).map(|(slopes, _)| slopes);
    let [a, b, c] = [0, 1, 2].map(|across| slopes(middle(natural, across)));
    let local = rows_of(&slopes(natural)?, [&a?, &b?, &c?], &axes);
    Ok(in_the_world(&local, &axes))
}

/// Stiffness and internal force. The law is that of [`super::hex8::integrate`].
///
/// # Errors
/// As there.
pub(crate) fn integrate(
    nodes: &[DVec3; 8],
    u: &[f64; 24],
    mut law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<Element<24>, ElementError> {
    let axes = axes(nodes);
    // The brick's axes in the world's, and the other way round.
    let own: Frame = axes.to_cols_array_2d();
    let world = tensor::transposed(&own);
    let is_turned = axes != DMat3::IDENTITY;
    let middles = middles(nodes, &axes)?;
    let mut sum = Element::zero();
    for (point, natural) in GAUSS.into_iter().enumerate() {
        let (here, det) = along(nodes, natural, point, &axes)?;
        let middles = [0, 1, 2].map(|k| &middles[k][usize::from(natural[k] > 0.0)]);
        let rows = rows_of(&here, middles, &axes);
        let mut strain = tensor::ZERO;
        for (e, row) in strain.iter_mut().zip(&rows) {
            *e = row.iter().zip(u).map(|(r, u)| r * u).sum();
        }
        // What the law says is turned, not the rows: it has fewer numbers.
        let (stress, tangent) = if is_turned {
            let (stress, tangent) = law(point, &tensor::rotate_strain(&strain, &world));
            (tensor::rotate_stress(&stress, &own), tensor::rotate_tangent(&tangent, &world))
        } else {
            law(point, &strain)
        };
        sum.add(&rows, &stress, &tangent, det);
    }
    sum.finite()
}

/// The orthonormal axes nearest to the three mean edges: the first along the first, the second in
/// the plane of the first two.
fn axes(nodes: &[DVec3; 8]) -> DMat3 {
    let edges = jacobian(nodes, DVec3::ZERO);
    let first = edges.x_axis.normalize_or_zero();
    let third = first.cross(edges.y_axis).normalize_or_zero();
    DMat3::from_cols(first, third.cross(first), third)
}

/// Gradients of the nodes' shape functions along the brick's axes.
type Slopes = [[f64; 3]; 8];

/// These at a natural coordinate, and the determinant of ∂x/∂ξ.
fn along(
    nodes: &[DVec3; 8],
    natural: DVec3,
    point: usize,
    axes: &DMat3,
) -> Result<(Slopes, f64), ElementError> {
    let (all, det) = gradients(nodes, natural, point)?;
    let back = axes.transpose();
    Ok((all.map(|g| (back * g).to_array()), det))
}

/// The middle of the plane across a natural axis in which a point lies.
fn middle(natural: DVec3, across: usize) -> DVec3 {
    DVec3::AXES[across] * natural[across]
}

/// These in the middles of the planes in which the Gauss points lie: by the axis across them, and
/// below or above zero.
fn middles(nodes: &[DVec3; 8], axes: &DMat3) -> Result<[[Slopes; 2]; 3], ElementError> {
    let mut all = [[[[0.0; 3]; 8]; 2]; 3];
    for (across, two) in all.iter_mut().enumerate() {
        for (slopes, natural) in two.iter_mut().zip([GAUSS[0], GAUSS[6]]) {
            *slopes = along(nodes, middle(natural, across), 0, axes)?.0;
        }
    }
    Ok(all)
}

/// Strains along the brick's axes as rows over displacements along the world's: of the slopes
/// here, and, by the axis across which that is, in the middle.
fn rows_of(here: &Slopes, middles: [&Slopes; 3], axes: &DMat3) -> [[f64; 24]; 6] {
    let mut rows = [[0.0; 24]; 6];
    let mut put = |row: usize, node: usize, along: DVec3, by: f64| {
        (0..3).for_each(|c| rows[row][3 * node + c] += by * along[c]);
    };
    for (node, slopes) in here.iter().enumerate() {
        (0..3).for_each(|i| put(i, node, axes.col(i), slopes[i]));
    }
    for (row, (i, j, across)) in (3..).zip(PAIRS) {
        for (node, slopes) in middles[across].iter().enumerate() {
            put(row, node, axes.col(i), slopes[j]);
            put(row, node, axes.col(j), slopes[i]);
        }
    }
    rows
}

/// Strains along the brick's axes as strains along the world's.
fn in_the_world(local: &[[f64; 24]; 6], axes: &DMat3) -> [[f64; 24]; 6] {
    if *axes == DMat3::IDENTITY {
        return *local;
    }
    // Rows: the world's axes in the brick's.
    let back: Frame = axes.to_cols_array_2d();
    let back = tensor::transposed(&back);
    let mut world = [[0.0; 24]; 6];
    for column in 0..24 {
        let strain: Voigt = std::array::from_fn(|k| local[k][column]);
        let turned = tensor::rotate_strain(&strain, &back);
        (0..6).for_each(|k| world[k][column] = turned[k]);
    }
    world
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::hex8::{self, CORNERS, Kind, Modes};

    fn skewed() -> [DVec3; 8] {
        let turn = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_z(-0.7);
        let mut nodes = CORNERS.map(|c| turn * (DVec3::new(0.05, 0.07, 0.04) * c));
        nodes[2] += DVec3::new(0.004, -0.006, 0.003);
        nodes[7] += DVec3::new(-0.005, 0.002, 0.006);
        nodes
    }

    fn displaced(nodes: &[DVec3; 8], field: impl Fn(DVec3) -> DVec3) -> [f64; 24] {
        let all: Vec<f64> = nodes.iter().flat_map(|p| field(*p).to_array()).collect();
        all.try_into().unwrap()
    }

    /// Constant strain is exact in a brick of any shape, and turning makes none.
    #[test]
    fn constant_strain_and_no_strain_are_exact() {
        let nodes = skewed();
        let wanted: Voigt = [1e-3, -2e-3, 5e-4, 8e-4, -3e-4, 1.2e-3];
        let field = |p: DVec3| {
            let [x, y, z, xy, yz, zx] = wanted;
            DVec3::new(
                x * p.x + 0.5 * xy * p.y + 0.5 * zx * p.z,
                0.5 * xy * p.x + y * p.y + 0.5 * yz * p.z,
                0.5 * zx * p.x + 0.5 * yz * p.y + z * p.z,
            )
        };
        let turned = |p: DVec3| DVec3::new(3e-3, -2e-3, 1e-3).cross(p) + DVec3::splat(0.01);
        for natural in GAUSS {
            let rows = rows(&nodes, natural).unwrap();
            let strain = |u: &[f64; 24]| rows.map(|r| r.iter().zip(u).map(|(r, u)| r * u).sum());
            let found: Voigt = strain(&displaced(&nodes, field));
            assert!(found.iter().zip(wanted).all(|(f, w)| (f - w).abs() < 1e-12), "{found:?}");
            let still: Voigt = strain(&displaced(&nodes, turned));
            assert!(still.iter().all(|f: &f64| f.abs() < 1e-12), "{still:?}");
        }
    }

    /// Bent about each of its axes, a brick of edges a has the energy of a bent bar, E I κ² a/2 (a
    /// plain one half as much again and more), wherever it is turned to; and nothing but moving as
    /// a whole costs no energy.
    #[test]
    fn bending_makes_no_shear() {
        let (e, a) = (30e9, 0.1);
        let hooke = tensor::stiffness(e, 0.0);
        let law = |_: usize, strain: &Voigt| (tensor::apply(&hooke, strain), hooke);
        let turn = DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(1.1);
        let nodes = CORNERS.map(|c| turn * (0.5 * a * c));
        let energy = |k: &[[f64; 24]; 24], u: &[f64; 24]| {
            let force = k.map(|row| row.iter().zip(u).map(|(k, u)| k * u).sum::<f64>());
            0.5 * force.iter().zip(u).map(|(f, u)| f * u).sum::<f64>()
        };
        let assumed = integrate(&nodes, &[0.0; 24], law).unwrap().stiffness;
        let plain =
            hex8::integrate(Kind::Plain, &nodes, &[0.0; 24], &mut Modes::default(), law).unwrap();
        let by_hand = 0.5 * e * a.powi(4) / 12.0 * a;
        for (i, j) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
            let field = |p: DVec3| {
                let local = turn.transpose() * p;
                // What the corners can show of u_i = −x_i x_j, u_j = x_i²/2.
                turn * (DVec3::AXES[i] * (-local[i] * local[j]))
            };
            let u = displaced(&nodes, field);
            assert!((energy(&assumed, &u) / by_hand - 1.0).abs() < 1e-9);
            assert!(energy(&plain.stiffness, &u) / by_hand > 1.4);
        }
        let matrix = nalgebra::SMatrix::<f64, 24, 24>::from_fn(|r, c| assumed[r][c]);
        let values = matrix.symmetric_eigenvalues();
        let free = values.iter().filter(|v| **v < 1e-9 * values.max()).count();
        assert_eq!(free, 6, "{values}");
    }
}
