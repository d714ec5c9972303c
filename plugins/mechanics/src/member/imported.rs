//! Members of glTF files: their closed surface, filled with cubes.
//!
//! The cubes lie along the axes of the member's own node, not of the world, so that a beam that is
//! turned in plan keeps flat faces. Its frame is the one that its model states, else that of its
//! box: upright members have their axis up, all others along the longer horizontal side; angle 0 is
//! towards +z for upright ones, up for all others.

use glam::{DMat3, DVec3};
use intrados_scene::{Assembly, Frame, Member, MemberKind, Object, Part, Scene};
use intrados_stage::Job;

use super::{Axes, Draft, MemberError, Meshing, body::cube};
use crate::mesh::voxel::{Voxels, voxelise};

/// Share of its volume that a member may miss or have too much.
const MISSED: f64 = 0.02;
/// Cubes that miss it are made smaller by this, until there are so many, or none is larger than so
/// many metres.
const FINER: f64 = 0.75;
const MOST: usize = 12_000;
const SMALLEST: f64 = 0.005;

/// An assembly that came with a model, filled with cubes.
pub(super) fn fill<'a>(
    scene: &'a Scene,
    assembly: &'a Assembly,
    meshing: Meshing,
    job: &Job,
) -> Result<Draft<'a>, MemberError> {
    let Some(member) = scene.members.iter().find(|m| m.id == assembly.id) else {
        return Err(MemberError::Unsupported {
            id: assembly.id.clone(),
            what: "it has no surface: give it one in its model".into(),
        });
    };
    let (points, triangles, turn) = surface(scene, member);
    let own = axes(member, &points, turn);
    let in_axes = |axes: &Axes| {
        let local: Vec<DVec3> = points.iter().map(|&p| axes.local(p)).collect();
        let [low, high] = local
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], &p| [l.min(p), h.max(p)]);
        let size = high - low;
        let volume = if member.volume > 0.0 { member.volume } else { size.element_product() };
        filled(&local, &triangles, cube(meshing, size, volume), &member.id, job)
    };
    // Along its faces cubes miss a chamfer all along; across them they meet it on the average.
    let (axes, voxels) = match in_axes(&own) {
        Err(MemberError::Unsupported { .. }) if is_stated(member) => {
            let boxed = frame(member.kind, &points, turn);
            (boxed, in_axes(&boxed)?)
        }
        found => (own, found?),
    };
    let mut draft = Draft::new(scene, assembly, axes);
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
    if assembly.steel.is_empty() {
        draft.notes.push("no reinforcement is known of it: plain concrete".into());
    }
    if assembly.steel_assumed {
        draft.notes.push(
            "its reinforcement is assumed: the least that a code allows; state it in details of the scene".into(),
        );
    }
    let unused = steel_nodes(scene, member);
    if unused > 0 && assembly.steel.is_empty() {
        draft.warnings.push(format!(
            "{unused} nodes of bars, stirrups and tendons in member {} are not used: it is computed as plain concrete",
            member.id
        ));
    }
    if member.concrete_assumed {
        draft.notes.push(format!(
            "its concrete is assumed: {}; name it in details of the scene",
            member.concrete
        ));
    }
    draft.geometry = Some(error);
    Ok(draft)
}

/// Its surface filled with cubes, smaller ones than `edge` where that misses its volume.
fn filled(
    points: &[DVec3],
    triangles: &[[u32; 3]],
    edge: f64,
    id: &str,
    job: &Job,
) -> Result<Voxels, MemberError> {
    // Single precision makes boxes a little larger than they are.
    let mut edge = edge * (1.0 + 1e-5);
    loop {
        let voxels = voxelise(points, triangles, edge, "concrete", job)
            .map_err(|source| MemberError::Surface { id: id.into(), source })?;
        let off = voxels.error.relative_volume();
        if off.abs() <= MISSED {
            return Ok(voxels);
        }
        if voxels.mesh.hexes.len() > MOST || edge < SMALLEST {
            let what = format!(
                "cubes of {edge:.3} m have {:+.0} % of its volume, and {:.0} % is allowed: {}",
                100.0 * off,
                100.0 * MISSED,
                if voxels.error.dropped_volume > MISSED * voxels.error.surface_volume {
                    "it has several bodies of which only the largest is computed: join them, or make members of them"
                } else {
                    "give smaller ones (--element), or split the member"
                }
            );
            return Err(MemberError::Unsupported { id: id.into(), what });
        }
        edge *= FINER;
    }
}

