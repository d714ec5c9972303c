//! *Seen*: what CT slices say, section by section.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use intrados_scene::{Scene, Slices};
use intrados_stage::Job;
use intrados_xray::volume::VolumeError;
use serde::Serialize;
use serde_json::json;

use super::{PredictError, Settings};
use crate::{
    crack::{self, Crack},
    detect::{self, Detection, Pore, Reading, detect},
    drawn,
    evidence::{Cause, Evidence, all_causes},
    grid::Mask,
    outline,
    picture::{Picture, slice_pictures},
    scanned::{self, Layer},
    score::{Score, Tally},
    slice::{Slice, read_masks},
    steel::{Steel, steel},
    zone::{ZONES, Zones, middle, zone_at},
};

/// The source name of evidence from CT slices.
pub const SEEN: &str = "seen";

/// Smallest standard error of a damage read from slices: what noise alone does to a section without damage.
const FLOOR: f64 = 0.01;

/// Where a slice comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// A file of real data.
    File,
    /// Drawn from the planted truth.
    Drawn,
    /// A simulated scan of the planted truth.
    Scanned,
}

impl Origin {
    /// Its name, as in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::File => "file",
            Self::Drawn => "drawn",
            Self::Scanned => "scanned",
        }
    }
}

/// What was read in one slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SliceReading {
    /// Name of the core.
    pub core: String,
    /// Place on the member's axis, 0 to 1; none: unknown.
    pub along: Option<f64>,
    /// File, or what drew it.
    pub name: String,
    /// Where it comes from.
    pub origin: Origin,
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
    /// Damage of this section by pores and cracks.
    pub damage: Reading,
    /// Share of the designed section that has fallen off; none where the slice does not show all of the section.
    pub lost: Option<Reading>,
    /// The bars; none where the slice does not show them.
    pub steel: Option<Steel>,
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
    /// Damage by pores and cracks, by the same rule.
    pub damage: f64,
    /// Number of cracks.
    pub cracks: usize,
    /// The widest, mm.
    pub widest_mm: Option<f64>,
    /// How well pixels and objects were found.
    pub score: Score,
    #[serde(skip)]
    pub(super) tally: Tally,
}

impl SliceReading {
    /// Damage of this section's concrete: by pores, cracks and what has fallen off.
    #[must_use]
    pub fn concrete(&self) -> Reading {
        let pores_and_cracks = Reading { std_error: self.damage.std_error.max(FLOOR), ..self.damage };
        all_causes(std::iter::once(pores_and_cracks).chain(self.lost)).unwrap_or(pores_and_cracks)
    }

    /// The same with its bars.
    #[must_use]
    pub fn whole(&self) -> Reading {
        let concrete = self.concrete();
        all_causes(std::iter::once(concrete).chain(self.steel.map(|s| s.loss))).unwrap_or(concrete)
    }
}

/// Pictures kept for a member.
const PICTURES: usize = 2;

/// One slice that waits to be read.
#[derive(Debug, Clone)]
pub(super) struct Item {
    pub(super) member: usize,
    pub(super) core: String,
    what: What,
}

#[derive(Debug, Clone)]
enum What {
    File { image: PathBuf, masks: Vec<PathBuf>, pixel_mm: f32 },
    Drawn(drawn::Request),
    Scanned(scanned::Request),
}

