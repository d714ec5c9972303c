//! Grains, pores and cracks of the cases, by a generator of their own: neither that of the
//! specimens (ellipsoids, sums of waves) nor that of the network's lessons (spheres, lobed discs,
//! sums of sines).
//!
//! Grains and bubbles are superquadrics |x/a|^e + |y/b|^e + |z/c|^e < 1 turned at random (Barr
//! 1981), a pore one to three of them grown together, its size by Weibull's law. A crack is a walk:
//! it turns a little at every step, and sharply every few millimetres where it meets a grain, is
//! drawn back to where it was heading, is now narrow and now wide, may fork, and its plane leans.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec2, DVec3};
use intrados_stage::{
    Cancelled, Job,
    random::{Draw, Key},
};
use intrados_xray::{
    specimen::concrete::{FULL, OUTSIDE, Painted},
    volume::Grid,
};
use rayon::prelude::*;

use super::case::{Cracks, ExperimentCase, Grains, Pores, Rod};
use intrados_raster::grid::{Grid as Picture, Mask};

/// Share of the volume that grains large enough to be drawn have.
const COARSE: f64 = 0.36;
/// Diameters of grains, m.
const GRAIN: (f64, f64) = (4e-3, 16e-3);
/// Share of the opening from which a pixel of the truth is a crack: cracks are mostly thinner than
/// pixels.
const CRACKED: f32 = 0.25;

/// Numbers drawn one after the other, rotations among them.
struct Dice(Draw);

impl Dice {
    fn new(seed: u64, of: u64) -> Self {
        Self(Draw::new(Key::new(seed, of)))
    }

    /// A rotation, evenly over all (Shoemake 1992).
    fn turn(&mut self) -> DMat3 {
        let (a, b, c) = (self.0.unit(), TAU * self.0.unit(), TAU * self.0.unit());
        let (r, s) = ((1.0 - a).sqrt(), a.sqrt());
        DMat3::from_quat(
            DQuat::from_xyzw(r * b.sin(), r * b.cos(), s * c.sin(), s * c.cos()).normalize(),
        )
    }
}

/// A superquadric.
#[derive(Debug, Clone, Copy)]
struct Blob {
    centre: DVec3,
    /// Into the frame where it is the unit body.
    unit: DMat3,
    power: f64,
    /// Of the ball round it, m.
    reach: f64,
    /// Mean half axis, m.
    radius: f64,
}

impl Blob {
    fn new(
        centre: DVec3,
        diameter: f64,
        flat: (f64, f64),
        power: (f64, f64),
        dice: &mut Dice,
    ) -> Self {
        let axes = DVec3::new(1.0, dice.0.between(flat.0, flat.1), dice.0.between(flat.0, flat.1));
        let half = axes * (0.5 * diameter / axes.element_product().cbrt());
        let power = dice.0.between(power.0, power.1);
        let unit = DMat3::from_diagonal(half.recip()) * dice.turn().transpose();
        // A cube's corner is √3 away; for other powers 3^(1/2 − 1/e).
        let reach = half.max_element() * 3.0_f64.powf((0.5 - 1.0 / power).max(0.0));
        Self { centre, unit, power, reach, radius: half.element_product().cbrt() }
    }

    /// Distance from its surface, m, negative within; right to first order.
    fn distance(&self, p: DVec3) -> f64 {
        let q = (self.unit * (p - self.centre)).abs();
        let sum = q.x.powf(self.power) + q.y.powf(self.power) + q.z.powf(self.power);
        (sum.powf(1.0 / self.power) - 1.0) * self.radius
    }
}

/// A crack in the plane z = 0, and how its plane leans.
#[derive(Debug, Clone)]
struct Walk {
    points: Vec<DVec2>,
    /// Opening at each point, m.
    widths: Vec<f64>,
    /// Shift per height.
    lean: DVec2,
}

