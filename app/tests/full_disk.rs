//! A disk that is full at any place of any file: what is written is whole or not there, and the
//! program says so in one line.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

/// Runs the program where files may have so many kilobytes and no write goes further.
fn limited(kilobytes: &str, folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new("bash");
    command.args([
        "-c",
        "trap '' XFSZ; ulimit -f \"$0\"; exec \"$@\"",
        kilobytes,
        env!("CARGO_BIN_EXE_intrados"),
    ]);
    command.args(args).args(["--quiet", "--format", "json"]).current_dir(folder);
    command
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("RUST_LOG")
        .env_remove("RUST_BACKTRACE");
    command.output().unwrap()
}

/// All files below a folder, the input left out.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(place) = open.pop() {
        for entry in fs::read_dir(place).unwrap().map(|e| e.unwrap().path()) {
            let name = entry.strip_prefix(folder).unwrap().display().to_string();
            match entry.is_dir() {
                true => open.push(entry),
                false if name.starts_with("input") => {}
                false => drop(found.insert(name, fs::read(entry).unwrap())),
            }
        }
    }
    found
}

/// Whether a file is as it is where the disk is large enough: to the byte, or for the texts that
/// hold times, complete.
fn is_whole(name: &str, bytes: &[u8], good: &BTreeMap<String, Vec<u8>>) -> bool {
    match name.rsplit_once('.').map(|(_, extension)| extension) {
        Some("json") => serde_json::from_slice::<serde_json::Value>(bytes).is_ok(),
        Some("acc" | "html" | "vtu" | "csv" | "exr") => {
            good.get(name).is_some_and(|whole| whole.len().abs_diff(bytes.len()) < 64)
        }
        _ => good.get(name).is_some_and(|whole| whole == bytes),
    }
}

/// Lets every write fail that goes beyond n kilobytes, for every n until all go well.
fn fill_the_disk(prepare: impl Fn(&Path), args: &[&str]) {
    let place = tempfile::tempdir().unwrap();
    prepare(place.path());
    let output = limited("unlimited", place.path(), args);
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    let good = files(place.path());
    let largest = good.values().map(Vec::len).max().unwrap().div_ceil(1024);
    // Every kilobyte of small files; of large ones some.
    let step = largest.div_ceil(24);
    for kilobytes in (0..largest).step_by(step) {
        let place = tempfile::tempdir().unwrap();
        prepare(place.path());
        let output = limited(&kilobytes.to_string(), place.path(), args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(73), "{args:?} at {kilobytes} KB: {said}");
        assert!(
            said.lines().count() == 1 && !said.contains("panicked"),
            "{args:?} at {kilobytes} KB: {said}"
        );
        for (name, bytes) in files(place.path()) {
            assert!(
                is_whole(&name, &bytes, &good),
                "{args:?} at {kilobytes} KB: {name} is half a file"
            );
        }
    }
}

#[test]
fn pictures() {
    fill_the_disk(
        |_| {},
        &["render", "room", "--width", "16", "--height", "12", "--spp", "4", "--out", "out"],
    );
}

#[test]
fn readings() {
    fill_the_disk(|_| {}, &["measure", "room", "--spp", "1", "--guide", "off", "--out", "out"]);
}

#[test]
fn templates() {
    fill_the_disk(|_| {}, &["new", "column", "column.ron"]);
    fill_the_disk(|_| {}, &["new", "column", "column.glb"]);
}

#[test]
fn stresses() {
    let cube = "*NODE, NSET=N\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT, TYPE=C3D8, ELSET=E\n1,1,2,3,4,5,6,7,8\n\
        *MATERIAL,NAME=C\n*ELASTIC\n3e10,0.2\n*SOLID SECTION,ELSET=E,MATERIAL=C\n*BOUNDARY\n1,1,3\n2,1,3\n3,1,3\n4,1,3\n*STEP\n*STATIC\n*CLOAD\n7,3,-1\n*END STEP\n";
    fill_the_disk(
        |place| fs::write(place.join("input.inp"), cube).unwrap(),
        &["analyze", "input.inp", "--units", "m,N", "--out", "out"],
    );
}

#[test]
fn slices_and_tables() {
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 32 2 24\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
    let sinogram: Vec<u8> = header
        .bytes()
        .chain((0..32 * 2 * 24).flat_map(|i| (0.01 * (i % 32) as f32).to_le_bytes()))
        .collect();
    let args = [
        "scan",
        "--sinogram",
        "input.mha",
        "--geometry",
        "parallel",
        "--pixel-mm",
        "0.5",
        "--out",
        "out",
    ];
    fill_the_disk(|place| fs::write(place.join("input.mha"), &sinogram).unwrap(), &args);
    let slice = image::GrayImage::from_fn(64, 64, |x, y| {
        image::Luma([if (x / 8 + y / 8) % 5 == 0 { 40 } else { 160 }])
    });
    let args =
        ["detect", "input.png", "--method", "classical", "--pixel-mm", "0.1", "--out", "out"];
    fill_the_disk(|place| slice.save(place.join("input.png")).unwrap(), &args);
}

#[test]
fn what_a_file_names_lies_beside_it_or_is_allowed() {
    let (ours, theirs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    fs::write(theirs.path().join("mesh.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(theirs.path().join("voxels.raw"), [0; 4 * 32 * 24]).unwrap();
    let there = theirs.path().display();
    fs::write(
        ours.path().join("a.ron"),
        format!("(schema: \"intrados.scene/1\", shapes: [Mesh(file: \"{there}/mesh.obj\")])"),
    )
    .unwrap();
    let header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = 32 1 24\nElementType = MET_FLOAT\nElementDataFile = {there}/voxels.raw\n"
    );
    fs::write(ours.path().join("a.mhd"), header).unwrap();
    let scan = ["scan", "--sinogram", "a.mhd", "--pixel-mm", "0.5"];
    for args in [&["validate", "a.ron"][..], &["info", "a.ron"], &scan] {
        let refused = limited("unlimited", ours.path(), args);
        let said = [refused.stdout, refused.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert!(refused.status.code() == Some(65) && said.contains("--allow"), "{args:?}: {said}");
        let allowed = limited(
            "unlimited",
            ours.path(),
            &[args, &["--allow", theirs.path().to_str().unwrap()]].concat(),
        );
        assert!(allowed.status.success(), "{args:?}: {}", String::from_utf8_lossy(&allowed.stderr));
    }
    assert_eq!(
        limited("unlimited", ours.path(), &["info", "a.ron", "--allow", "no-such-folder"])
            .status
            .code(),
        Some(2)
    );
    // What never ends is not waited for, whoever names it.
    fs::write(
        ours.path().join("b.mhd"),
        "DimSize = 8 8 8\nElementType = MET_FLOAT\nElementDataFile = /dev/urandom\n",
    )
    .unwrap();
    let endless = limited(
        "unlimited",
        ours.path(),
        &["scan", "--sinogram", "b.mhd", "--pixel-mm", "0.5", "--allow", "/"],
    );
    assert!(
        endless.status.code() == Some(65)
            && String::from_utf8_lossy(&endless.stderr).contains("no plain file")
    );
}
