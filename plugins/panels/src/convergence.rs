//! How the error falls, and whether the two sides agree.

use bevy_ecs::prelude::*;
use egui::Ui;
use egui_plot::{HLine, Line, LineStyle, PlotPoints};

use crate::{
    Refine, Statistics,
    chart::{by_cpu_seconds, decades, key, named, place, plot, power},
    colours,
    lang::local,
    number::significant,
};

pub(crate) fn convergence(InMut(ui): InMut<Ui>, statistics: Res<Statistics>, refine: Res<Refine>) {
    if statistics.history().len() < 2 {
        ui.weak(tr!("The plot begins with the second reading."));
        return;
    }
    ui.columns(2, |columns| {
        errors(&mut columns[0], &statistics, refine.target);
        gap(&mut columns[1], &statistics);
    });
}

/// log₁₀ of the relative error against log₁₀ of CPU-seconds: a straight line of slope −½ where the
/// 1/√n law holds.
fn errors(ui: &mut Ui, statistics: &Statistics, target: f64) {
    let line = |name: String, k: usize, colour, style| {
        let points: Vec<[f64; 2]> = statistics
            .history()
            .iter()
            .filter_map(|e| Some([e.cpu_seconds.log10(), e.errors[k]?.log10()]))
            .collect();
        Line::new(name, PlotPoints::new(points)).color(colour).style(style).width(2.0)
    };
    let said = ui.horizontal(|ui| {
        let said = ui.label(tr!("Relative error of the picture's mean against CPU-seconds"));
        for (name, colour, dashed) in [
            (tr!("primal"), colours::PRIMAL, false),
            (tr!("dual"), colours::DUAL, true),
            (tr!("combined"), colours::COMBINED, false),
        ] {
            key(ui, &name, colour, dashed);
        }
        said
    });
    let errors = by_cpu_seconds("errors").include_y(target.log10());
    let shown = errors.show(ui, |plot| {
        plot.line(line(tr!("primal"), 0, colours::PRIMAL, LineStyle::Solid).width(4.0));
        plot.line(line(tr!("dual"), 1, colours::DUAL, LineStyle::dashed_loose()));
        plot.line(line(tr!("combined"), 2, colours::COMBINED, LineStyle::Solid));
        plot.hline(
            HLine::new(tr!("target"), target.log10())
                .color(colours::UNKNOWN)
                .style(LineStyle::dotted_dense()),
        );
    });
    named(shown.response, &said.inner);
}

/// The duality gap in standard errors: N(0,1) if both sides are right.
fn gap(ui: &mut Ui, statistics: &Statistics) {
    let points: Vec<[f64; 2]> =
        statistics.history().iter().filter_map(|e| Some([e.cpu_seconds.log10(), e.z?])).collect();
    let said = ui.label(tr!("Duality gap against CPU-seconds, in standard errors (dotted: 95 %)"));
    let gap = plot("gap")
        .x_grid_spacer(decades)
        .x_axis_formatter(|mark, _| power(mark))
        .include_y(-3.0)
        .include_y(3.0)
        .label_formatter(|hover| {
            let p = place(hover);
            let gap = local(format!("{:+.2}", p.y));
            Some(tr!("{} σ after {} CPU-s", gap, significant(10_f64.powf(p.x), 2)))
        });
    let shown = gap.show(ui, |plot| {
        for z in [-2.0, 2.0] {
            plot.hline(
                HLine::new("95 %", z).color(colours::UNKNOWN).style(LineStyle::dotted_dense()),
            );
        }
        plot.line(
            Line::new(tr!("primal − dual"), PlotPoints::new(points))
                .color(colours::PRIMAL)
                .width(2.0),
        );
    });
    named(shown.response, &said);
}
