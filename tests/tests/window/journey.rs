//! The whole way of somebody who knows no RON, through the window's own widgets: from a model to a
//! saved report.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use egui::{Key, accesskit::Role};
use egui_kittest::kittest::Queryable;
use intrados_panels::{Latest, Selection, plus_minus};
use intrados_predict::{PredictSettings, Predicting, Prediction};
use intrados_scene::{Scene, parametric::write_glb, plugin::CurrentScene};
use intrados_stage::{Job, cpu_seconds};

use super::{Dropped, PATIENCE, Window, press, type_into};

/// A window whose frames are timed.
struct Journey {
    window: Window,
    /// What each part of the way took: its name, its frames, the longest of them, CPU-seconds too.
    parts: Vec<(&'static str, usize, Duration, f64)>,
}

impl Journey {
    /// Lives are left out: they take minutes of their own.
    fn begin() -> Self {
        let window = Window::new(|app| {
            app.world_mut().resource_mut::<Predicting>().settings =
                PredictSettings { forecast: None, ..PredictSettings::default() };
        });
        Self { window, parts: Vec::new() }
    }

    /// Frames until `done`.
    fn until(&mut self, part: &'static str, mut done: impl FnMut(&mut Window) -> bool) {
        let (mut count, mut longest, mut cpu) = (0, Duration::ZERO, 0.0_f64);
        for _ in 0..PATIENCE {
            let (begin, before) = (Instant::now(), cpu_seconds());
            self.window.frame();
            (count, longest) = (count + 1, longest.max(begin.elapsed()));
            cpu = cpu.max(cpu_seconds() - before);
            if done(&mut self.window) {
                self.parts.push((part, count, longest, cpu));
                return;
            }
            super::rest();
        }
        panic!("{part} did not happen");
    }

    /// Types a path on the start screen.
    fn open(&mut self, model: &Path) {
        self.window.frames(2);
        let field = self.window.harness.get_by_role(Role::TextInput);
        field.focus();
        self.window.frame();
        let path = model.display().to_string();
        self.window.harness.get_by_role(Role::TextInput).type_text(&path);
        self.window.frames(2);
        self.window.harness.get_by_label("Open path").click();
        self.until("opening", |w| w.with(|w| w.contains_resource::<CurrentScene>()));
        self.window.frames(3);
    }

    /// A place in the picture where this member is: a click there selects it.
    fn spot_of(&mut self, member: usize) -> egui::Pos2 {
        let rect = self.window.harness.get_by_label("Damage of members").rect();
        for k in 0..19 * 19 {
            let (x, y) = (1 + k % 19, 1 + (k / 19 * 7 + 8) % 19);
            let at = rect.lerp_inside(egui::vec2(x as f32 / 20.0, y as f32 / 20.0));
            press(&mut self.window, at);
            if self.window.with(|w| *w.resource::<Selection>()) == Selection(Some(member)) {
                return at;
            }
        }
        panic!("member {member} is nowhere in the picture");
    }

    /// Lets a file or a folder go at a place of the window.
    fn drop_at(&mut self, at: egui::Pos2, path: PathBuf) {
        self.window.harness.hover_at(at);
        self.window.frame();
        self.window.harness.input_mut().dropped_files.push(Arc::new(Dropped(path)));
        self.window.frames(3);
    }

    /// Presses *Attach*, and waits until one more piece of evidence is in the sheet.
    fn attach(&mut self, part: &'static str) {
        let rows = |w: &mut Window| {
            w.harness.query_all_by_label_contains("Ctrl+Z attaches it again").count()
        };
        let before = rows(&mut self.window);
        self.window.click("Attach");
        self.until(part, |w| rows(w) > before);
    }

    /// Waits for the prediction, and checks that the sheet of the selected member says it.
    fn predicted(&mut self, member: usize) -> Arc<Prediction> {
        self.until("predicting", |w| w.with(|w| w.resource::<Latest>().result.is_some()));
        self.window.frames(2);
        let result = self.window.with(|w| w.resource::<Latest>().result.clone());
        let result = result.expect("a prediction");
        let said = &result.members[member];
        let (d, error) = said.damage.zip(said.damage_std_error).expect("evidence says something");
        let shown = format!("d = {}", plus_minus(d, error, "").trim());
        let seen = |text: &str| self.window.harness.query_all_by_label(text).next().is_some();
        assert!(seen(&shown), "{shown}");
        assert!(seen(&said.state), "{}", said.state);
        result
    }

