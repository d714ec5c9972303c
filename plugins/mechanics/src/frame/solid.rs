//! The surface of a member as a body: its cuts, what is inside, and samples of what it shows.

use glam::{DVec2, DVec3};

/// A closed surface; triangles wind anticlockwise seen from outside.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    triangles: Vec<[DVec3; 3]>,
    /// Corners of its box, m.
    pub(super) bounds: [DVec3; 2],
    /// m³.
    pub(super) volume: f64,
}

/// A piece of surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub(super) at: DVec3,
    /// m².
    pub(super) area: f64,
    /// Unit, outwards.
    pub(super) normal: DVec3,
}

/// Normals count as one direction where they differ by less.
const SAME: f64 = 0.02;
/// Faces look at each other by this cosine.
const OPPOSITE: f64 = 0.9;
/// So many directions are told apart: a surface with more has none that tells its axes.
const DIRECTIONS: usize = 4096;

impl Solid {
    /// The body within these triangles; none: they enclose nothing.
    pub(super) fn new(points: &[DVec3], triangles: &[[u32; 3]]) -> Option<Self> {
        let mut triangles: Vec<[DVec3; 3]> =
            triangles.iter().map(|t| t.map(|i| points[i as usize])).collect();
        triangles.retain(|[a, b, c]| (*b - *a).cross(*c - *a).length() > 0.0);
        let origin = triangles.first()?[0];
        let sixfold = |t: &[DVec3; 3]| {
            let [a, b, c] = t.map(|p| p - origin);
            a.dot(b.cross(c))
        };
        let volume = triangles.iter().map(sixfold).sum::<f64>() / 6.0;
        if volume < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let bounds = triangles
            .iter()
            .flatten()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
                [low.min(*p), high.max(*p)]
            });
        let size = (bounds[1] - bounds[0]).element_product();
        let volume = volume.abs();
        (volume > 1e-9 * size).then_some(Self { triangles, bounds, volume })
    }

    /// From and to along a direction.
    pub(super) fn span(&self, axis: DVec3) -> [f64; 2] {
        self.triangles
            .iter()
            .flatten()
            .map(|p| p.dot(axis))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)])
    }

    pub(super) fn extent(&self, axis: DVec3) -> f64 {
        let [low, high] = self.span(axis);
        high - low
    }

    /// Three directions at right angles that most of its surface looks along, most first: the axes
    /// of a box.
    pub(super) fn directions(&self) -> [DVec3; 3] {
        let facets: Vec<(DVec3, f64)> = self.facets().collect();
        let first = most(&facets, Some);
        let second = most(&facets, |n| {
            let flat = n.reject_from_normalized(first);
            (flat.length() > 0.9).then(|| flat.normalize())
        });
        let second = if second == DVec3::ZERO { first.any_orthonormal_vector() } else { second };
        [first, second, first.cross(second)]
    }

    /// Unit normals and areas.
    fn facets(&self) -> impl Iterator<Item = (DVec3, f64)> {
        self.triangles.iter().map(|[a, b, c]| {
            let n = (*b - *a).cross(*c - *a);
            (n.normalize_or_zero(), 0.5 * n.length())
        })
    }

    /// What a plane through `at` across `axes[0]` cuts out, in `axes[1]` and `axes[2]` from `at`:
    /// pieces that go round it counterclockwise seen from where `axes[0]` points to.
    pub(super) fn cut(&self, at: DVec3, axes: [DVec3; 3]) -> Vec<[DVec2; 2]> {
        let piece = |t: &[DVec3; 3]| {
            let height = t.map(|p| (p - at).dot(axes[0]));
            // A corner on the plane counts as above it, in all its triangles alike.
            let above = height.map(|h| h >= 0.0);
            let crossing: Vec<DVec3> = (0..3)
                .map(|i| (i, (i + 1) % 3))
                .filter(|&(i, j)| above[i] != above[j])
                .map(|(i, j)| t[i].lerp(t[j], height[i] / (height[i] - height[j])))
                .collect();
            let [a, b] = crossing[..] else { return None };
            let normal = (t[1] - t[0]).cross(t[2] - t[0]);
            let forward = (b - a).dot(axes[0].cross(normal)) >= 0.0;
            let flat = |p: DVec3| DVec2::new((p - at).dot(axes[1]), (p - at).dot(axes[2]));
            Some(if forward { [flat(a), flat(b)] } else { [flat(b), flat(a)] })
        };
        self.triangles.iter().filter_map(piece).collect()
    }

    /// Where a line meets its surface, m along `way` from `at`, ascending.
    pub(super) fn crossings(&self, at: DVec3, way: DVec3) -> Vec<f64> {
        let side = way.any_orthonormal_vector();
        let other = way.cross(side);
        let meet = |t: &[DVec3; 3]| {
            let flat = t.map(|p| DVec2::new((p - at).dot(side), (p - at).dot(other)));
            let [a, b, c] = [0, 1, 2].map(|i| flat[(i + 1) % 3].perp_dot(flat[(i + 2) % 3]));
            let inside = (a >= 0.0 && b >= 0.0 && c >= 0.0) || (a < 0.0 && b < 0.0 && c < 0.0);
            let sum = a + b + c;
            if !inside || sum == 0.0 {
                return None;
            }
            Some((a * (t[0] - at) + b * (t[1] - at) + c * (t[2] - at)).dot(way) / sum)
        };
        let mut found: Vec<f64> = self.triangles.iter().filter_map(meet).collect();
        found.sort_unstable_by(f64::total_cmp);
        found
    }

    /// Whether a point is inside.
    pub(super) fn holds(&self, p: DVec3) -> bool {
        let [low, high] = self.bounds;
        // A direction along no edge that anybody draws.
        let way = DVec3::new(0.2113, 0.8791, 0.4271).normalize();
        p.clamp(low, high) == p
            && self.crossings(p, way).iter().filter(|s| **s > 0.0).count() % 2 == 1
    }

    /// Triangles that come near a box.
    pub(super) fn near(&self, [low, high]: [DVec3; 2]) -> Vec<[DVec3; 3]> {
        let meets = |t: &&[DVec3; 3]| {
            let [l, h] = [t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2])];
            l.cmple(high).all() && h.cmpge(low).all()
        };
        self.triangles.iter().filter(meets).copied().collect()
    }

    /// About `count` samples of its surface, evenly spread.
    pub(super) fn samples(&self, count: usize) -> Vec<Sample> {
        let everywhere = [DVec3::NEG_INFINITY, DVec3::INFINITY];
        samples(&self.triangles, everywhere, count)
    }
}

