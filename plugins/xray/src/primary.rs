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
pub(crate) struct Lines {
    pub(crate) kev: Vec<f64>,
    share: Vec<f64>,
    /// By label, then bin, 1/m.
    pub(crate) mu: Vec<Vec<f64>>,
}

impl Lines {
    pub(crate) fn new(specimen: &Specimen, scanner: &Scanner) -> Self {
        let (kev, share): (Vec<f64>, Vec<f64>) =
            scanner.spectrum.bins().filter(|(_, share)| *share > 0.0).unzip();
        let of = |label: usize| {
            let density = specimen.density(label as u8);
            kev.iter().map(|&e| density * specimen.matter(label as u8).total(e)).collect()
        };
        Self { mu: (0..specimen.labels()).map(of).collect(), kev, share }
    }

    /// Calls `visit(bin, seen)` with what the response at a point of the panel's plane makes of
    /// every bin behind the specimen, over [`Scanner::open`]; says what it makes of all without.
    pub(crate) fn along(
        &self,
        specimen: &Specimen,
        scanner: &Scanner,
        p: DVec3,
        mut visit: impl FnMut(usize, f64),
    ) -> f64 {
        if scanner.open(p) <= 0.0 {
            return 0.0;
        }
        let distance = (p - scanner.source).length();
        let way = (p - scanner.source) / distance;
        let cos = way.dot(scanner.panel.normal());
        let mut lengths = [0.0; PALETTE];
        specimen.trace(scanner.source, way, 0.0, distance, |label, a, b| {
            lengths[label as usize] += b - a;
            true
        });
        let passed: Vec<(usize, f64)> =
            lengths.into_iter().enumerate().filter(|(_, l)| *l > 0.0).collect();
        let mut open = 0.0;
        for (i, (&kev, &share)) in self.kev.iter().zip(&self.share).enumerate() {
            let seen = share * scanner.panel.response.of(kev, cos);
            let depth: f64 = passed.iter().map(|&(label, length)| self.mu[label][i] * length).sum();
            open += seen;
            visit(i, seen * (-depth).exp());
        }
        open
    }
}

/// The primary at every pixel's middle, row by row: what the response makes of it, per m² and
/// emitted photon. The second is the same without the specimen.
#[must_use]
pub fn primary(specimen: &Specimen, scanner: &Scanner) -> [Vec<f64>; 2] {
    let lines = Lines::new(specimen, scanner);
    let pixels: Vec<u32> = (0..scanner.panel.len()).collect();
    let values: Vec<[f64; 2]> = pixels
        .par_chunks(CHUNK)
        .flat_map_iter(|chunk| {
            chunk
                .iter()
                .map(|&bin| at_point(specimen, scanner, &lines, scanner.panel.place(bin, [0.5; 2])))
        })
        .collect();
    [0, 1].map(|k| values.iter().map(|v| v[k]).collect())
}

/// The same at one point of the panel's plane.
#[must_use]
pub fn primary_at(specimen: &Specimen, scanner: &Scanner, p: DVec3) -> [f64; 2] {
    at_point(specimen, scanner, &Lines::new(specimen, scanner), p)
}

fn at_point(specimen: &Specimen, scanner: &Scanner, lines: &Lines, p: DVec3) -> [f64; 2] {
    let mut behind = 0.0;
    let seen = lines.along(specimen, scanner, p, |_, passed| behind += passed);
    let open = scanner.open(p);
    [behind * open, seen * open]
}
