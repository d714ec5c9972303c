//! The dual: what a gauge reads, its influence line, and what softening of each element does to the
//! reading (theory §6).
//!
//! A gauge is the response g of the transport problem A u = f, its reading ⟨g, u⟩. The importance λ
//! solves Aᵀ λ = g: the displacement that the gauge, acting as a load, would cause, which is what
//! engineers call its influence line. One primal and one dual solution give the change of the
//! reading for softening of any element, ∂m/∂d = ∂g/∂d·u − λᵀ (∂A/∂d) u.

use glam::DVec3;
use intrados_stage::Job;
use rayon::prelude::*;

use super::{Failure, History, System, Trial};
use crate::{
    element::hex8::{self, Kind},
    mesh::Host,
    sparse::{Constraints, Method, Solver},
    tensor::{self, Tangent, Voigt},
};

/// What is measured, at a point of a brick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gauge {
    /// Displacement along a unit vector, m.
    Displacement(Host, DVec3),
    /// Normal strain along a unit vector.
    Strain(Host, DVec3),
    /// Normal stress along a unit vector, Pa.
    Stress(Host, DVec3),
}

/// Everything about one gauge in one state of the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Influence {
    /// What it reads.
    pub reading: f64,
    /// Its influence line: what a unit force along each unknown adds to the reading.
    pub line: Vec<f64>,
    /// What softening each brick a little, σ ← (1 − d) σ, adds to the reading: ∂m/∂d.
    pub by_softening: Vec<f64>,
}

impl Gauge {
    /// Unit of its reading.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Displacement(..) => "m",
            Self::Strain(..) => "1",
            Self::Stress(..) => "Pa",
        }
    }

    pub(super) fn host(&self) -> Host {
        match *self {
            Self::Displacement(host, _) | Self::Strain(host, _) | Self::Stress(host, _) => host,
        }
    }

    /// The gauge's own row over a strain or stress in six numbers: n·ε·n, or n·σ·n.
    pub(super) fn along(&self) -> Voigt {
        match *self {
            Self::Displacement(..) => [0.0; 6],
            Self::Strain(_, n) => {
                [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.y * n.z, n.z * n.x]
            }
            Self::Stress(_, n) => {
                [n.x * n.x, n.y * n.y, n.z * n.z, 2.0 * n.x * n.y, 2.0 * n.y * n.z, 2.0 * n.z * n.x]
            }
        }
    }
}

/// What a gauge sees in its brick.
struct Look {
    reading: f64,
    /// ∂reading/∂u of the brick's nodes, modes following.
    row: [f64; 24],
    /// ∂reading/∂modes at fixed displacements.
    by_modes: [f64; 9],
    /// ∂reading/∂d of the brick itself, at fixed displacements and modes.
    by_softening: f64,
}

