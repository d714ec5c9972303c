//! A prediction on record: what is made for its report alone (pictures, what a photograph and a
//! projection would show), and the folder that it all goes into. The command line and the window
//! make the same files, since both come here.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{SystemTime, UNIX_EPOCH},
};

use intrados_ct::picture::Picture;
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, scene_rule, tone::Tone};
use intrados_predict::{MemberPrediction, Prediction};
use intrados_scene::{Camera, Scene, gltf::Model, import::ImportError};
use intrados_stage::{Cancelled, Job, file::WriteError};

use super::{Document, Provenance, ifc, pdf::PdfError, write};
use crate::{
    surface::{coloured, facets},
    visibility::{
        photograph::{Sensor, photograph},
        radiograph::radiograph,
    },
};

/// Pictures of members in a report; the worst ones.
const MOST_PICTURES: usize = 12;
/// Their size, pixels.
const SIZE: [u32; 2] = [640, 440];

/// How a prediction is put on record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// The command that a reader may repeat.
    pub command: String,
    /// Samples a pixel of the pictures; 0: no pictures.
    pub samples: u64,
    /// Seed of pictures and projections.
    pub seed: u64,
    /// The IFC model of which a copy gets the results; none: none does.
    pub ifc: Option<PathBuf>,
    /// Whether the report is printed, too, as `report.pdf`.
    pub pdf: bool,
}

impl Default for Record {
    fn default() -> Self {
        Self { command: String::new(), samples: 16, seed: 1, ifc: None, pdf: false }
    }
}

