//! Triangles of a polygon in space: ears are cut off one by one (Meisters, 1975) in the plane that
//! fits its corners best. Holes come as bridge edges, walked once each way. Only corners that do
//! not turn outward can lie in an ear, so that these alone are asked, from a grid in the plane.

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, DVec3};

/// Corners that may be asked for each corner of a polygon, and for any polygon besides, before it
/// is refused: what a face costs is bounded, whatever it looks like.
const WORK: [usize; 2] = [512, 1 << 22];
/// Of a polygon's extent: areas and distances below its square and it are rounding.
const ROUNDING: f64 = 1e-12;

/// Triangles of a polygon.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Triangulation {
    /// Corners by their places in the polygon.
    pub(crate) triangles: Vec<[usize; 3]>,
    /// Whether ears were left to cut to the end; a polygon that crosses itself has none some time.
    pub(crate) is_simple: bool,
}

/// Triangles of a polygon that turn as it does; corners may repeat. `None` if that takes too long.
pub(crate) fn triangulate(corners: &[DVec3]) -> Option<Triangulation> {
    match corners.len() {
        0..=2 => return Some(Triangulation { triangles: Vec::new(), is_simple: true }),
        3 => return Some(Triangulation { triangles: vec![[0, 1, 2]], is_simple: true }),
        _ => {}
    }
    let Some(flat) = flattened(corners) else {
        // All on one line: edges that fold onto each other.
        let triangles = (2..corners.len()).map(|k| [0, k - 1, k]).collect();
        return Some(Triangulation { triangles, is_simple: true });
    };
    let mut clipper = Clipper::new(flat);
    let (mut triangles, mut is_simple) = (Vec::with_capacity(corners.len() - 2), true);
    for strictness in [Strictness::Closed, Strictness::Open, Strictness::Any] {
        if clipper.left <= 3 {
            break;
        }
        is_simple = strictness != Strictness::Any;
        clipper.cut(strictness, &mut triangles)?;
    }
    triangles.extend(clipper.rest());
    Some(Triangulation { triangles, is_simple })
}

/// In the plane of Newell's normal, about the first corner, counter-clockwise.
fn flattened(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = *corners.first()?;
    let local = || corners.iter().map(|p| *p - origin);
    let next = local().cycle().skip(1);
    let normal: DVec3 = local().zip(next).map(|(a, b)| a.cross(b)).sum();
    let extent = local().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if normal.length() <= ROUNDING * extent * extent {
        return None;
    }
    let normal = normal.try_normalize()?;
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    Some(local().map(|p| DVec2::new(p.dot(x), p.dot(y))).collect())
}

/// What keeps an ear from being cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Strictness {
    /// A corner in the triangle or on its edges.
    Closed,
    /// A corner within the triangle or on the new edge.
    Open,
    /// Nothing: the polygon crosses itself.
    Any,
}

struct Clipper {
    flat: Vec<DVec2>,
    before: Vec<usize>,
    after: Vec<usize>,
    is_cut: Vec<bool>,
    left: usize,
    /// Any corner that is left.
    first: usize,
    grid: Grid,
    /// Least doubled area of an ear.
    least: f64,
    work: usize,
}

impl Clipper {
    fn new(flat: Vec<DVec2>) -> Self {
        let n = flat.len();
        let [low, high] = (flat.iter())
            .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
        let extent = (high - low).max_element();
        let mut clipper = Self {
            before: (0..n).map(|k| (k + n - 1) % n).collect(),
            after: (0..n).map(|k| (k + 1) % n).collect(),
            is_cut: vec![false; n],
            left: n,
            first: 0,
            grid: Grid::new(low, high, n),
            least: ROUNDING * extent * extent,
            work: n.saturating_mul(WORK[0]).saturating_add(WORK[1]),
            flat,
        };
        for k in (0..n).filter(|&k| clipper.turn(k) <= clipper.least).collect::<Vec<usize>>() {
            clipper.grid.put(clipper.flat[k], k);
        }
        clipper
    }

    /// Doubled area of the triangle of a corner with its neighbours; positive where it turns inward.
    fn turn(&self, k: usize) -> f64 {
        let [a, b, c] = [self.before[k], k, self.after[k]].map(|i| self.flat[i]);
        (b - a).perp_dot(c - b)
    }

    /// Cuts ears until none is left to cut. `None`: the work is used up.
    fn cut(&mut self, strictness: Strictness, triangles: &mut Vec<[usize; 3]>) -> Option<()> {
        loop {
            let before = self.left;
            self.work = self.work.checked_sub(before)?;
            let mut open: VecDeque<usize> = self.around().collect();
            while let Some(k) = open.pop_front().filter(|_| self.left > 3) {
                if self.is_cut[k] || !self.is_ear(k, strictness)? {
                    continue;
                }
                let (a, c) = (self.before[k], self.after[k]);
                triangles.push([a, k, c]);
                (self.after[a], self.before[c]) = (c, a);
                self.is_cut[k] = true;
                (self.left, self.first) = (self.left - 1, c);
                // What turned outward may be an ear now; later, so that no fan grows.
                open.extend([a, c]);
            }
            // What was in the way of an ear may be gone.
            if self.left <= 3 || self.left == before {
                return Some(());
            }
        }
    }

