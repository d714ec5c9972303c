//! *Forecast*: what load, creep, shrinkage and chlorides have done to a member by now, and will
//! have done some years on, by its life in finite elements.
//!
//! A section's damage is the share of its strength that is lost, by three causes together, 1 − Π(1
//! − d): cracks (share of the section that is cracked, weighted by the opening as those that are
//! seen are), concrete crushed beyond its peak, and steel lost to rust. A zone has the damage of
//! its worst section. Rust is the mean over all that the exposure class leaves open
//! (`intrados_mechanics::material::durability`), with its spread; where nothing is computed,
//! nothing is said of steel. What nobody has written into the scene (bad compaction, impact, a
//! leaking joint) no forecast knows.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};
use intrados_damage::{
    evidence::{Cause, Evidence, LifeEnd},
    grading::GradingRule,
    zone::{ZONES, Zones, place, together, zone_at},
};
use intrados_mechanics::{
    analysis::{MemberOutcome, Observer, analyze},
    element::rod::Piece,
    material::{
        concrete::{Class, secant_modulus, tensile_strength},
        durability::{Bars, Corrosion, CorrosionError, Lost},
    },
    member::{
        ElasticMatter, Handed, Meshing, Part, Prepared, elastic, largest_element, prepare_within,
    },
    model::{
        Failure, Gauge, History, MarchSettings, Point, Steel, SteelKind, Step, System, past_peak,
    },
    tensor::Principal,
};
use intrados_scene::{
    Assembly, Frame, MemberKind, Scene,
    structure::{Action, Body},
};
use intrados_stage::{
    Cancelled, Estimate, Job,
    time::{DAY, YEAR},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::{GaugeCourse, Tie, crack_width, width::E_STEEL};

/// The source name of evidence from the life in finite elements.
pub const FORECAST: &str = "forecast";

/// Bricks of a member: a forecast of seconds, not of minutes.
const BRICKS: f64 = 150.0;
/// Least edge of a brick as a share of the section's smallest measure.
const FINEST: f64 = 0.3;
/// Edge of the largest brick as a share of what its concrete's fracture energy allows.
const LARGEST: f64 = 0.9;
/// Tensile damage from which a brick's point counts as cracked.
const CRACKED: f64 = 0.5;
/// Characteristic strength where the class says nothing, Pa.
const ASSUMED: f64 = 30e6;
/// Cracks narrower than this are none, mm.
const LEAST_MM: f64 = 0.01;
/// Damage that differs by less is alike, and so are times apart by less than this share of a life.
const ALIKE: f64 = 0.01;
const MOMENT: f64 = 1.0 / 32.0;
/// Sectors of a lining's ring: its sections are those of its wall.
const SECTORS: f64 = 12.0;

/// How to forecast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ForecastSettings {
    /// Years from now on.
    pub ahead_years: f64,
    /// Edge of elements, m; none: some 150 to a member.
    pub element_m: Option<f64>,
    /// The most work of a life, as [`MarchSettings::work`] counts it; none: all it takes.
    pub work: Option<f64>,
}

impl Default for ForecastSettings {
    fn default() -> Self {
        Self { ahead_years: 20.0, element_m: None, work: None }
    }
}

/// What is foretold of one zone: of its worst section.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Foretold {
    /// Share of a section that is cracked, 0 to 1.
    pub cracked: f64,
    /// Widest crack, mm.
    pub crack_mm: f64,
    /// Share of a section that is crushed, or of elastic matter stressed beyond its strength, 0 to 1.
    pub crushed: f64,
    /// Share of the bars' section lost to rust, 0 to 1; none where no bar runs or rust is not
    /// computed.
    pub steel_lost: Option<f64>,
    /// Its standard error from what was assumed; 0 where all was given.
    pub steel_lost_std_error: f64,
    /// Damage of concrete: cracks and crushing.
    pub concrete: f64,
    /// Damage d of all that.
    pub damage: f64,
}

/// What is known of the rust of a member.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Rust {
    /// Whether it was computed.
    pub computed: bool,
    /// If not, why.
    pub why_not: Option<String>,
    /// What takes the skin of steel: chloride or carbonation.
    pub attack: Option<String>,
    /// What was assumed, and whose values these are; empty where the scene gives all.
    pub assumed: Vec<String>,
    /// Least cover of a bar, mm.
    pub cover_mm: Option<f64>,
    /// When steel there begins to rust, by the means of what was assumed, years after the attack
    /// began; none: within a thousand years never.
    pub depassivation_years: Option<f64>,
    /// Probability that it has begun by now.
    pub probability_depassivated: f64,
}

impl Rust {
    fn not_computed(why: &CorrosionError) -> Self {
        Self { why_not: Some(why.to_string()), ..Self::default() }
    }

    fn of(corrosion: &Corrosion, bars: &[Vec<Bars>; ZONES], age: f64) -> Self {
        let Some(least) = bars.iter().flatten().copied().min_by(|a, b| a.cover.total_cmp(&b.cover))
        else {
            return Self::not_computed(&CorrosionError::NoBars);
        };
        let years = corrosion.initiation(least.cover.max(0.0)) / YEAR;
        Self {
            computed: true,
            why_not: None,
            attack: Some(corrosion.attack.name().to_owned()),
            assumed: corrosion.assumed.clone(),
            cover_mm: Some(1e3 * least.cover),
            depassivation_years: (years < 1000.0).then_some(years),
            probability_depassivated: corrosion.lost(&[least], age).depassivated,
        }
    }

    /// One line for people; `lost`: share of the bars with its error, where it was computed.
    fn says(&self, lost: Option<Estimate>) -> String {
        let (Some(attack), Some(lost)) = (self.attack.as_deref(), lost) else {
            return format!(
                "rust of bars not computed: {}",
                self.why_not.as_deref().unwrap_or("no bar runs there")
            );
        };
        let share = format!(
            "({:.0} ± {:.0}) % of its bars rusted away",
            100.0 * lost.value,
            100.0 * lost.std_error
        );
        match self.assumed.is_empty() {
            true => format!("{share} ({attack})"),
            false => format!("{share} ({attack} by values assumed for the exposure class)"),
        }
    }
}