/// All bodies of a case.
#[derive(Debug, Clone)]
pub struct Bodies {
    grains: Vec<(Blob, f32)>,
    pores: Vec<Blob>,
    cracks: Vec<Walk>,
    rods: Vec<Rod>,
}

/// What is true on the pixels that the methods see.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantedTruth {
    /// Half or more of the pixel's volume lies in pores.
    pub pores: Mask,
    /// A quarter or more lies in a crack, and it is no pore.
    pub cracks: Mask,
    /// Concrete and all in it.
    pub body: Mask,
    /// Metal.
    pub steel: Mask,
}

impl Bodies {
    /// All of them within `high` above and below the scan plane, by the case's seed.
    #[must_use]
    pub(crate) fn grow(case: &ExperimentCase, high: f64) -> Self {
        let rods = case.rods();
        let grains = grains(case, high);
        let pores = case.pores.map_or_else(Vec::new, |p| pores(case, &p, &rods, high));
        let cracks = case.cracks.map_or_else(Vec::new, |c| cracks(case, &c, &rods));
        Self { grains, pores, cracks, rods }
    }

    /// Voxels: shares of mortar, rock and steel; and how much of each is pore and crack.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub(crate) fn paint(
        &self,
        case: &ExperimentCase,
        grid: &Grid,
        job: &Job,
    ) -> Result<(Painted, [Vec<f32>; 2]), Cancelled> {
        job.step(0, 1)?;
        let slices: Vec<Layer> =
            (0..grid.size[2]).into_par_iter().map(|z| self.layer(case, grid, z)).collect();
        job.step(1, 1)?;
        let mut painted = Painted {
            grid: *grid,
            shares: Vec::new(),
            labels: Vec::new(),
            voids: [0; 2],
            points: 0,
        };
        let mut voids = [Vec::new(), Vec::new()];
        for layer in slices {
            painted.shares.extend(layer.shares);
            voids[0].extend(layer.pore);
            voids[1].extend(layer.crack);
        }
        // Nobody asks what a voxel mostly is: the truth is told on the pixels of the slice.
        painted.labels.resize(painted.shares.len(), OUTSIDE);
        Ok((painted, voids))
    }

    fn layer(&self, case: &ExperimentCase, grid: &Grid, z: usize) -> Layer {
        let [nx, ny, _] = grid.size;
        let (n, edge, height) = (nx * ny, grid.voxel[0], grid.at(2, z));
        let mut layer = Layer { shares: vec![[0; 4]; n], pore: vec![0.0; n], crack: vec![0.0; n] };
        let (mut rock, mut steel) = (vec![(0.0_f32, 1.0_f32); n], vec![0.0_f32; n]);
        let part = |distance: f64| (0.5 - distance / edge).clamp(0.0, 1.0) as f32;
        for (grain, tone) in &self.grains {
            each(grid, grain.centre.truncate(), ball(grain, height), |i, p| {
                rock[i] = (rock[i].0.max(part(grain.distance(p.extend(height)))), *tone);
            });
        }
        for pore in &self.pores {
            each(grid, pore.centre.truncate(), ball(pore, height), |i, p| {
                layer.pore[i] = layer.pore[i].max(part(pore.distance(p.extend(height))));
            });
        }
        for rod in &self.rods {
            each(grid, rod.at, rod.radius + edge, |i, p| {
                steel[i] = steel[i].max(part(p.distance(rod.at) - rod.radius))
            });
        }
        for crack in &self.cracks {
            for (ends, widths) in crack.points.windows(2).zip(crack.widths.windows(2)) {
                let [a, b] = [ends[0], ends[1]].map(|p| p + height * crack.lean);
                let half = 0.25 * (widths[0] + widths[1]);
                each(grid, 0.5 * (a + b), half + edge + 0.5 * a.distance(b), |i, p| {
                    let d = p.distance(
                        a + (b - a)
                            * ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0),
                    );
                    // Of a voxel's edge across the crack, the part that lies in it.
                    let within = (half.min(d + 0.5 * edge) - (-half).max(d - 0.5 * edge)) / edge;
                    layer.crack[i] = layer.crack[i].max(within.clamp(0.0, 1.0) as f32);
                });
            }
        }
        let outline = case.outline();
        for i in 0..n {
            let p = DVec3::new(grid.at(0, i % nx), grid.at(1, i / nx), height);
            let inside = part(-outline.within(p));
            let concrete = inside * (1.0 - steel[i]);
            layer.pore[i] *= concrete;
            layer.crack[i] *= concrete - layer.pore[i];
            let solid = concrete - layer.pore[i] - layer.crack[i];
            // Sand makes mortar uneven.
            let sand =
                1.0 + 0.04 * (2.0 * Key::new(case.seed ^ 0x5a4d, (z * n + i) as u64).unit(0) - 1.0);
            let (stone, tone) = rock[i];
            let share = |v: f32| (v * f32::from(FULL)).round().clamp(0.0, 255.0) as u8;
            layer.shares[i] = [
                share(sand * solid * (1.0 - stone)),
                share(tone * solid * stone),
                share(steel[i]),
                0,
            ];
        }
        layer
    }

    /// Share of pores in the volume within `high` of the scan plane, by the bodies themselves.
    #[must_use]
    pub fn pores(&self) -> usize {
        self.pores.len()
    }
}

