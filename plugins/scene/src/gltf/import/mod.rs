//! A document that passed the rules becomes a [`Model`].

mod geometry;
mod light;
pub(super) mod material;
pub(super) mod member;
mod near;
mod solid;

use std::{collections::HashSet, path::Path, sync::Arc};

use glam::{DMat4, DQuat, DVec3, Mat4, Vec3};
use intrados_stage::{Access, Job};
use serde_json::Value;

use self::{
    geometry::{Primitive, Stop},
    member::{Identity, Members, Properties, Standing},
};
use super::{
    MAX_DEPTH, Model, NO_MEMBERS, NO_UNIT,
    document::Document,
    json::{Json, as_index},
    problem::{
        GltfProblem, ImportError,
        remedy::{EXPORT, SMALLER},
    },
    steel,
};
use crate::{Material, Mesh, Object, Part};

/// What the user should know, each sentence once.
#[derive(Debug, Default)]
pub(super) struct Notes {
    list: Vec<String>,
    said: HashSet<String>,
}

impl Notes {
    /// Lines that are told; the rest is counted.
    const MAX: usize = 50;

    fn push(&mut self, note: String) {
        self.list.push(note);
    }

    fn once(&mut self, note: &str) {
        if self.said.insert(note.to_owned()) {
            self.list.push(note.to_owned());
        }
    }

    fn finish(mut self) -> Vec<String> {
        let more = self.list.len().saturating_sub(Self::MAX);
        if more > 0 {
            self.list.truncate(Self::MAX);
            self.list.push(format!("and {more} more warnings"));
        }
        self.list
    }
}

/// Reads a model.
///
/// # Errors
/// One line that names file, place, fault and remedy: see [`ImportError`].
pub fn import(path: &Path, job: &Job) -> Result<Model, ImportError> {
    import_within(path, &Access::default(), job)
}

/// [`import`] where links may lead to other folders too.
///
/// # Errors
/// As [`import`].
pub(crate) fn import_within(path: &Path, access: &Access, job: &Job) -> Result<Model, ImportError> {
    Ok(read(path, None, access, job)?.0)
}

/// [`import_within`], moved to the origin where it lies far off, of a file in a unit of so many
/// metres; and what was taken off all coordinates, in that unit.
///
/// # Errors
/// As [`import`].
pub(crate) fn import_near(
    path: &Path,
    metres: f64,
    access: &Access,
    job: &Job,
) -> Result<(Model, DVec3), ImportError> {
    read(path, Some(metres), access, job)
}

fn read(
    path: &Path,
    near: Option<f64>,
    access: &Access,
    job: &Job,
) -> Result<(Model, DVec3), ImportError> {
    let mut problems = Vec::new();
    let document = Document::open(path, access, job, &mut problems)?;
    if let Some(document) = &document {
        problems.extend(unsupported(document));
        problems.extend(super::validate::check(document, false, job)?);
    }
    let refuse = |problem: GltfProblem, others| ImportError::Damaged {
        path: path.into(),
        problem: Box::new(problem),
        others,
    };
    if let Some(i) = problems.iter().position(GltfProblem::blocks_geometry) {
        let others = problems.iter().filter(|p| p.severity == super::Severity::Error).count() - 1;
        return Err(refuse(problems.swap_remove(i), others));
    }
    let Some(document) = document else {
        return Err(refuse(GltfProblem::error("", "JSON", "there is no JSON in it", EXPORT), 0));
    };
    let mut notes = Notes::default();
    for problem in problems.iter().filter(|p| p.severity == super::Severity::Error) {
        notes.push(problem.to_string());
    }
    Builder::new(&document, notes).build(near, job).map_err(|stop| match stop {
        Stop::Damaged(problem) => refuse(problem, 0),
        Stop::Cancelled(cancelled) => cancelled.into(),
    })
}

/// Extensions that we read, or that change nothing we look at.
const SUPPORTED: [&str; 25] = [
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "EXT_texture_webp",
];

