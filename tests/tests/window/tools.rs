//! Tools of the structure's picture and of the sheet, and what is left of a session that broke off.

use std::{collections::HashSet, fs, path::Path, sync::Arc};

use bevy_ecs::world::World;
use egui::{Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, TouchPhase, accesskit::Role};
use egui_kittest::kittest::{NodeT, Queryable};
use glam::{Mat4, Vec3};
use intrados_forecast::ForecastSettings;
use intrados_light::Render;
use intrados_mechanics::plugin::{Analyses, ShownAt};
use intrados_panels::{
    Action, Latest, Lengths, Log, Look, PanelsPlugin, Refine, Selection, Statistics, Taken,
    Viewpoint, Workspace,
};
use intrados_predict::{PredictSettings, Predicting};
use intrados_scene::{Camera, Part, Scene, parametric::write_glb, plugin::CurrentScene};
use intrados_stage::{Job, Jobs, Task, Work};

use super::{
    Dropped, LONELY, PATIENCE, Window, export,
    forms::{EARLIER, with_seen},
    press, rest, type_into, with_column, with_lonely,
};

/// Whether anything in the window has this text in its name.
fn has(window: &Window, text: &str) -> bool {
    window.harness.query_all_by_label_contains(text).next().is_some()
}

/// Two places in the structure's picture that members are at, as far apart as may be along its
/// middle.
fn ends(window: &mut Window) -> (egui::Pos2, egui::Pos2) {
    let rect = window.harness.get_by_label("Damage of members").rect();
    let places: Vec<egui::Pos2> = (1..40)
        .map(|k| rect.lerp_inside(egui::vec2(k as f32 / 40.0, 0.5)))
        .filter(|at| {
            press(window, *at);
            window.with(|w| w.resource::<Selection>().0.is_some())
        })
        .collect();
    (places[0], places[places.len() - 1])
}

/// Two clicks on members are a distance with its unit, and select nothing.
#[test]
fn the_tape_reads_between_two_clicks() {
    let mut window = with_column();
    let (first, last) = ends(&mut window);
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

/// The tape reads in metres, millimetres or feet and inches, always with the unit.
#[test]
fn lengths_are_written_in_the_unit_that_was_chosen() {
    let mut window = with_column();
    let places = ends(&mut window);
    window.click("Measure");
    press(&mut window, places.0);
    press(&mut window, places.1);
    let read = |window: &mut Window, lengths: Lengths| {
        window.ask(Action::Lengths(lengths));
        window.frames(3);
        said(window, " level, ").remove(0)
    };
    let first = |text: &str| -> f64 {
        text.split(' ').next().and_then(|n| n.parse().ok()).unwrap_or(f64::NAN)
    };
    let [metres, millimetres, feet] =
        [Lengths::Metres, Lengths::Millimetres, Lengths::FeetAndInches]
            .map(|lengths| read(&mut window, lengths));
    let scale = if metres.split(' ').nth(1) == Some("m") { 1e3 } else { 1.0 };
    assert!((scale * first(&metres) - first(&millimetres)).abs() < 6.0, "{metres} {millimetres}");
    assert!(millimetres.contains(" mm (") && !millimetres.contains(" m "), "{millimetres}");
    assert!(feet.contains(" in (") && !feet.contains(" m"), "{feet}");
}

/// A picture of the structure that is saved has its legend, and none of the tools that lie over it.
#[test]
fn tools_are_put_away_for_a_picture_of_the_structure() {
    let mut window = with_column();
    assert!(window.harness.query_by_label("As it looks").is_some());
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("structure.png");
    window.ask(Action::TakePicture(file, Some("Structure".into())));
    window.frame();
    assert!(window.harness.query_by_label("As it looks").is_none());
    assert!(window.harness.query_by_label("Damage of members").is_some());
}

/// All views of a structure, its slice among them, become files whose names say what they show.
#[test]
fn all_views_are_saved_into_a_folder() {
    let mut window = with_column();
    window.until("a camera", |w| w.resource::<Viewpoint>().camera().is_some());
    window.ask(Action::KeepView("from the river".into()));
    window.ask(Action::Select(Some(1)));
    window.ask(Action::Tab("CT"));
    window.until_seen("CT slice");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("views");
    window.ask(Action::Save(Taken::Views));
    window.frames(3);
    type_into(&mut window, "Folder to write", &out.display().to_string());
    window.harness.get_by_role_and_label(Role::Button, "Save").click();
    window.until("the pictures", |w| {
        w.resource::<Log>().lines().iter().any(|line| line.contains(" files into "))
    });
    let picture = |name: &str| {
        let file = out.join(format!("{name}.png"));
        image::open(&file).unwrap_or_else(|why| panic!("{name}: {why}")).into_rgb8()
    };
    let [front, side, above] =
        ["front", "side", "top"].map(|name| picture(&format!("structure-{name}")));
    assert!(front != side && side != above);
    picture("structure");
    picture("structure-view-from_the_river");
    let camera = window.with(|w| w.resource::<CurrentScene>().0.cameras[0].name.clone());
    picture(&format!("structure-camera-{camera}"));
    let files: Vec<String> = fs::read_dir(&out)
        .expect("the folder")
        .map(|entry| entry.expect("a file").file_name().to_string_lossy().into_owned())
        .collect();
    let slice = files.iter().find(|name| name.starts_with("ct-") && name.contains("slice_1"));
    assert!(slice.is_some(), "{files:?}");
}

/// Who saves something types its name at once, over the one that was proposed; Escape saves nothing,
/// and Enter does.
#[test]
fn a_name_is_typed_at_once_and_enter_saves_under_it() {
    let (mut window, folder) = with_lonely();
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    let begin = |window: &mut Window| {
        window.ask(Action::Save(Taken::Values("covers", "along,mm\n0.5,31\n".into())));
        window.frames(4);
    };
    let name =
        |window: &Window| window.harness.query_by_label("File to write").map(|field| field.value());
    begin(&mut window);
    window.harness.event(Event::Text("pier 7".into()));
    window.frames(2);
    assert_eq!(name(&window), Some(Some("pier 7.csv".into())));
    window.harness.key_press(Key::Escape);
    window.frames(3);
    assert_eq!(name(&window), None);
    begin(&mut window);
    let file = folder.path().join("covers.csv");
    type_into(&mut window, "File to write", &file.display().to_string());
    window.harness.key_press(Key::Enter);
    window.until("the table", |_| file.exists());
    assert_eq!(fs::read_to_string(&file).expect("a table"), "along,mm\n0.5,31\n");
    window.frames(2);
    assert_eq!(name(&window), None);
}

/// Of what is written into a folder, a folder is asked for.
#[test]
fn a_folder_is_chosen_where_a_folder_is_written() {
    let mut window = with_column();
    for (what, asked) in [
        (Taken::Views, "type the folder's name instead"),
        (Taken::Picture(None), "type the file's name instead"),
    ] {
        window.ask(Action::Save(what));
        window.frames(4);
        window.click("Browse…");
        window.frames(2);
        assert!(has(&window, asked), "{asked}");
    }
}

/// A digit is a side of the structure, but an estimator where the picture of light is seen; the
/// legend goes and comes by a key, and so do the slices.
#[test]
fn keys_look_from_the_sides_and_go_through_slices() {
    let mut window = with_column();
    window.until("a camera", |w| w.resource::<Viewpoint>().camera().is_some());
    window.frames(2);
    let looked = |window: &mut Window, key: Key, index: usize| {
        window.harness.key_press(key);
        window.frames(3);
        window.ask(Action::KeepView(String::new()));
        window.frames(2);
        let view = view(window, index);
        (view.target - view.position).normalize()
    };
    let [front, side, above] =
        [(Key::Num1, 0), (Key::Num3, 1), (Key::Num7, 2)].map(|(k, i)| looked(&mut window, k, i));
    assert!(front.z < -0.9 && side.x < -0.9 && above.y < -0.9, "{front} {side} {above}");
    window.ask(Action::Select(Some(1)));
    window.ask(Action::Tab("CT"));
    window.until_seen("CT slice");
    for (key, slice) in [(Key::CloseBracket, "slice 2 of"), (Key::OpenBracket, "slice 1 of")] {
        window.harness.key_press(key);
        for _ in 0..2_000 {
            window.frame();
            if has(&window, slice) {
                break;
            }
            rest();
        }
        assert!(has(&window, slice), "{slice}");
    }
    window.ask(Action::Arrange(Workspace::Expert));
    window.ask(Action::Tab("Render"));
    window.frames(3);
    window.harness.key_press(Key::Num1);
    window.frames(2);
    assert_eq!(window.with(|w| w.resource::<Look>().view), intrados_light::View::Primal);
}

/// Of a model that nobody builds as large, the unit is asked for, and a click opens it in the other
/// one.
#[test]
fn a_model_in_millimetres_is_opened_in_metres_by_a_click() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("large.glb");
    let mut scene = Scene::open(Path::new("column"), &Job::default()).expect("a scene");
    scene.members.clear();
    for object in &mut scene.objects {
        (object.name, object.member, object.part) = ("thing".into(), None, Part::Scenery);
        object.transform = Mat4::from_scale(Vec3::splat(1e3)) * object.transform;
    }
    write_glb(&model, &scene).expect("a model");
    let mut window = Window::new(|_| {});
    window.ask(Action::Open(model));
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.frames(2);
    assert!(has(&window, "mm or m?"));
    window.click("Open it in millimetres");
    let project = folder.path().join("large.scaled.intrados");
    window.until("its project", |w| w.resource::<CurrentScene>().0.path.starts_with(&project));
    window.frames(2);
    assert!(!has(&window, "mm or m?"));
    let [low, high] = window.with(|w| w.resource::<CurrentScene>().0.bounds());
    assert!((high - low).max_element() < 100.0, "{low} {high}");
}

