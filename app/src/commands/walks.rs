//! What `render`, `measure` and `predict` share: the scene as light sees it, and the rule of the
//! walks.

use std::{path::Path, sync::Arc};

use intrados_light::{Effort, Guide, LitScene, Sensor, Shard, learn, scene_rule};
use intrados_scene::{Camera, Scene, SurfaceFile};
use intrados_stage::cpu_seconds;
use intrados_transport::{Estimator, Schedule, Side, Steering, WalkRule};

use crate::{
    args::{Keep, Light, Size},
    drive::Rules,
    failure::Failure,
    sealed,
    session::Session,
};

/// Most pixels of a picture: its sums take 150 bytes each.
const MAX_PIXELS: u64 = 1 << 26;

/// A scene, compiled for light.
pub(crate) struct Opened {
    pub(crate) scene: Arc<Scene>,
    pub(crate) lit: Arc<LitScene>,
    /// CPU-seconds until the first walk: loading and building the tree.
    pub(crate) setup_cpu_seconds: f64,
}

/// Loads a scene, or takes the one that is given; its warnings go to the log.
pub(crate) fn load(session: &Session, path: &Path) -> Result<Scene, Failure> {
    if let Some(given) = &session.given {
        return Ok(Scene::clone(given));
    }
    let _progress = session.watch(format!("reading {}", path.display()));
    let scene = Scene::open_within(path, &session.access, &session.job)?;
    for warning in &scene.warnings {
        tracing::warn!("{}: {}", scene.name, crate::console::one_line(warning));
    }
    Ok(scene)
}

/// Loads a scene and compiles it.
pub(crate) fn open(session: &Session, path: &Path) -> Result<Opened, Failure> {
    open_damaged(session, path, Shown::Nothing, 1.0)
}

/// The damage that a picture shows.
#[derive(Clone, Copy)]
pub(crate) enum Shown<'a> {
    /// None.
    Nothing,
    /// What the scene has planted.
    Planted,
    /// The cracks of a file.
    File(&'a Path),
}

/// The same with damage, its cracks so many times as wide as they are.
pub(crate) fn open_damaged(
    session: &Session,
    path: &Path,
    shown: Shown<'_>,
    widen: f32,
) -> Result<Opened, Failure> {
    let mut scene = load(session, path)?;
    match shown {
        Shown::Nothing => {}
        Shown::Planted => scene = scene.marked(&scene.planted(), widen),
        Shown::File(file) => {
            scene = scene.marked(&SurfaceFile::read(file, &scene)?.members, widen);
        }
    }
    let scene = Arc::new(scene);
    let _progress = session.watch(format!("preparing {} for light", scene.name));
    let lit = Arc::new(LitScene::build(Arc::clone(&scene), &session.job)?);
    Ok(Opened { scene, lit, setup_cpu_seconds: cpu_seconds() })
}

/// The rule of the walks: what the user says, else what the scene says.
pub(crate) fn rule(scene: &Scene, light: &Light) -> WalkRule {
    let theirs = scene_rule(scene);
    WalkRule {
        estimator: light.estimator.into(),
        max_order: light.max_depth.unwrap_or(theirs.max_order),
        roulette_from: light.roulette_from.unwrap_or(theirs.roulette_from),
        roulette: light.roulette.map_or(theirs.roulette, Into::into),
        ..theirs
    }
}

/// What steers the walks, where the user lets it: learnt before the first pass.
pub(crate) fn guide(
    session: &Session,
    lit: &LitScene,
    sensors: &[Sensor],
    rule: WalkRule,
    light: &Light,
    rules: &Rules,
) -> Result<Option<Guide>, Failure> {
    let steering = light.guide.into();
    // Only walks that are linked have something to be steered by; the other estimators are there to
    // be compared with.
    if steering == Steering::Off || rule.estimator != Estimator::NextEvent {
        return Ok(None);
    }
    let Some(effort) = effort(rules, sensors) else {
        tracing::info!("not steered: what may be spent is too little to learn from");
        return Ok(None);
    };
    let key = format!("{:?}", (&lit.scene.hash, sensors, rule, light.seed, steering, effort));
    if let Some(path) = light.guide_from.as_deref().filter(|path| path.exists()) {
        return shared(path, &key, lit, sensors).map(Some);
    }
    let _progress = session.watch(format!("learning what steers the walks of {}", lit.scene.name));
    let guide = learn(lit, sensors, rule, light.seed, steering, effort, &session.job)?;
    if let Some(path) = &light.guide_from {
        sealed::write(path, GUIDE, &(env!("CARGO_PKG_VERSION"), &key, &guide))?;
    }
    let steered: Vec<&str> = Side::BOTH
        .into_iter()
        .filter(|&s| guide.steers(s))
        .map(|s| if s == Side::Primal { "primal" } else { "dual" })
        .collect();
    let what = if steered.is_empty() {
        "neither side: steering does not pay here".into()
    } else {
        steered.join(" and ")
    };
    tracing::info!(
        "steered: {what} ({:.1} CPU-s of learning, {:.0} kB of fields)",
        guide.cpu_seconds,
        guide.bytes() as f64 / 1e3
    );
    Ok(Some(guide))
}

