//! Parametric members to meshes.

mod surface;

use glam::Vec3;
use intrados_stage::Job;

use crate::{LoadError, Material, Part, Scene, Surface, file};

pub(crate) use surface::surface_meter;

/// Bare steel, for bars, stirrups and tendons.
pub(crate) fn steel() -> Material {
    Material {
        name: "steel".into(),
        assumed: false,
        surface: Surface::Metallic { metallic: 1.0, roughness: 0.5, texture: None },
        base_colour: Vec3::new(0.42, 0.38, 0.35),
        ..Material::default()
    }
}

/// Adds a member, or a tunnel's lining and segments, with all their parts.
pub(crate) fn add(_scene: &mut Scene, member: &file::Member, _concrete: usize, _steel: usize, _job: &Job) -> Result<(), LoadError> {
    Err(LoadError::bad(&member.id, "NOT_YET", "parametric members are not built yet"))
}

/// Sets the members' boxes from their concrete.
pub(crate) fn measure_bounds(scene: &mut Scene) {
    let mut bounds = vec![[Vec3::INFINITY, Vec3::NEG_INFINITY]; scene.members.len()];
    for object in scene.objects.iter().filter(|o| o.part == Part::Concrete) {
        let Some(bounds) = object.member.and_then(|m| bounds.get_mut(m)) else { continue };
        for p in scene.meshes.get(object.mesh).map_or(&[][..], |m| &m.positions) {
            let p = object.transform.transform_point3(*p);
            *bounds = [bounds[0].min(p), bounds[1].max(p)];
        }
    }
    for (member, bounds) in scene.members.iter_mut().zip(bounds) {
        if bounds[0].x <= bounds[1].x {
            member.bounds = bounds;
        }
    }
}
