//! Motion and vibration by modes: with φᵀ M φ = 1 each mode is a mass of one on a spring of λ,
//! ẍ + 2 s ẋ + λ x = φᵀ f (Clough and Penzien, *Dynamics of Structures*, ch. 12). Forces are linear
//! within an increment, for which that has a closed form. Where supports move, everything is
//! carried with them as if they moved slowly, u = U b, and the modes feel its inertia,
//! −φᵀ M U (b̈ + α ḃ), with the second difference of b over increments.

use std::f64::consts::TAU;

use intrados_stage::Job;
use nalgebra::{DMatrix, DVector};

use super::{
    model::{Course, Damping, Deck, Procedure, Spring, Step},
    modes::{Mode, dot},
    solve::{LinearError, Past, Solved, System},
};
use crate::model::interpolate;

/// Modes of the last step of frequencies.
pub(super) struct Modes {
    /// The unknowns that they are over.
    pub(super) order: Vec<u32>,
    pub(super) all: Vec<Mode>,
    /// Where each is and how fast, at the end of the last step of motion; empty: at rest.
    pub(super) state: Vec<[f64; 2]>,
}

/// Modes whose eigenvalue is less, over the largest, are held by nothing.
const FREE: f64 = 1e-9;
/// Frequencies that differ by less of themselves are one.
const SAME: f64 = 1e-6;

/// The end of a step of motion, or the real and the imaginary part at every frequency of a step of
/// vibrations.
pub(super) fn solve(
    deck: &Deck,
    step: &Step,
    past: &mut Past,
    job: &Job,
) -> Result<Vec<Solved>, LinearError> {
    let still = System::new(deck, step, past)?;
    let others = || LinearError::OtherModes { step: step.name.clone() };
    let modes = past.modes.as_ref().filter(|m| m.order == still.free.order()).ok_or_else(others)?;
    let part = |course| Part::new(deck, course, (&still, modes), past, job);
    let parts = step.courses.iter().map(part).collect::<Result<Vec<_>, _>>()?;
    let drags = drags(deck, &still, modes);
    let swings = Swings { modes, step, parts: &parts, drags };
    match step.procedure {
        Procedure::Harmonic { range, points, bias } => {
            let frequencies = frequencies(&modes.all, range, points, bias);
            let pairs = frequencies.into_iter().map(|f| swings.at_frequency(f, &still));
            Ok(pairs.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
        }
        Procedure::Motion { increment, duration } => {
            let state = swings.at_end(increment, duration, job)?;
            let carried = parts.iter().map(|p| p.factor(duration)).collect::<Vec<_>>();
            let places: Vec<f64> = state.iter().map(|s| s[0]).collect();
            let all = swings.summed(&places, &carried, &still);
            let solved = still.finished(step.name.clone(), &all)?;
            if let Some(modes) = &mut past.modes {
                modes.state = state;
            }
            Ok(vec![solved])
        }
        _ => Ok(Vec::new()),
    }
}

/// Dashpots, and by how much a unit of each mode makes them longer.
fn drags<'a>(deck: &'a Deck, still: &System<'_>, modes: &Modes) -> Vec<(&'a Spring, Vec<f64>)> {
    let dashpots: Vec<&Spring> = deck.springs.iter().filter(|s| !s.drag.is_empty()).collect();
    if dashpots.is_empty() {
        return Vec::new();
    }
    let shapes: Vec<Vec<f64>> = modes.all.iter().map(|m| still.free.expanded(&m.shape)).collect();
    let longer = |spring: &Spring, shape: &Vec<f64>| -> f64 {
        spring.terms.iter().map(|&(u, f)| f * shape[u as usize]).sum()
    };
    dashpots.into_iter().map(|s| (s, shapes.iter().map(|u| longer(s, u)).collect())).collect()
}

/// What follows one course, as the modes feel it.
struct Part<'a> {
    points: &'a [(f64, f64)],
    /// Of every mode, and a quarter of a period before.
    forces: Vec<f64>,
    early: Vec<f64>,
    /// How everything moves with the supports; empty where they stand still.
    carried: Vec<f64>,
    /// φᵀ M U of every mode.
    inertia: Vec<f64>,
}

