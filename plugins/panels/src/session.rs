//! What is open and saved nowhere, kept in a file for the case that the program breaks off, or is
//! quit before it is saved.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use egui::{Panel as Side, Ui};
use glam::DVec3;
use intrados_photo::Pick;
use intrados_scene::{
    Scene,
    plugin::{CurrentScene, SceneChanged},
};
use serde::{Deserialize, Serialize};

use crate::{
    Action, Actions, Selection,
    attach::Form,
    kept,
    photos::Photos,
    sheet::{Properties, Unapplied},
    workspace::Desk,
};

/// Schema of the file.
const SCHEMA: &str = "intrados.session/1";
/// It is written at most so often.
const EVERY: Duration = Duration::from_millis(500);

/// What is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Kept {
    schema: String,
    scene: PathBuf,
    /// Id of the member that is selected.
    member: Option<String>,
    /// The form of evidence, where it is open.
    form: Option<Form>,
    /// What has been typed into forms of the sheet and is not applied.
    #[serde(default)]
    typed: Vec<Unapplied>,
    photograph: Option<KeptPhotograph>,
    /// Whether the window was quit; if not, the program broke off.
    #[serde(default)]
    is_quit: bool,
}

impl Kept {
    /// Whether anything in it was typed or picked and is saved nowhere else.
    fn has_unsaved(&self) -> bool {
        let is_filled = self.form.as_ref().is_some_and(Form::is_filled);
        is_filled || !self.typed.is_empty() || self.photograph.is_some()
    }
}

/// A photograph, and picks that are not saved yet: pixel and place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KeptPhotograph {
    file: PathBuf,
    picks: Vec<([f64; 2], [f64; 3])>,
}

/// The session of now, and what another has left behind.
#[derive(Resource, Default)]
pub(crate) struct Session {
    /// Where it is kept; none: nowhere, or another window keeps its own there.
    file: Option<PathBuf>,
    /// Held as long as this window is open. The system lets go of it however the program ends.
    lock: Option<File>,
    /// What a session that broke off has left, until somebody wants it or not.
    left: Option<Kept>,
    /// What is being opened again.
    coming: Option<Kept>,
    /// As it is in this frame.
    now: Option<Kept>,
    written: Option<Kept>,
    last: Option<Instant>,
}

impl Session {
    /// What was left, if a session was not ended.
    pub(crate) fn read(file: Option<PathBuf>) -> Self {
        let Some(file) = file else { return Self::default() };
        let lock = match locked(&file.with_extension("lock")) {
            Ok(lock) => lock,
            Err(why) => {
                tracing::debug!("the session is not kept in {}: {why}", file.display());
                return Self::default();
            }
        };
        let left = kept::read(&file).filter(|kept: &Kept| kept.schema == SCHEMA);
        let mut session = Self::default();
        (session.file, session.lock, session.left) = (Some(file), Some(lock), left);
        session
    }

    /// Whether this window keeps it: of several, one does.
    pub(crate) fn is_kept(&self) -> bool {
        self.lock.is_some()
    }

    /// Keeps what is open now, where that is another thing than before.
    fn keep(&mut self, now: Kept) {
        if self.left.is_some() || self.coming.is_some() {
            return;
        }
        let is_soon = self.last.is_some_and(|last| last.elapsed() < EVERY);
        let is_known = self.written.as_ref() == Some(&now);
        self.now = Some(now.clone());
        let Some(file) = self.file.as_ref().filter(|_| !is_soon && !is_known) else { return };
        self.last = Some(Instant::now());
        kept::write(file, "the session was", &now);
        self.written = Some(now);
    }
}

/// A session that is quit leaves behind what was typed or picked and is saved nowhere, and nothing
/// else. A panic, and what another session has left that has not been answered, leave the file as it
/// is.
impl Drop for Session {
    fn drop(&mut self) {
        let is_answered = self.left.is_none() && self.coming.is_none() && self.lock.is_some();
        let Some(file) = self.file.as_ref().filter(|_| is_answered) else { return };
        if std::thread::panicking() {
            return;
        }
        if let Some(now) = self.now.take().filter(Kept::has_unsaved) {
            kept::write(file, "the session was", &Kept { is_quit: true, ..now });
        } else if file.exists()
            && let Err(error) = fs::remove_file(file)
        {
            tracing::warn!("{} was not removed: {error}", file.display());
        }
    }
}

