//! Everything that can be asked for, by name and by key: one list for the keys, for the sheet of keys
//! and for the palette.

use bevy_ecs::prelude::*;
use egui::{Key, Modifiers, PointerButton, RichText, ScrollArea, TextEdit, Ui};
use intrados_light::View;
use intrados_scene::plugin::CurrentScene;

use crate::{
    Action, Actions, Aspect, Jump, Language, Lengths, Look, Quantity, Workspace,
    lang::{self, term},
    layout::Layout,
    place::Panels,
    recent::Recent,
    saving::Taken,
    scale,
    structure::Structure,
    views::Views,
    workspace::Desk,
};

/// Something with a name that a user can ask for.
pub(crate) struct Command {
    /// What it does, for people; begins with a small letter.
    pub(crate) name: String,
    /// Its keys, for people.
    keys: &'static str,
    shortcut: Option<(Modifiers, Key)>,
    action: Action,
}

/// What the pointer does, for the sheet of keys.
fn gestures() -> [(String, String); 7] {
    [
        (tr!("Drag"), tr!("orbit")),
        (tr!("Shift+drag, middle or right drag"), tr!("pan")),
        (tr!("Wheel"), tr!("nearer, farther")),
        (tr!("Click"), tr!("select a member")),
        (tr!("Double-click"), tr!("look at a member")),
        (tr!("Back and forward buttons"), tr!("to where one was, and forward again")),
        (tr!("Drag a tab"), tr!("dock a panel elsewhere")),
    ]
}

/// The palette: what has been typed, and which line is chosen.
#[derive(Resource, Default)]
pub(crate) struct Palette {
    pub(crate) is_open: bool,
    query: String,
    chosen: usize,
}

impl Palette {
    pub(crate) fn toggle(&mut self) {
        *self = Self { is_open: !self.is_open, ..Self::default() };
    }
}

fn command(
    name: impl Into<String>,
    keys: &'static str,
    shortcut: Option<(Modifiers, Key)>,
    action: Action,
) -> Command {
    Command { name: name.into(), keys, shortcut, action }
}

