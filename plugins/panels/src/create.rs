//! A new structure from a template: its values, a picture of it as it will be, and the folder that
//! is made.

use std::path::{Path, PathBuf};

use bevy_ecs::prelude::*;
use egui::{Button, ScrollArea, Ui, vec2};
use intrados_scene::attach::{Draft, Setting};
use intrados_stage::{Jobs, Task};

use crate::{
    Action, Actions,
    destination::Destination,
    lang::{fixed, term},
    structure::Preview,
    values::Values,
};

/// What it takes of the window at most, points.
const SIZE: (f32, f32) = (860.0, 560.0);
/// What lies above and below the fields, points.
const AROUND: f32 = 150.0;
/// What the name and the button beside the field of the folder take each, points.
const BESIDE: f32 = 120.0;

/// The dialog.
#[derive(Resource, Default)]
pub(crate) struct Creation {
    pub(crate) is_open: bool,
    kind: &'static str,
    values: Values,
    /// Where folders are proposed.
    documents: PathBuf,
    /// Where it will be; as it was proposed, until somebody types.
    to: Destination,
    proposed: String,
    draft: Option<Draft>,
    preview: Preview,
    /// What the draft has been made of, or is being made of.
    tried: Option<Vec<Setting>>,
    drafting: Option<Task<Result<Draft, String>>>,
    making: Option<Task<Result<PathBuf, String>>>,
    /// What is wrong with what was typed, or could not be written.
    why: String,
}

impl Creation {
    /// Opens it.
    /// Folders are proposed in `documents`.
    pub(crate) fn begin(&mut self, documents: PathBuf) {
        *self = Self { is_open: true, documents, ..Self::default() };
        self.choose(Draft::KINDS[0]);
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.drafting.is_some() || self.making.is_some()
    }

    fn choose(&mut self, kind: &'static str) {
        if self.to.path == self.proposed {
            self.proposed = free(&self.documents, kind).display().to_string();
            self.to.path.clone_from(&self.proposed);
        }
        (self.kind, self.values) = (kind, Values::default());
        (self.draft, self.tried, self.drafting) = (None, None, None);
        self.why.clear();
    }

    /// Where it would go.
    pub(crate) fn proposal(&self) -> String {
        self.to.path.clone()
    }

    /// A folder of the same name where a dialog says.
    pub(crate) fn put(&mut self, above: &Path) {
        let name = Path::new(self.to.path.trim()).file_name().map(|n| n.to_string_lossy());
        let folder = free(above, name.as_deref().unwrap_or(self.kind));
        self.to.propose(folder.display().to_string());
    }

    /// Makes the draft anew where something else has been typed.
    fn draft(&mut self, jobs: &mut Jobs) {
        if self.drafting.is_some() {
            return;
        }
        let settings = match self.values.settings() {
            Ok((settings, _)) => settings,
            Err(why) => {
                self.why = why;
                return;
            }
        };
        if self.tried.as_ref() == Some(&settings) {
            return;
        }
        self.tried = Some(settings.clone());
        let kind = self.kind;
        self.drafting = Some(Task::spawn_unlisted(jobs, tr!("drafting"), move |job| {
            Draft::new(kind, &settings, job).map_err(|why| why.to_string())
        }));
    }

    fn make(&mut self, jobs: &mut Jobs) {
        let Some(draft) = self.draft.clone() else { return };
        let folder = PathBuf::from(self.to.path.trim());
        self.making = Some(Task::spawn(jobs, tr!("making the structure"), move |_| {
            draft.write(&folder).map_err(|why| why.to_string())
        }));
    }
}

/// A folder of this name, or numbered, that is not there yet.
fn free(above: &Path, name: &str) -> PathBuf {
    let named = |n: u32| if n == 1 { above.join(name) } else { above.join(format!("{name} {n}")) };
    (1..100).map(named).find(|path| !path.exists()).unwrap_or_else(|| named(1))
}

/// Takes drafts and what was made.
pub(crate) fn take(mut creation: ResMut<Creation>, mut actions: ResMut<Actions>) {
    let creation = creation.bypass_change_detection();
    match Task::take(&mut creation.drafting) {
        Some(Ok(Ok(draft))) => {
            if creation.values.is_empty() {
                creation.values = Values::new(draft.fields());
            }
            creation.draft = Some(draft);
            creation.why.clear();
        }
        Some(Ok(Err(why))) => creation.why = why,
        Some(Err(_)) | None => {}
    }
    match Task::take(&mut creation.making) {
        Some(Ok(Ok(path))) => {
            creation.is_open = false;
            actions.ask(Action::Open(path));
        }
        Some(Ok(Err(why))) => creation.why = why,
        Some(Err(_)) | None => {}
    }
}

