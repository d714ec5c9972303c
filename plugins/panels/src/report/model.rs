//! The members in space, coloured by what is known of their zones so far.

use std::sync::Arc;

use egui::{Color32, Rect, Sense, TextureHandle, TextureOptions, Ui, pos2, vec2};
use glam::Vec3;
use intrados_damage::{
    verdict::Basis,
    zone::{ZONES, place as place_of},
};
use intrados_light::tone::ColourMap;
use intrados_report::surface::{Facet, facets};
use intrados_scene::{Camera, Scene};

use crate::{
    Action, Actions, Latest, Selection, colours,
    number::plus_minus,
    surface::{Drawn, Surface, bounds, draw, hand},
};

/// Added to values of members that are not the selected one: they are shown darker.
const ASIDE: f32 = -10.0;
/// Added to values that are only forecast: they are shown paler.
const FORECAST: f32 = 3.0;
/// Share of their brightness.
const DARKER: f32 = 0.45;

/// Width of the legend, points.
const LEGEND: f32 = 92.0;

/// What is remembered between frames.
#[derive(Default)]
pub(super) struct Model {
    /// Hash of the scene that the facets are of.
    of: String,
    facets: Arc<Vec<Facet>>,
    positions: Vec<Vec3>,
    camera: Option<Camera>,
    shown: Option<Shown>,
}

struct Shown {
    key: Key,
    drawn: Drawn,
    texture: TextureHandle,
}

#[derive(Clone, PartialEq)]
struct Key {
    damage: Vec<[Option<f64>; ZONES]>,
    forecast: Vec<[bool; ZONES]>,
    selection: Selection,
    camera: Camera,
    size: [usize; 2],
    over: usize,
}

impl Model {
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        rect: Rect,
        scene: &Arc<Scene>,
        latest: &Latest,
        selection: Selection,
        actions: &mut Actions,
    ) {
        if self.of != scene.hash {
            let facets = facets(scene);
            let positions = facets.iter().flat_map(|f| f.corners).collect();
            *self = Self {
                of: scene.hash.clone(),
                facets: Arc::new(facets),
                positions,
                ..Self::default()
            };
        }
        ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
        if self.facets.is_empty() {
            let font = egui::TextStyle::Body.resolve(ui.style());
            let text = "No member of this scene has a surface.";
            ui.painter().text(
                rect.center(),
                egui::Align2::CENTER_CENTER,
                text,
                font,
                ui.visuals().weak_text_color(),
            );
            return;
        }
        legend(ui, rect);
        let rect = rect.with_max_x((rect.right() - LEGEND).max(rect.left() + 40.0));
        let (width, height) = (rect.width().max(8.0) as u32, rect.height().max(8.0) as u32);
        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Image, true, "Damage of members")
        });
        let camera = match &self.camera {
            Some(camera) => Camera { width, height, ..camera.clone() },
            None => first(&self.positions, scene, [width, height]),
        };
        let camera = hand(ui, &response, rect, camera);
        self.camera = Some(camera.clone());
        self.redraw(ui, rect, latest, selection, camera, response.dragged());
        let Some(shown) = &self.shown else { return };
        ui.painter().image(
            shown.texture.id(),
            rect,
            Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)),
            Color32::WHITE,
        );
        let under = response.hover_pos().and_then(|at| {
            let share = (at - rect.min) / rect.size();
            self.facets.get(shown.drawn.face(share.x, share.y)? as usize).copied()
        });
        if response.clicked() {
            actions.ask(Action::Select(under.map(|f| f.member)));
        }
        if let Some(facet) = under {
            response.on_hover_ui_at_pointer(|ui| said(ui, scene, latest, facet));
        }
    }

    fn redraw(
        &mut self,
        ui: &Ui,
        rect: Rect,
        latest: &Latest,
        selection: Selection,
        camera: Camera,
        held: bool,
    ) {
        let members = self.facets.iter().map(|f| f.member + 1).max().unwrap_or(0);
        let zones = |member: usize| {
            latest.member(member).map_or([None; ZONES], |p| p.zones.0.map(|r| r.map(|r| r.value)))
        };
        let density = ui.ctx().pixels_per_point();
        let size =
            [rect.width() * density, rect.height() * density].map(|n| (n as usize).clamp(8, 4096));
        // Fine when nobody moves it.
        let forecast = |member: usize| {
            latest.member(member).map_or([false; ZONES], |p| p.basis.map(|b| b == Basis::Forecast))
        };
        let forecast = (0..members).map(forecast).collect();
        let key = Key {
            damage: (0..members).map(zones).collect(),
            forecast,
            selection,
            camera,
            size,
            over: if held { 1 } else { 2 },
        };
        if self.shown.as_ref().is_some_and(|s| s.key == key) {
            return;
        }
        let value = |f: &Facet| {
            let damage = key.damage[f.member][f.zone].map_or(f32::NAN, |d| d as f32);
            let damage = if key.forecast[f.member][f.zone] { damage + FORECAST } else { damage };
            if selection.0.is_some_and(|s| s != f.member) { damage + ASIDE } else { damage }
        };
        let values: Vec<f32> = self.facets.iter().flat_map(|f| [value(f); 3]).collect();
        let faces: Vec<[u32; 4]> = (0..self.facets.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2, 3 * i + 2])
            .collect();
        let surface =
            Surface { positions: &self.positions, values: &values, faces: &faces, mesh: false };
        let drawn = draw(&key.camera, key.size, key.over, &surface, colour);
        let texture = match self.shown.take() {
            Some(mut before) => {
                before.texture.set(drawn.image.clone(), TextureOptions::LINEAR);
                before.texture
            }
            None => ui.ctx().load_texture("damage", drawn.image.clone(), TextureOptions::LINEAR),
        };
        self.shown = Some(Shown { key, drawn, texture });
    }
}

