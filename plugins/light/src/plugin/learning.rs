//! What steers the picture, learnt off the frame.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use intrados_scene::Camera;
use intrados_stage::{Cancelled, Job, Jobs, Task, aside, thread_cpu_seconds};
use intrados_transport::{Estimator, Schedule, Side, Steering, WalkRule};

use super::{ActiveCamera, Lit};
use crate::{Culprit, Guide, LitScene, RenderSettings, Sensor, learn};

/// How long scene, camera and settings must have been left alone before learning begins: whoever
/// moves the camera moves it again.
const STILL: Duration = Duration::from_secs(1);

/// The fields of the picture through the active camera, and whether they steer it. They are
/// forgotten as soon as scene, camera, rule or seed are others, and learnt anew once these have
/// been left alone for a second.
#[derive(Resource, Debug)]
pub struct Learning {
    /// Whether fields steer. Off at first: a picture that has begun begins once more when its
    /// fields are there.
    pub steering: Steering,
    /// How much is learnt.
    pub schedule: Schedule,
    /// What `state` is of.
    asked: (Steering, Schedule),
    subject: Option<Subject>,
    since: Instant,
    state: State,
}

/// What fields are learnt of.
#[derive(Debug, Clone)]
struct Subject {
    lit: Arc<LitScene>,
    camera: Camera,
    rule: WalkRule,
    seed: u64,
}

impl PartialEq for Subject {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.lit, &other.lit)
            && (&self.camera, self.rule, self.seed) == (&other.camera, other.rule, other.seed)
    }
}

#[derive(Debug, Default)]
enum State {
    #[default]
    Nothing,
    Learns(Task<Result<Learnt, Cancelled>>),
    Knows(Learnt),
}

#[derive(Debug)]
struct Learnt {
    guide: Arc<Guide>,
    culprits: Vec<Culprit>,
}

impl Default for Learning {
    fn default() -> Self {
        let (steering, schedule) = (Steering::Off, Schedule::default());
        Self {
            steering,
            schedule,
            asked: (steering, schedule),
            subject: None,
            since: Instant::now(),
            state: State::Nothing,
        }
    }
}

impl Learning {
    /// What has been learnt, whether or not it steers.
    #[must_use]
    pub fn guide(&self) -> Option<&Arc<Guide>> {
        if let State::Knows(learnt) = &self.state { Some(&learnt.guide) } else { None }
    }

    /// The same, if it steers any side.
    #[must_use]
    pub(crate) fn steering_guide(&self) -> Option<&Arc<Guide>> {
        self.guide().filter(|guide| Side::BOTH.into_iter().any(|side| guide.steers(side)))
    }

    /// Where the variance comes from, by surface, worst first.
    #[must_use]
    pub fn culprits(&self) -> &[Culprit] {
        if let State::Knows(learnt) = &self.state { &learnt.culprits } else { &[] }
    }

    /// The camera whose fields are learnt or will be.
    #[must_use]
    pub fn camera(&self) -> Option<&Camera> {
        self.subject.as_ref().map(|subject| &subject.camera)
    }

    /// Share learnt, while it learns.
    #[must_use]
    pub fn progress(&self) -> Option<f32> {
        if let State::Learns(task) = &self.state { Some(task.job().done()) } else { None }
    }

    /// Whether walks of this kind can be steered: only those that are linked have something to be
    /// steered by.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        self.subject.as_ref().is_none_or(|subject| subject.rule.estimator == Estimator::NextEvent)
    }

    /// Whether there will be a guide without anybody doing anything.
    #[must_use]
    pub fn is_coming(&self) -> bool {
        let is_wanted =
            self.steering != Steering::Off && self.subject.is_some() && self.is_possible();
        is_wanted && !matches!(self.state, State::Knows(_))
    }

    /// Forgets what is of something else.
    fn attend(&mut self, subject: Option<Subject>) {
        if self.subject != subject {
            (self.subject, self.since, self.state) = (subject, Instant::now(), State::Nothing);
        }
        let asked = (self.steering, self.schedule);
        if self.asked != asked {
            (self.asked, self.state) = (asked, State::Nothing);
        }
    }

    fn go_on(&mut self, jobs: &mut Jobs) {
        match &self.state {
            State::Nothing if self.is_coming() && self.since.elapsed() >= STILL => {
                let (Some(subject), (steering, schedule)) = (self.subject.clone(), self.asked)
                else {
                    return;
                };
                let label =
                    format!("learning what steers the picture of {}", subject.lit.scene.name);
                let work = move |job: &Job| aside(|| subject.learn(steering, schedule, job));
                self.state = State::Learns(Task::spawn(jobs, label, work));
            }
            State::Learns(task) => match task.poll() {
                None => {}
                Some(Ok(Ok(learnt))) => self.state = State::Knows(learnt),
                // The user has cancelled it, or it died: it would only begin anew.
                Some(_) => {
                    self.steering = Steering::Off;
                    self.attend(self.subject.clone());
                }
            },
            _ => {}
        }
    }
}

impl Subject {
    fn learn(
        &self,
        steering: Steering,
        schedule: Schedule,
        job: &Job,
    ) -> Result<Learnt, Cancelled> {
        let begin = thread_cpu_seconds();
        let sensors = [Sensor::Camera(self.camera.clone())];
        let mut guide = learn(&self.lit, &sensors, self.rule, self.seed, steering, schedule, job)?;
        // By the clock of the process, what frames have walked meanwhile would count too.
        guide.cpu_seconds = thread_cpu_seconds() - begin;
        let culprits = guide.explain(&self.lit);
        Ok(Learnt { guide: Arc::new(guide.for_picture()), culprits })
    }
}

/// Learns, where it is wanted and worth while.
pub(super) fn study(
    lit: Option<Res<Lit>>,
    camera: Option<Res<ActiveCamera>>,
    settings: Res<RenderSettings>,
    mut learning: ResMut<Learning>,
    mut jobs: ResMut<Jobs>,
) {
    let subject = lit.zip(camera).map(|(lit, camera)| Subject {
        lit: Arc::clone(&lit.0),
        camera: camera.0.clone(),
        rule: settings.rule,
        seed: settings.seed,
    });
    learning.attend(subject);
    learning.go_on(jobs.bypass_change_detection());
}
