//! Photographs of strangers and tables of picks: placed rightly, doubted or refused.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::{hostile, run, said};

/// A scene with the column that the photographs show.
fn scene(folder: &Path) -> PathBuf {
    let column = "Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3)";
    let text = format!(
        "(schema: \"intrados.scene/1\", materials: [(name: \"grey\", colour: (0.4, 0.4, 0.4))], \
         members: [(id: \"C\", body: {column}, at: (1.7, 0, 1.3), concrete: \"C30/37\", \
         material: \"grey\")])"
    );
    let place = folder.join("s.ron");
    fs::write(&place, text).unwrap();
    place
}

/// Places a photograph by a table: where the camera stood, or nothing, and what is said.
fn placed(photos: &[&Path], picks: &Path, more: &[&str]) -> (Vec<[f64; 3]>, String) {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (scene(folder.path()), folder.path().join("out"));
    let photos = photos.iter().map(|photo| photo.to_str().unwrap());
    let mut args = vec!["photo", scene.to_str().unwrap()];
    args.extend(photos);
    args.extend(["--pose", picks.to_str().unwrap(), "--mm-per-px", "20"]);
    args.extend(["--out", out.to_str().unwrap()]);
    args.extend(more);
    let done = run(&args);
    let json = fs::read_to_string(out.join("pose.json")).unwrap_or_default();
    assert_eq!(done.status.success(), !json.is_empty(), "{}", said(&done));
    let report: Value = serde_json::from_str(&json).unwrap_or_default();
    let place = |photo: &Value| [0, 1, 2].map(|k| photo["pose"]["position_m"][k].as_f64().unwrap());
    let places = report["photos"].as_array().map(|all| all.iter().map(place).collect());
    (places.unwrap_or_default(), said(&done))
}

fn is_near(a: [f64; 3], b: [f64; 3], m: f64) -> bool {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt() < m
}