/// How an elastic matter is stressed through its life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stressed {
    /// What people call the matter.
    pub matter: String,
    /// Largest principal stress, of either sign, Pa.
    pub peak_pa: f64,
    /// Characteristic strength, Pa.
    pub strength_pa: f64,
}

impl Stressed {
    /// Why a life that nothing has happened in is no evidence.
    #[must_use]
    pub fn told(&self) -> String {
        format!(
            "of {}, computed as elastic: it is stressed to {:.2} of the {:.1} MPa that it bears, which tells nothing of its decay, fatigue and joints",
            self.matter,
            self.peak_pa / 1e6,
            self.strength_pa / 1e6
        )
    }
}

/// What a life had come to at one of its equilibria.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Passed {
    /// Years since the life began.
    pub years: f64,
    /// Damage d of the zones, rust in it where it is computed.
    pub damage: [f64; ZONES],
}

/// The future of one member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Forecast {
    /// Its id.
    pub id: String,
    /// How it comes to that: equilibria that were computed, in order of time, those left out that
    /// hardly differ from one that is told.
    #[serde(default)]
    pub course: Vec<Passed>,
    /// Now.
    pub now: [Foretold; ZONES],
    /// `ahead_years` on; none: the member does not get that far.
    pub later: Option<[Foretold; ZONES]>,
    /// Years from now to `later`.
    pub ahead_years: f64,
    /// Age now, years.
    pub age_years: f64,
    /// What is known of its rust.
    pub rust: Rust,
    /// Of elastic matter: how it is stressed; none of concrete.
    #[serde(default)]
    pub elastic: Option<Stressed>,
    /// Largest compression of concrete, Pa (negative).
    pub peak_compression_pa: f64,
    /// Largest stress of a bar, Pa.
    pub peak_bar_pa: f64,
    /// Largest stress of a tendon, Pa.
    pub peak_tendon_pa: Option<f64>,
    /// Unknowns.
    pub dof: usize,
    /// What assumed concrete and reinforcement add to the relative error; 0 where they are stated.
    #[serde(default)]
    pub assumed_error: f64,
    /// What its monitored gauges would show through its life.
    #[serde(default)]
    pub gauges: Vec<GaugeCourse>,
    /// Why its life ended early; empty if it did not.
    pub complaint: String,
    /// How its life ends, if it does because it does not carry what acts on it.
    #[serde(default)]
    pub failure: Option<LifeEnd>,
    /// Assumptions.
    pub notes: Vec<String>,
}

/// Why nothing can be foretold.
#[derive(Debug, thiserror::Error)]
pub enum ForecastError {
    /// Somebody asked to stop.
    #[error("cancelled")]
    Cancelled,
    /// Why, one line.
    #[error("{0}")]
    Because(String),
    /// It fails under its own weight, with reinforcement or concrete that was only assumed: an
    /// assumption to check, and no damage. One line.
    #[error("{0}")]
    Assumed(String),
    /// It does not carry what acts on it. One line.
    #[error("{0}")]
    Fails(String),
}

impl From<Cancelled> for ForecastError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Ids of the assemblies of a scene whose life can be foretold: those described by measures, and
/// those of models that something holds: a support, or others.
#[must_use]
pub fn models(scene: &Scene) -> Vec<String> {
    let structure = &scene.structure;
    let as_one = scene.bears_as_one();
    let is_held = |id: &str| structure.is_held(id) || as_one;
    structure
        .assemblies
        .iter()
        .filter(|a| a.body.is_some() || is_held(&a.id))
        .map(|a| a.id.clone())
        .collect()
}

