//! One element: its stiffness, its forces, its stresses.

use glam::DVec3;
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use super::{
    law::Elastic,
    model::{Cell, Deck, Material, Orientation},
    shape::{Jet, Point, Shape, face_functions, face_places},
};
use crate::tensor::{self, Frame, Tangent, Voigt};

/// An element that is flat or turned inside out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Folded;

/// Functions at a point with their slopes in space, its place and its volume.
pub(super) struct At {
    pub(super) jets: Vec<Jet>,
    pub(super) slopes: Vec<[f64; 3]>,
    pub(super) place: DVec3,
    pub(super) volume: f64,
}

impl At {
    /// What a field of the nodes is there.
    pub(super) fn value(&self, nodes: &[f64]) -> f64 {
        self.jets.iter().zip(nodes).map(|(j, t)| j.value * t).sum()
    }
}

/// Temperatures of the nodes of an element: now, and where it has no strain.
pub(super) struct Warmth {
    pub(super) now: Vec<f64>,
    pub(super) cold: Vec<f64>,
}

/// An element with the places of its nodes.
pub(super) struct Element<'a> {
    cell: &'a Cell,
    material: &'a Material,
    orientation: Option<&'a Orientation>,
    places: Vec<DVec3>,
}

impl<'a> Element<'a> {
    pub(super) fn new(deck: &'a Deck, e: usize) -> Self {
        let cell = &deck.cells[e];
        Self {
            cell,
            material: &deck.materials[cell.material as usize],
            orientation: cell.orientation.map(|o| &deck.orientations[o as usize]),
            places: cell.nodes.iter().map(|&n| deck.nodes[n as usize]).collect(),
        }
    }

    pub(super) fn shape(&self) -> Shape {
        self.cell.shape
    }

    pub(super) fn material(&self) -> &Material {
        self.material
    }

    /// Rows ∂x/∂ξ.
    fn jacobian(&self, jets: &[Jet]) -> [DVec3; 3] {
        std::array::from_fn(|i| jets.iter().zip(&self.places).map(|(j, &x)| j.slope[i] * x).sum())
    }

    pub(super) fn at(&self, natural: [f64; 3], weight: f64) -> Result<At, Folded> {
        let jets = self.cell.shape.functions(natural);
        let place = self.place(&jets);
        if self.cell.shape == Shape::Bar {
            let (along, length) = self.bar().ok_or(Folded)?;
            // ∂ξ/∂x = 2/L along it, and nothing across.
            let slope = |jet: &Jet| (2.0 * jet.slope[0] / length * along).to_array();
            let slopes = jets.iter().map(slope).collect();
            return Ok(At {
                slopes,
                volume: 0.5 * weight * length * self.cell.across,
                jets,
                place,
            });
        }
        let jacobian = self.jacobian(&jets);
        let inverse = inverse_transposed(&jacobian).ok_or(Folded)?;
        let slopes = jets
            .iter()
            .map(|jet| (0..3).map(|i| jet.slope[i] * inverse[i]).sum::<DVec3>().to_array())
            .collect();
        let volume = weight * jacobian[0].dot(jacobian[1].cross(jacobian[2]));
        Ok(At { jets, slopes, place, volume })
    }

    /// Direction and length of a bar; none where its ends are one.
    fn bar(&self) -> Option<(DVec3, f64)> {
        let &[a, b] = self.places.as_slice() else { return None };
        Some(((b - a).try_normalize()?, a.distance(b)))
    }

    /// Points of integration.
    pub(super) fn points(&self) -> Vec<Point> {
        if self.cell.points.is_empty() {
            self.cell.shape.points()
        } else {
            self.cell.points.clone()
        }
    }

    /// The axes of its material there, as rows.
    pub(super) fn frame(&self, place: DVec3) -> Option<Frame> {
        self.orientation.map(|o| o.frame(place))
    }

