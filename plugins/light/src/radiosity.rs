//! Radiosity: a reference without random numbers for scenes of Lambert quads.
//!
//! Quads are cut into patches of constant radiosity B = πL_e + ρ Σ F B. The factor F from a point to a patch is exact (Lambert's
//! formula for a polygon) where nothing is in between, else it is multiplied by the visible share of a few points.
//! A picture gathers once more from every patch, so that what is constant by patch is only the light that has been
//! reflected at least once. The error falls with about the square of the patches' size, and two sizes
//! tell it.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec3};
use intrados_scene::Camera;
use rayon::prelude::*;

/// A Lambert rectangle (or parallelogram) that is seen, lit and bright only in front, the side that `u × v` points to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quad {
    /// A corner, m.
    pub corner: Vec3,
    /// One edge, m.
    pub u: Vec3,
    /// The other edge, m.
    pub v: Vec3,
    /// Reflectance, below 1.
    pub albedo: Vec3,
    /// L_e, W·m⁻²·sr⁻¹.
    pub emission: Vec3,
}

/// A value with an estimate of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Extrapolated from two sizes of patch.
    pub value: f64,
    /// How far the extrapolation went.
    pub error: f64,
}

/// Gauss and Legendre's two points of [0, 1], both of weight ½: 2 × 2 of them stand for a patch that receives, and are asked for the
/// visibility of one that sends. With one point in the middle the error falls only as h² log 1/h, light near edges having a logarithmic slope.
const POINTS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
/// Relative change of the largest radiosity at which the iteration stops, and the most sweeps.
const CONVERGED: (f64, usize) = (1e-9, 10_000);

/// Mean Y of a camera's picture, W·m⁻²·sr⁻¹: solved with patches no longer than `size` and than half of it, extrapolated by Richardson.
/// `visible` says whether two points see each other.
pub fn camera_mean(quads: &[Quad], camera: &Camera, size: f32, visible: &(impl Fn(Vec3, Vec3) -> bool + Sync)) -> Estimate {
    let [coarse, fine] = [size, 0.5 * size].map(|size| Radiosity::solve(quads, size, visible).camera_mean(camera));
    Estimate { value: fine + (fine - coarse) / 3.0, error: (fine - coarse).abs() / 3.0 }
}

/// A solved scene.
pub struct Radiosity<'a, V> {
    quads: &'a [Quad],
    patches: Vec<Patch>,
    /// W·m⁻², by patch.
    radiosity: Vec<DVec3>,
    visible: &'a V,
}

struct Patch {
    quad: usize,
    corners: [DVec3; 4],
    points: [DVec3; 4],
    normal: DVec3,
}

impl Patch {
    /// The part of a quad between two pairs of its coordinates.
    fn new(quad: usize, q: &Quad, [u0, u1]: [f64; 2], [v0, v1]: [f64; 2]) -> Self {
        let at = |u: f64, v: f64| q.corner.as_dvec3() + q.u.as_dvec3() * u + q.v.as_dvec3() * v;
        let point = |t: usize, lo: f64, hi: f64| lo + (hi - lo) * POINTS[t];
        Self {
            quad,
            corners: [at(u0, v0), at(u1, v0), at(u1, v1), at(u0, v1)],
            points: std::array::from_fn(|k| at(point(k % 2, u0, u1), point(k / 2, v0, v1))),
            normal: normal(q),
        }
    }

    /// Share of the light that leaves `x`'s surface for this patch, visibility included.
    fn form_factor(&self, x: DVec3, n: DVec3, visible: &impl Fn(Vec3, Vec3) -> bool) -> f64 {
        if (x - self.corners[0]).dot(self.normal) < 1e-9 {
            return 0.0;
        }
        let f = polygon_factor(x, n, &self.corners);
        if f <= 0.0 {
            return 0.0;
        }
        let seen = self.points.iter().filter(|p| visible(x.as_vec3(), p.as_vec3())).count();
        f * seen as f64 / self.points.len() as f64
    }
}

fn normal(q: &Quad) -> DVec3 {
    q.u.as_dvec3().cross(q.v.as_dvec3()).normalize_or_zero()
}

/// Lambert's formula: F = 1/2π |Σ angle of edge · cosine between n and the edge's plane|, of the part of the polygon before the horizon of
/// the surface at `x` with normal `n`.
fn polygon_factor(x: DVec3, n: DVec3, corners: &[DVec3; 4]) -> f64 {
    let rays = corners.map(|c| c - x);
    let heights = rays.map(|r| n.dot(r));
    if heights.iter().all(|&h| h <= 1e-12) {
        return 0.0;
    }
    let mut sum = 0.0;
    let mut edge = |a: DVec3, b: DVec3| {
        let cross = a.cross(b);
        let length = cross.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * n.dot(cross) / length;
        }
    };
    // Clipped at the horizon: the new edge along it lies in the plane of x and adds the angle between its ends times cos 0 = ±1.
    let mut crossings = [None; 2];
    for i in 0..4 {
        let (a, b, ha, hb) = (rays[i], rays[(i + 1) % 4], heights[i], heights[(i + 1) % 4]);
        let middle = || a + (b - a) * (ha / (ha - hb));
        match (ha >= 0.0, hb >= 0.0) {
            (true, true) => edge(a, b),
            (true, false) => {
                crossings[0] = Some(middle());
                edge(a, middle());
            }
            (false, true) => {
                crossings[1] = Some(middle());
                edge(middle(), b);
            }
            (false, false) => {}
        }
    }
    if let [Some(out), Some(back)] = crossings {
        edge(out, back);
    }
    (0.5 * FRAC_1_PI * sum).abs()
}

