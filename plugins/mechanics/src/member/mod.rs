//! From the members of a scene to models: mesh, materials, steel, ground, supports, loads and gauges.
//!
//! Every parametric member is a model of its own; a tunnel's lining and its segments are one. Meshes are built in the member's own frame
//! (x towards angle 0, y towards 90, z along the axis) and put into the world.

mod act;
mod body;
mod gauge;
mod matter;
mod steel;

use glam::DVec3;
use intrados_scene::{
    MemberKind, Scene,
    file::{self, Body as Shape},
    parametric,
};

use crate::{
    element::embed::EmbedError,
    material::{self, DAY},
    mesh::MeshError,
    model::{Gauge, Model},
    prestress::PrestressError,
};

/// How finely a member is cut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Meshing {
    /// Largest edge of an element, m; `None`: a quarter of the smallest measure of the section, coarser where there would be very many.
    pub element: Option<f64>,
}

/// A member made ready to be computed.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// Id of the member.
    pub id: String,
    /// What is computed.
    pub model: Model,
    /// Moments to stop at, s, ascending; the first is the beginning.
    pub times: Vec<f64>,
    /// Members that the model holds, with their bricks.
    pub parts: Vec<Part>,
    /// A point of the axis and its direction, where it has one to go round.
    pub axis: Option<[DVec3; 2]>,
    /// Gauges by name.
    pub gauges: Vec<(String, Gauge)>,
    /// What a user should know: assumptions, and what was left out.
    pub notes: Vec<String>,
}

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
}

/// Why a member cannot be computed.
#[derive(Debug, thiserror::Error)]
pub enum MemberError {
    /// The mesh cannot be made.
    #[error("member {id}: {source}")]
    Mesh {
        /// Which.
        id: String,
        /// Why.
        source: MeshError,
    },
    /// The concrete cannot be.
    #[error("member {id}: {source}")]
    Material {
        /// Which.
        id: String,
        /// Why.
        source: material::Error,
    },
    /// Steel does not lie in the concrete.
    #[error("member {id}, {line}: {source}")]
    Embed {
        /// Which.
        id: String,
        /// Which bar.
        line: String,
        /// Why.
        source: EmbedError,
    },
    /// A tendon cannot be stressed so.
    #[error("member {id}, {line}: {source}")]
    Prestress {
        /// Which.
        id: String,
        /// Which tendon.
        line: String,
        /// Why.
        source: PrestressError,
    },
    /// Something that this version does not compute.
    #[error("member {id}: {what}")]
    Unsupported {
        /// Which.
        id: String,
        /// What, and what to do.
        what: String,
    },
}

/// Formwork and falsework bear fresh concrete until this age.
pub const STRIKE: f64 = 3.0 * DAY;

/// The axes of a member in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axes {
    pub(crate) start: DVec3,
    /// Unit: towards angle 0, towards angle 90, along.
    pub(crate) unit: [DVec3; 3],
    pub(crate) length: f64,
}

impl Axes {
    fn of(member: &file::Member) -> Self {
        let frame = parametric::frame(member);
        let (axis, zero) = (frame.axis.as_dvec3(), frame.zero.as_dvec3());
        let along = axis.normalize_or_zero();
        // Exactly across, however the file's single precision turned it.
        let zero = zero.reject_from(along).normalize_or_zero();
        Self { start: frame.start.as_dvec3(), unit: [zero, along.cross(zero), along], length: axis.length() }
    }

    pub(crate) fn world(&self, local: DVec3) -> DVec3 {
        self.start + local.x * self.unit[0] + local.y * self.unit[1] + local.z * self.unit[2]
    }

    pub(crate) fn local(&self, world: DVec3) -> DVec3 {
        let p = world - self.start;
        DVec3::new(p.dot(self.unit[0]), p.dot(self.unit[1]), p.dot(self.unit[2]))
    }
}

/// What is known while a member is prepared.
pub(crate) struct Draft<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) member: &'a file::Member,
    pub(crate) axes: Axes,
    pub(crate) model: Model,
    pub(crate) notes: Vec<String>,
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
        matches!(self.member.body, Shape::Tunnel { .. })
    }
}

/// Prepares one parametric member of a scene.
///
/// # Errors
/// [`MemberError`].
pub fn prepare(scene: &Scene, member: &file::Member, meshing: Meshing) -> Result<Prepared, MemberError> {
    let mut draft = Draft { scene, member, axes: Axes::of(member), model: Model::default(), notes: Vec::new() };
    draft.model.temperature = 273.15 + f64::from(scene.file.climate.temperature_c);
    draft.build(meshing)?;
    draft.give_matter()?;
    draft.lay_steel()?;
    draft.surround()?;
    draft.hold()?;
    draft.load()?;
    let parts = draft.parts();
    let gauges = draft.gauges();
    let times = draft.times();
    let axis = draft.is_tunnel().then_some([draft.axes.start, draft.axes.unit[2]]);
    Ok(Prepared { id: draft.id(), axis, model: draft.model, times, parts, gauges, notes: draft.notes })
}
