//! Damage that is seen in a photograph.

pub mod lesson;
