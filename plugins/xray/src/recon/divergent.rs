//! Fans and cones: weighted filtered backprojection (Kak and Slaney 1988, §3.4; Feldkamp, Davis and
//! Kress 1984).
//!
//! At angle β the source is at S·(sin β, −cos β). A ray at angle γ in the fan is the parallel ray
//! of angle β − γ at distance S·sin γ from the axis, and is measured again from β + π − 2γ.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use intrados_stage::Job;
use rayon::prelude::*;
use wide::f32x8;

use super::{
    ReconError,
    filter::{Filter, Window},
    shares,
};
use crate::volume::{Beam, Grid, Orbit, Sinogram, Volume};

/// Resampling of a filtered line before it is interpolated linearly.
pub(super) const FINE: usize = 2;
/// Views that are added in one pass over the image.
pub(super) const GROUP: usize = 16;
/// Pixels whose places are computed together.
const RUN: usize = 64;

/// Distances of a fan or cone, and what follows.
#[derive(Debug, Clone, Copy)]
struct Shape {
    source_axis: f64,
    /// Pitch of the bins: on a line through the axis, m, or of the angle, rad.
    pitch: f64,
    curved: bool,
    cone: bool,
    /// Half the angle of the fan, rad.
    half: f64,
}

impl Shape {
    fn of(orbit: &Orbit) -> Self {
        let (source_axis, axis_detector, curved, cone) = match orbit.beam {
            Beam::Fan { source_axis, axis_detector, curved } => {
                (source_axis, axis_detector, curved, false)
            }
            Beam::Cone { source_axis, axis_detector } => (source_axis, axis_detector, false, true),
            Beam::Parallel => (1.0, 0.0, false, false),
        };
        let far = source_axis + axis_detector;
        let pitch = if curved { orbit.pixel[0] / far } else { orbit.pixel[0] * source_axis / far };
        let mut shape = Self { source_axis, pitch, curved, cone, half: 0.0 };
        shape.half = shape.gamma(orbit, 0).abs().max(shape.gamma(orbit, orbit.bins() - 1).abs());
        shape
    }

    /// Angle in the fan of bin `i`.
    fn gamma(&self, orbit: &Orbit, i: usize) -> f64 {
        let u = (i as f64 - orbit.centre[0]) * self.pitch;
        if self.curved { u } else { (u / self.source_axis).atan() }
    }

    /// What a ray is multiplied by before filtering; `v` is its height where it passes the axis.
    fn before(&self, gamma: f64, v: f64) -> f64 {
        match self.curved {
            true => self.source_axis * gamma.cos(),
            false => gamma.cos() / (1.0 + (v * gamma.cos() / self.source_axis).powi(2)).sqrt(),
        }
    }
}

/// How views are weighed: how much of the turn each stands for, and within it each ray.
enum Coverage {
    /// All rays are measured twice.
    Full,
    /// Parker's weights (1982) for an arc from `start` on, of π + 2 `over`.
    Short { start: f64, over: f64 },
}

impl Coverage {
    fn of(orbit: &Orbit, half: f64) -> Result<Self, ReconError> {
        let mut turned: Vec<f64> = orbit.angles.iter().map(|a| a.rem_euclid(TAU)).collect();
        turned.sort_by(f64::total_cmp);
        let n = turned.len();
        let gap = |i: usize| {
            if i + 1 < n { turned[i + 1] - turned[i] } else { turned[0] + TAU - turned[i] }
        };
        let widest = (0..n).max_by(|a, b| gap(*a).total_cmp(&gap(*b))).unwrap_or(0);
        let mean = (TAU - gap(widest)) / (n.max(2) - 1) as f64;
        if gap(widest) <= 3.0 * mean {
            return Ok(Self::Full);
        }
        let (start, arc) = (turned[(widest + 1) % n], TAU - gap(widest));
        let over = 0.5 * (arc - PI);
        // Half a view is forgiven.
        if over + 0.5 * mean < half {
            let [has, needs] = [arc, PI + 2.0 * half].map(f64::to_degrees);
            return Err(ReconError::Bad(format!(
                "the views span {has:.1} degrees; a fan this wide needs {needs:.1}: scan further or crop the detector"
            )));
        }
        Ok(Self::Short { start, over: over.max(half) + 1e-9 })
    }