/// The line at the bottom shows the job that was asked for last, whatever else goes on.
#[test]
fn the_newest_job_is_the_one_at_the_bottom() {
    let mut window = with_column();
    window.until("rest", |w| {
        w.resource::<Latest>().result.is_some() && w.resource_mut::<Jobs>().running().is_empty()
    });
    let begin = |window: &Window, name: &str| {
        let wait = |job: &Job| {
            while job.check().is_ok() {
                rest();
            }
        };
        window.with(|w| Task::spawn(&mut w.resource_mut::<Jobs>(), name, wait))
    };
    let older = begin(&window, "a long report");
    let newer = begin(&window, "an import");
    window.frames(2);
    assert!(has(&window, "an import") && !has(&window, "a long report"));
    assert!(has(&window, "and 1 more"));
    drop(newer);
    window.until("its end", |w| w.resource_mut::<Jobs>().running().len() == 1);
    window.frames(2);
    assert!(has(&window, "a long report") && !has(&window, "and 1 more"));
    drop(older);
}

/// Where the structure's picture has the colour of what is selected, once nothing moves any more.
fn accents(window: &mut Window) -> HashSet<(u32, u32)> {
    window.ask(Action::Tab("Structure"));
    for _ in 0..40 {
        window.frame();
        rest();
    }
    let rect = window.harness.get_by_label("Damage of members").rect();
    let picture = window.picture();
    let mut marked = HashSet::new();
    for (x, y, pixel) in picture.enumerate_pixels() {
        let is_accent = pixel.0.iter().zip([255, 176, 0]).all(|(a, b)| a.abs_diff(b) < 40);
        if is_accent && rect.contains(egui::pos2(x as f32, y as f32)) {
            marked.insert((x, y));
        }
    }
    marked
}

/// Where the slice of the CT tab lies is outlined on its member, and moves with it.
#[test]
fn the_slice_that_is_shown_is_outlined_on_its_member() {
    let mut window = with_column();
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    window.ask(Action::Select(Some(1)));
    window.frames(2);
    let before = accents(&mut window);
    let mut shown = |slice: &str, steps: bool| {
        window.ask(Action::Tab("CT"));
        window.until_seen("CT slice");
        if steps {
            window.ask(Action::StepSlice(true));
        }
        for _ in 0..2_000 {
            window.frame();
            if has(&window, slice) {
                break;
            }
            rest();
        }
        accents(&mut window)
    };
    let [first, second] = [("slice 1 of", false), ("slice 2 of", true)].map(|(s, n)| shown(s, n));
    assert!(first.difference(&before).count() > 20, "{} of {}", first.len(), before.len());
    let height = |of: &HashSet<(u32, u32)>, without: &HashSet<(u32, u32)>| {
        let own: Vec<u32> = of.difference(without).map(|(_, y)| *y).collect();
        assert!(own.len() > 10, "{} of {}", own.len(), of.len());
        own.iter().sum::<u32>() as f32 / own.len() as f32
    };
    let heights = [height(&first, &second), height(&second, &first)];
    assert!((heights[0] - heights[1]).abs() > 3.0, "{heights:?}");
    // Where no member is selected, no slice is shown.
    window.ask(Action::Select(None));
    window.frames(2);
    let none = accents(&mut window);
    assert!(none.len() < 10, "{}", none.len());
}

