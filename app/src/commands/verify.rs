//! `intrados verify`: the battery of exact checks (theory §7).

use std::{sync::Arc, time::Instant};

use glam::{Mat4, Vec3};
use intrados_light::{LitScene, Measurement, Sensor, Shard, Sides, battery, scene_rule};
use intrados_scene::{Camera, Lamp, LampKind, Material, Mesh, Meter, Object, Part, Scene, Surface, bundled};
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
    /// What could not be judged in the time that a check may take, and why.
    not_judged: Vec<String>,
}

/// What one part of the battery found.
#[derive(Debug, Default)]
struct Findings {
    checks: Vec<Check>,
    not_judged: Vec<String>,
}

impl From<Vec<Check>> for Findings {
    fn from(checks: Vec<Check>) -> Self {
        Self { checks, not_judged: Vec::new() }
    }
}

pub(crate) fn run(session: &Session) -> Result<Outcome, Failure> {
    let progress = session.watch("matrix problem");
    let parts: [(&str, fn(&Job) -> Result<Findings, Failure>); 5] = [
        ("matrix problem against its exact solution", |job| Ok(verify::checks(job)?.into())),
        ("sampling routines", sampling),
        ("furnace", furnace),
        ("duality of every kind of lamp", lamps),
        ("duality on the bundled scenes", duality),
    ];
    let mut all = Findings::default();
    for (label, part) in parts {
        session.job.relabel(label);
        let found = part(&session.job)?;
        all.checks.extend(found.checks);
        all.not_judged.extend(found.not_judged);
    }
    let Findings { checks, not_judged } = all;
    let passed = checks.iter().filter(|c| c.passed).count();
    let failed = checks.len() - passed;
    let report = Report { schema: "intrados.verify/1", version: env!("CARGO_PKG_VERSION"), checks, passed, failed, not_judged };
    drop(progress);
    session.print(&report, || report.table())?;
    Ok(if report.failed == 0 { Outcome::Done } else { Outcome::NotPassed })
}

/// χ² of every sampling routine: the p-value may not fall below Šidák's level for all of them together (1 % false alarms).
fn sampling(job: &Job) -> Result<Findings, Failure> {
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
    Ok(tests.into_iter().map(check).collect::<Vec<_>>().into())
}

const ESTIMATORS: [Estimator; 4] = [Estimator::Analog, Estimator::Collision, Estimator::LastEvent, Estimator::NextEvent];

/// Emitted radiance and reflectance of the furnace's walls.
const FURNACE: [f32; 2] = [0.75, 0.5];

/// A closed box whose walls all emit L_e and reflect ρ: L = L_e/(1 − ρ) everywhere, and π L on any patch. Each estimator from each side
/// must agree within its own error bar.
fn furnace(job: &Job) -> Result<Findings, Failure> {
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
    Ok(checks.into())
}

/// Passes of each case of the furnace.
const FURNACE_PASSES: u32 = 16;

fn furnace_scene() -> Scene {
    let mut walls = cuboid(Vec3::new(-1.0, -0.5, -0.75), Vec3::new(1.0, 0.5, 0.75));
    // Seen from inside, the fronts are the other sides.
    walls.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let [emission, albedo] = FURNACE.map(Vec3::splat);
    Scene {
        name: "furnace".into(),
        meshes: vec![Arc::new(walls)],
        materials: vec![Material { name: "wall".into(), base_colour: albedo, emission, ..Material::default() }],
        objects: vec![Object { name: "box".into(), mesh: 0, transform: Mat4::IDENTITY, material: 0, member: None, part: Part::Scenery }],
        cameras: vec![eye(Vec3::new(0.1, 0.2, -0.3), Vec3::new(0.3, -0.1, 0.5), 70.0)],
        meters: vec![Meter {
            name: "patch".into(),
            corner: Vec3::new(-0.2, -0.1, 0.0),
            u: Vec3::new(0.3, 0.0, 0.1),
            v: Vec3::new(0.0, 0.3, 0.1),
        }],
        ..Scene::default()
    }
}

/// A small picture.
fn eye(position: Vec3, target: Vec3, fov_deg: f32) -> Camera {
    Camera { name: "eye".into(), position, target, up: Vec3::Y, fov_deg, width: 16, height: 16, exposure: 0.0 }
}

