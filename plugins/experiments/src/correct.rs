//! From readings to slices: plainly, or with what the scan did to them taken out.

use intrados_raster::grid::median;
use intrados_stage::Job;
use intrados_xray::{
    correct::{axis_by_mirror, bad_pixels, mend, remove_stripes_by_fit},
    recon::{Window, fbp},
    scan::{Corrections, Drawing, calmed},
    specimen::{Specimen, concrete::Bar},
    volume::{self, Sinogram},
};

use glam::DVec2;

use super::{
    ExperimentError,
    scan::{RawScan, Sheet, standard},
    scatter::{Head, Scatter, ScatterEffort},
};
use intrados_ct::slice::Slice;
use intrados_raster::grid::{Grid, Mask};

/// How far beyond the beam photons wander and come back, m.
const BEYOND: f64 = 0.15;
/// How far the axis may be off, pixels.
const OFF: f64 = 2.0;
/// Most bars that are told to the walks, the largest.
const BARS: usize = 24;

/// How the scatter of the correction is found: six views of sixteen patches.
pub(crate) const STEERED: ScatterEffort =
    ScatterEffort { views: 6, columns: 16, walks: 1 << 15, links: 8, steered: true };

/// What may be left out of a correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Care {
    /// Which corrections are made.
    pub corrections: Corrections,
    /// How scatter is found.
    pub effort: ScatterEffort,
    /// Of the backprojection.
    pub window: Window,
}

impl Care {
    /// All corrections, scatter by walks that the dual process steers.
    pub(crate) const FULL: Self =
        Self { corrections: Corrections::ALL, effort: STEERED, window: Window::SheppLogan };
}

/// Transmission after dark and flat field; readings of pixels that do not follow the beam come from
/// their neighbours.
fn transmission(scan: &RawScan) -> Vec<f32> {
    let RawScan { panel, frames, sheet } = scan;
    let bad = bad_pixels(panel, 8.0);
    let bins = sheet.orbit.bins();
    let mut values: Vec<f32> = frames
        .iter()
        .enumerate()
        .map(|(i, v)| {
            let k = i % bins;
            (v - panel.dark[k]) / (panel.flat[k] - panel.dark[k]).max(1.0)
        })
        .collect();
    mend(&mut values, panel, &bad);
    values
}

fn picture(volume: volume::Volume, sheet: &Sheet, name: &str) -> Slice {
    let [width, height, _] = volume.grid.size;
    // Beyond what all views see, nothing is known.
    let [axis, panel] = sheet.distances();
    let seen = 0.5 * sheet.orbit.pixel[0] * (sheet.orbit.bins() as f64 - 3.0) * axis
        / panel.hypot(0.5 * sheet.lit[0]);
    let mut volume = volume;
    for (i, v) in volume.data.iter_mut().enumerate() {
        if volume.grid.at(0, i % width).hypot(volume.grid.at(1, i / width)) > seen {
            *v = 0.0;
        }
    }
    Slice {
        name: name.to_owned(),
        grey: Grid { width, height, data: volume.data },
        pixel_mm: 1e3 * sheet.voxel() as f32,
    }
}

/// Line integrals as they are.
fn lines(scan: &RawScan) -> Sinogram {
    let floor = (0.5 / scan.sheet.open) as f32;
    Sinogram {
        orbit: scan.sheet.orbit.clone(),
        data: transmission(scan).iter().map(|v| -v.max(floor).ln()).collect(),
    }
}

/// Plain filtered backprojection: dark and flat field, −ln, ramp.
///
/// # Errors
/// Cancelled.
pub(crate) fn plain(scan: &RawScan, job: &Job) -> Result<Slice, ExperimentError> {
    Ok(picture(
        fbp(&lines(scan), &scan.sheet.slice, Window::SheppLogan, job)?,
        &scan.sheet,
        "plain",
    ))
}

/// The scatter behind the member as its drawing has it, of ordinary concrete, with the bars that a
/// first slice shows.
///
/// # Errors
/// Cancelled.
pub(crate) fn scattered(
    scan: &RawScan,
    effort: ScatterEffort,
    job: &Job,
) -> Result<Scatter, ExperimentError> {
    let sheet = &scan.sheet;
    let first = fbp(&lines(scan), &sheet.slice, Window::Hann, job)?;
    let (spectrum, response) = sheet.tube.radiation()?;
    let head =
        Head { spectrum, response, distances: sheet.distances(), lit: sheet.lit, spot: sheet.spot };
    head.scatter(&member(sheet, &first)?, effort, 0x0c02, job)
}

