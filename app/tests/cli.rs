//! The command line as users and scripts meet it: the real program, run.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, read};
use intrados_stage::Job;
use intrados_xray::volume::Reader;
use serde_json::Value;

use common::{program, run, text};

fn code(args: &[&str]) -> i32 {
    run(args).status.code().unwrap()
}

/// Runs to a good end and reads the JSON that is all of stdout.
fn json(args: &[&str]) -> Value {
    let output = run(&[args, &["--format", "json", "--quiet"]].concat());
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A small picture of the bundled room from both sides, into `out`.
fn render<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [
        &[
            "render", "room", "--side", "both", "--width", "24", "--height", "16", "--spp", "400",
            "--out", out,
        ],
        more,
    ]
    .concat()
}

fn exr_bytes(out: &Path) -> Vec<u8> {
    fs::read(out.join("room.exr")).unwrap()
}

/// Pixel (x, y) of a channel.
fn exr_value(path: &Path, channel: &str, [x, y]: [usize; 2]) -> f32 {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let layer = &image.layer_data[0];
    let found = layer.channel_data.list.iter().find(|c| c.name.to_string() == channel).unwrap();
    found.sample_data.values_as_f32().nth(y * layer.size.0 + x).unwrap()
}

#[test]
fn exit_codes_say_what_went_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &str| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let broken = file("broken.ron", "(schema: \"intrados.scene/1\", shapes: [Quad(");
    let wrong = file(
        "wrong.ron",
        "(schema: \"intrados.scene/1\", cameras: [(name: \"c\", position: (0,0,0), target: (0,0,0), fov_deg: 400)])",
    );
    let data = file(
        "data.ron",
        "(schema: \"intrados.scene/1\", models: [(file: \"${INTRADOS_DATA}/x.glb\")])",
    );
    let model = file("model.glb", "glTF, but not really");
    let rubbish = file("rubbish.acc", "no accumulator");
    let other = file("notes.txt", "hello");
    let empty = file("empty.tif", "");
    let mesh = file("mesh.msh", "$MeshFormat\n4.1 0 8\n");
    let groups = file("said.ron", GROUPS);
    let deck = file("deck.inp", "*NODE\n1,0,0\n*ELEMENT, TYPE=C3D8\n1,1,2,3,4,5,6,7,8\n");
    let below_a_file = format!("{}/sub", text(&other));
    let cases: &[(i32, &[&str])] = &[
        (2, &["render"]),
        (2, &["render", "room", "--spp", "many"]),
        (2, &["render", "room", "--camera", "nobody"]),
        (2, &["render", "room", "--shard", "0/2"]),
        (2, &["render", "room", "--replay", "99,99,0"]),
        (2, &["measure", "room", "--sensor", "nobody"]),
        (2, &["scan"]),
        (2, &["scan", "column", "--member", "nobody"]),
        (2, &["scan", "column", "--scanner", "nobody"]),
        (2, &["scan", "column", "--correct", "everything"]),
        (2, &["scan", "column", "--along", "1.5"]),
        (2, &["analyze", text(&deck)]),
        (2, &["analyze", text(&deck), "--units", "in,lbf"]),
        (2, &["analyze", text(&deck), "--units", "m,N", "--member", "C1"]),
        (2, &["analyze", "column", "--units", "m,N"]),
        (65, &["analyze", "tunnel", "--member", "T1", "--element", "0.55"]),
        (65, &["analyze", text(&deck), "--units", "m,N"]),
        (2, &["analyze", "column", "--groups", text(&other)]),
        (2, &["analyze", text(&deck), "--units", "m,N", "--groups", text(&other)]),
        (65, &["analyze", text(&mesh), "--units", "m,N", "--groups", text(&other)]),
        (65, &["analyze", text(&mesh), "--units", "m,N", "--groups", text(&groups)]),
        (66, &["analyze", text(&mesh), "--units", "m,N"]),
        (66, &["analyze", "/does/not/exist.inp", "--units", "m,N"]),
        (2, &["frobnicate"]),
        (2, &["view"]),
        (2, &[]),
        (3, &["measure", "room", "--target-rel-error", "1e-9", "--spp", "1"]),
        (65, &["info", text(&broken)]),
        (65, &["render", text(&broken)]),
        (65, &["info", text(&wrong)]),
        (65, &["validate", text(&wrong)]),
        (65, &["info", text(&model)]),
        (65, &["info", text(&other)]),
        (65, &["merge", text(&rubbish)]),
        (65, &["detect", text(&other)]),
        (65, &["detect", "--method", "classical", text(&empty)]),
        (2, &["detect", "--method", "guess", text(&other)]),
        (65, &["scan", "room"]),
        (65, &["scan", "--sinogram", text(&other), "--pixel-mm", "1"]),
        (65, &["scan", "--sinogram", text(&empty), "--pixel-mm", "1"]),
        (66, &["scan", "--sinogram", "/does/not/exist.tif"]),
        (66, &["scan", "/does/not/exist.ron"]),
        (
            73,
            &[
                "scan",
                "column",
                "--member",
                "C1",
                "--size",
                "16",
                "--projections",
                "8",
                "--out",
                &below_a_file,
            ],
        ),
        (66, &["info", "/does/not/exist.ron"]),
        (66, &["validate", "/does/not/exist.glb"]),
        (66, &["info", "no_such_bundled_scene"]),
        (66, &["merge", "/does/not/exist.acc"]),
        (66, &["detect", "/does/not/exist.tif"]),
        (73, &["render", "room", "--spp", "1", "--out", &below_a_file]),
        (
            73,
            &[
                "render",
                "room",
                "--spp",
                "1",
                "--out",
                text(folder.path()),
                "--checkpoint",
                &below_a_file,
            ],
        ),
        (73, &["new", "column", &format!("{below_a_file}/c.ron")]),
        (73, &["new", "column", text(&broken)]),
        (0, &["info", "room"]),
        (0, &["validate", "scenes/room.ron"]),
        (0, &["--help"]),
        (0, &["render", "--help"]),
        (0, &["--version"]),
    ];
    for (expected, args) in cases {
        let output = program()
            .args(*args)
            .current_dir(folder.path())
            .env_remove("INTRADOS_DATA")
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(*expected), "{args:?}: {stderr}");
        if *expected >= 65 && args[0] != "validate" {
            assert_eq!(stderr.trim().lines().count(), 1, "{args:?}: one line, not {stderr}");
            assert!(output.stdout.is_empty(), "{args:?}");
        }
    }
    let unset = program().args(["info", text(&data)]).env_remove("INTRADOS_DATA").output().unwrap();
    assert_eq!(unset.status.code(), Some(66));
    assert!(String::from_utf8_lossy(&unset.stderr).contains("INTRADOS_DATA"));
}

