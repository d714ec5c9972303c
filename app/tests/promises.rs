//! What can be known at the start is said at the start; results stand for what was read; runs into one
//! folder do not mix; names from files do nothing to a terminal.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{
    fs,
    path::Path,
    process::{Output, Stdio},
    time::Duration,
};

use common::{program, run, text};
use serde_json::Value;

fn scene(id: &str, name: &str, more: &str) -> String {
    format!(
        r#"(schema: "intrados.scene/1",
    members: [(id: "{id}", name: "{name}", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37"{more})],
    lamps: [Environment(name: "sky", radiance: (1, 1, 1))],
    cameras: [(name: "front", position: (2, 2, 5), target: (0, 1, 0), fov_deg: 40, width: 9, height: 9)],
    supports: [(member: "{id}", place: Bottom, hold: Fixed)],
    loads: [(name: "self weight", action: SelfWeight, history: [(0, 0), (1, 1)])],
)"#
    )
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A model is refused before the evidence is looked at where nothing can be written into it.
#[test]
fn a_model_that_cannot_be_written_to_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("s.ron"), scene("C1", "Column", "")).unwrap();
    let model = "ISO-10303-21;\n#1=IFCCOLUMN('C1',$,$);\nEND-ISO-10303-21;\n";
    fs::write(at("m.ifc"), model).unwrap();
    for (python, word) in [("/nowhere/python", "cannot be run"), ("true", "m.ifc")] {
        let mut command = program();
        command.env("INTRADOS_PYTHON", python).args(["predict", text(&at("s.ron"))]);
        command.args(["--ifc", text(&at("m.ifc")), "--out", text(&at("out")), "--quiet"]);
        let output = command.output().unwrap();
        let line = said(&output);
        assert!([65, 66].contains(&output.status.code().unwrap()), "{line}");
        assert!(line.lines().count() == 1 && line.contains(word), "{line}");
        assert!(!at("out").exists(), "{line}");
    }
}

/// A folder that cannot be made is refused before the work, which here would refuse the scene.
#[test]
fn a_folder_that_cannot_be_written_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "").unwrap();
    let out = at("file/out");
    let loose = scene("C1", "Column", "").replace("supports", "/* ").replace("loads", " */ loads");
    fs::write(at("s.ron"), loose).unwrap();
    for line in ["analyze S --whole --out O", "import /nowhere.ifc --out O", "predict S --out O"] {
        let words = line.split(' ').map(|word| match word {
            "S" => text(&folder.path().join("s.ron")).to_owned(),
            "O" => text(&out).to_owned(),
            word => word.to_owned(),
        });
        let output = program().args(words).output().unwrap();
        assert_eq!(output.status.code(), Some(73), "{line}: {}", said(&output));
    }
}

fn slice(path: &Path) {
    let grey = |x: u32, y: u32| {
        image::Luma([if (20..236).contains(&x) && (20..236).contains(&y) { 180_u8 } else { 0 }])
    };
    image::GrayImage::from_fn(256, 256, grey).save(path).unwrap();
}

/// Evidence that is taken away while it is read: the result would stand for the hash of all of it.
#[test]
fn evidence_that_changes_while_it_is_read_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let names: Vec<String> = (0..16).map(|k| format!("\"slices/{k:02}.png\"")).collect();
    let slices = format!(
        ", slices: [Files(name: \"core\", images: [{}], pixel_mm: 1.5, along: 0.5)]",
        names.join(", ")
    );
    fs::write(at("s.ron"), scene("C1", "Column", &slices)).unwrap();
    fs::create_dir(at("slices")).unwrap();
    (0..16).for_each(|k| slice(&at(&format!("slices/{k:02}.png"))));
    let mut command = program();
    command.args(["predict", text(&at("s.ron")), "--no-forecast", "--spp", "0", "--quiet"]);
    command.args(["--threads", "1", "--out", text(&at("out"))]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // Until something is kept, and so all is hashed.
    let kept = || {
        let folders = fs::read_dir(at("out")).into_iter().flatten().flatten();
        let parts = folders.filter_map(|e| fs::read_dir(e.path().join(".parts")).ok()).flatten();
        parts.count() > 0
    };
    while !kept() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    // The last is replaced by another that can be read as well.
    image::GrayImage::from_pixel(256, 256, image::Luma([90])).save(at("slices/15.png")).unwrap();
    let output = child.wait_with_output().unwrap();
    let line = said(&output);
    assert_eq!(output.status.code(), Some(65), "{line}");
    assert!(line.contains("15.png") && line.contains("has changed or gone"), "{line}");
    assert!(!at("out/predict.json").exists());
    let left = fs::read_dir(at("out")).into_iter().flatten().count();
    assert_eq!(left, 0, "nothing of it is kept");
}

/// Two runs into one folder at once: what is there is of one of them.
#[test]
fn runs_into_one_folder_do_not_mix() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["one", "two"] {
        fs::write(at(&format!("{name}.ron")), scene(name, &format!("Column {name}"), "")).unwrap();
    }
    for _ in 0..3 {
        let children = ["one", "two"].map(|name| {
            let mut command = program();
            command.args(["predict", text(&at(&format!("{name}.ron"))), "--no-forecast"]);
            command.args(["--spp", "0", "--quiet", "--out", text(&at("out"))]);
            command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
        });
        let outputs = children.map(|child| child.wait_with_output().unwrap());
        for output in &outputs {
            assert!([0, 73].contains(&output.status.code().unwrap()), "{}", said(output));
        }
        assert!(outputs.iter().any(|output| output.status.success()));
        let read = |name: &str| fs::read_to_string(at("out").join(name)).unwrap();
        let listed: Value = serde_json::from_str(&read("predict.json")).unwrap();
        let scene = listed["scene"].as_str().unwrap();
        for name in ["members.csv", "report.html"] {
            assert!(read(name).contains(&format!("Column {scene}")), "{name} of {scene}");
        }
    }
}

