use std::ops::Range;

use intrados_stage::random::Key;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{Ends, Links, Problem, Real, Scores, Side, States, Steps, Value, dimension, keep};

/// Walks in a batch: few enough that their columns stay in the second-level cache, enough to fill packets of rays.
pub const BATCH: u64 = 4096;

/// How walks score (theory §3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The paper's *critical* estimator (eq. 2.35–2.37): survives with ∫K, carries no weight, scores at every event.
    Analog,
    /// Scores at every event, with weights and free survival.
    Collision,
    /// The paper's *termination* estimator (eq. 2.42): scores at absorption only.
    LastEvent,
    /// Links every event to the far function too, with multiple importance sampling.
    #[default]
    NextEvent,
}

/// From what Russian roulette (eq. 2.34) takes its survival probability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Roulette {
    /// From ∫K of the event: weights stay as they are. Lowest variance of a mean.
    #[default]
    Event,
    /// From the weight that the walk has left: shorter walks, more of them a second.
    Weight,
}

/// Which estimator, how deep, where roulette begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rule {
    /// How walks score.
    pub estimator: Estimator,
    /// Orders 0..max_order of the Neumann series are taken; with light, 1 is the lamp seen directly.
    pub max_order: u32,
    /// First event with roulette (collision and next-event only; the others always play).
    pub roulette_from: u32,
    /// How it is played.
    pub roulette: Roulette,
}

impl Default for Rule {
    fn default() -> Self {
        Self { estimator: Estimator::NextEvent, max_order: u32::MAX, roulette_from: 5, roulette: Roulette::Event }
    }
}

/// Receives the scores of a batch.
pub trait Tally<V> {
    /// Walk `walk` (row of the batch when it started) scores `value`, a term of order `order`, to `bin`.
    fn score(&mut self, walk: u32, bin: u32, order: u32, value: V);
}

/// The columns of one thread, kept from batch to batch.
pub struct Workspace<P: Problem> {
    states: P::States,
    keys: Vec<Key>,
    walk: Vec<u32>,
    weight: Vec<P::Value>,
    ends: Vec<Ends<P::Value>>,
    links: Links<P::Value>,
    steps: Steps<P::Value>,
    rows: Vec<u32>,
}

impl<P: Problem> Default for Workspace<P> {
    fn default() -> Self {
        Self {
            states: P::States::default(),
            keys: Vec::new(),
            walk: Vec::new(),
            weight: Vec::new(),
            ends: Vec::new(),
            links: Links::default(),
            steps: Steps::default(),
            rows: Vec::new(),
        }
    }
}

/// Runs walks `walks` as one batch and returns how many events they had, a deterministic measure of work.
///
/// The keys are a function of (seed, side, walk) alone: the same walk gives the same scores in any batch.
pub fn run<P: Problem, T: Tally<P::Value>>(
    problem: &P,
    side: Side,
    rule: &Rule,
    seed: u64,
    walks: Range<u64>,
    work: &mut Workspace<P>,
    tally: &mut T,
) -> u64 {
    work.begin(problem, side, seed, walks);
    let mut events = 0;
    let mut event = 0;
    while !work.walk.is_empty() {
        events += work.walk.len() as u64;
        // The last order wanted has been found by arriving at event `max_order`.
        let last = event == rule.max_order;
        if event > 0 {
            work.arrive(problem, side);
            if last && rule.estimator == Estimator::LastEvent {
                work.absorb_all(event, tally);
            } else if rule.estimator != Estimator::LastEvent {
                work.score_ends(event, rule, tally);
            }
        }
        if last {
            break;
        }
        if rule.estimator == Estimator::NextEvent {
            work.link(problem, side, event, tally);
        }
        work.steps.reset(work.walk.len());
        problem.scatter(side, event, &work.keys, &mut work.states, &mut work.steps);
        work.survive(event, rule, tally);
        problem.fly(side, &mut work.states);
        event += 1;
    }
    events
}

/// The power heuristic with exponent 2 (Veach 1997, §9.2): the share of the technique of density `mine`.
fn share<R: Real>(mine: R, other: R) -> R {
    let ratio = other / mine;
    R::ONE / (R::ONE + ratio * ratio)
}

impl<P: Problem> Workspace<P> {
    fn begin(&mut self, problem: &P, side: Side, seed: u64, walks: Range<u64>) {
        let n = (walks.end - walks.start) as usize;
        // The two sides draw apart, or their difference would not be the sum of two independent errors.
        let seed = seed.wrapping_mul(2) + u64::from(side == Side::Dual);
        self.keys.clear();
        self.keys.extend(walks.clone().map(|walk| Key::new(seed, walk)));
        self.walk.clear();
        self.walk.extend(0..n as u32);
        self.weight.clear();
        self.weight.resize(n, P::Value::ONE);
        problem.start(side, walks, &self.keys, &mut self.states);
        self.ends.resize_with(problem.channels(side), Ends::default);
    }

    fn arrive(&mut self, problem: &P, side: Side) {
        for (channel, ends) in self.ends.iter_mut().enumerate() {
            ends.reset(self.walk.len());
            if !problem.arrive(side, channel, &self.states, ends) {
                ends.value.clear();
            }
        }
    }

    fn score_ends<T: Tally<P::Value>>(&self, event: u32, rule: &Rule, tally: &mut T) {
        let mixed = rule.estimator == Estimator::NextEvent;
        for ends in &self.ends {
            for (i, &value) in ends.value.iter().enumerate() {
                if value.largest() > Real::ZERO {
                    let mut score = self.weight[i] * value;
                    if mixed {
                        score = score.scale(share(ends.kernel_density[i], ends.link_density[i]));
                    }
                    tally.score(self.walk[i], ends.bin[i], event - 1, score);
                }
            }
        }
    }

