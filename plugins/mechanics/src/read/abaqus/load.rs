//! Supports, loads, initial state, steps.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::{Card, Fault, Reader, card::Row};
use crate::{
    mesh::ElementId,
    read::{
        Body, Embedded, Fixed, InitialStress, Load, ModelChange, Pressure, Step, Temperature, quote,
    },
};

/// What was set, and the line that did.
struct Set<T> {
    value: T,
    line: u32,
    /// 0: before the first step.
    step: u32,
}

/// What is in force: kept from step to step until replaced, or dropped by `OP=NEW`.
#[derive(Default)]
struct Force {
    fixed: BTreeMap<(u32, u8), Set<(f64, Option<u32>)>>,
    loads: BTreeMap<(u32, u8), Set<(f64, Option<u32>)>>,
    pressures: BTreeMap<(ElementId, u8), Set<(f64, Option<u32>)>>,
    bodies: BTreeMap<String, Set<Body>>,
    temperatures: BTreeMap<u32, Set<(f64, Option<u32>)>>,
    /// Number of the current step, from 1; 0 before the first.
    step: u32,
}

impl Reader {
    /// Everything that has an order: initial state, then step by step.
    pub(super) fn history(&mut self, cards: &[Card<'_>]) -> Result<(), Fault> {
        let mut force = Force::default();
        let mut step: Option<(Step, u32)> = None;
        for card in cards {
            let outside = step.is_none();
            let within = |card: &Card<'_>| {
                if outside {
                    Err(card.fault(format!("*{} must stand in a *STEP", card.name)))
                } else {
                    Ok(())
                }
            };
            let before = |card: &Card<'_>, steps: u32| {
                if steps > 0 {
                    Err(card.fault(format!("*{} must stand before the first *STEP", card.name)))
                } else {
                    Ok(())
                }
            };
            match card.name.as_str() {
                "STEP" => {
                    if let Some((_, line)) = step {
                        return Err(card.fault(format!("the step of line {line} has no *END STEP")));
                    }
                    if force.step == 0 {
                        self.deck.boundary = fixed(&force);
                    }
                    force.step += 1;
                    step = Some((begin(card, force.step)?, card.line));
                }
                "END STEP" => {
                    card.only(&[])?;
                    card.no_rows()?;
                    let (mut done, _) =
                        step.take().ok_or_else(|| card.fault("*END STEP without *STEP"))?;
                    self.close(&mut done, &force, card.line)?;
                    self.deck.steps.push(done);
                }
                "STATIC" => {
                    within(card)?;
                    if let Some((step, _)) = &mut step {
                        timing(card, step, &mut self.deck.notes)?;
                    }
                }
                "BOUNDARY" => self.boundary(card, &mut force)?,
                "CLOAD" => {
                    within(card)?;
                    self.cload(card, &mut force)?;
                }
                "DLOAD" | "DSLOAD" => {
                    within(card)?;
                    self.dload(card, &mut force)?;
                }
                "TEMPERATURE" => {
                    within(card)?;
                    self.temperature(card, &mut force)?;
                }
                "MODEL CHANGE" => {
                    within(card)?;
                    let change = self.model_change(card)?;
                    if let Some((step, _)) = &mut step {
                        step.changes.push(change);
                    }
                }
                "INITIAL CONDITIONS" => {
                    before(card, force.step)?;
                    self.initial(card)?;
                }
                "EMBEDDED ELEMENT" => {
                    before(card, force.step)?;
                    self.embedded(card)?;
                }
                _ => {}
            }
        }
        if force.step == 0 {
            self.deck.boundary = fixed(&force);
        }
        match step {
            Some((_, line)) => {
                Err(Fault::at(line, "*STEP without *END STEP: is the deck cut off?"))
            }
            None => Ok(()),
        }
    }

    /// Copies what is in force into the step.
    fn close(&mut self, step: &mut Step, force: &Force, line: u32) -> Result<(), Fault> {
        let bodies: usize = force.bodies.values().map(|b| b.value.elements.len()).sum();
        self.spend(
            force.fixed.len()
                + force.loads.len()
                + force.pressures.len()
                + force.temperatures.len()
                + bodies,
            line,
        )?;
        step.boundary = fixed(force);
        step.loads = force
            .loads
            .iter()
            .map(|(&(node, component), s)| Load {
                node,
                component,
                value: s.value.0,
                amplitude: s.value.1,
            })
            .collect();
        step.pressures = force
            .pressures
            .iter()
            .map(|(&(element, face), s)| Pressure {
                element,
                face,
                value: s.value.0,
                amplitude: s.value.1,
            })
            .collect();
        step.bodies = force.bodies.values().map(|s| s.value.clone()).collect();
        step.temperatures = force
            .temperatures
            .iter()
            .map(|(&node, s)| Temperature { node, value: s.value.0, amplitude: s.value.1 })
            .collect();
        Ok(())
    }

    /// The amplitude that a card names.
    fn amplitude_of(&self, card: &Card<'_>) -> Result<Option<u32>, Fault> {
        let Some(_) = card.get("AMPLITUDE") else { return Ok(None) };
        let name = card.need("AMPLITUDE")?;
        match self.amplitudes.get(&name) {
            Some(&i) => Ok(Some(i)),
            None => Err(card.fault(format!("amplitude {} is not defined", quote(&name)))),
        }
    }

    fn boundary(&mut self, card: &Card<'_>, force: &mut Force) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE", "TYPE"])?;
        if card.word("TYPE").is_some_and(|t| t != "DISPLACEMENT") {
            return Err(card.fault("*BOUNDARY: only TYPE=DISPLACEMENT is supported"));
        }
        clear_if_new(card, force.step, &mut force.fixed)?;
        let amplitude = self.amplitude_of(card)?;
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let (components, value) = match words[..] {
                [_, kind] if kind.starts_with(|c: char| c.is_ascii_alphabetic()) => {
                    (named_support(kind, row)?, 0.0)
                }
                [_, first] | [_, first, ""] => (components(first, first, row)?, 0.0),
                [_, first, last] => (components(first, last, row)?, 0.0),
                [_, first, "", value] => (components(first, first, row)?, row.number(value)?),
                [_, first, last, value] => (components(first, last, row)?, row.number(value)?),
                _ => {
                    return Err(row.fault(
                        "needed are: node or node set, first component, last component, value",
                    ));
                }
            };
            let nodes = self.target_nodes(words[0], row.line)?;
            self.spend(nodes.len() * components.len(), row.line)?;
            for (node, &component) in
                nodes.iter().flat_map(|&n| components.iter().map(move |c| (n, c)))
            {
                let value = if component < 3 { value * self.units.length() } else { value };
                let new = Set { value: (value, amplitude), line: row.line, step: force.step };
                let old = force.fixed.insert((node, component), new);
                // The same support twice does no harm: corners belong to two sides.
                if let Some(old) =
                    old.filter(|o| o.step == force.step && o.value != (value, amplitude))
                {
                    let name = self.deck.mesh.node_name(node);
                    return Err(row.fault(format!(
                        "component {} of {name} was given another value in line {}",
                        component + 1,
                        old.line
                    )));
                }
            }
        }
        Ok(())
    }

    fn cload(&mut self, card: &Card<'_>, force: &mut Force) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear_if_new(card, force.step, &mut force.loads)?;
        let amplitude = self.amplitude_of(card)?;
        for row in card.rows() {
            let [target, component, value] = row.exactly("node or node set, component, force")?;
            let components = components(component, component, row)?;
            let value = row.number(value)?;
            for node in self.target_nodes(target, row.line)? {
                for &component in &components {
                    // A moment is force times length.
                    let value = if component < 3 { value } else { value * self.units.length() };
                    let what = || {
                        format!(
                            "component {} of {} is loaded",
                            component + 1,
                            self.deck.mesh.node_name(node)
                        )
                    };
                    replace(
                        &mut force.loads,
                        (node, component),
                        (value, amplitude),
                        force.step,
                        row,
                        what,
                    )?;
                }
            }
        }
        Ok(())
    }

    fn dload(&mut self, card: &Card<'_>, force: &mut Force) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        let step = force.step;
        if is_new(card)? {
            force.pressures.retain(|_, s| s.step == step);
            force.bodies.retain(|_, s| s.step == step);
        }
        let amplitude = self.amplitude_of(card)?;
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let [target, kind, value, ..] = words[..] else {
                return Err(row.fault(
                    "needed are: element or set, P1 to P6, pressure; or set, GRAV, g, x, y, z",
                ));
            };
            let kind = kind.to_ascii_uppercase();
            let number = row.number(value)?;
            if kind == "GRAV" && card.is("DLOAD") {
                self.gravity(target, number, &words[3..], amplitude, row, force)?;
                continue;
            }
            if words.len() > 3 {
                return Err(row.fault(
                    "more than three fields; needed are: element or set, P1 to P6, pressure",
                ));
            }
            for (element, face) in self.loaded_faces(card, target, &kind, row)? {
                let what =
                    || format!("side {} of {} is loaded", face + 1, self.deck.mesh.name(element));
                replace(
                    &mut force.pressures,
                    (element, face),
                    (number * self.units.stress(), amplitude),
                    step,
                    row,
                    what,
                )?;
            }
        }
        Ok(())
    }

    /// Faces that a line of `*DLOAD` (element, P3) or `*DSLOAD` (surface, P) names.
    fn loaded_faces(
        &mut self,
        card: &Card<'_>,
        target: &str,
        kind: &str,
        row: Row<'_>,
    ) -> Result<Vec<(ElementId, u8)>, Fault> {
        if card.is("DSLOAD") {
            if kind != "P" {
                return Err(
                    row.fault(format!("*DSLOAD: {} is not supported; supported: P", quote(kind)))
                );
            }
            let Some(count) = self.surfaces.get(&target.to_ascii_uppercase()).map(Vec::len) else {
                return Err(row.fault(format!("surface {} is not defined", quote(target))));
            };
            self.spend(count, row.line)?;
            return Ok(self
                .surfaces
                .get(&target.to_ascii_uppercase())
                .cloned()
                .unwrap_or_default());
        }
        if !kind.starts_with('P') || kind.len() > 2 {
            return Err(row.fault(format!(
                "*DLOAD: {} is not supported; supported: P1 to P6, P (shells), GRAV",
                quote(kind)
            )));
        }
        self.target_elements(target, row.line)?
            .into_iter()
            .map(|e| Ok((e, self.face_of(e, kind, "P", row)?)))
            .collect()
    }

    fn gravity(
        &mut self,
        target: &str,
        size: f64,
        direction: &[&str],
        amplitude: Option<u32>,
        row: Row<'_>,
        force: &mut Force,
    ) -> Result<(), Fault> {
        let [x, y, z] = direction else {
            return Err(row.fault("needed are: element set, GRAV, g, and the direction x, y, z"));
        };
        let direction = DVec3::new(row.number(x)?, row.number(y)?, row.number(z)?);
        let direction = direction
            .try_normalize()
            .ok_or_else(|| row.fault("GRAV: the direction has no length"))?;
        let elements = if target.is_empty() {
            let mesh = &self.deck.mesh;
            let (h, s, r) =
                (mesh.hexes.len() as u32, mesh.shells.len() as u32, mesh.rods.len() as u32);
            self.spend((h + s + r) as usize, row.line)?;
            (0..h)
                .map(ElementId::Hex)
                .chain((0..s).map(ElementId::Shell))
                .chain((0..r).map(ElementId::Rod))
                .collect()
        } else {
            self.target_elements(target, row.line)?
        };
        let body =
            Body { elements, acceleration: size * self.units.length() * direction, amplitude };
        replace(&mut force.bodies, target.to_ascii_uppercase(), body, force.step, row, || {
            format!("{} has weight", quote(target))
        })
    }

    fn temperature(&mut self, card: &Card<'_>, force: &mut Force) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        clear_if_new(card, force.step, &mut force.temperatures)?;
        let amplitude = self.amplitude_of(card)?;
        for row in card.rows() {
            let [target, value] = row.exactly("node or node set, temperature")?;
            let value = row.number(value)?;
            for node in self.target_nodes(target, row.line)? {
                let old = force.temperatures.insert(
                    node,
                    Set { value: (value, amplitude), line: row.line, step: force.step },
                );
                if let Some(old) =
                    old.filter(|o| o.step == force.step && o.value != (value, amplitude))
                {
                    let name = self.deck.mesh.node_name(node);
                    return Err(row.fault(format!(
                        "{name} was given another temperature in line {}",
                        old.line
                    )));
                }
            }
        }
        Ok(())
    }

    fn model_change(&mut self, card: &Card<'_>) -> Result<ModelChange, Fault> {
        card.only(&["TYPE", "ADD", "REMOVE"])?;
        if card.word("TYPE").is_some_and(|t| t != "ELEMENT") {
            return Err(card.fault("*MODEL CHANGE: only TYPE=ELEMENT is supported"));
        }
        let add = match (card.word("ADD").as_deref(), card.get("REMOVE")) {
            (Some("" | "STRAIN FREE"), None) => true,
            (None, Some("")) => false,
            (Some("WITH STRAIN"), None) => {
                return Err(card.fault("*MODEL CHANGE, ADD=WITH STRAIN is not supported: elements are born free of strain"));
            }
            _ => return Err(card.fault("*MODEL CHANGE needs either ADD or REMOVE")),
        };
        let mut elements = Vec::new();
        for row in card.rows() {
            for word in row.fields() {
                let more = self.target_elements(word, row.line)?;
                elements.extend(more);
            }
        }
        elements.sort_unstable();
        elements.dedup();
        if elements.is_empty() {
            Err(card.fault("*MODEL CHANGE names no element"))
        } else {
            Ok(ModelChange { add, elements })
        }
    }

    fn initial(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["TYPE"])?;
        match card.need("TYPE")?.as_str() {
            "STRESS" => self.initial_stress(card),
            "TEMPERATURE" => {
                for row in card.rows() {
                    let [target, value] = row.exactly("node or node set, temperature")?;
                    let value = row.number(value)?;
                    let nodes = self.target_nodes(target, row.line)?;
                    self.initial_temperature.extend(nodes.into_iter().map(|n| (n, value)));
                }
                Ok(())
            }
            other => Err(card.fault(format!(
                "*INITIAL CONDITIONS: TYPE={} is not supported; supported: STRESS, TEMPERATURE",
                quote(other)
            ))),
        }
    }

    /// Abaqus: element or set, then one (rods) to six components. CalculiX: element, integration
    /// point, six components.
    fn initial_stress(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        let mut by_point: HashMap<ElementId, (f64, [f64; 6])> = HashMap::new();
        for row in card.rows() {
            let words: Vec<&str> = row.fields().collect();
            let numbers =
                words[1..].iter().map(|w| row.number(w)).collect::<Result<Vec<f64>, _>>()?;
            let (components, point) =
                match numbers.len() {
                    n @ 1..=6 => (&numbers[..n], false),
                    7 => (&numbers[1..], true),
                    _ => return Err(row.fault(
                        "needed are: element or set, stresses 11, 22, 33, 12, 13, 23 (rods: 11)",
                    )),
                };
            // 11, 22, 33, 12, 13, 23 to xx, yy, zz, xy, yz, zx.
            let mut stress = [0.0; 6];
            for (&value, to) in components.iter().zip([0, 1, 2, 3, 5, 4]) {
                stress[to] = value * self.units.stress();
            }
            for element in self.target_elements(words[0], row.line)? {
                if matches!(element, ElementId::Rod(_)) && components[1..].iter().any(|&c| c != 0.0)
                {
                    return Err(row.fault(format!(
                        "{} is a rod: it has one stress",
                        self.deck.mesh.name(element)
                    )));
                }
                if point {
                    let (count, sum) = by_point.entry(element).or_default();
                    *count += 1.0;
                    sum.iter_mut().zip(stress).for_each(|(s, v)| *s += v);
                    continue;
                }
                if let Some(line) = self.stressed.insert(element, row.line) {
                    return Err(row.fault(format!(
                        "{} has an initial stress already (line {line})",
                        self.deck.mesh.name(element)
                    )));
                }
                self.deck.initial_stress.push(InitialStress { element, stress });
            }
        }
        if !by_point.is_empty() {
            self.deck.notes.push(format!(
                "line {}: initial stresses of integration points were averaged over each element",
                card.line
            ));
            let mut by_point: Vec<_> = by_point.into_iter().collect();
            by_point.sort_unstable_by_key(|p| p.0);
            for (element, (count, sum)) in by_point {
                if self.stressed.insert(element, card.line).is_some() {
                    return Err(card.fault(format!(
                        "{} has an initial stress already",
                        self.deck.mesh.name(element)
                    )));
                }
                self.deck
                    .initial_stress
                    .push(InitialStress { element, stress: sum.map(|s| s / count) });
            }
        }
        Ok(())
    }

    fn embedded(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&[
            "HOST ELSET",
            "EXTERIOR TOLERANCE",
            "ABSOLUTE EXTERIOR TOLERANCE",
            "ROUNDOFF TOLERANCE",
        ])?;
        let mut embedded = Embedded::default();
        if card.get("HOST ELSET").is_some() {
            for element in self.target_elements(&card.need("HOST ELSET")?, card.line)? {
                let ElementId::Hex(hex) = element else {
                    return Err(card.fault(format!(
                        "{} cannot be a host: only hexahedra can",
                        self.deck.mesh.name(element)
                    )));
                };
                embedded.hosts.push(hex);
            }
        }
        for row in card.rows() {
            for word in row.fields() {
                for element in self.target_elements(word, row.line)? {
                    let ElementId::Rod(rod) = element else {
                        return Err(row.fault(format!(
                            "{} cannot be embedded: only rods (T3D2) can",
                            self.deck.mesh.name(element)
                        )));
                    };
                    embedded.rods.push(rod);
                }
            }
        }
        embedded.rods.sort_unstable();
        embedded.rods.dedup();
        if embedded.rods.is_empty() {
            return Err(card.fault("*EMBEDDED ELEMENT names no rod"));
        }
        if let Some(&rod) = embedded.rods.iter().find(|&&r| !self.embedded_rods.insert(r)) {
            return Err(card.fault(format!(
                "{} is embedded already",
                self.deck.mesh.name(ElementId::Rod(rod))
            )));
        }
        self.deck.embedded.push(embedded);
        Ok(())
    }
}

