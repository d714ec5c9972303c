//! Bars and stirrups that follow a surface: at each place on the axis they keep their cover from
//! the box about the section there, so that an arch, a haunch or a tapered pier has them inside.

use glam::{Vec2, Vec3};

use super::{Outline, lines::lines_within};
use crate::{
    Frame, Part,
    structure::{BarEnd, Reinforcement, SteelLine},
};

/// Places on the axis at which the section is looked at.
const STATIONS: usize = 33;
/// Measures that differ by less are the same, m.
const SAME: f32 = 2e-3;

/// A triangle in the world.
pub(crate) type Triangle = [Vec3; 3];

/// The box about a section: its least and its greatest towards angle 0 and towards angle 90, m.
type Span = [Vec2; 2];

/// Bars and stirrups within the surface of a member, about its axis.
pub(crate) fn lines_in(
    frame: Frame,
    triangles: &[Triangle],
    reinforcement: &Reinforcement,
) -> Vec<SteelLine> {
    let local: Vec<Triangle> = triangles.iter().map(|t| t.map(|p| to_local(frame, p))).collect();
    let (half, is_round) = section(&local);
    let lines = lines_within(half, is_round, reinforcement, frame);
    let length = frame.axis.length();
    let profile: Vec<Option<Span>> =
        (0..STATIONS).map(|k| cut(&local, length * share(k))).collect();
    let same = |span: &Option<Span>| {
        span.is_none_or(|[low, high]| {
            (high - half).abs().max_element() < SAME && (low + half).abs().max_element() < SAME
        })
    };
    if profile.iter().all(same) {
        return lines;
    }
    let outline =
        if is_round { Outline::Round(half.min_element()) } else { Outline::Rectangle(half) };
    let fit = Fit { outline, profile, length, reinforcement };
    lines.iter().flat_map(|line| fit.line(frame, line)).collect()
}

/// Where on the axis a station lies, 0 to 1: away from the ends, where a face is cut or missed by
/// rounding alone.
fn share(k: usize) -> f32 {
    (k as f32 / (STATIONS - 1) as f32).clamp(1e-3, 1.0 - 1e-3)
}

fn to_local(frame: Frame, p: Vec3) -> Vec3 {
    let from = p - frame.start;
    Vec3::new(
        from.dot(frame.zero),
        from.dot(frame.ninety()),
        from.dot(frame.axis.normalize_or_zero()),
    )
}

fn to_world(frame: Frame, p: Vec3) -> Vec3 {
    frame.start + p.x * frame.zero + p.y * frame.ninety() + p.z * frame.axis.normalize_or_zero()
}

/// Half the measures about the axis, towards angle 0 and towards angle 90, and whether the section
/// is round.
fn section(local: &[Triangle]) -> (Vec2, bool) {
    let points = || local.iter().flatten().map(|p| p.truncate());
    let half = points().map(Vec2::abs).fold(Vec2::ZERO, Vec2::max);
    let reach = points().map(Vec2::length).fold(0.0, f32::max);
    // Corners of a box lie √2 of its half measure from the axis, those of a round section at it.
    let is_round =
        reach < 1.03 * half.min_element() && half.max_element() < 1.03 * half.min_element();
    (half, is_round)
}

/// The box about the section at a place on the axis.
fn cut(local: &[Triangle], z: f32) -> Option<Span> {
    let mut span: Option<Span> = None;
    for triangle in local {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (triangle[a], triangle[b]);
            if (a.z <= z) == (b.z <= z) {
                continue;
            }
            let p = a.lerp(b, (z - a.z) / (b.z - a.z)).truncate();
            let [low, high] = span.unwrap_or([p; 2]);
            span = Some([low.min(p), high.max(p)]);
        }
    }
    span
}

struct Fit<'a> {
    outline: Outline,
    profile: Vec<Option<Span>>,
    length: f32,
    reinforcement: &'a Reinforcement,
}

