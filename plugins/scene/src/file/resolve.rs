//! A checked [`SceneFile`] to a [`Scene`].

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::{Mat4, Quat, Vec2, Vec3};
use intrados_stage::{Access, Job, random::Key};

use super::{
    Assumed, Lamp, Material, Meter, SceneFile, Shape, Strength, Surface,
    buried::buried,
    doubts,
    evidence::{Evidence, place},
    unknown_members, unloaded,
};
use crate::{
    Assembly, Frame, LampKind, LoadError, MemberKind, Mesh, Object, Part, Scene, SteelLine,
    Structure, TextureRef, gltf,
    load::Sources,
    parametric,
    structure::{ASSUMED_CONCRETE, Body, Project},
};

/// Luminous efficacy that photometric units are converted with, lm/W.
pub(crate) const LUMEN_PER_WATT: f32 = 683.0;

/// Triangles that a scene may have, every instance counted: about 8 GiB in the tracer.
const MAX_TRIANGLES: usize = 64 << 20;

/// How many stirrups a detail may lay into one member.
const MAX_STIRRUPS: f32 = 20_000.0;

/// Luminance of linear Rec. 709.
pub(crate) fn luminance(colour: Vec3) -> f32 {
    colour.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Makes everything real: reads the files, builds the members, converts the units.
pub(crate) fn resolve(
    name: &str,
    file: &SceneFile,
    evidence: &[Evidence],
    sources: &mut Sources,
    job: &Job,
) -> Result<Scene, LoadError> {
    let scene = Scene {
        title: file.title.clone(),
        transport: file.transport.clone(),
        structure: Arc::new(said(file)),
        ..Scene::default()
    };
    let mut builder = Builder { scene, materials: HashMap::new(), sources, steel: Vec::new() };
    let parts = file.shapes.len() + file.models.len() + file.members.len();
    // Where in the scene somebody names what cannot be read.
    let at = |list: &str, i: usize| {
        let place = format!("{name}: {list}[{i}]");
        move |e: LoadError| e.under(&place)
    };
    for (i, material) in file.materials.iter().enumerate() {
        job.step(0, parts)?;
        builder.material(material).map_err(at("materials", i))?;
    }
    for (i, shape) in file.shapes.iter().enumerate() {
        job.step(i, parts)?;
        builder.shape(shape).map_err(at("shapes", i))?;
    }
    for (i, member) in file.members.iter().enumerate() {
        job.step(file.shapes.len() + i, parts)?;
        builder.member(member, job).map_err(at("members", i))?;
    }
    builder.scene.cameras.extend(file.cameras.iter().map(camera));
    for (i, lamp) in file.lamps.iter().enumerate() {
        let lamp = builder.lamp(lamp).map_err(at("lamps", i))?;
        builder.scene.lamps.push(lamp);
    }
    for (i, model) in file.models.iter().enumerate() {
        job.step(file.shapes.len() + file.members.len() + i, parts)?;
        builder.model(model, job).map_err(at("models", i))?;
    }
    builder.profile(file, job).map_err(|e| e.under(&format!("{name}: grading")))?;
    builder.whole(name, file, job)?;
    builder.evidence(evidence, job)?;
    Ok(builder.scene)
}

/// A name, or what stands for it.
fn named(name: &str, instead: &str) -> String {
    if name.trim().is_empty() { instead.to_owned() } else { name.to_owned() }
}

/// What the file says of the structure as it stands there; assemblies are still to come.
fn said(file: &SceneFile) -> Structure {
    Structure {
        project: Project {
            structure: named(&file.project.structure, &file.title),
            ..file.project.clone()
        },
        georeference: file.georeference.clone(),
        series: Vec::new(),
        assemblies: Vec::new(),
        concretes: file.concretes.clone(),
        supports: file.supports.clone(),
        joints: file.joints.clone(),
        loads: file.loads.clone(),
        tests: file.tests.clone(),
        gauges: file.gauges.clone(),
        readings: file.readings.clone(),
        observations: Vec::new(),
        photographs: Vec::new(),
        scanners: file.scanners.clone(),
        climate: file.climate.clone(),
        profile: file.grading.as_ref().map(|g| g.profile.clone()),
    }
}

/// A parametric member as what is computed as one.
fn assembly(member: &super::Member) -> Assembly {
    Assembly {
        id: member.id.clone(),
        kind: match member.body {
            Body::Column { .. } => MemberKind::Column,
            Body::Beam { .. } | Body::BoxGirder { .. } => MemberKind::Beam,
            Body::Tunnel { .. } => MemberKind::Lining,
        },
        members: member.ids().collect(),
        body: Some(member.body.clone()),
        frame: parametric::frame(member),
        concrete: member.concrete.clone().unwrap_or_else(|| ASSUMED_CONCRETE.into()),
        concrete_assumed: member.concrete.is_none(),
        matter: None,
        pours: member.pours.clone(),
        exposure: member.exposure.clone(),
        steel: parametric::steel_lines(member),
        steel_assumed: false,
    }
}

struct Builder<'a> {
    scene: Scene,
    materials: HashMap<String, usize>,
    sources: &'a mut Sources,
    /// What models bring, with the ids of its members.
    steel: Vec<(String, SteelLine)>,
}

