//! Sensors ready for walks: the response W_e (eq. 2.4) of a camera and of a patch meter, sampled
//! and evaluated.

use glam::Vec3;
use intrados_scene::{Camera, Lens, Meter};
use serde::{Deserialize, Serialize};
use wide::f32x8;

use crate::{
    eight::{Vec3x8, WIDE},
    field::Extra,
};

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

    /// Walks that count as one sample: one a pixel; a meter counts 4096 pixels.
    #[must_use]
    pub fn walks_a_sample(&self) -> u64 {
        match self {
            Self::Camera(_) => self.bins() as u64,
            Self::Meter(_) => 4096,
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

impl Device {
    /// The place where walks start, for fields; a pinhole has none.
    pub(crate) fn extra(&self) -> Extra {
        match self {
            Self::Pinhole(eye) => Extra { corners: [eye.position; 4], normal: Vec3::Y },
            Self::Patch(p) => Extra {
                corners: [p.corner, p.corner + p.u, p.corner + p.u + p.v, p.corner + p.v],
                normal: p.normal,
            },
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
    lens: Option<Distortion>,
}

/// A lens, its centre in tangents, and how far from its axis it draws.
#[derive(Debug, Clone)]
struct Distortion {
    lens: Lens,
    centre: [f64; 2],
    reach: f64,
}

impl Distortion {
    fn new(lens: Lens, half: [f32; 2]) -> Self {
        let centre = lens.centre.map(|c| 2.0 * f64::from(half[0]) * f64::from(c));
        Self { lens, centre, reach: lens.reach() }
    }

    /// The undistorted picture plane (tangents to the right and upwards) behind places on the drawn
    /// one. What no pixel of a checked camera asks for, beyond the lens, stays where it is.
    fn undone(&self, x: f32x8, y: f32x8) -> [f32x8; 2] {
        let ([mut x, mut y], [cx, cy]) = ([x.to_array(), y.to_array()], self.centre);
        for (x, y) in x.iter_mut().zip(&mut y) {
            let drawn = [f64::from(*x) - cx, -f64::from(*y) - cy];
            if let Some([right, down]) = self.lens.undistort(drawn, self.reach) {
                (*x, *y) = (right as f32, -down as f32);
            }
        }
        [x, y].map(f32x8::from)
    }

    /// Where points of the undistorted plane are drawn, by how much area is stretched there, and
    /// which lanes the lens draws at all.
    fn done(&self, x: f32x8, y: f32x8) -> ([f32x8; 2], f32x8, u32) {
        let ([mut x, mut y], [cx, cy]) = ([x.to_array(), y.to_array()], self.centre);
        let (mut stretch, mut drawn) = ([1.0; WIDE], 0);
        for lane in 0..WIDE {
            let seen = [f64::from(x[lane]), -f64::from(y[lane])];
            if seen[0].hypot(seen[1]) <= self.reach {
                let ([right, down], [a, b, c]) = self.lens.distort(seen);
                (x[lane], y[lane]) = ((right + cx) as f32, -(down + cy) as f32);
                stretch[lane] = (a * c - b * b) as f32;
                drawn |= 1 << lane;
            }
        }
        ([x, y].map(f32x8::from), f32x8::from(stretch), drawn)
    }
}

impl Pinhole {
    pub(crate) fn new(camera: &Camera) -> Self {
        let [right, up, forward] = camera.frame();
        let half = camera.half_extent();
        let (width, height) = (camera.width, camera.height);
        let density = (width * height) as f32 / (4.0 * half[0] * half[1]);
        let lens = camera.lens.map(|lens| Distortion::new(lens, half));
        Self { position: camera.position, right, up, forward, half, width, height, density, lens }
    }

    /// Unit directions through `jitter` within pixels `bin`.
    #[inline]
    pub(crate) fn directions(&self, bin: [u32; WIDE], jitter: [f32x8; 2]) -> Vec3x8 {
        let c = f32x8::splat;
        let x = (f32x8::from(bin.map(|b| (b % self.width) as f32)) + jitter[0])
            * c(2.0 / self.width as f32)
            - f32x8::ONE;
        let y = f32x8::ONE
            - (f32x8::from(bin.map(|b| (b / self.width) as f32)) + jitter[1])
                * c(2.0 / self.height as f32);
        let [x, y] = [x * c(self.half[0]), y * c(self.half[1])];
        let [x, y] = self.lens.as_ref().map_or([x, y], |lens| lens.undone(x, y));
        let right = Vec3x8::splat(self.right).mul_add(x, Vec3x8::splat(self.forward));
        let way = Vec3x8::splat(self.up).mul_add(y, right);
        way * (f32x8::ONE / way.dot(way).sqrt())
    }

    /// Unit direction through `jitter` within pixel `bin`.
    pub(crate) fn direction(&self, bin: u32, jitter: [f32; 2]) -> Vec3 {
        self.directions([bin; WIDE], jitter.map(f32x8::splat)).lane(0)
    }

    /// Which pixels see `to` (from the pinhole, any length), and W_e there per m² across the ray:
    /// J/(a cos³θ r²), with the pixel's area a and the lens's stretch of areas J (1 without): an
    /// undistorted area is dω/cos³θ, and a pixel is even over the drawn one. The mask names the
    /// lanes that are seen at all.
    #[inline]
    pub(crate) fn see(&self, to: Vec3x8) -> (u32, [u32; WIDE], f32x8) {
        let c = f32x8::splat;
        let along = |axis: Vec3| to.dot(Vec3x8::splat(axis));
        let z = along(self.forward);
        let (mut x, mut y) =
            (along(self.right) / (z * c(self.half[0])), along(self.up) / (z * c(self.half[1])));
        let (mut density, mut drawn) = (c(self.density), u32::MAX);
        if let Some(lens) = &self.lens {
            let half = self.half.map(c);
            let ([lens_x, lens_y], stretch, lanes) = lens.done(x * half[0], y * half[1]);
            (x, y, density, drawn) = (lens_x / half[0], lens_y / half[1], density * stretch, lanes);
        }
        let seen =
            z.simd_gt(f32x8::ZERO) & x.abs().simd_lt(f32x8::ONE) & y.abs().simd_lt(f32x8::ONE);
        let cell = |x: f32x8, n: u32| {
            (x * c(0.5 * n as f32)).fast_min(c((n - 1) as f32)).fast_trunc_int().to_array()
        };
        let (column, row) = (cell(x + f32x8::ONE, self.width), cell(f32x8::ONE - y, self.height));
        let bin = std::array::from_fn(|i| {
            (row[i] as u32).wrapping_mul(self.width).wrapping_add(column[i] as u32)
        });
        // cosθ = z/r, so 1/(cos³θ r²) = r/z³
        (seen.to_bitmask() & drawn, bin, density * to.dot(to).sqrt() / (z * z * z))
    }

    /// [`Self::see`] of one place.
    pub(crate) fn sees(&self, to: Vec3) -> Option<(u32, f32)> {
        let (seen, bin, response) = self.see(Vec3x8::splat(to));
        (seen & 1 == 1).then(|| (bin[0], response.as_array()[0]))
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
        Self {
            corner: meter.corner,
            u: meter.u,
            v: meter.v,
            normal,
            area,
            du,
            dv,
            lift: 1e-4 * area.sqrt(),
        }
    }

    /// Points, uniform by area, lifted off the surface below.
    #[inline]
    pub(crate) fn points(&self, at: [f32x8; 2]) -> Vec3x8 {
        let corner = Vec3x8::splat(self.corner + self.normal * self.lift);
        Vec3x8::splat(self.u).mul_add(at[0], Vec3x8::splat(self.v).mul_add(at[1], corner))
    }

    /// One of them.
    pub(crate) fn point(&self, at: [f32; 2]) -> Vec3 {
        self.points(at.map(f32x8::splat)).lane(0)
    }

    /// Direction and squared distance from `from` to the point `target` of the patch, and the
    /// cosine there if the front is seen.
    pub(crate) fn seen(&self, from: Vec3, target: Vec3) -> Option<(Vec3, f32, f32)> {
        let to = target - from;
        let squared = to.length_squared();
        let direction = to / squared.sqrt();
        let cos = -direction.dot(self.normal);
        (cos > 0.0).then_some((direction, cos, squared))
    }

    /// Cosine with which a ray that ends after `length` crosses the front, if it does. A surface
    /// right at the patch does not hide it.
    pub(crate) fn crossed(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<(f32, f32)> {
        let cos = -direction.dot(self.normal);
        let t = (origin - self.corner).dot(self.normal) / cos;
        if cos.is_nan()
            || cos <= 0.0
            || t.is_nan()
            || t <= 0.0
            || t > length * 1.0001 + 2.0 * self.lift
        {
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
            lens: None,
        }
    }

    fn distorted() -> Camera {
        let lens = Lens { k1: -0.25, k2: 0.06, p1: 0.004, p2: -0.003, centre: [0.02, -0.01] };
        Camera { fov_deg: 75.0, lens: Some(lens), ..camera() }
    }

    /// What a pixel's ray hits, the pixel sees; and ∫ W_e cos dω over a pixel is 1 by quadrature
    /// over the sphere, whatever the lens.
    #[test]
    fn the_pinhole_sees_what_it_looks_at() {
        for (camera, n) in [(camera(), 4_000_000_u64), (distorted(), 4_000_000)] {
            assert!(camera.is_covered());
            let eye = Pinhole::new(&camera);
            for i in 0..1000_u32 {
                let bin = i % (40 * 30);
                let key = Key::new(1, u64::from(i));
                let d = eye.direction(bin, [0.01 + 0.98 * key.unit(0), 0.01 + 0.98 * key.unit(1)]);
                assert_eq!(eye.sees(d * 7.0).map(|s| s.0), Some(bin));
            }
            let (mut sum, mut corner) = (0.0, [0.0; 2]);
            for i in 0..n {
                let d = crate::bsdf::warp::sphere(Key::new(2, i).pair(0));
                // seen at distance 1: W_e per m² across the ray is W_e per sr
                let Some((bin, w)) = eye.sees(d) else { continue };
                sum += f64::from(w);
                // A block of 8 × 8 pixels in the corner, where the lens stretches most.
                if bin % 40 < 8 && bin / 40 < 8 {
                    corner[0] += f64::from(w);
                    corner[1] += f64::from(w).powi(2);
                }
            }
            let sphere = 4.0 * std::f64::consts::PI / n as f64;
            // every one of the 1200 pixels integrates to 1; 5 standard errors of this sum are 1 %
            assert!((sum * sphere / 1200.0 - 1.0).abs() < 0.01, "{sum}");
            let z = (corner[0] * sphere - 64.0) / (corner[1].sqrt() * sphere);
            assert!(z.abs() < 4.0, "{z}: {}", corner[0] * sphere);
        }
    }

    #[test]
    fn a_patch_is_crossed_from_its_front_only() {
        let meter =
            Meter { name: "m".into(), corner: Vec3::ZERO, u: Vec3::X, v: Vec3::Y, on: None };
        let patch = Patch::new(&meter);
        let above = Vec3::new(0.25, 0.5, 2.0);
        assert_eq!(patch.crossed(above, Vec3::NEG_Z, 5.0), Some((1.0, 2.0)));
        assert_eq!(patch.crossed(above, Vec3::NEG_Z, 1.0), None);
        assert_eq!(patch.crossed(above - 4.0 * Vec3::Z, Vec3::Z, 5.0), None);
        assert_eq!(patch.crossed(above + Vec3::X, Vec3::NEG_Z, 5.0), None);
    }
}
