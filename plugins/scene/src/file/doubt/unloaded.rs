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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two columns of 3 m under a beam of .3 × .6 × 6.2 m, which weighs 27.9 kN.
    fn frame(supports: &[(&str, &str)], more: &str) -> Scene {
        let column = |id: &str, x: f32| {
            format!(
                "(id: \"{id}\", at: ({x}, 0, 0), concrete: \"C30/37\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3))"
            )
        };
        let held = supports
            .iter()
            .map(|(member, place)| format!("(member: \"{member}\", place: {place}, hold: Fixed)"));
        let text = format!(
            "(schema: \"intrados.scene/1\", members: [{}, {}, (id: \"B\", at: (-0.1, 3.3, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 6.2))], supports: [{}], {more})",
            column("C1", 0.0),
            column("C2", 6.0),
            held.collect::<Vec<_>>().join(", ")
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frame.ron");
        std::fs::write(&path, text).unwrap();
        Scene::load(&path, &Default::default()).unwrap()
    }

    const COLUMNS: [(&str, &str); 2] = [("C1", "Start"), ("C2", "Start")];
    const ALL: [(&str, &str); 4] = [("C1", "Start"), ("C2", "Start"), ("B", "Start"), ("B", "End")];
    const WEIGHT: &str = "loads: [(name: \"own\", action: SelfWeight)],";

    fn doubt(scene: &Scene) -> Option<&String> {
        scene.warnings.iter().find(|w| w.contains("bear nothing of what rests on them"))
    }

    #[test]
    fn columns_without_what_rests_on_them_are_told() {
        let scene = frame(&ALL, WEIGHT);
        let said = doubt(&scene).unwrap();
        assert!(
            ["2 columns", "\"C1\"", "\"B\"", "14 kN"].iter().all(|w| said.contains(w)),
            "{said}"
        );
        assert!(!scene.bears_as_one());
        let joints = "joints: [(of: (\"C1\", \"B\"), kind: Hinge)],";
        let joined = frame(&ALL, &format!("{WEIGHT} {joints}"));
        assert!(joined.bears_as_one() && doubt(&joined).is_none());
    }

    /// What nothing holds is carried by what it touches, and all bear as one: no word that it is held
    /// by nothing.
    #[test]
    fn a_beam_that_nothing_holds_is_carried() {
        let scene = frame(&COLUMNS, WEIGHT);
        assert!(scene.bears_as_one());
        let told = |w: &&String| w.contains("nothing holds it") || w.contains("bear nothing");
        assert_eq!(scene.warnings.iter().find(told), None);
        // Nothing holds any of it: nothing bears.
        assert!(!frame(&[], WEIGHT).bears_as_one());
    }

    /// From nothing to more than what rests on it: told below half of its share, 7 kN.
    #[test]
    fn a_load_by_hand_stands_for_what_rests_on_a_column() {
        let with = |kn: f32| {
            let load = |id: &str| {
                format!(
                    "(name: \"deck {id}\", members: [\"{id}\"], action: Force(place: End, force_kn: (0, -{kn}, 0)))"
                )
            };
            let loads = format!(
                "loads: [(name: \"own\", action: SelfWeight), {}, {}],",
                load("C1"),
                load("C2")
            );
            doubt(&frame(&ALL, &loads)).is_some()
        };
        assert_eq!(
            [0.0, 2.0, 6.0, 8.0, 14.0, 200.0].map(with),
            [true, true, true, false, false, false]
        );
    }
}
