//! How much a photograph's pixels scatter by themselves.

use glam::Vec3;

use crate::{Photograph, picture::linear};

/// Bins of brightness, even in sRGB.
const BINS: usize = 24;
/// Fewest differences by which a bin is known.
const FEWEST: usize = 200;
/// Pixels that are looked at, at most.
const MOST: usize = 1 << 20;

/// Standard error of a pixel's light, by channel and brightness.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Noise {
    /// By channel and bin; 0 where nothing is known.
    bins: [[f64; BINS]; 3],
    /// Of rounding: half the width of a step of the file, as a share of an sRGB step of 1/255.
    floor: f64,
}

/// Whether a pixel is neither burnt out nor black.
pub(super) fn is_exposed(light: Vec3) -> bool {
    light.max_element() < linear(0.985) && light.max_element() > linear(0.012)
}

fn bin(light: f64) -> usize {
    let srgb = light.clamp(0.0, 1.0).powf(1.0 / 2.4);
    ((srgb * BINS as f64) as usize).min(BINS - 1)
}

impl Noise {
    /// By the mixed difference (a − b − c + d)/2 of four pixels, whose variance is that of one
    /// where the light is even or a slope (J. Immerkær, "Fast noise variance estimation", 1996). Of
    /// each bin the median of its size counts, so that edges do not; texture as fine as a pixel
    /// does.
    pub(super) fn of(photograph: &Photograph) -> Self {
        let [width, height] = photograph.size;
        let quads = (width as usize / 2) * (height as usize / 2);
        let every = quads.div_ceil(MOST).max(1);
        let mut found: [Vec<Vec<f32>>; 3] = std::array::from_fn(|_| vec![Vec::new(); BINS]);
        for k in (0..quads).step_by(every) {
            let columns = width as usize / 2;
            let (x, y) = (2 * (k % columns) as u32, 2 * (k / columns) as u32);
            let four =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| photograph.light(x + i, y + j));
            let [Some(a), Some(b), Some(c), Some(d)] = four else { continue };
            if ![a, b, c, d].into_iter().all(is_exposed) {
                continue;
            }
            let (mixed, mean) = (0.5 * (a - b - c + d), 0.25 * (a + b + c + d));
            for channel in 0..3 {
                found[channel][bin(f64::from(mean[channel]))].push(mixed[channel].abs());
            }
        }
        let typical = |mut all: Vec<f32>| {
            if all.len() < FEWEST {
                return 0.0;
            }
            let middle = all.len() / 2;
            // The median of |N(0, 1)| is .6745.
            f64::from(*all.select_nth_unstable_by(middle, f32::total_cmp).1) / 0.674_49
        };
        let mut bins = found.map(|bins| {
            let mut known = bins.into_iter().map(typical);
            std::array::from_fn(|_| known.next().unwrap_or(0.0))
        });
        bins.iter_mut().for_each(fill);
        Self { bins, floor: 1.0 / 12.0_f64.sqrt() / photograph.steps() }
    }

    /// Variance of a pixel of this light.
    pub(super) fn variance(&self, channel: usize, light: f64) -> f64 {
        let at = light.clamp(0.0, 1.0).powf(1.0 / 2.4) * BINS as f64 - 0.5;
        let low = (at.max(0.0) as usize).min(BINS - 1);
        let high = (low + 1).min(BINS - 1);
        let share = (at - low as f64).clamp(0.0, 1.0);
        let bins = &self.bins[channel];
        let scatter = bins[low] * (1.0 - share) + bins[high] * share;
        // d linear / d sRGB ≈ 2.4 y^(1.4/2.4)/1.055
        let rounding = self.floor * 2.4 * light.clamp(1e-4, 1.0).powf(1.4 / 2.4);
        scatter.powi(2) + rounding.powi(2)
    }
}

/// Bins that nothing is known of are as the nearest one that something is.
fn fill(bins: &mut [f64; BINS]) {
    let known = *bins;
    for (i, bin) in bins.iter_mut().enumerate().filter(|(_, b)| **b <= 0.0) {
        let near = (0..BINS).filter(|j| known[*j] > 0.0).min_by_key(|j| j.abs_diff(i));
        *bin = near.map_or(0.0, |j| known[j]);
    }
}
