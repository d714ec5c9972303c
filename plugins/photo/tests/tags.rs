//! AprilTags that were stuck on a column and photographed: which they are, and where their corners
//! are drawn.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use intrados_photo::{Photograph, Pose, Prior, Site, locate, picks, taken::Focal};
use intrados_scene::{Camera, Lens, Scene};
use intrados_stage::{Job, random::Key};

/// Numbers 0 and 1 of the family 36h11, as they are printed: paper, a black frame, 36 squares.
const PRINTED: [[&str; 10]; 2] = [
    [
        "..........",
        ".########.",
        ".#..#.#.#.",
        ".##...#.#.",
        ".##..####.",
        ".#.#.####.",
        ".##.#..##.",
        ".####.###.",
        ".########.",
        "..........",
    ],
    [
        "..........",
        ".########.",
        ".#..#..##.",
        ".##.#...#.",
        ".#....###.",
        ".##..####.",
        ".#.#..#.#.",
        ".###.##.#.",
        ".########.",
        "..........",
    ],
];

/// Where a tag was stuck: its number, the face, its middle (across, along, m), its turn, degrees,
/// and the edge of its black square, m.
type Stuck = (usize, &'static str, [f64; 2], f64, f64);

const STUCK: [Stuck; 2] =
    [(0, "Front", [-0.05, 1.5], 0.0, 0.15), (1, "Right", [0.02, 1.65], 90.0, 0.12)];
const TABLE: &str = "tag,member,face,along,across_mm,size_mm,turn_deg\n0,C2,Front,0.5,-50,150,\n1,C2,Right,0.55,20,120,90\n7,C2,Right,0.3,0,120,\n";

/// Light of a place of a face: concrete, or paper with a tag on it.
fn light(face: &str, at: [f64; 2]) -> f32 {
    for (number, of, middle, turn, edge) in STUCK.iter().filter(|s| s.1 == face) {
        let _ = of;
        let (sin, cos) = turn.to_radians().sin_cos();
        let [x, y] = [0, 1].map(|k| (at[k] - middle[k]) / (edge / 8.0));
        // Turned back, in squares from the paper's upper left.
        let [u, v] = [5.0 + cos * x + sin * y, 5.0 - (cos * y - sin * x)];
        if (0.0..10.0).contains(&u) && (0.0..10.0).contains(&v) {
            let is_black = PRINTED[*number][v as usize].as_bytes()[u as usize] == b'#';
            return if is_black { 0.04 } else { 0.8 };
        }
    }
    0.35
}

/// A photograph of both, with noise, as a file.
fn shot(scene: &Scene, site: &Site, pose: &Pose, path: &std::path::Path) {
    let [width, height] = pose.size;
    let key = Key::new(3, 0);
    let picture = image::RgbImage::from_fn(width, height, |x, y| {
        let parts = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
        let pixels = parts.map(|[a, b]| [f64::from(x) + a, f64::from(y) + b]);
        let mut sum = 0.0;
        for sight in site.sights(pose, &pixels) {
            sum += sight.map_or(0.1, |sight| {
                let surface = site.surface(sight.member).unwrap();
                let face = sight.face.map(|face| &surface.faces[face]);
                let is_ours = scene.members[sight.member].id == "C2";
                face.filter(|_| is_ours)
                    .map_or(0.3, |face| light(&face.name, surface.on_face(face, sight.place)))
            });
        }
        let noise = 0.01 * key.normal(2 * (y * width + x)) as f32;
        image::Rgb([intrados_photo::picture::srgb(0.25 * sum + noise); 3])
    });
    picture.save(path).unwrap();
}

#[test]
fn tags_place_a_photograph() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let camera = Camera {
        name: "eye".into(),
        position: Vec3::new(3.3, 1.6, 3.2),
        target: Vec3::new(1.75, 1.55, 1.35),
        up: Vec3::Y,
        fov_deg: 40.0,
        width: 900,
        height: 700,
        exposure: 0.0,
        lens: Some(Lens { k1: -0.05, ..Lens::default() }),
    };
    let pose = Pose::of(&camera);
    let folder = tempfile::tempdir().unwrap();
    let [photo, table] = ["photo.png", "picks.csv"].map(|name| folder.path().join(name));
    shot(&scene, &site, &pose, &photo);
    std::fs::write(&table, TABLE).unwrap();

    let photograph = Photograph::open(&photo).unwrap();
    let table = picks::read(&table, &scene, &site).unwrap();
    // The third is not to be seen: nothing is made of it.
    let picks = table.of("photo.png", true, &photograph);
    assert_eq!((table.tags.len(), picks.len()), (3, 8));
    for pick in &picks {
        let at = pose.project(pick.place).unwrap();
        let off = (at[0] - pick.pixel[0]).hypot(at[1] - pick.pixel[1]);
        assert!(off < 0.5, "{pick:?} is drawn at {at:?}");
    }
    let prior = Prior {
        size: photograph.size,
        focal: Some(Focal { px: pose.focal_px, rel_error: 0.02 }),
        lens: Lens::default(),
        k1_error: 0.05,
        // The paper's edge on the concrete, and the lines that are fitted to it.
        picking_px: 0.5,
    };
    let located = locate(&picks, &prior, &|pose| site.admits(pose, &picks)).unwrap();
    let off = located.pose.position.distance(pose.position);
    let distance = pose.position.distance(picks[0].place);
    assert!(off < 0.02 * distance, "{off} m of {distance}");
}

#[test]
fn tags_that_cannot_be_there_are_refused_with_their_line() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picks.csv");
    let head = "tag,member,face,along,across_mm,size_mm,turn_deg,u\n";
    for (row, word) in [
        ("x,C2,Front,.5,0,150,,", "family 36h11"),
        ("587,C2,Front,.5,0,150,,", "0 to 586"),
        ("1,C9,Front,.5,0,150,,", "no member"),
        ("1,C2,Roof,.5,0,150,,", "it has Front"),
        ("1,C2,Front,1.5,0,150,,", "along 1.5"),
        ("1,C2,Front,.5,0,0.15,,", "size_mm 0.15"),
        ("1,C2,Front,.5,400,150,,", "does not lie on the face"),
        ("1,C2,Front,.5,0,150,,12", "a tag has no u"),
        ("1,C2,Front,.5,0,,,", "size_mm is missing"),
        ("1,C2,Front,.5,0,150,,\n1,C2,Front,.7,0,150,,", ":3: tag 1 is placed twice"),
    ] {
        std::fs::write(&path, format!("{head}{row}\n")).unwrap();
        let error = picks::read(&path, &scene, &site).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("picks.csv:"), "{error}");
    }
}
