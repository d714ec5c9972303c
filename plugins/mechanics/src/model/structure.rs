//! A model made ready to be computed: which unknowns it has, what it resists, what acts on it.

use std::{
    collections::BTreeMap,
    sync::{Arc, OnceLock},
};

use glam::DVec3;
use intrados_stage::Job;
use rayon::prelude::*;

use super::{
    Action, History, Matter, Model, Regularisation,
    law::{Answer, Law, Memory, Moment},
    march::Failure,
    past_peak,
    slip::Slips,
    thin::Rotations,
    ties,
};
use crate::{
    element::{
        ElementError,
        hex8::{self, Kind, Modes},
        interface,
        load::{self, Face},
        quad::Quadrature,
        turn::Turn,
    },
    material::law::Ties,
    mesh::{ElementId, HexFace},
    sparse::{BlockMatrix, Connectivity, Pattern, Place},
    tensor::{self, Tangent, Voigt},
};

/// A model with its unknowns in order.
#[derive(Debug)]
pub struct System<'m> {
    /// What is computed.
    pub model: &'m Model,
    /// Of each brick the index of its law.
    law_of: Vec<u32>,
    laws: Vec<Law>,
    pub(super) elements: Connectivity,
    /// Of each brick the pieces of bars that do as it does: which bar, which piece of it.
    bonded: Vec<Vec<(u32, u32)>>,
    /// The same of each element after the bricks: pieces that slip or end in plates.
    pieces: Vec<(u32, u32)>,
    /// Share of each brick that is concrete: steel displaces the rest.
    concrete: Vec<f64>,
    /// What bars do to the cracks of each brick.
    ties: Vec<Ties>,
    /// What lies at each face of each brick; found when it is asked for.
    neighbours: OnceLock<Vec<[Option<u32>; 6]>>,
    /// Since when each joint has a brick on both sides, s.
    joined: Vec<f64>,
    pattern: Arc<Pattern>,
    pub(super) rotations: Rotations,
    pub(super) slips: Slips,
}

/// A step that is being tried: from a history to a moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trial<'a> {
    /// Where it starts.
    pub history: &'a History,
    /// When it ends, s.
    pub time: f64,
    /// Temperatures of the nodes at its beginning and its end, over that without stress, K; empty:
    /// none.
    pub warmth: &'a [Vec<f64>; 2],
    /// Share of the history's excess that becomes damage of tension in this step, which then stays
    /// as it is; none: damage is found.
    pub growth: Option<f64>,
    /// Non-local strain of the nodes, which drives damage of tension; empty: it is driven by the
    /// local one.
    pub nonlocal: &'a [f64],
    /// Share of their stiffness that joints keep in the tangent, never in what they bear, while
    /// they are open or slide; zero: the true tangent.
    pub hold: f64,
}

impl<'a> Trial<'a> {
    /// No step at all: what holds in a history. `warmth` is that of its time.
    pub(super) fn still(history: &'a History, warmth: &'a [Vec<f64>; 2]) -> Self {
        Self {
            history,
            time: history.time,
            warmth,
            growth: None,
            nonlocal: &history.nonlocal,
            hold: 0.0,
        }
    }
}

/// What there is to see at a point of a brick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Point {
    /// Pa.
    pub stress: Voigt,
    /// Damage of tension and of compression.
    pub damage: [f64; 2],
    /// Opening of the widest crack, m.
    pub crack: f64,
    /// Across which it opens, of length 1.
    pub normal: [f64; 3],
}

impl Point {
    /// Damage of compression that is past the peak of its curve.
    pub(crate) fn crushing(&self) -> f64 {
        past_peak([0.0, self.damage[1]])
    }
}

