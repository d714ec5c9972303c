//! Whether fields steer the walks, how they were learnt, and whether it pays.

use bevy_ecs::prelude::*;
use egui::{ComboBox, Grid, ScrollArea, Ui};
use egui_plot::{HLine, Line, LineStyle, MarkerShape, PlotPoints, Points};
use intrados_light::{Culprit, Guide, Render, plugin::Learning};
use intrados_transport::{Round, Side, Steering, figure_of_merit};

use crate::{
    Statistics,
    chart::{by_cpu_seconds, decades, key, place, plot, power},
    colours,
    lang::fixed,
    number::{percent, significant},
};

/// Most surfaces in the table.
const SURFACES: usize = 24;
/// Between columns, points.
const GAP: f32 = 12.0;

pub(crate) fn steering(
    InMut(ui): InMut<Ui>,
    learning: Res<Learning>,
    render: Option<Res<Render>>,
    statistics: Res<Statistics>,
) {
    let Some(guide) = learning.guide() else {
        ui.weak(state(&learning));
        return;
    };
    let mut left = ui.available_rect_before_wrap();
    let whole = left.width();
    // The table is the widest.
    let mut column = |share: f32| {
        let (rect, rest) = left.split_left_right_at_x(left.left() + share * whole);
        left = rest;
        ui.new_child(egui::UiBuilder::new().max_rect(rect.with_max_x(rect.right() - GAP)))
    };
    facts(&mut column(0.2), guide, learning.culprits(), render.as_deref());
    course(&mut column(0.23), guide);
    merit(&mut column(0.25), guide, &statistics, render.as_deref());
    surfaces(&mut column(0.32), learning.culprits());
}

/// Lets the user choose, and says what has become of it.
pub(crate) fn choice(ui: &mut Ui, learning: &mut ResMut<Learning>) {
    let name = |steering: Steering| match steering {
        Steering::Off => tr!("off"),
        Steering::Auto => tr!("where it pays"),
        Steering::On => tr!("on"),
    };
    let label = ui.label(tr!("Steering"));
    let mut chosen = learning.steering;
    let combo = ComboBox::from_id_salt("steering")
        .width(104.0)
        .selected_text(name(chosen))
        .show_ui(ui, |ui| {
            for steering in [Steering::Off, Steering::Auto, Steering::On] {
                ui.selectable_value(&mut chosen, steering, name(steering));
            }
        });
    combo.response.labelled_by(label.id).on_hover_text(tr!(
        "Primal and dual walks teach each other where to go. It is learnt aside, for this camera; \
         then the picture begins anew"
    ));
    if chosen != learning.steering {
        learning.steering = chosen;
    }
}

/// In a few words.
pub(crate) fn state(learning: &Learning) -> String {
    let steers = |guide: &Guide| match Side::BOTH.map(|side| guide.steers(side)) {
        [true, true] => tr!("steers both sides"),
        [true, false] => tr!("steers the primal side"),
        [false, true] => tr!("steers the dual side"),
        [false, false] => tr!("does not pay here"),
    };
    match (learning.guide(), learning.progress()) {
        _ if learning.steering == Steering::Off => tr!("nothing is learnt while steering is off"),
        _ if !learning.is_possible() => tr!("only next-event walks can be steered"),
        (Some(guide), _) => steers(guide),
        (None, Some(done)) => tr!("learns: {} %", fixed(100.0 * done, 0)),
        (None, None) => tr!("learns as soon as the camera rests"),
    }
}

pub(crate) fn side_name(side: Side) -> String {
    if side == Side::Primal { tr!("primal") } else { tr!("dual") }
}

/// How many times the merit of a side's unsteered walks its steered ones had when both were last
/// tried.
fn gain(guide: &Guide, side: Side) -> Option<f64> {
    let last = |steered: bool| {
        guide
            .rounds()
            .iter()
            .rev()
            .find(|r| r.side == side && r.steered == steered)
            .map(Round::merit)
    };
    Some(last(true)? / last(false)?)
}