/// The members of one model, through their life and on; as part of a structure, by what the rest
/// of it hands on.
///
/// # Errors
/// The model cannot be computed, or never was in equilibrium; or the job was cancelled.
pub fn forecast(
    scene: &Scene,
    model: &str,
    handed: Option<&Handed>,
    rule: &GradingRule,
    settings: ForecastSettings,
    job: &Job,
) -> Result<Vec<Forecast>, ForecastError> {
    let mut prepared = prepared(scene, model, handed, settings, job)?;
    let now = prepared.times.last().copied().unwrap_or(0.0);
    prepared.times.push(now + settings.ahead_years * YEAR);
    let mut watch = Watch::new(scene, &prepared, rule, now, job);
    // Solvers would report shares of their own: how far the life is, its times tell.
    let march =
        MarchSettings { work: settings.work.unwrap_or(f64::INFINITY), ..MarchSettings::of_life() };
    let assumed = what_is_assumed(scene, model);
    let carries_others = is_loaded(scene, model, |action| *action != Action::SelfWeight);
    let is_assumption = !assumed.is_empty() && !carries_others;
    let is_loaded = is_loaded(scene, model, |_| true);
    let (outcome, _) = match analyze(&prepared, march, &job.part(0.0, 0.0), &mut watch) {
        Ok(outcome) => outcome,
        Err(why) if is_failure_at_once(&why) && !is_assumption && is_loaded => {
            let failure = never_in_equilibrium(&why, assumed);
            return Ok(watch.fail_at_once(scene, model, failure));
        }
        Err(why) if is_failure_at_once(&why) && is_assumption => {
            return Err(ForecastError::Assumed(check_assumption(&never_in_equilibrium(
                &why, assumed,
            ))));
        }
        Err(why) => return Err(failed(&why, job)),
    };
    outcome.warnings.iter().for_each(|w| tracing::warn!("{model}: {w}"));
    let gauges = std::mem::take(&mut watch.courses);
    let reached =
        outcome.steps.iter().rev().find(|s| s.residual.is_finite()).map_or(0.0, |s| s.time_s);
    let is_late = reached < now - 60.0;
    let is_laborious = outcome.complaint == Failure::Laborious.to_string();
    if is_late && is_laborious {
        return Err(ForecastError::Because(format!(
            "its life ends after {:.0} days: {}",
            reached / DAY,
            outcome.complaint
        )));
    }
    let failure = (!outcome.complaint.is_empty() && !is_laborious).then(|| LifeEnd {
        age_years: reached.max(0.0) / YEAR,
        ahead_years: ((reached - now) / YEAR).max(0.0),
        why: outcome.complaint.clone(),
        assumed: assumed.clone(),
    });
    let failure = match failure {
        Some(end) if is_assumption => {
            let why = check_assumption(&end);
            if is_late {
                return Err(ForecastError::Assumed(why));
            }
            tracing::warn!("{model}: {why}");
            None
        }
        other => other,
    };
    let tendon = |m: &MemberOutcome| m.tendons.iter().map(|t| t.peak_stress_pa).reduce(f64::max);
    // Rust depends on time alone, so that only now and the end are looked at.
    let rust: Vec<Rust> =
        (0..watch.parts.len()).map(|part| watch.corrode(part, now, reached)).collect();
    let told =
        outcome.members.iter().zip(watch.parts).zip(rust).map(|((m, part), rust)| Forecast {
            id: m.name.clone(),
            rust,
            elastic: scene.structure.assembly(model).and_then(|a| part.stressed(a)),
            now: part.now,
            course: part.course,
            later: outcome.complaint.is_empty().then_some(part.last),
            ahead_years: settings.ahead_years,
            age_years: now / YEAR,
            peak_compression_pa: m.peak_compression_pa,
            peak_bar_pa: m.peak_bar_stress_pa,
            peak_tendon_pa: tendon(m),
            dof: outcome.dof,
            assumed_error: scene.structure.assembly(model).map_or(0.0, assumed_error),
            gauges: gauges.clone(),
            complaint: outcome.complaint.clone(),
            failure: failure.clone(),
            notes: outcome.warnings.iter().chain(&outcome.notes).cloned().collect(),
        });
    Ok(told.collect())
}

/// What of a model was only assumed and decides what it carries.
fn what_is_assumed(scene: &Scene, model: &str) -> Vec<String> {
    let Some(assembly) = scene.structure.assembly(model) else { return Vec::new() };
    let of = |is_assumed: bool, what: &str| is_assumed.then(|| what.to_owned());
    let all =
        [of(assembly.steel_assumed, "reinforcement"), of(assembly.concrete_assumed, "concrete")];
    all.into_iter().flatten().collect()
}

/// Whether a stated load of some kind acts on a model, or on what hands its loads on to it.
fn is_loaded(scene: &Scene, model: &str, is_of_kind: impl Fn(&Action) -> bool) -> bool {
    let structure = &scene.structure;
    let Some(assembly) = structure.assembly(model) else { return false };
    let acts = |members: &[String]| {
        members.is_empty() || members.iter().any(|id| assembly.members.contains(id))
    };
    let of_frame = scene.bears_as_one();
    let mut loads = structure.loads.iter().filter(|load| is_of_kind(&load.action));
    loads.any(|load| of_frame || acts(&load.members))
}

/// An end of life that rests on what was only assumed.
fn check_assumption(end: &LifeEnd) -> String {
    format!(
        "an assumption to check, no damage: with the {} that was only assumed it does not carry its own weight (day {:.0} of its life: {}); state it in details of the scene",
        end.assumed.join(" and "),
        end.age_years * YEAR / DAY,
        end.why
    )
}

/// Whether nothing was in equilibrium from the first step on.
fn is_failure_at_once(why: &Failure) -> bool {
    matches!(why, Failure::NotConverged { .. } | Failure::Beyond(_))
}

fn never_in_equilibrium(why: &Failure, assumed: Vec<String>) -> LifeEnd {
    LifeEnd {
        age_years: 0.0,
        ahead_years: 0.0,
        why: format!("never in equilibrium: overloaded, or held or loaded wrongly; {why}"),
        assumed,
    }
}

/// Why a life came to nothing: what fails once somebody has asked to stop was stopped.
pub(crate) fn failed(why: &Failure, job: &Job) -> ForecastError {
    if matches!(why, Failure::Cancelled(_)) || job.is_cancelled() {
        tracing::debug!("{why}");
        return ForecastError::Cancelled;
    }
    ForecastError::Because(why.to_string())
}

fn prepared(
    scene: &Scene,
    model: &str,
    handed: Option<&Handed>,
    settings: ForecastSettings,
    job: &Job,
) -> Result<Prepared, ForecastError> {
    let because = |e: &dyn std::fmt::Display| ForecastError::Because(e.to_string());
    let assembly = scene
        .structure
        .assembly(model)
        .ok_or_else(|| because(&format!("{model}: no such member")))?;
    let ours = scene.members.iter().find(|m| m.id == model);
    let edge = || {
        let member = ours?;
        if let Some(wall) = assembly.body.as_ref().and_then(inner_wall) {
            return Some(wall);
        }
        let smallest = (member.bounds[1] - member.bounds[0]).as_dvec3().min_element();
        let most = largest_element(scene, assembly).map_or(f64::INFINITY, |edge| LARGEST * edge);
        // A tunnel's model holds more than its members: its own choice of elements is better.
        (member.kind != MemberKind::Lining && member.volume > 0.0)
            .then(|| (FINEST * smallest).max((member.volume / BRICKS).cbrt()).min(most))
    };
    let meshing = Meshing { element: settings.element_m.or_else(edge) };
    let prepared = prepare_within(scene, assembly, handed, meshing, job)
        .map_err(|e| if job.is_cancelled() { ForecastError::Cancelled } else { because(&e) })?;
    // What it would be like once it has failed is no damage that it has.
    Ok(Prepared { raised: None, ..prepared })
}

