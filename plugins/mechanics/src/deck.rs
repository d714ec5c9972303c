//! A deck made computable: what it says in its own terms ([`Deck`]) becomes a [`Model`] and the
//! moments at which its steps end.
//!
//! Steps become one time that runs on. Every force, pressure, support and temperature gets its
//! course over all steps: it ramps from what it was to what the step says (from its beginning where
//! the step asks for that), or follows its amplitude; what a step drops goes back to nothing.
//! Targets of one course make one [`Load`]. Elements that are taken out in the first step and put
//! in later are born then, free of stress. What cannot be computed as it is written is refused by
//! name: nothing that changes the answer is skipped.

mod concrete;
mod course;
mod steel;

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;
use intrados_scene::MemberKind;
use intrados_stage::Job;

use crate::{
    element::{ElementError, embed::EmbedError, hex8::Kind, load},
    material::durability::CorrosionError,
    member::{Part, Prepared},
    mesh::{ElementId, HexFace, Locator, Mesh},
    model::{
        Action, Body, Drive, Elastic, Failure, History, Load, March, MarchSettings, Matter, Model,
        Rotations, Step, System,
    },
    read::{Deck, Formulation, Material, SectionKind},
};
use course::{Course, Given, Times};

/// A model, and when its steps end.
#[derive(Debug, Clone)]
pub struct Case {
    /// What is computed.
    pub model: Model,
    /// Name and end of every step, s; the first begins at 0.
    pub steps: Vec<(String, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Ends of all increments, s, those of the steps among them.
    moments: Vec<f64>,
}

/// Why a deck cannot be computed. One line.
#[derive(Debug, thiserror::Error)]
pub enum DeckError {
    /// A part of it is not supported, or says too little.
    #[error("{0}")]
    Unfit(String),
    /// A bar does not lie in its hosts.
    #[error("{rod}: {source}")]
    Embedded {
        /// Name of the rod.
        rod: String,
        /// What the system says.
        source: EmbedError,
    },
    /// A folded element.
    #[error("{element}: {source}")]
    Element {
        /// Name of the element.
        element: String,
        /// What the system says.
        source: ElementError,
    },
}

fn unfit<T>(reason: impl Into<String>) -> Result<T, DeckError> {
    Err(DeckError::Unfit(reason.into()))
}

impl Case {
    /// Makes a deck computable.
    ///
    /// # Errors
    /// [`DeckError`].
    pub fn new(mut deck: Deck) -> Result<Self, DeckError> {
        let times = Times::new(&deck)?;
        let mut model =
            Model { kind: kind(&deck)?, mesh: std::mem::take(&mut deck.mesh), ..Model::default() };
        let mut notes = std::mem::take(&mut deck.notes);
        for (region, section) in deck.sections.iter().enumerate() {
            let Some(material) = deck.materials.get(section.material as usize) else {
                return unfit("a section names no material");
            };
            let size = || mean_edge(&model.mesh, region);
            let matter = matter(material, section.kind, size, &mut notes)?;
            model.bodies.push(Body { matter, birth: f64::NEG_INFINITY });
        }
        let cracks = model.bodies.iter().any(|body| matches!(body.matter, Matter::Concrete(_)));
        let bearing = births(&deck, &mut model, &times)?;
        let (steps, moments) = (times.ends(&deck), times.moments(&deck, cracks));
        let mut case = Self { model, steps, notes, moments };
        case.initial(&deck)?;
        case.loads(&deck, &times)?;
        // Last, because it renumbers the rods that stay.
        case.embed(&deck, &bearing)?;
        Ok(case)
    }

    /// The case as [`crate::analysis`] takes it: every region is a part, and the steps end at its
    /// moments.
    #[must_use]
    pub fn prepared(mut self, id: impl Into<String>) -> Prepared {
        let mesh = &self.model.mesh;
        let of = |region: usize| {
            (0..mesh.hexes.len() as u32)
                .filter(|&h| mesh.hexes[h as usize].region as usize == region)
                .collect()
        };
        let part = |(i, name): (usize, &String)| Part {
            id: name.clone(),
            kind: MemberKind::Other,
            hexes: of(i),
            has_steel: i == 0,
            assumed: false,
            geometry: None,
        };
        let parts = mesh.regions.iter().enumerate().map(part).collect();
        if !mesh.shells.is_empty() {
            self.notes.push("stresses of shells are not reported: their displacements are".into());
        }
        let reach = mesh.bounds().map_or(DVec3::ZERO, |[low, high]| high - low);
        let longest = DVec3::AXES[reach.max_position()];
        let corrosion = Err(CorrosionError::Deck);
        Prepared {
            id: id.into(),
            model: self.model,
            begin: 0.0,
            times: self.moments,
            parts,
            axis: None,
            direction: longest,
            mirrored: Vec::new(),
            raised: None,
            gauges: Vec::new(),
            warnings: Vec::new(),
            corrosion,
            attacked: 0.0,
            notes: self.notes,
        }
    }