impl<'a> Part<'a> {
    fn new(
        deck: &Deck,
        course: &'a Course,
        (still, modes): (&System<'_>, &Modes),
        past: &Past,
        job: &Job,
    ) -> Result<Self, LinearError> {
        let loaded = System::new(deck, &course.loads, past)?;
        let of = |v: &[f64]| modes.all.iter().map(|m| dot(&m.shape, v)).collect::<Vec<f64>>();
        let mut early = vec![0.0; still.free.count()];
        loaded.nodal(&course.loads.early, &mut early)?;
        let mut part = Self {
            points: &course.points,
            forces: of(&loaded.forces(job)?),
            early: of(&early),
            carried: Vec::new(),
            inertia: vec![0.0; modes.all.len()],
        };
        if course.base.held.values().any(|value| *value != 0.0) {
            let (carried, pushed) = System::new(deck, &course.base, past)?.carried(job)?;
            (part.carried, part.inertia) = (carried, of(&pushed));
        }
        Ok(part)
    }

    fn factor(&self, at: f64) -> f64 {
        interpolate(self.points, at).unwrap_or(1.0)
    }
}

/// Modes that are pushed.
struct Swings<'a> {
    modes: &'a Modes,
    step: &'a Step,
    parts: &'a [Part<'a>],
    drags: Vec<(&'a Spring, Vec<f64>)>,
}