/// A cube between two plates, in mm and MPa: 10 MPa on top. Files in the folder, numbers in SI.
#[test]
fn a_deck_is_analyzed() {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("cube.inp");
    let text_of = |load: &str, hold: &str| {
        format!(
            "*NODE, NSET=ALL\n1,0,0,0\n2,100,0,0\n3,100,100,0\n4,0,100,0\n5,0,0,100\n6,100,0,100\n7,100,100,100\n8,0,100,100\n\
             *ELEMENT, TYPE=C3D8, ELSET=BOX\n1,1,2,3,4,5,6,7,8\n*MATERIAL, NAME=C\n*ELASTIC\n30000,0\n\
             *SOLID SECTION, ELSET=BOX, MATERIAL=C\n*BOUNDARY\n{hold}*STEP\n*STATIC\n*DLOAD\n{load}*NODE FILE\nU\n*END STEP\n"
        )
    };
    fs::write(&deck, text_of("1,P2,10\n", "1,1,3\n2,2,3\n3,3\n4,1\n4,3\n")).unwrap();
    let out = folder.path().join("out");
    let found = json(&["analyze", text(&deck), "--units", "mm,N", "--out", text(&out)]);
    assert_eq!(found["schema"], "intrados.analyze/1");
    assert_eq!(found["scene"], "cube");
    assert_eq!(found["elements"], 1);
    assert!(
        (found["members"][0]["peak_compression_pa"].as_f64().unwrap() / -10e6 - 1.0).abs() < 1e-6,
        "{found}"
    );
    assert!(
        (found["steps"][0]["max_displacement_m"].as_f64().unwrap() / (0.1 * 10.0 / 30000.0) - 1.0)
            .abs()
            < 1e-6,
        "{found}"
    );
    for name in ["cube.pvd", "cube.csv", "analyze.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    // What floats is an error with the deck's label, and no result.
    fs::write(&deck, text_of("1,P2,10\n", "1,1,2\n2,2\n4,1\n")).unwrap();
    let output = run(&["analyze", text(&deck), "--units", "mm,N"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(65), "{stderr}");
    assert!(
        stderr.contains("of 8 nodes around node 1 is free to")
            && stderr.trim().lines().count() == 1
            && output.stdout.is_empty(),
        "{stderr}"
    );
}

/// What a mesh of a cube is: 10 MPa on its head.
const GROUPS: &str = "(schema: \"intrados.groups/1\", materials: [(modulus_gpa: 30, poisson: 0)], \
    supports: [(group: \"foot\", x: true, y: true, z: true)], \
    loads: [(group: \"head\", action: Pressure(pressure_kpa: 10000))])";

/// The cube of the deck as a mesh of Gmsh, and what its groups are beside it.
#[test]
fn a_mesh_is_analyzed_by_what_its_groups_are() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, out) = (folder.path().join("cube.msh"), folder.path().join("out"));
    let text_of = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 1 \"foot\"\n2 2 \"head\"\n$EndPhysicalNames\n\
        $Nodes\n8\n1 0 0 0\n2 100 0 0\n3 100 100 0\n4 0 100 0\n5 0 0 100\n6 100 0 100\n7 100 100 100\n8 0 100 100\n$EndNodes\n\
        $Elements\n3\n1 3 2 1 1 1 2 3 4\n2 3 2 2 2 5 6 7 8\n3 5 2 3 1 1 2 3 4 5 6 7 8\n$EndElements\n";
    fs::write(&mesh, text_of).unwrap();
    fs::write(folder.path().join("cube.groups.ron"), GROUPS).unwrap();
    let found = json(&["analyze", text(&mesh), "--units", "mm,N", "--out", text(&out)]);
    assert_eq!(found["schema"], "intrados.deck/1");
    assert_eq!(found["deck"], "cube");
    let step = &found["steps"][0];
    let off = |value: &serde_json::Value, exact: f64| value.as_f64().unwrap() / exact - 1.0;
    assert!(off(&step["max_displacement_m"], 0.1 * 10.0 / 30000.0).abs() < 1e-6, "{found}");
    assert!(off(&step["max_von_mises_pa"], 10e6).abs() < 1e-6, "{found}");
    for name in ["displacements.csv", "stresses.csv", "step_0001.vtu", "analyze.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
}

#[test]
fn validate_lists_all_problems() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.ron");
    let scene = "(schema: \"intrados.scene/1\", cameras: [
        (name: \"c\", position: (0,0,0), target: (0,0,0), fov_deg: 400, width: 0, height: 10)])";
    fs::write(&path, scene).unwrap();
    let output = run(&["validate", text(&path), "room", "--format", "json", "-q"]);
    assert_eq!(output.status.code(), Some(65));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["schema"], "intrados.validate/1");
    let places: Vec<&str> = report["files"][0]["problems"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["place"].as_str().unwrap())
        .collect();
    for field in ["target", "fov_deg", "width"] {
        assert!(
            places.iter().any(|p| p.contains(&format!("cameras[0].{field}"))),
            "{field} is not among {places:?}"
        );
    }
    assert_eq!(report["files"][1]["errors"], 0);
}

