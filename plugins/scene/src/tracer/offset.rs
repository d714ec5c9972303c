//! Where a hit is, how far that may be wrong, and where the next ray has to start.
//!
//! A point computed by origin + t · direction misses the surface by rounding of the whole way.
//! Computed from the triangle's corners it misses the plane by rounding of the corners only,
//! whatever the error of its barycentric coordinates, which just move it within the plane. The
//! bound of that error tells how far from the surface a ray must start to be on its side (Pharr,
//! Jakob, Humphreys, *Physically Based Rendering*, 4th edition, 2023, §6.8).

use glam::Vec3;

use super::{Ray, single};

/// Unit roundoff of `f32`.
const U: f32 = 0.5 * f32::EPSILON;

/// The kernels see a well-shaped triangle off its place by less than so many roundings of the
/// distance to its corners. Without this share of the bound, one ray of a hundred that starts on a
/// surface parallel to an axis meets that surface again.
const TEST: f32 = 4.0;

/// Slivers are worse by their length over their height, but for thinner ones than this the start
/// would leave their surroundings.
const THINNEST: f32 = 256.0;

/// Segments end so much before their end: rounding of the distance itself.
const END: f32 = 1.0 - 8.0 * f32::EPSILON;

/// A hit on a triangle: where, the weights of its second and third corner there, and the bound of
/// the error of where.
///
/// The bound, component by component, also covers what rounding makes of the triangle in the eyes
/// of a ray that starts there.
///
/// ```
/// use glam::Vec3;
/// use intrados_scene::tracer::{Ray, offset};
///
/// let floor = [Vec3::ZERO, 4.0 * Vec3::Z, 4.0 * Vec3::X];
/// let ray = Ray::new(Vec3::new(1.0, 3.0, 1.0), -Vec3::Y, f32::INFINITY);
/// let (point, weights, error) = offset::hit_point(&floor, &ray);
/// assert_eq!((point, weights), (Vec3::new(1.0, 0.0, 1.0), [0.25, 0.25]));
/// let start = offset::offset_origin(point, error, Vec3::Y, Vec3::new(0.3, 0.2, 0.1));
/// assert!(start.y > 0.0 && start.y < 1e-5);
/// ```
#[inline]
#[must_use]
pub fn hit_point(corners: &[Vec3; 3], ray: &Ray) -> (Vec3, [f32; 2], Vec3) {
    let weights = barycentric(corners, ray);
    let (point, error) = surface_point(corners, weights, slack(corners));
    (point, weights, error)
}

/// Weights of the second and the third corner where the ray meets the triangle, as the kernels
/// compute them.
#[inline]
#[must_use]
pub(crate) fn barycentric(corners: &[Vec3; 3], ray: &Ray) -> [f32; 2] {
    let (o, d) = (ray.origin, ray.direction);
    let [kx, ky, kz] = single::axes(d);
    let (sx, sy) = (-d[kx] / d[kz], -d[ky] / d[kz]);
    let [(x0, y0), (x1, y1), (x2, y2)] = corners.map(|p| {
        let z = p[kz] - o[kz];
        (sx.mul_add(z, p[kx] - o[kx]), sy.mul_add(z, p[ky] - o[ky]))
    });
    let (u, v, w) = (x2 * y1 - y2 * x1, x0 * y2 - y0 * x2, x1 * y0 - y1 * x0);
    let det = u + (v + w);
    // A ray that misses, or sees the triangle from its edge, has no right answer: stay on the
    // triangle.
    let share = |x: f32| if det == 0.0 { 1.0 / 3.0 } else { (x / det).clamp(0.0, 1.0) };
    [share(v), share(w)]
}

/// How far from its place the kernels may see a triangle, from a point on it, m. Worth a table
/// where many hits are shaded.
#[inline]
#[must_use]
pub fn slack(corners: &[Vec3; 3]) -> f32 {
    let [a, b, c] = *corners;
    let longest =
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    // Length over height; NaN of a triangle without any area becomes the cap.
    let thinness = (longest / (b - a).cross(c - a).length()).min(THINNEST);
    TEST * U * thinness * longest.sqrt()
}

/// The point of a triangle with the given weights of the second and the third corner, and the bound
/// of its error; `slack` is [`slack`] of the triangle.
#[inline]
#[must_use]
pub fn surface_point(corners: &[Vec3; 3], [v, w]: [f32; 2], slack: f32) -> (Vec3, Vec3) {
    let [a, b, c] = *corners;
    let (ab, ac) = (v * (b - a), w * (c - a));
    let point = (ab + ac) + a;
    // Edges, products and their sum round to 3 u of the products, the last sum to u of the point.
    let rounding = (3.0 * (ab.abs() + ac.abs()) + point.abs()) * U;
    (point, rounding * 1.01 + slack)
}

/// The nearest safe start of a ray from the surface point `point`, on the side of the surface that
/// `direction` goes to. `error` is the point's bound, `normal` the surface's geometric unit normal,
/// on either side.
#[inline]
#[must_use]
pub fn offset_origin(point: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let side = if normal.dot(direction) < 0.0 { -normal } else { normal };
    // The plane through the corner of the box of error that is farthest out.
    let offset = side * side.abs().dot(error);
    let start = point + offset;
    // One more rounding outward, without a branch: ε|x| is at least one unit in the last place of
    // x.
    start + (start.abs() * f32::EPSILON).copysign(offset)
}

