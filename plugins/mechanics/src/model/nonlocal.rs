//! The implicit gradient (Peerlings, de Borst, Brekelmans and de Vree 1996), instead of the crack
//! band: damage of tension is driven by the non-local strain e,
//!
//! ```text
//! e − c ∇²e = ε,   c = ℓ²/2,   n·∇e = 0 on the surface of the concrete,
//! ```
//!
//! where ε is the local equivalent strain. A crack is then a zone some four ℓ wide that knows
//! neither the size of the elements nor their directions. In a secant iteration displacements
//! determine ε, ε determines e, and both determine forces: so e is no unknown of the iteration but
//! solved for within it, with one matrix ∫ N Nᵀ + c ∇N ∇Nᵀ for the whole life of what is there.

use std::sync::Arc;

use intrados_stage::Job;

use super::{Matter, System, Trial, march::Failure};
use crate::{
    element::scalar,
    material::concrete::Properties,
    sparse::{
        BlockMatrix, Connectivity, Constraints, Method, Pattern, Place, Solver, assemble_vector,
    },
};

/// What keeps the strain of a crack from gathering in one layer of elements, however thin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Regularisation {
    /// An element's softening dissipates the fracture energy over its own size.
    #[default]
    Band,
    /// The implicit gradient.
    Gradient {
        /// ℓ, m: at least twice the size of the elements.
        length: f64,
    },
}

/// Largest residual of the linear equations, relative.
const TOLERANCE: f64 = 1e-10;
/// Smallest ℓ over the size of an element: with it a bar dissipates a tenth too much, with twice
/// that ℓ 2 %, with half of it four tenths.
const RESOLVED: f64 = 2.0;
/// Largest ℓ over E G_f/f_t²: beyond, a crack would be so brittle that a bar snaps.
const LONGEST: f64 = 0.25;

impl Regularisation {
    /// The width over which the law of a concrete is to spread G_f in an element of `size` (none:
    /// that size itself), or between which lengths ℓ must be.
    ///
    /// In a long bar a crack dissipates G_f if its law does over w = ℓ (4.0 − 2.34 √λ) with λ = ℓ
    /// f_t²/(E G_f). In units of ℓ, f_t and E the bar is e − e″/2 = ε, σ = (1 − d(max e)) ε with
    /// the law's d of 1/λ over w/ℓ, so that w/ℓ is a function of λ alone: that for which ∫σ du =
    /// 1/λ. Solved by finite differences (a weak spot of ℓ/2 or ℓ, 2 or 3 %; e in its middle rises
    /// until σ is 4 per mille of the strength) it is 3.89, 3.79, 3.66, 3.43, 3.24, 2.95 and 2.83
    /// for λ = .007, .01, .02, .054, .1, .2 and .25, which the formula fits within 1 %, below .01
    /// within 2.5 %. The test below solves such bars again.
    pub(super) fn spread(self, concrete: &Properties, size: f64) -> Result<Option<f64>, [f64; 2]> {
        let Self::Gradient { length } = self else { return Ok(None) };
        let characteristic = concrete.modulus * concrete.fracture_energy / concrete.fctm.powi(2);
        let between = [RESOLVED * size, LONGEST * characteristic];
        if !(between[0] <= length && length <= between[1]) {
            return Err(between);
        }
        Ok(Some(length * width(length / characteristic)))
    }
}

/// w/ℓ by λ: see [`Regularisation::spread`].
fn width(lambda: f64) -> f64 {
    4.0 - 2.34 * lambda.sqrt()
}

/// The equation for e.
pub(super) struct Nonlocal {
    /// c, m².
    spreading: f64,
    elements: Connectivity,
    /// For the bodies that are there.
    equations: Option<Equations>,
}

struct Equations {
    /// Which bodies are of concrete and there.
    there: Vec<bool>,
    matrix: BlockMatrix<1>,
    constraints: Constraints<1>,
    solver: Solver<1>,
}

