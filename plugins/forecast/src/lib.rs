#![doc = include_str!("../README.md")]

mod course;
mod life;
pub mod span;
mod width;

pub use course::GaugeCourse;
pub use life::*;
pub use width::Tie;
pub(crate) use width::crack_width;
