//! The application without a window: scenes come and go, the picture refines, meters are read
//! whoever spawned them, errors are messages.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{path::PathBuf, time::Duration};

use bevy_app::App;
use bevy_ecs::prelude::*;
use glam::Vec3;
use intrados_light::{
    Measurement, Render, RenderSettings, Sides,
    plugin::{ActiveCamera, Lit, MeasureSettings},
};
use intrados_scene::{
    Camera, ErrorKind, Meter, Scene,
    plugin::{CurrentScene, FromScene, OpenScene, SceneChanged, SceneFailed, SceneIndex, install},
};
use intrados_stage::{Job, Pace};
use intrados_tests::meter;

/// Frames until `done`, with a pause for work off the frame.
fn run_until(app: &mut App, done: impl Fn(&World) -> bool) {
    for _ in 0..10_000 {
        app.update();
        if done(app.world()) {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("it never came");
}

fn bundled(name: &str) -> Scene {
    Scene::load_bundled(name, &Job::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn walks(world: &World) -> u64 {
    world
        .get_resource::<Render>()
        .map_or(0, |r| r.exposures().iter().flatten().map(|e| e.walks).sum())
}

fn names(world: &World) -> Vec<String> {
    world
        .get_resource::<Measurement>()
        .map_or(Vec::new(), |m| m.sensors.iter().map(|s| s.name().to_owned()).collect())
}

fn count<T: Component>(app: &mut App) -> usize {
    app.world_mut().query_filtered::<Entity, With<T>>().iter(app.world()).count()
}

#[test]
fn a_scene_becomes_a_picture_and_readings() {
    let mut app = intrados::simulation();
    install(app.world_mut(), bundled("room"));
    app.insert_resource(Pace::Passes(4));
    run_until(&mut app, |world| walks(world) > 200_000);
    let world = app.world();
    assert_eq!(world.resource::<ActiveCamera>().0.name, "eye");
    let render = world.resource::<Render>();
    let summary = render.summary();
    let reading = summary.combined;
    assert!(reading.std_error < 0.01 * reading.mean, "{reading:?}");
    // Both sides made it, and agree: one z at 5 standard errors, false alarm 6e-7.
    assert!(
        summary.duality_z.unwrap().abs() < 5.0
            && (reading.mean / 0.270_23 - 1.0).abs() < 5.0 * reading.rel_error() + 1e-3
    );
    assert_eq!(names(world), ["floor", "under the ceiling"]);
    for r in world.resource::<Measurement>().readings() {
        assert!(r.combined.mean > 0.0 && r.combined.std_error < 0.1 * r.combined.mean, "{r:?}");
    }
}

#[test]
fn a_pause_is_a_pause() {
    let mut app = intrados::simulation();
    install(app.world_mut(), bundled("room"));
    run_until(&mut app, |world| walks(world) > 0);
    app.insert_resource(Pace::Rest);
    app.update();
    let before = walks(app.world());
    (0..10).for_each(|_| app.update());
    assert_eq!(walks(app.world()), before);
    app.insert_resource(Pace::Passes(1));
    app.update();
    assert!(walks(app.world()) > before);
}

#[test]
fn a_meter_that_somebody_spawns_is_read() {
    let mut app = intrados::simulation();
    install(app.world_mut(), bundled("room"));
    run_until(&mut app, |world| names(world).len() == 2);
    // Just above the scene's own meter on the floor, as large: they read the same within their
    // errors.
    let own = meter("mine", Vec3::new(-0.1, 0.002, -0.1), Vec3::Z * 0.2, Vec3::X * 0.2);
    let entity = app.world_mut().spawn(own).id();
    run_until(&mut app, |world| {
        names(world) == ["floor", "mine", "under the ceiling"]
            && world.resource::<Measurement>().primal.iter().all(|e| e.walks > 100_000)
    });
    let readings = app.world().resource::<Measurement>().readings();
    let [floor, mine] = [&readings[0], &readings[1]];
    let z = (floor.combined.mean - mine.combined.mean)
        / floor.combined.std_error.hypot(mine.combined.std_error);
    assert!(mine.combined.mean > 0.1 && z.abs() < 5.0, "{floor:?}\n{mine:?}");
    // Moved, it starts again; gone, it is read no more.
    app.world_mut().get_mut::<Meter>(entity).unwrap().name = "yours".into();
    run_until(&mut app, |world| names(world) == ["floor", "under the ceiling", "yours"]);
    app.world_mut().despawn(entity);
    run_until(&mut app, |world| names(world) == ["floor", "under the ceiling"]);
}

#[test]
fn another_scene_replaces_all_of_the_first() {
    let mut app = intrados::simulation();
    install(app.world_mut(), bundled("room"));
    let kept = app
        .world_mut()
        .spawn(meter("kept", Vec3::new(0.1, 0.1, 0.1), Vec3::Z * 0.2, Vec3::X * 0.2))
        .id();
    run_until(&mut app, |world| walks(world) > 0);
    install(app.world_mut(), bundled("column"));
    // What is old is gone in the same frame: nobody takes a picture of the room for one of the
    // column.
    app.update();
    assert_eq!(app.world().resource::<CurrentScene>().0.name, "column");
    assert!(app.world().get_resource::<Render>().is_none_or(|r| r.lit().scene.name == "column"));
    run_until(&mut app, |world| walks(world) > 0);
    assert_eq!(app.world().resource::<Lit>().0.scene.name, "column");
    let scene = bundled("column");
    assert_eq!(count::<intrados_scene::Member>(&mut app), scene.members.len());
    assert_eq!(count::<Camera>(&mut app), scene.cameras.len());
    assert_eq!(
        count::<FromScene>(&mut app),
        scene.members.len() + scene.lamps.len() + scene.cameras.len() + scene.meters.len()
    );
    let indices: Vec<usize> = app
        .world_mut()
        .query_filtered::<&SceneIndex, With<intrados_scene::Member>>()
        .iter(app.world())
        .map(|i| i.0)
        .collect();
    assert!((0..scene.members.len()).all(|i| indices.contains(&i)));
    // Nobody's meter but the scene's goes with the scene.
    assert!(app.world().get::<Meter>(kept).is_some());
    run_until(&mut app, |world| names(world).len() == scene.meters.len() + 1);
}

#[derive(Resource, Default)]
struct Heard {
    changed: u32,
    failed: Vec<SceneFailed>,
}

fn listen(
    mut changed: MessageReader<SceneChanged>,
    mut failed: MessageReader<SceneFailed>,
    mut heard: ResMut<Heard>,
) {
    heard.changed += changed.read().count() as u32;
    heard.failed.extend(failed.read().cloned());
}

#[test]
fn a_file_is_opened_off_the_frame_and_a_broken_one_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.ron");
    std::fs::write(
        &broken,
        "(schema: \"intrados.scene/1\", shapes: [Quad(corner: (0, 0), u: (1, 0, 0)])",
    )
    .unwrap();
    let mut app = intrados::simulation();
    app.init_resource::<Heard>().add_systems(bevy_app::PostUpdate, listen);
    app.world_mut().write_message(OpenScene(PathBuf::from("room")));
    run_until(&mut app, |world| world.resource::<Heard>().changed == 1);
    run_until(&mut app, |world| walks(world) > 0);
    for (path, kind) in [
        (broken.clone(), ErrorKind::BadInput),
        (folder.path().join("none.ron"), ErrorKind::NoInput),
    ] {
        let before = app.world().resource::<Heard>().failed.len();
        app.world_mut().write_message(OpenScene(path.clone()));
        run_until(&mut app, |world| world.resource::<Heard>().failed.len() > before);
        let SceneFailed(error) = app.world().resource::<Heard>().failed[before].clone();
        let line = error.to_string();
        assert_eq!(error.kind(), kind);
        assert!(
            line.lines().count() == 1
                && line.contains(&path.file_name().unwrap().to_string_lossy().into_owned()),
            "{line}"
        );
        // What was there stays.
        assert_eq!(app.world().resource::<CurrentScene>().0.name, "room");
        assert!(walks(app.world()) > 0);
    }
    assert_eq!(app.world().resource::<Heard>().changed, 1);
}

#[test]
fn a_camera_or_a_setting_that_changes_starts_the_picture_again() {
    let mut app = intrados::simulation();
    app.insert_resource(MeasureSettings { enabled: false, ..MeasureSettings::default() });
    install(app.world_mut(), bundled("room"));
    run_until(&mut app, |world| walks(world) > 100_000);
    app.world_mut().resource_mut::<ActiveCamera>().0.position.x -= 0.1;
    app.update();
    let after = walks(app.world());
    assert!(after > 0 && after < 100_000, "{after}");
    app.world_mut().resource_mut::<RenderSettings>().sides = Sides::Dual;
    app.update();
    let render = app.world().resource::<Render>();
    assert!(render.exposures()[0].is_none() && render.exposures()[1].is_some());
    assert!(app.world().get_resource::<Measurement>().is_none());
}