/// Required extensions without which the geometry cannot be read, in human words.
pub(super) fn unsupported(document: &Document) -> Vec<GltfProblem> {
    let required = document.root.list("extensionsRequired").iter().enumerate();
    let lacking = required
        .filter_map(|(i, name)| Some((i, name.as_str()?)))
        .filter(|(_, name)| !SUPPORTED.contains(name));
    let problem = |(i, name): (usize, &str)| {
        let words = match name {
            "KHR_draco_mesh_compression" => "geometry compressed by Draco",
            "KHR_meshopt_compression" => "geometry compressed by a newer meshoptimizer",
            "KHR_gaussian_splatting" => "Gaussian splats in place of triangles",
            "MPEG_buffer_circular" | "MPEG_accessor_timed" | "MPEG_media" => "streamed media",
            _ => "an extension that is not supported",
        };
        let message = format!("the file cannot be read without {name} ({words})");
        GltfProblem::error(
            format!("/extensionsRequired/{i}"),
            "EXTENSION_UNSUPPORTED",
            message,
            "export the model again without it",
        )
    };
    lacking.map(problem).collect()
}

/// A mesh of the file as ours: one of our meshes a primitive.
#[derive(Debug, Clone, Default)]
struct Primitives {
    /// Our mesh and the file's material.
    list: Vec<(usize, Option<usize>)>,
    /// Enclosed volume, if closed.
    volume: Option<f64>,
}

/// Corners of meshes that nodes may show, each as often as it is shown.
const MAX_PLACED: usize = 1 << 31;

struct Builder<'a> {
    document: &'a Document,
    notes: Notes,
    model: Model,
    members: Members,
    /// Meshes of the file that were read.
    read: Vec<Option<Primitives>>,
    triangles: usize,
    assumed_material: Option<usize>,
    /// What is taken off all coordinates.
    offset: DVec3,
    /// Nodes that their file hides, the first by its name.
    hidden: (usize, String),
    /// Corners of instances that were looked at.
    instanced: usize,
}

/// A node on its way: where it is, how deep, and what its parent is.
struct Visit {
    node: usize,
    depth: usize,
    parent: DMat4,
    /// Member and part.
    standing: Option<(usize, Part)>,
}

impl<'a> Builder<'a> {
    fn new(document: &'a Document, notes: Notes) -> Self {
        let read = vec![None; document.root.list("meshes").len()];
        let (model, members) = (Model::default(), Members::default());
        Self {
            document,
            notes,
            model,
            members,
            read,
            triangles: 0,
            assumed_material: None,
            offset: DVec3::ZERO,
            hidden: (0, String::new()),
            instanced: 0,
        }
    }

    fn build(mut self, near: Option<f64>, job: &Job) -> Result<(Model, DVec3), Stop> {
        self.check_totals()?;
        (self.model.materials, self.model.textures) =
            material::materials(self.document, &mut self.notes, job)?;
        let properties =
            Properties::beside(&self.document.path, &self.document.access, &mut self.notes);
        let roots = self.roots();
        if let Some(metres) = near {
            self.offset = near::offset(&self.document.root, &roots, metres);
        }
        self.nodes(roots, &properties, job)?;
        self.model.members =
            std::mem::take(&mut self.members).finish(&mut self.model.objects, &mut self.notes);
        self.look_it_over(near.unwrap_or(1.0));
        self.model.warnings = self.notes.finish();
        Ok((self.model, self.offset))
    }

    /// Refuses too many triangles before any is read.
    fn check_totals(&self) -> Result<(), GltfProblem> {
        let accessors = self.document.root.list("accessors");
        let count = |index: Option<usize>| {
            index.and_then(|i| accessors.get(i)).and_then(|a| a.index("count")).unwrap_or(0)
        };
        let primitives =
            self.document.root.list("meshes").iter().flat_map(|m| m.list("primitives"));
        let triangles = primitives.map(|p| {
            let corners =
                count(p.index("indices").or_else(|| p.field("attributes").index("POSITION")));
            match p.index("mode") {
                Some(0..=3) => 0,
                Some(5 | 6) => corners.saturating_sub(2),
                _ => corners / 3,
            }
        });
        let triangles = triangles.fold(0, usize::saturating_add);
        if triangles > super::MAX_TRIANGLES {
            let message = format!(
                "the model has {triangles} triangles, more than the limit of {}",
                super::MAX_TRIANGLES
            );
            return Err(GltfProblem::error("/meshes", "TOO_BIG", message, SMALLER));
        }
        Ok(())
    }

