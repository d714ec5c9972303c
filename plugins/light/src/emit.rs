//! What leaves the lamps: sampling routines for both directions of transport.
//!
//! *Toward* a point (next event of the camera's walk): a direction, what arrives along it, its
//! density per sr. *Emission* (start of the lamp's walk): a ray and the flux that it carries. Both
//! serve emissive triangles and every `LampKind`; lamps without an area in the scene (directional,
//! environment) emit from a disk across the scene's bounding sphere. Flux, in watts, is what lamps
//! are chosen by. Channels are linear Rec. 709, each in W.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use intrados_scene::{LampKind, Texture, Wrap};

use crate::{
    bsdf::warp::{self, Discrete, Frame},
    rgb::luminance,
};

/// A sphere around the scene: where light from beyond starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Centre, m.
    pub centre: Vec3,
    /// Radius, m.
    pub radius: f32,
}

impl Bounds {
    /// The sphere around a box, a little larger so that rounding leaves nothing outside.
    #[must_use]
    pub fn of_box([lo, hi]: [Vec3; 2]) -> Self {
        Self { centre: 0.5 * (lo + hi), radius: (0.5 * (hi - lo).length() * 1.001).max(1e-3) }
    }

    /// Area across, m².
    pub(crate) fn disk_area(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// A point of the disk that faces `-direction` at the sphere's far side: rays from it along
    /// `direction` cover the scene.
    fn start(&self, direction: Vec3, u: [f32; 2]) -> Vec3 {
        let (frame, p) = (Frame::new(direction), warp::disk(u));
        self.centre + self.radius * (frame.x * p.x + frame.y * p.y - direction)
    }
}

/// Light that may arrive at a point: multiply by f·cos and visibility, divide by `pdf`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toward {
    /// From the point to the lamp, unit.
    pub direction: Vec3,
    /// m; infinite where the lamp is beyond the scene.
    pub distance: f32,
    /// Radiance (W·m⁻²·sr⁻¹); where `delta`, irradiance across the direction (W·m⁻²).
    pub radiance: Vec3,
    /// Per sr; 1 where `delta`.
    pub pdf: f32,
    /// Whether no other strategy can find this direction.
    pub delta: bool,
}

/// The start of a walk from a lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// m.
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    /// Normal of the lamp at the origin; equals `direction` for lamps that have none.
    pub normal: Vec3,
    /// Flux that the ray carries, W: L cosθ/(pdf_position pdf_direction). Its mean over samples is
    /// the lamp's flux.
    pub flux: Vec3,
    /// Density of the origin, per m²; 1 for lamps at a point.
    pub pdf_position: f32,
    /// Density of the direction, per sr; 1 for parallel beams.
    pub pdf_direction: f32,
    /// Whether every ray has the same origin.
    pub delta_position: bool,
    /// Whether every ray has the same direction.
    pub delta_direction: bool,
}

/// One lamp, ready for sampling.
#[derive(Debug, Clone, PartialEq)]
pub enum Emitter {
    /// An emissive triangle.
    Triangle(Triangle),
    /// The same intensity everywhere.
    Point {
        /// m.
        position: Vec3,
        /// W·sr⁻¹.
        intensity: Vec3,
    },
    /// A cone.
    Spot(Spot),
    /// A parallel beam.
    Directional {
        /// Where the light goes, unit.
        direction: Vec3,
        /// Across the beam, W·m⁻².
        irradiance: Vec3,
        /// Around the scene.
        bounds: Bounds,
    },
    /// Light from beyond the scene.
    Environment(Environment),
}

impl Emitter {
    /// A lamp of the scene.
    #[must_use]
    pub fn new(kind: &LampKind, bounds: Bounds) -> Self {
        match *kind {
            LampKind::Point { position, intensity } => Self::Point { position, intensity },
            LampKind::Spot { position, direction, intensity, inner, outer } => {
                Self::Spot(Spot::new(position, direction, intensity, inner, outer))
            }
            LampKind::Directional { direction, irradiance } => Self::Directional {
                direction: direction.normalize_or(Vec3::NEG_Y),
                irradiance,
                bounds,
            },
            LampKind::Environment { radiance, ref image } => {
                Self::Environment(Environment::new(radiance, image.as_ref(), bounds))
            }
        }
    }

