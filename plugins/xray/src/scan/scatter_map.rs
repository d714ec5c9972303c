//! The map of scattered photons over the projections: Monte Carlo in the specimen's outline and
//! bars, at a few views, on a coarse grid of the panel.

use std::f64::consts::TAU;

use intrados_stage::{Job, random::Key};
use intrados_transport::{Schedule, Steering};

use super::{Protocol, ScanError};
use crate::{
    correct::{Estimate, Patch},
    primary::primary_at,
    scanner::Scanner,
    scatter::{ScatterImage, image},
    specimen::Specimen,
    steer::{Guide, learn},
};

/// Largest relative error of plain walks that is not worth steering, and what a slice does not
/// show: so much of the primary.
const PLAIN: f64 = 0.04;
const UNSEEN: f64 = 3e-3;
/// One in so many walks is a pilot's.
const PILOT: u64 = 8;
/// Walks come in batches.
const BATCH: u64 = 4096;
/// How long is learnt in each view.
const LESSONS: Schedule = Schedule { first: 4096, rounds: 3 };

/// How scatter is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterSettings {
    /// Views of a turn.
    pub views: usize,
    /// Columns of the coarse grid; its pixels are as square as the panel allows.
    pub columns: u32,
    /// Walks from the tube in each view.
    pub walks: u64,
    /// Pixels that each collision is linked with.
    pub links: usize,
}

impl Default for ScatterSettings {
    fn default() -> Self {
        Self { views: 8, columns: 24, walks: 1 << 17, links: 12 }
    }
}

impl ScatterSettings {
    /// As fine as a scan has use for: of few views and pixels, fewer.
    #[must_use]
    pub fn of(protocol: &Protocol) -> Self {
        let usual = Self::default();
        let views = (protocol.orbit.views() / 45).clamp(3, usual.views);
        let columns = (protocol.orbit.bins() as u32 / 8).clamp(6, usual.columns);
        // The finer, the more walks for the same error of a patch.
        let walks = usual.walks * u64::from(columns) / u64::from(usual.columns);
        Self { views, columns, walks, ..usual }
    }
}

/// Scatter of all views.
#[derive(Debug, Clone)]
pub struct ScatterMap {
    /// Scatter over the open beam.
    pub estimate: Estimate,
    /// Scatter over primary in the middle of the panel: means over the views.
    pub to_primary: f64,
    /// Root mean square of the relative standard errors of the patches.
    pub rel_error: f64,
}

/// What scatters, in which scanner, and the seed of the walks behind it.
#[derive(Debug, Clone, Copy)]
pub struct Behind<'a> {
    /// What scatters.
    pub specimen: &'a Specimen,
    /// Tube and panel.
    pub protocol: &'a Protocol,
    /// Of the walks.
    pub seed: u64,
}