/// The bars of a model's members, and what attacks them.
pub struct BarsOf {
    /// What may attack them, or why nobody knows.
    pub corrosion: Result<Corrosion, CorrosionError>,
    /// Since the attack began, now, s.
    pub age: f64,
    /// By member.
    pub parts: Vec<PartBars>,
}

/// The bars of a member, by zone.
pub struct PartBars {
    /// Its id.
    pub id: String,
    /// Along its axis.
    pub bars: [Vec<Bars>; ZONES],
    /// Concrete over the outermost steel, stirrups too, m.
    pub outer: [Option<f64>; ZONES],
}

/// The bars of a model as a forecast has them.
///
/// # Errors
/// The model cannot be prepared; or the job was cancelled.
pub fn bars_of(
    scene: &Scene,
    model: &str,
    rule: &GradingRule,
    job: &Job,
) -> Result<BarsOf, ForecastError> {
    // How it is held matters to no bar: any body can be held lightly.
    let light = Handed::default();
    let prepared = prepared(scene, model, Some(&light), ForecastSettings::default(), job)?;
    let now = prepared.times.last().copied().unwrap_or(0.0);
    let watch = Watch::new(scene, &prepared, rule, now, job);
    let part = |k: usize| PartBars {
        id: prepared.parts[k].id.clone(),
        bars: watch.bars(k),
        outer: watch.outer(k),
    };
    Ok(BarsOf {
        parts: (0..prepared.parts.len()).map(part).collect(),
        corrosion: prepared.corrosion.clone(),
        age: (now - prepared.attacked).max(0.0),
    })
}

/// Looks at every equilibrium, and keeps that of now and the last.
struct Watch<'a> {
    prepared: &'a Prepared,
    rule: &'a GradingRule,
    until: f64,
    /// From the beginning of the life to its end, s.
    span: f64,
    job: &'a Job,
    parts: Vec<PartWatch>,
    /// The part that a brick belongs to.
    part_of: Vec<Option<usize>>,
    cover: f64,
    /// Monitored gauges of strain, each with one of stress at its place, and what they show.
    monitored: Vec<[Gauge; 2]>,
    courses: Vec<GaugeCourse>,
}

struct PartWatch {
    frame: Frame,
    ring: bool,
    /// Mean tensile strength, Pa, and E_s/E_cm.
    tensile_strength: f64,
    modular_ratio: f64,
    /// Of elastic matter: what it bears, and its largest principal stress so far, Pa.
    elastic: Option<ElasticMatter>,
    peak: f64,
    now: [Foretold; ZONES],
    last: [Foretold; ZONES],
    course: Vec<Passed>,
}

/// A layer of bricks across the axis, of a ring a sector of it.
#[derive(Default, Clone, Copy)]
struct Layer {
    volume: f64,
    cracked: f64,
    crushed: f64,
    opening: f64,
}

impl<'a> Watch<'a> {
    fn new(
        scene: &Scene,
        prepared: &'a Prepared,
        rule: &'a GradingRule,
        until: f64,
        job: &'a Job,
    ) -> Self {
        let frame = |id: &str| {
            scene.members.iter().find(|m| m.id == id).map_or(Frame::default(), |m| m.frame)
        };
        let is_ring = |kind| matches!(kind, MemberKind::Lining | MemberKind::Segment);
        let empty = [Foretold::default(); ZONES];
        let elastic = scene.structure.assembly(&prepared.id).and_then(elastic);
        let part = |p: &Part| {
            let class = scene
                .members
                .iter()
                .find(|m| m.id == p.id)
                .and_then(|m| m.concrete.parse::<Class>().ok());
            let fck = class.map_or(ASSUMED, |c| c.fck);
            PartWatch {
                frame: frame(&p.id),
                ring: is_ring(p.kind),
                tensile_strength: tensile_strength(fck),
                modular_ratio: E_STEEL / secant_modulus(fck + 8e6),
                elastic,
                peak: 0.0,
                now: empty,
                last: empty,
                course: Vec::new(),
            }
        };
        let mut part_of = vec![None; prepared.model.mesh.hexes.len()];
        for (i, part) in prepared.parts.iter().enumerate() {
            part.hexes.iter().for_each(|&hex| part_of[hex as usize] = Some(i));
        }
        let cover = scene
            .structure
            .assembly(&prepared.id)
            .and_then(|a| cover(a.body.as_ref()?))
            .unwrap_or(0.05);
        let monitored = monitored(scene, prepared);
        Self {
            prepared,
            rule,
            until,
            span: prepared.times.last().copied().unwrap_or(0.0),
            job,
            parts: prepared.parts.iter().map(part).collect(),
            part_of,
            cover,
            monitored: monitored.iter().map(|(_, pair)| *pair).collect(),
            courses: monitored.into_iter().map(|(course, _)| course).collect(),
        }
    }

    /// What is told of members whose life ends before its first equilibrium.
    fn fail_at_once(self, scene: &Scene, model: &str, failure: LifeEnd) -> Vec<Forecast> {
        let assembly = scene.structure.assembly(model);
        let one = |part: PartWatch, id: &str| Forecast {
            id: id.to_owned(),
            course: Vec::new(),
            now: part.now,
            later: None,
            ahead_years: 0.0,
            age_years: self.until / YEAR,
            rust: Rust::default(),
            elastic: None,
            peak_compression_pa: 0.0,
            peak_bar_pa: 0.0,
            peak_tendon_pa: None,
            dof: 0,
            assumed_error: assembly.map_or(0.0, assumed_error),
            gauges: Vec::new(),
            complaint: failure.why.clone(),
            failure: Some(failure.clone()),
            notes: Vec::new(),
        };
        let ids = self.prepared.parts.iter().map(|part| part.id.as_str());
        self.parts.into_iter().zip(ids).map(|(part, id)| one(part, id)).collect()
    }

