//! Cracks: dark, thin and long.
//!
//! A crack may be narrower than a pixel, and then it is only a little darker than the matrix; but
//! it is long, and noise is not. So the darkness is averaged along short lines, a lower threshold
//! is let grow from seeds above a higher one (hysteresis, Canny 1986), over corners too, and what
//! has grown is a crack if it is at least ten times longer than wide, thin throughout, and has no
//! more outline than a strip.

use intrados_raster::grid::median;
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, HashSet},
};

use intrados_stage::Job;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use intrados_raster::grid::{Grid, Mask};

/// How cracks are found. Lengths in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CrackSettings {
    /// Darkness that grows, in standard deviations of that of sound concrete.
    pub low: f32,
    /// Darkness that seeds, in the same unit.
    pub high: f32,
    /// Shortest crack.
    pub min_length: f32,
    /// Least length over mean width.
    pub elongation: f32,
    /// Least length over the width where it is widest, which tells a crack that runs through a pore
    /// from a void with a tail.
    pub thinness: f32,
    /// Most outline over that of a plain strip, 2 (length + width), which tells a crack from voids
    /// that touch.
    pub branching: f32,
    /// The network's probability of a crack that grows.
    pub possible: f32,
    /// The network's probability of a crack that seeds.
    pub likely: f32,
    /// Fewest pixels of a crack that the network saw.
    pub min_pixels: usize,
    /// Least length over mean width of a crack that the network saw.
    pub likely_elongation: f32,
    /// Shortest crack, mm; a shorter piece counts where it lies no farther from a longer one.
    pub likely_length_mm: f32,
}

impl Default for CrackSettings {
    fn default() -> Self {
        Self {
            low: 2.5,
            high: 5.0,
            min_length: 36.0,
            elongation: 10.0,
            thinness: 8.0,
            branching: 1.45,
            possible: 0.3,
            likely: 0.6,
            min_pixels: 20,
            likely_elongation: 4.0,
            likely_length_mm: 0.0,
        }
    }
}

/// One crack as a slice shows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Crack {
    /// Length along it, pixels.
    pub length_px: f64,
    /// Length along it, mm.
    pub length_mm: f64,
    /// Opening, mm: missing mass of a cut, as if it held nothing but air; the mean of the middle
    /// third of all cuts, so that pores on its way do not count as its width.
    pub width_mm: f64,
    /// Its middle pixel, mm from the left and top edges.
    pub at_mm: [f64; 2],
    /// Width and height of the box about it, mm.
    pub box_mm: [f64; 2],
}

/// The cracks of a slice, and which pixels are theirs.
pub struct Found {
    /// The cracks.
    pub list: Vec<Crack>,
    /// Their pixels.
    pub mask: Mask,
    /// Air in these beyond what cracks of their lengths and widths hold, pixels: of pores that they
    /// run through.
    pub(crate) besides: f64,
}

/// What may be a crack.
struct Piece {
    shape: Shape,
    /// Its width, and the air in it beyond that, pixels.
    width: f64,
    besides: f64,
    pixels: Vec<usize>,
}

impl Piece {
    fn of(shape: Shape, pixels: Vec<usize>, grey: &Grid<f32>, air_drop: f64) -> Self {
        let mass: f64 = pixels.iter().map(|&i| f64::from(1.0 - grey.data[i])).sum();
        let width = (shape.opening(&pixels, grey) / air_drop).max(0.0);
        let besides = (mass / air_drop - width * shape.length).max(0.0);
        Self { shape, width, besides, pixels }
    }
}

impl Found {
    fn nothing(width: usize, height: usize) -> Self {
        Self { list: Vec::new(), mask: Mask::new(width, height, false), besides: 0.0 }
    }

    /// Whether more than half of a dark component belongs to cracks.
    pub(crate) fn cover(&self, pixels: &[usize]) -> bool {
        2 * pixels.iter().filter(|&&i| self.mask.data[i]).count() > pixels.len()
    }

    /// Takes the pieces that are long enough, each with its width in pixels, and of the others
    /// those that lie no farther from these than they would have to be long: scraps of the same
    /// crack.
    fn keep(&mut self, pieces: Vec<Piece>, pixel_mm: f32, settings: &CrackSettings) {
        let (long, short): (Vec<_>, Vec<_>) =
            pieces.into_iter().partition(|piece| piece.shape.is_long(pixel_mm, settings));
        long.iter().for_each(|piece| self.take(piece, pixel_mm));
        if long.is_empty() || short.is_empty() {
            return;
        }
        let away = self.mask.map(|cracked| !cracked).distance_within();
        for piece in &short {
            if piece.pixels.iter().any(|&i| away.data[i] * pixel_mm <= settings.likely_length_mm) {
                self.take(piece, pixel_mm);
            }
        }
    }

