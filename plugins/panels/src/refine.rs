//! When the film advances: paused, resting at its target, or a slice of every frame.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use intrados_light::{
    Render, RenderSettings,
    plugin::{ActiveCamera, Lit, Upcoming},
};
use intrados_stage::Pace;

use crate::{Look, Statistics, Viewpoint, Workspace, workspace::Desk};

/// Pause, target error and time spent.
#[derive(Resource, Debug, Clone)]
pub struct Refine {
    /// Whether the user has paused it.
    pub paused: bool,
    /// Relative standard error of the picture's mean at which refining rests.
    pub target: f64,
    /// How long the film of now has been refined, wall seconds.
    pub seconds: f64,
    slice: Option<Duration>,
    since: Option<Instant>,
}

impl Refine {
    pub(crate) fn new(slice: Option<Duration>) -> Self {
        Self { paused: false, target: 2e-4, seconds: 0.0, slice, since: None }
    }

    /// Whether the target has been reached, by an error bar that may be trusted.
    #[must_use]
    pub fn is_there(&self, statistics: &Statistics) -> bool {
        statistics.now().is_some_and(|now| now.error() <= self.target && now.trust.is_settled())
    }

    /// Seconds that are left until the target, by the 1/√n law: a relative error r after t seconds
    /// becomes r* after t (r/r*)².
    #[must_use]
    pub(crate) fn seconds_left(&self, error: f64) -> f64 {
        (self.seconds * ((error / self.target).powi(2) - 1.0)).max(0.0)
    }
}

/// Sets the [`Pace`] of this frame. Frames that sum up the whole film, or develop all of it, get
/// one step only. Where an inspector works and nobody sees the picture, it rests, and the cores are
/// the prediction's.
pub(crate) fn share_frame(
    refine: Res<Refine>,
    desk: Res<Desk>,
    statistics: Res<Statistics>,
    mut viewpoint: ResMut<Viewpoint>,
    look: Res<Look>,
    mut pace: ResMut<Pace>,
) {
    let is_seen = std::mem::take(&mut viewpoint.bypass_change_detection().is_seen)
        || desk.has_drawn("Render");
    let is_hidden = desk.shown() == Workspace::Inspector && !is_seen;
    let rest =
        refine.paused || is_hidden || !viewpoint.is_preview() && refine.is_there(&statistics);
    let busy = !viewpoint.is_preview() && (statistics.is_due() || look.is_changed());
    let wanted = match refine.slice {
        _ if rest => Pace::Rest,
        None => Pace::Passes(1),
        // At least one step is run whatever the slice.
        Some(_) if busy => Pace::Within(Duration::ZERO),
        Some(slice) => Pace::Within(slice),
    };
    pace.set_if_neq(wanted);
}

/// Counts the time that went into the film of now.
pub(crate) fn keep_time(
    mut refine: ResMut<Refine>,
    pace: Res<Pace>,
    render: Option<Res<Render>>,
    lit: Option<Res<Lit>>,
    camera: Option<Res<ActiveCamera>>,
    settings: Res<RenderSettings>,
    upcoming: Res<Upcoming>,
) {
    // What restarts a film restarts its clock.
    if upcoming.is_coming()
        || settings.is_changed()
        || lit.is_some_and(|l| l.is_changed())
        || camera.is_some_and(|c| c.is_changed())
    {
        refine.seconds = 0.0;
    }
    let now = Instant::now();
    let running = render.is_some() && *pace != Pace::Rest;
    if let Some(since) = refine.since.filter(|_| running) {
        refine.seconds += now.duration_since(since).as_secs_f64();
    }
    refine.since = running.then_some(now);
}
