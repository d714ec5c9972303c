//! Bodies to voxels.

use glam::{DVec3, UVec3};
use intrados_stage::{Cancelled, Job, random::Key};
use rayon::prelude::*;

use super::{
    Concrete, Kind, Recipe,
    steel::{Found, Rod},
};
use crate::{
    physics::{Library, PhysicsError},
    volume::Grid,
};

/// A share of 1.
pub const FULL: u8 = 128;
/// Of 64 points, from this many in a crack on a voxel is labelled one: cracks are mostly thinner
/// than voxels.
pub(crate) const CRACK: u32 = 6;
/// The label around the specimen.
pub const OUTSIDE: u8 = Label::Outside as u8;
/// Hardened cement paste, kg/m³.
const PASTE: f64 = 1900.0;
/// Steel, kg/m³.
pub(crate) const STEEL: f64 = 7850.0;
/// Rust at a bar, and the share of iron in it by mass.
pub(crate) const RUST: (f64, f64) = (3600.0, 0.63);
/// Sand makes mortar uneven by so much from place to place.
const SAND: f64 = 0.03;

/// What a voxel is mostly. A pore or a crack counts as nothing where steel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Label {
    /// Around the specimen, and where cover is missing.
    Outside,
    /// Mortar, grains, rust.
    Matrix,
    /// A pore or honeycomb.
    Pore,
    /// A crack.
    Crack,
    /// A bar.
    Steel,
}

/// A specimen as voxels, `[z][y][x]`.
#[derive(Debug, Clone)]
pub struct Painted {
    /// Where the voxels are.
    pub grid: Grid,
    /// Of mortar, rock, steel and rust in every voxel, in units of 1/[`FULL`] at their nominal
    /// densities.
    pub shares: Vec<[u8; 4]>,
    /// [`Label`] of every voxel.
    pub labels: Vec<u8>,
    /// Of 64 points, how many lie in pores; in cracks.
    pub voids: [u64; 2],
    /// Points within the outline.
    pub points: u64,
}

/// Attenuation per metre of mortar, rock, steel and rust at full share, as a function of keV.
///
/// # Errors
/// [`PhysicsError`] if the program's tables are damaged.
pub fn substances(
    concrete: &Concrete,
    library: &Library,
) -> Result<impl Fn(f64) -> [f64; 4] + use<>, PhysicsError> {
    let recipe = &concrete.recipe;
    let (rock, density) = recipe.rock.material();
    let [mortar, rock, steel] =
        ["mortar", rock, "steel"].map(|name| library.material(name).cloned());
    let (mortar, rock, steel) = (mortar?, rock?, steel?);
    // What the placed grains leave of the aggregate is in the mortar.
    let rest = 1.0 - concrete.aggregate;
    let solid = ((recipe.share - concrete.aggregate).max(0.0) * density
        + (1.0 - recipe.share) * PASTE)
        / rest;
    let thin = solid * (1.0 - concrete.fine_air / rest);
    Ok(move |kev| {
        let [m, r, s] = [&mortar, &rock, &steel].map(|m| m.attenuation(kev).total());
        [thin * m, density * r, STEEL * s, RUST.0 * (RUST.1 * s + (1.0 - RUST.1) * m)]
    })
}

/// One voxel's 64 points.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    inside: u64,
    rock: u64,
    pore: u64,
    crack: u64,
    steel: u64,
    rust: u64,
    tone: f32,
}

/// Which of the 64 points of a voxel lie within.
fn mask(p: DVec3, voxel: DVec3, within: impl Fn(DVec3) -> bool) -> u64 {
    let at = |i: u32, shift: u32| (f64::from(i >> shift & 3) + 0.5) * 0.25 - 0.5;
    (0..64)
        .filter(|&i| within(p + voxel * DVec3::new(at(i, 0), at(i, 2), at(i, 4))))
        .fold(0, |m, i| m | 1 << i)
}

