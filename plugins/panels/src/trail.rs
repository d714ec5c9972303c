//! Where one has been: which member was selected, from where the structure was looked at, which tabs
//! were in front. One goes back and forward through it as in a browser.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use intrados_scene::{Camera, plugin::CurrentScene};

use crate::{Selection, structure::Structure, workspace::Desk};

/// So many stops can be come back to.
const MOST: usize = 100;

/// A place that was left.
#[derive(Debug, Clone)]
pub(crate) struct Stop {
    /// Id of the member that was selected.
    member: Option<String>,
    /// Where the structure was looked at from.
    camera: Option<Camera>,
    /// Panels that were in sight.
    panels: Vec<String>,
}

impl Stop {
    /// Whether one sees the same there. How large a picture is, is no matter.
    fn is_as(&self, other: &Self) -> bool {
        let place = |camera: &Camera| (camera.position, camera.target, camera.fov_deg);
        let [own, theirs] = [self, other].map(|stop| stop.camera.as_ref().map(place));
        (own, &self.member, &self.panels) == (theirs, &other.member, &other.panels)
    }
}

/// The way that one has come, and the way that one has gone back.
#[derive(Resource, Debug, Default)]
pub(crate) struct Trail {
    /// The scene's file.
    of: PathBuf,
    before: Vec<Stop>,
    after: Vec<Stop>,
}

impl Trail {
    /// Whether there is something of this scene to go back to, and to go forward to.
    pub(crate) fn ways(&self, scene: &Path) -> [bool; 2] {
        [&self.before, &self.after].map(|stops| self.of == scene && !stops.is_empty())
    }

    /// Of another scene there is no way back.
    fn enter(&mut self, scene: &Path) {
        if self.of != scene {
            *self = Self { of: scene.to_owned(), ..Self::default() };
        }
    }

    /// Goes elsewhere: what lay ahead is gone.
    fn leave(&mut self, stop: Stop) {
        self.after.clear();
        self.before.push(stop);
        let surplus = self.before.len().saturating_sub(MOST);
        self.before.drain(..surplus);
    }

    /// The last place that differs from this one, which can be come back to.
    fn turn(&mut self, here: Stop, forward: bool) -> Option<Stop> {
        let (from, to) = match forward {
            true => (&mut self.after, &mut self.before),
            false => (&mut self.before, &mut self.after),
        };
        while let Some(stop) = from.pop() {
            if !stop.is_as(&here) {
                to.push(here);
                return Some(stop);
            }
        }
        None
    }
}

/// Where one is now.
pub(crate) fn here(world: &World) -> Option<Stop> {
    let scene = &world.get_resource::<CurrentScene>()?.0;
    let member = world.resource::<Selection>().0.and_then(|index| scene.members.get(index));
    Some(Stop {
        member: member.map(|m| m.id.clone()),
        camera: world.resource::<Structure>().camera().cloned(),
        panels: world.resource::<Desk>().in_sight(),
    })
}

/// Something has been done: where one was is a stop, if one goes elsewhere by it. What a hand moves
/// is the same place still.
pub(crate) fn leave(world: &mut World, stop: Stop) {
    let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else { return };
    let member = world.resource::<Selection>().0.and_then(|index| scene.members.get(index));
    let is_elsewhere = member.map(|m| &m.id) != stop.member.as_ref()
        || world.resource::<Structure>().is_called()
        || world.resource::<Desk>().is_turning();
    if is_elsewhere {
        let mut trail = world.resource_mut::<Trail>();
        trail.enter(&scene.path);
        trail.leave(stop);
    }
}

/// Goes back to where one was, or forward again.
pub(crate) fn go(world: &mut World, forward: bool) {
    let Some(scene) = world.get_resource::<CurrentScene>().map(|s| s.0.clone()) else { return };
    let Some(here) = here(world) else { return };
    let mut trail = world.resource_mut::<Trail>();
    trail.enter(&scene.path);
    let Some(stop) = trail.turn(here, forward) else { return };
    let member = stop.member.and_then(|id| scene.members.iter().position(|m| m.id == id));
    world.resource_mut::<Selection>().set_if_neq(Selection(member));
    if let Some(camera) = &stop.camera {
        world.resource_mut::<Structure>().follow(&scene, camera);
    }
    let mut desk = world.resource_mut::<Desk>();
    for panel in stop.panels {
        // What was closed since stays closed.
        if desk.is_open(&panel) && !desk.has_drawn(&panel) {
            desk.open(&panel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(member: &str) -> Stop {
        Stop { member: Some(member.into()), camera: None, panels: vec!["Structure".into()] }
    }

    fn name(stop: Option<Stop>) -> Option<String> {
        stop.and_then(|stop| stop.member)
    }

    #[test]
    fn one_goes_back_and_forward_and_elsewhere_from_there() {
        let scene = Path::new("/a/scene.ron");
        let mut trail = Trail::default();
        trail.enter(scene);
        trail.leave(stop("a"));
        trail.leave(stop("b"));
        assert_eq!(trail.ways(scene), [true, false]);
        assert_eq!(name(trail.turn(stop("c"), false)).as_deref(), Some("b"));
        assert_eq!(name(trail.turn(stop("b"), false)).as_deref(), Some("a"));
        assert!(trail.turn(stop("a"), false).is_none());
        assert_eq!(name(trail.turn(stop("a"), true)).as_deref(), Some("b"));
        // Elsewhere from there: what lay ahead is gone.
        trail.leave(stop("b"));
        assert_eq!(trail.ways(scene), [true, false]);
        assert_eq!(name(trail.turn(stop("d"), false)).as_deref(), Some("b"));
        trail.enter(Path::new("/b/scene.ron"));
        assert_eq!(trail.ways(Path::new("/b/scene.ron")), [false, false]);
    }

    #[test]
    fn where_one_is_already_is_passed_over_and_the_oldest_are_forgotten() {
        let mut trail = Trail::default();
        trail.leave(stop("a"));
        trail.leave(stop("b"));
        trail.leave(stop("b"));
        assert_eq!(name(trail.turn(stop("b"), false)).as_deref(), Some("a"));
        (0..3 * MOST).for_each(|k| trail.leave(stop(&k.to_string())));
        assert_eq!(trail.before.len(), MOST);
    }
}
