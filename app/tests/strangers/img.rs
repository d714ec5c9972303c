//! CT pictures of strangers: what a slice's file says, means and leaves open.

use std::{fs, path::Path};

use serde_json::Value;

use super::{hostile, run, said};

/// Pixels across the pictures of our own making.
const ACROSS: usize = 160;

/// Grey of a disc of concrete with pores in air; noise of a few greys.
pub(crate) fn disc(i: usize, air: f64, concrete: f64) -> f64 {
    let [x, y] = [(i % ACROSS) as f64 - 79.5, (i / ACROSS) as f64 - 79.5];
    let noise = ((i * 7919) % 41) as f64 - 20.0;
    let is_pore = |k: usize| {
        let turn = k as f64 * 2.4;
        let r = 8.0 + 3.2 * k as f64;
        (x - r * turn.cos()).hypot(y - r * turn.sin()) < 3.0
    };
    if x.hypot(y) > 60.0 || (0..15).any(is_pore) { air } else { concrete + noise }
}

/// A TIFF of one page with 16 bits a pixel: these entries beside the usual ones (tag, type, count,
/// value as it stands), then what an entry may point to (from byte 1000), then pixels from 2000.
pub(crate) fn tiff(
    [width, height]: [usize; 2],
    [bits, format]: [u32; 2],
    more: &[(u16, u16, u32, u32)],
    text: &[u8],
    pixels: &[u8],
) -> Vec<u8> {
    let bytes = (width * height) as u32 * bits / 8;
    let mut entries = vec![
        (256, 4, 1, width as u32),
        (257, 4, 1, height as u32),
        (258, 3, 1, bits),
        (259, 3, 1, 1),
        (262, 3, 1, 1),
        (273, 4, 1, 2000),
        (277, 3, 1, 1),
        (278, 4, 1, height as u32),
        (279, 4, 1, bytes),
        (339, 3, 1, format),
    ];
    entries.extend(more);
    entries.sort_by_key(|e| e.0);
    let mut file = [&b"II*\0"[..], &8_u32.to_le_bytes()].concat();
    file.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        file.extend([tag.to_le_bytes(), u16::to_le_bytes(kind)].concat());
        file.extend([count.to_le_bytes(), u32::to_le_bytes(value)].concat());
    }
    file.extend([0; 4]);
    file.resize(1000, 0);
    file.extend(text);
    file.resize(2000, 0);
    [file, pixels.to_vec()].concat()
}

/// A disc of 16 bits, with this number of dots an inch if it is above 0.
pub(crate) fn disc_tiff(dots: u32) -> Vec<u8> {
    let pixels: Vec<u8> = (0..ACROSS * ACROSS)
        .flat_map(|i| (disc(i, 0.0, 1500.0).max(0.0) as u16).to_le_bytes())
        .collect();
    let text = [dots.to_le_bytes(), 1_u32.to_le_bytes()].concat();
    let more = [(282, 5, 1, 1000), (283, 5, 1, 1000), (296, 3, 1, 2)];
    tiff([ACROSS; 2], [16, 1], if dots > 0 { &more } else { &[] }, &text, &pixels)
}

/// What `detect` found: slices, and everything it says.
fn detected(file: &Path, more: &[&str]) -> (Vec<Value>, String) {
    let args = ["detect", file.to_str().unwrap(), "--method", "classical", "--format", "json"];
    let done = run(&[&args[..], more].concat());
    let text = said(&done);
    assert!(done.status.success(), "{file:?} {text}");
    let json: Value = serde_json::from_slice(&done.stdout).unwrap();
    (json["slices"].as_array().unwrap().clone(), text)
}

