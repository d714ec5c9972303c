//! Forms: what a scene's file says is changed in the sheet and written there.

use std::fs;

use bevy_ecs::world::World;
use egui::{Key, accesskit::Role};
use egui_kittest::kittest::Queryable;
use intrados_panels::{Action, Latest, Selection};
use intrados_scene::plugin::CurrentScene;

use intrados_predict::{PredictSettings, Predicting};

use super::{LONELY, Window, type_into};

/// A crack that somebody has seen: something to predict without a life, which takes long.
const SEEN: &str = r#"(
    schema: "intrados.evidence/1",
    items: [(member: "C1", name: "crack 1", date: "2026-05-03", along: 0.4, face: Front, shows: Crack(width_mm: 0.4, course: Along))],
)"#;

/// A window with a column, and what has been seen of it.
pub(super) fn with_seen() -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder for the scene");
    let file = folder.path().join("lonely.ron");
    fs::write(&file, LONELY).expect("written");
    fs::write(folder.path().join("evidence.ron"), SEEN).expect("written");
    let mut window = Window::new(|app| {
        app.world_mut().resource_mut::<Predicting>().settings =
            PredictSettings { forecast: None, ..PredictSettings::default() };
    });
    window.ask(Action::Open(file));
    (window, folder)
}

/// Whether anything in the window has this text in its name.
fn has(window: &Window, text: &str) -> bool {
    window.harness.query_all_by_label_contains(text).next().is_some()
}

/// How wide the column is, m.
fn width(world: &mut World) -> f32 {
    let [low, high] = world.resource::<CurrentScene>().0.members[0].bounds;
    high.x - low.x
}

fn is(world: &mut World, wide: f32) -> bool {
    (width(world) - wide).abs() < 1e-4
}

/// Opens the form of the selected member.
fn opened(window: &mut Window) {
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("Concrete, size, bars, loads");
    window.until_seen("Apply");
    window.frames(20);
}

/// A size and a class are changed: old numbers are outdated, the file has the new ones and all of
/// its comments, and Ctrl+Z brings the old ones back to the byte.
#[test]
fn a_member_is_changed_in_its_sheet_and_changed_back() {
    let (mut window, folder) = with_seen();
    let file = folder.path().join("lonely.ron");
    opened(&mut window);
    type_into(&mut window, "width", "0,5");
    type_into(&mut window, "concrete class", "C35/45");
    assert!(has(&window, "2 values changed"));
    window.click("Apply");
    let was_outdated = window.outdated_until("the wider column", |w| {
        is(w, 0.5) && w.resource::<Latest>().result.is_some()
    });
    assert!(was_outdated, "old numbers stand there as if nothing had happened");
    let written = fs::read_to_string(&file).expect("the scene");
    let expected = LONELY.replace("width_m: 0.4", "width_m: 0.5").replace("C30/37", "C35/45");
    assert_eq!(written, expected);
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(0)));
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::Z);
    window.until("the column as it was", |w| is(w, 0.4));
    assert_eq!(fs::read_to_string(&file).expect("the scene"), LONELY);
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND | egui::Modifiers::SHIFT, Key::Z);
    window.until("the wider column again", |w| is(w, 0.5));
    assert_eq!(fs::read_to_string(&file).expect("the scene"), expected);
}

/// Where bars begin and where they are lapped is changed in metres along the member, and changed
/// back.
#[test]
fn bars_are_lapped_in_the_sheet_and_whole_again() {
    let (mut window, folder) = with_seen();
    let file = folder.path().join("lonely.ron");
    opened(&mut window);
    for (field, text) in
        [("begin at", "0,3"), ("middle of lap 1", "1.5"), ("length of lap 1", "900")]
    {
        type_into(&mut window, field, text);
    }
    window.click("Apply");
    let bars = |w: &mut World| w.resource::<CurrentScene>().0.structure.assemblies[0].steel.len();
    window.until("bars in two pieces", |w| bars(w) == 16);
    let lapped = "diameter_mm: 20, from: 0.1, laps: [(at: 0.5, length_mm: 900)])";
    let written = fs::read_to_string(&file).expect("the scene");
    assert_eq!(written, LONELY.replace("diameter_mm: 20)", lapped));
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::Z);
    window.until("whole bars", |w| bars(w) == 8);
    assert_eq!(fs::read_to_string(&file).expect("the scene"), LONELY);
}

