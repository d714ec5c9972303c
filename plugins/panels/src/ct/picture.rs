//! The slice itself: zoom, pan, window and tools by dragging, pores by clicking.

use egui::{Color32, PointerButton, Rect, Response, Sense, TextureOptions, Ui, Vec2, pos2, vec2};

use super::{Ct, Probe, Shown, draw, source::Read};
use crate::{
    colours,
    lang::{fixed, term},
    legend::Legend,
    number::{percent, significant},
    zoom::Zoom,
};

/// A click so many points beside a pore still means it.
const REACH: f32 = 6.0;
pub(super) fn show(ui: &mut Ui, ct: &mut Ct, rect: Rect, unit: &str) {
    let (strip, rect) = rect.split_top_bottom_at_y(rect.top() + 18.0);
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let busy = ct.task.is_some();
    let Some(Ok(shown)) = &mut ct.shown else {
        let middle = Rect::from_center_size(rect.center(), vec2(rect.width() - 20.0, 40.0));
        ui.scope_builder(egui::UiBuilder::new().max_rect(middle), |ui| match &ct.shown {
            Some(Err(reason)) => drop(ui.label(tr!("⚠ This slice cannot be shown: {}", reason))),
            _ => drop(ui.vertical_centered(egui::Ui::spinner)),
        });
        return;
    };
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, tr!("CT slice")));
    let size = vec2(shown.read.slice.grey.width as f32, shown.read.slice.grey.height as f32);
    hand(ui, &response, &mut ct.view, &mut ct.window, &mut ct.probe, &shown.read, rect, size);
    let is_drawing = response.dragged_by(PointerButton::Primary);
    ct.probe.refresh(&shown.read, is_drawing, &mut shown.probed);
    let window = ct.window.unwrap_or_else(|| shown.read.suitable());
    refresh(shown, window, ct.overlay);
    let place = ct.view.place(rect, size);
    let painter = ui.painter().with_clip_rect(rect);
    let all = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(shown.grey.1.id(), place, all, Color32::WHITE);
    painter.image(shown.labels.1.id(), place, all, Color32::WHITE);
    let scale = place.width() / size.x;
    let pixel = |at: egui::Pos2| (at - place.min) / scale;
    if response.clicked()
        && let Some(at) = response.interact_pointer_pos().map(pixel)
    {
        ct.picked = shown.read.pore_at(at.x, at.y, (REACH / scale).max(1.0));
        ct.follow = true;
    }
    if let Some(pore) =
        ct.picked.and_then(|label| shown.read.found.pores.iter().find(|p| p.label == label))
    {
        let mm = scale / shown.read.slice.pixel_mm;
        let at = place.min + mm * vec2(pore.x_mm as f32, pore.y_mm as f32);
        let radius = 0.6 * mm * pore.diameter_mm as f32 + 5.0;
        for (width, colour) in [(4.0, Color32::BLACK), (2.0, colours::SELECTED)] {
            painter.circle_stroke(at, radius, (width, colour));
        }
    }
    ct.probe.draw(&painter, place, scale / shown.read.slice.pixel_mm);
    legend(ui, rect, window, unit);
    ruler(ui, rect, scale / shown.read.slice.pixel_mm);
    let caption = match response.hover_pos().map(pixel).and_then(|at| under(&shown.read, at, unit))
    {
        Some(text) => text,
        None if busy => tr!("reading…"),
        None => shown.read.caption(),
    };
    let (pores, cracks) = (shown.read.found.pores.len(), shown.read.found.cracks.len());
    ui.scope_builder(egui::UiBuilder::new().max_rect(strip), |ui| {
        ui.horizontal(|ui| {
            for (said, colour) in
                [(tr!("{} pores", pores), draw::PORE), (tr!("{} cracks", cracks), draw::CRACK)]
            {
                let (swatch, _) = ui.allocate_exact_size(vec2(14.0, 10.0), Sense::hover());
                ui.painter().rect_filled(swatch.shrink2(vec2(0.0, 2.0)), 1.0, colour);
                ui.label(said);
            }
            ui.separator();
            ui.add(egui::Label::new(egui::RichText::new(caption).weak()).truncate());
        });
    });
}

/// Left button pans, or draws where a tool is on; middle button pans; right button changes window
/// and level, the wheel zooms at the pointer, a double click shows all.
fn hand(
    ui: &Ui,
    response: &Response,
    view: &mut Zoom,
    window: &mut Option<[f32; 2]>,
    probe: &mut Probe,
    read: &Read,
    rect: Rect,
    size: Vec2,
) {
    let delta = response.drag_delta();
    if response.dragged_by(PointerButton::Secondary) {
        let [low, high] = window.unwrap_or_else(|| read.suitable());
        let unit = read.suitable()[1];
        let width = ((high - low) * (0.005 * delta.x).exp()).max(0.01 * unit);
        let level = 0.5 * (low + high) - 0.002 * unit * delta.y;
        *window = Some([level - 0.5 * width, level + 0.5 * width]);
    } else if probe.is_on() && response.dragged_by(PointerButton::Primary) {
        probe.drag(ui, view.place(rect, size), size * read.slice.pixel_mm);
    } else if response.dragged() {
        view.pull(delta, rect, size);
    }
    view.hand(ui, response, rect, size);
}

