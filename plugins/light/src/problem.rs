//! Light as an instance of the transport problem: K = f_r cosθ in directions (eq. 2.6), σ = L_e, g = W_e (eq. 2.4).
//!
//! The primal walk starts at a sensor and carries radiance, the dual walk starts at a lamp and carries importance-weighted flux (eq.
//! 2.13–2.15). Both stand on the same points, use the same BSDFs and are linked by the same segments.

use std::{
    f32::consts::{FRAC_1_PI, PI},
    ops::Range,
};

use glam::Vec3;
use intrados_scene::{
    Hit, Ray,
    tracer::{Scratch, offset},
};
use intrados_stage::random::Key;
use intrados_transport::{Ends, Links, Problem, Side, States, Steps, dimension, keep};

use crate::{
    Rgb, Sensor,
    bsdf::{Bsdf, Frame, shading_correction, warp},
    emit::Emitter,
    lit::{LitScene, Point, Source},
    sensor::{Device, Patch},
};

/// The transport problem of one lit scene and some sensors. Primal walks start at the first sensor, dual walks look for all.
#[derive(Debug)]
pub struct LightProblem<'a> {
    lit: &'a LitScene,
    devices: Vec<Device>,
    /// First bin of each sensor, and the number of all bins.
    first_bin: Vec<u32>,
    pixels: u64,
}

impl<'a> LightProblem<'a> {
    /// The problem of `sensors` in `lit`.
    #[must_use]
    pub fn new(lit: &'a LitScene, sensors: &[Sensor]) -> Self {
        let mut first_bin = vec![0];
        for sensor in sensors {
            first_bin.push(first_bin[first_bin.len() - 1] + sensor.bins() as u32);
        }
        let pixels = sensors.first().map_or(1, |s| s.bins() as u64);
        Self { lit, devices: sensors.iter().map(Device::from).collect(), first_bin, pixels }
    }

    /// Which sensor a bin belongs to, and which bin of that sensor it is.
    #[must_use]
    pub fn sensor_of(&self, bin: u32) -> (usize, u32) {
        let sensor = self.first_bin.partition_point(|&first| first <= bin) - 1;
        (sensor, bin - self.first_bin[sensor])
    }
}

/// What stands at an event.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// The pinhole.
    Eye,
    /// A lamp that is no surface.
    Beam(u32),
    /// A surface, a meter's patch or a shining one: anything with a BSDF.
    Surface,
    /// Beyond the scene.
    Sky,
}

/// What links from the event before found of the place where a walk arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Linked {
    /// Nothing: a delta, the pinhole, light from beyond.
    Never,
    /// The same places, with a density.
    Also,
    /// All of it: what is found by arriving must not count again.
    Wholly,
}

impl Linked {
    /// The link's density for the weight of an arrival, where `density` would be that of [`Linked::Also`].
    fn density(self, density: f32) -> f32 {
        match self {
            Self::Never => 0.0,
            Self::Also => density,
            Self::Wholly => f32::INFINITY,
        }
    }
}

/// Columns of light walks.
#[derive(Debug, Default)]
pub struct LightStates {
    /// The flight that led here; at event 0 the one that leads away.
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    points: Vec<Point>,
    kinds: Vec<Kind>,
    /// Toward the event before, unit.
    back: Vec<Vec3>,
    /// Barycentrics on the triangle.
    at: Vec<[f32; 2]>,
    /// Density per sr of the direction that led here; infinite for a delta.
    density: Vec<f32>,
    /// What a link from the event before could have done.
    linked: Vec<Linked>,
    /// Pixel (primal).
    bins: Vec<u32>,
    /// Weight of the start (dual, beams).
    flux: Vec<Vec3>,
    /// Segments to look along, and whose they are.
    shadows: Vec<Ray>,
    shadow_rows: Vec<u32>,
    blocked: Vec<bool>,
    scratch: Scratch,
}

