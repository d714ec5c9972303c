//! Where bars, stirrups and tendons lie. Sections in the member's own frame: x towards angle 0, y
//! towards angle 90, z along the axis, metres.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};

use crate::{
    Part,
    structure::{
        BarEnd, Bars, Bond, BoxSection, InnerLining, LiningBars, Reinforcement, SegmentBars,
        Segments, Stirrups, bent,
    },
};

/// The outline that steel keeps its cover from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Outline {
    /// Half the measures towards angle 0 and towards angle 90, about the frame's axis.
    Rectangle(Vec2),
    /// Radius.
    Round(f32),
    /// A box girder: half its top width, half its bottom width, half its depth (x is up), and the
    /// thinnest of its walls.
    Girder { top: f32, bottom: f32, depth: f32, wall: f32 },
}

impl Outline {
    pub(crate) fn girder(section: &BoxSection) -> Self {
        Self::Girder {
            top: 0.5 * section.top_width_m,
            bottom: 0.5 * section.bottom_width_m,
            depth: 0.5 * section.depth_m,
            wall: section.top_m.min(section.bottom_m).min(section.web_m),
        }
    }
}

/// A longitudinal bar.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Laid {
    /// Its centre.
    pub(crate) at: Vec2,
    /// m.
    pub(crate) diameter: f32,
    /// From where to where on the axis, 0 to 1.
    pub(crate) span: [f32; 2],
    /// How it holds to the concrete.
    pub(crate) bond: Bond,
    /// How its ends hold.
    pub(crate) ends: [BarEnd; 2],
    /// Towards where hooked ends are bent, as long as there is room, m; zero: none is hooked.
    pub(crate) inward: Vec2,
    /// Yield stress where it is another than that of the rest, MPa.
    pub(crate) f_y_mpa: Option<f32>,
}

impl Laid {
    /// Where it begins and ends along an axis of `length`, `cover` away from both faces, m.
    pub(crate) fn reach(&self, length: f32, cover: f32) -> [f32; 2] {
        self.span.map(|share| (share * length).clamp(cover, length - cover))
    }

    /// Its line about its own place, as [`Laid::reach`] says, with its hooks towards x.
    pub(crate) fn shape(&self, length: f32, cover: f32) -> Vec<Vec3> {
        let line = self.reach(length, cover).map(|z| Vec3::Z * z);
        bent(&line, self.ends, self.inward.length() * Vec3::X, self.diameter)
    }
}

/// The longitudinal bars along an axis of `length`, m: of lapped ones every piece, beside the one
/// before it.
pub(crate) fn bars(outline: Outline, r: &Reinforcement, length: f32) -> Vec<Laid> {
    let stirrup = r.stirrups.as_ref().map_or(0.0, |s| s.diameter_mm);
    let mut list = Vec::new();
    for bars in &r.bars {
        let (count, diameter_mm) = bars.size();
        let first = (r.cover_mm + stirrup + 0.5 * diameter_mm) / 1000.0;
        let (inset, f_y_mpa) = match *bars {
            Bars::Row { inset_mm, f_y_mpa, .. } => (first + inset_mm / 1000.0, f_y_mpa),
            Bars::Around { .. } => (first, None),
        };
        // Farther in, but as wide as the first layer.
        let inner = |half: Vec2, side_deg: f32| match side_deg as i32 {
            0 | 180 => half - Vec2::new(inset, first),
            _ => half - Vec2::new(first, inset),
        };
        let places: Vec<Vec2> = match (bars, outline) {
            (Bars::Around { .. }, Outline::Round(radius))
            | (Bars::Row { .. }, Outline::Round(radius)) => (0..count)
                .map(|i| (radius - inset) * Vec2::from_angle(TAU * i as f32 / count as f32))
                .collect(),
            (Bars::Around { .. }, Outline::Rectangle(half)) => around(half - inset, count),
            (Bars::Around { .. }, Outline::Girder { bottom, depth, .. }) => {
                around(Vec2::new(depth, bottom) - inset, count)
            }
            (Bars::Row { side_deg, .. }, Outline::Rectangle(half)) => {
                row(inner(half, *side_deg), half.y - first, *side_deg, count)
            }
            (Bars::Row { side_deg, .. }, Outline::Girder { top, bottom, depth, .. }) => {
                let width = if *side_deg == 0.0 { top } else { bottom };
                row(inner(Vec2::new(depth, bottom), *side_deg), width - first, *side_deg, count)
            }
        };
        let diameter = diameter_mm / 1000.0;
        let bond = if bars.laps().is_empty() { r.bond } else { Bond::Slip };
        for (i, (span, ends)) in pieces(bars, length).into_iter().enumerate() {
            let place = |at: &Vec2| if i % 2 == 1 { beside(outline, *at, diameter) } else { *at };
            let is_hooked = ends.contains(&BarEnd::Hooked);
            let laid = |at| {
                let inward = if is_hooked { inward(outline, bars, at, first) } else { Vec2::ZERO };
                Laid { at, diameter, span, bond, ends, inward, f_y_mpa }
            };
            list.extend(places.iter().map(place).map(laid));
        }
    }
    list
}

