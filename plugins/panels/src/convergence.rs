//! How the error falls, and whether the two sides agree.

use bevy_ecs::prelude::*;
use egui::Ui;
use egui_plot::{GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, Plot, PlotPoint, PlotPoints};

use crate::{Refine, Statistics, colours, number::significant};

pub(crate) fn convergence(InMut(ui): InMut<Ui>, statistics: Res<Statistics>, refine: Res<Refine>) {
    if statistics.history().len() < 2 {
        ui.weak("The plot begins with the second reading.");
        return;
    }
    ui.columns(2, |columns| {
        errors(&mut columns[0], &statistics, refine.target);
        gap(&mut columns[1], &statistics);
    });
}

/// log₁₀ of the relative error against log₁₀ of CPU-seconds: a straight line of slope −½ where the 1/√n law holds.
fn errors(ui: &mut Ui, statistics: &Statistics, target: f64) {
    let line = |name: &str, k: usize, colour, style| {
        let points: Vec<[f64; 2]> =
            statistics.history().iter().filter_map(|e| Some([e.cpu_seconds.log10(), e.errors[k]?.log10()])).collect();
        Line::new(name.to_owned(), PlotPoints::new(points)).color(colour).style(style).width(2.0)
    };
    ui.horizontal(|ui| {
        ui.label("Relative error of the picture's mean against CPU-seconds");
        for (name, colour, dashed) in
            [("primal", colours::PRIMAL, false), ("dual", colours::DUAL, true), ("combined", colours::COMBINED, false)]
        {
            key(ui, name, colour, dashed);
        }
    });
    plot("errors")
        .x_grid_spacer(decades)
        .y_grid_spacer(decades)
        .x_axis_formatter(|mark, _| power(mark))
        .y_axis_formatter(|mark, _| power(mark))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(format!("{} after {} CPU-s", significant(10_f64.powf(p.y), 2), significant(10_f64.powf(p.x), 2)))
        })
        .include_y(target.log10())
        .show(ui, |plot| {
            plot.line(line("primal", 0, colours::PRIMAL, LineStyle::Solid).width(4.0));
            plot.line(line("dual", 1, colours::DUAL, LineStyle::dashed_loose()));
            plot.line(line("combined", 2, colours::COMBINED, LineStyle::Solid));
            plot.hline(HLine::new("target", target.log10()).color(colours::UNKNOWN).style(LineStyle::dotted_dense()));
        });
}

/// The duality gap in standard errors: N(0,1) if both sides are right.
fn gap(ui: &mut Ui, statistics: &Statistics) {
    let points: Vec<[f64; 2]> = statistics.history().iter().filter_map(|e| Some([e.cpu_seconds.log10(), e.z?])).collect();
    ui.label("Duality gap against CPU-seconds, in standard errors (dotted: 95 %)");
    plot("gap")
        .x_grid_spacer(decades)
        .x_axis_formatter(|mark, _| power(mark))
        .include_y(-3.0)
        .include_y(3.0)
        .label_formatter(|hover| {
            let p = place(hover);
            Some(format!("{:+.2} σ after {} CPU-s", p.y, significant(10_f64.powf(p.x), 2)))
        })
        .show(ui, |plot| {
            for z in [-2.0, 2.0] {
                plot.hline(HLine::new("95 %", z).color(colours::UNKNOWN).style(LineStyle::dotted_dense()));
            }
            plot.line(Line::new("primal − dual", PlotPoints::new(points)).color(colours::PRIMAL).width(2.0));
        });
}

/// One entry of a legend.
fn key(ui: &mut Ui, name: &str, colour: egui::Color32, dashed: bool) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(22.0, 10.0), egui::Sense::hover());
    let line = [rect.left_center(), rect.right_center()];
    if dashed {
        ui.painter().extend(egui::Shape::dashed_line(&line, (2.0, colour), 5.0, 3.0));
    } else {
        ui.painter().line_segment(line, (2.0, colour));
    }
    ui.weak(name);
}

fn place(hover: &HoverPosition<'_>) -> PlotPoint {
    match hover {
        HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position } => *position,
    }
}

fn plot<'a>(id: &str) -> Plot<'a> {
    Plot::new(id.to_owned()).allow_scroll(false).allow_drag(false).allow_zoom(false).allow_boxed_zoom(false).y_axis_min_width(40.0)
}

/// Grid lines at 1, 2, 5, 10, … of a logarithmic axis.
fn decades(input: GridInput) -> Vec<GridMark> {
    let (from, to) = (input.bounds.0.floor() as i32, input.bounds.1.ceil() as i32);
    // A plot without data has bounds without sense.
    (from..=to.min(from + 40))
        .flat_map(|d| {
            let fine = if to - from <= 3 { &[0.0, std::f64::consts::LOG10_2, 0.698_970_004][..] } else { &[0.0][..] };
            fine.iter().map(move |f| GridMark { value: f64::from(d) + f, step_size: if *f == 0.0 { 1.0 } else { 0.3 } })
        })
        .filter(|mark| (input.bounds.0..=input.bounds.1).contains(&mark.value))
        .collect()
}

fn power(mark: GridMark) -> String {
    significant(10_f64.powf(mark.value), 1)
}
