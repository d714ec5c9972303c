//! What instruments, cores and eyes say of a member: cover meter, rebound hammer, ultrasound,
//! strength of cores, half-cell, chloride, carbonation, sounding, and what an inspector saw.
//!
//! Whatever speaks of *rust* weighs all that the exposure class leaves open ([`rust`]): the
//! posterior of one model of corrosion, so that cover, front, potential and crack are not four
//! opinions but one. What speaks of *concrete* and its *stiffness* is compared with what its class
//! promises ([`strength`]) or taken by its size ([`findings`]). Every likelihood is a curve with a
//! source, none a threshold; what no source of ours gives is marked *ours*.
//!
//! A reading stands for its zone, and for others the less the farther they are: its likelihood is
//! raised to the power exp(−r/L), L the profile's length along which damage is alike (power prior,
//! Ibrahim and Chen 2000).

use std::collections::{BTreeMap, BTreeSet};

use intrados_damage::{
    evidence::{Cause, Evidence},
    grading::Profile,
    reach::{Field, Word},
    zone::{ZONES, Zones, middle, place, zone_at},
};
use intrados_forecast::{self as forecast, FORECAST, ForecastError};
use intrados_scene::{
    Scene,
    structure::{Date, Observation},
};
use intrados_stage::{Cancelled, Estimate, Job, time::DAY};
use serde_json::json;

use crate::{
    again::is_superseded,
    findings,
    photographed::PHOTOGRAPHED,
    rust,
    site::{ByZone, Placed, Site},
    strength,
};

/// The source name of what instruments and eyes say.
pub const SURVEY: &str = "survey";

/// What came of the observations of a member.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surveyed {
    /// What they say together; none where nothing does.
    pub evidence: Option<Evidence>,
    /// Those that count for nothing, by their number in the structure, and why.
    pub unused: BTreeMap<usize, String>,
}

/// What an observation is called, unique within its member.
#[must_use]
pub fn name(observation: &Observation) -> String {
    format!("{} ({})", observation.name, observation.shows.kind())
}

/// Reads all observations of a member: those of the scene, and those that were made of photographs,
/// which are numbered after them.
///
/// # Errors
/// The job was cancelled.
pub fn surveyed(
    scene: &Scene,
    index: usize,
    photographed: &[Observation],
    profile: &Profile,
    job: &Job,
) -> Result<Surveyed, ForecastError> {
    let member = &scene.members[index];
    let mut all: Vec<(usize, &Observation)> = of_member(scene, &member.id).collect();
    let source = if all.is_empty() { PHOTOGRAPHED } else { SURVEY };
    all.extend((scene.structure.observations.len()..).zip(photographed));
    let mut said = Said::default();
    said.unused.extend(all.iter().filter_map(|(number, o)| Some((*number, refusal(o)?))));
    let placed = placed(&all);
    let mut site = Site::new(scene, index);
    if placed.iter().any(|p| rust::speaks(p.shows)) {
        let model = scene.structure.assembly_of(&member.id).map_or(&member.id, |a| &a.id);
        match forecast::bars_of(scene, model, &profile.rule, job) {
            Ok(known) => site.take(known, &member.id),
            Err(ForecastError::Cancelled) => return Err(ForecastError::Cancelled),
            Err(why) => site.corrosion = Err(why.to_string()),
        }
    }
    let steel = rust::Weighed::new(&site, &placed, profile, &mut said.unused, job)?;
    said.zones.extend(steel.zones());
    let concrete = strength::Concrete::of(scene, index);
    let stiffness = shrunk(&strength::stiffness(&concrete, &placed), Cause::Stiffness, profile);
    said.put(Cause::Stiffness, &stiffness, profile, &site);
    let strengths = shrunk(&strength::strength(&concrete, &placed), Cause::Concrete, profile);
    // Of what was found again the latest counts.
    let seen: Vec<&Observation> = all.iter().map(|(_, o)| *o).collect();
    let is_old = is_superseded(&seen, site.length);
    let old: BTreeSet<usize> =
        all.iter().zip(is_old).filter(|(_, old)| *old).map(|((number, _), _)| *number).collect();
    let is_current = |p: &&Placed| !old.contains(&p.number);
    let current: Vec<Placed> = placed.iter().filter(is_current).map(|p| Placed { ..*p }).collect();
    let findings = findings::lost(&site, &current, &profile.rule);
    said.put(Cause::Concrete, &together(&strengths, &findings), profile, &site);
    let heard = |p: &&Placed| !said.unused.contains_key(&p.number);
    let used: Vec<&Placed> = placed.iter().filter(heard).collect();
    let Some(mut evidence) = said.evidence(source, basis(&used, &steel)) else {
        let why = "nothing of it speaks of damage";
        let all = placed.iter().map(|p| (p.number, why.to_owned()));
        let mut unused: BTreeMap<usize, String> = all.collect();
        unused.extend(said.unused);
        return Ok(Surveyed { evidence: None, unused });
    };
    evidence.crack_width_mm = findings::widest(&current);
    if let serde_json::Value::Object(details) = json!({
        "observations": used.len(),
        "rust": steel.details(&site, &all, job)?,
        "rust_before_the_last_inspection": before_the_last(&site, &placed, profile, job)?,
    }) {
        evidence.details = details;
    }
    Ok(Surveyed { evidence: Some(evidence), unused: said.unused })
}

