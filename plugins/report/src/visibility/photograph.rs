//! What a photograph would reveal of each defect at a surface: its contrast to noise at a given
//! exposure.
//!
//! A crack is darker than the concrete around it by its share of a pixel; a spall by the slope of
//! its dish. Each is a stain ([`StainedLight`]): one run of walks through the pixels that see any
//! of them tells what every defect does to every pixel, δI_p = ∂I_p/∂d of a defect that is there (d
//! = 1), interreflection and half-hidden ones included. What hides them is the shot noise of the
//! light, the noise of reading the sensor and the concrete's own mottling. A matched filter over
//! the pixels sees
//!
//! ```text
//! CNR² = Σ_p δN_p²/(N_p + r² + (m N_p)²)
//! ```
//!
//! with electrons N, read noise r and mottling m; of the square of each δN_p, that of its own
//! standard error is taken off. From 5 on people see it (Rose 1948).

use std::sync::Arc;

use glam::Vec3;
use intrados_light::{Extent, LitScene, Stain, StainedLight, scene_rule};
use intrados_scene::{Camera, Damage, Member, Ray, tracer::Hit, tracer::Scratch};
use intrados_stage::{Cancelled, Job};
use intrados_transport::{Perturbed, Sensitivities};
use serde::Serialize;

use super::SEEN_FROM;

/// Share of the light around it that comes out of a crack.
const OUT_OF_A_CRACK: f64 = 0.05;
/// A crack that is thinner than this share of a pixel stands for a band so wide, of a grey in
/// between: walks must meet it.
const BAND: f64 = 0.25;
/// Walks for all pixels of a camera together, and least and most for one.
const WALKS: u64 = 1 << 20;
const EACH: [u64; 2] = [16, 256];
/// Most pixels that are looked at one by one whether they see a defect.
const LOOKS: usize = 1 << 22;

/// How far a surface may be off where its middle says, m.
const OFF: f32 = 0.01;

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
pub struct PhotographedDefect {
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
    /// Its standard error: the light is a matter of walks.
    pub std_error: f64,
    /// Whether it would be seen.
    pub seen: bool,
}

