//! The GGX distribution of micro-normals, isotropic, on the upper side of a surface.
//!
//! Walter et al. 2007 for D and G₁; Heitz 2014 for the height-correlated masking; Dupuy & Benyoub
//! 2023 for sampling the visible normals. Every routine takes α ≥ `MIN_ALPHA`, and directions with
//! z > 0 unless it says otherwise.

use std::f32::consts::PI;

use glam::Vec3;

use super::warp::at_height;

/// Rougher than this or smooth: below, f32 cannot hold the lobe.
pub(crate) const MIN_ALPHA: f32 = 1e-3;

/// D(h), per sr. Written with x² + y² instead of 1 − z², which would lose all digits in a sharp
/// lobe.
#[inline]
pub(super) fn d(h: Vec3, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
    1.0 / (PI * a2 * t * t)
}

/// √(α² + (1 − α²)μ²): Smith's G₁(μ) is 2μ/(μ + this).
#[inline]
pub(super) fn smith_root(mu: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    (a2 + (1.0 - a2) * mu * mu).sqrt()
}

/// G₁(μ), the visible share of the micro-surface.
#[inline]
pub(super) fn g1(mu: f32, alpha: f32) -> f32 {
    2.0 * mu / (mu + smith_root(mu, alpha))
}

/// G₂/(4 μ_o μ_i), height-correlated: finite at grazing angles.
#[inline]
pub(super) fn visibility(mu_o: f32, mu_i: f32, alpha: f32) -> f32 {
    0.5 / (mu_i * smith_root(mu_o, alpha) + mu_o * smith_root(mu_i, alpha))
}

/// G₂/G₁(μ_o): the weight of a reflected sample.
#[inline]
pub(super) fn shadowing(mu_o: f32, mu_i: f32, alpha: f32) -> f32 {
    let (o, i) = (smith_root(mu_o, alpha), smith_root(mu_i, alpha));
    mu_i * (mu_o + o) / (mu_i * o + mu_o * i)
}

/// Density, per sr, of the reflection of `wo` about a visible normal: G₁ D/(4 μ_o).
#[inline]
pub(super) fn reflection_pdf(wo: Vec3, h: Vec3, alpha: f32) -> f32 {
    d(h, alpha) * 0.5 / (wo.z + smith_root(wo.z, alpha))
}

/// A micro-normal that `wo` sees, with density G₁(wo) D(h) max(0, wo·h)/wo.z: the reflected rays of
/// a half ellipsoid are uniform on a spherical cap (Dupuy & Benyoub 2023).
#[inline]
pub(super) fn visible_normal(wo: Vec3, alpha: f32, u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * wo.x, alpha * wo.y, wo.z).normalize();
    let cap = at_height((1.0 - u[0]) * (1.0 + stretched.z) - stretched.z, u[1]);
    let h = cap + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize_or(Vec3::Z)
}
