//! Training on lessons: cross entropy of every kind of damage, soft Dice of cracks and of missing
//! cover.

use intrados_raster::network::{Optimiser, Planes, Schedule, Standardised, mean};
use intrados_stage::{Cancelled, Job, random::Key};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{MARKS, Network, PIXELS, lesson::Lesson, sample::Sample, score, shape, sight::CELL};

/// How the network came to be: recorded beside the weights, and all that is needed to make them
/// again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Planes of each level, multiples of 4.
    pub levels: Vec<usize>,
    /// Seed of the lessons.
    pub lessons_seed: u64,
    /// Rendered lessons.
    pub lessons: usize,
    /// Seed of everything else.
    pub seed: u64,
    /// Steps of the optimiser.
    pub steps: usize,
    /// Its highest rate.
    pub rate: f32,
    /// Crops a step.
    pub batch: usize,
    /// Edge of a crop, pixels, a multiple of 16.
    pub crop: usize,
    /// Weight decay.
    pub decay: f32,
    /// How often a crack's pixel counts in the cross entropy.
    pub crack: f32,
    /// Whether the network learns the other kinds alone, from crops of which half are drawn to
    /// show one of them.
    #[serde(default)]
    pub areas: bool,
}

/// How much the cross entropy of each kind counts where one network learns all.
const SHARES: [f32; MARKS] = [1.0, 0.5, 0.4, 0.4, 0.4];
/// How much soft Dice of each kind counts; of all but cracks in crops that show it, since most do
/// not, and what is rare would be forgotten.
const DICE: [f32; MARKS] = [0.5, 0.3, 0.3, 0.3, 0.3];
/// How often a pixel of what is no crack counts in the cross entropy.
const RARE: f32 = 3.0;

/// How much of the loss each kind is.
struct Shares {
    entropy: [f32; MARKS],
    dice: [f32; MARKS],
    crack: f32,
}

impl Shares {
    fn of(recipe: &Recipe) -> Self {
        match recipe.areas {
            true => Self { entropy: [0.0, 1.0, 1.0, 1.0, 1.0], dice: [0.5; MARKS], crack: 0.0 },
            false => Self { entropy: SHARES, dice: DICE, crack: recipe.crack },
        }
    }
}

impl Sample {
    /// The loss of `out` and its gradient by what the network gives.
    fn loss(&self, out: &Planes, shares: &Shares) -> (f32, Planes) {
        let (w, n) = (self.truth.width, self.truth.data.len());
        let mut gradient = Planes::new(MARKS * PIXELS, out.width(), out.height());
        let mut loss = 0.0;
        for mark in (0..MARKS).filter(|&mark| shares.entropy[mark] > 0.0) {
            let weight = if mark == 0 { shares.crack } else { RARE };
            let counts = |i: usize| self.counts.data[i][mark];
            let pixels = (0..n).filter(|&i| counts(i)).count().max(1) as f32;
            let chance: Vec<f32> =
                (0..n).map(|i| 1.0 / (1.0 + (-score(out, mark, [i % w, i / w])).exp())).collect();
            let (mut both, mut sum, mut entropy) = (1.0_f32, 1.0_f32, 0.0_f32);
            for i in (0..n).filter(|&i| counts(i)) {
                let (p, t) = (chance[i], self.truth.data[i][mark]);
                entropy -= weight * t * p.max(1e-7).ln() + (1.0 - t) * (1.0 - p).max(1e-7).ln();
                both += 2.0 * p * t;
                sum += p + t;
            }
            let shown = mark == 0 || self.truth.data.iter().any(|t| t[mark] > 0.5);
            let overlap = if shown { shares.dice[mark] } else { 0.0 };
            loss += shares.entropy[mark] * entropy / pixels + overlap * (1.0 - both / sum);
            for i in (0..n).filter(|&i| counts(i)) {
                let (p, t) = (chance[i], self.truth.data[i][mark]);
                let entropy = (1.0 - t) * p - weight * t * (1.0 - p);
                let dice = (both - 2.0 * t * sum) / (sum * sum) * p * (1.0 - p);
                let (x, y) = (i % w, i / w);
                let plane = mark * PIXELS + y % CELL * CELL + x % CELL;
                gradient.row_mut(plane, y / CELL)[x / CELL] =
                    shares.entropy[mark] * entropy / pixels + overlap * dice;
            }
        }
        (loss, gradient)
    }
}

impl Network {
    /// Trains a network on the lessons that `lesson` reads; `tell` hears each step, its loss and
    /// the network before it. The same bits for any number of threads.
    ///
    /// # Errors
    /// The job was cancelled.
    pub fn trained(
        recipe: &Recipe,
        lesson: impl Fn(usize) -> Lesson + Sync,
        job: &Job,
        mut tell: impl FnMut(usize, f32, &Self),
    ) -> Result<Self, Cancelled> {
        let mut training = Standardised::new(shape(&recipe.levels), recipe.seed);
        let mut optimiser = Optimiser::new(training.parameters().len());
        let schedule = Schedule { rate: recipe.rate, steps: recipe.steps };
        let showing = if recipe.areas {
            showing(recipe.lessons, &lesson)
        } else {
            <[Vec<usize>; MARKS]>::default()
        };
        for step in 0..recipe.steps {
            job.step(step, recipe.steps)?;
            let network = Self(training.network());
            let (loss, by_weights) = network.learnt(recipe, step, &showing, &lesson)?;
            let gradient = training.gradient(&by_weights);
            let rate = schedule.at(step);
            optimiser.step(training.parameters_mut(), &gradient, rate, recipe.decay);
            tell(step, loss, &network);
        }
        Ok(Self(training.network()))
    }

