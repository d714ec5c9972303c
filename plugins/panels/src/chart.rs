//! What the plots have in common.

use egui::{Response, Role, Ui, WidgetInfo};
use egui_plot::{GridInput, GridMark, HoverPosition, Plot, PlotPoint};

use crate::number::significant;

/// One entry of a legend.
pub(crate) fn key(ui: &mut Ui, name: &str, colour: egui::Color32, dashed: bool) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(22.0, 10.0), egui::Sense::hover());
    let line = [rect.left_center(), rect.right_center()];
    if dashed {
        ui.painter().extend(egui::Shape::dashed_line(&line, (2.0, colour), 5.0, 3.0));
    } else {
        ui.painter().line_segment(line, (2.0, colour));
    }
    ui.weak(name);
}

/// Where the pointer is in the plot.
pub(crate) fn place(hover: &HoverPosition<'_>) -> PlotPoint {
    match hover {
        HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position } => {
            *position
        }
    }
}

/// A plot that only looks: it neither scrolls nor zooms.
pub(crate) fn plot<'a>(id: &str) -> Plot<'a> {
    Plot::new(id.to_owned())
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .y_axis_min_width(40.0)
}

/// Lets what is written beside a plot be its name, for those who hear the window.
pub(crate) fn named(plot: Response, by: &Response) {
    plot.widget_info(|| WidgetInfo::new(Role::Image));
    plot.labelled_by(by.id);
}

/// A plot of log₁₀ of something by log₁₀ of CPU-seconds.
pub(crate) fn by_cpu_seconds<'a>(id: &str) -> Plot<'a> {
    plot(id)
        .x_grid_spacer(decades)
        .y_grid_spacer(decades)
        .x_axis_formatter(|mark, _| power(mark))
        .y_axis_formatter(|mark, _| power(mark))
        .label_formatter(|hover| {
            let p = place(hover);
            Some(tr!(
                "{} after {} CPU-s",
                significant(10_f64.powf(p.y), 2),
                significant(10_f64.powf(p.x), 2)
            ))
        })
}

/// Grid lines at 1, 2, 5, 10, … of a logarithmic axis.
pub(crate) fn decades(input: GridInput) -> Vec<GridMark> {
    let (from, to) = (input.bounds.0.floor() as i32, input.bounds.1.ceil() as i32);
    // A plot without data has bounds without sense.
    (from..=to.min(from + 40))
        .flat_map(|d| {
            let fine = if to - from <= 3 {
                &[0.0, std::f64::consts::LOG10_2, 0.698_970_004][..]
            } else {
                &[0.0][..]
            };
            fine.iter().map(move |f| GridMark {
                value: f64::from(d) + f,
                step_size: if *f == 0.0 { 1.0 } else { 0.3 },
            })
        })
        .filter(|mark| (input.bounds.0..=input.bounds.1).contains(&mark.value))
        .collect()
}

/// What a mark of a logarithmic axis says.
pub(crate) fn power(mark: GridMark) -> String {
    significant(10_f64.powf(mark.value), 1)
}
