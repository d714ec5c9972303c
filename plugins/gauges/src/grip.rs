//! What supports that hold nodes give, as a bedding would: a stiffness per area, which no mesh
//! changes.
//!
//! A bedding of k (Pa/m) under a held face adds ∫ t_u·t_λ dA/k to a reading, t the tractions under
//! it of field and importance. What a solution leaves at held nodes is R = M t with M = ∫ N Nᵀ dA,
//! so that ∫ t_u·t_λ dA = R_uᵀ M⁻¹ R_λ = (L⁻¹ R_u)·(L⁻¹ R_λ), M = L Lᵀ. Give per node instead, Σ
//! R_u R_λ, makes edges as soft as the middle and another pattern of every mesh.

use std::collections::{BTreeMap, BTreeSet};

use intrados_mechanics::{
    mesh::{Mesh, hex},
    model::{Failure, Linear},
};
use nalgebra::{DMatrix, DVector};

use crate::rig::Rig;

/// What is held along a line is taken for a strip so wide, and what is held at a point for a square
/// of it, m: it matters only to a member that is held by faces too.
const STRIP: f64 = 0.1;
/// Nodes up to which M is kept whole; of more its rows are summed, which fine meshes do not feel.
const WHOLE: usize = 1500;
/// M of a rectangle and of a strip over its corners, in turn around it, per area.
const OF_FACE: [f64; 4] = [4.0 / 36.0, 2.0 / 36.0, 1.0 / 36.0, 2.0 / 36.0];
const OF_LINE: [f64; 2] = [2.0 / 6.0, 1.0 / 6.0];

/// The held nodes of a member that may give.
#[derive(Debug, Clone)]
pub(crate) struct Grip(Vec<Held>);

/// The nodes that are held in one direction.
#[derive(Debug, Clone)]
struct Held {
    /// Their unknowns.
    unknowns: Vec<usize>,
    /// L.
    root: DMatrix<f64>,
}

impl Grip {
    pub(crate) fn of(rig: &Rig) -> Self {
        let held = |component: u8| {
            let nodes: Vec<u32> = rig
                .giving
                .iter()
                .filter(|h| h.1 == component)
                .map(|h| h.0)
                .collect::<BTreeSet<_>>()
                .into_iter()
                .collect();
            let unknowns = nodes.iter().map(|&n| 3 * n as usize + usize::from(component)).collect();
            Held { unknowns, root: root(masses(&rig.model.mesh, &nodes)) }
        };
        Self((0..3).map(held).filter(|h| !h.unknowns.is_empty()).collect())
    }

    /// How many numbers [`Grip::tractions`] gives.
    pub(crate) fn len(&self) -> usize {
        self.0.iter().map(|h| h.unknowns.len()).sum()
    }

    /// Whether any of these nodes is held; they are sorted.
    pub(crate) fn holds_any(&self, nodes: &[u32]) -> bool {
        self.0
            .iter()
            .flat_map(|h| &h.unknowns)
            .any(|&unknown| nodes.binary_search(&((unknown / 3) as u32)).is_ok())
    }

    /// L⁻¹ R of the forces on all unknowns: their products are what a bedding of 1 Pa/m adds to a
    /// reading.
    pub(crate) fn tractions(&self, force: impl Fn(usize) -> f64) -> Vec<f64> {
        let of = |held: &Held| {
            let mut reactions = DVector::from_iterator(
                held.unknowns.len(),
                held.unknowns.iter().map(|&unknown| force(unknown)),
            );
            held.root.solve_lower_triangular_mut(&mut reactions);
            reactions.as_slice().to_vec()
        };
        self.0.iter().flat_map(of).collect()
    }
}

/// What supports that hold nodes add to readings, case by case, gauges within, where they take up
/// as much energy under all tests as the member itself as it is softened.
///
/// # Errors
/// [`Failure`].
pub(crate) fn given(rig: &Rig, linear: &mut Linear) -> Result<Vec<f64>, Failure> {
    let grip = Grip::of(rig);
    let [cases, gauges] = linear.size();
    if grip.len() == 0 {
        return Ok(vec![0.0; cases * gauges]);
    }
    let (fields, lines) = (linear.fields()?, linear.importances()?);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let tractions = |field: &Vec<f64>| {
        let force = linear.resist(field);
        (grip.tractions(|unknown| force[unknown]), dot(field, &force))
    };
    let of_fields: Vec<(Vec<f64>, f64)> = fields.iter().map(tractions).collect();
    let of_lines: Vec<Vec<f64>> = lines.iter().map(|line| tractions(line).0).collect();
    let (energy, squares) = of_fields
        .iter()
        .fold((0.0, 0.0), |(energy, squares), (t, e)| (energy + e, squares + dot(t, t)));
    let compliance = if squares > 0.0 { energy / squares } else { 0.0 };
    Ok(of_fields
        .iter()
        .flat_map(|(t, _)| of_lines.iter().map(move |line| compliance * dot(t, line)))
        .collect())
}

/// L of M. Where areas are nothing, nodes count alike.
fn root(masses: DMatrix<f64>) -> DMatrix<f64> {
    let n = masses.nrows();
    if n > WHOLE {
        return DMatrix::from_diagonal(&masses.column_sum().map(f64::sqrt));
    }
    masses.cholesky().map_or_else(|| DMatrix::identity(n, n), |factor| factor.unpack())
}

