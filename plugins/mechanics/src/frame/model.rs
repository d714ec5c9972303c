//! Beams, plates and links between nodes with six unknowns each; what holds them and what acts on
//! them; and their equilibrium.
//!
//! Elements may be fastened beside a node, by a rigid arm a: u(p) = u + θ × a. What is rigidly
//! joined has one node, so that rigid ends and offsets are exact and cost nothing.
//!
//! Node i has its displacement in block i of the matrix and its rotation in block n + i.

use glam::DVec3;
use intrados_stage::Job;
use nalgebra::{DMatrix, DVector};

use super::beam::{Along, Beam, Vector};
use crate::{
    element::{
        ElementError,
        shell::{Resultants, Shell},
    },
    sparse::{
        BlockMatrix, Connectivity, Constraints, Kind, Method, Pattern, Place, SolveError, Solver,
    },
};

/// Residual over load that is asked for, and the one that is still taken where rounding does not let
/// the first be reached: stiff beside soft. Reactions are the residual of what is held, so that it
/// bounds their error.
const TOLERANCE: f64 = 1e-11;
const ROUNDING: f64 = 1e-7;

/// Where an element is fastened: to a node, by an arm from it, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct End {
    pub(crate) node: u32,
    pub(crate) arm: DVec3,
}

/// Springs between two ends at one place, or from one to the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    pub(crate) ends: [Option<End>; 2],
    /// Unit, at right angles.
    pub(crate) axes: [DVec3; 3],
    /// Along the axes, N/m, and about them, N m.
    pub(crate) stiffness: [f64; 6],
}

/// A structure.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Model {
    /// m.
    pub(crate) nodes: Vec<DVec3>,
    /// Beams between two fastenings; `Beam::ends` is where those are.
    pub(crate) beams: Vec<(Beam, [End; 2])>,
    /// Plates (MITC4) between four.
    pub(crate) plates: Vec<(Shell, [End; 4])>,
    pub(crate) links: Vec<Link>,
    /// Directions in which a node does not move, or (`true`) about which it does not turn.
    pub(crate) holds: Vec<(u32, bool, DVec3)>,
}

/// What acts on a structure.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Case {
    /// Along beams, by their number.
    pub(crate) beams: Vec<(u32, Along)>,
    /// On plates, by their number, N/m².
    pub(crate) plates: Vec<(u32, DVec3)>,
    /// Force and moment at an end of a member, by its number, N and N m.
    pub(crate) points: Vec<(u32, End, [DVec3; 2])>,
}

/// A structure with its factor.
pub(crate) struct System<'a> {
    pub(crate) model: &'a Model,
    matrix: BlockMatrix<3>,
    constraints: Constraints<3>,
    solver: Solver<3>,
}

/// An equilibrium.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Equilibrium {
    /// Displacements of all nodes, then their rotations.
    pub(crate) x: Vec<f64>,
    /// What the ground does to a node that it holds: force at the node and moment about it.
    pub(crate) reactions: Vec<(u32, [DVec3; 2])>,
    /// Force and moment about the origin that loads and reactions leave, over all loads (moments
    /// over loads times the size of the structure).
    pub(crate) unbalanced: f64,
}

/// Why there is no equilibrium.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// An element has no shape.
    #[error("{what} {number} of the frame: {source}")]
    Element {
        /// `beam` or `plate`.
        what: &'static str,
        /// Its number.
        number: usize,
        /// What is wrong.
        source: ElementError,
    },
    /// The equations have no solution.
    #[error("the whole structure: {0}")]
    Solve(#[from] SolveError),
    /// Part of it can move.
    #[error(
        "the whole structure: it moves freely near member {member} ({why}): hold it by a support, or join it by joints that hold more"
    )]
    Mechanism {
        /// Id of a member that moves.
        member: String,
        /// What the solver says.
        why: SolveError,
    },
    /// Nothing holds anything.
    #[error(
        "the whole structure: nothing holds it: add a support to the scene, such as (member: \"{0}\", place: Bottom, hold: Fixed)"
    )]
    NotHeld(String),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] intrados_stage::Cancelled),
}

