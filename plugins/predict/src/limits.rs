//! What a prediction does not say, and what in a scene is doubtful before any work is done.

use intrados_ct::{
    source::SliceSource,
    synthetic::{drawn::MARK, scanned},
};
use intrados_damage::{
    ledger,
    verdict::{Basis, NAMED},
};
use intrados_forecast::{FORECAST, MODEL_ERROR};
use intrados_scene::{
    Assembly, Scene,
    structure::{Climate, Matter},
};

use crate::{Origin, prediction::MemberPrediction};

/// Slices of files whose own tags contradict what the scene says of their pixels: place in the
/// scene, and what they say.
#[must_use]
pub fn doubted(scene: &Scene) -> Vec<(String, String)> {
    let doubt = |slice: SliceSource| {
        Some((
            format!("slices of {}, {}", scene.members[slice.member].id, slice.core),
            slice.doubt()?,
        ))
    };
    SliceSource::all(scene).into_iter().filter_map(doubt).collect()
}

/// What a scene says of the air and of concrete that the rust of its bars does not depend on here,
/// each with the reason.
#[must_use]
pub fn unused_conditions(scene: &Scene) -> Vec<String> {
    let by_class = |a: &&Assembly| {
        a.exposure.as_ref().is_some_and(|e| {
            e.chloride.is_none() && e.classes().any(|c| c.starts_with("XC") || is_of_salt(c))
        })
    };
    let attacked: Vec<&Assembly> = scene.structure.assemblies.iter().filter(by_class).collect();
    let given = scene.structure.climate.humidity_percent;
    let mut unused = Vec::new();
    if let ([first, ..], true) =
        (&attacked[..], given.to_bits() != Climate::default().humidity_percent.to_bits())
    {
        unused.push(format!(
            "The climate's humidity of {given} % is not used for rust, because an exposure class has its own (65 % in XC1, 90 % in XC2, 75 % in XC3, 80 % in XC4; of chloride none): {}. Shrinkage and creep use it.",
            among(scene, first, attacked.len())
        ));
    }
    // EN 206-1, table F.1: the water/cement ratio, which durability goes by, ends at these classes.
    let ends: [(fn(f32) -> bool, &str, &str); 2] =
        [(|fck| fck > 35.0, ".45", "C35/45"), (|fck| fck < 25.0, ".60", "C25/30")];
    for (is_beyond, water, class) in ends {
        let beyond = |a: &&&Assembly| strength_of(&a.concrete).is_some_and(is_beyond);
        let those: Vec<&&Assembly> = attacked.iter().filter(beyond).collect();
        if let [first, ..] = those[..] {
            unused.push(format!(
                "The class of the concrete, {}, is not used for rust beyond {class}, because what is known of carbonation and chloride ends at a water/cement ratio of {water}: {}.",
                first.concrete,
                among(scene, first, those.len())
            ));
        }
    }
    unused
}

fn is_of_salt(class: &str) -> bool {
    class.starts_with("XD") || class.starts_with("XS")
}

/// f_ck of a class such as C30/37, MPa.
fn strength_of(concrete: &str) -> Option<f32> {
    let (cylinder, _) = concrete.trim().strip_prefix('C')?.split_once('/')?;
    cylinder.trim().parse().ok()
}

/// A member, and how many more.
fn among(scene: &Scene, first: &Assembly, count: usize) -> String {
    let name = scene.name_of(&first.id);
    match count {
        1 => name.to_owned(),
        2 => format!("{name} and 1 more member"),
        _ => format!("{name} and {} more members", count - 1),
    }
}

