//! What the damage plugin knows, ready to be shown.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use intrados_damage::verdict::Verdict;
use intrados_predict::{Predicted, Prediction, Progress};
use intrados_scene::plugin::{CurrentScene, SceneIndex};

use crate::Log;

/// The newest prediction.
#[derive(Resource, Default)]
pub struct Latest {
    /// Of all members, once all is done; it belongs to the scene whose hash it carries.
    pub result: Option<Arc<Prediction>>,
    /// By member, as soon as anything is known of it.
    members: Vec<Option<Predicted>>,
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
        self.members.get(index)?.as_ref()
    }

    /// What is said of a member's state, and how many states there are.
    pub(crate) fn state(&self, index: usize) -> Option<(&Verdict, usize)> {
        Some((&self.member(index)?.verdict, self.states.len()))
    }

    /// Whether all is done.
    #[must_use]
    pub(crate) fn is_done(&self) -> bool {
        self.pieces.0 >= self.pieces.1
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
    mut log: ResMut<Log>,
) {
    let (Some(scene), Some(progress)) = (scene, progress) else { return };
    if scene.is_changed() {
        *latest = Latest { members: vec![None; scene.0.members.len()], ..Latest::default() };
    }
    let pieces = progress.pieces();
    let news = !changed.is_empty()
        || (latest.pieces, latest.cancelled) != (pieces, progress.is_cancelled());
    if !news {
        return;
    }
    if progress.is_cancelled() && !latest.cancelled {
        log.say(format!(
            "the prediction was cancelled: {} of {} pieces of work are done",
            pieces.0, pieces.1
        ));
    }
    (latest.pieces, latest.cancelled) = (pieces, progress.is_cancelled());
    latest.states =
        progress.profile().into_iter().flat_map(|p| &p.states).map(|s| s.name.clone()).collect();
    for failure in progress.failures().iter().skip(latest.failures.len()) {
        log.say(format!("⚠ {failure}"));
        latest.failures.push(failure.to_string());
    }
    for (index, one) in &predicted {
        if let Some(place) = latest.members.get_mut(index.0) {
            *place = Some(one.clone());
        }
    }
    if latest.is_done() {
        latest.result = progress.prediction().map(Arc::new);
    }
}
