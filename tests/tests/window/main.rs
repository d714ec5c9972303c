//! What the window does, without a screen: clicks go through the accessibility tree.

mod colours;
mod forms;
mod journey;
mod languages;
mod painter;
mod pictures;
mod tools;

use std::{cell::RefCell, path::Path, rc::Rc, time::Duration};

use bevy_app::App;
use bevy_ecs::prelude::*;
use egui::Key;
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use glam::Vec3;
use intrados_damage::Sources;
use intrados_light::{
    Render, RenderSettings, View,
    plugin::{ActiveCamera, Learning, Lit, MeasureSettings},
};
use intrados_mechanics::{
    member::Meshing,
    plugin::{Analyses, Analyze},
};
use intrados_panels::{
    Action, Actions, AddPanel, Latest, Log, Look, PanelsPlugin, Place, Quantity, Refine, Selection,
    Statistics, Taken, Viewpoint, Workspace, plus_minus, show,
};
use intrados_photo::{Pose, Site};
use intrados_predict::{PredictSettings, Predicting, Progress, predict};
use intrados_scene::{
    Camera, CrackSurface, Member, Mouth, Scene, SurfaceDamage, plugin::CurrentScene,
};
use intrados_stage::{Job, Jobs, Pace, Work};
use intrados_transport::{BATCH, Schedule, Side, Steering};
use intrados_xray::{
    plugin::{Scans, StopScan, TakeScan},
    scan::Corrections,
};
use painter::Painter;

/// A window and the world in it.
struct Window {
    app: Rc<RefCell<App>>,
    harness: Harness<'static>,
    painter: Painter,
}

/// Frames that are waited at most, each a hundredth of a second or more: only what never comes ends
/// here, on a busy machine too.
const PATIENCE: usize = 100_000;

/// What is waited for runs on threads of its own: frames without a pause would take a core from it.
fn rest() {
    std::thread::sleep(Duration::from_millis(10));
}

impl Window {
    fn new(add: impl FnOnce(&mut App)) -> Self {
        Self::paced(None, add)
    }

    /// With so much time a frame, or one pass.
    fn paced(slice: Option<Duration>, add: impl FnOnce(&mut App)) -> Self {
        let mut app = intrados::simulation();
        app.add_plugins(PanelsPlugin { slice, ..PanelsPlugin::default() });
        app.world_mut().resource_mut::<MeasureSettings>().enabled = false;
        add(&mut app);
        Self::of(app)
    }

    fn of(mut app: App) -> Self {
        app.finish();
        app.cleanup();
        let app = Rc::new(RefCell::new(app));
        let theirs = Rc::clone(&app);
        let painter = Painter::default();
        let harness = Harness::builder()
            .with_size([1280.0, 800.0])
            .with_max_steps(64)
            .renderer(painter.clone())
            .build_ui(move |ui| show(ui, theirs.borrow_mut().world_mut()));
        Self { app, harness, painter }
    }

    /// What is seen.
    fn picture(&self) -> image::RgbImage {
        let output = self.harness.output();
        let scale = output.pixels_per_point;
        let primitives = self.harness.ctx.tessellate(output.shapes.clone(), scale);
        self.painter.paint(&primitives, [1280, 800])
    }

    /// As the desktop does: the world, then the window.
    fn frame(&mut self) {
        self.app.borrow_mut().update();
        self.harness.step();
    }

    fn frames(&mut self, n: usize) {
        (0..n).for_each(|_| self.frame());
    }

    /// Frames until `done`; loading runs on threads of its own.
    fn until(&mut self, what: &str, mut done: impl FnMut(&mut World) -> bool) {
        for _ in 0..PATIENCE {
            self.frame();
            if done(self.app.borrow_mut().world_mut()) {
                return;
            }
            rest();
        }
        panic!("{what} did not happen");
    }

    /// Frames until `done`; whether numbers were marked as outdated on the way, which may be for a
    /// single frame.
    fn outdated_until(&mut self, what: &str, mut done: impl FnMut(&mut World) -> bool) -> bool {
        let mut was_outdated = false;
        for _ in 0..PATIENCE {
            self.frame();
            was_outdated |= self.harness.query_by_label("⚠ Outdated").is_some();
            if done(self.app.borrow_mut().world_mut()) {
                return was_outdated;
            }
            rest();
        }
        panic!("{what} did not happen");
    }

    /// Frames until a widget of this name is there.
    fn until_seen(&mut self, label: &str) {
        for _ in 0..PATIENCE {
            if self.harness.query_by_label(label).is_some() {
                return;
            }
            self.frame();
            rest();
        }
        panic!("{label} did not appear");
    }

    fn ask(&mut self, action: Action) {
        self.app.borrow_mut().world_mut().resource_mut::<Actions>().ask(action);
    }

    fn with<T>(&self, f: impl FnOnce(&mut World) -> T) -> T {
        f(self.app.borrow_mut().world_mut())
    }

    fn walks(&self) -> u64 {
        self.with(|w| {
            w.get_resource::<Render>()
                .map_or(0, |r| r.exposures().iter().flatten().map(|e| e.walks).sum())
        })
    }

    /// An expert's window with a bundled scene whose picture has begun, at its full size.
    fn with_scene(name: &str) -> Self {
        let mut window = Self::new(|_| {});
        window.ask(Action::Arrange(Workspace::Expert));
        window.ask(Action::Open(name.into()));
        window.until("a picture", |w| {
            !w.resource::<Viewpoint>().is_preview()
                && w.get_resource::<Render>().is_some_and(|r| r.samples_per_pixel() > 0.0)
        });
        window
    }

    fn click(&mut self, label: &str) {
        self.harness.get_by_label(label).click();
        // One frame for the click, one for what it asked for.
        self.frames(2);
    }
}

#[test]
fn the_start_screen_lists_the_bundled_scenes_and_a_click_opens_one() {
    let mut window = Window::new(|_| {});
    window.frame();
    for (name, _) in intrados_scene::bundled() {
        assert!(
            window.harness.query_all_by_label_contains(name).next().is_some(),
            "{name} is not on the start screen"
        );
    }
    let card =
        window.harness.get_all_by_label_contains("cornell").next().expect("the card was there");
    card.click();
    window.until("cornell", |w| {
        w.get_resource::<CurrentScene>().is_some_and(|s| s.0.name == "cornell")
    });
    window.frame();
    assert!(window.harness.query_by_label("Members").is_some());
}

#[test]
fn an_exposure_change_does_not_restart_and_a_camera_move_does() {
    let mut window = Window::with_scene("cornell");
    window.frames(3);
    let before = window.walks();
    window.with(|w| w.resource_mut::<Look>().exposure += 1.5);
    window.frames(2);
    let after = window.walks();
    assert!(after > before, "{after} walks after {before}");

    let old = window.with(|w| w.resource::<ActiveCamera>().0.clone());
    window.with(|w| {
        let mut viewpoint = w.resource_mut::<Viewpoint>();
        let mut camera = viewpoint.camera().cloned().expect("a scene has a camera");
        camera.position += Vec3::new(0.0, 0.1, 0.0);
        viewpoint.go(camera);
    });
    window.frame();
    assert_ne!(window.with(|w| w.resource::<ActiveCamera>().0.clone()), old);
    assert!(window.walks() < after, "the picture goes on with {} walks", window.walks());
}

