//! Of the selected member: what each physics says, zone by zone, and every defect with its
//! evidence.

use egui::{Rect, Sense, Ui, pos2, vec2};
use intrados_damage::{
    evidence::called,
    verdict::Basis,
    zone::{ZONES, place},
};
use intrados_light::tone::ColourMap;
use intrados_predict::{MemberPrediction, Predicted, SliceReading};
use intrados_scene::Scene;

use crate::{Action, Actions, Latest, Selection, colours, number::plus_minus};

/// Height of the zones' bars, points.
const BARS: f32 = 56.0;
/// Most defects in the list.
const MOST: usize = 12;

pub(super) fn sheet(
    ui: &mut Ui,
    scene: &Scene,
    latest: &Latest,
    selection: Selection,
    actions: &mut Actions,
) {
    let Some((index, member)) = selection.0.and_then(|i| Some((i, scene.members.get(i)?))) else {
        ui.weak(
            "Select a member, in the picture or in the table, to see what its damage rests on.",
        );
        return;
    };
    ui.strong(&member.name);
    let assumed = if member.concrete_assumed { " (assumed)" } else { "" };
    ui.weak(format!("{:?}, {}{assumed}", member.kind, member.concrete));
    let Some(predicted) = latest.member(index) else {
        ui.label("No evidence so far, which is not the same as sound.");
        return;
    };
    ui.label(format!(
        "d = {}, {}",
        plus_minus(predicted.damage.value, predicted.damage.std_error, ""),
        predicted.verdict.state
    ));
    let likely = predicted
        .verdict
        .probability
        .iter()
        .map(|(state, p)| format!("{state} {:.0} %", 100.0 * p));
    ui.weak(likely.collect::<Vec<_>>().join(", "));
    ui.label(&predicted.verdict.advice);
    bars(ui, predicted);
    ui.horizontal_wrapped(|ui| {
        if !member.slices.is_empty() && ui.button("Its slices").clicked() {
            actions.ask(Action::Slice(0));
        }
        if scene.structure.assembly_of(&member.id).is_some() && ui.button("Its stress").clicked() {
            actions.ask(Action::Tab("Stress"));
        }
    });
    let result = latest.result.as_ref().filter(|r| r.scene_hash == scene.hash);
    if let Some(told) = result.and_then(|r| r.members.get(index)) {
        evidence(ui, told);
        defects(ui, told, actions);
    }
}

/// Damage of the zones from the start of the axis to its end, with their 95 % intervals.
fn bars(ui: &mut Ui, predicted: &Predicted) {
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width().min(300.0), BARS), Sense::hover());
    let width = rect.width() / ZONES as f32;
    let y = |d: f64| rect.bottom() - rect.height() * d.clamp(0.0, 1.0) as f32;
    ui.painter().rect_stroke(
        rect,
        1.0,
        (1.0, ui.visuals().weak_text_color()),
        egui::StrokeKind::Inside,
    );
    for (zone, reading) in predicted.zones.0.iter().enumerate() {
        let left = rect.left() + width * zone as f32;
        let Some(r) = reading else {
            let column = Rect::from_min_max(
                pos2(left + 2.0, rect.top() + 2.0),
                pos2(left + width - 2.0, rect.bottom() - 2.0),
            );
            ui.painter().rect_filled(column, 0.0, colours::UNKNOWN.gamma_multiply(0.3));
            continue;
        };
        let forecast = predicted.basis[zone] == Basis::Forecast;
        let colour = ColourMap::Viridis.at(r.value as f32);
        let [red, green, blue] = if forecast { colours::paler(colour) } else { colour };
        let column = Rect::from_min_max(
            pos2(left + 2.0, y(r.value)),
            pos2(left + width - 2.0, rect.bottom()),
        );
        ui.painter().rect_filled(column, 0.0, egui::Color32::from_rgb(red, green, blue));
        let range = [y(r.value + 1.96 * r.std_error), y(r.value - 1.96 * r.std_error)];
        ui.painter().vline(
            left + 0.5 * width,
            range[0]..=range[1],
            (1.5, ui.visuals().strong_text_color()),
        );
    }
    if let Some(at) = response.hover_pos() {
        let zone = (((at.x - rect.left()) / width) as usize).min(ZONES - 1);
        let said = predicted.zones.0[zone]
            .map_or("nothing known".into(), |r| plus_minus(r.value, r.std_error, ""));
        response.on_hover_text(format!(
            "{} of the axis: {said}, {}",
            place(zone),
            predicted.basis[zone].name()
        ));
    }
    ui.weak("from the start of the axis to its end; lines: 95 % intervals; greyed: forecast");
}

fn evidence(ui: &mut Ui, told: &MemberPrediction) {
    for (source, e) in &told.evidence {
        ui.horizontal_wrapped(|ui| {
            ui.strong(called(source));
            ui.label(plus_minus(e.damage, e.std_error, ""));
            ui.label(&e.basis);
        });
    }
    for conflict in &told.conflicts {
        ui.label(format!("⚠ contradicting: {conflict}"));
    }
    if let Some(seen) = told.photographed() {
        ui.label(seen);
    }
    if let Some(c) = &told.crack_check {
        let verdict = if c.exceeded { "⚠ wider than" } else { "within" };
        ui.label(format!(
            "widest crack {:.2} mm ({}), {verdict} the {} mm of {}",
            c.width_mm,
            called(c.source),
            c.limit_mm,
            c.exposure
        ));
    }
}

/// Cracks by their width, then the largest pores, each with the slice that shows it.
fn defects(ui: &mut Ui, told: &MemberPrediction, actions: &mut Actions) {
    let mut cracks: Vec<(usize, &SliceReading, f64, f64)> = told
        .slices
        .iter()
        .enumerate()
        .flat_map(|(i, s)| s.cracks.iter().map(move |c| (i, s, c.width_mm, c.length_mm)))
        .collect();
    cracks.sort_by(|a, b| b.2.total_cmp(&a.2));
    let mut pores: Vec<(usize, &SliceReading, f64)> = told
        .slices
        .iter()
        .enumerate()
        .flat_map(|(i, s)| s.table.iter().map(move |p| (i, s, p.diameter_mm)))
        .collect();
    pores.sort_by(|a, b| b.2.total_cmp(&a.2));
    if cracks.is_empty() && pores.is_empty() {
        return;
    }
    ui.add_space(4.0);
    ui.strong("Defects in its slices");
    let mut link = |ui: &mut Ui, text: String, index: usize, slice: &SliceReading| {
        if ui.link(text).on_hover_text(format!("{}, {}", slice.core, slice.name)).clicked() {
            actions.ask(Action::Slice(index));
        }
    };
    for (i, slice, width, length) in cracks.iter().take(MOST) {
        link(
            ui,
            format!("crack {width:.2} mm wide, {length:.0} mm long, {}", where_is(slice)),
            *i,
            slice,
        );
    }
    for (i, slice, diameter) in pores.iter().take(MOST.saturating_sub(cracks.len()).max(3)) {
        link(ui, format!("pore {diameter:.1} mm, {}", where_is(slice)), *i, slice);
    }
}

fn where_is(slice: &SliceReading) -> String {
    slice.along.map_or_else(
        || slice.name.clone(),
        |along| format!("at {:.0} % of the axis", 100.0 * along),
    )
}