impl ScatterMap {
    /// Independent walks through every one of them, of the same outline and on the same orbit: what
    /// is learnt of the first steers all, which costs the others variance and never bias. A pilot
    /// tells how many plain walks would do; where that is more than are to be had, as behind
    /// members and open panels, walks are steered by what the panel and the tube have learnt of
    /// each other.
    ///
    /// # Errors
    /// [`ScanError`].
    pub fn cast<const N: usize>(
        bodies: [Behind<'_>; N],
        settings: &ScatterSettings,
        job: &Job,
    ) -> Result<[Self; N], ScanError> {
        let none = || ScanError::Bad("no scatter".to_owned());
        let first = *bodies.first().ok_or_else(none)?;
        let protocol = first.protocol;
        let (columns, rows) = (
            settings.columns.min(protocol.orbit.bins() as u32).max(1),
            protocol.orbit.rows() as u32,
        );
        let pixels =
            [columns, (rows * columns).div_ceil(protocol.orbit.bins() as u32).clamp(1, rows)];
        let mut views: [Vec<View>; N] = std::array::from_fn(|_| Vec::new());
        let (mut steered, mut walks) = (false, (settings.walks / PILOT).max(1));
        for number in 0..settings.views {
            job.relabel(format!("scatter, view {} of {}", number + 1, settings.views));
            let angle = TAU * number as f64 / settings.views as f64;
            let walk = |body: &Behind, guide: Option<&Guide>, walks: u64| {
                let (scanner, seed) = (
                    body.protocol.scanner(pixels, angle),
                    Key::new(body.seed, number as u64).bits(0).into(),
                );
                let scatter =
                    image(body.specimen, &scanner, guide, settings.links, walks, seed, job)?;
                Ok::<View, ScanError>(View::new(body.specimen, &scanner, angle, &scatter))
            };
            if number == 0 {
                let pilot = walk(&first, None, walks)?;
                let wanted = (UNSEEN * pilot.middle[1] / pilot.middle[0]).max(PLAIN);
                let enough = walks as f64 * (pilot.rel_error / wanted).powi(2);
                // No number: the pilot has seen nothing.
                steered = enough.is_nan() || enough > settings.walks as f64;
                walks = if steered {
                    settings.walks
                } else {
                    (enough as u64).next_multiple_of(BATCH).min(settings.walks)
                };
            }
            let scanner = protocol.scanner(pixels, angle);
            let guide = match steered {
                true => Some(learn(
                    first.specimen,
                    &scanner,
                    settings.links,
                    number as u64,
                    LESSONS,
                    Steering::On,
                    job,
                )?),
                false => None,
            };
            for (views, body) in views.iter_mut().zip(&bodies) {
                views.push(walk(body, guide.as_ref(), walks)?);
            }
        }
        let mut maps = Vec::with_capacity(N);
        for views in views {
            maps.push(Self::of(views, [pixels[1] as usize, pixels[0] as usize])?);
        }
        maps.try_into().map_err(|_| none())
    }

    fn of(views: Vec<View>, size: [usize; 2]) -> Result<Self, ScanError> {
        let mean = |of: &dyn Fn(&View) -> f64| {
            views.iter().map(of).sum::<f64>() / views.len().max(1) as f64
        };
        let to_primary = mean(&|v| v.middle[0]) / mean(&|v| v.middle[1]);
        let rel_error = mean(&|v| v.rel_error * v.rel_error).sqrt();
        let estimate = Estimate::new(size, views.into_iter().map(|v| v.patch).collect())
            .ok_or_else(|| {
                let [rows, bins] = size;
                ScanError::Bad(format!(
                    "scatter must be given at one view or more, each {rows} × {bins} values, none \
                     negative"
                ))
            })?;
        Ok(Self { estimate, to_primary, rel_error })
    }
}

/// Scatter of one view.
struct View {
    patch: Patch,
    /// Scatter and primary of the middle patch.
    middle: [f64; 2],
    rel_error: f64,
}

impl View {
    fn new(specimen: &Specimen, scanner: &Scanner, angle: f64, scatter: &ScatterImage) -> Self {
        let [columns, rows] = scanner.panel.pixels;
        let mut patch = Patch { angle, value: Vec::new(), error: Vec::new() };
        for row in 0..rows {
            // Columns of the walks' panel run the other way.
            for bin in (0..columns).rev().map(|column| row * columns + column) {
                let open = primary_at(specimen, scanner, scanner.panel.place(bin, [0.5; 2]))[1];
                let reading = scatter.reading(bin as usize);
                patch.value.push((reading.mean / open) as f32);
                patch.error.push((reading.std_error / open) as f32);
            }
        }
        // The primary over all of the middle patch, so that no single bar decides.
        let middle = rows / 2 * columns + columns / 2;
        let at = |i: u32| {
            primary_at(
                specimen,
                scanner,
                scanner.panel.place(middle, [(f64::from(i) + 0.5) / 9.0, 0.5]),
            )[0]
        };
        let primary = (0..9).map(at).sum::<f64>() / 9.0;
        Self {
            patch,
            middle: [scatter.reading(middle as usize).mean, primary],
            rel_error: scatter.rel_error(),
        }
    }
}
