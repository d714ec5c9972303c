//! Conduction of heat: ∫ ρc Ṫ δT + ∫ ∇δT · k ∇T = ∫ q δT, with films and radiation on faces
//! (Lewis, Nithiarasu and Seetharamu, *Fundamentals of the Finite Element Method for Heat and Fluid
//! Flow*, ch. 3 and 6). Newton's method where conductivity or radiation changes with temperature;
//! in time, Euler's backward steps, each also as two halves: their difference is the error, and
//! twice the halves less the whole is of second order.

use std::collections::HashMap;

use glam::DVec3;
use intrados_stage::Job;

use super::{
    constraint::Sum,
    element::{Element, Folded, pairs},
    free::Free,
    law::Table,
    model::{Cell, Deck, Heated, Heating, Step},
    shape::Shape,
    solve::{LinearError, Solved},
};
use crate::sparse::{BlockMatrix, Constraints, Method, SolveError, solve as direct};

/// The shape whose points heat is asked at: the one of C3D8R would leave temperatures open that
/// alternate from node to node.
fn warmed(element: &Element<'_>) -> Shape {
    match element.shape() {
        Shape::Hex8Mean => Shape::Hex8,
        shape => shape,
    }
}

/// Newton's steps; fewer than ten where nothing but radiation is nonlinear.
const STEPS: usize = 200;
/// Change of a temperature that counts as none, over the largest.
const SETTLED: f64 = 1e-11;
/// Error of a step of time before it is corrected, over the range of temperatures.
const ACCURACY: f64 = 1e-4;
/// Steps of time.
const TIMES: usize = 20_000;

/// Temperatures at the end of a step, from those at its beginning. `time`: the first increment and
/// the duration; none where nothing changes any more.
pub(super) fn solve(
    deck: &Deck,
    step: &Step,
    time: Option<[f64; 2]>,
    temperatures: &mut Vec<f64>,
    job: &Job,
) -> Result<Solved, LinearError> {
    let body = Body::new(deck, step);
    for (&node, &value) in &step.temperatures {
        temperatures[node as usize] = value;
    }
    match time {
        None => *temperatures = body.settled(temperatures, None, job)?,
        Some(times) => body.march(temperatures, times, job)?,
    }
    Ok(Solved {
        name: step.name.clone(),
        temperatures: temperatures[..deck.labels.len()].to_vec(),
        unknowns: body.free.count(),
        ..Solved::default()
    })
}

/// What is heated in a step.
struct Body<'a> {
    deck: &'a Deck,
    step: &'a Step,
    /// The nodes whose temperature is solved for.
    free: Free<'a>,
    loads: HashMap<u32, Vec<(Heated, [f64; 2])>>,
}

impl<'a> Body<'a> {
    fn new(deck: &'a Deck, step: &'a Step) -> Self {
        let sum = |node: u32| {
            let is_held = step.temperatures.contains_key(&node);
            let terms = if is_held { Vec::new() } else { vec![(node, 1.0)] };
            // Newton's method asks for changes, which are none where it is held.
            Sum { terms, constant: 0.0 }
        };
        let sums = (0..deck.nodes.len() as u32).map(sum).collect();
        let elements = deck.cells.iter().map(|cell| cell.nodes.clone());
        let free = Free::new(deck, sums, elements, |node| node);
        let mut loads: HashMap<u32, Vec<(Heated, [f64; 2])>> = HashMap::new();
        for (&heated, &value) in step.heating.iter().filter(|(h, _)| h.0 != Heating::Node) {
            loads.entry(heated.1).or_default().push((heated, value));
        }
        Self { deck, step, free, loads }
    }

    fn lost(&self, what: &'static str) -> LinearError {
        LinearError::unsettled(self.step, what)
    }

