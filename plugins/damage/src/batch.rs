//! Detection over files, for the command line: `intrados.detect/1`.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use intrados_stage::Job;
use serde::Serialize;

use crate::{
    crack::Crack,
    detect::{self, Pore, Settings},
    grid::Grid,
    picture::{Picture, slice_pictures},
    predict::PredictError,
    score::{Score, SizeClass, Sizes, Tally},
    slice::{Slice, Slices, read_masks_at},
};

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
    pub settings: Settings,
    /// Slice by slice, in the order given.
    pub slices: Vec<Found>,
    /// All together.
    pub total: Total,
}

/// What was found in one slice.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// Number of the pore or crack part that each pixel belongs to; 0 is sound.
    #[serde(skip)]
    pub labels: Grid<u32>,
    /// The slice with the outlines of what was found.
    #[serde(skip)]
    pub overlay: Option<Picture>,
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

/// Detects pores and cracks in files; `masks` are the label masks of each slice ([`crate::slice::pair`]), none where it is empty.
///
/// # Errors
/// A file is missing or bad, or the job was cancelled.
pub fn detect_files(
    files: &[PathBuf],
    masks: &[Vec<PathBuf>],
    pixel_mm: f32,
    settings: &Settings,
    job: &Job,
) -> Result<Batch, PredictError> {
    let (mut slices, mut tally, mut sizes, mut areas) = (Vec::new(), Tally::default(), Sizes::default(), [0.0, 0.0]);
    for (n, file) in files.iter().enumerate() {
        let mut layers = Slices::open(file, pixel_mm)?;
        for layer in 0..layers.count() {
            job.step(n * layers.count() + layer, files.len() * layers.count())?;
            let slice = layers.read(layer)?;
            let begin = Instant::now();
            let found = detect::detect(&slice, settings, &Job::default())?;
            let seconds = begin.elapsed().as_secs_f64();
            let mask = match masks.get(n).filter(|m| !m.is_empty()) {
                None => None,
                Some(masks) => Some(read_masks_at(layer, masks, &slice)?),
            };
            let truth = mask.as_ref().and_then(|mask| Tally::of(&found.mask(), mask));
            truth.into_iter().for_each(|t| tally += t);
            mask.iter().for_each(|mask| sizes.count(&found.mask(), mask));
            let body = found.body.count() as f64;
            areas = [areas[0] + found.porosity.value * body, areas[1] + body];
            let [_, overlay] = slice_pictures(&found, mask.as_ref());
            slices.push(told(file, layer, &slice, found, seconds, truth, Some(overlay)));
        }
    }
    job.step(1, 1)?;
    let total = Total {
        slices: slices.len(),
        pores: slices.iter().map(|s| s.pores).sum(),
        porosity: if areas[1] > 0.0 { areas[0] / areas[1] } else { 0.0 },
        cracks: slices.iter().map(|s| s.cracks).sum(),
        crack_length_px: slices.iter().map(|s| s.crack_length_px).sum(),
        seconds: slices.iter().map(|s| s.seconds).sum(),
        truth: slices.iter().any(|s| s.truth.is_some()).then(|| tally.score()),
        detection: if slices.iter().any(|s| s.truth.is_some()) { sizes.classes() } else { Vec::new() },
    };
    Ok(Batch { schema: SCHEMA, version: env!("CARGO_PKG_VERSION"), settings: *settings, slices, total })
}

fn told(
    file: &Path,
    layer: usize,
    slice: &Slice,
    found: detect::Detection,
    seconds: f64,
    truth: Option<Tally>,
    overlay: Option<Picture>,
) -> Found {
    Found {
        file: file.to_owned(),
        layer,
        width: slice.grey.width,
        height: slice.grey.height,
        pixel_mm: slice.pixel_mm,
        pores: found.pores.len(),
        porosity: found.porosity.value,
        porosity_std_error: found.porosity.std_error,
        cracks: found.cracks.len(),
        crack_length_px: found.cracks.iter().map(|c| c.length_px).sum(),
        seconds,
        truth: truth.map(|t| t.score()),
        table: found.pores,
        crack_table: found.cracks,
        labels: found.labels,
        overlay,
    }
}
