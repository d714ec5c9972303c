//! *Seen*: what CT slices say, section by section.

use std::collections::BTreeMap;

use intrados_ct::{
    crack::Crack,
    detect::{self, Detection, Pore},
    outline,
    picture::{Picture, crack_picture, slice_pictures},
    score::{Score, Tally},
    source::{Known, Origin, SliceRead, SliceShelf, SliceSource},
    steel::{Steel, steel},
    synthetic::{drawn, scanned},
};
use intrados_damage::{
    evidence::{Cause, Evidence, all_causes},
    grading::Profile,
    reach::{Field, Word},
    zone::{ZONES, middle, zone_at},
};
use intrados_scene::{AxisRuns, Drilled, Scene};
use intrados_stage::{Estimate, Job};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::{PredictError, PredictSettings};

/// The source name of evidence from CT slices.
pub const CT: &str = "ct";

/// Smallest standard error of a damage read from slices: what noise alone does to a section without
/// damage.
const FLOOR: f64 = 0.01;

/// What was read in one slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SliceReading {
    /// Name of the core.
    pub core: String,
    /// Number of that core among those of the scene.
    #[serde(skip)]
    pub(crate) core_number: usize,
    /// Place on the member's axis, 0 to 1; none: unknown.
    pub along: Option<f64>,
    /// Where it was drilled, as far as the scene says; none of slices that were made.
    pub drilled: Option<Drilled>,
    /// What the file's own tags say of its pixels, where that contradicts the scene.
    pub doubt: Option<String>,
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
    pub porosity: Estimate,
    /// Standard error of that porosity as a sample of the concrete around it.
    pub sampling_error: f64,
    /// The cracks.
    pub cracks: Vec<Crack>,
    /// Damage of this section by pores and cracks; of one along the member its worst stretch.
    pub damage: Estimate,
    /// Of a section along its member: what it says of each zone that it goes through.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stretches: Vec<Stretch>,
    /// Share of the designed section that has fallen off; none where the slice does not show all of
    /// the section.
    pub lost: Option<Estimate>,
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
    /// Its widest crack.
    #[serde(skip)]
    pub widest: Option<Picture>,
}

/// A part of a section along its member.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// The middle of it on the member's axis, 0 to 1.
    pub along: f64,
    /// Damage by pores and by cracks across the member.
    pub damage: Estimate,
}

/// What is truly in one slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    pub(crate) tally: Tally,
}

impl SliceReading {
    /// Damage of this section's concrete: by pores, cracks and what has fallen off.
    #[must_use]
    pub fn concrete(&self) -> Estimate {
        let pores_and_cracks = floored(self.damage);
        all_causes(std::iter::once(pores_and_cracks).chain(self.lost)).unwrap_or(pores_and_cracks)
    }

    /// What it says of the concrete, place by place.
    fn of_concrete(&self) -> Vec<(Option<f64>, Estimate)> {
        match &self.stretches[..] {
            [] => vec![(self.along, self.concrete())],
            some => some.iter().map(|s| (Some(s.along), floored(s.damage))).collect(),
        }
    }

    /// The same with its bars.
    #[must_use]
    pub fn whole(&self) -> Estimate {
        let concrete = self.concrete();
        all_causes(std::iter::once(concrete).chain(self.steel.map(|s| s.loss))).unwrap_or(concrete)
    }
}

/// A reading as it is kept between two runs, with what files do not tell of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    reading: SliceReading,
    core_number: usize,
    table: Vec<Pore>,
    pictures: Option<[Picture; 2]>,
    widest: Option<Picture>,
    tally: Option<Tally>,
}

impl From<&SliceReading> for Kept {
    fn from(reading: &SliceReading) -> Self {
        Self {
            reading: reading.clone(),
            core_number: reading.core_number,
            table: reading.table.clone(),
            pictures: reading.pictures.clone(),
            widest: reading.widest.clone(),
            tally: reading.truth.as_ref().map(|t| t.tally),
        }
    }
}

impl From<Kept> for SliceReading {
    fn from(Kept { reading, core_number, table, pictures, widest, tally }: Kept) -> Self {
        let truth =
            reading.truth.map(|truth| SliceTruth { tally: tally.unwrap_or_default(), ..truth });
        Self { core_number, table, pictures, widest, truth, ..reading }
    }
}

/// Pictures kept for a member.
const PICTURES: usize = 2;

