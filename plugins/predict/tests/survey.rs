//! What was surveyed on a member, from its file to the prediction.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use std::fs;

use intrados_damage::{Cause, Sources, grading::Profile};
use intrados_predict::{PredictError, PredictSettings, Prediction, Predictor, predict};
use intrados_scene::Scene;
use intrados_stage::{Job, file::Set};

/// A column of .4 × .4 × 5 m with eight bars of 20 mm under 40 mm, thirty years old.
fn predicted(exposure: &str, items: &str) -> Prediction {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!(
        "(schema: \"intrados.scene/1\", members: [(id: \"C1\", name: \"C1\", concrete: \"C30/37\", \
         body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 5, \
         reinforcement: (cover_mm: 32, bars: [Around(count: 8, diameter_mm: 20)], stirrups: (diameter_mm: 8, spacing_mm: 200))), \
         exposure: (class: \"{exposure}\", years: 30))], supports: [(member: \"C1\", place: Start, hold: Fixed)])"
    );
    fs::write(folder.path().join("scene.ron"), scene).unwrap();
    let evidence = format!("(schema: \"intrados.evidence/1\", items: [{items}])");
    fs::write(folder.path().join("evidence.ron"), evidence).unwrap();
    let job = Job::default();
    let scene = Scene::load(&folder.path().join("scene.ron"), &job).unwrap();
    let settings = PredictSettings { forecast: None, ..PredictSettings::default() };
    predict(&scene, settings, &Sources::default(), &job).unwrap()
}

fn item(name: &str, along: f64, shows: &str) -> String {
    format!("(member: \"C1\", name: \"{name}\", along: {along}, face: Front, shows: {shows})")
}

/// Share of the steel that is gone where it was looked at.
fn steel(prediction: &Prediction) -> [f64; 2] {
    let survey = &prediction.members[0].evidence["survey"];
    let zone = survey.zones[&Cause::Steel].0[4].unwrap();
    [zone.value, zone.std_error]
}

#[test]
fn every_item_is_in_the_ledger_and_readings_move_what_they_speak_of() {
    let rusts = [
        item("pot", 0.45, "HalfCell(mv: -420)"),
        item("split", 0.45, "Crack(width_mm: 0.8, course: Along)"),
    ];
    // All around, since one face says little of the others.
    let look = "(member: \"C1\", name: \"look\", along: 0.45, shows: Intact)".to_owned();
    let sound = [item("pot", 0.45, "HalfCell(mv: -90)"), look];
    let [bad, good] = [rusts, sound].map(|items| predicted("XC4, XD3", &items.join(", ")));
    for prediction in [&bad, &good] {
        assert!(prediction.items.iter().all(|i| i.used && i.source == "survey"));
        assert_eq!(prediction.items.len(), 2);
    }
    assert!(steel(&bad)[0] > 0.03 && steel(&bad)[0] > 10.0 * steel(&good)[0], "{:?}", steel(&bad));
    assert!(steel(&good)[1] < 0.05, "{:?}", steel(&good));
    let defects: Vec<&str> = bad.members[0].defects.iter().map(|d| d.kind).collect();
    assert_eq!(defects, ["crack along"]);
    assert!(good.members[0].defects.is_empty());
    // Far from the place nobody is told anything about steel.
    assert!(bad.members[0].evidence["survey"].zones[&Cause::Steel].0[9].is_none());
}

/// A profile of salt where the class knows none, and a class that nobody named.
#[test]
fn what_cannot_be_weighed_says_why() {
    let salt = item("dust", 0.45, "Chloride(depths_mm: [10, 30], percent_of_cement: [1.0, 0.4])");
    let prediction = predicted("XC4", &salt);
    let ledger = &prediction.items[0];
    assert!(!ledger.used && ledger.why.as_ref().unwrap().contains("XD or XS"), "{ledger:?}");
    let prediction = predicted("XF1", &item("pot", 0.45, "HalfCell(mv: -420)"));
    let why = prediction.items[0].why.clone().unwrap();
    assert!(why.contains("speaks of rust") && why.contains("XF1"), "{why}");
    assert_eq!(prediction.members[0].state, "no evidence");
}

/// An instrument is held to one place, and somebody must say to which.
#[test]
fn a_reading_from_nowhere_is_not_used() {
    let prediction = predicted("XC4", "(member: \"C1\", name: \"pot\", shows: HalfCell(mv: -420))");
    let why = prediction.items[0].why.clone().unwrap();
    assert!(why.contains("add along") && prediction.members[0].damage.is_none(), "{why}");
}

