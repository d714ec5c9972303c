//! The member tree.

use bevy_ecs::prelude::*;
use egui::{Label, Role, ScrollArea, Ui, WidgetInfo};
use intrados_scene::{Member, MemberKind, Scene, plugin::CurrentScene};

use crate::{
    Action, Actions, Latest, Selection, colours,
    lang::{fixed, term},
    plus_minus,
    sheet::Properties,
};

/// Plural, for the group's heading.
fn plural(kind: MemberKind) -> String {
    match kind {
        MemberKind::Column => tr!("Columns"),
        MemberKind::Beam => tr!("Beams"),
        MemberKind::Slab => tr!("Slabs"),
        MemberKind::Wall => tr!("Walls"),
        MemberKind::Footing => tr!("Footings"),
        MemberKind::Lining => tr!("Linings"),
        MemberKind::Segment => tr!("Segments"),
        MemberKind::Tendon => tr!("Tendons"),
        MemberKind::Bar => tr!("Bars"),
        MemberKind::Pipe => tr!("Pipes"),
        MemberKind::Other => tr!("Others"),
    }
}

/// A button for every member that suits, for a tab that shows one; says `none` where no member
/// does.
pub(crate) fn choose(
    ui: &mut Ui,
    scene: &Scene,
    suits: impl Fn(&Member) -> bool,
    why: &str,
    none: &str,
    actions: &mut Actions,
) {
    let suiting: Vec<(usize, &str)> = scene
        .members
        .iter()
        .enumerate()
        .filter(|(_, m)| suits(m))
        .map(|(i, m)| (i, m.name.as_str()))
        .collect();
    if suiting.is_empty() {
        ui.label(none);
        return;
    }
    ui.label(why);
    ScrollArea::vertical().show(ui, |ui| {
        for (index, name) in suiting {
            if ui.button(name).clicked() {
                actions.ask(Action::Select(Some(index)));
            }
        }
    });
}

pub(crate) fn members(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    latest: Res<Latest>,
    properties: Res<Properties>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let scene = &scene.0;
    if scene.members.is_empty() {
        ui.weak(tr!("This scene has no structural members."));
        return;
    }
    progress(ui, &latest, &mut actions);
    let mut kinds: Vec<MemberKind> = scene.members.iter().map(|m| m.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        for kind in kinds {
            let group: Vec<(usize, &Member)> =
                scene.members.iter().enumerate().filter(|(_, m)| m.kind == kind).collect();
            // A thousand bars must not push the columns out of sight.
            let open = group.len() <= 24;
            let heading = format!("{} ({})", plural(kind), group.len());
            egui::CollapsingHeader::new(heading).id_salt(kind).default_open(open).show(ui, |ui| {
                for (index, member) in group {
                    let is_typed = properties.is_typed(scene, &member.id);
                    row(ui, (index, member), is_typed, *selection, &latest, &mut actions);
                }
            });
        }
    });
}

fn row(
    ui: &mut Ui,
    (index, member): (usize, &Member),
    is_typed: bool,
    selection: Selection,
    latest: &Latest,
    actions: &mut Actions,
) {
    let selected = selection.0 == Some(index);
    let right_to_left = egui::Layout::right_to_left(egui::Align::Center);
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    ui.push_id(index, |ui| {
        ui.allocate_ui_with_layout(size, right_to_left, |ui| {
            if let (Some(known), Some((verdict, steps))) =
                (latest.member(index), latest.state(index))
            {
                let damage = known.damage;
                let hint = tr!(
                    "{}: damage d = {}",
                    term(&verdict.state),
                    plus_minus(damage.value, damage.std_error, "")
                );
                let value = ui.label(fixed(damage.value, 2)).on_hover_text(hint);
                if latest.is_interim(index) {
                    value.on_hover_text(interim(latest));
                    ui.label("…").on_hover_text(interim(latest));
                }
                colours::severity(ui, verdict, steps);
            }
            if is_typed {
                let mark = ui.add(Label::new("✏").selectable(false));
                let what = tr!("Something is typed into its form and not applied");
                mark.widget_info(|| WidgetInfo::labeled(Role::Label, true, &what));
                mark.on_hover_text(&what);
            }
            let rest = egui::Layout::left_to_right(egui::Align::Center)
                .with_main_justify(true)
                .with_main_align(egui::Align::Min);
            ui.with_layout(rest, |ui| {
                let label = ui
                    .add(egui::Button::selectable(selected, &member.name).truncate())
                    .on_hover_ui(|ui| hint(ui, member));
                if label.clicked() {
                    actions.ask(Action::Select((!selected).then_some(index)));
                }
                if label.double_clicked() {
                    actions.ask(Action::Select(Some(index)));
                    actions.ask(Action::Frame);
                }
            });
        });
    });
}

fn hint(ui: &mut Ui, member: &Member) {
    ui.strong(&member.name);
    let size = member.bounds[1] - member.bounds[0];
    let [x, y, z] = size.to_array().map(|x| fixed(x, 2));
    ui.label(format!("{x} × {y} × {z} m"));
    ui.label(if member.concrete_assumed {
        tr!("{} (assumed)", member.concrete)
    } else {
        member.concrete.clone()
    });
    ui.weak(tr!("Click to select, double-click to look at it"));
}

/// Says that a number may still change.
pub(crate) fn interim(latest: &Latest) -> String {
    tr!("Interim: {} of {} pieces of work are done", latest.pieces.0, latest.pieces.1)
}

/// How far the prediction is, and how to go on where it was cancelled.
pub(crate) fn progress(ui: &mut Ui, latest: &Latest, actions: &mut Actions) {
    let (done, all) = latest.pieces;
    if latest.is_done() {
        return;
    }
    if !latest.cancelled {
        ui.weak(tr!("Reading CT slices, computing lives: {} of {}", done, all));
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(tr!("⏹ Prediction cancelled: {} of {} done", done, all));
        let hint = tr!("Goes on where it was cancelled");
        if ui.button(tr!("▶ Predict on")).on_hover_text(hint).clicked() {
            actions.ask(Action::Predict);
        }
    });
}
