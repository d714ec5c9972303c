//! The scene file: what is refused, where, and that nothing panics.
#![allow(clippy::unwrap_used, reason = "helpers of tests may fall over")]

use std::path::Path;

use intrados_scene::{
    ErrorKind, LampKind, LoadError, MemberKind, Part, Scene, bundled,
    file::{self, MAX_BYTES},
    parametric,
    structure::BarEnd,
};
use intrados_stage::Job;
use proptest::prelude::*;

const HEAD: &str = "(\n    schema: \"intrados.scene/1\",\n";

fn scene_of(body: &str) -> String {
    format!("{HEAD}{body})")
}

/// All that is wrong with a scene text, as lines.
fn problems(text: &str) -> Vec<String> {
    match file::parse("s.ron", text) {
        Ok(scene) => file::check(&scene).iter().map(ToString::to_string).collect(),
        Err(problem) => vec![problem.to_string()],
    }
}

/// Loads a scene text from a folder of its own.
fn load(text: &str) -> Result<Scene, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &Job::default())
}

#[test]
fn an_empty_scene_is_a_scene() {
    assert_eq!(problems(&scene_of("")), Vec::<String>::new());
}

/// What some editors put before a text, and a name with a slip of the finger.
#[test]
fn a_byte_order_mark_is_no_fault_and_a_misspelt_scene_is_guessed() {
    assert_eq!(problems(&format!("\u{feff}{}", scene_of(""))), Vec::<String>::new());
    let guess = |name: &str| Scene::open(name.as_ref(), &Job::default()).unwrap_err().to_string();
    assert!(
        guess("colum").ends_with("did you mean the bundled scene column?"),
        "{}",
        guess("colum")
    );
    assert!(
        !guess("bridge.ron").contains("did you mean")
            && !guess("somewhere/else").contains("did you mean")
    );
}