/// Two stubs of bad concrete, of which a jack presses A alone.
fn stubs() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let stub = |id: &str, x: f64| {
        format!(
            "(id: \"{id}\", name: \"stub {id}\", at: ({x}, 0, 0), concrete: \"C30/37\", body: Column(section: Rectangle(width_m: 0.2, depth_m: 0.2), height_m: 0.4))"
        )
    };
    let held = |id: &str| {
        format!("(member: \"{id}\", place: Start, hold: Directions(x: true, y: true, z: true))")
    };
    let scene = format!(
        "(schema: \"intrados.scene/1\", members: [{}, {}], supports: [{}, {}], \
         loads: [(name: \"jack\", members: [\"A\"], action: Force(place: End, force_kn: (0, -100, 0)), history: [(28, 0), (29, 1)])])",
        stub("A", 0.0),
        stub("B", 2.0),
        held("A"),
        held("B")
    );
    fs::write(folder.path().join("scene.ron"), scene).unwrap();
    let core = |id: &str| {
        format!(
            "(member: \"{id}\", name: \"core {id}\", along: 0.45, face: Front, shows: CoreStrength(mpa: 16, diameter_mm: 100, length_mm: 200))"
        )
    };
    let evidence =
        format!("(schema: \"intrados.evidence/1\", items: [{}, {}])", core("A"), core("B"));
    fs::write(folder.path().join("evidence.ron"), evidence).unwrap();
    Scene::load(&folder.path().join("scene.ron"), &Job::default()).unwrap()
}

/// What grades by strength.
fn by_strength() -> PredictSettings {
    let profile = Profile { by_strength: true, ..Profile::default() };
    PredictSettings { profile, forecast: None, ..PredictSettings::default() }
}

/// By a profile that grades by strength a stub under a jack has the damage that its bad concrete
/// costs, and the states of that; one that nothing presses has that of its worst zone, which is said.
#[test]
fn what_damage_costs_is_graded_or_it_is_said_that_it_is_not() {
    let prediction =
        predict(&stubs(), by_strength(), &Sources::default(), &Job::default()).unwrap();
    let [a, b] = &prediction.members[..] else { panic!() };
    let cost = a.capacity.as_ref().unwrap().cost;
    assert!(a.by_strength && a.damage == Some(cost.value) && cost.value > 0.1, "{:?}", a.capacity);
    // No crack was seen: its states are what its damage alone says.
    assert_eq!(a.states, a.state_probability);
    assert!(!b.by_strength && b.capacity.is_none() && b.damage.is_some());
    let told = |line: &str| prediction.limits.iter().any(|l| l.contains(line));
    assert!(told("Not graded by strength") && told("is not computed: stub B."));
    assert!(told("member's strength that what is known of it costs"), "{:?}", prediction.limits);
}

/// A run that goes on from another computes no strength again, unless it knows of other losses.
#[test]
fn strengths_are_kept_with_the_losses_that_they_were_computed_with() {
    let (scene, folder) = (stubs(), tempfile::tempdir().unwrap());
    let run = |settings: PredictSettings, job: &Job| {
        let mut parts = Set::resume(folder.path(), "key").unwrap();
        let mut predictor = Predictor::new(&scene, settings, &Sources::default());
        while predictor.advance_kept(&scene, &mut parts, "stubs", job)? {}
        Ok::<_, PredictError>(predictor.finish(&scene).members)
    };
    let first = run(by_strength(), &Job::default()).unwrap();
    assert!(first[0].capacity.is_some());
    // Nothing can be computed any more.
    let cancelled = Job::default();
    cancelled.cancel();
    assert_eq!(run(by_strength(), &cancelled).unwrap(), first);
    let mut surer = by_strength();
    surer.profile.fusion.unknown.clear();
    assert!(matches!(run(surer, &cancelled), Err(PredictError::Cancelled(_))));
}

/// Half the strength that the class promises, in three cores of one place.
#[test]
fn cores_speak_of_strength() {
    let core = "CoreStrength(mpa: 16, diameter_mm: 100, length_mm: 200)";
    let items: Vec<String> = (0..3).map(|k| item(&format!("core {k}"), 0.45, core)).collect();
    let prediction = predicted("XC4", &items.join(", "));
    let zone = prediction.members[0].evidence["survey"].zones[&Cause::Concrete].0[4].unwrap();
    // .85 · 38 MPa are promised.
    assert!((zone.value - (1.0 - 16.0 / 32.3)).abs() < 0.02, "{zone:?}");
    assert!((0.1..0.35).contains(&zone.std_error), "{zone:?}");
}