/// What has been typed stays in the sheet while evidence is attached, and goes once it is written.
#[test]
fn what_is_typed_stays_while_evidence_is_attached() {
    let (mut window, _folder) = with_seen();
    opened(&mut window);
    type_into(&mut window, "width", "0,55");
    window.click("Attach evidence…");
    window.until_seen("Fill in its width, mm.");
    type_into(&mut window, "width, mm", "0.9");
    window.click("Attach");
    window.until("the scene with it", |w| {
        w.resource::<CurrentScene>().0.structure.observations.len() == 2
    });
    window.frames(3);
    let typed = |window: &Window| window.harness.get_by_label("width").value();
    assert_eq!(typed(&window).as_deref(), Some("0,55"));
    assert!(has(&window, "one value changed"));
    window.click("Apply");
    window.until("the wider column", |w| is(w, 0.55));
    window.frames(3);
    assert_eq!(typed(&window).as_deref(), Some("0.55"));
    assert!(has(&window, "as in lonely.ron"));
}

/// What has been typed stays while another form is looked at and applied; the tree and that form say
/// that it waits, until it is discarded.
#[test]
fn what_is_typed_waits_while_another_form_is_applied() {
    let (mut window, folder) = with_seen();
    opened(&mut window);
    let marks = ["Something is typed into its form", "Typed and not applied"];
    let marked = |window: &Window| marks.map(|text| has(window, text));
    assert_eq!(marked(&window), [false, false]);
    type_into(&mut window, "width", "0,55");
    assert_eq!(marked(&window), [true, false]);
    window.ask(Action::Select(None));
    window.frames(3);
    assert_eq!(marked(&window), [true, true]);
    window.click("Owner, inspection, air");
    window.until_seen("Apply");
    window.frames(20);
    type_into(&mut window, "owner", "The county");
    window.click("Apply");
    let owner = |w: &mut World| w.resource::<CurrentScene>().0.structure.project.owner.clone();
    window.until("the owner", |w| owner(w) == "The county");
    window.frames(3);
    assert_eq!(marked(&window), [true, true]);
    window.ask(Action::Select(Some(0)));
    window.frames(3);
    assert_eq!(marked(&window), [true, false]);
    assert_eq!(window.harness.get_by_label("width").value().as_deref(), Some("0,55"));
    window.click("Apply");
    window.until("the wider column", |w| is(w, 0.55));
    window.ask(Action::Select(None));
    window.frames(3);
    assert_eq!(marked(&window), [false, false]);
    let written = fs::read_to_string(folder.path().join("lonely.ron")).expect("the scene");
    assert!(written.contains("owner: \"The county\"") && written.contains("width_m: 0.55"));
}

/// A height and a place along it are changed at once: the place is one of the new height. What a
/// field is too narrow to say stands below it, once.
#[test]
fn a_place_is_one_on_the_member_as_high_as_it_becomes() {
    let (mut window, folder) = with_seen();
    opened(&mut window);
    let note = "one more: place and length go together";
    assert_eq!(window.harness.query_all_by_label(note).count(), 1);
    type_into(&mut window, "begin at", "0,45");
    type_into(&mut window, "height", "4.5");
    window.click("Apply");
    let height = |w: &mut World| {
        let [low, high] = w.resource::<CurrentScene>().0.members[0].bounds;
        high.y - low.y
    };
    window.until("the higher column", |w| (height(w) - 4.5).abs() < 1e-4);
    let written = fs::read_to_string(folder.path().join("lonely.ron")).expect("the scene");
    let expected = LONELY.replace("height_m: 3", "height_m: 4.5");
    assert_eq!(written, expected.replace("diameter_mm: 20)", "diameter_mm: 20, from: 0.1)"));
}

/// What the file would be refused for is refused with its line; nothing is written, and what was
/// typed stays, to be mended.
#[test]
fn what_cannot_be_is_refused_with_the_line_of_the_file() {
    let (mut window, folder) = with_seen();
    let file = folder.path().join("lonely.ron");
    opened(&mut window);
    type_into(&mut window, "width", "wide");
    assert!(has(&window, "width: “wide” is no number"));
    type_into(&mut window, "width", "-0.4");
    window.click("Apply");
    window.until_seen("Copy details");
    assert!(has(&window, "Nothing was changed"));
    assert!(has(&window, "lonely.ron: members[0].body.section"));
    assert_eq!(fs::read_to_string(&file).expect("the scene"), LONELY);
    assert!(has(&window, "one value changed"));
    window.click("Discard");
    assert!(has(&window, "as in lonely.ron"));
    assert!(window.with(|w| is(w, 0.4)));
}