/// What can always be asked for.
fn fixed(look: &Look) -> Vec<Command> {
    const CTRL: Modifiers = Modifiers::COMMAND;
    const NONE: Modifiers = Modifiers::NONE;
    const ALT: Modifiers = Modifiers::ALT;
    let shifted = CTRL | Modifiers::SHIFT;
    let is_error = look.quantity == Quantity::Error;
    let quantity = if is_error { Quantity::Radiance } else { Quantity::Error };
    let by = |modifiers: Modifiers, key: Key| Some((modifiers, key));
    vec![
        command(tr!("new structure"), "Ctrl+N", by(CTRL, Key::N), Action::New),
        command(tr!("open a file"), "Ctrl+O", by(CTRL, Key::O), Action::Choose),
        command(tr!("save the report"), "Ctrl+S", by(CTRL, Key::S), Action::Save(Taken::Report)),
        command(tr!("save the picture of light"), "Ctrl+E", by(CTRL, Key::E), Action::Export),
        command(
            tr!("save a picture of the window"),
            "F12",
            by(NONE, Key::F12),
            Action::Save(Taken::Picture(None)),
        ),
        command(
            tr!("save a picture of the structure, with its legend"),
            "",
            None,
            Action::Save(Taken::Picture(Some("Structure".into()))),
        ),
        command(tr!("save all views"), "", None, Action::Save(Taken::Views)),
        command(
            tr!("copy a picture of the window"),
            "Ctrl+Shift+C",
            by(shifted, Key::C),
            Action::CopyPicture(None),
        ),
        command(
            tr!("copy a picture of the structure, with its legend"),
            "",
            None,
            Action::CopyPicture(Some("Structure".into())),
        ),
        command(tr!("attach evidence"), "A", by(NONE, Key::A), Action::Fill(Vec::new(), None)),
        // Before the one that asks for less: Ctrl+Z alone would take Shift along.
        command(tr!("redo"), "Ctrl+Shift+Z  Ctrl+Y", by(shifted, Key::Z), Action::Redo),
        command(tr!("undo"), "Ctrl+Z", by(CTRL, Key::Z), Action::Undo),
        command("", "", by(CTRL, Key::Y), Action::Redo),
        command(tr!("list all commands"), "Ctrl+P  Ctrl+K", by(CTRL, Key::P), Action::Palette),
        command(tr!("list of keys"), "F1  ?  H", by(NONE, Key::F1), Action::Keys),
        command(
            tr!("inspector's or expert's layout"),
            "F9",
            by(NONE, Key::F9),
            Action::SwapWorkspace,
        ),
        command(tr!("lay panels out as at first"), "", None, Action::ResetLayout),
        command(tr!("next member"), "Page down", by(NONE, Key::PageDown), Action::Step(true)),
        command(tr!("previous member"), "Page up", by(NONE, Key::PageUp), Action::Step(false)),
        command(
            tr!("back to the member and the view of before"),
            "Alt+Left",
            by(ALT, Key::ArrowLeft),
            Action::Back,
        ),
        command(tr!("forward again"), "Alt+Right", by(ALT, Key::ArrowRight), Action::Forward),
        command(tr!("play the lives of the members, or stop"), "P", by(NONE, Key::P), Action::Play),
        command(tr!("next equilibrium"), ".", by(NONE, Key::Period), Action::Jump(Jump::Forward)),
        command(tr!("equilibrium before"), ",", by(NONE, Key::Comma), Action::Jump(Jump::Back)),
        command(
            tr!("first equilibrium"),
            "Ctrl+Home",
            by(CTRL, Key::Home),
            Action::Jump(Jump::First),
        ),
        command(tr!("last equilibrium"), "Ctrl+End", by(CTRL, Key::End), Action::Jump(Jump::Last)),
        command(
            tr!("fit the selected member, or everything, into the picture"),
            "F",
            by(NONE, Key::F),
            Action::Frame,
        ),
        command(
            tr!("all of it, from the scene's own camera"),
            "Home",
            by(NONE, Key::Home),
            Action::Home,
        ),
        // Their keys are those of estimators; which is meant, what is seen tells.
        command(tr!("the structure from the front"), "1", None, Action::LookFrom(Aspect::Front)),
        command(tr!("the structure from the side"), "3", None, Action::LookFrom(Aspect::Side)),
        command(
            tr!("the structure from above"),
            "7",
            by(NONE, Key::Num7),
            Action::LookFrom(Aspect::Top),
        ),
        command(tr!("hide or show the legend"), "L", by(NONE, Key::L), Action::Legend),
        command(tr!("CT slice before"), "[", by(NONE, Key::OpenBracket), Action::StepSlice(false)),
        command(tr!("next CT slice"), "]", by(NONE, Key::CloseBracket), Action::StepSlice(true)),
        command(tr!("keep this view"), "", None, Action::KeepView(String::new())),
        command(tr!("list of views, to name and to forget them"), "", None, Action::Views),
        command(tr!("fly along the selected member, or halt"), "", None, Action::Fly),
        command(tr!("pause or continue"), "Space", by(NONE, Key::Space), Action::Pause),
        command(tr!("restart the picture"), "R", by(NONE, Key::R), Action::Restart),
        command(tr!("primal side"), "1", by(NONE, Key::Num1), Action::Show(View::Primal)),
        command(tr!("dual side"), "2", by(NONE, Key::Num2), Action::Show(View::Dual)),
        command(tr!("both sides combined"), "3", by(NONE, Key::Num3), Action::Show(View::Combined)),
        command(tr!("light or error"), "E", by(NONE, Key::E), Action::ShowQuantity(quantity)),
        command(tr!("keep the picture as reference"), "", None, Action::KeepReference),
        command(tr!("let the reference go"), "", None, Action::LetReferenceGo),
        command(tr!("link compared pictures, or part them"), "", None, Action::Link),
        command(tr!("go on with the prediction"), "", None, Action::Predict),
        command(tr!("compare with an earlier prediction"), "", None, Action::ChoosePrediction),
        command(tr!("reload the scene"), "", None, Action::Reload),
        command(tr!("start screen"), "", None, Action::StartScreen(true)),
        command(tr!("light theme"), "", None, Action::Theme(egui::ThemePreference::Light)),
        command(tr!("dark theme"), "", None, Action::Theme(egui::ThemePreference::Dark)),
        command(tr!("theme of the system"), "", None, Action::Theme(egui::ThemePreference::System)),
        command("Language: English", "", None, Action::Speak(Language::English)),
        command("Sprache: Deutsch", "", None, Action::Speak(Language::German)),
        command("Language: Chinese", "", None, Action::Speak(Language::Chinese)),
        command(tr!("full screen"), "F11", by(NONE, Key::F11), Action::Fullscreen),
        command(
            tr!("put away a sheet or a message, or unselect"),
            "Esc",
            by(NONE, Key::Escape),
            Action::Dismiss,
        ),
        command(tr!("quit"), "Ctrl+Q", by(CTRL, Key::Q), Action::Quit),
        command("", "", by(CTRL, Key::K), Action::Palette),
        command("", "", by(NONE, Key::Questionmark), Action::Keys),
        command("", "", by(NONE, Key::H), Action::Keys),
        command("", "", by(shifted, Key::P), Action::Palette),
    ]
}

