//! Where a camera stood, from places in the world that were picked in its photograph.

mod fit;
mod locate;
mod start;
#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests;

use glam::{DMat3, DVec3, Vec3};
use intrados_scene::{Camera, Lens};
use nalgebra::{Matrix2, SMatrix};

pub(crate) use fit::inverse;
pub use locate::{ByEdges, Located, PoseError, Prior, locate};

/// What of a pose is unknown, in this order: a turn about the camera's right, down and forward axes
/// (rad, after the rotation), its position (m), the logarithm of its focal length, k1.
pub(crate) const UNKNOWNS: usize = 8;
/// Covariance of what is unknown of a pose.
pub type Covariance = SMatrix<f64, UNKNOWNS, UNKNOWNS>;
/// Slopes of a place in the picture by what is unknown of the pose.
pub(crate) type Slopes = SMatrix<f64, 2, UNKNOWNS>;

/// A place in the world and where somebody picked it in a photograph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pick {
    /// Pixels to the right and down from the top left corner of the upright photograph; the first
    /// pixel's middle is at ½, ½.
    pub pixel: [f64; 2],
    /// m.
    pub place: DVec3,
}

/// A camera in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Pinhole, m.
    pub position: DVec3,
    /// From the world to the camera's axes: right, down, forward.
    pub rotation: DMat3,
    /// Pixels, without the lens's distortion.
    pub focal_px: f64,
    /// Its lens.
    pub lens: Lens,
    /// Of the picture, pixels.
    pub size: [u32; 2],
    reach: f64,
}

impl Pose {
    /// A camera; `rotation` takes the world to the camera's right, down and forward.
    #[must_use]
    pub fn new(
        position: DVec3,
        rotation: DMat3,
        focal_px: f64,
        lens: Lens,
        size: [u32; 2],
    ) -> Self {
        Self { position, rotation, focal_px, lens, size, reach: lens.reach() }
    }

    /// A scene's camera.
    #[must_use]
    pub fn of(camera: &Camera) -> Self {
        let [right, up, forward] = camera.frame().map(|axis| axis.as_dvec3());
        let rotation = DMat3::from_cols(right, -up, forward).transpose();
        let focal =
            0.5 * f64::from(camera.width) / (0.5 * f64::from(camera.fov_deg).to_radians()).tan();
        let size = [camera.width, camera.height];
        let lens = camera.lens.unwrap_or_default();
        Self::new(camera.position.as_dvec3(), rotation, focal, lens, size)
    }

    /// The same as a scene's camera.
    #[must_use]
    pub fn camera(&self, name: &str) -> Camera {
        let [_, down, forward] = self.axes();
        let fov = 2.0 * (0.5 * f64::from(self.size[0]) / self.focal_px).atan();
        let vec3 = |v: DVec3| Vec3::from_array(v.to_array().map(|x| x as f32));
        Camera {
            name: name.into(),
            position: vec3(self.position),
            target: vec3(self.position + forward),
            up: vec3(-down),
            fov_deg: fov.to_degrees() as f32,
            width: self.size[0],
            height: self.size[1],
            exposure: 0.0,
            lens: (self.lens != Lens::default()).then_some(self.lens),
        }
    }

