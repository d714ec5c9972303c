//! What light sees: materials, shapes, models, lamps, cameras, meters.

use glam::{EulerRot, Mat4, Quat, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{FinishKind, Lens, StainKind};

fn one() -> Vec3 {
    Vec3::ONE
}

fn up() -> Vec3 {
    Vec3::Y
}

fn some() -> f32 {
    0.4
}

fn yes() -> bool {
    true
}

/// What a surface does with light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Name that shapes and members refer to.
    pub name: String,
    /// Family of BRDF.
    #[serde(default)]
    pub surface: Surface,
    /// Linear Rec. 709 reflectance, each in [0, 1].
    #[serde(default = "one")]
    #[schemars(with = "[f32; 3]")]
    pub colour: Vec3,
    /// Image that multiplies `colour`: PNG or JPEG (sRGB) or EXR (linear).
    #[serde(default)]
    pub texture: Option<String>,
    /// What formwork, weather and people left on it.
    #[serde(default)]
    pub finish: Option<Finish>,
    /// Emitted radiance, W·m⁻²·sr⁻¹, on the front side.
    #[serde(default)]
    #[schemars(with = "[f32; 3]")]
    pub emission: Vec3,
}

/// What formwork, weather and people left on a face: colour and relief, drawn by `seed`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// What it was made against.
    pub kind: FinishKind,
    /// Another number, another face.
    #[serde(default)]
    pub seed: u64,
    /// 0: as struck; 1: dirty, stained, written upon.
    #[serde(default = "some")]
    pub worn: f32,
    /// What ran down it from where.
    #[serde(default)]
    pub stains: Vec<Stain>,
}

/// Rust or lime that came out of a face and ran down it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stain {
    /// What it is.
    pub kind: StainKind,
    /// Where it begins, across the face and up: of an upright face that looks along +z these are x
    /// and y of the world, of one that looks along +x they are −z and y.
    pub at: (f32, f32),
    /// At its widest.
    pub width_m: f32,
    /// At its longest.
    pub length_m: f32,
}

/// The families of BRDF.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Surface {
    /// Matt.
    #[default]
    Lambert,
    /// glTF's metallic-roughness.
    Metallic {
        /// 0 to 1.
        #[serde(default)]
        metallic: f32,
        /// 0 to 1.
        roughness: f32,
    },
    /// Glass.
    Dielectric {
        /// Index of refraction, inside over outside.
        ior: f32,
        /// 0 to 1.
        #[serde(default)]
        roughness: f32,
    },
    /// Reflects nothing.
    Black,
}

/// Where something stands: scaled, then turned about x, y and z in this order, then moved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Metres.
    #[serde(default)]
    #[schemars(with = "[f32; 3]")]
    pub translate: Vec3,
    /// Degrees about the fixed axes x, y, z.
    #[serde(default)]
    #[schemars(with = "[f32; 3]")]
    pub rotate_deg: Vec3,
    /// Factors along x, y, z; negative ones mirror.
    #[serde(default = "one")]
    #[schemars(with = "[f32; 3]")]
    pub scale: Vec3,
}

impl Default for Transform {
    fn default() -> Self {
        Self { translate: Vec3::ZERO, rotate_deg: Vec3::ZERO, scale: Vec3::ONE }
    }
}

impl Transform {
    /// As a matrix.
    #[must_use]
    pub fn matrix(&self) -> Mat4 {
        let [x, y, z] = self.rotate_deg.to_array().map(f32::to_radians);
        Mat4::from_scale_rotation_translation(
            self.scale,
            Quat::from_euler(EulerRot::ZYX, z, y, x),
            self.translate,
        )
    }
}

/// A shape that is no member. Without a material it is black if it emits, else assumed concrete.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// A parallelogram. Its front, where it emits, is the side that `u × v` points to.
    Quad {
        /// Name.
        #[serde(default)]
        name: String,
        /// A corner, m.
        #[schemars(with = "[f32; 3]")]
        corner: Vec3,
        /// One edge, m.
        #[schemars(with = "[f32; 3]")]
        u: Vec3,
        /// The other edge, m.
        #[schemars(with = "[f32; 3]")]
        v: Vec3,
        /// Name of a material.
        #[serde(default)]
        material: Option<String>,
        /// Emitted radiance, W·m⁻²·sr⁻¹, instead of the material's.
        #[serde(default)]
        #[schemars(with = "Option<[f32; 3]>")]
        emission: Option<Vec3>,
    },
    /// A box, turned about the vertical.
    Box {
        /// Name.
        #[serde(default)]
        name: String,
        /// Its centre, m.
        #[schemars(with = "[f32; 3]")]
        centre: Vec3,
        /// Its edges along x, y, z before turning, m.
        #[schemars(with = "[f32; 3]")]
        size: Vec3,
        /// Degrees about +y.
        #[serde(default)]
        turn_deg: f32,
        /// Name of a material.
        #[serde(default)]
        material: Option<String>,
        /// Emitted radiance, W·m⁻²·sr⁻¹, instead of the material's.
        #[serde(default)]
        #[schemars(with = "Option<[f32; 3]>")]
        emission: Option<Vec3>,
    },
    /// The triangles of a Wavefront OBJ file.
    Mesh {
        /// Name.
        #[serde(default)]
        name: String,
        /// Path, relative to the scene file.
        file: String,
        /// Where it stands.
        #[serde(default)]
        transform: Transform,
        /// Name of a material.
        #[serde(default)]
        material: Option<String>,
        /// Emitted radiance, W·m⁻²·sr⁻¹, instead of the material's.
        #[serde(default)]
        #[schemars(with = "Option<[f32; 3]>")]
        emission: Option<Vec3>,
    },
}

