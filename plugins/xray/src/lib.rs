#![doc = include_str!("../README.md")]

pub mod correct;
pub mod physics;
pub mod recon;
pub mod volume;
