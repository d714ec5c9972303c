//! The light problem with its walks steered by a field: directions from a mixture of the field's lobes and the BSDF, splitting and
//! roulette by what the field promises (eq. 2.39–2.46 with a defensive mixture).

use std::{f32::consts::FRAC_1_PI, ops::Range};

use glam::Vec3;
use intrados_stage::random::Key;
use intrados_transport::{Ends, Links, Problem, Side, Steps, Value, dimension};

use super::{Charts, LightField, NONE, lobe::Spot};
use crate::{
    LightProblem, Rgb,
    bsdf::Bsdf,
    eight::{self, WIDE},
    link::toward,
    problem::{LightStates, Linked},
    rgb::luminance,
};

/// Numbers of the random numbers that steering uses.
const LOBE: u32 = 4092;
const BOX: u32 = 4093;
const PLACE: u32 = 4094;

/// Where a steered walk stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    /// Chart and side; [`NONE`] where there is no surface.
    pub(crate) key: u32,
    /// Cell of the field.
    pub(crate) cell: u32,
    /// |cosine| of the way on.
    pub(crate) cos: f32,
    /// What arrives there by the field.
    pub(crate) irradiance: f32,
}

impl Station {
    pub(crate) const NOWHERE: Self = Self { key: NONE, cell: NONE, cos: 0.0, irradiance: 0.0 };
}

/// A light problem whose walks of one side a field steers.
#[derive(Debug)]
pub(crate) struct SteeredLight<'a> {
    plain: LightProblem<'a>,
    pub(crate) charts: &'a Charts,
    field: &'a LightField,
    /// The reading that a walk is expected to score.
    reading: f32,
    /// Share of ways that ignore the field.
    defence: f32,
    /// Key of the place where walks start, if that is a patch.
    start: u32,
    /// Whether walks are measured by their own first promise, not by the reading.
    by_pixel: bool,
}

impl<'a> SteeredLight<'a> {
    pub(crate) fn new(plain: LightProblem<'a>, charts: &'a Charts, field: &'a LightField, reading: f32, defence: f32, start: u32) -> Self {
        Self { plain, charts, field, reading, defence, start, by_pixel: false }
    }

    pub(crate) fn by_pixel(self, by_pixel: bool) -> Self {
        Self { by_pixel, ..self }
    }

    /// The same with another reading to be expected.
    pub(crate) fn expecting(self, reading: f32) -> Self {
        Self { reading, ..self }
    }

    pub(crate) fn reading(&self) -> f32 {
        self.reading
    }

    pub(crate) fn plain(&self) -> &LightProblem<'a> {
        &self.plain
    }

    /// Density of going from `y` toward `d`, per sr, where the BSDF alone would go with density `kernel`.
    #[inline]
    fn density(&self, station: &Station, kernel: f32, spot: &Spot, d: Vec3) -> f32 {
        self.defence * kernel + (1.0 - self.defence) * self.field.density(station.cell, spot, station.irradiance, d)
    }

    /// Where a row stands, on the side that it came from.
    fn spot(row: usize, states: &LightStates) -> Spot {
        let (place, lane) = (&states.places[row / WIDE], row % WIDE);
        let (normal, back) = (place.normal.lane(lane), place.back.lane(lane));
        Spot { position: place.position.lane(lane), normal: if back.dot(normal) < 0.0 { -normal } else { normal } }
    }

    fn station(&self, side: Side, event: u32, row: usize, states: &LightStates) -> Station {
        let place = &states.places[row / WIDE];
        let lane = row % WIDE;
        if (place.plain | place.special) >> lane & 1 == 0 || states.at_eye {
            return Station::NOWHERE;
        }
        let key = match (event, side) {
            (0, Side::Primal) => self.start,
            (0, Side::Dual) if !states.hits[row].is_hit() => NONE,
            _ => {
                let front = place.back.lane(lane).dot(place.normal.lane(lane)) > 0.0;
                2 * self.charts.of(states.hits[row].triangle) + u32::from(!front)
            }
        };
        let steerable = place.special >> lane & 1 == 0 || steerable(&states.points[row].bsdf);
        let cell = if key == NONE || !steerable { NONE } else { self.field.cell(key, place.position.lane(lane)) };
        Station { key, cell, ..Station::NOWHERE }
    }

    fn worth_of(&self, event: u32, row: usize, weight: Rgb, states: &LightStates) -> f32 {
        let (place, station) = (&states.places[row / WIDE], &states.stations[row]);
        if event == 0 && station.key == NONE {
            return -1.0;
        }
        if (place.plain | place.special) >> (row % WIDE) & 1 == 0 {
            return 0.0;
        }
        let albedo = Self::albedo(row, states);
        if albedo.max_element() <= 0.0 {
            return 0.0;
        }
        if station.cell == NONE {
            return -albedo.max_element().clamp(0.05, 0.95);
        }
        let worth = luminance(Vec3::from(weight) * albedo) * station.irradiance * FRAC_1_PI / self.reading;
        // Where no reading is known yet, nobody can say: a NaN neither splits nor dies.
        if worth < f32::MIN_POSITIVE { f32::MIN_POSITIVE } else { worth }
    }

    /// Reflectance, roughly: exact for Lambert's law.
    fn albedo(row: usize, states: &LightStates) -> Vec3 {
        let (place, lane) = (&states.places[row / WIDE], row % WIDE);
        if place.plain >> lane & 1 == 1 {
            return place.albedo.lane(lane);
        }
        let point = &states.points[row];
        point.bsdf.albedo(crate::bsdf::Frame::new(point.shading).to_local(place.back.lane(lane)))
    }

    /// f·cosθ toward `d`, and the density with which the BSDF would go there.
    fn toward(side: Side, row: usize, d: Vec3, states: &LightStates) -> (Vec3, f32) {
        let (place, lane) = (&states.places[row / WIDE], row % WIDE);
        let (normal, back) = (place.normal.lane(lane), place.back.lane(lane));
        if place.plain >> lane & 1 == 0 {
            return toward(&states.points[row], back, d, side);
        }
        let f = if d.dot(normal) * back.dot(normal) > 0.0 { d.dot(normal).abs() * FRAC_1_PI } else { 0.0 };
        (place.albedo.lane(lane) * f, f)
    }

    /// Mixes the field into the way that the BSDF has drawn for row `row`.
    fn steer(&self, side: Side, event: u32, row: usize, key: Key, states: &mut LightStates, steps: &mut Steps<Rgb>) {
        let (station, spot) = (states.stations[row], Self::spot(row, states));
        let u = key.unit(dimension(event, LOBE));
        let mut d = Vec3::from(states.rays[row].direction);
        if u < self.defence && !(steps.factor[row].largest() > 0.0) {
            return;
        }
        if u >= self.defence {
            let rest = ((u - self.defence) / (1.0 - self.defence)).min(1.0 - f32::EPSILON);
            d = self.field.sample(
                station.cell,
                &spot,
                station.irradiance,
                [rest, key.unit(dimension(event, BOX))],
                key.pair(dimension(event, PLACE)),
            );
        }
        let (f, kernel) = Self::toward(side, row, d, states);
        if !(f.max_element() > 0.0) {
            steps.factor[row] = Rgb::ZERO;
            return;
        }
        let density = self.density(&station, kernel, &spot, d);
        steps.factor[row] = (f / density).into();
        states.density[row] = density;
        states.linked[row] = Linked::Also;
        if u >= self.defence {
            let place = &states.places[row / WIDE];
            let leave = eight::leave(place.position, place.off, place.normal, eight::Vec3x8::splat(d)).lane(row % WIDE);
            states.rays[row] = intrados_scene::Ray::new(leave, d, f32::INFINITY);
        }
    }
}

