//! Where bodies go: random sequential addition on a fine lattice, the largest first.

use glam::{DVec3, UVec3};
use intrados_stage::{Job, random::Key};
use statrs::distribution::{ContinuousCDF, Normal};

use super::{Body, GrowError, Kind, Recipe, recipe::Air, steel::Rod};
use crate::march::Lattice;

/// Grains below this many times the finest voxel are part of the mortar.
const GRAIN: f64 = 2.5;
/// Pores below this share of the finest voxel thin the mortar.
const PORE: f64 = 0.5;
/// Most bodies.
const MOST: usize = 400_000;
/// Places tried for a grain; for a pore.
const TRIES: [u32; 2] = [60, 400];

pub(super) struct Placed {
    pub(super) bodies: Vec<Body>,
    pub(super) aggregate: f64,
    pub(super) fine_air: f64,
}

/// Cells that something is in, or whose corner it touches.
struct Taken {
    lattice: Lattice,
    bits: Vec<u64>,
}

impl Taken {
    fn new(recipe: &Recipe, rods: &[Rod]) -> Self {
        let (cell, half) = (recipe.cell(), recipe.outline.half().extend(0.5 * recipe.height));
        let cells = (2.0 * half / cell).ceil().as_uvec3().max(UVec3::ONE);
        let lattice =
            Lattice { origin: -0.5 * cell * cells.as_dvec3(), spacing: DVec3::splat(cell), cells };
        let mut taken = Self { lattice, bits: vec![0; lattice.len().div_ceil(64)] };
        // Bodies keep off the surface; the cut ends are none.
        let margin = 0.87 * cell;
        for y in 0..cells.y {
            for x in 0..cells.x {
                let p = lattice.centre(lattice.index(UVec3::new(x, y, 0)));
                let off = recipe.spalls.is_empty() && recipe.outline.within(p) >= margin;
                for z in 0..if off { 0 } else { cells.z } {
                    let i = lattice.index(UVec3::new(x, y, z));
                    let p = lattice.centre(i);
                    if recipe.outline.within(p) < margin
                        || recipe.spalls.iter().any(|s| s.contains(p))
                    {
                        taken.set(i);
                    }
                }
            }
        }
        for rod in rods {
            for [low, high] in rod.boxes() {
                taken.each([low, high], |i, p| (rod.distance(p) < margin).then_some(i));
            }
        }
        taken
    }

    fn set(&mut self, i: usize) {
        self.bits[i / 64] |= 1 << (i % 64);
    }

    fn has(&self, i: usize) -> bool {
        self.bits[i / 64] >> (i % 64) & 1 == 1
    }

    /// Sets every cell of a box for which `which` says so.
    fn each(&mut self, bounds: [DVec3; 2], which: impl Fn(usize, DVec3) -> Option<usize>) {
        let lattice = self.lattice;
        cells_of(&lattice, bounds, |i, p| {
            if let Some(i) = which(i, p) {
                self.set(i);
            }
            true
        });
    }

    /// Whether a body touches nothing. Cells taken are marked as soon as a corner may be touched,
    /// and each cell in which the body has its own centre, or a point of its surface, is looked at:
    /// nothing is missed that is larger than a fraction of a cell.
    fn fits(&self, body: &Body) -> bool {
        let free = |p: DVec3| self.lattice.cell(p).is_none_or(|i| !self.has(i));
        if !(free(body.centre) && body.surface(14).all(free)) {
            return false;
        }
        let many =
            (16.0 * (body.reach() / self.lattice.spacing.x).powi(2)).clamp(32.0, 4000.0) as usize;
        body.surface(many).all(free) && {
            let extent = body.extent();
            cells_of(&self.lattice, [body.centre - extent, body.centre + extent], |i, p| {
                !(self.has(i) && body.contains(p))
            })
        }
    }

    fn take(&mut self, body: &Body) {
        let margin = 0.87 * self.lattice.spacing.x;
        let extent = body.extent() + margin;
        let limit = margin / body.least();
        self.each([body.centre - extent, body.centre + extent], |i, p| {
            (body.depth(p) < limit).then_some(i)
        });
    }
}

/// Calls `visit` for every cell whose centre is in a box, until it says no; whether it never did.
fn cells_of(
    lattice: &Lattice,
    [low, high]: [DVec3; 2],
    mut visit: impl FnMut(usize, DVec3) -> bool,
) -> bool {
    let at = |p: DVec3| {
        ((p - lattice.origin) / lattice.spacing)
            .max(DVec3::ZERO)
            .min(lattice.cells.as_dvec3())
            .as_uvec3()
    };
    let (a, b) = (at(low), at(high + lattice.spacing));
    for z in a.z..b.z {
        for y in a.y..b.y {
            let row = lattice.index(UVec3::new(0, y, z));
            for x in a.x..b.x {
                let p = lattice.origin + lattice.spacing * (UVec3::new(x, y, z).as_dvec3() + 0.5);
                if !visit(row + x as usize, p) {
                    return false;
                }
            }
        }
    }
    true
}