/// New pixels where window or labels have changed.
fn refresh(shown: &mut Shown, window: [f32; 2], overlay: draw::Overlay) {
    if shown.grey.0 != window {
        shown.grey.0 = window;
        shown.grey.1.set(draw::grey(&shown.read, window), TextureOptions::NEAREST);
    }
    if shown.labels.0 != overlay {
        shown.labels.0 = overlay;
        shown.labels.1.set(draw::labels(&shown.read, overlay), TextureOptions::NEAREST);
    }
}

/// What is at a pixel.
fn under(read: &Read, at: Vec2, unit: &str) -> Option<String> {
    let grey = &read.slice.grey;
    let inside =
        at.x >= 0.0 && at.y >= 0.0 && (at.x as usize) < grey.width && (at.y as usize) < grey.height;
    let i = inside.then(|| at.y as usize * grey.width + at.x as usize)?;
    let mm = at * read.slice.pixel_mm;
    let unit = if unit == "grey" { String::new() } else { format!(" {unit}") };
    let value = significant(f64::from(grey.data[i]), 3) + &unit;
    let mut text = tr!("{}, {} mm: {}", fixed(mm.x, 1), fixed(mm.y, 1), value);
    if read.found.body.data[i] {
        text += &tr!(", {} of the matrix", percent(f64::from(read.found.grey.data[i])));
    }
    if read.found.crack_mask.data[i] {
        text += &tr!(", crack");
    } else if let Some(pore) =
        read.found.pores.iter().find(|p| p.label == read.found.labels.data[i])
    {
        text += &tr!(
            ", pore of {} mm, {} mm deep",
            significant(pore.diameter_mm, 2),
            significant(pore.depth_mm, 2)
        );
    }
    Some(text)
}

/// What greys and outlines mean, and what is shown, for a file.
pub(super) fn printed(read: &Read, [low, high]: [f32; 2], unit: &str, what: &str) -> Legend {
    let number = |share: f32| significant(f64::from(low + share * (high - low)), 3);
    let marks = [0.0, 1.0, 0.5].map(|share| (share, number(share)));
    let ink = |colour: Color32| [colour.r(), colour.g(), colour.b()];
    let (pores, cracks) = (read.found.pores.len(), read.found.cracks.len());
    let samples = vec![
        (ink(draw::PORE), tr!("{} pores", pores)),
        (ink(draw::CRACK), tr!("{} cracks", cracks)),
    ];
    let lines = vec![term(unit), what.to_owned()];
    Legend::plain((0..=u8::MAX).map(|grey| [grey; 3]).collect(), marks.into(), samples, lines)
}

/// Grey with its values.
fn legend(ui: &Ui, rect: Rect, [low, high]: [f32; 2], unit: &str) {
    const STEPS: usize = 32;
    let painter = ui.painter().with_clip_rect(rect);
    let bar = Rect::from_min_size(
        pos2(rect.right() - 18.0, rect.top() + 24.0),
        vec2(10.0, (0.35 * rect.height()).clamp(40.0, 160.0)),
    );
    for k in 0..STEPS {
        let y = |k: usize| bar.bottom() - bar.height() * k as f32 / STEPS as f32;
        let grey = Color32::from_gray((255.0 * (k as f32 + 0.5) / STEPS as f32) as u8);
        painter.rect_filled(
            Rect::from_min_max(pos2(bar.left(), y(k + 1)), pos2(bar.right(), y(k) + 0.5)),
            0.0,
            grey,
        );
    }
    painter.rect_stroke(bar, 0.0, (1.0, Color32::GRAY), egui::StrokeKind::Outside);
    for k in 0..=2 {
        let value = low + (high - low) * k as f32 / 2.0;
        let at = pos2(bar.left() - 5.0, bar.bottom() - bar.height() * k as f32 / 2.0);
        label(&painter, ui, at, egui::Align2::RIGHT_CENTER, significant(f64::from(value), 3));
    }
    label(&painter, ui, pos2(bar.right(), bar.top() - 8.0), egui::Align2::RIGHT_BOTTOM, term(unit));
}

/// A round number of millimetres.
fn ruler(ui: &Ui, rect: Rect, points_per_mm: f32) {
    let wanted = 0.22 * rect.width() / points_per_mm.max(1e-6);
    let decade = 10_f32.powf(wanted.log10().floor());
    let mm = [5.0, 2.0, 1.0].into_iter().find(|d| d * decade <= wanted).unwrap_or(1.0) * decade;
    let painter = ui.painter().with_clip_rect(rect);
    let from = pos2(rect.left() + 10.0, rect.bottom() - 10.0);
    let to = from + vec2(mm * points_per_mm, 0.0);
    for (width, colour) in [(5.0, Color32::BLACK), (3.0, Color32::WHITE)] {
        painter.line_segment([from, to], (width, colour));
    }
    label(
        &painter,
        ui,
        from + vec2(0.0, -6.0),
        egui::Align2::LEFT_BOTTOM,
        format!("{} mm", significant(f64::from(mm), 1)),
    );
}

/// Text that can be read on any grey.
fn label(painter: &egui::Painter, ui: &Ui, at: egui::Pos2, align: egui::Align2, text: String) {
    let font = egui::TextStyle::Small.resolve(ui.style());
    let galley = painter.layout_no_wrap(text, font, Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(2.0), 2.0, Color32::from_black_alpha(150));
    painter.galley(rect.min, galley, Color32::WHITE);
}
