//! Lamps that are no surfaces.

use bevy_ecs::component::Component;
use glam::Vec3;

use crate::material::Texture;

/// A lamp that is not a surface. Lamps that are surfaces are materials with emission.
///
/// Photometric input (lumen, candela, lux) is converted by 683 lm/W on reading; here everything is
/// radiometric.
#[derive(Component, Debug, Clone, PartialEq)]
pub struct Lamp {
    /// Name, for people.
    pub name: String,
    /// Shape and strength.
    pub kind: LampKind,
}

/// The shapes of lamp that have no area in the scene.
#[derive(Debug, Clone, PartialEq)]
pub enum LampKind {
    /// Same intensity in every direction.
    Point {
        /// Where, m.
        position: Vec3,
        /// Radiant intensity, W·sr⁻¹.
        intensity: Vec3,
    },
    /// A cone, full intensity within `inner`, none beyond `outer`, falling off between as
    /// `KHR_lights_punctual` recommends.
    Spot {
        /// Where, m.
        position: Vec3,
        /// Axis of the cone, unit.
        direction: Vec3,
        /// On the axis, W·sr⁻¹.
        intensity: Vec3,
        /// Half angle, rad.
        inner: f32,
        /// Half angle, rad, above `inner`.
        outer: f32,
    },
    /// A parallel beam from infinity.
    Directional {
        /// Where the light goes, unit.
        direction: Vec3,
        /// On a plane across the beam, W·m⁻².
        irradiance: Vec3,
    },
    /// Light from everywhere beyond the scene. At most one a scene.
    Environment {
        /// Radiance, W·m⁻²·sr⁻¹; multiplies `image` if there is one.
        radiance: Vec3,
        /// Equirectangular, top row at +y, left edge at +z turning over −x, −z in the middle (u =
        /// atan2(x, −z)/2π + ½).
        image: Option<Texture>,
    },
}
