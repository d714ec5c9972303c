//! The main job: everything known about a member becomes one damage with an error bar and a state,
//! and a score where the truth is known.
//!
//! [`Predictor`] works piece by piece (a slice, a member's life), so that a window can show it
//! between frames; [`predict`] runs it to the end.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use intrados_mechanics::{frame, member::Handed};
use intrados_scene::{
    Assembly, Damage, Member, MemberKind, Scene,
    structure::{Course, Matter, Observation, Shows},
};
use intrados_stage::{Cancelled, Estimate, Job, file::Set};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{CT, Defect, SliceReading, defect::defects, section};

use intrados_ct::{
    SliceError, detect,
    score::Tally,
    source::{SliceShelf, SliceSource},
    synthetic::{drawn::MARK, scanned},
};
use intrados_damage::{
    evidence::{self, Cause, Evidence, EvidenceSource, Said, Sources},
    fusion::Whole,
    grading::Profile,
    ledger,
    score::{Cases, MemberScore, Outcome},
    truth,
    verdict::{Basis, NAMED, Verdict},
    zone::{ZONES, Zones, together, zone_at},
};
use intrados_forecast::{self as forecast, FORECAST, Forecast, ForecastError, forecast};
use intrados_gauges::{
    self as gauges, GAUGES, GaugeError, GaugeReading,
    monitoring::{self, MONITORING},
};
use intrados_survey::{
    self as survey, SURVEY, Surveyed,
    photographed::{self, PHOTOGRAPHED, PhotoError},
    surveyed,
};

/// Schema of the JSON.
pub const SCHEMA: &str = "intrados.predict/2";

/// How to predict.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictSettings {
    /// How slices are read.
    pub detect: detect::DetectSettings,
    /// How sections become damage and damage becomes a state.
    pub profile: Profile,
    /// How lives in finite elements are computed; none: nothing is foretold.
    pub forecast: Option<forecast::ForecastSettings>,
    /// How readings are made where nobody read the gauges of a member whose damage is planted.
    pub simulation: gauges::Simulation,
    /// Whether a bad slice ends the work, instead of being left out.
    pub strict: bool,
}

impl Default for PredictSettings {
    fn default() -> Self {
        Self {
            detect: detect::DetectSettings::default(),
            profile: Profile::default(),
            forecast: Some(forecast::ForecastSettings::default()),
            simulation: gauges::Simulation::default(),
            strict: false,
        }
    }
}

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
    /// What the prediction does not say.
    pub limits: Vec<String>,
}

impl Prediction {
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
    /// Within how many months, by the worst state that it may be in; none: nobody says.
    pub within_months: Option<u32>,
    /// Damage by zone, tenths of the axis from its start; none where nothing is known.
    pub zones: Zones,
    /// The same by cause.
    pub causes: BTreeMap<Cause, Zones>,
    /// The zone that counts, from 0.
    pub worst_zone: Option<usize>,
    /// By state, the share of the length that is to be expected in it; of what is known.
    pub states: BTreeMap<String, f64>,
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
    /// Evidence by its source.
    pub evidence: BTreeMap<&'static str, Evidence>,
    /// Truth where it is known.
    pub truth: Option<Truth>,
    /// The slices, one by one.
    pub slices: Vec<SliceReading>,
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

/// Work that goes on piece by piece.
#[derive(Debug, Clone)]
pub struct Predictor {
    settings: PredictSettings,
    /// Scans that somebody has ordered already.
    shelf: SliceShelf,
    hash: String,
    queue: Vec<Item>,
    next: usize,
    readings: Vec<Vec<SliceReading>>,
    /// Lengths of the members, m.
    lengths: Vec<f64>,
    /// What people call assemblies, by their ids.
    names: BTreeMap<String, String>,
    told: Vec<(usize, Evidence)>,
    /// Of every piece done, why it came to nothing; none where it did not.
    fates: Vec<Option<String>>,
    /// Readings that could not be inverted, by their number, and why.
    unfelt: BTreeMap<usize, String>,
    /// Gauges whose series say nothing, and why.
    unmonitored: BTreeMap<String, String>,
    /// What gauges read, by member.
    measured: BTreeMap<usize, Vec<GaugeReading>>,
    /// What photographs show, by member.
    photographed: BTreeMap<usize, Vec<Observation>>,
    /// Observations that count for nothing, by their number, and why.
    unheard: BTreeMap<usize, String>,
    /// Items of outside sources that count for nothing, by piece and number, and why.
    unused: BTreeMap<(usize, usize), String>,
    /// By model, the lives that have been computed.
    lives: BTreeMap<String, Vec<Forecast>>,
    /// What every member's rest does to it, once a life has asked for it; or why nobody knows.
    frame: Option<Result<Option<frame::Whole>, String>>,
}

/// Evidence of a member, and what became of it.
#[derive(Default)]
struct Gathered {
    /// What counts, by its source.
    evidence: BTreeMap<&'static str, Evidence>,
    /// Of every piece of evidence its source, and why it does not count.
    fates: Vec<(&'static str, Option<String>)>,
    whole: Whole,
}

/// What a piece of work came to, as it is kept between two runs.
#[derive(Default, Serialize, Deserialize)]
struct Done {
    fate: Option<String>,
    slice: Option<section::Kept>,
    evidence: Option<evidence::Kept>,
    unused: BTreeMap<usize, String>,
    gauges: Vec<GaugeReading>,
}

/// One piece of work.
#[derive(Debug, Clone)]
enum Item {
    Slice(SliceSource),
    Life(String),
    Gauges(usize),
    /// A photograph of a member, by their numbers.
    Photograph(usize, usize),
    /// What instruments and eyes found on a member.
    Survey(usize),
    /// What an outside source has of a member, by its names.
    Outside(Arc<dyn EvidenceSource>, usize, Vec<String>),
}

impl Item {
    /// Roughly how long it takes, in slices: for the share of work done.
    fn weight(&self) -> f64 {
        match self {
            Self::Slice(slice) if slice.origin() == Origin::Scanned => 40.0,
            Self::Slice(_) | Self::Outside(..) => 1.0,
            Self::Gauges(_) | Self::Survey(_) => 5.0,
            Self::Photograph(..) => 40.0,
            Self::Life(_) => 30.0,
        }
    }
}

impl Predictor {
    /// Lists what is to be done: slices first, then lives, gauges, and what outside `sources`
    /// bring.
    #[must_use]
    pub fn new(scene: &Scene, settings: PredictSettings, sources: &Sources) -> Self {
        let mut queue: Vec<Item> = SliceSource::all(scene).into_iter().map(Item::Slice).collect();
        if settings.forecast.is_some() {
            queue.extend(forecast::models(scene).into_iter().map(Item::Life));
        }
        let readable =
            scene.structure.readings.iter().filter(|r| gauges::refusal(scene, r).is_none());
        let read: BTreeSet<&str> = readable.filter_map(|r| gauges::member_of(scene, r)).collect();
        let felt = |&i: &usize| {
            read.contains(scene.members[i].id.as_str()) || gauges::can_simulate(scene, i)
        };
        queue.extend((0..scene.members.len()).filter(felt).map(Item::Gauges));
        let photographs =
            scene.structure.photographs.iter().enumerate().filter_map(|(k, p)| {
                Some((k, scene.members.iter().position(|m| m.id == p.member)?))
            });
        let photographs: Vec<(usize, usize)> = photographs.collect();
        queue.extend(photographs.iter().map(|(k, member)| Item::Photograph(*k, *member)));
        let is_surveyed = |&i: &usize| {
            survey::of_member(scene, &scene.members[i].id).next().is_some()
                || photographs.iter().any(|(_, member)| *member == i)
        };
        queue.extend((0..scene.members.len()).filter(is_surveyed).map(Item::Survey));
        for source in &sources.0 {
            let items = (0..scene.members.len())
                .map(|i| (i, source.items(scene, i)))
                .filter(|(_, items)| !items.is_empty());
            queue.extend(items.map(|(i, items)| Item::Outside(Arc::clone(source), i, items)));
        }
        let readings = vec![Vec::new(); scene.members.len()];
        let lengths = scene.members.iter().map(|m| f64::from(m.frame.axis.length())).collect();
        let name = |a: &Assembly| (a.id.clone(), scene.name_of(&a.id).to_owned());
        let names = scene.structure.assemblies.iter().map(name).collect();
        Self {
            settings,
            shelf: SliceShelf::default(),
            hash: scene.hash.clone(),
            queue,
            next: 0,
            readings,
            lengths,
            names,
            told: Vec::new(),
            fates: Vec::new(),
            unfelt: BTreeMap::new(),
            unmonitored: BTreeMap::new(),
            measured: BTreeMap::new(),
            photographed: BTreeMap::new(),
            unheard: BTreeMap::new(),
            unused: BTreeMap::new(),
            lives: BTreeMap::new(),
            frame: None,
        }
    }

