//! No ray slips through a closed mesh, whichever kernel answers, and kernels agree to the bit.

mod shapes;

use glam::{DVec3, Vec3, vec3};
use intrados_scene::tracer::{Hit, Kernel, Ray, Scratch, Tracer, offset};
use intrados_stage::random::Key;
use proptest::prelude::*;

const KERNELS: [Kernel; 2] = [Kernel::Single, Kernel::Packet];

fn closest(tracer: &Tracer, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit { t: f32::NAN, triangle: 0 }; rays.len()];
    tracer.closest(rays, &mut hits, &mut Scratch::default());
    hits
}

fn any(tracer: &Tracer, rays: &[Ray]) -> Vec<bool> {
    let mut blocked = vec![false; rays.len()];
    tracer.any(rays, &mut blocked, &mut Scratch::default());
    blocked
}

/// Hits of both kernels, after asserting that they, and `any`, agree.
fn agreed(triangles: &[[Vec3; 3]], rays: &[Ray]) -> Vec<Hit> {
    let [single, packet] = KERNELS.map(|k| Tracer::build_with(triangles, k));
    let hits = closest(&single, rays);
    let others = closest(&packet, rays);
    let blocked = KERNELS.map(|k| any(if k == Kernel::Single { &single } else { &packet }, rays));
    for (i, ray) in rays.iter().enumerate() {
        let (a, b) = (hits[i], others[i]);
        assert_eq!((a.t.to_bits(), a.triangle), (b.t.to_bits(), b.triangle), "ray {i}: {ray:?}");
        assert_eq!([a.is_hit(); 2], [blocked[0][i], blocked[1][i]], "any of ray {i}: {ray:?}");
    }
    hits
}

#[test]
fn no_ray_leaves_the_tunnel() {
    let triangles = shapes::tunnel(500, 100);
    let mut rays = shapes::aimed_rays(&triangles);
    assert_eq!(rays.len(), 300_000);
    rays.extend(shapes::tunnel_rays(50_000));
    let leaks = agreed(&triangles, &rays).iter().filter(|hit| !hit.is_hit()).count();
    assert_eq!(leaks, 0);
}

/// Seen from so far that a coordinate's last bit is worth a triangle, the silhouette is coarse, but
/// the inside has no holes.
#[test]
fn no_aimed_ray_passes_a_far_mesh() {
    let triangles = shapes::tunnel(60, 24);
    for distance in [30.0, 1e3, 1e5, 1e6] {
        let rays: Vec<Ray> = triangles
            .iter()
            .enumerate()
            .flat_map(|(i, t)| {
                let origin = shapes::sphere(Key::new(3, i as u64).pair(0)) * distance;
                // Only what is well inside the silhouette: the tube, seen from outside, behind a
                // margin.
                let inner = |p: Vec3| {
                    let ring = vec3(p.x, 0.0, p.z).normalize() * 10.0;
                    ring + (p - ring) * 0.3
                };
                t.map(inner).map(|p| Ray::new(origin, p - origin, f32::INFINITY))
            })
            .collect();
        let leaks = agreed(&triangles, &rays).iter().filter(|hit| !hit.is_hit()).count();
        assert_eq!(leaks, 0, "from {distance} m");
    }
}

/// Where the ray meets the triangle in double precision, m, and whether that is beyond doubt:
/// neither through an edge nor along the plane nor at the origin, within what single precision may
/// mistake. `None`: it misses beyond doubt.
fn oracle(triangle: &[Vec3; 3], ray: &Ray) -> Option<(f64, bool)> {
    const DOUBT: f64 = 1e-4;
    let [a, b, c] = triangle.map(Vec3::as_dvec3);
    let (o, d) =
        (Vec3::from(ray.origin).as_dvec3(), Vec3::from(ray.direction).as_dvec3().normalize());
    let n = (b - a).cross(c - a);
    let t = n.dot(a - o) / n.dot(d);
    let p = o + d * t;
    let weight = |p1: DVec3, p2: DVec3| (p2 - p1).cross(p - p1).dot(n) / n.length_squared();
    let least = weight(a, b).min(weight(b, c)).min(weight(c, a));
    let cosine = n.dot(d).abs() / n.length();
    // Written so that the NaNs of triangles without area are misses.
    (least > -DOUBT && t > -DOUBT).then_some((t, least > DOUBT && t > DOUBT && cosine > 1e-3))
}

/// Random triangles of all sizes, some of them slivers, some of them points.
fn soup(seed: u64, count: u64) -> Vec<[Vec3; 3]> {
    (0..count)
        .map(|i| {
            let key = Key::new(seed, i);
            let at = |k| 4.0 * vec3(key.unit(k), key.unit(k + 1), key.unit(k + 2)) - 2.0;
            let size = 10.0_f32.powf(-3.0 * key.unit(9));
            let (p, a, b) = (at(0), at(3) * size, at(6) * size);
            match i % 16 {
                0 => [p, p + a, p + a + b * 1e-3],
                1 => [p, p + a, p + a * 2.0],
                2 => [p; 3],
                _ => [p, p + a, p + b],
            }
        })
        .collect()
}

