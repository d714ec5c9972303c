//! Tools of the structure's picture and of the sheet, and what is left of a session that broke off.

use std::{fs, path::Path};

use egui_kittest::kittest::{NodeT, Queryable};
use intrados_mechanics::plugin::Analyses;
use intrados_panels::{Action, PanelsPlugin, Selection};
use intrados_scene::plugin::CurrentScene;
use intrados_stage::Work;

use super::{LONELY, Window, press, type_into, with_column, with_lonely};

/// Whether anything in the window has this text in its name.
fn has(window: &Window, text: &str) -> bool {
    window.harness.query_all_by_label_contains(text).next().is_some()
}

/// Two clicks on members are a distance with its unit, and select nothing.
#[test]
fn the_tape_reads_between_two_clicks() {
    let mut window = with_column();
    let rect = window.harness.get_by_label("Damage of members").rect();
    let places: Vec<egui::Pos2> = (1..40)
        .map(|k| rect.lerp_inside(egui::vec2(k as f32 / 40.0, 0.5)))
        .filter(|at| {
            press(&mut window, *at);
            window.with(|w| w.resource::<Selection>().0.is_some())
        })
        .collect();
    let (first, last) = (places[0], places[places.len() - 1]);
    window.ask(Action::Select(None));
    window.frames(2);
    window.click("Measure");
    assert!(has(&window, "Click the first place"));
    press(&mut window, first);
    assert!(has(&window, "Click the other place"));
    press(&mut window, last);
    assert!(has(&window, " level, "), "it reads nothing");
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(None));
    window.click("Clear the tape");
    assert!(has(&window, "Click the first place"));
}

/// What a section takes away is neither seen nor picked, and is there again without it.
#[test]
fn a_section_takes_away_what_lies_beyond_it() {
    let mut window = with_column();
    let rect = window.harness.get_by_label("Damage of members").rect();
    let picks = |window: &mut Window| -> Vec<Option<usize>> {
        let at = |k: usize| rect.lerp_inside(egui::vec2(k as f32 / 40.0, 0.5));
        let pick = |at: egui::Pos2| {
            press(window, at);
            window.with(|w| w.resource::<Selection>().0)
        };
        (1..40).map(at).map(pick).collect()
    };
    let whole = picks(&mut window);
    window.click("Section");
    window.click("x");
    let near = picks(&mut window);
    window.click("Other side");
    let far = picks(&mut window);
    let count = |all: &[Option<usize>]| all.iter().flatten().count();
    assert!(count(&near) < count(&whole) && count(&far) < count(&whole), "{near:?} {far:?}");
    let seen = |all: &[Option<usize>], k: usize| all[k].is_some();
    assert!((0..39).all(|k| !seen(&whole, k) || seen(&near, k) || seen(&far, k)));
    window.click("Section");
    assert_eq!(picks(&mut window), whole);
}

/// The sheet computes a member's stress itself and says what the analysis has found.
#[test]
fn the_sheet_computes_the_stress_of_its_member() {
    let (mut window, _folder) = with_lonely();
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.ask(Action::Select(Some(0)));
    window.frames(3);
    assert!(has(&window, "No load of this scene can be raised to failure."));
    window.harness.get_by_label("Compute its stress").scroll_to_me();
    window.frames(3);
    window.click("Compute its stress");
    let found = |w: &mut bevy_ecs::world::World| match w.resource::<Analyses>().get("C1")?.work {
        Work::Done(ref life) => life.outcome.members.first().map(|m| m.peak_compression_pa),
        _ => None,
    };
    window.until("the analysis", |w| found(w).is_some());
    window.frames(2);
    let peak = window.with(found).expect("an outcome");
    assert!(peak < -5e4, "the weight of three metres presses with 75 kPa: {peak}");
    assert!(has(&window, &format!("{:.1} MPa", peak / 1e6)));
}

/// A session that broke off is offered: scene, member and what was typed in the form are there
/// again.
#[test]
fn what_was_typed_before_a_crash_is_there_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("lonely.ron");
    fs::write(&scene, LONELY).expect("written");
    let file = folder.path().join("state/session.json");
    let kept = interrupted(&scene, &file);
    // As a crash leaves it: nobody has tidied up.
    fs::write(&file, kept).expect("written");
    let mut window = keeping(&file);
    window.frames(2);
    assert!(has(&window, "The last session was not ended"));
    window.click("Go on with it");
    window.until_seen("width, mm");
    let typed = window.harness.get_by_label("width, mm").accesskit_node().value();
    assert_eq!(typed.as_deref(), Some("0.45"));
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(0)));
    assert!(!has(&window, "The last session was not ended"));
}

/// Fills in a form; gives what is kept of it until the window is closed.
fn interrupted(scene: &Path, file: &Path) -> Vec<u8> {
    let mut window = keeping(file);
    window.ask(Action::Open(scene.to_owned()));
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("Attach evidence…");
    window.until_seen("Fill in its width, mm.");
    type_into(&mut window, "width, mm", "0.45");
    let mut kept = Vec::new();
    window.until("the session is kept", |_| {
        kept = fs::read(file).unwrap_or_default();
        String::from_utf8_lossy(&kept).contains("\"0.45\"")
    });
    drop(window);
    assert!(!file.exists(), "a session that was ended leaves nothing behind");
    kept
}

fn keeping(file: &Path) -> Window {
    let mut app = intrados::simulation();
    app.add_plugins(PanelsPlugin { session: Some(file.to_owned()), ..PanelsPlugin::default() });
    Window::of(app)
}
