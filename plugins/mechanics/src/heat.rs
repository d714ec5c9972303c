//! Conduction of heat: c ∂T/∂t = ∇·(k ∇T) + q, with heat of hydration inside and air at faces.
//!
//! In time by the θ rule, (C/Δt + θ K) T₁ = (C/Δt − (1 − θ) K) T₀ + q: θ = 1 is implicit Euler
//! (first order, never oscillates), ½ is Crank and Nicolson's (second order). K holds conduction
//! and the films of air, −h (T − T_air) on their faces. Heat of hydration is taken over the whole
//! step at the temperature of its beginning, so that what all steps release is exactly all of the
//! heat. The temperatures are what [`crate::model::Action::Temperature`] takes.

use std::sync::Arc;

use intrados_stage::Job;

use crate::{
    element::{ElementError, hex8, load::Face, scalar},
    material::thermal::Hydration,
    mesh::{ElementId, HexFace, Mesh},
    model::{Failure, interpolate},
    sparse::{
        BlockMatrix, Connectivity, Constraints, Method, Pattern, Place, Solver, assemble_vector,
    },
};

/// Largest residual of the linear equations, relative.
const TOLERANCE: f64 = 1e-10;

/// What a region is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conductor {
    /// W/(m·K).
    pub conductivity: f64,
    /// Heat capacity by volume, density times specific heat, J/(m³·K).
    pub capacity: f64,
    /// Heat that it makes while it hardens.
    pub hydration: Option<Hydration>,
    /// When it was poured, s: before, it is not there. Minus infinity: it was always there.
    pub birth: f64,
    /// Its temperature when poured.
    pub fresh: f64,
}

/// Air at a face.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Film {
    /// The face of the brick.
    pub face: HexFace,
    /// W/(m²·K).
    pub exchange: f64,
    /// (s, temperature) of the air, linear between.
    pub air: Vec<(f64, f64)>,
}

/// A node whose temperature is given.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Kept {
    /// Number of the node.
    pub node: u32,
    /// (s, temperature), linear between.
    pub history: Vec<(f64, f64)>,
}

/// Where heat flows. Temperatures may be in any scale, but hydration wants kelvin.
#[derive(Debug, Clone, Default)]
pub(crate) struct Conduction {
    /// One a region of the mesh.
    pub bodies: Vec<Conductor>,
    /// Air at faces; all other faces let no heat through.
    pub films: Vec<Film>,
    /// Nodes of given temperature.
    pub kept: Vec<Kept>,
    /// θ of the time rule: 1 implicit Euler, ½ Crank–Nicolson.
    pub theta: f64,
}

/// Temperatures at a moment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Warmth {
    /// s.
    pub time: f64,
    /// One a node.
    pub temperature: Vec<f64>,
    /// Equivalent age at the points of each brick, s.
    pub ages: Vec<[f64; 8]>,
}

/// Conduction on a mesh.
pub(crate) struct Heat<'m> {
    mesh: &'m Mesh,
    conduction: &'m Conduction,
    elements: Connectivity,
    matrix: BlockMatrix<1>,
    /// What solves for which step and which bodies.
    solver: Option<(f64, Vec<bool>, Solver<1>)>,
}

/// A step: from a state to a moment. Of infinite length: the steady state.
#[derive(Clone, Copy)]
struct Span<'a> {
    from: &'a Warmth,
    to: f64,
    duration: f64,
    theta: f64,
}

impl<'m> Heat<'m> {
    /// Prepares conduction.
    ///
    /// # Errors
    /// If bodies and mesh do not fit together.
    pub(crate) fn new(mesh: &'m Mesh, conduction: &'m Conduction) -> Result<Self, Failure> {
        if conduction.bodies.len() != mesh.regions.len() {
            return Err(Failure::Bodies {
                regions: mesh.regions.len(),
                bodies: conduction.bodies.len(),
            });
        }
        let mut elements: Connectivity = mesh.hexes.iter().map(|hex| hex.nodes).collect();
        conduction
            .films
            .iter()
            .for_each(|film| elements.push(&mesh.hexes[film.face.hex as usize].nodes));
        let places = mesh.nodes.iter().map(|p| Place::point(p.to_array())).collect();
        let matrix = BlockMatrix::zeros(Arc::new(Pattern::new(places, &elements)?));
        Ok(Self { mesh, conduction, elements, matrix, solver: None })
    }

