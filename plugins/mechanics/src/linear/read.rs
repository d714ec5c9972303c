//! Cards of a deck to a [`Deck`].

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    path::Path,
};

use glam::DVec3;

use super::{
    link::Link,
    model::Deck,
    shape::Shape,
    steps::State,
    thin::{Profile, Rings, Thin},
};
use crate::read::{
    Fault, LabelMap, ReadError, Units,
    abaqus::{
        self,
        card::{Card, Row, cards},
    },
    label, quote,
};

/// Cards that are read, without their spaces.
const KNOWN: &str = "NODE ELEMENT NSET ELSET SURFACE MATERIAL ELASTIC DENSITY EXPANSION \
    CONDUCTIVITY SPECIFICHEAT SOLIDSECTION SHELLSECTION BEAMSECTION BEAMGENERALSECTION NORMAL \
    ORIENTATION AMPLITUDE TRANSFORM EQUATION TIE SPRING PHYSICALCONSTANTS INITIALCONDITIONS \
    BOUNDARY STEP STATIC FREQUENCY BUCKLE HEATTRANSFER CLOAD DLOAD DSLOAD TEMPERATURE CFLUX \
    DFLUX FILM RADIATE ENDSTEP";
/// Cards that only concern what is printed, beside those of every deck.
const OUTPUT: [&str; 2] = ["FACEPRINT", "TIMEPOINTS"];
/// What only says how CalculiX iterates.
const CONTROLS: &str = "CONTROLS";
/// Cards that only say how contact would behave: without contact they say nothing.
const CONTACT: [&str; 3] = ["SURFACEINTERACTION", "SURFACEBEHAVIOR", "FRICTION"];

/// Whether a deck has something in it that the reader of decks for members does not know, and so
/// this one is asked; concrete that cracks is known to that one alone.
#[must_use]
pub fn concerns(bytes: &[u8]) -> bool {
    let Ok(cards) = abaqus::text(bytes).and_then(cards) else { return false };
    if cards.iter().any(|card| card.is("CONCRETE DAMAGED PLASTICITY")) {
        return false;
    }
    cards.iter().any(|card| {
        !abaqus::knows(card)
            || card.is("PLASTIC")
            || card.get("ORIENTATION").is_some()
            || (card.is("ELEMENT")
                && !abaqus::knows_element(&card.word("TYPE").unwrap_or_default()))
    })
}

/// Reads a deck from memory; `name` is what errors call it.
///
/// # Errors
/// Everything that is damaged or not computed, in one line.
pub fn parse(bytes: &[u8], name: &Path, units: Units) -> Result<Deck, ReadError> {
    deck(bytes, units).map_err(|fault| fault.of(name))
}

fn deck(bytes: &[u8], units: Units) -> Result<Deck, Fault> {
    let cards = cards(abaqus::text(bytes)?)?;
    if cards.is_empty() {
        return Err(Fault::whole("no cards in it; a deck has lines like *NODE and *ELEMENT"));
    }
    let mut reader = Reader::new(units);
    reader.admit(&cards);
    reader.fail()?;
    // What names something comes after it, wherever it stands in the file.
    for pass in [Reader::meshed, Reader::grouped, Reader::material, Reader::section] {
        cards.iter().for_each(|card| {
            let read = pass(&mut reader, card);
            reader.keep(read);
        });
        reader.fail()?;
    }
    let made = reader.make();
    reader.keep(made);
    reader.fail()?;
    for card in &cards {
        let read = reader.linked(card);
        reader.keep(read);
    }
    let unlinked = reader.unlinked();
    reader.keep(unlinked);
    reader.fail()?;
    let mut state = State::default();
    for card in &cards {
        let read = reader.history(card, &mut state);
        reader.keep(read);
    }
    let ended = state.ended();
    reader.keep(ended);
    // Ties last: what is bound otherwise stays as it is.
    for pass in [Reader::equation, Reader::tie] {
        cards.iter().for_each(|card| {
            let read = pass(&mut reader, card);
            reader.keep(read);
        });
    }
    reader.fail()?;
    Ok(reader.finished())
}

/// What an element of the file is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Solid(Shape),
    Link(Link),
    Thin(Thin),
}

/// An element as the file has it.
#[derive(Debug, Clone)]
pub(super) struct Raw {
    pub(super) label: u32,
    pub(super) kind: Kind,
    pub(super) nodes: Vec<u32>,
    pub(super) section: Option<Section>,
    /// The solid that it has become.
    pub(super) cell: Option<u32>,
    pub(super) line: u32,
}

/// What an element is made of.
#[derive(Debug, Clone)]
pub(super) struct Section {
    pub(super) material: u32,
    pub(super) orientation: Option<u32>,
    /// Of shells, m; of bars, the area of their section.
    pub(super) thickness: f64,
    pub(super) profile: Profile,
}

/// What a surface is made of.
#[derive(Debug, Clone)]
pub(super) enum Surface {
    Nodes(Vec<u32>),
    Faces(Vec<(u32, u8)>),
}

