use intrados_ct::SliceError;
use intrados_damage::{EvidenceError, grading::ProfileError};
use intrados_stage::{Cancelled, Fault};

/// Why there is no prediction.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// A slice that cannot be read.
    #[error(transparent)]
    Slice(SliceError),
    /// Evidence that cannot be used, and why.
    #[error("{0}")]
    Refused(String),
    /// The scene's grading profile.
    #[error(transparent)]
    Profile(#[from] ProfileError),
    /// A piece of work that broke off: a fault of this program or of a plugin.
    #[error("{work}: {fault}")]
    Fault {
        /// What was being done.
        work: String,
        /// What it broke off with.
        fault: Fault,
    },
    /// The scene is not the one that the work began with.
    #[error("the scene changed while its damage was being predicted; begin again")]
    Changed,
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<SliceError> for PredictError {
    fn from(error: SliceError) -> Self {
        match error {
            // Whoever stops the work in the middle of a slice is told so, and not that the slice is
            // bad.
            SliceError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Slice(error),
        }
    }
}

impl From<EvidenceError> for PredictError {
    fn from(error: EvidenceError) -> Self {
        match error {
            EvidenceError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            EvidenceError::Refused(why) => Self::Refused(why),
        }
    }
}
