//! Supports, loads and steps; equations and ties.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::{
    constraint::Equation,
    flat::{Plane, SLICE},
    law::{Elastic, ORDER},
    link::Link,
    matter::all_numbers,
    model::{Course, Damping, Heated, Material, Procedure, Pull, Spring, Step},
    read::{Kind, Raw, Reader, Surface, plain},
    shape::Shape,
    thin::Thin,
    tie::{self, Face},
    warm::is_temperature,
};
use crate::{
    model::interpolate,
    read::{
        Amplitude, Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor::{self, Voigt},
};

/// A value, the amplitude that it follows, and the step that set it (0: before the first).
#[derive(Debug, Clone)]
pub(super) struct Given<T> {
    pub(super) value: T,
    pub(super) amplitude: Option<String>,
    pub(super) step: u32,
}

/// What is in force.
#[derive(Default)]
pub(super) struct State {
    held: BTreeMap<(u32, u8), Given<f64>>,
    kept: BTreeMap<(u32, u8), Given<f64>>,
    forces: BTreeMap<(u32, u8), Given<f64>>,
    early: BTreeMap<(u32, u8), Given<f64>>,
    pressures: BTreeMap<(u32, u8), Given<f64>>,
    pulls: BTreeMap<(String, String), Given<(Vec<u32>, Pull)>>,
    warm: BTreeMap<u32, Given<f64>>,
    temperatures: BTreeMap<u32, Given<f64>>,
    pub(super) heating: BTreeMap<Heated, Given<[f64; 2]>>,
    materials: BTreeMap<u32, u32>,
    pub(super) step: u32,
    /// Whether displacements are large: from a step on until one says otherwise.
    large: bool,
    open: Option<Open>,
    /// When the steps before it ended.
    time: f64,
}

/// The step that is open.
struct Open {
    line: u32,
    duration: f64,
    perturbs: bool,
    procedure: Option<Procedure>,
    damping: Damping,
    diameters: Option<[u32; 2]>,
    /// Whether displacements follow the temperatures.
    coupled: bool,
}

impl State {
    /// Supports, forces and weights, each times what its amplitude says.
    fn loads(&self, factor: impl Fn(&Option<String>) -> Result<f64, Fault>) -> Result<Step, Fault> {
        let times = |all: &BTreeMap<(u32, u8), Given<f64>>| {
            let value = |(&key, g): (&(u32, u8), &Given<f64>)| {
                Ok::<_, Fault>((key, g.value * factor(&g.amplitude)?))
            };
            all.iter().map(value).collect::<Result<BTreeMap<_, _>, _>>()
        };
        let mut step = Step {
            name: format!("step {}", self.step),
            number: self.step,
            held: times(&self.held)?,
            kept: self.kept.keys().copied().collect(),
            forces: times(&self.forces)?,
            early: times(&self.early)?,
            pressures: times(&self.pressures)?,
            materials: self.materials.clone(),
            ..Step::default()
        };
        for pull in self.pulls.values() {
            let factor = factor(&pull.amplitude)?;
            let (elements, pull) = &pull.value;
            step.pulls.extend(elements.iter().map(|&e| (e, pull.times(factor))));
        }
        Ok(step)
    }

    /// Every amplitude that supports and forces follow.
    fn amplitudes(&self) -> BTreeSet<Option<String>> {
        let nodal = [&self.held, &self.forces, &self.early, &self.pressures];
        let nodal = nodal.into_iter().flat_map(|all| all.values().map(|g| &g.amplitude));
        nodal.chain(self.pulls.values().map(|g| &g.amplitude)).cloned().collect()
    }

    /// Every step that began has ended, and there was one.
    pub(super) fn ended(&self) -> Result<(), Fault> {
        match &self.open {
            // CalculiX passes over a last step of which nothing stands there but its beginning.
            Some(open) if self.step <= 1 || open.procedure.is_some() => {
                Err(Fault::at(open.line, "*STEP without *END STEP: is the deck cut off?"))
            }
            Some(_) => Ok(()),
            None if self.step == 0 => Err(Fault::whole("no *STEP: there is nothing to compute")),
            None => Ok(()),
        }
    }
}

impl Reader {
    /// Everything that has an order.
    pub(super) fn history(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        let name = plain(card);
        const WITHIN: &str = "STATIC DYNAMIC FREQUENCY BUCKLE HEATTRANSFER MODALDYNAMIC \
            COUPLEDTEMPERATURE-DISPLACEMENT UNCOUPLEDTEMPERATURE-DISPLACEMENT STEADYSTATEDYNAMICS \
            MODALDAMPING SELECTCYCLICSYMMETRYMODES ENDSTEP CLOAD DLOAD DSLOAD TEMPERATURE CFLUX \
            DFLUX FILM RADIATE CHANGESOLIDSECTION";
        if WITHIN.split_ascii_whitespace().any(|w| w == name) && state.open.is_none() {
            return Err(card.fault(format!("*{} must stand in a *STEP", card.name)));
        }
        match name.as_str() {
            "STEP" => begin(card, state),
            "STATIC"
            | "DYNAMIC"
            | "FREQUENCY"
            | "BUCKLE"
            | "HEATTRANSFER"
            | "COUPLEDTEMPERATURE-DISPLACEMENT"
            | "UNCOUPLEDTEMPERATURE-DISPLACEMENT"
            | "MODALDYNAMIC"
            | "STEADYSTATEDYNAMICS" => procedure(card, &name, state),
            "MODALDAMPING" => damping(card, state),
            "SELECTCYCLICSYMMETRYMODES" => diameters(card, state),
            "ENDSTEP" => self.close(state),
            "EQUATION" => self.end_equations(card, state),
            "BOUNDARY" => self.boundary(card, state),
            "CLOAD" => self.cload(card, state),
            "DLOAD" | "DSLOAD" => self.dload(card, state, name == "DSLOAD"),
            "TEMPERATURE" => self.temperature(card, state),
            "CFLUX" | "DFLUX" | "FILM" | "RADIATE" => self.heating(card, state),
            "CHANGESOLIDSECTION" => self.change(card, state),
            "INITIALCONDITIONS" => self.initial(card),
            "PHYSICALCONSTANTS" => self.constants(card),
            _ => Ok(()),
        }
    }

    fn close(&mut self, state: &mut State) -> Result<(), Fault> {
        let Some(open) = state.open.take() else { return Ok(()) };
        self.end(open.procedure.unwrap_or_default(), &open, state)?;
        if open.coupled {
            // What the temperatures of the step that has just been added do.
            self.end(Procedure::Static, &open, state)?;
        }
        state.time += open.duration;
        Ok(())
    }

    /// What is in force at the end of the step.
    fn end(&mut self, procedure: Procedure, open: &Open, state: &State) -> Result<(), Fault> {
        let &Open { line, duration, diameters, .. } = open;
        self.suits(procedure, state, line)?;
        let in_time = matches!(procedure, Procedure::Heat { steady: false, .. });
        let factor = |amplitude: &Option<String>| -> Result<f64, Fault> {
            let Some(name) = amplitude else { return Ok(1.0) };
            if in_time {
                let why =
                    "what heats over time is computed where it stays the same, without AMPLITUDE";
                return Err(Fault::at(line, why));
            }
            let amplitude = self.amplitude_of(name, line)?;
            let time = if amplitude.total_time { state.time + duration } else { duration };
            Ok(interpolate(&amplitude.points, time).unwrap_or(1.0))
        };
        let mut step = if let Procedure::Motion { .. }
        | Procedure::Dynamic { .. }
        | Procedure::Harmonic { .. } = procedure
        {
            Step { courses: self.courses(procedure, state, line)?, ..state.loads(|_| Ok(0.0))? }
        } else {
            state.loads(factor)?
        };
        (step.procedure, step.damping) = (procedure, open.damping.clone());
        step.diameters = diameters;
        if diameters.is_some() && !matches!(procedure, Procedure::Modes { heat: false, .. }) {
            let why = "*SELECT CYCLIC SYMMETRY MODES stands in a step of *FREQUENCY";
            return Err(Fault::at(line, why));
        }
        let may_be_large = matches!(procedure, Procedure::Static | Procedure::Dynamic { .. });
        step.large = state.large && may_be_large;
        if let Procedure::Heat { .. } | Procedure::Modes { heat: true, .. } = procedure {
            for (&node, given) in &state.temperatures {
                step.temperatures.insert(node, given.value * factor(&given.amplitude)?);
            }
            for (&heated, given) in &state.heating {
                let factor = factor(&given.amplitude)?;
                // The temperature beyond a face stays.
                step.heating.insert(heated, [given.value[0] * factor, given.value[1]]);
            }
        }
        if !state.warm.is_empty() {
            step.warm.clone_from(&self.deck.cold);
            for (&node, warm) in &state.warm {
                step.warm[node as usize] = warm.value * factor(&warm.amplitude)?;
            }
        }
        self.deck.steps.push(step);
        Ok(())
    }

    fn amplitude_of(&self, name: &str, line: u32) -> Result<&Amplitude, Fault> {
        let missing = || Fault::at(line, format!("amplitude {} is not defined", quote(name)));
        self.amplitudes.get(name).ok_or_else(missing)
    }

    /// What acts in a step of motion or vibration, by the amplitudes that it follows.
    fn courses(
        &self,
        procedure: Procedure,
        state: &State,
        line: u32,
    ) -> Result<Vec<Course>, Fault> {
        let mut courses = Vec::new();
        for amplitude in state.amplitudes() {
            let mut points = Vec::new();
            if let Some(name) = &amplitude {
                let found = self.amplitude_of(name, line)?;
                let in_total = found.total_time && !matches!(procedure, Procedure::Harmonic { .. });
                let begin = if in_total { state.time } else { 0.0 };
                points.extend(found.points.iter().map(|&(at, factor)| (at - begin, factor)));
            }
            let own = |other: &Option<String>| Ok(if *other == amplitude { 1.0 } else { 0.0 });
            let mut loads = state.loads(own)?;
            let base = Step {
                name: loads.name.clone(),
                number: state.step,
                held: loads.held.clone(),
                materials: loads.materials.clone(),
                ..Step::default()
            };
            loads.held.values_mut().for_each(|value| *value = 0.0);
            self.moves(&base, &points, procedure, line)?;
            courses.push(Course { points, loads, base });
        }
        Ok(courses)
    }

    /// Supports that move begin where they are, in fixed increments, and carry what has no stress.
    fn moves(
        &self,
        base: &Step,
        points: &[(f64, f64)],
        procedure: Procedure,
        line: u32,
    ) -> Result<(), Fault> {
        let in_modes = !matches!(procedure, Procedure::Dynamic { .. });
        if !in_modes || base.held.values().all(|value| *value == 0.0) {
            return Ok(());
        }
        let is_stressed = |s: &Step| matches!(s.procedure, Procedure::Modes { stressed: true, .. });
        if self.deck.steps.iter().any(is_stressed) {
            return Err(Fault::at(
                line,
                "supports that move what is under stress are not computed",
            ));
        }
        if self.deck.springs.iter().any(|s| !s.drag.is_empty()) {
            return Err(Fault::at(line, "supports that move beside dashpots are not computed"));
        }
        let Procedure::Motion { increment, .. } = procedure else { return Ok(()) };
        let follows =
            self.deck.steps.last().is_some_and(|s| matches!(s.procedure, Procedure::Motion { .. }));
        if follows || interpolate(points, 0.0).unwrap_or(1.0) != 0.0 {
            let why = "supports that move need an AMPLITUDE that begins at 0, in the first step of motion";
            return Err(Fault::at(line, why));
        }
        if increment.is_none() {
            return Err(Fault::at(line, "supports that move need fixed increments, not DIRECT=NO"));
        }
        Ok(())
    }

    /// Materials have what the step needs, and the step follows one that it rests on.
    fn suits(&self, procedure: Procedure, state: &State, line: u32) -> Result<(), Fault> {
        let used =
            self.deck.cells.iter().map(|c| c.material).chain(state.materials.values().copied());
        let lacks = |has: fn(&Material) -> bool, what: &str| {
            let mut used = used.clone().map(|m| &self.deck.materials[m as usize]);
            match used.find(|m| !has(m)) {
                Some(m) => Err(Fault::at(line, format!("material {} has no {what}", m.name))),
                None => Ok(()),
            }
        };
        let heats =
            matches!(procedure, Procedure::Heat { .. } | Procedure::Modes { heat: true, .. });
        let may_be_large = matches!(procedure, Procedure::Static | Procedure::Dynamic { .. });
        if !heats {
            let has: fn(&Material) -> bool = if state.large && may_be_large {
                |m| m.elastic.is_some() || m.finite.is_some()
            } else {
                |m| m.elastic.is_some()
            };
            lacks(
                has,
                "*ELASTIC, nor with NLGEOM *HYPERELASTIC, *HYPERFOAM or *DEFORMATION PLASTICITY",
            )?;
            let flows = match procedure {
                Procedure::Static | Procedure::Dynamic { .. } => state.large,
                other => matches!(other, Procedure::Modes { .. }),
            };
            let is_known = |m: &Material| {
                (flows && matches!(m.elastic, Some(Elastic::Isotropic(_)))) || m.plastic.is_none()
            };
            let mut used = used.clone().map(|m| &self.deck.materials[m as usize]);
            if let Some(material) = used.find(|m| !is_known(m)) {
                let why = "*PLASTIC is computed of what is isotropic, with NLGEOM";
                return Err(Fault::at(line, format!("material {}: {why}", material.name)));
            }
        }
        if let Procedure::Motion { .. } | Procedure::Harmonic { .. } = procedure {
            return self.vibrates(state, line);
        }
        if let Procedure::Dynamic { .. } = procedure {
            lacks(|m| m.density.is_some(), "*DENSITY")?;
            if !state.warm.is_empty() {
                return Err(Fault::at(line, "a *TEMPERATURE in a *DYNAMIC step is not computed"));
            }
        }
        if state.large && may_be_large {
            return self.turns();
        }
        let bends = |s: &Spring| !s.law.is_empty() || s.gap.is_some();
        if !heats && self.deck.springs.iter().any(bends) {
            let why = "*SPRING, NONLINEAR and *GAP are computed with NLGEOM alone";
            return Err(Fault::at(line, why));
        }
        let was_large = self.deck.steps.last().is_some_and(|s| s.large);
        if was_large && matches!(procedure, Procedure::Buckling { .. }) {
            return Err(Fault::at(line, "*BUCKLE after large displacements is not computed"));
        }
        if let Procedure::Modes { heat: false, .. } = procedure {
            lacks(|m| m.density.is_some(), "*DENSITY")?;
        }
        if let Procedure::Modes { stressed: true, .. } = procedure {
            let before = self.deck.steps.last();
            if before.is_none_or(|s| s.procedure != Procedure::Static) {
                return Err(Fault::at(
                    line,
                    "PERTURBATION: needed is a *STATIC step before this one",
                ));
            }
            if before.is_some_and(|s| s.pulls.iter().any(|p| matches!(p.1, Pull::Spin { .. }))) {
                return Err(Fault::at(line, "vibrations of what spins are not computed"));
            }
        }
        if !heats {
            return Ok(());
        }
        if let Some(raw) = self.raw.iter().find(|r| matches!(r.kind, Kind::Thin(_))) {
            let why = "heat in beams and shells is not computed";
            return Err(Fault::at(raw.line, format!("element {}: {why}", raw.label)));
        }
        lacks(|m| m.conductivity.is_some(), "*CONDUCTIVITY")?;
        if !matches!(procedure, Procedure::Heat { steady: true, .. }) {
            lacks(|m| m.density.is_some(), "*DENSITY")?;
            lacks(|m| m.specific_heat.is_some(), "*SPECIFIC HEAT")?;
        }
        if self.tied {
            return Err(Fault::at(line, "heat through a *TIE is not computed"));
        }
        Ok(())
    }

    /// Every element is known where displacements are large.
    fn turns(&self) -> Result<(), Fault> {
        let lacks = |kind: Kind| match kind {
            Kind::Solid(Shape::Hex8Mean | Shape::Bar) => Some("C3D8R and T3D2"),
            Kind::Link(Link::Damper) => Some("dashpots"),
            _ => None,
        };
        match self.raw.iter().find_map(|raw| Some((raw, lacks(raw.kind)?))) {
            None => Ok(()),
            Some((raw, what)) => {
                let why = "are not computed where displacements are large (NLGEOM)";
                Err(Fault::at(raw.line, format!("element {}: {what} {why}", raw.label)))
            }
        }
    }

    /// A step of motion or vibration follows one of frequencies, and nothing warms in it.
    fn vibrates(&self, state: &State, line: u32) -> Result<(), Fault> {
        let is_modes = |s: &Step| matches!(s.procedure, Procedure::Modes { heat: false, .. });
        match self.deck.steps.iter().rev().find(|s| is_modes(s)) {
            None => {
                return Err(Fault::at(line, "needed is a step of *FREQUENCY before this one"));
            }
            Some(step) if step.diameters.is_some() => {
                return Err(Fault::at(line, "motion by modes of sectors is not computed"));
            }
            Some(_) => {}
        }
        if !state.warm.is_empty() {
            return Err(Fault::at(line, "a *TEMPERATURE in motion by modes is not computed"));
        }
        Ok(())
    }

    fn boundary(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE", "FIXED"])?;
        clear(card, state.step, &mut state.held, |_| true)?;
        clear(card, state.step, &mut state.kept, |_| true)?;
        clear(card, state.step, &mut state.temperatures, |_| true)?;
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        let step = state.step;
        let keeps = card.get("FIXED").is_some();
        if keeps && step < 2 {
            return Err(card.fault("*BOUNDARY, FIXED holds what a step before has moved"));
        }
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let [target, first, rest @ ..] = words.as_slice() else {
                return Err(row.fault("needed are: node or set, first and last component, value"));
            };
            let last = rest.first().filter(|w| !w.is_empty()).unwrap_or(first);
            let value = rest.get(1).map_or(Ok(0.0), |w| row.number(w))?;
            if is_temperature(first) {
                for node in self.some_nodes(target, row)? {
                    let given = Given { value, amplitude: amplitude.clone(), step };
                    state.temperatures.insert(node, given);
                }
                continue;
            }
            let (first, last) = (component(first, row)?, component(last, row)?);
            for node in self.some_nodes(target, row)? {
                for component in first..=last {
                    let (at, unit) = self.motion(node, component, Some(state.step), row)?;
                    if component < 3 {
                        self.supported((node, component), state.step, row.line);
                    }
                    let given = Given { value: value * unit, amplitude: amplitude.clone(), step };
                    if keeps {
                        state.held.remove(&at);
                        state.kept.insert(at, given);
                    } else {
                        state.held.insert(at, given);
                    }
                }
            }
        }
        Ok(())
    }

    /// The node and component that a component from 0 to 5 of a node is, and the unit of its value:
    /// metres, or one for angles, which a support (of that step) holds otherwise than a moment.
    fn motion(
        &mut self,
        node: u32,
        component: u8,
        supported: Option<u32>,
        row: Row<'_>,
    ) -> Result<((u32, u8), f64), Fault> {
        let Some(angle) = component.checked_sub(3) else {
            return Ok(((node, component), self.units.length()));
        };
        let label = self.deck.labels[node as usize];
        let known = self.turning.get(&node).copied();
        let mean = self.angles(node, supported, row);
        if let (None, Some(known), Some(&axes)) = (mean, known, self.deck.turned.get(&node)) {
            // Angles of a body are a vector, which a *TRANSFORM turns like any other.
            self.deck.turned.insert(known, axes);
        }
        let turning = mean.or(known);
        let none = || {
            row.fault(format!(
                "node {label} has no component {}: solids have 1 to 3",
                component + 1
            ))
        };
        Ok(((turning.ok_or_else(none)?, angle), 1.0))
    }

    /// `*CHANGE SOLID SECTION`
    fn change(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["ELSET", "MATERIAL"])?;
        let material = card.need("MATERIAL")?;
        let undefined = || card.fault(format!("material {} is not defined", quote(&material)));
        let &material = self.materials.get(&material).ok_or_else(undefined)?;
        for element in self.named_elements(card)? {
            if let Some(cell) = self.raw[element as usize].cell {
                state.materials.insert(cell, material);
            }
        }
        Ok(())
    }

    /// Forces. What is given twice in a step adds up, as in CalculiX.
    fn cload(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE", "TIME DELAY", "LOAD CASE"])?;
        clear(card, state.step, &mut state.forces, |_| true)?;
        clear(card, state.step, &mut state.early, |_| true)?;
        let forces = match card.get("LOAD CASE") {
            None | Some("1") => &mut state.forces,
            Some("2") if harmonic(state.open.as_ref()) => &mut state.early,
            Some(_) => {
                return Err(card.fault("LOAD CASE is 1, or 2 in *STEADY STATE DYNAMICS"));
            }
        };
        let amplitude = self.delayed(card)?;
        let around = self.around_nodes();
        for row in card.rows() {
            let [target, direction, value] = row.exactly("node or set, component, force")?;
            let (direction, value) = (component(direction, row)?, row.number(value)?);
            for node in self.some_nodes(target, row)? {
                // A force on what is axially symmetric is that on the whole circle.
                let share = if around.contains(&node) { SLICE / 360.0 } else { 1.0 };
                let (at, _) = self.motion(node, direction, None, row)?;
                // A moment is of newtons and lengths.
                let unit = if direction < 3 { 1.0 } else { self.units.length() };
                let mut value = value * share * unit;
                if let Some(old) = forces.get(&at)
                    && old.step == state.step
                {
                    value += old.value;
                }
                let given = Given { value, amplitude: amplitude.clone(), step: state.step };
                forces.insert(at, given);
            }
        }
        Ok(())
    }

    /// The amplitude that a card names, which begins later where it says so.
    fn delayed(&mut self, card: &Card<'_>) -> Result<Option<String>, Fault> {
        let (Some(name), Some(delay)) =
            (super::mesh::name_of(card, "AMPLITUDE")?, card.get("TIME DELAY"))
        else {
            return super::mesh::name_of(card, "AMPLITUDE");
        };
        let wrong = || card.fault(format!("TIME DELAY={} is no time", quote(delay)));
        let by: f64 = delay.parse().map_err(|_| wrong())?;
        let mut later = self.amplitude_of(&name, card.line)?.clone();
        later.points.iter_mut().for_each(|p| p.0 += by);
        later.name = format!("{name} {by} s later");
        let name = later.name.clone();
        self.amplitudes.insert(name.clone(), later);
        Ok(Some(name))
    }

    /// Nodes of planes where some are axially symmetric: all of them are in the slice then.
    pub(super) fn around_nodes(&self) -> BTreeSet<u32> {
        let is_around = self.is_around();
        let flat = |r: &&Raw| is_around && matches!(r.kind, Kind::Flat(_));
        self.raw.iter().filter(flat).flat_map(|r| r.nodes.iter().copied()).collect()
    }

    /// Whether a slice stands for what is axially symmetric.
    pub(super) fn is_around(&self) -> bool {
        let around = |kind| matches!(kind, Kind::Flat(flat) if flat.plane == Plane::Around);
        self.raw.iter().any(|r| around(r.kind))
    }

    fn dload(&mut self, card: &Card<'_>, state: &mut State, on_surface: bool) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.pressures, |_| true)?;
        if !on_surface {
            clear(card, state.step, &mut state.pulls, |_| true)?;
        }
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let [target, kind, value, rest @ ..] = words.as_slice() else {
                return Err(row.fault("needed are: element or set, kind, value"));
            };
            let (kind, value) = (kind.to_ascii_uppercase(), row.number(value)?);
            let step = state.step;
            if matches!(kind.as_str(), "GRAV" | "CENTRIF") && !on_surface {
                let elements = self.some_cells(target, row)?;
                let pull = self.pull(&kind, value, rest, row)?;
                let given = Given { value: (elements, pull), amplitude: amplitude.clone(), step };
                state.pulls.insert((target.to_ascii_uppercase(), kind), given);
                continue;
            }
            for face in self.loaded(target, &kind, on_surface, row)? {
                let value = value * self.units.stress();
                let given = Given { value, amplitude: amplitude.clone(), step };
                state.pressures.insert(face, given);
            }
        }
        Ok(())
    }

    /// Faces that a pressure acts on.
    fn loaded(
        &self,
        target: &str,
        kind: &str,
        on_surface: bool,
        row: Row<'_>,
    ) -> Result<Vec<(u32, u8)>, Fault> {
        let kinds = "P1 to P6, GRAV and CENTRIF, and P on a *DSLOAD";
        let is_face = kind.len() == 2 && kind.starts_with('P');
        match (on_surface, self.surfaces.get(&target.to_ascii_uppercase())) {
            (true, Some(Surface::Faces(faces))) if kind == "P" => Ok(self.cell_faces(faces)),
            (true, None) => Err(row.fault(format!("surface {} is not defined", quote(target)))),
            (false, _) if kind == "P" => {
                // A pressure on a shell pushes along its normal: it acts on the lower face.
                let elements = self.some_elements(target, row)?;
                let shell =
                    |e: &u32| matches!(self.raw[*e as usize].kind, Kind::Thin(Thin::Shell { .. }));
                if let Some(&other) = elements.iter().find(|e| !shell(e)) {
                    let label = self.raw[other as usize].label;
                    return Err(row.fault(format!("P is of shells, which element {label} is not")));
                }
                let faces: Vec<(u32, u8)> = elements.into_iter().map(|e| (e, 0)).collect();
                Ok(self.cell_faces(&faces))
            }
            (false, _) if is_face => {
                let elements = self.some_elements(target, row)?;
                let face = |e| Ok((e, self.face(e, kind, "P", row)?));
                let faces: Vec<(u32, u8)> =
                    elements.into_iter().map(face).collect::<Result<_, _>>()?;
                Ok(self.cell_faces(&faces))
            }
            _ => Err(row.fault(format!("load {} is not supported; {kinds} are", quote(kind)))),
        }
    }

    /// Faces of solids that faces of elements are.
    fn cell_faces(&self, faces: &[(u32, u8)]) -> Vec<(u32, u8)> {
        faces.iter().filter_map(|&(e, face)| Some((self.raw[e as usize].cell?, face))).collect()
    }

    /// Weight: g and its direction. Spin: ω², a point of the axis and its direction.
    fn pull(&self, kind: &str, value: f64, rest: &[&str], row: Row<'_>) -> Result<Pull, Fault> {
        let numbers = rest.iter().map(|w| row.number(w)).collect::<Result<Vec<_>, _>>()?;
        let length = self.units.length();
        match (kind, numbers.as_slice()) {
            ("GRAV", &[x, y, z]) => Ok(Pull::Weight(value * length * DVec3::new(x, y, z))),
            ("CENTRIF", &[x, y, z, a, b, c]) => {
                let axis = DVec3::new(a, b, c).try_normalize();
                let axis = axis.ok_or_else(|| row.fault("the axis has no length"))?;
                Ok(Pull::Spin { origin: length * DVec3::new(x, y, z), axis, squared: value })
            }
            _ => Err(row.fault(
                "needed are: set, GRAV, g, and its direction; or set, CENTRIF, ω², a point of the axis and its direction",
            )),
        }
    }

    fn temperature(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.warm, |_| true)?;
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        for row in card.rows() {
            let [target, value] = row.exactly("node or set, temperature")?;
            let value = row.number(value)?;
            for node in self.some_nodes(target, row)? {
                let given = Given { value, amplitude: amplitude.clone(), step: state.step };
                state.warm.insert(node, given);
            }
        }
        Ok(())
    }

    fn initial(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["TYPE"])?;
        let kind = card.word("TYPE").unwrap_or_default();
        match kind.as_str() {
            "TEMPERATURE" => {
                for row in card.rows() {
                    let [target, value] = row.exactly("node or set, temperature")?;
                    let value = row.number(value)?;
                    for node in self.some_nodes(target, row)? {
                        self.deck.cold[node as usize] = value;
                    }
                }
                Ok(())
            }
            "STRESS" => {
                self.at_points(card, |reader, _, v| tensor::scale(&v, reader.units.stress()))
            }
            "PLASTIC STRAIN" | "PLASTICSTRAIN" => self.at_points(card, |reader, e, mut v| {
                (3..6).for_each(|i| v[i] *= 2.0);
                let cell = &reader.deck.cells[e as usize];
                let law = reader.deck.materials[cell.material as usize].elastic.as_ref();
                let cold = cell.nodes.first().map_or(0.0, |&n| reader.deck.cold[n as usize]);
                let law = law.map_or([[0.0; 6]; 6], |l| l.stiffness(cold));
                tensor::scale(&tensor::apply(&law, &v), -1.0)
            }),
            _ => Err(card.fault(format!(
                "TYPE={}: TEMPERATURE, STRESS and PLASTIC STRAIN are supported",
                quote(&kind)
            ))),
        }
    }

    /// Element, point, and six numbers in Abaqus' order.
    fn at_points(
        &mut self,
        card: &Card<'_>,
        stress: impl Fn(&Self, u32, Voigt) -> Voigt,
    ) -> Result<(), Fault> {
        for row in card.rows() {
            let what = "element, point, 11, 22, 33, 12, 13, 23";
            let [element, point, numbers @ ..] = row.exactly::<8>(what)?;
            let mut given = tensor::ZERO;
            for (word, at) in numbers.iter().zip(ORDER) {
                given[at] = row.number(word)?;
            }
            for element in self.some_cells(element, row)? {
                let points = self.deck.cells[element as usize].shape.points().len();
                let point = point.parse::<u32>().ok().filter(|p| (1..=points as u32).contains(p));
                let point = point
                    .ok_or_else(|| row.fault(format!("a point is a number from 1 to {points}")))?;
                let stress = stress(self, element, given);
                self.deck.stress.insert((element, point - 1), stress);
            }
        }
        Ok(())
    }

    /// `*EQUATION`: how many terms, then node, component and factor of each.
    pub(super) fn equation(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "EQUATION" || ends(card) {
            return Ok(());
        }
        card.only(&[])?;
        let mut rows = card.rows();
        while let Some(row) = rows.next() {
            let count = row.fields().next().and_then(|w| w.parse::<usize>().ok());
            let count = count.filter(|n| (1..=100_000).contains(n));
            let count = count.ok_or_else(|| row.fault("here stands how many terms follow"))?;
            let mut terms: Vec<(u32, f64)> = Vec::new();
            let (mut first, mut read) = (None, 0);
            while read < count {
                let next =
                    rows.next().ok_or_else(|| row.fault(format!("{count} terms must follow")))?;
                let words: Vec<&str> = next.fields().filter(|w| !w.is_empty()).collect();
                let (all, rest) = words.as_chunks::<3>();
                read += all.len();
                if !rest.is_empty() || read > count {
                    return Err(next.fault("needed are: node, component, factor of every term"));
                }
                for [node, direction, factor] in all {
                    let (node, factor) = (self.node(node, next)?, next.number(factor)?);
                    let (at, _) = self.motion(node, component(direction, next)?, None, next)?;
                    first.get_or_insert(at);
                    let own = self.deck.component(at.0, at.1);
                    terms.extend(own.into_iter().map(|(u, f)| (u, f * factor)));
                }
            }
            self.equations.extend(first.map(|at| (at, self.deck.equations.len())));
            self.deck.equations.push(Equation { terms, value: 0.0, line: row.line });
        }
        Ok(())
    }

    /// `*EQUATION, REMOVE` with components that come first in equations, and `REMOVE ALL`.
    fn end_equations(&mut self, card: &Card<'_>, state: &State) -> Result<(), Fault> {
        if !ends(card) {
            return Ok(());
        }
        card.only(&["REMOVE", "REMOVE ALL"])?;
        if card.get("REMOVE ALL").is_some() {
            self.ended.push((state.step, None));
        }
        for row in card.rows() {
            let [target, direction] = row.exactly("node or set, component")?;
            let component = component(direction, row)?;
            for node in self.some_nodes(target, row)? {
                self.ended.push((state.step, Some((node, component))));
            }
        }
        Ok(())
    }

    /// `*TIE`: what is tied, and the surface that it is tied to.
    pub(super) fn tie(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "TIE" {
            return Ok(());
        }
        if card.get("CYCLIC SYMMETRY").is_some() {
            return self.sided(card);
        }
        card.only(&["NAME", "POSITION TOLERANCE", "ADJUST"])?;
        let row = card.one_row()?.ok_or_else(|| card.fault("needed are: slave, master"))?;
        let [slave, master] = row.exactly("slave, master")?;
        let find = |name: &str| {
            let undefined = || row.fault(format!("surface {} is not defined", quote(name)));
            self.surfaces.get(&name.to_ascii_uppercase()).ok_or_else(undefined)
        };
        let face = |&(e, face): &(u32, u8)| Face::new(&self.deck, self.raw[e as usize].cell?, face);
        let Surface::Faces(faces) = find(master)? else {
            return Err(row.fault("the master of a *TIE is a surface of faces"));
        };
        let masters: Vec<Face> = faces.iter().filter_map(face).collect();
        let mut nodes: Vec<u32> = match find(slave)? {
            Surface::Nodes(nodes) => nodes.clone(),
            Surface::Faces(faces) => {
                faces.iter().filter_map(face).flat_map(|f| f.nodes().to_vec()).collect()
            }
        };
        nodes.sort_unstable();
        nodes.dedup();
        let tolerance = card.get("POSITION TOLERANCE").map(|t| row.number(t)).transpose()?;
        let tolerance = tolerance.filter(|t| *t > 0.0).map(|t| t * self.units.length());
        let adjust = card.word("ADJUST").is_none_or(|a| a != "NO");
        let held: BTreeSet<u32> = self
            .deck
            .steps
            .iter()
            .flat_map(|s| s.held.keys())
            .flat_map(|&(n, c)| self.deck.component(n, c).into_iter().map(|t| t.0))
            .collect();
        let loose = tie::tie(
            &mut self.deck,
            &nodes,
            &masters,
            tolerance,
            adjust,
            |u| held.contains(&u),
            card.line,
        );
        let loose = loose.map_err(|(node, off)| {
            let label = self.deck.labels.get(node as usize).copied().unwrap_or_default();
            card.fault(format!(
                "node {label} is {:.3e} off {master}: a tie across a gap would hold what turns, let the surfaces meet, or leave out ADJUST=NO",
                off / self.units.length()
            ))
        })?;
        if let Some(first) = loose.first().and_then(|&n| self.deck.labels.get(n as usize)) {
            self.deck.notes.push(format!(
                "line {}: {} of {} nodes lie on no face of {master} and stay free, node {first} the first",
                card.line,
                loose.len(),
                nodes.len()
            ));
        }
        Ok(())
    }
}