impl<'a, V: Fn(Vec3, Vec3) -> bool + Sync> Radiosity<'a, V> {
    /// Cuts the quads into patches no longer than `size` and solves by Gauss and Seidel's iteration.
    pub fn solve(quads: &'a [Quad], size: f32, visible: &'a V) -> Self {
        let mut patches = Vec::new();
        for (i, q) in quads.iter().enumerate() {
            let [nu, nv] = [q.u, q.v].map(|e| ((e.length() / size - 1e-3).ceil() as usize).clamp(1, 1000));
            let part = |k: usize, n: usize| [k as f64 / n as f64, (k + 1) as f64 / n as f64];
            patches.extend((0..nu * nv).map(|k| Patch::new(i, q, part(k % nu, nu), part(k / nu, nv))));
        }
        let factors: Vec<Vec<f32>> = patches
            .par_iter()
            .map(|to| {
                let black = quads[to.quad].albedo == Vec3::ZERO;
                let factor = |from: &Patch| {
                    let points = to.points.iter().map(|&x| from.form_factor(x, to.normal, visible));
                    (points.sum::<f64>() / to.points.len() as f64) as f32
                };
                if black { Vec::new() } else { patches.iter().map(factor).collect() }
            })
            .collect();
        let emitted: Vec<DVec3> = patches.iter().map(|p| quads[p.quad].emission.as_dvec3() * PI).collect();
        let mut radiosity = emitted.clone();
        for _ in 0..CONVERGED.1 {
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for (i, row) in factors.iter().enumerate() {
                let arriving: DVec3 = row.iter().zip(&radiosity).map(|(&f, &b)| b * f64::from(f)).sum();
                let new = emitted[i] + quads[patches[i].quad].albedo.as_dvec3() * arriving;
                change = change.max((new - radiosity[i]).abs().max_element());
                largest = largest.max(new.max_element());
                radiosity[i] = new;
            }
            if change <= CONVERGED.0 * largest {
                break;
            }
        }
        Self { quads, patches, radiosity, visible }
    }

    /// Radiance that leaves the front of quad `quad` at `x`: one more exact gathering.
    #[must_use]
    pub fn radiance(&self, quad: usize, x: DVec3) -> DVec3 {
        let q = &self.quads[quad];
        let n = normal(q);
        let gather = |(p, &b): (&Patch, &DVec3)| if b == DVec3::ZERO { b } else { b * p.form_factor(x, n, self.visible) };
        let irradiance: DVec3 =
            if q.albedo == Vec3::ZERO { DVec3::ZERO } else { self.patches.iter().zip(&self.radiosity).map(gather).sum() };
        q.emission.as_dvec3() + q.albedo.as_dvec3() * irradiance * FRAC_1_PI
    }

    /// Mean Y over a camera's picture, one ray through the middle of every pixel.
    #[must_use]
    pub fn camera_mean(&self, camera: &Camera) -> f64 {
        let origin = camera.position.as_dvec3();
        let row = |y: u32| {
            let pixel = |x: u32| {
                let d = camera.direction(x as f32 + 0.5, y as f32 + 0.5).as_dvec3();
                let hit =
                    self.quads.iter().enumerate().filter_map(|(i, q)| Some((i, hit(q, origin, d)?))).min_by(|a, b| a.1.total_cmp(&b.1));
                hit.map_or(0.0, |(i, t)| self.radiance(i, origin + d * t).dot(DVec3::new(0.2126, 0.7152, 0.0722)))
            };
            (0..camera.width).map(pixel).sum::<f64>()
        };
        let rows: Vec<f64> = (0..camera.height).into_par_iter().map(row).collect();
        rows.iter().sum::<f64>() / (f64::from(camera.width) * f64::from(camera.height))
    }
}