/// Grains and pores that do not overlap each other, the steel or the surface.
pub(super) fn place(recipe: &Recipe, rods: &[Rod], job: &Job) -> Result<Placed, GrowError> {
    let mut taken = Taken::new(recipe, rods);
    let mut queue = grains(recipe);
    let mut fine_air = 0.0;
    for (i, air) in recipe.air.iter().enumerate() {
        let (pores, fine) = pores(recipe, air, i)?;
        fine_air += fine;
        queue.extend(pores);
    }
    if queue.len() > MOST {
        return Err(GrowError::Bad(format!(
            "{} grains and pores are more than {MOST}: take a smaller specimen or larger voxels",
            queue.len()
        )));
    }
    queue.sort_by(|a, b| b.0.diameter.total_cmp(&a.0.diameter));
    let (mut bodies, mut aggregate) = (Vec::new(), 0.0);
    let mut missing = vec![0.0; recipe.air.len()];
    let total = queue.len();
    for (n, (body, air)) in queue.into_iter().enumerate() {
        if n % 256 == 0 {
            job.step(n, total)?;
        }
        let range = air
            .map_or([-0.5 * recipe.height, 0.5 * recipe.height], |i| slab(recipe, &recipe.air[i]));
        let volume = body.volume();
        match settle(&mut taken, recipe, body, range, Key::new(recipe.seed, n as u64 | 5 << 40)) {
            Some(body) => {
                match air {
                    // A pore over the edge of its range counts with what is inside.
                    Some(i) => missing[i] += volume * (1.0 - body.between(range[0], range[1])),
                    None => aggregate += volume * body.between(range[0], range[1]),
                }
                bodies.push(body);
            }
            None => {
                if let Some(i) = air {
                    missing[i] += volume;
                }
            }
        }
    }
    for (i, (air, missing)) in recipe.air.iter().zip(missing).enumerate() {
        fill(&mut taken, recipe, air, i, missing, &mut bodies)?;
    }
    bodies.sort_by(|a, b| b.diameter.total_cmp(&a.diameter));
    Ok(Placed {
        bodies,
        aggregate: aggregate / recipe.volume(),
        fine_air: fine_air / recipe.volume(),
    })
}

/// The part of the specimen that an air void system fills.
fn slab(recipe: &Recipe, air: &Air) -> [f64; 2] {
    [air.from.max(-0.5 * recipe.height), air.to.min(0.5 * recipe.height)]
}

/// Smaller pores for those that found no place, the last one of just the size that is missing.
fn fill(
    taken: &mut Taken,
    recipe: &Recipe,
    air: &Air,
    number: usize,
    mut missing: f64,
    bodies: &mut Vec<Body>,
) -> Result<(), GrowError> {
    let range = slab(recipe, air);
    let wanted = air.porosity * recipe.outline.area() * (range[1] - range[0]).max(0.0);
    let volume = |d: f64| std::f64::consts::PI / 6.0 * d.powi(3);
    let least = PORE * recipe.finest;
    // The largest that are tried shrink where they find no place.
    let mut usual = air.median.max(least);
    for i in 0..200_000_u64 {
        if missing < 1e-3 * wanted || missing < 0.5 * volume(least) {
            return Ok(());
        }
        let key = Key::new(recipe.seed, i | (number as u64 + 64) << 40);
        let diameter = usual.min((6.0 * missing / std::f64::consts::PI).cbrt());
        match settle(taken, recipe, pore(diameter, key), range, key.split(0, 7)) {
            Some(body) => {
                missing -= body.volume() * body.between(range[0], range[1]);
                bodies.push(body);
            }
            None if usual > least => usual = (0.9 * usual).max(least),
            None => break,
        }
    }
    let share = 100.0 * (1.0 - missing / wanted);
    Err(GrowError::Bad(format!(
        "only {share:.0} % of {:.1} % pores found a place between the grains: plant fewer",
        100.0 * air.porosity
    )))
}

