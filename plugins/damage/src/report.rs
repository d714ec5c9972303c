//! The prediction as files: a report to be read, printed and signed, and tables for other programs.
//!
//! The HTML holds its pictures and needs no script, no network and no font. Everything is written beside its place and moved there, so
//! that nobody ever sees half a file.

mod html;
mod model;
mod record;
mod svg;
mod tables;

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use intrados_scene::Scene;
use intrados_stage::file;
use tiff::encoder::{TiffEncoder, colortype};

use crate::{
    batch::{Batch, Found},
    detect::Detection,
    grid::Mask,
    picture::{Picture, slice_pictures},
    predict::Prediction,
};

pub use html::html;
pub use record::{Record, RecordError};
pub use tables::{cracks_csv, evidence_csv, members_csv, pores_csv, slices_csv, zones_csv};

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

/// Writes `report.html`, `evidence.csv`, `members.csv`, `zones.csv`, `slices.csv`, `pores.csv` and `predict.json` into a folder, which is made if it is not there;
/// where members have surfaces, `damage.glb` and `damage.vtu` too. Names them in `prediction.files`.
///
/// # Errors
/// A file cannot be written.
pub fn write(
    folder: &Path,
    scene: &Scene,
    prediction: &mut Prediction,
    pictures: &[Picture],
    provenance: &Provenance,
) -> Result<Vec<PathBuf>, WriteError> {
    let names = ["report.html", "evidence.csv", "members.csv", "zones.csv", "slices.csv", "pores.csv", "predict.json"];
    std::fs::create_dir_all(folder).map_err(|source| WriteError { path: folder.to_owned(), source })?;
    let models = model::write(folder, scene, prediction)?;
    let place = |n: &&str| folder.join(n);
    prediction.files = names.iter().map(place).chain(models.iter().cloned()).map(|p| p.display().to_string()).collect();
    let texts = [
        html(prediction, pictures, provenance),
        evidence_csv(prediction),
        members_csv(prediction),
        zones_csv(prediction),
        slices_csv(prediction),
        pores_csv(prediction.members.iter().flat_map(|m| m.slices.iter().map(move |s| ([&*m.name, &*s.core, &*s.name], &*s.table)))),
        json(&folder.join("predict.json"), prediction)?,
    ];
    let written: Vec<PathBuf> = names.iter().zip(texts).map(|(name, text)| put(folder, name, text.as_bytes())).collect::<Result<_, _>>()?;
    Ok(written.into_iter().chain(models).collect())
}

/// Detection on its way into a folder: each slice's labels as a 32-bit TIFF and its outlines as a PNG, then `detect.json`, `pores.csv` and `cracks.csv`. All lies beside its place until
/// [`DetectionWriter::finish`], so that a batch that breaks off leaves nothing.
#[derive(Debug)]
pub struct DetectionWriter {
    folder: PathBuf,
    aside: tempfile::TempDir,
    names: Vec<String>,
}

impl DetectionWriter {
    /// Begins; `folder` need not be there yet.
    ///
    /// # Errors
    /// Nothing can be written where it is to be.
    pub fn begin(folder: &Path) -> Result<Self, WriteError> {
        let failed = |source| WriteError { path: folder.to_owned(), source };
        let there = std::path::absolute(folder).map_err(failed)?;
        let above = there.ancestors().find(|p| p.exists()).unwrap_or(Path::new("."));
        let aside = tempfile::Builder::new().prefix(".intrados-").tempdir_in(above).map_err(failed)?;
        Ok(Self { folder: folder.to_owned(), aside, names: Vec::new() })
    }

    /// One slice more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn slice(&mut self, slice: &Found, found: &Detection, mask: Option<&Mask>) -> Result<(), WriteError> {
        let number = 1 + self.names.iter().filter(|n| n.ends_with(".tif")).count();
        let stem = slice.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let [_, overlay] = slice_pictures(found, mask);
        if let Some(png) = overlay.png() {
            self.put(format!("{number:03}_{stem}_overlay.png"), &png)?;
        }
        let name = format!("{number:03}_{stem}_labels.tif");
        let mut bytes = std::io::Cursor::new(Vec::new());
        let (w, h) = (slice.width as u32, slice.height as u32);
        TiffEncoder::new(&mut bytes)
            .and_then(|mut tiff| tiff.write_image::<colortype::Gray32>(w, h, &found.labels.data))
            .map_err(|e| WriteError { path: self.folder.join(&name), source: std::io::Error::other(e) })?;
        self.put(name, bytes.get_ref())
    }

    /// Writes the tables and moves everything to its place.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn finish(mut self, batch: &Batch) -> Result<Vec<PathBuf>, WriteError> {
        let several = |s: &Found| batch.slices.iter().any(|o| o.file == s.file && o.layer != s.layer);
        let name = |s: &Found| if several(s) { format!("{}#{}", s.file.display(), s.layer) } else { s.file.display().to_string() };
        let names: Vec<String> = batch.slices.iter().map(name).collect();
        let rows = batch.slices.iter().zip(&names).map(|(s, name)| (["", "", name], &*s.table));
        let slices = std::mem::take(&mut self.names);
        self.put("detect.json".into(), json(&self.folder.join("detect.json"), batch)?.as_bytes())?;
        self.put("pores.csv".into(), pores_csv(rows).as_bytes())?;
        let cracks = cracks_csv(batch.slices.iter().zip(&names).map(|(s, name)| (&**name, &*s.crack_table)));
        self.put("cracks.csv".into(), cracks.as_bytes())?;
        let failed = |path: PathBuf| move |source| WriteError { path, source };
        std::fs::create_dir_all(&self.folder).map_err(failed(self.folder.clone()))?;
        let place = |name: &String| {
            let path = self.folder.join(name);
            std::fs::rename(self.aside.path().join(name), &path).map_err(failed(path.clone()))?;
            Ok(path)
        };
        self.names.iter().chain(&slices).map(place).collect()
    }

    fn put(&mut self, name: String, bytes: &[u8]) -> Result<(), WriteError> {
        put(self.aside.path(), &name, bytes).map_err(|e| WriteError { path: self.folder.join(&name), ..e })?;
        self.names.push(name);
        Ok(())
    }
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