/// All of them, those too that depend on what is open.
fn all(world: &World) -> Vec<Command> {
    let mut all = fixed(world.resource::<Look>());
    all.retain(|c| !c.name.is_empty());
    for workspace in Workspace::BOTH {
        let name = match workspace {
            Workspace::Inspector => tr!("layout: Inspector"),
            Workspace::Expert => tr!("layout: Expert"),
        };
        all.push(command(name, "", None, Action::Arrange(workspace)));
    }
    for (name, colours) in scale::choices(world.resource::<Look>().colours).into_iter().flatten() {
        all.push(command(tr!("colours: {}", name), "", None, Action::Colours(colours)));
    }
    for lengths in Lengths::ALL {
        all.push(command(tr!("lengths in {}", lengths.name()), "", None, Action::Lengths(lengths)));
    }
    for panel in &world.resource::<Panels>().0 {
        let action = Action::Panel(panel.name.clone(), true);
        all.push(command(tr!("panel: {}", term(&panel.name)), "", None, action));
    }
    if let Some(scene) = world.get_resource::<CurrentScene>() {
        for (index, member) in scene.0.members.iter().enumerate() {
            let name = tr!("member: {}", member.name);
            all.push(command(name, "", None, Action::Select(Some(index))));
        }
        for (index, camera) in scene.0.cameras.iter().enumerate() {
            let name = tr!("camera: {}", camera.name);
            all.push(command(name, "", None, Action::Camera(index)));
        }
        let views = world.resource::<Views>().of(&scene.0.path);
        for (index, view) in views.iter().enumerate() {
            all.push(command(tr!("view: {}", view.name), "", None, Action::View(index)));
        }
    }
    for path in world.resource::<Recent>().list() {
        let name = tr!("open {}", path.display());
        all.push(command(name, "", None, Action::Open(path.clone())));
    }
    all
}

/// What `make` makes, in English.
fn in_english<T>(make: impl FnOnce() -> T) -> T {
    let spoken = lang::spoken();
    lang::speak(Language::English);
    let made = make();
    lang::speak(spoken);
    made
}

