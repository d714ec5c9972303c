#![doc = include_str!("../README.md")]

mod hammer;

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::*;
use glam::Vec3;
use intrados_light::Measurement;
use intrados_scene::prelude::*;
use intrados_stage::Stage;

pub use hammer::{HammerPlugin, TABLE};

/// Name of the meter, in tables and in JSON.
pub const METER: &str = "work light";
/// Working plane above the ground, m.
const HEIGHT: f32 = 0.85;
/// Luminous efficacy by which lamps in lumen become watt, lm/W.
const LUMEN_PER_WATT: f64 = 683.0;

/// Intrados with our plugins: what its window shows and its command line drives.
pub fn app() -> App {
    let mut app = intrados::simulation();
    app.add_plugins((WorkLightPlugin::default(), HammerPlugin));
    app
}

/// Hangs a meter into every scene and judges its reading.
#[derive(Debug, Clone)]
pub struct WorkLightPlugin {
    /// Illuminance that is asked for, lx.
    pub needed: f64,
}

impl Default for WorkLightPlugin {
    fn default() -> Self {
        Self { needed: 300.0 }
    }
}

/// What the meter says.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct WorkLight {
    /// Illuminance that is asked for, lx.
    pub needed: f64,
    /// Illuminance, lx, and its standard error; `None` before the first reading.
    pub lux: Option<(f64, f64)>,
    /// Difference of the two sides in standard errors.
    pub duality_z: Option<f64>,
}

impl WorkLight {
    /// Whether there is enough light: `None` while the error bar reaches across the limit.
    #[must_use]
    pub fn is_enough(&self) -> Option<bool> {
        let (lux, error) = self.lux?;
        ((lux - self.needed).abs() > 3.0 * error).then_some(lux > self.needed)
    }
}

impl Plugin for WorkLightPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(WorkLight { needed: self.needed, lux: None, duality_z: None })
            .add_systems(Update, hang.in_set(Stage::Model))
            .add_systems(Update, judge.in_set(Stage::Estimate));
        #[cfg(feature = "desktop")]
        intrados_panels::AddPanel::add_panel(app, intrados_panels::Place::Right, "Work light", panel);
    }
}

/// Hangs the meter into a new scene.
fn hang(mut changed: MessageReader<SceneChanged>, scene: Option<Res<CurrentScene>>, mut light: ResMut<WorkLight>, mut commands: Commands) {
    let (Some(_), Some(scene)) = (changed.read().last(), scene) else { return };
    (light.lux, light.duality_z) = (None, None);
    commands.spawn((meter(&scene.0), FromScene));
}

/// A square of 20 cm that looks up, in the middle of the members, or of everything where there are
/// none.
fn meter(scene: &Scene) -> Meter {
    let boxes = scene.members.iter().map(|m| m.bounds);
    let [low, high] = boxes.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or_else(|| scene.bounds());
    let middle = 0.5 * (low + high);
    let centre = Vec3::new(middle.x, (low.y + HEIGHT).min(middle.y), middle.z);
    let (u, v) = (0.2 * Vec3::Z, 0.2 * Vec3::X);
    Meter { name: METER.into(), corner: centre - 0.5 * (u + v), u, v, on: None }
}

/// Takes the reading of the meter among all others.
fn judge(measurement: Option<Res<Measurement>>, mut light: ResMut<WorkLight>) {
    let Some(reading) = measurement.and_then(|m| m.readings().into_iter().find(|r| r.name == METER)) else { return };
    let combined = reading.combined;
    light.lux = combined.std_error.is_finite().then_some((LUMEN_PER_WATT * combined.mean, LUMEN_PER_WATT * combined.std_error));
    light.duality_z = reading.duality_z;
}

#[cfg(feature = "desktop")]
fn panel(InMut(ui): InMut<egui::Ui>, light: Res<WorkLight>) {
    let Some((lux, error)) = light.lux else {
        ui.weak("Not read yet.");
        return;
    };
    ui.label(intrados_panels::plus_minus(lux, error, "lx"));
    ui.label(match light.is_enough() {
        Some(true) => format!("✔ more than {} lx", light.needed),
        Some(false) => format!("⚠ less than {} lx", light.needed),
        None => format!("close to {} lx: not decided yet", light.needed),
    });
}

/// Opens a scene and lets the app run for `frames` frames with readings. Loading and compiling
/// happen off the frame and take as long as they take.
///
/// # Errors
/// The scene cannot be opened.
pub fn read(app: &mut App, scene: std::path::PathBuf, frames: usize) -> anyhow::Result<WorkLight> {
    use bevy_ecs::message::Messages;
    app.world_mut().remove_resource::<Measurement>();
    app.world_mut().write_message(OpenScene(scene));
    let mut read = 0;
    while read < frames {
        app.update();
        if let Some(SceneFailed(error)) = app.world_mut().resource_mut::<Messages<SceneFailed>>().drain().next() {
            return Err(error.into());
        }
        match app.world().contains_resource::<Measurement>() {
            true => read += 1,
            false => std::thread::sleep(std::time::Duration::from_millis(1)),
        }
    }
    Ok(*app.world().resource::<WorkLight>())
}
