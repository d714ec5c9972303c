//! Who looks on while walks are steered: the recorder that learns from them, the judge that only
//! compares promises with what came.

use std::collections::BTreeMap;

use glam::Vec3;
use intrados_transport::{Residual, Side, Tally, Trace, Value, WalkObserver};

use super::{NONE, build::TrainingSample, steer::SteeredLight};
use crate::{LightProblem, Rgb, eight, problem::LightStates};

/// Share of what lamps send straight to a surface that counts in the field there: links find most
/// of it, but not where only a small part of a lamp is seen.
const DIRECT: f32 = 0.25;

/// What one step of a walk was like.
struct Note {
    key: u32,
    /// Chart where it landed.
    from: u32,
    position: Vec3,
    direction: Vec3,
    distance: f32,
    /// cosθ over the density of the direction.
    spread: f32,
    /// Weight on the way.
    weight: f32,
    /// What it promised to score.
    promise: f32,
}

/// Looks on at one batch and notes what it teaches.
pub(crate) struct Recorder<'p, 'a> {
    problem: &'p SteeredLight<'a>,
    side: Side,
    /// What a score in a bin of each sensor counts.
    gains: &'p [f32],
    /// What a photon of weight 1 counts.
    photon: f32,
    trace: Trace<Note>,
    event: u32,
    /// What the walks bring to the other side's field.
    pub(crate) photons: Vec<TrainingSample>,
    /// By key: how well the field foretold their steps.
    pub(crate) residuals: BTreeMap<u32, Residual>,
    /// Expected score of the walks, once they have made their first flight.
    pub(crate) promised: f64,
}

impl<'p, 'a> Recorder<'p, 'a> {
    pub(crate) fn new(
        problem: &'p SteeredLight<'a>,
        side: Side,
        gains: &'p [f32],
        photon: f32,
    ) -> Self {
        let (trace, photons, residuals) = (Trace::default(), Vec::new(), BTreeMap::new());
        Self { problem, side, gains, photon, trace, event: 0, photons, residuals, promised: 0.0 }
    }

    /// What the walks found of their own far field, every step one estimate.
    pub(crate) fn suffixes(&mut self) -> Vec<TrainingSample> {
        let lesson = |(note, score): (Note, f64)| TrainingSample {
            key: note.key,
            from: note.from,
            position: note.position,
            direction: note.direction,
            distance: note.distance,
            value: score as f32 / note.weight * note.spread,
            photon: false,
        };
        std::mem::take(&mut self.trace)
            .suffixes()
            .map(lesson)
            .filter(|l| l.key != NONE && l.value.is_finite())
            .collect()
    }
}

impl<'a> WalkObserver<SteeredLight<'a>> for Recorder<'_, 'a> {
    fn begin(&mut self, n: usize) {
        self.trace.begin(n);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.trace.follow(rows);
    }

    fn depart(&mut self, _: u32, states: &LightStates, weight: &[Rgb], promise: &[f32]) {
        for (row, &w) in weight.iter().enumerate() {
            let (ray, station, density) =
                (&states.rays[row], states.stations[row], states.density[row]);
            let spread = station.cos / density;
            let note = Note {
                key: if spread > 0.0 { station.key } else { NONE },
                from: NONE,
                position: ray.origin.into(),
                direction: ray.direction.into(),
                distance: f32::INFINITY,
                spread,
                weight: w.reading() as f32,
                promise: promise.get(row).copied().unwrap_or(-1.0),
            };
            self.trace.step(row, note);
        }
    }

    fn land(&mut self, event: u32, states: &LightStates, weight: &[Rgb]) {
        self.event = event;
        for (row, w) in weight.iter().enumerate() {
            let (place, lane) = (&states.places[row / eight::WIDE], row % eight::WIDE);
            let Some((note, _)) = self.trace.at(row).filter(|_| states.hits[row].is_hit()) else {
                continue;
            };
            let chart = self.problem.charts.of(states.hits[row].triangle);
            (note.from, note.distance) = (chart, states.hits[row].t);
            // What comes from an eye, or from a lamp that is no surface, is found by links alone.
            let direct = event == 1;
            if direct && note.key == NONE {
                continue;
            }
            let (back, normal) = (place.back.lane(lane), place.normal.lane(lane));
            self.photons.push(TrainingSample {
                key: 2 * chart + u32::from(back.dot(normal) <= 0.0),
                from: if note.key == NONE { NONE } else { note.key / 2 },
                position: place.position.lane(lane),
                direction: back,
                distance: note.distance,
                value: w.reading() as f32 * self.photon * if direct { DIRECT } else { 1.0 },
                photon: true,
            });
        }
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        let score = gained(self.side, self.problem.plain(), self.gains, bin, value);
        self.trace.score(row, score);
        if self.event <= 1 {
            self.promised += score;
        }
    }

