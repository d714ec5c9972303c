//! The start screen.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use egui::{Button, RichText, ScrollArea, TextFormat, Ui, text::LayoutJob};
use intrados_scene::{Card, cards, plugin::CurrentScene};
use intrados_stage::Jobs;

use crate::{Action, Actions, dialog::Dialogs, lang::term, log, recent::Recent};

/// The bundled scenes: those with structural members first.
#[derive(Debug)]
pub(crate) struct Cards(Vec<Card>);

impl FromWorld for Cards {
    fn from_world(_: &mut World) -> Self {
        Self(cards())
    }
}

/// Draws the start screen. `path` is what has been typed into its field.
pub(crate) fn start(
    InMut(ui): InMut<Ui>,
    cards: Local<Cards>,
    mut path: Local<String>,
    recent: Res<Recent>,
    scene: Option<Res<CurrentScene>>,
    dialogs: Res<Dialogs>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let actions = &mut *actions;
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let margin = ((ui.available_width() - 900.0) / 2.0).max(12.0) as i8;
        egui::Frame::new().inner_margin(egui::Margin::symmetric(margin, 28)).show(ui, |ui| {
            ui.label(RichText::new("Intrados").size(34.0).strong());
            ui.label(tr!("Predicts damage in columns, beams and tunnel linings, and shows it."));
            ui.add_space(18.0);
            if let Some(scene) = scene
                && ui.button(tr!("⬅ Back to {}", scene.0.name)).clicked()
            {
                actions.ask(Action::StartScreen(false));
            }
            open_row(ui, &mut path, dialogs.is_open(), actions);
            ui.add_space(8.0);
            log::list(ui, jobs.bypass_change_detection());
            ui.add_space(14.0);
            let (structures, tests): (Vec<&Card>, Vec<&Card>) =
                cards.0.iter().partition(|c| c.has_members);
            section(ui, &tr!("Structures"), &structures, actions);
            section(ui, &tr!("Test scenes of light transport"), &tests, actions);
            recent_files(ui, recent.list(), actions);
        });
    });
}

fn open_row(ui: &mut Ui, path: &mut String, dialog_is_open: bool, actions: &mut Actions) {
    ui.horizontal_wrapped(|ui| {
        let button =
            Button::new(RichText::new(tr!("Open…")).size(16.0)).min_size(egui::vec2(110.0, 34.0));
        if ui.add_enabled(!dialog_is_open, button).on_hover_text("Ctrl+O").clicked() {
            actions.ask(Action::Choose);
        }
        let new = Button::new(RichText::new(tr!("New structure…")).size(16.0));
        let hint = tr!("From a template of a column, a beam or a tunnel (Ctrl+N)");
        if ui.add(new.min_size(egui::vec2(110.0, 34.0))).on_hover_text(hint).clicked() {
            actions.ask(Action::New);
        }
        ui.label(tr!("or drop a .ron, .glb, .gltf or .ifc file here, or its path:"));
        let field = egui::TextEdit::singleline(path).desired_width(240.0);
        let field = ui.add(field.hint_text(tr!("path of a file")));
        let field = field.on_hover_text(tr!("path of a file"));
        let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let go = ui.add_enabled(!path.trim().is_empty(), Button::new(tr!("Open path")));
        if (entered || go.clicked()) && !path.trim().is_empty() {
            actions.ask(Action::Open(PathBuf::from(path.trim())));
        }
    });
}

fn section(ui: &mut Ui, title: &str, cards: &[&Card], actions: &mut Actions) {
    if cards.is_empty() {
        return;
    }
    ui.label(RichText::new(title).size(17.0).strong());
    ui.add_space(4.0);
    let columns = ((ui.available_width() / 290.0) as usize).clamp(1, 3);
    let width = (ui.available_width() - (columns - 1) as f32 * ui.spacing().item_spacing.x)
        / columns as f32;
    for row in cards.chunks(columns) {
        ui.horizontal(|ui| {
            for card in row {
                let button = Button::new(text(ui, card))
                    .right_text("")
                    .wrap()
                    .min_size(egui::vec2(width, 64.0))
                    .corner_radius(6.0);
                if ui.add_sized([width, 64.0], button).clicked() {
                    actions.ask(Action::Open(PathBuf::from(card.name)));
                }
            }
        });
    }
    ui.add_space(14.0);
}

/// Name and title, in two lines.
fn text(ui: &Ui, card: &Card) -> LayoutJob {
    let format = |size: f32, colour| TextFormat {
        font_id: egui::FontId::proportional(size),
        color: colour,
        ..Default::default()
    };
    let mut job = LayoutJob::default();
    job.append(card.name, 0.0, format(16.0, ui.visuals().strong_text_color()));
    job.append("\n", 0.0, format(12.0, ui.visuals().text_color()));
    job.append(&term(&card.title), 0.0, format(12.5, ui.visuals().text_color()));
    job
}

fn recent_files(ui: &mut Ui, recent: &[PathBuf], actions: &mut Actions) {
    if recent.is_empty() {
        return;
    }
    ui.label(RichText::new(tr!("Recent")).size(17.0).strong());
    for (i, path) in recent.iter().enumerate() {
        ui.push_id(i, |ui| {
            ui.horizontal(|ui| {
                if recent_button(ui, path).clicked() {
                    actions.ask(Action::Open(path.clone()));
                }
                if ui.small_button("✖").on_hover_text(tr!("Take it off this list")).clicked() {
                    actions.ask(Action::Forget(path.clone()));
                }
            });
        });
    }
}

/// A file that is gone is greyed.
pub(crate) fn recent_button(ui: &mut Ui, path: &Path) -> egui::Response {
    let is_there = path.exists();
    let button = ui.add_enabled(is_there, Button::new(path.display().to_string()).frame(false));
    if is_there {
        button
    } else {
        button.on_disabled_hover_text(tr!("This file is not there any more"))
    }
}
