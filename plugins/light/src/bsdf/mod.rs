//! What a surface does with light, as pure functions in a local frame whose z axis is the shading
//! normal.
//!
//! Directions point away from the surface. `wo` is the one a walk came along, `wi` the one it goes
//! on: for a walk from the camera (`Side::Primal`) light arrives along `wi`, for a walk from a lamp
//! (`Side::Dual`) along `wo`. The two are adjoint, f*(wo, wi) = f(wi, wo), and differ only where
//! light is refracted: radiance is scaled by (η_o/η_i)², importance is not (Veach 1997, §5.2).
//!
//! Energy: `Lambert` and `Metallic` reflect exactly what their albedo says (the latter within the
//! error of its tables, 1.5e-3). `Dielectric` is Walter's single-scattering model and loses what
//! scatters twice: see `Bsdf::Dielectric`.

mod energy;
mod ggx;
#[cfg(test)]
mod tests;
pub mod warp;

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use intrados_scene::{Material, Surface};
use intrados_transport::Side;

pub(crate) use ggx::MIN_ALPHA;
pub use warp::Frame;

/// Reflectance at normal incidence of what is no metal, as in glTF: an index of refraction of 1.5.
const DIELECTRIC_F0: f32 = 0.04;

/// A BSDF with all its parameters known at one point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Bsdf {
    /// Nothing.
    #[default]
    Black,
    /// f_r = albedo/π, the same on both sides; nothing passes.
    Lambert {
        /// Reflectance in [0, 1].
        albedo: Vec3,
    },
    /// GGX specular over a diffuse base, on both sides; nothing passes.
    ///
    /// Specular: Schlick's Fresnel, height-correlated Smith masking, and what scatters more than
    /// once between the micro-facets put back by the reciprocal lobe of Kulla & Conty ("Revisiting
    /// physically based shading", SIGGRAPH course 2017) with the colour of Fdez-Agüera (JCGT 2019).
    /// Diffuse: scaled by what the specular layer lets through on the way in and out (Kelemen &
    /// Szirmay-Kalos 2001). Metal and dielectric are mixed linearly, so the whole stays reciprocal
    /// and never above 1.
    Metallic {
        /// Base colour in [0, 1].
        base: Vec3,
        /// 0 dielectric to 1 metal.
        metallic: f32,
        /// GGX α, `MIN_ALPHA` to 1.
        alpha: f32,
    },
    /// A rough interface that reflects and refracts (Walter et al. 2007), no absorption.
    ///
    /// Single scattering only. At index 1.5 and α = .1, .3, .5, 1 a white furnace loses .1, 1.2,
    /// 3.2, 11 % at normal incidence from outside, and 12, 24, 35, 61 % at the worst angle (from
    /// inside, oblique: light that is totally reflected by one micro-facet and would leave by the
    /// next). It never gains.
    Dielectric {
        /// Index of refraction, inside (−z) over outside (+z).
        ior: f32,
        /// GGX α, `MIN_ALPHA` to 1.
        alpha: f32,
    },
    /// A smooth interface: only deltas.
    SmoothDielectric {
        /// Index of refraction, inside (−z) over outside (+z).
        ior: f32,
    },
}

/// A direction drawn from a BSDF.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Where the walk goes on.
    pub wi: Vec3,
    /// f·|cosθ_i|/pdf: what the walk's weight is multiplied by.
    pub weight: Vec3,
    /// Density of `wi`, per sr; for a delta the probability of that delta.
    pub pdf: f32,
    /// Whether `wi` is the only direction of its kind: `eval` and `pdf` know nothing of it, and no
    /// other strategy finds it.
    pub delta: bool,
}

impl Bsdf {
    /// The BSDF of a surface with this base colour; `packed` is the texel of glTF's
    /// metallic-roughness texture (green roughness, blue metallic), `Vec3::ONE` where there is
    /// none. Values outside their range are clamped.
    #[must_use]
    pub fn new(surface: &Surface, base: Vec3, packed: Vec3) -> Self {
        let base = base.clamp(Vec3::ZERO, Vec3::ONE);
        match *surface {
            Surface::Black => Self::Black,
            Surface::Lambert => Self::Lambert { albedo: base },
            Surface::Metallic { metallic, roughness, .. } => Self::Metallic {
                base,
                metallic: (metallic * packed.z).clamp(0.0, 1.0),
                alpha: alpha_of(roughness * packed.y),
            },
            // Without a step in the index nothing is bent, and Walter's half vector does not exist.
            Surface::Dielectric { ior, roughness }
                if roughness * roughness < MIN_ALPHA || (ior - 1.0).abs() < 1e-3 =>
            {
                Self::SmoothDielectric { ior }
            }
            Surface::Dielectric { ior, roughness } => {
                Self::Dielectric { ior, alpha: alpha_of(roughness) }
            }
        }
    }

