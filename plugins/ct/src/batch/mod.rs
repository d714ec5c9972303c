//! Detection over files, for the command line: `intrados.detect/1`.

mod files;

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use intrados_stage::{Cancelled, Job, file::WriteError};
use intrados_xray::volume::VolumeError;
use serde::{Deserialize, Serialize};

pub use files::{DetectionWriter, pores_csv};

use crate::{
    SliceError,
    crack::Crack,
    detect::{self, DetectSettings, Detection, Pore},
    score::{Score, SizeClass, Sizes, Tally},
    slice::{PixelFrom, Slice, Slices, read_masks_at},
};
use intrados_raster::grid::Mask;

/// Schema of the JSON.
pub const SCHEMA: &str = "intrados.detect/1";

/// What was found in the slices of a batch. Serialises to `intrados.detect/1`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Batch {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// How slices were read.
    pub settings: DetectSettings,
    /// Slice by slice, in the order given.
    pub slices: Vec<Found>,
    /// Those that were not used, and why.
    pub unused: Vec<Unused>,
    /// What else the user should know, one line each.
    pub notes: Vec<String>,
    /// All together.
    pub total: Total,
}

/// A slice, or a file of slices, that could not be used.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unused {
    /// The file.
    pub file: PathBuf,
    /// Number of the slice in its file, from 0; none: all of it.
    pub layer: Option<usize>,
    /// Why, one line.
    pub because: String,
}

/// What was found in one slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// The file.
    pub file: PathBuf,
    /// Number of the slice in its file, from 0.
    pub layer: usize,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
    /// Who says so; where nobody does, what is told in mm is pixels.
    pub pixel_from: PixelFrom,
    /// Number of pores.
    pub pores: usize,
    /// Pore area over body area.
    pub porosity: f64,
    /// Its standard error of reading.
    pub porosity_std_error: f64,
    /// Number of cracks.
    pub cracks: usize,
    /// Their lengths together, pixels.
    pub crack_length_px: f64,
    /// Wall time to detect, reading the file apart.
    pub seconds: f64,
    /// Scores where masks were given.
    pub truth: Option<Score>,
    /// The pores one by one.
    #[serde(skip)]
    pub table: Vec<Pore>,
    /// The cracks one by one.
    #[serde(skip)]
    pub crack_table: Vec<Crack>,
}

/// A whole batch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Total {
    /// Number of slices.
    pub slices: usize,
    /// Number of pores.
    pub pores: usize,
    /// Pore area over body area, pooled.
    pub porosity: f64,
    /// Number of cracks.
    pub cracks: usize,
    /// Their lengths together, pixels.
    pub crack_length_px: f64,
    /// Wall time of all slices.
    pub seconds: f64,
    /// Scores pooled over the slices that had masks.
    pub truth: Option<Score>,
    /// How probably a pore is found, by its size in the masks; empty without masks.
    pub detection: Vec<SizeClass>,
}

/// How to read a batch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceTally {
    /// Edge of a pixel, mm; none: what the files tell.
    pub pixel_mm: Option<f32>,
    /// How slices are read.
    pub settings: DetectSettings,
    /// Whether one bad slice among sound ones ends the work.
    pub strict: bool,
}

/// What is kept of a slice that is done: its share of the batch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Share {
    found: Found,
    pores: Vec<Pore>,
    cracks: Vec<Crack>,
    tally: Option<Tally>,
    sizes: Sizes,
    /// Pixels of the body.
    body: usize,
}