fn begin(card: &Card<'_>, number: u32) -> Result<Step, Fault> {
    card.only(&["NAME", "INC", "AMPLITUDE", "NLGEOM", "PERTURBATION"])?;
    if card.word("NLGEOM").is_some_and(|v| v != "NO") {
        return Err(card.fault("*STEP, NLGEOM: large displacements are not computed; take NLGEOM out if small ones will do"));
    }
    let ramp = match card.word("AMPLITUDE").as_deref() {
        None | Some("RAMP") => true,
        Some("STEP") => false,
        Some(other) => {
            return Err(card
                .fault(format!("*STEP, AMPLITUDE={}: RAMP and STEP are supported", quote(other))));
        }
    };
    let name = card
        .get("NAME")
        .filter(|n| !n.is_empty())
        .map_or_else(|| format!("step {number}"), str::to_owned);
    // Titles under *STEP are Abaqus' habit; they say nothing.
    Ok(Step { name, duration: 1.0, ramp, ..Step::default() })
}

/// First increment, duration, least and largest increment.
fn timing(card: &Card<'_>, step: &mut Step, notes: &mut Vec<String>) -> Result<(), Fault> {
    card.only(&["SOLVER", "DIRECT"])?;
    if card.get("SOLVER").is_some() {
        notes.push(format!("line {}: SOLVER is not heeded; the program has its own", card.line));
    }
    let Some(row) = card.one_row()? else { return Ok(()) };
    let mut times = [None; 4];
    for (f, word) in row.fields().enumerate() {
        let slot = times.get_mut(f).ok_or_else(|| {
            row.fault("needed are: first increment, duration, least and largest increment")
        })?;
        if word.is_empty() {
            continue;
        }
        let time = row.number(word)?;
        if time < 0.0 {
            return Err(row.fault(format!("a time of {time} s")));
        }
        // 0: as the program sees fit.
        *slot = Some(time).filter(|&t| t > 0.0);
    }
    step.duration = times[1].unwrap_or(1.0);
    step.increments = [times[0], times[2], times[3]];
    Ok(())
}