    fn take(&mut self, piece: &Piece, pixel_mm: f32) {
        let Piece { shape, pixels, .. } = piece;
        let mm = f64::from(pixel_mm);
        let (x, y) = self.mask.place(shape.middle);
        let side = |place: &dyn Fn(usize) -> usize| {
            let span = pixels
                .iter()
                .map(|&i| place(i))
                .fold([usize::MAX, 0], |[a, b], v| [a.min(v), b.max(v)]);
            (span[1] + 1).saturating_sub(span[0]) as f64 * mm
        };
        let width = self.mask.width;
        let box_mm = [side(&|i| i % width), side(&|i| i / width)];
        self.list.push(Crack {
            length_px: shape.length,
            length_mm: shape.length * mm,
            width_mm: piece.width * mm,
            at_mm: [(x as f64 + 0.5) * mm, (y as f64 + 0.5) * mm],
            box_mm,
        });
        pixels.iter().for_each(|&i| self.mask.data[i] = true);
        self.besides += piece.besides;
    }
}

/// Finds the cracks in `grey` (sound concrete 1). `air_drop` is how far below 1 pure air lies. Of a
/// job that was cancelled nothing is found.
pub fn find(
    grey: &Grid<f32>,
    body: &Mask,
    air_drop: f64,
    pixel_mm: f32,
    settings: &CrackSettings,
    job: &Job,
) -> Found {
    let darkness = darkness(grey, body, job);
    let inside = || (0..body.data.len()).filter(|&i| body.data[i]).map(|i| darkness.data[i]);
    let middle = median(inside()).unwrap_or(0.0);
    let sd = 1.4826 * median(inside().map(|v| (v - middle).abs())).unwrap_or(0.0);
    let above = |level: f32| {
        let pixel = |i: usize| body.data[i] && darkness.data[i] > middle + (level * sd).max(1e-3);
        Mask { data: (0..body.data.len()).map(pixel).collect(), ..*body }
    };
    let (low, high) = (above(settings.low), above(settings.high));
    let mut pieces = Vec::new();
    let mut found = Found::nothing(grey.width, grey.height);
    for pixels in regions(&low) {
        if !pixels.iter().any(|&i| high.data[i]) {
            continue;
        }
        if let Some(shape) = Shape::of(&pixels, low.width, settings) {
            pieces.push(Piece::of(shape, pixels, grey, air_drop));
        }
    }
    found.keep(pieces, pixel_mm, settings);
    found
}

/// The cracks in a picture of how probable a crack is: what is more probable than `possible` grows
/// from what is more probable than `likely`, and is a crack if it is long for its width. Outlines
/// may be as rough as they like, since the network has told pores apart.
pub fn find_likely(
    chance: &Grid<f32>,
    grey: &Grid<f32>,
    body: &Mask,
    air_drop: f64,
    pixel_mm: f32,
    settings: &CrackSettings,
) -> Found {
    let above = |level: f32| Mask {
        data: chance.data.iter().zip(&body.data).map(|(&c, &b)| b && c > level).collect(),
        ..*body
    };
    let (low, high) = (above(settings.possible), above(settings.likely));
    let mut pieces = Vec::new();
    let mut found = Found::nothing(grey.width, grey.height);
    for pixels in regions(&low) {
        if pixels.len() < settings.min_pixels || !pixels.iter().any(|&i| high.data[i]) {
            continue;
        }
        let shape = Shape::along(&pixels, low.width);
        if shape.length * shape.length
            >= f64::from(settings.likely_elongation) * pixels.len() as f64
        {
            pieces.push(Piece::of(shape, pixels, grey, air_drop));
        }
    }
    found.keep(pieces, pixel_mm, settings);
    found
}

/// Share of voids from which on a place is a nest of them.
const NEST: f32 = 0.15;
/// Standard deviation of the Gaussian over which that share is taken, pixels.
const NEST_SIGMA: f64 = 12.0;

