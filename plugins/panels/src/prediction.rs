//! What the damage plugin knows, ready to be shown.

use std::{path::PathBuf, sync::Arc};

use bevy_ecs::prelude::*;
use intrados_damage::verdict::Verdict;
use intrados_predict::{Predicted, Prediction, Progress};
use intrados_scene::{
    Scene,
    plugin::{CurrentScene, SceneIndex},
};

use crate::{Log, lang::term, toast::Toasts};

/// The newest prediction.
#[derive(Resource, Default)]
pub struct Latest {
    /// Of all members, once all is done; it belongs to the scene whose hash it carries.
    pub result: Option<Arc<Prediction>>,
    /// By member, as soon as anything is known of it.
    members: Vec<Option<Predicted>>,
    /// The same of before the last change of the same structure: shown as outdated until its
    /// successor is there.
    before: Vec<Option<Predicted>>,
    /// Ids of the members, by which they are the same.
    ids: Vec<String>,
    /// Where the scene came from.
    path: PathBuf,
    /// The profile's states, from best to worst.
    states: Vec<String>,
    /// What could not be done, and why.
    pub failures: Vec<String>,
    /// Pieces of work done (slices, lives), and pieces in all.
    pub(crate) pieces: (usize, usize),
    /// Whether somebody cancelled it before its end.
    pub(crate) cancelled: bool,
}

impl Latest {
    /// What is known of a member.
    #[must_use]
    pub fn member(&self, index: usize) -> Option<&Predicted> {
        let now = self.members.get(index)?.as_ref();
        now.or_else(|| self.before.get(index)?.as_ref())
    }

    /// What is said of a member's state, and how many states there are.
    pub(crate) fn state(&self, index: usize) -> Option<(&Verdict, usize)> {
        Some((&self.member(index)?.verdict, self.states.len()))
    }

    /// The states that a member may be in, from the best to the worst.
    pub(crate) fn states(&self) -> &[String] {
        &self.states
    }

    /// The whole prediction, if it is of this scene.
    pub(crate) fn result_for(&self, scene: &Scene) -> Option<&Arc<Prediction>> {
        self.result.as_ref().filter(|r| r.scene_hash == scene.hash)
    }

    /// Whether what is known of a member is of before the last change, and its successor is not
    /// there yet.
    pub(crate) fn is_outdated(&self, index: usize) -> bool {
        self.members.get(index).is_some_and(Option::is_none)
            && self.before.get(index).is_some_and(Option::is_some)
    }

    /// Whether what is known of a member may still change: work is to come or was cancelled.
    pub(crate) fn is_interim(&self, index: usize) -> bool {
        !self.is_done() && self.member(index).is_some() && !self.is_outdated(index)
    }

    /// Whether all is done.
    #[must_use]
    pub(crate) fn is_done(&self) -> bool {
        self.pieces.0 >= self.pieces.1
    }
}

impl Latest {
    /// What holds once another scene is there: of the same file, what was known stays to be looked
    /// at.
    fn followed_by(self, scene: &Scene) -> Self {
        let ids: Vec<String> = scene.members.iter().map(|m| m.id.clone()).collect();
        let mut before = vec![None; ids.len()];
        if self.path == scene.path && !self.path.as_os_str().is_empty() {
            for (id, place) in ids.iter().zip(&mut before) {
                let index = self.ids.iter().position(|old| old == id);
                *place = index.and_then(|i| self.member(i).cloned());
            }
        }
        let states = if before.iter().any(Option::is_some) { self.states } else { Vec::new() };
        let (members, path) = (vec![None; ids.len()], scene.path.clone());
        Self { members, before, ids, path, states, ..Self::default() }
    }
}

/// Gathers what is known. The whole prediction is put together once, when the last piece is done,
/// and whenever evidence changes after that.
pub(crate) fn gather(
    scene: Option<Res<CurrentScene>>,
    progress: Option<Res<Progress>>,
    predicted: Query<(&SceneIndex, &Predicted)>,
    changed: Query<(), Changed<Predicted>>,
    mut latest: ResMut<Latest>,
    mut toasts: ResMut<Toasts>,
    mut log: ResMut<Log>,
) {
    let (Some(scene), Some(progress)) = (scene, progress) else { return };
    let is_new = scene.is_changed();
    if is_new {
        *latest = std::mem::take(&mut *latest).followed_by(&scene.0);
    }
    let pieces = progress.pieces();
    // Where there is no work, that is news, too: what was known before holds no more.
    let news = !changed.is_empty()
        || is_new && pieces.1 == 0
        || (latest.pieces, latest.cancelled) != (pieces, progress.is_cancelled());
    if !news {
        return;
    }
    if progress.is_cancelled() && !latest.cancelled {
        log.say(tr!(
            "the prediction was cancelled: {} of {} pieces of work are done",
            pieces.0,
            pieces.1
        ));
    }
    (latest.pieces, latest.cancelled) = (pieces, progress.is_cancelled());
    latest.states =
        progress.profile().into_iter().flat_map(|p| &p.states).map(|s| s.name.clone()).collect();
    for failure in progress.failures().iter().skip(latest.failures.len()) {
        log.say(format!("⚠ {}", term(&failure.to_string())));
        latest.failures.push(failure.to_string());
    }
    for (index, one) in &predicted {
        if let Some(place) = latest.members.get_mut(index.0) {
            *place = Some(one.clone());
        }
    }
    if latest.is_done() {
        // What nothing is known of any more is not what it was.
        latest.before.clear();
        if latest.result.is_none() && pieces.1 > 0 {
            toasts.say(tr!("The prediction of {} is done", scene.0.name));
            log.say(tr!("predicted {}; members: {}", scene.0.name, scene.0.members.len()));
        }
        latest.result = progress.prediction().map(Arc::new);
    }
}
