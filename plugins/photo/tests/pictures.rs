//! Files of photographs: good ones, and what is refused by name.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{fs, io::Cursor, path::PathBuf};

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use intrados_photo::{Photograph, picture::linear};

/// A picture of 40 × 24 pixels that is red in its left half, and brighter downwards.
fn picture() -> RgbImage {
    RgbImage::from_fn(40, 24, |x, y| {
        let light = 40 + 8 * y as u8;
        Rgb(if x < 20 { [light, 20, 20] } else { [20, 20, light] })
    })
}

fn bytes(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// EXIF in little-endian TIFF: orientation, camera, and a focal length as of 35 mm film.
fn exif(orientation: u16, focal_35mm: u16) -> Vec<u8> {
    let mut tiff = b"II\x2a\0\x08\0\0\0".to_vec();
    let entry = |tag: u16, kind: u16, count: u32, value: [u8; 4]| {
        let mut entry = Vec::new();
        entry.extend(tag.to_le_bytes());
        entry.extend(kind.to_le_bytes());
        entry.extend(count.to_le_bytes());
        entry.extend(value);
        entry
    };
    let short = |x: u16| [x.to_le_bytes()[0], x.to_le_bytes()[1], 0, 0];
    // Offsets: 8 + 2 + 3 · 12 + 4 = 50 is the EXIF directory, of one entry.
    tiff.extend(3_u16.to_le_bytes());
    tiff.extend(entry(0x0110, 2, 4, *b"Eye\0"));
    tiff.extend(entry(0x0112, 3, 1, short(orientation)));
    tiff.extend(entry(0x8769, 4, 1, 50_u32.to_le_bytes()));
    tiff.extend(0_u32.to_le_bytes());
    tiff.extend(1_u16.to_le_bytes());
    tiff.extend(entry(0xa405, 3, 1, short(focal_35mm)));
    tiff.extend(0_u32.to_le_bytes());
    tiff
}

/// A JPEG with EXIF behind its start.
fn jpeg_with(exif: &[u8]) -> Vec<u8> {
    let plain = bytes(&picture().into(), ImageFormat::Jpeg);
    let mut jpeg = plain[..2].to_vec();
    jpeg.extend([0xff, 0xe1]);
    jpeg.extend((8 + exif.len() as u16).to_be_bytes());
    jpeg.extend(b"Exif\0\0");
    jpeg.extend(exif);
    jpeg.extend(&plain[2..]);
    jpeg
}

fn write(folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn pictures_are_read_in_linear_light() {
    let folder = tempfile::tempdir().unwrap();
    let eight = DynamicImage::from(picture());
    let sixteen = DynamicImage::from(eight.to_rgb16());
    for (name, picture, format) in [
        ("a.png", &eight, ImageFormat::Png),
        ("b.png", &sixteen, ImageFormat::Png),
        ("a.tif", &eight, ImageFormat::Tiff),
        ("b.tif", &sixteen, ImageFormat::Tiff),
    ] {
        let path = write(&folder, name, &bytes(picture, format));
        let photograph = Photograph::open(&path).unwrap();
        assert_eq!(photograph.size, [40, 24]);
        for (x, y) in [(0, 0), (25, 7), (39, 23)] {
            let light = photograph.light(x, y).unwrap();
            for (k, value) in eight.to_rgb8().get_pixel(x, y).0.into_iter().enumerate() {
                assert!((light[k] - linear(f32::from(value) / 255.0)).abs() < 1e-6, "{name}");
            }
            let at = photograph.light_at([f64::from(x) + 0.5, f64::from(y) + 0.5]).unwrap();
            assert!(at.distance(light) < 1e-6);
        }
        assert_eq!(photograph.light(40, 0), None);
        assert_eq!(photograph.light_at([-0.1, 3.0]), None);
        let [a, b] = [3, 4].map(|y| photograph.light(5, y).unwrap());
        let between = photograph.light_at([5.5, 4.25]).unwrap();
        assert!(between.distance(a.lerp(b, 0.75)) < 1e-6);
        assert!(photograph.notes[0].contains("EXIF"), "{:?}", photograph.notes);
    }
}

/// Orientation 6: the first row is at the right of the upright picture.
#[test]
fn a_photograph_is_turned_upright_and_says_its_focal_length() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(&folder, "turned.jpg", &jpeg_with(&exif(6, 28)));
    let photograph = Photograph::open(&path).unwrap();
    assert_eq!(photograph.size, [24, 40]);
    assert_eq!(photograph.taken.camera.as_deref(), Some("Eye"));
    // What was red at the left is above now.
    let [above, below] = [5, 35].map(|y| photograph.light(12, y).unwrap());
    assert!(above.x > above.z && below.z > below.x);
    // What was dark above is at the right.
    let [left, right] = [2, 21].map(|x| photograph.light(x, 5).unwrap());
    assert!(left.x > right.x);
    let focal = photograph.taken.focal(photograph.size).unwrap();
    assert!((focal.px - 28.0 / 43.266_615 * 24.0_f64.hypot(40.0)).abs() < 1e-9);
    assert!(focal.rel_error > 0.0);
}

#[test]
fn damaged_exif_is_left_out_and_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut broken = exif(1, 28);
    broken.truncate(30);
    let path = write(&folder, "broken.jpg", &jpeg_with(&broken));
    let photograph = Photograph::open(&path).unwrap();
    assert_eq!(photograph.size, [40, 24]);
    assert!(!photograph.notes.is_empty());
}