#[test]
fn a_large_picture_begins_small_and_becomes_large() {
    // Where frames have a time, the large film is got ready off the frame.
    for slice in [None, Some(Duration::from_millis(2))] {
        let mut window = Window::paced(slice, |_| {});
        window.ask(Action::Arrange(Workspace::Expert));
        window.ask(Action::Open("column".into()));
        window.until("a small picture", |w| w.resource::<Viewpoint>().is_preview());
        let small = window.with(|w| w.resource::<RenderSettings>().sides);
        window.until("a large picture", |w| !w.resource::<Viewpoint>().is_preview());
        let (camera, wanted, sides, film) = window.with(|w| {
            let wanted = w.resource::<CurrentScene>().0.cameras[0].clone();
            let film = w.resource::<Render>().camera().clone();
            (
                w.resource::<ActiveCamera>().0.clone(),
                wanted,
                w.resource::<RenderSettings>().sides,
                film,
            )
        });
        assert_eq!((&camera, &film), (&wanted, &wanted), "{slice:?}");
        assert_ne!(small, sides, "the small picture needs one side only");
        // A restart keeps the old film until the new one is ready, and then begins at nothing.
        window.until("some walks", |w| w.resource::<Render>().samples_per_pixel() > 0.2);
        let before = window.walks();
        window.ask(Action::Restart);
        window.until("another film", |w| w.resource::<Render>().samples_per_pixel() < 0.2);
        assert!(window.walks() < before);
    }
}

#[test]
fn pause_stops_the_passes_and_continue_goes_on() {
    let mut window = Window::with_scene("cornell");
    window.click("⏸ Pause");
    assert_eq!(window.with(|w| *w.resource::<Pace>()), Pace::Rest);
    let before = window.walks();
    window.frames(5);
    assert_eq!(window.walks(), before);
    window.click("▶ Continue");
    assert!(window.walks() > before);
    window.harness.key_press(Key::Space);
    window.frames(2);
    let before = window.walks();
    window.frames(3);
    assert_eq!(window.walks(), before, "the space bar pauses too");
}

#[test]
fn restart_begins_from_the_first_pass() {
    let mut window = Window::with_scene("cornell");
    window.frames(6);
    let before = window.walks();
    window.click("⟲ Restart");
    assert!(window.walks() < before);
}

#[test]
fn views_and_bounces_do_not_restart() {
    let mut window = Window::with_scene("cornell");
    let before = window.walks();
    window.click("Dual");
    assert_eq!(window.with(|w| w.resource::<Look>().view), View::Dual);
    window.click("Error");
    window.with(|w| w.resource_mut::<Look>().order = Some(1));
    window.frames(2);
    assert!(window.walks() > before);
}

#[test]
fn a_click_in_the_tree_selects_a_member() {
    let mut window = Window::with_scene("column");
    let name = window.with(|w| w.resource::<CurrentScene>().0.members[1].name.clone());
    window.click(&name);
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(1)));
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(None));
}

/// Escape in a menu puts the menu away, and only the next one what lies below.
#[test]
fn escape_in_a_menu_leaves_the_selection() {
    let mut window = with_column();
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("View");
    assert!(window.harness.query_by_label("Light theme").is_some(), "the menu is not open");
    window.harness.key_press(Key::Escape);
    window.frames(3);
    assert!(window.harness.query_by_label("Light theme").is_none(), "the menu is still open");
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(0)));
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(None));
}

#[test]
fn a_bad_file_shows_a_banner_that_can_be_dismissed_and_the_old_scene_stays() {
    let mut window = Window::with_scene("cornell");
    let folder = tempfile::tempdir().expect("a folder for a bad file");
    let bad = folder.path().join("bad.ron");
    std::fs::write(&bad, "(schema: \"intrados.scene/1\", materials: [(name:").expect("written");
    window.ask(Action::Open(bad));
    window.frames(2);
    for _ in 0..2_000 {
        window.frame();
        if window.harness.query_by_label("Copy details").is_some() {
            break;
        }
        rest();
    }
    assert!(window.harness.query_by_label_contains("bad.ron").is_some(), "no banner");
    assert_eq!(window.with(|w| w.resource::<CurrentScene>().0.name.clone()), "cornell");
    window.click("Dismiss");
    assert!(window.harness.query_by_label("Copy details").is_none());
}

#[test]
fn a_foreign_panel_appears_in_its_place() {
    #[derive(Resource)]
    struct Dose(f64);
    fn dose(InMut(ui): InMut<egui::Ui>, dose: Res<Dose>) {
        ui.label(format!("{:.1} mGy", dose.0));
    }
    let mut window = Window::new(|app| {
        app.insert_resource(Dose(2.5)).add_panel(Place::Right, "Dose", dose).add_panel(
            Place::Tab,
            "Dose map",
            dose,
        );
    });
    window.ask(Action::Open("cornell".into()));
    window.until("cornell", |w| w.contains_resource::<CurrentScene>());
    window.frame();
    assert!(window.harness.query_by_label("2.5 mGy").is_some());
    window.click("Dose map");
    assert_eq!(window.harness.query_all_by_label("2.5 mGy").count(), 2);
}

/// Of a scene without members the picture of light is in front, whatever was before; an inspector
/// has a button that goes there, and structures open in the layout that was chosen.
#[test]
fn a_scene_without_members_shows_its_light() {
    let mut window = Window::with_scene("cornell");
    let draws = |window: &Window| window.harness.query_by_label("⏸ Pause").is_some();
    window.click("Structure");
    assert!(!draws(&window));
    window.ask(Action::Open("slit".into()));
    window.until("slit", |w| w.resource::<CurrentScene>().0.name == "slit");
    window.frames(3);
    assert!(draws(&window), "it opened on a picture with nothing in it");
    window.ask(Action::Arrange(Workspace::Inspector));
    window.frames(3);
    // In the picture, and in the sheet.
    assert_eq!(window.harness.query_all_by_label("Look at its light").count(), 2);
    window.harness.query_all_by_label("Look at its light").next().expect("a way").click();
    window.frames(3);
    assert!(draws(&window));
    window.ask(Action::Open("column".into()));
    window.until("column", |w| w.resource::<CurrentScene>().0.name == "column");
    window.frames(3);
    assert!(window.harness.query_by_label("Damage of members").is_some());
}

/// In a small window rows of tools wrap: what is at their ends stays in reach.
#[test]
fn a_small_window_has_all_tools_of_its_pictures() {
    let mut window = Window::with_scene("column");
    window.harness.set_size(egui::vec2(900.0, 600.0));
    window.frames(6);
    let ends = |window: &Window, tools: &[&str], beside: &str| {
        let edge = window.harness.get_by_label(beside).rect().left();
        for tool in tools {
            let rect = window.harness.get_by_label(tool).rect();
            assert!(rect.right() <= edge, "{tool} ends at {rect}, {beside} begins at {edge}");
        }
    };
    ends(&window, &["Light", "Keep as reference", "Smoothed preview"], "Inspector");
    window.ask(Action::Arrange(Workspace::Inspector));
    window.ask(Action::Tab("Structure"));
    window.frames(6);
    ends(&window, &["Names", "Compare", "As it looks"], "Members");
}

