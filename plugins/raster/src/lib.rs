#![doc = include_str!("../README.md")]

pub mod grid;
pub mod network;

pub use grid::{Grid, Mask};