impl Builder<'_> {
    fn material(&mut self, m: &Material) -> Result<(), LoadError> {
        let base_texture = match &m.texture {
            Some(text) => Some(TextureRef {
                texture: self.texture(text)?,
                set: 0,
                transform: glam::Affine2::IDENTITY,
            }),
            None => None,
        };
        let surface = match m.surface {
            Surface::Lambert => crate::Surface::Lambert,
            Surface::Metallic { metallic, roughness } => {
                crate::Surface::Metallic { metallic, roughness, texture: None }
            }
            Surface::Dielectric { ior, roughness } => crate::Surface::Dielectric { ior, roughness },
            Surface::Black => crate::Surface::Black,
        };
        self.materials.insert(m.name.clone(), self.scene.materials.len());
        self.scene.materials.push(crate::Material {
            name: m.name.clone(),
            assumed: false,
            surface,
            base_colour: m.colour,
            base_texture,
            emission: m.emission,
            finish: m.finish.as_ref().map(|f| {
                let finish = crate::Finish::new(f.kind, Key::new(f.seed, 0), f.worn);
                let stained = f.stains.iter().fold(finish, |finish, s| {
                    finish.stained_at(s.kind, Vec2::from(s.at), s.width_m, s.length_m)
                });
                Arc::new(stained)
            }),
            ..crate::Material::default()
        });
        Ok(())
    }

    fn texture(&mut self, text: &str) -> Result<usize, LoadError> {
        let path = self.sources.path(text)?;
        let bytes = self.sources.read(&path, 1 << 30)?;
        let decoded = super::image::decode(&bytes, self.sources.texels);
        let texture =
            decoded.map_err(|e| LoadError::bad(path.display().to_string(), "BAD_IMAGE", e))?;
        self.sources.texels -= texture.texels.len().min(self.sources.texels);
        self.scene.textures.push(texture);
        Ok(self.scene.textures.len() - 1)
    }

    /// The material of a shape or member: named, with its own emission, or assumed.
    fn material_of(&mut self, name: Option<&str>, emission: Option<Vec3>, what: &str) -> usize {
        let named = name.and_then(|n| self.materials.get(n).copied());
        let Some(emission) = emission.filter(|e| *e != Vec3::ZERO || named.is_some()) else {
            return named.unwrap_or_else(|| self.assumed(what));
        };
        let key = format!("{} emitting {emission}", name.unwrap_or("black"));
        if let Some(&index) = self.materials.get(&key) {
            return index;
        }
        let mut material = match named.and_then(|i| self.scene.materials.get(i)) {
            Some(material) => material.clone(),
            None => crate::Material {
                assumed: false,
                surface: crate::Surface::Black,
                base_colour: Vec3::ZERO,
                ..crate::Material::default()
            },
        };
        material.emission = emission;
        material.name = key.clone();
        self.scene.materials.push(material);
        self.materials.insert(key, self.scene.materials.len() - 1);
        self.scene.materials.len() - 1
    }

    /// The concrete that somebody had to assume: one for the whole scene.
    fn assumed(&mut self, what: &str) -> usize {
        let key = "\0assumed";
        if let Some(&index) = self.materials.get(key) {
            return index;
        }
        self.scene.warnings.push(format!(
            "{what} names no material: concrete grey is assumed, there and wherever none is named"
        ));
        self.scene.materials.push(crate::Material::default());
        self.materials.insert(key.into(), self.scene.materials.len() - 1);
        self.scene.materials.len() - 1
    }

    fn shape(&mut self, shape: &Shape) -> Result<(), LoadError> {
        let (name, mesh, transform, material, emission) = match shape {
            Shape::Quad { name, corner, u, v, material, emission } => {
                (name, quad(*corner, *u, *v), Mat4::IDENTITY, material, emission)
            }
            Shape::Box { name, centre, size, turn_deg, material, emission } => {
                let turn = Quat::from_rotation_y(turn_deg.to_radians());
                (
                    name,
                    cuboid(*size),
                    Mat4::from_rotation_translation(turn, *centre),
                    material,
                    emission,
                )
            }
            Shape::Mesh { name, file, transform, material, emission } => {
                let path = self.sources.path(file)?;
                let bytes = self.sources.read(&path, 1 << 30)?;
                let (mesh, notes) = super::obj::read(&path.display().to_string(), &bytes)?;
                self.scene.warnings.extend(notes);
                (name, mesh, transform.matrix(), material, emission)
            }
        };
        let kind = match shape {
            Shape::Quad { .. } => "quad",
            Shape::Box { .. } => "box",
            Shape::Mesh { .. } => "mesh",
        };
        let name = if name.is_empty() {
            format!("{kind} {}", self.scene.objects.len() + 1)
        } else {
            name.clone()
        };
        let material = self.material_of(material.as_deref(), *emission, &name);
        self.scene.meshes.push(Arc::new(mesh));
        self.scene.objects.push(Object {
            name,
            mesh: self.scene.meshes.len() - 1,
            transform,
            material,
            member: None,
            part: Part::Scenery,
        });
        Ok(())
    }

    fn member(&mut self, member: &super::Member, job: &Job) -> Result<(), LoadError> {
        let surface = self.material_of(member.material.as_deref(), None, &member.id);
        let steel = match self.materials.get("\0steel") {
            Some(&index) => index,
            None => {
                self.scene.materials.push(parametric::steel());
                self.materials.insert("\0steel".into(), self.scene.materials.len() - 1);
                self.scene.materials.len() - 1
            }
        };
        let first = self.scene.members.len();
        parametric::add(&mut self.scene, member, surface, steel, job)?;
        Arc::make_mut(&mut self.scene.structure).assemblies.push(assembly(member));
        if let Some(own) = self.scene.members.get_mut(first) {
            own.truth.clone_from(&member.truth);
        }
        self.slices(first, &member.slices, &self.sources.folder.clone(), job)
    }

    fn lamp(&mut self, lamp: &Lamp) -> Result<crate::Lamp, LoadError> {
        let kind = match lamp {
            Lamp::Point { position, strength, colour, .. } => LampKind::Point {
                position: *position,
                intensity: coloured(*colour, intensity(*strength, 4.0 * std::f32::consts::PI)),
            },
            Lamp::Spot { position, target, strength, colour, inner_deg, outer_deg, .. } => {
                let (inner, outer) = (inner_deg.to_radians(), outer_deg.to_radians());
                LampKind::Spot {
                    position: *position,
                    direction: (*target - *position).normalize(),
                    intensity: coloured(
                        *colour,
                        intensity(*strength, spot_solid_angle(inner, outer)),
                    ),
                    inner,
                    outer,
                }
            }
            Lamp::Directional { direction, strength, colour, .. } => LampKind::Directional {
                direction: direction.normalize(),
                irradiance: coloured(*colour, radiometric(*strength)),
            },
            Lamp::Environment { radiance, image, .. } => {
                let image = match image {
                    Some(text) => {
                        let index = self.texture(text)?;
                        self.scene.textures.get(index).cloned()
                    }
                    None => None,
                };
                LampKind::Environment { radiance: *radiance, image }
            }
        };
        let name = if lamp.name().is_empty() { "sky".into() } else { lamp.name().into() };
        Ok(crate::Lamp { name, kind })
    }

    /// What needs everything else: references to members, their slices and damage, meters on their
    /// surfaces, sizes.
    fn whole(&mut self, name: &str, file: &SceneFile, job: &Job) -> Result<(), LoadError> {
        if !file.models.is_empty() {
            let mut problems =
                unknown_members(file, self.scene.members.iter().map(|m| m.id.as_str()));
            if !problems.is_empty() {
                problems.iter_mut().for_each(|p| p.place = format!("{name}: {}", p.place));
                return Err(LoadError::BadInput(problems));
            }
        }
        if self.scene.triangle_count() > MAX_TRIANGLES {
            let message = format!(
                "the scene has {} triangles, more than {MAX_TRIANGLES}: split it",
                self.scene.triangle_count()
            );
            return Err(LoadError::bad(name, "TOO_MANY", message));
        }
        parametric::measure_bounds(&mut self.scene);
        let index_of: HashMap<String, usize> =
            self.scene.members.iter().enumerate().map(|(i, m)| (m.id.clone(), i)).collect();
        for (i, detail) in file.details.iter().enumerate() {
            job.step(0, 0)?;
            let Some(&index) = index_of.get(&detail.member) else { continue };
            if let Some(member) = self.scene.members.get_mut(index) {
                member.truth.extend(detail.truth.iter().cloned());
                if let Some(concrete) = &detail.concrete {
                    member.concrete.clone_from(concrete);
                    member.concrete_assumed = detail.assumed.contains(&Assumed::Concrete);
                }
                // What is said of one member holds before what is said of all of its assembly.
                if let Some(exposure) = &detail.exposure {
                    member.exposure = Some(exposure.clone());
                }
            }
            self.slices(index, &detail.slices, &self.sources.folder.clone(), job)
                .map_err(|e| e.under(&format!("{name}: details[{i}]")))?;
        }
        for (i, meter) in file.meters.iter().enumerate() {
            job.step(i, file.meters.len())?;
            let meter = match meter {
                Meter::Patch { name, corner, u, v } => {
                    crate::Meter { name: name.clone(), corner: *corner, u: *u, v: *v, on: None }
                }
                Meter::Surface { name: meter, on, along, angle_deg, size_m } => {
                    parametric::surface_meter(&self.scene, meter, on, *along, *angle_deg, *size_m)
                        .ok_or_else(|| {
                        let message = format!(
                            "the member \"{on}\" has no surface there: choose another place"
                        );
                        LoadError::bad(format!("{name}: meters[{i}]"), "NO_SURFACE", message)
                    })?
                }
            };
            self.scene.meters.push(meter);
        }
        self.agree();
        self.scene.assemble();
        lay(&mut self.scene, std::mem::take(&mut self.steel));
        self.furnish(name, &file.details)?;
        suspicious(&mut self.scene);
        classless(&mut self.scene);
        self.scene.warnings.extend(doubts(file, self.scene.bears_as_one()));
        self.scene.warnings.extend(unloaded(&self.scene));
        Ok(())
    }

    /// What details say of a parametric member holds for its assembly, too.
    fn agree(&mut self) {
        let Scene { structure, members, .. } = &mut self.scene;
        for assembly in &mut Arc::make_mut(structure).assemblies {
            if let Some(member) = members.iter().find(|m| m.id == assembly.id) {
                assembly.concrete.clone_from(&member.concrete);
                assembly.concrete_assumed = member.concrete_assumed;
                assembly.exposure.clone_from(&member.exposure);
            }
        }
    }

    /// Gives assemblies of models what details say of their bodies and their reinforcement.
    fn furnish(&mut self, name: &str, details: &[super::Detail]) -> Result<(), LoadError> {
        let Scene { structure, members, objects, meshes, .. } = &mut self.scene;
        let said =
            |d: &super::Detail| d.body.is_some() || d.reinforcement.is_some() || d.matter.is_some();
        for (i, detail) in details.iter().enumerate().filter(|(_, d)| said(d)) {
            let mut own = Arc::make_mut(structure).assemblies.iter_mut();
            let assembly = own.find(|a| a.id == detail.member && a.body.is_none());
            let member = members.iter().position(|m| m.id == detail.member);
            let (Some(assembly), Some(index)) = (assembly, member) else {
                let message = "a body, a matter and reinforcement are given here to members with a surface that a model brought: those of other members are told in members";
                return Err(LoadError::bad(
                    format!("{name}: details[{i}]"),
                    "NOT_OF_MODEL",
                    message,
                ));
            };
            assembly.matter.clone_from(&detail.matter);
            assembly.steel_assumed = detail.assumed.contains(&Assumed::Reinforcement);
            if let Some(body) = &detail.body {
                assembly.steel.extend(parametric::lines_of(body, assembly.frame));
                assembly.body = Some(body.clone());
            }
            if let Some(reinforcement) = &detail.reinforcement {
                let spacing = reinforcement.stirrups.as_ref().map_or(f32::MAX, |s| s.spacing_mm);
                if 1000.0 * assembly.frame.axis.length() / spacing > MAX_STIRRUPS {
                    let place = format!("{name}: details[{i}].reinforcement.stirrups.spacing_mm");
                    let message =
                        format!("that makes more than {MAX_STIRRUPS} of them: space them wider");
                    return Err(LoadError::bad(place, "TOO_MANY", message));
                }
                let left = buried(reinforcement, assembly.frame.axis.length());
                if let Some([at, why]) = left.into_iter().next() {
                    let place = format!("{name}: details[{i}].reinforcement.{at}");
                    return Err(LoadError::bad(place, "BURIED", why));
                }
                let surface = surface(index, objects, meshes);
                let lines = parametric::lines_in(assembly.frame, &surface, reinforcement);
                assembly.steel.extend(lines);
            }
        }
        Ok(())
    }

    /// Evidence comes last, so that it finds everything that it speaks of.
    fn evidence(&mut self, evidence: &[Evidence], job: &Job) -> Result<(), LoadError> {
        let mut problems = Vec::new();
        for one in evidence {
            problems.extend(place(&mut self.scene, one).err().into_iter().flatten());
        }
        if !problems.is_empty() {
            return Err(LoadError::BadInput(problems));
        }
        let members = self.scene.members.iter().enumerate();
        let index_of: HashMap<String, usize> = members.map(|(i, m)| (m.id.clone(), i)).collect();
        for one in evidence {
            for (i, of) in one.file.slices.iter().enumerate() {
                let Some(&index) = index_of.get(&of.member) else { continue };
                self.slices(index, &of.slices, &one.folder, job)
                    .map_err(|e| e.under(&format!("{}: slices[{i}]", one.name)))?;
            }
        }
        Ok(())
    }

    /// Slices of a member, as a file in `folder` names them.
    fn slices(
        &mut self,
        member: usize,
        slices: &[super::Slices],
        folder: &Path,
        job: &Job,
    ) -> Result<(), LoadError> {
        for slices in slices {
            let drilled = slices.drilled();
            let found = match slices {
                super::Slices::Drawn { name, count, size, pixel_mm, seed } => {
                    crate::Slices::Drawn {
                        name: name.clone(),
                        count: *count,
                        size: *size,
                        pixel_mm: *pixel_mm,
                        seed: *seed,
                    }
                }
                super::Slices::Scanned { name, scanner, along, seed } => crate::Slices::Scanned {
                    name: name.clone(),
                    scanner: scanner.clone(),
                    along: along.clone(),
                    seed: *seed,
                },
                super::Slices::Files { name, images, pixel_mm, .. } => {
                    let (images, masks) = super::slices::find(self.sources, folder, images, job)?;
                    self.scene.warnings.extend(placeless(name, drilled.along));
                    crate::Slices::Files {
                        name: name.clone(),
                        images,
                        masks,
                        pixel_mm: *pixel_mm,
                        drilled,
                    }
                }
                super::Slices::Stack { name, images, voxel_mm, .. } => {
                    let (images, _) = super::slices::find(self.sources, folder, images, job)?;
                    self.scene.warnings.extend(placeless(name, drilled.along));
                    crate::Slices::Stack {
                        name: name.clone(),
                        images,
                        voxel_mm: *voxel_mm,
                        drilled,
                    }
                }
            };
            if let Some(member) = self.scene.members.get_mut(member) {
                member.slices.push(found);
            }
        }
        Ok(())
    }

    /// A grading profile that is a file beside the scene is part of it.
    fn profile(&mut self, file: &SceneFile, job: &Job) -> Result<(), LoadError> {
        let Some(grading) = &file.grading else { return Ok(()) };
        let path = self.sources.path(&grading.profile)?;
        if path.exists() { self.sources.hash_file(&path, job) } else { Ok(()) }
    }

    fn model(&mut self, model: &super::Model, job: &Job) -> Result<(), LoadError> {
        let path = self.sources.path(&model.file)?;
        let mut imported = import(&path, self.sources, job)?;
        if !model.lamps {
            imported.lamps.clear();
        }
        if !model.cameras {
            imported.cameras.clear();
        }
        if self.scene.lamps.iter().any(is_environment) {
            imported.lamps.retain(|lamp| !is_environment(lamp));
        }
        let steel = merge(&mut self.scene, imported, model.transform.matrix());
        self.steel.extend(steel);
        Ok(())
    }
}

