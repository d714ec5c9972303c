//! How fields are learnt: rounds of walks from both sides, each steered by what all before have found (the complementary dual
//! process, theory §4).

use glam::Vec3;
use intrados_stage::{Cancelled, Job, cpu_seconds};
use intrados_transport::{BATCH, Rule, Scores, Side, Tally, Value, Witness, Workspace, run_watched};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    Charts, LightField, NONE,
    build::{Extra, Lesson, build},
    steer::SteeredLight,
};
use crate::{LightProblem, LitScene, Rgb, Sensor, eight, problem::LightStates, sensor::Device};

/// Share of what lamps send straight to a surface that counts in the field there: links find most of it, but not where only a small
/// part of a lamp is seen.
const DIRECT: f32 = 0.25;
/// Share of ways that ignore the field: while it is young, and later.
const DEFENCE: [f32; 2] = [0.3, 0.2];

/// Both fields of one scene and its sensors, ready to steer.
#[derive(Debug)]
pub struct Guide {
    pub(crate) charts: Charts,
    /// By side: radiance steers the primal walk, importance the dual.
    pub(crate) fields: [LightField; 2],
    /// What a walk is expected to score: primal, one a sensor, then dual.
    pub(crate) readings: Vec<f32>,
    pub(crate) defence: f32,
    /// Whether the field steers, by side.
    steers: [bool; 2],
    /// Passes of each side in a round of both.
    pub(crate) turns: [u32; 2],
    fingerprint: u64,
    /// Whether every pixel is to be equally exact, not their mean.
    for_picture: bool,
    /// What a score in each sensor counts for the importance.
    gains: Vec<f32>,
    /// By side and key: how well the field foretold the last round's steps.
    pub(crate) residuals: [std::collections::BTreeMap<u32, Residual>; 2],
    /// What each round was like.
    pub rounds: Vec<Round>,
    /// CPU-seconds spent on it.
    pub cpu_seconds: f64,
}

/// Two guides that steer alike are one.
impl PartialEq for Guide {
    fn eq(&self, other: &Self) -> bool {
        self.fingerprint == other.fingerprint
    }
}

/// One side in one round of learning.
#[derive(Debug, Clone)]
pub struct Round {
    /// Which walks.
    pub side: Side,
    /// Scores of the walks, of the first sensor.
    pub scores: Scores,
    /// Their events; of several sensors the mean.
    pub events: u64,
    /// Whether a field steered them.
    pub steered: bool,
    /// CPU-seconds of the walks, and of building the other side's field after them.
    pub cpu_seconds: [f64; 2],
    /// Cells of the field that was built.
    pub cells: usize,
}

/// A step of a walk, while it is not known what it leads to.
struct Step {
    parent: u32,
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
    score: f32,
}

/// How well a field foretells what one step brings, by the place of departure: x = what came/what was promised has mean 1 if the field is right.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residual {
    /// Steps.
    pub n: u64,
    /// Σ x.
    pub sum: f64,
    /// Σ x².
    pub squares: f64,
    /// The largest x.
    pub largest: f64,
}

impl Residual {
    fn add(&mut self, x: f64) {
        self.n += 1;
        self.sum += x;
        self.squares += x * x;
        self.largest = self.largest.max(x);
    }

    fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.squares += other.squares;
        self.largest = self.largest.max(other.largest);
    }

    /// Mean of x.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum / self.n.max(1) as f64
    }

    /// Variance of x.
    #[must_use]
    pub fn variance(&self) -> f64 {
        (self.squares / self.n.max(1) as f64 - self.mean().powi(2)).max(0.0)
    }
}

/// Looks on at one batch and notes what it teaches.
pub(crate) struct Pupil<'p, 'a> {
    problem: &'p SteeredLight<'a>,
    side: Side,
    gains: &'p [f32],
    photon: f32,
    steps: Vec<Step>,
    /// By row the step that it is on.
    on: Vec<u32>,
    photons: Vec<Lesson>,
    residuals: std::collections::BTreeMap<u32, Residual>,
    /// Expected score of walks that have made their first flight.
    promised: f64,
    event: u32,
}