impl States for LightStates {
    fn gather(&mut self, rows: &[u32]) {
        keep(&mut self.rays, rows);
        keep(&mut self.hits, rows);
        keep(&mut self.points, rows);
        keep(&mut self.kinds, rows);
        keep(&mut self.back, rows);
        keep(&mut self.at, rows);
        keep(&mut self.density, rows);
        keep(&mut self.linked, rows);
        keep(&mut self.bins, rows);
        keep(&mut self.flux, rows);
    }
}

const NOWHERE: Ray = Ray { origin: [0.0; 3], t_max: 0.0, direction: [0.0, 0.0, 1.0], tag: 0 };

impl LightStates {
    fn reset(&mut self, n: usize) {
        fn fill<T: Clone>(column: &mut Vec<T>, n: usize, value: T) {
            column.clear();
            column.resize(n, value);
        }
        let nothing =
            Point { position: Vec3::ZERO, error: Vec3::ZERO, geometric: Vec3::Y, shading: Vec3::Y, bsdf: Bsdf::Black, triangle: Hit::NONE };
        fill(&mut self.rays, n, NOWHERE);
        fill(&mut self.hits, n, Hit { t: f32::INFINITY, triangle: Hit::NONE });
        fill(&mut self.points, n, nothing);
        fill(&mut self.kinds, n, Kind::Sky);
        fill(&mut self.back, n, Vec3::Y);
        fill(&mut self.at, n, [0.0; 2]);
        fill(&mut self.density, n, f32::INFINITY);
        fill(&mut self.linked, n, Linked::Never);
        fill(&mut self.bins, n, 0);
        fill(&mut self.flux, n, Vec3::ZERO);
    }

    fn len(&self) -> usize {
        self.rays.len()
    }

    /// A start on a flat thing that sends light by Lambert's law: `albedo` = π × what it sends per sr and cosine.
    fn start_flat(&mut self, i: usize, position: Vec3, normal: Vec3, albedo: Vec3) {
        let bsdf = Bsdf::Lambert { albedo };
        let error = rounding(position);
        self.points[i] = Point { position, error, geometric: normal, shading: normal, bsdf, triangle: Hit::NONE };
        self.back[i] = normal;
        self.kinds[i] = Kind::Surface;
    }

    fn begin_links(&mut self) {
        self.shadows.clear();
        self.shadow_rows.clear();
    }

    fn look(&mut self, row: usize, ray: Ray) {
        self.shadows.push(ray);
        self.shadow_rows.push(row as u32);
    }
}

/// f·cosθ toward `wi`, as the walk of `side` uses it, and the density with which it would go there. 0 where shading and true normal disagree.
#[inline]
fn toward(point: &Point, back: Vec3, wi: Vec3, side: Side) -> (Vec3, f32) {
    if let (Bsdf::Lambert { albedo }, true) = (point.bsdf, point.shading == point.geometric) {
        // Most of the world: no frame needed.
        let (out, cos) = (back.dot(point.geometric), wi.dot(point.geometric));
        let pdf = if out * cos > 0.0 { cos.abs() * FRAC_1_PI } else { 0.0 };
        return (albedo * pdf, pdf);
    }
    let frame = Frame::new(point.shading);
    let (f, pdf) = point.bsdf.eval_pdf(frame.to_local(back), frame.to_local(wi), side);
    if point.shading == point.geometric {
        return (f, pdf);
    }
    (f * bent(point, back, wi, side), pdf)
}

/// The factor of a bent normal: 0 where it contradicts the true one, and for the dual Veach's correction.
fn bent(point: &Point, back: Vec3, wi: Vec3, side: Side) -> f32 {
    let correction = shading_correction(back, wi, point.shading, point.geometric);
    match side {
        Side::Dual => correction,
        Side::Primal if correction > 0.0 => 1.0,
        Side::Primal => 0.0,
    }
}

/// Rounding error of coordinates that were computed in a few steps, per axis.
#[inline]
fn rounding(p: Vec3) -> Vec3 {
    p.abs() * (4.0 * f32::EPSILON)
}

