//! Triangle meshes.

use glam::{Vec2, Vec3};

/// An indexed triangle mesh in its own frame, metres. Triangles wind anticlockwise seen from
/// outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex; empty: faceted.
    pub normals: Vec<Vec3>,
    /// Tangents (xyz unit, w = ±1 handedness), one a vertex; empty: derived from `uv` where a
    /// normal map needs them.
    pub tangents: Vec<glam::Vec4>,
    /// Texture coordinates, sets 0 and 1, each one a vertex or empty.
    pub uv: [Vec<Vec2>; 2],
    /// Linear colours that multiply the material's base colour, one a vertex; empty: white.
    pub colours: Vec<Vec3>,
    /// Vertex indices; every index is below `positions.len()` (whoever makes a mesh from outside
    /// data checks this).
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The three corners of triangle `index`.
    #[must_use]
    pub fn corners(&self, index: usize) -> [Vec3; 3] {
        self.triangles[index].map(|i| self.positions[i as usize])
    }

    /// Signed volume enclosed, m³, by the divergence theorem: positive for a closed mesh that winds
    /// outward.
    #[must_use]
    pub fn volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i).map(Vec3::as_dvec3);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    /// Surface area, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i).map(Vec3::as_dvec3);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }
}
