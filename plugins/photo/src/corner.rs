//! Corners and edges of members: what can be picked in a photograph, and what is drawn over it.

use std::collections::HashMap;

use glam::DVec3;

use crate::face::{Chart, Surface, normal};

/// Cosine between normals on two sides of an edge: sharper than 30°.
const SHARP: f64 = 0.866;
/// Cosine between pieces that run on in one line: less than half a degree.
const STRAIGHT: f64 = 0.999_96;
/// Volume that three unit normals of a corner span.
const SOLID: f64 = 0.2;
/// Vertices nearer than this share of the member's size are one.
const SAME: f64 = 1e-5;

/// What is sharp of a member's surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Outline {
    /// Corners, m, by their place along the axis and then by their angle about it; of round members
    /// the ends of their rims at 0, 90, 180 and 270 degrees.
    pub corners: Vec<DVec3>,
    /// Of each corner, the names of the faces that meet there (Front, Right …; of round members the
    /// angle about the axis) and of the end that it is at: bottom or top, of what lies start or end.
    pub names: Vec<Vec<String>>,
    /// Edges, m.
    pub edges: Vec<[DVec3; 2]>,
}

impl Surface {
    /// Its corners and edges.
    #[must_use]
    pub fn outline(&self) -> Outline {
        let (places, triangles) = self.welded();
        let normals: Vec<DVec3> = self.triangles.iter().map(normal).collect();
        let mut at_vertex: Vec<Vec<DVec3>> = vec![Vec::new(); places.len()];
        for (corners, normal) in triangles.iter().zip(&normals) {
            corners
                .iter()
                .filter(|_| *normal != DVec3::ZERO)
                .for_each(|&i| at_vertex[i].push(*normal));
        }
        let at_edge = at_edges(&triangles, &normals);
        let mut edges: Vec<[usize; 2]> =
            at_edge.iter().filter(|(_, normals)| is_sharp(normals)).map(|(e, _)| *e).collect();
        edges.sort_unstable();
        let named = match self.faces.first().map(|face| face.chart) {
            Some(Chart::Around(radius) | Chart::Inside(radius)) => {
                let rims = self.rims(radius).into_iter();
                rims.map(|at| (at, vec![format!("{:.0}°", self.coordinates(at).1)])).collect()
            }
            _ => {
                let solid = (0..places.len()).filter(|&i| is_corner(&at_vertex[i]));
                self.in_order(solid.map(|i| (places[i], self.faces_at(&at_vertex[i]))).collect())
            }
        };
        let (corners, mut names): (Vec<DVec3>, Vec<Vec<String>>) = named.into_iter().unzip();
        for (corner, names) in corners.iter().zip(&mut names) {
            names.push(self.end_at(*corner).to_owned());
        }
        Outline { corners, names, edges: edges.into_iter().map(|e| e.map(|i| places[i])).collect() }
    }

    /// Names of the flat faces that surfaces with these normals belong to.
    fn faces_at(&self, normals: &[DVec3]) -> Vec<String> {
        let is_own = |n: DVec3| normals.iter().any(|normal| normal.dot(n) > SHARP);
        let own =
            self.faces.iter().filter(|face| matches!(face.chart, Chart::Flat(n) if is_own(n)));
        own.map(|face| face.name.clone()).collect()
    }

    /// Edges that somebody at `eye` may see as lines, m: sharp ones with a side that looks at him,
    /// and those where the surface turns away from him, be it sharp or round. Pieces that run on in
    /// one line are one edge.
    pub(crate) fn lines_from(&self, eye: DVec3) -> Vec<[DVec3; 2]> {
        let (places, triangles) = self.welded();
        let normals: Vec<DVec3> = self.triangles.iter().map(normal).collect();
        let mut edges: Vec<[usize; 2]> = at_edges(&triangles, &normals)
            .into_iter()
            .filter(|(edge, normals)| {
                let looks = |normal: &&DVec3| normal.dot(eye - places[edge[0]]) > 0.0;
                let looking = normals.iter().filter(looks).count();
                looking > 0 && (looking < normals.len() || is_sharp(normals))
            })
            .map(|(edge, _)| edge)
            .collect();
        edges.sort_unstable();
        joined(&edges, &places)
    }

