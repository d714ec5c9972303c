//! The light problem with its walks steered by a field: directions from a mixture of the field's
//! lobes and the BSDF, splitting and roulette by what the field promises (eq. 2.39–2.46 with a
//! defensive mixture).

use std::{f32::consts::FRAC_1_PI, ops::Range};

use glam::Vec3;
use intrados_stage::random::Key;
use intrados_transport::{
    Ends, Field, Links, Side, Steps, TransportProblem, Value, dimension, field::promise,
};

use super::{Charts, LightField, NONE, View, lobe::Spot};
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
    /// Where it is, on the side that it came from, and what arrives there by the field.
    view: View,
}

impl Default for Station {
    /// Nowhere.
    fn default() -> Self {
        Self { key: NONE, cell: NONE, cos: 0.0, view: View::default() }
    }
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
    pub(crate) fn new(
        plain: LightProblem<'a>,
        charts: &'a Charts,
        field: &'a LightField,
        reading: f32,
        defence: f32,
        start: u32,
    ) -> Self {
        Self { plain, charts, field, reading, defence, start, by_pixel: false }
    }

    pub(crate) fn of_pixels(self, pixels: Option<&'a [u32]>) -> Self {
        Self { plain: self.plain.of_pixels(pixels), ..self }
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

    fn station(&self, side: Side, event: u32, row: usize, states: &LightStates) -> Station {
        let place = &states.places[row / WIDE];
        let lane = row % WIDE;
        if (place.plain | place.special) >> lane & 1 == 0 || states.at_eye {
            return Station::default();
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
        let (position, normal, back) =
            (place.position.lane(lane), place.normal.lane(lane), place.back.lane(lane));
        let cell = if key == NONE || !steerable { NONE } else { self.field.cell(key, position) };
        let spot = Spot { position, normal: if back.dot(normal) < 0.0 { -normal } else { normal } };
        Station { key, cell, cos: 0.0, view: View { spot, ..View::default() } }
    }

    fn expected_of(&self, event: u32, row: usize, weight: Rgb, states: &LightStates) -> f32 {
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
        let brings = luminance(Vec3::from(weight) * albedo) * station.view.total * FRAC_1_PI;
        promise(brings, self.reading)
    }

    /// Reflectance, roughly: exact for Lambert's law.
    fn albedo(row: usize, states: &LightStates) -> Vec3 {
        let (place, lane) = (&states.places[row / WIDE], row % WIDE);
        if place.plain >> lane & 1 == 1 {
            return place.albedo.lane(lane);
        }
        let point = &states.points[row];
        point.bsdf.albedo(crate::bsdf::Frame::new(point.shading).local(place.back.lane(lane)))
    }

    /// f·cosθ toward `d`, and the density with which the BSDF would go there.
    fn toward(side: Side, row: usize, d: Vec3, states: &LightStates) -> (Vec3, f32) {
        let (place, lane) = (&states.places[row / WIDE], row % WIDE);
        let (normal, back) = (place.normal.lane(lane), place.back.lane(lane));
        if place.plain >> lane & 1 == 0 {
            return toward(&states.points[row], back, d, side);
        }
        let f = if d.dot(normal) * back.dot(normal) > 0.0 {
            d.dot(normal).abs() * FRAC_1_PI
        } else {
            0.0
        };
        (place.albedo.lane(lane) * f, f)
    }

    /// Mixes the field into the way that the BSDF has drawn for row `row`.
    fn steer(
        &self,
        side: Side,
        event: u32,
        row: usize,
        key: Key,
        states: &mut LightStates,
        steps: &mut Steps<Rgb>,
    ) {
        let Station { cell, view, .. } = states.stations[row];
        let u = key.unit(dimension(event, LOBE));
        let field = 1.0 - self.defence;
        if u < self.defence {
            if steps.factor[row].largest() > 0.0 {
                let d = Vec3::from(states.rays[row].direction);
                let (f, kernel) = Self::toward(side, row, d, states);
                let density = self.field.mixed(&(cell, view), view.total, d, kernel, self.defence);
                steps.factor[row] =
                    if f.max_element() > 0.0 { (f / density).into() } else { Rgb::ZERO };
                (states.density[row], states.linked[row]) = (density, Linked::Also);
            }
            return;
        }
        let rest = ((u - self.defence) / field).min(1.0 - f32::EPSILON);
        let (u, v) = ([rest, key.unit(dimension(event, BOX))], key.pair(dimension(event, PLACE)));
        steps.factor[row] = Rgb::ZERO;
        let Some((d, density)) = self.field.pick(cell, &view, u, v) else { return };
        let (f, kernel) = Self::toward(side, row, d, states);
        if f.max_element() > 0.0 {
            let density = self.defence * kernel + field * density;
            steps.factor[row] = (f / density).into();
            (states.density[row], states.linked[row]) = (density, Linked::Also);
            let place = &states.places[row / WIDE];
            let leave =
                eight::leave(place.position, place.off, place.normal, eight::Vec3x8::splat(d))
                    .lane(row % WIDE);
            states.rays[row] = intrados_scene::Ray::new(leave, d, f32::INFINITY);
        }
    }
}

/// Rows in the order of their cells, those of one cell in their own order: walks of one cell
/// together, since the field is larger than the caches.
fn sort(stations: &[Station], cells: usize, order: &mut Vec<u32>) {
    // Those without a cell come last.
    let bucket = |station: &Station| (station.cell as usize).min(cells);
    let mut next = vec![0_u32; cells + 2];
    stations.iter().for_each(|s| next[bucket(s) + 1] += 1);
    (1..next.len()).for_each(|i| next[i] += next[i - 1]);
    order.resize(stations.len(), 0);
    for (row, station) in stations.iter().enumerate() {
        let place = &mut next[bucket(station)];
        order[*place as usize] = row as u32;
        *place += 1;
    }
}

/// Whether a field over places and directions is fine enough to steer by: mirrors and glass go
/// their own ways.
fn steerable(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::Lambert { .. } => true,
        Bsdf::Metallic { alpha, .. } => *alpha > 0.1,
        _ => false,
    }
}

impl TransportProblem for SteeredLight<'_> {
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

    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &LightStates,
        ends: &mut Ends<Rgb>,
    ) -> bool {
        self.plain.arrive(side, channel, states, ends)
    }

    fn expected_contribution(
        &self,
        side: Side,
        event: u32,
        weight: &[Rgb],
        states: &mut LightStates,
        expected: &mut [f32],
    ) -> bool {
        states.stations.clear();
        for row in 0..weight.len() {
            let station = self.station(side, event, row, states);
            states.stations.push(station);
        }
        let LightStates { order, stations, .. } = states;
        sort(stations, self.field.len(), order);
        for i in 0..weight.len() {
            let row = states.order[i] as usize;
            let station = &mut states.stations[row];
            if station.cell != NONE {
                station.view = self.field.look(station.cell, &station.view.spot);
                // A field that says that nothing arrives says nothing.
                station.cell = if station.view.total > 0.0 { station.cell } else { NONE };
            }
            expected[row] = self.expected_of(event, row, weight[row], states);
            if self.by_pixel && expected[row] > 0.0 {
                let first = &mut states.references[row];
                *first = if first.is_nan() { expected[row] } else { *first };
                expected[row] /= *first;
            }
        }
        true
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
        self.plain.link(side, channel, event, keys, states, links)
    }

    /// The density of going there by itself is asked for only where a link was not blocked.
    fn reveal(&self, side: Side, states: &mut LightStates, links: &mut Links<Rgb>) {
        self.plain.reveal(side, states, links);
        let LightStates { looks, stations, order, .. } = states;
        let mut of = vec![NONE; stations.len()];
        for (i, &row) in looks.rows[..looks.count].iter().enumerate() {
            let row = row as usize;
            if links.value[row].largest() > 0.0
                && stations[row].cell != NONE
                && links.link_density[row].is_finite()
            {
                of[row] = i as u32;
            }
        }
        for row in order.iter().map(|&row| row as usize).filter(|&row| of[row] != NONE) {
            let Station { cell, view, .. } = &stations[row];
            let d = Vec3::from(looks.rays[of[row] as usize].direction).normalize();
            links.kernel_density[row] = self.field.mixed(
                &(*cell, *view),
                view.total,
                d,
                links.kernel_density[row],
                self.defence,
            );
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
        self.plain.scatter(side, event, keys, states, steps);
        let LightStates { order, stations, .. } = states;
        sort(stations, self.field.len(), order);
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
