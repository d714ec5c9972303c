//! The member tree.

use bevy_ecs::prelude::*;
use egui::{ScrollArea, Ui};
use intrados_scene::{Member, MemberKind, plugin::CurrentScene};

use crate::{Action, Actions, Predicted, Selection, colours};

/// Plural, for the group's heading.
pub(crate) fn plural(kind: MemberKind) -> &'static str {
    match kind {
        MemberKind::Column => "Columns",
        MemberKind::Beam => "Beams",
        MemberKind::Slab => "Slabs",
        MemberKind::Wall => "Walls",
        MemberKind::Footing => "Footings",
        MemberKind::Lining => "Linings",
        MemberKind::Segment => "Segments",
        MemberKind::Tendon => "Tendons",
        MemberKind::Bar => "Bars",
        MemberKind::Pipe => "Pipes",
        MemberKind::Other => "Others",
    }
}

pub(crate) fn members(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    predicted: Res<Predicted>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    if scene.members.is_empty() {
        ui.weak("This scene has no structural members.");
        return;
    }
    predict_button(ui, &predicted, &mut actions);
    let mut kinds: Vec<MemberKind> = scene.members.iter().map(|m| m.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        for kind in kinds {
            let group: Vec<(usize, &Member)> = scene.members.iter().enumerate().filter(|(_, m)| m.kind == kind).collect();
            // A thousand bars must not push the columns out of sight.
            let open = group.len() <= 24;
            let heading = format!("{} ({})", plural(kind), group.len());
            egui::CollapsingHeader::new(heading).id_salt(kind).default_open(open).show(ui, |ui| {
                for (index, member) in group {
                    row(ui, index, member, *selection, &predicted, &mut actions);
                }
            });
        }
    });
}

fn row(ui: &mut Ui, index: usize, member: &Member, selection: Selection, predicted: &Predicted, actions: &mut Actions) {
    ui.push_id(index, |ui| {
        ui.horizontal(|ui| {
            let selected = selection.0 == Some(index);
            let label = ui.selectable_label(selected, &member.name).on_hover_ui(|ui| hint(ui, member));
            if label.clicked() {
                actions.ask(Action::Select((!selected).then_some(index)));
            }
            if label.double_clicked() {
                actions.ask(Action::Select(Some(index)));
                actions.ask(Action::Frame);
            }
            if let Some((name, step, steps)) = predicted.state(index) {
                colours::severity(ui, step, steps, name);
                ui.small(name);
            }
            if let Some(damage) = predicted.result.as_ref().and_then(|r| r.members.get(index)?.damage) {
                ui.weak(format!("d {damage:.2}"));
            }
        });
    });
}

fn hint(ui: &mut Ui, member: &Member) {
    let size = member.bounds[1] - member.bounds[0];
    ui.label(format!("{} × {} × {} m", short(size.x), short(size.y), short(size.z)));
    let assumed = if member.concrete_assumed { " (assumed)" } else { "" };
    ui.label(format!("{}{assumed}", member.concrete));
    ui.weak("Click to select, double-click to look at it");
}

fn short(x: f32) -> String {
    format!("{x:.2}")
}

/// Asks for the prediction where there is none.
pub(crate) fn predict_button(ui: &mut Ui, predicted: &Predicted, actions: &mut Actions) {
    if predicted.is_busy() {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.weak("Predicting damage…");
        });
    } else if predicted.result.is_none() {
        let button =
            ui.button("Predict damage").on_hover_text("Reads all evidence (today: CT slices) and gives every member a damage and a state");
        if button.clicked() {
            actions.ask(Action::Predict);
        }
    }
    if let Some(failure) = &predicted.failure {
        ui.label(failure);
    }
}