#[test]
fn every_tab_draws() {
    let mut window = Window::with_scene("column");
    window.until("all slices read", |w| {
        let (done, all) = w.resource::<Progress>().pieces();
        all > 0 && done == all
    });
    window.ask(Action::Select(Some(1)));
    window.click("Report");
    assert!(window.harness.query_by_label_contains("Evidence: ").is_some());
    window.click("Structure");
    assert!(window.harness.query_by_label("Damage of members").is_some());
    // From the member's sheet to its slices.
    window.click("Member");
    window.click("Its slices");
    window.until_seen("CT slice");
    for tab in ["Jobs", "Log", "Convergence", "Render"] {
        window.click(tab);
    }
    window.harness.key_press(Key::F1);
    // A window of egui measures itself before it is seen.
    window.frames(4);
    assert!(window.harness.query_by_label("pause or continue").is_some());
}

/// An inspector's window with the bundled column, without its prediction's lives and its network.
fn with_column() -> Window {
    let mut window = Window::new(|app| {
        app.world_mut().resource_mut::<Predicting>().settings =
            PredictSettings { forecast: None, ..PredictSettings::default() };
    });
    window.ask(Action::Open("column".into()));
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.frames(2);
    window
}

/// Of the window's area, the structure has two thirds; a member's sheet says what the prediction
/// said, and nothing that only experts read is in sight.
#[test]
fn a_structure_fills_the_window_and_a_member_has_its_sheet_beside_it() {
    let mut window = with_column();
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    window.frames(2);
    let picture = window.harness.get_by_label("Damage of members").rect();
    // Around it the harness leaves 8 points free on every side.
    assert!(picture.area() >= (1280.0 - 16.0) * (800.0 - 16.0) * 2.0 / 3.0, "{picture}");
    let (names, result) = window.with(|w| {
        let scene = w.resource::<CurrentScene>().0.clone();
        let names: Vec<String> = scene.members.iter().map(|m| m.name.clone()).collect();
        (names, w.resource::<Latest>().result.clone().expect("a prediction"))
    });
    for (index, name) in names.iter().enumerate() {
        window.click(name);
        assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(index)));
        let said = &result.members[index];
        let (damage, error) = said.damage.zip(said.damage_std_error).expect("it is damaged");
        let shown = format!("d = {}", plus_minus(damage, error, "").trim());
        let seen = |text: &str| window.harness.query_all_by_label(text).next().is_some();
        assert!(seen(&shown), "{name}: {shown}");
        assert!(seen(&said.state), "{name}: {}", said.state);
        for p in said.state_probability.values() {
            assert!(seen(&format!("{:.0} %", 100.0 * p)), "{name}: {p}");
        }
        for evidence in said.evidence.values() {
            assert!(seen(&evidence.basis), "{name}: {}", evidence.basis);
        }
        for defect in said.defects.iter().take(20) {
            assert!(seen(defect.kind), "{name}: {}", defect.kind);
        }
        assert_eq!(seen("Faces with defects"), !said.defects.is_empty(), "{name}");
    }
    // A click beside all members shows the structure again.
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert!(window.harness.query_by_label("The most damaged").is_some());
    let experts = ["Gap", "Convergence", "Meters", "Steering", "Directions"];
    let seen =
        |window: &Window, what: &str| window.harness.query_all_by_label(what).next().is_some();
    assert!(experts.iter().all(|what| !seen(&window, what)));
    window.harness.key_press(Key::F9);
    window.frames(3);
    assert!(experts[1..].iter().all(|what| seen(&window, what)));
}

/// While nobody sees the picture, no walk is made for it; whoever opens it gets it.
#[test]
fn a_picture_that_nobody_sees_rests() {
    let mut window = with_column();
    let before = window.walks();
    window.frames(5);
    assert_eq!((window.walks(), window.with(|w| *w.resource::<Pace>())), (before, Pace::Rest));
    window.ask(Action::Tab("Render"));
    window.until("a picture", |w| {
        w.get_resource::<Render>().is_some_and(|r| r.samples_per_pixel() > 0.0)
    });
}

/// A click in the picture of the structure selects the member that is there.
#[test]
fn a_member_is_picked_in_the_structure() {
    let mut window = with_column();
    window.frames(2);
    let rect = window.harness.get_by_label("Damage of members").rect();
    let mut picked = std::collections::BTreeSet::new();
    for k in 1..20 {
        let at = rect.lerp_inside(egui::vec2(k as f32 / 20.0, 0.5));
        press(&mut window, at);
        picked.extend(window.with(|w| w.resource::<Selection>().0));
    }
    assert!(picked.len() >= 2, "{picked:?}");
}

#[test]
fn the_palette_does_what_is_typed() {
    let mut window = with_column();
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::P);
    window.frames(3);
    window.harness.get_by_label("Command").type_text("member 2");
    window.frames(2);
    window.harness.key_press(Key::Enter);
    window.frames(3);
    assert!(window.with(|w| w.resource::<Selection>().0.is_some()));
    assert!(window.harness.query_by_label("Command").is_none(), "it is put away");
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::K);
    window.frames(3);
    window.harness.get_by_label("Command").type_text("panel log");
    window.frames(2);
    window.harness.key_press(Key::Enter);
    window.frames(3);
    assert!(window.harness.query_by_label_contains("opened column").is_some());
}

/// Types into a field of this name, in place of what was there.
fn type_into(window: &mut Window, field: &str, text: &str) {
    window.harness.get_by_label(field).focus();
    window.frame();
    window.harness.key_combination_modifiers(egui::Modifiers::COMMAND, &[Key::A]);
    window.frame();
    window.harness.get_by_label(field).type_text(text);
    window.frames(2);
}

/// A finding is noted in the form; what was predicted before is outdated until the next prediction
/// is there; the member stays selected, and Ctrl+Z takes it back.
#[test]
fn a_finding_is_noted_in_the_form_and_taken_back() {
    let (mut window, folder) = with_lonely();
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    let evidence = folder.path().join("evidence.ron");
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("Attach evidence…");
    window.until_seen("Fill in its width, mm.");
    type_into(&mut window, "width, mm", "0.7");
    type_into(&mut window, "Date", "2026-05-03");
    window.click("Attach");
    let observed = |w: &mut World| w.resource::<CurrentScene>().0.structure.observations.len();
    let was_outdated = window.outdated_until("the prediction with it", |w| {
        observed(w) == 1 && w.resource::<Latest>().result.is_some()
    });
    assert!(was_outdated, "old numbers stood there as if nothing had happened");
    window.frames(2);
    assert!(window.harness.query_by_label("⚠ Outdated").is_none());
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(0)));
    assert!(window.harness.query_by_label("2026-05-03").is_some(), "its row in the sheet");
    let said = window.with(|w| w.resource::<Latest>().result.clone()).expect("a prediction");
    assert!(said.members[0].evidence.contains_key("survey"));
    let written = std::fs::read(&evidence).expect("the evidence");
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::Z);
    window.until("the scene without it", |w| observed(w) == 0);
    assert!(!evidence.exists());
    let again = egui::Modifiers::COMMAND | egui::Modifiers::SHIFT;
    window.harness.key_press_modifiers(again, Key::Z);
    window.until("the scene with it", |w| observed(w) == 1);
    assert_eq!(std::fs::read(&evidence).expect("the evidence"), written);
}

