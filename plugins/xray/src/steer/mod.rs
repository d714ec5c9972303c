//! What steers photons: fields over (place, energy, direction), learnt from walks of both sides in
//! turns (theory §4).
//!
//! A walk from the tube is steered by the panel's importance, a walk from the panel by the photons'
//! flux; each finds what the other needs. A field has two tables: what *going* from a place with an
//! energy into a direction brings (the adjoint flux of the other side's scattered walks), and what
//! *coming* to a collision so brings (their emission density over Σ_t). With them starts, ways and
//! flights are drawn nearly as the zero-variance walk would.

mod domain;
mod field;
mod guide;
mod recorder;
mod steered;

pub use domain::Domain;
pub use field::PhotonField;
pub use guide::{Guide, learn, rule};
pub use steered::SteeredPhotons;