    /// Goes through all steps; `each` hears every equilibrium.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn run(
        &self,
        settings: MarchSettings,
        job: &Job,
        mut each: impl FnMut(&System, &History, &Step) -> Result<(), Failure>,
    ) -> Result<History, Failure> {
        let structure = System::new(&self.model)?;
        let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
        for (i, end) in self.moments.iter().enumerate() {
            job.step(i, self.moments.len())?;
            tracing::debug!("to {end:.4e} s");
            march.advance(*end, 0.0, job, |history, step| each(&structure, history, step))?;
        }
        Ok(march.history)
    }

    /// Stress before the first step.
    fn initial(&mut self, deck: &Deck) -> Result<(), DeckError> {
        for initial in &deck.initial_stress {
            if let ElementId::Shell(_) = initial.element {
                return unfit(format!(
                    "{}: an initial stress of shells is not supported",
                    self.model.mesh.name(initial.element)
                ));
            }
            self.model.initial.insert(initial.element, initial.stress);
        }
        Ok(())
    }

    fn loads(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        self.supports(deck, times)?;
        self.forces(deck, times)?;
        self.pressures(deck, times)?;
        self.weights(deck, times)?;
        self.temperatures(deck, times)
    }

    /// What is held at nothing all the time is a hold, what moves is a load.
    fn supports(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        let rotations = Rotations::new(&self.model.mesh);
        let mut all: BTreeMap<(u32, u8), Vec<Option<Given>>> = BTreeMap::new();
        for (k, step) in deck.steps.iter().enumerate() {
            for fixed in &step.boundary {
                // Rotations of nodes that do not turn are held anyway.
                if let Some(target) = unknown(&rotations, fixed.node, fixed.component) {
                    let course = all.entry(target).or_insert_with(|| vec![None; deck.steps.len()]);
                    course[k] = Some(Given { value: fixed.value, amplitude: fixed.amplitude });
                }
            }
        }
        if deck.steps.is_empty() {
            return unfit("the deck has no *STEP: there is nothing to compute");
        }
        let mut moved = Vec::new();
        for ((node, component), given) in all {
            if let Some(step) = given.iter().position(Option::is_none) {
                let name = self.model.mesh.node_name(rotations.owner(node).unwrap_or(node));
                return unfit(format!(
                    "{}: component {} of {name} is free in this step and held in another; supports must stay the same",
                    deck.steps[step].name,
                    component + 1
                ));
            }
            if given.iter().flatten().all(|g| g.value == 0.0) {
                self.model.holds.push((node, component));
            } else {
                moved.push(((node, component), times.course(deck, &given, 0.0)?));
            }
        }
        for (history, targets) in grouped(moved) {
            let action = Action::Displacement(
                targets
                    .into_iter()
                    .map(|((node, component), value)| (node, component, value))
                    .collect(),
            );
            self.model.loads.push(Load { name: "moved supports".into(), action, history });
        }
        Ok(())
    }

    fn forces(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        let rotations = Rotations::new(&self.model.mesh);
        let mut all: BTreeMap<(u32, u8), Vec<Option<Given>>> = BTreeMap::new();
        for (k, step) in deck.steps.iter().enumerate() {
            for load in &step.loads {
                let Some(target) = unknown(&rotations, load.node, load.component) else {
                    let name = self.model.mesh.node_name(load.node);
                    return unfit(format!(
                        "{}: a moment at {name}, which belongs to no shell",
                        step.name
                    ));
                };
                all.entry(target).or_insert_with(|| vec![None; deck.steps.len()])[k] =
                    Some(Given { value: load.value, amplitude: load.amplitude });
            }
        }
        let mut courses = Vec::new();
        for (target, given) in all {
            courses.push((target, times.course(deck, &given, 0.0)?));
        }
        for (history, targets) in grouped(courses) {
            let forces = targets
                .into_iter()
                .map(|((node, axis), value)| (node, value * DVec3::AXES[usize::from(axis)]))
                .collect();
            self.model.loads.push(Load {
                name: "forces".into(),
                action: Action::Nodes(forces),
                history,
            });
        }
        Ok(())
    }