/// A defect at the surface.
#[derive(Debug, Clone, PartialEq)]
struct Defect {
    what: String,
    along: f32,
    side_deg: f32,
    /// Across a spall, or of the side that a crack runs across, m.
    length: f64,
    mark: Mark,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mark {
    /// Opening and depth, m.
    Crack { width: f64, depth: f64 },
    /// Depth, m.
    Dish(f64),
}

/// A defect where it is.
struct Found {
    member: usize,
    defect: Defect,
    distance: f64,
    /// m.
    pixel: f64,
    stain: Stain,
    /// Which pixels see it, or may.
    pixels: Vec<u32>,
}

/// Every planted crack and spall of a scene in one of its cameras.
///
/// # Errors
/// The job was cancelled.
pub(crate) fn photograph(
    lit: &Arc<LitScene>,
    camera: &Camera,
    sensor: Sensor,
    seed: u64,
    job: &Job,
) -> Result<Vec<PhotographedDefect>, Cancelled> {
    let scene = &lit.scene;
    let all = scene
        .members
        .iter()
        .enumerate()
        .flat_map(|(i, m)| m.truth.iter().filter_map(|d| defect(m, d)).map(move |d| (i, d)));
    let found: Vec<Found> =
        all.filter_map(|(member, defect)| find(lit, camera, member, defect)).collect();
    let mut pixels: Vec<u32> = found.iter().flat_map(|f| f.pixels.iter().copied()).collect();
    pixels.sort_unstable();
    pixels.dedup();
    let stains: Vec<Stain> = found.iter().map(|f| f.stain.clone()).collect();
    let mut told = Sensitivities::exact(Vec::new(), Vec::new());
    if !pixels.is_empty() {
        let walks = (WALKS / pixels.len() as u64).clamp(EACH[0], EACH[1]);
        let sensors = vec![intrados_light::Sensor::Camera(camera.clone())];
        let mut light = StainedLight::new(lit, sensors, stains, walks, seed);
        (light.pixels, light.rule, light.job) =
            (Some(pixels.clone()), scene_rule(scene), job.clone());
        told = light.sensitivities(&vec![0.0; found.len()])?;
    }
    let electrons = sensor.full * f64::from(camera.exposure.exp2());
    let one = |(k, f): (usize, &Found)| {
        let rows: Vec<usize> =
            f.pixels.iter().filter_map(|p| pixels.binary_search(p).ok()).collect();
        judge(f, camera, &scene.members[f.member].id, seen(&told, &rows, k, electrons, sensor))
    };
    Ok(found.iter().enumerate().map(one).collect())
}

/// Contrast to noise with its standard error, and the contrast, of damage `k` in the readings
/// `rows`, of which 1 is so many electrons.
fn seen(
    told: &Sensitivities,
    rows: &[usize],
    k: usize,
    electrons: f64,
    sensor: Sensor,
) -> [f64; 3] {
    let [mut square, mut variance, mut darker, mut bright] = [0.0; 4];
    for &row in rows {
        // A pixel is full where it is white.
        let light = told.readings[row].max(0.0);
        let scale = electrons / (light * electrons / sensor.full).max(1.0);
        let (n, d, e) =
            (light * scale, told.by_damage[row][k] * scale, told.errors[row][k] * scale);
        let noise = n + sensor.read.powi(2) + (sensor.mottling * n).powi(2);
        if noise > 0.0 {
            square += (d * d - e * e) / noise;
            variance += (4.0 * d * d * e * e + 2.0 * e.powi(4)) / (noise * noise);
            darker += d * d - e * e;
            bright += d.abs() * n;
        }
    }
    let ratio = square.max(0.0).sqrt();
    let error = if ratio > 0.0 { variance.sqrt() / (2.0 * ratio) } else { variance.sqrt().sqrt() };
    [ratio, error, if bright > 0.0 { (darker / bright).max(0.0) } else { 0.0 }]
}

fn judge(
    found: &Found,
    camera: &Camera,
    member: &str,
    [ratio, error, contrast]: [f64; 3],
) -> PhotographedDefect {
    let in_view = !found.pixels.is_empty();
    PhotographedDefect {
        member: member.to_owned(),
        defect: found.defect.what.clone(),
        camera: camera.name.clone(),
        in_view,
        distance_m: found.distance,
        pixel_mm: 1e3 * found.pixel,
        contrast,
        contrast_to_noise: ratio,
        std_error: error,
        seen: in_view && ratio >= SEEN_FROM,
    }
}

fn defect(member: &Member, damage: &Damage) -> Option<Defect> {
    let side = (member.volume / f64::from(member.frame.axis.length()).max(1e-6)).sqrt();
    match *damage {
        Damage::Crack { along, width_mm, depth, angle_deg } => Some(Defect {
            what: format!("crack {width_mm} mm wide at {:.0} % of the axis", 100.0 * along),
            along,
            side_deg: angle_deg,
            length: side,
            mark: Mark::Crack { width: 1e-3 * f64::from(width_mm), depth: side * f64::from(depth) },
        }),
        Damage::Spall { along, angle_deg, diameter_m, depth_m } => Some(Defect {
            what: format!(
                "spall {:.0} mm wide at {:.0} % of the axis",
                1e3 * diameter_m,
                100.0 * along
            ),
            along,
            side_deg: angle_deg,
            length: f64::from(diameter_m),
            mark: Mark::Dish(f64::from(depth_m)),
        }),
        _ => None,
    }
}

/// Where a defect is on its member's surface: what a ray meets that comes towards the axis, from
/// outside or, of a hollow member, from its axis.
fn place(lit: &LitScene, member: &Member, defect: &Defect) -> Option<(Vec3, Vec3)> {
    let (axis, radial) = (member.frame.point(defect.along), member.frame.radial(defect.side_deg));
    let reach = (member.bounds[1] - member.bounds[0]).length();
    let meet = |origin: Vec3, way: Vec3| {
        let mut hits = [Hit::MISS];
        lit.tracer.closest(&[Ray::new(origin, way, reach)], &mut hits, &mut Scratch::default());
        hits[0].is_hit().then(|| origin + way * hits[0].t)
    };
    let within =
        |p: &Vec3| (p.cmpge(member.bounds[0] - 0.01) & p.cmple(member.bounds[1] + 0.01)).all();
    let hollow = matches!(
        member.kind,
        intrados_scene::MemberKind::Lining | intrados_scene::MemberKind::Segment
    );
    if hollow {
        return meet(axis, radial).filter(within).map(|p| (p, -radial));
    }
    // From inside the concrete the surface is met from behind.
    meet(axis, radial).filter(within).map(|p| (p, radial))
}

/// Where a defect is, as a stain, and which pixels see it; `None` where its member has no surface
/// there.
fn find(lit: &LitScene, camera: &Camera, member: usize, defect: Defect) -> Option<Found> {
    let (at, outward) = place(lit, &lit.scene.members[member], &defect)?;
    let distance = f64::from((camera.position - at).length());
    let pixel =
        2.0 * f64::from(camera.half_extent()[0]) / f64::from(camera.width.max(1)) * distance;
    let axis = lit.scene.members[member].frame.axis.normalize_or_zero();
    let objects: Vec<usize> = (0..lit.scene.objects.len())
        .filter(|&i| lit.scene.objects[i].member == Some(member))
        .collect();
    let stain = |grown: f32| Stain {
        objects: objects.clone(),
        extent: defect.extent(at, outward, axis, pixel, grown),
        share: defect.share(pixel),
    };
    let pixels = pixels(lit, camera, &stain(1.5 * pixel as f32));
    Some(Found { member, distance, pixel, stain: stain(0.0), pixels, defect })
}

/// The pixels whose middle sees a stain.
fn pixels(lit: &LitScene, camera: &Camera, stain: &Stain) -> Vec<u32> {
    let (centre, reach) = match stain.extent {
        Extent::All => return Vec::new(),
        Extent::Ball { centre, radius } => (centre, radius),
        Extent::Block { centre, half } => {
            (centre, half.iter().map(|h| h.length_squared()).sum::<f32>().sqrt())
        }
    };
    let [columns, rows] = window(camera, centre, reach);
    if columns.len() * rows.len() > LOOKS {
        return Vec::new();
    }
    let bins = rows.flat_map(|y| columns.clone().map(move |x| y * camera.width + x));
    let way = |bin: u32| {
        camera.direction((bin % camera.width) as f32 + 0.5, (bin / camera.width) as f32 + 0.5)
    };
    let (bins, rays): (Vec<u32>, Vec<Ray>) =
        bins.map(|bin| (bin, Ray::new(camera.position, way(bin), f32::INFINITY))).unzip();
    let mut hits = vec![Hit::MISS; rays.len()];
    lit.tracer.closest(&rays, &mut hits, &mut Scratch::default());
    let sees = |(ray, hit): (&Ray, &Hit)| {
        let at = camera.position + hit.t * Vec3::from(ray.direction);
        hit.is_hit()
            && stain.extent.contains(at)
            && stain
                .objects
                .iter()
                .any(|&o| std::ptr::eq(&raw const lit.scene.objects[o], lit.object(hit.triangle)))
    };
    let seen = rays.iter().zip(&hits).map(sees);
    bins.into_iter().zip(seen).filter_map(|(bin, sees)| sees.then_some(bin)).collect()
}

/// Columns and rows of a picture where a ball may be seen; all of them where it reaches behind the
/// camera, or where a lens bends the picture.
fn window(camera: &Camera, centre: Vec3, reach: f32) -> [std::ops::Range<u32>; 2] {
    let ([right, up, forward], half) = (camera.frame(), camera.half_extent());
    let d = centre - camera.position;
    let depth = d.dot(forward);
    if depth + reach <= 0.0 {
        return [0..0, 0..0];
    }
    if camera.lens.is_some() {
        return [0..camera.width, 0..camera.height];
    }
    let range = |along: f32, half: f32, pixels: u32| {
        if depth <= 1.5 * reach {
            return 0..pixels;
        }
        // A point of the ball is at least depth − reach away along the axis.
        let ends =
            [along - reach, along + reach].map(|x| (x / (depth - reach)).max(x / (depth + reach)));
        let low = ((along - reach) / (depth - reach)).min((along - reach) / (depth + reach));
        let at =
            |slope: f32| ((slope / half + 1.0) * 0.5 * pixels as f32).clamp(0.0, pixels as f32);
        at(low).floor() as u32..at(ends[1]).ceil() as u32
    };
    [range(d.dot(right), half[0], camera.width), range(-d.dot(up), half[1], camera.height)]
}

impl Defect {
    /// By how much the surface within [`Self::extent`] is darker; `pixel` in metres.
    fn share(&self, pixel: f64) -> f64 {
        match self.mark {
            Mark::Crack { width, .. } => (1.0 - OUT_OF_A_CRACK) * width / width.max(BAND * pixel),
            // The mean slope of a parabolic dish.
            Mark::Dish(depth) => (2.0 * depth / self.length.max(1e-9)).min(1.0),
        }
    }

