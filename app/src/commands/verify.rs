//! `intrados verify`: the battery of checks (theory §7), counted by what an agreement rests on.

use intrados_stage::{Cancelled, Job};
use intrados_transport::Check;
use serde::Serialize;

use super::render::MapRows;
use crate::{
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Schema `intrados.verify/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    checks: Vec<Check>,
    passed: usize,
    failed: usize,
    /// How many checks rest on what.
    bases: BasisCounts,
}

/// What the agreement of a check rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CheckBasis {
    /// A closed form, met within 1e-6.
    Exact,
    /// A closed form or a published value, within the stated error of a discretisation or of its
    /// printed digits.
    Discretised,
    /// Random walks or samples, within their own standard error or a level of χ².
    Statistical,
    /// How the method went when it was first run: no theory says the number.
    Regression,
}

/// How many checks rest on what.
#[derive(Debug, Default, Serialize)]
struct BasisCounts {
    exact: usize,
    discretised: usize,
    statistical: usize,
    regression: usize,
}

/// What counts as exact: relative to what is expected, or absolute where that is 0.
const EXACT: f64 = 1e-6;

fn basis_of(check: &Check) -> CheckBasis {
    let sampled = ["duality", "energy", "length", "oracle", "reference", "sampling", "wrong field"];
    let scale = if check.expected == 0.0 { 1.0 } else { check.expected.abs() };
    if sampled.contains(&check.kind) || check.name.starts_with("z of ") {
        CheckBasis::Statistical
    } else if check.kind == "process" {
        CheckBasis::Regression
    } else if check.tolerance <= EXACT * scale {
        CheckBasis::Exact
    } else {
        CheckBasis::Discretised
    }
}

impl BasisCounts {
    fn of(checks: &[Check]) -> Self {
        let mut counts = Self::default();
        for check in checks {
            *match basis_of(check) {
                CheckBasis::Exact => &mut counts.exact,
                CheckBasis::Discretised => &mut counts.discretised,
                CheckBasis::Statistical => &mut counts.statistical,
                CheckBasis::Regression => &mut counts.regression,
            } += 1;
        }
        counts
    }

    fn sentence(&self) -> String {
        format!(
            "{} exact within 1e-6, {} within the error of a discretisation or of printed digits, {} statistical, {} regressions",
            self.exact, self.discretised, self.statistical, self.regression
        )
    }
}

/// A part of the battery: what it is about, and the crate's checks.
type Part = (&'static str, fn(&Job) -> Result<Vec<Check>, Cancelled>);

const BATTERY: [Part; 5] = [
    ("checking the walks against exact solutions", intrados_transport::verify::checks),
    ("checking light: energy, sampling, references, duality", intrados_light::verify::checks),
    (
        "checking X-rays: cross sections, sampling, line integrals, reconstruction",
        intrados_xray::verify::checks,
    ),
    ("checking mechanics: closed forms, benchmarks, the dual", intrados_mechanics::verify::checks),
    ("checking damage: fusion, causes, pores", intrados_damage::verify::checks),
];

pub(crate) fn run(session: &Session) -> Result<Outcome, Failure> {
    let mut checks = Vec::new();
    for (label, part) in BATTERY {
        let _progress = session.watch(label);
        checks.extend(part(&session.job)?);
    }
    let passed = checks.iter().filter(|c| c.passed).count();
    let failed = checks.len() - passed;
    let report = Report {
        schema: "intrados.verify/1",
        version: env!("CARGO_PKG_VERSION"),
        bases: BasisCounts::of(&checks),
        checks,
        passed,
        failed,
    };
    session.print(&report, || report.table())?;
    Ok(if failed == 0 { Outcome::Done } else { Outcome::NotPassed })
}

impl Report {
    fn table(&self) -> String {
        let mut rows = vec![
            ["", "kind", "check", "value", "expected", "tolerance", "seconds"].map(String::from),
        ];
        for c in &self.checks {
            let number = |x: f64| format!("{x:.5e}");
            rows.push([
                if c.passed { "passed" } else { "FAILED" }.into(),
                c.kind.into(),
                c.name.clone(),
                number(c.value),
                number(c.expected),
                number(c.tolerance),
                format!("{:.2}", c.seconds),
            ]);
        }
        output::table(&rows.map_rows())
            + &format!("{} passed, {} failed\n", self.passed, self.failed)
            + &format!("Of all: {}.\n", self.bases.sentence())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_are_counted_by_what_they_rest_on() {
        let check = |kind, name: &str, expected, tolerance| {
            Check::run(kind, name, expected, tolerance, || expected)
        };
        let checks = [
            check("zero-variance", "largest error", 0.0, 1e-12),
            check("birth", "first bar, Pa", 2e7, 1e-3),
            check("Lamé", "hoop stress", 1.67, 0.02),
            check("law", "slope", 2.0, 0.05),
            check("windows", "z of the mean", 0.0, 3.2),
            check("energy", "furnace", 3.3, 1e-9),
            check("process", "log10 relVar", -5.0, 1.0),
        ];
        let counts = BasisCounts::of(&checks);
        let found = [counts.exact, counts.discretised, counts.statistical, counts.regression];
        assert_eq!(found, [2, 2, 2, 1]);
    }
}
