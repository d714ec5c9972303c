//! The main job: everything known about a member becomes one damage with an error bar and a state, and a score where the truth is known.
//!
//! [`Predictor`] works slice by slice, so that a window can show it between frames; [`predict`] runs it to the end.

use std::{collections::BTreeMap, path::PathBuf};

use intrados_scene::{Damage, MemberKind, Scene, Slices};
use intrados_stage::{Cancelled, Job};
use serde::Serialize;
use serde_json::json;

use crate::{
    crack::{self, Crack},
    detect::{self, DetectError, Detection, Pore, Reading, detect},
    drawn::{self, MARK},
    evidence::{Evidence, EvidenceSource, fuse},
    grading::{NO_EVIDENCE, Profile},
    grid::Mask,
    picture::{Picture, slice_pictures},
    score::{MemberScore, Outcome, Score, Tally},
    slice::{Slice, read_masks},
};

/// Schema of the JSON.
pub const SCHEMA: &str = "intrados.predict/1";

/// The source name of evidence from CT slices.
pub const SEEN: &str = "seen";

/// How to predict.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// How slices are read.
    pub detect: detect::Settings,
    /// How sections become damage and damage becomes a state.
    pub profile: Profile,
}

/// Why there is no prediction.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// A file of slices or masks.
    #[error(transparent)]
    Slice(#[from] intrados_xray::volume::VolumeError),
    /// A slice that cannot be read.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// A slice that cannot be drawn.
    #[error("member {member}: {reason}")]
    Drawn {
        /// Name of the member.
        member: String,
        /// What is wrong.
        reason: String,
    },
    /// The scene is not the one that the work began with.
    #[error("the scene changed while its damage was being predicted; begin again")]
    Changed,
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// The prediction for a scene. Serialises to `intrados.predict/1`.
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
    pub settings: detect::Settings,
    /// What the prediction does not say.
    pub limits: Vec<String>,
    /// Files written beside it.
    pub files: Vec<String>,
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
    /// State by the profile, or [`NO_EVIDENCE`].
    pub state: String,
    /// What the profile says should be done.
    pub advice: String,
    /// Whether pieces of evidence contradict each other.
    pub conflict: bool,
    /// Evidence by its source.
    pub evidence: BTreeMap<&'static str, Evidence>,
    /// Truth where it is known.
    pub truth: Option<Truth>,
    /// The slices, one by one.
    pub slices: Vec<SliceReading>,
}

/// Planted or labelled damage, by the same rule as the prediction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// Damage d of the worst inspected section.
    pub damage: f64,
    /// State by the profile.
    pub state: String,
    /// Mean porosity of the inspected sections.
    pub porosity: f64,
    /// `"planted"` or `"labelled"`.
    pub origin: &'static str,
    /// Planted damage that slices cannot show, in words; it is not part of `damage`.
    pub not_visible: Vec<String>,
}

/// What was read in one slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SliceReading {
    /// Name of the core.
    pub core: String,
    /// File, or what drew it.
    pub name: String,
    /// Whether it was drawn and not scanned.
    pub drawn: bool,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
    /// Area of the body, mm².
    pub body_mm2: f64,
    /// Number of pores.
    pub pores: usize,
    /// Pore area over body area, with the error of reading this slice.
    pub porosity: Reading,
    /// Standard error of that porosity as a sample of the concrete around it.
    pub sampling_error: f64,
    /// The cracks.
    pub cracks: Vec<Crack>,
    /// Damage of this section.
    pub damage: Reading,
    /// Truth where it is known.
    pub truth: Option<SliceTruth>,
    /// The pores one by one.
    #[serde(skip)]
    pub table: Vec<Pore>,
    /// Slice and overlay, kept for the two worst slices of a member.
    #[serde(skip)]
    pub pictures: Option<[Picture; 2]>,
}

