//! Members as they are written, and what is said of them elsewhere.

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Body, Exposure, Pour, Reinforcement};
use crate::{
    AxisRuns, Damage, Drilled,
    structure::{Date, Matter},
};

/// A parametric member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Stable id, unique in the scene.
    pub id: String,
    /// Name, for people; the id where there is none.
    #[serde(default)]
    pub name: String,
    /// What it is, with its measures.
    pub body: Body,
    /// Start of its axis (middle of the foot of a column, of the left end of a beam, centre of a
    /// tunnel's near portal), m.
    #[serde(default)]
    #[schemars(with = "[f32; 3]")]
    pub at: Vec3,
    /// Turned about the vertical, degrees about +y.
    #[serde(default)]
    pub turn_deg: f32,
    /// Class of Eurocode 2 such as `C30/37`, or a name from `concretes`. Where there is none,
    /// C30/37 is assumed and marked so.
    #[serde(default)]
    pub concrete: Option<String>,
    /// Material of its surface; assumed concrete where there is none.
    #[serde(default)]
    pub material: Option<String>,
    /// When its parts were poured, in this order. One pour at day 0 where there is none.
    #[serde(default)]
    pub pours: Vec<Pour>,
    /// What attacks it.
    #[serde(default)]
    pub exposure: Option<Exposure>,
    /// CT slices.
    #[serde(default)]
    pub slices: Vec<Slices>,
    /// Planted or known damage.
    #[serde(default)]
    pub truth: Vec<Damage>,
}

/// CT slices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Slices {
    /// Image files. Masks lie beside them as `STEM_mask-*.EXT`, nonzero = pore.
    Files {
        /// Name of the core.
        name: String,
        /// Paths relative to the scene file; `*` and `?` in the last part; may begin with
        /// `${INTRADOS_DATA}`.
        images: Vec<String>,
        /// Edge of a pixel, mm; if absent, what the files tell.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pixel_mm: Option<f32>,
        /// Where on the axis it was drilled or sawn, 0 to 1; if absent, it may have been anywhere.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<f32>,
        /// Direction from the axis in which the face lies that it was drilled into, in degrees.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        angle_deg: Option<f32>,
        /// Depth of the slices below that face, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        depth_m: Option<f32>,
        /// Diameter of the core, mm; absent of whole sections.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        diameter_mm: Option<f32>,
        /// Which way the member's axis runs in the pictures; if absent, they count as
        /// cross-sections.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<AxisRuns>,
        /// When it was drilled or sawn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        date: Option<Date>,
    },
    /// A volume: slices that lie behind each other, read across and along.
    Stack {
        /// Name of the core.
        name: String,
        /// One file of all slices (MetaImage, TIFF of many pages, DICOM of many frames), or
        /// patterns as of `Files`: slices in the order of the numbers in their names, a DICOM
        /// series in the order of its places.
        images: Vec<String>,
        /// Edges of a voxel, mm: to the right, down, from slice to slice; if absent, what the
        /// files tell.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        voxel_mm: Option<[f32; 3]>,
        /// Where on the axis its middle lies, 0 to 1; if absent, it may have been anywhere.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        along: Option<f32>,
        /// Direction from the axis in which the face lies that it was drilled into, in degrees.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        angle_deg: Option<f32>,
        /// Depth of its middle below that face, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        depth_m: Option<f32>,
        /// Diameter of the core, mm; absent of what was sawn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        diameter_mm: Option<f32>,
        /// Which way the member's axis runs in the pile of slices; if absent, a crack counts
        /// whichever way it runs.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<AxisRuns>,
        /// When it was drilled or sawn.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        date: Option<Date>,
    },
    /// Drawn from the planted truth, where no scanner would see through the member.
    Drawn {
        /// Name of the core.
        name: String,
        /// How many, evenly along the axis.
        count: u32,
        /// Pixels across.
        size: u32,
        /// Edge of a pixel, mm.
        pixel_mm: f32,
        /// Seed.
        #[serde(default)]
        seed: u64,
    },
    /// Scanned, as simulated, by one of the scene's scanners: of parametric members only.
    Scanned {
        /// Name of the sections.
        name: String,
        /// Name of the scanner.
        scanner: String,
        /// Places on the axis, 0 to 1.
        along: Vec<f32>,
        /// Seed of concrete and noise.
        #[serde(default)]
        seed: u64,
    },
}

impl Slices {
    /// Where slices of files come from, as far as somebody said; nothing of those that are made.
    pub(crate) fn drilled(&self) -> Drilled {
        match *self {
            Self::Files { along, angle_deg, depth_m, diameter_mm, axis, date, .. }
            | Self::Stack { along, angle_deg, depth_m, diameter_mm, axis, date, .. } => {
                Drilled { date, along, angle_deg, depth_m, diameter_mm, axis }
            }
            Self::Drawn { .. } | Self::Scanned { .. } => Drilled::default(),
        }
    }

    /// Name of the core or sections.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Files { name, .. }
            | Self::Stack { name, .. }
            | Self::Drawn { name, .. }
            | Self::Scanned { name, .. } => name,
        }
    }
}

/// More about a member that a glTF file or a lining brought.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Detail {
    /// Its id.
    pub member: String,
    /// Its concrete.
    #[serde(default)]
    pub concrete: Option<String>,
    /// Of a member that came with a model and is of no concrete: what it is of.
    #[serde(default)]
    pub matter: Option<Matter>,
    /// What attacks it.
    #[serde(default)]
    pub exposure: Option<Exposure>,
    /// Of a member that came with a model: the body by measures that it is computed as, about its
    /// own axis, in place of its surface. What is round gets its inside so (a `Tunnel`).
    #[serde(default)]
    pub body: Option<Body>,
    /// Of a member that came with a model: bars and stirrups in the box about its axis, beside
    /// those that the model brings. What lies outside of its concrete is left out.
    #[serde(default)]
    pub reinforcement: Option<Reinforcement>,
    /// What of this nobody has stated.
    #[serde(default)]
    pub assumed: Vec<Assumed>,
    /// CT slices, added to those it has.
    #[serde(default)]
    pub slices: Vec<Slices>,
    /// Damage, added to what it has.
    #[serde(default)]
    pub truth: Vec<Damage>,
}

/// What a detail gives by a rule, because nobody stated it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Assumed {
    /// Its class.
    Concrete,
    /// Its exposure class.
    Exposure,
    /// How long it has been exposed.
    Age,
    /// Its bars and stirrups with their cover.
    Reinforcement,
}

/// A grading profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grading {
    /// Name of a bundled profile, or path of one.
    pub profile: String,
}