fn is_new(card: &Card<'_>) -> Result<bool, Fault> {
    match card.word("OP").as_deref() {
        None | Some("MOD") => Ok(false),
        Some("NEW") => Ok(true),
        Some(other) => Err(card.fault(format!("OP={}: MOD and NEW are supported", quote(other)))),
    }
}

/// `OP=NEW` drops what earlier steps have left.
fn clear_if_new<K: Ord, T>(
    card: &Card<'_>,
    step: u32,
    map: &mut BTreeMap<K, Set<T>>,
) -> Result<(), Fault> {
    if is_new(card)? {
        map.retain(|_, s| s.step == step);
    }
    Ok(())
}

/// Sets a load; twice in one step is refused, because programs differ on whether that adds up.
fn replace<K: Ord, T>(
    map: &mut BTreeMap<K, Set<T>>,
    key: K,
    value: T,
    step: u32,
    row: Row<'_>,
    what: impl Fn() -> String,
) -> Result<(), Fault> {
    match map.insert(key, Set { value, line: row.line, step }) {
        Some(old) if old.step == step => Err(row.fault(format!(
            "{} already in line {}; programs differ on whether that adds up: give their sum once",
            what(),
            old.line
        ))),
        _ => Ok(()),
    }
}

fn fixed(force: &Force) -> Vec<Fixed> {
    force
        .fixed
        .iter()
        .map(|(&(node, component), s)| Fixed {
            node,
            component,
            value: s.value.0,
            amplitude: s.value.1,
        })
        .collect()
}

