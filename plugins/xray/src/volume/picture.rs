//! Slices in picture files: TIFF (8, 16, 32, 64 bit, integer or float) and PNG (8, 16 bit grey),
//! one grey value a pixel.

use std::{
    fs::File,
    io::{BufReader, Read, Seek},
    path::Path,
};

use intrados_stage::{
    access::{self, Denied},
    decode::guarded,
};
use tiff::{
    decoder::{Decoder, DecodingResult, Limits},
    tags::Tag,
};

use super::{MAX_SIDE, VolumeError, by, metaimage::Element};

/// A picture file holds at most this many times its own length, or its header lies: deflate and LZW
/// cannot pack denser.
const MAX_RATIO: u64 = 2000;

/// Most pixels of a page of which the file brings less than a byte for [`PACKED`] of them: what is
/// all of one grey packs a thousandfold, and must not fill the memory of whoever opens it.
const MAX_PIXELS: u64 = 8192 * 8192;
/// Pixels a byte beyond which a large page is refused; noise packs hardly at all.
const PACKED: u64 = 16;

pub(super) type Pages = Decoder<BufReader<File>>;

/// A TIFF of one or many pages, or a PNG.
pub(super) enum Picture {
    Tiff(Box<Pages>),
    Png,
}

/// Opens a plain file: not a folder, a pipe or a device, which could keep us waiting for ever.
/// Gives its length too.
pub(super) fn open_plain(path: &Path) -> Result<(File, u64), VolumeError> {
    not_empty(path, access::open(path))
}

/// What came of opening a file that must hold something.
pub(super) fn not_empty(
    path: &Path,
    opened: Result<(File, u64), Denied>,
) -> Result<(File, u64), VolumeError> {
    match opened {
        Ok((_, 0)) => Err(VolumeError::bad(path, "is empty (0 bytes); was it copied completely?")),
        Ok(opened) => Ok(opened),
        Err(Denied::System(source)) => Err(VolumeError::missing(path)(source)),
        Err(why) => Err(VolumeError::bad(path, why.to_string())),
    }
}

/// What a decoder of a file does, behind the guard of all of them.
pub(super) fn guard<T>(
    path: &Path,
    work: impl FnOnce() -> Result<T, VolumeError>,
) -> Result<T, VolumeError> {
    guarded(work, |why| VolumeError::bad(path, why.to_string()))
}

/// Which kind of picture a file is, and the size of its (first) page.
pub(super) fn open(path: &Path) -> Result<(Picture, [usize; 2]), VolumeError> {
    guard(path, || opened(path))
}

fn opened(path: &Path) -> Result<(Picture, [usize; 2]), VolumeError> {
    let (mut file, length) = open_plain(path)?;
    let mut magic = Vec::with_capacity(8);
    file.by_ref().take(8).read_to_end(&mut magic).map_err(VolumeError::missing(path))?;
    file.rewind().map_err(VolumeError::missing(path))?;
    match magic.get(..4) {
        Some(b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+") => {
            let mut pages = Decoder::new(BufReader::new(file)).map_err(tiff_error(path, 0))?;
            let size = page_size(path, &mut pages, 0, length)?;
            Ok((Picture::Tiff(Box::new(pages)), size))
        }
        Some(b"\x89PNG") => {
            let reader =
                image::ImageReader::with_format(BufReader::new(file), image::ImageFormat::Png);
            let (w, h) = reader.into_dimensions().map_err(png_error(path))?;
            // A pixel may be a bit of a byte: a mask without anything packs so densely.
            Ok((Picture::Png, checked_size(path, w, h, 8 * length, 1)?))
        }
        _ => Err(VolumeError::bad(
            path,
            "is neither TIFF nor PNG; convert it, or give its .mhd header",
        )),
    }
}