    /// Takes ordered scans from a shelf that others use, too, and puts them there.
    #[must_use]
    pub(crate) fn with_shelf(self, shelf: SliceShelf) -> Self {
        Self { shelf, ..self }
    }

    /// The lives that have been computed, by assembly.
    #[must_use]
    pub fn known_lives(&self) -> &BTreeMap<String, Vec<Forecast>> {
        &self.lives
    }

    /// Takes lives that are known already, as of the same assemblies with other damage: they are
    /// not computed again.
    pub fn learn_lives(&mut self, lives: BTreeMap<String, Vec<Forecast>>) {
        self.lives.extend(lives);
    }

    /// The grading profile that it judges by.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.settings.profile
    }

    /// Pieces done, and pieces in all.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.next, self.queue.len())
    }

    /// What comes next, for people.
    #[must_use]
    pub fn label(&self) -> String {
        let slices = self.queue.iter().filter(|i| matches!(i, Item::Slice(_))).count();
        match self.queue.get(self.next) {
            Some(Item::Slice(slice)) if slice.origin() == Origin::Scanned => {
                format!("scanning slice {} of {slices}", self.next + 1)
            }
            Some(Item::Slice(_)) => format!("reading slice {} of {slices}", self.next + 1),
            Some(Item::Life(_)) => self.label_of(&self.lives()),
            Some(Item::Gauges(_)) => "what gauges felt".into(),
            Some(Item::Survey(_)) => "what was surveyed".into(),
            Some(Item::Photograph(..)) => "what a photograph shows".into(),
            Some(Item::Outside(source, ..)) => format!("what {} says", source.name()),
            None => String::new(),
        }
    }

    /// What people call the lives of some models.
    fn label_of(&self, models: &[String]) -> String {
        let name = |id: &String| self.names.get(id).unwrap_or(id).clone();
        format!("the life of {}", models.iter().map(name).collect::<Vec<_>>().join(" and "))
    }

    /// Whether all slices of a member have been read and it had any.
    #[must_use]
    pub(crate) fn is_read(&self, member: usize) -> bool {
        let waits = |item: &Item| matches!(item, Item::Slice(slice) if slice.member == member);
        self.readings.get(member).is_some_and(|r| !r.is_empty())
            && !self.queue[self.next..].iter().any(waits)
    }

    /// The models whose lives come next, side by side: as many as there are threads, since one
    /// alone leaves some idle.
    fn lives(&self) -> Vec<String> {
        let waiting = self.queue[self.next..].iter().map_while(|item| {
            if let Item::Life(model) = item { Some(model.clone()) } else { None }
        });
        waiting.take(rayon::current_num_threads().max(1)).collect()
    }