    /// Everything at one temperature.
    #[must_use]
    pub(crate) fn rest(&self, time: f64, temperature: f64) -> Warmth {
        Warmth {
            time,
            temperature: vec![temperature; self.mesh.nodes.len()],
            ages: vec![[0.0; 8]; self.mesh.hexes.len()],
        }
    }

    /// The temperatures at a later time, in one step.
    ///
    /// # Errors
    /// A folded element, a part that no heat can leave or enter, or cancelled work.
    pub(crate) fn step(&mut self, from: &Warmth, to: f64, job: &Job) -> Result<Warmth, Failure> {
        let from = self.pour(from, to);
        let span = Span {
            from: &from,
            to,
            duration: to - from.time,
            theta: self.conduction.theta.clamp(0.0, 1.0),
        };
        let temperature = self.solve(span, job)?;
        Ok(Warmth { time: to, temperature, ages: self.aged(span) })
    }

    /// The temperatures that a state would come to if everything stayed as it is at its time,
    /// without heat of hydration.
    ///
    /// # Errors
    /// As [`Heat::step`].
    pub(crate) fn steady(&mut self, at: &Warmth, job: &Job) -> Result<Warmth, Failure> {
        let span = Span { from: at, to: at.time, duration: f64::INFINITY, theta: 1.0 };
        Ok(Warmth { temperature: self.solve(span, job)?, ..at.clone() })
    }

    fn body(&self, hex: usize) -> &Conductor {
        &self.conduction.bodies[self.mesh.hexes[hex].region as usize]
    }

    /// Nodes of bricks that come new and belonged to none that was there get the temperature of
    /// fresh concrete.
    fn pour(&self, from: &Warmth, to: f64) -> Warmth {
        let mut warmth = from.clone();
        let fresh = |hex: usize| self.body(hex).birth > from.time && self.body(hex).birth <= to;
        if !(0..self.mesh.hexes.len()).any(fresh) {
            return warmth;
        }
        let mut old = vec![false; self.mesh.nodes.len()];
        for hex in (0..self.mesh.hexes.len()).filter(|&hex| self.body(hex).birth <= from.time) {
            self.mesh.hexes[hex].nodes.iter().for_each(|&n| old[n as usize] = true);
        }
        for hex in (0..self.mesh.hexes.len()).filter(|&hex| fresh(hex)) {
            let nodes = self.mesh.hexes[hex].nodes.iter().filter(|n| !old[**n as usize]);
            nodes.for_each(|&n| warmth.temperature[n as usize] = self.body(hex).fresh);
        }
        warmth
    }

    fn solve(&mut self, span: Span, job: &Job) -> Result<Vec<f64>, Failure> {
        let mut constraints = Constraints::new(self.mesh.nodes.len());
        for kept in &self.conduction.kept {
            if let Some(value) = interpolate(&kept.history, span.to) {
                constraints.fix(kept.node as usize, 0, value)?;
            }
        }
        let alive: Vec<bool> = self.conduction.bodies.iter().map(|b| b.birth <= span.to).collect();
        let mut right = vec![0.0; self.mesh.nodes.len()];
        let (mesh, conduction) = (self.mesh, self.conduction);
        // The state's own rounding must not make a new factor.
        let fits =
            |old: f64| old == span.duration || (old - span.duration).abs() <= 1e-9 * span.duration;
        let kept = self.solver.take().filter(|(duration, of, _)| fits(*duration) && *of == alive);
        let mut solver = if let Some((_, _, solver)) = kept {
            assemble_vector::<1, Failure>(&self.elements, &mut right, job, |e, f| {
                element(mesh, conduction, span, e, &mut [], f)
            })?;
            solver
        } else {
            self.matrix.clear();
            self.matrix.assemble_with(&self.elements, &mut right, job, |e, k, f| {
                element(mesh, conduction, span, e, k, f)
            })?;
            Solver::new(&self.matrix, &constraints, Method::Auto, job)?
        };
        let mut temperature = solver.solve(&self.matrix, &right, &constraints, TOLERANCE, job)?.x;
        if alive.contains(&false) {
            self.keep_unborn(&alive, &span.from.temperature, &mut temperature);
        }
        self.solver = Some((span.duration, alive, solver));
        Ok(temperature)
    }

