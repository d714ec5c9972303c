//! Light walks: `cargo bench -p intrados-light`.
//!
//! First a table of million samples per CPU-second, which a busy machine disturbs little, with the
//! mean radiance that the picture must have (Mitsuba 3 at 512 samples a pixel: .14706; depth 8,
//! roulette from event 5 by the weight, as there). Then divan's wall-clock figures.
#![allow(clippy::print_stdout, reason = "a bench reports")]

use std::sync::Arc;

use divan::{Bencher, counter::ItemsCount};
use glam::Vec3;
use intrados_light::{Exposure, LitScene, PASS, Sensor, Shard};
use intrados_scene::{Mesh, Scene};
use intrados_stage::Job;
use intrados_transport::{Roulette, Side, WalkRule};

/// Cuts of an edge that make 104 976 triangles of the box's 36.
const CUTS: u32 = 54;

const SIDES: [(&str, Side); 2] = [("path", Side::Primal), ("light", Side::Dual)];

fn main() {
    println!("cornell, 256 x 256, depth 8     Msamples per CPU-s   mean radiance");
    for cuts in [1, CUTS] {
        let (lit, sensors) = cornell(cuts);
        for (name, side) in SIDES {
            let mut best = 0.0_f64;
            let mut exposure = exposure(&lit, &sensors, side);
            for _ in 0..5 {
                let (walks, seconds) = (exposure.walks, exposure.cpu_seconds);
                exposure.advance(&lit, &sensors, 64);
                best = best
                    .max((exposure.walks - walks) as f64 / (exposure.cpu_seconds - seconds) / 1e6);
            }
            println!(
                "{:>7} triangles {name:>8} tracing {best:>14.2} {:>18.5}",
                lit.triangle_count(),
                mean(&exposure)
            );
        }
    }
    divan::main();
}

/// The box, each triangle cut into `cuts`².
fn cornell(cuts: u32) -> (LitScene, [Sensor; 1]) {
    let mut scene =
        Scene::load_bundled("cornell", &Job::default()).expect("it comes with the program");
    for mesh in &mut scene.meshes {
        *mesh = Arc::new(cut(mesh, cuts));
    }
    let sensors = [Sensor::Camera(scene.cameras[0].clone())];
    (LitScene::build(Arc::new(scene), &Job::default()).expect("nobody cancels it"), sensors)
}

/// Each triangle as n² smaller ones of its own vertices.
fn cut(mesh: &Mesh, n: u32) -> Mesh {
    let mut fine = Mesh::default();
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let first = fine.positions.len() as u32;
        let at = |i: u32, j: u32| first + i * (i + 1) / 2 + j;
        for i in 0..=n {
            fine.positions.extend((0..=i).map(|j| {
                a + (b - a) * ((i - j) as f32 / n as f32) + (c - a) * (j as f32 / n as f32)
            }));
        }
        for i in 0..n {
            fine.triangles.extend((0..=i).map(|j| [at(i, j), at(i + 1, j), at(i + 1, j + 1)]));
            fine.triangles.extend((0..i).map(|j| [at(i, j), at(i + 1, j + 1), at(i, j + 1)]));
        }
    }
    fine
}

fn exposure(lit: &LitScene, sensors: &[Sensor], side: Side) -> Exposure {
    let rule = WalkRule {
        max_order: 8,
        roulette_from: 5,
        roulette: Roulette::Weight,
        ..WalkRule::default()
    };
    Exposure::new(lit, sensors, side, rule, 1, Shard::default(), u64::MAX, false)
}

/// Over all pixels and channels.
fn mean(exposure: &Exposure) -> f64 {
    let Some(film) = &exposure.film else { return 0.0 };
    (0..film.len())
        .map(|pixel| f64::from(film.mean(pixel).dot(Vec3::splat(1.0 / 3.0))))
        .sum::<f64>()
        / film.len() as f64
}

#[divan::bench(args = [1, CUTS], sample_count = 5)]
fn path_tracing(bencher: Bencher, cuts: u32) {
    walks(bencher, Side::Primal, cuts);
}

#[divan::bench(args = [1, CUTS], sample_count = 5)]
fn light_tracing(bencher: Bencher, cuts: u32) {
    walks(bencher, Side::Dual, cuts);
}

fn walks(bencher: Bencher, side: Side, cuts: u32) {
    let (lit, sensors) = cornell(cuts);
    let mut exposure = exposure(&lit, &sensors, side);
    bencher
        .counter(ItemsCount::new(16 * PASS))
        .bench_local(|| exposure.advance(&lit, &sensors, 16));
}
