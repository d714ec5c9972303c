//! Writing a model as GLB 2.0.

use std::{
    collections::{BTreeMap, HashMap},
    io::{self, Cursor, Write},
    path::Path,
};

use glam::{Affine3A, Mat3, Mat4, Quat, Vec3};
use gltf_json::{
    Accessor, Buffer, Image, Index, Node, Root, Scene,
    accessor::{ComponentType, GenericComponentType, Type},
    buffer::{Target, View},
    camera::Perspective,
    extensions::{
        self,
        material::{
            EmissiveStrength, EmissiveStrengthFactor, IndexOfRefraction, Ior, Transmission,
            TransmissionFactor,
        },
        scene::khr_lights_punctual as light,
    },
    image::MimeType,
    material::NormalTexture,
    mesh::{Mode, Primitive, Semantic},
    scene::UnitQuaternion,
    texture::{self, Sampler, WrappingMode},
    validation::Checked::Valid,
};
use image::{ImageFormat, RgbImage};
use intrados_stage::file::Unfinished;
use serde_json::{
    Map, Value, json,
    value::{RawValue, to_raw_value},
};

use super::{
    LUMENS_PER_WATT, Model,
    import::member::{kind_name, part_name},
    steel::{said, said_frame},
};
use crate::{
    Camera, Frame, Lamp, LampKind, Material, Member, Mesh, Object, SteelLine, Surface, Texture,
    TextureRef, Wrap,
};

/// Writes a model as one GLB file: a node for each object, lamp and camera; meshes shared; members
/// in `extras.intrados` (see the module's page), so that [`import`](super::import) gives the same
/// model back. The file appears whole or not at all.
///
/// glTF has no place for an environment lamp, nor for a member's slices and planted truth: those
/// are left to the scene file. Textures become 8-bit PNG.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] where the model is no model (an index out of range, a coordinate
/// that is not finite, more than 4 GiB); otherwise what the system says.
pub fn write_glb(path: &Path, model: &Model) -> io::Result<()> {
    write_glb_with(path, model, &|_| Map::new())
}

