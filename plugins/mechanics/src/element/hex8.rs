//! The brick of eight nodes (VTK's and Abaqus' order), 2×2×2 Gauss points.
//!
//! With trilinear displacements alone it locks: a beam one element deep bends at two thirds of
//! Timoshenko's deflection. Wilson's incompatible modes add u = Σ_i (1 − ξ_i²) α_i, three vectors α
//! per element, so that it can bend. Their gradient is taken with the Jacobian of the centre,
//! scaled by j₀/j (Taylor, Beresford, Wilson 1976, "QM6"):
//!
//! ```text
//! ∇M_i = (j₀/j) J₀⁻ᵀ e_i (−2 ξ_i)          ∫ ∇M_i dV = j₀ J₀⁻ᵀ e_i Σ_p (−2 ξ_i) = 0
//! ```
//!
//! The integral vanishes on any shape, so a constant stress does no work on the modes: the patch
//! test is exact on distorted meshes. The nine unknowns are private to the element and condensed:
//! f_α(u, α) = 0 defines α(u), ∂α/∂u = −K_αα⁻¹ K_αu, and K = K_uu − K_uα K_αα⁻¹ K_αu.

use super::{Element, ElementError, assumed};
use crate::tensor::{Tangent, Voigt};
use glam::{DMat3, DVec3};
use nalgebra::{SMatrix, SVector};

/// Natural coordinates of the nodes.
pub(crate) const CORNERS: [DVec3; 8] = [
    DVec3::new(-1.0, -1.0, -1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-1.0, -1.0, 1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, 1.0, 1.0),
    DVec3::new(-1.0, 1.0, 1.0),
];

const G: f64 = 0.577_350_269_189_625_8;

/// Gauss points; point p is the one nearest to node p. All weights are 1.
pub(crate) const GAUSS: [DVec3; 8] = [
    DVec3::new(-G, -G, -G),
    DVec3::new(G, -G, -G),
    DVec3::new(G, G, -G),
    DVec3::new(-G, G, -G),
    DVec3::new(-G, -G, G),
    DVec3::new(G, -G, G),
    DVec3::new(G, G, G),
    DVec3::new(-G, G, G),
];

/// Which strains the displacement component i makes: (place in [`Voigt`], axis of the gradient).
const TERMS: [[(usize, usize); 3]; 3] =
    [[(0, 0), (3, 1), (5, 2)], [(1, 1), (3, 0), (4, 2)], [(2, 2), (4, 1), (5, 0)]];

/// Local Newton steps for the modes before the element gives up and says how far it is off.
const STEPS: usize = 25;
/// Residual of the modes, relative to the stresses that work on them.
const SETTLED: f64 = 1e-10;

/// What strains the brick can take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Trilinear displacements, fully integrated (C3D8). Locks in bending; for parity with other
    /// codes.
    Plain,
    /// Volume change averaged over the element (B-bar; Hughes 1980): for flow that keeps the
    /// volume. Locks in bending all the same.
    MeanDilatation,
    /// Shear strain that does not see bending ([`super::assumed`]); for bricks that soften.
    Assumed,
    /// Incompatible modes (C3D8I).
    #[default]
    Incompatible,
}

/// The nine internal unknowns of an element with incompatible modes: α of (1 − ξ²), (1 − η²), (1 −
/// ζ²), each x, y, z (m).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Modes(pub [f64; 9]);

impl Modes {
    /// Moves the modes with a change of the nodes' displacements, as the element that was
    /// integrated before foresees it: exact for linear laws, and the classical one-step update of a
    /// global Newton iteration otherwise.
    #[cfg(test)]
    pub(crate) fn advance(&mut self, solid: &Solid, change: &[f64; 24]) {
        for ((mode, follow), step) in self.0.iter_mut().zip(&solid.follow).zip(&solid.step) {
            *mode += step + dot(follow, change);
        }
    }
}

/// A brick's stiffness and internal force, modes condensed.
#[derive(Clone, Debug)]
pub struct Solid {
    /// ∂force/∂u (N/m).
    pub stiffness: [[f64; 24]; 24],
    /// Internal force (N), node by node.
    pub force: [f64; 24],
    /// ∂α/∂u = −K_αα⁻¹ K_αu.
    pub follow: [[f64; 24]; 9],
    /// What the modes still have to move, −K_αα⁻¹ f_α; its effect on the force is in `force`
    /// already.
    pub step: [f64; 9],
    /// How far the modes are from equilibrium: |f_α| over the stresses that work on them or, where
    /// those are rounding themselves, the strain that `step` would add over the strain there is.
    /// Above 1e-10 the local iteration did not converge and the load step should be cut.
    pub unsettled: f64,
}

/// N_a = (1 + ξ ξ_a)(1 + η η_a)(1 + ζ ζ_a)/8.
#[must_use]
pub(crate) fn shape(natural: DVec3) -> [f64; 8] {
    CORNERS.map(|c| {
        let f = DVec3::ONE + natural * c;
        0.125 * f.x * f.y * f.z
    })
}