/// Whether an `*EQUATION` ends others.
fn ends(card: &Card<'_>) -> bool {
    ["REMOVE", "REMOVE ALL"].into_iter().any(|word| card.get(word).is_some())
}

fn harmonic(open: Option<&Open>) -> bool {
    matches!(open.and_then(|o| o.procedure), Some(Procedure::Harmonic { .. }))
}

/// Opens a step.
fn begin(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    if let Some(open) = &state.open {
        return Err(card.fault(format!("the step of line {} has no *END STEP", open.line)));
    }
    state.step += 1;
    state.open = Some(Open {
        line: card.line,
        duration: 1.0,
        perturbs: card.get("PERTURBATION").is_some(),
        procedure: None,
        damping: Damping::None,
        diameters: None,
        coupled: false,
    });
    if let Some(word) = card.word("NLGEOM") {
        state.large = word != "NO";
    }
    card.only(&["NAME", "INC", "AMPLITUDE", "NLGEOM", "PERTURBATION"])
}

/// What a step computes, and how.
fn procedure(card: &Card<'_>, name: &str, state: &mut State) -> Result<(), Fault> {
    let Some(open) = &mut state.open else { return Ok(()) };
    if open.procedure.is_some() {
        return Err(card.fault("a step has one procedure: *END STEP is missing"));
    }
    let numbers = all_numbers(card)?;
    let has = |parameter: &str| card.get(parameter).is_some();
    let modes =
        |stressed, heat| Ok(Procedure::Modes { count: many(card, &numbers)?, stressed, heat });
    let procedure = match name {
        "STATIC" if open.perturbs => {
            return Err(card.fault("*STATIC in a step of PERTURBATION is not computed"));
        }
        "STATIC" => {
            card.only(&["SOLVER", "DIRECT"])?;
            open.duration = duration(card, &numbers)?;
            Procedure::Static
        }
        "FREQUENCY" => {
            card.only(&["SOLVER", "STORAGE", "GLOBAL"])?;
            modes(open.perturbs, false)?
        }
        "BUCKLE" if open.perturbs => {
            return Err(card.fault("*BUCKLE in a step of PERTURBATION is not computed"));
        }
        "BUCKLE" => {
            card.only(&["SOLVER"])?;
            Procedure::Buckling { count: many(card, &numbers)? }
        }
        "DYNAMIC" => {
            card.only(&["SOLVER", "DIRECT", "ALPHA"])?;
            open.duration = duration(card, &numbers)?;
            dynamic(card, &numbers, open.duration)?
        }
        "MODALDYNAMIC" => {
            card.only(&["SOLVER", "DIRECT", "DELTMX"])?;
            open.duration = duration(card, &numbers)?;
            motion(card, &numbers, open.duration)?
        }
        "STEADYSTATEDYNAMICS" => {
            card.only(&["SOLVER", "HARMONIC"])?;
            open.duration = 0.0;
            vibration(card, &numbers)?
        }
        "COUPLEDTEMPERATURE-DISPLACEMENT" | "UNCOUPLEDTEMPERATURE-DISPLACEMENT" => {
            card.only(&["STEADY STATE", "SOLVER", "DIRECT", "DELTMX"])?;
            if !has("STEADY STATE") || state.large || !state.warm.is_empty() {
                let what = "is computed with STEADY STATE, and without NLGEOM and *TEMPERATURE";
                return Err(card.fault(format!("*{} {what}", card.name)));
            }
            open.duration = duration(card, &numbers)?;
            open.coupled = true;
            Procedure::Heat { steady: true, first: open.duration, duration: open.duration }
        }
        _ => {
            const ALLOWED: [&str; 7] = [
                "STEADY STATE",
                "FREQUENCY",
                "SOLVER",
                "DIRECT",
                "DELTMX",
                "TIME RESET",
                "STORAGE",
            ];
            card.only(&ALLOWED)?;
            if has("FREQUENCY") {
                modes(false, true)?
            } else {
                open.duration = duration(card, &numbers)?;
                let first = numbers.first().map_or(open.duration, |f| f.min(open.duration));
                if first.is_nan() || first <= 0.0 {
                    return Err(card.fault(format!("a first increment of {first} s")));
                }
                let steady = has("STEADY STATE");
                Procedure::Heat { steady, first, duration: open.duration }
            }
        }
    };
    open.procedure = Some(procedure);
    Ok(())
}

