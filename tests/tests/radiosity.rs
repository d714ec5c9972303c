//! Radiosity against Monte Carlo on the transport test set: no random numbers, no tracer, nothing
//! in common but the scene files.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::time::Instant;

use glam::Vec3;
use intrados_light::radiosity::{Goal, Quad, Radiosity};
use intrados_scene::Scene;
use intrados_stage::Job;

/// What steered and plain walks of another program found, with the standard error: camera means,
/// W·m⁻²·sr⁻¹. In `maze` that program's 6.9138e-7 ± .067 % was two standard errors above 6.9039e-7
/// ± .026 %, 1.0e8 steered walks of this one from both sides; radiosity sided with the latter.
const WALKS: [(&str, f64, f64); 5] = [
    ("room", 0.270_228, 1.8e-4),
    ("corridor", 1.302_11e-2, 3e-4),
    ("slit", 2.060_99e-3, 4.2e-4),
    ("door", 4.809_27e-4, 2.9e-4),
    ("maze", 6.903_90e-7, 2.6e-4),
];

/// The quads of a scene: a wall is seen from both sides, so it is two; a lamp is black and shines
/// in front.
fn quads(scene: &Scene) -> Vec<Quad> {
    let mut quads = Vec::new();
    for object in &scene.objects {
        let (mesh, material) = (&scene.meshes[object.mesh], &scene.materials[object.material]);
        let [a, b, c] = mesh.corners(0).map(|p| object.transform.transform_point3(p));
        // Of a parallelogram in two triangles the first has the two edges at its middle corner.
        let (u, v) = (b - a, c - b);
        let size: f64 =
            (0..mesh.triangles.len()).map(|_| f64::from(0.5 * u.cross(v).length())).sum();
        assert!(
            mesh.triangles.len() == 2 && (size / mesh.area() - 1.0).abs() < 1e-5,
            "{} is no parallelogram",
            object.name
        );
        if material.emission == Vec3::ZERO {
            quads.push(Quad {
                corner: a,
                u,
                v,
                albedo: material.base_colour,
                emission: Vec3::ZERO,
            });
            quads.push(Quad {
                corner: a,
                u: v,
                v: u,
                albedo: material.base_colour,
                emission: Vec3::ZERO,
            });
        } else {
            quads.push(Quad { corner: a, u, v, albedo: Vec3::ZERO, emission: material.emission });
        }
    }
    quads
}

/// Solves all scenes. The finest mesh must reach `error` and agree with the walks within its own
/// error and three standard errors of theirs; each coarser one, first apart, must agree with the
/// finest within their two errors: they mean something.
fn judge(error: f64, goal: Goal) {
    for (name, walks, walks_error) in WALKS {
        let start = Instant::now();
        let scene = Scene::load_bundled(name, &Job::default()).unwrap();
        let solved =
            Radiosity::solve(quads(&scene), &scene.cameras[0], goal, &Job::default()).unwrap();
        let mean = solved.camera_mean();
        for l in solved.levels() {
            eprintln!(
                "{name}: {:6} patches, {:9} links: seen {:.5e}, sent {:.5e}, corrected by {:+.3} %, mean {:.5e} ± {:.3} %",
                l.patches,
                l.links,
                l.seen,
                l.sent,
                100.0 * l.correction / l.mean.value,
                l.mean.value,
                100.0 * l.mean.error / l.mean.value
            );
            assert!(
                (l.mean.value - mean.value).abs() <= l.mean.error + mean.error,
                "{name}: {l:?} against {mean:?}"
            );
        }
        let (own, off) = (mean.error / mean.value, mean.value / walks - 1.0);
        eprintln!(
            "{name}: radiosity {:.5e} ± {:.3} %, walks {walks:.5e} ± {:.3} %, apart {:+.3} %; {:.1} s",
            mean.value,
            100.0 * own,
            100.0 * walks_error,
            100.0 * off,
            start.elapsed().as_secs_f64()
        );
        assert!(own <= error, "{name}: {mean:?}");
        assert!(off.abs() <= own + 3.0 * walks_error, "{name}: {mean:?}, walks {walks}");
    }
}

#[test]
fn radiosity_agrees_with_walks() {
    judge(5e-3, Goal { error: 5e-3, patches: 4000 });
}

/// `cargo test --release -p intrados-tests --test radiosity -- --ignored --nocapture`.
#[test]
#[ignore = "three and a half CPU-minutes, 1.5 GiB"]
fn to_two_tenths_of_a_per_cent() {
    judge(2e-3, Goal { error: 0.0, patches: 13_000 });
}
