//! Line integrals: how far every ray of a view goes through what, and what is left of the spectrum.
//!
//! The panel's columns are parallel to the axis, so all rays of a column cross the same cells of
//! the section, each a little higher than the last: the way through the section is found once
//! (Amanatides and Woo), and the rows take their voxels from the column that stands on each of its
//! cells.

use glam::{DVec3, UVec3};
use rayon::prelude::*;
use wide::f32x8;

use super::Protocol;
use crate::{
    march::Lattice,
    specimen::concrete::{FULL, Painted},
    volume::{Grid, Orbit},
};

/// Groups of energies: a multiple of 8.
const GROUPS: usize = 48;

/// Voxels, standing: `[y][x][z]`.
#[derive(Debug)]
pub struct Rays {
    grid: Grid,
    columns: Vec<[u8; 4]>,
    /// Whether there is anything in a column.
    filled: Vec<bool>,
}

impl Rays {
    /// Ready to be crossed.
    #[must_use]
    pub fn new(painted: &Painted) -> Self {
        let grid = painted.grid;
        let (n, nz) = (grid.slice_len(), grid.size[2]);
        let mut columns = vec![[0; 4]; painted.shares.len()];
        columns.par_chunks_mut(nz.max(1)).enumerate().for_each(|(i, column)| {
            column.iter_mut().enumerate().for_each(|(z, v)| *v = painted.shares[z * n + i]);
        });
        let filled =
            columns.par_chunks(nz.max(1)).map(|c| c.iter().any(|s| *s != [0; 4])).collect();
        Self { grid, columns, filled }
    }

    /// Metres of mortar, rock, steel and rust (at full share) on the way of every ray of a view,
    /// `[row][bin]`. Each voxel is taken at the height at which the ray passes the middle of its
    /// cell of the section.
    #[must_use]
    pub fn view(&self, orbit: &Orbit, angle: f64, [axis, panel]: [f64; 2]) -> Vec<[f32; 4]> {
        let [nx, ny, nz] = self.grid.size;
        let [vx, vy, vz] = self.grid.voxel;
        let low = [0, 1].map(|k| self.grid.origin[k] - 0.5 * self.grid.voxel[k]);
        let section = Lattice {
            origin: DVec3::new(low[0], low[1], -0.5),
            spacing: DVec3::new(vx, vy, 1.0),
            cells: UVec3::new(nx as u32, ny as u32, 1),
        };
        let (sin, cos) = angle.sin_cos();
        let (u, along) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let source = -axis * along;
        let (rows, bins) = (orbit.rows(), orbit.bins());
        let mut lengths = vec![[0.0_f32; 4]; rows * bins];
        let mut line = vec![[0.0_f32; 4]; rows];
        for bin in 0..bins {
            let to = source + panel * along + (bin as f64 - orbit.centre[0]) * orbit.pixel[0] * u;
            let far = (to - source).length();
            let way = (to - source) / far;
            line.fill([0.0; 4]);
            section.march(source, way, 0.0, far, |cell, a, b| {
                if self.filled[cell] {
                    let column = &self.columns[cell * nz..(cell + 1) * nz];
                    // Heights of the rows there, in voxels: first + step·row.
                    let shrink = 0.5 * (a + b) / far;
                    let first = ((-orbit.centre[1] * orbit.pixel[1] * shrink - self.grid.origin[2])
                        / vz
                        + 0.5) as f32;
                    let step = (orbit.pixel[1] * shrink / vz) as f32;
                    add(&mut line, column, first, step, (b - a) as f32);
                }
                true
            });
            for (row, sum) in line.iter().enumerate() {
                let slope = (row as f64 - orbit.centre[1]) * orbit.pixel[1] / far;
                let stretch = ((1.0 + slope * slope).sqrt() / f64::from(FULL)) as f32;
                lengths[row * bins + bin] = sum.map(|s| s * stretch);
            }
        }
        lengths
    }
}