/// Through a tunnel the camera flies along its axis and halts where it is told to; however it ends,
/// one is where one was.
#[test]
fn a_flight_through_a_tunnel_ends_where_it_began() {
    let mut window = with_lining();
    let keep = |window: &mut Window, name: &str| {
        window.ask(Action::KeepView(name.into()));
        window.frames(2);
    };
    keep(&mut window, "before");
    window.click("Fly through");
    window.frames(4);
    let first = chainage(&window);
    window.frames(4);
    let second = chainage(&window);
    assert!(first > 0.0 && second > first && second < 6.0, "{first} {second}");
    window.harness.key_press(Key::Space);
    window.frames(2);
    let here = chainage(&window);
    window.frames(5);
    assert_eq!(chainage(&window), here, "it has been told to halt");
    assert!(!window.with(|w| w.resource::<Refine>().paused), "it is the light that was paused");
    keep(&mut window, "inside");
    window.click("▶ Fly on");
    flown_out(&mut window);
    keep(&mut window, "at its end");
    window.click("Fly through");
    window.frames(4);
    assert!(has(&window, "chainage "));
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert!(!has(&window, "chainage "), "Escape has not ended it");
    assert!(window.with(|w| w.resource::<Selection>().0.is_some()), "only the flight is put away");
    keep(&mut window, "broken off");
    let views = [0, 1, 2, 3].map(|index| view(&mut window, index));
    let place = |camera: &Camera| (camera.position, camera.target, camera.up, camera.fov_deg);
    let [before, inside, at_its_end, broken_off] = &views;
    assert_eq!((place(at_its_end), place(broken_off)), (place(before), place(before)));
    let ahead = (inside.target - inside.position).normalize();
    assert!(inside.position.truncate().length() < 2.7 && ahead.distance(Vec3::Z) < 1e-4);
    assert!((f64::from(inside.position.z) + 6.0 - here).abs() < 0.01, "{inside:?} {here}");
}

/// An inspector's window with the bundled tunnel, whose lining is selected.
fn with_lining() -> Window {
    let mut window = Window::new(|app| {
        app.world_mut().resource_mut::<Predicting>().settings =
            PredictSettings { forecast: None, ..PredictSettings::default() };
    });
    window.ask(Action::Open("tunnel".into()));
    window.until("a scene with light", |w| {
        w.contains_resource::<CurrentScene>() && w.resource::<Viewpoint>().camera().is_some()
    });
    let lining =
        window.with(|w| w.resource::<CurrentScene>().0.members.iter().position(|m| m.id == "T1"));
    window.ask(Action::Select(lining));
    window.frames(4);
    window
}

/// Where a flight is, m; NaN: there is none.
fn chainage(window: &Window) -> f64 {
    let said = said(window, "chainage ");
    let number = said.first().and_then(|text| text.split(' ').nth(1)?.parse().ok());
    number.unwrap_or(f64::NAN)
}

/// Frames until the flight is over, which are a quarter of a second long.
fn flown_out(window: &mut Window) {
    for _ in 0..200 {
        if !has(window, "chainage ") {
            return;
        }
        window.frame();
    }
    panic!("after fifty seconds it still flies");
}

/// A view that was kept, by its place among them.
fn view(window: &mut Window, index: usize) -> Camera {
    window.ask(Action::View(index));
    window.frames(2);
    window.with(|w| w.resource::<Viewpoint>().camera().cloned()).expect("a camera")
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
    left(window, file, "\"0.45\"")
}

/// Closes the window; gives what was kept of it until then, once that has this text in it.
fn left(mut window: Window, file: &Path, text: &str) -> Vec<u8> {
    let mut kept = Vec::new();
    window.until("the session is kept", |_| {
        kept = fs::read(file).unwrap_or_default();
        String::from_utf8_lossy(&kept).contains(text)
    });
    drop(window);
    let after = fs::read_to_string(file).expect("what is typed outlives quitting");
    assert!(after.contains(text) && after.contains("\"is_quit\": true"), "{after}");
    kept
}

/// What was typed into a member's sheet and not applied is offered as well, and then it stands in
/// the form again; the scene's file has none of it.
#[test]
fn what_was_typed_into_a_sheet_before_a_crash_is_there_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("lonely.ron");
    fs::write(&scene, LONELY).expect("written");
    let file = folder.path().join("state/session.json");
    let mut window = keeping(&file);
    window.ask(Action::Open(scene.clone()));
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.click("Concrete, size, bars, loads");
    window.until_seen("Apply");
    window.frames(20);
    type_into(&mut window, "width", "0.55");
    let kept = left(window, &file, "\"0.55\"");
    fs::write(&file, kept).expect("written");
    let mut window = keeping(&file);
    window.frames(2);
    assert!(has(&window, "not saved is kept"));
    window.click("Go on with it");
    window.until_seen("width");
    let typed = window.harness.get_by_label("width").accesskit_node().value();
    assert_eq!(typed.as_deref(), Some("0.55"));
    assert!(has(&window, "one value changed"));
    assert_eq!(fs::read_to_string(&scene).expect("the scene"), LONELY);
}

fn keeping(file: &Path) -> Window {
    let mut app = intrados::simulation();
    app.add_plugins(PanelsPlugin { session: Some(file.to_owned()), ..PanelsPlugin::default() });
    Window::of(app)
}

/// A column whose life is known and forecast.
fn with_life() -> (Window, tempfile::TempDir) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("column.ron");
    fs::write(&file, intrados_scene::parametric::template("column").expect("a template"))
        .expect("written");
    let mut window = Window::new(|app| {
        let forecast = ForecastSettings { element_m: Some(0.2), ..ForecastSettings::default() };
        app.world_mut().resource_mut::<Predicting>().settings =
            PredictSettings { forecast: Some(forecast), ..PredictSettings::default() };
    });
    window.ask(Action::Open(file));
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    window.frames(3);
    (window, folder)
}