/// What is truly in one slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SliceTruth {
    /// Porosity, cracks excluded.
    pub porosity: f64,
    /// Damage by the same rule.
    pub damage: f64,
    /// Number of cracks.
    pub cracks: usize,
    /// How well pixels and objects were found.
    pub score: Score,
    #[serde(skip)]
    tally: Tally,
}

/// Pictures kept for a member.
const PICTURES: usize = 2;

/// Work that goes on slice by slice.
#[derive(Debug, Clone)]
pub struct Predictor {
    settings: Settings,
    hash: String,
    queue: Vec<Item>,
    next: usize,
    readings: Vec<Vec<SliceReading>>,
}

/// One slice that waits to be read.
#[derive(Debug, Clone)]
struct Item {
    member: usize,
    core: String,
    what: What,
}

#[derive(Debug, Clone)]
enum What {
    File { image: PathBuf, masks: Vec<PathBuf>, pixel_mm: f32 },
    Drawn(drawn::Request),
}

impl Predictor {
    /// Lists the slices to read.
    #[must_use]
    pub fn new(scene: &Scene, settings: Settings) -> Self {
        let mut queue = Vec::new();
        for (member, slices) in scene.members.iter().enumerate().flat_map(|(n, m)| m.slices.iter().map(move |s| (n, s))) {
            match slices {
                Slices::Files { name, images, masks, pixel_mm } => {
                    queue.extend(images.iter().enumerate().map(|(k, image)| Item {
                        member,
                        core: name.clone(),
                        what: What::File { image: image.clone(), masks: masks.get(k).cloned().unwrap_or_default(), pixel_mm: *pixel_mm },
                    }));
                }
                &Slices::Drawn { ref name, count, size, pixel_mm, seed } => queue.extend((0..count.min(drawn::MOST_SLICES)).map(|index| {
                    Item { member, core: name.clone(), what: What::Drawn(drawn::Request { index, count, size, pixel_mm, seed }) }
                })),
            }
        }
        Self { settings, hash: scene.hash.clone(), queue, next: 0, readings: vec![Vec::new(); scene.members.len()] }
    }

