//! Supports, loads and steps; equations and ties.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::{
    constraint::Equation,
    flat::{Plane, SLICE},
    matter::ORDER,
    model::{Pull, Step},
    read::{Kind, Reader, Surface, plain},
    tie::{self, Face},
};
use crate::{
    model::interpolate,
    read::{
        Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor::{self, Voigt},
};

/// A value, the amplitude that it follows, and the step that set it (0: before the first).
#[derive(Debug, Clone)]
struct Given<T> {
    value: T,
    amplitude: Option<String>,
    step: u32,
}

/// What is in force.
#[derive(Default)]
pub(super) struct State {
    held: BTreeMap<(u32, u8), Given<f64>>,
    forces: BTreeMap<(u32, u8), Given<f64>>,
    pressures: BTreeMap<(u32, u8), Given<f64>>,
    pulls: BTreeMap<(String, String), Given<(Vec<u32>, Pull)>>,
    warm: BTreeMap<u32, Given<f64>>,
    step: u32,
    /// The step that is open: its name, line and duration.
    open: Option<(String, u32, f64)>,
    /// When the steps before it ended.
    time: f64,
}

impl State {
    /// Every step that began has ended, and there was one.
    pub(super) fn ended(&self) -> Result<(), Fault> {
        match &self.open {
            Some((_, line, _)) => {
                Err(Fault::at(*line, "*STEP without *END STEP: is the deck cut off?"))
            }
            None if self.step == 0 => Err(Fault::whole("no *STEP: there is nothing to compute")),
            None => Ok(()),
        }
    }
}

impl Reader {
    /// Everything that has an order.
    pub(super) fn history(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        let name = plain(card);
        let within = ["STATIC", "ENDSTEP", "CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE"];
        if within.contains(&name.as_str()) && state.open.is_none() {
            return Err(card.fault(format!("*{} must stand in a *STEP", card.name)));
        }
        match name.as_str() {
            "STEP" => begin(card, state),
            "STATIC" => timing(card, state),
            "ENDSTEP" => self.close(state),
            "BOUNDARY" => self.boundary(card, state),
            "CLOAD" => self.cload(card, state),
            "DLOAD" | "DSLOAD" => self.dload(card, state, name == "DSLOAD"),
            "TEMPERATURE" => self.temperature(card, state),
            "INITIALCONDITIONS" => self.initial(card),
            _ => Ok(()),
        }
    }

    /// What is in force at the end of the step.
    fn close(&mut self, state: &mut State) -> Result<(), Fault> {
        let Some((name, line, duration)) = state.open.take() else { return Ok(()) };
        let mut step = Step { name, ..Step::default() };
        let factor = |amplitude: &Option<String>| -> Result<f64, Fault> {
            let Some(name) = amplitude else { return Ok(1.0) };
            let missing = || Fault::at(line, format!("amplitude {} is not defined", quote(name)));
            let amplitude = self.amplitudes.get(name).ok_or_else(missing)?;
            let time = if amplitude.total_time { state.time + duration } else { duration };
            Ok(interpolate(&amplitude.points, time).unwrap_or(1.0))
        };
        let at_end = |all: &BTreeMap<(u32, u8), Given<f64>>| {
            let value = |(&key, g): (&(u32, u8), &Given<f64>)| {
                Ok::<_, Fault>((key, g.value * factor(&g.amplitude)?))
            };
            all.iter().map(value).collect::<Result<BTreeMap<_, _>, _>>()
        };
        (step.held, step.forces) = (at_end(&state.held)?, at_end(&state.forces)?);
        step.pressures = at_end(&state.pressures)?;
        for pull in state.pulls.values() {
            let factor = factor(&pull.amplitude)?;
            let (elements, pull) = &pull.value;
            step.pulls.extend(elements.iter().map(|&e| (e, pull.times(factor))));
        }
        if !state.warm.is_empty() {
            step.warm.clone_from(&self.deck.cold);
            for (&node, warm) in &state.warm {
                step.warm[node as usize] = warm.value * factor(&warm.amplitude)?;
            }
        }
        state.time += duration;
        self.deck.steps.push(step);
        Ok(())
    }

    fn boundary(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.held)?;
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let [target, first, rest @ ..] = words.as_slice() else {
                return Err(row.fault("needed are: node or set, first and last component, value"));
            };
            let last = rest.first().filter(|w| !w.is_empty()).unwrap_or(first);
            let value = rest.get(1).map_or(Ok(0.0), |w| row.number(w))?;
            let (first, last) = (component(first, row)?, component(last, row)?);
            for node in self.some_nodes(target, row)? {
                for component in first..=last {
                    let value = value * self.units.length();
                    let given = Given { value, amplitude: amplitude.clone(), step: state.step };
                    state.held.insert((node, component), given);
                }
            }
        }
        Ok(())
    }

    /// Forces. What is given twice in a step adds up, as in CalculiX.
    fn cload(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.forces)?;
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        let around = self.around_nodes();
        for row in card.rows() {
            let [target, direction, value] = row.exactly("node or set, component, force")?;
            let (direction, value) = (component(direction, row)?, row.number(value)?);
            for node in self.some_nodes(target, row)? {
                // A force on what is axially symmetric is that on the whole circle.
                let share = if around.contains(&node) { SLICE / 360.0 } else { 1.0 };
                let mut value = value * share;
                if let Some(old) = state.forces.get(&(node, direction))
                    && old.step == state.step
                {
                    value += old.value;
                }
                let given = Given { value, amplitude: amplitude.clone(), step: state.step };
                state.forces.insert((node, direction), given);
            }
        }
        Ok(())
    }

    fn around_nodes(&self) -> BTreeSet<u32> {
        let around = |kind| matches!(kind, Kind::Flat(flat) if flat.plane == Plane::Around);
        self.raw.iter().filter(|r| around(r.kind)).flat_map(|r| r.nodes.iter().copied()).collect()
    }

    fn dload(&mut self, card: &Card<'_>, state: &mut State, on_surface: bool) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.pressures)?;
        if !on_surface {
            clear(card, state.step, &mut state.pulls)?;
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
                let elements = self.some_elements(target, row)?;
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
            (true, Some(Surface::Faces(faces))) if kind == "P" => Ok(faces.clone()),
            (true, None) => Err(row.fault(format!("surface {} is not defined", quote(target)))),
            (false, _) if is_face => self
                .some_elements(target, row)?
                .into_iter()
                .map(|e| Ok((e, self.face(e, kind, "P", row)?)))
                .collect(),
            _ => Err(row.fault(format!("load {} is not supported; {kinds} are", quote(kind)))),
        }
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
        clear(card, state.step, &mut state.warm)?;
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
                let material = reader.deck.cells[e as usize].material;
                let law = &reader.deck.materials[material as usize].stiffness;
                tensor::scale(&tensor::apply(law, &v), -1.0)
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
            for element in self.some_elements(element, row)? {
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
        if plain(card) != "EQUATION" {
            return Ok(());
        }
        card.only(&[])?;
        let mut rows = card.rows();
        while let Some(row) = rows.next() {
            let count = row.fields().next().and_then(|w| w.parse::<usize>().ok());
            let count = count.filter(|n| (1..=100_000).contains(n));
            let count = count.ok_or_else(|| row.fault("here stands how many terms follow"))?;
            let mut terms: Vec<(u32, f64)> = Vec::new();
            for _ in 0..count.div_ceil(4) {
                let next =
                    rows.next().ok_or_else(|| row.fault(format!("{count} terms must follow")))?;
                let words: Vec<&str> = next.fields().filter(|w| !w.is_empty()).collect();
                let (all, rest) = words.as_chunks::<3>();
                if !rest.is_empty() {
                    return Err(next.fault("needed are: node, component, factor of every term"));
                }
                for [node, direction, factor] in all {
                    let (node, factor) = (self.node(node, next)?, next.number(factor)?);
                    let own = self.deck.component(node, component(direction, next)?);
                    terms.extend(own.into_iter().map(|(u, f)| (u, f * factor)));
                }
            }
            self.deck.equations.push(Equation { terms, value: 0.0, line: row.line });
        }
        Ok(())
    }

    /// `*TIE`: what is tied, and the surface that it is tied to.
    pub(super) fn tied(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "TIE" {
            return Ok(());
        }
        card.only(&["NAME", "POSITION TOLERANCE", "ADJUST"])?;
        let row = card.one_row()?.ok_or_else(|| card.fault("needed are: slave, master"))?;
        let [slave, master] = row.exactly("slave, master")?;
        let find = |name: &str| {
            let undefined = || row.fault(format!("surface {} is not defined", quote(name)));
            self.surfaces.get(&name.to_ascii_uppercase()).ok_or_else(undefined)
        };
        let face = |&(cell, face): &(u32, u8)| Face::new(&self.deck, cell, face);
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
                "node {label} is {:.3e} off {master}: a tie across a gap is not computed, let the surfaces meet",
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

/// Opens a step.
fn begin(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    if let Some((_, line, _)) = &state.open {
        return Err(card.fault(format!("the step of line {line} has no *END STEP")));
    }
    state.step += 1;
    state.open = Some((format!("step {}", state.step), card.line, 1.0));
    card.only(&["NAME", "INC", "AMPLITUDE", "NLGEOM"])?;
    if card.word("NLGEOM").is_some_and(|v| v != "NO") {
        return Err(card.fault("*STEP, NLGEOM: large displacements are not computed"));
    }
    Ok(())
}

/// First increment and duration.
fn timing(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    card.only(&["SOLVER", "DIRECT"])?;
    let Some(row) = card.one_row()? else { return Ok(()) };
    let duration = row.fields().nth(1).filter(|w| !w.is_empty()).map(|w| row.number(w));
    if let (Some(duration), Some(open)) = (duration.transpose()?, &mut state.open) {
        if duration.is_nan() || duration <= 0.0 {
            return Err(row.fault(format!("a duration of {duration} s")));
        }
        open.2 = duration;
    }
    Ok(())
}

/// `OP=NEW` drops what earlier steps have left.
fn clear<K: Ord, T>(
    card: &Card<'_>,
    step: u32,
    map: &mut BTreeMap<K, Given<T>>,
) -> Result<(), Fault> {
    match card.word("OP").as_deref() {
        None | Some("MOD") => {}
        Some("NEW") => map.retain(|_, g| g.step == step),
        Some(other) => {
            return Err(card.fault(format!("OP={}: MOD and NEW are supported", quote(other))));
        }
    }
    Ok(())
}

fn component(word: &str, row: Row<'_>) -> Result<u8, Fault> {
    match word.parse::<u8>() {
        Ok(c @ 1..=3) => Ok(c - 1),
        _ => Err(row.fault(format!("{} is no component: solids have 1 to 3", quote(word)))),
    }
}