/// A table of the prediction is saved alone, and says what the report's says.
#[test]
fn a_table_is_saved_alone() {
    let (mut window, folder) = with_lonely();
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    let file = folder.path().join("members.csv");
    window.ask(Action::Save(Taken::Table("members")));
    window.frames(3);
    type_into(&mut window, "File to write", &file.display().to_string());
    window.harness.get_by_role_and_label(egui::accesskit::Role::Button, "Save").click();
    window.until("the table", |_| file.exists());
    let table = std::fs::read_to_string(&file).expect("a table");
    let result = window.with(|w| w.resource::<Latest>().result.clone()).expect("a prediction");
    assert_eq!(table.lines().count(), 1 + result.members.len());
    assert!(result.members.iter().all(|m| table.contains(&m.id)));
}

/// How panels lie is there again in the next session, and what was closed stays closed.
#[test]
fn a_layout_survives_a_restart() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("layout.json");
    let open = || {
        let mut app = intrados::simulation();
        let layout = Some(file.clone());
        app.add_plugins(PanelsPlugin { layout, ..PanelsPlugin::default() });
        let mut window = Window::of(app);
        window.ask(Action::Open("column".into()));
        window.until("a scene", |w| w.contains_resource::<CurrentScene>());
        window.frames(3);
        window
    };
    let mut window = open();
    assert!(window.harness.query_by_label("Members").is_some());
    window.ask(Action::Panel("Members".into(), false));
    window.ask(Action::Panel("Log".into(), true));
    window.frames(3);
    drop(window);
    let mut window = open();
    let seen = |window: &Window, what: &str| window.harness.query_by_label(what).is_some();
    assert!(!seen(&window, "Members") && seen(&window, "Log"));
    window.ask(Action::ResetLayout);
    window.frames(3);
    assert!(seen(&window, "Members") && !seen(&window, "Log"));
}

/// The preview that a moving camera gets has fewer pixels than the picture that the pointer is
/// over.
#[test]
fn the_inspector_follows_a_moving_camera() {
    let mut window = Window::with_scene("column");
    let at = window.harness.get_by_label("Picture").rect().right_bottom() - egui::vec2(3.0, 3.0);
    window.harness.hover_at(at);
    window.frames(2);
    let seen = |window: &Window| window.harness.query_by_label("Radiance Y").is_some();
    assert!(seen(&window), "nothing is read under the pointer");
    for key in [Key::F, Key::Home] {
        window.harness.key_press(key);
        window.frame();
        let mut previewed = false;
        window.until("the large picture again", |w| {
            let is_preview = w.resource::<Viewpoint>().is_preview();
            previewed |= is_preview;
            previewed && !is_preview
        });
        // The large film is exposed row by row, and the pointer is over its last ones.
        window.until_seen("Radiance Y");
    }
}

#[test]
fn a_system_without_file_dialogs_says_so() {
    let mut window = Window::new(|_| {});
    window.frame();
    window.click("Open…");
    assert!(window.harness.query_by_label_contains("No file dialog on this system").is_some());
    assert!(window.harness.query_by_label_contains("intrados view FILE").is_some());
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert!(window.harness.query_by_label_contains("No file dialog").is_none());
}

/// From one sample a pixel nobody knows an error, however much the user would bear.
#[test]
fn nothing_is_claimed_of_an_error_that_nobody_knows() {
    let mut window = Window::with_scene("cornell");
    window.with(|w| w.resource_mut::<Refine>().target = 0.5);
    let samples = |w: &mut World| w.resource::<Statistics>().now().map(|n| n.samples_per_pixel);
    window.until("the first sum", |w| samples(w).is_some());
    let (now, there) = window.with(|w| {
        let statistics = w.resource::<Statistics>();
        (statistics.now().cloned().expect("summed up"), w.resource::<Refine>().is_there(statistics))
    });
    window.frame();
    let claims = |window: &Window| {
        ["✔ Mean converged", "✔ Target of the mean reached"]
            .map(|t| window.harness.query_by_label(t).is_some())
    };
    assert!(now.samples_per_pixel < 2.0 && !there, "{now:?}");
    assert!(now.trust.complaint.contains("fewer than two samples"), "{:?}", now.trust);
    assert_eq!(claims(&window), [false; 2]);
    // Both come once they are earned.
    window.until("the target", |w| w.resource::<Refine>().is_there(w.resource::<Statistics>()));
    window.frames(2);
    assert_eq!(claims(&window), [true; 2]);
}

/// One column that nobody has looked into: its life alone.
const LONELY: &str = r#"(
    schema: "intrados.scene/1",
    materials: [(name: "concrete", colour: (0.5, 0.5, 0.5))],
    members: [(
        id: "C1", name: "Column 1", at: (0, 0, 0), concrete: "C30/37", material: "concrete",
        body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3, reinforcement: (cover_mm: 35, bars: [Around(count: 8, diameter_mm: 20)])),
    )],
    lamps: [Environment(name: "sky", radiance: (0.5, 0.6, 0.75))],
    cameras: [(name: "front", position: (2.2, 1.7, 4.5), target: (0, 1.45, 0), fov_deg: 40, width: 96, height: 96)],
    supports: [(member: "C1", place: Start, hold: Fixed)],
    loads: [(name: "self weight", action: SelfWeight)],
)"#;

/// A window with it, whose prediction runs off the frame.
fn with_lonely() -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder for the scene");
    let file = folder.path().join("lonely.ron");
    std::fs::write(&file, LONELY).expect("written");
    let mut window = Window::paced(Some(Duration::from_millis(2)), |_| {});
    window.ask(Action::Open(file));
    (window, folder)
}

