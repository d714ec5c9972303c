//! A certificate must not certify what is wrong: a lamp in a box behind a hole of millimetres
//! brings 62 % of what the eye sees, and walks that miss the hole agree with each other to a per
//! cent.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may fall over")]

use std::{fmt::Write as _, sync::Arc};

use intrados_light::{
    LitScene, Measurement, MeterReading, Render, RenderSettings, Sensor, Shard, Sides, learn,
};
use intrados_scene::Scene;
use intrados_stage::Job;
use intrados_transport::{Schedule, Steering, WalkRule};

/// What the eye sees in truth, W·m⁻²·sr⁻¹: by some 1e8 walks through a hole of 4 mm; the flux
/// through the smaller ones is the same.
const TRUTH: f64 = 0.69;

/// A grey room of 2 m with a lamp, and in it a box of .4 m with a hole of `hole` metres before a
/// lamp that sends `5.776e7 (1 mm / hole)²` W·m⁻²·sr⁻¹.
fn scene(hole: f64) -> LitScene {
    let h = 0.5 * hole;
    let mut quads = String::new();
    let mut quad = |corner: [f64; 3], u: [f64; 3], v: [f64; 3], light: f64| {
        let triple = |x: [f64; 3]| format!("({}, {}, {})", x[0], x[1], x[2]);
        let shine = if light > 0.0 {
            format!("emission: ({light}, {light}, {light})")
        } else {
            "material: \"grey\"".into()
        };
        let name = quads.len();
        let _ = write!(
            quads,
            "Quad(name: \"{name}\", corner: {}, u: {}, v: {}, {shine}),",
            triple(corner),
            triple(u),
            triple(v)
        );
    };
    for (corner, u, v) in [
        ([-1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]),
        ([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]),
        ([-1.0, 0.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]),
        ([1.0, 0.0, -1.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0]),
        ([-1.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
        ([-1.0, 0.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0]),
        // The box, and its front about the hole.
        ([-0.8, 0.2, 0.3], [0.0, 0.4, 0.0], [0.0, 0.0, 0.4]),
        ([-0.8, 0.2, 0.3], [0.4, 0.0, 0.0], [0.0, 0.0, 0.4]),
        ([-0.8, 0.6, 0.3], [0.4, 0.0, 0.0], [0.0, 0.0, 0.4]),
        ([-0.8, 0.2, 0.3], [0.4, 0.0, 0.0], [0.0, 0.4, 0.0]),
        ([-0.8, 0.2, 0.7], [0.4, 0.0, 0.0], [0.0, 0.4, 0.0]),
        ([-0.4, 0.2, 0.3], [0.0, 0.2 - h, 0.0], [0.0, 0.0, 0.4]),
        ([-0.4, 0.4 + h, 0.3], [0.0, 0.2 - h, 0.0], [0.0, 0.0, 0.4]),
        ([-0.4, 0.4 - h, 0.3], [0.0, 2.0 * h, 0.0], [0.0, 0.0, 0.2 - h]),
        ([-0.4, 0.4 - h, 0.5 + h], [0.0, 2.0 * h, 0.0], [0.0, 0.0, 0.2 - h]),
    ] {
        quad(corner, u, v, 0.0);
    }
    quad([-0.78, 0.35, 0.45], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], 5.776e7 * (1e-3 / hole).powi(2));
    quad([-0.25, 1.99, -0.25], [0.5, 0.0, 0.0], [0.0, 0.0, 0.5], 10.0);
    let text = format!(
        "(schema: \"intrados.scene/1\", title: \"Hole\", materials: [(name: \"grey\", colour: (0.7, 0.7, 0.7))], shapes: [{quads}], \
         cameras: [(name: \"eye\", position: (0.8, 1.2, -0.8), target: (-0.9, 0.6, 0.6), fov_deg: 60, width: 32, height: 32)])"
    );
    let path = std::env::temp_dir().join(format!(
        "intrados-hole-{}-{}.ron",
        std::process::id(),
        hole * 1e6
    ));
    std::fs::write(&path, text).unwrap();
    let job = Job::default();
    let scene = Scene::open(&path, &job).unwrap();
    std::fs::remove_file(&path).unwrap();
    LitScene::build(Arc::new(scene), &job).unwrap()
}

fn eye(lit: &LitScene) -> Vec<Sensor> {
    vec![Sensor::Camera(lit.scene.cameras[0].clone())]
}

/// Mean, standard error and certificate of each side and of both together.
fn results(reading: &MeterReading) -> impl Iterator<Item = (f64, f64, bool)> {
    let sides = [&reading.primal, &reading.dual].into_iter().flatten();
    let both = &reading.combined;
    sides.map(|r| (r.mean, r.std_error, r.converged)).chain([(
        both.mean,
        both.std_error,
        both.converged,
    )])
}

fn is_certified(reading: &MeterReading) -> bool {
    results(reading).any(|(_, _, converged)| converged)
}

/// Whether it says that it may be trusted although it is more than five standard errors wrong.
fn misleads(reading: &MeterReading) -> bool {
    results(reading)
        .any(|(mean, std_error, converged)| converged && (mean - TRUTH).abs() > 5.0 * std_error)
}

#[test]
fn light_behind_a_hole_is_not_certified_away() {
    let (mut doubted, mut certified) = (0, 0);
    for hole in [4e-3, 1e-3, 0.3e-3] {
        let lit = Arc::new(scene(hole));
        for seed in 1..=40 {
            let mut work = Measurement::new(
                Arc::clone(&lit),
                eye(&lit),
                Sides::Both,
                WalkRule::default(),
                seed,
                Shard::default(),
                Some(64),
            );
            while work.advance_all(16) {}
            let reading = &work.readings()[0];
            assert!(!misleads(reading), "{hole} m, seed {seed}: {reading:?}");
            certified += usize::from(is_certified(reading));
            // Its own scores say that all is well, and only what has not been met says that it is
            // not.
            let primal = reading.primal.as_ref().unwrap();
            doubted +=
                usize::from(primal.evidence.holds() && primal.complaint.contains("accounted"));
        }
    }
    // What README says: of 120 readings none is certified, from either side or both together.
    assert_eq!(certified, 0);
    // Without the certificate some hundred of the 120 would mislead.
    assert!(doubted > 60, "{doubted}");
}

fn picture(lit: &Arc<LitScene>, sides: Sides, seed: u64, samples: u64) -> Render {
    let settings = RenderSettings {
        sides,
        seed,
        samples: Some(samples),
        orders: false,
        ..RenderSettings::default()
    };
    let mut render = Render::new(Arc::clone(lit), &lit.scene.cameras[0], &settings);
    while render.advance(16) {}
    render
}

/// The mean of a picture from both sides is certified by the same rules.
#[test]
fn a_picture_of_a_hole_is_not_certified_either() {
    for hole in [4e-3, 1e-3, 0.3e-3] {
        let lit = Arc::new(scene(hole));
        for seed in 1..=40 {
            let summary = picture(&lit, Sides::Both, seed, 64).summary();
            let off = (summary.combined.mean - TRUTH).abs() / summary.combined.std_error;
            assert!(!summary.trust.is_settled() || off < 5.0, "{hole} m, seed {seed}: {summary:?}");
        }
    }
}

/// Steered to 2 % by sixteen seeds, none is satisfied and wrong.
fn steered(hole: f64) {
    let lit = Arc::new(scene(hole));
    for seed in 1..=16 {
        let guide = learn(
            &lit,
            &eye(&lit),
            WalkRule::default(),
            seed,
            Steering::Auto,
            Schedule::default(),
            &Job::default(),
        )
        .unwrap();
        let work = Measurement::new(
            Arc::clone(&lit),
            eye(&lit),
            Sides::Both,
            WalkRule::default(),
            seed,
            Shard::default(),
            None,
        );
        let mut work = work.guided(Arc::new(guide));
        let reading = loop {
            work.advance_all(8);
            let reading = work.readings().remove(0);
            assert!(!misleads(&reading), "{hole} m, seed {seed}: {reading:?}");
            if reading.combined.converged
                && reading.combined.std_error < 0.02 * reading.combined.mean
                || work.rounds() > 128
            {
                break reading;
            }
        };
        println!(
            "{hole} m, seed {seed}: {:.3} ± {:.3}, {}",
            reading.combined.mean, reading.combined.std_error, reading.combined.complaint
        );
    }
}

#[test]
#[ignore = "twenty CPU-minutes"]
fn steered_through_a_hole_of_4_mm_none_is_certified_wrongly() {
    steered(4e-3);
}

#[test]
#[ignore = "twenty CPU-minutes"]
fn steered_through_a_hole_of_1_mm_none_is_certified_wrongly() {
    steered(1e-3);
}

#[test]
#[ignore = "twenty CPU-minutes"]
fn steered_through_a_hole_of_a_third_of_a_millimetre_none_is_certified_wrongly() {
    steered(0.3e-3);
}

/// Where both sides have been everywhere, nothing is missing.
#[test]
fn a_plain_room_raises_no_alarm() {
    for name in ["room", "cornell"] {
        let job = Job::default();
        let lit = Arc::new(
            LitScene::build(Arc::new(Scene::load_bundled(name, &job).unwrap()), &job).unwrap(),
        );
        let mut work = Measurement::new(
            Arc::clone(&lit),
            eye(&lit),
            Sides::Both,
            WalkRule::default(),
            3,
            Shard::default(),
            Some(16),
        );
        while work.advance_all(16) {}
        let reading = &work.readings()[0];
        assert!(reading.combined.converged, "{name}: {reading:?}");
        let trust = picture(&lit, Sides::Both, 3, 64).summary().trust;
        assert!(trust.is_certified(), "{name}: {trust:?}");
    }
}

/// One side alone has nobody to vouch for it, and says so.
#[test]
fn one_side_alone_is_not_certified() {
    let job = Job::default();
    let lit = Arc::new(
        LitScene::build(Arc::new(Scene::load_bundled("room", &job).unwrap()), &job).unwrap(),
    );
    let mut work = Measurement::new(
        Arc::clone(&lit),
        eye(&lit),
        Sides::Primal,
        WalkRule::default(),
        3,
        Shard::default(),
        Some(16),
    );
    while work.advance_all(16) {}
    let reading = &work.readings()[0];
    let primal = reading.primal.as_ref().unwrap();
    assert!(
        primal.evidence.holds() && !primal.converged && primal.complaint.contains("one side"),
        "{primal:?}"
    );
    // Nor is a picture, but its own scores have settled.
    let trust = picture(&lit, Sides::Primal, 3, 64).summary().trust;
    assert!(
        trust.is_settled() && !trust.is_certified() && trust.words().contains("one side"),
        "{trust:?}"
    );
}