impl<'p, 'a> Pupil<'p, 'a> {
    /// `gains`: what a score in a bin of each sensor counts. `photon`: what a photon of weight 1 does.
    fn new(problem: &'p SteeredLight<'a>, side: Side, gains: &'p [f32], photon: f32) -> Self {
        Self {
            problem,
            side,
            gains,
            photon,
            steps: Vec::new(),
            on: Vec::new(),
            photons: Vec::new(),
            residuals: std::collections::BTreeMap::new(),
            promised: 0.0,
            event: 0,
        }
    }

    /// What the walks found of their own far field, every step one estimate.
    fn suffixes(&mut self) -> Vec<Lesson> {
        for i in (0..self.steps.len()).rev() {
            let (score, parent) = (self.steps[i].score, self.steps[i].parent);
            if parent != NONE {
                self.steps[parent as usize].score += score;
            }
        }
        let lesson = |step: &Step| Lesson {
            key: step.key,
            from: step.from,
            position: step.position,
            direction: step.direction,
            distance: step.distance,
            value: step.score / step.weight * step.spread,
            photon: false,
        };
        self.steps.iter().filter(|s| s.key != NONE).map(lesson).filter(|l| l.value.is_finite()).collect()
    }
}

impl<'a> Witness<SteeredLight<'a>> for Pupil<'_, 'a> {
    fn begin(&mut self, n: usize) {
        self.on.clear();
        self.on.resize(n, NONE);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.on = rows.iter().map(|&row| self.on[row as usize]).collect();
    }

    fn depart(&mut self, _: u32, states: &LightStates, weight: &[Rgb], promise: &[f32]) {
        for (row, &w) in weight.iter().enumerate() {
            let (ray, station, density) = (&states.rays[row], states.stations[row], states.density[row]);
            let spread = station.cos / density;
            self.steps.push(Step {
                parent: self.on[row],
                key: if spread > 0.0 { station.key } else { NONE },
                from: NONE,
                position: ray.origin.into(),
                direction: ray.direction.into(),
                distance: f32::INFINITY,
                spread,
                weight: w.reading() as f32,
                promise: promise.get(row).copied().unwrap_or(-1.0),
                score: 0.0,
            });
            self.on[row] = self.steps.len() as u32 - 1;
        }
    }

    fn land(&mut self, event: u32, states: &LightStates, weight: &[Rgb]) {
        self.event = event;
        for (row, w) in weight.iter().enumerate() {
            let place = &states.places[row / eight::WIDE];
            let (lane, step) = (row % eight::WIDE, &mut self.steps[self.on[row] as usize]);
            if !states.hits[row].is_hit() {
                continue;
            }
            let chart = self.problem.charts.of(states.hits[row].triangle);
            step.from = chart;
            step.distance = states.hits[row].t;
            // What comes from an eye, or from a lamp that is no surface, is found by links alone.
            let direct = event == 1;
            if direct && step.key == NONE {
                continue;
            }
            let (back, normal) = (place.back.lane(lane), place.normal.lane(lane));
            self.photons.push(Lesson {
                key: 2 * chart + u32::from(back.dot(normal) <= 0.0),
                from: if step.key == NONE { NONE } else { step.key / 2 },
                position: place.position.lane(lane),
                direction: back,
                distance: step.distance,
                value: w.reading() as f32 * self.photon * if direct { DIRECT } else { 1.0 },
                photon: true,
            });
        }
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        let sensor = match self.side {
            Side::Primal => 0,
            Side::Dual => self.problem.plain().sensor_of(bin).0,
        };
        let score = value.reading() as f32 * self.gains[sensor];
        if self.on[row] != NONE {
            self.steps[self.on[row] as usize].score += score;
        }
        if self.event <= 1 {
            self.promised += f64::from(score);
        }
    }

    fn weigh(&mut self, worth: &[f32]) {
        if self.event == 0 {
            return;
        }
        let reading = self.problem.reading();
        for (row, &worth) in worth.iter().enumerate() {
            let more = f64::from(worth.max(0.0) * reading);
            if self.event == 1 {
                self.promised += more;
            }
            let step = &self.steps[self.on[row] as usize];
            if step.promise > 0.0 && step.key != NONE {
                let x = (f64::from(step.score) + more) / f64::from(step.promise * reading);
                if x.is_finite() {
                    self.residuals.entry(step.key).or_default().add(x);
                }
            }
        }
    }
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
    pub(crate) fn new(reading: f32, side: Side, problem: &'p LightProblem<'p>, gains: &'p [f32]) -> Self {
        Self { reading: f64::from(reading), side, problem, gains, promise: Vec::new(), found: Vec::new(), largest: 0.0 }
    }

