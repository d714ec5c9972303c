//! What joins nodes without a solid: springs.

use super::{
    model::Spring,
    read::{Kind, Reader, plain},
    turn::terms,
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
}

impl Link {
    pub(super) fn of(name: &str) -> Option<Self> {
        match name {
            "SPRINGA" => Some(Self::Between),
            "SPRING1" => Some(Self::Ground),
            "SPRING2" => Some(Self::Components),
            _ => None,
        }
    }

    pub(super) fn nodes(self) -> usize {
        match self {
            Self::Between | Self::Components => 2,
            Self::Ground => 1,
        }
    }
}

impl Reader {
    pub(super) fn linked(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        match plain(card).as_str() {
            "SPRING" => self.spring(card),
            _ => Ok(()),
        }
    }

    fn spring(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET"])?;
        let elements = self.named_elements(card)?;
        let rows: Vec<Row<'_>> = card.rows().collect();
        let first = rows.first().ok_or_else(|| card.fault("needed is: stiffness"))?;
        for element in elements {
            let raw = self.raw[element as usize].clone();
            let Kind::Link(link) = raw.kind else {
                return Err(card.fault(format!("element {} is no spring", raw.label)));
            };
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
            self.deck.springs.push(Spring { terms, stiffness });
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
