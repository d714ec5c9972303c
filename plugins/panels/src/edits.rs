//! Changes of evidence in the window, through the code of `intrados attach` and `intrados detach`,
//! and of the scene's own file by forms: off the frame, one after another, each of which can be
//! taken back.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bevy_ecs::prelude::*;
use intrados_predict::attaching;
use intrados_scene::{
    Scene,
    attach::{Attachment, Change, Project, Setting},
    plugin::{CurrentScene, OpenScene, SceneChanged},
};
use intrados_stage::{Access, Job, Jobs, Task};

use crate::{Banners, Log, lang::term, toast::Toasts};

/// So many changes can be taken back.
const MOST: usize = 64;

/// What can be done to the files of a structure.
#[derive(Debug, Clone)]
pub(crate) enum Edit {
    Attach(Box<Attachment>),
    Detach {
        member: String,
        name: String,
    },
    /// Write values into the scene's file; how people call that.
    Amend(Vec<Setting>, String),
    Undo,
    Redo,
}

/// A change and what it is called.
struct Named {
    change: Change,
    what: String,
}

/// What an edit has done. Whoever works on it speaks English.
enum Deed {
    Attached { name: String, of: String },
    Detached(String),
    Amended(String),
}

impl Deed {
    /// What it is called, in the language of the window.
    fn said(self) -> String {
        match self {
            Self::Attached { name, of } => tr!("attach {} of {}", name, of),
            Self::Detached(name) => tr!("detach {}", name),
            Self::Amended(what) => what,
        }
    }
}

/// What has come of an edit.
enum Outcome {
    Made(Change, Deed, Vec<String>),
    /// One that was there already, taken back or made again.
    Turned(Named),
    Refused(String, Option<Named>),
}

/// Changes that were made and taken back since the scene was opened.
#[derive(Resource, Default)]
pub(crate) struct Edits {
    of: PathBuf,
    made: Vec<Named>,
    taken_back: Vec<Named>,
    task: Option<Task<Outcome>>,
}

impl Edits {
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// What would be taken back next, and what made again.
    pub(crate) fn next(&self) -> [Option<&str>; 2] {
        [&self.made, &self.taken_back].map(|list| list.last().map(|named| named.what.as_str()))
    }
}

/// Begins an edit of the scene that is open; one at a time.
pub(crate) fn begin(world: &mut World, edit: Edit) {
    let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else {
        return;
    };
    let access = world.resource::<Access>().clone();
    let mut edits = std::mem::take(&mut *world.resource_mut::<Edits>());
    if edits.task.is_none() {
        let mut jobs = world.resource_mut::<Jobs>();
        edits.task = start(&mut edits, edit, scene, access, jobs.bypass_change_detection());
    }
    *world.resource_mut::<Edits>() = edits;
}

fn start(
    edits: &mut Edits,
    edit: Edit,
    shown: Arc<Scene>,
    access: Access,
    jobs: &mut Jobs,
) -> Option<Task<Outcome>> {
    let scene = shown.path.clone();
    Some(match edit {
        Edit::Attach(what) => Task::spawn(jobs, tr!("attaching evidence"), move |job| {
            attach(&scene, &what, &access, job).unwrap_or_else(|why| Outcome::Refused(why, None))
        }),
        Edit::Detach { member, name } => Task::spawn(jobs, tr!("detaching evidence"), move |job| {
            detach(&scene, &member, &name, &access, job)
                .unwrap_or_else(|why| Outcome::Refused(why, None))
        }),
        Edit::Amend(settings, what) => Task::spawn(jobs, tr!("changing the scene"), move |job| {
            amend(&shown, &settings, what, &access, job)
                .unwrap_or_else(|why| Outcome::Refused(why, None))
        }),
        Edit::Undo => turn(edits.made.pop()?, jobs),
        Edit::Redo => turn(edits.taken_back.pop()?, jobs),
    })
}