    fn pressures(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        let mut all: BTreeMap<(ElementId, u8), Vec<Option<Given>>> = BTreeMap::new();
        for (k, step) in deck.steps.iter().enumerate() {
            for p in &step.pressures {
                all.entry((p.element, p.face)).or_insert_with(|| vec![None; deck.steps.len()])[k] =
                    Some(Given { value: p.value, amplitude: p.amplitude });
            }
        }
        let mut courses = Vec::new();
        for (target, given) in all {
            courses.push((target, times.course(deck, &given, 0.0)?));
        }
        for (history, targets) in grouped(courses) {
            let (mut faces, mut shells) = (Vec::new(), Vec::new());
            for ((element, face), value) in targets {
                match element {
                    ElementId::Hex(hex) => faces.push((HexFace { hex, face }, value)),
                    ElementId::Shell(shell) => shells.push((shell, value)),
                    _ => {
                        return unfit(format!(
                            "{}: pressure acts on bricks and shells",
                            self.model.mesh.name(element)
                        ));
                    }
                }
            }
            for action in [
                (!faces.is_empty()).then_some(Action::Faces(faces)),
                (!shells.is_empty()).then_some(Action::Shells(shells)),
            ] {
                self.model.loads.extend(action.map(|action| Load {
                    name: "pressure".into(),
                    action,
                    history: history.clone(),
                }));
            }
        }
        Ok(())
    }

