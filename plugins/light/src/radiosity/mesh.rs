//! Quads cut into patches, and what a point sees of them.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Quad,
    polygon::{Plane, Polygon, Shadow, TINY, form_factor},
};

/// Where Gauss and Legendre's two points of [−1, 1] lie: ±1/√3. 2 × 2 of them, all of the same
/// weight, stand for a patch.
pub(super) const GAUSS: f64 = 0.577_350_269_189_625_8;

/// Patches of the first mesh, about.
const FIRST: f64 = 400.0;

/// A quad with what is asked of it again and again.
#[derive(Debug, Clone)]
pub(super) struct Face {
    pub(super) corners: [DVec3; 4],
    pub(super) normal: DVec3,
    pub(super) plane: Plane,
    /// Height along these is the quad's coordinate u or v, each 0…1.
    coordinates: [Plane; 2],
    pub(super) area: f64,
}

impl Face {
    fn new(q: &Quad) -> Self {
        let [corner, u, v] = [q.corner, q.u, q.v].map(|e| e.as_dvec3());
        let n = u.cross(v);
        let normal = n.normalize_or_zero();
        let square = n.length_squared().max(f64::MIN_POSITIVE);
        Self {
            corners: [corner, corner + u, corner + u + v, corner + v],
            normal,
            plane: Plane::through(corner, normal),
            coordinates: [v.cross(n) / square, n.cross(u) / square]
                .map(|dual| Plane::through(corner, dual)),
            area: n.length(),
        }
    }

    /// The point at the quad's coordinates.
    fn at(&self, u: f64, v: f64) -> DVec3 {
        self.corners[0]
            + (self.corners[1] - self.corners[0]) * u
            + (self.corners[3] - self.corners[0]) * v
    }

    /// The quad's coordinates of a point in its plane.
    pub(super) fn coordinates(&self, p: DVec3) -> [f64; 2] {
        self.coordinates.map(|c| c.height(p))
    }

    /// The four sides of a part of the quad, inside positive.
    fn sides(&self, part: &[[f64; 2]; 2]) -> [Plane; 4] {
        let [u, v] = self.coordinates;
        let from = |p: Plane, t: f64| Plane { n: p.n, d: p.d + t };
        [
            from(u, part[0][0]),
            from(u, part[0][1]).turned(),
            from(v, part[1][0]),
            from(v, part[1][1]).turned(),
        ]
    }
}

/// A part of a quad.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    pub(super) quad: usize,
    /// From and to in the quad's two coordinates.
    pub(super) part: [[f64; 2]; 2],
    pub(super) corners: [DVec3; 4],
    /// At (−, −), (+, −), (−, +), (+, +) 1/√3 of its half lengths from its middle.
    pub(super) points: [DVec3; 4],
    pub(super) area: f64,
}

impl Patch {
    fn new(quad: usize, face: &Face, part: [[f64; 2]; 2]) -> Self {
        let [[u0, u1], [v0, v1]] = part;
        let point = |[lo, hi]: [f64; 2], sign: f64| 0.5 * (lo + hi + sign * GAUSS * (hi - lo));
        let signs = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        Self {
            quad,
            part,
            corners: [face.at(u0, v0), face.at(u1, v0), face.at(u1, v1), face.at(u0, v1)],
            points: signs.map(|[su, sv]| face.at(point(part[0], su), point(part[1], sv))),
            area: face.area * (u1 - u0) * (v1 - v0),
        }
    }

    fn halved(&self, face: &Face, along: [bool; 2]) -> Vec<Self> {
        let cut = |k: usize| {
            let [lo, hi] = self.part[k];
            let middle = 0.5 * (lo + hi);
            if along[k] { vec![[lo, middle], [middle, hi]] } else { vec![[lo, hi]] }
        };
        cut(1)
            .into_iter()
            .flat_map(|v| cut(0).into_iter().map(move |u| [u, v]))
            .map(|part| Self::new(self.quad, face, part))
            .collect()
    }
}

/// What is seen of a quad from a point.
pub(super) enum View {
    /// All of it.
    Whole,
    /// Convex pieces that do not overlap, with their ranges of the quad's coordinates.
    Pieces(Vec<(Polygon, [[f64; 2]; 2])>),
}

/// The quads, and which of them can stand between which.
pub(super) struct Walls {
    pub(super) faces: Vec<Face>,
    /// Without the second of two quads back to back.
    blockers: Vec<usize>,
    /// What can stand between every two quads: `None` for two that do not face each other.
    pub(super) between: Vec<Vec<Option<Vec<usize>>>>,
}

impl Walls {
    pub(super) fn new(quads: &[Quad]) -> Self {
        let faces: Vec<Face> = quads.iter().map(Face::new).collect();
        let same = |a: &Face, b: &Face| {
            a.corners.iter().all(|p| b.corners.iter().any(|q| p.distance(*q) <= TINY))
        };
        let first =
            |i: &usize| faces[*i].area > 0.0 && !faces[..*i].iter().any(|f| same(f, &faces[*i]));
        let blockers = (0..faces.len()).filter(first).collect();
        let mut walls = Self { faces, blockers, between: Vec::new() };
        let facing =
            |a: &Face, b: &Face| !a.plane.misses(&b.corners) && !b.plane.misses(&a.corners);
        let row = |a: &Face| {
            let to = |(i, b): (usize, &Face)| facing(a, b).then(|| walls.obstacles(&a.corners, i));
            walls.faces.iter().enumerate().map(to).collect()
        };
        walls.between = walls.faces.par_iter().map(row).collect();
        walls
    }

