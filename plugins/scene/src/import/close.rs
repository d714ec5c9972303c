//! Closes surfaces that converters leave open by a hair: faces that look the wrong way, corners
//! that lie on a neighbour's edge, and flat faces that are missing. A body with a hole has no volume and cannot be computed.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::source::Surface;
use crate::polygon;

/// Corners that are nearer than this are one, m: tried one after the other, from rounding to what a
/// model was drawn to.
const SAME: [f64; 3] = [1e-5, 1e-4, 1e-3];
/// That, of a body's least measure, at most.
const LEAST: f64 = 0.02;
/// So near to an edge a corner lies on it, in distances at which corners are one.
const ON_EDGE: f64 = 10.0;
/// Longest edge of a hole, in corners, that is filled.
const MOST_CORNERS: usize = 2000;
/// Rounds of splitting edges.
const ROUNDS: usize = 20;

/// Whether the surface is closed now.
pub(super) fn close(surface: &mut Surface) -> bool {
    let [low, high] = surface.bounds();
    let most = LEAST * (high - low).min_element();
    let mut best: Option<(usize, f64, Surface)> = None;
    for same in SAME.into_iter().filter(|same| *same == SAME[0] || *same < most) {
        let mut joined = surface.clone();
        weld(&mut joined, same);
        undouble(&mut joined);
        let mut open = open_edges(&joined).len();
        if open > 0 {
            orient(&mut joined);
            open = open_edges(&joined).len();
        }
        if best.as_ref().is_none_or(|(least, ..)| open < *least) {
            best = Some((open, same, joined));
        }
        if open == 0 {
            break;
        }
    }
    let Some((open, same, joined)) = best else { return false };
    *surface = joined;
    if open == 0 {
        outward(surface);
        return true;
    }
    for _ in 0..ROUNDS {
        if !split(surface, same) {
            break;
        }
    }
    fill(surface);
    open_edges(surface).is_empty()
}

/// Whether a surface is closed as it is, each face once.
pub(super) fn is_closed(surface: &Surface) -> bool {
    let mut welded = surface.clone();
    weld(&mut welded, SAME[0]);
    let count = welded.triangles.len();
    undouble(&mut welded);
    welded.triangles.len() == count && open_edges(&welded).is_empty()
}

/// Turns a closed surface round that looks inward all over.
fn outward(surface: &mut Surface) {
    if surface.signed_volume() < 0.0 {
        surface.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}

/// Drops faces that come again: all that are walked the same way, and where every face comes both
/// ways, as programs draw both sides of a sheet, one of each pair.
fn undouble(surface: &mut Surface) {
    let first = |[a, b, c]: [u32; 3]| match a.min(b).min(c) {
        low if low == a => [a, b, c],
        low if low == b => [b, c, a],
        _ => [c, a, b],
    };
    let mut known: BTreeSet<[u32; 3]> = BTreeSet::new();
    surface.triangles.retain(|t| known.insert(first(*t)));
    let back = |[a, b, c]: [u32; 3]| first([a, c, b]);
    if !known.is_empty() && known.iter().all(|t| known.contains(&back(*t))) {
        surface.triangles.retain(|t| first(*t) < back(*t));
        orient(surface);
    }
}

/// One corner a place; triangles without area are no triangles.
fn weld(surface: &mut Surface, same: f64) {
    let Some(origin) = surface.points.first().copied() else { return };
    let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    let mut points: Vec<DVec3> = Vec::new();
    let mut place = Vec::with_capacity(surface.points.len());
    for &p in &surface.points {
        let cell = ((p - origin) / same).floor().to_array().map(|x| x as i64);
        let near =
            (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| [x, y, z])));
        let known = near
            .map(|d| std::array::from_fn(|i| cell[i] + d[i]))
            .filter_map(|c: [i64; 3]| cells.get(&c))
            .flatten()
            .copied()
            .find(|&i| points.get(i as usize).is_some_and(|q| q.distance(p) < same));
        place.push(known.unwrap_or_else(|| {
            points.push(p);
            let index = points.len() as u32 - 1;
            cells.entry(cell).or_default().push(index);
            index
        }));
    }
    surface.points = points;
    for triangle in &mut surface.triangles {
        *triangle = triangle.map(|i| place.get(i as usize).copied().unwrap_or(0));
    }
    surface.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
}

