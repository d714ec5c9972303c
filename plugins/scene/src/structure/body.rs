//! Shapes of parametric members, with their bars and tendons.

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Ground;

/// The shapes of parametric members.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Body {
    /// Upright along +y.
    Column {
        /// Cross-section.
        section: Section,
        /// Along the axis, m.
        height_m: f32,
        /// Bars and stirrups.
        #[serde(default)]
        reinforcement: Option<Reinforcement>,
    },
    /// Lies along +x.
    Beam {
        /// Cross-section.
        section: Section,
        /// Along the axis, m.
        length_m: f32,
        /// Bars and stirrups.
        #[serde(default)]
        reinforcement: Option<Reinforcement>,
        /// Prestressing tendons along it.
        #[serde(default)]
        tendons: Vec<Tendon>,
    },
    /// A bridge girder with one cell, along +x.
    BoxGirder {
        /// Cross-section.
        section: BoxSection,
        /// Along the axis, m.
        length_m: f32,
        /// Bars and stirrups.
        #[serde(default)]
        reinforcement: Option<Reinforcement>,
        /// Prestressing tendons along it.
        #[serde(default)]
        tendons: Vec<Tendon>,
    },
    /// A round tunnel along +z: from outside in, ground, a ring of segments, a cushion layer, an
    /// inner lining, a steel pipe. The inner lining has the member's id, a segment `ID/R1/S1` (ring, segment,
    /// both from 1). At least one of `segments` and `inner_lining` is there.
    Tunnel {
        /// Radius of the intrados, the innermost face of concrete, m.
        radius_m: f32,
        /// Along the axis, m.
        length_m: f32,
        /// Precast rings.
        #[serde(default)]
        segments: Option<Segments>,
        /// Layer between segments and inner lining, mm: no tension, little friction.
        #[serde(default)]
        cushion_mm: f32,
        /// Cast inside the segments.
        #[serde(default)]
        inner_lining: Option<InnerLining>,
        /// Inside of the intrados: it takes the inner pressure, and hands on what it does not bear.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pipe: Option<Pipe>,
        /// What lies around it; no mesh.
        #[serde(default)]
        ground: Option<Ground>,
    },
}

/// Solid cross-sections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Section {
    /// A rectangle.
    Rectangle {
        /// Across: along x for a column, along z for a beam, m.
        width_m: f32,
        /// Along z for a column, upright for a beam, m.
        depth_m: f32,
    },
    /// A circle.
    Round {
        /// m.
        diameter_m: f32,
    },
}

/// A box girder's cross-section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxSection {
    /// Of the top slab, m.
    pub top_width_m: f32,
    /// Of the bottom slab, m; at most the top's.
    pub bottom_width_m: f32,
    /// From soffit to top, m.
    pub depth_m: f32,
    /// Thickness of the top slab, m.
    pub top_m: f32,
    /// Thickness of the bottom slab, m.
    pub bottom_m: f32,
    /// Thickness of each web, m.
    pub web_m: f32,
}

/// Reinforcement of a bar-shaped member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reinforcement {
    /// Concrete outside the outermost steel, mm.
    pub cover_mm: f32,
    /// Grade of bars and stirrups ([`Grade::named`]).
    #[serde(default = "b500")]
    pub steel: String,
    /// Yield stress where it is not the grade's: measured or agreed upon, MPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_y_mpa: Option<f32>,
    /// Longitudinal bars.
    pub bars: Vec<Bars>,
    /// Closed stirrups or hoops around the bars.
    #[serde(default)]
    pub stirrups: Option<Stirrups>,
    /// How longitudinal bars hold to the concrete.
    #[serde(default)]
    pub bond: Bond,
}

/// Bond of bars.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Bond {
    /// They move with the concrete around them; but lapped ones slip.
    #[default]
    Perfect,
    /// They slip by the law of the CEB (fib Model Code 2010 §6.1.1, good conditions), but where
    /// their ends are anchored.
    Slip,
}

/// How an end of a bar holds, where bars slip.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum BarEnd {
    /// By a plate, or beyond what is computed: it does not slip. At a face that is held along the
    /// axis it goes on into what holds that.
    #[default]
    Anchored,
    /// By a bend, a hook or a loop (EN 1992-1-1, 8.4.1): it does not slip either. The tenths of a
    /// millimetre by which a hook gives way are left out, and in compression, where 8.4.1 (3) counts
    /// no hook, the concrete before it holds as well. It is drawn, and seen by X-rays, as a hook of
    /// 90° that is bent inwards at the end of the bar.
    Hooked,
    /// By bond alone: it slips.
    Straight,
}

