//! The prediction as files: a report to be read, printed and signed, and tables for other programs.
//!
//! The HTML holds its pictures and needs no script, no network and no font. Everything is written beside its place and moved there, so
//! that nobody ever sees half a file.

mod html;
mod svg;
mod tables;

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use intrados_stage::file;
use tiff::encoder::{TiffEncoder, colortype};

use crate::{
    batch::{Batch, Found},
    picture::Picture,
    predict::Prediction,
};

pub use html::html;
pub use tables::{cracks_csv, members_csv, pores_csv, slices_csv};

/// What a reader needs to repeat the result.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// Date and time, as the reader should see it; the only part of a report that differs between two runs.
    pub date: String,
    /// The command that made it.
    pub command: String,
    /// Seed of the pictures, if any were rendered.
    pub seed: Option<u64>,
    /// Samples a pixel of the pictures.
    pub samples: Option<u64>,
}

/// A file could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot write: {source}")]
pub struct WriteError {
    /// Which.
    pub path: PathBuf,
    /// Why.
    pub source: std::io::Error,
}

/// Writes `report.html`, `members.csv`, `slices.csv`, `pores.csv` and `predict.json` into a folder, which is made if it is not there,
/// and names them in `prediction.files`.
///
/// # Errors
/// A file cannot be written.
pub fn write(
    folder: &Path,
    prediction: &mut Prediction,
    pictures: &[Picture],
    provenance: &Provenance,
) -> Result<Vec<PathBuf>, WriteError> {
    let names = ["report.html", "members.csv", "slices.csv", "pores.csv", "predict.json"];
    prediction.files = names.iter().map(|n| folder.join(n).display().to_string()).collect();
    let texts = [
        html(prediction, pictures, provenance),
        members_csv(prediction),
        slices_csv(prediction),
        pores_csv(prediction.members.iter().flat_map(|m| m.slices.iter().map(move |s| ([&*m.name, &*s.core, &*s.name], &*s.table)))),
        json(&folder.join("predict.json"), prediction)?,
    ];
    names.iter().zip(texts).map(|(name, text)| put(folder, name, text.as_bytes())).collect()
}

/// Writes `detect.json`, `pores.csv`, `cracks.csv` and, for each slice, its labels as a 32-bit TIFF and its outlines as a PNG into a folder.
///
/// # Errors
/// A file cannot be written.
pub fn write_detection(folder: &Path, batch: &Batch) -> Result<Vec<PathBuf>, WriteError> {
    let several = |s: &Found| batch.slices.iter().filter(|o| o.file == s.file).count() > 1;
    let name = |s: &Found| if several(s) { format!("{}#{}", s.file.display(), s.layer) } else { s.file.display().to_string() };
    let names: Vec<String> = batch.slices.iter().map(name).collect();
    let rows = batch.slices.iter().zip(&names).map(|(s, name)| (["", "", name], &*s.table));
    let mut files = vec![
        put(folder, "detect.json", json(&folder.join("detect.json"), batch)?.as_bytes())?,
        put(folder, "pores.csv", pores_csv(rows).as_bytes())?,
        put(folder, "cracks.csv", cracks_csv(batch.slices.iter().zip(&names).map(|(s, name)| (&**name, &*s.crack_table))).as_bytes())?,
    ];
    for (n, slice) in batch.slices.iter().enumerate() {
        let stem = slice.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some(png) = slice.overlay.as_ref().and_then(Picture::png) {
            files.push(put(folder, &format!("{:03}_{stem}_overlay.png", n + 1), &png)?);
        }
        let name = format!("{:03}_{stem}_labels.tif", n + 1);
        let mut bytes = std::io::Cursor::new(Vec::new());
        let (w, h) = (slice.width as u32, slice.height as u32);
        TiffEncoder::new(&mut bytes)
            .and_then(|mut tiff| tiff.write_image::<colortype::Gray32>(w, h, &slice.labels.data))
            .map_err(|e| WriteError { path: folder.join(&name), source: std::io::Error::other(e) })?;
        files.push(put(folder, &name, bytes.get_ref())?);
    }
    Ok(files)
}

fn json(path: &Path, value: &impl serde::Serialize) -> Result<String, WriteError> {
    serde_json::to_string_pretty(value).map_err(|e| WriteError { path: path.to_owned(), source: e.into() })
}

/// Writes a file, and makes its folder.
fn put(folder: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf, WriteError> {
    let path = folder.join(name);
    let failed = |source| WriteError { path: path.clone(), source };
    std::fs::create_dir_all(folder).map_err(failed)?;
    file::put(&path, |out| out.write_all(bytes)).map_err(failed)?;
    Ok(path)
}