/// The slider goes through the lives of the members: as they were, as they are known now, as they
/// are forecast; all that shows members follows it.
#[test]
fn the_slider_goes_through_the_lives_of_members() {
    let (mut window, _folder) = with_life();
    let shown = |window: &Window| window.with(|w| *w.resource::<ShownAt>());
    assert_eq!(shown(&window), ShownAt(None));
    let now = window.picture();
    window.click("▶");
    window.frames(2);
    assert!(has(&window, "in "), "nothing says when that is");
    let ShownAt(Some(later)) = shown(&window) else { panic!("surfaces stay as they are now") };
    // It is drawn off the frame.
    while now == window.picture() {
        window.frame();
        rest();
    }
    window.click("Now");
    assert_eq!(shown(&window), ShownAt(None));
    window.click("◀");
    let ShownAt(Some(before)) = shown(&window) else { panic!("surfaces stay as they are now") };
    assert!(before < later, "{before} {later}");
    assert!(has(&window, " ago"), "nothing says when that was");
    window.ask(Action::Select(Some(0)));
    window.frames(3);
    assert!(has(&window, "d of the worst zone by its life"), "the sheet has no course");
}

/// Keys go from one equilibrium to the next; playing shows the same ones by itself, and stops at the
/// last.
#[test]
fn playing_shows_all_equilibria_and_stops_at_the_last() {
    let (mut window, _folder) = with_life();
    let shown = |window: &Window| window.with(|w| *w.resource::<ShownAt>());
    let to_first = |window: &mut Window| {
        window.harness.key_press_modifiers(Modifiers::COMMAND, Key::Home);
        window.frames(2);
        shown(window)
    };
    let mut stepped = vec![to_first(&mut window)];
    loop {
        window.harness.key_press(Key::Period);
        window.frames(2);
        if stepped.last() == Some(&shown(&window)) {
            break;
        }
        stepped.push(shown(&window));
    }
    assert!(stepped.len() > 3, "{stepped:?}");
    window.harness.key_press(Key::Comma);
    window.frames(2);
    assert_eq!(Some(&shown(&window)), stepped.iter().rev().nth(1));
    let mut played = vec![to_first(&mut window)];
    window.click("▶ Play");
    assert!(has(&window, "⏸ Pause"));
    while has(&window, "⏸ Pause") {
        window.frame();
        if played.last() != Some(&shown(&window)) {
            played.push(shown(&window));
        }
    }
    assert_eq!(played, stepped);
    window.harness.key_press(Key::P);
    window.frames(2);
    assert_eq!(shown(&window), stepped[0], "from the last it begins anew");
    window.harness.key_press(Key::P);
    window.frames(2);
    assert!(!has(&window, "⏸ Pause"), "the same key stops it");
}

/// A view that was kept by its name is gone to from elsewhere, by the palette, and forgotten.
#[test]
fn a_kept_view_is_gone_to_and_forgotten() {
    let mut window = Window::with_scene("cornell");
    let camera = |window: &Window| {
        window.with(|w| w.resource::<Viewpoint>().camera().cloned()).expect("a camera")
    };
    let home = camera(&window);
    let there = Camera { position: home.position + 0.2 * home.up, ..home.clone() };
    window.with(|w| w.resource_mut::<Viewpoint>().go(there.clone()));
    window.ask(Action::Views);
    window.frames(3);
    type_into(&mut window, "Name of the view", "the lamp");
    window.click("Keep this view");
    assert!(window.harness.query_by_label("the lamp").is_some(), "it is not listed");
    window.ask(Action::Dismiss);
    window.ask(Action::Home);
    window.frames(2);
    assert!(window.harness.query_by_label("Name of the view").is_none(), "it is put away");
    assert_eq!(camera(&window), home);
    window.ask(Action::Palette);
    window.frames(3);
    window.harness.get_by_label("Command").type_text("view lamp");
    window.frames(2);
    window.harness.key_press(Key::Enter);
    window.frames(3);
    assert_eq!(camera(&window), there);
    window.ask(Action::Views);
    window.frames(3);
    window.click("Forget the view the lamp");
    assert!(window.harness.query_by_label("the lamp").is_none(), "it is still listed");
}

/// A camera of the scene moves the structure's picture as it moves that of light, even while its
/// tab is behind another one.
#[test]
fn a_camera_of_the_scene_moves_both_pictures() {
    let mut window = Window::with_scene("column");
    let cameras = window.with(|w| w.resource::<CurrentScene>().0.cameras.clone());
    window.ask(Action::Camera(1));
    window.frames(2);
    window.ask(Action::Tab("Structure"));
    window.frames(3);
    window.click("As it looks");
    window.until("light from the second camera", |w| is_structure_from(w, &cameras[1]));
    window.ask(Action::Views);
    window.frames(3);
    window.click(&cameras[0].name);
    window.until("light from the first camera", |w| is_structure_from(w, &cameras[0]));
}

/// Whether the structure is shown in light from there: that is asked for in the pixels of its own
/// panel.
fn is_structure_from(world: &World, camera: &Camera) -> bool {
    let place = |c: &Camera| (c.position, c.target, c.fov_deg);
    let now = world.resource::<Viewpoint>().camera();
    now.is_some_and(|now| place(now) == place(camera) && now.width != camera.width)
}

/// A reference is held against the picture: by its figures, and under a divider that is dragged
/// instead of the camera; with the camera it goes.
#[test]
fn a_picture_is_held_against_its_reference() {
    let mut window = Window::with_scene("cornell");
    window.click("Primal");
    window.until("some light", |w| w.resource::<Render>().samples_per_pixel() > 4.0);
    window.click("⏸ Pause");
    window.click("Keep as reference");
    window.frames(20);
    assert!(window.harness.query_by_label("relMSE 0").is_some(), "it is its own reference");
    window.click("Dual");
    window.frames(20);
    assert!(has(&window, "relMSE ") && window.harness.query_by_label("relMSE 0").is_none());
    let rect = window.harness.get_by_label("Picture").rect();
    let seen = |window: &mut Window, shown: &str| {
        window.click(shown);
        window.frames(3);
        columns(&window.picture(), rect)
    };
    let [own, reference] = ["This picture", "Reference"].map(|shown| seen(&mut window, shown));
    let difference = seen(&mut window, "Difference");
    let wiped = seen(&mut window, "Wipe");
    assert!(own != reference && difference != own && difference != reference);
    let count = own.len();
    let (middle, aside) = (count / 2, 8);
    assert_eq!(wiped[..middle - aside], reference[..middle - aside]);
    assert_eq!(wiped[middle + aside..], own[middle + aside..]);
    let camera = window.with(|w| w.resource::<Viewpoint>().camera().cloned());
    let at = |x: f32| rect.lerp_inside(egui::vec2(x, 0.5));
    draw(&mut window, at(0.5), at(0.25));
    let wiped = columns(&window.picture(), rect);
    assert_eq!(wiped[count / 4 + aside..], own[count / 4 + aside..], "the divider stays");
    assert_eq!(wiped[..count / 4 - aside], reference[..count / 4 - aside]);
    assert_eq!(window.with(|w| w.resource::<Viewpoint>().camera().cloned()), camera);
    window.with(|w| {
        let there = camera.clone().map(|c| Camera { fov_deg: 0.9 * c.fov_deg, ..c });
        w.resource_mut::<Viewpoint>().go(there.expect("a camera"));
    });
    window.frames(3);
    assert!(window.harness.query_by_label("Wipe").is_none(), "it is kept for another camera");
    let said = |w: &mut World| w.resource::<Log>().lines().iter().any(|l| l.contains("is let go"));
    assert!(window.with(said));
}

