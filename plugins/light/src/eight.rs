//! Eight walks side by side: one lane each. The arithmetic of flat Lambert surfaces, which most of
//! a scene is; whatever else a walk meets is shaded one at a time. Lanes never see each other, so a
//! walk has the same bits in any company.

use std::{
    f32::consts::FRAC_PI_4,
    ops::{Add, Mul, Sub},
};

use glam::{Vec3, Vec3A};
use intrados_scene::Ray;
use intrados_stage::random::Key;
use wide::{f32x8, i32x8, u32x8};

use crate::Rgb;

/// Lanes.
pub(crate) const WIDE: usize = 8;

/// Unit roundoff of `f32`.
const U: f32 = 0.5 * f32::EPSILON;

/// Eight vectors.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Vec3x8 {
    pub(crate) x: f32x8,
    pub(crate) y: f32x8,
    pub(crate) z: f32x8,
}

impl Vec3x8 {
    #[inline]
    pub(crate) fn new(x: f32x8, y: f32x8, z: f32x8) -> Self {
        Self { x, y, z }
    }

    #[inline]
    pub(crate) fn splat(v: Vec3) -> Self {
        Self::new(f32x8::splat(v.x), f32x8::splat(v.y), f32x8::splat(v.z))
    }

    #[inline]
    pub(crate) fn lane(&self, lane: usize) -> Vec3 {
        let pick = |v: &f32x8| v.as_array()[lane % WIDE];
        Vec3::new(pick(&self.x), pick(&self.y), pick(&self.z))
    }

    #[inline]
    pub(crate) fn set(&mut self, lane: usize, v: Vec3) {
        self.x.as_mut_array()[lane % WIDE] = v.x;
        self.y.as_mut_array()[lane % WIDE] = v.y;
        self.z.as_mut_array()[lane % WIDE] = v.z;
    }

    #[inline]
    pub(crate) fn dot(self, other: Self) -> f32x8 {
        self.x.mul_add(other.x, self.y.mul_add(other.y, self.z * other.z))
    }

    #[inline]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self::new(
            self.y.mul_sub(other.z, self.z * other.y),
            self.z.mul_sub(other.x, self.x * other.z),
            self.x.mul_sub(other.y, self.y * other.x),
        )
    }

    /// self · factor + add.
    #[inline]
    pub(crate) fn mul_add(self, factor: f32x8, add: Self) -> Self {
        Self::new(
            self.x.mul_add(factor, add.x),
            self.y.mul_add(factor, add.y),
            self.z.mul_add(factor, add.z),
        )
    }

    #[inline]
    pub(crate) fn abs(self) -> Self {
        Self::new(self.x.abs(), self.y.abs(), self.z.abs())
    }

    #[inline]
    pub(crate) fn largest(self) -> f32x8 {
        self.x.fast_max(self.y).fast_max(self.z)
    }
}

impl Add for Vec3x8 {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl Sub for Vec3x8 {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl Mul<f32x8> for Vec3x8 {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f32x8) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

/// |x| with the sign of `sign`.
#[inline]
fn signed(x: f32x8, sign: f32x8) -> f32x8 {
    x.abs() | (sign & f32x8::splat(-0.0))
}

/// Sixteen floats of each of eight things, as columns: two loads a lane.
#[inline]
pub(crate) fn columns(of: impl Fn(usize) -> [f32x8; 2]) -> [[f32x8; WIDE]; 2] {
    let rows = [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)];
    [f32x8::transpose(rows.map(|r| r[0])), f32x8::transpose(rows.map(|r| r[1]))]
}

/// The eight walks that start at row `8·block` of a column; lanes past its end repeat the last row.
/// `column` is not empty.
#[inline]
pub(crate) fn rows<T: Copy>(column: &[T], block: usize) -> [T; WIDE] {
    let begin = block * WIDE;
    match column.get(begin..begin + WIDE).and_then(|rows| rows.first_chunk()) {
        Some(rows) => *rows,
        None => std::array::from_fn(|lane| column[(begin + lane).min(column.len() - 1)]),
    }
}

/// Writes the lanes of `mask` to the rows of block `block`.
#[inline]
pub(crate) fn put<T: Copy>(column: &mut [T], block: usize, mask: u32, value: [T; WIDE]) {
    let begin = block * WIDE;
    match column.get_mut(begin..begin + WIDE) {
        Some(rows) if mask == 0xff => rows.copy_from_slice(&value),
        _ => lanes(mask).for_each(|lane| column[begin + lane] = value[lane % WIDE]),
    }
}

/// Eight colours, each on its own.
#[inline]
pub(crate) fn colours(of: Vec3x8) -> [Rgb; WIDE] {
    let zero = f32x8::ZERO;
    f32x8::transpose([of.x, of.y, of.z, zero, zero, zero, zero, zero]).map(|row| {
        let [r, g, b, ..] = row.to_array();
        Rgb(Vec3A::new(r, g, b))
    })
}

/// The lanes that a bit mask names.
#[inline]
pub(crate) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < WIDE).then_some(lane)
    })
}

