//! Pores and cracks of one slice, a picture in memory or a file.

use std::path::PathBuf;

use intrados::embedded::Refusal;
use intrados_ct::{
    SliceError,
    detect::{DetectSettings, Detection, Method, detect},
    slice::{PixelFrom, Slice, Slices},
};
use intrados_raster::grid::Grid;
use intrados_stage::Job;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyBytes};
use serde_json::json;

use crate::watch::watched;

/// What a slice shows: JSON, and its labels (u32) and crack pixels (u8), row by row.
type Told<'py> = (String, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// Reads `height` rows of `width` grey values, f32 in the machine's order.
#[pyfunction]
pub(crate) fn detect_array<'py>(
    py: Python<'py>,
    grey: &[u8],
    width: usize,
    height: usize,
    pixel_mm: Option<f32>,
    method: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Told<'py>> {
    let data: Vec<f32> =
        grey.as_chunks::<4>().0.iter().map(|four| f32::from_ne_bytes(*four)).collect();
    if width == 0 || height == 0 || width.checked_mul(height) != Some(data.len()) {
        return Err(PyValueError::new_err("an image has rows of grey values, all as long"));
    }
    if let Some(at) = data.iter().position(|value| !value.is_finite()) {
        let (row, column) = (at / width, at % width);
        let line = format!("row {row}, column {column} of the image is no number");
        return Err(PyValueError::new_err(line));
    }
    if let Some(mm) = pixel_mm.filter(|mm| !(mm.is_finite() && *mm > 0.0)) {
        return Err(PyValueError::new_err(format!(
            "the edge of a pixel must be above 0 mm, not {mm}"
        )));
    }
    let slice = Slice {
        name: "the image".into(),
        grey: Grid { width, height, data },
        pixel_mm: pixel_mm.unwrap_or(1.0),
    };
    let settings = settings(method, pixel_mm.is_some())?;
    read(py, progress, move |job| {
        let found = detect(&slice, &settings, job).map_err(SliceError::from)?;
        Ok((slice.pixel_mm, pixel_mm.is_some(), found))
    })
}

/// Reads the slice of a file; one of several by its number.
#[pyfunction]
pub(crate) fn detect_file<'py>(
    py: Python<'py>,
    path: PathBuf,
    layer: Option<usize>,
    pixel_mm: Option<f32>,
    method: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Told<'py>> {
    let known = settings(method, true)?;
    let unknown = settings(method, false)?;
    read(py, progress, move |job| {
        let mut layers = Slices::open(&path, pixel_mm).map_err(SliceError::from)?;
        let slice = match layer {
            Some(layer) if layer >= layers.count() => {
                let (path, n) = (path.display(), layers.count());
                return Err(SliceError::Unfit(format!("{path}: has {n} slices, numbered from 0")));
            }
            Some(layer) => layers.read(layer),
            None => layers.only(),
        };
        let slice = slice.map_err(SliceError::from)?;
        let is_known = layers.pixel_from() != PixelFrom::Nobody;
        let settings = if is_known { &known } else { &unknown };
        let found = detect(&slice, settings, job).map_err(SliceError::from)?;
        Ok((slice.pixel_mm, is_known, found))
    })
}

/// Settings as of `intrados detect`: where nobody knows how large pixels are, in pixels.
fn settings(method: &str, is_known: bool) -> PyResult<DetectSettings> {
    let method = match method {
        "auto" | "network" => Method::Network,
        "classical" => Method::Classical,
        other => {
            let line = format!("method {other:?}: there are auto, network, classical");
            return Err(PyValueError::new_err(line));
        }
    };
    let usual = DetectSettings { method, ..DetectSettings::default() };
    Ok(DetectSettings { chosen_at_mm: usual.chosen_at_mm.filter(|_| is_known), ..usual })
}

/// The edge of a pixel in mm, whether anybody has said it, and what was found.
type Read = (f32, bool, Detection);

fn read<'py>(
    py: Python<'py>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Job) -> Result<Read, SliceError> + Send + 'static,
) -> PyResult<Told<'py>> {
    let (pixel_mm, is_known, found) =
        watched(py, progress, move |job| work(job).map_err(Refusal::from))?;
    let json = json!({
        "width": found.labels.width,
        "height": found.labels.height,
        "pixel_mm": pixel_mm,
        "pixel_known": is_known,
        "porosity": found.porosity.value,
        "porosity_std_error": found.porosity.std_error,
        "sampling_error": found.sampling_error,
        "cracks": found.cracks,
        "pores": found.pores,
    });
    let labels: Vec<u8> = found.labels.data.iter().flat_map(|n| n.to_ne_bytes()).collect();
    let cracks: Vec<u8> = found.crack_mask.data.iter().map(|&set| u8::from(set)).collect();
    Ok((json.to_string(), PyBytes::new(py, &labels), PyBytes::new(py, &cracks)))
}