/// The ray that asks [`Tracer::any`](super::Tracer::any) whether two surface points see each other;
/// arguments as in [`offset_origin`].
///
/// Its direction is the way from start to end, and it stops just short of 1. What rounding does to
/// the far surface in the eyes of this ray grows with the distance, and the end is moved off by as
/// much: no fixed share of the distance is cut off, and what stands a hundredth of a millimetre in
/// front of a wall ten metres away is seen.
#[inline]
#[must_use]
pub fn segment(
    p: Vec3,
    p_error: Vec3,
    p_normal: Vec3,
    q: Vec3,
    q_error: Vec3,
    q_normal: Vec3,
) -> Ray {
    let way = q - p;
    let far = 2.0 * TEST * U * way.abs().max_element();
    let start = offset_origin(p, p_error, p_normal, way);
    let end = offset_origin(q, q_error + far, q_normal, -way);
    Ray::new(start, end - start, END)
}

#[cfg(test)]
mod tests {
    use glam::vec3;
    use intrados_stage::random::Key;

    use super::*;
    use crate::tracer::{Hit, Scratch, Tracer};

    /// A random triangle and a point on it: any place within a kilometre, sizes of centimetres to
    /// metres, slivers down to 1:100, half of them parallel to an axis.
    struct Spot {
        corners: [Vec3; 3],
        point: Vec3,
        error: Vec3,
        normal: Vec3,
    }

    fn spot(key: Key) -> Spot {
        let at = |d: u32| 2.0 * vec3(key.unit(d), key.unit(d + 1), key.unit(d + 2)) - 1.0;
        let centre = at(0) * 10.0_f32.powf(5.0 * key.unit(3) - 2.0);
        let size = 10.0_f32.powf(3.0 * key.unit(4) - 2.0).max(centre.length() * 1e-4);
        let (e, f) = (at(5) * size, at(8) * size * 10.0_f32.powf(-2.0 * key.unit(11)));
        let mut corners = [centre, centre + e, centre + e * key.unit(12) + f];
        if key.unit(13) < 0.5 {
            let axis = (key.unit(14) * 3.0) as usize;
            corners.iter_mut().for_each(|c| c[axis] = centre[axis]);
        }
        let [v, w] = key.pair(15);
        let weights = if v + w > 1.0 { [1.0 - v, 1.0 - w] } else { [v, w] };
        let (point, error) = surface_point(&corners, weights, slack(&corners));
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        Spot { corners, point, error, normal: (b - a).cross(c - a).normalize_or_zero().as_vec3() }
    }

    /// A direction, every third one within a degree of the surface.
    fn direction(key: Key, normal: Vec3) -> Vec3 {
        let d = (2.0 * vec3(key.unit(20), key.unit(21), key.unit(22)) - 1.0).normalize();
        if key.unit(23) < 0.33 {
            (d - normal * normal.dot(d) * (1.0 - 0.02 * key.unit(24))).normalize()
        } else {
            d
        }
    }

    const TRIALS: u64 = 100_000;

    #[test]
    fn the_error_of_a_point_is_within_its_bound() {
        for i in 0..TRIALS {
            let Spot { corners, point, error, .. } = spot(Key::new(11, i));
            // Without the share for the next ray.
            let error = error - slack(&corners);
            let [a, b, c, p] = [corners[0], corners[1], corners[2], point].map(Vec3::as_dvec3);
            let n = (b - a).cross(c - a);
            // Distance from the exact plane against that of the farthest corner of the box of
            // error.
            assert!(n.dot(p - a).abs() <= n.abs().dot(error.as_dvec3()) * (1.0 + 1e-9), "{i}");
        }
    }

    #[test]
    fn a_ray_that_leaves_a_surface_does_not_meet_it_again() {
        let mut scratch = Scratch::default();
        for i in 0..TRIALS {
            let key = Key::new(12, i);
            let Spot { corners, point, error, normal } = spot(key);
            let d = direction(key, normal);
            let start = offset_origin(point, error, normal, d);
            let mut hit = [Hit::MISS];
            Tracer::build(&[corners]).closest(
                &[Ray::new(start, d, f32::INFINITY)],
                &mut hit,
                &mut scratch,
            );
            assert_eq!(hit, [Hit::MISS], "{i}: {corners:?} {point} {d}");
        }
    }

    #[test]
    fn the_surfaces_at_its_ends_do_not_block_a_segment() {
        let mut scratch = Scratch::default();
        for i in 0..TRIALS {
            let (p, q) = (spot(Key::new(13, i)), spot(Key::new(14, i)));
            let ray = segment(p.point, p.error, p.normal, q.point, q.error, q.normal);
            let mut blocked = [true];
            Tracer::build(&[p.corners, q.corners]).any(&[ray], &mut blocked, &mut scratch);
            assert_eq!(blocked, [false], "{i}: {:?} {:?} {ray:?}", p.corners, q.corners);
        }
    }

    #[test]
    fn a_screen_close_to_a_wall_blocks_a_segment() {
        let square = |x: f32| [vec3(x, -1.0, -1.0), vec3(x, 3.0, -1.0), vec3(x, -1.0, 3.0)];
        let ([wall, far], screen) = ([square(10.0), square(0.0)], square(10.0 - 2e-5));
        let ((q, eq), (p, ep)) = (
            surface_point(&wall, [0.3; 2], slack(&wall)),
            surface_point(&far, [0.3; 2], slack(&far)),
        );
        let ray = segment(p, ep, Vec3::X, q, eq, Vec3::X);
        let mut blocked = [false; 1];
        let mut scratch = Scratch::default();
        Tracer::build(&[wall, far]).any(&[ray], &mut blocked, &mut scratch);
        assert_eq!(blocked, [false]);
        Tracer::build(&[wall, far, screen]).any(&[ray], &mut blocked, &mut scratch);
        assert_eq!(blocked, [true]);
    }
}
