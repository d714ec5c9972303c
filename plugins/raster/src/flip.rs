//! FLIP: how different two pictures look to somebody who sees them in turn at the same place.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference
//! Evaluator for Alternating Images" (Proceedings of the ACM on Computer Graphics and Interactive
//! Techniques 3, 2), for pictures as a screen shows them. Colours are compared as an eye at its
//! distance makes them out, edges and points beside them; letters in brackets are the paper's.

use std::f64::consts::PI;

use intrados_stage::Job;
use rayon::prelude::*;

use crate::Grid;

/// Pixels per degree (p) of the paper's viewer: 0.7 m before a screen of 3840 pixels that is 0.7 m
/// wide.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// Contrast sensitivity to lightness, to red against green and to blue against yellow, as the sum
/// of a √(π/b) exp(−π² x²/b) over pairs of (a, b), x in degrees (the paper's table 1).
const SENSITIVITY: [&[[f64; 2]]; 3] =
    [&[[1.0, 0.0047]], &[[1.0, 0.0053]], &[[34.1, 0.04], [13.5, 0.025]]];
/// Exponent of differences of colour (q_c).
const COLOUR_POWER: f32 = 0.7;
/// Up to this share of the largest difference of colour (p_c), more is that much worse,
const KNEE: f32 = 0.4;
/// up to this value (p_t); what is larger shares the rest.
const KNEE_VALUE: f32 = 0.95;
/// Width of edges and points that are noticed (w), degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of differences of edges and points (q_f).
const FEATURE_POWER: f32 = 0.5;

/// X, Y and Z, each over that of white, from linear sRGB (IEC 61966-2-1; white is D65).
const TO_XYZ: [[f32; 3]; 3] = [
    [0.433_949_9, 0.376_209_8, 0.189_840_3],
    [0.212_672_9, 0.715_152_1, 0.072_175],
    [0.017_756_6, 0.109_468, 0.872_775_5],
];
/// The way back.
const FROM_XYZ: [[f32; 3]; 3] = [
    [3.079_955, -1.537_139, -0.542_816_1],
    [-0.921_258_6, 1.876_011, 0.045_247_5],
    [0.052_887_4, -0.204_025_9, 1.151_138],
];
/// Where the cube root of L*a*b* begins (CIE 15).
const DARK: f32 = 6.0 / 29.0;

/// How different two pictures of the same size look (sRGB bytes), pixel by pixel: 0 alike, 1 as
/// different as can be. None: their sizes differ, or the job was cancelled.
#[must_use]
pub fn difference(pictures: [&Grid<[u8; 3]>; 2], job: &Job) -> Option<Grid<f32>> {
    let [picture, other] = pictures;
    if !picture.fits(other) {
        return None;
    }
    let [one, two] = pictures.map(|picture| Percept::of(picture, job));
    job.check().ok()?;
    // No two colours of a screen are farther apart than its green and its blue.
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt_lab(times(&TO_XYZ, rgb)));
    let largest = apart(green, blue).powf(COLOUR_POWER);
    let pixel = |i: usize| {
        let colour = colour_difference(one.colours[i], two.colours[i], largest);
        let features = [0, 1].map(|k| [&one, &two].map(|p| p.features[k].data[i]));
        colour.powf(1.0 - feature_difference(features))
    };
    let data = (0..picture.data.len()).into_par_iter().map(pixel).collect();
    Some(Grid { width: picture.width, height: picture.height, data })
}

/// What is compared of a picture.
struct Percept {
    /// L*, a* and b* of every pixel as an eye sees it that makes out no finer detail.
    colours: Vec<[f32; 3]>,
    /// How strong edges are, and points.
    features: [Grid<f32>; 2],
}