/// Place and words of the message, for one fault each.
#[test]
fn faults_are_named_with_their_place_and_remedy() {
    let column = |body: &str| {
        format!(
            "    members: [(id: \"C1\", body: Column(section: Round(diameter_m: 0.4), height_m: 3){body})],\n"
        )
    };
    let reinforced = |more: &str| {
        column("")
            .replace("height_m: 3", &format!("height_m: 3, reinforcement: (cover_mm: 30, {more})"))
    };
    let camera = |more: &str| {
        format!("    cameras: [(name: \"a\", position: (0, 0, 3), target: (0, 0, 0), {more})],\n")
    };
    for (body, place, words) in [
        // syntax and schema
        ("    colour: 1,\n".into(), "s.ron:3:5", "colour"),
        ("    camera: [],\n".into(), "s.ron:3:5", "did you mean `cameras`"),
        ("    materials: [(name: \"a\", color: (1, 1, 1))],\n".into(), "s.ron:3:29", "did you mean `colour`"),
        ("    shapes: [Quad(corner: (0, 0, 0), u: (1, 0, 0), w: (0, 1, 0))],\n".into(), "s.ron:3:52", "unexpected field named `w`"),
        ("    shapes: [Sphere(radius: 1)],\n".into(), "s.ron:3:14", "or `Mesh` instead; `intrados schema"),
        ("    shapes: [Sphere(radius: 1)],\n".into(), "s.ron:3:14", "shows each of them"),
        ("    shapes: [Quad(corner: (0, 0, 0), u: (1, 0, 0))],\n".into(), "s.ron:3:", "add `v: …`"),
        ("    title: \"a\",\n    title: \"b\",\n".into(), "s.ron:4:5", "keep one"),
        ("    materials: [(name: \"a\" colour: (1, 1, 1))],\n".into(), "s.ron:3:", "comma"),
        ("    materials: [(name: 7)],\n".into(), "s.ron:3:", "string"),
        ("    lamps: [Point(name: \"a\", position: (0, 0), strength: Watt(1))],\n".into(), "s.ron:3:", "expected"),
        (column("").replace("height_m: 3", "height_m: 3,5"), "s.ron:3:", "write 3.5, not 3,5"),
        (column("").replace("diameter_m: 0.4", "diameter_m: 0,4"), "s.ron:3:", "write 0.4, not 0,4"),
        // names
        ("    materials: [(name: \"a\"), (name: \"a\")],\n".into(), "materials[1].name", "twice"),
        ("    materials: [(name: \" \")],\n".into(), "materials[0].name", "empty"),
        (format!("{}{}", column(""), "    details: [(member: \"C2\")],\n"), "details[0].member", "there are C1"),
        (column(", material: \"gold\""), "members[0].material", "gold"),
        (column(", concrete: \"strong\""), "members[0].concrete", "C30/37"),
        (reinforced("steel: \"S235\", bars: []"), "members[0].body.reinforcement.steel", "B500B"),
        (reinforced("steel: \"S1860-rubbish\", bars: []"), "members[0].body.reinforcement.steel", "f_y_mpa"),
        (reinforced("f_y_mpa: 235e6, bars: []"), "members[0].body.reinforcement.f_y_mpa", "outside 150 to 1000"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, from: 0.4, to: 0.3)]"), "members[0].body.reinforcement.bars[0].from", "to a later one"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, to: 1.2)]"), "members[0].body.reinforcement.bars[0].from", "both from 0 to 1"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, from: NaN)]"), "members[0].body.reinforcement.bars[0].from", "both from 0 to 1"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 0.05, length_mm: 600)])]"), "members[0].body.reinforcement.bars[0].laps[0].at", "move or shorten it"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20), Around(count: 8, diameter_mm: 20, to: 0.009)]"), "members[0].body.reinforcement.bars[1].to", "let them end beyond 0.010"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, from: 0.995)]"), "members[0].body.reinforcement.bars[0].from", "let them begin before 0.990"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 0.007, length_mm: 12)])]"), "members[0].body.reinforcement.bars[0].laps[0].at", "nothing is left of the bars before it: let it end beyond 0.010"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 0.995, length_mm: 12)])]"), "members[0].body.reinforcement.bars[0].laps[0].at", "let it begin before 0.990"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, to: 0.5, laps: [(at: 0.45, length_mm: 600)])]"), "members[0].body.reinforcement.bars[0].laps[0].at", "end before 0.500"),
        (
            reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 0.6, length_mm: 600), (at: 0.3, length_mm: 600)])]"),
            "members[0].body.reinforcement.bars[0].laps[1].at",
            "in their order",
        ),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 0.5, length_mm: NaN)])]"), "members[0].body.reinforcement.bars[0].laps[0].length_mm", "outside 10 to 10000"),
        (reinforced("bars: [Around(count: 8, diameter_mm: 20, laps: [(at: 1.5, length_mm: 600)])]"), "members[0].body.reinforcement.bars[0].laps[0].at", "outside 0 to 1"),
        (reinforced("bars: [Around(count: 400, diameter_mm: 20)]"), "members[0].body.reinforcement.bars", "100 % of the section"),
        (column(", concrete: \"C30/20\""), "members[0].concrete", "C30/37"),
        ("    supports: [(member: \"X\", place: Start, hold: Fixed)],\n".into(), "supports[0].member", "there is none"),
        (format!("{}{}", column(""), "    supports: [(member: \"C1\", place: Top, hold: Symmetry)],\n"), "supports[0].place", "write Start or End"),
        (format!("{}{}", column(""), "    supports: [(member: \"C1\", place: Surface(from: 1, to: 1), hold: Symmetry)],\n"), "supports[0].place", "write Start or End"),
        (format!("{}{}", column(""), "    supports: [(member: \"C1\", place: End, hold: Symmetry, alone: true)],\n"), "supports[0].alone", "own other half"),
        (
            "    models: [(file: \"a.glb\")], supports: [(member: \"W\", place: End, hold: Symmetry)],\n".into(),
            "supports[0].hold",
            "by Directions",
        ),
        (
            "    members: [(id: \"T\", body: Tunnel(radius_m: 2, length_m: 4, inner_lining: (thickness_m: 0.3), \
             pipe: (thickness_mm: 20, cushion_mm: 30, cushion_mpa: 1000)))], supports: [(member: \"T\", place: End, hold: Symmetry)],\n"
                .into(),
            "supports[0].hold",
            "place: Pipe(0)",
        ),
        (format!("{}{}", column(""), "    joints: [(of: (\"C1\", \"Y\"), kind: Hinge)],\n"), "joints[0].of.1", "there are C1"),
        (format!("{}{}", column(""), "    joints: [(of: (\"C1\", \"C1\"), kind: Bearing)],\n"), "joints[0].of", "with itself"),
        ("    readings: [(of: \"g\", value: 1, std_error: 1)],\n".into(), "readings[0].of", "no gauge"),
        // ranges
        ("    materials: [(name: \"a\", colour: (1.5, 0, 0))],\n".into(), "materials[0].colour", "outside 0 to 1"),
        ("    materials: [(name: \"a\", colour: (NaN, 0, 0))],\n".into(), "materials[0].colour", "outside"),
        ("    shapes: [Quad(corner: (0, 0, 0), u: (1, 0, 0), v: (2, 0, 0))],\n".into(), "shapes[0].v", "no area"),
        ("    shapes: [Box(centre: (0, 0, 0), size: (1, 0, 1))],\n".into(), "shapes[0].size", "above 0"),
        (camera("fov_deg: 180, width: 8, height: 8"), "cameras[0].fov_deg", "below 180"),
        (camera("fov_deg: 0, width: 8, height: 8"), "cameras[0].fov_deg", "above 0"),
        (camera("fov_deg: 60, width: 0, height: 8"), "cameras[0].width", "1 to 16384"),
        (camera("fov_deg: 60, width: 8, height: 16385"), "cameras[0].height", "1 to 16384"),
        (camera("fov_deg: 60, width: 8, height: 8, up: (0, 0, 0)"), "cameras[0].up", "direction"),
        ("    lamps: [Point(name: \"l\", position: (0, 0, 0), strength: Lux(1))],\n".into(), "lamps[0].strength", "Lumen"),
        ("    lamps: [Directional(name: \"l\", direction: (0, -1, 0), strength: Watt(1))],\n".into(), "lamps[0].strength", "Lux"),
        ("    lamps: [Environment(), Environment()],\n".into(), "lamps", "keep one"),
        (column(", truth: [Voids(from: 0.5, to: 0.2, porosity: 0.1, median_mm: 1)]"), "members[0].truth[0].to", "beyond"),
        (column(", slices: [Drawn(name: \"a\", count: 1, size: 100000, pixel_mm: 1)]"), "members[0].slices[0].size", "16384"),
        (column(", slices: [Scanned(name: \"a\", scanner: \"x\", along: [0.5])]"), "members[0].slices[0].scanner", "there is none"),
        (
            "    members: [(id: \"T\", body: Tunnel(radius_m: 3, length_m: 400, segments: (count: 90, ring_m: 0.1, thickness_m: 0.3)))],\n"
                .into(),
            "members[0].body.segments.ring_m",
            "more than",
        ),
        (
            "    members: [(id: \"C\", body: Column(section: Round(diameter_m: 0.1), height_m: 3, reinforcement: (cover_mm: 40, bars: \
             [Around(count: 4, diameter_mm: 12)])))],\n"
                .into(),
            "members[0].body.reinforcement.cover_mm",
            "do not fit",
        ),
    ] {
        let found = problems(&scene_of(&body));
        let first = found.first().unwrap_or_else(|| panic!("nothing wrong was found in {body}"));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            first.starts_with(place) && first.to_lowercase().contains(&words.to_lowercase()),
            "{body}\n→ {first}\nexpected {place} … {words}"
        );
        assert!(!first.contains('\n'));
    }
}