/// Motion by the equations themselves.
fn dynamic(card: &Card<'_>, numbers: &[f64], duration: f64) -> Result<Procedure, Fault> {
    let alpha = card.get("ALPHA").map_or(Ok(-0.05), |word| {
        let range = -1.0 / 3.0 - 1e-9..=0.0;
        let found = word.parse::<f64>().ok().filter(|alpha| range.contains(alpha));
        found.ok_or_else(|| card.fault("ALPHA is a number from −1/3 to 0"))
    })?;
    let fixed = card.word("DIRECT").is_some_and(|word| word != "NO");
    match numbers.first().copied().unwrap_or(duration) {
        first if first > 0.0 && duration / first <= 1e6 => {
            Ok(Procedure::Dynamic { increment: first.min(duration), fixed, duration, alpha })
        }
        first => Err(card.fault(format!("increments of {first} s in {duration} s"))),
    }
}

/// Motion in increments that are fixed, or as fine as what acts.
fn motion(card: &Card<'_>, numbers: &[f64], duration: f64) -> Result<Procedure, Fault> {
    if card.word("DIRECT").is_some_and(|d| d == "NO") {
        return Ok(Procedure::Motion { increment: None, duration });
    }
    match numbers.first().copied().unwrap_or(duration) {
        first if first > 0.0 && duration / first <= 1e7 => {
            Ok(Procedure::Motion { increment: Some(first.min(duration)), duration })
        }
        first => Err(card.fault(format!("increments of {first} s in {duration} s"))),
    }
}

