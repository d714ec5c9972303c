use std::sync::{Arc, Mutex, PoisonError};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_ct::source::SliceShelf;
use intrados_damage::{
    evidence::{AllEvidence, Evidence, LifeEnd, Sources},
    grading::Profile,
    verdict::{Basis, Looked, Verdict},
    zone::{ZONES, Zones},
};
use intrados_scene::{
    Member, Scene,
    plugin::{CurrentScene, SceneIndex},
};
use intrados_stage::{Cancelled, Estimate, Job, Jobs, Pace, Stage, Task, aside, file::Set};

use crate::{PredictError, PredictSettings, Prediction, Predictor, predictor::admitted_width};

/// Predicts the damage of the members of the [`CurrentScene`]: drains the one queue of work that
/// [`Predictor`] is, with the [`Sources`] of other plugins, and keeps [`Predicted`] up to date. The
/// window does so between frames, the command line by updating the app to the queue's end.
#[derive(Debug, Clone, Default)]
pub struct PredictPlugin {
    /// How to predict; the profile holds where the scene names none.
    pub settings: PredictSettings,
}

/// How the next scene's damage is predicted.
#[derive(Resource, Debug, Clone, Default)]
pub struct Predicting {
    /// How to predict; the profile holds where the scene names none.
    pub settings: PredictSettings,
    /// A profile that holds whatever the scene names.
    pub profile: Option<Profile>,
    /// Scans that the scene orders, whoever orders them first.
    pub shelf: SliceShelf,
    /// Where finished pieces of work are kept, and those of an earlier run are found; the set's key
    /// says all that they depend on but the scene.
    pub parts: Option<Arc<Mutex<Set>>>,
}

/// The damage of a member by all that is known of it; on the member's entity as soon as anything
/// is.
#[derive(Component, Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Damage d, 0 to 1, and its standard error.
    pub damage: Estimate,
    /// Damage by zone, tenths of the axis from its start.
    pub zones: Zones,
    /// What state it is in, as far as can be said.
    pub verdict: Verdict,
    /// What is known of each zone rests on.
    pub basis: [Basis; ZONES],
    /// Whether pieces of evidence contradict each other.
    pub conflict: bool,
    /// How its computed life ends; `None` if it does not.
    pub failure: Option<LifeEnd>,
}

/// How far the prediction has come, for whoever shows it.
#[derive(Resource, Debug, Default)]
pub struct Progress {
    work: Work,
    /// What it works on.
    scene: Arc<Scene>,
    failures: Vec<PredictError>,
}

#[derive(Debug, Default)]
enum Work {
    #[default]
    Idle,
    Here(Box<Predictor>),
    /// One piece is being done off the frame; the copy answers questions meanwhile.
    Away(Box<Predictor>, Task<Piece>),
    /// Somebody cancelled it; it can go on from here.
    Cancelled(Box<Predictor>),
}

/// The predictor after one piece of work, and how that ended.
type Piece = (Box<Predictor>, Result<bool, PredictError>);

impl Progress {
    fn predictor(&self) -> Option<&Predictor> {
        match &self.work {
            Work::Idle => None,
            Work::Here(predictor) | Work::Away(predictor, _) | Work::Cancelled(predictor) => {
                Some(predictor)
            }
        }
    }

