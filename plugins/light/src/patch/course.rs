//! Cracks that grow over a face: courses that wander, widths that swell and fade, forks.

use glam::{Vec2, Vec3};
use intrados_scene::{CrackSurface, Mouth};
use intrados_stage::random::{Draw, Key};

/// The narrowest place of a crack over its width.
const LEAST: f32 = 0.03;

/// What grows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    /// Told so closely that nothing is added between, below 9 mm.
    pub(super) step: f32,
    /// On the face, m.
    pub(super) at: Vec2,
    /// rad from +x.
    pub(super) way: f32,
    /// m.
    pub(super) length: f32,
    /// m.
    pub(super) width: f32,
    /// Depth over width; none is shallower than 2 mm.
    pub(super) depth: f32,
    /// How much it wanders: rad per √m.
    pub(super) unrest: f32,
    /// Forks per metre.
    pub(super) forks: f32,
    /// Whether it fades at its beginning too.
    pub(super) free: bool,
}

/// A crack on the face z = 0 and the cracks that fork from it.
pub(super) fn grow(seed: Seed, key: Key) -> Vec<CrackSurface> {
    let mut all = Vec::new();
    let mut waiting = vec![(seed, 0_u32)];
    while let Some((seed, generation)) = waiting.pop() {
        let mut draw = Draw::new(key.split(generation, all.len() as u32));
        let steps = ((seed.length / seed.step) as usize).clamp(4, 1500);
        let step = seed.length / steps as f32;
        let (mut at, mut way) = (seed.at, seed.way);
        // Slow and quick changes of direction; the slow ones pull back to the course.
        let (mut slow, mut kink) = (0.0_f32, 0.0_f32);
        let mut swell = Swell::new(&mut draw);
        let mut mouth = Vec::with_capacity(steps + 1);
        for i in 0..=steps {
            let s = i as f32 / steps as f32;
            let begins = if seed.free { (s / 0.2).min(1.0) } else { 1.0 };
            let ends = begins * ((1.0 - s) / 0.35).min(1.0);
            let width = seed.width * ends.sqrt() * swell.next(step, &mut draw);
            mouth.push(Mouth {
                at: at.extend(0.0),
                outward: Vec3::Z,
                width: width.max(LEAST * seed.width).min(0.5),
            });
            if generation < 2 && draw.unit() < f64::from(seed.forks * step) {
                let side = if draw.chance(0.5) { 1.0 } else { -1.0 };
                let aside = side * draw.between(0.3, 1.2) as f32;
                let length = seed.length * (1.0 - s) * draw.between(0.3, 0.9) as f32;
                if length > 6.0 * seed.step && all.len() + waiting.len() < 8 {
                    let width = seed.width * draw.between(0.3, 0.8) as f32;
                    let fork = Seed { at, way: way + aside, length, width, free: false, ..seed };
                    waiting.push((fork, generation + 1));
                }
            }
            let noise = draw.normal() as f32 * seed.unrest * step.sqrt();
            slow = 0.97 * slow + noise;
            way += noise + 0.05 * (seed.way - way);
            // Round a stone, and back to the course.
            if draw.chance(0.2) {
                kink = draw.normal() as f32 * 0.55;
            }
            let now = way + slow * 0.4 + kink;
            at += step * Vec2::new(now.cos(), now.sin());
        }
        let across = Vec2::new(-seed.way.sin(), seed.way.cos());
        let depth = (seed.depth * seed.width).clamp(2e-3, 0.08);
        all.push(CrackSurface { mouth, normal: across.extend(0.0), depth });
    }
    all
}

/// What breaks a face into pieces: cracks along the borders of cells like those of dried mud.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pieces {
    pub(super) step: f32,
    /// Where the middle is, m.
    pub(super) at: Vec2,
    /// rad.
    pub(super) way: f32,
    /// Across a piece, m.
    pub(super) size: f32,
    /// Pieces from the middle to the outermost.
    pub(super) reach: i32,
    /// m.
    pub(super) width: f32,
}

/// The borders of all pieces, here and there one missing. Corners are those of a wall of bricks,
/// pushed about, so that three cracks meet at each.
pub(super) fn break_up(pieces: Pieces, key: Key) -> Vec<CrackSurface> {
    let mut all = Vec::new();
    let turn = Vec2::from_angle(pieces.way);
    let corner = |i: i32, j: i32| {
        let key = key.split(1, (i + 64) as u32 * 128 + (j + 64) as u32);
        let push = 0.55 * (Vec2::from(key.pair(0)) - 0.5);
        pieces.at + pieces.size * turn.rotate(Vec2::new(i as f32, j as f32) * 0.75 + push)
    };
    let far = pieces.reach;
    for (i, j) in (-far..far).flat_map(|i| (-far..far).map(move |j| (i, j))) {
        for (to, there) in [((i + 1, j), true), ((i, j + 1), (i + j).rem_euclid(2) == 0)] {
            let mut draw = Draw::new(key.split(2, all.len() as u32));
            let missing = draw.chance(0.15);
            if there && !missing {
                let ends = [corner(i, j), corner(to.0, to.1)];
                all.push(border(ends, pieces, &mut draw));
            }
        }
    }
    all
}

/// A crack from one corner to another, swaying by the sum of a few waves.
fn border([from, to]: [Vec2; 2], pieces: Pieces, draw: &mut Draw) -> CrackSurface {
    let way = to - from;
    let steps = ((way.length() / pieces.step) as usize).clamp(4, 400);
    let waves: [f32; 9] = std::array::from_fn(|k| draw.normal() as f32 * 0.08 / (k + 1) as f32);
    let mut swell = Swell::new(draw);
    let mut mouth = Vec::with_capacity(steps + 1);
    for n in 0..=steps {
        let s = n as f32 / steps as f32;
        let sway: f32 = waves
            .iter()
            .enumerate()
            .map(|(k, a)| a * ((k + 1) as f32 * std::f32::consts::PI * s).sin())
            .sum();
        let width = pieces.width * swell.next(way.length() / steps as f32, draw);
        mouth.push(Mouth {
            at: (from + s * way + sway * way.perp()).extend(0.0),
            outward: Vec3::Z,
            width: width.max(LEAST * pieces.width),
        });
    }
    let depth = (20.0 * pieces.width).clamp(6e-3, 0.08);
    CrackSurface { mouth, normal: way.perp().normalize_or(Vec2::X).extend(0.0), depth }
}

/// A width's factor along a course: it swells, shrinks, and here and there nearly closes.
struct Swell {
    level: f32,
    target: f32,
    left: f32,
}

impl Swell {
    fn new(draw: &mut Draw) -> Self {
        let level = draw.between(0.5, 1.0) as f32;
        Self { level, target: level, left: 0.0 }
    }

    fn next(&mut self, step: f32, draw: &mut Draw) -> f32 {
        self.left -= step;
        if self.left <= 0.0 {
            self.left = draw.log_between(0.01, 0.12) as f32;
            self.target = if draw.chance(0.15) { 0.05 } else { draw.log_between(0.4, 1.3) as f32 };
        }
        self.level += (self.target - self.level) * (step / 0.012).min(1.0);
        self.level
    }
}
