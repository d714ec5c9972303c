//! Cracks as light sees them: a slot's mouth against the radiosity of a groove, and what is missing
//! across a crack against its width, from any distance.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::sync::Arc;

use glam::{DVec2, Mat4, Vec3, dvec2};
use intrados_light::{LitScene, Render, RenderSettings, Sides, View};
use intrados_scene::{
    Camera, CrackSurface, Lamp, LampKind, Material, Mesh, Mouth, Object, Part, Scene, SurfaceDamage,
};
use intrados_stage::Job;

/// Mean radiance of a groove's floor over that of the plane beside it, in light that is the same
/// from everywhere: strips that are each as bright all over, exact view factors by crossed strings
/// (Hottel 1954), Gauss–Seidel.
fn floor_by_radiosity(depth_over_width: f64, albedo: f64) -> f64 {
    const FLOOR: usize = 60;
    let d = depth_over_width;
    let walls = ((60.0 * d) as usize).clamp(60, 400);
    let mut strips: Vec<[DVec2; 2]> = Vec::new();
    for i in 0..walls {
        // Finer where it is bright.
        let y = |k: usize| -d * (k as f64 / walls as f64).powf(1.5);
        strips.push([dvec2(0.0, y(i)), dvec2(0.0, y(i + 1))]);
        strips.push([dvec2(1.0, y(i)), dvec2(1.0, y(i + 1))]);
    }
    for i in 0..FLOOR {
        let x = |k: usize| k as f64 / FLOOR as f64;
        strips.push([dvec2(x(i), -d), dvec2(x(i + 1), -d)]);
    }
    let mouth = [dvec2(0.0, 0.0), dvec2(1.0, 0.0)];
    let factor = |p: [DVec2; 2], q: [DVec2; 2]| {
        let (a, b) =
            (p[0].distance(q[0]) + p[1].distance(q[1]), p[0].distance(q[1]) + p[1].distance(q[0]));
        0.5 * (a - b).abs() / p[0].distance(p[1])
    };
    let n = strips.len();
    let same_wall = |i: usize, j: usize| {
        let (a, b) = (strips[i], strips[j]);
        (a[0].x == a[1].x && b[0].x == b[1].x && a[0].x == b[0].x)
            || (a[0].y == a[1].y && b[0].y == b[1].y)
    };
    let factors: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let to = |j: usize| {
                if i == j || same_wall(i, j) { 0.0 } else { factor(strips[i], strips[j]) }
            };
            (0..n).map(to).collect()
        })
        .collect();
    // Whatever leaves a strip arrives somewhere.
    for (strip, factors) in strips.iter().zip(&factors) {
        let all = factors.iter().sum::<f64>() + factor(*strip, mouth);
        assert!((all - 1.0).abs() < 1e-9, "{all}");
    }
    let mut b = vec![0.0; n];
    for _ in 0..400 {
        for i in 0..n {
            let from: f64 = factors[i].iter().zip(&b).map(|(f, b)| f * b).sum();
            b[i] = albedo * (from + factor(strips[i], mouth));
        }
    }
    b[n - FLOOR..].iter().sum::<f64>() / FLOOR as f64 / albedo
}