    /// Slices read and slices in all.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.next, self.queue.len())
    }

    /// Members whose slices have all been read and who had any.
    #[must_use]
    pub fn is_read(&self, member: usize) -> bool {
        self.readings.get(member).is_some_and(|r| !r.is_empty()) && self.queue[self.next..].iter().all(|item| item.member != member)
    }

    /// Reads the next slice. `false` once all are read.
    ///
    /// # Errors
    /// The slice is missing or bad, or the job was cancelled. The slice is skipped by calling again.
    pub fn advance(&mut self, scene: &Scene, job: &Job) -> Result<bool, PredictError> {
        let Some(item) = self.queue.get(self.next) else { return Ok(false) };
        if scene.hash != self.hash || scene.members.len() != self.readings.len() {
            return Err(PredictError::Changed);
        }
        job.step(self.next, self.queue.len())?;
        self.next += 1;
        let reading = self.read(scene, item)?;
        let readings = &mut self.readings[item.member];
        readings.push(reading);
        keep_worst_pictures(readings);
        Ok(self.next < self.queue.len())
    }

    fn read(&self, scene: &Scene, item: &Item) -> Result<SliceReading, PredictError> {
        let (slice, known) = match &item.what {
            What::File { image, masks, pixel_mm } => {
                let slice = Slice::read(image, *pixel_mm)?;
                let labels = if masks.is_empty() { None } else { Some(Known::Labels(read_masks(masks, &slice)?)) };
                (slice, labels)
            }
            What::Drawn(request) => {
                let member = || scene.members[item.member].name.clone();
                let drawn = drawn::draw(scene, item.member, *request).map_err(|reason| PredictError::Drawn { member: member(), reason })?;
                (drawn.slice.clone(), Some(Known::Drawn(drawn)))
            }
        };
        // Inside one slice nobody waits long enough to want a cancel.
        let found = detect(&slice, &self.settings.detect, &Job::default())?;
        let rule = &self.settings.profile.rule;
        let section_mm = side_mm(found.body.count(), slice.pixel_mm);
        let truth = known.as_ref().and_then(|known| self.truth(known, &found));
        Ok(SliceReading {
            core: item.core.clone(),
            drawn: matches!(item.what, What::Drawn(_)),
            pixel_mm: slice.pixel_mm,
            body_mm2: section_mm * section_mm,
            pores: found.pores.len(),
            porosity: found.porosity,
            sampling_error: found.sampling_error,
            damage: rule.damage(found.porosity, &found.cracks, section_mm),
            pictures: Some(slice_pictures(&found, known.as_ref().map(Known::mask))),
            name: slice.name,
            truth,
            cracks: found.cracks,
            table: found.pores,
        })
    }

    fn truth(&self, known: &Known, found: &Detection) -> Option<SliceTruth> {
        let exact = |value| Reading { value, std_error: 0.0 };
        let tally = Tally::of(&found.mask(), known.mask())?;
        let rule = &self.settings.profile.rule;
        let (porosity, cracks, body) = match known {
            Known::Drawn(drawn) => (drawn.porosity, drawn.cracks.clone(), drawn.body_area),
            Known::Labels(mask) => {
                let cracks = crack::find_in_labels(mask, found.pixel_mm, &self.settings.detect.crack);
                let pores = mask.data.iter().zip(&cracks.mask.data).filter(|(m, c)| **m && !**c).count();
                (pores as f64 / found.body.count() as f64, cracks.list, found.body.count())
            }
        };
        let damage = rule.damage(exact(porosity), &cracks, side_mm(body, found.pixel_mm)).value;
        Some(SliceTruth { porosity, damage, cracks: cracks.len(), score: tally.score(), tally })
    }

    /// What the slices of a member say; `None` if it has none.
    #[must_use]
    pub fn seen(&self, member: usize) -> Option<Evidence> {
        let readings = self.readings.get(member)?;
        let worst = readings.iter().max_by(|a, b| a.damage.value.total_cmp(&b.damage.value))?;
        let porosity = mean_porosity(readings);
        let width = readings.iter().flat_map(|r| &r.cracks).map(|c| c.width_mm).reduce(f64::max);
        let drawn = readings.iter().filter(|r| r.drawn).count();
        let mark = if drawn > 0 { format!(" ({MARK})") } else { String::new() };
        // A third of a pixel: what drawn cracks are still found at.
        let finest = readings.iter().map(|r| f64::from(r.pixel_mm)).fold(0.0, f64::max) / 3.0;
        let details = json!({
            "finest_crack_mm": finest,
            "slices": readings.len(), "slices_drawn": drawn, "worst_core": worst.core, "worst_slice": worst.name,
            "porosity": porosity.value, "porosity_std_error": porosity.std_error,
            "pores": readings.iter().map(|r| r.pores).sum::<usize>(), "cracks": readings.iter().map(|r| r.cracks.len()).sum::<usize>(),
        });
        let serde_json::Value::Object(details) = details else { return None };
        Some(Evidence {
            source: SEEN,
            damage: worst.damage.value,
            std_error: worst.damage.std_error.max(self.settings.floor()),
            basis: format!(
                "{} CT slices{mark}; the worst section counts; cracks finer than about {finest:.2} mm do not show",
                readings.len()
            ),
            crack_width_mm: width,
            details,
        })
    }

    /// The prediction from the slices read so far and from whatever else is known (`others`: the member's index and the evidence).
    #[must_use]
    pub fn finish(&self, scene: &Scene, others: Vec<(usize, Evidence)>) -> Prediction {
        let mut further: BTreeMap<usize, Vec<Evidence>> = BTreeMap::new();
        others.into_iter().for_each(|(member, evidence)| further.entry(member).or_default().push(evidence));
        let member = |index: usize| self.member(scene, index, further.remove(&index).unwrap_or_default());
        let members: Vec<MemberPrediction> = (0..self.readings.len().min(scene.members.len())).map(member).collect();
        Prediction {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            score: score(&members, &self.settings),
            limits: limits(&members),
            members,
            profile: self.settings.profile.clone(),
            settings: self.settings.detect,
            files: Vec::new(),
        }
    }

    fn member(&self, scene: &Scene, index: usize, others: Vec<Evidence>) -> MemberPrediction {
        let member = &scene.members[index];
        let evidence: BTreeMap<_, _> = self.seen(index).into_iter().chain(others).map(|e| (e.source, e)).collect();
        let fused = fuse(&evidence.values().cloned().collect::<Vec<_>>());
        let width = evidence.values().filter_map(|e| e.crack_width_mm).fold(0.0, f64::max);
        let state = fused.and_then(|f| self.settings.profile.state(f.damage.value, width));
        MemberPrediction {
            id: member.id.clone(),
            name: member.name.clone(),
            kind: member.kind,
            concrete: member.concrete.clone(),
            concrete_assumed: member.concrete_assumed,
            damage: fused.map(|f| f.damage.value),
            damage_std_error: fused.map(|f| f.damage.std_error),
            state: state.map_or(NO_EVIDENCE, |s| &s.name).to_owned(),
            advice: state.map(|s| s.advice.clone()).unwrap_or_default(),
            conflict: fused.is_some_and(|f| f.conflict),
            truth: self.member_truth(member, &self.readings[index]),
            evidence,
            slices: self.readings[index].clone(),
        }
    }

    fn member_truth(&self, member: &intrados_scene::Member, readings: &[SliceReading]) -> Option<Truth> {
        let known: Vec<&SliceTruth> = readings.iter().filter_map(|r| r.truth.as_ref()).collect();
        // The truth of some sections is not that of the member's worst one.
        if known.is_empty() || known.len() < readings.len() {
            return None;
        }
        let damage = known.iter().map(|t| t.damage).fold(0.0, f64::max);
        let state = self.settings.profile.state(damage, 0.0).map(|s| s.name.clone()).unwrap_or_default();
        let drawn = readings.iter().all(|r| r.drawn);
        Some(Truth {
            damage,
            state,
            porosity: known.iter().map(|t| t.porosity).sum::<f64>() / known.len() as f64,
            origin: if drawn { "planted" } else { "labelled" },
            not_visible: if drawn { member.truth.iter().filter_map(not_visible).collect() } else { Vec::new() },
        })
    }
}