fn components(first: &str, last: &str, row: Row<'_>) -> Result<Vec<u8>, Fault> {
    let component = |word: &str| {
        match word.parse::<u8>() {
        Ok(c @ 1..=6) => Ok(c - 1),
        _ => {
            Err(row.fault(format!("{} is no component: 1–3 are displacements or forces, 4–6 rotations or moments of shells", quote(word))))
        }
    }
    };
    let (first, last) = (component(first)?, component(last)?);
    if first > last {
        Err(row.fault(format!(
            "the last component ({}) is before the first ({})",
            last + 1,
            first + 1
        )))
    } else {
        Ok((first..=last).collect())
    }
}

/// Supports that Abaqus has names for.
fn named_support(name: &str, row: Row<'_>) -> Result<Vec<u8>, Fault> {
    Ok(match name.to_ascii_uppercase().as_str() {
        "ENCASTRE" => vec![0, 1, 2, 3, 4, 5],
        "PINNED" => vec![0, 1, 2],
        "XSYMM" => vec![0, 4, 5],
        "YSYMM" => vec![1, 3, 5],
        "ZSYMM" => vec![2, 3, 4],
        _ => {
            return Err(row.fault(format!(
                "{} is no support; named ones are ENCASTRE, PINNED, XSYMM, YSYMM, ZSYMM",
                quote(name)
            )));
        }
    })
}
