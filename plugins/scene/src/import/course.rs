//! Where a bar runs, from its surface: axis and diameter of a thin tube, bent or closed.

use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;

use super::source::{Course, Surface};

/// Corners of a bar that are looked at.
const MOST_CORNERS: usize = 200_000;
/// A body is a bar if it is so many times as long as thick.
const SLENDER: f64 = 5.0;

/// The axes of all bars that a surface is made of: each of its pieces that is one.
pub(super) fn all_of_surface(surface: &Surface) -> Vec<Course> {
    pieces(surface).iter().filter_map(of_surface).collect()
}

/// The pieces of a surface that no corner connects.
fn pieces(surface: &Surface) -> Vec<Surface> {
    fn root(of: &mut [usize], mut at: usize) -> usize {
        while of[at] != at {
            of[at] = of[of[at]];
            at = of[at];
        }
        at
    }
    let key = |p: DVec3| (p * 1e5).round().to_array().map(|x| x as i64);
    let mut known: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    let mut of: Vec<usize> = Vec::new();
    let mut faces = Vec::with_capacity(surface.triangles.len());
    for corners in surface.faces() {
        let at = corners.map(|p| {
            *known.entry(key(p)).or_insert_with(|| {
                of.push(of.len());
                of.len() - 1
            })
        });
        let first = root(&mut of, at[0]);
        for other in [at[1], at[2]] {
            let other = root(&mut of, other);
            of[other] = first;
        }
        faces.push((at[0], corners));
    }
    let mut found: BTreeMap<usize, Surface> = BTreeMap::new();
    for (at, corners) in faces {
        let piece = found.entry(root(&mut of, at)).or_default();
        let first = piece.points.len() as u32;
        piece.points.extend(corners);
        piece.triangles.push([first, first + 1, first + 2]);
    }
    found.into_values().collect()
}

/// The axis of a bar: corners are sorted by their way along the surface from one end, and slices
/// of it have the axis' points in their middles. A closed bar has two middles a slice.
pub(super) fn of_surface(surface: &Surface) -> Option<Course> {
    let (points, edges) = welded(surface)?;
    let volume = surface.volume();
    let from = far_from(&points, &edges, 0)?.0;
    let (_, along) = far_from(&points, &edges, from)?;
    let reach = along.iter().copied().filter(|a| a.is_finite()).fold(0.0, f64::max);
    // A first guess at the thickness: of an open bar the way is its length.
    let guess = (4.0 * volume / (std::f64::consts::PI * reach.max(1e-9))).sqrt();
    let slice = (2.0 * guess).max(reach / 400.0);
    if reach < SLENDER * guess || guess < 1e-4 {
        return None;
    }
    let slices = slices(&points, &edges, &along, slice);
    let line = tidy(chain(&slices)?, 0.1 * guess);
    let mut course = Course { diameter: guess, line };
    extend_to_ends(&mut course, &points);
    course.diameter = (4.0 * volume / (std::f64::consts::PI * course.length())).sqrt();
    (course.length() > SLENDER * course.diameter).then_some(course)
}

/// Corners by place, and for each its neighbours with their distances.
type Web = (Vec<DVec3>, Vec<Vec<(usize, f64)>>);

fn welded(surface: &Surface) -> Option<Web> {
    let key = |p: DVec3| (p * 1e5).round().to_array().map(|x| x as i64);
    let mut known: BTreeMap<[i64; 3], usize> = BTreeMap::new();
    let mut points = Vec::new();
    let mut edges: Vec<Vec<(usize, f64)>> = Vec::new();
    for corners in surface.faces() {
        let at = corners.map(|p| {
            *known.entry(key(p)).or_insert_with(|| {
                points.push(p);
                edges.push(Vec::new());
                points.len() - 1
            })
        });
        for (a, b) in [(at[0], at[1]), (at[1], at[2]), (at[2], at[0])] {
            let length = points[a].distance(points[b]);
            edges[a].push((b, length));
            edges[b].push((a, length));
        }
    }
    (4..MOST_CORNERS).contains(&points.len()).then_some((points, edges))
}

/// The corner with the longest way from one, and all ways (Dijkstra).
fn far_from(
    points: &[DVec3],
    edges: &[Vec<(usize, f64)>],
    start: usize,
) -> Option<(usize, Vec<f64>)> {
    /// The nearest comes first out of a heap that gives the largest.
    #[derive(PartialEq)]
    struct Next(f64, usize);
    impl Eq for Next {}
    impl PartialOrd for Next {
        fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
            Some(self.cmp(other))
        }
    }
    impl Ord for Next {
        fn cmp(&self, other: &Self) -> std::cmp::Ordering {
            other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
        }
    }
    let mut way = vec![f64::INFINITY; points.len()];
    *way.get_mut(start)? = 0.0;
    let mut open = BinaryHeap::from([Next(0.0, start)]);
    while let Some(Next(here, at)) = open.pop() {
        if here > way[at] {
            continue;
        }
        for &(to, length) in &edges[at] {
            if here + length < way[to] {
                way[to] = here + length;
                open.push(Next(way[to], to));
            }
        }
    }
    let far = (0..way.len())
        .filter(|&i| way[i].is_finite())
        .max_by(|&a, &b| way[a].total_cmp(&way[b]))?;
    Some((far, way))
}

