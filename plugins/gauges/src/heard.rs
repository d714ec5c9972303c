//! Which readings can be inverted, as far as the scene's file tells; and if not, why.

use intrados_scene::{
    Scene,
    structure::{Action, Measures, Reading, Test},
};

/// The id of the member that a gauge or a light meter sits on; none where nobody knows it.
#[must_use]
pub fn member_of<'s>(scene: &'s Scene, reading: &Reading) -> Option<&'s str> {
    let gauge =
        scene.structure.gauges.iter().find(|g| g.name == reading.of).map(|g| g.member.as_str());
    gauge.or_else(|| scene.meters.iter().find(|m| m.name == reading.of)?.on.as_deref())
}

/// What a reading is called: by its number, since a gauge may be read more than once.
#[must_use]
pub fn reading_name(number: usize, reading: &Reading) -> String {
    let under = reading.test.as_ref().map_or(String::new(), |test| format!(" under {test}"));
    format!("{}{under} (reading {})", reading.of, number + 1)
}

/// Why gauges on a member are not inverted; none where they are.
fn unfelt(scene: &Scene, member: &str) -> Option<String> {
    match scene.structure.assembly_of(member) {
        Some(assembly) if assembly.is_tunnel() => {
            Some("gauges on tunnel linings are not inverted".into())
        }
        Some(assembly) if assembly.body.is_some() || !assembly.steel.is_empty() => None,
        _ if scene.members.iter().any(|m| m.id == member) => Some(
            "nothing is known of the bars in it, so that gauges on it are not inverted: add reinforcement to its details".into(),
        ),
        _ => Some(format!("no member has the id \"{member}\"")),
    }
}

/// Why a load test is none that can be inverted.
pub(crate) fn improper(test: &Test) -> Option<String> {
    let acts = |a: &Action| {
        matches!(
            a,
            Action::Force { .. }
                | Action::Line { .. }
                | Action::Pressure { .. }
                | Action::SelfWeight
        )
    };
    let proper = test.actions.iter().all(acts);
    (!proper).then(|| {
        format!(
            "in load test {} something else acts than forces, lines, pressures and weight",
            test.name
        )
    })
}

/// Why a reading cannot be inverted, as far as the file tells; none where it can.
#[must_use]
pub fn refusal(scene: &Scene, reading: &Reading) -> Option<String> {
    let structure = &scene.structure;
    let Some(gauge) = structure.gauges.iter().find(|g| g.name == reading.of) else {
        return Some(match scene.meters.iter().any(|m| m.name == reading.of) {
            true => format!(
                "{} is a light meter: what light shows of a surface is not weighed as damage",
                reading.of
            ),
            false => format!("no gauge has the name \"{}\": add it to `gauges`", reading.of),
        });
    };
    if let Some(why) = unfelt(scene, &gauge.member) {
        return Some(why);
    }
    if matches!(gauge.measures, Measures::Stress(_)) {
        return Some(
            "the gauge measures stress, which no gauge on site does: give the strain that was read"
                .into(),
        );
    }
    if matches!(gauge.measures, Measures::Displacement(_)) && scene.bears_as_one() {
        return Some(
            "what moves it is the whole structure, and its own model knows its strains alone: give strains".into(),
        );
    }
    if !(reading.value.is_finite() && reading.std_error.is_finite() && reading.std_error > 0.0) {
        return Some("its value must be a number and its standard error above 0".into());
    }
    let Some(name) = &reading.test else {
        return Some(
            "it names no load test, so that creep, shrinkage and warmth are in it: describe the load test in `tests` and name it as `test`"
                .into(),
        );
    };
    match structure.tests.iter().find(|t| t.name == *name) {
        None => Some(format!("no load test has the name \"{name}\": add it to `tests`")),
        Some(test) if test.member != gauge.member => Some(format!(
            "load test {name} acts on {}, the gauge sits on {}",
            test.member, gauge.member
        )),
        Some(test) => improper(test),
    }
}

/// Whether readings may be made from the planted truth of a member: it has gauges and tests that
/// can be inverted, and nobody read them.
#[must_use]
pub fn can_simulate(scene: &Scene, member: usize) -> bool {
    let Some(member) = scene.members.get(member) else { return false };
    let structure = &scene.structure;
    let tested = structure.tests.iter().any(|t| t.member == member.id)
        && structure.gauges.iter().any(|g| g.member == member.id);
    let read = structure.readings.iter().any(|r| member_of(scene, r) == Some(&member.id));
    tested && !read && !member.truth.is_empty() && unfelt(scene, &member.id).is_none()
}
