//! Structural members, their CT slices and their planted damage.

use std::path::PathBuf;

use bevy_ecs::component::Component;
use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::structure::{Date, Exposure};

/// One structural member, the unit that damage is predicted for.
#[derive(Component, Debug, Clone, PartialEq)]
pub struct Member {
    /// Stable id (an IFC GlobalId where there is one), unique in the scene.
    pub id: String,
    /// Name, for people.
    pub name: String,
    /// What it is.
    pub kind: MemberKind,
    /// Concrete class, for example `"C30/37"`.
    pub concrete: String,
    /// Whether the class had to be assumed.
    pub concrete_assumed: bool,
    /// What attacks it, by what the scene says of it or of the assembly that it is part of.
    pub exposure: Option<Exposure>,
    /// Its axis, and where angles about it begin.
    pub frame: Frame,
    /// Corners of its bounding box, m.
    pub bounds: [Vec3; 2],
    /// Concrete volume, m³ (of the outline; reinforcement is not subtracted). 0 where the mesh is
    /// open.
    pub volume: f64,
    /// CT slices of cores or sections of it.
    pub slices: Vec<Slices>,
    /// Planted or known damage, for experiments.
    pub truth: Vec<Damage>,
}

/// A member's own frame: r-θ-z for round ones. `along` 0 is at `start`, 1 at `start + axis`;
/// `angle_deg` 0 is towards `zero`, 90 towards `axis × zero`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Frame {
    /// Where the axis starts, m.
    pub start: Vec3,
    /// From the start to the end of the member, m.
    pub axis: Vec3,
    /// Unit, across the axis.
    pub zero: Vec3,
}

/// Cosine between the axis of what stands and the vertical.
const UPRIGHT: f32 = 0.7;

impl Frame {
    /// The frame of a member of which only its kind and its box are known. Upright members have
    /// their axis up and their zero along +z; lying ones have it along the longer of x and z.
    #[must_use]
    pub fn of_box(kind: MemberKind, bounds: [Vec3; 2]) -> Self {
        let (low, size) = (bounds[0], bounds[1] - bounds[0]);
        let middle = low + 0.5 * size;
        let (axis, zero) = match kind {
            MemberKind::Column | MemberKind::Wall | MemberKind::Footing => {
                (Vec3::Y * size.y, Vec3::Z)
            }
            MemberKind::Lining | MemberKind::Segment if size.z >= size.x => {
                (Vec3::Z * size.z, Vec3::X)
            }
            _ if size.x >= size.z => (Vec3::X * size.x, Vec3::Y),
            _ => (Vec3::Z * size.z, Vec3::X),
        };
        Self { start: middle - 0.5 * axis, axis, zero }
    }

    /// Whether it stands: its axis is nearer to the upright than 45°, about.
    #[must_use]
    pub fn is_upright(&self) -> bool {
        self.axis.normalize_or_zero().y.abs() > UPRIGHT
    }

    /// Unit, towards 90 degrees.
    #[must_use]
    pub fn ninety(&self) -> Vec3 {
        self.axis.normalize_or_zero().cross(self.zero)
    }

    /// A point of the axis.
    #[must_use]
    pub fn point(&self, along: f32) -> Vec3 {
        self.start + along * self.axis
    }

    /// Unit, away from the axis.
    #[must_use]
    pub fn radial(&self, angle_deg: f32) -> Vec3 {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        cos * self.zero + sin * self.ninety()
    }
}

/// The kinds of member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, PartialOrd, Ord)]
#[serde(rename_all = "snake_case")]
pub enum MemberKind {
    /// Vertical, compressed.
    Column,
    /// Horizontal, bent.
    Beam,
    /// Flat, horizontal.
    Slab,
    /// Flat, vertical.
    Wall,
    /// Below ground, under a column.
    Footing,
    /// A tunnel's inner shell.
    Lining,
    /// One precast piece of a lining's ring.
    Segment,
    /// A prestressing tendon.
    Tendon,
    /// A reinforcing bar or stirrup.
    Bar,
    /// A pipe.
    Pipe,
    /// Anything else.
    Other,
}

/// Where on a member a core was drilled or a section sawn, as far as it is known.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Drilled {
    /// When.
    pub date: Option<Date>,
    /// Place on the axis, 0 to 1.
    pub along: Option<f32>,
    /// Direction of the face from the axis, degrees.
    pub angle_deg: Option<f32>,
    /// Depth below that face, m.
    pub depth_m: Option<f32>,
    /// Diameter of the core, mm; none of a whole section.
    pub diameter_mm: Option<f32>,
    /// Which way the member's axis runs in the pictures; none: nobody said.
    pub axis: Option<AxisRuns>,
}

