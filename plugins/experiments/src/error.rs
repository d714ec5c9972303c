//! Why an experiment ended.

use intrados_stage::Cancelled;
use intrados_xray::{
    physics::PhysicsError, recon::ReconError, scan::ScanError, specimen::SpecimenError,
};

/// Why there is no table.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The table of cases cannot be used.
    #[error("the table of cases is damaged: {0}; install the program again")]
    Table(String),
    /// The program's own weights cannot be read.
    #[error("the weights of the network for members are damaged: install the program again")]
    NoNetwork,
    /// A case cannot be scanned.
    #[error("{0}")]
    Scan(String),
    /// The program's own tables are damaged.
    #[error(transparent)]
    Physics(#[from] PhysicsError),
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<ReconError> for ExperimentError {
    fn from(error: ReconError) -> Self {
        match error {
            ReconError::Cancelled(c) => Self::Cancelled(c),
            ReconError::Bad(text) => Self::Scan(text),
        }
    }
}

impl From<ScanError> for ExperimentError {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::Cancelled(c) => Self::Cancelled(c),
            ScanError::Physics(e) => Self::Physics(e),
            ScanError::Bad(text) => Self::Scan(text),
        }
    }
}

impl From<SpecimenError> for ExperimentError {
    fn from(error: SpecimenError) -> Self {
        Self::Scan(error.to_string())
    }
}