fn turn(mut named: Named, jobs: &mut Jobs) -> Task<Outcome> {
    let label = if named.change.is_made() {
        tr!("taking back: {}", named.what)
    } else {
        tr!("making again: {}", named.what)
    };
    Task::spawn(jobs, label, move |job| match named.change.turn(job) {
        Ok(()) => Outcome::Turned(named),
        Err(why) => Outcome::Refused(why.to_string(), Some(named)),
    })
}

/// What `intrados attach` does.
fn attach(scene: &Path, what: &Attachment, access: &Access, job: &Job) -> Result<Outcome, String> {
    let project = Project::edit(scene, access, job).map_err(|why| why.to_string())?;
    let proposal = project.propose(what, job).map_err(|why| why.to_string())?;
    let notes = attaching::examine(&proposal, what, job).map_err(|why| why.to_string())?;
    let of = proposal.scene.name_of(&what.member).to_owned();
    let name = proposal.name.clone();
    let copies = proposal.commit().map_err(|why| why.to_string())?;
    let change = Change::attached(&project, copies).map_err(|why| why.to_string())?;
    Ok(Outcome::Made(change, Deed::Attached { name, of }, notes))
}

/// What `intrados detach` does.
fn detach(
    scene: &Path,
    member: &str,
    name: &str,
    access: &Access,
    job: &Job,
) -> Result<Outcome, String> {
    let project = Project::edit(scene, access, job).map_err(|why| why.to_string())?;
    let (_, change) = project.detach_for_now(member, name, job).map_err(|why| why.to_string())?;
    Ok(Outcome::Made(change, Deed::Detached(name.to_owned()), Vec::new()))
}

/// Writes what a form says into the scene's file.
fn amend(
    shown: &Scene,
    settings: &[Setting],
    what: String,
    access: &Access,
    job: &Job,
) -> Result<Outcome, String> {
    let project = Project::edit(&shown.path, access, job).map_err(|why| why.to_string())?;
    let change = project.amend(shown, settings, job).map_err(|why| why.to_string())?;
    Ok(Outcome::Made(change, Deed::Amended(what), Vec::new()))
}

/// Takes what has come of an edit, and opens the scene as it is now. Of another scene,
/// nothing can be taken back.
pub(crate) fn take(
    mut changed: MessageReader<SceneChanged>,
    scene: Option<Res<CurrentScene>>,
    mut edits: ResMut<Edits>,
    mut banners: ResMut<Banners>,
    mut toasts: ResMut<Toasts>,
    mut log: ResMut<Log>,
    mut open: MessageWriter<OpenScene>,
) {
    let Some(scene) = scene else { return };
    if changed.read().last().is_some() && edits.of != scene.0.path {
        *edits = Edits { of: scene.0.path.clone(), ..Edits::default() };
    }
    let Some(done) = Task::take(&mut edits.bypass_change_detection().task) else { return };
    // What a panic said is told with all others.
    let Ok(done) = done else { return };
    let said = match done {
        Outcome::Made(change, deed, notes) => {
            notes.iter().for_each(|note| log.say(tr!("note: {}", term(note))));
            let named = Named { change, what: deed.said() };
            let said = tr!("done: {}", named.what);
            edits.taken_back.clear();
            edits.made.push(named);
            let surplus = edits.made.len().saturating_sub(MOST);
            edits.made.drain(..surplus);
            said
        }
        Outcome::Turned(named) if named.change.is_made() => {
            let said = tr!("made again: {}", named.what);
            edits.made.push(named);
            said
        }
        Outcome::Turned(named) => {
            let said = tr!("taken back: {}", named.what);
            edits.taken_back.push(named);
            said
        }
        Outcome::Refused(why, named) => {
            match named {
                Some(named) if named.change.is_made() => edits.made.push(named),
                Some(named) => edits.taken_back.push(named),
                None => {}
            }
            log.say(tr!("nothing was changed: {}", term(&why.to_string())));
            banners.cannot(&tr!("Nothing was changed"), &why);
            return;
        }
    };
    toasts.say(said.clone());
    log.say(said);
    open.write(OpenScene(scene.0.path.clone()));
}