/// `*MODAL DAMPING`
fn damping(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    card.only(&["RAYLEIGH"])?;
    let Some(open) = &mut state.open else { return Ok(()) };
    let positive = |word: &str, row: Row<'_>| match row.number(word)? {
        value if value >= 0.0 => Ok(value),
        other => Err(row.fault(format!("damping must not be below 0, not {other}"))),
    };
    if card.get("RAYLEIGH").is_some() {
        let row = card.one_row()?.ok_or_else(|| card.fault("needed are: , , α, β"))?;
        let [_, _, mass, stiffness] = row.exactly(", , α, β")?;
        let (mass, stiffness) = (positive(mass, row)?, positive(stiffness, row)?);
        open.damping = Damping::Rayleigh { mass, stiffness };
        return Ok(());
    }
    let mut shares = Vec::new();
    for row in card.rows() {
        let [first, last, share] = row.exactly("first and last mode, part of critical")?;
        let number = |w: &str| w.parse::<usize>().ok().filter(|n| (1..=10_000).contains(n));
        let (Some(first), Some(last)) = (number(first), number(last)) else {
            return Err(row.fault("a mode is a number from 1 to 10000"));
        };
        let share = positive(share, row)?;
        shares.resize(shares.len().max(last), 0.0);
        shares.iter_mut().take(last).skip(first - 1).for_each(|s| *s = share);
    }
    open.damping = Damping::Shares(shares);
    Ok(())
}