/// Alt and an arrow go back through members, sides and tabs, and forward again, as in a browser.
#[test]
fn one_goes_back_to_where_one_was_and_forward_again() {
    let mut window = with_column();
    window.until("a camera", |w| w.resource::<Viewpoint>().camera().is_some());
    let go = |window: &mut Window, key: Key| {
        window.harness.key_press_modifiers(Modifiers::ALT, key);
        window.frames(4);
    };
    let selected = |window: &Window| window.with(|w| w.resource::<Selection>().0);
    window.ask(Action::Select(Some(0)));
    window.frames(2);
    window.ask(Action::Select(Some(1)));
    window.frames(2);
    window.ask(Action::Tab("CT"));
    window.until_seen("CT slice");
    go(&mut window, Key::ArrowLeft);
    assert!(has(&window, "Damage of members"), "the tab of before");
    assert_eq!(selected(&window), Some(1));
    go(&mut window, Key::ArrowLeft);
    assert_eq!(selected(&window), Some(0));
    go(&mut window, Key::ArrowRight);
    assert_eq!(selected(&window), Some(1));
    window.harness.key_press(Key::Num1);
    window.frames(3);
    window.harness.key_press(Key::Num7);
    window.frames(3);
    go(&mut window, Key::ArrowLeft);
    window.ask(Action::KeepView(String::new()));
    window.frames(2);
    let front = view(&mut window, 0);
    let along = (front.target - front.position).normalize();
    assert!(along.z < -0.9, "it is not seen from the front: {along}");
}

/// In a border that is drawn over the picture of light the same rays are followed, and no others;
/// Esc goes on with all of the picture.
#[test]
fn a_border_is_refined_alone() {
    let mut window = Window::with_scene("cornell");
    window.until("some light", |w| w.resource::<Render>().samples_per_pixel() > 2.0);
    let film = |window: &Window| window.with(|w| w.resource::<Render>().camera().clone());
    let whole = film(&window);
    let camera = window.with(|w| w.resource::<Viewpoint>().camera().cloned());
    let rect = window.harness.get_by_label("Picture").rect();
    let at = |x: f32, y: f32| rect.lerp_inside(egui::vec2(x, y));
    window.click("Border");
    // The tools may have moved the picture.
    let rect_now = window.harness.get_by_label("Picture").rect();
    assert_eq!(rect, rect_now);
    let drawn = [at(0.25, 0.5), at(0.75, 0.75)];
    draw(&mut window, drawn[0], drawn[1]);
    let [low, high] = drawn.map(|at| (at - rect.min) / rect.size());
    window.until("the part", |w| w.resource::<Render>().camera().width < whole.width);
    window.until("its light", |w| w.resource::<Render>().samples_per_pixel() > 2.0);
    let part = film(&window);
    let share = |a: u32, b: u32| a as f32 / b as f32;
    let size = high - low;
    assert!((share(part.width, whole.width) - size.x).abs() < 0.02, "{part:?} {size}");
    assert!((share(part.height, whole.height) - size.y).abs() < 0.02, "{part:?} {size}");
    let middle = |c: &Camera, x: f32, y: f32| c.direction(x * c.width as f32, y * c.height as f32);
    let at = 0.5 * (low + high);
    let (own, theirs) = (middle(&part, 0.5, 0.5), middle(&whole, at.x, at.y));
    assert!(own.distance(theirs) < 0.01, "{own} {theirs}");
    assert_eq!(window.with(|w| w.resource::<Viewpoint>().camera().cloned()), camera);
    window.harness.key_press(Key::Escape);
    window.until("all of it", |w| *w.resource::<Render>().camera() == whole);
}

/// However much is said above the picture of light, it stays where it is: in a narrow window, too,
/// from the first preview to the figures of both sides.
#[test]
fn what_is_said_above_the_picture_does_not_move_it() {
    let mut window = Window::with_scene("column");
    window.harness.set_size(egui::vec2(760.0, 600.0));
    window.frames(6);
    let place = |window: &Window| window.harness.get_by_label("Picture").rect();
    // Panels beside it come to rest first.
    let (mut before, mut still) = (place(&window), 0);
    for _ in 0..PATIENCE {
        window.frame();
        rest();
        let now = place(&window);
        still = if now == before { still + 1 } else { 0 };
        before = now;
        if still == 30 {
            break;
        }
    }
    window.harness.key_press(Key::F);
    let mut previewed = false;
    for _ in 0..PATIENCE {
        window.frame();
        assert_eq!(place(&window), before);
        let (is_preview, is_known) = window.with(|w| {
            (w.resource::<Viewpoint>().is_preview(), w.resource::<Statistics>().now().is_some())
        });
        previewed |= is_preview;
        if previewed && !is_preview && is_known {
            window.frames(2);
            assert_eq!(place(&window), before);
            return;
        }
        rest();
    }
    panic!("nothing is known of the picture");
}

