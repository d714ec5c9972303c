//! Structured meshes: boxes and whatever a box can be bent into.

use glam::DVec3;

use super::{Cell, HexFace, Mesh, MeshError};

/// Cells of a grid in which a generator looks, at most.
pub(super) const MAX_CELLS: usize = 8 << 20;
/// Hexahedra that a generator makes at most: half a gigabyte, and ten times as many unknowns as a
/// solver here takes in minutes.
pub(super) const MAX_HEXES: usize = 4 << 20;

/// A bent lattice of cells, some of which may be left out.
pub(super) struct Lattice<'a> {
    /// Cells along i, j, k.
    pub(super) cells: [usize; 3],
    /// Whether j closes on itself.
    pub(super) closed: bool,
    /// Names of the sides i = 0, i = end, j = 0, …; an empty name: no set.
    pub(super) sides: [&'a str; 6],
    /// Names of the regions.
    pub(super) regions: Vec<String>,
}

impl Lattice<'_> {
    /// Makes the mesh, and tells the cell of each hexahedron. i runs fastest. The mesh is not
    /// checked.
    pub(super) fn build(
        self,
        point: impl Fn(usize, usize, usize) -> DVec3,
        region: impl Fn(usize, usize, usize) -> Option<u32>,
    ) -> Result<(Mesh, Vec<[usize; 3]>), MeshError> {
        let [ni, nj, nk] = self.cells;
        let total = ni.checked_mul(nj).and_then(|n| n.checked_mul(nk)).filter(|&n| n <= MAX_CELLS);
        if total.is_none_or(|n| n == 0) {
            return Err(MeshError::whole(format!(
                "a mesh of {ni} × {nj} × {nk} elements: at least 1 each and at most {MAX_CELLS} together"
            )));
        }
        let columns = if self.closed { nj } else { nj + 1 };
        let number = |i: usize, j: usize, k: usize| i + (ni + 1) * (j % columns + columns * k);
        let mut index = vec![u32::MAX; (ni + 1) * columns * (nk + 1)];
        let mut mesh = Mesh { regions: self.regions, ..Mesh::default() };
        let mut places = Vec::with_capacity(total.unwrap_or(0));
        let mut sides: [Vec<HexFace>; 6] = Default::default();
        for k in 0..nk {
            for j in 0..nj {
                for i in 0..ni {
                    let Some(region) = region(i, j, k) else { continue };
                    if mesh.hexes.len() >= MAX_HEXES {
                        return Err(MeshError::whole(format!(
                            "more than {MAX_HEXES} elements: give larger ones"
                        )));
                    }
                    let hex = mesh.hexes.len() as u32;
                    let corners = [(i, j, k), (i + 1, j, k), (i + 1, j + 1, k), (i, j + 1, k)];
                    let nodes: [usize; 8] = std::array::from_fn(|c| {
                        let (i, j, k) = corners[c % 4];
                        number(i, j, k + c / 4)
                    });
                    nodes.iter().for_each(|&n| index[n] = 0);
                    mesh.hexes.push(Cell { nodes: nodes.map(|n| n as u32), region });
                    places.push([i, j, k]);
                    // Abaqus' faces: ξ− is S6, ξ+ S4, η− S3, η+ S5, ζ− S1, ζ+ S2.
                    let at = [
                        i == 0,
                        i + 1 == ni,
                        j == 0 && !self.closed,
                        j + 1 == nj && !self.closed,
                        k == 0,
                        k + 1 == nk,
                    ];
                    for (side, (at, face)) in at.into_iter().zip([5, 3, 2, 4, 0, 1]).enumerate() {
                        if at {
                            sides[side].push(HexFace { hex, face });
                        }
                    }
                }
            }
        }
        for (n, slot) in index.iter_mut().enumerate().filter(|(_, slot)| **slot == 0) {
            *slot = mesh.nodes.len() as u32;
            mesh.nodes.push(point(n % (ni + 1), n / (ni + 1) % columns, n / (ni + 1) / columns));
        }
        mesh.hexes.iter_mut().flat_map(|h| &mut h.nodes).for_each(|n| *n = index[*n as usize]);
        for (faces, name) in sides.into_iter().zip(self.sides) {
            if !name.is_empty() && !faces.is_empty() {
                mesh.name_side(name, faces);
            }
        }
        Ok((mesh, places))
    }
}