    /// The nodes to begin with: of the scene to show, else of the first scene, else all that are
    /// nobody's child.
    fn roots(&mut self) -> Vec<usize> {
        let root = &self.document.root;
        let scenes = root.list("scenes");
        if scenes.len() > 1 {
            self.notes.push(format!(
                "the file has {} scenes; only the default one is read",
                scenes.len()
            ));
        }
        match scenes.get(root.index("scene").unwrap_or(0)) {
            Some(scene) => scene.list("nodes").iter().filter_map(as_index).collect(),
            None => {
                let nodes = root.list("nodes");
                let children: HashSet<usize> =
                    nodes.iter().flat_map(|n| n.list("children")).filter_map(as_index).collect();
                (0..nodes.len()).filter(|i| !children.contains(i)).collect()
            }
        }
    }

    fn nodes(&mut self, roots: Vec<usize>, properties: &Properties, job: &Job) -> Result<(), Stop> {
        let nodes = self.document.root.list("nodes");
        let mut visited = vec![false; nodes.len()];
        let parent = DMat4::from_translation(-self.offset);
        let visit = |node| Visit { node, depth: 1, parent, standing: None };
        let mut open: Vec<Visit> = roots.into_iter().rev().map(visit).collect();
        let mut done = 0;
        while let Some(Visit { node, depth, parent, standing }) = open.pop() {
            done += 1;
            job.step(8 * nodes.len() + 2 * done, 10 * nodes.len())?;
            let problem = |code, message: &str, remedy| {
                GltfProblem::error(format!("/nodes/{node}"), code, message, remedy)
            };
            let Some((json, seen)) = nodes.get(node).zip(visited.get_mut(node)) else {
                return Err(problem("REFERENCE", "there is no such node", EXPORT).into());
            };
            if std::mem::replace(seen, true) {
                return Err(problem(
                    "NODE_LOOP",
                    "the node has two parents or is its own ancestor",
                    EXPORT,
                )
                .into());
            }
            if depth > MAX_DEPTH {
                return Err(problem(
                    "NODE_DEPTH",
                    "the nodes are nested more than 256 deep",
                    "flatten the hierarchy",
                )
                .into());
            }
            let world = parent * local_transform(json);
            if !world.as_mat4().is_finite() {
                return Err(problem(
                    "NODE_TRANSFORM",
                    "the transforms down to this node overflow",
                    EXPORT,
                )
                .into());
            }
            let name = self.node_name(json, node);
            if json.extension("KHR_node_visibility").is_some_and(|e| e.field("visible") == false) {
                if self.hidden.0 == 0 {
                    self.hidden.1.clone_from(&name);
                }
                self.hidden.0 += 1;
                continue;
            }
            let mut own = None;
            let standing = match member::standing(json, &name, properties, &mut self.notes) {
                Standing::Member(identity) => {
                    let identity = identity.moved(self.offset.as_vec3());
                    let entered = self.enter(&identity);
                    own = Some(identity);
                    Some(entered)
                }
                Standing::Void => {
                    self.notes.once("spaces, openings and the like (IfcSpace, IfcOpeningElement) are no bodies and were left out");
                    continue;
                }
                Standing::Inherited => standing,
            };
            self.furnish(json, &name, &world);
            let first = self.model.objects.len();
            if let Some(mesh) = json.index("mesh") {
                let here = |stop| match stop {
                    Stop::Damaged(p) => Stop::Damaged(match p.code {
                        "NODE_TRANSFORM" | "TOO_BIG" => p.under(&format!("/nodes/{node}")),
                        _ => p,
                    }),
                    stop => stop,
                };
                let instances = match json.extension("EXT_mesh_gpu_instancing") {
                    Some(table) => geometry::instances(self.document, table, job).map_err(here)?,
                    None => vec![DMat4::IDENTITY],
                };
                for (k, instance) in instances.iter().enumerate() {
                    let standing = match &own {
                        Some(identity) if k > 0 => Some(self.enter(&identity.again())),
                        _ => standing,
                    };
                    self.place(mesh, &name, &(world * *instance), standing, job).map_err(here)?;
                }
            }
            self.steel(json, first);
            let child = |node| Visit { node, depth: depth + 1, parent: world, standing };
            open.extend(json.list("children").iter().rev().filter_map(as_index).map(child));
        }
        Ok(())
    }

