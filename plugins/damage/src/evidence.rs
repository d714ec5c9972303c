//! Evidence: what one physics says of one member. The kinds that the program brings are `ct`,
//! `gauges` and `forecast`; whoever has another is an [`EvidenceSource`].

use std::{collections::BTreeMap, fmt, sync::Arc};

use bevy_app::App;
use bevy_ecs::{component::Component, resource::Resource};
use intrados_scene::Scene;
use intrados_stage::{Estimate, Job};
use serde::{Deserialize, Serialize};

use crate::{
    error::EvidenceError,
    zone::{ZONES, Zones},
};

/// What a member loses strength by. Each physics speaks of some causes; what is lost by several is
/// lost together, 1 − Π(1 − d).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Pores, cracks and crushing: of a section the share that carries nothing.
    Concrete,
    /// Stiffness that is lost without a trace in a section.
    Stiffness,
    /// Bars and tendons: the share of their section that rust has taken.
    Steel,
}

impl Cause {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Concrete, Self::Stiffness, Self::Steel];

    /// Its name, for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Concrete => "concrete",
            Self::Stiffness => "stiffness",
            Self::Steel => "steel",
        }
    }
}

/// What people call a source of evidence.
#[must_use]
pub fn called(source: &str) -> &str {
    match source {
        "ct" => "CT",
        "gauges" => "strain gauges",
        "photographed" => "photographs",
        other => other,
    }
}

/// How what was seen in places stands for a zone.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Stands {
    /// The part of the zone's standard error that lies between the place and the rest of its zone:
    /// nobody who speaks of the place knows of it.
    pub between: f64,
    /// Where the zone was estimated from other places: the standard deviation about nothing that
    /// damage was given beforehand, and which is in the estimate.
    pub prior: Option<f64>,
}

/// A computed life that ends: the member does not carry what acts on it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LifeEnd {
    /// Age of the member then, years.
    pub age_years: f64,
    /// Years from now; 0 if its life has ended before.
    pub ahead_years: f64,
    /// Why, one line.
    pub why: String,
    /// What the computation rests on that was only assumed; empty if all of it is stated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumed: Vec<String>,
}

impl LifeEnd {
    /// One sentence for people, which names what was assumed.
    #[must_use]
    pub fn sentence(&self) -> String {
        let when = match (self.age_years, self.ahead_years) {
            (_, ahead) if ahead > 0.0 => {
                format!(
                    "fails in year {:.0} of its life, {ahead:.0} years from now",
                    self.age_years
                )
            }
            (age, _) if age < 2.0 => format!("fails on day {:.0} of its life", 365.25 * age),
            (age, _) => format!("fails in year {age:.0} of its life"),
        };
        let assumed = match self.assumed.is_empty() {
            true => String::new(),
            false => format!(" (its {} only assumed)", self.are_assumed()),
        };
        format!("By computation it {when}{assumed}: {}", self.why)
    }

    fn are_assumed(&self) -> String {
        let verb = if self.assumed.len() == 1 { "is" } else { "are" };
        format!("{} {verb}", self.assumed.join(" and "))
    }
}

/// What one physics says of one member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Which physics: one word, unique in the program.
    #[serde(skip)]
    pub source: &'static str,
    /// Damage d of the worst zone, 0 to 1.
    pub damage: f64,
    /// Its standard error, without what this physics is blind to.
    pub std_error: f64,
    /// By cause and zone; `None` where it did not look.
    pub zones: BTreeMap<Cause, Zones>,
    /// By cause and zone, how it stands for all of the zone; empty where it looked at all of it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub stands: BTreeMap<Cause, [Stands; ZONES]>,
    /// Causes, and the sources whose word on them is in it already and must not count twice.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub includes: Vec<(Cause, String)>,
    /// Pairs of causes of which it cannot tell the second from the first: what it says of the first
    /// is by both, and what is known of the second is taken out of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mixed: Vec<(Cause, Cause)>,
    /// Whether it was measured on the member, and not foretold.
    pub measured: bool,
    /// What it rests on, one line for people.
    pub basis: String,
    /// Widest crack that it knows of, mm.
    pub crack_width_mm: Option<f64>,
    /// How its computed life ends; `None` if it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<LifeEnd>,
    /// Further numbers, for scripts.
    pub details: serde_json::Map<String, serde_json::Value>,
}

