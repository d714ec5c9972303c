//! The whole window: what goes where.

use std::path::PathBuf;

use bevy_ecs::{
    prelude::*,
    system::{IntoSystem, RegisteredSystemError, SystemId},
};
use egui::{CentralPanel, CollapsingHeader, Panel as Side, ScrollArea, Ui};
use intrados_light::{
    Measurement, Render,
    plugin::{Learning, Upcoming},
};
use intrados_predict::Progress;
use intrados_scene::{
    LoadError,
    plugin::{CurrentScene, SceneChanged, SceneFailed},
};
use intrados_stage::{Jobs, Pace, catch};

use crate::{
    Action, Actions, Banners, Log, Look, Place, Selection, banner,
    ct::Ct,
    dialog::{self, Dialogs},
    export::{self, Export},
    fields::Fields,
    log,
    outline::Outline,
    photos::Photos,
    picture::Picture,
    place::{Panel, Panels},
    recent::Recent,
    render,
    report::Report,
    start,
    stress::Stress,
};

/// What is open.
#[derive(Resource, Default)]
pub(crate) struct Layout {
    /// The start screen is shown although there is a scene.
    pub(crate) start: bool,
    /// The list of keys is shown.
    pub(crate) keys: bool,
    /// What was last asked to be opened.
    pub(crate) asked: Option<PathBuf>,
    pub(crate) tab: usize,
    bottom: usize,
    /// Systems that draw what is no panel.
    own: Option<[SystemId<InMut<'static, Ui>>; 2]>,
}

/// Says what has become of a load.
pub(crate) fn greet(
    mut changed: MessageReader<SceneChanged>,
    mut failed: MessageReader<SceneFailed>,
    scene: Option<Res<CurrentScene>>,
    mut layout: ResMut<Layout>,
    mut selection: ResMut<Selection>,
    mut recent: ResMut<Recent>,
    mut banners: ResMut<Banners>,
    mut log: ResMut<Log>,
) {
    if let Some(SceneFailed(error)) = failed.read().last() {
        if *error == LoadError::Cancelled {
            log.say("opening was cancelled");
        } else {
            log.say(format!("not opened: {error}"));
            banners.not_opened(error);
        }
    }
    let (Some(_), Some(scene)) = (changed.read().last(), scene) else { return };
    layout.start = false;
    banners.clear();
    selection.0 = None;
    let scene = &scene.0;
    if scene.path.exists() {
        recent.remember(&scene.path);
    }
    let [from, to] = scene.bounds();
    let size = to - from;
    log.say(format!(
        "opened {}: {} triangles, {} members, {:.2} × {:.2} × {:.2} m",
        scene.name,
        scene.triangle_count(),
        scene.members.len(),
        size.x,
        size.y,
        size.z
    ));
    for warning in &scene.warnings {
        log.say(format!("⚠ {warning}"));
    }
}

/// Whether the next frame will differ from this one although nobody touches anything.
#[must_use]
pub fn is_busy(world: &mut World) -> bool {
    let refining = *world.resource::<Pace>() != Pace::Rest
        && (world.contains_resource::<Render>() || world.contains_resource::<Measurement>());
    refining
        || !world.resource_mut::<Jobs>().running().is_empty()
        // Between two pieces of work it has no job.
        || world.get_resource::<Progress>().is_some_and(Progress::is_busy)
        || world.resource::<Upcoming>().is_coming()
        || world.resource::<Learning>().is_coming()
        || world.resource::<Fields>().is_busy()
        || world.resource::<Picture>().is_behind()
        || world.resource::<Dialogs>().is_open()
        || world.resource::<Outline>().is_busy()
        || world.resource::<Ct>().is_busy()
        || world.resource::<Photos>().is_busy()
        || world.resource::<Stress>().is_busy()
        || world.resource::<Export>().is_busy()
        || world.resource::<Report>().is_busy()
}

/// Draws the whole window.
pub fn show(ui: &mut Ui, world: &mut World) {
    let dropped = ui.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).next_back());
    if let Some(path) = dropped {
        let is_photograph =
            dialog::is_photograph(&path) && world.contains_resource::<CurrentScene>();
        let action = if is_photograph { Action::Photograph(path) } else { Action::Open(path) };
        world.resource_mut::<Actions>().ask(action);
    }
    let look = *world.resource::<Look>();
    render::keys(ui, &look, &mut world.resource_mut::<Actions>());
    let [start, sheet] = own(world);
    banner::show(ui, world);
    if world.contains_resource::<CurrentScene>() && !world.resource::<Layout>().start {
        panels(ui, world);
    } else {
        CentralPanel::default().show(ui, |ui| run(world, start, "start screen", ui));
    }
    sheets(ui, world, sheet);
    if ui.input(|i| !i.raw.hovered_files.is_empty()) {
        drop_here(ui);
    }
}