/// The wheel enlarges a picture and its reference alike, where a camera that comes nearer would let
/// the reference go; and what is enlarged is pulled about.
#[test]
fn the_wheel_enlarges_a_picture_and_its_reference_alike() {
    let mut window = Window::with_scene("cornell");
    window.until("some light", |w| w.resource::<Render>().samples_per_pixel() > 4.0);
    window.click("⏸ Pause");
    window.click("Keep as reference");
    window.frames(20);
    let rect = window.harness.get_by_label("Picture").rect();
    let camera = window.with(|w| w.resource::<Viewpoint>().camera().cloned());
    let seen = |window: &mut Window, shown: &str| {
        window.click(shown);
        window.frames(3);
        columns(&window.picture(), rect)
    };
    let whole = seen(&mut window, "This picture");
    let at = rect.lerp_inside(egui::vec2(0.3, 0.6));
    window.harness.event(Event::PointerMoved(at));
    window.harness.event(Event::MouseWheel {
        unit: MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 240.0),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    window.frames(40);
    let [own, reference] = ["This picture", "Reference"].map(|shown| seen(&mut window, shown));
    assert!(!alike(&own, &whole), "nothing is enlarged");
    assert!(alike(&own, &reference));
    draw(&mut window, rect.center(), rect.center() + egui::vec2(40.0, 0.0));
    let [pulled, reference] = ["This picture", "Reference"].map(|shown| seen(&mut window, shown));
    assert!(!alike(&pulled, &own), "nothing is pulled");
    assert!(alike(&pulled, &reference));
    assert_eq!(window.with(|w| w.resource::<Viewpoint>().camera().cloned()), camera);
    assert!(window.harness.query_by_label("Wipe").is_some(), "the reference is gone");
}

/// Two images that are let go where no member is, and none is selected, are taken for photographs;
/// that is said, and they may be slices of whichever member is selected then.
#[test]
fn images_that_are_let_go_on_no_member_may_be_its_slices() {
    let (mut window, folder) = with_lonely();
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.frames(3);
    let_go(&mut window, folder.path(), &["a.tif", "b.tif"]);
    window.until_seen("If they are CT slices, select their member.");
    assert!(has(&window, "2 files were let go on no member: b.tif is open in Photos."));
    window.click("Photograph a.tif");
    assert!(has(&window, "2 files were let go on no member: a.tif is open in Photos."));
    window.ask(Action::Select(Some(0)));
    window.until_seen("They are CT slices of Column 1");
    window.click("They are CT slices of Column 1");
    window.until_seen("to Column 1");
    assert!(has(&window, "a.tif") && has(&window, "b.tif"));
    assert!(!has(&window, "were let go on no member"));
}

/// Lets files go where no member is: tables that are empty, and images.
fn let_go(window: &mut Window, folder: &Path, names: &[&str]) {
    window.harness.hover_at(egui::pos2(2.0, 2.0));
    for file in names.iter().map(|name| folder.join(name)) {
        if file.extension().is_some_and(|ending| ending == "csv") {
            fs::write(&file, "").expect("written");
        } else {
            image::GrayImage::from_pixel(32, 32, image::Luma([120])).save(&file).expect("a file");
        }
        window.harness.input_mut().dropped_files.push(Arc::new(Dropped(file)));
    }
}

/// Of several photographs one is opened and the others are offered; what goes together with nothing
/// is refused, and so are photographs of no structure.
#[test]
fn no_photograph_that_is_let_go_is_passed_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut alone = Window::new(|_| {});
    alone.frames(2);
    let_go(&mut alone, folder.path(), &["a.jpg", "b.jpg"]);
    alone.frames(3);
    assert!(has(&alone, "photographs, slices and tables are of a structure"));
    drop(alone);
    let (mut window, folder) = with_lonely();
    window.until("a scene", |w| w.contains_resource::<CurrentScene>());
    window.frames(3);
    let_go(&mut window, folder.path(), &["a.jpg", "b.jpg"]);
    window.until_seen("2 photographs were let go: b.jpg is open in Photos.");
    assert!(!has(&window, "If they are CT slices"));
    window.click("Photograph a.jpg");
    assert!(has(&window, "2 photographs were let go: a.jpg is open in Photos."));
    window.click("Dismiss");
    assert!(!has(&window, "were let go"));
    let_go(&mut window, folder.path(), &["a.jpg", "covers.csv"]);
    window.frames(3);
    assert!(has(&window, "photographs together, and slices or tables together"));
}

/// What was framed in half of the panel, beside an earlier prediction, is seen as a whole when it has
/// all of the panel again.
#[test]
fn what_was_framed_in_a_comparison_is_seen_as_a_whole_after_it() {
    let (mut window, folder) = with_seen();
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    window.until("a camera", |w| w.resource::<Viewpoint>().camera().is_some());
    let file = folder.path().join("predict.json");
    fs::write(&file, EARLIER).expect("written");
    window.ask(Action::Compare(file));
    window.frames(3);
    window.ask(Action::Frame);
    window.frames(3);
    window.click("Compare");
    window.until_seen("Nothing");
    window.click("Nothing");
    window.frames(3);
    window.ask(Action::KeepView(String::new()));
    window.frames(2);
    let rect = window.harness.get_by_label("Damage of members").rect();
    let [width, height] = [rect.width(), rect.height()].map(|n| n as u32);
    let camera = Camera { width, height, ..view(&mut window, 0) };
    let [low, high] = window.with(|w| w.resource::<CurrentScene>().0.bounds());
    let ([right, up, forward], [hx, hy]) = (camera.frame(), camera.half_extent());
    for corner in 0..8_u8 {
        let end = |k: usize| if corner >> k & 1 == 1 { high[k] } else { low[k] };
        let d = Vec3::from_array(std::array::from_fn(end)) - camera.position;
        let [x, y] = [d.dot(right) / hx, d.dot(up) / hy].map(|s| s / d.dot(forward));
        assert!(x.abs() < 1.0 && y.abs() < 1.0, "{corner}: {x} {y}");
    }
}

/// An earlier prediction is turned with the newest, until they are parted.
#[test]
fn compared_pictures_are_turned_together_until_they_are_parted() {
    let (mut window, folder) = with_seen();
    window.until("the prediction", |w| {
        w.get_resource::<Latest>().is_some_and(|l| l.result.is_some())
    });
    let file = folder.path().join("predict.json");
    fs::write(&file, EARLIER).expect("written");
    window.until("a camera", |w| w.resource::<Viewpoint>().camera().is_some());
    window.ask(Action::Compare(file));
    window.frames(3);
    let mut kept = 0;
    let mut newest = |window: &mut Window| {
        window.ask(Action::KeepView(String::new()));
        window.frames(2);
        kept += 1;
        view(window, kept - 1)
    };
    let rect = window.harness.get_by_label("Damage of members in an earlier prediction").rect();
    let at = rect.center();
    let before = newest(&mut window);
    draw(&mut window, at, at + egui::vec2(60.0, 0.0));
    let together = newest(&mut window);
    assert!(together.position.distance(before.position) > 0.1);
    window.ask(Action::Link);
    window.frames(3);
    draw(&mut window, at, at + egui::vec2(60.0, 0.0));
    let parted = newest(&mut window);
    assert!(parted.position.distance(together.position) < 1e-3);
}

