//! A structure in its small elastic response, as a transport problem that softening of bricks
//! perturbs.
//!
//! A(d) u = f with A(d) = A₀ − Σ d_e K_e, K_e the stiffness of a sound brick; a gauge reads m = ⟨g,
//! u⟩, its importance is A λ = g, and
//!
//! ```text
//! ∂m/∂d_e = −λᵀ (∂A/∂d_e) u = λᵀ K_e u
//! ```
//!
//! (theory §6): one solution a load case and one a gauge give all of it. A brick's modes follow its
//! displacements alike however soft it is, so that gauges of strain and displacement have rows that
//! do not depend on d.

use glam::DVec3;
use intrados_stage::Job;
use intrados_transport::{Perturbed, Sensitivities};
use rayon::prelude::*;

use super::{Bedding, Failure, Gauge, System, Trial};
use crate::{
    element::hex8,
    sparse::{BlockMatrix, Constraints, Method, Solver},
};

/// Unknowns up to which systems are factorised: every right-hand side after the first is then
/// nearly free.
const FACTORED: usize = 120_000;
/// So much of a brick stays even if it is told to be gone: a hole without stiffness would have no
/// displacements.
const LEFT: f64 = 1e-3;

/// The small elastic response of a structure at rest to load cases, as a function of the softening
/// of its bricks.
pub struct Linear<'s, 'm> {
    structure: &'s System<'m>,
    /// Of sound bricks, their modes condensed, N/m.
    bricks: Vec<[[f64; 24]; 24]>,
    /// Without any softening.
    sound: BlockMatrix<3>,
    matrix: BlockMatrix<3>,
    constraints: Constraints<3>,
    solver: Option<Solver<3>>,
    softening: Vec<f64>,
    /// One a load case, N.
    cases: Vec<Vec<f64>>,
    /// Of each gauge the bricks that it reads and its rows over their unknowns.
    gauges: Vec<Vec<(usize, [f64; 24])>>,
    solutions: usize,
    job: Job,
}

impl<'m> System<'m> {
    /// The elastic response of this structure, at rest at `time`, to forces (`cases`, three a node,
    /// N), and what gauges of strain and displacement read of it; each reads the mean over its
    /// points.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn linear<'s>(
        &'s self,
        time: f64,
        cases: Vec<Vec<f64>>,
        gauges: &[Vec<Gauge>],
        job: &Job,
    ) -> Result<Linear<'s, 'm>, Failure> {
        let rest = self.rest(time);
        let warmth = [Vec::new(), Vec::new()];
        let trial = Trial::still(&rest, &warmth);
        let bricks = (0..self.model.mesh.hexes.len()).into_par_iter().map(|e| {
            let mut modes = rest.modes[e];
            Ok(self.brick(e, trial, &[0.0; 24], &mut modes, |_, _| {})?.stiffness)
        });
        let bricks = bricks.collect::<Result<Vec<_>, Failure>>()?;
        let (mut sound, mut force) = (self.matrix(), Vec::new());
        self.assemble(trial, &rest.x, &mut sound, &mut force, job)?;
        let mut constraints = Constraints::new(self.unknowns() / 3);
        for (node, component, _) in self.prescribed(time) {
            constraints.fix(node as usize, usize::from(component), 0.0)?;
        }
        let mean = |points: &Vec<Gauge>| -> Result<Vec<(usize, [f64; 24])>, Failure> {
            let rows = points.iter().map(|gauge| self.row(gauge));
            rows.map(|row| row.map(|(e, row)| (e, row.map(|g| g / points.len() as f64)))).collect()
        };
        let gauges = gauges.iter().map(mean).collect::<Result<_, _>>()?;
        Ok(Linear {
            structure: self,
            softening: vec![0.0; bricks.len()],
            matrix: sound.clone(),
            bricks,
            sound,
            constraints,
            solver: None,
            cases,
            gauges,
            solutions: 0,
            job: job.clone(),
        })
    }

    /// ∂reading/∂u of a gauge on an elastic brick, and which brick that is.
    fn row(&self, gauge: &Gauge) -> Result<(usize, [f64; 24]), Failure> {
        let host = gauge.host();
        let e = host.hex as usize;
        if let Gauge::Displacement(_, direction) = *gauge {
            let shape = hex8::shape(host.natural);
            return Ok((e, std::array::from_fn(|i| shape[i / 3] * direction[i % 3])));
        }
        let rest = self.rest(0.0);
        let warmth = [Vec::new(), Vec::new()];
        let mut modes = rest.modes[e];
        let still = Trial::still(&rest, &warmth);
        let solid = self.brick(e, still, &[0.0; 24], &mut modes, |_, _| {})?;
        let rows = hex8::rows(self.model.kind, &self.model.mesh.corners(host.hex), host.natural)
            .map_err(|why| self.of_hex(e, why))?;
        let (strains, along) = (rows.gauge(&solid.follow), gauge.along());
        Ok((e, std::array::from_fn(|i| (0..6).map(|k| along[k] * strains[k][i]).sum())))
    }
}

