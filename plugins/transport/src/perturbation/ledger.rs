//! What damages do to walks that know nothing of them.
//!
//! A walk scores s, a product of kernels over the densities that they were drawn by. Damage changes
//! kernels, not the drawing, so that the same walk of the damaged problem scores
//!
//! ```text
//! s(d) = s Π K_d/K        ∂s/∂d_j = s(d) Σ ∂ln K_d/∂d_j
//! ```
//!
//! over the steps on its way. Up to a step the walk's weight is a sample of the one field, and what
//! it scores from there on of the other: the sum over steps is ⟨Φ*, ∂K/∂d_j Φ⟩, of all damages and
//! readings at once, from either side.

use std::ops::Range;

use intrados_stage::{Cancelled, Job};

use super::Sensitivities;
use crate::{BATCH, Side, Tally, TransportProblem, WalkObserver, WalkRule, watch};

/// No visit.
const NONE: u32 = u32::MAX;
/// Batches between two looks at the job; fixed, so that sums are the same on any number of threads.
const ROUND: u64 = 16;
/// So much is left where damage is told to be whole: what is gone entirely has no slope.
const LEFT: f64 = 1e-9;

/// A damage as walks take it: within [0, 1), so that every kernel keeps a slope.
#[must_use]
pub fn severity(damage: f64) -> f64 {
    damage.clamp(0.0, 1.0 - LEFT)
}

/// What damages do to one factor of a score.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// K_d/K.
    pub factor: f64,
    /// ∂ln K_d/∂d by damage, where it is not 0.
    pub slopes: Vec<(u32, f64)>,
}

impl Default for Change {
    fn default() -> Self {
        Self { factor: 1.0, slopes: Vec::new() }
    }
}

impl Change {
    /// Nothing changes.
    pub fn clear(&mut self) {
        self.factor = 1.0;
        self.slopes.clear();
    }
}

/// What the damages on a walk's way have done: a factor, and the last of a chain of visits.
#[derive(Debug, Clone, Copy)]
struct Carried {
    factor: f64,
    last: u32,
}

#[derive(Debug, Clone, Copy)]
struct Row {
    walk: u32,
    /// On all steps up to here.
    come: Carried,
    /// The same with leaving from here.
    go: Carried,
}

#[derive(Debug, Clone, Copy)]
struct Visit {
    before: u32,
    damage: u32,
    slope: f64,
}

/// Keeps of one batch what damages did to its walks, and what those scored. A [`WalkObserver`]
/// writes it.
#[derive(Debug)]
pub struct SensitivityTally {
    damages: usize,
    rows: Vec<Row>,
    visits: Vec<Visit>,
    /// Cell (reading, then the reading itself or a damage), walk, value.
    entries: Vec<(u64, u32, f64)>,
}

impl SensitivityTally {
    /// Of so many damages.
    #[must_use]
    pub fn new(damages: usize) -> Self {
        Self { damages, rows: Vec::new(), visits: Vec::new(), entries: Vec::new() }
    }

    /// `n` walks begin.
    pub fn begin(&mut self, n: usize) {
        let none = Carried { factor: 1.0, last: NONE };
        self.rows.clear();
        self.rows.extend((0..n as u32).map(|walk| Row { walk, come: none, go: none }));
    }

    /// Rows `rows` are the rows now.
    pub fn follow(&mut self, rows: &[u32]) {
        self.rows = rows.iter().map(|&row| self.rows[row as usize]).collect();
    }

    fn extended(&mut self, carried: Carried, change: &Change) -> Carried {
        let mut last = carried.last;
        for &(damage, slope) in &change.slopes {
            self.visits.push(Visit { before: last, damage, slope });
            last = self.visits.len() as u32 - 1;
        }
        Carried { factor: carried.factor * change.factor, last }
    }

    /// The flight that has led row `row` to where it is.
    pub fn arrive(&mut self, row: usize, change: &Change) {
        let come = self.extended(self.rows[row].come, change);
        (self.rows[row].come, self.rows[row].go) = (come, come);
    }