impl System<'_> {
    /// What gauges read in a state of equilibrium.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn read(&self, gauges: &[Gauge], history: &History) -> Result<Vec<f64>, Failure> {
        gauges.iter().map(|gauge| Ok(self.look(gauge, history)?.reading)).collect()
    }

    /// Readings, influence lines and sensitivities of gauges in a state of equilibrium: one
    /// factorisation, one solution a gauge. The stiffness is that of a small further step.
    ///
    /// # Errors
    /// [`Failure`].
    pub(crate) fn influences(
        &self,
        gauges: &[Gauge],
        history: &History,
        job: &Job,
    ) -> Result<Vec<Influence>, Failure> {
        let warmth = self.warmth([history.time; 2]);
        let trial = Trial::still(history, &warmth);
        let (mut matrix, mut force) = (self.matrix(), Vec::new());
        self.assemble(trial, &history.x, &mut matrix, &mut force, job)?;
        let mut constraints = Constraints::new(self.unknowns() / 3);
        for (node, component, _) in self.prescribed(history.time) {
            constraints.fix(node as usize, usize::from(component), 0.0)?;
        }
        let mut solver = Solver::new(&matrix, &constraints, Method::Auto, job)?;
        let softenings = self.softenings(trial)?;
        let mut all = Vec::with_capacity(gauges.len());
        for (i, gauge) in gauges.iter().enumerate() {
            job.step(i, gauges.len())?;
            let look = self.look(gauge, history)?;
            let mut response = vec![0.0; self.unknowns()];
            let hex = gauge.host().hex as usize;
            self.spread(hex, &look.row, &mut response);
            let line = solver.solve(&matrix, &response, &constraints, 1e-10, job)?.x;
            let mut by_softening: Vec<f64> = softenings
                .par_iter()
                .enumerate()
                .map(|(e, (force, _))| {
                    -self.displacements(e, &line).iter().zip(force).map(|(l, f)| l * f).sum::<f64>()
                })
                .collect();
            let modes = &softenings[hex].1;
            by_softening[hex] += look.by_softening
                + look.by_modes.iter().zip(modes).map(|(g, a)| g * a).sum::<f64>();
            all.push(Influence { reading: look.reading, line, by_softening });
        }
        Ok(all)
    }

    /// Of every brick ∂force/∂d and ∂modes/∂d, for σ ← (1 − d) σ at fixed displacements.
    fn softenings(&self, trial: Trial) -> Result<Vec<([f64; 24], [f64; 9])>, Failure> {
        let hexes = (0..self.model.mesh.hexes.len()).into_par_iter();
        hexes
            .map(|e| {
                if !self.is_alive(e, trial.time) {
                    return Ok(([0.0; 24], [0.0; 9]));
                }
                let (answers, u, modes) = self.answers(e, trial)?;
                // ∂σ/∂d of what is left, (1 − d) σ₀: −σ/(1 − d).
                let left = self.model.softening.get(e).map_or(1.0, |d| 1.0 - d).max(1e-9);
                let law = |point: usize, _: &Voigt| {
                    let (stress, tangent): (Voigt, Tangent) = answers[point];
                    (stress.map(|s| -s / left), tangent)
                };
                let corners = self.model.mesh.corners(e as u32);
                let solid =
                    hex8::linearize(self.moving(e, trial.history), &corners, &u, &modes, law);
                let solid = solid.map_err(|why| self.of_hex(e, why))?;
                Ok((solid.force, solid.step))
            })
            .collect()
    }

    /// How a brick moves on from here: the modes of a damaged one stand still.
    fn moving(&self, hex: usize, history: &History) -> Kind {
        match self.model.kind {
            Kind::Incompatible if history.points[hex].is_damaged() => Kind::Assumed,
            kind => kind,
        }
    }

    /// Stress and tangent at the points of a brick in equilibrium, with its displacements and
    /// modes.
    fn answers(
        &self,
        hex: usize,
        trial: Trial,
    ) -> Result<([(Voigt, Tangent); 8], [f64; 24], hex8::Modes), Failure> {
        let mut answers = [([0.0; 6], [[0.0; 6]; 6]); 8];
        let mut modes = trial.history.modes[hex];
        let u = self.moved(hex, trial.history, &trial.history.x)?.local;
        self.brick(hex, trial, &u, &mut modes, |point, a| answers[point] = (a.stress, a.tangent))?;
        Ok((answers, u, modes))
    }

    fn look(&self, gauge: &Gauge, history: &History) -> Result<Look, Failure> {
        let (Host { hex, natural, .. }, along) = (gauge.host(), gauge.along());
        let e = hex as usize;
        let corners = self.model.mesh.corners(hex);
        if let Gauge::Displacement(_, direction) = *gauge {
            let shape = hex8::shape(natural);
            let row: [f64; 24] = std::array::from_fn(|i| shape[i / 3] * direction[i % 3]);
            let u = self.displacements(e, &history.x);
            let reading = row.iter().zip(&u).map(|(g, u)| g * u).sum();
            return Ok(Look { reading, row, by_modes: [0.0; 9], by_softening: 0.0 });
        }
        let warmth = self.warmth([history.time; 2]);
        let trial = Trial::still(history, &warmth);
        let (answers, u, modes) = self.answers(e, trial)?;
        let rows =
            hex8::rows(self.model.kind, &corners, natural).map_err(|why| self.of_hex(e, why))?;
        let follow = hex8::linearize(self.moving(e, history), &corners, &u, &modes, |point, _| {
            answers[point]
        });
        let follow = follow.map_err(|why| self.of_hex(e, why))?;
        let strains = rows.gauge(&follow.follow);
        let pick = |rows: &[[f64; 24]; 6]| {
            std::array::from_fn(|i| (0..6).map(|k| along[k] * rows[k][i]).sum())
        };
        let strain = rows.strain(&u, &modes);
        Ok(match gauge {
            Gauge::Stress(..) => {
                // The tangent and the eigenstress of the point next to the gauge.
                let point = (0..8)
                    .min_by(|&a, &b| near(natural, a).total_cmp(&near(natural, b)))
                    .unwrap_or(0);
                let (stress, tangent) = answers[point];
                let at_point = hex8::rows(self.model.kind, &corners, hex8::GAUSS[point])
                    .map_err(|why| self.of_hex(e, why))?
                    .strain(&u, &modes);
                let warmth = &trial.warmth[1];
                let warmer =
                    if warmth.is_empty() { 0.0 } else { self.warmer(e, natural, point, warmth) };
                let free = tensor::isotropic(self.law(e).expansion() * warmer);
                let more: Voigt = std::array::from_fn(|j| strain[j] - at_point[j] - free[j]);
                let stress = tensor::add(&stress, &tensor::apply(&tangent, &more));
                let by_modes = std::array::from_fn(|m| {
                    (0..6)
                        .map(|k| {
                            along[k] * (0..6).map(|j| tangent[k][j] * rows.modes[j][m]).sum::<f64>()
                        })
                        .sum()
                });
                let reading: f64 = along.iter().zip(stress).map(|(n, s)| n * s).sum();
                let left = self.model.softening.get(e).map_or(1.0, |d| 1.0 - d).max(1e-9);
                Look {
                    reading,
                    row: pick(&hex8::stress_gauge(&strains, &tangent)),
                    by_modes,
                    by_softening: -reading / left,
                }
            }
            _ => {
                let by_modes =
                    std::array::from_fn(|m| (0..6).map(|k| along[k] * rows.modes[k][m]).sum());
                let reading = along.iter().zip(strain).map(|(n, e)| n * e).sum();
                Look { reading, row: pick(&strains), by_modes, by_softening: 0.0 }
            }
        })
    }

    /// How much warmer a brick is at a place than at a point.
    fn warmer(&self, hex: usize, natural: DVec3, point: usize, warmth: &[f64]) -> f64 {
        let (here, there) = (hex8::shape(natural), hex8::shape(hex8::GAUSS[point]));
        let nodes = &self.model.mesh.hexes[hex].nodes;
        nodes
            .iter()
            .zip(here.iter().zip(there))
            .map(|(n, (here, there))| (here - there) * warmth[*n as usize])
            .sum()
    }

    /// Adds a brick's row to a vector over all unknowns.
    pub(super) fn spread(&self, hex: usize, row: &[f64; 24], all: &mut [f64]) {
        for (node, row) in self.model.mesh.hexes[hex].nodes.iter().zip(row.as_chunks::<3>().0) {
            (0..3).for_each(|c| all[3 * *node as usize + c] += row[c]);
        }
    }
}

