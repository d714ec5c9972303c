//! The sheet of the selected member: how it fares and how sure that is, where it is damaged, what
//! that rests on, what is foretold, and the way to all that shows it. Of no member: the structure.

mod bars;
mod capacity;
mod compare;
mod course;
mod evidence;
mod faces;
mod links;
mod overview;
mod properties;

use bevy_ecs::prelude::*;
use egui::{RichText, Ui};
use intrados_damage::evidence::called;
use intrados_predict::{MemberPrediction, Predicted};
use intrados_scene::{Member, Scene, plugin::CurrentScene};

use capacity::Mechanics;

use crate::{
    Action, Actions, Latest, Selection, colours,
    history::History,
    lang::{fixed, measured, term},
    members,
    moment::{Course, Courses, Moment},
    number::{copied, plus_minus},
};

pub(crate) use evidence::Listing;
pub(crate) use properties::{Properties, Unapplied};

/// Draws it.
pub(crate) fn member(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    history: Res<History>,
    (courses, moment): (Res<Courses>, Res<Moment>),
    selection: Res<Selection>,
    mut mechanics: Mechanics,
    mut listing: ResMut<Listing>,
    mut properties: ResMut<Properties>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    let Some((index, member)) = selection.0.and_then(|i| Some((i, scene.members.get(i)?))) else {
        overview::overview(ui, scene, &latest, &mut actions);
        properties.bypass_change_detection().show(ui, scene, None, &mut actions);
        return;
    };
    head(ui, member);
    // Above what grows while it is predicted: a button stays where it is.
    ways(ui, scene, member, &mut actions);
    standing(ui, index, &latest, &mut actions);
    properties.bypass_change_detection().show(ui, scene, Some(member), &mut actions);
    let result = latest.result_for(scene);
    let told = result.and_then(|r| r.members.get(index));
    if let Some(predicted) = latest.member(index) {
        section(ui, "Damage along the member", |ui| bars::bars(ui, predicted));
        if let Some(earlier) = history.beside() {
            section(ui, "Compared", |ui| compare::compare(ui, member, predicted, earlier));
        }
    }
    if let Some(told) = told {
        if !told.defects.is_empty() || !told.faces.is_empty() {
            section(ui, "Faces and defects", |ui| faces::faces(ui, member, told));
        }
        section(ui, "What it rests on", |ui| sources(ui, told));
    }
    section(ui, "Evidence", |ui| {
        listing.bypass_change_detection().show(ui, scene, member, result, &mut actions);
    });
    if let Some(told) = told {
        section(ui, "Forecast", |ui| foretold(ui, told, courses.get(index), *moment));
    }
    section(ui, "Capacity", |ui| {
        capacity::capacity(ui, scene, member, told, &mut mechanics, &mut actions);
    });
    section(ui, "Photographs, slices, gauges", |ui| {
        links::links(ui, scene, member, told, &mut actions)
    });
}

/// A part of the sheet under its name, which is a [`term`] and, in English, what it is kept by.
fn section(ui: &mut Ui, name: &str, draw: impl FnOnce(&mut Ui)) {
    part(ui, name, true, draw);
}

/// The same, which may be closed at first.
fn part(ui: &mut Ui, name: &str, is_open: bool, draw: impl FnOnce(&mut Ui)) {
    ui.add_space(4.0);
    egui::CollapsingHeader::new(RichText::new(term(name)).strong())
        .id_salt(name)
        .default_open(is_open)
        .show_unindented(ui, draw);
}

fn head(ui: &mut Ui, member: &Member) {
    ui.label(RichText::new(&member.name).heading().strong());
    let mut concrete = member.concrete.clone();
    if member.concrete_assumed {
        concrete = tr!("{} (assumed)", concrete);
    }
    let size = member.bounds[1] - member.bounds[0];
    let [x, y, z] = size.to_array().map(|edge| fixed(edge, 2));
    let kind = term(&format!("{:?}", member.kind));
    ui.weak(format!("{kind}, {concrete}, {x} × {y} × {z} m"));
}

/// Damage with its error, state with its probability, and what to do.
fn standing(ui: &mut Ui, index: usize, latest: &Latest, actions: &mut Actions) {
    let (Some(predicted), Some((verdict, steps))) = (latest.member(index), latest.state(index))
    else {
        ui.label(tr!("No evidence so far, which is not the same as sound."));
        return;
    };
    if latest.is_outdated(index) {
        outdated(ui, latest, actions);
    }
    if latest.is_interim(index) {
        ui.colored_label(ui.visuals().warn_fg_color, members::interim(latest));
    }
    let damage = plus_minus(predicted.damage.value, predicted.damage.std_error, "");
    copied(ui, RichText::new(format!("d = {}", damage.trim())).size(18.0).strong());
    ui.horizontal_wrapped(|ui| {
        colours::severity(ui, verdict, steps);
        ui.strong(term(&verdict.state));
    });
    probable(ui, predicted, latest);
    let by = match verdict.within_months {
        None => String::new(),
        Some(0) => tr!(" (at once)"),
        Some(1) => tr!(" (within a month)"),
        Some(months) => tr!(" (within {} months)", months),
    };
    ui.label(term(&verdict.advice) + &by);
    if predicted.conflict {
        ui.label(tr!("⚠ Pieces of evidence contradict each other."));
    }
}

