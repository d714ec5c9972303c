//! Noise: smooth random functions of a place, without a state.
//!
//! Detail finer than the footprint of a pixel is left out, octave by octave, so that nothing
//! flickers at a distance: what remains is its mean.

use glam::{Vec2, vec2};
use intrados_stage::random::Key;
use wide::u32x4;

/// Random bits of a cell of a grid.
#[inline]
pub(super) fn bits(key: Key, [i, j]: [i32; 2], dimension: u32) -> u32 {
    let row = (i as u32).wrapping_mul(0x9e37_79b1);
    let column = (j as u32).wrapping_mul(0x85eb_ca6b);
    Key(key.0 ^ row, key.1.wrapping_add(column)).bits(dimension)
}

/// Uniform in [0, 1), of a cell of a grid.
#[inline]
pub(super) fn unit(key: Key, cell: [i32; 2], dimension: u32) -> f32 {
    (bits(key, cell, dimension) >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The cell of a unit grid that a place is in, and where in it, [0, 1)².
#[inline]
pub(super) fn cell(p: Vec2) -> ([i32; 2], Vec2) {
    let floor = p.floor();
    ([floor.x as i32, floor.y as i32], p - floor)
}

/// 0 below `low`, 1 above `high`, a smooth step between.
#[inline]
pub(crate) fn step(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// How much is left to see of a detail of that size, m: nothing below a footprint, all of it above
/// three.
#[inline]
pub(super) fn visible(size: f32, footprint: f32) -> f32 {
    step(1.0, 3.0, size / footprint.max(1e-9))
}

/// Random bits of the four corners of a cell: [`bits`] of (i, j), (i + 1, j), (i, j + 1),
/// (i + 1, j + 1), dimension 0.
#[inline]
fn corners(key: Key, [i, j]: [i32; 2]) -> [u32; 4] {
    let four = u32x4::splat;
    let (i, j) = (i as u32, j as u32);
    let rows = u32x4::new([i, i.wrapping_add(1), i, i.wrapping_add(1)]) * four(0x9e37_79b1);
    let columns = u32x4::new([j, j, j.wrapping_add(1), j.wrapping_add(1)]) * four(0x85eb_ca6b);
    let lowbias = |x: u32x4| {
        let x = (x ^ (x >> 16_u32)) * four(0x7feb_352d);
        let x = (x ^ (x >> 15_u32)) * four(0x846c_a68b);
        x ^ (x >> 16_u32)
    };
    lowbias(lowbias(rows ^ four(key.0)) ^ (columns + four(key.1))).to_array()
}

/// A gradient's part in the noise, and the gradient.
#[inline]
fn pull(h: u32, from: Vec2) -> (f32, Vec2) {
    let signed = |h: u32| (h & 0xffff) as f32 * (1.0 / 32_768.0) - 1.0;
    let gradient = vec2(signed(h), signed(h >> 16));
    (gradient.dot(from), gradient)
}

/// Gradient noise (Perlin 1985, with the quintic of 2002) on a unit grid: mean 0, within [−1, 1],
/// root mean square about .3.
#[inline]
pub(crate) fn smooth(key: Key, p: Vec2) -> f32 {
    let (of, f) = cell(p);
    let [a, b, c, d] = corners(key, of);
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let (a, b) = (pull(a, f).0, pull(b, f - Vec2::X).0);
    let (c, d) = (pull(c, f - Vec2::Y).0, pull(d, f - Vec2::ONE).0);
    let (low, high) = (a + (b - a) * fade.x, c + (d - c) * fade.x);
    low + (high - low) * fade.y
}

/// [`smooth`] with its slope.
#[inline]
fn smooth_slope(key: Key, p: Vec2) -> (f32, Vec2) {
    let (of, f) = cell(p);
    let [a, b, c, d] = corners(key, of);
    let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let steep = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let along = |(a, da): (f32, Vec2), (b, db): (f32, Vec2)| {
        let slope = da + (db - da) * fade.x + vec2((b - a) * steep.x, 0.0);
        (a + (b - a) * fade.x, slope)
    };
    let (a, da) = along(pull(a, f), pull(b, f - Vec2::X));
    let (b, db) = along(pull(c, f - Vec2::Y), pull(d, f - Vec2::ONE));
    (a + (b - a) * fade.y, da + (db - da) * fade.y + vec2(0.0, (b - a) * steep.y))
}

/// Slope of [`octaves`] by place.
pub(super) fn octaves_slope(
    key: Key,
    p: Vec2,
    size: f32,
    count: u32,
    gain: f32,
    footprint: f32,
) -> Vec2 {
    let (mut sum, mut scale, mut strength) = (Vec2::ZERO, 1.0 / size, 1.0);
    for octave in 0..count {
        let seen = visible(0.5 / scale, footprint);
        if seen <= 0.0 {
            break;
        }
        let key = Key(key.0.wrapping_add(octave), key.1);
        sum += seen
            * strength
            * scale
            * if octave % 2 == 0 {
                smooth_slope(key, p * scale).1
            } else {
                let turned = vec2(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y);
                let slope = smooth_slope(key, turned * scale).1;
                vec2(0.8 * slope.x + 0.6 * slope.y, 0.8 * slope.y - 0.6 * slope.x)
            };
        scale *= 2.0;
        strength *= gain;
    }
    sum
}

/// Octaves of noise from wave length `size` (m) downward, each half as long and `gain` as strong;
/// those finer than the footprint are left out. Root mean square about .35.
pub(crate) fn octaves(key: Key, p: Vec2, size: f32, count: u32, gain: f32, footprint: f32) -> f32 {
    octaves_and_rest(key, p, size, count, gain, footprint)[0]
}

/// The same, and the root mean square of what was left out.
pub(super) fn octaves_and_rest(
    key: Key,
    p: Vec2,
    size: f32,
    count: u32,
    gain: f32,
    footprint: f32,
) -> [f32; 2] {
    let (mut sum, mut rest, mut scale, mut strength) = (0.0, 0.0, 1.0 / size, 1.0);
    for octave in 0..count {
        let seen = visible(0.5 / scale, footprint);
        if seen < 1.0 {
            let missing = 0.28 * (1.0 - seen) * strength;
            rest += missing * missing;
        }
        if seen > 0.0 {
            // Each octave on a grid of its own, so that no lattice shows.
            let turned = vec2(0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y);
            let at = if octave % 2 == 0 { p } else { turned };
            let key = Key(key.0.wrapping_add(octave), key.1);
            sum += seen * strength * smooth(key, at * scale);
        }
        scale *= 2.0;
        strength *= gain;
    }
    [sum, rest.sqrt()]
}

/// Cells around scattered points (Worley 1996) on a unit grid: squared distances to the nearest
/// two points, and the cell of the nearest.
pub(super) fn scattered(key: Key, p: Vec2) -> ([f32; 2], [i32; 2]) {
    let ([i, j], f) = cell(p);
    let (mut nearest, mut whose) = ([f32::INFINITY; 2], [i, j]);
    for di in -1..=1 {
        for dj in -1..=1 {
            let cell = [i.wrapping_add(di), j.wrapping_add(dj)];
            let h = bits(key, cell, 1);
            let at = vec2((h & 0xffff) as f32, (h >> 16) as f32) * (1.0 / 65_536.0);
            let d = (vec2(di as f32, dj as f32) + at - f).length_squared();
            if d < nearest[0] {
                nearest = [d, nearest[0]];
                whose = cell;
            } else {
                nearest[1] = nearest[1].min(d);
            }
        }
    }
    (nearest, whose)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_has_no_mean_and_fades_below_the_footprint() {
        let key = Key::new(3, 4);
        let n = 200_000_u64;
        let place = |i: u64| Vec2::from(Key::new(9, i).pair(0)) * 300.0;
        let values: Vec<f64> =
            (0..n).map(|i| f64::from(octaves(key, place(i), 1.0, 4, 0.5, 1e-4))).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let square = values.iter().map(|v| v * v).sum::<f64>() / n as f64;
        // Places are independent but for the 300² cells: 5 standard errors.
        assert!(mean.abs() < 5.0 * (square / 90_000.0).sqrt(), "{mean}");
        assert!((0.2..0.5).contains(&square.sqrt()), "{}", square.sqrt());
        for i in 0..1000_i32 {
            let [a, b, c, d] = corners(key, [i, -i]);
            let one = |di: i32, dj: i32| bits(key, [i + di, dj - i], 0);
            assert_eq!([a, b, c, d], [one(0, 0), one(1, 0), one(0, 1), one(1, 1)]);
        }
        for i in 0..1000 {
            let (p, d) = (place(i), vec2(1e-3, 0.0));
            assert!((smooth(key, p + d) - smooth(key, p)).abs() < 1e-2);
        }
        for i in 0..1000 {
            let (p, e) = (place(i) * 0.01, 1e-3);
            let at = |d: Vec2| octaves(key, p + d, 1.0, 3, 0.5, 1e-4);
            let told = octaves_slope(key, p, 1.0, 3, 0.5, 1e-4);
            let found =
                vec2(at(vec2(e, 0.0)) - at(vec2(-e, 0.0)), at(vec2(0.0, e)) - at(vec2(0.0, -e)));
            assert!((found / (2.0 * e) - told).length() < 0.02, "{found} {told}");
        }
        // Wave length 1, footprint 2: nothing is left but the mean.
        assert_eq!(octaves(key, place(1), 1.0, 4, 0.5, 2.0), 0.0);
    }
}
