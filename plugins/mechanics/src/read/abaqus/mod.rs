//! Decks of Abaqus and CalculiX (`.inp`).
//!
//! Cards are found first, then read in the order that their meaning asks for: nodes and elements,
//! sets, materials, sections, then supports, loads and steps. What is understood:
//!
//! | subject | cards |
//! |---|---|
//! | mesh | `*NODE` (also `SYSTEM=C`), `*ELEMENT` (C3D8, C3D8I, C3D8R, T3D2, S4, S4R), `*NSET`, `*ELSET` (also `GENERATE`), `*SURFACE` |
//! | materials | `*MATERIAL`, `*ELASTIC`, `*DENSITY`, `*EXPANSION`, `*CONDUCTIVITY`, `*SPECIFIC HEAT`, `*SOLID SECTION`, `*SHELL SECTION` |
//! | concrete that cracks | `*CONCRETE DAMAGED PLASTICITY` with `*CONCRETE COMPRESSION HARDENING`, `*CONCRETE TENSION STIFFENING`, and tables of damage, which are not heeded; `*PLASTIC` of bars |
//! | state | `*INITIAL CONDITIONS` (`STRESS`, `TEMPERATURE`), `*EMBEDDED ELEMENT`, `*AMPLITUDE` |
//! | steps | `*STEP`, `*STATIC`, `*BOUNDARY`, `*CLOAD`, `*DLOAD` (P, P1–P6, GRAV), `*DSLOAD` (P),
//! `*TEMPERATURE`, `*MODEL CHANGE`, `*END STEP` |
//! | noted | `*HEADING` and cards of output |
//!
//! Names are compared without regard to case. The Abaqus order 11, 22, 33, 12, 13, 23 of stresses
//! becomes ours.

pub(crate) mod card;
mod concrete;
mod load;
mod model;
mod property;

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    path::Path,
};

use super::{Deck, Fault, LabelMap, MAX_ENTRIES, ReadError, Units, bytes, label, quote};
use crate::mesh::{ElementId, HexFace, Subject};
use card::{Card, cards};

/// Every card that is understood, for messages.
const SUPPORTED: &str = "*NODE, *ELEMENT, *NSET, *ELSET, *SURFACE, *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION, *CONDUCTIVITY, \
    *SPECIFIC HEAT, *PLASTIC, *CONCRETE DAMAGED PLASTICITY, *CONCRETE COMPRESSION HARDENING, *CONCRETE TENSION STIFFENING, \
    *CONCRETE COMPRESSION DAMAGE, *CONCRETE TENSION DAMAGE, *SOLID SECTION, *SHELL SECTION, *AMPLITUDE, *INITIAL CONDITIONS, *EMBEDDED ELEMENT, *BOUNDARY, *CLOAD, *DLOAD, \
    *DSLOAD, *TEMPERATURE, *MODEL CHANGE, *STEP, *STATIC, *END STEP and cards of output";

/// Cards that only concern what is printed.
const OUTPUT: [&str; 22] = [
    "HEADING",
    "PREPRINT",
    "RESTART",
    "OUTPUT",
    "NODE OUTPUT",
    "ELEMENT OUTPUT",
    "ENERGY OUTPUT",
    "CONTACT OUTPUT",
    "NODE PRINT",
    "NODE FILE",
    "EL PRINT",
    "EL FILE",
    "ELEMENT PRINT",
    "ELEMENT FILE",
    "CONTACT PRINT",
    "CONTACT FILE",
    "ENERGY PRINT",
    "ENERGY FILE",
    "SECTION PRINT",
    "SECTION FILE",
    "FILE FORMAT",
    "MONITOR",
];

/// Types of elements that are read.
const ELEMENTS: [&str; 6] = ["C3D8", "C3D8I", "C3D8R", "T3D2", "S4", "S4R"];

/// Whether a card only concerns what is printed.
pub(crate) fn is_output(card: &Card<'_>) -> bool {
    OUTPUT.contains(&card.name.as_str())
}

/// Whether this reader understands a card.
pub(crate) fn knows(card: &Card<'_>) -> bool {
    let named = |s: &str| s.strip_prefix('*') == Some(card.name.as_str());
    is_output(card) || SUPPORTED.split(", ").flat_map(|part| part.split(" and ")).any(named)
}

