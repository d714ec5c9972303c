#![doc = include_str!("../README.md")]

pub mod battery;
pub mod bsdf;
mod certificate;
mod eight;
pub mod emit;
mod exposure;
mod field;
mod film;
pub mod furnace;
mod link;
mod lit;
mod measure;
pub mod patch;
pub mod perturbed;
pub mod plugin;
mod problem;
pub mod radiosity;
mod reach;
mod render;
mod rgb;
mod sensor;
pub mod tone;
pub mod verify;

pub use exposure::{Exposure, Mismatch, PASS, Passes, Shard};
pub use field::{Culprit, Effort, Guide, false_colours, learn, spread};
pub use film::{Film, ORDERS};
pub use lit::LitScene;
pub use measure::{CombinedReading, Measurement, MeterReading, SideReading, readings};
pub use patch::Patch;
pub use perturbed::{Extent, Stain, StainedLight};
pub use plugin::LightPlugin;
pub use problem::LightProblem;
pub use render::{
    Image, Plate, Render, RenderSettings, Scored, Sides, Summary, Trust, View, replay, scene_rule,
};
pub use rgb::{Rgb, luminance};
pub use sensor::Sensor;
