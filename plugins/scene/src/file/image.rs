//! Image files to linear textures.

use std::io::Cursor;

use glam::Vec3;

use crate::{Texture, Wrap};

/// Largest image, pixels.
const MAX_PIXELS: u64 = 1 << 28;

/// PNG and JPEG (sRGB) and EXR (linear), told apart by their first bytes.
pub(crate) fn decode(bytes: &[u8]) -> Result<Texture, String> {
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) { decode_exr(bytes) } else { decode_srgb(bytes) }
}

fn decode_srgb(bytes: &[u8]) -> Result<Texture, String> {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let (width, height) = reader.into_dimensions().map_err(|e| format!("is no PNG, JPEG or EXR image: {e}"))?;
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("has {width} × {height} pixels: make it smaller"));
    }
    let image = image::load_from_memory(bytes).map_err(|e| format!("is damaged: {e}"))?.into_rgb32f();
    let texels = image.pixels().map(|p| Vec3::from(p.0.map(linear))).collect();
    Ok(Texture { width: width as usize, height: height as usize, texels, wrap: [Wrap::Repeat; 2] })
}

/// sRGB to linear (IEC 61966-2-1).
fn linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

fn decode_exr(bytes: &[u8]) -> Result<Texture, String> {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2 as Size, read};
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| format!("is damaged: {e}"))?;
    for header in &meta.headers {
        if header.layer_size.area() as u64 > MAX_PIXELS {
            return Err(format!("has {} × {} pixels: make it smaller", header.layer_size.0, header.layer_size.1));
        }
    }
    let decoded = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size: Size<usize>, _| (size.0, vec![Vec3::ZERO; size.area()]),
            |(width, texels): &mut (usize, Vec<Vec3>), at: Size<usize>, (r, g, b, _): (f32, f32, f32, f32)| {
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