/// Adds what the rows find in one column.
#[inline]
fn add(line: &mut [[f32; 4]], column: &[[u8; 4]], first: f32, step: f32, length: f32) {
    let last = column.len() - 1;
    for (row, sum) in line.iter_mut().enumerate() {
        let share = column[((first + step * row as f32) as usize).min(last)];
        for k in 0..4 {
            sum[k] += length * f32::from(share[k]);
        }
    }
}

/// The spectrum in groups of much the same attenuation, as the panel sees it.
#[derive(Debug, Clone)]
pub struct Energies {
    /// Mean signal and mean squared signal of a group's photons, times their share.
    signal: [Vec<f32x8>; 2],
    /// Attenuation of the four substances, 1/m.
    mu: [Vec<f32x8>; 4],
    /// Sums behind nothing: signal, squared signal.
    pub open: [f64; 2],
    /// keV, signal and attenuation of the substances of all bins.
    pub bins: Vec<(f64, f64, [f64; 4])>,
}

impl Energies {
    /// Groups whose attenuation (of mortar) differs by equal ratios.
    #[must_use]
    pub fn new(protocol: &Protocol, mu: impl Fn(f64) -> [f64; 4]) -> Self {
        let bins: Vec<(f64, [f64; 2], [f64; 4])> = protocol
            .bins()
            .into_iter()
            .map(|(kev, share, [a, b])| (kev, [share * a, share * b], mu(kev)))
            .collect();
        let logs: Vec<f64> = bins.iter().map(|b| b.2[0].max(1e-9).ln()).collect();
        // What comes through is hard: groups are of equal width in ln μ from the hardest on, the
        // softest all in one.
        let (low, high) = (
            logs.iter().copied().fold(f64::INFINITY, f64::min),
            logs.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let width = ((high - low).min(1.8) / GROUPS as f64).max(1e-9);
        let mut groups = vec![([0.0; 2], [0.0; 4]); GROUPS];
        for ((_, signal, mu), log) in bins.iter().zip(&logs) {
            let group = &mut groups[(((log - low) / width) as usize).min(GROUPS - 1)];
            (0..2).for_each(|k| group.0[k] += signal[k]);
            (0..4).for_each(|k| group.1[k] += signal[0] * mu[k]);
        }
        let eight = |of: &dyn Fn(&([f64; 2], [f64; 4])) -> f64| {
            let values: Vec<f32> = groups.iter().map(|g| of(g) as f32).collect();
            values.as_chunks::<8>().0.iter().map(|v| f32x8::from(*v)).collect::<Vec<_>>()
        };
        let signal = [0, 1].map(|k| eight(&|g| g.0[k]));
        let mu = [0, 1, 2, 3].map(|k| eight(&|g| if g.0[0] > 0.0 { g.1[k] / g.0[0] } else { 0.0 }));
        let open = [0, 1].map(|k| bins.iter().map(|b| b.1[k]).sum());
        Self { signal, mu, open, bins: bins.into_iter().map(|(e, s, mu)| (e, s[0], mu)).collect() }
    }

    /// Signal and squared signal behind so many metres of the four.
    #[inline]
    #[must_use]
    pub fn behind(&self, lengths: [f32; 4]) -> [f32; 2] {
        let l = lengths.map(f32x8::splat);
        let (mut a, mut b) = (f32x8::ZERO, f32x8::ZERO);
        for i in 0..GROUPS / 8 {
            let depth = l[0] * self.mu[0][i]
                + l[1] * self.mu[1][i]
                + l[2] * self.mu[2][i]
                + l[3] * self.mu[3][i];
            let left = (-depth).exp();
            a += left * self.signal[0][i];
            b += left * self.signal[1][i];
        }
        [a.reduce_add(), b.reduce_add()]
    }

    /// Mean energy of the signal behind so many metres, keV.
    #[must_use]
    pub fn mean(&self, lengths: [f64; 4]) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for (kev, signal, mu) in &self.bins {
            let left = signal * (-(0..4).map(|k| mu[k] * lengths[k]).sum::<f64>()).exp();
            (sum, all) = (sum + kev * left, all + left);
        }
        sum / all
    }
}