impl Nonlocal {
    /// Of a structure; none: its cracks are bands.
    pub(super) fn new(structure: &System) -> Option<Self> {
        let Regularisation::Gradient { length } = structure.model.regularisation else {
            return None;
        };
        let elements = structure.model.mesh.hexes.iter().map(|hex| hex.nodes).collect();
        Some(Self { spreading: 0.5 * length * length, elements, equations: None })
    }

    /// e at the nodes for displacements `x`; `trial` holds that of the iteration before, from which
    /// a law that creeps takes its damage.
    pub(super) fn solve(
        &mut self,
        structure: &System,
        trial: Trial,
        x: &[f64],
        job: &Job,
    ) -> Result<Vec<f64>, Failure> {
        let bodies = structure.model.bodies.iter();
        let there: Vec<bool> = bodies
            .map(|b| b.birth <= trial.time && matches!(b.matter, Matter::Concrete(_)))
            .collect();
        let equations = match self.equations.take().filter(|e| e.there == there) {
            Some(equations) => equations,
            None => Equations::new(self, structure, there, job)?,
        };
        let Equations { there, matrix, constraints, solver } = self.equations.insert(equations);
        let mesh = &structure.model.mesh;
        let mut right = vec![0.0; mesh.nodes.len()];
        assemble_vector::<1, Failure>(&self.elements, &mut right, job, |e, f| {
            if there[mesh.hexes[e].region as usize] {
                let (mut local, mut modes) = ([0.0; 8], trial.history.modes[e]);
                let u = structure.moved(e, trial.history, x)?.local;
                structure
                    .brick(e, trial, &u, &mut modes, |point, answer| local[point] = answer.local)?;
                let source = scalar::source(&mesh.corners(e as u32), |point| local[point]);
                f.copy_from_slice(&source.map_err(|why| structure.of_hex(e, why))?);
            }
            Ok(())
        })?;
        Ok(solver.solve(matrix, &right, constraints, TOLERANCE, job)?.x)
    }
}

