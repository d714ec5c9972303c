//! Widths of cracks, also of those narrower than a pixel: the light that is missing across.
//!
//! D = ∫ (1 − y/y₀) ds = w (1 − r): blur moves light about and changes nothing of D; y₀ is what the
//! concrete beside would show, r what the slot returns of it (theory §8). How much light is missing
//! where there is no crack tells D's error, texture and all; a crack shows where D is several of
//! these.

use intrados_raster::Grid;
use intrados_stage::random::Key;

use super::course::Line;

/// Pixels of a line whose missing light is taken together.
pub(super) const PIECE: usize = 16;
/// Beyond the mouth's half width, pixels: blur of lens and map within which light is missing.
const BLUR: f64 = 2.5;
/// Pixels on either side that tell what the concrete beside would show.
const BESIDE: f64 = 5.0;
/// Steps along a cut, pixels.
const STEP: f64 = 0.5;
/// Places without cracks that are tried for the scatter of a face.
const TRIED: u32 = 400;
/// Fewest of these.
const FEWEST: usize = 16;
/// A crack shows where it takes away so many standard errors of light.
pub(super) const SHOWS: f64 = 3.0;

/// A piece of a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its first and last point.
    pub(super) points: [usize; 2],
    /// Light that is missing across, pixels.
    pub(super) missing: f64,
}

/// Pieces of a line whose two sides are seen.
pub(super) fn pieces(value: &Grid<f32>, line: &Line) -> Vec<Piece> {
    let last = line.points.len().saturating_sub(1);
    let one = |first: usize| {
        let end = (first + PIECE - 1).min(last);
        let cuts = (first..=end).filter_map(|k| {
            let across = across(line, k)?;
            missing(value, line.points[k], across, line.half[k])
        });
        let cuts: Vec<f64> = cuts.collect();
        // Of half of it at least.
        let known = 2 * cuts.len() > end - first;
        known.then(|| Piece { points: [first, end], missing: midmean(cuts) })
    };
    (0..last).step_by(PIECE).filter_map(one).collect()
}

/// The mean of the middle third: a pore on the line or a stone beside it is in some of the cuts and
/// would else count by its area.
fn midmean(mut cuts: Vec<f64>) -> f64 {
    cuts.sort_by(f64::total_cmp);
    let middle = &cuts[cuts.len() / 3..cuts.len() - cuts.len() / 3];
    middle.iter().sum::<f64>() / middle.len() as f64
}

/// Unit, across the line at one of its points.
fn across(line: &Line, k: usize) -> Option<[f64; 2]> {
    let (a, b) = (k.saturating_sub(4), (k + 4).min(line.points.len() - 1));
    let [d, e] = [0, 1].map(|c| line.points[b][c] - line.points[a][c]);
    let length = d.hypot(e);
    (length > 0.0).then(|| [-e / length, d / length])
}

/// Light missing on a cut, pixels; `None` where one of its sides is not seen.
fn missing(value: &Grid<f32>, at: [f64; 2], across: [f64; 2], half: f64) -> Option<f64> {
    // The mask is a pixel and a half wide on either side of the narrowest crack.
    let inner = BLUR + half.max(1.0);
    let outer = inner + BESIDE;
    let on = |s: f64| sampled(value, [at[0] + s * across[0], at[1] + s * across[1]]);
    let steps = (outer / STEP) as i32;
    let cut: Vec<(f64, f64)> = (-steps..=steps)
        .map(|k| f64::from(k) * STEP)
        .map(|s| Some((s, on(s)?)))
        .collect::<Option<_>>()?;
    // A straight line through both sides: light falls off slowly across a face.
    let (mut n, mut sum, mut moment, mut square) = (0.0, 0.0, 0.0, 0.0);
    for (s, y) in cut.iter().filter(|(s, _)| s.abs() > inner) {
        (n, sum, moment, square) = (n + 1.0, sum + y, moment + s * y, square + s * s);
    }
    let (level, slope) = (sum / n, moment / square);
    let inside = cut.iter().filter(|(s, _)| s.abs() <= inner);
    let lacks = |(s, y): &(f64, f64)| {
        let beside = level + slope * s;
        if beside > 0.0 { STEP * (1.0 - y / beside) } else { 0.0 }
    };
    (level > 0.0).then(|| inside.map(lacks).sum())
}

