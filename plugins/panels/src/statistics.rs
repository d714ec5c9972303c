//! Readings of the picture and of the meters, summed up a few times a second, and how they came to
//! be.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use intrados_light::{Measurement, MeterReading, Render, Summary, Trust, View};
use intrados_scene::Camera;
use intrados_transport::{Side, WalkEstimate, figure_of_merit};

use crate::{Viewpoint, lang::fixed};

/// How often the film is summed up.
const EVERY: Duration = Duration::from_millis(500);
/// Entries of the history; when it is full, every other one goes.
const HISTORY: usize = 400;

/// What the film and the meters say.
#[derive(Resource, Debug, Clone, Default)]
pub struct Statistics {
    now: Option<Now>,
    history: Vec<Entry>,
    /// Readings of all meters.
    pub meters: Vec<MeterReading>,
    /// Figure of merit that the last unsteered picture's mean had, and its camera.
    unsteered: Option<(Camera, f64)>,
    at: Option<Instant>,
}

/// What the film says now.
#[derive(Debug, Clone)]
pub struct Now {
    /// Mean luminance of the picture by primal walks.
    pub primal: Option<WalkEstimate>,
    /// By dual walks.
    pub dual: Option<WalkEstimate>,
    /// By both.
    pub combined: WalkEstimate,
    /// Duality gap in standard errors.
    pub z: Option<f64>,
    /// Walks on both sides.
    pub walks: u64,
    /// CPU-seconds.
    pub cpu_seconds: f64,
    /// Walks per pixel, the larger of the sides'.
    pub samples_per_pixel: f64,
    /// Pixels of the film.
    pub pixels: usize,
    /// Weight of the primal side in the combination.
    pub share: f64,
    /// Whether the error bar of the combination may be trusted.
    pub trust: Trust,
    /// Whether both sides' error bars may be trusted, however little one weighs.
    pub both_converged: bool,
}

impl Now {
    /// Relative standard error of the combined mean.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.combined.rel_error()
    }

    /// Which side the combination is made of.
    #[must_use]
    pub(crate) fn mixture(&self) -> String {
        match (self.primal, self.dual) {
            (Some(_), Some(_)) if self.share >= 1.0 => {
                tr!("primal alone: the dual would make it worse")
            }
            (Some(_), Some(_)) if self.share <= 0.0 => {
                tr!("dual alone: the primal would make it worse")
            }
            (Some(_), Some(_)) => tr!(
                "{} % primal, {} % dual",
                fixed(100.0 * self.share, 0),
                fixed(100.0 * (1.0 - self.share), 0)
            ),
            (Some(_), None) => tr!("primal alone: the dual is not walked"),
            (None, Some(_)) => tr!("dual alone: the primal is not walked"),
            (None, None) => tr!("nothing is walked"),
        }
    }

    /// The reading of a view.
    #[must_use]
    pub fn reading(&self, view: View) -> Option<WalkEstimate> {
        match view {
            View::Primal => self.primal,
            View::Dual => self.dual,
            View::Combined => Some(self.combined),
        }
    }

    /// What a single pixel's relative error is, about: the mean's, times the root of the pixels
    /// that share it.
    #[must_use]
    pub(crate) fn pixel_noise(&self) -> f64 {
        self.error() * (self.pixels as f64).sqrt()
    }
}

/// One point of the convergence plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entry {
    /// CPU-seconds.
    pub cpu_seconds: f64,
    /// Relative standard errors: primal, dual, combined.
    pub errors: [Option<f64>; 3],
    /// Duality gap in standard errors.
    pub z: Option<f64>,
}

impl Statistics {
    /// What the film says, if it has been summed up yet.
    #[must_use]
    pub fn now(&self) -> Option<&Now> {
        self.now.as_ref()
    }

    /// How it came to that.
    #[must_use]
    pub(crate) fn history(&self) -> &[Entry] {
        &self.history
    }

