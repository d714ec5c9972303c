//! *Spans of a network*: the life of bridges of which a table says no more than place, year and
//! lengths of spans.
//!
//! [`table`] reads the bridges, [`rules`] says what of their concrete is assumed (every rule with
//! its source, or marked as ours), [`section`] lets the decisive section live, in a millisecond, and
//! [`drawn`] writes the same span as a scene, for a life in finite elements to compare with. All of
//! it is assumed, so that error bars are wide; what such a table cannot say is in
//! [`CANNOT_SAY`].

mod drawn;
mod rules;
mod section;
mod table;

pub use drawn::{ID, drawn};
pub use rules::{Kind, Span, spans};
pub use section::{Life, Sections, Settings, of_foretold};
pub use table::{Bridge, BridgeTable, TableError, parse};

/// What a table of lengths and years does not say, for every page that shows a network.
pub const CANNOT_SAY: [&str; 6] = [
    "What a bridge is made of: spans above 25 m are taken to lie on girders of steel or prestressed concrete, of which nothing is forecast but the concrete deck on them.",
    "Joints that leak, drains that are blocked, waterproofing that is there or not: they decide where salt comes in, and no table knows them.",
    "Concrete, cover and bars as built: they are assumed by the year of building.",
    "How much salt a road gets, and whether a span stands over a road or over water.",
    "Prestress, foundations, bearings, scour, impact, fatigue: nothing is computed of them.",
    "What has been repaired: only a major rehabilitation is known by its year, and it is taken to have renewed the deck's upper cover.",
];
