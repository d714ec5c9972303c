use std::ops::Range;

use intrados_stage::random::Key;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    Ends, Links, Real, RealOf, Scores, Side, States, Steps, TransportProblem, Value, dimension,
    keep, spread,
};

/// Walks in a batch: few enough that their columns stay in the second-level cache, enough to fill
/// packets of rays.
pub const BATCH: u64 = 4096;

/// How walks score (theory §3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The paper's *critical* estimator (eq. 2.35–2.37): survives with ∫K, carries no weight,
    /// scores at every event.
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
pub struct WalkRule {
    /// How walks score.
    pub estimator: Estimator,
    /// Orders 0..max_order of the Neumann series are taken; with light, 1 is the lamp seen
    /// directly.
    pub max_order: u32,
    /// First event with roulette (collision and next-event only; the others always play).
    pub roulette_from: u32,
    /// How it is played.
    pub roulette: Roulette,
    /// So many walks in a row draw the same numbers; 1: each its own. With as many as a picture has
    /// pixels, its noise is the same everywhere: a sky becomes a few lamps, and nothing is grainy.
    /// No error bar holds then.
    #[serde(default = "WalkRule::apart")]
    pub alike: u64,
}

impl WalkRule {
    const fn apart() -> u64 {
        1
    }
}

impl Default for WalkRule {
    fn default() -> Self {
        Self {
            estimator: Estimator::NextEvent,
            max_order: u32::MAX,
            roulette_from: 5,
            roulette: Roulette::Event,
            alike: Self::apart(),
        }
    }
}

/// Receives the scores of a batch.
pub trait Tally<V> {
    /// Walk `walk` (row of the batch when it started) scores `value`, a term of order `order`, to
    /// `bin`.
    fn score(&mut self, walk: u32, bin: u32, order: u32, value: V);
}

/// Looks on while walks walk: who wants to learn from them, or to know what they are like. Rows are
/// those of the live walks.
///
/// Between two events a walk *departs* and *lands*; what it scores by landing (and by the link from
/// there) is told in between, and then how much more it promises.
pub trait WalkObserver<P: TransportProblem> {
    /// A batch of `n` walks is at its start.
    fn begin(&mut self, _n: usize) {}
    /// Rows `rows` (increasing, with repetitions where walks split) are the rows now.
    fn follow(&mut self, _rows: &[u32]) {}
    /// The live walks are about to fly from event `event` with weights `weight`, each promising to
    /// score `promise` of a reading (steered walks only; negative where nothing is known).
    fn depart(
        &mut self,
        _event: u32,
        _states: &P::States,
        _weight: &[P::Value],
        _promise: &[RealOf<P>],
    ) {
    }
    /// They have arrived at event `event`.
    fn land(&mut self, _event: u32, _states: &P::States, _weight: &[P::Value]) {}
    /// They have been linked through `channel`: what of `links` is not 0 scores next.
    fn link(
        &mut self,
        _event: u32,
        _channel: usize,
        _states: &P::States,
        _links: &Links<P::Value>,
    ) {
    }
    /// Row `row` scores.
    fn score(&mut self, _row: usize, _bin: u32, _value: P::Value) {}
    /// All that the landing brings has been scored; `expected` is what going on from here promises,
    /// for whole rows.
    fn weigh(&mut self, _expected: &[RealOf<P>]) {}
}

/// Nobody looks.
#[derive(Debug, Default)]
pub struct Nobody;

impl<P: TransportProblem> WalkObserver<P> for Nobody {}

/// A walk splits into this many at most at one event, and into `COPIES` in all (every split divides
/// what is left of them).
const SPLIT: u32 = 10;
pub(crate) const COPIES: u32 = 1024;
/// Least probability with which a field lets a walk survive: one that is wrong must not kill it
/// (theory §4).
const SURVIVAL: f64 = 0.05;
/// Walks that promise between these many readings go on as they are.
const WINDOW: [f64; 2] = [0.5, 2.0];

/// The columns of one thread, kept from batch to batch.
pub struct Workspace<P: TransportProblem> {
    states: P::States,
    keys: Vec<Key>,
    walk: Vec<u32>,
    weight: Vec<P::Value>,
    ends: Vec<Ends<P::Value>>,
    links: Links<P::Value>,
    steps: Steps<P::Value>,
    rows: Vec<u32>,
    /// Of steered walks: what they promise, and how many copies they may still become.
    expected: Vec<RealOf<P>>,
    copies: Vec<u32>,
}

