//! Charts: pieces of surface, nearly flat and in one piece, by whose sides fields are kept. Two
//! sides of a wall, or two walls, never mix.

use glam::Vec3;

use crate::LitScene;

/// Triangles of a chart face within 40° of its first one.
const COSINE: f32 = 0.766;

/// Which chart each triangle belongs to.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Charts {
    /// By triangle.
    of: Vec<u32>,
    /// By chart its triangles, from `first[c]` to `first[c + 1]`.
    triangles: Vec<u32>,
    first: Vec<u32>,
    /// By chart the mean normal.
    normals: Vec<Vec3>,
}

impl Charts {
    /// Grows charts over shared edges within objects, in the order of the triangles.
    pub(crate) fn new(lit: &LitScene) -> Self {
        let n = lit.triangle_count();
        let neighbours = neighbours(lit);
        let mut of = vec![u32::MAX; n];
        let (mut triangles, mut first) = (Vec::with_capacity(n), Vec::new());
        let mut front = Vec::new();
        for seed in 0..n as u32 {
            if of[seed as usize] != u32::MAX {
                continue;
            }
            let (chart, normal) = (first.len() as u32, lit.normal(seed));
            first.push(triangles.len() as u32);
            of[seed as usize] = chart;
            front.push(seed);
            while let Some(t) = front.pop() {
                triangles.push(t);
                for &next in &neighbours[t as usize] {
                    if next != u32::MAX
                        && of[next as usize] == u32::MAX
                        && lit.normal(next).dot(normal) > COSINE
                    {
                        of[next as usize] = chart;
                        front.push(next);
                    }
                }
            }
        }
        first.push(triangles.len() as u32);
        let mean = |range: &[u32]| {
            triangles[range[0] as usize..range[1] as usize]
                .iter()
                .map(|&t| lit.normal(t) * lit.area(t))
                .sum::<Vec3>()
        };
        let normals = first.windows(2).map(|range| mean(range).normalize_or(Vec3::Y)).collect();
        Self { of, triangles, first, normals }
    }

    /// Mean normal of a chart's front.
    pub(crate) fn normal(&self, chart: u32) -> Vec3 {
        self.normals[chart as usize]
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// The chart of a triangle.
    #[inline]
    pub(crate) fn of(&self, triangle: u32) -> u32 {
        self.of[triangle as usize]
    }

    /// The triangles of a chart.
    pub(crate) fn triangles(&self, chart: usize) -> &[u32] {
        &self.triangles[self.first[chart] as usize..self.first[chart + 1] as usize]
    }
}

/// Per triangle the one across each edge within its object; `u32::MAX` where there is none.
fn neighbours(lit: &LitScene) -> Vec<[u32; 3]> {
    let bits = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let mut edges = Vec::with_capacity(3 * lit.triangle_count());
    for t in 0..lit.triangle_count() as u32 {
        let corners = lit.corners(t).map(bits);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.push((lit.object_index(t), a.min(b), a.max(b), t, k));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[u32::MAX; 3]; lit.triangle_count()];
    for pair in edges.windows(2) {
        let (&(o, a, b, t, k), &(o2, a2, b2, t2, k2)) = (&pair[0], &pair[1]);
        if (o, a, b) == (o2, a2, b2) {
            neighbours[t as usize][k] = t2;
            neighbours[t2 as usize][k2] = t;
        }
    }
    neighbours
}
