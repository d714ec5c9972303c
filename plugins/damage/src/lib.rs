#![doc = include_str!("../README.md")]

mod error;
pub mod evidence;
pub mod forecast;
pub mod fusion;
pub mod gauges;
pub mod grading;
pub mod ledger;
pub mod monitoring;
pub mod photographed;
mod plugin;
pub mod predict;
mod reach;
pub mod score;
pub mod survey;
pub mod truth;
pub mod verdict;
pub mod verify;
pub mod zone;

pub use error::PredictError;
pub use evidence::{AddEvidence, AllEvidence, Cause, Evidence, EvidenceSource, Said, Sources};
pub use plugin::{DamagePlugin, Predicted, Predicting, Progress};
pub use predict::{Prediction, predict};