impl Swings<'_> {
    /// λ of a mode, 1/s²; nothing where nothing holds it.
    fn square(&self, mode: usize) -> f64 {
        let largest = self.modes.all.last().map_or(0.0, |m| m.value);
        let own = self.modes.all[mode].value;
        if own > FREE * largest { own } else { 0.0 }
    }

    /// Damping of all modes together at a frequency, with that of dashpots, 1/s.
    fn damped(&self, frequency: f64) -> DMatrix<f64> {
        let n = self.modes.all.len();
        let mut all =
            DMatrix::from_fn(n, n, |i, j| if i == j { 2.0 * self.damping(i) } else { 0.0 });
        for (spring, longer) in &self.drags {
            let longer = DVector::from_column_slice(longer);
            all += spring.drag(frequency) * &longer * longer.transpose();
        }
        all
    }

    /// Where modes that dashpots couple are after a time and how fast, under forces that grow evenly:
    /// the exponential of the system, with 1 and the time as further states.
    fn coupled(&self, state: &[[f64; 2]], force: &[[f64; 2]], time: f64) -> Vec<[f64; 2]> {
        let n = state.len();
        let damped = self.damped(0.0);
        let mut system = DMatrix::<f64>::zeros(2 * n + 2, 2 * n + 2);
        for i in 0..n {
            system[(i, n + i)] = time;
            system[(n + i, i)] = -time * self.square(i);
            for j in 0..n {
                system[(n + i, n + j)] = -time * damped[(i, j)];
            }
            system[(n + i, 2 * n)] = time * force[i][0];
            system[(n + i, 2 * n + 1)] = time * force[i][1];
        }
        system[(2 * n + 1, 2 * n)] = time;
        let mut begin = DVector::<f64>::zeros(2 * n + 2);
        for (i, [place, speed]) in state.iter().enumerate() {
            (begin[i], begin[n + i]) = (*place, *speed);
        }
        begin[2 * n] = 1.0;
        let end = system.exp() * begin;
        (0..n).map(|i| [end[i], end[n + i]]).collect()
    }

    /// Real and imaginary part of modes that dashpots couple, under forces at a frequency.
    fn coupled_at(&self, frequency: f64, force: &[[f64; 2]]) -> Option<[Vec<f64>; 2]> {
        let (n, pace) = (force.len(), TAU * frequency);
        let damped = self.damped(frequency);
        let mut system = DMatrix::<f64>::zeros(2 * n, 2 * n);
        for i in 0..n {
            let inert = self.square(i) - pace * pace;
            (system[(i, i)], system[(n + i, n + i)]) = (inert, inert);
            for j in 0..n {
                system[(i, n + j)] = -pace * damped[(i, j)];
                system[(n + i, j)] = pace * damped[(i, j)];
            }
        }
        let forces = DVector::from_fn(2 * n, |i, _| force[i % n][i / n]);
        let found = system.lu().solve(&forces)?;
        Some([0, n].map(|from| (from..from + n).map(|i| found[i]).collect()))
    }

    /// s of a mode, 1/s.
    fn damping(&self, mode: usize) -> f64 {
        let square = self.square(mode);
        match &self.step.damping {
            Damping::None => 0.0,
            Damping::Rayleigh { mass, stiffness } => 0.5 * (mass + stiffness * square),
            Damping::Shares(shares) => shares.get(mode).copied().unwrap_or(0.0) * square.sqrt(),
        }
    }

    /// α, by which what is carried with the supports is damped too, 1/s.
    fn drag(&self) -> f64 {
        if let Damping::Rayleigh { mass, .. } = self.step.damping { mass } else { 0.0 }
    }

    /// Where every mode is at the end and how fast.
    fn at_end(
        &self,
        increment: Option<f64>,
        duration: f64,
        job: &Job,
    ) -> Result<Vec<[f64; 2]>, LinearError> {
        let count = self.modes.all.len();
        let mut state = self.modes.state.clone();
        state.resize(count, [0.0; 2]);
        let times = self.times(increment, duration);
        let long = increment.unwrap_or(duration);
        let mut before = self.pushed(0.0, long);
        for (k, pair) in times.windows(2).enumerate() {
            job.step(k, times.len())?;
            let after = self.pushed(pair[1], long);
            let length = pair[1] - pair[0];
            if !self.drags.is_empty() {
                let grown = before.iter().zip(&after).map(|(a, b)| [*a, (b - a) / length]);
                let grown: Vec<[f64; 2]> = grown.collect();
                state = self.coupled(&state, &grown, length);
                before = after;
                continue;
            }
            for (i, own) in state.iter_mut().enumerate() {
                let force = [before[i], (after[i] - before[i]) / length];
                let mode = [self.square(i), self.damping(i)];
                *own = swung(*own, mode, force, length);
            }
            before = after;
        }
        Ok(state)
    }

    /// Times between which forces are linear.
    fn times(&self, increment: Option<f64>, duration: f64) -> Vec<f64> {
        let inside = |t: &f64| *t > 1e-9 * duration && *t < duration * (1.0 - 1e-9);
        let mut times = vec![0.0];
        match increment {
            Some(increment) => {
                let count = (duration / increment).ceil() as u32;
                times.extend((1..=count).map(|k| f64::from(k) * increment).filter(inside));
            }
            None => {
                let corners = self.parts.iter().flat_map(|p| p.points.iter().map(|c| c.0));
                times.extend(corners.filter(inside));
                times.sort_unstable_by(f64::total_cmp);
                times.dedup();
            }
        }
        times.push(duration);
        times
    }

    /// Forces on the modes at a time; supports are differenced over `long`.
    fn pushed(&self, time: f64, long: f64) -> Vec<f64> {
        let mut all = vec![0.0; self.modes.all.len()];
        for part in self.parts {
            let at = |steps: f64| part.factor(time + steps * long);
            let speed = (at(1.0) - at(-1.0)) / (2.0 * long);
            let acceleration = (at(1.0) - 2.0 * at(0.0) + at(-1.0)) / (long * long);
            // Of the difference at the beginning, half of the increments that it spans are not there.
            let acceleration = if time == 0.0 { 2.0 * acceleration } else { acceleration };
            let felt = acceleration + self.drag() * speed;
            for (all, (force, inertia)) in all.iter_mut().zip(part.forces.iter().zip(&part.inertia))
            {
                *all += at(0.0) * force - felt * inertia;
            }
        }
        all
    }

    /// Real and imaginary part of what moves at a frequency, Hz.
    fn at_frequency(&self, frequency: f64, still: &System<'_>) -> Result<[Solved; 2], LinearError> {
        let pace = TAU * frequency;
        let factors: Vec<f64> = self.parts.iter().map(|p| p.factor(frequency)).collect();
        let mut places = [Vec::new(), Vec::new()];
        let mut forces = Vec::with_capacity(self.modes.all.len());
        let resonance = || LinearError::Resonance { step: self.step.name.clone(), frequency };
        for i in 0..self.modes.all.len() {
            let mut force = [0.0; 2];
            for (part, factor) in self.parts.iter().zip(&factors) {
                force[0] += factor * (part.forces[i] + pace * pace * part.inertia[i]);
                force[1] += factor * (part.early[i] - self.drag() * pace * part.inertia[i]);
            }
            forces.push(force);
            if !self.drags.is_empty() {
                continue;
            }
            let held = self.square(i);
            let resists = [held - pace * pace, 2.0 * self.damping(i) * pace];
            let square = resists[0] * resists[0] + resists[1] * resists[1];
            if square.sqrt() <= FREE * held {
                return Err(resonance());
            }
            places[0].push((force[0] * resists[0] + force[1] * resists[1]) / square);
            places[1].push((force[1] * resists[0] - force[0] * resists[1]) / square);
        }
        if !self.drags.is_empty() {
            places = self.coupled_at(frequency, &forces).ok_or_else(resonance)?;
        }
        let none = vec![0.0; factors.len()];
        let [real, imaginary] = [(&places[0], &factors, "real"), (&places[1], &none, "imaginary")]
            .map(|(places, carried, part)| {
                let name = format!("{}, {frequency:.9} Hz, {part} part", self.step.name);
                still.finished(name, &self.summed(places, carried, still))
            });
        Ok([real?, imaginary?])
    }

    /// Displacements of every unknown, of the modes and of what is carried with supports.
    fn summed(&self, places: &[f64], carried: &[f64], still: &System<'_>) -> Vec<f64> {
        let mut free = vec![0.0; still.free.count()];
        for (mode, place) in self.modes.all.iter().zip(places) {
            free.iter_mut().zip(&mode.shape).for_each(|(u, shape)| *u += place * shape);
        }
        let mut all = still.free.expanded(&free);
        for (part, factor) in self.parts.iter().zip(carried) {
            all.iter_mut().zip(&part.carried).for_each(|(u, own)| *u += factor * own);
        }
        all
    }
}