/// Origins and directions of eight rays.
#[inline]
pub(crate) fn split(rays: &[Ray; WIDE]) -> [Vec3x8; 2] {
    let record = |ray: &Ray| {
        let Ray { origin: [ox, oy, oz], t_max, direction: [dx, dy, dz], tag } = *ray;
        f32x8::from([ox, oy, oz, t_max, dx, dy, dz, f32::from_bits(tag)])
    };
    let [ox, oy, oz, _, dx, dy, dz, _] =
        f32x8::transpose([0, 1, 2, 3, 4, 5, 6, 7].map(|i: usize| record(&rays[i])));
    [Vec3x8::new(ox, oy, oz), Vec3x8::new(dx, dy, dz)]
}

/// Eight rays of one reach.
#[inline]
pub(crate) fn join(origin: Vec3x8, direction: Vec3x8, t_max: f32) -> [Ray; WIDE] {
    let (o, d, zero) = (origin, direction, f32x8::ZERO);
    f32x8::transpose([o.x, o.y, o.z, f32x8::splat(t_max), d.x, d.y, d.z, zero]).map(|row| {
        let [ox, oy, oz, t_max, dx, dy, dz, _] = row.to_array();
        Ray { origin: [ox, oy, oz], t_max, direction: [dx, dy, dz], tag: 0 }
    })
}

/// Eight keys: [`Key::unit`] of each, the same bits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Keys8([u32x8; 2]);

impl Keys8 {
    #[inline]
    pub(crate) fn new(keys: &[Key; WIDE]) -> Self {
        Self([u32x8::from(keys.map(|k| k.0)), u32x8::from(keys.map(|k| k.1))])
    }

    #[inline]
    pub(crate) fn unit(&self, dimension: u32) -> f32x8 {
        let bits: u32x8 = lowbias32(
            lowbias32(self.0[0] + u32x8::splat(dimension.wrapping_mul(0x9e37_79b9))) ^ self.0[1],
        ) >> 8;
        f32x8::from_i32x8(i32x8::from(bits.to_array().map(|b| b as i32)))
            * f32x8::splat(1.0 / 16_777_216.0)
    }

    #[inline]
    pub(crate) fn pair(&self, dimension: u32) -> [f32x8; 2] {
        [self.unit(dimension), self.unit(dimension.wrapping_add(1))]
    }
}

#[inline]
fn lowbias32(mut x: u32x8) -> u32x8 {
    x ^= x >> 16;
    x *= u32x8::splat(0x7feb_352d);
    x ^= x >> 15;
    x *= u32x8::splat(0x846c_a68b);
    x ^ (x >> 16)
}

/// Cosine-weighted around z: [`warp::cosine_hemisphere`](crate::bsdf::warp::cosine_hemisphere).
#[inline]
fn cosine_hemisphere(u: [f32x8; 2]) -> Vec3x8 {
    let [a, b] = u.map(|u| u.mul_sub(f32x8::splat(2.0), f32x8::ONE));
    let across = a.abs().simd_gt(b.abs());
    let (r, t) = (across.select(a, b), across.select(b, a));
    let angle = r.simd_eq(f32x8::ZERO).select(f32x8::ZERO, f32x8::splat(FRAC_PI_4) * (t / r));
    let (sin, cos) = sin_cos_octant(angle);
    let (near, far) = (r * cos, r * sin);
    let (x, y) = (across.select(near, far), across.select(far, near));
    let rest = f32x8::ONE - x.mul_add(x, y * y);
    Vec3x8::new(x, y, rest.fast_max(f32x8::ZERO).sqrt())
}

