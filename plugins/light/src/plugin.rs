//! Light in the world: the lit scene, the picture through the active camera, the readings of all
//! meters.

mod learning;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_scene::{
    Camera, Meter, Scene, SurfaceDamage,
    plugin::{CurrentScene, SceneChanged},
};
use intrados_stage::{Cancelled, Job, Jobs, Pace, Stage, Task, aside};
use intrados_transport::WalkRule;

use crate::{
    Guide, LitScene, Measurement, Render, RenderSettings, Sensor, Shard, Sides, bsdf, scene_rule,
};

pub use learning::Learning;

/// The scene as light sees it; there as soon as it is compiled.
#[derive(Resource, Debug, Clone)]
pub struct Lit(pub Arc<LitScene>);

/// The camera that the [`Render`] looks through. Change it and the picture starts again.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct ActiveCamera(pub Camera);

/// Whether and how meters are read. Change it and they start again.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct MeasureSettings {
    /// Whether passes go to meters at all.
    pub enabled: bool,
    /// From which sides.
    pub sides: Sides,
    /// Estimator, depth, roulette.
    pub rule: WalkRule,
    /// Seed.
    pub seed: u64,
}

impl Default for MeasureSettings {
    fn default() -> Self {
        Self { enabled: true, sides: Sides::Both, rule: WalkRule::default(), seed: 1 }
    }
}

/// Compiles scenes for light ([`Stage::Model`]), and exposes the picture and reads the meters
/// ([`Stage::Transport`]).
#[derive(Debug, Clone, Default)]
pub struct LightPlugin {
    /// How to render at first.
    pub render: RenderSettings,
    /// How to measure at first.
    pub measure: MeasureSettings,
}

impl Plugin for LightPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.render.clone())
            .insert_resource(self.measure.clone())
            .init_resource::<Compiling>()
            .init_resource::<Widening>()
            .init_resource::<Upcoming>()
            .init_resource::<Learning>()
            .add_systems(
                Update,
                (
                    (compile, mark, take_compiled).chain(),
                    (learning::study, restart_render, restart_measurement)
                        .chain()
                        .run_if(is_watched),
                )
                    .chain()
                    .in_set(Stage::Model),
            )
            .add_systems(Update, advance.in_set(Stage::Transport));
    }
}

/// Where nobody looks at frames, nobody asks for pictures and readings that get better by the
/// frame.
fn is_watched(pace: Res<Pace>) -> bool {
    *pace != Pace::Unwatched
}

/// How many times as wide as they are cracks are shown that [`SurfaceDamage`] brings. Change it and
/// the picture starts again where there are any.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct Widening(pub f32);

impl Default for Widening {
    fn default() -> Self {
        Self(1.0)
    }
}

/// The scene that is being compiled.
#[derive(Resource, Default)]
struct Compiling {
    task: Mutex<Option<Task<Result<LitScene, Cancelled>>>>,
    /// Whether it is the same scene with other damage, so that the camera stays.
    again: bool,
}

impl Compiling {
    fn begin(
        &mut self,
        scene: Arc<Scene>,
        damage: Vec<SurfaceDamage>,
        widening: f32,
        jobs: &mut Jobs,
    ) {
        let task = Task::spawn(jobs, format!("preparing {} for light", scene.name), move |job| {
            bsdf::prepare(&scene.materials);
            let scene =
                if damage.is_empty() { scene } else { Arc::new(scene.marked(&damage, widening)) };
            LitScene::build(scene, job)
        });
        *self.task.lock().unwrap_or_else(PoisonError::into_inner) = Some(task);
    }
}

/// The large picture that is got ready off the frame; the old one stays until then.
#[derive(Resource, Default)]
pub struct Upcoming {
    /// One has been asked for. It is begun a frame later, if nobody asks for another one until
    /// then.
    wanted: bool,
    task: Mutex<Option<Task<Result<Render, Cancelled>>>>,
}

impl Upcoming {
    /// Whether a picture will come without anybody doing anything.
    #[must_use]
    pub fn is_coming(&self) -> bool {
        self.wanted || self.task().is_some()
    }