/// While a file hangs over the window.
fn drop_here(ui: &Ui) {
    let rect = ui.ctx().content_rect();
    let painter = ui
        .ctx()
        .layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop here")));
    painter.rect_filled(rect, 0.0, egui::Color32::from_black_alpha(190));
    painter.text(
        rect.center(),
        egui::Align2::CENTER_CENTER,
        "Drop to open",
        egui::FontId::proportional(30.0),
        egui::Color32::WHITE,
    );
}

fn own(world: &mut World) -> [SystemId<InMut<'static, Ui>>; 2] {
    if let Some(own) = world.resource::<Layout>().own {
        return own;
    }
    let own = [
        world.register_system(IntoSystem::into_system(start::start)),
        world.register_system(IntoSystem::into_system(export::sheet)),
    ];
    world.resource_mut::<Layout>().own = Some(own);
    own
}

/// Draws a panel. One that panics takes only itself along: bevy has lost its system then, and the
/// next world brings it back.
fn run(world: &mut World, system: SystemId<InMut<'static, Ui>>, name: &str, ui: &mut Ui) {
    match catch(|| world.run_system_with(system, ui)) {
        Ok(Ok(())) => {}
        Ok(Err(RegisteredSystemError::SystemMissing(_))) => {
            ui.weak("This broke off; “Reload scene” brings it back.");
            if ui.button("Reload scene").clicked() {
                world.resource_mut::<Actions>().ask(Action::Reload);
            }
        }
        Ok(Err(error)) => tracing::error!("the panel {name} was not drawn: {error}"),
        Err(fault) => {
            let mut log = std::mem::take(&mut *world.resource_mut::<Log>());
            banner::tell(
                &mut world.resource_mut::<Banners>(),
                &mut log,
                &format!("The panel “{name}” broke off"),
                &fault,
            );
            *world.resource_mut::<Log>() = log;
            ui.ctx().request_repaint();
        }
    }
}

fn panels(ui: &mut Ui, world: &mut World) {
    let all = world.resource::<Panels>().0.clone();
    let at =
        |place: Place| all.iter().filter(|p| p.place == place).cloned().collect::<Vec<Panel>>();
    Side::top("menu").show(ui, |ui| menu(ui, world));
    let tabs = at(Place::Bottom);
    Side::bottom("bottom").resizable(true).default_size(200.0).min_size(80.0).show(ui, |ui| {
        let mut open = world.resource::<Layout>().bottom.min(tabs.len().saturating_sub(1));
        tab_row(ui, &tabs, &mut open);
        world.resource_mut::<Layout>().bottom = open;
        // A panel would shrink to what is in it.
        ui.set_min_size(ui.available_size());
        if let Some(tab) = tabs.get(open) {
            run(world, tab.system, &tab.name, ui);
        }
    });
    Side::left("left")
        .resizable(true)
        .default_size(260.0)
        .show(ui, |ui| stack(ui, world, &at(Place::Left)));
    Side::right("right")
        .resizable(true)
        .default_size(280.0)
        .show(ui, |ui| stack(ui, world, &at(Place::Right)));
    let tabs = at(Place::Tab);
    CentralPanel::default().show(ui, |ui| {
        let mut open = world.resource::<Layout>().tab.min(tabs.len().saturating_sub(1));
        tab_row(ui, &tabs, &mut open);
        world.resource_mut::<Layout>().tab = open;
        if let Some(tab) = tabs.get(open) {
            run(world, tab.system, &tab.name, ui);
        }
    });
}

