#![doc = include_str!("../README.md")]

mod defect;
mod error;
mod foreseen;
mod plugin;
mod predictor;
mod section;

pub use defect::Defect;
pub use error::PredictError;
pub use foreseen::foreseen;
pub use intrados_ct::source::Origin;
pub use plugin::{PredictPlugin, Predicted, Predicting, Progress};
pub use predictor::*;
pub use section::{CT, SliceReading, SliceTruth};
