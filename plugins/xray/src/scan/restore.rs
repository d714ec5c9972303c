//! From raw frames back to attenuation.

use intrados_stage::Job;
use rayon::prelude::*;

use super::{
    Behind, Drawing, Exposure, Protocol, ScanError, ScatterMap, ScatterSettings, Standard,
};
use crate::{
    correct::{bad_pixels, mend, remove_stripes_by_fit},
    recon::{Window, fbp},
    volume::{Beam, Grid, Orbit, Sinogram, Volume},
};

/// Which corrections are made; dark and flat field always are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corrections {
    /// Scatter is taken off.
    pub scatter: bool,
    /// Line integrals are made straight.
    pub hardening: bool,
    /// Stripes are removed from sinograms.
    pub rings: bool,
    /// Line integrals through steel are made straight for steel too (with hardening).
    pub metal: bool,
}

impl Corrections {
    /// All of them.
    pub const ALL: Self = Self { scatter: true, hardening: true, rings: true, metal: true };
    /// None.
    pub const NONE: Self = Self { scatter: false, hardening: false, rings: false, metal: false };
}

/// Slices.
#[derive(Debug, Clone)]
pub struct Restored {
    /// Attenuation, 1/m, at [`Restored::kev`].
    pub volume: Volume,
    /// keV.
    pub kev: f64,
    /// Line integrals of all rays after dark, flat field and dead pixels: what the scanner
    /// delivers.
    pub projections: Sinogram,
    /// Share of the rays that reach the slices behind which less was left than its error.
    pub starved: f64,
}

/// What may be known when a scan is corrected.
#[derive(Debug, Clone)]
pub struct Known {
    /// The scanner, by its data sheets.
    pub protocol: Protocol,
    /// What is scanned, by its drawing.
    pub drawing: Drawing,
    /// Slices to be reconstructed.
    pub slices: Grid,
}

/// How readings count photons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counts {
    /// Photons that the open beam brings to the middle pixel.
    pub open: f64,
    /// Electronic noise of a reading, in photons.
    pub electronic: f64,
}

impl Counts {
    /// As data sheets have them.
    #[must_use]
    pub fn by_sheet(protocol: &Protocol) -> Self {
        Self { open: protocol.open(), electronic: protocol.detector.electronic }
    }
}

impl Known {
    /// The scatter behind what the drawing shows.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn scatter_map(&self, seed: u64, job: &Job) -> Result<ScatterMap, ScanError> {
        let specimen = self.drawing.solids(&self.protocol)?;
        let [scatter_map] = ScatterMap::cast(
            [Behind { specimen: &specimen, protocol: &self.protocol, seed }],
            &ScatterSettings::of(&self.protocol),
            job,
        )?;
        Ok(scatter_map)
    }

    /// Slices of line integrals that a scanner delivers, dark and flat field taken off, with the
    /// scatter that `scatter_map` estimates.
    ///
    /// # Errors
    /// Cancelled, or the arc is too short.
    pub fn slices_of(
        &self,
        projections: Sinogram,
        counts: Counts,
        scatter_map: Option<&ScatterMap>,
        corrections: Corrections,
        window: Window,
        job: &Job,
    ) -> Result<Restored, ScanError> {
        let Self { protocol, drawing, slices } = self;
        let outline = drawing.outline;
        let part = Part::of(&projections.orbit, slices, outline.reach());
        let mut lines = part.cut(&projections);
        // A gain that has drifted is the same factor in all views of what comes, scatter included:
        // stripes go first.
        job.relabel("correcting");
        if corrections.rings {
            rings(&mut lines, job)?;
        }
        let starved = part.clear(
            &mut lines,
            &projections.orbit,
            counts,
            scatter_map.filter(|_| corrections.scatter),
        );
        // Attenuation is that of the mean energy behind half the specimen.
        let standard = Standard::new(protocol, 0.5 * outline.half().min_element())?;
        job.relabel("reconstructing");
        if corrections.hardening {
            // Rays through the outermost slices leave the volume: for the time it is given some
            // more.
            let tall = taller(slices, part.margin);
            let metal = (corrections.metal && !drawing.bars.is_empty()).then_some((&tall, window));
            standard.straighten(&mut lines, 3.0 * outline.reach(), metal, job)?;
        }
        let volume = fbp(&lines, slices, window, job)?;
        Ok(Restored { volume, kev: standard.kev, projections, starved })
    }
}