    fn weight(&self, angle: f64, gamma: f64) -> f64 {
        let Self::Short { start, over } = *self else { return 0.5 };
        let turn = (angle - start + 1e-9).rem_euclid(TAU);
        let (rising, falling) = (turn / (over + gamma), (PI + 2.0 * over - turn) / (over - gamma));
        if rising < 2.0 {
            (FRAC_PI_4 * rising).sin().powi(2)
        } else if falling < 2.0 {
            (FRAC_PI_4 * falling.max(0.0)).sin().powi(2)
        } else {
            1.0
        }
    }
}

/// One view, filtered.
struct View {
    /// Cone: `[fine bin][row]`; fan: one fine line.
    data: Vec<f32>,
    cos: f64,
    sin: f64,
}

pub(super) fn fbp(
    sinogram: &Sinogram,
    grid: &Grid,
    window: Window,
    job: &Job,
) -> Result<Volume, ReconError> {
    let orbit = &sinogram.orbit;
    let shape = Shape::of(orbit);
    let reach = (0..2)
        .map(|k| grid.at(k, 0).abs().max(grid.at(k, grid.size[k] - 1).abs()).powi(2))
        .sum::<f64>()
        .sqrt();
    if reach >= 0.99 * shape.source_axis {
        return Err(ReconError::Bad(
            "the volume reaches the source; make it smaller or check the distances".to_owned(),
        ));
    }
    let coverage = Coverage::of(orbit, shape.half)?;
    let kernel = |n: f64| {
        if shape.curved { (n * shape.pitch / (n * shape.pitch).sin()).powi(2) } else { 1.0 }
    };
    let filter = Filter::new(orbit.bins(), shape.pitch, window, FINE, kernel);
    let weights = shares(&orbit.angles, TAU);
    let scan = Scan { sinogram, grid, shape, coverage, filter, weights };
    if shape.cone { scan.cone(job) } else { scan.fan(job) }
}

struct Scan<'s> {
    sinogram: &'s Sinogram,
    grid: &'s Grid,
    shape: Shape,
    coverage: Coverage,
    filter: Filter,
    weights: Vec<f64>,
}

