//! A photograph as it comes from a camera: its pixels in linear light, and what it says of itself.

use std::{
    fs::File,
    io::{self, BufReader, Cursor, Read, Seek, SeekFrom},
    path::Path,
};

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, metadata::Orientation};
use intrados_stage::{
    access::{self, Denied},
    decode::{self, DecodeError, DecodeLimits, PictureSize},
};
use zune_core::{bytestream::ZCursor, options::DecoderOptions};
use zune_jpeg::JpegDecoder;

use crate::{pose::Pose, taken::Taken};

/// Most pixels of a photograph: 720 MB with sixteen bits a colour.
const MOST_PIXELS: u64 = 120_000_000;
/// Longest file, bytes.
const LONGEST: u64 = 1 << 30;
/// Fewest pixels across or down.
const FEWEST: u32 = 16;

/// A camera that is turned by more than this about its axis held the picture on its side.
const ON_ITS_SIDE_DEG: f64 = 60.0;

/// Why a photograph is not read. Each reads on from the file's name.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// It is not there, or no file.
    #[error(transparent)]
    Denied(#[from] Denied),
    /// A kind of file that is not read.
    #[error("is {0}: {1}")]
    Kind(&'static str, &'static str),
    /// Too many pixels, or hardly any.
    #[error(
        "has {0} × {1} pixels: scale it to at least {FEWEST} each way and at most 120 megapixels"
    )]
    Size(u32, u32),
    /// What its decoder says.
    #[error("cannot be read: {0}: export it again, as JPEG, PNG or TIFF")]
    Damaged(String),
    /// Its end is missing: a decoder would fill in grey what is not there.
    #[error("is cut short: the end of the JPEG is missing; copy it again")]
    CutShort,
    /// The guard of all decoders.
    #[error(transparent)]
    Guard(#[from] DecodeError),
}

impl PictureError {
    /// Whether the file is missing, not wrong.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Denied(denied) if denied.is_missing())
    }
}

impl From<io::Error> for PictureError {
    fn from(error: io::Error) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// A photograph, upright.
#[derive(Debug, Clone)]
pub struct Photograph {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// What it says of itself.
    pub taken: Taken,
    /// What a user should know: that it says nothing, or that its colours are no sRGB.
    pub notes: Vec<String>,
    /// What speaks against it: that it was cropped, or is damaged within.
    pub doubts: Vec<String>,
    /// How it was turned to stand upright, as EXIF numbers it; 1: not at all.
    pub orientation: u8,
    samples: Samples,
    /// Linear light of every value of a sample.
    linear: Vec<f32>,
}

/// Red, green and blue by rows from the top, as the file has them.
#[derive(Debug, Clone)]
enum Samples {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// Linear light of an sRGB value from 0 to 1 (IEC 61966-2-1).
#[must_use]
pub fn linear(srgb: f32) -> f32 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB byte of linear light.
#[must_use]
pub fn srgb(linear: f32) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

impl Photograph {
    /// Reads a photograph: JPEG, PNG or TIFF of 8 or 16 bits a colour, in grey or RGB, taken as
    /// sRGB. It is turned as its EXIF says.
    ///
    /// # Errors
    /// [`PictureError`]: there is none, it is of a kind that is not read, too large or damaged.
    pub fn open(path: &Path) -> Result<Self, PictureError> {
        let (file, length) = access::open(path)?;
        if length > LONGEST {
            return Err(Denied::TooLong(LONGEST).into());
        }
        let mut file = BufReader::new(file);
        recognise(&mut file, path)?;
        let read = || Ok::<_, PictureError>(Taken::read(&mut file));
        let (taken, orientation, mut notes) = decode::guarded(read, PictureError::from)?;
        file.rewind()?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let mut picture = decode(&bytes)?;
        let doubt = damage(&bytes).or_else(|| filled(&bytes, &picture));
        let mut doubts: Vec<String> = doubt.into_iter().collect();
        drop(bytes);
        if let Some(orientation) = orientation.and_then(Orientation::from_exif) {
            picture.apply_orientation(orientation);
        }
        let size = [picture.width(), picture.height()];
        doubts.extend(taken.cropped(size));
        if picture.color().has_alpha() {
            notes.push("its transparency is left out".into());
        }
        let samples = match picture {
            DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgb16(_)
            | DynamicImage::ImageRgba16(_) => Samples::Sixteen(picture.into_rgb16().into_raw()),
            DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_) => Samples::Eight(picture.into_rgb8().into_raw()),
            _ => {
                return Err(PictureError::Kind(
                    "a picture of floating-point numbers",
                    "save it with 16 bits a colour",
                ));
            }
        };
        let most = match samples {
            Samples::Eight(_) => u16::from(u8::MAX),
            Samples::Sixteen(_) => u16::MAX,
        };
        let linear = (0..=most).map(|value| linear(f32::from(value) / f32::from(most))).collect();
        let orientation = orientation.unwrap_or(1);
        Ok(Self { size, taken, notes, doubts, orientation, samples, linear })
    }