/// Middles of the pieces into which each slice falls, slice by slice.
///
/// Long thin triangles have no corners between the ends of a straight piece: edges, not corners,
/// are cut at each slice's middle.
fn slices(
    points: &[DVec3],
    edges: &[Vec<(usize, f64)>],
    along: &[f64],
    slice: f64,
) -> Vec<Vec<DVec3>> {
    let reach = along.iter().copied().filter(|a| a.is_finite()).fold(0.0, f64::max);
    let count = ((reach / slice).ceil() as usize).max(2);
    let mut cut: Vec<Vec<DVec3>> = vec![Vec::new(); count];
    for (a, to) in edges.iter().enumerate() {
        for &(b, _) in to {
            let (from, until) = (along[a], along[b]);
            if !(from < until && until.is_finite()) {
                continue;
            }
            let first = (from / reach * count as f64 - 0.5).ceil().max(0.0) as usize;
            for (k, slot) in cut.iter_mut().enumerate().skip(first) {
                let level = (k as f64 + 0.5) / count as f64 * reach;
                if level >= until {
                    break;
                }
                slot.push(points[a].lerp(points[b], (level - from) / (until - from)));
            }
        }
    }
    cut.into_iter().map(|slot| middles(&slot, slice)).collect()
}

/// Middles of the groups of points that lie no further than `near` from one another.
fn middles(points: &[DVec3], near: f64) -> Vec<DVec3> {
    let mut group = vec![usize::MAX; points.len()];
    let mut count = 0;
    for i in 0..points.len() {
        if group[i] != usize::MAX {
            continue;
        }
        let mut open = vec![i];
        group[i] = count;
        while let Some(at) = open.pop() {
            for j in 0..points.len() {
                if group[j] == usize::MAX && points[at].distance(points[j]) < near {
                    group[j] = count;
                    open.push(j);
                }
            }
        }
        count += 1;
    }
    (0..count)
        .map(|g| {
            let own: Vec<DVec3> =
                points.iter().zip(&group).filter(|(_, k)| **k == g).map(|(p, _)| *p).collect();
            // Edges are cut unevenly about the axis: the middle of the extent, not of the points.
            let [low, high] = own
                .iter()
                .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], p| [l.min(*p), h.max(*p)]);
            0.5 * (low + high)
        })
        .collect()
}

/// One line through the middles: of two branches, up the one and back the other.
fn chain(slices: &[Vec<DVec3>]) -> Option<Vec<DVec3>> {
    let twofold = slices.iter().filter(|s| s.len() == 2).count();
    let single = slices.iter().filter(|s| s.len() == 1).count();
    if single + twofold < slices.len() * 9 / 10 {
        return None;
    }
    if twofold * 2 < slices.len() {
        return Some(slices.iter().filter_map(|s| s.first().copied()).collect());
    }
    let (mut up, mut down): (Vec<DVec3>, Vec<DVec3>) = (Vec::new(), Vec::new());
    for slice in slices {
        match (&slice[..], up.last().copied(), down.last().copied()) {
            ([a, b], Some(u), Some(d)) => {
                let straight = u.distance(*a) + d.distance(*b) <= u.distance(*b) + d.distance(*a);
                let (a, b) = if straight { (*a, *b) } else { (*b, *a) };
                up.push(a);
                down.push(b);
            }
            ([a, b], ..) => {
                up.push(*a);
                down.push(*b);
            }
            ([a], ..) => up.push(*a),
            _ => {}
        }
    }
    down.reverse();
    up.extend(down);
    up.push(*up.first()?);
    Some(up)
}

/// Without points that a straight line would pass within `near` (Ramer, Douglas and Peucker).
fn tidy(line: Vec<DVec3>, near: f64) -> Vec<DVec3> {
    let closed = line.len() > 3 && line.first() == line.last();
    if closed {
        let half = line.len() / 2;
        let mut first = tidy(line[..=half].to_vec(), near);
        first.extend(tidy(line[half..].to_vec(), near).into_iter().skip(1));
        return first;
    }
    let (Some(&a), Some(&b)) = (line.first(), line.last()) else { return line };
    let along = (b - a).try_normalize();
    let off = |p: DVec3| along.map_or(p.distance(a), |d| (p - a).reject_from(d).length());
    let worst = (1..line.len().saturating_sub(1))
        .max_by(|&i, &j| off(line[i]).total_cmp(&off(line[j])))
        .filter(|&i| off(line[i]) > near);
    match worst {
        None => vec![a, b],
        Some(i) => {
            let mut first = tidy(line[..=i].to_vec(), near);
            first.extend(tidy(line[i..].to_vec(), near).into_iter().skip(1));
            first
        }
    }
}

