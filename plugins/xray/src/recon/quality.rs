//! How far a reconstruction is from the truth.

use crate::volume::Grid;

/// Root of the mean squared difference over the voxels that `counts`, in units of the largest
/// truth. (As `bench_recon` of the peers counts.)
#[must_use]
pub fn nrmse_in(image: &[f32], truth: &[f32], counts: impl Fn(usize) -> bool) -> f64 {
    let mut sum = 0.0;
    let mut n = 0_usize;
    let mut peak = 0.0_f64;
    for (i, (a, b)) in image.iter().zip(truth).enumerate() {
        peak = peak.max(f64::from(*b));
        if counts(i) {
            sum += f64::from(a - b).powi(2);
            n += 1;
        }
    }
    (sum / n.max(1) as f64).sqrt() / peak
}

/// [`nrmse_in`] the disc (in every slice) whose diameter is `share` of the width of the grid.
#[must_use]
pub fn nrmse(image: &[f32], truth: &[f32], grid: &Grid, share: f64) -> f64 {
    let [nx, ny, _] = grid.size;
    let radius = 0.5 * share * nx as f64;
    nrmse_in(image, truth, |i| {
        let x = (i % nx) as f64 - 0.5 * (nx as f64 - 1.0);
        let y = (i / nx % ny) as f64 - 0.5 * (ny as f64 - 1.0);
        x.hypot(y) < radius
    })
}
