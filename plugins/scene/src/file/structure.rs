//! What bears: members with their reinforcement, supports, loads, exposure, and what looks at them from inside.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::Damage;

/// A parametric member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Stable id, unique in the scene.
    pub id: String,
    /// Name, for people; the id where there is none.
    #[serde(default)]
    pub name: String,
    /// What it is, with its measures.
    pub body: Body,
    /// Start of its axis (middle of the foot of a column, of the left end of a beam, centre of a tunnel's near portal), m.
    #[serde(default)]
    pub at: Vec3,
    /// Turned about the vertical, degrees about +y.
    #[serde(default)]
    pub turn_deg: f32,
    /// Class of Eurocode 2 such as `C30/37`, or a name from `concretes`. Where there is none, C30/37 is assumed and marked so.
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

/// The shapes of parametric members.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// A round tunnel along +z: from outside in, ground, a ring of segments, a cushion layer, an inner lining. The inner lining has the member's id,
    /// a segment `ID/R1/S1` (ring, segment, both from 1). At least one of `segments` and `inner_lining` is there.
    Tunnel {
        /// Radius of the intrados, the innermost face, m.
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
        /// What lies around it; no mesh.
        #[serde(default)]
        ground: Option<Ground>,
    },
}

/// Solid cross-sections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bond {
    /// They move with the concrete around them.
    #[default]
    Perfect,
    /// They slip by the law of the CEB (fib Model Code 2010 §6.1.1, good conditions), anchored at their ends.
    Slip,
}

impl Body {
    /// Bars and stirrups of a bar-shaped member.
    #[must_use]
    pub fn reinforcement(&self) -> Option<&Reinforcement> {
        match self {
            Self::Column { reinforcement, .. } | Self::Beam { reinforcement, .. } | Self::BoxGirder { reinforcement, .. } => {
                reinforcement.as_ref()
            }
            Self::Tunnel { .. } => None,
        }
    }
}

fn b500() -> String {
    "B500B".into()
}

/// Longitudinal bars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Bars {
    /// Evenly around the section, corners first.
    Around {
        /// How many.
        count: u32,
        /// Of one bar, mm.
        diameter_mm: f32,
    },
    /// A row along one side.
    Row {
        /// Which side: 0, 90, 180 or 270 degrees about the axis.
        side_deg: f32,
        /// How many.
        count: u32,
        /// Of one bar, mm.
        diameter_mm: f32,
    },
}

/// Stirrups or hoops.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stirrups {
    /// Of the bar, mm.
    pub diameter_mm: f32,
    /// From one to the next, mm.
    pub spacing_mm: f32,
}

/// A post-tensioned tendon along a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tendon {
    /// Name, unique within the member.
    pub name: String,
    /// Its line: (along 0 to 1, towards angle 0 in m, towards angle 90 in m), from the centre of the section's bounding box. Smooth between the points.
    pub line: Vec<Vec3>,
    /// Outer diameter of the duct, mm.
    pub duct_mm: f32,
    /// How it is stressed.
    pub prestress: Prestress,
}

/// How a tendon is stressed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// Whether it is stressed from both ends.
    #[serde(default)]
    pub both_ends: bool,
    /// Whether the duct is grouted.
    #[serde(default)]
    pub bonded: bool,
    /// Edge of the bearing plates at its ends, mm; else what keeps the pressure under them at 1.1 f_cm of the day of stressing.
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

/// Rings of precast segments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
}

/// A dry joint: no tension, Coulomb friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiningBars {
    /// Around each face.
    pub count: u32,
    /// mm.
    pub diameter_mm: f32,
}

/// Ring tendons, one turn each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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

/// The ground around a tunnel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// How it is modelled.
    pub model: GroundModel,
    /// From the tunnel's axis to the surface, m.
    #[serde(default)]
    pub cover_m: f32,
    /// Unit weight, kN/m³.
    #[serde(default)]
    pub weight_kn_m3: f32,
    /// Horizontal over vertical stress at rest.
    #[serde(default)]
    pub lateral_ratio: f32,
    /// From the tunnel's axis to the water table, m; negative below.
    #[serde(default)]
    pub water_m: Option<f32>,
}