/// A line over the picture of light is a plot with its length, and a table with standard errors;
/// the camera stays where it is. Escape puts the tool away.
#[test]
fn a_line_over_the_picture_of_light_has_values_with_errors() {
    let mut window = Window::with_scene("cornell");
    window.click("Primal");
    window.until("some light", |w| w.resource::<Render>().samples_per_pixel() > 4.0);
    window.click("⏸ Pause");
    window.click("Line");
    assert!(has(&window, "from one place to another"));
    let camera = |window: &Window| window.with(|w| w.resource::<Viewpoint>().camera().cloned());
    let before = camera(&window);
    let width = window.with(|w| w.resource::<Render>().camera().width);
    let rect = window.harness.get_by_label("Picture").rect();
    let at = |x: f32| rect.lerp_inside(egui::vec2(x, 0.5));
    draw(&mut window, at(0.25), at(0.75));
    assert_eq!(camera(&window), before);
    assert_eq!(window.harness.get_by_label("Picture").rect(), rect);
    assert!(has(&window, "Radiance Y along the line, W/(m² sr)"));
    let long = number(&window, " px long");
    assert!((long - 0.5 * f64::from(width)).abs() <= 1.0, "{long} of {width} px");
    let table = copied(&mut window, "Copy as table");
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split('\t').collect()).collect();
    let head = ["along_px", "x_px", "y_px", "radiance_w_per_m2_sr", "std_error"];
    assert_eq!(rows[0], head);
    assert!((rows.len() - 1).abs_diff(width as usize / 2) <= 2, "{} rows", rows.len());
    let values = said(&window, " values, ");
    assert!(values[0].starts_with(&format!("{} ", rows.len() - 1)), "{values:?}");
    let errors: Vec<f64> = rows[1..].iter().map(|row| row[4].parse().expect("an error")).collect();
    assert!(errors.iter().all(|e| *e >= 0.0) && errors.iter().any(|e| *e > 0.0), "{errors:?}");
    window.harness.key_press(Key::Escape);
    window.frames(2);
    assert!(!has(&window, "along the line"));
}

/// The smoothed preview is marked, and neither what the inspector reads nor what is exported knows of
/// it.
#[test]
fn a_smoothed_preview_is_for_the_eye_alone() {
    let mut window = Window::with_scene("cornell");
    // Of one side, so that nothing hangs on how both are weighted meanwhile.
    window.click("Primal");
    window.until("some light", |w| w.resource::<Render>().samples_per_pixel() > 8.0);
    window.click("⏸ Pause");
    window.frames(20);
    let folder = tempfile::tempdir().expect("a folder");
    let rect = window.harness.get_by_label("Picture").rect();
    let seen = |window: &mut Window| {
        window.harness.hover_at(egui::pos2(640.0, 4.0));
        window.frames(6);
        columns(&window.picture(), rect)
    };
    let told = |window: &mut Window, name: &str| {
        window.harness.hover_at(rect.center());
        window.frames(3);
        let mut numbers = said(window, " W/(m² sr)");
        numbers.retain(|text| !["Mean", "wrote"].iter().any(|word| text.starts_with(word)));
        let file = folder.path().join(name);
        export(window, &file);
        (numbers, fs::read(&file).expect("a picture"))
    };
    let (plain, numbers) = (seen(&mut window), told(&mut window, "plain.png"));
    assert!(!numbers.0.is_empty(), "the inspector reads nothing");
    window.click("Smoothed preview");
    window.until_seen("smoothed: not for measuring");
    let smoothed = seen(&mut window);
    let others = smoothed.iter().zip(&plain).filter(|(a, b)| a != b).count();
    assert!(others > plain.len() / 2, "only {others} columns have changed");
    let again = told(&mut window, "smoothed.png");
    assert_eq!(again.0, numbers.0, "what is read has changed");
    assert!(again.1 == numbers.1, "the file has changed");
    window.click("Smoothed preview");
    assert!(!has(&window, "smoothed: not for measuring"));
    assert!(seen(&mut window) == plain, "it is not as it was");
}

/// Columns of what is seen there.
fn columns(picture: &image::RgbImage, rect: egui::Rect) -> Vec<Vec<[u8; 3]>> {
    let range = |from: f32, to: f32| from.ceil() as u32 + 1..to.floor() as u32 - 1;
    let rows = range(rect.top(), rect.bottom());
    let column = |x: u32| rows.clone().map(|y| picture.get_pixel(x, y).0).collect();
    range(rect.left(), rect.right()).map(column).collect()
}

