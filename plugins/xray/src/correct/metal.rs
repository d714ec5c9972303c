//! Metal: behind a bar hardly any photon is left, and streaks run from bar to bar.
//!
//! Normalised metal-artefact reduction (Meyer, Raupach, Lell, Schmidt and Kachelrieß 2010, Med.
//! Phys. 37, 5482): rays through metal are replaced by interpolated ones, after division by the
//! projection of a prior, in which the specimen is flat, so that the interpolation bridges a line
//! that is nearly constant.

use intrados_stage::Job;
use rayon::prelude::*;

use super::bridge;
use crate::{
    recon::{Projector, ReconError, Window, fbp},
    volume::{Grid, Sinogram, Volume},
};

/// What was taken for what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metal {
    /// Attenuation above which a voxel is metal, 1/m.
    pub metal: f32,
    /// Attenuation below which a voxel is air, 1/m; between the two it is specimen.
    pub air: f32,
    /// Voxels by which the metal is widened before its rays are replaced.
    pub margin: usize,
}

/// Reconstructs `sinogram` with rays through metal replaced, and puts the metal of the plain
/// reconstruction back. Also gives the sinogram without metal.
///
/// # Errors
/// As [`fbp`].
pub fn reduce_metal(
    sinogram: &Sinogram,
    grid: &Grid,
    window: Window,
    choice: Metal,
    job: &Job,
) -> Result<(Volume, Sinogram), ReconError> {
    let projector = Projector::new(&sinogram.orbit, grid)?;
    let plain = fbp(sinogram, grid, window, job)?;
    let metal: Vec<bool> = plain.data.iter().map(|v| *v > choice.metal).collect();
    let wide = widened(&metal, grid, choice.margin);
    let trace = projector
        .forward(&wide.iter().map(|m| f32::from(u8::from(*m))).collect::<Vec<f32>>(), job)?;
    // A ray that grazes a voxel's corner is no ray through metal.
    let least = (0.05 * grid.voxel[0].min(grid.voxel[1])) as f32;
    let hidden: Vec<bool> = trace.iter().map(|way| *way > least).collect();

    // First guess: plain interpolation. Its slice, made flat, is the prior.
    let mut guess = sinogram.clone();
    inpaint(&mut guess.data, &hidden, sinogram.orbit.bins());
    let smooth = fbp(&guess, grid, Window::Hann, job)?;
    let body = mean(smooth.data.iter().copied().filter(|v| (choice.air..choice.metal).contains(v)));
    let flat = |(v, metal): (&f32, &bool)| match *v {
        _ if *metal => body,
        v if v < choice.air => 0.0,
        v if v < choice.metal => body,
        v => v,
    };
    let prior: Vec<f32> = smooth.data.iter().zip(&wide).map(flat).collect();
    let prior = projector.forward(&prior, job)?;

    // Where the prior sees next to nothing there is nothing to normalise by.
    let floor = 1e-2 * prior.iter().copied().fold(0.0, f32::max);
    let mut clean = sinogram.clone();
    clean.data.iter_mut().zip(&prior).for_each(|(p, q)| *p /= q.max(floor));
    inpaint(&mut clean.data, &hidden, sinogram.orbit.bins());
    clean.data.iter_mut().zip(&prior).for_each(|(p, q)| *p *= q.max(floor));
    clean
        .data
        .iter_mut()
        .zip(sinogram.data.iter().zip(&hidden))
        .filter(|(_, (_, hidden))| !**hidden)
        .for_each(|(p, (q, _))| *p = *q);
    let mut volume = fbp(&clean, grid, window, job)?;
    volume
        .data
        .iter_mut()
        .zip(plain.data.iter().zip(&metal))
        .filter(|(_, (_, metal))| **metal)
        .for_each(|(v, (plain, _))| *v = *plain);
    Ok((volume, clean))
}

/// Bridges what is hidden along each row of bins.
fn inpaint(data: &mut [f32], hidden: &[bool], bins: usize) {
    data.par_chunks_mut(bins)
        .zip(hidden.par_chunks(bins))
        .for_each(|(line, hidden)| bridge(line, |i| hidden[i]));
}

/// The mask grown by `by` voxels in each slice (a square).
fn widened(mask: &[bool], grid: &Grid, by: usize) -> Vec<bool> {
    let [nx, ny, _] = grid.size;
    let mut wide = vec![false; mask.len()];
    for (i, _) in mask.iter().enumerate().filter(|(_, m)| **m) {
        let (x, y, z) = (i % nx, i / nx % ny, i / (nx * ny));
        for y in y.saturating_sub(by)..=(y + by).min(ny - 1) {
            let row = (z * ny + y) * nx;
            wide[row + x.saturating_sub(by)..=row + (x + by).min(nx - 1)].fill(true);
        }
    }
    wide
}

fn mean(values: impl Iterator<Item = f32>) -> f32 {
    let (sum, n) = values.fold((0.0, 0_usize), |(s, n), v| (s + f64::from(v), n + 1));
    (sum / n.max(1) as f64) as f32
}