impl Settings {
    /// Smallest standard error of a damage read from slices: what noise alone does to a section without damage.
    fn floor(&self) -> f64 {
        0.01
    }
}

/// What is known of a slice beforehand.
enum Known {
    Drawn(drawn::Drawn),
    Labels(Mask),
}

impl Known {
    fn mask(&self) -> &Mask {
        match self {
            Self::Drawn(drawn) => &drawn.truth,
            Self::Labels(mask) => mask,
        }
    }
}

/// What a crack has to cross: the root of the body's area, mm.
fn side_mm(area_px: usize, pixel_mm: f32) -> f64 {
    (area_px as f64).sqrt() * f64::from(pixel_mm)
}

fn keep_worst_pictures(readings: &mut [SliceReading]) {
    let mut order: Vec<usize> = (0..readings.len()).filter(|&i| readings[i].pictures.is_some()).collect();
    order.sort_by(|&a, &b| readings[b].damage.value.total_cmp(&readings[a].damage.value).then(a.cmp(&b)));
    order.into_iter().skip(PICTURES).for_each(|i| readings[i].pictures = None);
}

/// Mean over slices. Its error: scatter of the slices (of one slice: bootstrap over blocks) and, alike in all of them, that of reading.
fn mean_porosity(readings: &[SliceReading]) -> Reading {
    let n = readings.len() as f64;
    let mean = |f: &dyn Fn(&SliceReading) -> f64| readings.iter().map(f).sum::<f64>() / n;
    let value = mean(&|r| r.porosity.value);
    let scatter =
        if readings.len() > 1 { (mean(&|r| (r.porosity.value - value).powi(2)) / (n - 1.0)).sqrt() } else { mean(&|r| r.sampling_error) };
    Reading { value, std_error: scatter.hypot(mean(&|r| r.porosity.std_error)) }
}