pub(crate) fn limits(
    scene: &Scene,
    members: &[MemberPrediction],
    items: &[ledger::Item],
    unraised: &[(&str, &str)],
    to_check: &[String],
    by_strength: bool,
) -> Vec<String> {
    let damage = if by_strength {
        "Damage is the share of a member's strength that what is known of it costs, computed by finite elements. Of a zone without a slice of its own the others speak as far as the grading scale's correlation lengths reach, with an error that grows."
    } else {
        "Damage is the share of strength lost in the worst zone (a tenth of the length). Of a zone without a slice of its own the others speak as far as the grading scale's correlation lengths reach, with an error that grows."
    };
    let mut limits = vec![
        damage.to_owned(),
        "Slices show pores and cracks, and where they show the whole section what has fallen off and how much of its bars is left; they do not show lost stiffness, nor what lies between them. A forecast knows of loads and chlorides, not of bad workmanship; gauges feel stiffness, not strength. The error bars allow for that by what the grading scale declares.".to_owned(),
        "The rule that turns sections into damage is the grading scale's, and is not part of the error bars.".to_owned(),
        "Cracks that run through large voids or honeycomb, or are much narrower than a third of a pixel, are missed; a gap along a bar counts as a crack.".to_owned(),
        "Forecasts are made on coarse elements; widths of cracks by a forecast are those of EN 1992-1-1, 7.3.4, where bars run along the member.".to_owned(),
    ];
    limits.extend(unused_conditions(scene));
    if scene.bears_as_one() {
        limits.push("Members hand loads on as an elastic frame of whole sections does: what cracks and hands its load to others, and what falls, is not in the forecast.".to_owned());
    }
    if members.iter().any(|m| m.capacity.is_some()) {
        limits.push(of_strength());
    }
    let not_raised =
        |(name, why): &(&str, &str)| format!("The strength of {name} was not computed: {why}.");
    limits.extend(unraised.iter().map(not_raised));
    let by_zone = members.iter().filter(|m| by_strength && m.damage.is_some() && !m.by_strength);
    let by_zone: Vec<&str> = by_zone.map(|m| m.name.as_str()).collect();
    if !by_zone.is_empty() {
        limits.insert(
            0,
            format!(
                "Not graded by strength but by the worst zone (a tenth of the length), since what they bear is not computed: {}.",
                by_zone.join(", ")
            ),
        );
    }
    let silent = members.iter().filter(|m| m.damage.is_none()).count();
    if silent > 0 {
        limits.insert(
            0,
            format!(
                "There is no evidence of {silent} of {} members: that is not the same as sound.",
                members.len()
            ),
        );
    }
    let unmeasured = members.iter().filter(|m| m.basis == Basis::Forecast).count();
    if unmeasured > 0 {
        limits.insert(
            0,
            format!(
                "Nothing was measured on {}: what is said of them is a forecast.",
                many(unmeasured)
            ),
        );
    }
    let unused = items.iter().filter(|i| !i.used).count();
    if unused > 0 {
        limits.insert(
            0,
            format!(
                "{unused} of {} items of evidence were not used; the list of evidence says why.",
                items.len()
            ),
        );
    }
    let doubts: Vec<&str> =
        members.iter().flat_map(|m| &m.slices).filter_map(|s| s.doubt.as_deref()).collect();
    if let Some(first) = doubts.first() {
        limits.insert(
            0,
            format!("Of {} slices the size of a pixel is in doubt: {first}.", doubts.len()),
        );
    }
    limits.splice(0..0, limits_of_states(members));
    let assumed_steel =
        |m: &&MemberPrediction| scene.structure.assembly_of(&m.id).is_some_and(|a| a.steel_assumed);
    let assumed = [
        ("concrete", members.iter().filter(|m| m.concrete_assumed).count()),
        ("reinforcement", members.iter().filter(assumed_steel).count()),
    ];
    for (what, count) in assumed.into_iter().filter(|(_, count)| *count > 0) {
        limits.insert(0, format!("The {what} of {count} of {} members is assumed.", members.len()));
    }
    let unpredicted = members.iter().filter(|m| m.damage.is_none() && m.truth.is_some()).count();
    if unpredicted > 0 {
        limits.insert(0, format!("The truth of {} is known but nothing was predicted; they are not part of the score.", many(unpredicted)));
    }
    let made = |origin: Origin| members.iter().flat_map(|m| &m.slices).any(|r| r.origin == origin);
    if made(Origin::Scanned) {
        limits.insert(0, format!("Some slices are {}: X-rays through the planted truth, with scatter, hardening, noise and their corrections, but with concrete of this program's making.", scanned::MARK));
    }
    if made(Origin::Drawn) {
        limits.insert(0, format!("Some slices are {MARK}: pictures made from the planted truth. Their scores show that the chain works, not how it would do in the field."));
    }
    limits.splice(0..0, to_check.iter().map(|line| format!("Check an assumption: {line}.")));
    let failing = members.iter().filter_map(|m| Some((m, m.failure.as_ref()?)));
    let failing = failing.map(|(m, end)| format!("{}: {}", m.name, end.sentence()));
    limits.splice(0..0, failing.collect::<Vec<_>>());
    limits
}

/// How strength is computed, and what that leaves out.
fn of_strength() -> String {
    format!(
        "Strength is that of mean materials as they are today (concrete gains with age), without safety factors, with bars that do not slip; zones that have lost concrete bear so much less in every direction, all zones are taken to err together, and pits of rust count as even loss. Its error bar has {:.0} % for the model.",
        100.0 * MODEL_ERROR
    )
}

/// So many members.
fn many(n: usize) -> String {
    if n == 1 { "1 member".into() } else { format!("{n} members") }
}

/// What the error bar leaves open, and what of rust is assumed or not computed.
fn limits_of_states(members: &[MemberPrediction]) -> Vec<String> {
    let told = |m: &MemberPrediction| {
        m.evidence.get(FORECAST).and_then(|e| e.details.get("rust").cloned()).unwrap_or_default()
    };
    let count = |is: &dyn Fn(&MemberPrediction) -> bool| members.iter().filter(|m| is(m)).count();
    let undecided = count(&|m| {
        m.basis == Basis::Measured && m.state_run.is_some_and(|[best, worst]| best < worst)
    });
    let unknown = count(&|m| told(m)["computed"] == false);
    let assumed = count(&|m| told(m)["assumed"].as_array().is_some_and(|a| !a.is_empty()));
    let lines = [
        (
            assumed,
            format!(
                "The forecast of rust in {} rests on values assumed for the exposure class, which stand on the pages of the members; their spread is in the error.",
                many(assumed)
            ),
        ),
        (
            unknown,
            format!(
                "Rust of bars is not computed for {} (the forecasts say why): that is not the same as none.",
                many(unknown)
            ),
        ),
        (
            undecided,
            format!(
                "The error bar leaves the state of {} open: no state has a probability of {NAMED}.",
                many(undecided)
            ),
        ),
    ];
    lines.into_iter().filter(|(n, _)| *n > 0).map(|(_, line)| line).collect()
}

/// What a member is of, for people.
pub(crate) fn of_what(concrete: &str, matter: Option<&Matter>) -> String {
    match matter {
        Some(matter) => matter.computed_as(concrete),
        None => concrete.to_owned(),
    }
}