#[test]
fn all_problems_are_listed() {
    let text = scene_of(
        "materials: [(name: \"\", colour: (2, 0, 0))], cameras: [(name: \"a\", position: (0,0,0), target: (0,0,0), fov_deg: 200, width: 0, height: 1)],",
    );
    assert_eq!(problems(&text).len(), 5, "{:?}", problems(&text));
    let error = load(&text).unwrap_err();
    assert_eq!((error.kind(), error.problems().len()), (ErrorKind::BadInput, 5));
    assert!(error.to_string().contains("4 more") && !error.to_string().contains('\n'), "{error}");
}

#[test]
fn validate_lists_what_load_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let list = |path: &Path| intrados_scene::validate(path, &Job::default());
    assert_eq!(
        list(&path("a.ron", &scene_of("materials: [(name: \"\"), (name: \"\")],"))).unwrap().len(),
        3
    );
    assert_eq!(
        list(&path("b.ron", &scene_of("shapes: [Box(centre: (0, 0, 0), size: (1, 1, 1))],")))
            .unwrap()
            .len(),
        1
    );
    assert_eq!(list(Path::new("column")).unwrap(), []);
    let damaged = path("c.gltf", "{\"asset\": {}}");
    assert!(!list(&damaged).unwrap().is_empty());
    let error = Scene::load(&damaged, &Job::default()).unwrap_err();
    assert!(error.kind() == ErrorKind::BadInput && !error.to_string().contains('\n'), "{error}");
    assert_eq!(list(Path::new("/nonexistent.glb")).unwrap_err().kind(), ErrorKind::NoInput);
}

/// `cover_mm: 0.035` was meant in metres; a class that EN 206 does not know has no default of
/// anything.
#[test]
fn cover_in_metres_and_foreign_classes_are_refused() {
    let column = parametric::template("column").unwrap();
    let refused = |from: &str, to: &str| load(&column.replace(from, to)).unwrap_err().to_string();
    assert!(refused("cover_mm: 35", "cover_mm: 0.035").contains("in millimetres"));
    assert!(refused("\"XC3\"", "\"XD9\"").contains("none of EN 206's classes"));
    assert!(load(&column.replace("\"XC3\"", "\"XC4, XD3/XF4\"")).is_ok());
}

/// A deep beam has bars down its web: how far in a row may lie is up to the measure across its side.
#[test]
fn a_row_lies_as_deep_as_its_own_side_allows() {
    let beam = |side: u32| {
        problems(&scene_of(&format!(
            "members: [(id: \"B\", body: Beam(section: Rectangle(width_m: 0.2, depth_m: 0.8), length_m: 4, \
             reinforcement: (cover_mm: 30, bars: [Row(side_deg: {side}, count: 2, diameter_mm: 12, inset_mm: 350)])))],"
        )))
    };
    assert_eq!(beam(0), Vec::<String>::new());
    let refused = beam(90);
    assert_eq!(refused.len(), 1, "{refused:?}");
    assert!(refused[0].contains("inset_mm") && refused[0].contains("0 to 100"), "{refused:?}");
}

#[test]
fn the_schema_is_asked_for() {
    assert!(problems("()")[0].contains("schema"));
    let other = problems("(\n  schema: \"intrados.scene/9\",\n)");
    assert!(
        other[0].starts_with("s.ron:2:3: ") && other[0].contains("intrados.scene/1"),
        "{other:?}"
    );
}

