#![doc = include_str!("../README.md")]

mod error;
pub mod evidence;
pub mod fusion;
pub mod grading;
pub mod ledger;
pub mod reach;
pub mod score;
pub mod truth;
pub mod verdict;
pub mod verify;
pub mod zone;

pub use error::EvidenceError;
pub use evidence::{AddEvidence, AllEvidence, Cause, Evidence, EvidenceSource, Said, Sources};

/// What a crate that brings evidence needs.
pub mod prelude {
    pub use crate::{
        AddEvidence, Cause, Evidence, EvidenceError, EvidenceSource, Said,
        zone::{ZONES, Zones, zone_at},
    };
}
