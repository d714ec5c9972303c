//! The whole window: what goes where.

use std::path::PathBuf;

use bevy_ecs::{
    prelude::*,
    system::{IntoSystem, RegisteredSystemError, SystemId},
};
use egui::{CentralPanel, Panel as Side, Ui};
use intrados_light::{
    Measurement, Render,
    plugin::{Learning, Upcoming},
};
use intrados_predict::Progress;
use intrados_scene::{
    LoadError,
    import::likely_unit,
    plugin::{CurrentScene, SceneChanged, SceneFailed},
};
use intrados_stage::{Jobs, Pace, catch};

use crate::{
    Action, Actions, Banners, Language, Latest, Lengths, Log, Look, Selection, Workspace,
    attach::{self, Form},
    banner, command,
    create::{self, Creation},
    ct::Ct,
    dialog::Dialogs,
    drops,
    edits::Edits,
    export::{self, Export},
    fields::Fields,
    lang::{self, fixed, term},
    log,
    outline::Outline,
    photos::Photos,
    picture::Picture,
    place::Panels,
    play,
    recent::Recent,
    reference::Reference,
    report::Report,
    saving::{self, Saving},
    scale::{self, Ranges},
    session,
    smooth::Smoothed,
    start,
    stress::Stress,
    toast,
    trail::Trail,
    views,
    workspace::{self, Desk},
};

/// From the right rim of the window to where the form of evidence opens, points: beside the picture,
/// in which one shows where it is.
const FORM: f32 = 360.0;

/// What is open.
#[derive(Resource, Default)]
pub(crate) struct Layout {
    /// The start screen is shown although there is a scene.
    pub(crate) start: bool,
    /// The list of keys is shown.
    pub(crate) keys: bool,
    /// What was last asked to be opened.
    pub(crate) asked: Option<PathBuf>,
    /// The window is to be closed.
    pub(crate) quits: bool,
    /// Whether the window fills the screen, and whether it is told so already.
    fullscreen: (bool, bool),
    /// Systems that draw what is no panel.
    own: Option<[SystemId<InMut<'static, Ui>>; 5]>,
}

impl Layout {
    pub(crate) fn toggle_fullscreen(&mut self) {
        self.fullscreen = (!self.fullscreen.0, false);
    }

    /// Tells the window what was asked for.
    fn tell(&mut self, ui: &Ui) {
        if std::mem::take(&mut self.quits) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        if !std::mem::replace(&mut self.fullscreen.1, true) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Fullscreen(self.fullscreen.0));
        }
    }
}

/// The scene that is open, and ids of its members.
#[derive(Default)]
pub(crate) struct Open {
    path: PathBuf,
    members: Vec<String>,
}