/// Where a mode of (λ, s) is and how fast after a time, under a force that grows evenly.
fn swung(
    [place, speed]: [f64; 2],
    [square, damping]: [f64; 2],
    force: [f64; 2],
    time: f64,
) -> [f64; 2] {
    if square == 0.0 {
        return drifted([place, speed], 2.0 * damping, force, time);
    }
    // It swings about where the force would hold it, which moves at this pace.
    let pace = force[1] / square;
    let rest = (force[0] - 2.0 * damping * pace) / square;
    let (place, speed) = (place - rest, speed - pace);
    let [cosine, sine] = faded(square, damping, time);
    [
        rest + pace * time + cosine * place + sine * (speed + damping * place),
        pace + cosine * speed - sine * (damping * speed + square * place),
    ]
}

/// The same of what nothing holds, ẍ + d ẋ = f₀ + f₁ t.
fn drifted([place, speed]: [f64; 2], drag: f64, force: [f64; 2], time: f64) -> [f64; 2] {
    let [alone, once, twice, thrice] = fading(drag * time);
    [
        place + time * (once * speed + time * (twice * force[0] + thrice * time * force[1])),
        alone * speed + time * (once * force[0] + twice * time * force[1]),
    ]
}

/// φₖ = Σ (−z)ʲ/(j + k)!: e⁻ᶻ, and it integrated once, twice and three times.
fn fading(z: f64) -> [f64; 4] {
    if z > 1.0 {
        let alone = (-z).exp();
        let once = (1.0 - alone) / z;
        let twice = (1.0 - once) / z;
        return [alone, once, twice, (0.5 - twice) / z];
    }
    let terms = (4..24).scan(1.0 / 6.0, |term, j| {
        let own = *term;
        *term *= -z / f64::from(j);
        Some(own)
    });
    let thrice: f64 = terms.sum();
    let twice = 0.5 - z * thrice;
    let once = 1.0 - z * twice;
    [1.0 - z * once, once, twice, thrice]
}

/// e⁻ˢᵗ cos rt and e⁻ˢᵗ sin(rt)/r, r² = λ − s², also where that is below 0.
fn faded(square: f64, damping: f64, time: f64) -> [f64; 2] {
    let below = square - damping * damping;
    let r = below.abs().sqrt();
    if below > 0.0 {
        let fade = (-damping * time).exp();
        return [fade * (r * time).cos(), fade * (r * time).sin() / r];
    }
    // The slow of both rates by their product, which is λ.
    let fast = damping + r;
    let slow = square / fast;
    let (slow, fast) = ((-slow * time).exp(), (-fast * time).exp());
    let sine = if r * time > 1e-7 { (slow - fast) / (2.0 * r) } else { time * slow };
    [0.5 * (slow + fast), sine]
}