/// M over these nodes, which are sorted: faces of bricks that are held as a whole, edges of bricks
/// that no such face has, and nodes alone.
fn masses(mesh: &Mesh, nodes: &[u32]) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(nodes.len(), nodes.len());
    let mut add = |of: &[u32], area: f64, shares: &[f64]| {
        let at: Vec<usize> = of.iter().map(|&n| nodes.partition_point(|&m| m < n)).collect();
        for (i, &row) in at.iter().enumerate() {
            at.iter().enumerate().for_each(|(j, &column)| {
                all[(row, column)] += area * shares[(j + of.len() - i) % of.len()]
            });
        }
    };
    let (faces, edges) = held(mesh, nodes);
    let place = |n: u32| mesh.nodes[n as usize];
    let mut known: BTreeSet<u32> = BTreeSet::new();
    for face in faces.values() {
        let [a, b, c, d] = face.map(place);
        add(face, 0.5 * (c - a).cross(d - b).length(), &OF_FACE);
        known.extend(face);
    }
    for edge in
        edges.iter().filter(|edge| !edge.iter().all(|n| known.contains(n))).collect::<Vec<_>>()
    {
        add(edge, STRIP * (place(edge[1]) - place(edge[0])).length(), &OF_LINE);
    }
    known.extend(edges.iter().flatten());
    nodes.iter().filter(|n| !known.contains(n)).for_each(|&n| add(&[n], STRIP * STRIP, &[1.0]));
    all
}

/// Faces and edges of bricks all of whose nodes are held, each once, however many bricks have it;
/// faces by their sorted nodes, with them in turn.
fn held(mesh: &Mesh, nodes: &[u32]) -> (BTreeMap<[u32; 4], [u32; 4]>, BTreeSet<[u32; 2]>) {
    let (mut faces, mut edges) = (BTreeMap::new(), BTreeSet::new());
    for brick in &mesh.hexes {
        let is_held = brick.nodes.map(|n| nodes.binary_search(&n).is_ok());
        if !is_held.contains(&true) {
            continue;
        }
        for corners in hex::FACES.iter().filter(|face| face.iter().all(|&c| is_held[c])) {
            let face = corners.map(|c| brick.nodes[c]);
            let mut sorted = face;
            sorted.sort_unstable();
            faces.insert(sorted, face);
        }
        for &[a, b] in hex::EDGES.iter().filter(|edge| edge.iter().all(|&c| is_held[c])) {
            let [a, b] = [brick.nodes[a], brick.nodes[b]];
            edges.insert([a.min(b), a.max(b)]);
        }
    }
    (faces, edges)
}

#[cfg(test)]
mod tests {
    use intrados_mechanics::mesh::{block, divide};

    use super::*;

    /// A traction a + b x + c y under a face gives what its square over the face is, on any mesh;
    /// per node it would not.
    #[test]
    fn a_bedding_does_not_know_the_mesh() {
        for edge in [0.2, 0.1, 0.04] {
            let side = divide(-0.2, 0.2, &[], edge);
            let mesh = block(&side, &side, &[0.0, 0.1], "foot").unwrap();
            let nodes: Vec<u32> =
                (0..mesh.nodes.len() as u32).filter(|&n| mesh.nodes[n as usize].z < 1e-9).collect();
            let masses = masses(&mesh, &nodes);
            let traction = DVector::from_iterator(
                nodes.len(),
                nodes.iter().map(|&n| mesh.nodes[n as usize]).map(|p| 2.0 + 3.0 * p.x - p.y),
            );
            let mut whitened = &masses * traction;
            root(masses).solve_lower_triangular_mut(&mut whitened);
            // ∫ (a + b x + c y)² = A (a² + (b² + c²) s²/12)
            let exact = 0.16 * (4.0 + 10.0 * 0.16 / 12.0);
            assert!(
                (whitened.norm_squared() / exact - 1.0).abs() < 1e-12,
                "{edge}: {}",
                whitened.norm_squared()
            );
        }
    }

    /// Lines count as strips, points as squares, and the edges of a held face not once more.
    #[test]
    fn lines_and_points_have_areas_too() {
        let mesh = block(&[0.0, 0.5, 1.0], &[0.0, 0.5], &[0.0, 0.5], "beam").unwrap();
        let area = |is_held: &dyn Fn(glam::DVec3) -> bool| {
            let nodes: Vec<u32> =
                (0..mesh.nodes.len() as u32).filter(|&n| is_held(mesh.nodes[n as usize])).collect();
            masses(&mesh, &nodes).sum()
        };
        assert!((area(&|p| p.z < 0.1) - 0.5).abs() < 1e-12);
        assert!((area(&|p| p.z < 0.1 && p.y < 0.1) - STRIP).abs() < 1e-12);
        assert!((area(&|p| p.length() < 0.1) - STRIP * STRIP).abs() < 1e-12);
        assert!(
            (area(&|p| p.x < 0.1 || p.x > 0.9 && p.length() < 1.1) - 0.25 - STRIP * STRIP).abs()
                < 1e-12
        );
    }
}