/// Says what has become of a load.
pub(crate) fn greet(
    mut changed: MessageReader<SceneChanged>,
    mut failed: MessageReader<SceneFailed>,
    scene: Option<Res<CurrentScene>>,
    mut layout: ResMut<Layout>,
    mut desk: ResMut<Desk>,
    mut open: Local<Open>,
    mut selection: ResMut<Selection>,
    mut recent: ResMut<Recent>,
    mut banners: ResMut<Banners>,
    mut log: ResMut<Log>,
) {
    if let Some(SceneFailed(error)) = failed.read().last() {
        if *error == LoadError::Cancelled {
            log.say(tr!("opening was cancelled"));
        } else {
            log.say(tr!("not opened: {}", term(&error.to_string())));
            banners.not_opened(error);
        }
    }
    let (Some(_), Some(scene)) = (changed.read().last(), scene) else { return };
    layout.start = false;
    banners.clear();
    let scene = &scene.0;
    desk.adapt(!scene.members.is_empty());
    // Of the same file with other evidence, the same member stays selected.
    let same = Some(&scene.path).filter(|path| path.exists() && **path == open.path);
    let member = selection.0.filter(|_| same.is_some()).and_then(|i| open.members.get(i));
    selection.0 = member.and_then(|id| scene.members.iter().position(|m| m.id == *id));
    // Whatever tab was in front of the last scene: of one without members there is light to see.
    match same {
        None if scene.members.is_empty() => desk.light(),
        None if desk.shown() == Workspace::Inspector => desk.open("Structure"),
        _ => {}
    }
    *open = Open {
        path: scene.path.clone(),
        members: scene.members.iter().map(|m| m.id.clone()).collect(),
    };
    if scene.path.exists() {
        recent.remember(&scene.path);
    }
    let [from, to] = scene.bounds();
    let size = to - from;
    log.say(tr!(
        "opened {}: {} triangles, {} members, {} × {} × {} m",
        scene.name,
        scene.triangle_count(),
        scene.members.len(),
        fixed(size.x, 2),
        fixed(size.y, 2),
        fixed(size.z, 2)
    ));
    if let Some(metres) = likely_unit(scene) {
        banners.doubtful(&scene.name, size.max_element(), metres);
    }
    for warning in &scene.warnings {
        log.say(format!("⚠ {}", term(warning)));
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
        || world.resource::<Smoothed>().is_busy()
        || world.resource::<Reference>().is_behind()
        || world.resource::<Dialogs>().is_open()
        || world.resource::<Outline>().is_busy()
        || world.resource::<Ct>().is_busy()
        || world.resource::<Photos>().is_busy()
        || world.resource::<Stress>().is_busy()
        || world.resource::<Export>().is_busy()
        || world.resource::<Edits>().is_busy()
        || world.resource::<Creation>().is_busy()
        || world.resource::<Saving>().is_busy()
        || world.resource::<Report>().is_busy()
}

/// Draws the whole window.
pub fn show(ui: &mut Ui, world: &mut World) {
    workspace::speak(world);
    drops::take(ui, world);
    world.resource_mut::<Layout>().bypass_change_detection().tell(ui);
    workspace::dress(ui, world);
    // Before the keys: while it is open, it takes them.
    command::palette(ui, world);
    command::keys(ui, world);
    play::go_on(ui, world);
    let [start, sheet, form, saving, creation] = own(world);
    session::offer(ui, world);
    banner::show(ui, world);
    drops::offer(ui, world);
    if world.contains_resource::<CurrentScene>() && !world.resource::<Layout>().start {
        panels(ui, world);
    } else {
        CentralPanel::default().show(ui, |ui| run(world, start, "start screen", ui));
    }
    sheets(ui, world, [sheet, form, saving, creation]);
    saving::picture(ui, world);
    toast::show(ui, world);
    drops::hint(ui, world);
}

fn own(world: &mut World) -> [SystemId<InMut<'static, Ui>>; 5] {
    if let Some(own) = world.resource::<Layout>().own {
        return own;
    }
    let own = [
        world.register_system(IntoSystem::into_system(start::start)),
        world.register_system(IntoSystem::into_system(export::sheet)),
        world.register_system(IntoSystem::into_system(attach::form)),
        world.register_system(IntoSystem::into_system(saving::sheet)),
        world.register_system(IntoSystem::into_system(create::dialog)),
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
            ui.weak(tr!("This broke off; “Reload scene” brings it back."));
            if ui.button(tr!("Reload scene")).clicked() {
                world.resource_mut::<Actions>().ask(Action::Reload);
            }
        }
        Ok(Err(error)) => tracing::error!("the panel {name} was not drawn: {error}"),
        Err(fault) => {
            let mut log = std::mem::take(&mut *world.resource_mut::<Log>());
            banner::tell(
                &mut world.resource_mut::<Banners>(),
                &mut log,
                &tr!("The panel “{}” broke off", term(name)),
                &fault,
            );
            *world.resource_mut::<Log>() = log;
            ui.ctx().request_repaint();
        }
    }
}

fn panels(ui: &mut Ui, world: &mut World) {
    Side::top("menu").show(ui, |ui| menu(ui, world));
    Side::bottom("status").exact_size(24.0).show(ui, |ui| status(ui, world));
    let (colours, ranges) = (world.resource::<Look>().colours, world.resource::<Ranges>().clone());
    world.resource_mut::<Desk>().keep(colours, &ranges);
    CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        workspace::show(ui, world, &mut |panel, ui, world| {
            run(world, panel.system, &panel.name, ui);
        });
    });
}

/// What is going on: the newest job with its progress and a way to stop it, the others behind a
/// button; and what was said last.
fn status(ui: &mut Ui, world: &mut World) {
    ui.horizontal_centered(|ui| {
        let mut jobs = world.resource_mut::<Jobs>();
        let jobs = jobs.bypass_change_detection();
        let count = jobs.running().len();
        if count > 0 {
            log::newest(ui, jobs);
        }
        if count > 1 {
            ui.menu_button(tr!("and {} more", count - 1), |ui| log::list(ui, jobs));
        }
        // What a banner says, or has said until it was put away, need not be said twice.
        if count == 0
            && world.resource::<Banners>().lines().is_empty()
            && let Some(line) = world.resource::<Log>().lines().last()
            && !line.starts_with('⚠')
        {
            let line = egui::Label::new(egui::RichText::new(line).weak()).truncate();
            let hint = tr!("All that was said is in the log; a click opens it");
            if ui.add(line.sense(egui::Sense::click())).on_hover_text(hint).clicked() {
                world.resource_mut::<Actions>().ask(Action::Tab("Log"));
            }
        }
    });
}

