#![doc = include_str!("../README.md")]

pub mod battery;
pub mod bsdf;
pub mod emit;
pub mod radiosity;
pub mod tone;