    /// The mean loss over the crops of a step, and its gradient.
    fn learnt(
        &self,
        recipe: &Recipe,
        step: usize,
        showing: &[Vec<usize>; MARKS],
        lesson: impl Fn(usize) -> Lesson + Sync,
    ) -> Result<(f32, Vec<f32>), Cancelled> {
        let shares = Shares::of(recipe);
        let learn = |i: usize| {
            let key = Key::new(recipe.seed, 3 << 40 | (step * recipe.batch + i) as u64);
            let wanted = (key.unit64(1) * (2 * MARKS - 2) as f64) as usize;
            let of = |count: usize| (key.unit64(0) * count as f64) as usize;
            let (number, about) = match showing.get(wanted).map(Vec::as_slice) {
                None | Some([]) => (of(recipe.lessons), None),
                Some(some) => (some[of(some.len())], Some(wanted)),
            };
            let mut sample = Sample::drawn(&lesson(number), recipe.crop, about, key.split(1, 0))?;
            if recipe.areas {
                sample.judge_stains();
            }
            let seen = sample.sight.cells([0, 0], [recipe.crop / CELL; 2]);
            Ok(self.0.gradient(seen, |out| sample.loss(out, &shares)))
        };
        let learnt: Vec<(f32, Vec<f32>)> =
            (0..recipe.batch).into_par_iter().map(learn).collect::<Result<_, Cancelled>>()?;
        Ok(mean(&learnt))
    }
}

/// Share of a lesson that a kind must cover to be shown by it.
const SHOWN: f64 = 0.003;

/// The lessons that show each kind but cracks.
fn showing(lessons: usize, lesson: impl Fn(usize) -> Lesson + Sync) -> [Vec<usize>; MARKS] {
    let shown = |number: usize| -> [bool; MARKS] {
        let labels = lesson(number).labels;
        std::array::from_fn(|mark| {
            let covered = labels.iter().filter(|l| l[mark] > 0.5).count();
            mark > 0 && covered as f64 > SHOWN * labels.len() as f64
        })
    };
    let all: Vec<[bool; MARKS]> = (0..lessons).into_par_iter().map(shown).collect();
    std::array::from_fn(|mark| (0..lessons).filter(|&n| all[n][mark]).collect())
}

#[cfg(test)]
mod tests {
    use intrados_light::patch::ORDERS;

    use super::*;

    fn recipe() -> Recipe {
        Recipe {
            levels: vec![4, 8],
            lessons_seed: 9,
            lessons: 2,
            seed: 1,
            steps: 4,
            rate: 3e-3,
            batch: 3,
            crop: 64,
            decay: 1e-4,
            crack: 5.0,
            areas: false,
        }
    }

    /// The gradient of the loss by what the network gives, against central differences.
    #[test]
    fn gradient_equals_differences() {
        let lesson = Lesson::render(9, 4, ORDERS, &Job::default()).unwrap();
        let sample = Sample::drawn(&lesson, 32, None, Key::new(1, 1)).unwrap();
        let shares = Shares::of(&recipe());
        let mut out = Planes::new(MARKS * PIXELS, 16, 16);
        let places: Vec<_> =
            (0..MARKS * PIXELS).flat_map(|p| (0..16).map(move |y| (p, y))).collect();
        for &(plane, y) in &places {
            for (x, v) in out.row_mut(plane, y).iter_mut().enumerate() {
                *v = 4.0 * Key::new(plane as u64, y as u64).unit(x as u32) - 2.0;
            }
        }
        let (_, gradient) = sample.loss(&out, &shares);
        for (plane, y) in places {
            let x = (3 * plane + 5 * y) % 16;
            let (old, step) = (out.row(plane, y)[x], 0.05);
            let [up, down] = [old + step, old - step].map(|v| {
                out.row_mut(plane, y)[x] = v;
                sample.loss(&out, &shares).0
            });
            out.row_mut(plane, y)[x] = old;
            let (difference, told) = ((up - down) / (2.0 * step), gradient.row(plane, y)[x]);
            assert!(
                (difference - told).abs() < 0.03 * told.abs() + 2e-5,
                "plane {plane}, row {y}: {difference} and {told}"
            );
        }
    }

    #[test]
    fn training_repeats_to_the_bit_on_any_number_of_threads() {
        let lessons: Vec<Lesson> =
            (0..2).map(|n| Lesson::render(9, n, ORDERS, &Job::default()).unwrap()).collect();
        let trained = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut losses = Vec::new();
            let read = |n: usize| lessons[n].clone();
            let tell = |_: usize, loss: f32, _: &Network| losses.push(loss);
            let network =
                pool.install(|| Network::trained(&recipe(), read, &Job::default(), tell)).unwrap();
            (network, losses)
        };
        let (one, losses) = trained(1);
        assert_eq!((&one, &losses), (&trained(3).0, &trained(2).1));
        assert!(losses.len() == 4 && losses.iter().all(|l| l.is_finite()));
    }
}