/// Detects pores and cracks in files; `masks` are the label masks of each slice
/// ([`crate::slice::pair`]), none where it is empty. Slices are read one by one and nothing of
/// their pixels is kept: `writer` draws each, and what it has of an earlier batch that broke off is
/// taken from there. A bad slice among sound ones is left out, and said so.
///
/// # Errors
/// A file is missing; a slice is bad and none is sound, or `strict` asks for all of them; a mask is
/// bad or has no label; the job was cancelled; or a file cannot be written.
pub fn detect_files<E: From<SliceError> + From<WriteError>>(
    files: &[PathBuf],
    masks: &[Vec<PathBuf>],
    how: &SliceTally,
    job: &Job,
    mut writer: Option<&mut DetectionWriter<'_>>,
) -> Result<Batch, E> {
    let stopped = |e: Cancelled| E::from(SliceError::from(e));
    let mut sum = Sum::default();
    let mut refused = Refused { strict: how.strict, list: Vec::new(), first: None };
    let mut notes = Vec::new();
    for (n, file) in files.iter().enumerate() {
        let mut layers = match Slices::open(file, how.pixel_mm) {
            Ok(layers) => layers,
            Err(why) => {
                refused.take(file, None, why.into())?;
                continue;
            }
        };
        notes.extend(layers.doubt());
        for layer in 0..layers.count() {
            let share = |layer: usize| {
                (n as f64 + layer as f64 / layers.count() as f64) / files.len() as f64
            };
            let job = job.part(share(layer), share(layer + 1));
            job.step(0, 1).map_err(stopped)?;
            let slice = match layers.read(layer) {
                Ok(slice) => slice,
                Err(why) => {
                    refused.take(file, Some(layer), why.into())?;
                    continue;
                }
            };
            let mask = masks
                .get(n)
                .filter(|m| !m.is_empty())
                .map(|masks| labelled(layer, masks, &slice))
                .transpose()?;
            let settings = how.settings_of(&layers);
            let part = part_name(file, layer, &slice, mask.as_ref(), &settings);
            if let Some(known) = writer.as_mut().and_then(|w| w.known(&part)) {
                sum.add(known);
                continue;
            }
            let begin = Instant::now();
            let found = match detect::detect(&slice, &settings, &job) {
                Ok(found) => found,
                Err(why) => {
                    refused.take(file, Some(layer), why.into())?;
                    continue;
                }
            };
            let seconds = begin.elapsed().as_secs_f64();
            let told = Found {
                pixel_from: layers.pixel_from(),
                seconds,
                ..told(file, layer, &slice, &found)
            };
            let share = Share::of(told, &found, mask.as_ref());
            if let Some(writer) = &mut writer {
                writer.slice(&share.found, &found, mask.as_ref())?;
                writer.keep(&part, &share);
            }
            sum.add(share);
        }
    }
    if let Some(why) = refused.first.filter(|_| sum.slices.is_empty()) {
        return Err(why.into());
    }
    job.step(1, 1).map_err(stopped)?;
    let unmeasured = sum.slices.iter().filter(|s| s.pixel_from == PixelFrom::Nobody).count();
    if unmeasured > 0 {
        notes.push(format!(
            "of {unmeasured} slices nobody says how large their pixels are: windows and filters are in pixels, and so is all that is told in mm; give --pixel-mm"
        ));
    }
    let total = sum.total();
    let slices = sum.slices;
    Ok(Batch {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        settings: how.settings,
        slices,
        unused: refused.list,
        notes,
        total,
    })
}

/// The name under which a slice is kept: all that its share of the batch and its files depend on.
/// Its pixels are in it and not its file, whose values may lie in another.
fn part_name(
    file: &Path,
    layer: usize,
    slice: &Slice,
    mask: Option<&Mask>,
    settings: &DetectSettings,
) -> String {
    let mut hasher = blake3::Hasher::new();
    // Byte by byte it would take longer than to read the file.
    for some in slice.grey.data.chunks(1 << 14) {
        hasher.update(&some.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>());
    }
    for some in mask.iter().flat_map(|mask| mask.data.chunks(1 << 16)) {
        hasher.update(&some.iter().map(|&set| u8::from(set)).collect::<Vec<u8>>());
    }
    let size = (slice.grey.width, slice.grey.height, slice.pixel_mm, mask.is_some());
    format!("{file:?} {layer} {size:?} {settings:?} {}", hasher.finalize().to_hex())
}

impl Share {
    fn of(told: Found, found: &Detection, mask: Option<&Mask>) -> Self {
        let tally = mask.and_then(|mask| Tally::of(&found.mask(), mask));
        let mut sizes = Sizes::default();
        mask.iter().for_each(|mask| sizes.count(&found.mask(), mask));
        let told = Found { truth: tally.map(|t| t.score()), ..told };
        Self {
            found: told,
            pores: found.pores.clone(),
            cracks: found.cracks.clone(),
            tally,
            sizes,
            body: found.body.count(),
        }
    }
}

/// A batch as it grows.
#[derive(Default)]
struct Sum {
    slices: Vec<Found>,
    tally: Tally,
    sizes: Sizes,
    /// Of pores and of bodies, pixels.
    areas: [f64; 2],
}