    /// Notes what monitored gauges would show.
    fn listen(&mut self, structure: &System, history: &History, time: f64) -> Result<(), Failure> {
        let modular = self.parts.first().map_or(1.0, |p| p.modular_ratio);
        for (pair, course) in self.monitored.iter().zip(&mut self.courses) {
            let read = structure.read(pair, history)?;
            course.days.push(time / DAY);
            course.strain.push(read[0]);
            if time <= self.until + 60.0 {
                course.elastic = read[1] * modular / E_STEEL;
            }
        }
        Ok(())
    }

    fn zones(&self, part: usize, history: &History, points: &[[Point; 8]]) -> [Foretold; ZONES] {
        let mut zones = [Foretold::default(); ZONES];
        let held = self.held(part, history, points);
        for ((zone, ..), layer) in self.layers(part, points) {
            let (share, crushed) = (layer.cracked / layer.volume, layer.crushed / layer.volume);
            // Bars hold cracks together that a coarse brick would show as one.
            let width = if share > 0.0 { held[zone].unwrap_or(layer.opening) } else { 0.0 };
            let told = &mut zones[zone];
            told.cracked = told.cracked.max(share);
            told.crack_mm = told.crack_mm.max(1e3 * width);
            told.crushed = told.crushed.max(crushed);
        }
        for told in &mut zones {
            let cracks = told.cracked * (told.crack_mm / self.rule.open_crack_mm).min(1.0);
            told.concrete = together([cracks, told.crushed]);
            told.damage = told.concrete;
        }
        zones
    }

    /// Adds rust to what is foretold of a part for now, for the end of its life and on the way.
    fn corrode(&mut self, part: usize, now: f64, end: f64) -> Rust {
        let corrosion = match &self.prepared.corrosion {
            Ok(corrosion) => corrosion,
            Err(why) => return Rust::not_computed(why),
        };
        let bars = self.bars(part);
        let age = |time: f64| (time - self.prepared.attacked).max(0.0);
        let of = |bars: &Vec<Bars>, age| (!bars.is_empty()).then(|| corrosion.lost(bars, age));
        // What is lost by a moment, to the minute: the course tells of now and of the end, too.
        let mut known: BTreeMap<i64, [Option<Lost>; ZONES]> = BTreeMap::new();
        let mut lost = |time: f64| {
            let minute = (age(time) / 60.0).round() as i64;
            *known.entry(minute).or_insert_with(|| bars.each_ref().map(|bars| of(bars, age(time))))
        };
        let told = &mut self.parts[part];
        for (zones, time) in [(&mut told.now, now), (&mut told.last, end)] {
            for (told, lost) in zones.iter_mut().zip(lost(time)) {
                let Some(Lost { share, std_error, .. }) = lost else { continue };
                (told.steel_lost, told.steel_lost_std_error) = (Some(share), std_error);
                told.damage = together([told.concrete, share]);
            }
        }
        for passed in &mut told.course {
            for (damage, lost) in passed.damage.iter_mut().zip(lost(passed.years * YEAR)) {
                if let Some(Lost { share, .. }) = lost {
                    *damage = together([*damage, share]);
                }
            }
        }
        Rust::of(corrosion, &bars, age(now))
    }

    /// The bars of a part along its axis that can rust, by zone; what has the same cover within a
    /// tenth of a millimetre is one.
    fn bars(&self, part: usize) -> [Vec<Bars>; ZONES] {
        let mut groups: [BTreeMap<[i64; 2], Bars>; ZONES] =
            std::array::from_fn(|_| BTreeMap::new());
        for steel in
            self.prepared.model.steel.iter().filter(|s| !matches!(s.kind, SteelKind::Tendon(_)))
        {
            let Some(rust) = &steel.rust else { continue };
            for (piece, &cover) in
                steel.pieces.iter().zip(&rust.cover).filter(|(piece, _)| self.is_along(part, piece))
            {
                let zone = zone_at(self.parts[part].place(0.5 * (piece.ends[0] + piece.ends[1])).0);
                let key = [cover, rust.diameter].map(|m| (1e4 * m).round() as i64);
                let group = groups[zone].entry(key).or_insert(Bars {
                    weight: 0.0,
                    cover,
                    diameter: rust.diameter,
                });
                group.weight += steel.area * piece.length();
            }
        }
        groups.map(|g| g.into_values().collect())
    }

    /// Concrete over the outermost steel of a part that can rust, m, by zone.
    fn outer(&self, part: usize) -> [Option<f64>; ZONES] {
        let mut outer = [None; ZONES];
        let rusts = self.prepared.model.steel.iter().filter_map(|s| Some((s, s.rust.as_ref()?)));
        for (steel, rust) in rusts {
            let inside = |piece: &Piece| self.part_of[piece.host] == Some(part);
            for (piece, cover) in
                steel.pieces.iter().zip(&rust.cover).filter(|(piece, _)| inside(piece))
            {
                let zone = zone_at(self.parts[part].place(0.5 * (piece.ends[0] + piece.ends[1])).0);
                let least: f64 = outer[zone].unwrap_or(f64::INFINITY);
                outer[zone] = Some(least.min(*cover));
            }
        }
        outer
    }

    /// Whether a piece of a bar lies in a part and along its axis.
    fn is_along(&self, part: usize, piece: &Piece) -> bool {
        let axis = self.parts[part].frame.axis.as_dvec3().normalize_or_zero();
        self.part_of[piece.host] == Some(part)
            && (piece.ends[1] - piece.ends[0]).normalize_or_zero().dot(axis).abs() >= 0.9
    }

