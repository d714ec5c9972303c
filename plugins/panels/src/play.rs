//! Through the lives of the members, equilibrium by equilibrium: by single jumps, or by itself at a
//! steady pace.

use std::time::Duration;

use bevy_ecs::prelude::*;
use egui::Ui;

use crate::moment::{Courses, Moment, Timeline};

/// From one equilibrium to the next, s; where there are many, all of them take so long, but none is
/// shown so briefly that nobody sees it.
const STEP: f64 = 0.5;
const ALL: f64 = 30.0;
const BRIEFEST: f64 = 0.1;

/// Where to in the lives of the members.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jump {
    /// The first equilibrium.
    First,
    /// The one before.
    Back,
    /// The next one.
    Forward,
    /// The last one.
    Last,
}

/// Whether it goes on by itself.
#[derive(Resource, Debug, Default)]
pub(crate) struct Play {
    pub(crate) is_on: bool,
    /// Since when the equilibrium of now is shown, s by the clock of the frames.
    since: Option<f64>,
}

impl Timeline {
    /// Where a jump ends; none: it is there already.
    pub(crate) fn after(&self, jump: Jump, years: f64) -> Option<f64> {
        let forward = matches!(jump, Jump::Forward | Jump::Last);
        let next = self.beyond(years, forward)?;
        Some(match jump {
            Jump::Back | Jump::Forward => next,
            Jump::First => self.computed.first().copied()?,
            Jump::Last => self.computed.last().copied()?,
        })
    }
}

/// How long each of so many equilibria is shown, s.
fn pace(count: usize) -> f64 {
    (ALL / count.max(1) as f64).clamp(BRIEFEST, STEP)
}

/// Goes elsewhere; whoever does so wants to stay there.
pub(crate) fn jump(world: &mut World, to: Jump) {
    let years = world.resource::<Moment>().years;
    let there = world.resource::<Courses>().timeline.after(to, years);
    *world.resource_mut::<Play>() = Play::default();
    if let Some(years) = there {
        world.resource_mut::<Moment>().years = years;
    }
}

/// Begins to play, from the first equilibrium where it is at the last; or stops.
pub(crate) fn toggle(world: &mut World) {
    let years = world.resource::<Moment>().years;
    let timeline = &world.resource::<Courses>().timeline;
    let is_there = timeline.range().is_some();
    let is_over = timeline.after(Jump::Forward, years).is_none();
    let first = timeline.computed.first().copied().filter(|_| is_over && is_there);
    let was_on = world.resource::<Play>().is_on;
    *world.resource_mut::<Play>() = Play { is_on: is_there && !was_on, since: None };
    if let Some(first) = first.filter(|_| !was_on) {
        world.resource_mut::<Moment>().years = first;
    }
}

/// Goes on to the next equilibrium when it is time, and stops at the last. Nothing else asks for
/// frames meanwhile.
pub(crate) fn go_on(ui: &Ui, world: &mut World) {
    if !world.resource::<Play>().is_on {
        return;
    }
    let now = ui.input(|i| i.time);
    let years = world.resource::<Moment>().years;
    let timeline = &world.resource::<Courses>().timeline;
    let (next, pace) = (timeline.after(Jump::Forward, years), pace(timeline.computed.len()));
    let mut play = world.resource_mut::<Play>();
    let left = pace - (now - *play.since.get_or_insert(now));
    match next {
        None => *play = Play::default(),
        Some(_) if left > 0.0 => ui.ctx().request_repaint_after(Duration::from_secs_f64(left)),
        Some(next) => {
            play.since = Some(now);
            world.resource_mut::<Moment>().years = next;
            // What follows the moment does so before the next frame is drawn.
            ui.ctx().request_repaint();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timeline() -> Timeline {
        Timeline { computed: vec![-10.0, -9.9, 0.0, 20.0], ..Timeline::default() }
    }

    #[test]
    fn jumps_end_at_equilibria_and_go_nowhere_from_the_ends() {
        let after = |jump, years| timeline().after(jump, years);
        assert_eq!(after(Jump::Forward, -10.0), Some(-9.9));
        assert_eq!(after(Jump::Back, 0.0), Some(-9.9));
        assert_eq!((after(Jump::First, 0.0), after(Jump::Last, 0.0)), (Some(-10.0), Some(20.0)));
        assert_eq!((after(Jump::First, -10.0), after(Jump::Back, -10.0)), (None, None));
        assert_eq!((after(Jump::Last, 20.0), after(Jump::Forward, 20.0)), (None, None));
        assert_eq!(Timeline::default().after(Jump::First, 0.0), None);
    }

    #[test]
    fn few_equilibria_take_their_time_and_many_are_over_in_half_a_minute() {
        assert_eq!((pace(0), pace(4), pace(60)), (0.5, 0.5, 0.5));
        assert_eq!((pace(100), pace(10_000)), (0.3, 0.1));
    }

    fn world() -> World {
        let mut world = World::new();
        world.init_resource::<Moment>();
        world.init_resource::<Play>();
        world.init_resource::<Courses>();
        world.resource_mut::<Courses>().timeline = timeline();
        world
    }

    /// One frame at this time, s; the years then.
    fn frame(ctx: &egui::Context, world: &mut World, time: f64) -> f64 {
        let input = egui::RawInput { time: Some(time), ..egui::RawInput::default() };
        let _ = ctx.run_ui(input, |ui| go_on(ui, world));
        world.resource::<Moment>().years
    }

    #[test]
    fn playing_steps_by_the_clock_and_stops_at_the_end() {
        let (ctx, mut world) = (egui::Context::default(), world());
        assert_eq!(frame(&ctx, &mut world, 0.0), 0.0, "nobody plays");
        jump(&mut world, Jump::First);
        toggle(&mut world);
        let times = [1.0, 1.4, 1.6, 1.7, 2.2, 2.8];
        let years = times.map(|time| frame(&ctx, &mut world, time));
        assert_eq!(years, [-10.0, -10.0, -9.9, -9.9, 0.0, 20.0]);
        assert!(world.resource::<Play>().is_on);
        assert_eq!(frame(&ctx, &mut world, 3.0), 20.0);
        assert!(!world.resource::<Play>().is_on, "it stops at the end");
        toggle(&mut world);
        assert_eq!(frame(&ctx, &mut world, 4.0), -10.0, "from its end it begins anew");
        jump(&mut world, Jump::Forward);
        assert!(!world.resource::<Play>().is_on, "whoever goes elsewhere stays there");
    }
}