    /// Whether every direction it can take is a delta, so that connecting to a lamp or a sensor is
    /// useless.
    #[inline]
    #[must_use]
    pub(crate) fn is_delta(&self) -> bool {
        matches!(self, Self::SmoothDielectric { .. })
    }

    /// Density of `sample`, per sr, deltas apart.
    #[inline]
    #[must_use]
    pub(crate) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Lambert { .. } => lambert_pdf(wo, wi),
            Self::Black | Self::SmoothDielectric { .. } => 0.0,
            _ => self.eval_pdf(wo, wi, Side::Dual).1,
        }
    }

    /// f·|cosθ_i| and the density of `sample` (per sr), deltas apart.
    #[inline]
    #[must_use]
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3, side: Side) -> (Vec3, f32) {
        match *self {
            Self::Lambert { albedo } => {
                let pdf = lambert_pdf(wo, wi);
                (albedo * pdf, pdf)
            }
            Self::Black | Self::SmoothDielectric { .. } => (Vec3::ZERO, 0.0),
            Self::Metallic { base, metallic, alpha } => {
                eval_metallic(base, metallic, alpha, wo, wi)
            }
            Self::Dielectric { ior, alpha } => {
                let (f, pdf) = eval_dielectric(ior, alpha, wo, wi, side);
                (Vec3::splat(f), pdf)
            }
        }
    }

    /// A direction to go on, from three uniform numbers (the third chooses the lobe). `None`: the
    /// walk is absorbed, and scores 0 there.
    #[inline]
    #[must_use]
    pub fn sample(&self, wo: Vec3, u: [f32; 3], side: Side) -> Option<Sample> {
        match *self {
            Self::Lambert { albedo } => {
                let wi = warp::cosine_hemisphere([u[0], u[1]]);
                let pdf = wi.z * FRAC_1_PI;
                let wi = wi.with_z(wi.z.copysign(wo.z));
                (pdf > 0.0).then_some(Sample { wi, weight: albedo, pdf, delta: false })
            }
            Self::Black => None,
            Self::Metallic { base, metallic, alpha } => {
                sample_metallic(base, metallic, alpha, wo, u)
            }
            Self::Dielectric { ior, alpha } => sample_dielectric(ior, alpha, wo, u, side),
            Self::SmoothDielectric { ior } => sample_smooth(ior, wo, u[2], side),
        }
    }

    /// Share of the light along `wo` that leaves again: what Russian roulette survives with. Never
    /// below the truth by more than the tables' error; the losses of rough glass are left out.
    #[inline]
    #[must_use]
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        match *self {
            Self::Lambert { albedo } => albedo,
            Self::Black => Vec3::ZERO,
            Self::Metallic { base, metallic, alpha } => {
                let layers = Layers::new(base, metallic, alpha, wo.z.abs());
                layers.single + layers.rest
            }
            Self::Dielectric { .. } | Self::SmoothDielectric { .. } => Vec3::ONE,
        }
    }
}

fn alpha_of(roughness: f32) -> f32 {
    (roughness * roughness).clamp(MIN_ALPHA, 1.0)
}

/// |cosθ_i|/π where both directions are on one side, else 0.
#[inline]
fn lambert_pdf(wo: Vec3, wi: Vec3) -> f32 {
    if wo.z * wi.z > 0.0 { wi.z.abs() * FRAC_1_PI } else { 0.0 }
}

/// What a weight of the dual is multiplied by where shading normal and true normal differ (Veach
/// 1997, eq. 5.19), on top of f·|wi·n_s| as `eval` gives it: the adjoint of a BSDF that was bent by
/// a shading normal is another function. World directions. 0 where `wo` or `wi` grazes or the
/// normals disagree about their sides.
#[inline]
#[must_use]
pub(crate) fn shading_correction(wo: Vec3, wi: Vec3, shading: Vec3, geometric: Vec3) -> f32 {
    let (os, og, is, ig) = (wo.dot(shading), wo.dot(geometric), wi.dot(shading), wi.dot(geometric));
    if os * og > 0.0 && is * ig > 0.0 { (os * ig / (og * is)).abs() } else { 0.0 }
}

/// Reflectance of a smooth interface, unpolarised, and the cosine beyond it; `eta` is the index
/// beyond over the index here. Total reflection: 1 and 0.
#[inline]
#[must_use]
pub(crate) fn fresnel(cos: f32, eta: f32) -> (f32, f32) {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return (1.0, 0.0);
    }
    let beyond = (1.0 - sin2).sqrt();
    let parallel = (eta * cos - beyond) / (eta * cos + beyond);
    let across = (cos - eta * beyond) / (cos + eta * beyond);
    (0.5 * (parallel * parallel + across * across), beyond)
}

