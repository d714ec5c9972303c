//! A small model of the whole one: Galerkin in the space of primal and dual fields at the damages
//! visited so far.
//!
//! At every visited damage it gives readings *and* their sensitivities (but for what is thrown away
//! as too small to be told), because the space holds the field u and the importance λ there: ∂m/∂d
//! = λᵀ K_z u is computed from both. Elsewhere a reading's error is the product of the errors of u
//! and of λ in the space (the goal-oriented bound, e.g. Rozza, Huynh and Patera 2008, §4). So the
//! dual's J, re-linearised where it matters, becomes a model that is right to second order between.

use intrados_mechanics::model::Linear;
use intrados_stage::Job;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    GaugeError,
    grip::Grip,
    inverse::Forward,
    rig::{BORDER, FACES, Rig},
    unknown::{Priors, Unknown, unknowns},
};

/// A new field whose rest outside of the space is smaller than this, over the field itself, adds
/// nothing that a gauge could tell: errors of readings are products of two such rests.
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
    /// What a finer mesh reads more of the sound member, and what its supports give more.
    finer: DVector<f64>,
    finer_given: DVector<f64>,
    /// What besides damage is not known, and its standard deviation.
    unknowns: Vec<(Unknown, f64)>,
    /// Vᵀ K V of all concrete, and of every kind of springs among the unknowns.
    concrete: DMatrix<f64>,
    springs: Vec<DMatrix<f64>>,
    /// Of the energy that concrete takes up in each case (column), sound, how much each of `zones`
    /// does.
    shares: DMatrix<f64>,
    grip: Grip,
    /// Tractions under what is held, of the sound structure, one column a member of the basis.
    tractions: DMatrix<f64>,
    /// What makes the squares of all cases' tractions sum to their energy.
    compliance: f64,
    visited: usize,
    job: Job,
}

/// A zone over the nodes of its bricks, and within the space.
struct Zone {
    nodes: Vec<u32>,
    stiffness: DMatrix<f64>,
    /// Vᵀ K_z V
    small: DMatrix<f64>,
    /// Tractions with which K_z V pulls at what is held; no rows where it does not reach that.
    held: DMatrix<f64>,
}

impl Zone {
    fn new(linear: &Linear, bricks: &[(u32, f64)]) -> Self {
        let hexes = &linear.structure().model.mesh.hexes;
        let mut nodes: Vec<u32> =
            bricks.iter().flat_map(|&(hex, _)| hexes[hex as usize].nodes).collect();
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
        Self { nodes, stiffness, small: DMatrix::zeros(0, 0), held: DMatrix::zeros(0, 0) }
    }

    /// Takes the members of the basis from number `known` on into the space.
    fn grow(&mut self, basis: &[Vec<f64>], known: usize, grip: &Grip) {
        let of = |field: &Vec<f64>| {
            self.nodes
                .iter()
                .flat_map(|&n| (0..3).map(move |c| field[3 * n as usize + c]))
                .collect::<Vec<f64>>()
        };
        let rows = 3 * self.nodes.len();
        let all = DMatrix::from_iterator(rows, basis.len(), basis.iter().flat_map(of));
        let forces = &self.stiffness * all.columns(known, basis.len() - known);
        let news = all.tr_mul(&forces);
        let old = std::mem::replace(&mut self.small, DMatrix::zeros(basis.len(), basis.len()));
        self.small.view_mut((0, 0), (known, known)).copy_from(&old);
        self.small.columns_mut(known, basis.len() - known).copy_from(&news);
        let turned = news.rows(0, known).transpose();
        self.small.view_mut((known, 0), (basis.len() - known, known)).copy_from(&turned);
        self.pull(&forces, known, grip);
    }

