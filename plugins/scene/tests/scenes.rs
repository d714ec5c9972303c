//! The bundled scenes.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{collections::HashSet, path::Path};

use glam::Vec3;
use intrados_scene::{ErrorKind, Scene, bundled};
use intrados_stage::Job;

fn load(name: &str) -> Scene {
    Scene::load_bundled(name, &Job::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn every_bundled_scene_loads_and_is_whole() {
    for (name, _) in bundled() {
        let scene = load(name);
        assert_eq!(scene.name, *name);
        assert!(
            !scene.cameras.is_empty() && scene.meters.len() >= 2 && scene.triangle_count() > 0,
            "{name}"
        );
        assert_eq!(scene.hash.len(), 64, "{name}");
        assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
        let emits =
            scene.objects.iter().any(|o| scene.materials[o.material].emission != Vec3::ZERO);
        assert!(emits || !scene.lamps.is_empty(), "{name} is dark");
        for object in &scene.objects {
            assert!(
                object.material < scene.materials.len()
                    && object.mesh < scene.meshes.len()
                    && object.member.is_none_or(|m| m < scene.members.len())
            );
        }
        let ids: HashSet<&str> = scene.members.iter().map(|m| m.id.as_str()).collect();
        assert_eq!(ids.len(), scene.members.len(), "{name}");
    }
}

#[test]
fn hashes_tell_scenes_apart_and_repeat() {
    let hashes: HashSet<String> = bundled().iter().map(|(name, _)| load(name).hash).collect();
    assert_eq!(hashes.len(), bundled().len());
    assert_eq!(load("room").hash, load("room").hash);
}

/// The embedded text and the file in the repository are one scene.
#[test]
fn a_bundled_scene_is_the_file_of_its_name() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/door.ron");
    let file = Scene::load(&path, &Job::default()).unwrap();
    assert_eq!(file.hash, load("door").hash);
    let elsewhere = Scene::open(Path::new("scenes/door.ron"), &Job::default()).unwrap();
    assert_eq!(elsewhere.hash, file.hash);
    assert_eq!(Scene::open(Path::new("door"), &Job::default()).unwrap().hash, file.hash);
    assert_eq!(
        Scene::open(Path::new("doors"), &Job::default()).unwrap_err().kind(),
        ErrorKind::NoInput
    );
}

/// Areas of the rooms by arithmetic: what a closed box of these measures has, less its openings.
#[test]
fn rooms_have_the_areas_of_their_measures() {
    let area = |name: &str| -> f64 {
        let scene = load(name);
        scene.objects.iter().filter(|o| o.name != "lamp").map(|o| scene.meshes[o.mesh].area()).sum()
    };
    for (name, expected) in [
        ("room", 24.0),
        // two boxes of 2 m whose common wall is there once, with its opening
        ("slit", 2.0 * 20.0 + 4.0 - 0.05 * 2.0),
        ("door", 2.0 * 20.0 + 4.0 - 0.1 * 0.1),
        // open at x = 12, where the lamp is
        ("corridor", 4.0 * 12.0 + 1.0),
        // 13 cells: floor and ceiling, and 2 walls a cell + 2 ends
        ("maze", 26.0 + 28.0),
    ] {
        let found = area(name);
        assert!((found - expected).abs() < 1e-5, "{name}: {found}");
    }
}

/// Transforms, colours and orientation as `mitsuba.cornell_box()` has them.
#[test]
fn cornell_is_mitsubas() {
    let scene = load("cornell");
    let object = |name: &str| scene.objects.iter().find(|o| o.name == name).unwrap();
    let corner = |name: &str, local: Vec3| {
        let half = 0.5 * local;
        let mesh = &scene.meshes[object(name).mesh];
        let size = mesh.positions.iter().fold(Vec3::ZERO, |a, p| a.max(p.abs())) * 2.0;
        object(name).transform.transform_point3(half * size)
    };
    // `to_world` of Mitsuba's cubes, applied to their corner (1, 1, 1)
    let small = Vec3::new(0.286891 - 0.0877115 + 0.335, 0.3 - 0.7, 0.0877115 + 0.286891 + 0.38);
    let large = Vec3::new(0.28491 + 0.0939491 - 0.33, 0.61 - 0.4, -0.0939491 + 0.28491 - 0.28);
    assert!(
        corner("small box", Vec3::ONE).distance(small) < 2e-6,
        "{}",
        corner("small box", Vec3::ONE)
    );
    assert!(corner("large box", Vec3::ONE).distance(large) < 2e-6);
    let lamp = &scene.materials[object("lamp").material];
    assert_eq!(lamp.emission, Vec3::new(18.387, 13.9873, 6.75357));
    let quad = &scene.meshes[object("lamp").mesh];
    let [a, b, c] = quad.corners(0);
    assert!((b - a).cross(c - a).y < 0.0, "the lamp shines down");
}