/// Reads a slice, and says what follows for its section.
pub(crate) fn read(
    source: &SliceSource,
    scene: &Scene,
    settings: &PredictSettings,
    shelf: &SliceShelf,
    job: &Job,
) -> Result<SliceReading, PredictError> {
    let origin = source.origin();
    let how = if origin == Origin::Scanned {
        detect::DetectSettings::of_members()
    } else {
        settings.detect.in_members()
    };
    let SliceRead { slice, found, known, doubt, offset_m } =
        source.read(scene, &how, shelf, job)?;
    let rule = &settings.profile.rule;
    let section_mm = side_mm(found.body.count(), slice.pixel_mm);
    let truth = known.as_ref().and_then(|known| truth(known, &found, settings, &how));
    let design = source.design(scene, &slice);
    let lost = design.as_ref().and_then(|design| outline::lost(&found.seen, &design.body));
    // Only a slice of the whole section has all its bars. What a duct shows is not its tendon's
    // steel.
    let laid = design.filter(|design| lost.is_some() && design.tendons == 0);
    let steel = laid.and_then(|design| steel(&slice, &found, &design.bars));
    let length_m = f64::from(scene.members[source.member].frame.axis.length()).max(1e-6);
    let along = source.along().map(|at| (at + offset_m / length_m).clamp(0.0, 1.0));
    let stretches = match (source.axis(), along) {
        (Some(runs @ (AxisRuns::Right | AxisRuns::Down)), Some(along)) => {
            stretches(&found, runs, along, length_m, settings)
        }
        _ => Vec::new(),
    };
    let worst = stretches.iter().map(|s| s.damage).max_by(|a, b| a.value.total_cmp(&b.value));
    Ok(SliceReading {
        core: source.core.clone(),
        core_number: source.number,
        along,
        drilled: source.drilled(),
        doubt,
        origin,
        pixel_mm: slice.pixel_mm,
        body_mm2: section_mm * section_mm,
        pores: found.pores.len(),
        porosity: found.porosity,
        sampling_error: found.sampling_error,
        damage: worst.unwrap_or_else(|| rule.damage(found.porosity, &found.cracks, section_mm)),
        stretches,
        pictures: Some(slice_pictures(&found, known.as_ref().map(Known::mask))),
        widest: widest(&found.cracks).map(|crack| crack_picture(&found, crack)),
        name: slice.name,
        lost,
        steel,
        truth,
        cracks: found.cracks,
        table: found.pores,
    })
}

/// What a section along its member says, zone by zone: in each, how much of the width is cut by
/// the cracks that lie there. What runs along the axis is not cut here: cross-sections show it.
fn stretches(
    found: &Detection,
    runs: AxisRuns,
    middle: f64,
    length_m: f64,
    settings: &PredictSettings,
) -> Vec<Stretch> {
    let (body, mm) = (&found.seen, f64::from(found.pixel_mm));
    let axis = usize::from(runs == AxisRuns::Down);
    let pixels = if axis == 0 { body.width } else { body.height };
    let place = |at_mm: f64| middle + 1e-3 * (at_mm - 0.5 * pixels as f64 * mm) / length_m;
    // Pixels of the body across the axis, step by step along it.
    let mut across = vec![0_usize; pixels];
    for i in body.pixels() {
        across[if axis == 0 { i % body.width } else { i / body.width }] += 1;
    }
    let steps: Vec<(f64, usize)> = across
        .iter()
        .enumerate()
        .filter(|(_, n)| **n > 0)
        .map(|(i, n)| (place((i as f64 + 0.5) * mm), *n))
        .filter(|(at, _)| (0.0..=1.0).contains(at))
        .collect();
    let in_zone = |zone: usize| {
        let own: Vec<_> = steps.iter().filter(|(at, _)| zone_at(*at) == zone).collect();
        // A sliver of a zone says nothing of it that its neighbour does not.
        if own.is_empty() || 5 * own.len() < steps.len().min((1e2 * length_m / mm) as usize) {
            return None;
        }
        let n = own.len() as f64;
        let width_mm = mm * own.iter().map(|(_, n)| *n as f64).sum::<f64>() / n;
        let cracks = found.cracks.iter().filter(|c| zone_at(place(c.at_mm[axis])) == zone);
        let cut: Vec<Crack> = cracks
            .map(|c| Crack { length_mm: c.length_mm.min(c.box_mm[1 - axis]), ..c.clone() })
            .collect();
        Some(Stretch {
            along: own.iter().map(|(at, _)| at).sum::<f64>() / n,
            damage: settings.profile.rule.damage(found.porosity, &cut, width_mm),
        })
    };
    (0..ZONES).filter_map(in_zone).collect()
}

