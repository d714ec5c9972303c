//! `intrados import` as its user meets it. IFC goes through a stand-in for Python, so that nothing
//! need be installed: what the converter would answer lies beside it.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![cfg(unix)]

mod common;

use std::{
    fs,
    io::Write,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Output, Stdio},
    time::{Duration, Instant},
};

use common::{program, run, text};
use serde_json::{Value, json};

const WHOLE: &str = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n";

/// A folder with an IFC file in it.
struct Place(tempfile::TempDir);

impl Place {
    fn new(content: &str) -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        fs::write(place.path("model.ifc"), content).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A Python that answers with these commands of a shell: `$3` is where the answer goes.
    fn python(&self, commands: &str) -> PathBuf {
        let path = self.path("python");
        fs::write(&path, format!("#!/bin/sh\n{commands}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        path
    }

    fn import(&self, python: &Path) -> Output {
        program()
            .args(["import", text(&self.path("model.ifc")), "--out", text(&self.path("out"))])
            .args(["--format", "json"])
            .env("INTRADOS_PYTHON", python)
            .output()
            .unwrap()
    }

    /// Nothing is left but what was there.
    fn is_untouched(&self) -> bool {
        let known = ["model.ifc", "python", "elements.json", "shapes.bin"];
        fs::read_dir(self.0.path())
            .unwrap()
            .all(|e| known.contains(&e.unwrap().file_name().to_string_lossy().as_ref()))
    }

    /// Is refused with one line that says all of `words`, and leaves nothing.
    fn refuses(&self, python: &Path, code: i32, words: &[&str]) {
        let output = self.import(python);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        words.iter().for_each(|word| assert!(said.contains(word), "{word}: {said}"));
        assert!(self.is_untouched(), "{said}");
    }

    /// What the converter would write: boxes with these classes, names, corners and sizes.
    fn answer(&self, boxes: &[(&str, &str, [f64; 3], [f64; 3])]) -> PathBuf {
        let mut bytes = Vec::new();
        let mut elements = Vec::new();
        for (i, (class, name, corner, size)) in boxes.iter().enumerate() {
            let at = bytes.len();
            for k in 0..8_usize {
                for (axis, low) in corner.iter().enumerate() {
                    let x = low + if k >> axis & 1 == 1 { size[axis] } else { 0.0 };
                    bytes.write_all(&x.to_le_bytes()).unwrap();
                }
            }
            let quads = [
                [0, 2, 3, 1],
                [4, 5, 7, 6],
                [0, 1, 5, 4],
                [2, 6, 7, 3],
                [0, 4, 6, 2],
                [1, 3, 7, 5_u32],
            ];
            let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
            triangles.flatten().for_each(|i| bytes.write_all(&i.to_le_bytes()).unwrap());
            elements.push(json!({
                "step": i, "id": "same id", "class": class, "name": name, "object_type": "",
                "predefined": "", "type": "", "above": [], "properties": {}, "attributes": {},
                "materials": [{"name": "Beton C35/45", "category": "", "properties": {}}],
                "courses": [],
                "shapes": [{
                    "at": at, "corners": 8, "triangles": 12, "colour": null,
                    "matrix": [1.0,0.0,0.0,0.0, 0.0,1.0,0.0,0.0, 0.0,0.0,1.0,0.0, 0.0,0.0,0.0,1.0],
                }],
            }));
        }
        self.written(&json!(elements), &bytes)
    }

    fn written(&self, elements: &Value, bytes: &[u8]) -> PathBuf {
        let answer = json!({
            "schema": "IFC4", "draft": null, "ifcopenshell": "0.9.0", "units": ["milli metre"],
            "metres_per_unit": 0.001, "year": 1965, "project": "a project",
            "georeference": {}, "elements": elements,
        });
        fs::write(self.path("elements.json"), answer.to_string()).unwrap();
        fs::write(self.path("shapes.bin"), bytes).unwrap();
        let [json, bin] = ["elements.json", "shapes.bin"].map(|name| self.path(name));
        self.python(&format!(
            "cp {} \"$3/elements.json\"\ncp {} \"$3/shapes.bin\"\necho '{{\"ready\": true}}'",
            text(&json),
            text(&bin)
        ))
    }
}

#[test]
fn without_a_converter_the_command_that_brings_it_is_said() {
    let place = Place::new(WHOLE);
    let command = "pip install ifcopenshell==0.9.0.post1";
    place.refuses(Path::new("/no/such/python"), 66, &["/no/such/python", command]);
    let absent = place.python("echo '{\"fault\": \"absent\", \"message\": \"No module\"}'");
    place.refuses(&absent, 66, &["No module", command]);
    let old = place.python("echo '{\"fault\": \"old\", \"message\": \"0.6.0b1\"}'");
    place.refuses(&old, 66, &["0.6.0b1", "0.8", command]);
}

#[test]
fn what_is_wrong_with_the_file_is_said_in_one_sentence() {
    let python = Path::new("/no/such/python");
    let half = WHOLE.len() / 2;
    Place::new(&WHOLE[..half]).refuses(python, 65, &["ends in the middle", "export it again"]);
    Place::new("PK\u{3}\u{4}…").refuses(python, 65, &["unpack"]);
    Place::new("solid stl").refuses(python, 65, &["is no IFC file"]);
    // Sparse: it takes no room on the disk.
    let large = Place::new(WHOLE);
    fs::OpenOptions::new()
        .write(true)
        .open(large.path("model.ifc"))
        .unwrap()
        .set_len(4 << 30)
        .unwrap();
    large.refuses(python, 65, &["4.0 GiB", "at most 1 GiB"]);
    let units = Place::new(WHOLE);
    let says = units.python("echo '{\"fault\": \"units\", \"message\": \"\"}'");
    units.refuses(&says, 65, &["no unit of length", "export it again with units"]);
    let died = Place::new(WHOLE);
    let says = died.python("echo 'it was killed' >&2; exit 9");
    died.refuses(&says, 65, &["broke off", "it was killed"]);
    let lies = Place::new(WHOLE);
    let says = lies.written(&json!([{"step": 1}]), &[]);
    lies.refuses(&says, 65, &["answer is damaged"]);
}

#[test]
fn a_folder_that_holds_something_is_left_alone() {
    let place = Place::new(WHOLE);
    let out = place.path("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("scene.ron"), "mine").unwrap();
    let output = place.import(Path::new("/no/such/python"));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(73), "{said}");
    assert!(said.contains("not empty") && said.contains("--out"), "{said}");
    assert_eq!(fs::read_to_string(out.join("scene.ron")).unwrap(), "mine");
}

/// z is up in IFC; a metre of wall beside a column, far from the origin.
#[test]
fn a_model_becomes_a_project_that_other_commands_take() {
    let place = Place::new(WHOLE);
    let far = 3.2e6;
    let python = place.answer(&[
        ("IfcColumn", "pier", [far, 0.0, 0.0], [0.5, 0.5, 4.0]),
        ("IfcBeam", "girder", [far, 0.0, 4.0], [8.0, 0.4, 0.6]),
        ("IfcWindow", "window", [far, 3.0, 4.0], [1.0, 0.1, 1.0]),
    ]);
    let output = place.import(&python);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["schema"], "intrados.import/1");
    assert_eq!([&told["members"]["column"], &told["members"]["beam"]], [1, 1]);
    assert!((told["volume_m3"]["beam"].as_f64().unwrap() - 1.92).abs() < 1e-6, "{told}");
    assert_eq!(told["scenery"]["IfcWindow"], 1);
    assert!((told["offset_m"][0].as_f64().unwrap() - far).abs() < 10.0, "{told}");
    let scene = place.path("out").join("scene.ron");
    let checked = run(&["validate", text(&scene), "--format", "json"]);
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stdout));
    let info = run(&["info", text(&scene), "--format", "json", "--quiet"]);
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    let members = info["scenes"][0]["members"].as_array().unwrap();
    assert_eq!(members.len(), 2);
    // Its class was stated, and upright is up.
    assert!(members.iter().all(|m| m["concrete"] == "C35/45" && m["concrete_assumed"] == false));
    let height =
        |m: &Value| m["bounds"][1][1].as_f64().unwrap() - m["bounds"][0][1].as_f64().unwrap();
    assert!((height(&members[0]) - 4.0).abs() < 1e-4, "{}", members[0]);
    let readme = fs::read_to_string(place.path("out").join("README.md")).unwrap();
    for word in ["built in 1965", "§9.2.1.1", "XC4", "less (32000"] {
        assert!(readme.contains(word), "{word}: {readme}");
    }
    // It is read with the scene, and empty yet.
    let evidence = fs::read_to_string(place.path("out").join("evidence.ron")).unwrap();
    assert!(evidence.contains("intrados.evidence/1"), "{evidence}");
    let list = run(&["detach", text(&place.path("out")), "--list"]);
    assert_eq!(String::from_utf8_lossy(&list.stdout).trim(), "nothing is attached");
    let alone = run(&["validate", text(&place.path("out").join("evidence.ron"))]);
    assert_eq!(alone.status.code(), Some(65));
    assert!(String::from_utf8_lossy(&alone.stdout).contains("open the scene that it belongs to"));
}

