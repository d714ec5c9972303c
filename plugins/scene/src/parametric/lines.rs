//! Steel of parametric members as lines: what a mechanical model embeds in its concrete.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{
    Outline, frame,
    steel::{arc, bars, spaced, stirrup, stirrup_places, tendon_line},
};
use crate::{
    Frame, Part,
    file::Member,
    structure::{Body, Reinforcement, Section, SteelLine, Tendon},
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
        Body::Tunnel { .. } => lining(body),
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

fn lining(body: &Body) -> Vec<SteelLine> {
    let Body::Tunnel { radius_m: radius, length_m: length, inner_lining: Some(l), .. } = body
    else {
        return Vec::new();
    };
    let (radius, length, outer) = (*radius, *length, radius + l.thickness_m);
    let (cover, grade) = (l.cover_mm / 1000.0, l.grade());
    let hoop = l.hoops.as_ref().map_or(0.0, |h| h.diameter_mm / 1000.0);
    let mut lines = Vec::new();
    for (face, sign, side) in [(radius, 1.0, "inner"), (outer, -1.0, "outer")] {
        if let Some(h) = &l.hoops {
            let shape = arc(face + sign * (cover + 0.5 * hoop), 0.0, TAU, 0.0);
            lines.extend(stirrup_places(h, length, cover.min(0.4 * length)).enumerate().map(
                |(i, z)| {
                    let line = shape.iter().map(|p| *p + Vec3::Z * z).collect();
                    let name = format!("{side} hoop {}", i + 1);
                    SteelLine { grade, ..SteelLine::new(name, Part::Stirrup, hoop, line) }
                },
            ));
        }
        if let Some(b) = &l.bars {
            let diameter = b.diameter_mm / 1000.0;
            let end = cover.min(0.4 * length);
            let r = face + sign * (cover + hoop + 0.5 * diameter);
            lines.extend((0..b.count).map(|i| {
                let p = r * Vec2::from_angle(TAU * i as f32 / b.count as f32);
                let (name, line) =
                    (format!("{side} bar {}", i + 1), vec![p.extend(end), p.extend(length - end)]);
                SteelLine { grade, ..SteelLine::new(name, Part::Bar, diameter, line) }
            }));
        }
    }
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
