#![doc = include_str!("../README.md")]

pub mod correct;
pub mod march;
pub mod perturbed;
pub mod physics;
pub mod plugin;
pub mod primary;
pub mod problem;
pub mod recon;
pub mod scan;
pub mod scanner;
pub mod scatter;
pub mod specimen;
pub mod steer;
pub mod verify;
pub mod volume;

pub use plugin::XrayPlugin;