/// Which way a member's axis runs in a picture of its inside, or in a pile of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AxisRuns {
    /// To the right: sections along the member.
    Right,
    /// Downwards: sections along the member.
    Down,
    /// Through the pictures: cross-sections.
    Through,
}

/// CT slices of a member: image files, or made from the planted truth, by drawing or by a simulated
/// scanner.
#[derive(Debug, Clone, PartialEq)]
pub enum Slices {
    /// Files, already found and readable, with masks where labels exist.
    Files {
        /// Name of the core.
        name: String,
        /// Slice images, TIFF or PNG.
        images: Vec<PathBuf>,
        /// Per image: label masks (nonzero = pore), OR-ed. Empty where unlabelled.
        masks: Vec<Vec<PathBuf>>,
        /// Edge of a pixel, mm; none: what the files tell.
        pixel_mm: Option<f32>,
        /// Where they come from.
        drilled: Drilled,
    },
    /// A volume: slices that lie behind each other.
    Stack {
        /// Name of the core.
        name: String,
        /// One file of all slices, or one of each in the order of the numbers in their names
        /// (of a DICOM series: of their places).
        images: Vec<PathBuf>,
        /// Edges of a voxel, mm: to the right, down, from slice to slice; none: what the files
        /// tell.
        voxel_mm: Option<[f32; 3]>,
        /// Where it comes from; `along` is its middle.
        drilled: Drilled,
    },
    /// Cross-sections drawn in the image domain from the member's truth ("drawn, not scanned").
    Drawn {
        /// Name of the core.
        name: String,
        /// How many slices, evenly along the member's axis.
        count: u32,
        /// Pixels across the (square) slice.
        size: u32,
        /// Edge of a pixel, mm.
        pixel_mm: f32,
        /// Seed of the drawing.
        seed: u64,
    },
    /// Sections that a scanner of the scene looks at, as simulated: X-rays through the planted
    /// truth.
    Scanned {
        /// Name of the sections.
        name: String,
        /// Name of the scanner.
        scanner: String,
        /// Places on the axis, 0 to 1.
        along: Vec<f32>,
        /// Seed of concrete and noise.
        seed: u64,
    },
}

impl Slices {
    /// Name of the core or sections.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Files { name, .. }
            | Self::Stack { name, .. }
            | Self::Drawn { name, .. }
            | Self::Scanned { name, .. } => name,
        }
    }
}

/// A planted or labelled damage. Places are in the member's own frame: `along` its axis 0 (start)
/// to 1 (end).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Damage {
    /// A crack: a surface across the member at `along`, `width_mm` wide, over `depth` (0..1) of the
    /// section from the side `angle_deg`.
    Crack {
        /// Place on the axis, 0 to 1.
        along: f32,
        /// Opening, mm.
        width_mm: f32,
        /// Share of the section it cuts, 0 to 1.
        depth: f32,
        /// Side it starts from, degrees about the axis.
        angle_deg: f32,
    },
    /// A region with pores: entrained and entrapped air.
    Voids {
        /// From, on the axis, 0 to 1.
        from: f32,
        /// To, on the axis, 0 to 1.
        to: f32,
        /// Volume share of air, 0 to 0.5.
        porosity: f32,
        /// Median pore diameter, mm.
        median_mm: f32,
    },
    /// Badly compacted concrete: connected voids between aggregate.
    Honeycomb {
        /// Place on the axis, 0 to 1.
        along: f32,
        /// Extent along the axis, m.
        length_m: f32,
        /// Volume share of air, 0 to 0.5.
        porosity: f32,
    },
    /// Cover fallen off the surface.
    Spall {
        /// Place on the axis, 0 to 1.
        along: f32,
        /// Side, degrees about the axis.
        angle_deg: f32,
        /// Diameter on the surface, m.
        diameter_m: f32,
        /// Depth, m.
        depth_m: f32,
    },
    /// Corroded reinforcement.
    Corrosion {
        /// From, on the axis, 0 to 1.
        from: f32,
        /// To, on the axis, 0 to 1.
        to: f32,
        /// Share of the bars' cross-section lost, 0 to 1.
        section_loss: f32,
    },
    /// A zone with reduced stiffness.
    Softened {
        /// From, on the axis, 0 to 1.
        from: f32,
        /// To, on the axis, 0 to 1.
        to: f32,
        /// Damage d, 0 to 1.
        damage: f32,
        /// The quarter of the section at this side, degrees about the axis; all of it where there
        /// is none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        side_deg: Option<f32>,
    },
}
