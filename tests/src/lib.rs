//! Tests across plugins live in `tests/tests`; here is what they share.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use intrados_light::{LitScene, Measurement, MeterReading, Sensor, Shard, SideReading, Sides};
use intrados_scene::{Camera, Lamp, LampKind, Material, Mesh, Meter, Object, Part, Scene, Surface};
use intrados_stage::Job;
use intrados_transport::{WalkRule, verify::sidak_z};

/// A bundled scene, compiled.
///
/// # Panics
/// If it does not load: then a test has failed.
#[must_use]
pub fn bundled(name: &str) -> Arc<LitScene> {
    let scene =
        Scene::load_bundled(name, &Job::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
    lit(scene)
}

/// A scene, compiled.
///
/// # Panics
/// Never: nobody cancels the job.
#[must_use]
pub fn lit(scene: Scene) -> Arc<LitScene> {
    Arc::new(LitScene::build(Arc::new(scene), &Job::default()).unwrap_or_else(|e| panic!("{e}")))
}

/// A matt material.
#[must_use]
pub fn matt(albedo: f32) -> Material {
    Material {
        name: "matt".into(),
        assumed: false,
        base_colour: Vec3::splat(albedo),
        ..Material::default()
    }
}

/// A black material that shines.
#[must_use]
pub fn shining(radiance: f32) -> Material {
    Material {
        name: "lamp".into(),
        assumed: false,
        surface: Surface::Black,
        emission: Vec3::splat(radiance),
        ..Material::default()
    }
}

/// A material of some other surface, white.
#[must_use]
pub fn made_of(surface: Surface) -> Material {
    Material {
        name: "other".into(),
        assumed: false,
        surface,
        base_colour: Vec3::ONE,
        ..Material::default()
    }
}

/// The parallelogram at `corner`, its front where `u × v` points.
#[must_use]
pub fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Mesh {
    let positions = vec![corner, corner + u, corner + u + v, corner + v];
    let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(glam::Vec2::from).to_vec();
    Mesh {
        positions,
        uv: [uv, Vec::new()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A box between two corners, its front outside.
#[must_use]
pub fn cuboid(lo: Vec3, hi: Vec3) -> Mesh {
    let d = hi - lo;
    let [x, y, z] = [Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z];
    let mut mesh = Mesh::default();
    for (p, u, v) in
        [(lo, x, z), (lo + y, z, x), (lo, z, y), (lo + x, y, z), (lo, y, x), (lo + z, x, y)]
    {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([p, p + u, p + u + v, p + v]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}

/// A sphere of `rings` × 2 `rings` facets, with the sphere's own normals if `smooth`.
#[must_use]
pub fn ball(centre: Vec3, radius: f32, rings: u32, smooth: bool) -> Mesh {
    let around = 2 * rings;
    let mut mesh = Mesh::default();
    for i in 0..=rings {
        for j in 0..=around {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * (j % around) as f32 / around as f32,
            );
            let n = Vec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            mesh.positions.push(centre + radius * n);
            if smooth {
                mesh.normals.push(n);
            }
        }
    }
    for i in 0..rings {
        for j in 0..around {
            let (a, b) = (i * (around + 1) + j, (i + 1) * (around + 1) + j);
            if i > 0 {
                mesh.triangles.push([a, b, a + 1]);
            }
            if i + 1 < rings {
                mesh.triangles.push([a + 1, b, b + 1]);
            }
        }
    }
    mesh
}

/// Puts things into a scene.
pub trait Furnish {
    /// A mesh as it is.
    fn put(&mut self, mesh: Mesh, material: Material) -> &mut Self {
        self.place(mesh, material, Mat4::IDENTITY)
    }
    /// A mesh, moved, turned, scaled or mirrored.
    fn place(&mut self, mesh: Mesh, material: Material, transform: Mat4) -> &mut Self;
    /// A lamp that is no surface.
    fn light(&mut self, kind: LampKind) -> &mut Self;
}

impl Furnish for Scene {
    fn place(&mut self, mesh: Mesh, material: Material, transform: Mat4) -> &mut Self {
        self.objects.push(Object {
            name: material.name.clone(),
            mesh: self.meshes.len(),
            transform,
            material: self.materials.len(),
            member: None,
            part: Part::Scenery,
        });
        self.meshes.push(Arc::new(mesh));
        self.materials.push(material);
        self
    }

    fn light(&mut self, kind: LampKind) -> &mut Self {
        self.lamps.push(Lamp { name: "lamp".into(), kind });
        self
    }
}

/// A camera of 32 × 32 pixels.
#[must_use]
pub fn camera(position: Vec3, target: Vec3, fov_deg: f32) -> Camera {
    Camera {
        name: "eye".into(),
        position,
        target,
        up: Vec3::Y,
        fov_deg,
        width: 32,
        height: 32,
        exposure: 0.0,
        lens: None,
    }
}

/// A meter.
#[must_use]
pub fn meter(name: &str, corner: Vec3, u: Vec3, v: Vec3) -> Meter {
    Meter { name: name.into(), corner, u, v, on: None }
}

/// All cameras and meters of a scene.
#[must_use]
pub fn sensors(scene: &Scene) -> Vec<Sensor> {
    scene
        .cameras
        .iter()
        .cloned()
        .map(Sensor::Camera)
        .chain(scene.meters.iter().cloned().map(Sensor::Meter))
        .collect()
}

/// Readings of `sensors` from both sides, `passes` passes each.
#[must_use]
pub fn read(
    lit: &Arc<LitScene>,
    sensors: Vec<Sensor>,
    rule: WalkRule,
    seed: u64,
    passes: u32,
) -> Vec<MeterReading> {
    let mut measurement =
        Measurement::new(Arc::clone(lit), sensors, Sides::Both, rule, seed, Shard::default(), None);
    measurement.advance_all(passes);
    measurement.readings()
}

/// Claims that are judged together: none may be further from what it should be than chance allows
/// once in a hundred such families (Šidák), and none may have an error so large that it could not
/// fail. The seeds are fixed: a family passes always or never.
#[derive(Debug, Default)]
pub struct Family {
    claims: Vec<Claim>,
}

#[derive(Debug)]
struct Claim {
    name: String,
    value: f64,
    expected: f64,
    error: f64,
    slack: f64,
    largest_error: f64,
}

impl Family {
    /// What f32 arithmetic may add to an error bar, relative: a walk is some hundred roundings of
    /// 6e-8, half of them to one side.
    const ROUNDING: f64 = 1e-5;

    /// `value` ± `error` (standard) should be `expected`, and its error at most `largest_error`,
    /// relative to what is expected.
    pub fn claim(
        &mut self,
        name: impl Into<String>,
        value: f64,
        error: f64,
        expected: f64,
        largest_error: f64,
    ) {
        self.claim_within(name, value, error, expected, 0.0, largest_error);
    }

    /// The same where `expected` itself is known within ± `slack` only (a bound, relative).
    pub fn claim_within(
        &mut self,
        name: impl Into<String>,
        value: f64,
        error: f64,
        expected: f64,
        slack: f64,
        largest_error: f64,
    ) {
        let slack = (slack + Self::ROUNDING) * expected.abs();
        self.claims.push(Claim { name: name.into(), value, expected, error, slack, largest_error });
    }

    /// A side's reading against a closed form.
    pub fn reads(
        &mut self,
        name: &str,
        side: Option<&SideReading>,
        expected: f64,
        largest_error: f64,
    ) {
        match side {
            Some(r) => self.claim(
                format!("{name}, {} walks", r.walks),
                r.mean,
                r.std_error,
                expected,
                largest_error,
            ),
            None => self.claim(format!("{name}: not read"), f64::NAN, 0.0, expected, largest_error),
        }
    }

    /// Both sides against a closed form.
    pub fn both_read(
        &mut self,
        name: &str,
        reading: &MeterReading,
        expected: f64,
        largest_error: f64,
    ) {
        self.reads(
            &format!("{name} {} primal", reading.name),
            reading.primal.as_ref(),
            expected,
            largest_error,
        );
        self.reads(
            &format!("{name} {} dual", reading.name),
            reading.dual.as_ref(),
            expected,
            largest_error,
        );
    }

    /// The two sides against each other.
    pub fn agree(&mut self, name: &str, reading: &MeterReading, largest_error: f64) {
        let (Some(p), Some(d)) = (&reading.primal, &reading.dual) else {
            return self.claim(
                format!("{name}: not read from both sides"),
                f64::NAN,
                0.0,
                1.0,
                largest_error,
            );
        };
        let name = format!("{name} {}: primal against dual", reading.name);
        self.claim(name, p.mean, p.std_error.hypot(d.std_error), d.mean, largest_error);
    }

    /// Judges all claims.
    ///
    /// # Panics
    /// If one of them fails.
    #[track_caller]
    pub fn judge(&self) {
        assert!(!self.claims.is_empty(), "nothing was claimed");
        let z = sidak_z(self.claims.len());
        let mut failed = String::new();
        for c in &self.claims {
            let off = (c.value - c.expected).abs();
            let words = format!(
                "{}: {:.6e} ± {:.1e} ({:.2} %), expected {:.6e}, off by {:.2} standard errors (limit {z:.2})",
                c.name,
                c.value,
                c.error,
                100.0 * c.error / c.expected.abs(),
                c.expected,
                off / c.error
            );
            eprintln!("{words}");
            // Not a number must fail, too.
            let near = off <= z * c.error + c.slack;
            let sharp = c.error <= c.largest_error * c.expected.abs();
            if !near || !sharp {
                failed += &format!(
                    "\n{words}{}",
                    if sharp { "" } else { ": the error is too large to prove anything" }
                );
            }
        }
        assert!(failed.is_empty(), "{failed}");
    }
}
