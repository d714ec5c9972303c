//! The prediction as files: a report to be read, printed and signed, and tables for other programs.
//!
//! The HTML holds its pictures and needs no script, no network and no font. Everything is written beside its place and moved there, so
//! that nobody ever sees half a file.

mod html;
mod model;
mod record;
mod svg;
mod tables;

use std::path::{Path, PathBuf};

use intrados_scene::Scene;
use intrados_stage::file::{Set, file_name};
use serde::de::DeserializeOwned;
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

/// Writes, all at once ([`Set`]), `report.html`, `evidence.csv`, `members.csv`, `zones.csv`, `slices.csv`, `pores.csv` and `predict.json` into a folder, which is made if
/// it is not there; where members have surfaces, `damage.glb` and `damage.vtu` too. Names them in `prediction.files`.
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
    let mut files = begin(folder)?;
    let texts: [(&str, fn(&Prediction) -> String); 5] = [
        ("evidence.csv", evidence_csv),
        ("members.csv", members_csv),
        ("zones.csv", zones_csv),
        ("slices.csv", slices_csv),
        ("pores.csv", pores),
    ];
    let reserved = ["report.html"].into_iter().chain(texts.iter().map(|t| t.0)).chain([PREDICTION]);
    reserved.for_each(|name| _ = files.place(name));
    model::write(&mut files, scene, prediction)?;
    prediction.files = files.files().iter().map(|p| p.display().to_string()).collect();
    put(&mut files, "report.html", html(prediction, pictures, provenance).as_bytes())?;
    for (name, text) in texts {
        put(&mut files, name, text(prediction).as_bytes())?;
    }
    let list = json(&folder.join(PREDICTION), prediction)?;
    put(&mut files, PREDICTION, list.as_bytes())?;
    publish(files, PREDICTION)
}

/// The list of a prediction's files.
const PREDICTION: &str = "predict.json";

fn pores(prediction: &Prediction) -> String {
    pores_csv(prediction.members.iter().flat_map(|m| m.slices.iter().map(move |s| ([&*m.name, &*s.core, &*s.name], &*s.table))))
}

/// Detection on its way into a set of files: each slice's labels as a 32-bit TIFF and its outlines as a PNG, and the tables of all. Slices that are done are kept in the set
/// until it is published.
#[derive(Debug)]
pub struct DetectionWriter<'a> {
    files: &'a mut Set,
    slices: usize,
    /// Of the files that were there before the slice at work.
    before: usize,
}

impl<'a> DetectionWriter<'a> {
    /// The list of its files.
    pub const LIST: &'static str = "detect.json";
    const PORES: &'static str = "pores.csv";
    const CRACKS: &'static str = "cracks.csv";

    /// Begins with a set that has no files yet. The key of the set names the program and the settings.
    pub fn new(files: &'a mut Set) -> Self {
        // Users look at the tables first.
        [Self::PORES, Self::CRACKS, Self::LIST].into_iter().for_each(|name| _ = files.place(name));
        Self { before: files.files().len(), files, slices: 0 }
    }

    /// What was kept of the next slice, if an earlier run has done it; its files then are those of that run.
    pub(crate) fn known<T: DeserializeOwned>(&mut self, part: &str) -> Option<T> {
        let known = self.files.recall(&self.name(self.slices + 1, part))?;
        self.slices += 1;
        Some(known)
    }

    /// One slice more.
    ///
    /// # Errors
    /// It cannot be written.
    pub(crate) fn slice(&mut self, slice: &Found, found: &Detection, mask: Option<&Mask>) -> Result<(), WriteError> {
        self.slices += 1;
        self.before = self.files.files().len();
        let (number, stem) = (self.slices, file_name(&slice.file.file_stem().unwrap_or_default().to_string_lossy()));
        let [_, overlay] = slice_pictures(found, mask);
        if let Some(png) = overlay.png() {
            put(self.files, &format!("{number:03}_{stem}_overlay.png"), &png)?;
        }
        let name = format!("{number:03}_{stem}_labels.tif");
        let mut bytes = std::io::Cursor::new(Vec::new());
        let (w, h) = (slice.width as u32, slice.height as u32);
        TiffEncoder::new(&mut bytes)
            .and_then(|mut tiff| tiff.write_image::<colortype::Gray32>(w, h, &found.labels.data))
            .map_err(|e| WriteError { path: self.files.folder().join(&name), source: std::io::Error::other(e) })?;
        put(self.files, &name, bytes.get_ref())
    }

    /// Keeps that slice, so that a run that is broken off needs not do it again.
    pub(crate) fn keep(&self, part: &str, value: &impl serde::Serialize) {
        let files = self.files.files();
        let own = files[self.before..].iter().filter_map(|f| Some(f.file_name()?.to_string_lossy().into_owned()));
        self.files.keep(&self.name(self.slices, part), own.collect(), value);
    }

    /// Files are numbered: a slice that comes at another place has others.
    fn name(&self, number: usize, part: &str) -> String {
        format!("{number} {part}")
    }

    /// Writes the tables. What is left is the list.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn tables(self, batch: &Batch) -> Result<(), WriteError> {
        let several = |s: &Found| batch.slices.iter().any(|o| o.file == s.file && o.layer != s.layer);
        let name = |s: &Found| if several(s) { format!("{}#{}", s.file.display(), s.layer) } else { s.file.display().to_string() };
        let names: Vec<String> = batch.slices.iter().map(name).collect();
        let rows = batch.slices.iter().zip(&names).map(|(s, name)| (["", "", name], &*s.table));
        put(self.files, Self::PORES, pores_csv(rows).as_bytes())?;
        let cracks = cracks_csv(batch.slices.iter().zip(&names).map(|(s, name)| (&**name, &*s.crack_table)));
        put(self.files, Self::CRACKS, cracks.as_bytes())
    }
}

fn json(path: &Path, value: &impl serde::Serialize) -> Result<String, WriteError> {
    serde_json::to_string_pretty(value).map_err(|e| WriteError { path: path.to_owned(), source: e.into() })
}

fn begin(folder: &Path) -> Result<Set, WriteError> {
    Set::begin(folder).map_err(|source| WriteError { path: folder.to_owned(), source })
}

fn put(files: &mut Set, name: &str, bytes: &[u8]) -> Result<(), WriteError> {
    files.put(name, bytes).map_err(|source| WriteError { path: files.folder().join(name), source })
}

fn publish(files: Set, list: &str) -> Result<Vec<PathBuf>, WriteError> {
    let folder = files.folder().to_owned();
    files.publish(list).map_err(|source| WriteError { path: folder, source })
}