const ON_ITS_SIDE: &str = "lies on its side";

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn picks_are_right_doubted_or_refused_with_data() {
    let at = |name: &str| hostile("public/photo").join(name);
    let (plain, text) = placed(&[&at("pose.jpg")], &at("picks.csv"), &[]);
    let [camera] = plain[..] else { panic!("{text}") };
    assert!(!text.contains("WARN"), "{text}");
    for (photo, picks, is_right, doubt) in [
        ("pose.jpg", "picks_bom.csv", true, ""),
        ("pose.jpg", "picks_case.csv", true, ""),
        ("pose.jpg", "picks_path.csv", true, ""),
        ("pose.jpg", "picks_semicolon.csv", true, ""),
        ("pose.jpg", "picks_tab.csv", true, ""),
        ("pose6.jpg", "picks_up6.csv", true, ""),
        ("pose6.jpg", "picks_raw6.csv", false, ON_ITS_SIDE),
        ("posecrop.jpg", "picks_crop.csv", true, "it was cropped"),
        ("posecrop.jpg", "picks_4crop.csv", true, "it was cropped"),
    ] {
        let (places, text) = placed(&[&at(photo)], &at(picks), &[]);
        let [place] = places[..] else { panic!("{picks} {text}") };
        assert!(is_near(place, camera, 0.35) || !is_right, "{picks} {place:?} {camera:?} {text}");
        assert!(text.contains(doubt), "{picks} {text}");
        assert_eq!(text.contains("WARN"), !doubt.is_empty(), "{picks} {text}");
    }
    // Left and right exchanged, another size, another photograph's.
    for (photo, picks, why) in [
        ("pose.jpg", "picks_swapped.csv", ""),
        ("pose.jpg", "picks_half.csv", "too few"),
        ("pose.jpg", "picks_half_wrong.csv", "too few"),
    ] {
        let (places, text) = placed(&[&at(photo)], &at(picks), &[]);
        let is_doubted = text.contains(ON_ITS_SIDE) || text.contains("another place");
        assert!(places.is_empty() || is_doubted, "{picks} {text}");
        assert!(text.contains(why), "{picks} {text}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn series_with_folders_are_placed_with_data() {
    let at = |name: &str| hostile("public/photo").join(name);
    let photos = [at("sA.jpg"), at("sB.jpg")];
    let photos: Vec<&Path> = photos.iter().map(PathBuf::as_path).collect();
    let series = |folder: &str| {
        let folder = at(folder);
        let more = ["--series", folder.to_str().unwrap()];
        placed(&photos, &at("picks_series.csv"), &more)
    };
    let (plain, text) = series("series");
    assert!(plain.len() == 2 && !text.contains("WARN"), "{text}");
    let (nested, text) = series("series_sub");
    assert!(!text.contains("WARN"), "{text}");
    assert_eq!(nested, plain);
    // COLMAP's names are of other photographs.
    let (alone, text) = series("series6");
    assert!(text.contains("its own picks place it") || alone.is_empty(), "{text}");
}

/// COLMAP saw the pictures upright, the table was picked in them or in the raw ones.
#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn series_picked_before_they_were_turned_are_doubted_with_data() {
    let at = |name: &str| hostile("public/photo").join(name);
    let folder = tempfile::tempdir().unwrap();
    let copies = ["s6A.jpg", "s6B.jpg"].map(|name| folder.path().join(name));
    for copy in &copies {
        fs::copy(at("pose6.jpg"), copy).unwrap();
    }
    let photos: Vec<&Path> = copies.iter().map(PathBuf::as_path).collect();
    let series = at("series6");
    let more = ["--series", series.to_str().unwrap()];
    for (table, is_doubted) in [("picks_series6_up.csv", false), ("picks_series6_raw.csv", true)] {
        let (places, text) = placed(&photos, &at(table), &more);
        assert_eq!(places.len(), 2, "{text}");
        assert_eq!(text.contains(ON_ITS_SIDE), is_doubted, "{text}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn cut_and_unfinished_photographs_are_refused_or_read_with_data() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let whole = hostile("public/photo/crack_low.jpg");
    let bytes = fs::read(&whole).unwrap();
    let copy = folder.path().join("a.jpg");
    let read = |file: &Path| run(&["photo", file.to_str().unwrap(), "--out", out]);
    let done = read(&whole);
    assert!(done.status.success() && !said(&done).contains("WARN"), "{}", said(&done));
    let cut = hostile("public/photo/crack_low_truncated.jpg");
    for file in [&cut, &copy] {
        for length in [bytes.len() * 9 / 10, bytes.len() / 2, bytes.len() - 2] {
            fs::write(&copy, &bytes[..length]).unwrap();
            let done = read(file);
            assert!(!done.status.success(), "{file:?}");
            assert!(said(&done).contains("is cut short"), "{}", said(&done));
        }
    }
    // A copy that broke off has left zeros within, or was given an end again.
    let end = bytes.len() - 2;
    for kept in [end / 5, end / 2, end * 4 / 5] {
        for within in [vec![0; end - kept], Vec::new()] {
            fs::write(&copy, [&bytes[..kept], &within, &[0xff, 0xd9]].concat()).unwrap();
            let done = read(&copy);
            assert!(said(&done).contains("JPEG data are damaged"), "{kept}: {}", said(&done));
        }
    }
    // Its list of tags has no end.
    let newcomer = hostile("newcomer/newcomer_piexif.jpg");
    let picks = hostile("newcomer/newcomer_picks_4.csv");
    let done = run(&[
        "photo",
        "column",
        newcomer.to_str().unwrap(),
        "--pose",
        picks.to_str().unwrap(),
        "--mm-per-px",
        "20",
        "--out",
        out,
    ]);
    assert!(!said(&done).contains("without a focal length"), "{}", said(&done));
}

/// What a table may look like, and what it must not be.
#[test]
fn tables_of_picks_are_read_however_they_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("Hall 1.png");
    let grey = image(1600, 1200);
    fs::write(&photo, grey).unwrap();
    let table = folder.path().join("p.csv");
    let rows = [
        (819.5, 1019.3, 1.9, 0.0, 1.5),
        (871.8, 988.8, 1.9, 0.0, 1.1),
        (782.1, 972.7, 1.5, 0.0, 1.1),
        (728.1, 1001.6, 1.5, 0.0, 1.5),
        (818.9, 176.9, 1.9, 3.0, 1.5),
        (871.4, 205.8, 1.9, 3.0, 1.1),
        (780.1, 220.2, 1.5, 3.0, 1.1),
        (724.7, 194.3, 1.5, 3.0, 1.5),
    ];
    let write = |head: &str, name: &str, mark: &str, comma: &str, scale: f64| {
        let mut text = format!("{head}\n");
        for (u, v, x, y, z) in rows {
            let numbers = [u, v, scale * x, scale * y, scale * z];
            let cells = numbers.map(|n| n.to_string().replace('.', comma)).join(mark);
            text += &format!("{name}{cells}\n");
        }
        text
    };
    let head = "u,v,x,y,z";
    let sound = [
        write(head, "", ",", ".", 1.0),
        write("PHOTO,U,V,X,Y,Z", "HALL 1.PNG,", ",", ".", 1.0),
        write("photo\tu\tv\tx\ty\tz", "C:\\pictures\\hall 1.png\t", "\t", ",", 1.0),
        write("\u{feff}Photo;U;V;X;Y;Z", "./photos/Hall 1.png;", ";", ",", 1.0),
    ];
    let mut camera = None;
    for text in sound {
        fs::write(&table, &text).unwrap();
        let (places, said) = placed(&[&photo], &table, &["--focal-px", "1294.3"]);
        let [place] = places[..] else { panic!("{text} {said}") };
        assert!(is_near(place, *camera.get_or_insert(place), 1e-6), "{text} {said}");
    }
    for (scale, remedy) in [(1000.0, "mm"), (100.0, "cm"), (39.37, "scene's m")] {
        fs::write(&table, write(head, "", ",", ".", scale)).unwrap();
        let (places, said) = placed(&[&photo], &table, &["--focal-px", "1294.3"]);
        assert!(places.is_empty() && said.contains(remedy), "{scale} {said}");
    }
    // A picture of half the size, a column twice, one that nobody knows.
    let small = folder.path().join("small.png");
    fs::write(&small, image(800, 600)).unwrap();
    for (text, why) in [
        (write(head, "", ",", ".", 1.0), "outside the picture"),
        (write("u,u,x,y,z", "", ",", ".", 1.0), "is there twice"),
        (write("u,v,x,y,w", "", ",", ".", 1.0), "is not known"),
    ] {
        fs::write(&table, text).unwrap();
        let (places, said) = placed(&[&small], &table, &["--focal-px", "647"]);
        assert!(places.is_empty() && said.contains(why), "{said}");
    }
}

/// A grey PNG.
fn image(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&vec![120; (width * height) as usize]).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn options_without_a_scene_are_refused_and_corners_name_their_faces() {
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("a.png");
    fs::write(&photo, image(64, 64)).unwrap();
    let out = folder.path().join("out");
    let done = run(&[
        "photo",
        photo.to_str().unwrap(),
        "--read",
        "--mm-per-px",
        "0.3",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(!done.status.success() && said(&done).contains("--mm-per-px"), "{}", said(&done));
    let scene = scene(folder.path());
    let done = run(&["photo", scene.to_str().unwrap(), "--corners", "C", "--format", "json"]);
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    let faces = report["faces"].as_array().unwrap();
    assert_eq!(faces.len(), 8);
    // Two faces meet there, at one end.
    assert!(faces.iter().all(|at| at.as_array().unwrap().len() == 3), "{report}");
}
