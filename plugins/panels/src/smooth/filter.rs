//! Noise taken out of a picture by its own error bars: a pixel is averaged with those around it from
//! which it differs by no more than their standard errors let one expect.
//!
//! Levels and taps are those of the à-trous wavelet (Dammertz, Sewtz, Hanika and Lensch 2010,
//! "Edge-avoiding à-trous wavelet transform for fast global illumination filtering"): a cubic
//! B-spline h of five by five taps, which lie 1, 2, 4 and 8 pixels apart from level to level. What
//! pixel q weighs in pixel p is told by the variances V of their means u, as by Rousselle, Knaus and
//! Zwicker (2012, "Adaptive rendering with non-local means filtering"):
//!
//! > w(p, q) = h(p − q) exp(−max(0, d²)), d² = mean over channels of ((u_p − u_q)² − v) / (k² v),
//! > v = V_p + min(V_p, V_q).
//!
//! Where both errors are equal, d² is 0 on average of pixels that are alike. They divide by
//! V_p + V_q; with the smaller of both in its place a pixel is moved by no neighbour that is less
//! certain than itself: a single bright speck, whose error is large, is taken down by its neighbours
//! and does not spread over them. A level hands on the variance of what it has averaged,
//! Σ w² V_q / (Σ w)² (as Schied and others 2017, "Spatiotemporal variance-guided filtering"). Pixels
//! that share neighbours are no longer independent then; taken as if they were, their errors come
//! out too small, and the next level averages less than it might, never more.

use glam::Vec3;
use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

/// Mean and variance of the mean of a pixel; none: no walk has been there.
pub(super) type Pixel = Option<(Vec3, Vec3)>;

/// h along one axis.
const SPLINE: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Pixels from one tap to the next, level by level.
const STEPS: [usize; 4] = [1, 2, 4, 8];
/// k: so many times what errors let one expect still counts as alike.
const STRICT: f32 = 2.0;
/// No pixel is moved farther than so many of its standard errors.
const FARTHEST: f32 = 3.0;

/// The means without what of their noise can be told from the picture. What no walk has reached
/// stays unknown; what has no error, or one that nobody knows, stays as it is.
pub(super) fn smoothed(
    pixels: &[Pixel],
    size: [usize; 2],
    job: &Job,
) -> Result<Vec<Option<Vec3>>, Cancelled> {
    let mut now = pixels.to_vec();
    for step in STEPS {
        now = level(&now, size, step, STRICT, job)?;
    }
    let bounded = |(before, after): (&Pixel, Pixel)| Some(bounded((*before)?, after?.0));
    Ok(pixels.iter().zip(now).map(bounded).collect())
}

/// One level, whose taps lie so many pixels apart.
fn level(
    pixels: &[Pixel],
    [width, height]: [usize; 2],
    step: usize,
    strict: f32,
    job: &Job,
) -> Result<Vec<Pixel>, Cancelled> {
    let row = |y: usize| -> Result<Vec<Pixel>, Cancelled> {
        job.check()?;
        let pixel = |x: usize| mixed(pixels, [width, height], [x, y], step, strict);
        Ok((0..width).map(pixel).collect())
    };
    let rows: Result<Vec<Vec<Pixel>>, Cancelled> = (0..height).into_par_iter().map(row).collect();
    Ok(rows?.concat())
}

/// A pixel of the next level.
fn mixed(
    pixels: &[Pixel],
    [width, height]: [usize; 2],
    [x, y]: [usize; 2],
    step: usize,
    strict: f32,
) -> Pixel {
    let own = pixels[y * width + x]?;
    if !own.1.is_finite() {
        return Some(own);
    }
    let (mut total, mut mean, mut variance) = (0.0_f32, Vec3::ZERO, Vec3::ZERO);
    for (row, down) in taps(y, step, height) {
        for (column, across) in taps(x, step, width) {
            let other = pixels[row * width + column].filter(|p| p.1.is_finite());
            let Some(other) = other else { continue };
            let weight = down * across * likeness(own, other, strict);
            total += weight;
            mean += weight * other.0;
            variance += weight * weight * other.1;
        }
    }
    // It weighs itself at least.
    Some((mean / total, variance / (total * total)))
}