#[test]
fn a_prediction_goes_on_while_the_picture_is_paused_and_is_saved_as_by_predict() {
    let (mut window, folder) = with_lonely();
    window.until("a picture", |w| w.get_resource::<Render>().is_some());
    window.with(|w| w.resource_mut::<Refine>().paused = true);
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    assert_eq!(window.with(|w| *w.resource::<Pace>()), Pace::Rest, "the picture is paused");
    window.click("Report");
    window.click("Browse…");
    window.frames(2);
    let asked = "type the folder's name instead";
    assert!(window.harness.query_all_by_label_contains(asked).next().is_some());
    let out = folder.path().join("out");
    window.harness.get_by_label("Save to folder").focus();
    window.frame();
    window.harness.key_combination_modifiers(egui::Modifiers::COMMAND, &[Key::A]);
    window.frame();
    window.harness.get_by_label("Save to folder").type_text(&out.display().to_string());
    window.frames(2);
    window.click("Save report");
    window.until("the report", |w| {
        w.resource::<Log>().lines().iter().any(|line| line.starts_with("wrote 12 files"))
    });
    let mut names: Vec<_> = std::fs::read_dir(&out)
        .expect("a folder")
        .map(|f| f.expect("a file").file_name().into_string())
        .collect();
    names.sort();
    let expected = [
        "damage-3.0.bcf",
        "damage.bcf",
        "damage.glb",
        "damage.vtu",
        "defects.csv",
        "evidence.csv",
        "members.csv",
        "pores.csv",
        "predict.json",
        "report.html",
        "slices.csv",
        "zones.csv",
    ];
    assert_eq!(names, expected.map(|n| Ok(n.to_owned())));
    let read = std::fs::read_to_string(out.join("predict.json")).expect("read");
    let read: serde_json::Value = serde_json::from_str(&read).expect("JSON");
    let shown = window.with(|w| w.resource::<Latest>().result.clone()).expect("a prediction");
    assert_eq!(read["members"], serde_json::to_value(&shown.members).expect("JSON"));
    // Where nothing can be written, that is said.
    let taken = folder.path().join("taken");
    std::fs::write(&taken, "a file").expect("written");
    window.harness.get_by_label("Save to folder").focus();
    window.frame();
    window.harness.key_combination_modifiers(egui::Modifiers::COMMAND, &[Key::A]);
    window.frame();
    window.harness.get_by_label("Save to folder").type_text(&taken.display().to_string());
    window.frames(2);
    window.click("Save report");
    window.until_seen("⚠ Not saved:");
}

/// Cancelled in its first piece, it does nothing more until it is asked to, and predicts the same
/// then.
#[test]
fn a_prediction_is_cancelled_and_goes_on() {
    let (mut window, _folder) = with_lonely();
    let is_predicting = |w: &mut World| {
        w.resource_mut::<Jobs>().running().iter().any(|job| job.label().contains("the life of"))
    };
    window.until("its beginning", |w| is_predicting(w));
    let mut jobs = window.with(|w| w.resource_mut::<Jobs>().running().to_vec());
    jobs.retain(|job| job.label().contains("the life of"));
    // What the button does; a click takes frames, and the life may be over by then.
    jobs.iter().for_each(Job::cancel);
    window.frames(2);
    assert!(window.with(|w| w.resource::<Progress>().is_cancelled()), "it was asked to stop");
    assert!(window.harness.query_by_label_contains("Prediction cancelled: 0 of 1").is_some());
    // The thread hears it too, and no other piece is begun.
    window.until("the end of the thread", |_| jobs.iter().all(Job::is_finished));
    window.frames(20);
    assert!(
        !window.with(is_predicting) && window.with(|w| w.resource::<Progress>().pieces()) == (0, 1)
    );
    assert!(window.with(|w| w.resource::<Progress>().failures().is_empty()
        && w.resource::<Latest>().result.is_none()));
    window.click("▶ Predict on");
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    let (shown, scene) = window
        .with(|w| (w.resource::<Latest>().result.clone(), w.resource::<CurrentScene>().0.clone()));
    let at_once = predict(&scene, intrados::predicting(), &Sources::default(), &Job::default())
        .expect("a prediction");
    assert_eq!(shown.expect("it is there").members, at_once.members);
}

/// Whether a field steers the picture.
fn is_steered(world: &mut World) -> bool {
    world
        .get_resource::<Render>()
        .is_some_and(|r| r.exposures().iter().flatten().any(|e| e.field != 0))
}

/// A window with `slit`, where steering pays, that learns little and therefore soon.
fn with_slit() -> Window {
    let window = Window::with_scene("slit");
    window.with(|w| w.resource_mut::<Learning>().schedule = Schedule { first: BATCH, rounds: 2 });
    window
}

#[test]
fn steering_learns_off_the_frame_and_begins_the_picture_anew() {
    let mut window = with_slit();
    window.harness.get_by_role_and_label(egui::accesskit::Role::Button, "Steering").click();
    window.frames(2);
    assert!(window.harness.query_all_by_label_contains("nothing is learnt").next().is_some());
    window.harness.get_by_role_and_label(egui::accesskit::Role::ComboBox, "Steering").click();
    window.frames(2);
    window.click("on");
    assert_eq!(window.with(|w| w.resource::<Learning>().steering), Steering::On);
    let mut was_listed = false;
    let mut most = 0;
    window.until("a steered picture", |w| {
        was_listed |=
            w.resource_mut::<Jobs>().running().iter().any(|job| job.label().contains("learning"));
        let steered = is_steered(w);
        if !steered {
            most = w.resource::<Render>().exposures().iter().flatten().map(|e| e.walks).sum();
        }
        steered
    });
    assert!(was_listed, "no job was listed");
    assert!(window.walks() < most, "the steered picture goes on with {} walks", window.walks());
    window.frames(2);
    // What the panel says.
    for text in ["relVar of a walk by round", "Figure of merit by", "Surface", "B floor"] {
        assert!(
            window.harness.query_all_by_label_contains(text).next().is_some(),
            "{text} is missing"
        );
    }
    assert!(window.harness.query_by_label("Directions of the importance field").is_some());
    // A restart keeps what was learnt; turning it off does not.
    window.click("⟲ Restart");
    assert!(window.with(is_steered));
    window.with(|w| w.resource_mut::<Learning>().steering = Steering::Off);
    window.frames(2);
    assert!(
        !window.with(is_steered) && window.with(|w| w.resource::<Learning>().guide().is_none())
    );
}

#[test]
fn fields_are_shown_and_a_camera_move_forgets_them() {
    let mut window = with_slit();
    window.click("Radiance field");
    assert_eq!(window.with(|w| w.resource::<Look>().quantity), Quantity::Field(Side::Primal));
    window.with(|w| w.resource_mut::<Learning>().steering = Steering::On);
    window.until("a guide", |w| w.resource::<Learning>().guide().is_some());
    let folder = tempfile::tempdir().expect("a folder for the pictures");
    let files = ["Radiance field", "Importance field"].map(|name| {
        window.click(name);
        let picture = format!("Picture: {name}");
        for _ in 0..2_000 {
            if window.harness.query_by_label(&picture).is_some() {
                break;
            }
            window.frame();
            rest();
        }
        assert!(window.harness.query_by_label(&picture).is_some(), "no picture of the {name}");
        let file = folder.path().join(format!("{name}.png"));
        export(&mut window, &file);
        let camera = window.with(|w| w.resource::<Render>().camera().clone());
        let (width, height) = image::image_dimensions(&file).expect("a picture");
        assert!(height > width * camera.height / camera.width + 30, "no legend is under it");
        std::fs::read(file).expect("written")
    });
    assert!(
        files.iter().all(|file| file.len() > 1000) && files[0] != files[1],
        "both fields look alike"
    );

    let first = window.with(|w| w.resource::<Learning>().guide().map(|g| g.fingerprint()));
    window.with(|w| {
        let mut viewpoint = w.resource_mut::<Viewpoint>();
        let mut camera = viewpoint.camera().cloned().expect("a scene has a camera");
        camera.position += Vec3::new(0.0, 0.1, 0.0);
        viewpoint.go(camera);
    });
    window.frames(2);
    assert!(
        window.with(|w| w.resource::<Learning>().guide().is_none()) && !window.with(is_steered)
    );
    // Not before the camera has rested.
    assert!(
        window.with(|w| w.resource::<Learning>().progress().is_none()
            && w.resource::<Learning>().is_coming())
    );
    window.until("another guide", |w| w.resource::<Learning>().guide().is_some());
    assert_ne!(window.with(|w| w.resource::<Learning>().guide().map(|g| g.fingerprint())), first);
}