/// The bars that each of these is made of, between its laps: from where to where, 0 to 1, and how
/// their ends hold.
fn pieces(bars: &Bars, length: f32) -> Vec<([f32; 2], [BarEnd; 2])> {
    let ([from, to], [first, last]) = (bars.span(), bars.ends());
    let (mut begin, mut pieces) = ((from, first), Vec::new());
    for lap in bars.laps() {
        let [start, end] = lap.span(length).map(|at| at.clamp(from, to));
        pieces.push(([begin.0, end], [begin.1, BarEnd::Straight]));
        begin = (start, BarEnd::Straight);
    }
    pieces.push(([begin.0, to], [begin.1, last]));
    pieces
}

/// The place of a bar that touches the one at a place: along the face that this lies at, towards
/// its middle.
fn beside(outline: Outline, at: Vec2, diameter: f32) -> Vec2 {
    let half = match outline {
        Outline::Round(_) => {
            return Vec2::from_angle(diameter / at.length().max(diameter)).rotate(at);
        }
        Outline::Rectangle(half) => half,
        Outline::Girder { bottom, depth, .. } => Vec2::new(depth, bottom),
    };
    let towards_middle = |x: f32| if x > 0.0 { x - diameter } else { x + diameter };
    let off = half - at.abs();
    if off.x <= off.y {
        Vec2::new(at.x, towards_middle(at.y))
    } else {
        Vec2::new(towards_middle(at.x), at.y)
    }
}

/// Towards where a bar at a place is bent: off the face that it lies at, in a corner off both, as far
/// as the first layer (so far in) before the face across.
fn inward(outline: Outline, bars: &Bars, at: Vec2, first: f32) -> Vec2 {
    let (half, most) = match outline {
        Outline::Round(radius) => {
            return -at.normalize_or_zero() * (radius - first + at.length());
        }
        Outline::Rectangle(half) => (half - first, f32::INFINITY),
        Outline::Girder { bottom, depth, wall, .. } => {
            (Vec2::new(depth, bottom) - first, (wall - 2.0 * first).max(0.0))
        }
    };
    let (off, back) = (half - at.abs(), -at.signum());
    let towards = match *bars {
        Bars::Row { side_deg, .. } => match side_deg as i32 {
            0 => Vec2::NEG_X,
            180 => Vec2::X,
            90 => Vec2::NEG_Y,
            _ => Vec2::Y,
        },
        Bars::Around { .. } if (off.x - off.y).abs() < 1e-3 => FRAC_1_SQRT_2 * back,
        Bars::Around { .. } if off.x < off.y => Vec2::new(back.x, 0.0),
        Bars::Around { .. } => Vec2::new(0.0, back.y),
    };
    let room = |way: f32, half: f32, at: f32| {
        if way == 0.0 { f32::INFINITY } else { (half - way.signum() * at) / way.abs() }
    };
    let [x, y] = [room(towards.x, half.x, at.x), room(towards.y, half.y, at.y)];
    towards * x.min(y).min(most)
}