    /// Total flux, W. Of lamps beyond the scene: what crosses the sphere around it.
    #[must_use]
    pub(crate) fn flux(&self) -> Vec3 {
        match self {
            Self::Triangle(t) => t.flux(),
            Self::Point { intensity, .. } => 2.0 * TAU * *intensity,
            Self::Spot(s) => s.flux(),
            Self::Directional { irradiance, bounds, .. } => *irradiance * bounds.disk_area(),
            Self::Environment(e) => e.flux(),
        }
    }

    /// A direction from `x` toward the lamp. `None` where this sample brings nothing: the lamp's
    /// back, outside the cone.
    #[inline]
    #[must_use]
    pub(crate) fn toward(&self, x: Vec3, u: [f32; 2]) -> Option<Toward> {
        match self {
            Self::Triangle(t) => t.toward(x, u),
            Self::Point { position, intensity } => arriving(*position, x, |_| *intensity),
            Self::Spot(s) => arriving(s.position, x, |direction| s.intensity(direction)),
            Self::Directional { direction, irradiance, .. } => Some(Toward {
                direction: -*direction,
                distance: f32::INFINITY,
                radiance: *irradiance,
                pdf: 1.0,
                delta: true,
            }),
            Self::Environment(e) => e.toward(u),
        }
    }

    /// Density, per sr, with which `toward` draws `direction` from `x`, given that the lamp is what
    /// is hit there; 0 for deltas.
    #[inline]
    #[must_use]
    pub(crate) fn pdf_toward(&self, x: Vec3, direction: Vec3) -> f32 {
        match self {
            Self::Triangle(t) => t.pdf_toward(x, direction),
            Self::Environment(e) => e.pdf(direction),
            _ => 0.0,
        }
    }

    /// A ray from the lamp, from four uniform numbers.
    #[inline]
    #[must_use]
    pub(crate) fn emit(&self, u: [f32; 4]) -> Emission {
        let (a, b) = ([u[0], u[1]], [u[2], u[3]]);
        match self {
            Self::Triangle(t) => t.emit(a, b),
            Self::Point { position, intensity } => {
                at_point(*position, warp::sphere(b), 0.5 / TAU, *intensity)
            }
            Self::Spot(s) => s.emit(b),
            Self::Directional { direction, irradiance, bounds } => Emission {
                origin: bounds.start(*direction, a),
                direction: *direction,
                normal: *direction,
                flux: *irradiance * bounds.disk_area(),
                pdf_position: 1.0 / bounds.disk_area(),
                pdf_direction: 1.0,
                delta_position: false,
                delta_direction: true,
            },
            Self::Environment(e) => e.emit(a, b),
        }
    }
}

/// What a lamp at a point sends to `x`, I/r².
fn arriving(position: Vec3, x: Vec3, intensity: impl Fn(Vec3) -> Vec3) -> Option<Toward> {
    let to = position - x;
    let distance = to.length();
    let direction = to / distance;
    let radiance = intensity(-direction) / (distance * distance);
    (distance > 0.0 && radiance != Vec3::ZERO).then_some(Toward {
        direction,
        distance,
        radiance,
        pdf: 1.0,
        delta: true,
    })
}

fn at_point(origin: Vec3, direction: Vec3, pdf_direction: f32, intensity: Vec3) -> Emission {
    Emission {
        origin,
        direction,
        normal: direction,
        flux: intensity / pdf_direction,
        pdf_position: 1.0,
        pdf_direction,
        delta_position: true,
        delta_direction: false,
    }
}

/// An emissive triangle: radiance from its front, the side that sees it wind anticlockwise; black
/// behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// First corner, m.
    pub corner: Vec3,
    /// From the first to the second and to the third corner, m.
    pub edges: [Vec3; 2],
    /// Unit.
    pub normal: Vec3,
    /// m².
    pub area: f32,
    /// L_e, W·m⁻²·sr⁻¹.
    pub radiance: Vec3,
}

