//! One side of one problem, walked pass by pass: what every image and every reading is made of.

use std::sync::Arc;

use intrados_stage::cpu_seconds;
use intrados_transport::{
    Arrivals, BATCH, Nobody, Reach, Scores, Side, Tally, TransportProblem, Value, WalkEstimate,
    WalkObserver, WalkRule, Workspace, run_watched,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    Film, Guide, LightProblem, LitScene, Rgb, Sensor,
    field::recorder::Judge,
    problem::LightStates,
    reach::{Landings, is_watched},
};

/// Walks in a pass: a few milliseconds of work.
pub const PASS: u64 = 4 * BATCH;

/// Which passes belong to a run: `first`, `first + stride`, … (one shard of `stride`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of the shard, from 0.
    pub index: u64,
    /// How many shards there are.
    pub of: u64,
}

impl Default for Shard {
    fn default() -> Self {
        Self { index: 0, of: 1 }
    }
}

/// Passes that an accumulator holds: `count` of shard `shard`, from its first one on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Passes {
    /// Of which shard.
    pub shard: Shard,
    /// How many.
    pub count: u64,
    /// How many batches of the pass after them are done already.
    pub batches: u64,
}

impl Passes {
    /// The pass that comes next, where there is one before walk `limit`.
    fn next(self, limit: u64) -> Option<u64> {
        let pass = self.shard.index + self.count * self.shard.of;
        (pass.saturating_mul(PASS) < limit).then_some(pass)
    }
}

/// The state of one side of one problem: sums, scores, how far it is. Everything that a checkpoint
/// holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// From which side.
    pub side: Side,
    /// How walks score.
    pub rule: WalkRule,
    /// Seed of all its random numbers.
    pub seed: u64,
    /// The picture, where the sensors have one: of the first camera among them.
    pub film: Option<Film>,
    /// Which sensor `film` is of.
    film_of: Option<usize>,
    /// Per sensor the scores of all walks.
    pub scores: Vec<Scores>,
    /// Passes done, by whom; one entry unless accumulators were merged.
    pub passes: Vec<Passes>,
    /// Walks done.
    pub walks: u64,
    /// Walks at which it ends; the last pass is cut there.
    pub limit: u64,
    /// Fingerprint of the field that steers its walks; 0 where none does.
    pub field: u64,
    /// What steers them, and which of its sensors this is.
    #[serde(skip)]
    guide: Option<(Arc<Guide>, usize)>,
    /// Largest ratio of what a step brought to what the field had promised; 0 where no field
    /// steers.
    pub max_residual: f64,
    /// Where walks have been; `None` where nobody asks.
    pub reach: Option<Reach>,
    /// Events so far: a measure of work that is the same on every machine.
    pub events: u64,
    /// CPU-seconds of the process while this was advanced. Not part of the result: differs from run
    /// to run.
    pub cpu_seconds: f64,
}

/// What one batch brings.
struct Part {
    scores: Vec<Scores>,
    /// Primal: one value a walk.
    values: Vec<Rgb>,
    /// Primal: per order and walk. Dual: empty.
    orders: Vec<Vec<Rgb>>,
    /// Dual: (pixel, walk, order, value), in order of walk and pixel.
    splats: Vec<(u32, u32, u32, Rgb)>,
    events: u64,
    max_residual: f64,
    /// Cells where its walks arrived, and with what weight.
    arrivals: Arrivals,
}

/// Tally of a batch.
struct Sums<'a> {
    problem: &'a LightProblem<'a>,
    side: Side,
    film_of: Option<usize>,
    first: u32,
    totals: Vec<Vec<f64>>,
    pixels: Vec<f64>,
    values: Vec<Rgb>,
    /// Primal pictures: of each value the luminance of lamps seen directly, which is no matter of
    /// chance.
    direct: Vec<f64>,
    orders: Vec<Vec<Rgb>>,
    splats: Vec<(u32, u32, u32, Rgb)>,
}