/// No name of a file or in a file does anything to a terminal, however it is told.
#[test]
fn names_do_nothing_to_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let odd = "a\u{1b}[2J\u{9b}31mb\u{202e}c\u{7}";
    let file = folder.path().join(format!("{odd}.ron"));
    let missing = folder.path().join(format!("{odd} is not here.ron"));
    let camera = scene("C1", "Column", "").replace("front", "fr\\u{1b}]0;x\\u{7}\\u{9b}ont");
    let member = scene("C1", "Col\\u{1b}[2J\\u{9b}umn", "");
    let unknown = scene("C1", "Column", "").replace("C30/37", "C\\u{1b}[2J\\u{9b}");
    let broken = scene("C1", "Column", "").replace("Bottom", "\u{1b}[2JBottom\u{9b}");
    let mut shown = 0;
    for content in [camera, member, unknown, broken] {
        fs::write(&file, content).unwrap();
        for args in [
            &["info", text(&file)][..],
            &["info", text(&file), "--format", "json"],
            &["validate", text(&file)],
            &["validate", text(&file), "--format", "json"],
            &["info", text(&missing)],
            &["render", text(&file), "--camera", "none"],
            &["attach", text(&file), "none", "--intact"],
            &["analyze", text(&file), "--whole"],
            &["photo", text(&file), "--corners", "C1"],
        ] {
            let output = run(args);
            for stream in [&output.stdout, &output.stderr] {
                let told = String::from_utf8_lossy(stream);
                let steers = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
                assert!(!told.contains(steers), "{args:?}: {told:?}");
                shown += told.len();
            }
        }
    }
    assert!(shown > 1000);
}

/// Of a name that authoring tools make of family, type and number the first part will do, where no
/// other member has it.
#[test]
fn members_answer_to_the_name_that_people_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    fs::write(&path, scene("1xS3BCk291UvhgP2dvNsgp", "Girder 1:Girder 1:166739", "")).unwrap();
    let place = text(&path);
    for args in [
        &["attach", place, "Girder 1", "--rust", "0.1", "--name", "stain"][..],
        &["detach", place, "Girder 1", "stain"],
        &["photo", place, "--corners", "Girder 1"],
        &["photo", place, "--corners", "Girder 1:Girder 1:166739"],
    ] {
        let output = run(args);
        assert!(output.status.success(), "{args:?}: {}", said(&output));
    }
    assert_eq!(run(&["photo", place, "--corners", "Girder 2"]).status.code(), Some(65));
    // A name that two could mean is asked about.
    let two = fs::read_to_string(&path).unwrap().replace(
        "members: [",
        "members: [(id: \"2\", name: \"Girder 1:Girder 1:2\", at: (4, 0, 0), body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3)), ",
    );
    fs::write(&path, two).unwrap();
    let asked = run(&["photo", place, "--corners", "Girder 1"]);
    assert!(said(&asked).contains("2 members are called"), "{}", said(&asked));
}

/// What `analyze` does not use of a scene is told.
#[test]
fn what_is_not_used_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let rust = ", truth: [Corrosion(from: 0.2, to: 0.4, section_loss: 0.3)]";
    let args = ["analyze", text(&path), "--whole", "--format", "json"];
    for (more, count) in [("", 0), (rust, 1)] {
        fs::write(&path, scene("C1", "Column", more)).unwrap();
        let output = run(&args);
        assert!(output.status.success(), "{}", said(&output));
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let notes = told["notes"].as_array().map_or(0, Vec::len);
        assert_eq!(notes, count, "{}", told["notes"]);
        if count > 0 {
            let note = told["notes"][0].as_str().unwrap();
            assert!(note.contains("corrosion") && note.contains("is not used, because"), "{note}");
        }
    }
}

/// An option that a run would not use is refused with both names.
#[test]
fn unused_options_are_refused() {
    for (line, names) in [
        ("analyze column --whole --to-failure", ["--to-failure", "--whole"]),
        ("analyze column --whole --redundancy --member C1", ["--member", "--redundancy"]),
        ("analyze x.inp --units m,N --fine 0.4..0.6 --member B", ["--", ".inp"]),
        ("experiment table-3-1 --scenes column", ["--scenes", "table-3-1"]),
        ("experiment calibration --cases 1..2", ["--cases", "calibration"]),
        ("campaign new d --command measure --over door --now 2030", ["--now", ".csv"]),
        ("photo column --corners C1 --spp 9", ["--spp", "--corners"]),
        ("scan --sinogram x.tif --correct scatter", ["--correct", "SCENE"]),
        ("render column --replay 1,1,1 --spp 3", ["--spp", "--replay"]),
    ] {
        let output = run(&line.split(' ').collect::<Vec<_>>());
        let told = said(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {told}");
        assert!(told.lines().count() == 1, "{told}");
        names.iter().for_each(|name| assert!(told.contains(name), "{line}: {told}"));
    }
}
