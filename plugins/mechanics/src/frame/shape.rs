//! What a member is to the whole: a bar along the middle of its sections, or a sheet.

use glam::DVec3;
use intrados_scene::{Assembly, MemberKind, structure::Body};

use super::{section::Section, solid::Solid};
use crate::member::Axes;

/// A slab or wall is a sheet where it is thinner than this share of its shorter side, anything of
/// no kind where it is much thinner.
const THIN: f64 = 0.4;
const VERY_THIN: f64 = 0.12;
/// Plates along the longer side of a sheet, and at least along the shorter.
const PLATES: [f64; 2] = [20.0, 8.0];
/// A plate is left out where less of it than this is there.
const THERE: f64 = 0.3;
/// Pieces that a bar is followed by; what is straighter than the second, over its length, and
/// whose sections agree better than the third, is one piece.
const STEPS: usize = 12;
const STRAIGHT: f64 = 2e-3;
const ALIKE: f64 = 0.01;
/// Share of the area of the section before that is there before the end.
const WHOLE: f64 = 0.75;
/// Of the area that is expected at the end.
const END: f64 = 0.97;
/// So far before the end it is cut, over a step.
const BEFORE: f64 = 1e-5;

/// A member as bar or sheet.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    Bar(Bar),
    Sheet(Sheet),
}

/// A line through the centroids of sections.
#[derive(Debug, Clone)]
pub(super) struct Bar {
    /// m.
    pub(super) points: Vec<DVec3>,
    /// Between them: section and its y axis.
    pub(super) pieces: Vec<(Section, DVec3)>,
}

/// A middle surface of plates.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    /// Corners of plates, m.
    pub(super) nodes: Vec<DVec3>,
    /// Corners by number, right-handed about the normal, and thickness, m.
    pub(super) plates: Vec<([u32; 4], f64)>,
}

impl Shape {
    /// What an assembly is: a bar by its measures, or what its surface shows.
    pub(super) fn of(assembly: &Assembly, axes: &Axes, solid: &Solid) -> Option<Self> {
        if let Some(body) = &assembly.body {
            return Some(Self::Bar(Bar::measured(body, axes)?));
        }
        let directions = solid.directions();
        let sizes = directions.map(|d| solid.extent(d));
        let thickness = solid.volume / shadow(solid, directions).max(1e-9);
        let shorter = sizes[1].min(sizes[2]);
        let thin = match assembly.kind {
            MemberKind::Slab | MemberKind::Wall => THIN,
            MemberKind::Beam | MemberKind::Column | MemberKind::Footing | MemberKind::Pipe => 0.0,
            _ => VERY_THIN,
        };
        if thickness < thin * shorter && sizes[0] < shorter {
            return Sheet::of(solid, directions).map(Self::Sheet);
        }
        let bar = Bar::followed(solid, axis(assembly.kind, solid, directions), directions)?;
        Some(Self::Bar(bar))
    }
}

/// How much of the box across the first direction is covered, m².
fn shadow(solid: &Solid, [normal, u, v]: [DVec3; 3]) -> f64 {
    let ([from, to], [low, high]) = (solid.span(u), solid.span(v));
    const N: usize = 16;
    let spot = |k: usize, [from, to]: [f64; 2]| from + (to - from) * (k as f64 + 0.47) / N as f64;
    let meets = (0..N * N)
        .map(|k| spot(k % N, [from, to]) * u + spot(k / N, [low, high]) * v)
        .filter(|&p| !solid.crossings(p, normal).is_empty())
        .count();
    (to - from) * (high - low) * meets as f64 / (N * N) as f64
}

