//! Iterative reconstruction: conjugate gradients on the normal equations (CGLS) and simultaneous
//! iterations (SIRT).

use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use super::{Projector, ReconError};
use crate::volume::{Sinogram, Volume};

/// How far an iteration has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Number of the iteration, from 1.
    pub number: usize,
    /// ‖Ax − y‖ / ‖y‖ before it.
    pub residual: f64,
}

/// Conjugate gradients for min ‖Ax − y‖² from x = 0 (Björck 1996, §7.4): early iterations are
/// smooth, so the number regularises. `watch` sees each iterate and may stop by returning `false`.
///
/// # Errors
/// The orbit or grid is not usable, or the job was cancelled.
pub fn cgls(
    sinogram: &Sinogram,
    projector: &Projector,
    iterations: usize,
    job: &Job,
    mut watch: impl FnMut(Iteration, &[f32]) -> bool,
) -> Result<Volume, ReconError> {
    let mut x = Volume::zeros(*projector.grid());
    let mut residual = sinogram.data.clone();
    let norm = dot(&residual, &residual).sqrt().max(f64::MIN_POSITIVE);
    let part = |number: usize, half: usize| part(job, 2 * number + half, 2 * iterations + 1);
    let mut gradient = projector.backproject(&residual, &part(0, 0))?;
    let mut direction = gradient.clone();
    let mut gamma = dot(&gradient, &gradient);
    for number in 1..=iterations {
        if gamma == 0.0 {
            break;
        }
        let seen = projector.project(&direction, &part(number - 1, 1))?;
        let alpha = gamma / dot(&seen, &seen).max(f64::MIN_POSITIVE);
        let before = dot(&residual, &residual).sqrt() / norm;
        add(&mut x.data, &direction, alpha);
        add(&mut residual, &seen, -alpha);
        if !watch(Iteration { number, residual: before }, &x.data) {
            break;
        }
        gradient = projector.backproject(&residual, &part(number, 0))?;
        let next = dot(&gradient, &gradient);
        let beta = (next / gamma) as f32;
        direction.iter_mut().zip(&gradient).for_each(|(d, g)| *d = g + beta * *d);
        gamma = next;
    }
    job.step(iterations, iterations)?;
    Ok(x)
}

/// Simultaneous iterations x ← x + C Aᵀ R (y − Ax), C and R the inverse sums of columns and rows
/// (Gregor and Benson 2008), with x ≥ 0 if `positive`.
///
/// # Errors
/// As [`cgls`].
pub fn sirt(
    sinogram: &Sinogram,
    projector: &Projector,
    iterations: usize,
    positive: bool,
    job: &Job,
    mut watch: impl FnMut(Iteration, &[f32]) -> bool,
) -> Result<Volume, ReconError> {
    let mut x = Volume::zeros(*projector.grid());
    let part = |number: usize, half: usize| part(job, 2 * number + half, 2 * iterations + 2);
    let rows = inverse(projector.project(&vec![1.0; projector.grid().len()], &part(0, 0))?);
    let columns = inverse(projector.backproject(&vec![1.0; projector.orbit().len()], &part(0, 1))?);
    let norm = dot(&sinogram.data, &sinogram.data).sqrt().max(f64::MIN_POSITIVE);
    for number in 1..=iterations {
        let mut residual = projector.project(&x.data, &part(number, 0))?;
        residual.iter_mut().zip(&sinogram.data).for_each(|(r, y)| *r = y - *r);
        let before = dot(&residual, &residual).sqrt() / norm;
        residual.iter_mut().zip(&rows).for_each(|(r, w)| *r *= w);
        let change = projector.backproject(&residual, &part(number, 1))?;
        for ((x, change), w) in x.data.iter_mut().zip(&change).zip(&columns) {
            *x += w * change;
            if positive {
                *x = x.max(0.0);
            }
        }
        if !watch(Iteration { number, residual: before }, &x.data) {
            break;
        }
    }
    job.step(iterations, iterations)?;
    Ok(x)
}

/// Progress of part `number` of `count` parts of a job.
fn part(job: &Job, number: usize, count: usize) -> impl Fn(usize, usize) -> Result<(), Cancelled> {
    move |done, total| job.step(number * total + done, count * total)
}

/// 1/x, and 0 where no ray passes.
fn inverse(mut values: Vec<f32>) -> Vec<f32> {
    let most = values.iter().copied().fold(0.0, f32::max);
    values.iter_mut().for_each(|v| *v = if *v > 1e-6 * most { 1.0 / *v } else { 0.0 });
    values
}

/// Scalar product, in chunks of fixed size, so that its bits do not depend on threads.
pub(super) fn dot(a: &[f32], b: &[f32]) -> f64 {
    let chunk = |(a, b): (&[f32], &[f32])| {
        a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()
    };
    let parts: Vec<f64> = a.par_chunks(1 << 14).zip(b.par_chunks(1 << 14)).map(chunk).collect();
    parts.iter().sum()
}

fn add(to: &mut [f32], what: &[f32], times: f64) {
    let times = times as f32;
    to.par_chunks_mut(1 << 14)
        .zip(what.par_chunks(1 << 14))
        .for_each(|(to, what)| to.iter_mut().zip(what).for_each(|(a, b)| *a += times * b));
}