impl<P: TransportProblem> Default for Workspace<P> {
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
            expected: Vec::new(),
            copies: Vec::new(),
        }
    }
}

/// Runs walks `walks` as one batch and returns how many events they had, a deterministic measure of
/// work.
///
/// The keys are a function of (seed, side, walk) alone: the same walk gives the same scores in any
/// batch.
pub fn run<P: TransportProblem, T: Tally<P::Value>>(
    problem: &P,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
    work: &mut Workspace<P>,
    tally: &mut T,
) -> u64 {
    run_watched(problem, side, rule, seed, walks, work, tally, &mut Nobody)
}

/// [`run`] while `observer` looks on, who changes nothing.
#[expect(clippy::too_many_arguments, reason = "run's own, and who looks on")]
pub fn run_watched<P: TransportProblem, T: Tally<P::Value>, W: WalkObserver<P>>(
    problem: &P,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
    work: &mut Workspace<P>,
    tally: &mut T,
    observer: &mut W,
) -> u64 {
    work.begin(problem, side, seed, walks, rule.alike);
    observer.begin(work.walk.len());
    let to = &mut Scored { tally, observer };
    let mut events = 0;
    let mut event = 0;
    while !work.walk.is_empty() {
        events += work.walk.len() as u64;
        // The last order wanted has been found by arriving at event `max_order`.
        let last = event == rule.max_order;
        if event > 0 {
            work.arrive(problem, side);
            if last && rule.estimator == Estimator::LastEvent {
                work.absorb_all(event, to);
            } else if rule.estimator != Estimator::LastEvent {
                work.score_ends(event, rule, to);
            }
        }
        if last {
            break;
        }
        let steered = work.ask_worth(problem, side, event);
        if rule.estimator == Estimator::NextEvent {
            work.link(problem, side, event, to);
        }
        if steered {
            to.observer.weigh(&work.expected);
            work.split(event, rule, to.observer);
            if rule.estimator == Estimator::LastEvent && event > 0 {
                // Those that end here score what is here: of the rows that there are now.
                work.arrive(problem, side);
            }
        }
        work.steps.reset(work.walk.len());
        problem.scatter(side, event, &work.keys, &mut work.states, &mut work.steps);
        if steered && rule.estimator != Estimator::LastEvent {
            work.close_ranks(to.observer);
        } else {
            work.survive(event, rule, steered, to);
        }
        to.observer.depart(event, &work.states, &work.weight, &work.expected);
        problem.fly(side, &mut work.states);
        event += 1;
        to.observer.land(event, &work.states, &work.weight);
    }
    events
}

/// Who gets the scores.
struct Scored<'a, T, W> {
    tally: &'a mut T,
    observer: &'a mut W,
}

/// The power heuristic with exponent 2 (Veach 1997, §9.2): the share of the technique of density
/// `mine`.
fn share<R: Real>(mine: R, other: R) -> R {
    let ratio = other / mine;
    R::ONE / (R::ONE + ratio * ratio)
}

