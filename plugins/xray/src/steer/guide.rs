//! How fields are learnt: rounds of walks from both sides, each steered by what all before have
//! found.

use std::ops::Range;

use intrados_stage::{Cancelled, Job, cpu_seconds};
use intrados_transport::{
    BATCH, Course, Process, Roulette, Schedule, Scores, Side, Steering, TransportProblem,
    WalkEstimate, WalkRule, Walked, alternate, watch,
};

use super::{
    Domain, PhotonField, SteeredPhotons,
    field::Taught,
    recorder::{Recorder, Totals},
};
use crate::{
    problem::{PhotonProblem, PhotonStates},
    scanner::Scanner,
    specimen::Specimen,
};

/// Walks of the first round over those of the schedule. They cost a quarter of a steered walk or
/// less, and the next round is steered by what they find.
const UNSTEERED: u64 = 16;
/// What a walk of the last round of learning counts in a reading, over one after it.
const LESSON: f64 = 0.5;

/// Both fields of one specimen in one scanner, ready to steer.
#[derive(Debug)]
pub struct Guide {
    domain: Domain,
    /// By side: the photons' flux steers the walks from the panel, importance those from the tube.
    fields: [PhotonField; 2],
    /// What a walk is expected to score.
    reading: f64,
    /// How learning went, and what it decided.
    pub course: Course,
    /// CPU-seconds spent on it.
    pub cpu_seconds: f64,
}

impl Guide {
    /// `plain` with the walks of `side` steered.
    #[must_use]
    pub fn steer<'a>(&'a self, plain: PhotonProblem<'a>, side: Side) -> SteeredPhotons<'a> {
        SteeredPhotons::new(plain, &self.domain, &self.fields[side as usize], side, self.reading)
    }

    /// Spoils both fields: every value times what `by` says for its number. For tests that a wrong
    /// field brings no bias.
    pub fn spoil(&mut self, by: impl Fn(u64) -> f32) {
        for table in self.fields.iter_mut().flat_map(|f| &mut f.tables) {
            table.iter_mut().zip(0..).for_each(|(value, k)| *value *= by(k));
        }
    }

    /// What `run`, walks of `side` that this guide steered, and the last round of learning say
    /// together: a walk of that round, steered by what was known before it, counts half. That is
    /// fixed beforehand; and as the run is unbiased whatever was learnt, the two do not correlate.
    #[must_use]
    pub fn with_learning(&self, side: Side, run: WalkEstimate) -> WalkEstimate {
        let Some(learning) = self.course.last(side, true).map(|round| round.scores.reading())
        else {
            return run;
        };
        let [a, b] = [LESSON * learning.walks as f64, run.walks as f64];
        WalkEstimate {
            mean: (a * learning.mean + b * run.mean) / (a + b),
            std_error: (a * learning.std_error).hypot(b * run.std_error) / (a + b),
            walks: learning.walks + run.walks,
        }
    }

    /// Memory of the fields, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(PhotonField::bytes).sum()
    }
}

/// The rule by which walks walk: unlimited, roulette by weight.
#[must_use]
pub fn rule() -> WalkRule {
    WalkRule { roulette: Roulette::Weight, roulette_from: 2, ..WalkRule::default() }
}

struct Trainer<'a> {
    specimen: &'a Specimen,
    scanner: &'a Scanner,
    links: usize,
    seed: u64,
    guide: Guide,
    gains: Vec<f64>,
    /// By side, then table: lessons since the field of that side was last corrected.
    taught: [[Vec<Taught>; 2]; 2],
    /// Walks behind the photons in them.
    photons: [f64; 2],
    walks: [u64; 2],
    /// Relative error of the reading that walks are expected to score.
    best: f64,
}