    /// The law at a point of integration, and the strain of free swelling there.
    fn local(&self, point: usize, at: &At, warmth: &Warmth) -> (Tangent, Voigt) {
        let [now, cold] = self.warmth(point, at, warmth);
        let law = self.material.elastic.as_ref().map_or([[0.0; 6]; 6], |l| l.stiffness(now));
        let free = self.material.expansion.as_ref().map_or([0.0; 3], |l| l.strain(now, cold));
        let free = [free[0], free[1], free[2], 0.0, 0.0, 0.0];
        let (law, free) = match self.frame(at.place) {
            None => (law, free),
            Some(frame) => (
                tensor::rotate_tangent(&law, &frame),
                tensor::rotate_strain(&free, &tensor::transposed(&frame)),
            ),
        };
        match self.bar().filter(|_| self.cell.shape == Shape::Bar) {
            Some((along, _)) => (uniaxial(&law, along), free),
            None => (law, free),
        }
    }

    /// As [`Element::at`], with slopes and volume of the mean where the shape takes that, and with
    /// the slopes of bubbles after those of the nodes where it has some: 1 − ξ² of each axis, with
    /// the Jacobian of the middle so that a constant strain stays one (Taylor, Beresford and Wilson
    /// 1976).
    fn strained(&self, natural: [f64; 3], weight: f64) -> Result<At, Folded> {
        let mut at = self.at(natural, weight)?;
        if self.cell.shape == Shape::Hex8Mean {
            (at.slopes, at.volume) = self.mean()?;
        }
        if self.cell.shape != Shape::Hex8Bubbles {
            return Ok(at);
        }
        let middle = self.jacobian(&self.cell.shape.functions([0.0; 3]));
        let inverse = inverse_transposed(&middle).ok_or(Folded)?;
        let shrink = middle[0].dot(middle[1].cross(middle[2])) * weight / at.volume;
        let slope = |i: usize| (-2.0 * natural[i] * shrink * inverse[i]).to_array();
        at.slopes.extend((0..3).map(slope));
        Ok(at)
    }

