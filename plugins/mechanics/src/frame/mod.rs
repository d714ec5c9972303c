//! The structure as a whole: beams, plates and what joins them, from deck to ground.
//!
//! | module | what |
//! |---|---|
//! | `section`, `beam` | cross-sections; a beam of two nodes |
//! | `model` | nodes, elements, equilibrium |
//! | `solid`, `shape`, `contact` | bodies from surfaces; bars and sheets; where two members touch |
//! | `draft` | from the members of a scene to a model |
//! | `whole`, `picture` | loads, forces of members, redundancy; files |

mod beam;
mod contact;
mod draft;
mod export;
mod hand;
mod model;
#[cfg(test)]
mod peer;
mod picture;
mod section;
mod shape;
mod solid;
#[cfg(test)]
mod tests;
mod whole;

pub use model::FrameError;
pub use whole::{
    JointForces, MemberForces, Reaction, Redundancy, Rise, SectionForces, Whole, joined, whole,
};
