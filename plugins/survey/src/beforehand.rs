//! What can be told of observations before anything is computed.

use glam::Vec3;
use intrados_damage::zone::zone_at;
use intrados_scene::{
    Assembly, Part, SteelLine,
    structure::{Observation, Shows},
};

use crate::rust::{NO_SALT, SALT_ALONE, only_of_rust};

/// What can be told of an observation before anything is computed.
#[derive(Debug, Clone, PartialEq)]
pub enum Beforehand {
    /// Its member is of another matter, and it is read as if that were concrete; in words.
    AsConcrete(String),
    /// It will not be used, because …
    NotUsed(String),
}

/// What an observation of a member will come to, where that can be told without computing: by what
/// [`rust`](crate::rust) hears, zone by zone. None where it will be heard.
#[must_use]
pub fn beforehand(assembly: &Assembly, observation: &Observation) -> Option<Beforehand> {
    let shows = &observation.shows;
    if let Some(matter) = &assembly.matter
        && matches!(
            shows,
            Shows::Rebound { .. } | Shows::Velocity { .. } | Shows::CoreStrength { .. }
        )
    {
        let why = format!("the member is of {}, and is read as if that were concrete", matter.name);
        return Some(Beforehand::AsConcrete(why));
    }
    if !only_of_rust(shows) {
        return None;
    }
    let not_used = |why: String| Some(Beforehand::NotUsed(why));
    let is_bar = |line: &&SteelLine| line.part != Part::Tendon;
    if !assembly.steel.iter().any(|line| is_bar(&line)) {
        return not_used(match &assembly.matter {
            Some(matter) => format!("it speaks of the rust of bars, and the member is of {}", matter.name),
            None => "it speaks of the rust of bars, and none are known of the member: give reinforcement in details of the scene".into(),
        });
    }
    let Some(exposure) = &assembly.exposure else {
        return not_used("nothing says what attacks the member: give its exposure class".into());
    };
    let by_salt = exposure.chloride.is_some()
        || exposure.classes().any(|class| class.starts_with("XD") || class.starts_with("XS"));
    match shows {
        Shows::Chloride { .. } if !by_salt => {
            return not_used(NO_SALT.into());
        }
        Shows::Carbonation { .. } if !exposure.classes().any(|class| class.starts_with("XC")) => {
            return not_used(SALT_ALONE.into());
        }
        _ => {}
    }
    let [from, to] = observation.spot.along.map(|at| zone_at(f64::from(at)));
    let mut pieces = assembly.steel.iter().filter(is_bar).flat_map(|line| line.line.windows(2));
    if assembly.is_tunnel() || pieces.any(|ends| runs(assembly, ends, [from, to])) {
        return None;
    }
    not_used(
        "no bars run along the member there: give reinforcement in details of the scene".into(),
    )
}

/// Whether a piece of a bar runs along a member within these zones of it.
fn runs(assembly: &Assembly, ends: &[Vec3], [from, to]: [usize; 2]) -> bool {
    let (axis, start) = (assembly.frame.axis, assembly.frame.start);
    let [a, b] = [ends[0], ends[1]];
    let is_along = (b - a).normalize_or_zero().dot(axis.normalize_or_zero()).abs() >= 0.9;
    let zone = |p: glam::Vec3| {
        zone_at(f64::from((p - start).dot(axis) / axis.length_squared().max(1e-12)))
    };
    let (one, other) = (zone(a), zone(b));
    is_along && one.min(other) <= to && one.max(other) >= from
}