    /// The largest ratio of what a step brought to what was promised.
    pub(crate) fn largest(&self) -> f64 {
        self.largest
    }
}

impl<'a> Witness<SteeredLight<'a>> for Judge<'_> {
    fn begin(&mut self, n: usize) {
        self.promise = vec![-1.0; n];
        self.found = vec![0.0; n];
    }

    fn follow(&mut self, rows: &[u32]) {
        self.promise = rows.iter().map(|&row| self.promise[row as usize]).collect();
    }

    fn depart(&mut self, _: u32, _: &LightStates, weight: &[Rgb], promise: &[f32]) {
        self.promise.clear();
        self.promise.extend_from_slice(promise);
        self.found.clear();
        self.found.resize(weight.len(), 0.0);
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        let sensor = if self.side == Side::Primal { 0 } else { self.problem.sensor_of(bin).0 };
        self.found[row] += value.reading() * f64::from(self.gains[sensor]);
    }

    fn weigh(&mut self, worth: &[f32]) {
        for ((&promise, &found), &worth) in self.promise.iter().zip(&self.found).zip(worth) {
            let ratio = (found / self.reading + f64::from(worth.max(0.0))) / f64::from(promise);
            if promise > 0.0 && ratio.is_finite() {
                self.largest = self.largest.max(ratio);
            }
        }
    }
}

/// Scores a walk and a sensor.
struct Totals<'a> {
    problem: LightProblem<'a>,
    side: Side,
    pixels: Vec<f64>,
    totals: Vec<Vec<f64>>,
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

/// Whether fields steer walks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Steering {
    /// Where it pays, by the figure of merit measured while learning.
    #[default]
    Auto,
    /// Always.
    On,
    /// Never.
    Off,
}

/// What an event of a steered walk costs, in events of others: fixed, since decisions must not hang on a clock.
const STEERED_COST: f64 = 3.0;
/// Rounds of unsteered walks on each side before the first decision, and how many times worse steering may be then and yet be tried further.
const PATIENCE: (u32, f64) = (2, 3.0);
/// The worse side gets one walk's work in so many, for the certificate that only two sides give.
const CERTIFICATE: f64 = 6.0;

/// How much to learn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schedule {
    /// Walks of each side in the first round; every further one has twice as many.
    pub first: u64,
    /// Rounds.
    pub rounds: u32,
}

impl Default for Schedule {
    fn default() -> Self {
        Self { first: 8 * BATCH, rounds: 4 }
    }
}

/// What is being learnt.
struct School<'a> {
    lit: &'a LitScene,
    sensors: &'a [Sensor],
    rule: Rule,
    seed: u64,
    guide: Guide,
    extras: Vec<Extra>,
    /// By side of the walks that found them.
    photons: [Vec<Lesson>; 2],
    suffixes: [Vec<Lesson>; 2],
    walks: [u64; 2],
    /// What both sides say of each sensor, summed.
    seen: Vec<f64>,
}

/// Learns the fields of `sensors` in `lit`.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn learn(
    lit: &LitScene,
    sensors: &[Sensor],
    rule: Rule,
    seed: u64,
    steering: Steering,
    schedule: Schedule,
    job: &Job,
) -> Result<Guide, Cancelled> {
    let begin = cpu_seconds();
    let mut school = School::new(lit, sensors, rule, seed);
    let total = 2 * schedule.rounds as usize;
    for round in 0..schedule.rounds {
        for side in Side::BOTH {
            job.step(2 * round as usize + side as usize, total)?;
            school.guide.defence = if round < 2 { DEFENCE[0] } else { DEFENCE[1] };
            school.round(side, schedule.first << round);
        }
        if round == 0 {
            school.balance();
        }
        if steering == Steering::Auto && round >= PATIENCE.0 && school.guide.gain() * PATIENCE.1 < 1.0 {
            break;
        }
    }
    school.guide.defence = DEFENCE[1];
    school.read();
    let mut guide = school.guide;
    guide.decide(steering);
    guide.cpu_seconds = cpu_seconds() - begin;
    Ok(guide)
}

