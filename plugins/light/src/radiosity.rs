//! Radiosity: a reference without random numbers for scenes of Lambert quads.
//!
//! Two functions on the surfaces, radiosity B = πL_e + ρ ∫ G V B and the camera's importance W = m + ∫ G V ρ W, m the camera's response to
//! radiosity, are constant by patch (Galerkin's method). What comes to a point is exact: Lambert's formula for
//! polygons, over what is visible of a patch, cut out of it by the shadows of the quads in between. Of the four points that stand for
//! a patch one knows how both functions vary within it, and with it most of what the constants leave out of the camera's reading:
//!
//! ⟨m, B⟩ − ⟨m, B_h⟩ = ⟨W − W_h, B₁ − B_h⟩, B₁ = πL_e + ρ ∫ G V B_h
//!
//! (Pierce and Giles, SIAM Rev. 42, 2000; the product is exact with the true W, we use W₁). Patches where the product is large are
//! halved (Becker and Rannacher, Acta Numerica 10, 2001): around small openings the mesh becomes fine by itself.

mod mesh;
mod polygon;

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec3};
use intrados_scene::Camera;
use rayon::prelude::*;

use mesh::{GAUSS, Patch, Room, View, bilinear};
use polygon::{Plane, Polygon, TINY, area};

/// A Lambert rectangle (or parallelogram) that is lit and bright only in front, the side that `u × v` points to. It stands in the
/// way from both sides.
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
    /// Of the finest mesh.
    pub value: f64,
    /// What it may be off.
    pub error: f64,
}

/// How far to refine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Goal {
    /// Relative error at which to stop.
    pub error: f64,
    /// Number of patches that no mesh exceeds: memory and time grow with its square.
    pub patches: usize,
}

/// One mesh on the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Its patches.
    pub patches: usize,
    /// Pairs of patches that see each other.
    pub links: usize,
    /// The camera's mean Y, W·m⁻²·sr⁻¹, by what it sees: ⟨m, B⟩, corrected.
    pub seen: f64,
    /// The same by what the lamps send: ⟨πL_e, W⟩, corrected.
    pub sent: f64,
    /// The part ⟨W₁ − W_h, B₁ − B_h⟩ in both.
    pub correction: f64,
}

/// Relative change of a patch at which the iteration stops, and the most sweeps. By patch: in a maze they differ by many decades.
const CONVERGED: (f64, usize) = (1e-10, 10_000);
/// Patches of the first mesh, about.
const FIRST: f64 = 400.0;
/// Share of the expected error that the patches that are halved stand for (Dörfler, SIAM J. Numer. Anal. 33, 1996).
const BULK: f64 = 0.8;
/// Error of a patch's mean by its four points, as a share of the function's variation within.
const QUADRATURE: f64 = 0.02;
/// Weights of Y.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// Light from patch `from`: its form factor from each of a patch's four points.
#[derive(Clone, Copy)]
struct Link {
    from: u32,
    factors: [f32; 4],
}

/// A solved scene.
pub struct Radiosity<'a> {
    quads: &'a [Quad],
    room: Room,
    /// Ordered by quad.
    patches: Vec<Patch>,
    /// B by patch, W·m⁻², and what of it varies within the patch: see [`bilinear`].
    radiosity: Vec<[DVec3; 4]>,
    /// W less m by patch, and what varies.
    importance: Vec<[DVec3; 4]>,
    /// ∫ m over a patch, and times s, t and s·t.
    response: Vec<[f64; 4]>,
    levels: Vec<Level>,
}

/// Mean Y of a camera's picture, W·m⁻²·sr⁻¹.
#[must_use]
pub fn camera_mean(quads: &[Quad], camera: &Camera, goal: Goal) -> Estimate {
    Radiosity::solve(quads, camera, goal).camera_mean()
}

impl<'a> Radiosity<'a> {
    /// Solves for a camera on finer and finer meshes.
    #[must_use]
    pub fn solve(quads: &'a [Quad], camera: &Camera, goal: Goal) -> Self {
        let room = Room::new(quads);
        let patches = first_mesh(&room);
        let between = obstacles(&room);
        let mut this =
            Self { quads, room, patches, radiosity: Vec::new(), importance: Vec::new(), response: Vec::new(), levels: Vec::new() };
        loop {
            this.solve_mesh(camera, &between);
            let mean = this.camera_mean();
            if mean.error <= goal.error * mean.value {
                return this;
            }
            let Some(finer) = this.refined(goal.patches) else { return this };
            this.patches = finer;
        }
    }

