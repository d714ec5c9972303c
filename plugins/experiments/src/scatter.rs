//! Scatter behind a specimen: at a few views, on a coarse grid of the panel, interpolated. Who
//! makes the scans and who corrects them use the same walks, through other specimens, with other
//! spectra and seeds.

use std::f64::consts::{FRAC_PI_2, TAU};

use intrados_stage::{Job, random::Key};
use intrados_transport::{Schedule, Steering};
use intrados_xray::{
    correct::{Estimate, Patch},
    physics::Spectrum,
    primary::primary_at,
    scanner::{Beam, Response, Scanner},
    scatter::image,
    specimen::Specimen,
    steer::learn,
};

use super::ExperimentError;

/// Height of the strip of the panel on which scatter is looked for, m.
const STRIP: f64 = 0.01;
/// How long is learnt in each view.
const LESSONS: Schedule = Schedule { first: 2048, rounds: 3 };

/// Tube and panel as walks need them.
#[derive(Debug, Clone)]
pub(super) struct Head {
    pub(super) spectrum: Spectrum,
    pub(super) response: Response,
    /// From the source to the axis and to the panel, m.
    pub(super) distances: [f64; 2],
    /// Width of the panel and height of the beam on it, m.
    pub(super) lit: [f64; 2],
    /// Diameter of the focal spot, m.
    pub(super) spot: f64,
}

/// How much is done for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScatterEffort {
    /// Views of a turn.
    pub views: usize,
    /// Columns of the strip.
    pub columns: u32,
    /// Walks from the tube in each view.
    pub walks: u64,
    /// Pixels that each collision is linked with.
    pub links: usize,
    /// Whether the dual process steers them.
    pub steered: bool,
}

/// Scatter over the open beam.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// By view and place on the panel.
    pub estimate: Estimate,
    /// Over the primary in the middle of the panel, mean of the views.
    pub to_primary: f64,
    /// Root mean square of the relative standard errors.
    pub rel_error: f64,
}

impl Head {
    fn scanner(&self, columns: u32, angle: f64) -> Scanner {
        let [axis, panel] = self.distances;
        let beam = Beam::symmetric(0.5 * self.lit[0] / panel, 0.5 * self.lit[1] / panel);
        let pitch = [self.lit[0] / f64::from(columns), STRIP.min(self.lit[1])];
        let mut scanner =
            Scanner::new(axis, panel - axis, [columns, 1], pitch, self.spectrum.clone(), beam);
        scanner.spot = self.spot;
        scanner.panel.response = self.response.clone();
        scanner.turned(angle + FRAC_PI_2)
    }

    /// Scatter behind `specimen`.
    pub(super) fn scatter(
        &self,
        specimen: &Specimen,
        effort: ScatterEffort,
        seed: u64,
        job: &Job,
    ) -> Result<Scatter, ExperimentError> {
        let (mut patches, mut middle, mut squares) = (Vec::new(), [0.0; 2], 0.0);
        for view in 0..effort.views {
            let angle = TAU * view as f64 / effort.views as f64;
            let scanner = self.scanner(effort.columns, angle);
            let guide = match effort.steered {
                true => Some(learn(
                    specimen,
                    &scanner,
                    effort.links,
                    seed ^ view as u64,
                    LESSONS,
                    Steering::On,
                    job,
                )?),
                false => None,
            };
            let walk = Key::new(seed, view as u64).bits(0).into();
            let seen =
                image(specimen, &scanner, guide.as_ref(), effort.links, effort.walks, walk, job)?;
            let mut patch = Patch { angle, value: Vec::new(), error: Vec::new() };
            // Columns of the walks' panel run the other way.
            for column in (0..effort.columns).rev() {
                let [_, open] =
                    primary_at(specimen, &scanner, scanner.panel.place(column, [0.5; 2]));
                let reading = seen.reading(column as usize);
                patch.value.push((reading.mean / open) as f32);
                patch.error.push((reading.std_error / open) as f32);
            }
            let centre = effort.columns / 2;
            middle[0] += seen.reading(centre as usize).mean;
            middle[1] += (0..9)
                .map(|i| {
                    primary_at(
                        specimen,
                        &scanner,
                        scanner.panel.place(centre, [(f64::from(i) + 0.5) / 9.0, 0.5]),
                    )[0]
                })
                .sum::<f64>()
                / 9.0;
            squares += seen.rel_error().powi(2);
            patches.push(patch);
        }
        let estimate = Estimate::new([1, effort.columns as usize], patches)
            .ok_or_else(|| ExperimentError::Scan("a patch of scatter is no number".into()))?;
        Ok(Scatter {
            estimate,
            to_primary: middle[0] / middle[1],
            rel_error: (squares / effort.views as f64).sqrt(),
        })
    }
}