    /// Slopes of its functions in the mean of its volume, and that volume.
    fn mean(&self) -> Result<(Vec<[f64; 3]>, f64), Folded> {
        let (mut sums, mut volume) = (vec![DVec3::ZERO; self.places.len()], 0.0);
        for (natural, weight) in Shape::Hex8.points() {
            let at = self.at(natural, weight)?;
            volume += at.volume;
            let slopes = at.slopes.iter().copied().map(DVec3::from_array);
            sums.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += at.volume * slope);
        }
        Ok((sums.into_iter().map(|sum| (sum / volume).to_array()).collect(), volume))
    }

    /// What keeps a brick of mean strain from deforming without any: four patterns of its nodes,
    /// less what of them is a linear field, each as stiff as E times what CalculiX takes (Flanagan
    /// and Belytschko 1981).
    fn hourglass(&self, warmth: &Warmth, k: &mut [f64]) -> Result<(), Folded> {
        let (slopes, volume) = self.mean()?;
        let warm = warmth.now.iter().sum::<f64>() / warmth.now.len() as f64;
        let young = match &self.material.elastic {
            Some(Elastic::Isotropic(table)) => table.at(warm)[0],
            Some(other) => other.stiffness(warm)[0][0],
            None => 0.0,
        };
        let slopes: Vec<DVec3> = slopes.into_iter().map(DVec3::from_array).collect();
        let squares: f64 = slopes.iter().map(|slope| slope.length_squared()).sum();
        let stiffness = HOURGLASS * young * volume * squares;
        for pattern in patterns() {
            let linear: DVec3 = pattern.iter().zip(&self.places).map(|(p, &x)| *p * x).sum();
            let own: Vec<f64> =
                pattern.iter().zip(&slopes).map(|(p, slope)| p - linear.dot(*slope)).collect();
            for (a, b) in pairs(own.len()) {
                let value = stiffness * own[a] * own[b];
                (0..3).for_each(|i| k[(3 * a + i) * 3 * own.len() + 3 * b + i] += value);
            }
        }
        Ok(())
    }

    /// K, row by row, and the forces of what strains it: warmth of the nodes and stress that it
    /// has from the beginning.
    pub(super) fn stiffness(
        &self,
        warmth: &Warmth,
        initial: impl Fn(usize) -> Voigt,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), Folded> {
        if self.cell.shape == Shape::Hex8Mean {
            self.hourglass(warmth, k)?;
        }
        match self.summed(warmth, &initial, k, f)? {
            Some((all, forces)) => condensed(&all, &forces, k, f),
            None => Ok(()),
        }
    }

    /// Sums over the points: into `k` and `f`, or, where there are bubbles, into a matrix and a
    /// vector with nine rows more.
    fn summed(
        &self,
        warmth: &Warmth,
        initial: &impl Fn(usize) -> Voigt,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<Option<(DMatrix<f64>, DVector<f64>)>, Folded> {
        let has_bubbles = self.cell.shape == Shape::Hex8Bubbles;
        let n = self.places.len() + if has_bubbles { 3 } else { 0 };
        let size = if has_bubbles { 3 * n } else { 0 };
        let mut all = (DMatrix::zeros(size, size), DVector::zeros(size));
        let (k, f) =
            if has_bubbles { (all.0.as_mut_slice(), all.1.as_mut_slice()) } else { (k, f) };
        for (p, (natural, weight)) in self.points().into_iter().enumerate() {
            let at = self.strained(natural, weight)?;
            let (law, free) = self.local(p, &at, warmth);
            let stress = tensor::sub(&tensor::apply(&law, &free), &initial(p));
            for a in 0..n {
                let force = transposed_times(&at.slopes[a], &stress);
                (0..3).for_each(|i| f[3 * a + i] += at.volume * force[i]);
                let rows = columns(&law, &at.slopes[a]);
                for b in 0..n {
                    for (j, row) in rows.iter().enumerate() {
                        let block = transposed_times(&at.slopes[b], row);
                        for (i, value) in block.iter().enumerate() {
                            k[(3 * b + i) * 3 * n + 3 * a + j] += at.volume * value;
                        }
                    }
                }
            }
        }
        Ok(has_bubbles.then_some(all))
    }

    /// Temperatures at a point, now and without strain. CalculiX takes the mean in a C3D8, and in a
    /// C3D20 what eight points say, linear between them, so that strain of warmth and of
    /// displacement are of one degree.
    fn warmth(&self, point: usize, at: &At, warmth: &Warmth) -> [f64; 2] {
        [&warmth.now, &warmth.cold].map(|nodes| match self.cell.shape {
            Shape::Hex8 => nodes.iter().sum::<f64>() / nodes.len() as f64,
            Shape::Hex20 => {
                let (natural, _) = Shape::Hex20.points()[point];
                let few = Shape::Hex20Reduced.points();
                let mean = |jets: &[Jet]| jets.iter().zip(nodes).map(|(j, t)| j.value * t).sum();
                // Weights of the eight points, each a corner of a cube of their own.
                let corners = few.iter().zip(natural_corners()).map(|((at, _), corner)| {
                    let share: f64 = (0..3)
                        .map(|i| 0.5 * (1.0 + corner[i] * natural[i] / at[i].abs()))
                        .product();
                    let mean: f64 = mean(&Shape::Hex20.functions(*at));
                    share * mean
                });
                corners.sum()
            }
            _ => at.value(nodes),
        })
    }

    /// Stress at every point for these displacements.
    pub(super) fn stresses(
        &self,
        displacement: &[f64],
        warmth: &Warmth,
        initial: impl Fn(usize) -> Voigt,
    ) -> Result<Vec<Voigt>, Folded> {
        let mut moved = displacement.to_vec();
        let n = moved.len();
        if self.cell.shape == Shape::Hex8Bubbles
            && let Some((bubbles, forces)) = self.summed(warmth, &initial, &mut [], &mut [])?
        {
            let inside = bubbles.view((n, n), (9, 9)).into_owned().cholesky().ok_or(Folded)?;
            let pulled = bubbles.view((n, 0), (9, n)) * DVector::from_column_slice(displacement);
            moved.extend(inside.solve(&(forces.rows(n, 9) - pulled)).iter());
        }
        let points = self.points().into_iter().enumerate();
        let stress = |(p, (natural, weight)): (usize, ([f64; 3], f64))| {
            let at = self.strained(natural, weight)?;
            let mut strain = tensor::ZERO;
            for (slope, u) in at.slopes.iter().zip(moved.as_chunks::<3>().0) {
                let parts = strains(slope);
                (0..6).for_each(|c| strain[c] += (0..3).map(|i| parts[i][c] * u[i]).sum::<f64>());
            }
            let (law, free) = self.local(p, &at, warmth);
            Ok(tensor::add(&tensor::apply(&law, &tensor::sub(&strain, &free)), &initial(p)))
        };
        points.map(stress).collect()
    }

    /// The place where its functions are these.
    fn place(&self, jets: &[Jet]) -> DVec3 {
        jets.iter().zip(&self.places).map(|(j, &x)| j.value * x).sum()
    }

    /// Forces of what acts on every piece of its volume, N/m³.
    pub(super) fn volume_force(&self, density: DVec3, f: &mut [f64]) -> Result<(), Folded> {
        for (natural, weight) in self.points() {
            let at = self.strained(natural, weight)?;
            let force = at.volume * density;
            for (jet, f) in at.jets.iter().zip(f.as_chunks_mut::<3>().0) {
                f.iter_mut().zip(force.to_array()).for_each(|(f, q)| *f += jet.value * q);
            }
        }
        Ok(())
    }

    /// Points of a face: the functions of its nodes there, and its area as a vector outward.
    pub(super) fn face_points(&self, face: usize) -> Vec<(Vec<Jet>, DVec3)> {
        let Some(nodes) = self.cell.shape.faces().nth(face) else { return Vec::new() };
        let point = |(natural, weight): ([f64; 2], f64)| {
            let jets = face_functions(nodes.len(), natural);
            let along = |i: usize| -> DVec3 {
                jets.iter().zip(nodes).map(|(j, &n)| j.slope[i] * self.places[n]).sum()
            };
            let area = weight * along(0).cross(along(1));
            (jets, area)
        };
        self.cell.shape.face_points(nodes.len()).into_iter().map(point).collect()
    }

    /// Forces of a pressure on a face.
    pub(super) fn pressure(&self, face: usize, pressure: f64, f: &mut [f64]) {
        let Some(nodes) = self.cell.shape.faces().nth(face) else { return };
        for (jets, area) in self.face_points(face) {
            for (jet, &n) in jets.iter().zip(nodes) {
                let force = -pressure * jet.value * area;
                (0..3).for_each(|i| f[3 * n + i] += force[i]);
            }
        }
    }

    /// ∫ ρ N Nᵀ, row by row.
    pub(super) fn mass(&self, warmth: &Warmth, m: &mut [f64]) -> Result<(), Folded> {
        let n = self.places.len();
        let own = &self.cell.points;
        let points = if own.is_empty() { self.cell.shape.fine_points() } else { own.clone() };
        for (natural, weight) in points {
            let at = self.at(natural, weight)?;
            let density = self.density(at.value(&warmth.now));
            for (a, b) in pairs(n) {
                let value = at.volume * density * at.jets[a].value * at.jets[b].value;
                (0..3).for_each(|i| m[(3 * a + i) * 3 * n + 3 * b + i] += value);
            }
        }
        Ok(())
    }

    /// ∫ ∇N · σ ∇N, row by row: what stresses add to the stiffness where displacements are small
    /// (Zienkiewicz and Taylor, vol. 2, ch. 10).
    pub(super) fn stress_stiffness(&self, stress: &[Voigt], k: &mut [f64]) -> Result<(), Folded> {
        let n = self.places.len();
        for ((natural, weight), stress) in self.points().into_iter().zip(stress) {
            let at = self.at(natural, weight)?;
            for (a, b) in pairs(n) {
                let pulled = DVec3::from_array(transposed_times(&at.slopes[a], stress));
                let value = at.volume * pulled.dot(DVec3::from_array(at.slopes[b]));
                (0..3).for_each(|i| k[(3 * a + i) * 3 * n + 3 * b + i] += value);
            }
        }
        Ok(())
    }

    /// kg/m³.
    pub(super) fn density(&self, temperature: f64) -> f64 {
        self.material.density.as_ref().map_or(0.0, |d| d.at(temperature)[0])
    }
}