    /// Does the next piece of work, or several lives at once. `false` once all is done.
    ///
    /// # Errors
    /// A slice is missing or bad, or the job was cancelled. The piece is skipped by calling again.
    pub fn advance(&mut self, scene: &Scene, job: &Job) -> Result<bool, PredictError> {
        let Some(item) = self.queue.get(self.next).cloned() else { return Ok(false) };
        if scene.hash != self.hash || scene.members.len() != self.readings.len() {
            return Err(PredictError::Changed);
        }
        let weight = |items: &[Item]| items.iter().map(Item::weight).sum::<f64>();
        let (before, whole) = (weight(&self.queue[..self.next]), weight(&self.queue));
        let lives = self.lives();
        let taken = lives.len().max(1);
        let job = job.part(
            before / whole,
            (before + weight(&self.queue[self.next..self.next + taken])) / whole,
        );
        job.relabel(self.label());
        job.step(0, 1)?;
        self.next += taken;
        self.fates.resize(self.next, None);
        let done = match item {
            Item::Slice(slice) => self.look(scene, &slice, &job),
            Item::Life(_) => self.foretell(scene, &lives, &job),
            Item::Gauges(member) => self.feel(scene, member, &job),
            Item::Survey(member) => self.survey(scene, member, &job),
            Item::Photograph(photo, member) => self.behold(scene, photo, member, &job),
            Item::Outside(source, member, _) => self.ask(scene, source.as_ref(), member, &job),
        };
        if let Err(why) = &done {
            self.fates[self.next - taken..].fill(Some(why.to_string()));
        }
        done.map(|()| self.next < self.queue.len())
    }

    /// Reads a slice. One that cannot be read is no reason to say nothing of all the rest.
    fn look(&mut self, scene: &Scene, slice: &SliceSource, job: &Job) -> Result<(), PredictError> {
        match section::read(slice, scene, &self.settings, &self.shelf, job) {
            Ok(reading) => {
                let readings = &mut self.readings[slice.member];
                readings.push(reading);
                section::keep_worst_pictures(readings);
            }
            Err(PredictError::Slice(why))
                if (matches!(why, SliceError::Scan(_))
                    || !self.settings.strict && why.is_of_the_slice())
                    && !job.is_cancelled() =>
            {
                self.fates[self.next - 1] = Some(why.to_string());
            }
            Err(other) => return Err(other),
        }
        Ok(())
    }

    /// Passes over the next piece and remembers why.
    pub(crate) fn skip(&mut self, why: &str) {
        self.next = (self.next + 1).min(self.queue.len());
        self.fates.resize(self.next, Some(why.to_owned()));
    }

    /// Lives side by side, which know nothing of each other; what they tell is kept in their order.
    fn foretell(
        &mut self,
        scene: &Scene,
        models: &[String],
        job: &Job,
    ) -> Result<(), PredictError> {
        let Some(settings) = self.settings.forecast else { return Ok(()) };
        let rule = &self.settings.profile.rule;
        // Of several at once the first tells how far they are.
        let part = |k: usize| if k == 0 { job.part(0.0, 1.0) } else { job.part(0.0, 0.0) };
        if self.frame.is_none() && models.iter().any(|model| !self.lives.contains_key(model)) {
            let found = frame::joined(scene, job);
            job.step(0, 1)?;
            self.frame = Some(found.map_err(|why| why.to_string()));
            job.relabel(self.label_of(models));
        }
        let (known, frame) = (&self.lives, &self.frame);
        let life = |(k, model): (usize, &String)| {
            if let Some(known) = known.get(model) {
                return Ok(known.clone());
            }
            let (handed, note) = part_of(frame, model);
            let mut told = forecast(scene, model, handed, rule, settings, &part(k))?;
            told.iter_mut().for_each(|one| one.notes.extend(note.clone()));
            Ok(told)
        };
        let lives: Vec<_> = models.par_iter().enumerate().map(life).collect();
        let first = self.next - models.len();
        // Of several that are cancelled some may be at their end, and those are known.
        let known = models
            .iter()
            .zip(&lives)
            .filter_map(|(model, told)| Some((model.clone(), told.as_ref().ok()?.clone())));
        self.lives.extend(known);
        for (k, told) in lives.into_iter().enumerate() {
            let told = match told {
                Ok(told) => told,
                Err(ForecastError::Cancelled) => return Err(Cancelled.into()),
                Err(ForecastError::Because(why)) => {
                    self.fates[first + k] = Some(why);
                    continue;
                }
            };
            for one in told {
                let Some(index) = scene.members.iter().position(|m| m.id == one.id) else {
                    continue;
                };
                let (monitored, unused) = monitoring::heard(scene, index, &one);
                self.unmonitored.extend(unused);
                let foretold = one.evidence(self.settings.profile.forecast_error);
                self.told.extend(foretold.into_iter().chain(monitored).map(|e| (index, e)));
            }
        }
        Ok(())
    }

