use std::{fs, path::Path};

use intrados_stage::{Job, random::Key};
use tempfile::TempDir;
use tiff::encoder::{TiffEncoder, colortype};

use super::*;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Random values on a small grid.
fn sample(size: [usize; 3]) -> Volume {
    let grid = Grid { size, voxel: [1e-4, 2e-4, 5e-4], origin: [-1e-3, 0.0, 3e-3] };
    let data = (0..grid.len()).map(|i| Key::new(1, i as u64).unit(0) * 60.0).collect();
    Volume { grid, data }
}

fn write(path: &Path, volume: &Volume, depth: Depth) {
    let mut writer = Writer::create(path, volume.grid, depth).unwrap();
    for z in 0..volume.grid.size[2] {
        writer.write_slab(volume.slice(z)).unwrap();
    }
    writer.finish().unwrap();
}

fn read(path: &Path) -> Result<Volume, VolumeError> {
    Reader::open(path, None)?.read(&Job::default())
}

/// One line that names the file.
fn refused(path: &Path, file: &str, place: &str) {
    let error =
        Reader::open(path, Some([1e-3; 3])).and_then(|mut r| r.read(&Job::default())).unwrap_err();
    let text = error.to_string();
    assert!(
        !error.is_missing() && text.contains(file) && text.contains(place) && !text.contains('\n'),
        "{text}"
    );
}

#[test]
fn volumes_come_back_as_written() {
    let dir = folder();
    let volume = sample([7, 5, 4]);
    for name in ["a.tif", "a.mhd"] {
        let path = dir.path().join(name);
        write(&path, &volume, Depth::Float);
        let back = read(&path).unwrap();
        assert_eq!(back.data, volume.data);
        for k in 0..3 {
            assert!(
                (back.grid.voxel[k] / volume.grid.voxel[k] - 1.0).abs() < 1e-6,
                "{name} {:?}",
                back.grid.voxel
            );
        }
        write(&path, &volume, Depth::Sixteen { low: 0.0, high: 60.0 });
        let back = read(&path).unwrap();
        assert!(
            back.data
                .iter()
                .zip(&volume.data)
                .all(|(code, v)| (code / 65_535.0 * 60.0 - v).abs() <= 0.5001 * 60.0 / 65_535.0)
        );
    }
    assert_eq!(
        read(&dir.path().join("a.mhd")).unwrap().grid.origin.map(|x| (x * 1e9).round()),
        [-1e6, 0.0, 3e6]
    );
    // Two files a volume of raw and one of TIFF, and no temporary left.
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 3);
}

#[test]
fn slabs_are_parts_of_the_whole() {
    let dir = folder();
    let volume = sample([6, 3, 9]);
    for name in ["a.tif", "a.mhd"] {
        let path = dir.path().join(name);
        write(&path, &volume, Depth::Float);
        let mut reader = Reader::open(&path, None).unwrap();
        for z in [7..9, 0..1, 2..7, 9..9] {
            let slab = reader.read_slab(z.clone(), &Job::default()).unwrap();
            assert_eq!(slab.data, volume.data[z.start * 18..z.end * 18]);
            assert!((slab.grid.origin[2] - reader.grid().at(2, z.start)).abs() < 1e-15);
        }
        assert!(reader.read_slab(5..10, &Job::default()).is_err());
    }
    let job = Job::default();
    job.cancel();
    assert!(matches!(
        Reader::open(&dir.path().join("a.tif"), None).unwrap().read(&job),
        Err(VolumeError::Cancelled(_))
    ));
}

#[test]
fn folders_and_depths_read_alike() {
    let dir = folder();
    let at = |n: &str| dir.path().join(n);
    let values: [u16; 6] = [0, 1, 2, 3, 200, 255];
    let file = |n: &str| fs::File::create(at(n)).unwrap();
    TiffEncoder::new(file("s_2.tif"))
        .unwrap()
        .write_image::<colortype::Gray8>(3, 2, &values.map(|v| v as u8))
        .unwrap();
    TiffEncoder::new(file("s_10.tif"))
        .unwrap()
        .write_image::<colortype::Gray16>(3, 2, &values)
        .unwrap();
    TiffEncoder::new(file("s_11.tif"))
        .unwrap()
        .write_image::<colortype::Gray32>(3, 2, &values.map(u32::from))
        .unwrap();
    TiffEncoder::new(file("s_12.tif"))
        .unwrap()
        .write_image::<colortype::Gray32Float>(3, 2, &values.map(f32::from))
        .unwrap();
    image::GrayImage::from_raw(3, 2, values.map(|v| v as u8).to_vec())
        .unwrap()
        .save(at("s_13.png"))
        .unwrap();
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, values.to_vec())
        .unwrap()
        .save(at("s_14.png"))
        .unwrap();
    let volume = Reader::open(dir.path(), Some([1e-3; 3])).unwrap().read(&Job::default()).unwrap();
    assert_eq!(volume.grid.size, [3, 2, 6]);
    for z in 0..6 {
        assert_eq!(volume.slice(z), values.map(f32::from), "slice {z}");
    }
    // Nobody told the voxel.
    assert!(Reader::open(dir.path(), None).unwrap_err().to_string().contains("voxel"));
    TiffEncoder::new(file("s_20.tif"))
        .unwrap()
        .write_image::<colortype::Gray8>(2, 2, &[0; 4])
        .unwrap();
    refused(dir.path(), "s_20.tif", "2 × 2");
}