    /// Takes what its forces pull at held nodes into the space.
    fn pull(&mut self, forces: &DMatrix<f64>, known: usize, grip: &Grip) {
        if !grip.holds_any(&self.nodes) {
            return;
        }
        let force = |column: usize, unknown: usize| {
            let at = self.nodes.binary_search(&((unknown / 3) as u32)).ok();
            at.map_or(0.0, |at| forces[(3 * at + unknown % 3, column)])
        };
        let news =
            (0..forces.ncols()).flat_map(|column| grip.tractions(|unknown| force(column, unknown)));
        let news = DMatrix::from_iterator(grip.len(), forces.ncols(), news.collect::<Vec<_>>());
        let mut held = DMatrix::zeros(grip.len(), known + news.ncols());
        if known > 0 {
            held.columns_mut(0, known).copy_from(&self.held);
        }
        held.columns_mut(known, news.ncols()).copy_from(&news);
        self.held = held;
    }
}

impl<'r, 's, 'm> Reduced<'r, 's, 'm> {
    /// The space at no damage.
    ///
    /// # Errors
    /// [`GaugeError`].
    pub fn new(
        rig: &'r Rig,
        linear: Linear<'s, 'm>,
        priors: &Priors,
        job: &Job,
    ) -> Result<Self, GaugeError> {
        let zones = rig
            .zones
            .par_iter()
            .chain(&rig.borders)
            .map(|bricks| Zone::new(&linear, bricks))
            .collect();
        let [cases, gauges] = linear.size();
        let mut this = Self {
            rig,
            linear,
            zones,
            basis: Vec::new(),
            forces: DMatrix::zeros(0, cases),
            gauges: DMatrix::zeros(0, gauges),
            finer: DVector::zeros(cases * gauges),
            finer_given: DVector::zeros(cases * gauges),
            unknowns: unknowns(rig, priors),
            concrete: DMatrix::zeros(0, 0),
            springs: Vec::new(),
            shares: DMatrix::zeros(0, cases),
            grip: Grip::of(rig),
            tractions: DMatrix::zeros(0, 0),
            compliance: 0.0,
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

    /// Takes what a finer mesh reads of the sound member, and what its supports give: from now on
    /// every reading is corrected by the difference.
    pub(crate) fn correct(&mut self, sound: &[f64], given: &[f64]) {
        let Some((own, _)) = self.read(&[], &[], &[]) else { return };
        self.finer += DVector::from_column_slice(sound) - own;
        // The basis is orthonormal in energy: at no damage fields are their forces in it.
        self.finer_given +=
            DVector::from_column_slice(given) - self.given(&[], 1.0, &self.forces, &self.gauges);
    }

    /// How stiff the concrete is in each case, over what is assumed: its modulus, less what damage
    /// takes of the energy. What a finer mesh reads more is as much more where that is less; or
    /// damage of the whole beside a higher modulus would explain errors of the mesh.
    fn stiff(&self, damage: &[(usize, f64)], modulus: f64) -> DVector<f64> {
        let all = DVector::from_element(self.shares.ncols(), modulus);
        damage
            .iter()
            .fold(all, |all, &(zone, d)| all - self.shares.row(zone).transpose() * (modulus * d))
    }

    /// What supports add to readings of these fields and importances where they take up as much
    /// energy as the member. That energy falls as its concrete is stiffer.
    fn given(
        &self,
        damage: &[(usize, f64)],
        modulus: f64,
        u: &DMatrix<f64>,
        lines: &DMatrix<f64>,
    ) -> DVector<f64> {
        if self.tractions.nrows() == 0 {
            return self.finer_given.clone();
        }
        let tractions = self.tractions(damage, modulus);
        let given = (&tractions * lines).tr_mul(&(&tractions * u)) * self.compliance;
        let given = DVector::from_column_slice(given.as_slice()) + &self.finer_given;
        by_case(given, &self.stiff(damage, modulus).map(f64::recip))
    }

    /// Tractions under what is held as modulus and damage make them: a soft corner bears less.
    fn tractions(&self, damage: &[(usize, f64)], modulus: f64) -> DMatrix<f64> {
        let mut all = self.tractions.clone();
        for (z, zone) in self.zones[..self.rig.zones.len()]
            .iter()
            .enumerate()
            .filter(|(_, zone)| zone.held.nrows() > 0)
        {
            let lost = damage.iter().find(|d| d.0 == z).map_or(0.0, |d| d.1);
            all.zip_apply(&zone.held, |t, h| *t += (modulus * (1.0 - lost) - 1.0) * h);
        }
        all
    }

    /// Adds what is new in a field to the basis (Gram and Schmidt, twice, in the energy of the
    /// sound structure).
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

    /// Takes the basis, and the forces that the sound structure resists it with, into everything
    /// that is kept small.
    fn project(&mut self, known: usize, resisted: &[Vec<f64>]) -> Result<(), GaugeError> {
        let [cases, gauges] = self.linear.size();
        let basis = &self.basis;
        let grip = &self.grip;
        self.zones.par_iter_mut().for_each(|zone| zone.grow(basis, known, grip));
        let works = |field: &Vec<f64>, case: usize| {
            field.iter().zip(self.linear.source(case)).map(|(u, f)| u * f).sum()
        };
        self.forces = DMatrix::from_fn(basis.len(), cases, |i, case| works(&basis[i], case));
        let read: Vec<Vec<f64>> = basis.iter().map(|field| self.linear.read(field)).collect();
        self.gauges = DMatrix::from_fn(basis.len(), gauges, |i, gauge| read[i][gauge]);
        let none = || DMatrix::zeros(basis.len(), basis.len());
        self.concrete =
            self.zones[..self.rig.zones.len()].iter().fold(none(), |sum, zone| sum + &zone.small);
        let mut shares = DMatrix::zeros(self.zones.len(), cases);
        for (case, force) in self.forces.column_iter().enumerate() {
            let energy = |small: &DMatrix<f64>| force.dot(&(small * force));
            let whole = energy(&self.concrete);
            for (z, zone) in self.zones.iter().enumerate().filter(|_| whole > 0.0) {
                shares[(z, case)] = energy(&zone.small) / whole;
            }
        }
        self.shares = shares;
        self.springs = Vec::new();
        for (unknown, _) in &self.unknowns {
            if let &Unknown::Springs(stiffness) = unknown {
                let forces = basis
                    .iter()
                    .map(|field| self.linear.resist_springs(stiffness, field))
                    .collect::<Result<Vec<_>, _>>()?;
                let works =
                    |i: usize, k: usize| basis[i].iter().zip(&forces[k]).map(|(u, f)| u * f).sum();
                self.springs.push(DMatrix::from_fn(basis.len(), basis.len(), works));
            }
        }
        let tractions =
            resisted.iter().flat_map(|force| self.grip.tractions(|unknown| force[unknown]));
        self.tractions = DMatrix::from_iterator(self.grip.len(), basis.len(), tractions);
        // The basis is orthonormal in energy, and at no damage the fields of the cases are their
        // forces in it.
        let (energy, all) =
            (self.forces.norm_squared(), (&self.tractions * &self.forces).norm_squared());
        self.compliance = if all > 0.0 { energy / all } else { 0.0 };
        Ok(())
    }
}

/// Every case's readings times its factor.
fn by_case(mut readings: DVector<f64>, factors: &DVector<f64>) -> DVector<f64> {
    let gauges = (readings.len() / factors.len().max(1)).max(1);
    for (case, factor) in readings.as_mut_slice().chunks_mut(gauges).zip(factors.iter()) {
        case.iter_mut().for_each(|r| *r *= factor);
    }
    readings
}

impl Forward for Reduced<'_, '_, '_> {
    fn zones(&self) -> usize {
        self.rig.zones.len()
    }

    fn unknowns(&self) -> usize {
        self.unknowns.len()
    }

    fn read(
        &self,
        damage: &[(usize, f64)],
        borders: &[usize],
        z: &[f64],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let [cases, gauges] = self.linear.size();
        let (mut modulus, mut loads, mut springs, mut give) =
            (1.0, vec![1.0; cases], Vec::new(), 0.0);
        for (&(unknown, sd), z) in self.unknowns.iter().zip(z) {
            match unknown {
                Unknown::Modulus => modulus = (sd * z).exp(),
                Unknown::Load(case) => loads[case] = (sd * z).exp(),
                Unknown::Springs(_) => springs.push((sd * z).exp()),
                Unknown::Give => give = sd * z,
            }
        }
        // K(d, E) = K₀ + (E − 1) Σ K_z − E Σ d_z K_z, E over what is assumed.
        let mut stiffness = DMatrix::identity(self.basis.len(), self.basis.len());
        if modulus != 1.0 {
            stiffness.zip_apply(&self.concrete, |k, c| *k += (modulus - 1.0) * c);
        }
        for (small, factor) in self.springs.iter().zip(&springs) {
            stiffness.zip_apply(small, |k, s| *k += (factor - 1.0) * s);
        }
        for &(zone, d) in damage {
            stiffness.zip_apply(&self.zones[zone].small, |k, z| *k -= modulus * d * z);
        }
        let factor = Cholesky::new(stiffness)?;
        let (u, lines) = (factor.solve(&self.forces), factor.solve(&self.gauges));
        // By columns: case by case, gauges within.
        let flat = |by: DMatrix<f64>| DVector::from_column_slice(by.as_slice());
        let loads = DVector::from_vec(loads);
        let loaded = |all: DVector<f64>| by_case(all, &loads);
        let by_stiffness = |small: &DMatrix<f64>| flat(lines.tr_mul(&(small * &u)));
        let given = self.given(damage, modulus, &u, &lines);
        let soft = self.stiff(damage, modulus).map(f64::recip);
        let added = by_case(self.finer.clone(), &soft) + &given * give;
        let readings = loaded(flat(self.gauges.tr_mul(&u)) + &added);
        let mut slopes = DMatrix::zeros(cases * gauges, damage.len() + borders.len() + z.len());
        let width = |border: usize| {
            let is_end = border < FACES || border >= self.rig.zones.len();
            if is_end { BORDER } else { 2.0 * BORDER }
        };
        let of_zones = damage.iter().map(|d| (d.0, 1.0));
        let of_borders = borders.iter().map(|&b| (self.rig.zones.len() + b, 1.0 / width(b)));
        for (k, (zone, per)) in of_zones.chain(of_borders).enumerate() {
            let own = by_stiffness(&self.zones[zone].small);
            let share = self.shares.row(zone).transpose().component_mul(&soft);
            slopes.set_column(k, &loaded((own + by_case(added.clone(), &share)) * (modulus * per)));
        }
        let mut springs = self.springs.iter().zip(&springs);
        for (k, &(unknown, sd)) in self.unknowns.iter().take(z.len()).enumerate() {
            let by = match unknown {
                Unknown::Modulus => {
                    let left = damage.iter().fold(self.concrete.clone(), |left, &(zone, d)| {
                        left - &self.zones[zone].small * d
                    });
                    loaded((by_stiffness(&left) * -modulus) - &added)
                }
                Unknown::Load(case) => {
                    let mut own = DVector::zeros(readings.len());
                    own.rows_mut(case * gauges, gauges)
                        .copy_from(&readings.rows(case * gauges, gauges));
                    own
                }
                Unknown::Springs(_) => {
                    springs.next().map(|(small, factor)| loaded(by_stiffness(small) * -factor))?
                }
                Unknown::Give => loaded(given.clone()),
            };
            slopes.set_column(damage.len() + borders.len() + k, &(by * sd));
        }
        Some((readings, slopes))
    }

    fn visit(&mut self, damage: &[(usize, f64)]) -> Result<(), GaugeError> {
        let mut all = vec![0.0; self.rig.zones.len()];
        damage.iter().for_each(|&(zone, d)| all[zone] = d);
        self.linear.soften(&self.rig.soften(&all))?;
        self.job.step(0, 1)?;
        let mut fields = self.linear.fields()?;
        fields.extend(self.linear.importances()?);
        let known = self.basis.len();
        let mut forces: Vec<Vec<f64>> =
            self.basis.par_iter().map(|field| self.linear.resist_all(field)).collect();
        fields.into_iter().for_each(|field| self.add(field, &mut forces));
        self.project(known, &forces)?;
        self.visited += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use intrados_mechanics::{member::Meshing, model::System};
    use intrados_scene::Scene;

    use super::*;

    const PIER: &str = r#"(
        schema: "intrados.scene/1",
        members: [(id: "P", concrete: "C30/37", body: Column(
            section: Rectangle(width_m: 0.5, depth_m: 0.5), height_m: 4,
            reinforcement: (cover_mm: 40, bars: [Around(count: 8, diameter_mm: 20)], stirrups: (diameter_mm: 10, spacing_mm: 200)),
        ))],
        supports: [(member: "P", place: Start, hold: Fixed)],
        tests: [
            (name: "truck", member: "P", actions: [Force(place: End, force_kn: (0, -500, 0))]),
            (name: "rope", member: "P", actions: [Force(place: End, force_kn: (20, 0, 0))]),
        ],
        gauges: [
            (name: "1", member: "P", along: 0.2, angle_deg: 0, measures: Strain(Axial)),
            (name: "2", member: "P", along: 0.9, angle_deg: 0, measures: Displacement((1, 0, 0))),
        ],
    )"#;

    /// A reduced model of a pier whose readings a finer mesh has raised by a tenth.
    fn with_reduced(test: impl FnOnce(&Reduced)) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("pier.ron");
        std::fs::write(&file, PIER).unwrap();
        let job = Job::default();
        let scene = Scene::load(&file, &job).unwrap();
        let rig = Rig::new(&scene, "P", Meshing { element: Some(0.25) }).unwrap().unwrap();
        let structure = System::new(&rig.model).unwrap();
        let priors = Priors { modulus: 0.1, give: 0.05, ..Priors::KNOWN };
        let linear = rig.linear(&structure, &job).unwrap();
        let mut reduced = Reduced::new(&rig, linear, &priors, &job).unwrap();
        let own = reduced.read(&[], &[], &[]).unwrap().0;
        let given = reduced.given(&[], 1.0, &reduced.forces, &reduced.gauges);
        reduced.correct((&own * 1.1).as_slice(), (given * 1.1).as_slice());
        let raised = reduced.read(&[], &[], &[]).unwrap().0;
        assert!((raised / 1.1 - &own).norm() < 1e-9 * own.norm());
        test(&reduced);
    }