#[test]
fn a_thousand_identical_names_are_a_thousand_members() {
    let place = Place::new(WHOLE);
    let boxes: Vec<_> = (0..1000)
        .map(|i| {
            (
                "IfcColumn",
                "pier",
                [2.0 * f64::from(i % 40), 2.0 * f64::from(i / 40), 0.0],
                [0.4, 0.4, 3.0],
            )
        })
        .collect();
    let output = place.import(&place.answer(&boxes));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("999 members have a GlobalId that another has"), "{said}");
    let scene = place.path("out").join("scene.ron");
    let info = run(&["info", text(&scene), "--format", "json", "--quiet"]);
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    let members = info["scenes"][0]["members"].as_array().unwrap();
    for key in ["id", "name"] {
        let distinct: std::collections::HashSet<_> =
            members.iter().map(|m| m[key].as_str().unwrap()).collect();
        assert_eq!(distinct.len(), 1000, "{key}");
    }
}

#[test]
fn an_interrupt_ends_the_converter_and_leaves_nothing() {
    let place = Place::new(WHOLE);
    let python = place.python(&format!("echo $$ > {}\nexec sleep 60", text(&place.path("pid"))));
    let child = program()
        .args(["import", text(&place.path("model.ifc")), "--out", text(&place.path("out"))])
        .env("INTRADOS_PYTHON", python)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let pid_file = place.path("pid");
    let begin = Instant::now();
    let pid = loop {
        match fs::read_to_string(&pid_file).unwrap_or_default().trim() {
            "" => assert!(begin.elapsed() < Duration::from_secs(30)),
            pid => break pid.to_owned(),
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    let signal = |name: &str, pid: &str| {
        std::process::Command::new("kill").args([name, pid]).output().unwrap().status.success()
    };
    assert!(signal("-INT", &child.id().to_string()));
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    assert!(!signal("-0", &pid), "the converter still runs");
    fs::remove_file(pid_file).unwrap();
    assert!(place.is_untouched());
}

/// Without a unit nobody knows; with one it is taken.
#[test]
fn an_obj_in_millimetres_is_asked_for_its_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.obj");
    let corner = |k: usize| {
        let at = |axis: usize, size: f64| if k >> axis & 1 == 1 { size } else { 0.0 };
        format!("v {} {} {}\n", at(0, 400.0), at(1, 4000.0), at(2, 400.0))
    };
    let corners: String = (0..8).map(corner).collect();
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(&path, format!("{corners}o column 1\n{faces}")).unwrap();
    let out = folder.path().join("out");
    let refused = run(&["import", text(&path), "--out", text(&out), "--unit", "m"]);
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(65), "{said}");
    let words = ["column 1", "4.0 km long", "is the unit wrong?", "--unit"];
    assert!(words.iter().all(|word| said.contains(word)) && !said.contains(".import-"), "{said}");
    let asked = run(&["import", text(&path), "--out", text(&out)]);
    assert_eq!(asked.status.code(), Some(65));
    assert!(String::from_utf8_lossy(&asked.stderr).contains("--unit mm"));
    let done =
        run(&["import", text(&path), "--out", text(&out), "--unit", "mm", "--format", "json"]);
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(told["members"]["column"], 1);
    assert!((told["volume_m3"]["column"].as_f64().unwrap() - 0.64).abs() < 1e-6, "{told}");
}

