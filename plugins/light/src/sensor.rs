//! Sensors ready for walks: the response W_e (eq. 2.4) of a camera and of a patch meter, sampled and evaluated.

use glam::Vec3;
use intrados_scene::{Camera, Meter};
use serde::{Deserialize, Serialize};

/// Anything that reads light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Sensor {
    /// A picture; its reading is the mean luminance over the pixels, W·m⁻²·sr⁻¹.
    Camera(Camera),
    /// Irradiance on a patch, W·m⁻².
    Meter(Meter),
}

impl Sensor {
    /// Name, for people and JSON.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Camera(camera) => &camera.name,
            Self::Meter(meter) => &meter.name,
        }
    }

    /// Unit of its reading.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Camera(_) => "W/(m2 sr)",
            Self::Meter(_) => "W/m2",
        }
    }

    /// Bins that its scores go to.
    pub(crate) fn bins(&self) -> usize {
        match self {
            Self::Camera(camera) => camera.width as usize * camera.height as usize,
            Self::Meter(_) => 1,
        }
    }
}

/// A sensor with what the walk needs precomputed.
#[derive(Debug, Clone)]
pub(crate) enum Device {
    Pinhole(Pinhole),
    Patch(Patch),
}

impl From<&Sensor> for Device {
    fn from(sensor: &Sensor) -> Self {
        match sensor {
            Sensor::Camera(camera) => Self::Pinhole(Pinhole::new(camera)),
            Sensor::Meter(meter) => Self::Patch(Patch::new(meter)),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Pinhole {
    pub(crate) position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    half: [f32; 2],
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// 1/area of a pixel on the picture plane at unit distance.
    density: f32,
}

impl Pinhole {
    fn new(camera: &Camera) -> Self {
        let [right, up, forward] = camera.frame();
        let half = camera.half_extent();
        let (width, height) = (camera.width, camera.height);
        let density = (width * height) as f32 / (4.0 * half[0] * half[1]);
        Self { position: camera.position, right, up, forward, half, width, height, density }
    }

    /// Unit direction through `jitter` within pixel `bin`.
    pub(crate) fn direction(&self, bin: u32, jitter: [f32; 2]) -> Vec3 {
        let x = ((bin % self.width) as f32 + jitter[0]) / self.width as f32;
        let y = ((bin / self.width) as f32 + jitter[1]) / self.height as f32;
        let (a, b) = ((2.0 * x - 1.0) * self.half[0], (1.0 - 2.0 * y) * self.half[1]);
        (self.forward + self.right * a + self.up * b).normalize()
    }

    /// Which pixel sees `to` (from the pinhole, any length), and W_e there per m² across the ray: 1/(a cos³θ r²), with the pixel's area a.
    pub(crate) fn sees(&self, to: Vec3) -> Option<(u32, f32)> {
        let z = to.dot(self.forward);
        let (x, y) = (to.dot(self.right) / (z * self.half[0]), to.dot(self.up) / (z * self.half[1]));
        if z.is_nan() || z <= 0.0 || x.abs() >= 1.0 || y.abs() >= 1.0 {
            return None;
        }
        let column = ((0.5 * (x + 1.0) * self.width as f32) as u32).min(self.width - 1);
        let row = ((0.5 * (1.0 - y) * self.height as f32) as u32).min(self.height - 1);
        let r = to.length();
        // cosθ = z/r, so 1/(cos³θ r²) = r/z³
        Some((row * self.width + column, self.density * r / (z * z * z)))
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Patch {
    corner: Vec3,
    u: Vec3,
    v: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) area: f32,
    /// Dual basis: coordinates of a point are (p − corner)·these.
    du: Vec3,
    dv: Vec3,
    /// How far walks keep off the surface that the patch may lie on.
    pub(crate) lift: f32,
}

impl Patch {
    fn new(meter: &Meter) -> Self {
        let (normal, area) = (meter.normal(), meter.area());
        let (du, dv) = (meter.v.cross(normal) / area, normal.cross(meter.u) / area);
        Self { corner: meter.corner, u: meter.u, v: meter.v, normal, area, du, dv, lift: 1e-4 * area.sqrt() }
    }

    /// A point, uniform by area, lifted off the surface below.
    pub(crate) fn point(&self, at: [f32; 2]) -> Vec3 {
        self.corner + self.u * at[0] + self.v * at[1] + self.normal * self.lift
    }

    /// Cosine with which a ray that ends after `length` crosses the front, if it does. A surface right at the patch does not hide it.
    pub(crate) fn crossed(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<(f32, f32)> {
        let cos = -direction.dot(self.normal);
        let t = (origin - self.corner).dot(self.normal) / cos;
        if cos.is_nan() || cos <= 0.0 || t.is_nan() || t <= 0.0 || t > length * 1.0001 + 2.0 * self.lift {
            return None;
        }
        let p = origin + t * direction - self.corner;
        let (a, b) = (p.dot(self.du), p.dot(self.dv));
        ((0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b)).then_some((cos, t))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    fn camera() -> Camera {
        Camera {
            name: "eye".into(),
            position: Vec3::new(1.0, 2.0, 3.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 50.0,
            width: 40,
            height: 30,
            exposure: 0.0,
        }
    }

    /// What a pixel's ray hits, the pixel sees; and ∫ W_e cos dω over a pixel is 1 by quadrature over the sphere.
    #[test]
    fn the_pinhole_sees_what_it_looks_at() {
        let eye = Pinhole::new(&camera());
        for i in 0..1000_u32 {
            let bin = i % (40 * 30);
            let key = Key::new(1, u64::from(i));
            let d = eye.direction(bin, [0.01 + 0.98 * key.unit(0), 0.01 + 0.98 * key.unit(1)]);
            assert_eq!(eye.sees(d * 7.0).map(|s| s.0), Some(bin));
        }
        let n = 4_000_000_u64;
        let mut sum = 0.0;
        for i in 0..n {
            let d = crate::bsdf::warp::sphere(Key::new(2, i).pair(0));
            // seen at distance 1: W_e per m² across the ray is W_e per sr
            sum += eye.sees(d).map_or(0.0, |(_, w)| f64::from(w));
        }
        let total = sum / n as f64 * 4.0 * std::f64::consts::PI;
        // every one of the 1200 pixels integrates to 1; 5 standard errors of this sum are 1 %
        assert!((total / 1200.0 - 1.0).abs() < 0.01, "{total}");
    }

    #[test]
    fn a_patch_is_crossed_from_its_front_only() {
        let meter = Meter { name: "m".into(), corner: Vec3::ZERO, u: Vec3::X, v: Vec3::Y };
        let patch = Patch::new(&meter);
        let above = Vec3::new(0.25, 0.5, 2.0);
        assert_eq!(patch.crossed(above, Vec3::NEG_Z, 5.0), Some((1.0, 2.0)));
        assert_eq!(patch.crossed(above, Vec3::NEG_Z, 1.0), None);
        assert_eq!(patch.crossed(above - 4.0 * Vec3::Z, Vec3::Z, 5.0), None);
        assert_eq!(patch.crossed(above + Vec3::X, Vec3::NEG_Z, 5.0), None);
    }
}
