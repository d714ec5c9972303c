//! A slice looked at by hand: its grey along a line, and what is in a region of it. Places are mm
//! from the slice's upper left corner.

use std::ops::Range;

use intrados_raster::grid::Grid;

use crate::{detect::Detection, slice::Slice};

/// Grey along the line between two places of the slice, each with its distance from the first, mm:
/// bilinear between the centres of pixels, at steps of at most half a pixel. What lies beyond the
/// slice is left out.
#[must_use]
pub fn along(slice: &Slice, [from, to]: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    let pixel = f64::from(slice.pixel_mm);
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]);
    let steps = (2.0 * length / pixel).ceil().max(1.0) as usize;
    let sample = |k: usize| {
        let share = k as f64 / steps as f64;
        let at = [0, 1].map(|i| (from[i] + share * way[i]) / pixel);
        Some([share * length, bilinear(&slice.grey, at)?])
    };
    (0..=steps).filter_map(sample).collect()
}

/// Grey at a place in pixels from the corner; over the outer half of the outer pixels it is as at
/// their centres.
fn bilinear(grey: &Grid<f32>, [x, y]: [f64; 2]) -> Option<f64> {
    let is_inside = |x: f64, n: usize| n > 0 && (0.0..=n as f64).contains(&x);
    if !is_inside(x, grey.width) || !is_inside(y, grey.height) {
        return None;
    }
    let split = |x: f64, n: usize| {
        let x = (x - 0.5).clamp(0.0, (n - 1) as f64);
        let low = x as usize;
        (low, (low + 1).min(n - 1), x - low as f64)
    };
    let ((left, right, s), (above, below, t)) = (split(x, grey.width), split(y, grey.height));
    let value = |x: usize, y: usize| f64::from(grey.data[y * grey.width + x]);
    let row = |y: usize| (1.0 - s) * value(left, y) + s * value(right, y);
    Some((1.0 - t) * row(above) + t * row(below))
}

/// A region between two corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// All that lies between them.
    Rectangle,
    /// The ellipse that touches the rectangle's edges.
    Ellipse,
}

impl Shape {
    /// The pixels whose centres lie in it, in reading order; corners in pixels.
    fn pixels(
        self,
        width: usize,
        height: usize,
        [a, b]: [[f64; 2]; 2],
    ) -> impl Iterator<Item = usize> {
        let [left, top] = [0, 1].map(|i: usize| a[i].min(b[i]));
        let [right, bottom] = [0, 1].map(|i: usize| a[i].max(b[i]));
        centres(top, bottom, height).flat_map(move |y| {
            // From −1 at the top to 1 at the bottom.
            let v = (2.0 * y as f64 + 1.0 - top - bottom) / (bottom - top);
            let wide = match self {
                Self::Rectangle => 1.0,
                Self::Ellipse => (1.0 - v * v).max(0.0).sqrt(),
            };
            let (middle, half) = (0.5 * (left + right), 0.5 * wide * (right - left));
            centres(middle - half, middle + half, width).map(move |x| y * width + x)
        })
    }
}

/// Of `n` pixels in a row those whose centres lie from `low` on and before `high`.
fn centres(low: f64, high: f64, n: usize) -> Range<usize> {
    let first = |x: f64| ((x - 0.5).ceil().max(0.0) as usize).min(n);
    first(low)..first(high)
}

/// What is in a region of a slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Pixels whose centres lie in it.
    pub pixels: usize,
    /// Their area, mm².
    pub area_mm2: f64,
    /// Mean of their grey.
    pub mean: f64,
    /// Standard deviation of their grey, over n − 1; 0 of a single pixel.
    pub deviation: f64,
    /// Their least grey.
    pub least: f64,
    /// Their largest grey.
    pub largest: f64,
    /// Share of them that are pores.
    pub pores: f64,
    /// Share of them that are cracks.
    pub cracks: f64,
    /// Share of them that are concrete without pores and cracks. The rest is metal, or beyond the
    /// body.
    pub concrete: f64,
}