/// Small texts that ask for a lot of steel.
#[test]
fn what_would_exhaust_memory_is_refused() {
    let beam = |i: usize| {
        format!(
            "(id: \"B{i}\", body: Beam(section: Rectangle(width_m: 1, depth_m: 1), length_m: 2000, reinforcement: (cover_mm: 30, bars: \
             [Around(count: 900, diameter_mm: 8)], stirrups: (diameter_mm: 8, spacing_mm: 110)))),"
        )
    };
    let members =
        |n: usize| scene_of(&format!("members: [{}],", (0..n).map(beam).collect::<String>()));
    assert_eq!(problems(&members(1)), Vec::<String>::new());
    assert!(problems(&members(40))[0].contains("more than"));
    let meters =
        "Patch(name: \"a\", corner: (0, 0, 0), u: (1, 0, 0), v: (0, 1, 0)),".repeat(20_000);
    assert!(problems(&scene_of(&format!("meters: [{meters}],")))[0].contains("20000 entries"));
}

/// Brackets, comments and strings without end: an error, and soon.
#[test]
fn deep_and_endless_texts_are_refused() {
    let n = 200_000;
    for text in [
        "(".repeat(n),
        "[".repeat(n),
        "Some(".repeat(n),
        "/*".repeat(n),
        scene_of(&format!("materials: {}", "[(name: ".repeat(n))),
        scene_of(&format!("title: {}", "Some(".repeat(n))),
        scene_of(&format!("grading: {}", "Some(".repeat(n))),
        scene_of(&format!("title: r{}\"", "#".repeat(n))),
        scene_of(&format!("title: \"{}", "a".repeat(n))),
        scene_of(&format!("title: \"a\", {}", "/*".repeat(n))),
        scene_of(&format!("nothing: {}{}", "[".repeat(n), "]".repeat(n))),
        "\u{0}".repeat(n),
    ] {
        let line = &problems(&text)[0];
        assert!(line.starts_with("s.ron:") && line.len() < 500, "{line}");
    }
    assert!(problems(&" ".repeat(MAX_BYTES + 1))[0].contains("MiB"));
}

/// Every number of every bundled scene, made into what is no number or no measure: refused, never
/// loaded, never a panic.
#[test]
fn no_number_may_be_infinite() {
    let mut tried = 0;
    for (name, text) in
        bundled().iter().filter(|(n, _)| ["column", "beam", "tunnel", "cornell"].contains(n))
    {
        for (at, number) in numbers(text) {
            for bad in ["NaN", "inf", "-inf", "1e400"] {
                let broken = format!("{}{bad}{}", &text[..at], &text[at + number.len()..]);
                assert!(
                    !problems(&broken).is_empty(),
                    "{name}: {bad} for {number} in …{}",
                    &text[at.saturating_sub(60)..at + 10]
                );
                tried += 1;
            }
        }
    }
    assert!(tried > 4000, "{tried}");
}

/// Places of the numbers outside strings and comments.
fn numbers(text: &str) -> Vec<(usize, &str)> {
    let bytes = text.as_bytes();
    let mut list = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        if bytes[i] == b'"' {
            i += 1 + text[i + 1..].find('"').unwrap();
        } else if text[i..].starts_with("//") {
            i += text[i..].find('\n').unwrap();
        } else if bytes[i].is_ascii_digit()
            && !bytes[i - 1].is_ascii_alphanumeric()
            && bytes[i - 1] != b'_'
        {
            let begin = if bytes[i - 1] == b'-' { i - 1 } else { i };
            while matches!(bytes[i], b'0'..=b'9' | b'.') {
                i += 1;
            }
            list.push((begin, &text[begin..i]));
        }
        i += 1;
    }
    list
}

#[test]
fn what_is_missing_is_missing_and_what_is_wrong_is_wrong() {
    let nowhere = Path::new("/nonexistent/x.ron");
    assert_eq!(Scene::load(nowhere, &Job::default()).unwrap_err().kind(), ErrorKind::NoInput);
    for file in [
        "shapes: [Mesh(file: \"x.obj\")],",
        "models: [(file: \"x.glb\")],",
        "lamps: [Environment(image: \"x.exr\")],",
    ] {
        let error = load(&scene_of(file)).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NoInput, "{error}");
        assert!(error.to_string().contains("no such file"), "{error}");
    }
    let slices = "members: [(id: \"C\", body: Column(section: Round(diameter_m: 1), height_m: 3), slices: [Files(name: \"a\", images: [\"*.tif\"], \
                  pixel_mm: 1)])],";
    assert_eq!(load(&scene_of(slices)).unwrap_err().kind(), ErrorKind::NoInput);
    assert_eq!(
        load(&scene_of("models: [(file: \"${HOME}/x.glb\")],")).unwrap_err().kind(),
        ErrorKind::BadInput
    );
    let folder = tempfile::tempdir().unwrap();
    let odd = folder.path().join("a.txt");
    std::fs::write(&odd, "x").unwrap();
    assert_eq!(Scene::load(&odd, &Job::default()).unwrap_err().kind(), ErrorKind::BadInput);
    let binary = folder.path().join("a.ron");
    std::fs::write(&binary, [0xff, 0xfe, 0x00]).unwrap();
    assert!(Scene::load(&binary, &Job::default()).unwrap_err().to_string().contains("UTF-8"));
}

