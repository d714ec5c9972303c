//! The part of the battery (theory §7) that light makes possible: energy, sampling, duality,
//! references.

use std::sync::Arc;

use intrados_scene::{Camera, Scene};
use intrados_stage::{Cancelled, Job};
use intrados_transport::{Check, Estimator, Side, WalkRule, chi2::sidak, verify::sidak_z};

use crate::{
    LitScene, Measurement, Sensor, Shard, Sides, battery,
    furnace::{Furnace, by_order},
};

/// Bundled scenes whose sensors are read from both sides, each with the passes (of 16 k walks) that
/// it gets per sensor and side.
const DUALITY: [(&str, u32); 7] = [
    ("room", 8),
    ("corridor", 8),
    ("slit", 16),
    ("cornell", 8),
    ("column", 12),
    ("beam", 12),
    ("tunnel", 12),
];
/// Camera means that other programs and methods agree on, W·m⁻²·sr⁻¹, ± .1 %, and the passes for
/// each side.
const REFERENCES: [(&str, f64, u32); 2] = [("room", 0.270_23, 32), ("corridor", 1.3021e-2, 160)];
/// A bound of .1 %, taken as uniform: its standard deviation.
const REFERENCE_ERROR: f64 = 5.8e-4;
const SEED: u64 = 61;

/// Runs all checks on light. False-alarm rate: 1 % for each of the four families; the seeds are
/// fixed.
///
/// # Errors
/// [`Cancelled`] if `job` was.
pub fn checks(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let parts: [fn(&Job) -> Result<Vec<Check>, Cancelled>; 4] =
        [energy, sampling, references, duality];
    let mut all = Vec::new();
    for (i, part) in parts.into_iter().enumerate() {
        job.step(i, parts.len())?;
        all.extend(part(job)?);
    }
    Ok(all)
}

/// Every estimator in a furnace, from both sides, for the camera and for meters on a wall and in
/// the air.
fn energy(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let furnace = Furnace { albedo: 0.7, emission: 1.0, inside: None };
    let lit = LitScene::build(Arc::new(furnace.scene()), job)?;
    let sensors = furnace.sensors();
    let mut cases = Vec::new();
    for sensor in &sensors {
        for side in Side::BOTH {
            for estimator in [
                Estimator::Analog,
                Estimator::Collision,
                Estimator::LastEvent,
                Estimator::NextEvent,
            ] {
                // Only links find a pinhole.
                if side == Side::Primal
                    || estimator == Estimator::NextEvent
                    || matches!(sensor, Sensor::Meter(_))
                {
                    cases.push((sensor, side, estimator));
                }
            }
        }
    }
    let family = cases.len();
    let mut checks = Vec::new();
    for (sensor, side, estimator) in cases {
        job.step(0, 4)?;
        let expected = Furnace::reading(sensor, furnace.radiance());
        let check = |name: String| {
            let rule = WalkRule { estimator, ..WalkRule::default() };
            let begin = std::time::Instant::now();
            let found = by_order(&lit, sensor, side, &rule, SEED, 0..1 << 16, 0).all;
            // What f32 may add where the spread is nothing.
            let tolerance = sidak_z(family) * found.std_error() + 1e-5 * expected;
            let name = format!("{name} (error {:.2} %)", 100.0 * found.std_error() / expected);
            Check {
                seconds: begin.elapsed().as_secs_f64(),
                ..Check::run("energy", name, expected, tolerance, || found.mean)
            }
        };
        checks.push(check(format!(
            "furnace, {side:?} {estimator:?} on the sensor {}: L_e/(1 − ρ)",
            sensor.name()
        )));
    }
    Ok(checks)
}

/// χ² of every sampling routine of BSDFs and lamps.
fn sampling(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let begin = std::time::Instant::now();
    let battery = battery::battery();
    job.step(1, 4)?;
    let family = battery.len();
    let seconds = begin.elapsed().as_secs_f64() / family.max(1) as f64;
    let check = |(name, chi): (String, intrados_transport::chi2::Chi2)| {
        let name = format!("p-value of χ², {name}");
        // Between the level of the family and 1.
        let least = sidak(0.01, family);
        let (expected, tolerance) = (0.5 * (1.0 + least), 0.5 * (1.0 - least));
        Check {
            seconds,
            passed: chi.passes(family),
            ..Check::run("sampling", name, expected, tolerance, || chi.p_value)
        }
    };
    Ok(battery.into_iter().map(check).collect())
}