impl Region {
    /// What is in a region between two corners; none where no pixel's centre lies in it, or where
    /// `found` is of a slice of another size.
    #[must_use]
    pub fn of(
        slice: &Slice,
        found: &Detection,
        shape: Shape,
        corners: [[f64; 2]; 2],
    ) -> Option<Self> {
        let (grey, pixel) = (&slice.grey, f64::from(slice.pixel_mm));
        if !found.body.fits(grey) || !found.labels.fits(grey) || !found.crack_mask.fits(grey) {
            return None;
        }
        let (mut n, mut mean, mut squares) = (0_usize, 0.0_f64, 0.0_f64);
        let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        let [mut pores, mut cracks, mut concrete] = [0_usize; 3];
        for i in shape.pixels(grey.width, grey.height, corners.map(|at| at.map(|mm| mm / pixel))) {
            let value = f64::from(grey.data[i]);
            (least, largest) = (least.min(value), largest.max(value));
            // Welford's: small differences of large greys stay exact.
            n += 1;
            let before = value - mean;
            mean += before / n as f64;
            squares += before * (value - mean);
            if found.crack_mask.data[i] {
                cracks += 1;
            } else if found.labels.data[i] != 0 {
                pores += 1;
            } else if found.body.data[i] {
                concrete += 1;
            }
        }
        let share = |count: usize| count as f64 / n as f64;
        (n > 0).then(|| Self {
            pixels: n,
            area_mm2: n as f64 * pixel * pixel,
            mean,
            deviation: (squares / n.saturating_sub(1).max(1) as f64).sqrt(),
            least,
            largest,
            pores: share(pores),
            cracks: share(cracks),
            concrete: share(concrete),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use intrados_stage::Estimate;

    use super::*;

    /// A slice of 100 × 80 pixels.
    fn slice(pixel_mm: f32, grey: impl Fn(usize, usize) -> f32) -> Slice {
        let data = (0..8_000).map(|i| grey(i % 100, i / 100)).collect();
        Slice { name: "made".into(), grey: Grid { width: 100, height: 80, data }, pixel_mm }
    }

    /// In a body that ends at column 90: what is darker than 700 is a pore, row 5 is a crack.
    fn found(slice: &Slice) -> Detection {
        let grey = &slice.grey;
        let places = |of: fn(usize, usize) -> bool| Grid {
            data: (0..8_000).map(|i| of(i % 100, i / 100)).collect(),
            ..Grid::new(100, 80, false)
        };
        Detection {
            grey: grey.clone(),
            body: places(|x, _| x < 90),
            seen: places(|x, _| x < 90),
            labels: grey.map(|v| u32::from(v < 700.0)),
            pores: Vec::new(),
            cracks: Vec::new(),
            crack_mask: places(|x, y| x < 90 && y == 5),
            porosity: Estimate { value: 0.0, std_error: 0.0 },
            sampling_error: 0.0,
            noise: 0.0,
            air_drop: 1.0,
            pixel_mm: slice.pixel_mm,
        }
    }

    /// 600 in a disc of 20 pixels round (50, 40), 1000 about it.
    fn disc() -> Slice {
        let from = |x: usize, y: usize| (x as f32 + 0.5 - 50.0).hypot(y as f32 + 0.5 - 40.0);
        slice(0.5, |x, y| if from(x, y) < 20.0 { 600.0 } else { 1000.0 })
    }

    #[test]
    fn a_line_over_a_ramp_is_the_ramp() {
        let ramp = slice(0.5, |x, y| 2.0 * x as f32 + 3.0 * y as f32 + 1.0);
        let [from, to] = [[1.0, 2.0], [31.3, 17.1]];
        let line = along(&ramp, [from, to]);
        let length = 30.3_f64.hypot(15.1);
        assert!((line[line.len() - 1][0] - length).abs() < 1e-9 && line[0][0] == 0.0);
        assert!(line.windows(2).all(|w| w[1][0] - w[0][0] <= 0.25 + 1e-9));
        for [s, value] in line {
            let [x, y] = [0, 1].map(|i| (from[i] + s / length * (to[i] - from[i])) / 0.5 - 0.5);
            assert!((value - (2.0 * x + 3.0 * y + 1.0)).abs() < 1e-4, "{value} at {s} mm");
        }
    }

    #[test]
    fn a_line_ends_where_the_slice_does_and_a_point_is_one() {
        let ramp = slice(0.5, |x, _| x as f32);
        let line = along(&ramp, [[-10.0, 20.0], [54.0, 20.0]]);
        assert_eq!((line[0], line[line.len() - 1]), ([10.0, 0.0], [60.0, 99.0]));
        assert!(along(&ramp, [[-1.0, 20.0], [-1.0, 30.0]]).is_empty());
        assert!(along(&ramp, [[10.25, 20.0]; 2]).iter().all(|s| *s == [0.0, 20.0]));
    }

    #[test]
    fn a_rectangle_over_a_ramp_has_its_moments() {
        let ramp = slice(0.5, |x, _| x as f32 + 1e6);
        // Columns 10 to 29 and rows 20 to 29, whichever corner comes first.
        let region =
            Region::of(&ramp, &found(&ramp), Shape::Rectangle, [[15.0, 10.0], [5.0, 15.0]])
                .unwrap();
        assert_eq!((region.pixels, region.area_mm2), (200, 50.0));
        assert_eq!((region.least, region.largest), (1_000_010.0, 1_000_029.0));
        assert!((region.mean - 1_000_019.5).abs() < 1e-6);
        // Twenty steps of a ladder, ten times each: (20² − 1) / 12, over n − 1.
        let variance = (400.0 - 1.0) / 12.0 * 200.0 / 199.0;
        assert!((region.deviation - f64::sqrt(variance)).abs() < 1e-6);
    }

    #[test]
    fn an_ellipse_over_a_disc_is_the_disc() {
        let slice = disc();
        let found = found(&slice);
        let round = [[15.0, 10.0], [35.0, 30.0]];
        let inside = Region::of(&slice, &found, Shape::Ellipse, round).unwrap();
        assert!((inside.area_mm2 / (PI * 100.0) - 1.0).abs() < 0.01, "{inside:?}");
        assert_eq!((inside.least, inside.mean, inside.largest), (600.0, 600.0, 600.0));
        assert_eq!((inside.deviation, inside.pores, inside.concrete), (0.0, 1.0, 0.0));
        // The square about it: a share p of 600 and the rest of 1000.
        let square = Region::of(&slice, &found, Shape::Rectangle, round).unwrap();
        let p = inside.pixels as f64 / 1_600.0;
        assert_eq!((square.pixels, square.pores), (1_600, p));
        assert!((square.mean - (1000.0 - 400.0 * p)).abs() < 1e-9);
        let deviation = 400.0 * (p * (1.0 - p) * 1_600.0 / 1_599.0).sqrt();
        assert!((square.deviation - deviation).abs() < 1e-9);
    }

    #[test]
    fn what_is_beyond_the_body_and_what_is_a_crack_is_no_concrete() {
        let slice = slice(1.0, |_, _| 1000.0);
        let found = found(&slice);
        let all = Region::of(&slice, &found, Shape::Rectangle, [[-5.0, -5.0], [500.0, 500.0]]);
        let all = all.unwrap();
        assert_eq!((all.pixels, all.pores), (8_000, 0.0));
        assert_eq!((all.cracks, all.concrete), (90.0 / 8_000.0, 90.0 * 79.0 / 8_000.0));
        // No centre of a pixel, and nothing of the slice.
        let region = |corners| Region::of(&slice, &found, Shape::Ellipse, corners);
        assert_eq!(region([[10.6, 10.6], [11.4, 11.4]]), None);
        assert_eq!(region([[200.0, 10.0], [300.0, 20.0]]), None);
    }
}