/// A glTF file, with all its members, lamps and cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// `.glb` or `.gltf`, relative to the scene file; may begin with `${INTRADOS_DATA}`.
    pub file: String,
    /// Where it stands.
    #[serde(default)]
    pub transform: Transform,
    /// Whether its lamps are taken over.
    #[serde(default = "yes")]
    pub lamps: bool,
    /// Whether its cameras are taken over, behind those of the scene.
    #[serde(default = "yes")]
    pub cameras: bool,
}

/// A lamp that is no surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Lamp {
    /// Same intensity in every direction.
    Point {
        /// Name.
        name: String,
        /// Where, m.
        #[schemars(with = "[f32; 3]")]
        position: Vec3,
        /// How strong: `Watt`, `WattPerSteradian`, `Lumen` or `Candela`.
        strength: Strength,
        /// Its hue; the strength is the luminance.
        #[serde(default = "one")]
        #[schemars(with = "[f32; 3]")]
        colour: Vec3,
    },
    /// A cone.
    Spot {
        /// Name.
        name: String,
        /// Where, m.
        #[schemars(with = "[f32; 3]")]
        position: Vec3,
        /// A point on its axis, m.
        #[schemars(with = "[f32; 3]")]
        target: Vec3,
        /// How strong: `Watt`, `WattPerSteradian`, `Lumen` or `Candela` (on the axis).
        strength: Strength,
        /// Its hue; the strength is the luminance.
        #[serde(default = "one")]
        #[schemars(with = "[f32; 3]")]
        colour: Vec3,
        /// Half angle of full intensity, degrees.
        inner_deg: f32,
        /// Half angle where it ends, degrees, at most 90.
        outer_deg: f32,
    },
    /// A parallel beam, as of the sun.
    Directional {
        /// Name.
        name: String,
        /// Where the light goes.
        #[schemars(with = "[f32; 3]")]
        direction: Vec3,
        /// How strong, on a plane across: `WattPerSquareMetre` or `Lux`.
        strength: Strength,
        /// Its hue; the strength is the luminance.
        #[serde(default = "one")]
        #[schemars(with = "[f32; 3]")]
        colour: Vec3,
    },
    /// Light from everywhere beyond the scene.
    Environment {
        /// Name.
        #[serde(default)]
        name: String,
        /// Radiance, W·m⁻²·sr⁻¹; multiplies the image.
        #[serde(default = "one")]
        #[schemars(with = "[f32; 3]")]
        radiance: Vec3,
        /// Equirectangular image, PNG, JPEG or EXR, +y at the top.
        #[serde(default)]
        image: Option<String>,
    },
}

impl Lamp {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Point { name, .. }
            | Self::Spot { name, .. }
            | Self::Directional { name, .. }
            | Self::Environment { name, .. } => name,
        }
    }
}

/// How strong a lamp is, with its unit. Photometric units are converted with 683 lm/W.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Strength {
    /// Radiant flux, all directions together, W.
    Watt(f32),
    /// Radiant intensity, W·sr⁻¹.
    WattPerSteradian(f32),
    /// Luminous flux, lm.
    Lumen(f32),
    /// Luminous intensity, cd.
    Candela(f32),
    /// Irradiance, W·m⁻².
    WattPerSquareMetre(f32),
    /// Illuminance, lx.
    Lux(f32),
}

impl Strength {
    /// The bare number.
    #[must_use]
    pub fn value(self) -> f32 {
        match self {
            Self::Watt(x)
            | Self::WattPerSteradian(x)
            | Self::Lumen(x)
            | Self::Candela(x)
            | Self::WattPerSquareMetre(x)
            | Self::Lux(x) => x,
        }
    }
}

/// A pinhole camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Name.
    pub name: String,
    /// Pinhole, m.
    #[schemars(with = "[f32; 3]")]
    pub position: Vec3,
    /// A point on the optical axis, m.
    #[schemars(with = "[f32; 3]")]
    pub target: Vec3,
    /// Any vector that is up in the picture.
    #[serde(default = "up")]
    #[schemars(with = "[f32; 3]")]
    pub up: Vec3,
    /// Full field of view across, degrees.
    pub fov_deg: f32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Stops.
    #[serde(default)]
    pub exposure: f32,
    /// How its lens distorts; none: straight lines stay straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<Lens>,
}

/// A light meter: irradiance on a flat patch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Meter {
    /// Anywhere. Its front is the side that `u × v` points to.
    Patch {
        /// Name.
        name: String,
        /// A corner, m.
        #[schemars(with = "[f32; 3]")]
        corner: Vec3,
        /// One edge, m.
        #[schemars(with = "[f32; 3]")]
        u: Vec3,
        /// The other edge, m.
        #[schemars(with = "[f32; 3]")]
        v: Vec3,
    },
    /// A square on the surface of a member, facing the air: outward, or inward in a tunnel.
    Surface {
        /// Name.
        name: String,
        /// Id of the member.
        on: String,
        /// Place on the axis, 0 to 1.
        along: f32,
        /// Side, degrees about the axis.
        angle_deg: f32,
        /// Edge of the square, m.
        size_m: f32,
    },
}

impl Meter {
    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Patch { name, .. } | Self::Surface { name, .. } => name,
        }
    }
}