/// How ground is modelled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum GroundModel {
    /// Springs that take compression only.
    Springs {
        /// Radial, MPa/m.
        radial_mpa_m: f32,
        /// Tangential, MPa/m.
        #[serde(default)]
        tangential_mpa_m: f32,
    },
    /// A solid ring.
    Solid {
        /// Young's modulus, MPa.
        youngs_mpa: f32,
        /// Poisson's ratio.
        poisson: f32,
        /// How much of it is modelled, m.
        thickness_m: f32,
    },
}

/// A concrete that is no class of Eurocode 2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Concrete {
    /// Name that members refer to.
    pub name: String,
    /// Characteristic cylinder strength, MPa. What is not given follows from it by Eurocode 2.
    pub fck_mpa: f32,
    /// Mean tensile strength, MPa.
    #[serde(default)]
    pub fctm_mpa: Option<f32>,
    /// Secant modulus, GPa.
    #[serde(default)]
    pub ecm_gpa: Option<f32>,
    /// Standard error of that modulus where it was measured, GPa; without it the modulus counts as assumed, wherever it matters how sure it is.
    #[serde(default)]
    pub ecm_error_gpa: Option<f32>,
    /// Poisson's ratio.
    #[serde(default)]
    pub poisson: Option<f32>,
    /// kg/m³.
    #[serde(default)]
    pub density_kg_m3: Option<f32>,
    /// Fracture energy, N/m.
    #[serde(default)]
    pub fracture_n_m: Option<f32>,
    /// Cement class of Eurocode 2.
    #[serde(default)]
    pub cement: Cement,
    /// Heat that it makes while it hardens; none: none is computed.
    #[serde(default)]
    pub hydration: Option<Hydration>,
}

/// Heat of hydration: Q(t) = cement · heat · (1 − exp(−t/time)), t at 20 °C.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hydration {
    /// Cement in the concrete, kg/m³.
    pub cement_kg_m3: f32,
    /// Heat of the cement, kJ/kg.
    #[serde(default = "heat")]
    pub heat_kj_kg: f32,
    /// Time in which 63 % of it comes at 20 °C, days.
    #[serde(default = "a_day")]
    pub time_days: f32,
}

fn heat() -> f32 {
    350.0
}

fn a_day() -> f32 {
    1.0
}

/// Cement classes of Eurocode 2: how fast it hardens.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cement {
    /// Slow.
    S,
    /// Normal.
    #[default]
    N,
    /// Rapid.
    R,
}

/// A part that is poured at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pour {
    /// From, on the axis, 0 to 1.
    pub from: f32,
    /// To, on the axis, 0 to 1.
    pub to: f32,
    /// Which angles, degrees; all around where there is none.
    #[serde(default)]
    pub angles_deg: Option<(f32, f32)>,
    /// When.
    pub at_days: f32,
    /// Fresh concrete, °C.
    #[serde(default = "twenty")]
    pub temperature_c: f32,
}

fn twenty() -> f32 {
    20.0
}

/// What attacks a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exposure {
    /// Class of EN 206, for example `XD3`; or several, `XC4, XD3, XF4`.
    pub class: String,
    /// Chlorides, from de-icing salt or sea water. Without them the class alone speaks: salt in XD and XS, carbonic acid in XC, by assumed values.
    #[serde(default)]
    pub chloride: Option<Chloride>,
    /// How long until now, years.
    #[serde(default)]
    pub years: f32,
}

impl Exposure {
    /// The classes that EN 206 knows.
    pub const CLASSES: [&str; 18] =
        ["X0", "XC1", "XC2", "XC3", "XC4", "XD1", "XD2", "XD3", "XS1", "XS2", "XS3", "XF1", "XF2", "XF3", "XF4", "XA1", "XA2", "XA3"];

    /// Its classes one by one.
    pub fn classes(&self) -> impl Iterator<Item = &str> {
        self.class.split(|c: char| !c.is_ascii_alphanumeric()).filter(|c| !c.is_empty())
    }
}

/// Diffusion of chlorides, C = C₀ + (C_s − C₀)(1 − erf(x / 2√(D t))), D = D₂₈ (28 d / t)^a, and what they do to steel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chloride {
    /// C_s, % of binder mass.
    pub surface_percent: f32,
    /// C₀, % of binder mass.
    #[serde(default)]
    pub initial_percent: f32,
    /// D at 28 days, 1e-12 m²/s.
    pub diffusion_1e12_m2_s: f32,
    /// a.
    #[serde(default)]
    pub ageing: f32,
    /// At which steel begins to corrode, % of binder mass.
    #[serde(default = "critical")]
    pub critical_percent: f32,
    /// Corrosion current afterwards, µA/cm².
    #[serde(default = "current")]
    pub current_ua_cm2: f32,
}

