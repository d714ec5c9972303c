//! Lives of members that bear as one.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use intrados_damage::evidence::Sources;
use intrados_forecast::Forecast;
use intrados_predict::{PredictSettings, Predictor};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Two columns of .4 × .4 m with a beam of 20 kN/m and 8.4 m on them.
fn lives(joints: &str) -> (Vec<Forecast>, Vec<String>) {
    let column = |id: &str, x: f64| {
        format!(
            "(id: \"{id}\", at: ({x}, 0, 0), concrete: \"C30/37\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3))"
        )
    };
    let text = format!(
        "(schema: \"intrados.scene/1\", climate: (humidity_percent: 100), members: [{}, {}, (id: \"B\", at: (-0.2, 3.3, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 8.4))], \
         {joints} supports: [(member: \"A\", place: Bottom, hold: Fixed), (member: \"C\", place: Bottom, hold: Fixed), (member: \"B\", place: Start, hold: Fixed, alone: {})], \
         loads: [(name: \"deck\", members: [\"B\"], action: Line(force_kn_m: (0, -20, 0)))])",
        column("A", 0.0),
        column("C", 8.0),
        !joints.is_empty(),
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.ron");
    std::fs::write(&path, text).unwrap();
    let job = Job::default();
    let scene = Scene::load(&path, &job).unwrap();
    let mut predictor = Predictor::new(&scene, PredictSettings::default(), &Sources::default());
    while predictor.advance(&scene, &job).unwrap() {}
    let limits = predictor.finish(&scene).limits;
    (predictor.known_lives().values().flatten().cloned().collect(), limits)
}

/// On a hinge and a bearing each column takes half of 168 kN, 525 kPa in the mean, and the patch
/// that it comes by and the held foot make more of it somewhere. Where nobody says that they bear as
/// one, its own weight is all. In wet air, where nothing dries: what cracks at the foot then stands
/// under more by itself.
#[test]
fn a_column_carries_what_the_beam_hands_to_it() {
    let of = |lives: &[Forecast]| lives.iter().find(|l| l.id == "A").unwrap().clone();
    let joints =
        "joints: [(of: (\"B\", \"A\"), kind: Hinge), (of: (\"B\", \"C\"), kind: Bearing)],";
    let (joined, limits) = lives(joints);
    let pressed = -of(&joined).peak_compression_pa;
    assert!(of(&joined).notes.iter().any(|n| n.contains("of the whole")));
    assert!(limits.iter().any(|l| l.contains("hand loads on")), "{limits:?}");
    let (apart, limits) = lives("");
    let more = pressed + of(&apart).peak_compression_pa;
    assert!((1.0..2.5).contains(&(more / 525e3)), "{pressed}, {more} more than by itself");
    assert!(!limits.iter().any(|l| l.contains("hand loads on")), "{limits:?}");
}