/// What has been read so far.
pub(super) struct Reader {
    pub(super) units: Units,
    pub(super) deck: Deck,
    pub(super) nodes: LabelMap<u32>,
    pub(super) elements: LabelMap<u32>,
    pub(super) raw: Vec<Raw>,
    pub(super) node_sets: BTreeMap<String, Vec<u32>>,
    pub(super) element_sets: BTreeMap<String, Vec<u32>>,
    pub(super) surfaces: HashMap<String, Surface>,
    pub(super) materials: HashMap<String, u32>,
    pub(super) orientations: HashMap<String, u32>,
    pub(super) amplitudes: HashMap<String, crate::read::Amplitude>,
    /// Springs that are described.
    pub(super) sprung: BTreeSet<u32>,
    /// Nodes whose first three components are the angles of another.
    pub(super) turning: HashMap<u32, u32>,
    /// What nodes of beams and shells become.
    pub(super) rings: Rings,
    /// Normals of these that are given, by element and node.
    pub(super) normals: HashMap<(u32, u32), DVec3>,
    /// W/(m²·K⁴).
    pub(super) boltzmann: Option<f64>,
    pub(super) tied: bool,
    /// Places of equations by the component that comes first in them.
    pub(super) equations: BTreeMap<(u32, u8), usize>,
    /// Steps that end equations, all of them or those that a component comes first in.
    pub(super) ended: Vec<(u32, Option<(u32, u8)>)>,
    pub(super) in_material: bool,
    faults: Vec<Fault>,
}

impl Reader {
    fn new(units: Units) -> Self {
        Self {
            units,
            deck: Deck::default(),
            nodes: LabelMap::default(),
            elements: LabelMap::default(),
            raw: Vec::new(),
            node_sets: BTreeMap::new(),
            element_sets: BTreeMap::new(),
            surfaces: HashMap::new(),
            materials: HashMap::new(),
            orientations: HashMap::new(),
            amplitudes: HashMap::new(),
            sprung: BTreeSet::new(),
            turning: HashMap::new(),
            rings: Rings::default(),
            normals: HashMap::new(),
            boltzmann: None,
            tied: false,
            equations: BTreeMap::new(),
            ended: Vec::new(),
            in_material: false,
            faults: Vec::new(),
        }
    }

    fn keep(&mut self, read: Result<(), Fault>) {
        self.faults.extend(read.err());
    }

    /// What was made on the way has temperatures too.
    fn finished(mut self) -> Deck {
        for (step, first) in self.ended {
            let concerns = |at: &(u32, u8)| first.is_none_or(|first| first == *at);
            for (_, &place) in self.equations.iter().filter(|e| concerns(e.0)) {
                self.deck.until.entry(place).or_insert(step);
            }
        }
        let count = self.deck.nodes.len();
        let mut cold = std::mem::take(&mut self.deck.cold);
        cold.resize(count, 0.0);
        self.deck.spread(&mut cold);
        self.deck.cold = cold;
        let mut steps = std::mem::take(&mut self.deck.steps);
        for step in steps.iter_mut().filter(|s| !s.warm.is_empty()) {
            step.warm.resize(count, 0.0);
            self.deck.spread(&mut step.warm);
        }
        self.deck.steps = steps;
        self.deck
    }

    /// All faults so far as one.
    fn fail(&mut self) -> Result<(), Fault> {
        Fault::all(std::mem::take(&mut self.faults))
    }

    /// Names all that is not computed, each once.
    fn admit(&mut self, cards: &[Card<'_>]) {
        self.tied = cards.iter().any(|c| c.is("TIE"));
        let has_contact = cards.iter().any(|c| c.is("CONTACT PAIR") || c.is("CLEARANCE"));
        let mut seen = BTreeSet::new();
        for card in cards {
            let name = plain(card);
            let what = if name == "ELEMENT" {
                let kind = card.word("TYPE").unwrap_or_default();
                if super::mesh::kind(&kind).is_some() || !seen.insert(kind.clone()) {
                    continue;
                }
                format!("elements of type {} are not computed", quote(&kind))
            } else {
                let idle = CONTACT.contains(&name.as_str()) && !has_contact;
                let known = KNOWN.split_ascii_whitespace().any(|known| known == name);
                let idle = idle
                    || name == CONTROLS
                    || OUTPUT.contains(&name.as_str())
                    || abaqus::is_output(card);
                if known || idle || !seen.insert(name) {
                    continue;
                }
                format!("*{} is not computed", quote(&card.name).trim_matches('"'))
            };
            self.faults.push(card.fault(what));
        }
        if let Some(last) = self.faults.last_mut() {
            last.reason +=
                "; static loads, free vibrations, buckling and heat of elastic structures are";
        }
    }

    pub(super) fn node(&self, word: &str, row: Row<'_>) -> Result<u32, Fault> {
        let label = label(word).map_err(|e| row.fault(e))?;
        self.nodes.get(label).ok_or_else(|| row.fault(format!("node {label} is not defined")))
    }

    /// A node, or a set of them.
    pub(super) fn some_nodes(&self, word: &str, row: Row<'_>) -> Result<Vec<u32>, Fault> {
        if is_number(word) {
            return Ok(vec![self.node(word, row)?]);
        }
        let undefined = || row.fault(format!("node set {} is not defined", quote(word)));
        self.node_sets.get(&word.to_ascii_uppercase()).cloned().ok_or_else(undefined)
    }

    /// An element, or a set of them.
    pub(super) fn some_elements(&self, word: &str, row: Row<'_>) -> Result<Vec<u32>, Fault> {
        if is_number(word) {
            let label = label(word).map_err(|e| row.fault(e))?;
            let found = self.elements.get(label);
            let undefined = || row.fault(format!("element {label} is not defined"));
            return Ok(vec![found.ok_or_else(undefined)?]);
        }
        let undefined = || row.fault(format!("element set {} is not defined", quote(word)));
        self.element_sets.get(&word.to_ascii_uppercase()).cloned().ok_or_else(undefined)
    }
}

/// The card's name without its spaces, as CalculiX reads it.
pub(super) fn plain(card: &Card<'_>) -> String {
    card.name.replace(' ', "")
}

fn is_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
}
