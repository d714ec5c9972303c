//! Meshes and rays that tests and benchmarks share.

use std::f32::consts::TAU;

use glam::{Quat, Vec3, vec3};
use intrados_scene::tracer::{Hit, Ray, Scratch, Tracer};
use intrados_stage::random::Key;

/// Three corners.
pub(crate) type Triangle = [Vec3; 3];

/// Uniform on the unit sphere, from two numbers in [0, 1).
pub(crate) fn sphere([a, b]: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * a;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (b * TAU).sin_cos();
    vec3(r * c, r * s, z)
}

/// A closed bumpy torus of 2·m·n triangles that share exact vertices: a tunnel of radius 2 m bent
/// to a ring of radius 10 m.
pub(crate) fn tunnel(m: usize, n: usize) -> Vec<Triangle> {
    let p = |i: usize, j: usize| {
        let a = (i % m) as f32 / m as f32 * TAU;
        let b = (j % n) as f32 / n as f32 * TAU;
        let r =
            2.0 + 0.15 * (37.0 * a).sin() * (9.0 * b).cos() + 0.05 * (151.0 * a + 31.0 * b).sin();
        let q = 10.0 + r * b.cos();
        vec3(q * a.cos(), r * b.sin(), q * a.sin())
    };
    let quad = |k: usize| {
        let (i, j) = (k / n, k % n);
        let (a, b, c, d) = (p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
        [[a, b, c], [a, c, d]]
    };
    (0..m * n).flat_map(quad).collect()
}

/// Rays inside the tunnel, in all directions, from around its axis.
pub(crate) fn tunnel_rays(count: u64) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let key = Key::new(7, i);
            let (s, c) = (key.unit(0) * TAU).sin_cos();
            let origin = vec3(10.0 * c, 0.0, 10.0 * s) + sphere(key.pair(1)) * (key.unit(3) * 1.2);
            Ray::new(origin, sphere(key.pair(4)), f32::INFINITY)
        })
        .collect()
}

/// Rays inside the tunnel at vertices and at midpoints of edges: three a triangle. Each must hit.
pub(crate) fn aimed_rays(triangles: &[Triangle]) -> Vec<Ray> {
    let aim = |t: &Triangle| {
        let origin = vec3(t[0].x, 0.0, t[0].z).normalize() * 10.0 + vec3(0.1, 0.05, -0.07);
        [t[0], 0.5 * (t[0] + t[1]), 0.5 * (t[0] + t[2])]
            .map(|p| Ray::new(origin, (p - origin).normalize(), f32::INFINITY))
    };
    triangles.iter().flat_map(aim).collect()
}