/// Turns stiffness and load of an element at its fastenings into those at its nodes: δu(p) = δu −
/// a × δθ. `turns[c]` is the first rotation of corner c, whose displacement is at `moves[c]`.
fn carry(
    stiffness: &mut DMatrix<f64>,
    load: &mut DVector<f64>,
    corners: impl Iterator<Item = (usize, usize, DVec3)>,
) {
    for (moves, turns, a) in corners.filter(|c| c.2 != DVec3::ZERO) {
        let cross = [[0.0, a.z, -a.y], [-a.z, 0.0, a.x], [a.y, -a.x, 0.0]];
        let n = stiffness.nrows();
        for (i, row) in cross.iter().enumerate() {
            for (j, s) in row.iter().enumerate().filter(|(_, s)| **s != 0.0) {
                for r in 0..n {
                    let add = stiffness[(r, moves + i)] * s;
                    stiffness[(r, turns + j)] += add;
                }
            }
        }
        for (i, row) in cross.iter().enumerate() {
            for (j, s) in row.iter().enumerate().filter(|(_, s)| **s != 0.0) {
                for c in 0..n {
                    let add = stiffness[(moves + i, c)] * s;
                    stiffness[(turns + j, c)] += add;
                }
                let add = load[moves + i] * s;
                load[turns + j] += add;
            }
        }
    }
}

/// Where the unknowns of a beam's ends are among its twelve, and of a plate's corners.
fn of_beam(ends: &[End; 2]) -> impl Iterator<Item = (usize, usize, DVec3)> {
    ends.map(|e| e.arm).into_iter().enumerate().map(|(e, arm)| (6 * e, 6 * e + 3, arm))
}

fn of_plate(ends: &[End; 4]) -> impl Iterator<Item = (usize, usize, DVec3)> {
    ends.map(|e| e.arm).into_iter().enumerate().map(|(c, arm)| (3 * c, 12 + 3 * c, arm))
}

impl Model {
    fn turn_of(&self, node: u32) -> u32 {
        self.nodes.len() as u32 + node
    }

    /// Blocks of all elements: beams, plates, links.
    fn connectivity(&self) -> Connectivity {
        let mut all = Connectivity::default();
        for (_, [a, b]) in &self.beams {
            all.push(&[a.node, self.turn_of(a.node), b.node, self.turn_of(b.node)]);
        }
        for (_, ends) in &self.plates {
            let nodes = ends.map(|e| e.node);
            let turns = nodes.map(|n| self.turn_of(n));
            all.push(&[nodes, turns].concat());
        }
        for link in &self.links {
            let nodes: Vec<u32> = link.ends.iter().flatten().map(|e| e.node).collect();
            all.push(&nodes.iter().flat_map(|&n| [n, self.turn_of(n)]).collect::<Vec<_>>());
        }
        all
    }

    /// Stiffness of element `e`, in the order of its blocks.
    fn stiffness(&self, e: usize) -> Result<DMatrix<f64>, FrameError> {
        if let Some((beam, ends)) = self.beams.get(e) {
            return Ok(self.beam(beam, ends, &Along::default()).0);
        }
        let e = e - self.beams.len();
        if let Some((plate, ends)) = self.plates.get(e) {
            let element = plate
                .integrate(&[0.0; 24], |_| [0.0; 3])
                .map_err(|source| FrameError::Element { what: "plate", number: e, source })?;
            let mut k = DMatrix::from_fn(24, 24, |r, c| element.stiffness[r][c]);
            carry(&mut k, &mut DVector::zeros(24), of_plate(ends));
            return Ok(k);
        }
        Ok(self.links[e - self.plates.len()].stiffness_matrix())
    }

    fn beam(&self, beam: &Beam, ends: &[End; 2], along: &Along) -> (DMatrix<f64>, DVector<f64>) {
        let (k, f) = beam.integrate(along);
        let mut k = DMatrix::from_fn(12, 12, |r, c| k[(r, c)]);
        let mut f = DVector::from_fn(12, |r, _| f[r]);
        carry(&mut k, &mut f, of_beam(ends));
        (k, f)
    }

    /// Adds a force and a moment at an end to loads of all nodes.
    fn add(&self, load: &mut [f64], end: &End, [force, moment]: [DVec3; 2]) {
        let blocks = load.as_chunks_mut::<3>().0;
        let about = moment + end.arm.cross(force);
        for (block, add) in [(end.node, force), (self.turn_of(end.node), about)] {
            let block = &mut blocks[block as usize];
            *block = (DVec3::from_array(*block) + add).to_array();
        }
    }