/// Slices from an exposure, with the scatter that `scatter_map` estimates.
///
/// # Errors
/// Cancelled, or the arc is too short.
pub fn restore(
    exposure: &Exposure,
    known: &Known,
    scatter_map: Option<&ScatterMap>,
    corrections: Corrections,
    window: Window,
    job: &Job,
) -> Result<Restored, ScanError> {
    let counts = Counts { open: exposure.open, electronic: exposure.electronic };
    known.slices_of(projections(exposure), counts, scatter_map, corrections, window, job)
}

/// Dark and flat field, dead pixels.
fn projections(exposure: &Exposure) -> Sinogram {
    let mut frames = exposure.frames.clone();
    let bad = bad_pixels(&exposure.panel, 8.0);
    let pixels = exposure.panel.dark.len().max(1);
    let floor = (0.5 / exposure.open) as f32;
    let [rows, bins] = exposure.panel.size;
    frames.par_chunks_mut(pixels).for_each(|frame| {
        for (i, v) in frame.iter_mut().enumerate() {
            let open = exposure.panel.flat[i] - exposure.panel.dark[i];
            *v = if open > 0.0 { (*v - exposure.panel.dark[i]) / open } else { 0.0 };
        }
        if bad.iter().any(|b| *b) {
            let panel =
                crate::correct::Panel { size: [rows, bins], dark: Vec::new(), flat: Vec::new() };
            mend(frame, &panel, &bad);
        }
        frame.iter_mut().for_each(|v| *v = -v.max(floor).ln());
    });
    Sinogram { orbit: exposure.orbit.clone(), data: frames }
}

/// Stripes of every row of the panel: gains that have drifted, each by one factor for all views.
/// Dead pixels have been mended.
fn rings(lines: &mut Sinogram, job: &Job) -> Result<(), ScanError> {
    let (rows, bins, views) = (lines.orbit.rows(), lines.orbit.bins(), lines.orbit.views());
    job.step(0, rows)?;
    let sinograms: Vec<Vec<f32>> = (0..rows)
        .into_par_iter()
        .map(|row| {
            let mut sinogram = lines.row(row);
            if !job.is_cancelled() {
                remove_stripes_by_fit(&mut sinogram, bins, 0, 5);
            }
            sinogram
        })
        .collect();
    job.step(rows, rows)?;
    for (row, sinogram) in sinograms.iter().enumerate() {
        for view in 0..views {
            let at = (view * rows + row) * bins;
            lines.data[at..at + bins].copy_from_slice(&sinogram[view * bins..(view + 1) * bins]);
        }
    }
    Ok(())
}

fn taller(grid: &Grid, margin: usize) -> Grid {
    let mut tall = *grid;
    tall.size[2] += 2 * margin;
    tall.origin[2] -= margin as f64 * grid.voxel[2];
    tall
}

/// The part of the panel that sees the slices.
struct Part {
    rows: [usize; 2],
    bins: [usize; 2],
    /// Slices more on each side that its rays pass.
    margin: usize,
}

impl Part {
    fn of(orbit: &Orbit, slices: &Grid, reach: f64) -> Self {
        let Beam::Cone { source_axis, axis_detector } = orbit.beam else {
            return Self { rows: [0, orbit.rows()], bins: [0, orbit.bins()], margin: 0 };
        };
        let panel = source_axis + axis_detector;
        let top = 0.5 * slices.voxel[2] * slices.size[2] as f64;
        // Voxels near the source are enlarged most.
        let high = top * panel / (source_axis - reach).max(0.05 * source_axis) / orbit.pixel[1];
        let sine = (1.02 * reach / source_axis).min(0.99);
        let wide = panel * sine / (1.0 - sine * sine).sqrt() / orbit.pixel[0] + 4.0;
        let range = |centre: f64, half: f64, n: usize| {
            [
                (centre - half).floor().max(0.0) as usize,
                ((centre + half).ceil() as usize + 1).min(n),
            ]
        };
        let margin = ((high + 1.0) * orbit.pixel[1] * (source_axis + reach) / panel - top).max(0.0)
            / slices.voxel[2];
        Self {
            rows: range(orbit.centre[1], high + 1.0, orbit.rows()),
            bins: range(orbit.centre[0], wide, orbit.bins()),
            margin: margin.ceil() as usize,
        }
    }