/// The same, with more to say of each member (by its index) in `extras.intrados` of its first node.
///
/// # Errors
/// As [`write_glb`].
pub fn write_glb_with(
    path: &Path,
    model: &Model,
    more: &dyn Fn(usize) -> Map<String, Value>,
) -> io::Result<()> {
    check(model)?;
    let (root, mut binary) =
        Writer { model, more, binary: Vec::new(), root: Root::default() }.root()?;
    let mut json = root.to_vec()?;
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let chunk = |size: usize| if size == 0 { 0 } else { 8 + size };
    let total = 12 + chunk(json.len()) + chunk(binary.len());
    let word = |size: usize| u32::try_from(size).map_err(|_| invalid("a GLB holds at most 4 GiB"));
    let mut out = Unfinished::begin(path)?;
    out.write_all(b"glTF")?;
    for number in [2, word(total)?, word(json.len())?] {
        out.write_all(&number.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(&json)?;
    if !binary.is_empty() {
        out.write_all(&word(binary.len())?.to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        out.write_all(&binary)?;
    }
    out.finish()
}

fn invalid(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what.into())
}

/// Refuses what would make a damaged file.
fn check(model: &Model) -> io::Result<()> {
    for (i, mesh) in model.meshes.iter().enumerate() {
        let vertices = mesh.positions.len();
        let whole = |n: usize| n == 0 || n == vertices;
        let counts = [
            mesh.normals.len(),
            mesh.tangents.len(),
            mesh.uv[0].len(),
            mesh.uv[1].len(),
            mesh.colours.len(),
        ];
        let finite = mesh.positions.iter().all(|p| p.is_finite())
            && mesh.uv.iter().flatten().all(|p| p.is_finite());
        if !counts.into_iter().all(whole)
            || mesh.triangles.iter().flatten().any(|&v| v as usize >= vertices)
            || !finite
        {
            return Err(invalid(format!(
                "mesh {i} has an index out of range, an attribute of another length or a coordinate that is not finite"
            )));
        }
    }
    for object in &model.objects {
        let known = object.mesh < model.meshes.len() && object.material < model.materials.len();
        if !known
            || object.member.is_some_and(|m| m >= model.members.len())
            || !object.transform.is_finite()
        {
            return Err(invalid(format!(
                "object {:?} refers to something that is not there, or its transform is not finite",
                object.name
            )));
        }
    }
    for material in &model.materials {
        if texture_refs(material).any(|t| t.texture >= model.textures.len()) {
            return Err(invalid(format!(
                "material {:?} refers to a texture that is not there",
                material.name
            )));
        }
    }
    Ok(())
}

fn texture_refs(material: &Material) -> impl Iterator<Item = &TextureRef> {
    let surface = match &material.surface {
        Surface::Metallic { texture, .. } => texture.as_ref(),
        _ => None,
    };
    [
        material.base_texture.as_ref(),
        material.emission_texture.as_ref(),
        material.normal_texture.as_ref().map(|n| &n.0),
        surface,
    ]
    .into_iter()
    .flatten()
}

struct Writer<'a> {
    model: &'a Model,
    more: &'a dyn Fn(usize) -> Map<String, Value>,
    binary: Vec<u8>,
    root: Root,
}

impl Writer<'_> {
    /// The JSON; its bytes go to `binary`.
    fn root(mut self) -> io::Result<(Root, Vec<u8>)> {
        let model = self.model;
        self.root.asset.generator = Some(concat!("Intrados ", env!("CARGO_PKG_VERSION")).into());
        self.objects()?;
        for (i, lamp) in model.lamps.iter().enumerate() {
            self.lamp(i, lamp);
        }
        for camera in &model.cameras {
            self.camera(camera);
        }
        for material in &model.materials {
            let material = self.material(material)?;
            self.root.push(material);
        }
        self.textures()?;
        let nodes = (0..self.root.nodes.len()).map(index).collect();
        self.root.scene =
            Some(self.root.push(Scene { extensions: None, extras: None, name: None, nodes }));
        if !self.binary.is_empty() {
            self.root.push(Buffer {
                byte_length: self.binary.len().into(),
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
        }
        self.root.extensions_used.sort_unstable();
        self.root.extensions_used.dedup();
        Ok((self.root, self.binary))
    }

    fn uses(&mut self, extension: &str) {
        self.root.extensions_used.push(extension.into());
    }

    fn objects(&mut self) -> io::Result<()> {
        let model = self.model;
        let mut shared: HashMap<(usize, usize), Index<gltf_json::Mesh>> = HashMap::new();
        let mut primitives: HashMap<usize, Primitive> = HashMap::new();
        let mut introduced = vec![false; model.members.len()];
        let steel: HashMap<usize, &SteelLine> =
            model.steel.iter().map(|(object, line)| (*object, line)).collect();
        for (i, object) in model.objects.iter().enumerate() {
            let Some(mesh) = model.meshes.get(object.mesh).filter(|m| !m.triangles.is_empty())
            else {
                continue;
            };
            // A matrix must be translation · rotation · scale; a sheared one goes into the
            // vertices.
            let sheared = !is_trs(&object.transform);
            let known = shared.get(&(object.mesh, object.material)).filter(|_| !sheared).copied();
            let mesh = known.unwrap_or_else(|| {
                let primitive = if sheared {
                    self.geometry(&baked(mesh, &object.transform))
                } else {
                    primitives.entry(object.mesh).or_insert_with(|| self.geometry(mesh)).clone()
                };
                let plain = model.materials.get(object.material) == Some(&Material::default());
                let primitive =
                    Primitive { material: (!plain).then(|| index(object.material)), ..primitive };
                self.root.push(gltf_json::Mesh {
                    extensions: None,
                    extras: None,
                    name: None,
                    primitives: vec![primitive],
                    weights: None,
                })
            });
            if !sheared {
                shared.insert((object.mesh, object.material), mesh);
            }
            let mut extras = self.identity(object, &mut introduced);
            if let (Some(extras), Some(line)) = (&mut extras, steel.get(&i)) {
                extras.insert("steel".into(), said(line));
            }
            let extras = extras.map(ours).transpose()?;
            let matrix = (!sheared && object.transform != Mat4::IDENTITY)
                .then(|| object.transform.to_cols_array());
            self.root.push(Node {
                name: Some(object.name.clone()),
                mesh: Some(mesh),
                matrix,
                extras,
                ..Node::default()
            });
        }
        Ok(())
    }

    /// `extras.intrados`: the member's first object says everything, the others which part they
    /// are.
    fn identity(&self, object: &Object, introduced: &mut [bool]) -> Option<Map<String, Value>> {
        let index = object.member?;
        let member: &Member = self.model.members.get(index)?;
        let mut extras = Map::new();
        let mut say = |key: &str, value: &str| extras.insert(key.into(), value.into());
        say("member", &member.id);
        if let Some(part) = part_name(object.part) {
            say("part", part);
        }
        if !std::mem::replace(introduced.get_mut(index)?, true) {
            say("kind", kind_name(member.kind));
            say("name", &member.name);
            if !member.concrete_assumed {
                say("concrete", &member.concrete);
            }
            let boxed = Frame::of_box(member.kind, member.bounds);
            if member.frame != Frame::default() && !is_near(&member.frame, &boxed) {
                extras.insert("frame".into(), said_frame(&member.frame));
            }
            extras.extend((self.more)(index));
        }
        Some(extras)
    }

    /// Attributes and indices of a mesh, each in a buffer view of its own.
    fn geometry(&mut self, mesh: &Mesh) -> Primitive {
        let mut attributes = BTreeMap::new();
        let mut add = |semantic, accessor| attributes.insert(Valid(semantic), accessor);
        let bounds =
            mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| {
                [low.min(p), high.max(p)]
            });
        let position = self.floats(Type::Vec3, mesh.positions.iter().map(|p| p.to_array()));
        if let Some(accessor) = self.root.accessors.get_mut(position.value()) {
            [accessor.min, accessor.max] = bounds.map(|b| Some(b.to_array().to_vec().into()));
        }
        add(Semantic::Positions, position);
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-3;
        if !mesh.normals.is_empty() && mesh.normals.iter().all(|&n| unit(n)) {
            add(
                Semantic::Normals,
                self.floats(Type::Vec3, mesh.normals.iter().map(|n| n.to_array())),
            );
            if !mesh.tangents.is_empty()
                && mesh.tangents.iter().all(|t| unit(t.truncate()) && t.w.abs() == 1.0)
            {
                add(
                    Semantic::Tangents,
                    self.floats(Type::Vec4, mesh.tangents.iter().map(|t| t.to_array())),
                );
            }
        }
        // The second set needs a first one.
        for (set, uv) in (0..).zip(mesh.uv.iter().take_while(|uv| !uv.is_empty())) {
            add(Semantic::TexCoords(set), self.floats(Type::Vec2, uv.iter().map(|p| p.to_array())));
        }
        if !mesh.colours.is_empty() {
            let colours = mesh.colours.iter().map(|c| c.max(Vec3::ZERO).min(Vec3::ONE).to_array());
            add(Semantic::Colors(0), self.floats(Type::Vec3, colours));
        }
        let bytes: Vec<u8> =
            mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(Target::ElementArrayBuffer));
        let indices =
            Some(self.accessor(view, Type::Scalar, ComponentType::U32, 3 * mesh.triangles.len()));
        Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices,
            material: None,
            mode: Valid(Mode::Triangles),
            targets: None,
        }
    }

    fn floats<const N: usize>(
        &mut self,
        shape: Type,
        vectors: impl ExactSizeIterator<Item = [f32; N]>,
    ) -> Index<Accessor> {
        let count = vectors.len();
        let bytes: Vec<u8> = vectors.flatten().flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(Target::ArrayBuffer));
        self.accessor(view, shape, ComponentType::F32, count)
    }

    fn accessor(
        &mut self,
        view: Index<View>,
        shape: Type,
        component: ComponentType,
        count: usize,
    ) -> Index<Accessor> {
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: count.into(),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Valid(shape),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let byte_offset = Some(self.binary.len().into());
        self.binary.extend_from_slice(bytes);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset,
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        })
    }

    fn material(&mut self, material: &Material) -> io::Result<gltf_json::Material> {
        let mut out = gltf_json::Material {
            name: Some(material.name.clone()),
            double_sided: true,
            ..Default::default()
        };
        let pbr = &mut out.pbr_metallic_roughness;
        (pbr.metallic_factor.0, pbr.roughness_factor.0) = (0.0, 1.0);
        pbr.base_color_factor.0 =
            material.base_colour.clamp(Vec3::ZERO, Vec3::ONE).extend(1.0).to_array();
        pbr.base_color_texture = material.base_texture.as_ref().map(|t| self.texture_info(t));
        let mut said = Map::new();
        match &material.surface {
            Surface::Lambert => _ = said.insert("surface".into(), "lambert".into()),
            Surface::Black => _ = said.insert("surface".into(), "black".into()),
            Surface::Metallic { metallic, roughness, texture } => {
                (pbr.metallic_factor.0, pbr.roughness_factor.0) = (*metallic, *roughness);
                pbr.metallic_roughness_texture = texture.as_ref().map(|t| self.texture_info(t));
            }
            Surface::Dielectric { ior, roughness } => {
                pbr.roughness_factor.0 = *roughness;
                let extensions = out.extensions.get_or_insert_default();
                extensions.transmission = Some(Transmission {
                    transmission_factor: TransmissionFactor(1.0),
                    ..Default::default()
                });
                extensions.ior = Some(Ior { ior: IndexOfRefraction(*ior), extras: None });
                self.uses("KHR_materials_transmission");
                self.uses("KHR_materials_ior");
            }
        }
        if material.assumed {
            said.insert("assumed".into(), true.into());
        }
        let nits = material.emission.max(Vec3::ZERO) * LUMENS_PER_WATT;
        let strength = nits.max_element();
        if strength > 0.0 && strength.is_finite() {
            out.emissive_factor.0 = (nits / strength).to_array();
            let strength = EmissiveStrength { emissive_strength: EmissiveStrengthFactor(strength) };
            out.extensions.get_or_insert_default().emissive_strength = Some(strength);
            self.uses("KHR_materials_emissive_strength");
        }
        out.emissive_texture = material.emission_texture.as_ref().map(|t| self.texture_info(t));
        out.normal_texture =
            material.normal_texture.as_ref().map(|(t, scale)| self.normal_texture(t, *scale));
        out.extras = (!said.is_empty()).then(|| ours(said)).transpose()?;
        Ok(out)
    }

    fn texture_info(&mut self, texture: &TextureRef) -> texture::Info {
        let extensions =
            self.texture_transform(texture).map(|others| extensions::texture::Info { others });
        texture::Info {
            index: index(texture.texture),
            tex_coord: texture.set as u32,
            extensions,
            extras: None,
        }
    }

    fn normal_texture(&mut self, texture: &TextureRef, scale: f32) -> NormalTexture {
        let extensions = self
            .texture_transform(texture)
            .map(|others| extensions::material::NormalTexture { others });
        NormalTexture {
            index: index(texture.texture),
            scale,
            tex_coord: texture.set as u32,
            extensions,
            extras: None,
        }
    }

    /// As plain JSON: normal textures have no other place for it, and `gltf_json` writes a set that
    /// nobody asked for as `null`.
    fn texture_transform(&mut self, texture: &TextureRef) -> Option<Map<String, Value>> {
        if texture.transform == glam::Affine2::IDENTITY {
            return None;
        }
        self.uses("KHR_texture_transform");
        let (scale, angle, offset) = texture.transform.to_scale_angle_translation();
        let transform =
            json!({ "offset": offset.to_array(), "rotation": -angle, "scale": scale.to_array() });
        Some(Map::from_iter([("KHR_texture_transform".into(), transform)]))
    }

    /// Textures as PNG: colours in sRGB, data linear.
    fn textures(&mut self) -> io::Result<()> {
        let model = self.model;
        let colour = |i: usize| {
            model.materials.iter().any(|m| {
                [&m.base_texture, &m.emission_texture].into_iter().flatten().any(|t| t.texture == i)
            })
        };
        for (i, texture) in model.textures.iter().enumerate() {
            let view = self.view(&png(texture, colour(i))?, None);
            let mime_type = Some(MimeType("image/png".into()));
            let source = self.root.push(Image {
                buffer_view: Some(view),
                mime_type,
                name: None,
                uri: None,
                extensions: None,
                extras: None,
            });
            let [wrap_s, wrap_t] = texture.wrap.map(|wrap| {
                Valid(match wrap {
                    Wrap::Repeat => WrappingMode::Repeat,
                    Wrap::Mirror => WrappingMode::MirroredRepeat,
                    Wrap::Clamp => WrappingMode::ClampToEdge,
                })
            });
            let sampler = Some(self.root.push(Sampler { wrap_s, wrap_t, ..Default::default() }));
            self.root.push(gltf_json::Texture {
                name: None,
                sampler,
                source,
                extensions: None,
                extras: None,
            });
        }
        Ok(())
    }

    /// Node and light; nothing for an environment.
    fn lamp(&mut self, number: usize, lamp: &Lamp) {
        let (kind, position, direction, strength) = match lamp.kind {
            LampKind::Point { position, intensity } => {
                (light::Type::Point, position, Vec3::NEG_Z, intensity)
            }
            LampKind::Spot { position, direction, intensity, .. } => {
                (light::Type::Spot, position, direction, intensity)
            }
            LampKind::Directional { direction, irradiance } => {
                (light::Type::Directional, Vec3::ZERO, direction, irradiance)
            }
            LampKind::Environment { .. } => return,
        };
        let photometric = strength.max(Vec3::ZERO) * LUMENS_PER_WATT;
        let intensity = photometric.max_element();
        let colour = if intensity > 0.0 { photometric / intensity } else { Vec3::ONE };
        let spot = match lamp.kind {
            LampKind::Spot { inner, outer, .. } => {
                Some(light::Spot { inner_cone_angle: inner, outer_cone_angle: outer })
            }
            _ => None,
        };
        let light = self.root.push(light::Light {
            color: colour.to_array(),
            extensions: None,
            extras: None,
            intensity,
            name: Some(lamp.name.clone()),
            range: None,
            spot,
            type_: Valid(kind),
        });
        let shines = extensions::scene::Node {
            khr_lights_punctual: Some(light::KhrLightsPunctual { light }),
            ..Default::default()
        };
        let node = posed(&format!("lamp {number}"), position, direction, Vec3::Y);
        self.root.push(Node { extensions: Some(shines), ..node });
        self.uses("KHR_lights_punctual");
    }

    fn camera(&mut self, camera: &Camera) {
        let aspect = f64::from(camera.width.max(1)) / f64::from(camera.height.max(1));
        let half = (0.5 * f64::from(camera.fov_deg).to_radians()).tan();
        let perspective = Perspective {
            aspect_ratio: Some(aspect as f32),
            yfov: (2.0 * (half / aspect).atan()) as f32,
            zfar: None,
            znear: 0.01,
            extensions: None,
            extras: None,
        };
        let index = self.root.push(gltf_json::Camera {
            name: Some(camera.name.clone()),
            orthographic: None,
            perspective: Some(perspective),
            type_: Valid(gltf_json::camera::Type::Perspective),
            extensions: None,
            extras: None,
        });
        let node = posed(&camera.name, camera.position, camera.target - camera.position, camera.up);
        self.root.push(Node { camera: Some(index), ..node });
    }
}