    fn around(&self) -> impl Iterator<Item = usize> {
        let all = std::iter::successors(Some(self.first), |&k| Some(self.after[k]));
        all.take(self.left)
    }

    /// Whether a corner may be cut off. `None`: the work is used up.
    fn is_ear(&mut self, k: usize, strictness: Strictness) -> Option<bool> {
        let turn = self.turn(k);
        if strictness == Strictness::Any {
            return Some(true);
        }
        if turn <= self.least {
            return Some(false);
        }
        let corners = [self.before[k], k, self.after[k]].map(|i| self.flat[i]);
        let within = |p: DVec2| {
            let [a, b, c] = corners;
            let sides = [(a, b), (b, c), (c, a)].map(|(s, t)| (t - s).perp_dot(p - s));
            let is_corner = p == a || p == b || p == c;
            !is_corner
                && match strictness {
                    Strictness::Closed => sides.iter().all(|s| *s >= 0.0),
                    _ => sides[0] > 0.0 && sides[1] > 0.0 && sides[2] >= 0.0,
                }
        };
        let (is_cut, before, after, flat) = (&self.is_cut, &self.before, &self.after, &self.flat);
        let least = self.least;
        // A corner that turns inward by now blocks nothing that its neighbours do not.
        let blocks = |i: usize| {
            let [p, q, r] = [before[i], i, after[i]].map(|i| flat[i]);
            !is_cut[i] && (q - p).perp_dot(r - q) <= least && within(q)
        };
        let blocked = self.grid.any(corners, blocks, &mut self.work)?;
        Some(!blocked)
    }

    /// The last triangle.
    fn rest(&self) -> Option<[usize; 3]> {
        let (k, before, after) =
            (self.first, self.before.get(self.first)?, self.after.get(self.first)?);
        (self.left == 3).then_some([*before, k, *after])
    }
}

/// Corners by the cell of the plane in which they lie.
struct Grid {
    low: DVec2,
    /// Cells a metre.
    scale: DVec2,
    cells: usize,
    held: BTreeMap<[usize; 2], Vec<usize>>,
    all: Vec<usize>,
}

impl Grid {
    fn new(low: DVec2, high: DVec2, count: usize) -> Self {
        let cells = (count as f64).sqrt().ceil().clamp(1.0, 4096.0);
        let scale = cells / (high - low).max(DVec2::splat(1e-300));
        Self { low, scale, cells: cells as usize, held: BTreeMap::new(), all: Vec::new() }
    }

    fn cell(&self, p: DVec2) -> [usize; 2] {
        // `as` holds what lies outside within, and a number that is none at 0.
        ((p - self.low) * self.scale).to_array().map(|x| (x as usize).min(self.cells - 1))
    }

    fn put(&mut self, p: DVec2, corner: usize) {
        let cell = self.cell(p);
        self.held.entry(cell).or_default().push(corner);
        self.all.push(corner);
    }

