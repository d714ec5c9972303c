#![doc = include_str!("../README.md")]

pub mod batch;
pub mod crack;
pub mod detect;
mod error;
pub mod network;
pub mod normal;
pub mod outline;
pub mod picture;
pub mod probe;
pub mod score;
mod settings;
pub mod slice;
pub mod source;
mod stack;
pub mod steel;
pub mod synthetic;

pub use detect::{Detection, Pore, detect};
pub use error::SliceError;
pub use intrados_raster::{Grid, Mask};
pub use network::Network;
pub use picture::Picture;
pub use settings::{DetectSettings, Method};
pub use slice::{Slice, Slices};
