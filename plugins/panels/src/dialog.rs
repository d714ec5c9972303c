//! The system's file dialogs, each on a thread of its own.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use intrados_stage::{Jobs, Task};

use crate::{
    Action, Actions, Banners, Log, attach::Form, create::Creation, export::Export, report::Report,
    saving::Saving,
};

/// A dialog that is gone sooner than anybody can click was never there.
const TOO_SOON: Duration = Duration::from_millis(400);

/// What photographs end in.
const PHOTOGRAPHS: &[&str] = &["jpg", "jpeg", "png", "tif", "tiff"];

/// What slices and tables end in.
const EVIDENCE: &[&str] = &["csv", "tsv", "txt", "tif", "tiff", "png", "mha", "mhd", "dcm"];

/// Whether a file is a photograph, by its name; those too that are refused with a remedy.
pub(crate) fn is_photograph(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    PHOTOGRAPHS.contains(&ending.as_str()) || ["heic", "heif"].contains(&ending.as_str())
}

/// What a dialog is for.
#[derive(Debug, Clone)]
pub(crate) enum Purpose {
    Open,
    Photograph,
    /// Slices or a table.
    Evidence,
    /// What `intrados predict` has written.
    Prediction,
    /// With a proposal.
    Save(String),
    /// The same of what is no picture of light.
    Take(String),
    /// The same of what is a folder of files, and whose.
    Folder(Whose, String),
}

/// Who writes a folder of files.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Whose {
    /// The sheet that saves something.
    Sheet,
    /// The Report tab.
    Report,
    /// A new structure.
    Structure,
}

impl Purpose {
    /// The system's dialog, in the language of the window.
    fn dialog(&self) -> rfd::FileDialog {
        let dialog = rfd::FileDialog::new();
        let all = tr!("All files");
        match self {
            Self::Open => dialog
                .set_title(tr!("Open a scene"))
                .add_filter(tr!("Scenes and models"), &["ron", "glb", "gltf", "ifc"])
                .add_filter(all, &["*"]),
            Self::Photograph => dialog
                .set_title(tr!("Open a photograph"))
                .add_filter(tr!("Photographs"), PHOTOGRAPHS)
                .add_filter(all, &["*"]),
            Self::Evidence => dialog
                .set_title(tr!("Attach CT slices or a table"))
                .add_filter(tr!("Slices and tables"), EVIDENCE)
                .add_filter(all, &["*"]),
            Self::Prediction => dialog
                .set_title(tr!("Open an earlier prediction"))
                .add_filter("predict.json", &["json"]),
            Self::Save(name) => dialog
                .set_title(tr!("Export the picture"))
                .add_filter(tr!("PNG, as shown"), &["png"])
                .add_filter(tr!("EXR, with all data"), &["exr"])
                .set_file_name(name),
            Self::Take(name) => dialog.set_title(tr!("Save")).set_file_name(name),
            Self::Folder(_, name) => {
                let dialog =
                    dialog.set_title(tr!("Folder to write")).set_can_create_directories(true);
                let proposed = std::path::absolute(name.trim()).unwrap_or_default();
                match proposed.parent().filter(|above| above.is_dir()) {
                    Some(above) => dialog.set_directory(above),
                    None => dialog,
                }
            }
        }
    }
}

/// The dialog that is open, if one is.
#[derive(Resource)]
pub(crate) struct Dialogs {
    /// Whether there may be any.
    allowed: bool,
    open: Option<(Purpose, Instant, Task<Vec<PathBuf>>)>,
}

impl Dialogs {
    pub(crate) fn new(allowed: bool) -> Self {
        Self { allowed, open: None }
    }

