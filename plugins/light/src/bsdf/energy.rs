//! How much a GGX surface reflects in all, tabulated: what multiple-scattering compensation and the
//! diffuse base need.
//!
//! E(μ, α) is the directional albedo of the single-scattering GGX lobe with a perfect mirror on
//! every micro-facet. With Schlick's F = F₀ + (1 − F₀)(1 − cos)⁵ the albedo is linear in F₀: F₀ E +
//! (1 − F₀) B, B being the lobe weighted by (1 − cos)⁵. The tables are integrated when first needed
//! (a constant, not a state), so that no number in them was copied from anywhere.

use std::sync::LazyLock;

use glam::Vec3;

use super::ggx;

/// Nodes across roughness √α and across √μ: both spread the nodes where E bends.
const NODES: usize = 32;
/// Quadrature points across each sampling dimension of one entry (the azimuth only over its
/// symmetric half).
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
    let directional: Vec<_> = (0..NODES).map(row).collect();
    let mean = directional.iter().enumerate().map(|(r, row)| row_mean(row, row_alpha(r))).collect();
    Table { directional, mean }
});

/// Integrates the tables now: 40 ms that no frame should wait for.
pub(super) fn prepare() {
    LazyLock::force(&TABLE);
}

fn row(r: usize) -> [Albedo; NODES] {
    let alpha = row_alpha(r);
    std::array::from_fn(|c| {
        integrate(column_mu(c as f32 / (NODES - 1) as f32, alpha), alpha, POINTS)
    })
}

/// α of row `r`.
fn row_alpha(r: usize) -> f32 {
    let t = r as f32 / (NODES - 1) as f32;
    (t * t).max(ggx::MIN_ALPHA)
}

/// Where μ lies across the columns, in [0, 1]: half of the columns spread by √μ, half around μ ≈ α,
/// where E dips.
#[inline]
fn column(mu: f32, alpha: f32) -> f32 {
    0.5 * (mu.sqrt() + mu * (1.0 + alpha) / (mu + alpha))
}

/// The inverse of `column`, by bisection.
fn column_mu(position: f32, alpha: f32) -> f32 {
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..30 {
        let mid = 0.5 * (lo + hi);
        if column(mid, alpha) < position { lo = mid } else { hi = mid }
    }
    0.5 * (lo + hi)
}

/// E and B by the midpoint rule over the visible normals, in t with u = 1 − t³: what a smooth
/// surface loses hides in the last α² of u.
fn integrate(mu: f32, alpha: f32, points: [usize; 2]) -> Albedo {
    let (mu, alpha) = (mu.max(1e-5), alpha.max(ggx::MIN_ALPHA));
    let wo = Vec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
    let (mut e, mut b) = (0.0, 0.0);
    for i in 0..points[0] {
        let t = (i as f32 + 0.5) / points[0] as f32;
        for j in 0..points[1] {
            let h = ggx::visible_normal(
                wo,
                alpha,
                [1.0 - t * t * t, 0.5 * (j as f32 + 0.5) / points[1] as f32],
            );
            let cos = wo.dot(h);
            let mu_i = 2.0 * cos * h.z - wo.z;
            if mu_i > 0.0 {
                let weight = f64::from(3.0 * t * t * ggx::shadowing(wo.z, mu_i, alpha));
                e += weight;
                b += weight * f64::from((1.0 - cos).max(0.0)).powi(5);
            }
        }
    }
    let n = (points[0] * points[1]) as f64;
    Albedo { e: ((e / n) as f32).min(1.0), b: (b / n) as f32 }
}

/// 2∫₀¹ f μ dμ of a row as it is interpolated, by the midpoint rule.
fn row_mean(row: &[Albedo; NODES], alpha: f32) -> Albedo {
    let n = 1000;
    let (mut e, mut b) = (0.0, 0.0);
    for i in 0..n {
        let mu = (i as f32 + 0.5) / n as f32;
        let (j, s) = interval(column(mu, alpha));
        let at = row[j].mix(row[j + 1], s);
        e += f64::from(at.e * mu) * 2.0 / f64::from(n);
        b += f64::from(at.b * mu) * 2.0 / f64::from(n);
    }
    Albedo { e: e as f32, b: b as f32 }
}

/// Albedos of one surface: bilinear look-ups.
#[derive(Clone, Copy)]
pub(super) struct Albedos {
    rows: [&'static [Albedo; NODES]; 2],
    t: f32,
    alpha: f32,
    /// Cosine-weighted mean.
    pub(super) mean: Albedo,
}

impl Albedos {
    #[inline]
    pub(super) fn new(alpha: f32) -> Self {
        let table = &*TABLE;
        let (i, t) = interval(alpha.sqrt());
        Self {
            rows: [&table.directional[i], &table.directional[i + 1]],
            t,
            alpha,
            mean: table.mean[i].mix(table.mean[i + 1], t),
        }
    }

    #[inline]
    pub(super) fn at(&self, mu: f32) -> Albedo {
        let (j, s) = interval(column(mu, self.alpha));
        let [a, b] = self.rows;
        a[j].mix(a[j + 1], s).mix(b[j].mix(b[j + 1], s), self.t)
    }
}

/// Which interval between nodes, and where in it.
#[inline]
fn interval(position: f32) -> (usize, f32) {
    let p = position.clamp(0.0, 1.0) * (NODES - 1) as f32;
    let i = (p as usize).min(NODES - 2);
    (i, p - i as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between the nodes, against four times as many quadrature points each way.
    #[test]
    fn the_tables_interpolate_to_a_thousandth() {
        for k in 0..20 {
            let alpha = ((k as f32 + 0.47) / 20.0).powi(2).max(0.01);
            let table = Albedos::new(alpha);
            for m in 0..20 {
                let mu = 0.01 + 0.99 * (m as f32 + 0.47) / 20.0;
                let (there, exact) = (table.at(mu), integrate(mu, alpha, POINTS.map(|p| 4 * p)));
                assert!(
                    (there.e - exact.e).abs() < 1e-3,
                    "alpha {alpha} mu {mu}: {there:?} {exact:?}"
                );
                assert!(
                    (there.b - exact.b).abs() < 3e-3,
                    "alpha {alpha} mu {mu}: {there:?} {exact:?}"
                );
            }
        }
    }
}