    /// Bricks by zone, place along the axis (0.1 % of it) and sector.
    fn layers(&self, part: usize, points: &[[Point; 8]]) -> BTreeMap<(usize, i64, i64), Layer> {
        let watch = &self.parts[part];
        let mesh = &self.prepared.model.mesh;
        let mut layers: BTreeMap<(usize, i64, i64), Layer> = BTreeMap::new();
        for &hex in &self.prepared.parts[part].hexes {
            let centre = mesh.corners(hex).into_iter().sum::<DVec3>() / 8.0;
            let (at, turn) = watch.place(centre);
            let sector = if watch.ring { (turn * SECTORS).floor() as i64 } else { 0 };
            let layer = layers.entry((zone_at(at), (1e3 * at).round() as i64, sector)).or_default();
            let volume = mesh.hex_volume(hex);
            layer.volume += volume;
            for point in &points[hex as usize] {
                let [tension, compression] = point.damage;
                layer.cracked += if tension > CRACKED { volume / 8.0 } else { 0.0 };
                layer.crushed += volume / 8.0
                    * match watch.elastic {
                        Some(matter) if largest(point) > matter.strength => 1.0,
                        Some(_) => 0.0,
                        None => past_peak([0.0, compression]),
                    };
                layer.opening = layer.opening.max(point.crack);
            }
        }
        layers
    }

    /// By zone: the width (m) of the cracks that its bars let open; none where no bar runs along
    /// it. Elements smear cracks: their bars have the mean stress between cracks, and at a crack
    /// take over what the concrete beside them carries there.
    fn held(&self, part: usize, history: &History, points: &[[Point; 8]]) -> [Option<f64>; ZONES] {
        let model = &self.prepared.model;
        let axis = self.parts[part].frame.axis.as_dvec3().normalize_or_zero();
        let mut places: Vec<(usize, DVec3, &Steel, f64, usize)> = Vec::new();
        for (steel, works) in model
            .steel
            .iter()
            .zip(&history.steel)
            .filter(|(s, _)| !matches!(s.kind, SteelKind::Tendon(_)))
        {
            for (piece, work) in
                steel.pieces.iter().zip(works).filter(|(piece, _)| self.is_along(part, piece))
            {
                let middle = 0.5 * (piece.ends[0] + piece.ends[1]);
                let zone = zone_at(self.parts[part].place(middle).0);
                let across = middle - axis * middle.dot(axis);
                places.push((zone, across, steel, work.stress, piece.host));
            }
        }
        let matter = |zone: usize| {
            let &(_, across, steel, stress, host) =
                places.iter().filter(|p| p.0 == zone).max_by(|a, b| a.3.total_cmp(&b.3))?;
            let diameter = steel.diameter();
            let apart = places
                .iter()
                .map(|p| p.1.distance(across))
                .filter(|&d| d > 0.5 * diameter)
                .fold(f64::INFINITY, f64::min);
            let beside = points[host].iter().map(|p| tension_along(p, axis)).sum::<f64>() / 8.0;
            let mean = Tie {
                stress,
                diameter,
                spacing: if apart.is_finite() { apart } else { 1.0 },
                cover: self.cover,
                tensile_strength: self.parts[part].tensile_strength,
                modular_ratio: self.parts[part].modular_ratio,
            };
            Some(mean.at_crack(beside))
        };
        std::array::from_fn(|zone| matter(zone).map(|tie| crack_width(&tie)))
    }
}

/// The largest principal stress at a point, of either sign, Pa.
fn largest(point: &Point) -> f64 {
    Principal::of_stress(&point.stress).values.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Tension of the concrete along an axis, Pa; 0 where it is pressed.
fn tension_along(point: &Point, axis: DVec3) -> f64 {
    let [xx, yy, zz, xy, yz, zx] = point.stress;
    let DVec3 { x, y, z } = axis;
    let along = xx * x * x + yy * y * y + zz * z * z + 2.0 * (xy * x * y + yz * y * z + zx * z * x);
    along.max(0.0)
}

impl PartWatch {
    /// Notes an equilibrium, in the place of the last one where that is like the one before it: so
    /// that of now and the last of all are always told.
    fn pass(&mut self, time: f64, [now, span]: [f64; 2], zones: &[Foretold; ZONES]) {
        let passed = Passed { years: time / YEAR, damage: zones.map(|told| told.concrete) };
        let is_like = |a: &Passed, b: &Passed| {
            let apart = a.damage.iter().zip(&b.damage).map(|(a, b)| (a - b).abs());
            apart.fold(0.0, f64::max) < ALIKE && (b.years - a.years) * YEAR < span * MOMENT
        };
        if let [.., before, last] = &mut *self.course
            && is_like(before, last)
            && (last.years * YEAR - now).abs() > 60.0
        {
            *last = passed;
        } else {
            self.course.push(passed);
        }
    }

    /// How its matter is stressed, where that is elastic.
    fn stressed(&self, assembly: &Assembly) -> Option<Stressed> {
        let matter = assembly.matter.as_ref()?.name.clone();
        let strength_pa = self.elastic?.strength;
        Some(Stressed { matter, peak_pa: self.peak, strength_pa })
    }

    /// Place along the axis (0 to 1), and about it (0 to 1).
    fn place(&self, point: DVec3) -> (f64, f64) {
        let from = point - self.frame.start.as_dvec3();
        let ninety: Vec3 = self.frame.ninety();
        let turn = from.dot(ninety.as_dvec3()).atan2(from.dot(self.frame.zero.as_dvec3()))
            / std::f64::consts::TAU;
        (along(&self.frame, point), turn.rem_euclid(1.0))
    }
}

impl Observer for Watch<'_> {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure> {
        self.listen(structure, history, step.time)?;
        for part in 0..self.parts.len() {
            let zones = self.zones(part, history, points);
            let hexes = self.prepared.parts[part].hexes.iter();
            let peak = hexes.flat_map(|&hex| &points[hex as usize]).map(largest);
            let peak = peak.fold(self.parts[part].peak, f64::max);
            self.parts[part].peak = peak;
            if step.time <= self.until + 60.0 {
                self.parts[part].now = zones;
            }
            self.parts[part].last = zones;
            let kept = [self.until, self.span];
            self.parts[part].pass(step.time, kept, &zones);
        }
        let passed = self.prepared.times.iter().filter(|&&time| time <= step.time).count();
        Ok(self.job.step(passed, self.prepared.times.len())?)
    }
}

