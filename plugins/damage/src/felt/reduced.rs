//! A small model of the whole one: Galerkin in the space of primal and dual fields at the damages visited so far.
//!
//! At every visited damage it gives readings *and* their sensitivities (but for what is thrown away as too small to be told), because the space holds the field u and the importance λ there:
//! ∂m/∂d = λᵀ K_z u is computed from both. Elsewhere a reading's error is the product of the errors of u and of λ in the space (the goal-oriented bound,
//! e.g. Rozza, Huynh and Patera 2008, §4). So the dual's J, re-linearised where it matters, becomes a model that is right to second order between.

use intrados_mechanics::model::Linear;
use intrados_stage::Job;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::{
    FeltError,
    inverse::Forward,
    rig::{BORDER, FACES, Rig},
};

/// A new field whose rest outside of the space is smaller than this, over the field itself, adds nothing that a gauge could tell: errors of readings are
/// products of two such rests.
const NEW: f64 = 5e-4;

/// The reduced model.
pub struct Reduced<'r, 's, 'm> {
    rig: &'r Rig,
    linear: Linear<'s, 'm>,
    /// The zones, then the borders between them.
    zones: Vec<Zone>,
    /// Orthonormal in the energy of the sound structure.
    basis: Vec<Vec<f64>>,
    /// One row a member of the basis: forces of the cases, rows of the gauges.
    forces: DMatrix<f64>,
    gauges: DMatrix<f64>,
    /// What a finer mesh reads more of the sound member.
    finer: DVector<f64>,
    visited: usize,
    job: Job,
}

/// A zone over the nodes of its bricks, and within the space.
struct Zone {
    nodes: Vec<u32>,
    stiffness: DMatrix<f64>,
    /// Vᵀ K_z V
    small: DMatrix<f64>,
}

impl Zone {
    fn new(linear: &Linear, bricks: &[(u32, f64)]) -> Self {
        let hexes = &linear.structure().model.mesh.hexes;
        let mut nodes: Vec<u32> = bricks.iter().flat_map(|&(hex, _)| hexes[hex as usize].nodes).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut stiffness = DMatrix::zeros(3 * nodes.len(), 3 * nodes.len());
        for &(hex, share) in bricks {
            let at = hexes[hex as usize].nodes.map(|n| 3 * nodes.partition_point(|&m| m < n));
            for (i, row) in linear.brick(hex as usize).iter().enumerate() {
                for (j, k) in row.iter().enumerate() {
                    stiffness[(at[i / 3] + i % 3, at[j / 3] + j % 3)] += share * k;
                }
            }
        }
        Self { nodes, stiffness, small: DMatrix::zeros(0, 0) }
    }

    /// Takes the members of the basis from number `known` on into the space.
    fn grow(&mut self, basis: &[Vec<f64>], known: usize) {
        let of = |field: &Vec<f64>| self.nodes.iter().flat_map(|&n| (0..3).map(move |c| field[3 * n as usize + c])).collect::<Vec<f64>>();
        let rows = 3 * self.nodes.len();
        let all = DMatrix::from_iterator(rows, basis.len(), basis.iter().flat_map(of));
        let forces = &self.stiffness * all.columns(known, basis.len() - known);
        let news = all.tr_mul(&forces);
        let old = std::mem::replace(&mut self.small, DMatrix::zeros(basis.len(), basis.len()));
        self.small.view_mut((0, 0), (known, known)).copy_from(&old);
        self.small.columns_mut(known, basis.len() - known).copy_from(&news);
        let turned = news.rows(0, known).transpose();
        self.small.view_mut((known, 0), (basis.len() - known, known)).copy_from(&turned);
    }
}

impl<'r, 's, 'm> Reduced<'r, 's, 'm> {
    /// The space at no damage.
    ///
    /// # Errors
    /// [`FeltError`].
    pub fn new(rig: &'r Rig, linear: Linear<'s, 'm>, job: &Job) -> Result<Self, FeltError> {
        let zones = rig.zones.par_iter().chain(&rig.borders).map(|bricks| Zone::new(&linear, bricks)).collect();
        let [cases, gauges] = linear.size();
        let mut this = Self {
            rig,
            linear,
            zones,
            basis: Vec::new(),
            forces: DMatrix::zeros(0, cases),
            gauges: DMatrix::zeros(0, gauges),
            finer: DVector::zeros(cases * gauges),
            visited: 0,
            job: job.clone(),
        };
        this.visit(&[])?;
        Ok(this)
    }

