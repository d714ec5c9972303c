//! Beam hardening: a spectrum loses its soft part first, so that line integrals grow ever more
//! slowly with the way through the specimen, and slices are cupped.

use intrados_stage::Job;

use super::least_squares;
use crate::{
    recon::{ReconError, Window, fbp},
    volume::{Grid, Sinogram},
};

/// Knots of the table of a [`Linearisation`].
const KNOTS: usize = 2048;

/// From the polychromatic to the monochromatic line integral, for a specimen of one material and a
/// known spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearisation {
    /// Polychromatic line integral at equal steps of way.
    poly: Vec<f32>,
    /// Monochromatic line integral of a step.
    step: f32,
}

impl Linearisation {
    /// `spectrum`: detected signal of each energy (photons times what the detector makes of each);
    /// `attenuation`: that of the material there, 1/m; `reference`: that at the energy to go to,
    /// 1/m; `way`: longest way through the specimen, m (beyond it the last slope goes on).
    ///
    /// # Errors
    /// Lists of different lengths, nothing detected, or values that are negative or not finite.
    pub fn new(
        spectrum: &[f64],
        attenuation: &[f64],
        reference: f64,
        way: f64,
    ) -> Result<Self, ReconError> {
        let proper = |v: &f64| v.is_finite() && *v >= 0.0;
        let total: f64 = spectrum.iter().sum();
        if spectrum.len() != attenuation.len()
            || !spectrum.iter().chain(attenuation).chain([&reference, &way]).all(proper)
        {
            return Err(ReconError::Bad(
                "a spectrum needs one attenuation for each energy, none of them negative"
                    .to_owned(),
            ));
        }
        let weakest = spectrum
            .iter()
            .zip(attenuation)
            .filter(|(s, _)| **s > 0.0)
            .map(|(_, m)| *m)
            .fold(f64::INFINITY, f64::min);
        if !(total > 0.0 && weakest > 0.0 && weakest.is_finite() && reference > 0.0 && way > 0.0) {
            return Err(ReconError::Bad(
                "a spectrum must detect something, and the material attenuate".to_owned(),
            ));
        }
        let poly = |i: usize| {
            let way = way * i as f64 / (KNOTS - 1) as f64;
            // The hardest part is taken out, so that nothing underflows.
            let rest: f64 = spectrum
                .iter()
                .zip(attenuation)
                .map(|(s, m)| s * (-(m - weakest) * way).exp())
                .sum();
            (weakest * way - (rest / total).ln()) as f32
        };
        Ok(Self {
            poly: (0..KNOTS).map(poly).collect(),
            step: (reference * way / (KNOTS - 1) as f64) as f32,
        })
    }

    /// The monochromatic line integral of a polychromatic one; what is negative (noise in air) goes
    /// on with the first slope.
    #[must_use]
    pub(crate) fn apply(&self, p: f32) -> f32 {
        let i = self.poly.partition_point(|knot| *knot <= p).clamp(1, KNOTS - 1);
        let [a, b] = [self.poly[i - 1], self.poly[i]];
        self.step * ((i - 1) as f32 + (p - a) / (b - a))
    }

    /// [`Linearisation::apply`] to all rays.
    pub fn correct(&self, data: &mut [f32]) {
        data.iter_mut().for_each(|p| *p = self.apply(*p));
    }
}

/// p ↦ Σ cₙ pⁿ, n from 1: what flattens a specimen whose spectrum nobody knows.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial(
    /// c₁, c₂, …
    pub Vec<f64>,
);

impl Polynomial {
    /// Finds the coefficients from the scan itself (empirical cupping correction, Kachelrieß,
    /// Sourbelle and Kalender 2006): filtered backprojection is linear, so the powers of the line
    /// integrals are reconstructed one by one and added up to fit a template: within the specimen,
    /// a constant, around it 0. The specimen is what lies above half of the mean of its own
    /// brighter part; voxels far from the constant (pores, bars) are left out.
    ///
    /// # Errors
    /// As [`fbp`], or the slice shows no specimen.
    pub fn flatten(
        sinogram: &Sinogram,
        grid: &Grid,
        degree: usize,
        job: &Job,
    ) -> Result<Self, ReconError> {
        let mut images = Vec::with_capacity(degree);
        for power in 1..=degree.clamp(1, 6) {
            let data = sinogram.data.iter().map(|p| p.powi(power as i32)).collect();
            images.push(
                fbp(&Sinogram { orbit: sinogram.orbit.clone(), data }, grid, Window::Hann, job)?
                    .data,
            );
        }
        let first = &images[0];
        let bright = split(first);
        let (sum, n) = first
            .iter()
            .filter(|v| **v > bright)
            .fold((0.0, 0_usize), |(s, n), v| (s + f64::from(*v), n + 1));
        let mean = sum / n.max(1) as f64;
        let template = |v: f32| {
            let v = f64::from(v) / mean;
            if (0.7..1.3).contains(&v) {
                Some(mean)
            } else if v.abs() < 0.15 {
                Some(0.0)
            } else {
                None
            }
        };
        // Beyond the disc that all views see, nothing is known.
        let [nx, ny, _] = grid.size;
        let seen = |i: usize| {
            ((i % nx) as f64 - 0.5 * (nx as f64 - 1.0))
                .hypot((i / nx % ny) as f64 - 0.5 * (ny as f64 - 1.0))
                < 0.5 * nx.min(ny) as f64
        };
        let rows = (0..first.len()).filter(|i| seen(*i)).filter_map(|i| {
            // The powers differ by orders of magnitude; the fit is in double precision and small,
            // so that is of no account.
            template(first[i])
                .map(|t| (images.iter().map(|image| f64::from(image[i])).collect(), t))
        });
        least_squares(images.len(), rows)
            .map(Self)
            .ok_or_else(|| ReconError::Bad("the slice shows no specimen to flatten".to_owned()))
    }

    /// Value at one line integral.
    #[must_use]
    pub(crate) fn apply(&self, p: f32) -> f32 {
        let p = f64::from(p);
        (self.0.iter().rev().fold(0.0, |sum, c| (sum + c) * p)) as f32
    }

    /// [`Polynomial::apply`] to all rays.
    pub fn correct(&self, data: &mut [f32]) {
        data.iter_mut().for_each(|p| *p = self.apply(*p));
    }
}

/// Half way between the mean of what is below and the mean of what is above, repeated (Ridler and
/// Calvard 1978).
pub(super) fn split(values: &[f32]) -> f32 {
    let mut at = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
    for _ in 0..20 {
        let part = |above: bool| {
            let (s, n) = values
                .iter()
                .filter(|v| (f64::from(**v) > at) == above)
                .fold((0.0, 0_usize), |(s, n), v| (s + f64::from(*v), n + 1));
            s / n.max(1) as f64
        };
        at = 0.5 * (part(true) + part(false));
    }
    at as f32
}
