//! The complementary dual process (theory §4): walks of both sides in turns, each steered by what
//! all before have found.

use std::ops::Range;

use intrados_stage::{Cancelled, Job, cpu_seconds};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    BATCH, Scores, Side, Tally, TransportProblem, WalkObserver, WalkRule, Workspace, run_watched,
};

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

impl Schedule {
    /// Walks of each side in round `number`, from 0.
    #[must_use]
    pub const fn walks(&self, number: u32) -> u64 {
        self.first.saturating_mul(1 << if number < 63 { number } else { 63 })
    }
}

/// What an event of a steered walk costs, in events of others: fixed, since decisions must not hang
/// on a clock.
pub const STEERED_COST: f64 = 3.0;
/// Rounds of unsteered walks on each side before the first decision, and how many times worse
/// steering may be then and yet be tried further.
const PATIENCE: (u32, f64) = (2, 3.0);
/// The worse side gets one walk's work in so many, for the certificate that only two sides give.
const CERTIFICATE: f64 = 6.0;
/// How many times better one side must be before it gets more of the work.
const BETTER: f64 = 1.5;
/// Most passes of the better side for one of the worse.
const TURNS: f64 = 64.0;

/// One side in one round of learning.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Round {
    /// Which walks.
    pub side: Side,
    /// Whether a field steered them.
    pub steered: bool,
    /// Scores of the walks (of the first sensor, where there are several).
    pub scores: Scores,
    /// Events: the work.
    pub events: u64,
    /// CPU-seconds of the walks, and of building fields after them.
    pub cpu_seconds: [f64; 2],
    /// Cells of the field that was built.
    pub cells: usize,
}

impl Round {
    fn cost_of_event(&self) -> f64 {
        if self.steered { STEERED_COST } else { 1.0 }
    }

    /// Figure of merit of the scores, on a scale of events: 1/(relVar · work). 0 where nothing was
    /// found.
    #[must_use]
    pub fn merit(&self) -> f64 {
        let rel_error = self.scores.reading().rel_error();
        let merit = 1.0 / (rel_error * rel_error * self.events as f64 * self.cost_of_event());
        if merit.is_finite() { merit } else { 0.0 }
    }

    /// Work of a walk, in events of unsteered ones.
    fn work(&self) -> f64 {
        self.events as f64 / self.scores.walks().max(1) as f64 * self.cost_of_event()
    }
}

/// What the walks of one side in one round of learning came to.
#[derive(Debug, Clone)]
pub struct Walked {
    /// Whether a field steered them.
    pub steered: bool,
    /// Their scores (of the first sensor, where there are several).
    pub scores: Scores,
    /// Their events.
    pub events: u64,
}

/// A transport problem whose two walks can teach each other.
pub trait Process {
    /// `walks` walks of `side` in round `number`, steered by the side's field if it has one. What
    /// they have seen (photons) is kept for the other side's field, what they have found (suffix
    /// scores) for their own.
    fn walk(&mut self, number: u32, side: Side, walks: u64) -> Walked;

    /// Makes the field of `side` of what was kept for it; its cells.
    fn teach(&mut self, side: Side) -> usize;

    /// How many of the `walks` that are to come it can pay for; 0 ends the learning.
    fn affords(&self, _number: u32, _side: Side, walks: u64) -> u64 {
        walks
    }
}

/// What became of an alternation.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Course {
    /// What each round was like, in their order.
    pub rounds: Vec<Round>,
    /// Which sides are to be steered.
    pub steers: [bool; 2],
    /// Passes of each side in a round of both.
    pub turns: [u32; 2],
}

/// Lets the sides of `process` teach each other in turns, primal first, and decides what is worth
/// steering.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn alternate(
    process: &mut impl Process,
    schedule: Schedule,
    steering: Steering,
    job: &Job,
) -> Result<Course, Cancelled> {
    let mut course = Course { turns: [1; 2], ..Course::default() };
    if steering == Steering::Off {
        return Ok(course);
    }
    let total = 2 * schedule.rounds as usize;
    'rounds: for number in 0..schedule.rounds {
        for side in Side::BOTH {
            job.step(course.rounds.len(), total)?;
            let walks = process.affords(number, side, schedule.walks(number));
            if walks == 0 {
                break 'rounds;
            }
            let begin = cpu_seconds();
            let Walked { steered, scores, events } = process.walk(number, side, walks);
            let middle = cpu_seconds();
            let cells = process.teach(side.other());
            let cpu_seconds = [middle - begin, cpu_seconds() - middle];
            course.rounds.push(Round { side, steered, scores, events, cpu_seconds, cells });
        }
        if steering == Steering::Auto && number >= PATIENCE.0 && course.gain() * PATIENCE.1 < 1.0 {
            break;
        }
    }
    course.decide(steering);
    Ok(course)
}

impl Course {
    /// The last round of one side, steered or not.
    #[must_use]
    pub fn last(&self, side: Side, steered: bool) -> Option<&Round> {
        self.rounds.iter().rev().find(|r| r.side == side && r.steered == steered)
    }

