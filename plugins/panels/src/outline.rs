//! The selected member's outline over the picture.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{Color32, ColorImage, TextureHandle, TextureOptions};
use intrados_light::{LitScene, plugin::Lit};
use intrados_scene::{Camera, Ray};
use intrados_stage::{Cancelled, Job, Jobs, Task};

use crate::{Look, Selection, Viewpoint, colours, orbit};

/// Pixels of the map of members: an outline needs no more.
const PIXELS: u32 = 200_000;

/// Which member every pixel shows; made off the frame once the camera stands still.
#[derive(Resource, Default)]
pub(crate) struct Outline {
    task: Option<Task<Result<Map, Cancelled>>>,
    map: Option<Map>,
    /// What `map` or `task` is of.
    of: Option<(Arc<LitScene>, Camera)>,
    /// The outline of this member, ready to be uploaded.
    drawn: Option<usize>,
    pixels: Option<ColorImage>,
    texture: Option<TextureHandle>,
}

/// Index of the member plus one, 0 for none, row-major.
struct Map {
    width: usize,
    height: usize,
    members: Vec<u32>,
}

impl Outline {
    /// The texture to lay over the picture, if the selected member is known to be in it.
    pub(crate) fn texture(&mut self, ctx: &egui::Context) -> Option<&TextureHandle> {
        self.drawn?;
        if let Some(pixels) = self.pixels.take() {
            self.texture = Some(ctx.load_texture("outline", pixels, TextureOptions::LINEAR));
        }
        self.texture.as_ref()
    }

    /// Whether the map is being made.
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }
}

pub(crate) fn trace(
    lit: Option<Res<Lit>>,
    viewpoint: Res<Viewpoint>,
    selection: Res<Selection>,
    look: Res<Look>,
    mut outline: ResMut<Outline>,
    mut jobs: ResMut<Jobs>,
) {
    let (Some(lit), Some(camera)) = (lit, viewpoint.camera()) else {
        return outline.set_if_neq_none();
    };
    let is_of_now = outline.of.as_ref().is_some_and(|(l, c)| Arc::ptr_eq(l, &lit.0) && c == camera);
    if !is_of_now && (outline.of.is_some() || outline.map.is_some()) {
        outline.set_if_neq_none();
    }
    let Some(selected) = selection.0.filter(|_| look.outline) else {
        outline.drawn = None;
        return;
    };
    if outline.of.is_none() && !viewpoint.is_preview() && !viewpoint.dragged {
        let (scene, camera) = (Arc::clone(&lit.0), camera.clone());
        outline.of = Some((Arc::clone(&scene), camera.clone()));
        // Not in the list of jobs: it is over before anybody could read it.
        outline.task =
            Some(Task::spawn_unlisted(jobs.bypass_change_detection(), "outlining", move |job| {
                map(&scene, &camera, job)
            }));
    }
    if let Some(done) = Task::take(&mut outline.task) {
        outline.map = done.ok().and_then(Result::ok);
    }
    if outline.drawn != Some(selected)
        && let Some(pixels) = outline.map.as_ref().map(|map| edge(map, selected as u32 + 1))
    {
        (outline.pixels, outline.drawn) = (Some(pixels), Some(selected));
    }
}

impl Outline {
    fn set_if_neq_none(&mut self) {
        if self.of.is_some() || self.map.is_some() {
            *self = Self::default();
        }
    }
}

fn map(lit: &LitScene, camera: &Camera, job: &Job) -> Result<Map, Cancelled> {
    let camera = orbit::resized(camera, PIXELS);
    let (width, height) = (camera.width as usize, camera.height as usize);
    let mut members = Vec::with_capacity(width * height);
    for y in 0..height {
        job.step(y, height)?;
        members.extend((0..width).map(|x| {
            let ray = Ray::new(
                camera.position,
                camera.direction(x as f32 + 0.5, y as f32 + 0.5),
                f32::INFINITY,
            );
            lit.pick(&ray)
                .and_then(|(object, _)| lit.scene.objects.get(object)?.member)
                .map_or(0, |m| m as u32 + 1)
        }));
    }
    Ok(Map { width, height, members })
}

/// Pixels of `member` next to others are drawn, the ones around them in black, so that the line is
/// seen on any ground.
fn edge(map: &Map, member: u32) -> ColorImage {
    let at = |x: isize, y: isize| {
        let inside = x >= 0 && y >= 0 && (x as usize) < map.width && (y as usize) < map.height;
        inside && map.members[y as usize * map.width + x as usize] == member
    };
    let near = |x: isize, y: isize, reach: isize, what: bool| {
        (-reach..=reach).any(|dy| (-reach..=reach).any(|dx| at(x + dx, y + dy) == what))
    };
    let colour = |i: usize| {
        let (x, y) = ((i % map.width) as isize, (i / map.width) as isize);
        match at(x, y) {
            true if near(x, y, 1, false) => colours::SELECTED,
            false if near(x, y, 1, true) => Color32::from_black_alpha(160),
            _ => Color32::TRANSPARENT,
        }
    };
    ColorImage::new([map.width, map.height], (0..map.members.len()).map(colour).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_rim_of_a_member_is_drawn() {
        let mut members = vec![0; 49];
        (2..5).for_each(|y| (2..5).for_each(|x| members[y * 7 + x] = 3));
        let image = edge(&Map { width: 7, height: 7, members }, 3);
        let is = |x: usize, y: usize, c: Color32| image.pixels[y * 7 + x] == c;
        assert!(
            is(2, 2, colours::SELECTED)
                && is(3, 3, Color32::TRANSPARENT)
                && is(0, 0, Color32::TRANSPARENT)
        );
        assert!(is(1, 1, Color32::from_black_alpha(160)));
    }
}