/// Frequencies of a range, Hz: both ends, the modes between, and as many between two of these,
/// drawn to them by |ε|^(1/bias) with ε even over −1 … 1.
fn frequencies(modes: &[Mode], [from, to]: [f64; 2], points: u32, bias: f64) -> Vec<f64> {
    let mut ends = vec![from];
    ends.extend(
        modes.iter().map(|m| m.value.max(0.0).sqrt() / TAU).filter(|f| *f > from && *f < to),
    );
    ends.push(to);
    ends.dedup_by(|b, a| *b - *a <= SAME * *b);
    let mut all = vec![from];
    for pair in ends.windows(2) {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        all.extend((1..points).map(|k| {
            let even = 2.0 * f64::from(k) / f64::from(points - 1) - 1.0;
            middle + half * even.abs().powf(1.0 / bias).copysign(even)
        }));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, by: f64) {
        assert!((a - b).abs() <= by, "{a} is not {b} within {by}");
    }

    #[test]
    fn a_mass_on_a_spring_swings_about_where_its_force_holds_it() {
        // ẍ + 4 x = 8 from rest: 2 (1 − cos 2t).
        let [place, speed] = swung([0.0; 2], [4.0, 0.0], [8.0, 0.0], 0.7);
        near(place, 2.0 * (1.0 - 1.4f64.cos()), 1e-14);
        near(speed, 4.0 * 1.4f64.sin(), 1e-14);
        // Beyond critical by far, where exponentials of both signs would overflow.
        let [place, _] = swung([0.0; 2], [1e12, 1e9], [1e12, 0.0], 1.0);
        near(place, 1.0, 1e-12);
    }

    #[test]
    fn two_halves_of_a_time_are_the_whole() {
        for damping in [0.0, 0.3, 2.0, 2.0 + 1e-9, 7.0] {
            let mode = [4.0, damping];
            let whole = swung([0.3, -1.0], mode, [2.0, 5.0], 1.2);
            let half = swung([0.3, -1.0], mode, [2.0, 5.0], 0.6);
            let halves = swung(half, mode, [5.0, 5.0], 0.6);
            (0..2).for_each(|i| near(whole[i], halves[i], 1e-8));
        }
    }

    #[test]
    fn what_nothing_holds_goes_on() {
        let [place, speed] = swung([1.0, 2.0], [0.0, 0.0], [3.0, 6.0], 2.0);
        near(place, 1.0 + 4.0 + 6.0 + 8.0, 1e-13);
        near(speed, 2.0 + 6.0 + 12.0, 1e-13);
        // ẍ + 2 s ẋ = 1 + t, by halves of the time on both sides of where the series ends.
        for damping in [1e-9, 0.3, 0.6, 7.0] {
            let mode = [0.0, damping];
            let whole = swung([0.3, -1.0], mode, [1.0, 1.0], 1.0);
            let half = swung([0.3, -1.0], mode, [1.0, 1.0], 0.5);
            let halves = swung(half, mode, [1.5, 1.0], 0.5);
            (0..2).for_each(|i| near(whole[i], halves[i], 1e-13));
        }
        // ẍ + 2 ẋ = 1 from rest.
        let [place, _] = swung([0.0; 2], [0.0, 1.0], [1.0, 0.0], 1.0);
        near(place, 0.5 - 0.25 * (1.0 - (-2.0f64).exp()), 1e-14);
    }

    /// CalculiX on its deck `beamdy8`: a mode at 13 096 Hz in 12 000 … 14 000, five points.
    #[test]
    fn frequencies_gather_at_modes() {
        let value = (TAU * 13_096.031_057_66f64).powi(2);
        let found = frequencies(&[Mode { value, shape: Vec::new() }], [12e3, 14e3], 5, 3.0);
        let expected = [
            12e3,
            12_113.055_315_35,
            12_548.015_528_83,
            12_982.975_742_31,
            13_096.031_057_66,
            13_189.275_216_34,
            13_548.015_528_83,
            13_906.755_841_33,
            14e3,
        ];
        assert_eq!(found.len(), expected.len());
        found.iter().zip(expected).for_each(|(a, b)| near(*a, b, 1e-2));
    }
}
