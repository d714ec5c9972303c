//! What walks have not met: the part of a reading that both sides may have missed.
//!
//! An error bar knows what walks have found, not what they never came to: light behind a hole of a
//! millimetre changes a reading by half, and walks that miss the hole agree with each other to a
//! per cent. But two sides know more than one. Where walks from the source have been and walks from
//! the response have not, there is a *dark* region, and it is known how strong the source's field
//! is there. None of N walks came there; so with 95 % confidence fewer than 3/N would (the rule of
//! three, Hanley and Lippman-Hand 1983), and each would find that field. As long as the product is
//! more than the error bar, the error bar must not be believed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::Side;

/// Of N walks that never did it, so many over N would at most: −ln .05.
const THREE: f64 = 3.0;
/// Weights are kept as whole numbers of this, so that their sums know no order.
const UNIT: f64 = 1.0 / (1_u128 << 64) as f64;

/// Where the walks of one side have arrived: by cell of phase space with what weight.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Walks that were looked at.
    walks: u64,
    /// The share of their ways that were free to go anywhere.
    free: f64,
    arrivals: u64,
    cells: BTreeMap<u64, Cell>,
}

/// One cell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Cell {
    /// In [`UNIT`].
    weight: u128,
    /// Measure of the cell: weight per walk over it is the field there.
    size: f64,
}

impl Reach {
    /// Of walks that go wherever they may with the share `free` of their ways (1 where no field
    /// steers them).
    #[must_use]
    pub fn of_ways(free: f64) -> Self {
        Self { free, ..Self::default() }
    }

    /// Takes `walks` walks and their arrivals. `size` is the measure of a cell.
    pub fn record(&mut self, walks: u64, arrivals: &Arrivals, size: impl Fn(u64) -> f64) {
        self.walks += walks;
        for &(key, weight, count) in &arrivals.0 {
            let cell = self.cells.entry(key).or_insert_with(|| Cell { weight: 0, size: size(key) });
            cell.weight = cell.weight.saturating_add(weight);
            self.arrivals += count;
        }
    }

    /// Takes all of `other`, the same side of the same problem.
    pub fn merge(&mut self, other: &Self) {
        self.walks += other.walks;
        self.arrivals += other.arrivals;
        for (&key, theirs) in &other.cells {
            let cell = self.cells.entry(key).or_insert(Cell { weight: 0, ..*theirs });
            cell.weight = cell.weight.saturating_add(theirs.weight);
        }
    }

    /// Whether it can be: what comes from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.free > 0.0
            && self.free <= 1.0
            && self.cells.values().all(|c| c.size.is_finite() && c.size > 0.0)
    }

    /// Field in the cells that `counts`, weighted by itself: where the weight is, it is that
    /// strong.
    fn strength(&self, counts: impl Fn(u64) -> bool) -> f64 {
        let (mut sum, mut square) = (0.0, 0.0);
        for (_, cell) in self.cells.iter().filter(|(key, _)| counts(**key)) {
            let weight = cell.weight as f64 * UNIT / self.walks as f64;
            sum += weight;
            square += weight * weight / cell.size;
        }
        if sum > 0.0 { square / sum } else { 0.0 }
    }

    /// The most that walks of this side would bring, by the rule of three, from a field of that
    /// strength to which none has come.
    fn missed(&self, strength: f64) -> f64 {
        let weight =
            self.cells.values().map(|c| c.weight as f64 * UNIT).sum::<f64>() / self.arrivals as f64;
        THREE * weight / (self.walks as f64 * self.free) * strength
    }
}

/// The arrivals of some walks: by cell, in the order of the cells, the weight in [`UNIT`] and how
/// many they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arrivals(Vec<(u64, u128, u64)>);

impl Arrivals {
    /// From cell and weight of each. What is no positive number has not arrived.
    #[must_use]
    pub fn new(mut each: Vec<(u64, f64)>) -> Self {
        each.retain(|(_, weight)| weight.is_finite() && *weight > 0.0);
        each.sort_unstable_by_key(|(key, _)| *key);
        let of_cell = |of: &[(u64, f64)]| {
            (
                of[0].0,
                of.iter().map(|(_, weight)| (weight / UNIT) as u128).fold(0, u128::saturating_add),
                of.len() as u64,
            )
        };
        Self(each.chunk_by(|a, b| a.0 == b.0).map(of_cell).collect())
    }
}

/// What may be missing from a reading: see [`unmet`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmet {
    /// Walks come where the other side's never were: what the other side would bring from there.
    dark: [f64; 2],
    /// Walks never come from there to where the other side's were: what this side would bring.
    shut: [f64; 2],
}

