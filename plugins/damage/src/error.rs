use intrados_ct::detect::DetectError;
use intrados_stage::Cancelled;
use intrados_xray::scan::ScanError;

/// Why there is no prediction.
#[derive(Debug, thiserror::Error)]
pub enum PredictError {
    /// A file of slices or masks.
    #[error(transparent)]
    Slice(#[from] intrados_xray::volume::VolumeError),
    /// A slice that cannot be read.
    #[error(transparent)]
    Detect(DetectError),
    /// A slice that cannot be one of its member.
    #[error("{0}")]
    Unfit(String),
    /// A slice that cannot be drawn.
    #[error("member {member}: {reason}")]
    Drawn {
        /// Name of the member.
        member: String,
        /// What is wrong.
        reason: String,
    },
    /// A slice that the scanner cannot make.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The scene is not the one that the work began with.
    #[error("the scene changed while its damage was being predicted; begin again")]
    Changed,
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<DetectError> for PredictError {
    fn from(error: DetectError) -> Self {
        match error {
            // Whoever stops the work in the middle of a slice is told so, and not that the slice is bad.
            DetectError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            error => Self::Detect(error),
        }
    }
}

impl PredictError {
    /// Whether a slice is at fault that others can do without.
    #[must_use]
    pub fn is_of_the_slice(&self) -> bool {
        match self {
            Self::Slice(error) => !matches!(error, intrados_xray::volume::VolumeError::Cancelled(_)),
            Self::Detect(_) | Self::Unfit(_) => true,
            _ => false,
        }
    }
}
