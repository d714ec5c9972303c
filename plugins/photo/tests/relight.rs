//! A wall whose reflectance is planted, in a corner with a red wall, under two lamps of other
//! strengths than the scene says, photographed through a lens that darkens: its reflectance comes
//! back.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{path::Path, sync::Arc};

use glam::{DVec3, Mat4, Vec3};
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, scene_rule};
use intrados_photo::{
    FaceMap, Located, Photograph, Pick, Pose, Prior, Site, locate,
    relight::{Light, ReflectanceMap, RelightError, RelightSettings, Relit, merged, relight},
    site::SeenFace,
    taken::Focal,
    unrolled,
};
use intrados_scene::{Camera, LampKind, Lens, Mesh, Part, Scene};
use intrados_stage::{Job, random::Key};

const MM: f64 = 8.0;

/// The wall's front is at z = 0, from x = −.8 to .8 and y = 0 to 2; a red wall stands to its left, a
/// post before its right half.
fn model(post_x: f64, lamps: &str) -> Scene {
    let text = format!(
        r#"(
    schema: "intrados.scene/1",
    materials: [
        (name: "grey", colour: (0.5, 0.5, 0.5)),
        (name: "floor", colour: (0.4, 0.4, 0.4)),
        (name: "red", colour: (0.75, 0.15, 0.1)),
    ],
    shapes: [
        Box(name: "floor", centre: (0, -0.1, 1), size: (5, 0.2, 6), material: "floor"),
        Box(name: "red wall", centre: (-0.9, 1.2, 1), size: (0.2, 2.4, 3), material: "red"),
        Box(name: "post", centre: ({post_x}, 1.25, 0.5), size: (0.06, 2.5, 0.06), material: "floor"),
        {lamps}
    ],
    members: [(
        id: "W", name: "wall",
        body: Column(
            section: Rectangle(width_m: 1.6, depth_m: 0.3), height_m: 2,
            reinforcement: (cover_mm: 40, bars: [Around(count: 12, diameter_mm: 20)], stirrups: (diameter_mm: 8, spacing_mm: 150)),
        ),
        at: (0, 0, -0.15), concrete: "C30/37", material: "grey",
    )],
    lamps: [LAMPS],
)"#
    );
    let text = text.replace(
        "LAMPS",
        r#"Point(name: "bulb", position: (1.3, 1.9, 2.2), strength: WattPerSteradian(6))"#,
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("corner.ron");
    std::fs::write(&path, text).unwrap();
    Scene::open(&path, &Job::default()).unwrap()
}

const PANEL: &str = r#"Quad(name: "panel", corner: (-0.6, 2.3, 1.3), u: (0.5, 0, 0), v: (0, 0, 0.4), emission: (9, 9, 9)),"#;

/// Planted reflectance over the model's, by place on the wall: blotches, a stain, a colour.
fn planted(x: f64, y: f64) -> [f64; 3] {
    let blotch =
        0.15 * (9.0 * x + 1.0).sin() * (7.0 * y).cos() + 0.08 * (23.0 * x - 11.0 * y).sin();
    let stain = -0.7 * (-((x - 0.1).powi(2) + (y - 0.8).powi(2)) / 0.01).exp();
    [blotch + stain, blotch + 1.1 * stain, 0.8 * blotch + 1.3 * stain].map(f64::exp)
}

/// The scene with what is planted drawn on the wall's front, and lamps as they truly burn.
fn truth(model: &Scene, with_pattern: bool) -> Scene {
    let mut scene = model.clone();
    let object = scene.objects.iter().position(|o| o.part == Part::Concrete).unwrap();
    let mut mesh = Mesh::default();
    let (columns, rows) = (160_u32, 200_u32);
    for (j, i) in (0..=rows).flat_map(|j| (0..=columns).map(move |i| (j, i))) {
        let (x, y) = (-0.8 + 0.01 * f64::from(i), 0.01 * f64::from(j));
        mesh.positions.push(DVec3::new(x, y, 0.0).as_vec3());
        let rho = if with_pattern { planted(x, y) } else { [1.0; 3] };
        mesh.colours.push(Vec3::from(rho.map(|r| r as f32)));
    }
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let a = j * (columns + 1) + i;
        let b = a + columns + 1;
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    scene.objects[object].mesh = scene.meshes.len();
    scene.objects[object].transform = Mat4::IDENTITY;
    scene.meshes.push(Arc::new(mesh));
    for material in &mut scene.materials {
        material.emission *= Vec3::new(1.5, 1.3, 1.0);
    }
    for lamp in &mut scene.lamps {
        if let LampKind::Point { intensity, .. } = &mut lamp.kind {
            *intensity *= Vec3::new(0.7, 0.8, 0.9);
        }
    }
    scene
}

