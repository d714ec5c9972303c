//! Cuts a triangle along the borders of regions: a constrained Delaunay triangulation in the
//! triangle's plane, whose faces are then told to be inside a region or not.

use std::collections::HashMap;

use glam::DVec2;
use spade::{
    ConstrainedDelaunayTriangulation, Point2, PositionInTriangulation, Triangulation,
    handles::FixedVertexHandle,
};

/// Coordinates are kept to a nanometre, so that what is meant to be one point is.
const GRID: f64 = 1e9;

/// Corners of pieces so near an edge of their triangle lie on it, m.
pub(super) const ON_EDGE: f64 = 2e-8;

/// A part of the plane that is cut out: which triangles make it up, what bounds it.
#[derive(Debug, Clone, Default)]
pub(super) struct Region {
    /// What it is called afterwards.
    pub(super) label: u32,
    /// Their union is the region.
    pub(super) triangles: Vec<[DVec2; 3]>,
    /// Its border.
    pub(super) border: Vec<[DVec2; 2]>,
}

/// The triangles of regions, found by place.
struct Finder {
    side: f64,
    cells: HashMap<[i64; 2], Vec<(u32, [DVec2; 3])>>,
}

impl Finder {
    fn new(regions: &[Region]) -> Self {
        let all = || regions.iter().flat_map(|r| r.triangles.iter().map(move |&t| (r.label, t)));
        let bounds = |[a, b, c]: [DVec2; 3]| [a.min(b).min(c), a.max(b).max(c)];
        let extent = |t| {
            let [low, high] = bounds(t);
            (high - low).max_element()
        };
        let side = all().map(|(_, t)| extent(t)).fold(8e-3, f64::max).max(1e-6) / 2.0;
        let mut finder = Self { side, cells: HashMap::new() };
        for (label, triangle) in all() {
            let [low, high] = bounds(triangle).map(|p| finder.cell(p));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    finder.cells.entry([x, y]).or_default().push((label, triangle));
                }
            }
        }
        finder
    }

    fn cell(&self, p: DVec2) -> [i64; 2] {
        (p / self.side).floor().to_array().map(|x| x as i64)
    }

    /// The lowest label of the regions there.
    fn label(&self, p: DVec2) -> Option<u32> {
        let here = self.cells.get(&self.cell(p))?;
        here.iter().filter(|(_, t)| is_inside(*t, p)).map(|(label, _)| *label).min()
    }
}

/// A piece of the triangle, and the label of the region that it is in, if any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub(super) corners: [DVec2; 3],
    pub(super) label: Option<u32>,
}

fn is_inside([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    let side = |a: DVec2, b: DVec2| (b - a).perp_dot(p - a);
    let (x, y, z) = (side(a, b), side(b, c), side(c, a));
    (x >= 0.0 && y >= 0.0 && z >= 0.0) || (x <= 0.0 && y <= 0.0 && z <= 0.0)
}

/// Whether rounding made a piece between an edge and the points on it.
fn is_flat_on_edge(corners: [DVec2; 3], piece: [DVec2; 3]) -> bool {
    (0..3).any(|k| {
        let way = (corners[(k + 1) % 3] - corners[k]).normalize_or_zero();
        piece.iter().all(|&p| way.perp_dot(p - corners[k]).abs() < ON_EDGE)
    })
}

/// Distance of a place inside from the nearest edge, m.
fn from_border(corners: [DVec2; 3], p: DVec2) -> f64 {
    let edge = |k: usize| {
        let way = corners[(k + 1) % 3] - corners[k];
        (way.perp_dot(p - corners[k]) / way.length()).abs()
    };
    edge(0).min(edge(1)).min(edge(2))
}

fn snapped(p: DVec2) -> Point2<f64> {
    let p = (p * GRID).round() / GRID;
    // Adding 0 turns −0 into 0.
    Point2::new(p.x + 0.0, p.y + 0.0)
}

/// The pieces of a triangle that winds anticlockwise, in the order of the triangulation. Where
/// regions overlap the lowest label names the piece. `points` are put inside as far as they are not
/// too near to what is there already: each with the distance to keep. `edges` holds points of the
/// triangle's three edges (from corner to corner) that must become corners of pieces.
pub(super) fn cut(
    corners: [DVec2; 3],
    edges: &[Vec<DVec2>; 3],
    regions: &[Region],
    points: &[(DVec2, f64)],
) -> Vec<Piece> {
    let mut net = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    // A coordinate that is not finite cannot be inserted; nothing is cut then.
    let put = |net: &mut ConstrainedDelaunayTriangulation<_>, p| net.insert(snapped(p)).ok();
    let whole = || vec![Piece { corners, label: None }];
    let mut segments: Vec<[FixedVertexHandle; 2]> = Vec::new();
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let mut on: Vec<DVec2> = edges[k].clone();
        on.sort_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)));
        let chain: Option<Vec<_>> =
            std::iter::once(from).chain(on).chain([to]).map(|p| put(&mut net, p)).collect();
        let Some(chain) = chain else { return whole() };
        segments.extend(chain.windows(2).map(|pair| [pair[0], pair[1]]));
    }
    for &[from, to] in regions.iter().flat_map(|r| &r.border) {
        let (Some(from), Some(to)) = (put(&mut net, from), put(&mut net, to)) else {
            return whole();
        };
        segments.push([from, to]);
    }
    for &(p, apart) in points {
        // Before there are constraints the net is Delaunay's: corners about a place are near it.
        let PositionInTriangulation::OnFace(face) = net.locate(snapped(p)) else { continue };
        let about = net.face(face).vertices().map(|v| v.position());
        let is_free = about.iter().all(|q| DVec2::new(q.x, q.y).distance(p) > apart);
        if is_free && is_inside(corners, p) && from_border(corners, p) > 0.5 * apart {
            put(&mut net, p);
        }
    }
    let finder = Finder::new(regions);
    for [from, to] in segments {
        if from != to {
            net.add_constraint_and_split(from, to, |p| p);
        }
    }
    let inside = net.inner_faces().filter_map(|face| {
        let corners_of = face.vertices().map(|v| DVec2::new(v.position().x, v.position().y));
        let middle = corners_of.iter().sum::<DVec2>() / 3.0;
        let label = finder.label(middle);
        let is_piece = is_inside(corners, middle) && !is_flat_on_edge(corners, corners_of);
        is_piece.then_some(Piece { corners: corners_of, label })
    });
    inside.collect()
}

