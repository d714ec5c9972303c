//! Triangles of a polygon in space: ears are cut off one by one (Meisters, 1975) in the plane that
//! fits its corners best. Holes come as bridge edges, walked once each way. Only corners that do
//! not turn outward can lie in an ear, so that these alone are asked, from a grid in the plane.

use std::collections::{BTreeMap, VecDeque};

use glam::{DVec2, DVec3};

/// Corners that may be asked for each corner of a polygon, and for any polygon besides, before it
/// is refused: what a face costs is bounded, whatever it looks like.
const WORK: [usize; 2] = [2048, 1 << 24];
/// Roundings of coordinates that a corner between two edges may have: it is straight within them.
const ROUNDINGS: f64 = 8.0;
/// Of a polygon's area, what its triangles may have more than it before it crosses itself.
const CROSSED: f64 = 1e-6;

/// Triangles of a polygon.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Triangulation {
    /// Corners by their places in the polygon.
    pub(crate) triangles: Vec<[usize; 3]>,
    /// Whether its triangles lie beside each other: those of one that crosses itself do not.
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
    let farthest = corners.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let mut clipper = Clipper::new(flat, ROUNDINGS * f64::EPSILON * farthest);
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    for strictness in [Strictness::Closed, Strictness::Open, Strictness::Any] {
        if clipper.left > 3 {
            clipper.cut(strictness, &mut triangles)?;
        }
    }
    triangles.extend(clipper.rest());
    let is_simple = clipper.are_beside(&triangles);
    Some(Triangulation { triangles, is_simple })
}