impl Sum {
    fn add(&mut self, Share { found, pores, cracks, tally, sizes, body }: Share) {
        tally.into_iter().for_each(|t| self.tally += t);
        self.sizes += sizes;
        let body = body as f64;
        self.areas = [self.areas[0] + found.porosity * body, self.areas[1] + body];
        self.slices.push(Found { table: pores, crack_table: cracks, ..found });
    }

    fn total(&self) -> Total {
        let Self { slices, areas, .. } = self;
        let has_truth = slices.iter().any(|s| s.truth.is_some());
        Total {
            slices: slices.len(),
            pores: slices.iter().map(|s| s.pores).sum(),
            porosity: if areas[1] > 0.0 { areas[0] / areas[1] } else { 0.0 },
            cracks: slices.iter().map(|s| s.cracks).sum(),
            crack_length_px: slices.iter().map(|s| s.crack_length_px).sum(),
            seconds: slices.iter().map(|s| s.seconds).sum(),
            truth: has_truth.then(|| self.tally.score()),
            detection: if has_truth { self.sizes.classes() } else { Vec::new() },
        }
    }
}

impl Found {
    /// Its file, and its number in it if it is not the first.
    #[must_use]
    pub fn name(&self) -> String {
        name(&self.file, Some(self.layer))
    }
}

impl Unused {
    /// Its file, and its number in it if it is not the first.
    #[must_use]
    pub fn name(&self) -> String {
        name(&self.file, self.layer)
    }
}

fn name(file: &Path, layer: Option<usize>) -> String {
    match layer {
        None | Some(0) => file.display().to_string(),
        Some(layer) => format!("{}#{layer}", file.display()),
    }
}

impl SliceTally {
    fn settings_of(&self, slices: &Slices) -> DetectSettings {
        let known = slices.pixel_from() != PixelFrom::Nobody;
        DetectSettings {
            chosen_at_mm: self.settings.chosen_at_mm.filter(|_| known),
            ..self.settings
        }
    }
}

/// Slices that could not be used.
struct Refused {
    strict: bool,
    list: Vec<Unused>,
    /// Why the first was not: the error where none is left.
    first: Option<SliceError>,
}

impl Refused {
    /// Notes a slice that is itself at fault; every other error, and a file that is not there, ends
    /// the work.
    fn take(
        &mut self,
        file: &Path,
        layer: Option<usize>,
        why: SliceError,
    ) -> Result<(), SliceError> {
        let missing = matches!(&why, SliceError::File(error) if error.is_missing());
        if self.strict || missing || !why.is_of_the_slice() {
            return Err(why);
        }
        self.list.push(Unused { file: file.to_owned(), layer, because: why.to_string() });
        self.first.get_or_insert(why);
        Ok(())
    }
}

/// The masks of a slice, united. One without any label says nothing to score against.
fn labelled(layer: usize, masks: &[PathBuf], slice: &Slice) -> Result<Mask, SliceError> {
    let mask = read_masks_at(layer, masks, slice)?;
    match masks.first().filter(|_| mask.count() == 0) {
        Some(path) => Err(VolumeError::bad(
            path,
            format!("labels no pixel of {}: leave it out of --truth", slice.name),
        )
        .into()),
        None => Ok(mask),
    }
}

fn told(file: &Path, layer: usize, slice: &Slice, found: &Detection) -> Found {
    Found {
        file: file.to_owned(),
        layer,
        width: slice.grey.width,
        height: slice.grey.height,
        pixel_mm: slice.pixel_mm,
        pixel_from: PixelFrom::Given,
        pores: found.pores.len(),
        porosity: found.porosity.value,
        porosity_std_error: found.porosity.std_error,
        cracks: found.cracks.len(),
        crack_length_px: found.cracks.iter().map(|c| c.length_px).sum(),
        seconds: 0.0,
        truth: None,
        table: Vec::new(),
        crack_table: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::DetectError;

    /// A cancel in the middle of a slice is no fault of the slice: the program ends as interrupted,
    /// not with bad input, and the slice is not listed as unused.
    #[test]
    fn a_cancel_inside_a_slice_is_a_cancel() {
        let mut refused = Refused { strict: false, list: Vec::new(), first: None };
        let why = refused
            .take(Path::new("a.tif"), Some(0), DetectError::Cancelled(Cancelled).into())
            .unwrap_err();
        assert!(matches!(why, SliceError::Cancelled(_)) && refused.list.is_empty());
        assert!(
            refused
                .take(Path::new("a.tif"), Some(0), DetectError::NoBody("a.tif".into()).into())
                .is_ok()
                && refused.list.len() == 1
        );
    }
}
