//! The slider through the life of a structure: its pours, the days on which somebody looked, today,
//! and the years that were forecast.

use egui::{Button, Rect, Response, Shape, Slider, Stroke, Ui, pos2, vec2};
use intrados_stage::time::{DAY, YEAR};

use crate::{
    Action, Actions, Jump,
    lang::fixed,
    moment::{Moment, Timeline},
};

/// Width of the slider, points.
const WIDTH: f32 = 240.0;
/// Half of a mark, points.
const MARK: f32 = 3.0;

/// When it is looked at. Only equilibria are offered: there is nothing between.
pub(super) fn bar(
    ui: &mut Ui,
    moment: &mut Moment,
    timeline: &Timeline,
    is_playing: bool,
    actions: &mut Actions,
) {
    let Some([first, last]) = timeline.range() else { return };
    let hint = tr!("Damage as it is known now");
    let is_now = ui.selectable_label(moment.is_now(), tr!("Now")).on_hover_text(hint).clicked();
    if is_now {
        *moment = Moment::default();
    }
    let may = |to| timeline.after(to, moment.years).is_some();
    let [is_after, is_before] = [may(Jump::Back), may(Jump::Forward)];
    jump(ui, "⏮", tr!("The first equilibrium (Ctrl+Home)"), (Jump::First, is_after), actions);
    jump(ui, "◀", tr!("The equilibrium before (,)"), (Jump::Back, is_after), actions);
    ui.spacing_mut().slider_width = WIDTH;
    let mut years = moment.years;
    let slider = ui.add(Slider::new(&mut years, first..=last).show_value(false));
    slider.widget_info(|| egui::WidgetInfo::slider(true, years, tr!("Years from now")));
    if slider.changed() {
        moment.years = timeline.nearest(years, moment.years);
    }
    marks(ui, &slider, [first, last], timeline);
    let is_held = is_now || slider.changed();
    slider.on_hover_text(tr!(
        "Equilibria of the members' lives. Below: pours; above: days on which something was seen or read; the line: now."
    ));
    jump(ui, "▶", tr!("The next equilibrium (.)"), (Jump::Forward, is_before), actions);
    jump(ui, "⏭", tr!("The last equilibrium (Ctrl+End)"), (Jump::Last, is_before), actions);
    let name = if is_playing { tr!("⏸ Pause") } else { tr!("▶ Play") };
    let play =
        ui.button(name).on_hover_text(tr!("All equilibria from here, one after another (P)"));
    // Whoever takes the slider wants to stay where it is put.
    if play.clicked() || is_held && is_playing {
        actions.ask(Action::Play);
    }
    ui.strong(told(moment.years, timeline));
    if moment.years > 0.0 && !moment.is_now() {
        let hint = tr!(
            "Damage by the forecast then less that of now, instead of what is known now and what is forecast beyond it"
        );
        ui.toggle_value(&mut moment.added, tr!("Only what is added")).on_hover_text(hint);
    }
}

/// A button to another equilibrium; whether there is one.
fn jump(
    ui: &mut Ui,
    sign: &str,
    hint: String,
    (to, is_there): (Jump, bool),
    actions: &mut Actions,
) {
    let button = ui.add_enabled(is_there, Button::new(sign).small()).on_hover_text(hint);
    if button.clicked() {
        actions.ask(Action::Jump(to));
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

/// Writes when that is into the corner of a picture.
pub(super) fn write(ui: &Ui, rect: Rect, years: f64, timeline: &Timeline) {
    let font = egui::TextStyle::Body.resolve(ui.style());
    let (at, ink) = (rect.left_top() + vec2(14.0, 12.0), ui.visuals().strong_text_color());
    ui.painter().text(at, egui::Align2::LEFT_TOP, told(years, timeline), font, ink);
}

/// When that is, in words; with the year where anybody says what day now is.
pub(super) fn told(years: f64, timeline: &Timeline) -> String {
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
