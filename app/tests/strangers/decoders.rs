//! Files that break decoders: each ends in one line that names it, without a panic, an abort or
//! gigabytes; among sound slices it is left out, and the rest is used.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use super::{hostile, img::disc_tiff, run, said};

/// Memory of the program, kB: what asks for more than the file can hold ends in an abort.
const MEMORY_KB: u64 = 4 << 20;

/// The program with bounded memory.
fn bounded(args: &[&str]) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", &format!("ulimit -v {MEMORY_KB}; exec \"$@\""), "sh"]);
    command.arg(env!("CARGO_BIN_EXE_intrados")).args(args);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("RUST_LOG");
    command.output().unwrap()
}

/// Every reader of pictures refuses a file in a line with its name.
fn is_refused(file: &Path) {
    let path = file.to_str().unwrap();
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("out");
    for args in [
        vec!["detect", path, "--pixel-mm", "0.3", "--method", "classical"],
        vec!["scan", "--sinogram", path, "--pixel-mm", "0.3", "--out", out.to_str().unwrap()],
    ] {
        let done = bounded(&args);
        let text = said(&done);
        assert!(!done.status.success() && done.status.code().is_some(), "{args:?} {text}");
        assert!(!text.contains("panicked") && !text.contains("internal error"), "{args:?} {text}");
        let line = String::from_utf8_lossy(&done.stderr).into_owned();
        let last = line.trim_end().lines().last().unwrap();
        assert!(last.starts_with("intrados: ") && last.contains(path), "{args:?} {text}");
        assert!(!out.exists(), "{args:?}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn files_that_broke_decoders_are_refused_with_data() {
    let mut all: Vec<PathBuf> =
        fs::read_dir(hostile("decoders")).unwrap().map(|e| e.unwrap().path()).collect();
    all.sort();
    assert!(all.len() >= 6);
    all.iter().for_each(|file| is_refused(file));
}

/// A PNG with a palette of these bytes.
fn palette_png(bytes: usize) -> Vec<u8> {
    let crc = |data: &[u8]| {
        !data.iter().fold(!0_u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |c, _| {
                if c & 1 == 1 { 0xedb8_8320 ^ c >> 1 } else { c >> 1 }
            })
        })
    };
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [&kind[..], data].concat();
        let sum = crc(&body).to_be_bytes();
        [&(data.len() as u32).to_be_bytes()[..], &body, &sum].concat()
    };
    let head = [0, 0, 0, 40, 0, 0, 0, 40, 8, 3, 0, 0, 0];
    // 40 rows of 41 zeros, stored.
    let rows = [0_u8; 40 * 41];
    let [low, high] = (rows.len() as u16).to_le_bytes();
    let zlib = [&[0x78, 0x01, 0x01, low, high, !low, !high][..], &rows, &[0, 0, 0, 0]].concat();
    [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &head),
        chunk(b"PLTE", &vec![7; bytes]),
        chunk(b"IDAT", &zlib),
        chunk(b"IEND", &[]),
    ]
    .concat()
}

/// A DICOM file with explicit elements and this after its facts.
fn dicom(syntax: &str, elements: &[u8]) -> Vec<u8> {
    let mut name = syntax.as_bytes().to_vec();
    name.resize(name.len().next_multiple_of(2), 0);
    let facts = [&[2, 0, 0x10, 0][..], b"UI", &(name.len() as u16).to_le_bytes(), &name].concat();
    let length = (facts.len() as u32).to_le_bytes();
    let group = [&[2, 0, 0, 0][..], b"UL", &[4, 0], &length].concat();
    [&[0; 128][..], b"DICM", &group, &facts, elements].concat()
}

/// An explicit element with a long length.
fn long(tag: [u8; 4], kind: &[u8; 2], length: u32, value: &[u8]) -> Vec<u8> {
    [&tag[..], kind, &[0, 0], &length.to_le_bytes(), value].concat()
}

const EXPLICIT: &str = "1.2.840.10008.1.2.1";
const RUNS: &str = "1.2.840.10008.1.2.5";

/// Sequences in sequences, each with its length.
fn nested(depth: usize) -> Vec<u8> {
    (0..depth).fold(Vec::new(), |inner, _| {
        let item = [&[0xfe, 0xff, 0, 0xe0][..], &(inner.len() as u32).to_le_bytes(), &inner];
        let item = item.concat();
        long([8, 0, 0x15, 0x11], b"SQ", item.len() as u32, &item)
    })
}