impl Scan<'_> {
    /// The filtered rows of a view, one fine line after the other; `row` gives line `r` before
    /// weighing.
    fn filtered(
        &self,
        view: usize,
        rows: usize,
        line: impl Fn(usize) -> Vec<f32>,
        height: impl Fn(usize) -> f64,
    ) -> Result<Vec<f32>, ReconError> {
        let orbit = &self.sinogram.orbit;
        let angle = orbit.angles[view];
        let mut scratch = self.filter.scratch();
        let gammas: Vec<f64> = (0..orbit.bins()).map(|i| self.shape.gamma(orbit, i)).collect();
        let mut out = Vec::with_capacity(rows * orbit.bins() * FINE);
        for row in 0..rows {
            let weighed = line(row).into_iter().zip(&gammas).map(|(p, &gamma)| {
                let weight =
                    self.shape.before(gamma, height(row)) * self.coverage.weight(angle, gamma);
                p * weight as f32
            });
            self.filter
                .apply(weighed, self.weights[view] as f32, &mut scratch)
                .map_err(|e| ReconError::Bad(e.to_string()))?;
            out.extend_from_slice(&scratch.fine[..orbit.bins() * FINE]);
        }
        Ok(out)
    }

    fn fan(&self, job: &Job) -> Result<Volume, ReconError> {
        let (orbit, grid) = (&self.sinogram.orbit, self.grid);
        let mut volume = Volume::zeros(*grid);
        let views: Vec<usize> = (0..orbit.views()).collect();
        let total = grid.size[2] * views.len();
        for (z, slice) in volume.data.chunks_mut(grid.slice_len()).enumerate() {
            let rows = super::shear::Rows::at(orbit, grid.at(2, z));
            for (done, group) in views.chunks(GROUP).enumerate() {
                job.step(z * views.len() + done * GROUP, total)?;
                let filtered: Vec<View> = group
                    .par_iter()
                    .map(|&view| {
                        let data = self.filtered(
                            view,
                            1,
                            |_| rows.line(self.sinogram, view).collect(),
                            |_| 0.0,
                        )?;
                        let (sin, cos) = orbit.angles[view].sin_cos();
                        Ok(View { data, cos, sin })
                    })
                    .collect::<Result<_, ReconError>>()?;
                slice.par_chunks_mut(grid.size[0]).enumerate().for_each(|(y, row)| {
                    for view in &filtered {
                        self.add_fan(view, grid.at(1, y), row);
                    }
                });
            }
        }
        Ok(volume)
    }

    /// Adds a view to the pixels of one row.
    fn add_fan(&self, view: &View, y: f64, row: &mut [f32]) {
        let mut columns = Columns::default();
        for (run, pixels) in row.chunks_mut(RUN).enumerate() {
            self.columns(view, y, run * RUN, &mut columns);
            let (places, weights) =
                (columns.place.as_chunks::<8>().0, columns.weight.as_chunks::<8>().0);
            for (pixels, (&places, weights)) in pixels.chunks_mut(8).zip(places.iter().zip(weights))
            {
                // Counted from 1, for truncation rounds up below 0: what is before the first bin
                // becomes a huge index, and nothing is added.
                let (indices, shares) = split(f32x8::new(places) + 1.0);
                for ((out, (i, share)), weight) in
                    pixels.iter_mut().zip(indices.into_iter().zip(shares)).zip(weights)
                {
                    if let Some(&[a, b]) =
                        view.data.get((i - 1) as usize..).and_then(|line| line.first_chunk::<2>())
                    {
                        *out += weight * (a + share * (b - a));
                    }
                }
            }
        }
    }

    /// Where the pixels from `first` on in the row at `y` fall in a view.
    fn columns(&self, view: &View, y: f64, first: usize, columns: &mut Columns) {
        let (grid, shape) = (self.grid, self.shape);
        let x = grid.at(0, first);
        let eight = |start: f64, step: f64| {
            f32x8::new(std::array::from_fn(|i| (start + i as f64 * step) as f32))
        };
        let mut t = eight(x * view.cos + y * view.sin, grid.voxel[0] * view.cos);
        let mut w =
            eight(shape.source_axis - x * view.sin + y * view.cos, -grid.voxel[0] * view.sin);
        let [t_step, w_step] = [8.0 * grid.voxel[0] * view.cos, -8.0 * grid.voxel[0] * view.sin]
            .map(|v| f32x8::splat(v as f32));
        let (source, scale) = (
            f32x8::splat(shape.source_axis as f32),
            f32x8::splat(FINE as f32 / shape.pitch as f32),
        );
        let centre = f32x8::splat((self.sinogram.orbit.centre[0] * FINE as f64) as f32);
        let [places, weights, nears] = [&mut columns.place, &mut columns.weight, &mut columns.near]
            .map(|c| c.as_chunks_mut::<8>().0);
        for ((place, weight), near) in places.iter_mut().zip(weights).zip(nears) {
            let ratio = source / w;
            let (at, share) = match shape.curved {
                true => (t.atan2(w), 1.0 / (t * t + w * w)),
                false => (t * ratio, ratio * ratio),
            };
            *place = scale.mul_add(at, centre).to_array();
            *weight = share.to_array();
            *near = ratio.to_array();
            t += t_step;
            w += w_step;
        }
    }

    fn cone(&self, job: &Job) -> Result<Volume, ReconError> {
        let (orbit, grid) = (&self.sinogram.orbit, self.grid);
        let [nx, ny, nz] = grid.size;
        let (rows, bins) = (orbit.rows(), orbit.bins());
        let v_pitch = orbit.pixel[1] / orbit.beam.magnification();
        // Columns of voxels, `[y][x][z]`: each takes one column of the panel.
        let mut standing = vec![0.0_f32; grid.len()];
        let views: Vec<usize> = (0..orbit.views()).collect();
        for (done, group) in views.chunks(GROUP).enumerate() {
            job.step(done * GROUP, views.len())?;
            let filtered: Vec<View> = group
                .par_iter()
                .map(|&view| {
                    let panel = self.sinogram.view(view);
                    let line = |row: usize| panel[row * bins..(row + 1) * bins].to_vec();
                    let lines = self.filtered(view, rows, line, |row| {
                        (row as f64 - orbit.centre[1]) * v_pitch
                    })?;
                    let (sin, cos) = orbit.angles[view].sin_cos();
                    // One row of zeros before and after, so that what is seen only in part fades
                    // out.
                    let mut data = vec![0.0; bins * FINE * (rows + 2)];
                    for (row, line) in lines.chunks(bins * FINE).enumerate() {
                        line.iter()
                            .enumerate()
                            .for_each(|(u, v)| data[u * (rows + 2) + row + 1] = *v);
                    }
                    Ok(View { data, cos, sin })
                })
                .collect::<Result<_, ReconError>>()?;
            standing.par_chunks_mut(nx * nz).enumerate().for_each_init(
                || vec![0.0_f32; rows + 2],
                |blend, (y, sheet)| {
                    for view in &filtered {
                        self.add_cone(view, grid.at(1, y), v_pitch, blend, sheet);
                    }
                },
            );
        }
        let mut volume = Volume::zeros(*grid);
        volume.data.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
            slice.iter_mut().enumerate().for_each(|(i, out)| *out = standing[i * nz + z]);
        });
        Ok(volume)
    }

    /// Adds a view to the voxels of one sheet of constant y, `[x][z]`.
    fn add_cone(&self, view: &View, y: f64, v_pitch: f64, blend: &mut [f32], sheet: &mut [f32]) {
        let grid = self.grid;
        let nz = grid.size[2];
        let rows = blend.len();
        let mut columns = Columns::default();
        for (run, voxels) in sheet.chunks_mut(RUN * nz).enumerate() {
            self.columns(view, y, run * RUN, &mut columns);
            let places = columns.place.iter().zip(&columns.weight).zip(&columns.near);
            for (standing, ((&place, &weight), &near)) in voxels.chunks_mut(nz).zip(places) {
                if place.is_nan() || place < 0.0 {
                    continue;
                }
                let u = place as usize;
                let Some(pair) = view.data.get(u * rows..(u + 2) * rows) else { continue };
                let (a, b) = pair.split_at(rows);
                let (second, first) =
                    (weight * (place - u as f32), weight * (1.0 - (place - u as f32)));
                blend
                    .iter_mut()
                    .zip(a.iter().zip(b))
                    .for_each(|(out, (a, b))| *out = first * a + second * b);
                let step = (grid.voxel[2] / v_pitch) as f32 * near;
                let start = (self.sinogram.orbit.centre[1] + 1.0) as f32
                    + (grid.origin[2] / v_pitch) as f32 * near;
                add_column(blend, start, step, standing);
            }
        }
    }
}

