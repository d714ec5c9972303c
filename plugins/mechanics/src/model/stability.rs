//! How near an equilibrium is to where it would buckle.
//!
//! Displacements are taken as small here: forces act where things were, and no column ever buckles.
//! What is left out is known, though. Stress σ in a body that moves by v does the work −½ ∫ σ_ij
//! ∂_i v·∂_j v dV = ½ vᵀG v; with the stiffness K of the sound elastic structure, all joints
//! closed, the state loses its stability under 1/μ of its loads, μ the largest eigenvalue of
//!
//! ```text
//! G φ = μ K φ
//! ```
//!
//! (linear buckling; for a clamped column it is Euler's load). To first order, what is left out
//! enlarges deflections by 1/(1 − μ). Cracks and creep make it worse; they are not counted, since
//! bricks between cracks would buckle in shear, alone, as no strut does that has a width.

use glam::{DMat3, DVec3};
use intrados_stage::{Job, random::Key};
use nalgebra::DMatrix;

use super::{Bedding, Equations, Failure, Ground, History, Point, System, Trial};
use crate::{
    element::hex8,
    sparse::{BlockMatrix, Constraints, Method, SolveError, Solver},
    tensor::Voigt,
};

/// Directions that are looked at, at most.
const DIRECTIONS: usize = 24;
/// The eigenvalue is known well enough when one more direction changes it by less than this share
/// of it, or of a [`HUNDREDTH`], below which nobody asks how much it is.
const SETTLED: f64 = 1e-3;
/// Of the loads that buckle.
const HUNDREDTH: f64 = 0.01;
/// To which part linear systems are solved.
const LINEAR: f64 = 1e-4;

/// G of one brick over one component of its nodes' displacements, N/m: all three components have
/// the same.
type Geometric = [[f64; 8]; 8];