#[test]
fn a_new_scene_is_a_good_scene() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["column", "beam", "tunnel"] {
        for extension in ["ron", "glb"] {
            let path = folder.path().join(format!("{kind}.{extension}"));
            let made = json(&["new", kind, text(&path)]);
            assert_eq!(made["schema"], "intrados.new/1");
            assert_eq!(code(&["validate", text(&path)]), 0, "{kind}.{extension}");
            let beside = folder.path().join(format!("{kind}.evidence.ron"));
            assert_eq!(
                made["files"].as_array().unwrap().len(),
                1 + usize::from(extension == "ron")
            );
            if extension == "ron" {
                // Nothing is said yet, and it is read with the scene.
                let evidence = fs::read_to_string(&beside).unwrap();
                assert!(evidence.contains("// (member:") && evidence.contains("Efflorescence("));
                assert_eq!(code(&["new", kind, text(&path)]), 73);
                fs::remove_file(&path).unwrap();
                assert_eq!(code(&["new", kind, text(&path)]), 73, "{}", beside.display());
                assert_eq!(code(&["new", kind, text(&path), "--force"]), 0);
                fs::write(&beside, evidence.replace("// (", "(")).unwrap();
                // Its examples name files that are not there.
                assert_eq!(code(&["validate", text(&path)]), 66);
                fs::write(&beside, evidence).unwrap();
            }
            let output = run(&["info", text(&path), "--format", "json"]);
            let info: Value = serde_json::from_slice(&output.stdout).unwrap();
            let members = info["scenes"][0]["members"].as_array().unwrap();
            assert!(
                !members.is_empty() && members.iter().any(|m| m["bars"].as_u64() > Some(0)),
                "{kind}.{extension}: {members:?}"
            );
        }
    }
}

#[test]
fn bent_quotes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.ron");
    fs::write(&path, "(\n    schema: “intrados.scene/1”,\n)").unwrap();
    let output = run(&["validate", text(&path)]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(65));
    assert!(said.contains("wrong.ron:2:") && said.contains("bent quote"), "{said}");
    let curly = "(schema: \"intrados.scene/1\", title: \"a “quoted” word\", x: 1)";
    fs::write(&path, curly).unwrap();
    let said = String::from_utf8(run(&["validate", text(&path)]).stdout).unwrap();
    assert!(!said.contains("bent quote"), "{said}");
}

#[test]
fn measure_keeps_its_contract() {
    let report = json(&["measure", "room", "--spp", "64"]);
    assert_eq!(report["schema"], "intrados.measure/1");
    assert_eq!(
        (&report["scene"], &report["seed"], &report["stop"]),
        (&"room".into(), &1.into(), &"spp".into())
    );
    assert_eq!(report["scene_hash"].as_str().unwrap().len(), 64);
    assert!(
        report["setup_cpu_seconds"].as_f64().unwrap() > 0.0
            && report["thresholds"]["tail_index"].is_f64()
    );
    let meters = report["meters"].as_array().unwrap();
    assert_eq!(meters.len(), 3);
    for meter in meters {
        for side in ["primal", "dual"] {
            let side = &meter[side];
            for field in [
                "mean",
                "std_error",
                "rel_var_per_walk",
                "own_cpu_seconds",
                "cpu_seconds",
                "training_cpu_seconds",
                "figure_of_merit",
                "walks",
            ] {
                assert!(side[field].is_number(), "{field}: {side}");
            }
            assert!(
                side["converged"].is_boolean()
                    && side["steered"].is_boolean()
                    && side["estimator"] == "next-event"
            );
            assert_eq!(side["max_residual"].is_number(), side["steered"] == true);
            let n = side["walks"].as_f64().unwrap();
            let rel = side["std_error"].as_f64().unwrap() / side["mean"].as_f64().unwrap();
            assert!(
                (side["rel_var_per_walk"].as_f64().unwrap() / (n * rel * rel) - 1.0).abs() < 1e-9
            );
        }
        let combined = &meter["combined"];
        for field in ["mean", "std_error", "figure_of_merit", "cpu_seconds"] {
            assert!(combined[field].is_number(), "{field}: {combined}");
        }
        assert!(
            combined["converged"].is_boolean()
                && ["primal", "dual"].contains(&combined["side"].as_str().unwrap())
        );
        assert!(meter["unit"].is_string());
        // Three z-values of a fixed seed: beyond 4 by chance once in 5000.
        assert!(meter["duality_z"].as_f64().unwrap().abs() < 4.0, "{meter}");
    }
    let eye = &meters[0]["combined"];
    let z = (eye["mean"].as_f64().unwrap() - 0.27023) / eye["std_error"].as_f64().unwrap();
    assert!(z.abs() < 4.0, "the room's reading is {z} standard errors from its reference");
}

#[test]
fn one_side_alone_is_run_and_charged() {
    let report = json(&["measure", "room", "--spp", "8", "--side", "dual", "--sensor", "eye"]);
    let meter = &report["meters"][0];
    assert!(meter.get("primal").is_none() && meter.get("duality_z").is_none());
    assert_eq!(meter["combined"]["mean"], meter["dual"]["mean"]);
    assert_eq!(meter["combined"]["cpu_seconds"], meter["dual"]["cpu_seconds"]);
}

