//! How fields are learnt: rounds of walks from both sides, each steered by what all before have
//! found (the complementary dual process, theory §4; `intrados_transport::process` has what is
//! general in it).

use std::{collections::BTreeMap, sync::Arc};

use intrados_stage::{Cancelled, Job, cpu_seconds, random::Key};
use intrados_transport::{
    BATCH, Field, Process, STEERED_COST, Schedule, Scores, Side, Steering, WalkRule, Walked,
    alternate, watch,
};
use rayon::prelude::*;

use super::{
    Charts, Guide, LightField, NONE,
    build::{Charted, Extra, TrainingSample},
    lobe::Spot,
    recorder::{Recorder, Totals},
};
use crate::{
    LightProblem, LitScene, Sensor,
    bsdf::warp::{self, Discrete},
    lit::Source,
    sensor::Device,
};

/// Share of ways that ignore the field: in its first rounds, and later.
const DEFENCE: [f32; 2] = [0.3, 0.2];
/// Rounds in which a field is young.
const YOUNG: u32 = 2;
/// Walks by which it is told what steered walks will score.
const PILOT: u64 = 2 * BATCH;

/// Most points at which lamps are asked for their importance, in all.
const LAMP_POINTS: usize = 1 << 16;

/// Most events of a round: each teaches two lessons of 44 bytes.
const MOST_EVENTS: f64 = (1 << 22) as f64;
/// Events of a walk before any was walked.
const GUESS: f64 = 8.0;

/// How much to learn, and what it may cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Rounds and their walks.
    pub schedule: Schedule,
    /// Events of all rounds, those of steered walks counted as what they cost.
    pub events: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { schedule: Schedule::default(), events: u64::MAX }
    }
}

impl From<Schedule> for Effort {
    fn from(schedule: Schedule) -> Self {
        Self { schedule, ..Self::default() }
    }
}

impl Effort {
    /// What so many events pay for: as many rounds as the usual schedule has, of fewer walks, or
    /// fewer rounds; `None` where nothing can be learnt from so few.
    #[must_use]
    pub fn within(events: u64, usual: Schedule) -> Option<Self> {
        // Of both sides; all but the first round are steered.
        let cost = |rounds: u32| 2.0 * GUESS * (1.0 + STEERED_COST * f64::from((1 << rounds) - 2));
        let first = |rounds: u32| (events as f64 / cost(rounds)) as u64 / BATCH * BATCH;
        let rounds = (2..=usual.rounds).rev().find(|&rounds| first(rounds) >= BATCH)?;
        Some(Self { schedule: Schedule { first: first(rounds).min(usual.first), rounds }, events })
    }
}

/// What is being learnt.
struct Trainer<'a> {
    lit: &'a LitScene,
    sensors: &'a [Sensor],
    rule: WalkRule,
    seed: u64,
    guide: Guide,
    extras: Vec<Extra>,
    /// What walks of each side found of their own field in their last round, which was steered
    /// best.
    suffixes: [Vec<TrainingSample>; 2],
    /// What the last walks of either side found of the other's.
    photons: Vec<TrainingSample>,
    /// Events that may still be paid for, and by side those of a walk.
    left: f64,
    per_walk: [f64; 2],
    walks: [u64; 2],
    /// What both sides say of each sensor, summed.
    seen: Vec<f64>,
}

/// Learns the fields of `sensors` in `lit`, primal and dual walks in turns.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn learn(
    lit: &LitScene,
    sensors: &[Sensor],
    rule: WalkRule,
    seed: u64,
    steering: Steering,
    effort: impl Into<Effort>,
    job: &Job,
) -> Result<Guide, Cancelled> {
    let begin = cpu_seconds();
    let Effort { schedule, events } = effort.into();
    let mut trainer = Trainer {
        lit,
        sensors,
        rule,
        seed,
        guide: Guide::new(Arc::clone(lit.charts()), sensors.len()),
        extras: sensors.iter().map(|sensor| Device::from(sensor).extra()).collect(),
        suffixes: Default::default(),
        photons: Vec::new(),
        left: events as f64,
        per_walk: [GUESS; 2],
        walks: [0; 2],
        seen: vec![0.0; sensors.len()],
    };
    let course = alternate(&mut trainer, schedule, steering, job)?;
    trainer.guide.defence = DEFENCE[1];
    trainer.read();
    let mut guide = trainer.guide;
    guide.seal(course);
    guide.cpu_seconds = cpu_seconds() - begin;
    Ok(guide)
}