/// Marks the file of a guide; raise its number whenever anything that is stored changes.
const GUIDE: sealed::Mark = sealed::Mark {
    magic: *b"INTRAGUI",
    format: 1,
    most: 4 << 30,
    stranger: "is no guide of walks: name a file that --guide-from wrote",
};

/// A guide that somebody has learnt, for the same walks.
fn shared(path: &Path, key: &str, lit: &LitScene, sensors: &[Sensor]) -> Result<Guide, Failure> {
    let (_, theirs, guide): (String, String, Guide) = sealed::read(path, GUIDE)?;
    let other = || {
        Failure::BadInput(format!(
            "{}: was learnt for another scene or other options: remove it, or name another file",
            path.display()
        ))
    };
    if theirs != key {
        return Err(other());
    }
    guide.back(lit, sensors).ok_or_else(other)
}

/// Events that one second of a time limit stands for, by decision: learning must depend on no
/// clock.
const EVENTS_A_SECOND: f64 = 2e6;
/// Events of a walk, by decision.
const EVENTS_A_WALK: f64 = 8.0;

/// How much to learn: half of what the samples and the time that are allowed pay for; `None` where
/// that is too little to learn anything.
fn effort(rules: &Rules, sensors: &[Sensor]) -> Option<Effort> {
    // Each sensor's own walks, and from the lamps as many as the largest takes.
    let sample = sensors.iter().map(Sensor::walks_a_sample).sum::<u64>()
        + sensors.iter().map(Sensor::walks_a_sample).max().unwrap_or(0);
    let by_samples =
        rules.spp.map_or(f64::INFINITY, |spp| spp as f64 * sample as f64 * EVENTS_A_WALK);
    let seconds = rules.time.map_or(f64::INFINITY, |t| t.as_secs_f64());
    let events = 0.5 * by_samples.min(seconds * EVENTS_A_SECOND);
    let usual = Schedule::default();
    // Where there is time, another round pays.
    let usual = if seconds.is_finite() && seconds >= 100.0 {
        Schedule { rounds: usual.rounds + 1, ..usual }
    } else {
        usual
    };
    Effort::within(events as u64, usual)
}

/// The camera of a name, or the first one, or one that sees all of a scene without cameras.
pub(crate) fn camera(scene: &Scene, name: Option<&str>) -> Result<Camera, Failure> {
    let Some(name) = name else {
        return Ok(scene
            .cameras
            .first()
            .cloned()
            .unwrap_or_else(|| Camera::overview(scene.bounds())));
    };
    scene.cameras.iter().find(|c| c.name == name).cloned().ok_or_else(|| {
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        let there = if names.is_empty() {
            "it has none".to_owned()
        } else {
            format!("there are {}", names.join(", "))
        };
        Failure::Usage(format!("{} has no camera \"{name}\": {there}", scene.name))
    })
}

/// The camera with the size that the user asks for. With one of width and height, the other follows
/// the camera's shape.
pub(crate) fn sized(mut camera: Camera, size: &Size) -> Result<Camera, Failure> {
    let scaled = |n: u32, to: u32, from: u32| {
        ((f64::from(n) * f64::from(to) / f64::from(from.max(1))).round() as u32).max(1)
    };
    (camera.width, camera.height) = match (size.width, size.height) {
        (Some(w), Some(h)) => (w, h),
        (Some(w), None) => (w, scaled(camera.height, w, camera.width)),
        (None, Some(h)) => (scaled(camera.width, h, camera.height), h),
        (None, None) => (camera.width, camera.height),
    };
    let pixels = u64::from(camera.width) * u64::from(camera.height);
    if pixels <= MAX_PIXELS {
        return Ok(camera);
    }
    Err(Failure::Usage(format!(
        "a picture of {} by {} pixels is more than memory is asked for: take at most {MAX_PIXELS} pixels",
        camera.width, camera.height
    )))
}

/// The shard of this run.
pub(crate) fn shard(keep: &Keep) -> Shard {
    keep.shard.unwrap_or_default()
}

/// The word of an estimator on the command line.
pub(crate) fn estimator_name(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::Analog => "analog",
        Estimator::Collision => "collision",
        Estimator::LastEvent => "last-event",
        Estimator::NextEvent => "next-event",
    }
}