/// Where taps along one axis are, those beyond the rim apart, and what they weigh.
fn taps(at: usize, step: usize, length: usize) -> impl Iterator<Item = (usize, f32)> {
    let place = move |k: usize| (at + k * step).checked_sub(2 * step).filter(|p| *p < length);
    SPLINE.into_iter().enumerate().filter_map(move |(k, weight)| Some((place(k)?, weight)))
}

/// exp(−max(0, d²)) of a pixel and another one.
fn likeness(own: (Vec3, Vec3), other: (Vec3, Vec3), strict: f32) -> f32 {
    let mut distance = 0.0_f32;
    for k in 0..3 {
        let squared = (own.0[k] - other.0[k]).powi(2);
        let expected = own.1[k] + own.1[k].min(other.1[k]);
        // Of what has no error, only the same is alike.
        distance += match expected > 0.0 {
            true => squared / expected - 1.0,
            false if squared > 0.0 => f32::INFINITY,
            false => 0.0,
        };
    }
    (-(distance / 3.0).max(0.0) / (strict * strict)).exp()
}

/// What is wished for a pixel, no farther from what it was than its standard errors let it be.
fn bounded((mean, variance): (Vec3, Vec3), wished: Vec3) -> Vec3 {
    let farthest = FARTHEST * variance.map(f32::sqrt);
    wished.max(mean - farthest).min(mean + farthest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    const SIDE: usize = 96;

    /// So many pixels of what `mean` says, with a standard error of 1 and a noise of that size, or
    /// none.
    fn picture(mean: impl Fn(usize) -> f32, noise: f64) -> Vec<Pixel> {
        let pixel = |i: usize| {
            let key = Key::new(7, i as u64);
            let off = [0, 2, 4].map(|dimension| (noise * key.normal(dimension)) as f32);
            Some((Vec3::splat(mean(i % SIDE)) + Vec3::from(off), Vec3::ONE))
        };
        (0..SIDE * SIDE).map(pixel).collect()
    }

    fn filtered(pixels: &[Pixel]) -> Vec<Vec3> {
        let done = smoothed(pixels, [SIDE, SIDE], &Job::default()).unwrap();
        done.into_iter().map(|pixel| pixel.unwrap()).collect()
    }

    /// Root of the mean square over pixels and channels.
    fn size(off: impl Iterator<Item = Vec3>) -> f32 {
        let squares: Vec<f32> = off.map(|d| d.length_squared() / 3.0).collect();
        (squares.iter().sum::<f32>() / squares.len() as f32).sqrt()
    }

    /// The factor that is known: of pixels that all count as alike, one level leaves Σ h² = 70/256
    /// of the error along each of both axes, hence √(Σ h²)² of it in all.
    #[test]
    fn one_level_leaves_of_an_even_noise_what_its_taps_leave() {
        let noisy = picture(|_| 5.0, 1.0);
        let done = level(&noisy, [SIDE, SIDE], 1, 1e6, &Job::default()).unwrap();
        let off = |pixels: &[Pixel]| {
            let off: Vec<Vec3> = pixels.iter().flatten().map(|p| p.0 - Vec3::splat(5.0)).collect();
            size(off.into_iter())
        };
        let left = off(&done) / off(&noisy);
        assert!((left / (70.0 / 256.0) - 1.0).abs() < 0.05, "{left}");
        // And the variance that it hands on is that of what is left.
        let middle = done[SIDE * SIDE / 2 + SIDE / 2].unwrap();
        assert!((middle.1.x.sqrt() / (70.0 / 256.0) - 1.0).abs() < 1e-4, "{middle:?}");
    }

    /// With weights by the errors a fifteenth is left of it (0.0645; the same arithmetic in NumPy).
    #[test]
    fn an_even_picture_keeps_little_of_its_noise_and_all_of_its_mean() {
        let noisy = picture(|_| 5.0, 1.0);
        let done = filtered(&noisy);
        let left = size(done.iter().map(|mean| *mean - Vec3::splat(5.0)));
        assert!((0.055..0.075).contains(&left), "{left}");
        let mean = done.iter().sum::<Vec3>() / done.len() as f32;
        assert!(mean.distance(Vec3::splat(5.0)) < 0.05, "{mean}");
    }

    #[test]
    fn an_edge_of_ten_standard_errors_stays_within_one_of_them() {
        let edge = |x: usize| if x < SIDE / 2 { 0.0 } else { 10.0 };
        let sharp = filtered(&picture(edge, 0.0));
        for (i, mean) in sharp.iter().enumerate() {
            assert!(
                (*mean - Vec3::splat(edge(i % SIDE))).abs().max_element() < 1e-3,
                "{i}: {mean}"
            );
        }
        let noisy = filtered(&picture(edge, 1.0));
        for (i, mean) in noisy.iter().enumerate() {
            if (SIDE / 2 - 1..=SIDE / 2).contains(&(i % SIDE)) {
                let off = (*mean - Vec3::splat(edge(i % SIDE))).abs().max_element();
                assert!(off < 1.0, "{i}: {mean}");
            }
        }
    }

    #[test]
    fn what_has_no_error_does_not_move_and_what_is_unknown_stays_so() {
        let mut pixels = picture(|_| 5.0, 1.0);
        let [certain, unknown, unsure] = [SIDE + 7, 20 * SIDE + 30, 40 * SIDE + 50];
        pixels[certain] = Some((Vec3::new(4.5, 5.0, 5.25), Vec3::ZERO));
        pixels[unknown] = None;
        // After one walk nobody knows the error.
        pixels[unsure] = Some((Vec3::splat(1e4), Vec3::INFINITY));
        let done = smoothed(&pixels, [SIDE, SIDE], &Job::default()).unwrap();
        assert_eq!(done[certain], Some(Vec3::new(4.5, 5.0, 5.25)));
        assert_eq!((done[unknown], done[unsure]), (None, Some(Vec3::splat(1e4))));
        assert_eq!(done.iter().flatten().count(), SIDE * SIDE - 1);
        // Nor does it move others.
        assert!((done[unsure + 1].unwrap() - Vec3::splat(5.0)).abs().max_element() < 1.0);
        let still: Vec<Pixel> =
            pixels.iter().map(|p| p.map(|(mean, _)| (mean, Vec3::ZERO))).collect();
        let means: Vec<Option<Vec3>> = pixels.iter().map(|p| p.map(|(mean, _)| mean)).collect();
        assert_eq!(smoothed(&still, [SIDE, SIDE], &Job::default()).unwrap(), means);
    }

    #[test]
    fn no_pixel_moves_farther_than_three_of_its_standard_errors_and_a_speck_does_not_spread() {
        let mut pixels: Vec<Pixel> = vec![Some((Vec3::ONE, Vec3::splat(0.25))); SIDE * SIDE];
        let speck = SIDE * SIDE / 2 + SIDE / 2;
        pixels[speck] = Some((Vec3::splat(101.0), Vec3::splat(2500.0)));
        let done = filtered(&pixels);
        assert!(done[speck].x < 2.0, "{}", done[speck]);
        let others = done.iter().enumerate().filter(|(i, _)| *i != speck);
        others.for_each(|(i, mean)| assert!(mean.distance(Vec3::ONE) < 1e-4, "{i}: {mean}"));
        // One that its neighbours would take farther down than its own error allows.
        let bright = bounded((Vec3::splat(10.0), Vec3::ONE), Vec3::ZERO);
        assert_eq!(bright, Vec3::splat(7.0));
    }

    #[test]
    fn a_picture_smaller_than_the_taps_is_filtered_and_a_cancelled_one_is_none() {
        let pixels = vec![Some((Vec3::ONE, Vec3::ONE)), None, Some((Vec3::ONE, Vec3::ONE))];
        let done = smoothed(&pixels, [3, 1], &Job::default()).unwrap();
        assert_eq!(done, [Some(Vec3::ONE), None, Some(Vec3::ONE)]);
        assert_eq!(smoothed(&[], [0, 0], &Job::default()), Ok(Vec::new()));
        let job = Job::default();
        job.cancel();
        assert_eq!(smoothed(&pixels, [3, 1], &job), Err(Cancelled));
    }
}