    /// Whether any of those near a triangle blocks. `None`: the work is used up.
    fn any(
        &self,
        corners: [DVec2; 3],
        blocks: impl Fn(usize) -> bool,
        work: &mut usize,
    ) -> Option<bool> {
        if self.all.is_empty() {
            return Some(false);
        }
        let [a, b, c] = corners;
        let (low, high) = (self.cell(a.min(b).min(c)), self.cell(a.max(b).max(c)));
        let spanned = high[0] - low[0] + 1;
        let mut ask = |held: &[usize]| {
            *work = work.checked_sub(1 + held.len())?;
            Some(held.iter().any(|&i| blocks(i)))
        };
        if spanned * (high[1] - low[1] + 1) > self.all.len() {
            return ask(&self.all);
        }
        for x in low[0]..=high[0] {
            for (_, held) in self.held.range([x, low[1]]..=[x, high[1]]) {
                if ask(held)? {
                    return Some(true);
                }
            }
        }
        *work = work.checked_sub(spanned)?;
        Some(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of the triangles' areas by the polygon's own sense, and whether none turns back.
    fn area(corners: &[DVec3], found: &Triangulation) -> (f64, bool) {
        let normal: DVec3 = (0..corners.len())
            .map(|k| corners[k].cross(corners[(k + 1) % corners.len()]))
            .sum::<DVec3>()
            .normalize();
        let areas = found.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| corners[i]);
            0.5 * (b - a).cross(c - a).dot(normal)
        });
        let areas: Vec<f64> = areas.collect();
        (areas.iter().sum(), areas.iter().all(|a| *a >= -1e-9))
    }

    fn lifted(flat: &[[f64; 2]]) -> [Vec<DVec3>; 3] {
        let turn = glam::DQuat::from_rotation_x(0.7) * glam::DQuat::from_rotation_z(1.1);
        let upright = |p: &[f64; 2]| DVec3::new(p[0], p[1], 0.3);
        [
            flat.iter().map(upright).collect(),
            // Any plane, at the coordinates of a national grid.
            flat.iter().map(|p| turn * upright(p) + DVec3::new(155e3, 12.0, 463e3)).collect(),
            flat.iter().map(|p| DVec3::new(p[0], 2.0, p[1])).collect(),
        ]
    }

    /// Areas by hand: of portals, L, combs with corners on their edges, and frames whose opening is
    /// reached by a bridge.
    #[test]
    fn the_area_of_a_polygon_is_that_of_its_triangles() {
        let portal =
            [[1., 0.], [1., 2.], [3., 2.], [3., 0.], [4., 0.], [4., 3.], [0., 3.], [0., 0.]];
        let window = [
            [0., 0.],
            [4., 0.],
            [4., 3.],
            [0., 3.],
            [0., 0.],
            [1., 1.],
            [1., 2.],
            [3., 2.],
            [3., 1.],
            [1., 1.],
        ];
        let edged = [[0., 0.], [1., 0.], [2., 1e-9], [3., 0.], [3., 1.], [1.5, 1.], [0., 1.]];
        let touching = [[0., 0.], [4., 0.], [4., 2.], [2., 0.], [0., 2.]];
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
        let cases: [(&[[f64; 2]], f64); 5] =
            [(&portal, 8.0), (&window, 10.0), (&edged, 3.0), (&touching, 4.0), (&square, 1.0)];
        for (flat, expected) in cases {
            for corners in lifted(flat) {
                for turned in 0..corners.len() {
                    let mut corners = corners.clone();
                    corners.rotate_left(turned);
                    let found = triangulate(&corners).unwrap();
                    let (sum, is_forward) = area(&corners, &found);
                    assert!((sum - expected).abs() < 1e-6 && is_forward, "{sum} for {expected}");
                    assert!(found.is_simple, "{corners:?}");
                    assert_eq!(found.triangles.len(), corners.len() - 2);
                }
            }
        }
    }

    /// Two openings, each bridged from the one before it.
    #[test]
    fn openings_in_a_row_stay_open() {
        let flat = [
            [0., 0.],
            [1., 1.],
            [1., 2.],
            [2., 2.],
            [2., 1.],
            [3., 1.],
            [3., 2.],
            [4., 2.],
            [4., 1.],
            [3., 1.],
            [2., 1.],
            [1., 1.],
            [0., 0.],
            [6., 0.],
            [6., 3.],
            [0., 3.],
        ];
        for corners in lifted(&flat) {
            let (sum, is_forward) = area(&corners, &triangulate(&corners).unwrap());
            assert!((sum - 16.0).abs() < 1e-6 && is_forward, "{sum}");
        }
    }

    #[test]
    fn a_face_that_crosses_itself_is_told() {
        let tie: Vec<DVec3> = [[0., 0.], [2., 2.], [2., 0.], [0., 1.]]
            .map(|[x, y]: [f64; 2]| DVec3::new(x, y, 0.0))
            .to_vec();
        assert!(!triangulate(&tie).unwrap().is_simple);
    }

    /// Each ends, and those that are no tangle whole.
    #[test]
    fn large_faces_are_cut_or_refused() {
        let at = |n: usize, r: &dyn Fn(usize) -> f64| -> Vec<DVec3> {
            (0..n)
                .map(|k| {
                    let (sin, cos) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                    r(k) * DVec3::new(cos, sin, 0.0)
                })
                .collect()
        };
        let n = 100_000;
        for spike in [0.0, 1.0] {
            let star = at(n, &|k| 3.0 - spike * (k % 2) as f64);
            assert_eq!(triangulate(&star).unwrap().triangles.len(), n - 2);
        }
        let comb: Vec<DVec3> = (0..n / 4)
            .flat_map(|k| {
                let x = k as f64;
                [[x, 0.1], [x, 9.0], [x + 0.5, 9.0], [x + 0.5, 0.1]]
            })
            .chain([[n as f64 / 4.0, 0.1], [n as f64 / 4.0, 0.0], [0.0, 0.0]])
            .map(|[x, y]| DVec3::new(x, y, 0.0))
            .rev()
            .collect();
        let found = triangulate(&comb).unwrap();
        let (sum, is_forward) = area(&comb, &found);
        let by_hand = 0.1 * (n / 4) as f64 + 0.5 * 8.9 * (n / 4) as f64;
        assert!((sum / by_hand - 1.0).abs() < 1e-9 && is_forward, "{sum} for {by_hand}");
        // The same three corners over and over.
        let folded: Vec<DVec3> =
            (0..300_000).map(|k| [DVec3::ZERO, DVec3::X, DVec3::Y][k % 3]).collect();
        let _ = triangulate(&folded);
    }
}