fn pose(x: f64) -> Pose {
    let camera = Camera {
        name: "eye".into(),
        position: DVec3::new(x, 1.1, 3.2).as_vec3(),
        target: Vec3::new(0.0, 1.0, 0.0),
        up: Vec3::Y,
        fov_deg: 46.0,
        width: 360,
        height: 300,
        exposure: 0.0,
        lens: Some(Lens { k1: -0.08, ..Lens::default() }),
    };
    Pose::of(&camera)
}

/// A photograph of a scene: with vignetting and noise, in sixteen bits. Of other seeds and four
/// times the walks of what takes the light off.
fn shot(scene: &Scene, pose: &Pose, walks: u64, seed: u64, folder: &Path) -> Photograph {
    let lit = LitScene::build(Arc::new(scene.clone()), &Job::default()).unwrap();
    let rule = scene_rule(scene);
    let settings = RenderSettings {
        sides: Sides::Primal,
        rule,
        seed,
        samples: Some(walks),
        ..RenderSettings::default()
    };
    let mut render = Render::new(Arc::new(lit), &pose.camera("eye"), &settings);
    while render.advance(1) {}
    let image = render.plate().image(View::Combined, None);
    let [width, height] = pose.size;
    let mut sorted: Vec<f32> = image.mean.iter().map(|c| c.max_element()).collect();
    sorted.sort_by(f32::total_cmp);
    let exposure = 0.8 / sorted[sorted.len() * 49 / 50];
    let picture = image::ImageBuffer::from_fn(width, height, |x, y| {
        let k = (y * width + x) as usize;
        let [a, b] = [f64::from(x) + 0.5 - 180.0, f64::from(y) + 0.5 - 150.0];
        let r2 = (a * a + b * b) / (180.0_f64.powi(2) + 150.0_f64.powi(2));
        let v = 1.0 - 0.2 * r2 - 0.05 * r2 * r2;
        let code = |c: usize| {
            let light = v * f64::from(exposure * image.mean[k][c]);
            let noise = 0.01 * light.sqrt() * Key::new(seed + 77, k as u64).normal(2 * c as u32);
            let light = (light + noise).clamp(0.0, 1.0);
            let s = if light <= 0.003_130_8 {
                12.92 * light
            } else {
                1.055 * light.powf(1.0 / 2.4) - 0.055
            };
            (65535.0 * s).round() as u16
        };
        image::Rgb([0, 1, 2].map(code))
    });
    let path = folder.join(format!("shot{seed}.png"));
    picture.save(&path).unwrap();
    Photograph::open(&path).unwrap()
}

/// The camera by picks that are a third of a pixel off.
fn located(pose: &Pose) -> Located {
    let places = [
        [-0.8, 0.0, 0.0],
        [0.8, 0.0, 0.0],
        [0.8, 2.0, 0.0],
        [-0.8, 2.0, 0.0],
        [-0.8, 0.0, 0.5],
        [-0.8, 1.8, 0.6],
        [0.47, 0.3, 0.47],
        [0.47, 1.7, 0.47],
    ];
    let pick = |(i, place): (u64, [f64; 3])| {
        let [x, y] = pose.project(place.into()).unwrap();
        let noise = |k: u32| 0.3 * Key::new(3, i).normal(2 * k);
        Pick { pixel: [x + noise(0), y + noise(1)], place: place.into() }
    };
    let picks: Vec<Pick> = (0..).zip(places).map(pick).collect();
    let focal = Some(Focal { px: pose.focal_px, rel_error: 0.002 });
    let prior = Prior { size: pose.size, focal, lens: pose.lens, k1_error: 0.002, picking_px: 0.3 };
    locate(&picks, &prior, &|_| true).unwrap()
}