/// A damage with the error that noise alone gives.
fn floored(damage: Estimate) -> Estimate {
    Estimate { std_error: damage.std_error.max(FLOOR), ..damage }
}

/// The widest of some cracks.
pub(crate) fn widest(cracks: &[Crack]) -> Option<&Crack> {
    cracks.iter().max_by(|a, b| a.width_mm.total_cmp(&b.width_mm))
}

/// What is truly in a slice, beside what was found in it.
fn truth(
    known: &Known,
    found: &Detection,
    settings: &PredictSettings,
    how: &detect::DetectSettings,
) -> Option<SliceTruth> {
    let exact = |value| Estimate { value, std_error: 0.0 };
    let tally = Tally::of(&found.mask(), known.mask())?;
    let (porosity, cracks, body) = known.truth(found, how);
    let damage =
        settings.profile.rule.damage(exact(porosity), &cracks, side_mm(body, found.pixel_mm)).value;
    let widest_mm = cracks.iter().map(|c| c.width_mm).reduce(f64::max);
    Some(SliceTruth {
        porosity,
        damage,
        cracks: cracks.len(),
        widest_mm,
        score: tally.score(),
        tally,
    })
}

/// What a crack has to cross: the root of the body's area, mm.
fn side_mm(area_px: usize, pixel_mm: f32) -> f64 {
    (area_px as f64).sqrt() * f64::from(pixel_mm)
}

pub(crate) fn keep_worst_pictures(readings: &mut [SliceReading]) {
    let mut order: Vec<usize> =
        (0..readings.len()).filter(|&i| readings[i].pictures.is_some()).collect();
    order.sort_by(|&a, &b| {
        readings[b].whole().value.total_cmp(&readings[a].whole().value).then(a.cmp(&b))
    });
    order.into_iter().skip(PICTURES).for_each(|i| readings[i].pictures = None);
}

/// Of every zone the slice that stands for it: of those in it the one with most of `value`, or the
/// nearest. Slices of which nobody knows the place stand for every zone.
pub(crate) fn standing<T: Copy>(
    readings: &[SliceReading],
    value: impl Fn(&SliceReading) -> Option<T>,
    damage: impl Fn(T) -> f64,
) -> [Option<T>; ZONES] {
    let larger =
        |a: Option<T>, b: T| if a.is_some_and(|a| damage(a) >= damage(b)) { a } else { Some(b) };
    std::array::from_fn(|zone| {
        let placed = || readings.iter().filter_map(|r| Some((r.along?, value(r)?)));
        let inside = placed()
            .filter(|(along, _)| zone_at(*along) == zone)
            .fold(None, |worst, (_, v)| larger(worst, v));
        let away = |along: f64| (along - middle(zone)).abs();
        let nearest = || placed().min_by(|a, b| away(a.0).total_cmp(&away(b.0))).map(|(_, v)| v);
        readings
            .iter()
            .filter(|r| r.along.is_none())
            .filter_map(&value)
            .fold(inside.or_else(nearest), larger)
    })
}

/// Mean over slices. Its error: scatter of the slices (of one slice: bootstrap over blocks) and,
/// alike in all of them, that of reading.
fn mean_porosity(readings: &[SliceReading]) -> Estimate {
    let n = readings.len() as f64;
    let mean = |f: &dyn Fn(&SliceReading) -> f64| readings.iter().map(f).sum::<f64>() / n;
    let value = mean(&|r| r.porosity.value);
    let scatter = if readings.len() > 1 {
        (mean(&|r| (r.porosity.value - value).powi(2)) / (n - 1.0)).sqrt()
    } else {
        mean(&|r| r.sampling_error)
    };
    Estimate { value, std_error: scatter.hypot(mean(&|r| r.porosity.std_error)) }
}

/// What a slice says of a cause, place by place, where it shows it.
type Says = fn(&SliceReading) -> Vec<(Option<f64>, Estimate)>;

/// The causes that slices speak of.
const CAUSES: [(Cause, Says); 2] = [
    (Cause::Concrete, SliceReading::of_concrete),
    (Cause::Steel, |r| r.steel.map(|steel| (r.along, steel.loss)).into_iter().collect()),
];

