//! What the panel reads.

use intrados_raster::Grid;
use intrados_stage::{Job, random::Key};
use rayon::prelude::*;

use super::{Energies, Forming, Protocol, Rays, ScanError, ScatterMap};
use crate::{
    correct::{Panel, poisson},
    volume::Orbit,
};

/// Views of one task between two looks at the job.
const VIEWS: usize = 8;
/// Reading without beam.
const DARK: f64 = 200.0;

/// Raw frames, in detected photons of the open beam's mean energy, and the fields taken before.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// Where the rays ran.
    pub orbit: Orbit,
    /// `[view][row][bin]`.
    pub frames: Vec<f32>,
    /// Dark and flat field.
    pub panel: Panel,
    /// Photons that the open beam brings to the middle pixel.
    pub open: f64,
    /// Electronic noise.
    pub electronic: f64,
}

/// Shines through the voxels: exact primary of the whole spectrum, scatter, blur, noise.
///
/// # Errors
/// Cancelled.
pub fn expose(
    rays: &Rays,
    energies: &Energies,
    scatter_map: Option<&ScatterMap>,
    protocol: &Protocol,
    seed: u64,
    job: &Job,
) -> Result<Exposure, ScanError> {
    expose_seen(rays, energies, scatter_map, protocol, seed, &Forming::default(), job)
}

/// The same, while somebody looks on.
pub(super) fn expose_seen(
    rays: &Rays,
    energies: &Energies,
    scatter_map: Option<&ScatterMap>,
    protocol: &Protocol,
    seed: u64,
    sinogram: &Forming,
    job: &Job,
) -> Result<Exposure, ScanError> {
    let (orbit, detector) = (&protocol.orbit, &protocol.detector);
    let size = [orbit.rows(), orbit.bins()];
    let pixels = size[0] * size[1];
    let distances = protocol.distances();
    let photons = open_photons(protocol, energies);
    let gains = Gains::new(protocol, pixels, seed);
    let panel = gains.fields(protocol, &photons, seed);
    let floor = (0.5 / photons[size[0] / 2 * size[1] + size[1] / 2]) as f32;
    sinogram.begin(orbit.views(), size[1]);
    let mut frames = Vec::with_capacity(orbit.len());
    let views: Vec<usize> = (0..orbit.views()).collect();
    for group in views.chunks(VIEWS) {
        job.step(group[0], views.len())?;
        let parts: Vec<Vec<f32>> = group
            .par_iter()
            .map(|&view| {
                let angle = orbit.angles[view];
                let lengths = rays.view(orbit, angle, distances);
                let scatter = scatter_map.map(|v| v.estimate.view(angle, size).0);
                // Signal and squared signal of each photon emitted that way, over the open beam's.
                let mut signal: Vec<[f32; 2]> = lengths
                    .iter()
                    .enumerate()
                    .map(|(i, l)| {
                        let [a, b] = energies.behind(*l);
                        let scatter_map = scatter.as_ref().map_or(0.0, |s| s[i]);
                        [
                            a / energies.open[0] as f32 + scatter_map,
                            b / energies.open[1] as f32 + scatter_map,
                        ]
                    })
                    .collect();
                blur(&mut signal, size, spread(protocol));
                let key = |i: usize| Key::new(seed ^ 0x0f0f, (view * pixels + i) as u64);
                (0..pixels)
                    .map(|i| gains.read(i, photons[i], signal[i], detector.electronic, key(i)))
                    .collect()
            })
            .collect();
        for part in parts {
            let row = size[0] / 2 * size[1]..(size[0] / 2 + 1) * size[1];
            let lines = row.map(|i| {
                ((part[i] - panel.dark[i]) / (panel.flat[i] - panel.dark[i]).max(1.0)).max(floor)
            });
            sinogram.add(lines.map(|v| -v.ln()));
            frames.extend(part);
        }
    }
    let middle = size[0] / 2 * size[1] + size[1] / 2;
    Ok(Exposure {
        orbit: orbit.clone(),
        frames,
        panel,
        open: photons[middle],
        electronic: detector.electronic,
    })
}

