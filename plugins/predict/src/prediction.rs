//! What a prediction says.

use std::collections::BTreeMap;

use intrados_ct::detect;
use intrados_damage::{
    evidence::{Cause, Evidence, LifeEnd},
    grading::Profile,
    ledger,
    score::MemberScore,
    verdict::Basis,
    zone::{ZONES, Zones},
};
use intrados_forecast::Capacity;
use intrados_gauges::GaugeReading;
use intrados_scene::MemberKind;
use intrados_survey::photographed::FaceSeen;
use serde::Serialize;

use crate::{Defect, SliceReading};

/// Schema of the JSON.
pub(crate) const SCHEMA: &str = "intrados.predict/2";

/// The prediction for a scene. Serialises to `intrados.predict/2`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene and of every file it names.
    pub scene_hash: String,
    /// Members whose computed life ends: the worst findings, those first that have failed by now,
    /// then by when they fail.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<MemberFailure>,
    /// Lives that end by what was only assumed: assumptions to check, no damage. One line each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub assumptions_to_check: Vec<String>,
    /// The members, in the order of the scene.
    pub members: Vec<MemberPrediction>,
    /// How good the prediction is, over the members whose truth is known.
    pub score: MemberScore,
    /// What damage and states were derived by.
    pub profile: Profile,
    /// How slices were read.
    pub settings: detect::DetectSettings,
    /// The ledger of evidence: every item once, used or not used and why.
    pub items: Vec<ledger::Item>,
    /// Those of the items that were not used, in few words.
    pub silences: Vec<MissingEvidence>,
    /// What is doubted of the files that were read, or was assumed where they say nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
    /// What the prediction does not say.
    pub limits: Vec<String>,
}

/// A member whose computed life ends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemberFailure {
    /// Its id.
    pub member: String,
    /// Its name.
    pub name: String,
    /// In one sentence.
    pub reason: String,
    /// Years from now; 0 if it has failed by now.
    pub ahead_years: f64,
}

impl Prediction {
    /// The members, those whose computed life ends first, the others in
    /// the order of the scene.
    #[must_use]
    pub fn failing_first(&self) -> Vec<&MemberPrediction> {
        let mut members: Vec<&MemberPrediction> = self.members.iter().collect();
        members.sort_by(|a, b| a.failure_order().total_cmp(&b.failure_order()));
        members
    }

    /// What people call the member of that id; the id itself where it is of none.
    #[must_use]
    pub fn name_of<'a>(&'a self, id: &'a str) -> &'a str {
        self.members.iter().find(|m| m.id == id).map_or(id, |m| &m.name)
    }
}

/// The prediction for one member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemberPrediction {
    /// Stable id.
    pub id: String,
    /// Name.
    pub name: String,
    /// Kind.
    pub kind: MemberKind,
    /// Concrete class.
    pub concrete: String,
    /// Whether that was assumed.
    pub concrete_assumed: bool,
    /// Damage d, 0 to 1; none without evidence.
    pub damage: Option<f64>,
    /// Its standard error.
    pub damage_std_error: Option<f64>,
    /// What state it is in, as far as the error bar lets anybody say: one by the profile, *between*
    /// two, *foretold* where nothing was measured, or [`intrados_damage::grading::NO_EVIDENCE`].
    pub state: String,
    /// Probability of each state.
    pub state_probability: BTreeMap<String, f64>,
    /// The best and the worst state that it may be in, as numbers of the profile's states from 0.
    pub state_run: Option<[usize; 2]>,
    /// What that rests on.
    pub basis: Basis,
    /// The same by zone.
    pub zone_basis: [Basis; ZONES],
    /// What should be done: by the profile, or to look first.
    pub advice: String,
    /// Within how many months, by the worst state that it may be in, or as the profile wants what
    /// is to be inspected; none: nobody says.
    pub within_months: Option<u32>,
    /// Whether an inspection is all that is to be done: nothing was found on it, and what is most
    /// probable is sound.
    pub to_inspect: bool,
    /// Damage by zone, tenths of the axis from its start; none where nothing is known.
    pub zones: Zones,
    /// The same by cause.
    pub causes: BTreeMap<Cause, Zones>,
    /// The zone that counts, from 0.
    pub worst_zone: Option<usize>,
    /// Whether its damage is the share of its strength that it costs, as the profile may want, and
    /// not that of its worst zone.
    pub by_strength: bool,
    /// By state, the share of the length that is to be expected in it, of what is known; where it is
    /// graded by strength, the probability that all of it is in that state.
    pub states: BTreeMap<String, f64>,
    /// How its computed life ends, because it does not carry what acts on it: the worst finding;
    /// `None` if it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<LifeEnd>,
    /// What it bears and what its damage costs of that; none where nobody asked, or no load acts on
    /// it that could be raised.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub capacity: Option<Capacity>,
    /// The widest crack against what its exposure admits.
    pub crack_check: Option<CrackCheck>,
    /// Whether pieces of evidence contradict each other.
    pub conflict: bool,
    /// Where they do, and what each says.
    pub conflicts: Vec<String>,
    /// What was found to be wrong with it, one by one.
    pub defects: Vec<Defect>,
    /// What its gauges read, beside what a sound member would show; also where no damage explains
    /// them and they are no evidence.
    pub gauges: Vec<GaugeReading>,
    /// How much of its faces photographs show; empty where nobody took one.
    pub faces: Vec<FaceSeen>,
    /// Evidence by its source.
    pub evidence: BTreeMap<&'static str, Evidence>,
    /// Truth where it is known.
    pub truth: Option<Truth>,
    /// The slices, one by one.
    pub slices: Vec<SliceReading>,
}

impl MemberPrediction {
    /// What sorts members whose computed life ends before all others: years from now.
    #[must_use]
    pub fn failure_order(&self) -> f64 {
        self.failure.as_ref().map_or(f64::INFINITY, |end| end.ahead_years)
    }

    /// What photographs show of it and what they do not, one sentence; none where nobody took one.
    #[must_use]
    pub fn photographed(&self) -> Option<String> {
        (!self.faces.is_empty()).then(|| FaceSeen::told(&self.faces))
    }
}

/// The widest crack of a member against the profile's limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrackCheck {
    /// mm.
    pub width_mm: f64,
    /// Which evidence knows of it.
    pub source: &'static str,
    /// mm.
    pub limit_mm: f64,
    /// For which the limit holds.
    pub exposure: String,
    /// Whether it is wider.
    pub exceeded: bool,
}

/// A piece of evidence that did not come.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MissingEvidence {
    /// Id of the member or model.
    pub member: String,
    /// Which source.
    pub source: &'static str,
    /// Why, one line.
    pub why: String,
}

/// Planted or labelled damage, by the same rule as the prediction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// Damage d of the worst zone, by all that was planted; of labels, of the worst inspected
    /// section.
    pub damage: f64,
    /// By zone; none of labels.
    pub zones: Option<[f64; ZONES]>,
    /// State by the profile.
    pub state: String,
    /// Mean porosity of the inspected sections; none without.
    pub porosity: Option<f64>,
    /// Widest true crack of the inspected sections, mm.
    pub crack_width_mm: Option<f64>,
    /// `"planted"` or `"labelled"`.
    pub origin: &'static str,
    /// Planted damage that none of the slices shows, in words; it is part of `damage`.
    pub not_visible: Vec<String>,
}