struct Layer {
    shares: Vec<[u8; 4]>,
    pore: Vec<f32>,
    crack: Vec<f32>,
}

/// Radius within which a body may be met at a height; negative where it is not.
fn ball(blob: &Blob, height: f64) -> f64 {
    let square = (1.05 * blob.reach + 1e-3).powi(2) - (height - blob.centre.z).powi(2);
    if square > 0.0 { square.sqrt() } else { -1.0 }
}

/// Every pixel whose middle lies in a square.
fn each(grid: &Grid, at: DVec2, reach: f64, mut act: impl FnMut(usize, DVec2)) {
    let range = |v: f64, k: usize| {
        let place = |v: f64| {
            ((v - grid.origin[k]) / grid.voxel[k]).clamp(0.0, grid.size[k] as f64) as usize
        };
        place(v - reach + 0.5 * grid.voxel[k])..place(v + reach + grid.voxel[k])
    };
    if reach < 0.0 {
        return;
    }
    for y in range(at.y, 1) {
        for x in range(at.x, 0) {
            act(y * grid.size[0] + x, DVec2::new(grid.at(0, x), grid.at(1, y)));
        }
    }
}

/// Places of balls that touch none of those before.
#[derive(Default)]
struct Placed(Vec<(DVec3, f64)>);

impl Placed {
    fn free(&self, at: DVec3, radius: f64) -> bool {
        self.0.iter().all(|(p, r)| p.distance_squared(at) > (r + radius).powi(2))
    }
}

/// Somewhere in the slab.
fn anywhere(case: &ExperimentCase, high: f64, margin: f64, dice: &mut Dice) -> DVec3 {
    let outline = case.outline();
    let half = outline.half();
    loop {
        let p = DVec3::new(
            dice.0.between(-half.x, half.x),
            dice.0.between(-half.y, half.y),
            dice.0.between(-high, high),
        );
        if outline.within(p) > margin {
            return p;
        }
    }
}

