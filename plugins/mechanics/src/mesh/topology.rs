//! Which hexahedra share a face.

use rayon::slice::ParallelSliceMut;

use super::{HexFace, Mesh};

/// All faces of all hexahedra, sorted by their nodes, so that the two sides of an inner face stand
/// beside each other.
#[derive(Debug, Clone, Default)]
pub(crate) struct FaceTable(Vec<([u32; 4], HexFace)>);

impl FaceTable {
    /// Runs of faces with the same nodes: one for the surface, two inside, more where bodies
    /// overlap.
    pub(crate) fn shared(&self) -> impl Iterator<Item = &[([u32; 4], HexFace)]> {
        self.0.chunk_by(|a, b| a.0 == b.0)
    }

    /// Inner faces as their two sides, the lower hexahedron first.
    pub(crate) fn inner(&self) -> impl Iterator<Item = [HexFace; 2]> {
        self.shared().filter_map(|run| match run {
            [(_, a), (_, b)] => Some([*a, *b]),
            _ => None,
        })
    }

    /// The faces that have these nodes, in any order.
    #[must_use]
    pub(crate) fn find(&self, mut nodes: [u32; 4]) -> &[([u32; 4], HexFace)] {
        nodes.sort_unstable();
        let from = self.0.partition_point(|(n, _)| *n < nodes);
        let count = self.0[from..].iter().take_while(|(n, _)| *n == nodes).count();
        &self.0[from..from + count]
    }
}

impl Mesh {
    /// Sorts all faces by their nodes.
    #[must_use]
    pub(crate) fn face_table(&self) -> FaceTable {
        let mut table = Vec::with_capacity(6 * self.hexes.len());
        for hex in 0..self.hexes.len() as u32 {
            for face in 0..6 {
                let face = HexFace { hex, face };
                let mut nodes = self.face(face);
                nodes.sort_unstable();
                table.push((nodes, face));
            }
        }
        table.par_sort_unstable();
        FaceTable(table)
    }

    /// Faces that belong to one hexahedron only, in order. The two sides of an interface are among
    /// them.
    #[must_use]
    pub(crate) fn outer_faces(&self) -> Vec<HexFace> {
        let mut outer: Vec<HexFace> = self
            .face_table()
            .shared()
            .filter_map(|run| if let [(_, f)] = run { Some(*f) } else { None })
            .collect();
        outer.sort_unstable();
        outer
    }

    /// For every hexahedron, the one behind each of its six faces.
    #[must_use]
    pub(crate) fn neighbours(&self) -> Vec<[Option<u32>; 6]> {
        let mut neighbours = vec![[None; 6]; self.hexes.len()];
        for [a, b] in self.face_table().inner() {
            neighbours[a.hex as usize][usize::from(a.face)] = Some(b.hex);
            neighbours[b.hex as usize][usize::from(b.face)] = Some(a.hex);
        }
        neighbours
    }

    /// Bodies: for every hexahedron the number of its face-connected piece, counted from 0 in the
    /// order of their first element, and how many there are.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn bodies(&self) -> (Vec<u32>, u32) {
        let neighbours = self.neighbours();
        let mut body = vec![u32::MAX; self.hexes.len()];
        let (mut count, mut stack) = (0, Vec::new());
        for start in 0..self.hexes.len() {
            if body[start] != u32::MAX {
                continue;
            }
            body[start] = count;
            stack.push(start);
            while let Some(hex) = stack.pop() {
                for next in neighbours[hex].iter().flatten().map(|&n| n as usize) {
                    if body[next] == u32::MAX {
                        body[next] = count;
                        stack.push(next);
                    }
                }
            }
            count += 1;
        }
        (body, count)
    }
}

#[cfg(test)]
mod tests {
    use super::super::block;

    #[test]
    fn a_block_has_the_surface_and_neighbours_of_a_block() {
        let mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0, 3.0], &[0.0, 0.5], "c").unwrap();
        assert_eq!(mesh.outer_faces().len(), 2 * 4 + 4 * 2);
        let normals: glam::DVec3 = mesh.outer_faces().iter().map(|&f| mesh.face_middle(f).1).sum();
        assert!(normals.length() < 1e-15);
        let area: f64 = mesh.outer_faces().iter().map(|&f| mesh.face_middle(f).1.length()).sum();
        assert!((area - (2.0 * 6.0 + 0.5 * 10.0)).abs() < 1e-14);
        let neighbours = mesh.neighbours();
        // Abaqus: S4 is x+, S5 is y+.
        assert_eq!(neighbours[0], [None, None, None, Some(1), Some(2), None]);
        assert_eq!(neighbours[3], [None, None, Some(1), None, None, Some(2)]);
        assert_eq!(mesh.bodies(), (vec![0; 4], 1));
    }
}
