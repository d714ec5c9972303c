//! *Shown*: what a photograph would reveal of each defect at a surface: its contrast to noise at a given exposure.
//!
//! A crack is darker than the concrete around it by its share of a pixel; a spall by the slope of its dish. What hides them is the shot noise of the light, the noise of reading the sensor
//! and the concrete's own mottling. Over the n pixels that a defect covers, a matched filter sees
//!
//! ```text
//! CNR = √n · c N / √(N + r² + (m N)²)
//! ```
//!
//! with contrast c, electrons N of a sound pixel, read noise r and mottling m. From 5 on people see it (Rose 1948).

use std::sync::Arc;

use glam::Vec3;
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, scene_rule};
use intrados_scene::{Camera, Damage, Member, Ray, tracer::Hit, tracer::Scratch};
use intrados_stage::{Cancelled, Job};
use serde::Serialize;

/// Contrast to noise from which a defect is seen (Rose 1948).
pub const SEEN_FROM: f64 = 5.0;
/// Share of the light around it that comes out of a crack.
const OUT_OF_A_CRACK: f64 = 0.05;
/// Pixels across the little picture that tells how bright a place is.
const SPOT: u32 = 4;

/// The sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sensor {
    /// Electrons of a pixel that is just white.
    pub full: f64,
    /// Standard deviation of reading a pixel, electrons.
    pub read: f64,
    /// Mottling of concrete: relative standard deviation of a pixel.
    pub mottling: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Self { full: 20_000.0, read: 5.0, mottling: 0.03 }
    }
}

/// One defect in one camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// Id of the member.
    pub member: String,
    /// What it is.
    pub defect: String,
    /// Name of the camera.
    pub camera: String,
    /// Whether the camera sees its place at all.
    pub in_view: bool,
    /// From the camera, m.
    pub distance_m: f64,
    /// What a pixel covers there, mm.
    pub pixel_mm: f64,
    /// Share by which its pixels are darker.
    pub contrast: f64,
    /// Contrast to noise; 0 where it is not in view.
    pub contrast_to_noise: f64,
    /// Whether it would be seen.
    pub seen: bool,
}

/// A defect at the surface.
#[derive(Debug, Clone, PartialEq)]
struct Defect {
    what: String,
    along: f32,
    side_deg: f32,
    /// m.
    length: f64,
    mark: Mark,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mark {
    /// Opening, m.
    Crack(f64),
    /// Depth, m.
    Dish(f64),
}

/// Every planted crack and spall of a scene in one of its cameras.
///
/// # Errors
/// The job was cancelled.
pub fn shown(lit: &Arc<LitScene>, camera: &Camera, sensor: Sensor, seed: u64, job: &Job) -> Result<Vec<Shown>, Cancelled> {
    let scene = &lit.scene;
    let all: Vec<(usize, Defect)> =
        scene.members.iter().enumerate().flat_map(|(i, m)| m.truth.iter().filter_map(|d| defect(m, d)).map(move |d| (i, d))).collect();
    let mut told = Vec::new();
    for (k, (member, defect)) in all.iter().enumerate() {
        job.step(k, all.len())?;
        let Some((at, outward)) = place(lit, &scene.members[*member], defect) else { continue };
        told.push(look(lit, camera, sensor, seed, &scene.members[*member].id, defect, at, outward));
    }
    Ok(told)
}

fn defect(member: &Member, damage: &Damage) -> Option<Defect> {
    let side = (member.volume / f64::from(member.frame.axis.length()).max(1e-6)).sqrt();
    match *damage {
        Damage::Crack { along, width_mm, depth, angle_deg } => Some(Defect {
            what: format!("crack {width_mm} mm wide at {:.0} % of the axis", 100.0 * along),
            along,
            side_deg: angle_deg,
            // It runs round the side that it starts from, and as far round the others as it is deep.
            length: side * (1.0 + 2.0 * f64::from(depth)),
            mark: Mark::Crack(1e-3 * f64::from(width_mm)),
        }),
        Damage::Spall { along, angle_deg, diameter_m, depth_m } => Some(Defect {
            what: format!("spall {:.0} mm wide at {:.0} % of the axis", 1e3 * diameter_m, 100.0 * along),
            along,
            side_deg: angle_deg,
            length: f64::from(diameter_m),
            mark: Mark::Dish(f64::from(depth_m)),
        }),
        _ => None,
    }
}

/// Where a defect is on its member's surface: what a ray meets that comes towards the axis, from outside or, of a hollow member, from its axis.
fn place(lit: &LitScene, member: &Member, defect: &Defect) -> Option<(Vec3, Vec3)> {
    let (axis, radial) = (member.frame.point(defect.along), member.frame.radial(defect.side_deg));
    let reach = (member.bounds[1] - member.bounds[0]).length();
    let meet = |origin: Vec3, way: Vec3| {
        let mut hits = [Hit::MISS];
        lit.tracer.closest(&[Ray::new(origin, way, reach)], &mut hits, &mut Scratch::default());
        hits[0].is_hit().then(|| origin + way * hits[0].t)
    };
    let within = |p: &Vec3| (p.cmpge(member.bounds[0] - 0.01) & p.cmple(member.bounds[1] + 0.01)).all();
    let hollow = matches!(member.kind, intrados_scene::MemberKind::Lining | intrados_scene::MemberKind::Segment);
    if hollow {
        return meet(axis, radial).filter(within).map(|p| (p, -radial));
    }
    // From inside the concrete the surface is met from behind.
    meet(axis, radial).filter(within).map(|p| (p, radial))
}

#[allow(clippy::too_many_arguments, reason = "a place, who looks, and with what")]
fn look(lit: &Arc<LitScene>, camera: &Camera, sensor: Sensor, seed: u64, member: &str, defect: &Defect, at: Vec3, outward: Vec3) -> Shown {
    let from = camera.position - at;
    let distance = from.length();
    let slant = f64::from(outward.dot(from / distance.max(1e-6)));
    let pixel = 2.0 * f64::from(camera.half_extent()[0]) / f64::from(camera.width.max(1)) * f64::from(distance);
    let in_view = slant > 0.0 && is_free(lit, camera.position, at + outward * 1e-3) && is_in_picture(camera, at);
    let contrast = defect.contrast(pixel);
    let electrons = if in_view { sensor.full * brightness(lit, camera, at, seed).min(1.0) } else { 0.0 };
    let ratio = if in_view { contrast_to_noise(contrast, defect.pixels(pixel, slant), electrons, sensor) } else { 0.0 };
    Shown {
        member: member.to_owned(),
        defect: defect.what.clone(),
        camera: camera.name.clone(),
        in_view,
        distance_m: f64::from(distance),
        pixel_mm: 1e3 * pixel,
        contrast,
        contrast_to_noise: ratio,
        seen: ratio >= SEEN_FROM,
    }
}

impl Defect {
    /// Share by which the pixels that it covers are darker; `pixel` in metres.
    fn contrast(&self, pixel: f64) -> f64 {
        match self.mark {
            Mark::Crack(width) => (1.0 - OUT_OF_A_CRACK) * (width / pixel.max(1e-9)).min(1.0),
            // The mean slope of a parabolic dish.
            Mark::Dish(depth) => (2.0 * depth / self.length.max(1e-9)).min(1.0),
        }
    }

