//! Supports and loads, temperatures and initial stress.

use glam::DVec3;

use super::{Given, State, clear};
use crate::{
    linear::{
        law::ORDER,
        mesh::name_of,
        read::{Kind, Reader, Surface},
        thin::Thin,
        warm::is_temperature,
    },
    read::{
        Fault,
        abaqus::card::{Card, Row},
        quote,
    },
    tensor,
};

impl Reader {
    pub(super) fn boundary(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE", "FIXED"])?;
        clear(card, state.step, &mut state.held, |_| true)?;
        clear(card, state.step, &mut state.kept, |_| true)?;
        clear(card, state.step, &mut state.temperatures, |_| true)?;
        let amplitude = name_of(card, "AMPLITUDE")?;
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
    pub(super) fn motion(
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

    /// Forces. What is given twice in a step adds up, as in CalculiX.
    pub(super) fn cload(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.forces, |_| true)?;
        let amplitude = name_of(card, "AMPLITUDE")?;
        let forces = &mut state.forces;
        for row in card.rows() {
            let [target, direction, value] = row.exactly("node or set, component, force")?;
            let (direction, value) = (component(direction, row)?, row.number(value)?);
            for node in self.some_nodes(target, row)? {
                let (at, _) = self.motion(node, direction, None, row)?;
                // A moment is of newtons and lengths.
                let unit = if direction < 3 { 1.0 } else { self.units.length() };
                let mut value = value * unit;
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

    pub(super) fn dload(
        &mut self,
        card: &Card<'_>,
        state: &mut State,
        on_surface: bool,
    ) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.pressures, |_| true)?;
        if !on_surface {
            clear(card, state.step, &mut state.pulls, |_| true)?;
        }
        let amplitude = name_of(card, "AMPLITUDE")?;
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let [target, kind, value, rest @ ..] = words.as_slice() else {
                return Err(row.fault("needed are: element or set, kind, value"));
            };
            let (kind, value) = (kind.to_ascii_uppercase(), row.number(value)?);
            let step = state.step;
            if kind == "GRAV" && !on_surface {
                let elements = self.some_cells(target, row)?;
                let pull = self.acceleration(value, rest, row)?;
                let given = Given { value: (elements, pull), amplitude: amplitude.clone(), step };
                state.pulls.insert(target.to_ascii_uppercase(), given);
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
        let kinds = "P1 to P6 and GRAV, and P on a *DSLOAD";
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

    /// g and its direction.
    fn acceleration(&self, g: f64, rest: &[&str], row: Row<'_>) -> Result<DVec3, Fault> {
        let numbers = rest.iter().map(|w| row.number(w)).collect::<Result<Vec<_>, _>>()?;
        match numbers.as_slice() {
            &[x, y, z] => Ok(g * self.units.length() * DVec3::new(x, y, z)),
            _ => Err(row.fault("needed are: set, GRAV, g, and its direction")),
        }
    }

    pub(super) fn temperature(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear(card, state.step, &mut state.warm, |_| true)?;
        let amplitude = name_of(card, "AMPLITUDE")?;
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

    pub(super) fn initial(&mut self, card: &Card<'_>) -> Result<(), Fault> {
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
            "STRESS" => self.stress(card),
            _ => {
                Err(card
                    .fault(format!("TYPE={}: TEMPERATURE and STRESS are supported", quote(&kind))))
            }
        }
    }

    /// Element, point, and six numbers in Abaqus' order.
    fn stress(&mut self, card: &Card<'_>) -> Result<(), Fault> {
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
                let stress = tensor::scale(&given, self.units.stress());
                self.deck.stress.insert((element, point - 1), stress);
            }
        }
        Ok(())
    }
}

pub(super) fn component(word: &str, row: Row<'_>) -> Result<u8, Fault> {
    match word.parse::<u8>() {
        Ok(c @ 1..=6) => Ok(c - 1),
        _ => Err(row.fault(format!("{} is no component: 1 to 6 are", quote(word)))),
    }
}