/// A JPEG header of four colours; HEIC; raw files by their magic and by their ending; an empty and
/// a cut file; a picture of one row; a GIF.
#[test]
fn what_is_not_read_is_named_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let cmyk = b"\xff\xd8\xff\xe0\0\x04ab\xff\xc0\0\x14\x08\0\x20\0\x20\x04aaaaaaaaaaaaaaa";
    let heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic";
    let jpeg = bytes(&picture().into(), ImageFormat::Jpeg);
    let row = bytes(&RgbImage::new(40, 1).into(), ImageFormat::Png);
    for (name, bytes, word) in [
        ("print.jpg", &cmyk[..], "RGB"),
        ("phone.heic", heic, "JPEG"),
        ("phone.jpg", heic, "JPEG"),
        ("film.cr2", b"II\x2a\0\x10\0\0\0CR\x02\0", "develop"),
        ("film.cr3", b"\0\0\0\x18ftypcrx \0\0\0\0", "develop"),
        ("film.raf", b"FUJIFILMCCD-RAW 0201", "develop"),
        ("film.NEF", b"MM\0\x2a\0\0\0\x08", "develop"),
        ("empty.jpg", b"", "JPEG"),
        ("cut.jpg", &jpeg[..jpeg.len() / 3], "export"),
        ("row.png", &row, "pixels"),
        ("moving.gif", b"GIF89a\x01\0\x01\0\0\0\0", "JPEG"),
    ] {
        let path = write(&folder, name, bytes);
        let error = Photograph::open(&path).unwrap_err();
        assert!(!error.is_missing() && error.to_string().contains(word), "{name}: {error}");
    }
    assert!(Photograph::open(&folder.path().join("none.jpg")).unwrap_err().is_missing());
    assert!(!Photograph::open(folder.path()).unwrap_err().to_string().is_empty());
}

/// A header that promises 30 000 × 30 000 pixels is refused before memory is asked for.
#[test]
fn a_giant_is_refused_by_its_header() {
    let folder = tempfile::tempdir().unwrap();
    let mut giant = bytes(&picture().into(), ImageFormat::Png);
    giant[16..20].copy_from_slice(&30_000_u32.to_be_bytes());
    giant[20..24].copy_from_slice(&30_000_u32.to_be_bytes());
    // The header's checksum (PNG, annex D).
    let crc = giant[12..29].iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    });
    giant[29..33].copy_from_slice(&(!crc).to_be_bytes());
    let path = write(&folder, "giant.png", &giant);
    let error = Photograph::open(&path).unwrap_err().to_string();
    assert!(error.contains("30000") && error.contains("120 megapixels"), "{error}");
}

/// Some thousand damaged files of each kind: read or refused, never a panic.
#[test]
fn damaged_files_never_panic() {
    use intrados_stage::random::Key;
    let folder = tempfile::tempdir().unwrap();
    let picture = DynamicImage::from(picture());
    let files = [
        ("a.jpg", jpeg_with(&exif(6, 28))),
        ("a.png", bytes(&picture, ImageFormat::Png)),
        ("a.tif", bytes(&DynamicImage::from(picture.to_rgb16()), ImageFormat::Tiff)),
    ];
    let mut read = 0;
    for (seed, (name, good)) in (0..).zip(&files) {
        for k in 0..1500_u64 {
            let key = Key::new(40 + seed, k);
            let mut bad = good.clone();
            for i in 0..1 + key.bits(0) % 4 {
                // Headers more often than pixels.
                let share = key.unit(3 * i + 1).powi(3);
                let at = (share * bad.len() as f32) as usize;
                bad[at] = key.bits(3 * i + 2) as u8;
            }
            if key.bits(99).is_multiple_of(5) {
                bad.truncate((key.unit(98) * bad.len() as f32) as usize);
            }
            let path = write(&folder, name, &bad);
            match Photograph::open(&path) {
                Ok(photograph) => {
                    read += 1;
                    let [width, height] = photograph.size;
                    assert!(photograph.light(width - 1, height - 1).is_some());
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    assert!(read > 100, "{read}");
}