    /// What speaks against a camera that took it lying on its side: pixels that were picked before
    /// it was turned upright fit it perfectly. `None` where it was held upright.
    #[must_use]
    pub fn on_its_side(&self, pose: &Pose) -> Option<String> {
        let roll = pose.roll_deg().filter(|roll| roll.abs() > ON_ITS_SIDE_DEG)?;
        let [width, height] = self.size;
        let why = match self.orientation {
            1 => "was it turned after it was picked, or is another side of it up?".to_owned(),
            _ => format!(
                "its EXIF turns it upright; were its pixels picked before? Count them in the upright picture, {width} × {height}"
            ),
        };
        Some(format!("the picks fit a camera that lies on its side (rolled by {roll:.0}°): {why}"))
    }

    /// Steps of a value in the file from black to white.
    pub(crate) fn steps(&self) -> f64 {
        (self.linear.len() - 1) as f64
    }

    /// Linear light of the pixel in column `x` and row `y`, red, green and blue, 1 where it is
    /// burnt out. `None` outside.
    #[must_use]
    pub fn light(&self, x: u32, y: u32) -> Option<Vec3> {
        let [width, height] = self.size;
        if x >= width || y >= height {
            return None;
        }
        let first = 3 * (y as usize * width as usize + x as usize);
        let value = |k: usize| match &self.samples {
            Samples::Eight(all) => usize::from(all[first + k]),
            Samples::Sixteen(all) => usize::from(all[first + k]),
        };
        Some(Vec3::from_array([0, 1, 2].map(|k| self.linear[value(k)])))
    }