#[test]
fn the_first_stop_rule_wins_and_is_named() {
    let stop = |more: &[&str]| {
        json(&[&["measure", "room", "--sensor", "eye"], more].concat())["stop"].clone()
    };
    assert_eq!(
        stop(&["--spp", "4000", "--time-limit", "1h", "--target-rel-error", "0.5"]),
        "target-rel-error"
    );
    assert_eq!(stop(&["--spp", "4", "--time-limit", "1h"]), "spp");
    assert_eq!(stop(&["--time-limit", "1ms"]), "time-limit");
}

#[test]
fn a_picture_has_the_same_bits_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = ["1", "2", "3"].map(|threads| {
        let out = folder.path().join(threads);
        json(&render(text(&out), &["--threads", threads]));
        exr_bytes(&out)
    });
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn files_say_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let report = json(&render(text(folder.path()), &["--seed", "7"]));
    assert_eq!(report["schema"], "intrados.render/1");
    let keys = [
        "scene",
        "width",
        "height",
        "samples",
        "cpu_seconds",
        "mean",
        "rel_error",
        "stop",
        "files",
    ];
    keys.iter().for_each(|key| assert!(!report[key].is_null(), "{key}"));
    for file in report["files"].as_array().unwrap() {
        assert!(Path::new(file.as_str().unwrap()).is_file(), "{file}");
    }
    let written: Value =
        serde_json::from_slice(&fs::read(folder.path().join("result.json")).unwrap()).unwrap();
    assert_eq!(written, report);

    let path = folder.path().join("room.exr");
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(&path)
        .unwrap();
    let layer = &image.layer_data[0];
    let about = |name: &str| match &layer.attributes.other[&exr::prelude::Text::from(name)] {
        AttributeValue::Text(text) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(about("intrados.seed"), "7");
    assert_eq!(about("intrados.sceneHash"), report["scene_hash"].as_str().unwrap());
    for name in ["version", "samples", "estimator", "unit", "relError"] {
        assert!(!about(&format!("intrados.{name}")).is_empty());
    }
    // What the orders hold is what the picture holds, to single precision.
    for pixel in [[0, 0], [5, 9], [23, 15]] {
        let sum: f32 =
            (0..8).map(|order| exr_value(&path, &format!("order{order}.G"), pixel)).sum();
        let whole = exr_value(&path, "G", pixel);
        assert!((sum - whole).abs() <= 1e-4 * whole, "{sum} {whole}");
        assert!(
            exr_value(&path, "variance.G", pixel) > 0.0
                && exr_value(&path, "samples.N", pixel) >= 400.0
        );
    }

    let decoder = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(folder.path().join("room.png")).unwrap(),
    ));
    let reader = decoder.read_info().unwrap();
    let info = reader.info();
    assert_eq!((info.width, info.height), (24, 16));
    let seed = info.utf8_text.iter().find(|t| t.keyword == "intrados.seed").unwrap();
    assert_eq!(seed.get_text().unwrap(), "7");
}

/// Sample 0 of a pixel, walked alone, is what a picture of one sample shows there, to the bit.
#[test]
fn any_sample_can_be_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let size = ["--width", "24", "--height", "16"];
    json(&[&["render", "room", "--spp", "1", "--out", text(folder.path())], &size[..]].concat());
    for [x, y] in [[0, 0], [3, 4], [23, 15], [12, 8]] {
        let replay =
            json(&[&["render", "room", "--replay", &format!("{x},{y},0")], &size[..]].concat());
        assert_eq!(replay["schema"], "intrados.replay/1");
        let side = &replay["sides"][0];
        for (channel, sum) in ["R", "G", "B"].iter().zip(side["sum"].as_array().unwrap()) {
            let shown = exr_value(&folder.path().join("room.exr"), channel, [x, y]);
            assert_eq!(sum.as_f64().unwrap() as f32, shown, "pixel {x},{y}: {side}");
        }
    }
}

#[cfg(unix)]
mod interrupted {
    use std::{
        process::{Child, Stdio},
        time::{Duration, Instant},
    };

    use super::*;

    /// Long enough to be caught in the middle.
    const LONG: [&str; 12] = [
        "render",
        "room",
        "--side",
        "both",
        "--width",
        "48",
        "--height",
        "32",
        "--spp",
        "800",
        "--threads",
        "1",
    ];