/// A bar in every corner, the others spread over the sides by their lengths.
fn around(half: Vec2, count: u32) -> Vec<Vec2> {
    let corners = [half, Vec2::new(-half.x, half.y), -half, Vec2::new(half.x, -half.y)];
    let between = count.saturating_sub(4);
    // Sides 0 and 2 run along x, sides 1 and 3 along y; what cannot be shared evenly goes to the
    // first ones.
    let along_x = (between as f32 * half.x / (half.x + half.y)).round() as u32;
    let along_y = between - along_x;
    let on_side = [along_x.div_ceil(2), along_y.div_ceil(2), along_x / 2, along_y / 2];
    let mut list = Vec::new();
    for (i, n) in on_side.into_iter().enumerate() {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        list.extend((0..=n).map(|k| a.lerp(b, k as f32 / (n + 1) as f32)));
    }
    list
}

/// Evenly along one side, the outer ones in the corners.
fn row(half: Vec2, half_width: f32, side_deg: f32, count: u32) -> Vec<Vec2> {
    let share = |i: u32| if count > 1 { 2.0 * i as f32 / (count - 1) as f32 - 1.0 } else { 0.0 };
    (0..count)
        .map(|i| match side_deg as i32 {
            0 => Vec2::new(half.x, half_width * share(i)),
            180 => Vec2::new(-half.x, half_width * share(i)),
            90 => Vec2::new(half.x * share(i), half.y),
            _ => Vec2::new(half.x * share(i), -half.y),
        })
        .collect()
}

/// The closed line of a stirrup, with round corners, at z = 0.
pub(crate) fn stirrup(outline: Outline, cover_m: f32, diameter: f32) -> Vec<Vec3> {
    let inset = cover_m + 0.5 * diameter;
    let half = match outline {
        Outline::Round(radius) => {
            return (0..48)
                .map(|i| ((radius - inset) * Vec2::from_angle(TAU * i as f32 / 48.0)).extend(0.0))
                .collect();
        }
        Outline::Rectangle(half) => half - inset,
        Outline::Girder { bottom, depth, .. } => Vec2::new(depth, bottom) - inset,
    };
    // Mandrel of twice the diameter inside the bend (Eurocode 2, 8.3: 4 φ across).
    let bend = (2.5 * diameter).min(0.5 * half.min_element());
    let centres = [Vec2::ONE, Vec2::new(-1.0, 1.0), Vec2::NEG_ONE, Vec2::new(1.0, -1.0)]
        .map(|sign| sign * (half - bend));
    const ARC: usize = 4;
    (0..4)
        .flat_map(|corner| (0..=ARC).map(move |k| (corner, k)))
        .map(|(corner, k)| {
            let angle = FRAC_PI_2 * (corner as f32 + k as f32 / ARC as f32);
            (centres[corner] + bend * Vec2::from_angle(angle)).extend(0.0)
        })
        .collect()
}

/// Places along an axis of `length`: as many as fit with at least `end` left at both ends, centred.
pub(crate) fn spaced(length: f32, end: f32, spacing: f32) -> impl Iterator<Item = f32> {
    let room = (length - 2.0 * end).max(0.0);
    let gaps = (room / spacing + 1e-4).floor();
    let first = 0.5 * (length - gaps * spacing);
    (0..=gaps as u32).map(move |i| first + i as f32 * spacing)
}

/// Places of stirrups.
pub(crate) fn stirrup_places(s: &Stirrups, length: f32, cover_m: f32) -> impl Iterator<Item = f32> {
    spaced(length, cover_m + 0.0005 * s.diameter_mm, s.spacing_mm / 1000.0)
}