    /// Merit of that round.
    #[must_use]
    pub fn merit(&self, side: Side, steered: bool) -> f64 {
        self.last(side, steered).map_or(0.0, Round::merit)
    }

    /// How many times better the better side is steered than the better one unsteered; infinite
    /// where no unsteered walk finds anything.
    #[must_use]
    pub fn gain(&self) -> f64 {
        let best = |steered: bool| {
            Side::BOTH.map(|side| self.merit(side, steered)).into_iter().fold(0.0, f64::max)
        };
        let unsteered = best(false);
        if unsteered > 0.0 { best(true) / unsteered } else { f64::INFINITY }
    }

    /// Whether a side is to be steered.
    #[must_use]
    pub fn steers(&self, side: Side) -> bool {
        self.steers[side as usize]
    }

    /// Decides what is steered, and how the work is shared.
    fn decide(&mut self, steering: Steering) {
        self.steers = Side::BOTH.map(|side| {
            steering == Steering::On || self.merit(side, true) > self.merit(side, false)
        });
        let merit = Side::BOTH.map(|side| self.merit(side, self.steers(side)));
        let (better, worse) = if merit[0] >= merit[1] { (0, 1) } else { (1, 0) };
        if merit[better] > BETTER * merit[worse] {
            let work =
                Side::BOTH.map(|side| self.last(side, self.steers(side)).map_or(1.0, Round::work));
            self.turns[better] =
                (CERTIFICATE * work[worse] / work[better]).round().clamp(1.0, TURNS) as u32;
        }
    }
}

