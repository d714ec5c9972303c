//! From a photograph of a cracked pillar to what is said of it. The photograph is rendered, of the
//! damaged pillar; the scene that reads it knows of no damage.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{fs, path::Path, sync::Arc};

use intrados_damage::Sources;
use intrados_light::{LitScene, Render, RenderSettings, Sides, View};
use intrados_predict::{PredictSettings, Prediction, predict};
use intrados_scene::Scene;
use intrados_stage::Job;
use intrados_survey::photographed::PHOTOGRAPHED;

const WIDTH_MM: f64 = 0.8;
const ALONG: f64 = 0.6;

fn scene(truth: &str) -> String {
    format!(
        r#"(
    schema: "intrados.scene/1",
    title: "A pillar",
    materials: [(name: "concrete", colour: (0.42, 0.41, 0.4)), (name: "floor", colour: (0.3, 0.3, 0.3))],
    shapes: [Box(name: "floor", centre: (0, -0.15, 0), size: (6, 0.3, 6), material: "floor")],
    members: [(
        id: "P", name: "Pillar",
        body: Column(
            section: Rectangle(width_m: 0.3, depth_m: 0.3), height_m: 0.6,
            reinforcement: (cover_mm: 30, bars: [Around(count: 8, diameter_mm: 12)], stirrups: (diameter_mm: 8, spacing_mm: 150)),
        ),
        at: (0, 0, 0), concrete: "C30/37", material: "concrete", exposure: (class: "XC3", years: 30),
        truth: [{truth}],
    )],
    lamps: [
        Environment(name: "sky", radiance: (1, 1, 1)),
        Directional(name: "sun", direction: (-0.5, -0.6, -0.6), strength: WattPerSquareMetre(2), colour: (1, 0.95, 0.85)),
    ],
    cameras: [(name: "shot", position: (0.3, 0.5, 1.15), target: (0.03, 0.3, 0.1), fov_deg: 42, width: 800, height: 800, exposure: 0)],
)"#
    )
}

/// Renders the damaged pillar, and picks its corners.
fn photograph(folder: &Path) {
    let path = folder.join("damaged.ron");
    let truth = format!("Crack(along: {ALONG}, width_mm: {WIDTH_MM}, depth: 0.4, angle_deg: 0)");
    fs::write(&path, scene(&truth)).unwrap();
    let job = Job::default();
    let built = Scene::open(&path, &job).unwrap();
    let damaged = built.marked(&built.planted(), 1.0);
    let camera = damaged.cameras[0].clone();
    let lit = LitScene::build(Arc::new(damaged), &job).unwrap();
    let settings = RenderSettings {
        sides: Sides::Primal,
        // As little grain as a camera leaves.
        samples: Some(128),
        seed: 5,
        ..RenderSettings::default()
    };
    let mut render = Render::new(Arc::new(lit), &camera, &settings);
    while render.advance(16) {}
    let light = render.image(View::Primal, None).mean;
    let mut bright: Vec<f32> = light.iter().map(|c| c.max_element()).collect();
    bright.sort_by(f32::total_cmp);
    let white = bright[bright.len() * 98 / 100] / 0.85;
    let encode = |v: f32| {
        let v = (v / white).clamp(0.0, 1.0);
        let s = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (255.0 * s + 0.5) as u8
    };
    let pixels = light.iter().flat_map(|c| c.to_array().map(encode)).collect();
    let picture = image::RgbImage::from_raw(camera.width, camera.height, pixels).unwrap();
    picture.save(folder.join("front.png")).unwrap();

    let (right, up, forward) = {
        let [right, up, forward] = camera.frame();
        (right, up, forward)
    };
    let [hx, hy] = camera.half_extent();
    let mut table = String::from("u,v,x,y,z\n");
    for [x, y, z] in [
        [-0.15_f32, 0.0, 0.15],
        [0.15, 0.0, 0.15],
        [0.15, 0.0, -0.15],
        [-0.15, 0.6, 0.15],
        [0.15, 0.6, 0.15],
        [0.15, 0.6, -0.15],
    ] {
        let to = glam::Vec3::new(x, y, z) - camera.position;
        let depth = to.dot(forward);
        let u = 0.5 * (1.0 + to.dot(right) / depth / hx) * camera.width as f32;
        let v = 0.5 * (1.0 - to.dot(up) / depth / hy) * camera.height as f32;
        table += &format!("{u},{v},{x},{y},{z}\n");
    }
    fs::write(folder.join("front.csv"), table).unwrap();
}