/// A smooth line through the points of a tendon: natural cubic splines of the two offsets over the
/// place on the axis. It keeps `end` away from both faces, so that a slanting duct does not stick
/// out.
pub(crate) fn tendon_line(points: &[Vec3], length: f32, end: f32) -> Vec<Vec3> {
    let end = end.min(0.4 * length);
    let mut knots: Vec<Vec3> = points
        .iter()
        .map(|p| Vec3::new(p.y, p.z, (p.x * length).clamp(end, length - end)))
        .collect();
    knots.dedup_by(|b, a| b.z - a.z < 1e-5 * length);
    let z: Vec<f64> = knots.iter().map(|k| f64::from(k.z)).collect();
    let spline = |pick: fn(&Vec3) -> f32| {
        let values: Vec<f64> = knots.iter().map(|k| f64::from(pick(k))).collect();
        let curvature = natural_spline(&z, &values);
        (values, curvature)
    };
    let (x, y) = (spline(|k| k.x), spline(|k| k.y));
    let pieces = if knots.len() == 2 { 1 } else { 8 };
    let mut line = Vec::new();
    for i in 0..knots.len().saturating_sub(1) {
        for k in 0..pieces {
            let t = f64::from(k) / f64::from(pieces);
            line.push(Vec3::new(
                at(&z, &x, i, t),
                at(&z, &y, i, t),
                (z[i] + t * (z[i + 1] - z[i])) as f32,
            ));
        }
    }
    line.extend(knots.last().copied());
    line
}

/// Value of a cubic spline in its piece `i` at share `t`.
fn at(z: &[f64], (values, curvature): &(Vec<f64>, Vec<f64>), i: usize, t: f64) -> f32 {
    let (h, s) = (z[i + 1] - z[i], 1.0 - t);
    let bend = (s.powi(3) - s) * curvature[i] + (t.powi(3) - t) * curvature[i + 1];
    (s * values[i] + t * values[i + 1] + h * h / 6.0 * bend) as f32
}

/// Second derivatives of the natural cubic spline, by Thomas's algorithm.
fn natural_spline(z: &[f64], values: &[f64]) -> Vec<f64> {
    let n = z.len();
    let mut curvature = vec![0.0; n];
    let mut upper = vec![0.0; n];
    for i in 1..n.saturating_sub(1) {
        let (h0, h1) = (z[i] - z[i - 1], z[i + 1] - z[i]);
        let right = 6.0 * ((values[i + 1] - values[i]) / h1 - (values[i] - values[i - 1]) / h0);
        let pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / pivot;
        curvature[i] = (right - h0 * curvature[i - 1]) / pivot;
    }
    for i in (1..n.saturating_sub(1)).rev() {
        curvature[i] -= upper[i] * curvature[i + 1];
    }
    curvature
}

/// Hoops and bars at both faces of a shell about the z axis, or of a piece of one: what linings and
/// segments have.
pub(super) struct Cage {
    /// What its lines are copies of.
    pub shapes: Vec<Shape>,
    /// Name, number of the shape, and where its origin is.
    pub lines: Vec<(String, usize, Vec3)>,
}

/// A line of steel that is copied.
pub(super) struct Shape {
    pub line: Vec<Vec3>,
    /// Whether it ends where it begins.
    pub closed: bool,
    pub diameter: f32,
    pub part: Part,
}

/// The concrete that a cage lies in, m and radians.
struct Shell {
    /// Of its inner and its outer face.
    radii: [f32; 2],
    /// From where to where; none: all around.
    span: Option<[f32; 2]>,
    /// Along z, from 0.
    length: f32,
    cover: f32,
}

/// A ring of segments: where it lies, m and radians.
pub(super) struct Ring {
    /// From 1.
    pub number: u32,
    /// Where it begins on the axis, and how long it is with half of the joints beside it.
    pub along: [f32; 2],
    /// The same of its concrete.
    pub concrete: [f32; 2],
    /// Angle of its first joint.
    first: f32,
}