    /// Figure of merit that the mean of an unsteered picture through `camera` had when it was left,
    /// 1/(relVar · CPU-seconds).
    #[must_use]
    pub(crate) fn unsteered(&self, camera: &Camera) -> Option<f64> {
        self.unsteered.as_ref().filter(|(of, _)| of == camera).map(|(_, merit)| *merit)
    }

    /// Weight of the primal side in a picture of both, as last summed up; before that, as planned.
    #[must_use]
    pub fn share(&self, render: &Render) -> f64 {
        self.now.as_ref().map_or_else(|| render.planned_share(), |now| now.share)
    }

    /// Whether the film would be summed up in this frame.
    pub(crate) fn is_due(&self) -> bool {
        self.at.is_none_or(|at| at.elapsed() >= EVERY)
    }

    fn put(&mut self, entry: Entry) {
        if self.history.last().is_some_and(|last| entry.cpu_seconds <= last.cpu_seconds) {
            return;
        }
        if self.history.len() >= HISTORY {
            let mut keep = false;
            self.history.retain(|_| {
                keep = !keep;
                keep
            });
        }
        self.history.push(entry);
    }
}

/// Sums up the film and the meters, when it is time.
pub(crate) fn observe(
    render: Option<Res<Render>>,
    measurement: Option<Res<Measurement>>,
    viewpoint: Res<Viewpoint>,
    mut statistics: ResMut<Statistics>,
) {
    let Some(render) = render else {
        if statistics.now.is_some() || !statistics.meters.is_empty() {
            *statistics = Statistics::default();
        }
        return;
    };
    let walks = render.exposures().iter().flatten().map(|e| e.walks).sum();
    if viewpoint.is_preview() || statistics.now.as_ref().is_some_and(|now| walks < now.walks) {
        // Of the small film nothing is said: its mean is another camera's.
        (statistics.now, statistics.at) = (None, None);
        statistics.history.clear();
    }
    let fresh = statistics.now.as_ref().is_none_or(|now| now.walks != walks);
    if viewpoint.is_preview() || walks == 0 || !fresh || !statistics.is_due() {
        return;
    }
    let now = sum_up(&render, walks);
    let error =
        |r: &Option<WalkEstimate>| r.map(|r| r.rel_error()).filter(|e| e.is_finite() && *e > 0.0);
    statistics.put(Entry {
        cpu_seconds: now.cpu_seconds,
        errors: [error(&now.primal), error(&now.dual), error(&Some(now.combined))],
        z: now.z,
    });
    if render.exposures().iter().flatten().all(|e| e.field == 0) {
        let merit = figure_of_merit(now.error(), now.cpu_seconds);
        statistics.unsteered = merit.is_finite().then(|| (render.camera().clone(), merit));
    }
    statistics.now = Some(now);
    statistics.meters = measurement.map(|m| m.readings()).unwrap_or_default();
    statistics.at = Some(Instant::now());
}

fn sum_up(render: &Render, walks: u64) -> Now {
    let Summary { sides: [primal, dual], combined, share, duality_z, trust } = render.summary();
    let both_converged = Side::BOTH
        .into_iter()
        .filter_map(|side| render.exposure(side)?.scores.first())
        .all(|s| s.converged().holds());
    Now {
        primal,
        dual,
        combined,
        z: duality_z,
        walks,
        cpu_seconds: render.cpu_seconds(),
        samples_per_pixel: render.samples_per_pixel(),
        pixels: render.camera().width as usize * render.camera().height as usize,
        share,
        trust,
        both_converged,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_history_keeps_its_ends() {
        let mut statistics = Statistics::default();
        for k in 0..HISTORY + 50 {
            statistics.put(Entry { cpu_seconds: 1.0 + k as f64, errors: [None; 3], z: None });
        }
        assert!(statistics.history.len() < HISTORY);
        assert_eq!(statistics.history[0].cpu_seconds, 1.0);
        assert_eq!(statistics.history.last().map(|e| e.cpu_seconds), Some((HISTORY + 50) as f64));
    }
}
