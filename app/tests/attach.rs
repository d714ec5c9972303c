//! `intrados attach` and `detach` as their user meets them.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use common::{program, run, text};
use serde_json::Value;

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    members: [
        (id: "C1", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37"),
        (id: "B1", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 6), at: (4, 3, 0), concrete: "C30/37"),
    ],
    gauges: [(name: "SG1", member: "C1", along: 0.5, angle_deg: 0, measures: Strain(Axial))],
    tests: [(name: "truck", member: "C1", actions: [Force(place: Top, force_kn: (0, -100, 0))])],
)"#;

const EVIDENCE: &str = r#"// Ours: do not lose.
(
    schema: "intrados.evidence/1",
    items: [
        // By hand, with a "]" in it.
        (member: "C1", name: "mine", shows: Intact) // at the end
    ], /* and ] here */
)
"#;

/// A folder `bridge` with a scene, beside what a user brings.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        fs::create_dir(place.path("bridge")).unwrap();
        fs::write(place.path("bridge/scene.ron"), SCENE).unwrap();
        place
    }

    fn with_evidence() -> Self {
        let place = Self::new();
        fs::write(place.path("bridge/evidence.ron"), EVIDENCE).unwrap();
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn brings(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        fs::write(self.path(name), content).unwrap();
        text(&self.path(name)).to_owned()
    }

    /// A slice of 64 × 64 pixels, grey in the middle.
    fn slice(&self, name: &str) -> String {
        let grey = |x: u32, y: u32| {
            image::Luma([if (8..56).contains(&x) && (8..56).contains(&y) { 180_u8 } else { 0 }])
        };
        image::GrayImage::from_fn(64, 64, grey).save(self.path(name)).unwrap();
        text(&self.path(name)).to_owned()
    }

    fn evidence(&self) -> String {
        fs::read_to_string(self.path("bridge/evidence.ron")).unwrap()
    }

    /// `intrados COMMAND FOLDER …`.
    fn run(&self, command: &str, args: &[&str]) -> Output {
        run(&[&[command, text(&self.path("bridge"))], args].concat())
    }

    fn done(&self, command: &str, args: &[&str]) -> Value {
        let output = self.run(command, &[args, &["--format", "json"]].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn attached(&self) -> Vec<Value> {
        let mut all = self.done("detach", &["--list"])["attached"].as_array().unwrap().clone();
        // The scene's own load test is there from the beginning.
        all.retain(|one| one["kind"] != "load test" || one["name"] != "truck");
        all
    }

    /// Every file below the folder, with its bytes.
    fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        fn gather(folder: &Path, files: &mut BTreeMap<PathBuf, Vec<u8>>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    files.insert(path.clone(), Vec::new());
                    gather(&path, files);
                } else {
                    files.insert(path.clone(), fs::read(&path).unwrap());
                }
            }
        }
        let mut files = BTreeMap::new();
        gather(self.0.path(), &mut files);
        files
    }

    /// Is refused with this code, in one line that says all of `words`, and nothing has changed.
    fn refuses(&self, command: &str, args: &[&str], code: i32, words: &[&str]) {
        let before = self.files();
        let output = self.run(command, args);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {said}");
        // The usage that follows a wrong option is clap's.
        assert!(code == 2 || said.lines().count() == 1, "{said}");
        words.iter().for_each(|word| assert!(said.contains(word), "{args:?}: {word}: {said}"));
        assert!(before == self.files(), "{args:?}: something was written: {said}");
    }
}

