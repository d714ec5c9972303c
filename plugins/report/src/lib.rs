#![doc = include_str!("../README.md")]

mod basis;
mod bcf;
mod document;
mod html;
mod ifc;
mod labels;
mod model;
pub mod network;
pub mod pdf;
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
pub(crate) use tables::defects_csv;
pub(crate) use tables::members_csv;
pub(crate) use tables::slices_csv;
pub(crate) use tables::zones_csv;
pub use tables::{evidence_csv, tables};