impl Evidence {
    /// Evidence; `None` if it looked nowhere.
    #[must_use]
    pub fn new(
        source: &'static str,
        measured: bool,
        zones: BTreeMap<Cause, Zones>,
        basis: String,
    ) -> Option<Self> {
        let all =
            Zones(std::array::from_fn(|zone| all_causes(zones.values().filter_map(|z| z.0[zone]))));
        let (_, Estimate { value, std_error }) = all.worst()?;
        let details = serde_json::Map::new();
        Some(Self {
            source,
            damage: value,
            std_error,
            zones,
            stands: BTreeMap::new(),
            includes: Vec::new(),
            mixed: Vec::new(),
            measured,
            basis,
            crack_width_mm: None,
            failure: None,
            details,
        })
    }

    /// What keeps it from being weighed; none where nothing does.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        let is_number = |r: &Estimate| {
            (0.0..=1.0).contains(&r.value) && r.std_error.is_finite() && r.std_error >= 0.0
        };
        let wrong = self.zones.values().flat_map(|z| &z.0).flatten().find(|r| !is_number(r))?;
        Some(format!(
            "it says d = {} ± {}: damage is a number from 0 to 1, its error one from 0 on",
            wrong.value, wrong.std_error
        ))
    }

    /// Damage of every zone by all causes that it speaks of.
    #[must_use]
    pub fn by_zone(&self) -> Zones {
        Zones(std::array::from_fn(|zone| all_causes(self.zones.values().filter_map(|z| z.0[zone]))))
    }
}

/// Evidence as it is kept between two runs; its source is known to whoever keeps it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    evidence: Evidence,
    /// JSON: of numbers whose types nobody says, RON does not keep every bit.
    details: String,
}

impl Kept {
    /// None if its details are no JSON.
    #[must_use]
    pub fn of(evidence: &Evidence) -> Option<Self> {
        let details = serde_json::to_string(&evidence.details).ok()?;
        Some(Self {
            evidence: Evidence { details: serde_json::Map::new(), ..evidence.clone() },
            details,
        })
    }

    /// What was kept, of the source that it was of; none if it is damaged.
    #[must_use]
    pub fn again(self, source: &'static str) -> Option<Evidence> {
        Some(Evidence {
            source,
            details: serde_json::from_str(&self.details).ok()?,
            ..self.evidence
        })
    }
}

/// What is lost by several causes together, 1 − Π(1 − d), with its error to first order; `None` of
/// none.
pub fn all_causes(causes: impl Iterator<Item = Estimate>) -> Option<Estimate> {
    let causes: Vec<Estimate> = causes.collect();
    if let [one] = causes[..] {
        return Some(one);
    }
    let left = |skip: usize| {
        causes
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != skip)
            .map(|(_, c)| 1.0 - c.value.clamp(0.0, 1.0))
            .product::<f64>()
    };
    let variance: f64 =
        causes.iter().enumerate().map(|(i, c)| (left(i) * c.std_error).powi(2)).sum();
    (!causes.is_empty())
        .then(|| Estimate { value: 1.0 - left(usize::MAX), std_error: variance.sqrt() })
}

/// What a source says of a member.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    /// What follows from its items; none where nothing does.
    pub evidence: Option<Evidence>,
    /// Of its items, by their number, those that count for nothing, and why.
    pub unused: BTreeMap<usize, String>,
}