/// Whether a field over places and directions is fine enough to steer by: mirrors and glass go their own ways.
fn steerable(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::Lambert { .. } => true,
        Bsdf::Metallic { alpha, .. } => *alpha > 0.1,
        _ => false,
    }
}

impl Problem for SteeredLight<'_> {
    type Value = Rgb;
    type States = LightStates;

    fn channels(&self, side: Side) -> usize {
        self.plain.channels(side)
    }

    fn bins(&self) -> usize {
        self.plain.bins()
    }

    fn start(&self, side: Side, walks: Range<u64>, keys: &[Key], states: &mut LightStates) {
        self.plain.start(side, walks, keys, states);
    }

    fn arrive(&self, side: Side, channel: usize, states: &LightStates, ends: &mut Ends<Rgb>) -> bool {
        self.plain.arrive(side, channel, states, ends)
    }

    fn worth(&self, side: Side, event: u32, weight: &[Rgb], states: &mut LightStates, worth: &mut [f32]) -> bool {
        states.stations.clear();
        for row in 0..weight.len() {
            let station = self.station(side, event, row, states);
            states.stations.push(station);
        }
        // Walks of one cell together: the field is larger than the caches.
        states.order.clear();
        states.order.extend(0..weight.len() as u32);
        let LightStates { order, stations, .. } = states;
        order.sort_unstable_by_key(|&row| (stations[row as usize].cell, row));
        for i in 0..weight.len() {
            let row = states.order[i] as usize;
            if states.stations[row].cell != NONE {
                let irradiance = self.field.irradiance(states.stations[row].cell, &Self::spot(row, states));
                // A field that says that nothing arrives says nothing.
                let cell = if irradiance > 0.0 { states.stations[row].cell } else { NONE };
                states.stations[row] = Station { cell, irradiance, ..states.stations[row] };
            }
            worth[row] = self.worth_of(event, row, weight[row], states);
            if self.by_pixel && worth[row] > 0.0 {
                let first = &mut states.references[row];
                *first = if first.is_nan() { worth[row] } else { *first };
                worth[row] /= *first;
            }
        }
        true
    }

    fn link(&self, side: Side, channel: usize, event: u32, keys: &[Key], states: &mut LightStates, links: &mut Links<Rgb>) -> bool {
        let found = self.plain.link(side, channel, event, keys, states, links);
        let looks = &states.looks;
        for (ray, &row) in looks.rays[..looks.count].iter().zip(&looks.rows) {
            let row = row as usize;
            let station = states.stations[row];
            if station.cell != NONE && links.link_density[row].is_finite() {
                let d = Vec3::from(ray.direction).normalize();
                links.kernel_density[row] = self.density(&station, links.kernel_density[row], &Self::spot(row, states), d);
            }
        }
        found
    }

    fn reveal(&self, side: Side, states: &mut LightStates, links: &mut Links<Rgb>) {
        self.plain.reveal(side, states, links);
    }

    fn scatter(&self, side: Side, event: u32, keys: &[Key], states: &mut LightStates, steps: &mut Steps<Rgb>) {
        self.plain.scatter(side, event, keys, states, steps);
        states.order.clear();
        states.order.extend(0..keys.len() as u32);
        let LightStates { order, stations, .. } = states;
        order.sort_unstable_by_key(|&row| (stations[row as usize].cell, row));
        for i in 0..keys.len() {
            let row = states.order[i] as usize;
            if states.stations[row].cell != NONE {
                self.steer(side, event, row, keys[row], states, steps);
            }
            let normal = states.places[row / WIDE].normal.lane(row % WIDE);
            states.stations[row].cos = Vec3::from(states.rays[row].direction).dot(normal).abs();
        }
    }

    fn fly(&self, side: Side, states: &mut LightStates) {
        self.plain.fly(side, states);
    }
}