    /// With what a finer mesh reads more, too; or the two together would explain errors of the mesh.
    #[test]
    fn damage_of_the_whole_reads_as_a_lower_modulus() {
        with_reduced(|reduced| {
            let lost = 0.2_f64;
            let whole: Vec<(usize, f64)> = (0..reduced.zones()).map(|z| (z, lost)).collect();
            let damaged = reduced.read(&whole, &[], &[0.0, 1.0]).unwrap().0;
            let softer = (1.0 - lost).ln() / 0.1;
            let softer = reduced.read(&[], &[], &[softer, 1.0]).unwrap().0;
            assert!((&damaged - &softer).norm() < 1e-9 * softer.norm(), "{damaged} {softer}");
        });
    }

    #[test]
    fn slopes_are_those_of_the_readings() {
        with_reduced(|reduced| {
            let at = |d: f64, z: f64| reduced.read(&[(5, d)], &[], &[z, 0.0]).unwrap();
            let (small, slopes) = (1e-5, at(0.3, 0.5).1);
            let by_damage = (at(0.3 + small, 0.5).0 - at(0.3 - small, 0.5).0) / (2.0 * small);
            let by_modulus = (at(0.3, 0.5 + small).0 - at(0.3, 0.5 - small).0) / (2.0 * small);
            for (k, by) in [by_damage, by_modulus].into_iter().enumerate() {
                assert!((slopes.column(k) - &by).norm() < 1e-6 * by.norm(), "{k}: {slopes} {by}");
            }
        });
    }
}
