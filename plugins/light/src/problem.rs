//! Light as an instance of the transport problem: K = f_r cosθ in directions (eq. 2.6), σ = L_e, g
//! = W_e (eq. 2.4).
//!
//! The primal walk starts at a sensor and carries radiance, the dual walk starts at a lamp and
//! carries importance-weighted flux (eq. 2.13–2.15). Both stand on the same points, use the same
//! BSDFs and are linked by the same segments.

use std::{
    f32::consts::{FRAC_1_PI, PI},
    ops::Range,
};

use glam::Vec3;
use glam::Vec3A;
use intrados_scene::{Hit, Ray, tracer::Scratch};
use intrados_stage::random::Key;
use intrados_transport::prelude::*;
use wide::f32x8;

use crate::{
    Rgb, Sensor,
    bsdf::{Frame, warp::Discrete},
    eight::{self, Keys8, Vec3x8, WIDE},
    emit::Emitter,
    field::steer::Station,
    link::{bent, outward},
    lit::{LitScene, Point, Points8, Source},
    sensor::{Device, Patch, Pinhole},
};

/// The transport problem of one lit scene and some sensors. Primal walks start at the first sensor,
/// dual walks look for all.
#[derive(Debug)]
pub struct LightProblem<'a> {
    pub(crate) lit: &'a LitScene,
    pub(crate) devices: Vec<Device>,
    /// First bin of each sensor, and the number of all bins.
    pub(crate) first_bin: Vec<u32>,
    pixels: u64,
    /// Pixels that walks from the first sensor start at, in turns; `None`: all.
    chosen: Option<&'a [u32]>,
    /// What walks from the lamps choose their lamp by, if not by flux.
    lamps: Option<&'a Discrete>,
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
        Self {
            lit,
            devices: sensors.iter().map(Device::from).collect(),
            first_bin,
            pixels,
            chosen: None,
            lamps: None,
        }
    }

    /// The same, with walks from the first sensor that start at `pixels` only (none of them none of
    /// its own).
    pub(crate) fn of_pixels(self, pixels: Option<&'a [u32]>) -> Self {
        let count = pixels.map_or(self.pixels, |pixels| pixels.len().max(1) as u64);
        Self { pixels: count, chosen: pixels.filter(|pixels| !pixels.is_empty()), ..self }
    }

    /// The same, with walks that choose their lamp by `lamps` (one entry a source, none 0 that has
    /// flux).
    pub(crate) fn starting_by(self, lamps: Option<&'a Discrete>) -> Self {
        Self { lamps, ..self }
    }

    /// Probability that a walk starts at a source.
    pub(crate) fn starts_at(&self, source: usize) -> f32 {
        self.lamps.or(self.lit.choice.as_ref()).map_or(0.0, |choice| choice.probability(source))
    }

    /// Which sensor a bin belongs to, and which bin of that sensor it is.
    #[must_use]
    pub(crate) fn sensor_of(&self, bin: u32) -> (usize, u32) {
        let sensor = self.first_bin.partition_point(|&first| first <= bin) - 1;
        (sensor, bin - self.first_bin[sensor])
    }
}

/// A start from a lamp that is no surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    pub(crate) row: u32,
    pub(crate) beam: u32,
    pub(crate) origin: Vec3,
    flux: Vec3,
}

/// What links from the event before found of the place where a walk arrives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Linked {
    /// Nothing: a delta, the pinhole, light from beyond.
    Never,
    /// The same places, with a density.
    Also,
    /// All of it: what is found by arriving must not count again.
    Wholly,
}

