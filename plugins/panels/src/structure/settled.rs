//! The structure as it looks: the path-traced picture from where the structure is looked at, laid
//! over its preview as its error falls.

use bevy_ecs::{prelude::*, system::SystemParam};
use egui::{Align2, Color32, Rect, TextStyle, TextureHandle, Ui, pos2, vec2};
use intrados_scene::Camera;

use crate::{
    Look, Quantity, Statistics, Viewpoint,
    number::percent,
    picture::Picture,
    smooth::{self, Smoothed},
};

/// Relative standard error of a pixel at which nothing of the preview shows through.
const SETTLED: f64 = 0.25;

/// What the Render tab would show.
#[derive(SystemParam)]
pub(crate) struct Light<'w> {
    viewpoint: ResMut<'w, Viewpoint>,
    picture: ResMut<'w, Picture>,
    smoothed: ResMut<'w, Smoothed>,
    statistics: Res<'w, Statistics>,
    look: Res<'w, Look>,
}

/// Where the picture is, or will be, from.
#[derive(Default)]
pub(super) struct Settling {
    asked: Option<Camera>,
    /// Where the structure was looked at from in the last frame.
    before: Option<Camera>,
}

impl Light<'_> {
    /// The row that says whether it is smoothed.
    pub(super) fn tools(&mut self, ui: &mut Ui) {
        smooth::switch(ui, self.smoothed.bypass_change_detection());
    }
}

impl Settling {
    /// Lays the picture over what is in `rect`, as far as it is there; asks for it once nobody moves
    /// the structure any more.
    pub(super) fn show(&mut self, ui: &Ui, rect: Rect, camera: &Camera, light: &mut Light<'_>) {
        light.viewpoint.bypass_change_detection().is_seen = true;
        let density = ui.ctx().pixels_per_point();
        let side = |points: f32| (points * density).max(8.0) as u32;
        let wanted =
            Camera { width: side(rect.width()), height: side(rect.height()), ..camera.clone() };
        let is_held = ui.input(|i| i.pointer.any_down());
        let moves = self.before.replace(wanted.clone()).is_none_or(|before| before != wanted);
        if moves || is_held {
            ui.ctx().request_repaint();
            return;
        }
        let ink = ui.visuals().strong_text_color();
        if light.look.quantity != Quantity::Radiance {
            return say(ui, rect, ink, tr!("no light: the Render tab shows errors or a field"));
        }
        // Of a part of the picture there is not enough to lay over all of the structure.
        if self.asked.as_ref() != Some(&wanted) || light.viewpoint.is_part() {
            self.asked = Some(wanted.clone());
            light.viewpoint.go(wanted);
            return;
        }
        // The Render tab may have gone elsewhere since.
        let is_ours = light.viewpoint.camera() == Some(&wanted) && !light.viewpoint.is_preview();
        let Some(now) = light.statistics.now().filter(|_| is_ours) else {
            return say(ui, rect, ink, tr!("light is on its way"));
        };
        let noise = now.pixel_noise();
        let smoothed = light.smoothed.bypass_change_detection().texture(ui.ctx());
        let plain = light.picture.bypass_change_detection().texture(ui.ctx());
        let Some(texture) = smoothed.or(plain.map(TextureHandle::id)) else { return };
        let share = if noise.is_finite() { (SETTLED / noise).min(1.0) } else { 0.0 };
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let tint = Color32::from_white_alpha((255.0 * share) as u8);
        ui.painter().image(texture, rect, whole, tint);
        if smoothed.is_some() {
            smooth::mark(ui, rect);
        }
        let said = match noise.is_finite() {
            true => tr!("light, a pixel ± {}", percent(noise)),
            false => tr!("light is on its way"),
        };
        // Over whatever light there is.
        say(ui, rect, Color32::from_gray(235), said);
    }
}

/// Writes how the light fares into the corner of the picture.
fn say(ui: &Ui, rect: Rect, ink: Color32, said: String) {
    let font = TextStyle::Small.resolve(ui.style());
    let at = rect.right_bottom() - vec2(10.0, 8.0);
    ui.painter().text(at, Align2::RIGHT_BOTTOM, said, font, ink);
}
