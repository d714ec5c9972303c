//! A model made ready to be computed: which unknowns it has, what it resists, what acts on it.

use std::sync::Arc;

use glam::DVec3;
use intrados_stage::Job;
use rayon::prelude::*;

use super::{
    Action, History, Model,
    law::{Answer, Moment},
    march::Failure,
};
use crate::{
    element::{
        hex8::{self, Modes},
        load::{self, Face},
    },
    mesh::{ElementId, HexFace},
    sparse::{BlockMatrix, Connectivity, Pattern, Place},
    tensor::Voigt,
};

/// A model with its unknowns in order.
#[derive(Debug)]
pub struct Structure<'m> {
    /// What is computed.
    pub model: &'m Model,
    elements: Connectivity,
    pattern: Arc<Pattern>,
}

/// A step that is being tried: from a history to a moment.
#[derive(Debug, Clone, Copy)]
pub struct Trial<'a> {
    /// Where it starts.
    pub history: &'a History,
    /// When it ends, s.
    pub time: f64,
    /// Temperatures at its end, one a node; empty: none.
    pub warmth: &'a [f64],
}

impl<'m> Structure<'m> {
    /// Prepares a model.
    ///
    /// # Errors
    /// If mesh and bodies do not fit together.
    pub fn new(model: &'m Model) -> Result<Self, Failure> {
        if model.bodies.len() != model.mesh.regions.len() {
            return Err(Failure::Bodies { regions: model.mesh.regions.len(), bodies: model.bodies.len() });
        }
        let elements: Connectivity = model.mesh.hexes.iter().map(|hex| hex.nodes).collect();
        let places = model.mesh.nodes.iter().map(|p| Place::point(p.to_array())).collect();
        let pattern = Arc::new(Pattern::new(places, &elements)?);
        Ok(Self { model, elements, pattern })
    }

