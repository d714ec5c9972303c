//! What holds members, and what they carry.

use glam::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A place on a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Place {
    /// The section where the axis starts.
    Start,
    /// The section where it ends.
    End,
    /// The section at this share of the axis, 0 to 1.
    Section(f32),
    /// Of a tunnel's steel pipe, the section at this share of the axis, 0 to 1.
    Pipe(f32),
    /// The surface within these bounds; where they are equal a line across it, as of a bearing that
    /// lets a beam turn.
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Id of the member.
    pub member: String,
    /// The place on its member.
    pub place: Place,
    /// How.
    pub hold: Hold,
    /// It stands for the rest of the structure: it holds the member where that is computed by
    /// itself, and is left out where the whole is.
    #[serde(default)]
    pub alone: bool,
}

/// How a support holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
        #[schemars(with = "[f32; 3]")]
        stiffness_mpa_m: Vec3,
        /// Whether the surface may lift off, as a footing does from soil.
        #[serde(default)]
        lifts: bool,
    },
    /// By its mirror image: its place, `Start` or `End`, is a plane of symmetry, and half of the
    /// member is computed. The section stays plane and moves within its plane alone. No heat and
    /// nothing that attacks steel comes through it, and a crack in it is not seen. Bars that end
    /// within 100 mm of it run on through it and do not slip there, whatever their `ends`; so do
    /// tendons, which are stressed from their other end: `both_ends` says so of the whole, whose
    /// friction is largest in the plane. Weight, loads and what the member bears are those of the
    /// half, and what acts on the face itself counts within its plane alone. Nothing is found that
    /// is not symmetric, such as buckling into an S.
    Symmetry,
}

/// How two members are joined. Members that touch are monolithic where nothing else is said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MemberJoint {
    /// Ids of the two members.
    pub of: (String, String),
    /// How.
    pub kind: JointKind,
}

/// What a joint hands over. It turns about the line in its face that is across the axis of the first
/// member that is a bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum JointKind {
    /// Everything: poured in one, or as good as.
    Monolithic,
    /// All but the moment about its line.
    Hinge,
    /// As a hinge, and it slides across its line: only pressure, and force along the line.
    Bearing,
    /// Nothing: members that touch and are not joined.
    Apart,
}

/// The ground around a tunnel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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

/// What a member carries. The factor follows `history`, linear between its points and constant
/// outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// After its history it is raised until its members fail; it stays as it is where there is
    /// nothing.
    #[serde(default)]
    pub loading: Option<Loading>,
}

/// Along what a load is raised until its members fail.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Loading {
    /// The displacement where it acts, and where that finds no equilibrium all displacements.
    Automatic,
    /// The displacement where it acts.
    Displacement {
        /// How far, mm; until the member has failed where there is none.
        #[serde(default)]
        to_mm: Option<f32>,
    },
    /// The arc of all displacements, which follows a member that snaps back.
    ArcLength,
}

impl Action {
    /// Whether it is of a kind that is raised until a member fails: not weight, nor heat.
    #[must_use]
    pub fn can_be_raised(&self) -> bool {
        !matches!(
            self,
            Self::SelfWeight
                | Self::Air { .. }
                | Self::PipeTemperature { .. }
                | Self::Temperature { .. }
        )
    }
}

/// What a load does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Action {
    /// Weight under gravity.
    SelfWeight,
    /// A force in all, spread over the place.
    Force {
        /// The place on its member.
        place: Place,
        /// In the world, kN.
        #[schemars(with = "[f32; 3]")]
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
        #[schemars(with = "[f32; 3]")]
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
        #[schemars(with = "[f32; 3]")]
        displacement_mm: Vec3,
    },
    /// Air that is warmer than the climate; heat is conducted into the concrete, through films of
    /// EN ISO 6946 (7.7 W/(m²K) inside, 25 outside).
    Air {
        /// At the side at 0 degrees (inside, for a tunnel), K.
        #[serde(default)]
        inside_k: f32,
        /// At all others, K.
        #[serde(default)]
        outside_k: f32,
    },
    /// The steel pipe of a tunnel is warmer than its concrete.
    PipeTemperature {
        /// Than its concrete, K.
        warmer_k: f32,
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

/// A load test: what acts, for a short while, so that gauges are read before and after. It takes no
/// part in the life of the member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Test {
    /// Name, unique in the scene; readings refer to it.
    pub name: String,
    /// Id of the member that it acts on.
    pub member: String,
    /// What acts, all of it at once.
    pub actions: Vec<Action>,
}
