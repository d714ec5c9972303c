//! The faces of a shape laid flat: places in metres, v upward, or along what lies.

use glam::{Vec2, Vec3, vec2};

/// A place on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Along the face's axes, m.
    pub at: Vec2,
    /// Unit vectors of these axes in the world, in the face.
    pub axes: [Vec3; 2],
}

/// How a shape is laid flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unwrap {
    /// Of a round shape: index of its axis, its centre across that, its radius, m.
    round: Option<(usize, Vec2, f32)>,
    /// Of what is too rough to be laid flat face by face: the direction from which it is seen.
    facing: Option<Vec3>,
}

/// So many directions of faces about an axis make a shape round.
const ROUND: usize = 12;

impl Unwrap {
    /// Of a shape by its triangles in the world: round ones are unrolled about their axis, others
    /// face by face.
    #[must_use]
    pub fn of(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let mut directions: [Vec<Vec2>; 3] = Default::default();
        let mut spread = [0.0_f32; 3];
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for [a, b, c] in triangles {
            (low, high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            let across = (b - a).cross(c - a);
            let Some(n) = across.try_normalize() else { continue };
            for axis in 0..3 {
                spread[axis] += across.length() * n[axis] * n[axis];
                let flat = around(n, axis);
                let found = &mut directions[axis];
                if n[axis].abs() < 0.2
                    && found.len() < ROUND
                    && found.iter().all(|d| d.dot(flat.normalize_or_zero()) < 0.995)
                {
                    found.push(flat.normalize_or_zero());
                }
            }
        }
        let axis = (0..3).min_by(|&i, &j| spread[i].total_cmp(&spread[j])).unwrap_or(1);
        let (centre, size) = (around(0.5 * (low + high), axis), around(high - low, axis));
        let is_round = directions[axis].len() >= ROUND;
        let round = is_round.then(|| (axis, centre, 0.25 * (size.x + size.y).max(4e-3)));
        Self { round, facing: None }
    }

    /// Of a rough surface by its triangles in the world: as it is seen from where most of it faces.
    #[must_use]
    pub fn of_rough(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let mean = triangles.map(|[a, b, c]| (b - a).cross(c - a)).sum::<Vec3>();
        Self { round: None, facing: mean.try_normalize() }
    }

    /// The place of a point whose face has this unit normal.
    #[must_use]
    pub fn place(&self, point: Vec3, normal: Vec3) -> Place {
        let normal = self.facing.unwrap_or(normal);
        if let Some((axis, centre, radius)) = self.round
            && normal[axis].abs() < 0.7
        {
            let arm = around(point, axis) - centre;
            let mut along = Vec3::ZERO;
            along[axis] = 1.0;
            let x = along.cross(normal).normalize_or(normal.any_orthonormal_vector());
            let at = vec2(radius * arm.y.atan2(arm.x), point[axis]);
            // Seen from inside, the angle runs the other way.
            let hand = if around(normal, axis).dot(arm) < 0.0 { -1.0 } else { 1.0 };
            return Place { at: vec2(at.x, at.y), axes: [hand * x, along] };
        }
        // Horizontal faces have no up: z lies along them.
        let up = if normal.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
        let x = up.cross(normal).normalize_or(normal.any_orthonormal_vector());
        let y = normal.cross(x);
        // Opposite faces are not each other's copy.
        let side = if (normal.x + 1.7 * normal.y + 0.6 * normal.z) < 0.0 { 41.3 } else { 0.0 };
        Place { at: vec2(point.dot(x) + side, point.dot(y)), axes: [x, y] }
    }
}

/// The two coordinates across an axis, right-handed about it.
fn around(v: Vec3, axis: usize) -> Vec2 {
    vec2(v[(axis + 1) % 3], v[(axis + 2) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_on_faces_are_lengths_in_the_world() {
        // A prism of 24 sides about y, and a cube.
        let ring = |k: usize, y: f32| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / 24.0).sin_cos();
            Vec3::new(3.0 + 0.4 * cos, y, 0.4 * sin)
        };
        let sides = (0..24).flat_map(|k| {
            let [a, b, c, d] = [ring(k, 0.0), ring(k + 1, 0.0), ring(k + 1, 2.0), ring(k, 2.0)];
            [[a, c, b], [a, d, c]]
        });
        let round = Unwrap::of(sides.clone());
        assert!(round.round.is_some());
        let flat = Unwrap::of([[Vec3::ZERO, Vec3::X, Vec3::Y]].into_iter());
        assert!(flat.round.is_none());
        for (unwrap, triangle) in sides.map(|t| (round, t)).chain([(
            flat,
            [Vec3::new(1.0, 2.0, 0.5), Vec3::new(1.1, 2.0, 0.5), Vec3::new(1.0, 2.2, 0.5)],
        )]) {
            let [a, b, c] = triangle;
            let normal = (b - a).cross(c - a).normalize();
            let middle = (a + b + c) / 3.0;
            let here = unwrap.place(middle, normal);
            for axis in 0..2 {
                // A millimetre along an axis in the world is one in the plane.
                let there = unwrap.place(middle + 1e-3 * here.axes[axis], normal);
                let moved = (there.at - here.at) * 1e3;
                assert!((moved[axis] - 1.0).abs() < 0.05, "{moved} of axis {axis}");
                assert!(moved[1 - axis].abs() < 0.05, "{moved} of axis {axis}");
                assert!(here.axes[axis].dot(normal).abs() < 1e-5);
            }
        }
    }
}
