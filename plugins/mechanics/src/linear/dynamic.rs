//! Motion by the equations themselves: Newmark's method with the dissipation of Hilber, Hughes and
//! Taylor (1977), M a₁ = (1 + α) r₁ − α r₀ with r what is out of balance at both ends of an
//! increment, and Newton's method for it. Rayleigh's damping is that of each material.

use std::collections::BTreeMap;

use intrados_stage::Job;

use super::{
    element::Folded,
    large::{Settled, about, ends, of_element, settled, started, unbalanced},
    model::{Cell, Deck, Procedure, Step},
    plastic::Flow,
    shape::Shape,
    solve::{LinearError, Loads, Past, Solved, System, unknowns},
};
use crate::{
    sparse::{Constraints, Method, solve as direct},
    tensor,
};

/// Error of an increment, over the largest displacement, where increments are not fixed.
const ACCURACY: f64 = 1e-4;
/// Increments.
const MANY: usize = 1_000_000;
/// ‖f − M a‖ / ‖f‖ of accelerations at the beginning.
const TOLERANCE: f64 = 1e-7;
/// Part of the first increment in which what begins suddenly sets in: motions that are faster do not
/// take it up. Where that increment is cut, it sets in sooner.
const SUDDEN: f64 = 0.1;

/// The end of a step of motion.
pub(super) fn solve(
    deck: &Deck,
    step: &Step,
    past: &mut Past,
    job: &Job,
) -> Result<Solved, LinearError> {
    let Procedure::Dynamic { increment, fixed, duration, alpha } = step.procedure else {
        return Ok(Solved::default());
    };
    let course = Course { deck, step, past, alpha };
    let mut state = course.begun(SUDDEN * increment, job)?;
    let (mut long, mut count) = (increment, 0);
    while state.time < duration * (1.0 - 1e-9) {
        job.step((1e4 * state.time / duration) as usize, 10_000)?;
        count += 1;
        let left = duration - state.time;
        let length = if long >= left * (1.0 - 1e-9) { left } else { long };
        let found = if fixed {
            course.after(&state, length, job)?.map(|state| (state, long))
        } else {
            course.halved(&state, length, job)?
        };
        match found {
            Some(found) => (state, long) = found,
            None if !fixed && length > 1e-9 * duration => {
                long = 0.2 * length;
                if state.time == 0.0 {
                    state = course.begun(SUDDEN * long, job)?;
                }
            }
            None => count = MANY,
        }
        if count >= MANY {
            return Err(LinearError::unsettled(step, "displacements of an increment"));
        }
    }
    let now = step.at(duration);
    let system = course.system(&now, &state.place)?;
    let solved = if step.large {
        system.told(step.name.clone(), &state.place, ends(&system, &state.place, &state.flow)?.0)
    } else {
        system.finished(step.name.clone(), &state.place)?
    };
    (past.displacements, past.speeds, past.large) = (state.place, state.speed, step.large);
    past.flow = state.flow;
    past.stresses.clone_from(&solved.stresses);
    Ok(solved)
}

/// Where everything is in a step, how fast, and what is out of balance but for inertia.
struct State {
    time: f64,
    place: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    /// Of every element and spring.
    open: Vec<Vec<f64>>,
    /// At nodes.
    forces: BTreeMap<(u32, u8), f64>,
    /// What has flowed at every point.
    flow: Vec<Vec<Flow>>,
}

/// Matrices of an element by rows, and what is out of balance in it.
struct Own {
    mass: Vec<f64>,
    damping: Vec<f64>,
    stiffness: Vec<f64>,
    open: Vec<f64>,
}

struct Course<'a> {
    deck: &'a Deck,
    step: &'a Step,
    past: &'a Past,
    alpha: f64,
}

