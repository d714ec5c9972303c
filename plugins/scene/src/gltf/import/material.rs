//! Materials and their textures.

use std::{collections::HashMap, io::Cursor};

use glam::{Affine2, Vec2, Vec3};
use intrados_stage::{
    Cancelled, Job,
    decode::{self, DecodeLimits, PictureSize},
};
use serde_json::Value;

use super::Notes;
use crate::{
    Material, Surface, Texture, TextureRef, Wrap,
    gltf::{
        LUMENS_PER_WATT, MAX_TEXELS,
        document::{Document, Uri},
        json::Json,
    },
};

/// Reads materials; a damaged texture costs only itself.
pub(super) struct Reader<'a> {
    pub document: &'a Document,
    pub notes: &'a mut Notes,
    pub textures: Vec<Texture>,
    /// By glTF texture and whether it holds colours.
    known: HashMap<(usize, bool), Option<usize>>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document, notes: &'a mut Notes) -> Self {
        Self { document, notes, textures: Vec::new(), known: HashMap::new() }
    }

    pub(super) fn material(&mut self, index: usize, json: &Value) -> Material {
        let pbr = json.field("pbrMetallicRoughness");
        let mut base_colour = colour(pbr.field("baseColorFactor"), 1.0);
        let ours = json.field("extras").field("intrados");
        let mut base_texture = self.texture(pbr.field("baseColorTexture"), true);
        if let Some(old) = json
            .extension("KHR_materials_pbrSpecularGlossiness")
            .filter(|_| json.get("pbrMetallicRoughness").is_none())
        {
            base_colour = colour(old.field("diffuseFactor"), 1.0);
            base_texture = self.texture(old.field("diffuseTexture"), true);
            self.notes.once("KHR_materials_pbrSpecularGlossiness: only the diffuse colour is used");
        }
        if json.extension("KHR_materials_unlit").is_some() {
            self.notes.once("KHR_materials_unlit: unlit materials are lit here, as matt surfaces of their colour");
        }
        if json.text("alphaMode").is_some_and(|mode| mode != "OPAQUE") {
            self.notes.once("transparency by alpha is ignored: those surfaces are opaque here");
        }
        let strength = json
            .extension("KHR_materials_emissive_strength")
            .and_then(|e| e.number("emissiveStrength"))
            .unwrap_or(1.0)
            .max(0.0);
        Material {
            name: json.text("name").map_or_else(|| format!("material {index}"), str::to_owned),
            assumed: ours.field("assumed").as_bool().unwrap_or(false),
            surface: self.surface(json),
            base_colour,
            base_texture,
            emission: (colour(json.field("emissiveFactor"), 0.0) * strength as f32
                / LUMENS_PER_WATT)
                .clamp(Vec3::ZERO, Vec3::splat(f32::MAX)),
            emission_texture: self.texture(json.field("emissiveTexture"), true),
            normal_texture: self.texture(json.field("normalTexture"), false).map(|t| {
                let scale = json.field("normalTexture").number("scale").unwrap_or(1.0);
                (t, scale as f32)
            }),
            finish: None,
        }
    }

    fn surface(&mut self, json: &Value) -> Surface {
        let pbr = json.field("pbrMetallicRoughness");
        let factor = |key: &str| pbr.number(key).unwrap_or(1.0).clamp(0.0, 1.0) as f32;
        let (metallic, roughness) = (factor("metallicFactor"), factor("roughnessFactor"));
        let transmission = json
            .extension("KHR_materials_transmission")
            .and_then(|e| e.number("transmissionFactor"))
            .unwrap_or(0.0);
        let matt = json.extension("KHR_materials_unlit").is_some()
            || (json.get("pbrMetallicRoughness").is_none()
                && json.extension("KHR_materials_pbrSpecularGlossiness").is_some());
        match json.field("extras").field("intrados").text("surface") {
            Some("lambert") => Surface::Lambert,
            Some("black") => Surface::Black,
            _ if transmission > 0.5 => {
                let ior = json
                    .extension("KHR_materials_ior")
                    .and_then(|e| e.number("ior"))
                    .filter(|&n| n >= 1.0)
                    .unwrap_or(1.5);
                Surface::Dielectric { ior: ior.min(10.0) as f32, roughness }
            }
            _ if matt => Surface::Lambert,
            _ => Surface::Metallic {
                metallic,
                roughness,
                texture: self.texture(pbr.field("metallicRoughnessTexture"), false),
            },
        }
    }

    /// A texture reference, `None` (and a note) where the texture is damaged or not ours to read.
    fn texture(&mut self, info: &Value, colours: bool) -> Option<TextureRef> {
        let index = info.index("index")?;
        let moved = info.extension("KHR_texture_transform");
        let set =
            moved.and_then(|t| t.index("texCoord")).or_else(|| info.index("texCoord")).unwrap_or(0);
        if set > 1 {
            self.notes.once("textures with a coordinate set above 1 are left out");
            return None;
        }
        let texture = match self.known.get(&(index, colours)) {
            Some(known) => *known,
            None => {
                let loaded = self
                    .load(index, colours)
                    .map_err(|what| self.notes.push(format!("/textures/{index}: {what}; left out")))
                    .ok();
                let loaded = loaded.map(|texture| {
                    self.textures.push(texture);
                    self.textures.len() - 1
                });
                self.known.insert((index, colours), loaded);
                loaded
            }
        }?;
        Some(TextureRef { texture, set, transform: moved.map_or(Affine2::IDENTITY, transform) })
    }

    fn load(&mut self, index: usize, colours: bool) -> Result<Texture, String> {
        let root = &self.document.root;
        let json = root.list("textures").get(index).ok_or("there is no such texture")?;
        let source = json.index("source").ok_or("it has no PNG or JPEG image")?;
        let image =
            root.list("images").get(source).ok_or_else(|| format!("there is no image {source}"))?;
        let pixels = decode(self.document, &image_bytes(self.document, image)?)?.to_rgb8();
        let (width, height) = (pixels.width() as usize, pixels.height() as usize);
        let linear: Vec<f32> =
            (0..=255_u8)
                .map(|byte| {
                    if colours { linear(f32::from(byte) / 255.0) } else { f32::from(byte) / 255.0 }
                })
                .collect();
        let value = |byte: u8| linear.get(usize::from(byte)).copied().unwrap_or_default();
        let texels = pixels.pixels().map(|p| Vec3::from_array(p.0.map(value))).collect();
        let sampler = json.index("sampler").and_then(|s| root.list("samplers").get(s));
        let wrap = |key| match sampler.and_then(|s| s.index(key)) {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        Ok(Texture { width, height, texels, wrap: [wrap("wrapS"), wrap("wrapT")] })
    }
}

