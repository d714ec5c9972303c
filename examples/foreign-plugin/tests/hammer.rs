//! The plugin's evidence through the whole program: table, JSON, CSV and report.

use std::{path::Path, process::Command};

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    members: [
        (id: "C1", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37"),
        (id: "C2", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37", at: (2, 0, 0)),
    ],
)"#;

/// Runs the program on the scene with this table beside it. What it prints, and the folder that it
/// writes.
fn predict(folder: &Path, table: &str) -> (serde_json::Value, String) {
    std::fs::write(folder.join("two.ron"), SCENE).expect("a scene");
    std::fs::write(folder.join("rebound.csv"), table).expect("a table");
    let run = Command::new(env!(concat!("CARGO_BIN_EXE_", env!("CARGO_PKG_NAME"))))
        .args(["predict", "two.ron", "--spp", "0", "--out", "out", "--format", "json", "--quiet"])
        .current_dir(folder)
        .output()
        .expect("the program runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let report = std::fs::read_to_string(folder.join("out/report.html")).expect("a report");
    (serde_json::from_slice(&run.stdout).expect("JSON"), report)
}

#[test]
fn a_hammer_speaks_in_table_json_and_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = "member,along,rebound,scatter,strokes,sound\nC1,0.25,33,2,12,46\nC1,0.75,46,2,12,46\n";
    let (json, report) = predict(folder.path(), table);
    let [one, other] = [0, 1].map(|i| &json["members"][i]);
    // 1 − (1.73·33 − 34.5)/(1.73·46 − 34.5)
    let damage = one["evidence"]["hammer"]["damage"].as_f64().expect("a number");
    assert!((damage - 22.49 / 45.08).abs() < 1e-9, "{damage}");
    assert!(one["basis"] == "measured" && other["damage"].is_null(), "{one} {other}");
    let items: Vec<_> = json["items"].as_array().expect("a ledger").iter().filter(|i| i["source"] == "hammer").collect();
    assert!(items.len() == 2 && items.iter().all(|i| i["used"] == true), "{items:?}");
    let csv = std::fs::read_to_string(folder.path().join("out/evidence.csv")).expect("a table");
    assert!(csv.contains("12 strokes at 0.25 of the axis") && report.contains("hammer"), "{csv}");
}

#[test]
fn a_table_that_cannot_be_read_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let (json, report) = predict(folder.path(), "member,along,rebound,scatter,strokes,sound\nC9,0.25,33,2,12,46\n");
    let item = json["items"].as_array().expect("a ledger").iter().find(|i| i["source"] == "hammer").expect("an item");
    let why = item["why"].as_str().expect("a reason");
    assert!(item["used"] == false && why.contains("line 2: no member has the id \"C9\""), "{why}");
    assert!(report.contains("line 2: no member has the id"));
}
