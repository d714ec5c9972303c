//! Radiosity: a reference without random numbers for scenes of Lambert quads.
//!
//! Two functions on the surfaces, radiosity B = πL_e + ρ ∫ G V B and the camera's importance W =
//! m + ∫ G V ρ W, m the camera's response to radiosity, are constant by patch (Galerkin's method).
//! What comes to a point is exact: Lambert's formula for polygons, over what is visible of a patch,
//! cut out of it by the shadows of the quads in between. Of the four points that stand for a patch
//! one knows how both functions vary within it, and with it most of what the constants leave out of
//! the camera's reading:
//!
//! ⟨m, B⟩ − ⟨m, B_h⟩ = ⟨W − W_h, B₁ − B_h⟩, B₁ = πL_e + ρ ∫ G V B_h
//!
//! (Pierce and Giles, SIAM Rev. 42, 2000; the product is exact with the true W, we use W₁). Patches
//! where the product is large are halved (Becker and Rannacher, Acta Numerica 10, 2001): around
//! small openings the mesh becomes fine by itself.

mod links;
mod mesh;
mod polygon;
mod response;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec3};
use intrados_scene::Camera;
use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use links::{Link, at_points};
use mesh::{Mesh, Walls, bilinear};
use polygon::{Plane, TINY};

/// A Lambert rectangle (or parallelogram) that is lit and bright only in front, the side that
/// `u × v` points to. It stands in the way from both sides.
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

/// How far to refine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Relative error at which to stop.
    pub error: f64,
    /// Number of patches that no mesh exceeds. Time and memory grow with its square: 20 bytes for
    /// every two patches that see each other.
    pub patches: usize,
}

/// A value with an estimate of its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// What it may be off; infinite on the first mesh.
    pub error: f64,
}

/// One mesh on the way, and the camera's mean Y by it, W·m⁻²·sr⁻¹.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Its patches.
    pub patches: usize,
    /// Pairs of patches that see each other.
    pub links: usize,
    /// By what the camera sees: ⟨m, B⟩, corrected.
    pub seen: f64,
    /// By what the lamps send: ⟨πL_e, W⟩, corrected. They would be equal if four points stood for a
    /// patch exactly.
    pub sent: f64,
    /// The correction ⟨W₁ − W_h, B₁ − B_h⟩ in both.
    pub correction: f64,
    /// The mean of both. Its error is the largest of half their difference, of what has changed
    /// since the mesh before and of half the correction, which the next mesh would reduce to about
    /// a quarter.
    pub mean: Estimate,
}

/// Share of the expected error that the patches that are halved stand for (Dörfler, SIAM J. Numer.
/// Anal. 33, 1996).
const BULK: f64 = 0.8;
/// Error of a patch's mean by its four points, as a share of the function's variation within.
const QUADRATURE: f64 = 0.02;
/// Weights of Y.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// A solved scene.
pub struct Radiosity {
    quads: Vec<Quad>,
    walls: Walls,
    mesh: Mesh,
    /// B by patch, W·m⁻², and what of it varies within the patch: see [`bilinear`].
    radiosity: Vec<[DVec3; 4]>,
    /// W by patch less m, and what varies.
    importance: Vec<[DVec3; 4]>,
    /// ∫ m over a patch, and times s, t and s·t.
    response: Vec<[f64; 4]>,
    levels: Vec<Level>,
}

impl Radiosity {
    /// Solves for a camera on finer and finer meshes. What its lens distorts is left out.
    ///
    /// # Errors
    /// [`Cancelled`] if the job is.
    pub fn solve(
        quads: Vec<Quad>,
        camera: &Camera,
        goal: Goal,
        job: &Job,
    ) -> Result<Self, Cancelled> {
        let walls = Walls::new(&quads);
        let mesh = Mesh::first(&walls);
        let mut this = Self {
            quads,
            walls,
            mesh,
            radiosity: vec![],
            importance: vec![],
            response: vec![],
            levels: vec![],
        };
        loop {
            this.solve_mesh(camera, job)?;
            let mean = this.camera_mean();
            if mean.error <= goal.error * mean.value {
                return Ok(this);
            }
            let finer = this.refined();
            let size = finer.patches.len();
            if size == this.mesh.patches.len() || size > goal.patches {
                return Ok(this);
            }
            this.mesh = finer;
        }
    }

