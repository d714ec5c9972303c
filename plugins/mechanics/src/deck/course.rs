//! How a load goes through the steps of a deck.

use super::{DeckError, unfit};
use crate::{model::interpolate, read::Deck};

/// (s, value), ascending.
pub(super) type Course = Vec<(f64, f64)>;

/// What a step says of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Given {
    pub(super) value: f64,
    pub(super) amplitude: Option<u32>,
}

/// When steps begin: one more than there are steps.
pub(super) struct Times(Vec<f64>);

impl Times {
    pub(super) fn new(deck: &Deck) -> Result<Self, DeckError> {
        let mut times = vec![0.0];
        for step in &deck.steps {
            if !(step.duration > 0.0 && step.duration.is_finite()) {
                return unfit(format!("{}: a duration of {} s", step.name, step.duration));
            }
            times.push(times[times.len() - 1] + step.duration);
        }
        Ok(Self(times))
    }

    pub(super) fn start(&self, step: usize) -> f64 {
        self.0[step]
    }

    pub(super) fn ends(&self, deck: &Deck) -> Vec<(String, f64)> {
        deck.steps.iter().map(|s| s.name.clone()).zip(self.0[1..].iter().copied()).collect()
    }

    /// When equilibria are looked for: at the ends of steps; where something `cracks`, at the ends of
    /// increments as long as each step's first one, of which a step has ten to a thousand.
    pub(super) fn moments(&self, deck: &Deck, cracks: bool) -> Vec<f64> {
        let mut moments = Vec::new();
        for (step, ends) in deck.steps.iter().zip(self.0.windows(2)) {
            let [from, to] = [ends[0], ends[1]];
            let first = step.increments[0].unwrap_or(to - from);
            let wanted = ((to - from) / first).round().clamp(10.0, 1000.0) as usize;
            let count = if cracks { wanted } else { 1 };
            moments.extend((1..count).map(|i| from + (to - from) * i as f64 / count as f64));
            moments.push(to);
        }
        moments
    }

    /// The course of a target from what each step says of it, counted from `start`, which is also
    /// what it goes back to where a step drops it.
    pub(super) fn course(
        &self,
        deck: &Deck,
        given: &[Option<Given>],
        start: f64,
    ) -> Result<Course, DeckError> {
        let mut course = vec![(0.0, 0.0)];
        for (k, step) in deck.steps.iter().enumerate() {
            let (from, to) = (self.0[k], self.0[k + 1]);
            let goal = given[k].map_or(0.0, |g| g.value - start);
            let amplitude =
                given[k].and_then(|g| Some((g.value, deck.amplitudes.get(g.amplitude? as usize)?)));
            match amplitude {
                Some((value, amplitude)) => {
                    if !amplitude.total_time && k > 0 && given[k] == given[k - 1] {
                        return unfit(format!(
                            "{}: amplitude {} is of step time and acts in two steps with one value; give it TIME=TOTAL TIME",
                            step.name, amplitude.name
                        ));
                    }
                    let shift = if amplitude.total_time { 0.0 } else { from };
                    let inner = amplitude
                        .points
                        .iter()
                        .map(|p| p.0 + shift)
                        .filter(|&t| t > from && t < to);
                    for time in std::iter::once(from).chain(inner).chain([to]) {
                        let factor = interpolate(&amplitude.points, time - shift).unwrap_or(1.0);
                        // It acts from the beginning of the step on.
                        let time = if time == from { from.next_up() } else { time };
                        course.push((time, factor * value - start));
                    }
                }
                None if step.ramp => course.push((to, goal)),
                None => course.extend([(from.next_up(), goal), (to, goal)]),
            }
        }
        Ok(course)
    }
}
