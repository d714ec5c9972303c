//! Planted damage, by the rule that judges predictions too.

use intrados_scene::{Damage, Member};
use intrados_stage::Estimate;

use crate::{
    grading::GradingRule,
    zone::{ZONES, middle, together, zone_at},
};

/// Share of a section that a nest of honeycomb takes: a disc of a quarter of the section's side.
const NEST: f64 = std::f64::consts::PI / 16.0;

/// A member's measures that damage is set against.
#[derive(Debug, Clone, Copy)]
struct Size {
    /// m.
    length: f64,
    /// Root of the section's area, m.
    side: f64,
}

/// Damage of every zone by what was planted besides pores and cracks, whether a slice shows it or
/// not: spalls, rust, lost stiffness.
#[must_use]
pub(crate) fn besides(member: &Member) -> [f64; ZONES] {
    let size = Size::of(member);
    std::array::from_fn(|zone| together(member.truth.iter().map(|d| of_other(d, zone, size))))
}

/// Damage of every zone by pores, by cracks, and by all else that was planted.
#[must_use]
pub fn parts(member: &Member, rule: &GradingRule) -> [[f64; ZONES]; 3] {
    let size = Size::of(member);
    let pores = |zone| {
        let porosity: f64 = member.truth.iter().map(|d| porosity(d, zone, size)).sum();
        rule.damage(Estimate { value: porosity, std_error: 0.0 }, &[], 1.0).value
    };
    let cracks = |zone| member.truth.iter().map(|d| cut(d, zone, rule)).sum::<f64>().min(1.0);
    [std::array::from_fn(pores), std::array::from_fn(cracks), besides(member)]
}

/// Damage of every zone by all that was planted, where no slice was drawn.
#[must_use]
pub fn planted(member: &Member, rule: &GradingRule) -> [f64; ZONES] {
    let parts = parts(member, rule);
    std::array::from_fn(|zone| together(parts.map(|part| part[zone])))
}

impl Size {
    fn of(member: &Member) -> Self {
        let length = f64::from(member.frame.axis.length()).max(1e-6);
        Self { length, side: (member.volume / length).max(1e-9).sqrt() }
    }
}

fn is_within(zone: usize, from: f32, to: f32) -> bool {
    (f64::from(from)..=f64::from(to)).contains(&middle(zone))
}

fn of_other(damage: &Damage, zone: usize, size: Size) -> f64 {
    match *damage {
        // A dish is a parabola: two thirds of its chord times its depth.
        Damage::Spall { along, diameter_m, depth_m, .. } if zone_at(f64::from(along)) == zone => {
            (2.0 / 3.0 * f64::from(diameter_m).min(size.side) * f64::from(depth_m)
                / size.side.powi(2))
            .min(1.0)
        }
        Damage::Corrosion { from, to, section_loss } if is_within(zone, from, to) => {
            f64::from(section_loss)
        }
        // Of one side a quarter of the section.
        Damage::Softened { from, to, damage, side_deg } if is_within(zone, from, to) => {
            f64::from(damage) * if side_deg.is_some() { 0.25 } else { 1.0 }
        }
        _ => 0.0,
    }
}

fn porosity(damage: &Damage, zone: usize, size: Size) -> f64 {
    match *damage {
        Damage::Voids { from, to, porosity, .. } if is_within(zone, from, to) => {
            f64::from(porosity)
        }
        Damage::Honeycomb { along, length_m, porosity } => {
            let away = (middle(zone) - f64::from(along)).abs() * size.length;
            let reaches = away <= 0.5 * f64::from(length_m) || zone_at(f64::from(along)) == zone;
            if reaches { NEST * f64::from(porosity) } else { 0.0 }
        }
        _ => 0.0,
    }
}

fn cut(damage: &Damage, zone: usize, rule: &GradingRule) -> f64 {
    match *damage {
        Damage::Crack { along, width_mm, depth, .. } if zone_at(f64::from(along)) == zone => {
            f64::from(depth) * (f64::from(width_mm) / rule.open_crack_mm).min(1.0)
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use intrados_scene::{Frame, MemberKind};

    use super::*;
    use crate::grading::Profile;

    /// A column of .4 × .4 × 3 m, by hand.
    #[test]
    fn zones_by_hand() {
        let bounds = [Vec3::ZERO, Vec3::new(0.4, 3.0, 0.4)];
        let member = Member {
            id: "C".into(),
            name: "C".into(),
            kind: MemberKind::Column,
            concrete: "C30/37".into(),
            concrete_assumed: false,
            exposure: None,
            frame: Frame::of_box(MemberKind::Column, bounds),
            bounds,
            volume: 0.48,
            slices: vec![],
            truth: vec![
                Damage::Crack { along: 0.25, width_mm: 0.5, depth: 0.6, angle_deg: 0.0 },
                Damage::Softened { from: 0.0, to: 0.3, damage: 0.45, side_deg: None },
                Damage::Spall { along: 0.95, angle_deg: 0.0, diameter_m: 0.3, depth_m: 0.04 },
                Damage::Voids {
                    from: 0.5,
                    to: 0.6,
                    porosity: 0.02 + 2_f32.ln() / 7.0,
                    median_mm: 2.0,
                },
            ],
        };
        let zones = planted(&member, &Profile::default().rule);
        let expected = [0.45, 0.45, 1.0 - 0.7 * 0.55, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.05];
        for (zone, (found, expected)) in zones.into_iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < 1e-6, "zone {zone}: {found} {expected}");
        }
        assert!((besides(&member)[2] - 0.45).abs() < 1e-6);
    }
}