impl Equations {
    fn new(
        nonlocal: &Nonlocal,
        structure: &System,
        there: Vec<bool>,
        job: &Job,
    ) -> Result<Self, Failure> {
        let mesh = &structure.model.mesh;
        let places = mesh.nodes.iter().map(|p| Place::point(p.to_array())).collect();
        let mut matrix = BlockMatrix::zeros(Arc::new(Pattern::new(places, &nonlocal.elements)?));
        let (mut sum, mut strained) = (vec![0.0; mesh.nodes.len()], vec![false; mesh.nodes.len()]);
        matrix.assemble_with(&nonlocal.elements, &mut sum, job, |e, k, _| {
            if there[mesh.hexes[e].region as usize] {
                let corners = mesh.corners(e as u32);
                let failed = |why| structure.of_hex(e, why);
                let (mass, laplace) = (
                    scalar::mass(&corners, |_| 1.0),
                    scalar::laplace(&corners, |_| nonlocal.spreading),
                );
                let (mass, laplace) = (mass.map_err(failed)?, laplace.map_err(failed)?);
                k.iter_mut()
                    .zip(mass.as_flattened().iter().zip(laplace.as_flattened()))
                    .for_each(|(k, (m, l))| *k = m + l);
            }
            Ok::<(), Failure>(())
        })?;
        let concrete = mesh.hexes.iter().filter(|hex| there[hex.region as usize]);
        concrete.flat_map(|hex| hex.nodes).for_each(|n| strained[n as usize] = true);
        let mut constraints = Constraints::new(mesh.nodes.len());
        for (node, _) in strained.iter().enumerate().filter(|(_, strained)| !**strained) {
            constraints.fix(node, 0, 0.0)?;
        }
        let solver = Solver::new(&matrix, &constraints, Method::Auto, job)?;
        Ok(Self { there, matrix, constraints, solver })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::softening::Tension;

    /// Half a bar by finite differences, lengths in ℓ, stresses in f_t, strains in f_t/E: e − e″/2
    /// = σ/(1 − d(max e)), torn apart by raising e in its middle.
    struct Bar {
        h: f64,
        laws: Vec<Tension>,
        /// Largest e so far.
        kappa: Vec<f64>,
        e: Vec<f64>,
        stress: f64,
    }

    impl Bar {
        fn new(lambda: f64) -> Self {
            let (h, n) = (0.025, 320);
            let law = |i: usize| {
                Tension::of(
                    1.0,
                    if (i as f64 + 0.5) * h < 0.5 { 0.98 } else { 1.0 },
                    1.0 / lambda,
                    width(lambda),
                )
            };
            Self {
                h,
                laws: (0..n).map(law).collect(),
                kappa: vec![0.0; n],
                e: vec![0.5; n],
                stress: 0.5,
            }
        }

        /// Newton's iteration to e = `top` in the middle; false: it does not converge.
        fn raise(&mut self, top: f64) -> bool {
            let (n, c) = (self.e.len(), 0.5 / (self.h * self.h));
            let (mut e, mut stress) = (self.e.clone(), self.stress);
            for _ in 0..25 {
                // Rows of −c, diagonal, −c with two right sides: what is out of balance, and what
                // stress does.
                let (mut diagonal, mut right) = (vec![0.0; n], vec![[0.0; 2]; n]);
                for i in 0..n {
                    let (d, slope) = self.laws[i].damage(self.kappa[i].max(e[i]));
                    let around = [i.checked_sub(1), (i + 1 < n).then_some(i + 1)];
                    let bend: f64 = around.into_iter().flatten().map(|j| c * (e[i] - e[j])).sum();
                    let grows = if e[i] >= self.kappa[i] {
                        stress * slope / (1.0 - d).powi(2)
                    } else {
                        0.0
                    };
                    diagonal[i] = 1.0 + c * around.into_iter().flatten().count() as f64 - grows;
                    right[i] = [stress / (1.0 - d) - e[i] - bend, 1.0 / (1.0 - d)];
                }
                for i in 1..n {
                    let share = c / diagonal[i - 1];
                    diagonal[i] -= share * c;
                    (0..2).for_each(|k| right[i][k] += share * right[i - 1][k]);
                }
                for i in (0..n).rev() {
                    let next = if i + 1 < n { right[i + 1] } else { [0.0; 2] };
                    right[i] = std::array::from_fn(|k| (right[i][k] + c * next[k]) / diagonal[i]);
                }
                let more = (top - e[0] - right[0][0]) / right[0][1];
                let step = |i: usize| right[i][0] + more * right[i][1];
                let size = (0..n).map(|i| step(i).abs()).fold(0.0, f64::max);
                if size.is_nan() || size > 1e6 {
                    return false;
                }
                (0..n).for_each(|i| e[i] += step(i));
                stress += more;
                if size < 1e-9 * top.max(1.0) {
                    self.kappa.iter_mut().zip(&e).for_each(|(kappa, e)| *kappa = kappa.max(*e));
                    (self.e, self.stress) = (e, stress);
                    return true;
                }
            }
            false
        }

        fn elongation(&self) -> f64 {
            2.0 * self.h
                * self
                    .laws
                    .iter()
                    .zip(&self.kappa)
                    .map(|(law, kappa)| self.stress / (1.0 - law.damage(*kappa).0))
                    .sum::<f64>()
        }

        /// Work of tearing over G_f.
        fn work(mut self, lambda: f64) -> f64 {
            let (mut top, mut step, mut work, mut before) = (0.5, 0.02, 0.0, [0.0; 2]);
            while self.stress > 0.004 || top < 2.0 {
                if !self.raise(top + step) {
                    step *= 0.5;
                    assert!(step > 1e-9, "stands still at e = {top}");
                    continue;
                }
                (top, step) = (top + step, (1.3 * step).min(0.02 * top));
                let now = [self.elongation(), self.stress];
                work += 0.5 * (now[0] - before[0]) * (now[1] + before[1]);
                before = now;
            }
            work * lambda
        }
    }

    #[test]
    fn the_width_keeps_the_fracture_energy() {
        for (lambda, share) in [(0.02, 0.015), (0.054, 0.015), (0.1, 0.015), (0.25, 0.015)] {
            let work = Bar::new(lambda).work(lambda);
            assert!((work - 1.0).abs() < share, "λ = {lambda}: {work} G_f");
        }
    }
}