/// Whoever brings evidence besides slices, gauges and forecast: what an outside plugin implements
/// and [adds](AddEvidence). Its work is a piece of the one queue that predicts, in the window and
/// on the command line, and its items stand in the ledger with all others.
pub trait EvidenceSource: fmt::Debug + Send + Sync {
    /// Its name: one word, unique in the program.
    fn name(&self) -> &'static str;

    /// The items that it has of member `index`, as the ledger is to name them; none where it has
    /// nothing to say. Asked before any work is done.
    fn items(&self, scene: &Scene, index: usize) -> Vec<String>;

    /// What they say of it. Asked only where there are items.
    ///
    /// # Errors
    /// None of the items can be used, and why; or the job was cancelled.
    fn evidence(&self, scene: &Scene, index: usize, job: &Job) -> Result<Said, EvidenceError>;
}

/// All sources of evidence but the program's own.
#[derive(Resource, Debug, Clone, Default)]
pub struct Sources(pub Vec<Arc<dyn EvidenceSource>>);

/// Adds sources of evidence to an [`App`].
pub trait AddEvidence {
    /// Adds a source.
    fn add_evidence(&mut self, source: impl EvidenceSource + 'static) -> &mut Self;
}

impl AddEvidence for App {
    fn add_evidence(&mut self, source: impl EvidenceSource + 'static) -> &mut Self {
        self.world_mut().get_resource_or_init::<Sources>().0.push(Arc::new(source));
        self
    }
}

/// Everything said of one member so far; on the member's entity, for whoever shows it.
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct AllEvidence(Vec<Evidence>);

impl AllEvidence {
    /// Adds evidence, in the place of what the same source said before.
    pub fn put(&mut self, evidence: Evidence) {
        self.0.retain(|e| e.source != evidence.source);
        self.0.push(evidence);
        self.0.sort_by_key(|e| e.source);
    }

    /// All of it, in the order of the sources' names.
    #[must_use]
    pub fn list(&self) -> &[Evidence] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_speaks_once() {
        let says = |source, value| {
            let zones = [(Cause::Concrete, Zones::all(Estimate { value, std_error: 0.1 }))];
            Evidence::new(source, true, zones.into(), String::new()).unwrap()
        };
        let mut all = AllEvidence::default();
        [says("ct", 0.1), says("gauges", 0.2), says("ct", 0.3)]
            .into_iter()
            .for_each(|e| all.put(e));
        assert_eq!(
            all.list().iter().map(|e| (e.source, e.damage)).collect::<Vec<_>>(),
            [("ct", 0.3), ("gauges", 0.2)]
        );
        assert_eq!(Evidence::new("gauges", true, BTreeMap::new(), String::new()), None);
    }

    /// RON as the parts of a run are kept in.
    #[test]
    fn what_is_kept_comes_again_bit_by_bit() {
        let zones =
            [(Cause::Stiffness, Zones::all(Estimate { value: 0.1 + 0.2, std_error: 1.0 / 3.0 }))];
        let mut evidence =
            Evidence::new("gauges", true, zones.into(), "four readings".into()).unwrap();
        evidence.details.insert("chi2".into(), (0.1_f64 + 0.7).into());
        evidence
            .details
            .insert("worst".into(), serde_json::json!({ "value": 1e-300, "of": [0.1_f32, 7] }));
        let text = ron::to_string(&Kept::of(&evidence).unwrap()).unwrap();
        assert_eq!(ron::from_str::<Kept>(&text).unwrap().again("gauges"), Some(evidence));
    }

    /// Half and half leave a quarter; errors .1 and .2, each weighted by what the other leaves: .05
    /// and .1.
    #[test]
    fn causes_add_up() {
        let of = |value, std_error| Estimate { value, std_error };
        let both = all_causes([of(0.5, 0.1), of(0.5, 0.2)].into_iter()).unwrap();
        assert!(
            (both.value - 0.75).abs() < 1e-12 && (both.std_error - 0.0125_f64.sqrt()).abs() < 1e-12
        );
        assert_eq!(all_causes(std::iter::empty()), None);
    }
}
