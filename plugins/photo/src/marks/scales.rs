//! A picture at half its scale: wide cracks with soft borders look there like the narrow ones that
//! lessons are full of.

use glam::Vec3;
use intrados_raster::{Grid, Mask};

use super::Marks;

/// Shortest side of a picture of half the scale that is looked at, pixels.
pub(super) const SMALLEST: usize = 32;
/// What half the scale counts (chosen with the thresholds, on the same photographs).
const COARSE: f32 = 0.3;
/// Nothing is surer than that.
const SUREST: f32 = 0.004;

impl Marks {
    /// The mean of the logits with those of half the scale, where that is known.
    pub(super) fn weigh(&mut self, half: &Self, known: &Mask) {
        for (grid, half) in self.grids.iter_mut().zip(&half.grids) {
            let width = grid.width;
            for (i, value) in grid.data.iter_mut().enumerate().filter(|(i, _)| known.data[*i]) {
                let at = [i % width, i / width].map(|p| 0.5 * (p as f32 + 0.5) - 0.5);
                let coarse = logit(between(half, at));
                let score = (1.0 - COARSE) * logit(*value) + COARSE * coarse;
                *value = 1.0 / (1.0 + (-score).exp());
            }
        }
    }
}

fn logit(p: f32) -> f32 {
    let p = p.clamp(SUREST, 1.0 - SUREST);
    (p / (1.0 - p)).ln()
}

/// What a grid holds at a place, in its pixels' middles.
fn between(grid: &Grid<f32>, at: [f32; 2]) -> f32 {
    let most = [grid.width - 1, grid.height - 1];
    let [x, y] = [0, 1].map(|k| at[k].clamp(0.0, most[k] as f32));
    let (i, j) = (x as usize, y as usize);
    let (s, t) = (x - i as f32, y - j as f32);
    let on = |i: usize, j: usize| grid.data[j.min(most[1]) * grid.width + i.min(most[0])];
    (1.0 - t) * ((1.0 - s) * on(i, j) + s * on(i + 1, j))
        + t * ((1.0 - s) * on(i, j + 1) + s * on(i + 1, j + 1))
}

/// Half the scale: the mean of what is known of four pixels.
pub(super) fn halved(light: &Grid<Vec3>, known: &Mask) -> (Grid<Vec3>, Mask) {
    let (width, height) = (light.width / 2, light.height / 2);
    let four = |i: usize| {
        let first = 2 * (i / width) * light.width + 2 * (i % width);
        let all = [first, first + 1, first + light.width, first + light.width + 1];
        all.into_iter().filter(|&k| known.data[k])
    };
    let count = |i: usize| four(i).count();
    let mean = |i: usize| four(i).map(|k| light.data[k]).sum::<Vec3>() / count(i).max(1) as f32;
    let all = 0..width * height;
    (
        Grid { width, height, data: all.clone().map(mean).collect() },
        Mask { width, height, data: all.map(|i| count(i) > 0).collect() },
    )
}
