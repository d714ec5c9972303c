//! From where light and importance arrive at the picked point.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{Rect, Sense, TextureHandle, TextureOptions, Ui, Vec2, vec2};
use intrados_light::{
    Guide,
    plugin::{Learning, Lit},
    spread,
};
use intrados_transport::Side;

use crate::{
    Colours, Look, colours,
    fields::{self, Fields},
    number::significant,
};

/// Directions along a side of the square.
const N: u32 = 32;

/// The squares that are shown.
#[derive(Resource, Default)]
pub(crate) struct Directions {
    /// Which guide, which point of the picture, and in which colours.
    of: Option<(Arc<Guide>, Vec2, Colours)>,
    /// Of each field, and the values of its first and last colour.
    squares: [Option<(TextureHandle, [f32; 2])>; 2],
}

pub(crate) fn directions(
    InMut(ui): InMut<Ui>,
    learning: Res<Learning>,
    lit: Option<Res<Lit>>,
    fields: Res<Fields>,
    look: Res<Look>,
    mut shown: ResMut<Directions>,
) {
    let (Some(guide), Some(camera), Some(lit)) = (learning.guide(), learning.camera(), lit) else {
        ui.weak(tr!("Known once steering has learnt its fields."));
        return;
    };
    let at = fields.picked();
    let is_shown = shown.of.as_ref().is_some_and(|(of, point, colours)| {
        Arc::ptr_eq(of, guide) && *point == at && *colours == look.colours
    });
    if !is_shown {
        let camera = fields::camera(camera);
        let [x, y] =
            fields::pixel([camera.width as usize, camera.height as usize], at).map(|i| i as u32);
        shown.squares = Side::BOTH.map(|side| {
            let values = guide.directions(&lit.0, &camera, [x, y], side, N)?;
            let range = spread(&values);
            let image = fields::image(&values, N as usize, &look.colours.over(range, true));
            Some((ui.ctx().load_texture("directions", image, TextureOptions::NEAREST), range))
        });
        shown.of = Some((Arc::clone(guide), at, look.colours));
    }
    ui.columns(2, |columns| {
        for (side, ui) in Side::BOTH.into_iter().zip(columns) {
            square(ui, side, shown.squares[side as usize].as_ref());
        }
    });
    ui.weak(tr!(
        "At the point clicked in the picture, or its middle. Centre: along the normal; edge: \
         grazing; 1: as from everywhere alike."
    ));
}

fn square(ui: &mut Ui, side: Side, square: Option<&(TextureHandle, [f32; 2])>) {
    let (name, whole_name) = match side {
        Side::Primal => (tr!("Radiance"), tr!("Directions of the radiance field")),
        Side::Dual => (tr!("Importance"), tr!("Directions of the importance field")),
    };
    ui.label(name);
    let width = ui.available_width().min(160.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, width), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &whole_name));
    let Some((texture, [lo, hi])) = square else {
        ui.painter().rect_filled(rect, 0.0, colours::UNKNOWN);
        ui.weak(tr!("unknown here"));
        return;
    };
    let whole = Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
    ui.painter().image(texture.id(), rect, whole, egui::Color32::WHITE);
    response.on_hover_text(tr!(
        "The hemisphere as a square in which equal areas send equal irradiance if all directions \
         are alike (cosine law)"
    ));
    let [lo, hi] = [*lo, *hi].map(|x| significant(f64::from(x), 2));
    ui.weak(tr!("{} to {}", lo, hi));
}
