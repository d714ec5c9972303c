//! DICOM: CT series, a slice a file or a frame, in the order of their places.
//!
//! Values of a scanner that are Hounsfield units, H = 1000 (μ − μ_w)/(μ_w − μ_air), become
//! attenuation over that of water, 1 + H/1000, so that air is 0 as in every other file here
//! (DICOM PS3.3, C.11.1: stored value · slope + intercept, in units of the rescale type). What lies
//! outside the round field of view is padding (C.7.5.1.1.2) and counts as air.

mod layout;

use std::{
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use dicom_object::{DefaultDicomObject, InMemDicomObject, OpenFileOptions, Tag};
use dicom_pixeldata::{ConvertOptions, ModalityLutOption, PixelDecoder};
use intrados_stage::decode::{DecodeLimits, PictureSize, guarded};
use layout::PixelLayout;

use super::{
    Grid, MAX_SIDE, VolumeError, by, padding,
    picture::{open_plain, same_size},
};

/// Longest file, bytes.
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
const PLANE_POSITION: Tag = Tag(0x0020, 0x9113);
const PLANE_ORIENTATION: Tag = Tag(0x0020, 0x9116);
const SAMPLES: Tag = Tag(0x0028, 0x0002);
const FRAMES: Tag = Tag(0x0028, 0x0008);
const ROWS: Tag = Tag(0x0028, 0x0010);
const COLUMNS: Tag = Tag(0x0028, 0x0011);
const PIXEL_SPACING: Tag = Tag(0x0028, 0x0030);
const BITS_ALLOCATED: Tag = Tag(0x0028, 0x0100);
const BITS_STORED: Tag = Tag(0x0028, 0x0101);
const REPRESENTATION: Tag = Tag(0x0028, 0x0103);
const PADDING: Tag = Tag(0x0028, 0x0120);
const PADDING_LIMIT: Tag = Tag(0x0028, 0x0121);
const INTERCEPT: Tag = Tag(0x0028, 0x1052);
const SLOPE: Tag = Tag(0x0028, 0x1053);
const RESCALE_TYPE: Tag = Tag(0x0028, 0x1054);
const MEASURES: Tag = Tag(0x0028, 0x9110);
const TRANSFORMATION: Tag = Tag(0x0028, 0x9145);
const SHARED: Tag = Tag(0x5200, 0x9229);
const PER_FRAME: Tag = Tag(0x5200, 0x9230);
const PIXELS: Tag = Tag(0x7FE0, 0x0010);

/// Most pixels of a frame that is packed: a detector of 6000 by 6000.
const MOST_PACKED: u64 = 36_000_000;

/// A series whose headers have been checked.
pub(super) struct Series {
    frames: Vec<Frame>,
    hounsfield: bool,
    /// The file that was read last, where its pixels are packed.
    unpacked: Option<(PathBuf, DefaultDicomObject)>,
}

/// A slice: where it lies, and what its values mean.
#[derive(Debug, Clone)]
struct Frame {
    path: PathBuf,
    number: u32,
    /// Place along the normal of the slices, mm.
    place: Option<f64>,
    /// Slope and intercept.
    rescale: [f64; 2],
    stored: Stored,
    layout: PixelLayout,
}

/// How pixels are stored.
#[derive(Debug, Clone, Copy)]
struct Stored {
    /// Bits that a pixel takes, and of those that it uses.
    bits: [u32; 2],
    is_signed: bool,
    /// First and last stored value of what lies outside the field of view.
    padding: Option<[f64; 2]>,
}

/// What a header says.
struct Header {
    size: [usize; 2],
    /// Edges of a pixel along x and y, mm.
    pixel: Option<[f64; 2]>,
    /// From slice to slice as the file says it, mm.
    step: Option<f64>,
    /// Thickness of a slice, mm.
    thickness: Option<f64>,
    instance: Option<i64>,
    series: Option<String>,
    hounsfield: bool,
    frames: Vec<Frame>,
}

/// What is known of a series: its slices, their grid, whether its voxels are known (x and y, and z),
/// and what the user should know.
pub(super) struct Opened {
    pub(super) series: Series,
    pub(super) grid: Grid,
    pub(super) known: [bool; 2],
    pub(super) doubts: Vec<String>,
}

/// Whether a plain file begins as DICOM does: four letters after 128 bytes.
pub(super) fn is_dicom(path: &Path) -> bool {
    let mut head = [0; 132];
    open_plain(path).is_ok_and(|(mut file, _)| file.read_exact(&mut head).is_ok())
        && head.ends_with(b"DICM")
}

/// Reads the headers of a series, and sorts its slices by where they lie.
pub(super) fn open(files: &[PathBuf]) -> Result<Opened, VolumeError> {
    let mut headers = Vec::with_capacity(files.len());
    for path in files {
        headers.push((path, header(path)?));
    }
    let Some((first, head)) = headers.first() else {
        return Err(VolumeError::bad(Path::new(""), "no slices are given"));
    };
    let (first, size, pixel) = (first.to_path_buf(), head.size, head.pixel);
    let (step, thickness) = (head.step, head.thickness);
    let (hounsfield, series) = (head.hounsfield, head.series.clone());
    for (path, other) in &headers {
        same_size(path, 0, other.size, size)?;
        if other.series != series || other.hounsfield != hounsfield {
            let why = "is of another series than the other files: give one series at a time";
            return Err(VolumeError::bad(path, why));
        }
        if files.len() > 1 && other.frames.len() > 1 {
            let why = "holds several frames beside other files: give it alone";
            return Err(VolumeError::bad(path, why));
        }
        if let (Some([x, y]), Some([a, b])) = (pixel, other.pixel)
            && ((x / a - 1.0).abs() > EVEN || (y / b - 1.0).abs() > EVEN)
        {
            let why = "has pixels of another size than the first file: give one series at a time";
            return Err(VolumeError::bad(path, why));
        }
    }
    let has_order = headers.iter().all(|(_, h)| h.instance.is_some());
    headers.sort_by_key(|(_, h)| h.instance);
    let mut frames: Vec<Frame> = headers.into_iter().flat_map(|(_, h)| h.frames).collect();
    if frames.len() > MAX_SIDE {
        let why = format!("has {} slices; at most {MAX_SIDE} are read", frames.len());
        return Err(VolumeError::bad(&first, why));
    }
    let mut doubts = Vec::new();
    let step = match frames.iter().map(|f| f.place).collect::<Option<Vec<f64>>>() {
        Some(mut places) if places.len() > 1 => {
            frames.sort_by(|a, b| a.place.unwrap_or(0.0).total_cmp(&b.place.unwrap_or(0.0)));
            places.sort_by(f64::total_cmp);
            Some(even_step(&first, &places)?)
        }
        _ if frames.len() == 1 => step.or(thickness),
        _ => {
            let order = if has_order || files.len() == 1 { "number" } else { "file name" };
            let name = first.display();
            doubts.push(match (step, thickness) {
                (Some(mm), _) => format!(
                    "{name}: its series does not say where its slices lie: they are taken in the order of their {order}, {mm} mm apart as the header says"
                ),
                (None, Some(mm)) => format!(
                    "{name}: its series does not say where its slices lie: they are taken in the order of their {order}, as far apart as they are thick, {mm} mm; if they overlap or leave gaps, give voxel_mm"
                ),
                (None, None) => format!(
                    "{name}: its series does not say where its slices lie: they are taken in the order of their {order}"
                ),
            });
            step.or(thickness)
        }
    };
    let [x, y] = pixel.unwrap_or([1.0; 2]);
    let voxel = [x, y, step.unwrap_or(x)].map(|mm| 1e-3 * mm);
    let grid = Grid::centred([size[0], size[1], frames.len()], voxel);
    let known = [pixel.is_some(), step.is_some()];
    Ok(Opened { series: Series { frames, hounsfield, unpacked: None }, grid, known, doubts })
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

/// A header, or a part of it: a sequence's item.
type Part = InMemDicomObject;

fn numbers(part: &Part, tag: Tag) -> Vec<f64> {
    let values = part.element(tag).ok().and_then(|e| e.to_multi_float64().ok());
    values.filter(|v| v.iter().all(|x| x.is_finite())).unwrap_or_default()
}

fn text(part: &Part, tag: Tag) -> Option<String> {
    part.element(tag).ok().and_then(|e| e.to_str().ok().map(|s| s.trim().to_owned()))
}

fn items(part: &Part, tag: Tag) -> &[Part] {
    part.element(tag).ok().and_then(|e| e.items()).unwrap_or_default()
}

/// Numbers of the macro `within` of a frame's own groups, of those that all frames share, or of the
/// header itself (PS3.3, C.7.6.16.2).
fn of_frame([own, shared, whole]: [Option<&Part>; 3], within: Tag, tag: Tag) -> Vec<f64> {
    let groups = [own, shared].into_iter().flatten().flat_map(|part| items(part, within));
    let all = groups.chain(whole).map(|part| numbers(part, tag));
    all.into_iter().find(|values| !values.is_empty()).unwrap_or_default()
}

fn header(path: &Path) -> Result<Header, VolumeError> {
    let bad = |why: String| VolumeError::bad(path, why);
    let (layout, object) = read(path, OpenFileOptions::new().read_until(PIXELS))?;
    let layout = layout.ok_or_else(|| bad("has no pixels".into()))?;
    let whole = |tag: Tag| object.element(tag).ok().and_then(|e| e.to_int::<i64>().ok());
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
    let count = whole(FRAMES).unwrap_or(1).max(1);
    if count > MAX_SIDE as i64 {
        return Err(bad(format!("has {count} slices; at most {MAX_SIDE} are read")));
    }
    let stored = Stored::of(&object, whole(REPRESENTATION) == Some(1));
    stored.check(layout, [columns, rows, count as usize]).map_err(bad)?;
    if layout == PixelLayout::Packed {
        // Unpacked, a frame is held in numbers of eight bytes, three times over.
        let size = PictureSize {
            width: columns as u64,
            height: rows as u64,
            pixel_bytes: u64::from(stored.bits[0]).div_ceil(8),
            file_bytes: open_plain(path)?.1,
        };
        let limits = DecodeLimits { side: MAX_SIDE as u64, pixels: MOST_PACKED };
        size.check(&limits).map_err(|why| bad(why.to_string()))?;
    }
    let shared = items(&object, SHARED).first();
    let own = |frame: usize| items(&object, PER_FRAME).get(frame);
    let parts = |frame: usize| [own(frame), shared, Some(&*object)];
    // Rows lie `first` apart, columns `second`: y before x.
    let pixel = match of_frame(parts(0), MEASURES, PIXEL_SPACING)[..] {
        [y, x] if x > 0.0 && y > 0.0 => Some([x, y]),
        _ => None,
    };
    let first =
        |tag: Tag| of_frame(parts(0), MEASURES, tag).first().copied().filter(|v: &f64| *v > 0.0);
    let frames = (0..count as usize).map(|number| {
        let value = |tag: Tag| of_frame(parts(number), TRANSFORMATION, tag).first().copied();
        Frame {
            path: path.to_owned(),
            number: number as u32,
            // One place in the header is that of the first of several frames.
            place: place(parts(number)).filter(|_| count == 1 || own(number).is_some()),
            rescale: [value(SLOPE).unwrap_or(1.0), value(INTERCEPT).unwrap_or(0.0)],
            stored,
            layout,
        }
    });
    let frames: Vec<Frame> = frames.collect();
    let unit = [own(0), shared].into_iter().flatten().flat_map(|p| items(p, TRANSFORMATION));
    let unit = unit.chain([&*object]).find_map(|part| text(part, RESCALE_TYPE));
    let is_ct = text(&object, MODALITY).is_none_or(|m| m == "CT");
    let hounsfield = match unit.as_deref() {
        Some("HU") => true,
        Some("US" | "") | None => is_ct && frames.iter().all(|f| f.rescale[1] < HOUNSFIELD),
        Some(_) => false,
    };
    Ok(Header {
        size: [columns, rows],
        pixel,
        step: first(SPACING_BETWEEN),
        thickness: first(SLICE_THICKNESS),
        instance: whole(INSTANCE),
        series: text(&object, SERIES),
        hounsfield,
        frames,
    })
}

/// Place of a frame along the normal of the slices, mm.
fn place(parts: [Option<&Part>; 3]) -> Option<f64> {
    let at = of_frame(parts, PLANE_POSITION, POSITION);
    match (&at[..], &of_frame(parts, PLANE_ORIENTATION, ORIENTATION)[..]) {
        (&[x, y, z], &[a, b, c, d, e, f]) => {
            let normal = [b * f - c * e, c * d - a * f, a * e - b * d];
            Some(x * normal[0] + y * normal[1] + z * normal[2])
        }
        (&[_, _, z], _) => Some(z),
        _ => None,
    }
}

impl Stored {
    fn of(part: &Part, is_signed: bool) -> Self {
        let whole = |tag: Tag| part.element(tag).ok().and_then(|e| e.to_int::<i64>().ok());
        let bits = |tag: Tag, usual: u32| {
            whole(tag).and_then(|n| u32::try_from(n).ok()).filter(|n| *n > 0).unwrap_or(usual)
        };
        let allocated = bits(BITS_ALLOCATED, 16);
        let mut stored =
            Self { bits: [allocated, bits(BITS_STORED, allocated)], is_signed, padding: None };
        // Writers give its bits, whatever they call its type.
        let value = |tag| whole(tag).map(|v| stored.value(v as u32));
        stored.padding = value(PADDING).map(|one| {
            let other = value(PADDING_LIMIT).unwrap_or(one);
            [one.min(other), one.max(other)]
        });
        stored
    }

    /// The number that the used bits of a pixel stand for.
    fn value(&self, bits: u32) -> f64 {
        let unused = 32 - self.bits[1].clamp(1, 32);
        match self.is_signed {
            true => f64::from(((bits << unused) as i32) >> unused),
            false => f64::from((bits << unused) >> unused),
        }
    }

    /// Refuses what is not there, or not read.
    fn check(&self, layout: PixelLayout, [x, y, z]: [usize; 3]) -> Result<(), String> {
        let [allocated, stored] = self.bits;
        if ![8, 16, 32].contains(&allocated) || stored > allocated {
            return Err(format!(
                "has {stored} bits in {allocated} a pixel; 8, 16 and 32 are read: convert it"
            ));
        }
        let PixelLayout::Plain { bytes, .. } = layout else { return Ok(()) };
        let need = [x, y, z, allocated as usize / 8].iter().map(|n| *n as u64).product::<u64>();
        if let Some(frames) = bytes.checked_div(need / z.max(1) as u64).filter(|n| *n > z as u64) {
            return Err(format!(
                "holds pixels of {frames} slices, and its header says {z}: correct NumberOfFrames, or the size of a pixel"
            ));
        }
        if bytes < need {
            return Err(format!(
                "holds {bytes} bytes of pixels and needs {need} for {}: it is damaged or cut short",
                by([x, y, z])
            ));
        }
        Ok(())
    }
}

/// Reads an object whose lengths have been checked; what breaks its reader is the file's fault.
fn read(
    path: &Path,
    options: OpenFileOptions,
) -> Result<(Option<PixelLayout>, DefaultDicomObject), VolumeError> {
    let (file, length) = open_plain(path)?;
    let bad = |why: String| VolumeError::bad(path, why);
    if length > MAX_BYTES {
        let (mb, most) = (length >> 20, MAX_BYTES >> 20);
        return Err(bad(format!("is {mb} MB long; at most {most} MB are read")));
    }
    let mut file = BufReader::new(file);
    let layout = layout::check(&mut file, length).map_err(bad)?;
    file.rewind().map_err(VolumeError::missing(path))?;
    let object = guarded(
        || {
            options
                .from_reader(file)
                .map_err(|error| bad(format!("is damaged DICOM: {}", one_line(&error))))
        },
        |why| bad(why.to_string()),
    )?;
    Ok((layout, object))
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
    pub(super) fn slice(&mut self, z: usize, size: [usize; 2]) -> Result<Vec<f32>, VolumeError> {
        let frame = self
            .frames
            .get(z)
            .cloned()
            .ok_or_else(|| VolumeError::bad(Path::new(""), format!("has no slice {z}")))?;
        let stored = match frame.layout {
            PixelLayout::Plain { from, is_big, .. } => frame.plain(from, is_big, size)?,
            PixelLayout::Packed => self.unpacked(&frame, size)?,
        };
        let is_padding = |v: &f64| frame.stored.padding.is_some_and(|[a, b]| (a..=b).contains(v));
        let padded: Vec<bool> = stored.iter().map(is_padding).collect();
        let [slope, intercept] = frame.rescale;
        let mut values: Vec<f32> =
            stored.into_iter().map(|v| (slope * v + intercept) as f32).collect();
        if self.hounsfield {
            // What lies outside of the round field of view is set far below air.
            let air = values.iter_mut().zip(&padded);
            air.for_each(|(v, out)| *v = if *out { 0.0 } else { (1.0 + 1e-3 * *v).max(0.0) });
        } else {
            padding::fill(&mut values, &padded);
        }
        match values.iter().all(|v| v.is_finite()) {
            true => Ok(values),
            false => {
                Err(VolumeError::bad(&frame.path, "holds a value that is not a finite number"))
            }
        }
    }

    /// Stored values of a packed frame.
    fn unpacked(&mut self, frame: &Frame, size: [usize; 2]) -> Result<Vec<f64>, VolumeError> {
        let path = &frame.path;
        let bad = |why: String| {
            let why = format!("its pixels cannot be unpacked ({why}): export it uncompressed");
            VolumeError::bad(path, why)
        };
        if self.unpacked.as_ref().is_none_or(|(known, _)| known != path) {
            let (_, object) = read(path, OpenFileOptions::new())?;
            let fragments = object.element(PIXELS).ok().and_then(|e| e.fragments());
            for fragment in fragments.unwrap_or_default() {
                layout::check_jpeg(fragment, size).map_err(bad)?;
            }
            self.unpacked = Some((path.clone(), object));
        }
        let Some((_, object)) = &self.unpacked else { return Err(bad("no pixels".into())) };
        let options = ConvertOptions::new().with_modality_lut(ModalityLutOption::None);
        let decoded = || {
            object
                .decode_pixel_data_frame(frame.number)
                .and_then(|data| data.to_vec_frame_with_options::<f64>(0, &options))
                .map_err(|error| bad(one_line(&error)))
        };
        let values = guarded(decoded, |why| VolumeError::bad(path, why.to_string()))?;
        match values.len() == size[0] * size[1] {
            true => Ok(values),
            false => Err(bad(format!("{} of {} values", values.len(), by(size)))),
        }
    }
}

impl Frame {
    /// Stored values of a frame that is not packed.
    fn plain(&self, from: u64, is_big: bool, size: [usize; 2]) -> Result<Vec<f64>, VolumeError> {
        let step = self.stored.bits[0] as usize / 8;
        let mut bytes = vec![0; size[0] * size[1] * step];
        let at = from + u64::from(self.number) * bytes.len() as u64;
        let mut read = |mut file: File| {
            file.seek(SeekFrom::Start(at))?;
            file.read_exact(&mut bytes)
        };
        read(open_plain(&self.path)?.0).map_err(VolumeError::missing(&self.path))?;
        let number = |word: &[u8]| {
            let add = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
            let bits =
                if is_big { word.iter().fold(0, add) } else { word.iter().rev().fold(0, add) };
            self.stored.value(bits)
        };
        Ok(bytes.chunks_exact(step).map(number).collect())
    }
}