impl Linear<'_, '_> {
    /// Load cases and gauges.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.cases.len(), self.gauges.len()]
    }

    /// Systems of equations solved so far.
    #[must_use]
    pub fn solutions(&self) -> usize {
        self.solutions
    }

    /// Takes new softening of the bricks.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn soften(&mut self, softening: &[f64]) -> Result<(), Failure> {
        if self.solver.is_some() && softening == self.softening {
            return Ok(());
        }
        self.softening.copy_from_slice(softening);
        self.matrix.clone_from(&self.sound);
        let (bricks, mut force) = (&self.bricks, vec![0.0; self.structure.unknowns()]);
        self.matrix.assemble_with(
            &self.structure.elements,
            &mut force,
            &self.job,
            |e, k, _| -> Result<(), Failure> {
                if let (Some(brick), Some(&d)) = (bricks.get(e), softening.get(e))
                    && d != 0.0
                {
                    let d = d.min(1.0 - LEFT);
                    k.iter_mut().zip(brick.as_flattened()).for_each(|(k, sound)| *k = -d * sound);
                }
                Ok(())
            },
        )?;
        let method =
            if self.structure.unknowns() <= FACTORED { Method::Direct } else { Method::Auto };
        match &mut self.solver {
            Some(solver) => solver.update(&self.matrix, &self.constraints, &self.job)?,
            none => *none = Some(Solver::new(&self.matrix, &self.constraints, method, &self.job)?),
        }
        Ok(())
    }

    /// Displacements of every load case: the primal fields.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn fields(&mut self) -> Result<Vec<Vec<f64>>, Failure> {
        let cases = std::mem::take(&mut self.cases);
        let fields = cases.iter().map(|force| self.solve(force)).collect();
        self.cases = cases;
        fields
    }

    /// Influence lines of every gauge: the dual fields.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn importances(&mut self) -> Result<Vec<Vec<f64>>, Failure> {
        (0..self.gauges.len()).map(|gauge| self.solve(&self.response(gauge))).collect()
    }

    /// The load of a case.
    #[must_use]
    pub fn source(&self, case: usize) -> &[f64] {
        &self.cases[case]
    }

    /// g of a gauge, over all unknowns.
    #[must_use]
    pub(crate) fn response(&self, gauge: usize) -> Vec<f64> {
        let mut all = vec![0.0; self.structure.unknowns()];
        self.gauges[gauge].iter().for_each(|(hex, row)| self.structure.spread(*hex, row, &mut all));
        all
    }

    fn solve(&mut self, force: &[f64]) -> Result<Vec<f64>, Failure> {
        if self.solver.is_none() {
            let softening = self.softening.clone();
            self.soften(&softening)?;
        }
        self.solutions += 1;
        self.job.step(0, 1)?;
        let Some(solver) = &mut self.solver else { return Ok(Vec::new()) };
        Ok(solver.solve(&self.matrix, force, &self.constraints, 1e-10, &self.job)?.x)
    }

    /// What the gauges read of a field.
    #[must_use]
    pub fn read(&self, field: &[f64]) -> Vec<f64> {
        let of = |(hex, row): &(usize, [f64; 24])| {
            row.iter()
                .zip(self.structure.displacements(*hex, field))
                .map(|(g, u)| g * u)
                .sum::<f64>()
        };
        self.gauges.iter().map(|points| points.iter().map(of).sum()).collect()
    }

    /// K_e of a sound brick over its nodes' unknowns, N/m.
    #[must_use]
    pub fn brick(&self, hex: usize) -> &[[f64; 24]; 24] {
        &self.bricks[hex]
    }

    /// What is computed.
    #[must_use]
    pub fn structure(&self) -> &System<'_> {
        self.structure
    }

    /// A₀ u of the sound structure, supports included.
    #[must_use]
    pub fn resist_all(&self, field: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; field.len()];
        self.sound.multiply(field, &mut force);
        force
    }

    /// A u of the structure softened as it is, supports included.
    #[must_use]
    pub fn resist(&self, field: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; field.len()];
        self.matrix.multiply(field, &mut force);
        force
    }

    /// What springs of this stiffness (Pa/m, along the axes of the world) resist with, N.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn resist_springs(&self, of: DVec3, field: &[f64]) -> Result<Vec<f64>, Failure> {
        let model = self.structure.model;
        let mut force = vec![0.0; field.len()];
        for ground in model
            .ground
            .iter()
            .filter(|g| matches!(g.bedding, Bedding::Springs { stiffness, .. } if stiffness == of))
        {
            let nodes = model.mesh.face(ground.face);
            let at = |i: usize| 3 * nodes[i / 3] as usize + i % 3;
            let places = nodes.map(|n| model.mesh.nodes[n as usize]);
            let element = ground
                .element(&places, &[0.0; 12], 0.0)
                .map_err(|why| self.structure.of_hex(ground.face.hex as usize, why))?;
            for (i, row) in element.stiffness.iter().enumerate() {
                force[at(i)] += row.iter().enumerate().map(|(j, k)| k * field[at(j)]).sum::<f64>();
            }
        }
        Ok(force)
    }
}

/// Readings case by case, gauges within; a damage is the softening of a brick.
impl Perturbed for Linear<'_, '_> {
    type Error = Failure;