/// Puts what keys ask for into the actions. A field that has the focus keeps its letters; keys with
/// Ctrl and those at the top of the keyboard act anywhere.
pub(crate) fn keys(ui: &Ui, world: &mut World) {
    let is_typing = ui.ctx().text_edit_focused();
    // A button that has the focus is pressed by it.
    let has_focus = ui.ctx().memory(|m| m.focused().is_some());
    // A menu that is open is put away by it, and nothing else is.
    let has_menu = egui::Popup::is_any_open(ui.ctx());
    let commands = fixed(world.resource::<Look>());
    let acts_anywhere = |modifiers: Modifiers, key: Key| {
        modifiers.command && !matches!(key, Key::Z | Key::Y | Key::Home | Key::End)
            || matches!(key, Key::F1 | Key::F9 | Key::F11 | Key::F12)
    };
    let asked: Vec<Action> = ui.input_mut(|i| {
        let own = commands.into_iter().filter_map(|c| Some((c.shortcut?, c.action)));
        own.filter(|((modifiers, key), _)| {
            let is_taken =
                is_typing || has_focus && *key == Key::Space || has_menu && *key == Key::Escape;
            if is_taken && !acts_anywhere(*modifiers, *key) {
                return false;
            }
            if modifiers.any() {
                return i.consume_key(*modifiers, *key);
            }
            // Shift is part of writing “?”.
            (!i.modifiers.any() || i.modifiers.shift_only()) && i.key_pressed(*key)
        })
        .map(|(_, action)| action)
        .collect()
    });
    let desk = world.resource::<Desk>();
    let [light, structure] = ["Render", "Structure"].map(|panel| desk.has_drawn(panel));
    // Digits are sides of the structure where it is seen, unless the picture of light is, too.
    let turns = structure && !light;
    // What pauses the picture of light halts a flight that is seen.
    let flies = world.resource::<Structure>().is_flying() && structure;
    let meant = |action: Action| match action {
        Action::Pause if flies => Action::Fly,
        Action::Show(View::Primal) if turns => Action::LookFrom(Aspect::Front),
        Action::Show(View::Combined) if turns => Action::LookFrom(Aspect::Side),
        action => action,
    };
    let pressed = |button| ui.input(|i| i.pointer.button_pressed(button));
    let buttons = [(PointerButton::Extra1, Action::Back), (PointerButton::Extra2, Action::Forward)];
    let buttons = buttons.into_iter().filter(|(button, _)| pressed(*button));
    let mut actions = world.resource_mut::<Actions>();
    let asked = asked.into_iter().map(meant).chain(buttons.map(|(_, action)| action));
    asked.for_each(|action| actions.ask(action));
}

/// The sheet of keys.
pub(crate) fn sheet(ui: &Ui, world: &mut World) {
    let mut open = world.resource::<Layout>().keys;
    if !open {
        return;
    }
    let commands = fixed(world.resource::<Look>()).into_iter().filter(|c| !c.keys.is_empty());
    let rows: Vec<(String, String)> =
        commands.map(|c| (c.keys.to_owned(), c.name)).chain(gestures()).collect();
    let height = (ui.ctx().content_rect().height() - 80.0).max(80.0);
    egui::Window::new(tr!("Keys"))
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .open(&mut open)
        .show(ui.ctx(), |ui| {
            // As high as the window lets it be: egui's own windows begin with half of that.
            let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
            area.show(ui, |ui| {
                egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                    for (keys, what) in &rows {
                        ui.strong(keys);
                        ui.label(what);
                        ui.end_row();
                    }
                });
            });
        });
    world.resource_mut::<Layout>().keys = open;
}