/// From the scene's own camera's side, so that all members are seen.
fn first(positions: &[Vec3], scene: &Scene, [width, height]: [u32; 2]) -> Camera {
    let (low_high, theirs) = (bounds(positions), scene.cameras.first());
    let position = theirs.map_or(Vec3::new(0.9, 0.45, 1.1), |c| c.position - c.target);
    let camera = Camera {
        name: "report".into(),
        position,
        target: Vec3::ZERO,
        up: Vec3::Y,
        fov_deg: 32.0,
        width,
        height,
        exposure: 0.0,
        lens: None,
    };
    camera.framing(low_high)
}

fn colour(value: f32) -> [u8; 3] {
    let (value, dim) = if value < 0.5 * ASIDE { (value - ASIDE, DARKER) } else { (value, 1.0) };
    let (value, pale) =
        if value > 0.5 * FORECAST { (value - FORECAST, true) } else { (value, false) };
    let rgb = if value.is_nan() {
        colours::UNKNOWN.to_array().first_chunk().copied().unwrap_or([96; 3])
    } else {
        ColourMap::Viridis.at(value)
    };
    let rgb = if pale { colours::paler(rgb) } else { rgb };
    rgb.map(|c| (f32::from(c) * dim) as u8)
}

fn said(ui: &mut Ui, scene: &Scene, latest: &Latest, facet: Facet) {
    let Some(member) = scene.members.get(facet.member) else { return };
    ui.strong(&member.name);
    let zone = latest.member(facet.member).and_then(|p| p.zones.0[facet.zone]);
    match zone {
        Some(r) => {
            let basis = latest.member(facet.member).map_or("", |p| p.basis[facet.zone].name());
            ui.label(format!(
                "{} of the axis: d = {}, {basis}",
                place_of(facet.zone),
                plus_minus(r.value, r.std_error, "")
            ))
        }
        None => ui.weak("Nothing is known of it yet; that is not the same as sound."),
    };
}

/// Colours with their damages.
fn legend(ui: &Ui, rect: Rect) {
    const STEPS: usize = 48;
    let painter = ui.painter().with_clip_rect(rect);
    let height = (rect.height() * 0.55).clamp(50.0, 220.0);
    let bar = Rect::from_min_size(pos2(rect.right() - 60.0, rect.top() + 26.0), vec2(12.0, height));
    let y = |share: f32| bar.bottom() - bar.height() * share;
    for k in 0..STEPS {
        let [from, to] = [k, k + 1].map(|k| k as f32 / STEPS as f32);
        let [r, g, b] = ColourMap::Viridis.at(0.5 * (from + to));
        painter.rect_filled(
            Rect::from_min_max(pos2(bar.left(), y(to)), pos2(bar.right(), y(from) + 0.5)),
            0.0,
            Color32::from_rgb(r, g, b),
        );
    }
    let (font, ink) = (egui::TextStyle::Small.resolve(ui.style()), ui.visuals().text_color());
    for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
        painter.text(
            pos2(bar.right() + 5.0, y(tick)),
            egui::Align2::LEFT_CENTER,
            format!("{tick}"),
            font.clone(),
            ink,
        );
    }
    painter.text(
        pos2(rect.right() - 8.0, rect.top() + 8.0),
        egui::Align2::RIGHT_TOP,
        "damage d",
        font.clone(),
        ink,
    );
    let grey = Rect::from_min_size(pos2(bar.left(), bar.bottom() + 8.0), vec2(12.0, 10.0));
    painter.rect_filled(grey, 0.0, colours::UNKNOWN);
    painter.text(
        pos2(grey.left() - 4.0, grey.center().y),
        egui::Align2::RIGHT_CENTER,
        "unknown",
        font.clone(),
        ink,
    );
    let pale = grey.translate(vec2(0.0, 16.0));
    let [r, g, b] = colours::paler(ColourMap::Viridis.at(0.0));
    painter.rect_filled(pale, 0.0, Color32::from_rgb(r, g, b));
    painter.text(
        pos2(pale.left() - 4.0, pale.center().y),
        egui::Align2::RIGHT_CENTER,
        "forecast",
        font,
        ink,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_not_selected_is_darker_and_who_is_unknown_is_grey() {
        let (bright, dim) = (colour(0.7), colour(0.7 + ASIDE));
        assert!(bright.iter().zip(dim).all(|(b, d)| d <= *b) && bright != dim);
        let greyness = |rgb: [u8; 3]| rgb.iter().max().unwrap() - rgb.iter().min().unwrap();
        for damage in [0.0, 0.5, 1.0] {
            let (measured, forecast) = (colour(damage), colour(damage + FORECAST));
            assert!(
                greyness(forecast) < greyness(measured) && greyness(forecast) > 0,
                "{measured:?} {forecast:?}"
            );
        }
        let [r, g, b] = colour(f32::NAN);
        assert!(r == g && g == b);
    }
}