    /// All that acts, at the nodes.
    pub(crate) fn load(&self, case: &Case) -> Result<Vec<f64>, FrameError> {
        let mut load = vec![0.0; 6 * self.nodes.len()];
        let vector = |v: &[f64], at: usize| DVec3::new(v[at], v[at + 1], v[at + 2]);
        for (number, along) in &case.beams {
            let (beam, ends) = &self.beams[*number as usize];
            let (_, f) = beam.integrate(along);
            for (e, end) in ends.iter().enumerate() {
                let f = f.as_slice();
                self.add(&mut load, end, [vector(f, 6 * e), vector(f, 6 * e + 3)]);
            }
        }
        for (number, pressure) in &case.plates {
            let (plate, ends) = &self.plates[*number as usize];
            let number = *number as usize;
            let f = plate.load(|_, _| *pressure).map_err(|source| FrameError::Element {
                what: "plate",
                number,
                source,
            })?;
            for (c, end) in ends.iter().enumerate() {
                self.add(&mut load, end, [vector(&f, 3 * c), DVec3::ZERO]);
            }
        }
        case.points.iter().for_each(|(_, end, acts)| self.add(&mut load, end, *acts));
        Ok(load)
    }
}

impl Link {
    /// In the order of its blocks: k d dᵀ for each spring, where d says how far unit unknowns
    /// stretch it.
    fn stiffness_matrix(&self) -> DMatrix<f64> {
        let ends: Vec<(f64, End)> =
            self.ends.iter().zip([1.0, -1.0]).filter_map(|(e, s)| Some((s, (*e)?))).collect();
        let mut k = DMatrix::zeros(6 * ends.len(), 6 * ends.len());
        for (spring, stiffness) in self.stiffness.into_iter().enumerate() {
            let axis = self.axes[spring % 3];
            let stretch = ends.iter().flat_map(|(sign, end)| {
                let (by_move, by_turn) =
                    if spring < 3 { (axis, end.arm.cross(axis)) } else { (DVec3::ZERO, axis) };
                [sign * by_move, sign * by_turn].map(|v| v.to_array()).concat()
            });
            let d = DVector::from_iterator(6 * ends.len(), stretch);
            k.ger(stiffness, &d, &d, 1.0);
        }
        k
    }
}

impl<'a> System<'a> {
    /// Assembles and factorises.
    ///
    /// # Errors
    /// [`FrameError`]: a part that can move freely among others.
    pub(crate) fn new(model: &'a Model, job: &Job) -> Result<Self, FrameError> {
        let place = |kind: fn(u32) -> Kind| {
            move |(i, p): (usize, &DVec3)| Place { position: p.to_array(), kind: kind(i as u32) }
        };
        let mut places: Vec<Place> =
            model.nodes.iter().enumerate().map(place(|_| Kind::Translation)).collect();
        places.extend(model.nodes.iter().enumerate().map(place(Kind::RotationOf)));
        let elements = model.connectivity();
        let mut matrix = BlockMatrix::zeros(Pattern::new(places, &elements)?.into());
        matrix.assemble(&elements, job, |e, k| {
            // Symmetric: whether by rows or by columns is one.
            k.copy_from_slice(model.stiffness(e)?.as_slice());
            Ok::<_, FrameError>(())
        })?;
        let mut constraints = Constraints::new(2 * model.nodes.len());
        for &(node, turns, direction) in &model.holds {
            let block = if turns { model.turn_of(node) } else { node };
            constraints.fix_along(block as usize, direction.to_array(), 0.0)?;
        }
        let solver = Solver::new(&matrix, &constraints, Method::Direct, job)?;
        Ok(Self { model, matrix, constraints, solver })
    }

    /// The equilibrium under a case.
    ///
    /// # Errors
    /// [`FrameError`].
    pub(crate) fn solve(&mut self, case: &Case, job: &Job) -> Result<Equilibrium, FrameError> {
        let load = self.model.load(case)?;
        let mut within = |tolerance: f64| {
            self.solver.solve(&self.matrix, &load, &self.constraints, tolerance, job)
        };
        let solution = match within(TOLERANCE) {
            Err(SolveError::NotConverged { residual, .. }) if residual < ROUNDING => {
                within(2.0 * residual)
            }
            other => other,
        };
        let x = solution?.x;
        let mut held = vec![0.0; x.len()];
        self.matrix.multiply(&x, &mut held);
        held.iter_mut().zip(&load).for_each(|(h, f)| *h -= f);
        let reactions = self.reactions(&held, &x);
        let unbalanced = self.unbalanced(&load, &reactions);
        Ok(Equilibrium { x, reactions, unbalanced })
    }

    /// What is held where, by what K u − f leaves there; and what springs to the ground do.
    fn reactions(&self, left: &[f64], x: &[f64]) -> Vec<(u32, [DVec3; 2])> {
        let blocks = left.as_chunks::<3>().0;
        let mut nodes: Vec<u32> = self.model.holds.iter().map(|h| h.0).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let of = |node: u32| {
            let held =
                [node, self.model.turn_of(node)].map(|b| DVec3::from_array(blocks[b as usize]));
            (node, held)
        };
        let mut reactions: Vec<_> = nodes.into_iter().map(of).collect();
        for link in self.model.links.iter().filter(|l| l.ends[1].is_none()) {
            let Some(end) = link.ends[0] else { continue };
            let [force, moment] = link.forces(self.model, x);
            reactions.push((end.node, [force, moment + end.arm.cross(force)]));
        }
        reactions
    }