impl Body {
    /// Bars and stirrups of a bar-shaped member.
    #[must_use]
    pub fn reinforcement(&self) -> Option<&Reinforcement> {
        match self {
            Self::Column { reinforcement, .. }
            | Self::Beam { reinforcement, .. }
            | Self::BoxGirder { reinforcement, .. } => reinforcement.as_ref(),
            Self::Tunnel { .. } => None,
        }
    }
}

fn b500() -> String {
    "B500B".into()
}

/// A lap: over its length two bars lie side by side, and hand on their force by bond alone. Their
/// ends in it are straight, and lapped bars slip whatever `bond` says, since with perfect bond the
/// shortest lap would do.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lap {
    /// Its middle on the axis, 0 to 1.
    pub at: f32,
    /// From the end of one bar to the end of the other, mm.
    pub length_mm: f32,
}

impl Lap {
    /// From where to where it reaches on an axis of this length (m), 0 to 1.
    #[must_use]
    pub(crate) fn span(&self, length_m: f32) -> [f32; 2] {
        let half = 0.5 * self.length_mm / (1000.0 * length_m);
        [self.at - half, self.at + half]
    }
}

/// Longitudinal bars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Bars {
    /// Evenly around the section, corners first.
    Around {
        /// How many.
        count: u32,
        /// Of one bar, mm.
        diameter_mm: f32,
        /// Where they begin on the axis, 0 to 1. What begins or ends within 100 mm of a face that is
        /// held along the axis goes on into what holds it, but for straight ends.
        #[serde(default)]
        from: f32,
        /// Where they end on the axis (starter bars, curtailed bars), 0 to 1.
        #[serde(default = "whole")]
        to: f32,
        /// How their first and their last end hold, where they slip.
        #[serde(default)]
        ends: [BarEnd; 2],
        /// Where each of them is two bars, one of which takes over from the other: in their order
        /// along the axis.
        #[serde(default)]
        laps: Vec<Lap>,
    },
    /// A row along one side.
    Row {
        /// Which side: 0, 90, 180 or 270 degrees about the axis.
        side_deg: f32,
        /// How many.
        count: u32,
        /// Of one bar, mm.
        diameter_mm: f32,
        /// How much farther in than the first layer, mm: a second layer.
        #[serde(default)]
        inset_mm: f32,
        /// Where they begin on the axis, 0 to 1. What begins or ends within 100 mm of a face that is
        /// held along the axis goes on into what holds it, but for straight ends.
        #[serde(default)]
        from: f32,
        /// Where they end on the axis (starter bars, curtailed bars), 0 to 1.
        #[serde(default = "whole")]
        to: f32,
        /// How their first and their last end hold, where they slip.
        #[serde(default)]
        ends: [BarEnd; 2],
        /// Where each of them is two bars, one of which takes over from the other: in their order
        /// along the axis.
        #[serde(default)]
        laps: Vec<Lap>,
        /// Yield stress where it is another than that of the rest, MPa.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        f_y_mpa: Option<f32>,
    },
}

impl Bars {
    /// Bars around the section along the whole of the axis.
    #[must_use]
    pub fn around(count: u32, diameter_mm: f32) -> Self {
        Self::Around {
            count,
            diameter_mm,
            from: 0.0,
            to: 1.0,
            ends: [BarEnd::Anchored; 2],
            laps: Vec::new(),
        }
    }

    /// A layer of bars along the whole of one side.
    #[must_use]
    pub fn row(side_deg: f32, count: u32, diameter_mm: f32) -> Self {
        Self::Row {
            side_deg,
            count,
            diameter_mm,
            inset_mm: 0.0,
            from: 0.0,
            to: 1.0,
            ends: [BarEnd::Anchored; 2],
            laps: Vec::new(),
            f_y_mpa: None,
        }
    }

    /// How many bars, of what diameter, mm.
    #[must_use]
    pub fn size(&self) -> (u32, f32) {
        match *self {
            Self::Around { count, diameter_mm, .. } | Self::Row { count, diameter_mm, .. } => {
                (count, diameter_mm)
            }
        }
    }

    /// From where to where on the axis, 0 to 1.
    #[must_use]
    pub fn span(&self) -> [f32; 2] {
        match *self {
            Self::Around { from, to, .. } | Self::Row { from, to, .. } => [from, to],
        }
    }

    /// How their first and their last end hold, where they slip.
    #[must_use]
    pub fn ends(&self) -> [BarEnd; 2] {
        match *self {
            Self::Around { ends, .. } | Self::Row { ends, .. } => ends,
        }
    }

