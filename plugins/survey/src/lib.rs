#![doc = include_str!("../README.md")]

mod again;
mod findings;
pub mod photographed;
mod rust;
#[cfg(test)]
mod simulate;
mod site;
mod strength;
mod weighed;

pub use again::found_again;
pub use rust::only_of_rust;
pub use weighed::*;
