//! The scanner in the world: scans of members, asked for one by one, off the frame.

use std::{collections::BTreeMap, sync::Arc};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_scene::{Scene, SurfaceDamage, plugin::CurrentScene};
use intrados_stage::{Job, Jobs, Stage, Task, Unfinished, Work, alone};

use crate::{
    scan::{Acquisition, Corrections, Detector, Forming, Protocol, Restored, ScanError},
    specimen::concrete::Subject,
};

/// Asks for a scan of a member by the scene's first scanner, through a slit; one that runs or is
/// there is begun anew.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct TakeScan {
    /// Id of the member.
    pub member: String,
    /// Place on its axis, 0 to 1.
    pub along: f32,
    /// Views of the orbit.
    pub views: usize,
    /// Pixels across the panel; the field of view stays.
    pub width: usize,
    /// Slices round the place.
    pub slices: usize,
    /// Seed of concrete and noise.
    pub seed: u64,
    /// What is corrected.
    pub corrections: Corrections,
}

/// Asks for the slices of a scan that is there again, with other corrections.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
pub struct RestoreScan {
    /// Id of the member.
    pub member: String,
    /// What is corrected.
    pub corrections: Corrections,
}

/// Asks the scan of a member to stop.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
pub struct StopScan(pub String);

/// A scan and its slices.
#[derive(Debug, Clone)]
pub struct Scanned {
    /// What was taken.
    pub acquisition: Arc<Acquisition>,
    /// Its slices.
    pub restored: Arc<Restored>,
    /// What was corrected in them.
    pub corrections: Corrections,
}

/// One scan.
#[derive(Debug)]
pub struct Scan {
    /// What was asked for.
    pub wish: TakeScan,
    /// How it stands.
    pub work: Work<Scanned>,
    /// Its sinogram.
    pub sinogram: Forming,
    /// The slices before those that are being restored.
    before: Option<Scanned>,
}

impl Scan {
    /// The newest slices.
    #[must_use]
    pub fn done(&self) -> Option<&Scanned> {
        if let Work::Done(done) = &self.work { Some(done) } else { self.before.as_ref() }
    }
}

/// Scans by the id of their member, all of the scene that is there.
#[derive(Resource, Debug, Default)]
pub struct Scans(BTreeMap<String, Scan>);

impl Scans {
    /// The scan of a member.
    #[must_use]
    pub fn get(&self, member: &str) -> Option<&Scan> {
        self.0.get(member)
    }

    /// Whether any runs.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.0.values().any(|s| s.work.is_running())
    }
}

/// Runs scans ([`Stage::Transport`]).
#[derive(Debug, Clone, Copy, Default)]
pub struct XrayPlugin;

impl Plugin for XrayPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Scans>()
            .init_resource::<Jobs>()
            .add_message::<TakeScan>()
            .add_message::<RestoreScan>()
            .add_message::<StopScan>()
            .add_systems(
                Update,
                (forget, begin, again, stop, take).chain().in_set(Stage::Transport),
            );
    }
}

/// Of another scene nothing holds any more.
fn forget(scene: Option<Res<CurrentScene>>, mut scans: ResMut<Scans>) {
    if scene.is_some_and(|s| s.is_changed()) {
        scans.0.clear();
    }
}

fn begin(
    mut wishes: MessageReader<TakeScan>,
    scene: Option<Res<CurrentScene>>,
    damage: Query<&SurfaceDamage>,
    mut scans: ResMut<Scans>,
    mut jobs: ResMut<Jobs>,
) {
    for wish in wishes.read() {
        let Some(scene) = &scene else { continue };
        let (scene, damage): (Arc<Scene>, Vec<SurfaceDamage>) =
            (Arc::clone(&scene.0), damage.iter().cloned().collect());
        let (wish, sinogram) = (wish.clone(), Forming::default());
        let (member, theirs, wanted) = (wish.member.clone(), sinogram.clone(), wish.clone());
        let task = Task::spawn(&mut jobs, format!("scan of {member}"), move |job| {
            alone(|| scan(&scene, &damage, &wanted, &theirs, job)).map_err(unfinished)
        });
        scans.0.insert(member, Scan { wish, work: Work::Running(task), sinogram, before: None });
    }
}

fn scan(
    scene: &Scene,
    damage: &[SurfaceDamage],
    wish: &TakeScan,
    sinogram: &Forming,
    job: &Job,
) -> Result<Scanned, ScanError> {
    let scanner = scene
        .structure
        .scanners
        .first()
        .ok_or_else(|| ScanError::Bad("the scene has no scanner".into()))?;
    let member = Subject::of(scene, &wish.member)?.worn(damage);
    let open =
        Protocol::of_scene(scanner, Some(wish.views), Some(wish.width), Detector::default())?;
    let across = open.field();
    let protocol = open.slit(wish.slices, across);
    let acquisition =
        Acquisition::take(member, wish.along, &protocol, wish.slices, wish.seed, sinogram, job)?;
    let restored = acquisition.restore(wish.corrections, job)?;
    Ok(Scanned {
        acquisition: Arc::new(acquisition),
        restored: Arc::new(restored),
        corrections: wish.corrections,
    })
}

fn again(mut wishes: MessageReader<RestoreScan>, mut scans: ResMut<Scans>, mut jobs: ResMut<Jobs>) {
    for RestoreScan { member, corrections } in wishes.read() {
        let Some(scan) = scans.0.get_mut(member) else { continue };
        let Some(done) = scan.done().cloned() else { continue };
        let (corrections, acquisition) = (*corrections, Arc::clone(&done.acquisition));
        let task = Task::spawn(&mut jobs, format!("restoring {member}"), move |job| {
            alone(|| {
                let restored = Arc::new(acquisition.restore(corrections, job)?);
                Ok(Scanned { acquisition, restored, corrections })
            })
            .map_err(unfinished)
        });
        scan.wish.corrections = corrections;
        (scan.before, scan.work) = (Some(done), Work::Running(task));
    }
}

fn unfinished(error: ScanError) -> Unfinished {
    match error {
        ScanError::Cancelled(_) => Unfinished::Cancelled,
        why => Unfinished::Because(why.to_string()),
    }
}

fn stop(mut wishes: MessageReader<StopScan>, scans: Res<Scans>) {
    for StopScan(member) in wishes.read() {
        if let Some(scan) = scans.get(member) {
            scan.work.cancel();
        }
    }
}

fn take(mut scans: ResMut<Scans>) {
    for scan in scans.bypass_change_detection().0.values_mut() {
        // Whoever stops a restoring keeps the slices before it.
        if scan.work.settle()
            && matches!(scan.work, Work::Cancelled)
            && let Some(before) = scan.before.take()
        {
            scan.work = Work::Done(before);
        }
    }
}