/// Which way a bar runs: columns, footings and walls upright, beams along their longest side, and
/// what has no kind the way in which its largest section is smallest.
fn axis(kind: MemberKind, solid: &Solid, directions: [DVec3; 3]) -> DVec3 {
    let by = |key: &dyn Fn(DVec3) -> f64, among: &[DVec3]| {
        among.iter().copied().max_by(|a, b| key(*a).total_cmp(&key(*b))).unwrap_or(DVec3::Y)
    };
    let chosen = match kind {
        MemberKind::Column | MemberKind::Footing | MemberKind::Wall => {
            by(&|d| d.y.abs(), &directions)
        }
        MemberKind::Beam | MemberKind::Pipe => by(&|d| solid.extent(d), &directions),
        _ => {
            let [a, b, c] = directions;
            let skew = [a + b, a - b, b + c, b - c, c + a, c - a].map(|d| d.normalize());
            by(&|d| -largest(solid, d), &[&directions[..], &skew].concat())
        }
    };
    let lead = DVec3::new(1.0, 2.0, 0.999);
    if chosen.dot(lead) < 0.0 { -chosen } else { chosen }
}

/// Area of the largest section across a direction, m².
fn largest(solid: &Solid, axis: DVec3) -> f64 {
    let [from, to] = solid.span(axis);
    let axes = across(axis, axis.any_orthonormal_vector());
    (1..8)
        .filter_map(|k| {
            let at = (from + (to - from) * (f64::from(k) + 0.03) / 8.0) * axis;
            Some(Section::outlined(&solid.cut(at, axes))?.0.area)
        })
        .fold(0.0, f64::max)
}

/// Which way is up across a bar: of the directions of its faces the one nearest to up, or to +z for
/// upright ones.
fn upwards(along: DVec3, directions: [DVec3; 3]) -> DVec3 {
    let wanted = if along.y.abs() > 0.8 { DVec3::Z } else { DVec3::Y };
    let wanted = across(along, wanted)[1];
    let near =
        directions.into_iter().max_by(|a, b| a.dot(wanted).abs().total_cmp(&b.dot(wanted).abs()));
    match near {
        Some(d) if d.dot(along).abs() < 0.1 => {
            if d.dot(wanted) < 0.0 {
                -d
            } else {
                d
            }
        }
        _ => wanted,
    }
}

/// Axes of a section: along, towards `y`, and the third.
fn across(along: DVec3, y: DVec3) -> [DVec3; 3] {
    let y = y.reject_from(along).normalize_or(along.any_orthonormal_vector());
    [along, y, along.cross(y)]
}

impl Bar {
    /// A bar-shaped member by its measures.
    fn measured(body: &Body, axes: &Axes) -> Option<Self> {
        let [zero, _, along] = axes.unit;
        let (section, above) = match body {
            Body::Column { section, .. } | Body::Beam { section, .. } => {
                (Section::of(section), 0.0)
            }
            Body::BoxGirder { section, .. } => Section::girder(section),
            Body::Tunnel { .. } => return None,
        };
        let start = axes.start + above * zero;
        Some(Self {
            points: vec![start, start + axes.length * along],
            pieces: vec![(section, zero)],
        })
    }