impl Process for Trainer<'_> {
    fn walk(&mut self, number: u32, side: Side, walks: u64) -> Walked {
        if number == 1 && side == Side::Primal {
            self.balance();
        }
        if number == 0 {
            // Both sides show first what they can do alone, or nobody could say what steering
            // brings.
            self.guide.fields[side as usize] = LightField::default();
            self.guide.lamps = None;
        }
        self.guide.defence = DEFENCE[usize::from(number >= YOUNG)];
        self.read();
        let steered = !self.guide.fields[side as usize].is_empty();
        let (scores, events) = self.send(side, walks);
        let all = events * self.heads(side);
        self.left -= all as f64 * if steered { STEERED_COST } else { 1.0 };
        self.per_walk[side as usize] = all as f64 / walks as f64;
        Walked { steered, scores, events }
    }

    fn teach(&mut self, side: Side) -> usize {
        let mut lessons = std::mem::take(&mut self.photons);
        // The side's next round brings new ones.
        lessons.append(&mut std::mem::take(&mut self.suffixes[side as usize]));
        let domain = Charted { lit: self.lit, charts: &self.guide.charts, extras: &self.extras };
        let field = LightField::learn(&domain, lessons);
        if side == Side::Dual {
            self.guide.lamps = lamps(self.lit, &self.guide.charts, &field);
        }
        let cells = field.len();
        self.guide.fields[side as usize] = field;
        cells
    }

    /// Bounded by what may be spent, and by memory.
    fn affords(&self, number: u32, side: Side, walks: u64) -> u64 {
        let cost = if number == 0 { 1.0 } else { STEERED_COST };
        let events = (self.left / cost).min(MOST_EVENTS);
        let least = self.heads(side) * BATCH;
        // A walk of the first round is not known yet.
        let most = (events / self.per_walk[side as usize]).max(0.0) as u64 / least * least;
        if number == 0 { walks.min(most.max(least)) } else { walks.min(most) }
    }
}