/// The observations of a member, with their numbers in the structure.
pub fn of_member<'a>(
    scene: &'a Scene,
    member: &'a str,
) -> impl Iterator<Item = (usize, &'a Observation)> {
    scene.structure.observations.iter().enumerate().filter(move |(_, o)| o.member == member)
}

/// The share of steel that was taken for lost, in the worst zone and as of now, before what was
/// found last: what has changed since. None of one date alone.
fn before_the_last(
    site: &Site,
    placed: &[Placed],
    profile: &Profile,
    job: &Job,
) -> Result<Option<Estimate>, Cancelled> {
    let earlier: Vec<Placed> =
        placed.iter().filter(|p| p.before > 0.0).map(|p| Placed { ..*p }).collect();
    if earlier.is_empty() {
        return Ok(None);
    }
    let weighed = rust::Weighed::new(site, &earlier, profile, &mut BTreeMap::new(), job)?;
    Ok(weighed.zones().and_then(|(_, zones)| zones.worst()).map(|(_, lost)| lost))
}

/// Where and how long before the last each was made. Without a date it is as of the last.
fn placed<'a>(all: &[(usize, &'a Observation)]) -> Vec<Placed<'a>> {
    let last: Option<Date> = all.iter().filter_map(|(_, o)| o.date).max();
    let days = |o: &Observation| Some(o.date?.days_until(last?).max(0) as f64);
    let one = |(number, o): &(usize, &'a Observation)| {
        let zone = |along: f32| zone_at(f64::from(along));
        Placed {
            number: *number,
            shows: &o.shows,
            zones: o.spot.along.map(zone),
            before: days(o).unwrap_or(0.0) * DAY,
            face: o.spot.angle_deg.map(|deg| ((deg / 90.0).round() as i32).rem_euclid(4) as u8),
        }
    };
    all.iter().filter(|(_, o)| refusal(o).is_none()).map(one).collect()
}

/// Why an observation cannot be weighed, before anything is computed: an eye goes over all of a
/// member, but an instrument is held to one place.
#[must_use]
pub fn refusal(observation: &Observation) -> Option<String> {
    let is_somewhere = observation.spot.is_placed() || findings::is_seen(&observation.shows);
    (!is_somewhere)
        .then(|| "nobody says where on the member it was made: add along (0 to 1)".into())
}