fn critical() -> f32 {
    0.6
}

fn current() -> f32 {
    1.0
}

/// CT slices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Slices {
    /// Image files. Masks lie beside them as `STEM_mask-*.EXT`, nonzero = pore.
    Files {
        /// Name of the core.
        name: String,
        /// Paths relative to the scene file; `*` and `?` in the last part; may begin with `${INTRADOS_DATA}`.
        images: Vec<String>,
        /// Edge of a pixel, mm; if absent, what the files tell.
        #[serde(default)]
        pixel_mm: Option<f32>,
        /// Where on the axis it was drilled or sawn, 0 to 1; if absent, it may have been anywhere.
        #[serde(default)]
        along: Option<f32>,
        /// Direction from the axis in which the face lies that it was drilled into, in degrees.
        #[serde(default)]
        angle_deg: Option<f32>,
        /// Depth of the slices below that face, m.
        #[serde(default)]
        depth_m: Option<f32>,
        /// Diameter of the core, mm; absent of whole sections.
        #[serde(default)]
        diameter_mm: Option<f32>,
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

/// More about a member that a glTF file or a lining brought.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Detail {
    /// Its id.
    pub member: String,
    /// Its concrete.
    #[serde(default)]
    pub concrete: Option<String>,
    /// What attacks it.
    #[serde(default)]
    pub exposure: Option<Exposure>,
    /// CT slices, added to those it has.
    #[serde(default)]
    pub slices: Vec<Slices>,
    /// Damage, added to what it has.
    #[serde(default)]
    pub truth: Vec<Damage>,
}

/// A place on a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Place {
    /// The section where the axis starts.
    Start,
    /// The section where it ends.
    End,
    /// The section at this share of the axis, 0 to 1.
    Section(f32),
    /// The surface within these bounds; where they are equal a line across it, as of a bearing that lets a beam turn.
    Surface {
        /// From, on the axis, 0 to 1.
        from: f32,
        /// To, on the axis, 0 to 1.
        to: f32,
        /// Which side, degrees about the axis; all around where there is none.
        #[serde(default)]
        side_deg: Option<f32>,
    },
    /// Its faces that look up.
    Top,
    /// Its faces that look down.
    Bottom,
    /// All of it.
    Whole,
}

/// What holds a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Id of the member.
    pub member: String,
    /// The place on its member.
    pub place: Place,
    /// How.
    pub hold: Hold,
}

/// How a support holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Hold {
    /// Every displacement.
    Fixed,
    /// These displacements of the world.
    Directions {
        /// Along x.
        x: bool,
        /// Along y.
        y: bool,
        /// Along z.
        z: bool,
    },
    /// Elastically, across the surface, MPa/m.
    Springs {
        /// Along x, y, z.
        stiffness_mpa_m: Vec3,
        /// Whether the surface may lift off, as a footing does from soil.
        #[serde(default)]
        lifts: bool,
    },
}

/// What a member carries. The factor follows `history`, linear between its points and constant outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Name, unique in the scene.
    pub name: String,
    /// Ids of the members it acts on; empty: all.
    #[serde(default)]
    pub members: Vec<String>,
    /// What acts.
    pub action: Action,
    /// (day, factor), days ascending; factor 1 from day 0 where there is none.
    #[serde(default)]
    pub history: Vec<(f32, f32)>,
}

/// What a load does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Action {
    /// Weight under gravity.
    SelfWeight,
    /// A force in all, spread over the place.
    Force {
        /// The place on its member.
        place: Place,
        /// In the world, kN.
        force_kn: Vec3,
    },
    /// A force per length of the axis.
    Line {
        /// From, on the axis, 0 to 1.
        #[serde(default)]
        from: f32,
        /// To, on the axis, 0 to 1.
        #[serde(default = "end")]
        to: f32,
        /// In the world, kN/m.
        force_kn_m: Vec3,
    },
    /// Against the surface, positive towards the concrete.
    Pressure {
        /// The place on its member.
        place: Place,
        /// kPa.
        pressure_kpa: f32,
    },
    /// Water or gas inside a tunnel.
    InnerPressure {
        /// kPa.
        pressure_kpa: f32,
    },
    /// A given displacement.
    Displacement {
        /// The place on its member.
        place: Place,
        /// In the world, mm.
        displacement_mm: Vec3,
    },
    /// Air that is warmer than the climate; heat is conducted into the concrete, through films of EN ISO 6946 (7.7 W/(m²K) inside, 25 outside).
    Air {
        /// At the side at 0 degrees (inside, for a tunnel), K.
        #[serde(default)]
        inside_k: f32,
        /// At all others, K.
        #[serde(default)]
        outside_k: f32,
    },
    /// Warmer than when built.
    Temperature {
        /// Everywhere, K.
        #[serde(default)]
        uniform_k: f32,
        /// The side at 0 degrees (inside, for a tunnel) more than the opposite, K.
        #[serde(default)]
        difference_k: f32,
    },
}