impl<'m> System<'m> {
    /// Prepares a model.
    ///
    /// # Errors
    /// If mesh and bodies do not fit together.
    pub fn new(model: &'m Model) -> Result<Self, Failure> {
        let mesh = &model.mesh;
        if model.bodies.len() != mesh.regions.len() {
            return Err(Failure::Bodies {
                regions: mesh.regions.len(),
                bodies: model.bodies.len(),
            });
        }
        let (law_of, laws) = Law::of_bricks(mesh, &model.bodies, model.regularisation)?;
        let mut elements: Connectivity = mesh.hexes.iter().map(|hex| hex.nodes).collect();
        let (mut bonded, mut pieces) = (vec![Vec::new(); mesh.hexes.len()], Vec::new());
        let rotations = Rotations::new(mesh);
        let slips = Slips::new(model, (mesh.nodes.len() + rotations.places(mesh).count()) as u32);
        for (bar, steel) in model.steel.iter().enumerate() {
            for (piece, host) in steel.pieces.iter().map(|piece| piece.host).enumerate() {
                if steel.is_bonded(piece) {
                    bonded[host].push((bar as u32, piece as u32));
                    continue;
                }
                pieces.push((bar as u32, piece as u32));
                let mut nodes = slips.nodes(bar, piece, &mesh.hexes[host].nodes);
                nodes.extend(steel.under(piece));
                elements.push(&nodes);
            }
        }
        for (i, joint) in mesh.interfaces.iter().enumerate() {
            if !matches!(model.bodies[joint.region as usize].matter, Matter::Joint(_)) {
                return Err(Failure::Kind { element: mesh.name(ElementId::Interface(i as u32)) });
            }
            elements.push(&joint.nodes);
        }
        model.ground.iter().for_each(|ground| elements.push(&mesh.face(ground.face)));
        Self::add_thin(mesh, &model.bodies, &rotations, &mut elements)?;
        let places = mesh
            .nodes
            .iter()
            .map(|p| Place::point(p.to_array()))
            .chain(rotations.places(mesh))
            .chain(slips.places())
            .collect();
        let pattern = Arc::new(Pattern::new(places, &elements)?);
        let mut since = vec![f64::INFINITY; mesh.nodes.len()];
        for hex in &mesh.hexes {
            let birth = model.bodies[hex.region as usize].birth;
            hex.nodes.iter().for_each(|&n| since[n as usize] = since[n as usize].min(birth));
        }
        for shell in &mesh.shells {
            let birth = model.bodies[shell.region as usize].birth;
            shell.nodes.iter().for_each(|&n| since[n as usize] = since[n as usize].min(birth));
        }
        let latest = |nodes: &[u32; 8]| {
            nodes.iter().map(|&n| since[n as usize]).fold(f64::NEG_INFINITY, f64::max)
        };
        let joined = mesh.interfaces.iter().map(|joint| latest(&joint.nodes)).collect();
        let concrete = undisplaced(model);
        Ok(Self {
            model,
            law_of,
            laws,
            elements,
            bonded,
            pieces,
            concrete,
            ties: ties::ties(model),
            neighbours: OnceLock::new(),
            joined,
            pattern,
            rotations,
            slips,
        })
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
        let is_local = self.model.regularisation == Regularisation::Band;
        History {
            time,
            factor: 0.0,
            turned: false,
            x: vec![0.0; self.unknowns()],
            force: vec![0.0; self.unknowns()],
            modes: vec![Modes::default(); hexes],
            points: (0..hexes)
                .map(|hex| self.law(hex).born(time, self.birth(hex).min(time)))
                .collect(),
            born: Default::default(),
            softened: Default::default(),
            crushing: Default::default(),
            steel: self.model.steel.iter().map(super::Steel::rest).collect(),
            slips: vec![Default::default(); self.model.mesh.interfaces.len()],
            bars: self.resting_bars(),
            nonlocal: vec![0.0; if is_local { 0 } else { self.model.mesh.nodes.len() }],
        }
    }

    /// An empty stiffness.
    #[must_use]
    pub(crate) fn matrix(&self) -> BlockMatrix<3> {
        BlockMatrix::zeros(Arc::clone(&self.pattern))
    }

    pub(super) fn law(&self, hex: usize) -> &Law {
        &self.laws[self.law_of[hex] as usize]
    }

    pub(super) fn neighbours(&self) -> &[[Option<u32>; 6]] {
        self.neighbours.get_or_init(|| self.model.mesh.neighbours())
    }

    fn birth(&self, hex: usize) -> f64 {
        self.model.bodies[self.model.mesh.hexes[hex].region as usize].birth
    }

    /// Whether a brick is there at a time.
    #[must_use]
    pub(crate) fn is_alive(&self, hex: usize, time: f64) -> bool {
        self.birth(hex) <= time
    }

