//! What joins nodes without a solid: springs, rigid bodies, mean rotations, loads shared among
//! nodes, and cuts that are pulled together.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::{
    constraint::Equation,
    curve::{Curve, Curved, terms},
    matter::all_numbers,
    mesh::name_of,
    model::{Gap, Spring},
    read::{Kind, Reader, Surface, plain},
};
use crate::read::{
    Fault,
    abaqus::card::{Card, Row},
    quote,
};

/// What joins nodes and has a number as elements have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Link {
    /// SPRINGA: along the line between two nodes.
    Between,
    /// SPRING1: a component of a node to the ground.
    Ground,
    /// SPRING2: a component of one node to a component of another.
    Components,
    /// A B31 that a `*PRE-TENSION SECTION` stands for.
    Bolt,
    /// GAPUNI: bears along a direction once two nodes have come near.
    Gap,
}

impl Link {
    pub(super) fn of(name: &str) -> Option<Self> {
        match name {
            "SPRINGA" => Some(Self::Between),
            "SPRING1" => Some(Self::Ground),
            "SPRING2" => Some(Self::Components),
            "GAPUNI" => Some(Self::Gap),
            _ => None,
        }
    }

    pub(super) fn nodes(self) -> usize {
        match self {
            Self::Between | Self::Components | Self::Gap | Self::Bolt => 2,
            Self::Ground => 1,
        }
    }
}

impl Reader {
    pub(super) fn linked(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        match plain(card).as_str() {
            "SPRING" => self.spring(card),
            "GAP" => self.gap(card),
            _ => Ok(()),
        }
    }

