//! The battery that `verify` runs on light.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_light::verify::checks;
use intrados_stage::Job;

#[test]
fn the_battery_passes_and_says_what_it_is_worth() {
    let checks = checks(&Job::new("verify")).unwrap();
    for c in &checks {
        eprintln!(
            "{} {:.4e} (expected {:.4e} ± {:.1e}) {:.1} s {}",
            c.kind, c.value, c.expected, c.tolerance, c.seconds, c.name
        );
    }
    for (kind, least) in [("energy", 21), ("sampling", 40), ("reference", 4), ("duality", 21)] {
        assert!(checks.iter().filter(|c| c.kind == kind).count() >= least, "too few of {kind}");
    }
    let failed: Vec<_> = checks.iter().filter(|c| !c.passed).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn it_can_be_cancelled() {
    let job = Job::new("verify");
    job.cancel();
    assert!(checks(&job).is_err());
}
