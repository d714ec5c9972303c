//! Reconstruction: from line integrals to attenuation.
//!
//! [`fbp`] is filtered backprojection for parallel, fan and cone beams (Feldkamp); [`Projector`] is
//! a forward projector with its exact adjoint, on which [`cgls`] and [`sirt`] iterate. All give the
//! same bits for any number of threads.
//!
//! Parallel beams are backprojected by shears ([`shear`]): in a view, the pixels of an image row
//! lie at equal steps on the detector, so the view is resampled once at these steps, in some
//! phases, and then each row of the image adds a run of neighbours. No pixel computes where it
//! falls.
//!
//! What is too large for memory is reconstructed slab by slab: [`slab`] tells how many slices fit,
//! [`rows`] which part of the detector they need.

mod divergent;
mod filter;
mod iterate;
mod joseph;
mod quality;
mod shear;
mod slab;

use intrados_stage::{Cancelled, Job};

use crate::volume::{Beam, Grid, Orbit, Sinogram, Volume};

pub use filter::Window;
pub use iterate::{Iteration, cgls, sirt};
pub use joseph::Projector;
pub use quality::{nrmse, nrmse_in};
pub use slab::{bytes, rows, slab};

/// Why nothing was reconstructed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReconError {
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The scan does not tell what is asked.
    #[error("{0}")]
    Bad(String),
}

/// Filtered backprojection onto `grid`, which may be a slab of a larger one: attenuation per metre.
///
/// Angles may be spaced unevenly. Parallel views over any arc of at least π are weighed by their
/// share of π; fans and cones need a full turn, or at least π and the angle of the fan (then with
/// Parker's weights).
///
/// # Errors
/// The orbit is not usable (no views, distances that are not above zero, too short an arc), or the
/// job was cancelled.
pub fn fbp(
    sinogram: &Sinogram,
    grid: &Grid,
    window: Window,
    job: &Job,
) -> Result<Volume, ReconError> {
    check(sinogram, grid)?;
    match sinogram.orbit.beam {
        Beam::Parallel => shear::fbp(sinogram, grid, window, job),
        Beam::Fan { .. } | Beam::Cone { .. } => divergent::fbp(sinogram, grid, window, job),
    }
}

/// Refuses what no method here can use.
fn check(sinogram: &Sinogram, grid: &Grid) -> Result<(), ReconError> {
    let orbit = &sinogram.orbit;
    let bad = |reason: &str| Err(ReconError::Bad(reason.to_owned()));
    if orbit.is_empty() || sinogram.data.len() != orbit.len() {
        return bad("the sinogram is empty or not of the size of its orbit");
    }
    if grid.is_empty() || grid.size.iter().any(|&n| n > crate::volume::MAX_SIDE) {
        return bad("the volume to reconstruct is empty or too large");
    }
    let lengths = match orbit.beam {
        Beam::Parallel => [1.0, 1.0],
        Beam::Fan { source_axis, axis_detector, .. }
        | Beam::Cone { source_axis, axis_detector } => [source_axis, source_axis + axis_detector],
    };
    let positive = |v: &f64| v.is_finite() && *v > 0.0;
    if !orbit.pixel.iter().chain(&grid.voxel).chain(&lengths).all(positive) {
        return bad("pixels, voxels and distances must be above zero");
    }
    if !orbit.angles.iter().chain(&orbit.centre).chain(&grid.origin).all(|v| v.is_finite()) {
        return bad("angles and centres must be finite");
    }
    Ok(())
}

/// The share of `period` that each of `angles` stands for: half of the gaps to its neighbours on
/// the circle of that period. A gap above three times the median is a part that was not scanned,
/// and counts as one of median width.
fn shares(angles: &[f64], period: f64) -> Vec<f64> {
    let mut order: Vec<(f64, usize)> =
        angles.iter().enumerate().map(|(i, a)| (a.rem_euclid(period), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let n = order.len();
    let gaps: Vec<f64> =
        (0..n).map(|i| (order[(i + 1) % n].0 - order[i].0).rem_euclid(period)).collect();
    // One view alone, or all at the same angle.
    if gaps.iter().all(|g| *g < 1e-12) {
        return vec![period / n as f64; n];
    }
    let mut sorted: Vec<f64> = gaps.iter().copied().filter(|g| *g > 1e-9).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let counted: Vec<f64> =
        gaps.iter().map(|&g| if g > 3.0 * median { median } else { g }).collect();
    let mut shares = vec![0.0; n];
    for (i, &(_, view)) in order.iter().enumerate() {
        shares[view] = 0.5 * (counted[i] + counted[(i + n - 1) % n]);
    }
    shares
}

/// Adds the transpose of `columns` (`[x][y]`) to `image` (`[y][x]`, `width` wide).
fn add_transposed(image: &mut [f32], columns: &[f32], width: usize, stride: usize) {
    for (y, row) in image.chunks_mut(width).enumerate() {
        for (x, v) in row.iter_mut().enumerate() {
            *v += columns[x * stride + y];
        }
    }
}

/// Where in its row of bins a point (x, y) on the axis' plane falls in a parallel view:
/// `bin = at + x·cos + y·sin` for x, y in metres.
fn parallel_bin(orbit: &Orbit, angle: f64) -> [f64; 3] {
    [orbit.centre[0], angle.cos() / orbit.pixel[0], angle.sin() / orbit.pixel[0]]
}

#[cfg(test)]
pub(crate) mod phantom;
#[cfg(test)]
mod tests;
