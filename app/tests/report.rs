//! The report of `intrados predict` as its owner meets it.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{fs, path::Path};

use common::{run, text};
use serde_json::Value;

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    project: (structure: "Bridge 7", owner: "The county", inspected: "2025-01-01"),
    members: [
        (id: "C1", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37", exposure: (class: "XC4", years: 30)),
        (id: "B1", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 6), at: (4, 3, 0), turn_deg: 31, concrete: "C30/37", exposure: (class: "XC4", years: 30)),
        (id: "B2", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 6), at: (4, 3, 4), concrete: "C30/37", exposure: (class: "XC4", years: 30)),
    ],
)"#;

/// One crack at three inspections, which was wider before it was filled; of the column one half
/// was seen, and nothing found.
const EVIDENCE: &str = r#"(
    schema: "intrados.evidence/1",
    items: [
        (member: "B1", name: "crack, 2016", date: "2016-05-03", along: 0.4, face: Bottom, shows: Crack(width_mm: 0.2, course: Across)),
        (member: "B1", name: "crack, 2026", date: "2026-05-03", along: 0.41, face: Bottom, shows: Crack(width_mm: 0.6, course: Across)),
        (member: "B1", name: "crack, 2021", date: "2021-05-03", along: 0.4, face: Bottom, shows: Crack(width_mm: 0.35, course: Across)),
        (member: "B2", name: "before", date: "2016-05-03", along: 0.4, face: Bottom, shows: Crack(width_mm: 0.9, course: Across)),
        (member: "B2", name: "filled", date: "2026-05-03", along: 0.4, face: Bottom, shows: Crack(width_mm: 0.1, course: Across)),
        (member: "C1", name: "lower half", date: "2026-05-03", along: (0.0, 0.5), shows: Intact),
    ],
)"#;

/// Predicts without a life and without pictures: the page, the list of files and the table of
/// defects.
fn predicted(more: &[&str]) -> (String, Value, String) {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    fs::write(at("scene.ron"), SCENE).unwrap();
    fs::write(at("evidence.ron"), EVIDENCE).unwrap();
    let (scene, out) = (at("scene.ron"), at("out"));
    let quick = ["--no-forecast", "--spp", "0", "--out", text(&out)];
    let output = run(&[&["predict", text(&scene)], &quick[..], more].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| fs::read_to_string(Path::new(&out).join(name)).unwrap();
    (read("report.html"), serde_json::from_str(&read("predict.json")).unwrap(), read("defects.csv"))
}

fn member<'a>(json: &'a Value, id: &str) -> &'a Value {
    json["members"].as_array().unwrap().iter().find(|m| m["id"] == id).unwrap()
}

/// Whoever has no RON could not say whose bridge it is.
#[test]
fn the_command_fills_the_cover() {
    let (page, json, _) = predicted(&[
        "--owner",
        "The <city>",
        "--inspector",
        "A. Engineer",
        "--place",
        "Km 12",
        "--purpose",
        "Principal inspection",
        "--inspected",
        "2026-05-03",
    ]);
    let project = &json["basis"]["project"];
    assert_eq!(project["structure"], "Bridge 7");
    for (field, said) in [
        ("owner", "The <city>"),
        ("inspector", "A. Engineer"),
        ("place", "Km 12"),
        ("purpose", "Principal inspection"),
        ("inspected", "2026-05-03"),
    ] {
        assert_eq!(project[field], said);
    }
    let cover = &page[page.find("class=\"cover\"").unwrap()..page.find("id=\"findings\"").unwrap()];
    for said in ["Bridge 7", "A. Engineer", "Km 12", "Principal inspection", "2026-05-03"] {
        assert!(cover.contains(said), "{said}: {cover}");
    }
    assert!(!cover.contains("The county") && !cover.contains("<city>"));
    assert_eq!(predicted(&[]).1["basis"]["project"]["owner"], "The county");
}

/// A skewed girder was as wide as its box in the world's axes.
#[test]
fn a_skewed_member_has_its_own_measures() {
    let (page, json, _) = predicted(&[]);
    let rests = &json["basis"]["members"][1];
    assert_eq!(rests["size"], "6.00 m long, 0.60 × 0.30 m across, 1.08 m³");
    let across: Vec<f64> = serde_json::from_value(rests["across_m"].clone()).unwrap();
    let mut sides = across.clone();
    sides.sort_by(f64::total_cmp);
    assert!((sides[0] - 0.3).abs() < 1e-3 && (sides[1] - 0.6).abs() < 1e-3, "{across:?}");
    assert!(page.contains("3.00 m high, 0.40 × 0.40 m across"));
}