/// What the slices of a member `length` m long say; `None` if it has none.
pub(crate) fn seen(readings: &[SliceReading], length: f64, profile: &Profile) -> Option<Evidence> {
    let worst = readings.iter().max_by(|a, b| a.whole().value.total_cmp(&b.whole().value))?;
    let porosity = mean_porosity(readings);
    let [drawn, scanned] = [Origin::Drawn, Origin::Scanned]
        .map(|origin| readings.iter().filter(|r| r.origin == origin).count());
    let marks = [(drawn, drawn::MARK), (scanned, scanned::MARK)]
        .map(|(n, mark)| if n > 0 { format!(" ({mark})") } else { String::new() });
    let mark = marks.concat();
    // A third of a pixel: what drawn cracks are still found at.
    let finest = readings.iter().map(|r| f64::from(r.pixel_mm)).fold(0.0, f64::max) / 3.0;
    let most = |value: &dyn Fn(&SliceReading) -> Option<f64>| {
        readings.iter().filter_map(value).reduce(f64::max)
    };
    let [with_bars, whole] = [
        readings.iter().filter(|r| r.steel.is_some()).count(),
        readings.iter().filter(|r| r.lost.is_some()).count(),
    ];
    let serde_json::Value::Object(details) = json!({
        "finest_crack_mm": finest,
        "slices": readings.len(), "slices_without_a_place": readings.iter().filter(|r| r.along.is_none()).count(), "slices_drawn": drawn, "slices_scanned": scanned, "worst_core": worst.core, "worst_slice": worst.name,
        "porosity": porosity.value, "porosity_std_error": porosity.std_error,
        "slices_with_bars": with_bars, "slices_of_the_whole_section": whole,
        "steel_loss": most(&|r| Some(r.steel?.loss.value)), "section_lost": most(&|r| Some(r.lost?.value)),
        "pores": readings.iter().map(|r| r.pores).sum::<usize>(), "cracks": readings.iter().map(|r| r.cracks.len()).sum::<usize>(),
    }) else {
        return None;
    };
    let lost = readings.iter().filter(|r| r.along.is_none()).count();
    let somewhere = if lost > 0 {
        format!("; of {lost} the place is missing (add along: 0 to 1), and they say little of any")
    } else {
        String::new()
    };
    let basis = format!(
        "{} CT slices{mark}, of which {whole} show the whole section and {with_bars} its bars; the worst section of a zone counts, and what lies between is not seen{somewhere}; cracks finer than about {finest:.2} mm do not show",
        readings.len()
    );
    let (mut zones, mut stands) = (BTreeMap::new(), BTreeMap::new());
    for (cause, value) in CAUSES {
        let words: Vec<Word> = readings
            .iter()
            .flat_map(|r| {
                let word = |(along, reading)| Word { along, reading, core: r.core_number };
                value(r).into_iter().map(word)
            })
            .collect();
        let field = Field::of(profile, cause, length);
        zones.insert(cause, field.zones(&words));
        stands.insert(cause, field.stands(&words));
    }
    zones.retain(|_, zones| zones.worst().is_some());
    stands.retain(|cause, _| zones.contains_key(cause));
    let evidence = Evidence::new(CT, true, zones, basis)?;
    let width = readings.iter().flat_map(|r| &r.cracks).map(|c| c.width_mm).reduce(f64::max);
    Some(Evidence { crack_width_mm: width, stands, details, ..evidence })
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, File},
        path::Path,
    };

    use intrados_stage::Job;
    use tiff::{
        encoder::{Rational, TiffEncoder, colortype},
        tags::ResolutionUnit,
    };

    use super::*;
    use crate::{Prediction, doubted, foreseen, predict};
    use intrados_damage::evidence::Sources;

    /// Writes a core of 60 mm with a pore of 16 mm, half a millimetre a pixel, which the file may
    /// tell.
    fn core(path: &Path, told: bool) {
        let grey = |i: usize| {
            let from = |x: f32, y: f32| ((i % 140) as f32 - x).hypot((i / 140) as f32 - y);
            match () {
                () if from(70.0, 70.0) > 60.0 => 0,
                () if from(80.0, 60.0) < 16.0 => 20,
                () => 180 + (i * i % 7) as u8,
            }
        };
        let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
        let mut image = encoder.new_image::<colortype::Gray8>(140, 140).unwrap();
        if told {
            image.resolution(ResolutionUnit::Centimeter, Rational { n: 20, d: 1 });
        }
        image.write_data(&(0..140 * 140).map(grey).collect::<Vec<u8>>()).unwrap();
    }

    /// A column of .4 × .4 × 5 m with slices as the scene may tell of them, beside the files
    /// `a.tif` (which tells of its pixels) and `b.tif`, and a damaged `c.tif`.
    fn column(slices: &str) -> (tempfile::TempDir, Scene) {
        let folder = tempfile::tempdir().unwrap();
        [("a.tif", true), ("b.tif", false)]
            .into_iter()
            .for_each(|(name, told)| core(&folder.path().join(name), told));
        let bytes = fs::read(folder.path().join("b.tif")).unwrap();
        fs::write(folder.path().join("c.tif"), &bytes[..bytes.len() / 2]).unwrap();
        let text = format!(
            "(schema: \"intrados.scene/1\", members: [(id: \"C1\", name: \"C1\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 5), concrete: \"C30/37\", slices: [{slices}])])"
        );
        let path = folder.path().join("column.ron");
        fs::write(&path, text).unwrap();
        let scene = Scene::load(&path, &Job::default()).unwrap();
        (folder, scene)
    }

    fn predicted(scene: &Scene, strict: bool) -> Result<Prediction, PredictError> {
        let detect = detect::DetectSettings {
            method: detect::Method::Classical,
            ..detect::DetectSettings::default()
        };
        predict(
            scene,
            PredictSettings { detect, forecast: None, strict, ..PredictSettings::default() },
            &Sources::default(),
            &Job::default(),
        )
    }

    /// A picture of 14 m of a column of .4 m, one of a fifth of a millimetre, one of unknown size
    /// and a damaged one: each is refused in one line, and none of them counts.
    #[test]
    fn slices_that_cannot_be_the_members_are_not_used() {
        for (slices, why) in [
            (
                "Files(name: \"core\", images: [\"b.tif\"], pixel_mm: 100)",
                "the picture is 14.0 m wide and the member 400 mm: pixel_mm in µm?",
            ),
            ("Files(name: \"core\", images: [\"b.tif\"], pixel_mm: 0.0005)", "hardly a grain"),
            ("Files(name: \"core\", images: [\"b.tif\"])", "add pixel_mm"),
            ("Files(name: \"core\", images: [\"c.tif\"], pixel_mm: 0.5)", "c.tif"),
        ] {
            let (_folder, scene) = column(slices);
            let foreseen = foreseen(&scene, &Job::default()).unwrap();
            let prediction = predicted(&scene, false).unwrap();
            let silence = &prediction.silences[0].why;
            assert!(
                silence.contains(why)
                    && !silence.contains('\n')
                    && prediction.members[0].damage.is_none(),
                "{silence}"
            );
            assert!(predicted(&scene, true).is_err());
            assert_eq!(foreseen[0].1.why.as_ref(), Some(silence));
        }
        // What it shows, not the picture, is too wide for the member, or too thin for its core.
        for (how, why) in [
            ("pixel_mm: 6", "from corner to corner"),
            ("pixel_mm: 0.5, diameter_mm: 600", "diameter_mm"),
        ] {
            let (_folder, scene) =
                column(&format!("Files(name: \"core\", images: [\"b.tif\"], {how})"));
            assert!(predicted(&scene, false).unwrap().silences[0].why.contains(why), "{how}");
        }
    }

    /// The damaged slice is left out and the others count, with the pixel that their tags tell.
    #[test]
    fn one_bad_slice_leaves_the_sound_ones() {
        let (_folder, scene) =
            column("Files(name: \"core\", images: [\"?.tif\"], pixel_mm: 0.5, along: 0.25)");
        let prediction = predicted(&scene, false).unwrap();
        assert_eq!((prediction.members[0].slices.len(), prediction.silences.len()), (2, 1));
        let (_folder, scene) = column("Files(name: \"core\", images: [\"a.tif\"], along: 0.25)");
        assert_eq!(predicted(&scene, true).unwrap().members[0].slices[0].pixel_mm, 0.5);
        let (_folder, scene) =
            column("Files(name: \"core\", images: [\"a.tif\"], pixel_mm: 0.4, along: 0.25)");
        let doubts = doubted(&scene);
        assert!(
            doubts.len() == 1 && doubts[0].1.contains("0.5 mm a pixel, not the 0.4 mm"),
            "{doubts:?}"
        );
        assert!(
            predicted(&scene, true)
                .unwrap()
                .limits
                .iter()
                .any(|limit| limit.contains(&doubts[0].1))
        );
    }

    /// A core of 40 mm and 80 mm long, cracked right through, half a millimetre a voxel, as one
    /// MetaImage `core.mha`; the crack lies in a cross-section that is not read.
    fn cracked_volume(folder: &Path) {
        let (n, depth) = (96_usize, 160_usize);
        let header = format!(
            "ObjectType = Image\nNDims = 3\nElementSpacing = 0.5 0.5 0.5\nDimSize = {n} {n} {depth}\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
        );
        let voxel = |i: usize| {
            let (x, y, z) = ((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32);
            let mouth = 70.0 + (0.3 * x).sin() + (0.2 * y).cos();
            match () {
                () if (x - 47.5).hypot(y - 47.5) > 40.0 => 0,
                () if (z - mouth).abs() < 1.1 => {
                    180 - (160.0 * (1.1 - (z - mouth).abs()).min(1.0)) as u8
                }
                () if (x - 60.0).hypot(y - 40.0).hypot(z % 40.0 - 20.0) < 5.0 => 20,
                () => 176 + (i.wrapping_mul(2_654_435_761) >> 16) as u8 % 9,
            }
        };
        let bytes = [header.into_bytes(), (0..n * n * depth).map(voxel).collect()].concat();
        fs::write(folder.join("core.mha"), bytes).unwrap();
    }

    /// A crack across the member lies between cross-sections: sections along the core show it.
    #[test]
    fn a_crack_across_the_member_is_found_in_sections_along_a_volume() {
        let volume = "Stack(name: \"core\", images: [\"core.mha\"], along: 0.25, diameter_mm: 40, axis: Through)";
        let (folder, _) = column("");
        cracked_volume(folder.path());
        let path = folder.path().join("column.ron");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("slices: []", &format!("slices: [{volume}]"))).unwrap();
        let scene = Scene::load(&path, &Job::default()).unwrap();
        let member = predicted(&scene, true).unwrap().members.remove(0);
        let (along, across): (Vec<_>, Vec<_>) =
            member.slices.iter().partition(|s| !s.stretches.is_empty());
        assert_eq!((along.len(), across.len()), (10, 9));
        assert!(across.iter().all(|s| s.cracks.is_empty() && s.damage.value < 0.1));
        let through = |s: &&&SliceReading| {
            s.cracks.iter().any(|c| c.length_mm > 0.8 * c.box_mm[0] && c.box_mm[0] > 20.0)
        };
        let found = along.iter().filter(through).count();
        assert!(found >= 9, "{found}: {:?}", along.iter().map(|s| &s.cracks).collect::<Vec<_>>());
        // Half a millimetre is half of what counts as open, over the whole width.
        let own = member.evidence[CT].zones[&Cause::Concrete].0[2].unwrap();
        assert!((0.3..0.8).contains(&own.value), "{own:?}");
        // Slices of the core lie where they lie, to the millimetre.
        let places: Vec<f64> = across.iter().filter_map(|s| s.along).collect();
        assert!((places[8] - places[0] - 8.0 / 9.0 * 0.08 / 5.0).abs() < 2e-4, "{places:?}");
    }

    /// A core of 60 mm says what its zone is, and little of the rest of five metres; without a
    /// place, little of anywhere.
    #[test]
    fn a_core_is_evidence_where_it_was_drilled() {
        let (_folder, scene) = column(
            "Files(name: \"core\", images: [\"b.tif\"], pixel_mm: 0.5, along: 0.25, angle_deg: 90, depth_m: 0.1, diameter_mm: 60)",
        );
        let member = predicted(&scene, true).unwrap().members.remove(0);
        let zones = member.evidence[CT].zones[&Cause::Concrete].0.map(Option::unwrap);
        let own = member.slices[0].concrete();
        assert!(
            own.value > 0.2 && zones[2].value == own.value && zones[2].std_error < 0.25,
            "{zones:?}"
        );
        assert!(zones[9].value < 0.01 && zones[9].std_error > 0.29, "{zones:?}");
        assert!(
            member.slices[0].lost.is_none()
                && member.slices[0].drilled.unwrap().depth_m == Some(0.1)
        );
        let (_folder, scene) = column("Files(name: \"core\", images: [\"b.tif\"], pixel_mm: 0.5)");
        assert!(scene.warnings.iter().any(|w| w.contains("add along")), "{:?}", scene.warnings);
        let member = predicted(&scene, true).unwrap().members.remove(0);
        assert!(member.evidence[CT].basis.contains("add along"));
        assert!(
            member.evidence[CT].zones[&Cause::Concrete]
                .0
                .iter()
                .flatten()
                .all(|z| z.value < 0.5 * own.value && z.std_error > 0.25)
        );
    }
}
