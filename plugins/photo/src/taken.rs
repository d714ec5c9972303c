//! What a photograph says of itself: EXIF.

use std::io::{BufRead, Seek};

use exif::{Exif, In, Reader, Tag, Value};
use serde::Serialize;

/// Diagonal of a frame of 35 mm film, 36 mm × 24 mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615;
/// Standard error of a focal length from EXIF, as a share: equivalents are rounded to millimetres,
/// makers take them by the diagonal or by the width, and focusing changes them (ours).
const USUAL_ERROR: f64 = 0.03;
/// That of a picture that was cropped: its optical axis no longer falls on its middle (ours).
const CROPPED_ERROR: f64 = 0.1;
/// Proportions that differ by no more than this share are the same, rounded.
const SAME: f64 = 0.02;

/// What a photograph says of itself; each as far as it says so.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Taken {
    /// Maker and model of the camera.
    pub camera: Option<String>,
    /// When, as the camera's clock had it: `2026-05-03 14:05:00`.
    pub date: Option<String>,
    /// Focal length, mm.
    pub focal_mm: Option<f64>,
    /// Focal length of film of 35 mm with the same view, mm.
    pub focal_35mm: Option<f64>,
    /// Exposure time, s.
    pub exposure_s: Option<f64>,
    /// Focal length over aperture.
    pub f_number: Option<f64>,
    /// Sensitivity, ISO.
    pub iso: Option<f64>,
    /// Pixels of the picture that the camera took, the longer side first.
    pub camera_px: Option<[f64; 2]>,
}

/// A focal length in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Focal {
    /// Pixels.
    pub px: f64,
    /// Standard error, as a share of it; 0: known.
    pub rel_error: f64,
}

impl Taken {
    /// Reads EXIF, and the orientation that it says; and what a user should know of it. A picture
    /// without any, or with a damaged one, is fine.
    pub(crate) fn read(file: &mut (impl BufRead + Seek)) -> (Self, Option<u8>, Vec<String>) {
        let mut notes = Vec::new();
        // Some writers leave out the end of a list; what stands before it is sound.
        let read = Reader::new().continue_on_error(true).read_from_container(file);
        let read = read.or_else(|error| {
            error.distill_partial_result(|faults| {
                if let Some(fault) = faults.first() {
                    notes.push(format!("a part of its EXIF cannot be read: {fault}"));
                }
            })
        });
        let exif = match read {
            Ok(exif) => exif,
            Err(exif::Error::NotFound(_)) => {
                let said = "it has no EXIF: its focal length is found from the picks";
                return (Self::default(), None, vec![said.into()]);
            }
            Err(error) => {
                let said = format!("its EXIF cannot be read and is left out: {error}");
                return (Self::default(), None, vec![said]);
            }
        };
        let positive = |tag: Tag| number(&exif, tag).filter(|x| *x > 0.0 && *x < 1e6);
        let taken = Self {
            camera: camera(&exif),
            date: text(&exif, Tag::DateTimeOriginal)
                .or_else(|| text(&exif, Tag::DateTime))
                .map(|date| date.replacen(':', "-", 2)),
            focal_mm: positive(Tag::FocalLength),
            focal_35mm: positive(Tag::FocalLengthIn35mmFilm),
            exposure_s: positive(Tag::ExposureTime),
            f_number: positive(Tag::FNumber),
            iso: positive(Tag::PhotographicSensitivity),
            camera_px: positive(Tag::PixelXDimension)
                .zip(positive(Tag::PixelYDimension))
                .map(|(x, y)| [x.max(y), x.min(y)]),
        };
        if taken.focal_35mm.is_none() {
            notes.push("its EXIF has no focal length as of 35 mm film: the picks find it".into());
        }
        if number(&exif, Tag::ColorSpace).is_some_and(|space| space > 1.0) {
            notes.push("its EXIF says that its colours are no sRGB: they are taken as sRGB".into());
        }
        let orientation = number(&exif, Tag::Orientation).filter(|k| (1.0..=8.0).contains(k));
        (taken, orientation.map(|k| k as u8), notes)
    }

    /// The focal length for a whole picture of this size, by the diagonal (CIPA DCG-001); `None`
    /// where nothing is said. Of a part that was cut out it is that of the whole, where EXIF says how
    /// large that was, with a larger error.
    ///
    /// ```
    /// use intrados_photo::taken::Taken;
    /// let taken = Taken { focal_35mm: Some(43.266_615), ..Taken::default() };
    /// assert!((taken.focal([3000, 4000]).unwrap().px - 5000.0).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn focal(&self, size: [u32; 2]) -> Option<Focal> {
        let [width, height] = size.map(f64::from);
        let whole = self.camera_px.filter(|_| self.is_cropped(size));
        let diagonal = match whole {
            // Cut out and scaled, too, or turned by a few degrees: it says nothing.
            Some([long, short]) if width.max(height) > long || width.min(height) > short => {
                return None;
            }
            Some([long, short]) => long.hypot(short),
            None => width.hypot(height),
        };
        let px = self.focal_35mm? / FILM_DIAGONAL_MM * diagonal;
        let rel_error = if whole.is_some() { CROPPED_ERROR } else { USUAL_ERROR };
        Some(Focal { px, rel_error })
    }

    /// Whether a picture of this size has other proportions than the one that the camera took.
    fn is_cropped(&self, size: [u32; 2]) -> bool {
        let [width, height] = size.map(f64::from);
        let ours = width.max(height) / width.min(height);
        self.camera_px.is_some_and(|[long, short]| (long / short / ours - 1.0).abs() > SAME)
    }

    /// What a user should know of a picture of this size that was cropped.
    pub(crate) fn cropped(&self, size: [u32; 2]) -> Option<String> {
        let [long, short] = self.camera_px.filter(|_| self.is_cropped(size))?;
        let [width, height] = size;
        Some(format!(
            "its EXIF says that the camera took {long} × {short} pixels and it has {width} × {height}: it was cropped, so that its optical axis may not fall on its middle; place it by the whole picture"
        ))
    }
}

/// A number; of several the first.
fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    let value = &exif.get_field(tag, In::PRIMARY)?.value;
    let number = match value {
        Value::Rational(all) => all.first()?.to_f64(),
        Value::Double(all) => *all.first()?,
        Value::Float(all) => f64::from(*all.first()?),
        _ => f64::from(value.get_uint(0)?),
    };
    number.is_finite().then_some(number)
}

/// A text on one line, of at most 80 characters.
fn text(exif: &Exif, tag: Tag) -> Option<String> {
    let Value::Ascii(parts) = &exif.get_field(tag, In::PRIMARY)?.value else { return None };
    let text = String::from_utf8_lossy(parts.first()?);
    let clean: String = text.chars().filter(|c| !c.is_control()).take(80).collect();
    Some(clean.trim().to_owned()).filter(|text| !text.is_empty())
}

/// Maker and model, the maker not said twice.
fn camera(exif: &Exif) -> Option<String> {
    match (text(exif, Tag::Make), text(exif, Tag::Model)) {
        (Some(make), Some(model)) if !model.starts_with(&make) => Some(format!("{make} {model}")),
        (make, model) => model.or(make),
    }
}
