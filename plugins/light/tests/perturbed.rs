//! What stains do to pixels and meters: against full solutions of really stained scenes, against
//! radiosity, and from both sides.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::Arc;

use glam::Vec3;
use intrados_light::{
    Extent, LightProblem, LitScene, Sensor, Stain, StainedLight, learn,
    radiosity::{Goal, Quad, Radiosity},
};
use intrados_scene::{Camera, Scene};
use intrados_stage::Job;
use intrados_transport::{
    Perturbed, Schedule, Sensitivities, Side, Steering, WalkRule, measure, remainders,
};

fn scene(name: &str) -> Scene {
    Scene::load_bundled(name, &Job::default()).unwrap()
}

fn lit(scene: Scene) -> LitScene {
    LitScene::build(Arc::new(scene), &Job::default()).unwrap()
}

fn object(scene: &Scene, name: &str) -> usize {
    scene.objects.iter().position(|o| o.name == name).unwrap()
}

fn small(camera: &Camera, [width, height]: [u32; 2]) -> Sensor {
    Sensor::Camera(Camera { width, height, ..camera.clone() })
}

/// The mean over a picture, by damage, with the standard error: pixels have walks of their own.
fn mean(of: &Sensitivities) -> Vec<[f64; 2]> {
    let n = of.readings.len() as f64;
    let column = |k: usize| {
        let sum: f64 = of.by_damage.iter().map(|row| row[k]).sum();
        let squares: f64 = of.errors.iter().map(|row| row[k].powi(2)).sum();
        [sum / n, squares.sqrt() / n]
    };
    (0..of.by_damage[0].len()).map(column).collect()
}

/// Column C4 of `column`: its spall, its crack as a band of 20 mm, and the floor.
fn stains(scene: &Scene) -> Vec<Stain> {
    let c4: Vec<usize> = (0..scene.objects.len())
        .filter(|&i| scene.objects[i].member.is_some_and(|m| scene.members[m].id == "C4"))
        .collect();
    let member = scene.members.iter().find(|m| m.id == "C4").unwrap();
    let side = member.frame.radial(90.0);
    let block = Extent::Block {
        centre: member.frame.point(0.25) + 0.2 * side,
        half: [Vec3::Y * 0.01, Vec3::Z * 0.25, Vec3::X * 0.1],
    };
    let ball = Extent::Ball { centre: member.frame.point(0.12) + 0.2 * side, radius: 0.15 };
    vec![
        Stain { objects: c4.clone(), extent: ball, share: 0.8 },
        Stain { objects: c4, extent: block, share: 0.5 },
        Stain { objects: vec![object(scene, "floor slab")], extent: Extent::All, share: 0.4 },
    ]
}

/// The same walks at d, d + δv and d + δ/2 v: the remainder falls to a quarter in every pixel of a
/// real scene where light comes more than once to the stains, and at its meters, from both sides.
#[test]
fn remainders_fall_as_the_square() {
    let scene = scene("column");
    let camera = small(scene.cameras.iter().find(|c| c.name == "C4 foot").unwrap(), [12, 12]);
    let stains = stains(&scene);
    let sensors = |side| {
        if side == Side::Primal {
            vec![camera.clone()]
        } else {
            scene.meters.iter().cloned().map(Sensor::Meter).collect()
        }
    };
    let lit = lit(scene.clone());
    for (side, walks) in [(Side::Primal, 64), (Side::Dual, 100_000)] {
        let mut problem = StainedLight {
            side,
            ..StainedLight::new(&lit, sensors(side), stains.clone(), walks, 3)
        };
        let (at, towards) = ([0.2, 0.1, 0.3], [1.0, 0.6, 0.8]);
        let readings = problem.readings(&at).unwrap();
        let errors = remainders(&mut problem, &at, &towards, 0.2).unwrap();
        let mut judged = 0;
        for (reading, [large, small]) in readings.iter().zip(&errors) {
            if large.abs() > 3e-6 * reading {
                judged += 1;
                assert!(
                    (large / small - 4.0).abs() < 0.1,
                    "{side:?}: {large:e} {small:e} of {reading}"
                );
            }
        }
        eprintln!("{side:?}: {judged} of {} readings curve; {:?}", readings.len(), errors[0]);
        assert!(4 * judged > readings.len());
    }
}