/// The direction that most of the area looks along, where `flat` lets it take part.
fn most(facets: &[(DVec3, f64)], flat: impl Fn(DVec3) -> Option<DVec3>) -> DVec3 {
    let mut clusters: Vec<(DVec3, f64)> = Vec::new();
    for (normal, area) in facets {
        let Some(normal) = flat(*normal) else { continue };
        let alike = |c: &(DVec3, f64)| c.0.dot(normal).abs() > 1.0 - 0.5 * SAME * SAME;
        match clusters.iter().position(alike) {
            Some(cluster) => clusters[cluster].1 += area,
            None if clusters.len() < DIRECTIONS => clusters.push((normal, *area)),
            None => {}
        }
    }
    let largest = clusters.iter().map(|c| c.1).fold(0.0, f64::max);
    clusters.iter().find(|c| c.1 >= (1.0 - 1e-6) * largest).map_or(DVec3::ZERO, |c| c.0)
}

/// About `count` samples of what of these triangles is within a box.
pub(super) fn samples(triangles: &[[DVec3; 3]], bounds: [DVec3; 2], count: usize) -> Vec<Sample> {
    let pieces: Vec<(Vec<DVec3>, DVec3)> = triangles
        .iter()
        .map(|t| (clipped(t, bounds), (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero()))
        .filter(|(corners, _)| corners.len() > 2)
        .collect();
    let fans = || {
        pieces.iter().flat_map(|(corners, normal)| {
            corners[1..].windows(2).map(|w| ([corners[0], w[0], w[1]], *normal))
        })
    };
    let area_of = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
    let all: f64 = fans().map(|(t, _)| area_of(&t)).sum();
    let mut found = Vec::new();
    for (triangle, normal) in fans() {
        let area = area_of(&triangle);
        // n² small triangles of one shape.
        let n = (count as f64 * area / all.max(1e-300)).sqrt().ceil().clamp(1.0, 64.0) as u32;
        let [a, b, c] = triangle;
        let at = |i: f64, j: f64| a + (i * (b - a) + j * (c - a)) / f64::from(n);
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (f64::from(i), f64::from(j)))) {
            let area = area / f64::from(n * n);
            found.push(Sample { at: at(i + 1.0 / 3.0, j + 1.0 / 3.0), area, normal });
            if i + j + 2.0 <= f64::from(n) {
                found.push(Sample { at: at(i + 2.0 / 3.0, j + 2.0 / 3.0), area, normal });
            }
        }
    }
    found
}

