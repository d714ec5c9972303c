//! Training: cross entropy and soft Dice on crops of simulated slices.

use intrados_stage::{Job, random::Key};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    CLASSES, CT, Class, Network, Planes, Unet, shape, show,
    simulate::{Noise, Plan, SIDE, Section, SimulateError, sections},
    softmax,
};
use intrados_raster::{
    grid::Grid,
    network::{Optimiser, Schedule, mean},
};

/// How the network came to be: recorded beside the weights, and all that is needed to make them
/// again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Planes of the first level, a multiple of 4.
    pub base: usize,
    /// Seed of everything.
    pub seed: u64,
    /// What the slices show.
    #[serde(default)]
    pub plan: Plan,
    /// Simulated slices.
    pub slices: usize,
    /// Fields of noise of each colour.
    pub noises: usize,
    /// Steps of the optimiser.
    pub steps: usize,
    /// Crops a step.
    pub batch: usize,
    /// Edge of a crop, pixels, a multiple of 4.
    pub crop: usize,
    /// Highest learning rate, after a warm-up of 60 steps; it falls to 0 by half a cosine.
    pub rate: f32,
    /// Weight decay.
    pub decay: f32,
    /// Where a pore is said to end: grey that it lacks, at least and at most.
    pub level: [f32; 2],
    /// The level is this much, and so much of the deepest lack within two pixels.
    pub rise: [f32; 2],
    /// Width of the soft step at that level.
    pub softness: f32,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            base: 16,
            seed: 1,
            plan: Plan::Any,
            slices: 96,
            noises: 12,
            steps: 1500,
            batch: 8,
            crop: 96,
            rate: 2e-3,
            decay: 1e-4,
            level: [0.055, 0.085],
            rise: [0.04, 0.09],
            softness: 0.010,
        }
    }
}

/// What one crop shows and what it is.
struct TrainingSample {
    seen: Planes,
    /// Probability of each class.
    truth: Vec<[f32; CLASSES]>,
    /// What was measured.
    counts: Vec<bool>,
}

impl Recipe {
    /// The truth at a pixel whose grey lacks `pore` and `crack`, with the deepest lack around.
    fn truth(&self, [pore, crack]: [f32; 2], deepest: f32, steel: f32) -> [f32; CLASSES] {
        let level = (self.rise[0] + self.rise[1] * deepest).clamp(self.level[0], self.level[1]);
        let dark = 1.0 / (1.0 + (-(pore.max(crack) - level) / self.softness).exp());
        let steel = 1.0 / (1.0 + (-(steel - 0.5) / 0.1).exp());
        let share = if pore >= crack { [1.0, 0.0] } else { [0.0, 1.0] };
        let rest = 1.0 - steel;
        [rest * (1.0 - dark), rest * dark * share[0], rest * dark * share[1], steel]
    }

    fn lesson(&self, sections: &[Section], noise: &Noise, key: Key) -> TrainingSample {
        let n = self.crop;
        let section =
            &sections[((key.unit(10) * sections.len() as f32) as usize).min(sections.len() - 1)];
        // A crop that shows some body.
        let corner = |d: u32| (key.unit(d) * (SIDE - n) as f32) as usize;
        let middle = |[x, y]: [usize; 2]| section.solid.data[(y + n / 2) * SIDE + x + n / 2];
        let corners = (0..40).map(|k| [corner(20 + 2 * k), corner(21 + 2 * k)]);
        let [x0, y0] = corners.clone().find(|&c| middle(c)).unwrap_or([SIDE / 4; 2]);
        let contrast = 0.8 + 0.4 * key.unit(11);
        let gain = 1.0 + 0.008 * (key.unit(12) - 0.5);
        let level = section.noise * (0.8 + 0.4 * key.unit(13));
        let mixture = noise.mixture(key.split(1, 1));
        let (turn, flip) = ((key.unit(14) * 4.0) as usize, key.unit(15) < 0.5);
        let from = |x: usize, y: usize| {
            let x = if flip { n - 1 - x } else { x };
            let (x, y) = match turn {
                0 => (x, y),
                1 => (n - 1 - y, x),
                2 => (n - 1 - x, n - 1 - y),
                _ => (y, n - 1 - x),
            };
            (x0 + x, y0 + y)
        };
        let lacks = |i: usize| [contrast * section.pore.data[i], contrast * section.crack.data[i]];
        let deepest = |x: usize, y: usize| {
            let span = |c: usize| c.saturating_sub(2)..(c + 3).min(SIDE);
            let lack = |(x, y): (usize, usize)| lacks(y * SIDE + x).into_iter().fold(0.0, f32::max);
            span(y).flat_map(|y| span(x).map(move |x| (x, y))).map(lack).fold(0.0, f32::max)
        };
        let mut lesson =
            TrainingSample { seen: Planes::new(CT, n, n), truth: Vec::new(), counts: Vec::new() };
        for y in 0..n {
            let (mut grey, mut solid) = (Vec::with_capacity(n), Vec::with_capacity(n));
            for x in 0..n {
                let (u, v) = from(x, y);
                let i = v * SIDE + u;
                let [pore, crack] = lacks(i);
                // Contrast changes what pores and cracks lack, not the matrix.
                let plain =
                    section.pore.data[i].max(section.crack.data[i]) * (1.0 - section.steel.data[i]);
                let value = section.grey.data[i] + (1.0 - contrast) * plain + level * mixture(u, v);
                grey.push(gain * value);
                solid.push(section.solid.data[i]);
                lesson.truth.push(self.truth([pore, crack], deepest(u, v), section.steel.data[i]));
            }
            show(&grey, &solid, |plane, x, v| lesson.seen.row_mut(plane, y)[x] = v);
            lesson.counts.extend(solid);
        }
        lesson
    }
}