impl Ring {
    /// Angles from which its segments begin.
    pub(super) fn turns(&self, s: &Segments) -> impl Iterator<Item = f32> {
        let (first, turn) = (self.first, TAU / s.count as f32);
        (0..s.count).map(move |k| first + k as f32 * turn)
    }
}

pub(super) fn rings(s: &Segments, length: f32) -> impl Iterator<Item = Ring> {
    (0..s.rings(length)).map(move |r| {
        let begin = r as f32 * s.ring_m;
        let ring = s.ring_m.min(length - begin);
        let gap = (s.joint.gap_mm / 1000.0).min(0.2 * ring);
        let first = s.first_joint_deg + if r % 2 == 1 { s.stagger_deg } else { 0.0 };
        Ring {
            number: r + 1,
            along: [begin, ring],
            concrete: [begin + 0.5 * gap, ring - gap],
            first: first.to_radians(),
        }
    })
}

/// Angles between which the concrete of a segment lies that begins at 0: half a gap at each joint,
/// measured at the outer face.
pub(super) fn span(s: &Segments, radius: f32) -> [f32; 2] {
    let edge = 0.5 * (s.joint.gap_mm / 1000.0) / (radius + s.thickness_m);
    [edge, TAU / s.count as f32 - edge]
}

impl Cage {
    pub(super) fn of_lining(l: &InnerLining, radius: f32, length: f32) -> Self {
        let radii = [radius, radius + l.thickness_m];
        let shell = Shell { radii, span: None, length, cover: l.cover_mm / 1000.0 };
        Self::new(&shell, l.hoops.as_ref(), l.bars.as_ref())
    }

    /// Of a segment of a ring from angle 0 on; z counts from where its concrete begins.
    pub(super) fn of_segment(s: &Segments, steel: &SegmentBars, radius: f32, ring: &Ring) -> Self {
        let shell = Shell {
            radii: [radius, radius + s.thickness_m],
            span: Some(span(s, radius)),
            length: ring.concrete[1],
            cover: steel.cover_mm / 1000.0,
        };
        Self::new(&shell, steel.hoops.as_ref(), steel.bars.as_ref())
    }

    fn new(shell: &Shell, hoops: Option<&Stirrups>, bars: Option<&LiningBars>) -> Self {
        let Shell { radii, span, length, cover } = *shell;
        let hoop = hoops.map_or(0.0, |h| h.diameter_mm / 1000.0);
        let end = cover.min(0.4 * length);
        let mut cage = Self { shapes: Vec::new(), lines: Vec::new() };
        for (face, sign, side) in [(radii[0], 1.0, "inner"), (radii[1], -1.0, "outer")] {
            if let Some(h) = hoops {
                let r = face + sign * (cover + 0.5 * hoop);
                let [from, to] = span.map_or([0.0, TAU], |span| within(span, cover / r));
                let line = arc(r, from, to, 0.0);
                let places = stirrup_places(h, length, end);
                let named =
                    |(i, z)| (format!("{side} hoop {}", i + 1), cage.shapes.len(), Vec3::Z * z);
                let lines: Vec<_> = places.enumerate().map(named).collect();
                cage.lines.extend(lines);
                let closed = span.is_none();
                cage.shapes.push(Shape { line, closed, diameter: hoop, part: Part::Stirrup });
            }
            if let Some(b) = bars {
                let diameter = b.diameter_mm / 1000.0;
                let r = face + sign * (cover + hoop + 0.5 * diameter);
                let angle = |i: u32| match span {
                    None => TAU * i as f32 / b.count as f32,
                    Some(span) => {
                        let [from, to] = within(span, (cover + 0.5 * diameter) / r);
                        let share = if b.count > 1 { i as f32 / (b.count - 1) as f32 } else { 0.5 };
                        from + share * (to - from)
                    }
                };
                let shape = cage.shapes.len();
                cage.lines.extend((0..b.count).map(|i| {
                    let at = r * Vec2::from_angle(angle(i));
                    (format!("{side} bar {}", i + 1), shape, at.extend(0.0))
                }));
                let line = vec![Vec3::Z * end, Vec3::Z * (length - end)];
                cage.shapes.push(Shape { line, closed: false, diameter, part: Part::Bar });
            }
        }
        cage
    }
}