/// Distance along `d` from `o` to a quad's front.
fn hit(q: &Quad, o: DVec3, d: DVec3) -> Option<f64> {
    let (u, v) = (q.u.as_dvec3(), q.v.as_dvec3());
    let n = u.cross(v);
    let t = (q.corner.as_dvec3() - o).dot(n) / d.dot(n);
    let p = o + d * t - q.corner.as_dvec3();
    let (a, b) = (p.cross(v).dot(n) / n.length_squared(), u.cross(p).dot(n) / n.length_squared());
    (d.dot(n) < 0.0 && t > 1e-9 && (-1e-9..=1.0 + 1e-9).contains(&a) && (-1e-9..=1.0 + 1e-9).contains(&b)).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_of(lo: Vec3, hi: Vec3, albedo: f32) -> Vec<Quad> {
        let d = hi - lo;
        let [x, y, z] = [Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z];
        // Inward: floor, ceiling, −x, +x, −z, +z.
        let walls = [(lo, z, x), (lo + y, x, z), (lo, y, z), (lo + x, z, y), (lo, x, y), (lo + z, y, x)];
        walls.map(|(corner, u, v)| Quad { corner, u, v, albedo: Vec3::splat(albedo), emission: Vec3::ZERO }).to_vec()
    }

    fn camera(position: [f32; 3], target: [f32; 3], pixels: u32) -> Camera {
        Camera {
            name: "camera".into(),
            position: position.into(),
            target: target.into(),
            up: Vec3::Y,
            fov_deg: 60.0,
            width: pixels,
            height: pixels,
            exposure: 0.0,
        }
    }

    fn lamp(corner: [f32; 3], u: Vec3, v: Vec3) -> Quad {
        Quad { corner: corner.into(), u, v, albedo: Vec3::ZERO, emission: Vec3::splat(10.0) }
    }

    /// Parallel unit squares at distance 1: F = .1998 (Howell's catalogue C-11); perpendicular with a common edge: .2000 (C-14).
    /// The mean of point factors over the first square by Gauss-free midpoints, error of order 1/n².
    #[test]
    fn factors_of_the_catalogue() {
        let mean = |corners: [DVec3; 4]| {
            let n = 60;
            let at = |k: usize| (k as f64 + 0.5) / n as f64;
            let all = (0..n * n).map(|k| polygon_factor(DVec3::new(at(k % n), at(k / n), 0.0), DVec3::Z, &corners));
            all.sum::<f64>() / (n * n) as f64
        };
        let at = |x, y, z| DVec3::new(x, y, z);
        let parallel = mean([at(0.0, 0.0, 1.0), at(1.0, 0.0, 1.0), at(1.0, 1.0, 1.0), at(0.0, 1.0, 1.0)]);
        assert!((parallel - 0.199_825).abs() < 2e-5, "{parallel}");
        let perpendicular = mean([at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(1.0, 0.0, 1.0), at(0.0, 0.0, 1.0)]);
        assert!((perpendicular - 0.200_044).abs() < 2e-4, "{perpendicular}");
        // Cut by the horizon: the lower half of a wall does not count.
        let wall = |low: f64| [at(-1.0, 1.0, low), at(1.0, 1.0, low), at(1.0, 1.0, 1.0), at(-1.0, 1.0, 1.0)];
        let [half, cut] = [0.0, -3.0].map(|low| polygon_factor(DVec3::ZERO, DVec3::Z, &wall(low)));
        assert!((half - cut).abs() < 1e-12 && half > 0.05, "{half} {cut}");
    }

    /// A closed box whose walls all glow: L = L_e/(1 − ρ) everywhere.
    #[test]
    fn furnace() {
        let mut quads = box_of(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.5), 0.6);
        quads.iter_mut().for_each(|q| q.emission = Vec3::ONE);
        let solved = Radiosity::solve(&quads, 0.5, &|_, _| true);
        let mean = solved.camera_mean(&camera([0.7, 0.5, 0.5], [2.0, 0.2, 1.0], 4));
        assert!((mean - 2.5).abs() < 1e-5, "{mean}");
    }

    /// The corridor of the transport test set: reference 1.3021e-2 ± .1 %. The lamp fills its end, so the box ends there.
    #[test]
    fn corridor() {
        let mut quads = box_of(Vec3::ZERO, Vec3::new(11.99, 1.0, 1.0), 0.5);
        quads[3] = lamp([11.99, 0.0, 0.0], Vec3::Z, Vec3::Y);
        let mean = camera_mean(&quads, &camera([0.6, 0.5, 0.5], [0.0, 0.5, 0.5], 32), 0.34, &|_, _| true);
        assert!((mean.value / 1.3021e-2 - 1.0).abs() < 1e-3 && mean.error < 1e-3 * mean.value, "{mean:?}");
    }

    /// The room of the transport test set: reference .27023 ± .1 %. Only the lamp stands in anything's way.
    #[test]
    fn room() {
        let mut quads = box_of(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 0.7);
        quads.push(lamp([-0.25, 1.99, -0.25], Vec3::X * 0.5, Vec3::Z * 0.5));
        let visible = |a: Vec3, b: Vec3| {
            let (above, below) = (a.y - 1.99, b.y - 1.99);
            let p = a + (b - a) * (above / (above - below));
            above.abs() < 1e-6 || below.abs() < 1e-6 || above * below > 0.0 || p.x.abs() > 0.25 || p.z.abs() > 0.25
        };
        let mean = camera_mean(&quads, &camera([0.8, 1.2, -0.8], [-0.9, 0.6, 0.6], 32), 0.25, &visible);
        assert!((mean.value / 0.270_23 - 1.0).abs() < 1e-3 && mean.error < 1e-3 * mean.value, "{mean:?}");
    }
}