/// Place along an axis, 0 to 1.
pub(crate) fn along(frame: &Frame, point: DVec3) -> f64 {
    let axis = frame.axis.as_dvec3();
    (point - frame.start.as_dvec3()).dot(axis) / axis.length_squared().max(1e-12)
}

/// Gauges of strain that are read over the years, each with a gauge of stress at its place.
fn monitored(scene: &Scene, prepared: &Prepared) -> Vec<(GaugeCourse, [Gauge; 2])> {
    let is_read = |name: &str| scene.structure.series.iter().any(|s| s.gauge == name);
    let of = |(name, gauge): &(String, Gauge)| match *gauge {
        Gauge::Strain(host, along) if is_read(name) => {
            let course = GaugeCourse { gauge: name.clone(), ..GaugeCourse::default() };
            Some((course, [*gauge, Gauge::Stress(host, along)]))
        }
        _ => None,
    };
    prepared.gauges.iter().filter_map(of).collect()
}

/// Thickness of a tunnel's inner lining, m: one brick across it bends as two do, and takes a third
/// of the time.
fn inner_wall(body: &Body) -> Option<f64> {
    match body {
        Body::Tunnel { inner_lining, .. } => {
            inner_lining.as_ref().map(|l| f64::from(l.thickness_m))
        }
        _ => None,
    }
}

/// Concrete outside the longitudinal bars, m.
fn cover(body: &Body) -> Option<f64> {
    let reinforcement = body.reinforcement()?;
    let stirrup = reinforcement.stirrups.as_ref().map_or(0.0, |s| s.diameter_mm);
    Some(1e-3 * f64::from(reinforcement.cover_mm + stirrup))
}

/// What an assumed class adds to the relative error of cracking and crushing: strengths of
/// neighbouring classes differ by a quarter (EN 206), and whoever assumes may be off by one or two.
pub(crate) const CONCRETE_ASSUMED: f64 = 0.4;
/// What assumed reinforcement adds: cracks' widths go with the inverse of its area (EN 1992-1-1,
/// 7.3.4), and members have one to two times the least that a code allows.
pub(crate) const STEEL_ASSUMED: f64 = 0.6;

/// The relative error that assumptions about an assembly add to a forecast.
pub(crate) fn assumed_error(assembly: &Assembly) -> f64 {
    let concrete = if assembly.concrete_assumed { CONCRETE_ASSUMED } else { 0.0 };
    let steel = if assembly.steel_assumed { STEEL_ASSUMED } else { 0.0 };
    concrete.hypot(steel)
}

