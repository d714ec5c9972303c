//! Slices to learn from: sections through mortar with exact truth, as a scanner would show them.
//!
//! Reconstruction is linear, so a slice is the section blurred by the scanner plus the
//! reconstruction of the noise alone. The noise is that of photons behind a core with its bar, a
//! ray's variance growing as the exponential of what it crossed, and goes through this project's
//! filtered backprojection, which gives it the colour and the streaks of the real thing. How much
//! darker water is than mortar follows from the attenuation tables. Sizes of pores, blur and level
//! of noise follow what slices of mortar look like; ranges are wide, so that no scanner in
//! particular is learnt. Bodies and bars are of any size ([`Frame::any`]): cores of any diameter,
//! sections with straight edges, pictures from within the concrete, many bars or none.

use std::f64::consts::{PI, TAU};

use intrados_stage::{
    Cancelled, Job,
    random::{Draw, Key},
};
use intrados_xray::{
    physics::Library,
    recon::{ReconError, Window, fbp},
    volume::{self, Beam, Orbit, Sinogram},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use intrados_raster::grid::{Grid, Mask};

/// Edge of a slice, pixels.
pub const SIDE: usize = 400;
/// Places on a pixel's edge at which bodies are painted.
const FINE: usize = 3;
/// Places along the thickness of a slice.
const DEEP: usize = 5;
/// Views behind which noise is counted.
const VIEWS: usize = 600;

/// What a slice is to hold beyond chance.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Plan {
    /// As it comes: bars shown or masked out, cracks in every third.
    #[default]
    Any,
    /// As a scanner shows a member, not a core: dry pores of more sizes, coarse grains, more blur,
    /// more noise, cracks of any width in more than half of the slices.
    Member,
    /// Masked bars, and three cracks of this width (pixels) whose content is so much darker than
    /// mortar.
    Cracked {
        /// Pixels.
        width: f64,
        /// Share of the matrix's grey.
        drop: f64,
    },
}

/// A slice without noise, and its truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Grey without noise, sound mortar 1.
    pub grey: Grid<f32>,
    /// How far pores lower the grey.
    pub pore: Grid<f32>,
    /// How far cracks lower the grey.
    pub crack: Grid<f32>,
    /// Share of steel.
    pub steel: Grid<f32>,
    /// What was measured: the body, shown steel included.
    pub solid: Mask,
    /// Standard deviation of the noise.
    pub noise: f32,
}

/// Fields of noise of unit variance, by colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Reconstructed counting noise: must stay where it is, for its streaks belong to the body.
    counted: Vec<Grid<f32>>,
    /// Blurred by 1.2 pixels, and by 6.
    soft: [Vec<Grid<f32>>; 2],
}

