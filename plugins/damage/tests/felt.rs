//! Damage felt by gauges: planted zones in a beam and a column, found again from readings of a finer mesh with noise.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use glam::DVec3;
use intrados_damage::felt::{
    Felt, Settings, Simulation, felt_from,
    rig::{FACES, TENTHS, face_at, zone_at},
    simulate_with,
};
use intrados_scene::Scene;
use intrados_stage::{Job, random::Key};

/// Damage planted in one or two zones: smooth blobs, shifted against the zones.
#[derive(Debug)]
struct Planted {
    blobs: Vec<Blob>,
    /// By zone: mean damage over its volume.
    truth: Vec<f64>,
    zones: Vec<usize>,
}

#[derive(Debug)]
struct Blob {
    tenth: usize,
    face: usize,
    shift: f64,
    reach: f64,
    depth: f64,
    peak: f64,
}

impl Blob {
    /// Nearly flat within, falling off smoothly at the ends and towards the inside of the section; only the quarter at its face.
    fn at(&self, place: DVec3) -> f64 {
        if face_at(place) != self.face {
            return 0.0;
        }
        let middle = (self.tenth as f64 + 0.5 + self.shift) / TENTHS as f64;
        let along = (place.x - middle).abs() * 2.0 * TENTHS as f64 / self.reach;
        let inwards = (1.0 - place.y.abs().max(place.z.abs())) / self.depth;
        self.peak * fall(along) * fall(inwards)
    }
}

/// 1 up to 0.8, 0 from 1.2 on.
fn fall(t: f64) -> f64 {
    let u = ((t - 0.8) / 0.4).clamp(0.0, 1.0);
    1.0 - u * u * (3.0 - 2.0 * u)
}

impl Planted {
    fn new(seed: u64) -> Self {
        let key = Key::new(seed, 0xda3a6e);
        let count = 1 + usize::from(seed % 2 == 1);
        let mut zones: Vec<usize> = Vec::new();
        let mut dimension = 0;
        while zones.len() < count {
            let zone = (key.unit64(dimension) * (TENTHS * FACES) as f64) as usize;
            dimension += 1;
            if !zones.contains(&zone) {
                zones.push(zone);
            }
        }
        let mut planted = Self { blobs: Vec::new(), truth: Vec::new(), zones: zones.clone() };
        for (k, &zone) in zones.iter().enumerate() {
            let u = |i: u32| key.unit64(100 + 10 * k as u32 + i);
            let (tenth, face, severity) = (zone / FACES, zone % FACES, 0.1 + 0.5 * u(0));
            let shift = (0.2 * (u(1) - 0.5)).clamp(if tenth == 0 { 0.0 } else { -1.0 }, if tenth == TENTHS - 1 { 0.0 } else { 1.0 });
            let mut blob = Blob { tenth, face, shift, reach: 0.85 + 0.25 * u(2), depth: 0.85 + 0.3 * u(3), peak: 1.0 };
            // So that the mean over the zone is the severity.
            blob.peak = severity / means(&|p| blob.at(p))[zone];
            planted.blobs.push(blob);
        }
        planted.truth = means(&|p| planted.at(p));
        planted
    }

    fn at(&self, place: DVec3) -> f64 {
        1.0 - self.blobs.iter().map(|b| 1.0 - b.at(place).min(0.95)).product::<f64>()
    }
}

/// Means over the zones.
fn means(damage: &dyn Fn(DVec3) -> f64) -> Vec<f64> {
    const ALONG: usize = 20 * TENTHS;
    const ACROSS: usize = 40;
    let (mut sums, mut counts) = (vec![0.0; TENTHS * FACES], vec![0.0; TENTHS * FACES]);
    for i in 0..ALONG * ACROSS * ACROSS {
        let part = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        let across = |k: usize| 2.0 * part(k, ACROSS) - 1.0;
        let place = DVec3::new(part(i / ACROSS / ACROSS, ALONG), across(i / ACROSS % ACROSS), across(i % ACROSS));
        sums[zone_at(place)] += damage(place);
        counts[zone_at(place)] += 1.0;
    }
    sums.iter().zip(counts).map(|(s, n)| s / n).collect()
}

struct Outcome {
    /// Every planted zone is found and no other.
    right: bool,
    /// The worst zone's severity is within 0.1, and its error bar covers the truth.
    within: bool,
    covers: bool,
}

