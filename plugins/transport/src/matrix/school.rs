use intrados_stage::cpu_seconds;

use super::{MatrixField, MatrixLesson, MatrixProblem, MatrixStates, SteeredMatrix};
use crate::{
    Estimator, Rule, Scores, Side, Tally, Witness,
    field::Field,
    process::{Process, Round, Trace, watch},
};

/// Share of ways that ignore the field: while it is young, and later.
const DEFENCE: [f64; 2] = [0.3, 0.05];

/// What fields are learnt from. All but `Both` are there to be shown wanting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Learns {
    /// Photons of the other side and suffix scores of the own.
    #[default]
    Both,
    /// Photons alone.
    Photons,
    /// Suffix scores alone, as path guiding does.
    Suffixes,
    /// Photons of a dual side that is never steered itself.
    OneSided,
}

/// The two sides of a matrix problem, who learn from each other.
#[derive(Debug, Clone)]
pub struct School<'a> {
    problem: &'a MatrixProblem,
    seed: u64,
    learns: Learns,
    /// By side.
    pub fields: [MatrixField; 2],
    photons: [Vec<MatrixLesson>; 2],
    suffixes: [Vec<MatrixLesson>; 2],
    walks: [u64; 2],
    /// Of each round with a field, the rms of its one-step residual N/F − 1 (theory §5) over what the walks promised.
    pub residuals: [Vec<f64>; 2],
    pub smooth: bool,
    pub defence: [f64; 2],
}

impl<'a> School<'a> {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(problem: &'a MatrixProblem, seed: u64, learns: Learns) -> Self {
        Self {
            problem,
            seed,
            learns,
            fields: Side::BOTH.map(|side| MatrixField::nothing(problem, side)),
            photons: Default::default(),
            suffixes: Default::default(),
            walks: [0; 2],
            residuals: Default::default(),
            smooth: false,
            defence: DEFENCE,
        }
    }

    /// The walks of `side` as what has been learnt so far steers them.
    #[must_use]
    pub fn steer(&self, side: Side, defence: f64) -> SteeredMatrix<'a> {
        let steered = SteeredMatrix::new(self.problem, side, self.fields[side as usize].clone(), defence);
        // While the field does not reach the start, nobody can say what a walk is worth.
        let promise = steered.promise();
        if promise > 0.0 { steered.windowed(promise) } else { steered }
    }

    fn teach(&mut self, side: Side) {
        let of = side as usize;
        let photons = self.photons[side.other() as usize].iter().filter(|_| self.learns != Learns::Suffixes);
        let suffixes = self.suffixes[of].iter().filter(|_| matches!(self.learns, Learns::Both | Learns::Suffixes));
        let lessons = photons.chain(suffixes).copied().collect();
        self.fields[of] = MatrixField::learn(&(self.problem, side), lessons);
        if self.smooth {
            let far = self.problem.far(side);
            let t = nalgebra::DVector::from_fn(far.len(), |i, _| self.fields[of].value(&(i as u32)) + far[i]);
            self.fields[of] = MatrixField::new(self.problem, side, t);
        }
    }

    /// rms of N/F − 1, every state in proportion to the reading that the walks of weights `photons` promise there.
    fn residual(&self, side: Side, photons: &[MatrixLesson]) -> f64 {
        let (field, far) = (&self.fields[side as usize], self.problem.far(side));
        let (mut squares, mut all) = (0.0, 0.0);
        for photon in photons {
            let state = photon.state as usize;
            let (f, next) = (field.table()[state], field.value(&photon.state) + far[state]);
            if f > 0.0 {
                squares += photon.value * (next - f).powi(2) / f;
                all += photon.value * f;
            }
        }
        (squares / all).sqrt()
    }
}

/// Notes what a batch teaches.
struct Pupil {
    trace: Trace<(u32, f64)>,
}

impl Witness<SteeredMatrix<'_>> for Pupil {
    fn begin(&mut self, n: usize) {
        self.trace.begin(n);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.trace.follow(rows);
    }

    fn land(&mut self, _: u32, states: &MatrixStates, weight: &[f64]) {
        for (row, (&at, &weight)) in states.at.iter().zip(weight).enumerate() {
            self.trace.step(row, (at, weight));
        }
    }

    fn score(&mut self, row: usize, _: u32, value: f64) {
        self.trace.score(row, value);
    }
}

/// One score a walk.
struct Totals(Vec<f64>);

impl Tally<f64> for Totals {
    fn score(&mut self, walk: u32, _: u32, _: u32, value: f64) {
        self.0[walk as usize] += value;
    }
}

impl Process for School<'_> {
    fn round(&mut self, number: u32, side: Side, walks: u64) -> Round {
        let begin = cpu_seconds();
        let (own, from) = (side as usize, self.walks[side as usize]);
        if self.learns == Learns::OneSided && side == Side::Dual {
            self.fields[own] = MatrixField::nothing(self.problem, side);
        }
        let steered = !self.fields[own].is_empty();
        let problem = self.steer(side, self.defence[usize::from(number >= 2)]);
        let rule = Rule { estimator: Estimator::LastEvent, ..Rule::default() };
        let begin_batch = |n| (Totals(vec![0.0; n as usize]), Pupil { trace: Trace::default() });
        let (mut scores, mut events) = (Scores::default(), 0);
        self.photons[own].clear();
        self.suffixes[own].clear();
        for batch in watch(&problem, side, &rule, self.seed, from..from + walks, begin_batch) {
            events += batch.events;
            batch.tally.0.iter().zip(batch.walks).for_each(|(&x, walk)| scores.add(x, (walk % 2) as usize));
            for ((state, weight), score) in batch.witness.trace.suffixes() {
                self.photons[own].push(MatrixLesson { state, value: weight / walks as f64, photon: true });
                self.suffixes[own].push(MatrixLesson { state, value: score / weight, photon: false });
            }
        }
        self.walks[own] += walks;
        if steered {
            let residual = self.residual(side, &self.photons[own]);
            self.residuals[own].push(residual);
        }
        let middle = cpu_seconds();
        self.teach(side.other());
        if self.learns == Learns::Suffixes { self.teach(side); }
        let cells = self.fields[side.other() as usize].table().iter().filter(|&&f| f > 0.0).count();
        Round { side, steered, scores, events, cpu_seconds: [middle - begin, cpu_seconds() - middle], cells }
    }
}
