//! Pictures of made-up concrete with labels: what a network learns from.
//!
//! Everything is drawn from a key: the finish and what weather and people left on it, cracks with
//! their widths, missing cover, stains, things that only look like damage (cables, rails, edges,
//! shadows, lettering), the light, the camera. [`Patch::render`] walks in that scene as in any
//! other; labels come from rays through the same camera and the same tracer.

mod course;
mod scenery;

use std::sync::Arc;

use glam::{Vec2, Vec3, vec2};
use intrados_scene::{Camera, Hit, Ray, tracer::Scratch};
use intrados_stage::{
    Cancelled, Job,
    random::{Draw, Key},
};
use intrados_transport::WalkRule;

use crate::{LitScene, Render, RenderSettings, Sides, View, luminance};

/// Label rays along a pixel's side.
const FINE: u32 = 3;
/// Longest path of light: lamp, two bounces, camera.
pub const ORDERS: u32 = 4;
/// Longest path of direct light: lamp, surface, camera.
pub const DIRECT: u32 = 2;
/// No light at all: the colours of things, and cracks as strokes of one darkness, as they are pasted
/// on pictures of textures.
pub const PASTED: u32 = 0;
/// What is left of a face's colour where a crack is pasted on it, least and most.
const STROKE: [f64; 2] = [0.1, 0.6];

/// A square picture of a made-up face and what is to be seen in it.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Pixels along a side.
    pub size: u32,
    /// Length of a pixel on the face at the middle of the picture, m.
    pub pixel: f32,
    /// Radiance, row-major from the top left, scaled so that a tenth of all pixels is above 1.
    pub radiance: Vec<Vec3>,
    /// What covers each pixel, row-major from the top left.
    pub labels: Vec<Label>,
    /// The middle lines of all cracks, also where they are narrower than a pixel.
    pub courses: Vec<Vec<CoursePoint>>,
}

/// Shares of a pixel, each in [0, 1].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Label {
    /// Mouths of cracks and their chipped lips.
    pub crack: f32,
    /// Missing cover, bared steel included.
    pub spall: f32,
    /// Bared steel.
    pub steel: f32,
    /// Rust on the face.
    pub rust: f32,
    /// Efflorescence on the face.
    pub efflorescence: f32,
}

/// A point of a crack in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoursePoint {
    /// Pixels from the top left.
    pub at: Vec2,
    /// Opening on the face, m.
    pub width: f32,
    /// Whether nothing stands before it.
    pub visible: bool,
}

impl Patch {
    /// The patch of `key`, `size` pixels along a side, from `samples` walks a pixel, in light of at
    /// most so many `orders` ([`ORDERS`], [`DIRECT`], [`PASTED`]). The same bits for any number of threads.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the job was.
    pub fn render(
        key: Key,
        size: u32,
        samples: u64,
        orders: u32,
        job: &Job,
    ) -> Result<Self, Cancelled> {
        let scenery::Drawn { scene, camera, pixel, courses } = scenery::draw(key, size);
        let lit = Arc::new(LitScene::build(Arc::new(scene), job)?);
        let labels = labels(&lit, &camera);
        let courses = courses.iter().map(|line| seen(&lit, &camera, line)).collect();
        let mut radiance = match orders {
            PASTED => {
                let [least, most] = STROKE;
                let stroke = Draw::new(key.split(9, 0)).log_between(least, most);
                pasted(&lit, &camera, stroke as f32)
            }
            _ => walked(&lit, &camera, key, samples, orders, job)?,
        };
        expose(&mut radiance);
        Ok(Self { size, pixel, radiance, labels, courses })
    }
}

/// Radiance by walks in light of at most so many `orders`.
fn walked(
    lit: &Arc<LitScene>,
    camera: &Camera,
    key: Key,
    samples: u64,
    orders: u32,
    job: &Job,
) -> Result<Vec<Vec3>, Cancelled> {
    let settings = RenderSettings {
        sides: Sides::Primal,
        rule: WalkRule {
            max_order: orders,
            alike: u64::from(camera.width) * u64::from(camera.height),
            ..WalkRule::default()
        },
        seed: u64::from(key.0) << 32 | u64::from(key.1),
        samples: Some(samples),
        orders: false,
        ..RenderSettings::default()
    };
    let mut render = Render::new(Arc::clone(lit), camera, &settings);
    while render.advance(16) {
        job.step(0, 1)?;
    }
    Ok(render.image(View::Primal, None).mean)
}

