//! From the members of a scene to models: mesh, materials, steel, ground, supports, loads and
//! gauges.
//!
//! Every member is a model of its own; a tunnel's lining and its segments are one. Meshes are built
//! in the member's own frame (x towards angle 0, y towards 90, z along the axis) and put into the
//! world. Members of glTF files are filled with cubes in the axes of their own node.

mod act;
mod anchor;
mod body;
mod gauge;
mod handed;
pub(crate) mod imported;
pub(crate) mod matter;
mod steel;
mod warmth;

pub(crate) use act::{GRAVITY, UP_TO_SYMMETRY};
pub use handed::Handed;
pub(crate) use handed::{HandedLoad, Push};
pub use matter::{ElasticMatter, elastic};

use glam::DVec3;
use intrados_scene::{Assembly, Frame, MemberKind, Scene};
use intrados_stage::Job;
use warmth::Air;

use crate::{
    element::embed::EmbedError,
    material::{
        self, DAY,
        durability::{Corrosion, CorrosionError},
    },
    mesh::{
        HexFace, MeshError,
        voxel::{GeometricError, VoxelError},
    },
    model::{Failure, Gauge, Model},
    prestress::PrestressError,
};

/// How finely a member is cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Meshing {
    /// Largest edge of an element, m; `None`: a quarter of the smallest measure of the section,
    /// coarser where there would be very many, but of a beam five over its depth, of a column over
    /// both sides.
    pub element: Option<f64>,
}

/// A member made ready to be computed.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// Id of the member.
    pub id: String,
    /// What is computed.
    pub model: Model,
    /// When it is at rest, s.
    pub begin: f64,
    /// Moments to stop at, s, ascending, from the beginning on.
    pub times: Vec<f64>,
    /// Members that the model holds, with their bricks.
    pub parts: Vec<Part>,
    /// A point of the axis and its direction, where it has one to go round.
    pub axis: Option<[DVec3; 2]>,
    /// Along the member, of length 1.
    pub direction: DVec3,
    /// Faces in planes of symmetry, in order: what is computed ends there, concrete does not.
    pub mirrored: Vec<HexFace>,
    /// Loads that are raised after its life until it fails.
    pub raised: Option<Raised>,
    /// Gauges by name.
    pub gauges: Vec<(String, Gauge)>,
    /// What a user must know before believing what comes of it: what was given and is not used.
    pub warnings: Vec<String>,
    /// What attacks the steel, from [`Prepared::attacked`] on; or why nothing of that is computed.
    pub corrosion: Result<Corrosion, CorrosionError>,
    /// When that begins, s.
    pub attacked: f64,
    /// What a user should know: assumptions, and what was left out.
    pub notes: Vec<String>,
}

/// Loads that are raised, and along what.
#[derive(Debug, Clone, PartialEq)]
pub struct Raised {
    /// Which, of the model's.
    pub loads: Vec<usize>,
    /// Along what.
    pub along: Along,
    /// How far.
    pub to: Reach,
}

/// How far loads are raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reach {
    /// Until the member has failed, which tells how.
    #[default]
    Failure,
    /// Until it is clear how it fails; where bars yield first it is not asked how far they stretch.
    Mode,
    /// No farther than its peak needs to be known.
    Peak,
}

/// What grows from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Along {
    /// The displacement of the loaded nodes; the arc where that finds nothing more.
    #[default]
    Automatic,
    /// The displacement of the loaded nodes, up to so much, m.
    Displacement(Option<f64>),
    /// The arc of all displacements.
    ArcLength,
}

impl Prepared {
    /// Raises loads after its life until it fails, whatever the scene says: those of the scene's
    /// `names`, as they act on it directly and through the rest of the structure. False: none of
    /// them acts on it.
    pub fn raise(&mut self, names: &[&str], along: Along) -> bool {
        let loads = raised_by(&self.model, names);
        let acts = !loads.is_empty();
        if acts {
            self.raised = Some(Raised { loads, along, to: Reach::default() });
        }
        acts
    }

    /// Takes away what is known to be lost, from the beginning of its life on: by brick the share
    /// of concrete that bears nothing, and the share of the steel's section in it that is gone.
    /// Rust that would be computed does not come on top.
    pub fn weaken(&mut self, lost: impl Fn(u32) -> Weakening) {
        let bricks = self.model.mesh.hexes.len() as u32;
        self.model.softening =
            (0..bricks).map(|hex| lost(hex).concrete.clamp(0.0, MOST_LOST)).collect();
        for steel in &mut self.model.steel {
            steel.rust = None;
            steel.gone = steel
                .pieces
                .iter()
                .map(|piece| lost(piece.host as u32).steel.clamp(0.0, MOST_LOST))
                .collect();
        }
    }
}

