#![doc = include_str!("../README.md")]

pub mod grid;

pub use grid::{Grid, Mask};
