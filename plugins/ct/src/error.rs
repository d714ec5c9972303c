use intrados_stage::Cancelled;
use intrados_xray::{scan::ScanError, volume::VolumeError};

use crate::synthetic::drawn::DrawError;

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

/// Why a slice could not be read.
#[derive(Debug, thiserror::Error)]
pub enum DetectError {
    /// There is nothing but air.
    #[error(
        "{0}: no body found; grey must be proportional to attenuation, with 0 for the air around the specimen"
    )]
    NoBody(String),
    /// The air around the specimen is brighter than the specimen.
    #[error(
        "{0}: what is around the specimen is brighter than it; invert the grey, so that air is dark and steel bright, or make what is outside 0"
    )]
    Inverted(String),
    /// The program's own weights cannot be read.
    #[error(
        "the weights of the network are damaged: detect with the classical method, and install the program again"
    )]
    NoNetwork,
    /// A setting makes no sense.
    #[error("detection setting {0}")]
    Setting(&'static str),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
