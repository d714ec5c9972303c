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
/// Blurs that are tried, pixels (deviation of a Gaussian): the first, by how much each is more than
/// the one before, and how many. Then the one of most sharp pictures.
const BLURS: (f64, f64, i32) = (0.2, 1.09, 31);
const SHARP: f64 = 0.6;
/// A pixel and the reading between pixels spread light, too, with a variance of 1/12 + 1/6: as these
/// three points do, a share of .25, .5 and .25 at so many pixels before, on and after.
const SPREAD: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Widest half of a mouth, pixels: of what is wider the rest is not looked at.
const WIDEST: usize = 24;
/// Pieces that tell the blur: at least, and at most as many as it takes.
const TELL: [usize; 2] = [4, 80];
/// Places without cracks that are tried for the scatter of a face.
const TRIED: u32 = 400;
/// Fewest of these.
const FEWEST: usize = 16;
/// A crack shows where it takes away so many standard errors of light.
pub(super) const SHOWS: f64 = 3.0;
/// A crack that takes away so many in a piece counts as one that would have been found. 97 % of the
/// length of cracks above four was found in the rendered photographs of the development set; but a
/// straight one along joints and boards is taken for one of them: twice as much.
pub(super) const FOUND: f64 = 8.0;

/// A piece of a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its first and last point.
    pub(super) points: [usize; 2],
    /// Light that is missing across, pixels.
    pub(super) missing: f64,
}

/// Pieces of a line whose two sides are seen.
pub(super) fn pieces(value: &Grid<f32>, line: &Line, slots: &Slots) -> Vec<Piece> {
    let piece = |(points, cuts): ([usize; 2], Cuts)| {
        Some(Piece { points, missing: midmean(cuts.slots(slots).map(|s| s.missing).collect())? })
    };
    cuts(value, line).filter_map(piece).collect()
}

/// The mean of the middle third: a pore on the line or a stone beside it is in some of the cuts and
/// would else count by its area.
fn midmean(mut cuts: Vec<f64>) -> Option<f64> {
    cuts.sort_by(f64::total_cmp);
    let middle = &cuts[cuts.len() / 3..cuts.len() - cuts.len() / 3];
    (!middle.is_empty()).then(|| middle.iter().sum::<f64>() / middle.len() as f64)
}

/// Cuts across a line's pieces, with the first and last point of each.
fn cuts(value: &Grid<f32>, line: &Line) -> impl Iterator<Item = ([usize; 2], Cuts)> {
    let last = line.points.len().saturating_sub(1);
    (0..last).step_by(PIECE).filter_map(move |first| {
        let end = (first + PIECE - 1).min(last);
        let half = line.half[first..=end].iter().copied().fold(1.0, f64::max);
        let places = (first..=end).filter_map(|k| Some((line.points[k], across(line, k)?)));
        Some(([first, end], Cuts::of(value, places, half)?))
    })
}

/// Unit, across the line at one of its points.
fn across(line: &Line, k: usize) -> Option<[f64; 2]> {
    let (a, b) = (k.saturating_sub(4), (k + 4).min(line.points.len() - 1));
    let [d, e] = [0, 1].map(|c| line.points[b][c] - line.points[a][c]);
    let length = d.hypot(e);
    (length > 0.0).then(|| [-e / length, d / length])
}

/// Light on cuts across a piece of a line.
struct Cuts {
    /// Of a cut its light, every [`STEP`] across.
    light: Vec<Vec<f64>>,
    /// Half the mouth at most, whole pixels.
    half: usize,
}

impl Cuts {
    /// Of places and directions across, if at least half of the cuts are seen.
    fn of(
        value: &Grid<f32>,
        places: impl Iterator<Item = ([f64; 2], [f64; 2])>,
        half: f64,
    ) -> Option<Self> {
        let half = (half.ceil() as usize).min(WIDEST);
        let (mut light, mut count) = (Vec::new(), 0);
        for (at, across) in places {
            count += 1;
            let on = |s: f64| sampled(value, [at[0] + s * across[0], at[1] + s * across[1]]);
            light.extend(steps(half).map(on).collect::<Option<Vec<f64>>>());
        }
        (2 * light.len() > count).then_some(Self { light, half })
    }

    fn slots(&self, slots: &Slots) -> impl Iterator<Item = Slot> {
        self.light.iter().filter_map(move |cut| slots.best(cut, self.half))
    }
}

/// Pixels across at which a cut is read.
fn steps(half: usize) -> impl Iterator<Item = f64> {
    let steps = ((half as f64 + BESIDE) / STEP) as i32;
    (-steps..=steps).map(|k| f64::from(k) * STEP)
}

/// Slots in a picture of some blur: of each, from one that adds light to the widest, the share of
/// the light that it lets by, by place across.
pub(super) struct Slots(Vec<Vec<f64>>);

impl Slots {
    /// For mouths of at most so many pixels to either side.
    pub(super) fn new(blur: f64, half: usize) -> Self {
        let by = |k| steps(half).map(|s| 1.0 - taken(s, missing(k), blur)).collect();
        Self((0..=tries(half)).map(by).collect())
    }