    /// Where they are lapped, in their order along the axis.
    #[must_use]
    pub fn laps(&self) -> &[Lap] {
        match self {
            Self::Around { laps, .. } | Self::Row { laps, .. } => laps,
        }
    }

    /// Area of all its bars together, m²; of lapped ones outside of their laps.
    #[must_use]
    pub fn area(&self) -> f32 {
        let (count, diameter_mm) = self.size();
        count as f32 * diameter_mm * diameter_mm * std::f32::consts::FRAC_PI_4 * 1e-6
    }
}

fn whole() -> f32 {
    1.0
}

/// Stirrups or hoops.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stirrups {
    /// Of the bar, mm.
    pub diameter_mm: f32,
    /// From one to the next, mm.
    pub spacing_mm: f32,
    /// Yield stress where it is another than that of the bars, MPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_y_mpa: Option<f32>,
}

/// A post-tensioned tendon along a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tendon {
    /// Name, unique within the member.
    pub name: String,
    /// Its line: (along 0 to 1, towards angle 0 in m, towards angle 90 in m), from the centre of
    /// the section's bounding box. Smooth between the points.
    #[schemars(with = "Vec<[f32; 3]>")]
    pub line: Vec<Vec3>,
    /// Outer diameter of the duct, mm.
    pub duct_mm: f32,
    /// How it is stressed.
    pub prestress: Prestress,
}

/// How a tendon is stressed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Prestress {
    /// Grade ([`StrandGrade::named`]).
    #[serde(default = "y1860")]
    pub steel: String,
    /// How many strands.
    pub strands: u32,
    /// Area of a strand, mm².
    #[serde(default = "strand")]
    pub strand_mm2: f32,
    /// At the jack, MPa.
    pub stress_mpa: f32,
    /// Day of stressing.
    #[serde(default)]
    pub at_days: f32,
    /// Friction coefficient μ of P = P₀ e^(−μ(θ + k s)).
    #[serde(default = "friction")]
    pub friction: f32,
    /// Wobble k, rad/m.
    #[serde(default = "wobble")]
    pub wobble_per_m: f32,
    /// Slip at the anchorage, mm.
    #[serde(default)]
    pub slip_mm: f32,
    /// Relaxation class of Eurocode 2, 1 to 3.
    #[serde(default = "relaxation")]
    pub relaxation_class: u8,
    /// Whether it is stressed from both ends, as what runs through a plane of symmetry is.
    #[serde(default)]
    pub both_ends: bool,
    /// Whether the duct is grouted.
    #[serde(default)]
    pub bonded: bool,
    /// Edge of the bearing plates at its ends, mm; else what keeps the pressure under them at 1.1
    /// f_cm of the day of stressing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plate_mm: Option<f32>,
}

fn y1860() -> String {
    "Y1860S7".into()
}

fn strand() -> f32 {
    140.0
}

fn friction() -> f32 {
    0.19
}

fn wobble() -> f32 {
    0.005
}

fn relaxation() -> u8 {
    2
}

/// So many rings a tunnel has at most; its check asks for fewer.
const MOST_RINGS: f32 = 20_000.0;

/// A steel pipe inside of a tunnel, with a soft layer about it. No picture and no slice shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pipe {
    /// Of its wall, mm.
    pub thickness_mm: f32,
    /// Soft layer between the pipe and the intrados, mm: no tension, little friction.
    #[serde(default)]
    pub cushion_mm: f32,
    /// Stress over strain of that layer across it, MPa; grouted or cast against the pipe, it does
    /// not matter.
    #[serde(default = "foam")]
    pub cushion_mpa: f32,
    /// When it is fitted, days; none: when the last pour bears.
    #[serde(default)]
    pub at_days: Option<f32>,
}

/// Of a foamed or bituminous sheet; tests on the product should replace it.
fn foam() -> f32 {
    5.0
}

/// Rings of precast segments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Segments {
    /// Segments a ring.
    pub count: u32,
    /// Length of a ring along the axis, m. The last one may be shorter.
    pub ring_m: f32,
    /// m.
    pub thickness_m: f32,
    /// Where the first joint of the first ring is, degrees.
    #[serde(default)]
    pub first_joint_deg: f32,
    /// How far the joints of every second ring are turned, degrees.
    #[serde(default)]
    pub stagger_deg: f32,
    /// Joints between segments and between rings.
    #[serde(default)]
    pub joint: Joint,
    /// Class, if not the member's.
    #[serde(default)]
    pub concrete: Option<String>,
    /// Bars of each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reinforcement: Option<Box<SegmentBars>>,
}