fn soup_rays(seed: u64, count: u64) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let key = Key::new(seed ^ 0xabc, i);
            let origin = 6.0 * vec3(key.unit(0), key.unit(1), key.unit(2)) - 3.0;
            let mut d = shapes::sphere(key.pair(3));
            match i % 8 {
                0 => d.x = 0.0,
                1 => d = vec3(0.0, -0.0, d.z),
                2 => d.y *= 1e-20,
                _ => {}
            }
            let t_max = if i % 3 == 0 { key.unit(6) * 3.0 } else { f32::INFINITY };
            let scale = 10.0_f32.powf(6.0 * key.unit(7) - 3.0);
            Ray::new(origin, d * scale, t_max / scale)
        })
        .collect()
}

#[test]
fn hits_are_those_of_the_exact_geometry() {
    for (seed, count) in [(1, 5), (2, 40), (3, 300), (4, 3000)] {
        let triangles = soup(seed, count);
        let rays = soup_rays(seed, 2000);
        let (mut judged, mut met) = (0, 0);
        for (ray, hit) in rays.iter().zip(agreed(&triangles, &rays)) {
            let length = f64::from(Vec3::from(ray.direction).length());
            let limit = f64::from(ray.t_max) * length;
            let crossed: Vec<_> = triangles
                .iter()
                .enumerate()
                .filter_map(|(i, t)| oracle(t, ray).map(|(t, sure)| (t, sure, i)))
                .collect();
            let first = crossed.iter().map(|c| c.0).fold(f64::INFINITY, f64::min);
            let mut near = crossed.iter().filter(|c| c.0 < first + 1e-3);
            if (first - limit).abs() < 1e-3 || near.clone().any(|c| !c.1) {
                continue;
            }
            judged += 1;
            if first < limit {
                met += 1;
                assert!(
                    (f64::from(hit.t) * length - first).abs() < 1e-4,
                    "{ray:?}: {hit:?}, exactly {first}"
                );
                assert!(near.any(|c| c.2 == hit.triangle as usize), "{ray:?}: {hit:?}");
            } else {
                assert_eq!(hit, Hit::MISS, "{ray:?}");
            }
        }
        assert!(
            judged > 1900 && met > 5,
            "of 2000 rays among {count} triangles only {judged} were judged and {met} met any"
        );
    }
}

/// Walks between a turned room and a block in it: from each hit to the next, with nowhere to go but
/// the walls.
#[test]
fn no_walk_leaves_a_closed_room() {
    let mut triangles = shapes::block(vec3(1.0, 2.0, 3.0), vec3(4.0, 1.5, 3.0), 0.4);
    triangles.extend(shapes::block(vec3(1.5, 1.0, 2.5), vec3(0.5, 0.4, 0.3), -0.2));
    for kernel in KERNELS {
        let tracer = Tracer::build_with(&triangles, kernel);
        let mut rays: Vec<Ray> = (0..4000)
            .map(|i| {
                Ray::new(vec3(1.0, 3.0, 3.0), shapes::sphere(Key::new(8, i).pair(0)), f32::INFINITY)
            })
            .collect();
        for bounce in 1..50 {
            let hits = closest(&tracer, &rays);
            for (i, (ray, hit)) in rays.iter_mut().zip(&hits).enumerate() {
                assert!(hit.is_hit(), "{kernel:?}, walk {i}, bounce {bounce}: {ray:?}");
                let corners = &triangles[hit.triangle as usize];
                let (point, _, error) = offset::hit_point(corners, ray);
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                let normal =
                    if normal.dot(Vec3::from(ray.direction)) > 0.0 { -normal } else { normal };
                let direction =
                    normal + shapes::sphere(Key::new(9, i as u64).pair(2 * bounce)) * 0.999;
                *ray = Ray::new(
                    offset::offset_origin(point, error, normal, direction),
                    direction,
                    f32::INFINITY,
                );
            }
        }
    }
}

/// In the order of two coincident triangles nothing but the index decides.
#[test]
fn of_two_hits_at_one_distance_the_lower_index_wins() {
    let mut triangles = shapes::cut(&shapes::room(), 3);
    let n = triangles.len() as u32;
    triangles.extend_from_within(..);
    let rays = shapes::room_rays(500).0;
    let hits = agreed(&triangles, &rays);
    assert!(hits.iter().filter(|h| h.is_hit()).count() > 500);
    assert!(hits.iter().all(|h| !h.is_hit() || h.triangle < n));
}