/// Nodes of steel that a model brings for a member: its own parts, and members of steel whose
/// middle lies within its box.
fn steel_nodes(scene: &Scene, member: &Member) -> usize {
    let index = scene.members.iter().position(|m| m.id == member.id);
    let own = |o: &&Object| o.member == index && o.part != Part::Concrete;
    let [low, high] = member.bounds;
    let within = |m: &&Member| {
        let middle = 0.5 * (m.bounds[0] + m.bounds[1]);
        matches!(m.kind, MemberKind::Tendon | MemberKind::Bar) && middle.clamp(low, high) == middle
    };
    scene.objects.iter().filter(own).count() + scene.members.iter().filter(within).count()
}

/// All its concrete, in the world, and the axes of the first node.
pub(crate) fn surface(scene: &Scene, member: &Member) -> (Vec<DVec3>, Vec<[u32; 3]>, DMat3) {
    let (mut points, mut triangles, mut turn) = (Vec::new(), Vec::new(), None);
    let index = scene.members.iter().position(|m| m.id == member.id);
    for object in scene
        .objects
        .iter()
        .filter(|o| o.member.is_some() && o.member == index && o.part == Part::Concrete)
    {
        let Some(mesh) = scene.meshes.get(object.mesh) else { continue };
        let matrix = object.transform.as_dmat4();
        turn = turn.or_else(|| orthonormal(DMat3::from_mat4(matrix)));
        let first = points.len() as u32;
        points.extend(mesh.positions.iter().map(|p| matrix.transform_point3(p.as_dvec3())));
        let mirrored = matrix.determinant() < 0.0;
        triangles.extend(
            mesh.triangles
                .iter()
                .map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }.map(|i| i + first)),
        );
    }
    (points, triangles, turn.unwrap_or(DMat3::IDENTITY))
}

/// The turn in a matrix, if its columns are at right angles.
fn orthonormal(m: DMat3) -> Option<DMat3> {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::try_normalize);
    let (x, y, z) = (x?, y?, z?);
    (x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs()) < 1e-4)
        .then(|| DMat3::from_cols(x, y, z))
}

/// Whether its model states its frame, rather than its box.
fn is_stated(member: &Member) -> bool {
    member.frame != Frame::of_box(member.kind, member.bounds)
}

/// The frame that its model states, else that of its box.
pub(crate) fn axes(member: &Member, points: &[DVec3], turn: DMat3) -> Axes {
    match is_stated(member) {
        true => Axes::of(&member.frame),
        false => frame(member.kind, points, turn),
    }
}

/// The frame of the box along the axes of the node.
fn frame(kind: MemberKind, points: &[DVec3], turn: DMat3) -> Axes {
    let columns = [turn.x_axis, turn.y_axis, turn.z_axis];
    let span = |axis: DVec3| {
        points
            .iter()
            .map(|p| p.dot(axis))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
    };
    let length = |axis: DVec3| span(axis).1 - span(axis).0;
    let up = (0..3).max_by(|&a, &b| columns[a].y.abs().total_cmp(&columns[b].y.abs())).unwrap_or(1);
    let towards = |axis: DVec3, way: DVec3| if axis.dot(way) < 0.0 { -axis } else { axis };
    let (p, q) = (columns[(up + 1) % 3], columns[(up + 2) % 3]);
    let up = towards(columns[up], DVec3::Y);
    let (along, zero) = match kind {
        MemberKind::Column | MemberKind::Wall | MemberKind::Footing => {
            (up, towards(if p.z.abs() > q.z.abs() { p } else { q }, DVec3::Z))
        }
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