    fn unbalanced(&self, load: &[f64], reactions: &[(u32, [DVec3; 2])]) -> f64 {
        let nodes = &self.model.nodes;
        let n = nodes.len();
        let blocks = load.as_chunks::<3>().0;
        let (mut force, mut moment, mut all) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        let middle = nodes.iter().sum::<DVec3>() / n.max(1) as f64;
        let size = nodes.iter().map(|p| p.distance(middle)).fold(1e-9, f64::max);
        let mut add = |at: DVec3, f: DVec3, m: DVec3| {
            force += f;
            moment += m + (at - middle).cross(f);
        };
        for (i, &at) in nodes.iter().enumerate() {
            let (f, m) = (DVec3::from_array(blocks[i]), DVec3::from_array(blocks[n + i]));
            all += f.length() + m.length() / size;
            add(at, f, m);
        }
        reactions.iter().for_each(|(node, [f, m])| add(nodes[*node as usize], *f, *m));
        if all > 0.0 { force.length().max(moment.length() / size) / all } else { 0.0 }
    }
}

impl Link {
    /// What the other end (or the ground) does to the first: force and moment at the link.
    pub(crate) fn forces(&self, model: &Model, x: &[f64]) -> [DVec3; 2] {
        let [a, b] = self.ends.map(|end| end.map_or([DVec3::ZERO; 2], |e| e.moved(model, x)));
        let [apart, turned] = [b[0] - a[0], b[1] - a[1]];
        let sum = |v: DVec3, first: usize| {
            (0..3).map(|i| self.stiffness[first + i] * v.dot(self.axes[i]) * self.axes[i]).sum()
        };
        [sum(apart, 0), sum(turned, 3)]
    }
}

impl End {
    /// Displacement and rotation.
    pub(crate) fn moved(&self, model: &Model, x: &[f64]) -> [DVec3; 2] {
        let blocks = x.as_chunks::<3>().0;
        let [u, turn] =
            [self.node, model.turn_of(self.node)].map(|b| DVec3::from_array(blocks[b as usize]));
        [u + turn.cross(self.arm), turn]
    }
}

impl Model {
    /// What its nodes do to a beam, in its own axes, at displacements `x`.
    pub(crate) fn held(&self, beam: usize, x: &[f64], along: &Along) -> Vector {
        let (beam, ends) = &self.beams[beam];
        let moved = ends.map(|e| e.moved(self, x).map(|v| v.to_array()).concat());
        beam.held(&Vector::from_iterator(moved.concat()), along)
    }

    /// What its nodes do to a plate at its corners, forces and moments, where a pressure acts on it.
    pub(crate) fn held_plate(&self, number: usize, x: &[f64], pressure: DVec3) -> [[DVec3; 2]; 4] {
        let (plate, _) = &self.plates[number];
        let u = self.moved_plate(number, x);
        let acts = plate.load(|_, _| pressure).unwrap_or([0.0; 24]);
        let bears = plate.integrate(&u, |_| [0.0; 3]).map_or([0.0; 24], |element| element.force);
        let at = |v: &[f64; 24], first: usize| DVec3::new(v[first], v[first + 1], v[first + 2]);
        std::array::from_fn(|c| {
            [3 * c, 12 + 3 * c].map(|first| at(&bears, first) - at(&acts, first))
        })
    }

    /// Displacements and rotations of a plate's corners, in the order of its unknowns.
    fn moved_plate(&self, number: usize, x: &[f64]) -> [f64; 24] {
        let mut u = [0.0; 24];
        for (c, end) in self.plates[number].1.iter().enumerate() {
            let [by, turn] = end.moved(self, x);
            u[3 * c..3 * c + 3].copy_from_slice(&by.to_array());
            u[12 + 3 * c..15 + 3 * c].copy_from_slice(&turn.to_array());
        }
        u
    }

    /// Forces and moments of a plate at its middle.
    ///
    /// # Errors
    /// [`FrameError::Element`].
    pub(crate) fn resultants(&self, number: usize, x: &[f64]) -> Result<Resultants, FrameError> {
        let (plate, _) = &self.plates[number];
        let u = self.moved_plate(number, x);
        plate.resultants(&u, |_| [0.0; 3], 0.0, 0.0).map_err(|source| FrameError::Element {
            what: "plate",
            number,
            source,
        })
    }
}