    /// Mean Y of the camera's picture, W·m⁻²·sr⁻¹.
    #[must_use]
    pub fn camera_mean(&self) -> Estimate {
        let mean = |l: &Level| 0.5 * (l.seen + l.sent);
        match &self.levels[..] {
            [.., before, last] => Estimate {
                value: mean(last),
                error: (mean(last) - mean(before)).abs().max(0.5 * (last.seen - last.sent).abs()).max(last.correction.abs() / 4.0),
            },
            [only] => Estimate { value: mean(only), error: f64::INFINITY },
            [] => Estimate { value: 0.0, error: f64::INFINITY },
        }
    }

    /// The meshes on the way, coarse to fine.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Radiance that leaves the front of quad `quad` at `x`, W·m⁻²·sr⁻¹: what all patches send there.
    #[must_use]
    pub fn radiance(&self, quad: usize, x: DVec3) -> DVec3 {
        let q = &self.quads[quad];
        let irradiance = if q.albedo == Vec3::ZERO { DVec3::ZERO } else { self.gathered(quad, x, |j| self.radiosity[j][0]) };
        q.emission.as_dvec3() + q.albedo.as_dvec3() * irradiance * FRAC_1_PI
    }

    /// What light of 1 W·m⁻² that leaves the front of quad `quad` at `x` adds to the camera's mean by reflections, a share of 1 m²: W less what the
    /// camera sees directly.
    #[must_use]
    pub fn importance(&self, quad: usize, x: DVec3) -> DVec3 {
        self.gathered(quad, x, |j| self.quads[self.patches[j].quad].albedo.as_dvec3() * self.whole_importance(j))
    }

    /// ∫ G V f over all patches, f constant by patch.
    fn gathered(&self, quad: usize, x: DVec3, f: impl Fn(usize) -> DVec3) -> DVec3 {
        let n = self.room.faces[quad].normal;
        let mut spare = Default::default();
        let mut sum = DVec3::ZERO;
        for (to, range) in ranges(&self.patches) {
            let face = &self.room.faces[to];
            if face.plane.height(x) > TINY && !Plane::through(x, n).misses(&face.corners) {
                let view = self.room.view(x, to, &self.room.between(&[x], to));
                for j in range {
                    sum += f(j) * self.room.factor(x, n, &self.patches[j], &view, &mut spare);
                }
            }
        }
        sum
    }

    /// Mean of W over a patch, m included.
    fn whole_importance(&self, j: usize) -> DVec3 {
        self.importance[j][0] + self.response[j][0] / self.patches[j].area
    }

    fn solve_mesh(&mut self, camera: &Camera, between: &[Vec<Option<Vec<usize>>>]) {
        let ranges = ranges(&self.patches);
        let links: Vec<Vec<Link>> = self.patches.par_iter().map(|to| links(&self.room, &self.patches, &ranges, to, between)).collect();
        self.response = response(&self.room, &self.patches, &ranges, camera);
        let albedo: Vec<DVec3> = self.patches.iter().map(|p| self.quads[p.quad].albedo.as_dvec3()).collect();
        let emitted: Vec<DVec3> = self.patches.iter().map(|p| self.quads[p.quad].emission.as_dvec3() * PI).collect();
        let seen: Vec<DVec3> = self.response.iter().zip(&self.patches).map(|(m, p)| DVec3::splat(m[0] / p.area)).collect();
        let ones = vec![DVec3::ONE; albedo.len()];
        let radiosity = iterate(&links, &emitted, &albedo, &ones);
        let importance = iterate(&links, &seen, &ones, &albedo);
        let at_points = |row: &[Link], f: &dyn Fn(usize) -> DVec3| {
            let mut sum = [DVec3::ZERO; 4];
            for link in row {
                let f = f(link.from as usize);
                sum.iter_mut().zip(link.factors).for_each(|(s, factor)| *s += f * f64::from(factor));
            }
            bilinear(sum)
        };
        self.radiosity = (links.iter().zip(&albedo).zip(&emitted))
            .map(|((row, &albedo), &emitted)| {
                let [mean, s, t, st] = at_points(row, &|j| radiosity[j]).map(|b| b * albedo);
                [emitted + mean, s, t, st]
            })
            .collect();
        self.importance = links.iter().map(|row| at_points(row, &|j| albedo[j] * importance[j])).collect();
        self.levels.push(self.level(&emitted, links.iter().map(Vec::len).sum()));
    }