    /// Leaving from where row `row` is, by whatever way.
    pub fn leave(&mut self, row: usize, change: &Change) {
        self.rows[row].go = self.extended(self.rows[row].come, change);
    }

    /// All rows leave.
    pub fn depart(&mut self) {
        self.rows.iter_mut().for_each(|row| row.come = row.go);
    }

    /// Row `row` scores `value` in a reading where it has arrived.
    pub fn found(&mut self, row: usize, reading: usize, value: f64) {
        let Row { walk, come, .. } = self.rows[row];
        self.enter(walk, come, reading, value, &[]);
    }

    /// Row `row` scores `value` in a reading by a link from where it is; `change` is that of the
    /// link alone.
    pub fn linked(&mut self, row: usize, reading: usize, value: f64, change: &Change) {
        let Row { walk, go, .. } = self.rows[row];
        self.enter(walk, go, reading, value * change.factor, &change.slopes);
    }

    fn enter(
        &mut self,
        walk: u32,
        carried: Carried,
        reading: usize,
        value: f64,
        slopes: &[(u32, f64)],
    ) {
        let (cell, value) = ((reading * (1 + self.damages)) as u64, value * carried.factor);
        self.entries.push((cell, walk, value));
        let mut at = carried.last;
        while let Some(&Visit { before, damage, slope }) = self.visits.get(at as usize) {
            self.entries.push((cell + 1 + u64::from(damage), walk, value * slope));
            at = before;
        }
        self.entries.extend(
            slopes
                .iter()
                .map(|&(damage, slope)| (cell + 1 + u64::from(damage), walk, value * slope)),
        );
    }
}

/// Σ x and Σ x² over walks, of readings and of what each damage does to them.
struct Sums {
    columns: usize,
    cells: Vec<[f64; 2]>,
}

impl Sums {
    fn new(readings: usize, damages: usize) -> Self {
        Self { columns: 1 + damages, cells: vec![[0.0; 2]; readings * (1 + damages)] }
    }

    /// What one walk brings to one cell is one number, or the second moment would be too small.
    fn take(&mut self, mut ledger: SensitivityTally) {
        ledger.entries.sort_by_key(|&(cell, walk, _)| (cell, walk));
        for one in ledger.entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let x: f64 = one.iter().map(|entry| entry.2).sum();
            let [sum, squares] = &mut self.cells[one[0].0 as usize];
            *sum += x;
            *squares += x * x;
        }
    }

    /// Means over `walks` walks and their standard errors.
    fn sensitivities(&self, walks: f64) -> Sensitivities {
        let mean = |[sum, _]: &[f64; 2]| sum / walks;
        let error = |cell: &[f64; 2]| {
            ((cell[1] / walks - mean(cell).powi(2)).max(0.0) / (walks - 1.0).max(1.0)).sqrt()
        };
        let rows = || self.cells.chunks(self.columns);
        Sensitivities {
            readings: rows().map(|row| mean(&row[0])).collect(),
            by_damage: rows().map(|row| row[1..].iter().map(mean).collect()).collect(),
            reading_errors: rows().map(|row| error(&row[0])).collect(),
            errors: rows().map(|row| row[1..].iter().map(error).collect()).collect(),
        }
    }
}

/// Nobody else wants the scores.
struct Unkept;

impl<V> Tally<V> for Unkept {
    fn score(&mut self, _: u32, _: u32, _: u32, _: V) {}
}