/// Compares where the walks of both sides have been; `None` where one has been nowhere. A cell is
/// not dark if a walk has been in one of those that `near` says lie beside it on the same surface.
///
/// ```
/// use intrados_transport::{Arrivals, Reach, Side, unmet};
/// let mut eye = Reach::of_ways(1.0);
/// let mut lamp = Reach::of_ways(1.0);
/// // A thousand walks each: in the same room (cell 0), and some of the lamp's in a cupboard (cell 1).
/// eye.record(1000, &Arrivals::new((0..1000).map(|_| (0, 1.0)).collect()), |_| 1.0);
/// lamp.record(1000, &Arrivals::new((0..1000).map(|i| (i % 2, 4.0)).collect()), |_| 1.0);
/// let unmet = unmet(&eye, &lamp, |_| std::iter::empty()).unwrap();
/// // A walk from the eye into the cupboard would find 2 there, and of a thousand none did: at most 3/1000 · 2. The lamp's walks, did they get out
/// // of it, would bring 4 each where importance is 1: at most 3/1000 · 4. Neither happened, so the smaller bounds it.
/// assert_eq!(unmet.bound(Side::Primal, 0.0), 0.006);
/// ```
#[must_use]
pub fn unmet<I: Iterator<Item = u64>>(
    primal: &Reach,
    dual: &Reach,
    near: impl Fn(u64) -> I,
) -> Option<Unmet> {
    if primal.arrivals == 0 || dual.arrivals == 0 {
        return None;
    }
    let has_been = |of: &Reach, key: u64| {
        of.cells.contains_key(&key) || near(key).any(|key| of.cells.contains_key(&key))
    };
    let dark = |of: &Reach, other: &Reach| of.missed(other.strength(|key| !has_been(of, key)));
    let shut = |of: &Reach, other: &Reach| of.missed(other.strength(|_| true));
    Some(Unmet {
        dark: [dark(primal, dual), dark(dual, primal)],
        shut: [shut(dual, primal), shut(primal, dual)],
    })
}

impl Unmet {
    /// What a reading by the walks of `side` may lack, at most: of the other side's field where
    /// they have never been, and of their own that never got out to where the other's is. `more`:
    /// by how much the other side's reading, its error threefold included, exceeds this one's: if
    /// its walks did come out of the dark, that is what they know.
    #[must_use]
    pub fn bound(&self, side: Side, more: f64) -> f64 {
        let (mine, other) = (side as usize, side.other() as usize);
        let [dark, shut] = [self.dark, self.shut];
        let beyond = dark[mine].min(shut[mine].max(more));
        let within = dark[other].min(shut[other]);
        beyond + within
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(walks: u64, cells: &[(u64, f64)]) -> Reach {
        let mut reach = Reach::of_ways(1.0);
        reach.record(walks, &Arrivals::new(cells.to_vec()), |_| 0.5);
        reach
    }

    #[test]
    fn where_both_have_been_nothing_is_missing() {
        let (a, b) = (reach(10, &[(1, 1.0), (2, 3.0)]), reach(10, &[(2, 1.0), (1, 1.0)]));
        let unmet = unmet(&a, &b, |_| [].into_iter()).unwrap();
        assert_eq!(Side::BOTH.map(|side| unmet.bound(side, 1e9)), [0.0, 0.0]);
    }

    /// Weights 3 and 1 in ten walks of two: 2 a arrival. Beyond it the other's field is 5/10/.5
    /// = 1. Dark to the primal by 3 · 2/10 · 1.
    #[test]
    fn what_a_walk_would_find_is_missing() {
        let (a, b) = (reach(10, &[(1, 1.0), (2, 3.0)]), reach(10, &[(2, 1.0), (1, 1.0), (7, 5.0)]));
        let unmet = unmet(&a, &b, |_| [].into_iter()).unwrap();
        assert!((unmet.dark[0] - 0.6).abs() < 1e-12 && unmet.dark[1] == 0.0, "{unmet:?}");
        // The other way: 7/3 an arrival, the primal's field (.1² + .3²)/.5/.4 = .5.
        assert!((unmet.shut[0] - 3.0 * (7.0 / 3.0) / 10.0 * 0.5).abs() < 1e-12, "{unmet:?}");
        assert_eq!(unmet.bound(Side::Primal, 0.0), unmet.shut[0].min(0.6));
        // Its walks did get out, and brought more than that: what they brought is what may be
        // missing.
        assert_eq!(unmet.bound(Side::Primal, 0.55), 0.55);
        assert_eq!(unmet.bound(Side::Dual, 1e9), unmet.bound(Side::Primal, 0.0));
    }

    #[test]
    fn beside_a_walk_it_is_not_dark() {
        let (a, b) = (reach(10, &[(1, 1.0)]), reach(10, &[(1, 1.0), (2, 5.0)]));
        assert!(super::unmet(&a, &b, |_| [].into_iter()).unwrap().dark[0] > 0.0);
        assert_eq!(super::unmet(&a, &b, |key| [key - 1].into_iter()).unwrap().dark[0], 0.0);
    }

    #[test]
    fn sums_know_no_order() {
        let parts = [
            reach(3, &[(1, 0.1), (2, 1e9)]),
            reach(4, &[(1, 1e-7)]),
            reach(5, &[(2, 0.3), (3, 1.0 / 3.0)]),
        ];
        let sum = |order: [usize; 3]| {
            let mut all = Reach::of_ways(1.0);
            order.iter().for_each(|&i| all.merge(&parts[i]));
            all
        };
        assert_eq!(sum([0, 1, 2]), sum([2, 0, 1]));
        assert!(
            sum([0, 1, 2]).is_consistent()
                && unmet(&sum([0, 1, 2]), &Reach::of_ways(1.0), |_| [].into_iter()).is_none()
        );
    }
}
