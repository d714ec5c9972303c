use std::path::PathBuf;

use intrados_stage::{Cancelled, access::Denied};

/// Why a source says nothing.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceError {
    /// None of its items can be used, and why.
    #[error("{0}")]
    Refused(String),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Why a profile was refused.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// Not the RON it should be.
    #[error("grading profile: {0}")]
    Syntax(#[from] Box<ron::error::SpannedError>),
    /// A number or a name that makes no sense.
    #[error("grading profile: {0}")]
    Value(&'static str),
    /// A file that cannot be read.
    #[error("{}: {why}", path.display())]
    Unread {
        /// The file.
        path: PathBuf,
        /// What is wrong, one line.
        why: Denied,
    },
    /// A file that is wrong.
    #[error("{}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong, one line.
        why: Box<ProfileError>,
    },
}