/// A box of another grey in the file: the walks are the same (no roulette), and what they bring to
/// the picture and to the meters are the readings by the sound scene's, to the rounding of `f32`.
#[test]
fn a_stain_is_another_material() {
    let (sound, damage) = (scene("cornell"), 0.35);
    let boxed = object(&sound, "large box");
    let mut painted = sound.clone();
    let mut material = painted.materials[painted.objects[boxed].material].clone();
    material.base_colour *= 1.0 - damage as f32;
    painted.objects[boxed].material = painted.materials.len();
    painted.materials.push(material);
    let (camera, meter) =
        (small(&sound.cameras[0], [32, 32]), Sensor::Meter(sound.meters[0].clone()));
    let [sound, painted] = [sound, painted].map(lit);
    let rule = WalkRule { max_order: 5, roulette_from: u32::MAX, ..WalkRule::default() };
    let stain = Stain { objects: vec![boxed], extent: Extent::All, share: 1.0 };
    for (side, sensor, walks) in [
        (Side::Primal, &camera, 8),
        (Side::Primal, &meter, 8192),
        (Side::Dual, &camera, 8192),
        (Side::Dual, &meter, 8192),
    ] {
        let sensors = [sensor.clone()];
        let mut problem = StainedLight {
            side,
            rule,
            ..StainedLight::new(&sound, sensors.to_vec(), vec![stain.clone()], walks, 7)
        };
        let [before, found] = [0.0, damage].map(|d| problem.readings(&[d]).unwrap());
        let n = if side == Side::Primal { found.len() as f64 } else { 1.0 };
        let [before, found] = [before, found].map(|r| r.iter().sum::<f64>() / n);
        let all = if side == Side::Primal { walks * n as u64 } else { walks };
        let truth = measure(&LightProblem::new(&painted, &sensors), side, &rule, 7, 0..all).mean();
        eprintln!(
            "{side:?} {}: {before} sound, {found} by reweighing, {truth} painted",
            sensor.name()
        );
        assert!(
            (found / truth - 1.0).abs() < 2e-6 && (before / truth - 1.0).abs() > 1e-3,
            "{side:?}: {before} {found} {truth}"
        );
    }
}

/// The room's quads, its floor cut in two at x = .2.
fn quads(scene: &Scene) -> Vec<Quad> {
    let mut quads = Vec::new();
    for object in &scene.objects {
        let (mesh, material) = (&scene.meshes[object.mesh], &scene.materials[object.material]);
        let [a, b, c] = mesh.corners(0).map(|p| object.transform.transform_point3(p));
        let albedo =
            if material.emission == Vec3::ZERO { material.base_colour } else { Vec3::ZERO };
        quads.push(Quad { corner: a, u: b - a, v: c - b, albedo, emission: material.emission });
    }
    let floor =
        quads.iter_mut().find(|q| q.corner.y == 0.0 && (q.corner + q.u + q.v).y == 0.0).unwrap();
    let (whole, along) = (*floor, if floor.u.x.abs() > 1.0 { 0 } else { 1 });
    let part = |from: f32, to: f32| match along {
        0 => Quad { corner: whole.corner + from * whole.u, u: (to - from) * whole.u, ..whole },
        _ => Quad { corner: whole.corner + from * whole.v, v: (to - from) * whole.v, ..whole },
    };
    *floor = part(0.6, 1.0);
    quads.insert(0, part(0.0, 0.6));
    quads
}

