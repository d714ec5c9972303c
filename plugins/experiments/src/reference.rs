//! The methods that ours is compared with. Both see the body as the convex hull of what is bright,
//! less a rim of two pixels, and both call a dark component a crack if it is more than five times
//! longer than wide.

use intrados_ct::{
    crack,
    detect::{self, DetectSettings},
    slice::Slice,
};
use intrados_raster::grid::median;
use intrados_raster::grid::{Grid, Mask, hull_side, row_ends};

/// Length over mean width from which a dark component is a crack.
const ELONGATION: f64 = 5.0;
/// Pixels at the body's outline that are left alone.
const RIM: f32 = 2.0;
/// Bins of Otsu's histogram.
const BINS: usize = 256;

/// What a method says of a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodMarks {
    /// Pores.
    pub pores: Mask,
    /// Numbers of the pores from 1, where a method splits what touches; else by 4-connection.
    pub objects: Vec<Vec<usize>>,
    /// Cracks.
    pub cracks: Mask,
}

/// Otsu's threshold over the slice, connected components (Otsu 1979).
#[must_use]
pub fn otsu(slice: &Slice) -> MethodMarks {
    let threshold = otsu_threshold(&slice.grey);
    let body = body(&slice.grey, threshold);
    let dark = Mask {
        data: slice.grey.data.iter().zip(&body.data).map(|(v, b)| *b && *v < threshold).collect(),
        ..body
    };
    told(&dark, None)
}

/// Sauvola's threshold in a window of `window` pixels with the k and r of `settings`, connected
/// components, the pores among them split by a watershed of the distance map.
#[must_use]
pub(crate) fn sauvola(slice: &Slice, settings: &DetectSettings) -> MethodMarks {
    let otsu = otsu_threshold(&slice.grey);
    let body = body(&slice.grey, otsu);
    let matrix =
        median(slice.grey.data.iter().zip(&body.data).filter(|(_, b)| **b).map(|(v, _)| *v))
            .unwrap_or(1.0);
    // Steel must not raise the threshold beside it, nor air lower it at the rim.
    let value = |(v, b): (&f32, &bool)| if *b { (v / matrix).min(settings.ceiling) } else { 1.0 };
    let grey =
        Grid { data: slice.grey.data.iter().zip(&body.data).map(value).collect(), ..slice.grey };
    let threshold = detect::sauvola(&grey, settings);
    let dark = Mask {
        data: (0..grey.data.len())
            .map(|i| body.data[i] && grey.data[i] < threshold.data[i])
            .collect(),
        ..body
    };
    told(&dark, settings.split)
}

/// The strong reference's window, k and split. Of four windows, five k and two filters of the
/// backprojection these did best on four of the twenty cases themselves (C02, C08, C09, B01, at a
/// dose of 0.8): so much is allowed to nobody else.
#[must_use]
pub(crate) fn strongest() -> DetectSettings {
    DetectSettings { window: 41, k: 0.8, split: Some(1.0), ..DetectSettings::default() }
}

fn told(dark: &Mask, split: Option<f32>) -> MethodMarks {
    let mut components = dark.components();
    let mut cracks = dark.map(|_| false);
    components.members.retain(|pixels| {
        let length = crack::length(pixels, dark.width);
        let is_crack = length * length >= ELONGATION * pixels.len() as f64;
        if is_crack {
            pixels.iter().for_each(|i| cracks.data[*i] = true);
        }
        !is_crack
    });
    components.labels.data.fill(0);
    for (n, pixels) in components.members.iter().enumerate() {
        pixels.iter().for_each(|i| components.labels.data[*i] = n as u32 + 1);
    }
    let pores = components.labels.map(|l| l != 0);
    let objects = match split {
        Some(height) => detect::split(&components, height),
        None => components.members,
    };
    MethodMarks { pores, objects, cracks }
}

/// Half way in the sense of Otsu between what is dark and what is bright, over the whole field;
/// what is brighter than twice the median of the bright (steel) counts as that.
pub(super) fn otsu_threshold(grey: &Grid<f32>) -> f32 {
    let low = grey.data.iter().copied().fold(f32::INFINITY, f32::min).max(-1e30);
    let mean = grey.data.iter().map(|v| f64::from(*v)).sum::<f64>() / grey.data.len().max(1) as f64;
    let high =
        2.0 * median(grey.data.iter().copied().filter(|v| f64::from(*v) > mean)).unwrap_or(1.0);
    let mut histogram = vec![0.0_f64; BINS];
    let scale = BINS as f32 / (high - low).max(1e-12);
    grey.data
        .iter()
        .for_each(|v| histogram[(((v.min(high) - low) * scale) as usize).min(BINS - 1)] += 1.0);
    let all: f64 = histogram.iter().sum();
    let moment: f64 = histogram.iter().enumerate().map(|(i, n)| i as f64 * n).sum();
    let (mut best, mut below, mut first) = ((-1.0, 0), 0.0, 0.0);
    for (i, n) in histogram.iter().enumerate() {
        below += n;
        first += i as f64 * n;
        if below > 0.0 && below < all {
            let between = (moment * below / all - first).powi(2) / (below * (all - below));
            if between > best.0 {
                best = (between, i);
            }
        }
    }
    low + (best.1 + 1) as f32 / scale
}

