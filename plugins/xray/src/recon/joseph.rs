//! Forward projection and its exact adjoint.
//!
//! Joseph's method (1982): a ray is followed plane by plane along the axis it runs along most, and
//! takes from each plane the value interpolated linearly between its neighbours, times the way
//! between planes. Parallel views do it by shears (see there): the row is added into the table, in
//! the phase nearest to its place, and the bins are interpolated from the table.
//!
//! The adjoint uses the very same coefficients, so ⟨Ax, y⟩ = ⟨x, Aᵀy⟩ up to rounding. Work is
//! shared out by views forwards, by planes backwards; each sum has a fixed order.

use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use super::{
    ReconError, check,
    shear::{Plan, Shear},
};
use crate::volume::{Beam, Grid, Orbit, Sinogram};

/// Says how much is done and asks whether to go on.
pub(super) type Step<'a> = &'a dyn Fn(usize, usize) -> Result<(), Cancelled>;

/// Projects volumes on a grid to the rays of an orbit, and back.
#[derive(Debug, Clone)]
pub struct Projector {
    orbit: Orbit,
    grid: Grid,
}

impl Projector {
    /// For these rays and these voxels.
    ///
    /// # Errors
    /// The orbit or the grid is not usable.
    pub fn new(orbit: &Orbit, grid: &Grid) -> Result<Self, ReconError> {
        check(&Sinogram { orbit: orbit.clone(), data: vec![0.0; orbit.len()] }, grid)?;
        Ok(Self { orbit: orbit.clone(), grid: *grid })
    }

    /// The rays.
    #[must_use]
    pub fn orbit(&self) -> &Orbit {
        &self.orbit
    }

    /// The voxels.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Line integrals of `volume` (`[z][y][x]`, per metre): `A x`.
    ///
    /// # Errors
    /// The volume has another size, or the job was cancelled.
    pub fn forward(&self, volume: &[f32], job: &Job) -> Result<Vec<f32>, ReconError> {
        self.project(volume, &|done, total| job.step(done, total))
    }

    pub(super) fn project(&self, volume: &[f32], step: Step) -> Result<Vec<f32>, ReconError> {
        if volume.len() != self.grid.len() {
            return Err(ReconError::Bad(format!(
                "a volume of {} voxels was given for {}",
                volume.len(),
                self.grid.len()
            )));
        }
        let mut rays = vec![0.0; self.orbit.len()];
        match self.orbit.beam {
            Beam::Parallel => self.shear_forward(volume, &mut rays, step)?,
            _ => self.ray_forward(volume, &mut rays, step)?,
        }
        Ok(rays)
    }

    /// The adjoint: `Aᵀ y` of `rays` (`[view][row][bin]`).
    ///
    /// # Errors
    /// The rays have another number, or the job was cancelled.
    pub fn backward(&self, rays: &[f32], job: &Job) -> Result<Vec<f32>, ReconError> {
        self.backproject(rays, &|done, total| job.step(done, total))
    }

    pub(super) fn backproject(&self, rays: &[f32], step: Step) -> Result<Vec<f32>, ReconError> {
        if rays.len() != self.orbit.len() {
            return Err(ReconError::Bad(format!(
                "{} rays were given for {}",
                rays.len(),
                self.orbit.len()
            )));
        }
        let mut volume = vec![0.0; self.grid.len()];
        match self.orbit.beam {
            Beam::Parallel => self.shear_backward(rays, &mut volume, step)?,
            _ => self.ray_backward(rays, &mut volume, step)?,
        }
        Ok(volume)
    }

    /// The detector rows that see slice `z`, with the share of it that each takes (linear in z).
    fn rows_of(&self, z: usize) -> Vec<(usize, f32)> {
        let pitch = self.orbit.pixel[1];
        let share = |row: usize| {
            1.0 - ((row as f64 - self.orbit.centre[1]) * pitch - self.grid.at(2, z)).abs()
                / self.grid.voxel[2]
        };
        (0..self.orbit.rows())
            .map(|row| (row, share(row) as f32))
            .filter(|(_, s)| *s > 1e-6)
            .collect()
    }

