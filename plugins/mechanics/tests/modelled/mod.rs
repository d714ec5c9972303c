//! Scenes of one member that came with a model.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use intrados_scene::{
    Frame, Member, MemberKind, Mesh, Object, Part, Scene, Structure,
    structure::{Hold, Place, Support},
};

/// A member of C30/37 with this surface and volume (m³), its bottom held.
pub(crate) fn alone(id: &str, kind: MemberKind, mesh: Mesh, volume: f64) -> Scene {
    let bounds = mesh
        .positions
        .iter()
        .fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high]: [Vec3; 2], p| {
            [low.min(*p), high.max(*p)]
        });
    let member = Member {
        id: id.into(),
        name: id.into(),
        kind,
        concrete: "C30/37".into(),
        concrete_assumed: false,
        exposure: None,
        frame: Frame::of_box(kind, bounds),
        bounds,
        volume,
        slices: Vec::new(),
        truth: Vec::new(),
    };
    let object = Object {
        name: id.into(),
        mesh: 0,
        transform: Mat4::IDENTITY,
        material: 0,
        member: Some(0),
        part: Part::Concrete,
    };
    let support =
        Support { member: id.into(), place: Place::Bottom, hold: Hold::Fixed, alone: false };
    let mut scene = Scene {
        meshes: vec![Arc::new(mesh)],
        objects: vec![object],
        members: vec![member],
        structure: Arc::new(Structure { supports: vec![support], ..Structure::default() }),
        ..Scene::default()
    };
    scene.assemble();
    scene
}
