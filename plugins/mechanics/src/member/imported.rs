//! Members of glTF files: their closed surface, filled with cubes.
//!
//! The cubes lie along the axes of the member's own node, not of the world, so that a beam that is turned in plan keeps flat faces. Its frame is that of its
//! box: upright members have their axis up, all others along the longer horizontal side; angle 0 is towards +z for upright ones, up for all others.

use glam::{DMat3, DVec3};
use intrados_scene::{Member, MemberKind, Part, Scene};
use intrados_stage::Job;

use super::{Axes, Draft, MemberError, Meshing, Prepared, Subject, body::cube};
use crate::mesh::voxel::voxelise;

/// Members that a glTF file brought, with a surface of their own and a kind that bears.
pub fn importable(scene: &Scene) -> impl Iterator<Item = &Member> {
    let ours: std::collections::HashSet<String> = scene.file.members.iter().flat_map(|m| m.ids()).collect();
    scene.members.iter().enumerate().filter_map(move |(i, member)| {
        let steel = matches!(member.kind, MemberKind::Tendon | MemberKind::Bar);
        let is_solid = scene.objects.iter().any(|o| o.member == Some(i) && o.part == Part::Concrete);
        (!ours.contains(&member.id) && !steel && is_solid).then_some(member)
    })
}

/// Prepares one imported member: no reinforcement is known, so that it is plain concrete.
///
/// # Errors
/// [`MemberError`]: an open surface among others, with the place of its first open edge.
pub fn prepare_imported(scene: &Scene, member: &Member, meshing: Meshing, job: &Job) -> Result<Prepared, MemberError> {
    let id = || member.id.clone();
    let (points, triangles, turn) = surface(scene, member);
    let axes = frame(member.kind, &points, turn);
    let local: Vec<DVec3> = points.iter().map(|&p| axes.local(p)).collect();
    let (low, high) = local.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    let volume = if member.volume > 0.0 { member.volume } else { (high - low).element_product() };
    // Single precision makes boxes a little larger than they are.
    let edge = cube(meshing, high - low, volume) * (1.0 + 1e-5);
    let voxels = voxelise(&local, &triangles, edge, "concrete", job).map_err(|source| MemberError::Surface { id: id(), source })?;
    let exposure = scene.file.details.iter().find(|d| d.member == member.id).and_then(|d| d.exposure.as_ref());
    let subject = Subject {
        id: &member.id,
        kind: member.kind,
        body: None,
        concrete: Some(&member.concrete),
        concrete_assumed: member.concrete_assumed,
        pours: &[],
        exposure,
        lines: Vec::new(),
    };
    let mut draft = Draft::new(scene, subject, axes);
    draft.model.mesh = voxels.mesh;
    draft.model.mesh.transform(|p| axes.world(p));
    let error = voxels.error;
    draft.notes.push(format!(
        "cubes of {:.3} × {:.3} × {:.3} m: {:+.2} % of its volume, {:.1} mm from its surface on average, {:.1} mm at most",
        voxels.spacing.x,
        voxels.spacing.y,
        voxels.spacing.z,
        100.0 * error.relative_volume(),
        1e3 * error.mean_distance,
        1e3 * error.largest_distance
    ));
    draft.notes.extend(voxels.notes);
    draft.notes.push("no reinforcement is known of it: plain concrete".into());
    if member.concrete_assumed {
        draft.notes.push(format!("its concrete is assumed: {}; name it in details of the scene", member.concrete));
    }
    draft.geometry = Some(error);
    draft.prepare(meshing, job)
}

/// All its concrete, in the world, and the axes of the first node.
fn surface(scene: &Scene, member: &Member) -> (Vec<DVec3>, Vec<[u32; 3]>, DMat3) {
    let (mut points, mut triangles, mut turn) = (Vec::new(), Vec::new(), None);
    let index = scene.members.iter().position(|m| m.id == member.id);
    for object in scene.objects.iter().filter(|o| o.member.is_some() && o.member == index && o.part == Part::Concrete) {
        let Some(mesh) = scene.meshes.get(object.mesh) else { continue };
        let matrix = object.transform.as_dmat4();
        turn = turn.or_else(|| orthonormal(DMat3::from_mat4(matrix)));
        let first = points.len() as u32;
        points.extend(mesh.positions.iter().map(|p| matrix.transform_point3(p.as_dvec3())));
        let mirrored = matrix.determinant() < 0.0;
        triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }.map(|i| i + first)));
    }
    (points, triangles, turn.unwrap_or(DMat3::IDENTITY))
}

/// The turn in a matrix, if its columns are at right angles.
fn orthonormal(m: DMat3) -> Option<DMat3> {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::try_normalize);
    let (x, y, z) = (x?, y?, z?);
    (x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()) < 1e-4).then(|| DMat3::from_cols(x, y, z))
}

/// The frame of the box along the axes of the node.
fn frame(kind: MemberKind, points: &[DVec3], turn: DMat3) -> Axes {
    let columns = [turn.x_axis, turn.y_axis, turn.z_axis];
    let span = |axis: DVec3| points.iter().map(|p| p.dot(axis)).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let length = |axis: DVec3| span(axis).1 - span(axis).0;
    let up = (0..3).max_by(|&a, &b| columns[a].y.abs().total_cmp(&columns[b].y.abs())).unwrap_or(1);
    let towards = |axis: DVec3, way: DVec3| if axis.dot(way) < 0.0 { -axis } else { axis };
    let (p, q) = (columns[(up + 1) % 3], columns[(up + 2) % 3]);
    let up = towards(columns[up], DVec3::Y);
    let (along, zero) = match kind {
        MemberKind::Column | MemberKind::Wall | MemberKind::Footing => (up, towards(if p.z.abs() > q.z.abs() { p } else { q }, DVec3::Z)),
        _ => (towards(if length(p) >= length(q) { p } else { q }, DVec3::new(1.0, 0.0, 0.999)), up),
    };
    // Exactly at right angles, however single precision turned the node.
    let along = along.normalize_or_zero();
    let zero = zero.reject_from(along).normalize_or_zero();
    let unit = [zero, along.cross(zero), along];
    let middle = |axis: DVec3| 0.5 * (span(axis).0 + span(axis).1) * axis;
    let start = middle(unit[0]) + middle(unit[1]) + span(along).0 * along;
    Axes { start, unit, length: length(along) }
}