fn end() -> f32 {
    1.0
}

/// A load test: what acts, for a short while, so that gauges are read before and after. It takes no part in the life of the member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// Name, unique in the scene; readings refer to it.
    pub name: String,
    /// Id of the member that it acts on.
    pub member: String,
    /// What acts, all of it at once.
    pub actions: Vec<Action>,
}

/// A gauge on or in a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Name, unique among gauges and meters.
    pub name: String,
    /// Id of the member.
    pub member: String,
    /// Place on the axis, 0 to 1.
    pub along: f32,
    /// Side, degrees about the axis.
    pub angle_deg: f32,
    /// Below the surface, mm.
    #[serde(default)]
    pub depth_mm: f32,
    /// What it measures.
    pub measures: Measures,
}

/// What a gauge measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Measures {
    /// Normal strain along a direction of the member's frame.
    Strain(Direction),
    /// Normal stress along a direction of the member's frame, Pa.
    Stress(Direction),
    /// Displacement along a direction of the world, m.
    Displacement(Vec3),
}

/// Directions of a member's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Direction {
    /// Along the axis.
    Axial,
    /// Away from the axis.
    Radial,
    /// Around the axis.
    Hoop,
}

/// What a gauge or a meter was read to show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Name of the gauge or meter.
    pub of: String,
    /// Name of the load test of which it is the effect: what the gauge reads under it less what it read before. None: all that has happened so far.
    #[serde(default)]
    pub test: Option<String>,
    /// In SI units.
    pub value: f64,
    /// Of the value.
    pub std_error: f64,
    /// When.
    #[serde(default)]
    pub at_days: f32,
}

/// Air about the members.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Climate {
    /// Relative, %.
    #[serde(default = "humidity")]
    pub humidity_percent: f32,
    /// °C.
    #[serde(default = "twenty")]
    pub temperature_c: f32,
}

fn humidity() -> f32 {
    65.0
}

impl Default for Climate {
    fn default() -> Self {
        Self { humidity_percent: humidity(), temperature_c: twenty() }
    }
}

/// A grading profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grading {
    /// Name of a bundled profile, or path of one.
    pub profile: String,
}

/// An X-ray scanner: tube, detector, orbit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// Name.
    pub name: String,
    /// Ids of the members it scans.
    pub members: Vec<String>,
    /// The source.
    pub tube: Tube,
    /// The detector.
    pub detector: Detector,
    /// How both go round.
    pub orbit: Orbit,
}

/// An X-ray tube.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tube {
    /// kV.
    pub voltage_kv: f32,
    /// Filters, (metal, mm).
    #[serde(default)]
    pub filters: Vec<(String, f32)>,
    /// Current times exposure of one projection, mAs.
    #[serde(default = "charge")]
    pub charge_mas: f32,
    /// Focal spot, mm.
    #[serde(default)]
    pub focus_mm: f32,
}

fn charge() -> f32 {
    10.0
}

/// An X-ray detector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Detector {
    /// Pixels across.
    pub width: u32,
    /// Pixels along the axis.
    pub height: u32,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
}

/// A circular orbit about a member's axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbit {
    /// How many.
    pub projections: u32,
    /// Degrees in all.
    #[serde(default = "full_turn")]
    pub arc_deg: f32,
    /// Focus to axis, m.
    pub source_m: f32,
    /// Axis to detector, m.
    pub detector_m: f32,
    /// Places of the orbit's plane on the axis, 0 to 1.
    #[serde(default = "middle")]
    pub along: Vec<f32>,
}

fn full_turn() -> f32 {
    360.0
}

fn middle() -> Vec<f32> {
    vec![0.5]
}