    /// Saves the report by the menu; gives its page.
    fn save(&mut self, folder: &Path) -> String {
        self.window.click("Save…");
        self.window.harness.get_by_label_contains("Report…").click();
        self.window.frames(3);
        type_into(&mut self.window, "Folder to write", &folder.display().to_string());
        self.window.harness.get_by_role_and_label(Role::Button, "Save").click();
        let page = folder.join("report.html");
        self.until("saving", |w| {
            page.exists() && w.harness.query_by_label_contains("✔ Saved").is_some()
        });
        fs::read_to_string(page).expect("a report")
    }

    /// What the frames took: for people, not for a test on a busy machine.
    fn tell(&self) {
        for (part, frames, longest, cpu) in &self.parts {
            eprintln!(
                "{part}: {frames} frames, the longest {:.0} ms ({:.0} ms of CPU)",
                1e3 * longest.as_secs_f64(),
                1e3 * cpu
            );
        }
    }
}

/// A table that a cover meter might have written.
fn covers(folder: &Path) -> PathBuf {
    let file = folder.join("covers.csv");
    let rows: String = (0..8).map(|k| format!("0.{}1,{}\n", k + 1, 18 + k % 3)).collect();
    fs::write(&file, format!("along,cover_mm\n{rows}")).expect("a table");
    file
}

/// A folder of slices of a core: grey, with pores that lie otherwise in each.
fn slices(folder: &Path) -> PathBuf {
    let folder = folder.join("core");
    fs::create_dir(&folder).expect("a folder");
    for slice in 0..3_u32 {
        let pixel = |x: u32, y: u32| {
            let [dx, dy] = [x, y].map(|n| f64::from(n) - 127.5);
            let is_core = dx.hypot(dy) < 120.0;
            let [u, v] = [(x + 11 * slice) % 32, (y + 7 * slice) % 32].map(|n| f64::from(n) - 15.5);
            let is_pore = u.hypot(v) < 4.0;
            image::Luma([if is_core && !is_pore { 150_u8 } else { 12 }])
        };
        let file = folder.join(format!("slice_{slice}.png"));
        image::GrayImage::from_fn(256, 256, pixel).save(file).expect("a slice");
    }
    folder
}

/// A finding, filled in by hand, at a place that is clicked in the picture.
fn note_crack(journey: &mut Journey, at: egui::Pos2) {
    journey.window.click("Attach evidence…");
    journey.window.until_seen("Fill in its width, mm.");
    type_into(&mut journey.window, "width, mm", "0.45");
    type_into(&mut journey.window, "Date", "2026-05-03");
    press(&mut journey.window, at);
    journey.attach("a crack");
}

/// A table that is let go over a member that is not selected belongs to it, and to where it was let
/// go.
fn drop_covers(journey: &mut Journey, at: egui::Pos2, member: usize, folder: &Path) {
    journey.window.harness.key_press(Key::Escape);
    journey.window.frames(2);
    assert_eq!(journey.window.with(|w| *w.resource::<Selection>()), Selection(None));
    journey.drop_at(at, covers(folder));
    assert_eq!(journey.window.with(|w| *w.resource::<Selection>()), Selection(Some(member)));
    type_into(&mut journey.window, "Date", "2026-06-01");
    journey.attach("covers");
}

#[test]
#[ignore = "needs INTRADOS_DATA, and ifcopenshell"]
fn an_ifc_and_three_pieces_of_evidence_become_a_report_with_data() {
    let data = std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA");
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("beam.ifc");
    fs::copy(Path::new(&data).join("ifc/reinforcing-assembly.ifc"), &model).expect("a model");
    let mut journey = Journey::begin();
    journey.open(&model);
    let at = journey.spot_of(0);
    note_crack(&mut journey, at);
    drop_covers(&mut journey, at, 0, folder.path());
    let stained = folder.path().join("rust.csv");
    fs::write(&stained, "along,mV\n0.2,-420\n0.5,-390\n0.8,-150\n").expect("a table");
    journey.drop_at(at, stained);
    journey.attach("potentials");
    let result = journey.predicted(0);
    assert!(result.members[0].evidence.contains_key("survey"));
    let page = journey.save(&folder.path().join("report"));
    reported(&page, &result, &["0.45", "2026-05-03", "2026-06-01", "mV"]);
    journey.tell();
}

#[test]
fn a_glb_and_a_folder_of_slices_become_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("portal.ron");
    fs::write(&file, PORTAL).expect("a scene");
    let model = folder.path().join("portal.glb");
    write_glb(&model, &Scene::open(&file, &Job::default()).expect("a scene")).expect("a model");
    let mut journey = Journey::begin();
    journey.open(&model);
    journey.spot_of(0);
    journey.window.click("Attach evidence…");
    journey.window.until_seen("Make its project");
    journey.window.click("Make its project");
    journey.until("making a project", |w| {
        w.with(|w| w.resource::<CurrentScene>().0.path.ends_with("portal.intrados/scene.ron"))
    });
    let warnings = journey.window.with(|w| w.resource::<CurrentScene>().0.warnings.clone());
    assert!(warnings.iter().any(|line| line.contains("README.md")), "{warnings:?}");
    journey.window.harness.key_press(Key::Escape);
    journey.window.frames(3);
    let members = journey.window.with(|w| w.resource::<CurrentScene>().0.members.clone());
    let column = members.iter().position(|m| m.name == "Column 1").expect("the column");
    let at = journey.spot_of(column);
    note_crack(&mut journey, at);
    drop_covers(&mut journey, at, column, folder.path());
    journey.drop_at(at, slices(folder.path()));
    type_into(&mut journey.window, "pixel, mm", "0.4");
    type_into(&mut journey.window, "core's diameter, mm", "96");
    journey.attach("slices");
    let result = journey.predicted(column);
    let evidence = &result.members[column].evidence;
    assert!(["survey", "ct"].iter().all(|s| evidence.contains_key(*s)), "{:?}", evidence.keys());
    let porosity =
        format!("{:.2} % pores", 100.0 * result.members[column].slices[0].porosity.value);
    assert!(journey.window.harness.query_all_by_label_contains(&porosity).next().is_some());
    let page = journey.save(&folder.path().join("report"));
    reported(&page, &result, &["0.45", "2026-05-03", "2026-06-01", "slice_0"]);
    let written = fs::read_to_string(folder.path().join("portal.intrados/evidence.ron"));
    let written = written.expect("evidence");
    assert!(
        ["0.45", "covers.csv", "pixel_mm: 0.4"].iter().all(|w| written.contains(w)),
        "{written}"
    );
    // The model itself is as it was.
    assert!(model.exists() && fs::read(&file).expect("the scene") == PORTAL.as_bytes());
    journey.tell();
}

/// The page says of every member what the prediction says, and names the evidence.
fn reported(page: &str, result: &Prediction, words: &[&str]) {
    for member in &result.members {
        assert!(page.contains(&member.name), "{}", member.name);
        assert!(page.contains(&member.state), "{}: {}", member.name, member.state);
    }
    words.iter().for_each(|word| assert!(page.contains(word), "{word} is not in the report"));
}

/// A column and a beam.
const PORTAL: &str = r#"(
    schema: "intrados.scene/1",
    materials: [(name: "concrete", colour: (0.5, 0.5, 0.5))],
    members: [
        (
            id: "C1", name: "Column 1", at: (0, 0, 0), concrete: "C30/37", material: "concrete",
            body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3, reinforcement: (cover_mm: 35, bars: [Around(count: 8, diameter_mm: 20)])),
        ),
        (
            id: "B1", name: "Beam 1", at: (1, 3, 0), concrete: "C30/37", material: "concrete",
            body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.5), length_m: 3),
        ),
    ],
    lamps: [Environment(name: "sky", radiance: (0.5, 0.6, 0.75))],
    cameras: [(name: "front", position: (3, 2.5, 7), target: (1, 1.6, 0), fov_deg: 40, width: 96, height: 96)],
)"#;