/// The body at the first place tried where it touches nothing.
fn settle(
    taken: &mut Taken,
    recipe: &Recipe,
    mut body: Body,
    [from, to]: [f64; 2],
    key: Key,
) -> Option<Body> {
    let half = recipe.outline.half();
    let tries = TRIES[usize::from(body.kind == Kind::Pore)];
    for t in 0..tries {
        let u = |k: u32| key.unit64(3 * t + k);
        body.centre = DVec3::new(
            half.x * (2.0 * u(0) - 1.0),
            half.y * (2.0 * u(1) - 1.0),
            from + (to - from) * u(2),
        );
        if taken.fits(&body) {
            taken.take(&body);
            return Some(body);
        }
    }
    None
}

/// Grains by Fuller's curve: the volume share of aggregate finer than d is √(d/d_max).
fn grains(recipe: &Recipe) -> Vec<(Body, Option<usize>)> {
    let least = GRAIN * recipe.finest;
    if least >= recipe.largest {
        return Vec::new();
    }
    let finer = (least / recipe.largest).sqrt();
    let wanted = recipe.volume() * recipe.share * (1.0 - finer);
    let (mut grains, mut volume) = (Vec::new(), 0.0);
    for i in 0..MOST as u64 + 1 {
        if volume >= wanted {
            break;
        }
        let key = Key::new(recipe.seed, i | 1 << 40);
        let u = |d: u32| key.unit64(d);
        // By number the curve's density is ∝ d^(−1/2)/d³, whose integral inverts in closed form.
        let t = |d: f64| d.powf(-2.5);
        let diameter = (t(least) + u(100) * (t(recipe.largest) - t(least))).powf(-0.4);
        let shape = DVec3::new(1.0, 0.7 + 0.3 * u(101), 0.55 + 0.35 * u(102));
        let cuts = (recipe.angular * (8.0 + 8.0 * u(103))).round() as usize;
        let mut grain = Body::new(Kind::Rock, diameter, shape, cuts, key);
        grain.tone = (0.97 + 0.06 * u(104)) as f32;
        volume += grain.volume();
        grains.push((grain, None));
    }
    grains
}

/// Pores of an air void system, and the volume of those that are too fine to be placed.
fn pores(
    recipe: &Recipe,
    air: &Air,
    number: usize,
) -> Result<(Vec<(Body, Option<usize>)>, f64), GrowError> {
    let [from, to] = slab(recipe, air);
    let all = air.porosity * recipe.outline.area() * (to - from).max(0.0);
    // By volume, ln d is normal about ln median + 3σ².
    let least = PORE * recipe.finest;
    let entrained = (1.0 - air.entrapped) * all;
    let fine = match air.spread {
        0.0 => f64::from(u8::from(air.median < least)),
        spread => {
            Normal::standard().cdf(((least / air.median).ln() - 3.0 * spread * spread) / spread)
        }
    };
    let (mut pores, mut volume) = (Vec::new(), 0.0);
    let mut i = 0_u64;
    let mut add = |wanted: f64, diameter: &dyn Fn(Key) -> f64, shape: &dyn Fn(Key) -> DVec3| {
        while volume < wanted {
            let key = Key::new(recipe.seed, i | (number as u64 + 16) << 40);
            i += 1;
            let d = diameter(key);
            // Wider than a third of the section is no pore.
            if d >= least && d < 0.6 * recipe.outline.half().min_element() {
                let mut body = Body::new(Kind::Pore, d, shape(key), 0, key);
                let rest = wanted - volume;
                if body.volume() > rest {
                    body = body.scaled((6.0 * rest / std::f64::consts::PI).cbrt().max(1e-9));
                }
                volume += body.volume();
                pores.push((body, Some(number)));
            }
            if i > 50 * MOST as u64 || pores.len() > MOST {
                return Err(GrowError::Bad(format!(
                    "{:.1} % of pores of {:.2} mm are more than {MOST} pores: plant larger ones or scan a smaller core",
                    100.0 * air.porosity,
                    1e3 * air.median
                )));
            }
        }
        Ok(())
    };
    let flat =
        |key: Key| DVec3::new(1.0, 0.8 + 0.2 * key.unit64(111), 0.45 + 0.35 * key.unit64(112));
    add(all - entrained, &|key| air.median.max(least) * (2.0 + 2.0 * key.unit64(110)), &flat)?;
    add(all - fine * entrained, &|key| air.median * (air.spread * key.normal(110)).exp(), &round)?;
    Ok((pores, fine * entrained))
}

/// Entrained pores are nearly round.
fn round(key: Key) -> DVec3 {
    DVec3::new(1.0, 0.9 + 0.1 * key.unit64(113), 0.9 + 0.1 * key.unit64(114))
}

fn pore(diameter: f64, key: Key) -> Body {
    Body::new(Kind::Pore, diameter, round(key), 0, key)
}