/// Schlick's approximation.
#[inline]
fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    f0 + (Vec3::ONE - f0) * (m2 * m2 * m)
}

/// Colour of what is reflected more than once: F̄² Ē/(1 − F̄(1 − Ē)), F̄ = F₀ + (1 − F₀)/21 the
/// cosine-weighted mean of Schlick's.
#[inline]
fn multiple(f0: Vec3, mean_e: f32) -> Vec3 {
    let f = f0 + (Vec3::ONE - f0) * (1.0 / 21.0);
    f * f * mean_e / (Vec3::ONE - f * (1.0 - mean_e))
}

/// Computes what surfaces of `materials` look up and would else be computed by the first walk that
/// meets them.
pub(crate) fn prepare(materials: &[Material]) {
    if materials.iter().any(|m| matches!(m.surface, Surface::Metallic { .. })) {
        energy::prepare();
    }
}

/// The layers of a metallic surface seen from one direction.
struct Layers {
    albedos: energy::Albedos,
    f0: Vec3,
    /// Albedo of the single-scattering lobe.
    single: Vec3,
    /// Albedo of multiple scattering and diffuse base: all that leaves by the cosine.
    rest: Vec3,
    /// Factor of (1 − E_i)/π: multiple scattering.
    multiple: Vec3,
    /// Factor of (1 − E_d,i)/π: diffuse base.
    diffuse: Vec3,
    /// Multiple-scattering colour of the dielectric layer.
    layer: f32,
    /// Probability of sampling the single-scattering lobe.
    choose: f32,
}

impl Layers {
    /// What is left of 1, kept from 0: below this nobody misses the energy.
    const LEAST: f32 = 1e-4;

    #[inline]
    fn new(base: Vec3, metallic: f32, alpha: f32, mu: f32) -> Self {
        let albedos = energy::Albedos::new(alpha);
        let (here, mean) = (albedos.at(mu), albedos.mean);
        let f0 = Vec3::splat(DIELECTRIC_F0).lerp(base, metallic);
        let layer = multiple(Vec3::splat(DIELECTRIC_F0), mean.e).x;
        let single = here.single(f0);
        let colour = Vec3::splat(layer).lerp(multiple(base, mean.e), metallic);
        let missing = (1.0 - here.e).max(0.0);
        let missing_mean = (1.0 - mean.e).max(Self::LEAST);
        let below = 1.0 - dielectric_albedo(here, layer);
        let below_mean = 1.0 - dielectric_albedo(mean, layer);
        let multiple = colour * (missing / missing_mean);
        let diffuse = base * ((1.0 - metallic) * below / below_mean);
        let rest = multiple * (1.0 - mean.e) + diffuse * below_mean;
        let (s, r) = (single.element_sum(), rest.element_sum());
        Self {
            albedos,
            f0,
            single,
            rest,
            multiple,
            diffuse,
            layer,
            choose: (s / (s + r)).clamp(0.1, 0.9),
        }
    }

    /// f·cosθ_i and density, both directions above.
    #[inline]
    fn eval_pdf(&self, alpha: f32, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let h = (wo + wi).normalize_or(Vec3::Z);
        let specular =
            schlick(self.f0, wo.dot(h)) * (ggx::d(h, alpha) * ggx::visibility(wo.z, wi.z, alpha));
        let there = self.albedos.at(wi.z);
        let rest = self.multiple * (1.0 - there.e).max(0.0)
            + self.diffuse * (1.0 - dielectric_albedo(there, self.layer));
        let pdf = self.choose * ggx::reflection_pdf(wo, h, alpha)
            + (1.0 - self.choose) * FRAC_1_PI * wi.z;
        ((specular + rest * FRAC_1_PI) * wi.z, pdf)
    }
}

/// Albedo of the dielectric specular layer, multiple scattering included.
#[inline]
fn dielectric_albedo(a: energy::Albedo, layer: f32) -> f32 {
    DIELECTRIC_F0 * (a.e - a.b) + a.b + layer * (1.0 - a.e).max(0.0)
}

/// Both directions turned to the upper side, `None` where they are not on one side.
#[inline]
fn above(wo: Vec3, wi: Vec3) -> Option<(Vec3, Vec3)> {
    (wo.z * wi.z > 0.0).then(|| (wo.with_z(wo.z.abs()), wi.with_z(wi.z.abs())))
}

fn eval_metallic(base: Vec3, metallic: f32, alpha: f32, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
    match above(wo, wi) {
        Some((wo, wi)) => Layers::new(base, metallic, alpha, wo.z).eval_pdf(alpha, wo, wi),
        None => (Vec3::ZERO, 0.0),
    }
}

