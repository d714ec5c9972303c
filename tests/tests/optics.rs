//! Physics that is easy to get wrong, from both sides, each against a closed form where there is
//! one. Each test is one family at 1 % false alarms (Šidák), seeds fixed.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{f64::consts::PI, sync::Arc};

use glam::{Affine2, DVec3, Mat4, Vec2, Vec3};
use intrados_light::{MeterReading, Sensor};
use intrados_scene::{
    Camera, LampKind, Lens, Material, Mesh, Meter, Scene, Surface, Texture, TextureRef, Wrap,
};
use intrados_tests::{
    Family, Furnish, ball, camera, cuboid, lit, made_of, matt, meter, quad, read, sensors, shining,
};
use intrados_transport::{Estimator, WalkRule};

/// Readings of all sensors of a scene, `passes` passes a side and sensor.
fn readings(scene: Scene, passes: u32) -> Vec<MeterReading> {
    let sensors = sensors(&scene);
    read(&lit(scene), sensors, WalkRule::default(), 51, passes)
}

/// Mean of `value` over a meter, by n × n midpoints.
fn mean_over(n: usize, meter: &Meter, value: impl Fn(DVec3) -> f64) -> f64 {
    let at = |k: usize| (k as f64 + 0.5) / n as f64;
    let point = |k: usize| {
        meter.corner.as_dvec3() + at(k % n) * meter.u.as_dvec3() + at(k / n) * meter.v.as_dvec3()
    };
    (0..n * n).map(|k| value(point(k))).sum::<f64>() / (n * n) as f64
}

/// I cosθ/r² at `x` with normal `n`, of a lamp at `lamp` that sends `intensity` along a unit
/// vector.
fn from_point(lamp: Vec3, n: Vec3, x: DVec3, intensity: impl Fn(DVec3) -> f64) -> f64 {
    let to = lamp.as_dvec3() - x;
    let r = to.length();
    intensity(-to / r) * (to.dot(n.as_dvec3()) / r).max(0.0) / (r * r)
}

/// A meter of 1 m × .6 m on the ground, another one upright, one that looks away from the light.
fn three_meters(scene: &mut Scene) {
    scene.meters = vec![
        meter("lying", Vec3::new(-0.3, 0.0, -0.2), Vec3::Z, Vec3::X * 0.6),
        meter("upright", Vec3::new(-0.5, 0.2, -1.0), Vec3::X, Vec3::Y * 0.6),
        meter("turned away", Vec3::new(-0.3, 0.1, -0.2), Vec3::X * 0.6, Vec3::Z),
    ];
}

/// I cosθ/r², in a world that has nothing else; every estimator of the dual, the primal by linking
/// only (its walks cannot hit a point).
#[test]
fn a_point_lamp_falls_off_with_the_square() {
    let (position, intensity) = (Vec3::new(0.4, 1.1, 0.3), 5.0);
    let mut scene = Scene::default();
    scene.light(LampKind::Point { position, intensity: Vec3::splat(intensity) });
    three_meters(&mut scene);
    let lit = lit(scene);
    let mut family = Family::default();
    for estimator in
        [Estimator::NextEvent, Estimator::Collision, Estimator::Analog, Estimator::LastEvent]
    {
        let rule = WalkRule { estimator, ..WalkRule::default() };
        for (reading, meter) in
            read(&lit, sensors(&lit.scene), rule, 51, 8).iter().zip(&lit.scene.meters)
        {
            let expected = mean_over(200, meter, |x| {
                from_point(position, meter.normal(), x, |_| f64::from(intensity))
            });
            family.reads(
                &format!("{estimator:?} {} dual", meter.name),
                reading.dual.as_ref(),
                expected,
                0.02,
            );
            if estimator == Estimator::NextEvent {
                family.reads(
                    &format!("{} primal", meter.name),
                    reading.primal.as_ref(),
                    expected,
                    0.01,
                );
            } else {
                assert_eq!(reading.primal.as_ref().unwrap().mean, 0.0);
            }
        }
    }
    family.judge();
}