/// From the finest to the widest, by every course, error and number: the whole prediction's damage.
#[test]
fn wider_cracks_never_do_less_damage() {
    for course in ["Across", "Diagonal", "Map"] {
        for error in ["", ", std_error_mm: 0.05", ", std_error_mm: 1"] {
            for beside in ["", ", std_error_mm: 0.1"] {
                let mut last = 0.0;
                for width in [0.05, 0.2, 0.5, 1.0, 3.0, 10.0, 100.0] {
                    let crack = |name: &str, width: f64, error: &str| {
                        let shows = format!("Crack(width_mm: {width}, course: {course}{error})");
                        item(name, 0.45, &shows)
                    };
                    let mut items = vec![crack("knob", width, error)];
                    if !beside.is_empty() {
                        items.push(crack("other", 0.1, beside));
                    }
                    let damage = predicted("XC4", &items.join(", ")).members[0].damage.unwrap();
                    assert!(damage >= last, "{course} {error} {width}: {damage} after {last}");
                    last = damage;
                }
                assert!(last >= 0.4, "{course} {error}: {last}");
            }
        }
    }
}

/// From the thickest to the thinnest, once and many times; and of carbonation.
#[test]
fn thinner_covers_and_deeper_fronts_never_say_less_rust() {
    let active = |items: &[String], class: &str| -> f64 {
        let prediction = predicted(class, &items.join(", "));
        let rust = &prediction.members[0].evidence["survey"].details["rust"];
        let zones = rust["probability_active"].as_array().unwrap();
        zones.iter().filter_map(serde_json::Value::as_f64).fold(0.0, f64::max)
    };
    for count in [1, 28] {
        let mut last = 0.0;
        for mm in [70, 55, 45, 35, 25, 15, 10, 6] {
            let one = |k: usize| item(&format!("c{k}"), 0.45, &format!("Cover(mm: {mm})"));
            let found = active(&(0..count).map(one).collect::<Vec<_>>(), "XD3");
            assert!(found >= last, "{count} × {mm} mm: {found} after {last}");
            last = found;
        }
        assert!(last > 0.6, "{count}: {last}");
    }
    let mut last = 0.0;
    for mm in [2, 10, 20, 30, 45, 60, 90] {
        let front = item("front", 0.45, &format!("Carbonation(mm: {mm})"));
        let found = active(&[front], "XC4");
        assert!(found >= last, "{mm} mm: {found} after {last}");
        last = found;
    }
    assert!(last > 0.9, "{last}");
}

/// Cracks that the exposure class admits are to be watched; wider ones are not.
#[test]
fn hairlines_are_watched() {
    let cracked = |width: f64| {
        let shows = format!("Crack(width_mm: {width}, course: Across, std_error_mm: 0.05)");
        let prediction = predicted("XC4", &item("crack", 0.45, &shows));
        prediction.members[0].clone()
    };
    let mut last = u32::MAX;
    for width in [0.05, 0.1, 0.2, 0.3, 0.35, 0.5, 1.0, 5.0] {
        let member = cracked(width);
        let is_watched = member.advice.starts_with("Monitor");
        assert_eq!(is_watched, width <= 0.3, "{width}: {}", member.advice);
        assert!(!is_watched || member.state == "between sound and fair", "{}", member.state);
        let months = member.within_months.unwrap();
        assert!(months > 0 || member.state_probability["severe"] >= 0.5, "{width}: {months}");
        assert!(months <= last, "{width}: {months} after {last}");
        last = months;
    }
}

/// The more faces were looked at and found intact, the less is left to do.
#[test]
fn a_look_at_more_faces_is_never_more_urgent() {
    let mut last = 0;
    for faces in 1..=4 {
        let names = ["Front", "Right", "Back", "Left"];
        let one = |name: &&str| {
            format!("(member: \"C1\", name: \"{name}\", face: {name}, shows: Intact)")
        };
        let items: Vec<String> = names[..faces].iter().map(one).collect();
        let prediction = predicted("XC4", &items.join(", "));
        let member = &prediction.members[0];
        let months = member.within_months.unwrap();
        assert!(months >= 24 && months >= last, "{faces}: {months} {}", member.advice);
        assert!(!member.advice.contains("treat it as"), "{faces}: {}", member.advice);
        last = months;
    }
}
