//! The Structure panel: all members in space, coloured by damage. A click goes to a member's sheet.

mod model;

use bevy_ecs::prelude::*;
use egui::{Rect, Ui, vec2};
use glam::Vec3;
use intrados_scene::plugin::CurrentScene;

use crate::{Action, Actions, Latest, Selection};

/// Where the structure is looked at from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum View {
    /// From the same side, so that the selected member, or all of them, fill the picture.
    Framed,
    /// As at first.
    Home,
    /// From a side: from there to the middle.
    Along(Vec3),
}

/// Sides, by their names and keys.
const SIDES: [(&str, Vec3); 3] = [
    ("Front", Vec3::new(0.0, 0.06, 1.0)),
    ("Side", Vec3::new(1.0, 0.06, 0.0)),
    ("Top", Vec3::new(0.0, 1.0, 0.02)),
];

/// What the panel remembers.
#[derive(Resource)]
pub(crate) struct Structure {
    model: model::Model,
    /// Whether members are named in the picture.
    pub(crate) names: bool,
    wished: Option<View>,
}

impl Default for Structure {
    fn default() -> Self {
        Self { model: model::Model::default(), names: true, wished: None }
    }
}

impl Structure {
    pub(crate) fn look(&mut self, view: View) {
        self.wished = Some(view);
    }
}

pub(crate) fn structure(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    selection: Res<Selection>,
    mut structure: ResMut<Structure>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let rect = ui.available_rect_before_wrap();
    let structure = structure.bypass_change_detection();
    if let Some(view) = structure.wished.take() {
        let member = if view == View::Framed { selection.0 } else { None };
        structure.model.go(view, &scene.0, member);
    }
    let names = structure.names;
    structure.model.show(ui, rect, &scene.0, &latest, *selection, names, &mut actions);
    let bar = Rect::from_min_size(rect.min + vec2(8.0, 8.0), vec2(rect.width() - 16.0, 24.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(bar), |ui| {
        ui.horizontal(|ui| tools(ui, structure, *selection, &mut actions));
    });
}

/// Where to look from, and whether names are shown.
fn tools(ui: &mut Ui, structure: &mut Structure, selection: Selection, actions: &mut Actions) {
    egui::Frame::popup(ui.style()).inner_margin(4).show(ui, |ui| {
        let all = ui.button("All").on_hover_text("The whole structure (Home)");
        if all.clicked() {
            actions.ask(Action::Home);
        }
        let hint = "The selected member fills the picture (F)";
        let member = ui.add_enabled(selection.0.is_some(), egui::Button::new("Selected"));
        if member.on_hover_text(hint).clicked() {
            actions.ask(Action::Frame);
        }
        for (name, axis) in SIDES {
            if ui.button(name).clicked() {
                structure.look(View::Along(axis));
            }
        }
        ui.toggle_value(&mut structure.names, "Names")
            .on_hover_text("Name and damage of every member, the worst first");
    });
}
