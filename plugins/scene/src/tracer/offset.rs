//! provisional
use glam::Vec3;
use super::Ray;
/// bary
pub fn hit_point([a, b, c]: [Vec3; 3], ray: &Ray) -> (Vec3, [f32; 2], Vec3) {
    let (o, d) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let inv = 1.0 / e1.dot(p);
    let s = o - a;
    let u = (s.dot(p) * inv).clamp(0.0, 1.0);
    let v = (d.dot(s.cross(e1)) * inv).clamp(0.0, 1.0 - u);
    let x = a + e1 * u + e2 * v;
    (x, [u, v], Vec3::splat((a.abs() + e1.abs() + e2.abs()).max_element() * 5e-7))
}
/// off
pub fn offset_origin(p: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let d = error.dot(normal.abs());
    p + normal * (d * 2.0).copysign(normal.dot(direction))
}
/// seg
pub fn segment(p: Vec3, ep: Vec3, np: Vec3, q: Vec3, eq: Vec3, nq: Vec3) -> Ray {
    let p2 = offset_origin(p, ep, np, q - p);
    let q2 = offset_origin(q, eq, nq, p - q);
    Ray::new(p2, q2 - p2, 1.0 - 1e-4)
}
