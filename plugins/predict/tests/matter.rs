//! A member of wood lives elastic, and a life in which nothing happens to it proves nothing.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_damage::evidence::Sources;
use intrados_forecast::{FORECAST, Forecast};
use intrados_predict::{PredictSettings, Prediction, Predictor};
use intrados_scene::{
    Scene,
    import::{Told, import},
};
use intrados_stage::{Access, Job};

/// A beam of 6 × .4 × .2 m from a model, of wood of 24 MPa, on both ends, under `line` kN/m: what is
/// foretold and what is predicted.
fn of_wood(line: f64) -> (Forecast, Prediction) {
    let mut model = String::from("o beam 1\n");
    for corner in 0..8 {
        let side = |bit: u32, size: f64| if corner >> bit & 1 == 1 { size } else { 0.0 };
        model += &format!("v {} {} {}\n", side(0, 6.0), side(1, 0.4), side(2, 0.2));
    }
    model += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let folder = tempfile::tempdir().unwrap();
    let (path, out) = (folder.path().join("beam.obj"), folder.path().join("out"));
    std::fs::write(&path, model).unwrap();
    let told = Told { metres: Some(1.0), ..Told::default() };
    let job = Job::default();
    import(&path, &out, &told, &Access::default(), &job).unwrap();
    let file = out.join("scene.ron");
    let text = std::fs::read_to_string(&file).unwrap();
    let wood = "matter: (name: \"Holz C24\", modulus_gpa: 11, poisson: 0.3, density_kg_m3: 420, strength_mpa: 24), concrete: ";
    let id = Scene::load(&file, &job).unwrap().members[0].id.clone();
    let load = format!(
        "    loads: [(name: \"line\", members: [\"{id}\"], action: Line(force_kn_m: (0, -{line}, 0))),\n"
    );
    let text = text.replacen("concrete: ", wood, 1).replacen("    loads: [\n", &load, 1);
    // No bars; what import assumes are bearings that let it turn.
    let (before, rest) = text.split_once("reinforcement: ").unwrap();
    let text = format!("{before}{}", rest.split_once("\n").unwrap().1.trim_start());
    let text = text
        .replace("assumed: [Concrete, Exposure, Age, Reinforcement]", "assumed: [Exposure, Age]");
    assert!(text.contains(wood) && text.contains("\"line\""), "{text}");
    std::fs::write(&file, text).unwrap();
    let scene = Scene::load(&file, &job).unwrap();
    let mut predictor = Predictor::new(&scene, PredictSettings::default(), &Sources::default());
    while predictor.advance(&scene, &job).unwrap() {}
    let life = predictor.known_lives().values().flatten().next().unwrap().clone();
    (life, predictor.finish(&scene))
}

/// q L²/8 over W: 3 kN/m and its weight, .33, over 6 m and 5.33e-3 m³. A forecast has some 150
/// bricks of ∛(.48 m³/150), n = 3 across, whose outermost points of integration lie 1 − 1/n + 1/(n√3)
/// = .859 of the way to the edge: that much of the edge's stress, within 1 % (a brick that bends is
/// exact across, and the points next to the middle bear all but 1e-3 of its moment).
#[test]
fn wood_is_stressed_as_a_beam_and_is_not_called_sound() {
    let (life, told) = of_wood(3.0);
    let stressed = life.elastic.clone().unwrap();
    let by_hand = (3e3 + 420.0 * 9.81 * 0.08) * 36.0 / 8.0 / (0.2 * 0.16 / 6.0);
    let share = stressed.peak_pa / by_hand;
    let outermost = 1.0 - 1.0 / 3.0 + 1.0 / (3.0 * 3f64.sqrt());
    assert!((share / outermost - 1.0).abs() < 0.01, "{stressed:?}, by hand {by_hand}: {share}");
    assert_eq!(stressed.strength_pa, 24e6);
    assert_eq!(told.members[0].damage, None, "{:?}", told.members[0]);
    let item = told.items.iter().find(|item| item.source == FORECAST).unwrap();
    let why = item.why.as_deref().filter(|_| !item.used).unwrap();
    assert!(why.contains("24.0 MPa") && why.contains("decay"), "{why}");
}

/// Ten times that is more than it bears.
#[test]
fn wood_that_is_stressed_beyond_its_strength_is_damaged() {
    let (life, told) = of_wood(40.0);
    assert!(life.elastic.unwrap().peak_pa > 24e6);
    assert!(told.members[0].damage.is_some_and(|d| d > 0.05), "{:?}", told.members[0]);
}