/// Between pixels' middles; `None` where any of the four is not known.
fn sampled(value: &Grid<f32>, [x, y]: [f64; 2]) -> Option<f64> {
    let (u, v) = (x - 0.5, y - 0.5);
    if u < 0.0 || v < 0.0 {
        return None;
    }
    let (i, j) = (u as usize, v as usize);
    if i + 1 >= value.width || j + 1 >= value.height {
        return None;
    }
    let (s, t) = (u - i as f64, v - j as f64);
    let at = |i: usize, j: usize| f64::from(value.data[j * value.width + i]);
    let mixed = (1.0 - t) * ((1.0 - s) * at(i, j) + s * at(i + 1, j))
        + t * ((1.0 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
    mixed.is_finite().then_some(mixed)
}

/// Standard error of a piece's missing light, pixels: how much is missing along straight pieces
/// where no crack was found (robust). `None` where too few places are seen.
pub(super) fn scatter(value: &Grid<f32>, lines: &[Line]) -> Option<f64> {
    let mut taken = Grid::new(value.width, value.height, false);
    let reach = (2.0 * BLUR + BESIDE) as isize;
    for p in lines.iter().flat_map(|line| line.points.iter().step_by(4)) {
        for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
            let place =
                (p[0] as usize).checked_add_signed(dx).zip((p[1] as usize).checked_add_signed(dy));
            if let Some((x, y)) = place.filter(|(x, y)| *x < value.width && *y < value.height) {
                taken.data[y * value.width + x] = true;
            }
        }
    }
    let key = Key::new(u64::from_le_bytes(*b"scatter."), 0);
    let one = |k: u32| {
        let unit = |dim: u32| key.unit64(3 * k + dim);
        let at = [unit(0) * value.width as f64, unit(1) * value.height as f64];
        let (sin, cos) = (std::f64::consts::PI * unit(2)).sin_cos();
        let middle = (at[1] as usize).min(value.height - 1) * value.width
            + (at[0] as usize).min(value.width - 1);
        if taken.data[middle] {
            return None;
        }
        let cut = |j: usize| {
            let s = j as f64 - 0.5 * PIECE as f64;
            missing(value, [at[0] + s * cos, at[1] + s * sin], [-sin, cos], 1.0)
        };
        let cuts: Vec<f64> = (0..PIECE).map(cut).collect::<Option<_>>()?;
        Some(midmean(cuts))
    };
    if value.data.is_empty() {
        return None;
    }
    let mut lacks: Vec<f64> = (0..TRIED).filter_map(one).map(f64::abs).collect();
    if lacks.len() < FEWEST {
        return None;
    }
    let middle = lacks.len() / 2;
    // The median of |D| of a normal distribution is .6745 of its deviation.
    Some(*lacks.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slot of a width, drawn by coverage and blurred, on concrete that grows darker across and
    /// has grain.
    fn drawn(width: f64, blur: f64, grain: f64) -> (Grid<f32>, Line) {
        let (w, h) = (160, 60);
        let key = Key::new(7, 1);
        let mut value = Grid::new(w, h, 0.0_f32);
        for i in 0..w * h {
            let (x, y) = ((i % w) as f64, (i / w) as f64);
            // The line falls by 4 pixels from left to right.
            let middle = 28.0 + 4.0 * x / w as f64;
            let covered = (0..20)
                .filter(|k| {
                    let s = y + (f64::from(*k) + 0.5) / 20.0 - middle;
                    s.abs() < 0.5 * width
                })
                .count() as f64
                / 20.0;
            let light = 0.4 + 0.1 * y / h as f64;
            value.data[i] = (light * (1.0 - 0.9 * covered)) as f32;
        }
        let mut value = value.blurred(blur, &intrados_stage::Job::default());
        for (i, v) in value.data.iter_mut().enumerate() {
            *v *= 1.0 + grain as f32 * key.normal(i as u32) as f32;
        }
        let points: Vec<[f64; 2]> =
            (10..150).map(|x| [f64::from(x) + 0.5, 28.0 + 4.0 * f64::from(x) / w as f64]).collect();
        let half = vec![1.5; points.len()];
        (value, Line { points, half, piece: 0 })
    }

    /// D = w (1 − r) with r = .1, whatever the blur.
    #[test]
    fn missing_light_is_width_times_what_the_slot_keeps() {
        for width in [0.25, 0.5, 1.0, 2.0] {
            for blur in [0.5, 0.8, 1.2] {
                let (value, line) = drawn(width, blur, 0.0);
                let pieces = pieces(&value, &line);
                assert!(pieces.len() >= 8);
                let mean = pieces.iter().map(|p| p.missing).sum::<f64>() / pieces.len() as f64;
                assert!(
                    (mean - 0.9 * width).abs() < 0.02 + 0.02 * width,
                    "{width} blurred by {blur}: {mean}"
                );
            }
        }
    }

    /// A black pore of four pixels in every second piece of a slot of half a pixel.
    #[test]
    fn pores_on_the_line_hardly_count() {
        let (mut value, line) = drawn(0.5, 0.8, 0.0);
        for &[x, y] in line.points.iter().skip(8).step_by(2 * PIECE) {
            for i in 0..value.data.len() {
                let (u, v) = ((i % value.width) as f64 + 0.5, (i / value.width) as f64 + 0.5);
                if (u - x).hypot(v - y) < 2.0 {
                    value.data[i] = 0.02;
                }
            }
        }
        let worst =
            pieces(&value, &line).iter().map(|p| (p.missing - 0.45).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst} of .45 pixels; their mean would be off by a whole one");
    }

    /// The scatter of what is not there is that of what is.
    #[test]
    fn errors_are_as_large_as_the_scatter_says() {
        let (value, line) = drawn(0.4, 0.8, 0.03);
        let error = scatter(&value, std::slice::from_ref(&line)).unwrap();
        let z: Vec<f64> =
            pieces(&value, &line).iter().map(|p| (p.missing - 0.36) / error).collect();
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
        assert!((0.4..2.0).contains(&rms), "{rms} with {error}");
        assert!(error < 0.1, "{error}");
    }
}
