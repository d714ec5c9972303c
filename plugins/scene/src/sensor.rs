//! Sensors: everything with a response W_e over S = (A_x, Ω_x), eq. 2.4.

use bevy_ecs::component::Component;
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A pinhole camera with a box filter. A pixel's value is the mean radiance over it; the camera's
/// reading is the mean luminance Y over its pixels, W·m⁻²·sr⁻¹.
#[derive(Component, Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Name, for people.
    pub name: String,
    /// Pinhole, m.
    pub position: Vec3,
    /// A point on the optical axis, m.
    pub target: Vec3,
    /// Any vector that is up in the picture.
    pub up: Vec3,
    /// Full field of view across x, degrees.
    pub fov_deg: f32,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Exposure for the tone-mapped picture, stops (EV); 0 leaves radiance 1 at display 1 before
    /// the curve.
    pub exposure: f32,
}

impl Camera {
    /// A camera from the front, a little from the right and from above, that has the whole box in
    /// its picture.
    #[must_use]
    pub fn overview(bounds: [Vec3; 2]) -> Self {
        let target = 0.5 * (bounds[0] + bounds[1]);
        let position = target + Vec3::new(0.5, 0.35, 0.8);
        let name = "overview".into();
        Self {
            name,
            position,
            target,
            up: Vec3::Y,
            fov_deg: 40.0,
            width: 960,
            height: 720,
            exposure: 0.0,
        }
        .framing(bounds)
    }

    /// The same direction of view, from so far that all of the box is in the picture, with a little
    /// air about it.
    #[must_use]
    pub fn framing(&self, [low, high]: [Vec3; 2]) -> Self {
        const AIR: f32 = 1.12;
        let target = 0.5 * (low + high);
        let ([right, up, forward], [hx, hy]) = (self.frame(), self.half_extent());
        let corner = |k: usize| {
            Vec3::from_array(std::array::from_fn(
                |i| if k >> i & 1 == 1 { high[i] } else { low[i] },
            )) - target
        };
        let needs = |d: Vec3| (d.dot(right).abs() / hx).max(d.dot(up).abs() / hy) - d.dot(forward);
        let distance = AIR * (0..8).map(|k| needs(corner(k))).fold(1e-3, f32::max);
        Self { position: target - distance * forward, target, ..self.clone() }
    }

    /// Orthonormal right, up, forward.
    #[must_use]
    pub fn frame(&self) -> [Vec3; 3] {
        let forward = (self.target - self.position).normalize_or(Vec3::NEG_Z);
        let up = if forward.cross(self.up).length_squared() > 1e-12 {
            self.up
        } else {
            forward.any_orthogonal_vector()
        };
        let right = forward.cross(up).normalize();
        [right, right.cross(forward), forward]
    }

    /// Half extents of the picture at unit distance: tan(fov/2) across, the same times height/width
    /// down.
    #[must_use]
    pub fn half_extent(&self) -> [f32; 2] {
        let x = (0.5 * self.fov_deg.to_radians()).tan();
        [x, x * self.height as f32 / self.width as f32]
    }

    /// Unit direction through picture position `(x, y)` in pixels from the top left.
    #[must_use]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        let [right, up, forward] = self.frame();
        let [hx, hy] = self.half_extent();
        let (u, v) = (2.0 * x / self.width as f32 - 1.0, 1.0 - 2.0 * y / self.height as f32);
        (forward + right * (u * hx) + up * (v * hy)).normalize()
    }
}

/// A flat patch that measures irradiance (W·m⁻²) arriving on its front, the side that `u × v`
/// points to: W_e = 1/A over the patch and the whole hemisphere. It is transparent: put it on a
/// member's surface or anywhere in the air.
#[derive(Component, Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Meter {
    /// Name, for people and JSON.
    pub name: String,
    /// A corner, m.
    pub corner: Vec3,
    /// One edge, m.
    pub u: Vec3,
    /// The other edge, m.
    pub v: Vec3,
    /// Id of the member whose surface it lies on; none: it hangs free.
    pub on: Option<String>,
}

impl Meter {
    /// Unit normal of the front.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        self.u.cross(self.v).normalize_or_zero()
    }

    /// Area A_x, m².
    #[must_use]
    pub fn area(&self) -> f32 {
        self.u.cross(self.v).length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_framed_box_is_inside_the_picture() {
        let bounds = [Vec3::new(-3.0, 0.0, -1.0), Vec3::new(5.0, 2.0, 1.0)];
        let framed = Camera::overview(bounds);
        let [right, up, forward] = framed.frame();
        for k in 0..8 {
            let pick = |bit: usize, axis: usize| bounds[(k >> bit) & 1][axis];
            let to = Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2)) - framed.position;
            let depth = to.dot(forward);
            let [x, y] = framed.half_extent();
            assert!(
                depth > 0.0
                    && (to.dot(right) / depth).abs() <= x
                    && (to.dot(up) / depth).abs() <= y
            );
        }
    }
}
