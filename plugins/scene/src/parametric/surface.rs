//! Meters on members.

use glam::Vec3;

use crate::{MemberKind, Meter, Part, Scene};

/// How far above the surface a meter floats, m.
const ABOVE: f32 = 1e-3;

/// A square meter on the surface of the member `on`, tangent to it and just above. Outside of a
/// member, inside of a lining. `None` where no surface is there.
pub(crate) fn surface_meter(
    scene: &Scene,
    name: &str,
    on: &str,
    along: f32,
    angle_deg: f32,
    size: f32,
) -> Option<Meter> {
    let (index, member) = scene.members.iter().enumerate().find(|(_, m)| m.id == on)?;
    let frame = member.frame;
    // Keep the meter on the member where `along` is at an end.
    let margin = (0.5 * size / frame.axis.length().max(1e-6)).min(0.5);
    let axis_point = frame.point(along.clamp(margin, 1.0 - margin));
    let radial = frame.radial(angle_deg);
    let inside = matches!(member.kind, MemberKind::Lining | MemberKind::Segment);
    let reach = 2.0 * (member.bounds[1] - member.bounds[0]).length() + 1.0;
    let (origin, direction) =
        if inside { (axis_point, radial) } else { (axis_point + reach * radial, -radial) };
    let (t, normal) = first_hit(scene, index, origin, direction)?;
    let point = origin + t * direction;
    let v = (frame.axis - frame.axis.dot(normal) * normal)
        .normalize_or(normal.any_orthonormal_vector());
    let u = v.cross(normal);
    let corner = -0.5 * size * (u + v);
    // On a concave face the corners are the first to sink in: lift the square until they do not.
    let highest = [corner, corner + size * u, corner + size * (u + v), corner + size * v]
        .into_iter()
        .filter_map(|offset| {
            first_hit(scene, index, point + offset + size * normal, -normal).map(|(t, _)| size - t)
        })
        .fold(0.0_f32, f32::max);
    let corner = point + corner + (highest + ABOVE) * normal;
    Some(Meter { name: name.into(), corner, u: size * u, v: size * v, on: Some(on.to_owned()) })
}

/// Distance to the member's concrete and the normal there, turned against the ray. Plain
/// Möller–Trumbore in double precision: a handful of rays a scene.
fn first_hit(scene: &Scene, member: usize, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    let mut best: Option<(f64, Vec3)> = None;
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    for object in
        scene.objects.iter().filter(|x| x.member == Some(member) && x.part == Part::Concrete)
    {
        let Some(mesh) = scene.meshes.get(object.mesh) else { continue };
        for i in 0..mesh.triangles.len() {
            let [a, b, c] =
                mesh.corners(i).map(|p| object.transform.transform_point3(p).as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = d.cross(e2);
            let det = e1.dot(p);
            if det.abs() < 1e-18 {
                continue;
            }
            let s = (o - a) / det;
            let (u, q) = (s.dot(p), s.cross(e1));
            let (v, t) = (d.dot(q), e2.dot(q));
            // A little slack: a ray through an edge must not slip between two triangles.
            if u >= -1e-9
                && v >= -1e-9
                && u + v <= 1.0 + 1e-9
                && t > 0.0
                && best.is_none_or(|(nearest, _)| t < nearest)
            {
                let n = e1.cross(e2).normalize();
                best = Some((t, if n.dot(d) > 0.0 { -n } else { n }.as_vec3()));
            }
        }
    }
    best.map(|(t, n)| (t as f32, n))
}