/// ∂N_a/∂(ξ, η, ζ).
#[must_use]
pub(crate) fn slopes(natural: DVec3) -> [DVec3; 8] {
    CORNERS.map(|c| {
        let f = DVec3::ONE + natural * c;
        0.125 * c * DVec3::new(f.y * f.z, f.z * f.x, f.x * f.y)
    })
}

/// The point of natural coordinates.
#[must_use]
pub fn position(nodes: &[DVec3; 8], natural: DVec3) -> DVec3 {
    shape(natural).iter().zip(nodes).map(|(n, x)| *n * *x).sum()
}

/// ∂x/∂(ξ, η, ζ), one column a direction.
#[must_use]
pub(crate) fn jacobian(nodes: &[DVec3; 8], natural: DVec3) -> DMat3 {
    jacobian_of(nodes, &slopes(natural))
}

fn jacobian_of(nodes: &[DVec3; 8], slopes: &[DVec3; 8]) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for (x, d) in nodes.iter().zip(slopes) {
        sum.x_axis += d.x * *x;
        sum.y_axis += d.y * *x;
        sum.z_axis += d.z * *x;
    }
    sum
}

/// Gradients of the nodes' shapes (1/m), and the determinant of ∂x/∂ξ (m³).
///
/// # Errors
/// [`ElementError::Inverted`], naming the integration point `point`.
pub(super) fn gradients(
    nodes: &[DVec3; 8],
    natural: DVec3,
    point: usize,
) -> Result<([DVec3; 8], f64), ElementError> {
    let slopes = slopes(natural);
    let matrix = jacobian_of(nodes, &slopes);
    let det = right_way_round(matrix.determinant(), point)?;
    let inverse = matrix.inverse().transpose();
    Ok((slopes.map(|slope| inverse * slope), det))
}

/// Natural coordinates of a point (Newton from the centre); also answers somewhat outside the
/// element, where a coordinate is beyond ±1. `None` if Newton does not converge: the point is far
/// outside, or the element folded.
#[must_use]
pub(crate) fn locate(nodes: &[DVec3; 8], point: DVec3) -> Option<DVec3> {
    let size = (nodes[6] - nodes[0]).length().max((nodes[7] - nodes[1]).length());
    let mut natural = DVec3::ZERO;
    for _ in 0..30 {
        let miss = point - position(nodes, natural);
        if miss.length() <= 4e-15 * (size + point.length()) {
            return Some(natural);
        }
        let matrix = jacobian(nodes, natural);
        let step = matrix.inverse() * miss;
        natural += step;
        if !natural.is_finite() || natural.abs().max_element() > 1e3 {
            return None;
        }
        if step.abs().max_element() < 1e-14 {
            return Some(natural);
        }
    }
    ((point - position(nodes, natural)).length() < 1e-10 * size).then_some(natural)
}

/// Volume (m³).
///
/// # Errors
/// [`ElementError::Inverted`].
#[cfg(test)]
pub(crate) fn volume(nodes: &[DVec3; 8]) -> Result<f64, ElementError> {
    let mut sum = 0.0;
    for (point, natural) in GAUSS.into_iter().enumerate() {
        sum += right_way_round(jacobian(nodes, natural).determinant(), point)?;
    }
    Ok(sum)
}

pub(super) fn right_way_round(jacobian: f64, point: usize) -> Result<f64, ElementError> {
    if jacobian > 0.0 && jacobian.is_finite() {
        Ok(jacobian)
    } else {
        Err(ElementError::Inverted { point, jacobian })
    }
}

