#![doc = include_str!("../README.md")]

mod grip;
mod heard;
pub mod inverse;
mod misfit;
pub mod monitoring;
mod readings;
pub mod reduced;
pub mod rig;
pub mod simulate;
pub mod unknown;

pub use heard::{can_simulate, member_of, reading_name, refusal};
pub use readings::*;
pub use simulate::{Simulation, simulate_with};
pub use unknown::Priors;