#[test]
fn findings_of_every_kind_are_attached_listed_and_taken_away() {
    let place = Place::with_evidence();
    for (args, name, kind, value) in [
        (
            &[
                "--crack",
                "0.3",
                "--course",
                "along",
                "--length-m",
                "0.6",
                "--along",
                "0.3,0.5",
                "--face",
                "front",
            ][..],
            "crack 1",
            "crack",
            "0.3 ± 0.05 mm, along, 0.6 m long",
        ),
        (
            &["--crack", "0.2", "--course", "map", "--std-error", "0.1"],
            "crack 2",
            "crack",
            "0.2 ± 0.1 mm, map",
        ),
        (
            &[
                "--cover",
                "32",
                "--along",
                "0.4",
                "--angle",
                "-90",
                "--date",
                "2026-05-03",
                "--instrument",
                "meter 7",
            ],
            "cover 1",
            "cover",
            "32 ± 3.2 mm",
        ),
        (
            &["--half-cell", "-380", "--electrode", "calomel"],
            "half-cell 1",
            "half-cell",
            "-457 ± 10 mV (Cu/CuSO₄)",
        ),
        (&["--rebound", "38"], "rebound 1", "rebound", "38 ± 2"),
        (&["--velocity", "4100"], "velocity 1", "velocity", "4100 ± 82 m/s"),
        (&["--carbonation", "20"], "carbonation 1", "carbonation", "20 ± 2 mm"),
        (
            &["--core-strength", "40", "--diameter-mm", "100", "--length-mm", "200"],
            "core strength 1",
            "core strength",
            "40 ± 2 MPa (core 100 × 200 mm)",
        ),
        (
            &["--chloride", "5:1,15:0.5"],
            "chloride 1",
            "chloride",
            "1 at 5 mm, 0.5 at 15 mm ± 0.075 % of cement",
        ),
        (&["--hollow", "0.5", "--tapped", "2"], "sounding 1", "sounding", "0.5 of 2 m² hollow"),
        (
            &["--spall", "0.2", "--depth-mm", "30", "--bars-bare", "--height", "0.6"],
            "spall 1",
            "spall",
            "0.2 m², 30 mm deep, bars bare",
        ),
        (&["--rust", "0.1"], "rust 1", "rust", "0.1 m²"),
        (&["--efflorescence", "0.1"], "efflorescence 1", "efflorescence", "0.1 m²"),
        (&["--wet", "0.1"], "wet spot 1", "wet spot", "0.1 m²"),
        (
            &["--intact", "--name", "north side, \"upper\""],
            "north side, \"upper\"",
            "intact",
            "nothing found",
        ),
    ] {
        let told = place.done("attach", &[&["C1"], args].concat());
        assert_eq!(told["schema"], "intrados.attach/1");
        let added = told["added"].as_array().unwrap();
        assert_eq!(added.len(), 1, "{told}");
        assert_eq!([&added[0]["name"], &added[0]["kind"], &added[0]["value"]], [name, kind, value]);
        assert_eq!([&told["name"], &told["member"]], [name, "C1"]);
    }
    let all = place.attached();
    assert_eq!(all.len(), 16);
    let of = |name: &str| all.iter().find(|a| a["name"] == name).unwrap();
    assert_eq!(of("cover 1")["date"], "2026-05-03");
    assert_eq!([&of("cover 1")["angle_deg"], &of("crack 1")["angle_deg"]], [270.0, 0.0]);
    let along = |name: &str| of(name)["along"][0].as_f64().unwrap();
    assert!((along("crack 1") - 0.3).abs() < 1e-6 && (along("spall 1") - 0.2).abs() < 1e-6);
    assert_eq!(of("rust 1")["along"], Value::Null);
    let written = "\n        (member: \"C1\", name: \"crack 1\", along: (0.3, 0.5), face: Front, shows: Crack(width_mm: 0.3, course: Along, length_m: 0.6)),\n";
    assert!(place.evidence().contains(written), "{}", place.evidence());
    let table = place.run("detach", &["--list"]);
    let table = String::from_utf8(table.stdout).unwrap();
    let line = table.lines().find(|l| l.contains("crack 1")).unwrap();
    assert!(line.contains("0.3–0.5") && line.contains("0.3 ± 0.05 mm"), "{table}");
    for one in &all[1..] {
        place.done("detach", &["C1", one["name"].as_str().unwrap()]);
    }
    // All that its author wrote is there, and the comma that came in between.
    assert_eq!(place.evidence(), EVIDENCE.replace("Intact) //", "Intact), //"));
}

#[test]
fn a_table_is_copied_and_its_copy_removed() {
    let place = Place::new();
    let csv = place.brings("half cell.csv", "along;mV\r\n0,2;-310\r\n0,8;-120\r\n");
    let told = place.done("attach", &["C1", &csv, "--face", "back", "--date", "2026-05-03"]);
    assert_eq!(told["added"].as_array().unwrap().len(), 2);
    let copy = told["files"][0].as_str().unwrap();
    assert_eq!(fs::read(copy).unwrap(), fs::read(&csv).unwrap());
    assert!(copy.contains("/bridge/evidence/C1_half_cell/"), "{copy}");
    // The scene that every command reads has it.
    let all = place.attached();
    assert_eq!([&all[0]["name"], &all[1]["name"]], ["half cell 1", "half cell 2"]);
    assert_eq!([&all[0]["value"], &all[0]["date"]], ["-310 ± 10 mV (Cu/CuSO₄)", "2026-05-03"]);
    assert_eq!(all[1]["angle_deg"], 180.0);
    // A second of the same name gets a number.
    assert_eq!(place.done("attach", &["C1", &csv])["name"], "half cell (2)");
    place.done("detach", &["C1", "half cell (2)"]);
    let removed = place.done("detach", &["C1", "half cell"]);
    assert_eq!(removed["removed"][0].as_str(), Some(copy));
    assert!(!place.path("bridge/evidence").exists());
    assert_eq!(place.attached(), [] as [Value; 0]);
    // What is in the folder besides stays.
    place.done("attach", &["C1", &csv]);
    let note = place.path("bridge/evidence/C1_half_cell/note.txt");
    fs::write(&note, "mine").unwrap();
    place.done("detach", &["C1", "half cell"]);
    assert!(note.exists() && !Path::new(copy).exists());
}

#[test]
fn gauges_are_attached_in_their_unit() {
    let place = Place::with_evidence();
    let csv = place.brings("load test.csv", "gauge,value,test\nSG1,41.5,truck\n");
    let told = place.done("attach", &["C1", &csv, "--unit", "ue"]);
    assert_eq!(told["added"][0]["value"], "41.5 ± 1 µε, test truck");
    let value = place.brings("velocity.csv", "value\n4.1\n");
    let told = place.done("attach", &["C1", &value, "--unit", "km/s", "--kind", "velocity"]);
    assert_eq!(told["added"][0]["value"], "4100 ± 82 m/s");
}