/// Every project's file is called `scene.ron`: it is the folder that tells them apart.
#[test]
fn a_project_is_called_as_its_folder_and_any_other_scene_as_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let bridge = folder.path().join("Bridge 7.2");
    std::fs::create_dir(&bridge).unwrap();
    let called = |path: &Path| Scene::open(path, &Job::default()).unwrap().name;
    for name in ["scene.ron", "pier.ron"] {
        let body = "shapes: [Box(centre: (0, 0, 0), size: (1, 1, 1))],";
        std::fs::write(bridge.join(name), scene_of(body)).unwrap();
    }
    assert_eq!(called(&bridge), "Bridge 7.2");
    assert_eq!(called(&bridge.join("scene.ron")), "Bridge 7.2");
    assert_eq!(called(&bridge.join("./scene.ron")), "Bridge 7.2");
    std::fs::create_dir(bridge.join("photos")).unwrap();
    assert_eq!(called(&bridge.join("photos/../scene.ron")), "Bridge 7.2");
    assert_eq!(called(&bridge.join("pier.ron")), "pier");
}

#[test]
fn a_cancelled_load_stops() {
    let job = Job::default();
    job.cancel();
    assert_eq!(Scene::load_bundled("tunnel", &job).unwrap_err(), LoadError::Cancelled);
}

