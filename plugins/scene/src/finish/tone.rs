//! What changes the colour: paste, stains, runs, patches, paint, strokes.

use glam::{Vec2, Vec3, vec2};
use intrados_stage::random::Key;

use super::noise::{bits, cell, octaves, octaves_and_rest, smooth, step, unit, visible};

/// The paste: blotches, clouds and grain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Base {
    /// Factor of the material's colour.
    pub(super) tint: Vec3,
    /// m.
    pub(super) blotch: f32,
    /// How much blotches differ.
    pub(super) contrast: f32,
    /// How much grains of sand differ.
    pub(super) grain: f32,
}

/// What came upon the face.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Mark {
    Patches(Patches),
    Runs(Runs),
    Trail(Trail),
    Lifts(Lifts),
    Repairs(Repairs),
    Strokes(Strokes),
    Band(Band),
}

/// What it is that covers or darkens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Matter {
    Dirt,
    Rust,
    Efflorescence,
}

/// A cover: how it takes light, and what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cover {
    pub(super) matter: Matter,
    /// Its own colour, which replaces; or a factor, which darkens.
    pub(super) colour: Vec3,
    pub(super) replaces: bool,
    /// Share at its thickest, [0, 1].
    pub(super) strength: f32,
}

/// Moss, damp, soot, crusts: where noise exceeds a threshold.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Patches {
    pub(super) cover: Cover,
    /// Size across, m.
    pub(super) size: f32,
    /// Size up over size across.
    pub(super) tall: f32,
    /// Noise above which it begins, about −.5 (everywhere) to .6 (nowhere).
    pub(super) from: f32,
    /// Width of its border in units of noise.
    pub(super) border: f32,
}

/// What water carried down the face.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Runs {
    pub(super) cover: Cover,
    /// Mean distance between them, m.
    pub(super) spacing: f32,
    /// Widest, m.
    pub(super) width: f32,
    /// Longest, m.
    pub(super) length: f32,
    /// Share of places that have one.
    pub(super) share: f32,
}

/// What came out of the face along a line across it and ran down from there.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trail {
    pub(super) cover: Cover,
    /// Middle of where it begins, m.
    pub(super) from: Vec2,
    /// m.
    pub(super) width: f32,
    /// Longest, m.
    pub(super) length: f32,
}

/// Borders between pours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lifts {
    /// m.
    pub(super) height: f32,
    /// How much pours differ.
    pub(super) contrast: f32,
    /// How dark the line is.
    pub(super) dark: f32,
    /// m.
    pub(super) line: f32,
}

/// Rectangles of another mortar.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Repairs {
    /// m.
    pub(super) spacing: f32,
    pub(super) share: f32,
    /// Factor of the colour.
    pub(super) tint: Vec3,
}

/// Lettering, chalk and pencil lines, scratches.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Strokes {
    /// Size of a sign, m.
    pub(super) size: f32,
    /// Width of its strokes, m.
    pub(super) width: f32,
    /// Share of places with a sign.
    pub(super) share: f32,
    pub(super) colour: Vec3,
    pub(super) strength: f32,
    /// Whether signs are straight lines rather than letters.
    pub(super) straight: bool,
}

/// Paint up to a height, with a frayed border; or a painted stripe.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Band {
    /// Repeats after so many metres across v.
    pub(super) period: f32,
    /// Share of the period that is painted.
    pub(super) share: f32,
    pub(super) across: bool,
    pub(super) colour: Vec3,
    /// How much of it has come off, [0, 1].
    pub(super) worn: f32,
}

/// The face as it is while marks are laid upon it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) colour: Vec3,
    pub(super) rust: f32,
    pub(super) efflorescence: f32,
}