    fn absorb_all<T: Tally<P::Value>>(&self, event: u32, tally: &mut T) {
        for i in 0..self.walk.len() {
            self.absorb(i, Real::ONE, event, tally);
        }
    }

    /// A last-event walk ends with probability `q` and scores far/q.
    fn absorb<T: Tally<P::Value>>(&self, i: usize, q: <P::Value as Value>::Real, event: u32, tally: &mut T) {
        for ends in self.ends.iter().filter(|ends| !ends.value.is_empty()) {
            if ends.value[i].largest() > Real::ZERO {
                tally.score(
                    self.walk[i],
                    ends.bin[i],
                    event - 1,
                    (self.weight[i] * ends.value[i]).scale(<P::Value as Value>::Real::ONE / q),
                );
            }
        }
    }

    fn link<T: Tally<P::Value>>(&mut self, problem: &P, side: Side, event: u32, tally: &mut T) {
        for channel in 0..problem.channels(side) {
            self.links.reset(self.walk.len());
            if !problem.link(side, channel, event, &self.keys, &mut self.states, &mut self.links) {
                continue;
            }
            problem.reveal(side, &mut self.states, &mut self.links);
            let Links { value, bin, link_density, kernel_density } = &self.links;
            filter(&mut self.rows, value.len(), |i| value[i].largest() > Real::ZERO);
            for i in self.rows.iter().map(|&i| i as usize) {
                let score = (self.weight[i] * value[i]).scale(share(link_density[i], kernel_density[i]));
                tally.score(self.walk[i], bin[i], event, score);
            }
        }
    }

    /// The probability with which walk `i` goes on, whose weight would be `carried` then.
    #[inline]
    fn survival(&self, i: usize, carried: P::Value, event: u32, rule: &Rule) -> <P::Value as Value>::Real {
        let cap = |p: <P::Value as Value>::Real| if p > Real::of(0.95) { Real::of(0.95) } else { p };
        match rule.estimator {
            _ if event == 0 => Real::ONE,
            Estimator::Analog | Estimator::LastEvent => self.steps.survival[i],
            _ if event < rule.roulette_from => Real::ONE,
            _ => match rule.roulette {
                Roulette::Event => cap(self.steps.survival[i]),
                Roulette::Weight => cap(carried.largest()),
            },
        }
    }

    /// Plays roulette, weighs the survivors and closes the ranks.
    fn survive<T: Tally<P::Value>>(&mut self, event: u32, rule: &Rule, tally: &mut T) {
        let n = self.walk.len();
        let mut rows = std::mem::take(&mut self.rows);
        filter(&mut rows, n, |i| {
            let factor = self.steps.factor[i];
            let carried = self.weight[i] * factor;
            let survival = self.survival(i, carried, event, rule);
            let plays = survival < Real::ONE;
            let survives = !plays || <P::Value as Value>::Real::of(self.keys[i].unit64(dimension(event, 4))) < survival;
            if rule.estimator == Estimator::LastEvent && event > 0 && !survives {
                self.absorb(i, <P::Value as Value>::Real::ONE - survival, event, tally);
            }
            // Of those that end, whatever it is.
            self.weight[i] = carried.scale(<P::Value as Value>::Real::ONE / survival);
            survives & (factor.largest() > Real::ZERO)
        });
        if rows.len() < n {
            self.states.gather(&rows);
            keep(&mut self.keys, &rows);
            keep(&mut self.walk, &rows);
            keep(&mut self.weight, &rows);
        }
        self.rows = rows;
    }
}

/// The rows of `n` that `keeps` says, in order. Which ones they are nobody can foretell, so no branch asks.
#[inline]
fn filter(rows: &mut Vec<u32>, n: usize, mut keeps: impl FnMut(usize) -> bool) {
    rows.resize(n, 0);
    let mut kept = 0;
    for i in 0..n {
        rows[kept] = i as u32;
        kept += usize::from(keeps(i));
    }
    rows.truncate(kept);
}

/// One score a walk: the sum over all its events and one bin.
struct PerWalk(Vec<f64>);

impl<V: Value> Tally<V> for PerWalk {
    fn score(&mut self, walk: u32, _bin: u32, _order: u32, value: V) {
        self.0[walk as usize] += value.reading();
    }
}

/// The reading of a problem with one bin, from walks `walks` of `seed`, on all threads. The same bits for any number of threads.
pub fn measure<P: Problem>(problem: &P, side: Side, rule: &Rule, seed: u64, walks: Range<u64>) -> Scores {
    let batches: Vec<_> =
        (walks.start / BATCH..walks.end.div_ceil(BATCH)).map(|b| (b * BATCH).max(walks.start)..((b + 1) * BATCH).min(walks.end)).collect();
    let parts: Vec<Scores> = batches
        .into_par_iter()
        .map_init(Workspace::default, |work, walks| {
            let mut sums = PerWalk(vec![0.0; (walks.end - walks.start) as usize]);
            run(problem, side, rule, seed, walks.clone(), work, &mut sums);
            let mut scores = Scores::default();
            let half = (walks.start / BATCH % 2) as usize;
            sums.0.iter().for_each(|&x| scores.add(x, half));
            scores
        })
        .collect();
    parts.iter().fold(Scores::default(), |mut all, part| {
        all.merge(part);
        all
    })
}