fn grains(case: &ExperimentCase, high: f64) -> Vec<(Blob, f32)> {
    let dice = &mut Dice::new(case.seed, 1);
    let slab = high + GRAIN.1;
    let wanted = COARSE * case.outline().area() * 2.0 * slab;
    let (flat, power) = match case.grains {
        Grains::Quartz => ((0.65, 1.0), (1.9, 2.6)),
        Grains::Limestone | Grains::Granite => ((0.5, 1.0), (3.0, 6.0)),
    };
    let (mut placed, mut grains, mut volume, mut failed) = (Placed::default(), Vec::new(), 0.0, 0);
    while volume < wanted && failed < 4000 {
        // Fuller's curve: the volume below a diameter goes as its root, so the number as d^-3.5.
        let (a, b) = (GRAIN.0.powf(-2.5), GRAIN.1.powf(-2.5));
        let diameter = dice.0.between(b, a).powf(-0.4);
        let at = anywhere(case, slab, 0.3 * diameter, dice);
        // The balls of flat and angular grains may overlap a little; so may grains.
        if !placed.free(at, 0.44 * diameter) {
            failed += 1;
            continue;
        }
        placed.0.push((at, 0.44 * diameter));
        volume += PI / 6.0 * diameter.powi(3);
        let tone = dice.0.between(0.95, 1.03) as f32;
        grains.push((Blob::new(at, diameter, flat, power, dice), tone));
    }
    grains
}

fn pores(case: &ExperimentCase, plan: &Pores, rods: &[Rod], high: f64) -> Vec<Blob> {
    let dice = &mut Dice::new(case.seed, 2);
    let (low, top) = (1e-3 * plan.range_mm.0, 1e-3 * plan.range_mm.1);
    let slab = high + top;
    let wanted = plan.porosity * case.outline().area() * 2.0 * slab;
    let (mut placed, mut pores, mut volume, mut failed) = (Placed::default(), Vec::new(), 0.0, 0);
    while volume < wanted && failed < 4000 {
        let diameter = 1e-3 * plan.scale_mm * (-(1.0 - dice.0.unit()).ln()).powf(1.0 / plan.shape);
        if !(low..=top).contains(&diameter) {
            continue;
        }
        let at = anywhere(case, slab, 0.55 * diameter, dice);
        let clear = rods.iter().all(|r| at.truncate().distance(r.at) > r.radius + 0.6 * diameter);
        // Near enough to touch now and then.
        if !(clear && placed.free(at, 0.56 * diameter)) {
            failed += 1;
            continue;
        }
        placed.0.push((at, 0.56 * diameter));
        let lobes = match dice.0.unit() {
            u if u < 0.7 => 1,
            u if u < 0.93 => 2,
            _ => 3,
        };
        // Together about the volume of one.
        let single = diameter * [1.0, 0.86, 0.78][lobes - 1];
        volume += PI / 6.0 * diameter.powi(3);
        let mut centre = at;
        for _ in 0..lobes {
            pores.push(Blob::new(centre, single, (0.7, 1.0), (1.7, 3.0), dice));
            let way = dice.turn().x_axis;
            centre = at + 0.42 * single * way;
        }
    }
    pores
}

fn cracks(case: &ExperimentCase, plan: &Cracks, rods: &[Rod]) -> Vec<Walk> {
    let mut walks = Vec::new();
    for number in 0..plan.count {
        let dice = &mut Dice::new(case.seed, 100 + number as u64);
        let width = 1e-3 * dice.0.between(plan.width_mm.0, plan.width_mm.1);
        let length = 1e-3 * dice.0.between(plan.length_mm.0, plan.length_mm.1);
        // The longest of some tries: walks end where they leave the concrete.
        let tries: Vec<Walk> = (0..40).map(|_| walk(case, length, width, rods, dice)).collect();
        let first = tries.iter().position(|w| w.points.len() as f64 * STEP > 0.85 * length);
        let Some(walk) = tries.get(first.unwrap_or(0)) else { continue };
        walks.push(walk.clone());
        if dice.0.unit() < 0.4 && walk.points.len() > 40 {
            let from = walk.points.len() / 2;
            let heading = (walk.points[from + 5] - walk.points[from]).to_angle()
                + 0.6 * if dice.0.unit() < 0.5 { 1.0 } else { -1.0 };
            let mut fork =
                stroll(case, walk.points[from], heading, 0.4 * length, 0.7 * width, rods, dice);
            fork.lean = walk.lean;
            walks.push(fork);
        }
    }
    walks
}

