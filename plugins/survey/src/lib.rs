#![doc = include_str!("../README.md")]

mod again;
mod beforehand;
mod cell;
mod findings;
#[cfg(test)]
mod knobs;
mod measured;
pub mod photographed;
mod possible;
mod rust;
#[cfg(test)]
mod simulate;
mod site;
mod strength;
mod weighed;

pub use again::found_again;
pub use beforehand::{Beforehand, beforehand};
pub use weighed::*;