/// Detected photons of the open beam in every pixel: what counts alike is (Σ signal)²/Σ signal².
fn open_photons(protocol: &Protocol, energies: &Energies) -> Vec<f64> {
    let orbit = &protocol.orbit;
    let [_, panel] = protocol.distances();
    let [a, b] = energies.open;
    let detected = a * a / b;
    let area = orbit.pixel[0] * orbit.pixel[1];
    let at = |i: usize, k: usize| (i as f64 - orbit.centre[k]) * orbit.pixel[k];
    let of = |(row, bin): (usize, usize)| {
        let square = panel * panel + at(bin, 0).powi(2) + at(row, 1).powi(2);
        // Inverse square of the distance, and the cosine.
        protocol.fluence * area * detected / square * panel / square.sqrt()
    };
    (0..orbit.rows()).flat_map(|row| (0..orbit.bins()).map(move |bin| (row, bin))).map(of).collect()
}

/// Standard deviation of the blur of scintillator and focal spot, pixels.
fn spread(protocol: &Protocol) -> f64 {
    let [axis, panel] = protocol.distances();
    // A disk's diameter is four standard deviations of its projection.
    let spot = 0.25 * protocol.focus * (panel - axis) / axis / protocol.orbit.pixel[0];
    protocol.detector.blur.hypot(spot)
}

/// Gaussian along rows and columns, of both numbers of a pixel.
fn blur(signal: &mut [[f32; 2]], [rows, bins]: [usize; 2], sigma: f64) {
    for k in 0..2 {
        let plane = Grid { width: bins, height: rows, data: signal.iter().map(|s| s[k]).collect() };
        let soft = plane.blurred(sigma, &Job::default());
        signal.iter_mut().zip(soft.data).for_each(|(to, value)| to[k] = value);
    }
}

/// What the pixels are like.
struct Gains {
    /// When the fields were taken, and at the scan.
    gain: Vec<[f64; 2]>,
    dark: Vec<f64>,
}

impl Gains {
    fn new(protocol: &Protocol, pixels: usize, seed: u64) -> Self {
        let detector = &protocol.detector;
        let key = |i: usize| Key::new(seed ^ 0xde7e, i as u64);
        let gain = |i: usize| {
            if key(i).unit64(9) < detector.dead {
                return [0.0; 2];
            }
            let before = (1.0 + detector.gain * key(i).normal(0)).max(0.1);
            [before, before * (1.0 + detector.drift * key(i).normal(2))]
        };
        Self {
            gain: (0..pixels).map(gain).collect(),
            dark: (0..pixels).map(|i| DARK + 3.0 * key(i).normal(4)).collect(),
        }
    }

    /// A reading: `signal` of `photons`, whose number and mean size follow from its first two
    /// moments.
    fn read(
        &self,
        i: usize,
        photons: f64,
        [signal, square]: [f32; 2],
        electronic: f64,
        key: Key,
    ) -> f32 {
        let (signal, square) = (f64::from(signal), f64::from(square));
        let size = if signal > 0.0 { square / signal } else { 1.0 };
        let quanta = size * poisson(photons * signal / size, key, 0);
        (self.dark[i] + self.gain[i][1] * quanta + electronic * key.normal(2)) as f32
    }

    /// Dark and flat field, each the mean of some frames.
    fn fields(&self, protocol: &Protocol, photons: &[f64], seed: u64) -> Panel {
        let (detector, n) = (&protocol.detector, f64::from(protocol.detector.fields.max(1)));
        let key = |i: usize| Key::new(seed ^ 0xf1a7, i as u64);
        let noise =
            |i: usize, dimension: u32| detector.electronic / n.sqrt() * key(i).normal(dimension);
        let flat = |i: usize| {
            self.dark[i] + self.gain[i][0] * poisson(n * photons[i], key(i), 0) / n + noise(i, 4)
        };
        Panel {
            size: [protocol.orbit.rows(), protocol.orbit.bins()],
            dark: (0..photons.len()).map(|i| (self.dark[i] + noise(i, 2)) as f32).collect(),
            flat: (0..photons.len()).map(|i| flat(i) as f32).collect(),
        }
    }
}
