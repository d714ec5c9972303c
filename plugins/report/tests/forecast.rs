//! A member that nobody looked into, of which the scene says what attacks it and no more.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_damage::{Cause, Sources, verdict::Basis};
use intrados_forecast as forecast;
use intrados_mechanics::strength::Mode;
use intrados_predict::{PredictSettings, Prediction, predict};
use intrados_scene::{Scene, parametric::template};
use intrados_stage::{Estimate, Job};

/// The template's column in another exposure, on few bricks.
fn predicted(exposure: &str) -> (Scene, Prediction) {
    let text =
        template("column").unwrap().replace("exposure: (class: \"XC3\", years: 30)", exposure);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("column.ron");
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &Job::default()).unwrap();
    let forecast = Some(forecast::ForecastSettings {
        element_m: Some(0.2),
        ..forecast::ForecastSettings::default()
    });
    let prediction = predict(
        &scene,
        PredictSettings { forecast, ..PredictSettings::default() },
        &Sources::default(),
        &Job::default(),
    )
    .unwrap();
    (scene, prediction)
}

/// XD3 without chloride was "no corrosion, 0 % rusted away", and its state "sound, no action".
#[test]
fn salt_without_numbers_is_assumed_with_its_spread() {
    let (scene, mut prediction) = predicted("exposure: (class: \"XC4, XD3\", years: 30)");
    let member = &prediction.members[0];
    assert_eq!(member.basis, Basis::Forecast);
    assert!(member.state.starts_with("forecast: between"), "{}", member.state);
    assert!(
        member.advice.starts_with("Inspect") && !member.advice.contains("No action"),
        "{}",
        member.advice
    );
    let evidence = &member.evidence["forecast"];
    let steel = evidence.zones[&Cause::Steel].worst().unwrap().1;
    assert!(steel.value > 0.02 && steel.std_error > 0.5 * steel.value, "{steel:?}");
    assert!(
        evidence.basis.contains("assumed") && evidence.details["rust"]["attack"] == "chloride",
        "{}",
        evidence.basis
    );
    assert!(evidence.details["rust"]["depassivation_years"].as_f64().unwrap() < 30.0);
    its_course_passes_what_is_foretold(&evidence.details);
    // As if somebody had asked what it bears.
    let known = |value, std_error| Estimate { value, std_error };
    prediction.members[0].capacity = Some(forecast::Capacity {
        loads: vec!["jack".into()],
        load_factor: known(2.5, 0.25),
        sound: 3.0,
        cost: known(0.125, 0.0625),
        mode: Mode::DiagonalTension,
        because: "a crack opens".into(),
    });
    let folder = tempfile::tempdir().unwrap();
    let mut document = intrados_report::Document::of(&scene, prediction);
    intrados_report::write(
        folder.path(),
        &scene,
        &mut document,
        &[],
        None,
        &intrados_report::Provenance::default(),
        None,
    )
    .unwrap();
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    for text in [
        "Assumed, not measured",
        "fib Bulletin 34",
        "forecast only, nothing measured",
        "no slices were read",
    ] {
        assert!(read("report.html").contains(text), "{text}");
    }
    assert!(!read("report.html").contains("Sauvola"));
    assert!(!read("report.html").contains("foretold"));
    assert!(
        read("members.csv").contains(",forecast,")
            && read("members.csv").contains("assumed by exposure class")
    );
    let borne = ",worst zone,jack,2.5,0.25,diagonal tension,0.125,0.0625,\r\n";
    assert!(read("members.csv").ends_with(borne), "{}", read("members.csv"));
    assert!(read("report.html").contains("bears 2.50 ± 0.25 times jack"));
    assert!(read("damage.vtu").contains("measured"));
    assert!(read("damage.vtu").contains(&format!("scene hash {}", scene.hash)));
    let json: serde_json::Value = serde_json::from_str(&read("predict.json")).unwrap();
    let p = json["members"][0]["state_probability"].as_object().unwrap();
    assert!(
        (p.values().map(|v| v.as_f64().unwrap()).sum::<f64>() - 1.0).abs() < 1e-9
            && json["members"][0]["basis"] == "forecast"
    );
}

/// From its youth to the end of the forecast, by way of today; rust takes more and more.
fn its_course_passes_what_is_foretold(details: &serde_json::Map<String, serde_json::Value>) {
    let course: Vec<forecast::Passed> = serde_json::from_value(details["course"].clone()).unwrap();
    let [age, ahead] = ["age_years", "ahead_years"].map(|key| details[key].as_f64().unwrap());
    assert!(course.len() > 5, "{course:?}");
    assert!(course.is_sorted_by(|a, b| a.years < b.years), "{course:?}");
    for (when, years) in [("now", age), ("later", age + ahead)] {
        let passed = course.iter().find(|p| (p.years - years).abs() < 1e-3).expect(when);
        let foretold: Vec<forecast::Foretold> =
            serde_json::from_value(details[when].clone()).unwrap();
        for (passed, foretold) in passed.damage.iter().zip(&foretold) {
            assert!((passed - foretold.damage).abs() < 1e-9, "{when}: {passed} {foretold:?}");
        }
    }
    let worst = |p: &forecast::Passed| p.damage.iter().copied().fold(0.0, f64::max);
    let old = course.iter().filter(|p| p.years > 1.0);
    assert!(old.is_sorted_by(|a, b| worst(a) <= worst(b) + 0.02), "{course:?}");
}

/// Where no code knows, nothing is said of steel, and that is said.
#[test]
fn what_is_not_computed_is_not_nothing() {
    let (_, prediction) = predicted("exposure: (class: \"XD2\", years: 30)");
    let evidence = &prediction.members[0].evidence["forecast"];
    assert!(
        !evidence.zones.contains_key(&Cause::Steel) && evidence.basis.contains("not computed"),
        "{}",
        evidence.basis
    );
    assert!(
        evidence.details["rust"]["computed"] == false
            && evidence.details["rust"]["why_not"].as_str().unwrap().contains("XD2")
    );
    assert!(
        prediction.limits.iter().any(|l| l.contains("not computed for 1 member ")),
        "{:?}",
        prediction.limits
    );
}