/// A closed box between two corners, its fronts outside.
fn cuboid(lo: Vec3, hi: Vec3) -> Mesh {
    let pick = |i: usize, axis: usize| if i >> axis & 1 > 0 { hi[axis] } else { lo[axis] };
    // Each wall's corners anticlockwise seen from outside; bit k of a corner's number says which end of axis k it is at.
    let walls: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        positions: (0..8).map(|i| Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect(),
        triangles: walls.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// Passes of each side of each kind of lamp.
const LAMP_PASSES: u32 = 32;
/// Passes of each sensor of each bundled scene.
const DUALITY_PASSES: u32 = 24;
/// Most pixels along a side of the pictures that are compared.
const DUALITY_PIXELS: u32 = 32;

/// Every kind of lamp over a matt floor and a glossy block, seen by a camera from both sides.
fn lamps(job: &Job) -> Result<Findings, Failure> {
    let position = Vec3::new(0.3, 2.0, 1.0);
    let white = Vec3::new(3.0, 2.5, 2.0);
    let direction = Vec3::new(-0.1, -0.9, -0.4).normalize();
    let kinds = [
        ("surface", None),
        ("point", Some(LampKind::Point { position, intensity: white })),
        ("spot", Some(LampKind::Spot { position, direction, intensity: white, inner: 0.5, outer: 0.9 })),
        ("directional", Some(LampKind::Directional { direction, irradiance: white })),
        ("environment", Some(LampKind::Environment { radiance: white, image: None })),
    ];
    let mut found = Vec::new();
    for (i, (name, kind)) in kinds.into_iter().enumerate() {
        job.step(i, 5)?;
        let begin = Instant::now();
        let scene = Arc::new(block_scene(kind));
        let camera = Sensor::Camera(scene.cameras[0].clone());
        let lit = Arc::new(LitScene::build(scene, job)?);
        let mut measurement = Measurement::new(lit, vec![camera], Sides::Both, Rule::default(), 7, Shard::default(), None);
        measurement.advance_all(LAMP_PASSES);
        let z = measurement.readings().first().and_then(|r| r.duality_z).unwrap_or(f64::INFINITY);
        found.push((format!("duality: {name} lamp"), z, begin.elapsed().as_secs_f64()));
    }
    Ok(gaps(found).into())
}

/// A floor and a block on it; a shining square above where there is no other lamp.
fn block_scene(lamp: Option<LampKind>) -> Scene {
    let quad = |c: Vec3, u: Vec3, v: Vec3| {
        Arc::new(Mesh { positions: vec![c, c + u, c + u + v, c + v], triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() })
    };
    let object = |name: &str, mesh, material| Object {
        name: name.into(),
        mesh,
        transform: Mat4::IDENTITY,
        material,
        member: None,
        part: Part::Scenery,
    };
    let mut scene = Scene {
        name: "block".into(),
        meshes: vec![
            quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0),
            Arc::new(cuboid(Vec3::new(0.2, 0.0, -0.4), Vec3::new(0.9, 0.8, 0.5))),
            quad(Vec3::new(-0.25, 2.0, -0.25), Vec3::X * 0.5, Vec3::Z * 0.5),
        ],
        materials: vec![
            Material { name: "matt".into(), base_colour: Vec3::new(0.6, 0.5, 0.4), ..Material::default() },
            Material {
                name: "glossy".into(),
                base_colour: Vec3::new(0.8, 0.7, 0.5),
                surface: Surface::Metallic { metallic: 0.5, roughness: 0.4, texture: None },
                ..Material::default()
            },
            Material { name: "lamp".into(), surface: Surface::Black, emission: Vec3::splat(10.0), ..Material::default() },
        ],
        objects: vec![object("floor", 0, 0), object("block", 1, 1)],
        cameras: vec![eye(Vec3::new(0.0, 1.6, 4.0), Vec3::new(0.2, 0.4, 0.0), 45.0)],
        ..Scene::default()
    };
    match lamp {
        Some(kind) => scene.lamps.push(Lamp { name: "lamp".into(), kind }),
        None => scene.objects.push(object("lamp", 2, 2)),
    }
    scene
}

/// Every sensor of every bundled scene from both sides: z between the two, where both error bars may be trusted.
fn duality(job: &Job) -> Result<Findings, Failure> {
    let (mut found, mut not_judged) = (Vec::new(), Vec::new());
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
        for reading in readings {
            let complaint = [("primal", &reading.primal), ("dual", &reading.dual)]
                .into_iter()
                .find_map(|(side, r)| r.as_ref().filter(|r| !r.converged).map(|r| format!("{side}: {}", r.complaint)));
            match (complaint, reading.duality_z) {
                (None, Some(z)) => found.push((format!("duality: {name}, {}", reading.name), z, seconds)),
                (why, _) => {
                    not_judged.push(format!("duality: {name}, {}: {}", reading.name, why.unwrap_or_else(|| "too few walks".into())))
                }
            }
        }
    }
    Ok(Findings { checks: gaps(found), not_judged })
}

/// Duality gaps (name, z, seconds) as one family.
fn gaps(found: Vec<(String, f64, f64)>) -> Vec<Check> {
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
    found.into_iter().map(check).collect()
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
        let mut text = output::table(&rows.map_rows());
        self.not_judged.iter().for_each(|what| text += &format!("not judged: {what}\n"));
        text + &format!("{} passed, {} failed, {} not judged\n", self.passed, self.failed, self.not_judged.len())
    }
}