/// What stands on the report's cover is filled in where no member is selected.
#[test]
fn the_cover_of_the_report_is_filled_in() {
    let (mut window, folder) = with_seen();
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.frames(2);
    window.click("Owner, inspection, air");
    window.until_seen("Apply");
    window.frames(20);
    type_into(&mut window, "owner", "The county");
    type_into(&mut window, "inspected on", "2026-05-03");
    window.click("Apply");
    let owner = |w: &mut World| w.resource::<CurrentScene>().0.structure.project.owner.clone();
    window.until("the owner", |w| owner(w) == "The county");
    let written = fs::read_to_string(folder.path().join("lonely.ron")).expect("the scene");
    assert!(written.contains("project: (owner: \"The county\", inspected: \"2026-05-03\"),"));
}

/// A scene that comes with the program is shown and not changed.
#[test]
fn a_scene_of_the_program_is_shown_and_not_changed() {
    let mut window = super::with_column();
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("Concrete, size, bars, loads");
    window.frames(20);
    assert!(has(&window, "This scene is part of the program"));
    assert!(has(&window, "Choose concrete class"));
    assert!(window.harness.query_by_label("Apply").is_none());
}

/// A structure is made from a template: what is typed is seen before anything is written, what no
/// scene may be is refused, and then its folder is there and open.
#[test]
fn a_new_structure_is_seen_before_it_is_made() {
    let mut window = Window::new(|_| {});
    let folder = tempfile::tempdir().expect("a folder");
    window.frames(2);
    window.click("New structure…");
    window.until_seen("Preview");
    window.until_seen("height");
    window.click("Browse…");
    window.frames(2);
    assert!(has(&window, "type the folder's name instead"));
    let place = folder.path().join("pier");
    type_into(&mut window, "Folder to make", &place.display().to_string());
    type_into(&mut window, "title", "Pier 7");
    type_into(&mut window, "height", "-4");
    window.until_said("members[0].body");
    assert!(!place.exists());
    type_into(&mut window, "height", "4.5");
    // 0.4 × 0.4 × 4.5 m³.
    window.until_said("one member, 0.72 m³ of concrete");
    window.harness.get_by_role_and_label(Role::Button, "Make it").click();
    window.until("the scene", |w| w.get_resource::<CurrentScene>().is_some());
    let scene = window.with(|w| w.resource::<CurrentScene>().0.clone());
    assert_eq!((scene.title.as_str(), scene.path.as_path()), ("Pier 7", &*place.join("scene.ron")));
    let [low, high] = scene.members[0].bounds;
    assert!((high.y - low.y - 4.5).abs() < 1e-4);
    assert!(place.join("evidence.ron").exists());
    window.frames(2);
    assert!(window.harness.query_by_label("Preview").is_none(), "the dialog is gone");
}

impl Window {
    /// Frames until something has this text in its name.
    fn until_said(&mut self, text: &str) {
        for _ in 0..super::PATIENCE {
            if has(self, text) {
                return;
            }
            self.frame();
            super::rest();
        }
        panic!("{text} was not said");
    }
}

/// What `intrados predict` wrote a year ago.
pub(super) const EARLIER: &str = r#"{"schema": "intrados.predict/2", "scene": "lonely", "members": [
    {"id": "C1", "name": "Column 1", "damage": 0.02, "damage_std_error": 0.01, "state": "sound",
     "zones": [{"value": 0.02, "std_error": 0.01}, null, null, null, null, null, null, null, null, null]}]}"#;

/// An earlier prediction is looked at beside the newest, on the member's sheet too; and what was
/// said before a finding came is one.
#[test]
fn an_earlier_prediction_is_compared_with_the_newest() {
    let (mut window, folder) = with_seen();
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    let beside = "Damage of members in an earlier prediction";
    assert!(!has(&window, beside) && !has(&window, "then: d ="));
    let file = folder.path().join("predict.json");
    fs::write(&file, EARLIER).expect("written");
    window.ask(Action::Compare(file.clone()));
    window.frames(3);
    assert!(has(&window, beside) && has(&window, "then: d = 0.020 ± 0.010, sound"));
    let both = ["Damage of members", beside].map(|n| window.harness.get_by_label(n).rect());
    assert!(both[1].right() <= both[0].left(), "one beside the other: {both:?}");
    fs::write(&file, EARLIER.replace("C1", "Q1")).expect("written");
    window.ask(Action::Compare(file));
    window.frames(3);
    assert!(has(&window, "another structure"));

    window.click("Attach evidence…");
    window.until_seen("Fill in its width, mm.");
    type_into(&mut window, "width, mm", "0.9");
    type_into(&mut window, "Date", "2026-06-03");
    window.click("Attach");
    window.until("the prediction with it", |w| {
        w.resource::<CurrentScene>().0.structure.observations.len() == 2
            && w.resource::<Latest>().result.is_some()
    });
    window.frames(2);
    window.click("Compare");
    window.until_seen("Open an earlier prediction…");
    assert!(has(&window, "Prediction 1, "));
}