impl Linked {
    /// The link's density for the weight of an arrival, where `density` would be that of
    /// [`Linked::Also`].
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
    pub(crate) rays: Vec<Ray>,
    /// What it met; not at event 0.
    pub(crate) hits: Vec<Hit>,
    /// Where the walks are, eight rows each. Every flight makes them anew.
    pub(crate) places: Vec<Points8>,
    /// The points of special rows; it holds nothing of others.
    pub(crate) points: Vec<Point>,
    /// Density per sr of the direction that led here; infinite for a delta.
    pub(crate) density: Vec<f32>,
    /// What a link from the event before could have done.
    pub(crate) linked: Vec<Linked>,
    /// Pixel (primal).
    pub(crate) bins: Vec<u32>,
    /// Whether the walks are at the pinhole.
    pub(crate) at_eye: bool,
    /// At event 0 the walks that start from no surface.
    pub(crate) departures: Vec<Departure>,
    pub(crate) looks: Looks,
    scratch: Scratch,
    /// Of steered walks: where they stand.
    pub(crate) stations: Vec<Station>,
    /// What they promised when a field first knew, by row; NaN until then.
    pub(crate) references: Vec<f32>,
    /// Rows in the order of their cells.
    pub(crate) order: Vec<u32>,
}

/// Segments to look along, and whose they are.
#[derive(Debug, Default)]
pub(crate) struct Looks {
    pub(crate) rays: Vec<Ray>,
    pub(crate) rows: Vec<u32>,
    blocked: Vec<bool>,
    /// How many there are; the columns are longer.
    pub(crate) count: usize,
}

impl Looks {
    /// Room for `n`.
    fn begin(&mut self, n: usize) {
        self.count = 0;
        if self.rays.len() < n + WIDE {
            self.rays.resize(n + WIDE, NOWHERE);
            self.rows.resize(n + WIDE, 0);
        }
    }

    pub(crate) fn push(&mut self, row: usize, ray: Ray) {
        self.rays[self.count] = ray;
        self.rows[self.count] = row as u32;
        self.count += 1;
    }

    /// The lanes of `mask` of block `block`. All are written, the next one over those that do not
    /// count: no branch to mispredict.
    #[inline]
    pub(crate) fn push_lanes(&mut self, block: usize, mask: u32, rays: [Ray; WIDE]) {
        for (lane, ray) in rays.into_iter().enumerate() {
            self.rays[self.count] = ray;
            self.rows[self.count] = (block * WIDE + lane) as u32;
            self.count += (mask >> lane & 1) as usize;
        }
    }
}

impl States for LightStates {
    /// Only what the flight that follows needs: where a walk was before is forgotten.
    fn gather(&mut self, rows: &[u32]) {
        keep(&mut self.rays, rows);
        keep(&mut self.density, rows);
        keep(&mut self.linked, rows);
        keep(&mut self.bins, rows);
        if !self.stations.is_empty() {
            keep(&mut self.stations, rows);
            keep(&mut self.references, rows);
        }
    }

    /// All that scattering needs.
    fn repeat(&mut self, rows: &[u32]) {
        let places = &self.places;
        self.places = rows.chunks(WIDE).map(|rows| Points8::picked(places, rows)).collect();
        if self.places.iter().any(|place| place.special != 0) {
            spread(&mut self.points, rows);
        }
        spread(&mut self.bins, rows);
        spread(&mut self.stations, rows);
        spread(&mut self.references, rows);
        self.rays.resize(rows.len(), NOWHERE);
        self.density.resize(rows.len(), 0.0);
        self.linked.resize(rows.len(), Linked::Never);
    }
}

const NOWHERE: Ray = Ray { origin: [0.0; 3], t_max: 0.0, direction: [0.0, 0.0, 1.0], tag: 0 };

impl LightStates {
    fn begin(&mut self, n: usize) {
        fn fill<T: Clone>(column: &mut Vec<T>, n: usize, value: T) {
            column.clear();
            column.resize(n, value);
        }
        self.rays.resize(n, NOWHERE);
        fill(&mut self.places, n.div_ceil(WIDE), Points8::default());
        fill(&mut self.density, n, f32::INFINITY);
        fill(&mut self.linked, n, Linked::Never);
        fill(&mut self.bins, n, 0);
        self.at_eye = false;
        self.departures.clear();
        self.stations.clear();
        fill(&mut self.references, n, f32::NAN);
        self.hits.clear();
        self.hits.resize(n, Hit::MISS);
    }

    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// The lanes of block `block` that are walks.
    #[inline]
    pub(crate) fn live(&self, block: usize) -> u32 {
        0xff >> (WIDE - (self.len() - block * WIDE).min(WIDE))
    }
}

