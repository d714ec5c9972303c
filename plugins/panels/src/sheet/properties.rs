//! The form of what a scene's file says of a member, or of the whole structure: its values are
//! changed here and written there.

use std::{path::PathBuf, sync::Arc};

use bevy_ecs::prelude::*;
use egui::{Button, Ui};
use intrados_scene::{Member, Scene, attach::fields};
use serde::{Deserialize, Serialize};

use super::part;
use crate::{
    Action, Actions,
    lang::term,
    values::{Typed, Values},
};

/// What has been typed; of another member or another scene it is begun anew.
#[derive(Resource, Default)]
pub(crate) struct Properties {
    /// The scene's file, and the member's id.
    of: (PathBuf, Option<String>),
    /// The scene's hash, another one where its evidence or its file has changed.
    hash: String,
    values: Values,
    /// What another session has left, and the file of the scene that it is of; it waits until its
    /// form is drawn.
    left: Option<(PathBuf, Unapplied)>,
}

/// What has been typed into the form and is not applied.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Unapplied {
    /// The member's id; none: it is of the whole structure.
    member: Option<String>,
    typed: Vec<Typed>,
}

impl Properties {
    /// What has been typed of this scene and is not applied, if anything is.
    pub(crate) fn unapplied(&self, scene: &Scene) -> Option<Unapplied> {
        let left = self.left.as_ref().filter(|(of, _)| *of == scene.path);
        if let Some((_, left)) = left {
            return Some(left.clone());
        }
        let (of, member) = &self.of;
        let typed = self.values.typed();
        let is_typed = *of == scene.path && !typed.is_empty();
        is_typed.then(|| Unapplied { member: member.clone(), typed })
    }

    /// Goes on with what another session has left of this scene.
    pub(crate) fn go_on(&mut self, scene: &Scene, left: Unapplied) {
        *self = Self { left: Some((scene.path.clone(), left)), ..Self::default() };
    }

    /// Draws it.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        scene: &Arc<Scene>,
        member: Option<&Member>,
        actions: &mut Actions,
    ) {
        let of = (scene.path.clone(), member.map(|m| m.id.clone()));
        if self.of != of {
            self.values = Values::new(fields(scene, member));
        } else if self.hash != scene.hash {
            self.values.renew(fields(scene, member));
        }
        (self.of, self.hash) = (of, scene.hash.clone());
        let left = self.left.take_if(|(of, left)| (&*of, &left.member) == (&self.of.0, &self.of.1));
        if let Some((_, left)) = left {
            self.values.type_again(&left.typed);
        }
        if self.values.is_empty() {
            return;
        }
        let of_member = "Concrete, size, bars, loads";
        let name = member.map_or("Owner, inspection, air", |_| of_member);
        // What another session has left is seen at once.
        part(ui, name, self.values.changed() > 0, |ui| {
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