fn facts(ui: &mut Ui, guide: &Guide, culprits: &[Culprit], render: Option<&Render>) {
    ScrollArea::vertical().id_salt("facts").auto_shrink(false).show(ui, |ui| {
        Grid::new("facts").num_columns(2).show(ui, |ui| {
            for side in Side::BOTH {
                ui.weak(side_name(side));
                let gain = match gain(guide, side) {
                    Some(gain) if gain.is_finite() => tr!("merit × {}", significant(gain, 2)),
                    Some(gain) if gain > 0.0 => tr!("found only so"),
                    _ => tr!("not compared"),
                };
                let steers = if guide.steers(side) { tr!("steered") } else { tr!("not steered") };
                ui.label(format!("{steers}: {gain}")).on_hover_text(tr!(
                    "Figure of merit of steered walks over unsteered ones' in the rounds of \
                     learning, on a scale of work that knows no clock. Where it is below 1, \
                     steering does not pay. Not compared: a field steered this side's walks from \
                     the first round on"
                ));
                ui.end_row();
                ui.weak(format!("  {}", tr!("residual"))).on_hover_text(tr!(
                    "What a step of a walk brought over what the field had promised: 1 if the \
                     field is right"
                ));
                ui.label(residual(side, culprits, render));
                ui.end_row();
            }
            for (name, value) in [
                (tr!("memory"), tr!("{} of fields", bytes(guide.bytes()))),
                (tr!("learning"), format!("{} CPU-s", significant(guide.cpu_seconds, 2))),
            ] {
                ui.weak(name);
                ui.label(value);
                ui.end_row();
            }
        });
    });
}

/// Mean over the last round of learning, and the largest of the picture's walks if they are
/// steered.
fn residual(side: Side, culprits: &[Culprit], render: Option<&Render>) -> String {
    let of = || culprits.iter().filter(|c| c.side == side);
    let steps: f64 = of().map(|c| c.steps).sum();
    let mean = of().map(|c| c.steps * c.mean).sum::<f64>() / steps;
    let learnt = of().map(|c| c.largest).fold(0.0, f64::max);
    let walked =
        render.and_then(|r| r.exposure(side)).filter(|e| e.field != 0).map(|e| e.max_residual);
    let largest = learnt.max(walked.unwrap_or(0.0));
    if steps > 0.0 {
        tr!("mean {}, largest {}", fixed(mean, 3), significant(largest, 2))
    } else {
        tr!("unknown")
    }
}

fn bytes(n: usize) -> String {
    let n = n as f64;
    if n < 1e6 {
        format!("{} kB", significant(n / 1e3, 2))
    } else {
        format!("{} MB", significant(n / 1e6, 2))
    }
}

/// relVar of a walk in each round of learning.
fn course(ui: &mut Ui, guide: &Guide) {
    ui.horizontal(|ui| {
        let hint = tr!("Squares: no field steered them yet");
        ui.label(tr!("relVar of a walk by round")).on_hover_text(hint);
        key(ui, &tr!("primal"), colours::PRIMAL, false);
        key(ui, &tr!("dual"), colours::DUAL, true);
    });
    let of = |side: Side| {
        let rounds = guide.rounds().iter().filter(move |r| r.side == side).zip(1..);
        rounds
            .filter_map(|(round, number)| {
                Some((
                    round.steered,
                    [f64::from(number), log(round.scores.reading().rel_var_per_walk())?],
                ))
            })
            .collect::<Vec<_>>()
    };
    let whole = |input: egui_plot::GridInput| {
        let (from, to) = (input.bounds.0.ceil() as i32, input.bounds.1.floor() as i32);
        (from..=to.min(from + 40))
            .map(|n| egui_plot::GridMark { value: f64::from(n), step_size: 1.0 })
            .collect()
    };
    plot("learning")
        .x_grid_spacer(whole)
        .y_grid_spacer(decades)
        .x_axis_formatter(|mark, _| format!("{}", mark.value))
        .y_axis_formatter(|mark, _| power(mark))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(tr!("{} in round {}", significant(10_f64.powf(p.y), 2), fixed(p.x, 0)))
        })
        .show(ui, |plot| {
            for (side, colour, style) in [
                (Side::Primal, colours::PRIMAL, LineStyle::Solid),
                (Side::Dual, colours::DUAL, LineStyle::dashed_loose()),
            ] {
                let name = side_name(side);
                let rounds = of(side);
                let points: Vec<[f64; 2]> = rounds.iter().map(|(_, point)| *point).collect();
                let line = Line::new(name.clone(), PlotPoints::new(points));
                plot.line(line.color(colour).style(style).width(2.0));
                for (steered, shape) in [(false, MarkerShape::Square), (true, MarkerShape::Circle)]
                {
                    let points: Vec<[f64; 2]> = rounds
                        .iter()
                        .filter(|(s, _)| *s == steered)
                        .map(|(_, point)| *point)
                        .collect();
                    plot.points(
                        Points::new(name.clone(), PlotPoints::new(points))
                            .color(colour)
                            .shape(shape)
                            .radius(4.0),
                    );
                }
            }
        });
}

