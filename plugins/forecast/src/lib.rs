#![doc = include_str!("../README.md")]

mod capacity;
mod course;
mod life;
pub mod span;
mod width;

pub use capacity::{Capacity, Losses, MODEL_ERROR, beyond, capacity};
pub use course::GaugeCourse;
pub use life::*;
pub use width::Tie;
pub(crate) use width::crack_width;
