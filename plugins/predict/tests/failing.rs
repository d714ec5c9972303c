//! A life that ends by computation is the worst finding; one that ends by an assumption is told as
//! an assumption.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use std::fs;

use intrados_damage::Sources;
use intrados_forecast::ForecastSettings;
use intrados_predict::{PredictSettings, Prediction, predict};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Two stubs of plain concrete that carry some 1.5 MN each, ten years old, of which one is pressed.
fn predicted(force_kn: f64, history: &str, evidence: &str) -> Prediction {
    let folder = tempfile::tempdir().unwrap();
    let member = |id: &str, x: f64| {
        format!(
            "(id: \"{id}\", at: ({x}, 0, 0), concrete: \"C30/37\", \
              body: Column(section: Rectangle(width_m: 0.2, depth_m: 0.2), height_m: 0.4), \
              exposure: (class: \"XC1\", years: 10))"
        )
    };
    let support = |id: &str| {
        format!("(member: \"{id}\", place: Start, hold: Directions(x: true, y: true, z: true))")
    };
    let scene = format!(
        "(schema: \"intrados.scene/1\", members: [{}, {}], supports: [{}, {}], \
          loads: [(name: \"jack\", members: [\"B\"], \
            action: Force(place: End, force_kn: (0, -{force_kn}, 0)), history: [{history}])])",
        member("A", 0.0),
        member("B", 1.0),
        support("A"),
        support("B"),
    );
    fs::write(folder.path().join("scene.ron"), scene).unwrap();
    let evidence = format!("(schema: \"intrados.evidence/1\", items: [{evidence}])");
    fs::write(folder.path().join("evidence.ron"), evidence).unwrap();
    let job = Job::default();
    let scene = Scene::load(&folder.path().join("scene.ron"), &job).unwrap();
    // Stubs that are pressed evenly: on any bricks.
    let coarse = ForecastSettings { element_m: Some(0.1), ..ForecastSettings::default() };
    let settings = PredictSettings { forecast: Some(coarse), ..PredictSettings::default() };
    predict(&scene, settings, &Sources::default(), &job).unwrap()
}

/// From a load that is borne to one that is far beyond.
#[test]
fn overload_is_the_worst_finding_and_comes_first() {
    let mut last = 0.0;
    for force in [200.0, 600.0, 3000.0, 30_000.0] {
        for look in ["", "(member: \"B\", name: \"look\", shows: Intact)"] {
            let prediction = predicted(force, "(28, 0), (29, 1)", look);
            let [first, second] = [0, 1].map(|k| prediction.failing_first()[k]);
            let fails = force > 2000.0;
            assert_eq!(prediction.failures.len(), usize::from(fails), "{force} {look}");
            if !fails {
                continue;
            }
            assert_eq!((first.id.as_str(), second.id.as_str()), ("B", "A"));
            assert!(first.state.ends_with("severe"), "{}", first.state);
            assert!(first.state_probability["severe"] >= 0.8 && first.within_months == Some(0));
            let reason = &prediction.failures[0].reason;
            assert!(reason.contains("fails on day 2"), "{reason}");
            assert!(first.advice.contains(reason.trim_end_matches('.')), "{}", first.advice);
            assert!(
                prediction.limits[0].starts_with("B: By computation"),
                "{:?}",
                prediction.limits
            );
            assert!(second.failure.is_none() && !second.state.contains("severe"));
            let severe = first.state_probability["severe"];
            assert!(severe >= last * 0.999);
            last = severe;
        }
    }
}

/// The last time of a load's history is today: what failed under it on the way here says in which
/// year, and does not wait.
#[test]
fn failure_within_its_life_is_told_with_its_year() {
    let prediction = predicted(3000.0, "(0, 0), (3652, 0), (9131, 1)", "");
    let [failure] = &prediction.failures[..] else { panic!("{:?}", prediction.failures) };
    // From year 10 the load grows evenly to 3 MN in year 25; it bears .04 m² of 38 MPa, 1.5 MN.
    assert!(failure.ahead_years == 0.0 && failure.reason.contains("year 17"), "{failure:?}");
    let member = prediction.failing_first()[0];
    assert!(member.state.ends_with("severe") && member.within_months <= Some(12), "{member:?}");
}