/// The picture of how probable a crack is, but nothing where `dark` is so full of voids (honeycomb)
/// that what joins them cannot be told from a crack.
pub(crate) fn outside_nests(
    chance: &Grid<f32>,
    dark: &Mask,
    body: &Mask,
    settings: &CrackSettings,
    job: &Job,
) -> Grid<f32> {
    let blurred = |of: &dyn Fn(usize) -> bool| {
        let data =
            (0..body.data.len()).map(|i| f32::from(u8::from(body.data[i] && of(i)))).collect();
        Grid { data, ..*chance }.blurred(NEST_SIGMA, job)
    };
    let voids = blurred(&|i| dark.data[i] && chance.data[i] <= settings.likely);
    let all = blurred(&|_| true);
    let kept = |i: usize| if voids.data[i] > NEST * all.data[i] { 0.0 } else { chance.data[i] };
    Grid { data: (0..body.data.len()).map(kept).collect(), ..*chance }
}

/// The cracks of a label mask by the same measures of shape; the width is area over length.
pub(crate) fn find_in_labels(labels: &Mask, pixel_mm: f32, settings: &CrackSettings) -> Found {
    let mut pieces = Vec::new();
    let mut found = Found::nothing(labels.width, labels.height);
    for pixels in regions(labels) {
        if let Some(shape) = Shape::of(&pixels, labels.width, settings) {
            let width = pixels.len() as f64 / shape.length;
            pieces.push(Piece { shape, width, besides: 0.0, pixels });
        }
    }
    found.keep(pieces, pixel_mm, settings);
    found
}

/// How dark a pixel's neighbourhood is along a line: for sixteen directions the line of nine pixels
/// through it is cut in three, and the palest third counts, so that a pore at one end is no line;
/// the darkest direction counts.
fn darkness(grey: &Grid<f32>, body: &Mask, job: &Job) -> Grid<f32> {
    let (w, h) = (grey.width, grey.height);
    let lines: Vec<[(isize, isize); 9]> = (0..16).map(line).collect();
    // With a margin of what is as good as sound no pixel need ask where it lies, and rows are added
    // up as wholes.
    let wide = w + 2 * ARM;
    let mut dark = vec![0.0_f32; wide * (h + 2 * ARM)];
    for y in 0..h {
        let pixels = grey.data[y * w..(y + 1) * w].iter().zip(&body.data[y * w..(y + 1) * w]);
        let row = &mut dark[(y + ARM) * wide + ARM..];
        row.iter_mut()
            .zip(pixels)
            .for_each(|(v, (grey, inside))| *v = if *inside { 1.0 - grey } else { 0.0 });
    }
    let mut found = Grid::new(w, h, 0.0_f32);
    found.data.par_chunks_mut(w.max(1)).enumerate().for_each_init(
        || [vec![0.0_f32; w], vec![0.0_f32; w]],
        |[palest, darkest], (y, out)| {
            if job.is_cancelled() {
                return;
            }
            let at = |(dx, dy): (isize, isize)| {
                let begin = (y + ARM).wrapping_add_signed(dy) * wide + ARM.wrapping_add_signed(dx);
                &dark[begin..begin + w]
            };
            darkest.fill(f32::NEG_INFINITY);
            for line in &lines {
                palest.fill(f32::INFINITY);
                for third in line.as_chunks::<3>().0 {
                    let [a, b, c] = third.map(at);
                    let sums = a.iter().zip(b).zip(c).map(|((a, b), c)| (a + b + c) / 3.0);
                    palest.iter_mut().zip(sums).for_each(|(least, v)| *least = least.min(v));
                }
                darkest.iter_mut().zip(&*palest).for_each(|(most, v)| *most = most.max(*v));
            }
            let inside = &body.data[y * w..(y + 1) * w];
            out.iter_mut()
                .zip(inside)
                .zip(&*darkest)
                .for_each(|((v, inside), most)| *v = if *inside { *most } else { 0.0 });
        },
    );
    found
}

/// How far such a line reaches, pixels.
const ARM: usize = 4;

/// Nine pixels in a row through the origin, in direction `n` of sixteen.
fn line(n: usize) -> [(isize, isize); 9] {
    let (sin, cos) = (n as f64 * std::f64::consts::PI / 16.0).sin_cos();
    std::array::from_fn(|k| {
        let t = k as f64 - 4.0;
        ((t * cos).round() as isize, (t * sin).round() as isize)
    })
}

/// The eight neighbours of a pixel, by what to add to column and row; the diagonal ones last.
const AROUND: [(isize, isize); 8] =
    [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];