/// What is lost of a place, shares from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Weakening {
    /// Of the concrete: it bears nothing.
    pub concrete: f64,
    /// Of the steel's section.
    pub steel: f64,
}

/// What is lost of a place at most: what is left hangs together.
const MOST_LOST: f64 = 0.99;

/// Numbers of a model's loads that come from these of the scene.
fn raised_by(model: &Model, names: &[&str]) -> Vec<usize> {
    let comes =
        |name: &str| names.iter().any(|n| name == *n || name.strip_suffix(FROM_WHOLE) == Some(*n));
    (0..model.loads.len()).filter(|&l| comes(&model.loads[l].name)).collect()
}

/// What is added to the name of a load that comes through the rest of the structure.
pub(crate) const FROM_WHOLE: &str = ", from the whole";

/// One member within a model: a column, a lining, a segment.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its id.
    pub id: String,
    /// What it is.
    pub kind: MemberKind,
    /// Its bricks.
    pub hexes: Vec<u32>,
    /// Whether steel of the model is its.
    pub has_steel: bool,
    /// Whether its concrete had to be assumed.
    pub assumed: bool,
    /// Of an imported member: how far its cubes are from its surface.
    pub geometry: Option<GeometricError>,
}

/// Why a member cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum MemberError {
    /// The mesh cannot be made.
    #[error("member {id}: {source}")]
    Mesh {
        /// Id of the member.
        id: String,
        /// What the system says.
        source: MeshError,
    },
    /// The surface of an imported member cannot be filled with cubes.
    #[error("member {id}: {source}")]
    Surface {
        /// Id of the member.
        id: String,
        /// What the system says.
        source: VoxelError,
    },
    /// The concrete cannot be.
    #[error("member {id}: {source}")]
    Material {
        /// Id of the member.
        id: String,
        /// What the system says.
        source: material::Error,
    },
    /// Steel does not lie in the concrete.
    #[error("member {id}, {line}: {source}")]
    Embed {
        /// Id of the member.
        id: String,
        /// Which bar.
        line: String,
        /// What the system says.
        source: EmbedError,
    },
    /// A tendon cannot be stressed so.
    #[error("member {id}, {line}: {source}")]
    Prestress {
        /// Id of the member.
        id: String,
        /// Which tendon.
        line: String,
        /// What the system says.
        source: PrestressError,
    },
    /// Heat cannot flow through it.
    #[error("member {id}: heat: {source}")]
    Heat {
        /// Id of the member.
        id: String,
        /// What the system says.
        source: Box<Failure>,
    },
    /// Something that this version does not compute.
    #[error("member {id}: {what}")]
    Unsupported {
        /// Id of the member.
        id: String,
        /// What, and what to do.
        what: String,
    },
}

/// Formwork and falsework bear fresh concrete until this age.
pub(crate) const STRIKE: f64 = 3.0 * DAY;

/// The axes of a member in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// Where the axis begins, m.
    pub start: DVec3,
    /// Unit: towards angle 0, towards angle 90, along.
    pub unit: [DVec3; 3],
    /// m.
    pub length: f64,
}

impl Axes {
    /// Those of a member with this frame.
    #[must_use]
    pub fn of(frame: &Frame) -> Self {
        let (axis, zero) = (frame.axis.as_dvec3(), frame.zero.as_dvec3());
        let along = axis.normalize_or_zero();
        // Exactly across, however the file's single precision turned it.
        let zero = zero.reject_from(along).normalize_or_zero();
        Self {
            start: frame.start.as_dvec3(),
            unit: [zero, along.cross(zero), along],
            length: axis.length(),
        }
    }

    pub(crate) fn world(&self, local: DVec3) -> DVec3 {
        self.start + local.x * self.unit[0] + local.y * self.unit[1] + local.z * self.unit[2]
    }

    /// Towards angle 0, towards angle 90 and along, m from the start.
    #[must_use]
    pub fn local(&self, world: DVec3) -> DVec3 {
        let p = world - self.start;
        DVec3::new(p.dot(self.unit[0]), p.dot(self.unit[1]), p.dot(self.unit[2]))
    }
}