    /// Lets what is poured between the history's time and `time` take the shape that it finds:
    /// bricks without strain, and the joints around them closed, for what is poured lies where the
    /// other side has moved to.
    pub(crate) fn bear(&self, history: &mut History, time: f64) {
        for hex in 0..self.model.mesh.hexes.len() {
            if self.is_alive(hex, time) && !self.is_alive(hex, history.time) {
                history.born.insert(hex as u32, self.displacements(hex, &history.x));
                history.points[hex] =
                    self.law(hex).born(history.time, self.birth(hex).min(history.time));
            }
        }
        for joint in 0..self.model.mesh.interfaces.len() {
            if self.joint_is_alive(joint, time) && !self.joint_is_alive(joint, history.time) {
                let shape =
                    self.displacements_of(&self.model.mesh.interfaces[joint].nodes, &history.x);
                history.born.insert(self.number_of_joint(joint), shape);
            }
        }
        self.bear_thin(history, time);
    }

    /// Whether a joint has its law and a brick or a shell on both sides.
    fn joint_is_alive(&self, joint: usize, time: f64) -> bool {
        let region = self.model.mesh.interfaces[joint].region as usize;
        self.model.bodies[region].birth.max(self.joined[joint]) <= time
    }

    /// In the order of elements.
    fn number_of_joint(&self, joint: usize) -> u32 {
        (self.model.mesh.hexes.len() + self.pieces.len() + joint) as u32
    }

    /// What the ground at rest presses with, before anything moves, as one norm over all nodes, N.
    ///
    /// # Errors
    /// If a face is folded.
    pub(super) fn pressing(&self, time: f64) -> Result<f64, Failure> {
        let mut sum = vec![0.0; self.unknowns()];
        for ground in
            self.model.ground.iter().filter(|ground| self.is_alive(ground.face.hex as usize, time))
        {
            let nodes = self.model.mesh.face(ground.face);
            let places = nodes.map(|n| self.model.mesh.nodes[n as usize]);
            let element = ground
                .element(&places, &[0.0; 12], time)
                .map_err(|why| self.of_hex(ground.face.hex as usize, why))?;
            (0..12).for_each(|i| sum[3 * nodes[i / 3] as usize + i % 3] += element.force[i]);
        }
        Ok(sum.iter().map(|f| f * f).sum::<f64>().sqrt())
    }

    /// A failure of the solver, its node called by the label that the user knows.
    pub(super) fn labelled(&self, mut failure: Failure) -> Failure {
        let mesh = &self.model.mesh;
        if let Failure::Solve(why) = &mut failure
            && let Some(node) = why.node_mut()
        {
            let own = self.rotations.owner(*node as u32).unwrap_or(*node as u32);
            *node = mesh.labels.nodes.get(own as usize).copied().unwrap_or(own + 1) as usize;
        }
        failure
    }

    /// What acts at a time, three a node, N. Prescribed displacements and temperatures are no
    /// forces.
    ///
    /// # Errors
    /// If an element is folded.
    pub fn loads(&self, time: f64) -> Result<Vec<f64>, Failure> {
        let mut sum = vec![0.0; self.unknowns()];
        for load in &self.model.loads {
            let factor = load.factor(time);
            if factor != 0.0 {
                self.add_load(&load.action, factor, time, &mut sum)?;
            }
        }
        Ok(sum)
    }

    /// Adds `factor` times the forces of an action.
    pub(crate) fn add_load(
        &self,
        action: &Action,
        factor: f64,
        time: f64,
        sum: &mut [f64],
    ) -> Result<(), Failure> {
        let mesh = &self.model.mesh;
        let mut add = |node: u32, force: DVec3| {
            (0..3).for_each(|c| sum[3 * node as usize + c] += factor * force[c])
        };
        match action {
            Action::Nodes(forces) => forces.iter().for_each(|&(node, force)| add(node, force)),
            Action::Faces(faces) => {
                for &(HexFace { hex, face }, pressure) in
                    faces.iter().filter(|(face, _)| self.is_alive(face.hex as usize, time))
                {
                    let forces =
                        load::pressure(&mesh.corners(hex), Face::ALL[usize::from(face)], |_| {
                            pressure
                        })
                        .map_err(|e| self.of_hex(hex as usize, e))?;
                    for (node, force) in
                        mesh.hexes[hex as usize].nodes.iter().zip(forces.as_chunks::<3>().0)
                    {
                        add(*node, DVec3::from_array(*force));
                    }
                }
            }
            Action::Weight(acceleration) => {
                for hex in (0..mesh.hexes.len()).filter(|&hex| self.is_alive(hex, time)) {
                    let density =
                        self.model.bodies[mesh.hexes[hex].region as usize].matter.density();
                    let forces = load::body(&mesh.corners(hex as u32), |_| density * *acceleration)
                        .map_err(|e| self.of_hex(hex, e))?;
                    for (node, force) in mesh.hexes[hex].nodes.iter().zip(forces.as_chunks::<3>().0)
                    {
                        add(*node, DVec3::from_array(*force));
                    }
                }
            }
            Action::Shells(_) | Action::Displacement(_) | Action::Temperature(_) => {}
        }
        self.add_thin_load(action, time, add)
    }

