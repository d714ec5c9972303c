//! Steel of parametric members as lines: what a mechanical model embeds in its concrete.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{
    Outline, frame,
    steel::{Cage, Shape, arc, bars, rings, spaced, stirrup, stirrup_places, tendon_line},
};
use crate::{
    Frame, Part,
    file::Member,
    structure::{Body, Grade, InnerLining, Reinforcement, Section, Segments, SteelLine, Tendon},
};

/// All steel of a member.
pub(crate) fn steel_lines(member: &Member) -> Vec<SteelLine> {
    lines_of(&member.body, frame(member))
}

/// All steel of a body whose axis lies so.
pub(crate) fn lines_of(body: &Body, frame: Frame) -> Vec<SteelLine> {
    let lines = match body {
        Body::Column { section, height_m, reinforcement } => {
            prism(outline(section), *height_m, reinforcement.as_ref(), &[])
        }
        Body::Beam { section, length_m, reinforcement, tendons } => {
            prism(outline(section), *length_m, reinforcement.as_ref(), tendons)
        }
        Body::BoxGirder { section, length_m, reinforcement, tendons } => {
            prism(Outline::girder(section), *length_m, reinforcement.as_ref(), tendons)
        }
        Body::Tunnel { .. } => tunnel(body),
    };
    placed(lines, frame)
}

/// Bars and stirrups in a box, or a round section, about an axis. `half`: half its measures
/// towards angle 0 and towards angle 90, m.
pub(super) fn lines_within(
    half: Vec2,
    is_round: bool,
    reinforcement: &Reinforcement,
    frame: Frame,
) -> Vec<SteelLine> {
    let outline =
        if is_round { Outline::Round(half.min_element()) } else { Outline::Rectangle(half) };
    placed(prism(outline, frame.axis.length(), Some(reinforcement), &[]), frame)
}

/// From a member's own coordinates to the world.
fn placed(mut lines: Vec<SteelLine>, frame: Frame) -> Vec<SteelLine> {
    let along = frame.axis.normalize_or_zero();
    let from = |o: Vec3, p: Vec3| o + p.x * frame.zero + p.y * frame.ninety() + p.z * along;
    for line in &mut lines {
        line.line.iter_mut().for_each(|p| *p = from(frame.start, *p));
        line.inward = from(Vec3::ZERO, line.inward);
    }
    lines
}

fn outline(section: &Section) -> Outline {
    match *section {
        Section::Rectangle { width_m, depth_m } => {
            Outline::Rectangle(Vec2::new(0.5 * depth_m, 0.5 * width_m))
        }
        Section::Round { diameter_m } => Outline::Round(0.5 * diameter_m),
    }
}

fn prism(
    outline: Outline,
    length: f32,
    reinforcement: Option<&Reinforcement>,
    tendons: &[Tendon],
) -> Vec<SteelLine> {
    let mut lines = Vec::new();
    if let Some(r) = reinforcement {
        let (cover, grade) = ((r.cover_mm / 1000.0).min(0.4 * length), r.grade());
        let of =
            |f_y_mpa: Option<f32>| grade.map(|g| if f_y_mpa.is_some() { g.at(f_y_mpa) } else { g });
        lines.extend(bars(outline, r, length).into_iter().enumerate().map(|(i, bar)| {
            let line = bar.reach(length, cover).map(|z| bar.at.extend(z)).to_vec();
            SteelLine {
                grade: of(bar.f_y_mpa),
                bond: bar.bond,
                ends: bar.ends,
                inward: bar.inward.extend(0.0),
                ..SteelLine::new(format!("bar {}", i + 1), Part::Bar, bar.diameter, line)
            }
        }));
        if let Some(s) = &r.stirrups {
            let shape = closed(stirrup(outline, r.cover_mm / 1000.0, s.diameter_mm / 1000.0));
            let diameter = s.diameter_mm / 1000.0;
            lines.extend(stirrup_places(s, length, cover).enumerate().map(|(i, z)| {
                let line = shape.iter().map(|p| *p + Vec3::Z * z).collect();
                SteelLine {
                    grade: of(s.f_y_mpa),
                    ..SteelLine::new(format!("stirrup {}", i + 1), Part::Stirrup, diameter, line)
                }
            }));
        }
    }
    lines.extend(tendons.iter().map(|t| {
        let line = tendon_line(&t.line, length, 0.0);
        SteelLine {
            prestress: Some(t.prestress.clone()),
            ..SteelLine::new(t.name.clone(), Part::Tendon, t.duct_mm / 1000.0, line)
        }
    }));
    lines
}

fn tunnel(body: &Body) -> Vec<SteelLine> {
    let Body::Tunnel { radius_m, length_m, segments, cushion_mm, inner_lining, .. } = body else {
        return Vec::new();
    };
    let (mut lines, mut radius) = (Vec::new(), *radius_m);
    if let Some(l) = inner_lining {
        lines.extend(lining(l, radius, *length_m));
        radius += l.thickness_m + cushion_mm / 1000.0;
    }
    if let Some(s) = segments {
        lines.extend(of_segments(s, radius, *length_m));
    }
    lines
}

/// The lines of a cage, turned about the axis and moved along it.
fn copies<'a>(
    cage: &'a Cage,
    grade: Option<Grade>,
    of: &'a str,
    [turn, begin]: [f32; 2],
) -> impl Iterator<Item = SteelLine> + 'a {
    let turn = Vec2::from_angle(turn);
    cage.lines.iter().map(move |(name, shape, at)| {
        let Shape { line, diameter, part, .. } = &cage.shapes[*shape];
        let place = |p: &Vec3| {
            let p = *p + *at;
            turn.rotate(p.truncate()).extend(p.z + begin)
        };
        let line = line.iter().map(place).collect();
        SteelLine { grade, ..SteelLine::new(format!("{of}{name}"), *part, *diameter, line) }
    })
}

fn of_segments(s: &Segments, radius: f32, length: f32) -> Vec<SteelLine> {
    let Some(steel) = &s.reinforcement else { return Vec::new() };
    let mut lines = Vec::new();
    for ring in rings(s, length) {
        let cage = Cage::of_segment(s, steel, radius, &ring);
        for (k, turn) in ring.turns(s).enumerate() {
            let name = format!("R{}/S{} ", ring.number, k + 1);
            lines.extend(copies(&cage, steel.grade(), &name, [turn, ring.concrete[0]]));
        }
    }
    lines
}

fn lining(l: &InnerLining, radius: f32, length: f32) -> Vec<SteelLine> {
    let cage = Cage::of_lining(l, radius, length);
    let mut lines: Vec<SteelLine> = copies(&cage, l.grade(), "", [0.0, 0.0]).collect();
    if let Some(t) = &l.tendons {
        lines.extend(spaced(length, 0.5 * t.spacing_m.min(length), t.spacing_m).enumerate().map(
            |(i, z)| {
                let anchor = t
                    .anchors_deg
                    .get(i % t.anchors_deg.len().max(1))
                    .copied()
                    .unwrap_or(0.0)
                    .to_radians();
                let turn = arc(radius + t.depth_m, anchor, anchor + TAU, 0.0);
                let line = turn.into_iter().map(|p| p + Vec3::Z * z).collect();
                let (name, duct) = (format!("tendon {}", i + 1), t.duct_mm / 1000.0);
                SteelLine {
                    prestress: Some(t.prestress.clone()),
                    ..SteelLine::new(name, Part::Tendon, duct, line)
                }
            },
        ));
    }
    lines
}

/// The line, back to where it begins.
fn closed(mut line: Vec<Vec3>) -> Vec<Vec3> {
    line.extend(line.first().copied());
    line
}