fn front(site: &Site, pose: &Pose) -> SeenFace {
    site.seen_faces(pose).into_iter().find(|s| s.face.name == "Front").unwrap()
}

fn settings(samples: u64, shadow_error_m: f64) -> RelightSettings {
    RelightSettings { longest: 180, samples, seed: 5, shadow_error_m, ..RelightSettings::default() }
}

/// By known pixel of a map: its place, log ρ less what is planted by channel, its errors.
fn off(map: &FaceMap, errors: &[Vec3], with_pattern: bool) -> Vec<([f64; 2], [f64; 3], [f64; 3])> {
    let m = 1e-3 * map.mm_px;
    let of = |(k, light): (usize, &Option<Vec3>)| {
        let light = (*light)?;
        let x = map.corner[0] + ((k % map.size[0]) as f64 + 0.5) * m;
        let y = map.corner[1] - ((k / map.size[0]) as f64 + 0.5) * m;
        let rho = if with_pattern { planted(x, y) } else { [1.0; 3] };
        let off = [0, 1, 2].map(|c| (f64::from(light[c]) / rho[c]).ln());
        Some(([x, y], off, errors[k].as_dvec3().to_array()))
    };
    map.light.iter().enumerate().filter_map(of).collect()
}

fn level(off: &mut [([f64; 2], [f64; 3], [f64; 3])]) {
    for c in 0..3 {
        let mut all: Vec<f64> = off.iter().map(|o| o.1[c]).collect();
        all.sort_by(f64::total_cmp);
        let middle = all[all.len() / 2];
        off.iter_mut().for_each(|o| o.1[c] -= middle);
    }
}

/// Share within 1.96 standard errors.
fn within(off: &[([f64; 2], [f64; 3], [f64; 3])]) -> f64 {
    let inside = off.iter().flat_map(|o| (0..3).map(|c| o.1[c].abs() < 1.96 * o.2[c]));
    inside.clone().filter(|i| *i).count() as f64 / inside.count() as f64
}

/// Root mean square over tiles of 10 cm of their mean: what varies slowly, as light does.
fn slow(off: &[([f64; 2], [f64; 3], [f64; 3])]) -> f64 {
    let mut tiles = std::collections::BTreeMap::<_, ([f64; 3], f64)>::new();
    for ([x, y], value, _) in off {
        let tile = tiles.entry([x, y].map(|c| (c * 10.0).floor() as i64)).or_default();
        (0..3).for_each(|c| tile.0[c] += value[c]);
        tile.1 += 1.0;
    }
    let means = tiles.values().filter(|t| t.1 > 20.0).flat_map(|t| t.0.map(|s| s / t.1));
    (means.clone().map(|m| m * m).sum::<f64>() / means.count() as f64).sqrt()
}

fn face_map(
    site: &Site,
    relit: &Relit,
    photograph: &Photograph,
    located: &Located,
) -> ReflectanceMap {
    let seen = front(site, &located.pose);
    relit.map(site, &seen, (photograph, located), MM, &Job::default()).unwrap()
}