    /// Vertices, those at one place taken together, and triangles of these.
    fn welded(&self) -> (Vec<DVec3>, Vec<[usize; 3]>) {
        let all = || self.triangles.iter().flatten().map(|p| p.as_dvec3());
        let (low, high) =
            all().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let cell = (SAME * (high - low).max_element()).max(1e-9);
        let (mut known, mut places) = (HashMap::new(), Vec::new());
        let mut index = |p: DVec3| {
            *known.entry(((p - low) / cell).round().as_i64vec3()).or_insert_with(|| {
                places.push(p);
                places.len() - 1
            })
        };
        let triangles = self.triangles.iter().map(|t| t.map(|p| index(p.as_dvec3()))).collect();
        (places, triangles)
    }

    fn in_order(&self, mut corners: Vec<(DVec3, Vec<String>)>) -> Vec<(DVec3, Vec<String>)> {
        let key = |(p, _): &(DVec3, Vec<String>)| {
            let (along, angle) = self.coordinates(*p);
            ((1e3 * along).round() as i64, (10.0 * angle).round() as i64 % 3600)
        };
        corners.sort_by_key(key);
        corners
    }
}

/// Normals of the triangles at each edge.
fn at_edges(triangles: &[[usize; 3]], normals: &[DVec3]) -> HashMap<[usize; 2], Vec<DVec3>> {
    let mut at_edge: HashMap<[usize; 2], Vec<DVec3>> = HashMap::new();
    for (corners, normal) in triangles.iter().zip(normals).filter(|(_, n)| **n != DVec3::ZERO) {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            at_edge.entry([a.min(b), a.max(b)]).or_default().push(*normal);
        }
    }
    at_edge
}

/// Whether a surface with these normals on both sides of an edge is sharp there, or ends.
fn is_sharp(normals: &[DVec3]) -> bool {
    match normals {
        [a, b] => a.dot(*b) < SHARP,
        _ => true,
    }
}

/// Edges made of pieces that run on in the direction of the first.
fn joined(pieces: &[[usize; 2]], places: &[DVec3]) -> Vec<[DVec3; 2]> {
    let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, piece) in pieces.iter().enumerate() {
        piece.iter().for_each(|&end| at.entry(end).or_default().push(i));
    }
    let mut is_taken = vec![false; pieces.len()];
    let mut edges = Vec::new();
    for (i, &[a, b]) in pieces.iter().enumerate() {
        if std::mem::replace(&mut is_taken[i], true) {
            continue;
        }
        let way = (places[b] - places[a]).normalize_or_zero();
        let ends = [(a, -way), (b, way)].map(|(mut end, way)| {
            let goes_on = |end: usize, j: usize| {
                let other = pieces[j][usize::from(pieces[j][0] == end)];
                let is_on = (places[other] - places[end]).normalize_or_zero().dot(way) > STRAIGHT;
                is_on.then_some(other)
            };
            while let Some((j, other)) = at[&end]
                .iter()
                .filter(|&&j| !is_taken[j])
                .find_map(|&j| Some((j, goes_on(end, j)?)))
            {
                (is_taken[j], end) = (true, other);
            }
            places[end]
        });
        edges.push(ends);
    }
    edges
}

/// Whether three of the planes that meet at a vertex meet there alone.
fn is_corner(normals: &[DVec3]) -> bool {
    let mut planes: Vec<DVec3> = Vec::new();
    for normal in normals {
        if planes.iter().all(|known| known.dot(*normal) < SHARP) {
            planes.push(*normal);
        }
    }
    let n = planes.len();
    (0..n).any(|i| {
        (i + 1..n)
            .any(|j| (j + 1..n).any(|k| planes[i].cross(planes[j]).dot(planes[k]).abs() > SOLID))
    })
}
