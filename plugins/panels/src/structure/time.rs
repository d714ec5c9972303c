//! The slider through the life of a structure: its pours, the days on which somebody looked, today,
//! and the years that were forecast.

use egui::{Button, Response, Shape, Slider, Stroke, Ui, pos2};
use intrados_stage::time::{DAY, YEAR};

use crate::{
    lang::fixed,
    moment::{Moment, Timeline},
};

/// Width of the slider, points.
const WIDTH: f32 = 240.0;
/// Half of a mark, points.
const MARK: f32 = 3.0;

/// When it is looked at. Only equilibria are offered: there is nothing between.
pub(super) fn bar(ui: &mut Ui, moment: &mut Moment, timeline: &Timeline) {
    let Some([first, last]) = timeline.range() else { return };
    let hint = tr!("Damage as it is known now");
    if ui.selectable_label(moment.is_now(), tr!("Now")).on_hover_text(hint).clicked() {
        *moment = Moment::default();
    }
    step(ui, "◀", &tr!("The equilibrium before"), timeline.beyond(moment.years, false), moment);
    ui.spacing_mut().slider_width = WIDTH;
    let mut years = moment.years;
    let slider = ui.add(Slider::new(&mut years, first..=last).show_value(false));
    slider.widget_info(|| egui::WidgetInfo::slider(true, years, tr!("Years from now")));
    if slider.changed() {
        moment.years = timeline.nearest(years, moment.years);
    }
    marks(ui, &slider, [first, last], timeline);
    slider.on_hover_text(tr!(
        "Equilibria of the members' lives. Below: pours; above: days on which something was seen or read; the line: now."
    ));
    step(ui, "▶", &tr!("The next equilibrium"), timeline.beyond(moment.years, true), moment);
    ui.strong(told(moment.years, timeline));
    if moment.years > 0.0 && !moment.is_now() {
        let hint = tr!(
            "Damage by the forecast then less that of now, instead of what is known now and what is forecast beyond it"
        );
        ui.toggle_value(&mut moment.added, tr!("Only what is added")).on_hover_text(hint);
    }
}

fn step(ui: &mut Ui, sign: &str, hint: &str, to: Option<f64>, moment: &mut Moment) {
    let button = ui.add_enabled(to.is_some(), Button::new(sign).small()).on_hover_text(hint);
    if let Some(to) = to.filter(|_| button.clicked()) {
        moment.years = to;
    }
}

/// Pours, looks and today, beside the slider.
fn marks(ui: &Ui, slider: &Response, [first, last]: [f64; 2], timeline: &Timeline) {
    let rect = slider.rect;
    // As egui lays its handle: its middle never comes nearer to the ends than its radius.
    let inner = rect.shrink2(egui::vec2(rect.height() / 2.5, 0.0));
    let x = |years: f64| inner.left() + inner.width() * ((years - first) / (last - first)) as f32;
    let within = |years: &&f64| (first..=last).contains(*years);
    let ink = ui.visuals().text_color();
    let painter = ui.painter();
    painter.vline(x(0.0), rect.y_range(), Stroke::new(1.5, ui.visuals().strong_text_color()));
    for years in timeline.pours.iter().filter(within) {
        let tip = pos2(x(*years), rect.bottom() - 2.0 * MARK);
        let foot = [-MARK, MARK].map(|by| pos2(tip.x + by, rect.bottom()));
        painter.add(Shape::convex_polygon(vec![tip, foot[1], foot[0]], ink, Stroke::NONE));
    }
    for years in timeline.looks.iter().filter(within) {
        painter.circle_filled(pos2(x(*years), rect.top() + MARK), 0.8 * MARK, ink);
    }
}

/// When that is, in words; with the year where anybody says what day now is.
fn told(years: f64, timeline: &Timeline) -> String {
    let [days, months] = [YEAR / DAY, 12.0].map(|by| fixed(years.abs() * by, 0));
    let said = match (years > 0.0, years.abs()) {
        (_, span) if span < 0.5 * DAY / YEAR => tr!("now"),
        (true, span) if span < 1.0 / 12.0 => tr!("in {} days", days),
        (true, span) if span < 2.0 => tr!("in {} months", months),
        (true, span) => tr!("in {} years", fixed(span, 0)),
        (false, span) if span < 1.0 / 12.0 => tr!("{} days ago", days),
        (false, span) if span < 2.0 => tr!("{} months ago", months),
        (false, span) => tr!("{} years ago", fixed(span, 0)),
    };
    match timeline.today {
        Some(today) => {
            let day = today.plus_days((years * YEAR / DAY) as i64).to_string();
            format!("{said} ({})", day.split('-').next().unwrap_or_default())
        }
        None => said,
    }
}