    /// Linear light at a place, pixels from the top left (the first pixel's middle is at ½, ½),
    /// between the middles of pixels in proportion. `None` outside.
    #[must_use]
    pub fn light_at(&self, [x, y]: [f64; 2]) -> Option<Vec3> {
        let [width, height] = self.size.map(f64::from);
        if !(0.0..=width).contains(&x) || !(0.0..=height).contains(&y) {
            return None;
        }
        let between = |at: f64, size: u32| {
            let at = (at - 0.5).clamp(0.0, f64::from(size - 1));
            let low = (at as u32).min(size.saturating_sub(2));
            (low, (at - f64::from(low)) as f32, (low + 1).min(size - 1))
        };
        let (left, s, right) = between(x, self.size[0]);
        let (above, t, below) = between(y, self.size[1]);
        let row = |y: u32| Some(self.light(left, y)?.lerp(self.light(right, y)?, s));
        Some(row(above)?.lerp(row(below)?, t))
    }
}

/// Decodes behind the guard of all decoders.
fn decode(bytes: &[u8]) -> Result<DynamicImage, PictureError> {
    let damaged = |error: image::ImageError| PictureError::Damaged(error.to_string());
    let header = || {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
        let known = [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::Tiff];
        if !reader.format().is_some_and(|format| known.contains(&format)) {
            return Err(PictureError::Kind("no JPEG, PNG or TIFF", "export it as one of these"));
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(8 * MOST_PIXELS + (64 << 20));
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(damaged)?;
        let (width, height) = decoder.dimensions();
        if width.min(height) < FEWEST || u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err(PictureError::Size(width, height));
        }
        let printed = [image::ExtendedColorType::Cmyk8, image::ExtendedColorType::Cmyk16];
        if printed.contains(&decoder.original_color_type()) {
            return Err(cmyk());
        }
        let [width, height] = [width, height].map(u64::from);
        // A pixel may be a bit of a byte.
        let file_bytes = 8 * bytes.len() as u64;
        Ok((PictureSize { width, height, pixel_bytes: 1, file_bytes }, decoder))
    };
    let limits = DecodeLimits { side: u64::from(u32::MAX), pixels: MOST_PIXELS };
    let pixels = |decoder| DynamicImage::from_decoder(decoder).map_err(damaged);
    let picture = decode::decode(&limits, header, pixels, PictureError::from)?;
    match decode::jpeg::markers(bytes) {
        Some(markers) if !markers.is_whole => Err(PictureError::CutShort),
        _ => Ok(picture),
    }
}

/// What a strict decoder of JPEG finds wrong in what a lenient one fills in; `None` where nothing
/// is, or it is no JPEG.
fn damage(bytes: &[u8]) -> Option<String> {
    if !decode::jpeg::markers(bytes)?.is_fine {
        return Some(
            "its JPEG data are damaged (scans of its progression are missing): it is coarser than what was taken; copy it again"
                .into(),
        );
    }
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let decode = || {
        let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
        decoder.decode().map(drop).map_err(|error| error.to_string())
    };
    let why = decode::guarded(decode, |why| why.to_string()).err()?;
    let why: String = why.split_whitespace().collect::<Vec<_>>().join(" ");
    Some(format!(
        "its JPEG data are damaged ({why}): a part of it may be filled in grey; copy it again"
    ))
}

/// Rows at the foot of a JPEG that repeat themselves, and equal bytes in a row, from which on it is
/// doubted; the longest that its blocks can be, so that rows repeat after it.
const FILLED_ROWS: usize = 32;
const EQUAL_BYTES: usize = 4096;
const BLOCK: usize = 32;

/// Whether a JPEG looks as if data were missing within it, which no decoder need notice: where they
/// end early each block is the code of nothing but zeros, the same one again and again (or the last
/// colour), and a copy that broke off may have left zeros. No two blocks of a photograph are equal.
fn filled(bytes: &[u8], picture: &DynamicImage) -> Option<String> {
    decode::jpeg::markers(bytes)?;
    let longest = bytes.chunk_by(|a, b| a == b).map(<[u8]>::len).max().unwrap_or_default();
    if longest >= EQUAL_BYTES {
        return Some(format!(
            "its JPEG data are damaged (the same byte {longest} times in a row): a part of it may not be what was seen; copy it again"
        ));
    }
    let (data, width, channels) = match picture {
        DynamicImage::ImageRgb8(p) => (p.as_raw(), p.width() as usize, 3),
        DynamicImage::ImageLuma8(p) => (p.as_raw(), p.width() as usize, 1),
        _ => return None,
    };
    // At its ends a row is smoothed otherwise.
    let inner = channels * BLOCK..channels * width.saturating_sub(BLOCK);
    let is_repeated = |row: &&[u8]| {
        let row = row.get(inner.clone()).unwrap_or_default();
        let (first, next) = (row.iter(), row.iter().skip(channels * BLOCK));
        row.len() > channels * BLOCK && first.zip(next).all(|(a, b)| a == b)
    };
    let rows = data.rchunks_exact((width * channels).max(1)).take_while(is_repeated).count();
    (rows >= FILLED_ROWS && rows < picture.height() as usize).then(|| {
        format!(
            "its JPEG data are damaged, or it has a border: its lowest {rows} rows repeat themselves; copy it again"
        )
    })
}

fn cmyk() -> PictureError {
    PictureError::Kind("in the colours of print (CMYK)", "convert it to RGB")
}

/// Endings of raw files that begin as a TIFF does.
const RAW: [&str; 12] =
    ["nef", "nrw", "arw", "sr2", "srf", "dng", "pef", "srw", "cr2", "iiq", "3fr", "erf"];

/// Refuses what is no picture that a decoder here reads, by name; else the file is at its start
/// again.
fn recognise(file: &mut BufReader<File>, path: &Path) -> Result<(), PictureError> {
    let mut head = Vec::with_capacity(32);
    file.by_ref().take(32).read_to_end(&mut head)?;
    file.rewind()?;
    let at = |from: usize, bytes: &[u8]| head.get(from..).is_some_and(|h| h.starts_with(bytes));
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let tiff = at(0, b"II") || at(0, b"MM");
    let raw = at(0, b"FUJIFILMCCD-RAW")
        || at(0, b"FOVb")
        || at(4, b"ftypcrx ")
        || at(8, b"CR")
        || [b"IIRO", b"IIRS", b"MMOR", b"IIU\0"].iter().any(|magic| at(0, *magic))
        || (tiff && ending.is_some_and(|ending| RAW.contains(&ending.as_str())));
    if raw {
        return Err(PictureError::Kind(
            "a camera's raw data",
            "develop it to TIFF or JPEG, without lens correction or with all of it",
        ));
    }
    if at(4, b"ftyp") {
        return Err(PictureError::Kind(
            "HEIC, HEIF or AVIF, or a film",
            "export it as JPEG, or set the camera to its most compatible format",
        ));
    }
    if at(0, b"\xff\xd8") && components(file)? == Some(4) {
        return Err(cmyk());
    }
    file.rewind()?;
    Ok(())
}

/// How many colours a JPEG has, by its frame header (ITU-T T.81, B.2.2); `None` where none is
/// found among its first segments.
fn components(file: &mut BufReader<File>) -> io::Result<Option<u8>> {
    file.seek(SeekFrom::Start(2))?;
    for _ in 0..4096 {
        let mut marker = [0; 4];
        if file.read_exact(&mut marker).is_err() || marker[0] != 0xff {
            return Ok(None);
        }
        let length = i64::from(u16::from_be_bytes([marker[2], marker[3]]));
        // Frames begin with FFC0 to FFCF, but for tables and restarts.
        if (0xc0..=0xcf).contains(&marker[1]) && ![0xc4, 0xc8, 0xcc].contains(&marker[1]) {
            let mut frame = [0; 6];
            return Ok(file.read_exact(&mut frame).is_ok().then_some(frame[5]));
        }
        if length < 2 {
            return Ok(None);
        }
        file.seek_relative(length - 2)?;
    }
    Ok(None)
}
