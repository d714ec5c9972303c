//! What one physics tells another of a member's surface: cracks and missing cover, in the world's
//! frame. Mechanics writes it, light and X-rays read it.

use std::path::Path;

use bevy_ecs::component::Component;
use glam::Vec3;
use intrados_stage::{access, random::Key};
use serde::{Deserialize, Serialize};

use crate::{
    Hit, LoadError, Material, Mesh, Object, Part, Ray, Scene, Tracer, load::denied, tracer::Scratch,
};

/// Schema of the file.
const SCHEMA: &str = "intrados.cracks/1";
/// Longest file, bytes.
const MOST_BYTES: u64 = 64 << 20;
/// Most cracks and spalls of a file.
const MOST: usize = 200_000;
/// How far drawn cracks float above the surface, m.
const FLOAT: f32 = 3e-4;
/// Longest straight piece of a drawn crack, m.
const PIECE: f32 = 0.012;
/// A crack wanders by this share of the length of a piece.
const ROUGH: f32 = 0.3;
/// Within this distance of the member's surface a crack is moved onto it, m.
const NEAR: f32 = 0.05;

/// A point of a crack's mouth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mouth {
    /// Where, m.
    pub at: Vec3,
    /// Unit, out of the concrete.
    pub outward: Vec3,
    /// Opening, m.
    pub width: f32,
}

/// A crack: where it meets the surface, and how it goes on inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrackSurface {
    /// Its mouth, a line of at least two points.
    pub mouth: Vec<Mouth>,
    /// Unit, across its mean plane.
    pub normal: Vec3,
    /// How deep it goes, m.
    pub depth: f32,
}

/// Cover that has come off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spalled {
    /// Its middle on the surface, m.
    pub centre: Vec3,
    /// Unit, out of the concrete.
    pub outward: Vec3,
    /// m.
    pub radius: f32,
    /// m.
    pub depth: f32,
}

/// All that is to be seen of a member's damage; a component of the member's entity.
#[derive(Component, Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceDamage {
    /// Id of the member.
    pub member: String,
    /// Cracks.
    pub cracks: Vec<CrackSurface>,
    /// Missing cover.
    pub spalls: Vec<Spalled>,
}

impl SurfaceDamage {
    /// Whether there is nothing to see.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cracks.is_empty() && self.spalls.is_empty()
    }

    /// Opening of the widest crack, m.
    #[must_use]
    pub fn widest(&self) -> f32 {
        self.cracks.iter().flat_map(|c| &c.mouth).map(|m| m.width).fold(0.0, f32::max)
    }

    fn check(&self) -> Result<(), String> {
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-3;
        let mouth =
            |m: &Mouth| m.at.is_finite() && unit(m.outward) && (0.0..1.0).contains(&m.width);
        let crack = |c: &CrackSurface| {
            c.mouth.len() >= 2
                && c.mouth.iter().all(mouth)
                && unit(c.normal)
                && (0.0..100.0).contains(&c.depth)
        };
        if let Some(i) = self.cracks.iter().position(|c| !crack(c)) {
            return Err(format!(
                "member {}, crack {}: needs two points or more with places, unit normals and widths below 1 m",
                self.member,
                i + 1
            ));
        }
        let size = |v: f32| v > 0.0 && v < 100.0;
        let spall = |s: &Spalled| {
            s.centre.is_finite() && unit(s.outward) && size(s.radius) && size(s.depth)
        };
        match self.spalls.iter().position(|s| !spall(s)) {
            Some(i) => Err(format!(
                "member {}, spall {}: needs a place, a unit normal, a radius and a depth",
                self.member,
                i + 1
            )),
            None => Ok(()),
        }
    }
}

/// Damage of the members of one scene, as a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceFile {
    schema: String,
    /// Hash of the scene that it was computed from.
    pub scene_hash: String,
    /// Everything in metres, in the scene's frame.
    unit: String,
    /// By member.
    pub members: Vec<SurfaceDamage>,
}

impl SurfaceFile {
    /// Of a scene.
    #[must_use]
    pub fn new(scene_hash: &str, members: Vec<SurfaceDamage>) -> Self {
        Self { schema: SCHEMA.into(), scene_hash: scene_hash.into(), unit: "m".into(), members }
    }

