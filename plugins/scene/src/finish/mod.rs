//! What formwork, weather and people leave on concrete: colour and relief of a member's face as a
//! pure function of place, footprint and key.
//!
//! A finish is made by [`Finish::new`] from a kind, a key and how worn it is; it holds a base of
//! paste or stone and a list of marks, each a small function with its measures in metres. Colours
//! are factors of the material's own, or colours of their own where something covers the concrete.
//! Relief bends the shading normal by differences; it casts no shadows and moves no outline.
//!
//! Everything finer than the footprint of a pixel fades to its mean, so a member looks the same at
//! .3 m and at 30 m but for what cannot be seen there.

pub(crate) mod noise;
mod recipe;
mod relief;
mod tone;
mod unwrap;

use glam::{Vec2, Vec3, vec2};
use intrados_stage::random::Key;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use unwrap::{Place, Unwrap};

/// What a face was made against, or is covered with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
pub enum FinishKind {
    /// Sawn boards.
    #[default]
    Board,
    /// Large smooth panels of plywood or steel, with tie holes.
    Panel,
    /// Sprayed.
    Shotcrete,
    /// Rendered.
    Plaster,
    /// Paving of bituminous concrete.
    Asphalt,
    /// Paving or slabs, brushed while fresh.
    Brushed,
    /// Broken: aggregate lies bare.
    Broken,
}

impl FinishKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Board,
        Self::Panel,
        Self::Shotcrete,
        Self::Plaster,
        Self::Asphalt,
        Self::Brushed,
        Self::Broken,
    ];
}

/// What comes out of concrete and runs down its face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum StainKind {
    /// From steel that corrodes.
    Rust,
    /// Lime that water washed out.
    Efflorescence,
}

/// How a member's face looks, everywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Finish {
    kind: FinishKind,
    key: Key,
    base: tone::Base,
    /// What makes relief, from coarse to fine.
    reliefs: Vec<relief::Relief>,
    /// What changes the colour, in the order in which it came upon the face.
    marks: Vec<tone::Mark>,
}

/// A face at one place, as much of it as a footprint shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// Linear Rec. 709 reflectance.
    pub colour: Vec3,
    /// Slopes of the relief ∂h/∂u, ∂h/∂v along the axes of the place.
    pub slope: Vec2,
    /// Share covered with rust, [0, 1].
    pub rust: f32,
    /// Share covered with efflorescence, [0, 1].
    pub efflorescence: f32,
}

impl Finish {
    /// What it was made against.
    #[must_use]
    pub const fn kind(&self) -> FinishKind {
        self.kind
    }

    /// Factor of the material's colour that the concrete itself has, inside as outside.
    #[must_use]
    pub(crate) fn tint(&self) -> Vec3 {
        self.base.tint
    }

    /// Whether it has rust or efflorescence on it.
    #[must_use]
    pub fn is_stained(&self) -> bool {
        self.marks.iter().any(tone::Mark::is_stain)
    }

    /// The face at `at` (m, from anywhere), seen with a footprint of so many metres; `colour` is
    /// the material's own.
    #[must_use]
    pub fn at(&self, at: Vec2, footprint: f32, colour: Vec3) -> Appearance {
        let footprint = footprint.max(1e-5);
        let step = (0.5 * footprint).max(1e-4);
        let slope = self
            .reliefs
            .iter()
            .map(|relief| {
                relief.slope(self.key, at, footprint).unwrap_or_else(|| {
                    let height = |at| relief.height(self.key, at, footprint);
                    let here = height(at);
                    let [u, v] = [vec2(step, 0.0), vec2(0.0, step)].map(|d| height(at + d) - here);
                    vec2(u, v) / step
                })
            })
            .sum::<Vec2>();
        let shade = self
            .reliefs
            .iter()
            .fold(1.0, |tone, relief| tone * relief.tone(self.key, at, footprint));
        let colour = self.base.colour(self.key, at, footprint, colour) * shade;
        let mut seen = tone::Seen { colour, rust: 0.0, efflorescence: 0.0 };
        for mark in &self.marks {
            mark.lay(self.key, at, footprint, &mut seen);
        }
        let tone::Seen { colour, rust, efflorescence } = seen;
        Appearance {
            colour: colour.clamp(Vec3::splat(0.004), Vec3::splat(0.95)),
            slope: slope.clamp_length_max(STEEPEST),
            rust,
            efflorescence,
        }
    }
}

