//! Lives of members that bear as one.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use std::sync::Arc;

use intrados_damage::evidence::Sources;
use intrados_forecast::{Forecast, ForecastSettings};
use intrados_predict::{PredictSettings, Predictor};
use intrados_scene::{
    Scene,
    structure::{Sample, Series},
};
use intrados_stage::Job;

/// Of the gauges at half the height of a column, degrees.
const SIDES: [u32; 4] = [0, 90, 180, 270];

/// Two columns of .4 × .4 m with a beam of 20 kN/m and 8.4 m on them.
fn lives(joints: &str) -> (Vec<Forecast>, Vec<String>) {
    let column = |id: &str, x: f64| {
        format!(
            "(id: \"{id}\", at: ({x}, 0, 0), concrete: \"C30/37\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3))"
        )
    };
    let gauge = |side: u32| {
        format!(
            "(name: \"{side}\", member: \"A\", along: 0.5, angle_deg: {side}, measures: Strain(Axial))"
        )
    };
    let gauges = SIDES.map(gauge).join(", ");
    let text = format!(
        "(schema: \"intrados.scene/1\", members: [{}, {}, (id: \"B\", at: (-0.2, 3.3, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 8.4))], \
         {joints} supports: [(member: \"A\", place: Bottom, hold: Fixed), (member: \"C\", place: Bottom, hold: Fixed), (member: \"B\", place: Start, hold: Fixed, alone: {})], \
         loads: [(name: \"deck\", members: [\"B\"], action: Line(force_kn_m: (0, -20, 0)))], gauges: [{gauges}])",
        column("A", 0.0),
        column("C", 8.0),
        !joints.is_empty(),
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.ron");
    std::fs::write(&path, text).unwrap();
    let job = Job::default();
    let mut scene = Scene::load(&path, &job).unwrap();
    // What is monitored is told of a life.
    let sample = Sample {
        date: "2026-01-01".parse().unwrap(),
        value: 0.0,
        std_error: 1e-6,
        temperature_c: None,
    };
    Arc::make_mut(&mut scene.structure)
        .series
        .extend(SIDES.map(|side| Series { gauge: side.to_string(), samples: vec![sample] }));
    // The mean of a section is in equilibrium with its load on any bricks.
    let coarse = ForecastSettings { element_m: Some(0.2), ..ForecastSettings::default() };
    let settings = PredictSettings { forecast: Some(coarse), ..PredictSettings::default() };
    let mut predictor = Predictor::new(&scene, settings, &Sources::default());
    while predictor.advance(&scene, &job).unwrap() {}
    let limits = predictor.finish(&scene).limits;
    (predictor.known_lives().values().flatten().cloned().collect(), limits)
}

/// On a hinge and a bearing each column takes half of 168 kN, 525 kPa: at half its height, two and
/// more sides from where the load comes and from the foot, in the mean of its four faces. Where nobody
/// says that they bear as one, its own weight is all.
#[test]
fn a_column_carries_what_the_beam_hands_to_it() {
    let of = |lives: &[Forecast]| lives.iter().find(|l| l.id == "A").unwrap().clone();
    // E_cm of C30/37, EN 1992-1-1, table 3.1.
    let modulus = 22e9 * 3.8_f64.powf(0.3);
    let pressed = |life: &Forecast| {
        let strains: Vec<f64> = life.gauges.iter().map(|g| g.elastic).collect();
        assert_eq!(strains.len(), SIDES.len());
        -modulus * strains.iter().sum::<f64>() / strains.len() as f64
    };
    let joints =
        "joints: [(of: (\"B\", \"A\"), kind: Hinge), (of: (\"B\", \"C\"), kind: Bearing)],";
    let (joined, limits) = lives(joints);
    let joined = of(&joined);
    assert!(joined.notes.iter().any(|n| n.contains("of the whole")));
    assert!(limits.iter().any(|l| l.contains("hand loads on")), "{limits:?}");
    let (apart, limits) = lives("");
    let more = pressed(&joined) - pressed(&of(&apart));
    assert!((more / 525e3 - 1.0).abs() < 0.2, "{more} Pa more than by itself");
    assert!(!limits.iter().any(|l| l.contains("hand loads on")), "{limits:?}");
}