    /// Starts a long render and waits until its first checkpoint is there.
    fn start(out: &Path, checkpoint: &Path) -> Child {
        let more = [
            "--out",
            text(out),
            "--checkpoint",
            text(checkpoint),
            "--checkpoint-every",
            "0s",
            "-q",
        ];
        let mut child = program().args(LONG).args(more).stdout(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        while !checkpoint.exists() {
            assert!(begin.elapsed() < Duration::from_secs(60), "no checkpoint");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be interrupted");
        child
    }

    fn uninterrupted(out: &Path) -> Vec<u8> {
        json(&[&LONG[..10], &["--out", text(out)]].concat());
        exr_bytes(out)
    }

    fn resumed(out: &Path, checkpoint: &Path) -> Vec<u8> {
        json(&[&LONG[..10], &["--out", text(out), "--resume", text(checkpoint)]].concat());
        exr_bytes(out)
    }

    /// The records of finished parts that a run keeps in `out`.
    fn parts(out: &Path) -> Vec<PathBuf> {
        let inside = |folder: PathBuf| {
            fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
        };
        let is_record = |path: &PathBuf| path.extension().is_some_and(|e| e == "ron");
        inside(out.to_owned())
            .flat_map(|aside| inside(aside.join(".parts")))
            .filter(is_record)
            .collect()
    }

    /// Interrupts a command as soon as it has finished `after` parts of its work, and lets the same
    /// command go on: what it ends with is what it ends with alone, apart from what tells times and
    /// paths; and the parts that were finished are not done again.
    fn goes_on(args: &[&str], after: usize, list: &str, files: &[&str]) {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let (whole, broken) = (at("whole"), at("broken"));
        let out = |out: &Path| {
            [args, &["--threads", "1", "--out", text(out)]]
                .concat()
                .into_iter()
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        let ends =
            program().args(out(&whole)).args(["--quiet"]).stdout(Stdio::null()).status().unwrap();
        assert!(matches!(ends.code(), Some(0 | 3)), "{args:?}: {ends}");

        let mut child = program()
            .args(out(&broken))
            .arg("-q")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let begin = Instant::now();
        while parts(&broken).len() < after {
            assert!(
                begin.elapsed() < Duration::from_secs(300) && child.try_wait().unwrap().is_none(),
                "{args:?}: no part was kept"
            );
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(
            Command::new("kill")
                .args(["-INT", &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(child.wait().unwrap().code(), Some(130), "{args:?}");
        assert!(!broken.join(list).exists(), "{args:?}");
        let kept = parts(&broken).len();
        assert!(kept >= after, "{args:?}");

        let ended = program().args(out(&broken)).stdout(Stdio::null()).output().unwrap();
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), ends.code(), "{args:?}: {said}");
        assert!(said.contains(&format!("goes on from {kept} finished parts")), "{args:?}: {said}");
        assert_eq!(parts(&broken).len(), 0);
        for file in files {
            assert!(
                fs::read(whole.join(file)).unwrap() == fs::read(broken.join(file)).unwrap(),
                "{args:?}: {file} has other bits"
            );
        }
        let told = |folder: &Path| {
            timeless(serde_json::from_slice(&fs::read(folder.join(list)).unwrap()).unwrap())
        };
        assert_eq!(told(&whole), told(&broken), "{args:?}");
    }

    /// Without what tells times, memory and paths, which no two runs have in common.
    fn timeless(value: Value) -> Value {
        let told =
            |key: &str| ["seconds", "cpu_seconds", "peak_memory_bytes", "files"].contains(&key);
        match value {
            Value::Object(map) => map
                .into_iter()
                .filter(|(key, _)| !told(key))
                .map(|(key, value)| (key, timeless(value)))
                .collect(),
            Value::Array(list) => list.into_iter().map(timeless).collect(),
            other => other,
        }
    }

    #[test]
    fn slices_that_are_read_are_not_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let paths: Vec<PathBuf> = (0..3).map(|n| folder.path().join(format!("{n}.tif"))).collect();
        for (n, path) in paths.iter().enumerate() {
            let side = 700_u16;
            let middle = f64::from(side) / 2.0;
            let away = |i: usize| {
                ((i % usize::from(side)) as f64 - middle)
                    .hypot((i / usize::from(side)) as f64 - middle)
            };
            let grey = |i: usize| match away(i) {
                r if r > 0.9 * middle => 0,
                r if (100.0..110.0 + 30.0 * n as f64).contains(&r) => 90,
                _ => 180 + (i * i % 7) as u8,
            };
            let data = (0..usize::from(side).pow(2)).map(grey).collect();
            fs::write(path, tiff(&[([side; 2], 8, false, data)])).unwrap();
        }
        let slices: Vec<&str> = paths.iter().map(|p| text(p)).collect();
        let args = [&["detect"][..], &slices[..], &["--pixel-mm", "0.1"]].concat();
        goes_on(
            &args,
            1,
            "detect.json",
            &[
                "pores.csv",
                "cracks.csv",
                "001_0_labels.tif",
                "003_2_labels.tif",
                "001_0_overlay.png",
            ],
        );
    }

    /// A pier with planted damage and drawn slices; nothing holds it, so that it has no life to be
    /// computed.
    pub(super) fn pier(folder: &Path, slices: u32, pixels: u32) -> PathBuf {
        let scene = r#"(
            schema: "intrados.scene/1",
            title: "A pier",
            materials: [(name: "grey", colour: (0.5, 0.5, 0.5))],
            shapes: [Quad(name: "lamp", corner: (-1, 4, -1), u: (2, 0, 0), v: (0, 0, 2), emission: (9, 9, 9))],
            members: [(
                id: "P",
                name: "Pier",
                body: Column(
                    section: Rectangle(width_m: 0.4, depth_m: 0.4),
                    height_m: 1,
                    reinforcement: (cover_mm: 40, bars: [Around(count: 8, diameter_mm: 20)], stirrups: (diameter_mm: 8, spacing_mm: 200)),
                ),
                at: (0, 0, 0),
                concrete: "C30/37",
                material: "grey",
                slices: [Drawn(name: "core", count: COUNT, size: SIZE, pixel_mm: STEP, seed: 1)],
                truth: [Voids(from: 0, to: 1, porosity: 0.02, median_mm: 3)],
            )],
        )"#;
        let scene = scene
            .replace("COUNT", &slices.to_string())
            .replace("SIZE", &pixels.to_string())
            .replace("STEP", &(460.0 / f64::from(pixels)).to_string());
        let path = folder.join("pier.ron");
        fs::write(&path, scene).unwrap();
        path
    }

    #[test]
    fn a_prediction_goes_on_from_its_slices() {
        let folder = tempfile::tempdir().unwrap();
        let scene = pier(folder.path(), 5, 384);
        let files = ["members.csv", "zones.csv", "slices.csv", "pores.csv", "evidence.csv"];
        goes_on(&["predict", text(&scene), "--spp", "1"], 2, "predict.json", &files);
    }

    #[test]
    fn lives_go_on_member_by_member() {
        goes_on(
            &["analyze", "column", "--member", "C1", "--member", "C2", "--element", "0.2"],
            1,
            "analyze.json",
            &["cracks.json"],
        );
    }

    #[test]
    fn calibration_goes_on_from_its_plantings() {
        let folder = tempfile::tempdir().unwrap();
        let scene = pier(folder.path(), 2, 256);
        goes_on(
            &["experiment", "calibration", "--scenes", text(&scene), "--plantings", "2"],
            2,
            "calibration.json",
            &["calibration.json"],
        );
    }

    #[test]
    #[ignore = "two CPU-minutes"]
    fn cases_go_on_one_by_one() {
        goes_on(&["experiment", "table-3-1", "--cases", "1..2"], 1, "table-3-1.json", &[]);
    }

    /// Killed without a word, or stopped by a signal and saved: either way the resumed picture has
    /// the bits of one never interrupted.
    #[test]
    fn a_resumed_picture_has_the_bits_of_one_never_interrupted() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let whole = uninterrupted(&at("whole"));

        let mut child = start(&at("killed"), &at("killed.acc"));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!at("killed/room.exr").exists());
        assert!(resumed(&at("killed"), &at("killed.acc")) == whole);

        let mut child = start(&at("stopped"), &at("stopped.acc"));
        assert!(
            Command::new("kill")
                .args(["-INT", &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        assert_eq!(child.wait().unwrap().code(), Some(130));
        assert!(resumed(&at("stopped"), &at("stopped.acc")) == whole);

        // Other work cannot go on from it.
        let checkpoint = at("killed.acc");
        let refused = |args: &[&str]| {
            assert_eq!(
                code(
                    &[args, &["--resume", text(&checkpoint), "--out", text(folder.path())]]
                        .concat()
                ),
                65,
                "{args:?}"
            )
        };
        refused(&[
            "render", "room", "--side", "both", "--width", "48", "--height", "32", "--spp", "800",
            "--seed", "2",
        ]);
        refused(&[
            "render", "slit", "--side", "both", "--width", "48", "--height", "32", "--spp", "800",
        ]);
        refused(&[
            "render", "room", "--side", "primal", "--width", "48", "--height", "32", "--spp", "800",
        ]);
        refused(&["measure", "room", "--spp", "800"]);
    }
}

#[test]
fn shards_make_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (parts, whole, merged) = (at("parts"), at("whole"), at("merged"));
    let entire = json(&render(text(&whole), &[]));
    for shard in ["0/3", "1/3", "2/3"] {
        json(&render(text(&parts), &["--shard", shard]));
    }
    let files: Vec<PathBuf> = (0..3).map(|i| parts.join(format!("room.{i}of3.acc"))).collect();
    let [a, b, c] = [0, 1, 2].map(|i: usize| text(&files[i]));
    let sum = json(&["merge", a, b, c, "--out", text(&merged)]);
    for field in ["mean", "samples", "rel_error"] {
        assert_eq!(sum[field], entire[field], "{field}");
    }
    let first = exr_bytes(&merged);
    assert!(first == exr_bytes(&whole), "the shards are another picture than the whole");
    json(&["merge", c, a, b, "--out", text(&merged)]);
    assert!(exr_bytes(&merged) == first, "the order of the files changes the picture");

    // The same shard twice, a shard of another split, another seed, another scene.
    assert_eq!(code(&["merge", a, b, a, "--out", text(&merged)]), 65);
    json(&render(text(&at("two")), &["--shard", "0/2"]));
    assert_eq!(code(&["merge", b, text(&at("two/room.0of2.acc")), "--out", text(&merged)]), 65);
    json(&render(text(&at("seed")), &["--shard", "1/3", "--seed", "2"]));
    assert_eq!(code(&["merge", a, text(&at("seed/room.1of3.acc")), "--out", text(&merged)]), 65);
    let slit = [
        "render", "slit", "--side", "both", "--width", "24", "--height", "16", "--spp", "400",
        "--shard", "1/3",
    ];
    json(&[&slit[..], &["--out", text(&at("slit"))]].concat());
    assert_eq!(code(&["merge", a, text(&at("slit/slit.1of3.acc")), "--out", text(&merged)]), 65);
}

#[test]
fn shards_of_readings_make_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path());
    let whole = json(&["measure", "room", "--spp", "64"]);
    for shard in ["0/2", "1/2"] {
        json(&["measure", "room", "--spp", "64", "--shard", shard, "--out", out]);
    }
    let file = |i: usize| format!("{out}/room.{i}of2.acc");
    let sum = json(&["merge", &file(0), &file(1), "--out", out]);
    for i in 0..3 {
        for key in ["mean", "std_error", "walks", "converged"] {
            let of = |r: &Value| {
                ["primal", "dual", "combined"].map(|side| r["meters"][i][side][key].clone())
            };
            assert_eq!(of(&sum), of(&whole), "{key} of {i}");
        }
    }
    assert!(folder.path().join("measure.json").is_file());
}

#[test]
fn predict_writes_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let scene = interrupted::pier(folder.path(), 2, 256);
    let out = folder.path().join("out");
    let report = json(&["predict", text(&scene), "--spp", "1", "--out", text(&out)]);
    assert_eq!(report["schema"], "intrados.predict/2");
    let members = report["members"].as_array().unwrap();
    assert!(!members.is_empty());
    for member in members {
        for key in ["name", "kind", "damage", "damage_std_error", "state", "evidence", "truth"] {
            assert!(member.get(key).is_some(), "{key}");
        }
    }
    for file in report["files"].as_array().unwrap() {
        assert!(Path::new(file.as_str().unwrap()).is_file(), "{file}");
    }
}

