//! `intrados verify`: the battery of exact checks (theory §7).

use std::{sync::Arc, time::Instant};

use glam::{Mat4, Vec3};
use intrados_light::{LitScene, Measurement, Sensor, Shard, Sides, battery, scene_rule};
use intrados_scene::{Camera, Material, Mesh, Meter, Object, Part, Scene, bundled};
use intrados_stage::Job;
use intrados_transport::{Check, Estimator, Rule, Side, chi2, verify};
use serde::Serialize;

use super::{render::MapRows, walks::estimator_name};
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

pub(crate) fn run(session: &Session) -> Result<Outcome, Failure> {
    let _progress = session.watch("matrix problem");
    let parts: [(&str, fn(&Job) -> Result<Vec<Check>, Failure>); 4] = [
        ("matrix problem against its exact solution", |job| Ok(verify::checks(job)?)),
        ("sampling routines", sampling),
        ("furnace", furnace),
        ("duality on the bundled scenes", duality),
    ];
    let mut checks = Vec::new();
    for (label, part) in parts {
        session.job.relabel(label);
        checks.extend(part(&session.job)?);
    }
    let passed = checks.iter().filter(|c| c.passed).count();
    let report = Report { schema: "intrados.verify/1", version: env!("CARGO_PKG_VERSION"), passed, failed: checks.len() - passed, checks };
    drop(_progress);
    session.print(&report, || report.table())?;
    Ok(if report.failed == 0 { Outcome::Done } else { Outcome::NotPassed })
}

/// χ² of every sampling routine: the p-value may not fall below Šidák's level for all of them together (1 % false alarms).
fn sampling(job: &Job) -> Result<Vec<Check>, Failure> {
    let begin = Instant::now();
    let tests = battery::battery();
    job.step(1, 1)?;
    let (each, level) = (begin.elapsed().as_secs_f64() / tests.len().max(1) as f64, chi2::sidak(0.01, tests.len()));
    let check = |(name, chi): (String, chi2::Chi2)| Check {
        name: format!("chi2 p-value: {name}"),
        kind: "sampling",
        value: chi.p_value,
        expected: 1.0,
        tolerance: 1.0 - level,
        passed: chi.p_value >= level,
        seconds: each,
    };
    Ok(tests.into_iter().map(check).collect())
}

const ESTIMATORS: [Estimator; 4] = [Estimator::Analog, Estimator::Collision, Estimator::LastEvent, Estimator::NextEvent];

/// Emitted radiance and reflectance of the furnace's walls.
const FURNACE: [f32; 2] = [0.75, 0.5];

/// A closed box whose walls all emit L_e and reflect ρ: L = L_e/(1 − ρ) everywhere, and π L on any patch. Each estimator from each side
/// must agree within its own error bar.
fn furnace(job: &Job) -> Result<Vec<Check>, Failure> {
    let scene = Arc::new(furnace_scene());
    let lit = Arc::new(LitScene::build(Arc::clone(&scene), job)?);
    let radiance = f64::from(FURNACE[0] / (1.0 - FURNACE[1]));
    let [camera, meter] = [Sensor::Camera(scene.cameras[0].clone()), Sensor::Meter(scene.meters[0].clone())];
    let mut cases = Vec::new();
    for estimator in ESTIMATORS {
        for side in Side::BOTH {
            cases.push((estimator, side, meter.clone(), std::f64::consts::PI * radiance));
            // A pinhole has no area: walks from the lamps find it by links alone.
            if side == Side::Primal || estimator == Estimator::NextEvent {
                cases.push((estimator, side, camera.clone(), radiance));
            }
        }
    }
    let bound = verify::sidak_z(cases.len());
    let mut checks = Vec::new();
    for (i, (estimator, side, sensor, expected)) in cases.iter().enumerate() {
        job.step(i, cases.len())?;
        let begin = Instant::now();
        let rule = Rule { estimator: *estimator, ..Rule::default() };
        let sides = if *side == Side::Primal { Sides::Primal } else { Sides::Dual };
        let mut measurement = Measurement::new(lit.clone(), vec![sensor.clone()], sides, rule, 3, Shard::default(), None);
        measurement.advance_all(FURNACE_PASSES);
        let Some(reading) = measurement.readings().into_iter().next() else { continue };
        let what = if matches!(sensor, Sensor::Camera(_)) { "picture" } else { "meter" };
        let side = if *side == Side::Primal { "primal" } else { "dual" };
        // Single precision leaves a few 1e-6 even where there is no variance.
        let tolerance = bound * reading.combined.std_error + 1e-5 * expected;
        let value = reading.combined.mean;
        checks.push(Check {
            name: format!("furnace: {what}, {side}, {}", estimator_name(*estimator)),
            kind: "furnace",
            value,
            expected: *expected,
            tolerance,
            passed: (value - expected).abs() <= tolerance,
            seconds: begin.elapsed().as_secs_f64(),
        });
    }
    Ok(checks)
}