/// Adds what is left of nodes and nine unknowns of bubbles: these bear no force from outside, so that
/// what they do follows from the rest.
fn condensed(
    all: &DMatrix<f64>,
    forces: &DVector<f64>,
    k: &mut [f64],
    f: &mut [f64],
) -> Result<(), Folded> {
    let n = f.len();
    let across = all.view((n, 0), (9, n)).into_owned();
    let inside = all.view((n, n), (9, 9)).into_owned().lu();
    let carried = across.transpose() * inside.solve(&across).ok_or(Folded)?;
    let bubbles = inside.solve(&forces.rows(n, 9).into_owned()).ok_or(Folded)?;
    let pushed = across.transpose() * bubbles;
    for i in 0..n {
        (0..n).for_each(|j| k[i * n + j] += all[(i, j)] - carried[(i, j)]);
        f[i] += forces[i] - pushed[i];
    }
    Ok(())
}

/// All pairs of so many.
pub(super) fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(move |a| (0..n).map(move |b| (a, b)))
}

/// ∂ξ/∂x of rows ∂x/∂ξ, as columns; none of what is flat or turned inside out.
fn inverse_transposed([a, b, c]: &[DVec3; 3]) -> Option<[DVec3; 3]> {
    let determinant = a.dot(b.cross(*c));
    let upright = determinant > 0.0 && determinant.is_finite();
    upright.then(|| [b.cross(*c), c.cross(*a), a.cross(*b)].map(|v| v / determinant))
}