/// The convex hull of the largest bright component, less a rim.
pub(super) fn body(grey: &Grid<f32>, threshold: f32) -> Mask {
    let bright = grey.map(|v| v >= threshold).components().members;
    let Some(largest) = bright.iter().max_by_key(|pixels| pixels.len()) else {
        return grey.map(|_| false);
    };
    hull(largest, grey.width, grey.height).distance().map(|d| d > RIM)
}

/// All pixels within the convex hull of some (row by row between its sides).
pub(super) fn hull(pixels: &[usize], width: usize, height: usize) -> Mask {
    let ends = row_ends(pixels, width);
    let side = |k: usize, sign: f64| {
        let chain = hull_side(ends.iter().map(|(&y, row)| [row[k] as f64, y as f64]), sign);
        move |y: f64| {
            let i = chain.partition_point(|p| p[1] <= y).clamp(1, chain.len().max(2) - 1);
            let (a, b) = (chain[i - 1], chain[i.min(chain.len() - 1)]);
            if b[1] > a[1] { a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) } else { a[0] }
        }
    };
    let mut mask = Mask::new(width, height, false);
    let (Some((&first, _)), Some((&last, _))) = (ends.first_key_value(), ends.last_key_value())
    else {
        return mask;
    };
    let (left, right) = (side(0, -1.0), side(1, 1.0));
    for y in first..=last {
        let (a, b) = (left(y as f64).ceil().max(0.0) as usize, right(y as f64).floor() as usize);
        (a..=b.min(width - 1)).for_each(|x| mask.data[y * width + x] = true);
    }
    mask
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(width: usize, height: usize, grey: impl Fn(usize, usize) -> f32) -> Slice {
        let data = (0..width * height).map(|i| grey(i % width, i / width)).collect();
        Slice { name: "drawn".into(), grey: Grid { width, height, data }, pixel_mm: 0.5 }
    }

    /// A square of concrete in air with a round pore, and a strip of 2 × 11 pixels, which is a
    /// crack, while one of 3 × 11 is none (12² < 5 · 33 < 14²).
    #[test]
    fn five_times_longer_than_wide_is_a_crack() {
        let drawn = |wide: usize| {
            slice(60, 60, move |x, y| match () {
                () if !(6..54).contains(&x) || !(6..54).contains(&y) => 0.0,
                () if (x as f32 - 20.0).hypot(y as f32 - 20.0) < 4.0 => 0.1,
                () if (30..30 + wide).contains(&x) && (30..41).contains(&y) => 0.1,
                () => 1.0,
            })
        };
        let settings =
            DetectSettings { k: 0.5, window: 21, split: Some(1.0), ..DetectSettings::default() };
        for marks in [otsu(&drawn(2)), sauvola(&drawn(2), &settings)] {
            assert_eq!((marks.objects.len(), marks.cracks.count()), (1, 22));
            assert_eq!(marks.pores.count(), 49 - 4);
        }
        let marks = otsu(&drawn(3));
        assert_eq!((marks.objects.len(), marks.cracks.count()), (2, 0));
    }

    #[test]
    fn a_hull_is_convex_and_whole() {
        let ring = slice(40, 30, |x, y| {
            let r = (x as f32 - 19.0).hypot(y as f32 - 14.0);
            f32::from(u8::from((6.0..12.0).contains(&r) && x.abs_diff(19) > 1))
        });
        let pixels: Vec<usize> = (0..1200).filter(|&i| ring.grey.data[i] > 0.5).collect();
        let hull = hull(&pixels, 40, 30);
        let disc =
            (0..1200).filter(|&i| ((i % 40) as f32 - 19.0).hypot((i / 40) as f32 - 14.0) < 11.0);
        assert!(disc.clone().all(|i| hull.data[i]));
        assert!((0..1200).all(
            |i| !hull.data[i] || ((i % 40) as f32 - 19.0).hypot((i / 40) as f32 - 14.0) < 12.5
        ));
    }
}
