//! What is let go over the window.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use egui::{Panel as Side, ScrollArea, Ui};
use intrados_scene::plugin::CurrentScene;

use crate::{
    Action, Actions, Banners, Log, Selection,
    attach::{self, Form},
    dialog,
    structure::{Spot, Structure},
    toast::Toasts,
    workspace::Desk,
};

/// So long it is waited for the pointer: systems say where files were let go only once it moves
/// again.
const PATIENCE: Duration = Duration::from_millis(400);

/// So many photographs have a button of their own; the others stand in a list of this height,
/// points.
const MOST: usize = 6;
const LIST: f32 = 300.0;

/// What was let go.
#[derive(Resource, Default)]
pub(crate) struct Drops {
    /// Waits for its place.
    coming: Option<(Vec<PathBuf>, Instant)>,
    /// Photographs of which one is shown: others wait, or they may be slices.
    doubtful: Option<Doubtful>,
}

/// What was taken for photographs.
#[derive(Clone)]
struct Doubtful {
    /// The scene that was open.
    scene: PathBuf,
    files: Vec<PathBuf>,
    /// Which of them is shown.
    shown: PathBuf,
    /// Whether they may be slices as well: they were let go on no member.
    may_be_slices: bool,
}

/// Takes what was let go: evidence belongs to the member under the pointer, or else to the selected
/// one, a photograph is placed first, a model is opened.
pub(crate) fn take(ui: &Ui, world: &mut World) {
    let dropped: Vec<PathBuf> =
        ui.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
    let mut drops = world.resource_mut::<Drops>();
    if !dropped.is_empty() {
        drops.coming = Some((dropped, Instant::now()));
    }
    let Some((files, since)) = drops.coming.take() else { return };
    let at = ui.input(|i| i.pointer.latest_pos());
    if at.is_none() && since.elapsed() < PATIENCE {
        drops.coming = Some((files, since));
        ui.ctx().request_repaint_after(Duration::from_millis(30));
        return;
    }
    let spot = at.and_then(|at| under(world, at));
    for action in meant(world, &files, spot) {
        world.resource_mut::<Actions>().ask(action);
    }
}

/// The place on a member that is at a point of the window.
fn under(world: &World, at: egui::Pos2) -> Option<Spot> {
    let rect = world.resource::<Desk>().place("Structure")?;
    world.resource::<Structure>().spot(at).filter(|_| rect.contains(at))
}

/// What whoever let these files go there wants. No file is passed over without a word.
fn meant(world: &mut World, files: &[PathBuf], spot: Option<Spot>) -> Vec<Action> {
    let Some(last) = files.last() else { return Vec::new() };
    // A model may come with files of its own, its textures among them.
    if let Some(model) = files.iter().rfind(|file| is_model(file)) {
        if files.len() > 1 {
            let said = tr!("of {} files that were let go, {} is opened", files.len(), name(model));
            world.resource_mut::<Toasts>().say(said.clone());
            world.resource_mut::<Log>().say(said);
        }
        return vec![Action::Open(model.clone())];
    }
    let evidence: Option<Vec<Vec<PathBuf>>> = files.iter().map(|p| attach::evidence(p)).collect();
    let are_photographs = files.iter().all(|file| dialog::is_photograph(file));
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let Some(scene) = scene else {
        if !are_photographs && evidence.is_none() {
            return alone(world, files);
        }
        let why = tr!("photographs, slices and tables are of a structure: open it first");
        world.resource_mut::<Banners>().cannot(&tr!("Not opened"), &why);
        return Vec::new();
    };
    let mut form = world.resource_mut::<Form>();
    if let (true, Some(evidence)) = (form.is_open, &evidence) {
        form.add(evidence.concat());
        return Vec::new();
    }
    let there = spot.and_then(|spot| Some((spot, scene.members.get(spot.member)?)));
    let has_member = there.is_some() || world.resource::<Selection>().0.is_some();
    let select = there.map(|(spot, _)| Action::Select(Some(spot.member)));
    let then = match evidence {
        Some(files) if has_member || !are_photographs => {
            let place = there.map(|(spot, member)| (spot.along(member.frame), spot.face(member)));
            Action::Fill(files.concat(), place)
        }
        slices if are_photographs => {
            let doubtful = Doubtful {
                scene: scene.path.clone(),
                files: files.to_vec(),
                shown: last.clone(),
                may_be_slices: slices.is_some(),
            };
            let is_told = doubtful.may_be_slices || files.len() > 1;
            world.resource_mut::<Drops>().doubtful = is_told.then_some(doubtful);
            Action::Photograph(last.clone())
        }
        _ => return alone(world, files),
    };
    select.into_iter().chain([then]).collect()
}

/// What is neither evidence nor a model: a prediction, or a file that is refused with its reason. Of
/// several, none is opened.
fn alone(world: &mut World, files: &[PathBuf]) -> Vec<Action> {
    let [file] = files else {
        let why = tr!(
            "let a model or a prediction go alone, photographs together, and slices or tables together"
        );
        world.resource_mut::<Banners>().cannot(&tr!("Not opened"), &why);
        return Vec::new();
    };
    let is_prediction = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let is_open = world.contains_resource::<CurrentScene>();
    vec![if is_prediction && is_open {
        Action::Compare(file.clone())
    } else {
        Action::Open(file.clone())
    }]
}

