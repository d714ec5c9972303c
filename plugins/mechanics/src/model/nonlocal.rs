//! The implicit gradient (Peerlings, de Borst, Brekelmans and de Vree 1996), instead of the crack band: damage of tension is driven by the non-local strain e,
//!
//! ```text
//! e − c ∇²e = ε,   c = ℓ²/2,   n·∇e = 0 on the surface of the concrete,
//! ```
//!
//! where ε is the local equivalent strain. A crack is then a zone some four ℓ wide that knows neither the size of the elements nor their
//! directions. In a secant iteration displacements determine ε, ε determines e, and both determine forces: so e is no unknown of the iteration but solved for
//! within it, with one matrix ∫ N Nᵀ + c ∇N ∇Nᵀ for the whole life of what is there.

use std::sync::Arc;

use intrados_stage::Job;

use super::{Matter, Structure, Trial, march::Failure};
use crate::{
    element::scalar,
    material::concrete::Properties,
    sparse::{BlockMatrix, Connectivity, Constraints, Method, Pattern, Place, Solver, assemble_vector},
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
/// Smallest ℓ over the size of an element: with it a bar dissipates a tenth too much, with twice that ℓ some per cent, with half of it four tenths.
const RESOLVED: f64 = 2.0;
/// Largest ℓ over E G_f/f_t²: beyond, a crack would be so brittle that a bar snaps.
const LONGEST: f64 = 0.25;

impl Regularisation {
    /// The width over which the law of a concrete is to spread G_f in an element of `size` (none: that size itself), or between which
    /// lengths ℓ must be.
    ///
    /// In a long bar a crack dissipates G_f if its law does over w = ℓ (3.75 − 2.2 √λ) with λ = ℓ f_t²/(E G_f). This fits bars solved for λ between .007 and
    /// .25 (by finite differences in one dimension, to 4 per mille of the strength, ends of the zone included) within 2 %.
    pub(super) fn spread(self, concrete: &Properties, size: f64) -> Result<Option<f64>, [f64; 2]> {
        let Self::Gradient { length } = self else { return Ok(None) };
        let characteristic = concrete.modulus * concrete.fracture_energy / concrete.fctm.powi(2);
        let between = [RESOLVED * size, LONGEST * characteristic];
        if !(between[0] <= length && length <= between[1]) {
            return Err(between);
        }
        Ok(Some(length * (3.75 - 2.2 * (length / characteristic).sqrt())))
    }
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
    pub(super) fn new(structure: &Structure) -> Option<Self> {
        let Regularisation::Gradient { length } = structure.model.regularisation else { return None };
        let elements = structure.model.mesh.hexes.iter().map(|hex| hex.nodes).collect();
        Some(Self { spreading: 0.5 * length * length, elements, equations: None })
    }

    /// e at the nodes for displacements `x`; `trial` holds that of the iteration before, from which a law that creeps takes its damage.
    pub(super) fn solve(&mut self, structure: &Structure, trial: Trial, x: &[f64], job: &Job) -> Result<Vec<f64>, Failure> {
        let bodies = structure.model.bodies.iter();
        let there: Vec<bool> = bodies.map(|b| b.birth <= trial.time && matches!(b.matter, Matter::Concrete(_))).collect();
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
                structure.brick(e, trial, x, &mut modes, |point, answer| local[point] = answer.local)?;
                let source = scalar::source(&mesh.corners(e as u32), |point| local[point]);
                f.copy_from_slice(&source.map_err(|why| structure.of_hex(e, why))?);
            }
            Ok(())
        })?;
        Ok(solver.solve(matrix, &right, constraints, TOLERANCE, job)?.x)
    }
}

impl Equations {
    fn new(nonlocal: &Nonlocal, structure: &Structure, there: Vec<bool>, job: &Job) -> Result<Self, Failure> {
        let mesh = &structure.model.mesh;
        let places = mesh.nodes.iter().map(|p| Place::point(p.to_array())).collect();
        let mut matrix = BlockMatrix::zeros(Arc::new(Pattern::new(places, &nonlocal.elements)?));
        let (mut sum, mut strained) = (vec![0.0; mesh.nodes.len()], vec![false; mesh.nodes.len()]);
        matrix.assemble_with(&nonlocal.elements, &mut sum, job, |e, k, _| {
            if there[mesh.hexes[e].region as usize] {
                let corners = mesh.corners(e as u32);
                let failed = |why| structure.of_hex(e, why);
                let (mass, laplace) = (scalar::mass(&corners, |_| 1.0), scalar::laplace(&corners, |_| nonlocal.spreading));
                let (mass, laplace) = (mass.map_err(failed)?, laplace.map_err(failed)?);
                k.iter_mut().zip(mass.as_flattened().iter().zip(laplace.as_flattened())).for_each(|(k, (m, l))| *k = m + l);
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