/// How well a field foretells what one step brings: x = what came/what was promised has mean 1 if
/// the field is right.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
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
    /// Takes one more.
    pub fn add(&mut self, x: f64) {
        self.n += 1;
        self.sum += x;
        self.squares += x * x;
        self.largest = self.largest.max(x);
    }

    /// Takes all of `other`.
    pub fn merge(&mut self, other: &Self) {
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

/// One batch of walks, and who kept its scores and who looked on.
#[derive(Debug)]
pub struct Watched<T, W> {
    /// Which walks.
    pub walks: Range<u64>,
    /// Their events.
    pub events: u64,
    /// Their scores.
    pub tally: T,
    /// What was noted.
    pub observer: W,
}

/// Walks `walks` on all threads, in batches that stand in order: the same for any number of
/// threads. `begin` makes the tally and the observer of a batch of so many walks.
pub fn watch<P: TransportProblem, T: Tally<P::Value> + Send, W: WalkObserver<P> + Send>(
    problem: &P,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
    begin: impl Fn(u64) -> (T, W) + Sync,
) -> Vec<Watched<T, W>> {
    (walks.start / BATCH..walks.end.div_ceil(BATCH))
        .into_par_iter()
        .map_init(Workspace::default, |work, batch| {
            let walks = (batch * BATCH).max(walks.start)..((batch + 1) * BATCH).min(walks.end);
            let (mut tally, mut observer) = begin(walks.end - walks.start);
            let events = run_watched(
                problem,
                side,
                rule,
                seed,
                walks.clone(),
                work,
                &mut tally,
                &mut observer,
            );
            Watched { walks, events, tally, observer }
        })
        .collect()
}

/// No step yet.
const NONE: u32 = u32::MAX;

/// The tree of a batch's steps, each with a note: walks branch where they split, and what a branch
/// scores belongs to every step on its way (suffix scores, theory §5).
#[derive(Debug)]
pub struct Trace<S> {
    steps: Vec<Step<S>>,
    /// By row the step that it is on.
    on: Vec<u32>,
}

#[derive(Debug)]
struct Step<S> {
    parent: u32,
    score: f64,
    note: S,
}

impl<S> Default for Trace<S> {
    fn default() -> Self {
        Self { steps: Vec::new(), on: Vec::new() }
    }
}

impl<S> Trace<S> {
    /// `n` walks begin.
    pub fn begin(&mut self, n: usize) {
        self.on.clear();
        self.on.resize(n, NONE);
    }

    /// Rows `rows` are the rows now.
    pub fn follow(&mut self, rows: &[u32]) {
        self.on = rows.iter().map(|&row| self.on[row as usize]).collect();
    }

    /// Row `row` makes a step.
    pub fn step(&mut self, row: usize, note: S) {
        self.steps.push(Step { parent: self.on[row], score: 0.0, note });
        self.on[row] = self.steps.len() as u32 - 1;
    }

    /// The step that row `row` is on, and what it has scored itself.
    pub fn at(&mut self, row: usize) -> Option<(&mut S, f64)> {
        self.steps.get_mut(self.on[row] as usize).map(|step| (&mut step.note, step.score))
    }

    /// Row `row` scores.
    pub fn score(&mut self, row: usize, value: f64) {
        if let Some(step) = self.steps.get_mut(self.on[row] as usize) {
            step.score += value;
        }
    }

    /// All steps in the order in which they were made, each with all that was scored from there on.
    pub fn suffixes(mut self) -> impl Iterator<Item = (S, f64)> {
        for i in (0..self.steps.len()).rev() {
            let (score, parent) = (self.steps[i].score, self.steps[i].parent);
            if let Some(parent) = self.steps.get_mut(parent as usize) {
                parent.score += score;
            }
        }
        self.steps.into_iter().map(|step| (step.note, step.score))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sides whose walks score 1 ± `spread` at `events` each, unsteered and steered.
    struct Scripted {
        spread: [[f64; 2]; 2],
        events: u64,
        called: Vec<(u32, Side, u64)>,
    }

    impl Scripted {
        fn new(spread: [[f64; 2]; 2]) -> Self {
            Self { spread, events: 5, called: Vec::new() }
        }
    }

    impl Process for Scripted {
        fn walk(&mut self, number: u32, side: Side, walks: u64) -> Walked {
            self.called.push((number, side, walks));
            // As in earnest: the primal's first round has nothing to be steered by; here the dual's
            // neither.
            let steered = number > 0;
            let spread = self.spread[side as usize][usize::from(steered)];
            let mut scores = Scores::default();
            (0..walks).for_each(|i| {
                scores.add(
                    if spread.is_nan() { 0.0 } else { 1.0 + spread * [1.0, -1.0][i as usize % 2] },
                    0,
                )
            });
            Walked { steered, scores, events: self.events * walks }
        }

        fn teach(&mut self, _: Side) -> usize {
            0
        }
    }

    const SCHEDULE: Schedule = Schedule { first: 16, rounds: 5 };

    fn course(spread: [[f64; 2]; 2], steering: Steering) -> (Course, Scripted) {
        let mut process = Scripted::new(spread);
        let course = alternate(&mut process, SCHEDULE, steering, &Job::default()).unwrap();
        (course, process)
    }

    #[test]
    fn sides_take_turns_and_rounds_double() {
        let (course, process) = course([[10.0, 0.1]; 2], Steering::Auto);
        let expected: Vec<_> =
            (0..5).flat_map(|k| Side::BOTH.map(|side| (k, side, 16 << k))).collect();
        assert_eq!((process.called, course.rounds.len()), (expected, 10));
        assert_eq!((course.steers, course.turns), ([true; 2], [1; 2]));
    }

    /// A steered event costs three: with the same scores steering loses by 3, which patience
    /// allows; by 4 it does not.
    #[test]
    fn learning_stops_where_it_does_not_pay() {
        let (early, _) = course([[0.5, 0.6]; 2], Steering::Auto);
        assert_eq!((early.rounds.len(), early.steers), (6, [false; 2]));
        let (late, _) = course([[0.5, 0.49]; 2], Steering::Auto);
        assert_eq!((late.rounds.len(), late.steers), (10, [false; 2]));
        let (forced, _) = course([[0.5, 0.6]; 2], Steering::On);
        assert_eq!((forced.rounds.len(), forced.steers), (10, [true; 2]));
        let (off, process) = course([[0.5, 0.1]; 2], Steering::Off);
        assert_eq!((off.steers, off.turns, process.called.len()), ([false; 2], [1; 2], 0));
    }

    /// Where no walk finds anything there is no reason to give up, and none to steer.
    #[test]
    fn learning_goes_on_while_nothing_is_found() {
        let (course, _) = course([[f64::NAN; 2]; 2], Steering::Auto);
        assert_eq!((course.rounds.len(), course.steers), (10, [false; 2]));
    }

    /// Each side is decided by itself; the better one gets six walks' work for one of the other's,
    /// in whole passes.
    #[test]
    fn the_better_side_gets_the_work() {
        let (course, _) = course([[0.5, 0.1], [0.5, 0.4]], Steering::Auto);
        assert_eq!(course.steers, [true, false]);
        // 1/(.1² · 15) against 1/(.5² · 5); a pass of the dual is 5 events a walk, one of the
        // primal counts for 15.
        assert_eq!(course.turns, [2, 1]);
        // Variances of 16 and of 256 numbers, unbiased.
        let expected = 25.0 / 3.0 * (16.0 / 15.0) * (255.0 / 256.0);
        assert!((course.gain() / expected - 1.0).abs() < 1e-9, "{}", course.gain());
    }

    #[test]
    fn a_cancelled_job_ends_it() {
        let job = Job::default();
        job.cancel();
        assert!(
            alternate(&mut Scripted::new([[0.5; 2]; 2]), SCHEDULE, Steering::On, &job).is_err()
        );
    }

    /// A walk that splits in two after its first step: what both find belongs to the first, and
    /// each to its own.
    #[test]
    fn suffixes_follow_the_branches() {
        let mut trace = Trace::default();
        trace.begin(2);
        trace.step(0, "a");
        trace.step(1, "b");
        trace.score(1, 8.0);
        trace.follow(&[0, 0]);
        trace.step(0, "aa");
        trace.step(1, "ab");
        trace.score(0, 1.0);
        trace.score(1, 2.0);
        assert_eq!(trace.at(1), Some((&mut "ab", 2.0)));
        assert_eq!(
            trace.suffixes().collect::<Vec<_>>(),
            [("a", 3.0), ("b", 8.0), ("aa", 1.0), ("ab", 2.0)]
        );
    }
}