fn quad(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> [Triangle; 2] {
    [[a, b, c], [a, c, d]]
}

/// The twelve triangles of a block with half sides `half`, turned by `turn` about y.
pub(crate) fn block(centre: Vec3, half: Vec3, turn: f32) -> Vec<Triangle> {
    let corner = |i: usize| {
        let sign = vec3((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - Vec3::ONE;
        centre + Quat::from_rotation_y(turn) * (sign * half)
    };
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        .into_iter()
        .flat_map(|[a, b, c, d]| quad(corner(a), corner(b), corner(c), corner(d)))
        .collect()
}

/// A room of side 2 m, open in front, with a lamp and two blocks: 36 triangles.
pub(crate) fn room() -> Vec<Triangle> {
    let at = |x: f32, y: f32, z: f32| vec3(x, y, z);
    let mut all = Vec::new();
    all.extend(quad(
        at(-1.0, -1.0, -1.0),
        at(-1.0, -1.0, 1.0),
        at(1.0, -1.0, 1.0),
        at(1.0, -1.0, -1.0),
    ));
    all.extend(quad(
        at(-1.0, 1.0, -1.0),
        at(-1.0, 1.0, 1.0),
        at(1.0, 1.0, 1.0),
        at(1.0, 1.0, -1.0),
    ));
    all.extend(quad(
        at(-1.0, -1.0, -1.0),
        at(1.0, -1.0, -1.0),
        at(1.0, 1.0, -1.0),
        at(-1.0, 1.0, -1.0),
    ));
    all.extend(quad(
        at(-1.0, -1.0, -1.0),
        at(-1.0, 1.0, -1.0),
        at(-1.0, 1.0, 1.0),
        at(-1.0, -1.0, 1.0),
    ));
    all.extend(quad(
        at(1.0, -1.0, -1.0),
        at(1.0, 1.0, -1.0),
        at(1.0, 1.0, 1.0),
        at(1.0, -1.0, 1.0),
    ));
    all.extend(quad(
        at(-0.23, 0.99, -0.2),
        at(-0.23, 0.99, 0.2),
        at(0.23, 0.99, 0.2),
        at(0.23, 0.99, -0.2),
    ));
    all.extend(block(vec3(-0.33, -0.4, -0.28), vec3(0.3, 0.6, 0.3), 0.3));
    all.extend(block(vec3(0.33, -0.7, 0.38), vec3(0.3, 0.3, 0.3), -0.3));
    all
}

/// Each triangle cut into `k`² alike.
pub(crate) fn cut(triangles: &[Triangle], k: usize) -> Vec<Triangle> {
    let n = k as f32;
    let piece = |t: &Triangle| {
        let [a, b, c] = *t;
        let at = move |i: usize, j: usize| a + (b - a) * (i as f32 / n) + (c - a) * (j as f32 / n);
        let rows = (0..k).flat_map(move |i| (0..k - i).map(move |j| (i, j)));
        rows.flat_map(move |(i, j)| {
            let up = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let down = (i + j + 2 <= k).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            std::iter::once(up).chain(down)
        })
        .collect::<Vec<_>>()
    };
    triangles.iter().flat_map(piece).collect()
}

/// The rays of walks through the room: from a camera in front, then diffusely from wall to wall, to
/// depth 8; and from each hit a segment to the lamp.
pub(crate) fn room_rays(walks: u64) -> (Vec<Ray>, Vec<Ray>) {
    let triangles = room();
    let (tracer, mut scratch) = (Tracer::build(&triangles), Scratch::default());
    let mut rays: Vec<(u64, Ray)> = (0..walks)
        .map(|i| {
            let [x, y] = Key::new(1, i).pair(0);
            (
                i,
                Ray::new(
                    vec3(0.0, 0.0, 3.9),
                    vec3(0.72 * x - 0.36, 0.72 * y - 0.36, -1.0).normalize(),
                    f32::INFINITY,
                ),
            )
        })
        .collect();
    let (mut closest, mut segments) = (Vec::new(), Vec::new());
    for depth in 1..8 {
        let batch: Vec<Ray> = rays.iter().map(|r| r.1).collect();
        let mut hits = vec![Hit::MISS; batch.len()];
        tracer.closest(&batch, &mut hits, &mut scratch);
        closest.extend(&batch);
        rays = rays
            .iter()
            .zip(&hits)
            .filter(|(_, hit)| hit.is_hit() && !(10..12).contains(&hit.triangle))
            .map(|(&(i, ray), hit)| {
                let key = Key::new(2, i);
                let d = Vec3::from(ray.direction);
                let [a, b, c] = triangles[hit.triangle as usize];
                let n = (b - a).cross(c - a).normalize();
                let n = if n.dot(d) > 0.0 { -n } else { n };
                let p = Vec3::from(ray.origin) + d * hit.t + n * 1e-4;
                let [u, v] = key.pair(8 * depth);
                let q = vec3(0.46 * u - 0.23, 0.99, 0.4 * v - 0.2);
                if n.dot(q - p) > 0.0 && q.y > p.y {
                    segments.push(Ray::new(p, q - p, 0.9999));
                }
                (
                    i,
                    Ray::new(
                        p,
                        (n + sphere(key.pair(8 * depth + 2)) * 0.9999).normalize(),
                        f32::INFINITY,
                    ),
                )
            })
            .filter(|(i, _)| depth < 4 || Key::new(3, *i).unit(depth) < 0.6)
            .collect();
    }
    (closest, segments)
}
