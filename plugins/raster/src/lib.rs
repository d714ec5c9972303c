#![doc = include_str!("../README.md")]

pub mod flip;
pub mod grid;
pub mod network;

pub use grid::{Grid, Mask};
