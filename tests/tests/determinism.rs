//! The same bits for any number of threads, any split into passes, any pace; shards and single
//! walks are parts of the whole.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{sync::Arc, time::Duration};

use glam::Vec3;
use intrados_light::{
    Exposure, Film, LitScene, Measurement, Render, RenderSettings, Shard, Sides,
    plugin::{ActiveCamera, MeasureSettings},
    replay,
};
use intrados_scene::{Camera, LampKind, Scene, Surface, plugin::install};
use intrados_stage::{Pace, random::Key};
use intrados_tests::{
    Furnish, ball, camera, cuboid, lit, made_of, matt, meter, quad, sensors, shining,
};
use intrados_transport::{Estimator, Roulette, Side, WalkRule};

/// A bit of everything that walks can meet: glass, metal, smooth normals, an area lamp, a point
/// lamp, a sky.
fn scene() -> Scene {
    let mut scene = Scene { name: "everything".into(), ..Scene::default() };
    let metal = made_of(Surface::Metallic { metallic: 1.0, roughness: 0.4, texture: None });
    let glass = made_of(Surface::Dielectric { ior: 1.5, roughness: 0.0 });
    scene
        .put(quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::Z * 4.0, Vec3::X * 4.0), matt(0.6))
        .put(cuboid(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(-0.4, 0.6, -0.4)), metal)
        .put(cuboid(Vec3::new(0.5, 0.1, -0.2), Vec3::new(0.9, 0.5, 0.2)), glass)
        .put(ball(Vec3::new(0.0, 0.4, 0.8), 0.3, 8, true), matt(0.8))
        .put(quad(Vec3::new(-0.5, 2.0, -0.5), Vec3::X, Vec3::Z), shining(3.0))
        .light(LampKind::Point {
            position: Vec3::new(1.0, 1.5, 1.0),
            intensity: Vec3::new(1.0, 0.8, 0.5),
        })
        .light(LampKind::Environment { radiance: Vec3::new(0.1, 0.2, 0.4), image: None });
    scene.cameras.push(Camera {
        width: 40,
        height: 24,
        ..camera(Vec3::new(0.5, 1.2, 3.0), Vec3::new(0.0, 0.4, 0.0), 60.0)
    });
    scene.meters.push(meter("floor", Vec3::new(-0.2, 0.0, -0.2), Vec3::Z * 0.4, Vec3::X * 0.4));
    scene
}

fn settings() -> RenderSettings {
    RenderSettings { sides: Sides::Both, seed: 41, ..RenderSettings::default() }
}

/// All but how long it took.
fn untimed(mut exposure: Exposure) -> Exposure {
    exposure.cpu_seconds = 0.0;
    exposure
}

/// Everything about a picture but how long it took.
fn timeless(render: &Render) -> [Option<Exposure>; 2] {
    render.exposures().clone().map(|e| e.map(untimed))
}

fn render(lit: &Arc<LitScene>, settings: &RenderSettings, calls: &[u32]) -> Render {
    let mut render = Render::new(Arc::clone(lit), &lit.scene.cameras[0], settings);
    for &passes in calls {
        render.advance(passes);
    }
    render
}

#[test]
fn the_same_bits_with_any_number_of_threads() {
    let pictures = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let lit = lit(scene());
            let mut readings = Measurement::new(
                Arc::clone(&lit),
                sensors(&lit.scene),
                Sides::Both,
                WalkRule::default(),
                42,
                Shard::default(),
                None,
            );
            readings.advance_all(2);
            let readings: Vec<_> =
                readings.primal.iter().chain(&readings.dual).cloned().map(untimed).collect();
            (timeless(&render(&lit, &settings(), &[6])), readings)
        })
    });
    assert!(pictures[0].0[0].as_ref().is_some_and(|e| e.walks > 0));
    assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2], "threads change the bits");
}

#[test]
fn the_same_bits_however_the_passes_are_split() {
    let lit = lit(scene());
    for rule in [
        WalkRule::default(),
        WalkRule {
            roulette: Roulette::Weight,
            roulette_from: 2,
            max_order: 6,
            ..WalkRule::default()
        },
    ] {
        for sides in [Sides::Both, Sides::Primal, Sides::Dual] {
            let settings = RenderSettings { sides, rule, ..settings() };
            let whole = timeless(&render(&lit, &settings, &[8]));
            assert!(whole == timeless(&render(&lit, &settings, &[1; 8])), "8×1, {sides:?}");
            assert!(whole == timeless(&render(&lit, &settings, &[4, 4])), "2×4, {sides:?}");
            assert!(whole == timeless(&render(&lit, &settings, &[3, 1, 4])), "3+1+4, {sides:?}");
            assert!(
                whole != timeless(&render(&lit, &RenderSettings { seed: 5, ..settings }, &[8])),
                "the seed does nothing"
            );
        }
    }
}