fn members_of(scene: &Path) -> Vec<Value> {
    let info = run(&["info", text(scene), "--format", "json", "--quiet"]);
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    info["scenes"][0]["members"].as_array().unwrap().clone()
}

/// A footing lies as its bars do: below, above and across; `info` counts what is assumed.
#[test]
fn a_footing_has_bars_of_both_ways_all_along() {
    let place = Place::new(WHOLE);
    let python = place.answer(&[("IfcFooting", "base", [0.0; 3], [5.0, 2.1, 0.7])]);
    let output = place.import(&python);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let path = place.path("out").join("scene.ron");
    let member = &members_of(&path)[0];
    assert!(
        member["bars"].as_u64() > Some(10) && member["stirrups"].as_u64() > Some(10),
        "{member}"
    );
    let scene = intrados_scene::Scene::load(&path, &intrados_stage::Job::default()).unwrap();
    let assembly = &scene.structure.assemblies[0];
    assert!(assembly.frame.axis.x.abs() > 4.9, "{:?}", assembly.frame);
    for line in &assembly.steel {
        let ends = [line.line[0], *line.line.last().unwrap()];
        let is_bar = line.part == intrados_scene::Part::Bar;
        assert!(!is_bar || (ends[1] - ends[0]).x.abs() > 4.8, "{line:?}");
        let inside = |[x, y, _]: [f32; 3]| (0.03..4.97).contains(&x) && (0.03..0.67).contains(&y);
        assert!(line.line.iter().map(|p| p.to_array()).all(inside), "{line:?}");
    }
}