/// Checks the header of the page that `pages` stands at, sets its limits, and gives its size.
pub(super) fn page_size(
    path: &Path,
    pages: &mut Pages,
    page: usize,
    length: u64,
) -> Result<[usize; 2], VolumeError> {
    let bad = tiff_error(path, page);
    let (w, h) = pages.dimensions().map_err(&bad)?;
    let kind = pages.colortype().map_err(&bad)?;
    if kind.num_samples() != 1 || matches!(kind, tiff::ColorType::Palette(_)) {
        return Err(VolumeError::bad(
            path,
            format!("page {page} is coloured; a slice has one grey value a pixel: save it as grey"),
        ));
    }
    if ![8, 16, 32, 64].contains(&kind.bit_depth()) {
        let reason = format!(
            "page {page} has {} bits a pixel; 8, 16, 32 and 64 are read: convert it",
            kind.bit_depth()
        );
        return Err(VolumeError::bad(path, reason));
    }
    checked_size(path, w, h, length, u64::from(kind.bit_depth()) / 8)
}

fn checked_size(
    path: &Path,
    w: u32,
    h: u32,
    length: u64,
    bytes: u64,
) -> Result<[usize; 2], VolumeError> {
    let size = [w as usize, h as usize];
    if !size.iter().all(|n| (1..=MAX_SIDE).contains(n)) {
        return Err(VolumeError::bad(
            path,
            format!("is {} pixels; from 1 to {MAX_SIDE} in each direction are read", by(size)),
        ));
    }
    if u64::from(w) * u64::from(h) * bytes > length.saturating_mul(MAX_RATIO) {
        return Err(VolumeError::bad(
            path,
            format!(
                "says {} pixels and is only {length} bytes long; its header is damaged",
                by(size)
            ),
        ));
    }
    let pixels = u64::from(w) * u64::from(h);
    if pixels > MAX_PIXELS.max(PACKED.saturating_mul(length)) {
        let memory = pixels * (bytes + 4) / 1_000_000;
        let reason = format!(
            "unpacks {length} bytes to {} pixels, {memory} MB; at most 8192 × 8192 are unpacked so far: crop it, or bin its pixels",
            by(size)
        );
        return Err(VolumeError::bad(path, reason));
    }
    Ok(size)
}

/// Grey values of one page of a TIFF, which must be of `size`.
pub(super) fn read_page(
    path: &Path,
    pages: Pages,
    page: usize,
    size: [usize; 2],
    length: u64,
) -> Result<(Pages, Vec<f32>), VolumeError> {
    guard(path, || page_values(path, pages, page, size, length))
}