/// Whether two pictures differ by no more than rounding: one of 255.
fn alike(a: &[Vec<[u8; 3]>], b: &[Vec<[u8; 3]>]) -> bool {
    let values = |of: &[Vec<[u8; 3]>]| of.iter().flatten().flatten().copied().collect::<Vec<u8>>();
    let (a, b) = (values(a), values(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.abs_diff(*b) <= 1)
}

/// As it looks: the path-traced picture comes from where the structure is looked at, and goes again.
#[test]
fn the_structure_is_shown_as_it_looks() {
    let mut window = with_column();
    window.until("the prediction", |w| w.resource::<Latest>().result.is_some());
    while window.harness.query_by_label_contains("is done").is_some() {
        window.frame();
        rest();
    }
    let walked = |window: &Window| window.walks();
    let before = walked(&window);
    window.frames(10);
    assert_eq!(walked(&window), before, "nobody sees it");
    let damage = window.picture();
    window.click("As it looks");
    window.until("a picture", |w| {
        let camera = w.resource::<Viewpoint>().camera().cloned();
        !w.resource::<Viewpoint>().is_preview()
            && w.get_resource::<Render>().is_some_and(|r| {
                r.samples_per_pixel() > 4.0
                    && camera.is_some_and(|c| c.width > 400 && r.camera().width == c.width)
            })
    });
    window.frames(20);
    let light = window.picture();
    let others = |picture: &image::RgbImage| {
        damage.pixels().zip(picture.pixels()).filter(|(a, b)| a != b).count()
    };
    assert!(others(&light) > 100_000, "only {} pixels have changed", others(&light));
    window.click("As it looks");
    for _ in 0..40 {
        window.frame();
        rest();
    }
    // The pointer and what is going on below differ, no more.
    let again = others(&window.picture());
    assert!(again < 40_000, "{again} pixels are not as before");
}

/// While evidence is filled in, dragging along the selected member says where on it, and turns
/// nothing.
#[test]
fn evidence_is_placed_by_dragging_along_its_member() {
    let mut window = with_column();
    window.ask(Action::Select(Some(0)));
    window.ask(Action::Frame);
    window.frames(3);
    let rect = window.harness.get_by_label("Damage of members").rect();
    window.ask(Action::Fill(Vec::new(), None));
    window.frames(3);
    let at = |y: f32| rect.lerp_inside(egui::vec2(0.5, y));
    let along = |window: &Window| -> f32 {
        let field = window.harness.get_by_label("along from, 0 to 1");
        field.accesskit_node().value().unwrap_or_default().parse().unwrap_or(f32::NAN)
    };
    draw(&mut window, at(0.5), at(0.7));
    let low = along(&window);
    draw(&mut window, at(0.7), at(0.3));
    let high = along(&window);
    assert!((0.0..1.0).contains(&low) && high > low + 0.1, "{low} {high}");
}

/// Drags from one place to another with the left button.
fn draw(window: &mut Window, from: egui::Pos2, to: egui::Pos2) {
    window.harness.hover_at(from);
    window.frame();
    window.harness.drag_at(from);
    window.frames(2);
    for k in 1..=8 {
        window.harness.hover_at(from.lerp(to, k as f32 / 8.0));
        window.frame();
    }
    window.harness.drop_at(to);
    window.frames(3);
}

/// All that the window says with this text in it.
fn said(window: &Window, text: &str) -> Vec<String> {
    let nodes = window.harness.query_all_by_label_contains(text).map(|n| n.accesskit_node());
    nodes.filter_map(|n| n.label().or_else(|| n.value())).collect()
}

/// The one number that stands before this unit.
fn number(window: &Window, unit: &str) -> f64 {
    let said = said(window, unit);
    let numbers: Vec<f64> =
        said.iter().filter_map(|s| s.strip_suffix(unit)?.parse().ok()).collect();
    assert_eq!(numbers.len(), 1, "{said:?}");
    numbers[0]
}

/// What a click on a button puts on the clipboard.
fn copied(window: &mut Window, button: &str) -> String {
    window.harness.get_by_label(button).click();
    window.frame();
    let commands = &window.harness.output().platform_output.commands;
    let text = commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    text.expect("something is copied")
}

/// The column's third member, whose first slice is seen; where a place is drawn, mm from the
/// middle.
fn with_slice() -> (Window, impl Fn(f32, f32) -> egui::Pos2) {
    let mut window = with_column();
    window.ask(Action::Select(Some(2)));
    window.frames(2);
    window.ask(Action::Slice(0));
    window.until_seen("CT slice");
    window.frames(2);
    let rect = window.harness.get_by_label("CT slice").rect();
    // All of the slice, 512 pixels of 0.9 mm, fits into the picture.
    let points_per_mm = rect.width().min(rect.height()) / (512.0 * 0.9);
    (window, move |x, y| rect.center() + points_per_mm * egui::vec2(x, y))
}

/// A line over a slice is a plot with its length and a table; both follow the slice that is shown.
/// Escape puts the tool away, and leaves the member selected.
#[test]
fn a_line_over_a_slice_is_a_plot_with_its_length() {
    let (mut window, at) = with_slice();
    window.click("Line");
    assert!(!has(&window, "Grey along the line"));
    draw(&mut window, at(-60.0, -40.0), at(60.0, 50.0));
    assert!(has(&window, "Grey along the line"));
    let long = number(&window, " mm long");
    assert!((long - 150.0).abs() < 0.5, "{long} mm");
    // Samples at every half of a pixel.
    let first = said(&window, " values, ");
    let count: usize = first[0].split(' ').next().and_then(|n| n.parse().ok()).expect("a count");
    assert!(count.abs_diff(335) <= 2, "{first:?}");
    let table = copied(&mut window, "Copy as table");
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split('\t').collect()).collect();
    assert_eq!((rows.len(), &rows[0][..]), (count + 1, &["along_mm", "x_mm", "y_mm", "grey"][..]));
    let end: f64 = rows[count][0].parse().expect("a distance");
    assert!((end - long).abs() < 0.01, "{end} {long}");
    window.ask(Action::Slice(1));
    while said(&window, " values, ") == first {
        window.frame();
        rest();
    }
    assert_eq!(number(&window, " mm long"), long);
    assert_eq!(said(&window, " values, ").len(), 1);
    window.harness.key_press(egui::Key::Escape);
    window.frames(2);
    assert!(!has(&window, "Grey along the line"));
    assert_eq!(window.with(|w| *w.resource::<Selection>()), Selection(Some(2)));
}

/// A region tells its area and what is in it, and its table is saved.
#[test]
fn a_region_of_a_slice_tells_its_area() {
    let (mut window, at) = with_slice();
    let folder = tempfile::tempdir().expect("a folder");
    window.click("Rectangle");
    draw(&mut window, at(-45.0, -36.0), at(45.0, 36.0));
    let rectangle = number(&window, " mm²");
    assert!((rectangle / (90.0 * 72.0) - 1.0).abs() < 0.02, "{rectangle} mm²");
    window.click("Ellipse");
    assert!(!has(&window, " mm²"), "of another tool nothing is left");
    draw(&mut window, at(-45.0, -36.0), at(45.0, 36.0));
    let ellipse = number(&window, " mm²");
    let share = std::f64::consts::FRAC_PI_4;
    assert!((ellipse / rectangle - share).abs() < 0.02, "{ellipse} of {rectangle} mm²");
    assert!(has(&window, "mean ± standard deviation"));
    let table = copied(&mut window, "Copy as table");
    let file = folder.path().join("region.csv");
    window.click("Save as CSV…");
    window.frames(2);
    type_into(&mut window, "File to write", &file.display().to_string());
    window.harness.get_by_role_and_label(egui::accesskit::Role::Button, "Save").click();
    window.until("the table", |_| file.exists());
    let saved = fs::read_to_string(&file).expect("a table");
    assert!(saved.contains("\nellipse,"), "{saved}");
    assert_eq!(saved.replace(',', "\t"), table);
}