    fn node_name(&self, json: &Value, node: usize) -> String {
        let mesh = || {
            json.index("mesh")
                .and_then(|m| self.document.root.list("meshes").get(m))
                .and_then(|m| m.text("name"))
        };
        json.text("name")
            .filter(|n| !n.is_empty())
            .or_else(mesh)
            .map_or_else(|| format!("node {node}"), |name| name.replace(char::is_control, " "))
    }

    /// Where the steel of a node runs, told of the first object that it brought.
    fn steel(&mut self, json: &Value, first: usize) {
        let said = json.field("extras").field("intrados").field("steel");
        let Some(object) = self.model.objects.get(first).filter(|_| said.is_object()) else {
            return;
        };
        match steel::read(said, object.part) {
            Some(mut line) => {
                line.line.iter_mut().for_each(|p| *p -= self.offset.as_vec3());
                self.model.steel.push((first, line));
            }
            None => self.notes.once("a line of steel is damaged and was left out"),
        }
    }

    fn enter(&mut self, identity: &Identity) -> (usize, Part) {
        (self.members.enter(identity, &mut self.notes), identity.part)
    }

    /// Lamp and camera of a node.
    fn furnish(&mut self, json: &Value, name: &str, world: &DMat4) {
        let root = &self.document.root;
        if let Some(index) = json.extension("KHR_lights_punctual").and_then(|e| e.index("light")) {
            let lamps = root.extension("KHR_lights_punctual").map_or(&[][..], |e| e.list("lights"));
            match lamps.get(index).and_then(|lamp| light::lamp(lamp, world, name)) {
                Some(lamp) => self.model.lamps.push(lamp),
                None => {
                    self.notes.push(format!("lamp {index} of node {name:?} is damaged; left out"))
                }
            }
        }
        if let Some(camera) = json.index("camera").and_then(|c| root.list("cameras").get(c)) {
            self.model.cameras.extend(light::camera(camera, world, name, &mut self.notes));
        }
        if json.get("skin").is_some() {
            self.notes.once("skins are not applied: skinned meshes stand in their rest pose");
        }
    }

    /// Puts a mesh of the file at a node.
    fn place(
        &mut self,
        mesh: usize,
        name: &str,
        world: &DMat4,
        standing: Option<(usize, Part)>,
        job: &Job,
    ) -> Result<(), Stop> {
        let Primitives { list, volume } = self.mesh(mesh, job)?;
        let determinant = world.determinant();
        if determinant.abs() < 1e-18 && !list.is_empty() {
            self.notes.push(format!("node {name:?} is scaled to nothing; left out"));
            return Ok(());
        }
        let (transform, mut extent) = (world.as_mat4(), [Vec3::INFINITY, Vec3::NEG_INFINITY]);
        job.step(8, 10)?;
        self.document.spend(list.len().saturating_mul(size_of::<Object>()))?;
        let corners = list.iter().filter_map(|(mesh, _)| self.model.meshes.get(*mesh));
        self.instanced += corners.map(|mesh| mesh.positions.len()).sum::<usize>() + 1;
        if self.instanced > MAX_PLACED {
            let message = format!("instances have more than {} million corners", MAX_PLACED >> 20);
            return Err(GltfProblem::error("", "TOO_BIG", message, SMALLER).into());
        }
        let (member, part) =
            standing.map_or((None, Part::Scenery), |(member, part)| (Some(member), part));
        for &(mesh, material) in &list {
            let Some(shape) = self.model.meshes.get(mesh) else { continue };
            let [low, high] = extent_of(shape, &transform);
            if !low.is_finite() || !high.is_finite() {
                return Err(GltfProblem::error(
                    "",
                    "NODE_TRANSFORM",
                    "its transform moves the mesh beyond what numbers hold",
                    EXPORT,
                )
                .into());
            }
            extent = [extent[0].min(low), extent[1].max(high)];
            let material = self.material(material);
            self.model.objects.push(Object {
                name: name.into(),
                mesh,
                transform,
                material,
                member,
                part,
            });
        }
        if let Some(member) = member.filter(|_| !list.is_empty()) {
            self.members.extend(member, part, extent, volume.map(|v| v * determinant.abs()));
        }
        Ok(())
    }