fn is_environment(lamp: &crate::Lamp) -> bool {
    matches!(lamp.kind, LampKind::Environment { .. })
}

/// Reads a glTF file, and adds it and all that it names to the hash.
fn import(path: &Path, sources: &mut Sources, job: &Job) -> Result<gltf::Model, LoadError> {
    sources.hash_file(path, job)?;
    let model = gltf::import_within(path, &sources.access, job)
        .map_err(|error| LoadError::of_import(path, error))?;
    for file in companions(path, &sources.access) {
        sources.hash_file(&file, job)?;
    }
    Ok(model)
}

/// The files that a glTF file names, and its properties. The import has refused what cannot be
/// read; what it did without is left out here too.
fn companions(path: &Path, access: &Access) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut files = vec![path.with_extension("props.json")];
    // A GLB has everything inside, or we would not know it from here.
    let text = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf"));
    let json = std::fs::read(path)
        .ok()
        .filter(|_| text)
        .and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok())
        .unwrap_or_default();
    for list in ["buffers", "images"] {
        let uris = json
            .get(list)
            .and_then(|l| l.as_array())
            .into_iter()
            .flatten()
            .filter_map(|item| item.get("uri")?.as_str());
        files.extend(
            uris.filter(|uri| !uri.starts_with("data:"))
                .map(|uri| folder.join(percent_decoded(uri))),
        );
    }
    files.retain(|file| access.open(folder, file).is_ok());
    files
}