    fn shear_forward(
        &self,
        volume: &[f32],
        rays: &mut [f32],
        step: Step,
    ) -> Result<(), ReconError> {
        let (orbit, grid) = (&self.orbit, &self.grid);
        let bins = orbit.bins();
        let plans = [0, 1].map(|axis| Plan::new(orbit, grid, axis));
        let view_len = orbit.rows() * bins;
        for (z, slice) in volume.chunks(grid.slice_len()).enumerate() {
            let rows = self.rows_of(z);
            for (axis, plan) in plans.iter().enumerate() {
                let image = plan.padded(slice, grid, axis);
                for (done, shears) in plan.shears.chunks(GROUP).enumerate() {
                    step(
                        2 * z * orbit.views() + axis * orbit.views() + done * GROUP,
                        2 * grid.size[2] * orbit.views(),
                    )?;
                    let lines: Vec<(usize, Vec<f32>)> = shears
                        .par_iter()
                        .map_init(
                            || plan.table(),
                            |table, shear| {
                                (
                                    shear.view(),
                                    plan.project(&image, shear, self.way(shear, axis), bins, table),
                                )
                            },
                        )
                        .collect();
                    for (view, line) in lines {
                        for &(row, share) in &rows {
                            let out = &mut rays[view * view_len + row * bins..][..bins];
                            out.iter_mut().zip(&line).for_each(|(out, v)| *out += share * v);
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn shear_backward(
        &self,
        rays: &[f32],
        volume: &mut [f32],
        step: Step,
    ) -> Result<(), ReconError> {
        let (orbit, grid) = (&self.orbit, &self.grid);
        let bins = orbit.bins();
        let plans = [0, 1].map(|axis| Plan::new(orbit, grid, axis));
        let view_len = orbit.rows() * bins;
        for (z, slice) in volume.chunks_mut(grid.slice_len()).enumerate() {
            let rows = self.rows_of(z);
            for (axis, plan) in plans.iter().enumerate() {
                let mut pace = |done: usize| {
                    step(
                        2 * z * orbit.views() + axis * orbit.views() + done,
                        2 * grid.size[2] * orbit.views(),
                    )
                };
                let fill = |shear: &Shear, table: &mut [f32]| {
                    let mut line = vec![0.0; bins];
                    for &(row, share) in &rows {
                        let row = &rays[shear.view() * view_len + row * bins..][..bins];
                        line.iter_mut().zip(row).for_each(|(out, v)| *out += share * v);
                    }
                    plan.spread(&line, shear, self.way(shear, axis), table);
                    Ok(())
                };
                let image =
                    plan.backproject(&mut pace, || (), |(), shear, table| fill(shear, table))?;
                plan.add_to(&image, slice, grid, axis);
            }
        }
        Ok(())
    }

    /// The way of a ray between two rows (columns), m.
    fn way(&self, shear: &Shear, axis: usize) -> f32 {
        let (sin, cos) = self.orbit.angles[shear.view()].sin_cos();
        (if axis == 0 { self.grid.voxel[1] / cos.abs() } else { self.grid.voxel[0] / sin.abs() })
            as f32
    }

    /// The rays of a view that run along y (`axis` 0: planes are counted along y, and x is
    /// interpolated) or along x (1).
    fn rays_along(&self, view: usize, axis: usize) -> Vec<Ray> {
        let (orbit, grid) = (&self.orbit, &self.grid);
        let (sin, cos) = orbit.angles[view].sin_cos();
        let (source_axis, axis_detector, curved, cone) = match orbit.beam {
            Beam::Fan { source_axis, axis_detector, curved } => {
                (source_axis, axis_detector, curved, false)
            }
            Beam::Cone { source_axis, axis_detector } => (source_axis, axis_detector, false, true),
            Beam::Parallel => return Vec::new(),
        };
        let far = source_axis + axis_detector;
        let source = [source_axis * sin, -source_axis * cos];
        let planes = 1 - axis;
        let mut rays = Vec::new();
        for i in 0..orbit.rows() * orbit.bins() {
            let (row, bin) = (i / orbit.bins(), i % orbit.bins());
            let u = (bin as f64 - orbit.centre[0]) * orbit.pixel[0];
            let v = (row as f64 - orbit.centre[1]) * orbit.pixel[1];
            let (across, along) = if curved { (u / far).sin_cos() } else { (u, far) };
            let to = [across * cos - along * sin, across * sin + along * cos];
            let by_y = (to[1] / grid.voxel[1]).abs() >= (to[0] / grid.voxel[0]).abs();
            if by_y != (axis == 0) {
                continue;
            }
            let (z, rise) = if cone { (0.0, v) } else { (v, 0.0) };
            // Position on plane j: source + s·to with s = (plane − source) / to.
            let s0 = (grid.origin[planes] - source[planes]) / to[planes];
            let s_step = grid.voxel[planes] / to[planes];
            let a = [
                (source[axis] + s0 * to[axis] - grid.origin[axis]) / grid.voxel[axis],
                s_step * to[axis] / grid.voxel[axis],
            ];
            let b =
                [(z + s0 * rise - grid.origin[2]) / grid.voxel[2], s_step * rise / grid.voxel[2]];
            let way = s_step.abs() * (to[0] * to[0] + to[1] * to[1] + rise * rise).sqrt();
            let ray = Ray {
                index: i,
                a: a.map(|v| v as f32),
                b: b.map(|v| v as f32),
                way: way as f32,
                planes: [0, 0],
            };
            rays.push(ray.clipped([grid.size[axis], grid.size[2]], grid.size[planes]));
        }
        rays
    }

    /// The volume as padded planes `[plane][z + 1][x or y + 1]`.
    fn planes(&self, volume: &[f32], axis: usize) -> Vec<f32> {
        let size = self.grid.size;
        let (n, count, nz) = (size[axis], size[1 - axis], size[2]);
        let mut planes = vec![0.0; count * (n + 2) * (nz + 2)];
        planes.par_chunks_mut((n + 2) * (nz + 2)).enumerate().for_each(|(j, plane)| {
            for z in 0..nz {
                for i in 0..n {
                    plane[(z + 1) * (n + 2) + i + 1] =
                        volume[(z * size[1] + if axis == 0 { j } else { i }) * size[0]
                            + if axis == 0 { i } else { j }];
                }
            }
        });
        planes
    }

    fn ray_forward(&self, volume: &[f32], out: &mut [f32], step: Step) -> Result<(), ReconError> {
        let view_len = self.orbit.rows() * self.orbit.bins();
        for axis in [0, 1] {
            let width = self.grid.size[axis] + 2;
            let plane_len = width * (self.grid.size[2] + 2);
            let planes = self.planes(volume, axis);
            for (group, rays) in out.chunks_mut(view_len * GROUP).enumerate() {
                step(axis * self.orbit.views() + group * GROUP, 2 * self.orbit.views())?;
                rays.par_chunks_mut(view_len).enumerate().for_each(|(i, out)| {
                    for ray in self.rays_along(group * GROUP + i, axis) {
                        let mut sum = 0.0_f64;
                        for j in ray.planes[0]..ray.planes[1] {
                            let (first, [near, far]) = ray.taps(j, width);
                            let plane = &planes[j * plane_len..(j + 1) * plane_len];
                            let pair = |at: usize, [p, q]: [f32; 2]| {
                                plane.get(at..at + 2).map_or(0.0, |v| p * v[0] + q * v[1])
                            };
                            sum += f64::from(pair(first, near) + pair(first + width, far));
                        }
                        out[ray.index] += ray.way * sum as f32;
                    }
                });
            }
        }
        Ok(())
    }

    fn ray_backward(
        &self,
        values: &[f32],
        volume: &mut [f32],
        step: Step,
    ) -> Result<(), ReconError> {
        let view_len = self.orbit.rows() * self.orbit.bins();
        let size = self.grid.size;
        for axis in [0, 1] {
            let width = size[axis] + 2;
            let plane_len = width * (size[2] + 2);
            let mut planes = vec![0.0_f32; size[1 - axis] * plane_len];
            for (group, values) in values.chunks(view_len * GROUP).enumerate() {
                step(axis * self.orbit.views() + group * GROUP, 2 * self.orbit.views())?;
                let rays: Vec<Vec<Ray>> = (0..values.len() / view_len)
                    .into_par_iter()
                    .map(|i| self.rays_along(group * GROUP + i, axis))
                    .collect();
                planes.par_chunks_mut(plane_len).enumerate().for_each(|(j, plane)| {
                    for (rays, values) in rays.iter().zip(values.chunks(view_len)) {
                        for ray in
                            rays.iter().filter(|ray| (ray.planes[0]..ray.planes[1]).contains(&j))
                        {
                            let value = ray.way * values[ray.index];
                            let (first, [near, far]) = ray.taps(j, width);
                            for (at, pair) in [(first, near), (first + width, far)] {
                                if let Some(v) = plane.get_mut(at..at + 2) {
                                    v[0] += pair[0] * value;
                                    v[1] += pair[1] * value;
                                }
                            }
                        }
                    }
                });
            }
            volume.par_chunks_mut(size[0]).enumerate().for_each(|(row, out)| {
                let (y, z) = (row % size[1], row / size[1]);
                for (x, out) in out.iter_mut().enumerate() {
                    let (i, j) = if axis == 0 { (x, y) } else { (y, x) };
                    *out += planes[j * plane_len + (z + 1) * width + i + 1];
                }
            });
        }
        Ok(())
    }
}

/// Views that are worked on between two looks at the job.
const GROUP: usize = 16;

/// A ray through planes: where it crosses plane j, in voxels along the row and along z, is linear
/// in j.
#[derive(Debug, Clone, Copy)]
struct Ray {
    index: usize,
    a: [f32; 2],
    b: [f32; 2],
    /// Way between two planes, m.
    way: f32,
    /// Range of planes where it is within the volume.
    planes: [usize; 2],
}

impl Ray {
    /// Sets the range of planes where −1 < a < n and −1 < b < m.
    fn clipped(mut self, size: [usize; 2], count: usize) -> Self {
        let (mut low, mut high) = (0.0_f64, count as f64);
        for ([start, step], n) in [self.a, self.b].into_iter().zip(size) {
            let (start, step, n) = (f64::from(start), f64::from(step), n as f64);
            if step == 0.0 {
                if !(start > -1.0 && start < n) {
                    high = 0.0;
                }
                continue;
            }
            let ends = [(-1.0 - start) / step, (n - start) / step];
            low = low.max(ends[0].min(ends[1]).ceil());
            high = high.min(ends[0].max(ends[1]).ceil());
        }
        self.planes = if high > low { [low as usize, high as usize] } else { [0, 0] };
        self
    }

    /// First of two neighbours in the padded row of plane `j`, and the coefficients of the two
    /// there and of the two a row further.
    #[inline(always)]
    fn taps(&self, j: usize, width: usize) -> (usize, [[f32; 2]; 2]) {
        let a = (self.a[0] + j as f32 * self.a[1] + 1.0).max(0.0);
        let b = (self.b[0] + j as f32 * self.b[1] + 1.0).max(0.0);
        let (i, k) = (a as usize, b as usize);
        let (p, q) = (a - i as f32, b - k as f32);
        (
            k * width + i.min(width - 2),
            [[(1.0 - q) * (1.0 - p), (1.0 - q) * p], [q * (1.0 - p), q * p]],
        )
    }
}