/// The part of a triangle within a box (Sutherland and Hodgman 1974).
fn clipped(triangle: &[DVec3; 3], [low, high]: [DVec3; 2]) -> Vec<DVec3> {
    let mut corners = triangle.to_vec();
    for (axis, bound, way) in (0..3).flat_map(|i| [(i, low[i], 1.0), (i, high[i], -1.0)]) {
        if bound.is_infinite() {
            continue;
        }
        let inside = |p: DVec3| way * (p[axis] - bound);
        let before = std::mem::take(&mut corners);
        for (i, &p) in before.iter().enumerate() {
            let q = before[(i + 1) % before.len()];
            let (a, b) = (inside(p), inside(q));
            if a >= 0.0 {
                corners.push(p);
            }
            if (a >= 0.0) != (b >= 0.0) {
                corners.push(p.lerp(q, a / (a - b)));
            }
        }
    }
    corners
}

/// How far a point is from a triangle (Ericson 2005, §5.1.5).
pub(super) fn distance(p: DVec3, [a, b, c]: &[DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (*b - *a, *c - *a, p - *a);
    let normal = ab.cross(ac);
    let square = normal.length_squared();
    let v = ap.cross(ac).dot(normal) / square;
    let w = ab.cross(ap).dot(normal) / square;
    if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
        return ap.dot(normal).abs() / square.sqrt();
    }
    let edge = |from: DVec3, to: DVec3| {
        let along = to - from;
        let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(from + t * along)
    };
    edge(*a, *b).min(edge(*b, *c)).min(edge(*c, *a))
}

/// Whether a triangle lies straight over a piece of surface, within a distance, and looks at it.
pub(super) fn meets(s: &Sample, [a, b, c]: &[DVec3; 3], reach: f64) -> bool {
    let (ab, ac, ap) = (*b - *a, *c - *a, s.at - *a);
    let normal = ab.cross(ac);
    let square = normal.length_squared();
    let [v, w] = [ap.cross(ac), ab.cross(ap)].map(|x| x.dot(normal) / square);
    let is_over = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    let height = ap.dot(normal).abs() / square.sqrt();
    is_over && height <= reach && normal.dot(s.normal) < -OPPOSITE * square.sqrt()
}

#[cfg(test)]
pub(super) fn cuboid(low: DVec3, high: DVec3) -> Solid {
    let points: Vec<DVec3> = (0..8)
        .map(|i| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low))
        .collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> =
        quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Solid::new(&points, &triangles).unwrap()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_knows_its_volume_its_cuts_and_what_is_inside() {
        let solid = cuboid(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(3.0, 0.5, 3.0));
        assert!((solid.volume - 2.0).abs() < 1e-12);
        assert!(solid.holds(DVec3::new(0.0, 0.2, 2.5)) && !solid.holds(DVec3::new(0.0, 0.6, 2.5)));
        let pieces = solid.cut(DVec3::new(0.0, 0.1, 2.2), [DVec3::X, DVec3::Y, DVec3::Z]);
        let (section, centre, turn) = super::super::section::Section::outlined(&pieces).unwrap();
        assert!((section.area - 0.5).abs() < 1e-12 && turn == 0.0);
        assert!(centre.distance(DVec2::new(0.15, 0.3)) < 1e-12);
        let area: f64 = solid.samples(500).iter().map(|s| s.area).sum();
        assert!((area - 2.0 * (4.0 * 0.5 + 4.0 + 0.5)).abs() < 1e-9, "{area}");
        assert_eq!(solid.directions().map(|d| d.abs()), [DVec3::Y, DVec3::Z, DVec3::X]);
    }
}