/// The same with the axis found, rings, scatter, hardening and metal taken out.
///
/// # Errors
/// Cancelled.
pub(crate) fn corrected(scan: &RawScan, care: Care, job: &Job) -> Result<Slice, ExperimentError> {
    let scatter =
        if care.corrections.scatter { Some(scattered(scan, care.effort, job)?) } else { None };
    corrected_by(scan, care, scatter.as_ref(), job)
}

/// The same with a scatter that is known already.
///
/// # Errors
/// Cancelled.
pub(crate) fn corrected_by(
    scan: &RawScan,
    care: Care,
    scatter: Option<&Scatter>,
    job: &Job,
) -> Result<Slice, ExperimentError> {
    let sheet = &scan.sheet;
    let mut lines = lines(scan);
    lines.orbit.centre[0] = axis_by_mirror(&lines, 0, OFF)?;
    let bins = lines.orbit.bins();
    // A gain that has drifted multiplies scatter too: stripes go first.
    if care.corrections.rings {
        remove_stripes_by_fit(&mut lines.data, bins, 0, 5);
    }
    let mut variance = vec![[0.0_f32; 2]; lines.data.len()];
    let noise = (sheet.electronic / sheet.open).powi(2);
    lines.data.iter_mut().zip(&mut variance).for_each(|(p, v)| {
        *p = (-*p).exp();
        v[0] = (f64::from(*p) / sheet.open + noise) as f32;
    });
    if let Some(scatter) = scatter {
        for (view, angle) in sheet.orbit.angles.iter().enumerate() {
            let (value, error) = scatter.estimate.view(*angle, [1, bins]);
            for (bin, (s, e)) in value.iter().zip(error).enumerate() {
                lines.data[view * bins + bin] -= s;
                variance[view * bins + bin][1] = e;
            }
        }
    }
    (lines.data, _) = calmed(&lines.data, &variance, [sheet.orbit.views(), 1, bins]);
    straighten(&mut lines, sheet, care.corrections, job)?;
    Ok(picture(fbp(&lines, &sheet.slice, care.window, job)?, sheet, "corrected"))
}

/// Hardening and metal: line integrals as if all photons had one energy.
fn straighten(
    lines: &mut Sinogram,
    sheet: &Sheet,
    corrections: Corrections,
    job: &Job,
) -> Result<(), ExperimentError> {
    if !corrections.hardening {
        return Ok(());
    }
    let metal = corrections.metal.then_some((&sheet.slice, Window::SheppLogan));
    Ok(standard(sheet)?.straighten(lines, 3.0 * sheet.outline.reach(), metal, job)?)
}

/// What scatters.
fn member(sheet: &Sheet, first: &volume::Volume) -> Result<Specimen, ExperimentError> {
    let [axis, panel] = sheet.distances();
    let half = 0.5 * sheet.lit[1] * axis / panel + BEYOND;
    let bar = |(at, radius): (DVec2, f64)| Bar {
        line: vec![at.extend(-half), at.extend(half)],
        radius,
        ribbed: false,
        loss: 0.0,
    };
    let bars: Vec<Bar> = bars(sheet, first).into_iter().map(bar).collect();
    Ok(Drawing { outline: sheet.outline, height: 2.0 * half, bars }.solids_within(half)?)
}

/// Round things that are twice as bright as concrete: middle and radius, m.
fn bars(sheet: &Sheet, first: &volume::Volume) -> Vec<(DVec2, f64)> {
    let [width, height, _] = first.grid.size;
    let Some(concrete) = median(first.data.iter().copied().filter(|v| *v > 0.0)) else {
        return Vec::new();
    };
    let bright =
        Mask { width, height, data: first.data.iter().map(|v| *v > 2.0 * concrete).collect() }
            .opened();
    let mut parts = bright.components().members;
    parts.sort_by_key(|p| std::cmp::Reverse(p.len()));
    let grid = &first.grid;
    let bar = |pixels: &Vec<usize>| {
        let n = pixels.len() as f64;
        let sum: DVec2 =
            pixels.iter().map(|i| DVec2::new(grid.at(0, i % width), grid.at(1, i / width))).sum();
        (sum / n, sheet.voxel() * (n / std::f64::consts::PI).sqrt())
    };
    let inside = |(at, radius): &(DVec2, f64)| {
        *radius > 2e-3 && sheet.outline.within(at.extend(0.0)) > *radius
    };
    parts.iter().map(bar).filter(inside).take(BARS).collect()
}
