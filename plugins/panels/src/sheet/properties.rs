//! The form of what a scene's file says of a member, or of the whole structure: its values are
//! changed here and written there.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{Button, Ui};
use intrados_scene::{Member, Scene, attach::fields};

use super::part;
use crate::{Action, Actions, lang::term, values::Values};

/// What has been typed; of another member or another scene it is begun anew.
#[derive(Resource, Default)]
pub(crate) struct Properties {
    /// The scene's hash, and the member's id.
    of: (String, Option<String>),
    values: Values,
}

impl Properties {
    /// Draws it.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        scene: &Arc<Scene>,
        member: Option<&Member>,
        actions: &mut Actions,
    ) {
        let of = (scene.hash.clone(), member.map(|m| m.id.clone()));
        if self.of != of {
            *self = Self { of, values: Values::new(fields(scene, member)) };
        }
        if self.values.is_empty() {
            return;
        }
        let of_member = "Concrete, size, bars, loads";
        let name = member.map_or("Owner, inspection, air", |_| of_member);
        part(ui, name, false, |ui| {
            if scene.path.exists() {
                self.send(ui, scene, member, actions);
            } else {
                ui.weak(tr!("This scene is part of the program: \
                     “New structure…” makes one that is yours."));
            }
            ui.add_enabled_ui(scene.path.exists(), |ui| self.values.show(ui));
        });
    }

    /// The buttons, and what keeps them from being pressed.
    fn send(&mut self, ui: &mut Ui, scene: &Scene, member: Option<&Member>, actions: &mut Actions) {
        let count = self.values.changed();
        let of = member.map_or(scene.name.as_str(), |m| m.name.as_str());
        let filled = self.values.settings();
        let file = scene.path.file_name().unwrap_or_default().to_string_lossy();
        ui.horizontal_wrapped(|ui| {
            let hint = tr!(
                "Writes them into {}, where comments stay, and predicts again. \
                 Ctrl+Z takes it back.",
                file
            );
            let apply = ui.add_enabled(count > 0 && filled.is_ok(), Button::new(tr!("Apply")));
            if apply.on_hover_text(hint).clicked()
                && let Ok((settings, names)) = &filled
            {
                let what = tr!("change {} of {}", names, of);
                actions.ask(Action::Amend(settings.clone(), what));
            }
            if ui.add_enabled(count > 0, Button::new(tr!("Discard"))).clicked() {
                self.values.discard();
            }
            match (&filled, count) {
                (Err(why), _) => ui.label(format!("⚠ {}", term(&why.to_string()))),
                (Ok(_), 0) => ui.weak(tr!("as in {}", file)),
                (Ok(_), 1) => ui.label(tr!("one value changed")),
                (Ok(_), n) => ui.label(tr!("{} values changed", n)),
            }
        });
    }
}