fn tab_row(ui: &mut Ui, tabs: &[Panel], open: &mut usize) {
    ui.horizontal(|ui| {
        for (i, tab) in tabs.iter().enumerate() {
            ui.selectable_value(open, i, &tab.name);
        }
    });
    ui.separator();
}

/// Panels under each other, each under its name.
fn stack(ui: &mut Ui, world: &mut World, panels: &[Panel]) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for panel in panels {
            CollapsingHeader::new(&panel.name)
                .id_salt(&panel.name)
                .default_open(true)
                .show_unindented(ui, |ui| run(world, panel.system, &panel.name, ui));
            ui.add_space(4.0);
        }
    });
}

fn menu(ui: &mut Ui, world: &mut World) {
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let recent = world.resource::<Recent>().list().to_vec();
    let mut asked = Vec::new();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| {
            let mut entry = |ui: &mut Ui, name: &str, keys: &str, action: Action| {
                if ui.add(egui::Button::new(name).shortcut_text(keys)).clicked() {
                    asked.push(action);
                }
            };
            entry(ui, "Open…", "Ctrl+O", Action::Choose);
            entry(ui, "Start screen", "", Action::StartScreen(true));
            entry(ui, "Export picture…", "Ctrl+E", Action::Export);
            ui.separator();
            for path in &recent {
                if start::recent_button(ui, path).clicked() {
                    asked.push(Action::Open(path.clone()));
                }
            }
            if !recent.is_empty() {
                ui.separator();
            }
            if ui.button("Quit").clicked() {
                ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            }
        });
        ui.menu_button("View", |ui| {
            for (name, keys, action) in [
                ("Fit into the picture", "F", Action::Frame),
                ("Scene's camera", "Home", Action::Home),
            ] {
                if ui.add(egui::Button::new(name).shortcut_text(keys)).clicked() {
                    asked.push(action);
                }
            }
            let cameras = scene.as_ref().map(|s| s.cameras.len()).unwrap_or_default();
            ui.menu_button("Cameras", |ui| {
                for (i, camera) in scene.iter().flat_map(|s| &s.cameras).enumerate() {
                    if ui.button(&camera.name).clicked() {
                        asked.push(Action::Camera(i));
                    }
                }
                if cameras == 0 {
                    ui.weak("The scene has none of its own.");
                }
            });
            let mut look = *world.resource::<Look>();
            ui.checkbox(&mut look.outline, "Outline the selected member");
            world.resource_mut::<Look>().set_if_neq(look);
        });
        if ui.button("Keys").on_hover_text("?").clicked() {
            asked.push(Action::Keys);
        }
        if let Some(scene) = scene {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.strong(&scene.name).on_hover_text(scene.path.display().to_string());
                if !scene.warnings.is_empty() {
                    ui.label(format!("⚠ {}", scene.warnings.len()))
                        .on_hover_text(scene.warnings.join("\n"));
                }
                log::list(ui, world.resource_mut::<Jobs>().bypass_change_detection());
            });
        }
    });
    asked.into_iter().for_each(|action| world.resource_mut::<Actions>().ask(action));
}

/// What lies on top.
fn sheets(ui: &mut Ui, world: &mut World, sheet: SystemId<InMut<'static, Ui>>) {
    let centred = |title: &str| {
        egui::Window::new(title.to_owned())
            .collapsible(false)
            .resizable(false)
            .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
    };
    let mut open = world.resource::<Layout>().keys;
    if open {
        centred("Keys").open(&mut open).show(ui.ctx(), |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                for (keys, what) in render::KEYS {
                    ui.strong(keys);
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
        world.resource_mut::<Layout>().keys = open;
    }
    let mut open = world.resource::<Export>().shown;
    if open {
        centred("Export picture")
            .open(&mut open)
            .show(ui.ctx(), |ui| run(world, sheet, "export", ui));
        // The sheet may have closed itself.
        world.resource_mut::<Export>().shown &= open;
    }
}
