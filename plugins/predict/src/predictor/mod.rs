//! The main job: everything known about a member becomes one damage with an error bar and a state,
//! and a score where the truth is known.
//!
//! [`Predictor`] works piece by piece (a slice, a member's life), so that a window can show it
//! between frames; [`predict`] runs it to the end.

mod together;

pub(crate) use together::admitted_width;

use std::collections::BTreeMap;
use std::collections::BTreeSet;
use std::sync::Arc;

use intrados_ct::{
    SliceError,
    source::{SliceShelf, SliceSource},
};
use intrados_damage::{
    EvidenceError,
    evidence::{self, Evidence, EvidenceSource, Said, Sources},
    grading::Profile,
    ledger,
};
use intrados_forecast as forecast;
use intrados_forecast::{
    Capacity, FORECAST, Forecast, ForecastError, ForecastSettings, Losses, forecast,
};
use intrados_gauges as gauges;
use intrados_gauges::{GAUGES, GaugeError, GaugeReading, monitoring};
use intrados_mechanics::frame;
use intrados_scene::{Assembly, Scene};
use intrados_stage::{Cancelled, Job, file::Set};
use intrados_survey as survey;
use intrados_survey::{
    SURVEY, Surveyed,
    photographed::{self, PHOTOGRAPHED, PhotoError, Shown},
    surveyed,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    CT, Origin, PredictError, PredictSettings, SliceReading,
    compared::score,
    defect::has_defects,
    limits::limits,
    prediction::{MemberFailure, MemberPrediction, MissingEvidence, Prediction, SCHEMA},
    section,
};

use together::{Gathered, part_of};

/// What all lives of a scene may take, as [`MarchSettings::work`] counts it: some 25 minutes on two
/// cores, if every life takes its share; few do.
///
/// [`MarchSettings::work`]: intrados_mechanics::model::MarchSettings::work
const WORK: f64 = 2e9;
/// What one life may take at least, about 15 CPU-seconds, and at most, about 40 minutes.
const LEAST_WORK: f64 = 1e7;
const MOST_WORK: f64 = 1.5e9;

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
    photographed: BTreeMap<usize, Shown>,
    /// Observations that count for nothing, by their number, and why.
    unheard: BTreeMap<usize, String>,
    /// Items of outside sources that count for nothing, by piece and number, and why.
    unused: BTreeMap<(usize, usize), String>,
    /// By model, the lives that have been computed.
    lives: BTreeMap<String, Vec<Forecast>>,
    /// By model, what has been computed of its strength; or why nothing has.
    strengths: BTreeMap<String, Borne>,
    /// By model, why what was computed of its strength does not even carry what acts.
    overloaded: BTreeMap<String, String>,
    /// Lives that end by what was only assumed, one line each.
    to_check: Vec<String>,
    /// What every member's rest does to it, once a life has asked for it; or why nobody knows.
    frame: Option<Result<Option<frame::Whole>, String>>,
}

/// What a piece of work came to, as it is kept between two runs.
#[derive(Default, Serialize, Deserialize)]
struct Done {
    fate: Option<String>,
    slice: Option<section::Kept>,
    evidence: Option<evidence::Kept>,
    unused: BTreeMap<usize, String>,
    gauges: Vec<GaugeReading>,
    strength: Option<Bears>,
}

/// Keeps a life of a model.
type KeepLife<'a> = dyn Fn(&str, &[Forecast]) + Sync + 'a;

/// What is known of a model's strength: [`Capacity`], none where nothing can be raised, or why
/// nobody knows.
type Borne = Result<Option<Capacity>, String>;