impl<P: TransportProblem> Workspace<P> {
    fn begin(&mut self, problem: &P, side: Side, seed: u64, walks: Range<u64>, alike: u64) {
        let n = (walks.end - walks.start) as usize;
        // The two sides draw apart, or their difference would not be the sum of two independent
        // errors.
        let seed = seed.wrapping_mul(2) + u64::from(side == Side::Dual);
        self.keys.clear();
        self.keys.extend(walks.clone().map(|walk| Key::new(seed, walk / alike.max(1))));
        self.walk.clear();
        self.walk.extend(0..n as u32);
        self.weight.clear();
        self.weight.resize(n, P::Value::ONE);
        self.copies.clear();
        self.copies.resize(n, COPIES);
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

    fn score_ends<T: Tally<P::Value>, W: WalkObserver<P>>(
        &self,
        event: u32,
        rule: &WalkRule,
        to: &mut Scored<T, W>,
    ) {
        let mixed = rule.estimator == Estimator::NextEvent;
        for ends in &self.ends {
            for (i, &value) in ends.value.iter().enumerate() {
                if value.largest() > Real::ZERO {
                    let mut score = self.weight[i] * value;
                    if mixed {
                        score = score.scale(share(ends.kernel_density[i], ends.link_density[i]));
                    }
                    self.score(i, ends.bin[i], event - 1, score, to);
                }
            }
        }
    }

    fn absorb_all<T: Tally<P::Value>, W: WalkObserver<P>>(
        &self,
        event: u32,
        to: &mut Scored<T, W>,
    ) {
        for i in 0..self.walk.len() {
            self.absorb(i, Real::ONE, event, to);
        }
    }

    /// A last-event walk ends with probability `q` and scores far/q.
    fn absorb<T: Tally<P::Value>, W: WalkObserver<P>>(
        &self,
        i: usize,
        q: RealOf<P>,
        event: u32,
        to: &mut Scored<T, W>,
    ) {
        for ends in self.ends.iter().filter(|ends| !ends.value.is_empty()) {
            if ends.value[i].largest() > Real::ZERO {
                let score = (self.weight[i] * ends.value[i]).scale(<RealOf<P> as Real>::ONE / q);
                self.score(i, ends.bin[i], event - 1, score, to);
            }
        }
    }

    #[inline]
    fn score<T: Tally<P::Value>, W: WalkObserver<P>>(
        &self,
        i: usize,
        bin: u32,
        order: u32,
        value: P::Value,
        to: &mut Scored<T, W>,
    ) {
        to.tally.score(self.walk[i], bin, order, value);
        to.observer.score(i, bin, value);
    }

    fn link<T: Tally<P::Value>, W: WalkObserver<P>>(
        &mut self,
        problem: &P,
        side: Side,
        event: u32,
        to: &mut Scored<T, W>,
    ) {
        for channel in 0..problem.channels(side) {
            self.links.reset(self.walk.len());
            if !problem.link(side, channel, event, &self.keys, &mut self.states, &mut self.links) {
                continue;
            }
            problem.reveal(side, &mut self.states, &mut self.links);
            to.observer.link(event, channel, &self.states, &self.links);
            let Links { value, bin, link_density, kernel_density } = &self.links;
            filter(&mut self.rows, value.len(), |i| value[i].largest() > Real::ZERO);
            for i in self.rows.iter().map(|&i| i as usize) {
                let score =
                    (self.weight[i] * value[i]).scale(share(link_density[i], kernel_density[i]));
                self.score(i, bin[i], event, score, to);
            }
        }
    }

    /// The probability with which walk `i` goes on, whose weight would be `carried` then.
    #[inline]
    fn survival(&self, i: usize, carried: P::Value, event: u32, rule: &WalkRule) -> RealOf<P> {
        let cap = |p: RealOf<P>| if p > Real::of(0.95) { Real::of(0.95) } else { p };
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
    fn survive<T: Tally<P::Value>, W: WalkObserver<P>>(
        &mut self,
        event: u32,
        rule: &WalkRule,
        steered: bool,
        to: &mut Scored<T, W>,
    ) {
        let n = self.walk.len();
        // Steered walks have played roulette already, and those that it spared must not be spared
        // twice by the same number.
        let number = if steered { 5 } else { 4 };
        let mut rows = std::mem::take(&mut self.rows);
        filter(&mut rows, n, |i| {
            let factor = self.steps.factor[i];
            let carried = self.weight[i] * factor;
            let survival = self.survival(i, carried, event, rule);
            let plays = survival < Real::ONE;
            let survives = !plays
                || <RealOf<P> as Real>::of(self.keys[i].unit64(dimension(event, number)))
                    < survival;
            if rule.estimator == Estimator::LastEvent && event > 0 && !survives {
                self.absorb(i, <RealOf<P> as Real>::ONE - survival, event, to);
            }
            // Of those that end, whatever it is.
            self.weight[i] = carried.scale(<RealOf<P> as Real>::ONE / survival);
            survives & (factor.largest() > Real::ZERO)
        });
        self.retain(rows, steered, to.observer);
    }

    /// Closes the ranks: of the walks that are about to fly only rows `rows` are left.
    fn retain<W: WalkObserver<P>>(&mut self, rows: Vec<u32>, steered: bool, observer: &mut W) {
        if rows.len() < self.walk.len() {
            self.states.gather(&rows);
            keep(&mut self.keys, &rows);
            keep(&mut self.walk, &rows);
            keep(&mut self.weight, &rows);
            if steered {
                keep(&mut self.expected, &rows);
                keep(&mut self.copies, &rows);
            }
            observer.follow(&rows);
        }
        self.rows = rows;
    }

    fn ask_worth(&mut self, problem: &P, side: Side, event: u32) -> bool {
        self.expected.clear();
        self.expected.resize(self.walk.len(), Real::ZERO);
        problem.expected_contribution(
            side,
            event,
            &self.weight,
            &mut self.states,
            &mut self.expected,
        )
    }

    /// How many copies of row `i` go on, and with what share of the weight.
    fn copies(&self, i: usize, event: u32, rule: &WalkRule) -> (u32, RealOf<P>) {
        let window = window(self.expected[i].get(), event, rule.roulette_from, self.copies[i]);
        let (copies, share) = split(window, || self.keys[i].unit64(dimension(event, 4)));
        (copies, Real::of(share))
    }

    /// Roulette and splitting of steered walks, before their ways on are drawn: every copy draws
    /// its own.
    fn split<W: WalkObserver<P>>(&mut self, event: u32, rule: &WalkRule, observer: &mut W) {
        let n = self.walk.len();
        let mut rows = std::mem::take(&mut self.rows);
        rows.clear();
        for i in 0..n {
            let (copies, share) = self.copies(i, event, rule);
            self.weight[i] = self.weight[i].scale(share);
            self.expected[i] = self.expected[i] * share;
            self.copies[i] /= copies.max(1);
            rows.extend(std::iter::repeat_n(i as u32, copies as usize));
        }
        if rows.len() != n || rows.iter().enumerate().any(|(i, &row)| i as u32 != row) {
            self.states.repeat(&rows);
            spread(&mut self.keys, &rows);
            spread(&mut self.walk, &rows);
            spread(&mut self.weight, &rows);
            spread(&mut self.expected, &rows);
            spread(&mut self.copies, &rows);
            observer.follow(&rows);
            for (copy, i) in copy_numbers(&rows).into_iter().zip(0..).filter(|(copy, _)| *copy > 0)
            {
                self.keys[i] = self.keys[i].split(event, copy);
            }
        }
        self.rows = rows;
    }

    /// Drops the steered walks that no way leads on.
    fn close_ranks<W: WalkObserver<P>>(&mut self, observer: &mut W) {
        let n = self.walk.len();
        let mut rows = std::mem::take(&mut self.rows);
        filter(&mut rows, n, |i| {
            self.weight[i] = self.weight[i] * self.steps.factor[i];
            self.steps.factor[i].largest() > Real::ZERO
        });
        self.retain(rows, true, observer);
    }
}

/// The weight window (Vorba and Křivánek 2016: by the expected contribution): with what probability
/// a walk of worth `expected` survives event `event`, and as how many copies, if it may still
/// become `left`. Each goes on with 1/(survival · copies) of the weight.
pub(crate) fn window(expected: f64, event: u32, roulette_from: u32, left: u32) -> (f64, u32) {
    // The start has been drawn already; what it is worth is the field's own mean, nearly 1.
    if event == 0 {
        (1.0, 1)
    } else if expected == 0.0 {
        (0.0, 1)
    } else if expected < 0.0 {
        (if event < roulette_from { 1.0 } else { (-expected).clamp(SURVIVAL, 0.95) }, 1)
    } else if expected < WINDOW[0] {
        (expected.max(SURVIVAL), 1)
    } else if expected > WINDOW[1] {
        (1.0, (expected.round() as u32).min(SPLIT).min(left).max(1))
    } else {
        // Or nobody knows (NaN).
        (1.0, 1)
    }
}

/// What becomes of a walk in a window by a number in [0, 1): how many copies go on, and with what
/// share of the weight each.
pub(crate) fn split((survival, copies): (f64, u32), number: impl FnOnce() -> f64) -> (u32, f64) {
    let survives = survival >= 1.0 || number() < survival;
    (if survives { copies } else { 0 }, 1.0 / (survival.max(f64::MIN_POSITIVE) * f64::from(copies)))
}

/// Of each row the how-manieth copy it is, from 0.
fn copy_numbers(rows: &[u32]) -> Vec<u32> {
    let mut copy = 0;
    let number = |i: usize| {
        copy = if i > 0 && rows[i - 1] == rows[i] { copy + 1 } else { 0 };
        copy
    };
    (0..rows.len()).map(number).collect()
}

/// The rows of `n` that `keeps` says, in order. Which ones they are nobody can foretell, so no
/// branch asks.
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

/// The reading of a problem with one bin, from walks `walks` of `seed`, on all threads. The same
/// bits for any number of threads.
pub fn measure<P: TransportProblem>(
    problem: &P,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
) -> Scores {
    let batches: Vec<_> = (walks.start / BATCH..walks.end.div_ceil(BATCH))
        .map(|b| (b * BATCH).max(walks.start)..((b + 1) * BATCH).min(walks.end))
        .collect();
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::matrix::{MatrixField, MatrixProblem, MatrixStates, SteeredMatrix};

    /// ν = w·F/c: survival with probability ν below the window, round(ν) copies above it. A
    /// published code had this upside down (light walks never died), and nothing but its speed
    /// told.
    #[test]
    fn the_window_spares_what_promises_much() {
        let at = |expected| window(expected, 3, 5, COPIES);
        for expected in [0.1, 0.3, 0.49] {
            assert_eq!(at(expected), (expected, 1));
        }
        assert_eq!(
            at(1e-9),
            (SURVIVAL, 1),
            "a field that predicts next to nothing must not kill a walk"
        );
        for expected in [0.5, 1.0, 2.0] {
            assert_eq!(at(expected), (1.0, 1));
        }
        assert_eq!(
            (at(2.4), at(2.6), at(7.5), at(1e9)),
            ((1.0, 2), (1.0, 3), (1.0, 8), (1.0, SPLIT))
        );
        assert_eq!(window(1e9, 3, 5, 4), (1.0, 4), "no more copies than it may still become");
        assert_eq!(window(1e9, 3, 5, 0), (1.0, 1));
        assert_eq!(at(0.0).0, 0.0, "no way leads on");
        assert_eq!(window(1e9, 0, 5, COPIES), (1.0, 1), "the start has been drawn already");
    }

    /// Where the field knows nothing: plain roulette, and only from where the rule says. Where
    /// nobody knows (NaN): none.
    #[test]
    fn without_a_promise_there_is_plain_roulette() {
        assert_eq!(window(-0.7, 4, 5, COPIES), (1.0, 1));
        assert_eq!(window(-0.7, 5, 5, COPIES), (0.7, 1));
        assert_eq!(window(-1e-6, 5, 5, COPIES), (SURVIVAL, 1));
        assert_eq!(window(-1.0, 5, 5, COPIES), (0.95, 1));
        assert_eq!(window(f64::NAN, 5, 5, COPIES), (1.0, 1));
    }

    /// Splits by a factor and by 1024 in all, whatever the field says: what is left to each copy is
    /// what its parent had over their number.
    #[test]
    fn splitting_is_bounded() {
        let (mut all, mut left) = (1, COPIES);
        for event in 1..100 {
            let (survival, copies) = window(1e300, event, 5, left);
            assert_eq!(survival, 1.0);
            all *= copies;
            left /= copies;
        }
        assert!(all > COPIES / SPLIT && all <= COPIES, "{all}");
    }

    /// Notes where the walks of each event are.
    #[derive(Default)]
    struct Places(Vec<Vec<u32>>, Vec<Vec<u32>>);

    impl WalkObserver<SteeredMatrix<'_>> for Places {
        fn follow(&mut self, rows: &[u32]) {
            self.1.push(rows.to_vec());
        }
        fn land(&mut self, _: u32, states: &MatrixStates, _: &[f64]) {
            self.0.push(states.places().to_vec());
        }
    }

    impl Tally<f64> for f64 {
        fn score(&mut self, _: u32, _: u32, _: u32, value: f64) {
            *self += value;
        }
    }

    /// Ten copies of one walk go where they like: with one and the same random number all would go
    /// to one state.
    #[test]
    fn copies_go_their_own_ways() {
        let problem = MatrixProblem::chain(40, 0.9, 1);
        let field = MatrixField::new(&problem, Side::Dual, nalgebra::DVector::repeat(40, 1.0));
        // Every walk promises far more than it is told that walks are worth.
        let steered = SteeredMatrix::new(&problem, Side::Dual, field, 0.1).windowed(1e-3);
        let rule =
            WalkRule { estimator: Estimator::Collision, max_order: 2, ..WalkRule::default() };
        let (mut places, mut sum) = (Places::default(), 0.0);
        run_watched(
            &steered,
            Side::Dual,
            &rule,
            3,
            0..1,
            &mut Workspace::default(),
            &mut sum,
            &mut places,
        );
        let copies = &places.0[1];
        assert_eq!(copies.len(), SPLIT as usize);
        assert_eq!(
            places.1[0], [0; SPLIT as usize],
            "the observer is told that all stem from row 0"
        );
        // Ten draws over some eight likely states: two or fewer different ones would come less
        // often than once in 1e4 times.
        assert!(copies.iter().collect::<BTreeSet<_>>().len() > 2, "{copies:?}");
    }
}