fn near(natural: DVec3, point: usize) -> f64 {
    (hex8::GAUSS[point] - natural).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        material::{concrete::Given, law::Setting},
        mesh::{block, divide},
        model::{Action, Body, Drive, Load, March, MarchSettings, Matter, Model},
    };

    /// A bent and cracked cantilever: what softening of a brick does to its forces at fixed
    /// displacements, against differences. The modes of cracked bricks stand still, those of sound
    /// ones follow.
    #[test]
    fn softening_of_cracked_bricks_by_differences() {
        let concrete = Given::from("C30/37".parse::<crate::material::concrete::Class>().unwrap())
            .complete()
            .unwrap();
        let matter = Matter::Concrete(Box::new((concrete, Setting::short_term(0.1))));
        let mesh =
            block(&divide(0.0, 1.0, &[], 0.25), &[0.0, 0.2], &[0.0, 0.1, 0.2], "beam").unwrap();
        let mut model = Model {
            bodies: vec![Body { matter, birth: f64::NEG_INFINITY }],
            mesh,
            ..Model::default()
        };
        let at = |model: &Model, x: f64| {
            (0..model.mesh.nodes.len() as u32)
                .filter(|&n| (model.mesh.nodes[n as usize].x - x).abs() < 1e-9)
                .collect::<Vec<_>>()
        };
        model.holds =
            at(&model, 0.0).into_iter().flat_map(|n| (0..3).map(move |c| (n, c))).collect();
        let tip = at(&model, 1.0).into_iter().map(|n| (n, 2, -1e-3)).collect();
        model.loads.push(Load {
            name: "tip".into(),
            action: Action::Displacement(tip),
            history: vec![(0.0, 0.0), (1.0, 1.0)],
        });
        let structure = System::new(&model).unwrap();
        let mut march =
            March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
        march.advance(1.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        let history = &march.history;
        let force = |softening: f64, hex: usize| {
            let mut softer = model.clone();
            softer.softening = vec![0.0; model.mesh.hexes.len()];
            softer.softening[hex] = softening;
            let structure = System::new(&softer).unwrap();
            let warmth = structure.warmth([history.time; 2]);
            let trial = Trial::still(history, &warmth);
            structure
                .brick(
                    hex,
                    trial,
                    &structure.displacements(hex, &history.x),
                    &mut history.modes[hex].clone(),
                    |_, _| {},
                )
                .unwrap()
                .force
        };
        let warmth = structure.warmth([history.time; 2]);
        let told = structure.softenings(Trial::still(history, &warmth)).unwrap();
        let mut cracked = 0;
        for (hex, (told, _)) in told.iter().enumerate() {
            cracked += usize::from(history.points[hex].is_damaged());
            let [more, less] = [force(0.01, hex), force(0.0, hex)];
            let size = told.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            for (i, told) in told.iter().enumerate() {
                let found = (more[i] - less[i]) / 0.01;
                assert!(
                    (found - told).abs() < 1e-6 * size,
                    "brick {hex}, force {i}: {found} {told}"
                );
            }
        }
        assert!((1..model.mesh.hexes.len()).contains(&cracked), "{cracked} bricks are cracked");
    }
}
