//! DICOM: CT series, a slice a file or a frame, in the order of their places.
//!
//! Values of a scanner that are Hounsfield units, H = 1000 (μ − μ_w)/(μ_w − μ_air), become
//! attenuation over that of water, 1 + H/1000, so that air is 0 as in every other file here
//! (DICOM PS3.3, C.11.1: stored value · slope + intercept, in units of the rescale type).

use std::{
    io::{BufReader, Read, Seek},
    path::{Path, PathBuf},
};

use dicom_object::{DefaultDicomObject, OpenFileOptions, Tag};
use dicom_pixeldata::PixelDecoder;
use intrados_stage::catch;

use super::{
    Grid, MAX_SIDE, VolumeError, by,
    picture::{open_plain, same_size},
};

/// Longest file, bytes: its pixels are unpacked as a whole.
const MAX_BYTES: u64 = 2 << 30;
/// Below this the intercept is that of Hounsfield units, where a file does not say the unit: stored
/// values of air are about 0.
const HOUNSFIELD: f64 = -500.0;
/// Places of slices that differ by no more than this share of their distance are even.
const EVEN: f64 = 0.02;

// Attributes by their numbers in PS3.6.
const MODALITY: Tag = Tag(0x0008, 0x0060);
const SLICE_THICKNESS: Tag = Tag(0x0018, 0x0050);
const SPACING_BETWEEN: Tag = Tag(0x0018, 0x0088);
const SERIES: Tag = Tag(0x0020, 0x000E);
const INSTANCE: Tag = Tag(0x0020, 0x0013);
const POSITION: Tag = Tag(0x0020, 0x0032);
const ORIENTATION: Tag = Tag(0x0020, 0x0037);
const SAMPLES: Tag = Tag(0x0028, 0x0002);
const FRAMES: Tag = Tag(0x0028, 0x0008);
const ROWS: Tag = Tag(0x0028, 0x0010);
const COLUMNS: Tag = Tag(0x0028, 0x0011);
const PIXEL_SPACING: Tag = Tag(0x0028, 0x0030);
const INTERCEPT: Tag = Tag(0x0028, 0x1052);
const RESCALE_TYPE: Tag = Tag(0x0028, 0x1054);
const PIXELS: Tag = Tag(0x7FE0, 0x0010);

/// A series whose headers have been checked.
#[derive(Debug)]
pub(super) struct Series {
    frames: Vec<Frame>,
    hounsfield: bool,
}

#[derive(Debug)]
struct Frame {
    path: PathBuf,
    number: u32,
}

/// What a header says.
struct Header {
    size: [usize; 2],
    frames: u32,
    /// Edges of a pixel along x and y, mm.
    pixel: Option<[f64; 2]>,
    /// From slice to slice as the file says it, mm.
    step: Option<f64>,
    /// Place along the normal of the slices, mm.
    place: Option<f64>,
    instance: Option<i64>,
    series: Option<String>,
    hounsfield: bool,
}

/// Whether a plain file begins as DICOM does: four letters after 128 bytes.
pub(super) fn is_dicom(path: &Path) -> bool {
    let mut head = [0; 132];
    open_plain(path).is_ok_and(|(mut file, _)| file.read_exact(&mut head).is_ok())
        && head.ends_with(b"DICM")
}