fn menu(ui: &mut Ui, world: &mut World) {
    let scene = world.get_resource::<CurrentScene>().map(|s| s.0.clone());
    let recent = world.resource::<Recent>().list().to_vec();
    let mut asked = Vec::new();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button(tr!("File"), |ui| {
            let mut entry = |ui: &mut Ui, name: &str, keys: &str, action: Action| {
                if ui.add(egui::Button::new(name).shortcut_text(keys)).clicked() {
                    asked.push(action);
                }
            };
            entry(ui, &tr!("New structure…"), "Ctrl+N", Action::New);
            entry(ui, &tr!("Open…"), "Ctrl+O", Action::Choose);
            entry(ui, &tr!("Start screen"), "", Action::StartScreen(true));
            entry(ui, &tr!("Export picture…"), "Ctrl+E", Action::Export);
            ui.separator();
            for path in &recent {
                if start::recent_button(ui, path).clicked() {
                    asked.push(Action::Open(path.clone()));
                }
            }
            if !recent.is_empty() {
                ui.separator();
            }
            if ui.button(tr!("Quit")).clicked() {
                ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            }
        });
        ui.menu_button(tr!("Save…"), |ui| {
            let latest = world.resource::<Latest>();
            let has = scene.as_ref().is_some_and(|s| latest.result_for(s).is_some());
            saving::menu(ui, has, &mut asked);
        });
        ui.menu_button(tr!("Edit"), |ui| {
            for (name, keys, may, action) in edits(world, scene.is_some()) {
                let button = egui::Button::new(name).shortcut_text(keys);
                if ui.add_enabled(may, button).clicked() {
                    asked.push(action);
                }
            }
        });
        ui.menu_button(tr!("View"), |ui| {
            let of = scene.as_ref().map(|s| s.path.clone()).unwrap_or_default();
            let ways = world.resource::<Trail>().ways(&of).into_iter();
            for (may, (name, keys, action)) in ways.zip([
                (tr!("Back|way"), "Alt+Left", Action::Back),
                (tr!("Forward|way"), "Alt+Right", Action::Forward),
            ]) {
                if ui.add_enabled(may, egui::Button::new(name).shortcut_text(keys)).clicked() {
                    asked.push(action);
                }
            }
            for (name, keys, action) in [
                (tr!("Fit into the picture"), "F", Action::Frame),
                (tr!("Scene's camera"), "Home", Action::Home),
            ] {
                if ui.add(egui::Button::new(name).shortcut_text(keys)).clicked() {
                    asked.push(action);
                }
            }
            ui.menu_button(tr!("Views"), |ui| views::menu(ui, world, &mut asked));
            let mut look = *world.resource::<Look>();
            ui.checkbox(&mut look.outline, tr!("Outline the selected member"));
            world.resource_mut::<Look>().set_if_neq(look);
            let mut links = world.resource::<Desk>().links();
            let hint = tr!(
                "An earlier prediction is seen from where the newest is, and the next photograph or slice as enlarged as the one before"
            );
            let link = ui.checkbox(&mut links, tr!("Link compared pictures"));
            if link.on_hover_text(hint).changed() {
                asked.push(Action::Link);
            }
            ui.separator();
            let log = ui.button(tr!("Log of this session"));
            if log.on_hover_text(tr!("All that was said, read again")).clicked() {
                asked.push(Action::Tab("Log"));
            }
            arrangement(ui, world, &mut asked);
        });
        if ui.button(tr!("Commands")).on_hover_text("Ctrl+P").clicked() {
            asked.push(Action::Palette);
        }
        if ui.button(tr!("Keys")).on_hover_text(tr!("F1, ? or H")).clicked() {
            asked.push(Action::Keys);
        }
        if let Some(scene) = scene {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.strong(&scene.name).on_hover_text(scene.path.display().to_string());
                if !scene.warnings.is_empty() {
                    ui.label(format!("⚠ {}", scene.warnings.len()))
                        .on_hover_text(lang::lines(&scene.warnings));
                }
                let expert = command::is_expert(world);
                let hint = tr!("Estimators, light meters, fields and convergence (F9)");
                if ui.selectable_label(expert, tr!("Expert")).on_hover_text(hint).clicked() {
                    asked.push(Action::SwapWorkspace);
                }
            });
        }
    });
    asked.into_iter().for_each(|action| world.resource_mut::<Actions>().ask(action));
}