    /// What is prescribed at a time: every held unknown with its value, m.
    #[must_use]
    pub fn prescribed(&self, time: f64) -> Vec<(u32, u8, f64)> {
        let holds = self.model.holds.iter().map(|&(node, component)| (node, component, 0.0));
        let mut all: Vec<_> = holds.chain(self.slips.held()).collect();
        // Loads add up, also those that move one node.
        let mut moved: BTreeMap<(u32, u8), f64> = BTreeMap::new();
        for load in &self.model.loads {
            let Action::Displacement(values) = &load.action else { continue };
            let factor = load.factor(time);
            for &(node, component, value) in values {
                *moved.entry((node, component)).or_default() += factor * value;
            }
        }
        all.extend(moved.into_iter().map(|((node, component), value)| (node, component, value)));
        all
    }

    /// Temperatures of the nodes at two times, over that without stress; empty where nothing warms.
    #[must_use]
    pub(crate) fn warmth(&self, times: [f64; 2]) -> [Vec<f64>; 2] {
        times.map(|time| {
            let mut sum = Vec::new();
            for load in &self.model.loads {
                if let Action::Temperature(field) = &load.action {
                    let factor = load.factor(time);
                    sum.resize(field.len(), 0.0);
                    sum.iter_mut().zip(field).for_each(|(sum, t)| *sum += factor * t);
                }
            }
            sum
        })
    }

    /// Stiffness and internal forces of a trial at displacements `x`; both are overwritten.
    ///
    /// # Errors
    /// If an element is folded or its law answers no number.
    pub(crate) fn assemble(
        &self,
        trial: Trial,
        x: &[f64],
        matrix: &mut BlockMatrix<3>,
        force: &mut Vec<f64>,
        job: &Job,
    ) -> Result<(), Failure> {
        matrix.clear();
        force.clear();
        force.resize(self.unknowns(), 0.0);
        let means = self.mean_strains(trial.history, x);
        let [hexes, pieces, joints] =
            [self.model.mesh.hexes.len(), self.pieces.len(), self.model.mesh.interfaces.len()];
        matrix.assemble_with(&self.elements, force, job, |e, k, f| {
            if e < hexes {
                if self.is_alive(e, trial.time) {
                    let mut modes = trial.history.modes[e];
                    let moved = self.moved(e, trial.history, x)?;
                    let solid = self.brick(e, trial, &moved.local, &mut modes, |_, _| {})?;
                    k.copy_from_slice(solid.stiffness.as_flattened());
                    f.copy_from_slice(&solid.force);
                    self.add_bonded(e, &moved, &means, trial, [&mut *k, &mut *f])?;
                    self.bring_back(e, &moved, [].into_iter(), x, k, f);
                }
                return Ok(());
            }
            let e = e - hexes;
            if e < pieces {
                let (bar, piece) = self.pieces[e];
                let (steel, host) = (
                    &self.model.steel[bar as usize],
                    self.model.steel[bar as usize].pieces[piece as usize].host,
                );
                if self.is_alive(host, trial.time) {
                    let moved = self.moved(host, trial.history, x)?;
                    let (this, mean) = ([bar as usize, piece as usize], means[bar as usize]);
                    if !self.slipping(this, &moved.local, trial, x, k, f)? {
                        self.anchored(this, &moved, mean, trial, x, k, f)?;
                    }
                    self.bring_back(host, &moved, steel.under(piece as usize), x, k, f);
                }
                return Ok(());
            }
            let e = e - pieces;
            if e < joints {
                let element = self.joint(e, trial, x, |_, _| {})?;
                k.copy_from_slice(element.stiffness.as_flattened());
                f.copy_from_slice(&element.force);
                return Ok(());
            }
            let e = e - joints;
            let Some(ground) = self.model.ground.get(e) else {
                return self.thin(e - self.model.ground.len(), trial, x, k, f);
            };
            if self.is_alive(ground.face.hex as usize, trial.time) {
                let nodes = self.model.mesh.face(ground.face);
                let u: [f64; 12] = std::array::from_fn(|i| x[3 * nodes[i / 3] as usize + i % 3]);
                let places = nodes.map(|n| self.model.mesh.nodes[n as usize]);
                let element = ground
                    .element(&places, &u, trial.time)
                    .map_err(|why| self.of_hex(ground.face.hex as usize, why))?;
                k.copy_from_slice(element.stiffness.as_flattened());
                f.copy_from_slice(&element.force);
            }
            Ok(())
        })
    }

