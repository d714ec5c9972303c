//! The course of a crack's mouth: rough edges, a width that swells and shrinks, ends that fade.

use glam::{DVec3, Vec3, vec2};
use intrados_stage::random::Key;

use super::CrackSurface;
use crate::finish::noise::{smooth, step};

/// Length of the straight pieces that a mouth is made of, m, where there are not too many cracks.
pub(super) const PIECE: f64 = 3e-3;
/// About so many pieces all cracks of a member get.
const MOST_PIECES: f64 = 2e5;

/// A place of a mouth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rib {
    /// Middle of the mouth, m.
    pub(super) at: DVec3,
    /// Its two lips, m; one point at a tip.
    pub(super) lips: [DVec3; 2],
    /// Unit, out of the concrete.
    pub(super) outward: DVec3,
    /// m.
    pub(super) depth: f64,
}

/// A point of the line before its lips are made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Station {
    pub(super) at: Vec3,
    pub(super) outward: Vec3,
    /// Opening, m.
    pub(super) width: f32,
    /// From the beginning, m.
    pub(super) along: f32,
}

/// The mouth's line in pieces, wandering between the points where it was told. Wandering is a share
/// of what lies between these points: a line that is told closely is left alone.
pub(super) fn stations(crack: &CrackSurface, piece: f64, widening: f32, key: Key) -> Vec<Station> {
    let (told, piece) = (told(crack), piece as f32);
    let length: f64 = told.iter().sum();
    let mut line: Vec<Station> = Vec::new();
    let mut along = 0.0;
    for (pair, &told) in crack.mouth.windows(2).zip(&told) {
        let pieces = (told as f32 / piece).ceil().clamp(1.0, 10_000.0) as u32;
        let wander = 0.14 * (told as f32).min(0.12);
        for k in u32::from(!line.is_empty())..=pieces {
            let t = k as f32 / pieces as f32;
            let s = along + t * told as f32;
            let at = pair[0].at.lerp(pair[1].at, t);
            let outward = pair[0].outward.lerp(pair[1].outward, t).normalize_or(pair[0].outward);
            let across = (pair[1].at - pair[0].at).cross(outward).normalize_or_zero();
            // Ends and told points stay where they are told, within a piece.
            let free = 4.0 * t * (1.0 - t);
            let aside = if told as f32 > 3.0 * piece { free * wander * rough(key, s) } else { 0.0 };
            let ends = (s / fade(length)).min((length as f32 - s) / fade(length)).clamp(0.0, 1.0);
            let uneven = 1.0
                + 0.9 * smooth(key, vec2(s / 0.05, 0.5))
                + 0.5 * smooth(key, vec2(s / 0.011, 1.5));
            let width = pair[0].width + (pair[1].width - pair[0].width) * t;
            line.push(Station {
                at: at + aside * across,
                outward,
                width: width * widening * ends.sqrt() * uneven.clamp(0.35, 1.7),
                along: s,
            });
        }
        along += told as f32;
    }
    line
}

/// Lengths between the points of a mouth, m.
fn told(crack: &CrackSurface) -> Vec<f64> {
    crack.mouth.windows(2).map(|pair| f64::from(pair[0].at.distance(pair[1].at))).collect()
}

/// How long pieces of a member's cracks are, m.
pub(super) fn piece_length(cracks: &[CrackSurface]) -> f64 {
    let length: f64 = cracks.iter().flat_map(told).sum();
    PIECE.max(length / MOST_PIECES)
}

/// Over what length an end fades, m.
fn fade(length: f64) -> f32 {
    (0.15 * length).clamp(1e-6, 0.03) as f32
}

/// Noise of all wave lengths that concrete's grains leave, root mean square about .5.
fn rough(key: Key, s: f32) -> f32 {
    (0..4)
        .map(|octave| {
            let wave = 0.06 * 0.45_f32.powi(octave);
            0.62_f32.powi(octave) * smooth(key, vec2(s / wave, 10.5 + octave as f32))
        })
        .sum::<f32>()
        * 1.6
}

/// The lips of a line whose points lie on the surface.
pub(super) fn ribs(line: &[Station], depth: f32, key: Key) -> Vec<Rib> {
    let widest = line.iter().map(|s| s.width).fold(1e-9, f32::max);
    let last = line.len().saturating_sub(1);
    line.iter()
        .enumerate()
        .map(|(i, station)| {
            let before = line[i.saturating_sub(1)].at.as_dvec3();
            let after = line[(i + 1).min(last)].at.as_dvec3();
            let outward = station.outward.as_dvec3().normalize();
            let across = (after - before).cross(outward).normalize_or_zero();
            let at = station.at.as_dvec3();
            let lip = |side: f64, row: f32| {
                let chipped = 1.0 + 0.45 * smooth(key, vec2(station.along / 4e-3, row));
                at + side * 0.5 * f64::from(station.width * chipped) * across
            };
            let lips =
                if i == 0 || i == last { [at; 2] } else { [lip(-1.0, 20.5), lip(1.0, 30.5)] };
            let share = step(0.0, 0.5, station.width / widest);
            Rib { at, lips, outward, depth: f64::from(depth * (0.05 + 0.95 * share)) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mouth;

    #[test]
    fn a_course_keeps_its_ends_its_mean_width_and_never_turns_inside_out() {
        let point = |x: f32| Mouth { at: Vec3::new(x, 0.0, 0.0), outward: Vec3::Z, width: 4e-4 };
        let mut mean = 0.0;
        for seed in 0..20 {
            let mouth = vec![point(0.0), point(0.5), point(1.0)];
            let crack = CrackSurface { mouth, normal: Vec3::Y, depth: 0.05 };
            let key = Key::new(seed, 0);
            let line = stations(&crack, PIECE, 1.0, key);
            let ribs = ribs(&line, crack.depth, key);
            assert!(ribs[0].at.distance(DVec3::ZERO) < 1e-7);
            assert!(ribs[ribs.len() - 1].at.distance(DVec3::X) < 1e-7);
            assert!(ribs.iter().all(|r| r.at.y.abs() < 0.06), "wanders off");
            for pair in ribs.windows(2) {
                let way = pair[1].at - pair[0].at;
                for side in 0..2 {
                    assert!((pair[1].lips[side] - pair[0].lips[side]).dot(way) > 0.0);
                }
            }
            let width = |r: &Rib| r.lips[0].distance(r.lips[1]);
            mean += ribs.iter().map(width).sum::<f64>() / ribs.len() as f64 / 20.0;
        }
        // Ends fade over 3 cm each: some 2 % of the whole.
        assert!((mean / 4e-4 - 0.98).abs() < 0.06, "{mean}");
    }
}
