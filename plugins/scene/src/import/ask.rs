//! What a model's user is asked about: bodies that may bear and are no members, layers whose weight
//! is missing, members that rest on nothing.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::{
    build::Built,
    count::listed,
    ground::{Standing, reaches},
    kind::Why,
};
use crate::MemberKind;

/// A body that is no member.
#[derive(Debug, Clone)]
pub(super) struct Idle {
    pub(super) why: Why,
    pub(super) class: String,
    pub(super) name: String,
    /// m³.
    pub(super) volume: f64,
    pub(super) bounds: [DVec3; 2],
    /// What its shape is like.
    pub(super) likely: MemberKind,
}

/// Bodies below this share of all members' volume are not asked about.
const SHARE: f64 = 0.01;
/// Nor below this volume, m³.
const LEAST: f64 = 0.05;
/// How many are named with the option that says what they are.
const NAMED: usize = 3;
/// Members that rest on nothing are told from this share of all volume on.
const HANGING: f64 = 0.02;

/// What is asked.
pub(super) fn questions(built: &Built, standing: &[Standing], on_ground: &[bool]) -> Vec<String> {
    let all: f64 = built.found.iter().map(|f| f.volume).sum();
    let is_large = |i: &&Idle| i.volume > LEAST.max(SHARE * all);
    let of = |why: Why| built.idle.iter().filter(move |i| i.why == why);
    let mut notes = unknown(&of(Why::Unknown).filter(is_large).collect::<Vec<_>>());
    notes.extend(layers(
        &of(Why::Surfacing).collect::<Vec<_>>(),
        "surfacing",
        "its weight is not counted: give it in loads of scene.ron",
    ));
    notes.extend(layers(
        &of(Why::Blinding).collect::<Vec<_>>(),
        "blinding",
        "lean concrete under footings carries nothing",
    ));
    notes.extend(hanging(built, standing, on_ground, all));
    notes
}

/// Large bodies of which neither class nor name says what they are.
fn unknown(found: &[&Idle]) -> Vec<String> {
    let mut of: BTreeMap<&str, Vec<&Idle>> = BTreeMap::new();
    for idle in found {
        of.entry(if idle.class.is_empty() { "nodes" } else { &idle.class }).or_default().push(idle);
    }
    let said = |(class, mut found): (&str, Vec<&Idle>)| {
        found.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        let volume: f64 = found.iter().map(|i| i.volume).sum();
        let names = found.iter().map(|i| format!("\"{}\"", i.name)).collect::<Vec<_>>();
        let options = found.iter().take(NAMED).map(|i| {
            let kind = if i.likely == MemberKind::Other { MemberKind::Beam } else { i.likely };
            format!("--kind \"{}={}\"", i.name, super::project::word(kind))
        });
        format!(
            "{volume:.2} m³ in {} {class} ({}) are no member by class or name: they carry nothing and their load is missing; say what they are by {}, or by =none",
            found.len(),
            listed(&names),
            options.collect::<Vec<_>>().join(" ")
        )
    };
    of.into_iter().map(said).collect()
}

fn layers(found: &[&Idle], what: &str, remark: &str) -> Option<String> {
    let volume: f64 = found.iter().map(|i| i.volume).sum();
    let names = found.iter().map(|i| format!("\"{}\"", i.name)).collect::<Vec<_>>();
    (volume > 0.0).then(|| {
        format!(
            "{volume:.2} m³ of {what} ({}) are no member: {remark}; if one is, say --kind \"NAME=slab\"",
            listed(&names)
        )
    })
}

/// Members that lie on nothing that stands.
fn hanging(built: &Built, standing: &[Standing], on_ground: &[bool], all: f64) -> Option<String> {
    let is_carried =
        |m: &Standing| standing.iter().any(|other| reaches(other, m) || joins(other, m));
    let hangs = |i: &usize| !on_ground[*i] && !is_carried(&standing[*i]);
    let found: Vec<usize> = (0..standing.len()).filter(hangs).collect();
    let volume: f64 = found.iter().map(|i| built.found[*i].volume).sum();
    if volume <= HANGING * all || found.is_empty() {
        return None;
    }
    let near = |idle: &Idle, m: &Standing| {
        let [low, high] = idle.bounds.map(DVec3::as_vec3);
        let below = [low - NEAR, high + NEAR];
        below[0].cmple(m.bounds[1]).all()
            && below[1].cmpge(m.bounds[0]).all()
            && low.y < m.bounds[0].y
    };
    let between: Vec<String> = (built.idle.iter())
        .filter(|idle| found.iter().any(|i| near(idle, &standing[*i])))
        .map(|idle| format!("\"{}\"", idle.name))
        .collect();
    let names: Vec<String> =
        found.iter().map(|i| format!("\"{}\"", built.found[*i].name)).collect();
    let why = if between.is_empty() {
        "what carries them is not in the model, or no member".into()
    } else {
        format!("below them lie bodies that are no members ({})", listed(&between))
    };
    Some(format!(
        "{:.0} % of the members' volume rests on nothing ({}): {why}; join them to what carries them by joints of scene.ron, or say what that is by --kind; until then each is held for itself, and its load goes nowhere",
        100.0 * volume / all,
        listed(&names)
    ))
}

/// How near what lies between has to be, m.
const NEAR: Vec3 = Vec3::splat(0.1);

/// Whether two members touch with their sides, so that one may carry the other.
fn joins(other: &Standing, m: &Standing) -> bool {
    const SLACK: f32 = 0.05;
    let overlap = |i: usize| {
        other.bounds[0][i] < m.bounds[1][i] + SLACK && other.bounds[1][i] > m.bounds[0][i] - SLACK
    };
    !std::ptr::eq(other, m) && (0..3).all(overlap) && other.bounds[0].y < m.bounds[1].y - SLACK
}