    /// Adds to stiffness and force of a brick, in its own axes, those of the bars that do as it does.
    fn add_bonded(
        &self,
        hex: usize,
        moved: &Moved,
        means: &[f64],
        trial: Trial,
        [k, f]: [&mut [f64]; 2],
    ) -> Result<(), Failure> {
        for &(bar, piece) in &self.bonded[hex] {
            let (bar, piece) = (bar as usize, piece as usize);
            let (steel, before) = (&self.model.steel[bar], &trial.history.steel[bar][piece]);
            let span = [trial.history.time, trial.time];
            steel
                .add(piece, &moved.local, means[bar], before, span, [&mut *k, &mut *f])
                .map_err(|source| Failure::Element { element: steel.name.clone(), source })?;
        }
        Ok(())
    }

    /// The history after a trial that has converged at `x` with internal forces `force`.
    ///
    /// # Errors
    /// As [`System::assemble`].
    pub(crate) fn commit(
        &self,
        trial: Trial,
        x: Vec<f64>,
        factor: f64,
        force: Vec<f64>,
    ) -> Result<History, Failure> {
        let hexes = (0..self.model.mesh.hexes.len()).into_par_iter();
        let after: Vec<_> = hexes
            .map(|e| {
                let (mut modes, mut memory) =
                    (trial.history.modes[e], trial.history.points[e].clone());
                if self.is_alive(e, trial.time) {
                    let u = self.moved(e, trial.history, &x)?.local;
                    self.brick(e, trial, &u, &mut modes, |point, answer| {
                        if let (Memory::Concrete(points), Some(record)) =
                            (&mut memory, answer.state)
                        {
                            points[point] = record;
                        }
                    })?;
                }
                Ok((modes, memory))
            })
            .collect::<Result<_, Failure>>()?;
        let (modes, points): (Vec<Modes>, Vec<Memory>) = after.into_iter().unzip();
        let mut softened = trial.history.softened.clone();
        for (e, points) in points.iter().enumerate() {
            let counts = self.model.kind == Kind::Incompatible && points.is_damaged();
            if counts && !softened.contains_key(&(e as u32)) {
                softened.insert(e as u32, self.held(e, trial.history, &x, &modes[e])?);
            }
        }
        let crushing = self.crushing(&points, trial.time);
        let means = self.mean_strains(trial.history, &x);
        let mut steel = trial.history.steel.clone();
        for (bar, works) in steel.iter_mut().enumerate() {
            let of = &self.model.steel[bar];
            for (piece, work) in works
                .iter_mut()
                .enumerate()
                .filter(|(piece, _)| self.is_alive(of.pieces[*piece].host, trial.time))
            {
                let moved = self.moved(of.pieces[piece].host, trial.history, &x)?;
                let row = of.pieces[piece]
                    .strain_row()
                    .map_err(|source| Failure::Element { element: of.name.clone(), source })?;
                let strain = row.iter().zip(&moved.local).map(|(r, u)| r * u).sum::<f64>()
                    + self.stretch(bar, piece, &x)
                    + self.seated(bar, piece, &moved, &x);
                let bond = self.bonded(bar, piece, &x, work.bond);
                *work =
                    of.answer(piece, strain, means[bar], work, [trial.history.time, trial.time]).2;
                work.bond = bond;
            }
        }
        let mut slips = trial.history.slips.clone();
        for (e, slip) in slips.iter_mut().enumerate() {
            let mut after = *slip;
            self.joint(e, trial, &x, |point, slipped| after[point] = slipped)?;
            *slip = after;
        }
        let bars = self.commit_bars(trial, &x)?;
        let (born, nonlocal) = (trial.history.born.clone(), trial.nonlocal.to_vec());
        Ok(History {
            time: trial.time,
            factor,
            turned: trial.history.turned,
            x,
            force,
            modes,
            points,
            born,
            softened,
            crushing,
            steel,
            slips,
            bars,
            nonlocal,
        })
    }

