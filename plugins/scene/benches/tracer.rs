//! Rays per second on one thread: `cargo bench -p intrados-scene`. A ray is an item; look at the
//! fastest column on a shared machine.

#[path = "../tests/shapes/mod.rs"]
mod shapes;

use divan::{Bencher, black_box, counter::ItemsCount};
use intrados_scene::tracer::{Hit, Kernel, Ray, Scratch, Tracer};

fn main() {
    divan::main();
}

/// Rays a batch: what a path tracer has in flight.
const BATCH: usize = 4096;

fn closest(bencher: Bencher, tracer: &Tracer, rays: &[Ray]) {
    let (mut hits, mut scratch) = ([Hit::MISS; BATCH], Scratch::default());
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        for batch in rays.chunks(BATCH) {
            tracer.closest(batch, &mut hits[..batch.len()], &mut scratch);
            black_box(&hits);
        }
    });
}

fn any(bencher: Bencher, tracer: &Tracer, rays: &[Ray]) {
    let (mut blocked, mut scratch) = ([false; BATCH], Scratch::default());
    bencher.counter(ItemsCount::new(rays.len())).bench_local(|| {
        for batch in rays.chunks(BATCH) {
            tracer.any(batch, &mut blocked[..batch.len()], &mut scratch);
            black_box(&blocked);
        }
    });
}

/// Incoherent rays in 100 000 triangles.
mod tunnel {
    use super::*;

    const RAYS: u64 = 100_000;

    #[divan::bench(sample_count = 20)]
    fn closest(bencher: Bencher) {
        super::closest(
            bencher,
            &Tracer::build(&shapes::tunnel(500, 100)),
            &shapes::tunnel_rays(RAYS),
        );
    }

    #[divan::bench(sample_count = 20)]
    fn any(bencher: Bencher) {
        super::any(bencher, &Tracer::build(&shapes::tunnel(500, 100)), &shapes::tunnel_rays(RAYS));
    }

    #[divan::bench(sample_count = 10)]
    fn aimed(bencher: Bencher) {
        let triangles = shapes::tunnel(500, 100);
        super::closest(bencher, &Tracer::build(&triangles), &shapes::aimed_rays(&triangles));
    }

    #[divan::bench(sample_count = 10)]
    fn build(bencher: Bencher) {
        let triangles = shapes::tunnel(500, 100);
        bencher.counter(ItemsCount::new(triangles.len())).bench_local(|| Tracer::build(&triangles));
    }
}

/// The rays of diffuse walks in a room, each edge cut into so many: 36·k² triangles.
mod room {
    use super::*;

    const WALKS: u64 = 1 << 14;
    const CUTS: [usize; 5] = [1, 2, 4, 8, 54];

    #[divan::bench(sample_count = 20, args = CUTS, consts = [true, false])]
    fn closest<const PACKETS: bool>(bencher: Bencher, cut: usize) {
        super::closest(bencher, &build::<PACKETS>(cut), &shapes::room_rays(WALKS).0);
    }

    #[divan::bench(sample_count = 20, args = CUTS, consts = [true, false])]
    fn any<const PACKETS: bool>(bencher: Bencher, cut: usize) {
        super::any(bencher, &build::<PACKETS>(cut), &shapes::room_rays(WALKS).1);
    }

    fn build<const PACKETS: bool>(cut: usize) -> Tracer {
        let kernel = if PACKETS { Kernel::Packet } else { Kernel::Single };
        Tracer::build_with(&shapes::cut(&shapes::room(), cut), kernel)
    }
}

/// The rays of diffuse walks in bundled scenes.
mod scene {
    use glam::Vec3;
    use intrados_scene::{Part, Scene, tracer::offset};
    use intrados_stage::{Job, random::Key};

    use super::*;

    const WALKS: u64 = 1 << 14;
    const SCENES: [&str; 6] =
        ["cornell", "specimens", "column bars", "tunnel", "beam", "beam bars"];

    #[divan::bench(sample_count = 20, args = SCENES)]
    fn closest(bencher: Bencher, name: &str) {
        let (triangles, eye) = bundled(name);
        let tracer = Tracer::build(&triangles);
        super::closest(bencher, &tracer, &walks(&tracer, &triangles, eye, WALKS));
    }

    #[divan::bench(sample_count = 20, args = SCENES)]
    fn any(bencher: Bencher, name: &str) {
        let (triangles, eye) = bundled(name);
        let tracer = Tracer::build(&triangles);
        super::any(bencher, &tracer, &walks(&tracer, &triangles, eye, WALKS));
    }

    #[divan::bench(sample_count = 10, args = SCENES)]
    fn build(bencher: Bencher, name: &str) {
        let (triangles, _) = bundled(name);
        bencher.counter(ItemsCount::new(triangles.len())).bench_local(|| Tracer::build(&triangles));
    }

    /// The triangles of a bundled scene in place, and where its first camera stands; of a name that
    /// ends with " bars" the reinforcement alone.
    fn bundled(name: &str) -> (Vec<[Vec3; 3]>, Vec3) {
        let (name, bars) = name.strip_suffix(" bars").map_or((name, false), |name| (name, true));
        let scene = Scene::load_bundled(name, &Job::default()).expect("a bundled scene");
        let shown = scene
            .objects
            .iter()
            .filter(|o| !bars || matches!(o.part, Part::Bar | Part::Stirrup | Part::Tendon));
        let triangles = shown.flat_map(|object| {
            let mesh = &scene.meshes[object.mesh];
            (0..mesh.triangles.len())
                .map(|i| mesh.corners(i).map(|p| object.transform.transform_point3(p)))
        });
        (triangles.collect(), scene.cameras[0].position)
    }

    /// The rays of walks that leave `eye` for some triangle and go on diffusely from whatever they
    /// meet, to depth 5.
    fn walks(tracer: &Tracer, triangles: &[[Vec3; 3]], eye: Vec3, count: u64) -> Vec<Ray> {
        let mut rays: Vec<Ray> = (0..count)
            .map(|i| {
                let [a, b, c] =
                    triangles[(Key::new(4, i).unit(0) * triangles.len() as f32) as usize];
                Ray::new(eye, (a + b + c) / 3.0 - eye, f32::INFINITY)
            })
            .collect();
        let (mut all, mut scratch) = (rays.clone(), Scratch::default());
        for depth in 1..5 {
            let mut hits = vec![Hit::MISS; rays.len()];
            tracer.closest(&rays, &mut hits, &mut scratch);
            let met = rays.iter().zip(&hits).enumerate().filter(|(_, (_, hit))| hit.is_hit());
            rays = met
                .map(|(i, (ray, hit))| {
                    let corners = &triangles[hit.triangle as usize];
                    let (point, _, error) = offset::hit_point(corners, ray);
                    let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                    let n = if n.dot(Vec3::from(ray.direction)) > 0.0 { -n } else { n };
                    let d = (n + shapes::sphere(Key::new(5, i as u64).pair(2 * depth)) * 0.9999)
                        .normalize();
                    Ray::new(offset::offset_origin(point, error, n, d), d, f32::INFINITY)
                })
                .collect();
            all.extend(&rays);
        }
        all
    }
}