/// The name of a file, for people.
fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Says what was made of photographs that were let go, and offers the others, and what else they may
/// be.
pub(crate) fn offer(ui: &mut Ui, world: &mut World) {
    let Some(doubtful) = world.resource::<Drops>().doubtful.clone() else { return };
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let Some(scene) = scene.filter(|scene| scene.path == doubtful.scene) else {
        world.resource_mut::<Drops>().doubtful = None;
        return;
    };
    let member = world.resource::<Selection>().0.and_then(|index| scene.members.get(index));
    let (asked, is_done) = Side::top("dropped")
        .show(ui, |ui| {
            let row = ui.horizontal_wrapped(|ui| doubtful.show(ui, member.map(|m| &*m.name)));
            row.inner
        })
        .inner;
    let mut drops = world.resource_mut::<Drops>();
    if is_done {
        drops.doubtful = None;
    } else if let (Some(Action::Photograph(shown)), Some(now)) = (&asked, &mut drops.doubtful) {
        now.shown.clone_from(shown);
    }
    asked.into_iter().for_each(|action| world.resource_mut::<Actions>().ask(action));
}

impl Doubtful {
    /// What is to be done instead, of a member of this name where one is selected; and whether
    /// nothing is left to be said.
    fn show(&self, ui: &mut Ui, member: Option<&str>) -> (Option<Action>, bool) {
        let (count, file) = (self.files.len(), name(&self.shown));
        ui.label(match (self.may_be_slices, count) {
            (true, 1) => tr!("{} was let go on no member: it is open in Photos.", file),
            (true, _) => {
                tr!("{} files were let go on no member: {} is open in Photos.", count, file)
            }
            (false, _) => tr!("{} photographs were let go: {} is open in Photos.", count, file),
        });
        let asked = self.others(ui);
        if self.may_be_slices && self.are_slices(ui, member) {
            return (Some(Action::Fill(self.files.clone(), None)), true);
        }
        (asked, ui.button(tr!("Dismiss")).clicked())
    }

    /// Which of those that are not shown somebody wants to see.
    fn others(&self, ui: &mut Ui) -> Option<Action> {
        let others: Vec<&PathBuf> = self.files.iter().filter(|file| **file != self.shown).collect();
        let (first, rest) = others.split_at(others.len().min(MOST));
        let mut asked = None;
        for file in first {
            asked = photograph(ui, file).or(asked);
        }
        if !rest.is_empty() {
            ui.menu_button(tr!("and {} more", rest.len()), |ui| {
                ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
                    for file in rest {
                        asked = photograph(ui, file).or(asked.take());
                    }
                });
            });
        }
        asked
    }

    /// Whether somebody says that they are slices of a member of this name.
    fn are_slices(&self, ui: &mut Ui, member: Option<&str>) -> bool {
        let is_one = self.files.len() == 1;
        let Some(member) = member else {
            ui.label(match is_one {
                true => tr!("If it is a CT slice, select its member."),
                false => tr!("If they are CT slices, select their member."),
            });
            return false;
        };
        let said = match is_one {
            true => tr!("It is a CT slice of {}", member),
            false => tr!("They are CT slices of {}", member),
        };
        ui.button(said).clicked()
    }
}

/// A button for a photograph.
fn photograph(ui: &mut Ui, file: &Path) -> Option<Action> {
    let button = ui.button(tr!("Photograph {}", name(file)));
    button.clicked().then(|| Action::Photograph(file.to_owned()))
}

/// While files hang over the window: what is under them stays in sight.
pub(crate) fn hint(ui: &Ui, world: &World) {
    let hovered: Vec<PathBuf> =
        ui.input(|i| i.raw.hovered_files.iter().filter_map(|f| f.path.clone()).collect());
    if ui.input(|i| i.raw.hovered_files.is_empty()) {
        return;
    }
    let is_open = world.contains_resource::<CurrentScene>();
    let is_evidence = |path: &PathBuf| {
        !is_model(path) && (attach::evidence(path).is_some() || dialog::is_photograph(path))
    };
    let text = if is_open && (hovered.is_empty() || hovered.iter().all(is_evidence)) {
        tr!("Drop it on the member that it is of")
    } else {
        tr!("Drop to open")
    };
    let rect = ui.ctx().content_rect();
    let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop here"));
    let painter = ui.ctx().layer_painter(layer);
    let ink = egui::Color32::WHITE;
    let galley = painter.layout_no_wrap(text, egui::FontId::proportional(26.0), ink);
    let size = galley.size() + egui::vec2(40.0, 20.0);
    let back = egui::Rect::from_center_size(rect.center_top() + egui::vec2(0.0, 90.0), size);
    painter.rect_filled(back, 8.0, egui::Color32::from_black_alpha(215));
    painter.galley(back.min + egui::vec2(20.0, 10.0), galley, ink);
    painter.rect_stroke(
        rect.shrink(3.0),
        6.0,
        (3.0, crate::colours::SELECTED),
        egui::StrokeKind::Inside,
    );
}

fn is_model(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    ["ron", "glb", "gltf", "ifc"].contains(&ending.as_str())
}
