//! Parallel beams by shears.
//!
//! In a view at angle θ pixel (i, j) falls on bin u = u₀ + a·i + b·j. If |a| ≥ |b| (else x and y
//! change parts), u = u₀ + a·(i + t) with t = j·b/a the same for all pixels of row j. So the view
//! is tabulated at u₀ + a·(k + m/M) for whole k and phases m = 0 … M−1, and row j adds the run of
//! phase frac(t) from floor(t) on: one addition a pixel and view, from neighbours in memory. The
//! phase is rounded to 1/M pixel, by at most 1/(2M).

use std::f64::consts::PI;

use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;
use wide::f32x8;

use super::{
    ReconError, add_transposed,
    filter::{Filter, Scratch, Window},
    parallel_bin, shares,
};
use crate::volume::{Grid, Orbit, Sinogram, Volume};

/// Phases of a pixel. With 16, nRMSE is within 1 % of that of exact places.
const PHASES: usize = 16;
/// How much denser than the bins a filtered view is resampled before the table is interpolated
/// linearly from it.
const FINE: usize = 4;
/// Pixels that stay in registers while all views of a group are added.
const RUN: usize = 64;
/// Rows that one thread takes at a time.
const BAND: usize = 8;
/// Bytes of tables that are to stay in a core's cache.
const CACHE: usize = 1 << 19;

/// How one view falls on the rows (or the columns) of an image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shear {
    /// Which view.
    view: usize,
    /// Bin of the table's first entry.
    first: f64,
    /// Bins in a pixel, along the row.
    step: f64,
    /// Pixels that a row is shifted against the one before.
    slope: f64,
    /// Shift of the table against row 0.
    shift: f64,
}

impl Shear {
    pub(super) fn view(&self) -> usize {
        self.view
    }
}

/// All views that are sheared along rows, or all along columns.
pub(super) struct Plan {
    pub(super) shears: Vec<Shear>,
    /// Entries of one phase of a table.
    width: usize,
    /// Pixels in a row, a multiple of [`RUN`], and number of rows.
    stride: usize,
    rows: usize,
}

impl Plan {
    /// The views of `orbit` that run along x (`axis` 0) or along y (1).
    pub(super) fn new(orbit: &Orbit, grid: &Grid, axis: usize) -> Self {
        let other = 1 - axis;
        let (along, rows) = (grid.size[axis], grid.size[other]);
        let mut reach = 0.0_f64;
        let mut shears = Vec::new();
        for (view, &angle) in orbit.angles.iter().enumerate() {
            let [centre, cos, sin] = parallel_bin(orbit, angle);
            let a = [cos * grid.voxel[0], sin * grid.voxel[1]];
            let start = centre + cos * grid.origin[0] + sin * grid.origin[1];
            let by_row = a[0].abs() >= a[1].abs();
            if by_row != (axis == 0) {
                continue;
            }
            let slope = a[other] / a[axis];
            let total = slope * (rows - 1) as f64;
            let shift = total.min(0.0).floor();
            reach = reach.max(total.abs());
            shears.push(Shear {
                view,
                first: start + a[axis] * shift,
                step: a[axis],
                slope,
                shift,
            });
        }
        let stride = along.next_multiple_of(RUN);
        Self { shears, width: stride + reach.ceil() as usize + 3, stride, rows }
    }

    fn table_len(&self) -> usize {
        PHASES * self.width
    }

    /// The sum of all tables in their rows, an image of its own width ([`Plan::add_to`]). `fill`
    /// makes a table with working memory from `init`.
    pub(super) fn backproject<S>(
        &self,
        step: &mut dyn FnMut(usize) -> Result<(), Cancelled>,
        init: impl Fn() -> S + Send + Sync,
        fill: impl Fn(&mut S, &Shear, &mut [f32]) -> Result<(), ReconError> + Send + Sync,
    ) -> Result<Vec<f32>, ReconError> {
        let mut image = vec![0.0; self.stride * self.rows];
        let group = (CACHE / 4 / self.table_len()).clamp(4, 64);
        let mut tables = vec![0.0; group * self.table_len()];
        for (i, shears) in self.shears.chunks(group).enumerate() {
            step(i * group)?;
            tables
                .par_chunks_mut(self.table_len())
                .zip(shears)
                .try_for_each_init(&init, |state, (table, shear)| fill(state, shear, table))?;
            self.add(shears, &tables, &mut image);
        }
        Ok(image)
    }