    fn weights(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        let mut all: BTreeMap<(Vec<ElementId>, usize), Vec<Option<Given>>> = BTreeMap::new();
        for (k, step) in deck.steps.iter().enumerate() {
            for body in &step.bodies {
                let mut elements = body.elements.clone();
                elements.sort_unstable();
                for axis in 0..3 {
                    all.entry((elements.clone(), axis))
                        .or_insert_with(|| vec![None; deck.steps.len()])[k] =
                        Some(Given { value: body.acceleration[axis], amplitude: body.amplitude });
                }
            }
        }
        for ((elements, axis), given) in all {
            let course = times.course(deck, &given, 0.0)?;
            for (history, targets) in grouped(vec![((), course)]) {
                for (_, value) in targets {
                    let action = self.weight(&elements, value * DVec3::AXES[axis])?;
                    self.model.loads.push(Load {
                        name: "weight".into(),
                        action,
                        history: history.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    /// Weight of some elements, or of all.
    fn weight(&mut self, elements: &[ElementId], acceleration: DVec3) -> Result<Action, DeckError> {
        let mesh = &self.model.mesh;
        let mut forces: HashMap<u32, DVec3> = HashMap::new();
        for &element in elements {
            let region = match element {
                ElementId::Hex(i) => mesh.hexes[i as usize].region,
                ElementId::Shell(i) => mesh.shells[i as usize].region,
                ElementId::Rod(i) => mesh.rods[i as usize].region,
                ElementId::Interface(_) => continue,
            };
            let matter = &self.model.bodies[region as usize].matter;
            if matter.density() <= 0.0 {
                return unfit(format!(
                    "{}: GRAV acts on it, but its material has no *DENSITY",
                    mesh.name(element)
                ));
            }
            let mut add = |nodes: &[u32], force: DVec3| {
                nodes
                    .iter()
                    .for_each(|n| *forces.entry(*n).or_default() += force / nodes.len() as f64);
            };
            match (element, matter) {
                (ElementId::Hex(hex), _) => {
                    let loads = load::body(&mesh.corners(hex), |_| matter.density() * acceleration)
                        .map_err(|source| DeckError::Element {
                            element: mesh.name(element),
                            source,
                        })?;
                    for (n, f) in
                        mesh.hexes[hex as usize].nodes.iter().zip(loads.as_chunks::<3>().0)
                    {
                        *forces.entry(*n).or_default() += DVec3::from_array(*f);
                    }
                }
                (ElementId::Shell(shell), Matter::Shell { elastic, thickness }) => {
                    let nodes = mesh.shells[shell as usize].nodes;
                    let [a, b, c, d] = nodes.map(|n| mesh.nodes[n as usize]);
                    let area = 0.5 * (c - a).cross(d - b).length();
                    add(&nodes, elastic.density * thickness * area * acceleration);
                }
                (ElementId::Rod(rod), Matter::Bar { area, density, .. }) => {
                    let nodes = mesh.rods[rod as usize].nodes;
                    let [a, b] = nodes.map(|n| mesh.nodes[n as usize]);
                    add(&nodes, density * area * a.distance(b) * acceleration);
                }
                _ => {}
            }
        }
        let mut forces: Vec<_> = forces.into_iter().collect();
        forces.sort_unstable_by_key(|f| f.0);
        Ok(Action::Nodes(forces))
    }

    /// Temperatures count from those before the first step.
    fn temperatures(&mut self, deck: &Deck, times: &Times) -> Result<(), DeckError> {
        let initial: HashMap<u32, f64> = deck.initial_temperature.iter().copied().collect();
        let mut all: BTreeMap<u32, Vec<Option<Given>>> = BTreeMap::new();
        for (k, step) in deck.steps.iter().enumerate() {
            for t in &step.temperatures {
                all.entry(t.node).or_insert_with(|| vec![None; deck.steps.len()])[k] =
                    Some(Given { value: t.value, amplitude: t.amplitude });
            }
        }
        let mut courses = Vec::new();
        for (node, given) in all {
            let start = initial.get(&node).copied().unwrap_or(0.0);
            courses.push((node, times.course(deck, &given, start)?));
        }
        let groups = grouped(courses);
        if groups.len() > MAX_FIELDS {
            return unfit(format!(
                "temperatures of {} different courses; at most {MAX_FIELDS} are supported",
                groups.len()
            ));
        }
        for (history, targets) in groups {
            let mut field = vec![0.0; self.model.mesh.nodes.len()];
            targets.into_iter().for_each(|(node, value)| field[node as usize] = value);
            self.model.loads.push(Load {
                name: "temperature".into(),
                action: Action::Temperature(field),
                history,
            });
        }
        Ok(())
    }
}

/// Temperature fields that may follow courses of their own.
const MAX_FIELDS: usize = 64;

/// The formulation of all bricks.
fn kind(deck: &Deck) -> Result<Kind, DeckError> {
    let Some(first) = deck.formulations.first() else { return Ok(Kind::default()) };
    if let Some(other) = deck.formulations.iter().position(|f| f != first) {
        let [a, b] = [0, other].map(|h| deck.mesh.name(ElementId::Hex(h as u32)));
        return unfit(format!(
            "{a} and {b} are of different types: give all bricks one, C3D8 or C3D8I (C3D8R counts as C3D8I)"
        ));
    }
    Ok(match first {
        Formulation::Full => Kind::Plain,
        Formulation::Incompatible => Kind::Incompatible,
    })
}

/// Edge of a cube as large as the bricks of a region in the mean, m.
fn mean_edge(mesh: &Mesh, region: usize) -> f64 {
    let volumes = || {
        let cells = (0..).zip(&mesh.hexes).filter(|(_, cell)| cell.region as usize == region);
        cells.map(|(hex, _)| mesh.hex_volume(hex))
    };
    (volumes().sum::<f64>() / volumes().count().max(1) as f64).cbrt()
}

/// The law of a region of bricks of such a size.
fn matter(
    material: &Material,
    kind: SectionKind,
    size: impl Fn() -> f64,
    notes: &mut Vec<String>,
) -> Result<Matter, DeckError> {
    let Some((modulus, poisson)) = material.elastic else {
        return unfit(format!("material {}: no *ELASTIC", material.name));
    };
    if let Some(said) = &material.concrete {
        return match kind {
            SectionKind::Solid => {
                concrete::concrete(material, said, (modulus, poisson), size(), notes)
            }
            SectionKind::Shell { .. } | SectionKind::Rod { .. } => unfit(format!(
                "line {}: material {}: only bricks crack; give shells and rods a material without *CONCRETE DAMAGED PLASTICITY",
                said.line, material.name
            )),
        };
    }
    if !material.yielding.is_empty() && !matches!(kind, SectionKind::Rod { .. }) {
        return unfit(format!(
            "material {}: *PLASTIC beside concrete that cracks is of bars (T3D2) alone; give bricks and shells an elastic material",
            material.name
        ));
    }
    if material.yielding.len() > 2 {
        notes.push(format!(
            "material {}: bars harden along the line from the first to the last point of *PLASTIC",
            material.name
        ));
    }
    let (expansion, density) = (material.expansion.unwrap_or(0.0), material.density.unwrap_or(0.0));
    let elastic = Elastic { modulus, poisson, expansion, density };
    Ok(match kind {
        SectionKind::Solid => Matter::Elastic(elastic),
        SectionKind::Shell { thickness } => Matter::Shell { elastic, thickness },
        SectionKind::Rod { area } => {
            Matter::Bar { steel: steel::bar(modulus, &material.yielding), area, expansion, density }
        }
    })
}

/// The unknown that a component of a node is; `None` for rotations of nodes that do not turn.
fn unknown(rotations: &Rotations, node: u32, component: u8) -> Option<(u32, u8)> {
    if component < 3 {
        Some((node, component))
    } else {
        rotations.of(node).map(|n| (n, component - 3))
    }
}

/// Targets by courses that differ by a factor only: the history of the factor, and each target's
/// value at factor 1. What is nothing all the time is left out.
fn grouped<T>(courses: Vec<(T, Course)>) -> Vec<(Course, Vec<(T, f64)>)> {
    let (mut groups, mut known) = (Vec::<(Course, Vec<(T, f64)>)>::new(), HashMap::new());
    for (target, course) in courses {
        let largest =
            course.iter().map(|p| p.1).fold(0.0, |m: f64, v| if v.abs() > m.abs() { v } else { m });
        if largest == 0.0 {
            continue;
        }
        let factors: Course = course.into_iter().map(|(t, v)| (t, v / largest)).collect();
        let key: Vec<(u64, u64)> =
            factors.iter().map(|(t, v)| (t.to_bits(), v.to_bits())).collect();
        let at = *known.entry(key).or_insert_with(|| {
            groups.push((factors, Vec::new()));
            groups.len() - 1
        });
        groups[at].1.push((target, largest));
    }
    groups
}

/// Regions of elements that come later, and the elements that do.
fn births(deck: &Deck, model: &mut Model, times: &Times) -> Result<HashSet<ElementId>, DeckError> {
    let mut birth: BTreeMap<ElementId, (f64, String)> = BTreeMap::new();
    for (k, step) in deck.steps.iter().enumerate() {
        for change in &step.changes {
            for &element in &change.elements {
                match (change.add, birth.get(&element)) {
                    (false, None) if k == 0 => {
                        drop(birth.insert(element, (f64::INFINITY, "never".into())))
                    }
                    (true, Some((never, _))) if never.is_infinite() => {
                        // Right after the step before has ended.
                        drop(birth.insert(element, (times.start(k).next_up(), step.name.clone())));
                    }
                    (true, _) => {}
                    (false, _) => {
                        return unfit(format!(
                            "{}: {} is taken out; elements can only be taken out in the first step, to be put in later",
                            step.name,
                            model.mesh.name(element)
                        ));
                    }
                }
            }
        }
    }
    let mut regions: HashMap<(u32, u64), u32> = HashMap::new();
    for (&element, (time, step)) in &birth {
        let Some(slot) = region(&mut model.mesh, element) else { continue };
        let old = *slot;
        let new = *regions.entry((old, time.to_bits())).or_insert_with(|| {
            let name = format!("{} ({step})", model.mesh.regions[old as usize]);
            model.mesh.regions.push(name);
            model.bodies.push(Body { birth: *time, ..model.bodies[old as usize].clone() });
            model.mesh.regions.len() as u32 - 1
        });
        if let Some(slot) = region(&mut model.mesh, element) {
            *slot = new;
        }
    }
    Ok(birth.into_keys().collect())
}

fn region(mesh: &mut Mesh, element: ElementId) -> Option<&mut u32> {
    match element {
        ElementId::Hex(i) => mesh.hexes.get_mut(i as usize).map(|c| &mut c.region),
        ElementId::Shell(i) => mesh.shells.get_mut(i as usize).map(|c| &mut c.region),
        ElementId::Rod(i) => mesh.rods.get_mut(i as usize).map(|c| &mut c.region),
        ElementId::Interface(i) => mesh.interfaces.get_mut(i as usize).map(|c| &mut c.region),
    }
}

/// Where points are, among some bricks or all.
fn locate(locator: &Locator<'_>, hosts: &HashSet<u32>, point: DVec3) -> Option<(usize, DVec3)> {
    locator
        .locate_where(point, |hex| hosts.is_empty() || hosts.contains(&hex))
        .map(|h| (h.hex as usize, h.natural))
}

#[cfg(test)]
mod tests;
