//! Spans of time, s.

/// A day.
pub const DAY: f64 = 86_400.0;

/// A year of 365.25 days.
pub const YEAR: f64 = 365.25 * DAY;
