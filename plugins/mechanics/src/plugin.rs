//! Mechanics in the world: analyses of members, asked for one by one, off the frame; what they
//! leave on the surface becomes a component.

use std::{collections::BTreeMap, sync::Arc};

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use intrados_scene::{Member, Scene, SurfaceDamage, plugin::CurrentScene};
use intrados_stage::{Job, Jobs, Stage, Task, Unfinished, Work, alone};

use crate::{
    analysis::{Outcome, analyze_until_stopped},
    frame::joined,
    member::{Along, Meshing, prepare_within},
    model::MarchSettings,
    skin::{Looking, Seen},
};

/// Asks for the life of an assembly of the scene; one that runs or is there is begun anew.
#[derive(Message, Debug, Clone, PartialEq)]
pub struct Analyze {
    /// Id of the assembly.
    pub model: String,
    /// How finely.
    pub meshing: Meshing,
    /// Whether its loads are raised after its life, until it fails.
    pub to_failure: bool,
}

/// Asks an analysis to stop. What it has found so far stays to be looked at.
#[derive(Message, Debug, Clone, PartialEq, Eq)]
pub struct Stop(pub String);

/// What came of an analysis.
#[derive(Debug)]
pub struct Life {
    /// Its results; they say whether it ended early or was stopped.
    pub outcome: Arc<Outcome>,
    /// What is to be seen of it from outside at each equilibrium, and when that is, s.
    damage: Vec<(f64, Vec<SurfaceDamage>)>,
}

impl Life {
    /// What is to be seen of it: at the last equilibrium until then; before the first one nothing.
    fn damage(&self, until: f64) -> &[SurfaceDamage] {
        let passed = self.damage.partition_point(|(time, _)| *time <= until);
        passed.checked_sub(1).map_or(&[], |last| &self.damage[last].1)
    }
}

/// The moment of their lives at which members show their surfaces, s; none: the end of what was
/// computed.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default)]
pub struct ShownAt(pub Option<f64>);

/// One analysis.
#[derive(Debug)]
pub struct Analysis {
    /// How it stands.
    pub work: Work<Life>,
    /// What it has found so far.
    pub seen: Seen,
}

/// Analyses by the id of their assembly, all of the scene that is there.
#[derive(Resource, Debug, Default)]
pub struct Analyses(BTreeMap<String, Analysis>);

impl Analyses {
    /// The analysis of a model.
    #[must_use]
    pub fn get(&self, model: &str) -> Option<&Analysis> {
        self.0.get(model)
    }

    /// Whether any runs.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.0.values().any(|a| a.work.is_running())
    }
}

/// Runs analyses ([`Stage::Transport`]); writes [`SurfaceDamage`] on the entities of members.
#[derive(Debug, Clone, Copy, Default)]
pub struct MechanicsPlugin;

impl Plugin for MechanicsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Analyses>()
            .init_resource::<ShownAt>()
            .init_resource::<Jobs>()
            .add_message::<Analyze>()
            .add_message::<Stop>()
            .add_systems(Update, (forget, begin, stop, take).chain().in_set(Stage::Transport));
    }
}

/// Of another scene nothing holds any more.
fn forget(scene: Option<Res<CurrentScene>>, mut analyses: ResMut<Analyses>) {
    if scene.is_some_and(|s| s.is_changed()) {
        analyses.0.clear();
    }
}

fn begin(
    mut wishes: MessageReader<Analyze>,
    scene: Option<Res<CurrentScene>>,
    mut analyses: ResMut<Analyses>,
    mut jobs: ResMut<Jobs>,
) {
    for wish in wishes.read() {
        let Some(scene) = &scene else { continue };
        let (scene, seen, wish) = (Arc::clone(&scene.0), Seen::default(), wish.clone());
        let (theirs, model) = (seen.clone(), wish.model.clone());
        let task = Task::spawn(&mut jobs, label(&scene, &model), move |job| {
            alone(|| life(&scene, &wish, theirs, job))
        });
        analyses.0.insert(model, Analysis { work: Work::Running(task), seen });
    }
}

/// What is done, for people.
fn label(scene: &Scene, model: &str) -> String {
    format!("stress of {}", scene.name_of(model))
}

fn life(scene: &Scene, wish: &Analyze, seen: Seen, job: &Job) -> Result<Life, Unfinished> {
    let because = |e: &dyn std::fmt::Display| Unfinished::Because(e.to_string());
    let unknown = || {
        Unfinished::Because(format!("{}: no member of this scene bears under that id", wish.model))
    };
    let assembly = scene.structure.assembly(&wish.model).ok_or_else(unknown)?;
    let failed = |e: &dyn std::fmt::Display| {
        if job.is_cancelled() { Unfinished::Cancelled } else { because(e) }
    };
    let whole = joined(scene, job).map_err(|e| failed(&e))?;
    let handed = whole.as_ref().and_then(|whole| whole.handed(&assembly.id));
    job.relabel(label(scene, &wish.model));
    let mut prepared =
        prepare_within(scene, assembly, handed, wish.meshing, job).map_err(|e| failed(&e))?;
    if wish.to_failure && !prepared.raise(&raised(scene), Along::Automatic) {
        let why = "no force, pressure or displacement acts on it that could be raised: add a load";
        return Err(Unfinished::Because(why.into()));
    }
    let mut looking = Looking::new(&prepared, seen);
    match analyze_until_stopped(&prepared, MarchSettings::of_life(), job, &mut looking) {
        Ok((outcome, _)) => Ok(Life { outcome: Arc::new(outcome), damage: looking.damage }),
        Err(why) if why.is_cancelled() => Err(Unfinished::Cancelled),
        Err(other) => Err(because(&other)),
    }
}

/// Loads that can be raised to failure.
fn raised(scene: &Scene) -> Vec<&str> {
    let loads = scene.structure.loads.iter().filter(|l| l.action.can_be_raised());
    loads.map(|l| l.name.as_str()).collect()
}

fn stop(mut wishes: MessageReader<Stop>, analyses: Res<Analyses>) {
    for Stop(model) in wishes.read() {
        if let Some(analysis) = analyses.get(model) {
            analysis.work.cancel();
        }
    }
}

/// Takes what has ended, and puts what is to be seen on the members' entities.
fn take(
    mut analyses: ResMut<Analyses>,
    at: Res<ShownAt>,
    members: Query<(Entity, &Member, Option<&SurfaceDamage>)>,
    mut commands: Commands,
) {
    for analysis in analyses.bypass_change_detection().0.values_mut() {
        if !analysis.work.settle() && !at.is_changed() {
            continue;
        }
        let Work::Done(life) = &analysis.work else { continue };
        let (end, then) = (life.damage(f64::INFINITY), life.damage(at.0.unwrap_or(f64::INFINITY)));
        for (entity, member, before) in &members {
            let of = |all: &[SurfaceDamage]| all.iter().find(|d| d.member == member.id).cloned();
            let Some(last) = of(end) else { continue };
            let sound = SurfaceDamage { cracks: Vec::new(), spalls: Vec::new(), ..last };
            let now = of(then).unwrap_or(sound);
            match before {
                Some(before) if *before == now => {}
                None if now.is_empty() => {}
                _ => drop(commands.entity(entity).insert(now)),
            }
        }
    }
}