impl Trainer<'_> {
    /// At how many sensors walks of a side start.
    fn heads(&self, side: Side) -> u64 {
        if side == Side::Primal { self.sensors.len() as u64 } else { 1 }
    }

    /// Walks of one side, shared among the sensors if they start there; keeps what they teach.
    /// Scores of the first sensor, and the mean events.
    fn send(&mut self, side: Side, walks: u64) -> (Scores, u64) {
        let heads = self.heads(side) as usize;
        let each = (walks / heads as u64).div_ceil(BATCH) * BATCH;
        let range = self.walks[side as usize]..self.walks[side as usize] + each;
        let (mut photons, mut suffixes, mut residuals) = (Vec::new(), Vec::new(), BTreeMap::new());
        let mut all = vec![Scores::default(); self.sensors.len()];
        let mut events = 0;
        let (lit, sensors) = (self.lit, self.sensors);
        for sensor in 0..heads {
            let problem = self.guide.steer_all(lit, sensors, side, sensor);
            let gains = self.guide.gains(side, sensors);
            let photon =
                if side == Side::Primal { self.guide.gains[sensor] } else { 1.0 } / each as f32;
            let looks_on = |n| {
                (
                    totals(lit, sensors, side, sensor, n),
                    Recorder::new(&problem, side, &gains, photon),
                )
            };
            let parts = watch(&problem, side, &self.rule, !self.seed, range.clone(), looks_on);
            for mut part in parts {
                for (k, totals) in part.tally.totals.iter().enumerate() {
                    self.seen[sensor + k] += totals.iter().sum::<f64>() / each as f64;
                    let mut scores = Scores::default();
                    let half = (part.walks.start / BATCH % 2) as usize;
                    totals.iter().for_each(|&x| scores.add(x, half));
                    all[sensor + k].merge(&scores);
                }
                events += part.events;
                suffixes.extend(part.observer.suffixes());
                photons.append(&mut part.observer.photons);
                for (key, residual) in part.observer.residuals {
                    residuals
                        .entry(key)
                        .or_insert_with(intrados_transport::Residual::default)
                        .merge(&residual);
                }
            }
        }
        self.walks[side as usize] = range.end;
        self.suffixes[side as usize] = suffixes;
        self.guide.residuals[side as usize] = residuals;
        let first = all[0].clone();
        for (scores, sensor) in all.iter_mut().zip(self.sensors) {
            // Walks from a camera go through its picture in order: only whole sweeps are a reading
            // of it.
            if side == Side::Primal && !each.is_multiple_of(sensor.bins() as u64) {
                *scores = Scores::default();
            }
        }
        self.guide.last[side as usize] = all;
        self.photons = photons;
        (first, events / heads as u64)
    }

    /// Lets every sensor count alike for the importance, by what unsteered walks have seen in it
    /// (FW-CADIS, Wagner et al. 2014).
    fn balance(&mut self) {
        let least = self.seen.iter().copied().filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
        if self.sensors.len() > 1 && least.is_finite() {
            self.guide.gains = self.seen.iter().map(|&x| (1.0 / x.max(least)) as f32).collect();
            // What was learnt by other gains is another importance.
            self.suffixes[Side::Dual as usize].clear();
        }
    }

    /// What walks steered by the fields as they are will score: what their first flights find and
    /// promise (⟨g, Φ̃⟩; the mean of scores would tell less, and late).
    fn read(&mut self) {
        let sides = (0..self.sensors.len()).map(|s| (Side::Primal, s)).chain([(Side::Dual, 0)]);
        for (i, (side, sensor)) in sides.enumerate() {
            self.guide.readings[i] = f32::NAN;
            if self.guide.fields[side as usize].is_empty() {
                continue;
            }
            let problem = self.guide.steer_all(self.lit, self.sensors, side, sensor).expecting(1.0);
            let gains = self.guide.gains(side, self.sensors);
            let rule = WalkRule { max_order: 2, ..self.rule };
            let looks_on = |n| {
                (
                    totals(self.lit, self.sensors, side, sensor, n),
                    Recorder::new(&problem, side, &gains, 0.0),
                )
            };
            let parts = watch(&problem, side, &rule, !self.seed ^ 1 << 40, 0..PILOT, looks_on);
            let reading = (parts.iter().map(|part| part.observer.promised).sum::<f64>()
                / PILOT as f64) as f32;
            self.guide.readings[i] = if reading > 0.0 { reading } else { f32::NAN };
        }
    }
}

/// By what walks from the lamps choose their lamp: half by flux, half by flux times the importance
/// that the field says arrives there. Sources of which it says nothing count as the others do on
/// average; `None` where there is nothing to choose.
fn lamps(lit: &LitScene, charts: &Charts, field: &LightField) -> Option<Discrete> {
    let by_flux = lit.choice.as_ref().filter(|choice| choice.len() > 1 && !field.is_empty())?;
    let points = (LAMP_POINTS / by_flux.len()).clamp(1, 16) as u64;
    let importance = |source: usize| {
        let Source::Triangle(triangle) = lit.sources[source] else { return None };
        let total = |k: u64| {
            let position =
                lit.place(triangle, warp::triangle(Key::new(k, source as u64).pair(0)))[0];
            let cell = field.cell(2 * charts.of(triangle), position);
            (cell != NONE)
                .then(|| field.look(cell, &Spot { position, normal: lit.normal(triangle) }).total)
        };
        let known: Vec<f32> = (0..points).filter_map(total).collect();
        (!known.is_empty()).then(|| known.iter().sum::<f32>() / known.len() as f32)
    };
    let known: Vec<Option<f32>> = (0..by_flux.len()).into_par_iter().map(importance).collect();
    let share = |i: usize| by_flux.probability(i);
    let (mut sum, mut weight) = (0.0, 0.0);
    for (i, importance) in known.iter().enumerate().filter_map(|(i, known)| Some((i, (*known)?))) {
        sum += share(i) * importance;
        weight += share(i);
    }
    let mean = if sum > 0.0 { sum / weight } else { return None };
    Discrete::new(
        &known
            .iter()
            .enumerate()
            .map(|(i, known)| share(i) * (0.5 + 0.5 * known.unwrap_or(mean) / mean))
            .collect::<Vec<_>>(),
    )
}