impl Item {
    /// All slices of a scene.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let mut all = Vec::new();
        for (member, slices) in scene.members.iter().enumerate().flat_map(|(n, m)| m.slices.iter().map(move |s| (n, s))) {
            match slices {
                Slices::Files { name, images, masks, pixel_mm } => all.extend(images.iter().enumerate().map(|(k, image)| Self {
                    member,
                    core: name.clone(),
                    what: What::File { image: image.clone(), masks: masks.get(k).cloned().unwrap_or_default(), pixel_mm: *pixel_mm },
                })),
                &Slices::Drawn { ref name, count, size, pixel_mm, seed } => all.extend((0..count.min(drawn::MOST_SLICES)).map(|index| {
                    Self { member, core: name.clone(), what: What::Drawn(drawn::Request { index, count, size, pixel_mm, seed }) }
                })),
                Slices::Scanned { name, scanner, along, seed } => all.extend(along.iter().map(|&along| {
                    let request = scanned::Request { scanner: scanner.clone(), along, seed: *seed };
                    Self { member, core: name.clone(), what: What::Scanned(request) }
                })),
            }
        }
        all
    }

    /// What it is called in the ledger of evidence.
    pub(super) fn label(&self) -> String {
        let core = &self.core;
        match &self.what {
            What::File { image, .. } => format!("{core}, {}", image.display()),
            What::Drawn(request) => format!("{core}, section {} of {}", request.index + 1, request.count),
            What::Scanned(request) => format!("{core}, scanned at {} of the axis", request.along),
        }
    }

    /// Why it will not be used, as far as can be told without looking for damage in it; none where nothing is known against it.
    pub(super) fn refusal(&self) -> Option<String> {
        let What::File { image, masks, pixel_mm } = &self.what else { return None };
        open(image, masks, *pixel_mm).err().map(|why| why.to_string())
    }

    /// Whether it is to be scanned, which takes long.
    pub(super) fn is_scan(&self) -> bool {
        matches!(self.what, What::Scanned(_))
    }

    /// What its section was designed as, where a slice of this size shows all of it.
    fn design(&self, scene: &Scene, slice: &Slice) -> Option<drawn::Design> {
        let place = match &self.what {
            What::Drawn(request) => request.along(),
            What::Scanned(request) => f64::from(request.along),
            // Nobody knows where it lies: the middle stands for all.
            What::File { .. } => 0.5,
        };
        let size = u32::try_from(slice.grey.width.max(slice.grey.height)).ok()?;
        drawn::designed(scene, self.member, drawn::Request::at(place, size, slice.pixel_mm))
    }

    pub(super) fn read(&self, scene: &Scene, settings: &Settings, job: &Job) -> Result<SliceReading, PredictError> {
        let mut how = settings.detect;
        let (slice, known, along, origin) = match &self.what {
            What::File { image, masks, pixel_mm } => {
                let (slice, labels) = open(image, masks, *pixel_mm)?;
                (slice, labels.map(Known::Labels), None, Origin::File)
            }
            What::Drawn(request) => {
                let member = || scene.members[self.member].name.clone();
                let drawn = drawn::draw(scene, self.member, *request).map_err(|reason| PredictError::Drawn { member: member(), reason })?;
                (drawn.slice.clone(), Some(Known::Drawn(drawn)), Some(request.along()), Origin::Drawn)
            }
            What::Scanned(request) => {
                let layer = scanned::scan(scene, &scene.members[self.member], request, job)?;
                how = detect::Settings::of_members();
                (layer.slice.clone(), Some(Known::Scanned(layer)), Some(f64::from(request.along)), Origin::Scanned)
            }
        };
        // Inside one slice nobody waits long enough to want a cancel.
        let found = detect(&slice, &how, &Job::default())?;
        let rule = &settings.profile.rule;
        let section_mm = side_mm(found.body.count(), slice.pixel_mm);
        let truth = known.as_ref().and_then(|known| known.truth(&found, settings));
        let design = self.design(scene, &slice);
        let lost = design.as_ref().and_then(|design| outline::lost(&found.seen, &design.body));
        // Only a slice of the whole section has all its bars. What a duct shows is not its tendon's steel.
        let laid = design.filter(|design| lost.is_some() && design.tendons == 0);
        let steel = laid.and_then(|design| steel(&slice, &found, &design.bars));
        Ok(SliceReading {
            core: self.core.clone(),
            along,
            origin,
            pixel_mm: slice.pixel_mm,
            body_mm2: section_mm * section_mm,
            pores: found.pores.len(),
            porosity: found.porosity,
            sampling_error: found.sampling_error,
            damage: rule.damage(found.porosity, &found.cracks, section_mm),
            pictures: Some(slice_pictures(&found, known.as_ref().map(Known::mask))),
            name: slice.name,
            lost,
            steel,
            truth,
            cracks: found.cracks,
            table: found.pores,
        })
    }
}

/// A file's pixels, and its labels where there are any.
fn open(image: &Path, masks: &[PathBuf], pixel_mm: f32) -> Result<(Slice, Option<Mask>), VolumeError> {
    let slice = Slice::read(image, pixel_mm)?;
    let labels = if masks.is_empty() { None } else { Some(read_masks(masks, &slice)?) };
    Ok((slice, labels))
}

/// What is known of a slice beforehand.
enum Known {
    Drawn(drawn::Drawn),
    Scanned(Layer),
    Labels(Mask),
}

impl Known {
    fn mask(&self) -> &Mask {
        match self {
            Self::Drawn(drawn) => &drawn.truth,
            Self::Scanned(layer) => &layer.truth,
            Self::Labels(mask) => mask,
        }
    }

    fn truth(&self, found: &Detection, settings: &Settings) -> Option<SliceTruth> {
        let exact = |value| Reading { value, std_error: 0.0 };
        let tally = Tally::of(&found.mask(), self.mask())?;
        let (porosity, cracks, body) = match self {
            Self::Drawn(drawn) => (drawn.porosity, drawn.cracks.clone(), drawn.body_area),
            Self::Scanned(layer) => (layer.porosity, layer.cracks.clone(), layer.body_area),
            Self::Labels(mask) => {
                let cracks = crack::find_in_labels(mask, found.pixel_mm, &settings.detect.crack);
                let pores = mask.data.iter().zip(&cracks.mask.data).filter(|(m, c)| **m && !**c).count();
                (pores as f64 / found.body.count() as f64, cracks.list, found.body.count())
            }
        };
        let damage = settings.profile.rule.damage(exact(porosity), &cracks, side_mm(body, found.pixel_mm)).value;
        let widest_mm = cracks.iter().map(|c| c.width_mm).reduce(f64::max);
        Some(SliceTruth { porosity, damage, cracks: cracks.len(), widest_mm, score: tally.score(), tally })
    }
}