/// An angle has no room for bars in the corners of its box: none are assumed, and the reason is
/// said.
#[test]
fn bars_that_would_lie_outside_are_not_assumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("angle.obj");
    let profile = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.25], [0.25, 0.25], [0.25, 1.0], [0.0, 1.0]];
    let mut obj = String::from("o beam 1\n");
    for z in [0.0, 6.0] {
        profile.iter().for_each(|[x, y]| obj += &format!("v {x} {y} {z}\n"));
    }
    for k in 0..6 {
        let next = (k + 1) % 6;
        obj += &format!("f {} {} {} {}\n", k + 1, next + 1, next + 7, k + 7);
    }
    obj += "f 1 4 3 2\nf 1 6 5 4\nf 7 8 9 10\nf 7 10 11 12\n";
    fs::write(&path, obj).unwrap();
    let out = folder.path().join("out");
    let done =
        run(&["import", text(&path), "--out", text(&out), "--unit", "m", "--format", "json"]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    let told: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!([&told["members"]["beam"], &told["reinforcement_assumed"]], [1, 0], "{told}");
    for word in ["no bars are assumed for one member", "beam 1", "details of scene.ron"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert_eq!(members_of(&out.join("scene.ron"))[0]["bars"], 0);
}

/// IFC says its unit itself, and what somebody says beside it would be lost.
#[test]
fn a_unit_beside_an_ifc_is_refused() {
    let place = Place::new(WHOLE);
    let output = program()
        .args(["import", text(&place.path("model.ifc")), "--out", text(&place.path("out"))])
        .args(["--unit", "mm"])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(65), "{said}");
    assert!(said.contains("leave --unit out") && place.is_untouched(), "{said}");
}

/// Links alone carry nothing along their beam.
#[test]
fn a_beam_of_links_alone_is_said() {
    let place = Place::new(WHOLE);
    let python = place.answer(&[("IfcBeam", "girder", [0.0; 3], [8.0, 0.4, 0.6])]);
    let path = place.path("elements.json");
    let mut told: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let link = |x: f64| {
        let corners = [[0.05, 0.05], [0.35, 0.05], [0.35, 0.55], [0.05, 0.55], [0.05, 0.05]];
        let line: Vec<_> = corners.iter().map(|[y, z]| json!([x, y, z])).collect();
        json!({
            "step": 7, "id": format!("link {x}"), "class": "IfcReinforcingBar", "name": "link",
            "object_type": "", "predefined": "LIGATURE", "type": "", "above": [],
            "properties": {}, "attributes": {}, "materials": [],
            "courses": [{"diameter": 0.01, "line": line}], "shapes": [],
        })
    };
    let elements = told["elements"].as_array_mut().unwrap();
    elements.extend([link(2.0), link(6.0)]);
    fs::write(&path, told.to_string()).unwrap();
    let output = place.import(&python);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("no bars along \"girder\"") && said.contains("2 links"), "{said}");
}

/// What the model does not state, details do.
#[test]
fn classes_that_are_stated_are_not_said_to_be_missing() {
    let place = Place::new(WHOLE);
    let python = place.answer(&[
        ("IfcColumn", "pier", [0.0; 3], [0.5, 0.5, 4.0]),
        ("IfcColumn", "post", [4.0, 0.0, 0.0], [0.5, 0.5, 4.0]),
    ]);
    assert!(place.import(&python).status.success());
    let scene = place.path("out").join("scene.ron");
    let said = || String::from_utf8(run(&["validate", text(&scene)]).stdout).unwrap();
    assert!(!said().contains("state no concrete class"), "{}", said());
    let text = fs::read_to_string(&scene).unwrap();
    let assumed = text.replacen("assumed: [", "assumed: [Concrete, ", 1);
    fs::write(&scene, assumed.replacen("C35/45", "C20/25", 1)).unwrap();
    assert!(
        said().contains("one member states no concrete class: C20/25 is assumed"),
        "{}",
        said()
    );
}
