//! Steel among concrete: line integrals of two materials made straight (after Joseph and Spital
//! 1978, J. Comput. Assist. Tomogr. 2, 100).
//!
//! A first reconstruction tells where steel is, its projection how much of it each ray has met.
//! What is left of the ray's reading is concrete, whose amount follows from the spectrum. Nothing
//! is interpolated, so that what lies between bars stays visible.

use intrados_stage::Job;
use rayon::prelude::*;

use super::Energies;
use crate::{
    recon::{Projector, ReconError, Window, fbp},
    volume::{Grid, Sinogram, Volume},
};

/// Knots of the table along concrete and along steel.
const KNOTS: [usize; 2] = [384, 64];
/// Times that steel is looked for.
const ROUNDS: usize = 2;

/// Concrete and steel at one energy, and the table between them and the reading.
#[derive(Debug, Clone)]
pub struct Straight {
    /// Longest ways of concrete and steel, m.
    longest: [f64; 2],
    /// Attenuation of both, 1/m.
    mu: [f64; 2],
    /// Reading behind so much steel and so much concrete, `[steel][concrete]`.
    table: Vec<f32>,
}

impl Straight {
    /// `share`: of mortar and rock in concrete; `mu`: attenuation of concrete and steel at the
    /// energy to go to, 1/m; `longest`: ways through both, m.
    #[must_use]
    pub fn new(energies: &Energies, share: [f64; 2], mu: [f64; 2], longest: [f64; 2]) -> Self {
        let step = |k: usize| longest[k] / (KNOTS[k] - 1) as f64;
        let table = (0..KNOTS[0] * KNOTS[1])
            .into_par_iter()
            .map(|i| {
                let (c, s) = (step(0) * (i % KNOTS[0]) as f64, step(1) * (i / KNOTS[0]) as f64);
                let depth = |mu: &[f64; 4]| c * (share[0] * mu[0] + share[1] * mu[1]) + s * mu[2];
                let least = energies.bins.iter().map(|b| depth(&b.2)).fold(f64::INFINITY, f64::min);
                let (mut left, mut all) = (0.0, 0.0);
                for (_, signal, mu) in &energies.bins {
                    left += signal * (least - depth(mu)).exp();
                    all += signal;
                }
                (least - (left / all).ln()) as f32
            })
            .collect();
        Self { longest, mu, table }
    }

    /// The monochromatic line integral of a reading behind `steel` metres of steel.
    fn apply(&self, reading: f32, steel: f32) -> f32 {
        let at = (f64::from(steel) / self.longest[1]).clamp(0.0, 1.0) * (KNOTS[1] - 1) as f64;
        let (row, t) = ((at as usize).min(KNOTS[1] - 2), (at - at.floor()).min(1.0) as f32);
        let t = if at as usize > KNOTS[1] - 2 { 1.0 } else { t };
        let knot = |i: usize| {
            let (a, b) = (self.table[row * KNOTS[0] + i], self.table[(row + 1) * KNOTS[0] + i]);
            a + t * (b - a)
        };
        // The first knot above the reading; beyond the ends the slope goes on.
        let (mut low, mut high) = (0, KNOTS[0] - 1);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if knot(middle) > reading {
                high = middle;
            } else {
                low = middle;
            }
        }
        let (a, b) = (knot(low), knot(high));
        let concrete = (low as f64 + f64::from((reading - a) / (b - a))) * self.longest[0]
            / (KNOTS[0] - 1) as f64;
        (self.mu[0] * concrete + self.mu[1] * f64::from(steel)) as f32
    }

    /// Straight line integrals of rays that meet no steel.
    pub(crate) fn correct_concrete(&self, lines: &mut Sinogram) {
        lines.data.par_iter_mut().for_each(|p| *p = self.apply(*p, 0.0));
    }

    /// Straight line integrals of `lines`, whose steel is found by itself on `grid`.
    ///
    /// # Errors
    /// As [`fbp`].
    pub fn correct(
        &self,
        lines: &mut Sinogram,
        grid: &Grid,
        window: Window,
        job: &Job,
    ) -> Result<(), ReconError> {
        let measured = lines.data.clone();
        let projector = Projector::new(&lines.orbit, grid)?;
        lines.data.par_iter_mut().zip(&measured).for_each(|(p, m)| *p = self.apply(*m, 0.0));
        for _ in 0..ROUNDS {
            let image = fbp(lines, grid, window, job)?;
            let Some(steel) = self.find(&image) else { return Ok(()) };
            let ways = projector.forward(&steel, job)?;
            lines
                .data
                .par_iter_mut()
                .zip(measured.par_iter().zip(&ways))
                .for_each(|(p, (m, way))| *p = self.apply(*m, *way));
        }
        Ok(())
    }

    /// Voxels that are steel: above half way from concrete to what steel looks like in this
    /// picture, most of their neighbours too.
    fn find(&self, image: &Volume) -> Option<Vec<f32>> {
        let [concrete, steel] = self.mu.map(|mu| mu as f32);
        let mut bright: Vec<f32> = image
            .data
            .iter()
            .copied()
            .filter(|v| *v > concrete + 0.4 * (steel - concrete))
            .collect();
        if bright.is_empty() {
            return None;
        }
        let middle = bright.len() / 2;
        let apparent = *bright.select_nth_unstable_by(middle, f32::total_cmp).1;
        let least = 0.5 * (concrete + apparent);
        let [nx, ny, _] = image.grid.size;
        let n = nx * ny;
        let found = (0..image.data.len())
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % nx, i % n / nx);
                if image.data[i] <= least || x == 0 || y == 0 || x + 1 == nx || y + 1 == ny {
                    return 0.0;
                }
                let around =
                    [i - nx - 1, i - nx, i - nx + 1, i - 1, i + 1, i + nx - 1, i + nx, i + nx + 1];
                f32::from(u8::from(
                    around.into_iter().filter(|&j| image.data[j] > least).count() >= 4,
                ))
            })
            .collect();
        Some(found)
    }
}