impl Tally<Rgb> for Sums<'_> {
    #[inline]
    fn score(&mut self, walk: u32, bin: u32, order: u32, value: Rgb) {
        match self.side {
            Side::Primal => {
                self.values[walk as usize] += value;
                if order == 0 && self.film_of.is_some() {
                    self.direct[walk as usize] += value.reading();
                }
                if let Some(last) = self.orders.len().checked_sub(1) {
                    self.orders[(order as usize).min(last)][walk as usize] += value;
                }
            }
            Side::Dual => {
                let (sensor, pixel) = if self.totals.len() == 1 {
                    (0, bin - self.first)
                } else {
                    self.problem.sensor_of(bin)
                };
                self.totals[sensor][walk as usize] += value.reading() / self.pixels[sensor];
                if self.film_of == Some(sensor) {
                    self.splats.push((pixel, walk, order, value));
                }
            }
        }
    }
}

impl Exposure {
    /// An empty exposure of `sensors` in `lit`; `limit` walks at most (`u64::MAX`: until told to
    /// stop).
    #[must_use]
    #[allow(clippy::too_many_arguments, reason = "the whole of what says which work it is")]
    pub fn new(
        lit: &LitScene,
        sensors: &[Sensor],
        side: Side,
        rule: WalkRule,
        seed: u64,
        shard: Shard,
        limit: u64,
        with_orders: bool,
    ) -> Self {
        let sensors = if side == Side::Primal { &sensors[..1.min(sensors.len())] } else { sensors };
        let film_of = sensors.iter().position(|s| matches!(s, Sensor::Camera(_)));
        let film = sensors.iter().find_map(|s| match s {
            Sensor::Camera(c) => {
                Some(Film::new([c.width, c.height], lit.scale(), side == Side::Primal, with_orders))
            }
            Sensor::Meter(_) => None,
        });
        Self {
            side,
            rule,
            seed,
            film,
            film_of,
            scores: vec![Scores::default(); sensors.len()],
            passes: vec![Passes { shard, count: 0, batches: 0 }],
            walks: 0,
            limit,
            field: 0,
            guide: None,
            max_residual: 0.0,
            reach: None,
            events: 0,
            cpu_seconds: 0.0,
        }
    }

    /// Lets `guide` steer the walks from the first one on, if it steers this side. A primal
    /// exposure is of sensor `sensor` of the guide's.
    #[must_use]
    pub(crate) fn steered_by(mut self, guide: &Arc<Guide>, sensor: usize) -> Self {
        if guide.steers(self.side) {
            self.field = guide.fingerprint();
            self.guide = Some((Arc::clone(guide), sensor));
            self.reach = self.reach.map(|_| Reach::of_ways(f64::from(guide.defence)));
        }
        self
    }

    /// Notes where walks arrive, from the first one on: what [`intrados_transport::unmet`]
    /// compares.
    #[must_use]
    pub fn noting_reach(mut self) -> Self {
        let free = self.guide.as_ref().map_or(1.0, |(guide, _)| f64::from(guide.defence));
        self.reach = Some(Reach::of_ways(free));
        self
    }

    /// The state `other` of this very work, which knows no guide if it comes from a file.
    pub(crate) fn continued(&self, other: Self) -> Self {
        Self { guide: self.guide.clone(), ..other }
    }

    /// Forgets the picture: only readings are wanted.
    pub(crate) fn drop_film(&mut self) {
        (self.film, self.film_of) = (None, None);
    }