/// A relief that bends normals further than this would have to cast shadows.
const STEEPEST: f32 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(finish: &Finish, footprint: f32) -> (Vec3, f32) {
        let n = 100_000;
        let (mut colour, mut slope) = (Vec3::ZERO, 0.0);
        for i in 0..n {
            let at = Vec2::from(Key::new(1, i).pair(0)) * 60.0;
            let seen = finish.at(at, footprint, Vec3::splat(0.4));
            colour += seen.colour / n as f32;
            slope += seen.slope.length() / n as f32;
        }
        (colour, slope)
    }

    /// From afar a face is as bright as from near: what fades is detail, not light.
    #[test]
    fn the_mean_does_not_depend_on_the_footprint_and_relief_does() {
        for kind in FinishKind::ALL {
            let finish = Finish::new(kind, Key::new(5, kind as u64), 0.5);
            let ((near, bent), (far, flat)) = (mean(&finish, 2e-4), mean(&finish, 0.05));
            let ratio = far.element_sum() / near.element_sum();
            assert!((0.92..1.08).contains(&ratio), "{kind:?}: {near} {far}");
            assert!(flat < 0.5 * bent, "{kind:?}: {flat} {bent}");
        }
    }

    /// A stain covers the face where it begins, and nothing above, beside or beyond it.
    #[test]
    fn a_stain_runs_down_from_its_place() {
        let plain = Finish::new(FinishKind::Board, Key::new(6, 0), 0.0);
        let from = vec2(0.3, 1.5);
        for kind in [StainKind::Rust, StainKind::Efflorescence] {
            let stained = plain.clone().stained_at(kind, from, 0.2, 0.6);
            let cover = |at: Vec2| {
                let seen = stained.at(at, 1e-3, Vec3::splat(0.4));
                let [is_rust, is_lime] = [seen.rust, seen.efflorescence].map(|share| share > 0.0);
                assert!(!is_rust || kind == StainKind::Rust);
                assert!(!is_lime || kind == StainKind::Efflorescence);
                seen.rust + seen.efflorescence
            };
            let mean = |low: Vec2, high: Vec2| {
                let at = |i| low + Vec2::from(Key::new(7, i).pair(0)) * (high - low);
                (0..4000).map(|i| cover(at(i))).sum::<f32>() / 4000.0
            };
            let begin = mean(from + vec2(-0.05, -0.1), from + vec2(0.05, -0.03));
            let end = mean(from + vec2(-0.05, -0.58), from + vec2(0.05, -0.5));
            assert!(begin > 0.3 && end < 0.5 * begin, "{kind:?}: {begin} {end}");
            for (low, high) in [
                (vec2(-1.0, 0.1), vec2(1.0, 1.0)),
                (vec2(-1.0, -2.0), vec2(1.0, -0.61)),
                (vec2(0.16, -2.0), vec2(1.0, 1.0)),
                (vec2(-1.0, -2.0), vec2(-0.16, 1.0)),
            ] {
                assert!(mean(from + low, from + high) == 0.0, "{kind:?}: {low} {high}");
            }
        }
    }

    #[test]
    fn every_finish_is_finite_within_bounds_and_its_own() {
        for kind in FinishKind::ALL {
            for seed in 0..20 {
                let finish = Finish::new(kind, Key::new(seed, 0), 1.0);
                for i in 0..500 {
                    let key = Key::new(seed, i + 1);
                    let at = Vec2::from(key.pair(0)) * 4.0 - 2.0;
                    let footprint = 10.0_f32.powf(-4.0 + 3.0 * key.unit(2));
                    let seen = finish.at(at, footprint, Vec3::splat(0.5));
                    assert!(seen.colour.is_finite() && seen.slope.is_finite(), "{kind:?}");
                    assert!(seen.colour.min_element() > 0.0 && seen.colour.max_element() < 1.0);
                    assert!((0.0..=1.0).contains(&seen.rust));
                    assert!((0.0..=1.0).contains(&seen.efflorescence));
                    assert_eq!(seen, finish.at(at, footprint, Vec3::splat(0.5)));
                }
            }
            let other = Finish::new(kind, Key::new(77, 0), 1.0);
            assert_ne!(other, Finish::new(kind, Key::new(78, 0), 1.0));
        }
    }
}