    fn material(&mut self, material: Option<usize>) -> usize {
        // The assumed material, if any, comes last.
        let own = self.assumed_material.unwrap_or(self.model.materials.len());
        if let Some(material) = material.filter(|&m| m < own) {
            return material;
        }
        *self.assumed_material.get_or_insert_with(|| {
            self.notes.push("some surfaces have no material: grey concrete is assumed".into());
            self.model.materials.push(Material::default());
            own
        })
    }

    /// Reads a mesh of the file, once.
    fn mesh(&mut self, index: usize, job: &Job) -> Result<Primitives, Stop> {
        if let Some(Some(known)) = self.read.get(index) {
            return Ok(known.clone());
        }
        let Some(json) = self.document.root.list("meshes").get(index) else {
            return Err(GltfProblem::error(
                format!("/meshes/{index}"),
                "REFERENCE",
                "there is no such mesh",
                EXPORT,
            )
            .into());
        };
        let first = self.model.meshes.len();
        let mut list = Vec::new();
        for (i, primitive) in json.list("primitives").iter().enumerate() {
            job.step(8, 10)?;
            if primitive.field("targets").is_array() {
                self.notes.once("morph targets are not applied");
            }
            let place = |stop| match stop {
                Stop::Damaged(p) if p.code == "MODE" => {
                    Stop::Damaged(p.under(&format!("/meshes/{index}/primitives/{i}")))
                }
                stop => stop,
            };
            let read = match geometry::primitive(self.document, primitive, &mut self.triangles, job)
                .map_err(place)
            {
                // Legal: the bytes may come with an extension. There is nothing to draw then.
                Err(Stop::Damaged(problem)) if problem.code == "BUFFER_ABSENT" => {
                    self.notes.push(format!(
                        "/meshes/{index}/primitives/{i}: {}; left out",
                        problem.message
                    ));
                    continue;
                }
                read => read?,
            };
            match read {
                Primitive::Triangles(mesh) => {
                    list.push((self.model.meshes.len(), primitive.index("material")));
                    self.model.meshes.push(Arc::new(mesh));
                }
                Primitive::Wires => {
                    self.notes.once("points and lines have no surface and were left out")
                }
                Primitive::Nothing => {
                    self.notes.once("primitives without positions or triangles were left out")
                }
            }
        }
        let shapes: Vec<&Mesh> = self.model.meshes.iter().skip(first).map(Arc::as_ref).collect();
        let primitives = Primitives { list, volume: solid::volume(&shapes, job)? };
        if let Some(slot) = self.read.get_mut(index) {
            *slot = Some(primitives.clone());
        }
        Ok(primitives)
    }