#[test]
fn planted_reflectance_comes_back_within_its_errors() {
    let (folder, job) = (tempfile::tempdir().unwrap(), Job::default());
    let scene = model(0.5, PANEL);
    let site = Site::new(&scene, &job).unwrap();
    let mut maps = Vec::new();
    for (seed, x) in [(101, 0.3), (102, 0.9)] {
        let pose = pose(x);
        let photograph = shot(&truth(&scene, true), &pose, 256, seed, folder.path());
        let located = located(&pose);
        let found =
            relight(&site, &scene, (&photograph, &located), &settings(64, 0.0), &job).unwrap();
        let record = found.record();
        println!("{record:?}");
        let map = face_map(&site, &found, &photograph, &located);
        let mut offs = off(&map.face, &map.log_error, true);
        level(&mut offs);
        let inside = within(&offs);
        let seen = front(&site, &located.pose);
        let plain = unrolled(
            &site,
            site.surface(0).unwrap(),
            &seen.face,
            (&photograph, &located.pose),
            MM,
            &job,
        )
        .unwrap();
        let mut lit = off(&plain, &vec![Vec3::ONE; plain.light.len()], true);
        level(&mut lit);
        let error = offs.iter().map(|o| o.2[1]).sum::<f64>() / offs.len() as f64;
        println!(
            "{inside:.4} within, known {:.3}, light {:.4} → {:.4}, mean error {error:.4}",
            map.face.known(),
            slow(&lit),
            slow(&offs),
        );
        assert!((0.90..0.99).contains(&inside), "{inside}");
        assert!(map.face.known() > 0.75, "{}", map.face.known());
        assert!(slow(&lit) > 10.0 * slow(&offs), "{} {}", slow(&lit), slow(&offs));
        // Strengths as planted, up to exposure: green to green.
        let [panel, bulb] = [0, 1].map(|k| record.lamps[k].strength[1]);
        assert!((panel / bulb / (1.3 / 0.8) - 1.0).abs() < 0.05, "{record:?}");
        assert!((record.vignetting[0] + 0.2).abs() < 0.1, "{record:?}");
        // Direct light alone leaves what the red wall and the floor reflect: in the corner.
        let by = |light: Light| {
            let settings = RelightSettings { light, ..settings(64, 0.0) };
            let found = relight(&site, &scene, (&photograph, &located), &settings, &job).unwrap();
            let map = face_map(&site, &found, &photograph, &located);
            let mut offs = off(&map.face, &map.log_error, true);
            level(&mut offs);
            let corner: Vec<_> = offs.iter().copied().filter(|o| o.0[0] < -0.6).collect();
            (slow(&offs), slow(&corner), within(&offs))
        };
        let [all, direct] = [Light::All, Light::Direct].map(by);
        println!("slow error, in the corner, within: global {all:.4?}, direct {direct:.4?}");
        assert!(direct.0 > 1.5 * all.0 && direct.1 > 2.0 * all.1, "{direct:?} {all:?}");
        maps.push(map);
    }
    let both = merged(&maps).unwrap();
    let mut offs = off(&both.map.face, &both.map.log_error, true);
    level(&mut offs);
    println!(
        "merged: {:.4} within, χ² {:.2}, known {:.3}",
        within(&offs),
        both.reduced_chi2,
        both.map.face.known()
    );
    assert!((0.90..0.995).contains(&within(&offs)), "{}", within(&offs));
    assert!(both.map.face.known() >= maps[0].face.known());
}

/// The post truly stands 5 cm further to the right: where its shadow's edges were expected, what is
/// stated of shadows covers what is wrong, or the map is unknown; with nothing stated it is wrong.
#[test]
fn a_shadow_that_is_moved_is_unknown_or_within_its_error() {
    let (folder, job) = (tempfile::tempdir().unwrap(), Job::default());
    let scene = model(0.5, PANEL);
    let site = Site::new(&scene, &job).unwrap();
    let pose = pose(0.3);
    let photograph = shot(&truth(&model(0.55, PANEL), true), &pose, 100, 103, folder.path());
    let located = located(&pose);
    let inside = |shadow_error_m: f64| {
        let found =
            relight(&site, &scene, (&photograph, &located), &settings(64, shadow_error_m), &job);
        let map = face_map(&site, &found.unwrap(), &photograph, &located);
        let mut offs = off(&map.face, &map.log_error, true);
        level(&mut offs);
        // Off by a quarter: that is the shadow's edge, taken for damage.
        let wrong: Vec<_> =
            offs.iter().copied().filter(|o| o.1.iter().any(|v| v.abs() > 0.25)).collect();
        let sure = wrong.iter().filter(|o| (0..3).any(|c| o.1[c].abs() > 1.96 * o.2[c])).count();
        (map.face.known(), sure as f64 / map.face.light.len() as f64, within(&offs))
    };
    let [nothing, stated] = [0.0, 0.06].map(inside);
    println!(
        "known, share that is wrong by more than it says, within: {nothing:.4?}, {stated:.4?}"
    );
    assert!(nothing.1 > 0.03, "{nothing:?}");
    assert!(stated.1 < 0.2 * nothing.1, "{stated:?}");
    assert!(stated.2 > 0.95 && stated.0 > 0.4, "{stated:?}");
}