    /// Whether there is work that goes on without anybody doing anything.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        match &self.work {
            Work::Idle | Work::Cancelled(_) => false,
            Work::Here(predictor) => !is_done(predictor),
            Work::Away(..) => true,
        }
    }

    /// Whether somebody cancelled it before its end. No further piece is begun then until somebody
    /// [resumes](Self::resume) it.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        matches!(self.work, Work::Cancelled(_))
    }

    /// Goes on after a cancel, with the piece that was cancelled: the prediction is the same as
    /// without.
    pub fn resume(&mut self) {
        self.work = match std::mem::take(&mut self.work) {
            Work::Cancelled(predictor) => Work::Here(predictor),
            work => work,
        };
    }

    /// Pieces of work done (slices, lives), and pieces in all.
    #[must_use]
    pub fn pieces(&self) -> (usize, usize) {
        self.predictor().map_or((0, 0), Predictor::progress)
    }

    /// The grading profile that holds for the scene; `None` without one.
    #[must_use]
    pub fn profile(&self) -> Option<&Profile> {
        self.predictor().map(Predictor::profile)
    }

    /// What could not be done, and why.
    #[must_use]
    pub fn failures(&self) -> &[PredictError] {
        &self.failures
    }

    /// The same, for whoever ends the work because of them; they are forgotten here.
    pub fn take_failures(&mut self) -> Vec<PredictError> {
        std::mem::take(&mut self.failures)
    }

    /// The prediction from what has been done so far; `None` without a scene.
    #[must_use]
    pub fn prediction(&self) -> Option<Prediction> {
        self.predictor().map(|p| p.finish(&self.scene))
    }

    /// The job of the piece of work that runs off the frame.
    #[must_use]
    pub fn job(&self) -> Option<&Job> {
        if let Work::Away(_, task) = &self.work { Some(task.job()) } else { None }
    }

    fn take_back(&mut self, result: Result<bool, PredictError>) {
        // Whoever drives the app tells them: here they would be told twice.
        self.failures.extend(result.err());
    }

    /// What becomes of a piece that is being done off the frame. One that was cancelled has not
    /// been done at all, however far it came: to drop its task asks it to stop, and nobody waits
    /// for it whose frame would; else it is waited for, since it keeps what it has finished.
    fn await_piece(&mut self, before: Box<Predictor>, task: Task<Piece>, is_watched: bool) -> Work {
        if task.job().is_cancelled() && is_watched {
            return Work::Cancelled(before);
        }
        match task.poll() {
            None => Work::Away(before, task),
            Some(Ok((_, Err(PredictError::Cancelled(Cancelled))))) => Work::Cancelled(before),
            Some(Ok((predictor, result))) => {
                self.take_back(result);
                Work::Here(predictor)
            }
            Some(Err(fault)) => {
                let mut predictor = before;
                let work = predictor.label();
                predictor.skip(&fault.to_string());
                self.failures.push(PredictError::Fault { work, fault });
                Work::Here(predictor)
            }
        }
    }
}

impl Plugin for PredictPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Predicting {
            settings: self.settings.clone(),
            ..Predicting::default()
        })
        .init_resource::<Sources>()
        .init_resource::<Progress>()
        .add_systems(Update, (begin, advance, testify, judge).chain().in_set(Stage::Damage));
    }
}

/// Starts anew where the scene is another one.
fn begin(
    scene: Option<Res<CurrentScene>>,
    how: Res<Predicting>,
    sources: Res<Sources>,
    mut progress: ResMut<Progress>,
) {
    let Some(scene) = scene.filter(|s| s.is_changed()) else { return };
    let mut failures = Vec::new();
    let named = || {
        Profile::of(&scene.0).unwrap_or_else(|why| {
            tracing::error!("{why}");
            failures.push(why.into());
            None
        })
    };
    let mut settings = how.settings.clone();
    settings.profile = how.profile.clone().or_else(named).unwrap_or(settings.profile);
    let predictor = Predictor::new(&scene.0, settings, &sources).with_shelf(how.shelf.clone());
    *progress =
        Progress { work: Work::Here(Box::new(predictor)), scene: Arc::clone(&scene.0), failures };
}