impl Seen {
    fn cover(&mut self, cover: &Cover, share: f32) {
        let share = (share * cover.strength).clamp(0.0, 1.0);
        let target = if cover.replaces { cover.colour } else { self.colour * cover.colour };
        self.colour = self.colour.lerp(target, share);
        let kept = 1.0 - share;
        (self.rust, self.efflorescence) = (self.rust * kept, self.efflorescence * kept);
        match cover.matter {
            Matter::Dirt if !cover.replaces => {
                // Darkened, not hidden.
                (self.rust, self.efflorescence) =
                    (self.rust / kept.max(1e-3), self.efflorescence / kept.max(1e-3));
            }
            Matter::Dirt => {}
            Matter::Rust => self.rust += share,
            Matter::Efflorescence => self.efflorescence += share,
        }
    }
}

fn other(key: Key, number: u32) -> Key {
    Key(key.0.wrapping_add(number.wrapping_mul(0x2545_f491)), key.1 ^ number)
}

impl Base {
    pub(super) fn colour(&self, key: Key, at: Vec2, footprint: f32, colour: Vec3) -> Vec3 {
        let clouds = octaves(other(key, 40), at, self.blotch, 4, 0.6, footprint);
        let fine = octaves(other(key, 41), at, 0.012, 4, 0.8, footprint);
        let tone = 1.0 + self.contrast * clouds + self.grain * fine;
        // Where paste is rich it is a little bluer.
        let hue = Vec3::new(1.0 + 0.03 * clouds, 1.0, 1.0 - 0.05 * clouds);
        colour * self.tint * hue * tone.max(0.2)
    }
}

impl Mark {
    /// Whether it is rust or efflorescence.
    pub(super) fn is_stain(&self) -> bool {
        let (Self::Patches(Patches { cover, .. })
        | Self::Runs(Runs { cover, .. })
        | Self::Trail(Trail { cover, .. })) = self
        else {
            return false;
        };
        cover.matter != Matter::Dirt
    }

    pub(super) fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        match self {
            Self::Patches(patches) => patches.lay(key, at, footprint, seen),
            Self::Runs(runs) => runs.lay(key, at, footprint, seen),
            Self::Trail(trail) => trail.lay(key, at, footprint, seen),
            Self::Lifts(lifts) => lifts.lay(key, at, footprint, seen),
            Self::Repairs(repairs) => repairs.lay(key, at, seen),
            Self::Strokes(strokes) => strokes.lay(key, at, footprint, seen),
            Self::Band(band) => band.lay(key, at, footprint, seen),
        }
    }
}

/// A number of a mark's own, so that two marks of a kind lie elsewhere.
fn own(key: Key, number: u32, colour: Vec3, size: f32) -> Key {
    let salt =
        colour.x.to_bits() ^ colour.z.to_bits().rotate_left(9) ^ size.to_bits().rotate_left(17);
    Key(key.0 ^ salt, key.1.wrapping_add(number))
}

impl Patches {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        let key = own(key, 50, self.cover.colour, self.size);
        let at = at / vec2(1.0, self.tall);
        let [noise, rest] = octaves_and_rest(key, at, self.size, 5, 0.6, footprint);
        // What cannot be told apart any more covers its mean share.
        let share = step(self.from - 1.7 * rest, self.from + self.border + 1.7 * rest, noise);
        if share > 0.0 {
            seen.cover(&self.cover, share);
        }
    }
}

impl Runs {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        if visible(self.width, footprint) <= 0.0 {
            return;
        }
        let key = own(key, 60, self.cover.colour, self.spacing);
        let scale = vec2(self.spacing, self.length);
        let ([i, j], _) = cell(at / scale);
        // One that begins in the cell above reaches into this one.
        for above in 0..2 {
            let of = [i, j.wrapping_add(above)];
            if unit(key, of, 0) > self.share {
                continue;
            }
            let top = (of[1] as f32 + unit(key, of, 1)) * scale.y;
            let length = self.length * (0.2 + 0.8 * unit(key, of, 2) * unit(key, of, 3));
            let fall = (top - at.y) / length;
            if !(-0.02..1.0).contains(&fall) {
                continue;
            }
            let width = self.width * (0.25 + 0.75 * unit(key, of, 4));
            let drift = 0.4 * width * smooth(key, vec2(at.y / (6.0 * width), of[0] as f32 + 0.5));
            let middle = (of[0] as f32 + 0.2 + 0.6 * unit(key, of, 5)) * scale.x + drift;
            let off = (at.x - middle).abs() / (0.5 * width * (0.6 + 0.4 * fall));
            if off > 1.6 {
                continue;
            }
            let streaks =
                0.75 + 0.7 * smooth(key, vec2(at.x / (0.12 * width), at.y / (4.0 * width)));
            let share = step(1.5, 0.3, off) * (1.0 - fall) * step(-0.02, 0.01, fall);
            seen.cover(&self.cover, share * streaks.clamp(0.0, 1.0));
        }
    }
}