impl<'a> School<'a> {
    fn new(lit: &'a LitScene, sensors: &'a [Sensor], rule: Rule, seed: u64) -> Self {
        let extras = sensors.iter().map(|sensor| Device::from(sensor).extra()).collect();
        let guide = Guide {
            charts: Charts::new(lit),
            fields: [LightField::default(), LightField::default()],
            readings: vec![f32::NAN; sensors.len() + 1],
            defence: DEFENCE[0],
            steers: [true; 2],
            turns: [1; 2],
            fingerprint: 0,
            for_picture: false,
            gains: sensors.iter().map(|_| 1.0).collect(),
            residuals: Default::default(),
            rounds: Vec::new(),
            cpu_seconds: 0.0,
        };
        Self {
            lit,
            sensors,
            rule,
            seed,
            guide,
            extras,
            photons: [Vec::new(), Vec::new()],
            suffixes: [Vec::new(), Vec::new()],
            walks: [0; 2],
            seen: vec![0.0; sensors.len()],
        }
    }

    /// Lets every sensor count alike for the importance, by what unsteered walks have seen in it (FW-CADIS, Wagner et al. 2014).
    fn balance(&mut self) {
        let least = self.seen.iter().copied().filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
        if self.sensors.len() > 1 && least.is_finite() {
            self.guide.gains = self.seen.iter().map(|&x| (1.0 / x.max(least)) as f32).collect();
            // What was learnt by other gains is another importance.
            self.suffixes[Side::Dual as usize].clear();
        }
    }

    /// Walks of one side, then the other side's field.
    fn round(&mut self, side: Side, walks: u64) {
        let begin = cpu_seconds();
        self.read();
        let steered = !self.guide.fields[side as usize].is_empty();
        let heads: Vec<usize> = if side == Side::Primal { (0..self.sensors.len()).collect() } else { vec![0] };
        let each = (walks / heads.len() as u64).div_ceil(BATCH) * BATCH;
        self.photons[side as usize].clear();
        self.suffixes[side as usize].clear();
        let mut found: std::collections::BTreeMap<u32, Residual> = Default::default();
        let mut first = Scores::default();
        let mut all_events = 0;
        for &sensor in &heads {
            let from = self.walks[side as usize];
            let problem = self.guide.steer_all(self.lit, self.sensors, side, sensor);
            let gains = self.guide.gains(side, self.sensors);
            let photon = if side == Side::Primal { self.guide.gains[sensor] } else { 1.0 } / each as f32;
            let parts: Vec<_> = (from / BATCH..(from + each) / BATCH)
                .into_par_iter()
                .map_init(Workspace::default, |work, batch| {
                    let mut pupil = Pupil::new(&problem, side, &gains, photon);
                    let mut totals = self.totals(side, sensor);
                    let range = batch * BATCH..(batch + 1) * BATCH;
                    let events = run_watched(&problem, side, &self.rule, !self.seed, range, work, &mut totals, &mut pupil);
                    let mut scores = Scores::default();
                    totals.totals[0].iter().for_each(|&x| scores.add(x, (batch % 2) as usize));
                    let sums: Vec<f64> = totals.totals.iter().map(|x| x.iter().sum()).collect();
                    (sums, scores, events, pupil.suffixes(), pupil.photons, pupil.residuals)
                })
                .collect();
            for (sums, scores, events, suffixes, photons, residuals) in parts {
                for (k, sum) in sums.iter().enumerate() {
                    self.seen[sensor + k] += sum / each as f64;
                }
                if sensor == 0 {
                    first.merge(&scores);
                }
                all_events += events;
                self.suffixes[side as usize].extend(suffixes);
                self.photons[side as usize].extend(photons);
                for (key, residual) in residuals {
                    found.entry(key).or_default().merge(&residual);
                }
            }
        }
        self.walks[side as usize] += each;
        self.guide.residuals[side as usize] = found;
        let middle = cpu_seconds();
        let other = side.other() as usize;
        let lessons: Vec<Lesson> = self.photons[side as usize].iter().chain(&self.suffixes[other]).copied().collect();
        self.guide.fields[other] = build(self.lit, &self.guide.charts, &self.extras, lessons);
        let cells = self.guide.fields[other].len();
        let cpu = [middle - begin, cpu_seconds() - middle];
        self.guide.rounds.push(Round { side, steered, scores: first, events: all_events / heads.len() as u64, cpu_seconds: cpu, cells });
    }