/// The spot of `KHR_lights_punctual`: full to the inner angle, the square of a line in the cosine,
/// nothing beyond the outer angle.
#[test]
fn a_spot_falls_off_between_its_angles() {
    let (position, direction) = (Vec3::new(0.2, 1.5, 0.4), Vec3::new(0.1, -1.0, -0.2).normalize());
    let (inner, outer, intensity) = (0.2_f32, 0.45_f32, 7.0);
    let mut scene = Scene::default();
    scene.light(LampKind::Spot {
        position,
        direction,
        intensity: Vec3::splat(intensity),
        inner,
        outer,
    });
    three_meters(&mut scene);
    let meters = scene.meters.clone();
    let (cos_inner, cos_outer) = (f64::from(inner).cos(), f64::from(outer).cos());
    let shape = |w: DVec3| {
        let t =
            ((w.dot(direction.as_dvec3()) - cos_outer) / (cos_inner - cos_outer)).clamp(0.0, 1.0);
        f64::from(intensity) * t * t
    };
    let mut family = Family::default();
    for (reading, meter) in readings(scene, 16).iter().zip(&meters) {
        let expected = mean_over(200, meter, |x| from_point(position, meter.normal(), x, shape));
        family.both_read("spot,", reading, expected, 0.03);
    }
    family.judge();
}

/// E cosθ on whatever faces the beam, nothing on what does not.
#[test]
fn a_parallel_beam_lights_by_the_cosine() {
    let direction = Vec3::new(0.3, -0.8, -0.4).normalize();
    let mut scene = Scene::default();
    scene.light(LampKind::Directional { direction, irradiance: Vec3::splat(3.0) });
    three_meters(&mut scene);
    let meters = scene.meters.clone();
    let mut family = Family::default();
    for (reading, meter) in readings(scene, 16).iter().zip(&meters) {
        family.both_read(
            "beam,",
            reading,
            3.0 * f64::from(-direction.dot(meter.normal()).min(0.0)),
            0.02,
        );
    }
    family.judge();
}

/// A matt floor under a beam shows ρE/π to a camera and gives ρE to a meter that faces it closely:
/// it ends 3.5 m beside the meter and .02 m below it, so that less than (h/R)² = 1e-4 is missing.
#[test]
fn a_parallel_beam_is_reflected() {
    let mut scene = Scene::default();
    scene.put(quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0), matt(0.5));
    scene.light(LampKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(2.0) });
    // It throws no shadow, being a meter.
    scene.meters.push(meter("facing down", Vec3::new(-0.5, 0.02, -0.5), Vec3::X, Vec3::Z));
    scene.cameras.push(camera(Vec3::new(0.2, 1.5, 0.1), Vec3::new(0.0, 0.0, 0.3), 50.0));
    let all = readings(scene, 24);
    let mut family = Family::default();
    family.both_read("floor seen:", &all[0], 0.5 * 2.0 / PI, 0.02);
    for (side, r) in [("primal", &all[1].primal), ("dual", &all[1].dual)] {
        let r = r.as_ref().unwrap();
        family.claim_within(format!("facing down, {side}"), r.mean, r.std_error, 1.0, 1e-4, 0.02);
    }
    family.judge();
}

/// πL under an even sky, half of it on a wall; the camera sees L itself, and half of it where a
/// black floor fills half of the picture.
#[test]
fn an_even_sky_gives_pi_l() {
    let mut scene = Scene::default();
    scene.light(LampKind::Environment { radiance: Vec3::splat(1.3), image: None });
    three_meters(&mut scene);
    scene.cameras.push(camera(Vec3::new(0.0, 0.5, 2.0), Vec3::new(0.3, 0.9, 0.0), 60.0));
    let mut family = Family::default();
    for reading in readings(scene.clone(), 16) {
        family.both_read(
            "sky alone,",
            &reading,
            if reading.name == "eye" { 1.3 } else { 1.3 * PI },
            0.02,
        );
    }
    // A black floor of 2 km takes the lower half from an upright meter, but 2h/πR of it, and
    // nothing from one that looks up.
    let floor = Material { surface: Surface::Black, ..matt(0.0) };
    scene.put(quad(Vec3::new(-1000.0, -1.0, -1000.0), Vec3::Z * 2000.0, Vec3::X * 2000.0), floor);
    scene.cameras.clear();
    scene.meters.truncate(2);
    for (reading, share) in readings(scene, 32).iter().zip([1.0, 0.5]) {
        let primal = reading.primal.as_ref().unwrap();
        family.claim_within(
            format!("black floor, {}", reading.name),
            primal.mean,
            primal.std_error,
            share * 1.3 * PI,
            3e-3,
            0.01,
        );
    }
    family.judge();
}

