//! The system's file dialogs, each on a thread of its own.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use intrados_stage::{Jobs, Task};

use crate::{Action, Actions, Log, export::Export};

/// A dialog that is gone sooner than anybody can click was never there.
const TOO_SOON: Duration = Duration::from_millis(400);

/// What a dialog is for.
#[derive(Debug, Clone)]
pub(crate) enum Purpose {
    Open,
    /// With a proposal.
    Save(String),
}

/// The dialog that is open, if one is.
#[derive(Resource, Default)]
pub(crate) struct Dialogs {
    open: Option<(Purpose, Instant, Task<Option<PathBuf>>)>,
}

impl Dialogs {
    pub(crate) fn open(&mut self, purpose: Purpose) {
        if self.open.is_some() {
            return;
        }
        let theirs = purpose.clone();
        // No job: it waits for the user, not the other way round.
        let task = Task::spawn(&mut Jobs::default(), "file dialog", move |_| match theirs {
            Purpose::Open => rfd::FileDialog::new()
                .set_title("Open a scene")
                .add_filter("Scenes and models", &["ron", "glb", "gltf"])
                .add_filter("All files", &["*"])
                .pick_file(),
            Purpose::Save(name) => rfd::FileDialog::new()
                .set_title("Export the picture")
                .add_filter("PNG, as shown", &["png"])
                .add_filter("EXR, with all data", &["exr"])
                .set_file_name(name)
                .save_file(),
        });
        self.open = Some((purpose, Instant::now(), task));
    }

    /// Whether one is open.
    pub(crate) fn is_open(&self) -> bool {
        self.open.is_some()
    }
}

/// Takes what a dialog has brought.
pub(crate) fn take(mut dialogs: ResMut<Dialogs>, mut actions: ResMut<Actions>, mut export: ResMut<Export>, mut log: ResMut<Log>) {
    let Some((purpose, since, task)) = &dialogs.open else { return };
    let Some(chosen) = task.poll() else { return };
    match (purpose, chosen.ok().flatten()) {
        (Purpose::Open, Some(path)) => actions.ask(Action::Open(path)),
        (Purpose::Save(_), Some(path)) => export.path = path.display().to_string(),
        (_, None) if since.elapsed() < TOO_SOON => {
            log.say("this desktop offers no file dialog: drop a file on the window, or type its path");
        }
        (_, None) => {}
    }
    dialogs.open = None;
}