    /// Temperatures that balance, from a guess; `before` is what they were, and how long ago, s.
    fn settled(
        &self,
        guess: &[f64],
        before: Option<(&[f64], f64)>,
        job: &Job,
    ) -> Result<Vec<f64>, LinearError> {
        let (mut now, linear) = (guess.to_vec(), self.is_linear());
        for _ in 0..STEPS {
            let (matrix, mut rhs) = self.assembled(job, |e, k, f| {
                self.flow(e, &now, k, f)?;
                before.map_or(Ok(()), |(old, duration)| self.storage(e, &now, old, duration, k, f))
            })?;
            for (&(_, node, _), value) in
                self.step.heating.iter().filter(|(h, _)| h.0 == Heating::Node)
            {
                for &(free, factor) in &self.free.sum(node).terms {
                    if let Some(number) = self.free.number(free) {
                        rhs[number] += factor * value[0];
                    }
                }
            }
            if rhs.is_empty() {
                return Ok(now);
            }
            let none = Constraints::new(rhs.len());
            let found = direct(&matrix, &rhs, &none, Method::Direct, 1e-7, job);
            let change = found.map_err(|error| self.explained(error))?.x;
            self.free.order().iter().zip(&change).for_each(|(&n, d)| now[n as usize] += d);
            let largest = |all: &[f64]| all.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            if linear || largest(&change) <= SETTLED * largest(&now) {
                return Ok(now);
            }
        }
        Err(self.lost("temperatures"))
    }

    fn explained(&self, error: SolveError) -> LinearError {
        match error {
            SolveError::Indefinite { .. }
            | SolveError::NoStiffness { .. }
            | SolveError::NotConverged { .. } => {
                LinearError::Adrift { step: self.step.name.clone() }
            }
            other => other.into(),
        }
    }

    /// Whether nothing depends on the temperature.
    fn is_linear(&self) -> bool {
        let constant = |c: &Cell| {
            let material = &self.deck.materials[c.material as usize];
            let all = [&material.density, &material.specific_heat];
            material.conductivity.as_ref().is_none_or(Table::is_constant)
                && all.into_iter().flatten().all(Table::is_constant)
        };
        self.deck.cells.iter().all(constant)
            && self.step.heating.keys().all(|h| h.0 != Heating::Radiation)
    }

    /// Steps of time that are as long as their error allows, but never shorter than a tenth of what
    /// the deck begins with.
    fn march(
        &self,
        now: &mut Vec<f64>,
        [first, duration]: [f64; 2],
        job: &Job,
    ) -> Result<(), LinearError> {
        let (mut time, mut step) = (0.0, first.min(duration));
        for _ in 0..TIMES {
            job.step((1e4 * time / duration) as usize, 10_000)?;
            let left = duration - time;
            let ends = step >= left * (1.0 - 1e-9);
            let long = if ends { left } else { step };
            let whole = self.settled(now, Some((now, long)), job)?;
            let half = self.settled(now, Some((now, 0.5 * long)), job)?;
            let halves = self.settled(&half, Some((&half, 0.5 * long)), job)?;
            let range = |pick: fn(f64, f64) -> f64, from: f64| {
                self.deck
                    .cells
                    .iter()
                    .flat_map(|c| &c.nodes)
                    .fold(from, |a, &n| pick(pick(a, now[n as usize]), halves[n as usize]))
            };
            let size = range(f64::max, f64::MIN) - range(f64::min, f64::MAX);
            let apart = whole.iter().zip(&halves).map(|(a, b)| (a - b).abs());
            let error = apart.fold(0.0, f64::max) / (ACCURACY * size.max(1e-9));
            if error <= 1.0 || long <= 0.1 * first {
                *now = whole.iter().zip(&halves).map(|(a, b)| 2.0 * b - a).collect();
                time += long;
                if ends {
                    return Ok(());
                }
            }
            // The error of a step grows with its square.
            step = long * (0.9 / error.sqrt()).clamp(0.2, 3.0);
        }
        Err(self.lost("temperatures"))
    }

    /// Matrix and residual of what is free, of what `fill` says of elements.
    fn assembled(
        &self,
        job: &Job,
        fill: impl Fn(usize, &mut [f64], &mut [f64]) -> Result<(), Folded> + Sync,
    ) -> Result<(BlockMatrix<1>, Vec<f64>), LinearError> {
        self.free.assembled(job, |e| self.deck.cells[e].nodes.clone(), fill)
    }

    fn own(&self, e: usize, all: &[f64]) -> Vec<f64> {
        self.deck.cells[e].nodes.iter().map(|&n| all[n as usize]).collect()
    }