/// What [`check`] has found to be there; no list of a file below 4 GiB is longer.
fn index<T>(index: usize) -> Index<T> {
    Index::new(index as u32)
}

/// `extras.intrados`.
fn ours(said: Map<String, Value>) -> io::Result<Box<RawValue>> {
    Ok(to_raw_value(&json!({ "intrados": said }))?)
}

/// A node at `position` that looks along `direction`, up as near to `up` as can be.
fn posed(name: &str, position: Vec3, direction: Vec3, up: Vec3) -> Node {
    let back = -direction.normalize_or(Vec3::NEG_Z);
    let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    let rotation = Quat::from_mat3(&Mat3::from_cols(right, back.cross(right), back)).normalize();
    Node {
        name: Some(name.into()),
        translation: Some(position.to_array()),
        rotation: Some(UnitQuaternion(rotation.to_array())),
        ..Node::default()
    }
}

/// Whether frames are the same but for rounding, to a tenth of a millimetre.
fn is_near(a: &Frame, b: &Frame) -> bool {
    let pairs = [(a.start, b.start), (a.axis, b.axis), (a.zero, b.zero)];
    pairs.into_iter().all(|(p, q)| p.distance(q) < 1e-4)
}

/// Whether a matrix is translation · rotation · scale: its axes stand square on each other.
fn is_trs(transform: &Mat4) -> bool {
    let m = Affine3A::from_mat4(*transform).matrix3;
    let square = |a: glam::Vec3A, b: glam::Vec3A| a.dot(b).abs() <= 1e-5 * a.length() * b.length();
    let axes = [m.x_axis, m.y_axis, m.z_axis];
    let [x, y, z] = axes;
    axes.iter().all(|a| a.length() > 0.0) && square(x, y) && square(y, z) && square(z, x)
}

