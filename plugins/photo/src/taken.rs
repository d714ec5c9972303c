//! What a photograph says of itself: EXIF.

use std::io::{BufRead, Seek};

use exif::{Exif, In, Reader, Tag, Value};
use serde::Serialize;

/// Diagonal of a frame of 35 mm film, 36 mm × 24 mm.
const FILM_DIAGONAL_MM: f64 = 43.266_615;
/// Standard error of a focal length from EXIF, as a share: equivalents are rounded to millimetres,
/// makers take them by the diagonal or by the width, and focusing changes them (ours).
const USUAL_ERROR: f64 = 0.03;

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
        let exif = match Reader::new().read_from_container(file) {
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
        };
        let mut notes = Vec::new();
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
    /// where nothing is said. Of a part that was cut out it is wrong.
    ///
    /// ```
    /// use intrados_photo::taken::Taken;
    /// let taken = Taken { focal_35mm: Some(43.266_615), ..Taken::default() };
    /// assert!((taken.focal([3000, 4000]).unwrap().px - 5000.0).abs() < 1e-6);
    /// ```
    #[must_use]
    pub fn focal(&self, size: [u32; 2]) -> Option<Focal> {
        let [width, height] = size.map(f64::from);
        let px = self.focal_35mm? / FILM_DIAGONAL_MM * width.hypot(height);
        Some(Focal { px, rel_error: USUAL_ERROR })
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