impl Percept {
    fn of(picture: &Grid<[u8; 3]>, job: &Job) -> Self {
        let planes = opponent_planes(picture);
        // Luminance from 0 to 1.
        let features = features(&planes[0].map(|y| (y + 16.0) / 116.0), job);
        let [light, red, blue] = [0, 1, 2].map(|k| blurred(&planes[k], SENSITIVITY[k], job));
        let seen = light.data.par_iter().zip(&red.data).zip(&blue.data);
        let colours = seen.map(|((&light, &red), &blue)| {
            // A filter may leave the cube of what a screen can show.
            let rgb = times(&FROM_XYZ, from_opponent([light, red, blue]));
            hunt_lab(times(&TO_XYZ, rgb.map(|v| v.clamp(0.0, 1.0))))
        });
        Self { colours: colours.collect(), features }
    }
}

fn times(matrix: &[[f32; 3]; 3], [a, b, c]: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * a + row[1] * b + row[2] * c)
}

/// For every sRGB byte its linear value (IEC 61966-2-1).
fn linear_of_bytes() -> [f32; 256] {
    std::array::from_fn(|byte| {
        let s = byte as f64 / 255.0;
        (if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }) as f32
    })
}

/// Y, Cx and Cz: like L*a*b*, but linear in light, so that it may be filtered. White is
/// (100, 0, 0).
fn opponent([x, y, z]: [f32; 3]) -> [f32; 3] {
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([light, red, blue]: [f32; 3]) -> [f32; 3] {
    let y = (light + 16.0) / 116.0;
    [red / 500.0 + y, y, y - blue / 200.0]
}

fn opponent_planes(picture: &Grid<[u8; 3]>) -> [Grid<f32>; 3] {
    let linear = linear_of_bytes();
    let colour = |rgb: &[u8; 3]| {
        let rgb = rgb.map(|byte| linear[usize::from(byte)]);
        opponent(times(&TO_XYZ, rgb))
    };
    let colours: Vec<[f32; 3]> = picture.data.par_iter().map(colour).collect();
    [0, 1, 2].map(|k: usize| Grid {
        width: picture.width,
        height: picture.height,
        data: colours.iter().map(|colour| colour[k]).collect(),
    })
}

/// L*, a* and b* (CIE 15), a* and b* times L*/100: in the dark, colours look paler (Hunt).
fn hunt_lab(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz.map(|t| {
        let is_dark = t <= DARK * DARK * DARK;
        if is_dark { t / (3.0 * DARK * DARK) + 4.0 / 29.0 } else { t.cbrt() }
    });
    let light = 116.0 * y - 16.0;
    [light, 5.0 * light * (x - y), 2.0 * light * (y - z)]
}

/// HyAB, |ΔL*| + √(Δa*² + Δb*²): of large differences it says more than the straight distance does
/// (Abasi, Tehran and Fairchild 2020).
fn apart(one: [f32; 3], other: [f32; 3]) -> f32 {
    let [light, a, b]: [f32; 3] = std::array::from_fn(|k| one[k] - other[k]);
    light.abs() + (a * a + b * b).sqrt()
}

/// ΔE_c: the distance of two colours to the power q_c, up to p_c of the `largest` spread over 0 to
/// p_t, beyond over the rest to 1.
fn colour_difference(one: [f32; 3], other: [f32; 3], largest: f32) -> f32 {
    let distance = apart(one, other).powf(COLOUR_POWER);
    let knee = KNEE * largest;
    if distance < knee {
        KNEE_VALUE * distance / knee
    } else {
        let beyond = (distance - knee) / (largest - knee);
        KNEE_VALUE + (1.0 - KNEE_VALUE) * beyond.min(1.0)
    }
}

/// ΔE_f: by how much edges or points, whichever more, are stronger in one of the two, over √2, to
/// the power q_f.
fn feature_difference(features: [[f32; 2]; 2]) -> f32 {
    let [edges, points] = features.map(|[one, other]| (one - other).abs());
    (edges.max(points) / std::f32::consts::SQRT_2).min(1.0).powf(FEATURE_POWER)
}

/// A function of the distance from the middle, in pixels.
fn samples(reach: usize, of: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * reach).map(|i| of(i as f64 - reach as f64)).collect()
}

