#![doc = include_str!("../README.md")]

pub mod batch;
pub mod crack;
pub mod detect;
pub mod drawn;
pub mod evidence;
pub mod experiment;
pub mod felt;
pub mod forecast;
pub mod fusion;
pub mod grading;
pub mod grid;
pub mod ledger;
pub mod network;
mod normal;
mod outline;
mod picture;
mod plugin;
pub mod predict;
pub mod projected;
pub mod report;
pub mod scanned;
pub mod score;
pub mod shown;
pub mod slice;
pub mod steel;
pub mod surface;
pub mod truth;
pub mod verdict;
pub mod verify;
pub mod zone;

pub use evidence::{AllEvidence, Cause, Evidence, EvidenceSource};
pub use picture::Picture;
pub use plugin::{DamagePlugin, Predicted, Progress};
pub use predict::{Prediction, predict};
