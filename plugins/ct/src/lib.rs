#![doc = include_str!("../README.md")]

pub mod batch;
pub mod crack;
pub mod detect;
mod error;
pub mod network;
pub mod normal;
pub mod outline;
pub mod picture;
pub mod score;
pub mod slice;
pub mod source;
mod stack;
pub mod steel;
pub mod synthetic;

pub use detect::{DetectSettings, Detection, Method, Pore, detect};
pub use error::SliceError;
pub use intrados_raster::{Grid, Mask};
pub use network::Network;
pub use picture::Picture;
pub use slice::{Slice, Slices};