    /// Adds an image of this plan to a slice.
    pub(super) fn add_to(&self, image: &[f32], slice: &mut [f32], grid: &Grid, axis: usize) {
        match axis {
            0 => slice
                .chunks_mut(grid.size[0])
                .zip(image.chunks(self.stride))
                .for_each(|(row, sum)| row.iter_mut().zip(sum).for_each(|(a, b)| *a += b)),
            _ => add_transposed(slice, image, grid.size[0], self.stride),
        }
    }

    /// A slice as an image of this plan.
    pub(super) fn padded(&self, slice: &[f32], grid: &Grid, axis: usize) -> Vec<f32> {
        let mut image = vec![0.0; self.stride * self.rows];
        for (j, row) in image.chunks_mut(self.stride).enumerate() {
            for (i, out) in row[..grid.size[axis]].iter_mut().enumerate() {
                *out = slice[if axis == 0 { j * grid.size[0] + i } else { i * grid.size[0] + j }];
            }
        }
        image
    }

    /// Working memory of [`Plan::project`].
    pub(super) fn table(&self) -> Vec<f32> {
        vec![0.0; self.table_len()]
    }

    /// Line integrals of an image: the adjoint of [`Plan::spread`] and adding.
    pub(super) fn project(
        &self,
        image: &[f32],
        shear: &Shear,
        way: f32,
        bins: usize,
        table: &mut [f32],
    ) -> Vec<f32> {
        table.fill(0.0);
        for (j, row) in image.chunks(self.stride).enumerate() {
            let start = self.start(shear, j);
            if let Some(run) = table.get_mut(start..start + self.stride) {
                run.iter_mut().zip(row).for_each(|(out, v)| *out += v);
            }
        }
        let mut line = vec![0.0; bins];
        self.each_tap(
            shear,
            |bin, at, [p, q]| {
                line[bin] += way * (p * table[at] + q * table[at + 1]);
            },
            bins,
        );
        line
    }

    /// The table whose rows, added to an image, are the adjoint of [`Plan::project`].
    pub(super) fn spread(&self, line: &[f32], shear: &Shear, way: f32, table: &mut [f32]) {
        table.fill(0.0);
        self.each_tap(
            shear,
            |bin, at, [p, q]| {
                table[at] += way * p * line[bin];
                table[at + 1] += way * q * line[bin];
            },
            line.len(),
        );
    }

    /// Calls `tap(bin, entry, [share of it, share of the next])` for all entries that bins are
    /// interpolated from.
    fn each_tap(&self, shear: &Shear, mut tap: impl FnMut(usize, usize, [f32; 2]), bins: usize) {
        for m in 0..PHASES {
            for bin in 0..bins {
                let place = (bin as f64 - shear.first) / shear.step - m as f64 / PHASES as f64;
                if place >= 0.0 && place < (self.width - 1) as f64 {
                    let k = place as usize;
                    let share = (place - k as f64) as f32;
                    tap(bin, m * self.width + k, [1.0 - share, share]);
                }
            }
        }
    }

    /// Where in its table row `j` begins.
    fn start(&self, shear: &Shear, j: usize) -> usize {
        let phase = ((shear.slope * j as f64 - shear.shift) * PHASES as f64).round() as usize;
        phase % PHASES * self.width + phase / PHASES
    }

    /// Adds `shears` with their `tables` to `image`, whose rows are `stride` wide.
    fn add(&self, shears: &[Shear], tables: &[f32], image: &mut [f32]) {
        image.par_chunks_mut(self.stride * BAND).enumerate().for_each(|(band, rows)| {
            let mut starts = vec![0; shears.len()];
            for (j, row) in rows.chunks_mut(self.stride).enumerate() {
                for ((i, shear), start) in shears.iter().enumerate().zip(&mut starts) {
                    *start = i * self.table_len() + self.start(shear, band * BAND + j);
                }
                for (run, pixels) in row.as_chunks_mut::<RUN>().0.iter_mut().enumerate() {
                    add_runs(pixels, tables, &starts, run * RUN);
                }
            }
        });
    }
}

/// Adds to `pixels` the runs of `tables` from each of `starts` + `offset` on.
#[inline]
fn add_runs(pixels: &mut [f32; RUN], tables: &[f32], starts: &[usize], offset: usize) {
    let mut sum: [f32x8; RUN / 8] = std::array::from_fn(|i| lanes(pixels, i));
    for start in starts {
        if let Some(run) = tables.get(start + offset..).and_then(|t| t.first_chunk::<RUN>()) {
            for (i, sum) in sum.iter_mut().enumerate() {
                *sum += lanes(run, i);
            }
        }
    }
    for (out, sum) in pixels.as_chunks_mut::<8>().0.iter_mut().zip(sum) {
        *out = sum.to_array();
    }
}