#[test]
fn a_cancelled_lesson_turns_steering_off() {
    let mut window = Window::with_scene("slit");
    // Would take long.
    window.with(|w| {
        let mut learning = w.resource_mut::<Learning>();
        (learning.steering, learning.schedule) =
            (Steering::On, Schedule { first: BATCH, rounds: 12 });
    });
    window.until("a lesson", |w| w.resource::<Learning>().progress().is_some());
    window.click("Jobs");
    window.harness.query_all_by_label("Cancel").next().expect("a job can be cancelled").click();
    window.until("the end of it", |w| w.resource::<Learning>().progress().is_none());
    assert_eq!(window.with(|w| w.resource::<Learning>().steering), Steering::Off);
    window.frames(2);
    assert!(!window.with(is_steered) && window.walks() > 0);
}

#[test]
fn the_picture_is_written_as_png() {
    let mut window = Window::with_scene("cornell");
    let folder = tempfile::tempdir().expect("a folder for the picture");
    let file = folder.path().join("view.png");
    export(&mut window, &file);
    // And says what it shows, by what it was made, and of which scene.
    let hash = window.with(|w| w.resource::<CurrentScene>().0.hash.clone());
    let written = std::fs::read(&file).expect("a picture");
    for said in ["Software", "Intrados ", "samples a pixel, seed ", hash.as_str()] {
        let bytes = said.as_bytes();
        assert!(written.windows(bytes.len()).any(|w| w == bytes), "it does not say {said:?}");
    }
}

/// What cannot be written is said where nobody overlooks it.
#[test]
fn a_picture_that_cannot_be_written_has_a_banner() {
    let mut window = Window::with_scene("cornell");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("no_folder");
    std::fs::write(&file, "").expect("written");
    window.ask(Action::Export);
    window.frames(3);
    type_into(&mut window, "File name", &file.join("view.png").display().to_string());
    window.click("Save");
    window.until_seen("⚠ Not saved:");
}

/// Opens the Stress tab for member `index` with elements of `element` metres.
fn stress_of(window: &mut Window, index: usize, element: f64) {
    window.ask(Action::Select(Some(index)));
    window.frames(2);
    window.click("Stress");
    assert!(window.harness.query_by_label("Not analysed yet").is_some());
    let model = window.with(|w| w.resource::<CurrentScene>().0.members[index].id.clone());
    window.with(|w| {
        w.write_message(Analyze {
            model,
            meshing: Meshing { element: Some(element) },
            to_failure: false,
        })
    });
}

#[test]
fn a_member_is_analysed_and_shown() {
    let mut window = Window::with_scene("column");
    window.click("Stress");
    assert!(window.harness.query_by_label_contains("Select a member").is_some());
    stress_of(&mut window, 0, 0.2);
    window.until("an outcome", |w| {
        w.resource::<Analyses>().get("C1").is_some_and(|a| matches!(a.work, Work::Done(_)))
    });
    window.frames(2);
    let pictures = |window: &Window| {
        window.harness.query_by_label_contains("Stress: Largest principal").is_some()
    };
    assert!(pictures(&window) && window.harness.query_by_label_contains("whole life").is_some());
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["view.png", "table.csv"] {
        let file = folder.path().join(name);
        window.harness.get_by_label("Save as").focus();
        window.frame();
        window.harness.key_combination_modifiers(egui::Modifiers::COMMAND, &[Key::A]);
        window.frame();
        window.harness.get_by_label("Save as").type_text(&file.display().to_string());
        window.frames(2);
        window.click("Save picture or table");
        window.until(name, |_| file.exists());
    }
    let table = std::fs::read_to_string(folder.path().join("table.csv")).expect("written");
    assert!(table.lines().count() > 50 && table.starts_with("x_m,"));
    // Another scene: nothing of the old one is left.
    window.ask(Action::Open("cornell".into()));
    window.until("cornell", |w| w.resource::<CurrentScene>().0.name == "cornell");
    assert!(window.with(|w| w.resource::<Analyses>().get("C1").is_none()));
}

/// Of the prestressed lining, the forces of all tendons are drawn beside the picture, before it is
/// over.
#[test]
fn tendons_of_a_lining_are_drawn() {
    let mut window = Window::with_scene("tunnel");
    let lining = window
        .with(|w| w.resource::<CurrentScene>().0.members.iter().position(|m| m.id == "T1"))
        .expect("a lining");
    stress_of(&mut window, lining, 0.45);
    let seen = |w: &mut World| {
        w.resource::<Analyses>().get("T1").is_some_and(|a| a.seen.shots().len() > 1)
    };
    window.until("two equilibria", seen);
    window.frames(2);
    for label in ["Tendon force, kN", "12 tendons", "displacement, mm", "widest crack, mm"] {
        assert!(window.harness.query_by_label(label).is_some(), "{label}");
    }
    window.click("⏹ Stop");
    window.until("its end", |w| !w.resource::<Analyses>().is_busy());
    let kept = window.with(|w| match &w.resource::<Analyses>().get("T1").expect("it ran").work {
        Work::Done(life) => Some((life.outcome.stopped, life.outcome.steps.len())),
        _ => None,
    });
    assert!(kept.is_some_and(|(stopped, steps)| stopped && steps > 1), "{kept:?}");
    let said = "⏹ Stopped: what had been found until then is shown.";
    assert!(window.harness.query_by_label(said).is_some());
}

#[test]
fn an_analysis_can_be_stopped() {
    let mut window = Window::with_scene("column");
    stress_of(&mut window, 0, 0.06);
    window.until("the beginning", |w| w.resource::<Analyses>().is_busy());
    window.frames(2);
    window.click("⏹ Stop");
    window.until("its end", |w| !w.resource::<Analyses>().is_busy());
    // It may have come to an equilibrium by then.
    assert!(window.with(|w| match w.resource::<Analyses>().get("C1").map(|a| &a.work) {
        Some(Work::Done(life)) => life.outcome.stopped,
        Some(work) => matches!(work, Work::Cancelled),
        None => false,
    }));
}

/// Opens the CT tab for member `index` and waits for its first slice.
fn slices_of(window: &mut Window, index: usize) {
    window.ask(Action::Select(Some(index)));
    window.frames(2);
    window.click("CT");
    window.until_seen("CT slice");
}

