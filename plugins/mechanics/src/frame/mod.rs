//! The structure as a whole: beams, plates and what joins them, from deck to ground.
//!
//! | module | what |
//! |---|---|
//! | `section`, `beam` | cross-sections; a beam of two nodes |
//! | `model` | nodes, elements, equilibrium |

mod beam;
mod contact;
mod draft;
mod model;
mod section;
mod shape;
mod solid;
#[cfg(test)]
mod tests;

pub use model::FrameError;