/// 8-connected components.
fn regions(mask: &Mask) -> Vec<Vec<usize>> {
    let mut left = mask.data.clone();
    let mut regions = Vec::new();
    for seed in 0..left.len() {
        if !std::mem::take(&mut left[seed]) {
            continue;
        }
        let (mut pixels, mut next) = (vec![seed], 0);
        while next < pixels.len() {
            let (x, y) = mask.place(pixels[next]);
            next += 1;
            for (dx, dy) in AROUND {
                let (Some(u), Some(v)) = (x.checked_add_signed(dx), y.checked_add_signed(dy))
                else {
                    continue;
                };
                if u < mask.width
                    && v < mask.height
                    && std::mem::take(&mut left[v * mask.width + u])
                {
                    pixels.push(v * mask.width + u);
                }
            }
        }
        regions.push(pixels);
    }
    regions
}

/// Length along a region: its longest shortest path, pixels.
pub fn length(pixels: &[usize], width: usize) -> f64 {
    if pixels.is_empty() { 0.0 } else { Shape::along(pixels, width).length }
}

/// The longest of the shortest paths within a region.
#[derive(Clone, Copy)]
struct Shape {
    /// Its length, pixels.
    length: f64,
    /// The pixel in its middle, and the one where it begins.
    middle: usize,
    start: usize,
}

impl Shape {
    /// The shape of a region if it is that of a crack.
    fn of(pixels: &[usize], width: usize, settings: &CrackSettings) -> Option<Self> {
        if (pixels.len() as f32) < settings.min_length {
            return None;
        }
        let shape = Self::along(pixels, width);
        let long = shape.length >= f64::from(settings.min_length);
        let elongated =
            shape.length * shape.length >= f64::from(settings.elongation) * pixels.len() as f64;
        let thin =
            || 2.0 * half_width(pixels, width) * f64::from(settings.thinness) <= shape.length;
        let width_px = pixels.len() as f64 / shape.length;
        let plain = || {
            outline(pixels, width)
                <= 2.0 * f64::from(settings.branching) * (shape.length + width_px)
        };
        (long && elongated && thin() && plain()).then_some(shape)
    }

    fn is_long(&self, pixel_mm: f32, settings: &CrackSettings) -> bool {
        self.length * f64::from(pixel_mm) >= f64::from(settings.likely_length_mm)
    }

    /// From any pixel to the farthest, and from there to the farthest again. Steps cost 5 and 7,
    /// which is √2 to one per cent (Borgefors 1986).
    fn along(pixels: &[usize], width: usize) -> Self {
        let start = farthest(pixels, width, pixels[0]).0;
        let (end, cost) = farthest(pixels, width, start);
        let total = cost[&end];
        let middle = pixels
            .iter()
            .copied()
            .min_by_key(|i| (cost[i].abs_diff(total / 2), *i))
            .unwrap_or(start);
        Self { length: f64::from(total) / 5.0 + 1.0, middle, start }
    }

    /// Missing mass of its cuts, one a pixel along it: the mean of the middle third of them.
    fn opening(&self, pixels: &[usize], grey: &Grid<f32>) -> f64 {
        let (_, cost) = farthest(pixels, grey.width, self.start);
        // A length is a number of steps and one pixel, so that there is at least one cut.
        let mut cuts = vec![0.0; self.length as usize];
        for &i in pixels {
            let at = (cost[&i] / 5) as usize;
            cuts[at.min(self.length as usize - 1)] += f64::from(1.0 - grey.data[i]);
        }
        cuts.sort_by(f64::total_cmp);
        let middle = &cuts[cuts.len() / 3..cuts.len() - cuts.len() / 3];
        middle.iter().sum::<f64>() / middle.len() as f64
    }
}

/// The pixel farthest from `start` within the region, and what every pixel costs to reach.
fn farthest(pixels: &[usize], width: usize, start: usize) -> (usize, HashMap<usize, u32>) {
    let mut cost: HashMap<usize, u32> = pixels.iter().map(|&i| (i, u32::MAX)).collect();
    cost.insert(start, 0);
    let mut queue = BinaryHeap::from([(Reverse(0), start)]);
    let mut last = (0, start);
    while let Some((Reverse(c), i)) = queue.pop() {
        if c > cost[&i] {
            continue;
        }
        // Of equally far pixels the first in reading order, so that the answer does not depend on
        // the heap.
        if c > last.0 || (c == last.0 && i < last.1) {
            last = (c, i);
        }
        for (n, (dx, dy)) in AROUND.into_iter().enumerate() {
            let (Some(u), Some(v)) =
                ((i % width).checked_add_signed(dx), (i / width).checked_add_signed(dy))
            else {
                continue;
            };
            let (j, c) = (v * width + u, c + if n < 4 { 5 } else { 7 });
            if u < width && cost.get(&j).is_some_and(|&old| c < old) {
                cost.insert(j, c);
                queue.push((Reverse(c), j));
            }
        }
    }
    (last.1, cost)
}

