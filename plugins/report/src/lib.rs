#![doc = include_str!("../README.md")]

mod basis;
mod bcf;
mod document;
mod html;
mod ifc;
mod model;
mod record;
pub mod surface;
mod svg;
mod tables;
pub mod visibility;
mod words;

pub use basis::{Basis, MemberBasis};
pub use bcf::{Version, bcf};
pub use document::{Document, Provenance, write};
pub use html::html;
pub use ifc::check_model;
pub use record::{Record, RecordError};
pub use tables::{defects_csv, evidence_csv, members_csv, slices_csv, zones_csv};
