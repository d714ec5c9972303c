//! What comes straight through: exact line integrals, energy by energy.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    scanner::Scanner,
    specimen::{PALETTE, Specimen},
};

/// Rows of one task; fixed, so that the sums are the same on any number of threads.
const CHUNK: usize = 256;

/// Attenuation of every label in every bin of the spectrum, and what the bin counts.
struct Bins {
    kev: Vec<f64>,
    share: Vec<f64>,
    /// By label, then bin, 1/m.
    mu: Vec<Vec<f64>>,
}

impl Bins {
    fn new(specimen: &Specimen, scanner: &Scanner) -> Self {
        let (kev, share): (Vec<f64>, Vec<f64>) = scanner.spectrum.bins().filter(|(_, share)| *share > 0.0).unzip();
        let of = |label: usize| {
            let density = specimen.density(label as u8);
            kev.iter().map(|&e| density * specimen.matter(label as u8).total(e)).collect()
        };
        Self { mu: (0..specimen.labels()).map(of).collect(), kev, share }
    }
}

/// The primary at every pixel's middle, row by row: what the response makes of it, per m² and emitted photon. The second is the same without the specimen.
#[must_use]
pub fn primary(specimen: &Specimen, scanner: &Scanner) -> [Vec<f64>; 2] {
    let bins = Bins::new(specimen, scanner);
    let pixels: Vec<u32> = (0..scanner.panel.len()).collect();
    let values: Vec<[f64; 2]> = pixels
        .par_chunks(CHUNK)
        .flat_map_iter(|chunk| chunk.iter().map(|&bin| at_point(specimen, scanner, &bins, scanner.panel.place(bin, [0.5; 2]))))
        .collect();
    [0, 1].map(|k| values.iter().map(|v| v[k]).collect())
}

/// The same at one point of the panel's plane.
#[must_use]
pub fn primary_at(specimen: &Specimen, scanner: &Scanner, p: DVec3) -> [f64; 2] {
    at_point(specimen, scanner, &Bins::new(specimen, scanner), p)
}

fn at_point(specimen: &Specimen, scanner: &Scanner, bins: &Bins, p: DVec3) -> [f64; 2] {
    let open = scanner.open(p);
    if open <= 0.0 {
        return [0.0; 2];
    }
    let distance = (p - scanner.source).length();
    let way = (p - scanner.source) / distance;
    let cos = way.dot(scanner.panel.normal());
    let mut lengths = [0.0; PALETTE];
    specimen.trace(scanner.source, way, 0.0, distance, |label, a, b| {
        lengths[label as usize] += b - a;
        true
    });
    let passed: Vec<(usize, f64)> = lengths.into_iter().enumerate().filter(|(_, l)| *l > 0.0).collect();
    let mut sums = [0.0; 2];
    for (i, (&kev, &share)) in bins.kev.iter().zip(&bins.share).enumerate() {
        let seen = share * scanner.panel.response.of(kev, cos);
        let depth: f64 = passed.iter().map(|&(label, length)| bins.mu[label][i] * length).sum();
        sums[0] += seen * (-depth).exp();
        sums[1] += seen;
    }
    sums.map(|s| s * open)
}
