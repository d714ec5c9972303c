//! Worse evidence never says less harm, by the program as its user runs it.

use std::{fs, path::Path};

use super::{program, said};

const COLUMN: &str = r#"(schema: "intrados.scene/1", members: [(id: "C1", name: "C1", concrete: "C30/37",
  body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 5,
    reinforcement: (cover_mm: 47, bars: [Around(count: 8, diameter_mm: 20)], stirrups: (diameter_mm: 8, spacing_mm: 200))),
  exposure: (class: "XC4, XD3", years: 50))], supports: [(member: "C1", place: Start, hold: Fixed)])"#;

/// The JSON of a prediction of a column with some evidence.
fn predicted(folder: &Path, shows: &str) -> serde_json::Value {
    let scene = folder.join("scene.ron");
    fs::write(&scene, COLUMN).unwrap();
    let item = format!("(member: \"C1\", name: \"x\", along: 0.45, face: Front, shows: {shows})");
    let evidence = format!("(schema: \"intrados.evidence/1\", items: [{item}])");
    fs::write(folder.join("evidence.ron"), evidence).unwrap();
    let out = folder.join("out");
    let mut command = program();
    command.arg("predict").arg(&scene).arg("--out").arg(&out);
    let output = command.args(["--spp", "0", "--no-forecast"]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&fs::read(out.join("predict.json")).unwrap()).unwrap()
}

#[test]
fn wider_cracks_and_thinner_covers_never_say_less() {
    let folder = tempfile::tempdir().unwrap();
    let damage = |json: &serde_json::Value| json["members"][0]["damage"].as_f64().unwrap();
    let rust = |json: &serde_json::Value| {
        let survey = &json["members"][0]["evidence"]["survey"]["details"]["rust"];
        let zones = survey["probability_active"].as_array().unwrap();
        zones.iter().filter_map(serde_json::Value::as_f64).fold(0.0, f64::max)
    };
    let mut last = 0.0;
    for width in [0.2, 1.0, 3.0, 10.0, 100.0] {
        let shows = format!("Crack(width_mm: {width}, course: Across)");
        let found = damage(&predicted(folder.path(), &shows));
        assert!(found >= last, "{width} mm: {found} after {last}");
        last = found;
    }
    assert!(last >= 0.5, "{last}");
    let mut last = 0.0;
    for mm in [70, 45, 25, 10, 6] {
        let found = rust(&predicted(folder.path(), &format!("Cover(mm: {mm})")));
        assert!(found >= last, "cover {mm} mm: {found} after {last}");
        last = found;
    }
    assert!(last > 0.6, "{last}");
    let mut last = 0.0;
    for mm in [2, 20, 60, 90] {
        let found = rust(&predicted(folder.path(), &format!("Carbonation(mm: {mm})")));
        assert!(found >= last, "carbonation {mm} mm: {found} after {last}");
        last = found;
    }
}