impl Mesh {
    /// Names faces, and their nodes likewise.
    pub(super) fn name_side(&mut self, name: &str, faces: Vec<HexFace>) {
        let mut nodes: Vec<u32> = faces.iter().flat_map(|&f| self.face(f)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        self.node_sets.insert(name.to_owned(), nodes);
        self.face_sets.insert(name.to_owned(), faces);
    }
}

/// A box with the given planes along x, y, z (ascending, m), of one region. Its sides are the node
/// and face sets `x0`, `x1`, `y0`, `y1`, `z0`, `z1`.
///
/// # Errors
/// Fewer than two planes, planes not ascending, too many elements.
pub fn block(x: &[f64], y: &[f64], z: &[f64], region: &str) -> Result<Mesh, MeshError> {
    for (axis, planes) in [("x", x), ("y", y), ("z", z)] {
        ascending(axis, planes)?;
    }
    let lattice = Lattice {
        cells: [x.len() - 1, y.len() - 1, z.len() - 1],
        closed: false,
        sides: ["x0", "x1", "y0", "y1", "z0", "z1"],
        regions: vec![region.to_owned()],
    };
    let (mesh, _) = lattice.build(|i, j, k| DVec3::new(x[i], y[j], z[k]), |_, _, _| Some(0))?;
    Ok(mesh)
}

/// A box of `cells` elements bent into any shape: `point` places the lattice points (0…cells along
/// each of i, j, k, right-handed), `region` gives a cell its index into `regions`, or none: left
/// out. The lattice's sides are the sets `i0`, `i1`, `j0`, `j1`, `k0`, `k1`.
///
/// # Errors
/// Too many elements, or elements that [`Mesh::check`] refuses (inverted ones by a left-handed or
/// folded map, for example).
pub(crate) fn mapped(
    cells: [usize; 3],
    regions: &[&str],
    point: impl Fn(usize, usize, usize) -> DVec3,
    region: impl Fn(usize, usize, usize) -> Option<u32>,
) -> Result<Mesh, MeshError> {
    let lattice = Lattice {
        cells,
        closed: false,
        sides: ["i0", "i1", "j0", "j1", "k0", "k1"],
        regions: regions.iter().map(|&r| r.to_owned()).collect(),
    };
    let (mesh, _) = lattice.build(point, region)?;
    mesh.check()?;
    Ok(mesh)
}

/// Coordinates from `from` to `to` that pass through every cut between and are at most `largest`
/// apart; equal steps between cuts. Cuts nearer than 1e-9 of the whole to each other are one.
/// Nothing where the input makes no sense (`to` not above `from`, `largest` not above 0).
#[must_use]
pub fn divide(from: f64, to: f64, cuts: &[f64], largest: f64) -> Vec<f64> {
    let whole = to - from;
    if !(whole > 0.0 && whole.is_finite() && largest > 0.0) || whole / largest > 1e7 {
        return Vec::new();
    }
    let near = 1e-9 * whole;
    let mut marks: Vec<f64> =
        cuts.iter().copied().filter(|&c| c > from + near && c < to - near).collect();
    marks.sort_unstable_by(f64::total_cmp);
    marks.dedup_by(|b, a| *b - *a <= near);
    marks.push(to);
    let mut planes = vec![from];
    let mut last = from;
    for mark in marks {
        // A length of 1.0000000001 steps is one step.
        let steps = ((mark - last) / largest - 1e-9).ceil().max(1.0);
        planes.extend((1..steps as usize).map(|s| last + (mark - last) * s as f64 / steps));
        planes.push(mark);
        last = mark;
    }
    planes
}

/// Refuses planes that are fewer than two, not finite or not ascending.
pub(super) fn ascending(what: &str, planes: &[f64]) -> Result<(), MeshError> {
    if planes.len() < 2 {
        return Err(MeshError::whole(format!(
            "{what}: {} coordinates make no element; give at least two",
            planes.len()
        )));
    }
    if let Some(w) =
        planes.windows(2).find(|w| !(w[0].is_finite() && w[1].is_finite() && w[1] > w[0]))
    {
        return Err(MeshError::whole(format!(
            "{what}: coordinates must ascend, but {} is followed by {}",
            w[0], w[1]
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_graded_block_has_its_volume_sides_and_sizes() {
        let mesh = block(&[0.0, 0.5, 2.0], &[-1.0, 1.0], &[0.0, 1.0, 2.0, 3.0], "c").unwrap();
        assert_eq!((mesh.nodes.len(), mesh.hexes.len()), (3 * 2 * 4, 6));
        assert!((mesh.volume() - 12.0).abs() < 1e-14);
        assert!((mesh.size(0) - 1.0).abs() < 1e-15);
        assert_eq!(mesh.check(), Ok(vec![]));
        for (set, axis, at) in [
            ("x0", 0, 0.0),
            ("x1", 0, 2.0),
            ("y0", 1, -1.0),
            ("y1", 1, 1.0),
            ("z0", 2, 0.0),
            ("z1", 2, 3.0),
        ] {
            assert!(
                mesh.node_sets[set].iter().all(|&n| mesh.nodes[n as usize][axis] == at),
                "{set}"
            );
            for &face in &mesh.face_sets[set] {
                let (middle, normal) = mesh.face_middle(face);
                assert_eq!(middle[axis], at, "{set}");
                assert!(normal[axis] * if set.ends_with('1') { 1.0 } else { -1.0 } > 0.0, "{set}");
            }
        }
        assert_eq!(mesh.face_sets["x1"].len(), 3);
        assert_eq!(mesh.node_sets["x1"].len(), 8);
    }

    #[test]
    fn cells_can_be_left_out_and_their_nodes_go_with_them() {
        let point = |i: usize, j: usize, k: usize| DVec3::new(i as f64, j as f64, k as f64);
        // Three by three with a hole.
        let ring =
            mapped([3, 3, 1], &["c"], point, |i, j, _| (i != 1 || j != 1).then_some(0)).unwrap();
        assert_eq!((ring.hexes.len(), ring.nodes.len()), (8, 32));
        let ell =
            mapped([2, 2, 1], &["c"], point, |i, j, _| (i == 0 || j == 0).then_some(0)).unwrap();
        assert_eq!((ell.hexes.len(), ell.nodes.len()), (3, 16));
        assert_eq!(ell.check(), Ok(vec![]));
    }

    #[test]
    fn a_left_handed_map_is_refused() {
        let error = mapped(
            [1, 1, 1],
            &["c"],
            |i, j, k| DVec3::new(j as f64, i as f64, k as f64),
            |_, _, _| Some(0),
        )
        .unwrap_err();
        assert!(error.reason.starts_with("hex 1: inverted"));
    }

    #[test]
    fn divisions_pass_through_cuts_and_stay_below_the_largest_step() {
        assert_eq!(divide(0.0, 1.0, &[], 0.25), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(divide(0.0, 1.0, &[0.5, 0.5, 2.0, 0.0], 0.4), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(divide(0.0, 2.0, &[0.5], 1.0), [0.0, 0.5, 1.25, 2.0]);
        assert!(divide(1.0, 1.0, &[], 0.1).is_empty());
        assert!(divide(0.0, 1.0, &[], 0.0).is_empty());
        assert!(divide(0.0, f64::NAN, &[], 0.1).is_empty());
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(
            block(&[0.0], &[0.0, 1.0], &[0.0, 1.0], "c")
                .unwrap_err()
                .reason
                .starts_with("x: 1 coordinates")
        );
        assert!(
            block(&[0.0, 1.0], &[1.0, 0.0], &[0.0, 1.0], "c")
                .unwrap_err()
                .reason
                .starts_with("y: coordinates must ascend")
        );
        let long: Vec<f64> = (0..1000).map(f64::from).collect();
        assert!(block(&long, &long, &long, "c").unwrap_err().reason.contains("at most"));
    }
}
