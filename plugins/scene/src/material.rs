//! Materials and textures.

use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};

use crate::Finish;

/// What a surface does with light: the parameters of its BRDF f_r (eq. 2.3) and its emission L_e.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, for people.
    pub name: String,
    /// Whether somebody had to assume it because the model did not say.
    pub assumed: bool,
    /// Which family of BRDF.
    pub surface: Surface,
    /// Linear Rec. 709 reflectance, each channel in [0, 1].
    pub base_colour: Vec3,
    /// Multiplies `base_colour`.
    pub base_texture: Option<TextureRef>,
    /// Emitted radiance L_e, W·m⁻²·sr⁻¹, on the front side only.
    pub emission: Vec3,
    /// Multiplies `emission`.
    pub emission_texture: Option<TextureRef>,
    /// Tangent-space normals, and their scale.
    pub normal_texture: Option<(TextureRef, f32)>,
    /// What formwork, weather and people left: changes `base_colour` from place to place and bends
    /// normals.
    pub finish: Option<Arc<Finish>>,
}

/// The families of BRDF.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// f_r = base colour / π on both sides.
    Lambert,
    /// glTF's metallic-roughness: GGX specular over a diffuse base, energy-conserving.
    Metallic {
        /// 0 dielectric (F0 = .04) to 1 metal (F0 = base colour).
        metallic: f32,
        /// Perceptual roughness; GGX α = roughness².
        roughness: f32,
        /// glTF packing: green multiplies roughness, blue multiplies metallic.
        texture: Option<TextureRef>,
    },
    /// Glass: reflects and refracts. The front side is outside.
    Dielectric {
        /// Index of refraction, inside over outside.
        ior: f32,
        /// 0 smooth; else GGX α = roughness².
        roughness: f32,
    },
    /// Reflects nothing: lamps.
    Black,
}

impl Default for Material {
    /// Assumed concrete grey.
    fn default() -> Self {
        Self {
            name: "assumed concrete".into(),
            assumed: true,
            surface: Surface::Lambert,
            base_colour: Vec3::splat(0.5),
            base_texture: None,
            emission: Vec3::ZERO,
            emission_texture: None,
            normal_texture: None,
            finish: None,
        }
    }
}

/// Which texture, which coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureRef {
    /// Index into the scene's textures.
    pub texture: usize,
    /// Texture coordinate set, 0 or 1.
    pub set: usize,
    /// `KHR_texture_transform`, applied to the coordinates.
    pub transform: Affine2,
}

/// What happens outside [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Repeat.
    #[default]
    Repeat,
    /// Repeat, every second one mirrored.
    Mirror,
    /// The edge's texel.
    Clamp,
}

/// An image in linear values, row-major from the top left as in glTF.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// `width · height` linear RGB texels.
    pub texels: Vec<Vec3>,
    /// Outside [0, 1], horizontally and vertically.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Bilinear value at `uv`, already transformed.
    #[must_use]
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let (x, y) = (uv.x * self.width as f32 - 0.5, uv.y * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: i64, dy: i64| {
            let column = wrapped((x0 as i64).saturating_add(dx), self.width, self.wrap[0]);
            let row = wrapped((y0 as i64).saturating_add(dy), self.height, self.wrap[1]);
            self.texels[row * self.width + column]
        };
        at(0, 0).lerp(at(1, 0), fx).lerp(at(0, 1).lerp(at(1, 1), fx), fy)
    }
}

fn wrapped(i: i64, n: usize, wrap: Wrap) -> usize {
    let n = n as i64;
    let i = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let j = i.rem_euclid(2 * n);
            if j < n { j } else { 2 * n - 1 - j }
        }
    };
    i as usize
}