impl Trail {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        let key = own(key, 97, self.cover.colour, self.from.x + self.width);
        let fall = (self.from.y - at.y) / self.length;
        if visible(self.width, footprint) <= 0.0 || !(-0.1..1.0).contains(&fall) {
            return;
        }
        let drift = 0.15 * self.width * smooth(key, vec2(at.y / (3.0 * self.width), 0.5));
        let off = (at.x - self.from.x - drift).abs() / (0.5 * self.width);
        // It runs down in tongues, each as far as its water took it, the outer ones less far.
        let tongue = smooth(key, vec2(at.x / (0.14 * self.width), at.y / (2.5 * self.length)));
        let reach = (1.0 - 0.7 * off * off) * (0.65 + 0.35 * tongue);
        if off > 1.2 || reach <= 0.0 {
            return;
        }
        let cloud = smooth(key, vec2(at.x / (0.3 * self.width), at.y / (0.5 * self.width) + 9.5));
        let fine = smooth(key, vec2(at.x / 0.008, at.y / 0.05 + 5.5));
        let begin = step(-0.06, 0.03, fall + 0.03 * cloud);
        let share = begin * step(reach, 0.1 * reach, fall) * step(1.2, 0.4, off);
        seen.cover(&self.cover, share * (0.8 + 0.3 * cloud + 0.25 * fine).clamp(0.0, 1.0));
    }
}

impl Lifts {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        let key = own(key, 70, Vec3::ZERO, self.height);
        let wave =
            0.02 * smooth(key, vec2(at.x / 0.6, 0.5)) + 0.006 * smooth(key, vec2(at.x / 0.08, 1.5));
        let part = (at.y + wave) / self.height;
        let lift = part.floor();
        let tone = 1.0 + self.contrast * (unit(key, [lift as i32, 0], 1) - 0.5);
        let d = (part - (part + 0.5).floor()).abs() * self.height;
        let line = visible(self.line, footprint);
        let there = step(-0.1, 0.3, smooth(key, vec2(at.x / 0.3, (part + 0.5).floor() * 7.3)));
        seen.colour *= tone * (1.0 - line * self.dark * there * step(self.line, 0.0, d));
    }
}

impl Repairs {
    fn lay(&self, key: Key, at: Vec2, seen: &mut Seen) {
        let key = own(key, 80, self.tint, self.spacing);
        let (of, f) = cell(at / self.spacing);
        if unit(key, of, 0) > self.share {
            return;
        }
        let half = 0.5 * vec2(0.15 + 0.5 * unit(key, of, 1), 0.1 + 0.4 * unit(key, of, 2));
        let rough = 0.015 * smooth(key, at / 0.02);
        let inside = (half - (f - 0.5).abs()).min_element() + rough;
        if inside > 0.0 {
            // The border keeps a rim of richer paste.
            let rim = step(0.03, 0.0, inside);
            seen.colour *= self.tint * (1.0 - 0.18 * rim);
        }
    }
}