/// Cross entropy counts this often against soft Dice.
const ENTROPY: f32 = 2.0;

impl TrainingSample {
    /// The loss of `out` and its gradient: 2 × mean cross entropy over the body, and 1 − (2 Σpt +
    /// 1)/(Σp + Σt + 1) of the pores.
    fn loss(&self, out: &Planes) -> (f32, Planes) {
        let (w, h) = (out.width(), out.height());
        let body = self.counts.iter().filter(|&&c| c).count().max(1) as f32;
        let pixel = |i: usize| softmax(std::array::from_fn(|c| out.row(c, i / w)[i % w]));
        let pore = Class::Pore as usize;
        let (mut both, mut sum, mut entropy) = (1.0_f32, 1.0_f32, 0.0_f32);
        let chances: Vec<[f32; CLASSES]> = (0..w * h).map(pixel).collect();
        for ((p, t), _) in chances.iter().zip(&self.truth).zip(&self.counts).filter(|(_, c)| **c) {
            entropy -= p.iter().zip(t).map(|(p, t)| t * p.max(1e-12).ln()).sum::<f32>();
            both += 2.0 * p[pore] * t[pore];
            sum += p[pore] + t[pore];
        }
        let mut gradient = Planes::new(CLASSES, w, h);
        for (i, (p, t)) in
            chances.iter().zip(&self.truth).enumerate().filter(|(i, _)| self.counts[*i])
        {
            let dice = (both - 2.0 * t[pore] * sum) / (sum * sum);
            for c in 0..CLASSES {
                let through = p[pore] * (f32::from(u8::from(c == pore)) - p[c]);
                gradient.row_mut(c, i / w)[i % w] = ENTROPY * (p[c] - t[c]) / body + dice * through;
            }
        }
        (ENTROPY * entropy / body + 1.0 - both / sum, gradient)
    }
}

impl Network {
    /// Trains a network; `tell` hears each step and its loss. The same bits for any number of
    /// threads.
    ///
    /// # Errors
    /// The slices could not be simulated, or the job was cancelled.
    pub fn trained(
        recipe: &Recipe,
        job: &Job,
        mut tell: impl FnMut(usize, f32, &Self),
    ) -> Result<Self, SimulateError> {
        let sections = sections(recipe.plan, recipe.slices, recipe.seed, job)?;
        let noise = Noise::new(recipe.plan, recipe.noises, recipe.seed, job)?;
        let mut network = Self(Unet::untrained(shape(recipe.base), recipe.seed));
        let mut optimiser = Optimiser::new(network.0.weights().len());
        let schedule = Schedule { rate: recipe.rate, steps: recipe.steps };
        for step in 0..recipe.steps {
            job.step(step, recipe.steps)?;
            let learn = |i: usize| {
                let lesson = recipe.lesson(
                    &sections,
                    &noise,
                    Key::new(recipe.seed, 3 << 40 | (step * recipe.batch + i) as u64),
                );
                network.0.gradient(lesson.seen.clone(), |out| lesson.loss(out))
            };
            let learnt: Vec<(f32, Vec<f32>)> =
                (0..recipe.batch).into_par_iter().map(learn).collect();
            let (loss, gradient) = mean(&learnt);
            optimiser.step(network.0.weights_mut(), &gradient, schedule.at(step), recipe.decay);
            tell(step, loss, &network);
        }
        Ok(network)
    }
}

/// A simulated slice as it is read from a file, with noise: sound mortar 1, nothing 0.
#[must_use]
pub fn noisy(section: &Section, noise: &Noise, key: Key) -> Grid<f32> {
    let mixture = noise.mixture(key);
    let value = |i: usize| match section.solid.data[i] {
        true => (section.grey.data[i] + section.noise * mixture(i % SIDE, i / SIDE)).max(0.06),
        false => 0.0,
    };
    Grid { width: SIDE, height: SIDE, data: (0..SIDE * SIDE).map(value).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The gradient of the loss by what the network gives, against central differences.
    #[test]
    fn gradient_equals_differences() {
        let (w, h) = (20, 12);
        let key = Key::new(5, 0);
        let truth = (0..w * h)
            .map(|i| if i % 3 == 0 { [0.1, 0.6, 0.1, 0.2] } else { [0.7, 0.1, 0.2, 0.0] })
            .collect();
        let seen = Planes::new(CT, w, h);
        let lesson =
            TrainingSample { seen, truth, counts: (0..w * h).map(|i| i % 7 != 0).collect() };
        let mut out = Planes::new(CLASSES, w, h);
        for (plane, y) in (0..CLASSES).flat_map(|p| (0..h).map(move |y| (p, y))) {
            for (x, v) in out.row_mut(plane, y).iter_mut().enumerate() {
                *v = 4.0 * key.unit(((plane * h + y) * w + x) as u32) - 2.0;
            }
        }
        let (_, gradient) = lesson.loss(&out);
        for (plane, y) in (0..CLASSES).flat_map(|p| (0..h).map(move |y| (p, y))) {
            let x = (5 * plane + 7 * y) % w;
            let (old, step) = (out.row(plane, y)[x], 0.05);
            let [up, down] = [old + step, old - step].map(|v| {
                out.row_mut(plane, y)[x] = v;
                lesson.loss(&out).0
            });
            out.row_mut(plane, y)[x] = old;
            let (difference, told) = ((up - down) / (2.0 * step), gradient.row(plane, y)[x]);
            assert!(
                (difference - told).abs() < 0.03 * told.abs() + 2e-5,
                "plane {plane}, row {y}: {difference} and {told}"
            );
        }
    }
}
