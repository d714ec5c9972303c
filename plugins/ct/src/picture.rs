//! Slices as pictures for people.

use std::{
    io::{BufReader, Cursor},
    path::Path,
};

use base64::{Engine, engine::general_purpose::STANDARD};

use image::ImageDecoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use intrados_stage::{
    access,
    decode::{DecodeLimits, PictureSize, decode},
};
use serde::{Deserialize, Serialize};

use crate::{crack::Crack, detect::Detection};
use intrados_raster::grid::{Grid, Mask};

/// An RGB picture with a line under it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Picture {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Three bytes a pixel (sRGB), row-major from the top left.
    #[serde(with = "as_base64")]
    pub rgb: Vec<u8>,
    /// What it shows.
    pub caption: String,
}

/// Bytes in a text: as a list of numbers they would take four times as much.
mod as_base64 {
    use base64::{Engine, engine::general_purpose::STANDARD};
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(bytes: &[u8], to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&STANDARD.encode(bytes))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
        STANDARD.decode(String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Outline of pores: blue.
pub const PORE: [u8; 3] = [0, 114, 189];
/// Outline of cracks: vermilion.
pub const CRACK: [u8; 3] = [213, 62, 0];
/// Outline of what the truth has and detection has not: violet.
pub const MISSED: [u8; 3] = [170, 40, 190];

/// Longer side of the pictures that are made here, pixels.
const SIDE: usize = 520;
/// Longest side of a photograph that is unpacked, pixels.
const MOST_SIDE: u32 = 20_000;
/// Most pixels of one.
const MOST_PIXELS: u64 = 120_000_000;
/// That of the pictures of single cracks.
const SMALL: usize = 150;

impl Picture {
    /// Reads a photograph (JPEG, PNG), its longer side at most `side` pixels. `None` where it is
    /// missing, damaged, or too large to be unpacked.
    #[must_use]
    pub fn read(path: &Path, side: u32) -> Option<Self> {
        let (file, length) = access::open(path).ok()?;
        let header = || {
            let mut reader =
                image::ImageReader::new(BufReader::new(file)).with_guessed_format().ok()?;
            let mut limits = image::Limits::default();
            limits.max_image_width = Some(MOST_SIDE);
            limits.max_image_height = Some(MOST_SIDE);
            reader.limits(limits);
            let decoder = reader.into_decoder().ok()?;
            let (width, height) = decoder.dimensions();
            let [width, height] = [width, height].map(u64::from);
            // A pixel may be a bit of a byte.
            let file_bytes = 8 * length;
            Some((PictureSize { width, height, pixel_bytes: 1, file_bytes }, decoder))
        };
        let pixels = |mut decoder: Box<dyn ImageDecoder>| {
            let turned = decoder.orientation().ok();
            let mut whole = image::DynamicImage::from_decoder(decoder).ok()?;
            turned.into_iter().for_each(|turn| whole.apply_orientation(turn));
            Some(whole.thumbnail(side, side).to_rgb8())
        };
        let limits = DecodeLimits { side: u64::from(MOST_SIDE), pixels: MOST_PIXELS };
        let header = || header().map(|(size, decoder)| (size, Box::new(decoder) as Box<_>));
        let read = decode(&limits, || header().ok_or(()), |d| pixels(d).ok_or(()), |_| ());
        let small = read.ok()?;
        let [width, height] = [small.width(), small.height()].map(|n| n as usize);
        Some(Self { width, height, rgb: small.into_raw(), caption: String::new() })
    }

    /// As a PNG, grey if all of it is; `None` if the bytes do not fit the size.
    pub fn png(&self) -> Option<Vec<u8>> {
        let is_grey = self.rgb.chunks_exact(3).all(|p| p[0] == p[1] && p[1] == p[2]);
        let (w, h) = (u32::try_from(self.width).ok()?, u32::try_from(self.height).ok()?);
        let picture = image::RgbImage::from_raw(w, h, self.rgb.clone())?;
        let mut png = Cursor::new(Vec::new());
        let encoder =
            PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive);
        let picture = image::DynamicImage::ImageRgb8(picture);
        let written = if is_grey {
            picture.to_luma8().write_with_encoder(encoder)
        } else {
            picture.write_with_encoder(encoder)
        };
        written.ok()?;
        Some(png.into_inner())
    }

    /// The PNG in a `data:` address.
    pub fn data_url(&self) -> Option<String> {
        Some(format!("data:image/png;base64,{}", STANDARD.encode(self.png()?)))
    }
}

/// The slice as it is, and the same with the outlines of what was found (and of what was missed,
/// where the truth is known), both cut to the body.
pub fn slice_pictures(found: &Detection, truth: Option<&Mask>) -> [Picture; 2] {
    let view = View::of(&found.body);
    drawn(found, truth, &view)
}

/// One crack with its outline and what is about it.
#[must_use]
pub fn crack_picture(found: &Detection, crack: &Crack) -> Picture {
    let pixel = f64::from(found.pixel_mm);
    let [at, size] = [crack.at_mm, crack.box_mm].map(|mm| mm.map(|v| v / pixel));
    // Its box need not lie about its middle pixel: twice its longer side shows all of it.
    let half = size[0].max(size[1]).max(20.0);
    let all = [found.grey.width, found.grey.height];
    let from = [0, 1].map(|k| (at[k] - half).clamp(0.0, all[k] as f64 - 1.0) as usize);
    let to = [0, 1].map(|k| ((at[k] + half) as usize).clamp(from[k] + 1, all[k]));
    let size = [to[0] - from[0], to[1] - from[1]];
    let scale = SMALL as f64 / size[0].max(size[1]) as f64;
    let [_, overlay] = drawn(found, None, &View { from, size, scale, width: all[0] });
    overlay
}

/// A window of a slice as it is, and with outlines.
fn drawn(found: &Detection, truth: Option<&Mask>, view: &View) -> [Picture; 2] {
    let level = |v: f32| (v * 190.0).clamp(0.0, 255.0) as u8;
    let grey = |i: usize| if found.body.data[i] { level(found.grey.data[i]) } else { 255 };
    let kind = |i: usize| match found.labels.data[i] {
        _ if found.crack_mask.data[i] => 2,
        0 if truth.is_some_and(|t| t.data[i]) => 3,
        0 => 0,
        _ => 1_u8,
    };
    let kinds = Grid {
        data: (0..found.labels.data.len()).map(kind).collect::<Vec<u8>>(),
        width: found.labels.width,
        height: found.labels.height,
    };
    let plain = view.picture(|x, y| [grey(view.source(x, y)); 3]);
    let overlay = view.picture(|x, y| {
        let here = kinds.data[view.source(x, y)];
        let edge = [(1, 0), (0, 1), (1, 1)].iter().any(|(dx, dy)| {
            kinds.data[view.source(x.saturating_sub(*dx), y.saturating_sub(*dy))] != here
        }) || [(1, 0), (0, 1)]
            .iter()
            .any(|(dx, dy)| kinds.data[view.source(x + dx, y + dy)] != here);
        match (edge, here) {
            (true, 1) => PORE,
            (true, 2) => CRACK,
            (true, 3) => MISSED,
            _ => [grey(view.source(x, y)); 3],
        }
    });
    [plain, overlay]
}

/// A window of a slice, enlarged or reduced.
struct View {
    from: [usize; 2],
    size: [usize; 2],
    scale: f64,
    width: usize,
}

impl View {
    /// The body's bounding box with a small margin.
    fn of(body: &Mask) -> Self {
        let (mut from, mut to) = ([body.width, body.height], [0, 0]);
        for i in (0..body.data.len()).filter(|&i| body.data[i]) {
            let (x, y) = body.place(i);
            from = [from[0].min(x), from[1].min(y)];
            to = [to[0].max(x + 1), to[1].max(y + 1)];
        }
        let margin = 4;
        let from = from.map(|v| v.saturating_sub(margin));
        let size = [
            (to[0] + margin).min(body.width) - from[0].min(body.width),
            (to[1] + margin).min(body.height) - from[1].min(body.height),
        ];
        let size = size.map(|v| v.max(1));
        Self { from, size, scale: SIDE as f64 / size[0].max(size[1]) as f64, width: body.width }
    }

    fn source(&self, x: usize, y: usize) -> usize {
        let at = |v: usize, k: usize| {
            self.from[k] + (((v as f64 + 0.5) / self.scale) as usize).min(self.size[k] - 1)
        };
        at(y, 1) * self.width + at(x, 0)
    }

    fn picture(&self, pixel: impl Fn(usize, usize) -> [u8; 3]) -> Picture {
        let [width, height] = self.size.map(|v| ((v as f64 * self.scale).round() as usize).max(1));
        let rgb = (0..width * height).flat_map(|i| pixel(i % width, i / width)).collect();
        Picture { width, height, rgb, caption: String::new() }
    }
}
