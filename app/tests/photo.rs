//! A photograph of the bundled column, rendered through a lens: placed by its corners, its faces
//! unrolled, and the light taken off.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::{fmt::Write, fs, path::Path};

use common::{run, text};
use glam::DVec3;
use intrados_photo::{Pick, Pose, Site};
use intrados_scene::{Camera, Scene};
use intrados_stage::{Job, random::Key};
use serde_json::Value;

/// Middles of dark squares of 4 cm on the front and on the right of C2, m.
const MARKS: [[f64; 3]; 4] = [[1.62, 0.8, 1.5], [1.8, 2.2, 1.5], [1.9, 1.1, 1.42], [1.9, 1.9, 1.2]];

/// The bundled column with a lens in its camera, with marks or without.
fn scene(folder: &Path, name: &str, marked: bool) -> std::path::PathBuf {
    let bundled = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/column.ron");
    let mut scene = fs::read_to_string(bundled).unwrap();
    let lens = "lens: Some((k1: -0.08, k2: 0.02, p1: 0.001, p2: -0.001)), ";
    scene = scene.replacen("position: (3.7, 1.65, 5.4), target: (-0.15, 1.42, -0.4), fov_deg: 58, width: 800, height: 600", &format!("position: (4.4, 1.7, 4.6), target: (1.7, 1.45, 1.2), fov_deg: 50, {lens}width: 1000, height: 900"), 1);
    assert!(scene.contains(lens));
    if marked {
        let mut shapes = String::from("shapes: [\n");
        for [x, y, z] in MARKS {
            // 0.3 mm before the face, so that no rounding hides it.
            let (corner, u) = if z == 1.5 {
                (format!("({}, {}, {})", x - 0.02, y - 0.02, z + 0.0003), "(0.04, 0, 0)")
            } else {
                (format!("({}, {}, {})", x + 0.0003, y - 0.02, z + 0.02), "(0, 0, -0.04)")
            };
            writeln!(shapes, "Quad(name: \"mark\", corner: {corner}, u: {u}, v: (0, 0.04, 0), material: \"black\"),").unwrap();
        }
        scene = scene.replacen("shapes: [", &shapes, 1);
        scene = scene.replacen(
            "materials: [",
            "materials: [(name: \"black\", colour: (0.01, 0.01, 0.01)),",
            1,
        );
    }
    let path = folder.join(name);
    fs::write(&path, scene).unwrap();
    path
}

/// Corners of a member as the program numbers them.
fn corners(scene: &str, member: &str) -> Vec<DVec3> {
    let said = run(&["photo", scene, "--corners", member, "--format", "json"]);
    let said: Value = serde_json::from_slice(&said.stdout).unwrap();
    let corners: Vec<[f64; 3]> = serde_json::from_value(said["corners"].clone()).unwrap();
    corners.into_iter().map(DVec3::from_array).collect()
}

fn table(picks: &[(&str, usize, Pick)]) -> String {
    let mut table = String::from("u,v,member,corner\n");
    for (member, corner, Pick { pixel: [u, v], .. }) in picks {
        writeln!(table, "{u},{v},{member},{corner}").unwrap();
    }
    table
}

/// Where the dark square that is expected at a place of a map lies: the middle of what is darker
/// than half of what is around it, pixels.
fn dark(map: &image::RgbImage, [x, y]: [f64; 2]) -> [f64; 2] {
    let reach = 32.0;
    let window = |c: f64, n: u32| (c - reach).max(0.0) as u32..((c + reach) as u32).min(n);
    let values: Vec<(f64, [f64; 2])> = window(y, map.height())
        .flat_map(|j| window(x, map.width()).map(move |i| (i, j)))
        .map(|(i, j)| {
            let green = intrados_photo::picture::linear(f32::from(map.get_pixel(i, j)[1]) / 255.0);
            (f64::from(green), [f64::from(i) + 0.5, f64::from(j) + 0.5])
        })
        .collect();
    let mut sorted: Vec<f64> = values.iter().map(|v| v.0).collect();
    sorted.sort_by(f64::total_cmp);
    let half = 0.5 * sorted[sorted.len() * 3 / 4];
    let (mut sum, mut at) = (0.0, [0.0; 2]);
    for (value, [i, j]) in values.into_iter().filter(|v| v.0 < half) {
        let weight = half - value;
        (sum, at) = (sum + weight, [at[0] + weight * i, at[1] + weight * j]);
    }
    assert!(sum > 0.0, "no mark about {x}, {y}");
    at.map(|c| c / sum)
}