    /// Systems of equations solved so far.
    #[must_use]
    pub fn solutions(&self) -> usize {
        self.linear.solutions()
    }

    /// Damages visited.
    #[must_use]
    pub fn visited(&self) -> usize {
        self.visited
    }

    /// Takes what a finer mesh reads of the sound member: from now on every reading is corrected by the difference.
    pub fn correct(&mut self, sound: &[f64]) {
        if let Some((own, _)) = self.read(&[], &[]) {
            self.finer += DVector::from_column_slice(sound) - own;
        }
    }

    /// Adds what is new in a field to the basis (Gram and Schmidt, twice, in the energy of the sound structure).
    fn add(&mut self, mut field: Vec<f64>, forces: &mut Vec<Vec<f64>>) {
        let energy = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut force = self.linear.resist_all(&field);
        let whole = energy(&field, &force).max(0.0).sqrt();
        for _ in 0..2 {
            for (known, of_known) in self.basis.iter().zip(&*forces) {
                let share = energy(&field, of_known);
                field.iter_mut().zip(known).for_each(|(f, k)| *f -= share * k);
            }
        }
        force = if self.basis.is_empty() { force } else { self.linear.resist_all(&field) };
        let rest = energy(&field, &force).max(0.0).sqrt();
        if rest > NEW * whole {
            field.iter_mut().for_each(|f| *f /= rest);
            force.iter_mut().for_each(|f| *f /= rest);
            self.basis.push(field);
            forces.push(force);
        }
    }

    fn project(&mut self, known: usize) {
        let [cases, gauges] = self.linear.size();
        let basis = &self.basis;
        self.zones.par_iter_mut().for_each(|zone| zone.grow(basis, known));
        let works = |field: &Vec<f64>, case: usize| field.iter().zip(self.linear.source(case)).map(|(u, f)| u * f).sum();
        self.forces = DMatrix::from_fn(basis.len(), cases, |i, case| works(&basis[i], case));
        let read: Vec<Vec<f64>> = basis.iter().map(|field| self.linear.read(field)).collect();
        self.gauges = DMatrix::from_fn(basis.len(), gauges, |i, gauge| read[i][gauge]);
    }
}

impl Forward for Reduced<'_, '_, '_> {
    fn zones(&self) -> usize {
        self.rig.zones.len()
    }

    fn read(&self, damage: &[(usize, f64)], borders: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let mut stiffness = DMatrix::identity(self.basis.len(), self.basis.len());
        for &(zone, d) in damage {
            stiffness.zip_apply(&self.zones[zone].small, |k, z| *k -= d * z);
        }
        let factor = Cholesky::new(stiffness)?;
        let (u, lines) = (factor.solve(&self.forces), factor.solve(&self.gauges));
        let [cases, gauges] = self.linear.size();
        let readings = self.gauges.tr_mul(&u);
        let mut slopes = DMatrix::zeros(cases * gauges, damage.len() + borders.len());
        let width = |border: usize| {
            let is_end = border < FACES || border >= self.rig.zones.len();
            if is_end { BORDER } else { 2.0 * BORDER }
        };
        let of_zones = damage.iter().map(|d| (d.0, 1.0));
        let of_borders = borders.iter().map(|&b| (self.rig.zones.len() + b, 1.0 / width(b)));
        for (k, (zone, per)) in of_zones.chain(of_borders).enumerate() {
            let by = lines.tr_mul(&(&self.zones[zone].small * &u)) * per;
            slopes.column_mut(k).copy_from_slice(by.as_slice());
        }
        // By columns: case by case, gauges within.
        Some((DVector::from_column_slice(readings.as_slice()) + &self.finer, slopes))
    }

    fn visit(&mut self, damage: &[(usize, f64)]) -> Result<(), FeltError> {
        let mut all = vec![0.0; self.rig.zones.len()];
        damage.iter().for_each(|&(zone, d)| all[zone] = d);
        self.linear.soften(&self.rig.soften(&all))?;
        self.job.step(0, 1)?;
        let mut fields = self.linear.fields()?;
        fields.extend(self.linear.importances()?);
        let known = self.basis.len();
        let mut forces: Vec<Vec<f64>> = self.basis.par_iter().map(|field| self.linear.resist_all(field)).collect();
        fields.into_iter().for_each(|field| self.add(field, &mut forces));
        self.project(known);
        self.visited += 1;
        Ok(())
    }
}
