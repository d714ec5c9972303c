//! The camera that the user moves, and how large a film it gets.

use bevy_ecs::prelude::*;
use egui::{Rect, vec2};
use intrados_light::{
    Render, RenderSettings, Sides, View,
    plugin::{ActiveCamera, Lit},
};
use intrados_scene::{Camera, plugin::SceneChanged};

use crate::{Look, Refine, orbit, picture::Picture};

/// Largest film in the window, pixels.
const FULL: u32 = 1 << 20;
/// Film while the camera moves: a frame's passes fill it.
const PREVIEW: u32 = 160 * 120;
/// Samples per pixel of the small film before the large one takes over.
const PREVIEW_SAMPLES: f64 = 6.0;

/// The camera that the user moves.
#[derive(Resource, Debug, Default)]
pub struct Viewpoint {
    /// The scene's camera, to come back to.
    pub home: Option<Camera>,
    camera: Option<Camera>,
    /// Whether it has been moved since the last frame.
    moved: bool,
    /// Whether a button is held and more is to come.
    pub(crate) dragged: bool,
    /// Whether another panel than the Render tab has shown its picture since the last frame.
    pub(crate) is_seen: bool,
    /// The small film is in use; what [`RenderSettings`] had for sides before.
    preview: Option<Sides>,
    /// The large film has been asked for and is not there yet.
    awaits: bool,
    /// What this plugin last asked for.
    sent: Option<Camera>,
    /// The part of the large film that alone is refined: its first column and row, and the first
    /// ones behind it.
    part: Option<[[u32; 2]; 2]>,
    /// Whether it is another one than in the last frame.
    is_cut: bool,
}

impl Viewpoint {
    /// The camera at its full size.
    #[must_use]
    pub fn camera(&self) -> Option<&Camera> {
        self.camera.as_ref()
    }

    /// Looks through `camera` from now on: the picture begins anew.
    pub fn go(&mut self, camera: Camera) {
        self.camera = Some(camera);
        self.moved = true;
        (self.part, self.is_cut) = (None, false);
    }

    /// Refines only these pixels of the large film from now on, until the camera moves.
    pub(crate) fn refine_only(&mut self, part: [[u32; 2]; 2]) {
        (self.part, self.is_cut) = (Some(part), true);
    }

    /// Refines all of the picture again: it begins anew. False if it is all refined.
    pub(crate) fn refine_all(&mut self) -> bool {
        let camera = self.camera.clone().filter(|_| self.part.is_some());
        let was_part = camera.is_some();
        camera.into_iter().for_each(|camera| self.go(camera));
        was_part
    }

    /// Whether a part of the picture alone is refined.
    pub(crate) fn is_part(&self) -> bool {
        self.part.is_some()
    }

    /// Whether a film of this camera is what was asked for last.
    pub(crate) fn has_sent(&self, camera: &Camera) -> bool {
        !self.moved && !self.is_cut && self.sent.as_ref() == Some(camera)
    }

    /// Pixels of the large film, across and down.
    pub(crate) fn pixels(&self) -> Option<[u32; 2]> {
        let large = orbit::resized(self.camera.as_ref()?, FULL);
        Some([large.width, large.height])
    }

    /// Where the part that alone is refined lies in a picture in `rect`.
    pub(crate) fn place_of_part(&self, rect: Rect) -> Option<Rect> {
        let (ends, size) = (self.part?, self.pixels()?);
        let place = |[x, y]: [u32; 2]| {
            rect.lerp_inside(vec2(x as f32 / size[0] as f32, y as f32 / size[1] as f32))
        };
        let [from, to] = ends.map(place);
        Some(Rect::from_min_max(from, to))
    }

    /// Whether the film is the small one for the moment.
    #[must_use]
    pub fn is_preview(&self) -> bool {
        self.preview.is_some() || self.awaits
    }

    fn send(&mut self, active: &mut ActiveCamera, camera: Camera) {
        self.sent = Some(camera.clone());
        active.0 = camera;
    }
}

/// Takes over the large film once it is there, and a camera that somebody else has set: the one of
/// a new scene. The same scene with other damage brings none: what is active then is our own.
pub(crate) fn adopt(
    mut changed: MessageReader<SceneChanged>,
    mut is_coming: Local<bool>,
    lit: Option<Res<Lit>>,
    render: Option<Res<Render>>,
    active: Option<Res<ActiveCamera>>,
    mut viewpoint: ResMut<Viewpoint>,
    mut look: ResMut<Look>,
    mut picture: ResMut<Picture>,
) {
    *is_coming |= changed.read().last().is_some();
    let (Some(lit), Some(active)) = (lit, active) else { return };
    if viewpoint.awaits && render.is_some_and(|r| Some(r.camera()) == viewpoint.sent.as_ref()) {
        viewpoint.awaits = false;
        // Under a part there is no small film of its own.
        if !viewpoint.is_part() {
            picture.keep_as_underlay();
        }
    }
    let is_new = lit.is_changed() && std::mem::take(&mut *is_coming);
    let is_own = viewpoint.sent.as_ref() == Some(&active.0);
    if !is_new && (!active.is_changed() || is_own) {
        return;
    }
    if is_new {
        viewpoint.home = Some(active.0.clone());
        look.exposure = active.0.exposure;
        look.order = None;
        picture.forget();
    }
    viewpoint.go(active.0.clone());
}

/// Gives the film the camera that is wanted: a small one while it moves, then the large one.
pub(crate) fn steer(
    mut viewpoint: ResMut<Viewpoint>,
    active: Option<ResMut<ActiveCamera>>,
    mut settings: ResMut<RenderSettings>,
    render: Option<Res<Render>>,
    look: Res<Look>,
    mut refine: ResMut<Refine>,
) {
    let (Some(mut active), Some(camera)) = (active, viewpoint.camera.clone()) else { return };
    if let Some([from, to]) = viewpoint.part.filter(|_| viewpoint.is_cut) {
        (viewpoint.is_cut, viewpoint.awaits) = (false, true);
        refine.paused = false;
        viewpoint.send(&mut active, orbit::resized(&camera, FULL).cropped(from, to));
        return;
    }
    if std::mem::take(&mut viewpoint.moved) {
        viewpoint.awaits = false;
        refine.paused = false;
        let small = orbit::resized(&camera, PREVIEW);
        // Of a picture that is small anyway, no smaller one is needed: it would be drawn twice.
        if u64::from(camera.width) * u64::from(camera.height) > 4 * u64::from(PREVIEW) {
            if viewpoint.preview.is_none() {
                viewpoint.preview = Some(settings.sides);
                // One side alone: no pilot, and all passes go to what is seen.
                settings.sides = if look.view == View::Dual { Sides::Dual } else { Sides::Primal };
            }
            viewpoint.send(&mut active, small);
        } else {
            viewpoint.send(&mut active, orbit::resized(&camera, FULL));
        }
        return;
    }
    let enough = render.is_some_and(|r| {
        r.samples_per_pixel() >= PREVIEW_SAMPLES && Some(r.camera()) == viewpoint.sent.as_ref()
    });
    if let Some(sides) = viewpoint.preview.filter(|_| enough && !viewpoint.dragged) {
        viewpoint.preview = None;
        viewpoint.awaits = true;
        settings.sides = sides;
        viewpoint.send(&mut active, orbit::resized(&camera, FULL));
    }
}