#[test]
fn any_number_of_threads_makes_the_same_map() {
    let (folder, job) = (tempfile::tempdir().unwrap(), Job::default());
    let scene = model(0.5, PANEL);
    let site = Site::new(&scene, &job).unwrap();
    let pose = pose(0.3);
    let photograph = shot(&truth(&scene, true), &pose, 32, 104, folder.path());
    let located = located(&pose);
    let settings = RelightSettings { longest: 60, ..settings(16, 0.0) };
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let found = relight(&site, &scene, (&photograph, &located), &settings, &job).unwrap();
            (found.record(), face_map(&site, &found, &photograph, &located))
        })
    });
    assert!(one.1.face.known() > 0.3);
    assert_eq!(one, two);
}

/// Without any lamp no light is taken off, and the reason is told. One that shines away from all
/// that is seen is named; two that burn side by side are one.
#[test]
fn lamps_that_cannot_be_known_are_told() {
    let (folder, job) = (tempfile::tempdir().unwrap(), Job::default());
    let behind = r#"Quad(name: "behind", corner: (-0.2, 1.0, -2.5), u: (0, 0.4, 0), v: (0.4, 0, 0), emission: (9, 9, 9)),"#;
    let beside = r#"Quad(name: "beside", corner: (-0.58, 2.3, 1.32), u: (0.5, 0, 0), v: (0, 0, 0.4), emission: (9, 9, 9)),"#;
    let pose = pose(0.3);
    let shown = model(0.5, PANEL);
    let photograph = shot(&truth(&shown, true), &pose, 4, 105, folder.path());
    let located = located(&pose);
    let settings = RelightSettings { longest: 60, ..settings(8, 0.0) };
    let of = |mut scene: Scene, dark: bool| {
        if dark {
            scene.lamps.clear();
        }
        let site = Site::new(&scene, &job).unwrap();
        relight(&site, &scene, (&photograph, &located), &settings, &job).map(|r| r.record())
    };
    assert!(matches!(of(model(0.5, ""), true), Err(RelightError::Dark)));
    let record = of(model(0.5, &format!("{PANEL}{beside}")), false).unwrap();
    let names: Vec<&str> = record.lamps[0].lamps.iter().map(String::as_str).collect();
    assert_eq!((names, record.lamps.len()), (vec!["panel", "beside"], 2), "{record:?}");
    let record = of(model(0.5, &format!("{PANEL}{behind}")), false).unwrap();
    assert_eq!((record.unseen, record.lamps.len()), (vec!["behind".to_owned()], 2));
}

/// The floor is lighter than the scene says, and the wall is not red but green: the second round
/// knows by the photograph, and what they reflect onto the wall is taken off better.
#[test]
fn what_others_reflect_is_learnt_from_the_photograph() {
    let (folder, job) = (tempfile::tempdir().unwrap(), Job::default());
    let true_scene = model(0.5, PANEL);
    let mut scene = true_scene.clone();
    for (name, colour) in [("floor", Vec3::splat(0.15)), ("red", Vec3::new(0.15, 0.7, 0.4))] {
        let material = scene.materials.iter_mut().find(|m| m.name == name).unwrap();
        material.base_colour = colour;
    }
    let site = Site::new(&scene, &job).unwrap();
    let pose = pose(0.3);
    let photograph = shot(&truth(&true_scene, true), &pose, 100, 106, folder.path());
    let located = located(&pose);
    let by = |rounds: u32| {
        let settings = RelightSettings { rounds, ..settings(64, 0.0) };
        let found = relight(&site, &scene, (&photograph, &located), &settings, &job).unwrap();
        let map = face_map(&site, &found, &photograph, &located);
        let mut offs = off(&map.face, &map.log_error, true);
        level(&mut offs);
        (found.record().rounds, slow(&offs), within(&offs))
    };
    let [first, all] = [1, 3].map(by);
    println!("rounds, slow error, within: {first:.4?}, {all:.4?}");
    assert_eq!((first.0, all.0 > 1), (1, true));
    assert!(all.1 < 0.5 * first.1, "{first:?} {all:?}");
}