fn page_values(
    path: &Path,
    pages: Pages,
    page: usize,
    size: [usize; 2],
    length: u64,
) -> Result<(Pages, Vec<f32>), VolumeError> {
    let bad = tiff_error(path, page);
    let bytes = size[0] * size[1] * 8;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = bytes;
    limits.intermediate_buffer_size = bytes.max(1 << 16);
    let mut pages = pages.with_limits(limits);
    pages.seek_to_image(page).map_err(&bad)?;
    same_size(path, page, page_size(path, &mut pages, page, length)?, size)?;
    let data: Vec<f32> = match pages.read_image().map_err(&bad)? {
        DecodingResult::U8(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::U32(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::U64(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::I8(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::I16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::I32(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::I64(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::F32(v) => v,
        DecodingResult::F64(v) => v.into_iter().map(|x| x as f32).collect(),
        _ => {
            return Err(VolumeError::bad(
                path,
                format!(
                    "page {page} has a pixel format that is not read; save it as 8, 16 or 32 bit"
                ),
            ));
        }
    };
    finite(path, page, data, size).map(|data| (pages, data))
}

/// Grey values of a PNG, which must be of `size`.
pub(super) fn read_png(path: &Path, size: [usize; 2]) -> Result<Vec<f32>, VolumeError> {
    guard(path, || png_values(path, size))
}

fn png_values(path: &Path, size: [usize; 2]) -> Result<Vec<f32>, VolumeError> {
    let (file, _) = open_plain(path)?;
    let mut reader = image::ImageReader::with_format(BufReader::new(file), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(size[0] as u32);
    limits.max_image_height = Some(size[1] as u32);
    limits.max_alloc = Some((size[0] * size[1] * 8 + (1 << 20)) as u64);
    reader.limits(limits);
    let data = match reader.decode().map_err(png_error(path))? {
        image::DynamicImage::ImageLuma8(p) => p.into_raw().into_iter().map(f32::from).collect(),
        image::DynamicImage::ImageLuma16(p) => p.into_raw().into_iter().map(f32::from).collect(),
        _ => {
            return Err(VolumeError::bad(
                path,
                "is coloured; a slice has one grey value a pixel: save it as grey",
            ));
        }
    };
    finite(path, 0, data, size)
}

pub(super) fn same_size(
    path: &Path,
    page: usize,
    found: [usize; 2],
    expected: [usize; 2],
) -> Result<(), VolumeError> {
    if found == expected {
        return Ok(());
    }
    let reason = format!(
        "page {page} is {} pixels and the first slice {}; all slices of a volume have one size",
        by(found),
        by(expected)
    );
    Err(VolumeError::bad(path, reason))
}

fn finite(
    path: &Path,
    page: usize,
    data: Vec<f32>,
    size: [usize; 2],
) -> Result<Vec<f32>, VolumeError> {
    if data.len() != size[0] * size[1] {
        return Err(VolumeError::bad(
            path,
            format!("page {page} says {} pixels and holds {}", by(size), data.len()),
        ));
    }
    match data.iter().position(|v| !v.is_finite()) {
        None => Ok(data),
        Some(i) => {
            let (x, y) = (i % size[0], i / size[0]);
            Err(VolumeError::bad(
                path,
                format!(
                    "page {page}, pixel {x},{y} is not a finite number; write 0 where nothing was measured"
                ),
            ))
        }
    }
}

/// The voxel that a TIFF written by ImageJ (or by us) tells, m: pixels per unit in its resolution,
/// unit and spacing in its description.
pub(super) fn voxel(pages: &mut Pages) -> Option<[f64; 3]> {
    let description = pages.get_tag_ascii_string(Tag::ImageDescription).ok()?;
    let value = |key: &str| {
        description
            .lines()
            .find_map(|line| line.trim().strip_prefix(key)?.trim().strip_prefix('=').map(str::trim))
    };
    let unit = match value("unit")? {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        "µm" | "um" | "micron" | "microns" | "\\u00B5m" => 1e-6,
        "nm" => 1e-9,
        _ => return None,
    };
    let mut edge = |tag| match pages.get_tag(tag) {
        Ok(tiff::decoder::ifd::Value::Rational(n, d)) => Some(f64::from(d) / f64::from(n) * unit),
        _ => None,
    };
    let [x, y] = [edge(Tag::XResolution)?, edge(Tag::YResolution)?];
    let z = value("spacing").and_then(|s| s.parse::<f64>().ok()).map_or(x, |s| s * unit);
    Some([x, y, z])
}

/// What the tags of resolution say of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Resolution {
    /// Its edges, m.
    Edges([f64; 2]),
    /// Dots an inch that screens, printers and scanners have by default: no specimen's.
    Default(f64),
}

/// Dots an inch that programs and devices write of pictures that nobody measured.
const USUAL_DPI: [f64; 22] = [
    70.0, 72.0, 75.0, 90.0, 96.0, 100.0, 120.0, 144.0, 150.0, 180.0, 192.0, 200.0, 220.0, 240.0,
    250.0, 300.0, 350.0, 360.0, 400.0, 600.0, 1200.0, 2400.0,
];

/// What the tags of resolution say.
pub(super) fn resolution(pages: &mut Pages) -> Option<Resolution> {
    let unit = match pages.get_tag_u32(Tag::ResolutionUnit).ok()? {
        2 => 0.0254,
        3 => 0.01,
        _ => return None,
    };
    let mut edge = |tag| match pages.get_tag(tag) {
        Ok(tiff::decoder::ifd::Value::Rational(n, d)) => Some(unit * f64::from(d) / f64::from(n)),
        _ => None,
    };
    let edges = [edge(Tag::XResolution)?, edge(Tag::YResolution)?];
    if !edges.iter().all(|e| e.is_finite() && *e > 0.0) {
        return None;
    }
    let usual =
        |edge: f64| USUAL_DPI.into_iter().find(|dots| (edge * dots / 0.0254 - 1.0).abs() < 2e-3);
    match edges.map(usual) {
        [Some(dots), Some(_)] => Some(Resolution::Default(dots)),
        _ => Some(Resolution::Edges(edges)),
    }
}

/// Slices that a TIFF of one page says it holds, and where they lie: ImageJ and tifffile write one
/// page before all slices of a large stack, one after the other and not packed.
pub(super) struct Following {
    /// How many its description says.
    pub(super) count: usize,
    /// Where the first begins, how each value is stored, and whether its high byte comes first;
    /// `None` where the file does not hold them.
    pub(super) raw: Option<(u64, Element, bool)>,
}

/// How many slices the description of a TIFF says that it holds.
pub(super) fn described(pages: &mut Pages) -> Option<usize> {
    let description = pages.get_tag_ascii_string(Tag::ImageDescription).ok()?;
    let text = description.trim();
    if text.starts_with("ImageJ=") {
        let line = text.lines().find_map(|line| line.trim().strip_prefix("images="))?;
        return line.trim().parse().ok().filter(|n| *n > 1);
    }
    // {"shape": [20, 320, 320], "truncated": true}
    let (_, shape) = text.strip_prefix('{')?.split_once("\"shape\"")?;
    let list = shape.split_once('[')?.1.split_once(']')?.0;
    let sides: Vec<usize> =
        list.split(',').map(|n| n.trim().parse().ok()).collect::<Option<_>>()?;
    let count = sides.iter().rev().skip(2).try_fold(1_usize, |all, n| all.checked_mul(*n))?;
    (sides.len() > 2 && count > 1).then_some(count)
}

/// What lies behind the one page of a TIFF whose description says more of them.
pub(super) fn following(
    pages: &mut Pages,
    size: [usize; 2],
    length: u64,
    is_big: bool,
) -> Option<Following> {
    let count = described(pages)?;
    let mut number = |tag| pages.get_tag_u32(tag).ok();
    let signed = number(Tag::SampleFormat).unwrap_or(1);
    let element = match (number(Tag::BitsPerSample)?, signed) {
        (8, 1) => Some(Element::U8),
        (8, 2) => Some(Element::I8),
        (16, 1) => Some(Element::U16),
        (16, 2) => Some(Element::I16),
        (32, 1) => Some(Element::U32),
        (32, 2) => Some(Element::I32),
        (32, 3) => Some(Element::F32),
        (64, 3) => Some(Element::F64),
        _ => None,
    };
    let is_plain = number(Tag::Compression).unwrap_or(1) == 1;
    let offsets = pages.get_tag_u64_vec(Tag::StripOffsets).ok()?;
    let from = *offsets.first()?;
    let raw = element.filter(|element| {
        let sides = [size[0], size[1], element.bytes(), count];
        let need = sides.iter().try_fold(1_u64, |all, n| all.checked_mul(*n as u64));
        is_plain && need.and_then(|need| need.checked_add(from)).is_some_and(|end| end <= length)
    });
    Some(Following { count, raw: raw.map(|element| (from, element, is_big)) })
}

pub(super) fn tiff_error(path: &Path, page: usize) -> impl Fn(tiff::TiffError) -> VolumeError {
    move |e| {
        VolumeError::bad(
            path,
            format!("page {page} cannot be read as TIFF: {e}; was the file copied completely?"),
        )
    }
}

fn png_error(path: &Path) -> impl Fn(image::ImageError) -> VolumeError {
    move |e| {
        VolumeError::bad(
            path,
            format!("cannot be read as PNG: {e}; was the file copied completely?"),
        )
    }
}