/// Reads the headers of a series, sorts its files by where their slices lie, and gives with it the
/// grid and whether its voxels are known: x and y, and z.
pub(super) fn open(files: &[PathBuf]) -> Result<(Series, Grid, [bool; 2]), VolumeError> {
    let mut slices = Vec::with_capacity(files.len());
    for path in files {
        slices.push((path, header(path)?));
    }
    let Some((first, head)) = slices.first() else {
        return Err(VolumeError::bad(Path::new(""), "no slices are given"));
    };
    let (first, size, pixel, said) = (first.to_path_buf(), head.size, head.pixel, head.step);
    let (hounsfield, series) = (head.hounsfield, head.series.clone());
    for (path, other) in &slices {
        same_size(path, 0, other.size, size)?;
        if other.series != series || other.hounsfield != hounsfield {
            let why = "is of another series than the other files: give one series at a time";
            return Err(VolumeError::bad(path, why));
        }
        if files.len() > 1 && other.frames > 1 {
            let why = "holds several frames beside other files: give it alone";
            return Err(VolumeError::bad(path, why));
        }
    }
    let step = match slices.iter().map(|(_, h)| h.place).collect::<Option<Vec<f64>>>() {
        Some(mut places) if places.len() > 1 => {
            slices.sort_by(|(_, a), (_, b)| {
                a.place.unwrap_or(0.0).total_cmp(&b.place.unwrap_or(0.0))
            });
            places.sort_by(f64::total_cmp);
            Some(even_step(&first, &places)?)
        }
        _ => {
            slices.sort_by_key(|(_, h)| h.instance);
            said
        }
    };
    let frames: Vec<Frame> = slices
        .iter()
        .flat_map(|(path, h)| {
            (0..h.frames).map(|number| Frame { path: path.to_path_buf(), number })
        })
        .collect();
    if frames.len() > MAX_SIDE {
        let why = format!("has {} slices; at most {MAX_SIDE} are read", frames.len());
        return Err(VolumeError::bad(&first, why));
    }
    let [x, y] = pixel.unwrap_or([1.0; 2]);
    let voxel = [x, y, step.unwrap_or(x)].map(|mm| 1e-3 * mm);
    let grid = Grid::centred([size[0], size[1], frames.len()], voxel);
    Ok((Series { frames, hounsfield }, grid, [pixel.is_some(), step.is_some()]))
}

/// The distance of slices at these rising places, mm.
fn even_step(path: &Path, places: &[f64]) -> Result<f64, VolumeError> {
    let step = (places[places.len() - 1] - places[0]) / (places.len() - 1) as f64;
    let uneven = places.windows(2).position(|w| (w[1] - w[0] - step).abs() > EVEN * step);
    match uneven {
        _ if step <= 0.0 => {
            Err(VolumeError::bad(path, "all slices of its series lie at one place"))
        }
        Some(i) => {
            let (near, far) = (places[i], places[i + 1]);
            Err(VolumeError::bad(
                path,
                format!(
                    "its series has a gap or a slice twice between {near:.2} and {far:.2} mm (others lie {step:.3} mm apart): give evenly spaced slices"
                ),
            ))
        }
        None => Ok(step),
    }
}