#[inline(always)]
fn lanes(run: &[f32; RUN], i: usize) -> f32x8 {
    f32x8::new(run.as_chunks::<8>().0[i])
}

/// Tabulates a view that was resampled `FINE` times, for `shear`.
fn tabulate(fine: &[f32], bins: usize, shear: &Shear, width: usize, table: &mut [f32]) {
    let last = ((bins - 1) * FINE) as f64;
    let step = shear.step * FINE as f64;
    for (m, phase) in table.chunks_exact_mut(width).enumerate() {
        let start = shear.first * FINE as f64 + step * m as f64 / PHASES as f64;
        // The k for which 0 ≤ start + k·step < last.
        let ends = [-start / step, (last - start) / step];
        let low = ends[0].min(ends[1]).ceil().clamp(0.0, width as f64) as usize;
        let high = (ends[0].max(ends[1]).ceil().clamp(0.0, width as f64) as usize).max(low);
        phase[..low].fill(0.0);
        phase[high..].fill(0.0);
        let (start, step) = ((start + low as f64 * step) as f32, step as f32);
        for (k, out) in phase[low..high].iter_mut().enumerate() {
            let place = (start + k as f32 * step).max(0.0);
            let i = place as usize;
            let share = place - i as f32;
            let [a, b] = [fine.get(i), fine.get(i + 1)].map(|v| v.copied().unwrap_or(0.0));
            *out = a + share * (b - a);
        }
    }
}

/// Filtered backprojection of parallel views, slice by slice.
pub(super) fn fbp(
    sinogram: &Sinogram,
    grid: &Grid,
    window: Window,
    job: &Job,
) -> Result<Volume, ReconError> {
    let orbit = &sinogram.orbit;
    let filter = Filter::new(orbit.bins(), orbit.pixel[0], window, FINE, |_| 1.0);
    let weights = shares(&orbit.angles, PI);
    let plans = [0, 1].map(|axis| Plan::new(orbit, grid, axis));
    let mut volume = Volume::zeros(*grid);
    let total = grid.size[2] * orbit.views();
    for (z, slice) in volume.data.chunks_mut(grid.slice_len()).enumerate() {
        let row = Rows::at(orbit, grid.at(2, z));
        let mut before = z * orbit.views();
        for (axis, plan) in plans.iter().enumerate() {
            let fill = |scratch: &mut Scratch, shear: &Shear, table: &mut [f32]| {
                filter
                    .apply(row.line(sinogram, shear.view), weights[shear.view] as f32, scratch)
                    .map_err(|e| ReconError::Bad(e.to_string()))?;
                tabulate(&scratch.fine, orbit.bins(), shear, plan.width, table);
                Ok(())
            };
            let image = plan.backproject(
                &mut |done| job.step(before + done, total),
                || filter.scratch(),
                fill,
            )?;
            plan.add_to(&image, slice, grid, axis);
            before += plan.shears.len();
        }
    }
    Ok(volume)
}

/// The two detector rows that a slice lies between, and the share of the second.
pub(super) struct Rows {
    rows: [usize; 2],
    share: f32,
}

impl Rows {
    pub(super) fn at(orbit: &Orbit, z: f64) -> Self {
        let v = (orbit.centre[1] + z / orbit.pixel[1]).clamp(0.0, (orbit.rows() - 1) as f64);
        let first = (v.floor() as usize).min(orbit.rows().saturating_sub(2));
        Self { rows: [first, (first + 1).min(orbit.rows() - 1)], share: (v - first as f64) as f32 }
    }

    /// Both.
    pub(super) fn both(&self) -> [usize; 2] {
        self.rows
    }

    pub(super) fn line<'s>(
        &self,
        sinogram: &'s Sinogram,
        view: usize,
    ) -> impl Iterator<Item = f32> + use<'s> {
        let bins = sinogram.orbit.bins();
        let view = sinogram.view(view);
        let [a, b] = self.rows.map(|row| &view[row * bins..(row + 1) * bins]);
        let share = self.share;
        a.iter().zip(b).map(move |(a, b)| a + share * (b - a))
    }
}