/// Says that numbers are of before the last change.
pub(crate) fn outdated(ui: &mut Ui, latest: &Latest, actions: &mut Actions) {
    ui.horizontal_wrapped(|ui| {
        ui.colored_label(ui.visuals().warn_fg_color, tr!("⚠ Outdated"));
        if latest.cancelled {
            if ui.button(tr!("Predict again")).clicked() {
                actions.ask(Action::Predict);
            }
        } else {
            ui.label(tr!("of before the last change; predicting again"));
        }
    });
}

/// The probability of each state, from the best to the worst: a bar and a number.
fn probable(ui: &mut Ui, predicted: &Predicted, latest: &Latest) {
    let known = |state: &String| Some((state.clone(), *predicted.verdict.probability.get(state)?));
    let states: Vec<(String, f64)> = latest.states().iter().filter_map(known).collect();
    egui::Grid::new("probability").num_columns(3).spacing([8.0, 2.0]).show(ui, |ui| {
        for (state, p) in states {
            ui.label(term(&state));
            let (rect, _) = ui.allocate_exact_size(egui::vec2(90.0, 9.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
            let filled = rect.with_max_x(rect.left() + rect.width() * p.clamp(0.0, 1.0) as f32);
            ui.painter().rect_filled(filled, 2.0, ui.visuals().selection.bg_fill);
            ui.label(format!("{} %", fixed(100.0 * p, 0)));
            ui.end_row();
        }
    });
}

/// Where to go from here.
fn ways(ui: &mut Ui, scene: &Scene, member: &Member, actions: &mut Actions) {
    ui.add_space(2.0);
    ui.horizontal_wrapped(|ui| {
        let look = ui.button(tr!("Look at it"));
        if look.on_hover_text(tr!("Fills the picture with it (F)")).clicked() {
            actions.ask(Action::Tab("Structure"));
            actions.ask(Action::Frame);
        }
        if !member.slices.is_empty() && ui.button(tr!("Its slices")).clicked() {
            actions.ask(Action::Slice(0));
        }
        let is_computed = scene.structure.assembly_of(&member.id).is_some();
        if is_computed && ui.button(tr!("Its stress")).clicked() {
            actions.ask(Action::Tab("Stress"));
        }
        let attach = ui.button(tr!("Attach evidence…"));
        let hint = tr!("Findings, CT slices, tables (A); or drop the files on the window");
        if attach.on_hover_text(hint).clicked() {
            actions.ask(Action::Fill(Vec::new(), None));
        }
    });
}

/// What each source says, and what contradicts what.
fn sources(ui: &mut Ui, told: &MemberPrediction) {
    if told.evidence.is_empty() {
        ui.weak(tr!("Nothing that could be used."));
    }
    for (source, e) in &told.evidence {
        ui.horizontal_wrapped(|ui| {
            ui.strong(term(called(source)));
            copied(ui, RichText::new(format!("d = {}", plus_minus(e.damage, e.std_error, ""))));
        });
        ui.label(measured(&e.basis));
    }
    for conflict in &told.conflicts {
        ui.label(tr!("⚠ contradicting: {}", measured(conflict)));
    }
}

/// How its damage grows over the years; zone by zone for the year that is looked at, the last one
/// where that is now.
fn life(ui: &mut Ui, course: &Course, moment: Moment) {
    let years = if moment.is_now() { course.end() } else { moment.years };
    if let Some((zone, now, later)) = course.worst(years).filter(|_| years > 0.0) {
        ui.label(tr!(
            "In {} years it loses most in {} of the axis: d = {} becomes {}.",
            fixed(years, 0),
            zone,
            fixed(now, 2),
            fixed(later, 2)
        ));
    }
    bars::foretold(ui, course, years);
    course::plot(ui, course, moment);
}

/// What its life by mechanics and rust says.
fn foretold(ui: &mut Ui, told: &MemberPrediction, course: Option<&Course>, moment: Moment) {
    let Some(forecast) = told.evidence.get("forecast") else {
        ui.weak(tr!("No forecast: nothing is known of its loads or its exposure."));
        return;
    };
    let value = plus_minus(forecast.damage, forecast.std_error, "");
    copied(ui, RichText::new(format!("d = {}", value.trim())));
    ui.label(measured(&forecast.basis));
    if let Some(course) = course {
        life(ui, course, moment);
    }
    let rust = forecast.details.get("rust");
    let Some(rust) = rust else { return };
    if let Some(why) = rust["why_not"].as_str() {
        ui.weak(tr!("Rust: {}", term(why)));
        return;
    }
    let number = |name: &str| rust[name].as_f64();
    let likely = fixed(100.0 * number("probability_depassivated").unwrap_or(0.0), 0);
    ui.label(match number("depassivation_years") {
        None => tr!(
            "Bars begin to rust not within a thousand years, most probably; \
             with {} % they have by now.",
            likely
        ),
        Some(years) => tr!(
            "Bars begin to rust after {} years, most probably; with {} % they have by now.",
            fixed(years, 0),
            likely
        ),
    });
}