impl Concrete {
    /// Voxels of a grid.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub fn paint(&self, grid: &Grid, job: &Job) -> Result<Painted, Cancelled> {
        let slices: Vec<usize> = (0..grid.size[2]).collect();
        let mut painted = Painted {
            grid: *grid,
            shares: Vec::with_capacity(grid.len()),
            labels: Vec::with_capacity(grid.len()),
            voids: [0; 2],
            points: 0,
        };
        // A few slices at a time: their points take 50 bytes a voxel.
        for group in slices.chunks(8) {
            job.step(group[0], slices.len())?;
            let parts: Vec<_> = group.par_iter().map(|&z| self.slice(grid, z)).collect();
            for (shares, labels, [pore, crack], points) in parts {
                painted.shares.extend(shares);
                painted.labels.extend(labels);
                painted.voids[0] += pore;
                painted.voids[1] += crack;
                painted.points += points;
            }
        }
        Ok(painted)
    }

    /// Shares, labels, points in pores and cracks, points within.
    fn slice(&self, grid: &Grid, z: usize) -> (Vec<[u8; 4]>, Vec<u8>, [u64; 2], u64) {
        let mut canvas = Canvas::new(grid, z);
        canvas.outline(&self.recipe);
        canvas.bodies(self);
        let [low, high] = [canvas.low, canvas.high];
        self.nests.iter().filter(|n| n.meets(low, high)).for_each(|nest| {
            canvas.each(|cell, p, voxel, half| {
                let (margin, slope) = nest.margin(p, half);
                if cell.inside != 0 && margin > -slope {
                    cell.pore |= mask(p, voxel, |p| nest.contains(p)) & !cell.rock;
                }
            });
        });
        self.rods.iter().for_each(|rod| canvas.rod(rod));
        for (i, surface) in self.surfaces.iter().enumerate() {
            let seed = self.recipe.seed ^ ((i as u64 + 1) << 32);
            let mut n = (z * grid.slice_len()) as u64;
            canvas.each(|cell, p, voxel, _| {
                n += 1;
                if cell.inside != 0 {
                    cell.crack |= surface.mask(p, voxel, Key::new(seed, n));
                }
            });
        }
        canvas.finish(&self.recipe)
    }
}

/// A slice while it is painted.
struct Canvas<'a> {
    grid: &'a Grid,
    cells: Vec<Cell>,
    voxel: DVec3,
    /// Height of the centres.
    z: f64,
    low: f64,
    high: f64,
    half: f64,
}

impl<'a> Canvas<'a> {
    fn new(grid: &'a Grid, z: usize) -> Self {
        let voxel = DVec3::from_array(grid.voxel);
        let middle = grid.at(2, z);
        let cells = vec![Cell { tone: 1.0, ..Cell::default() }; grid.slice_len()];
        Self {
            grid,
            cells,
            voxel,
            z: middle,
            low: middle - 0.5 * voxel.z,
            high: middle + 0.5 * voxel.z,
            half: 0.5 * voxel.length(),
        }
    }

    fn each(&mut self, mut act: impl FnMut(&mut Cell, DVec3, DVec3, f64)) {
        let [nx, ny, _] = self.grid.size;
        for y in 0..ny {
            for x in 0..nx {
                let p = DVec3::new(self.grid.at(0, x), self.grid.at(1, y), self.z);
                act(&mut self.cells[y * nx + x], p, self.voxel, self.half);
            }
        }
    }

    /// The same for the cells that a box meets.
    fn within(
        &mut self,
        [low, high]: [DVec3; 2],
        mut act: impl FnMut(&mut Cell, DVec3, DVec3, f64),
    ) {
        let [nx, ny, _] = self.grid.size;
        let range = |k: usize, n: usize| {
            let at = |v: f64| {
                ((v - self.grid.origin[k]) / self.grid.voxel[k] + 0.5).clamp(0.0, n as f64)
            };
            at(low[k]) as usize..(at(high[k]).ceil() as usize).min(n)
        };
        let (xs, ys) = (range(0, nx), range(1, ny));
        for y in ys {
            for x in xs.clone() {
                let p = DVec3::new(self.grid.at(0, x), self.grid.at(1, y), self.z);
                act(&mut self.cells[y * nx + x], p, self.voxel, self.half);
            }
        }
    }

    fn outline(&mut self, recipe: &Recipe) {
        let end = 0.5 * recipe.height;
        let inside = |p: DVec3| recipe.outline.within(p) > 0.0 && p.z.abs() <= end;
        let whole = self.low >= -end && self.high <= end;
        let spalls: Vec<_> = recipe
            .spalls
            .iter()
            .filter(|s| (s.centre.z - self.z).abs() < s.radius + s.depth + self.half)
            .collect();
        self.each(|cell, p, voxel, half| {
            let margin = recipe.outline.within(p);
            cell.inside = match () {
                () if margin < -half => 0,
                () if margin > half && whole => !0,
                () => mask(p, voxel, inside),
            };
            if cell.inside != 0 && spalls.iter().any(|s| s.reaches(p, half)) {
                cell.inside &= !mask(p, voxel, |p| spalls.iter().any(|s| s.contains(p)));
            }
        });
    }