/// A ray from a point on a surface to infinity.
#[inline]
fn outward(point: &Point, direction: Vec3) -> Ray {
    let origin = offset::offset_origin(point.position, point.error, point.geometric, direction);
    Ray { origin: origin.into(), t_max: f32::INFINITY, direction: direction.into(), tag: 0 }
}

impl Problem for LightProblem<'_> {
    type Value = Rgb;
    type States = LightStates;

    fn channels(&self, side: Side) -> usize {
        match side {
            Side::Primal => 1,
            Side::Dual => self.devices.len(),
        }
    }

    fn bins(&self) -> usize {
        self.first_bin[self.devices.len()] as usize
    }

    fn start(&self, side: Side, walks: Range<u64>, keys: &[Key], states: &mut LightStates) {
        states.reset(keys.len());
        match side {
            Side::Primal => self.start_at_sensor(walks, keys, states),
            Side::Dual => self.start_at_lamp(keys, states),
        }
    }

    fn arrive(&self, side: Side, channel: usize, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
        match side {
            Side::Primal => self.arrive_at_lamp(states, ends),
            Side::Dual => match &self.devices[channel] {
                Device::Pinhole(_) => false,
                Device::Patch(patch) => arrive_at_patch(patch, self.first_bin[channel], states, ends),
            },
        }
    }

    fn link(&self, side: Side, channel: usize, event: u32, keys: &[Key], states: &mut LightStates, links: &mut Links<Rgb>) -> bool {
        states.begin_links();
        let dimension = dimension(event, 8 + 4 * channel as u32);
        match side {
            Side::Primal => self.link_to_lamp(dimension, keys, states, links),
            Side::Dual => self.link_to_sensor(channel, dimension, keys, states, links),
        }
        !states.shadows.is_empty()
    }

    fn reveal(&self, _: Side, states: &mut LightStates, links: &mut Links<Rgb>) {
        states.blocked.clear();
        states.blocked.resize(states.shadows.len(), false);
        self.lit.tracer.any(&states.shadows, &mut states.blocked, &mut states.scratch);
        for (&row, &blocked) in states.shadow_rows.iter().zip(&states.blocked) {
            if blocked {
                links.value[row as usize] = Rgb::ZERO;
            }
        }
    }

    fn scatter(&self, side: Side, event: u32, keys: &[Key], states: &mut LightStates, steps: &mut Steps<Rgb>) {
        for (i, key) in keys.iter().enumerate() {
            match states.kinds[i] {
                Kind::Surface => self.scatter_surface(side, event, i, *key, states, steps),
                // The way was drawn at the start.
                Kind::Eye => steps.factor[i] = Rgb(glam::Vec3A::ONE),
                Kind::Beam(_) => steps.factor[i] = states.flux[i].into(),
                Kind::Sky => {}
            }
        }
    }

    fn fly(&self, _: Side, states: &mut LightStates) {
        let LightStates { rays, hits, scratch, points, kinds, back, at, .. } = states;
        self.lit.tracer.closest(rays, hits, scratch);
        for (i, (ray, hit)) in rays.iter().zip(hits.iter()).enumerate() {
            back[i] = -Vec3::from(ray.direction);
            if hit.triangle == Hit::NONE {
                kinds[i] = Kind::Sky;
            } else {
                kinds[i] = Kind::Surface;
                (points[i], at[i]) = self.lit.point(ray, hit.triangle);
            }
        }
    }
}

