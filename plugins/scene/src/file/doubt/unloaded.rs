//! Columns and walls that are computed without what rests on them: each member stands on supports
//! of its own, and nothing says that loads are handed on.

use super::*;
use crate::Scene;

/// Weight of concrete, N/m³.
const WEIGHT: f64 = 25e3;
/// Slack between what rests and what carries it, m.
const SLACK: f32 = 0.05;
/// A column that bears less than this share of what rests on it does not bear it.
const LITTLE: f64 = 0.5;
/// Members that are looked at, each beside each other.
const MOST: usize = 2000;

/// One line for all members that others rest on and that bear nothing of it.
pub(crate) fn unloaded(scene: &Scene) -> Option<String> {
    let structure = &scene.structure;
    if structure.loads.is_empty() || scene.bears_as_one() || structure.assemblies.len() > MOST {
        return None;
    }
    let of = |id: &str| scene.members.iter().find(|m| m.id == id);
    let all: Vec<&crate::Member> =
        structure.assemblies.iter().filter(|a| !a.is_tunnel()).filter_map(|a| of(&a.id)).collect();
    let rests = |above: &crate::Member, below: &crate::Member| {
        let ([a, b], [c, d]) = (above.bounds, below.bounds);
        let over = |i: usize| a[i] < d[i] && b[i] > c[i];
        (a.y - d.y).abs() < SLACK && over(0) && over(2)
    };
    let upright = |m: &&&crate::Member| {
        matches!(m.kind, crate::MemberKind::Column | crate::MemberKind::Wall)
            && structure.is_held(&m.id)
    };
    let mut found: Vec<(&str, &str, f64)> = Vec::new();
    for below in all.iter().filter(upright) {
        let share = |above: &&&crate::Member| {
            let carriers = all.iter().filter(|m| rests(above, m)).count().max(1);
            WEIGHT * above.volume / carriers as f64
        };
        let above: Vec<_> = all.iter().filter(|m| rests(m, below)).collect();
        let Some(first) = above.first() else { continue };
        let weight: f64 = above.iter().map(share).sum();
        if given(scene, below) < LITTLE * weight {
            found.push((&below.name, &first.name, weight));
        }
    }
    let (below, above, weight) = found.first()?;
    Some(format!(
        "{} columns and walls bear nothing of what rests on them, \"{below}\" the first (\"{above}\" and what else lies on it weighs {:.0} kN there): no joints are given and each member has supports of its own, so that each is computed by itself; name joints, or mark supports that stand for other members alone: true",
        found.len(),
        1e-3 * weight
    ))
}

/// What loads of the scene press down on a member besides its own weight, N.
fn given(scene: &Scene, member: &crate::Member) -> f64 {
    let [low, high] = member.bounds;
    let top = f64::from((high.x - low.x) * (high.z - low.z));
    let length = f64::from(member.frame.axis.length());
    let loads = scene.structure.loads.iter();
    let own = loads.filter(|l| l.members.is_empty() || l.members.contains(&member.id));
    let most = |l: &crate::structure::Load| {
        l.history.iter().map(|h| f64::from(h.1.abs())).reduce(f64::max).unwrap_or(1.0)
    };
    own.map(|load| {
        most(load)
            * match &load.action {
                Action::Force { force_kn, .. } => 1e3 * f64::from(-force_kn.y),
                Action::Line { from, to, force_kn_m } => {
                    1e3 * f64::from(-force_kn_m.y * (to - from)) * length
                }
                Action::Pressure {
                    place: Place::Top | Place::Start | Place::End,
                    pressure_kpa,
                } => 1e3 * f64::from(*pressure_kpa) * top,
                _ => 0.0,
            }
    })
    .sum()
}