/// The scores of `n` walks of one side, primal of sensor `sensor`.
fn totals<'a>(
    lit: &'a LitScene,
    sensors: &[Sensor],
    side: Side,
    sensor: usize,
    n: u64,
) -> Totals<'a> {
    let of = if side == Side::Primal { &sensors[sensor..=sensor] } else { sensors };
    Totals::new(LightProblem::new(lit, of), side, of.iter().map(|s| s.bins() as f64).collect(), n)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use intrados_scene::Scene;
    use intrados_transport::{Residual, duality_z, verify::sidak_z};

    use super::*;
    use crate::{Exposure, Shard};

    fn lit(scene: &str) -> LitScene {
        let job = Job::default();
        LitScene::build(std::sync::Arc::new(Scene::load_bundled(scene, &job).unwrap()), &job)
            .unwrap()
    }

    fn taught(lit: &LitScene, rounds: u32) -> Guide {
        let sensors = sensors(lit);
        learn(
            lit,
            &sensors,
            WalkRule::default(),
            5,
            Steering::On,
            Schedule { first: 2 * BATCH, rounds },
            &Job::default(),
        )
        .unwrap()
    }

    fn sensors(lit: &LitScene) -> Vec<Sensor> {
        let mut sensors = vec![Sensor::Camera(lit.scene.cameras[0].clone())];
        sensors.extend(lit.scene.meters.iter().cloned().map(Sensor::Meter));
        sensors
    }

    /// Scores of one side after `passes` passes, one a sensor; of the primal only the camera's.
    fn scores(lit: &LitScene, guide: Option<&Arc<Guide>>, side: Side, passes: u32) -> Vec<Scores> {
        let sensors = sensors(lit);
        let mut exposure = Exposure::new(
            lit,
            &sensors,
            side,
            WalkRule::default(),
            9,
            Shard::default(),
            u64::MAX,
            false,
        );
        exposure.drop_film();
        if let Some(guide) = guide {
            exposure = exposure.steered_by(guide, 0);
        }
        exposure.advance(lit, &sensors, passes);
        exposure.scores
    }

    /// Theory §7: a field may hold anything. Random powers over four decades, and none at all in
    /// half of the cells: the mean must not move.
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
                    1 => field.spoil(|k| {
                        (9.0 * intrados_stage::random::Key::new(3, k).unit(0) - 4.5).exp()
                    }),
                    _ => field.spoil(|k| if k % 2 == 0 { 0.0 } else { 1.0 }),
                }
            }
            let guide = Arc::new(guide);
            for side in Side::BOTH {
                let expected = if side == Side::Primal { &truth } else { &meters };
                for (got, expected) in scores(&lit, Some(&guide), side, 16).iter().zip(expected) {
                    z.push(duality_z(
                        got.mean(),
                        got.std_error(),
                        expected.mean(),
                        expected.std_error(),
                    ));
                }
            }
        }
        let limit = sidak_z(z.len());
        assert!(z.len() >= 6 && z.iter().all(|z| z.abs() < limit), "{z:?}, limit {limit}");
    }

    /// The field's irradiance is the light's: where it is foretold, steps bring on average what was
    /// promised.
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

    /// Steering finds what plain walks seldom do: far smaller error for the same number of walks,
    /// and the same mean.
    #[test]
    fn the_slit_is_found() {
        let lit = lit("slit");
        let guide = Arc::new(taught(&lit, 4));
        let (plain, steered) =
            (scores(&lit, None, Side::Dual, 16), scores(&lit, Some(&guide), Side::Dual, 16));
        let z = duality_z(
            plain[0].mean(),
            plain[0].std_error(),
            steered[0].mean(),
            steered[0].std_error(),
        );
        assert!(
            z.abs() < 3.5 && steered[0].std_error() < 0.5 * plain[0].std_error(),
            "{z} {} {}",
            steered[0].std_error(),
            plain[0].std_error()
        );
    }

    /// A room behind a wall has a lamp nine times as bright as the one before it: walks start at
    /// the dim one, which the camera sees by, and the reading stays.
    #[test]
    fn lamps_are_chosen_by_what_they_light() {
        let quad = |name: &str, corner: &str, u: &str, v: &str, light: f32| {
            let shine = if light > 0.0 {
                format!("emission: ({light}, {light}, {light})")
            } else {
                "material: \"grey\"".into()
            };
            format!("Quad(name: \"{name}\", corner: {corner}, u: {u}, v: {v}, {shine}),")
        };
        let rooms: String = [0.0, 2.0]
            .map(|x| {
                let name = |part: &str| format!("{part} {x}");
                let at = |dx: f32, y: f32, z: f32| format!("({}, {y}, {z})", x + dx);
                quad(&name("floor"), &at(0.0, 0.0, 0.0), "(0, 0, 1)", "(1, 0, 0)", 0.0)
                    + &quad(&name("ceiling"), &at(0.0, 1.0, 0.0), "(1, 0, 0)", "(0, 0, 1)", 0.0)
                    + &quad(&name("left"), &at(0.0, 0.0, 0.0), "(0, 1, 0)", "(0, 0, 1)", 0.0)
                    + &quad(&name("right"), &at(1.0, 0.0, 0.0), "(0, 0, 1)", "(0, 1, 0)", 0.0)
                    + &quad(&name("back"), &at(0.0, 0.0, 0.0), "(1, 0, 0)", "(0, 1, 0)", 0.0)
                    + &quad(&name("front"), &at(0.0, 0.0, 1.0), "(0, 1, 0)", "(1, 0, 0)", 0.0)
                    + &quad(
                        &name("lamp"),
                        &at(0.4, 0.99, 0.4),
                        "(0.2, 0, 0)",
                        "(0, 0, 0.2)",
                        if x > 0.0 { 9.0 } else { 1.0 },
                    )
            })
            .concat();
        let text = format!(
            "(schema: \"intrados.scene/1\", title: \"Two rooms\", materials: [(name: \"grey\", colour: (0.6, 0.6, 0.6))], shapes: [{rooms}], \
             cameras: [(name: \"eye\", position: (0.1, 0.5, 0.1), target: (0.9, 0.3, 0.9), fov_deg: 60, width: 16, height: 16)])"
        );
        let path = std::env::temp_dir().join(format!("intrados-rooms-{}.ron", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let job = Job::default();
        let scene = Scene::open(&path, &job).unwrap();
        std::fs::remove_file(&path).unwrap();
        let lit = LitScene::build(std::sync::Arc::new(scene), &job).unwrap();
        let guide = Arc::new(taught(&lit, 3));
        let lamps = guide.lamps.as_ref().expect("lamps to choose from");
        // Two triangles a lamp; .1 of the flux, half of the choice by importance.
        let dim = lamps.probability(0) + lamps.probability(1);
        assert!((dim - 0.55).abs() < 0.05, "{dim}");
        let (plain, steered) = (
            &scores(&lit, None, Side::Dual, 16)[0],
            &scores(&lit, Some(&guide), Side::Dual, 16)[0],
        );
        let z = duality_z(plain.mean(), plain.std_error(), steered.mean(), steered.std_error());
        assert!(
            z.abs() < 3.5 && steered.std_error() < plain.std_error(),
            "{z} {} {}",
            plain.std_error(),
            steered.std_error()
        );
    }

    /// Walks of learning are readings as well, where they are of a whole picture.
    #[test]
    fn lessons_are_readings() {
        let lit = lit("slit");
        let guide = taught(&lit, 4);
        for side in Side::BOTH {
            let plain = scores(&lit, None, side, 32);
            let z: Vec<f64> = plain
                .iter()
                .enumerate()
                .filter_map(|(i, plain)| Some((plain, guide.lesson(side, i)?)))
                .map(|(plain, lesson)| {
                    duality_z(plain.mean(), plain.std_error(), lesson.mean(), lesson.std_error())
                })
                .collect();
            assert!(!z.is_empty() && z.iter().all(|z| z.abs() < 3.5), "{side:?} {z:?}");
        }
    }

    /// The same lessons make the same field, whatever thread is first.
    #[test]
    fn learning_is_reproducible() {
        let lit = lit("door");
        let [a, b] = [1, 2].map(|threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| taught(&lit, 3))
        });
        assert!(a.fields == b.fields && a.fingerprint() == b.fingerprint() && a.fingerprint() != 0);
        assert!(a.fingerprint() != taught(&lit, 2).fingerprint());
    }

    /// Two orders of size more than a kd-tree of equal cells could bear: a yard of 100 m, lit
    /// through a slot in a box of 20 cm that stands in it, with ribs of 1 mm. Fields stay small,
    /// know the ribs, and the readings stay right.
    #[test]
    fn a_large_scene_with_small_details_does_not_degenerate() {
        let rib = |k: u32| {
            let x = 0.02 + 0.012 * f64::from(k);
            format!(
                "Box(name: \"rib {k}\", centre: ({}, 0.025, 0), size: (0.001, 0.05, 0.02), material: \"grey\"),",
                x
            )
        };
        let text = format!(
            "(schema: \"intrados.scene/1\", title: \"Yard\", materials: [(name: \"grey\", colour: (0.6, 0.6, 0.6))], shapes: [\
             Quad(name: \"domain\", corner: (-50, 0, -50), u: (0, 0, 100), v: (100, 0, 0), material: \"grey\"),\
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
        let ribs = (0..guide.charts.len())
            .filter(|&c| lit.object(guide.charts.triangles(c)[0]).name.starts_with("rib"));
        let known = ribs.filter(|&c| {
            let middle = lit.corners(guide.charts.triangles(c)[0]).iter().sum::<Vec3>() / 3.0;
            [0, 1].iter().any(|side| guide.fields[0].cell(2 * c as u32 + side, middle) != NONE)
        });
        assert!(known.count() > 16, "ribs are unknown");
        // Steering does not pay here (lamp and camera are joined by links alone), and few walks
        // underrate its error: then they must say so.
        let plain = &scores(&lit, None, Side::Primal, 16)[0];
        for (passes, must_agree) in [(16, false), (192, true)] {
            let steered = &scores(&lit, Some(&guide), Side::Primal, passes)[0];
            let z = duality_z(plain.mean(), plain.std_error(), steered.mean(), steered.std_error());
            let honest = !must_agree && !steered.converged().holds();
            assert!(z.abs() < 3.5 || honest, "{passes}: {z}: {} {}", plain.mean(), steered.mean());
        }
    }

    /// Shards that were steered by different fields are different problems.
    #[test]
    fn only_walks_of_equal_fields_are_added_up() {
        let lit = lit("room");
        let [one, same, other] = [2, 2, 3].map(|rounds| Arc::new(taught(&lit, rounds)));
        let sensors = sensors(&lit);
        let shard = |guide: Option<&Arc<Guide>>, index: u64| {
            let mut e = Exposure::new(
                &lit,
                &sensors,
                Side::Dual,
                WalkRule::default(),
                9,
                Shard { index, of: 2 },
                4 * BATCH,
                false,
            );
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
