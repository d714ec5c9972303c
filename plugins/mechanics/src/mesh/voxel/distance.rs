//! Distance from a point to a set of triangles.

use glam::DVec3;

use crate::mesh::{HexFace, Mesh};

/// Triangles in a tree of boxes, halved at the middle triangle along the longest side.
pub(crate) struct Triangles {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

struct Node {
    low: DVec3,
    high: DVec3,
    /// A leaf: its triangles. Otherwise the second child; the first follows its parent.
    from: u32,
    count: u32,
}

const LEAF: usize = 8;

impl Triangles {
    pub(crate) fn new(triangles: Vec<[DVec3; 3]>) -> Self {
        let mut tree = Self { triangles, nodes: Vec::new() };
        let count = tree.triangles.len();
        if count > 0 {
            tree.split(0, count);
        }
        tree
    }

    /// Faces of a mesh, each cut into two triangles.
    pub(crate) fn of_faces(mesh: &Mesh, faces: impl IntoIterator<Item = HexFace>) -> Self {
        let halves = |face| {
            let [a, b, c, d] = mesh.face(face).map(|n| mesh.nodes[n as usize]);
            [[a, b, c], [a, c, d]]
        };
        Self::new(faces.into_iter().flat_map(halves).collect())
    }

    fn split(&mut self, from: usize, to: usize) {
        let part = &mut self.triangles[from..to];
        let (low, high) = part
            .iter()
            .flatten()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, from: from as u32, count: (to - from) as u32 });
        if to - from <= LEAF {
            return;
        }
        let axis = (high - low).max_position();
        let middle = (to - from) / 2;
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        part.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        self.split(from, from + middle);
        self.nodes[node].from = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.split(from + middle, to);
    }

    /// Distance to the nearest triangle, m; infinite without triangles.
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        self.distance_where(point, |_| true)
    }

    /// Distance to the nearest of the triangles that are admitted, m; infinite without any.
    pub(crate) fn distance_where(&self, point: DVec3, admit: impl Fn(&[DVec3; 3]) -> bool) -> f64 {
        let mut best = f64::INFINITY;
        let mut stack = vec![0usize];
        while let Some(n) = stack.pop() {
            let Some(node) = self.nodes.get(n) else { continue };
            if squared(node, point) >= best {
                continue;
            }
            if node.count > 0 {
                let leaf = &self.triangles[node.from as usize..(node.from + node.count) as usize];
                best = leaf
                    .iter()
                    .filter(|t| admit(t))
                    .map(|t| nearest(t, point).distance_squared(point))
                    .fold(best, f64::min);
                continue;
            }
            let (a, b) = (n + 1, node.from as usize);
            // The nearer child last, so that it is looked at first.
            stack.extend(if squared(&self.nodes[a], point) < squared(&self.nodes[b], point) {
                [b, a]
            } else {
                [a, b]
            });
        }
        best.sqrt()
    }
}

fn squared(node: &Node, point: DVec3) -> f64 {
    point.clamp(node.low, node.high).distance_squared(point)
}

/// The point of a triangle nearest to `p`, by the regions of its corners, edges and face (Ericson,
/// Real-Time Collision Detection, 5.1.5).
fn nearest([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + d1 / (d1 - d3) * ab;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + d2 / (d2 - d6) * ac;
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    }
    a + (vb * ab + vc * ac) / (va + vb + vc)
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    #[test]
    fn the_tree_finds_what_searching_all_finds() {
        let point = |n: u64, d: u32| {
            DVec3::new(
                Key::new(3, n).unit64(d),
                Key::new(3, n).unit64(d + 1),
                Key::new(3, n).unit64(d + 2),
            )
        };
        let triangles: Vec<[DVec3; 3]> =
            (0..200).map(|n| [0, 3, 6].map(|d| 0.2 * point(n, d) + point(n, 9))).collect();
        let tree = Triangles::new(triangles.clone());
        for n in 1000..1200 {
            let p = 3.0 * point(n, 0) - 1.0;
            // Independent of `nearest`: a fine lattice over each triangle is never nearer, and
            // nearly as near.
            let sampled = |t: &[DVec3; 3]| {
                (0..=60)
                    .flat_map(|i| {
                        (0..=60 - i).map(move |j| (f64::from(i) / 60.0, f64::from(j) / 60.0))
                    })
                    .map(|(s, r)| (t[0] + s * (t[1] - t[0]) + r * (t[2] - t[0])).distance(p))
                    .fold(f64::INFINITY, f64::min)
            };
            let expected = triangles.iter().map(sampled).fold(f64::INFINITY, f64::min);
            let found = tree.distance(p);
            assert!(found <= expected + 1e-12 && found > expected - 0.006, "{found} {expected}");
        }
        assert_eq!(Triangles::new(vec![]).distance(DVec3::ZERO), f64::INFINITY);
    }
}