/// Draws it.
pub(crate) fn dialog(
    InMut(ui): InMut<Ui>,
    mut creation: ResMut<Creation>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let creation = creation.bypass_change_detection();
    let jobs = jobs.bypass_change_detection();
    let screen = ui.ctx().content_rect();
    let size = vec2((screen.width() - 60.0).min(SIZE.0), (screen.height() - 70.0).min(SIZE.1));
    ui.set_width(size.x);
    ui.horizontal_wrapped(|ui| {
        let names = [tr!("A column"), tr!("A beam"), tr!("A tunnel")];
        for (kind, name) in Draft::KINDS.into_iter().zip(names) {
            if ui.selectable_label(creation.kind == kind, name).clicked() && creation.kind != kind {
                creation.choose(kind);
            }
        }
    });
    ui.separator();
    let height = (size.y - AROUND).max(80.0);
    ui.horizontal_top(|ui| {
        let left = (0.42 * size.x).min(340.0);
        // Not as the row lies: groups of fields would stand beside each other.
        let down = egui::Layout::top_down(egui::Align::Min);
        ui.allocate_ui_with_layout(vec2(left, height), down, |ui| {
            ui.set_width(left);
            let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            area.auto_shrink(false).show(ui, |ui| creation.values.show(ui));
        });
        let (rect, _) = ui.allocate_exact_size(
            vec2((size.x - left - 10.0).max(40.0), height),
            egui::Sense::hover(),
        );
        match &creation.draft {
            Some(draft) => {
                let mut inner = ui.new_child(egui::UiBuilder::new().max_rect(rect));
                creation.preview.show(&mut inner, rect, &draft.scene, jobs);
            }
            None => drop(ui.put(rect, egui::Spinner::new())),
        }
    });
    creation.draft(jobs);
    ui.separator();
    send(ui, creation, jobs, &mut actions);
}

/// Where it goes, the buttons, and what keeps them from being pressed.
fn send(ui: &mut Ui, creation: &mut Creation, jobs: &mut Jobs, actions: &mut Actions) {
    let is_entered = ui.horizontal(|ui| {
        let width = (ui.available_width() - 2.0 * BESIDE).max(80.0);
        let is_entered = creation.to.field(ui, tr!("Folder to make"), width);
        if ui.button(tr!("Browse…")).clicked() {
            actions.ask(Action::ChooseStructureFolder);
        }
        is_entered
    });
    let is_entered = is_entered.inner;
    let is_there = Path::new(creation.to.path.trim()).exists();
    let is_current = !creation.is_busy() && creation.why.is_empty() && creation.draft.is_some();
    ui.horizontal_wrapped(|ui| {
        let may = is_current && !is_there && !creation.to.path.trim().is_empty();
        let hint = tr!("Makes the folder, with scene.ron and evidence.ron in it, and opens it");
        let make = ui.add_enabled(may, Button::new(tr!("Make it"))).on_hover_text(hint);
        if make.clicked() || is_entered && may {
            creation.make(jobs);
        }
        if ui.button(tr!("Cancel")).clicked() {
            creation.is_open = false;
        }
        if !creation.why.is_empty() {
            ui.label(format!("⚠ {}", term(&creation.why)));
        } else if is_there {
            ui.label(tr!("⚠ This folder is there already: choose another."));
        } else if let Some(draft) = &creation.draft {
            ui.weak(measures(draft));
        }
    });
}

/// How large it is.
fn measures(draft: &Draft) -> String {
    let members = &draft.scene.members;
    let volume: f64 = members.iter().map(|m| m.volume).sum();
    let count = members.len();
    let of = if count == 1 { tr!("one member") } else { tr!("{} members", count) };
    tr!("{}, {} m³ of concrete, {} t", of, fixed(volume, 2), fixed(2.5 * volume, 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_structure_gets_a_folder_of_its_own_where_somebody_says() {
        let above = tempfile::tempdir().unwrap();
        let mut creation = Creation::default();
        creation.begin(above.path().join("documents"));
        assert_eq!(Path::new(&creation.proposal()), above.path().join("documents/column"));
        creation.to.path = "elsewhere/pier ".into();
        creation.put(above.path());
        assert_eq!(Path::new(&creation.to.path), above.path().join("pier"));
        std::fs::create_dir(above.path().join("pier")).unwrap();
        creation.put(above.path());
        assert_eq!(Path::new(&creation.to.path), above.path().join("pier 2"));
    }
}