/// `*SELECT CYCLIC SYMMETRY MODES`
fn diameters(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    card.only(&["NMIN", "NMAX"])?;
    let number = |name: &str| card.get(name).and_then(|word| word.parse::<u32>().ok());
    let (least, most) = (number("NMIN").unwrap_or(0), number("NMAX"));
    let most = most.filter(|m| (least..=10_000).contains(m));
    let most = most.ok_or_else(|| card.fault("needed are NMIN and NMAX, numbers that ascend"))?;
    if let Some(open) = &mut state.open {
        open.diameters = Some([least, most]);
    }
    Ok(())
}

/// Frequencies from and to, Hz; how many between two modes; how near to these.
fn vibration(card: &Card<'_>, numbers: &[f64]) -> Result<Procedure, Fault> {
    if card.word("HARMONIC").is_some_and(|h| h != "YES") {
        return Err(card.fault("loads that are not harmonic are not computed"));
    }
    let (&[from, to], rest) = numbers.split_first_chunk().ok_or_else(|| {
        card.fault("needed are: lowest and highest frequency, how many between two modes, bias")
    })?;
    let points = rest.first().copied().unwrap_or(20.0);
    let bias = rest.get(1).copied().unwrap_or(3.0);
    let ascend = from >= 0.0 && to >= from && to.is_finite();
    if !ascend {
        return Err(card.fault(format!("frequencies from {from} to {to}")));
    }
    if !(2.0..=10_000.0).contains(&points) || bias.is_nan() || bias < 1.0 || rest.len() > 2 {
        return Err(
            card.fault("2 to 10000 frequencies between two modes, with a bias of 1 or more")
        );
    }
    Ok(Procedure::Harmonic { range: [from, to], points: points as u32, bias })
}