    /// Where nothing is yet, temperatures stay.
    fn keep_unborn(&self, alive: &[bool], old: &[f64], temperature: &mut [f64]) {
        let mut there = vec![false; old.len()];
        let living = self.mesh.hexes.iter().filter(|hex| alive[hex.region as usize]);
        living.flat_map(|hex| hex.nodes).for_each(|n| there[n as usize] = true);
        (0..old.len()).filter(|&n| !there[n]).for_each(|n| temperature[n] = old[n]);
    }

    fn aged(&self, span: Span) -> Vec<[f64; 8]> {
        let mut ages = span.from.ages.clone();
        for (hex, ages) in ages.iter_mut().enumerate() {
            let Some(hydration) =
                self.body(hex).hydration.filter(|_| self.body(hex).birth <= span.to)
            else {
                continue;
            };
            let corners = self.mesh.hexes[hex].nodes.map(|n| span.from.temperature[n as usize]);
            for (point, age) in ages.iter_mut().enumerate() {
                *age = hydration.released(*age, span.duration, at(point, &corners)).1;
            }
        }
        ages
    }
}

/// Matrix (if there is room for one) and right-hand side of a brick or a film.
fn element(
    mesh: &Mesh,
    conduction: &Conduction,
    span: Span,
    e: usize,
    k: &mut [f64],
    f: &mut [f64],
) -> Result<(), Failure> {
    let film = e.checked_sub(mesh.hexes.len()).map(|film| &conduction.films[film]);
    let hex = film.map_or(e, |film| film.face.hex as usize);
    let body = &conduction.bodies[mesh.hexes[hex].region as usize];
    if body.birth > span.to {
        return Ok(());
    }
    let corners = mesh.corners(hex as u32);
    let old = mesh.hexes[hex].nodes.map(|n| span.from.temperature[n as usize]);
    let failed = |source: ElementError| Failure::Element {
        element: mesh.name(ElementId::Hex(hex as u32)),
        source,
    };
    // Of T₁, of T₀, and what comes from outside.
    let (flow, stored, source) = match film {
        None => {
            let flow = scalar::laplace(&corners, |_| body.conductivity).map_err(failed)?;
            if span.duration.is_infinite() {
                (flow, None, [0.0; 8])
            } else {
                let stored =
                    scalar::mass(&corners, |_| body.capacity / span.duration).map_err(failed)?;
                let heat = |point: usize| {
                    let released = body.hydration.map_or(0.0, |h| {
                        h.released(span.from.ages[hex][point], span.duration, at(point, &old)).0
                    });
                    released / span.duration
                };
                (flow, Some(stored), scalar::source(&corners, heat).map_err(failed)?)
            }
        }
        Some(film) => {
            let (flow, unit) =
                scalar::film(&corners, Face::ALL[usize::from(film.face.face)], film.exchange)
                    .map_err(failed)?;
            let air = |time: f64| interpolate(&film.air, time).unwrap_or(0.0);
            let air = span.theta * air(span.to) + (1.0 - span.theta) * air(span.from.time);
            (flow, None, unit.map(|n| n * air))
        }
    };
    let stored = stored.unwrap_or_default();
    for (a, f) in f.iter_mut().enumerate() {
        *f = source[a]
            + (0..8)
                .map(|b| (stored[a][b] - (1.0 - span.theta) * flow[a][b]) * old[b])
                .sum::<f64>();
    }
    for (i, k) in k.iter_mut().enumerate() {
        *k = stored[i / 8][i % 8] + span.theta * flow[i / 8][i % 8];
    }
    Ok(())
}