    fn level(&self, emitted: &[DVec3], links: usize) -> Level {
        let [mut seen, mut sent, mut correction] = [0.0; 3];
        for (i, patch) in self.patches.iter().enumerate() {
            let (b, w, m) = (&self.radiosity[i], &self.importance[i], &self.response[i]);
            let varying: DVec3 = (1..4).map(|k| b[k] * m[k]).sum();
            seen += (b[0] * m[0] + varying).dot(LUMINANCE);
            sent += (emitted[i] * self.whole_importance(i) * patch.area + varying).dot(LUMINANCE);
            correction += patch.area * (1..4).map(|k| (b[k] * w[k]).dot(LUMINANCE)).sum::<f64>();
        }
        Level { patches: self.patches.len(), links, seen: seen + correction, sent: sent + correction, correction }
    }

    /// The next mesh; `None` where it would have too many patches or nothing is to be gained.
    fn refined(&self, most: usize) -> Option<Vec<Patch>> {
        // What is lost by a patch's length along one coordinate: its part of the correction, and what four points miss of a mean.
        let loss = |i: usize, k: usize| {
            let (b, w, area) = (&self.radiosity[i], &self.importance[i], self.patches[i].area);
            let product = (b[k] * w[k]).abs() + (b[3] * w[3]).abs();
            let quadrature = b[k].abs() * self.whole_importance(i) + b[0] * w[k].abs();
            area * (product + quadrature * QUADRATURE).dot(LUMINANCE)
        };
        let mut losses: Vec<(f64, usize, usize)> =
            (0..self.patches.len()).flat_map(|i| [1, 2].map(|k| (loss(i, k), i, k))).filter(|l| l.0 > 0.0).collect();
        losses.sort_by(|a, b| b.0.total_cmp(&a.0));
        let all: f64 = losses.iter().map(|l| l.0).sum();
        let mut along = vec![[false; 2]; self.patches.len()];
        let mut taken = 0.0;
        for (loss, i, k) in losses {
            if taken >= BULK * all {
                break;
            }
            taken += loss;
            along[i][k - 1] = true;
        }
        let faces = &self.room.faces;
        let finer: Vec<Patch> = self.patches.iter().zip(along).flat_map(|(p, along)| p.split(&faces[p.quad], along)).collect();
        (finer.len() > self.patches.len() && finer.len() <= most).then_some(finer)
    }
}

/// Every quad in parts of about the same size.
fn first_mesh(room: &Room) -> Vec<Patch> {
    let all: f64 = room.faces.iter().map(|f| f.area).sum();
    let size = (all / FIRST).sqrt();
    let mut patches = Vec::new();
    for (quad, face) in room.faces.iter().enumerate().filter(|(_, f)| f.area > 0.0) {
        let [nu, nv] = [1, 3].map(|k| (face.corners[0].distance(face.corners[k]) / size).ceil().clamp(1.0, FIRST) as usize);
        let part = |k: usize, n: usize| [k as f64 / n as f64, (k + 1) as f64 / n as f64];
        patches.extend((0..nu * nv).map(|k| Patch::new(quad, face, [part(k % nu, nu), part(k / nu, nv)])));
    }
    patches
}

/// Every quad that has patches, with the range of them.
fn ranges(patches: &[Patch]) -> Vec<(usize, std::ops::Range<usize>)> {
    let mut start = 0;
    let range = |same: &[Patch]| {
        start += same.len();
        (same[0].quad, start - same.len()..start)
    };
    patches.chunk_by(|a, b| a.quad == b.quad).map(range).collect()
}

/// What can stand between every two quads: `None` for two that do not face each other.
fn obstacles(room: &Room) -> Vec<Vec<Option<Vec<usize>>>> {
    let facing = |a: usize, b: usize| !room.faces[a].plane.misses(&room.faces[b].corners);
    let all = 0..room.faces.len();
    let row = |from: usize| {
        let to = |to: usize| (facing(from, to) && facing(to, from)).then(|| room.between(&room.faces[from].corners, to));
        all.clone().map(to).collect()
    };
    all.clone().into_par_iter().map(row).collect()
}