/// A plane as an eye of this contrast sensitivity makes it out. In two dimensions a Gaussian is the
/// product of two, and the sum of its samples the product of their sums.
fn blurred(plane: &Grid<f32>, sensitivity: &[[f64; 2]], job: &Job) -> Grid<f32> {
    let reach = reach();
    let of = |[a, b]: &[f64; 2]| {
        let gaussian = samples(reach, |x| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp());
        let sum: f64 = gaussian.iter().sum();
        let kernel: Vec<f32> = gaussian.iter().map(|v| (v / sum) as f32).collect();
        (a * (PI / b).sqrt() * sum * sum, kernel)
    };
    let parts: Vec<(f64, Vec<f32>)> = sensitivity.iter().map(of).collect();
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    let mut seen = Grid::new(plane.width, plane.height, 0.0_f32);
    for (weight, kernel) in &parts {
        let share = (weight / total) as f32;
        let part = plane.convolved(kernel, job);
        seen.data.iter_mut().zip(&part.data).for_each(|(sum, v)| *sum += share * v);
    }
    seen
}

/// Where all those Gaussians are cut off: at 3 σ of the widest, σ = √(b/2)/π degrees.
fn reach() -> usize {
    let widest = SENSITIVITY.iter().flat_map(|pairs| pairs.iter()).map(|[_, b]| *b);
    let sigma = (0.5 * widest.fold(0.0, f64::max)).sqrt() / PI;
    (3.0 * sigma * PIXELS_PER_DEGREE).ceil() as usize
}

/// How strong the edges and the points of a plane are: lengths of its gradient and of its second
/// derivatives along x and y, after a Gaussian of σ = w p/2 pixels.
fn features(plane: &Grid<f32>, job: &Job) -> [Grid<f32>; 2] {
    let sigma = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let reach = (3.0 * sigma).ceil() as usize;
    let bell = |x: f64| (-0.5 * (x / sigma).powi(2)).exp();
    let smooth = balanced(&samples(reach, bell));
    let edge = balanced(&samples(reach, |x| -x * bell(x)));
    let point = balanced(&samples(reach, |x| ((x / sigma).powi(2) - 1.0) * bell(x)));
    let smooth_rows = plane.along_rows(&smooth, job);
    [edge, point].map(|kernel| {
        let x = plane.along_rows(&kernel, job).along_columns(&smooth, job);
        let mut length = smooth_rows.along_columns(&kernel, job);
        length.data.iter_mut().zip(&x.data).for_each(|(y, x)| *y = (*y * *y + x * x).sqrt());
        length
    })
}

