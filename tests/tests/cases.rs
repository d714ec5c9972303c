//! Every folder of `tests/cases` is a case: `scene.ron` is measured from both sides as
//! `expected.ron` says, and each reading must be what is expected within its own standard errors.
//! All cases are one family at 1 % false alarms (Šidák); the seeds are fixed. A new case is a new
//! folder.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{fs, path::Path};

use intrados_scene::Scene;
use intrados_stage::Job;
use intrados_tests::{Family, lit, read, sensors};
use intrados_transport::{Side, WalkRule};
use serde::Deserialize;

/// `expected.ron`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    seed: u64,
    /// Passes of 16 k walks for each sensor and side.
    passes: u32,
    readings: Vec<Reading>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Reading {
    /// Name of the camera or meter.
    sensor: String,
    /// Which side, if only one.
    #[serde(default)]
    side: Option<Side>,
    /// In the sensor's unit.
    value: f64,
    /// How well `value` is known, relative.
    within: f64,
    /// The largest relative standard error with which the reading still proves something.
    largest_error: f64,
}

#[test]
fn every_case_reads_as_expected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let mut cases: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    cases.sort();
    let mut family = Family::default();
    for case in &cases {
        let name = case.file_name().unwrap().to_string_lossy();
        let text =
            fs::read_to_string(case.join("expected.ron")).unwrap_or_else(|e| panic!("{name}: {e}"));
        let options = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let expected: Expected =
            options.from_str(&text).unwrap_or_else(|e| panic!("{name}/expected.ron: {e}"));
        let scene = Scene::load(&case.join("scene.ron"), &Job::default())
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let sensors = sensors(&scene);
        let found = read(&lit(scene), sensors, WalkRule::default(), expected.seed, expected.passes);
        for wanted in expected.readings {
            let reading = found
                .iter()
                .find(|r| r.name == wanted.sensor)
                .unwrap_or_else(|| panic!("{name}: no sensor {}", wanted.sensor));
            for (side, r) in [(Side::Primal, &reading.primal), (Side::Dual, &reading.dual)] {
                if wanted.side.is_none_or(|only| only == side) {
                    let r = r.as_ref().unwrap();
                    let name = format!("{name}, {}, {side:?}", wanted.sensor);
                    family.claim_within(
                        name,
                        r.mean,
                        r.std_error,
                        wanted.value,
                        wanted.within,
                        wanted.largest_error,
                    );
                }
            }
        }
    }
    assert!(cases.len() >= 4, "cases are missing");
    family.judge();
}
