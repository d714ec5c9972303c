//! The way to the photographs, slices and gauges of a member.

use egui::{RichText, Ui};
use intrados_predict::{MemberPrediction, SliceReading};
use intrados_scene::{Member, Scene};

use crate::{Action, Actions, lang::fixed, number::copied};

/// Most slices in the list.
const MOST: usize = 12;

pub(super) fn links(
    ui: &mut Ui,
    scene: &Scene,
    member: &Member,
    told: Option<&MemberPrediction>,
    actions: &mut Actions,
) {
    let photographs = scene.structure.photographs.iter().filter(|p| p.member == member.id);
    let mut is_empty = true;
    for photo in photographs {
        is_empty = false;
        let date = photo.date.map_or(String::new(), |d| format!(", {d}"));
        if ui.link(tr!("Photograph {}{}", photo.name, date)).clicked() {
            actions.ask(Action::Photograph(photo.file.clone()));
        }
    }
    let slices = told.map_or(&[][..], |t| &t.slices);
    is_empty &= slices.is_empty();
    let mut order: Vec<(usize, &SliceReading)> = slices.iter().enumerate().collect();
    order.sort_by(|a, b| b.1.damage.value.total_cmp(&a.1.damage.value));
    for (index, slice) in order.iter().take(MOST) {
        let hint = format!("{}, {}", slice.core, slice.name);
        if ui.link(said(slice)).on_hover_text(hint).clicked() {
            actions.ask(Action::Slice(*index));
        }
    }
    if slices.len() > MOST {
        ui.weak(tr!("and {} more slices that show less", slices.len() - MOST));
    }
    for gauge in told.map_or(&[][..], |t| &t.gauges) {
        is_empty = false;
        let (scale, unit) = if gauge.unit == "m" { (1e3, "mm") } else { (1e6, "µε") };
        let [read, error, sound] =
            [gauge.read, gauge.std_error, gauge.sound].map(|x| fixed(scale * x, 2));
        ui.horizontal_wrapped(|ui| {
            ui.strong(tr!("Gauge {}", gauge.gauge));
            copied(ui, RichText::new(format!("{read} ± {error} {unit}")));
            ui.weak(tr!("sound {} {}, test {}", sound, unit, gauge.test));
        });
    }
    if is_empty {
        let comes = !member.slices.is_empty() && told.is_none();
        ui.weak(if comes { tr!("They come with the prediction.") } else { tr!("None.") });
    }
}

/// What a slice shows, in a line.
fn said(slice: &SliceReading) -> String {
    let place = slice
        .along
        .map_or_else(|| slice.name.clone(), |along| tr!("at {} %", fixed(100.0 * along, 0)));
    let widest = slice.cracks.iter().map(|c| c.width_mm).fold(0.0, f64::max);
    let pores = fixed(100.0 * slice.porosity.value, 2);
    if widest > 0.0 {
        tr!("Slice {}: {} % pores, crack {} mm wide", place, pores, fixed(widest, 2))
    } else {
        tr!("Slice {}: {} % pores", place, pores)
    }
}