    /// Pixels that it covers, seen at a slant (the cosine).
    fn pixels(&self, pixel: f64, slant: f64) -> f64 {
        let along = self.length / pixel.max(1e-9);
        match self.mark {
            Mark::Crack(width) => along * (width / pixel.max(1e-9)).max(1.0),
            Mark::Dish(_) => std::f64::consts::FRAC_PI_4 * along * along * slant,
        }
    }
}

/// √n · c N / √(N + r² + (m N)²).
#[must_use]
pub fn contrast_to_noise(contrast: f64, pixels: f64, electrons: f64, sensor: Sensor) -> f64 {
    let noise = (electrons + sensor.read.powi(2) + (sensor.mottling * electrons).powi(2)).sqrt();
    if noise > 0.0 { pixels.max(0.0).sqrt() * contrast * electrons / noise } else { 0.0 }
}

fn is_free(lit: &LitScene, eye: Vec3, at: Vec3) -> bool {
    let mut blocked = [false];
    lit.tracer.any(&[Ray::new(eye, at - eye, 1.0)], &mut blocked, &mut Scratch::default());
    !blocked[0]
}

fn is_in_picture(camera: &Camera, at: Vec3) -> bool {
    let ([right, up, forward], [x, y]) = (camera.frame(), camera.half_extent());
    let d = at - camera.position;
    let depth = d.dot(forward);
    depth > 0.0 && (d.dot(right) / depth).abs() <= x && (d.dot(up) / depth).abs() <= y
}

/// Light of a place towards the camera, 1 being white at the camera's exposure.
fn brightness(lit: &Arc<LitScene>, camera: &Camera, at: Vec3, seed: u64) -> f64 {
    const PASSES: u32 = 64;
    let spot = Camera { name: "spot".into(), target: at, fov_deg: 0.2, width: SPOT, height: SPOT, ..camera.clone() };
    let settings = RenderSettings {
        sides: Sides::Primal,
        rule: scene_rule(&lit.scene),
        seed,
        samples: Some(64),
        orders: false,
        ..RenderSettings::default()
    };
    let mut render = Render::new(Arc::clone(lit), &spot, &settings);
    while render.advance(PASSES) {}
    let image = render.image(View::Combined, None);
    let mean = image.mean.iter().map(|c| f64::from(c.dot(Vec3::new(0.2126, 0.7152, 0.0722)))).sum::<f64>() / image.mean.len().max(1) as f64;
    mean * f64::from(camera.exposure.exp2())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: 10 000 electrons, read noise 0, mottling 1 %: noise √(10 000 + 100²) = 141.4; contrast .1 over 25 pixels: 5 · 1000/141.4.
    #[test]
    fn contrast_to_noise_by_hand() {
        let sensor = Sensor { full: 2e4, read: 0.0, mottling: 0.01 };
        assert!((contrast_to_noise(0.1, 25.0, 1e4, sensor) - 35.355).abs() < 1e-2);
        assert_eq!(contrast_to_noise(0.1, 25.0, 0.0, sensor), 0.0);
    }

    #[test]
    fn a_crack_fills_a_share_of_its_pixels() {
        let crack = Defect { what: String::new(), along: 0.5, side_deg: 0.0, length: 0.4, mark: Mark::Crack(3e-4) };
        assert!((crack.contrast(3e-3) - 0.095).abs() < 1e-12);
        assert!((crack.contrast(1e-4) - 0.95).abs() < 1e-12);
        assert!((crack.pixels(2e-3, 1.0) - 200.0).abs() < 1e-9 && (crack.pixels(1e-4, 1.0) - 12_000.0).abs() < 1e-6);
        let dish = Defect { mark: Mark::Dish(0.04), ..crack };
        assert!((dish.contrast(1e-3) - 0.2).abs() < 1e-12);
    }
}