fn quad(mesh: &mut Mesh, [a, b, c, d]: [Vec3; 4]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([a, b, c, d]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

fn sky() -> Lamp {
    let kind = LampKind::Environment { radiance: Vec3::ONE, image: None };
    Lamp { name: "sky".into(), kind }
}

fn render(scene: Scene, camera: &Camera, samples: u64) -> Vec<f64> {
    let lit = Arc::new(LitScene::build(Arc::new(scene), &Job::default()).unwrap());
    let settings = RenderSettings {
        sides: Sides::Primal,
        samples: Some(samples),
        orders: false,
        ..RenderSettings::default()
    };
    let mut render = Render::new(lit, camera, &settings);
    while render.advance(64) {}
    render.image(View::Primal, None).mean.iter().map(|c| f64::from(c.x)).collect()
}

/// A slot 1 mm wide, long against its depth, at three depths and albedos, looked down upon from so
/// far that only its floor is seen.
#[test]
fn a_slot_returns_what_radiosity_says() {
    let (width, long) = (1e-3_f32, 0.1);
    for (depth, albedo) in [(0.5, 0.5), (2.0, 0.5), (2.0, 0.8), (6.0, 0.8)] {
        let (half, deep) = (0.5 * width, depth * width);
        let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let mut mesh = Mesh::default();
        // In pieces twice as long as wide: walks start off a triangle by its rounding, which grows
        // with its length over its height.
        let pieces = (long / width) as i32;
        for z in (-pieces / 2..pieces / 2).map(|k| 2.0 * width * k as f32) {
            let end = z + 2.0 * width;
            let low = -deep;
            quad(
                &mut mesh,
                [at(-half, low, end), at(half, low, end), at(half, low, z), at(-half, low, z)],
            );
            quad(
                &mut mesh,
                [at(-half, low, end), at(-half, low, z), at(-half, 0.0, z), at(-half, 0.0, end)],
            );
            quad(
                &mut mesh,
                [at(half, low, z), at(half, low, end), at(half, 0.0, end), at(half, 0.0, z)],
            );
        }
        for (a, b) in [(-0.1, -half), (half, 0.1)] {
            quad(
                &mut mesh,
                [at(a, 0.0, long), at(b, 0.0, long), at(b, 0.0, -long), at(a, 0.0, -long)],
            );
        }
        let mut scene = Scene {
            materials: vec![Material { base_colour: Vec3::splat(albedo), ..Material::default() }],
            lamps: vec![sky()],
            ..Scene::default()
        };
        scene.objects.push(Object {
            name: "slot".into(),
            mesh: 0,
            transform: Mat4::IDENTITY,
            material: 0,
            member: None,
            part: Part::Scenery,
        });
        scene.meshes.push(Arc::new(mesh));
        let distance = 2.0;
        let camera = Camera {
            name: "above".into(),
            position: Vec3::Y * distance,
            target: Vec3::ZERO,
            up: Vec3::Z,
            // A little less than the floor: the walls are not seen.
            fov_deg: (0.985 * width / (distance + deep)).atan().to_degrees(),
            width: 32,
            height: 32,
            lens: None,
            exposure: 0.0,
        };
        let picture = render(scene, &camera, 400);
        let n = picture.len() as f64;
        let mean = picture.iter().sum::<f64>() / n;
        let spread = picture.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (spread / n).sqrt();
        let expected = f64::from(albedo) * floor_by_radiosity(f64::from(depth), f64::from(albedo));
        // Four standard errors of four tests: 3e-4; and .4 % for the strip at the walls' foot that
        // is not looked at.
        assert!(
            (mean - expected).abs() < 4.0 * error + 4e-3 * expected,
            "depth {depth}, albedo {albedo}: {mean} ± {error}, radiosity {expected}"
        );
    }
}

/// Theory §8: the light missing across a crack, ∫(1 − y/y₀) ds, is its width × (1 − r), r being what
/// its slot returns, whatever the size of the pixels.
#[test]
fn the_light_missing_across_a_crack_does_not_depend_on_the_distance() {
    let bare = Scene::load_bundled("column", &Job::default()).unwrap();
    let [low, high] = bare.members[0].bounds;
    let (width, z) = (1e-3, high.z);
    let (left, right) = (low.x + 0.05, high.x - 0.05);
    let at = |x: f32| Mouth { at: Vec3::new(x, 1.5, z), outward: Vec3::Z, width };
    let crack = CrackSurface { mouth: vec![at(left), at(right)], normal: Vec3::Y, depth: 0.03 };
    let member = bare.members[0].id.clone();
    let damage = SurfaceDamage { member, cracks: vec![crack], spalls: Vec::new() };
    let mut scene = bare.marked(&[damage], 1.0);
    scene.lamps = vec![sky()];
    // Nothing but the column under an even sky, its own slot and nothing else to be seen.
    scene.objects.retain(|o| o.member == Some(0));
    let albedo = f64::from(scene.materials[scene.objects[0].material].base_colour.x);
    let mut found = Vec::new();
    for pixel in [1e-3_f32, 3e-3, 1e-2] {
        // Looked at 12 cm high across the whole crack, pixels of the given size.
        let distance = 3.0;
        let (wide, tall) = (right - left + 0.02, 0.12);
        let (columns, rows) = ((wide / pixel).round(), (tall / pixel).round());
        let camera = Camera {
            name: "front".into(),
            position: Vec3::new(0.5 * (left + right), 1.5, z + distance),
            target: Vec3::new(0.5 * (left + right), 1.5, z),
            up: Vec3::Y,
            fov_deg: 2.0 * (0.5 * columns * pixel / distance).atan().to_degrees(),
            width: columns as u32,
            height: rows as u32,
            lens: None,
            exposure: 0.0,
        };
        let samples = (40_000.0 * f64::from(pixel) / 1e-3 * f64::from(pixel) / 1e-3 / 100.0) as u64;
        let picture = render(scene.clone(), &camera, samples.max(400));
        let row_mean = |row: usize| {
            let n = columns as usize;
            picture[row * n..(row + 1) * n].iter().sum::<f64>() / n as f64
        };
        let rows = rows as usize;
        let profile: Vec<f64> = (0..rows).map(row_mean).collect();
        // The face itself from the quarter at the top and the bottom.
        let edge: Vec<f64> =
            profile[..rows / 4].iter().chain(&profile[rows - rows / 4..]).copied().collect();
        let face = edge.iter().sum::<f64>() / edge.len() as f64;
        let missing: f64 = profile.iter().map(|y| 1.0 - y / face).sum::<f64>() * f64::from(pixel);
        let spread = edge.iter().map(|v| (v / face - 1.0).powi(2)).sum::<f64>() / edge.len() as f64;
        let error = (spread * rows as f64 * (1.0 + rows as f64 / edge.len() as f64)).sqrt()
            * f64::from(pixel);
        // Per metre of picture → per metre of crack.
        let share = f64::from(columns * pixel / (right - left));
        found.push([missing * share, error * share]);
    }
    // The middle two thirds keep the full width; ends fade; lips are uneven: 1 mm within 15 %.
    let returned = floor_by_radiosity(20.0, albedo);
    let told = f64::from(width) * (1.0 - returned);
    for [missing, error] in &found {
        assert!((missing / told - 1.0).abs() < 0.2, "{found:?}, told {told}");
        assert!(*error < 0.1 * told, "{found:?}");
    }
    for pair in found.windows(2) {
        let off = (pair[0][0] - pair[1][0]).abs();
        assert!(off < 3.0 * pair[0][1].hypot(pair[1][1]), "{found:?}");
    }
}
