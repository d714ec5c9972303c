#![doc = include_str!("../README.md")]

pub mod attaching;
mod compared;
mod defect;
mod error;
mod foreseen;
mod limits;
mod plugin;
mod prediction;
mod predictor;
mod section;
mod settings;

pub use compared::{Compared, score};
pub use defect::{Defect, Found};
pub use error::PredictError;
pub use foreseen::foreseen;
pub use intrados_ct::source::Origin;
pub use limits::doubted;
pub use plugin::{PredictPlugin, Predicted, Predicting, Progress};
pub use prediction::{
    CrackCheck, MemberFailure, MemberPrediction, MissingEvidence, Prediction, Truth,
};
pub use predictor::{Predictor, predict};
pub use section::{CT, SliceReading, SliceTruth};
pub use settings::PredictSettings;