impl Forecast {
    /// What it says of the member now; with `relative` error of the model. Elastic matter that
    /// bears its stress shows no damage of any kind, and so nothing is said of it.
    #[must_use]
    pub fn evidence(&self, relative: f64) -> Option<Evidence> {
        let relative = relative.hypot(self.assumed_error);
        let ended = self.failure.as_ref().filter(|end| end.ahead_years <= 0.0);
        let reading = |value: f64| {
            let is_told = self.elastic.is_none() || value > 0.0;
            // What has failed by computation has nothing left that would carry what acts.
            match ended {
                Some(_) => Some(Estimate { value: 1.0, std_error: relative.min(0.5) }),
                None => is_told.then_some(Estimate { value, std_error: relative * value }),
            }
        };
        // What was assumed has a spread of its own; what was given errs as the rest of the model.
        let steel = |told: &Foretold| {
            let value = told.steel_lost?;
            Some(if self.rust.assumed.is_empty() {
                Estimate { value, std_error: relative * value }
            } else {
                Estimate { value, std_error: told.steel_lost_std_error }
            })
        };
        let zones = BTreeMap::from([
            (Cause::Concrete, Zones(self.now.each_ref().map(|told| reading(told.concrete)))),
            (Cause::Steel, Zones(self.now.each_ref().map(steel))),
        ]);
        let zones = zones.into_iter().filter(|(_, zones)| zones.worst().is_some()).collect();
        let worst = (0..ZONES).fold(0, |worst, zone| {
            if self.now[zone].damage > self.now[worst].damage { zone } else { worst }
        });
        let width = self.now.iter().map(|t| t.crack_mm).fold(0.0, f64::max);
        let most = |told: &[Foretold; ZONES], of: fn(&Foretold) -> f64| {
            told.iter().map(of).fold(0.0, f64::max)
        };
        let now = &self.now[worst];
        let cracks = match now.crack_mm {
            width if width >= LEAST_MM => {
                format!("{:.0} % of a section cracked to {width:.2} mm", 100.0 * now.cracked)
            }
            _ => "no open cracks".into(),
        };
        let mut basis = format!(
            "life of {:.0} years in finite elements; worst {} of the axis: {}, {}",
            self.age_years,
            place(worst),
            self.elastic.as_ref().map_or(cracks, Stressed::told),
            self.rust.says(steel(now))
        );
        if let Some(end) = &self.failure {
            basis = format!("{}; {basis}", end.sentence());
        }
        if let Some(later) = &self.later {
            basis += &format!(
                "; in {:.0} years damage {:.2}",
                self.ahead_years,
                most(later, |t| t.damage)
            );
        }
        if self.assumed_error > 0.0 {
            basis += "; concrete or bars are assumed, and the error is wider for it";
        }
        let serde_json::Value::Object(details) = json!({
            "assumed_error": self.assumed_error, "age_years": self.age_years, "now": self.now, "later": self.later, "ahead_years": self.ahead_years, "course": self.course,
            "later_damage": self.later.as_ref().map(|l| most(l, |t| t.damage)),
            "peak_compression_pa": self.peak_compression_pa, "peak_bar_pa": self.peak_bar_pa, "peak_tendon_pa": self.peak_tendon_pa,
            "rust": self.rust, "unknowns": self.dof, "complaint": self.complaint, "notes": self.notes,
            "failure": self.failure,
        }) else {
            return None;
        };
        let evidence = Evidence::new(FORECAST, false, zones, basis)?;
        Some(Evidence {
            crack_width_mm: (width >= LEAST_MM).then_some(width),
            failure: self.failure.clone(),
            details,
            ..evidence
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use intrados_scene::{
        Structure,
        structure::{Load, Loading},
    };

    use super::*;

    /// A scene may say that a load is raised until its members fail: that is for `analyze`.
    #[test]
    fn a_forecast_raises_no_load() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let raised = scene.structure.loads.iter().map(|l| Load {
            loading: l.action.can_be_raised().then_some(Loading::Automatic),
            ..l.clone()
        });
        let loads: Vec<Load> = raised.collect();
        assert!(loads.iter().any(|l| l.loading.is_some()));
        let structure = Structure { loads, ..Structure::clone(&scene.structure) };
        let scene = Scene { structure: Arc::new(structure), ..scene };
        let member = scene.structure.assembly("C1").unwrap();
        let by_itself =
            prepare_within(&scene, member, None, Meshing::default(), &Job::default()).unwrap();
        assert!(by_itself.raised.is_some());
        let ours = prepared(&scene, "C1", None, ForecastSettings::default(), &Job::default());
        assert_eq!(ours.unwrap().raised, None);
    }

    fn scene(member: &str, loads: &str) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.ron");
        let text = format!(
            "(schema: \"intrados.scene/1\", members: [(id: \"M\", at: (0, 0, 0),
              concrete: \"C30/37\", body: {member}, exposure: (class: \"XC1\", years: 2))],
              supports: [(member: \"M\", place: Start, hold: Directions(x: true, y: true, z: true)),
                {loads}"
        );
        std::fs::write(&path, text).unwrap();
        Scene::load(&path, &Job::default()).unwrap()
    }

    /// On bricks of this size, m; as a prediction takes them where it is not said.
    fn told(scene: &Scene, element_m: Option<f64>) -> Result<Vec<Forecast>, ForecastError> {
        let rule = intrados_damage::grading::Profile::default().rule;
        let settings =
            ForecastSettings { ahead_years: 1.0, element_m, ..ForecastSettings::default() };
        forecast(scene, "M", None, &rule, settings, &Job::default())
    }

    /// The same with bars that are only assumed.
    fn with_assumed_bars(scene: &Scene) -> Scene {
        let mut structure = Structure::clone(&scene.structure);
        structure.assemblies.iter_mut().for_each(|a| a.steel_assumed = true);
        Scene { structure: Arc::new(structure), ..scene.clone() }
    }

    /// A cantilever of plain concrete that cannot carry its own weight: a failure, or, where nothing but
    /// its weight acts and its bars were only assumed, an assumption to check. With a stated load it
    /// is a failure that names the assumption.
    #[test]
    fn an_assumption_that_fails_is_no_damage() {
        let beam = "Beam(section: Rectangle(width_m: 0.2, depth_m: 0.2), length_m: 6)";
        // Its root takes 18 kN m and cracks at some 4, on any bricks.
        const COARSE: Option<f64> = Some(0.2);
        let weight = "(name: \"self weight\", action: SelfWeight)";
        let lamp = "(name: \"lamp\", action: Force(place: End, force_kn: (0, -0.1, 0)))";
        let light = scene(beam, &format!("], loads: [{weight}])"));
        let loaded = scene(beam, &format!("], loads: [{weight}, {lamp}])"));
        match told(&with_assumed_bars(&light), COARSE) {
            Err(ForecastError::Assumed(why)) => {
                assert!(why.contains("reinforcement") && why.contains("own weight"), "{why}");
            }
            other => panic!("{other:?}"),
        }
        let told_of = |scene: &Scene| told(scene, COARSE).unwrap().swap_remove(0);
        let end = told_of(&with_assumed_bars(&loaded)).failure.unwrap();
        assert_eq!(end.assumed, ["reinforcement"]);
        let stated = told_of(&loaded);
        assert!(stated.failure.as_ref().unwrap().assumed.is_empty());
        let evidence = stated.evidence(0.4).unwrap();
        assert!(evidence.damage == 1.0 && evidence.failure.is_some(), "{}", evidence.basis);
    }

    /// A tie of .2 × .2 m with four bars of 16 mm (c 38 mm, 108 mm apart), pulled to N/A_s = 200 MPa
    /// at its cracks. By hand (EN 1992-1-1, 7.3.4): A_c,eff = 115 · 108 mm² a bar, ρ = .01619,
    /// s_r,max = 129.2 + 168.0 = 297.2 mm; ε = (200 − .4 · 2.9/.01619 · (1 + 6.09 · .01619))/200 000
    /// = 6.07e-4, w = .180 mm. Elements smear cracks and spread the force evenly over A_c = .01 m² a
    /// bar: within 15 %. Away from the ends, where the load is led in and the support lets it out.
    #[test]
    fn widths_agree_with_hand_calculation() {
        let tie = "Column(section: Rectangle(width_m: 0.2, depth_m: 0.2), height_m: 1.2,
            reinforcement: (cover_mm: 30, bars: [Around(count: 4, diameter_mm: 16)],
              stirrups: (diameter_mm: 8, spacing_mm: 150)))";
        let load = "], loads: [(name: \"jack\", action: Force(place: End, force_kn: (0, 160.8, 0)),
            history: [(28, 0), (29, 1)])])";
        let told = told(&scene(tie, load), None).unwrap();
        let widths: Vec<f64> = told[0].now.iter().map(|zone| zone.crack_mm).collect();
        let within = |width: &f64| (width / 0.180 - 1.0).abs() < 0.15;
        assert!(widths[1..ZONES - 1].iter().all(within), "{widths:?}");
    }
}