    /// Those of a picture whose blur the shape of its cracks tells: the blur with which slots leave
    /// least of the cuts unexplained, each by its own scatter.
    pub(super) fn of(value: &Grid<f32>, lines: &[Line]) -> Self {
        let all: Vec<Cuts> = lines.iter().flat_map(|line| cuts(value, line)).map(|c| c.1).collect();
        let half = all.iter().map(|cuts| cuts.half).fold(1, usize::max);
        if all.len() < TELL[0] {
            return Self::new(SHARP, half);
        }
        let left = |slots: &Self| -> f64 {
            let some = all.iter().step_by(all.len().div_ceil(TELL[1]));
            some.flat_map(|cuts| cuts.slots(slots)).map(|slot| slot.left.max(1e-12).ln()).sum()
        };
        let (first, more, count) = BLURS;
        let tried = (0..count).map(|k| {
            let slots = Self::new(first * more.powi(k), half);
            (left(&slots), slots)
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or_else(|| Self::new(SHARP, half), |(_, slots)| slots)
    }

    /// The slot that explains a cut best, across a mouth of so many pixels to either side.
    fn best(&self, cut: &[f64], half: usize) -> Option<Slot> {
        let last = tries(half).min(self.0.len().saturating_sub(1));
        let left: Vec<f64> = self.0[..=last].iter().map(|q| unexplained(q, cut)).collect();
        let k = (1..last).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        // The lowest point of the parabola through three tries.
        let bend = left[k - 1] - 2.0 * left[k] + left[k + 1];
        let beside = if bend > 0.0 { 0.5 * (left[k - 1] - left[k + 1]) / bend } else { 0.0 };
        let level = cut.iter().sum::<f64>() / cut.len() as f64;
        let left = left[k] / (level * level);
        (level > 0.0).then(|| Slot { missing: missing(k) + beside.clamp(-1.0, 1.0) * TRY, left })
    }
}

/// What explains a cut.
struct Slot {
    /// Pixels of light.
    missing: f64,
    /// What it leaves of the cut, squared, over the square of the light beside.
    left: f64,
}

/// What y = (a + b s) q(s) leaves of a cut, squared, by its best a and b: a straight line, since
/// light falls off slowly across a face, times what the slot lets by. Both go as far to the left as
/// to the right, q farther than the cut, and Σ q² s is 0.
fn unexplained(q: &[f64], cut: &[f64]) -> f64 {
    let middle = 0.5 * (cut.len() - 1) as f64;
    let beyond = (q.len() - cut.len()) / 2;
    let (mut level, mut tilt, mut all) = ([0.0; 2], [0.0; 2], 0.0);
    for (k, (y, q)) in cut.iter().zip(&q[beyond..]).enumerate() {
        let (q, s) = (*q, k as f64 - middle);
        level = [level[0] + q * q, level[1] + q * y];
        tilt = [tilt[0] + q * q * s * s, tilt[1] + q * y * s];
        all += y * y;
    }
    all - level[1] * level[1] / level[0] - tilt[1] * tilt[1] / tilt[0]
}

/// How many slots are tried across a mouth of so many pixels to either side.
fn tries(half: usize) -> usize {
    ((2.0 * (half as f64 + 2.0) - LEAST) / TRY) as usize
}

/// Pixels of light that the `k`th slot takes away.
fn missing(k: usize) -> f64 {
    LEAST + k as f64 * TRY
}

/// Share of the light that a blurred slot takes away, `s` pixels from its middle: a box as deep as
/// slots are in most light, as wide as `missing` wants, under a Gaussian, as pixels read it.
fn taken(s: f64, missing: f64, blur: f64) -> f64 {
    let depth = 1.0 - USUAL[0];
    let (half, scale) = (0.5 * missing / depth, blur * std::f64::consts::SQRT_2);
    let on = |s: f64| 0.5 * depth * (erf((s + half) / scale) - erf((s - half) / scale));
    0.25 * (on(s - SPREAD) + on(s + SPREAD)) + 0.5 * on(s)
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
pub(super) fn scatter(value: &Grid<f32>, lines: &[Line], slots: &Slots) -> Option<f64> {
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
        midmean(Cuts::of(value, places, 1.0)?.slots(slots).map(|s| s.missing).collect())
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
            let middle = 28.0 + 4.0 * (x + 0.5) / w as f64;
            let end = |half: f64| (middle + half).clamp(y, y + 1.0);
            let covered = end(0.5 * width) - end(-0.5 * width);
            let light = 0.4 + 0.1 * y / h as f64;
            value.data[i] = (light * (1.0 - 0.9 * covered)) as f32;
        }
        let mut value = value.blurred(blur, &intrados_stage::Job::default());
        for (i, v) in value.data.iter_mut().enumerate() {
            *v *= 1.0 + grain as f32 * key.normal(i as u32) as f32;
        }
        let points: Vec<[f64; 2]> =
            (10..150).map(|x| f64::from(x) + 0.5).map(|x| [x, 28.0 + 4.0 * x / w as f64]).collect();
        let half = vec![1.5; points.len()];
        (value, Line { points, half, piece: 0 })
    }

    /// D = w (1 − r) with r = .1, whatever the blur.
    #[test]
    fn missing_light_is_width_times_what_the_slot_keeps() {
        for width in [0.25, 0.5, 1.0, 2.0] {
            for blur in [0.5, 0.8, 1.2] {
                let (value, line) = drawn(width, blur, 0.0);
                let slots = Slots::of(&value, std::slice::from_ref(&line));
                let pieces = pieces(&value, &line, &slots);
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
        let worst = pieces(&value, &line, &Slots::new(SHARP, 2))
            .iter()
            .map(|p| (p.missing - 0.45).abs())
            .fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst} of .45 pixels; their mean would be off by a whole one");
    }

    /// The scatter of what is not there is that of what is.
    #[test]
    fn errors_are_as_large_as_the_scatter_says() {
        let (value, line) = drawn(0.4, 0.8, 0.03);
        let lines = std::slice::from_ref(&line);
        let slots = Slots::of(&value, lines);
        let error = scatter(&value, lines, &slots).unwrap();
        let z: Vec<f64> =
            pieces(&value, &line, &slots).iter().map(|p| (p.missing - 0.36) / error).collect();
        let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
        assert!((0.4..2.0).contains(&rms), "{rms} with {error}");
        assert!(error < 0.1, "{error}");
    }
}