impl Triangle {
    /// `None` where the triangle has no area.
    #[must_use]
    pub fn new(corners: [Vec3; 3], radiance: Vec3) -> Option<Self> {
        let edges = [corners[1] - corners[0], corners[2] - corners[0]];
        let cross = edges[0].cross(edges[1]);
        let normal = cross.try_normalize()?;
        Some(Self { corner: corners[0], edges, normal, area: 0.5 * cross.length(), radiance })
    }

    /// Radiant flux, π L A.
    #[must_use]
    pub(crate) fn flux(&self) -> Vec3 {
        self.radiance * (PI * self.area)
    }

    /// A point, uniform by area: density 1/`area`.
    #[inline]
    #[must_use]
    pub fn point(&self, u: [f32; 2]) -> Vec3 {
        let [b, c] = warp::triangle(u);
        self.corner + self.edges[0] * b + self.edges[1] * c
    }

    /// See `Emitter::toward`: uniform by area, the density carried over by r²/cosθ′.
    #[inline]
    #[must_use]
    pub(crate) fn toward(&self, x: Vec3, u: [f32; 2]) -> Option<Toward> {
        let to = self.point(u) - x;
        let squared = to.length_squared();
        let distance = squared.sqrt();
        let direction = to / distance;
        let cos = -direction.dot(self.normal);
        let pdf = squared / (cos * self.area);
        (cos > 0.0 && pdf > 0.0 && pdf.is_finite()).then_some(Toward {
            direction,
            distance,
            radiance: self.radiance,
            pdf,
            delta: false,
        })
    }

    /// See `Emitter::pdf_toward`.
    #[inline]
    #[must_use]
    pub(crate) fn pdf_toward(&self, x: Vec3, direction: Vec3) -> f32 {
        let cos = -direction.dot(self.normal);
        let distance = (x - self.corner).dot(self.normal) / cos;
        if cos > 0.0 && distance > 0.0 { distance * distance / (cos * self.area) } else { 0.0 }
    }

    /// See `Emitter::emit`.
    #[inline]
    #[must_use]
    pub(crate) fn emit(&self, position: [f32; 2], direction: [f32; 2]) -> Emission {
        let local = warp::cosine_hemisphere(direction);
        Emission {
            origin: self.point(position),
            direction: Frame::new(self.normal).to_world(local),
            normal: self.normal,
            flux: self.flux(),
            pdf_position: 1.0 / self.area,
            pdf_direction: warp::cosine_hemisphere_pdf(local.z),
            delta_position: false,
            delta_direction: false,
        }
    }
}

/// A spot: full intensity within the inner cone, none beyond the outer, between them the square of
/// a line in the cosine, as `KHR_lights_punctual` recommends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    position: Vec3,
    frame: Frame,
    /// On the axis, W·sr⁻¹.
    peak: Vec3,
    cos_outer: f32,
    /// How far the cosine falls from full to nothing; at least .001, again as recommended.
    fall: f32,
}

impl Spot {
    /// Half angles in radians; they are brought to 0 ≤ inner ≤ outer ≤ π/2.
    #[must_use]
    pub fn new(position: Vec3, direction: Vec3, intensity: Vec3, inner: f32, outer: f32) -> Self {
        // No narrower than what f32 can tell from no cone at all.
        let outer = outer.clamp(2e-3, 0.5 * PI);
        let cos_outer = outer.cos();
        let fall = (inner.clamp(0.0, outer).cos() - cos_outer).max(1e-3);
        Self {
            position,
            frame: Frame::new(direction.normalize_or(Vec3::NEG_Z)),
            peak: intensity,
            cos_outer,
            fall,
        }
    }

    /// Intensity along the unit vector `direction`, W·sr⁻¹.
    #[inline]
    #[must_use]
    pub fn intensity(&self, direction: Vec3) -> Vec3 {
        let a = ((direction.dot(self.frame.z) - self.cos_outer) / self.fall).clamp(0.0, 1.0);
        self.peak * (a * a)
    }