/// What else is in the batch does not matter.
#[test]
fn a_ray_alone_is_answered_as_in_a_batch() {
    let mut rays = shapes::room_rays(100).0;
    rays.iter_mut().step_by(7).for_each(|ray| ray.t_max = f32::NAN);
    for kernel in KERNELS {
        let tracer = Tracer::build_with(&shapes::cut(&shapes::room(), 5), kernel);
        let alone: Vec<Hit> =
            rays.iter().flat_map(|r| closest(&tracer, std::slice::from_ref(r))).collect();
        assert_eq!(closest(&tracer, &rays), alone, "{kernel:?}");
    }
}

#[test]
fn nothing_is_hit_where_there_is_nothing() {
    let rays = soup_rays(1, 100);
    let nan = Vec3::splat(f32::NAN);
    let point = [Vec3::ONE; 3];
    for triangles in [
        vec![],
        vec![[nan; 3]; 20],
        vec![[Vec3::ZERO, Vec3::X, Vec3::splat(f32::INFINITY)]],
        vec![point; 1000],
    ] {
        assert!(agreed(&triangles, &rays).iter().all(|hit| *hit == Hit::MISS));
    }
    let nothing = Tracer::default();
    assert!(
        closest(&nothing, &rays).iter().all(|hit| *hit == Hit::MISS)
            && !any(&nothing, &rays).contains(&true)
    );
}

#[test]
fn invalid_rays_hit_nothing() {
    let triangles = shapes::block(Vec3::ZERO, Vec3::ONE, 0.1);
    let good = Ray::new(Vec3::ZERO, Vec3::X, 10.0);
    let bad = [
        Ray { t_max: 0.0, ..good },
        Ray { t_max: -1.0, ..good },
        Ray { t_max: f32::NAN, ..good },
        Ray { direction: [0.0; 3], ..good },
        Ray { direction: [1.0, f32::NAN, 0.0], ..good },
        Ray { direction: [f32::INFINITY, 0.0, 0.0], ..good },
        Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
        Ray { origin: [0.0, f32::NEG_INFINITY, 0.0], ..good },
    ];
    for bad in bad {
        let hits = agreed(&triangles, &[good, bad, good]);
        assert_eq!(
            hits.iter().map(Hit::is_hit).collect::<Vec<_>>(),
            [true, false, true],
            "{bad:?}"
        );
    }
}

/// Very many triangles in one place, or each around the next: neither deep recursion nor quadratic
/// time.
#[test]
fn degenerate_sets_are_built() {
    let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let same = vec![one; 200_000];
    let nested: Vec<_> = (0..100_000).map(|i| one.map(|p| p * 1.0002_f32.powi(-i))).collect();
    let ray = Ray::new(vec3(0.1, 0.1, 1.0), -Vec3::Z, f32::INFINITY);
    for triangles in [same, nested] {
        assert_eq!(agreed(&triangles, &[ray]), [Hit { t: 1.0, triangle: 0 }]);
    }
}

/// Subtrees are built by whichever thread is free; the tree, and so the order of every hit, must
/// not show it.
#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut triangles = shapes::tunnel(200, 60);
    triangles.extend(soup(5, 20_000));
    let built = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        format!("{:?}", pool.install(|| Tracer::build(&triangles)))
    };
    let one = built(1);
    assert!([2, 3].into_iter().all(|threads| built(threads) == one));
}

#[test]
fn a_cancelled_build_stops() {
    let job = intrados_stage::Job::new("building");
    job.cancel();
    assert!(Tracer::build_job(&shapes::room(), &job).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

    /// Scenes on a coarse grid are full of shared planes, edges and ties.
    #[test]
    fn kernels_agree_on_grids(corners in prop::collection::vec(prop::array::uniform9(-3_i8..=3), 0..60),
                              rays in prop::collection::vec((prop::array::uniform3(-5_i8..=5), prop::array::uniform3(-2_i8..=2)), 1..40)) {
        let at = |c: &[i8]| vec3(f32::from(c[0]), f32::from(c[1]), f32::from(c[2]));
        let triangles: Vec<_> = corners.iter().map(|c| [at(&c[..3]), at(&c[3..6]), at(&c[6..])]).collect();
        let rays: Vec<_> = rays.iter().map(|(o, d)| Ray::new(at(o), at(d), f32::INFINITY)).collect();
        agreed(&triangles, &rays);
    }

    /// From inside a convex body every ray leaves it once.
    #[test]
    fn a_block_is_closed(turn in -3.0_f32..3.0, half in prop::array::uniform3(0.01_f32..100.0), centre in prop::array::uniform3(-1e3_f32..1e3), seed: u64) {
        let (half, centre) = (Vec3::from(half), Vec3::from(centre));
        let triangles = shapes::block(centre, half, turn);
        let rays: Vec<_> = (0..200).map(|i| Ray::new(centre, shapes::sphere(Key::new(seed, i).pair(0)), f32::INFINITY)).collect();
        prop_assert!(agreed(&triangles, &rays).iter().all(Hit::is_hit));
    }
}