#[test]
fn a_photograph_is_placed_and_its_faces_unrolled() {
    let folder = tempfile::tempdir().unwrap();
    let marked = scene(folder.path(), "marked.ron", true);
    let model = scene(folder.path(), "model.ron", false);
    let (marked, model, out) = (text(&marked), text(&model), folder.path().join("out"));
    let shot = run(&["render", marked, "--spp", "4", "--guide", "off", "--out", text(&out), "-q"]);
    assert!(shot.status.success(), "{}", String::from_utf8_lossy(&shot.stderr));
    let photo = out.join("marked.png");

    let loaded = Scene::open(Path::new(model), &Job::default()).unwrap();
    let camera: Camera = loaded.cameras[0].clone();
    let planted = Pose::of(&camera);
    // Corners of three columns that the camera sees, to half a pixel.
    let site = Site::new(&loaded, &Job::default()).unwrap();
    let mut picks = Vec::new();
    for member in ["C1", "C2", "C4"] {
        let all = corners(model, member);
        assert_eq!(all.len(), 8);
        for (i, place) in all.into_iter().enumerate() {
            let Some(pixel) = planted.project(place).filter(|at| planted.holds(*at)) else {
                continue;
            };
            let noise = |k: u32| 0.5 * Key::new(5, picks.len() as u64).normal(2 * k);
            let pick = Pick { pixel: [pixel[0] + noise(0), pixel[1] + noise(1)], place };
            if site.admits(&planted, &[pick]) {
                picks.push((member, i + 1, pick));
            }
        }
    }
    assert!((8..20).contains(&picks.len()), "{picks:?}");
    let csv = folder.path().join("picks.csv");
    fs::write(&csv, table(&picks)).unwrap();
    let maps = folder.path().join("maps");
    let focal = planted.focal_px.to_string();
    let call = |csv: &Path, out: &Path| {
        let how = ["--picking-px", "0.5", "--member", "C2", "--mm-per-px", "2", "--format", "json"];
        let relight = ["--relight", "--spp", "32"];
        let what = ["photo", model, text(&photo), "--pose", text(csv), "--focal-px", &focal];
        run(&[&what[..], &how[..], &relight[..], &["--out", text(out)]].concat())
    };
    let said = call(&csv, &maps);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let said: Value = serde_json::from_slice(&said.stdout).unwrap();
    let pose = &said["photos"][0]["pose"];
    let position: [f64; 3] = serde_json::from_value(pose["position_m"].clone()).unwrap();
    let off = DVec3::from_array(position).distance(planted.position);
    let distance = planted.position.distance(DVec3::new(1.7, 1.5, 1.3));
    assert!(off < 0.01 * distance, "{off} m of {distance} m: {pose}");

    // The marks lie on the maps where they lie on the column, to a pixel.
    let faces = said["photos"][0]["faces"].as_array().unwrap();
    for (face, across) in [("Front", [0, 1]), ("Right", [2, 3])] {
        let record = faces.iter().find(|f| f["face"] == face).unwrap();
        assert!(record["known"].as_f64().unwrap() > 0.9, "{record}");
        let map = image::open(maps.join(format!("marked.png_C2_{face}.png"))).unwrap().to_rgb8();
        let world = fs::read_to_string(maps.join(format!("marked.png_C2_{face}.pgw"))).unwrap();
        let world: Vec<f64> = world.lines().map(|l| l.parse().unwrap()).collect();
        for mark in across {
            let [x, y, z] = MARKS[mark];
            // Across is from the axis at (1.7, 1.3): +x of the front, −z of the right.
            let s = if face == "Front" { x - 1.7 } else { 1.3 - z };
            let at = [(s - world[4]) / world[0] + 0.5, (y - world[5]) / world[3] + 0.5];
            let found = dark(&map, at);
            let off = (found[0] - at[0]).hypot(found[1] - at[1]);
            assert!(off < 1.0, "mark {mark}: {at:?}, found at {found:?}");
        }
    }
    // The light is the sky's, blue; the concrete is grey, and so is its map without the light.
    let relit = &said["photos"][0]["relit"];
    let names: Vec<_> = relit["lamps"].as_array().unwrap().iter().map(|l| &l["lamps"][0]).collect();
    assert_eq!(names, ["lamp", "back lamp", "sky"], "{relit}");
    let record = faces.iter().find(|f| f["face"] == "Front").unwrap();
    // In a picture as small as this, most of a face lies beside a rim or a shadow's edge.
    assert!(record["relit_known"].as_f64().unwrap() > 0.05, "{record} {relit}");
    let [lit, grey] = ["", "_relit"].map(|what| {
        let file = maps.join(format!("marked.png_C2_Front{what}.png"));
        let map = image::open(file).unwrap().to_rgb32f();
        let known = map.pixels().filter(|p| p.0.iter().all(|v| *v > 0.0));
        let [red, blue] = [0, 2].map(|c| {
            known.clone().map(|p| f64::from(intrados_photo::picture::linear(p[c]))).sum::<f64>()
        });
        blue / red
    });
    assert!(lit > 1.2 && (0.88..1.0).contains(&grey), "{lit} {grey}");

    for file in said["files"].as_array().unwrap() {
        assert!(Path::new(file.as_str().unwrap()).exists(), "{file}");
    }

    // Left and right exchanged: refused, and nothing is written.
    let mut exchanged: Vec<_> = picks.into_iter().filter(|(member, ..)| *member == "C2").collect();
    assert_eq!(exchanged.len(), 6);
    for (_, _, pick) in &mut exchanged {
        let DVec3 { x, y, z } = pick.place;
        pick.pixel = planted.project(DVec3::new(2.0 * 1.7 - x, y, z)).unwrap();
    }
    let bad = folder.path().join("exchanged.csv");
    fs::write(&bad, table(&exchanged)).unwrap();
    let nothing = folder.path().join("nothing");
    let said = call(&bad, &nothing);
    let error = String::from_utf8_lossy(&said.stderr);
    assert_eq!(said.status.code(), Some(65), "{error}");
    assert!(error.contains("exchanged"), "{error}");
    assert!(!nothing.join("pose.json").exists());
}
