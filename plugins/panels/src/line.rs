//! A line that somebody draws over a picture, the values along it as a plot, and both as a table:
//! what the tools over slices and over the picture of light have in common.

use egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, Ui, Vec2};
use egui_plot::{FilledArea, Line, PlotPoint};

use crate::{
    Action,
    chart::{place, plot},
    colours,
    number::significant,
    saving::Taken,
};

/// Share of its colour that the band of standard errors has.
const PALE: f32 = 0.3;

/// Values along a line.
pub(crate) struct Along<'a> {
    /// What they are, for a legend.
    pub(crate) name: String,
    /// Unit of distances.
    pub(crate) axis: &'static str,
    /// Distance from the first end, value, and its standard error; infinite or no number: none is
    /// known.
    pub(crate) values: &'a [[f64; 3]],
    /// What is told of a place in the plot.
    pub(crate) told: fn(PlotPoint) -> String,
}

/// Where the pointer was pressed and where it is, as shares of a picture that is drawn at `place`;
/// none: it is not pressed.
pub(crate) fn dragged(ui: &Ui, place: Rect) -> Option<[Vec2; 2]> {
    let ends = ui.input(|i| Some([i.pointer.press_origin()?, i.pointer.interact_pos()?]))?;
    Some(ends.map(|at| (place.clamp(at) - place.min) / place.size()))
}

/// An outline that is seen on any ground.
pub(crate) fn outline(painter: &Painter, shape: impl Fn(Stroke) -> Shape) {
    for (width, colour) in [(4.0_f32, Color32::BLACK), (2.0, colours::SELECTED)] {
        painter.add(shape(Stroke::new(width, colour)));
    }
}

/// The line, with a dot at its first end.
pub(crate) fn draw(painter: &Painter, [from, to]: [Pos2; 2]) {
    outline(painter, |stroke| Shape::line_segment([from, to], stroke));
    painter.circle(from, 4.0, colours::SELECTED, (1.0, Color32::BLACK));
}

/// The plot, with a band of ± one standard error where errors are known.
pub(crate) fn show(ui: &mut Ui, along: &Along<'_>, height: f32) {
    let told = along.told;
    let chart = plot("along the line")
        .height(height)
        .x_axis_label(along.axis)
        .label_formatter(move |hover| Some(told(place(hover))));
    let shown = chart.show(ui, |chart| {
        bands(along.values).into_iter().for_each(|band| chart.add(band));
        let values: Vec<[f64; 2]> = along.values.iter().map(|[s, value, _]| [*s, *value]).collect();
        chart.line(Line::new(along.name.clone(), values).color(colours::PRIMAL).width(1.5));
    });
    let ends = along
        .values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v[1]), high.max(v[1])]);
    let [low, high] = ends.map(|v| significant(v, 4));
    shown.response.widget_info(|| {
        let said = tr!("{} values, {} to {}", along.values.len(), low, high);
        egui::WidgetInfo::labeled(egui::Role::Image, true, said)
    });
}

/// Values less and more their standard errors, one band for each piece of the line in which these
/// are known.
fn bands(values: &[[f64; 3]]) -> Vec<FilledArea> {
    let pieces = values.chunk_by(|a, b| a[2].is_finite() == b[2].is_finite());
    let known = pieces.filter(|piece| piece.iter().all(|v| v[2].is_finite()));
    let band = |piece: &[[f64; 3]]| {
        let ends = |sign: f64| -> Vec<f64> { piece.iter().map(|v| v[1] + sign * v[2]).collect() };
        let distances: Vec<f64> = piece.iter().map(|v| v[0]).collect();
        FilledArea::new(tr!("error"), &distances, &ends(-1.0), &ends(1.0))
            .fill_color(colours::PRIMAL.gamma_multiply(PALE))
            .allow_hover(false)
    };
    known.map(band).collect()
}

/// Buttons that take a table of this name along: on the clipboard, or into a file, which has to be
/// asked for.
pub(crate) fn taken(ui: &mut Ui, name: &'static str, csv: impl Fn() -> String) -> Option<Action> {
    if ui.small_button(tr!("Copy as table")).clicked() {
        // Spreadsheets part what is pasted at tabs.
        ui.ctx().copy_text(csv().replace(',', "\t"));
    }
    let saves = ui.small_button(tr!("Save as CSV…")).clicked();
    saves.then(|| Action::Save(Taken::Values(name, csv())))
}

#[cfg(test)]
mod tests {
    use egui_plot::PlotItem;

    use super::*;

    #[test]
    fn a_band_is_where_errors_are_known_and_as_wide_as_they_are() {
        let unknown = [f64::INFINITY, f64::NAN];
        let errors = [0.5, 1.0, unknown[0], unknown[1], 0.25, 0.25, 0.25];
        let values: Vec<[f64; 3]> =
            errors.iter().enumerate().map(|(k, error)| [k as f64, 10.0, *error]).collect();
        let found = bands(&values);
        let bounds: Vec<[f64; 4]> = found
            .iter()
            .map(|band| {
                let ([left, low], [right, high]) = (band.bounds().min(), band.bounds().max());
                [left, right, low, high]
            })
            .collect();
        assert_eq!(bounds, [[0.0, 1.0, 9.0, 11.0], [4.0, 6.0, 9.75, 10.25]]);
        assert!(bands(&values[2..4]).is_empty() && bands(&[]).is_empty());
    }
}