/// Passes of each case of the furnace.
const FURNACE_PASSES: u32 = 16;

fn furnace_scene() -> Scene {
    let (lo, hi) = (Vec3::new(-1.0, -0.5, -0.75), Vec3::new(1.0, 0.5, 0.75));
    let corner =
        |i: usize| Vec3::new(if i & 1 > 0 { hi.x } else { lo.x }, if i & 2 > 0 { hi.y } else { lo.y }, if i & 4 > 0 { hi.z } else { lo.z });
    // Each wall's corners anticlockwise seen from inside.
    let walls: [[u32; 4]; 6] = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
    let triangles = walls.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let [emission, albedo] = FURNACE.map(Vec3::splat);
    Scene {
        name: "furnace".into(),
        meshes: vec![Arc::new(Mesh { positions: (0..8).map(corner).collect(), triangles, ..Mesh::default() })],
        materials: vec![Material { name: "wall".into(), base_colour: albedo, emission, ..Material::default() }],
        objects: vec![Object { name: "box".into(), mesh: 0, transform: Mat4::IDENTITY, material: 0, member: None, part: Part::Scenery }],
        cameras: vec![Camera {
            name: "eye".into(),
            position: Vec3::new(0.1, 0.2, -0.3),
            target: Vec3::new(0.3, -0.1, 0.5),
            up: Vec3::Y,
            fov_deg: 70.0,
            width: 16,
            height: 16,
            exposure: 0.0,
        }],
        meters: vec![Meter {
            name: "patch".into(),
            corner: Vec3::new(-0.2, -0.1, 0.0),
            u: Vec3::new(0.3, 0.0, 0.1),
            v: Vec3::new(0.0, 0.3, 0.1),
        }],
        ..Scene::default()
    }
}

/// Passes of each sensor of each bundled scene.
const DUALITY_PASSES: u32 = 24;
/// Most pixels along a side of the pictures that are compared.
const DUALITY_PIXELS: u32 = 32;

/// Every sensor of every bundled scene from both sides: z between the two, where both error bars may be trusted.
fn duality(job: &Job) -> Result<Vec<Check>, Failure> {
    let mut found = Vec::new();
    for (i, (name, _)) in bundled().iter().enumerate() {
        job.step(i, bundled().len())?;
        let scene = Arc::new(Scene::load_bundled(name, job)?);
        let lit = Arc::new(LitScene::build(Arc::clone(&scene), job)?);
        let small = |c: &Camera| Camera { width: c.width.min(DUALITY_PIXELS), height: c.height.min(DUALITY_PIXELS), ..c.clone() };
        let camera = scene.cameras.first().map(small).map(Sensor::Camera);
        let sensors: Vec<Sensor> = camera.into_iter().chain(scene.meters.iter().cloned().map(Sensor::Meter)).collect();
        let begin = Instant::now();
        let mut measurement = Measurement::new(lit, sensors, Sides::Both, scene_rule(&scene), 5, Shard::default(), None);
        for _ in 0..DUALITY_PASSES / 8 {
            job.step(i, bundled().len())?;
            measurement.advance_all(8);
        }
        let readings = measurement.readings();
        let seconds = begin.elapsed().as_secs_f64() / readings.len().max(1) as f64;
        let trusted = |r: &&intrados_light::MeterReading| [&r.primal, &r.dual].into_iter().flatten().all(|s| s.converged);
        found.extend(readings.iter().filter(trusted).filter_map(|r| Some((format!("duality: {name}, {}", r.name), r.duality_z?, seconds))));
    }
    let bound = verify::sidak_z(found.len());
    let check = |(name, z, seconds): (String, f64, f64)| Check {
        name,
        kind: "duality",
        value: z,
        expected: 0.0,
        tolerance: bound,
        passed: z.abs() <= bound,
        seconds,
    };
    Ok(found.into_iter().map(check).collect())
}

impl Report {
    fn table(&self) -> String {
        let mut rows = vec![["", "kind", "check", "value", "expected", "tolerance", "seconds"].map(String::from)];
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
        output::table(&rows.map_rows()) + &format!("{} passed, {} failed\n", self.passed, self.failed)
    }
}