    /// What there is to see at the points of a brick in a history.
    ///
    /// # Errors
    /// As [`System::assemble`].
    pub fn points(&self, hex: usize, history: &History) -> Result<[Point; 8], Failure> {
        let warmth = self.warmth([history.time; 2]);
        self.points_in(hex, Trial::still(history, &warmth))
    }

    /// The same of all bricks.
    ///
    /// # Errors
    /// As [`System::assemble`].
    pub fn all_points(&self, history: &History) -> Result<Vec<[Point; 8]>, Failure> {
        let warmth = self.warmth([history.time; 2]);
        let trial = Trial::still(history, &warmth);
        (0..self.model.mesh.hexes.len())
            .into_par_iter()
            .map(|hex| self.points_in(hex, trial))
            .collect()
    }

    fn points_in(&self, hex: usize, trial: Trial) -> Result<[Point; 8], Failure> {
        let mut points = [Point::default(); 8];
        if self.is_alive(hex, trial.time) {
            let mut modes = trial.history.modes[hex];
            let u = self.moved(hex, trial.history, &trial.history.x)?.local;
            self.brick(hex, trial, &u, &mut modes, |point, answer| {
                let damage = answer.state.map_or([0.0; 2], |record| record.state.damage);
                let (stress, crack, normal) = (answer.stress, answer.crack, answer.normal);
                points[point] = Point { stress, damage, crack, normal };
            })?;
        }
        Ok(points)
    }

    /// Mean strains of tendons without bond.
    fn mean_strains(&self, history: &History, x: &[f64]) -> Vec<f64> {
        // A folded brick is refused where it is assembled.
        let moved = |host: usize| {
            let local = self.displacements(host, x);
            self.turned(host, history, local).unwrap_or(Moved { local, turn: None })
        };
        let mean = |(bar, steel): (usize, &super::Steel)| {
            steel.mean_strain(|host| moved(host).local) + self.seated_mean(bar, moved, x)
        };
        self.model.steel.iter().enumerate().map(mean).collect()
    }

    /// A joint at displacements `x`; `each` hears the slip of its points.
    fn joint(
        &self,
        joint: usize,
        trial: Trial,
        x: &[f64],
        mut each: impl FnMut(usize, [f64; 2]),
    ) -> Result<crate::element::Element<24>, Failure> {
        let cell = &self.model.mesh.interfaces[joint];
        let body = &self.model.bodies[cell.region as usize];
        let Matter::Joint(friction) = &body.matter else {
            return Ok(crate::element::Element::zero());
        };
        if !self.joint_is_alive(joint, trial.time) {
            return Ok(crate::element::Element::zero());
        }
        let u = since_birth(
            trial.history,
            self.number_of_joint(joint),
            self.displacements_of(&cell.nodes, x),
        );
        let nodes = cell.nodes.map(|n| self.model.mesh.nodes[n as usize]);
        let law = |point: usize, jump: &[f64; 3]| {
            let answer = friction.respond(jump, &trial.history.slips[joint][point]);
            each(point, answer.slipped);
            // Symmetric: while it slides, what pressure does to friction is left to the iteration.
            let mut tangent = answer.tangent;
            (tangent[1][0], tangent[2][0]) = (0.0, 0.0);
            for (axis, stiffness) in
                [friction.normal, friction.shear, friction.shear].into_iter().enumerate()
            {
                tangent[axis][axis] = tangent[axis][axis].max(trial.hold * stiffness);
            }
            (answer.traction, tangent)
        };
        interface::interface(&nodes, &u, &Quadrature::nodal(), law).map_err(|source| {
            Failure::Element {
                element: self.model.mesh.name(ElementId::Interface(joint as u32)),
                source,
            }
        })
    }