/// What can be done to the evidence, and taken back.
fn edits(world: &World, is_open: bool) -> [(String, &'static str, bool, Action); 3] {
    let has_member = is_open && world.resource::<Selection>().0.is_some();
    let edits = world.resource::<Edits>();
    let is_free = !edits.is_busy();
    let [undo, redo] = edits.next();
    let named = |word: String, what: Option<&str>| match what {
        Some(what) => format!("{word}: {what}"),
        None => word,
    };
    [
        (named(tr!("Undo"), undo), "Ctrl+Z", is_free && undo.is_some(), Action::Undo),
        (named(tr!("Redo"), redo), "Ctrl+Shift+Z", is_free && redo.is_some(), Action::Redo),
        (tr!("Attach evidence…"), "A", has_member, Action::Fill(Vec::new(), None)),
    ]
}

/// Layouts, panels, themes, colours, units of lengths and languages.
fn arrangement(ui: &mut Ui, world: &World, asked: &mut Vec<Action>) {
    let desk = world.resource::<Desk>();
    for workspace in Workspace::BOTH {
        let name = match workspace {
            Workspace::Inspector => tr!("Inspector's layout"),
            Workspace::Expert => tr!("Expert's layout"),
        };
        if ui.radio(desk.shown() == workspace, name).on_hover_text("F9").clicked() {
            asked.push(Action::Arrange(workspace));
        }
    }
    ui.menu_button(tr!("Panels"), |ui| {
        for panel in &world.resource::<Panels>().0 {
            let mut is_open = desk.is_open(&panel.name);
            if ui.checkbox(&mut is_open, term(&panel.name)).clicked() {
                asked.push(Action::Panel(panel.name.clone(), is_open));
            }
        }
    });
    if ui.button(tr!("Panels as at first")).clicked() {
        asked.push(Action::ResetLayout);
    }
    ui.separator();
    use egui::ThemePreference::{Dark, Light, System};
    for (theme, name) in
        [(System, tr!("As the system")), (Light, tr!("Light theme")), (Dark, tr!("Dark theme"))]
    {
        if ui.radio(desk.theme() == theme, name).clicked() {
            asked.push(Action::Theme(theme));
        }
    }
    let now = world.resource::<Look>().colours;
    ui.menu_button(tr!("Colours"), |ui| {
        for (group, choices) in scale::choices(now).into_iter().enumerate() {
            if group > 0 {
                ui.separator();
            }
            for (name, colours) in choices {
                if ui.radio(colours == now, name).clicked() {
                    asked.push(Action::Colours(colours));
                }
            }
        }
    });
    ui.menu_button(tr!("Lengths in"), |ui| {
        for lengths in Lengths::ALL {
            if ui.radio(desk.lengths() == lengths, lengths.name()).clicked() {
                asked.push(Action::Lengths(lengths));
            }
        }
    });
    ui.menu_button(tr!("Language"), |ui| {
        for language in Language::ALL {
            let can = language != Language::Chinese || writes(ui, language.name());
            let name = if can { language.name().to_owned() } else { tr!("Chinese") };
            let choice = egui::RadioButton::new(lang::spoken() == language, name);
            let why = tr!("No font with Chinese characters was found on this system");
            if ui.add_enabled(can, choice).on_disabled_hover_text(why).clicked() {
                asked.push(Action::Speak(language));
            }
        }
    });
}

/// Whether there is a font for this: the system's are sought for what egui's own have not.
fn writes(ui: &Ui, text: &str) -> bool {
    ui.ctx().fonts_mut(|fonts| fonts.has_glyphs(&egui::FontId::default(), text))
}

/// What lies on top.
fn sheets(
    ui: &mut Ui,
    world: &mut World,
    [sheet, form, saving, creation]: [SystemId<InMut<'static, Ui>>; 4],
) {
    let centred = |title: &str| {
        egui::Window::new(title.to_owned())
            .collapsible(false)
            .resizable(false)
            .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
    };
    command::sheet(ui, world);
    views::sheet(ui, world);
    let mut open = world.resource::<Form>().is_open;
    if open {
        // It may be drawn aside, to see where on the member something is.
        egui::Window::new(tr!("Attach evidence"))
            .open(&mut open)
            .collapsible(false)
            .resizable(false)
            .default_pos(ui.ctx().content_rect().right_top() + egui::vec2(-FORM, 60.0))
            .show(ui.ctx(), |ui| run(world, form, "attach evidence", ui));
        world.resource_mut::<Form>().is_open &= open;
    }
    let mut open = world.resource::<Creation>().is_open;
    if open {
        centred(&tr!("New structure")).open(&mut open).show(ui.ctx(), |ui| {
            run(world, creation, "new structure", ui);
        });
        world.resource_mut::<Creation>().is_open &= open;
    }
    let mut open = world.resource::<Saving>().is_shown();
    if open {
        centred(&tr!("Save")).open(&mut open).show(ui.ctx(), |ui| run(world, saving, "save", ui));
        if !open {
            world.resource_mut::<Saving>().dismiss();
        }
    }
    let mut open = world.resource::<Export>().shown;
    if open {
        centred(&tr!("Export picture"))
            .open(&mut open)
            .show(ui.ctx(), |ui| run(world, sheet, "export", ui));
        // The sheet may have closed itself.
        world.resource_mut::<Export>().shown &= open;
    }
}
