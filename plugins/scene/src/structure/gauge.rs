//! Gauges, and what they were read to show.

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Date;

/// A gauge on or in a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Name, unique among gauges and meters.
    pub name: String,
    /// Id of the member.
    pub member: String,
    /// Place on the axis, 0 to 1.
    pub along: f32,
    /// Side, degrees about the axis.
    pub angle_deg: f32,
    /// Below the surface, mm.
    #[serde(default)]
    pub depth_mm: f32,
    /// What it measures.
    pub measures: Measures,
}

/// What a gauge measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Measures {
    /// Normal strain along a direction of the member's frame.
    Strain(Direction),
    /// Normal stress along a direction of the member's frame, Pa.
    Stress(Direction),
    /// Displacement along a direction of the world, m.
    Displacement(#[schemars(with = "[f32; 3]")] Vec3),
}

/// Directions of a member's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Direction {
    /// Along the axis.
    Axial,
    /// Away from the axis.
    Radial,
    /// Around the axis.
    Hoop,
}

/// What a gauge read over months and years, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of the gauge.
    pub gauge: String,
    /// Its readings.
    pub samples: Vec<Sample>,
}

/// What a gauge read on a day, against what it read when it was set to nought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// When.
    pub date: Date,
    /// In SI units.
    pub value: f64,
    /// Of the value.
    pub std_error: f64,
    /// Of the concrete there, °C.
    pub temperature_c: Option<f64>,
}

/// What a gauge or a meter was read to show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Name of the gauge or meter.
    pub of: String,
    /// Name of the load test of which it is the effect: what the gauge reads under it less what it
    /// read before. None: all that has happened so far.
    #[serde(default)]
    pub test: Option<String>,
    /// In SI units.
    pub value: f64,
    /// Of the value.
    pub std_error: f64,
    /// When.
    #[serde(default)]
    pub at_days: f32,
}