/// A sky with one bright patch left of the middle and a gradient.
fn sky() -> Texture {
    let (width, height) = (32, 16);
    let texel = |i: usize| {
        let (column, row) = (i % width, i / width);
        let sun = if (column, row) == (20, 4) { 60.0 } else { 0.0 };
        Vec3::splat(sun + 0.2 + 0.03 * column as f32 + if row < 8 { 0.1 * row as f32 } else { 0.0 })
    };
    Texture {
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
        wrap: [Wrap::Repeat, Wrap::Clamp],
    }
}

/// ∫ L cosθ dω over the picture, by midpoints over the sphere, with the map written down a second
/// time: u = atan2(x, −z)/2π + ½, v = acos(y)/π.
#[test]
fn an_image_sky_lights_from_where_it_shows() {
    let mut scene = Scene::default();
    scene.light(LampKind::Environment { radiance: Vec3::splat(2.0), image: Some(sky()) });
    three_meters(&mut scene);
    scene.meters.push(meter(
        "facing the sun",
        Vec3::new(0.5, 0.5, 0.5),
        Vec3::Y,
        Vec3::new(0.5, 0.0, 0.5),
    ));
    let meters = scene.meters.clone();
    let eye = camera(Vec3::ZERO, Vec3::new(0.8, 0.7, -1.0), 70.0);
    scene.cameras.push(eye.clone());
    let seen = |w: DVec3| {
        let (u, v) = (w.x.atan2(-w.z) / (2.0 * PI) + 0.5, w.y.clamp(-1.0, 1.0).acos() / PI);
        2.0 * f64::from(sky().sample(Vec2::new(u as f32, v as f32)).x)
    };
    let irradiance = |normal: DVec3| {
        let (rows, columns) = (400, 800);
        let cell = PI / 400.0 * (2.0 * PI / 800.0);
        let texture = sky();
        let mut sum = 0.0;
        for row in 0..rows {
            let theta = PI * (f64::from(row) + 0.5) / 400.0;
            for column in 0..columns {
                let u = (f64::from(column) + 0.5) / 800.0;
                let phi = 2.0 * PI * (u - 0.5);
                let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                let radiance =
                    2.0 * f64::from(texture.sample(Vec2::new(u as f32, (theta / PI) as f32)).x);
                sum += radiance * w.dot(normal).max(0.0) * theta.sin() * cell;
            }
        }
        sum
    };
    let mut family = Family::default();
    let all = readings(scene, 16);
    let n = 128;
    let pixels = (0..n * n).map(|k| {
        let at = |i: u32| (i as f32 + 0.5) / n as f32 * 32.0;
        seen(eye.direction(at(k % n), at(k / n)).as_dvec3())
    });
    let picture = pixels.sum::<f64>() / f64::from(n * n);
    for (side, r) in [("primal", &all[0].primal), ("dual", &all[0].dual)] {
        // Midpoints of a bilinear picture with kinks: 1e-3.
        let r = r.as_ref().unwrap();
        family.claim_within(
            format!("picture of the sky, {side}"),
            r.mean,
            r.std_error,
            picture,
            1e-3,
            0.01,
        );
    }
    for (reading, meter) in all[1..].iter().zip(&meters) {
        let expected = irradiance(meter.normal().as_dvec3());
        for (side, r) in [("primal", &reading.primal), ("dual", &reading.dual)] {
            let r = r.as_ref().unwrap();
            family.claim_within(
                format!("{}, {side}", meter.name),
                r.mean,
                r.std_error,
                expected,
                1e-3,
                0.02,
            );
        }
    }
    family.judge();
}

/// Reflectance of a smooth interface, unpolarised, from its textbook form (Born & Wolf, §1.5.2).
fn fresnel(cos: f64, n: f64) -> f64 {
    let beyond = (1.0 - (1.0 - cos * cos) / (n * n)).sqrt();
    let across = (cos - n * beyond) / (cos + n * beyond);
    let along = (n * cos - beyond) / (n * cos + beyond);
    0.5 * (across * across + along * along)
}

/// Share of the light that passes a slab, reflections within it included: (1 − R)² Σ R²ᵏ = (1 −
/// R)/(1 + R).
fn passes_slab(cos: f64, n: f64) -> f64 {
    let r = fresnel(cos, n);
    (1.0 - r) / (1.0 + r)
}

fn glass() -> Material {
    made_of(Surface::Dielectric { ior: 1.5, roughness: 0.0 })
}

fn slab() -> Mesh {
    cuboid(Vec3::new(-3.0, 1.0, -3.0), Vec3::new(3.0, 1.05, 3.0))
}

