//! Which way the axes go, in a corner of the picture.

use egui::{Align2, Color32, Rect, Ui, vec2};
use glam::Vec3;
use intrados_scene::Camera;

use crate::lang::term;

/// Length of an axis that lies in the picture, points.
const ARM: f32 = 24.0;
/// Axes with their names and colours, as all that draw models have them.
const AXES: [(&str, Vec3, Color32); 3] = [
    ("x", Vec3::X, Color32::from_rgb(226, 92, 92)),
    ("up", Vec3::Y, Color32::from_rgb(96, 178, 96)),
    ("z", Vec3::Z, Color32::from_rgb(92, 142, 232)),
];

pub(super) fn draw(ui: &Ui, rect: Rect, camera: &Camera) {
    let [right, up, forward] = camera.frame();
    let middle = rect.left_bottom() + vec2(ARM + 22.0, -(ARM + 62.0));
    let painter = ui.painter().with_clip_rect(rect);
    let font = egui::TextStyle::Small.resolve(ui.style());
    painter.circle_filled(middle, ARM + 16.0, Color32::from_black_alpha(190));
    let mut axes = AXES;
    // The farthest first.
    axes.sort_by(|a, b| b.1.dot(forward).total_cmp(&a.1.dot(forward)));
    for (name, way, ink) in axes {
        let way = vec2(way.dot(right), -way.dot(up));
        painter.line_segment([middle, middle + ARM * way], (2.0, ink));
        let at = middle + ARM * way + 8.0 * way.normalized();
        painter.text(at, Align2::CENTER_CENTER, term(name), font.clone(), ink);
    }
}
