//! What is in a scene, in a few lines.

use std::collections::BTreeMap;

use glam::Vec3;
use serde::Serialize;

use crate::{MemberKind, Scene};

/// What is in a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub name: String,
    /// Title in the scene file.
    pub title: String,
    /// BLAKE3 of all its files.
    pub hash: String,
    /// How many members of each kind.
    pub members: BTreeMap<MemberKind, usize>,
    /// Members whose concrete class was assumed.
    pub concrete_assumed: usize,
    /// Members with CT slices.
    pub members_with_slices: usize,
    /// Members with planted or known damage.
    pub members_with_truth: usize,
    /// Objects in place.
    pub objects: usize,
    /// Their triangles.
    pub triangles: usize,
    /// Corners of the bounding box, m.
    pub bounds_m: [Vec3; 2],
    /// Lamps that are no surfaces.
    pub lamps: usize,
    /// Objects that emit light.
    pub emitting_objects: usize,
    /// Names of the cameras.
    pub cameras: Vec<String>,
    /// Names of the meters.
    pub meters: Vec<String>,
    /// Materials in use.
    pub materials: usize,
    /// Those of them that were assumed.
    pub materials_assumed: Vec<String>,
    /// Textures.
    pub textures: usize,
    /// Supports.
    pub supports: usize,
    /// Loads.
    pub loads: usize,
    /// Gauges.
    pub gauges: usize,
    /// Scanners.
    pub scanners: usize,
    /// What a user should know.
    pub warnings: Vec<String>,
}

impl Scene {
    /// Counts what is in it.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let mut members = BTreeMap::new();
        for member in &self.members {
            *members.entry(member.kind).or_default() += 1;
        }
        let mut used = vec![0_usize; self.materials.len()];
        for object in &self.objects {
            if let Some(n) = used.get_mut(object.material) {
                *n += 1;
            }
        }
        let in_use = || self.materials.iter().zip(&used).filter(|(_, n)| **n > 0);
        Summary {
            name: self.name.clone(),
            title: self.title.clone(),
            hash: self.hash.clone(),
            members,
            concrete_assumed: self.members.iter().filter(|m| m.concrete_assumed).count(),
            members_with_slices: self.members.iter().filter(|m| !m.slices.is_empty()).count(),
            members_with_truth: self.members.iter().filter(|m| !m.truth.is_empty()).count(),
            objects: self.objects.len(),
            triangles: self.triangle_count(),
            bounds_m: self.bounds(),
            lamps: self.lamps.len(),
            emitting_objects: in_use()
                .filter(|(m, _)| m.emission != Vec3::ZERO)
                .map(|(_, n)| n)
                .sum(),
            cameras: self.cameras.iter().map(|k| k.name.clone()).collect(),
            meters: self.meters.iter().map(|m| m.name.clone()).collect(),
            materials: in_use().count(),
            materials_assumed: in_use()
                .filter(|(m, _)| m.assumed)
                .map(|(m, _)| m.name.clone())
                .collect(),
            textures: self.textures.len(),
            supports: self.structure.supports.len(),
            loads: self.structure.loads.len(),
            gauges: self.structure.gauges.len(),
            scanners: self.structure.scanners.len(),
            warnings: self.warnings.clone(),
        }
    }
}
