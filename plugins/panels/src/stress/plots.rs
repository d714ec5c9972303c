//! Beside the picture: forces along the tendons, and the way through the life.

use egui::{Color32, Ui};
use egui_plot::{Line, PlotPoints, VLine};
use intrados_mechanics::{
    plugin::Analysis,
    skin::{Skin, Snapshot},
};
use intrados_stage::time::DAY;

use crate::{
    chart::{key, named, place, plot},
    colours,
    lang::fixed,
    number::significant,
};

/// Tendons in turn: Okabe and Ito's palette.
const TURN: [Color32; 4] =
    [colours::PRIMAL, colours::DUAL, colours::COMBINED, Color32::from_rgb(204, 121, 167)];

pub(super) fn show(ui: &mut Ui, skin: &Skin, shot: &Snapshot, analysis: &Analysis, height: f32) {
    let each = if skin.tendons.is_empty() { height - 50.0 } else { 0.5 * height - 50.0 }.max(60.0);
    if skin.tendons.is_empty() {
        ui.weak(tr!("No tendons in this member."));
    } else {
        tendons(ui, skin, shot, each);
    }
    life(ui, shot, analysis, each);
}

/// Force along each tendon, and at the jack.
fn tendons(ui: &mut Ui, skin: &Skin, shot: &Snapshot, height: f32) {
    let said = ui.horizontal(|ui| {
        let said = ui.strong(tr!("Tendon force, kN"));
        let said = said.on_hover_text(tr!("Along the tendon from its first end, m"));
        ui.weak(tr!("{} tendons", skin.tendons.len())).on_hover_text(tr!("Dashed: at the jack"));
        said
    });
    let chart =
        plot("tendon forces").height(height).x_axis_label("m").include_y(0.0).label_formatter(
            |hover| {
                let p = place(hover);
                Some(tr!("{} kN at {} m", significant(p.y, 4), fixed(p.x, 2)))
            },
        );
    let shown = chart.show(ui, |chart| {
        for (i, (tendon, forces)) in skin.tendons.iter().zip(&shot.tendons).enumerate() {
            let colour = TURN[i % TURN.len()];
            let points: PlotPoints<'_> =
                tendon.along.iter().zip(forces).map(|(s, f)| [*s, 1e-3 * f]).collect();
            chart.line(Line::new(tendon.name.clone(), points).color(colour).width(1.5));
            let ends =
                [tendon.along.first(), tendon.along.last()].map(|s| s.copied().unwrap_or_default());
            let jack: PlotPoints<'_> =
                ends.into_iter().map(|s| [s, 1e-3 * tendon.jacking]).collect();
            chart.line(
                Line::new(tr!("at the jack"), jack)
                    .color(colour)
                    .width(1.0)
                    .style(egui_plot::LineStyle::dashed_dense()),
            );
        }
    });
    named(shown.response, &said.inner);
}

/// Largest displacement and widest crack over time.
fn life(ui: &mut Ui, shot: &Snapshot, analysis: &Analysis, height: f32) {
    // No wider than the plot, which would follow.
    ui.horizontal_wrapped(|ui| {
        key(ui, &tr!("displacement, mm"), colours::PRIMAL, false);
        key(ui, &tr!("widest crack, mm"), colours::DUAL, false);
    });
    let shots = analysis.seen.shots();
    let [largest, widest] = [0, 1].map(|k| move |s: &Snapshot| 1e3 * f64::from(s.largest[k]));
    // The first minutes and the last years are both of interest: days as their root, with their
    // sign, for ground closes on segments before day 0.
    let at = |time: f64| (time / DAY).signum() * (time / DAY).abs().sqrt();
    let chart = plot("life")
        .height(height)
        .x_axis_label(tr!("day (root scale)"))
        .include_y(0.0)
        .x_axis_formatter(|mark, _| significant(mark.value * mark.value.abs(), 2))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(tr!("{} mm at day {}", significant(p.y, 3), significant(p.x * p.x.abs(), 3)))
        });
    chart.show(ui, |chart| {
        chart.line(
            Line::new(
                tr!("displacement"),
                shots.iter().map(|s| [at(s.time), largest(s)]).collect::<PlotPoints<'_>>(),
            )
            .color(colours::PRIMAL),
        );
        chart.line(
            Line::new(
                tr!("crack"),
                shots.iter().map(|s| [at(s.time), widest(s)]).collect::<PlotPoints<'_>>(),
            )
            .color(colours::DUAL),
        );
        chart.vline(VLine::new(tr!("now"), at(shot.time)).color(colours::SELECTED).width(1.0));
    });
}