    /// Unknowns.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        3 * self.pattern.nodes()
    }

    /// The state before anything has happened.
    #[must_use]
    pub fn rest(&self, time: f64) -> History {
        let hexes = self.model.mesh.hexes.len();
        History {
            time,
            factor: 0.0,
            x: vec![0.0; self.unknowns()],
            force: vec![0.0; self.unknowns()],
            modes: vec![Modes::default(); hexes],
            points: vec![Default::default(); hexes],
            born: Default::default(),
        }
    }

    /// An empty stiffness.
    #[must_use]
    pub fn matrix(&self) -> BlockMatrix<3> {
        BlockMatrix::zeros(Arc::clone(&self.pattern))
    }

    /// Whether a brick is there at a time.
    #[must_use]
    pub fn is_alive(&self, hex: usize, time: f64) -> bool {
        self.model.bodies[self.model.mesh.hexes[hex].region as usize].birth <= time
    }

    /// Lets the bricks that are poured between the history's time and `time` take the shape that they find.
    pub fn bear(&self, history: &mut History, time: f64) {
        for hex in 0..self.model.mesh.hexes.len() {
            if self.is_alive(hex, time) && !self.is_alive(hex, history.time) {
                history.born.insert(hex as u32, self.displacements(hex, &history.x));
            }
        }
    }

    /// What acts at a time, three a node, N. Prescribed displacements and temperatures are no forces. Of the load `apart` nothing is
    /// counted.
    ///
    /// # Errors
    /// If an element is folded.
    pub fn loads(&self, time: f64, apart: Option<usize>) -> Result<Vec<f64>, Failure> {
        let mut sum = vec![0.0; self.unknowns()];
        for (i, load) in self.model.loads.iter().enumerate() {
            let factor = load.factor(time);
            if factor != 0.0 && apart != Some(i) {
                self.add_load(&load.action, factor, time, &mut sum)?;
            }
        }
        Ok(sum)
    }

    /// Adds `factor` times the forces of an action.
    pub(super) fn add_load(&self, action: &Action, factor: f64, time: f64, sum: &mut [f64]) -> Result<(), Failure> {
        let mesh = &self.model.mesh;
        let mut add = |node: u32, force: DVec3| (0..3).for_each(|c| sum[3 * node as usize + c] += factor * force[c]);
        match action {
            Action::Nodes(forces) => forces.iter().for_each(|&(node, force)| add(node, force)),
            Action::Faces(faces) => {
                for &(HexFace { hex, face }, pressure) in faces.iter().filter(|(face, _)| self.is_alive(face.hex as usize, time)) {
                    let forces = load::pressure(&mesh.corners(hex), Face::ALL[usize::from(face)], |_| pressure)
                        .map_err(|e| self.of_hex(hex as usize, e))?;
                    for (node, force) in mesh.hexes[hex as usize].nodes.iter().zip(forces.as_chunks::<3>().0) {
                        add(*node, DVec3::from_array(*force));
                    }
                }
            }
            Action::Weight(acceleration) => {
                for hex in (0..mesh.hexes.len()).filter(|&hex| self.is_alive(hex, time)) {
                    let density = self.model.bodies[mesh.hexes[hex].region as usize].law.density();
                    let forces = load::body(&mesh.corners(hex as u32), |_| density * *acceleration).map_err(|e| self.of_hex(hex, e))?;
                    for (node, force) in mesh.hexes[hex].nodes.iter().zip(forces.as_chunks::<3>().0) {
                        add(*node, DVec3::from_array(*force));
                    }
                }
            }
            Action::Displacement(_) | Action::Temperature(_) => {}
        }
        Ok(())
    }

    /// What is prescribed at a time: every held unknown with its value, m; not by the load `apart`.
    #[must_use]
    pub fn prescribed(&self, time: f64, apart: Option<usize>) -> Vec<(u32, u8, f64)> {
        let mut all: Vec<_> = self.model.holds.iter().map(|&(node, component)| (node, component, 0.0)).collect();
        for (_, load) in self.model.loads.iter().enumerate().filter(|(i, _)| apart != Some(*i)) {
            if let Action::Displacement(values) = &load.action {
                let factor = load.factor(time);
                all.extend(values.iter().map(|&(node, component, value)| (node, component, factor * value)));
            }
        }
        all
    }

    /// Temperatures of the nodes at a time; empty where nothing warms.
    #[must_use]
    pub fn warmth(&self, time: f64) -> Vec<f64> {
        let mut sum = Vec::new();
        for load in &self.model.loads {
            if let Action::Temperature(field) = &load.action {
                let factor = load.factor(time);
                sum.resize(field.len(), 0.0);
                sum.iter_mut().zip(field).for_each(|(sum, t)| *sum += factor * t);
            }
        }
        sum
    }

    /// Stiffness and internal forces of a trial at displacements `x`; both are overwritten.
    ///
    /// # Errors
    /// If an element is folded or its law answers no number.
    pub fn assemble(&self, trial: Trial, x: &[f64], matrix: &mut BlockMatrix<3>, force: &mut Vec<f64>, job: &Job) -> Result<(), Failure> {
        matrix.clear();
        force.clear();
        force.resize(self.unknowns(), 0.0);
        matrix.assemble_with(&self.elements, force, job, |e, k, f| {
            if !self.is_alive(e, trial.time) {
                return Ok(());
            }
            let mut modes = trial.history.modes[e];
            let solid = self.brick(e, trial, x, &mut modes, |_, _| {})?;
            k.copy_from_slice(solid.stiffness.as_flattened());
            f.copy_from_slice(&solid.force);
            Ok(())
        })
    }

    /// The history after a trial that has converged at `x` with internal forces `force`.
    ///
    /// # Errors
    /// As [`Structure::assemble`].
    pub fn commit(&self, trial: Trial, x: Vec<f64>, factor: f64, force: Vec<f64>) -> Result<History, Failure> {
        let hexes = (0..self.model.mesh.hexes.len()).into_par_iter();
        let after: Vec<_> = hexes
            .map(|e| {
                let (mut modes, mut points) = (trial.history.modes[e], trial.history.points[e]);
                if self.is_alive(e, trial.time) {
                    self.brick(e, trial, &x, &mut modes, |point, answer| points[point] = answer.memory)?;
                }
                Ok((modes, points))
            })
            .collect::<Result<_, Failure>>()?;
        let (modes, points) = after.into_iter().unzip();
        Ok(History { time: trial.time, factor, x, force, modes, points, born: trial.history.born.clone() })
    }

    /// Strain and stress at the points of a brick in a history.
    ///
    /// # Errors
    /// As [`Structure::assemble`].
    pub fn stresses(&self, hex: usize, history: &History) -> Result<[Voigt; 8], Failure> {
        let mut stresses = [[0.0; 6]; 8];
        let warmth = self.warmth(history.time);
        let trial = Trial { history, time: history.time, warmth: &warmth };
        if self.is_alive(hex, history.time) {
            let mut modes = history.modes[hex];
            self.brick(hex, trial, &history.x, &mut modes, |point, answer| stresses[point] = answer.stress)?;
        }
        Ok(stresses)
    }

    /// A brick at displacements `x`; `each` hears what its points answer.
    pub(super) fn brick(
        &self,
        hex: usize,
        trial: Trial,
        x: &[f64],
        modes: &mut Modes,
        mut each: impl FnMut(usize, &Answer),
    ) -> Result<hex8::Solid, Failure> {
        let cell = &self.model.mesh.hexes[hex];
        let body = &self.model.bodies[cell.region as usize];
        let mut u = self.displacements(hex, x);
        if let Some(born) = trial.history.born.get(&(hex as u32)) {
            u.iter_mut().zip(born).for_each(|(u, born)| *u -= born);
        }
        let warm: Option<[f64; 8]> = (!trial.warmth.is_empty()).then(|| cell.nodes.map(|n| trial.warmth[n as usize]));
        let memories = &trial.history.points[hex];
        let left = self.model.softening.get(hex).map_or(1.0, |d| 1.0 - d);
        let law = |point: usize, strain: &Voigt| {
            let warmth = warm.map_or(0.0, |warm| hex8::shape(hex8::GAUSS[point]).iter().zip(warm).map(|(n, t)| n * t).sum());
            let moment = Moment { span: [trial.history.time, trial.time], birth: body.birth, warmth };
            let mut answer = body.law.answer(strain, &memories[point], &moment);
            if left < 1.0 {
                answer.stress.iter_mut().chain(answer.tangent.as_flattened_mut()).for_each(|s| *s *= left);
            }
            each(point, &answer);
            (answer.stress, answer.tangent)
        };
        hex8::integrate(self.model.kind, &self.model.mesh.corners(hex as u32), &u, modes, law).map_err(|e| self.of_hex(hex, e))
    }

    /// Displacements of a brick's nodes.
    pub(super) fn displacements(&self, hex: usize, x: &[f64]) -> [f64; 24] {
        let nodes = &self.model.mesh.hexes[hex].nodes;
        std::array::from_fn(|i| x[3 * nodes[i / 3] as usize + i % 3])
    }

    pub(super) fn of_hex(&self, hex: usize, source: crate::element::ElementError) -> Failure {
        Failure::Element { element: self.model.mesh.name(ElementId::Hex(hex as u32)), source }
    }
}