    fn totals(&self, side: Side, sensor: usize) -> Totals<'_> {
        let of = if side == Side::Primal { &self.sensors[sensor..=sensor] } else { self.sensors };
        Totals {
            problem: LightProblem::new(self.lit, of),
            side,
            pixels: of.iter().map(|s| s.bins() as f64).collect(),
            totals: vec![vec![0.0; BATCH as usize]; of.len()],
        }
    }

    /// What walks steered by the fields as they are will score: what their first flights find and promise.
    fn read(&mut self) {
        let sides = (0..self.sensors.len()).map(|s| (Side::Primal, s)).chain([(Side::Dual, 0)]);
        for (i, (side, sensor)) in sides.enumerate() {
            self.guide.readings[i] = f32::NAN;
            if self.guide.fields[side as usize].is_empty() {
                continue;
            }
            let steered = self.guide.steer_all(self.lit, self.sensors, side, sensor).expecting(1.0);
            let gains = self.guide.gains(side, self.sensors);
            let rule = Rule { max_order: 2, ..self.rule };
            let promised: Vec<f64> = (0..2)
                .into_par_iter()
                .map(|batch| {
                    let mut pupil = Pupil::new(&steered, side, &gains, 0.0);
                    let mut totals = self.totals(side, sensor);
                    let range = batch * BATCH..(batch + 1) * BATCH;
                    run_watched(&steered, side, &rule, !self.seed ^ 1 << 40, range, &mut Workspace::default(), &mut totals, &mut pupil);
                    pupil.promised
                })
                .collect();
            let reading = (promised.iter().sum::<f64>() / (2 * BATCH) as f64) as f32;
            self.guide.readings[i] = if reading > 0.0 { reading } else { f32::NAN };
        }
    }
}

impl Round {
    /// Figure of merit a walk's work, on a scale of events.
    fn merit(&self) -> f64 {
        let scores = &self.scores;
        let rel_error = scores.std_error() / scores.mean();
        let work = self.events as f64 * if self.steered { STEERED_COST } else { 1.0 };
        let merit = 1.0 / (rel_error * rel_error * work);
        if merit.is_finite() { merit } else { 0.0 }
    }
}

impl Guide {
    /// Merit of the last round of one side, steered or not.
    fn merit(&self, side: Side, steered: bool) -> f64 {
        self.rounds.iter().rev().find(|r| r.side == side && r.steered == steered).map_or(0.0, Round::merit)
    }

    /// How many times better the better side is steered than the better one unsteered.
    fn gain(&self) -> f64 {
        let best = |steered: bool| Side::BOTH.map(|side| self.merit(side, steered)).into_iter().fold(0.0, f64::max);
        best(true) / best(false).max(f64::MIN_POSITIVE)
    }

    /// Decides what is steered, how the work is shared, and seals it.
    fn decide(&mut self, steering: Steering) {
        if steering == Steering::Auto {
            self.steers = Side::BOTH.map(|side| self.merit(side, true) > self.merit(side, false));
        }
        let merit = Side::BOTH.map(|side| self.merit(side, self.steers(side)));
        let (better, worse) = if merit[0] >= merit[1] { (0, 1) } else { (1, 0) };
        if merit[better] > 1.5 * merit[worse] {
            let work = Side::BOTH.map(|side| {
                let round = self.rounds.iter().rev().find(|r| r.side == side && r.steered == self.steers(side));
                round.map_or(1.0, |r| r.events as f64 / r.scores.walks() as f64 * if r.steered { STEERED_COST } else { 1.0 })
            });
            self.turns[better] = (CERTIFICATE * work[worse] / work[better]).round().clamp(1.0, 64.0) as u32;
        }
        let mut hash = blake(&[self.steers.map(u64::from), self.turns.map(u64::from)].concat());
        for field in &self.fields {
            hash = blake(&[hash, field.fingerprint()]);
        }
        self.fingerprint = hash.max(1);
    }