/// Slices are cut in their middles: an open line goes on to the ends of the surface.
fn extend_to_ends(course: &mut Course, points: &[DVec3]) {
    if course.line.first() == course.line.last() {
        return;
    }
    for _ in 0..2 {
        course.line.reverse();
        let [.., before, last] = course.line[..] else { return };
        let Some(way) = (last - before).try_normalize() else { return };
        let near = |p: &&DVec3| (**p - last).reject_from(way).length() < course.diameter;
        let end = points.iter().filter(near).map(|p| (*p - last).dot(way)).fold(0.0, f64::max);
        if let Some(point) = course.line.last_mut() {
            *point += way * end.min(5.0 * course.diameter);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::parametric::solid;

    fn course(line: &[Vec3], diameter: f32, closed: bool) -> Course {
        let mesh = solid::tube(line, diameter, closed);
        let points = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        of_surface(&Surface { points, triangles: mesh.triangles }).unwrap()
    }

    #[test]
    fn bars_in_one_surface_are_counted() {
        let mut surface = Surface::default();
        for i in 0..14_u8 {
            let start = Vec3::new(0.0, 0.0, 0.1 * f32::from(i));
            let mesh = solid::tube(&[start, start + Vec3::new(3.0, 0.0, 0.0)], 0.02, false);
            let first = surface.points.len() as u32;
            surface.points.extend(mesh.positions.iter().map(|p| p.as_dvec3()));
            surface.triangles.extend(mesh.triangles.iter().map(|t| t.map(|k| k + first)));
        }
        let found = all_of_surface(&surface);
        assert_eq!(found.len(), 14);
        assert!(found.iter().all(|c| (c.diameter - 0.02).abs() < 2e-4), "{found:?}");
    }

    #[test]
    fn a_straight_bar_has_its_ends_and_its_thickness() {
        let found = course(&[Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0)], 0.02, false);
        assert_eq!(found.line.len(), 2, "{found:?}");
        assert!(
            (found.length() - 3.0).abs() < 1e-3 && (found.diameter - 0.02).abs() < 2e-4,
            "{found:?}"
        );
        assert!(found.line.iter().all(|p| p.y.abs() < 1e-3 && p.z.abs() < 1e-3), "{found:?}");
    }

    /// Bends are round, as they are made: a mitred tube would be thinner there.
    fn bend(centre: Vec3, radius: f32, from: f32) -> impl Iterator<Item = Vec3> {
        (0..=8).map(move |k| {
            let angle = (from + 90.0 * k as f32 / 8.0).to_radians();
            centre + radius * Vec3::new(angle.cos(), angle.sin(), 0.0)
        })
    }

    #[test]
    fn a_bent_bar_and_a_closed_stirrup_keep_their_way() {
        let corner = bend(Vec3::new(0.95, 0.05, 0.0), 0.05, -90.0);
        let line: Vec<Vec3> =
            [Vec3::ZERO].into_iter().chain(corner).chain([Vec3::new(1.0, 0.5, 0.0)]).collect();
        let bent = course(&line, 0.016, false);
        let length = 0.95 + 0.45 + 0.025 * std::f64::consts::PI;
        assert!((bent.length() - length).abs() < 0.02, "{} {bent:?}", bent.length());
        assert!((bent.diameter - 0.016).abs() < 4e-4, "{bent:?}");
        let corners = [[0.0, 0.0], [0.3, 0.0], [0.3, 0.5], [0.0, 0.5]];
        let line: Vec<Vec3> = corners
            .into_iter()
            .enumerate()
            .flat_map(|(i, [x, y])| {
                let inset =
                    Vec3::new(0.15 - x, 0.25 - y, 0.0).signum() * Vec3::new(0.03, 0.03, 0.0);
                bend(Vec3::new(x, y, 2.0) + inset, 0.03, 180.0 + 90.0 * i as f32)
            })
            .collect();
        let closed = course(&line, 0.01, true);
        assert_eq!(closed.line.first(), closed.line.last());
        let length = 2.0 * (0.24 + 0.44) + 0.06 * std::f64::consts::PI;
        assert!((closed.length() - length).abs() < 0.04, "{} {closed:?}", closed.length());
        assert!((closed.diameter - 0.01).abs() < 3e-4, "{closed:?}");
    }
}
