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
        let depth = (20.0 * seed.width).clamp(6e-3, 0.08);
        all.push(CrackSurface { mouth, normal: across.extend(0.0), depth });
    }
    all
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