/// What a crack has to cross: the root of the body's area, mm.
fn side_mm(area_px: usize, pixel_mm: f32) -> f64 {
    (area_px as f64).sqrt() * f64::from(pixel_mm)
}

pub(super) fn keep_worst_pictures(readings: &mut [SliceReading]) {
    let mut order: Vec<usize> = (0..readings.len()).filter(|&i| readings[i].pictures.is_some()).collect();
    order.sort_by(|&a, &b| readings[b].whole().value.total_cmp(&readings[a].whole().value).then(a.cmp(&b)));
    order.into_iter().skip(PICTURES).for_each(|i| readings[i].pictures = None);
}

/// Of every zone the slice that stands for it: of those in it the one with most of `value`, or the nearest. Slices of which nobody knows the place stand for every zone.
pub(super) fn standing<T: Copy>(
    readings: &[SliceReading],
    value: impl Fn(&SliceReading) -> Option<T>,
    damage: impl Fn(T) -> f64,
) -> [Option<T>; ZONES] {
    let larger = |a: Option<T>, b: T| if a.is_some_and(|a| damage(a) >= damage(b)) { a } else { Some(b) };
    std::array::from_fn(|zone| {
        let placed = || readings.iter().filter_map(|r| Some((r.along?, value(r)?)));
        let inside = placed().filter(|(along, _)| zone_at(*along) == zone).fold(None, |worst, (_, v)| larger(worst, v));
        let away = |along: f64| (along - middle(zone)).abs();
        let nearest = || placed().min_by(|a, b| away(a.0).total_cmp(&away(b.0))).map(|(_, v)| v);
        readings.iter().filter(|r| r.along.is_none()).filter_map(&value).fold(inside.or_else(nearest), larger)
    })
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

/// What the slices of a member say; `None` if it has none.
pub(super) fn seen(readings: &[SliceReading]) -> Option<Evidence> {
    let worst = readings.iter().max_by(|a, b| a.whole().value.total_cmp(&b.whole().value))?;
    let porosity = mean_porosity(readings);
    let [drawn, scanned] = [Origin::Drawn, Origin::Scanned].map(|origin| readings.iter().filter(|r| r.origin == origin).count());
    let marks = [(drawn, drawn::MARK), (scanned, scanned::MARK)].map(|(n, mark)| if n > 0 { format!(" ({mark})") } else { String::new() });
    let mark = marks.concat();
    // A third of a pixel: what drawn cracks are still found at.
    let finest = readings.iter().map(|r| f64::from(r.pixel_mm)).fold(0.0, f64::max) / 3.0;
    let most = |value: &dyn Fn(&SliceReading) -> Option<f64>| readings.iter().filter_map(value).reduce(f64::max);
    let [with_bars, whole] = [readings.iter().filter(|r| r.steel.is_some()).count(), readings.iter().filter(|r| r.lost.is_some()).count()];
    let serde_json::Value::Object(details) = json!({
        "finest_crack_mm": finest,
        "slices": readings.len(), "slices_drawn": drawn, "slices_scanned": scanned, "worst_core": worst.core, "worst_slice": worst.name,
        "porosity": porosity.value, "porosity_std_error": porosity.std_error,
        "slices_with_bars": with_bars, "slices_of_the_whole_section": whole,
        "steel_loss": most(&|r| Some(r.steel?.loss.value)), "section_lost": most(&|r| Some(r.lost?.value)),
        "pores": readings.iter().map(|r| r.pores).sum::<usize>(), "cracks": readings.iter().map(|r| r.cracks.len()).sum::<usize>(),
    }) else {
        return None;
    };
    let basis = format!(
        "{} CT slices{mark}, of which {whole} show the whole section and {with_bars} its bars; the worst section counts; cracks finer than about {finest:.2} mm do not show",
        readings.len()
    );
    let zones = |value: &dyn Fn(&SliceReading) -> Option<Reading>| Zones(standing(readings, value, |r| r.value));
    let mut zones = BTreeMap::from([(Cause::Concrete, zones(&|r| Some(r.concrete()))), (Cause::Steel, zones(&|r| Some(r.steel?.loss)))]);
    zones.retain(|_, zones| zones.worst().is_some());
    let evidence = Evidence::new(SEEN, true, zones, basis)?;
    let width = readings.iter().flat_map(|r| &r.cracks).map(|c| c.width_mm).reduce(f64::max);
    Some(Evidence { crack_width_mm: width, details, ..evidence })
}