/// What a model bears, and with what of its members lost: another run may know of other losses.
#[derive(Serialize, Deserialize)]
struct Bears {
    losses: BTreeMap<String, Losses>,
    found: Borne,
    /// Whether it does not even carry what acts.
    #[serde(default)]
    is_overloaded: bool,
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
    /// What a model bears with all that is known by then.
    Strength(String),
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
            Self::Strength(_) => 300.0,
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
        if settings.strength || settings.profile.by_strength {
            queue.extend(forecast::models(scene).into_iter().map(Item::Strength));
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
            strengths: BTreeMap::new(),
            overloaded: BTreeMap::new(),
            to_check: Vec::new(),
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
            Some(Item::Strength(model)) => self.label_of_strength(model),
            Some(Item::Gauges(_)) => "what strain gauges say".into(),
            Some(Item::Survey(_)) => "what was surveyed".into(),
            Some(Item::Photograph(..)) => "what a photograph shows".into(),
            Some(Item::Outside(source, ..)) => format!("what {} says", source.name()),
            None => String::new(),
        }
    }

    /// What people call what a model bears.
    fn label_of_strength(&self, model: &str) -> String {
        format!("the strength of {}", self.name(model))
    }

    /// What people call the lives of some models.
    fn label_of(&self, models: &[String]) -> String {
        let names: Vec<&str> = models.iter().map(|id| self.name(id)).collect();
        format!("the life of {}", names.join(" and "))
    }

    fn name<'a>(&'a self, id: &'a str) -> &'a str {
        self.names.get(id).map_or(id, String::as_str)
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
        self.advance_with(scene, job, &|_, _| {})
    }

    /// [`Self::advance`]; `keep` is told every life as soon as it is computed.
    fn advance_with(
        &mut self,
        scene: &Scene,
        job: &Job,
        keep: &KeepLife<'_>,
    ) -> Result<bool, PredictError> {
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
            Item::Life(_) => self.foretell(scene, &lives, &job, keep),
            Item::Gauges(member) => self.feel(scene, member, &job),
            Item::Survey(member) => self.survey(scene, member, &job),
            Item::Photograph(photo, member) => self.behold(scene, photo, member, &job),
            Item::Outside(source, member, _) => self.ask(scene, source.as_ref(), member, &job),
            Item::Strength(model) => self.raise(scene, &model, &job),
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

    /// The most work of a life: of many, each has its share of [`WORK`].
    fn share(&self) -> f64 {
        let lives = self.queue.iter().filter(|item| matches!(item, Item::Life(_))).count();
        (WORK / lives.max(1) as f64).clamp(LEAST_WORK, MOST_WORK)
    }

    /// Lives side by side, which know nothing of each other; what they tell is kept in their order.
    fn foretell(
        &mut self,
        scene: &Scene,
        models: &[String],
        job: &Job,
        keep: &KeepLife<'_>,
    ) -> Result<(), PredictError> {
        let Some(settings) = self.settings.forecast else { return Ok(()) };
        let settings = ForecastSettings { work: settings.work.or(Some(self.share())), ..settings };
        if models.iter().any(|model| !self.lives.contains_key(model)) {
            self.join(scene, job)?;
            job.relabel(self.label_of(models));
        }
        let rule = &self.settings.profile.rule;
        // Of several at once the first tells how far they are.
        let part = |k: usize| if k == 0 { job.part(0.0, 1.0) } else { job.part(0.0, 0.0) };
        let (known, frame) = (&self.lives, &self.frame);
        let life = |(k, model): (usize, &String)| {
            if let Some(known) = known.get(model) {
                return Ok(known.clone());
            }
            let (handed, note) = part_of(frame, model);
            let mut told = forecast(scene, model, handed, rule, settings, &part(k))?;
            told.iter_mut().for_each(|one| one.notes.extend(note.clone()));
            keep(model, &told);
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
                Err(ForecastError::Assumed(why)) => {
                    let line = format!("{}: {why}", self.name(&models[k]));
                    self.to_check.push(line);
                    self.fates[first + k] = Some(why);
                    continue;
                }
                Err(why) => {
                    self.fates[first + k] = Some(why.to_string());
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
                if let (None, Some(stressed)) = (&foretold, &one.elastic) {
                    self.fates[first + k] = Some(stressed.told());
                }
                self.told.extend(foretold.into_iter().chain(monitored).map(|e| (index, e)));
            }
        }
        Ok(())
    }

    /// Computes what all members do to each other, once.
    fn join(&mut self, scene: &Scene, job: &Job) -> Result<(), PredictError> {
        if self.frame.is_none() {
            let found = frame::joined(scene, job);
            job.step(0, 1)?;
            self.frame = Some(found.map_err(|why| why.to_string()));
        }
        Ok(())
    }

    /// What a model bears with what is known of its members by now.
    fn raise(&mut self, scene: &Scene, model: &str, job: &Job) -> Result<(), PredictError> {
        self.join(scene, job)?;
        job.relabel(self.label_of_strength(model));
        let losses = self.losses_of(scene, model);
        let (handed, _) = part_of(&self.frame, model);
        let found = match forecast::capacity(scene, model, handed, &losses, job) {
            Ok(found) => Ok(found),
            Err(ForecastError::Cancelled) => return Err(Cancelled.into()),
            Err(ForecastError::Fails(why)) => {
                self.overloaded.insert(model.to_owned(), why.clone());
                Err(why)
            }
            Err(why) => Err(why.to_string()),
        };
        self.strengths.insert(model.to_owned(), found);
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
        let shown = self.photographed.get(&member);
        let photographed = shown.map_or(&[][..], |shown| &shown.observations);
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
            Err(why) => self.fates[self.next - 1] = Some(why.to_string()),
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
            Err(EvidenceError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(_) if job.is_cancelled() => return Err(Cancelled.into()),
            Err(why) if self.settings.strict => return Err(why.into()),
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
            Item::Strength(model) => {
                let found = self.strengths.get(model)?.clone();
                let is_overloaded = self.overloaded.contains_key(model);
                let losses = self.losses_of(scene, model);
                let strength = Some(Bears { losses, found, is_overloaded });
                Some(Done { fate, strength, ..Done::default() })
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
    fn take_up(&mut self, scene: &Scene, done: Done) -> Option<bool> {
        let Done { fate, slice, evidence, unused, gauges, strength } = done;
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
            Item::Strength(model) => {
                let kept = strength.filter(|s| s.losses == self.losses_of(scene, model))?;
                if let (true, Err(why)) = (kept.is_overloaded, &kept.found) {
                    self.overloaded.insert(model.clone(), why.clone());
                }
                self.strengths.insert(model.clone(), kept.found);
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
        let (piece, name) = (self.next, format!("{of}, piece {}", self.next));
        let name_of_life = |model: &str| format!("{of}, life of {model}");
        if piece == 0 {
            for item in &self.queue {
                let Item::Life(model) = item else { continue };
                if let Some(known) = parts.recall(&name_of_life(model)) {
                    self.lives.insert(model.clone(), known);
                }
            }
        }
        if let Some(more) = parts.recall(&name).and_then(|done| self.take_up(scene, done)) {
            return Ok(more);
        }
        // Of lives side by side one may take much longer than the others, which are kept at once.
        let kept = &*parts;
        let keep = |model: &str, told: &[Forecast]| {
            kept.keep(&name_of_life(model), Vec::new(), &told);
        };
        let more = self.advance_with(scene, job, &keep);
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

    /// Whether anything has been found to be wrong with a member so far, beside cracks within
    /// `limit_mm`.
    #[must_use]
    pub(crate) fn has_found(&self, scene: &Scene, member: usize, limit_mm: Option<f64>) -> bool {
        let (Some(readings), Some(m)) = (self.readings.get(member), scene.members.get(member))
        else {
            return false;
        };
        let nothing = Shown::default();
        let photographed = self.photographed.get(&member).unwrap_or(&nothing);
        has_defects(scene, &m.id, photographed, readings, limit_mm)
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
            failures: failures(&members),
            assumptions_to_check: self.to_check.clone(),
            score: score(&members, &self.settings),
            limits: limits(
                scene,
                &members,
                &items,
                &self.unraised(),
                &self.to_check,
                self.settings.profile.by_strength,
            ),
            silences: items.iter().filter_map(silence).collect(),
            doubts: scene
                .warnings
                .iter()
                .chain(self.photographed.values().flat_map(|shown| &shown.doubts))
                .cloned()
                .collect(),
            items,
            members,
            profile: self.settings.profile.clone(),
            settings: self.settings.detect,
        }
    }
}

/// Members whose computed life ends, the soonest first.
fn failures(members: &[MemberPrediction]) -> Vec<MemberFailure> {
    let failure = |m: &MemberPrediction| {
        let end = m.failure.as_ref()?;
        Some(MemberFailure {
            member: m.id.clone(),
            name: m.name.clone(),
            reason: end.sentence(),
            ahead_years: end.ahead_years,
        })
    };
    let mut all: Vec<MemberFailure> = members.iter().filter_map(failure).collect();
    all.sort_by(|a, b| a.ahead_years.total_cmp(&b.ahead_years));
    all
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
