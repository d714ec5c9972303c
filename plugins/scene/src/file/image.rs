//! Image files to linear textures.

use std::io::Cursor;

use glam::Vec3;
use intrados_stage::decode::{self, DecodeError, DecodeLimits, PictureSize};

use crate::{Texture, Wrap};

/// Texels of all images of a scene together; a packed image of some hundred kilobytes can have
/// thousands of millions.
pub(crate) const MAX_TEXELS: usize = 48 << 20;

/// PNG and JPEG (sRGB) and EXR (linear), told apart by their first bytes, with at most `left`
/// texels.
pub(crate) fn decode(bytes: &[u8], left: usize) -> Result<Texture, String> {
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decode_exr(bytes, left)
    } else {
        decode_srgb(bytes, left)
    }
}

fn beyond(width: usize, height: usize) -> String {
    format!(
        "has {width} × {height} texels, beyond the limit of {} million for all images of a scene: make it smaller",
        MAX_TEXELS >> 20
    )
}

fn decode_srgb(bytes: &[u8], left: usize) -> Result<Texture, String> {
    let image = decode_packed(bytes, left)?.into_rgb32f();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let texels = image.pixels().map(|p| Vec3::from(p.0.map(linear))).collect();
    Ok(Texture { width, height, texels, wrap: [Wrap::Repeat; 2] })
}

/// Largest side of a texture, texels.
const MAX_SIDE: u64 = 1 << 20;

/// Decodes PNG or JPEG behind the guard of all decoders, with at most `left` texels.
fn decode_packed(bytes: &[u8], left: usize) -> Result<image::DynamicImage, String> {
    // Decoders' texts may have line breaks.
    let line =
        |e: image::ImageError| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let reader = || {
        image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())
    };
    let header = || {
        let (width, height) = reader()?
            .into_dimensions()
            .map_err(|e| format!("is no PNG, JPEG or EXR image: {}", line(e)))?;
        let (w, h) = (width as usize, height as usize);
        if w.saturating_mul(h) > left {
            return Err(beyond(w, h));
        }
        let [width, height] = [width, height].map(u64::from);
        // A texel may be a bit of a byte.
        let file_bytes = 8 * bytes.len() as u64;
        let size = PictureSize { width, height, pixel_bytes: 1, file_bytes };
        Ok((size, ()))
    };
    let pixels = |()| {
        let mut reader = reader()?;
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(512 << 20);
        reader.limits(limits);
        let image = reader.decode().map_err(|e| format!("is damaged: {}", line(e)))?;
        match decode::jpeg::markers(bytes) {
            Some(markers) if !markers.is_whole => {
                Err("is cut short: the end of the JPEG is missing; copy it again".to_owned())
            }
            _ => Ok(image),
        }
    };
    let limits = DecodeLimits { side: MAX_SIDE, pixels: MAX_TEXELS as u64 };
    decode::decode(&limits, header, pixels, said)
}

fn said(error: DecodeError) -> String {
    error.to_string()
}

/// sRGB to linear (IEC 61966-2-1).
fn linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

fn decode_exr(bytes: &[u8], left: usize) -> Result<Texture, String> {
    decode::guarded(|| exr_texture(bytes, left), said)
}

fn exr_texture(bytes: &[u8], left: usize) -> Result<Texture, String> {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2 as Size, read};
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| format!("is damaged: {e}"))?;
    for header in &meta.headers {
        let Size(width, height) = header.layer_size;
        if width.saturating_mul(height) > left {
            return Err(beyond(width, height));
        }
    }
    let decoded = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size: Size<usize>, _| (size.0, vec![Vec3::ZERO; size.area()]),
            |(width, texels): &mut (usize, Vec<Vec3>),
             at: Size<usize>,
             (r, g, b, _): (f32, f32, f32, f32)| {
                if let Some(texel) = texels.get_mut(at.1 * *width + at.0) {
                    *texel = Vec3::new(r, g, b);
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| format!("is damaged: {e}"))?;
    let size = decoded.layer_data.size;
    let (_, texels) = decoded.layer_data.channel_data.pixels;
    if !texels.iter().all(|t| t.is_finite() && t.cmpge(Vec3::ZERO).all()) {
        return Err("has negative or non-finite values: clean it first".into());
    }
    Ok(Texture { width: size.0, height: size.1, texels, wrap: [Wrap::Repeat; 2] })
}