/// A sample limit cuts the last pass at the same walk, whoever asks.
#[test]
fn a_limit_is_kept_to_the_walk() {
    let lit = lit(scene());
    let settings = RenderSettings { samples: Some(20), ..settings() };
    let mut long = render(&lit, &settings, &[100]);
    assert!(!long.advance(1));
    for side in Side::BOTH {
        assert_eq!(long.exposure(side).unwrap().walks, 20 * 40 * 24);
    }
    assert!(timeless(&long) == timeless(&render(&lit, &settings, &[1; 10])));
}

/// Steps end within passes, here after three of four batches, and make the same walks: mixed with
/// passes, stored and taken up again, to the end.
#[test]
fn steps_and_passes_make_the_same_bits() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    pool.install(|| {
        let lit = lit(scene());
        for sides in [Sides::Both, Sides::Primal, Sides::Dual] {
            let settings = RenderSettings { sides, samples: Some(130), ..settings() };
            let mut first = render(&lit, &settings, &[]);
            assert!(first.step() && first.step() && first.advance(3) && first.step());
            assert!(
                first.exposures().iter().flatten().any(|e| e.passes[0].batches > 0),
                "no pass is under way"
            );
            let stored = serde_json::to_string(first.plate()).unwrap();
            let mut resumed = render(&lit, &settings, &[]);
            resumed.restore(serde_json::from_str(&stored).unwrap()).unwrap();
            while resumed.step() {}
            assert!(timeless(&resumed) == timeless(&render(&lit, &settings, &[100])), "{sides:?}");
        }
        let measure = || {
            Measurement::new(
                Arc::clone(&lit),
                sensors(&lit.scene),
                Sides::Both,
                WalkRule::default(),
                42,
                Shard::default(),
                Some(130),
            )
        };
        let (mut steps, mut rounds) = (measure(), measure());
        while steps.step() {}
        while rounds.advance_all(8) {}
        let all = |m: &Measurement| {
            m.primal.iter().chain(&m.dual).cloned().map(untimed).collect::<Vec<_>>()
        };
        assert!(all(&steps) == all(&rounds), "readings");
    });
}

/// Three shards hold the walks of the whole, no other: they add up to it in any order, to the bit.
#[test]
fn shards_add_up_to_the_whole() {
    let lit = lit(scene());
    let sensors = sensors(&lit.scene);
    for side in Side::BOTH {
        let make = |index, of, passes| {
            let mut e = Exposure::new(
                &lit,
                &sensors,
                side,
                WalkRule::default(),
                43,
                Shard { index, of },
                u64::MAX,
                true,
            )
            .noting_reach();
            e.advance(&lit, &sensors, passes);
            e
        };
        let whole = make(0, 1, 12);
        let mut merged = make(0, 3, 4);
        merged.merge(&make(2, 3, 4)).unwrap();
        merged.merge(&make(1, 3, 4)).unwrap();
        assert!(
            merged.merge(&make(1, 3, 4)).is_err() && merged.merge(&whole).is_err(),
            "the same walks count once"
        );
        // But for who has walked which passes, and how long that took.
        let (mut merged, whole) = (untimed(merged), untimed(whole));
        merged.passes.clone_from(&whole.passes);
        assert!(merged == whole, "{side:?}");
    }
}

/// A stored accumulator goes on as if it had never been away.
#[test]
fn a_picture_goes_on_where_it_was_stored() {
    let lit = lit(scene());
    let first = render(&lit, &settings(), &[5]);
    let stored = serde_json::to_string(first.plate()).unwrap();
    let mut resumed = render(&lit, &settings(), &[]);
    resumed.restore(serde_json::from_str(&stored).unwrap()).unwrap();
    resumed.advance(4);
    assert!(timeless(&resumed) == timeless(&render(&lit, &settings(), &[9])));
    // Of another seed it is refused.
    assert!(
        render(&lit, &RenderSettings { seed: 7, ..settings() }, &[])
            .restore(first.plate().clone())
            .is_err()
    );
}

