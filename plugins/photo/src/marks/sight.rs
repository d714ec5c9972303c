//! What the network sees of a photograph: four planes that do not depend on how bright it is.

use glam::Vec3;
use intrados_light::luminance;
use intrados_raster::{Grid, Mask, network::Planes};
use intrados_stage::{Cancelled, Job};

/// Planes a pixel: detail, tone, redness, blueness.
pub(super) const PLANES: usize = 4;
/// Pixels along a side of a cell. The network works on cells, so that two convolutions reach far.
pub(super) const CELL: usize = 2;
/// Pixels of a cell.
pub(super) const PIXELS: usize = CELL * CELL;

/// Reach of the mean that detail is told from, pixels.
const MEAN: f64 = 16.0;
/// Reach of the deviation that detail is measured by, pixels.
const DEVIATION: f64 = 24.0;
/// Reach of the mean that tone and hue are, pixels. They tell what a place is like; finer ones
/// would let the network know cracks by their colour, which files blur and cameras make up.
const BROAD: f64 = 4.0;
/// Deviation below which nothing is detail, as a share of the tone around.
const SMOOTHEST: f32 = 0.01;
/// No detail is stronger, in deviations.
const STRONGEST: f32 = 6.0;
/// No tone is further from the picture's, as a share of it.
const FURTHEST: f32 = 2.0;

/// A photograph as the network sees it.
#[derive(Debug, Clone)]
pub(super) struct Sight {
    planes: [Grid<f32>; PLANES],
}

impl Sight {
    /// Of linear light; what is not `known` looks as even as its surroundings.
    ///
    /// # Errors
    /// The job was cancelled.
    pub(super) fn new(light: &Grid<Vec3>, known: &Mask, job: &Job) -> Result<Self, Cancelled> {
        let whole = known.data.iter().all(|&k| k);
        let count = known.count().max(1) as f32;
        // The root of light is about what files hold, and noise is about even in it.
        let tone = light.map(|l| luminance(l).max(0.0).sqrt());
        let known_tones = tone.data.iter().zip(&known.data).filter(|(_, k)| **k).map(|(t, _)| t);
        let mean = (known_tones.map(|&t| f64::from(t)).sum::<f64>() / f64::from(count)) as f32;
        let mean = mean.max(1e-12);
        let weights = known.map(|k| f32::from(u8::from(k)));
        let blurred = |grid: &Grid<f32>, reach: f64| -> Result<Grid<f32>, Cancelled> {
            let sums = times(grid, &weights, whole).blurred(reach, job);
            let sums = match whole {
                true => sums,
                false => over(&sums, &weights.blurred(reach, job)),
            };
            if job.is_cancelled() { Err(Cancelled) } else { Ok(sums) }
        };
        let around = blurred(&tone, MEAN)?;
        let detail = each(&tone, &around, |t, a| t - a);
        let square = blurred(&detail.map(|d| d * d), DEVIATION)?;
        let scale = each(&square, &around, |s, a| s.max(0.0).sqrt() + SMOOTHEST * a + 1e-6 * mean);
        let detail = each(&detail, &scale, |d, s| (d / s).clamp(-STRONGEST, STRONGEST));
        let tone = blurred(&tone, BROAD)?.map(|t| 2.0 * (t / mean - 1.0));
        let [red, blue] = [Vec3::X, Vec3::Z].map(|channel| hue(light, known, channel, mean * mean));
        let (red, blue) = (blurred(&red, BROAD)?, blurred(&blue, BROAD)?);
        let bounded = |grid: Grid<f32>| grid.map(|v| v.clamp(-FURTHEST, FURTHEST));
        let [tone, red, blue] = [tone, red, blue].map(bounded);
        let mut planes = [detail, tone, red, blue];
        if !whole {
            for plane in &mut planes {
                plane.data.iter_mut().zip(&weights.data).for_each(|(v, w)| *v *= w);
            }
        }
        Ok(Self { planes })
    }
    /// Pixels across and down.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.planes[0].width, self.planes[0].height]
    }

    /// The part from `x0`, `y0`, so many cells across and down; zero beyond the border.
    pub(super) fn cells(&self, [x0, y0]: [usize; 2], cells: [usize; 2]) -> Planes {
        let mut shown = Planes::new(PLANES * PIXELS, cells[0], cells[1]);
        let [width, height] = self.size();
        for (plane, grid) in self.planes.iter().enumerate() {
            for y in (0..CELL * cells[1]).take_while(|y| y0 + y < height) {
                let from = &grid.data[(y0 + y) * width..][..width];
                for (x, &v) in from.iter().skip(x0).take(CELL * cells[0]).enumerate() {
                    let plane = plane * PIXELS + y % CELL * CELL + x % CELL;
                    shown.row_mut(plane, y / CELL)[x / CELL] = v;
                }
            }
        }
        shown
    }
}

fn each(a: &Grid<f32>, b: &Grid<f32>, f: impl Fn(f32, f32) -> f32) -> Grid<f32> {
    let data = a.data.iter().zip(&b.data).map(|(&a, &b)| f(a, b)).collect();
    Grid { width: a.width, height: a.height, data }
}

fn times(grid: &Grid<f32>, weights: &Grid<f32>, whole: bool) -> Grid<f32> {
    if whole { grid.clone() } else { each(grid, weights, |v, w| v * w) }
}

fn over(sums: &Grid<f32>, weights: &Grid<f32>) -> Grid<f32> {
    each(sums, weights, |s, w| s / w.max(1e-6))
}

/// How much of a channel there is beside green, in logarithm, less its mean over the picture: the
/// light's own colour says nothing.
fn hue(light: &Grid<Vec3>, known: &Mask, channel: Vec3, level: f32) -> Grid<f32> {
    let floor = 0.02 * level;
    let ratio = light.map(|l| ((l.dot(channel).max(0.0) + floor) / (l.y.max(0.0) + floor)).ln());
    let of_known = ratio.data.iter().zip(&known.data).filter(|(_, k)| **k);
    let mean = of_known.map(|(&r, _)| f64::from(r)).sum::<f64>() / known.count().max(1) as f64;
    ratio.map(|r| 4.0 * (r - mean as f32))
}