impl System<'_> {
    /// Whether its stiffness is at any time and wherever it moves that of rest, to the bit: elastic
    /// bricks and shells that have always been there, on nothing that lets go.
    pub(super) fn keeps_stiffness(&self) -> bool {
        let holds = |g: &Ground| matches!(g.bedding, Bedding::Springs { lifts: false, .. });
        self.model.is_elastic()
            && self.model.bodies.iter().all(|body| body.birth == f64::NEG_INFINITY)
            && self.model.ground.iter().all(holds)
    }

    /// μ: the loads of a state over those under which the elastic structure buckles, 0 where
    /// nothing does. `points` are those of [`System::all_points`]. The `equations` of the march
    /// there are solved with as they are where the structure keeps its stiffness; else their matrix
    /// is written over.
    ///
    /// The largest eigenvalue by Lanczos's method in the product of K, every direction held against
    /// all before. None: nothing here is made of bricks, or the stiffness has no inverse.
    ///
    /// # Errors
    /// [`Failure`].
    pub(crate) fn nearness_to_buckling(
        &self,
        history: &History,
        points: &[[Point; 8]],
        equations: &mut Equations,
        job: &Job,
    ) -> Result<Option<f64>, Failure> {
        let mut constraints = Constraints::new(self.unknowns() / 3);
        let held = self.prescribed(history.time);
        for &(node, component, _) in &held {
            constraints.fix(node as usize, usize::from(component), 0.0)?;
        }
        let quiet = job.part(0.0, 0.0);
        let Equations { matrix, solver, stays, .. } = equations;
        let mut own = None;
        let solver = match solver {
            Some(solver) if *stays => solver,
            other => {
                // One matrix and, where it is a factor, one solver at a time.
                other.iter_mut().for_each(Solver::release);
                self.assemble_sound(history.time, matrix, job)?;
                // Five to two dozen solutions of one matrix: a factor pays sooner than for one.
                let made = found(Solver::new(matrix, &constraints, Method::Once, &quiet))?;
                let Some(made) = made else { return Ok(None) };
                own.insert(made)
            }
        };
        let geometric = self.geometric(history, points);
        let free = |mut v: Vec<f64>| {
            held.iter().for_each(|&(node, component, _)| {
                v[3 * node as usize + usize::from(component)] = 0.0
            });
            v
        };
        // Any direction will do that is not across the one that is looked for.
        let nodes = self.model.mesh.nodes.len();
        let mut load = free(
            (0..self.unknowns())
                .map(|i| if i < 3 * nodes { Key::new(1, i as u64).unit64(0) - 0.5 } else { 0.0 })
                .collect(),
        );
        let (mut basis, mut mu): (Vec<[Vec<f64>; 2]>, f64) = (Vec::new(), 0.0);
        let mut small = DMatrix::zeros(DIRECTIONS, DIRECTIONS);
        for k in 0..DIRECTIONS {
            let solved = found(solver.solve(matrix, &load, &constraints, LINEAR, &quiet))?;
            let Some(solved) = solved else { return Ok(None) };
            let (mut v, mut kv) = (solved.x, load);
            for [w, kw] in &basis {
                let share = dot(&v, kw);
                add(&mut v, -share, w);
                add(&mut kv, -share, kw);
            }
            let norm = dot(&v, &kv);
            if norm.is_nan() || norm <= 0.0 {
                break;
            }
            v.iter_mut().chain(&mut kv).for_each(|x| *x /= norm.sqrt());
            load = free(self.act(&geometric, &v));
            basis.push([v, kv]);
            for (i, [w, _]) in basis.iter().enumerate() {
                (small[(i, k)], small[(k, i)]) = (dot(w, &load), dot(w, &load));
            }
            let before = std::mem::replace(
                &mut mu,
                small.view((0, 0), (k + 1, k + 1)).symmetric_eigenvalues().max().max(0.0),
            );
            if k > 3 && mu - before <= SETTLED * mu.max(HUNDREDTH) {
                break;
            }
        }
        Ok((!basis.is_empty()).then_some(mu))
    }

    /// The stiffness of what is there at a time, without cracks and with all joints closed.
    fn assemble_sound(
        &self,
        time: f64,
        matrix: &mut BlockMatrix<3>,
        job: &Job,
    ) -> Result<(), Failure> {
        let (rest, warmth) = (self.rest(time), [Vec::new(), Vec::new()]);
        self.assemble(Trial::still(&rest, &warmth), &rest.x, matrix, &mut Vec::new(), job)
    }

    /// G of every brick, its bars and tendons included.
    fn geometric(&self, history: &History, points: &[[Point; 8]]) -> Vec<Geometric> {
        let mesh = &self.model.mesh;
        let mut all = vec![Geometric::default(); mesh.hexes.len()];
        for (hex, sum) in
            all.iter_mut().enumerate().filter(|(hex, _)| self.is_alive(*hex, history.time))
        {
            let corners = mesh.corners(hex as u32);
            for (natural, point) in hex8::GAUSS.into_iter().zip(&points[hex]) {
                let jacobian = hex8::jacobian(&corners, natural);
                let inverse = jacobian.inverse().transpose();
                let slopes = hex8::slopes(natural).map(|slope| inverse * slope);
                let stress = jacobian.determinant() * tensor_of(&point.stress);
                for (a, row) in sum.iter_mut().enumerate() {
                    (0..8).for_each(|b| row[b] -= slopes[a].dot(stress * slopes[b]));
                }
            }
        }
        for (steel, works) in self.model.steel.iter().zip(&history.steel) {
            for (i, (piece, work)) in steel
                .pieces
                .iter()
                .zip(works)
                .enumerate()
                .filter(|(_, (piece, _))| self.is_alive(piece.host, history.time))
            {
                let force = steel.area_at(i, history.time) * work.stress;
                let [first, second] = piece.natural.map(hex8::shape);
                let slope: [f64; 8] =
                    std::array::from_fn(|a| (second[a] - first[a]) / piece.length());
                for (a, row) in all[piece.host].iter_mut().enumerate() {
                    (0..8).for_each(|b| row[b] -= force * piece.length() * slope[a] * slope[b]);
                }
            }
        }
        all
    }

    /// G v.
    fn act(&self, geometric: &[Geometric], v: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; v.len()];
        for (hex, g) in self.model.mesh.hexes.iter().zip(geometric) {
            for (a, row) in g.iter().enumerate() {
                for c in 0..3 {
                    sum[3 * hex.nodes[a] as usize + c] +=
                        (0..8).map(|b| row[b] * v[3 * hex.nodes[b] as usize + c]).sum::<f64>();
                }
            }
        }
        sum
    }
}

/// What a solver found; none: nothing, and nobody stopped it.
fn found<T>(told: Result<T, SolveError>) -> Result<Option<T>, SolveError> {
    match told {
        Ok(found) => Ok(Some(found)),
        Err(why @ SolveError::Cancelled(_)) => Err(why),
        Err(_) => Ok(None),
    }
}

