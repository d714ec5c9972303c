#![doc = include_str!("../README.md")]

pub mod crack;
pub mod detect;
pub mod grid;
pub mod score;
pub mod slice;
