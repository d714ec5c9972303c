//! What walks say of a pixel and of its neighbours on the same piece of surface, taken together as
//! far as light is a plane there.

use rayon::prelude::*;

use super::frame::Frame;

/// Half widths of the windows, pixels.
const REACH: [usize; 7] = [0, 1, 2, 3, 5, 8, 12];
/// A window counts while what it says lies within so many standard errors of all smaller ones.
const AGREE: f64 = 2.0;
/// What a fit by a plane may be wrong by where windows just agree, as a share of the variance.
const BENT: f64 = 1.0;

/// A picture's mean and variance, by pixel and channel.
#[derive(Debug, Clone)]
pub(super) struct Field {
    pub(super) mean: Vec<[f64; 3]>,
    pub(super) variance: Vec<[f64; 3]>,
}

/// Local planes in windows that are as wide as light allows (intersection of confidence intervals:
/// A. Goldenshluger and A. Nemirovski, "On spatially adaptive estimation of nonparametric
/// regression", 1997). At shadows' edges windows stay small. Pixels that show nothing wholly stay
/// 0.
pub(super) fn smoothed(frame: &Frame, raw: &Field) -> Field {
    let pooled = pooled(frame, raw);
    let at = |k: usize| match frame.shown[k] {
        Some(_) => widest(frame, &raw.mean, &pooled, k),
        None => ([0.0; 3], [0.0; 3]),
    };
    let all: Vec<_> = (0..raw.mean.len()).into_par_iter().map(at).collect();
    let (mean, variance) = all.into_iter().unzip();
    Field { mean, variance }
}

/// Variances of few walks scatter, and are small where the mean is so by chance: those of nine
/// pixels count together.
fn pooled(frame: &Frame, raw: &Field) -> Vec<[f64; 3]> {
    let at = |k: usize| {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for (j, _) in frame.around(k, 1) {
            (0..3).for_each(|c| sum[c] += raw.variance[j][c]);
            count += 1.0;
        }
        sum.map(|s| s / count)
    };
    (0..raw.mean.len()).into_par_iter().map(at).collect()
}

fn widest(
    frame: &Frame,
    mean: &[[f64; 3]],
    variance: &[[f64; 3]],
    k: usize,
) -> ([f64; 3], [f64; 3]) {
    let mut best = (mean[k], variance[k]);
    let mut band = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
    for reach in REACH {
        let (value, error2) = plane(frame, mean, variance, k, reach);
        for c in 0..3 {
            let width = AGREE * error2[c].sqrt();
            let [low, high] = band[c];
            band[c] = [low.max(value[c] - width), high.min(value[c] + width)];
        }
        if band.iter().any(|[low, high]| low > high) {
            break;
        }
        best = (value, error2);
    }
    (best.0.map(|v| v.max(0.0)), best.1.map(|v| (1.0 + BENT) * v))
}

/// The plane through a window's pixels, at its middle, and its variance; the mean alone where they
/// lie on a line.
fn plane(
    frame: &Frame,
    mean: &[[f64; 3]],
    variance: &[[f64; 3]],
    k: usize,
    reach: usize,
) -> ([f64; 3], [f64; 3]) {
    let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (_, [i, j]) in frame.around(k, reach) {
        (n, x, y) = (n + 1.0, x + i, y + j);
        (xx, xy, yy) = (xx + i * i, xy + i * j, yy + j * j);
    }
    // Weights 1/n − b·(p − p̄) with b from p̄'s place in the window's second moments.
    let (mx, my) = (x / n, y / n);
    let (cxx, cxy, cyy) = (xx / n - mx * mx, xy / n - mx * my, yy / n - my * my);
    let det = cxx * cyy - cxy * cxy;
    let [bx, by] = match det > 1e-6 {
        true => [(cyy * mx - cxy * my) / det, (cxx * my - cxy * mx) / det],
        false => [0.0; 2],
    };
    let (mut value, mut error2) = ([0.0; 3], [0.0; 3]);
    for (q, [i, j]) in frame.around(k, reach) {
        let weight = (1.0 - bx * (i - mx) - by * (j - my)) / n;
        for c in 0..3 {
            value[c] += weight * mean[q][c];
            error2[c] += weight * weight * variance[q][c];
        }
    }
    (value, error2)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use intrados_stage::random::Key;

    use super::*;
    use crate::{relight::frame::Shown, site::Piece};

    const SIDE: usize = 64;

    /// Two pieces side by side; a slope on one, on the other a shadow with a sharp edge.
    fn truth(k: usize) -> f64 {
        let (x, y) = (k % SIDE, k / SIDE);
        match (x < SIDE / 2, y < 3 * SIDE / 4) {
            (true, _) => 1.0 + 0.01 * x as f64 - 0.008 * y as f64,
            (false, true) => 2.0,
            (false, false) => 0.5,
        }
    }

    /// Light is known several times better where it is smooth, and as well as is said; no light
    /// leaks over the edge of a piece or of a shadow.
    #[test]
    fn windows_grow_where_light_is_smooth_and_errors_hold() {
        let shown = |k: usize| {
            let piece =
                Piece { object: u32::from(k % SIDE < SIDE / 2), member: None, face: None, way: 1 };
            Some(Shown { piece, place: DVec3::ZERO, shift: [0.0; 3] })
        };
        let n = SIDE * SIDE;
        let frame = Frame::flat([SIDE, SIDE], (0..n).map(shown).collect());
        let error = |k: usize| 0.2 * truth(k);
        let noisy = |k: usize| truth(k) + error(k) * Key::new(9, k as u64).normal(0);
        let raw = Field {
            mean: (0..n).map(|k| [noisy(k); 3]).collect(),
            variance: (0..n).map(|k| [error(k).powi(2); 3]).collect(),
        };
        let smooth = smoothed(&frame, &raw);
        let (mut inside, mut gain) = (0, 0.0);
        for k in 0..n {
            let off = smooth.mean[k][0] - truth(k);
            inside += usize::from(off.abs() < 1.96 * smooth.variance[k][0].sqrt());
            gain += error(k) / smooth.variance[k][0].sqrt() / n as f64;
            // A window of three pixels may well lie across the shadow's edge.
            let is_edge = (SIDE * 3 / 4 - 1..=SIDE * 3 / 4).contains(&(k / SIDE));
            assert!(is_edge || off.abs() < 4.5 * error(k), "{k}: {off}");
        }
        let share = inside as f64 / n as f64;
        println!("{share} within, {gain} times better");
        assert!((0.90..=1.0).contains(&share) && gain > 4.0, "{share} {gain}");
    }
}