fn judge(planted: &Planted, felt: &Felt) -> Outcome {
    let found: Vec<usize> = (0..felt.zones.len()).filter(|&z| felt.zones[z].is_found()).collect();
    let mut zones = planted.zones.clone();
    zones.sort_unstable();
    let worst = planted.truth.iter().copied().fold(0.0, f64::max);
    let within =
        planted.zones.iter().all(|&z| (felt.zones[z].severity.value - planted.truth[z]).abs() <= 0.1 && felt.zones[z].probability > 0.0);
    Outcome { right: found == zones, within, covers: (felt.worst.value - worst).abs() <= 1.96 * felt.worst.std_error }
}

fn open(name: &str) -> Scene {
    let folder = std::env::var("FELT_SCENES").unwrap_or(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes").into());
    Scene::open(&Path::new(&folder).join(format!("{name}.ron")), &Job::default()).unwrap()
}

fn run(scene: &Scene, id: &str, seed: u64, settings: &Settings) -> Outcome {
    let member = scene.members.iter().position(|m| m.id == id).unwrap();
    let planted = Planted::new(seed);
    let simulation = Simulation { seed, ..Simulation::default() };
    let readings = simulate_with(scene, id, &|p| planted.at(p), &simulation, &Job::default()).unwrap().unwrap();
    let felt = felt_from(scene, member, &readings, true, settings, &Job::default()).unwrap().unwrap();
    let outcome = judge(&planted, &felt);
    let found: Vec<String> = (0..felt.zones.len())
        .filter(|&z| felt.zones[z].probability > 0.05)
        .map(|z| {
            format!(
                "{z}: p {:.2} d {:.3} ± {:.3}",
                felt.zones[z].probability, felt.zones[z].severity.value, felt.zones[z].severity.std_error
            )
        })
        .collect();
    let truth: Vec<String> = planted.zones.iter().map(|&z| format!("{z}: {:.3}", planted.truth[z])).collect();
    println!(
        "{id} {seed:4} {} {} {} truly {:32} worst {:.3} ± {:.3} chi2 {:.0}/{} solves {} [{}]",
        if outcome.right { "right" } else { "WRONG" },
        if outcome.within { "within" } else { "OUT   " },
        if outcome.covers { "covers" } else { "MISSES" },
        truth.join(", "),
        felt.worst.value,
        felt.worst.std_error,
        felt.chi2,
        felt.count,
        felt.solutions,
        found.join("; ")
    );
    outcome
}

/// Rehearsal: FELT_SEEDS of other seeds.
#[test]
#[ignore = "for choosing settings: minutes"]
fn rehearsal() {
    let count: u64 = std::env::var("FELT_SEEDS").ok().and_then(|s| s.parse().ok()).unwrap_or(6);
    let shape_error = std::env::var("FELT_SHAPE").ok().and_then(|s| s.parse().ok()).unwrap_or(Settings::default().shape_error);
    let settings = Settings { shape_error, ..Settings::default() };
    for (name, id) in [("column", "C4"), ("beam", "B3")] {
        if std::env::var("FELT_ONLY").is_ok_and(|only| only != id) {
            continue;
        }
        let scene = open(name);
        let mut sums = [0; 3];
        for seed in 1000..1000 + count {
            let o = run(&scene, id, seed, &settings);
            [o.right, o.within, o.covers].into_iter().zip(&mut sums).for_each(|(b, s)| *s += u64::from(b));
        }
        println!("{id}: right {} within {} covers {} of {count}", sums[0], sums[1], sums[2]);
    }
}

/// How far the inverse's mesh is from finer ones, over the noise.
#[test]
#[ignore = "for choosing settings"]
fn meshes() {
    use intrados_damage::felt::rig::Rig;
    use intrados_mechanics::{member::Meshing, model::Structure};
    use intrados_transport::Perturbed;
    for (name, id) in [("column", "C4"), ("beam", "B3")] {
        let scene = open(name);
        let all: Vec<Vec<f64>> = [0.1, 0.062, 0.05]
            .map(|h| {
                let rig = Rig::new(&scene, id, Meshing { element: Some(h) }).unwrap().unwrap();
                let structure = Structure::new(&rig.model).unwrap();
                let mut linear = rig.linear(&structure, &Job::default()).unwrap();
                linear.readings(&vec![0.0; rig.model.mesh.hexes.len()]).unwrap()
            })
            .to_vec();
        for test in 0..all[0].len() / 16 {
            let row = |h: usize| {
                (0..16)
                    .map(|g| {
                        let i = 16 * test + g;
                        let sd = (0.01 * all[1][i].abs()).max(if g < 12 { 0.5e-6 } else { 2e-6 });
                        format!("{:5.1}", (all[h][i] - all[1][i]) / sd)
                    })
                    .collect::<Vec<_>>()
                    .join(" ")
            };
            println!("{id} test {test:2} coarse {} | fine {}", row(0), row(2));
        }
    }
}
