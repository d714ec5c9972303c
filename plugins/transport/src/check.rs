//! A claim that can be run.

use std::time::Instant;

use serde::Serialize;

/// One check of the battery that `verify` runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What is claimed.
    pub name: String,
    /// Of which kind: `zero-variance`, `law`, `oracle`, `duality`, `sampling`, `energy` …
    pub kind: &'static str,
    /// What was found.
    pub value: f64,
    /// What was expected.
    pub expected: f64,
    /// How far the two may be apart.
    pub tolerance: f64,
    /// Whether they are not further apart.
    pub passed: bool,
    /// Wall time, s.
    pub seconds: f64,
}

impl Check {
    /// Runs `find` and holds what it found against `expected ± tolerance`.
    pub fn run(
        kind: &'static str,
        name: impl Into<String>,
        expected: f64,
        tolerance: f64,
        find: impl FnOnce() -> f64,
    ) -> Self {
        let begin = Instant::now();
        let value = find();
        let passed = (value - expected).abs() <= tolerance;
        Self {
            name: name.into(),
            kind,
            value,
            expected,
            tolerance,
            passed,
            seconds: begin.elapsed().as_secs_f64(),
        }
    }
}