fn locked(path: &Path) -> std::io::Result<File> {
    fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    let file = File::options().create(true).write(true).truncate(false).open(path)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(std::io::Error::other("another window is open")),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Keeps what is open, and goes on with what was left once its scene is there.
pub(crate) fn keep(
    scene: Option<Res<CurrentScene>>,
    mut changed: MessageReader<SceneChanged>,
    mut session: ResMut<Session>,
    mut selection: ResMut<Selection>,
    mut form: ResMut<Form>,
    mut properties: ResMut<Properties>,
    mut photos: ResMut<Photos>,
    mut desk: ResMut<Desk>,
) {
    let is_new = changed.read().last().is_some();
    let Some(scene) = scene else { return };
    let session = session.bypass_change_detection();
    if is_new && let Some(kept) = session.coming.take_if(|kept| kept.scene == scene.0.path) {
        let member = kept.member.as_ref();
        let index = member.and_then(|id| scene.0.members.iter().position(|m| m.id == *id));
        selection.set_if_neq(Selection(index));
        if let Some(left) = kept.form {
            *form = left;
        }
        if !kept.typed.is_empty() {
            properties.go_on(&scene.0, kept.typed);
        }
        if let Some(left) = kept.photograph {
            let pick = |(pixel, place): ([f64; 2], [f64; 3])| Pick { pixel, place: place.into() };
            photos.go_on(left.file, left.picks.into_iter().map(pick).collect());
            desk.open("Photos");
        }
        return;
    }
    if scene.0.path.exists() {
        session.keep(of(&scene.0, *selection, &form, &properties, &photos));
    }
}

/// What is open now.
fn of(
    scene: &Scene,
    selection: Selection,
    form: &Form,
    properties: &Properties,
    photos: &Photos,
) -> Kept {
    let picks =
        |picks: Vec<Pick>| picks.iter().map(|p| (p.pixel, DVec3::to_array(&p.place))).collect();
    Kept {
        schema: SCHEMA.into(),
        // Relative paths mean something else tomorrow.
        scene: std::path::absolute(&scene.path).unwrap_or_else(|_| scene.path.clone()),
        member: selection.0.and_then(|i| scene.members.get(i)).map(|m| m.id.clone()),
        form: form.is_open.then(|| form.clone()),
        typed: properties.unapplied(scene),
        photograph: photos.unsaved().map(|(file, all)| KeptPhotograph { file, picks: picks(all) }),
        is_quit: false,
    }
}

/// Offers what a session has left that broke off or was quit before all was saved.
pub(crate) fn offer(ui: &mut Ui, world: &mut World) {
    let Some(left) = world.resource::<Session>().left.clone() else { return };
    Side::top("session").show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            let scene = left.scene.display();
            ui.label(match left.is_quit {
                true => tr!("The last session had unsaved edits: {}.", scene),
                false => tr!("The last session was not ended: {}.", scene),
            });
            if left.has_unsaved() {
                ui.label(tr!("What was filled in there and not saved is kept."));
            }
            let session = &mut *world.resource_mut::<Session>();
            if ui.button(tr!("Go on with it")).clicked() {
                session.coming = session.left.take();
                world.resource_mut::<Actions>().ask(Action::Open(left.scene));
            } else if ui.button(tr!("Forget it")).clicked() {
                session.left = None;
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(scene: &str) -> Kept {
        let mut form = Form::default();
        form.begin("C1", Vec::new());
        form.put_at(0.25, None);
        Kept {
            schema: SCHEMA.into(),
            scene: scene.into(),
            member: Some("C1".into()),
            form: Some(form),
            typed: Vec::new(),
            photograph: Some(KeptPhotograph {
                file: "a.jpg".into(),
                picks: vec![([1.5, 2.0], [0.1, 0.2, 0.3])],
            }),
            is_quit: false,
        }
    }

    /// A session with nothing to save.
    fn saved(scene: &str) -> Kept {
        let mut form = Form::default();
        form.begin("C1", Vec::new());
        Kept { form: Some(form), photograph: None, ..kept(scene) }
    }

    #[test]
    fn what_broke_off_is_offered_and_what_was_saved_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deep/session.json");
        let mut session = Session::read(Some(file.clone()));
        assert!(session.left.is_none());
        session.keep(kept("/a/scene.ron"));
        // Two windows at once: the second keeps nothing, and offers nothing.
        let second = Session::read(Some(file.clone()));
        assert!(second.file.is_none() && second.left.is_none());
        drop(second);
        assert!(file.exists());
        // A crash: nothing is tidied up, but the system lets go of the lock.
        session.file = None;
        drop(session);
        let again = Session::read(Some(file.clone()));
        assert_eq!(again.left, Some(kept("/a/scene.ron")));
        // Nobody has answered: it is offered once more.
        drop(again);
        let mut again = Session::read(Some(file.clone()));
        assert!(again.left.take().is_some());
        again.keep(kept("/a/scene.ron"));
        again.keep(saved("/b/scene.ron"));
        drop(again);
        assert!(!file.exists());
        fs::write(&file, "[{").unwrap();
        assert!(Session::read(Some(file)).left.is_none());
    }

    /// Ctrl+Q within the half second in which nothing is written keeps the last letter, too.
    #[test]
    fn what_was_typed_is_offered_again_after_quitting() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("session.json");
        let mut session = Session::read(Some(file.clone()));
        session.keep(saved("/a/scene.ron"));
        session.keep(kept("/a/scene.ron"));
        drop(session);
        let mut again = Session::read(Some(file.clone()));
        assert_eq!(again.left, Some(Kept { is_quit: true, ..kept("/a/scene.ron") }));
        // Accepted and quit again before its scene was there: nothing is lost.
        again.coming = again.left.take();
        drop(again);
        assert!(Session::read(Some(file)).left.as_ref().is_some_and(Kept::has_unsaved));
    }
}
