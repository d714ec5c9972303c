//! How much a GGX surface reflects in all, tabulated: what multiple-scattering compensation and the diffuse base need.
//!
//! E(μ, α) is the directional albedo of the single-scattering GGX lobe with a perfect mirror on every micro-facet. With Schlick's
//! F = F₀ + (1 − F₀)(1 − cos)⁵ the albedo is linear in F₀: F₀ E + (1 − F₀) B, B being the lobe weighted by (1 − cos)⁵.
//! The tables are integrated when first needed (a constant, not a state), so that no number in them was copied from anywhere.

use std::sync::LazyLock;

use glam::Vec3;

use super::ggx;

/// Nodes across roughness √α and across √μ: both spread the nodes where E bends.
const NODES: usize = 32;
/// Quadrature points across each sampling dimension of one entry (the azimuth only over its symmetric half).
const POINTS: [usize; 2] = [64, 24];

/// E and B of one direction, or their cosine-weighted means.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Albedo {
    pub(super) e: f32,
    pub(super) b: f32,
}

impl Albedo {
    fn mix(self, other: Self, t: f32) -> Self {
        Self { e: self.e + (other.e - self.e) * t, b: self.b + (other.b - self.b) * t }
    }

    /// Single-scattering albedo at normal-incidence reflectance `f0`.
    #[inline]
    pub(super) fn single(self, f0: Vec3) -> Vec3 {
        f0 * (self.e - self.b) + Vec3::splat(self.b)
    }
}

struct Table {
    /// By roughness, then by √μ.
    directional: Vec<[Albedo; NODES]>,
    /// 2∫ · μ dμ of the interpolated row, by roughness.
    mean: Vec<Albedo>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let directional: Vec<_> = (0..NODES).map(|r| std::array::from_fn(|m| integrate(node(m), node(r)))).collect();
    let mean = directional.iter().map(row_mean).collect();
    Table { directional, mean }
});

/// Square of the node's position: μ of a column, α of a row.
fn node(index: usize) -> f32 {
    let t = index as f32 / (NODES - 1) as f32;
    t * t
}

/// E and B by the midpoint rule over the visible normals.
fn integrate(mu: f32, alpha: f32) -> Albedo {
    let (mu, alpha) = (mu.max(1e-5), alpha.max(ggx::MIN_ALPHA));
    let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let (mut e, mut b) = (0.0, 0.0);
    for i in 0..POINTS[0] {
        for j in 0..POINTS[1] {
            let u = [(i as f32 + 0.5) / POINTS[0] as f32, 0.5 * (j as f32 + 0.5) / POINTS[1] as f32];
            let h = ggx::visible_normal(wo, alpha, u);
            let cos = wo.dot(h);
            let mu_i = 2.0 * cos * h.z - wo.z;
            if mu_i > 0.0 {
                let weight = f64::from(ggx::shadowing(wo.z, mu_i, alpha));
                e += weight;
                b += weight * f64::from((1.0 - cos).max(0.0)).powi(5);
            }
        }
    }
    let n = (POINTS[0] * POINTS[1]) as f64;
    Albedo { e: (e / n) as f32, b: (b / n) as f32 }
}

/// 2∫₀¹ f μ dμ = 4∫₀¹ f s³ ds, s = √μ. Between nodes f is linear in s and f s³ of degree four: Boole's rule is exact, so that the
/// compensation is normalised for the interpolated albedo itself.
fn row_mean(row: &[Albedo; NODES]) -> Albedo {
    const BOOLE: [f64; 5] = [7.0 / 90.0, 32.0 / 90.0, 12.0 / 90.0, 32.0 / 90.0, 7.0 / 90.0];
    let step = 1.0 / (NODES - 1) as f64;
    let (mut e, mut b) = (0.0, 0.0);
    for (i, pair) in row.windows(2).enumerate() {
        for (k, w) in BOOLE.iter().enumerate() {
            let t = k as f64 / 4.0;
            let at = pair[0].mix(pair[1], t as f32);
            let s = (i as f64 + t) * step;
            e += w * step * 4.0 * s.powi(3) * f64::from(at.e);
            b += w * step * 4.0 * s.powi(3) * f64::from(at.b);
        }
    }
    Albedo { e: e as f32, b: b as f32 }
}

/// Albedos of one surface: bilinear look-ups.
#[derive(Clone, Copy)]
pub(super) struct Albedos {
    rows: [&'static [Albedo; NODES]; 2],
    t: f32,
    /// Cosine-weighted mean.
    pub(super) mean: Albedo,
}

impl Albedos {
    #[inline]
    pub(super) fn new(alpha: f32) -> Self {
        let table = &*TABLE;
        let (i, t) = position(alpha);
        Self { rows: [&table.directional[i], &table.directional[i + 1]], t, mean: table.mean[i].mix(table.mean[i + 1], t) }
    }

    #[inline]
    pub(super) fn at(&self, mu: f32) -> Albedo {
        let (j, s) = position(mu);
        let [a, b] = self.rows;
        a[j].mix(a[j + 1], s).mix(b[j].mix(b[j + 1], s), self.t)
    }
}

/// Which interval of √x, and where in it.
#[inline]
fn position(x: f32) -> (usize, f32) {
    let p = x.clamp(0.0, 1.0).sqrt() * (NODES - 1) as f32;
    let i = (p as usize).min(NODES - 2);
    (i, p - i as f32)
}
