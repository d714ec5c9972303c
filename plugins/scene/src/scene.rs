use std::{collections::HashMap, path::PathBuf, sync::Arc};

use glam::{Mat4, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    Assembly, Camera, Lamp, Material, Member, MemberKind, Mesh, Meter, Structure, Texture,
    sources::SourceFiles,
};

/// A scene in memory: everything resolved, checked and in SI units. Plain data; the plugin keeps it
/// in [`CurrentScene`](crate::plugin::CurrentScene) and spreads it over entities.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// Name, for people: the file's stem; of a `scene.ron`, which all projects have, its folder's.
    pub name: String,
    /// Title in the scene file, for people.
    pub title: String,
    /// The file it came from.
    pub path: PathBuf,
    /// BLAKE3 of the scene file and of every file it names: what results are tied to.
    pub hash: String,
    /// Shapes, shared by objects.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shapes in place.
    pub objects: Vec<Object>,
    /// What the objects are made of.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub textures: Vec<Texture>,
    /// Lamps that are no surfaces.
    pub lamps: Vec<Lamp>,
    /// Cameras; the first is the one to look through.
    pub cameras: Vec<Camera>,
    /// Meters.
    pub meters: Vec<Meter>,
    /// Structural members.
    pub members: Vec<Member>,
    /// What bears, and what holds, loads, attacks and looks at it.
    pub structure: Arc<Structure>,
    /// How far light is followed.
    pub transport: Transport,
    /// What a user should know: assumptions, suspicious sizes, parts that were skipped.
    pub warnings: Vec<String>,
    /// What stands in its file; nothing of what has no file of ours.
    pub written: Written,
    /// The files that it names and that are read again later.
    pub sources: SourceFiles,
}

/// The text of a scene's file: forms show and change it
/// ([`fields`](crate::attach::fields)). Nobody computes with it.
#[derive(Debug, Clone, Default)]
pub struct Written(pub(crate) Arc<str>);

/// How far light is followed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transport {
    /// Surfaces on a path from the lamp to the camera, the lamp's included: 1 shows lamps alone.
    /// Unlimited if absent.
    #[serde(default)]
    pub max_depth: Option<u32>,
    /// First event at which Russian roulette may end a walk.
    #[serde(default)]
    pub roulette_from: Option<u32>,
    /// From what roulette takes the probability to go on.
    #[serde(default)]
    pub roulette: Roulette,
}

/// From what Russian roulette takes the probability to go on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Roulette {
    /// What the surface reflects.
    #[default]
    Event,
    /// What the walk still carries.
    Weight,
}

/// One shape in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Node name.
    pub name: String,
    /// Index of the mesh.
    pub mesh: usize,
    /// Mesh frame → world. May mirror (negative determinant): whoever uses it turns the winding
    /// round.
    pub transform: Mat4,
    /// Index of the material.
    pub material: usize,
    /// Index of the member that it is part of.
    pub member: Option<usize>,
    /// Which part of the member.
    pub part: Part,
}

/// The parts of a member, and what is no member at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Part {
    /// Scenery, ground, lamps.
    #[default]
    Scenery,
    /// Concrete outline: the surface that light sees.
    Concrete,
    /// Longitudinal bar, inside the concrete.
    Bar,
    /// Stirrup or hoop.
    Stirrup,
    /// Prestressing tendon.
    Tendon,
}

impl Scene {
    /// Adds to the structure what members of models bear; to be called once members and objects are
    /// there.
    pub fn assemble(&mut self) {
        Arc::make_mut(&mut self.structure).assemble(&self.members, &self.objects);
    }

    /// Whether its members bear as one, those that touch and of which no joint is said
    /// monolithically: the scene says how members are joined, or of a support that it is only there
    /// for members by themselves, or one that nothing holds touches others, which must carry it.
    /// Else each is computed as its own supports hold it. `predict`, `analyze` and the window ask
    /// this alone; `analyze --whole` is told to compute the whole.
    #[must_use]
    pub fn bears_as_one(&self) -> bool {
        /// How far apart members may be that touch, m.
        const SLACK: f32 = 0.05;
        let structure = &self.structure;
        if structure.is_joined() {
            return true;
        }
        let bounds: HashMap<&str, [Vec3; 2]> =
            self.members.iter().map(|m| (m.id.as_str(), m.bounds)).collect();
        let of = |a: &Assembly| bounds.get(a.id.as_str()).copied();
        let is_held = |a: &&Assembly| a.kind == MemberKind::Footing || structure.is_held(&a.id);
        let solid = structure.assemblies.iter().filter(|a| !a.is_tunnel());
        let (held, free): (Vec<&Assembly>, Vec<&Assembly>) = solid.partition(is_held);
        let touches = |a: &Assembly, b: &Assembly| match (of(a), of(b)) {
            (Some([l, h]), Some([m, n])) => {
                (l - SLACK).cmple(n).all() && (m - SLACK).cmple(h).all()
            }
            _ => false,
        };
        free.iter().any(|a| held.iter().any(|b| touches(a, b)))
    }

    /// What people call the member of that id; the id itself where there is no such member.
    #[must_use]
    pub fn name_of<'a>(&'a self, id: &'a str) -> &'a str {
        let named = self.members.iter().find(|m| m.id == id && !m.name.is_empty());
        named.map_or(id, |m| &m.name)
    }

    /// The id of the member that somebody calls so: by its id, or by a name that no other has; of a
    /// name such as `Girder 1:Girder 1:166739`, which authoring tools make of family, type and
    /// number, the first part will do.
    ///
    /// # Errors
    /// How many have that name: none or several.
    pub fn id_of(&self, word: &str) -> Result<&str, usize> {
        let short = |name: &'_ str| name.split_once(':').map_or("", |(first, _)| first) == word;
        let ways: [&dyn Fn(&Member) -> bool; 3] =
            [&|m| m.id == word, &|m| m.name == word, &|m| !word.is_empty() && short(&m.name)];
        for is_meant in ways {
            let meant: Vec<&Member> = self.members.iter().filter(|m| is_meant(m)).collect();
            match meant[..] {
                [] => {}
                [one] => return Ok(&one.id),
                _ => return Err(meant.len()),
            }
        }
        Err(0)
    }

    /// Corners of the bounding box of all objects, m; zeros where there are none.
    #[must_use]
    pub fn bounds(&self) -> [Vec3; 2] {
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for object in &self.objects {
            for &p in &self.meshes[object.mesh].positions {
                let p = object.transform.transform_point3(p);
                bounds = [bounds[0].min(p), bounds[1].max(p)];
            }
        }
        if bounds[0].x <= bounds[1].x { bounds } else { [Vec3::ZERO; 2] }
    }

    /// Number of triangles, every object counted.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.objects.iter().map(|o| self.meshes[o.mesh].triangles.len()).sum()
    }
}
