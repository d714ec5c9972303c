//! Damage of a member's zones as bars.

use egui::{Rect, Sense, Ui, pos2, vec2};
use intrados_damage::{verdict::Basis, zone::ZONES};
use intrados_predict::Predicted;

use crate::{
    colours,
    lang::{fixed, term},
    moment::{Course, place},
    number::plus_minus,
};

/// Height of the bars, points.
const HEIGHT: f32 = 60.0;

/// Damage of the zones from the start of the axis to its end, with their 95 % intervals.
pub(super) fn bars(ui: &mut Ui, predicted: &Predicted) {
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width().min(420.0), HEIGHT), Sense::hover());
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Image, true, tr!("Damage along the member"))
    });
    let width = rect.width() / ZONES as f32;
    let y = |d: f64| rect.bottom() - rect.height() * d.clamp(0.0, 1.0) as f32;
    let line = (1.0, ui.visuals().weak_text_color());
    ui.painter().rect_filled(rect, 1.0, ui.visuals().extreme_bg_color);
    ui.painter().rect_stroke(rect, 1.0, line, egui::StrokeKind::Inside);
    for (zone, reading) in predicted.zones.0.iter().enumerate() {
        let left = rect.left() + width * zone as f32;
        let Some(r) = reading else {
            let [low, high] = [left + 2.0, left + width - 2.0];
            // Hatched: an empty column would look like a sound one.
            for k in 0..6 {
                let at = rect.top() + rect.height() * (k as f32 + 0.5) / 6.0;
                let ends = [pos2(low, at + 4.0), pos2(high, at - 4.0)];
                ui.painter().line_segment(ends, (1.0, colours::UNKNOWN));
            }
            continue;
        };
        let is_forecast = predicted.basis[zone] == Basis::Forecast;
        let column = Rect::from_min_max(
            pos2(left + 2.0, y(r.value.max(0.02))),
            pos2(left + width - 2.0, rect.bottom()),
        );
        ui.painter().rect_filled(column, 0.0, colours::damage_ink(r.value as f32, is_forecast));
        let range = [y(r.value + 1.96 * r.std_error), y(r.value - 1.96 * r.std_error)];
        let ink = (1.5, ui.visuals().strong_text_color());
        ui.painter().vline(left + 0.5 * width, range[0]..=range[1], ink);
    }
    if let Some(at) = response.hover_pos() {
        let zone = (((at.x - rect.left()) / width) as usize).min(ZONES - 1);
        let said = predicted.zones.0[zone]
            .map_or_else(|| tr!("nothing known"), |r| plus_minus(r.value, r.std_error, ""));
        let basis = term(predicted.basis[zone].name());
        response.on_hover_text(tr!("{} of the axis: {}, {}", place(zone), said.trim(), basis));
    }
    ui.weak(tr!("from the start of the axis to its end; lines: 95 % intervals; paler: forecast; \
         hatched: unknown"));
}

/// Damage by the life, zone by zone: of now on the left, of another year on the right.
pub(super) fn foretold(ui: &mut Ui, course: &Course, years: f64) {
    let [now, then] = [0.0, years].map(|years| course.at(years));
    let (Some(now), Some(then)) = (now, then) else { return };
    let sides = [now.map(Some), then.map(Some)];
    let (name, said) = match years < 0.0 {
        false => {
            let years = fixed(years, 0);
            (
                tr!("Forecast now and in {} years", years),
                tr!("each zone by the forecast: left now, right in {} years", years),
            )
        }
        true => {
            let years = fixed(-years, 0);
            (
                tr!("Its life now and {} years ago", years),
                tr!("each zone by its life: left now, right {} years ago", years),
            )
        }
    };
    two(ui, &name, sides, [tr!("now"), tr!("then|in future")]);
    ui.weak(said);
}

/// Damage zone by zone, of two predictions or times: one on the left, one on the right; nothing
/// where it is unknown.
pub(super) fn two(ui: &mut Ui, name: &str, sides: [[Option<f64>; ZONES]; 2], called: [String; 2]) {
    let size = vec2(ui.available_width().min(420.0), 0.6 * HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
    ui.painter().rect_filled(rect, 1.0, ui.visuals().extreme_bg_color);
    let width = rect.width() / ZONES as f32;
    for zone in 0..ZONES {
        for (side, damage) in sides.iter().map(|side| side[zone]).enumerate() {
            let Some(damage) = damage else { continue };
            let left = rect.left() + width * (zone as f32 + 0.5 * side as f32) + 1.0;
            let high = rect.height() * damage.clamp(0.02, 1.0) as f32;
            let column = Rect::from_min_max(
                pos2(left, rect.bottom() - high),
                pos2(left + 0.5 * width - 2.0, rect.bottom()),
            );
            let ink = colours::damage_ink(damage as f32, true);
            ui.painter().rect_filled(column, 0.0, ink);
        }
    }
    if let Some(at) = response.hover_pos() {
        let zone = (((at.x - rect.left()) / width) as usize).min(ZONES - 1);
        let said = [0, 1].map(|side| match sides[side][zone] {
            Some(damage) => format!("{} {}", fixed(damage, 2), called[side]),
            None => tr!("unknown {}", called[side]),
        });
        response.on_hover_text(format!("{}: {}, {}", place(zone), said[0], said[1]));
    }
}
