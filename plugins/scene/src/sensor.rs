//! Sensors: everything with a response W_e over S = (A_x, Ω_x), eq. 2.4.

use bevy_ecs::component::Component;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::Lens;

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
    /// How its lens distorts; none: straight lines stay straight. The field of view is that of the
    /// same camera without distortion.
    pub lens: Option<Lens>,
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
            lens: None,
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

    /// Where the picture plane at unit distance is met by the ray through picture position
    /// `(x, y)`, in pixels from the top left: tangents to the right and downwards from the optical
    /// axis. `None` where the lens draws nothing.
    #[must_use]
    pub fn tangents(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let [hx, hy] = self.half_extent().map(f64::from);
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let drawn = [(2.0 * x / width - 1.0) * hx, (2.0 * y / height - 1.0) * hy];
        let Some(lens) = &self.lens else { return Some(drawn) };
        let [cx, cy] = lens.centre.map(|c| 2.0 * hx * f64::from(c));
        lens.undistort([drawn[0] - cx, drawn[1] - cy], lens.reach())
    }

    /// Unit direction through picture position `(x, y)` in pixels from the top left; along the
    /// optical axis where the lens draws nothing ([`Camera::is_covered`] says whether that may be).
    #[must_use]
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        let [right, up, forward] = self.frame();
        if self.lens.is_none() {
            let [hx, hy] = self.half_extent();
            let (u, v) = (2.0 * x / self.width as f32 - 1.0, 1.0 - 2.0 * y / self.height as f32);
            return (forward + right * (u * hx) + up * (v * hy)).normalize();
        }
        let [a, b] = self.tangents([x, y].map(f64::from)).unwrap_or_default().map(|t| t as f32);
        (forward + right * a - up * b).normalize()
    }

    /// Where a point of the world is drawn, in pixels from the top left, be that within the picture
    /// or not. `None` of what is behind the camera or beyond what its lens draws.
    #[must_use]
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let [right, up, forward] = self.frame().map(|axis| axis.as_dvec3());
        let to = point - self.position.as_dvec3();
        let depth = to.dot(forward);
        let seen = [to.dot(right) / depth, -to.dot(up) / depth];
        let [hx, hy] = self.half_extent().map(f64::from);
        if !(depth > 0.0 && seen.iter().all(|t| t.is_finite())) {
            return None;
        }
        let [x, y] = match &self.lens {
            None => seen,
            Some(lens) if seen[0].hypot(seen[1]) > lens.reach() => return None,
            Some(lens) => {
                let ([x, y], _) = lens.distort(seen);
                let [cx, cy] = lens.centre.map(|c| 2.0 * hx * f64::from(c));
                [x + cx, y + cy]
            }
        };
        Some([
            0.5 * (x / hx + 1.0) * f64::from(self.width),
            0.5 * (y / hy + 1.0) * f64::from(self.height),
        ])
    }

    /// The same view of some of its pixels alone: columns and rows from those of `from` to before
    /// those of `to`. Each shows what it shows here, since the optical axis of a lens need not meet
    /// the middle.
    #[must_use]
    pub fn cropped(&self, from: [u32; 2], to: [u32; 2]) -> Self {
        let [width, height] = [0, 1].map(|k: usize| to[k].saturating_sub(from[k]).max(1));
        let lens = self.lens.unwrap_or_default();
        let whole = f64::from(self.width.max(1));
        let share = f64::from(width) / whole;
        let sides = [self.width, self.height].map(f64::from);
        // From the middle of the part to the axis, in widths of the part.
        let centre = [0, 1].map(|k: usize| {
            let middle = f64::from(from[k]) + 0.5 * f64::from([width, height][k]);
            let off = f64::from(lens.centre[k]) + (0.5 * sides[k] - middle) / whole;
            (off / share) as f32
        });
        let half = (0.5 * f64::from(self.fov_deg).to_radians()).tan();
        let fov_deg = 2.0 * (share * half).atan().to_degrees() as f32;
        Self { fov_deg, width, height, lens: Some(Lens { centre, ..lens }), ..self.clone() }
    }

    /// Whether the lens draws something everywhere in the picture. What it draws is convex enough
    /// for its edges to tell: a sample of them does.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        const SAMPLES: u32 = 64;
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES)).all(|s| {
            [[s * w, 0.0], [s * w, h], [0.0, s * h], [w, s * h]]
                .into_iter()
                .all(|at| self.tangents(at).is_some())
        })
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

    /// With a lens and without: what is seen through a pixel is drawn there.
    #[test]
    fn pixel_to_ray_and_back() {
        let lens = Lens { k1: -0.12, k2: 0.03, p1: 0.001, p2: -0.002, centre: [0.01, -0.02] };
        for lens in [None, Some(lens)] {
            let bounds = [Vec3::new(-3.0, 0.0, -1.0), Vec3::new(5.0, 2.0, 1.0)];
            let camera = Camera { lens, fov_deg: 70.0, ..Camera::overview(bounds) };
            assert!(camera.is_covered());
            for k in 0..1000 {
                let at = [(k % 40) as f32 * 24.5, (k / 40) as f32 * 28.5];
                let point = camera.position + 7.0 * camera.direction(at[0], at[1]);
                let [x, y] = camera.project(point.as_dvec3()).unwrap();
                let off = (x - f64::from(at[0])).hypot(y - f64::from(at[1]));
                assert!(off < 2e-3, "{at:?}: {x} {y}");
            }
            assert_eq!(camera.project((camera.position - camera.frame()[2]).as_dvec3()), None);
        }
    }

    /// With a lens and without: a pixel of a part shows what it shows in the whole.
    #[test]
    fn a_part_of_a_picture_has_the_rays_of_the_whole() {
        let lens = Lens { k1: -0.12, k2: 0.03, p1: 0.001, p2: -0.002, centre: [0.01, -0.02] };
        for lens in [None, Some(lens)] {
            let whole = Camera { lens, fov_deg: 70.0, ..Camera::overview([Vec3::ZERO, Vec3::ONE]) };
            let part = whole.cropped([700, 40], [900, 360]);
            assert_eq!((part.width, part.height), (200, 320));
            for (x, y) in [(0.0, 0.0), (199.5, 0.5), (60.0, 319.0), (200.0, 320.0)] {
                let (own, theirs) = (part.direction(x, y), whole.direction(700.0 + x, 40.0 + y));
                // A pixel is 1.5e-3 wide.
                assert!(own.distance(theirs) < 1e-5, "{x} {y}: {own} {theirs}");
            }
        }
    }

    /// A strong barrel of a wide camera folds before the corners.
    #[test]
    fn a_lens_that_folds_the_picture_is_found_out() {
        let lens = Some(Lens { k1: -0.3, ..Lens::default() });
        let bounds = [Vec3::ZERO, Vec3::ONE];
        let wide = Camera { lens, fov_deg: 100.0, ..Camera::overview(bounds) };
        assert!(!wide.is_covered());
        assert!(Camera { fov_deg: 40.0, ..wide }.is_covered());
    }
}
