//! Pictures as files: PNG for the eye, EXR for everything that is known of every pixel.
//!
//! Nothing that differs from run to run (time, threads, paths) goes into them, so that equal work
//! gives equal bytes.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image as ExrImage, Layer,
    LayerAttributes, Text, WritableImage,
};
use glam::Vec3;
use intrados_light::{Image, ORDERS, Plate, View, luminance, tone::Tone};

use crate::{args::Exposure, failure::Failure};

/// Name and value of what a file says of itself.
pub(crate) type Facts = Vec<(&'static str, String)>;

/// RMS standard error of the pixels' luminance over the picture's mean; infinite where some pixel's
/// error is unknown. The channels of a pixel are correlated: their errors are added as if fully so.
pub(crate) fn pixel_error(image: &Image) -> f64 {
    let n = image.mean.len().max(1) as f64;
    let mean = image.mean.iter().map(|&c| f64::from(luminance(c))).sum::<f64>() / n;
    let variance =
        image.variance.iter().map(|v| f64::from(luminance(v.map(f32::sqrt))).powi(2)).sum::<f64>()
            / n;
    variance.sqrt() / mean.abs()
}

/// The key of a bright picture: models mostly stand before a bright sky.
const KEY: f64 = 0.36;

/// Stops that bring the geometric mean of the picture's luminance to the key (Reinhard et al. 2002,
/// eq. 1 and 2).
fn auto_exposure(image: &Image) -> f32 {
    let logs: Vec<f64> = image
        .mean
        .iter()
        .map(|&c| f64::from(luminance(c)))
        .filter(|y| y.is_normal() && *y > 0.0)
        .map(f64::log2)
        .collect();
    if logs.is_empty() {
        0.0
    } else {
        (KEY.log2() - logs.iter().sum::<f64>() / logs.len() as f64).clamp(-30.0, 30.0) as f32
    }
}

/// The picture as PNG, with the facts as text chunks.
pub(crate) fn png(image: &Image, exposure: Exposure, facts: &Facts) -> Result<Vec<u8>, Failure> {
    let exposure = match exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => auto_exposure(image),
    };
    let tone = Tone { exposure, ..Tone::default() };
    let pixels: Vec<u8> = image.mean.iter().flat_map(|&radiance| tone.encode(radiance)).collect();
    encode_png([image.width, image.height], &pixels, facts)
}

/// Colours as PNG.
pub(crate) fn png_of_colours(
    size: [u32; 2],
    colours: &[[u8; 3]],
    facts: &Facts,
) -> Result<Vec<u8>, Failure> {
    encode_png(size, colours.as_flattened(), facts)
}

/// Colours of sixteen bits as PNG.
pub(crate) fn png_of_deep_colours(
    size: [u32; 2],
    colours: &[[u16; 3]],
    facts: &Facts,
) -> Result<Vec<u8>, Failure> {
    let bytes: Vec<u8> = colours.as_flattened().iter().flat_map(|v| v.to_be_bytes()).collect();
    encode_deep_png(size, &bytes, png::BitDepth::Sixteen, facts)
}

fn encode_png(size: [u32; 2], pixels: &[u8], facts: &Facts) -> Result<Vec<u8>, Failure> {
    encode_deep_png(size, pixels, png::BitDepth::Eight, facts)
}

fn encode_deep_png(
    size: [u32; 2],
    pixels: &[u8],
    depth: png::BitDepth,
    facts: &Facts,
) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    write_png(&mut bytes, size, pixels, depth, facts)
        .map_err(|e| Failure::Internal(format!("cannot make a PNG: {e}")))?;
    Ok(bytes)
}

fn write_png(
    bytes: &mut Vec<u8>,
    [width, height]: [u32; 2],
    pixels: &[u8],
    depth: png::BitDepth,
    facts: &Facts,
) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(depth);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.add_itxt_chunk(
        "Software".into(),
        concat!("Intrados ", env!("CARGO_PKG_VERSION")).into(),
    )?;
    for (name, value) in facts {
        encoder.add_itxt_chunk((*name).into(), value.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()
}

/// The picture with its variance, its samples and its orders of reflection as one EXR: radiance in
/// W·m⁻²·sr⁻¹, linear Rec. 709.
pub(crate) fn exr(plate: &Plate, facts: &Facts) -> Result<Vec<u8>, Failure> {
    let image = plate.image(View::Combined, None);
    let mut channels = rgb("", &image.mean);
    channels.extend(rgb("variance.", &image.variance));
    channels.push(AnyChannel::new("samples.N", FlatSamples::F32(image.samples.clone())));
    let with_orders = plate
        .exposures()
        .iter()
        .flatten()
        .filter_map(|e| e.film.as_ref())
        .all(intrados_light::Film::has_orders);
    for order in 0..if with_orders { ORDERS } else { 0 } {
        // Adding up is exact enough, and the last layer takes all that the others leave.
        channels
            .extend(rgb(&format!("order{order}."), &plate.image(View::Combined, Some(order)).mean));
    }
    let mut about =
        LayerAttributes { software_name: Some("Intrados".into()), ..LayerAttributes::default() };
    about.other =
        facts.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value)))).collect();
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let layer = Layer::new(
        (image.width as usize, image.height as usize),
        about,
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| Failure::Internal(format!("cannot make an EXR: {e}")))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes)
        .ok_or_else(|| Failure::Internal("the EXR header just written cannot be read".into()))?;
    Ok(bytes)
}

/// As UTF-8, which is how OpenEXR's own tools read text; the library's conversion is to Latin-1 and
/// panics beyond.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn rgb(layer: &str, pixels: &[Vec3]) -> Vec<AnyChannel<FlatSamples>> {
    let channel = |(c, name): (usize, &str)| {
        AnyChannel::new(
            format!("{layer}{name}").as_str(),
            FlatSamples::F32(pixels.iter().map(|p| p[c]).collect()),
        )
    };
    ["R", "G", "B"].into_iter().enumerate().map(channel).collect()
}

/// Puts the header's attributes in the order of their names: the library keeps ours in a hash map,
/// whose order changes from run to run.
///
/// A header is, after eight bytes, a row of (name, 0, type, 0, length as i32, value), and a 0 at
/// its end.
fn sort_attributes(exr: &mut [u8]) -> Option<()> {
    const BEGIN: usize = 8;
    let mut attributes = Vec::new();
    let mut at = BEGIN;
    while *exr.get(at)? != 0 {
        let begin = at;
        for _ in 0..2 {
            at += exr.get(at..)?.iter().position(|&b| b == 0)? + 1;
        }
        let length: [u8; 4] = exr.get(at..at + 4)?.try_into().ok()?;
        at += 4 + usize::try_from(i32::from_le_bytes(length)).ok()?;
        attributes.push(exr.get(begin..at)?.to_vec());
    }
    attributes.sort();
    exr.get_mut(BEGIN..at)?.copy_from_slice(&attributes.concat());
    Some(())
}