    fn weigh(&mut self, expected: &[f32]) {
        if self.event == 0 {
            return;
        }
        let reading = f64::from(self.problem.reading());
        for (row, &expected) in expected.iter().enumerate() {
            let more = f64::from(expected.max(0.0)) * reading;
            if self.event == 1 {
                self.promised += more;
            }
            let Some((note, score)) = self.trace.at(row) else { continue };
            let ratio = (score + more) / (f64::from(note.promise) * reading);
            if note.promise > 0.0 && note.key != NONE && ratio.is_finite() {
                self.residuals.entry(note.key).or_default().add(ratio);
            }
        }
    }
}

/// What a score counts, of a sensor that has its own gain.
fn gained(side: Side, problem: &LightProblem, gains: &[f32], bin: u32, value: Rgb) -> f64 {
    let sensor = if side == Side::Primal { 0 } else { problem.sensor_of(bin).0 };
    value.reading() * f64::from(gains[sensor])
}

/// Looks on for the largest residual alone.
pub(crate) struct Judge<'p> {
    reading: f64,
    side: Side,
    problem: &'p LightProblem<'p>,
    gains: &'p [f32],
    /// By row: what was promised, what has come.
    promise: Vec<f32>,
    found: Vec<f64>,
    largest: f64,
}

impl<'p> Judge<'p> {
    pub(crate) fn new(
        reading: f32,
        side: Side,
        problem: &'p LightProblem<'p>,
        gains: &'p [f32],
    ) -> Self {
        Self {
            reading: f64::from(reading),
            side,
            problem,
            gains,
            promise: Vec::new(),
            found: Vec::new(),
            largest: 0.0,
        }
    }

    /// The largest ratio of what a step brought to what was promised.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }
}

impl<'a> WalkObserver<SteeredLight<'a>> for Judge<'_> {
    fn begin(&mut self, n: usize) {
        self.promise = vec![-1.0; n];
        self.found = vec![0.0; n];
    }

    fn depart(&mut self, _: u32, _: &LightStates, weight: &[Rgb], promise: &[f32]) {
        self.promise.clear();
        self.promise.extend_from_slice(promise);
        self.found.clear();
        self.found.resize(weight.len(), 0.0);
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        self.found[row] += gained(self.side, self.problem, self.gains, bin, value);
    }

    fn weigh(&mut self, expected: &[f32]) {
        for ((&promise, &found), &expected) in self.promise.iter().zip(&self.found).zip(expected) {
            let ratio = (found / self.reading + f64::from(expected.max(0.0))) / f64::from(promise);
            if promise > 0.0 && ratio.is_finite() {
                self.largest = self.largest.max(ratio);
            }
        }
    }
}

/// Scores a walk and a sensor.
pub(crate) struct Totals<'a> {
    problem: LightProblem<'a>,
    side: Side,
    pixels: Vec<f64>,
    /// By sensor and walk.
    pub(crate) totals: Vec<Vec<f64>>,
}

impl<'a> Totals<'a> {
    /// Of `n` walks of `side` in `problem`, whose sensors have `pixels` pixels.
    pub(crate) fn new(problem: LightProblem<'a>, side: Side, pixels: Vec<f64>, n: u64) -> Self {
        let totals = vec![vec![0.0; n as usize]; pixels.len()];
        Self { problem, side, pixels, totals }
    }
}

impl Tally<Rgb> for Totals<'_> {
    fn score(&mut self, walk: u32, bin: u32, _: u32, value: Rgb) {
        let (sensor, pixels) = match self.side {
            Side::Primal => (0, 1.0),
            Side::Dual => {
                let sensor = self.problem.sensor_of(bin).0;
                (sensor, self.pixels[sensor])
            }
        };
        self.totals[sensor][walk as usize] += value.reading() / pixels;
    }
}