/// Directed edges that no neighbour walks the other way, as often as they are too many.
fn open_edges(surface: &Surface) -> Vec<(u32, u32)> {
    let mut walked: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    for &[a, b, c] in &surface.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (key, way) = if from < to { ((from, to), 1) } else { ((to, from), -1) };
            *walked.entry(key).or_default() += way;
        }
    }
    let one = |((a, b), times): ((u32, u32), i32)| {
        let edge = if times > 0 { (a, b) } else { (b, a) };
        std::iter::repeat_n(edge, times.unsigned_abs() as usize)
    };
    walked.into_iter().filter(|(_, times)| *times != 0).flat_map(one).collect()
}

/// Turns faces round that look inward while their neighbours look outward: from one face to the
/// next over edges that two share, body by body, each outward in the end.
fn orient(surface: &mut Surface) {
    let mut beside: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    let edges = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)];
    for (i, &triangle) in surface.triangles.iter().enumerate() {
        for (a, b) in edges(triangle) {
            beside.entry((a.min(b), a.max(b))).or_default().push(i);
        }
    }
    let mut seen = vec![false; surface.triangles.len()];
    for first in 0..seen.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let (mut body, mut open) = (vec![first], vec![first]);
        while let Some(here) = open.pop() {
            for (a, b) in edges(surface.triangles[here]) {
                let Some([p, q]) = beside.get(&(a.min(b), a.max(b))).map(Vec::as_slice) else {
                    continue;
                };
                let next = if *p == here { *q } else { *p };
                if std::mem::replace(&mut seen[next], true) {
                    continue;
                }
                // Neighbours walk their edge in opposite directions.
                if edges(surface.triangles[next]).contains(&(a, b)) {
                    surface.triangles[next].swap(1, 2);
                }
                body.push(next);
                open.push(next);
            }
        }
        let origin = surface.points.get(surface.triangles[first][0] as usize).copied();
        let origin = origin.unwrap_or_default();
        let sixfold = |&i: &usize| {
            let [a, b, c] = surface.triangles[i]
                .map(|i| surface.points.get(i as usize).copied().unwrap_or_default() - origin);
            a.dot(b.cross(c))
        };
        if body.iter().map(sixfold).sum::<f64>() < 0.0 {
            body.iter().for_each(|&i| surface.triangles[i].swap(1, 2));
        }
    }
}

/// Splits open edges at corners of other open edges that lie on them. Gives whether there were any.
fn split(surface: &mut Surface, same: f64) -> bool {
    let open = open_edges(surface);
    let corners: BTreeSet<u32> = open.iter().flat_map(|&(a, b)| [a, b]).collect();
    let at = |i: u32| surface.points.get(i as usize).copied().unwrap_or_default();
    let mut cuts: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for &(a, b) in &open {
        let (p, q) = (at(a), at(b));
        let length = p.distance(q);
        let along = (q - p) / length.max(1e-12);
        let lies_on = |&c: &u32| {
            let way = (at(c) - p).dot(along);
            c != a
                && c != b
                && way > same
                && way < length - same
                && (at(c) - p - way * along).length() < ON_EDGE * same
        };
        let nearest = |&c: &u32| (at(c) - p).dot(along);
        let found = corners
            .iter()
            .copied()
            .filter(lies_on)
            .min_by(|c, d| nearest(c).total_cmp(&nearest(d)));
        if let Some(cut) = found {
            cuts.insert((a, b), cut);
        }
    }
    let mut split = Vec::with_capacity(surface.triangles.len() + cuts.len());
    let mut any = false;
    for &[a, b, c] in &surface.triangles {
        let edges = [(a, b, c), (b, c, a), (c, a, b)];
        let cut = edges.iter().find_map(|&(from, to, far)| {
            let at = *cuts.get(&(from, to))?;
            (at != far).then_some((from, to, far, at))
        });
        match cut {
            Some((from, to, far, at)) => {
                any = true;
                split.extend([[from, at, far], [at, to, far]]);
            }
            None => split.push([a, b, c]),
        }
    }
    surface.triangles = split;
    any
}