/// `%20` and its like.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail
            .get(..2)
            .filter(|_| *first == b'%')
            .and_then(|hex| u8::from_str_radix(std::str::from_utf8(hex).ok()?, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { tail.get(2..).unwrap_or_default() } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Gives steel that models brought to the assemblies of its members.
fn lay(scene: &mut Scene, steel: Vec<(String, SteelLine)>) {
    let mut of: HashMap<String, Vec<SteelLine>> = HashMap::new();
    for (member, line) in steel {
        of.entry(member).or_default().push(line);
    }
    for assembly in &mut Arc::make_mut(&mut scene.structure).assemblies {
        assembly.steel.extend(of.remove(&assembly.id).unwrap_or_default());
    }
}

/// The surface of a member's concrete, in the world.
fn surface(member: usize, objects: &[Object], meshes: &[Arc<Mesh>]) -> Vec<parametric::Triangle> {
    let of_it = |o: &&Object| o.member == Some(member) && o.part == Part::Concrete;
    let faces = objects.iter().filter(of_it).flat_map(|o| {
        meshes.get(o.mesh).into_iter().flat_map(|m| {
            let corners = (0..m.triangles.len()).map(|i| m.corners(i));
            corners.map(|c| c.map(|p| o.transform.transform_point3(p)))
        })
    });
    faces.collect()
}

/// Puts a model into a scene at a place. Gives its steel with the ids of its members.
fn merge(scene: &mut Scene, model: gltf::Model, transform: Mat4) -> Vec<(String, SteelLine)> {
    let steel: Vec<(Option<usize>, SteelLine)> = model
        .steel
        .into_iter()
        .map(|(object, mut line)| {
            line.line.iter_mut().for_each(|p| *p = transform.transform_point3(*p));
            line.inward = transform.transform_vector3(line.inward);
            (model.objects.get(object).and_then(|o| o.member), line)
        })
        .collect();
    let (meshes, materials, textures, members) =
        (scene.meshes.len(), scene.materials.len(), scene.textures.len(), scene.members.len());
    scene.meshes.extend(model.meshes);
    scene.textures.extend(model.textures);
    scene.materials.extend(model.materials.into_iter().map(|mut m| {
        let packed = match &mut m.surface {
            crate::Surface::Metallic { texture, .. } => texture.as_mut(),
            _ => None,
        };
        let refs = [
            m.base_texture.as_mut(),
            m.emission_texture.as_mut(),
            m.normal_texture.as_mut().map(|n| &mut n.0),
            packed,
        ];
        refs.into_iter().flatten().for_each(|t| t.texture += textures);
        m
    }));
    scene.objects.extend(model.objects.into_iter().map(|o| Object {
        mesh: o.mesh + meshes,
        material: o.material + materials,
        member: o.member.map(|m| m + members),
        transform: transform * o.transform,
        ..o
    }));
    let mut ids: HashSet<String> = scene.members.iter().map(|m| m.id.clone()).collect();
    for mut member in model.members {
        let own = member.id.clone();
        // One model placed twice has its members twice.
        for n in 2.. {
            if ids.insert(member.id.clone()) {
                break;
            }
            member.id = format!("{own} #{n}");
        }
        if member.id != own {
            scene
                .warnings
                .push(format!("the id {own} is there twice: the second member is {}", member.id));
        }
        member.volume *= f64::from(transform.determinant().abs());
        let frame = member.frame;
        member.frame = Frame {
            start: transform.transform_point3(frame.start),
            axis: transform.transform_vector3(frame.axis),
            zero: transform.transform_vector3(frame.zero).normalize_or(frame.zero),
        };
        scene.members.push(member);
    }
    let turned = |v: Vec3| transform.transform_vector3(v).normalize_or(v);
    scene.lamps.extend(model.lamps.into_iter().map(|mut lamp| {
        match &mut lamp.kind {
            LampKind::Point { position, .. } => *position = transform.transform_point3(*position),
            LampKind::Spot { position, direction, .. } => {
                *position = transform.transform_point3(*position);
                *direction = turned(*direction);
            }
            LampKind::Directional { direction, .. } => *direction = turned(*direction),
            LampKind::Environment { .. } => {}
        }
        lamp
    }));
    scene.cameras.extend(model.cameras.into_iter().map(|k| crate::Camera {
        position: transform.transform_point3(k.position),
        target: transform.transform_point3(k.target),
        up: turned(k.up),
        ..k
    }));
    scene.warnings.extend(model.warnings);
    let id = |member: usize| scene.members.get(member + members).map(|m| m.id.clone());
    steel.into_iter().filter_map(|(member, line)| Some((id(member?)?, line))).collect()
}

/// A glTF file alone: with a camera that sees all of it, and a sky, where it brings none.
pub(crate) fn bare_model(
    path: &Path,
    sources: &mut Sources,
    job: &Job,
) -> Result<Scene, LoadError> {
    let mut scene = Scene::default();
    let steel = merge(&mut scene, import(path, sources, job)?, Mat4::IDENTITY);
    if scene.objects.is_empty() {
        return Err(LoadError::bad(
            path.display().to_string(),
            "EMPTY",
            "has no triangles: export the model with its geometry",
        ));
    }
    if scene.cameras.is_empty() {
        scene.cameras.push(crate::Camera::overview(scene.bounds()));
        scene.warnings.push("the file has no camera: one that sees all of it was added".into());
    }
    let emits = scene
        .objects
        .iter()
        .any(|o| scene.materials.get(o.material).is_some_and(|m| m.emission != Vec3::ZERO));
    if scene.lamps.is_empty() && !emits {
        let kind = LampKind::Environment { radiance: Vec3::ONE, image: None };
        scene.lamps.push(crate::Lamp { name: "sky".into(), kind });
        scene.warnings.push("the file has no lamp: a uniform sky of 1 W/(m² sr) was added".into());
    }
    scene.assemble();
    lay(&mut scene, steel);
    suspicious(&mut scene);
    Ok(scene)
}

/// What models said of their members' concrete, as it is now that details have spoken.
fn classless(scene: &mut Scene) {
    let before = scene.warnings.len();
    scene.warnings.retain(|w| !w.contains(gltf::NO_CLASS));
    if scene.warnings.len() == before {
        return;
    }
    let mut assumed: BTreeMap<&str, usize> = BTreeMap::new();
    let bears = |m: &&crate::Member| !matches!(m.kind, MemberKind::Bar | MemberKind::Tendon);
    for member in scene.members.iter().filter(bears).filter(|m| m.concrete_assumed) {
        *assumed.entry(&member.concrete).or_default() += 1;
    }
    let count: usize = assumed.values().sum();
    let classes: Vec<String> = match assumed.len() {
        0 => return,
        1 => assumed.keys().map(|class| format!("{class} is assumed")).collect(),
        _ => assumed.iter().map(|(class, n)| format!("{class} is assumed of {n}")).collect(),
    };
    let of = if count == 1 {
        "one member states no concrete class".to_owned()
    } else {
        format!("{count} {}", gltf::NO_CLASS)
    };
    scene.warnings.push(format!("{of}: {}", classes.join(", ")));
}

/// Models in millimetres are the commonest mistake.
fn suspicious(scene: &mut Scene) {
    let [low, high] = scene.bounds();
    let size = (high - low).max_element();
    if !scene.objects.is_empty() && !(1e-3..=2e3).contains(&size) {
        scene.warnings.push(format!("the scene is {size} m across: mm or m?"));
    }
}

pub(super) fn camera(k: &super::Camera) -> crate::Camera {
    crate::Camera {
        name: k.name.clone(),
        position: k.position,
        target: k.target,
        up: k.up,
        fov_deg: k.fov_deg,
        width: k.width,
        height: k.height,
        exposure: k.exposure,
        lens: k.lens,
    }
}

/// Strength without photometric units: W, W/sr or W/m².
fn radiometric(strength: Strength) -> f32 {
    match strength {
        Strength::Watt(x) | Strength::WattPerSteradian(x) | Strength::WattPerSquareMetre(x) => x,
        Strength::Lumen(x) | Strength::Candela(x) | Strength::Lux(x) => x / LUMEN_PER_WATT,
    }
}

/// Intensity, W·sr⁻¹, of a lamp whose flux is its intensity times `solid_angle`.
fn intensity(strength: Strength, solid_angle: f32) -> f32 {
    let value = radiometric(strength);
    if matches!(strength, Strength::Watt(_) | Strength::Lumen(_)) {
        value / solid_angle
    } else {
        value
    }
}

/// ∫ of the fall-off ((cos θ − cos o)/(cos i − cos o))², 1 inside the inner cone: 2π (1 − cos i +
/// (cos i − cos o)/3).
pub(crate) fn spot_solid_angle(inner: f32, outer: f32) -> f32 {
    2.0 * std::f32::consts::PI * (1.0 - inner.cos() + (inner.cos() - outer.cos()) / 3.0)
}

/// A strength with a hue: the result's luminance is `strength`.
fn coloured(colour: Vec3, strength: f32) -> Vec3 {
    colour * (strength / luminance(colour).max(1e-12))
}

fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Mesh {
    Mesh {
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        uv: [vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO], Vec::new()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A box about the origin, each face with texture coordinates of its own.
fn cuboid(size: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let unit = |i: usize| [Vec3::X, Vec3::Y, Vec3::Z][i % 3];
            let (n, a, b) = (unit(axis) * sign, unit(axis + 1), unit(axis + 2) * sign);
            let face = quad((n - a - b) * size * 0.5, a * size, b * size);
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(face.positions);
            mesh.uv[0].extend(&face.uv[0]);
            mesh.triangles.extend(face.triangles.iter().map(|t| t.map(|i| i + first)));
        }
    }
    mesh
}

/// Checks of the shapes against closed forms.
/// What to say of slices of which nobody knows where they lie.
fn placeless(name: &str, along: Option<f32>) -> Option<String> {
    along.is_none().then(|| {
        format!(
            "slices \"{name}\": where on the member they lie is missing, so that they say little of any place; add along: 0 to 1"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_encloses_its_volume() {
        let mesh = cuboid(Vec3::new(1.0, 2.0, 3.0));
        assert!((mesh.volume() - 6.0).abs() < 1e-12 && (mesh.area() - 22.0).abs() < 1e-12);
    }

    #[test]
    fn a_spot_emits_the_flux_it_was_given() {
        let (inner, outer) = (0.3_f32, 0.7_f32);
        // midpoint rule over the fall-off
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| {
                let theta = f64::from(outer) * (f64::from(i) + 0.5) / f64::from(n);
                let (c, ci, co) = (theta.cos(), f64::from(inner).cos(), f64::from(outer).cos());
                let fall = ((c - co) / (ci - co)).clamp(0.0, 1.0);
                fall * fall * 2.0 * std::f64::consts::PI * theta.sin() * f64::from(outer)
                    / f64::from(n)
            })
            .sum();
        assert!((f64::from(spot_solid_angle(inner, outer)) / sum - 1.0).abs() < 1e-5);
    }

    #[test]
    fn photometric_strengths_are_luminances() {
        let candela = coloured(Vec3::new(1.0, 0.5, 0.2), intensity(Strength::Candela(683.0), 1.0));
        assert!((luminance(candela) - 1.0).abs() < 1e-6);
        let lumen = intensity(Strength::Lumen(683.0 * 4.0), 4.0);
        assert!((lumen - 1.0).abs() < 1e-6);
    }
}