/// The colours of things, a crack as `stroke` of its own.
fn pasted(lit: &LitScene, camera: &Camera, stroke: f32) -> Vec<Vec3> {
    let colour = |hit: &Hit, ray: &Ray| {
        if !hit.is_hit() {
            return Vec3::ONE;
        }
        let own = lit.scene.materials[lit.object(hit.triangle).material].base_colour;
        let seen = lit.appearance(hit.triangle, ray_end(ray, hit)).map_or(own, |a| a.colour);
        match What::of(&lit.object(hit.triangle).name) {
            What::Crack => stroke * seen,
            _ => seen,
        }
    };
    by_pixel(lit, camera, |hits, rays| {
        let sum: Vec3 = hits.iter().zip(rays).map(|(hit, ray)| colour(hit, ray)).sum();
        sum / hits.len() as f32
    })
}

fn ray_end(ray: &Ray, hit: &Hit) -> Vec3 {
    Vec3::from(ray.origin) + hit.t * Vec3::from(ray.direction)
}

/// Of each pixel, row-major from the top left, what [`FINE`]² rays through it tell.
fn by_pixel<T>(
    lit: &LitScene,
    camera: &Camera,
    mut tell: impl FnMut(&[Hit], &[Ray]) -> T,
) -> Vec<T> {
    let mut scratch = Scratch::default();
    let mut pixels = Vec::with_capacity((camera.width * camera.height) as usize);
    for y in 0..camera.height {
        let offset = |k: u32| (k as f32 + 0.5) / FINE as f32;
        let rays: Vec<Ray> = (0..camera.width)
            .flat_map(|x| {
                (0..FINE * FINE).map(move |k| {
                    let (x, y) = (x as f32 + offset(k % FINE), y as f32 + offset(k / FINE));
                    Ray::new(camera.position, camera.direction(x, y), f32::INFINITY)
                })
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        lit.tracer.closest(&rays, &mut hits, &mut scratch);
        let pixel = (FINE * FINE) as usize;
        pixels.extend(hits.chunks(pixel).zip(rays.chunks(pixel)).map(|(h, r)| tell(h, r)));
    }
    pixels
}

/// As a camera's automatic exposure does: a tenth of the pixels becomes brighter than 1.
fn expose(radiance: &mut [Vec3]) {
    let mut sorted: Vec<f32> = radiance.iter().map(|&c| luminance(c)).collect();
    sorted.sort_by(f32::total_cmp);
    let bright = sorted.get(sorted.len() * 9 / 10).copied().unwrap_or(0.0);
    if bright > 0.0 {
        radiance.iter_mut().for_each(|c| *c /= bright);
    }
}

/// What an object is, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Crack,
    Spall,
    Steel,
    Else,
}

impl What {
    fn of(name: &str) -> Self {
        match name {
            _ if name.starts_with("cracks of") => Self::Crack,
            _ if name.starts_with("missing cover of") => Self::Spall,
            _ if name.starts_with("bared steel of") => Self::Steel,
            _ => Self::Else,
        }
    }
}

fn labels(lit: &LitScene, camera: &Camera) -> Vec<Label> {
    let what: Vec<What> = lit.scene.objects.iter().map(|o| What::of(&o.name)).collect();
    let stained =
        lit.scene.materials.iter().any(|m| m.finish.as_ref().is_some_and(|f| f.is_stained()));
    by_pixel(lit, camera, |hits, rays| {
        let share = |wanted: &[What]| {
            let of = |hit: &&Hit| {
                hit.is_hit() && wanted.contains(&what[lit.object_index(hit.triangle) as usize])
            };
            hits.iter().filter(of).count() as f32 / hits.len() as f32
        };
        let mut label = Label {
            crack: share(&[What::Crack]),
            spall: share(&[What::Spall, What::Steel]),
            steel: share(&[What::Steel]),
            ..Label::default()
        };
        let (hit, ray) = (hits[hits.len() / 2], rays[rays.len() / 2]);
        if stained
            && hit.is_hit()
            && let Some(face) = lit.appearance(hit.triangle, ray_end(&ray, &hit))
        {
            (label.rust, label.efflorescence) = (face.rust, face.efflorescence);
        }
        label
    })
}

/// A line on the face as the camera sees it.
fn seen(lit: &LitScene, camera: &Camera, line: &[(Vec3, f32)]) -> Vec<CoursePoint> {
    let [right, up, forward] = camera.frame();
    let [hx, hy] = camera.half_extent();
    let rays: Vec<Ray> =
        line.iter().map(|&(p, _)| Ray::new(camera.position, p - camera.position, 0.998)).collect();
    let mut hidden = vec![false; rays.len()];
    lit.tracer.any(&rays, &mut hidden, &mut Scratch::default());
    let project = |p: Vec3| {
        let to = p - camera.position;
        let (x, y) = (to.dot(right) / (to.dot(forward) * hx), to.dot(up) / (to.dot(forward) * hy));
        0.5 * vec2((x + 1.0) * camera.width as f32, (1.0 - y) * camera.height as f32)
    };
    line.iter()
        .zip(hidden)
        .map(|(&(p, width), hidden)| CoursePoint { at: project(p), width, visible: !hidden })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn patch(seed: u64) -> Patch {
        Patch::render(Key::new(seed, 0), 64, 2, ORDERS, &Job::default()).unwrap()
    }

    #[test]
    fn a_patch_is_a_function_of_its_key() {
        let (a, again, b) = (patch(3), patch(3), patch(4));
        assert_eq!(a.radiance, again.radiance);
        assert_eq!(a.labels, again.labels);
        assert_ne!(a.radiance, b.radiance);
    }

    /// What is pasted is lit by nothing, and has the same labels.
    #[test]
    fn pasted_patches_have_the_labels_of_lit_ones() {
        let pasted = Patch::render(Key::new(3, 0), 64, 2, PASTED, &Job::default()).unwrap();
        let lit = patch(3);
        assert_eq!(pasted.labels, lit.labels);
        assert_ne!(pasted.radiance, lit.radiance);
        assert!(pasted.radiance.iter().all(|c| c.is_finite() && c.min_element() >= 0.0));
    }

    /// Where a label says crack, a course passes: half the crack's width, its unevenness, and a
    /// chipped lip away.
    #[test]
    fn labels_lie_on_courses_and_wide_courses_have_labels() {
        let (mut labelled, mut passed) = (0, 0);
        for seed in 0..40 {
            let patch = patch(seed);
            assert!(patch.radiance.iter().all(|c| c.is_finite() && c.min_element() >= 0.0));
            let points = || patch.courses.iter().flatten();
            for (i, label) in patch.labels.iter().enumerate().filter(|(_, l)| l.crack > 0.3) {
                let at = vec2(i as f32 % 64.0 + 0.5, (i as f32 / 64.0).floor() + 0.5);
                let off = |p: &CoursePoint| p.at.distance(at) - 2.5 * p.width / patch.pixel;
                let nearest = points().map(off).fold(f32::INFINITY, f32::min);
                let slack = 3.0 + 8e-3 / patch.pixel;
                assert!(nearest < slack, "seed {seed}: {nearest} px off, {label:?}");
                labelled += 1;
            }
            let wide = |p: &&CoursePoint| {
                p.visible
                    && p.width > 2.0 * patch.pixel
                    && p.at.min_element() > 1.0
                    && p.at.max_element() < 63.0
            };
            for p in points().filter(wide) {
                let near = |x: i32, y: i32| {
                    let at = [p.at.x as i32 + x, p.at.y as i32 + y];
                    patch
                        .labels
                        .get((at[1] * 64 + at[0]) as usize)
                        .is_some_and(|l| l.crack + l.spall > 0.0)
                };
                assert!((-1..=1).any(|x| (-1..=1).any(|y| near(x, y))), "seed {seed}: {p:?}");
                passed += 1;
            }
        }
        assert!(labelled > 100 && passed > 20, "{labelled} {passed}");
    }
}