/// A frame of 16 × 16 that is packed by runs, whose table is these numbers.
fn runs(table: &[u32]) -> Vec<u8> {
    let short = |tag: [u8; 4], n: u16| [&tag[..], b"US", &[2, 0], &n.to_le_bytes()].concat();
    let mut frame: Vec<u8> = table.iter().flat_map(|n| n.to_le_bytes()).collect();
    frame.resize(96, 0);
    let item = |bytes: &[u8]| {
        [&[0xfe, 0xff, 0, 0xe0][..], &(bytes.len() as u32).to_le_bytes(), bytes].concat()
    };
    let packed = [item(&[]), item(&frame), vec![0xfe, 0xff, 0xdd, 0xe0, 0, 0, 0, 0]].concat();
    [
        short([0x28, 0, 2, 0], 1),
        short([0x28, 0, 0x10, 0], 16),
        short([0x28, 0, 0x11, 0], 16),
        short([0x28, 0, 0, 1], 16),
        long([0xe0, 0x7f, 0x10, 0], b"OB", u32::MAX, &packed),
    ]
    .concat()
}

#[test]
fn relatives_that_break_decoders_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sound = disc_tiff(0);
    let relatives: [(&str, Vec<u8>); 13] = [
        ("plte1.png", palette_png(1)),
        ("plte4.png", palette_png(4)),
        ("plte769.png", palette_png(769)),
        ("defined.dcm", dicom(EXPLICIT, &nested(4000))),
        ("open.dcm", dicom(EXPLICIT, &long([8, 0, 0x15, 0x11], b"SQ", u32::MAX, &[]))),
        ("long.dcm", dicom(EXPLICIT, &long([8, 0, 0, 0x10], b"OB", 0xffff_fff0, &[0; 9]))),
        ("implicit.dcm", dicom("1.2.840.10008.1.2", &[8, 0, 0, 0x10, 0xf0, 0xff, 0xff, 0x7f])),
        ("runs16.dcm", dicom(RUNS, &runs(&[16, 64]))),
        ("runs0.dcm", dicom(RUNS, &runs(&[0]))),
        ("beyond.dcm", dicom(RUNS, &runs(&[2, 64, 4000]))),
        ("deflated.dcm", dicom("1.2.840.10008.1.2.1.99", &[1, 2, 3])),
        ("cut.tif", sound[..sound.len() / 2].to_vec()),
        ("empty.tif", Vec::new()),
    ];
    for (name, bytes) in relatives {
        let file = folder.path().join(name);
        fs::write(&file, bytes).unwrap();
        is_refused(&file);
    }
}

/// A bad slice among sound ones is left out, and said so; `validate` says it beforehand.
#[test]
fn a_bad_slice_does_not_lose_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for name in ["a.tif", "b.tif"] {
        fs::write(at(name), disc_tiff(0)).unwrap();
    }
    fs::write(at("m.png"), palette_png(2)).unwrap();
    fs::write(at("n.dcm"), dicom(EXPLICIT, &nested(4000))).unwrap();
    let files = ["a.tif", "m.png", "n.dcm", "b.tif"].map(|n| at(n).to_str().unwrap().to_owned());
    let list: Vec<&str> = files.iter().map(String::as_str).collect();
    let done =
        run(&[&["detect", "--method", "classical", "--pixel-mm", "0.3125"], &list[..]].concat());
    assert!(done.status.success(), "{}", said(&done));
    assert_eq!(said(&done).matches("not used, because").count(), 2, "{}", said(&done));
    let images = r#""a.tif", "m.png", "n.dcm", "b.tif""#;
    let column = "Column(section: Rectangle(width_m: 0.3, depth_m: 0.3), height_m: 1.2)";
    let slices = format!("Files(name: \"c\", images: [{images}], pixel_mm: 0.3125)");
    let scene = format!(
        "(schema: \"intrados.scene/1\", members: [(id: \"P0\", body: {column}, at: (0, 0, 0), \
         concrete: \"C30/37\", slices: [{slices}])])"
    );
    fs::write(at("s.ron"), scene).unwrap();
    let (scene, out) = (at("s.ron"), at("out"));
    let [scene, out] = [&scene, &out].map(|path| path.to_str().unwrap());
    let checked = run(&["validate", scene]);
    let text = format!("{}{}", said(&checked), String::from_utf8_lossy(&checked.stdout));
    assert!(text.contains("m.png") && text.contains("n.dcm"), "{text}");
    let done = run(&["predict", scene, "--no-forecast", "--method", "classical", "--out", out]);
    let text = format!("{}{}", said(&done), String::from_utf8_lossy(&done.stdout));
    assert!(done.status.success(), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    let json = fs::read_to_string(at("out").join("predict.json")).unwrap();
    for bad in ["m.png", "n.dcm"] {
        assert!(json.contains(bad), "{bad} {text}");
    }
    assert!(json.contains("cannot be read as PNG") && json.contains("nested deeper"), "{json}");
}
