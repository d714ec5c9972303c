//! Spans of time, s.

/// An hour.
pub const HOUR: f64 = 3600.0;

/// A day.
pub const DAY: f64 = 86_400.0;

/// A year of 365.25 days.
pub const YEAR: f64 = 365.25 * DAY;
