//! The scatter image of a panel: walks from the tube, linked with its pixels.

use intrados_stage::{Cancelled, Job};
use intrados_transport::{BATCH, Side, Tally, TransportProblem, WalkEstimate, Workspace, run};
use rayon::prelude::*;

use crate::{
    problem::{PhotonProblem, PhotonStates},
    scanner::Scanner,
    specimen::Specimen,
    steer::{Guide, rule},
};

/// Batches between two looks at the job; fixed, so that sums are the same on any number of threads.
const ROUND: u64 = 16;
/// Fewest batches from which an error is estimated.
const LEAST: u64 = 16;

/// Scatter by pixel: what the response makes of it, per m² and emitted photon.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScatterImage {
    /// Mean, row by row.
    pub mean: Vec<f64>,
    /// Its standard error, from the spread of batches of 4096 walks.
    pub std_error: Vec<f64>,
    /// Walks.
    pub walks: u64,
}

impl ScatterImage {
    /// Root of the mean square of the pixels' relative errors; pixels that nothing reaches do not
    /// count.
    #[must_use]
    pub fn rel_error(&self) -> f64 {
        let squares: Vec<f64> = self
            .mean
            .iter()
            .zip(&self.std_error)
            .filter(|(m, _)| **m > 0.0)
            .map(|(m, s)| (s / m).powi(2))
            .collect();
        if squares.is_empty() {
            f64::INFINITY
        } else {
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        }
    }

    /// One pixel.
    #[must_use]
    pub fn reading(&self, pixel: usize) -> WalkEstimate {
        WalkEstimate { mean: self.mean[pixel], std_error: self.std_error[pixel], walks: self.walks }
    }
}

/// The sums of one batch.
struct Pixels(Vec<f64>);

impl Tally<f64> for Pixels {
    fn score(&mut self, _: u32, bin: u32, _: u32, value: f64) {
        self.0[bin as usize] += value;
    }
}

/// The scatter image from `walks` walks (at least 16 batches of 4096), steered by `guide` if there
/// is one, each collision linked with `links` pixels.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn image(
    specimen: &Specimen,
    scanner: &Scanner,
    guide: Option<&Guide>,
    links: usize,
    walks: u64,
    seed: u64,
    job: &Job,
) -> Result<ScatterImage, Cancelled> {
    let plain = PhotonProblem::new(specimen, scanner).linked(links);
    match guide {
        Some(guide) => expose(&guide.steer(plain, Side::Dual), walks, seed, job),
        None => expose(&plain, walks, seed, job),
    }
}

fn expose<P: TransportProblem<Value = f64, States = PhotonStates>>(
    problem: &P,
    walks: u64,
    seed: u64,
    job: &Job,
) -> Result<ScatterImage, Cancelled> {
    let pixels = problem.bins();
    let batches = walks.div_ceil(BATCH).max(LEAST);
    let (mut sum, mut squares) = (vec![0.0; pixels], vec![0.0; pixels]);
    for first in (0..batches).step_by(ROUND as usize) {
        job.step(first as usize, batches as usize)?;
        let parts: Vec<Vec<f64>> = (first..(first + ROUND).min(batches))
            .into_par_iter()
            .map_init(Workspace::default, |work, batch| {
                let mut tally = Pixels(vec![0.0; pixels]);
                run(
                    problem,
                    Side::Dual,
                    &rule(),
                    seed,
                    batch * BATCH..(batch + 1) * BATCH,
                    work,
                    &mut tally,
                );
                tally.0
            })
            .collect();
        for part in &parts {
            for (i, x) in part.iter().map(|x| x / BATCH as f64).enumerate() {
                sum[i] += x;
                squares[i] += x * x;
            }
        }
    }
    let n = batches as f64;
    let mean: Vec<f64> = sum.iter().map(|s| s / n).collect();
    let error = |(m, s): (&f64, &f64)| ((s / n - m * m).max(0.0) / (n - 1.0)).sqrt();
    let std_error = mean.iter().zip(&squares).map(error).collect();
    Ok(ScatterImage { mean, std_error, walks: batches * BATCH })
}