    /// Tangent and what flows into the nodes: conduction and everything that heats the element.
    fn flow(&self, e: usize, all: &[f64], k: &mut [f64], f: &mut [f64]) -> Result<(), Folded> {
        let (element, own) = (Element::new(self.deck, e), self.own(e, all));
        let n = own.len();
        let loads = self.loads.get(&(e as u32)).map_or(&[][..], Vec::as_slice);
        let volume: f64 = loads.iter().filter(|l| l.0.0 == Heating::Volume).map(|l| l.1[0]).sum();
        for (natural, weight) in warmed(&element).points() {
            let at = element.at(natural, weight)?;
            let here = at.value(&own);
            let law = element.material().conductivity.as_ref();
            let along = law.map_or([0.0; 3], |l| l.at(here));
            let frame = element.frame(at.place);
            let conducted = |slope: &[f64; 3]| -> DVec3 {
                let slope = DVec3::from_array(*slope);
                match &frame {
                    None => slope * DVec3::from_array(along),
                    Some(rows) => rows
                        .iter()
                        .zip(along)
                        .map(|(axis, k)| {
                            let axis = DVec3::from_array(*axis);
                            k * axis.dot(slope) * axis
                        })
                        .sum(),
                }
            };
            for (a, b) in pairs(n) {
                let flux =
                    at.volume * conducted(&at.slopes[a]).dot(DVec3::from_array(at.slopes[b]));
                k[a * n + b] += flux;
                f[a] -= flux * own[b];
            }
            for (f, jet) in f.iter_mut().zip(&at.jets) {
                *f += at.volume * volume * jet.value;
            }
        }
        for &((heating, _, face), value) in loads {
            self.surface(&element, (heating, usize::from(face), value), &own, k, f);
        }
        Ok(())
    }

    /// What flows through a face.
    fn surface(
        &self,
        element: &Element<'_>,
        (heating, face, [value, beyond]): (Heating, usize, [f64; 2]),
        own: &[f64],
        k: &mut [f64],
        f: &mut [f64],
    ) {
        let Some(nodes) = element.shape().faces().nth(face) else { return };
        for (jets, area) in element.face_points(face) {
            let area = area.length();
            let here: f64 = jets.iter().zip(nodes).map(|(j, &n)| j.value * own[n]).sum();
            // What flows in, and how much less by a degree.
            let (flux, slope) = match heating {
                Heating::Film => (value * (beyond - here), value),
                Heating::Radiation => {
                    let zero = self.deck.absolute_zero;
                    let (a, b) = (here - zero, beyond - zero);
                    (value * (b.powi(4) - a.powi(4)), 4.0 * value * a.powi(3))
                }
                Heating::Face => (value, 0.0),
                Heating::Node | Heating::Volume => continue,
            };
            for (ja, &a) in jets.iter().zip(nodes) {
                f[a] += area * flux * ja.value;
                for (jb, &b) in jets.iter().zip(nodes) {
                    k[a * own.len() + b] += area * slope * ja.value * jb.value;
                }
            }
        }
    }

    /// ∫ ρc N Nᵀ.
    fn capacity(&self, e: usize, all: &[f64], m: &mut [f64]) -> Result<(), Folded> {
        let (element, own) = (Element::new(self.deck, e), self.own(e, all));
        let n = own.len();
        for (natural, weight) in warmed(&element).fine_points() {
            let at = element.at(natural, weight)?;
            let here = at.value(&own);
            let heat = element.material().specific_heat.as_ref().map_or(0.0, |c| c.at(here)[0]);
            let by_volume = at.volume * element.density(here) * heat;
            for (a, b) in pairs(n) {
                m[a * n + b] += by_volume * at.jets[a].value * at.jets[b].value;
            }
        }
        Ok(())
    }

    /// What is stored by the second.
    fn storage(
        &self,
        e: usize,
        now: &[f64],
        old: &[f64],
        duration: f64,
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<(), Folded> {
        let n = f.len();
        let mut m = vec![0.0; n * n];
        self.capacity(e, now, &mut m)?;
        let change: Vec<f64> =
            self.own(e, now).iter().zip(self.own(e, old)).map(|(a, b)| a - b).collect();
        for (a, b) in pairs(n) {
            let rate = m[a * n + b] / duration;
            k[a * n + b] += rate;
            f[a] -= rate * change[b];
        }
        Ok(())
    }
}