#[test]
fn a_day_that_no_calendar_has_is_refused() {
    let output = run(&["predict", "column", "--inspected", "2026-02-30"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no calendar has"));
}

/// The crack of three inspections was three cracks, and what had been filled counted as open.
#[test]
fn a_crack_of_three_inspections_is_one_with_its_course() {
    let (page, json, table) = predicted(&[]);
    let [defect] = member(&json, "B1")["defects"].as_array().unwrap().as_slice() else {
        panic!("{json}")
    };
    assert_eq!(
        [&defect["width_mm"], &defect["date"], &defect["item"]],
        [&Value::from(0.6), &Value::from("2026-05-03"), &Value::from("crack, 2026")]
    );
    assert_eq!(defect["course"].as_array().unwrap().len(), 3);
    let course = "0.20 (2016), 0.35 (2021), 0.60 mm (2026): grew by 0.05 mm a year since 2021";
    assert!(page.contains(course) && table.contains(course), "{table}");
    assert_eq!(member(&json, "B1")["crack_check"]["width_mm"], 0.6);
    let filled = member(&json, "B2");
    assert_eq!(filled["crack_check"]["width_mm"], 0.1);
    assert_eq!(filled["evidence"]["survey"]["crack_width_mm"], 0.1);
    assert!(filled["damage"].as_f64().unwrap() < 0.1, "{}", filled["damage"]);
}

/// What only a developer of the program knows is no word for an owner.
#[test]
fn the_page_speaks_its_owners_language() {
    let (page, _, _) = predicted(&[]);
    for word in [
        "foretold",
        "χ²",
        "blind to",
        "readings[",
        "ecm_gpa",
        "predict.json",
        "Scene <b>",
        "Score against",
        "1 observations",
        "1 members",
        "Look first",
    ] {
        assert!(!page.contains(word), "{word}");
    }
    let items = &page[page.find("id=\"evidence\"").unwrap()..page.find("id=\"grading\"").unwrap()];
    assert_eq!(items.matches("class=\"group\"").count(), 3, "{items}");
}

/// A member of which half was seen and found intact was to be repaired within a year.
#[test]
fn what_was_not_looked_at_is_to_be_inspected() {
    let (page, json, _) = predicted(&[]);
    let column = member(&json, "C1");
    assert_eq!(column["to_inspect"], true, "{column}");
    assert_eq!(column["within_months"], 24);
    let advice = column["advice"].as_str().unwrap();
    assert!(advice.contains("nothing was found, but 40 % of the length"), "{advice}");
    assert_eq!(member(&json, "B1")["to_inspect"], false);
    let findings =
        &page[page.find("id=\"findings\"").unwrap()..page.find("id=\"summary\"").unwrap()];
    assert!(!findings.contains("poor:") || findings.find("C1") > findings.find("B1"));
    assert_eq!(findings.matches("To be inspected").count(), 1, "{findings}");
}

/// Predicts with `--pdf` where the programs are that `printers` names, each a script; what was said,
/// and the folder of the report.
#[cfg(unix)]
fn printed(printers: &[(&str, &str)]) -> (std::process::Output, tempfile::TempDir) {
    use std::os::unix::fs::PermissionsExt;
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    fs::write(at("scene.ron"), SCENE).unwrap();
    fs::write(at("evidence.ron"), EVIDENCE).unwrap();
    fs::create_dir(at("programs")).unwrap();
    for (name, script) in printers {
        let program = at("programs").join(name);
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let words = ["--no-forecast", "--spp", "0", "--pdf", "--out"];
    let mut command = common::program();
    command.env("PATH", at("programs")).arg("predict").arg(at("scene.ron"));
    (command.args(words).arg(at("out")).output().unwrap(), place)
}

/// WeasyPrint is called as its manual says, OPTIONS, INPUT and OUTPUT, and one that does not know the
/// options without them; here a copy stands in for the paper.
#[cfg(unix)]
#[test]
fn the_report_is_printed_by_command() {
    let tagged = "[ \"$2\" = pdf/ua-1 ] && exec /bin/cp \"$3\" \"$4\"";
    let old = "[ \"$1\" = --pdf-variant ] && exit 2; exec /bin/cp \"$1\" \"$2\"";
    for script in [tagged, old] {
        let (output, place) = printed(&[("weasyprint", script)]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| fs::read_to_string(place.path().join("out").join(name)).unwrap();
        assert_eq!(read("report.pdf"), read("report.html"));
        assert!(read("predict.json").contains("report.pdf"));
        assert!(String::from_utf8_lossy(&output.stdout).contains("report.pdf"));
    }
}

/// Refused before the work where nothing prints, and after it where a printer fails: nothing is
/// half written.
#[cfg(unix)]
#[test]
fn a_report_that_nothing_prints_is_refused() {
    for (printers, code, why) in [
        (&[][..], 66, "install one, or print report.html from any browser"),
        (&[("chromium", "exit 1")], 73, "has printed nothing"),
    ] {
        let (output, place) = printed(printers);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(why), "{said}");
        for name in ["report.html", "report.pdf", "predict.json"] {
            assert!(!place.path().join("out").join(name).exists(), "{name}");
        }
    }
}