/// A member scanned with a coarse panel: what the JSON promises, every file that it names, the same
/// bits on one thread; its own projections, given back as a sinogram, show the same section.
#[test]
fn a_member_is_scanned() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("scan");
    let scan = |out: &Path, more: &[&str]| {
        let fixed = [
            "scan",
            "column",
            "--member",
            "C3",
            "--along",
            "0.5",
            "--size",
            "48",
            "--projections",
            "60",
            "--slices",
            "2",
            "--out",
            text(out),
        ];
        json(&[&fixed, more].concat())
    };
    let report = scan(&out, &[]);
    assert_eq!(report["schema"], "intrados.scan/1");
    assert_eq!(
        (report["projections"].as_u64(), report["detector"]["width"].as_u64()),
        (Some(60), Some(48))
    );
    for number in ["scatter_to_primary", "rel_error", "cpu_seconds"] {
        assert!(report[number].as_f64().is_some_and(|x| x > 0.0), "{number}: {}", report[number]);
    }
    let one = &report["scans"][0];
    assert_eq!(one["member"], "C3");
    // 5 % are planted there.
    assert!(
        (one["porosity"].as_f64().unwrap() - 0.05).abs() < 0.02
            && one["nrmse"].as_f64().unwrap() < 0.3,
        "{one}"
    );
    let files: Vec<PathBuf> = report["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| PathBuf::from(f.as_str().unwrap()))
        .collect();
    assert!(files.len() == 11 && files.iter().all(|f| f.is_file()), "{files:?}");
    // Nothing else is left there.
    assert_eq!(fs::read_dir(&out).unwrap().count(), files.len());
    let alone = folder.path().join("alone");
    scan(&alone, &["--threads", "1"]);
    let slice = "C3_0.500_slice-001.tif";
    assert!(fs::read(out.join(slice)).unwrap() == fs::read(alone.join(slice)).unwrap());

    let projections = out.join("C3_0.500-projections.tif");
    let again = folder.path().join("again");
    let given = [
        "scan",
        "--sinogram",
        text(&projections),
        "--geometry",
        "cone",
        "--source-m",
        "1.2",
        "--detector-m",
        "0.5",
        "--out",
        text(&again),
    ];
    let given = json(&given);
    assert!(given["scatter_to_primary"].is_null() && given["projections"] == 60);
    assert!(
        given["files"].as_array().unwrap().iter().all(|f| Path::new(f.as_str().unwrap()).is_file())
    );
    // With the drawing it gets all corrections, and shows what the scan did: the walks of the
    // scatter are others, hardening and metal the same.
    let by_drawing = folder.path().join("by drawing");
    let of = ["--member", "C3", "--along", "0.5", "--slices", "2"];
    let drawn = json(
        &[
            &["scan", "column", "--sinogram", text(&projections), "--out", text(&by_drawing)][..],
            &of,
        ]
        .concat(),
    );
    assert!(
        drawn["corrections"].as_array().unwrap().len() == 4
            && drawn["scatter_to_primary"].as_f64().unwrap() > 0.0,
        "{drawn}"
    );
    assert_eq!(drawn["kev"], one["kev"]);
    let pictures =
        [out.join(slice), by_drawing.join("C3_0.500-projections-slices.tif")].map(|path| {
            let mut reader = Reader::open(&path, None).unwrap();
            let middle = reader.grid().size[0] / 2;
            let page = reader.read_slab(0..1, &Job::default()).unwrap();
            // The middle of the section, concrete alone.
            let [nx, ny, _] = page.grid.size;
            let near = |i: &usize| (i % nx).abs_diff(middle) < 6 && (i / nx).abs_diff(ny / 2) < 6;
            let values: Vec<f64> =
                (0..nx * ny).filter(near).map(|i| f64::from(page.data[i])).collect();
            values.iter().sum::<f64>() / values.len() as f64
        });
    assert!((pictures[1] / pictures[0] - 1.0).abs() < 0.25, "{pictures:?}");
    let bare = ["scan", "column", "--sinogram", text(&projections), "--out", text(&again)];
    assert_eq!(code(&bare), 2);
    assert_eq!(code(&[&bare[..], &of, &["--geometry", "cone"]].concat()), 2);
    // A fan needs its distances; a sinogram of rows that are not there is refused.
    assert_eq!(
        code(&[
            "scan",
            "--sinogram",
            text(&projections),
            "--geometry",
            "fan",
            "--out",
            text(&again)
        ]),
        2
    );
    let cut = folder.path().join("cut.tif");
    let bytes = fs::read(&projections).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let nothing = folder.path().join("nothing");
    assert_eq!(code(&["scan", "--sinogram", text(&cut), "--out", text(&nothing)]), 65);
    assert!(!nothing.exists());
}