fn at(point: usize, corners: &[f64; 8]) -> f64 {
    hex8::shape(hex8::GAUSS[point]).iter().zip(corners).map(|(n, t)| n * t).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        material::DAY,
        mesh::{block, divide},
    };

    fn concrete() -> Conductor {
        Conductor {
            conductivity: 1.6,
            capacity: 2.4e6,
            hydration: None,
            birth: f64::NEG_INFINITY,
            fresh: 293.15,
        }
    }

    /// A wall between two airs: three resistances in a row.
    #[test]
    fn a_wall_between_two_airs() {
        let mesh = block(&divide(0.0, 0.3, &[], 0.1), &[0.0, 0.1], &[0.0, 0.1], "wall").unwrap();
        let film = |set: &str, exchange: f64, air: f64| Film {
            face: mesh.face_sets[set][0],
            exchange,
            air: vec![(0.0, air)],
        };
        let films = vec![film("x0", 8.0, 20.0), film("x1", 25.0, -10.0)];
        let conduction = Conduction { bodies: vec![concrete()], films, kept: vec![], theta: 1.0 };
        let mut heat = Heat::new(&mesh, &conduction).unwrap();
        let rest = heat.rest(0.0, 0.0);
        let steady = heat.steady(&rest, &Job::default()).unwrap();
        let flow = 30.0 / (1.0 / 8.0 + 0.3 / 1.6 + 1.0 / 25.0);
        for (n, p) in mesh.nodes.iter().enumerate() {
            let expected = 20.0 - flow * (1.0 / 8.0 + p.x / 1.6);
            assert!(
                (steady.temperature[n] - expected).abs() < 1e-8,
                "{p} {} {expected}",
                steady.temperature[n]
            );
        }
        // And in time it goes there.
        let mut now = rest;
        for day in 1..=60 {
            now = heat.step(&now, f64::from(day) * DAY, &Job::default()).unwrap();
        }
        assert!(now.temperature.iter().zip(&steady.temperature).all(|(a, b)| (a - b).abs() < 1e-6));
    }

    /// Nothing leaves: the block warms by heat over capacity, whatever the steps.
    #[test]
    fn hydration_without_loss_warms_by_the_adiabatic_rise() {
        let mesh =
            block(&divide(0.0, 1.0, &[], 0.5), &[0.0, 0.4, 1.0], &[0.0, 1.0], "pour").unwrap();
        let hydration = Hydration::new(350.0, 3.5e5, DAY).unwrap();
        let conduction = Conduction {
            bodies: vec![Conductor { hydration: Some(hydration), ..concrete() }],
            films: vec![],
            kept: vec![],
            theta: 0.5,
        };
        let mut heat = Heat::new(&mesh, &conduction).unwrap();
        let mut now = heat.rest(0.0, 293.15);
        for step in 1..=40 {
            now = heat.step(&now, f64::from(step) * 0.5 * DAY, &Job::default()).unwrap();
        }
        let expected = 293.15 + hydration.heat / 2.4e6;
        assert!(
            now.temperature.iter().all(|t| (t - expected).abs() < 1e-3),
            "{:?} {expected}",
            now.temperature
        );
    }

    /// A warm pour on a cold old block: heat is shared, none is lost.
    #[test]
    fn a_later_pour_brings_its_own_heat() {
        let mut mesh =
            block(&divide(0.0, 1.0, &[], 0.125), &[0.0, 1.0], &[0.0, 1.0], "old").unwrap();
        mesh.assign("new", |c| c.x > 0.5);
        let bodies = vec![concrete(), Conductor { birth: DAY, fresh: 313.15, ..concrete() }];
        let conduction = Conduction { bodies, films: vec![], kept: vec![], theta: 1.0 };
        let mut heat = Heat::new(&mesh, &conduction).unwrap();
        let before = heat.step(&heat.rest(0.0, 293.15), 0.5 * DAY, &Job::default());
        // Without films and kept nodes the old block alone stays as it is.
        let mut now = before.unwrap();
        for day in 1..400 {
            now = heat.step(&now, f64::from(day) * DAY, &Job::default()).unwrap();
        }
        // The pour begins at the plane after the common one, so that it brings 7/16 of the heat.
        let expected = 293.15 + 20.0 * 7.0 / 16.0;
        assert!(
            now.temperature.iter().all(|t| (t - expected).abs() < 0.02),
            "{:?} {expected}",
            now.temperature
        );
    }
}