/// What is known while a member is prepared.
pub(crate) struct Draft<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) member: &'a Assembly,
    pub(crate) axes: Axes,
    pub(crate) model: Model,
    pub(crate) warnings: Vec<String>,
    pub(crate) corrosion: Result<Corrosion, CorrosionError>,
    pub(crate) notes: Vec<String>,
    pub(crate) geometry: Option<GeometricError>,
    /// Warmer air, by load.
    pub(crate) air: Vec<Air>,
}

impl Draft<'_> {
    pub(crate) fn id(&self) -> String {
        self.member.id.clone()
    }

    pub(crate) fn unsupported(&self, what: impl Into<String>) -> MemberError {
        MemberError::Unsupported { id: self.id(), what: what.into() }
    }

    pub(crate) fn mesh_error(&self, source: MeshError) -> MemberError {
        MemberError::Mesh { id: self.id(), source }
    }

    pub(crate) fn is_tunnel(&self) -> bool {
        self.member.is_tunnel()
    }
}

/// Prepares an assembly of a scene: by its measures, or, where it came with a model, by the surface
/// of its objects.
///
/// # Errors
/// [`MemberError`]: of a surface that is open among others, with the place of its first open edge.
pub fn prepare(
    scene: &Scene,
    assembly: &Assembly,
    meshing: Meshing,
    job: &Job,
) -> Result<Prepared, MemberError> {
    draft(scene, assembly, meshing, job)?.prepare(meshing, None, job)
}

/// [`prepare`] as part of a structure: the others do to it what is handed to it, and its supports
/// in the scene are part of that; by itself where nothing is handed.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_within(
    scene: &Scene,
    assembly: &Assembly,
    handed: Option<&Handed>,
    meshing: Meshing,
    job: &Job,
) -> Result<Prepared, MemberError> {
    draft(scene, assembly, meshing, job)?.prepare(meshing, handed, job)
}

/// Edge of the largest brick in which the concrete of an assembly keeps its fracture energy, m;
/// none where nothing is known of that concrete, or where it is of none.
#[must_use]
pub fn largest_element(scene: &Scene, assembly: &Assembly) -> Option<f64> {
    if elastic(assembly).is_some() {
        return None;
    }
    matter::properties(scene, &assembly.concrete).ok().map(|p| p.largest_element())
}

fn draft<'a>(
    scene: &'a Scene,
    assembly: &'a Assembly,
    meshing: Meshing,
    job: &Job,
) -> Result<Draft<'a>, MemberError> {
    match &assembly.body {
        Some(_) => Ok(Draft::new(scene, assembly, Axes::of(&assembly.frame))),
        None => imported::fill(scene, assembly, meshing, job),
    }
}

impl<'a> Draft<'a> {
    fn new(scene: &'a Scene, member: &'a Assembly, axes: Axes) -> Self {
        let temperature = 273.15 + f64::from(scene.structure.climate.temperature_c);
        let model = Model { temperature, ..Model::default() };
        Self {
            scene,
            member,
            axes,
            model,
            warnings: Vec::new(),
            corrosion: Err(CorrosionError::NoBars),
            notes: Vec::new(),
            geometry: None,
            air: Vec::new(),
        }
    }

    fn prepare(
        mut self,
        meshing: Meshing,
        handed: Option<&Handed>,
        job: &Job,
    ) -> Result<Prepared, MemberError> {
        self.build(meshing)?;
        self.give_matter()?;
        self.lay_steel()?;
        self.surround()?;
        match handed {
            Some(handed) => {
                self.hold_lightly()?;
                self.load()?;
                self.take(handed)?;
            }
            None => {
                self.hold()?;
                self.load()?;
            }
        }
        let (parts, gauges, times) = (self.parts(), self.gauges(), self.times());
        self.warm(&times, job)?;
        let axis = self.is_tunnel().then_some([self.axes.start, self.axes.unit[2]]);
        let begin = times.first().copied().unwrap_or(0.0);
        let attacked = self.birth();
        let (raised, direction) = (self.raised(), self.axes.unit[2]);
        let mirrored = self.mirrored();
        if !mirrored.is_empty() {
            self.notes.push(UP_TO_SYMMETRY.into());
        }
        Ok(Prepared {
            id: self.id(),
            axis,
            direction,
            mirrored,
            raised,
            model: self.model,
            begin,
            times,
            parts,
            gauges,
            corrosion: self.corrosion,
            attacked,
            warnings: self.warnings,
            notes: self.notes,
        })
    }
}