/// Planted damage that no slice shows.
fn not_visible(damage: &Damage) -> Option<String> {
    match damage {
        Damage::Spall { depth_m, .. } => Some(format!("spall, {:.0} mm deep", 1e3 * depth_m)),
        Damage::Corrosion { section_loss, .. } => Some(format!("corrosion, {:.0} % of the bars' section", 1e2 * section_loss)),
        Damage::Softened { damage, .. } => Some(format!("softened zone, d = {damage:.2}")),
        Damage::Crack { .. } | Damage::Voids { .. } | Damage::Honeycomb { .. } => None,
    }
}

fn score(members: &[MemberPrediction], settings: &Settings) -> MemberScore {
    let outcome =
        |m: &MemberPrediction| Some(Outcome { truth: m.truth.as_ref()?.damage, damage: m.damage?, std_error: m.damage_std_error? });
    let outcomes: Vec<Outcome> = members.iter().filter_map(outcome).collect();
    let readings = || members.iter().flat_map(|m| &m.slices);
    let slice =
        |r: &SliceReading| Some(Outcome { truth: r.truth.as_ref()?.porosity, damage: r.porosity.value, std_error: r.porosity.std_error });
    let slices: Vec<Outcome> = readings().filter_map(slice).collect();
    let mut tally = Tally::default();
    readings().filter_map(|r| r.truth.as_ref()).for_each(|t| tally += t.tally);
    MemberScore::of(&outcomes, settings.profile.severe_from, &slices, tally.score())
}

fn limits(members: &[MemberPrediction]) -> Vec<String> {
    let mut limits = vec![
        "Damage is that of the worst inspected section. Nothing is said about the concrete between sections.".to_owned(),
        "Slices show pores and cracks. Loss of cover, corrosion and lost stiffness do not enter this evidence.".to_owned(),
        "Error bars are those of reading the slices (threshold, noise, crack length and width); the rule that turns a section into a damage is the profile's.".to_owned(),
        "Cracks that run through large voids or honeycomb, or are much narrower than a third of a pixel, are missed; a gap along a bar counts as a crack.".to_owned(),
    ];
    let silent = members.iter().filter(|m| m.damage.is_none()).count();
    if silent > 0 {
        limits.insert(0, format!("{silent} of {} members have no evidence: that is not the same as sound.", members.len()));
    }
    if members.iter().flat_map(|m| &m.slices).any(|r| r.drawn) {
        limits.insert(0, format!("Some slices are {MARK}: pictures made from the planted truth. Their scores show that the chain works, not how it would do in the field."));
    }
    limits
}

/// Predicts the damage of every member: reads all slices, asks the `others`, fuses.
///
/// # Errors
/// A slice is missing or bad, another source failed, or the job was cancelled.
pub fn predict(scene: &Scene, settings: Settings, others: &[&dyn EvidenceSource], job: &Job) -> Result<Prediction, PredictError> {
    let mut predictor = Predictor::new(scene, settings);
    while predictor.advance(scene, job)? {}
    let mut further = Vec::new();
    for source in others {
        for index in 0..scene.members.len() {
            further.extend(source.evidence(scene, index, job)?.map(|evidence| (index, evidence)));
        }
    }
    job.step(1, 1)?;
    Ok(predictor.finish(scene, further))
}
