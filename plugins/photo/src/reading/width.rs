//! Widths of cracks, also of those narrower than a pixel: the light that is missing across.
//!
//! D = ∫ (1 − y/y₀) ds = w (1 − r): blur moves light about and changes nothing of D; y₀ is what the
//! concrete beside would show, r what the slot returns of it (theory §8). A slot that is blurred as
//! the picture is has one shape for each D: fitted to the cuts across a crack it leaves out what
//! texture does beside the slot, which a sum over the cut would take in. How much light is missing
//! where there is no crack tells D's error, texture and all.

use intrados_raster::Grid;
use intrados_stage::random::Key;
use statrs::function::erf::erf;

use super::{course::Line, returned::USUAL};

/// Pixels of a line whose missing light is taken together.
pub(super) const PIECE: usize = 16;
/// Pixels on either side of the mouth that tell what the concrete beside would show.
const BESIDE: f64 = 5.0;
/// Steps along a cut, pixels.
const STEP: f64 = 0.5;
/// Steps of missing light that are tried, pixels, and the least: texture may also be bright.
const TRY: f64 = 0.1;
const LEAST: f64 = -2.0;
/// Blurs that are tried, pixels (deviation of a Gaussian), and the one of most sharp pictures.
const BLURS: [f64; 12] = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.15, 1.35, 1.6, 1.9, 2.3, 2.8];
pub(super) const SHARP: f64 = 0.85;
/// Pieces that tell the blur: at least, and at most as many as it takes.
const TELL: [usize; 2] = [4, 80];
/// Places without cracks that are tried for the scatter of a face.
const TRIED: u32 = 400;
/// Fewest of these.
const FEWEST: usize = 16;
/// A crack shows where it takes away so many standard errors of light.
pub(super) const SHOWS: f64 = 3.0;
/// Where it takes away so many in a piece, the network finds it, too: 97 % of their length in
/// rendered photographs that this was chosen on.
pub(super) const FOUND: f64 = 4.0;

/// A piece of a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its first and last point.
    pub(super) points: [usize; 2],
    /// Light that is missing across, pixels.
    pub(super) missing: f64,
}

/// Pieces of a line whose two sides are seen, in a picture of this blur.
pub(super) fn pieces(value: &Grid<f32>, line: &Line, blur: f64) -> Vec<Piece> {
    let piece =
        |(points, cut): ([usize; 2], Cut)| Some(Piece { points, missing: cut.slot(blur)?.missing });
    cuts(value, line).filter_map(piece).collect()
}

/// The blur of a picture, pixels, by the shape of its cracks: the one with which the slots leave
/// least of the cuts unexplained, each by its own scatter.
pub(super) fn blur(value: &Grid<f32>, lines: &[Line]) -> f64 {
    let all: Vec<Cut> = lines.iter().flat_map(|line| cuts(value, line)).map(|c| c.1).collect();
    if all.len() < TELL[0] {
        return SHARP;
    }
    let some = || all.iter().step_by(all.len().div_ceil(TELL[1]));
    let left = |blur: f64| -> f64 {
        some().filter_map(|cut| cut.slot(blur)).map(|slot| slot.left.max(1e-12).ln()).sum()
    };
    BLURS.into_iter().min_by(|a, b| left(*a).total_cmp(&left(*b))).unwrap_or(SHARP)
}

/// Cuts across a line's pieces, with the first and last point of each.
fn cuts(value: &Grid<f32>, line: &Line) -> impl Iterator<Item = ([usize; 2], Cut)> {
    let last = line.points.len().saturating_sub(1);
    (0..last).step_by(PIECE).filter_map(move |first| {
        let end = (first + PIECE - 1).min(last);
        let half = line.half[first..=end].iter().copied().fold(1.0, f64::max);
        let places = (first..=end).filter_map(|k| Some((line.points[k], across(line, k)?)));
        Some(([first, end], Cut::of(value, places, half)?))
    })
}

/// Unit, across the line at one of its points.
fn across(line: &Line, k: usize) -> Option<[f64; 2]> {
    let (a, b) = (k.saturating_sub(4), (k + 4).min(line.points.len() - 1));
    let [d, e] = [0, 1].map(|c| line.points[b][c] - line.points[a][c]);
    let length = d.hypot(e);
    (length > 0.0).then(|| [-e / length, d / length])
}

/// Light across a piece of a line.
struct Cut {
    /// Pixels from the line, and the light there.
    light: Vec<[f64; 2]>,
    /// Most that may be missing, pixels.
    most: f64,
}

/// What explains a cut.
struct Slot {
    /// Pixels of light.
    missing: f64,
    /// Sum of what is left of the cut, squared, over the square of the light beside.
    left: f64,
}