    /// Where it is, larger by `grown` (m) to every side: a crack runs across the side that it
    /// starts from and as far round the others as it is deep.
    fn extent(&self, at: Vec3, outward: Vec3, axis: Vec3, pixel: f64, grown: f32) -> Extent {
        match self.mark {
            Mark::Dish(_) => Extent::Ball { centre: at, radius: 0.5 * self.length as f32 + grown },
            Mark::Crack { width, depth } => {
                let (band, side, deep) =
                    (0.5 * width.max(BAND * pixel) as f32, self.length as f32, depth as f32);
                let across = axis.cross(outward).normalize_or_zero();
                let half = [
                    axis * (band + grown),
                    across * (0.55 * side + grown),
                    outward * (0.5 * deep + OFF + grown),
                ];
                Extent::Block { centre: at - 0.5 * deep * outward, half }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: two pixels of 10 000 electrons, read noise 0, mottling 1 %: noise √(10 000 + 100²)
    /// = 141.4 each; 1000 darker: √2 · 1000/141.4 = 10; with a standard error of 600 the true
    /// square is 1000² − 600².
    #[test]
    fn contrast_to_noise_by_hand() {
        let sensor = Sensor { full: 2e4, read: 0.0, mottling: 0.01 };
        let mut told = Sensitivities::exact(vec![0.5; 2], vec![vec![-0.05]; 2]);
        let [ratio, error, contrast] = seen(&told, &[0, 1], 0, 2e4, sensor);
        assert!(
            (ratio - 10.0).abs() < 1e-9 && error == 0.0 && (contrast - 0.1).abs() < 1e-12,
            "{ratio} {error} {contrast}"
        );
        told.errors = vec![vec![0.03]; 2];
        let [ratio, error, _] = seen(&told, &[0, 1], 0, 2e4, sensor);
        assert!((ratio - 8.0).abs() < 1e-9 && error > 0.0, "{ratio} {error}");
        assert_eq!(seen(&told, &[], 0, 2e4, sensor)[0], 0.0);
    }

    #[test]
    fn a_crack_fills_a_share_of_its_band() {
        let crack = Defect {
            what: String::new(),
            along: 0.5,
            side_deg: 0.0,
            length: 0.4,
            mark: Mark::Crack { width: 3e-4, depth: 0.1 },
        };
        assert!(
            (crack.share(3e-3) - 0.95 * 0.4).abs() < 1e-12
                && (crack.share(1e-4) - 0.95).abs() < 1e-12
        );
        let extent = crack.extent(Vec3::X, Vec3::X, Vec3::Y, 4e-3, 0.0);
        for (p, is_in) in [
            ([1.0, 4e-4, 0.2], true),
            ([1.0, 6e-4, 0.2], false),
            ([0.92, 0.0, -0.2], true),
            ([0.88, 0.0, -0.2], false),
        ] {
            assert_eq!(extent.contains(p.into()), is_in, "{p:?}");
        }
        let dish = Defect { mark: Mark::Dish(0.04), ..crack };
        assert!((dish.share(1e-3) - 0.2).abs() < 1e-12);
    }

    /// The column's planted spall and crack, from the camera that was put there for them: both are
    /// seen, and what a first guess says of the spall, its slope times √n in front of the mottling,
    /// is within a factor of two. From behind, nothing is.
    #[test]
    fn the_foot_of_c4_is_seen() {
        let scene = intrados_scene::Scene::load_bundled("column", &Job::default()).unwrap();
        let camera = scene.cameras.iter().find(|c| c.name == "C4 foot").unwrap().clone();
        let lit = Arc::new(LitScene::build(Arc::new(scene), &Job::default()).unwrap());
        let told = photograph(&lit, &camera, Sensor::default(), 1, &Job::default()).unwrap();
        let of = |what: &str| {
            told.iter().find(|s| s.member == "C4" && s.defect.starts_with(what)).unwrap()
        };
        let (spall, crack) = (of("spall"), of("crack"));
        assert!(
            spall.seen && crack.seen && spall.std_error < 0.05 * spall.contrast_to_noise,
            "{told:#?}"
        );
        let pixels = 0.25 * std::f64::consts::PI * (300.0 / spall.pixel_mm).powi(2);
        let guess = 0.23 * pixels.sqrt() / 0.03;
        assert!(
            spall.contrast_to_noise < guess && spall.contrast_to_noise > 0.4 * guess,
            "{} {guess}",
            spall.contrast_to_noise
        );
        let behind = Camera {
            position: Vec3::new(0.5, 1.0, -1.7),
            target: Vec3::new(1.7, 0.5, -1.7),
            ..camera
        };
        let told = photograph(&lit, &behind, Sensor::default(), 1, &Job::default()).unwrap();
        assert!(
            told.iter()
                .filter(|s| s.member == "C4" && s.defect.starts_with("spall"))
                .all(|s| !s.in_view && !s.seen),
            "{told:#?}"
        );
    }
}