/// Why no slices came to be.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The tables of attenuation are damaged.
    #[error(transparent)]
    Physics(#[from] intrados_xray::physics::PhysicsError),
    /// The noise could not be reconstructed.
    #[error(transparent)]
    Recon(#[from] ReconError),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A rectangle with round corners: a disc where the rounding is all of it. Pixels.
struct Outline {
    centre: [f64; 2],
    /// Direction of the first side.
    turn: f64,
    half: [f64; 2],
    round: f64,
}

impl Outline {
    fn disc(centre: [f64; 2], radius: f64) -> Self {
        Self { centre, turn: 0.0, half: [radius; 2], round: radius }
    }

    /// Distance to the edge; negative outside.
    fn depth(&self, x: f64, y: f64) -> f64 {
        let (sin, cos) = self.turn.sin_cos();
        let [dx, dy] = [x - self.centre[0], y - self.centre[1]];
        let from = [(dx * cos + dy * sin).abs(), (dy * cos - dx * sin).abs()];
        let [u, v]: [f64; 2] = std::array::from_fn(|k| from[k] - (self.half[k] - self.round));
        self.round - u.max(0.0).hypot(v.max(0.0)) - u.max(v).min(0.0)
    }
}

/// Where a body may lie.
struct Frame {
    outline: Outline,
    /// Where cupping ends, from the middle of the outline.
    reach: f64,
    /// The axis of turning, middle of rings.
    axis: [f64; 2],
    /// Bars: centre and radius.
    bars: Vec<([f64; 2], f64)>,
    /// Area of concrete in the picture, in units of [`USUAL`].
    share: f64,
}

/// Concrete in a picture of a core with a bar, pixels: what numbers of pores and grains are meant
/// for.
const USUAL: f64 = 74_000.0;
/// Farthest that an edge which shows lies from the middle of the picture, pixels.
const VISIBLE: f64 = 190.0;

impl Frame {
    fn new(plan: Plan, dice: &mut Draw) -> Self {
        if plan == Plan::Member { Self::core(dice) } else { Self::any(dice) }
    }

    /// Any body and any bars: three pictures in ten lie within the concrete; in the others the body
    /// is a disc or a rectangle from a tenth of the picture to many times as large, and an edge of
    /// it shows. A third has no bar, a third one, the rest up to five, of three pixels to a third
    /// of the picture.
    fn any(dice: &mut Draw) -> Self {
        let mid = 0.5 * SIDE as f64;
        let within = dice.chance(0.3);
        let reach =
            if within { 8.0 * SIDE as f64 } else { dice.log_between(45.0, 8.0 * SIDE as f64) };
        let turn = dice.between(0.0, TAU);
        let edge = if within { reach } else { dice.between(30.0, VISIBLE).min(reach) };
        let centre = [mid - (reach - edge) * turn.cos(), mid - (reach - edge) * turn.sin()];
        let outline = if dice.chance(0.5) {
            Outline::disc(centre, reach)
        } else {
            Outline {
                centre,
                turn,
                half: [reach, reach * dice.between(1.0, 2.0)],
                round: reach * dice.between(0.0, 0.2),
            }
        };
        let axis = if dice.chance(0.5) {
            centre
        } else {
            [(); 2].map(|()| dice.between(0.0, SIDE as f64))
        };
        let mut frame = Self { outline, reach, axis, bars: Vec::new(), share: 1.0 };
        let count = [0, 1, dice.count(2, 5)][dice.count(0, 2)];
        for _ in 0..count {
            let radius = dice.log_between(3.0, 130.0);
            // A bar that finds no place with some cover is left out.
            let at = (0..20)
                .map(|_| frame.place(dice))
                .find(|at| frame.depth(at[0], at[1]) > radius + 2.0);
            frame.bars.extend(at.map(|at| (at, radius)));
        }
        let grid = (0..SIDE)
            .step_by(5)
            .flat_map(|y| (0..SIDE).step_by(5).map(move |x| (x as f64, y as f64)));
        frame.share = 25.0 * grid.filter(|(x, y)| frame.depth(*x, *y) > 0.0).count() as f64 / USUAL;
        frame
    }

    /// A core about as large as the picture, or something larger, with a bar in its middle, two
    /// beside it, or none: what the network for scans of members has learnt on.
    fn core(dice: &mut Draw) -> Self {
        let mid = 0.5 * SIDE as f64;
        let centre = [(); 2].map(|()| mid + dice.between(-15.0, 15.0));
        // Every eighth slice is cut out of something larger.
        let outer = if dice.chance(0.125) { 2.0 * SIDE as f64 } else { dice.between(150.0, 175.0) };
        let bars = match dice.unit() {
            u if u < 0.7 => vec![(centre, dice.between(48.0, 58.0))],
            u if u < 0.85 => Vec::new(),
            _ => {
                let (r, turn) = (dice.between(70.0, 110.0), dice.between(0.0, TAU));
                let bar = |i: usize| {
                    let phi = turn + PI * i as f64;
                    [centre[0] + r * phi.cos(), centre[1] + r * phi.sin()]
                };
                let radius = dice.between(10.0, 24.0);
                (0..2).map(|i| (bar(i), radius)).collect()
            }
        };
        Self { outline: Outline::disc(centre, outer), reach: 165.0, axis: centre, bars, share: 1.0 }
    }

    /// `low` to `high` things in the usual area of concrete, in proportion in another.
    fn count(&self, dice: &mut Draw, low: usize, high: usize) -> usize {
        (self.share * dice.count(low, high) as f64).round() as usize
    }

    /// How deep a place lies inside the concrete, pixels; negative outside.
    fn depth(&self, x: f64, y: f64) -> f64 {
        self.bars
            .iter()
            .map(|(c, r)| (x - c[0]).hypot(y - c[1]) - r)
            .fold(self.outline.depth(x, y), f64::min)
    }

    fn in_bar(&self, x: f64, y: f64) -> bool {
        self.bars.iter().any(|(c, r)| (x - c[0]).hypot(y - c[1]) < *r)
    }

    /// Any place in the concrete.
    fn place(&self, dice: &mut Draw) -> [f64; 2] {
        let mut at = [0.0; 2];
        for _ in 0..1000 {
            at = [(); 2].map(|()| dice.between(0.0, SIDE as f64));
            if self.depth(at[0], at[1]) > 0.0 {
                break;
            }
        }
        at
    }
}

/// A finely painted picture: the strongest of what was painted on each place.
struct Canvas(Grid<f32>);

impl Canvas {
    fn new() -> Self {
        Self(Grid::new(SIDE * FINE, SIDE * FINE, 0.0))
    }

    /// Paints where `value` is positive, within `reach` pixels around `at`.
    fn paint(&mut self, at: [f64; 2], reach: f64, value: impl Fn(f64, f64) -> f64) {
        let fine = FINE as f64;
        let span = |c: f64| {
            let end = (SIDE * FINE) as f64;
            ((c - reach) * fine).clamp(0.0, end) as usize
                ..((c + reach) * fine + 1.0).clamp(0.0, end) as usize
        };
        for y in span(at[1]) {
            for x in span(at[0]) {
                let v =
                    value((x as f64 + 0.5) / fine - at[0], (y as f64 + 0.5) / fine - at[1]) as f32;
                let old = &mut self.0.data[y * SIDE * FINE + x];
                *old = old.max(v);
            }
        }
    }

    /// Blurs by `sigma` pixels and takes the mean over each pixel.
    fn developed(self, sigma: f64) -> Grid<f32> {
        let fine = self.0.blurred(sigma * FINE as f64, &Job::default());
        let mut out = Grid::new(SIDE, SIDE, 0.0);
        for (i, v) in fine.data.iter().enumerate() {
            let (x, y) = fine.place(i);
            out.data[y / FINE * SIDE + x / FINE] += v / (FINE * FINE) as f32;
        }
        out
    }
}

/// How dark a pore is.
#[derive(Clone, Copy)]
struct Filling {
    air: f64,
    water: f64,
    /// Share of pores that hold water.
    wet: f64,
}

impl Section {
    /// A section by chance; `water` is how far water lies below mortar, as a share of how far air
    /// does.
    fn new(plan: Plan, water: f64, key: Key) -> Self {
        let dice = &mut Draw::new(key);
        let frame = Frame::new(plan, dice);
        let member = plan == Plan::Member;
        let shown = member || (plan == Plan::Any && dice.chance(0.5));
        let sharp = if member { dice.between(0.35, 1.1) } else { dice.between(0.05, 0.45) };
        let air = dice.between(0.36, 0.52);
        let filling =
            Filling { air, water: air * water, wet: if member { 0.0 } else { dice.unit() } };
        let size = if member { (2.6, 0.55) } else { (1.75, 0.62) };
        let pore = pores(&frame, filling, size, dice).developed(sharp);
        let crack = cracks(&frame, plan, air, dice).developed(sharp);
        let mut steel = Canvas::new();
        for (at, r) in frame.bars.iter().filter(|_| shown) {
            steel.paint(*at, *r, |x, y| f64::from(u8::from(x.hypot(y) < *r)));
        }
        let steel = steel.developed(sharp);
        let texture = texture(&frame, if member { 4.5 } else { 1.0 }, dice);
        let bright = dice.between(2.0, 5.0) as f32;
        let place = |i: usize| ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
        let is_solid = |i: usize| {
            let (x, y) = place(i);
            frame.depth(x, y) > 0.0 || (shown && frame.in_bar(x, y))
        };
        let solid =
            Mask { width: SIDE, height: SIDE, data: (0..SIDE * SIDE).map(is_solid).collect() };
        let value = |i: usize| {
            let dark = pore.data[i].max(crack.data[i]);
            let s = steel.data[i];
            if solid.data[i] {
                (1.0 - s) * (1.0 + texture.data[i] - dark) + s * bright
            } else {
                0.0
            }
        };
        let grey = Grid { width: SIDE, height: SIDE, data: (0..SIDE * SIDE).map(value).collect() };
        let noise =
            if member { dice.log_between(0.018, 0.11) } else { dice.between(0.021, 0.034) } as f32;
        Self { grey, pore, crack, steel, solid, noise }
    }
}

/// Entrained pores as spheres that the slice cuts anywhere, and a few entrapped voids of any shape.
fn pores(frame: &Frame, filling: Filling, (median, spread): (f64, f64), dice: &mut Draw) -> Canvas {
    let mut canvas = Canvas::new();
    let thick = dice.between(0.5, 0.9);
    let mut last: Option<([f64; 2], f64)> = None;
    for _ in 0..frame.count(dice, 110, 210) {
        let r = median * (spread * dice.normal()).exp();
        let z = dice.between(-1.0, 1.0) * (r + thick);
        let at = match last {
            Some((c, other)) if dice.chance(0.08) => {
                let (phi, gap) = (dice.between(0.0, TAU), dice.between(-0.3, 1.5));
                [c[0] + (r + other + gap) * phi.cos(), c[1] + (r + other + gap) * phi.sin()]
            }
            _ => frame.place(dice),
        };
        last = Some((at, r));
        let drop = contrast(filling, dice);
        let (axis, turn) = (dice.between(1.0, 1.3).sqrt(), dice.between(0.0, TAU));
        let bubble = drop < 0.9 * filling.air && r > 3.5 && dice.chance(0.25);
        let bubble = bubble.then(|| (dice.between(0.3, 0.8) * r, dice.between(0.0, TAU)));
        canvas.paint(at, 1.2 * r, |x, y| {
            let (u, v) = (
                (x * turn.cos() + y * turn.sin()) * axis,
                (y * turn.cos() - x * turn.sin()) / axis,
            );
            let square = u * u + v * v;
            let drop = match bubble {
                Some((b, phi)) if (x - (r - b) * phi.cos()).hypot(y - (r - b) * phi.sin()) < b => {
                    filling.air
                }
                _ => drop,
            };
            let layer = |k: usize| z + thick * (2.0 * (k as f64 + 0.5) / DEEP as f64 - 1.0);
            drop * (0..DEEP).filter(|&k| square + layer(k).powi(2) < r * r).count() as f64
                / DEEP as f64
        });
    }
    for _ in 0..frame.count(dice, 0, 4) {
        let r = dice.log_between(9.0, 45.0);
        let waves: [(f64, f64); 3] = std::array::from_fn(|k| {
            (dice.between(0.0, 0.24) / (k + 1) as f64, dice.between(0.0, TAU))
        });
        let (at, drop) = (frame.place(dice), contrast(filling, dice));
        canvas.paint(at, 1.6 * r, |x, y| {
            let phi = y.atan2(x);
            let wave =
                |(k, (a, phase)): (usize, &(f64, f64))| a * ((k + 2) as f64 * phi + phase).cos();
            let edge = r * (1.0 + waves.iter().enumerate().map(wave).sum::<f64>());
            if x.hypot(y) < edge { drop } else { 0.0 }
        });
    }
    canvas
}

fn contrast(filling: Filling, dice: &mut Draw) -> f64 {
    let drop = if dice.chance(filling.wet) { filling.water } else { filling.air };
    drop * dice.between(0.93, 1.07)
}

/// Cracks whose path is a self-affine line: sines of halving length, amplitudes by a Hurst exponent
/// of .8.
fn cracks(frame: &Frame, plan: Plan, air: f64, dice: &mut Draw) -> Canvas {
    let mut canvas = Canvas::new();
    let count = match plan {
        Plan::Cracked { .. } => 3,
        Plan::Any if dice.chance(0.33) => dice.count(1, 3),
        Plan::Member if dice.chance(0.6) => dice.count(1, 4),
        Plan::Any | Plan::Member => 0,
    };
    for _ in 0..count {
        let (width, drop) = match plan {
            Plan::Cracked { width, drop } => (width, drop),
            Plan::Any => (dice.log_between(0.4, 6.0), dice.between(0.4, 1.0) * air),
            Plan::Member => (dice.log_between(0.6, 3.5), air),
        };
        let (from, phi, length) =
            (frame.place(dice), dice.between(0.0, TAU), dice.between(60.0, 220.0));
        let waves: [(f64, f64, f64); 6] = std::array::from_fn(|k| {
            let wave = length / (1 << k) as f64 * dice.between(0.8, 1.25);
            (
                wave,
                0.02 * length * (0.5_f64).powf(0.8 * k as f64) * dice.between(0.3, 1.5),
                dice.between(0.0, TAU),
            )
        });
        let steps = (4.0 * length) as usize;
        // Narrower than a place: a full line of so much less contrast.
        let reach = (0.5 * width).max(0.5 / FINE as f64);
        let drop = drop * (0.5 * width / reach).min(1.0);
        for i in 0..steps {
            let s = length * i as f64 / steps as f64;
            let off: f64 =
                waves.iter().map(|(wave, a, phase)| a * (TAU * s / wave + phase).sin()).sum();
            let at = [
                from[0] + s * phi.cos() - off * phi.sin(),
                from[1] + s * phi.sin() + off * phi.cos(),
            ];
            if frame.depth(at[0], at[1]) > 0.0 {
                canvas.paint(at, reach, |x, y| if x.hypot(y) < reach { drop } else { 0.0 });
            }
        }
    }
    canvas
}

/// What makes sound mortar uneven: grains, bright specks, rings, cupping, a darker rim.
fn texture(frame: &Frame, coarse: f64, dice: &mut Draw) -> Grid<f32> {
    let mut picture = Grid::new(SIDE, SIDE, 0.0_f32);
    let contrast = coarse * dice.between(0.5, 1.3);
    let spot = |picture: &mut Grid<f32>, at: [f64; 2], r: f64, put: &dyn Fn(f64, &mut f32)| {
        let span = |c: f64| {
            (c - r).clamp(0.0, SIDE as f64) as usize..(c + r + 1.0).clamp(0.0, SIDE as f64) as usize
        };
        for y in span(at[1]) {
            for x in span(at[0]) {
                let distance = (x as f64 + 0.5 - at[0]).hypot(y as f64 + 0.5 - at[1]);
                put(distance, &mut picture.data[y * SIDE + x]);
            }
        }
    };
    for _ in 0..frame.count(dice, 60, 160) {
        let (at, r) = (frame.place(dice), dice.between(4.0, 22.0));
        let grey =
            contrast * if dice.chance(0.5) { 1.0 } else { -1.0 } * dice.between(0.010, 0.015);
        spot(&mut picture, at, r, &|d, v| *v = if d < r { grey as f32 } else { *v });
    }
    for _ in 0..frame.count(dice, 20, 80) {
        let (at, r, grey) = (frame.place(dice), dice.between(0.5, 1.6), dice.between(0.05, 0.3));
        spot(&mut picture, at, 4.0, &|d, v| *v += (grey * (-0.5 * (d / r).powi(2)).exp()) as f32);
    }
    let (rings, cupping, offset) =
        (dice.between(0.0, 0.006), dice.between(-0.012, 0.012), dice.between(-0.006, 0.006));
    let (rim, fade) = (dice.between(0.0, 0.10), dice.between(0.6, 1.6));
    let profile: Vec<f64> = (0..2 * SIDE).map(|_| rings * dice.normal()).collect();
    for (i, v) in picture.data.iter_mut().enumerate() {
        let (x, y) = ((i % SIDE) as f64 + 0.5, (i / SIDE) as f64 + 0.5);
        let ring = profile[(x - frame.axis[0]).hypot(y - frame.axis[1]) as usize % (2 * SIDE)];
        let out = (x - frame.outline.centre[0]).hypot(y - frame.outline.centre[1]) / frame.reach;
        let dark = rim * (-frame.depth(x, y).max(0.0) / fade).exp();
        *v += (ring + cupping * (out.powi(2) - 0.5) + offset - dark) as f32;
    }
    picture
}

/// `count` sections.
///
/// # Errors
/// The tables of attenuation are damaged, or the job was cancelled.
pub fn sections(
    plan: Plan,
    count: usize,
    seed: u64,
    job: &Job,
) -> Result<Vec<Section>, SimulateError> {
    let library = Library::builtin()?;
    let at = |name: &str, kev: f64| -> Result<f64, SimulateError> {
        let material = library.material(name)?;
        Ok(material.density * material.attenuation(kev).total())
    };
    let mut water = Vec::new();
    for i in 0..count {
        let kev = 80.0 + 120.0 * Key::new(seed, i as u64).unit64(1 << 20);
        water.push(1.0 - at("water", kev)? / at("mortar", kev)?);
    }
    job.step(0, 1)?;
    Ok(water
        .into_par_iter()
        .enumerate()
        .map(|(i, water)| Section::new(plan, water, Key::new(seed, i as u64)))
        .collect())
}

impl Noise {
    /// `count` fields of each colour, behind bodies such as `plan` has.
    ///
    /// # Errors
    /// The tables of attenuation are damaged, or the job was cancelled.
    pub fn new(plan: Plan, count: usize, seed: u64, job: &Job) -> Result<Self, SimulateError> {
        let library = Library::builtin()?;
        let per_metre =
            |name: &str| library.material(name).map(|m| m.density * m.attenuation(100.0).total());
        // A field of 30 mm; what a bar adds to the noise is bounded, as by a scanner that filters
        // its beam.
        let (pixel, mortar, steel) =
            (0.03 / SIDE as f64, per_metre("mortar")?, per_metre("steel")?);
        let grid = volume::Grid::centred([SIDE, SIDE, 1], [1.0; 3]);
        let mut noise = Self { counted: Vec::new(), soft: [Vec::new(), Vec::new()] };
        for i in 0..count {
            let dice = &mut Draw::new(Key::new(seed, 1 << 32 | i as u64));
            let orbit = Orbit::circle(Beam::Parallel, VIEWS, PI, [1, SIDE], [1.0; 2]);
            let mut sinogram = Sinogram::zeros(orbit);
            // The core, and a bar so far from its middle.
            let [core, bar, away] = match plan {
                Plan::Member => [165.0, 53.0, 0.0],
                _ => [
                    dice.log_between(45.0, 800.0),
                    dice.log_between(3.0, 130.0),
                    dice.between(0.0, 150.0),
                ],
            };
            let metal = if i % 2 == 0 { 0.3 * steel } else { 0.0 };
            let turn = if away > 0.0 { dice.between(0.0, TAU) } else { 0.0 };
            for (j, ray) in sinogram.data.iter_mut().enumerate() {
                let s = (j % SIDE) as f64 - 0.5 * (SIDE as f64 - 1.0);
                let chord = |r: f64, s: f64| 2.0 * (r * r - s * s).max(0.0).sqrt() * pixel;
                let beside =
                    chord(bar, s - away * (PI * (j / SIDE) as f64 / VIEWS as f64 - turn).cos());
                let depth = mortar * (chord(core, s) - beside).max(0.0) + metal * beside;
                *ray = ((0.5 * depth).exp() * dice.normal()) as f32;
            }
            let window = [Window::SheppLogan, Window::Cosine][i / 2 % 2];
            let field = fbp(&sinogram, &grid, window, job)?;
            noise.counted.push(unit(Grid { width: SIDE, height: SIDE, data: field.data }));
            for (soft, sigma) in noise.soft.iter_mut().zip([1.2, 6.0]) {
                let white = (0..SIDE * SIDE).map(|_| dice.normal() as f32).collect();
                soft.push(unit(
                    Grid { width: SIDE, height: SIDE, data: white }.blurred(sigma, &Job::default()),
                ));
            }
            job.step(i, count)?;
        }
        Ok(noise)
    }

    /// The value at a pixel of one of the many mixtures that `key` chooses, of unit variance.
    pub(super) fn mixture(&self, key: Key) -> impl Fn(usize, usize) -> f32 {
        let pick = |d: u32, n: usize| (key.unit(d) * n as f32) as usize;
        let n = self.counted.len();
        let fields =
            [&self.counted[pick(0, n)], &self.soft[0][pick(1, n)], &self.soft[1][pick(2, n)]];
        let shifts = [[0, 0], [pick(3, SIDE), pick(4, SIDE)], [pick(5, SIDE), pick(6, SIDE)]];
        let streaks = 0.55 + 0.25 * key.unit(7);
        let fine = 0.7 * (1.0 - streaks);
        let amplitudes = [streaks, fine, 1.0 - streaks - fine].map(f32::sqrt);
        move |x, y| {
            let at = |k: usize| {
                fields[k].data[(y + shifts[k][1]) % SIDE * SIDE + (x + shifts[k][0]) % SIDE]
            };
            (0..3).map(|k| amplitudes[k] * at(k)).sum()
        }
    }
}

/// A field without mean and of unit variance in the middle.
fn unit(mut field: Grid<f32>) -> Grid<f32> {
    let inside =
        |i: usize| (i % SIDE).abs_diff(SIDE / 2).max((i / SIDE).abs_diff(SIDE / 2)) < SIDE / 3;
    let values: Vec<f64> =
        (0..SIDE * SIDE).filter(|&i| inside(i)).map(|i| f64::from(field.data[i])).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let sd = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    field.data.iter_mut().for_each(|v| *v = ((f64::from(*v) - mean) / sd.max(1e-12)) as f32);
    field
}