    /// Quads that can hide some of quad `to` from some point of the polygon `from` (or from a
    /// single point).
    pub(super) fn obstacles(&self, from: &[DVec3], to: usize) -> Vec<usize> {
        let face = &self.faces[to];
        let both = || from.iter().chain(&face.corners).copied();
        let apart = |b: &Face| {
            let one_side = |sign: f64| both().all(|p| sign * b.plane.height(p) <= TINY);
            let bounds = |points: &mut dyn Iterator<Item = DVec3>| {
                points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| {
                    [lo.min(p), hi.max(p)]
                })
            };
            let ([lo, hi], [b_lo, b_hi]) =
                (bounds(&mut both()), bounds(&mut b.corners.iter().copied()));
            face.plane.misses(&b.corners)
                || one_side(1.0)
                || one_side(-1.0)
                || b_lo.cmpgt(hi + TINY).any()
                || b_hi.cmplt(lo - TINY).any()
        };
        self.blockers.iter().copied().filter(|&b| !apart(&self.faces[b])).collect()
    }

    /// What `x` sees of quad `to`, with these quads in the way.
    pub(super) fn view(&self, x: DVec3, to: usize, between: &[usize]) -> View {
        if between.is_empty() {
            return View::Whole;
        }
        let face = &self.faces[to];
        let mut pieces = vec![face.corners.to_vec()];
        for &b in between {
            if let Some(shadow) = Shadow::new(x, &self.faces[b].corners, self.faces[b].normal) {
                let mut lit = Vec::with_capacity(pieces.len() + 4);
                pieces.into_iter().for_each(|piece| shadow.take_from(piece, &mut lit));
                pieces = lit;
            }
        }
        let with_range = |piece: Polygon| {
            let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for p in &piece {
                for (r, c) in range.iter_mut().zip(face.coordinates(*p)) {
                    *r = [r[0].min(c), r[1].max(c)];
                }
            }
            (piece, range)
        };
        View::Pieces(pieces.into_iter().map(with_range).collect())
    }

    /// Calls with every visible piece of a patch.
    pub(super) fn pieces(
        &self,
        view: &View,
        patch: &Patch,
        [one, other]: [&mut Polygon; 2],
        mut with: impl FnMut(&[DVec3]),
    ) {
        let View::Pieces(pieces) = view else { return with(&patch.corners) };
        for (piece, range) in pieces {
            let outside =
                |k: usize| range[k][1] <= patch.part[k][0] || range[k][0] >= patch.part[k][1];
            if outside(0) || outside(1) {
                continue;
            }
            one.clone_from(piece);
            for side in self.faces[patch.quad].sides(&patch.part) {
                side.cut(one, other);
                std::mem::swap(one, other);
            }
            if one.len() >= 3 {
                with(one);
            }
        }
    }

    /// Share of the light that leaves a surface at `x` with normal `n` for a patch.
    pub(super) fn factor(
        &self,
        x: DVec3,
        n: DVec3,
        patch: &Patch,
        view: &View,
        [a, b, c]: &mut [Polygon; 3],
    ) -> f64 {
        let mut sum = 0.0;
        self.pieces(view, patch, [a, b], |piece| sum += form_factor(x, n, piece, c));
        sum
    }
}

/// A function on a patch by its values at the four points: mean, and what goes with s, t and s·t,
/// where s, t = ±1 at the points.
pub(super) fn bilinear([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [a + b + c + d, b - a + d - c, c - a + d - b, a - b + d - c].map(|sum| 0.25 * sum)
}

/// Patches, ordered by quad.
pub(super) struct Mesh {
    pub(super) patches: Vec<Patch>,
    /// Every quad that has patches, with the range of them.
    pub(super) ranges: Vec<(usize, Range<usize>)>,
}

impl Mesh {
    fn new(patches: Vec<Patch>) -> Self {
        let mut start = 0;
        let range = |same: &[Patch]| {
            start += same.len();
            (same[0].quad, start - same.len()..start)
        };
        let ranges = patches.chunk_by(|a, b| a.quad == b.quad).map(range).collect();
        Self { patches, ranges }
    }

    /// Every quad in parts of about the same size.
    pub(super) fn first(walls: &Walls) -> Self {
        let all: f64 = walls.faces.iter().map(|f| f.area).sum();
        let size = (all / FIRST).sqrt();
        let mut patches = Vec::new();
        for (quad, face) in walls.faces.iter().enumerate().filter(|(_, f)| f.area > 0.0) {
            let [nu, nv] = [1, 3].map(|k| {
                (face.corners[0].distance(face.corners[k]) / size).ceil().clamp(1.0, FIRST) as usize
            });
            let part = |k: usize, n: usize| [k as f64 / n as f64, (k + 1) as f64 / n as f64];
            patches.extend(
                (0..nu * nv).map(|k| Patch::new(quad, face, [part(k % nu, nu), part(k / nu, nv)])),
            );
        }
        Self::new(patches)
    }

    /// With every patch halved along the coordinates that are said for it.
    pub(super) fn halved(&self, walls: &Walls, along: &[[bool; 2]]) -> Self {
        Self::new(
            self.patches
                .iter()
                .zip(along)
                .flat_map(|(p, &along)| p.halved(&walls.faces[p.quad], along))
                .collect(),
        )
    }
}