    /// A brick at displacements `u` of its nodes ([`Moved::local`]); `each` hears what its points
    /// answer.
    pub(super) fn brick(
        &self,
        hex: usize,
        trial: Trial,
        u: &[f64; 24],
        modes: &mut Modes,
        mut each: impl FnMut(usize, &Answer),
    ) -> Result<hex8::Solid, Failure> {
        let cell = &self.model.mesh.hexes[hex];
        let neutral = self.model.temperature;
        let warm = trial
            .warmth
            .each_ref()
            .map(|field| (!field.is_empty()).then(|| cell.nodes.map(|n| field[n as usize])));
        let nonlocal =
            (!trial.nonlocal.is_empty()).then(|| cell.nodes.map(|n| trial.nonlocal[n as usize]));
        let law_of = self.law(hex);
        let edges = self.model.mesh.edges(hex as u32).map(|e| e.to_array());
        let left = self.model.softening.get(hex).map_or(1.0, |d| 1.0 - d);
        let initial = self.model.initial.get(&ElementId::Hex(hex as u32));
        let law = |point: usize, strain: &Voigt| {
            let here = |field: [f64; 8]| {
                hex8::shape(hex8::GAUSS[point]).iter().zip(field).map(|(n, t)| n * t).sum::<f64>()
            };
            let moment = Moment {
                span: [trial.history.time, trial.time],
                temperature: warm.map(|warm| neutral + warm.map_or(0.0, here)),
                neutral,
                edges,
                ties: self.ties[hex],
                together: trial.history.crushing.get(&(hex as u32)).copied().unwrap_or(1.0),
                growth: trial.growth,
                nonlocal: nonlocal.map(here),
            };
            let mut answer = law_of.answer(point, strain, &trial.history.points[hex], &moment);
            if let Some(initial) = initial {
                answer.stress = tensor::add(&answer.stress, initial);
            }
            if left < 1.0 {
                answer
                    .stress
                    .iter_mut()
                    .chain(answer.tangent.as_flattened_mut())
                    .for_each(|s| *s *= left);
            }
            each(point, &answer);
            let share = self.concrete[hex];
            (tensor::scale(&answer.stress, share), tensor::scale_tangent(answer.tangent, share))
        };
        let corners = self.model.mesh.corners(hex as u32);
        let solid =
            if self.model.kind == Kind::Incompatible && trial.history.points[hex].is_damaged() {
                stiffened(&corners, u, trial.history.softened.get(&(hex as u32)), law)
            } else {
                hex8::integrate(self.model.kind, &corners, u, modes, law)
            };
        solid.map_err(|e| self.of_hex(hex, e))
    }

    /// Displacements of a brick's nodes.
    pub(super) fn displacements(&self, hex: usize, x: &[f64]) -> [f64; 24] {
        self.displacements_of(&self.model.mesh.hexes[hex].nodes, x)
    }

    fn displacements_of(&self, nodes: &[u32; 8], x: &[f64]) -> [f64; 24] {
        std::array::from_fn(|i| x[3 * nodes[i / 3] as usize + i % 3])
    }

    /// The same as its strain counts them.
    ///
    /// # Errors
    /// If it is folded where it turns.
    pub(super) fn moved(&self, hex: usize, history: &History, x: &[f64]) -> Result<Moved, Failure> {
        self.turned(hex, history, since_birth(history, hex as u32, self.displacements(hex, x)))
    }

    /// The same from displacements of its nodes.
    fn turned(&self, hex: usize, history: &History, u: [f64; 24]) -> Result<Moved, Failure> {
        if !history.turned {
            return Ok(Moved { local: u, turn: None });
        }
        let corners = self.model.mesh.corners(hex as u32);
        let turn = Turn::of(&corners, &u).ok_or(self.of_hex(hex, ElementError::NotFinite))?;
        Ok(Moved { local: turn.locals(&corners, &u), turn: Some(turn) })
    }