/// The table's rows: name, place in mm, whether it is marked.
fn pores(window: &Window) -> Vec<(String, [f32; 2], bool)> {
    let rows = window.harness.query_all_by_label_contains(" mm").filter_map(|node| {
        let name = node.accesskit_node().label()?;
        let (x, y) = name
            .strip_prefix("pore ")?
            .split_once(" at ")?
            .1
            .strip_suffix(" mm")?
            .split_once(", ")?;
        let marked =
            node.accesskit_node().toggled().is_some_and(|t| t == egui::accesskit::Toggled::True)
                || node.accesskit_node().is_selected().unwrap_or(false);
        Some((name.clone(), [x.parse().ok()?, y.parse().ok()?], marked))
    });
    rows.collect()
}

#[test]
fn pores_are_picked_in_the_table_and_in_the_slice() {
    let mut window = Window::with_scene("column");
    slices_of(&mut window, 2);
    let rows = pores(&window);
    assert!(rows.len() > 5 && rows.iter().all(|r| !r.2), "{rows:?}");
    window.click(&rows[3].0);
    let marked = |window: &Window| {
        pores(window).into_iter().filter(|r| r.2).map(|r| r.0).collect::<Vec<_>>()
    };
    assert_eq!(marked(&window), [rows[3].0.clone()]);
    // The other way round: all of the slice, 512 pixels of 0.9 mm, fits into the picture.
    let rect = window.harness.get_by_label("CT slice").rect();
    let scale = rect.width().min(rect.height()) / (512.0 * 0.9);
    let at = rect.center()
        + scale * (egui::vec2(rows[0].1[0], rows[0].1[1]) - egui::Vec2::splat(256.0 * 0.9));
    window.harness.hover_at(at);
    window.frame();
    for pressed in [true, false] {
        let button = egui::PointerButton::Primary;
        window.harness.event(egui::Event::PointerButton {
            pos: at,
            button,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
        window.frame();
    }
    window.frames(2);
    assert_eq!(marked(&window), [rows[0].0.clone()]);
    // The other slices are read on demand, and the button is gone then.
    window.harness.get_by_label_contains("Read the other").click();
    window.frames(2);
    window.until("all slices", |w| {
        w.resource_mut::<Jobs>().running().iter().all(|job| !job.label().contains("CT slices"))
    });
    window.frames(3);
    assert!(window.harness.query_by_label_contains("Read the other").is_none());
}

#[test]
fn a_member_is_scanned_and_restored_again() {
    let mut window = Window::with_scene("column");
    slices_of(&mut window, 0);
    window.click("Simulated scan");
    assert!(window.harness.query_by_label("Not scanned yet").is_some());
    let wish = TakeScan {
        member: "C1".into(),
        along: 0.5,
        views: 48,
        width: 40,
        slices: 2,
        seed: 1,
        corrections: Corrections::ALL,
    };
    window.with(|w| w.write_message(wish));
    let mut forming = false;
    window.until("a scan", |w| {
        let scan = w.resource::<Scans>().get("C1");
        forming |= scan.is_some_and(|s| s.work.is_running() && !s.sinogram.is_empty());
        scan.is_some_and(|s| s.done().is_some())
    });
    assert!(forming, "nobody could have seen the sinogram form");
    window.until_seen("CT slice");
    window.click("Sinogram");
    assert!(window.harness.query_by_label("Sinogram of C1").is_some());
    window.click("Slices");
    let first = window.with(|w| {
        w.resource::<Scans>()
            .get("C1")
            .and_then(|s| s.done())
            .map(|d| (d.restored.volume.data.clone(), d.corrections))
    });
    window.click("hardening");
    window.until(
        "other slices",
        |w| matches!(w.resource::<Scans>().get("C1").map(|s| &s.work), Some(Work::Done(d)) if !d.corrections.hardening),
    );
    let again = window.with(|w| {
        w.resource::<Scans>()
            .get("C1")
            .and_then(|s| s.done())
            .map(|d| (d.restored.volume.data.clone(), d.corrections))
    });
    assert!(first != again && first.is_some() && again.is_some());
    // Another scene: nothing of the old one is left.
    window.ask(Action::Open("cornell".into()));
    window.until("cornell", |w| w.resource::<CurrentScene>().0.name == "cornell");
    assert!(window.with(|w| w.resource::<Scans>().get("C1").is_none()));
}

#[test]
fn a_scan_can_be_stopped() {
    let mut window = Window::with_scene("column");
    let wish = TakeScan {
        member: "C1".into(),
        along: 0.5,
        views: 720,
        width: 512,
        slices: 16,
        seed: 1,
        corrections: Corrections::ALL,
    };
    window.with(|w| w.write_message(wish));
    window.until("its beginning", |w| w.resource::<Scans>().is_busy());
    window.with(|w| w.write_message(StopScan("C1".into())));
    window.until("its end", |w| {
        matches!(w.resource::<Scans>().get("C1").map(|s| &s.work), Some(Work::Cancelled))
    });
}

/// Leaves a crack on a member.
fn crack(world: &mut World) {
    let (entity, member) = world
        .query::<(Entity, &Member)>()
        .iter(world)
        .next()
        .map(|(e, m)| (e, m.clone()))
        .expect("members");
    let front = member.bounds[1].z;
    let mouth = [-0.1, 0.1].map(|x| Mouth {
        at: Vec3::new(member.frame.start.x + x, 1.5, front),
        outward: Vec3::Z,
        width: 1e-3,
    });
    let crack = CrackSurface { mouth: mouth.to_vec(), normal: Vec3::Y, depth: 0.1 };
    let damage = SurfaceDamage { member: member.id, cracks: vec![crack], spalls: Vec::new() };
    world.entity_mut(entity).insert(damage);
}

/// Cracks that come while the camera moves, and is a small one, leave the scene's camera its home.
#[test]
fn cracks_that_come_while_the_camera_moves_leave_its_home() {
    let mut window = Window::with_scene("column");
    let hash = |w: &mut World| w.get_resource::<Lit>().map(|lit| lit.0.scene.hash.clone());
    let (before, home) = window.with(|w| (hash(w), w.resource::<Viewpoint>().home.clone()));
    assert!(before.is_some() && home.is_some());
    window.with(crack);
    window.until("the damaged scene", |w| {
        let is_there = hash(w) != before;
        let mut viewpoint = w.resource_mut::<Viewpoint>();
        let mut camera = viewpoint.camera().cloned().expect("a scene has a camera");
        camera.position.x += 1e-3;
        viewpoint.go(camera);
        is_there
    });
    window.until("the large picture", |w| !w.resource::<Viewpoint>().is_preview());
    let (now, camera) = window.with(|w| {
        let viewpoint = w.resource::<Viewpoint>();
        (viewpoint.home.clone(), viewpoint.camera().cloned())
    });
    assert_eq!(now, home);
    assert_eq!(camera.map(|c| c.width), home.map(|c| c.width));
}

/// What mechanics leaves on a member is in the picture, which goes on from where the camera is.
#[test]
fn cracks_come_into_the_picture() {
    let mut window = Window::with_scene("column");
    let before = window.with(|w| {
        (w.resource::<Lit>().0.scene.hash.clone(), w.resource::<ActiveCamera>().0.clone())
    });
    window.with(crack);
    window.until("the damaged scene", |w| {
        w.get_resource::<Lit>().is_some_and(|l| l.0.scene.hash != before.0)
    });
    window.frames(2);
    assert_eq!(window.with(|w| w.resource::<ActiveCamera>().0.position), before.1.position);
    assert!(window.with(|w| {
        w.resource::<Lit>().0.scene.objects.iter().any(|o| o.name.starts_with("cracks of"))
    }));
}

/// By menu and sheet.
fn export(window: &mut Window, file: &Path) {
    window.click("File");
    window.harness.get_by_label_contains("Export picture…").click();
    window.frames(3);
    let field = window.harness.get_by_label("File name");
    field.focus();
    window.frame();
    window.harness.key_combination_modifiers(egui::Modifiers::COMMAND, &[Key::A]);
    window.frame();
    window.harness.get_by_label("File name").type_text(&file.display().to_string());
    window.frames(2);
    window.click("Save");
    window.until("the file", |_| file.exists());
}

/// A pillar before a wall, and a photograph of it: flat colours, that is all that placing needs.
fn photographed(folder: &Path) -> (std::path::PathBuf, std::path::PathBuf, Camera) {
    let scene = r#"(
    schema: "intrados.scene/1",
    materials: [(name: "concrete", colour: (0.42, 0.41, 0.4))],
    members: [(
        id: "P", name: "Pillar",
        body: Column(section: Rectangle(width_m: 0.3, depth_m: 0.3), height_m: 0.6),
        at: (0, 0, 0), concrete: "C30/37", material: "concrete",
    )],
    lamps: [Environment(name: "sky", radiance: (1, 1, 1))],
    cameras: [(name: "shot", position: (0.3, 0.5, 1.15), target: (0.03, 0.3, 0.1), fov_deg: 42, width: 400, height: 400, exposure: 0)],
)"#;
    let path = folder.join("scene.ron");
    std::fs::write(&path, scene).expect("a file");
    let camera = Scene::open(&path, &Job::default()).expect("a scene").cameras[0].clone();
    let picture = folder.join("pillar.png");
    image::RgbImage::from_pixel(400, 400, image::Rgb([120, 118, 115]))
        .save(&picture)
        .expect("a file");
    (path, picture, camera)
}

fn press(window: &mut Window, at: egui::Pos2) {
    window.harness.hover_at(at);
    window.frame();
    for pressed in [true, false] {
        window.harness.event(egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
        window.frame();
    }
    window.frames(2);
}

/// Six corners clicked in the drawing's list and in the photograph tell where the camera stood; the
/// photograph becomes evidence, and its picks are there when it is looked at again.
#[test]
fn a_photograph_is_placed_by_its_corners_and_becomes_evidence() {
    let folder = tempfile::tempdir().unwrap();
    let (path, picture, camera) = photographed(folder.path());
    let mut window = Window::new(|_| {});
    window.ask(Action::Open(path.clone()));
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.ask(Action::Select(Some(0)));
    window.ask(Action::Photograph(picture));
    window.until_seen("Photograph");
    let scene = Scene::open(&path, &Job::default()).unwrap();
    let site = Site::new(&scene, &Job::default()).unwrap();
    let corners = site.surface(0).unwrap().outline().corners;
    assert_eq!(corners.len(), 8);
    let pose = Pose::of(&camera);
    let picks = |window: &Window| window.harness.query_all_by_label("✖").count();
    let pick = |window: &mut Window, k: usize, corner: glam::DVec3| {
        let row = window.harness.get_by(|node| {
            node.label().is_some_and(|label| label.starts_with(&format!("{} · ", k + 1)))
        });
        row.click();
        window.frames(2);
        let rect = window.harness.get_by_label("Photograph").rect();
        let scale = f64::from(rect.width().min(rect.height())) / 400.0;
        let [u, v] = pose.project(corner).unwrap();
        let to = egui::vec2((scale * (u - 200.0)) as f32, (scale * (v - 200.0)) as f32);
        let before = picks(window);
        press(window, rect.center() + to);
        assert_eq!(picks(window), before + 1, "corner {}", k + 1);
    };
    // The two at the back on the left are behind the pillar.
    let seen = |p: &glam::DVec3| p.z > 0.0 || p.x > 0.0;
    for (k, corner) in corners.iter().enumerate().filter(|(_, p)| seen(p)) {
        pick(&mut window, k, *corner);
    }
    // A pick that was wrong is taken back, and made again.
    let is_placed =
        |window: &Window| window.harness.query_by_label_contains("Taken from").is_some();
    for wanted in [true, false] {
        for _ in 0..PATIENCE {
            if is_placed(&window) == wanted {
                break;
            }
            window.frame();
            rest();
        }
        assert_eq!(is_placed(&window), wanted);
        if wanted {
            window.click("Undo pick");
        }
    }
    let last = corners.iter().enumerate().rfind(|(_, p)| seen(p)).expect("a corner");
    pick(&mut window, last.0, *last.1);
    for _ in 0..2000 {
        if window.harness.query_by_label_contains("Taken from").is_some() {
            break;
        }
        window.frame();
        rest();
    }
    let told = window.harness.get_by_label_contains("Taken from");
    let told = told.accesskit_node().label().or(told.accesskit_node().value()).unwrap();
    let numbers: Vec<f32> =
        told.split(['(', ',', ')']).filter_map(|word| word.trim().parse().ok()).collect();
    let from = Vec3::new(numbers[0], numbers[1], numbers[2]);
    assert!(from.distance(camera.position) < 0.05, "{told}");

    window.click("Add to the evidence");
    window.until("evidence", |w| w.resource::<CurrentScene>().0.structure.photographs.len() == 1);
    let photo = window.with(|w| w.resource::<CurrentScene>().0.structure.photographs[0].clone());
    assert!(photo.file.starts_with(folder.path()) && photo.member == "P");
    assert_eq!(std::fs::read_to_string(&photo.picks).unwrap().lines().count(), 7);
    // The copy is looked at now; and what was added is taken back as any evidence is.
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(0)));
    window.until_seen("Save picks");
    window.harness.key_press_modifiers(egui::Modifiers::COMMAND, Key::Z);
    window.until("the scene without it", |w| {
        w.resource::<CurrentScene>().0.structure.photographs.is_empty()
    });
    assert!(!photo.file.exists());
}

/// A file as the system hands it over that is let go over the window.
#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|e| e.to_string())
    }
}

/// An IFC model that is let go over the window is imported, and its members stand in the list.
#[test]
#[ignore = "needs INTRADOS_DATA, and ifcopenshell"]
fn an_ifc_model_is_dropped_on_the_window_with_data() {
    let data = std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA");
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("bridge.ifc");
    std::fs::copy(Path::new(&data).join("ifc/infra-bridge.ifc"), &model).unwrap();
    let mut window = Window::new(|_| {});
    window.frame();
    window.harness.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(model)));
    window.until("the imported scene", |w| w.contains_resource::<CurrentScene>());
    assert_eq!(window.with(|w| w.resource::<CurrentScene>().0.members.len()), 37);
    window.until_seen("Members");
}