    /// The problem of one side (primal: of sensor `sensor` of all), steered.
    fn steer_all<'a>(&'a self, lit: &'a LitScene, sensors: &[Sensor], side: Side, sensor: usize) -> SteeredLight<'a> {
        self.steer(lit, if side == Side::Primal { &sensors[sensor..=sensor] } else { sensors }, side, sensor)
    }

    /// The problem of one side, steered. Primal: `of` holds the one sensor, which is number `sensor` of the guide's.
    pub(crate) fn steer<'a>(&'a self, lit: &'a LitScene, of: &[Sensor], side: Side, sensor: usize) -> SteeredLight<'a> {
        let reading = match side {
            Side::Primal => self.readings[sensor],
            Side::Dual => self.readings[self.readings.len() - 1],
        };
        let start = 2 * self.charts.len() as u32 + sensor as u32;
        SteeredLight::new(LightProblem::new(lit, of), &self.charts, &self.fields[side as usize], reading, self.defence, start)
            .by_pixel(self.for_picture && side == Side::Primal)
    }

    /// For pictures: every walk from the camera is measured by what its own pixel is expected to see, so that dark pixels converge as
    /// well as bright ones (FW-CADIS, Wagner et al. 2014, with 1/I_p taken from the walk's first promise).
    #[must_use]
    pub fn for_picture(mut self) -> Self {
        self.for_picture = true;
        self.fingerprint = blake(&[self.fingerprint, 1]);
        self
    }

    /// Whether the field steers the walks of a side.
    #[must_use]
    pub fn steers(&self, side: Side) -> bool {
        self.steers[side as usize]
    }

    /// A number that two guides share only if they steer alike: walks may be added up only then.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// What a score in a bin of each sensor counts, for the walks of one side.
    pub(crate) fn gains(&self, side: Side, sensors: &[Sensor]) -> Vec<f32> {
        match side {
            Side::Primal => vec![1.0],
            Side::Dual => self.gains.iter().zip(sensors).map(|(g, s)| g / s.bins() as f32).collect(),
        }
    }

    /// Sizes of both fields.
    #[must_use]
    pub fn sizes(&self) -> [[f64; 4]; 2] {
        [self.fields[0].sizes(), self.fields[1].sizes()]
    }

    /// Memory of the fields, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(LightField::bytes).sum()
    }
}

/// One surface's part in the variance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Culprit {
    /// The object whose surface it is.
    pub surface: String,
    /// Which side's walks.
    pub side: Side,
    /// Its part of relVar of one walk, by the error law: steps a walk times the variance of what they bring over what was promised.
    pub rel_var: f64,
    /// Mean of that ratio: 1 if the field is right.
    pub mean: f64,
    /// Its largest value.
    pub largest: f64,
    /// Steps a walk.
    pub steps: f64,
}

impl Guide {
    /// Where the variance comes from, worst first (theory §5, law D).
    #[must_use]
    pub fn explain(&self, lit: &LitScene) -> Vec<Culprit> {
        let mut out = Vec::new();
        for side in Side::BOTH {
            let walks = self.rounds.iter().rev().find(|r| r.side == side).map_or(1, |r| r.scores.walks());
            let mut by_surface: std::collections::BTreeMap<String, Residual> = Default::default();
            for (&key, residual) in &self.residuals[side as usize] {
                let chart = key as usize / 2;
                let name =
                    if chart < self.charts.len() { lit.object(self.charts.triangles(chart)[0]).name.clone() } else { "sensor".into() };
                by_surface.entry(name).or_default().merge(residual);
            }
            out.extend(by_surface.into_iter().map(|(surface, r)| {
                let steps = r.n as f64 / walks as f64;
                Culprit { surface, side, rel_var: steps * r.variance(), mean: r.mean(), largest: r.largest, steps }
            }));
        }
        out.sort_by(|a, b| b.rel_var.total_cmp(&a.rel_var));
        out
    }
}

