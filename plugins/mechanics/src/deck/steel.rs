//! Embedded bars, and the steel of decks.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::{Case, DeckError, locate, unfit};
use crate::{
    element::{embed::embed, rod::Piece},
    material::steel::Bar,
    mesh::{ElementId, Locator},
    model::{Action, Matter, Steel, SteelKind},
    read::Deck,
};

/// A bar that yields by a table of stress over plastic strain, on the line between its ends; one
/// that never does without a table.
pub(super) fn bar(modulus: f64, yielding: &[(f64, f64)]) -> Bar {
    let elastic = Bar::elastic(modulus);
    let (Some(first), Some(last)) = (yielding.first(), yielding.last()) else { return elastic };
    let slope = if last.1 > first.1 { (last.0 - first.0) / (last.1 - first.1) } else { 0.0 };
    Bar { yielding: first.0, hardening: modulus * slope / (modulus + slope), ..elastic }
}

/// Pieces of a region's embedded bars, each with the stress before the first step.
type Laid = BTreeMap<u32, (Vec<Piece>, Vec<f64>)>;

impl Case {
    /// Takes embedded rods out of the mesh and lays them into their hosts.
    pub(super) fn embed(
        &mut self,
        deck: &Deck,
        bearing: &HashSet<ElementId>,
    ) -> Result<(), DeckError> {
        if deck.embedded.is_empty() {
            return Ok(());
        }
        let mut laid = Laid::new();
        let mut gone = HashSet::new();
        {
            let mesh = &self.model.mesh;
            let locator = Locator::new(mesh);
            for embedded in &deck.embedded {
                let hosts: HashSet<u32> = embedded.hosts.iter().copied().collect();
                for &rod in &embedded.rods {
                    let (id, cell) = (ElementId::Rod(rod), &mesh.rods[rod as usize]);
                    if bearing.contains(&id) {
                        return unfit(format!(
                            "{}: embedded bars are born with their hosts; take *MODEL CHANGE of it out",
                            mesh.name(id)
                        ));
                    }
                    let ends = cell.nodes.map(|n| mesh.nodes[n as usize]);
                    let pieces = embed(
                        &ends,
                        |p| locate(&locator, &hosts, p),
                        |hex| mesh.corners(hex as u32),
                    )
                    .map_err(|source| DeckError::Embedded { rod: mesh.name(id), source })?;
                    let stress = self.model.initial.get(&id).map_or(0.0, |s| s[0]);
                    let (all, stresses) = laid.entry(cell.region).or_default();
                    stresses.extend(std::iter::repeat_n(stress, pieces.len()));
                    all.extend(pieces);
                    gone.insert(rod);
                }
            }
        }
        for (region, (pieces, stress)) in laid {
            let Matter::Bar { steel, area, .. } = self.model.bodies[region as usize].matter else {
                return unfit(format!(
                    "section {}: embedded rods need an area",
                    self.model.mesh.regions[region as usize]
                ));
            };
            let name = self.model.mesh.regions[region as usize].clone();
            self.model.steel.push(Steel {
                name,
                pieces,
                area,
                count: 1.0,
                kind: SteelKind::Stressed(steel, stress),
                rust: None,
                gone: Vec::new(),
                bond: None,
                // As in Abaqus, whose embedded elements lie over their host.
                displaces: false,
            });
        }
        self.take_out(&gone)
    }

    /// Takes rods out of the mesh; the others move up.
    fn take_out(&mut self, gone: &HashSet<u32>) -> Result<(), DeckError> {
        let mesh = &mut self.model.mesh;
        let embedded: HashSet<u32> =
            gone.iter().flat_map(|&rod| mesh.rods[rod as usize].nodes).collect();
        let stays: Vec<u32> =
            (0..mesh.rods.len() as u32).filter(|rod| !gone.contains(rod)).collect();
        let number: HashMap<u32, u32> =
            stays.iter().enumerate().map(|(new, &old)| (old, new as u32)).collect();
        mesh.rods = stays.iter().map(|&old| mesh.rods[old as usize]).collect();
        if !mesh.labels.rods.is_empty() {
            mesh.labels.rods = stays
                .iter()
                .filter_map(|&old| mesh.labels.rods.get(old as usize).copied())
                .collect();
        }
        let renumbered = |id: ElementId| match id {
            ElementId::Rod(rod) => number.get(&rod).map(|&new| ElementId::Rod(new)),
            other => Some(other),
        };
        for set in mesh.element_sets.values_mut() {
            *set = set.iter().filter_map(|&id| renumbered(id)).collect();
        }
        let initial = std::mem::take(&mut self.model.initial);
        self.model.initial = initial
            .into_iter()
            .filter_map(|(id, stress)| Some((renumbered(id)?, stress)))
            .collect();
        self.release(&embedded)
    }

    /// Nodes of embedded bars follow their hosts: what holds or loads them is refused.
    fn release(&mut self, embedded: &HashSet<u32>) -> Result<(), DeckError> {
        let mesh = &self.model.mesh;
        let mut borne = vec![false; mesh.nodes.len()];
        let nodes = mesh
            .hexes
            .iter()
            .flat_map(|c| c.nodes)
            .chain(mesh.shells.iter().flat_map(|c| c.nodes))
            .chain(mesh.rods.iter().flat_map(|c| c.nodes));
        nodes.for_each(|n| borne[n as usize] = true);
        let follows = |n: u32| embedded.contains(&n) && !borne[n as usize];
        let held = self.model.holds.iter().map(|h| h.0);
        let acted = self.model.loads.iter().flat_map(|load| match &load.action {
            Action::Nodes(forces) => forces.iter().map(|f| f.0).collect::<Vec<_>>(),
            Action::Displacement(moved) => moved.iter().map(|m| m.0).collect(),
            _ => Vec::new(),
        });
        match held.chain(acted).find(|&n| follows(n)) {
            Some(n) => unfit(format!(
                "{} belongs to embedded bars alone, which follow the bricks around: hold or load those",
                mesh.node_name(n)
            )),
            None => Ok(()),
        }
    }
}
