//! Damage over the years of a life.

use egui::{Color32, Ui};
use egui_plot::{Line, PlotPoints, VLine};

use crate::{
    chart,
    lang::{fixed, local},
    moment::{Course, Moment},
};

/// Height, points.
const HEIGHT: f32 = 96.0;

/// The damage of the worst zone from its youth to the end of the forecast; now, and the moment that
/// is looked at, as lines.
pub(super) fn plot(ui: &mut Ui, course: &Course, moment: Moment) {
    let worst = |zones: &[f64]| zones.iter().copied().fold(0.0, f64::max);
    let points: Vec<[f64; 2]> = course.passed().iter().map(|(y, z)| [*y, worst(z)]).collect();
    let ink = ui.visuals().text_color();
    let width = ui.available_width().min(420.0);
    let plot = chart::plot("course")
        .height(HEIGHT)
        .width(width)
        .include_y(0.0)
        .include_y(0.2)
        .show_grid([false, true])
        .x_axis_formatter(|mark, _| local(format!("{}", mark.value)))
        .y_axis_formatter(|mark, _| local(format!("{}", mark.value)))
        .label_formatter(|hover| {
            let at = chart::place(hover);
            Some(tr!("in {} years: d = {}", fixed(at.x, 1), fixed(at.y, 2)))
        });
    let shown = plot.show(ui, |plot| {
        plot.line(Line::new("d", PlotPoints::from(points)).color(ink).width(2.0));
        plot.vline(VLine::new("now", 0.0).color(Color32::GRAY));
        if !moment.is_now() {
            plot.vline(VLine::new("then", moment.years).color(ink));
        }
    });
    let said = ui.weak(tr!("d of the worst zone by its life, over years from now"));
    chart::named(shown.response, &said);
}
