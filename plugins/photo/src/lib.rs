#![doc = include_str!("../README.md")]

pub mod corner;
mod edges;
pub mod face;
pub mod map;
pub mod marks;
pub mod overlay;
pub mod picks;
pub mod picture;
pub mod pose;
pub mod reading;
pub mod record;
pub mod relight;
pub mod series;
mod similarity;
pub mod site;
pub mod tags;
pub mod taken;

pub use edges::by_edges;
pub use map::{FaceMap, unrolled};
pub use picture::{Photograph, PictureError};
pub use pose::{ByEdges, Located, Pick, Pose, PoseError, Prior, locate};
pub use site::{Sight, Site};