/// Starts on flat things that send light by Lambert's law: `albedo` = π × what they send per sr and
/// cosine.
fn flat(position: Vec3x8, off: f32x8, normal: Vec3x8, albedo: Vec3x8, plain: u32) -> Points8 {
    Points8 { position, off, normal, back: normal, albedo, plain, ..Points8::default() }
}

impl TransportProblem for LightProblem<'_> {
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
        states.begin(keys.len());
        match side {
            Side::Primal => self.start_at_sensor(walks, keys, states),
            Side::Dual => self.start_at_lamp(keys, states),
        }
    }

    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &LightStates,
        ends: &mut Ends<Rgb>,
    ) -> bool {
        match side {
            Side::Primal => {
                let lamp = self.arrive_at_lamp(states, ends);
                self.arrive_in_sky(states, ends) || lamp
            }
            Side::Dual => match &self.devices[channel] {
                Device::Pinhole(_) => false,
                Device::Patch(patch) => {
                    arrive_at_patch(patch, self.first_bin[channel], states, ends)
                }
            },
        }
    }

    fn link(
        &self,
        side: Side,
        channel: usize,
        event: u32,
        keys: &[Key],
        states: &mut LightStates,
        links: &mut Links<Rgb>,
    ) -> bool {
        states.looks.begin(states.len());
        let dimension = dimension(event, 8 + 4 * channel as u32);
        match side {
            Side::Primal => self.link_to_lamp(dimension, keys, states, links),
            Side::Dual => match &self.devices[channel] {
                Device::Pinhole(eye) => {
                    self.link_to_eye(eye, self.first_bin[channel], dimension, keys, states, links)
                }
                Device::Patch(patch) => self.link_to_patch(
                    patch,
                    self.first_bin[channel],
                    dimension,
                    keys,
                    states,
                    links,
                ),
            },
        }
        states.looks.count > 0
    }

    fn reveal(&self, _: Side, states: &mut LightStates, links: &mut Links<Rgb>) {
        let Looks { rays, rows, blocked, count } = &mut states.looks;
        blocked.resize(*count, false);
        self.lit.tracer.any(&rays[..*count], blocked, &mut states.scratch);
        for (&row, &blocked) in rows.iter().zip(blocked.iter()) {
            let value = &mut links.value[row as usize];
            *value = if blocked { Rgb::ZERO } else { *value };
        }
    }

    fn scatter(
        &self,
        side: Side,
        event: u32,
        keys: &[Key],
        states: &mut LightStates,
        steps: &mut Steps<Rgb>,
    ) {
        if states.at_eye {
            // The way was drawn at the start.
            steps.factor.fill(Rgb(Vec3A::ONE));
        }
        for departure in &states.departures {
            steps.factor[departure.row as usize] = departure.flux.into();
        }
        for block in 0..states.places.len() {
            if states.places[block].plain != 0 {
                scatter_plain(event, block, keys, states, steps);
            }
            for lane in eight::lanes(states.places[block].special) {
                scatter_special(side, event, block * WIDE + lane, keys, states, steps);
            }
        }
    }

    fn fly(&self, _: Side, states: &mut LightStates) {
        let LightStates { rays, hits, scratch, places, points, .. } = states;
        hits.resize(rays.len(), Hit::MISS);
        self.lit.tracer.closest(rays, hits, scratch);
        places.clear();
        states.at_eye = false;
        states.departures.clear();
        for block in 0..rays.len().div_ceil(WIDE) {
            let live = 0xff >> (WIDE - (rays.len() - block * WIDE).min(WIDE));
            let place = self.lit.points(&eight::rows(rays, block), &eight::rows(hits, block), live);
            if place.special != 0 && points.len() < rays.len() {
                points.resize(rays.len(), place.plain_point(0));
            }
            for lane in eight::lanes(place.special) {
                let row = block * WIDE + lane;
                points[row] = self.lit.special_point(&place, lane, hits[row].triangle);
            }
            places.push(place);
        }
    }
}