/// Of a crack, m.
const STEP: f64 = 0.4e-3;

fn walk(case: &ExperimentCase, length: f64, width: f64, rods: &[Rod], dice: &mut Dice) -> Walk {
    let outline = case.outline();
    // From near the surface inwards, or somewhere within.
    let inner = dice.0.unit() < 0.35;
    let at = loop {
        let p = anywhere(case, 0.0, 2.5e-3, dice);
        if inner || outline.within(p) < 4e-3 {
            break p.truncate();
        }
    };
    let heading =
        if inner { dice.0.between(0.0, TAU) } else { (-at).to_angle() + dice.0.between(-0.7, 0.7) };
    stroll(case, at, heading, length, width, rods, dice)
}

fn stroll(
    case: &ExperimentCase,
    from: DVec2,
    heading: f64,
    length: f64,
    width: f64,
    rods: &[Rod],
    dice: &mut Dice,
) -> Walk {
    let outline = case.outline();
    let steps = (length / STEP) as usize;
    let (mut at, mut angle, mut opening, mut kink) =
        (from, heading, 0.0, dice.0.between(2e-3, 8e-3));
    let mut walk = Walk {
        points: Vec::new(),
        widths: Vec::new(),
        lean: dice.0.between(-0.4, 0.4) * DVec2::from_angle(heading + 0.5 * PI),
    };
    for step in 0..steps {
        if outline.within(at.extend(0.0)) < 2e-3
            || rods.iter().any(|r| at.distance(r.at) < r.radius + 1.5e-3)
        {
            break;
        }
        walk.points.push(at);
        let left = (steps - step) as f64 / (0.15 * steps as f64);
        walk.widths.push(width * (1.0_f64 + 0.25 * opening).max(0.5) * left.clamp(0.35, 1.0));
        angle += 0.05 * dice.0.normal() - 0.03 * (angle - heading);
        kink -= STEP;
        if kink < 0.0 {
            angle += 0.45 * dice.0.normal();
            kink = dice.0.between(2e-3, 8e-3);
        }
        opening += 0.25 * dice.0.normal() - 0.05 * opening;
        at += STEP * DVec2::from_angle(angle);
    }
    walk
}

impl PlantedTruth {
    /// On the slice's pixels, each of `by` × `by` voxels in each of the `by` middle layers.
    #[must_use]
    pub fn of(painted: &Painted, voids: &[Vec<f32>; 2], by: usize) -> Self {
        let [nx, ny, nz] = painted.grid.size;
        let (w, h) = (nx / by, ny / by);
        let layers = (nz - by) / 2..(nz - by) / 2 + by;
        let mean = |of: &(dyn Fn(usize) -> f32 + Sync)| {
            let pixel = |i: usize| {
                let (x0, y0) = (i % w * by, i / w * by);
                let mut sum = 0.0;
                for z in layers.clone() {
                    for y in y0..y0 + by {
                        sum += (x0..x0 + by).map(|x| of((z * ny + y) * nx + x)).sum::<f32>();
                    }
                }
                sum / (by * by * by) as f32
            };
            Picture { width: w, height: h, data: (0..w * h).map(pixel).collect::<Vec<f32>>() }
        };
        let (pore, crack) = (mean(&|i| voids[0][i]), mean(&|i| voids[1][i]));
        let full = f32::from(FULL);
        let steel = mean(&|i| f32::from(painted.shares[i][2]) / full);
        let solid = mean(&|i| {
            painted.shares[i].iter().map(|s| f32::from(*s)).sum::<f32>() / full
                + voids[0][i]
                + voids[1][i]
        });
        let pores = pore.map(|v| v >= 0.5);
        let cracks = Mask {
            data: crack.data.iter().zip(&pores.data).map(|(c, p)| *c >= CRACKED && !p).collect(),
            ..pores
        };
        Self { cracks, steel: steel.map(|v| v >= 0.5), body: solid.map(|v| v >= 0.5), pores }
    }
}
