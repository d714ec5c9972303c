//! Solids for tests: how a box is cut into them, and how other programs number the middles of their
//! edges, by the manuals and not by way of what is tested.

use glam::DVec3;

/// A kind of solid.
pub(crate) struct Solid {
    /// What a brick is cut into, by its corners.
    pub(crate) parts: &'static [&'static [usize]],
    /// Pairs of corners in the order of the middles between them, of Abaqus and CalculiX.
    pub(crate) abaqus: &'static [[usize; 2]],
    /// Of Gmsh (its manual, "Node ordering").
    pub(crate) gmsh: &'static [[usize; 2]],
}

pub(crate) const HEX: Solid = Solid {
    parts: &[&[0, 1, 2, 3, 4, 5, 6, 7]],
    abaqus: &[
        [0, 1],
        [1, 2],
        [2, 3],
        [3, 0],
        [4, 5],
        [5, 6],
        [6, 7],
        [7, 4],
        [0, 4],
        [1, 5],
        [2, 6],
        [3, 7],
    ],
    gmsh: &[
        [0, 1],
        [0, 3],
        [0, 4],
        [1, 2],
        [1, 5],
        [2, 3],
        [2, 6],
        [3, 7],
        [4, 5],
        [4, 7],
        [5, 6],
        [6, 7],
    ],
};

/// Kuhn's six about the diagonal from corner 0 to 6.
pub(crate) const TET: Solid = Solid {
    parts: &[
        &[0, 1, 2, 6],
        &[0, 2, 3, 6],
        &[0, 3, 7, 6],
        &[0, 7, 4, 6],
        &[0, 4, 5, 6],
        &[0, 5, 1, 6],
    ],
    abaqus: &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
    gmsh: &[[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]],
};

pub(crate) const WEDGE: Solid = Solid {
    parts: &[&[0, 1, 2, 4, 5, 6], &[0, 2, 3, 4, 6, 7]],
    abaqus: &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
    gmsh: &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]],
};

/// Corners of a brick, in its edges.
const CORNERS: [[u32; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

/// So many bricks of a box along each axis: which one it is along them, and its corners.
pub(crate) fn bricks(
    [low, high]: [DVec3; 2],
    parts: [u32; 3],
) -> impl Iterator<Item = ([u32; 3], [DVec3; 8])> {
    let step = (high - low) / DVec3::from_array(parts.map(f64::from));
    let [nx, ny, nz] = parts;
    let layer = move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k]));
    (0..nz).flat_map(layer).map(move |at| {
        let place = |corner: [u32; 3]| std::array::from_fn(|i| f64::from(at[i] + corner[i]));
        (at, CORNERS.map(|corner| low + step * DVec3::from_array(place(corner))))
    })
}

/// The nodes of an element: its corners, then the middles of these edges. Those that are not there
/// yet are added.
pub(crate) fn element(
    nodes: &mut Vec<DVec3>,
    corners: &[DVec3],
    edges: &[[usize; 2]],
) -> Vec<usize> {
    let middles = edges.iter().map(|&[a, b]| 0.5 * (corners[a] + corners[b]));
    let node = |at: DVec3| {
        nodes.iter().position(|n| n.distance(at) < 1e-9).unwrap_or_else(|| {
            nodes.push(at);
            nodes.len() - 1
        })
    };
    corners.iter().copied().chain(middles).map(node).collect()
}
