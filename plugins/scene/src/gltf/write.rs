//! Writing a model as GLB 2.0.

use std::{
    collections::HashMap,
    io::{self, Cursor, Write},
    path::Path,
};

use glam::{Affine3A, Mat3, Mat4, Quat, Vec3};
use image::{ImageFormat, RgbImage};
use intrados_stage::file::Unfinished;
use serde_json::{Map, Value, json};

use super::{
    LUMENS_PER_WATT, Model,
    import::member::{kind_name, part_name},
};
use crate::{Camera, Lamp, LampKind, Material, Member, Mesh, Object, Surface, Texture, TextureRef, Wrap};

/// Writes a model as one GLB file: a node for each object, lamp and camera; meshes shared; members in `extras.intrados` (see the module's
/// page), so that [`import`](super::import) gives the same model back. The file appears whole or not at all.
///
/// glTF has no place for an environment lamp, nor for a member's slices and planted truth: those are left to the scene file. Textures become
/// 8-bit PNG.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] where the model is no model (an index out of range, a coordinate that is not finite, more than 4 GiB);
/// otherwise what the system says.
pub fn write_glb(path: &Path, model: &Model) -> io::Result<()> {
    write_glb_with(path, model, &|_| Map::new())
}

/// The same, with more to say of each member (by its index) in `extras.intrados` of its first node.
///
/// # Errors
/// As [`write_glb`].
pub fn write_glb_with(path: &Path, model: &Model, more: &dyn Fn(usize) -> Map<String, Value>) -> io::Result<()> {
    check(model)?;
    let mut writer =
        Writer { model, more, binary: Vec::new(), views: Vec::new(), accessors: Vec::new(), meshes: Vec::new(), used: Vec::new() };
    let root = writer.root()?;
    let mut json = serde_json::to_vec(&root)?;
    json.resize(json.len().next_multiple_of(4), b' ');
    writer.binary.resize(writer.binary.len().next_multiple_of(4), 0);
    let chunk = |size: usize| if size == 0 { 0 } else { 8 + size };
    let total = 12 + chunk(json.len()) + chunk(writer.binary.len());
    let word = |size: usize| u32::try_from(size).map_err(|_| invalid("a GLB holds at most 4 GiB"));
    let mut out = Unfinished::begin(path)?;
    out.write_all(b"glTF")?;
    for number in [2, word(total)?, word(json.len())?] {
        out.write_all(&number.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(&json)?;
    if !writer.binary.is_empty() {
        out.write_all(&word(writer.binary.len())?.to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        out.write_all(&writer.binary)?;
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
        let counts = [mesh.normals.len(), mesh.tangents.len(), mesh.uv[0].len(), mesh.uv[1].len(), mesh.colours.len()];
        let finite = mesh.positions.iter().all(|p| p.is_finite()) && mesh.uv.iter().flatten().all(|p| p.is_finite());
        if !counts.into_iter().all(whole) || mesh.triangles.iter().flatten().any(|&v| v as usize >= vertices) || !finite {
            return Err(invalid(format!(
                "mesh {i} has an index out of range, an attribute of another length or a coordinate that is not finite"
            )));
        }
    }
    for object in &model.objects {
        let known = object.mesh < model.meshes.len() && object.material < model.materials.len();
        if !known || object.member.is_some_and(|m| m >= model.members.len()) || !object.transform.is_finite() {
            return Err(invalid(format!("object {:?} refers to something that is not there, or its transform is not finite", object.name)));
        }
    }
    for material in &model.materials {
        if texture_refs(material).any(|t| t.texture >= model.textures.len()) {
            return Err(invalid(format!("material {:?} refers to a texture that is not there", material.name)));
        }
    }
    Ok(())
}

fn texture_refs(material: &Material) -> impl Iterator<Item = &TextureRef> {
    let surface = match &material.surface {
        Surface::Metallic { texture, .. } => texture.as_ref(),
        _ => None,
    };
    [material.base_texture.as_ref(), material.emission_texture.as_ref(), material.normal_texture.as_ref().map(|n| &n.0), surface]
        .into_iter()
        .flatten()
}

struct Writer<'a> {
    model: &'a Model,
    more: &'a dyn Fn(usize) -> Map<String, Value>,
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    /// Extensions.
    used: Vec<&'static str>,
}

impl Writer<'_> {
    fn root(&mut self) -> io::Result<Value> {
        let mut nodes = self.objects()?;
        let lamps: Vec<(Value, Value)> = self.model.lamps.iter().enumerate().filter_map(|(i, lamp)| self.lamp(i, lamp)).collect();
        // Environment lamps have no place in glTF: renumber the others.
        let mut lights = Vec::new();
        for (mut node, light) in lamps {
            node["extensions"] = json!({ "KHR_lights_punctual": { "light": lights.len() } });
            nodes.push(node);
            lights.push(light);
        }
        for (i, camera) in self.model.cameras.iter().enumerate() {
            nodes.push(posed(&camera.name, camera.position, camera.target - camera.position, camera.up, json!({ "camera": i })));
        }
        let materials: Vec<Value> = self.model.materials.iter().map(|m| self.material(m)).collect();
        let (textures, images, samplers) = self.textures()?;
        let mut root = json!({ "asset": { "version": "2.0", "generator": concat!("Intrados ", env!("CARGO_PKG_VERSION")) } });
        let scene_nodes: Vec<usize> = (0..nodes.len()).collect();
        root["scene"] = 0.into();
        root["scenes"] = if scene_nodes.is_empty() { json!([{}]) } else { json!([{ "nodes": scene_nodes }]) };
        let cameras: Vec<Value> = self.model.cameras.iter().map(camera_json).collect();
        let buffers = if self.binary.is_empty() { Vec::new() } else { vec![json!({ "byteLength": self.binary.len() })] };
        let lists = [
            ("nodes", nodes),
            ("meshes", std::mem::take(&mut self.meshes)),
            ("materials", materials),
            ("textures", textures),
            ("images", images),
            ("samplers", samplers),
            ("cameras", cameras),
            ("accessors", std::mem::take(&mut self.accessors)),
            ("bufferViews", std::mem::take(&mut self.views)),
            ("buffers", buffers),
        ];
        // Empty lists are not legal.
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[name] = list.into();
        }
        if !lights.is_empty() {
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
        }
        self.used.sort_unstable();
        self.used.dedup();
        if !self.used.is_empty() {
            root["extensionsUsed"] = self.used.clone().into();
        }
        Ok(root)
    }

    fn objects(&mut self) -> io::Result<Vec<Value>> {
        let mut shared: HashMap<(usize, usize), usize> = HashMap::new();
        let mut attributes: HashMap<usize, (Value, usize)> = HashMap::new();
        let mut introduced = vec![false; self.model.members.len()];
        let mut nodes = Vec::new();
        for object in &self.model.objects {
            let Some(mesh) = self.model.meshes.get(object.mesh).filter(|m| !m.triangles.is_empty()) else { continue };
            // A matrix must be translation · rotation · scale; a sheared one goes into the vertices.
            let sheared = !is_trs(&object.transform);
            let index = match shared.get(&(object.mesh, object.material)).filter(|_| !sheared) {
                Some(&index) => index,
                None => {
                    let data = if sheared {
                        self.geometry(&baked(mesh, &object.transform))
                    } else if let Some(data) = attributes.get(&object.mesh) {
                        data.clone()
                    } else {
                        let data = self.geometry(mesh);
                        attributes.insert(object.mesh, data.clone());
                        data
                    };
                    let mut primitive = json!({ "attributes": data.0, "indices": data.1 });
                    if self.model.materials.get(object.material) != Some(&Material::default()) {
                        primitive["material"] = object.material.into();
                    }
                    self.meshes.push(json!({ "primitives": [primitive] }));
                    let index = self.meshes.len() - 1;
                    if !sheared {
                        shared.insert((object.mesh, object.material), index);
                    }
                    index
                }
            };
            let mut node = json!({ "name": object.name, "mesh": index });
            if !sheared && object.transform != Mat4::IDENTITY {
                node["matrix"] = object.transform.to_cols_array().to_vec().into();
            }
            if let Some(extras) = self.identity(object, &mut introduced) {
                node["extras"] = json!({ "intrados": extras });
            }
            nodes.push(node);
        }
        Ok(nodes)
    }

    /// `extras.intrados`: the member's first object says everything, the others which part they are.
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
            extras.extend((self.more)(index));
        }
        Some(extras)
    }

    /// Attributes and indices of a mesh, each in a buffer view of its own.
    fn geometry(&mut self, mesh: &Mesh) -> (Value, usize) {
        let mut attributes = Map::new();
        let mut add = |name: &str, accessor: usize| attributes.insert(name.into(), accessor.into());
        let bounds = mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)]);
        let position = self.floats("VEC3", mesh.positions.iter().map(|p| p.to_array()));
        if let Some(accessor) = self.accessors.get_mut(position) {
            accessor["min"] = bounds[0].to_array().to_vec().into();
            accessor["max"] = bounds[1].to_array().to_vec().into();
        }
        add("POSITION", position);
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-3;
        if !mesh.normals.is_empty() && mesh.normals.iter().all(|&n| unit(n)) {
            add("NORMAL", self.floats("VEC3", mesh.normals.iter().map(|n| n.to_array())));
            if !mesh.tangents.is_empty() && mesh.tangents.iter().all(|t| unit(t.truncate()) && t.w.abs() == 1.0) {
                add("TANGENT", self.floats("VEC4", mesh.tangents.iter().map(|t| t.to_array())));
            }
        }
        for (uv, name) in mesh.uv.iter().zip(["TEXCOORD_0", "TEXCOORD_1"]) {
            // The second set needs a first one.
            if !uv.is_empty() && (name == "TEXCOORD_0" || !mesh.uv[0].is_empty()) {
                add(name, self.floats("VEC2", uv.iter().map(|p| p.to_array())));
            }
        }
        if !mesh.colours.is_empty() {
            add("COLOR_0", self.floats("VEC3", mesh.colours.iter().map(|c| c.max(Vec3::ZERO).min(Vec3::ONE).to_array())));
        }
        let bytes: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(34963));
        self.accessors.push(json!({ "bufferView": view, "componentType": 5125, "count": 3 * mesh.triangles.len(), "type": "SCALAR" }));
        (attributes.into(), self.accessors.len() - 1)
    }

    fn floats<const N: usize>(&mut self, shape: &str, vectors: impl ExactSizeIterator<Item = [f32; N]>) -> usize {
        let count = vectors.len();
        let bytes: Vec<u8> = vectors.flatten().flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(34962));
        self.accessors.push(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": shape }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.binary.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn material(&mut self, material: &Material) -> Value {
        let mut json = json!({ "name": material.name, "doubleSided": true });
        let (mut metallic, mut roughness) = (0.0, 1.0);
        let mut ours = Map::new();
        let mut extensions = Map::new();
        let mut pbr = json!({});
        match &material.surface {
            Surface::Lambert => drop(ours.insert("surface".into(), "lambert".into())),
            Surface::Black => drop(ours.insert("surface".into(), "black".into())),
            Surface::Metallic { metallic: m, roughness: r, texture } => {
                (metallic, roughness) = (*m, *r);
                if let Some(texture) = texture {
                    pbr["metallicRoughnessTexture"] = self.texture_info(texture);
                }
            }
            Surface::Dielectric { ior, roughness: r } => {
                roughness = *r;
                extensions.insert("KHR_materials_transmission".into(), json!({ "transmissionFactor": 1.0 }));
                extensions.insert("KHR_materials_ior".into(), json!({ "ior": ior }));
                self.used.extend(["KHR_materials_transmission", "KHR_materials_ior"]);
            }
        }
        if material.assumed {
            ours.insert("assumed".into(), true.into());
        }
        pbr["metallicFactor"] = metallic.into();
        pbr["roughnessFactor"] = roughness.into();
        pbr["baseColorFactor"] = material.base_colour.clamp(Vec3::ZERO, Vec3::ONE).extend(1.0).to_array().to_vec().into();
        if let Some(texture) = &material.base_texture {
            pbr["baseColorTexture"] = self.texture_info(texture);
        }
        json["pbrMetallicRoughness"] = pbr;
        let nits = material.emission.max(Vec3::ZERO) * LUMENS_PER_WATT;
        let strength = nits.max_element();
        if strength > 0.0 && strength.is_finite() {
            json["emissiveFactor"] = (nits / strength).to_array().to_vec().into();
            extensions.insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": strength }));
            self.used.push("KHR_materials_emissive_strength");
        }
        if let Some(texture) = &material.emission_texture {
            json["emissiveTexture"] = self.texture_info(texture);
        }
        if let Some((texture, scale)) = &material.normal_texture {
            let mut info = self.texture_info(texture);
            info["scale"] = (*scale).into();
            json["normalTexture"] = info;
        }
        if !extensions.is_empty() {
            json["extensions"] = extensions.into();
        }
        if !ours.is_empty() {
            json["extras"] = json!({ "intrados": ours });
        }
        json
    }

    fn texture_info(&mut self, texture: &TextureRef) -> Value {
        let mut info = json!({ "index": texture.texture, "texCoord": texture.set });
        let (scale, angle, offset) = texture.transform.to_scale_angle_translation();
        if texture.transform != glam::Affine2::IDENTITY {
            let transform = json!({ "offset": offset.to_array(), "rotation": -angle, "scale": scale.to_array() });
            info["extensions"] = json!({ "KHR_texture_transform": transform });
            self.used.push("KHR_texture_transform");
        }
        info
    }

    /// Textures as PNG: colours in sRGB, data linear.
    fn textures(&mut self) -> io::Result<(Vec<Value>, Vec<Value>, Vec<Value>)> {
        let materials = &self.model.materials;
        let colour =
            |i: usize| materials.iter().any(|m| [&m.base_texture, &m.emission_texture].into_iter().flatten().any(|t| t.texture == i));
        let (mut textures, mut images, mut samplers) = (Vec::new(), Vec::new(), Vec::new());
        for (i, texture) in self.model.textures.iter().enumerate() {
            let view = self.view(&png(texture, colour(i))?, None);
            images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
            let wrap = |wrap| match wrap {
                Wrap::Repeat => 10497,
                Wrap::Mirror => 33648,
                Wrap::Clamp => 33071,
            };
            samplers.push(json!({ "wrapS": wrap(texture.wrap[0]), "wrapT": wrap(texture.wrap[1]) }));
            textures.push(json!({ "source": i, "sampler": i }));
        }
        Ok((textures, images, samplers))
    }

    /// Node and light; `None` for an environment.
    fn lamp(&mut self, index: usize, lamp: &Lamp) -> Option<(Value, Value)> {
        let (kind, position, direction, strength) = match lamp.kind {
            LampKind::Point { position, intensity } => ("point", position, Vec3::NEG_Z, intensity),
            LampKind::Spot { position, direction, intensity, .. } => ("spot", position, direction, intensity),
            LampKind::Directional { direction, irradiance } => ("directional", Vec3::ZERO, direction, irradiance),
            LampKind::Environment { .. } => return None,
        };
        let photometric = strength.max(Vec3::ZERO) * LUMENS_PER_WATT;
        let intensity = photometric.max_element();
        let colour = if intensity > 0.0 { photometric / intensity } else { Vec3::ONE };
        let mut light = json!({ "name": lamp.name, "type": kind, "color": colour.to_array(), "intensity": intensity });
        if let LampKind::Spot { inner, outer, .. } = lamp.kind {
            light["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        }
        self.used.push("KHR_lights_punctual");
        Some((posed(&format!("lamp {index}"), position, direction, Vec3::Y, json!({})), light))
    }
}

/// A node at `position` that looks along `direction`, up as near to `up` as can be.
fn posed(name: &str, position: Vec3, direction: Vec3, up: Vec3, mut node: Value) -> Value {
    let back = -direction.normalize_or(Vec3::NEG_Z);
    let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
    let rotation = Quat::from_mat3(&Mat3::from_cols(right, back.cross(right), back)).normalize();
    node["name"] = name.into();
    node["translation"] = position.to_array().to_vec().into();
    node["rotation"] = rotation.to_array().to_vec().into();
    node
}

fn camera_json(camera: &Camera) -> Value {
    let aspect = f64::from(camera.width.max(1)) / f64::from(camera.height.max(1));
    let half = (0.5 * f64::from(camera.fov_deg).to_radians()).tan();
    let yfov = 2.0 * (half / aspect).atan();
    json!({ "name": camera.name, "type": "perspective", "perspective": { "aspectRatio": aspect, "yfov": yfov, "znear": 0.01 } })
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
    baked.tangents.iter_mut().for_each(|t| *t = (linear * t.truncate()).normalize_or(Vec3::X).extend(t.w));
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
    let image =
        RgbImage::from_raw(size(texture.width)?, size(texture.height)?, bytes).ok_or_else(|| invalid("a texture has too few texels"))?;
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).map_err(io::Error::other)?;
    Ok(png.into_inner())
}
