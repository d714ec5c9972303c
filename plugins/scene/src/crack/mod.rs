//! What one physics tells another of a member's surface: cracks and missing cover, in the world's
//! frame. Mechanics writes it, light and X-rays read it.

mod carve;
mod course;
mod cut;
mod draw;
mod planted;
mod zone;

use std::path::Path;

use bevy_ecs::component::Component;
use glam::Vec3;
use intrados_stage::access;
use serde::{Deserialize, Serialize};

use crate::{LoadError, Scene, load::denied};

/// Schema of the file.
const SCHEMA: &str = "intrados.cracks/1";
/// Longest file, bytes.
const MOST_BYTES: u64 = 64 << 20;
/// Most cracks and spalls of a file.
const MOST: usize = 200_000;
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