impl LightProblem<'_> {
    fn start_at_sensor(&self, walks: Range<u64>, keys: &[Key], states: &mut LightStates) {
        match &self.devices[0] {
            Device::Pinhole(eye) => self.start_at_eye(eye, walks, keys, states),
            // W_e = 1/A, the point has density 1/A: the walk begins with ∫ L cosθ dω, that is, with
            // a Lambert surface of f = 1.
            Device::Patch(patch) => {
                for block in 0..states.places.len() {
                    let place = Keys8::new(&eight::rows(keys, block)).pair(dimension(0, 6));
                    let (normal, albedo) =
                        (Vec3x8::splat(patch.normal), Vec3x8::splat(Vec3::splat(PI)));
                    let position = patch.points(place);
                    states.places[block] = flat(
                        position,
                        eight::rounding(position, normal),
                        normal,
                        albedo,
                        states.live(block),
                    );
                }
            }
        }
    }

    /// Walks go through the picture in order, so that every pixel gets the same share.
    fn start_at_eye(
        &self,
        eye: &Pinhole,
        walks: Range<u64>,
        keys: &[Key],
        states: &mut LightStates,
    ) {
        states.at_eye = true;
        for (bin, walk) in states.bins.iter_mut().zip(walks) {
            let turn = (walk % self.pixels) as u32;
            *bin = self.chosen.map_or(turn, |pixels| pixels[turn as usize]);
        }
        for block in 0..states.places.len() {
            let jitter = Keys8::new(&eight::rows(keys, block)).pair(dimension(0, 0));
            let direction = eye.directions(eight::rows(&states.bins, block), jitter);
            let rays = eight::join(Vec3x8::splat(eye.position), direction, f32::INFINITY);
            for (row, ray) in states.rays.iter_mut().skip(block * WIDE).zip(rays) {
                *row = ray;
            }
        }
    }

    fn start_at_lamp(&self, keys: &[Key], states: &mut LightStates) {
        let (Some(by_flux), Some(choice)) =
            (&self.lit.choice, self.lamps.or(self.lit.choice.as_ref()))
        else {
            return;
        };
        for block in 0..states.places.len() {
            let keys8 = Keys8::new(&eight::rows(keys, block));
            let place = keys8.pair(dimension(0, 6));
            let sources = self.lit.sources(choice, keys8.unit(dimension(0, 5)), place);
            let live = states.live(block);
            for lane in eight::lanes(live) {
                if let Source::Triangle(triangle) = self.lit.sources[sources.chosen[lane]] {
                    states.hits[block * WIDE + lane] = Hit { t: 0.0, triangle };
                }
            }
            let mut density = sources.density;
            if self.lamps.is_some() {
                // The sources know their density by flux.
                density *= f32x8::from(
                    sources.chosen.map(|i| choice.probability(i) / by_flux.probability(i)),
                );
            }
            let albedo = sources.radiance * (f32x8::splat(PI) / density);
            states.places[block] =
                flat(sources.point, sources.off, sources.normal, albedo, sources.simple & live);
            for lane in eight::lanes(live & !sources.simple) {
                let (row, place) = (block * WIDE + lane, place.map(|u| u.as_array()[lane]));
                self.start_special(sources.chosen[lane], row, place, keys[row], states);
            }
        }
    }

    /// A start from a lamp with a texture, or from one that is no surface.
    fn start_special(
        &self,
        source: usize,
        row: usize,
        place: [f32; 2],
        key: Key,
        states: &mut LightStates,
    ) {
        let p = self.starts_at(source);
        match self.lit.sources[source] {
            Source::Triangle(triangle) => {
                let at = crate::bsdf::warp::triangle(place);
                let radiance = self.lit.emission(triangle, at);
                let (place, normal) = (self.lit.place(triangle, at), self.lit.normal(triangle));
                let albedo = radiance * (PI * self.lit.area(triangle) / p);
                states.places[row / WIDE].set_flat(row % WIDE, place, normal, albedo);
            }
            Source::Beam(beam) => {
                let way = key.pair(dimension(0, 0));
                let emission =
                    self.lit.beams[beam as usize].emit([place[0], place[1], way[0], way[1]]);
                states.departures.push(Departure {
                    row: row as u32,
                    beam,
                    origin: emission.origin,
                    flux: emission.flux / p,
                });
                // Patches are linked with the lamp itself at the start, so that its first flight
                // must not be counted again.
                states.density[row] = emission.pdf_direction;
                states.linked[row] = Linked::Wholly;
                states.rays[row] = Ray::new(emission.origin, emission.direction, f32::INFINITY);
            }
        }
    }

    fn arrive_at_lamp(&self, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
        let mut found = false;
        for (block, place) in
            states.places.iter().enumerate().filter(|(_, place)| place.shining != 0)
        {
            // lamps are one-sided
            let cos = place.back.dot(place.normal);
            for lane in eight::lanes(place.shining & cos.simd_gt(f32x8::ZERO).to_bitmask()) {
                let i = block * WIDE + lane;
                let Hit { t, triangle } = states.hits[i];
                // Density per sr with which a link from the event before would have found this: p/A
                // · r²/cosθ′.
                let density = self.source_density(place.source(lane), triangle) * t * t
                    / cos.as_array()[lane];
                found = true;
                ends.value[i] = self.lit.emission(triangle, place.at(lane)).into();
                ends.bin[i] = states.bins[i];
                ends.kernel_density[i] = states.density[i];
                ends.link_density[i] = states.linked[i].density(density);
            }
        }
        found
    }

    /// Probability density per m² of a link to a shining triangle.
    pub(crate) fn source_density(&self, source: usize, triangle: u32) -> f32 {
        match self.lit.source_density(source) {
            0.0 => {
                self.lit.choice.as_ref().map_or(0.0, |choice| choice.probability(source))
                    / self.lit.area(triangle)
            }
            simple => simple,
        }
    }

    fn arrive_in_sky(&self, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
        let Some(Emitter::Environment(light)) = self.lit.sky.map(|sky| &self.lit.beams[sky]) else {
            return false;
        };
        let p = self
            .lit
            .choice
            .as_ref()
            .map_or(0.0, |choice| choice.probability(self.lit.sky_source()));
        let mut found = false;
        for (i, ray) in states.rays.iter().enumerate().filter(|(i, _)| !states.hits[*i].is_hit()) {
            let direction = Vec3::from(ray.direction);
            found = true;
            ends.value[i] = light.radiance(direction).into();
            ends.bin[i] = states.bins[i];
            ends.kernel_density[i] = states.density[i];
            ends.link_density[i] = states.linked[i].density(p * light.pdf(direction));
        }
        found
    }
}

