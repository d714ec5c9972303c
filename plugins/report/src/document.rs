//! A prediction with what was made of it, and the folder that it is written into.

use std::{
    io,
    path::{Path, PathBuf},
};

use intrados_ct::{batch::pores_csv, picture::Picture};
use intrados_predict::Prediction;
use intrados_scene::Scene;
use intrados_stage::{
    Job,
    file::{Set, WriteError, put_into},
};
use serde::Serialize;

use crate::{
    basis::Basis,
    bcf::{Version, bcf},
    defects_csv, evidence_csv, html, members_csv, model, pdf,
    record::RecordError,
    slices_csv,
    visibility::{photograph::PhotographedDefect, radiograph::RadiographedDefect},
    zones_csv,
};

/// What a reader needs to repeat the result.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// Date and time, as the reader should see it; the only part of a report that differs between
    /// two runs.
    pub date: String,
    /// The command that made it.
    pub command: String,
    /// Seed of the pictures, if any were rendered.
    pub seed: Option<u64>,
    /// Samples a pixel of the pictures.
    pub samples: Option<u64>,
}

/// A prediction on record. Serialises to `intrados.predict/2`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Document {
    /// What was predicted.
    #[serde(flatten)]
    pub prediction: Prediction,
    /// What it rests on.
    pub basis: Basis,
    /// What photographs would show of known defects; empty where nobody looked.
    pub photograph: Vec<PhotographedDefect>,
    /// What the scene's scanners would show of them.
    pub radiograph: Vec<RadiographedDefect>,
    /// The files that it was written into.
    pub files: Vec<String>,
}

impl Document {
    /// Of a prediction for a scene.
    #[must_use]
    pub fn of(scene: &Scene, prediction: Prediction) -> Self {
        let basis = Basis::of(scene);
        Self {
            prediction,
            basis,
            photograph: Vec::new(),
            radiograph: Vec::new(),
            files: Vec::new(),
        }
    }
}

/// Writes, all at once ([`Set`]), `report.html`, `evidence.csv`, `members.csv`, `zones.csv`,
/// `defects.csv`, `slices.csv`, `pores.csv`, `damage.bcf`, `damage-3.0.bcf` and `predict.json` into
/// a folder, which is made if it is not there; where members have surfaces, `damage.glb` and
/// `damage.vtu` too, a `model` by its name where there is one, and `report.pdf` where a job is given
/// in which it is printed. Names them in the document.
///
/// # Errors
/// A file cannot be written, or the report not be printed.
pub fn write(
    folder: &Path,
    scene: &Scene,
    document: &mut Document,
    pictures: &[Picture],
    model: Option<(&str, &[u8])>,
    provenance: &Provenance,
    print: Option<&Job>,
) -> Result<Vec<PathBuf>, RecordError> {
    let mut files = begin(folder)?;
    let texts: [(&str, fn(&Prediction) -> String); 6] = [
        ("evidence.csv", evidence_csv),
        ("members.csv", members_csv),
        ("zones.csv", zones_csv),
        ("defects.csv", defects_csv),
        ("slices.csv", slices_csv),
        ("pores.csv", pores),
    ];
    let pages = [Some(REPORT), print.map(|_| PRINTED)].into_iter().flatten();
    let reserved = pages.chain(texts.iter().map(|t| t.0));
    let reserved = reserved.chain([TOPICS, TOPICS_3, PREDICTION]).chain(model.map(|m| m.0));
    reserved.for_each(|name| _ = files.place(name));
    model::write(&mut files, scene, &document.prediction)?;
    document.files = files.files().iter().map(|p| p.display().to_string()).collect();
    let page = html(document, pictures, provenance)
        .map_err(|e| WriteError { path: folder.join(REPORT), source: io::Error::other(e) })?;
    put_into(&mut files, REPORT, page.as_bytes())?;
    if let Some(job) = print {
        pdf::print(&files.place(REPORT), &files.place(PRINTED), job)?;
    }
    for (name, text) in texts {
        put_into(&mut files, name, text(&document.prediction).as_bytes())?;
    }
    let (prediction, basis) = (&document.prediction, &document.basis);
    for (name, version) in [(TOPICS, Version::V2_1), (TOPICS_3, Version::V3_0)] {
        let topics = bcf(scene, prediction, basis, &provenance.date, version)
            .map_err(|source| WriteError { path: folder.join(name), source })?;
        put_into(&mut files, name, &topics)?;
    }
    if let Some((name, bytes)) = model {
        put_into(&mut files, name, bytes)?;
    }
    let list = json(&folder.join(PREDICTION), document)?;
    put_into(&mut files, PREDICTION, list.as_bytes())?;
    Ok(publish(files, PREDICTION)?)
}

/// The report, and the same on paper.
const REPORT: &str = "report.html";
const PRINTED: &str = "report.pdf";

/// Defects for programs that have the IFC model open, and for those that read the newer form.
const TOPICS: &str = "damage.bcf";
const TOPICS_3: &str = "damage-3.0.bcf";
/// The list of a prediction's files.
const PREDICTION: &str = "predict.json";

fn pores(prediction: &Prediction) -> String {
    pores_csv(
        prediction.members.iter().flat_map(|m| {
            m.slices.iter().map(move |s| ([&*m.name, &*s.core, &*s.name], &*s.table))
        }),
    )
}

fn json(path: &Path, value: &impl serde::Serialize) -> Result<String, WriteError> {
    serde_json::to_string_pretty(value)
        .map_err(|e| WriteError { path: path.to_owned(), source: e.into() })
}

fn begin(folder: &Path) -> Result<Set, WriteError> {
    Set::begin(folder).map_err(|source| WriteError { path: folder.to_owned(), source })
}

fn publish(files: Set, list: &str) -> Result<Vec<PathBuf>, WriteError> {
    let folder = files.folder().to_owned();
    files.publish(list).map_err(|source| WriteError { path: folder, source })
}
