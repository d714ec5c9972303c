//! The prediction as files, the same as `intrados predict --out` writes.

use std::{path::PathBuf, sync::Arc};

use bevy_ecs::prelude::*;
use egui::{Button, Ui};
use intrados_light::LitScene;
use intrados_predict::Prediction;
use intrados_report::{Record, RecordError};
use intrados_scene::Scene;
use intrados_stage::{Cancelled, Job, Jobs, Task, aside};

use super::Report;
use crate::{Action, Actions, Banners, Log, destination::Destination, lang::term, saving::Written};

/// Where to, and the write that runs.
#[derive(Default)]
pub(super) struct Save {
    to: Destination,
    /// The scene that it was proposed for.
    of: String,
    task: Option<Task<(PathBuf, Result<usize, RecordError>)>>,
}

impl Save {
    pub(super) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// Where it would go.
    pub(super) fn proposal(&self) -> String {
        self.to.path.clone()
    }

    /// Where a dialog says.
    pub(super) fn put(&mut self, folder: PathBuf) {
        self.to.put_folder(folder);
    }

    /// Asks for the folder.
    pub(super) fn row(
        &mut self,
        ui: &mut Ui,
        scene: &Arc<Scene>,
        prediction: &Arc<Prediction>,
        jobs: &mut Jobs,
        actions: &mut Actions,
    ) {
        if self.of != scene.name {
            self.of = scene.name.clone();
            self.to.path = format!("{}-damage", scene.name.replace(['/', '\\'], "-"));
        }
        ui.horizontal_wrapped(|ui| {
            let is_entered = self.to.field(ui, tr!("Save to folder"), 240.0);
            if ui.button(tr!("Browse…")).clicked() {
                actions.ask(Action::ChooseReportFolder);
            }
            let folder = self.to.path.trim();
            let may = self.task.is_none() && !folder.is_empty();
            let hint = tr!(
                "Report, tables and models, as `intrados predict --out` writes them: report.html, \
                 predict.json, CSV, glTF and VTU"
            );
            let save = ui.add_enabled(may, Button::new(tr!("Save report")));
            if save.on_hover_text(hint).clicked() || is_entered && may {
                let (scene, prediction) = (Arc::clone(scene), Arc::clone(prediction));
                self.task = Some(begin(folder.into(), scene, prediction, jobs));
            }
        });
    }
}

fn begin(
    folder: PathBuf,
    scene: Arc<Scene>,
    prediction: Arc<Prediction>,
    jobs: &mut Jobs,
) -> Task<(PathBuf, Result<usize, RecordError>)> {
    let record = Record {
        command: format!("intrados predict {} --out {}", scene.name, folder.display()),
        ..Record::default()
    };
    Task::spawn(jobs, tr!("writing {}", folder.display()), move |job| {
        let done = aside(|| write(&record, &folder, scene, &prediction, job));
        (folder, done)
    })
}

/// The same for whoever asks from elsewhere, with a PDF of it; says what was written, or nothing
/// where somebody cancelled it.
pub(crate) fn save_report(
    folder: PathBuf,
    scene: Arc<Scene>,
    prediction: Arc<Prediction>,
    with_pdf: bool,
    jobs: &mut Jobs,
) -> Task<Result<Option<Written>, String>> {
    let command = format!("intrados predict {} --out {}", scene.name, folder.display());
    let record = Record { command, pdf: with_pdf, ..Record::default() };
    Task::spawn(jobs, tr!("writing {}", folder.display()), move |job| {
        match aside(|| write(&record, &folder, scene, &prediction, job)) {
            Ok(files) => Ok(Some(Written { files: Some(files), path: folder })),
            Err(RecordError::Cancelled(Cancelled)) => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    })
}

/// The scene as it was loaded: what the window shows may have cracks of an analysis on it.
fn write(
    record: &Record,
    folder: &std::path::Path,
    scene: Arc<Scene>,
    prediction: &Prediction,
    job: &Job,
) -> Result<usize, RecordError> {
    let lit = Arc::new(LitScene::build(scene, &job.part(0.0, 0.05))?);
    Ok(record.make(folder, &lit, prediction.clone(), &job.part(0.05, 1.0))?.files.len())
}

/// Says how a write ended.
pub(crate) fn take(mut report: ResMut<Report>, mut banners: ResMut<Banners>, mut log: ResMut<Log>) {
    let save = &mut report.bypass_change_detection().save;
    let Some(done) = Task::take(&mut save.task) else { return };
    // What a panic said is told with all others.
    let Ok((folder, done)) = done else { return };
    let folder = folder.display();
    match done {
        Ok(files) => log.say(tr!("wrote {} files into {}", files, folder)),
        Err(RecordError::Cancelled(Cancelled)) => log.say(tr!("writing {} was cancelled", folder)),
        Err(error) => {
            log.say(tr!("⚠ not saved: {}", term(&error.to_string())));
            banners.cannot(&tr!("Not saved"), &error.to_string());
        }
    }
}
