//! What is attached in the window is what `intrados attach` attaches: the same file, the same
//! refusals.

#![cfg(feature = "desktop")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[allow(dead_code, reason = "other tests need the rest")]
mod common;

use std::{fs, path::Path};

use bevy_app::App;
use common::run;
use intrados_panels::{Action, Actions, Banners, PanelsPlugin};
use intrados_scene::{
    attach::{Attachment, Cut, Face, Finding, What},
    plugin::CurrentScene,
    structure::Course,
};

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    materials: [(name: "concrete", colour: (0.5, 0.5, 0.5))],
    members: [(
        id: "C1", name: "Column 1", at: (0, 0, 0), concrete: "C30/37", material: "concrete",
        body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3),
    )],
    lamps: [Environment(name: "sky", radiance: (1, 1, 1))],
    cameras: [(name: "front", position: (2, 2, 5), target: (0, 1, 0), fov_deg: 40, width: 9, height: 9)],
)"#;

/// A project that nobody has looked into.
fn project(folder: &Path) -> std::path::PathBuf {
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("scene.ron"), SCENE).unwrap();
    folder.join("scene.ron")
}

/// The window's app with a scene, without a window.
fn opened(scene: &Path) -> App {
    let mut app = intrados::simulation();
    app.add_plugins(PanelsPlugin::default());
    app.finish();
    app.cleanup();
    ask(&mut app, Action::Open(scene.to_owned()));
    until(&mut app, |app| app.world().contains_resource::<CurrentScene>());
    app
}

fn ask(app: &mut App, action: Action) {
    app.world_mut().resource_mut::<Actions>().ask(action);
}

fn until(app: &mut App, done: impl Fn(&App) -> bool) {
    for _ in 0..20_000 {
        app.update();
        if done(app) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("it did not happen");
}

fn attachment(what: What) -> Attachment {
    Attachment {
        member: "C1".into(),
        name: None,
        date: Some("2026-05-03".parse().unwrap()),
        along: Some([0.4, 0.4]),
        face: None,
        angle_deg: None,
        height_m: None,
        instrument: None,
        picture: None,
        confirmed: false,
        what,
    }
}

fn seen(app: &App) -> usize {
    app.world().resource::<CurrentScene>().0.structure.observations.len()
}

#[test]
fn the_window_writes_what_the_command_writes_and_takes_it_back_to_the_byte() {
    let folder = tempfile::tempdir().unwrap();
    let [by_window, by_command] = ["window", "command"].map(|name| folder.path().join(name));
    let scene = project(&by_window);
    project(&by_command);
    let crack = Finding::Crack {
        width_mm: 0.35,
        std_error_mm: None,
        course: Course::Across,
        length_m: Some(0.3),
    };
    let what = Attachment { face: Some(Face::Front), ..attachment(What::Finding(crack)) };
    let mut app = opened(&scene);
    ask(&mut app, Action::Attach(Box::new(what)));
    until(&mut app, |app| seen(app) == 1);
    let to = by_command.display().to_string();
    let args =
        "C1 --crack 0.35 --course across --length-m 0.3 --face front --along 0.4 --date 2026-05-03";
    let args: Vec<&str> =
        ["attach", to.as_str()].into_iter().chain(args.split_whitespace()).collect();
    let said = run(&args);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let [one, other] = [&by_window, &by_command].map(|f| f.join("evidence.ron"));
    let written = fs::read(&one).unwrap();
    assert_eq!(written, fs::read(&other).unwrap());

    // Taken back, made again, detached, and that taken back.
    let evidence = |app: &mut App, action: Action, count: usize| {
        ask(app, action);
        until(app, |app| seen(app) == count);
        fs::read(&one).ok()
    };
    assert_eq!(evidence(&mut app, Action::Undo, 0), None);
    assert_eq!(evidence(&mut app, Action::Redo, 1), Some(written.clone()));
    let name = app.world().resource::<CurrentScene>().0.structure.observations[0].name.clone();
    let without = evidence(&mut app, Action::Detach("C1".into(), name), 0);
    assert!(without.is_some() && without != Some(written.clone()));
    assert_eq!(evidence(&mut app, Action::Undo, 1), Some(written));
}

#[test]
fn the_window_refuses_with_the_sentence_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let scene = project(&folder.path().join("bridge"));
    let to = folder.path().join("bridge").display().to_string();
    // A picture whose pixels would make it wider than its member.
    let slice = folder.path().join("slice.png");
    image::GrayImage::from_fn(64, 64, |x, y| {
        let inside = (8..56).contains(&x) && (8..56).contains(&y);
        image::Luma([if inside { 200 } else { 10 }])
    })
    .save(&slice)
    .unwrap();
    let table = folder.path().join("table.csv");
    fs::write(&table, "along,something\n0.5,1\n").unwrap();
    let file = |path: &Path| path.display().to_string();
    let slices =
        What::Slices { files: vec![slice.clone()], pixel_mm: Some(400.0), cut: Cut::default() };
    let covers = What::Table {
        file: table.clone(),
        kind: None,
        unit: None,
        test: None,
        electrode: Default::default(),
    };
    let cases = [
        (slices, vec![file(&slice), "--pixel-mm".into(), "400".into()]),
        (covers, vec![file(&table)]),
    ];
    let mut app = opened(&scene);
    for (what, args) in cases {
        let [along, date] = [["--along", "0.4"], ["--date", "2026-05-03"]];
        let args: Vec<&str> = ["attach", to.as_str(), "C1"]
            .into_iter()
            .chain(args.iter().map(String::as_str))
            .chain(along)
            .chain(date)
            .collect();
        let said = run(&args);
        assert!(!said.status.success(), "{args:?}");
        let lines = |app: &App| app.world().resource::<Banners>().lines();
        let before = lines(&app).len();
        ask(&mut app, Action::Attach(Box::new(attachment(what))));
        until(&mut app, |app| lines(app).len() > before);
        let banner = lines(&app).pop().unwrap();
        let why = banner.split_once(": ").unwrap().1.to_owned();
        assert!(
            String::from_utf8_lossy(&said.stderr).contains(&why),
            "{why}\n{}",
            String::from_utf8_lossy(&said.stderr)
        );
        assert!(!folder.path().join("bridge/evidence.ron").exists());
    }
}