fn sample_metallic(base: Vec3, metallic: f32, alpha: f32, wo: Vec3, u: [f32; 3]) -> Option<Sample> {
    let up = wo.with_z(wo.z.abs());
    let layers = Layers::new(base, metallic, alpha, up.z);
    let wi = if u[2] < layers.choose {
        let h = ggx::visible_normal(up, alpha, [u[0], u[1]]);
        (2.0 * up.dot(h) * h - up).normalize()
    } else {
        warp::cosine_hemisphere([u[0], u[1]])
    };
    if wi.z <= 0.0 || up.z <= 0.0 {
        return None;
    }
    let (f, pdf) = layers.eval_pdf(alpha, up, wi);
    (pdf > 0.0).then(|| Sample {
        wi: wi.with_z(wi.z.copysign(wo.z)),
        weight: f / pdf,
        pdf,
        delta: false,
    })
}

/// Index on the far side of `wo` over the index on its side.
#[inline]
fn relative_index(ior: f32, wo: Vec3) -> f32 {
    if wo.z > 0.0 { ior } else { 1.0 / ior }
}

/// Radiance shrinks by the square of the index that it leaves behind, importance does not.
#[inline]
fn refraction_scale(eta: f32, side: Side) -> f32 {
    match side {
        Side::Primal => 1.0 / (eta * eta),
        Side::Dual => 1.0,
    }
}

/// f·|cosθ_i| and density. The half vector of refraction and its Jacobian: Walter et al. 2007, eqs.
/// 16, 17, 21. Masking is height-correlated in reflection, G₁G₁ in transmission.
fn eval_dielectric(ior: f32, alpha: f32, wo: Vec3, wi: Vec3, side: Side) -> (f32, f32) {
    if wo.z == 0.0 || wi.z == 0.0 {
        return (0.0, 0.0);
    }
    let eta = relative_index(ior, wo);
    let reflected = wo.z * wi.z > 0.0;
    // Turned so that wo is above.
    let flip = 1.0_f32.copysign(wo.z);
    let (wo, wi) = (wo.with_z(wo.z * flip), wi.with_z(wi.z * flip));
    let h = (if reflected { wo + wi } else { wo + wi * eta }).normalize_or(Vec3::Z);
    let h = h * 1.0_f32.copysign(h.z);
    let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
    if cos_o <= 0.0 || (cos_i > 0.0) != reflected {
        return (0.0, 0.0);
    }
    let (f, _) = fresnel(cos_o, eta);
    let d = ggx::d(h, alpha);
    if reflected {
        return (
            f * d * ggx::visibility(wo.z, wi.z, alpha) * wi.z,
            f * ggx::reflection_pdf(wo, h, alpha),
        );
    }
    let denominator = cos_i + cos_o / eta;
    let jacobian = -cos_i / (denominator * denominator);
    // G₁(wo) D (wo·h)/wo.z is the density of h.
    let pdf = (1.0 - f) * jacobian * ggx::g1(wo.z, alpha) * d * cos_o / wo.z;
    (pdf * ggx::g1(-wi.z, alpha) * refraction_scale(eta, side), pdf)
}

fn sample_dielectric(ior: f32, alpha: f32, wo: Vec3, u: [f32; 3], side: Side) -> Option<Sample> {
    if wo.z == 0.0 {
        return None;
    }
    let eta = relative_index(ior, wo);
    let up = wo.with_z(wo.z.abs());
    let h = ggx::visible_normal(up, alpha, [u[0], u[1]]);
    let cos = up.dot(h);
    let (f, beyond) = fresnel(cos, eta);
    let reflected = u[2] < f;
    let wi = if reflected { 2.0 * cos * h - up } else { h * (cos / eta - beyond) - up / eta }
        .normalize();
    if reflected != (wi.z > 0.0) || wi.z == 0.0 {
        return None;
    }
    let wi = wi.with_z(wi.z * 1.0_f32.copysign(wo.z));
    let (value, pdf) = eval_dielectric(ior, alpha, wo, wi, side);
    (pdf > 0.0).then(|| Sample { wi, weight: Vec3::splat(value / pdf), pdf, delta: false })
}

fn sample_smooth(ior: f32, wo: Vec3, u: f32, side: Side) -> Option<Sample> {
    let eta = relative_index(ior, wo);
    let (f, beyond) = fresnel(wo.z.abs(), eta);
    if u < f {
        return Some(Sample {
            wi: Vec3::new(-wo.x, -wo.y, wo.z),
            weight: Vec3::ONE,
            pdf: f,
            delta: true,
        });
    }
    let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -beyond.copysign(wo.z)).normalize();
    Some(Sample { wi, weight: Vec3::splat(refraction_scale(eta, side)), pdf: 1.0 - f, delta: true })
}