    /// Reads a file for `scene`.
    ///
    /// # Errors
    /// It is not there, is too long, is no such file, belongs to another scene, or holds what
    /// cannot be.
    pub fn read(path: &Path, scene: &Scene) -> Result<Self, LoadError> {
        let place = path.display().to_string();
        let bad = |message: String| LoadError::bad(&place, "CRACKS", message);
        let text = access::read(path, MOST_BYTES).map_err(|e| denied(&place, &e))?;
        let file: Self = serde_json::from_slice(&text).map_err(|e| {
            bad(format!("{e}: take the cracks.json that `intrados analyze --out` writes"))
        })?;
        if file.schema != SCHEMA {
            return Err(bad(format!(
                "its schema is not {SCHEMA}: take the cracks.json that `intrados analyze --out` writes"
            )));
        }
        if file.scene_hash != scene.hash {
            return Err(bad(format!(
                "was computed from another state of {}: analyze that scene again",
                scene.name
            )));
        }
        if file.members.iter().map(|m| m.cracks.len() + m.spalls.len()).sum::<usize>() > MOST {
            return Err(bad(format!(
                "holds more than {MOST} cracks: analyze with larger elements"
            )));
        }
        for member in &file.members {
            member.check().map_err(&bad)?;
            if !scene.members.iter().any(|m| m.id == member.member) {
                return Err(bad(format!("the scene has no member {}", member.member)));
            }
        }
        Ok(file)
    }
}

impl Scene {
    /// The scene with damage to be seen: cracks as dark bands as wide as they are times `widening`,
    /// missing cover as rough, dark bowls. Its hash says that it is another scene. Members that the
    /// scene has not are left out.
    #[must_use]
    pub fn marked(&self, damage: &[SurfaceDamage], widening: f32) -> Self {
        let mut scene = self.clone();
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.hash.as_bytes());
        hasher.update(&widening.to_le_bytes());
        let first = scene.materials.len();
        let plain = |name: &str, grey: f32| Material {
            name: name.into(),
            assumed: false,
            base_colour: Vec3::splat(grey),
            ..Material::default()
        };
        scene.materials.extend([plain("crack", 0.015), plain("broken concrete", 0.16)]);
        for damage in damage.iter().filter(|d| !d.is_empty()) {
            let Some(member) = scene.members.iter().position(|m| m.id == damage.member) else {
                continue;
            };
            let surface = Surface::of(self, member);
            let mut cracks = Mesh::default();
            for (number, crack) in damage.cracks.iter().enumerate() {
                ribbon(
                    &surface,
                    crack,
                    widening,
                    Key::new(member as u64, number as u64),
                    &mut cracks,
                );
            }
            let mut bowls = Mesh::default();
            damage.spalls.iter().for_each(|spall| patch(&surface, spall, &mut bowls));
            for (mesh, material, name) in
                [(cracks, first, "cracks"), (bowls, first + 1, "missing cover")]
            {
                mesh.positions.iter().flat_map(|p| p.to_array()).for_each(|x| {
                    hasher.update(&x.to_le_bytes());
                });
                if !mesh.triangles.is_empty() {
                    scene.objects.push(Object {
                        name: format!("{name} of {}", damage.member),
                        mesh: scene.meshes.len(),
                        transform: glam::Mat4::IDENTITY,
                        material,
                        member: Some(member),
                        part: Part::Concrete,
                    });
                    scene.meshes.push(mesh.into());
                }
            }
        }
        scene.hash = hasher.finalize().to_hex().to_string();
        scene
    }
}

/// The concrete of a member, to put things on.
struct Surface(Tracer);

impl Surface {
    fn of(scene: &Scene, member: usize) -> Self {
        let mut triangles = Vec::new();
        for object in
            scene.objects.iter().filter(|o| o.member == Some(member) && o.part == Part::Concrete)
        {
            let mesh = &scene.meshes[object.mesh];
            triangles.extend(
                (0..mesh.triangles.len())
                    .map(|t| mesh.corners(t).map(|p| object.transform.transform_point3(p))),
            );
        }
        Self(Tracer::build(&triangles))
    }

    /// The points moved onto the surface along their normals, and a little above it; where none is
    /// near they stay.
    fn put(&self, points: &[(Vec3, Vec3)]) -> Vec<Vec3> {
        let rays: Vec<Ray> = points
            .iter()
            .map(|&(p, outward)| Ray::new(p + NEAR * outward, -outward, 2.0 * NEAR))
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.0.closest(&rays, &mut hits, &mut Scratch::default());
        points
            .iter()
            .zip(&hits)
            .map(|(&(p, outward), hit)| {
                p + outward * (FLOAT + if hit.t.is_finite() { NEAR - hit.t } else { 0.0 })
            })
            .collect()
    }
}