    /// Along the centroids of sections, each across the line through its neighbours: from the
    /// middle to both ends, which are where hardly anything is cut any more.
    fn followed(solid: &Solid, axis: DVec3, directions: [DVec3; 3]) -> Option<Self> {
        let middle = 0.5 * (solid.span(axis)[0] + solid.span(axis)[1]) * axis;
        let reach = solid.extent(axis);
        let mut place = (cut(solid, middle, axis)?, axis);
        for _ in 0..4 {
            let near = [-0.02, 0.02].map(|s| cut(solid, place.0.at + s * reach * place.1, place.1));
            let [Some(before), Some(after)] = near else { break };
            let along = (after.at - before.at).normalize_or(axis);
            place = (cut(solid, place.0.at, along)?, along);
        }
        let step = reach / STEPS as f64;
        let forth = march(solid, &place.0, place.1, step);
        let mut points = march(solid, &place.0, -place.1, step);
        points.reverse();
        points.push(place.0.at);
        points.extend(forth);
        // The same side is up all along: what is up in the middle is taken along both ways.
        let mut y = upwards(place.1, directions);
        let ways: Vec<DVec3> =
            points.windows(2).map(|w| (w[1] - w[0]).normalize_or(axis)).collect();
        let start = ways.len() / 2;
        let mut ups = vec![y; ways.len()];
        for range in [Vec::from_iter(start..ways.len()), Vec::from_iter((0..start).rev())] {
            for i in range {
                y = across(ways[i], y)[1];
                ups[i] = y;
            }
            y = ups[start];
        }
        let pieces = points.windows(2).zip(&ways).zip(&ups).map(|((w, way), y)| {
            let axes = across(*way, *y);
            let (section, _, turn) = Section::outlined(&solid.cut(0.5 * (w[0] + w[1]), axes))?;
            Some((section, turn.cos() * axes[1] + turn.sin() * axes[2]))
        });
        let pieces = pieces.collect::<Option<Vec<_>>>()?;
        let bar = Self { points, pieces };
        (bar.points.len() > 1).then(|| bar.simplified())
    }

    /// One piece where it is straight and the same all along.
    fn simplified(self) -> Self {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        let (along, length) = ((last - first).normalize_or_zero(), first.distance(last));
        let bent = self.points.iter().map(|p| (*p - first).reject_from(along).length());
        let is_straight = bent.fold(0.0, f64::max) < STRAIGHT * length;
        let middle = self.pieces[self.pieces.len() / 2];
        let same = |a: f64, b: f64| (a / b - 1.0).abs() < ALIKE;
        let is_alike = self.pieces.iter().all(|(s, y)| {
            same(s.area, middle.0.area)
                && (0..2).all(|i| same(s.second[i], middle.0.second[i]))
                && y.dot(middle.1) > 1.0 - ALIKE
        });
        if is_straight && is_alike {
            Self { points: vec![first, last], pieces: vec![middle] }
        } else {
            self
        }
    }

    /// m along it up to each of its points.
    pub(super) fn lengths(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let mut all = vec![0.0];
        all.extend(self.points.windows(2).map(|w| {
            sum += w[0].distance(w[1]);
            sum
        }));
        all
    }

    /// The place that is `s` metres along it, and its piece.
    pub(super) fn at(&self, s: f64) -> (DVec3, usize) {
        let lengths = self.lengths();
        let piece = lengths[1..].iter().position(|&l| s <= l).unwrap_or(self.pieces.len() - 1);
        let share = (s - lengths[piece]) / (lengths[piece + 1] - lengths[piece]);
        (self.points[piece].lerp(self.points[piece + 1], share), piece)
    }