/// Fills holes: rings of open edges become faces.
fn fill(surface: &mut Surface) {
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    // A face that closes the hole walks its edges the other way.
    for (a, b) in open_edges(surface) {
        next.entry(b).or_default().push(a);
    }
    while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
        let mut ring = vec![start];
        let mut here = start;
        while let Some(to) = next.get_mut(&here).and_then(Vec::pop) {
            if to == start {
                break;
            }
            // A ring that meets itself is two: the inner one is filled first.
            if let Some(known) = ring.iter().position(|&i| i == to) {
                let inner = ring.split_off(known);
                surface.triangles.extend(faces(&surface.points, &inner));
                here = to;
                ring.push(to);
                continue;
            }
            ring.push(to);
            here = to;
            if ring.len() > MOST_CORNERS {
                return;
            }
        }
        surface.triangles.extend(faces(&surface.points, &ring));
    }
}

/// Triangles of a ring; none where it is too tangled.
fn faces(points: &[DVec3], ring: &[u32]) -> Vec<[u32; 3]> {
    let at: Vec<DVec3> =
        ring.iter().map(|&i| points.get(i as usize).copied().unwrap_or_default()).collect();
    let found = polygon::triangulate(&at).unwrap_or_default();
    found.triangles.into_iter().map(|t| t.map(|k| ring[k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parametric::solid;

    fn block() -> Surface {
        let mesh = solid::cells(&[0.0, 0.3], &[0.0, 2.0], |_, _| true, 3.0);
        Surface {
            points: mesh.positions.iter().map(|p| p.as_dvec3()).collect(),
            triangles: mesh.triangles,
        }
    }

    #[test]
    fn a_missing_face_is_put_back() {
        for gone in 0..6 {
            let mut surface = block();
            surface.triangles.drain(2 * gone..2 * gone + 2);
            assert!(close(&mut surface), "{gone}");
            assert!((surface.volume() - 1.8).abs() < 1e-6, "{gone}: {}", surface.volume());
        }
    }

    #[test]
    fn faces_that_look_inward_are_turned() {
        let mut surface = block();
        for i in [0, 3, 4, 9] {
            surface.triangles[i].swap(1, 2);
        }
        assert!(close(&mut surface));
        assert!((surface.volume() - 1.8).abs() < 1e-6 && surface.triangles.len() == 12);
    }

    /// Both sides of every face drawn; every face twice; corners apart by hundredths of a millimetre
    /// and by half of one.
    #[test]
    fn doubled_faces_and_small_gaps_are_closed() {
        let mut both = block();
        both.triangles.extend(block().triangles.iter().map(|&[a, b, c]| [a, c, b]));
        let mut twice = block();
        twice.triangles.extend(block().triangles.iter().map(|&[a, b, c]| [b, c, a]));
        let gaps = |wide: f64| {
            let block = block();
            let corners = block.triangles.iter().flatten().map(|&i| block.points[i as usize]);
            let off = |k: usize| wide * (0.5 - (k * 7 % 11) as f64 / 11.0);
            let points: Vec<DVec3> = corners
                .enumerate()
                .map(|(k, p)| p + DVec3::new(off(k), off(k + 3), off(k + 5)))
                .collect();
            let all = 0..points.len() as u32 / 3;
            Surface { triangles: all.map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(), points }
        };
        for mut surface in [both, twice, gaps(3e-5), gaps(5e-4)] {
            assert!(!is_closed(&surface));
            assert!(close(&mut surface));
            assert!((surface.volume() - 1.8).abs() < 5e-3, "{}", surface.volume());
            assert_eq!(surface.triangles.len(), 12);
        }
        assert!(is_closed(&block()));
    }

    /// One face is cut in two at the middle of its edge, its neighbours do not know.
    #[test]
    fn a_corner_on_a_neighbours_edge_closes() {
        let mut surface = block();
        let [a, b, c] = surface.triangles[0];
        let middle = 0.5 * (surface.points[a as usize] + surface.points[b as usize]);
        surface.points.push(middle);
        let m = surface.points.len() as u32 - 1;
        surface.triangles[0] = [a, m, c];
        surface.triangles.push([m, b, c]);
        let mut welded = surface.clone();
        weld(&mut welded, SAME[0]);
        assert!(!open_edges(&welded).is_empty());
        assert!(close(&mut surface));
        assert!((surface.volume() - 1.8).abs() < 1e-6);
    }
}