impl Fit<'_> {
    /// A line with its cover from the section at each of its places: in pieces where the section has
    /// no room for it between.
    fn line(&self, frame: Frame, line: &SteelLine) -> Vec<SteelLine> {
        let inset = self.inset(line);
        let local: Vec<Vec3> = line.line.iter().map(|p| to_local(frame, *p)).collect();
        let places: Vec<Vec3> = match (line.part, local.first(), local.last()) {
            (Part::Bar, Some(first), Some(last)) => {
                let within = |z: &f32| *z > first.z + SAME && *z < last.z - SAME;
                let between = (0..STATIONS).map(|k| self.length * share(k)).filter(within);
                let at = |z: f32| first.truncate().extend(z);
                [first.z].into_iter().chain(between).chain([last.z]).map(at).collect()
            }
            _ => local,
        };
        let moved: Vec<Option<Vec3>> = places.iter().map(|p| self.moved(*p, inset)).collect();
        let is_whole = |run: &&[Option<Vec3>]| run.len() >= 2;
        let runs = moved.split(Option::is_none).filter(is_whole);
        let runs = runs.filter(|run| line.part == Part::Bar || run.len() == moved.len());
        let runs: Vec<&[Option<Vec3>]> = runs.collect();
        let last = runs.len().saturating_sub(1);
        let piece = |(k, run): (usize, &&[Option<Vec3>])| {
            let points: Vec<Vec3> = run.iter().flatten().copied().collect();
            let points = if line.part == Part::Bar { straightened(&points) } else { points };
            let line_of = points.into_iter().map(|p| to_world(frame, p)).collect();
            // Where there is no room between, it is cut off.
            let own = [k == 0, k == last];
            let ends = [0, 1].map(|i| if own[i] { line.ends[i] } else { BarEnd::Straight });
            SteelLine { line: line_of, ends, ..line.clone() }
        };
        runs.iter().enumerate().map(piece).collect()
    }

    /// From the face to the axis of a line, m.
    fn inset(&self, line: &SteelLine) -> f32 {
        let stirrup = self.reinforcement.stirrups.as_ref().map_or(0.0, |s| 1e-3 * s.diameter_mm);
        let over = if line.part == Part::Bar { stirrup } else { 0.0 };
        1e-3 * self.reinforcement.cover_mm + over + 0.5 * line.diameter
    }

    /// A point of the outline about the axis, where it lies in the section at its place; none: there
    /// is no room.
    fn moved(&self, p: Vec3, inset: f32) -> Option<Vec3> {
        let [low, high] = self.span(p.z)?;
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        if half.min_element() < 1.2 * inset {
            return None;
        }
        let from = p.truncate();
        let to = match self.outline {
            Outline::Round(radius) => {
                from * (half.min_element() - inset) / (radius - inset).max(1e-6)
            }
            Outline::Rectangle(own) => from * (half - inset) / (own - inset).max(Vec2::splat(1e-6)),
            Outline::Girder { .. } => from,
        };
        Some((centre + to).extend(p.z))
    }

    /// The box about the section between two stations.
    fn span(&self, z: f32) -> Option<Span> {
        let at = (z / self.length).clamp(0.0, 1.0) * (STATIONS - 1) as f32;
        let k = (at as usize).min(STATIONS - 2);
        let t = at - k as f32;
        let [a, b] = [self.profile[k], self.profile[k + 1]];
        match (a, b) {
            (Some(a), Some(b)) => Some([a[0].lerp(b[0], t), a[1].lerp(b[1], t)]),
            (one, None) if t < 1e-3 => one,
            (None, one) if t > 1.0 - 1e-3 => one,
            _ => None,
        }
    }
}