#[cfg(test)]
mod tests {
    use glam::dvec2;
    use intrados_stage::random::Draw;
    use intrados_stage::random::Key;

    use super::*;

    fn area([a, b, c]: [DVec2; 3]) -> f64 {
        0.5 * (b - a).perp_dot(c - a)
    }

    fn band(a: DVec2, b: DVec2, width: f64, label: u32) -> Region {
        let half = 0.5 * width * (b - a).perp().normalize();
        let [p, q, r, s] = [a - half, b - half, b + half, a + half];
        Region {
            label,
            triangles: vec![[p, q, r], [p, r, s]],
            border: vec![[p, q], [q, r], [r, s], [s, p]],
        }
    }

    /// Bands .1 mm to 20 mm wide across a triangle of 3 m, crossing each other and its edges: the
    /// pieces are the triangle, wind as it does, and those of a band have its area.
    #[test]
    fn pieces_make_up_the_triangle_and_bands_keep_their_area() {
        let corners = [dvec2(0.0, 0.0), dvec2(3.0, 0.1), dvec2(0.4, 2.0)];
        for seed in 0..40 {
            let mut draw = Draw::new(Key::new(seed, 1));
            let mut within = || {
                let (u, v) = (draw.unit(), draw.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
            };
            let ends: Vec<[DVec2; 2]> = (0..5).map(|_| [within(), within()]).collect();
            let width = 1e-4 * 200.0_f64.powf(seed as f64 / 39.0);
            let bands: Vec<Region> = ends
                .iter()
                .enumerate()
                .map(|(i, &[a, b])| band(a, b + 0.5 * (b - a), width, i as u32))
                .collect();
            let none: [Vec<DVec2>; 3] = Default::default();
            let pieces = cut(corners, &none, &bands, &[(within(), 1e-3), (within(), 1e-3)]);
            let total: f64 = pieces.iter().map(|p| area(p.corners)).sum();
            assert!((total - area(corners)).abs() < 1e-8, "{total}");
            assert!(pieces.iter().all(|p| area(p.corners) > -1e-12));
            let one = cut(corners, &none, &bands[..1], &[]);
            let cut_out: f64 =
                one.iter().filter(|p| p.label.is_some()).map(|p| area(p.corners)).sum();
            // By clipping the band's middle line: exact but for its two slanted ends.
            let [a, b] = ends[0];
            let b = b + 0.5 * (b - a);
            let inside = (0..20_000)
                .filter(|i| is_inside(corners, a + (b - a) * (f64::from(*i) + 0.5) / 20_000.0))
                .count();
            let expected = width * (b - a).length() * inside as f64 / 20_000.0;
            let slack = width * width * 8.0 + expected * 3e-3;
            assert!((cut_out - expected).abs() < slack, "{cut_out} {expected}");
        }
    }
}