    fn bodies(&mut self, concrete: &Concrete) {
        for body in &concrete.bodies {
            let extent = body.extent();
            if body.centre.z - extent.z > self.high || body.centre.z + extent.z < self.low {
                continue;
            }
            let limit = self.half / body.least();
            self.within([body.centre - extent, body.centre + extent], |cell, p, voxel, _| {
                let depth = body.depth(p);
                let points = match () {
                    () if depth > limit => return,
                    () if depth < -limit => !0,
                    () => mask(p, voxel, |p| body.contains(p)),
                };
                match body.kind {
                    Kind::Rock => {
                        cell.rock |= points;
                        if points != 0 {
                            cell.tone = body.tone;
                        }
                    }
                    Kind::Pore => cell.pore |= points,
                }
            });
        }
    }

    fn rod(&mut self, rod: &Rod) {
        let pieces: Vec<_> = rod.pieces(self.low, self.high).collect();
        for (piece, bounds) in pieces {
            self.within(bounds, |cell, p, voxel, half| {
                if !rod.near(piece, p, half) {
                    return;
                }
                cell.steel |= mask(p, voxel, |p| rod.at(piece, p) == Found::Steel);
                cell.rust |= mask(p, voxel, |p| rod.at(piece, p) == Found::Rust);
            });
        }
    }

    fn finish(self, recipe: &Recipe) -> (Vec<[u8; 4]>, Vec<u8>, [u64; 2], u64) {
        let [nx, _, _] = self.grid.size;
        let (mut shares, mut labels) =
            (Vec::with_capacity(self.cells.len()), Vec::with_capacity(self.cells.len()));
        let (mut voids, mut points) = ([0; 2], 0);
        for (i, cell) in self.cells.iter().enumerate() {
            let rust = cell.rust & !cell.steel & cell.inside;
            let free = cell.inside & !cell.steel;
            let (pore, crack) = (free & cell.pore & !cell.rust, free & cell.crack & !cell.pore);
            let solid = free & !rust & !pore & !crack;
            let (rock, mortar) = (solid & cell.rock, solid & !cell.rock);
            let count = |m: u64| f64::from(m.count_ones());
            let part = |points: f64| (points * f64::from(FULL) / 64.0).round().min(255.0) as u8;
            let sand = if mortar == 0 {
                1.0
            } else {
                let p = DVec3::new(self.grid.at(0, i % nx), self.grid.at(1, i / nx), self.z)
                    / recipe.finest;
                1.0 + SAND * (2.0 * f64::from(grain_of_sand(recipe.seed, p)) - 1.0)
            };
            let tone = f64::from(cell.tone);
            shares.push([
                part(sand * count(mortar)),
                part(tone * count(rock)),
                part(count(cell.steel)),
                part(count(rust & !crack)),
            ]);
            labels.push(label(cell.inside, cell.steel, pore, crack));
            voids[0] += u64::from(pore.count_ones());
            voids[1] += u64::from(crack.count_ones());
            points += u64::from(cell.inside.count_ones());
        }
        (shares, labels, voids, points)
    }
}

fn label(inside: u64, steel: u64, pore: u64, crack: u64) -> u8 {
    (match () {
        () if steel.count_ones() >= 32 => Label::Steel,
        () if inside.count_ones() < 32 => Label::Outside,
        () if pore.count_ones() >= 32 => Label::Pore,
        () if crack.count_ones() >= CRACK => Label::Crack,
        () => Label::Matrix,
    }) as u8
}

/// A uniform number of the place, the same for all that fall on one finest voxel.
fn grain_of_sand(seed: u64, p: DVec3) -> f32 {
    let at = (p + 2f64.powi(20)).max(DVec3::ZERO).as_uvec3().min(UVec3::splat((1 << 21) - 1));
    Key::new(seed, u64::from(at.x) | u64::from(at.y) << 21 | u64::from(at.z) << 42).unit(9)
}