/// A grey TIFF without compression, its pages one after the other: width, height, bits, and whether
/// the samples are floats; what each page says of itself may be a lie.
fn tiff(pages: &[([u16; 2], u16, bool, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = b"II*\0".to_vec();
    let mut link = bytes.len();
    bytes.extend([0; 4]);
    for ([width, height], bits, float, data) in pages {
        let start = bytes.len() as u32;
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(2), 0);
        let place = (bytes.len() as u32).to_le_bytes();
        bytes[link..link + 4].copy_from_slice(&place);
        let long = |tag: u16, value: u32| {
            [
                &tag.to_le_bytes()[..],
                &4_u16.to_le_bytes(),
                &1_u32.to_le_bytes(),
                &value.to_le_bytes(),
            ]
            .concat()
        };
        let tags = [
            (256, u32::from(*width)),
            (257, u32::from(*height)),
            (258, u32::from(*bits)),
            (259, 1),
            (262, 1),
            (273, start),
            (277, 1),
            (278, u32::from(*height)),
            (279, data.len() as u32),
            (339, if *float { 3 } else { 1 }),
        ];
        bytes.extend((tags.len() as u16).to_le_bytes());
        tags.iter().for_each(|(tag, value)| bytes.extend(long(*tag, *value)));
        link = bytes.len();
        bytes.extend([0; 4]);
    }
    bytes
}

/// What is wrong with a picture ends with 65, one line that names the file, and nothing written,
/// whether one file is read or a good one before it.
#[test]
fn bad_slices_are_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let disc = |n: usize| -> Vec<u8> {
        let away = |i: usize, x: f64, y: f64| {
            ((i % n) as f64 - x * n as f64).hypot((i / n) as f64 - y * n as f64)
        };
        (0..n * n)
            .map(|i| match () {
                () if away(i, 0.5, 0.5) > 0.45 * n as f64 => 0,
                () if away(i, 0.6, 0.4) < 0.05 * n as f64 => 100,
                () => 180,
            })
            .collect()
    };
    let page = |n: u16| ([n, n], 8, false, disc(usize::from(n)));
    let mut nan = vec![0; 4 * 64 * 64];
    nan[400..404].copy_from_slice(&f32::NAN.to_le_bytes());
    let good = tiff(&[page(64)]);
    let cases: [(&str, Vec<u8>); 8] = [
        ("nothing.tif", Vec::new()),
        ("truncated.tif", good[..good.len() / 2].to_vec()),
        // Says to be larger than its data, and than any file.
        ("lying.tif", tiff(&[([640, 640], 8, false, disc(64))])),
        ("huge.tif", tiff(&[([65_000, 65_000], 8, false, disc(64))])),
        ("sizes.tif", tiff(&[page(64), page(48)])),
        ("nan.tif", tiff(&[([64, 64], 32, true, nan)])),
        ("twelve.tif", tiff(&[([64, 64], 12, false, vec![7; 64 * 64 * 3 / 2])])),
        ("loop.tif", {
            let mut bytes = good.clone();
            let end = bytes.len();
            let first: [u8; 4] = bytes[4..8].try_into().unwrap();
            bytes[end - 4..].copy_from_slice(&first);
            bytes
        }),
    ];
    let at = |name: &str| folder.path().join(name);
    let sound = at("good.tif");
    fs::write(&sound, &good).unwrap();
    let out = at("deep").join("out");
    let refused = |args: &[&str], name: &str| {
        let before = fs::read_dir(folder.path()).unwrap().count();
        let output = run(&[args, &["--quiet", "--out", text(&out)]].concat());
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(65), "{args:?}: {stderr}");
        assert!(
            stderr.trim().lines().count() == 1 && stderr.contains(name) && output.stdout.is_empty(),
            "{args:?}: {stderr}"
        );
        assert!(
            !out.exists() && fs::read_dir(folder.path()).unwrap().count() == before,
            "{args:?} left something"
        );
    };
    for (name, bytes) in &cases {
        let bad = at(name);
        fs::write(&bad, bytes).unwrap();
        refused(&["detect", "--method", "classical", "--strict", text(&sound), text(&bad)], name);
        refused(&["detect", "--method", "classical", text(&bad)], name);
        // Beside a sound one it is left out, and said so.
        let output =
            run(&["detect", "--method", "classical", "--format", "json", text(&bad), text(&sound)]);
        let (found, stderr) = (
            serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap(),
            String::from_utf8_lossy(&output.stderr),
        );
        assert_eq!(
            (output.status.code(), &found["total"]["slices"], &found["slices"][0]["pores"]),
            (Some(0), &1.into(), &1.into()),
            "{name}"
        );
        assert!(
            found["unused"][0]["because"].as_str().is_some_and(|why| why.contains(name))
                && stderr.contains("not used, because"),
            "{stderr}"
        );
        refused(&["scan", "--sinogram", text(&bad), "--pixel-mm", "1"], name);
    }
    // Masks: of another size, and without any label.
    for (name, bytes) in [
        ("other.tif", tiff(&[page(48)])),
        ("empty.tif", tiff(&[([64, 64], 8, false, vec![0; 64 * 64])])),
    ] {
        let mask = at(name);
        fs::write(&mask, bytes).unwrap();
        refused(&["detect", "--method", "classical", text(&sound), "--truth", text(&mask)], name);
    }
    // Slices of a folder that do not fit together.
    let stack = at("stack");
    fs::create_dir(&stack).unwrap();
    fs::write(stack.join("1.tif"), &good).unwrap();
    fs::write(stack.join("2.tif"), tiff(&[page(48)])).unwrap();
    refused(&["scan", "--sinogram", text(&stack), "--pixel-mm", "1"], "2.tif");
    // The good one alone is read, and all is where it belongs.
    let found = json(&["detect", "--method", "classical", text(&sound), "--out", text(&out)]);
    assert_eq!(found["slices"][0]["pores"], 1);
    assert_eq!(fs::read_dir(&out).unwrap().count(), found["files"].as_array().unwrap().len());
    assert!(fs::read_dir(folder.path().join("deep")).unwrap().count() == 1);
}
