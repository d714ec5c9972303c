//! One element: its stiffness, its forces, its stresses.

use glam::DVec3;

use super::{
    model::{Cell, Deck, Material, Orientation},
    shape::{Jet, Shape, face_functions},
};
use crate::tensor::{self, Tangent, Voigt};

/// An element that is flat or turned inside out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Folded;

/// Functions at a point with their slopes in space, its place and its volume.
struct At {
    jets: Vec<Jet>,
    slopes: Vec<[f64; 3]>,
    place: DVec3,
    volume: f64,
}

/// An element with the places of its nodes.
pub(super) struct Element<'a> {
    cell: &'a Cell,
    material: &'a Material,
    orientation: Option<&'a Orientation>,
    places: Vec<DVec3>,
}

impl<'a> Element<'a> {
    pub(super) fn new(deck: &'a Deck, cell: &'a Cell) -> Self {
        Self {
            cell,
            material: &deck.materials[cell.material as usize],
            orientation: cell.orientation.map(|o| &deck.orientations[o as usize]),
            places: cell.nodes.iter().map(|&n| deck.nodes[n as usize]).collect(),
        }
    }

    fn at(&self, natural: [f64; 3], weight: f64) -> Result<At, Folded> {
        let jets = self.cell.shape.functions(natural);
        let mut j = [[0.0; 3]; 3];
        let mut place = DVec3::ZERO;
        for (jet, x) in jets.iter().zip(&self.places) {
            place += jet.value * *x;
            for (row, slope) in j.iter_mut().zip(jet.slope) {
                row.iter_mut().zip(x.to_array()).for_each(|(j, x)| *j += slope * x);
            }
        }
        let [a, b, c] = j.map(DVec3::from_array);
        let determinant = a.dot(b.cross(c));
        if !(determinant > 0.0 && determinant.is_finite()) {
            return Err(Folded);
        }
        // Rows of the inverse's transpose: ∂ξ/∂x.
        let inverse = [b.cross(c), c.cross(a), a.cross(b)].map(|v| v / determinant);
        let slopes = jets
            .iter()
            .map(|jet| (0..3).map(|i| jet.slope[i] * inverse[i]).sum::<DVec3>().to_array())
            .collect();
        Ok(At { jets, slopes, place, volume: determinant * weight })
    }

    fn law(&self, place: DVec3) -> Tangent {
        match self.orientation {
            None => self.material.stiffness,
            Some(o) => tensor::rotate_tangent(&self.material.stiffness, &o.frame(place)),
        }
    }

    /// Strain of free swelling by one degree.
    fn swelling(&self, place: DVec3) -> Voigt {
        let [x, y, z] = self.material.expansion;
        let local = [x, y, z, 0.0, 0.0, 0.0];
        self.orientation
            .map_or(local, |o| tensor::rotate_strain(&local, &tensor::transposed(&o.frame(place))))
    }

    /// K, row by row, and the forces of what strains it: warmth of the nodes and stress that it
    /// has from the beginning.
    pub(super) fn stiffness(
        &self,
        warmth: &[f64],
        initial: impl Fn(usize) -> Voigt,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), Folded> {
        let n = self.places.len();
        for (p, (natural, weight)) in self.cell.shape.points().into_iter().enumerate() {
            let at = self.at(natural, weight)?;
            let law = self.law(at.place);
            let warm = self.warmth(p, &at.jets, warmth);
            let free = tensor::apply(&law, &tensor::scale(&self.swelling(at.place), warm));
            let stress = tensor::sub(&free, &initial(p));
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
        Ok(())
    }

    /// Temperature over that without strain at a point. CalculiX takes the mean in a C3D8, and in a
    /// C3D20 what eight points say, linear between them, so that strain of warmth and of
    /// displacement are of one degree.
    fn warmth(&self, point: usize, jets: &[Jet], nodes: &[f64]) -> f64 {
        let mean = |jets: &[Jet]| jets.iter().zip(nodes).map(|(j, t)| j.value * t).sum::<f64>();
        match self.cell.shape {
            Shape::Hex8 => nodes.iter().sum::<f64>() / nodes.len() as f64,
            Shape::Hex20 => {
                let (natural, _) = Shape::Hex20.points()[point];
                let few = Shape::Hex20Reduced.points();
                // Weights of the eight points, each a corner of a cube of their own.
                let corners = few.iter().zip(natural_corners()).map(|((at, _), corner)| {
                    let share: f64 = (0..3)
                        .map(|i| 0.5 * (1.0 + corner[i] * natural[i] / at[i].abs()))
                        .product();
                    share * mean(&Shape::Hex20.functions(*at))
                });
                corners.sum()
            }
            _ => mean(jets),
        }
    }

    /// Stress at every point for these displacements.
    pub(super) fn stresses(
        &self,
        displacement: &[f64],
        warmth: &[f64],
        initial: impl Fn(usize) -> Voigt,
    ) -> Result<Vec<Voigt>, Folded> {
        let points = self.cell.shape.points().into_iter().enumerate();
        let stress = |(p, (natural, weight)): (usize, ([f64; 3], f64))| {
            let at = self.at(natural, weight)?;
            let mut strain = tensor::ZERO;
            for (slope, u) in at.slopes.iter().zip(displacement.as_chunks::<3>().0) {
                let parts = strains(slope);
                (0..6).for_each(|c| strain[c] += (0..3).map(|i| parts[i][c] * u[i]).sum::<f64>());
            }
            let warm = self.warmth(p, &at.jets, warmth);
            let strain = tensor::sub(&strain, &tensor::scale(&self.swelling(at.place), warm));
            Ok(tensor::add(&tensor::apply(&self.law(at.place), &strain), &initial(p)))
        };
        points.map(stress).collect()
    }

    /// Forces of what acts on every piece of its volume, N/m³ by place.
    pub(super) fn volume_force(
        &self,
        density: impl Fn(DVec3) -> DVec3,
        f: &mut [f64],
    ) -> Result<(), Folded> {
        for (natural, weight) in self.cell.shape.points() {
            let at = self.at(natural, weight)?;
            let force = at.volume * density(at.place);
            for (jet, f) in at.jets.iter().zip(f.as_chunks_mut::<3>().0) {
                f.iter_mut().zip(force.to_array()).for_each(|(f, q)| *f += jet.value * q);
            }
        }
        Ok(())
    }

    /// Forces of a pressure on a face.
    pub(super) fn pressure(&self, face: usize, pressure: f64, f: &mut [f64]) {
        let Some(nodes) = self.cell.shape.faces().nth(face) else { return };
        for (natural, weight) in self.cell.shape.face_points(nodes.len()) {
            let jets = face_functions(nodes.len(), natural);
            let along = |i: usize| -> DVec3 {
                jets.iter().zip(nodes).map(|(j, &n)| j.slope[i] * self.places[n]).sum()
            };
            // Length is area.
            let outward = along(0).cross(along(1));
            for (jet, &n) in jets.iter().zip(nodes) {
                let force = -pressure * weight * jet.value * outward;
                (0..3).for_each(|i| f[3 * n + i] += force[i]);
            }
        }
    }

    /// kg/m³.
    pub(super) fn density(&self) -> f64 {
        self.material.density
    }
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