/// A span less so much at both ends; of one that is shorter than that its middle.
fn within([from, to]: [f32; 2], less: f32) -> [f32; 2] {
    let less = less.min(0.4 * (to - from));
    [from + less, to - less]
}

/// An arc about the z axis at `z`, radians.
pub(crate) fn arc(radius: f32, from: f32, to: f32, z: f32) -> Vec<Vec3> {
    let n = ((to - from) / PI * 48.0).ceil().max(2.0) as usize;
    (0..=n)
        .map(|i| (radius * Vec2::from_angle(from + (to - from) * i as f32 / n as f32)).extend(z))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::Lap;

    #[test]
    fn bars_around_a_rectangle_are_as_many_as_asked_and_in_all_corners() {
        for count in 4..40 {
            let list = around(Vec2::new(0.2, 0.3), count);
            assert_eq!(list.len(), count as usize);
            for corner in [Vec2::new(0.2, 0.3), Vec2::new(-0.2, -0.3)] {
                assert!(list.iter().any(|p| p.distance(corner) < 1e-6));
            }
            for p in &list {
                assert!((p.x.abs() - 0.2).abs() < 1e-6 || (p.y.abs() - 0.3).abs() < 1e-6);
            }
        }
    }

    /// Two laps of 600 mm make three bars of one of 6 m: each overlaps the next by a lap, beside
    /// it, and only the ends that lie in no lap hold as those of the whole do.
    #[test]
    fn a_lapped_bar_is_several_that_overlap() {
        let lap = |at| Lap { at, length_mm: 600.0 };
        let bars = |laps| Bars::Around {
            count: 4,
            diameter_mm: 20.0,
            from: 0.0,
            to: 1.0,
            ends: [BarEnd::Anchored, BarEnd::Hooked],
            laps,
        };
        let of = |laps| Reinforcement {
            cover_mm: 40.0,
            steel: "B500B".into(),
            f_y_mpa: None,
            bars: vec![bars(laps)],
            stirrups: None,
            bond: Bond::Perfect,
        };
        let outline = Outline::Rectangle(Vec2::new(0.2, 0.3));
        let whole = super::bars(outline, &of(Vec::new()), 6.0);
        assert!(whole.iter().all(|bar| bar.bond == Bond::Perfect && bar.span == [0.0, 1.0]));
        let list = super::bars(outline, &of(vec![lap(0.3), lap(0.8)]), 6.0);
        assert_eq!(list.len(), 3 * whole.len());
        let straight = BarEnd::Straight;
        let wanted = [
            ([0.0, 2.1], [BarEnd::Anchored, straight]),
            ([1.5, 5.1], [straight; 2]),
            ([4.5, 5.96], [straight, BarEnd::Hooked]),
        ];
        for (pieces, (reach, ends)) in list.chunks(whole.len()).zip(wanted) {
            for piece in pieces {
                let found = piece.reach(6.0, 0.04);
                assert!((found[1] - reach[1]).abs() < 1e-5, "{piece:?}");
                assert!((found[0] - reach[0].max(0.04)).abs() < 1e-5, "{piece:?}");
                assert!(piece.bond == Bond::Slip && piece.ends == ends, "{piece:?}");
            }
        }
        for (one, next) in list.iter().zip(&list[whole.len()..]) {
            let (at, other) = (one.at.abs(), next.at.abs());
            assert!((one.at.distance(next.at) - 0.02).abs() < 1e-6, "{one:?} {next:?}");
            assert!(at.max(other).cmple(Vec2::new(0.15, 0.25) + 1e-6).all(), "{one:?} {next:?}");
        }
    }

    /// Hooks go off the faces of their bars, in corners off both, and keep the cover of all faces.
    #[test]
    fn hooks_lie_within_the_steel_around_them() {
        let bars = |side_deg: Option<f32>| match side_deg {
            None => Bars::Around {
                count: 8,
                diameter_mm: 20.0,
                from: 0.0,
                to: 1.0,
                ends: [BarEnd::Straight, BarEnd::Hooked],
                laps: Vec::new(),
            },
            Some(side_deg) => Bars::Row {
                side_deg,
                count: 3,
                diameter_mm: 20.0,
                inset_mm: 0.0,
                from: 0.0,
                to: 1.0,
                ends: [BarEnd::Straight, BarEnd::Hooked],
                laps: Vec::new(),
                f_y_mpa: None,
            },
        };
        let r = |side_deg| Reinforcement {
            cover_mm: 40.0,
            steel: "B500B".into(),
            f_y_mpa: None,
            bars: vec![bars(side_deg)],
            stirrups: None,
            bond: Bond::Perfect,
        };
        let square = Outline::Rectangle(Vec2::new(0.2, 0.3));
        for (outline, side_deg, half) in [
            (square, None, Vec2::new(0.15, 0.25)),
            (square, Some(0.0), Vec2::new(0.15, 0.25)),
            (square, Some(90.0), Vec2::new(0.15, 0.25)),
            (Outline::Round(0.1), None, Vec2::splat(0.05)),
        ] {
            for bar in super::bars(outline, &r(side_deg), 3.0) {
                let shape = bar.shape(3.0, 0.04);
                let turn = bar.inward.normalize();
                let end = bar.at + turn * shape[shape.len() - 1].x;
                assert!(end.abs().cmple(half + 1e-5).all(), "{bar:?} {end}");
                assert!(shape.iter().all(|p| p.z <= 2.95 + 1e-5), "{shape:?}");
                let deep = 0.18_f32.min(bar.inward.length());
                assert!((end.distance(bar.at) - deep).abs() < 1e-5, "{bar:?} {end}");
                let across = turn.abs();
                match side_deg {
                    Some(0.0) => assert!(across.x > 0.999, "{bar:?}"),
                    Some(_) => assert!(across.y > 0.999, "{bar:?}"),
                    None => assert!(bar.at.dot(turn) < 0.0, "{bar:?}"),
                }
            }
        }
        let straight = Reinforcement { bars: vec![Bars::around(8, 20.0)], ..r(None) };
        for bar in super::bars(square, &straight, 3.0) {
            assert_eq!(bar.shape(3.0, 0.04), [0.04 * Vec3::Z, (3.0 - 0.04) * Vec3::Z]);
        }
    }

    #[test]
    fn stirrups_keep_their_distance() {
        let places: Vec<f32> = spaced(3.0, 0.04, 0.15).collect();
        assert_eq!(places.len(), 20);
        assert!(
            places[0] >= 0.04 && places[19] <= 2.96 && (places[0] + places[19] - 3.0).abs() < 1e-5
        );
    }

    /// A natural spline gives back a straight line, and a parabola's sag to the last few per cent.
    #[test]
    fn tendons_pass_through_their_points() {
        let points =
            [Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.5, -0.3, 0.0), Vec3::new(1.0, 0.2, 0.0)];
        let line = tendon_line(&points, 10.0, 0.0);
        for p in points {
            assert!(line.iter().any(|q| q.distance(Vec3::new(p.y, p.z, p.x * 10.0)) < 1e-5));
        }
        let straight = tendon_line(
            &[Vec3::ZERO, Vec3::new(0.3, 0.03, 0.3), Vec3::new(1.0, 0.1, 1.0)],
            1.0,
            0.0,
        );
        assert!(
            straight.iter().all(|p| (p.x - 0.1 * p.z).abs() < 1e-6 && (p.y - p.z).abs() < 1e-6)
        );
    }
}