/// sin and cos of x within ±π/4, by their series to x⁹ and x⁸.
#[inline]
fn sin_cos_octant(x: f32x8) -> (f32x8, f32x8) {
    let c = f32x8::splat;
    let q = x * x;
    let odd = q.mul_add(
        q.mul_add(q.mul_add(c(1.0 / 362_880.0), c(-1.0 / 5040.0)), c(1.0 / 120.0)),
        c(-1.0 / 6.0),
    );
    let even =
        q.mul_add(q.mul_add(q.mul_add(c(1.0 / 40_320.0), c(-1.0 / 720.0)), c(1.0 / 24.0)), c(-0.5));
    (x.mul_add(q * odd, x), q.mul_add(even, f32x8::ONE))
}

/// A direction by the cosine law on that side of the unit normal `normal` where `back` is, and its
/// cosine.
#[inline]
pub(crate) fn cosine_direction(normal: Vec3x8, back: Vec3x8, u: [f32x8; 2]) -> (Vec3x8, f32x8) {
    let local = cosine_hemisphere(u);
    // Duff et al. 2017, as Frame::new
    let sign = signed(f32x8::ONE, normal.z);
    let a = -f32x8::ONE / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let x = Vec3x8::new(
        (sign * normal.x * normal.x).mul_add(a, f32x8::ONE),
        sign * b,
        -sign * normal.x,
    );
    let y = Vec3x8::new(b, (normal.y * normal.y).mul_add(a, sign), -normal.y);
    let up = signed(local.z, back.dot(normal));
    (x.mul_add(local.x, y.mul_add(local.y, normal * up)), local.z)
}

/// Weights of a triangle's second and third corner, uniform by area:
/// [`warp::triangle`](crate::bsdf::warp::triangle).
#[inline]
pub(crate) fn triangle([u, v]: [f32x8; 2]) -> [f32x8; 2] {
    let s = u.sqrt();
    [s * (f32x8::ONE - v), s * v]
}

/// The point a + v·ab + w·ac, and how far off the plane with normal `normal` rounding may have put
/// it: `offset::surface_point`.
#[inline]
pub(crate) fn surface_point(
    a: Vec3x8,
    ab: Vec3x8,
    ac: Vec3x8,
    [v, w]: [f32x8; 2],
    normal: Vec3x8,
    slack: f32x8,
) -> (Vec3x8, f32x8) {
    let (ab, ac) = (ab * v, ac * w);
    let point = (ab + ac) + a;
    let rounding = (ab.abs() + ac.abs())
        .mul_add(f32x8::splat(3.0 * U * 1.01), point.abs() * f32x8::splat(U * 1.01));
    let across = normal.abs();
    (point, across.dot(rounding) + slack * (across.x + across.y + across.z))
}

/// How far off its plane a point may be that was computed in a few steps.
#[inline]
pub(crate) fn rounding(point: Vec3x8, normal: Vec3x8) -> f32x8 {
    point.abs().dot(normal.abs()) * f32x8::splat(4.0 * f32::EPSILON)
}

/// The nearest safe start from a point that is at most `off` off its surface:
/// `offset::offset_origin`.
#[inline]
pub(crate) fn leave(point: Vec3x8, off: f32x8, normal: Vec3x8, direction: Vec3x8) -> Vec3x8 {
    let offset = normal * signed(off, normal.dot(direction));
    let start = point + offset;
    let outward = |x: f32x8, o: f32x8| x + signed(x * f32x8::splat(f32::EPSILON), o);
    Vec3x8::new(outward(start.x, offset.x), outward(start.y, offset.y), outward(start.z, offset.z))
}