/// The encoded bytes of an image.
pub(in crate::gltf) fn image_bytes(document: &Document, image: &Value) -> Result<Vec<u8>, String> {
    if let Some(view) = image.index("bufferView") {
        return document
            .view(view)
            .map(<[u8]>::to_vec)
            .ok_or_else(|| "its buffer view has no data".into());
    }
    match Uri::parse(image.text("uri").ok_or("it has no data")?).map_err(|p| p.message)? {
        Uri::Data { bytes, .. } => Ok(bytes),
        Uri::File(name) => document.beside(&name, MAX_IMAGE_BYTES, u64::MAX).map_err(|p| p.message),
        Uri::Remote => Err("images are not fetched from a network".into()),
    }
}

/// How a message says that an image is whole, only too large.
pub(in crate::gltf) const BEYOND: &str = "beyond the limit";

/// Bytes of one encoded image.
const MAX_IMAGE_BYTES: u64 = 128 << 20;

/// Decodes PNG or JPEG, as long as all images together stay within the limit; an image that fails
/// counts too, for it takes as long.
pub(in crate::gltf) fn decode(
    document: &Document,
    bytes: &[u8],
) -> Result<image::DynamicImage, String> {
    // Decoders' texts may have line breaks.
    let line =
        |e: image::ImageError| e.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    let reader = || {
        image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())
    };
    let header = || {
        let (width, height) = reader()?.into_dimensions().map_err(line)?;
        let all = (width as usize).saturating_mul(height as usize);
        let beyond = || {
            format!(
                "{width} x {height} texels are {BEYOND} of {} million for all textures; make it smaller",
                MAX_TEXELS >> 20
            )
        };
        document.texels.set(document.texels.get().checked_sub(all).ok_or_else(beyond)?);
        let [width, height] = [width, height].map(u64::from);
        // A texel may be a bit of a byte.
        let file_bytes = 8 * bytes.len() as u64;
        Ok((PictureSize { width, height, pixel_bytes: 1, file_bytes }, ()))
    };
    let pixels = |()| {
        let mut reader = reader()?;
        let mut limits = image::Limits::default();
        limits.max_alloc = Some(512 << 20);
        reader.limits(limits);
        let image = reader.decode().map_err(line)?;
        match decode::jpeg::markers(bytes) {
            Some(markers) if !markers.is_whole => {
                Err("is cut short: the end of the JPEG is missing".to_owned())
            }
            _ => Ok(image),
        }
    };
    let limits = DecodeLimits { side: u64::from(u32::MAX), pixels: MAX_TEXELS as u64 };
    decode::decode(&limits, header, pixels, |why| why.to_string())
}

/// sRGB to linear (IEC 61966-2-1).
fn linear(s: f32) -> f32 {
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// The first three numbers, each at least 0; `default` where absent.
pub(super) fn colour(json: &Value, default: f32) -> Vec3 {
    let channel = |i: usize| {
        json.get(i).and_then(Value::as_f64).map_or(default, |x| (x as f32).clamp(0.0, 1.0))
    };
    Vec3::new(channel(0), channel(1), channel(2))
}

/// `KHR_texture_transform`: scale, then rotate, then move. The rotation is anticlockwise as seen,
/// with v pointing down: a negative angle.
fn transform(json: &Value) -> Affine2 {
    let pair = |key, default: f64| json.numbers::<2>(key).unwrap_or([default; 2]).map(|x| x as f32);
    let angle = json.number("rotation").unwrap_or(0.0) as f32;
    Affine2::from_scale_angle_translation(
        Vec2::from_array(pair("scale", 1.0)),
        -angle,
        Vec2::from_array(pair("offset", 0.0)),
    )
}

/// All materials of a file and their textures.
pub(super) fn materials(
    document: &Document,
    notes: &mut Notes,
    job: &Job,
) -> Result<(Vec<Material>, Vec<Texture>), Cancelled> {
    let mut reader = Reader::new(document, notes);
    let list = document.root.list("materials");
    let mut materials = Vec::new();
    for (i, json) in list.iter().enumerate() {
        job.step(7, 10)?;
        materials.push(reader.material(i, json));
    }
    Ok((materials, reader.textures))
}