fn is_close(a: &Value, b: &Value) -> bool {
    (a["porosity"].as_f64().unwrap() - b["porosity"].as_f64().unwrap()).abs() < 0.004
        && a["cracks"] == b["cracks"]
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn pictures_are_right_or_doubted_with_data() {
    let folder = hostile("public/img");
    let (plain, _) = detected(&folder.join("plain_u16.tif"), &["--pixel-mm", "0.3125"]);
    for (name, count, pixel_from, doubt) in [
        ("plain_u16.tif", 1, "nobody", ""),
        ("dpi300.tif", 1, "nobody", "300 dots an inch"),
        ("imagej_oneifd.tif", 20, "file", ""),
        ("enhanced.dcm", 6, "file", ""),
        ("pad_mhd_3024_circle.mha", 1, "file", ""),
        ("pad_value_typed.dcm", 1, "file", ""),
        ("pad_value_untyped.dcm", 1, "file", ""),
    ] {
        let (slices, text) = detected(&folder.join(name), &[]);
        assert_eq!(slices.len(), count, "{name}");
        for slice in &slices {
            assert_eq!(slice["pixel_from"], pixel_from, "{name}");
            assert!(is_close(slice, &plain[0]), "{name} {slice}");
            if pixel_from == "file" {
                assert!((slice["pixel_mm"].as_f64().unwrap() - 0.3125).abs() < 1e-6, "{name}");
            }
        }
        assert!(text.contains(doubt), "{name} {text}");
    }
}

/// A scene with a volume in files.
fn stacked(folder: &Path, images: &str) -> String {
    let column = "Column(section: Rectangle(width_m: 0.3, depth_m: 0.3), height_m: 1.2)";
    let scene = format!(
        "(schema: \"intrados.scene/1\", members: [(id: \"P0\", body: {column}, at: (0, 0, 0), \
         concrete: \"C30/37\", slices: [Stack(name: \"c\", images: [\"{images}\"])])])"
    );
    let place = folder.join("s.ron");
    fs::write(&place, scene).unwrap();
    let done = run(&["validate", place.to_str().unwrap()]);
    format!("{}{}", said(&done), String::from_utf8_lossy(&done.stdout))
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn series_are_right_or_doubted_with_data() {
    for (name, said) in
        [("missing", None), ("overlap_thickness_nopos", Some("as they are thick, 0.625 mm"))]
    {
        let folder = tempfile::tempdir().unwrap();
        for file in fs::read_dir(hostile(&format!("public/img/series/{name}"))).unwrap() {
            let file = file.unwrap();
            fs::copy(file.path(), folder.path().join(file.file_name())).unwrap();
        }
        let text = stacked(folder.path(), "*.dcm");
        let is_doubted = text.contains("does not say where its slices lie");
        assert_eq!(is_doubted, said.is_some(), "{name} {text}");
        assert!(said.is_none_or(|said| text.contains(said)), "{name} {text}");
    }
}

#[test]
fn resolutions_of_devices_are_not_believed_and_others_are() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.tif");
    for (dots, is_believed, is_said) in [
        (0, false, false),
        (72, false, false),
        (150, false, true),
        (600, false, true),
        (1200, false, true),
        (81, true, false),
        (254, true, false),
    ] {
        fs::write(&file, disc_tiff(dots)).unwrap();
        let (slices, text) = detected(&file, &[]);
        let from = if is_believed { "file" } else { "nobody" };
        assert_eq!(slices[0]["pixel_from"], from, "{dots}");
        assert_eq!(text.contains("dots an inch"), is_said, "{dots} {text}");
        // What is given answers it.
        let (_, text) = detected(&file, &["--pixel-mm", "0.3125"]);
        assert!(is_believed || !text.contains("dots an inch"), "{dots} {text}");
    }
}

/// Padding around a round field is air, by whatever number it is written.
#[test]
fn padding_is_no_pore() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mha");
    let header = |kind: &str| {
        format!(
            "ObjectType = Image\nNDims = 2\nBinaryData = True\nElementSpacing = 0.3125 0.3125\n\
             DimSize = {ACROSS} {ACROSS}\nElementType = {kind}\nElementDataFile = LOCAL\n"
        )
    };
    let write = |pad: Option<f32>, air: f64, concrete: f64| {
        let grey = |i: usize| {
            let [x, y] = [(i % ACROSS) as f64 - 79.5, (i / ACROSS) as f64 - 79.5];
            pad.filter(|_| x.hypot(y) > 79.5).unwrap_or(disc(i, air, concrete) as f32)
        };
        let pixels: Vec<u8> = (0..ACROSS * ACROSS).flat_map(|i| grey(i).to_le_bytes()).collect();
        fs::write(&file, [header("MET_FLOAT").into_bytes(), pixels].concat()).unwrap();
        detected(&file, &[]).0.remove(0)
    };
    let plain = write(None, -1000.0, 500.0);
    assert!(plain["porosity"].as_f64().unwrap() > 0.02, "{plain}");
    for pad in [-1300.0, -2000.0, -3024.0, -32_768.0, 30_000.0] {
        let padded = write(Some(pad), -1000.0, 500.0);
        assert!(is_close(&padded, &plain), "{pad} {padded} {plain}");
    }
    // Attenuation with a padding of −1 or 0 below an air of its own.
    for (pad, air) in [(-1.0, 0.0), (0.0, 300.0)] {
        let padded = write(Some(pad), air, air + 1500.0);
        assert!(is_close(&padded, &plain), "{pad} {padded} {plain}");
    }
}

/// Slices that follow the one page of a TIFF.
#[test]
fn stacks_behind_one_page_are_read_or_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.tif");
    let one: Vec<u8> = (0..ACROSS * ACROSS)
        .flat_map(|i| (disc(i, 0.0, 1500.0).max(0.0) as u16).to_le_bytes())
        .collect();
    let shape = format!("{{\"shape\": [3, {ACROSS}, {ACROSS}], \"truncated\": true}}\0");
    let imagej =
        |n: usize| format!("ImageJ=1.53t\nimages={n}\nslices={n}\nunit=mm\nspacing=0.5\n\0");
    let color = format!("{{\"shape\": [2, 2, {ACROSS}, {ACROSS}]}}\0");
    let cases = [
        (imagej(4), 4, 4, false),
        (shape, 3, 3, false),
        (color, 4, 4, false),
        (imagej(4), 3, 1, true),
        (imagej(1), 1, 1, false),
    ];
    for (text, held, read, is_doubted) in cases {
        let length = text.len() as u32;
        let pixels = one.repeat(held);
        let bytes = tiff([ACROSS; 2], [16, 1], &[(270, 2, length, 1000)], text.as_bytes(), &pixels);
        fs::write(&file, bytes).unwrap();
        let (slices, said) = detected(&file, &["--pixel-mm", "0.3"]);
        assert_eq!(slices.len(), read, "{text}");
        assert!(slices.iter().all(|s| is_close(s, &slices[0])), "{text}");
        assert_eq!(said.contains("its description says"), is_doubted, "{text} {said}");
    }
}