impl Course<'_> {
    /// The unknowns of the step as it is at a time.
    fn system<'b>(&'b self, now: &'b Step, all: &[f64]) -> Result<System<'b>, LinearError> {
        about(self.deck, now, self.past, self.deck.constraints(now, self.past), all)
    }

    fn unknowns(&self, e: usize) -> Vec<u32> {
        unknowns(self.deck, e, self.step.large)
    }

    /// An element or a spring where everything is there and so fast.
    fn own(
        &self,
        (system, loads): (&System<'_>, &Loads<'_>),
        e: usize,
        [place, speed]: [&[f64]; 2],
        flow: &[Vec<Flow>],
    ) -> Result<Own, Folded> {
        let n = place.len();
        let zeros = || vec![0.0; n * n];
        let mut own =
            Own { mass: zeros(), damping: zeros(), stiffness: zeros(), open: vec![0.0; n] };
        let is_element = e < self.deck.cells.len();
        if self.step.large {
            let (k, f) = (&mut own.stiffness, &mut own.open);
            unbalanced(system, loads, of_element(flow, e), e, place, k, f)?;
        } else {
            if is_element {
                let (element, warmth) = (system.element(e), system.warmth(e));
                let (k, f) = (&mut own.stiffness, &mut own.open);
                element.stiffness(&warmth, system.initial(e), k, f)?;
                loads.add(e, &element, &warmth, f)?;
            } else {
                self.deck.springs[e - self.deck.cells.len()].resist(&mut own.stiffness);
            }
            less(&mut own.open, &own.stiffness, place);
        }
        if is_element {
            let element = system.element(e);
            element.mass(Shape::finest_points, &system.warmth(e), &mut own.mass)?;
            let [mass, stiffness] = element.material().damping;
            let parts = own.mass.iter().zip(&own.stiffness);
            own.damping = parts.map(|(m, k)| mass * m + stiffness * k).collect();
            less(&mut own.open, &own.damping, speed);
        } else if !self.step.large {
            let spring = &self.deck.springs[e - self.deck.cells.len()];
            spring.outer(spring.drag(0.0), &mut own.damping);
            less(&mut own.open, &own.damping, speed);
        }
        Ok(own)
    }

    /// What holds an element against what begins suddenly, and its hidden motions as well.
    fn firm(&self, system: &System<'_>, e: usize, place: &[f64]) -> Result<Vec<f64>, Folded> {
        let (element, warmth) = (system.element(e).finest(), system.warmth(e));
        let (mut k, mut f) = (vec![0.0; place.len() * place.len()], vec![0.0; place.len()]);
        let none = |_| tensor::ZERO;
        if self.step.large {
            element.large(&element.moved(place), &warmth, none, &[], &mut k, &mut f)?;
        } else {
            element.stiffness(&warmth, none, &mut k, &mut f)?;
        }
        Ok(k)
    }

    /// β and γ of Newmark's method.
    fn weights(&self) -> [f64; 2] {
        [0.25 * (1.0 - self.alpha) * (1.0 - self.alpha), 0.5 - self.alpha]
    }

    /// The beginning, with the acceleration that forces then give by the method itself, from none
    /// before, after so short a time: M a = r where all of M moves slowly against that.
    fn begun(&self, sudden: f64, job: &Job) -> Result<State, LinearError> {
        let place = started(self.deck, self.past);
        let mut speed = self.past.speeds.clone();
        speed.resize(place.len(), 0.0);
        let flow = self.past.flow.clone();
        let now = self.step.at(0.0);
        let mut system = self.system(&now, &place)?;
        system.free.settle();
        let loads = system.distributed()?;
        let of = |e: usize, all: &[f64]| -> Vec<f64> {
            self.unknowns(e).into_iter().map(|u| all[u as usize]).collect()
        };
        let holds = (1.0 + self.alpha) * self.weights()[0] * sudden * sudden;
        let (mass, mut rhs) = system.assembled(job, |e, m, f| {
            let at = of(e, &place);
            let own = self.own((&system, &loads), e, [&at, &of(e, &speed)], &flow)?;
            // Of a metal its own points alone know what has flowed.
            let is_metal = |c: &Cell| self.deck.materials[c.material as usize].plastic.is_some();
            let is_firm = self.deck.cells.get(e).is_some_and(|c| !is_metal(c));
            let firm = if is_firm { self.firm(&system, e, &at)? } else { own.stiffness };
            let parts = own.mass.iter().zip(&firm);
            m.iter_mut().zip(parts).for_each(|(all, (m, k))| *all = m + holds * k);
            f.copy_from_slice(&own.open);
            Ok(())
        })?;
        system.nodal(&now.forces, &mut rhs)?;
        let none = Constraints::new(rhs.len());
        let free = if rhs.is_empty() {
            Vec::new()
        } else {
            direct(&mass, &rhs, &none, Method::Direct, TOLERANCE, job)?.x
        };
        let acceleration = system.free.expanded(&free);
        let open = self.open((&system, &loads), [&place, &speed], &flow)?;
        let (time, forces) = (0.0, now.forces.clone());
        Ok(State { time, place, speed, acceleration, open, forces, flow })
    }

    /// What is out of balance in every element and spring.
    fn open(
        &self,
        at: (&System<'_>, &Loads<'_>),
        [place, speed]: [&[f64]; 2],
        flow: &[Vec<Flow>],
    ) -> Result<Vec<Vec<f64>>, LinearError> {
        let open = |e: usize| {
            let of = |all: &[f64]| -> Vec<f64> {
                self.unknowns(e).into_iter().map(|u| all[u as usize]).collect()
            };
            let own = self.own(at, e, [&of(place), &of(speed)], flow);
            let label = || self.deck.cells.get(e).map_or(0, |cell| cell.label);
            Ok(own.map_err(|Folded| LinearError::Folded(label()))?.open)
        };
        (0..self.deck.cells.len() + self.deck.springs.len()).map(open).collect()
    }

    /// The end of an increment; none where it does not settle.
    fn after(&self, from: &State, long: f64, job: &Job) -> Result<Option<State>, LinearError> {
        let time = from.time + long;
        let now = self.step.at(time);
        let alpha = self.alpha;
        let [beta, gamma] = self.weights();
        let acceleration = |u: u32, place: f64| {
            let u = u as usize;
            let drift = from.place[u] + long * from.speed[u];
            let rest = (0.5 - beta) * long * long * from.acceleration[u];
            (place - drift - rest) / (beta * long * long)
        };
        let speed = |u: u32, acceleration: f64| {
            let (was, old) = (from.speed[u as usize], from.acceleration[u as usize]);
            was + long * ((1.0 - gamma) * old + gamma * acceleration)
        };
        let loads = self.system(&now, &from.place)?.distributed()?;
        let fill = |system: &System<'_>, all: &[f64], e: usize, k: &mut [f64], f: &mut [f64]| {
            let unknowns = self.unknowns(e);
            let place: Vec<f64> = unknowns.iter().map(|&u| all[u as usize]).collect();
            let accelerations: Vec<f64> =
                unknowns.iter().zip(&place).map(|(&u, &p)| acceleration(u, p)).collect();
            let speeds: Vec<f64> =
                unknowns.iter().zip(&accelerations).map(|(&u, &a)| speed(u, a)).collect();
            let own = self.own((system, &loads), e, [&place, &speeds], &from.flow)?;
            for (f, (open, old)) in f.iter_mut().zip(own.open.iter().zip(&from.open[e])) {
                *f += (1.0 + alpha) * open - alpha * old;
            }
            less(f, &own.mass, &accelerations);
            let parts = own.stiffness.iter().zip(own.damping.iter().zip(&own.mass));
            for (k, (stiffness, (damping, mass))) in k.iter_mut().zip(parts) {
                *k += (1.0 + alpha) * (stiffness + gamma / (beta * long) * damping)
                    + mass / (beta * long * long);
            }
            Ok::<_, Folded>(())
        };
        let mut forces = now.forces.clone();
        forces.values_mut().for_each(|force| *force *= 1.0 + alpha);
        for (&at, force) in &from.forces {
            *forces.entry(at).or_default() -= alpha * force;
        }
        let found = settled(&from.place, |all| self.system(&now, all), fill, &forces, job)?;
        let Some(Settled { all: place, .. }) = found else { return Ok(None) };
        let each = |all: &[f64], of: &dyn Fn(u32, f64) -> f64| -> Vec<f64> {
            (0..).zip(all).map(|(u, &value)| of(u, value)).collect()
        };
        let acceleration = each(&place, &acceleration);
        let speed = each(&acceleration, &speed);
        let system = self.system(&now, &place)?;
        let open = self.open((&system, &loads), [&place, &speed], &from.flow)?;
        let flows = self.step.large && self.deck.materials.iter().any(|m| m.plastic.is_some());
        let flow = if flows { ends(&system, &place, &from.flow)?.1 } else { from.flow.clone() };
        let forces = now.forces.clone();
        Ok(Some(State { time, place, speed, acceleration, open, forces, flow }))
    }

    /// The end of an increment by its halves where that is exact enough, and the length of the next.
    fn halved(
        &self,
        from: &State,
        long: f64,
        job: &Job,
    ) -> Result<Option<(State, f64)>, LinearError> {
        let Some(whole) = self.after(from, long, job)? else { return Ok(None) };
        let Some(half) = self.after(from, 0.5 * long, job)? else { return Ok(None) };
        let Some(halves) = self.after(&half, 0.5 * long, job)? else { return Ok(None) };
        let largest = halves.place.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let apart = whole.place.iter().zip(&halves.place).map(|(a, b)| (a - b).abs());
        let error = apart.fold(0.0, f64::max) / (ACCURACY * largest.max(f64::MIN_POSITIVE));
        if error > 1.0 {
            return Ok(None);
        }
        // The error of an increment grows with its cube.
        Ok(Some((halves, long * (0.9 / error.cbrt()).clamp(0.5, 2.0))))
    }
}

/// f − K u.
fn less(f: &mut [f64], k: &[f64], u: &[f64]) {
    for (f, row) in f.iter_mut().zip(k.chunks(u.len().max(1))) {
        *f -= row.iter().zip(u).map(|(k, u)| k * u).sum::<f64>();
    }
}