    /// Whether all walks up to the limit are done.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.next_pass().is_none()
    }

    /// Share done of a run with a limit.
    #[must_use]
    pub fn done(&self) -> f64 {
        if self.limit == u64::MAX {
            0.0
        } else {
            self.walks as f64 / (self.limit as f64 / self.passes[0].shard.of as f64)
        }
    }

    /// Shards whose walks are not all done.
    pub fn unfinished(&self) -> impl Iterator<Item = Shard> {
        self.passes
            .iter()
            .filter(|passes| passes.next(self.limit).is_some())
            .map(|passes| passes.shard)
    }

    fn next_pass(&self) -> Option<u64> {
        self.passes[0].next(self.limit)
    }

    /// The walks of the next batch, which counts as done from now on.
    fn next_batch(&mut self) -> Option<std::ops::Range<u64>> {
        let pass = self.next_pass()?;
        let done = &mut self.passes[0];
        let begin = pass * PASS + done.batches * BATCH;
        let end = (begin + BATCH).min(self.limit);
        done.batches += 1;
        if done.batches == PASS / BATCH || end == self.limit {
            (done.count, done.batches) = (done.count + 1, 0);
        }
        Some(begin..end)
    }

    /// Runs up to `passes` passes, in parallel, and adds them in order: the same bits however they
    /// are split.
    pub fn advance(&mut self, lit: &LitScene, sensors: &[Sensor], passes: u32) {
        self.advance_batches(lit, sensors, u64::from(passes) * (PASS / BATCH));
    }

    /// As [`Exposure::advance`], by batches, of which [`PASS`] has four: what a frame can wait for.
    pub(crate) fn advance_batches(&mut self, lit: &LitScene, sensors: &[Sensor], batches: u64) {
        let sensors = if self.side == Side::Primal { &sensors[..1] } else { sensors };
        let problem = LightProblem::new(lit, sensors);
        let Some((guide, sensor)) = self.guide.clone() else {
            return self.walk(&problem, &problem, sensors, batches, || Nobody, |_| 0.0);
        };
        let steered = guide.steer(lit, sensors, self.side, sensor);
        let (gains, side) = (guide.gains(self.side, sensors), self.side);
        self.walk(
            &steered,
            &problem,
            sensors,
            batches,
            || Judge::new(steered.reading(), side, &problem, &gains),
            Judge::largest,
        );
    }

    fn walk<P: TransportProblem<Value = Rgb, States = LightStates>, W: WalkObserver<P>>(
        &mut self,
        walked: &P,
        problem: &LightProblem,
        sensors: &[Sensor],
        batches: u64,
        observer: impl Fn() -> W + Sync,
        residual: impl Fn(&W) -> f64 + Sync,
    ) {
        let begin = cpu_seconds();
        let batches: Vec<_> = (0..batches).map_while(|_| self.next_batch()).collect();
        let (lit, this) = (problem.lit, &*self);
        let parts: Vec<(std::ops::Range<u64>, Part)> = batches
            .into_par_iter()
            .map_init(Workspace::default, |work, walks| {
                let watched = this.reach.is_some() && is_watched(walks.start);
                let mut looks_on = Landings::new(problem.lit, watched, observer());
                let mut part =
                    this.batch(walked, problem, sensors, walks.clone(), work, &mut looks_on);
                (part.max_residual, part.arrivals) =
                    (residual(&looks_on.other), Arrivals::new(looks_on.list));
                (walks, part)
            })
            .collect();
        for (walks, part) in parts {
            self.take(lit, walks, &part);
        }
        self.cpu_seconds += cpu_seconds() - begin;
    }

    fn batch<P: TransportProblem<Value = Rgb>, W: WalkObserver<P>>(
        &self,
        walked: &P,
        problem: &LightProblem,
        sensors: &[Sensor],
        walks: std::ops::Range<u64>,
        work: &mut Workspace<P>,
        observer: &mut W,
    ) -> Part {
        let n = (walks.end - walks.start) as usize;
        let primal = self.side == Side::Primal;
        let orders = self
            .film
            .as_ref()
            .filter(|f| primal && f.has_orders())
            .map_or(0, |_| crate::film::ORDERS);
        let mut sums = Sums {
            problem,
            side: self.side,
            film_of: self.film_of,
            first: 0,
            totals: vec![vec![0.0; n]; if primal { 0 } else { sensors.len() }],
            pixels: sensors.iter().map(|s| s.bins() as f64).collect(),
            values: vec![Rgb::ZERO; if primal { n } else { 0 }],
            direct: vec![0.0; if primal { n } else { 0 }],
            orders: vec![vec![Rgb::ZERO; n]; orders],
            splats: Vec::new(),
        };
        let events = run_watched(
            walked,
            self.side,
            &self.rule,
            self.seed,
            walks.clone(),
            work,
            &mut sums,
            observer,
        );
        let mut scores = vec![Scores::default(); self.scores.len()];
        if primal {
            // Halves like the fields of a chessboard that changes sides with every sweep: both see
            // the whole picture, finished or not.
            let sweep = (problem.bins() as u64).max(1);
            for ((walk, value), direct) in walks.zip(&sums.values).zip(&sums.direct) {
                let value = value.reading();
                scores[0].add_with_chance(
                    value,
                    value - direct,
                    ((walk % sweep + walk / sweep) % 2) as usize,
                );
            }
        } else {
            let half = (walks.start / BATCH % 2) as usize;
            for (scores, totals) in scores.iter_mut().zip(&sums.totals) {
                totals.iter().for_each(|&x| scores.add(x, half));
            }
            // Every event brought its own in order of the walks: few runs to merge.
            sums.splats
                .sort_by_key(|&(pixel, walk, ..)| (u64::from(walk) << 32) | u64::from(pixel));
        }
        Part {
            scores,
            values: sums.values,
            orders: sums.orders,
            splats: sums.splats,
            events,
            max_residual: 0.0,
            arrivals: Arrivals::default(),
        }
    }

    fn take(&mut self, lit: &LitScene, walks: std::ops::Range<u64>, part: &Part) {
        self.walks += walks.end - walks.start;
        self.events += part.events;
        self.max_residual = self.max_residual.max(part.max_residual);
        if let Some(reach) = self.reach.as_mut().filter(|_| is_watched(walks.start)) {
            reach.record(walks.end - walks.start, &part.arrivals, |key| lit.cells().size(key));
        }
        for (mine, theirs) in self.scores.iter_mut().zip(&part.scores) {
            mine.merge(theirs);
        }
        let Some(film) = &mut self.film else { return };
        if self.side == Side::Primal {
            let pixels = film.len() as u64;
            for (row, walk) in walks.enumerate() {
                let pixel = (walk % pixels) as usize;
                film.expose(pixel, finite(part.values[row]).into());
                for (order, values) in part.orders.iter().enumerate() {
                    film.add_order(pixel, order as u32, finite(values[row]).into());
                }
            }
            return;
        }
        film.count(walks.end - walks.start);
        // Apart from what follows, so that the memory of many pixels is asked for at once.
        for &(pixel, _, order, value) in &part.splats {
            film.add_order(pixel as usize, order, finite(value).into());
        }
        // What one walk brings to one pixel is one number, or the second moment would be too small.
        for splats in part.splats.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let sum = splats.iter().fold(Rgb::ZERO, |sum, splat| sum + finite(splat.3));
            film.add(splats[0].0 as usize, sum.into());
        }
    }

    /// The reading of sensor `sensor`, with the stratified error where the walks went through a
    /// picture in order.
    #[must_use]
    pub fn reading(&self, sensor: usize) -> WalkEstimate {
        let Some(scores) = self.scores.get(sensor) else { return WalkEstimate::default() };
        let plain = scores.reading();
        let Some(film) = self.film.as_ref().filter(|_| self.side == Side::Primal) else {
            return plain;
        };
        match film.stratified() {
            Some((mean, Some(std_error))) => WalkEstimate { mean, std_error, ..plain },
            // Too few walks to tell the pixels' own noise: what they differ by is more than that.
            Some((mean, None)) => WalkEstimate { mean, ..plain },
            // A part of the picture is not the picture.
            None => WalkEstimate { std_error: f64::INFINITY, ..plain },
        }
    }

    /// Whether the two walk the same problem by the same rule, and may differ only in which passes
    /// they hold.
    #[must_use]
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let film = |e: &Self| e.film.as_ref().map(|f| (f.width, f.height, f.has_orders()));
        (
            self.side,
            self.rule,
            self.seed,
            self.limit,
            self.field,
            self.scores.len(),
            self.film_of,
            film(self),
            self.reach.is_some(),
        ) == (
            other.side,
            other.rule,
            other.seed,
            other.limit,
            other.field,
            other.scores.len(),
            other.film_of,
            film(other),
            other.reach.is_some(),
        )
    }

    /// Whether `other` is a state that this work may go on from.
    #[must_use]
    pub(crate) fn is_continued_by(&self, other: &Self) -> bool {
        let shards = |e: &Self| e.passes.iter().map(|p| p.shard).collect::<Vec<_>>();
        self.is_like(other) && shards(self) == shards(other) && other.passes.len() == 1
    }

    /// Whether all parts fit together: what an exposure from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let film = self.film.as_ref().is_none_or(Film::is_consistent);
        let place = self.film.is_some() == self.film_of.is_some()
            && self.film_of.is_none_or(|i| i < self.scores.len());
        let passes = self.passes.iter().all(|p| {
            p.shard.index < p.shard.of
                && p.count < 1 << 40
                && p.batches < PASS / BATCH
                && p.shard.of < 1 << 20
        });
        let reach = self.reach.as_ref().is_none_or(Reach::is_consistent);
        film && place
            && passes
            && reach
            && !self.passes.is_empty()
            && !self.scores.is_empty()
            && self.scores.iter().all(Scores::is_consistent)
    }

    /// Adds the walks of `other`.
    ///
    /// # Errors
    /// Why the two do not go together; nothing is changed then.
    pub fn merge(&mut self, other: &Self) -> Result<(), Mismatch> {
        if !self.is_like(other) {
            return Err(Mismatch::Settings);
        }
        let shards = |e: &Self| e.passes.iter().map(|p| p.shard).collect::<Vec<_>>();
        if shards(self).iter().any(|a| shards(other).iter().any(|b| a.of != b.of)) {
            return Err(Mismatch::Splits);
        }
        if let Some(shard) = shards(self).into_iter().find(|a| shards(other).contains(a)) {
            return Err(Mismatch::Twice(shard.index, shard.of));
        }
        let fits = match (&mut self.film, &other.film) {
            (Some(mine), Some(theirs)) => mine.merge(theirs),
            (None, None) => true,
            _ => false,
        };
        if !fits {
            return Err(Mismatch::Films);
        }
        self.scores.iter_mut().zip(&other.scores).for_each(|(a, b)| a.merge(b));
        self.passes.extend(&other.passes);
        self.walks += other.walks;
        self.events += other.events;
        self.max_residual = self.max_residual.max(other.max_residual);
        if let (Some(mine), Some(theirs)) = (&mut self.reach, &other.reach) {
            mine.merge(theirs);
        }
        self.cpu_seconds += other.cpu_seconds;
        Ok(())
    }
}

/// Why what one run has gathered does not go together with what another has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Mismatch {
    /// Exposures that were made otherwise.
    #[error("side, estimator, depth, seed, sample limit, field that steers or picture differ")]
    Settings,
    /// Shards of different splits.
    #[error("they are shards of different splits: merge shards i/n of one n")]
    Splits,
    /// The same shard in both: its index, and of how many.
    #[error("both hold shard {0}/{1}")]
    Twice(u64, u64),
    /// Films that cannot be added.
    #[error("the pictures differ in size or in what they hold")]
    Films,
    /// Plates of different cameras.
    #[error("the cameras differ")]
    Cameras,
    /// One has a side that the other lacks.
    #[error("the sides differ")]
    Sides,
    /// Readings that another measurement has begun.
    #[error("it was made with other sensors, side, estimator, depth, seed, sample limit or shard")]
    Measurement,
    /// A picture that another run has begun.
    #[error("it was made with another camera, side, estimator, depth, seed, sample limit or shard")]
    Picture,
}

/// A score that is no number is counted among the `invalid` and kept out of the picture.
fn finite(value: Rgb) -> Rgb {
    if value.is_finite() { value } else { Rgb::ZERO }
}
