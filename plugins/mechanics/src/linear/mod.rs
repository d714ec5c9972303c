//! Linear elastic decks of any solid elements: what engineers exchange beside members of concrete.
//!
//! Decks of bricks, shells and bars whose concrete may crack go through [`crate::read`] and
//! [`crate::deck`]. What those do not know is read here, computed at the end of each step, and
//! written as displacements of nodes and stresses at points of integration, in the numbering of
//! Abaqus and CalculiX:
//!
//! | subject | what |
//! |---|---|
//! | elements | C3D4, C3D6, C3D8, C3D10, C3D15, C3D20, C3D20R; CPS, CPE and CAX of 3, 4, 6 and 8 nodes and 8R, as layers of solids |
//! | materials | `*ELASTIC` (ISO, ORTHO, ANISO, ENGINEERING CONSTANTS), `*EXPANSION` (ISO, ORTHO), `*DENSITY`, `*ORIENTATION` |
//! | constraints | `*BOUNDARY`, `*EQUATION`, `*TRANSFORM`, `*TIE` |
//! | loads | `*CLOAD`, `*DLOAD` (P, GRAV, CENTRIF), `*DSLOAD` (P), `*TEMPERATURE`, `*INITIAL CONDITIONS` (TEMPERATURE, STRESS, PLASTIC STRAIN), `*AMPLITUDE` |
//! | steps | `*STATIC` without `NLGEOM`; `OP=MOD` and `OP=NEW` |
//!
//! Everything else is refused in one line that names all of it.

mod constraint;
mod element;
mod flat;
mod matter;
mod mesh;
mod model;
mod read;
mod shape;
mod solve;
mod steps;
mod tie;

pub use model::Deck;
pub use read::{concerns, parse};
pub use solve::{LinearError, Solved};

#[cfg(test)]
mod tests;