/// A beam through a slab of glass: only walks from the lamp can find their way (a link cannot pass
/// a smooth interface, nor can a walk from the meter hit a beam), and the sides must say so rather
/// than agree: the primal reads 0.
#[test]
fn a_slab_of_glass_passes_a_beam() {
    let direction = Vec3::new(0.5, -1.0, 0.0).normalize();
    let mut scene = Scene::default();
    scene
        .put(slab(), glass())
        .light(LampKind::Directional { direction, irradiance: Vec3::splat(2.0) });
    scene.meters.push(meter("below", Vec3::new(-0.5, 0.5, -0.5), Vec3::Z, Vec3::X));
    let reading = readings(scene, 128).remove(0);
    let cos = f64::from(-direction.y);
    let mut family = Family::default();
    family.reads(
        "beam through glass",
        reading.dual.as_ref(),
        2.0 * cos * passes_slab(cos, 1.5),
        0.01,
    );
    family.judge();
    assert_eq!(reading.primal.unwrap().mean, 0.0);
}

/// A lamp above a slab: its radiance comes through by (1 − R)/(1 + R), its light on a meter is the
/// same from both sides.
#[test]
fn a_lamp_is_seen_through_glass() {
    let mut scene = Scene::default();
    scene
        .put(slab(), glass())
        .put(quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0), shining(4.0))
        .put(quad(Vec3::new(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0), matt(0.5));
    scene.meters.push(meter(
        "under glass",
        Vec3::new(-0.4, 0.3, -0.4),
        Vec3::Z * 0.8,
        Vec3::X * 0.8,
    ));
    scene.meters.push(meter(
        "over glass",
        Vec3::new(-0.4, 1.3, -0.4),
        Vec3::Z * 0.8,
        Vec3::X * 0.8,
    ));
    scene.meters.push(meter(
        "in glass",
        Vec3::new(-0.4, 1.025, -0.4),
        Vec3::Z * 0.8,
        Vec3::X * 0.8,
    ));
    // Straight up, a narrow picture: cosθ is 1 within 2e-4, and the floor's light that the glass
    // reflects is counted below.
    scene.cameras.push(Camera {
        up: Vec3::X,
        ..camera(Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.0, 1.0, 0.0), 1.0)
    });
    let all = readings(scene, 24);
    let mut family = Family::default();
    for reading in &all[1..] {
        family.agree("lamp and glass:", reading, 0.01);
    }
    // Reflection of the lit floor in the slab: L_floor·2R/(1+R), with L_floor ≈ ρ/π times what the
    // floor gets, about .08 of the lamp's.
    let eye = all[0].primal.as_ref().unwrap();
    let through = 4.0 * passes_slab(1.0, 1.5);
    let floor = eye.mean - through;
    assert!(
        floor > 0.0 && floor < 0.5 * 4.0 / PI * PI * 2.0 * 0.04 / 1.04,
        "the glass reflects {floor} of the floor"
    );
    family.judge();
}

/// Glass under an even sky from everywhere is a furnace: meters around it read πL, and a camera in
/// it, looking straight out, sees n²L. In a block light arrives within the critical angle θ_c about
/// each of the six normals, with n²L; what is beyond is trapped and dark. A meter that faces a side
/// gets π n² sin²θ_c = π of that side and θ_c − sinθ_c cosθ_c of each of the four beside it, times
/// n².
#[test]
fn glass_in_an_even_sky() {
    let mut scene = Scene::default();
    scene.put(cuboid(Vec3::new(-0.5, 1.0, -0.4), Vec3::new(0.5, 1.6, 0.4)), glass());
    scene.light(LampKind::Environment { radiance: Vec3::splat(1.0), image: None });
    for (name, y) in [("below", 0.8), ("in", 1.25), ("above", 1.7)] {
        scene.meters.push(meter(name, Vec3::new(-0.2, y, -0.1), Vec3::Z * 0.3, Vec3::X * 0.4));
    }
    scene.cameras.push(Camera {
        up: Vec3::X,
        ..camera(Vec3::new(0.0, 1.2, 0.0), Vec3::new(0.0, 2.0, 0.0), 10.0)
    });
    let critical = (1.0_f64 / 1.5).asin();
    let inside = PI + 2.25 * 4.0 * (critical - critical.sin() * critical.cos());
    let all = readings(scene, 32);
    let mut family = Family::default();
    family.reads("camera in glass", all[0].primal.as_ref(), 2.25, 0.01);
    for (reading, expected) in all[1..].iter().zip([PI, inside, PI]) {
        family.both_read("sky and glass,", reading, expected, 0.02);
    }
    family.judge();
}