    /// How far along it the place nearest to `p` is, m.
    pub(super) fn project(&self, p: DVec3) -> f64 {
        let lengths = self.lengths();
        let nearest = self.points.windows(2).zip(&lengths).map(|(w, begin)| {
            let along = w[1] - w[0];
            let t = ((p - w[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (p.distance(w[0] + t * along), begin + t * along.length())
        });
        nearest.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |n| n.1)
    }

    /// The largest measure across it, m.
    pub(super) fn depth(&self) -> f64 {
        self.pieces.iter().flat_map(|(s, _)| s.reach).fold(0.0, f64::max) * 2.0
    }
}

/// A section's area and centroid.
struct Cut {
    area: f64,
    at: DVec3,
}

fn cut(solid: &Solid, at: DVec3, along: DVec3) -> Option<Cut> {
    let axes = across(along, along.any_orthonormal_vector());
    let (section, centre, _) = Section::outlined(&solid.cut(at, axes))?;
    Some(Cut { area: section.area, at: at + centre.x * axes[1] + centre.y * axes[2] })
}

/// Centroids from one cut on, until part of a section is missing; the last is the end.
fn march(solid: &Solid, from: &Cut, along: DVec3, step: f64) -> Vec<DVec3> {
    let mut points = Vec::new();
    let (mut at, mut area, mut way, mut bend) = (from.at, from.area, along, DVec3::ZERO);
    let mut taper: f64 = 1.0;
    while points.len() < 8 * STEPS {
        let whole = |cut: &Cut| (WHOLE..1.0 / WHOLE).contains(&(cut.area / area));
        let next = |way: DVec3| cut(solid, at + step * way, way).filter(whole);
        // The way on turns to where the next centroid is.
        let turned = (0..3)
            .try_fold(way, |way, _| Some((next(way)?.at - at).try_normalize().unwrap_or(way)));
        if let Some((ahead, turned)) = turned.and_then(|w| Some((next(w)?, w))) {
            bend = if points.is_empty() { DVec3::ZERO } else { turned - way };
            taper = if points.is_empty() { 1.0 } else { ahead.area / area };
            (at, area, way) = (ahead.at, ahead.area, turned);
            points.push(at);
            continue;
        }
        // Towards the end it goes on turning as it did: chord and tangent of an arc.
        let near = |s: f64| {
            let [chord, tangent] = [0.5 + 0.5 * s / step, 0.5 + s / step]
                .map(|turn| (way + turn * bend).normalize_or(way));
            let expected = END * area * taper.powf(s / step);
            cut(solid, at + s * chord, tangent).filter(|cut| cut.area > expected)
        };
        let (mut low, mut high) = (0.0, step);
        for _ in 0..40 {
            let half = 0.5 * (low + high);
            *(if near(half).is_some() { &mut low } else { &mut high }) = half;
        }
        // In the face itself a cut is whatever rounding makes of it.
        let before = low - BEFORE * step;
        let end = near(before).map_or(at, |c| c.at + BEFORE * step * way);
        // A crumb of a step would be a beam of no length.
        if low < 0.1 * step {
            points.pop();
        }
        points.push(end);
        break;
    }
    points
}

impl Sheet {
    fn of(solid: &Solid, directions: [DVec3; 3]) -> Option<Self> {
        let [normal, u, v] = directions;
        let ([u0, u1], [v0, v1]) = (solid.span(u), solid.span(v));
        let (long, short) = ((u1 - u0).max(v1 - v0), (u1 - u0).min(v1 - v0));
        let edge = (long / PLATES[0]).max(short / PLATES[1]);
        let [n, m] = [u1 - u0, v1 - v0].map(|size| (size / edge).round().max(2.0) as usize);
        let spot = |i: f64, j: f64| {
            (u0 + (u1 - u0) * i / n as f64) * u + (v0 + (v1 - v0) * j / m as f64) * v
        };
        // Thickness and height of the middle of every plate, from nine lines through it.
        let columns: Vec<[f64; 2]> = (0..n * m)
            .map(|k| {
                let mut sums = [0.0; 2];
                for s in 0..9 {
                    let [a, b] = [s % 3, s / 3].map(|s| (f64::from(s) + 0.4993) / 3.0);
                    let line = spot((k % n) as f64 + a, (k / n) as f64 + b);
                    for pair in solid.crossings(line, normal).as_chunks::<2>().0 {
                        let thick = pair[1] - pair[0];
                        sums[0] += thick / 9.0;
                        sums[1] += thick / 9.0 * 0.5 * (pair[0] + pair[1]);
                    }
                }
                sums
            })
            .collect();
        let usual = solid.volume / shadow(solid, directions).max(1e-9);
        let all: f64 = columns.iter().map(|c| c[0]).sum();
        let middle = columns.iter().map(|c| c[1]).sum::<f64>() / all.max(1e-300);
        let kept: Vec<usize> = (0..n * m).filter(|&k| columns[k][0] > THERE * usual).collect();
        let side = n + 1;
        let mut number = vec![u32::MAX; side * (m + 1)];
        let mut sheet = Self { nodes: Vec::new(), plates: Vec::new() };
        for k in kept {
            let first = k % n + side * (k / n);
            let corners = [first, first + 1, first + side + 1, first + side].map(|c| {
                if number[c] == u32::MAX {
                    number[c] = sheet.nodes.len() as u32;
                    let place = spot((c % side) as f64, (c / side) as f64);
                    sheet.nodes.push(place + middle * normal);
                }
                number[c]
            });
            sheet.plates.push((corners, columns[k][0]));
        }
        (!sheet.plates.is_empty()).then_some(sheet)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::solid::cuboid, *};

    /// A quarter of a ring of bricks: radius 4 to 5, 2 wide.
    fn arch() -> Solid {
        let n = 24;
        let at = |k: usize, r: f64, z: f64| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * k as f64 / n as f64).sin_cos();
            DVec3::new(r * cos, r * sin, z)
        };
        let ring = |k| [at(k, 4.0, 0.0), at(k, 5.0, 0.0), at(k, 5.0, 2.0), at(k, 4.0, 2.0)];
        let points: Vec<DVec3> = (0..=n).flat_map(ring).collect();
        let mut triangles = vec![[0, 2, 1], [0, 3, 2]];
        for k in 0..n as u32 {
            for i in 0..4 {
                let [a, b] = [4 * k + i, 4 * k + (i + 1) % 4];
                triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
            }
        }
        let last = 4 * n as u32;
        triangles.extend([[last, last + 1, last + 2], [last, last + 2, last + 3]]);
        Solid::new(&points, &triangles).unwrap()
    }

