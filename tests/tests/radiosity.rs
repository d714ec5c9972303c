//! Radiosity against Monte Carlo on the transport test set: no random numbers, no tracer, no code in common but the scene files.
//! The references are what walks of several programs agree on within ± .1 %.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::time::Instant;

use glam::Vec3;
use intrados_light::radiosity::{Goal, Quad, Radiosity};
use intrados_scene::Scene;
use intrados_stage::Job;

/// The quads of a scene: a wall is seen from both sides, so it is two; a lamp is black and shines in front.
fn quads(scene: &Scene) -> Vec<Quad> {
    let mut quads = Vec::new();
    for object in &scene.objects {
        let (mesh, material) = (&scene.meshes[object.mesh], &scene.materials[object.material]);
        let [a, b, c] = mesh.corners(0).map(|p| object.transform.transform_point3(p));
        // Of a parallelogram in two triangles the first has the two edges at its middle corner.
        let (u, v) = (b - a, c - b);
        let size: f64 = (0..mesh.triangles.len()).map(|_| f64::from(0.5 * u.cross(v).length())).sum();
        assert!(mesh.triangles.len() == 2 && (size / mesh.area() - 1.0).abs() < 1e-5, "{} is no parallelogram", object.name);
        if material.emission == Vec3::ZERO {
            quads.push(Quad { corner: a, u, v, albedo: material.base_colour, emission: Vec3::ZERO });
            quads.push(Quad { corner: a, u: v, v: u, albedo: material.base_colour, emission: Vec3::ZERO });
        } else {
            quads.push(Quad { corner: a, u, v, albedo: Vec3::ZERO, emission: material.emission });
        }
    }
    quads
}

fn solve(name: &str, reference: f64, goal: Goal) {
    let start = Instant::now();
    let scene = Scene::load_bundled(name, &Job::default()).unwrap();
    let quads = quads(&scene);
    let solved = Radiosity::solve(&quads, &scene.cameras[0], goal);
    for l in solved.levels() {
        eprintln!(
            "{name}: {:6} patches, {:9} links: seen {:.6e} ({:+.3} %), sent {:.6e} ({:+.3} %), correction {:.3} %",
            l.patches,
            l.links,
            l.seen,
            100.0 * (l.seen / reference - 1.0),
            l.sent,
            100.0 * (l.sent / reference - 1.0),
            100.0 * l.correction / reference
        );
    }
    let mean = solved.camera_mean();
    eprintln!(
        "{name}: radiosity {:.6e} ± {:.1e} ({:.2} %), walks {reference:.6e}, off {:+.3} %, {:.1} s",
        mean.value,
        mean.error,
        100.0 * mean.error / mean.value,
        100.0 * (mean.value / reference - 1.0),
        start.elapsed().as_secs_f64()
    );
}

#[test]
fn try_all() {
    let most: usize = std::env::var("MOST").map_or(3000, |m| m.parse().unwrap());
    for (name, reference) in [("room", 0.270_23), ("corridor", 1.3021e-2), ("slit", 2.0610e-3), ("door", 4.809e-4), ("maze", 6.914e-7)] {
        solve(name, reference, Goal { error: 0.0, patches: most });
    }
}