impl LightProblem<'_> {
    fn start_at_sensor(&self, walks: Range<u64>, keys: &[Key], states: &mut LightStates) {
        for (i, (walk, key)) in walks.zip(keys).enumerate() {
            match &self.devices[0] {
                Device::Pinhole(eye) => {
                    // Walks go through the picture in order, so that every pixel gets the same share.
                    let bin = (walk % self.pixels) as u32;
                    let direction = eye.direction(bin, key.pair(dimension(0, 0)));
                    states.bins[i] = bin;
                    states.kinds[i] = Kind::Eye;
                    states.rays[i] = Ray { origin: eye.position.into(), t_max: f32::INFINITY, direction: direction.into(), tag: 0 };
                }
                // W_e = 1/A, the point has density 1/A: the walk begins with ∫ L cosθ dω, that is, with a Lambert surface of f = 1.
                Device::Patch(patch) => states.start_flat(i, patch.point(key.pair(dimension(0, 6))), patch.normal, Vec3::splat(PI)),
            }
        }
    }

    fn start_at_lamp(&self, keys: &[Key], states: &mut LightStates) {
        let Some(choice) = &self.lit.choice else { return };
        for (i, key) in keys.iter().enumerate() {
            let (chosen, p, _) = choice.sample(key.unit(dimension(0, 5)));
            let place = key.pair(dimension(0, 6));
            match self.lit.sources[chosen] {
                Source::Triangle(triangle) => {
                    let at = warp::triangle(place);
                    let [a, b, c] = self.lit.corners(triangle);
                    let position = a + (b - a) * at[0] + (c - a) * at[1];
                    let radiance = self.lit.emission(triangle, at);
                    states.start_flat(i, position, self.lit.normal(triangle), radiance * (PI * self.lit.area(triangle) / p));
                    states.points[i].triangle = triangle;
                }
                Source::Beam(beam) => {
                    let way = key.pair(dimension(0, 0));
                    let emission = self.lit.beams[beam as usize].emit([place[0], place[1], way[0], way[1]]);
                    states.kinds[i] = Kind::Beam(beam);
                    states.flux[i] = emission.flux / p;
                    states.density[i] = if emission.delta_direction { f32::INFINITY } else { emission.pdf_direction };
                    states.linked[i] = if self.links_itself(beam) { Linked::Wholly } else { Linked::Never };
                    states.points[i].position = emission.origin;
                    states.rays[i] =
                        Ray { origin: emission.origin.into(), t_max: f32::INFINITY, direction: emission.direction.into(), tag: 0 };
                }
            }
        }
    }

    /// Density per sr with which a link from the ray's origin would have found source `source`, by area: p/A · r²/cosθ′.
    fn link_density(&self, source: usize, triangle: u32, distance: f32, cos: f32) -> f32 {
        let p = self.lit.choice.as_ref().map_or(0.0, |choice| choice.probability(source));
        p * distance * distance / (cos * self.lit.area(triangle))
    }

    fn arrive_at_lamp(&self, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
        let mut found = false;
        for i in 0..states.len() {
            let (value, density) = match states.kinds[i] {
                Kind::Surface => {
                    let point = &states.points[i];
                    let Some(source) = self.lit.source_of(point.triangle) else { continue };
                    let cos = states.back[i].dot(point.geometric);
                    if cos <= 0.0 {
                        continue; // lamps are one-sided
                    }
                    (self.lit.emission(point.triangle, states.at[i]), self.link_density(source, point.triangle, states.hits[i].t, cos))
                }
                Kind::Sky => {
                    let Some(sky) = self.lit.sky else { continue };
                    let Emitter::Environment(light) = &self.lit.beams[sky] else { continue };
                    let direction = -states.back[i];
                    let source = self.lit.sky_source();
                    let p = self.lit.choice.as_ref().map_or(0.0, |choice| choice.probability(source));
                    (light.radiance(direction), p * light.pdf(direction))
                }
                Kind::Eye | Kind::Beam(_) => continue,
            };
            found = true;
            ends.value[i] = value.into();
            ends.bin[i] = states.bins[i];
            ends.kernel_density[i] = states.density[i];
            ends.link_density[i] = states.linked[i].density(density);
        }
        found
    }

    fn link_to_lamp(&self, dimension: u32, keys: &[Key], states: &mut LightStates, links: &mut Links<Rgb>) {
        let Some(choice) = &self.lit.choice else { return };
        for i in 0..states.len() {
            if states.kinds[i] != Kind::Surface || !connects(&states.points[i].bsdf) {
                continue;
            }
            let (point, back) = (&states.points[i], states.back[i]);
            let (chosen, p, _) = choice.sample(keys[i].unit(dimension));
            let place = keys[i].pair(dimension + 1);
            let (ray, direction, light, density) = match self.lit.sources[chosen] {
                Source::Triangle(triangle) => {
                    let at = warp::triangle(place);
                    let [a, b, c] = self.lit.corners(triangle);
                    let lamp = a + (b - a) * at[0] + (c - a) * at[1];
                    let normal = self.lit.normal(triangle);
                    let to = lamp - point.position;
                    let squared = to.length_squared();
                    let direction = to / squared.sqrt();
                    let density = p * squared / (-direction.dot(normal) * self.lit.area(triangle));
                    if !(density > 0.0 && density.is_finite()) {
                        continue;
                    }
                    let error = rounding(lamp);
                    let ray = offset::segment(point.position, point.error, point.geometric, lamp, error, normal);
                    (ray, direction, self.lit.emission(triangle, at) / density, density)
                }
                Source::Beam(beam) => {
                    let Some(light) = self.lit.beams[beam as usize].toward(point.position, place) else { continue };
                    let mut ray = outward(point, light.direction);
                    if light.distance.is_finite() {
                        ray.t_max = light.distance * (1.0 - 1e-5);
                    }
                    let density = if light.delta { f32::INFINITY } else { p * light.pdf };
                    (ray, light.direction, light.radiance / (p * light.pdf), density)
                }
            };
            let (f, kernel_density) = toward(point, back, direction, Side::Primal);
            let value = f * light;
            if value.max_element() > 0.0 {
                links.value[i] = value.into();
                links.bin[i] = states.bins[i];
                links.link_density[i] = density;
                links.kernel_density[i] = kernel_density;
                states.look(i, ray);
            }
        }
    }

    fn link_to_sensor(&self, channel: usize, dimension: u32, keys: &[Key], states: &mut LightStates, links: &mut Links<Rgb>) {
        let first = self.first_bin[channel];
        for i in 0..states.len() {
            let found = match &self.devices[channel] {
                Device::Pinhole(eye) => {
                    let sees = |to: Vec3| eye.sees(to);
                    self.link_to_eye(
                        eye.position,
                        eye.width * eye.height,
                        |bin, jitter| eye.direction(bin, jitter),
                        sees,
                        keys[i],
                        dimension,
                        states,
                        i,
                    )
                }
                Device::Patch(patch) => self.link_to_patch(patch, keys[i].pair(dimension), states, i),
            };
            let Some(link) = found else { continue };
            if link.value.max_element() > 0.0 {
                links.value[i] = link.value.into();
                links.bin[i] = first + link.bin;
                links.link_density[i] = link.density;
                links.kernel_density[i] = link.kernel_density;
                states.look(i, link.ray);
            }
        }
    }

    fn link_to_eye(
        &self,
        eye: Vec3,
        pixels: u32,
        direction: impl Fn(u32, [f32; 2]) -> Vec3,
        sees: impl Fn(Vec3) -> Option<(u32, f32)>,
        key: Key,
        dimension: u32,
        states: &LightStates,
        i: usize,
    ) -> Option<Found> {
        let point = &states.points[i];
        match states.kinds[i] {
            Kind::Surface if connects(&point.bsdf) => {
                let to = point.position - eye;
                let (bin, response) = sees(to)?;
                let (f, _) = toward(point, states.back[i], -to.normalize(), Side::Dual);
                let ray = offset::segment(point.position, point.error, point.geometric, eye, Vec3::ZERO, Vec3::ZERO);
                // No walk ever hits the pinhole by itself.
                Some(Found { value: f * response, bin, density: f32::INFINITY, kernel_density: 0.0, ray })
            }
            // Light from beyond that is seen directly: the pixel is drawn, not the origin.
            Kind::Beam(beam) => {
                let Emitter::Environment(light) = &self.lit.beams[beam as usize] else { return None };
                let bin = ((key.unit(dimension) * pixels as f32) as u32).min(pixels - 1);
                let direction = direction(bin, key.pair(dimension + 1));
                let p = self.lit.choice.as_ref()?.probability(self.lit.sky_source());
                let ray = Ray { origin: eye.into(), t_max: f32::INFINITY, direction: direction.into(), tag: 0 };
                let value = light.radiance(direction) * (pixels as f32 / p);
                Some(Found { value, bin, density: f32::INFINITY, kernel_density: 0.0, ray })
            }
            _ => None,
        }
    }

    fn link_to_patch(&self, patch: &Patch, place: [f32; 2], states: &LightStates, i: usize) -> Option<Found> {
        let point = &states.points[i];
        let target = patch.point(place);
        let to = target - point.position;
        let squared = to.length_squared();
        let direction = to / squared.sqrt();
        let cos = -direction.dot(patch.normal);
        if cos.is_nan() || cos <= 0.0 {
            return None;
        }
        let density = squared / (cos * patch.area);
        match states.kinds[i] {
            Kind::Surface if connects(&point.bsdf) => {
                let (f, kernel_density) = toward(point, states.back[i], direction, Side::Dual);
                let ray = offset::segment(point.position, point.error, point.geometric, target, rounding(target), patch.normal);
                // K·g/p with g = 1/A and p = 1/A
                Some(Found { value: f * (cos / squared), bin: 0, density, kernel_density, ray })
            }
            Kind::Beam(beam) if self.links_itself(beam) => {
                let light = self.lit.beams[beam as usize].toward(target, [0.0; 2])?;
                let p = self.lit.choice.as_ref()?.probability(self.lit.source_of_beam(beam));
                let nothing = Vec3::ZERO;
                let ray = offset::segment(target, rounding(target), patch.normal, point.position, nothing, nothing);
                Some(Found { value: light.radiance * (cos / p), bin: 0, density: f32::INFINITY, kernel_density: 0.0, ray })
            }
            _ => None,
        }
    }

    /// Whether a lamp at a point is linked with patches at the start, so that its first flight must not be counted again.
    fn links_itself(&self, beam: u32) -> bool {
        matches!(self.lit.beams[beam as usize], Emitter::Point { .. } | Emitter::Spot(_))
    }

    fn scatter_surface(&self, side: Side, event: u32, i: usize, key: Key, states: &mut LightStates, steps: &mut Steps<Rgb>) {
        let (point, back) = (&states.points[i], states.back[i]);
        let frame = Frame::new(point.shading);
        let local = frame.to_local(back);
        let u = [key.unit(dimension(event, 0)), key.unit(dimension(event, 1)), key.unit(dimension(event, 2))];
        let Some(sample) = point.bsdf.sample(local, u, side) else { return };
        let direction = frame.to_world(sample.wi);
        let mut weight = sample.weight;
        if point.shading != point.geometric {
            weight *= bent(point, back, direction, side);
        }
        steps.factor[i] = weight.into();
        steps.survival[i] = point.bsdf.albedo(local).max_element().clamp(0.05, 0.95);
        states.rays[i] = outward(point, direction);
        states.density[i] = if sample.delta { f32::INFINITY } else { sample.pdf };
        states.linked[i] = if sample.delta { Linked::Never } else { Linked::Also };
    }
}

/// Whether a BSDF has anything but deltas.
#[inline]
fn connects(bsdf: &Bsdf) -> bool {
    !matches!(bsdf, Bsdf::Black | Bsdf::SmoothDielectric { .. })
}

/// A link that was found.
struct Found {
    value: Vec3,
    bin: u32,
    density: f32,
    kernel_density: f32,
    ray: Ray,
}

fn arrive_at_patch(patch: &Patch, bin: u32, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
    let mut found = false;
    for (i, (ray, hit)) in states.rays.iter().zip(&states.hits).enumerate() {
        if let Some((cos, t)) = patch.crossed(ray.origin.into(), ray.direction.into(), hit.t) {
            found = true;
            ends.value[i] = Vec3::splat(1.0 / patch.area).into();
            ends.bin[i] = bin;
            ends.kernel_density[i] = states.density[i];
            ends.link_density[i] = states.linked[i].density(t * t / (cos * patch.area));
        }
    }
    found
}