/// Bars of a segment, at both of its faces; they end in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentBars {
    /// Concrete outside the outermost steel, at faces and joints, mm.
    #[serde(default = "segment_cover")]
    pub cover_mm: f32,
    /// Grade ([`Grade::named`]).
    #[serde(default = "b500")]
    pub steel: String,
    /// Yield stress where it is not the grade's: measured or agreed upon, MPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_y_mpa: Option<f32>,
    /// Around the ring.
    #[serde(default)]
    pub hoops: Option<Stirrups>,
    /// Along the axis, inside of the hoops: how many at each face.
    #[serde(default)]
    pub bars: Option<LiningBars>,
}

fn segment_cover() -> f32 {
    40.0
}

/// A dry joint: no tension, Coulomb friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Gap as built, mm.
    #[serde(default = "gap")]
    pub gap_mm: f32,
    /// Normal stiffness, GPa/m.
    #[serde(default = "joint_stiffness")]
    pub stiffness_gpa_m: f32,
    /// Coefficient.
    #[serde(default = "joint_friction")]
    pub friction: f32,
}

fn gap() -> f32 {
    4.0
}

fn joint_stiffness() -> f32 {
    100.0
}

fn joint_friction() -> f32 {
    0.5
}

impl Default for Joint {
    fn default() -> Self {
        Self { gap_mm: gap(), stiffness_gpa_m: joint_stiffness(), friction: joint_friction() }
    }
}

/// The shell that is cast inside the segments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InnerLining {
    /// m.
    pub thickness_m: f32,
    /// Concrete outside the outermost steel, mm.
    #[serde(default = "lining_cover")]
    pub cover_mm: f32,
    /// Grade of hoops and bars ([`Grade::named`]).
    #[serde(default = "b500")]
    pub steel: String,
    /// Yield stress where it is not the grade's: measured or agreed upon, MPa.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_y_mpa: Option<f32>,
    /// Hoops at both faces.
    #[serde(default)]
    pub hoops: Option<Stirrups>,
    /// Bars along the axis, at both faces: how many around, and their diameter.
    #[serde(default)]
    pub bars: Option<LiningBars>,
    /// Prestressing around the lining.
    #[serde(default)]
    pub tendons: Option<RingTendons>,
}

fn lining_cover() -> f32 {
    50.0
}

/// Bars along a lining.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LiningBars {
    /// At each face.
    pub count: u32,
    /// mm.
    pub diameter_mm: f32,
}

/// Ring tendons, one turn each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RingTendons {
    /// From one to the next along the axis, m.
    pub spacing_m: f32,
    /// From the intrados to their centre line, m.
    pub depth_m: f32,
    /// Outer diameter of the duct, mm.
    pub duct_mm: f32,
    /// Where they are anchored, degrees, in turn.
    pub anchors_deg: Vec<f32>,
    /// How they are stressed.
    pub prestress: Prestress,
}

impl Segments {
    /// How many rings a tunnel of this length has; the last may be short.
    #[must_use]
    pub fn rings(&self, length_m: f32) -> u32 {
        (length_m / self.ring_m - 1e-3).ceil().clamp(1.0, MOST_RINGS) as u32
    }
}

impl Section {
    /// m².
    #[must_use]
    pub fn area(&self) -> f32 {
        match *self {
            Self::Rectangle { width_m, depth_m } => width_m * depth_m,
            Self::Round { diameter_m } => std::f32::consts::FRAC_PI_4 * diameter_m * diameter_m,
        }
    }
}

impl BoxSection {
    /// m².
    #[must_use]
    pub fn area(&self) -> f32 {
        let webs = 2.0 * self.web_m * (self.depth_m - self.top_m - self.bottom_m);
        self.top_width_m * self.top_m + self.bottom_width_m * self.bottom_m + webs
    }
}

impl Body {
    /// Area of a bar-shaped member's section, m².
    #[must_use]
    pub(crate) fn section_area(&self) -> Option<f32> {
        match self {
            Self::Column { section, .. } | Self::Beam { section, .. } => Some(section.area()),
            Self::BoxGirder { section, .. } => Some(section.area()),
            Self::Tunnel { .. } => None,
        }
    }

    /// Share of a bar-shaped member's section that is longitudinal bars.
    #[must_use]
    pub(crate) fn steel_share(&self) -> Option<f32> {
        Some(self.reinforcement()?.area() / self.section_area()?)
    }
}
