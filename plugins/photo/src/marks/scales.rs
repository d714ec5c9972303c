//! A picture looked at from where it was taken, from twice and from four times as far away.
//!
//! Lessons are full of narrow cracks in fine texture. Cracks a dozen pixels wide and gravel of as
//! many look like those from farther off, while hairlines are seen from close by alone. So each
//! region of a picture is looked at from where the network is clearest about it: where the
//! largest share of what it takes for cracks lies on lines that are long and sure enough.

use glam::Vec3;
use intrados_raster::{Grid, Mask};

use super::outline;

/// Shortest side of a picture that is looked at, pixels.
pub(super) const SMALLEST: usize = 32;
/// Scales: the whole, half, a quarter.
pub(super) const SCALES: usize = 3;
/// What each scale counts, from close by to far off (chosen with the thresholds, on the same
/// photographs, as what follows).
const VIEWS: [[f32; SCALES]; 3] = [[0.75, 0.25, 0.0], [0.25, 0.5, 0.25], [0.0, 0.3, 0.7]];
/// How many times as clear the next view must be: from far off there is less to be wrong about.
const CLEARER: f64 = 2.0;
/// Side of a region, about, pixels.
const REGION: usize = 512;
/// Nothing is surer than that.
const SUREST: f32 = 0.004;

/// Cracks as they were seen at all scales, from the whole to the smallest, as one. What is not
/// known shows nothing.
pub(super) fn together(mut looks: Vec<Grid<f32>>, known: &Mask) -> Grid<f32> {
    for look in &mut looks {
        look.data.iter_mut().for_each(|p| *p = logit(*p));
    }
    let size = [known.width, known.height];
    let regions = Regions::of(size);
    let views = clearest(&looks, known, &regions);
    let scores = Scores(&looks);
    let chance = |i: usize| match known.data[i] {
        true => scores.chance(i, VIEWS[views[regions.at(i)]]),
        false => 0.0,
    };
    let data = (0..size[0] * size[1]).map(chance).collect();
    Grid { width: size[0], height: size[1], data }
}

/// Which view is to be trusted in each region.
fn clearest(looks: &[Grid<f32>], known: &Mask, regions: &Regions) -> Vec<usize> {
    let scores = Scores(looks);
    let mut best = vec![(0, 0.0_f64); regions.number()];
    // A view that has not all its scales is none.
    let views = VIEWS.iter().filter(|view| view[looks.len()..].iter().all(|share| *share == 0.0));
    for (number, view) in views.enumerate() {
        let chance = |i: usize| if known.data[i] { scores.chance(i, *view) } else { 0.0 };
        let data = (0..known.data.len()).map(chance).collect();
        let grid = Grid { width: known.width, height: known.height, data };
        let lines = outline::lines(&grid, outline::CRACKS);
        let mut sums = vec![[0.0_f64, 1e-9]; regions.number()];
        for (i, p) in grid.data.iter().enumerate() {
            let [kept, all] = &mut sums[regions.at(i)];
            *all += f64::from(*p);
            *kept += if lines.data[i] { f64::from(*p) } else { 0.0 };
        }
        let weight = CLEARER.powi(-(number as i32));
        for (best, [kept, all]) in best.iter_mut().zip(sums) {
            let clear = weight * kept / all;
            if clear > best.1 {
                *best = (number, clear);
            }
        }
    }
    best.into_iter().map(|(number, _)| number).collect()
}

/// A picture cut into rectangles of about [`REGION`].
struct Regions {
    size: [usize; 2],
    count: [usize; 2],
}

impl Regions {
    fn of(size: [usize; 2]) -> Self {
        Self { size, count: size.map(|s| ((s + REGION / 2) / REGION).max(1)) }
    }

    fn number(&self) -> usize {
        self.count[0] * self.count[1]
    }

    /// In which one a pixel lies.
    fn at(&self, i: usize) -> usize {
        let [x, y] = [i % self.size[0], i / self.size[0]];
        y * self.count[1] / self.size[1] * self.count[0] + x * self.count[0] / self.size[0]
    }
}

/// The logits of cracks at all scales.
struct Scores<'a>(&'a [Grid<f32>]);

impl Scores<'_> {
    /// How probable a crack is by a view; what a scale counts that was not looked at counts the
    /// whole.
    fn chance(&self, i: usize, view: [f32; SCALES]) -> f32 {
        let width = self.0[0].width;
        let own = self.0[0].data[i];
        let mut score = view[0] * own;
        for (k, share) in view.into_iter().enumerate().skip(1).filter(|(_, share)| *share > 0.0) {
            let shrunk = (1 << k) as f32;
            score += share
                * self.0.get(k).map_or(own, |grid| {
                    let at = [i % width, i / width];
                    between(grid, at.map(|p| (p as f32 + 0.5) / shrunk - 0.5))
                });
        }
        1.0 / (1.0 + (-score).exp())
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A sure line across the left half of a picture of two regions, and crumbs that are half sure
    /// in the right one, as the network might have seen them at each scale.
    fn looks(width: usize, height: usize, sure: [f32; SCALES]) -> Vec<Grid<f32>> {
        let look = |k: usize| {
            let (w, h) = (width >> k, height >> k);
            let chance = |i: usize| {
                let (x, y) = (i % w, i / w);
                let crumb = x > w / 2 && (x >> 2) % 3 == 0 && (y >> 2) % 3 == 0;
                let is_line = y.abs_diff(h / 2) <= 4 >> k && x < w / 2;
                if is_line { sure[k] } else { 0.3 * f32::from(u8::from(crumb)) }
            };
            Grid { width: w, height: h, data: (0..w * h).map(chance).collect() }
        };
        (0..SCALES).map(look).collect()
    }

    #[test]
    fn a_line_that_is_clear_from_far_off_alone_is_seen_from_there_and_only_in_its_region() {
        let [width, height] = [1024, 512];
        let known = Mask { width, height, data: vec![true; width * height] };
        let regions = Regions::of([width, height]);
        assert_eq!(regions.number(), 2);
        for (sure, expected) in
            [([0.99, 0.99, 0.99], 0), ([0.2, 0.996, 0.6], 1), ([0.1, 0.3, 0.99], 2)]
        {
            let mut looks = looks(width, height, sure);
            let cracks = outline::lines(&together(looks.clone(), &known), outline::CRACKS);
            for look in &mut looks {
                look.data.iter_mut().for_each(|p| *p = logit(*p));
            }
            assert_eq!(clearest(&looks, &known, &regions), [expected, 0], "{sure:?}");
            assert!(cracks.count() > 200, "{sure:?}");
        }
    }

    /// A picture too small for the coarser scales is looked at at its own.
    #[test]
    fn a_small_picture_has_one_view() {
        let mut looks = looks(64, 40, [0.99; SCALES]);
        looks.truncate(1);
        let known = Mask { width: 64, height: 40, data: vec![true; 64 * 40] };
        assert!((together(looks, &known).data[20 * 64 + 10] - 0.99).abs() < 1e-3);
    }
}