/// A load test and its gauges without a line of RON.
#[test]
fn load_tests_and_gauges_are_defined_by_command() {
    let place = Place::new();
    let axle = |kn: &str, along: &str| {
        place.done("attach", &["B1", "--load-test", "bus", "--force-kn", kn, "--along", along])
    };
    let told = axle("60", "0.3");
    assert_eq!([&told["name"], &told["added"][0]["value"]], ["bus", "60 kN"]);
    let written = "(name: \"bus\", member: \"B1\", actions: [Force(place: Surface(from: 0.275, to: 0.325, side_deg: 0.0), force_kn: (0.0, -60.0, 0.0))])";
    assert!(place.evidence().contains(written), "{}", place.evidence());
    let told = axle("100", "0.5,0.6");
    assert_eq!(told["added"][0]["value"], "60 kN + 100 kN");
    assert_eq!(place.evidence().matches("name: \"bus\"").count(), 1, "{}", place.evidence());
    let csv = place.brings("lv.csv", "gauge,value,along,face\nLV1,-1.5,0.5,bottom\n");
    let told = place.done("attach", &["B1", &csv, "--unit", "mm", "--test", "bus"]);
    assert_eq!(told["added"][0]["value"], "-1.5 ± 0.03 mm, test bus");
    assert_eq!(told["added"][0]["angle_deg"], 180.0);
    // Who reads a gauge again need not say where it is; nor can its definition go.
    let again = place.brings("again.csv", "gauge,value\nLV1,-1.6\n");
    place.done("attach", &["B1", &again, "--unit", "mm"]);
    place.refuses("detach", &["B1", "bus"], 65, &["\"bus\"", "lv.csv:2", "detach that first"]);
    place.refuses("detach", &["B1", "lv"], 65, &["again.csv:2", "detach that first"]);
    for name in ["again", "lv", "bus"] {
        place.done("detach", &["B1", name]);
    }
    assert!(place.attached().is_empty() && !place.evidence().contains("name: \"bus\""));
    // What stands carries it on its head.
    place.done("attach", &["C1", "--load-test", "jack", "--force-kn", "200"]);
    assert!(place.evidence().contains("Force(place: End, force_kn: (0.0, -200.0, 0.0))"));
}