/// Whether this reader takes elements of a type.
pub(crate) fn knows_element(name: &str) -> bool {
    ELEMENTS.contains(&name)
}

/// Reads a deck.
///
/// # Errors
/// The file is missing, or something in it is damaged, contradictory, beyond the limits, or not
/// supported: named with its line.
pub fn read(path: &Path, units: Units) -> Result<Deck, ReadError> {
    parse(&bytes(path)?, path, units)
}

/// Reads a deck from memory; `name` is what errors call it.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], name: &Path, units: Units) -> Result<Deck, ReadError> {
    deck(bytes, units).map_err(|fault| fault.of(name))
}

fn deck(bytes: &[u8], units: Units) -> Result<Deck, Fault> {
    let text = text(bytes)?;
    let cards = cards(text)?;
    if cards.is_empty() {
        return Err(Fault::whole("no cards in it; a deck has lines like *NODE and *ELEMENT"));
    }
    let mut reader = Reader::new(units);
    cards.iter().try_for_each(|card| reader.admit(card))?;
    reader.mesh(&cards)?;
    reader.sets(&cards)?;
    reader.materials(&cards)?;
    reader.sections(&cards)?;
    reader.history(&cards)?;
    reader.finish()
}

/// The file as text; a byte that is none is named by its line.
pub(crate) fn text(bytes: &[u8]) -> Result<&str, Fault> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let line = |end: usize| 1 + bytes[..end].iter().filter(|&&b| b == b'\n').count() as u32;
    if let Some(zero) = bytes.iter().position(|&b| b == 0) {
        return Err(Fault::at(line(zero), "a zero byte: this is no text, and so no deck"));
    }
    std::str::from_utf8(bytes).map_err(|e| {
        Fault::at(line(e.valid_up_to()), "not UTF-8 text: save the deck as plain ASCII or UTF-8")
    })
}

/// What has been read so far.
struct Reader {
    units: Units,
    deck: Deck,
    nodes: LabelMap<u32>,
    elements: LabelMap<ElementId>,
    /// Line of each hexahedron, shell, rod, and of each node.
    lines: Lines,
    element_sets: BTreeMap<String, Vec<ElementId>>,
    node_sets: BTreeMap<String, Vec<u32>>,
    surfaces: BTreeMap<String, Vec<(ElementId, u8)>>,
    materials: HashMap<String, u32>,
    amplitudes: HashMap<String, u32>,
    /// Elements with an initial stress, and the line that gave it.
    stressed: HashMap<ElementId, u32>,
    initial_temperature: BTreeMap<u32, f64>,
    embedded_rods: HashSet<u32>,
    /// What sets and loads may still expand to.
    left: usize,
    /// Cards that were skipped: name, first line, how many.
    skipped: BTreeMap<String, (u32, u32)>,
}

fn is_number(word: &str) -> bool {
    word.is_empty() || word.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
}

#[derive(Default)]
struct Lines {
    nodes: Vec<u32>,
    hexes: Vec<u32>,
    shells: Vec<u32>,
    rods: Vec<u32>,
}

impl Reader {
    fn new(units: Units) -> Self {
        Self {
            units,
            deck: Deck::default(),
            nodes: LabelMap::default(),
            elements: LabelMap::default(),
            lines: Lines::default(),
            element_sets: BTreeMap::new(),
            node_sets: BTreeMap::new(),
            surfaces: BTreeMap::new(),
            materials: HashMap::new(),
            amplitudes: HashMap::new(),
            stressed: HashMap::new(),
            initial_temperature: BTreeMap::new(),
            embedded_rods: HashSet::new(),
            left: MAX_ENTRIES,
            skipped: BTreeMap::new(),
        }
    }