/// Stiffness against hourglasses over E Σ|b|² V, b being the mean slopes.
const HOURGLASS: f64 = 0.0005;

/// ηζ, ζξ, ξη and ξηζ at the nodes of a brick.
fn patterns() -> [[f64; 8]; 4] {
    let places = face_places(4);
    let products = |i: usize| {
        let ([x, y], z) = (places[i % 4], if i < 4 { -1.0 } else { 1.0 });
        [y * z, z * x, x * y, x * y * z]
    };
    std::array::from_fn(|p| std::array::from_fn(|i| products(i)[p]))
}

/// A law of stress along one direction alone.
fn uniaxial(law: &Tangent, along: DVec3) -> Tangent {
    let [x, y, z] = along.to_array();
    let stress = Vector6::new(x * x, y * y, z * z, x * y, y * z, z * x);
    let strain = Matrix6::from_fn(|i, j| law[i][j]).cholesky().map(|law| law.solve(&stress));
    let young = strain.map_or(0.0, |strain| 1.0 / stress.dot(&strain));
    std::array::from_fn(|i| std::array::from_fn(|j| young * stress[i] * stress[j]))
}

/// The corners of a cube in the order of its eight points of integration.
fn natural_corners() -> impl Iterator<Item = [f64; 3]> {
    (0..8).map(|i| std::array::from_fn(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 }))
}

/// Strains of unit displacements of a node along x, y, z, by the slopes of its function.
fn strains([x, y, z]: &[f64; 3]) -> [Voigt; 3] {
    [[*x, 0.0, 0.0, *y, 0.0, *z], [0.0, *y, 0.0, *x, *z, 0.0], [0.0, 0.0, *z, 0.0, *y, *x]]
}

/// Stresses of unit displacements of a node.
fn columns(law: &Tangent, slope: &[f64; 3]) -> [Voigt; 3] {
    strains(slope).map(|strain| tensor::apply(law, &strain))
}

/// Bᵀ σ of a node.
fn transposed_times(slope: &[f64; 3], stress: &Voigt) -> [f64; 3] {
    let ([x, y, z], s) = (slope, stress);
    [x * s[0] + y * s[3] + z * s[5], y * s[1] + x * s[3] + z * s[4], z * s[2] + y * s[4] + x * s[5]]
}
