//! Taking out of a scan what the specimen did not put in: detector, rings, beam hardening, scatter,
//! a misplaced axis. Metal is dealt with where scans are restored, since its rays need the physics.
//!
//! The order is that of the signal: counts − dark over flat, bad pixels, scatter (all in
//! intensity), then −ln, rings, hardening, axis. Stacks of views are `[view][row][bin]`; a
//! sinogram of one slice is `[view][bin]`.

mod centre;
mod detector;
mod doubt;
mod hardening;
mod noise;
mod rings;
mod scatter;

pub use centre::axis_by_mirror;
pub use detector::{Panel, bad_pixels, mend};
pub use doubt::{mend_dead_bins, no_integrals, sinogram_doubts};
pub use hardening::{Linearisation, Polynomial};
pub use noise::counts;
pub(crate) use noise::poisson;
pub use rings::{Stripes, remove_stripes, remove_stripes_by_fit};
pub use scatter::{Estimate, Patch};

/// Median of what is there, 0 of nothing; `values` is reordered.
fn median(values: &mut [f32]) -> f32 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Running median over `size` neighbours; beyond the ends the first and last value go on.
fn running_median(values: &[f32], size: usize) -> Vec<f32> {
    let half = size as isize / 2;
    let last = values.len() as isize - 1;
    let mut window = Vec::with_capacity(size + 1);
    (0..values.len() as isize)
        .map(|i| {
            window.clear();
            window.extend((i - half..=i + half).map(|k| values[k.clamp(0, last) as usize]));
            median(&mut window)
        })
        .collect()
}

/// Values at the places where `gap` is set, linear between the nearest others; at an end the
/// nearest.
fn bridge(values: &mut [f32], gap: impl Fn(usize) -> bool) {
    let mut before: Option<usize> = None;
    let mut i = 0;
    while i < values.len() {
        if !gap(i) {
            before = Some(i);
            i += 1;
            continue;
        }
        let after = (i..values.len()).find(|&k| !gap(k));
        let end = after.unwrap_or(values.len());
        for k in i..end {
            values[k] = match (before, after) {
                (Some(a), Some(b)) => {
                    values[a] + (values[b] - values[a]) * (k - a) as f32 / (b - a) as f32
                }
                (Some(a), None) => values[a],
                (None, Some(b)) => values[b],
                (None, None) => values[k],
            };
        }
        i = end;
    }
}

/// Least squares of `rows` (each the basis at a point, and the value there) by normal equations;
/// `None` if they do not determine it.
fn least_squares(count: usize, rows: impl Iterator<Item = (Vec<f64>, f64)>) -> Option<Vec<f64>> {
    let mut a = vec![vec![0.0; count + 1]; count];
    for (basis, value) in rows {
        for i in 0..count {
            for j in 0..count {
                a[i][j] += basis[i] * basis[j];
            }
            a[i][count] += basis[i] * value;
        }
    }
    for i in 0..count {
        let pivot = (i..count).max_by(|p, q| a[*p][i].abs().total_cmp(&a[*q][i].abs()))?;
        a.swap(i, pivot);
        if a[i][i].abs() < f64::MIN_POSITIVE * 1e10 {
            return None;
        }
        for k in i + 1..count {
            let factor = a[k][i] / a[i][i];
            let (above, below) = a.split_at_mut(k);
            below[0][i..].iter_mut().zip(&above[i][i..]).for_each(|(b, a)| *b -= factor * a);
        }
    }
    let mut x = vec![0.0; count];
    for i in (0..count).rev() {
        x[i] = (a[i][count] - (i + 1..count).map(|j| a[i][j] * x[j]).sum::<f64>()) / a[i][i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

#[cfg(test)]
mod tests;
