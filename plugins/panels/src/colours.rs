//! Colours that mean something. None of them is the only carrier of what it means.

use std::sync::LazyLock;

use egui::{Color32, ecolor::gamma_u8_from_linear_f32 as srgb};
use intrados_damage::verdict::{Basis, Verdict};
use intrados_report::surface;

use crate::lang::term;

/// Primal: blue of Okabe & Ito's palette, told apart from vermilion by every kind of colour vision.
pub(crate) const PRIMAL: Color32 = Color32::from_rgb(0, 114, 178);
/// Dual: vermilion.
pub(crate) const DUAL: Color32 = Color32::from_rgb(213, 94, 0);
/// Both sides combined: bluish green.
pub(crate) const COMBINED: Color32 = Color32::from_rgb(0, 158, 115);
/// The selected member's outline.
pub(crate) const SELECTED: Color32 = Color32::from_rgb(255, 176, 0);
/// No value here.
pub(crate) const UNKNOWN: Color32 = Color32::from_gray(96);

/// Steps of the scale of damage.
const STEPS: usize = 255;

/// The report's scale, measured and forecast, as sRGB: asked for by every pixel.
static SCALE: LazyLock<[Vec<[u8; 3]>; 2]> = LazyLock::new(|| {
    let step = |k: usize| Some(k as f64 / STEPS as f64);
    let bytes = |linear: glam::Vec3| linear.to_array().map(srgb);
    [
        (0..=STEPS).map(|k| bytes(surface::colour(step(k)))).collect(),
        (0..=STEPS).map(|k| bytes(surface::forecast(step(k)))).collect(),
    ]
});

/// The colour of a damage, everywhere in the window and as in the report: paler where it is only
/// forecast, grey where it is not a number.
pub(crate) fn damage(value: f32, is_forecast: bool) -> [u8; 3] {
    if value.is_nan() {
        return surface::UNKNOWN.to_array().map(srgb);
    }
    let step = (value.clamp(0.0, 1.0) * STEPS as f32).round() as usize;
    SCALE[usize::from(is_forecast)].get(step).copied().unwrap_or_default()
}

/// The same for a brush.
pub(crate) fn damage_ink(value: f32, is_forecast: bool) -> Color32 {
    ink(damage(value, is_forecast))
}

/// sRGB bytes for a brush.
pub(crate) fn ink([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// Steps of severity drawn as squares: their number says it, the colour only helps. Filled up to
/// the best state that it may be in, framed up to the worst; what is only forecast is framed alone.
pub(crate) fn severity(ui: &mut egui::Ui, verdict: &Verdict, steps: usize) -> egui::Response {
    let [best, worst] = verdict.run.unwrap_or_default();
    let step = worst;
    let size = egui::vec2(8.0 * steps as f32 + 2.0, ui.text_style_height(&egui::TextStyle::Body));
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::hover());
    let t = if steps > 1 { step as f32 / (steps - 1) as f32 } else { 0.0 };
    let colour = lerp(Color32::from_rgb(0, 158, 115), Color32::from_rgb(213, 62, 0), t);
    for k in 0..steps {
        let square = egui::Rect::from_center_size(
            rect.left_center() + egui::vec2(8.0 * k as f32 + 5.0, 0.0),
            egui::Vec2::splat(6.0),
        );
        if k <= best && verdict.basis == Basis::Measured {
            ui.painter().rect_filled(square, 1.0, colour);
        } else if k <= worst {
            ui.painter().rect_stroke(square, 1.0, (1.6, colour), egui::StrokeKind::Inside);
        } else {
            ui.painter().rect_stroke(
                square,
                1.0,
                (1.0, ui.visuals().weak_text_color()),
                egui::StrokeKind::Inside,
            );
        }
    }
    response.on_hover_text(term(&verdict.state))
}

fn lerp(a: Color32, b: Color32, t: f32) -> Color32 {
    let mix = |a: u8, b: u8| (f32::from(a) + (f32::from(b) - f32::from(a)) * t) as u8;
    Color32::from_rgb(mix(a.r(), b.r()), mix(a.g(), b.g()), mix(a.b(), b.b()))
}