/// A hash of numbers.
pub(crate) fn blake(numbers: &[u64]) -> u64 {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let hash = blake3::hash(&bytes);
    hash.as_bytes().iter().take(8).fold(0, |sum, &byte| sum << 8 | u64::from(byte))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use intrados_scene::Scene;
    use intrados_transport::{duality_z, verify::sidak_z};

    use super::*;
    use crate::{Exposure, Shard};

    fn lit(scene: &str) -> LitScene {
        let job = Job::default();
        LitScene::build(std::sync::Arc::new(Scene::load_bundled(scene, &job).unwrap()), &job).unwrap()
    }

    fn taught(lit: &LitScene, rounds: u32) -> Guide {
        let sensors = sensors(lit);
        learn(lit, &sensors, Rule::default(), 5, Steering::On, Schedule { first: 2 * BATCH, rounds }, &Job::default()).unwrap()
    }

    fn sensors(lit: &LitScene) -> Vec<Sensor> {
        let mut sensors = vec![Sensor::Camera(lit.scene.cameras[0].clone())];
        sensors.extend(lit.scene.meters.iter().cloned().map(Sensor::Meter));
        sensors
    }

    /// Scores of one side after `passes` passes, one a sensor; of the primal only the camera's.
    fn scores(lit: &LitScene, guide: Option<&Arc<Guide>>, side: Side, passes: u32) -> Vec<Scores> {
        let sensors = sensors(lit);
        let mut exposure = Exposure::new(&sensors, side, Rule::default(), 9, Shard::default(), u64::MAX, false);
        exposure.drop_film();
        if let Some(guide) = guide {
            exposure = exposure.steered_by(guide, 0);
        }
        exposure.advance(lit, &sensors, passes);
        exposure.scores
    }

    /// Theory §7: a field may hold anything. Random powers over four decades, and none at all in half of the cells: the mean must not move.
    #[test]
    fn a_wrong_field_costs_variance_and_no_bias() {
        let lit = lit("room");
        let truth = scores(&lit, None, Side::Primal, 32);
        let meters = scores(&lit, None, Side::Dual, 32);
        let mut z = Vec::new();
        for spoilt in 0..3_u64 {
            let mut guide = taught(&lit, 3);
            for field in &mut guide.fields {
                match spoilt {
                    0 => {}
                    1 => field.spoil(|k| (9.0 * intrados_stage::random::Key::new(3, k).unit(0) - 4.5).exp()),
                    _ => field.spoil(|k| if k % 2 == 0 { 0.0 } else { 1.0 }),
                }
            }
            let guide = Arc::new(guide);
            for side in Side::BOTH {
                let expected = if side == Side::Primal { &truth } else { &meters };
                for (got, expected) in scores(&lit, Some(&guide), side, 16).iter().zip(expected) {
                    z.push(duality_z(got.mean(), got.std_error(), expected.mean(), expected.std_error()));
                }
            }
        }
        let limit = sidak_z(z.len());
        assert!(z.len() >= 6 && z.iter().all(|z| z.abs() < limit), "{z:?}, limit {limit}");
    }

    /// The field's irradiance is the light's: where it is foretold, steps bring on average what was promised.
    #[test]
    fn steps_bring_what_was_promised() {
        let lit = lit("slit");
        let guide = taught(&lit, 4);
        for residuals in &guide.residuals {
            let mut all = Residual::default();
            residuals.values().for_each(|r| all.merge(r));
            // The field's own noise apart (some thousand lessons a cell), the mean is 1.
            assert!(all.n > 10_000 && (all.mean() - 1.0).abs() < 0.1, "{all:?}");
        }
    }

    /// Steering finds what plain walks seldom do: far smaller error for the same number of walks, and the same mean.
    #[test]
    fn the_slit_is_found() {
        let lit = lit("slit");
        let guide = Arc::new(taught(&lit, 4));
        let (plain, steered) = (scores(&lit, None, Side::Dual, 16), scores(&lit, Some(&guide), Side::Dual, 16));
        let z = duality_z(plain[0].mean(), plain[0].std_error(), steered[0].mean(), steered[0].std_error());
        assert!(
            z.abs() < 3.5 && steered[0].std_error() < 0.5 * plain[0].std_error(),
            "{z} {} {}",
            steered[0].std_error(),
            plain[0].std_error()
        );
    }

    /// The same lessons make the same field, whatever thread is first.
    #[test]
    fn learning_is_reproducible() {
        let lit = lit("door");
        let [a, b] =
            [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| taught(&lit, 3)));
        assert!(a.fields == b.fields && a.fingerprint() == b.fingerprint() && a.fingerprint() != 0);
        assert!(a.fingerprint() != taught(&lit, 2).fingerprint());
    }

    /// Two orders of size more than a kd-tree of equal cells could bear: a yard of 100 m, lit through a slot in a box of 20 cm that stands in
    /// it, with ribs of 1 mm. Fields stay small, know the ribs, and the readings stay right.
    #[test]
    fn a_large_scene_with_small_details_does_not_degenerate() {
        let rib = |k: u32| {
            let x = 0.02 + 0.012 * f64::from(k);
            format!("Box(name: \"rib {k}\", centre: ({}, 0.025, 0), size: (0.001, 0.05, 0.02), material: \"grey\"),", x)
        };
        let text = format!(
            "(schema: \"intrados.scene/1\", title: \"Yard\", materials: [(name: \"grey\", colour: (0.6, 0.6, 0.6))], shapes: [\
             Quad(name: \"ground\", corner: (-50, 0, -50), u: (0, 0, 100), v: (100, 0, 0), material: \"grey\"),\
             Quad(name: \"lid\", corner: (-0.1, 0.2, -0.1), u: (0.35, 0, 0), v: (0, 0, 0.2), material: \"grey\"),\
             Quad(name: \"back\", corner: (-0.1, 0, -0.1), u: (0.35, 0, 0), v: (0, 0.2, 0), material: \"grey\"),\
             Quad(name: \"front\", corner: (-0.1, 0, 0.1), u: (0, 0.2, 0), v: (0.35, 0, 0), material: \"grey\"),\
             Quad(name: \"side\", corner: (0.25, 0, -0.1), u: (0, 0, 0.2), v: (0, 0.2, 0), material: \"grey\"),\
             Quad(name: \"lamp\", corner: (-20, 6, -2), u: (4, 0, 0), v: (0, 0, 4), emission: (50, 50, 50)), {}], \
             cameras: [(name: \"eye\", position: (0.0, 0.1, 0.0), target: (0.2, 0.02, 0.0), fov_deg: 60, width: 16, height: 16)])",
            (0..16).map(rib).collect::<String>()
        );
        let path = std::env::temp_dir().join(format!("intrados-yard-{}.ron", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let job = Job::default();
        let scene = Scene::open(&path, &job).unwrap();
        std::fs::remove_file(&path).unwrap();
        let lit = LitScene::build(std::sync::Arc::new(scene), &job).unwrap();
        let guide = Arc::new(taught(&lit, 4));
        assert!(guide.bytes() < 16 << 20, "{} bytes", guide.bytes());
        let ribs = (0..guide.charts.len()).filter(|&c| lit.object(guide.charts.triangles(c)[0]).name.starts_with("rib"));
        let known = ribs.filter(|&c| {
            let middle = lit.corners(guide.charts.triangles(c)[0]).iter().sum::<Vec3>() / 3.0;
            [0, 1].iter().any(|side| guide.fields[0].cell(2 * c as u32 + side, middle) != NONE)
        });
        assert!(known.count() > 16, "ribs are unknown");
        let (plain, steered) = (scores(&lit, None, Side::Primal, 16), scores(&lit, Some(&guide), Side::Primal, 16));
        let z = duality_z(plain[0].mean(), plain[0].std_error(), steered[0].mean(), steered[0].std_error());
        assert!(z.abs() < 3.5, "{z}: {} {}", plain[0].mean(), steered[0].mean());
    }

    /// Shards that were steered by different fields are different problems.
    #[test]
    fn only_walks_of_equal_fields_are_added_up() {
        let lit = lit("room");
        let [one, same, other] = [2, 2, 3].map(|rounds| Arc::new(taught(&lit, rounds)));
        let sensors = sensors(&lit);
        let shard = |guide: Option<&Arc<Guide>>, index: u64| {
            let mut e = Exposure::new(&sensors, Side::Dual, Rule::default(), 9, Shard { index, of: 2 }, 4 * BATCH, false);
            if let Some(guide) = guide {
                e = e.steered_by(guide, 0);
            }
            e.advance(&lit, &sensors, 1);
            e
        };
        assert!(shard(Some(&one), 0).merge(&shard(Some(&same), 1)).is_ok());
        assert!(shard(Some(&one), 0).merge(&shard(Some(&other), 1)).is_err());
        assert!(shard(Some(&one), 0).merge(&shard(None, 1)).is_err());
    }
}