/// The application with the pace of a window and with that of a command: the same film after the
/// same number of passes.
#[test]
fn the_pace_decides_when_and_never_what() {
    let films =
        [Pace::Passes(3), Pace::Within(Duration::from_millis(2)), Pace::Passes(1)].map(|pace| {
            let mut app = intrados::simulation();
            app.insert_resource(RenderSettings { samples: Some(256), ..settings() });
            app.insert_resource(MeasureSettings { enabled: false, ..MeasureSettings::default() });
            install(app.world_mut(), scene());
            app.insert_resource(pace);
            let finished = |app: &bevy_app::App| {
                app.world().get_resource::<Render>().is_some_and(|r| r.done() >= 1.0)
            };
            for _ in 0..100_000 {
                app.update();
                if finished(&app) {
                    break;
                }
            }
            assert!(finished(&app), "{pace:?}");
            assert_eq!(app.world().resource::<ActiveCamera>().0.width, 40);
            timeless(app.world().resource::<Render>())
        });
    assert!(films[0] == films[1] && films[0] == films[2]);
    // And that of no application at all.
    let lit = lit(scene());
    assert!(
        films[0]
            == timeless(&render(
                &lit,
                &RenderSettings { samples: Some(256), ..settings() },
                &[1000]
            ))
    );
}

/// The walks of a pixel, replayed one by one, are the film's pixel: value, square and every order,
/// to the bit, where the film adds in the order of the walks.
#[test]
fn a_replayed_walk_is_what_went_into_the_film() {
    let lit = lit(scene());
    let camera = &lit.scene.cameras[0];
    for estimator in [Estimator::NextEvent, Estimator::Collision, Estimator::LastEvent] {
        let rule = WalkRule { estimator, ..WalkRule::default() };
        let settings =
            RenderSettings { rule, sides: Sides::Primal, samples: Some(24), ..settings() };
        let picture = render(&lit, &settings, &[100]);
        let film = picture.exposure(Side::Primal).unwrap().film.as_ref().unwrap();
        let mut lit_pixels = 0;
        for i in 0..60 {
            let (x, y) =
                (Key::new(44, i).bits(0) % camera.width, Key::new(44, i).bits(1) % camera.height);
            let mut sum = [0.0_f64; 3];
            for sample in 0..24 {
                let mut value = Vec3::ZERO;
                for score in
                    replay(&lit, camera, Side::Primal, &rule, settings.seed, [x, y], sample)
                {
                    assert_eq!(score.pixel, y * camera.width + x);
                    value += Vec3::from(score.value);
                }
                sum.iter_mut().zip(value.to_array()).for_each(|(s, x)| *s += f64::from(x));
            }
            let mean = Vec3::from(sum.map(|s| (s / 24.0) as f32));
            assert_eq!(
                film.mean((y * camera.width + x) as usize),
                mean,
                "pixel {x}, {y}, {estimator:?}"
            );
            lit_pixels += u32::from(mean != Vec3::ZERO);
        }
        assert!(lit_pixels > 10, "the picture is dark");
    }
}

/// All dual walks, replayed, are the dual film.
#[test]
fn replayed_dual_walks_are_the_dual_film() {
    let lit = lit(scene());
    let camera = Camera { width: 8, height: 6, ..lit.scene.cameras[0].clone() };
    let settings = RenderSettings { sides: Sides::Dual, samples: Some(64), ..settings() };
    let mut picture = Render::new(Arc::clone(&lit), &camera, &settings);
    picture.advance(1000);
    let film: &Film = picture.exposure(Side::Dual).unwrap().film.as_ref().unwrap();
    let walks = 64 * 48;
    let mut sums = vec![[0.0_f64; 3]; 48];
    for walk in 0..walks {
        for score in replay(&lit, &camera, Side::Dual, &settings.rule, settings.seed, [0, 0], walk)
        {
            let pixel = &mut sums[score.pixel as usize];
            pixel.iter_mut().zip(score.value).for_each(|(s, x)| *s += f64::from(x));
        }
    }
    assert_eq!(film.walks(), walks);
    for (pixel, sum) in sums.iter().enumerate() {
        let mean = Vec3::from(sum.map(|s| (s / walks as f64) as f32));
        // Several scores of one walk in one pixel are added as f32 before they count.
        assert!(
            (film.mean(pixel) - mean).abs().max_element() <= 1e-6 * mean.max_element(),
            "pixel {pixel}"
        );
    }
    assert!(sums.iter().filter(|s| s[1] > 0.0).count() > 40);
}
