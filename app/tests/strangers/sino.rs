//! Sinograms of strangers: reconstructed, doubted or refused.

use std::{fs, path::Path};

use super::{hostile, img::tiff, run, said};

/// What `scan` says of a sinogram, and whether it went on.
fn scanned(file: &Path, more: &[&str]) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let args = ["scan", "--pixel-mm", "0.5", "--sinogram", file.to_str().unwrap(), "--out"];
    let done = run(&[&args[..], &[out.to_str().unwrap()], more].concat());
    assert_eq!(done.status.success(), out.join("scan.json").exists(), "{}", said(&done));
    (done.status.success(), said(&done))
}

/// What speaks against a sinogram, each by a piece of its sentence.
const DOUBTS: [&str; 8] = [
    "no line integrals",
    "its axis seems",
    "seem to be in it",
    "a whole turn",
    "is dead",
    "behind which nothing is left",
    "--by-row",
    "is not a finite number",
];

/// Whether exactly this doubt is said, or none.
fn is_doubted(text: &str, doubt: Option<&str>) {
    for one in DOUBTS {
        assert_eq!(text.contains(one), doubt == Some(one), "{one}: {text}");
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn sinograms_are_right_doubted_or_refused_with_data() {
    let folder = hostile("public/sino");
    for (name, more, goes_on, doubt) in [
        ("plain.tif", &[][..], true, None),
        ("by_views_stack.tif", &[], true, None),
        ("by_rows_stack.tif", &["--by-row"], true, None),
        ("by_rows_stack.tif", &[], true, Some("--by-row")),
        ("by_views_stack.tif", &["--by-row"], true, Some("--by-row")),
        ("axis_off.tif", &[], true, Some("its axis seems")),
        ("axis_off.tif", &["--axis-bin", "67.5"], true, None),
        ("dead_column.tif", &[], true, Some("is dead")),
        ("endpoint.tif", &[], true, Some("seem to be in it")),
        ("endpoint.tif", &["--arc-deg", "181.0056"], true, None),
        ("per_pixel.tif", &[], true, Some("behind which nothing is left")),
        ("transmission_u16.tif", &[], false, Some("no line integrals")),
        ("nan.tif", &[], false, Some("is not a finite number")),
        ("inf.tif", &[], false, Some("is not a finite number")),
    ] {
        let (went_on, text) = scanned(&folder.join(name), more);
        assert_eq!(went_on, goes_on, "{name} {text}");
        is_doubted(&text, doubt);
    }
}

const BINS: usize = 64;
const VIEWS: usize = 60;

/// Views of two discs over an arc of degrees, as 32-bit floats made of the line integrals.
fn views(arc: f64, axis: f64, of: impl Fn(usize, f64) -> f64) -> Vec<u8> {
    let chord = |u: f64, r: f64| 0.06 * (r * r - u * u).max(0.0).sqrt();
    let value = |i: usize| {
        let (view, bin) = (i / BINS, i % BINS);
        let (sin, cos) = (arc.to_radians() * view as f64 / VIEWS as f64).sin_cos();
        let u = bin as f64 - axis;
        let p = chord(u - 3.0 * cos + 2.0 * sin, 17.0) + chord(u - 9.0 * cos - 4.0 * sin, 4.0);
        of(bin, p) as f32
    };
    let pixels: Vec<u8> = (0..VIEWS * BINS).flat_map(|i| value(i).to_le_bytes()).collect();
    tiff([BINS, VIEWS], [32, 3], &[], &[], &pixels)
}

#[test]
fn relatives_of_sinograms_are_right_doubted_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.tif");
    let plain = |_: usize, p: f64| p;
    let ends = 180.0 * VIEWS as f64 / (VIEWS - 1) as f64;
    for (bytes, goes_on, doubt) in [
        (views(180.0, 31.5, plain), true, None),
        (views(180.0, 31.7, plain), true, None),
        (views(180.0, 29.0, plain), true, Some("its axis seems")),
        (views(180.0, 34.5, plain), true, Some("its axis seems")),
        (views(180.0, 38.0, plain), true, Some("its axis seems")),
        (views(ends, 31.5, plain), true, Some("seem to be in it")),
        (views(360.0, 31.5, plain), true, Some("a whole turn")),
        (views(180.0, 31.5, |bin, p| if bin == 20 { 0.0 } else { p }), true, Some("is dead")),
        (views(180.0, 31.5, |bin, p| if bin == 33 { 4.0 } else { p }), true, Some("is dead")),
        (views(180.0, 31.5, |bin, p| if bin == 44 { 0.7 } else { p }), true, Some("is dead")),
        (views(180.0, 31.5, |_, p| 1e4 * p), true, Some("behind which nothing is left")),
        (views(180.0, 31.5, |_, p| (-p).exp()), false, Some("no line integrals")),
        (views(180.0, 31.5, |_, p| 4000.0 * (-p).exp() + 90.0), false, Some("no line integrals")),
        (
            views(180.0, 31.5, |_, p| (65_535.0 * (-p).exp()).round()),
            false,
            Some("no line integrals"),
        ),
        (
            views(180.0, 31.5, |bin, p| if bin == 9 { f64::NAN } else { p }),
            false,
            Some("is not a finite number"),
        ),
    ] {
        fs::write(&file, bytes).unwrap();
        let (went_on, text) = scanned(&file, &[]);
        assert_eq!(went_on, goes_on, "{doubt:?} {text}");
        is_doubted(&text, doubt);
    }
}
