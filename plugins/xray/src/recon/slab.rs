//! Slab by slab: the rows of the detector that some slices are made from, and how many slices fit
//! into memory.

use std::ops::Range;

use super::{divergent, shear::Rows};
use crate::volume::{Beam, Grid, Orbit};

/// The rows of the detector that the slices of `grid` are reconstructed from; at least one.
#[must_use]
pub fn rows(orbit: &Orbit, grid: &Grid) -> Range<usize> {
    let all = orbit.rows();
    let ends = [0, grid.size[2].max(1) - 1].map(|z| grid.at(2, z));
    let Beam::Cone { source_axis, .. } = orbit.beam else {
        let [[low, _], [_, high]] = ends.map(|z| Rows::at(orbit, z).both());
        return low..(high + 1).min(all);
    };
    // Nearer to the source things look larger.
    let reach = (0..2)
        .map(|k| grid.at(k, 0).abs().max(grid.at(k, grid.size[k].max(1) - 1).abs()).powi(2))
        .sum::<f64>()
        .sqrt();
    let near = [
        source_axis / (source_axis + reach),
        source_axis / (source_axis - reach).max(0.01 * source_axis),
    ];
    let pitch = orbit.pixel[1] / orbit.beam.magnification();
    let places = ends.into_iter().flat_map(|z| near.map(|n| orbit.centre[1] + z / pitch * n));
    let (low, high) =
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (v.min(low), v.max(high)));
    // One row more on either side: what is interpolated there is not cut off.
    let low = ((low.floor() - 1.0).max(0.0) as usize).min(all.saturating_sub(1));
    low..((high.ceil() + 2.0).max(0.0) as usize).clamp(low + 1, all.max(low + 1))
}

/// Bytes that reconstructing `grid` takes, with the rows that it is made from.
#[must_use]
pub fn bytes(orbit: &Orbit, grid: &Grid) -> u64 {
    let [rows, bins, views, voxels] =
        [rows(orbit, grid).len(), orbit.bins(), orbit.views(), grid.len()].map(|n| n as u64);
    // A cone's voxels stand in columns before they lie in slices, beside some filtered views.
    let (copies, filtered) = if matches!(orbit.beam, Beam::Cone { .. }) {
        (2, 2 * divergent::GROUP as u64)
    } else {
        (1, 0)
    };
    4 * (rows * bins * (views + filtered * divergent::FINE as u64) + copies * voxels)
}

/// From slice `first` on the slices of `grid` that can be reconstructed together in `most` bytes;
/// at least one.
#[must_use]
pub fn slab(orbit: &Orbit, grid: &Grid, first: usize, most: u64) -> Range<usize> {
    let fits = |end: &usize| bytes(orbit, &grid.slab(first..*end)) <= most;
    let end = (first + 2..=grid.size[2]).take_while(fits).last().unwrap_or(first + 1);
    first..end
}
