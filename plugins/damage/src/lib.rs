#![doc = include_str!("../README.md")]

pub mod crack;
pub mod detect;
pub mod drawn;
pub mod evidence;
pub mod grading;
pub mod grid;
mod picture;
pub mod predict;
pub mod score;
pub mod slice;

pub use picture::Picture;