/// Strength that was lost and what has come off or cracked, 1 − Π(1 − d). Where nobody measured
/// strength, what an eye finds says nothing of it; where nobody looked, what is lost outside is not
/// known either.
fn together(strengths: &ByZone, findings: &ByZone) -> ByZone {
    /// Of concrete of its class, what eyes and hammers miss (ours).
    const HIDDEN: Estimate = Estimate { value: 0.0, std_error: 0.15 };
    std::array::from_fn(|zone| match (strengths[zone], findings[zone]) {
        (None, None) => None,
        (a, b) => intrados_damage::evidence::all_causes(
            [a.unwrap_or(HIDDEN), b.unwrap_or(HIDDEN)].into_iter(),
        ),
    })
}

/// What instruments say of a cause, of which one that says less than what was expected beforehand
/// counts by its share of that (Bayes, normal about nothing).
pub(crate) fn shrunk(said: &ByZone, cause: Cause, profile: &Profile) -> ByZone {
    let prior = Field::of(profile, cause, 1.0).sd;
    said.map(|reading| {
        let Estimate { value, std_error } = reading?;
        if std_error <= prior {
            return reading;
        }
        let share = prior.powi(2) / (prior.powi(2) + std_error.powi(2));
        Some(Estimate { value: share * value, std_error: share.sqrt() * std_error })
    })
}

/// What is said so far.
#[derive(Default)]
pub(crate) struct Said {
    zones: BTreeMap<Cause, Zones>,
    stands: BTreeMap<Cause, [intrados_damage::evidence::Stands; ZONES]>,
    unused: BTreeMap<usize, String>,
}

impl Said {
    /// What is said of a cause in some zones, spread along the member.
    pub(crate) fn put(&mut self, cause: Cause, said: &ByZone, profile: &Profile, site: &Site) {
        let field = Field::of(profile, cause, site.length);
        // What was found counts in full: it must not leave its zone less known than before, but
        // being hard to tell makes it no smaller.
        let capped =
            |reading: Estimate| Estimate { std_error: reading.std_error.min(field.sd), ..reading };
        let word = |(zone, reading): (usize, &Option<Estimate>)| {
            Some(Word { along: Some(middle(zone)), reading: capped((*reading)?), core: zone })
        };
        let words: Vec<Word> = said.iter().enumerate().filter_map(word).collect();
        if words.is_empty() {
            return;
        }
        self.zones.insert(cause, field.zones(&words));
        self.stands.insert(cause, field.stands(&words));
    }

    pub(crate) fn evidence(&mut self, source: &'static str, basis: String) -> Option<Evidence> {
        let mut zones = std::mem::take(&mut self.zones);
        zones.retain(|_, zones| zones.worst().is_some());
        let mut evidence = Evidence::new(source, true, zones, basis)?;
        evidence.stands = std::mem::take(&mut self.stands);
        if evidence.zones.contains_key(&Cause::Steel) {
            evidence.includes = vec![(Cause::Steel, FORECAST.to_owned())];
        }
        // A pulse is slow in pores, too.
        if evidence.zones.contains_key(&Cause::Stiffness) {
            evidence.mixed = vec![(Cause::Stiffness, Cause::Concrete)];
        }
        Some(evidence)
    }
}

/// One line for people.
fn basis(used: &[&Placed], steel: &rust::Weighed) -> String {
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    used.iter().for_each(|p| *kinds.entry(p.shows.kind()).or_default() += 1);
    let list: Vec<String> = kinds
        .iter()
        .map(|(kind, n)| if *n == 1 { (*kind).to_owned() } else { format!("{n} × {kind}") })
        .collect();
    let noun = if used.len() == 1 { "observation" } else { "observations" };
    let mut text = format!("{} {noun} ({})", used.len(), list.join(", "));
    if let Some((zone, active)) = steel.worst() {
        text += &format!(
            "; bars rust with a probability of {:.0} % at {} of the axis",
            100.0 * active,
            place(zone)
        );
    }
    for surprise in steel.surprises() {
        text += &format!("; {surprise}");
    }
    if let Some(power) = steel.tempered() {
        text += &format!(
            "; together they are hardly possible by the exposure class, and count by a power of {power:.2}"
        );
    }
    text
}