    fn spring(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "NONLINEAR"])?;
        let elements = self.named_elements(card)?;
        let rows: Vec<Row<'_>> = card.rows().collect();
        let first = rows.first().ok_or_else(|| card.fault("needed is: stiffness"))?;
        let law = if card.get("NONLINEAR").is_some() { self.law(card)? } else { Vec::new() };
        for element in elements {
            let raw = self.raw[element as usize].clone();
            let Kind::Link(link @ (Link::Between | Link::Ground | Link::Components)) = raw.kind
            else {
                return Err(card.fault(format!("element {} is no spring", raw.label)));
            };
            if !law.is_empty() && link != Link::Between {
                return Err(card.fault("NONLINEAR is of SPRINGA"));
            }
            let components = match link {
                Link::Between => Vec::new(),
                _ => first.fields().map(|w| direction(w, *first)).collect::<Result<_, _>>()?,
            };
            let data = if link == Link::Between { first } else { rows.last().unwrap_or(first) };
            let word = data.fields().next().unwrap_or_default();
            let stiffness = data.number(word)? * self.units.stress() * self.units.length();
            let terms = self.spring_terms(&raw.nodes, link, &components);
            let terms = terms.ok_or_else(|| {
                card.fault(format!("spring {} has no length, or no component", raw.label))
            })?;
            let ends: Option<[u32; 2]> =
                raw.nodes.as_slice().try_into().ok().filter(|_| link == Link::Between);
            let law = law.clone();
            self.deck.springs.push(Spring { terms, ends, stiffness, law, gap: None });
            self.sprung.insert(element);
        }
        Ok(())
    }

    /// Force and elongation, line by line, to elongation and force.
    fn law(&self, card: &Card<'_>) -> Result<Vec<(f64, f64)>, Fault> {
        let mut law = Vec::new();
        for row in card.rows() {
            let [force, longer] = row.exactly("force, elongation")?;
            let force = row.number(force)? * self.units.stress() * self.units.length().powi(2);
            law.push((row.number(longer)? * self.units.length(), force));
        }
        let ascends = law.len() > 1 && law.is_sorted_by(|a, b| a.0 < b.0);
        ascends.then_some(law).ok_or_else(|| card.fault("needed are two elongations, ascending"))
    }

    /// How wide it is, the direction in which it opens, stiffness once it has closed, and the pull
    /// where it is far open.
    fn gap(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET"])?;
        let what = "clearance, x, y, z of the direction, , stiffness, pull";
        let row = card.one_row()?.ok_or_else(|| card.fault(format!("needed are: {what}")))?;
        let words: Vec<&str> = row.fields().collect();
        let number = |i: usize, usual: f64| match words.get(i) {
            Some(word) if !word.is_empty() => row.number(word),
            _ => Ok(usual),
        };
        let direction = DVec3::new(number(1, 0.0)?, number(2, 0.0)?, number(3, 0.0)?);
        let direction = direction.try_normalize().ok_or_else(|| row.fault("no direction"))?;
        let (stiffness, pull) = (number(5, 1e12)?, number(6, 1e-3)?);
        if words.len() > 7 || stiffness.is_nan() || stiffness <= 0.0 || pull.is_nan() || pull <= 0.0
        {
            return Err(row.fault(format!("needed are: {what}, the last two above 0")));
        }
        let length = self.units.length();
        let gap = Gap {
            clearance: number(0, 0.0)? * length,
            stiffness: stiffness * self.units.stress() * length,
            pull: pull * self.units.stress() * length * length,
        };
        for element in self.named_elements(card)? {
            let raw = &self.raw[element as usize];
            let (Kind::Link(Link::Gap), &[a, b]) = (raw.kind, raw.nodes.as_slice()) else {
                return Err(card.fault(format!("element {} is no GAPUNI", raw.label)));
            };
            let terms = terms(&[(a, -direction), (b, direction)]);
            let (ends, stiffness, law, gap) = (None, 0.0, Vec::new(), Some(gap));
            self.deck.springs.push(Spring { terms, ends, stiffness, law, gap });
            self.sprung.insert(element);
        }
        Ok(())
    }

    fn spring_terms(&self, nodes: &[u32], link: Link, by: &[u8]) -> Option<Vec<(u32, f64)>> {
        let signed = |n: u32, c: u8, s: f64| {
            self.deck.component(n, c).into_iter().map(move |(u, f)| (u, s * f))
        };
        match (link, nodes) {
            (Link::Between, &[a, b]) => {
                let along = self.deck.nodes[b as usize] - self.deck.nodes[a as usize];
                let along = along.try_normalize()?;
                Some(terms(&[(nodes[0], -along), (nodes[1], along)]))
            }
            (Link::Ground, &[a]) => Some(signed(a, *by.first()?, 1.0).collect()),
            (Link::Components, &[a, b]) => {
                let (first, second) = (*by.first()?, *by.get(1).or(by.first())?);
                Some(signed(a, first, 1.0).chain(signed(b, second, -1.0)).collect())
            }
            _ => None,
        }
    }

    /// Adds a constraint that is another where displacements are large, unless its nodes are too
    /// few to say anything.
    pub(super) fn bound(&mut self, curve: Curve, line: u32) -> bool {
        let curved = Curved { curve, first: self.deck.equations.len(), line };
        let Some(equations) = curved.equations(&self.deck.nodes, |_| 0.0) else { return false };
        self.deck.equations.extend(equations);
        self.deck.curved.push(curved);
        true
    }

    /// `*PRE-TENSION SECTION`: the nodes of a surface are doubled. Elements on its side move as
    /// those beyond it do, and by the first component of a node farther along the normal.
    pub(super) fn cut(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        if plain(card) != "PRE-TENSIONSECTION" {
            return Ok(());
        }
        card.only(&["SURFACE", "ELEMENT", "NODE"])?;
        let row = Row { line: card.line, text: "" };
        let pilot = self.node(&card.need("NODE")?, row)?;
        let axis = match all_numbers(card)?.as_slice() {
            &[x, y, z] => DVec3::new(x, y, z).try_normalize(),
            _ => None,
        };
        let axis = axis.ok_or_else(|| card.fault("needed are: x, y, z of the normal"))?;
        if let Some(element) = name_of(card, "ELEMENT")? {
            return self.bolt(&element, pilot, axis, row);
        }
        let name = card.need("SURFACE")?;
        let Some(Surface::Faces(faces)) = self.surfaces.get(&name) else {
            return Err(card.fault(format!("surface {} of faces is not defined", quote(&name))));
        };
        let mut nodes = BTreeSet::new();
        let mut own = BTreeSet::new();
        for &(element, face) in faces {
            own.insert(element);
            nodes.extend(self.raw[element as usize].side(face));
        }
        let middle = |nodes: &[u32]| {
            nodes.iter().map(|&n| self.deck.nodes[n as usize]).sum::<DVec3>() / nodes.len() as f64
        };
        let list: Vec<u32> = nodes.iter().copied().collect();
        let at = middle(&list);
        let side = |e: usize| (middle(&self.raw[e].nodes) - at).dot(axis) > 0.0;
        let Some(&first) = own.first() else { return Ok(()) };
        let inner = side(first as usize);
        let touches = |e: &usize| self.raw[*e].nodes.iter().any(|n| nodes.contains(n));
        let inside: Vec<usize> =
            (0..self.raw.len()).filter(touches).filter(|&e| side(e) == inner).collect();
        let twins: BTreeMap<u32, u32> = nodes.iter().map(|&n| (n, self.hidden_node(n))).collect();
        for e in inside {
            for node in &mut self.raw[e].nodes {
                *node = twins.get(node).copied().unwrap_or(*node);
            }
        }
        for (&node, &twin) in &twins {
            for (i, along) in axis.to_array().into_iter().enumerate() {
                let i = i as u32;
                let mut terms = vec![(3 * twin + i, 1.0), (3 * node + i, -1.0)];
                if along != 0.0 {
                    terms.push((3 * pilot, -along));
                }
                self.deck.equations.push(Equation { terms, value: 0.0, line: card.line });
            }
        }
        Ok(())
    }

    /// The beam that a bolt is leaves its place to its pull: its nodes come nearer along the axis by
    /// the first component of another.
    fn bolt(&mut self, element: &str, pilot: u32, axis: DVec3, row: Row<'_>) -> Result<(), Fault> {
        let other = || row.fault(format!("element {} is no B31", quote(element)));
        let &[number] = self.some_elements(element, row)?.as_slice() else { return Err(other()) };
        let raw = &mut self.raw[number as usize];
        let (Kind::Thin(_), &[a, b]) = (raw.kind, raw.nodes.as_slice()) else {
            return Err(other());
        };
        raw.kind = Kind::Link(Link::Bolt);
        self.sprung.insert(number);
        let mut terms = terms(&[(a, axis), (b, -axis)]);
        terms.push((3 * pilot, -1.0));
        self.deck.equations.push(Equation { terms, value: 0.0, line: row.line });
        Ok(())
    }

    /// A node that the deck does not name, at the place of another.
    pub(super) fn hidden_node(&mut self, like: u32) -> u32 {
        let number = self.deck.nodes.len() as u32;
        self.deck.nodes.push(self.deck.nodes[like as usize]);
        self.deck.twins.insert(number, like);
        number
    }

    /// The set that a card names by ELSET.
    pub(super) fn named_elements(&self, card: &Card<'_>) -> Result<Vec<u32>, Fault> {
        let set = card.need("ELSET")?;
        let undefined = || card.fault(format!("element set {} is not defined", quote(&set)));
        self.element_sets.get(&set).cloned().ok_or_else(undefined)
    }
}

fn direction(word: &str, row: Row<'_>) -> Result<u8, Fault> {
    match word.parse::<u8>() {
        Ok(c @ 1..=3) => Ok(c - 1),
        _ => Err(row.fault(format!("{} is no component of a spring: 1 to 3 are", quote(word)))),
    }
}
