//! Decks of any solid elements: what engineers exchange beside members of concrete. Linear elastic.
//!
//! Decks of bricks, shells and bars whose concrete may crack go through [`crate::read`] and
//! [`crate::deck`]. What those do not know is read here, computed at the end of each step, and
//! written as displacements of nodes and stresses at points of integration, in the numbering of
//! Abaqus and CalculiX:
//!
//! | subject | what |
//! |---|---|
//! | elements | C3D4, C3D6, C3D8, C3D8I, C3D8R (with CalculiX' stiffness against hourglasses: they bend far too much with one or two across), C3D10, C3D15, C3D20, C3D20R; S3, S4, S6, S8, S8R and B31, B32, B32R (`*NORMAL`; sections RECT, CIRC, PIPE, BOX, with offsets); T3D2, SPRINGA, SPRING1, SPRING2 |
//! | materials | `*ELASTIC` (ISO, ORTHO, ANISO, ENGINEERING CONSTANTS), `*EXPANSION`, `*CONDUCTIVITY` (ISO, ORTHO), `*DENSITY`, `*SPECIFIC HEAT`, all by temperature; `*ORIENTATION` |
//! | constraints | `*BOUNDARY`, `*EQUATION` (also REMOVE), `*TRANSFORM`, `*TIE` |
//! | loads | `*CLOAD`, `*DLOAD` (P, GRAV), `*DSLOAD` (P), `*TEMPERATURE`, `*INITIAL CONDITIONS` (TEMPERATURE, STRESS), `*AMPLITUDE`; `*CFLUX`, `*DFLUX`, `*FILM`, `*RADIATE` |
//! | steps | `*STATIC`, `*FREQUENCY`, `*BUCKLE`, `*HEAT TRANSFER` (steady, in time; a `*STATIC` step after it takes its temperatures); `OP=MOD` and `OP=NEW` |
//!
//! Everything else is refused in one line that names all of it.
//!
//! Meshes of Gmsh become the same decks ([`parse_mesh`]) by a file that says what their physical
//! groups are made of, what holds them and what acts on them ([`Groups`]).

mod constraint;
mod element;
mod free;
mod gmsh;
mod groups;
mod heat;
mod law;
mod link;
mod matter;
mod mesh;
mod model;
mod modes;
mod read;
mod shape;
mod solve;
mod steps;
mod thin;
mod tie;
mod turn;
mod warm;

pub use gmsh::parse_mesh;
pub use groups::Groups;
pub use model::Deck;
pub use read::{concerns, parse};
pub use solve::{LinearError, Solved};

#[cfg(test)]
mod checks;
#[cfg(test)]
mod tests;