#[test]
fn metaimages_of_all_types_read() {
    let dir = folder();
    let header = |kind: &str, msb: &str, data: &str| {
        format!(
            "ObjectType = Image\nNDims = 2\nDimSize = 2 2\nElementSpacing = 0.5 0.25\nElementType = {kind}\nElementByteOrderMSB = {msb}\n{data}"
        )
    };
    macro_rules! check {
        ($($kind:literal $t:ty),*) => {$(
            for msb in [false, true] {
                let bytes = [1 as $t, 2 as $t, 3 as $t, 100 as $t].map(|v| if msb { v.to_be_bytes() } else { v.to_le_bytes() }).concat();
                let mut file = header($kind, if msb { "True" } else { "False" }, "ElementDataFile = LOCAL\n").into_bytes();
                file.extend(bytes);
                let path = dir.path().join("a.mha");
                fs::write(&path, file).unwrap();
                let volume = read(&path).unwrap();
                assert_eq!(volume.data, [1.0, 2.0, 3.0, 100.0], "{} {msb}", $kind);
                assert_eq!(volume.grid.voxel[..2], [5e-4, 2.5e-4]);
            }
        )*};
    }
    check!("MET_UCHAR" u8, "MET_CHAR" i8, "MET_USHORT" u16, "MET_SHORT" i16, "MET_UINT" u32, "MET_INT" i32, "MET_ULONG" u32, "MET_LONG" i32);
    check!("MET_ULONG_LONG" u64, "MET_LONG_LONG" i64, "MET_FLOAT" f32, "MET_DOUBLE" f64);

    let list = dir.path().join("list.mhd");
    let text = "NDims = 3\nDimSize = 2 1 2\nElementSpacing = 1 1 2\nElementType = MET_UCHAR\nHeaderSize = -1\nElementDataFile = LIST\nb.raw\na.raw\n";
    fs::write(&list, text).unwrap();
    fs::write(dir.path().join("a.raw"), [9, 9, 3, 4]).unwrap();
    fs::write(dir.path().join("b.raw"), [1, 2]).unwrap();
    assert_eq!(read(&list).unwrap().data, [1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn bad_files_are_refused_in_one_line() {
    let dir = folder();
    let at = |n: &str| dir.path().join(n);
    let mut volume = sample([8, 8, 3]);
    write(&at("whole.tif"), &volume, Depth::Float);
    volume.data[70] = f32::NAN;
    write(&at("nan.tif"), &volume, Depth::Float);
    write(&at("nan.mhd"), &volume, Depth::Float);
    refused(&at("nan.tif"), "nan.tif", "page 1, pixel 6,0");
    refused(&at("nan.mhd"), "nan.raw", "voxel 6,0,1");

    let whole = fs::read(at("whole.tif")).unwrap();
    fs::write(at("short.tif"), &whole[..whole.len() / 2]).unwrap();
    refused(&at("short.tif"), "short.tif", "page");
    for name in ["empty.tif", "empty.mhd", "empty.png"] {
        fs::write(at(name), []).unwrap();
        refused(&at(name), name, "0 bytes");
    }
    fs::write(at("text.tif"), "not a picture").unwrap();
    refused(&at("text.tif"), "text.tif", "neither TIFF nor PNG");
    TiffEncoder::new(fs::File::create(at("rgb.tif")).unwrap())
        .unwrap()
        .write_image::<colortype::RGB8>(1, 1, &[1, 2, 3])
        .unwrap();
    refused(&at("rgb.tif"), "rgb.tif", "coloured");
    image::RgbImage::new(2, 2).save(at("rgb.png")).unwrap();
    refused(&at("rgb.png"), "rgb.png", "coloured");

    fs::write(at("v.raw"), [0; 100]).unwrap();
    let header = |dims: &str, kind: &str, rest: &str| {
        format!("NDims = 3\nDimSize = {dims}\nElementSpacing = 1 1 1\nElementType = {kind}\n{rest}")
    };
    let cases = [
        ("16000 16000 16000", "MET_DOUBLE", "ElementDataFile = v.raw", "v.raw", "100 bytes"),
        ("99999999999999999999 1 1", "MET_UCHAR", "ElementDataFile = v.raw", "h.mhd", "line 2"),
        ("5 5 -4", "MET_UCHAR", "ElementDataFile = v.raw", "h.mhd", "-4"),
        ("0 5 4", "MET_UCHAR", "ElementDataFile = v.raw", "h.mhd", "DimSize"),
        ("5 5 4", "MET_BIT", "ElementDataFile = v.raw", "h.mhd", "MET_BIT"),
        ("5 5 4", "MET_USHORT", "ElementDataFile = v.raw", "v.raw", "need 200"),
        (
            "5 5 4",
            "MET_UCHAR",
            "CompressedData = True\nElementDataFile = v.raw",
            "h.mhd",
            "compressed",
        ),
        ("5 5 4", "MET_UCHAR", "ElementDataFile = LIST\nv.raw", "h.mhd", "lists 1"),
        (
            "5 5 4",
            "MET_UCHAR",
            "HeaderSize = 9223372036854775807\nElementDataFile = v.raw",
            "v.raw",
            "100 bytes",
        ),
        (
            "5 5 4",
            "MET_UCHAR",
            "ElementSpacing = 0 1 1\nElementDataFile = v.raw",
            "h.mhd",
            "above 0",
        ),
        ("5 5 4", "MET_UCHAR", "", "h.mhd", "no ElementDataFile"),
    ];
    for (dims, kind, rest, file, place) in cases {
        fs::write(at("h.mhd"), header(dims, kind, rest)).unwrap();
        refused(&at("h.mhd"), file, place);
    }
    assert!(read(&at("nothing.tif")).unwrap_err().is_missing());
    assert!(Reader::open(Path::new("/dev/null"), None).is_err());
}

/// 500 damaged files of each kind: flipped bytes, cuts, insertions. Whatever comes of it, it is an
/// answer: no panic, no hang, no memory beyond what the file's length allows (a page may claim at
/// most 2000 times that, here under 3 MB).
#[test]
fn damaged_files_do_no_harm() {
    let dir = folder();
    let volume = sample([9, 4, 3]);
    let mut refusals = 0;
    for (kind, name) in ["a.tif", "b.tif", "c.png", "d.mha"].into_iter().enumerate() {
        let path = dir.path().join(name);
        match kind {
            0 => write(&path, &volume, Depth::Float),
            1 => {
                let file = fs::File::create(&path).unwrap();
                let mut encoder = TiffEncoder::new(file)
                    .unwrap()
                    .with_compression(tiff::encoder::Compression::Lzw);
                encoder.write_image::<colortype::Gray8>(9, 4, &[7; 36]).unwrap();
            }
            2 => image::GrayImage::from_raw(9, 4, (0..36).collect()).unwrap().save(&path).unwrap(),
            _ => {
                let text = "NDims = 3\nDimSize = 9 4 3\nElementSpacing = 1 1 1\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
                fs::write(
                    &path,
                    [
                        text.as_bytes(),
                        &volume.data.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>(),
                    ]
                    .concat(),
                )
                .unwrap();
            }
        }
        let whole = fs::read(&path).unwrap();
        for turn in 0..500 {
            let key = Key::new(kind as u64, turn);
            let place = |i: u32, n: usize| (key.unit(i) * n as f32) as usize;
            let mut damaged = whole.clone();
            for hit in 0..1 + place(0, 4) as u32 {
                let at = place(10 + 4 * hit, damaged.len().max(1));
                match place(11 + 4 * hit, 4) {
                    0 => damaged.truncate(at),
                    1 => damaged.insert(at, key.bits(12 + 4 * hit) as u8),
                    _ => damaged
                        .iter_mut()
                        .skip(at)
                        .take(1)
                        .for_each(|b| *b = key.bits(12 + 4 * hit) as u8),
                }
            }
            fs::write(&path, damaged).unwrap();
            refusals += usize::from(
                Reader::open(&path, Some([1e-3; 3]))
                    .and_then(|mut r| r.read(&Job::default()))
                    .is_err(),
            );
        }
    }
    // The damage is real: most of it is noticed.
    assert!(refusals > 700, "{refusals}");
}

/// A header of a TIFF of 8-bit grey, deflated into one strip, in a file of `length` bytes.
fn header(path: &Path, side: u32, length: usize) {
    let tags = [
        (256, side),
        (257, side),
        (258, 8),
        (259, 8),
        (262, 1),
        (273, 200),
        (277, 1),
        (278, side),
        (279, length as u32 - 200),
    ];
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    bytes.extend((tags.len() as u16).to_le_bytes());
    for (tag, value) in tags {
        // Of type LONG, one value.
        bytes.extend([tag as u16, 4].map(u16::to_le_bytes).concat());
        bytes.extend([1, value].map(u32::to_le_bytes).concat());
    }
    bytes.resize(length, 0);
    fs::write(path, bytes).unwrap();
}

/// Half a gigabyte in 260 kB is refused before any of it is unpacked; a page of 8192 × 8192 is only
/// found damaged once it is.
#[test]
fn what_would_fill_the_memory_is_refused_by_its_size() {
    let dir = folder();
    let path = dir.path().join("bomb.tif");
    header(&path, 16_384, 260_000);
    refused(&path, "bomb.tif", "16384 × 16384 pixels, 1342 MB");
    header(&path, 8192, 260_000);
    assert!(Reader::open(&path, Some([1e-3; 3])).is_ok());
}

/// 20 pixels a mm by the tags of resolution; 72 dots an inch are nobody's measure.
#[test]
fn pictures_tell_the_size_of_their_pixels() {
    use tiff::{encoder::Rational, tags::ResolutionUnit};
    let dir = folder();
    let told = |unit: ResolutionUnit, n: u32| {
        let path = dir.path().join("a.tif");
        let mut encoder = TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
        let mut image = encoder.new_image::<colortype::Gray8>(3, 2).unwrap();
        image.resolution(unit, Rational { n, d: 1 });
        image.write_data(&[1; 6]).unwrap();
        Reader::open(&path, Some([1e-3; 3]))
            .unwrap()
            .told_pixel()
            .map(|edges| edges.map(|e| (e * 1e9).round()))
    };
    assert_eq!(told(ResolutionUnit::Centimeter, 200), Some([5e4; 2]));
    assert_eq!(told(ResolutionUnit::Inch, 508), Some([5e4; 2]));
    assert_eq!(
        [
            told(ResolutionUnit::Inch, 72),
            told(ResolutionUnit::None, 200),
            told(ResolutionUnit::Inch, 0)
        ],
        [None; 3]
    );
    let path = dir.path().join("b.tif");
    write(&path, &sample([3, 2, 1]), Depth::Float);
    assert_eq!(
        Reader::open(&path, None).unwrap().told_pixel().map(|e| e.map(|e| (e * 1e9).round())),
        Some([1e5, 2e5])
    );
}

/// A DICOM file by PS3.10, explicit VR, little endian: elements as (group, element, VR, value).
fn dicom(elements: &[(u16, u16, &str, Vec<u8>)]) -> Vec<u8> {
    let element = |&(group, element, vr, ref value): &(u16, u16, &str, Vec<u8>)| {
        let mut value = value.clone();
        if value.len() % 2 == 1 {
            value.push(if vr == "UI" { 0 } else { b' ' });
        }
        let mut bytes = [group.to_le_bytes(), element.to_le_bytes()].concat();
        bytes.extend(vr.bytes());
        match vr {
            "OW" | "OB" => {
                bytes.extend([0, 0]);
                bytes.extend((value.len() as u32).to_le_bytes());
            }
            _ => bytes.extend((value.len() as u16).to_le_bytes()),
        }
        bytes.extend(value);
        bytes
    };
    let text = |t: &str| t.as_bytes().to_vec();
    let meta = [
        (2, 1, "OB", vec![0, 1]),
        (2, 2, "UI", text("1.2.840.10008.5.1.4.1.1.2")),
        (2, 3, "UI", text("1.2.3.4")),
        (2, 0x10, "UI", text("1.2.840.10008.1.2.1")),
        (2, 0x12, "UI", text("1.2.3")),
    ];
    let meta: Vec<u8> = meta.iter().flat_map(element).collect();
    let mut file = vec![0; 128];
    file.extend(b"DICM");
    file.extend(element(&(2, 0, "UL", (meta.len() as u32).to_le_bytes().to_vec())));
    file.extend(meta);
    file.extend(elements.iter().flat_map(element));
    file
}

/// A slice of 3 × 2 pixels at height `z` mm whose stored values begin with `first`.
fn slice(z: f64, series: &str, first: i16) -> Vec<u8> {
    let text = |t: &str| t.as_bytes().to_vec();
    let short = |n: u16| n.to_le_bytes().to_vec();
    let pixels = (0..6).flat_map(|i| (first + i).to_le_bytes()).collect();
    dicom(&[
        (8, 0x60, "CS", text("CT")),
        (0x20, 0xE, "UI", text(series)),
        (0x20, 0x32, "DS", text(&format!("0\\0\\{z}"))),
        (0x20, 0x37, "DS", text("1\\0\\0\\0\\1\\0")),
        (0x28, 2, "US", short(1)),
        (0x28, 4, "CS", text("MONOCHROME2")),
        (0x28, 0x10, "US", short(2)),
        (0x28, 0x11, "US", short(3)),
        (0x28, 0x30, "DS", text("0.25\\0.5")),
        (0x28, 0x100, "US", short(16)),
        (0x28, 0x101, "US", short(16)),
        (0x28, 0x102, "US", short(15)),
        (0x28, 0x103, "US", short(1)),
        (0x28, 0x1052, "DS", text("-1024")),
        (0x28, 0x1053, "DS", text("2")),
        (0x28, 0x1054, "LO", text("HU")),
        (0x7FE0, 0x10, "OW", pixels),
    ])
}

/// Files in any order are sorted by their places; Hounsfield units become attenuation over that of
/// water.
#[test]
fn a_dicom_series_is_a_volume() {
    let folder = tempfile::tempdir().unwrap();
    for (name, z, first) in [("a", 12.0, 512), ("b.dcm", 10.0, 12), ("c", 11.0, -600)] {
        fs::write(folder.path().join(name), slice(z, "9.1", first)).unwrap();
    }
    let mut reader = Reader::open(folder.path(), None).unwrap();
    assert_eq!(reader.grid().size, [3, 2, 3]);
    assert!(
        reader.grid().voxel.iter().zip([5e-4, 2.5e-4, 1e-3]).all(|(a, b)| (a - b).abs() < 1e-12)
    );
    let volume = reader.read(&Job::default()).unwrap();
    // 1 + (2 v − 1024)/1000, and nothing below air.
    let expected = [[12, 15], [-600, -597], [512, 515]]
        .map(|row| row.map(|v| (1.0 + 1e-3 * (2.0 * f64::from(v) - 1024.0)).max(0.0)));
    for (z, [first, second_row]) in expected.into_iter().enumerate() {
        let found = [volume.slice(z)[0], volume.slice(z)[3]].map(f64::from);
        assert!(
            (found[0] - first).abs() < 1e-6 && (found[1] - second_row).abs() < 1e-6,
            "{found:?}"
        );
    }
    // A single one needs no neighbour.
    let single = Reader::open(&folder.path().join("b.dcm"), None).unwrap();
    assert_eq!((single.grid().size[2], single.told_pixel()), (1, Some([5e-4, 2.5e-4])));
}

#[test]
fn dicom_that_is_no_volume_is_refused_with_the_reason() {
    let refused = |files: &[(&str, Vec<u8>)]| {
        let folder = tempfile::tempdir().unwrap();
        files.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
        let read = Reader::open(folder.path(), None).and_then(|mut r| r.read(&Job::default()));
        let line = read.unwrap_err().to_string();
        assert!(!line.contains('\n'), "{line}");
        line
    };
    let at = |z| slice(z, "9.1", 0);
    let gap = refused(&[("a", at(0.0)), ("b", at(1.0)), ("c", at(3.0))]);
    assert!(gap.contains("gap"), "{gap}");
    let twice = refused(&[("a", at(1.0)), ("b", at(1.0))]);
    assert!(twice.contains("at one place"), "{twice}");
    let other = refused(&[("a", at(1.0)), ("b", slice(2.0, "9.2", 0))]);
    assert!(other.contains("another series"), "{other}");
    let whole = at(0.0);
    for length in (132..whole.len()).step_by(7) {
        _ = refused(&[("cut", whole[..length].to_vec())]);
    }
    let mut jpeg2000 = whole.clone();
    let uid = b"1.2.840.10008.1.2.1";
    let i = jpeg2000.windows(uid.len()).position(|w| w == uid).unwrap();
    jpeg2000[i + 18] = b'9';
    let line = refused(&[("a", jpeg2000)]);
    assert!(line.contains("export it uncompressed") || line.contains("damaged"), "{line}");
}
