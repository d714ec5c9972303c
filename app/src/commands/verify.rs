//! `intrados verify`: the battery of exact checks (theory §7).

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
    }
}