fn log(x: f64) -> Option<f64> {
    Some(x.log10()).filter(|x| x.is_finite())
}

/// 1/(relVar of the picture's mean · CPU-seconds) as the picture grows; learning counts.
fn merit(ui: &mut Ui, guide: &Guide, statistics: &Statistics, render: Option<&Render>) {
    let is_steered = render.is_some_and(|r| r.exposures().iter().flatten().any(|e| e.field != 0));
    let training = if is_steered { guide.cpu_seconds } else { 0.0 };
    let points: Vec<[f64; 2]> = statistics
        .history()
        .iter()
        .filter_map(|e| {
            let cpu_seconds = e.cpu_seconds + training;
            Some([log(cpu_seconds)?, log(figure_of_merit(e.errors[2]?, cpu_seconds))?])
        })
        .collect();
    let before =
        render.and_then(|r| statistics.unsteered(r.camera())).filter(|_| is_steered).and_then(log);
    ui.horizontal(|ui| {
        ui.label(tr!("Figure of merit by CPU-s")).on_hover_text(tr!(
            "1/(relVar of the picture's mean · CPU-seconds), learning counted. Flat: the error \
             falls as it should"
        ));
        if before.is_some() {
            key(ui, &tr!("unsteered"), colours::UNKNOWN, true);
        }
    });
    by_cpu_seconds("merit").show(ui, |plot| {
        if let Some(before) = before {
            plot.hline(
                HLine::new(tr!("unsteered"), before)
                    .color(colours::UNKNOWN)
                    .style(LineStyle::dashed_loose())
                    .width(2.0),
            );
        }
        let line = Line::new(tr!("picture"), PlotPoints::new(points));
        plot.line(line.color(colours::COMBINED).width(2.0));
    });
}

/// Where the variance comes from, by the error law (theory §5), worst first.
fn surfaces(ui: &mut Ui, culprits: &[Culprit]) {
    let totals = Side::BOTH
        .map(|side| culprits.iter().filter(|c| c.side == side).map(|c| c.rel_var).sum::<f64>());
    ScrollArea::both().id_salt("surfaces").auto_shrink(false).show(ui, |ui| {
        Grid::new("surfaces").num_columns(6).striped(true).show(ui, |ui| {
            for (title, hint) in [
                (tr!("Surface"), tr!("Where the steps set out from")),
                (tr!("side"), tr!("Whose walks")),
                (tr!("share"), tr!("Of the side's variance, in the last round of learning")),
                (
                    tr!("mean"),
                    tr!("Of what steps brought over what was promised: 1 if the field is right"),
                ),
                (tr!("largest"), tr!("Of the same")),
                (tr!("steps"), tr!("A walk")),
            ] {
                ui.strong(title).on_hover_text(hint);
            }
            ui.end_row();
            for c in culprits.iter().take(SURFACES) {
                ui.label(&c.surface);
                ui.label(side_name(c.side));
                ui.label(percent(c.rel_var / totals[c.side as usize]));
                ui.label(fixed(c.mean, 3));
                ui.label(significant(c.largest, 2));
                ui.label(significant(c.steps, 2));
                ui.end_row();
            }
        });
        if culprits.len() > SURFACES {
            ui.weak(tr!("and {} more", culprits.len() - SURFACES));
        }
    });
}
