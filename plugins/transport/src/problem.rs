use std::ops::Range;

use intrados_stage::random::Key;
use serde::{Deserialize, Serialize};

use crate::Value;

/// The two ways to walk, which give the same reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// From the response g toward the source σ: from the camera.
    Primal,
    /// From the source σ toward the response g: from the lamps.
    Dual,
}

impl Side {
    /// Primal, dual.
    pub const BOTH: [Self; 2] = [Self::Primal, Self::Dual];

    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::Primal => Self::Dual,
            Self::Dual => Self::Primal,
        }
    }
}

/// A transport problem Φ = KΦ + σ, I = ⟨g, Φ⟩ and its dual, in batches of walks.
///
/// Event 0 of a walk is its start: the sensor of a primal walk, the lamp of a dual one.
/// [`TransportProblem::scatter`] samples where it goes from an event, [`TransportProblem::fly`]
/// takes it to the next. The *far function* is what the walk looks for: σ for the primal, g for the
/// dual. What a walk finds by arriving at event k+1 and what [`TransportProblem::link`] finds from
/// event k are the same term of the Neumann series, order k (kernel applied k times), so that the
/// two share it by multiple importance sampling (Veach 1997, ch. 9).
///
/// All columns have one row a live walk, and all walks of a batch are at the same event. Every
/// method is a pure function of the problem, the rows and the keys.
pub trait TransportProblem: Sync {
    /// What walks carry.
    type Value: Value;
    /// Columns of states.
    type States: States;

    /// How many far functions a walk may find (a lamp-side walk finds every meter). Each has its
    /// own arrival and its own link.
    fn channels(&self, side: Side) -> usize;

    /// How many bins scores go to: pixels and meters of all channels.
    fn bins(&self) -> usize;

    /// Puts walks `walks` (numbers within the whole run) at event 0. `keys` has one key a walk.
    fn start(&self, side: Side, walks: Range<u64>, keys: &[Key], states: &mut Self::States);

    /// The far function where the walks have arrived. Rows that found nothing keep value 0. False:
    /// no row found anything.
    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &Self::States,
        ends: &mut Ends<Self::Value>,
    ) -> bool;

    /// Samples the far function itself and connects it with each event: value K·far/p, before
    /// visibility. False: nothing to link.
    fn link(
        &self,
        side: Side,
        channel: usize,
        event: u32,
        keys: &[Key],
        states: &mut Self::States,
        links: &mut Links<Self::Value>,
    ) -> bool;

    /// Zeroes the links that are blocked. Rows of value 0 need no look.
    fn reveal(&self, side: Side, states: &mut Self::States, links: &mut Links<Self::Value>);

    /// For walks that a field steers: what each is expected to score by going on from here
    /// (last-event walks: by ending here too), over the reading of a whole walk. Of that many
    /// copies (weight windows, theory §4) it asks. 0: no way leads on. Negative: the field knows
    /// nothing here, and −expected is the survival probability of a walk without it. False: nothing
    /// steers.
    fn expected_contribution(
        &self,
        _side: Side,
        _event: u32,
        _weight: &[Self::Value],
        _states: &mut Self::States,
        _expected: &mut [<Self::Value as Value>::Real],
    ) -> bool {
        false
    }

    /// Samples the kernel: the way on from each event, K/p and a survival probability near ∫K.
    fn scatter(
        &self,
        side: Side,
        event: u32,
        keys: &[Key],
        states: &mut Self::States,
        steps: &mut Steps<Self::Value>,
    );

    /// Takes each walk along its way to the next event.
    fn fly(&self, side: Side, states: &mut Self::States);
}

/// The numbers of a problem's densities.
pub type RealOf<P> = <<P as TransportProblem>::Value as Value>::Real;

/// Columns of walk states, of which the drive needs only this.
pub trait States: Default + Send {
    /// Keeps the rows `rows` (strictly increasing) of walks that are about to fly, in their order.
    fn gather(&mut self, rows: &[u32]);

    /// Makes rows `rows` (increasing; a row may come several times: a walk that splits) of walks
    /// that are about to scatter the rows. Only problems that are steered need it.
    fn repeat(&mut self, _rows: &[u32]) {}
}

/// Keeps the rows `rows` (strictly increasing) of one column.
pub fn keep<T: Copy>(column: &mut Vec<T>, rows: &[u32]) {
    for (to, &from) in rows.iter().enumerate() {
        column[to] = column[from as usize];
    }
    column.truncate(rows.len());
}

/// Makes rows `rows` (increasing, with repetitions) of one column its rows.
pub fn spread<T: Copy>(column: &mut Vec<T>, rows: &[u32]) {
    *column = rows.iter().map(|&row| column[row as usize]).collect();
}

/// The number of the random number that event `event` uses for purpose `index` (0–3 scatter, 4
/// survival, 5 absorption of steered walks, 8+4c… link of channel c).
#[must_use]
pub const fn dimension(event: u32, index: u32) -> u32 {
    event << 12 | index
}

/// What walks found by arriving.
#[derive(Debug, Default)]
pub struct Ends<V: Value> {
    /// Far function at the state. The other columns count only where this is not 0.
    pub value: Vec<V>,
    /// Bin that it is scored to.
    pub bin: Vec<u32>,
    /// Density with which the walk came here.
    pub kernel_density: Vec<V::Real>,
    /// Density with which a link from the event before would have come here, in the same measure; 0
    /// where no link can.
    pub link_density: Vec<V::Real>,
}

/// What walks found by linking.
#[derive(Debug, Default)]
pub struct Links<V: Value> {
    /// K·far/p. The other columns count only where this is not 0.
    pub value: Vec<V>,
    /// Bin that it is scored to.
    pub bin: Vec<u32>,
    /// Density p with which it was linked; infinite where no walk can arrive there by itself.
    pub link_density: Vec<V::Real>,
    /// Density with which the walk would have come there, in the same measure.
    pub kernel_density: Vec<V::Real>,
}

/// How walks go on.
#[derive(Debug, Default)]
pub struct Steps<V: Value> {
    /// K/p of the sampled way on; 0 ends the walk.
    pub factor: Vec<V>,
    /// Natural survival probability, near ∫K, in [0, 1]; 0 where no way leads on.
    pub survival: Vec<V::Real>,
}

impl<V: Value> Ends<V> {
    /// `n` empty rows.
    pub(crate) fn reset(&mut self, n: usize) {
        refill(&mut self.value, n);
        self.bin.resize(n, 0);
        self.kernel_density.resize(n, <V::Real as crate::Real>::ZERO);
        self.link_density.resize(n, <V::Real as crate::Real>::ZERO);
    }
}

impl<V: Value> Links<V> {
    /// `n` empty rows.
    pub(crate) fn reset(&mut self, n: usize) {
        refill(&mut self.value, n);
        self.bin.resize(n, 0);
        self.link_density.resize(n, <V::Real as crate::Real>::ZERO);
        self.kernel_density.resize(n, <V::Real as crate::Real>::ZERO);
    }
}

impl<V: Value> Steps<V> {
    /// `n` rows that end here.
    pub(crate) fn reset(&mut self, n: usize) {
        refill(&mut self.factor, n);
        refill(&mut self.survival, n);
    }
}

fn refill<T: Clone + Default>(column: &mut Vec<T>, n: usize) {
    column.clear();
    column.resize(n, T::default());
}