impl Strokes {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        let key = own(key, 90, self.colour, self.size);
        let pitch = if self.straight { vec2(4.0, 4.0) } else { vec2(0.8, 1.4) } * self.size;
        if pitch.x < 3.0 * footprint {
            // No sign can be told from the next: their mean.
            let length = if self.straight { 1.6 } else { 1.9 } * self.size;
            let share = self.share * self.strength * length * self.width / (pitch.x * pitch.y);
            seen.colour = seen.colour.lerp(self.colour, 0.85 * share.min(1.0));
            return;
        }
        let (of, f) = cell(at / pitch);
        // Letters stand in words: whole rows have them or have not.
        let word = if self.straight { of } else { [of[0].div_euclid(5), of[1]] };
        if unit(key, word, 0) > self.share {
            return;
        }
        let p = (f - 0.5) * pitch;
        let d =
            if self.straight { line(key, of, p, self.size) } else { letter(key, of, p, self.size) };
        let edge = 0.5 * self.width * (1.0 + 0.3 * smooth(key, at / (2.0 * self.width)));
        let share = stroke(edge, footprint.max(0.25 * edge), d);
        if share > 0.0 {
            let gaps = step(-0.5, -0.1, smooth(key, at / (0.7 * self.width).max(2.0 * footprint)));
            seen.colour = seen.colour.lerp(self.colour, share * gaps * self.strength);
        }
    }
}

/// Share of a stroke of half width `edge` at distance `d` from its middle line, blurred over
/// `soft`: blurring moves colour about and takes none away.
fn stroke(edge: f32, soft: f32, d: f32) -> f32 {
    let blurred = step(edge + soft, edge - soft, d);
    let t = 0.5 * (1.0 + edge / soft).min(2.0);
    // ∫ of the smooth step over all d ≥ 0 is soft·2(t³ − t⁴/2) where soft exceeds the edge.
    let told = 2.0 * soft * t * t * t * (1.0 - 0.5 * t);
    if soft > edge { blurred * (edge / told).min(1.0) } else { blurred }
}

/// Distance to a straight line through the cell, m.
fn line(key: Key, of: [i32; 2], p: Vec2, size: f32) -> f32 {
    let (sin, cos) = (std::f32::consts::TAU * unit(key, of, 3)).sin_cos();
    let along = cos * p.x + sin * p.y;
    let bow = 0.03 * along * along / size;
    let over = (along.abs() - size * (0.3 + unit(key, of, 4))).max(0.0);
    vec2(cos * p.y - sin * p.x + bow, over).length()
}

/// Distance to a sign made of strokes between nine places, m.
fn letter(key: Key, of: [i32; 2], p: Vec2, size: f32) -> f32 {
    let place =
        |n: u32| vec2((n % 3) as f32 - 1.0, (n / 3 % 3) as f32 - 1.0) * vec2(0.28, 0.45) * size;
    let mut nearest = f32::INFINITY;
    let h = bits(key, of, 5);
    let mut from = place(h % 9);
    for stroke in 0..3 + h % 2 {
        let to = place(bits(key, of, 6 + stroke) % 9);
        let way = to - from;
        let t = ((p - from).dot(way) / way.length_squared().max(1e-9)).clamp(0.0, 1.0);
        nearest = nearest.min((p - from - t * way).length());
        from = to;
    }
    nearest
}

impl Band {
    fn lay(&self, key: Key, at: Vec2, footprint: f32, seen: &mut Seen) {
        let key = own(key, 95, self.colour, self.period);
        let across = if self.across { at.x } else { at.y };
        let part = (across / self.period).rem_euclid(1.0);
        let inside = (part.min(self.share - part)) * self.period + 2e-3 * smooth(key, at / 0.01);
        let border = step(-0.5 * footprint.min(0.01), 0.5 * footprint.max(1e-3), inside);
        if border <= 0.0 {
            return;
        }
        let [flaked, rest] = octaves_and_rest(key, at, 0.06, 5, 0.75, footprint);
        let stays = step(self.worn - 0.55 - 1.7 * rest, self.worn - 0.45 + 1.7 * rest, flaked);
        seen.colour = seen.colour.lerp(self.colour, border * stays);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blurred_stroke_has_as_much_colour_as_a_sharp_one() {
        for soft in [0.2_f32, 0.9, 1.1, 3.0, 20.0] {
            let n = 100_000;
            let reach = 1.0 + soft;
            let sum: f32 =
                (0..n).map(|i| stroke(1.0, soft, reach * (i as f32 + 0.5) / n as f32)).sum();
            assert!((sum * reach / n as f32 - 1.0).abs() < 2e-3, "{soft}: {sum}");
        }
    }
}