fn predicted(folder: &Path, photographs: &str) -> Prediction {
    let path = folder.join("scene.ron");
    fs::write(&path, scene("")).unwrap();
    let evidence = format!("(schema: \"intrados.evidence/1\", photographs: [{photographs}])");
    fs::write(folder.join("scene.evidence.ron"), evidence).unwrap();
    let job = Job::default();
    let scene = Scene::open(&path, &job).unwrap();
    let settings = PredictSettings { forecast: None, ..PredictSettings::default() };
    predict(&scene, settings, &Sources::default(), &job).unwrap()
}

/// The crack is found where it is and as wide as it is; what nobody saw of the pillar stays open.
#[test]
fn a_photograph_becomes_evidence() {
    let folder = tempfile::tempdir().unwrap();
    photograph(folder.path());
    let photo = "(file: \"front.png\", picks: \"front.csv\", member: \"P\", name: \"front\", date: \"2026-05-03\")";
    let prediction = predicted(folder.path(), photo);
    let item = prediction.items.iter().find(|i| i.source == PHOTOGRAPHED).unwrap();
    assert!(item.used, "{}", item.verdict());
    let member = &prediction.members[0];
    let evidence = &member.evidence[PHOTOGRAPHED];
    assert!(evidence.measured && member.damage.is_some());
    let cracks: Vec<_> = member.defects.iter().filter(|d| d.width_mm.is_some()).collect();
    assert!(cracks.iter().all(|d| d.picture.is_some()), "a crack is to be seen in the report");
    let widest = cracks.iter().max_by(|a, b| a.length_m.partial_cmp(&b.length_m).unwrap()).unwrap();
    assert_eq!((widest.kind, widest.source), ("crack across", PHOTOGRAPHED), "{widest:?}");
    let [from, to] = widest.along.unwrap();
    assert!((0.5 * (from + to) - ALONG).abs() < 0.03, "{widest:?}");
    let width = widest.width_mm.unwrap();
    // Its mouth is told as wide as planted at its widest; it swells and shrinks by some tenths.
    assert!((width - WIDTH_MM).abs() < 0.35 * WIDTH_MM, "{widest:?}");
    let told = member.photographed().unwrap();
    assert!(told.contains("% of Front (cracks from"), "{told}");
    // The right face is seen flatter than 10°.
    assert!(told.contains("nothing of Back, Right, Left: what is there is unknown"), "{told}");
    // One of four faces was seen: elsewhere than at the crack the rest of the error is there.
    let concrete = member.causes[&intrados_damage::Cause::Concrete].0;
    let far = concrete[1].unwrap();
    assert!(far.value < 0.1 && far.std_error > 0.06, "{far:?}");
}

/// A photograph of something else is not used, and is said so with the residual.
#[test]
fn a_photograph_that_does_not_fit_is_not_used() {
    let folder = tempfile::tempdir().unwrap();
    photograph(folder.path());
    let table = fs::read_to_string(folder.path().join("front.csv")).unwrap();
    let mut rows: Vec<&str> = table.lines().collect();
    // Two corners exchanged: pixels of the one with the place of the other.
    let (a, b) = (rows[1].to_owned(), rows[5].to_owned());
    let swap = |pixel: &str, place: &str| {
        let [pixel, place] = [pixel, place].map(|row| row.split(',').collect::<Vec<_>>());
        [&pixel[..2], &place[2..]].concat().join(",")
    };
    let (first, second) = (swap(&a, &b), swap(&b, &a));
    rows[1] = &first;
    rows[5] = &second;
    fs::write(folder.path().join("wrong.csv"), rows.join("\n")).unwrap();
    let photo = "(file: \"front.png\", picks: \"wrong.csv\", member: \"P\", name: \"front\")";
    let prediction = predicted(folder.path(), photo);
    let item = prediction.items.iter().find(|i| i.source == PHOTOGRAPHED).unwrap();
    assert!(!item.used);
    let member = &prediction.members[0];
    assert!(member.evidence.is_empty() && member.damage.is_none());
}
