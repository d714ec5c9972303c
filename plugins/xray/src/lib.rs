#![doc = include_str!("../README.md")]

// What is scanned, and by what.
pub mod scanner;
pub mod specimen;
pub mod volume;

// A scan: rays, scatter, and what a detector makes of them.
pub mod march;
pub mod physics;
pub mod primary;
pub mod problem;
pub mod scan;
pub mod scatter;
pub mod steer;

// From projections to slices, and what damage does to projections.
pub mod correct;
pub mod perturbed;
pub mod recon;

pub mod plugin;
pub mod verify;

pub use plugin::XrayPlugin;
pub use scan::{Acquisition, Corrections, Protocol, ScanError};
pub use scanner::Scanner;
pub use specimen::Specimen;
