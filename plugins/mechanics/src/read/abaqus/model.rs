//! Nodes, elements, sets, surfaces.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    Card, Fault, LabelMap, Reader,
    card::{Row, side_number},
};
use crate::{
    mesh::{Cell, ElementId},
    read::{Formulation, label, quote},
};

/// Nodes or elements of a deck.
const MAX_COUNT: usize = 100_000_000;

/// Types of elements.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Hex(Formulation),
    Shell,
    Rod,
}

/// A label, node labels, the line. Node labels wait until all nodes are known.
type Raw<const N: usize> = Vec<(u32, [u32; N], u32)>;

#[derive(Default)]
struct Elements {
    hexes: Raw<8>,
    shells: Raw<4>,
    rods: Raw<2>,
    /// Sets named on `*ELEMENT`.
    sets: BTreeMap<String, Vec<u32>>,
}

impl Reader {
    /// Nodes, then elements.
    pub(super) fn mesh(&mut self, cards: &[Card<'_>]) -> Result<(), Fault> {
        let mut labels = Vec::new();
        let mut node_sets: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for card in cards.iter().filter(|c| c.is("NODE")) {
            let first = labels.len();
            self.read_nodes(card, &mut labels)?;
            if let Some(set) = set_name(card, "NSET")? {
                node_sets.entry(set).or_default().extend(first as u32..labels.len() as u32);
            }
        }
        let pairs = (0u32..).zip(&labels).map(|(i, &l)| (l, i)).collect();
        self.nodes = LabelMap::new(pairs)
            .map_err(|twice| self.twice("node", twice, &labels, &self.lines.nodes))?;
        self.deck.mesh.labels.nodes = labels;
        self.node_sets = node_sets;

        let mut elements = Elements::default();
        for card in cards.iter().filter(|c| c.is("ELEMENT")) {
            self.read_elements(card, &mut elements)?;
        }
        if elements.hexes.is_empty() && elements.shells.is_empty() && elements.rods.is_empty() {
            return Err(Fault::whole(
                "no elements: a deck needs *NODE and *ELEMENT, TYPE=C3D8I (or C3D8, C3D8R, T3D2, S4, S4R)",
            ));
        }
        self.place_elements(elements)
    }

    fn read_nodes(&mut self, card: &Card<'_>, labels: &mut Vec<u32>) -> Result<(), Fault> {
        card.only(&["NSET", "SYSTEM"])?;
        let cylindrical = match card.word("SYSTEM").as_deref() {
            None | Some("R") => false,
            Some("C") => true,
            Some(other) => {
                return Err(card.fault(format!(
                    "SYSTEM={}: R (rectangular) and C (cylindrical) are supported",
                    quote(other)
                )));
            }
        };
        let scale = self.units.length();
        for row in card.rows() {
            let [number, x, y, z] = row.exactly("node, x, y, z")?;
            labels.push(label(number).map_err(|e| row.fault(e))?);
            let p = DVec3::new(row.number(x)?, row.number(y)?, row.number(z)?);
            // r, θ in degrees, z.
            let p = if cylindrical {
                let (s, c) = p.y.to_radians().sin_cos();
                DVec3::new(p.x * c, p.x * s, p.z)
            } else {
                p
            };
            self.deck.mesh.nodes.push(scale * p);
            self.lines.nodes.push(row.line);
            if labels.len() > MAX_COUNT {
                return Err(row.fault(format!("more than {MAX_COUNT} nodes")));
            }
        }
        Ok(())
    }

    fn read_elements(&mut self, card: &Card<'_>, elements: &mut Elements) -> Result<(), Fault> {
        card.only(&["TYPE", "ELSET"])?;
        let name = card.need("TYPE")?;
        let kind = match name.as_str() {
            "C3D8" => Kind::Hex(Formulation::Full),
            "C3D8I" => Kind::Hex(Formulation::Incompatible),
            "C3D8R" => {
                self.deck.notes.push(format!(
                    "line {}: C3D8R is computed as C3D8I (no hourglass modes to control)",
                    card.line
                ));
                Kind::Hex(Formulation::Incompatible)
            }
            "S4" | "S4R" => {
                if name == "S4R" {
                    self.deck
                        .notes
                        .push(format!("line {}: S4R is computed as S4 (MITC4)", card.line));
                }
                Kind::Shell
            }
            "T3D2" => Kind::Rod,
            _ => {
                return Err(card.fault(format!(
                    "elements of type {} are not supported; supported are C3D8, C3D8I, C3D8R, T3D2, S4, S4R",
                    quote(&name)
                )));
            }
        };
        let set = set_name(card, "ELSET")?;
        let mut members = Vec::new();
        let mut rows = card.rows();
        while let Some(row) = rows.next() {
            let number = match kind {
                Kind::Hex(formulation) => {
                    self.deck.formulations.push(formulation);
                    element(row, &mut rows, &mut elements.hexes)?
                }
                Kind::Shell => element(row, &mut rows, &mut elements.shells)?,
                Kind::Rod => element(row, &mut rows, &mut elements.rods)?,
            };
            members.push(number);
        }
        if let Some(set) = set {
            elements.sets.entry(set).or_default().extend(members);
        }
        Ok(())
    }

    /// Node labels to nodes, now that all are known.
    fn place_elements(&mut self, elements: Elements) -> Result<(), Fault> {
        let mut pairs = Vec::new();
        let mut lines = Vec::new();
        let Self { nodes, deck, lines: of, .. } = self;
        let mesh = &mut deck.mesh;
        place(&elements.hexes, nodes, ElementId::Hex, &mut mesh.hexes, &mut pairs, &mut lines)?;
        place(&elements.shells, nodes, ElementId::Shell, &mut mesh.shells, &mut pairs, &mut lines)?;
        place(&elements.rods, nodes, ElementId::Rod, &mut mesh.rods, &mut pairs, &mut lines)?;
        let (h, s) = (elements.hexes.len(), elements.shells.len());
        let labels: Vec<u32> = pairs.iter().map(|p| p.0).collect();
        (mesh.labels.hexes, mesh.labels.shells, mesh.labels.rods) =
            (labels[..h].to_vec(), labels[h..h + s].to_vec(), labels[h + s..].to_vec());
        (of.hexes, of.shells, of.rods) =
            (lines[..h].to_vec(), lines[h..h + s].to_vec(), lines[h + s..].to_vec());
        self.elements =
            LabelMap::new(pairs).map_err(|twice| self.twice("element", twice, &labels, &lines))?;
        for (name, members) in elements.sets {
            let mut members: Vec<ElementId> =
                members.into_iter().filter_map(|l| self.elements.get(l)).collect();
            members.sort_unstable();
            members.dedup();
            self.element_sets.insert(name, members);
        }
        Ok(())
    }

    /// Names the second of two lines with the same number.
    fn twice(&self, what: &str, twice: u32, labels: &[u32], lines: &[u32]) -> Fault {
        let mut at: Vec<u32> =
            labels.iter().zip(lines).filter(|(l, _)| **l == twice).map(|(_, line)| *line).collect();
        at.sort_unstable();
        let (first, second) = (at.first().copied().unwrap_or(0), at.get(1).copied().unwrap_or(0));
        Fault::at(
            second,
            format!("{what} {twice} is defined a second time; the first is in line {first}"),
        )
    }

    /// Sets and surfaces, in the order of the file: a set may name earlier ones.
    pub(super) fn sets(&mut self, cards: &[Card<'_>]) -> Result<(), Fault> {
        for card in cards {
            match card.name.as_str() {
                "NSET" => self.node_set(card)?,
                "ELSET" => self.element_set(card)?,
                "SURFACE" => self.surface(card)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn node_set(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NSET", "GENERATE", "UNSORTED", "ELSET"])?;
        let name = card.need("NSET")?;
        let mut set = self.node_sets.get(&name).cloned().unwrap_or_default();
        if let Some(from) = card.get("ELSET") {
            card.no_rows()?;
            for element in self.target_elements(from, card.line)? {
                let mesh = &self.deck.mesh;
                match element {
                    ElementId::Hex(i) => set.extend(mesh.hexes[i as usize].nodes),
                    ElementId::Shell(i) => set.extend(mesh.shells[i as usize].nodes),
                    ElementId::Rod(i) => set.extend(mesh.rods[i as usize].nodes),
                    ElementId::Interface(_) => {}
                }
            }
        }
        for row in card.rows() {
            if card.get("GENERATE").is_some() {
                let chosen = generate(&self.nodes, row)?;
                self.spend(chosen.len(), row.line)?;
                set.extend(chosen);
                continue;
            }
            for word in row.fields() {
                let more = self.target_nodes(word, row.line)?;
                set.extend(more);
            }
        }
        set.sort_unstable();
        set.dedup();
        if set.is_empty() {
            return Err(card.fault(format!("node set {name} is empty")));
        }
        self.spend(set.len(), card.line)?;
        self.node_sets.insert(name, set);
        Ok(())
    }

    fn element_set(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "GENERATE", "UNSORTED"])?;
        let name = card.need("ELSET")?;
        let mut set = self.element_sets.get(&name).cloned().unwrap_or_default();
        for row in card.rows() {
            if card.get("GENERATE").is_some() {
                let chosen = generate(&self.elements, row)?;
                self.spend(chosen.len(), row.line)?;
                set.extend(chosen);
                continue;
            }
            for word in row.fields() {
                let more = self.target_elements(word, row.line)?;
                set.extend(more);
            }
        }
        set.sort_unstable();
        set.dedup();
        if set.is_empty() {
            return Err(card.fault(format!("element set {name} is empty")));
        }
        self.spend(set.len(), card.line)?;
        self.element_sets.insert(name, set);
        Ok(())
    }

    fn surface(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "TYPE"])?;
        let name = card.need("NAME")?;
        if card.word("TYPE").is_some_and(|t| t != "ELEMENT") {
            return Err(card.fault("*SURFACE: only TYPE=ELEMENT is supported; for nodes use *NSET"));
        }
        if self.surfaces.contains_key(&name) {
            return Err(card.fault(format!("surface {name} is defined a second time")));
        }
        let mut faces = Vec::new();
        for row in card.rows() {
            let [target, side] = row.exactly("element or element set, S1 to S6 (shells: SPOS)")?;
            for element in self.target_elements(target, row.line)? {
                faces.push((element, self.face_of(element, side, "S", row)?));
            }
        }
        if faces.is_empty() {
            return Err(card.fault(format!("surface {name} is empty")));
        }
        self.surfaces.insert(name, faces);
        Ok(())
    }

    /// Local face of `S3` or `P3` (by `letter`).
    pub(super) fn face_of(
        &self,
        element: ElementId,
        side: &str,
        letter: &str,
        row: Row<'_>,
    ) -> Result<u8, Fault> {
        let upper = side.to_ascii_uppercase();
        match (element, side_number(side, letter)) {
            (ElementId::Hex(_), Some(face @ 1..=6)) => Ok(face - 1),
            (ElementId::Shell(_), _) if upper == "SPOS" || upper == "P" => Ok(0),
            _ => Err(row.fault(format!(
                "{} has no side {}; hexahedra have {letter}1 to {letter}6",
                self.deck.mesh.name(element),
                quote(side)
            ))),
        }
    }
}

/// An element of one line, or of several where a line ends in a comma.
fn element<'a, const N: usize>(
    row: Row<'a>,
    rows: &mut impl Iterator<Item = Row<'a>>,
    elements: &mut Raw<N>,
) -> Result<u32, Fault> {
    let mut nodes = [0; N];
    let (mut number, mut count, mut current) = (0, 0, row);
    loop {
        for (f, word) in current.fields().enumerate() {
            let value = label(word).map_err(|e| current.fault(e))?;
            if count == 0 && f == 0 && number == 0 {
                number = value;
            } else if let Some(slot) = nodes.get_mut(count) {
                *slot = value;
                count += 1;
            } else {
                return Err(current.fault(format!("more than {N} nodes in element {number}")));
            }
        }
        if count == N {
            break;
        }
        current = match rows.next() {
            Some(next) if current.text.ends_with(',') => next,
            _ => return Err(current.fault(format!("element {number} has {count} nodes, not {N}"))),
        };
    }
    if elements.len() == MAX_COUNT {
        return Err(row.fault(format!("more than {MAX_COUNT} elements")));
    }
    elements.push((number, nodes, row.line));
    Ok(number)
}