    fn damages(&self) -> usize {
        self.bricks.len()
    }

    fn readings(&mut self, softening: &[f64]) -> Result<Vec<f64>, Failure> {
        self.soften(softening)?;
        Ok(self.fields()?.iter().flat_map(|field| self.read(field)).collect())
    }

    fn sensitivities(&mut self, softening: &[f64]) -> Result<Sensitivities, Failure> {
        self.soften(softening)?;
        let (fields, importances) = (self.fields()?, self.importances()?);
        let readings = fields.iter().flat_map(|field| self.read(field)).collect();
        // By brick, then turned round.
        let of_brick = |e: usize| -> Vec<f64> {
            let lines: Vec<_> =
                importances.iter().map(|line| self.structure.displacements(e, line)).collect();
            let resist = |u: [f64; 24]| {
                self.bricks[e].map(|row| row.iter().zip(&u).map(|(k, u)| k * u).sum::<f64>())
            };
            let forces = fields.iter().map(|field| resist(self.structure.displacements(e, field)));
            forces
                .flat_map(|f| {
                    lines
                        .iter()
                        .map(|l| l.iter().zip(&f).map(|(l, f)| l * f).sum())
                        .collect::<Vec<f64>>()
                })
                .collect()
        };
        let columns: Vec<Vec<f64>> = (0..self.bricks.len()).into_par_iter().map(of_brick).collect();
        let by_damage = (0..self.cases.len() * self.gauges.len())
            .map(|i| columns.iter().map(|c| c[i]).collect())
            .collect();
        Ok(Sensitivities::exact(readings, by_damage))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use intrados_transport::remainders;

    use super::*;
    use crate::{
        mesh::{Locator, block, divide},
        model::{Action, Body, Elastic, Load, Matter, Model},
    };

    /// A clamped beam with a weight and a side load, softened already: first order by the dual,
    /// against two full solutions.
    #[test]
    fn the_error_of_first_order_falls_as_its_square() {
        let mesh = block(
            &divide(0.0, 2.0, &[], 0.25),
            &divide(0.0, 0.3, &[], 0.15),
            &divide(0.0, 0.2, &[], 0.1),
            "beam",
        )
        .unwrap();
        let elastic = Elastic { modulus: 30e9, poisson: 0.2, expansion: 0.0, density: 2500.0 };
        let bodies = vec![Body { matter: Matter::Elastic(elastic), birth: f64::NEG_INFINITY }];
        let mut model = Model { bodies, mesh, ..Model::default() };
        let held: Vec<u32> = (0..model.mesh.nodes.len() as u32)
            .filter(|&n| model.mesh.nodes[n as usize].x < 1e-9)
            .collect();
        model.holds = held.into_iter().flat_map(|n| (0..3).map(move |c| (n, c))).collect();
        for (k, pull) in
            [DVec3::new(2.0, -9.81, 0.5), DVec3::new(-30.0, 0.0, 4.0)].into_iter().enumerate()
        {
            let at = k as f64;
            let history = vec![(at - 1.0, 0.0), (at, 1.0), (at + 1.0, 0.0)];
            model.loads.push(Load { name: k.to_string(), action: Action::Weight(pull), history });
        }
        let structure = System::new(&model).unwrap();
        let host = |x, y, z| Locator::new(&model.mesh).locate(DVec3::new(x, y, z)).unwrap();
        let gauges = [
            vec![
                Gauge::Strain(host(0.32, 0.29, 0.04), DVec3::X),
                Gauge::Strain(host(0.42, 0.29, 0.04), DVec3::X),
            ],
            vec![Gauge::Strain(host(1.2, 0.02, 0.14), DVec3::new(0.8, 0.6, 0.0))],
            vec![Gauge::Displacement(host(1.9, 0.1, 0.1), DVec3::Y)],
        ];
        let cases = (0..2).map(|k| structure.loads(f64::from(k)).unwrap()).collect();
        let mut linear = structure.linear(0.0, cases, &gauges, &Job::default()).unwrap();
        let n = linear.damages();
        let at: Vec<f64> = (0..n).map(|e| if e % 5 == 0 { 0.3 } else { 0.0 }).collect();
        let towards: Vec<f64> = (0..n).map(|e| f64::from(u8::from(e % 3 != 1))).collect();
        for (i, [large, small]) in
            remainders(&mut linear, &at, &towards, 0.02).unwrap().into_iter().enumerate()
        {
            assert!(
                large != 0.0 && (large / small - 4.0).abs() < 0.2,
                "reading {i}: {large:e} {small:e}"
            );
        }
        // Reciprocity: the load works on a gauge's line what the gauge reads.
        let (fields, lines) = (linear.fields().unwrap(), linear.importances().unwrap());
        for (case, field) in fields.iter().enumerate() {
            for (line, read) in lines.iter().zip(linear.read(field)) {
                let worked: f64 = line.iter().zip(linear.source(case)).map(|(l, f)| l * f).sum();
                assert!((worked / read - 1.0).abs() < 1e-8, "{worked:e} {read:e}");
            }
        }
    }
}