/// Points of a texture over a floor: bright left, dark right, darkest at the lower right.
fn chart() -> Texture {
    let rows = [[0.9, 0.5, 0.2], [0.7, 0.4, 0.1]];
    let texels = rows.iter().flatten().map(|&x| Vec3::splat(x)).collect();
    Texture { width: 3, height: 2, texels, wrap: [Wrap::Clamp; 2] }
}

/// Coordinates that are turned by a quarter and moved, as `KHR_texture_transform` would.
fn turned() -> Affine2 {
    Affine2::from_angle_translation(0.5 * std::f32::consts::PI, Vec2::new(1.0, 0.1))
}

/// A camera's mean over what lies on the plane y = 0, by 128² rays: `radiance` at (x, z).
fn picture_of_floor(eye: &Camera, radiance: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 128;
    let ray = |k: u32| {
        let at = |i: u32, size: u32| (i as f32 + 0.5) / n as f32 * size as f32;
        let d = eye.direction(at(k % n, eye.width), at(k / n, eye.height)).as_dvec3();
        let p = eye.position.as_dvec3() + d * (-f64::from(eye.position.y) / d.y);
        radiance(p.x, p.z)
    };
    (0..n * n).map(ray).sum::<f64>() / f64::from(n * n)
}

/// Lit by a beam from above a matt floor shows ρ E/π: the texture at its place, the right way
/// round, times the colours of its corners; and through a lens, whose pixels are of other solid
/// angles.
#[test]
fn textures_lie_where_they_should() {
    let plain = camera(Vec3::new(0.6, 1.0, 0.8), Vec3::new(0.3, 0.0, 0.3), 50.0);
    let lens = Lens { k1: -0.35, k2: 0.1, p1: 0.01, p2: -0.02, centre: [0.05, -0.03] };
    let bent = Camera { lens: Some(lens), fov_deg: 65.0, ..plain.clone() };
    assert!(bent.is_covered());
    let mut family = Family::default();
    for (name, eye, transform, coloured) in [
        ("plain", &plain, Affine2::IDENTITY, false),
        ("turned", &plain, turned(), false),
        ("coloured", &plain, Affine2::IDENTITY, true),
        ("through a lens", &bent, Affine2::IDENTITY, true),
    ] {
        let mut scene = Scene::default();
        // u along +x, v along +z: a quad of 2 m whose first corner is (−1, 0, −1).
        let mut floor = quad(Vec3::new(-1.0, 0.0, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0);
        floor.triangles = vec![[0, 2, 1], [0, 3, 2]];
        if coloured {
            // Falls along x, the same on both triangles.
            floor.colours = [1.0, 0.4, 0.4, 1.0].map(Vec3::splat).to_vec();
        }
        scene.textures.push(chart());
        let reference = TextureRef { texture: 0, set: 0, transform };
        scene.put(floor, Material { base_texture: Some(reference), ..matt(0.8) });
        scene.light(LampKind::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Vec3::splat(PI as f32),
        });
        scene.cameras.push(eye.clone());
        let expected = picture_of_floor(eye, |x, z| {
            if x.abs() > 1.0 || z.abs() > 1.0 {
                return 0.0;
            }
            let uv = transform
                .transform_point2(Vec2::new(0.5 * (x as f32 + 1.0), 0.5 * (z as f32 + 1.0)));
            0.8 * f64::from(chart().sample(uv).x)
                * if coloured { 1.0 - 0.3 * (x + 1.0) } else { 1.0 }
        });
        for (side, r) in [
            ("primal", &readings(scene.clone(), 16)[0].primal),
            ("dual", &readings(scene, 16)[0].dual),
        ] {
            let r = r.as_ref().unwrap();
            // The quadrature's own error, at the texture's edges.
            family.claim_within(
                format!("{name}, {side}"),
                r.mean,
                r.std_error,
                expected,
                1e-3,
                0.01,
            );
        }
    }
    family.judge();
}