/// In the plane of Newell's normal, about the first corner, counter-clockwise.
fn flattened(corners: &[DVec3]) -> Option<Vec<DVec2>> {
    let origin = *corners.first()?;
    let local = || corners.iter().map(|p| *p - origin);
    let next = local().cycle().skip(1);
    let normal: DVec3 = local().zip(next).map(|(a, b)| a.cross(b)).sum();
    let [extent, farthest] = [origin, DVec3::ZERO]
        .map(|from| corners.iter().map(|p| (*p - from).abs().max_element()).fold(0.0, f64::max));
    if normal.length() <= ROUNDINGS * f64::EPSILON * farthest * extent {
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
    /// What the cross product of two edges may be by rounding, over their length.
    noise: f64,
    work: usize,
}

impl Clipper {
    fn new(flat: Vec<DVec2>, noise: f64) -> Self {
        let n = flat.len();
        let [low, high] = (flat.iter())
            .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
        let mut clipper = Self {
            before: (0..n).map(|k| (k + n - 1) % n).collect(),
            after: (0..n).map(|k| (k + 1) % n).collect(),
            is_cut: vec![false; n],
            left: n,
            first: 0,
            grid: Grid::new(low, high, n),
            noise,
            work: n.saturating_mul(WORK[0]).saturating_add(WORK[1]),
            flat,
        };
        for k in 0..n {
            if !clipper.turns_inward(k) {
                clipper.grid.put(clipper.flat[k], k);
            }
        }
        clipper
    }

    /// Whether a corner turns inward, by more than rounding.
    fn turns_inward(&self, k: usize) -> bool {
        let [a, b, c] = [self.before[k], k, self.after[k]].map(|i| self.flat[i]);
        let (to, on) = (b - a, c - b);
        to.perp_dot(on) > self.noise * (to.length() + on.length())
    }

    /// Whether triangles have the area of the polygon, and no more.
    fn are_beside(&self, triangles: &[[usize; 3]]) -> bool {
        let [mut sum, mut all] = [0.0; 2];
        for triangle in triangles {
            let [a, b, c] = triangle.map(|i| self.flat[i]);
            let area = (b - a).perp_dot(c - a);
            sum += area;
            all += area.abs();
        }
        all - sum <= CROSSED * all
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
        if strictness == Strictness::Any {
            return Some(true);
        }
        if !self.turns_inward(k) {
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
        // A corner that turns inward by now blocks nothing that its neighbours do not, and stays so.
        let mut grid = std::mem::take(&mut self.grid);
        let mut work = self.work;
        let is_gone = |i: usize| self.is_cut[i] || self.turns_inward(i);
        let blocked = grid.any(corners, is_gone, |i| within(self.flat[i]), &mut work);
        (self.grid, self.work) = (grid, work);
        Some(!blocked?)
    }

    /// The last triangle.
    fn rest(&self) -> Option<[usize; 3]> {
        let (k, before, after) =
            (self.first, self.before.get(self.first)?, self.after.get(self.first)?);
        (self.left == 3).then_some([*before, k, *after])
    }
}

/// Corners by the cell of the plane in which they lie.
#[derive(Default)]
struct Grid {
    low: DVec2,
    /// Cells a metre.
    scale: DVec2,
    cells: usize,
    held: BTreeMap<[usize; 2], Vec<usize>>,
}

impl Grid {
    fn new(low: DVec2, high: DVec2, count: usize) -> Self {
        let cells = (2.0 * (count as f64).sqrt()).ceil().clamp(1.0, 4096.0);
        let scale = cells / (high - low).max(DVec2::splat(1e-300));
        Self { low, scale, cells: cells as usize, held: BTreeMap::new() }
    }

    fn cell(&self, p: DVec2) -> [usize; 2] {
        // `as` holds what lies outside within, and a number that is none at 0.
        ((p - self.low) * self.scale).to_array().map(|x| (x as usize).min(self.cells - 1))
    }

    fn put(&mut self, p: DVec2, corner: usize) {
        let cell = self.cell(p);
        self.held.entry(cell).or_default().push(corner);
    }

    /// Whether any corner near a triangle blocks, column by column of its cells; corners that are
    /// gone are dropped on the way. `None`: the work is used up.
    fn any(
        &mut self,
        corners: [DVec2; 3],
        is_gone: impl Fn(usize) -> bool,
        blocks: impl Fn(usize) -> bool,
        work: &mut usize,
    ) -> Option<bool> {
        if self.held.is_empty() {
            return Some(false);
        }
        let [first, last] = [DVec2::INFINITY, DVec2::NEG_INFINITY].map(|from| {
            let pick = if from.x > 0.0 { DVec2::min } else { DVec2::max };
            self.cell(corners.into_iter().fold(from, pick))[0]
        });
        let local = corners.map(|p| (p - self.low) * self.scale);
        for x in first..=last {
            *work = work.checked_sub(1)?;
            let Some([low, high]) = rows(local, x as f64, self.cells) else { continue };
            let (mut is_blocked, mut empty) = (false, Vec::new());
            for (cell, held) in self.held.range_mut([x, low]..=[x, high]) {
                *work = work.checked_sub(1 + held.len())?;
                held.retain(|&i| !is_gone(i));
                if held.is_empty() {
                    empty.push(*cell);
                }
                is_blocked |= held.iter().any(|&i| blocks(i));
            }
            for cell in empty {
                self.held.remove(&cell);
            }
            if is_blocked {
                return Some(true);
            }
        }
        Some(false)
    }
}

/// Rows of cells that a triangle reaches in a column, one more to both sides for rounding.
fn rows(triangle: [DVec2; 3], x: f64, cells: usize) -> Option<[usize; 2]> {
    let [a, b, c] = triangle;
    let mut span = [f64::INFINITY, f64::NEG_INFINITY];
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let (p, q) = if p.x <= q.x { (p, q) } else { (q, p) };
        // The column and a little more.
        let (from, to) = (p.x.max(x - 0.01), q.x.min(x + 1.01));
        if from > to {
            continue;
        }
        let at = |x: f64| {
            let share = if q.x > p.x { (x - p.x) / (q.x - p.x) } else { 0.0 };
            p.y + share * (q.y - p.y)
        };
        let ends = if q.x > p.x { [at(from), at(to)] } else { [p.y, q.y] };
        span = [span[0].min(ends[0]).min(ends[1]), span[1].max(ends[0]).max(ends[1])];
    }
    let row = |y: f64| (y.max(0.0) as usize).min(cells - 1);
    (span[0] <= span[1]).then(|| [row(span[0] - 1.0), row(span[1] + 1.0)])
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
        let n = 20_000;
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
            (0..30_000).map(|k| [DVec3::ZERO, DVec3::X, DVec3::Y][k % 3]).collect();
        let _ = triangulate(&folded);
    }
}