    /// Brings stiffness and force on a brick, and on more nodes after its own, back into the world.
    fn bring_back(
        &self,
        hex: usize,
        moved: &Moved,
        more: impl Iterator<Item = u32>,
        x: &[f64],
        k: &mut [f64],
        f: &mut [f64],
    ) {
        let Some(turn) = &moved.turn else { return };
        let mesh = &self.model.mesh;
        let own = moved.local.as_chunks::<3>().0.iter().map(|&u| DVec3::from_array(u));
        let own = mesh.corners(hex as u32).into_iter().zip(own);
        let more = more.map(|n| (mesh.nodes[n as usize], moved.node(mesh.nodes[n as usize], n, x)));
        turn.bring_back(&own.chain(more).collect::<Vec<_>>(), k, f);
    }

    /// What the strain at a brick's points is beyond that of [`Kind::Assumed`], by its modes and by
    /// the shear of bending: what it goes on with when it is damaged.
    fn held(
        &self,
        hex: usize,
        history: &History,
        x: &[f64],
        modes: &Modes,
    ) -> Result<[Voigt; 8], Failure> {
        let corners = self.model.mesh.corners(hex as u32);
        let u = self.moved(hex, history, x)?.local;
        let strain = |kind: Kind, natural: DVec3| {
            hex8::rows(kind, &corners, natural).map(|rows| rows.strain(&u, modes))
        };
        let mut held = [[0.0; 6]; 8];
        for (held, natural) in held.iter_mut().zip(hex8::GAUSS) {
            let both = [Kind::Incompatible, Kind::Assumed].map(|kind| strain(kind, natural));
            let [before, after] = both.map(|s| s.map_err(|why| self.of_hex(hex, why)));
            *held = tensor::sub(&before?, &after?);
        }
        Ok(held)
    }

    pub(super) fn of_hex(&self, hex: usize, source: ElementError) -> Failure {
        Failure::Element { element: self.model.mesh.name(ElementId::Hex(hex as u32)), source }
    }
}

/// Of each brick the share that no steel displaces; what is more steel than concrete counts as half.
fn undisplaced(model: &Model) -> Vec<f64> {
    let mut steel = vec![0.0; model.mesh.hexes.len()];
    for bar in model.steel.iter().filter(|bar| bar.displaces) {
        bar.pieces.iter().for_each(|piece| steel[piece.host] += bar.area * piece.length());
    }
    let share = |(hex, steel): (usize, f64)| match steel > 0.0 {
        true => 1.0 - (steel / model.mesh.hex_volume(hex as u32)).min(0.5),
        false => 1.0,
    };
    steel.into_iter().enumerate().map(share).collect()
}

/// How a brick has moved.
pub(super) struct Moved {
    /// Displacements of its nodes counted from where it was born, and, where it turns, in axes that
    /// turn with it, m.
    pub(super) local: [f64; 24],
    turn: Option<Turn>,
}

impl Moved {
    /// Displacement of a node at `place` in the brick's axes, m.
    pub(super) fn node(&self, place: DVec3, node: u32, x: &[f64]) -> DVec3 {
        let u = DVec3::from_array(std::array::from_fn(|c| x[3 * node as usize + c]));
        self.turn.as_ref().map_or(u, |turn| turn.local(place, u))
    }
}

/// Displacements of an element, counted from where it was born.
fn since_birth(history: &History, element: u32, mut u: [f64; 24]) -> [f64; 24] {
    if let Some(born) = history.born.get(&element) {
        u.iter_mut().zip(born).for_each(|(u, born)| *u -= born);
    }
    u
}

/// A damaged brick: its modes stay as they were when it was sound. Free, they would let the strain
/// localise between the points of one element, where a crack dissipates half of what the crack band
/// foresees (Winkler's panel with 65 N/m then breaks at 5.3 kN instead of 6.2). Nor may shear that
/// is not there hold it where it bends. What its modes were to its points then it keeps, `held`.
fn stiffened(
    corners: &[DVec3; 8],
    u: &[f64; 24],
    held: Option<&[Voigt; 8]>,
    mut law: impl FnMut(usize, &Voigt) -> (Voigt, Tangent),
) -> Result<hex8::Solid, ElementError> {
    let law = |point: usize, strain: &Voigt| match held {
        Some(held) => law(point, &tensor::add(strain, &held[point])),
        None => law(point, strain),
    };
    hex8::integrate(Kind::Assumed, corners, u, &mut Modes::default(), law)
}