/// A lamp with a picture: the meter gets ∫ L(u, v) cosθ cosθ′/r² dA, from both sides, mirrored or
/// not.
#[test]
fn a_lamp_with_a_texture() {
    let below = meter("below", Vec3::new(-0.2, 0.0, 0.1), Vec3::Z * 0.4, Vec3::X * 0.4);
    let mut family = Family::default();
    for mirrored in [false, true] {
        let mut scene = Scene::default();
        scene.textures.push(chart());
        let picture = TextureRef { texture: 0, set: 0, transform: Affine2::IDENTITY };
        // Front down: u × v = x × z = −y. Mirrored in x, the front stays down.
        let lamp = Material { emission_texture: Some(picture), ..shining(5.0) };
        let flip = if mirrored { -1.0 } else { 1.0 };
        let lamp_quad = quad(Vec3::new(-0.6, 0.9, -0.4), Vec3::X, Vec3::Z * 0.8);
        scene.place(lamp_quad, lamp, Mat4::from_scale(Vec3::new(flip, 1.0, 1.0)));
        scene.meters.push(below.clone());
        let n = 40;
        let at = |k: usize| (k as f64 + 0.5) / n as f64;
        let expected = mean_over(20, &below, |x| {
            let from = |k: usize| {
                let (u, v) = (at(k % n), at(k / n));
                let y = DVec3::new(f64::from(flip) * (u - 0.6), 0.9, 0.8 * v - 0.4);
                let r2 = (y - x).length_squared();
                5.0 * f64::from(chart().sample(Vec2::new(u as f32, v as f32)).x) * 0.9 * 0.9
                    / (r2 * r2)
            };
            (0..n * n).map(from).sum::<f64>() * 0.8 / (n * n) as f64
        });
        let reading = readings(scene, 16).remove(0);
        for (side, r) in [("primal", &reading.primal), ("dual", &reading.dual)] {
            let r = r.as_ref().unwrap();
            family.claim_within(
                format!("mirrored {mirrored}, {side}"),
                r.mean,
                r.std_error,
                expected,
                1e-3,
                0.01,
            );
        }
    }
    family.judge();
}

/// A lamp shines in front only, and stays so when it is mirrored.
#[test]
fn lamps_shine_in_front_only() {
    for flip in [1.0, -1.0] {
        let mut scene = Scene::default();
        scene.place(
            quad(Vec3::new(-0.5, 1.0, -0.5), Vec3::X, Vec3::Z),
            shining(5.0),
            Mat4::from_scale(Vec3::new(flip, 1.0, 1.0)),
        );
        scene.meters.push(meter(
            "behind",
            Vec3::new(-0.2, 2.0, -0.2),
            Vec3::X * 0.4,
            Vec3::Z * 0.4,
        ));
        scene.meters.push(meter(
            "in front",
            Vec3::new(-0.2, 0.0, -0.2),
            Vec3::Z * 0.4,
            Vec3::X * 0.4,
        ));
        let all = readings(scene, 2);
        assert_eq!(
            [&all[0].primal, &all[0].dual].map(|r| r.as_ref().unwrap().mean),
            [0.0; 2],
            "behind, {flip}"
        );
        assert!(
            [&all[1].primal, &all[1].dual].iter().all(|r| r.as_ref().unwrap().mean > 1.0),
            "in front, {flip}"
        );
    }
}

/// Constant normals of a normal map: `n` in the frame of right, up and out of the picture (glTF
/// 2.0, §3.9.3: +Y is up in the picture, that is, toward −v).
fn tilted(n: Vec3) -> Texture {
    Texture {
        width: 1,
        height: 1,
        texels: vec![0.5 * (n.normalize() + 1.0)],
        wrap: [Wrap::Repeat; 2],
    }
}

/// A matt floor with a constant normal map under a beam shows ρ E cos(n, l)/π, whether the mesh
/// brings its tangents or not, mirrored or not.
#[test]
fn normal_maps_turn_the_normal_the_right_way() {
    let n = Vec3::new(0.4, 0.3, 0.9).normalize();
    let beam = Vec3::new(0.2, -1.0, 0.5).normalize();
    let eye = camera(Vec3::new(0.1, 1.5, 0.1), Vec3::new(0.0, 0.0, 0.0), 30.0);
    let mut family = Family::default();
    for own_tangents in [false, true] {
        for flip in [1.0, -1.0] {
            let mut scene = Scene::default();
            // Seen from above with −z up in the picture: u right (+x), v down (+z).
            let mut floor = quad(Vec3::new(-2.0, 0.0, -2.0), Vec3::X * 4.0, Vec3::Z * 4.0);
            floor.triangles = vec![[0, 2, 1], [0, 3, 2]];
            if own_tangents {
                floor.normals = vec![Vec3::Y; 4];
                // Bitangent = normal × tangent · w = y × x · 1 = −z, up in the picture.
                floor.tangents = vec![glam::Vec4::new(1.0, 0.0, 0.0, 1.0); 4];
            }
            scene.textures.push(tilted(n));
            let map = TextureRef { texture: 0, set: 0, transform: Affine2::IDENTITY };
            let material = Material { normal_texture: Some((map, 1.0)), ..matt(0.6) };
            scene.place(floor, material, Mat4::from_scale(Vec3::new(flip, 1.0, 1.0)));
            scene.light(LampKind::Directional {
                direction: beam,
                irradiance: Vec3::splat(PI as f32),
            });
            scene.cameras.push(eye.clone());
            let world = Vec3::new(flip * n.x, n.z, -n.y);
            let expected = 0.6 * f64::from(-beam.dot(world));
            let reading = readings(scene, 16).remove(0);
            family.both_read(
                &format!("own tangents {own_tangents}, mirrored {flip},"),
                &reading,
                expected,
                0.02,
            );
        }
    }
    family.judge();
}

