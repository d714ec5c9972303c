//! X-ray scanners.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An X-ray scanner: tube, detector, orbit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// Name.
    pub name: String,
    /// Ids of the members it scans.
    pub members: Vec<String>,
    /// The source.
    pub tube: Tube,
    /// The detector.
    pub detector: Detector,
    /// How both go round.
    pub orbit: Orbit,
}

/// An X-ray tube.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tube {
    /// kV.
    pub voltage_kv: f32,
    /// Filters, (metal, mm).
    #[serde(default)]
    pub filters: Vec<(String, f32)>,
    /// Current times exposure of one projection, mAs.
    #[serde(default = "charge")]
    pub charge_mas: f32,
    /// Focal spot, mm.
    #[serde(default)]
    pub focus_mm: f32,
}

fn charge() -> f32 {
    10.0
}

/// An X-ray detector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Detector {
    /// Pixels across.
    pub width: u32,
    /// Pixels along the axis.
    pub height: u32,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
}

/// A circular orbit about a member's axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// How many.
    pub projections: u32,
    /// Degrees in all.
    #[serde(default = "full_turn")]
    pub arc_deg: f32,
    /// Focus to axis, m.
    pub source_m: f32,
    /// Axis to detector, m.
    pub detector_m: f32,
    /// Places of the orbit's plane on the axis, 0 to 1.
    #[serde(default = "middle")]
    pub along: Vec<f32>,
}

fn full_turn() -> f32 {
    360.0
}

fn middle() -> Vec<f32> {
    vec![0.5]
}