/// The matrix of a stress in six numbers.
fn tensor_of(&[xx, yy, zz, xy, yz, zx]: &Voigt) -> DMat3 {
    DMat3::from_cols(DVec3::new(xx, xy, zx), DVec3::new(xy, yy, yz), DVec3::new(zx, yz, zz))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(x: &mut [f64], factor: f64, dx: &[f64]) {
    x.iter_mut().zip(dx).for_each(|(x, dx)| *x += factor * dx);
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{
        mesh::{HexFace, block, divide},
        model::{Action, Body, Drive, Elastic, Load, March, MarchSettings, Matter, Model, Step},
    };

    /// A clamped bar of 6 × .4 × .3 m under `thrust` N along its axis, without steel and ground.
    fn bar(thrust: f64) -> Model {
        let mesh = block(
            &divide(0.0, 6.0, &[], 0.2),
            &divide(0.0, 0.4, &[], 0.2),
            &divide(0.0, 0.3, &[], 0.15),
            "bar",
        )
        .unwrap();
        let elastic = Elastic { modulus: 30e9, poisson: 0.0, expansion: 0.0, density: 0.0 };
        let mut model = Model {
            bodies: vec![Body { matter: Matter::Elastic(elastic), birth: f64::NEG_INFINITY }],
            mesh,
            ..Model::default()
        };
        let at = |x: f64| {
            (0..model.mesh.nodes.len() as u32)
                .filter(|&n| (model.mesh.nodes[n as usize].x - x).abs() < 1e-9)
                .collect::<Vec<_>>()
        };
        let (foot, head) = (at(0.0), at(6.0));
        let push = head.iter().map(|&n| (n, -thrust / head.len() as f64 * DVec3::X)).collect();
        model.holds = foot.into_iter().flat_map(|n| (0..3).map(move |c| (n, c))).collect();
        model.loads.push(Load {
            name: "thrust".into(),
            action: Action::Nodes(push),
            history: vec![],
        });
        model
    }

    /// Loads over those of buckling, with the equations of the march and with new ones.
    fn nearness(model: &Model) -> [f64; 2] {
        let (structure, job) = (System::new(model).unwrap(), Job::default());
        let settings = MarchSettings::default();
        let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
        let mut found = [f64::NAN; 2];
        let each = |history: &History, _: &Step, kept: &mut Equations| -> Result<(), Failure> {
            let points = structure.all_points(history)?;
            let mut new = Equations::new(&structure, &settings);
            for (found, equations) in found.iter_mut().zip([kept, &mut new]) {
                let near = structure.nearness_to_buckling(history, &points, equations, &job)?;
                *found = near.unwrap();
            }
            Ok(())
        };
        march.advance_with(1.0, 0.0, &job, each).unwrap();
        found
    }

    /// π² E I/(4 l²) about the weaker axis; bricks with modes bend within a per cent, shear takes
    /// .2 %. What is pulled does not buckle.
    #[test]
    fn a_clamped_bar_buckles_under_eulers_load() {
        let euler = PI.powi(2) * 30e9 * (0.4 * 0.3_f64.powi(3) / 12.0) / (4.0 * 36.0);
        let [pressed, pulled] = [0.5, -0.5].map(|share| nearness(&bar(share * euler))[0]);
        assert!((pressed - 0.5).abs() < 0.01, "{pressed}");
        assert!(pulled < 0.05, "{pulled}");
    }

    /// What the march solved with is used where its stiffness stays, and gives the same bits; on
    /// springs that let go, or where something is born, the sound structure has its own, whether a
    /// factor or a hierarchy lay there before.
    #[test]
    fn the_equations_of_a_march_serve_where_its_stiffness_stays() {
        let keeps = |model: &Model| System::new(model).unwrap().keeps_stiffness();
        let [mut springs, mut born] = [bar(1e6), bar(1e6)];
        let stiffness = DVec3::splat(1e9);
        for (lifts, expected) in [(false, true), (true, false)] {
            let bedding = Bedding::Springs { stiffness, lifts };
            springs.ground = vec![Ground { face: HexFace { hex: 0, face: 0 }, bedding }];
            assert_eq!(keeps(&springs), expected);
        }
        born.bodies[0].birth = 0.0;
        assert!(keeps(&bar(1e6)) && !keeps(&born));
        for model in [bar(1e6), springs, born] {
            let [kept, new] = nearness(&model);
            assert!(kept == new && kept > 0.0, "{kept} {new}");
        }
    }
}