/// A closed grey room with a lamp and things in it: what they are made of must not matter to the
/// agreement of the sides.
fn room_with(things: Vec<(Mesh, Material, Mat4)>, textures: Vec<Texture>) -> Scene {
    let mut scene = Scene { textures, ..Scene::default() };
    let [x, y, z] = [Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 2.0];
    let lo = Vec3::new(-1.0, 0.0, -1.0);
    for (p, u, v) in
        [(lo, z, x), (lo + y, x, z), (lo, y, z), (lo + x, z, y), (lo, x, y), (lo + z, y, x)]
    {
        scene.put(quad(p, u, v), matt(0.5));
    }
    scene.put(quad(Vec3::new(-0.3, 1.9, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6), shining(8.0));
    for (mesh, material, transform) in things {
        scene.place(mesh, material, transform);
    }
    scene.cameras.push(camera(Vec3::new(0.8, 1.1, 0.8), Vec3::new(-0.2, 0.4, -0.2), 60.0));
    scene.meters.push(meter("floor", Vec3::new(0.3, 0.0, 0.3), Vec3::Z * 0.4, Vec3::X * 0.4));
    scene.meters.push(meter("air", Vec3::new(-0.9, 0.6, 0.2), Vec3::Y * 0.4, Vec3::Z * 0.4));
    scene
}

/// Shading normals make the kernel unsymmetric; the dual needs Veach's correction, or the sides
/// part by per cents on a coarse smooth ball.
#[test]
fn both_sides_agree_on_smooth_normals() {
    let coarse = ball(Vec3::new(-0.2, 0.5, -0.2), 0.45, 5, true);
    let metal = made_of(Surface::Metallic { metallic: 1.0, roughness: 0.5, texture: None });
    let mut family = Family::default();
    for (name, material) in [("matt ball", matt(0.9)), ("metal ball", metal)] {
        for reading in
            readings(room_with(vec![(coarse.clone(), material, Mat4::IDENTITY)], Vec::new()), 24)
        {
            family.agree(name, &reading, 0.02);
        }
    }
    family.judge();
}

/// A bumpy normal map on floor and box.
#[test]
fn both_sides_agree_on_normal_maps() {
    let bumps = [[0.5, 0.0, 0.8], [-0.5, 0.2, 0.8], [0.0, -0.6, 0.7], [0.2, 0.5, 0.8]];
    let texels = bumps.map(|n| 0.5 * (Vec3::from(n).normalize() + 1.0)).to_vec();
    let texture = Texture { width: 2, height: 2, texels, wrap: [Wrap::Repeat; 2] };
    let map = TextureRef { texture: 0, set: 0, transform: Affine2::from_scale(Vec2::splat(3.0)) };
    let floor = quad(Vec3::new(-0.9, 0.1, -0.9), Vec3::Z * 1.2, Vec3::X * 1.2);
    let material = Material { normal_texture: Some((map, 1.0)), ..matt(0.8) };
    let mut family = Family::default();
    for reading in readings(room_with(vec![(floor, material, Mat4::IDENTITY)], vec![texture]), 24) {
        family.agree("bumps:", &reading, 0.02);
    }
    family.judge();
}

/// Metals and glass, smooth and rough: meters read the same from both sides; the camera too, where
/// it sees no smooth glass.
#[test]
fn both_sides_agree_on_glossy_things() {
    let metallic =
        |metallic, roughness| made_of(Surface::Metallic { metallic, roughness, texture: None });
    let cases = [
        ("rough metal", metallic(1.0, 0.6), true),
        ("shiny metal", metallic(1.0, 0.35), true),
        ("plastic", metallic(0.0, 0.4), true),
        ("rough glass", made_of(Surface::Dielectric { ior: 1.5, roughness: 0.6 }), true),
        ("smooth glass", glass(), false),
    ];
    let mut family = Family::default();
    for (name, material, camera_too) in cases {
        let thing = cuboid(Vec3::new(-0.6, 0.1, -0.6), Vec3::new(0.1, 0.8, 0.1));
        for reading in readings(room_with(vec![(thing, material, Mat4::IDENTITY)], Vec::new()), 12)
        {
            if camera_too || reading.name != "eye" {
                family.agree(name, &reading, 0.03);
            }
        }
    }
    family.judge();
}

/// A mirrored node, with everything that has a hand, reads as the mesh that was mirrored by hand:
/// corners, normals, texture, normal map, emission.
#[test]
fn a_negative_scale_is_a_mirror() {
    let map = TextureRef { texture: 1, set: 0, transform: Affine2::IDENTITY };
    let picture = TextureRef { texture: 0, set: 0, transform: Affine2::IDENTITY };
    let textures = vec![chart(), tilted(Vec3::new(0.5, 0.2, 0.8))];
    let painted = Material {
        base_texture: Some(picture.clone()),
        normal_texture: Some((map, 1.0)),
        ..matt(0.9)
    };
    let lamp = Material { emission_texture: Some(picture), ..shining(3.0) };
    // Parts that are not their own mirror images, in front of the wall −x, all to be mirrored in x
    // and moved.
    let wall = quad(Vec3::new(0.5, 0.2, -0.7), Vec3::new(-0.4, 0.0, 0.9), Vec3::Y * 0.8);
    let panel = quad(Vec3::new(0.6, 0.9, 0.2), Vec3::new(-0.1, 0.5, 0.0), Vec3::Z * 0.4);
    let round = ball(Vec3::new(0.3, 0.3, 0.5), 0.25, 6, true);
    let transform = Mat4::from_translation(Vec3::new(-0.2, 0.0, 0.0))
        * Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let by_hand = |mesh: &Mesh| Mesh {
        positions: mesh.positions.iter().map(|&p| transform.transform_point3(p)).collect(),
        normals: mesh.normals.iter().map(|n| n.with_x(-n.x)).collect(),
        triangles: mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        ..mesh.clone()
    };
    let parts = [(wall, painted), (panel, lamp), (round, matt(0.8))];
    let mirrored =
        parts.iter().map(|(mesh, material)| (mesh.clone(), material.clone(), transform)).collect();
    let copied = parts
        .iter()
        .map(|(mesh, material)| (by_hand(mesh), material.clone(), Mat4::IDENTITY))
        .collect();
    let [a, b] = [mirrored, copied].map(|things| readings(room_with(things, textures.clone()), 16));
    let mut family = Family::default();
    for (a, b) in a.iter().zip(&b) {
        family.agree("mirrored node,", a, 0.02);
        family.agree("mirrored by hand,", b, 0.02);
        let (x, y) = (a.primal.as_ref().unwrap(), b.dual.as_ref().unwrap());
        family.claim(
            format!("{}: node against hand", a.name),
            x.mean,
            x.std_error.hypot(y.std_error),
            y.mean,
            0.02,
        );
        let (x, y) = (a.dual.as_ref().unwrap(), b.primal.as_ref().unwrap());
        family.claim(
            format!("{}: node's dual against hand's primal", a.name),
            x.mean,
            x.std_error.hypot(y.std_error),
            y.mean,
            0.02,
        );
    }
    family.judge();
}

/// A meter that is not part of the scene reads the same light, also far outside of everything that
/// is.
#[test]
fn a_meter_of_its_own_is_lit_too() {
    let mut scene = Scene::default();
    scene.put(quad(Vec3::ZERO, Vec3::Z, Vec3::X), matt(0.5));
    scene.light(LampKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(2.0) });
    scene.light(LampKind::Environment { radiance: Vec3::splat(0.3), image: None });
    let own = meter("own", Vec3::new(8.0, 0.5, 3.0), Vec3::Z, Vec3::X);
    let lit: Arc<_> = lit(scene);
    let reading = read(&lit, vec![Sensor::Meter(own)], WalkRule::default(), 52, 16).remove(0);
    let mut family = Family::default();
    family.both_read("outside,", &reading, 2.0 + 0.3 * PI, 0.03);
    family.judge();
}