fn bundled(name: &str, job: &Job) -> Result<Option<Arc<LitScene>>, Cancelled> {
    match Scene::load_bundled(name, job) {
        Ok(scene) => Ok(Some(Arc::new(LitScene::build(Arc::new(scene), job)?))),
        Err(_) => job.step(0, 1).map(|()| None),
    }
}

/// A scene that is not there fails its check.
fn missing(kind: &'static str, name: &str) -> Check {
    Check::run(kind, format!("{name} does not load"), 0.0, 0.0, || f64::NAN)
}

fn references(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let mut checks = Vec::new();
    for (name, expected, passes) in REFERENCES {
        let Some(lit) = bundled(name, job)? else {
            checks.push(missing("reference", name));
            continue;
        };
        let Some(camera) = lit.scene.cameras.first().cloned().map(Sensor::Camera) else { continue };
        let begin = std::time::Instant::now();
        let mut measurement = Measurement::new(
            Arc::clone(&lit),
            vec![camera],
            Sides::Both,
            WalkRule::default(),
            SEED,
            Shard::default(),
            None,
        );
        for _ in 0..passes / 8 {
            job.step(2, 4)?;
            measurement.advance_all(8);
        }
        let seconds = begin.elapsed().as_secs_f64();
        for reading in measurement.readings() {
            for (side, r) in [("primal", reading.primal), ("dual", reading.dual)] {
                let Some(r) = r else { continue };
                let error = r.std_error.hypot(REFERENCE_ERROR * expected);
                let name = format!(
                    "{name}, camera mean, {side} (error {:.2} %)",
                    100.0 * r.std_error / expected
                );
                let tolerance = sidak_z(2 * REFERENCES.len()) * error;
                checks.push(Check {
                    seconds: 0.5 * seconds,
                    ..Check::run("reference", name, expected, tolerance, || r.mean)
                });
            }
        }
    }
    Ok(checks)
}

/// Both sides of every sensor of the bundled scenes. The relative error says how much an agreement
/// is worth.
fn duality(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let mut checks = Vec::new();
    for (name, passes) in DUALITY {
        let Some(lit) = bundled(name, job)? else {
            checks.push(missing("duality", name));
            continue;
        };
        let begin = std::time::Instant::now();
        let cameras = lit.scene.cameras.iter().take(1).cloned().map(small).map(Sensor::Camera);
        let sensors: Vec<Sensor> =
            cameras.chain(lit.scene.meters.iter().cloned().map(Sensor::Meter)).collect();
        let mut measurement = Measurement::new(
            Arc::clone(&lit),
            sensors,
            Sides::Both,
            WalkRule::default(),
            SEED,
            Shard::default(),
            None,
        );
        for _ in 0..passes / 4 {
            job.step(3, 4)?;
            measurement.advance_all(4);
        }
        let readings = measurement.readings();
        let seconds = begin.elapsed().as_secs_f64() / readings.len().max(1) as f64;
        for reading in readings {
            let (Some(p), Some(d)) = (&reading.primal, &reading.dual) else { continue };
            let [ep, ed] = [p, d].map(|r| 100.0 * r.std_error / r.mean.abs());
            let name = format!(
                "{name}, {}: z of primal ({ep:.1} %) against dual ({ed:.1} %)",
                reading.name
            );
            let z = reading.duality_z.unwrap_or(f64::INFINITY);
            checks.push(Check { seconds, ..Check::run("duality", name, 0.0, f64::INFINITY, || z) });
        }
    }
    // Now that the size of the family is known.
    let limit = sidak_z(checks.len());
    for check in &mut checks {
        check.tolerance = limit;
        check.passed = check.value.abs() <= limit;
    }
    Ok(checks)
}

/// The same view with fewer pixels, enough for a reading: their mean is what is read.
fn small(mut camera: Camera) -> Camera {
    let shrink = (camera.width.max(camera.height) / 64).max(1);
    (camera.width, camera.height) =
        ((camera.width / shrink).max(1), (camera.height / shrink).max(1));
    camera
}
