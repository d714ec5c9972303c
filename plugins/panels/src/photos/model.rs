//! The member as a drawing, to say which of its corners is meant.

use egui::{Color32, Rect, Sense, Ui, pos2, vec2};
use glam::{DMat3, DVec3};
use intrados_photo::corner::Outline;

use crate::{colours, lang::term};

/// A click so many points beside a corner still means it.
const REACH: f32 = 12.0;

/// How the member is turned: about the upright axis, and up, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn(pub(super) [f64; 2]);

impl Default for Turn {
    fn default() -> Self {
        Self([0.5, 0.35])
    }
}

/// Draws the member's edges and numbered corners, y upwards; a drag turns it. The corner that was
/// clicked.
pub(super) fn show(
    ui: &mut Ui,
    outline: &Outline,
    turn: &mut Turn,
    armed: Option<usize>,
    is_picked: impl Fn(usize) -> bool,
    height: f32,
) -> Option<usize> {
    let size = vec2(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Image, true, tr!("Corners of the member"))
    });
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    if response.dragged() {
        let delta = response.drag_delta();
        turn.0[0] -= 0.01 * f64::from(delta.x);
        turn.0[1] = (turn.0[1] + 0.01 * f64::from(delta.y)).clamp(-1.5, 1.5);
    }
    let ends = || outline.edges.iter().flatten().chain(&outline.corners);
    let (low, high) =
        ends().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    if !(high - low).is_finite() {
        ui.put(rect, egui::Label::new(tr!("no edges")));
        return None;
    }
    let rotation = DMat3::from_rotation_x(turn.0[1]) * DMat3::from_rotation_y(turn.0[0]);
    let middle = 0.5 * (low + high);
    let flat = |p: DVec3| rotation * (p - middle);
    let far = ends()
        .map(|p| flat(*p))
        .fold([1e-9_f64; 2], |m, p| [m[0].max(p.x.abs()), m[1].max(p.y.abs())]);
    let scale =
        (0.42 * f64::from(rect.width()) / far[0]).min(0.42 * f64::from(rect.height()) / far[1]);
    let at = |p: DVec3| {
        let p = scale * flat(p);
        rect.center() + vec2(p.x as f32, -p.y as f32)
    };
    let painter = ui.painter().with_clip_rect(rect);
    let line = ui.visuals().weak_text_color();
    for [a, b] in &outline.edges {
        painter.line_segment([at(*a), at(*b)], (1.0, line));
    }
    let font = egui::TextStyle::Small.resolve(ui.style());
    for (k, corner) in outline.corners.iter().enumerate() {
        let at = at(*corner);
        let colour = match (armed == Some(k), is_picked(k)) {
            (true, _) => colours::SELECTED,
            (false, true) => PICKED,
            (false, false) => ui.visuals().text_color(),
        };
        painter.circle_filled(at, if armed == Some(k) { 6.0 } else { 4.0 }, colour);
        // Away from the middle, so that it does not lie on the edges.
        let out = (at - rect.center()).normalized();
        let place = at + 11.0 * if out.is_finite() { out } else { vec2(1.0, 0.0) };
        painter.text(place, egui::Align2::CENTER_CENTER, k + 1, font.clone(), colour);
    }
    for (name, middle) in face_middles(outline) {
        // Those that are turned away would be read through those before them.
        if flat(middle).z > 0.0 {
            let colour = ui.visuals().weak_text_color();
            painter.text(at(middle), egui::Align2::CENTER_CENTER, term(name), font.clone(), colour);
        }
    }
    let clicked = response.clicked().then(|| response.interact_pointer_pos()).flatten()?;
    let near = |k: &usize| at(outline.corners[*k]).distance(clicked);
    let nearest = (0..outline.corners.len()).min_by(|a, b| near(a).total_cmp(&near(b)))?;
    (near(&nearest) < REACH).then_some(nearest)
}

/// Names of the flat faces and the middles of their corners, m.
fn face_middles(outline: &Outline) -> Vec<(&str, DVec3)> {
    let mut names: Vec<&str> = Vec::new();
    // The last word of a corner's name is its end.
    for name in outline.names.iter().flat_map(|words| words.split_last()).flat_map(|(_, f)| f) {
        if !name.ends_with('°') && !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let middle = |name: &str| {
        let is_own = |words: &[String]| words.iter().any(|word| word == name);
        let own = outline.corners.iter().zip(&outline.names).filter(|(_, words)| is_own(words));
        let (sum, n) = own.fold((DVec3::ZERO, 0.0), |(sum, n), (at, _)| (sum + *at, n + 1.0));
        sum / n
    };
    names.into_iter().map(|name| (name, middle(name))).collect()
}

/// What was picked.
pub(super) const PICKED: Color32 = Color32::from_rgb(255, 60, 200);

/// A cross with a number, that is seen on any ground.
pub(super) fn cross(painter: &egui::Painter, at: egui::Pos2, name: &str, colour: Color32) {
    for (width, colour) in [(3.5, Color32::BLACK), (1.5, colour)] {
        painter.line_segment([at - vec2(8.0, 0.0), at + vec2(8.0, 0.0)], (width, colour));
        painter.line_segment([at - vec2(0.0, 8.0), at + vec2(0.0, 8.0)], (width, colour));
    }
    let font = egui::FontId::proportional(12.0);
    let galley = painter.layout_no_wrap(name.to_owned(), font, colour);
    let rect = Rect::from_min_size(pos2(at.x + 7.0, at.y - 17.0), galley.size());
    painter.rect_filled(rect.expand(1.0), 2.0, Color32::from_black_alpha(150));
    painter.galley(rect.min, galley, colour);
}