/// The palette: type some letters of what is wanted, Enter does it.
pub(crate) fn palette(ui: &Ui, world: &mut World) {
    if !world.resource::<Palette>().is_open {
        return;
    }
    let mut palette = std::mem::take(&mut *world.resource_mut::<Palette>());
    let commands = all(world);
    let english = in_english(|| all(world));
    let fits = fitting(&commands, &english, &palette.query);
    let count = fits.len();
    let (mut chosen, mut done) = (None, false);
    ui.input_mut(|i| {
        if i.consume_key(Modifiers::NONE, Key::ArrowDown) {
            palette.chosen = (palette.chosen + 1).min(count.saturating_sub(1));
        }
        if i.consume_key(Modifiers::NONE, Key::ArrowUp) {
            palette.chosen = palette.chosen.saturating_sub(1);
        }
        if i.consume_key(Modifiers::NONE, Key::Enter) {
            (chosen, done) = (fits.get(palette.chosen).copied(), true);
        }
        done |= i.consume_key(Modifiers::NONE, Key::Escape);
    });
    let screen = ui.ctx().content_rect();
    let width = (screen.width() - 40.0).min(560.0);
    egui::Window::new(tr!("Commands"))
        .title_bar(false)
        .resizable(false)
        .fixed_size([width, 0.0])
        .anchor(egui::Align2::CENTER_TOP, [0.0, 48.0])
        .show(ui.ctx(), |ui| {
            let field = TextEdit::singleline(&mut palette.query)
                .hint_text(tr!("Type what you want to do"))
                .desired_width(f32::INFINITY);
            let response = ui.add(field);
            response.widget_info(|| {
                egui::WidgetInfo::labeled(egui::Role::TextInput, true, tr!("Command"))
            });
            response.request_focus();
            if response.changed() {
                palette.chosen = 0;
            }
            let most = (screen.height() - 140.0).clamp(60.0, 420.0);
            let list = ScrollArea::vertical().max_height(most).min_scrolled_height(most);
            list.auto_shrink([false, true]).show(ui, |ui| {
                for (line, &index) in fits.iter().enumerate() {
                    let is_chosen = line == palette.chosen;
                    let row = row(ui, &commands[index], is_chosen);
                    if row.clicked() {
                        (chosen, done) = (Some(index), true);
                    }
                    if is_chosen {
                        row.scroll_to_me(None);
                    }
                }
                if fits.is_empty() {
                    ui.weak(tr!("No command is called so."));
                }
            });
        });
    let action = chosen.and_then(|index| commands.into_iter().nth(index)).map(|c| c.action);
    if !done {
        *world.resource_mut::<Palette>() = palette;
    }
    if let Some(action) = action {
        world.resource_mut::<Actions>().ask(action);
    }
}

fn row(ui: &mut Ui, command: &Command, is_chosen: bool) -> egui::Response {
    let mut letters = command.name.chars();
    let first: String = letters.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    let text = RichText::new(first + letters.as_str());
    let button = egui::Button::selectable(is_chosen, text).shortcut_text(command.keys);
    let width = ui.available_width();
    ui.add_sized([width, 22.0], button.min_size(egui::vec2(width, 22.0)))
}

/// Those whose names have every word that was typed, in the language of the window or in English;
/// those that begin with it first.
fn fitting(commands: &[Command], english: &[Command], query: &str) -> Vec<usize> {
    let query = query.trim().to_lowercase();
    let words: Vec<&str> = query.split_whitespace().collect();
    let lower = |c: &Command| c.name.to_lowercase();
    let names: Vec<[String; 2]> =
        commands.iter().zip(english).map(|(own, english)| [lower(own), lower(english)]).collect();
    let has_all = |i: &usize| names[*i].iter().any(|name| words.iter().all(|w| name.contains(w)));
    let mut fits: Vec<usize> = (0..commands.len()).filter(has_all).collect();
    fits.sort_by_key(|&i| !names[i].iter().any(|name| name.starts_with(&query)));
    fits
}

/// Whether the expert's layout is shown.
pub(crate) fn is_expert(world: &World) -> bool {
    world.resource::<Desk>().shown() == Workspace::Expert
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_found_by_any_of_their_words() {
        let commands = fixed(&Look::default());
        let name = |query: &str| {
            let fits = fitting(&commands, &commands, query);
            commands[fits[0]].name.clone()
        };
        assert_eq!(name("full"), "full screen");
        assert_eq!(name("MEMBER next"), "next member");
        assert!(fitting(&commands, &commands, "no such thing").is_empty());
    }

    #[test]
    fn commands_are_found_by_their_names_in_the_language_of_the_window_and_in_english() {
        lang::speak(Language::German);
        let commands = fixed(&Look::default());
        let english = in_english(|| fixed(&Look::default()));
        let first = |query: &str| fitting(&commands, &english, query).first().copied();
        assert_eq!(first("vollbild"), first("full screen"));
        assert_eq!(first("vollbild").map(|i| &*english[i].name), Some("full screen"));
        assert!(first("chinese").is_some());
        lang::speak(Language::English);
    }

    #[test]
    fn no_key_does_two_things() {
        let commands = fixed(&Look::default());
        let mut keys: Vec<_> = commands.iter().filter_map(|c| c.shortcut).collect();
        let count = keys.len();
        keys.sort_by_key(|(m, k)| (m.command, m.shift, k.name()));
        keys.dedup();
        assert_eq!(keys.len(), count);
    }
}