/// Images, masks and meshes beside the scene are found, checked and part of the hash.
#[test]
fn the_files_of_a_scene_are_in_its_hash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    let text = scene_of(
        "shapes: [Mesh(file: \"tetra.obj\", emission: (1, 1, 1))],
        members: [(id: \"C\", body: Column(section: Round(diameter_m: 1), height_m: 3),
            slices: [Files(name: \"a\", images: [\"core_*.tif\"], pixel_mm: 1)])],",
    );
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("scene.ron", &text);
    write(
        "tetra.obj",
        "# four faces\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf -4/1 -1/1 -2/1\n",
    );
    for name in
        ["core_1.tif", "core_2.tif", "core_2_mask-void.tif", "core_2_mask-liquid.tif", "other.tif"]
    {
        write(name, name);
    }
    let load = || Scene::load(&path, &Job::default());
    let first = load().unwrap();
    assert!((first.meshes[0].volume() - 1.0 / 6.0).abs() < 1e-7);
    match &first.members[0].slices[0] {
        intrados_scene::Slices::Files { images, masks, .. } => {
            assert_eq!(images.len(), 2);
            assert_eq!(masks.iter().map(Vec::len).collect::<Vec<_>>(), [0, 2]);
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(load().unwrap().hash, first.hash);
    for name in ["core_1.tif", "core_2_mask-void.tif"] {
        write(name, "changed");
        assert_ne!(load().unwrap().hash, first.hash, "{name}");
        write(name, name);
    }
    write("other.tif", "changed");
    assert_eq!(load().unwrap().hash, first.hash);
    write("tetra.obj", "v 0 0 nan\nf 1 2 3\n");
    let error = load().unwrap_err().to_string();
    assert!(error.contains("tetra.obj:1:1"), "{error}");
}

#[test]
fn templates_load_and_say_what_they_are() {
    for (kind, member) in
        [("column", MemberKind::Column), ("beam", MemberKind::Beam), ("tunnel", MemberKind::Lining)]
    {
        let scene =
            load(parametric::template(kind).unwrap()).unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!(scene.members[0].kind, member);
        assert!(
            !scene.meters.is_empty()
                && !scene.structure.supports.is_empty()
                && !scene.structure.loads.is_empty()
        );
        assert!(
            scene.members.iter().all(|m| m.slices.is_empty() && m.truth.is_empty()),
            "{kind}: nobody has measured or planted anything"
        );
    }
    assert!(parametric::template("bridge").is_none());
}

/// What templates show in comments can be used as it stands.
#[test]
fn comments_of_templates_load() {
    for kind in ["column", "beam", "tunnel"] {
        let template = parametric::template(kind).unwrap();
        let shown = |line: &str, keys: &[&str]| {
            let text = line
                .trim_start()
                .strip_prefix("// ")
                .filter(|t| keys.iter().any(|k| t.starts_with(k)) && !t.contains("Files("));
            text.unwrap_or(line).to_owned() + "\n"
        };
        let uncommented =
            |keys: &[&str]| template.lines().map(|l| shown(l, keys)).collect::<String>();
        let scene = load(&uncommented(&["truth:", "slices:", "tests:", "gauges:", "readings:"]))
            .unwrap_or_else(|e| panic!("{kind}: {e}"));
        assert!(scene.warnings.is_empty(), "{kind}: {:?}", scene.warnings);
        assert_eq!((scene.members[0].truth.len(), scene.members[0].slices.len()), (2, 1), "{kind}");
        assert_eq!(
            (
                scene.structure.tests.len(),
                scene.structure.gauges.len(),
                scene.structure.readings.len()
            ),
            (1, 1, 1),
            "{kind}"
        );
    }
}

/// Watt, candela, lumen and lux of one lamp: the same light.
#[test]
fn units_of_lamps_agree() {
    let intensity = |strength: &str| {
        let scene = load(&scene_of(&format!(
            "lamps: [Point(name: \"l\", position: (0, 0, 0), strength: {strength})],"
        )))
        .unwrap();
        match scene.lamps[0].kind {
            LampKind::Point { intensity, .. } => intensity.y,
            _ => panic!(),
        }
    };
    let four_pi = 4.0 * std::f32::consts::PI;
    for strength in [
        "WattPerSteradian(2)".into(),
        "Candela(1366)".into(),
        format!("Lumen({})", 1366.0 * four_pi),
        format!("Watt({})", 2.0 * four_pi),
    ] {
        assert!((intensity(&strength) - 2.0).abs() < 1e-5, "{strength}");
    }
}

#[test]
fn an_unnamed_material_is_assumed_and_said() {
    let scene = load(&scene_of("shapes: [Box(centre: (0, 0, 0), size: (1, 1, 1))],")).unwrap();
    assert!(scene.materials[scene.objects[0].material].assumed);
    assert_eq!(scene.warnings.len(), 1);
    assert_eq!(scene.summary().materials_assumed.len(), 1);
}

/// Members as meshes, against their closed forms; steel lies inside and has its weight.
#[test]
fn members_have_their_volume_and_their_steel_inside() {
    for name in ["column", "beam", "tunnel"] {
        let scene = Scene::load_bundled(name, &Job::default()).unwrap();
        for (i, member) in scene.members.iter().enumerate() {
            let parts = || scene.objects.iter().filter(|o| o.member == Some(i));
            let concrete: f64 = parts()
                .filter(|o| o.part == Part::Concrete)
                .map(|o| scene.meshes[o.mesh].volume())
                .sum();
            // A circle is cut into 96 chords: 0.07 % less.
            assert!(
                (concrete / member.volume - 1.0).abs() < 1.5e-3,
                "{}: {concrete} for {}",
                member.id,
                member.volume
            );
            assert!(
                (member.frame.zero.length() - 1.0).abs() < 1e-6
                    && member.frame.zero.dot(member.frame.axis).abs() < 1e-5
            );
            for object in parts().filter(|o| o.part != Part::Concrete) {
                assert!(scene.meshes[object.mesh].volume() > 0.0, "{}", object.name);
                for p in &scene.meshes[object.mesh].positions {
                    let p = object.transform.transform_point3(*p);
                    assert!(
                        p.cmpge(member.bounds[0]).all() && p.cmple(member.bounds[1]).all(),
                        "{} leaves {}",
                        object.name,
                        member.id
                    );
                    if member.kind == MemberKind::Lining {
                        let from_axis = (p - member.frame.start)
                            .reject_from(member.frame.axis.normalize())
                            .length();
                        assert!((2.75..3.2).contains(&from_axis), "{}", object.name);
                    }
                }
            }
        }
    }
}

#[test]
fn column_c1_has_its_steel() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let steel: f64 = scene
        .objects
        .iter()
        .filter(|o| o.member == Some(0) && o.part == Part::Bar)
        .map(|o| scene.meshes[o.mesh].volume())
        .sum();
    // 12 bars of 20 mm, 3 m less the cover at both ends
    let expected = 12.0 * std::f64::consts::PI * 0.01_f64.powi(2) * (3.0 - 0.08);
    assert!((steel / expected - 1.0).abs() < 1e-4, "{steel} {expected}");
    assert_eq!(
        scene.objects.iter().filter(|o| o.member == Some(0) && o.part == Part::Bar).count(),
        12
    );
}

/// Bars of a turned column are drawn along their lines, with hooks where these are bent.
#[test]
fn hooked_bars_are_drawn_as_they_are_bent() {
    let bars = "Around(count: 8, diameter_mm: 20, ends: (Straight, Hooked), laps: [(at: 0.5, length_mm: 1200)])";
    let scene = load(&scene_of(&format!(
        "members: [(id: \"C\", turn_deg: 30, at: (5, 1, 2), body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.6), height_m: 6, reinforcement: (cover_mm: 40, bars: [{bars}])))],"
    )))
    .unwrap();
    let drawn: Vec<_> = scene.objects.iter().filter(|o| o.part == Part::Bar).collect();
    let steel = &scene.structure.assemblies[0].steel;
    assert_eq!((drawn.len(), steel.len()), (16, 16));
    for (object, line) in drawn.iter().zip(steel) {
        let bent = line.bent();
        let is_hooked = line.ends[1] == BarEnd::Hooked;
        assert_eq!(bent.len(), if is_hooked { 7 } else { 2 }, "{line:?}");
        let mesh = &scene.meshes[object.mesh];
        let length: f32 = bent.windows(2).map(|w| w[0].distance(w[1])).sum();
        let volume = std::f64::consts::PI * 0.01_f64.powi(2) * f64::from(length);
        assert!((mesh.volume() / volume - 1.0).abs() < 0.02, "{} {volume}", mesh.volume());
        for point in [bent[0], bent[bent.len() - 1]] {
            let off = |p: &glam::Vec3| object.transform.transform_point3(*p).distance(point);
            let nearest = mesh.positions.iter().map(off).fold(f32::INFINITY, f32::min);
            assert!(nearest < 0.011, "{nearest} {line:?}");
        }
    }
}

/// Two rings of four segments, the second turned and shorter: their steel is drawn along its lines,
/// each in the segment that it is called after, under its cover at faces and joints.
#[test]
fn segments_have_their_steel_inside() {
    let scene = load(&scene_of(
        "members: [(id: \"T\", body: Tunnel(radius_m: 2, length_m: 2.5, segments: (count: 4, ring_m: 1.5, thickness_m: 0.3, first_joint_deg: 20, stagger_deg: 45, joint: (gap_mm: 10), \
            reinforcement: (cover_mm: 35, f_y_mpa: 480, hoops: (diameter_mm: 12, spacing_mm: 150), bars: (count: 9, diameter_mm: 8)))))],",
    ))
    .unwrap();
    let steel = &scene.structure.assemblies[0].steel;
    // Within 1.41 m (less joint and cover) ten hoops, within .91 m seven.
    assert_eq!(steel.len(), 4 * 2 * ((10 + 9) + (7 + 9)));
    let drawn: Vec<_> = scene.objects.iter().filter(|o| o.part != Part::Concrete).collect();
    assert_eq!(drawn.len(), steel.len());
    for (line, object) in steel.iter().zip(drawn) {
        let member = &scene.members[object.member.unwrap()];
        assert_eq!(object.name, format!("T/{}", line.name));
        assert!(object.name.starts_with(&format!("{} ", member.id)), "{}", object.name);
        assert_eq!(line.grade.unwrap().yield_mpa, 480.0);
        let [ring, segment] = [4, 7].map(|at| member.id[at - 1..at].parse::<f32>().unwrap());
        let first = 20.0 + 45.0 * (ring - 1.0) + 90.0 * (segment - 1.0);
        let [from, to] = if ring == 1.0 { [0.0, 1.5] } else { [1.5, 2.5] };
        let free = 0.035 + 0.5 * line.diameter - 1e-4;
        for p in line.bent() {
            let r = p.truncate().length();
            assert!((2.0 + free..=2.3 - free).contains(&r), "{} at {p}", line.name);
            let z = (p.z - scene.members[0].frame.start.z).abs();
            assert!((from + free..=to - free).contains(&z), "{} at {p}", line.name);
            let turned = (p.y.atan2(p.x).to_degrees() - first).rem_euclid(360.0).to_radians();
            let room = free - 0.5 * line.diameter;
            let joint = (r * turned).min(r * (90f32.to_radians() - turned));
            assert!(joint >= room, "{} at {p}: {joint}", line.name);
            let off = |q: &glam::Vec3| object.transform.transform_point3(*q).distance(p);
            let nearest =
                scene.meshes[object.mesh].positions.iter().map(off).fold(f32::INFINITY, f32::min);
            assert!(nearest < 0.55 * line.diameter, "{nearest} {}", line.name);
        }
    }
    let thin = load(&scene_of(
        "members: [(id: \"T\", body: Tunnel(radius_m: 2, length_m: 1, segments: (count: 4, ring_m: 1, thickness_m: 0.1, reinforcement: (cover_mm: 40, hoops: (diameter_mm: 12, spacing_mm: 150)))))],",
    ));
    let why = thin.unwrap_err().to_string();
    assert!(why.contains("segments.reinforcement.cover_mm"), "{why}");
}

/// A tunnel of segments alone is held and loaded by its own name, and not one of its segments.
#[test]
fn a_tunnel_is_held_and_loaded_as_a_whole() {
    let of = |id: &str| {
        load(&scene_of(&format!(
            "members: [(id: \"T\", body: Tunnel(radius_m: 2, length_m: 1, segments: (count: 4, ring_m: 1, thickness_m: 0.2)))], \
             supports: [(member: \"{id}\", place: Start, hold: Fixed)], \
             loads: [(name: \"jack\", members: [\"{id}\"], action: SelfWeight)],"
        )))
    };
    of("T").unwrap();
    let attacked = |steel: &str| {
        load(&scene_of(&format!(
            "members: [(id: \"T\", body: Tunnel(radius_m: 2, length_m: 1, segments: (count: 4, ring_m: 1, thickness_m: 0.2{steel})), exposure: (class: \"XC2\", years: 9))], \
             details: [(member: \"T/R1/S2\", exposure: (class: \"XD2\", years: 9))],"
        )))
        .unwrap()
        .warnings
    };
    let said =
        |warnings: &[String]| warnings.iter().any(|w| w.contains("T/R1/S2") && w.contains("XC2"));
    assert!(said(&attacked(", reinforcement: (hoops: (diameter_mm: 10, spacing_mm: 200))")));
    assert!(!said(&attacked("")));
    let why = of("T/R1/S2").unwrap_err().to_string();
    assert!(why.contains("supports[0].member") && why.contains("write \"T\""), "{why}");
    let why = of("T/R2/S2").unwrap_err().to_string();
    assert!(why.contains("no member has the id"), "{why}");
}

/// A turned column's meter stands on its turned face.
#[test]
fn meters_follow_turned_members() {
    let text = |turn: i32| {
        scene_of(&format!(
            "members: [(id: \"C\", turn_deg: {turn}, at: (5, 1, 2), body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.6), height_m: 3))],
            meters: [Surface(name: \"m\", on: \"C\", along: 0.5, angle_deg: 0, size_m: 0.1)],"
        ))
    };
    let meter = load(&text(0)).unwrap().meters[0].clone();
    assert!(
        (meter.normal() - glam::Vec3::Z).length() < 1e-5 && (meter.corner.z - 2.301).abs() < 1e-4,
        "{meter:?}"
    );
    let meter = load(&text(90)).unwrap().meters[0].clone();
    assert!(
        (meter.normal() - glam::Vec3::X).length() < 1e-5 && (meter.corner.x - 5.301).abs() < 1e-4,
        "{meter:?}"
    );
    assert!((meter.area() - 0.01).abs() < 1e-6);
}

/// A scene written as glTF and read again has the same members.
#[test]
fn members_survive_gltf() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("column.glb");
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    parametric::write_glb(&path, &scene).unwrap();
    let again = Scene::load(&path, &Job::default()).unwrap();
    let what = |s: &Scene| {
        s.members
            .iter()
            .map(|m| (m.id.clone(), m.name.clone(), m.kind, m.concrete.clone()))
            .collect::<Vec<_>>()
    };
    assert_eq!(what(&again), what(&scene));
    let count = |s: &Scene, part: Part| s.objects.iter().filter(|o| o.part == part).count();
    for part in [Part::Concrete, Part::Bar, Part::Stirrup] {
        assert_eq!(count(&again, part), count(&scene, part));
    }
    for (a, b) in again.members.iter().zip(&scene.members) {
        assert!((a.volume / b.volume - 1.0).abs() < 2e-3, "{} {}", a.volume, b.volume);
        assert!(
            (a.frame.axis - b.frame.axis).length() < 1e-4
                && (a.frame.zero - b.frame.zero).length() < 1e-4
        );
    }

    // In a scene: moved, twice, with a meter on it and details about it.
    let text = scene_of(
        "models: [(file: \"column.glb\", transform: (translate: (10, 0, 0), rotate_deg: (0, 90, 0))), (file: \"column.glb\")],
        details: [(member: \"C1 #2\", concrete: \"C50/60\")],
        meters: [Surface(name: \"m\", on: \"C1\", along: 0.5, angle_deg: 0, size_m: 0.1)],",
    );
    let file = folder.path().join("scene.ron");
    std::fs::write(&file, &text).unwrap();
    let both = Scene::load(&file, &Job::default()).unwrap();
    assert_eq!(both.members.len(), 8);
    let second = both.members.iter().find(|m| m.id == "C1 #2").unwrap();
    assert_eq!(second.concrete, "C50/60");
    // C1's front looked along +z; turned by 90° about y it looks along +x
    assert!((both.meters[0].normal() - glam::Vec3::X).length() < 1e-4, "{:?}", both.meters[0]);
    std::fs::write(&file, text.replace("C1 #2", "C9")).unwrap();
    let error = Scene::load(&file, &Job::default()).unwrap_err();
    assert!(error.kind() == ErrorKind::BadInput && error.to_string().contains("C9"), "{error}");
}

/// Both cannot be tried in one run: setting a variable is unsafe in Rust 2024.
#[test]
fn intrados_data_is_found_or_asked_for() {
    let text = scene_of("models: [(file: \"${INTRADOS_DATA}/models/infra_bridge.glb\")],");
    match (load(&text), std::env::var_os("INTRADOS_DATA")) {
        (Ok(scene), Some(_)) => {
            assert_eq!(scene.members.iter().filter(|m| m.kind == MemberKind::Column).count(), 7)
        }
        (Err(error), None) => {
            assert_eq!(error.kind(), ErrorKind::NoInput);
            assert!(error.to_string().contains("set INTRADOS_DATA"), "{error}");
        }
        (result, data) => panic!("{:?} with INTRADOS_DATA = {data:?}", result.map(|s| s.name)),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Bytes of good scenes, changed, cut, doubled, moved: an answer, whatever it is.
    #[test]
    fn mutated_scenes_do_not_panic(which in 0..9_usize, edits in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..6_u8, any::<u8>()), 1..12)) {
        let mut text = bundled()[which % bundled().len()].1.as_bytes().to_vec();
        for (at, to, how, byte) in edits {
            let (a, b) = (at.index(text.len()), to.index(text.len()));
            let (low, high) = (a.min(b), a.max(b).min(a.min(b) + 300));
            match how {
                0 => text[a] = byte,
                1 => text.insert(a, b"()[]{}\",:#/*-.0123456789eE"[usize::from(byte) % 26]),
                2 => drop(text.drain(low..high)),
                3 => { let part = text[low..high].to_vec(); text.splice(low..low, part); }
                4 => text.truncate(a.max(1)),
                _ => { let other = bundled()[usize::from(byte) % bundled().len()].1.as_bytes(); let i = to.index(other.len()); text.splice(a..a, other[i..other.len().min(i + 200)].iter().copied()); }
            }
            if text.is_empty() {
                text.push(b' ');
            }
        }
        let text = String::from_utf8_lossy(&text);
        for line in problems(&text) {
            prop_assert!(!line.is_empty() && !line.contains('\n'));
        }
    }
}