/// Walks against radiosity, which has no random numbers: δI of the room's picture by a stain on a
/// part of the floor and by one on a wall, plain and steered. Radiosity by differences of fourth
/// order on the same mesh. Within 4 standard errors and the .5 % of radiosity; standard errors
/// below .7 %: an error of 3.5 % cannot pass.
#[test]
fn walks_agree_with_radiosity() {
    let scene = scene("room");
    let (all, camera) = (quads(&scene), scene.cameras[0].clone());
    let lit = lit(scene.clone());
    let floor = Extent::Block {
        centre: Vec3::new(-0.4, 0.0, 0.0),
        half: [Vec3::X * 0.6, Vec3::Y * 0.01, Vec3::Z * 2.0],
    };
    let stains = vec![
        Stain { objects: vec![object(&scene, "floor")], extent: floor, share: 1.0 },
        Stain { objects: vec![object(&scene, "wall -x")], extent: Extent::All, share: 1.0 },
    ];
    let wall =
        all.iter().position(|q| q.corner.x == -1.0 && (q.corner + q.u + q.v).x == -1.0).unwrap();
    let exact = [0, wall].map(|quad| {
        let reading = |d: f32| {
            let mut quads = all.clone();
            quads[quad].albedo *= 1.0 - d;
            Radiosity::solve(quads, &camera, Goal { error: 0.0, patches: 600 }, &Job::default())
                .unwrap()
                .camera_mean()
                .value
        };
        let slope = |d: f32| (reading(d) - reading(-d)) / f64::from(2.0 * d);
        let slopes = [slope(0.2), slope(0.4)];
        eprintln!("radiosity: {slopes:?}");
        (4.0 * slopes[0] - slopes[1]) / 3.0
    });
    let guide = learn(
        &lit,
        &[Sensor::Camera(camera.clone())],
        WalkRule::default(),
        1,
        Steering::On,
        Schedule { first: 8192, rounds: 3 },
        &Job::default(),
    );
    let guide = guide.unwrap();
    for (guide, walks) in [(None, 512), (Some(&guide), 128)] {
        let mut problem = StainedLight {
            guide,
            ..StainedLight::new(
                &lit,
                vec![Sensor::Camera(camera.clone())],
                stains.clone(),
                walks,
                5,
            )
        };
        let found = problem.sensitivities(&[0.0; 2]).unwrap();
        for (k, ([slope, error], exact)) in mean(&found).into_iter().zip(exact).enumerate() {
            eprintln!(
                "steered {}, stain {k}: {slope:.6} +- {error:.6}, radiosity {exact:.6}",
                guide.is_some()
            );
            assert!(
                (slope - exact).abs() < 4.0 * error + 0.005 * exact.abs()
                    && error < 0.007 * exact.abs()
            );
        }
    }
}

/// The certificate: what stains do to the meters of `cornell`, found from the meters and from the
/// lamp. Six numbers within 4 standard errors of each other (one false alarm in 2600), of less than
/// 3 %.
#[test]
fn both_sides_agree() {
    let scene = scene("cornell");
    let stain = |objects, extent| Stain { objects, extent, share: 0.9 };
    let stains = vec![
        stain(vec![object(&scene, "large box")], Extent::All),
        stain(
            vec![object(&scene, "red wall")],
            Extent::Block {
                centre: Vec3::new(-1.0, -0.5, 0.4),
                half: [Vec3::Y * 0.4, Vec3::Z * 0.6, Vec3::X * 0.1],
            },
        ),
        stain(vec![], Extent::Ball { centre: Vec3::new(0.2, 1.0, 0.5), radius: 0.6 }),
    ];
    let meters: Vec<Sensor> = scene.meters.iter().cloned().map(Sensor::Meter).collect();
    let rule = intrados_light::scene_rule(&scene);
    let lit = lit(scene);
    let [primal, dual] = [(Side::Primal, 500_000), (Side::Dual, 1_000_000)].map(|(side, walks)| {
        StainedLight {
            side,
            rule,
            ..StainedLight::new(&lit, meters.clone(), stains.clone(), walks, 9)
        }
        .sensitivities(&[0.0, 0.2, 0.1])
        .unwrap()
    });
    for (i, (a, b)) in primal.by_damage.iter().zip(&dual.by_damage).enumerate() {
        for (k, (a, b)) in a.iter().zip(b).enumerate() {
            let errors = [primal.errors[i][k], dual.errors[i][k]];
            eprintln!(
                "{}, stain {k}: {a:.4e} +- {:.1e}, {b:.4e} +- {:.1e}",
                meters[i].name(),
                errors[0],
                errors[1]
            );
            let error = errors[0].hypot(errors[1]);
            assert!(
                (a - b).abs() < 4.0 * error && error < 0.03 * a.abs(),
                "{a:e} {b:e} +- {error:e}"
            );
        }
    }
}