    pub(crate) fn open(world: &mut World, purpose: Purpose) {
        if world.resource::<Self>().open.is_some() {
            return;
        }
        if !world.resource::<Self>().allowed || !is_offered() {
            let mut log = std::mem::take(&mut *world.resource_mut::<Log>());
            is_missing(&purpose, &mut world.resource_mut::<Banners>(), &mut log);
            *world.resource_mut::<Log>() = log;
            return;
        }
        let (theirs, dialog) = (purpose.clone(), purpose.dialog());
        let mut jobs = world.resource_mut::<Jobs>();
        // Not in the list of jobs: it waits for the user, not the other way round.
        let task = Task::spawn_unlisted(&mut jobs, tr!("file dialog"), move |_| match theirs {
            Purpose::Evidence => dialog.pick_files().unwrap_or_default(),
            Purpose::Save(_) | Purpose::Take(_) => dialog.save_file().into_iter().collect(),
            Purpose::Folder(..) => dialog.pick_folder().into_iter().collect(),
            Purpose::Open | Purpose::Photograph | Purpose::Prediction => {
                dialog.pick_file().into_iter().collect()
            }
        });
        world.resource_mut::<Self>().open = Some((purpose, Instant::now(), task));
    }

    /// Whether one is open.
    pub(crate) fn is_open(&self) -> bool {
        self.open.is_some()
    }
}

/// Whether anybody could show a dialog: on Linux a portal, which is reached by the session's bus,
/// or else zenity.
fn is_offered() -> bool {
    if cfg!(not(all(unix, not(target_os = "macos")))) {
        return true;
    }
    let path = |name| std::env::var_os(name).filter(|v| !v.is_empty());
    let bus = path("DBUS_SESSION_BUS_ADDRESS").is_some()
        || path("XDG_RUNTIME_DIR").is_some_and(|d| PathBuf::from(d).join("bus").exists());
    bus || path("PATH").is_some_and(|all| {
        std::env::split_paths(&all).any(|folder| folder.join("zenity").is_file())
    })
}

/// Says so, and what to do instead.
fn is_missing(purpose: &Purpose, banners: &mut Banners, log: &mut Log) {
    let instead = match purpose {
        Purpose::Open => tr!(
            "start with `intrados view FILE`, drop the file on the window, or type its path on the \
             start screen"
        ),
        Purpose::Evidence => tr!("drop the files on the window, or type their path"),
        Purpose::Photograph => tr!("drop the photograph on the window, or type its path"),
        Purpose::Prediction => tr!("drop its predict.json on the window"),
        Purpose::Save(_) | Purpose::Take(_) => tr!("type the file's name instead"),
        Purpose::Folder(..) => tr!("type the folder's name instead"),
    };
    log.say(tr!("no file dialog on this system: {}", instead));
    banners.cannot(&tr!("No file dialog on this system"), &instead);
}

/// Takes what a dialog has brought.
pub(crate) fn take(
    mut dialogs: ResMut<Dialogs>,
    mut actions: ResMut<Actions>,
    mut export: ResMut<Export>,
    mut form: ResMut<Form>,
    mut saving: ResMut<Saving>,
    mut report: ResMut<Report>,
    mut creation: ResMut<Creation>,
    mut banners: ResMut<Banners>,
    mut log: ResMut<Log>,
) {
    let Some((purpose, since, task)) = &dialogs.open else { return };
    let Some(chosen) = task.poll() else { return };
    let mut chosen = chosen.unwrap_or_default();
    if matches!(purpose, Purpose::Evidence) && !chosen.is_empty() {
        form.add(chosen);
        dialogs.open = None;
        return;
    }
    match (purpose, chosen.pop()) {
        (Purpose::Open, Some(path)) => actions.ask(Action::Open(path)),
        (Purpose::Photograph, Some(path)) => actions.ask(Action::Photograph(path)),
        (Purpose::Prediction, Some(path)) => actions.ask(Action::Compare(path)),
        (Purpose::Take(_) | Purpose::Folder(Whose::Sheet, _), Some(path)) => saving.put(path),
        (Purpose::Folder(Whose::Report, _), Some(path)) => report.put(path),
        (Purpose::Folder(Whose::Structure, _), Some(path)) => creation.put(&path),
        (Purpose::Save(_), Some(path)) => export.to.propose(path.display().to_string()),
        (purpose, None) if since.elapsed() < TOO_SOON => {
            is_missing(purpose, &mut banners, &mut log)
        }
        (Purpose::Evidence, Some(_)) | (_, None) => {}
    }
    dialogs.open = None;
}
