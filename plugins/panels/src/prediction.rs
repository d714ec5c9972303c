//! What the damage plugin knows, ready to be shown.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use intrados_damage::{Predicted, Progress, evidence::AllEvidence, grading::Profile, predict::Prediction};
use intrados_scene::plugin::{CurrentScene, SceneIndex};

use crate::Log;

/// The newest prediction.
#[derive(Resource, Default)]
pub struct Latest {
    /// Of all members, once all slices are read; it belongs to the scene whose hash it carries.
    pub result: Option<Arc<Prediction>>,
    /// By member, as soon as anything is known of it.
    members: Vec<Option<Predicted>>,
    /// The profile's states, from best to worst.
    states: Vec<String>,
    /// Slices that could not be read, and why.
    pub failures: Vec<String>,
    /// Slices read, slices in all.
    pub(crate) slices: (usize, usize),
}

impl Latest {
    /// What is known of a member.
    #[must_use]
    pub fn member(&self, index: usize) -> Option<&Predicted> {
        self.members.get(index)?.as_ref()
    }

    /// The state of a member: its name, its step from 0, and the number of steps.
    pub(crate) fn state(&self, index: usize) -> Option<(&str, usize, usize)> {
        let name = self.member(index)?.state.as_str();
        Some((name, self.states.iter().position(|s| s == name)?, self.states.len()))
    }

    /// Whether slices are still to be read.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.slices.0 < self.slices.1
    }
}

/// Gathers what is known. The whole prediction is put together once, when the last slice has been read, and whenever evidence changes after that.
pub(crate) fn gather(
    scene: Option<Res<CurrentScene>>,
    progress: Option<Res<Progress>>,
    predicted: Query<(&SceneIndex, &Predicted)>,
    changed: Query<(), Changed<Predicted>>,
    evidence: Query<(&SceneIndex, &AllEvidence)>,
    mut latest: ResMut<Latest>,
    mut log: ResMut<Log>,
) {
    let (Some(scene), Some(progress)) = (scene, progress) else { return };
    if scene.is_changed() {
        let states = Profile::default().states.into_iter().map(|s| s.name).collect();
        *latest = Latest { members: vec![None; scene.0.members.len()], states, ..Latest::default() };
    }
    let slices = progress.slices();
    let news = !changed.is_empty() || latest.slices != slices;
    if !news {
        return;
    }
    latest.slices = slices;
    for failure in progress.failures().iter().skip(latest.failures.len()) {
        log.say(format!("⚠ a slice was not read: {failure}"));
        latest.failures.push(failure.clone());
    }
    for (index, one) in &predicted {
        if let Some(place) = latest.members.get_mut(index.0) {
            *place = Some(one.clone());
        }
    }
    if !latest.is_busy() {
        let others =
            evidence.iter().flat_map(|(i, all)| all.list().iter().filter(|e| e.source != SEEN).map(move |e| (i.0, e.clone()))).collect();
        latest.result = progress.prediction(others).map(Arc::new);
    }
}

/// Evidence of the slices themselves: the prediction has it already.
const SEEN: &str = intrados_damage::predict::SEEN;