/// Without the points that lie on the line between their neighbours (Douglas and Peucker, 1973).
fn straightened(points: &[Vec3]) -> Vec<Vec3> {
    let [first, middle @ .., last] = points else { return points.to_vec() };
    let off = |p: &Vec3| (*p - *first).reject_from((*last - *first).normalize_or(Vec3::Z)).length();
    let far = middle.iter().map(off).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match far {
        Some((i, distance)) if distance > 0.5 * SAME => {
            let mut all = straightened(&points[..i + 2]);
            all.pop();
            all.extend(straightened(&points[i + 1..]));
            all
        }
        _ => vec![*first, *last],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Bars, Stirrups};

    fn reinforcement() -> Reinforcement {
        Reinforcement {
            cover_mm: 40.0,
            steel: "B500B".into(),
            f_y_mpa: None,
            bars: [180.0, 0.0].map(|side_deg| Bars::row(side_deg, 3, 20.0)).to_vec(),
            stirrups: Some(Stirrups { diameter_mm: 10.0, spacing_mm: 200.0, f_y_mpa: None }),
            bond: Default::default(),
        }
    }

    /// A bar of .4 by .3 m, 8 m long, of which the middle at a place on the axis lies so high.
    fn bent(height: impl Fn(f32) -> f32, depth: impl Fn(f32) -> f32) -> Vec<Triangle> {
        const N: usize = 64;
        let ring = |k: usize| {
            let z = 8.0 * k as f32 / N as f32;
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]: [f32; 2]| Vec3::new(height(z) + 0.5 * depth(z) * x, 0.15 * y, z))
        };
        let mut all = Vec::new();
        let mut quad = |[a, b, c, d]: [Vec3; 4]| all.extend([[a, b, c], [a, c, d]]);
        for k in 0..N {
            let (one, two) = (ring(k), ring(k + 1));
            (0..4).for_each(|i| quad([one[i], one[(i + 1) % 4], two[(i + 1) % 4], two[i]]));
        }
        quad(ring(0));
        quad(ring(N));
        all
    }

    fn frame() -> Frame {
        Frame { start: Vec3::ZERO, axis: 8.0 * Vec3::Z, zero: Vec3::X }
    }

    #[test]
    fn straight_bars_stay_as_they_are() {
        let r = reinforcement();
        let own = lines_in(frame(), &bent(|_| 0.0, |_| 0.4), &r);
        assert_eq!(own, lines_within(Vec2::new(0.2, 0.15), false, &r, frame()));
    }

    #[test]
    fn bars_of_an_arch_and_of_a_haunch_keep_their_cover() {
        let r = reinforcement();
        let arch = |z: f32| 1.5 - (z - 4.0).powi(2) / 10.0;
        let haunch = |z: f32| 0.8 - 0.1 * z.min(4.0);
        for (height, depth) in [
            (&arch as &dyn Fn(f32) -> f32, &(|_: f32| 0.4_f32) as &dyn Fn(f32) -> f32),
            (&|_| 0.0, &haunch),
        ] {
            let lines = lines_in(frame(), &bent(height, depth), &r);
            assert_eq!(lines.iter().filter(|l| l.part == Part::Bar).count(), 6);
            assert!(lines.iter().filter(|l| l.part == Part::Stirrup).count() > 30);
            for line in &lines {
                let inset = if line.part == Part::Bar { 0.06 } else { 0.045 };
                for p in &line.line {
                    let off = (p.x - height(p.z)).abs();
                    let most = 0.5 * depth(p.z) - inset;
                    assert!(off < most + 5e-3 && p.y.abs() < 0.15 - inset + 1e-4, "{p} {line:?}");
                    if line.part == Part::Bar {
                        assert!(off > most - 5e-3, "{p} {most}");
                    }
                }
            }
        }
    }

    /// Of a bar that has no room in a waist, the pieces have hooks where the whole has them.
    #[test]
    fn pieces_of_a_bar_are_hooked_at_its_own_ends_alone() {
        let mut r = reinforcement();
        for bars in &mut r.bars {
            if let Bars::Row { ends, .. } = bars {
                *ends = [BarEnd::Hooked; 2];
            }
        }
        let waist = |z: f32| if (z - 4.0).abs() < 0.6 { 0.05 } else { 0.4 };
        let lines = lines_in(frame(), &bent(|_| 0.0, waist), &r);
        let bars: Vec<_> = lines.iter().filter(|l| l.part == Part::Bar).collect();
        assert_eq!(bars.len(), 12);
        for bar in bars {
            let is_first = bar.line[0].z < 1.0;
            let own = [BarEnd::Hooked, BarEnd::Straight];
            let ends = if is_first { own } else { [own[1], own[0]] };
            assert_eq!(bar.ends, ends, "{bar:?}");
        }
    }

    /// A wedge that ends in an edge has bars as far as they have room.
    #[test]
    fn where_there_is_no_room_bars_end() {
        let lines = lines_in(frame(), &bent(|_| 0.0, |z| 0.8 - 0.1 * z), &reinforcement());
        let ends = lines.iter().filter(|l| l.part == Part::Bar).filter_map(|l| l.line.last());
        assert!(ends.clone().count() == 6 && ends.clone().all(|p| (5.0..7.6).contains(&p.z)));
    }
}