    /// The meshes on the way, coarse to fine.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Mean Y of the camera's picture by the finest mesh, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn camera_mean(&self) -> Estimate {
        self.levels.last().map_or(Estimate { value: 0.0, error: f64::INFINITY }, |l| l.mean)
    }

    /// Radiance that leaves the front of quad `quad` at `x`, W·m⁻²·sr⁻¹.
    ///
    /// # Panics
    /// If there is no such quad.
    #[must_use]
    pub fn radiance(&self, quad: usize, x: DVec3) -> DVec3 {
        let q = &self.quads[quad];
        q.emission.as_dvec3()
            + q.albedo.as_dvec3() * self.irradiance(x, self.walls.faces[quad].normal) * FRAC_1_PI
    }

    /// Irradiance at `x` from the side that the unit vector `n` points to, W·m⁻²: what all patches
    /// send there.
    #[must_use]
    pub fn irradiance(&self, x: DVec3, n: DVec3) -> DVec3 {
        self.gathered(x, n, |j| self.radiosity[j][0])
    }

    /// What radiosity at `x` on a surface that faces `n` adds to the camera's mean by later
    /// reflections, for every W·m⁻² on 1 m²: ∫ G V ρ W.
    #[must_use]
    pub fn importance(&self, x: DVec3, n: DVec3) -> DVec3 {
        self.gathered(x, n, |j| self.albedo(j) * self.whole_importance(j))
    }

    /// ∫ G V f over all patches, f constant by patch.
    fn gathered(&self, x: DVec3, n: DVec3, f: impl Fn(usize) -> DVec3) -> DVec3 {
        let mut spare = Default::default();
        let mut sum = DVec3::ZERO;
        for (quad, range) in &self.mesh.ranges {
            let face = &self.walls.faces[*quad];
            if face.plane.height(x) > TINY && !Plane::through(x, n).misses(&face.corners) {
                let view = self.walls.view(x, *quad, &self.walls.obstacles(&[x], *quad));
                for j in range.clone() {
                    sum += f(j) * self.walls.factor(x, n, &self.mesh.patches[j], &view, &mut spare);
                }
            }
        }
        sum
    }

    fn albedo(&self, patch: usize) -> DVec3 {
        self.quads[self.mesh.patches[patch].quad].albedo.as_dvec3()
    }

    fn emitted(&self, patch: usize) -> DVec3 {
        self.quads[self.mesh.patches[patch].quad].emission.as_dvec3() * PI
    }

    /// Mean of W over a patch, m included.
    fn whole_importance(&self, patch: usize) -> DVec3 {
        self.importance[patch][0] + self.response[patch][0] / self.mesh.patches[patch].area
    }

    fn solve_mesh(&mut self, camera: &Camera, job: &Job) -> Result<(), Cancelled> {
        let (walls, mesh) = (&self.walls, &self.mesh);
        let row = |to| {
            if job.is_cancelled() { Err(Cancelled) } else { Ok(links::links(walls, mesh, to)) }
        };
        let links: Vec<Vec<Link>> = mesh.patches.par_iter().map(row).collect::<Result<_, _>>()?;
        self.response = response::response(walls, mesh, camera);
        let by_patch =
            |f: &dyn Fn(usize) -> DVec3| -> Vec<DVec3> { (0..mesh.patches.len()).map(f).collect() };
        let (albedo, emitted, one) = (
            by_patch(&|i| self.albedo(i)),
            by_patch(&|i| self.emitted(i)),
            by_patch(&|_| DVec3::ONE),
        );
        let seen = by_patch(&|i| DVec3::splat(self.response[i][0] / mesh.patches[i].area));
        let radiosity = links::solve(&links, &emitted, &albedo, &one);
        let importance = links::solve(&links, &seen, &one, &albedo);
        let reflected = |(i, row): (usize, &Vec<Link>)| {
            let mut b = bilinear(at_points(row, |j| radiosity[j])).map(|b| b * albedo[i]);
            b[0] += emitted[i];
            b
        };
        self.radiosity = links.iter().enumerate().map(reflected).collect();
        self.importance = links
            .iter()
            .map(|row| bilinear(at_points(row, |j| albedo[j] * importance[j])))
            .collect();
        self.levels.push(self.level(links.iter().map(Vec::len).sum()));
        Ok(())
    }

    fn level(&self, links: usize) -> Level {
        let [mut seen, mut sent, mut correction] = [0.0; 3];
        for (i, patch) in self.mesh.patches.iter().enumerate() {
            let (b, w, m) = (&self.radiosity[i], &self.importance[i], &self.response[i]);
            let varying: DVec3 = (1..4).map(|k| b[k] * m[k]).sum();
            seen += (b[0] * m[0] + varying).dot(LUMINANCE);
            sent +=
                (self.emitted(i) * self.whole_importance(i) * patch.area + varying).dot(LUMINANCE);
            correction += patch.area * (1..4).map(|k| (b[k] * w[k]).dot(LUMINANCE)).sum::<f64>();
        }
        let value = 0.5 * (seen + sent) + correction;
        let change =
            self.levels.last().map_or(f64::INFINITY, |before| (value - before.mean.value).abs());
        let error = change.max(0.5 * (seen - sent).abs()).max(0.5 * correction.abs());
        let (seen, sent) = (seen + correction, sent + correction);
        Level {
            patches: self.mesh.patches.len(),
            links,
            seen,
            sent,
            correction,
            mean: Estimate { value, error },
        }
    }

    /// What is lost by a patch's length along its first or second coordinate: its part of the
    /// correction, and what four points miss of the means of B and W.
    fn loss(&self, patch: usize, coordinate: usize) -> f64 {
        let (b, w, k) = (&self.radiosity[patch], &self.importance[patch], 1 + coordinate);
        let product = (b[k] * w[k]).abs() + (b[3] * w[3]).abs();
        let quadrature = b[k].abs() * self.whole_importance(patch) + b[0] * w[k].abs();
        self.mesh.patches[patch].area * (product + quadrature * QUADRATURE).dot(LUMINANCE)
    }

    /// The next mesh: where most is lost, it is halved.
    fn refined(&self) -> Mesh {
        let patches = 0..self.mesh.patches.len();
        let mut losses: Vec<_> = patches
            .clone()
            .flat_map(|i| [0, 1].map(|k| (self.loss(i, k), i, k)))
            .filter(|l| l.0 > 0.0)
            .collect();
        losses.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut rest = BULK * losses.iter().map(|l| l.0).sum::<f64>();
        let mut along = vec![[false; 2]; patches.len()];
        for (loss, i, k) in losses {
            if rest <= 0.0 {
                break;
            }
            rest -= loss;
            along[i][k] = true;
        }
        self.mesh.halved(&self.walls, &along)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        polygon::{Shadow, area, form_factor},
        *,
    };

    fn wall(corner: Vec3, u: Vec3, v: Vec3, albedo: f32) -> Quad {
        Quad { corner, u, v, albedo: Vec3::splat(albedo), emission: Vec3::ZERO }
    }

    /// Inward: floor, ceiling, −x, +x, −z, +z.
    fn box_of(lo: Vec3, hi: Vec3, albedo: f32) -> Vec<Quad> {
        let d = hi - lo;
        let [x, y, z] = [Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z];
        let walls =
            [(lo, z, x), (lo + y, x, z), (lo, y, z), (lo + x, z, y), (lo, x, y), (lo + z, y, x)];
        walls.map(|(corner, u, v)| wall(corner, u, v, albedo)).to_vec()
    }

    fn camera(position: [f32; 3], target: [f32; 3]) -> Camera {
        Camera {
            name: "camera".into(),
            position: position.into(),
            target: target.into(),
            up: Vec3::Y,
            fov_deg: 60.0,
            width: 32,
            height: 32,
            exposure: 0.0,
            lens: None,
        }
    }

    fn factor(x: DVec3, polygon: &[DVec3]) -> f64 {
        form_factor(x, DVec3::Z, polygon, &mut Vec::new())
    }

    fn square(lo: DVec3, u: f64, v: f64) -> [DVec3; 4] {
        [lo, lo + DVec3::X * u, lo + DVec3::new(u, v, 0.0), lo + DVec3::Y * v]
    }

    /// Parallel unit squares at distance 1: F = .1998 (Howell's catalogue C-11); perpendicular with
    /// a common edge: .2000 (C-14). The mean of point factors over the first square by midpoints,
    /// error of order 1/n².
    #[test]
    fn factors_of_the_catalogue() {
        let mean = |corners: [DVec3; 4]| {
            let n = 60;
            let at = |k: usize| (k as f64 + 0.5) / n as f64;
            let all = (0..n * n).map(|k| factor(DVec3::new(at(k % n), at(k / n), 0.0), &corners));
            all.sum::<f64>() / (n * n) as f64
        };
        let at = |x, y, z| DVec3::new(x, y, z);
        let parallel = mean(square(DVec3::Z, 1.0, 1.0));
        assert!((parallel - 0.199_825).abs() < 2e-5, "{parallel}");
        let perpendicular =
            mean([at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(1.0, 0.0, 1.0), at(0.0, 0.0, 1.0)]);
        assert!((perpendicular - 0.200_044).abs() < 2e-4, "{perpendicular}");
        // Cut by the horizon: the lower half of a wall does not count.
        let wall = |low: f64| {
            [at(-1.0, 1.0, low), at(1.0, 1.0, low), at(1.0, 1.0, 1.0), at(-1.0, 1.0, 1.0)]
        };
        let [half, cut] = [0.0, -3.0].map(|low| factor(DVec3::ZERO, &wall(low)));
        assert!((half - cut).abs() < 1e-12 && half > 0.05, "{half} {cut}");
    }

    /// What a hole of .1 m × .2 m in a plate of four shows of a wide ceiling is as bright as the
    /// hole itself would be; overlapping shadows are not taken twice. And a blocker hides as much
    /// as it covers.
    #[test]
    fn shadows_are_exact() {
        let at = |x, y| DVec3::new(x, y, 1.0);
        let ceiling = square(DVec3::new(-10.0, -10.0, 2.0), 20.0, 20.0).to_vec();
        // Left and right over all of y, above and below over all of x: corners overlap.
        let plate = [
            square(at(-9.0, -9.0), 9.0, 18.0),
            square(at(0.1, -9.0), 9.0, 18.0),
            square(at(-9.0, -9.0), 18.0, 9.0),
            square(at(-9.0, 0.2), 18.0, 9.0),
        ];
        let lit = |x: DVec3, blockers: &[[DVec3; 4]]| {
            blockers.iter().filter_map(|b| Shadow::new(x, b, DVec3::Z)).fold(
                vec![ceiling.clone()],
                |pieces, shadow| {
                    let mut lit = Vec::new();
                    pieces.into_iter().for_each(|p| shadow.take_from(p, &mut lit));
                    lit
                },
            )
        };
        let sum =
            |x: DVec3, pieces: &[Vec<DVec3>]| pieces.iter().map(|p| factor(x, p)).sum::<f64>();
        for x in [
            DVec3::ZERO,
            DVec3::new(0.05, 0.1, 0.0),
            DVec3::new(-1.0, 0.7, 0.3),
            DVec3::new(0.3, 2.0, 0.0),
        ] {
            let (through, hole) =
                (sum(x, &lit(x, &plate)), factor(x, &square(at(0.0, 0.0), 0.1, 0.2)));
            assert!((through - hole).abs() < 1e-12 && hole > 1e-5, "{through} {hole}");
            let table = square(at(-1.0, -1.0), 1.2, 2.0);
            let (beside, hidden) = (sum(x, &lit(x, &[table])), factor(x, &table));
            assert!((beside + hidden - factor(x, &ceiling)).abs() < 1e-12, "{beside} {hidden}");
        }
        // On the ceiling the hole is twice as large from here.
        let spot: f64 = lit(DVec3::ZERO, &plate).iter().map(|p| area(p)).sum();
        assert!((spot - 4.0 * 0.02).abs() < 1e-12, "{spot}");
    }

    /// A closed box with a table in it, all glowing: L = L_e/(1 − ρ) everywhere, and every place
    /// sees nothing but light.
    #[test]
    fn furnace() {
        let mut quads = box_of(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.5), 0.6);
        let (corner, x, z) = (Vec3::new(0.4, 0.3, 0.2), Vec3::X * 1.1, Vec3::Z * 0.7);
        quads.extend([wall(corner, x, z, 0.6), wall(corner, z, x, 0.6)]);
        quads.iter_mut().for_each(|q| q.emission = Vec3::ONE);
        let goal = Goal { error: 0.0, patches: 0 };
        let solved = Radiosity::solve(
            quads,
            &camera([0.7, 0.5, 0.5], [2.0, 0.2, 1.0]),
            goal,
            &Job::default(),
        )
        .unwrap();
        // The lamps' side knows the importance at four points of a patch only.
        let level = solved.levels[0];
        assert!((level.seen - 2.5).abs() < 1e-5 && (level.sent - 2.5).abs() < 2e-3, "{level:?}");
        for (quad, x) in [
            (0, DVec3::new(0.6, 0.0, 0.6)),
            (4, DVec3::new(1.0, 0.29, 0.0)),
            (7, DVec3::new(1.0, 0.3, 0.5)),
        ] {
            let radiance = solved.radiance(quad, x);
            assert!((radiance - 2.5).abs().max_element() < 1e-5, "{radiance}");
        }
    }

    /// Two boxes that share a wall do not see each other's light.
    #[test]
    fn walls_are_tight() {
        let (lo, middle) = (Vec3::ZERO, Vec3::X);
        let mut quads = box_of(lo, Vec3::ONE, 0.5);
        quads.extend(box_of(middle, middle + Vec3::ONE, 0.5));
        quads[0].emission = Vec3::ONE;
        let goal = Goal { error: 0.0, patches: 500 };
        let solved = Radiosity::solve(
            quads,
            &camera([1.5, 0.5, 0.5], [2.0, 0.4, 0.6]),
            goal,
            &Job::default(),
        )
        .unwrap();
        assert_eq!(solved.camera_mean().value, 0.0);
        assert!(solved.radiance(3, DVec3::new(1.0, 0.5, 0.5)).x > 0.05);
    }

    /// The solved functions are what the reading is made of, but for the correction: the mean
    /// radiance over the pixels, and the lamp's power times its importance.
    #[test]
    fn the_functions_give_the_reading() {
        let mut quads = box_of(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 2.0, 1.0), 0.7);
        let lamp = quads.len();
        let (corner, u, v) = (Vec3::new(-0.25, 1.99, -0.25), Vec3::X * 0.5, Vec3::Z * 0.5);
        quads.push(Quad { emission: Vec3::splat(10.0), ..wall(corner, u, v, 0.0) });
        let camera = camera([0.8, 1.2, -0.8], [-0.9, 0.6, 0.6]);
        let solved =
            Radiosity::solve(quads, &camera, Goal { error: 0.0, patches: 1000 }, &Job::default())
                .unwrap();
        let level = solved.levels[solved.levels.len() - 1];

        let eye = camera.position.as_dvec3();
        let pixel = |k: u32| {
            let d = camera.direction((k % 32) as f32 + 0.5, (k / 32) as f32 + 0.5).as_dvec3();
            // From inside of a convex room the nearest wall is the one whose plane the ray meets
            // first; the camera does not see the lamp.
            let distance = |q: usize| {
                let plane = &solved.walls.faces[q].plane;
                let t = -plane.height(eye) / plane.n.dot(d);
                if t > 0.0 { t } else { f64::INFINITY }
            };
            let hit = (0..6).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
            solved.radiance(hit, eye + d * distance(hit)).dot(LUMINANCE)
        };
        let picture = (0..1024).map(pixel).sum::<f64>() / 1024.0;
        assert!(
            (picture / (level.seen - level.correction) - 1.0).abs() < 2e-3,
            "{picture} {level:?}"
        );

        let at = |k: usize| {
            (corner + u * (0.1 + 0.2 * (k % 5) as f32) + v * (0.1 + 0.2 * (k / 5) as f32))
                .as_dvec3()
        };
        let importance: DVec3 =
            (0..25).map(|k| solved.importance(at(k), DVec3::NEG_Y)).sum::<DVec3>() / 25.0;
        let sent = PI * 10.0 * 0.25 * importance.dot(LUMINANCE);
        assert_eq!(solved.response[solved.mesh.ranges[lamp].1.start], [0.0; 4]);
        assert!((sent / (level.sent - level.correction) - 1.0).abs() < 2e-3, "{sent} {level:?}");
    }
}