    /// Remarks on the whole: emptiness, size, place, members.
    fn look_it_over(&mut self, metres: f64) {
        if self.hidden.0 > 0 {
            let (count, first) = &self.hidden;
            self.notes.push(format!(
                "{count} nodes, {first:?} the first, are hidden by KHR_node_visibility: they and what is below them are left out; show them in the model if they are part of it"
            ));
        }
        if self.model.objects.is_empty() {
            let loose = !self.document.root.list("meshes").is_empty();
            self.notes.push(
                if loose {
                    "no node of the scene shows any surface"
                } else {
                    "the file has no geometry"
                }
                .into(),
            );
            return;
        }
        if self.model.members.is_empty() {
            self.notes.push(
                format!("{NO_MEMBERS}: name nodes COL_…, BEAM_…, SLAB_…, WALL_…, FOOTING_…, LINING_… or SEGMENT_…, give them extras.intrados, or put a .props.json beside the file"),
            );
        }
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for object in &self.model.objects {
            let Some(mesh) = self.model.meshes.get(object.mesh) else { continue };
            let [low, high] = extent_of(mesh, &object.transform);
            bounds = [bounds[0].min(low), bounds[1].max(high)];
        }
        let size = (bounds[1] - bounds[0]).max_element();
        if !(1e-3..=2e3).contains(&size) {
            self.notes.push(format!("the model is {size} m large: {NO_UNIT}"));
        }
        let far = bounds[0].abs().max(bounds[1].abs()).max_element();
        if far > 1e4 {
            let resolved = 1e3 * f32::EPSILON * far;
            self.notes.push(format!(
                "the model lies {far:.0} m from the origin, where single precision resolves {resolved:.0} mm: move it, or import it (`intrados import`), which does"
            ));
        }
        self.note_coarse(metres);
        // A camera looks at something: the point of its axis nearest to the middle of the model.
        let middle = 0.5 * (bounds[0] + bounds[1]);
        for camera in &mut self.model.cameras {
            let forward = camera.target - camera.position;
            camera.target =
                camera.position + forward * (middle - camera.position).dot(forward).max(1.0);
        }
    }
}

impl Builder<'_> {
    /// Notes corners that lie so far from the origin of their own node that single precision, in
    /// which files keep them, has lost millimetres of them.
    fn note_coarse(&mut self, metres: f64) {
        let reach = |mesh: &Arc<Mesh>| {
            mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max)
        };
        let far: Vec<f32> = self.model.meshes.iter().map(reach).collect();
        let (mut coarse, mut worst) = (0, 0.0);
        for object in &self.model.objects {
            let matrix = &object.transform;
            let scale = [matrix.x_axis, matrix.y_axis, matrix.z_axis]
                .map(|axis| axis.truncate().length())
                .into_iter()
                .fold(0.0, f32::max);
            let far = far.get(object.mesh).copied().unwrap_or(0.0);
            // From one number to the next.
            let step = f32::EPSILON * far.max(f32::MIN_POSITIVE).log2().floor().exp2();
            let lost = metres * f64::from(step * scale);
            if lost > COARSE {
                coarse += 1;
                worst = lost.max(worst);
            }
        }
        if coarse > 0 {
            self.notes.push(format!(
                "corners of {coarse} surfaces lie so far from the origin of their own node that the file keeps them to {:.0} mm only: sections and spacings are as rough; export the model near its origin and give the distance to a node above",
                1e3 * worst
            ));
        }
    }
}

/// What a corner's coordinate may lose in its file before that is noted, m.
const COARSE: f64 = 1e-3;

fn extent_of(mesh: &Mesh, transform: &Mat4) -> [Vec3; 2] {
    mesh.positions.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| {
        let p = transform.transform_point3(p);
        // `min` and `max` would hide a NaN.
        if p.is_finite() { [low.min(p), high.max(p)] } else { [Vec3::NAN; 2] }
    })
}

/// A node's own transform: its matrix, or translation · rotation · scale.
pub(super) fn local_transform(node: &Value) -> DMat4 {
    if let Some(matrix) = node.numbers::<16>("matrix") {
        return DMat4::from_cols_array(&matrix);
    }
    let scale = node.numbers("scale").map_or(DVec3::ONE, DVec3::from_array);
    let rotation = node.numbers("rotation").map_or(DQuat::IDENTITY, DQuat::from_array);
    let rotation =
        if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    let translation = node.numbers("translation").map_or(DVec3::ZERO, DVec3::from_array);
    DMat4::from_scale_rotation_translation(scale, rotation, translation)
}