/// All that a patch receives.
fn links(
    room: &Room,
    patches: &[Patch],
    ranges: &[(usize, std::ops::Range<usize>)],
    to: &Patch,
    between: &[Vec<Option<Vec<usize>>>],
) -> Vec<Link> {
    let n = room.faces[to.quad].normal;
    let mut spare: [Polygon; 3] = Default::default();
    let mut links = Vec::new();
    for (quad, range) in ranges {
        let Some(between) = &between[to.quad][*quad] else { continue };
        let views: [Option<View>; 4] = to.points.map(|x| {
            let ahead = room.faces[*quad].plane.height(x) > TINY;
            ahead.then(|| room.view(x, *quad, between)).filter(|v| !matches!(v, View::Pieces(p) if p.is_empty()))
        });
        if views.iter().all(Option::is_none) {
            continue;
        }
        for from in range.clone() {
            let mut factor = |k: usize| match &views[k] {
                Some(view) => room.factor(to.points[k], n, &patches[from], view, &mut spare) as f32,
                None => 0.0,
            };
            let factors = [factor(0), factor(1), factor(2), factor(3)];
            if factors != [0.0; 4] {
                links.push(Link { from: from as u32, factors });
            }
        }
    }
    links
}

/// x = source + after ∫ G V before x by Gauss and Seidel's iteration.
fn iterate(links: &[Vec<Link>], source: &[DVec3], after: &[DVec3], before: &[DVec3]) -> Vec<DVec3> {
    let mut x = source.to_vec();
    for _ in 0..CONVERGED.1 {
        let mut converged = true;
        for (i, row) in links.iter().enumerate() {
            let term = |link: &Link| before[link.from as usize] * x[link.from as usize] * f64::from(link.factors.iter().sum::<f32>());
            let new = source[i] + after[i] * row.iter().map(term).sum::<DVec3>() * 0.25;
            converged &= (new - x[i]).abs().cmple(CONVERGED.0 * new).all();
            x[i] = new;
        }
        if converged {
            break;
        }
    }
    x
}

/// ∫ m, ∫ m s, ∫ m t and ∫ m s t over every patch, m = 1/π · share of the picture: what is visible of a patch is projected on the picture.
fn response(room: &Room, patches: &[Patch], ranges: &[(usize, std::ops::Range<usize>)], camera: &Camera) -> Vec<[f64; 4]> {
    let eye = camera.position.as_dvec3();
    let [right, up, forward] = camera.frame().map(|e| e.as_dvec3());
    let [hx, hy] = camera.half_extent().map(f64::from);
    // A picture's sides, and points of the picture, −1…1 across and up.
    let sides = [forward * hx - right, forward * hx + right, forward * hy - up, forward * hy + up].map(|n| Plane::through(eye, n.normalize()));
    let project = |p: &DVec3| {
        let d = *p - eye;
        DVec3::new(d.dot(right) / hx, d.dot(up) / hy, 0.0) / d.dot(forward)
    };
    let mut responses = vec![[0.0; 4]; patches.len()];
    for (quad, range) in ranges {
        let face = &room.faces[*quad];
        if face.plane.height(eye) <= TINY {
            continue;
        }
        let view = room.view(eye, *quad, &room.between(&[eye], *quad));
        let (mut one, mut other) = (Polygon::new(), Polygon::new());
        for j in range.clone() {
            let patch = &patches[j];
            room.pieces(&view, patch, [&mut one, &mut other], |piece| {
                let inside = sides.iter().fold(piece.to_vec(), |rest, side| {
                    let mut into = Polygon::new();
                    side.cut(&rest, &mut into);
                    into
                });
                let picture: Polygon = inside.iter().map(project).collect();
                // In triangles, each by the middles of its edges: exact for squares.
                for pair in picture.windows(2).skip(1) {
                    let triangle = [picture[0], pair[0], pair[1]];
                    let weight = FRAC_1_PI * area(&triangle) / 4.0 / 3.0;
                    for k in 0..3 {
                        let p = 0.5 * (triangle[k] + triangle[(k + 1) % 3]);
                        let d = forward + right * (p.x * hx) + up * (p.y * hy);
                        let hit = eye + d * (-face.plane.height(eye) / face.plane.n.dot(d));
                        let c = face.coordinates(hit);
                        let [s, t] = [0, 1].map(|k| {
                            let [lo, hi] = patch.part[k];
                            (2.0 * c[k] - lo - hi) / (hi - lo) / GAUSS
                        });
                        responses[j].iter_mut().zip([1.0, s, t, s * t]).for_each(|(r, x)| *r += weight * x);
                    }
                }
            });
        }
    }
    responses
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