#[test]
fn nonsense_of_load_tests_and_gauges_is_refused() {
    let place = Place::new();
    let test =
        |member, name, more: &[&'static str]| [&[member, "--load-test", name], more].concat();
    let on = |kn| test("B1", "bus", &["--force-kn", kn, "--along", "0.5"]);
    place.refuses("attach", &on("0"), 65, &["force_kn: 0", "above 0"]);
    place.refuses("attach", &on("-100"), 65, &["force_kn: -100", "acts downwards"]);
    place.refuses("attach", &on("NaN"), 65, &["force_kn: NaN"]);
    place.refuses("attach", &on("100001"), 65, &["at most 100000"]);
    let refused = |member, more: &[&'static str], code, words: &[&str]| {
        let more = [&["--force-kn", "100"], more].concat();
        place.refuses("attach", &test(member, "bus", &more), code, words);
    };
    refused("B1", &[], 65, &["along: is missing"]);
    refused("B1", &["--along", "50"], 65, &["along: 50", "share of the axis"]);
    refused("B1", &["--along", "0.6,0.5"], 65, &["turn them round"]);
    refused("B1", &["--along", "0.5", "--face", "front"], 2, &["--face"]);
    refused("B1", &["--along", "0.5", "--name", "car"], 2, &["--load-test"]);
    refused("B1", &["--along", "0.5", "--rust", "1"], 2, &["--rust"]);
    refused("C1", &["--along", "0.5"], 65, &["C1 stands", "leave it out"]);
    place.refuses("attach", &test("B1", "bus", &["--along", "0.5"]), 2, &["--force-kn"]);
    place.refuses("attach", &["C1", "--intact", "--force-kn", "3"], 2, &["--load-test"]);
    // That of the scene is not changed, and no other member has one of its name.
    let truck = test("C1", "truck", &["--force-kn", "100"]);
    place.refuses("attach", &truck, 65, &["\"truck\"", "already"]);
    place.done("attach", &on("100"));
    place.refuses("attach", &test("C1", "bus", &["--force-kn", "9"]), 65, &["\"bus\""]);
    let far = place.brings("t.csv", "gauge,value,along,angle_deg\nSG1,3,0.7,90\n");
    let both = ["t.csv:2: column along", "at along 0.5, 0°", "not at along 0.7, 90°"];
    place.refuses("attach", &["C1", &far, "--unit", "ue"], 65, &both);
    let new = place.brings("n.csv", "gauge,value\nLV1,3\n");
    place.refuses("attach", &["C1", &new, "--unit", "ue"], 65, &["LV1", "columns along and face"]);
}

#[test]
fn slices_of_a_core_are_attached_together() {
    let place = Place::new();
    let files: Vec<String> = (1..=3).map(|i| place.slice(&format!("core_{i}.png"))).collect();
    let mask = place.slice("core_1_mask-pore.png");
    let files: Vec<&str> = files.iter().map(String::as_str).chain([mask.as_str()]).collect();
    let where_ = [
        "--along",
        "0.3",
        "--face",
        "right",
        "--depth-mm",
        "30",
        "--pixel-mm",
        "2",
        "--diameter-mm",
        "100",
    ];
    let told = place.done("attach", &[&["C1"], &files[..], &where_].concat());
    assert_eq!([&told["name"], &told["added"][0]["value"]], ["core 1", "3 slices, 2 mm a pixel"]);
    assert_eq!(told["added"][0]["angle_deg"], 90.0);
    assert_eq!(told["files"].as_array().unwrap().len(), 4);
    let written = "(member: \"C1\", slices: [Files(name: \"core 1\", images: [\"evidence/C1_core_1/*.png\"], pixel_mm: 2.0, along: 0.3, angle_deg: 90.0, depth_m: 0.03, diameter_mm: 100.0)]),";
    assert!(place.evidence().contains(written), "{}", place.evidence());
    // Alone, and as MetaImage, which says itself how large its pixels are.
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 64 64 1\nElementSpacing = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
    let mha = place.brings("one.mha", [header.as_bytes(), &[180; 64 * 64]].concat());
    let told = place.done("attach", &["C1", &mha, "--along", "0.5"]);
    assert_eq!([&told["name"], &told["added"][0]["value"]], ["core 2", "1 slices"]);
    for name in ["core 1", "core 2"] {
        place.done("detach", &["C1", name]);
    }
    assert!(!place.path("bridge/evidence").exists() && place.attached().is_empty());
}

/// Bare voxels get the header that they lack; a volume without --stack is no slice.
#[test]
fn volumes_are_attached_and_taken_away() {
    let place = Place::new();
    let voxels: Vec<u8> = (0..32 * 24 * 20_u16).flat_map(|i| (100 + i % 7).to_be_bytes()).collect();
    let raw = place.brings("core.raw", [vec![0; 10], voxels].concat());
    let how = ["--raw", "32,24,20", "--voxel-mm", "2,2,4", "--skip-bytes", "10", "--big-endian"];
    let place_of = ["--along", "0.3", "--axis", "through", "--date", "2026-05-03"];
    let told = place.done("attach", &[&["C1", &raw], &how[..], &place_of].concat());
    assert_eq!([&told["name"], &told["added"][0]["value"]], ["core 1", "volume"]);
    assert_eq!(told["added"][0]["date"], "2026-05-03");
    let written = "Stack(name: \"core 1\", images: [\"evidence/C1_core_1/core.mha\"], along: 0.3, axis: Through, date: \"2026-05-03\")";
    assert!(place.evidence().contains(written), "{}", place.evidence());
    let copy = fs::read(place.path("bridge/evidence/C1_core_1/core.mha")).unwrap();
    let head = String::from_utf8_lossy(&copy[..240]).into_owned();
    assert!(head.contains("ElementSpacing = 2 2 4\nDimSize = 32 24 20\n"), "{head}");
    let last = 100 + ((32 * 24 * 20 - 1) % 7) as u8;
    assert!(head.contains("MSB = True") && copy.ends_with(&[0, last]));
    // The copy is a volume as any other.
    let mha = text(&place.path("bridge/evidence/C1_core_1/core.mha")).to_owned();
    place.refuses("attach", &["C1", &mha, "--along", "0.3"], 65, &["20 slices", "--stack"]);
    place.done("attach", &["B1", &mha, "--stack", "--along", "0.3"]);
    // What does not fit together.
    let shorter = ["C1", &raw, "--raw", "32,24,19", "--voxel-mm", "2,2,4"];
    place.refuses("attach", &shorter, 65, &["core.raw", "30730 bytes", "29184", "--skip-bytes"]);
    place.refuses("attach", &["C1", &raw, "--raw", "32,24,20"], 65, &["--voxel-mm"]);
    place.refuses("attach", &["C1", &raw, "--raw", "32,24"], 2, &["three numbers"]);
    place.refuses("attach", &["C1", &mha, "--voxel-mm", "2,2,4"], 2, &["--stack"]);
    let tiny = ["C1", &mha, "--stack", "--voxel-mm", "0.01,0.01,0.01"];
    place.refuses("attach", &tiny, 65, &["hardly a grain"]);
    for member in ["C1", "B1"] {
        place.done("detach", &[member, "core 1"]);
    }
    assert!(!place.path("bridge/evidence").exists() && place.attached().is_empty());
}

/// Rows with a date and no load test are what a gauge has read over the years.
#[test]
fn gauges_are_read_over_the_years() {
    let place = Place::new();
    let rows: String = (1..=9)
        .map(|month| format!("2025-{month:02}-15 08:00;SG1;{month};{}\n", 2 * month))
        .collect();
    let csv = place.brings("since.csv", format!("date;gauge;value;temperature_c\n{rows}"));
    let told = place.done("attach", &["C1", &csv, "--unit", "ue"]);
    let added = &told["added"][0];
    assert_eq!(
        [&added["name"], &added["kind"], &added["value"]],
        ["SG1", "monitoring", "9 readings"]
    );
    let hot = place.brings("hot.csv", "date,gauge,value,temperature_c\n2025-01-02,SG1,3,280\n");
    place.refuses("attach", &["C1", &hot, "--unit", "ue"], 65, &["hot.csv:2", "kelvin"]);
    let no_gauge = place.brings("t.csv", "mV,temperature_c\n-300,4\n");
    place.refuses("attach", &["C1", &no_gauge], 65, &["temperature_c", "take it out"]);
    place.done("detach", &["C1", "since"]);
    assert!(place.attached().is_empty());
}

/// A finding's photograph is copied with it, and goes with it.
#[test]
fn findings_have_pictures() {
    let place = Place::new();
    let picture = place.slice("crack.png");
    let crack = ["C1", "--crack", "0.3", "--course", "along", "--along", "0.2"];
    place.done("attach", &[&crack[..], &["--picture", &picture]].concat());
    assert!(place.evidence().contains("picture: \"evidence/C1_crack_1/crack.png\""));
    let text = place.brings("note.txt", "no picture");
    place.refuses("attach", &[&crack[..], &["--picture", &text]].concat(), 65, &["JPEG"]);
    let broken = place.brings("broken.jpg", "no picture");
    place.refuses("attach", &[&crack[..], &["--picture", &broken]].concat(), 65, &["no picture"]);
    place.done("detach", &["C1", "crack 1"]);
    assert!(!place.path("bridge/evidence").exists());
}

/// A photograph goes with its picks, and is refused where it cannot be placed.
#[test]
fn photographs_are_attached_with_their_picks() {
    let place = Place::new();
    let photo = place.slice("front.png");
    let picks = place.brings("front.csv", "u,v,x,y,z\n1,2,0,0,0\n");
    let attach = ["C1", &photo, "--pose", &picks];
    place.refuses("attach", &attach, 65, &["front.png", "pick"]);
    place.refuses("attach", &[&attach[..], &["--along", "0.4"]].concat(), 2, &["its picks tell"]);
    let text = place.brings("front.heic", "ftypheic");
    place.refuses("attach", &["C1", &text, "--pose", &picks], 65, &["front.heic"]);
    let bad = place.brings("bad.csv", "u,v,x\n1,2,3\n");
    place.refuses("attach", &["C1", &photo, "--pose", &bad], 65, &["bad.csv"]);
    assert!(!place.path("bridge/evidence").exists());
}

#[test]
fn what_lies_in_the_way_is_left_alone() {
    let place = Place::with_evidence();
    let csv = place.brings("t.csv", "mV\n-300\n");
    fs::create_dir_all(place.path("bridge/evidence/C1_t")).unwrap();
    place.refuses("attach", &["C1", &csv], 73, &["C1_t", "--name"]);
}

/// What the program had to assume, it says at once.
#[test]
fn what_was_assumed_is_said() {
    let place = Place::new();
    let profile = place.run("attach", &["C1", "--chloride", "5:0.1", "--of-concrete"]);
    let said = String::from_utf8_lossy(&profile.stderr).into_owned();
    assert!(profile.status.success() && said.contains("350 kg of cement"), "{said}");
    let slice = place.slice("s.png");
    let nowhere = place.run("attach", &["C1", &slice, "--pixel-mm", "2"]);
    let said = String::from_utf8_lossy(&nowhere.stderr).into_owned();
    assert!(nowhere.status.success() && said.contains("add along"), "{said}");
    assert!(!said.contains("350 kg"), "{said}");
}

#[test]
fn a_scene_file_is_as_good_as_its_folder() {
    let place = Place::new();
    fs::rename(place.path("bridge/scene.ron"), place.path("bridge/pier.ron")).unwrap();
    let scene = place.path("bridge/pier.ron");
    let attached = run(&["attach", text(&scene), "B1", "--cover", "25", "--face", "bottom"]);
    assert!(attached.status.success(), "{}", String::from_utf8_lossy(&attached.stderr));
    let info = run(&["validate", text(&scene), "--format", "json"]);
    assert!(info.status.success(), "{}", String::from_utf8_lossy(&info.stdout));
    assert!(place.evidence().contains("face: Bottom, shows: Cover(mm: 25.0)"));
}

#[test]
fn nonsense_is_refused_before_anything_is_written() {
    let place = Place::with_evidence();
    let cover = ["--cover", "32"];
    let with = |more: &[&'static str]| [&["C1"], &cover[..], more].concat();
    // of the command line
    place.refuses("attach", &["C1"], 2, &["FILE"]);
    place.refuses("attach", &with(&["--rust", "1"]), 2, &["--rust"]);
    place.refuses("attach", &with(&["--along", "x"]), 2, &["0.3,0.5"]);
    place.refuses("attach", &with(&["--face", "upside"]), 2, &["crown"]);
    place.refuses("attach", &with(&["--face", "front", "--angle", "3"]), 2, &["--angle"]);
    place.refuses("attach", &with(&["--date", "2026-02-30"]), 2, &["no calendar"]);
    place.refuses("attach", &with(&["--unit", "mm"]), 2, &["--unit"]);
    place.refuses("attach", &with(&["--course", "along"]), 2, &["--crack"]);
    place.refuses("attach", &with(&["--depth-mm", "3"]), 2, &["--spall"]);
    place.refuses("attach", &["C1", "--crack", "0.3"], 2, &["--course"]);
    place.refuses("attach", &["C1", "--core-strength", "40"], 2, &["--diameter-mm"]);
    place.refuses("attach", &["C1", "--chloride", "5"], 2, &["5:1.1,15:0.6"]);
    place.refuses("attach", &["C1", "--intact", "--std-error", "1"], 2, &["has no error"]);
    let csv = place.brings("t.csv", "mV\n-300\n");
    place.refuses("attach", &["C1", &csv, "--course", "map"], 2, &["--crack"]);
    place.refuses("attach", &["C1", &csv, "--std-error", "1"], 2, &["its column"]);
    place.refuses("attach", &["C1", &csv, "--bars-bare"], 2, &["--spall"]);
    place.refuses("attach", &["C1", &csv, "--rust", "1"], 2, &["--rust"]);
    // of the member and the place
    place.refuses("attach", &["C2", "--intact"], 65, &["\"C2\"", "did you mean \"C1\"?"]);
    place.refuses("attach", &["pier north", "--intact"], 65, &["there are \"B1\", \"C1\""]);
    place.refuses("attach", &with(&["--along", "1.2"]), 65, &["along: 1.2 is outside 0 to 1"]);
    place.refuses("attach", &with(&["--along", "0.5,0.3"]), 65, &["turn them round"]);
    place.refuses("attach", &with(&["--face", "crown"]), 65, &["face: Crown", "Front, Right"]);
    place.refuses("attach", &with(&["--height", "7"]), 65, &["height_m: 7 m is above C1"]);
    place.refuses("attach", &with(&["--date", "2126-05-03"]), 65, &["is the year right?"]);
    place.refuses("attach", &with(&["--name", "mine"]), 65, &["already", "--name"]);
    place.refuses("attach", &["C1", "--cover", "0.03"], 65, &["mm: 0.03", "in mm"]);
    place.refuses("attach", &["C1", "--half-cell", "-0.38"], 65, &["write -380"]);
    // of files
    let csv = |text: &str| place.brings("t.csv", text);
    place.refuses("attach", &["C1", "none.csv"], 66, &["none.csv", "check the path"]);
    place.refuses(
        "attach",
        &["C1", &csv("along,x\n0,1\n")],
        65,
        &["t.csv:1", "no column says", "\"x\" is not known"],
    );
    place.refuses("attach", &["C1", &csv("along\n0\n")], 65, &["t.csv:1", "mV"]);
    place.refuses("attach", &["C1", &csv("value\n3\n")], 65, &["t.csv:1", "kind and unit"]);
    place.refuses("attach", &["C1", &csv("gauge,value\nSG1,3\n")], 65, &["t.csv:1", "ue, m/m"]);
    let readings = csv("gauge,value\nSG1,3\n");
    let folder = text(place.0.path());
    let line = format!("{folder}/t.csv:2: column value");
    place.refuses("attach", &["C1", &readings, "--unit", "mm"], 65, &[&line, "ue or m/m"]);
    place.refuses("attach", &["C1", &readings, "--unit", "kN"], 65, &["kN", "ue, m/m"]);
    place.refuses("attach", &["B1", &readings, "--unit", "ue"], 65, &["SG1 is on C1"]);
    place.refuses("attach", &["C1", &readings, "--pixel-mm", "1"], 2, &["CT slices"]);
    let with_test = ["C1", &readings, "--unit", "ue", "--test", "bus"];
    place.refuses("attach", &with_test, 65, &["\"bus\"", "add it"]);
    place.refuses("attach", &["C1", &readings, &readings], 2, &["alone"]);
    let volts = csv("mV\n-300\n");
    place.refuses("attach", &["C1", &volts, "--unit", "mm"], 65, &["unit does not fit"]);
    let values = csv("value\n3\n");
    let unit = ["C1", &values, "--kind", "half-cell", "--unit", "mm"];
    place.refuses("attach", &unit, 65, &["mV or V"]);
    // of slices
    let slice = place.slice("s.png");
    place.refuses("attach", &["C1", &slice], 65, &["s.png", "pixel_mm"]);
    place.refuses("attach", &["C1", &slice, "--pixel-mm", "0.01"], 65, &["hardly a grain"]);
    place.refuses("attach", &["C1", &slice, "--unit", "mm"], 2, &["of a table"]);
    let bad = place.brings("bad.tif", "no picture");
    place.refuses("attach", &["C1", &bad, "--pixel-mm", "2"], 65, &["bad.tif"]);
    let word = place.brings("report.docx", "PK");
    place.refuses("attach", &["C1", &word], 65, &["report.docx", ".csv"]);
    place.refuses("attach", &["C1", text(&place.path("bridge"))], 65, &["bridge", ".csv"]);
    let stars = place.slice("s*.png");
    place.refuses("attach", &["C1", &stars, "--pixel-mm", "2"], 65, &["rename it"]);
}

#[test]
fn what_is_not_attached_is_not_detached() {
    let place = Place::with_evidence();
    place.refuses("detach", &["C1", "mne"], 65, &["did you mean \"mine\"?"]);
    place.refuses("detach", &["B1", "mine"], 65, &["--list"]);
    place.refuses("detach", &["C1"], 2, &["NAME"]);
    place.refuses("detach", &[], 2, &["MEMBER"]);
    let csv = place.brings("t.csv", "mV\n-300\n");
    place.done("attach", &["C1", &csv]);
    place.refuses("detach", &["C1", "t 1"], 65, &["is a row of", "detach \"t\""]);
    // A scene that does not load any more can be mended.
    fs::remove_file(place.path("bridge/evidence/C1_t/t.csv")).unwrap();
    place.refuses("detach", &["--list"], 66, &["tables[0].file", "check the path"]);
    place.done("detach", &["C1", "t"]);
    assert_eq!(place.attached().len(), 1);
}

#[test]
fn where_there_is_no_scene_nothing_is_attached() {
    let place = Place::new();
    fs::remove_file(place.path("bridge/scene.ron")).unwrap();
    place.refuses("attach", &["C1", "--intact"], 66, &["bridge", "scene.ron", "intrados import"]);
    fs::write(place.path("bridge/scene.ron"), SCENE.replace("height_m: 3", "height_m: -3"))
        .unwrap();
    place.refuses("attach", &["C1", "--intact"], 65, &["members[0].body.height_m"]);
    fs::write(place.path("bridge/scene.ron"), SCENE).unwrap();
    fs::write(place.path("bridge/evidence.ron"), "(schema: \"intrados.evidence/1\", items: [")
        .unwrap();
    place.refuses("attach", &["C1", "--intact"], 65, &["evidence.ron:1:"]);
    fs::write(place.path("bridge/evidence.ron"), "(schema: \"intrados.evidence/7\")").unwrap();
    place.refuses("detach", &["C1", "mine"], 65, &["intrados.evidence/1"]);
}

#[test]
fn wrong_units_are_told() {
    let place = Place::new();
    let table = |name: &str, rows: &str| {
        place.brings(name, format!("gauge,value,along,face,depth_mm\n{rows}"))
    };
    let refused = |member: &str, file: &str, unit: &str, words: &[&str]| {
        place.refuses("attach", &[member, file, "--unit", unit], 65, words);
    };
    let large = table("large.csv", "G1,10,0.5,front,\nG2,12,0.5,front,\nG3,11,0.5,front,\n");
    let words = ["large.csv:2", "1000 %", "unit ue", "2 more rows have the same fault"];
    refused("C1", &large, "m/m", &words);
    let counts = table("counts.csv", "G1,250000,0.5,front,\n");
    refused("C1", &counts, "ue", &["counts.csv:2", "25 %", "amplifier"]);
    let small = table("small.csv", "G1,4e-5,0.5,front,\nG2,0,0.5,front,\n");
    refused("C1", &small, "ue", &["small.csv: column value", "unit m/m"]);
    let far = table("far.csv", "D1,-12,0.5,bottom,\n");
    refused("B1", &far, "m", &["far.csv:2", "more than B1 is long", "unit mm"]);
    let deep = table("deep.csv", "G1,40,0.5,front,700\n");
    refused("C1", &deep, "ue", &["deep.csv:2", "700 mm is deeper than C1"]);
    // What is small and what is large is taken.
    place.done("attach", &["C1", &small, "--unit", "m/m"]);
    let nought = table("nought.csv", "G9,0,0.5,front,\n");
    place.done("attach", &["C1", &nought, "--unit", "ue"]);
    let spall = ["C1", "--spall", "0.1", "--depth-mm", "700"];
    place.refuses("attach", &spall, 65, &["depth_mm: 700 mm is deeper"]);
    let newtons = ["B1", "--load-test", "car", "--force-kn", "60000", "--along", "0.5"];
    place.refuses("attach", &newtons, 65, &["crushes the whole section of B1", "write 60"]);
    let slice = place.slice("core.png");
    let cut = |mm, diameter, depth| {
        [
            "C1",
            &slice,
            "--pixel-mm",
            mm,
            "--diameter-mm",
            diameter,
            "--along",
            "0.5",
            "--depth-mm",
            depth,
        ]
    };
    place.refuses("attach", &cut("50", "100", "30"), 65, &["core.png", "µm?"]);
    place.refuses("attach", &cut("3", "100", "30"), 65, &["144 mm across", "core 100 mm", "µm"]);
    place.refuses("attach", &cut("2", "100", "600"), 65, &["depth_m: 600 mm is deeper than C1"]);
    // 96 mm of a core in 128 mm of picture.
    place.done("attach", &cut("2", "100", "30"));
}

#[test]
fn what_a_gauge_has_shown_counts_once() {
    let place = Place::with_evidence();
    let csv = place.brings("load test.csv", "gauge,value,test\nSG1,41.5,truck\n");
    place.done("attach", &["C1", &csv, "--unit", "ue"]);
    let copy = place.brings("copy.csv", "gauge,value,test\nSG1,41.5,truck\n");
    let words = ["copy.csv:2", "SG1 shows what", "load test.csv:2", "leave one"];
    place.refuses("attach", &["C1", &copy, "--unit", "ue"], 65, &words);
    let other = place.brings("other.csv", "gauge,value,test\nSG1,41.6,truck\n");
    place.done("attach", &["C1", &other, "--unit", "ue"]);
}

#[test]
fn columns_that_nobody_knows_are_passed_over_and_said() {
    let place = Place::new();
    let csv = place.brings("hc.csv", "along,mV,comment,x_m\n0.5,-310,wet,1.5\n");
    let output = place.run("attach", &["C1", &csv, "--format", "json"]);
    let said = String::from_utf8(output.stderr).unwrap();
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let note = "hc.csv: the columns comment, x_m are not known";
    assert!(said.contains(note) && !said.contains(".attach-"), "{said}");
    assert!(told["notes"][0].as_str().unwrap().contains(note), "{told}");
    for (name, text, words) in [
        ("alog.csv", "alog,mV\n0.5,-310\n", &["alog", "did you mean along?"][..]),
        ("angle.csv", "angle,mV\n0,-310\n", &["angle", "says no unit", "angle_deg"]),
        (
            "none.csv",
            "Position,reading\n0.5,-310\n",
            &["no column says", "Position, reading", "mV"],
        ),
    ] {
        let csv = place.brings(name, text);
        place.refuses("attach", &["C1", &csv], 65, words);
    }
}

#[test]
fn attached_at_once_all_are_there() {
    let place = Place::with_evidence();
    let folder = place.path("bridge");
    let all: Vec<_> = (0..8)
        .map(|_| {
            let mut command = common::program();
            command.args(["attach", text(&folder), "C1", "--rust", "0.1", "--quiet"]);
            command.stdout(std::process::Stdio::null()).spawn().unwrap()
        })
        .collect();
    assert!(all.into_iter().all(|mut child| child.wait().unwrap().success()));
    assert_eq!(place.attached().len(), 9);
    let names: Vec<PathBuf> =
        fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into()).collect();
    assert_eq!(names.len(), 2, "{names:?}");
}

#[test]
fn what_is_no_number_and_no_name_is_told() {
    let place = Place::new();
    for option in ["--rust", "--cover", "--half-cell", "--spall", "--rebound"] {
        place.refuses("attach", &["C1", option, "nan"], 2, &[option, "not a number"]);
    }
    place.refuses("attach", &["C1", "--crack", "nan", "--course", "map"], 2, &["not a number"]);
    place.refuses("attach", &["C1", "--chloride", "5:nan"], 2, &["numbers"]);
    let more = |option, value| ["C1", "--cover", "30", option, value];
    for option in ["--along", "--std-error", "--height", "--angle"] {
        place.refuses("attach", &more(option, "nan"), 2, &[option, "not a number"]);
    }
    place.refuses("attach", &["C1", "--cover", "0,3"], 2, &["write 0.3"]);
    place.refuses("attach", &more("--name", " "), 65, &["the name is empty"]);
    let photo = place.brings("core.jpg", "");
    place.refuses("attach", &["C1", &photo], 65, &["photograph", "--pose", "--picture"]);
}

/// People know members by their names, and faces.
#[test]
fn members_and_faces_are_said_by_their_names() {
    let place = Place::new();
    let named = SCENE.replace("(id: \"B1\",", "(id: \"1kTv$9xQ\", name: \"north girder\",");
    fs::write(place.path("bridge/scene.ron"), named).unwrap();
    let told = place.run("attach", &["north girder", "--rust", "0.1", "--face", "bottom"]);
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(told.contains("rust 1 of north girder") && told.contains("bottom"), "{told}");
    let list = String::from_utf8(place.run("detach", &["--list"]).stdout).unwrap();
    assert!(list.contains("north girder") && list.contains("bottom"), "{list}");
    assert!(!list.contains("1kTv$9xQ") && !list.contains('°'), "{list}");
    let words = ["there are \"C1\", \"north girder\""];
    place.refuses("attach", &["pier", "--intact"], 65, &words);
    let told = place.run("detach", &["north girder", "rust 1"]);
    assert!(String::from_utf8(told.stdout).unwrap().contains("rust 1 of north girder"));
}

#[test]
fn what_is_dated_before_its_member_was_built_is_refused() {
    let place = Place::new();
    let aged = SCENE.replace(
        "height_m: 3), concrete: \"C30/37\"",
        "height_m: 3), concrete: \"C30/37\", exposure: (class: \"XC4\", years: 20)",
    );
    fs::write(place.path("bridge/scene.ron"), aged).unwrap();
    let on = |date| ["C1", "--carbonation", "12", "--along", "0.5", "--date", date];
    place.refuses("attach", &on("1899-05-03"), 65, &["date: 1899-05-03", "before C1 was built"]);
    let csv = place.brings("old.csv", "along,mV,date\n0.5,-310,1951-05-03\n");
    place.refuses("attach", &["C1", &csv], 65, &["date: 1951-05-03"]);
    place.done("attach", &on("2020-05-03"));
    // Nobody says how old this one is.
    place.done("attach", &["B1", "--rust", "0.1", "--date", "1951-05-03"]);
}

/// Of what is not used, all that can be told without computing is told by `validate`.
#[test]
fn validate_says_what_a_member_cannot_hear() {
    let place = Place::new();
    let scene = SCENE.replace(
        "height_m: 3), concrete: \"C30/37\"",
        "height_m: 3, reinforcement: (cover_mm: 40, bars: [Around(count: 8, diameter_mm: 16)])), concrete: \"C30/37\", exposure: (class: \"XC4\", years: 20)",
    );
    fs::write(place.path("bridge/scene.ron"), scene).unwrap();
    let warned = || {
        let output = run(&["validate", text(&place.path("bridge/scene.ron")), "--format", "json"]);
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        let all = told["files"][0]["problems"].as_array().unwrap().clone();
        all.into_iter()
            .filter(|p| p["code"] == "NOT_USED")
            .map(|p| {
                format!("{}: {}", p["place"].as_str().unwrap(), p["message"].as_str().unwrap())
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(warned(), [] as [String; 0]);
    for args in [
        &["C1", "--carbonation", "12", "--along", "0.5"][..],
        &["C1", "--half-cell", "-310", "--along", "0.5"],
        &["C1", "--chloride", "5:1,15:0.5", "--along", "0.5"],
        &["B1", "--half-cell", "-310", "--along", "0.5"],
        &["B1", "--cover", "40", "--along", "0.5"],
        &["B1", "--rebound", "40", "--along", "0.5"],
    ] {
        place.done("attach", args);
    }
    let told = warned();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].contains("chloride 1") && told[0].contains("no salt"), "{told:?}");
    assert!(told[1].contains("evidence of B1") && told[1].contains("and 1 more"), "{told:?}");
    assert!(told[1].contains("none are known of the member"), "{told:?}");
}

/// A project whose folder is called as a bundled scene is the project.
#[test]
fn a_project_is_known_before_a_bundled_scene_of_its_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("column")).unwrap();
    let mut command = program();
    command.current_dir(folder.path()).args(["new", "column", "column/scene.ron"]);
    assert!(command.output().unwrap().status.success());
    let mut command = program();
    let output = command.current_dir(folder.path()).args(["info", "column"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("A column") && !text.contains("hall"), "{text}");
}