    fn task(&self) -> MutexGuard<'_, Option<Task<Result<Render, Cancelled>>>> {
        self.task.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn begin(
        &mut self,
        lit: Arc<LitScene>,
        camera: Camera,
        settings: RenderSettings,
        guide: Option<Arc<Guide>>,
        jobs: &mut Jobs,
    ) {
        // Not in the list of jobs: it is over before anybody could read it.
        let work = move |job: &Job| aside(|| ready(lit, &camera, &settings, guide.as_ref(), job));
        let task = Task::spawn_unlisted(jobs, "loading the film", work);
        *self = Self { wanted: false, task: Mutex::new(Some(task)) };
    }

    fn take(&mut self) -> Option<Render> {
        Task::take(&mut self.task())?.ok()?.ok()
    }
}

fn compile(
    mut changed: MessageReader<SceneChanged>,
    scene: Option<Res<CurrentScene>>,
    mut compiling: ResMut<Compiling>,
    mut upcoming: ResMut<Upcoming>,
    mut jobs: ResMut<Jobs>,
    mut commands: Commands,
) {
    let (Some(_), Some(scene)) = (changed.read().last(), scene) else { return };
    // Pictures of the old scene would be taken for the new one's.
    commands.queue(replace(None));
    commands.remove_resource::<Measurement>();
    commands.remove_resource::<Lit>();
    *upcoming = Upcoming::default();
    compiling.again = false;
    compiling.begin(Arc::clone(&scene.0), Vec::new(), 1.0, &mut jobs);
}

/// The same scene with other damage: the picture that is there stays until the new one is ready.
fn mark(
    scene: Option<Res<CurrentScene>>,
    widening: Res<Widening>,
    damage: Query<&SurfaceDamage>,
    changed: Query<(), Changed<SurfaceDamage>>,
    mut removed: RemovedComponents<SurfaceDamage>,
    mut compiling: ResMut<Compiling>,
    mut jobs: ResMut<Jobs>,
) {
    let gone = removed.read().count() > 0;
    let Some(scene) = scene.filter(|s| !s.is_changed()) else { return };
    if !changed.is_empty() || gone || widening.is_changed() && !damage.is_empty() {
        let mut all: Vec<SurfaceDamage> =
            damage.iter().filter(|d| !d.is_empty()).cloned().collect();
        all.sort_by(|a, b| a.member.cmp(&b.member));
        // A new scene that is not compiled yet brings its camera all the same.
        let idle = compiling.task.lock().unwrap_or_else(PoisonError::into_inner).is_none();
        compiling.again |= idle;
        compiling.begin(Arc::clone(&scene.0), all, widening.0, &mut jobs);
    }
}

fn take_compiled(
    compiling: ResMut<Compiling>,
    mut render: ResMut<RenderSettings>,
    mut measure: ResMut<MeasureSettings>,
    mut commands: Commands,
) {
    let mut task = compiling.task.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(done) = Task::take(&mut task) else { return };
    if let Ok(Ok(lit)) = done {
        if compiling.again {
            commands.insert_resource(Lit(Arc::new(lit)));
            return;
        }
        if lit.scene.transport != intrados_scene::Transport::default() {
            // The scene brings its own depth and roulette; the estimator stays the one that was
            // chosen.
            render.rule = WalkRule { estimator: render.rule.estimator, ..scene_rule(&lit.scene) };
            measure.rule = WalkRule { estimator: measure.rule.estimator, ..scene_rule(&lit.scene) };
        }
        let camera = lit
            .scene
            .cameras
            .first()
            .cloned()
            .unwrap_or_else(|| Camera::overview(lit.scene.bounds()));
        commands.insert_resource(ActiveCamera(camera));
        commands.insert_resource(Lit(Arc::new(lit)));
    }
}

/// Pixels up to which a picture is ready within a frame.
const SMALL: u32 = 1 << 17;