/// Readings and what damages do to them by walks `walks` of `problem`, of which one in `readings`
/// starts for each reading if `shared` is false, or all for all. `begin` makes the observer of a
/// batch, who keeps a [`SensitivityTally`] of readings `0..size[0]` and damages `0..size[1]`.
///
/// # Errors
/// [`Cancelled`] soon after the job was.
#[expect(clippy::too_many_arguments, reason = "a run's own, and what is read")]
pub fn differentiate<P: TransportProblem, W: WalkObserver<P> + Into<SensitivityTally> + Send>(
    problem: &P,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    walks: Range<u64>,
    size: [usize; 2],
    shared: bool,
    begin: impl Fn() -> W + Sync,
    job: &Job,
) -> Result<Sensitivities, Cancelled> {
    let mut sums = Sums::new(size[0], size[1]);
    let total = (walks.end - walks.start).div_ceil(BATCH);
    for round in (0..total).step_by(ROUND as usize) {
        job.step(round as usize, total as usize)?;
        let first = walks.start + round * BATCH;
        for part in
            watch(problem, side, rule, seed, first..(first + ROUND * BATCH).min(walks.end), |_| {
                (Unkept, begin())
            })
        {
            sums.take(part.observer.into());
        }
    }
    let all = (walks.end - walks.start) as f64;
    Ok(sums.sensitivities(if shared { all } else { all / size[0].max(1) as f64 }))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::{
        Estimator, Links, Perturbed, Schedule, Steering, alternate,
        matrix::{Learns, MatrixProblem, MatrixStates, Trainer},
        remainders,
    };

    /// Walks over a matrix, the way on from whose states damage k shortens: K_d(i, j) = K(i, j) Π
    /// (1 − d_k) over the k that hold i.
    struct Worn<'w> {
        ledger: SensitivityTally,
        holds: &'w [Vec<u32>],
        damage: &'w [f64],
        linking: bool,
    }

    impl From<Worn<'_>> for SensitivityTally {
        fn from(worn: Worn) -> Self {
            worn.ledger
        }
    }

    impl<P: TransportProblem<Value = f64, States = MatrixStates>> WalkObserver<P> for Worn<'_> {
        fn begin(&mut self, n: usize) {
            self.ledger.begin(n);
        }
        fn follow(&mut self, rows: &[u32]) {
            self.ledger.follow(rows);
        }
        fn depart(&mut self, _: u32, _: &MatrixStates, _: &[f64], _: &[f64]) {
            self.ledger.depart();
        }
        fn land(&mut self, _: u32, states: &MatrixStates, _: &[f64]) {
            self.linking = false;
            for (row, &place) in states.places().iter().enumerate() {
                let mut change = Change::default();
                for (k, _) in
                    self.holds.iter().enumerate().filter(|(_, held)| held.contains(&place))
                {
                    let left = 1.0 - severity(self.damage[k]);
                    change.factor *= left;
                    change.slopes.push((k as u32, -1.0 / left));
                }
                self.ledger.leave(row, &change);
            }
        }
        fn link(&mut self, _: u32, _: usize, _: &MatrixStates, _: &Links<f64>) {
            self.linking = true;
        }
        fn score(&mut self, row: usize, _: u32, value: f64) {
            match self.linking {
                true => self.ledger.linked(row, 0, value, &Change::default()),
                false => self.ledger.found(row, 0, value),
            }
        }
    }

    const STATES: usize = 12;

    struct Chain {
        kernel: DMatrix<f64>,
        ends: [DVector<f64>; 2],
        holds: Vec<Vec<u32>>,
        walks: u64,
        steered: bool,
    }

    impl Chain {
        fn new(walks: u64, steered: bool) -> Self {
            let kernel = DMatrix::from_fn(STATES, STATES, |i, j| {
                0.4 * (-(i.abs_diff(j) as f64) / 2.0).exp() * (1.0 + 0.1 * ((3 * i + j) % 4) as f64)
            });
            let end = |near: usize| {
                DVector::from_fn(STATES, |i, _| if i.abs_diff(near) < 3 { 1.0 } else { 0.0 })
            };
            Self {
                kernel: 0.5 * kernel,
                ends: [end(STATES - 1), end(0)],
                holds: vec![vec![5], vec![2, 7, 8], vec![8, 11]],
                walks,
                steered,
            }
        }

        fn problem(&self, damage: &[f64]) -> MatrixProblem {
            let left = |i: usize| {
                self.holds
                    .iter()
                    .zip(damage)
                    .filter(|(h, _)| h.contains(&(i as u32)))
                    .map(|(_, d)| 1.0 - d)
                    .product::<f64>()
            };
            let kernel = DMatrix::from_fn(STATES, STATES, |i, j| left(i) * self.kernel[(i, j)]);
            MatrixProblem::new(kernel, self.ends[0].clone(), self.ends[1].clone())
        }

        /// −Σ_i Φ*_i (KΦ)_i/(1 − d) over the states of each damage, by LU.
        fn exact(&self, damage: &[f64]) -> Vec<f64> {
            let exact = self.problem(damage).solve();
            let come = |i: u32| {
                exact.importance[i as usize] * (exact.field[i as usize] - self.ends[0][i as usize])
            };
            self.holds
                .iter()
                .zip(damage)
                .map(|(h, d)| -h.iter().map(|&i| come(i)).sum::<f64>() / (1.0 - d))
                .collect()
        }
    }

    impl Perturbed for Chain {
        type Error = Cancelled;

        fn damages(&self) -> usize {
            self.holds.len()
        }

        fn readings(&mut self, damage: &[f64]) -> Result<Vec<f64>, Cancelled> {
            Ok(self.sensitivities(damage)?.readings)
        }

        fn sensitivities(&mut self, damage: &[f64]) -> Result<Sensitivities, Cancelled> {
            let (problem, job) = (self.problem(&[0.0; 3]), Job::default());
            let worn = || Worn {
                ledger: SensitivityTally::new(3),
                holds: &self.holds,
                damage,
                linking: false,
            };
            let (side, walks) = (Side::Primal, 0..self.walks);
            let rule = WalkRule {
                estimator: if self.steered { Estimator::LastEvent } else { Estimator::NextEvent },
                ..WalkRule::default()
            };
            if !self.steered {
                return differentiate(&problem, side, &rule, 5, walks, [1, 3], true, worn, &job);
            }
            let mut trainer = Trainer::new(&problem, 1, Learns::Both);
            alternate(&mut trainer, Schedule { first: 1024, rounds: 3 }, Steering::On, &job)?;
            differentiate(&trainer.steer(side), side, &rule, 5, walks, [1, 3], true, worn, &job)
        }
    }

    /// Walks of the sound chain, by links and steered to their end, against ⟨Φ*, ∂K Φ⟩ of the worn
    /// one by LU: each within four standard errors (one false alarm in 1e4), which are below 1 %,
    /// so that an error of 4 % cannot pass. Steered walks split and play roulette meanwhile.
    #[test]
    fn walks_differentiate_as_matrices_do() {
        for (steered, damage) in
            [(false, [0.0; 3]), (false, [0.3, 0.1, 0.2]), (true, [0.0; 3]), (true, [0.2, 0.4, 0.0])]
        {
            let mut chain = Chain::new(400_000, steered);
            let found = chain.sensitivities(&damage).unwrap();
            let reading = chain.problem(&damage).solve().reading;
            assert!(
                (found.readings[0] - reading).abs() < 4.0 * found.reading_errors[0],
                "{steered}: {found:?} {reading}"
            );
            for ((found, error), exact) in
                found.by_damage[0].iter().zip(&found.errors[0]).zip(chain.exact(&damage))
            {
                assert!(
                    (found - exact).abs() < 4.0 * error && *error < 0.01 * exact.abs(),
                    "{steered}: {found} +- {error}, {exact}"
                );
            }
        }
    }

    /// On the same walks the remainder of the first order falls to a quarter.
    #[test]
    fn remainders_of_walks_fall_as_the_square() {
        for steered in [false, true] {
            let [[large, small]] = remainders(
                &mut Chain::new(20_000, steered),
                &[0.1, 0.0, 0.2],
                &[0.3, 1.0, 0.7],
                0.02,
            )
            .unwrap()[..] else {
                panic!("one reading")
            };
            assert!((large / small - 4.0).abs() < 0.1 && large != 0.0, "{large:e} {small:e}");
        }
    }
}