/// A crack's mouth as a rough band that ends in points.
fn ribbon(surface: &Surface, crack: &CrackSurface, widening: f32, key: Key, mesh: &mut Mesh) {
    let mut line: Vec<Mouth> = Vec::new();
    for pair in crack.mouth.windows(2) {
        let pieces = (pair[0].at.distance(pair[1].at) / PIECE).ceil().clamp(1.0, 1000.0) as u32;
        let mix = |t: f32| Mouth {
            at: pair[0].at.lerp(pair[1].at, t),
            outward: pair[0].outward.lerp(pair[1].outward, t).normalize_or(pair[0].outward),
            width: pair[0].width + (pair[1].width - pair[0].width) * t,
        };
        line.extend((u32::from(!line.is_empty())..=pieces).map(|k| mix(k as f32 / pieces as f32)));
    }
    let last = line.len().saturating_sub(1);
    let mut sides = Vec::with_capacity(2 * line.len());
    for (i, m) in line.iter().enumerate() {
        let along = line[(i + 1).min(last)].at - line[i.saturating_sub(1)].at;
        let across = along.cross(m.outward).normalize_or_zero();
        let end = i == 0 || i == last;
        let wander = if end { 0.0 } else { ROUGH * PIECE * (key.unit(2 * i as u32) - 0.5) };
        // Edges break: the opening is uneven.
        let half = if end { 0.1 } else { 0.7 + 0.6 * key.unit(2 * i as u32 + 1) }
            * 0.5
            * m.width
            * widening;
        sides.extend([wander - half, wander + half].map(|s| (m.at + s * across, m.outward)));
    }
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(surface.put(&sides));
    for k in (0..last as u32).map(|k| base + 2 * k) {
        mesh.triangles.extend([[k, k + 1, k + 2], [k + 1, k + 3, k + 2]]);
    }
}

/// Missing cover: an uneven patch of broken concrete.
fn patch(surface: &Surface, spall: &Spalled, mesh: &mut Mesh) {
    const ROUND: u32 = 28;
    let (u, v) = spall.outward.any_orthonormal_pair();
    let key = Key::new(
        u64::from(spall.centre.x.to_bits()) << 32 | u64::from(spall.centre.y.to_bits()),
        u64::from(spall.centre.z.to_bits()),
    );
    let rim = (0..ROUND).map(|k| {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / ROUND as f32).sin_cos();
        (
            spall.centre + spall.radius * (0.75 + 0.4 * key.unit(k)) * (cos * u + sin * v),
            spall.outward,
        )
    });
    let points: Vec<_> = std::iter::once((spall.centre, spall.outward)).chain(rim).collect();
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(surface.put(&points));
    mesh.triangles.extend((0..ROUND).map(|k| [base, base + 1 + k, base + 1 + (k + 1) % ROUND]));
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;

    fn cracked() -> (Scene, SurfaceDamage) {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let [low, high] = scene.members[0].bounds;
        // Across the front, 2 mm in front of it.
        let at =
            |x: f32| Mouth { at: Vec3::new(x, 1.5, high.z + 0.002), outward: Vec3::Z, width: 1e-3 };
        let mouth = vec![at(low.x + 0.02), at(0.5 * (low.x + high.x)), at(high.x - 0.02)];
        let crack = CrackSurface { mouth, normal: Vec3::Y, depth: 0.1 };
        let damage = SurfaceDamage {
            member: scene.members[0].id.clone(),
            cracks: vec![crack],
            spalls: Vec::new(),
        };
        (scene, damage)
    }

    #[test]
    fn a_crack_lies_on_its_member_and_is_as_wide_as_it_is() {
        let (scene, damage) = cracked();
        let marked = scene.marked(std::slice::from_ref(&damage), 1.0);
        assert_ne!(marked.hash, scene.hash);
        let added = &marked.objects[scene.objects.len()..];
        assert_eq!(added.len(), 1);
        let mesh = &marked.meshes[added[0].mesh];
        let front = scene.members[0].bounds[1].z;
        assert!(
            mesh.positions.iter().all(|p| (p.z - front - FLOAT).abs() < 1e-5),
            "{:?}",
            mesh.positions
        );
        // Length × mean width, within what unevenness takes and gives.
        let area = mesh.area();
        let length = f64::from(scene.members[0].bounds[1].x - scene.members[0].bounds[0].x - 0.04);
        assert!((0.8..1.2).contains(&(area / (length * 1e-3))), "{area}");
        assert!(
            (scene.marked(&[damage], 3.0).meshes.last().unwrap().area() / area - 3.0).abs() < 0.1
        );
    }

    #[test]
    fn a_file_comes_back_and_a_bad_one_is_refused() {
        let (scene, damage) = cracked();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cracks.json");
        let file = SurfaceFile::new(&scene.hash, vec![damage.clone()]);
        std::fs::write(&path, serde_json::to_string(&file).unwrap()).unwrap();
        assert_eq!(SurfaceFile::read(&path, &scene).unwrap(), file);
        let refused = |file: &SurfaceFile| {
            std::fs::write(&path, serde_json::to_string(file).unwrap()).unwrap();
            SurfaceFile::read(&path, &scene).unwrap_err().to_string()
        };
        assert!(refused(&SurfaceFile::new("another", Vec::new())).contains("another state"));
        let mut thin = damage.clone();
        thin.cracks[0].mouth.truncate(1);
        assert!(refused(&SurfaceFile::new(&scene.hash, vec![thin])).contains("crack 1"));
        let unknown = SurfaceDamage { member: "nobody".into(), ..damage };
        assert!(
            refused(&SurfaceFile::new(&scene.hash, vec![unknown])).contains("no member nobody")
        );
        assert!(SurfaceFile::read(&folder.path().join("none"), &scene).is_err());
    }
}
