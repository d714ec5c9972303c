//! What is wrong with a face, as it is written. Part of schema `intrados.photo/1`.

use intrados_scene::structure::Course;
use serde::Serialize;

/// A point of a crack on its face.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CrackPoint {
    /// On the face, m.
    pub across_m: f64,
    /// Along the member's axis from its start, m.
    pub along_m: f64,
    /// Opening, mm; none where one of its sides is not seen.
    pub width_mm: Option<f64>,
    /// Standard error of it, mm.
    pub error_mm: Option<f64>,
}

/// A crack in the plane of its face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Crack {
    /// Its middle line.
    pub points: Vec<CrackPoint>,
    /// m.
    pub length_m: f64,
    /// Mean opening, mm.
    pub width_mm: f64,
    /// Standard error of it, mm.
    pub width_error_mm: f64,
    /// Opening of its widest quarter, mm.
    pub widest_mm: f64,
    /// Standard error of it, mm.
    pub widest_error_mm: f64,
    /// How it runs.
    pub course: Course,
    /// Between its chord and the member's axis, degrees, 0 to 90.
    pub to_axis_deg: f64,
    /// Share of the light of the concrete beside that its slot returns, and its standard error.
    pub returned: [f64; 2],
}

/// A patch of a face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Patch {
    /// Its middle on the face, m.
    pub across_m: f64,
    /// And along the member's axis from its start, m.
    pub along_m: f64,
    /// From and to along the axis, m.
    pub reach_m: [f64; 2],
    /// m².
    pub area_m2: f64,
}

/// One thing that is wrong with a face.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Defect {
    /// A crack.
    Crack(Crack),
    /// Concrete that has come off.
    Spall {
        /// Where, and how large.
        #[serde(flatten)]
        patch: Patch,
        /// Whether steel is to be seen in it.
        bars_bare: bool,
    },
    /// A stain of rust.
    Rust(Patch),
    /// Lime and salts brought out by water.
    Efflorescence(Patch),
}

/// A long dark shape that was read as nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnreadShape {
    /// Where, and how large.
    #[serde(flatten)]
    pub patch: Patch,
    /// Its width at its widest, mm.
    pub width_mm: f64,
    /// Its area over that width, m.
    pub length_m: f64,
}

impl Defect {
    /// Its kind, for people.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Crack(_) => "crack",
            Self::Spall { .. } => "spall",
            Self::Rust(_) => "rust",
            Self::Efflorescence(_) => "efflorescence",
        }
    }

    /// The middle of it across its face, m.
    #[must_use]
    pub fn across_m(&self) -> f64 {
        match self {
            Self::Crack(crack) => {
                crack.points.get(crack.points.len() / 2).map_or(0.0, |p| p.across_m)
            }
            Self::Spall { patch, .. } | Self::Rust(patch) | Self::Efflorescence(patch) => {
                patch.across_m
            }
        }
    }

    /// From and to along the member's axis, m.
    #[must_use]
    pub fn reach_m(&self) -> [f64; 2] {
        match self {
            Self::Crack(crack) => {
                crack.points.iter().fold([f64::INFINITY, 0.0], |[low, high], p| {
                    [low.min(p.along_m), high.max(p.along_m)]
                })
            }
            Self::Spall { patch, .. } | Self::Rust(patch) | Self::Efflorescence(patch) => {
                patch.reach_m
            }
        }
    }
}
