use super::{MatrixField, MatrixProblem, MatrixSample, MatrixStates, SteeredMatrix};
use crate::{
    Estimator, Scores, Side, Tally, WalkObserver, WalkRule,
    field::Field,
    process::{Process, Trace, Walked, watch},
};

/// Least and largest share of ways that ignore the field.
const DEFENCE: [f64; 2] = [1e-3, 0.3];

/// What fields are learnt from. All but `Both` are there to be shown wanting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Learns {
    /// Photons of the other side and suffix scores of the own.
    #[default]
    Both,
    /// Photons alone: the noise of their number remains.
    Photons,
    /// Suffix scores alone, as path guiding does: where no walk finds anything, nothing is learnt.
    Suffixes,
    /// Photons of a dual side that is never steered itself: they do not come where they are needed.
    OneSided,
}

/// The two sides of a matrix problem, who learn from each other: the complementary dual process
/// with nothing around it.
///
/// Walks are last-event walks with weight windows; a score 0 (they ended elsewhere) teaches too.
#[derive(Debug, Clone)]
pub struct Trainer<'a> {
    problem: &'a MatrixProblem,
    seed: u64,
    learns: Learns,
    /// By side, as all that follows: the field that steers it.
    fields: [MatrixField; 2],
    /// What the walks of the last round saw, and what they found.
    photons: [Vec<MatrixSample>; 2],
    suffixes: [Vec<MatrixSample>; 2],
    walks: [u64; 2],
    residuals: [Vec<f64>; 2],
}

impl<'a> Trainer<'a> {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(problem: &'a MatrixProblem, seed: u64, learns: Learns) -> Self {
        let fields = Side::BOTH.map(|side| MatrixField::nothing(problem, side));
        let (photons, suffixes) = Default::default();
        Self {
            problem,
            seed,
            learns,
            fields,
            photons,
            suffixes,
            walks: [0; 2],
            residuals: Default::default(),
        }
    }

    /// What steers the walks of a side.
    #[must_use]
    pub fn field(&self, side: Side) -> &MatrixField {
        &self.fields[side as usize]
    }

    /// Of each steered round of a side, the [residual](Self::residual) of the field that steered
    /// it, over its own walks.
    #[must_use]
    pub fn residuals(&self, side: Side) -> &[f64] {
        &self.residuals[side as usize]
    }

    /// The walks of `side` as what has been learnt so far steers them.
    #[must_use]
    pub fn steer(&self, side: Side) -> SteeredMatrix<'a> {
        // As far as the field contradicts itself, and no further, walks ignore it: with a fixed
        // share, that share would be the floor of the variance.
        let residual = self.residual(side);
        let defence =
            if residual.is_finite() { residual.clamp(DEFENCE[0], DEFENCE[1]) } else { DEFENCE[1] };
        let steered = SteeredMatrix::new(self.problem, side, self.field(side).clone(), defence);
        // While the field does not reach the start, nobody can say what a walk is worth.
        let promise = steered.promise();
        if promise > 0.0 { steered.windowed(promise) } else { steered }
    }

    /// The one-step residual of a side's field, rms of N/F − 1 (theory §5), every state in
    /// proportion to what the walks of the side's last round promised there. NaN where they
    /// promised nothing.
    #[must_use]
    pub(crate) fn residual(&self, side: Side) -> f64 {
        let (field, far) = (self.field(side), self.problem.far(side));
        let (mut squares, mut all) = (0.0, 0.0);
        for &MatrixSample { state, value, .. } in &self.photons[side as usize] {
            let f = field.table()[state as usize];
            let next = field.value(&state) + far[state as usize];
            if f > 0.0 {
                squares += value * (next - f).powi(2) / f;
                all += value * f;
            }
        }
        (squares / all).sqrt()
    }

    /// Notes what a round of `walks` walks has brought.
    fn note(&mut self, side: Side, walks: u64, trace: Trace<Visit>) {
        for (Visit { state, weight }, score) in trace.suffixes() {
            self.photons[side as usize].push(MatrixSample {
                state,
                value: weight / walks as f64,
                photon: true,
            });
            self.suffixes[side as usize].push(MatrixSample {
                state,
                value: score / weight,
                photon: false,
            });
        }
    }
}

impl Process for Trainer<'_> {
    fn walk(&mut self, _: u32, side: Side, walks: u64) -> Walked {
        let own = side as usize;
        let problem = self.steer(side);
        let rule = WalkRule { estimator: Estimator::LastEvent, ..WalkRule::default() };
        let numbers = self.walks[own]..self.walks[own] + walks;
        let batches = watch(&problem, side, &rule, self.seed, numbers, |n| {
            (Totals(vec![0.0; n as usize]), Recorder::default())
        });
        self.walks[own] += walks;
        self.photons[own].clear();
        self.suffixes[own].clear();
        let (mut scores, mut events) = (Scores::default(), 0);
        for batch in batches {
            events += batch.events;
            let scored = batch.tally.0.iter().zip(batch.walks);
            scored.for_each(|(&x, walk)| scores.add(x, (walk % 2) as usize));
            self.note(side, walks, batch.observer.0);
        }
        let steered = !self.field(side).is_empty();
        if steered {
            let residual = self.residual(side);
            self.residuals[own].push(residual);
        }
        Walked { steered, scores, events }
    }

    fn teach(&mut self, side: Side) -> usize {
        let own = side as usize;
        if self.learns != Learns::OneSided || side == Side::Primal {
            let photons = self.photons[side.other() as usize].iter();
            let photons = photons.filter(|_| self.learns != Learns::Suffixes);
            let both = matches!(self.learns, Learns::Both | Learns::Suffixes);
            let suffixes = self.suffixes[own].iter().filter(|_| both);
            let lessons = photons.chain(suffixes).copied().collect();
            self.fields[own] = MatrixField::learn(&(self.problem, side), lessons);
        }
        self.fields[own].table().iter().filter(|&&f| f > 0.0).count()
    }
}

/// A walk has come to a state.
#[derive(Debug, Clone, Copy)]
struct Visit {
    state: u32,
    weight: f64,
}

/// Notes what a batch teaches.
#[derive(Debug, Default)]
struct Recorder(Trace<Visit>);

impl WalkObserver<SteeredMatrix<'_>> for Recorder {
    fn begin(&mut self, n: usize) {
        self.0.begin(n);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.0.follow(rows);
    }

    fn land(&mut self, _: u32, states: &MatrixStates, weight: &[f64]) {
        for (row, (&state, &weight)) in states.at.iter().zip(weight).enumerate() {
            self.0.step(row, Visit { state, weight });
        }
    }

    fn score(&mut self, row: usize, _: u32, value: f64) {
        self.0.score(row, value);
    }
}

/// One score a walk.
struct Totals(Vec<f64>);

impl Tally<f64> for Totals {
    fn score(&mut self, walk: u32, _: u32, _: u32, value: f64) {
        self.0[walk as usize] += value;
    }
}