    /// Right, down and forward in the world.
    #[must_use]
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        let axes = self.rotation.transpose();
        [axes.x_axis, axes.y_axis, axes.z_axis]
    }

    /// By how much the camera is turned about its optical axis from upright, degrees, −180 to 180:
    /// positive where the picture's up leans to the left of the world's. `None` where it looks up or
    /// down so steeply that none is upright.
    #[must_use]
    pub fn roll_deg(&self) -> Option<f64> {
        let [right, down, forward] = self.axes();
        (forward.y.abs() < 0.9).then(|| right.y.atan2(-down.y).to_degrees())
    }

    /// Where the optical axis meets the picture, pixels.
    fn middle(&self) -> [f64; 2] {
        let [width, height] = self.size.map(f64::from);
        let [x, y] = self.lens.centre.map(f64::from);
        [0.5 * width + x * width, 0.5 * height + y * width]
    }

    /// Where a place is drawn, pixels, be that within the picture or not; `None` of what is behind
    /// the camera or beyond its lens.
    #[must_use]
    pub fn project(&self, place: DVec3) -> Option<[f64; 2]> {
        Some(self.drawn(place)?.0)
    }

    /// Whether a place in the picture is within it.
    #[must_use]
    pub fn holds(&self, [x, y]: [f64; 2]) -> bool {
        let [width, height] = self.size.map(f64::from);
        (0.0..width).contains(&x) && (0.0..height).contains(&y)
    }

    /// Unit, in the world: what is drawn at a place of the picture lies there. `None` where the
    /// lens draws nothing.
    #[must_use]
    pub(crate) fn ray(&self, [x, y]: [f64; 2]) -> Option<DVec3> {
        let [middle_x, middle_y] = self.middle();
        let drawn = [(x - middle_x) / self.focal_px, (y - middle_y) / self.focal_px];
        let [a, b] = self.lens.undistort(drawn, self.reach)?;
        let [right, down, forward] = self.axes();
        Some((a * right + b * down + forward).normalize())
    }

    /// Where a place is drawn, and the slopes of that by the place in the camera's axes.
    fn drawn(&self, place: DVec3) -> Option<([f64; 2], SMatrix<f64, 2, 3>, [f64; 2])> {
        let p = self.rotation * (place - self.position);
        let seen = [p.x / p.z, p.y / p.z];
        if !(p.z > 0.0 && seen[0].hypot(seen[1]) <= self.reach) {
            return None;
        }
        let ([x, y], [xx, xy, yy]) = self.lens.distort(seen);
        let [middle_x, middle_y] = self.middle();
        let lens = Matrix2::new(xx, xy, xy, yy) * (self.focal_px / p.z);
        let pinhole = SMatrix::<f64, 2, 3>::new(1.0, 0.0, -seen[0], 0.0, 1.0, -seen[1]);
        let at = [middle_x + self.focal_px * x, middle_y + self.focal_px * y];
        Some((at, lens * pinhole, seen))
    }

    /// Where a place is drawn, and the slopes of that by what is unknown of the pose.
    pub(crate) fn slopes(&self, place: DVec3) -> Option<([f64; 2], Slopes)> {
        let (at, by_place, seen) = self.drawn(place)?;
        let p = self.rotation * (place - self.position);
        // p ← (1 + ω×) p, and p ← p − R δ.
        let turn = SMatrix::<f64, 3, 3>::new(0.0, p.z, -p.y, -p.z, 0.0, p.x, p.y, -p.x, 0.0);
        let shift = -SMatrix::<f64, 3, 3>::from_column_slice(&self.rotation.to_cols_array());
        let mut slopes = Slopes::zeros();
        slopes.fixed_view_mut::<2, 3>(0, 0).copy_from(&(by_place * turn));
        slopes.fixed_view_mut::<2, 3>(0, 3).copy_from(&(by_place * shift));
        let (middle, s) = (self.middle(), seen[0] * seen[0] + seen[1] * seen[1]);
        for k in 0..2 {
            slopes[(k, 6)] = at[k] - middle[k];
            slopes[(k, 7)] = self.focal_px * seen[k] * s;
        }
        Some((at, slopes))
    }

    /// Slopes of a place in the picture (pixels) by the place in the world (m).
    pub(crate) fn slopes_by_place(&self, place: DVec3) -> Option<[DVec3; 2]> {
        let (_, by_place, _) = self.drawn(place)?;
        let row = |k: usize| DVec3::new(by_place[(k, 0)], by_place[(k, 1)], by_place[(k, 2)]);
        Some([0, 1].map(|k| self.rotation.transpose() * row(k)))
    }

    /// The pose a step further in what is unknown of it.
    pub(crate) fn moved(&self, step: &[f64; UNKNOWNS]) -> Self {
        let turn = DMat3::from_quat(glam::DQuat::from_scaled_axis(DVec3::from_slice(&step[..3])));
        let lens = Lens { k1: (f64::from(self.lens.k1) + step[7]) as f32, ..self.lens };
        let position = self.position + DVec3::from_slice(&step[3..6]);
        let focal = self.focal_px * step[6].clamp(-1.0, 1.0).exp();
        Self::new(position, turn * self.rotation, focal, lens, self.size)
    }
}