/// Adds to each of `out` the value of `line` at `start`, `start + step`, …, interpolated linearly;
/// nothing beyond its ends.
#[inline]
fn add_column(line: &[f32], start: f32, step: f32, out: &mut [f32]) {
    let last = (line.len() - 1) as f32;
    let low = (-start / step).ceil().clamp(0.0, out.len() as f32) as usize;
    let high = ((last - start) / step).ceil().clamp(low as f32, out.len() as f32) as usize;
    let mut place = f32x8::splat(start)
        + (f32x8::splat(low as f32) + f32x8::new([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])) * step;
    for out in out[low..high].chunks_mut(8) {
        let (indices, shares) = split(place.fast_max(f32x8::ZERO));
        for ((out, i), share) in out.iter_mut().zip(indices).zip(shares) {
            if let Some(&[a, b]) = line.get(i as usize..).and_then(|l| l.first_chunk::<2>()) {
                *out += a + share * (b - a);
            }
        }
        place += f32x8::splat(8.0 * step);
    }
}

/// Whole and broken part of numbers of which none is negative, or far beyond a line's length.
#[inline(always)]
fn split(place: f32x8) -> ([i32; 8], [f32; 8]) {
    let whole = place.fast_trunc_int();
    (whole.to_array(), (place - f32x8::from_i32x8(whole)).to_array())
}

/// What a run of pixels along x (with all above and below them) finds in one view.
struct Columns {
    /// Fine bin.
    place: [f32; RUN],
    weight: [f32; RUN],
    /// Distance source to axis over distance of the pixel from the source along the central ray.
    near: [f32; RUN],
}

impl Default for Columns {
    fn default() -> Self {
        Self { place: [0.0; RUN], weight: [0.0; RUN], near: [0.0; RUN] }
    }
}
