use intrados_stage::Cancelled;
use intrados_xray::{scan::ScanError, volume::VolumeError};

use crate::{detect::DetectError, synthetic::drawn::DrawError};

/// Why a slice is not read.
#[derive(Debug, thiserror::Error)]
pub enum SliceError {
    /// Its file, or that of its mask.
    #[error(transparent)]
    File(#[from] VolumeError),
    /// What is in it.
    #[error(transparent)]
    Detect(DetectError),
    /// It cannot be one of its member.
    #[error("{0}")]
    Unfit(String),
    /// It cannot be drawn.
    #[error("member {member}: {reason}")]
    Drawn {
        /// Name of the member.
        member: String,
        /// What is wrong.
        reason: DrawError,
    },
    /// The scanner cannot make it.
    #[error(transparent)]
    Scan(ScanError),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<DetectError> for SliceError {
    fn from(error: DetectError) -> Self {
        match error {
            DetectError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Detect(error),
        }
    }
}

impl From<ScanError> for SliceError {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Scan(error),
        }
    }
}

impl SliceError {
    /// Whether the slice itself is at fault, so that others may still be read.
    #[must_use]
    pub fn is_of_the_slice(&self) -> bool {
        match self {
            Self::File(error) => !matches!(error, VolumeError::Cancelled(_)),
            Self::Detect(_) | Self::Unfit(_) => true,
            Self::Drawn { .. } | Self::Scan(_) | Self::Cancelled(_) => false,
        }
    }
}