    /// Total flux, W: 2π(∫ of the square over the fall + what is left to the axis).
    #[must_use]
    pub(crate) fn flux(&self) -> Vec3 {
        let whole = (1.0 - self.cos_outer).min(self.fall);
        self.peak
            * (TAU
                * (whole.powi(3) / (3.0 * self.fall * self.fall) + (1.0 - self.cos_outer - whole)))
    }

    /// Density, per sr, with which `emit` draws `direction`.
    #[inline]
    #[must_use]
    pub(crate) fn pdf_direction(&self, direction: Vec3) -> f32 {
        if direction.dot(self.frame.z) > self.cos_outer {
            warp::cone_pdf(self.cos_outer)
        } else {
            0.0
        }
    }

    /// A ray, uniform in the outer cone.
    #[inline]
    #[must_use]
    pub(crate) fn emit(&self, u: [f32; 2]) -> Emission {
        let direction = self.frame.to_world(warp::cone(u, self.cos_outer));
        at_point(
            self.position,
            direction,
            warp::cone_pdf(self.cos_outer),
            self.intensity(direction),
        )
    }
}

/// Light from beyond the scene, uniform or from an equirectangular image.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    radiance: Vec3,
    image: Option<Image>,
    bounds: Bounds,
}

/// An image with its distribution: a texel is chosen by the luminance of its part of the integral,
/// a point uniformly in it. The integral is that of the bilinear picture, so that the density is
/// positive wherever there is light.
#[derive(Debug, Clone, PartialEq)]
struct Image {
    texture: Texture,
    rows: Discrete,
    columns: Vec<Option<Discrete>>,
    /// ∫ of the picture over the sphere, sr.
    integral: Vec3,
}

impl Environment {
    /// An image without light, or none, is uniform; of an image with light `radiance` is a factor.
    #[must_use]
    pub fn new(radiance: Vec3, image: Option<&Texture>, bounds: Bounds) -> Self {
        match image {
            None => Self { radiance, image: None, bounds },
            Some(texture) => match Image::new(texture) {
                Some(image) => Self { radiance, image: Some(image), bounds },
                None => Self { radiance: Vec3::ZERO, image: None, bounds },
            },
        }
    }

    /// Radiance from `direction`, which points away from the scene.
    #[inline]
    #[must_use]
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match &self.image {
            None => self.radiance,
            Some(image) => self.radiance * image.texture.sample(coordinates(direction)),
        }
    }

    /// Flux through the sphere around the scene: ∫ L dω times its cross-section.
    #[must_use]
    pub(crate) fn flux(&self) -> Vec3 {
        let integral = self.image.as_ref().map_or(Vec3::splat(2.0 * TAU), |image| image.integral);
        self.radiance * integral * self.bounds.disk_area()
    }

    /// Density of `toward`, per sr.
    #[inline]
    #[must_use]
    pub(crate) fn pdf(&self, direction: Vec3) -> f32 {
        match &self.image {
            None => 0.5 / TAU,
            Some(image) => image.pdf(direction),
        }
    }

    fn direction(&self, u: [f32; 2]) -> Option<(Vec3, f32)> {
        match &self.image {
            None => Some((warp::sphere(u), 0.5 / TAU)),
            Some(image) => image.direction(u),
        }
    }

    /// See `Emitter::toward`; the same from every point.
    #[inline]
    #[must_use]
    pub(crate) fn toward(&self, u: [f32; 2]) -> Option<Toward> {
        let (direction, pdf) = self.direction(u)?;
        Some(Toward {
            direction,
            distance: f32::INFINITY,
            radiance: self.radiance(direction),
            pdf,
            delta: false,
        })
    }

    /// See `Emitter::emit`: a direction as in `toward`, an origin on the disk across it.
    #[inline]
    #[must_use]
    pub(crate) fn emit(&self, position: [f32; 2], direction: [f32; 2]) -> Emission {
        let (from, pdf_direction) = self.direction(direction).unwrap_or((Vec3::Y, 0.5 / TAU));
        Emission {
            origin: self.bounds.start(-from, position),
            direction: -from,
            normal: -from,
            flux: self.radiance(from) * (self.bounds.disk_area() / pdf_direction),
            pdf_position: 1.0 / self.bounds.disk_area(),
            pdf_direction,
            delta_position: false,
            delta_direction: false,
        }
    }
}