/// Integrates the element: `law(point, strain)` answers stress and tangent.
///
/// With incompatible modes, α is moved by Newton steps at fixed u until f_α = 0, starting from
/// `modes` (the last converged state, or zeros), and left there: the answer is a function of u
/// alone, and `stiffness` is its consistent derivative. A linear law takes two sweeps of the eight
/// points, one where f_α vanishes already (at rest). The law's tangent should be consistent; with a
/// secant one the steps converge more slowly. What is left when they run out is corrected to first
/// order and told in `unsettled`. Where K_αα is singular (a fully damaged element) the modes stand
/// still.
///
/// # Errors
/// [`ElementError::Inverted`] by the shape, [`ElementError::NotFinite`] by displacements or law.
pub(crate) fn integrate(
    kind: Kind,
    nodes: &[DVec3; 8],
    u: &[f64; 24],
    modes: &mut Modes,
    law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<Solid, ElementError> {
    match kind {
        Kind::Incompatible => settle(&Map::new(nodes)?, u, modes, law),
        _ => linearize(kind, nodes, u, modes, law),
    }
}

/// One sweep without moving the modes; `force` and `stiffness` are condensed all the same, and
/// `step` tells where the modes want to go.
///
/// This is also the derivative of the condensed force with respect to a parameter of the law, at
/// fixed u: let the law answer (∂stress/∂parameter, tangent) in a converged state; then `force` is
/// ∂force/∂parameter and `step` ∂α/∂parameter. So the dual reads what softening of an element does.
///
/// # Errors
/// As [`integrate`].
pub(crate) fn linearize(
    kind: Kind,
    nodes: &[DVec3; 8],
    u: &[f64; 24],
    modes: &Modes,
    mut law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<Solid, ElementError> {
    match kind {
        Kind::Incompatible => {
            sweep(&Map::new(nodes)?, &columns::<12>(u, &modes.0), &mut law)?.condense()
        }
        Kind::Plain => sweep(&Map::new(nodes)?, &columns::<8>(u, &[]), &mut law)?.plain(),
        Kind::Assumed => {
            let Element { stiffness, force } = assumed::integrate(nodes, u, law)?;
            let (follow, step) = ([[0.0; 24]; 9], [0.0; 9]);
            Ok(Solid { stiffness, force, follow, step, unsettled: 0.0 })
        }
        Kind::MeanDilatation => {
            sweep(&Map::averaged(nodes)?, &columns::<8>(u, &[]), &mut law)?.plain()
        }
    }
}

/// Newton for the modes: f_α(u, α) = 0.
fn settle(
    map: &Map,
    u: &[f64; 24],
    modes: &mut Modes,
    mut law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<Solid, ElementError> {
    for _ in 0..STEPS {
        let sum = sweep(map, &columns::<12>(u, &modes.0), &mut law)?;
        match sum.relax() {
            Some((step, unsettled)) if unsettled > SETTLED => {
                modes.0.iter_mut().zip(step).for_each(|(mode, step)| *mode += step)
            }
            _ => return sum.condense(),
        }
    }
    sweep(map, &columns::<12>(u, &modes.0), &mut law)?.condense()
}

/// The strain at a natural coordinate as rows over the nodes' displacements and over the modes.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    /// ∂strain/∂u at fixed modes (1/m).
    pub nodes: [[f64; 24]; 6],
    /// ∂strain/∂α (1/m).
    pub modes: [[f64; 9]; 6],
}

impl Rows {
    /// The strain itself.
    #[must_use]
    pub(crate) fn strain(&self, u: &[f64; 24], modes: &Modes) -> Voigt {
        std::array::from_fn(|k| dot(&self.nodes[k], u) + dot(&self.modes[k], &modes.0))
    }

    /// What a strain gauge sees of the nodes: the row g of ⟨g, u⟩, modes following their nodes (g =
    /// B + G ∂α/∂u, `follow` of the integrated element). With an initial strain or a nonlinear law
    /// the strain is not g·u but has this derivative; the difference to [`Rows::strain`] is the
    /// reading at u = 0.
    #[must_use]
    pub(crate) fn gauge(&self, follow: &[[f64; 24]; 9]) -> [[f64; 24]; 6] {
        let mut rows = self.nodes;
        for (row, by_mode) in rows.iter_mut().zip(&self.modes) {
            for (g, follow) in by_mode.iter().zip(follow) {
                row.iter_mut().zip(follow).for_each(|(r, f)| *r += g * f);
            }
        }
        rows
    }
}

/// The same for stress, with the tangent at the gauge's place.
#[must_use]
pub(crate) fn stress_gauge(strain: &[[f64; 24]; 6], tangent: &Tangent) -> [[f64; 24]; 6] {
    tangent.map(|d| std::array::from_fn(|c| (0..6).map(|k| d[k] * strain[k][c]).sum()))
}

/// Strain rows at a natural coordinate.
///
/// # Errors
/// [`ElementError::Inverted`].
pub(crate) fn rows(kind: Kind, nodes: &[DVec3; 8], natural: DVec3) -> Result<Rows, ElementError> {
    if kind == Kind::Assumed {
        return Ok(Rows { nodes: assumed::rows(nodes, natural)?, modes: [[0.0; 9]; 6] });
    }
    let map = if kind == Kind::MeanDilatation { Map::averaged(nodes)? } else { Map::new(nodes)? };
    let mut rows = map.rows(natural)?;
    if kind != Kind::Incompatible {
        rows.modes = [[0.0; 9]; 6];
    }
    Ok(rows)
}

/// An element's shape, and what is the same at all its points.
struct Map<'a> {
    nodes: &'a [DVec3; 8],
    /// J₀⁻ᵀ and j₀ of the centre.
    centre: DMat3,
    centre_det: f64,
    /// Volume averages of the gradients, for the mean dilatation.
    mean: Option<[[f64; 8]; 3]>,
}

/// Gradients at a point: of N = 8 nodes, or of nodes, three modes and a blank.
struct Place<const N: usize> {
    gradients: [[f64; N]; 3],
    /// What is added to each normal strain: (mean gradient − gradient)/3.
    swelling: Option<[[f64; N]; 3]>,
    det: f64,
}

impl<'a> Map<'a> {
    fn new(nodes: &'a [DVec3; 8]) -> Result<Self, ElementError> {
        let matrix = jacobian(nodes, DVec3::ZERO);
        let centre_det = right_way_round(matrix.determinant(), 0)?;
        Ok(Self { nodes, centre: matrix.inverse().transpose(), centre_det, mean: None })
    }

    fn averaged(nodes: &'a [DVec3; 8]) -> Result<Self, ElementError> {
        let mut map = Self::new(nodes)?;
        let (mut mean, mut volume) = ([[0.0; 8]; 3], 0.0);
        for (point, natural) in GAUSS.into_iter().enumerate() {
            let place = map.place::<8>(natural, point)?;
            volume += place.det;
            for (m, g) in mean.as_flattened_mut().iter_mut().zip(place.gradients.as_flattened()) {
                *m += place.det * g;
            }
        }
        mean.as_flattened_mut().iter_mut().for_each(|m| *m /= volume);
        map.mean = Some(mean);
        Ok(map)
    }

    fn place<const N: usize>(
        &self,
        natural: DVec3,
        point: usize,
    ) -> Result<Place<N>, ElementError> {
        let (of_nodes, det) = gradients(self.nodes, natural, point)?;
        let mut gradients = [[0.0; N]; 3];
        let mut put = |a: usize, g: DVec3| (0..3).for_each(|axis| gradients[axis][a] = g[axis]);
        of_nodes.into_iter().enumerate().for_each(|(a, gradient)| put(a, gradient));
        if N > 8 {
            let top = -2.0 * natural * (self.centre_det / det);
            put(8, self.centre.x_axis * top.x);
            put(9, self.centre.y_axis * top.y);
            put(10, self.centre.z_axis * top.z);
        }
        let swelling = self.mean.map(|mean| {
            let mut swelling = [[0.0; N]; 3];
            for (axis, row) in swelling.iter_mut().enumerate() {
                for a in 0..8 {
                    row[a] = (mean[axis][a] - gradients[axis][a]) / 3.0;
                }
            }
            swelling
        });
        Ok(Place { gradients, swelling, det })
    }

    fn rows(&self, natural: DVec3) -> Result<Rows, ElementError> {
        let place = self.place::<12>(natural, 0)?;
        let mut rows = Rows { nodes: [[0.0; 24]; 6], modes: [[0.0; 9]; 6] };
        let mut put = |k: usize, a: usize, i: usize, value: f64| {
            if a < 8 {
                rows.nodes[k][3 * a + i] += value
            } else {
                rows.modes[k][3 * (a - 8) + i] += value
            }
        };
        for a in 0..11 {
            for (i, terms) in TERMS.iter().enumerate() {
                terms.iter().for_each(|&(k, axis)| put(k, a, i, place.gradients[axis][a]));
                if let Some(swelling) = &place.swelling {
                    (0..3).for_each(|k| put(k, a, i, swelling[i][a]));
                }
            }
        }
        Ok(rows)
    }
}

impl<const N: usize> Place<N> {
    fn strain(&self, x: &[[f64; N]; 3]) -> Voigt {
        let d = |i: usize, axis: usize| dot(&x[i], &self.gradients[axis]);
        let swell = self.swelling.as_ref().map_or(0.0, |s| (0..3).map(|i| dot(&x[i], &s[i])).sum());
        [
            d(0, 0) + swell,
            d(1, 1) + swell,
            d(2, 2) + swell,
            d(0, 1) + d(1, 0),
            d(1, 2) + d(2, 1),
            d(2, 0) + d(0, 2),
        ]
    }
}

/// Unknowns by component: x of all nodes (and modes), then y, then z. So the inner loops run over
/// nodes and use the whole width of the machine.
fn columns<const N: usize>(u: &[f64; 24], modes: &[f64]) -> [[f64; N]; 3] {
    let mut x = [[0.0; N]; 3];
    for (c, value) in u.iter().chain(modes).enumerate() {
        x[c % 3][c / 3] = *value;
    }
    x
}

/// Sums over the points, components outside, nodes inside.
struct Sum<const N: usize> {
    stiffness: [[[[f64; N]; 3]; N]; 3],
    force: [[f64; N]; 3],
    /// Stresses that work on the modes (N), steepest gradient of a mode (1/m), largest strain.
    work: f64,
    steepest: f64,
    strain: f64,
}

fn sweep<const N: usize>(
    map: &Map,
    x: &[[f64; N]; 3],
    law: &mut impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<Sum<N>, ElementError> {
    let mut sum = Sum {
        stiffness: [[[[0.0; N]; 3]; N]; 3],
        force: [[0.0; N]; 3],
        work: 0.0,
        steepest: 0.0,
        strain: 0.0,
    };
    for (point, natural) in GAUSS.into_iter().enumerate() {
        let place = map.place::<N>(natural, point)?;
        let strain = place.strain(x);
        let (stress, tangent) = law(point, &strain);
        sum.strain = sum.strain.max(largest(&strain));
        sum.add(&place, &stress, &tangent, place.det);
    }
    Ok(sum)
}

impl<const N: usize> Sum<N> {
    /// Adds Bᵀσ and BᵀDB of a point, B as three gradients a component ([`TERMS`]).
    fn add(&mut self, place: &Place<N>, stress: &Voigt, tangent: &Tangent, weight: f64) {
        let g = &place.gradients;
        let mut moved = [[[0.0; N]; 3]; 6];
        for (moved, d) in moved.iter_mut().zip(tangent) {
            for (j, (moved, [(k0, a0), (k1, a1), (k2, a2)])) in
                moved.iter_mut().zip(TERMS).enumerate()
            {
                let (d0, d1, d2) = (weight * d[k0], weight * d[k1], weight * d[k2]);
                for b in 0..N {
                    moved[b] = d0 * g[a0][b] + d1 * g[a1][b] + d2 * g[a2][b];
                }
                if let Some(swelling) = &place.swelling {
                    let d = weight * (d[0] + d[1] + d[2]);
                    (0..N).for_each(|b| moved[b] += d * swelling[j][b]);
                }
            }
        }
        // The blank in the modes' places stays empty.
        let rows = if N > 8 { 11 } else { 8 };
        for (i, [(k0, a0), (k1, a1), (k2, a2)]) in TERMS.into_iter().enumerate() {
            let [m0, m1, m2] = [k0, k1, k2].map(|k| moved[k].as_flattened());
            let sums = self.force[i].iter_mut().zip(&mut self.stiffness[i]).take(rows);
            for (a, (force, stiffness)) in sums.enumerate() {
                let (g0, g1, g2) = (g[a0][a], g[a1][a], g[a2][a]);
                *force += weight * (g0 * stress[k0] + g1 * stress[k1] + g2 * stress[k2]);
                for (((row, m0), m1), m2) in
                    stiffness.as_flattened_mut().iter_mut().zip(m0).zip(m1).zip(m2)
                {
                    *row += g0 * m0 + g1 * m1 + g2 * m2;
                }
            }
        }
        if let Some(swelling) = &place.swelling {
            self.swell(swelling, &moved, weight * (stress[0] + stress[1] + stress[2]));
        }
        if N > 8 {
            let steepest = g.iter().flat_map(|g| &g[8..]).fold(0.0, |m: f64, x| m.max(x.abs()));
            self.steepest = self.steepest.max(steepest);
            self.work += weight * steepest * largest(stress);
        }
    }

    /// The part of Bᵀ that averages the volume change.
    fn swell(&mut self, swelling: &[[f64; N]; 3], moved: &[[[f64; N]; 3]; 6], trace: f64) {
        for (i, swelling) in swelling.iter().enumerate() {
            for (a, s) in swelling.iter().enumerate() {
                self.force[i][a] += s * trace;
                let [m0, m1, m2] = [0, 1, 2].map(|k: usize| moved[k].as_flattened());
                for (((row, m0), m1), m2) in
                    self.stiffness[i][a].as_flattened_mut().iter_mut().zip(m0).zip(m1).zip(m2)
                {
                    *row += s * (m0 + m1 + m2);
                }
            }
        }
    }

    fn entry(&self, row: usize, column: usize) -> f64 {
        self.stiffness[row % 3][row / 3][column % 3][column / 3]
    }

    /// Node by node, without modes.
    fn plain(&self) -> Result<Solid, ElementError> {
        let mut solid = Solid {
            stiffness: [[0.0; 24]; 24],
            force: [0.0; 24],
            follow: [[0.0; 24]; 9],
            step: [0.0; 9],
            unsettled: 0.0,
        };
        for (i, (force, stiffness)) in self.force.iter().zip(&self.stiffness).enumerate() {
            for a in 0..8 {
                solid.force[3 * a + i] = force[a];
                let row = &mut solid.stiffness[3 * a + i];
                for j in 0..3 {
                    (0..8).for_each(|b| row[3 * b + j] = stiffness[a][j][b]);
                }
            }
        }
        if solid.force.iter().chain(solid.stiffness.as_flattened()).all(|x| x.is_finite()) {
            Ok(solid)
        } else {
            Err(ElementError::NotFinite)
        }
    }

    fn modes(&self) -> (SMatrix<f64, 9, 9>, [f64; 9]) {
        let off = std::array::from_fn(|m| self.force[m % 3][8 + m / 3]);
        (SMatrix::from_fn(|r, c| self.entry(24 + r, 24 + c)), off)
    }

    fn unsettled(&self, off: &[f64; 9], step: &[f64; 9]) -> f64 {
        let rest = largest(off);
        if rest == 0.0 {
            0.0
        } else {
            (rest / self.work).min(largest(step) * self.steepest / self.strain)
        }
    }

    /// Newton's step of the modes towards f_α = 0, and how far off they are; `None` where
    /// nothing holds them.
    fn relax(&self) -> Option<([f64; 9], f64)> {
        let (matrix, off) = self.modes();
        let step = matrix
            .lu()
            .solve(&SVector::from(off.map(|f| -f)))
            .filter(|x| x.iter().all(|x| x.is_finite()))?;
        Some((step.into(), self.unsettled(&off, step.as_ref())))
    }

    /// Node by node, modes condensed so that f_α = 0.
    fn condense(&self) -> Result<Solid, ElementError> {
        let mut solid = self.plain()?;
        let (matrix, off) = self.modes();
        let right =
            SMatrix::<f64, 9, 25>::from_fn(
                |r, c| if c < 24 { self.entry(24 + r, c) } else { off[r] },
            );
        let Some(solution) = matrix.lu().solve(&right).filter(|x| x.iter().all(|x| x.is_finite()))
        else {
            return Ok(solid);
        };
        for m in 0..9 {
            solid.step[m] = -solution[(m, 24)];
            solid.follow[m] = std::array::from_fn(|c| -solution[(m, c)]);
        }
        solid.unsettled = self.unsettled(&off, &solid.step);
        for (r, row) in solid.stiffness.iter_mut().enumerate() {
            for m in 0..9 {
                let k = self.entry(r, 24 + m);
                solid.force[r] += k * solid.step[m];
                row.iter_mut().zip(&solid.follow[m]).for_each(|(row, follow)| *row += k * follow);
            }
        }
        Ok(solid)
    }
}

fn largest<const N: usize>(x: &[f64; N]) -> f64 {
    x.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::bench_mesh::{
        Bench, bricks, crooked, differences, hooke, noise, off, pick, stiffening, times, unknowns,
    };
    use crate::element::load::{self, Face};

    const KINDS: [Kind; 3] = [Kind::Plain, Kind::MeanDilatation, Kind::Incompatible];

    fn elastic(c: &Tangent) -> impl FnMut(usize, &Voigt) -> (Voigt, Tangent) + use<> {
        let c = *c;
        move |_, strain| (times(&c, strain), c)
    }

    fn eigenvalues(stiffness: &[[f64; 24]; 24]) -> Vec<f64> {
        let matrix = SMatrix::<f64, 24, 24>::from_fn(|i, j| stiffness[i][j]);
        let mut values: Vec<f64> = nalgebra::DMatrix::from_fn(24, 24, |i, j| matrix[(i, j)])
            .symmetric_eigenvalues()
            .iter()
            .copied()
            .collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// MacNeal and Harder's cube of seven distorted bricks: outer corners moved linearly, inner
    /// ones found.
    #[test]
    fn patch_of_seven_distorted_bricks() {
        let inner = [
            [0.249, 0.342, 0.192],
            [0.826, 0.288, 0.288],
            [0.850, 0.649, 0.263],
            [0.273, 0.750, 0.230],
            [0.320, 0.186, 0.643],
            [0.677, 0.305, 0.683],
            [0.788, 0.693, 0.644],
            [0.165, 0.745, 0.702],
        ];
        let nodes: Vec<DVec3> = CORNERS
            .into_iter()
            .map(|c| 0.5 * (c + DVec3::ONE))
            .chain(inner.map(DVec3::from))
            .collect();
        let mut elements = vec![std::array::from_fn(|a| 8 + a)];
        for face in Face::ALL {
            let [a, b, c, d] = face.nodes();
            elements.push([a, b, c, d, 8 + a, 8 + b, 8 + c, 8 + d]);
        }
        let exact = |x: DVec3| {
            1e-3 * DVec3::new(
                x.x + 0.5 * (x.y + x.z),
                x.y + 0.5 * (x.x + x.z),
                x.z + 0.5 * (x.x + x.y),
            )
        };
        let c = hooke(1e6, 0.25);
        for kind in KINDS {
            let mut bench = Bench::new(48);
            for i in 0..24 {
                bench.fixed[i] = Some(exact(nodes[i / 3])[i % 3]);
            }
            for element in &elements {
                let solid = integrate(
                    kind,
                    &element.map(|n| nodes[n]),
                    &[0.0; 24],
                    &mut Modes::default(),
                    elastic(&c),
                )
                .unwrap();
                bench.add(&unknowns::<8, 24>(element), &solid.stiffness);
            }
            let u = bench.solve();
            for element in &elements {
                let mut modes = Modes::default();
                integrate(
                    kind,
                    &element.map(|n| nodes[n]),
                    &pick(&u, &unknowns::<8, 24>(element)),
                    &mut modes,
                    |_, strain| {
                        assert!(
                            off(&times(&c, strain), &[2000.0, 2000.0, 2000.0, 400.0, 400.0, 400.0])
                                < 1e-12,
                            "{kind:?} {strain:?}"
                        );
                        (times(&c, strain), c)
                    },
                )
                .unwrap();
                assert!(modes.0.iter().all(|m| m.abs() < 1e-17));
            }
        }
    }

    /// Tip deflection over Timoshenko's P L³/3EI + 6PL/5GA of a cantilever 10 × 1 × 1 of cubes.
    fn cantilever(kind: Kind, deep: usize) -> f64 {
        let c = hooke(3e4, 0.2);
        let (nodes, elements) = bricks([10 * deep, deep, deep], DVec3::new(10.0, 1.0, 1.0));
        let mut bench = Bench::new(3 * nodes.len());
        for element in &elements {
            let corners = element.map(|n| nodes[n]);
            let places = unknowns::<8, 24>(element);
            bench.add(
                &places,
                &integrate(kind, &corners, &[0.0; 24], &mut Modes::default(), elastic(&c))
                    .unwrap()
                    .stiffness,
            );
            if corners[1].x > 10.0 - 1e-9 {
                bench.push(
                    &places,
                    &load::traction(&corners, Face::abaqus(4).unwrap(), |_, _| DVec3::Z).unwrap(),
                );
            }
        }
        (0..bench.fixed.len())
            .filter(|i| nodes[i / 3].x == 0.0)
            .for_each(|i| bench.fixed[i] = Some(0.0));
        let u = bench.solve();
        let tip: Vec<f64> =
            (0..nodes.len()).filter(|&n| nodes[n].x > 10.0 - 1e-9).map(|n| u[3 * n + 2]).collect();
        tip.iter().sum::<f64>()
            / tip.len() as f64
            / (1000.0 / (3.0 * 3e4 / 12.0) + 1.2 * 10.0 / 12_500.0)
    }

    /// Reference: CalculiX 2.20, C3D8 and C3D8I, same meshes, three digits.
    #[test]
    fn cantilever_bends_with_modes_and_locks_without() {
        for (kind, deep, reference) in [
            (Kind::Plain, 1, 0.674),
            (Kind::Plain, 2, 0.888),
            (Kind::Incompatible, 1, 0.992),
            (Kind::Incompatible, 2, 0.994),
        ] {
            let ratio = cantilever(kind, deep);
            assert!((ratio - reference).abs() < 1e-3, "{kind:?}, {deep} deep: {ratio}");
        }
        assert!(cantilever(Kind::Incompatible, 1) >= 0.99);
    }

    #[test]
    fn six_rigid_motions_and_no_other_cost_nothing() {
        let nodes = crooked();
        for kind in KINDS {
            let stiffness = integrate(
                kind,
                &nodes,
                &[0.0; 24],
                &mut Modes::default(),
                elastic(&hooke(1.0, 0.2)),
            )
            .unwrap()
            .stiffness;
            let largest = stiffness.as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!((0..24).all(|i| {
                (0..24).all(|j| (stiffness[i][j] - stiffness[j][i]).abs() < 1e-15 * 10.0 * largest)
            }));
            let values = eigenvalues(&stiffness);
            assert!(
                values[..6].iter().all(|v| v.abs() < 1e-14) && values[6] > 1e-3,
                "{kind:?}: {values:?}"
            );
        }
    }

    /// At ν = 0.4999 only one of the 24 motions may be stiff with the bulk modulus; trilinear
    /// displacements make seven more.
    #[test]
    fn mean_dilatation_leaves_one_volumetric_mode() {
        let bulky = |kind| {
            let stiffness = integrate(
                kind,
                &CORNERS,
                &[0.0; 24],
                &mut Modes::default(),
                elastic(&hooke(3.0, 0.4999)),
            )
            .unwrap()
            .stiffness;
            eigenvalues(&stiffness).into_iter().filter(|v| *v > 50.0).count()
        };
        assert_eq!((bulky(Kind::MeanDilatation), bulky(Kind::Plain)), (1, 7));
        assert!(bulky(Kind::Incompatible) <= 4);
    }

    #[test]
    fn tangent_of_a_nonlinear_law_by_differences() {
        let (nodes, c, u) = (crooked(), hooke(1.0, 0.2), noise::<24>(1).map(|x| 0.3 * x));
        for kind in KINDS {
            let at = |u: &[f64; 24]| {
                integrate(kind, &nodes, u, &mut Modes::default(), |_, e| stiffening(&c, 5.0, e))
                    .unwrap()
            };
            let solid = at(&u);
            assert!(solid.unsettled <= 1e-10);
            let slope = differences(&u, 1e-5, |u| at(u).force);
            assert!(off(solid.stiffness.as_flattened(), slope.as_flattened()) < 1e-7, "{kind:?}");
        }
    }

    /// A free brick that is heated swells without stress.
    #[test]
    fn initial_strain_is_the_laws_affair() {
        let (nodes, c) = (crooked(), hooke(30e9, 0.2));
        let swollen: [f64; 24] = std::array::from_fn(|i| 1e-4 * nodes[i / 3][i % 3]);
        let hot = |_: usize, strain: &Voigt| {
            let left: Voigt = std::array::from_fn(|k| strain[k] - if k < 3 { 1e-4 } else { 0.0 });
            (times(&c, &left), c)
        };
        let mut asked = 0;
        let count = |point: usize, strain: &Voigt| {
            asked += 1;
            hot(point, strain)
        };
        let solid =
            integrate(Kind::Incompatible, &nodes, &swollen, &mut Modes::default(), count).unwrap();
        assert!(solid.force.iter().all(|f| f.abs() < 1e-12 * 30e9 * 1e-4));
        assert_eq!(asked, 8, "stresses that are mere rounding must not keep the modes busy");
    }

    /// Gauge rows and derivatives with respect to the law against finite differences of settled
    /// elements.
    #[test]
    fn gauges_and_softening_by_differences() {
        let (nodes, c, u) = (crooked(), hooke(1.0, 0.2), noise::<24>(3).map(|x| 0.2 * x));
        let law = |soft: f64| {
            move |point: usize, strain: &Voigt| {
                let f = if point < 3 { 1.0 - soft } else { 1.0 };
                let (stress, tangent) = stiffening(&c, 5.0, strain);
                (stress.map(|s| f * s), tangent.map(|row| row.map(|d| f * d)))
            }
        };
        let natural = DVec3::new(0.3, -0.6, 0.9);
        for kind in KINDS {
            let rows = rows(kind, &nodes, natural).unwrap();
            let at = |u: &[f64; 24], soft: f64| {
                let mut modes = Modes::default();
                let solid = integrate(kind, &nodes, u, &mut modes, law(soft)).unwrap();
                (solid, modes)
            };
            let (solid, modes) = at(&u, 0.0);
            let gauge = rows.gauge(&solid.follow);
            let h = 1e-5;
            for c in [0, 7, 14, 23] {
                let moved = |sign: f64| {
                    let mut u = u;
                    u[c] += sign * h;
                    rows.strain(&u, &at(&u, 0.0).1)
                };
                let (up, down) = (moved(1.0), moved(-1.0));
                assert!(
                    (0..6).all(|k| (gauge[k][c] - (up[k] - down[k]) / (2.0 * h)).abs() < 1e-7),
                    "{kind:?}"
                );
            }
            let softer = linearize(kind, &nodes, &u, &modes, |point, strain| {
                let (stress, tangent) = law(0.0)(point, strain);
                (stress.map(|s| if point < 3 { -s } else { 0.0 }), tangent)
            })
            .unwrap();
            let (up, down) = (at(&u, h), at(&u, -h));
            assert!(
                (0..24).all(|r| (softer.force[r] - (up.0.force[r] - down.0.force[r]) / (2.0 * h))
                    .abs()
                    < 1e-7),
                "{kind:?}"
            );
            assert!(
                (0..9)
                    .all(|m| (softer.step[m] - (up.1.0[m] - down.1.0[m]) / (2.0 * h)).abs() < 1e-7),
                "{kind:?}"
            );
        }
    }

    /// One-step update of the modes is exact for a linear law.
    #[test]
    fn modes_advance_with_their_nodes() {
        let (nodes, c, u) = (crooked(), hooke(1.0, 0.2), noise::<24>(5));
        let mut modes = Modes::default();
        let rest =
            integrate(Kind::Incompatible, &nodes, &[0.0; 24], &mut modes, elastic(&c)).unwrap();
        modes.advance(&rest, &u);
        let mut settled = Modes::default();
        integrate(Kind::Incompatible, &nodes, &u, &mut settled, elastic(&c)).unwrap();
        assert!(off(&modes.0, &settled.0) < 1e-12);
    }

    #[test]
    fn places_are_found_again() {
        let nodes = crooked();
        for seed in 0..20 {
            let natural = DVec3::from(noise::<3>(seed)) * 1.2;
            let found = locate(&nodes, position(&nodes, natural)).unwrap();
            assert!((found - natural).abs().max_element() < 1e-12);
        }
        assert!(locate(&[DVec3::ONE; 8], DVec3::ZERO).is_none());
    }

    #[test]
    fn what_is_folded_or_not_a_number_is_refused() {
        let mut nodes = CORNERS;
        nodes.swap(0, 1);
        let c = hooke(1.0, 0.2);
        assert!(matches!(
            integrate(Kind::Incompatible, &nodes, &[0.0; 24], &mut Modes::default(), elastic(&c)),
            Err(ElementError::Inverted { .. })
        ));
        assert!(matches!(volume(&[DVec3::NAN; 8]), Err(ElementError::Inverted { .. })));
        let mut u = [0.0; 24];
        u[5] = f64::NAN;
        assert_eq!(
            integrate(Kind::Plain, &CORNERS, &u, &mut Modes::default(), elastic(&c)).unwrap_err(),
            ElementError::NotFinite
        );
        // A wholly destroyed element holds nothing and is no error.
        let dead =
            integrate(Kind::Incompatible, &CORNERS, &noise(1), &mut Modes::default(), |_, _| {
                ([0.0; 6], [[0.0; 6]; 6])
            })
            .unwrap();
        assert!(dead.force.iter().all(|f| *f == 0.0));
    }
}
