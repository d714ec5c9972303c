//! Photographs of members, which are read.

use std::path::PathBuf;

use super::Date;

/// A photograph of a member, and what says where it was taken from.
#[derive(Debug, Clone, PartialEq)]
pub struct Photographed {
    /// Id of the member that it is evidence of.
    pub member: String,
    /// Name, unique within the member.
    pub name: String,
    /// The photograph.
    pub file: PathBuf,
    /// Table of picks: which places of the scene are where in it.
    pub picks: PathBuf,
    /// When it was taken.
    pub date: Option<Date>,
    /// Focal length, pixels, where EXIF does not say it.
    pub focal_px: Option<f64>,
    /// Standard error of a pick, pixels.
    pub picking_px: f64,
    /// Standard error of where shadows lie on faces, m.
    pub shadow_error_m: f64,
}

impl Photographed {
    /// Standard error of a pick where nobody says it, pixels.
    pub const PICKING_PX: f64 = 2.0;
    /// Standard error of where shadows lie where nobody says it, mm: lamps and edges are not quite
    /// where the scene has them.
    pub const SHADOW_ERROR_MM: f64 = 20.0;
}