/// Length of a region's outline, pixels: π/4 of its pixel edges (Cauchy and Crofton).
fn outline(pixels: &[usize], width: usize) -> f64 {
    let set: HashSet<usize> = pixels.iter().copied().collect();
    let outside = |i: usize| {
        let x = i % width;
        let [left, right] =
            [x > 0 && set.contains(&(i - 1)), x + 1 < width && set.contains(&(i + 1))];
        let [up, down] = [i >= width && set.contains(&(i - width)), set.contains(&(i + width))];
        [left, right, up, down].into_iter().filter(|inside| !inside).count()
    };
    std::f64::consts::FRAC_PI_4 * pixels.iter().map(|&i| outside(i)).sum::<usize>() as f64
}

/// Half the width of a region where it is widest, pixels.
fn half_width(pixels: &[usize], width: usize) -> f64 {
    let (mut from, mut to) = ((usize::MAX, usize::MAX), (0, 0));
    for &i in pixels {
        let (x, y) = (i % width, i / width);
        from = (from.0.min(x), from.1.min(y));
        to = (to.0.max(x), to.1.max(y));
    }
    let mut part = Mask::new(to.0 - from.0 + 1, to.1 - from.1 + 1, false);
    for &i in pixels {
        part.data[(i / width - from.1) * part.width + i % width - from.0] = true;
    }
    part.distance().data.iter().copied().fold(0.0, f32::max).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of 3 × 100 pixels that the network takes for a crack: among voids that are a quarter
    /// of all, and alone.
    #[test]
    fn in_a_nest_of_voids_there_are_no_cracks() {
        let size = 120;
        let line = |i: usize| (59..62).contains(&(i / size)) && (10..110).contains(&(i % size));
        let draw = |of: &dyn Fn(usize) -> bool| Mask {
            width: size,
            height: size,
            data: (0..size * size).map(of).collect(),
        };
        let (body, chance) = (draw(&|_| true), draw(&line).map(|v| f32::from(u8::from(v))));
        let settings = CrackSettings::default();
        let cracks = |dark: &Mask| {
            let grey = chance.map(|v| 1.0 - 0.5 * v);
            find_likely(
                &outside_nests(&chance, dark, &body, &settings, &Job::default()),
                &grey,
                &body,
                0.5,
                0.5,
                &settings,
            )
            .list
        };
        let nest = draw(&|i| line(i) || (i % size % 8 < 4 && i / size % 8 < 4));
        assert!(cracks(&nest).is_empty());
        let found = cracks(&draw(&line));
        assert!(found.len() == 1 && (found[0].width_mm - 1.5).abs() < 0.1, "{found:?}");
    }

    /// The false crack of 8 mm that a scan's streaks left: in a member it is none alone, being
    /// shorter than a grain of 16 mm, but a scrap of a longer crack it may be; on small specimens
    /// it stays one.
    #[test]
    fn in_members_what_is_shorter_than_a_grain_is_no_crack() {
        let size = 160;
        let lengths = |short: bool, long: bool, gap: usize, settings: &CrackSettings| {
            // Half a millimetre a pixel: 60 pixels are 30 mm, 16 are 8.
            let is_long = |x: usize| long && (10..70).contains(&x);
            let is_short = |x: usize| short && (70 + gap..86 + gap).contains(&x);
            let line = |i: usize| {
                (79..81).contains(&(i / size)) && (is_long(i % size) || is_short(i % size))
            };
            let chance = Grid {
                width: size,
                height: size,
                data: (0..size * size).map(|i| f32::from(u8::from(line(i)))).collect(),
            };
            let found = find_likely(
                &chance,
                &chance.map(|v| 1.0 - 0.5 * v),
                &Mask::new(size, size, true),
                0.5,
                0.5,
                settings,
            );
            found.list.iter().map(|c| c.length_mm.round() as u32).collect::<Vec<_>>()
        };
        let members = crate::detect::DetectSettings::default().in_members().crack;
        assert_eq!(lengths(true, false, 0, &CrackSettings::default()), [8]);
        assert_eq!(lengths(true, false, 0, &members), [0; 0]);
        assert_eq!(lengths(false, true, 0, &members), [30]);
        assert_eq!(lengths(true, true, 30, &members), [30, 8]);
        assert_eq!(lengths(true, true, 34, &members), [30]);
    }
}
