//! Equations and ties.

use std::collections::BTreeSet;

use super::{State, load::component};
use crate::{
    linear::{
        constraint::Equation,
        read::{Reader, Surface, plain},
        tie::{self, Face},
    },
    read::{Fault, abaqus::card::Card, quote},
};

impl Reader {
    /// `*EQUATION`: how many terms, then node, component and factor of each.
    pub(in crate::linear) fn equation(&mut self, card: &Card<'_>) -> Result<(), Fault> {
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
    pub(super) fn end_equations(&mut self, card: &Card<'_>, state: &State) -> Result<(), Fault> {
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
    pub(in crate::linear) fn tie(&mut self, card: &Card<'_>) -> Result<(), Fault> {
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