    /// Inverts the site's readings; where nobody read any, readings made from the planted truth,
    /// and says so.
    fn feel(&mut self, scene: &Scene, member: usize, job: &Job) -> Result<(), PredictError> {
        let settings = gauges::GaugeSettings::default();
        let found = if gauges::can_simulate(scene, member) {
            gauges::felt_simulated(scene, member, &self.settings.simulation, &settings, job)
        } else {
            gauges::from_gauges(scene, member, &settings, job)
        };
        match found {
            Ok(Some(felt)) => {
                self.unfelt.extend(felt.unused.iter().cloned());
                self.fates[self.next - 1] = felt.refused.clone();
                self.told.extend(felt.evidence().map(|e| (member, e)));
                self.measured.insert(member, felt.readings);
            }
            Ok(None) => {
                self.fates[self.next - 1] = Some("none of its gauges lies on the member".into())
            }
            Err(GaugeError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(_) if job.is_cancelled() => return Err(Cancelled.into()),
            Err(why) => self.fates[self.next - 1] = Some(why.to_string()),
        }
        Ok(())
    }

    /// Reads what a photograph shows of its member.
    fn behold(
        &mut self,
        scene: &Scene,
        photo: usize,
        member: usize,
        job: &Job,
    ) -> Result<(), PredictError> {
        let Some(photo) = scene.structure.photographs.get(photo) else { return Ok(()) };
        match photographed::observed(scene, photo, job) {
            Ok(found) => self.photographed.entry(member).or_default().extend(found),
            Err(PhotoError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(PhotoError::Because(why)) => self.fates[self.next - 1] = Some(why),
        }
        Ok(())
    }

    /// Reads what instruments, eyes and photographs found on a member.
    fn survey(&mut self, scene: &Scene, member: usize, job: &Job) -> Result<(), PredictError> {
        let photographed = self.photographed.get(&member).map_or(&[][..], Vec::as_slice);
        if photographed.is_empty()
            && survey::of_member(scene, &scene.members[member].id).next().is_none()
        {
            return Ok(());
        }
        match surveyed(scene, member, photographed, &self.settings.profile, job) {
            Ok(Surveyed { evidence, unused }) => {
                self.unheard.extend(unused);
                self.told.extend(evidence.map(|e| (member, e)));
            }
            Err(ForecastError::Cancelled) => return Err(Cancelled.into()),
            Err(ForecastError::Because(why)) => self.fates[self.next - 1] = Some(why),
        }
        Ok(())
    }

    /// Asks an outside source what its items say.
    fn ask(
        &mut self,
        scene: &Scene,
        source: &dyn EvidenceSource,
        member: usize,
        job: &Job,
    ) -> Result<(), PredictError> {
        let (piece, name) = (self.next - 1, source.name());
        let earlier = |item: &Item| matches!(item, Item::Outside(other, m, _) if *m == member && other.name() == name);
        if [CT, GAUGES, FORECAST, SURVEY, PHOTOGRAPHED].contains(&name)
            || self.queue[..piece].iter().any(earlier)
        {
            self.fates[piece] = Some(format!(
                "another source of evidence is called \"{name}\": give this one a name of its own"
            ));
            return Ok(());
        }
        match source.evidence(scene, member, job) {
            Ok(Said { evidence, unused }) => {
                self.unused.extend(unused.into_iter().map(|(item, why)| ((piece, item), why)));
                self.told.extend(evidence.map(|e| (member, Evidence { source: name, ..e })));
            }
            Err(PredictError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(_) if job.is_cancelled() => return Err(Cancelled.into()),
            Err(why) if self.settings.strict => return Err(why),
            Err(why) => self.fates[piece] = Some(why.to_string()),
        }
        Ok(())
    }

    /// What piece `piece` came to, as a later run takes it up. None of lives, which are kept
    /// together, of outside sources, whose data nobody here knows the state of, and of what is not
    /// done.
    fn done(&self, scene: &Scene, piece: usize) -> Option<Done> {
        let fate = self.fates.get(piece)?.clone();
        let fine = fate.is_none();
        match self.queue.get(piece)? {
            Item::Slice(slice) => {
                let slice =
                    if fine { Some(self.readings.get(slice.member)?.last()?.into()) } else { None };
                Some(Done { fate, slice, ..Done::default() })
            }
            Item::Gauges(member) => {
                let id = &scene.members.get(*member)?.id;
                let own = |number: &usize| {
                    scene
                        .structure
                        .readings
                        .get(*number)
                        .is_some_and(|r| gauges::member_of(scene, r) == Some(id))
                };
                let unused = self
                    .unfelt
                    .iter()
                    .filter(|(number, _)| own(number))
                    .map(|(number, why)| (*number, why.clone()))
                    .collect();
                let evidence = self.kept(*member, GAUGES)?;
                let gauges = self.measured.get(member).cloned().unwrap_or_default();
                Some(Done { fate, evidence, unused, gauges, ..Done::default() })
            }
            // It rests on photographs, which are not kept.
            Item::Survey(member) if self.photographed.contains_key(member) => None,
            Item::Survey(member) => {
                let id = &scene.members.get(*member)?.id;
                let unused = survey::of_member(scene, id)
                    .filter_map(|(number, _)| Some((number, self.unheard.get(&number)?.clone())))
                    .collect();
                let evidence = self.kept(*member, SURVEY)?;
                Some(Done { fate, evidence, unused, ..Done::default() })
            }
            Item::Life(_) | Item::Outside(..) | Item::Photograph(..) => None,
        }
    }

    /// What a source said last of a member, as it is kept; `Some(None)` where it said nothing.
    fn kept(&self, member: usize, source: &str) -> Option<Option<evidence::Kept>> {
        let said = self.told.iter().rfind(|(index, e)| *index == member && e.source == source);
        said.map_or(Some(None), |(_, said)| evidence::Kept::of(said).map(Some))
    }

    /// Takes the next piece from an earlier run: whether more are to come. None where it is no such
    /// piece.
    fn take_up(&mut self, Done { fate, slice, evidence, unused, gauges }: Done) -> Option<bool> {
        match self.queue.get(self.next)? {
            Item::Slice(item) => {
                let readings = self.readings.get_mut(item.member)?;
                readings.extend(slice.map(SliceReading::from));
                section::keep_worst_pictures(readings);
            }
            Item::Gauges(member) => {
                let said = if let Some(kept) = evidence { Some(kept.again(GAUGES)?) } else { None };
                self.told.extend(said.map(|e| (*member, e)));
                self.unfelt.extend(unused);
                self.measured.insert(*member, gauges);
            }
            Item::Survey(member) => {
                let said = if let Some(kept) = evidence { Some(kept.again(SURVEY)?) } else { None };
                self.told.extend(said.map(|e| (*member, e)));
                self.unheard.extend(unused);
            }
            Item::Life(_) | Item::Outside(..) | Item::Photograph(..) => return None,
        }
        self.next += 1;
        self.fates.resize(self.next, fate);
        Some(self.next < self.queue.len())
    }

    /// [Advances](Self::advance) and keeps what is done in `parts` under names that begin with
    /// `of`; a piece that an earlier run has kept there is not done again. `of`, or the set's key,
    /// says all that pieces depend on: the scene's hash and the settings.
    ///
    /// # Errors
    /// As [`Self::advance`].
    pub fn advance_kept(
        &mut self,
        scene: &Scene,
        parts: &mut Set,
        of: &str,
        job: &Job,
    ) -> Result<bool, PredictError> {
        let (piece, name, lives) =
            (self.next, format!("{of}, piece {}", self.next), format!("{of}, lives"));
        if piece == 0 {
            self.lives.extend(
                parts.recall::<BTreeMap<String, Vec<Forecast>>>(&lives).unwrap_or_default(),
            );
        }
        if let Some(more) = parts.recall(&name).and_then(|done| self.take_up(done)) {
            return Ok(more);
        }
        let known = self.lives.len();
        let more = self.advance(scene, job);
        if self.lives.len() > known {
            parts.keep(&lives, Vec::new(), &self.lives);
        }
        if let (Ok(_), Some(done)) = (&more, self.done(scene, piece)) {
            parts.keep(&name, Vec::new(), &done);
        }
        more
    }

    /// What is known of a member so far: its slices once all are read, its life once it is
    /// computed.
    #[must_use]
    pub fn evidence(&self, member: usize) -> Vec<Evidence> {
        let told = self.told.iter().filter(|(index, _)| *index == member).map(|(_, e)| e.clone());
        let seen = self
            .is_read(member)
            .then(|| {
                section::seen(&self.readings[member], self.lengths[member], &self.settings.profile)
            })
            .flatten();
        told.chain(seen).collect()
    }

    /// The prediction from what is done so far.
    #[must_use]
    pub fn finish(&self, scene: &Scene) -> Prediction {
        let gathered: Vec<Gathered> =
            (0..self.readings.len().min(scene.members.len())).map(|i| self.gather(i)).collect();
        let items = self.items(scene, &gathered);
        let members: Vec<MemberPrediction> = gathered
            .into_iter()
            .enumerate()
            .map(|(index, gathered)| self.member(scene, index, gathered))
            .collect();
        let silence = |i: &ledger::Item| {
            Some(MissingEvidence {
                member: i.member.clone(),
                source: i.source,
                why: i.why.clone()?,
            })
        };
        Prediction {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            score: score(&members, &self.settings),
            limits: limits(scene, &members, &items),
            silences: items.iter().filter_map(silence).collect(),
            items,
            members,
            profile: self.settings.profile.clone(),
            settings: self.settings.detect,
        }
    }

    /// All evidence of a member, and what becomes of it.
    fn gather(&self, index: usize) -> Gathered {
        let mut gathered = Gathered::default();
        for evidence in self.evidence(index) {
            let fault = evidence.fault();
            gathered.fates.push((evidence.source, fault.clone()));
            if fault.is_none() {
                gathered.evidence.insert(evidence.source, evidence);
            }
        }
        gathered.whole =
            self.settings.profile.fusion.whole(&gathered.evidence.values().collect::<Vec<_>>());
        for (source, why) in gathered.fates.iter_mut().filter(|f| f.1.is_none()) {
            let counted = gathered.whole.counted.contains(source);
            *why = (!counted).then(|| match gathered.evidence[source].measured {
                true => "the grading profile declares correlations that cannot be".into(),
                false => {
                    "what is foretold yields to what is measured, since the two differ by more than chance gives once in twenty".into()
                }
            });
        }
        gathered
    }

    /// The ledger, member by member.
    fn items(&self, scene: &Scene, gathered: &[Gathered]) -> Vec<ledger::Item> {
        let place: BTreeMap<&str, usize> =
            scene.members.iter().enumerate().map(|(i, m)| (m.id.as_str(), i)).collect();
        let of = |id: &str| place.get(id).copied().unwrap_or(scene.members.len());
        let fate = |member: usize, source: &str| {
            gathered.get(member).and_then(|g| g.fates.iter().find(|f| f.0 == source))
        };
        // What becomes of a piece of work: nothing yet, nothing for a reason, or what becomes of
        // its member's evidence of that source.
        let why = |piece: usize, member: usize, source: &str| match self.fates.get(piece) {
            None => Some("it has not been looked at yet".to_owned()),
            Some(Some(why)) => Some(why.clone()),
            Some(None) => fate(member, source)
                .map_or(Some("nothing came of it for this member".into()), |f| f.1.clone()),
        };
        let mut items: Vec<(usize, ledger::Item)> = Vec::new();
        let mut put = |member: usize, id: &str, source, item: String, why| {
            items.push((member, ledger::Item::new(id, source, item, why)))
        };
        let mut invertible: BTreeMap<usize, usize> = BTreeMap::new();
        for (piece, work) in self.queue.iter().enumerate() {
            match work {
                Item::Slice(s) => put(
                    s.member,
                    &scene.members[s.member].id,
                    CT,
                    s.label(),
                    why(piece, s.member, CT),
                ),
                Item::Life(model) => {
                    let members =
                        scene.structure.assembly(model).into_iter().flat_map(|a| &a.members);
                    members.for_each(|id| {
                        put(
                            of(id),
                            id,
                            FORECAST,
                            format!("the life of {}", scene.name_of(model)),
                            why(piece, of(id), FORECAST),
                        )
                    });
                }
                Item::Gauges(member) if gauges::can_simulate(scene, *member) => {
                    let item = "readings simulated from the planted truth".to_owned();
                    put(
                        *member,
                        &scene.members[*member].id,
                        GAUGES,
                        item,
                        why(piece, *member, GAUGES),
                    );
                }
                Item::Gauges(member) => drop(invertible.insert(*member, piece)),
                Item::Survey(member) => {
                    let id = &scene.members[*member].id;
                    for (number, observation) in survey::of_member(scene, id) {
                        let own = self.unheard.get(&number).cloned();
                        let why = own.or_else(|| why(piece, *member, SURVEY));
                        put(*member, id, SURVEY, survey::name(observation), why);
                    }
                }
                Item::Photograph(photo, member) => {
                    let Some(photo) = scene.structure.photographs.get(*photo) else { continue };
                    // Where others looked, too, it is part of what they say.
                    let source = match fate(*member, PHOTOGRAPHED) {
                        Some(_) => PHOTOGRAPHED,
                        None => SURVEY,
                    };
                    let id = &scene.members[*member].id;
                    let why = why(piece, *member, source);
                    put(*member, id, PHOTOGRAPHED, photographed::name(photo), why);
                }
                Item::Outside(source, member, items) => {
                    for (n, item) in items.iter().enumerate() {
                        let own = self.unused.get(&(piece, n)).cloned();
                        let why = own.or_else(|| why(piece, *member, source.name()));
                        put(*member, &scene.members[*member].id, source.name(), item.clone(), why);
                    }
                }
            }
        }
        for (number, reading) in scene.structure.readings.iter().enumerate() {
            let id = gauges::member_of(scene, reading).unwrap_or_default();
            let refused =
                gauges::refusal(scene, reading).or_else(|| self.unfelt.get(&number).cloned());
            let piece = || {
                invertible
                    .get(&of(id))
                    .map_or(Some("nothing is known of its member".into()), |&piece| {
                        why(piece, of(id), GAUGES)
                    })
            };
            put(of(id), id, GAUGES, gauges::reading_name(number, reading), refused.or_else(piece));
        }
        for series in &scene.structure.series {
            let gauge = scene.structure.gauges.iter().find(|g| g.name == series.gauge);
            let id = gauge.map_or("", |g| g.member.as_str());
            let own = self.unmonitored.get(&series.gauge).cloned();
            let said = || match fate(of(id), MONITORING) {
                Some((_, why)) => why.clone(),
                None => Some("its member's life is not computed, which tells creep".into()),
            };
            put(of(id), id, MONITORING, monitoring::name(series), own.or_else(said));
        }
        items.sort_by_key(|i| i.0);
        items.into_iter().map(|i| i.1).collect()
    }

    fn member(
        &self,
        scene: &Scene,
        index: usize,
        Gathered { evidence, whole, .. }: Gathered,
    ) -> MemberPrediction {
        let member = &scene.members[index];
        let assembly = scene.structure.assembly_of(&member.id);
        let matter = assembly.and_then(|a| a.matter.as_ref());
        let profile = &self.settings.profile;
        let said: Vec<&Evidence> =
            evidence.values().filter(|e| whole.counted.contains(e.source)).collect();
        let damage = whole.damage();
        let zone_basis = Basis::by_zone(&said);
        let verdict = Verdict::of(profile, damage, &profile.cracks(&said), Basis::of(&zone_basis));
        let widest = evidence
            .values()
            .filter_map(|e| Some((e.source, e.crack_width_mm?)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let found = survey::of_member(scene, &member.id).map(|(_, o)| o);
        let photographed = self.photographed.get(&index).map_or(&[][..], Vec::as_slice);
        let mut conflicts = whole.conflicts.clone();
        conflicts.extend(unforeseen(found.chain(photographed), evidence.get(FORECAST)));
        MemberPrediction {
            id: member.id.clone(),
            name: member.name.clone(),
            kind: member.kind,
            concrete: of_what(&member.concrete, matter),
            concrete_assumed: member.concrete_assumed,
            damage: damage.map(|d| d.value),
            damage_std_error: damage.map(|d| d.std_error),
            state: verdict.state,
            state_probability: verdict.probability,
            state_run: verdict.run,
            basis: verdict.basis,
            zone_basis,
            advice: verdict.advice,
            within_months: verdict.within_months,
            states: shares(&whole, profile),
            crack_check: widest.and_then(|widest| crack_check(scene, member, widest, profile)),
            conflict: !conflicts.is_empty(),
            zones: whole.zones,
            causes: whole.causes,
            worst_zone: whole.worst,
            conflicts,
            truth: self.truth(member, &self.readings[index]),
            defects: defects(scene, &member.id, photographed, &self.readings[index]),
            gauges: self.measured.get(&index).cloned().unwrap_or_default(),
            evidence,
            slices: self.readings[index].clone(),
        }
    }

    /// Where slices were drawn or scanned, the pores and cracks that are truly in them and all else
    /// that was planted; where there are none, what was planted; else what was labelled.
    fn truth(&self, member: &Member, readings: &[SliceReading]) -> Option<Truth> {
        let profile = &self.settings.profile;
        let known: Vec<&SliceTruth> = readings.iter().filter_map(|r| r.truth.as_ref()).collect();
        let whole = !known.is_empty() && known.len() == readings.len();
        let made = whole && readings.iter().all(|r| r.origin != Origin::File);
        let zones = if made {
            // Air is what slices truly have, or what was planted where that is more, and of cracks
            // no less than the slices of a zone show; all else is planted, whether a slice meets it
            // or not.
            let air = |r: &SliceReading| {
                Some(
                    profile
                        .rule
                        .damage(
                            Estimate { value: r.truth.as_ref()?.porosity, std_error: 0.0 },
                            &[],
                            1.0,
                        )
                        .value,
                )
            };
            let of_slices = section::standing(readings, air, |d| d);
            let own = |zone| {
                let inside = readings.iter().filter(|r| r.along.map(zone_at) == Some(zone));
                inside.filter_map(|r| Some(r.truth.as_ref()?.damage)).fold(0.0, f64::max)
            };
            let [pores, cracks, besides] = truth::parts(member, &profile.rule);
            Some(std::array::from_fn(|zone| {
                let air = of_slices[zone].unwrap_or(0.0).max(pores[zone]);
                together([together([air, cracks[zone]]).max(own(zone)), besides[zone]])
            }))
        } else if readings.is_empty() && !member.truth.is_empty() {
            Some(truth::planted(member, &profile.rule))
        } else {
            None
        };
        // The truth of some sections is not that of the member's worst one.
        let labelled = || whole.then(|| known.iter().map(|t| t.damage).fold(0.0, f64::max));
        let damage =
            zones.map(|z: [f64; ZONES]| z.into_iter().fold(0.0, f64::max)).or_else(labelled)?;
        Some(Truth {
            damage,
            zones,
            state: profile.state(damage, 0.0).map(|s| s.name.clone()).unwrap_or_default(),
            porosity: (!known.is_empty())
                .then(|| known.iter().map(|t| t.porosity).sum::<f64>() / known.len() as f64),
            crack_width_mm: known.iter().filter_map(|t| t.widest_mm).reduce(f64::max),
            origin: if zones.is_some() { "planted" } else { "labelled" },
            not_visible: if zones.is_some() {
                member.truth.iter().filter_map(|d| not_visible(d, member, readings)).collect()
            } else {
                Vec::new()
            },
        })
    }
}

/// Diagonal cracks that the member's life, as it was computed, does not open: shear that nobody
/// foretold, or ground that gave way. Each in words.
fn unforeseen<'a>(
    found: impl Iterator<Item = &'a Observation>,
    forecast: Option<&Evidence>,
) -> Vec<String> {
    let Some(forecast) = forecast else { return Vec::new() };
    let foretold = forecast.crack_width_mm.unwrap_or(0.0);
    let one = |o: &Observation| match o.shows {
        Shows::Crack { width_mm, std_error_mm, course: Course::Diagonal, .. }
            if width_mm - 1.96 * std_error_mm > foretold =>
        {
            let [from, to] = o.spot.along;
            Some(format!(
                "{}: a diagonal crack {width_mm:.2} ± {std_error_mm:.2} mm wide at {:.2} of the axis, where the forecast opens none wider than {foretold:.2} mm",
                o.name,
                0.5 * (from + to),
            ))
        }
        _ => None,
    };
    found.filter_map(one).collect()
}

/// What the rest of the structure does to a model; where members bear as one but this one is no
/// part of that, why it is computed by itself.
fn part_of<'a>(
    frame: &'a Option<Result<Option<frame::Whole>, String>>,
    model: &str,
) -> (Option<&'a Handed>, Option<String>) {
    match frame {
        Some(Ok(Some(whole))) => match whole.handed(model) {
            Some(handed) => (Some(handed), None),
            None => (None, Some("it is no part of the whole and computed by itself".into())),
        },
        Some(Err(why)) => (None, Some(format!("it is computed by itself, since {why}"))),
        Some(Ok(None)) | None => (None, None),
    }
}

/// Shares of the known zones that are to be expected in each state.
fn shares(whole: &Whole, profile: &Profile) -> BTreeMap<String, f64> {
    let known: Vec<Estimate> = whole.zones.0.iter().flatten().copied().collect();
    let mut shares = BTreeMap::new();
    for zone in &known {
        for (state, p) in Verdict::of(profile, Some(*zone), &[], Basis::Measured).probability {
            *shares.entry(state).or_default() += p / known.len() as f64;
        }
    }
    shares
}

fn crack_check(
    scene: &Scene,
    member: &Member,
    (source, width_mm): (&'static str, f64),
    profile: &Profile,
) -> Option<CrackCheck> {
    let exposure = member.exposure.as_ref()?.class.clone();
    let prestressed =
        scene.structure.assembly_of(&member.id).is_some_and(|a| a.has_tendons(&member.id));
    let limit_mm = profile.crack_limit(&exposure, prestressed)?;
    Some(CrackCheck { width_mm, source, limit_mm, exposure, exceeded: width_mm > limit_mm })
}

/// Planted damage that no slice of the member shows: none shows the whole section there, or its
/// bars.
fn not_visible(damage: &Damage, member: &Member, readings: &[SliceReading]) -> Option<String> {
    let shown = |from: f32, to: f32, shows: &dyn Fn(&SliceReading) -> bool| {
        readings.iter().any(|r| {
            r.along.is_some_and(|along| (f64::from(from)..=f64::from(to)).contains(&along))
                && shows(r)
        })
    };
    match *damage {
        Damage::Spall { along, diameter_m, depth_m, .. } => {
            let reach = 0.5 * diameter_m / member.frame.axis.length().max(1e-6);
            let hidden = !shown(along - reach, along + reach, &|r| r.lost.is_some());
            hidden.then(|| format!("spall, {:.0} mm deep", 1e3 * depth_m))
        }
        Damage::Corrosion { from, to, section_loss } => {
            let hidden = !shown(from, to, &|r| r.steel.is_some());
            hidden.then(|| format!("corrosion, {:.0} % of the bars' section", 1e2 * section_loss))
        }
        Damage::Softened { damage, .. } => Some(format!("softened zone, d = {damage:.2}")),
        Damage::Crack { along, width_mm, .. } => {
            // Its rough surface wanders by centimetres along members of metres.
            let reach = 0.02;
            let hidden = !shown(along - reach, along + reach, &|r| {
                r.truth.as_ref().is_some_and(|t| t.cracks > 0)
            });
            hidden.then(|| format!("crack, {width_mm} mm wide"))
        }
        Damage::Honeycomb { along, length_m, porosity } => {
            let reach = 0.5 * length_m / member.frame.axis.length().max(1e-6);
            let hidden = !shown(along - reach, along + reach, &|_| true);
            hidden.then(|| format!("honeycomb, {:.0} % air", 1e2 * porosity))
        }
        Damage::Voids { .. } => None,
    }
}

/// Scores members whose truth is known, of one scene or of many.
#[must_use]
pub fn score(members: &[MemberPrediction], settings: &PredictSettings) -> MemberScore {
    Compared::of(members).score(&settings.profile)
}

/// Predictions beside what is true: all that scores rest on.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Compared {
    members: Vec<Outcome>,
    zones: Vec<Vec<Outcome>>,
    porosities: Vec<Outcome>,
    widths: Vec<Outcome>,
    slices: Vec<Tally>,
}

impl Compared {
    /// Of members whose truth is known.
    #[must_use]
    pub fn of(members: &[MemberPrediction]) -> Self {
        let outcome = |m: &MemberPrediction| {
            Some(Outcome {
                truth: m.truth.as_ref()?.damage,
                damage: m.damage?,
                std_error: m.damage_std_error?,
            })
        };
        let zones = |m: &MemberPrediction| {
            let truth = m.truth.as_ref()?.zones?;
            let of = |(truth, known): (f64, &Option<Estimate>)| {
                known.map(|r| Outcome { truth, damage: r.value, std_error: r.std_error })
            };
            Some(truth.into_iter().zip(&m.zones.0).filter_map(of).collect::<Vec<_>>())
        };
        let readings = || members.iter().flat_map(|m| &m.slices);
        let porosity = |r: &SliceReading| {
            Some(Outcome {
                truth: r.truth.as_ref()?.porosity,
                damage: r.porosity.value,
                std_error: r.porosity.std_error,
            })
        };
        let width = |r: &SliceReading| {
            let found = r.cracks.iter().map(|c| c.width_mm).reduce(f64::max)?;
            Some(Outcome { truth: r.truth.as_ref()?.widest_mm?, damage: found, std_error: 0.0 })
        };
        Self {
            members: members.iter().filter_map(outcome).collect(),
            zones: members.iter().filter_map(zones).collect(),
            porosities: readings().filter_map(porosity).collect(),
            widths: readings().filter_map(width).collect(),
            slices: readings().filter_map(|r| Some(r.truth.as_ref()?.tally)).collect(),
        }
    }

    /// Adds others, which come after these.
    pub fn extend(&mut self, more: Self) {
        self.members.extend(more.members);
        self.zones.extend(more.zones);
        self.porosities.extend(more.porosities);
        self.widths.extend(more.widths);
        self.slices.extend(more.slices);
    }

    /// How good they are.
    #[must_use]
    pub fn score(self, profile: &Profile) -> MemberScore {
        let mut tally = Tally::default();
        self.slices.into_iter().for_each(|t| tally += t);
        MemberScore::of(&Cases {
            members: self.members,
            severe_from: profile.severe_from,
            damaged_from: profile.damaged_from(),
            zones: self.zones,
            porosities: self.porosities,
            widths: self.widths,
            slices: tally.score(),
        })
    }
}

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

fn limits(scene: &Scene, members: &[MemberPrediction], items: &[ledger::Item]) -> Vec<String> {
    let mut limits = vec![
        "Damage is the share of strength lost in the worst zone (a tenth of the length). Of a zone without a slice of its own the others speak as far as the grading profile's correlation lengths reach, with an error that grows.".to_owned(),
        "Slices show pores and cracks, and where they show the whole section what has fallen off and how much of its bars is left; they do not show lost stiffness, nor what lies between them. A forecast knows of loads and chlorides, not of bad workmanship; gauges feel stiffness, not strength. The error bars allow for that by what the grading profile declares.".to_owned(),
        "The rule that turns sections into damage is the profile's, and is not part of the error bars.".to_owned(),
        "Cracks that run through large voids or honeycomb, or are much narrower than a third of a pixel, are missed; a gap along a bar counts as a crack.".to_owned(),
        "Forecasts are made on coarse elements; widths of foretold cracks are those of EN 1992-1-1, 7.3.4, where bars run along the member.".to_owned(),
    ];
    if scene.structure.bears_as_one() {
        limits.push("Members hand loads on as an elastic frame of whole sections does: what cracks and hands its load to others, and what falls, is not foretold.".to_owned());
    }
    let silent = members.iter().filter(|m| m.damage.is_none()).count();
    if silent > 0 {
        limits.insert(
            0,
            format!(
                "{silent} of {} members have no evidence: that is not the same as sound.",
                members.len()
            ),
        );
    }
    let unmeasured = members.iter().filter(|m| m.basis == Basis::Foretold).count();
    if unmeasured > 0 {
        limits.insert(
            0,
            format!("Of {unmeasured} members nothing was measured: their damage is foretold only."),
        );
    }
    let unused = items.iter().filter(|i| !i.used).count();
    if unused > 0 {
        limits.insert(
            0,
            format!(
                "{unused} of {} items of evidence were not used; the ledger says why.",
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
        limits.insert(0, format!("Of {unpredicted} members the truth is known but nothing was predicted; they are not part of the score."));
    }
    let made = |origin: Origin| members.iter().flat_map(|m| &m.slices).any(|r| r.origin == origin);
    if made(Origin::Scanned) {
        limits.insert(0, format!("Some slices are {}: X-rays through the planted truth, with scatter, hardening, noise and their corrections, but with concrete of this program's making.", scanned::MARK));
    }
    if made(Origin::Drawn) {
        limits.insert(0, format!("Some slices are {MARK}: pictures made from the planted truth. Their scores show that the chain works, not how it would do in the field."));
    }
    limits
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
                "Rust of {assumed} members is foretold by values assumed for their exposure class, which are in predict.json; their spread is in the error."
            ),
        ),
        (
            unknown,
            format!(
                "Rust of bars is not computed for {unknown} members (their forecasts say why): that is not the same as none."
            ),
        ),
        (
            undecided,
            format!(
                "Of {undecided} members the error bar leaves open which state they are in: none has a probability of {NAMED}."
            ),
        ),
    ];
    lines.into_iter().filter(|(n, _)| *n > 0).map(|(_, line)| line).collect()
}

/// Predicts the damage of every member: reads all slices, computes lives, asks outside `sources`,
/// fuses.
///
/// # Errors
/// A slice is missing or bad, another source failed, or the job was cancelled.
pub fn predict(
    scene: &Scene,
    settings: PredictSettings,
    sources: &Sources,
    job: &Job,
) -> Result<Prediction, PredictError> {
    let mut predictor = Predictor::new(scene, settings, sources);
    while predictor.advance(scene, job)? {}
    job.step(1, 1)?;
    Ok(predictor.finish(scene))
}
/// What a member is of, for people.
fn of_what(concrete: &str, matter: Option<&Matter>) -> String {
    match matter {
        Some(matter) => format!("{}, computed as {concrete}", matter.name),
        None => concrete.to_owned(),
    }
}