    fn cut(&self, whole: &Sinogram) -> Sinogram {
        let mut orbit = whole.orbit.clone();
        orbit.detector = [self.rows[1] - self.rows[0], self.bins[1] - self.bins[0]];
        orbit.centre = [
            whole.orbit.centre[0] - self.bins[0] as f64,
            whole.orbit.centre[1] - self.rows[0] as f64,
        ];
        let (rows, bins) = (whole.orbit.rows(), whole.orbit.bins());
        let mut data = Vec::with_capacity(orbit.len());
        for view in 0..orbit.views() {
            for row in self.rows[0]..self.rows[1] {
                let at = (view * rows + row) * bins;
                data.extend_from_slice(&whole.data[at + self.bins[0]..at + self.bins[1]]);
            }
        }
        Sinogram { orbit, data }
    }

    /// Line integrals without scatter, of rays that are calmed where they are starved; the share of
    /// those of which nothing certain was left.
    fn clear(
        &self,
        lines: &mut Sinogram,
        whole: &Orbit,
        counts: Counts,
        scatter_map: Option<&ScatterMap>,
    ) -> f64 {
        let size = [whole.views(), self.rows[1] - self.rows[0], self.bins[1] - self.bins[0]];
        let frame = (size[1] * size[2]).max(1);
        let noise = (counts.electronic / counts.open).powi(2);
        // Variance of counting, and of the scatter that is taken off.
        let mut variance = vec![[0.0_f32; 2]; lines.data.len()];
        lines
            .data
            .par_chunks_mut(frame)
            .zip(variance.par_chunks_mut(frame))
            .zip(&whole.angles)
            .for_each(|((line, variance), &angle)| {
                let scatter =
                    scatter_map.map(|v| v.estimate.view(angle, [whole.rows(), whole.bins()]));
                for (i, (p, v)) in line.iter_mut().zip(variance).enumerate() {
                    let intensity = (-*p).exp();
                    let at =
                        (self.rows[0] + i / size[2]) * whole.bins() + self.bins[0] + i % size[2];
                    let (s, e) = scatter.as_ref().map_or((0.0, 0.0), |(s, e)| (s[at], e[at]));
                    *v = [(f64::from(intensity) / counts.open + noise) as f32, e];
                    *p = intensity - s;
                }
            });
        let (calm, starved) = calmed(&lines.data, &variance, size);
        lines.data = calm;
        starved
    }
}

/// Largest relative error that a ray may have before its neighbours are asked.
const CALM: f32 = 0.12;
/// Farthest neighbours.
const FAR: usize = 4;

/// −ln of intensities. Where so few photons are left that the logarithm would be of noise, the mean
/// of the smallest box of neighbours (bins, views, rows) that is known well enough takes the ray's
/// place (adaptive filtering: Kachelrieß, Watzke and Kalender 2001, Med. Phys. 28, 475); where no
/// box is, what is left of it above its own error. Also the share of rays of the last kind. `rest`
/// and the variances of counting and of the scatter taken off are `[view][row][bin]`.
#[must_use]
pub fn calmed(
    rest: &[f32],
    variance: &[[f32; 2]],
    [views, rows, bins]: [usize; 3],
) -> (Vec<f32>, f64) {
    let frame = rows * bins;
    let of = |view: usize, row: usize, bin: usize| {
        let i = view * frame + row * bins + bin;
        let (mut mean, mut error) = (rest[i], variance[i][0].sqrt());
        for k in 1..=FAR {
            if error < CALM * mean {
                return (-mean.ln(), false);
            }
            let range = |at: usize, n: usize, k: usize| at.saturating_sub(k)..(at + k + 1).min(n);
            let (mut sum, mut squares, mut n) = (0.0, 0.0, 0.0_f32);
            for v in range(view, views, k.div_ceil(2)) {
                for r in range(row, rows, k.div_ceil(2)) {
                    for j in range(bin, bins, k).map(|b| v * frame + r * bins + b) {
                        sum += rest[j];
                        squares += variance[j][0];
                        n += 1.0;
                    }
                }
            }
            (mean, error) = (sum / n, squares.sqrt() / n);
        }
        // Neighbours share the error of the scatter: no mean lessens it.
        let error = error.hypot(variance[i][1].sqrt()).max(1e-12);
        match mean >= error {
            true => (-mean.ln(), false),
            false => (-(error * (mean / error - 1.0).max(-20.0).exp()).ln(), true),
        }
    };
    let parts: Vec<(f32, bool)> = (0..views)
        .into_par_iter()
        .flat_map_iter(|view| (0..frame).map(move |i| of(view, i / bins, i % bins)))
        .collect();
    let starved = parts.iter().filter(|p| p.1).count() as f64 / parts.len().max(1) as f64;
    (parts.into_iter().map(|p| p.0).collect(), starved)
}
