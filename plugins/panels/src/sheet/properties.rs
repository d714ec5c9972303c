//! The form of what a scene's file says of a member, or of the whole structure: its values are
//! changed here and written there.

use std::{collections::BTreeMap, path::PathBuf, sync::Arc};

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

/// So many other forms are named that something is typed in.
const NAMED: usize = 4;

/// What has been typed of a scene, form by form. It stays until it is applied or discarded, or until
/// another scene is opened.
#[derive(Resource, Default)]
pub(crate) struct Properties {
    /// The scene's file.
    scene: PathBuf,
    /// The scene's hash, another one where its evidence or its file has changed.
    hash: String,
    /// The form that is shown, and what it is of: a member's id; none: the whole structure.
    values: Values,
    of: Option<String>,
    /// What has been typed into the others.
    others: BTreeMap<Option<String>, Vec<Typed>>,
}

/// What has been typed into a form and is not applied.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Unapplied {
    /// The member's id; none: it is of the whole structure.
    member: Option<String>,
    typed: Vec<Typed>,
}

impl Properties {
    /// What has been typed of this scene and is not applied.
    pub(crate) fn unapplied(&self, scene: &Scene) -> Vec<Unapplied> {
        if self.scene != scene.path {
            return Vec::new();
        }
        let typed = self.values.typed();
        let shown = (!typed.is_empty()).then_some((&self.of, &typed));
        let all = self.others.iter().chain(shown);
        all.map(|(of, typed)| Unapplied { member: of.clone(), typed: typed.clone() }).collect()
    }

    /// Whether something has been typed of a member of this scene and is not applied.
    pub(crate) fn is_typed(&self, scene: &Scene, member: &str) -> bool {
        let is = |of: &Option<String>| of.as_deref() == Some(member);
        let is_shown = is(&self.of) && self.values.changed() > 0;
        self.scene == scene.path && (is_shown || self.others.keys().any(is))
    }

    /// Goes on with what another session has left of this scene.
    pub(crate) fn go_on(&mut self, scene: &Scene, left: Vec<Unapplied>) {
        let others = left.into_iter().map(|left| (left.member, left.typed)).collect();
        *self = Self { scene: scene.path.clone(), others, ..Self::default() };
    }

    /// Goes to the form of a member or of the structure, as the file is now.
    fn turn_to(&mut self, scene: &Scene, member: Option<&Member>) {
        if self.scene != scene.path {
            *self = Self { scene: scene.path.clone(), ..Self::default() };
        }
        let of = member.map(|m| m.id.clone());
        if self.of == of && self.hash == scene.hash {
            return;
        }
        let typed = self.values.typed();
        if !typed.is_empty() {
            self.others.insert(self.of.take(), typed);
        }
        if self.hash != scene.hash {
            self.others = still_typed(std::mem::take(&mut self.others), scene);
        }
        let typed = self.others.remove(&of).unwrap_or_default();
        self.values = Values::again(fields(scene, member), &typed);
        (self.of, self.hash) = (of, scene.hash.clone());
    }

    /// Draws it.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        scene: &Arc<Scene>,
        member: Option<&Member>,
        actions: &mut Actions,
    ) {
        self.turn_to(scene, member);
        self.elsewhere(ui, scene, actions);
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

    /// Which other forms wait to be applied, and the way there.
    fn elsewhere(&self, ui: &mut Ui, scene: &Scene, actions: &mut Actions) {
        if self.others.is_empty() {
            return;
        }
        ui.horizontal_wrapped(|ui| {
            ui.label(tr!("✏ Typed and not applied:"));
            for of in self.others.keys().take(NAMED) {
                let name = of.as_deref().map_or(scene.name.as_str(), |id| scene.name_of(id));
                if ui.link(name).clicked() {
                    let place = |id: &String| scene.members.iter().position(|m| m.id == *id);
                    actions.ask(Action::Select(of.as_ref().and_then(place)));
                }
            }
            let more = self.others.len().saturating_sub(NAMED);
            if more > 0 {
                ui.label(tr!("and {} more", more));
            }
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

/// What is typed still, as the file is now.
fn still_typed(
    typed: BTreeMap<Option<String>, Vec<Typed>>,
    scene: &Scene,
) -> BTreeMap<Option<String>, Vec<Typed>> {
    let again = |(of, typed): (Option<String>, Vec<Typed>)| {
        let member = match &of {
            Some(id) => Some(scene.members.iter().find(|m| m.id == *id)?),
            None => None,
        };
        let typed = Values::again(fields(scene, member), &typed).typed();
        (!typed.is_empty()).then_some((of, typed))
    };
    typed.into_iter().filter_map(again).collect()
}
