//! Damage of all members, predicted off the frame.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use intrados_damage::{
    evidence::{AllEvidence, Evidence},
    predict::{Prediction, Predictor, Settings},
};
use intrados_scene::{
    Scene,
    plugin::{CurrentScene, SceneChanged, SceneIndex},
};
use intrados_stage::{Job, Jobs, Task};

use crate::Log;

/// The damage of all members of the scene, once it was asked for.
#[derive(Resource, Default)]
pub struct Predicted {
    /// What is known; it belongs to the scene whose hash it carries.
    pub result: Option<Arc<Prediction>>,
    /// Why there is none.
    pub failure: Option<String>,
    pub(crate) wanted: bool,
    task: Option<Task<Result<Prediction, String>>>,
}

impl Predicted {
    /// Whether it is being worked out.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// The state of a member by the profile: its name, its step, and the number of steps.
    pub(crate) fn state(&self, member: usize) -> Option<(&str, usize, usize)> {
        let result = self.result.as_ref()?;
        let name = result.members.get(member)?.state.as_str();
        let states = &result.profile.states;
        Some((name, states.iter().position(|s| s.name == name)?, states.len()))
    }
}

pub(crate) fn predict(
    scene: Option<Res<CurrentScene>>,
    mut changed: MessageReader<SceneChanged>,
    evidence: Query<(&SceneIndex, &AllEvidence)>,
    mut predicted: ResMut<Predicted>,
    mut jobs: ResMut<Jobs>,
    mut log: ResMut<Log>,
) {
    if changed.read().count() > 0 {
        *predicted = Predicted::default();
    }
    if let Some(done) = predicted.task.as_ref().and_then(Task::poll) {
        predicted.task = None;
        match done {
            Ok(Ok(result)) => {
                log.say(format!("predicted the damage of {} members", result.members.iter().filter(|m| m.damage.is_some()).count()));
                predicted.result = Some(Arc::new(result));
            }
            Ok(Err(reason)) => {
                log.say(format!("no prediction: {reason}"));
                predicted.failure = Some(reason);
            }
            Err(_) => predicted.failure = Some("the prediction broke off".into()),
        }
    }
    if !predicted.wanted || predicted.task.is_some() {
        return;
    }
    predicted.wanted = false;
    let Some(scene) = scene else { return };
    let others = evidence.iter().flat_map(|(i, all)| all.list().iter().map(move |e| (i.0, e.clone()))).collect();
    let scene = Arc::clone(&scene.0);
    predicted.failure = None;
    predicted.task = Some(Task::spawn(&mut jobs, "predicting damage", move |job| work(&scene, others, job)));
}

/// In a pool of one thread, so that the frame's own passes never wait for a slice.
fn work(scene: &Scene, others: Vec<(usize, Evidence)>, job: &Job) -> Result<Prediction, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string())?;
    pool.install(|| {
        let mut predictor = Predictor::new(scene, Settings::default());
        while predictor.advance(scene, job).map_err(|e| e.to_string())? {}
        Ok(predictor.finish(scene, others))
    })
}