/// Large pictures are got ready off the frame where frames have a time: pilot and memory take
/// longer than one. So do steered pilots.
fn restart_render(
    lit: Option<Res<Lit>>,
    camera: Option<Res<ActiveCamera>>,
    settings: Res<RenderSettings>,
    learning: Res<Learning>,
    pace: Res<Pace>,
    mut upcoming: ResMut<Upcoming>,
    mut steered_by: Local<Option<u64>>,
    mut jobs: ResMut<Jobs>,
    mut commands: Commands,
) {
    let (Some(lit), Some(camera)) = (lit, camera) else { return };
    let guide = learning.steering_guide();
    let fingerprint = guide.map(|guide| guide.fingerprint());
    let is_steered_anew = std::mem::replace(&mut *steered_by, fingerprint) != fingerprint;
    if lit.is_changed() || camera.is_changed() || settings.is_changed() || is_steered_anew {
        let is_small = guide.is_none() && camera.0.width.saturating_mul(camera.0.height) <= SMALL;
        let at_once = matches!(*pace, Pace::Passes(_)) || is_small;
        *upcoming = Upcoming { wanted: !at_once, ..Upcoming::default() };
        if at_once {
            commands.queue(replace(Some(Render::guided(
                Arc::clone(&lit.0),
                &camera.0,
                &settings,
                guide,
            ))));
        }
    } else if upcoming.wanted {
        upcoming.begin(
            Arc::clone(&lit.0),
            camera.0.clone(),
            settings.clone(),
            guide.cloned(),
            jobs.bypass_change_detection(),
        );
    } else if let Some(render) = upcoming.take() {
        commands.queue(replace(Some(render)));
    }
}

/// Puts a picture, or none, in place of the one that is there. To give back the memory of a large
/// film takes half a frame: aside.
fn replace(render: Option<Render>) -> impl FnOnce(&mut World) + Send + 'static {
    move |world| {
        if let Some(old) = world.remove_resource::<Render>() {
            std::thread::spawn(move || drop(old));
        }
        if let Some(render) = render {
            world.insert_resource(render);
        }
    }
}

fn ready(
    lit: Arc<LitScene>,
    camera: &Camera,
    settings: &RenderSettings,
    guide: Option<&Arc<Guide>>,
    job: &Job,
) -> Result<Render, Cancelled> {
    job.step(0, 2)?;
    let mut render = Render::guided(lit, camera, settings, guide);
    job.step(1, 2)?;
    render.settle();
    Ok(render)
}

fn restart_measurement(
    lit: Option<Res<Lit>>,
    settings: Res<MeasureSettings>,
    meters: Query<&Meter>,
    changed: Query<(), Changed<Meter>>,
    mut removed: RemovedComponents<Meter>,
    mut commands: Commands,
) {
    let gone = removed.read().count() > 0;
    let Some(lit) = lit else { return };
    if !(lit.is_changed() || settings.is_changed() || gone || !changed.is_empty()) {
        return;
    }
    let mut sensors: Vec<Sensor> = meters.iter().cloned().map(Sensor::Meter).collect();
    sensors.sort_by(|a, b| a.name().cmp(b.name()));
    if settings.enabled && !sensors.is_empty() {
        commands.insert_resource(Measurement::new(
            Arc::clone(&lit.0),
            sensors,
            settings.sides,
            settings.rule,
            settings.seed,
            Shard::default(),
            None,
        ));
    } else {
        commands.remove_resource::<Measurement>();
    }
}

/// One frame in so many is the meters', where time is short.
const METERS: u32 = 4;

/// Pictures come first, meters get one round. Where time is short they take turns, or a frame would
/// last twice as long, and go by steps, which are shorter than passes.
fn advance(
    render: Option<ResMut<Render>>,
    measurement: Option<ResMut<Measurement>>,
    upcoming: Res<Upcoming>,
    pace: Res<Pace>,
    mut turn: Local<u32>,
) {
    match *pace {
        Pace::Rest | Pace::Unwatched => {}
        Pace::Passes(_) => {
            if let Some(mut measurement) = measurement {
                measurement.advance(1);
            }
            if let Some(mut render) = render {
                pace.run(|| render.advance(1));
            }
        }
        Pace::Within(_) => {
            *turn = (*turn + 1) % METERS;
            let is_alone = render.is_none() && !upcoming.is_coming();
            match (measurement.filter(|_| *turn == 0 || is_alone), render) {
                (Some(mut measurement), _) => pace.run(|| measurement.step()),
                (None, Some(mut render)) => pace.run(|| render.step()),
                (None, None) => 0,
            };
        }
    }
}