/// Goes on: at a counted pace here and now, else off the frame, since a piece may take longer than
/// a frame. A picture that rests is no reason to rest here.
fn advance(
    pace: Res<Pace>,
    how: Res<Predicting>,
    mut jobs: ResMut<Jobs>,
    mut progress: ResMut<Progress>,
) {
    let progress = progress.bypass_change_detection();
    let is_watched = *pace != Pace::Unwatched;
    progress.work = match std::mem::take(&mut progress.work) {
        Work::Here(mut predictor) if !is_done(&predictor) => match *pace {
            Pace::Passes(_) => {
                let scene = progress.scene.clone();
                pace.run(|| {
                    let result = predictor.advance(&scene, &Job::default());
                    progress.take_back(result);
                    !is_done(&predictor)
                });
                Work::Here(predictor)
            }
            Pace::Within(_) | Pace::Rest | Pace::Unwatched => {
                let (scene, before, label) =
                    (progress.scene.clone(), predictor.clone(), predictor.label());
                let (parts, is_watched) = (how.parts.clone(), is_watched);
                let task = Task::spawn(jobs.bypass_change_detection(), label, move |job| {
                    let mut work = || match &parts {
                        Some(parts) => {
                            let mut parts = parts.lock().unwrap_or_else(PoisonError::into_inner);
                            predictor.advance_kept(&scene, &mut parts, &scene.hash, job)
                        }
                        None => predictor.advance(&scene, job),
                    };
                    let result = if is_watched { aside(work) } else { work() };
                    (predictor, result)
                });
                Work::Away(before, task)
            }
        },
        Work::Away(before, task) => progress.await_piece(before, task, is_watched),
        work => work,
    };
}

fn is_done(predictor: &Predictor) -> bool {
    let (done, all) = predictor.progress();
    done >= all
}

/// Puts what is known on the members' entities as soon as it is: after each piece of work, not in
/// every frame.
fn testify(
    mut commands: Commands,
    scene: Option<Res<CurrentScene>>,
    progress: Res<Progress>,
    mut told: Local<usize>,
    mut members: Query<(Entity, &SceneIndex, Option<&mut AllEvidence>), With<Member>>,
) {
    let Some(predictor) = progress.predictor() else { return };
    let (pieces, _) = predictor.progress();
    if *told == pieces && !scene.is_some_and(|s| s.is_changed()) {
        return;
    }
    *told = pieces;
    for (entity, &SceneIndex(index), all) in &mut members {
        let mut news = predictor.evidence(index);
        match all {
            Some(mut all) => {
                news.retain(|e| !all.list().contains(e));
                news.into_iter().for_each(|e| all.put(e));
            }
            None if news.is_empty() => {}
            None => {
                let mut all = AllEvidence::default();
                news.into_iter().for_each(|e| all.put(e));
                commands.entity(entity).insert(all);
            }
        }
    }
}

/// Fuses a member's evidence whenever any of it changes.
fn judge(
    mut commands: Commands,
    progress: Res<Progress>,
    members: Query<(Entity, &SceneIndex, &AllEvidence), Changed<AllEvidence>>,
) {
    let Some(predictor) = progress.predictor() else { return };
    for (entity, &SceneIndex(index), all) in &members {
        let limit = admitted_width(&progress.scene, index, predictor.profile());
        let found = predictor.has_found(&progress.scene, index, limit);
        match judged(all, predictor.profile(), found, limit) {
            Some(predicted) => commands.entity(entity).insert(predicted),
            None => commands.entity(entity).remove::<Predicted>(),
        };
    }
}

/// `found`: whether anything was found to be wrong with the member but cracks within `limit` (mm),
/// which is admitted.
fn judged(
    all: &AllEvidence,
    profile: &Profile,
    found: bool,
    limit: Option<f64>,
) -> Option<Predicted> {
    let evidence: Vec<&Evidence> = all.list().iter().collect();
    let whole = profile.fusion.whole(&evidence);
    let damage = whole.damage()?;
    let failure = evidence.iter().find_map(|e| e.failure.as_ref());
    let evidence: Vec<&Evidence> =
        evidence.into_iter().filter(|e| whole.counted.contains(e.source)).collect();
    let basis = Basis::by_zone(&evidence);
    let looked = Looked::of(profile, &evidence, found, limit);
    let cracks = profile.cracks(&evidence);
    let verdict = Verdict::of(profile, Some(damage), &cracks, Basis::of(&basis), looked);
    let verdict = match failure {
        Some(end) => verdict.failing(profile, end),
        None => verdict,
    };
    Some(Predicted {
        damage,
        failure: failure.cloned(),
        zones: whole.zones,
        verdict,
        basis,
        conflict: !whole.conflicts.is_empty(),
    })
}
