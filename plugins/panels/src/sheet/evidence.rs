//! The list of what is known of a member, with its dates, and what became of it.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::Ui;
use intrados_damage::{evidence::called, ledger::Group};
use intrados_predict::Prediction;
use intrados_scene::{
    Member, Scene, Slices,
    attach::{Listed, listed},
};

use crate::{
    Action, Actions,
    lang::{fixed, measured, term},
};

/// Rows shown at first.
const SHOWN: usize = 12;

/// What a scene knows of its members, listed once a scene.
#[derive(Resource, Default)]
pub(crate) struct Listing {
    of: String,
    all: Vec<Listed>,
    is_long: bool,
}

impl Listing {
    /// Draws what is known of a member.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        scene: &Arc<Scene>,
        member: &Member,
        result: Option<&Arc<Prediction>>,
        actions: &mut Actions,
    ) {
        if self.of != scene.hash {
            (self.of, self.all) = (scene.hash.clone(), listed(scene));
        }
        let own: Vec<&Listed> = self.all.iter().filter(|l| l.member == member.id).collect();
        if own.is_empty() && member.slices.is_empty() {
            ui.weak(tr!("Nothing was measured on it, nobody has looked at it."));
        }
        let is_made = |s: &&Slices| matches!(s, Slices::Drawn { .. } | Slices::Scanned { .. });
        if member.slices.iter().any(|s| is_made(&s)) {
            ui.label(tr!(
                "CT slices that the program makes itself of what the scene plants in it."
            ));
        }
        let shown = if self.is_long { own.len() } else { SHOWN };
        for one in own.iter().take(shown) {
            row(ui, one, actions);
        }
        if own.len() > SHOWN {
            let text = if self.is_long { tr!("fewer") } else { tr!("all {}", own.len()) };
            if ui.link(text).clicked() {
                self.is_long = !self.is_long;
            }
        }
        let Some(result) = result else { return };
        let items: Vec<_> =
            result.items.iter().filter(|i| i.member == member.id).cloned().collect();
        for group in Group::all(&items) {
            let first = group.first();
            let mark = if first.used { "✔" } else { "⚠" };
            let source = term(called(first.source));
            let verdict = match &first.why {
                None => tr!("used"),
                Some(why) => tr!("not used, because {}", measured(why)),
            };
            ui.label(format!("{mark} {source}, {}: {verdict}", term(&group.name())));
        }
    }
}

/// One thing that is known: when, what, where, how much.
fn row(ui: &mut Ui, one: &Listed, actions: &mut Actions) {
    ui.horizontal_wrapped(|ui| {
        let hint = tr!("Detach “{}”; Ctrl+Z attaches it again", one.name);
        let detach = ui.small_button("✖").on_hover_text(&hint);
        detach.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &hint));
        if detach.clicked() {
            actions.ask(Action::Detach(one.member.clone(), one.name.clone()));
        }
        let undated = || format!("{:10}", tr!("undated"));
        ui.monospace(one.date.map_or_else(undated, |d| d.to_string()));
        ui.strong(term(one.kind));
        ui.label(value(one)).on_hover_text(&one.name);
        ui.weak(place(one));
    });
}

/// How much, for people. A photograph has the name of its file there.
fn value(one: &Listed) -> String {
    if one.kind == "photograph" { one.value.clone() } else { measured(&one.value) }
}

/// Where on the member, for people.
fn place(one: &Listed) -> String {
    let along = one.along.map(|[from, to]| {
        if from.to_bits() == to.to_bits() {
            tr!("at {} %", fixed(100.0 * from, 0))
        } else {
            format!("{}–{} %", fixed(100.0 * from, 0), fixed(100.0 * to, 0))
        }
    });
    let face = one.face.as_deref().map(term);
    let side = face.or_else(|| one.angle_deg.map(|a| format!("{}°", fixed(a, 0))));
    let height = one.height_m.map(|h| tr!("{} m up", fixed(h, 2)));
    [along, side, height].into_iter().flatten().collect::<Vec<_>>().join(", ")
}
