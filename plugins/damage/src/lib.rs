#![doc = include_str!("../README.md")]

pub mod batch;
pub mod crack;
pub mod detect;
pub mod drawn;
pub mod evidence;
pub mod experiment;
pub mod grading;
pub mod grid;
pub mod network;
mod normal;
mod picture;
mod plugin;
pub mod predict;
pub mod report;
pub mod score;
pub mod slice;

pub use evidence::{AllEvidence, Evidence, EvidenceSource};
pub use picture::Picture;
pub use plugin::{DamagePlugin, Predicted, Progress};
pub use predict::{Prediction, predict};