/// Origin and direction of the rays that ask whether `p` and `q` see each other: `offset::segment`.
/// They end at [`SEGMENT_END`].
#[inline]
pub(crate) fn segment(
    p: Vec3x8,
    p_off: f32x8,
    p_normal: Vec3x8,
    q: Vec3x8,
    q_off: f32x8,
    q_normal: Vec3x8,
) -> [Vec3x8; 2] {
    let way = q - p;
    // four roundings of the distance, in the eyes of the kernels
    let far = way.abs().largest() * f32x8::splat(8.0 * U);
    let start = leave(p, p_off, p_normal, way);
    let across = q_normal.abs();
    let end = leave(q, far.mul_add(across.x + across.y + across.z, q_off), q_normal, p - q);
    [start, end - start]
}

/// Where segments end, in lengths of their direction.
pub(crate) const SEGMENT_END: f32 = 1.0 - 8.0 * f32::EPSILON;

#[cfg(test)]
mod tests {
    use intrados_scene::tracer::offset;

    use super::*;
    use crate::bsdf::{Frame, warp};

    fn keys(n: u64) -> [Key; WIDE] {
        std::array::from_fn(|lane| Key::new(3, n * 8 + lane as u64))
    }

    #[test]
    fn eight_keys_give_the_numbers_of_each() {
        for n in 0..1000 {
            let keys = keys(n);
            for dimension in [0, 1, 4096 * 3 + 9, u32::MAX] {
                assert_eq!(
                    Keys8::new(&keys).unit(dimension).to_array(),
                    keys.map(|k| k.unit(dimension))
                );
            }
        }
    }

    #[test]
    fn directions_are_those_of_one_at_a_time() {
        for n in 0..1000 {
            let keys = keys(n);
            let (normal, back) =
                (keys.map(|k| warp::sphere(k.pair(0))), keys.map(|k| warp::sphere(k.pair(2))));
            let (mut normals, mut backs) = (Vec3x8::default(), Vec3x8::default());
            (0..WIDE).for_each(|i| {
                normals.set(i, normal[i]);
                backs.set(i, back[i]);
            });
            let (direction, cos) = cosine_direction(normals, backs, Keys8::new(&keys).pair(4));
            for i in 0..WIDE {
                let frame = Frame::new(normal[i]);
                let local = warp::cosine_hemisphere(keys[i].pair(4));
                let one = frame.to_world(local.with_z(local.z.copysign(back[i].dot(normal[i]))));
                // The cosine is the root of a difference: near the horizon its last bits are lost.
                let tolerance = 1e-6 / local.z.max(1e-3);
                assert!(
                    (direction.lane(i) - one).length() < 1e-6 + tolerance,
                    "{} {one}",
                    direction.lane(i)
                );
                assert!((cos.as_array()[i] - local.z).abs() < tolerance);
            }
        }
    }

    #[test]
    fn segments_are_those_of_one_at_a_time() {
        for n in 0..1000 {
            let keys = keys(n);
            let at = |d: u32| keys.map(|k| 10.0 * warp::sphere(k.pair(d)) * k.unit(d + 2));
            let (p, q) = (at(0), at(10));
            let (pn, qn) = (at(20).map(Vec3::normalize), at(30).map(Vec3::normalize));
            let pack = |v: [Vec3; 8]| {
                let mut out = Vec3x8::default();
                (0..WIDE).for_each(|i| out.set(i, v[i]));
                out
            };
            let [p8, q8, pn8, qn8] = [p, q, pn, qn].map(pack);
            let [start, way] = segment(p8, rounding(p8, pn8), pn8, q8, rounding(q8, qn8), qn8);
            for i in 0..WIDE {
                let error = |v: Vec3| v.abs() * (4.0 * f32::EPSILON);
                let one = offset::segment(p[i], error(p[i]), pn[i], q[i], error(q[i]), qn[i]);
                let tolerance = 1e-6 * p[i].length().max(q[i].length());
                assert_eq!(one.t_max, SEGMENT_END);
                assert!((Vec3::from(one.origin) - start.lane(i)).length() <= tolerance);
                assert!((Vec3::from(one.direction) - way.lane(i)).length() <= 2.0 * tolerance);
            }
        }
    }
}