impl Cut {
    /// The middle of many cuts, where at least half of them are seen: by place the mean of their
    /// middle half, since a pore on the line or a stone beside it is in some of them.
    fn of(
        value: &Grid<f32>,
        places: impl Iterator<Item = ([f64; 2], [f64; 2])>,
        half: f64,
    ) -> Option<Self> {
        let steps = ((half + BESIDE) / STEP) as i32;
        let along = || (-steps..=steps).map(|k| f64::from(k) * STEP);
        let (mut rows, mut count) = (Vec::<Vec<f64>>::new(), 0);
        for (at, across) in places {
            count += 1;
            let on = |s: f64| sampled(value, [at[0] + s * across[0], at[1] + s * across[1]]);
            rows.extend(along().map(on).collect::<Option<_>>());
        }
        if 2 * rows.len() <= count {
            return None;
        }
        let middle = |k: usize| {
            let mut all: Vec<f64> = rows.iter().map(|row| row[k]).collect();
            all.sort_by(f64::total_cmp);
            let half = &all[all.len() / 4..all.len() - all.len() / 4];
            half.iter().sum::<f64>() / half.len() as f64
        };
        let light = along().enumerate().map(|(k, s)| [s, middle(k)]).collect();
        Some(Self { light, most: 2.0 * (half + 2.0) })
    }

    /// The slot that explains it best.
    fn slot(&self, blur: f64) -> Option<Slot> {
        let count = ((self.most - LEAST) / TRY) as usize;
        let missing = |k: usize| LEAST + k as f64 * TRY;
        let left: Vec<f64> = (0..=count).map(|k| self.left(missing(k), blur)).collect();
        let k = (1..count).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        // The lowest point of the parabola through three tries.
        let bend = left[k - 1] - 2.0 * left[k] + left[k + 1];
        let beside = if bend > 0.0 { 0.5 * (left[k - 1] - left[k + 1]) / bend } else { 0.0 };
        let level = self.light.iter().map(|l| l[1]).sum::<f64>() / self.light.len() as f64;
        let left = left[k] / (level * level);
        (level > 0.0).then(|| Slot { missing: missing(k) + beside.clamp(-1.0, 1.0) * TRY, left })
    }

    /// What y = (a + b s) q(s) leaves of the cut, squared, by its best a and b: a straight line,
    /// since light falls off slowly across a face, times what the slot lets by.
    fn left(&self, missing: f64, blur: f64) -> f64 {
        let (mut m, mut rhs, mut all) = ([0.0; 3], [0.0; 2], 0.0);
        for &[s, y] in &self.light {
            let q = 1.0 - taken(s, missing, blur);
            (m[0], m[1], m[2]) = (m[0] + q * q, m[1] + q * q * s, m[2] + q * q * s * s);
            (rhs[0], rhs[1], all) = (rhs[0] + q * y, rhs[1] + q * y * s, all + y * y);
        }
        let det = m[0] * m[2] - m[1] * m[1];
        let [a, b] = [m[2] * rhs[0] - m[1] * rhs[1], m[0] * rhs[1] - m[1] * rhs[0]];
        all - (a * rhs[0] + b * rhs[1]) / det
    }
}

/// Share of the light that a blurred slot takes away, `s` pixels from its middle: a box as deep as
/// slots are in most light, as wide as `missing` wants, under a Gaussian.
fn taken(s: f64, missing: f64, blur: f64) -> f64 {
    let depth = 1.0 - USUAL[0];
    let (half, scale) = (0.5 * missing / depth, blur * std::f64::consts::SQRT_2);
    0.5 * depth * (erf((s + half) / scale) - erf((s - half) / scale))
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
pub(super) fn scatter(value: &Grid<f32>, lines: &[Line], blur: f64) -> Option<f64> {
    let mut taken = Grid::new(value.width, value.height, false);
    let reach = (2.0 * BESIDE) as isize;
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
        let places = (0..PIECE).map(|j| {
            let s = j as f64 - 0.5 * PIECE as f64;
            ([at[0] + s * cos, at[1] + s * sin], [-sin, cos])
        });
        Some(Cut::of(value, places, 1.0)?.slot(blur)?.missing)
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
                let sharp = super::blur(&value, std::slice::from_ref(&line));
                let pieces = pieces(&value, &line, sharp);
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
        let worst = pieces(&value, &line, SHARP)
            .iter()
            .map(|p| (p.missing - 0.45).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst} of .45 pixels; their mean would be off by a whole one");
    }

    /// The scatter of what is not there is that of what is.
    #[test]
    fn errors_are_as_large_as_the_scatter_says() {
        let (value, line) = drawn(0.4, 0.8, 0.03);
        let error = scatter(&value, std::slice::from_ref(&line), SHARP).unwrap();
        let z: Vec<f64> =
            pieces(&value, &line, SHARP).iter().map(|p| (p.missing - 0.36) / error).collect();
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
        assert!((0.4..2.0).contains(&rms), "{rms} with {error}");
        assert!(error < 0.1, "{error}");
    }
}