/// Where in an equirectangular image a direction lies: u = atan2(x, −z)/2π + ½, v = acos(y)/π.
#[inline]
fn coordinates(direction: Vec3) -> Vec2 {
    let v = direction.x.hypot(direction.z).atan2(direction.y) * FRAC_1_PI;
    Vec2::new(direction.x.atan2(-direction.z) / TAU + 0.5, v)
}

impl Image {
    /// `None` where the image is empty, too short for its size, or dark.
    fn new(texture: &Texture) -> Option<Self> {
        let (width, height) = (texture.width, texture.height);
        if width == 0 || height == 0 || texture.texels.len() < width.checked_mul(height)? {
            return None;
        }
        let texture = Texture { wrap: [Wrap::Repeat, Wrap::Clamp], ..texture.clone() };
        let mut integral = DVec3::ZERO;
        let mut columns = Vec::with_capacity(height);
        let mut rows = Vec::with_capacity(height);
        for row in 0..height {
            let weights = row_weights(row, width, height);
            let texels: Vec<Vec3> =
                (0..width).map(|column| texel_integral(&texture, column, row, weights)).collect();
            integral += texels.iter().map(|t| t.as_dvec3()).sum::<DVec3>();
            let choice = Discrete::new(&texels.iter().map(|&t| luminance(t)).collect::<Vec<_>>());
            rows.push(choice.as_ref().map_or(0.0, |c| c.total() as f32));
            columns.push(choice);
        }
        Some(Self { rows: Discrete::new(&rows)?, columns, integral: integral.as_vec3(), texture })
    }

    fn direction(&self, u: [f32; 2]) -> Option<(Vec3, f32)> {
        let (width, height) = (self.texture.width, self.texture.height);
        let (row, _, y) = self.rows.sample(u[0]);
        let (column, _, x) = self.columns[row].as_ref()?.sample(u[1]);
        let (sin, cos) = (PI * (row as f32 + y) / height as f32).sin_cos();
        let (sin_phi, cos_phi) = (((column as f32 + x) / width as f32 - 0.5) * TAU).sin_cos();
        let pdf = self.texel_pdf(column, row, sin);
        (pdf.is_finite() && pdf > 0.0)
            .then_some((Vec3::new(sin * sin_phi, cos, -sin * cos_phi), pdf))
    }

    fn pdf(&self, direction: Vec3) -> f32 {
        let uv = coordinates(direction);
        let within = |x: f32, n: usize| ((x * n as f32).max(0.0) as usize).min(n - 1);
        self.texel_pdf(
            within(uv.x, self.texture.width),
            within(uv.y, self.texture.height),
            direction.x.hypot(direction.z),
        )
    }

    /// Per sr, where the polar angle has this sine: uniform over a texel's rectangle of (u, v), dω
    /// = 2π² sinθ du dv.
    fn texel_pdf(&self, column: usize, row: usize, sin: f32) -> f32 {
        let in_row = self.columns[row].as_ref().map_or(0.0, |c| c.probability(column));
        self.rows.probability(row) * in_row * (self.texture.width * self.texture.height) as f32
            / (TAU * PI * sin)
    }
}

/// Weights, in sr, of the rows above, at and below in the integral of the bilinear picture over one
/// texel of `row`: ∫∫ of the interpolation weight times sinθ, by Gauss-Legendre on the halves above
/// and below the texel's centre.
fn row_weights(row: usize, width: usize, height: usize) -> [f32; 3] {
    const NODES: [(f64, f64); 3] = [
        (-0.774_596_669_241_483_4, 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.774_596_669_241_483_4, 5.0 / 9.0),
    ];
    let step = std::f64::consts::PI / height as f64;
    let scale = std::f64::consts::TAU / width as f64 * 0.25 * step;
    let mut weights = [0.0; 3];
    for (x, w) in NODES {
        // Distance from the centre, in texels.
        let t = 0.25 * (1.0 + x);
        for (neighbour, side) in [(0, -t), (2, t)] {
            let value = w * scale * ((row as f64 + 0.5 + side) * step).sin();
            weights[neighbour] += t * value;
            weights[1] += (1.0 - t) * value;
        }
    }
    weights.map(|w| w as f32)
}

