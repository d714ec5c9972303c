//! glTF 2.0 and GLB: [`validate`], [`import`], [`write_glb`].
//!
//! A file goes through four rooms. `glb` takes the container apart, `document` reads JSON and
//! buffers within limits, `validate` holds the rules (one file a subject), `import` turns what they
//! let through into meshes, materials, lamps, cameras and members. Nothing is allocated before its
//! size was compared with what the file holds; nothing is indexed that was not checked; a file that
//! lies is refused with one line that names the place and the remedy.
//!
//! What is refused: a damaged container, JSON, buffer, accessor, mesh, node or scene, and required
//! extensions that are not supported. What only costs itself and leaves a warning: damaged or
//! unsupported materials, textures, images, samplers, animations, skins, cameras, lights.
//! Extensions that are read, and those of materials, are checked like the rest; others are named by
//! a note of [`validate`].
//!
//! # Members
//!
//! What a node is, structurally, is read from three places, the first one that speaks wins, and
//! holds for the node's children too:
//!
//! 1. `extras.intrados` of the node:
//!    `{"member": "C1", "name": "Column C1", "kind": "column", "part": "concrete", "concrete": "C30/37"}`.
//!    `member` is the id and the only field that must be there. `kind` is one of
//!    [`MemberKind`](crate::MemberKind) in snake case, `part` one of `concrete` (if absent), `bar`,
//!    `stirrup`, `tendon`. Several nodes may name the same member: its parts. One of them says
//!    name, kind and class, and may give the member's `frame`, in the file's world, m:
//!    `{"start": […], "axis": […], "zero": […]}`. A node of steel may say where its axis runs:
//!    `"steel": {"name": "bar 1", "diameter_m": 0.02, "line": [[…], …], "grade": "B500B"}`
//!    (`prestress` in place of `grade` for a tendon, in the words of a scene).
//! 2. `FILE.props.json` beside `FILE.glb`: an object from node name (the id, an IFC GlobalId) to
//!    `{"type": "IfcColumn", "name": …, "materials": […]}`. Reinforcing bars and tendons become
//!    members of their own.
//! 3. The node's name: `COL_…`, `BEAM_…`, `SLAB_…`, `WALL_…`, `FOOTING_…`, `LINING_…`, `SEGMENT_…`,
//!    `TENDON_…`, `BAR_…`, `PIPE_…`.
//!
//! A concrete class that nobody states is assumed C30/37 and marked so.
//!
//! # Light
//!
//! Emission is nits (cd·m⁻²) in glTF, lamps candela and lux; all are divided by 683 lm·W⁻¹ on
//! reading and multiplied on writing.

mod accessor;
mod document;
mod glb;
mod import;
mod json;
mod meshopt;
mod problem;
mod steel;
mod validate;
mod write;

use std::sync::Arc;

pub use import::import;
pub(crate) use import::{import_near, import_within};
pub use problem::{GltfProblem, ImportError, Place, Severity};
pub use validate::{validate, validate_within};
pub use write::{write_glb, write_glb_with};

use crate::{Camera, Lamp, Material, Member, Mesh, Object, Scene, SteelLine, Texture};

/// Luminous efficacy by which photometric input becomes radiometric, lm·W⁻¹.
const LUMENS_PER_WATT: f32 = 683.0;

/// Triangles that a model may have, instances counted once.
const MAX_TRIANGLES: usize = 64 << 20;
/// Texels of all textures of a model together.
const MAX_TEXELS: usize = 48 << 20;
/// Depth of the node tree.
const MAX_DEPTH: usize = 256;

/// What is noted of members whose concrete nobody states, behind their number.
pub(crate) const NO_CLASS: &str = "members state no concrete class";
/// What a note of a model without members begins with.
pub(crate) const NO_MEMBERS: &str = "no structural members";
/// What is noted of a model whose size is doubted, behind it.
pub(crate) const NO_UNIT: &str = "mm or m? glTF is in metres";

/// A model in memory, in the types of a scene: what a glTF file brings to it, and what
/// [`write_glb`] writes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Model {
    /// Shapes, shared by objects.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shapes in place; their indices refer to this model.
    pub objects: Vec<Object>,
    /// What the objects are made of.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub textures: Vec<Texture>,
    /// Lamps that are no surfaces.
    pub lamps: Vec<Lamp>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Structural members, in the order of their first node.
    pub members: Vec<Member>,
    /// Objects of steel whose nodes say where their axes run, by their indices.
    pub steel: Vec<(usize, SteelLine)>,
    /// What a user should know: assumptions, suspicious sizes, parts that were skipped.
    pub warnings: Vec<String>,
}

impl From<&Scene> for Model {
    fn from(scene: &Scene) -> Self {
        Self {
            meshes: scene.meshes.clone(),
            objects: scene.objects.clone(),
            materials: scene.materials.clone(),
            textures: scene.textures.clone(),
            lamps: scene.lamps.clone(),
            cameras: scene.cameras.clone(),
            members: scene.members.clone(),
            steel: Vec::new(),
            warnings: Vec::new(),
        }
    }
}