/// The weights of a kernel, those above 0 so that they sum to 1 and those below so that they sum to
/// −1: what a plane from 0 to 1 gives is between −1 and 1.
fn balanced(samples: &[f64]) -> Vec<f32> {
    let sum = |sign: f64| -> f64 { samples.iter().map(|v| (sign * v).max(0.0)).sum() };
    let [above, below] = [sum(1.0), sum(-1.0)];
    samples.iter().map(|&v| (v / if v < 0.0 { below } else { above }) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    type Picture = Grid<[u8; 3]>;

    fn painted([width, height]: [usize; 2], colour: impl Fn(usize, usize) -> [u8; 3]) -> Picture {
        let data = (0..width * height).map(|i| colour(i % width, i / width)).collect();
        Grid { width, height, data }
    }

    fn flat(colour: [u8; 3]) -> Picture {
        painted([24, 16], |_, _| colour)
    }

    /// Two colours that meet at a column.
    fn edge(at: usize, left: [u8; 3], right: [u8; 3]) -> Picture {
        painted([60, 40], |x, _| if x < at { left } else { right })
    }

    /// Colours that change from pixel to pixel.
    fn wild(from: usize) -> Picture {
        painted([48, 32], |x, y| {
            let x = x + from;
            [37 * x + 11 * y, x * y, 5 * x * x + 13 * y].map(|v| (v % 256) as u8)
        })
    }

    fn map(one: &Picture, other: &Picture) -> Grid<f32> {
        difference([one, other], &Job::default()).expect("pictures of one size")
    }

    fn mean(one: &Picture, other: &Picture) -> f64 {
        let map = map(one, other);
        map.data.iter().map(|v| f64::from(*v)).sum::<f64>() / map.data.len() as f64
    }

    #[test]
    fn a_picture_is_no_different_from_itself() {
        assert!(map(&wild(0), &wild(0)).data.iter().all(|v| *v == 0.0));
    }

    #[test]
    fn it_is_the_same_both_ways_and_between_0_and_1() {
        let there = map(&wild(0), &wild(9));
        assert_eq!(there, map(&wild(9), &wild(0)));
        assert!(there.data.iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(there.data.iter().any(|v| *v > 0.5));
    }

    #[test]
    fn pictures_that_do_not_fit_and_jobs_that_are_cancelled_have_none() {
        let other = painted([16, 24], |_, _| [0; 3]);
        assert_eq!(difference([&flat([0; 3]), &other], &Job::default()), None);
        let job = Job::default();
        job.cancel();
        assert_eq!(difference([&flat([0; 3]), &flat([9; 3])], &job), None);
    }

    /// Of flat pictures no filter changes anything and no edge differs: what is left is ΔE_c. Of
    /// greys that is of ΔL* alone, and the largest one is of the sRGB green and blue, whose L*a*b*
    /// are (87.735, −86.183, 83.179) and (32.297, 79.188, −107.860).
    #[test]
    fn flat_greys_have_the_difference_of_the_formulas() {
        let lightness = |grey: u8| {
            let linear = ((f64::from(grey) / 255.0 + 0.055) / 1.055).powf(2.4);
            116.0 * linear.cbrt() - 16.0
        };
        let hunt = |[l, a, b]: [f64; 3]| [l, 0.01 * l * a, 0.01 * l * b];
        let green = hunt([87.735, -86.183, 83.179]);
        let blue = hunt([32.297, 79.188, -107.860]);
        let largest = green[0] - blue[0] + (green[1] - blue[1]).hypot(green[2] - blue[2]);
        let (largest, knee) = (largest.powf(0.7), 0.4 * largest.powf(0.7));
        let expected = |a: u8, b: u8| {
            let distance = (lightness(a) - lightness(b)).abs().powf(0.7);
            if distance < knee {
                0.95 * distance / knee
            } else {
                0.95 + 0.05 * (distance - knee) / (largest - knee)
            }
        };
        // The first two below the knee, the last beyond it.
        for [a, b] in [[120, 124], [100, 140], [40, 255]] {
            let found = map(&flat([a; 3]), &flat([b; 3]));
            let expected = expected(a, b);
            assert!(found.data.iter().all(|v| (f64::from(*v) - expected).abs() < 2e-4), "{a} {b}");
        }
    }

    #[test]
    fn black_is_nearly_as_different_from_white_as_can_be() {
        let found = mean(&flat([0; 3]), &flat([255; 3]));
        assert!((found - 0.9674).abs() < 1e-3, "{found}");
    }

    #[test]
    fn an_edge_that_moves_by_a_pixel_is_less_than_one_of_another_colour() {
        let (left, right) = ([200, 60, 40], [40, 60, 200]);
        let before = edge(30, left, right);
        let moved = mean(&before, &edge(31, left, right));
        let complement = mean(&before, &edge(30, left, right.map(|v| 255 - v)));
        assert!(moved > 0.01 && 5.0 * moved < complement, "{moved} {complement}");
    }

    /// Against the evaluator that the paper's authors publish (version 1.7, asked from outside):
    /// the mean, and two pixels, of which the first is a corner.
    #[test]
    fn wild_pictures_are_as_different_as_the_authors_evaluator_says() {
        let found = map(&wild(0), &wild(1));
        let mean = mean(&wild(0), &wild(1));
        assert!((mean - 0.371_92).abs() < 5e-4, "{mean}");
        for (at, expected) in [(0, 0.328_19), (16 * 48 + 24, 0.385_74)] {
            assert!((found.data[at] - expected).abs() < 1e-3, "{at}: {}", found.data[at]);
        }
    }
}