fn place<const N: usize>(
    raw: &Raw<N>,
    nodes: &LabelMap<u32>,
    id: impl Fn(u32) -> ElementId,
    cells: &mut Vec<Cell<N>>,
    pairs: &mut Vec<(u32, ElementId)>,
    lines: &mut Vec<u32>,
) -> Result<(), Fault> {
    cells.reserve(raw.len());
    for &(number, labels, line) in raw {
        let mut found = [0; N];
        for (slot, label) in found.iter_mut().zip(labels) {
            *slot = nodes.get(label).ok_or_else(|| {
                Fault::at(line, format!("element {number}: node {label} is not defined"))
            })?;
        }
        pairs.push((number, id(cells.len() as u32)));
        lines.push(line);
        // The region is that of the section, which comes later.
        cells.push(Cell { nodes: found, region: u32::MAX });
    }
    Ok(())
}

/// `first, last, increment`: all that exist.
fn generate<T: Copy>(map: &LabelMap<T>, row: Row<'_>) -> Result<Vec<T>, Fault> {
    let mut fields = row.fields();
    let mut next = |what: &str| {
        label(fields.next().unwrap_or_default())
            .map_err(|e| row.fault(format!("{e} ({what} of GENERATE: first, last, increment)")))
    };
    let (first, last) = (next("first")?, next("last")?);
    let step = if row.fields().count() > 2 { next("increment")? } else { 1 };
    if last < first || row.fields().count() > 3 {
        return Err(row.fault("GENERATE needs: first, last, increment, with last not below first"));
    }
    let found: Vec<T> = map
        .range(first, last)
        .iter()
        .filter(|(l, _)| (l - first) % step == 0)
        .map(|p| p.1)
        .collect();
    if found.is_empty() {
        Err(row.fault(format!("none of {first} to {last} by {step} is defined")))
    } else {
        Ok(found)
    }
}

fn set_name(card: &Card<'_>, parameter: &str) -> Result<Option<String>, Fault> {
    card.get(parameter).map(|_| card.need(parameter)).transpose()
}