    /// Refuses a card that nobody understands, before anything is computed from the others.
    fn admit(&mut self, card: &Card) -> Result<(), Fault> {
        let name = card.name.as_str();
        if is_output(card) {
            self.skipped.entry(card.name.clone()).or_insert((card.line, 0)).1 += 1;
            return Ok(());
        }
        match name {
            _ if knows(card) => Ok(()),
            "INCLUDE" => Err(card.fault("*INCLUDE is not followed: put the other file's lines here")),
            "PART" | "ASSEMBLY" | "INSTANCE" | "END PART" | "END ASSEMBLY" | "END INSTANCE" => {
                Err(card
                    .fault(format!("*{name}: parts and instances are not supported; write a flat input file (a setting of Abaqus/CAE)")))
            }
            _ => Err(card.fault(format!("*{} is not supported; supported are {SUPPORTED}", quote(name).trim_matches('"')))),
        }
    }

    /// Takes `count` entries from what the file may expand to.
    fn spend(&mut self, count: usize, line: u32) -> Result<(), Fault> {
        self.left = self.left.checked_sub(count).ok_or_else(|| {
            Fault::at(line, format!("sets and loads expand to more than {MAX_ENTRIES} entries"))
        })?;
        Ok(())
    }

    fn node(&self, word: &str, line: u32) -> Result<u32, Fault> {
        let label = label(word).map_err(|e| Fault::at(line, e))?;
        self.nodes.get(label).ok_or_else(|| Fault::at(line, format!("node {label} is not defined")))
    }

    fn element(&self, word: &str, line: u32) -> Result<ElementId, Fault> {
        let label = label(word).map_err(|e| Fault::at(line, e))?;
        self.elements
            .get(label)
            .ok_or_else(|| Fault::at(line, format!("element {label} is not defined")))
    }

    /// A node set or a node. Names of sets do not begin with a digit.
    fn target_nodes(&mut self, word: &str, line: u32) -> Result<Vec<u32>, Fault> {
        if is_number(word) {
            return Ok(vec![self.node(word, line)?]);
        }
        let undefined = || Fault::at(line, format!("node set {} is not defined", quote(word)));
        let set = self.node_sets.get(&word.to_ascii_uppercase()).cloned().ok_or_else(undefined)?;
        self.spend(set.len(), line)?;
        Ok(set)
    }

    /// An element set or an element.
    fn target_elements(&mut self, word: &str, line: u32) -> Result<Vec<ElementId>, Fault> {
        if is_number(word) {
            return Ok(vec![self.element(word, line)?]);
        }
        let undefined = || Fault::at(line, format!("element set {} is not defined", quote(word)));
        let set =
            self.element_sets.get(&word.to_ascii_uppercase()).cloned().ok_or_else(undefined)?;
        self.spend(set.len(), line)?;
        Ok(set)
    }

    fn finish(mut self) -> Result<Deck, Fault> {
        let surfaces = std::mem::take(&mut self.surfaces);
        for (name, faces) in surfaces {
            let faces = faces.into_iter().filter_map(|(e, face)| {
                if let ElementId::Hex(hex) = e { Some(HexFace { hex, face }) } else { None }
            });
            self.deck.mesh.face_sets.insert(name, faces.collect());
        }
        self.deck.initial_temperature =
            std::mem::take(&mut self.initial_temperature).into_iter().collect();
        self.deck.mesh.node_sets = self.node_sets;
        self.deck.mesh.element_sets = self.element_sets;
        let notes = self
            .deck
            .mesh
            .check()
            .map_err(|e| Fault { line: self.lines.of(e.subject), reason: e.reason })?;
        self.deck.notes.extend(notes);
        for (name, (line, count)) in self.skipped {
            let more = if count > 1 { format!(" and {} more", count - 1) } else { String::new() };
            self.deck
                .notes
                .push(format!("line {line}{more}: *{name} only concerns output and was skipped"));
        }
        if self.deck.steps.is_empty() {
            self.deck.notes.push("no *STEP: the deck has no loads".into());
        }
        Ok(self.deck)
    }
}

impl Lines {
    fn of(&self, subject: Subject) -> Option<u32> {
        let (lines, i) = match subject {
            Subject::Node(n) => (&self.nodes, n),
            Subject::Element(ElementId::Hex(i)) => (&self.hexes, i),
            Subject::Element(ElementId::Shell(i)) => (&self.shells, i),
            Subject::Element(ElementId::Rod(i)) => (&self.rods, i),
            Subject::Element(ElementId::Interface(_)) | Subject::Whole => return None,
        };
        lines.get(i as usize).copied()
    }
}

#[cfg(test)]
mod tests;