/// A mesh with its transform in its vertices; mirrored ones wind round.
fn baked(mesh: &Mesh, transform: &Mat4) -> Mesh {
    let linear = Mat3::from_mat4(*transform);
    let normal = linear.inverse().transpose();
    let mut baked = mesh.clone();
    baked.positions.iter_mut().for_each(|p| *p = transform.transform_point3(*p));
    baked.normals.iter_mut().for_each(|n| *n = (normal * *n).normalize_or(Vec3::Y));
    baked
        .tangents
        .iter_mut()
        .for_each(|t| *t = (linear * t.truncate()).normalize_or(Vec3::X).extend(t.w));
    if linear.determinant() < 0.0 {
        baked.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        baked.tangents.iter_mut().for_each(|t| t.w = -t.w);
    }
    baked
}

fn png(texture: &Texture, colour: bool) -> io::Result<Vec<u8>> {
    let size = |n: usize| u32::try_from(n).map_err(|_| invalid("a texture is too large"));
    let encode = |c: f32| {
        let c = c.clamp(0.0, 1.0);
        // Linear to sRGB (IEC 61966-2-1).
        let s = match colour {
            true if c <= 0.003_130_8 => 12.92 * c,
            true => 1.055 * c.powf(1.0 / 2.4) - 0.055,
            false => c,
        };
        (s * 255.0).round() as u8
    };
    let bytes: Vec<u8> = texture.texels.iter().flat_map(|t| t.to_array().map(encode)).collect();
    let image = RgbImage::from_raw(size(texture.width)?, size(texture.height)?, bytes)
        .ok_or_else(|| invalid("a texture has too few texels"))?;
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).map_err(io::Error::other)?;
    Ok(png.into_inner())
}