    #[test]
    fn a_quarter_of_an_arch_is_followed_from_springing_to_crown() {
        let solid = arch();
        let directions = solid.directions();
        let bar =
            Bar::followed(&solid, axis(MemberKind::Other, &solid, directions), directions).unwrap();
        let ends = [bar.points[0], bar.points[bar.points.len() - 1]];
        let exact = [DVec3::new(0.0, 4.5, 1.0), DVec3::new(4.5, 0.0, 1.0)];
        let off = |a: usize, b: usize| ends[0].distance(exact[a]) + ends[1].distance(exact[b]);
        assert!(off(0, 1).min(off(1, 0)) < 0.1, "{ends:?}");
        let length = bar.lengths()[bar.pieces.len()];
        assert!((length / (4.5 * std::f64::consts::FRAC_PI_2) - 1.0).abs() < 0.02, "{length}");
        for (section, y) in &bar.pieces {
            assert!((section.area / 2.0 - 1.0).abs() < 0.02, "{section:?}");
            assert!(y.z.abs() < 1e-6);
        }
    }

    #[test]
    fn a_straight_beam_is_one_piece_and_a_slab_a_sheet_of_its_volume() {
        let beam = cuboid(DVec3::ZERO, DVec3::new(6.0, 0.5, 0.3));
        let bar = Bar::followed(&beam, DVec3::X, beam.directions()).unwrap();
        assert_eq!(bar.pieces.len(), 1);
        assert!((bar.points[1].x - bar.points[0].x - 6.0).abs() < 1e-6, "{:?}", bar.points);
        assert!((bar.pieces[0].0.second[1] / (0.3 * 0.125 / 12.0) - 1.0).abs() < 1e-6);
        let slab = cuboid(DVec3::ZERO, DVec3::new(6.0, 0.2, 4.0));
        let sheet = Sheet::of(&slab, slab.directions()).unwrap();
        let volume: f64 = sheet
            .plates
            .iter()
            .map(|(corners, t)| {
                let [a, b, _, d] = corners.map(|c| sheet.nodes[c as usize]);
                (b - a).cross(d - a).length() * t
            })
            .sum();
        assert!(
            (volume / 4.8 - 1.0).abs() < 1e-9
                && sheet.nodes.iter().all(|p| (p.y - 0.1).abs() < 1e-9)
        );
    }
}