fn header(path: &Path) -> Result<Header, VolumeError> {
    let object = read(path, OpenFileOptions::new().read_until(PIXELS))?;
    let bad = |why: String| VolumeError::bad(path, why);
    let whole = |tag: Tag| object.element(tag).ok().and_then(|e| e.to_int::<i64>().ok());
    let numbers = |tag: Tag| {
        let values = object.element(tag).ok().and_then(|e| e.to_multi_float64().ok());
        values.filter(|v| v.iter().all(|x| x.is_finite())).unwrap_or_default()
    };
    let text = |tag: Tag| {
        object.element(tag).ok().and_then(|e| e.to_str().ok().map(|s| s.trim().to_owned()))
    };
    let side = |tag: Tag| whole(tag).and_then(|n| usize::try_from(n).ok());
    let (Some(columns), Some(rows)) = (side(COLUMNS), side(ROWS)) else {
        return Err(bad("has no picture: give the images of the series alone".into()));
    };
    if ![columns, rows].iter().all(|n| (1..=MAX_SIDE).contains(n)) {
        let size = by([columns, rows]);
        return Err(bad(format!("is {size} pixels; 1 to {MAX_SIDE} in each direction are read")));
    }
    if whole(SAMPLES).is_some_and(|n| n != 1) {
        return Err(bad("is coloured; a slice has one grey value a pixel".into()));
    }
    let frames = whole(FRAMES).unwrap_or(1).clamp(1, MAX_SIDE as i64 + 1) as u32;
    let above_0 = |v: &f64| *v > 0.0;
    // Rows lie `first` apart, columns `second`: y before x.
    let pixel = match numbers(PIXEL_SPACING)[..] {
        [y, x] if x > 0.0 && y > 0.0 => Some([x, y]),
        _ => None,
    };
    let first = |tag: Tag| numbers(tag).first().copied().filter(above_0);
    let place = match (&numbers(POSITION)[..], &numbers(ORIENTATION)[..]) {
        (&[x, y, z], &[a, b, c, d, e, f]) => {
            let normal = [b * f - c * e, c * d - a * f, a * e - b * d];
            Some(x * normal[0] + y * normal[1] + z * normal[2])
        }
        (&[_, _, z], _) => Some(z),
        _ => None,
    };
    let unit = text(RESCALE_TYPE);
    let is_ct = text(MODALITY).is_none_or(|m| m == "CT");
    let hounsfield = match unit.as_deref() {
        Some("HU") => true,
        Some("US" | "") | None => {
            is_ct && numbers(INTERCEPT).first().is_some_and(|i| *i < HOUNSFIELD)
        }
        Some(_) => false,
    };
    Ok(Header {
        size: [columns, rows],
        frames,
        pixel,
        step: first(SPACING_BETWEEN).or_else(|| first(SLICE_THICKNESS)),
        place,
        instance: whole(INSTANCE),
        series: text(SERIES),
        hounsfield,
    })
}

/// Reads an object; what breaks its reader is the file's fault.
fn read(path: &Path, options: OpenFileOptions) -> Result<DefaultDicomObject, VolumeError> {
    let (mut file, length) = open_plain(path)?;
    if length > MAX_BYTES {
        let why = format!("is {} MB long; at most {} MB are read", length >> 20, MAX_BYTES >> 20);
        return Err(VolumeError::bad(path, why));
    }
    file.rewind().map_err(VolumeError::missing(path))?;
    let damaged = |why: String| VolumeError::bad(path, format!("is damaged DICOM: {why}"));
    catch(|| options.from_reader(BufReader::new(file)))
        .map_err(|fault| damaged(fault.what))?
        .map_err(|error| damaged(one_line(&error)))
}

/// An error with what caused it, in one line.
fn one_line(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(deeper) = cause {
        text += &format!(": {deeper}");
        cause = deeper.source();
    }
    text.lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

impl Series {
    /// Values of slice `z`.
    pub(super) fn slice(&self, z: usize, size: [usize; 2]) -> Result<Vec<f32>, VolumeError> {
        let frame = self
            .frames
            .get(z)
            .ok_or_else(|| VolumeError::bad(Path::new(""), format!("has no slice {z}")))?;
        let path = &frame.path;
        let object = read(path, OpenFileOptions::new())?;
        let decoded = catch(|| {
            object
                .decode_pixel_data_frame(frame.number)
                .and_then(|data| data.to_vec_frame::<f32>(0))
        });
        let bad = |why: String| {
            VolumeError::bad(
                path,
                format!("its pixels cannot be unpacked ({why}): export it uncompressed"),
            )
        };
        let mut values =
            decoded.map_err(|fault| bad(fault.what))?.map_err(|error| bad(one_line(&error)))?;
        if values.len() != size[0] * size[1] {
            return Err(bad(format!("{} of {} values", values.len(), by(size))));
        }
        if self.hounsfield {
            // What lies outside of the round field of view is set far below air.
            values.iter_mut().for_each(|v| *v = (1.0 + 1e-3 * *v).max(0.0));
        }
        match values.iter().all(|v| v.is_finite()) {
            true => Ok(values),
            false => Err(VolumeError::bad(path, "holds a value that is not a finite number")),
        }
    }
}