/// The ways on from the plain lanes of a block.
#[inline]
fn scatter_plain(
    event: u32,
    block: usize,
    keys: &[Key],
    states: &mut LightStates,
    steps: &mut Steps<Rgb>,
) {
    let place = &states.places[block];
    let u = Keys8::new(&eight::rows(keys, block)).pair(dimension(event, 0));
    let (direction, cos) = eight::cosine_direction(place.normal, place.back, u);
    let origin = eight::leave(place.position, place.off, place.normal, direction);
    let rays = eight::join(origin, direction, f32::INFINITY);
    let factor = place.albedo * cos.simd_gt(f32x8::ZERO).select(f32x8::ONE, f32x8::ZERO);
    let survival = place.albedo.largest().fast_max(f32x8::splat(0.05)).fast_min(f32x8::splat(0.95));
    let mask = place.plain;
    eight::put(&mut steps.factor, block, mask, eight::colours(factor));
    eight::put(&mut steps.survival, block, mask, survival.to_array());
    eight::put(&mut states.rays, block, mask, rays);
    eight::put(&mut states.density, block, mask, (cos * f32x8::splat(FRAC_1_PI)).to_array());
    eight::put(&mut states.linked, block, mask, [Linked::Also; WIDE]);
}

/// The way on from a special row.
fn scatter_special(
    side: Side,
    event: u32,
    i: usize,
    keys: &[Key],
    states: &mut LightStates,
    steps: &mut Steps<Rgb>,
) {
    let (point, back, key) =
        (&states.points[i], states.places[i / WIDE].back.lane(i % WIDE), keys[i]);
    let frame = Frame::new(point.shading);
    let local = frame.local(back);
    let u = [
        key.unit(dimension(event, 0)),
        key.unit(dimension(event, 1)),
        key.unit(dimension(event, 2)),
    ];
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