fn duration(card: &Card<'_>, numbers: &[f64]) -> Result<f64, Fault> {
    match numbers.get(1) {
        Some(d) if d.is_nan() || *d <= 0.0 => Err(card.fault(format!("a duration of {d} s"))),
        other => Ok(other.copied().unwrap_or(1.0)),
    }
}

/// How many eigenvalues.
fn many(card: &Card<'_>, numbers: &[f64]) -> Result<usize, Fault> {
    let count = numbers.first().copied().unwrap_or(0.0);
    if (1.0..=10_000.0).contains(&count) && count.fract() == 0.0 {
        return Ok(count as usize);
    }
    Err(card.fault(format!("*{} needs how many eigenvalues, from 1 to 10000", card.name)))
}

/// `OP=NEW` drops what earlier steps have left.
pub(super) fn clear<K: Ord, T>(
    card: &Card<'_>,
    step: u32,
    map: &mut BTreeMap<K, Given<T>>,
    concerns: impl Fn(&K) -> bool,
) -> Result<(), Fault> {
    match card.word("OP").as_deref() {
        None | Some("MOD") => {}
        Some("NEW") => map.retain(|k, g| g.step == step || !concerns(k)),
        Some(other) => {
            return Err(card.fault(format!("OP={}: MOD and NEW are supported", quote(other))));
        }
    }
    Ok(())
}

fn component(word: &str, row: Row<'_>) -> Result<u8, Fault> {
    match word.parse::<u8>() {
        Ok(c @ 1..=6) => Ok(c - 1),
        _ => Err(row.fault(format!("{} is no component: 1 to 6 are", quote(word)))),
    }
}