/// Learns the fields of `specimen` in `scanner`, primal and dual walks in turns. `links` pixels for
/// every collision of a walk from the tube.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
pub fn learn(
    specimen: &Specimen,
    scanner: &Scanner,
    links: usize,
    seed: u64,
    schedule: Schedule,
    steering: Steering,
    job: &Job,
) -> Result<Guide, Cancelled> {
    let begin = cpu_seconds();
    let problem = PhotonProblem::new(specimen, scanner);
    let domain = Domain::new(&problem);
    let fields = Side::BOTH.map(|side| PhotonField::guess(&problem, &domain, side));
    let guide =
        Guide { domain, fields, reading: f64::NAN, course: Course::default(), cpu_seconds: 0.0 };
    let blank = || vec![Taught::default(); guide.domain.bins()];
    let taught = Side::BOTH.map(|_| [blank(), blank()]);
    let gains = vec![1.0; scanner.panel.len() as usize];
    let mut trainer = Trainer {
        specimen,
        scanner,
        links,
        seed,
        guide,
        gains,
        taught,
        photons: [0.0; 2],
        walks: [0; 2],
        best: f64::INFINITY,
    };
    let course = alternate(&mut trainer, schedule, steering, job)?;
    // What the last walks from the tube found themselves.
    trainer.teach(Side::Dual);
    let mut guide = trainer.guide;
    guide.course = course;
    guide.cpu_seconds = cpu_seconds() - begin;
    Ok(guide)
}

impl Process for Trainer<'_> {
    fn walk(&mut self, number: u32, side: Side, walks: u64) -> Walked {
        let plain = PhotonProblem::new(self.specimen, self.scanner).linked(self.links);
        let walks = if number == 0 { UNSTEERED * walks } else { walks };
        let range =
            self.walks[side as usize]..self.walks[side as usize] + walks.div_ceil(BATCH) * BATCH;
        self.walks[side as usize] = range.end;
        self.photons[side.other() as usize] += (range.end - range.start) as f64;
        // Both sides show first what they can do alone.
        let steered = number > 0;
        let lesson = TrainingSample {
            side,
            walks: range,
            seed: !self.seed,
            domain: &self.guide.domain,
            gains: &self.gains,
        };
        let (scores, events) = if steered {
            let problem = self.guide.steer(plain, side);
            lesson.walk(&problem, &problem.plain, &mut self.taught)
        } else {
            lesson.walk(&plain, &plain, &mut self.taught)
        };
        let reading = scores.reading();
        if reading.rel_error() < self.best {
            (self.best, self.guide.reading) = (reading.rel_error(), reading.mean);
        }
        Walked { steered, scores, events }
    }

    /// Corrects the field of a side by its lessons, which are forgotten.
    fn teach(&mut self, side: Side) -> usize {
        let (side, taught) = (side as usize, &mut self.taught[side as usize]);
        self.guide.fields[side].learn(&self.guide.domain, taught, self.photons[side]);
        taught.iter_mut().for_each(|table| table.fill(Taught::default()));
        self.photons[side] = 0.0;
        self.guide.domain.lattice.len()
    }
}

/// Walks of one side, that teach.
struct TrainingSample<'l> {
    side: Side,
    walks: Range<u64>,
    seed: u64,
    domain: &'l Domain,
    gains: &'l [f64],
}

impl TrainingSample<'_> {
    fn walk<P: TransportProblem<Value = f64, States = PhotonStates>>(
        &self,
        problem: &P,
        plain: &PhotonProblem,
        taught: &mut [[Vec<Taught>; 2]; 2],
    ) -> (Scores, u64) {
        let Self { side, domain, gains, .. } = *self;
        let looks_on = |n| (Totals::new(side, gains, n), Recorder::new(plain, domain, side, gains));
        let (mut scores, mut events) = (Scores::default(), 0);
        let [primal, dual] = taught;
        let (own, other) = if side == Side::Primal { (primal, dual) } else { (dual, primal) };
        for part in watch(problem, side, &rule(), self.seed, self.walks.clone(), looks_on) {
            let half = (part.walks.start / BATCH % 2) as usize;
            part.tally.walks.iter().for_each(|&x| scores.add(x, half));
            events += part.events;
            part.observer.tell(other, own);
        }
        (scores, events)
    }
}
