//! What is solved for: unknowns as sums over free ones, these numbered in the order in which
//! elements meet them, and the matrices of what elements say of them.

use std::collections::HashMap;

use intrados_stage::Job;

use super::{constraint::Sum, element::Folded, model::Deck, solve::LinearError};
use crate::sparse::{BlockMatrix, Connectivity, Pattern, Place};

/// The free unknowns of a deck in a step.
pub(super) struct Free<'a> {
    deck: &'a Deck,
    /// Of every unknown.
    sums: Vec<Sum>,
    /// Number of each free unknown that an element moves with, and the other way round.
    numbers: HashMap<u32, u32>,
    order: Vec<u32>,
    places: Vec<Place>,
    /// Numbers of the free unknowns of every element, ascending by unknown.
    elements: Connectivity,
}

impl<'a> Free<'a> {
    /// From what every unknown is by the free ones, and the unknowns of every element. `node` says
    /// which node an unknown belongs to.
    pub(super) fn new(
        deck: &'a Deck,
        sums: Vec<Sum>,
        elements: impl Iterator<Item = Vec<u32>>,
        node: impl Fn(u32) -> u32,
    ) -> Self {
        let mut free = Self {
            deck,
            sums,
            numbers: HashMap::new(),
            order: Vec::new(),
            places: Vec::new(),
            elements: Connectivity::default(),
        };
        for unknowns in elements {
            let sums = unknowns.iter().map(|&u| &free.sums[u as usize]);
            let mut own: Vec<u32> = sums.flat_map(|s| s.terms.iter().map(|t| t.0)).collect();
            own.sort_unstable();
            own.dedup();
            let numbered: Vec<u32> = own.into_iter().map(|u| free.enter(u, node(u))).collect();
            free.elements.push(&numbered);
        }
        free
    }

    /// The number of a free unknown of a node, a new one where it has none yet.
    fn enter(&mut self, unknown: u32, node: u32) -> u32 {
        let next = self.order.len() as u32;
        let number = *self.numbers.entry(unknown).or_insert(next);
        if number == next {
            self.places.push(Place::point(self.deck.nodes[node as usize].to_array()));
            self.order.push(unknown);
        }
        number
    }

    /// How many are solved for.
    pub(super) fn count(&self) -> usize {
        self.order.len()
    }

    /// The free unknowns in the order of their numbers.
    pub(super) fn order(&self) -> &[u32] {
        &self.order
    }

    /// What an unknown is by the free ones.
    pub(super) fn sum(&self, unknown: u32) -> &Sum {
        &self.sums[unknown as usize]
    }

    /// The number of a free unknown; none: no element moves with it.
    pub(super) fn number(&self, unknown: u32) -> Option<usize> {
        self.numbers.get(&unknown).map(|&number| number as usize)
    }

    /// Every unknown by what was solved for.
    pub(super) fn expanded(&self, solution: &[f64]) -> Vec<f64> {
        let value = |sum: &Sum| {
            let part = |&(u, c): &(u32, f64)| self.number(u).map_or(0.0, |n| c * solution[n]);
            sum.constant + sum.terms.iter().map(part).sum::<f64>()
        };
        self.sums.iter().map(value).collect()
    }

    /// Tᵀ K T and Tᵀ (f − K c) of what `fill` says of the `unknowns` of every element, matrices by
    /// rows.
    pub(super) fn assembled(
        &self,
        job: &Job,
        unknowns: impl Fn(usize) -> Vec<u32> + Sync,
        fill: impl Fn(usize, &mut [f64], &mut [f64]) -> Result<(), Folded> + Sync,
    ) -> Result<(BlockMatrix<1>, Vec<f64>), LinearError> {
        let pattern = Pattern::new(self.places.clone(), &self.elements)?;
        let mut matrix = BlockMatrix::<1>::zeros(pattern.into());
        let mut rhs = vec![0.0; self.places.len()];
        matrix.assemble_with(&self.elements, &mut rhs, job, |e, k, f| {
            let unknowns = unknowns(e);
            let n = unknowns.len();
            let (mut full, mut force) = (vec![0.0; n * n], vec![0.0; n]);
            let label = || self.deck.cells.get(e).map_or(0, |c| c.label);
            fill(e, &mut full, &mut force).map_err(|Folded| LinearError::Folded(label()))?;
            self.reduced(self.elements.get(e), &unknowns, (&full, &force), k, f);
            Ok::<_, LinearError>(())
        })?;
        Ok((matrix, rhs))
    }

    /// K and f of the unknowns of an element to those of what is free.
    fn reduced(
        &self,
        members: &[u32],
        unknowns: &[u32],
        (full, force): (&[f64], &[f64]),
        k: &mut [f64],
        f: &mut [f64],
    ) {
        let n = unknowns.len();
        let sums: Vec<&Sum> = unknowns.iter().map(|&u| &self.sums[u as usize]).collect();
        // Places of every unknown's terms among those of the element.
        let place = |free: &u32| {
            let number = self.numbers.get(free)?;
            members.iter().position(|m| m == number)
        };
        let share = |s: &&Sum| s.terms.iter().filter_map(|(u, c)| Some((place(u)?, *c))).collect();
        let shares: Vec<Vec<(usize, f64)>> = sums.iter().map(share).collect();
        for (i, share) in shares.iter().enumerate() {
            let row = &full[i * n..(i + 1) * n];
            let moved: f64 = row.iter().zip(&sums).map(|(k, s)| k * s.constant).sum();
            for &(a, c) in share {
                f[a] += c * (force[i] - moved);
                for (value, other) in row.iter().zip(&shares) {
                    other.iter().for_each(|&(b, d)| k[a * members.len() + b] += c * d * value);
                }
            }
        }
    }
}