/// Integral of the bilinear picture over a texel, sr; across, its weights are 1/8, 6/8, 1/8.
fn texel_integral(texture: &Texture, column: usize, row: usize, weights: [f32; 3]) -> Vec3 {
    let (width, height) = (texture.width, texture.height);
    let columns = [(column + width - 1) % width, column, (column + 1) % width];
    let rows = [row.saturating_sub(1), row, (row + 1).min(height - 1)];
    let mut sum = Vec3::ZERO;
    for (r, wr) in rows.iter().zip(weights) {
        for (c, wc) in columns.iter().zip([0.125, 0.75, 0.125]) {
            sum += texture.texels[r * width + c] * (wr * wc);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use intrados_stage::random::Key;

    use super::*;
    use crate::battery::lamps;

    const N: u64 = 200_000;

    /// Mean and standard error of `draw` over `N` keys.
    fn mean(seed: u64, draw: impl Fn(Key) -> Vec3) -> (DVec3, DVec3) {
        let (mut sum, mut square) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..N {
            let x = draw(Key::new(seed, i)).as_dvec3();
            sum += x;
            square += x * x;
        }
        let mean = sum / N as f64;
        let variance = (square / N as f64 - mean * mean).max(DVec3::ZERO);
        (mean, DVec3::from_array(variance.to_array().map(|v| (v / N as f64).sqrt())))
    }

    fn draw(lamp: &Emitter, k: Key) -> Emission {
        lamp.emit([k.unit(0), k.unit(1), k.unit(2), k.unit(3)])
    }

    /// Within 4.5 standard errors (false alarm 1e-4 over all) or rounding.
    #[test]
    fn the_mean_of_emitted_flux_is_the_flux() {
        for (name, lamp) in lamps() {
            let (got, error) = mean(21, |k| draw(&lamp, k).flux);
            let flux = lamp.flux().as_dvec3();
            let off = (got - flux).abs();
            assert!(
                (off - 4.5 * error).cmple(flux * 2e-5).all(),
                "{name}: {got} ± {error}, flux {flux}"
            );
        }
    }

    /// The flux that a lamp's rays carry through a small disk is the irradiance there that `toward`
    /// finds: the two sampling sides of every lamp describe the same light. Within 4.5 standard
    /// errors.
    #[test]
    fn both_sides_see_the_same_light() {
        let (x, radius) = (Vec3::new(0.6, 1.0, 0.3), 0.8);
        let normal = Vec3::new(0.2, 1.0, -0.1).normalize();
        let frame = Frame::new(normal);
        for (name, lamp) in lamps() {
            // From the lamp: rays through the disk, per area.
            let (dual, dual_error) = mean(22, |k| {
                let e = draw(&lamp, k);
                let t = (x - e.origin).dot(normal) / e.direction.dot(normal);
                let inside = t > 0.0
                    && e.direction.dot(normal) < 0.0
                    && (e.origin + e.direction * t - x).length() < radius;
                if inside { e.flux / (PI * radius * radius) } else { Vec3::ZERO }
            });
            // From points of the disk.
            let (primal, primal_error) = mean(23, |k| {
                let p = radius * warp::disk(k.pair(0));
                let point = x + frame.x * p.x + frame.y * p.y;
                lamp.toward(point, k.pair(2))
                    .map_or(Vec3::ZERO, |t| t.radiance * (t.direction.dot(normal).max(0.0) / t.pdf))
            });
            let error =
                4.5 * (dual_error * dual_error + primal_error * primal_error).map(f64::sqrt);
            assert!(
                primal.min_element() > 10.0 * error.max_element() / 4.5,
                "{name}: {primal} ± {error} says nothing"
            );
            assert!(
                (dual - primal).abs().cmple(error + primal * 1e-5).all(),
                "{name}: {dual} and {primal} ± {error}"
            );
        }
    }

    #[test]
    fn densities_are_those_of_the_samples() {
        let x = Vec3::new(0.2, 0.5, 0.4);
        for (name, lamp) in lamps() {
            for i in 0..10_000 {
                let Some(t) = lamp.toward(x, Key::new(24, i).pair(0)) else { continue };
                assert!(
                    (t.direction.length() - 1.0).abs() < 1e-5
                        && t.pdf > 0.0
                        && t.radiance.min_element() >= 0.0
                );
                let pdf = lamp.pdf_toward(x, t.direction);
                assert!(
                    t.delta && pdf == 0.0 || (pdf / t.pdf - 1.0).abs() < 1e-3,
                    "{name}: {pdf} for {t:?}"
                );
                if let Emitter::Environment(e) = &lamp {
                    assert!((e.radiance(t.direction) - t.radiance).abs().max_element() < 1e-5);
                }
            }
        }
    }

    /// Ω of the triangle by Van Oosterom & Strackee (1983) against the mean of 1/pdf.
    #[test]
    fn a_triangle_has_its_solid_angle() {
        let (a, b, c) =
            (Vec3::new(0.0, 3.0, 0.0), Vec3::new(2.0, 3.5, 0.0), Vec3::new(0.5, 3.0, 2.0));
        let lamp = Triangle::new([a, b, c], Vec3::ONE).unwrap();
        let (got, error) = mean(25, |k| {
            lamp.toward(Vec3::ZERO, k.pair(0)).map_or(Vec3::ZERO, |t| Vec3::splat(1.0 / t.pdf))
        });
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let volume = a.dot(b.cross(c)).abs();
        let angle =
            2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        assert!((got.x - f64::from(angle)).abs() < 4.5 * error.x, "{got} ± {error}, {angle}");
        assert!(lamp.toward(Vec3::new(0.5, 9.0, 0.5), [0.3, 0.3]).is_none(), "black behind");
        assert!(Triangle::new([a, a, b], Vec3::ONE).is_none());
    }

    /// The convention of `LampKind::Environment`: −z in the middle, +y on top, left of the middle
    /// is −x.
    #[test]
    fn directions_and_pictures_agree() {
        let near =
            |d: Vec3, u: f32, v: f32| (coordinates(d) - Vec2::new(u, v)).abs().max_element() < 1e-6;
        assert!(
            near(Vec3::NEG_Z, 0.5, 0.5) && near(Vec3::NEG_X, 0.25, 0.5) && near(Vec3::X, 0.75, 0.5)
        );
        assert!(coordinates(Vec3::Y).y < 1e-6 && coordinates(Vec3::NEG_Y).y > 1.0 - 1e-6);
    }

    #[test]
    fn odd_lamps_do_no_harm() {
        let bounds = Bounds::of_box([Vec3::ZERO; 2]);
        let image = |width, height, n| Texture {
            width,
            height,
            texels: vec![Vec3::ZERO; n],
            wrap: [Wrap::Repeat; 2],
        };
        for texture in [image(0, 0, 0), image(4, 2, 8), image(4, 2, 3)] {
            let dark = Environment::new(Vec3::ONE, Some(&texture), bounds);
            assert_eq!((dark.flux(), dark.radiance(Vec3::Y)), (Vec3::ZERO, Vec3::ZERO));
        }
        let cases = [(0.0, 0.0), (2.0, 0.1), (-1.0, 9.0), (0.5, 0.5)];
        for (inner, outer) in cases {
            let spot = Spot::new(Vec3::ZERO, Vec3::ZERO, Vec3::ONE, inner, outer);
            let e = spot.emit([0.5, 0.5]);
            assert!(
                e.flux.is_finite() && spot.flux().is_finite() && spot.flux().x > 0.0,
                "{inner} {outer} {e:?}"
            );
        }
    }
}
