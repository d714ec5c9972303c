#![doc = include_str!("../README.md")]

mod document;
mod html;
mod model;
mod record;
pub mod surface;
mod svg;
mod tables;
pub mod visibility;

pub use document::{Document, Provenance, write};
pub use html::html;
pub use record::{Record, RecordError};
pub use tables::{evidence_csv, members_csv, slices_csv, zones_csv};