/// Why a prediction is not on record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The IFC model cannot take the results.
    #[error(transparent)]
    Model(#[from] ImportError),
    /// The report cannot be printed.
    #[error(transparent)]
    Pdf(PdfError),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<PdfError> for RecordError {
    fn from(error: PdfError) -> Self {
        match error {
            PdfError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Pdf(error),
        }
    }
}

impl Record {
    /// Makes pictures and looks what instruments would see, and [writes](write) everything into
    /// `folder`.
    ///
    /// # Errors
    /// A file cannot be written, the report cannot be printed, or the job was cancelled; before the
    /// last step nothing has been.
    pub fn make(
        &self,
        folder: &Path,
        lit: &Arc<LitScene>,
        prediction: Prediction,
        job: &Job,
    ) -> Result<Document, RecordError> {
        let scene = &lit.scene;
        let mut document = Document::of(scene, prediction);
        let mut pictures = Vec::new();
        if self.samples > 0 {
            job.relabel("rendering the report's pictures");
            pictures = self.pictures(lit, &document.prediction, &job.part(0.0, 0.6))?;
            job.relabel("what a photograph would show");
            let looks = job.part(0.6, 0.8);
            for (n, camera) in scene.cameras.iter().enumerate() {
                looks.step(n, scene.cameras.len())?;
                document.photograph.extend(photograph(
                    lit,
                    camera,
                    Sensor::default(),
                    self.seed,
                    &looks.part(0.0, 0.0),
                )?);
            }
        }
        if !scene.structure.scanners.is_empty() {
            job.relabel("what a projection would show");
            document.radiograph = radiograph(scene, self.seed, &job.part(0.8, 1.0))?;
        }
        job.step(1, 1)?;
        let provenance = Provenance {
            date: today(),
            command: self.command.clone(),
            seed: (!pictures.is_empty()).then_some(self.seed),
            samples: (!pictures.is_empty()).then_some(self.samples),
        };
        let model = match &self.ifc {
            Some(path) => {
                job.relabel("putting the results into the IFC model");
                let aside = job.part(1.0, 1.0);
                Some(ifc::with_results(path, &document.prediction, &provenance.date, &aside)?)
            }
            None => None,
        };
        let model = model.as_ref().map(|m| (m.name.as_str(), m.bytes.as_slice()));
        let printing = job.part(1.0, 1.0);
        if self.pdf {
            job.relabel("printing the report");
        }
        let print = self.pdf.then_some(&printing);
        write(folder, scene, &mut document, &pictures, model, &provenance, print)?;
        Ok(document)
    }

    /// The whole scene as it looks; then, coloured by damage, the whole and the worst members that
    /// there is evidence for.
    fn pictures(
        &self,
        lit: &Arc<LitScene>,
        prediction: &Prediction,
        job: &Job,
    ) -> Result<Vec<Picture>, Cancelled> {
        let scene = &lit.scene;
        let overview =
            scene.cameras.first().cloned().unwrap_or_else(|| Camera::overview(scene.bounds()));
        // A segment that nobody expects to be damaged needs no portrait.
        let shows = |m: &MemberPrediction| {
            m.failure.is_some()
                || m.evidence.values().any(|e| e.measured)
                || m.damage.is_some_and(|d| d >= prediction.profile.damaged_from())
        };
        let mut members: Vec<(usize, &MemberPrediction)> =
            prediction.members.iter().enumerate().filter(|(_, m)| shows(m)).collect();
        members.sort_by(|(_, a), (_, b)| {
            let by_damage = b.damage.partial_cmp(&a.damage).unwrap_or(std::cmp::Ordering::Equal);
            a.failure_order().total_cmp(&b.failure_order()).then(by_damage)
        });
        let structure = match scene.structure.project.structure.as_str() {
            "" => &scene.name,
            named => named,
        };
        let mut shots =
            vec![(lit, overview.clone(), format!("{structure}, camera {}", overview.name))];
        let known = prediction.members.iter().any(|m| m.damage.is_some());
        let painted =
            if known { Some(painted(scene, prediction, &job.part(0.0, 0.0))?) } else { None };
        if let Some(painted) = &painted {
            const LEGEND: &str = "pale yellow: sound, orange: half of the strength lost, dark red: all of it; greyed: forecast only, nothing measured there; grey: nothing known";
            shots.push((
                painted,
                overview.clone(),
                format!("The same, members coloured by damage; {LEGEND}"),
            ));
            for (index, member) in members.into_iter().take(MOST_PICTURES) {
                // From within a lining its camera sees it best.
                if let Some(camera) = portrait(scene, index, &overview) {
                    shots.push((
                        painted,
                        camera,
                        format!("{}: {}, coloured by damage", member.name, member.state),
                    ));
                }
            }
        }
        let mut pictures = Vec::new();
        for (n, (lit, camera, caption)) in shots.iter().enumerate() {
            job.step(n, shots.len())?;
            pictures.push(self.shot(Arc::clone(lit), camera, caption, job)?);
        }
        Ok(pictures)
    }

    fn shot(
        &self,
        lit: Arc<LitScene>,
        camera: &Camera,
        caption: &str,
        job: &Job,
    ) -> Result<Picture, Cancelled> {
        let camera = Camera { width: SIZE[0], height: SIZE[1], ..camera.clone() };
        let settings = RenderSettings {
            sides: Sides::Primal,
            rule: scene_rule(&lit.scene),
            seed: self.seed,
            samples: Some(self.samples),
            orders: false,
            ..RenderSettings::default()
        };
        let mut render = Render::new(lit, &camera, &settings);
        while render.advance(8) {
            if job.is_cancelled() {
                return Err(Cancelled);
            }
        }
        let tone = Tone { exposure: camera.exposure, ..Tone::default() };
        let rgb = render
            .image(View::Combined, None)
            .mean
            .into_iter()
            .flat_map(|radiance| tone.encode(radiance))
            .collect();
        Ok(Picture {
            width: SIZE[0] as usize,
            height: SIZE[1] as usize,
            rgb,
            caption: caption.to_owned(),
        })
    }
}

/// The scene with its members coloured by damage, ready for light.
fn painted(scene: &Scene, prediction: &Prediction, job: &Job) -> Result<Arc<LitScene>, Cancelled> {
    let Model { meshes, objects, materials, .. } = coloured(scene, &facets(scene), prediction);
    let painted = Scene { meshes, objects, materials, ..scene.clone() };
    Ok(Arc::new(LitScene::build(Arc::new(painted), job)?))
}

/// A camera that shows one member from where the overview stands; `None` where that is inside the
/// member.
fn portrait(scene: &Scene, member: usize, overview: &Camera) -> Option<Camera> {
    let [low, high] = scene.members.get(member)?.bounds;
    let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
    let inside = overview.position.cmpge(low).all() && overview.position.cmple(high).all();
    if inside || radius <= 0.0 {
        return None;
    }
    let there = Camera {
        name: "portrait".into(),
        target: centre,
        width: SIZE[0],
        height: SIZE[1],
        ..overview.clone()
    };
    let framed = there.framing([low, high]);
    // Never farther than the overview, where walls may be.
    Some(if framed.position.distance(centre) < there.position.distance(centre) {
        framed
    } else {
        there
    })
}

/// Date and time in UTC (days to civil date: Hinnant, "chrono-compatible low-level date
/// algorithms").
fn today() -> String {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    let (hour, minute) = (seconds / 3600 % 24, seconds / 60 % 60);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02} UTC")
}
