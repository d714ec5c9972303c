//! Bars that slip: how far each end of a piece has moved ahead of the concrete along the bar, one
//! unknown a place.
//!
//! These places are nodes of the system after those of the mesh and of rotations. Only their first
//! component is free; the others are held at nothing, and so is the first at anchored ends. The bar
//! strains by the host's strain and the slope of the slip; bond by the CEB law acts on its surface.

use super::{Failure, Model, System, Trial, steel::Slipping};
use crate::{
    element::Element,
    material::bond::BondState,
    sparse::{Kind, Place},
};

/// Where the slips of bars are among the nodes of the system.
#[derive(Debug, Clone, Default)]
pub(super) struct Slips {
    /// Of each bar its first place; none: perfect bond.
    first: Vec<Option<u32>>,
    /// Held components of places.
    held: Vec<(u32, u8)>,
    places: Vec<Place>,
}

impl Slips {
    /// Of a model, numbered from `next`.
    pub(super) fn new(model: &Model, next: u32) -> Self {
        let mut slips = Self::default();
        for steel in &model.steel {
            let Some(slipping) = steel.bond.as_ref().filter(|_| !steel.pieces.is_empty()) else {
                slips.first.push(None);
                continue;
            };
            let (begin, count) = (next + slips.places.len() as u32, steel.pieces.len() as u32);
            slips.first.push(Some(begin));
            slips.held.extend((begin..=begin + count).flat_map(|node| [(node, 1), (node, 2)]));
            let ends = [begin, begin + count].into_iter().zip(slipping.anchored);
            slips.held.extend(ends.filter(|end| end.1).map(|end| (end.0, 0)));
            let start = steel.pieces.iter().take(1).map(|p| p.ends[0]);
            let places = start.chain(steel.pieces.iter().map(|p| p.ends[1]));
            slips
                .places
                .extend(places.map(|p| Place { position: p.to_array(), kind: Kind::Relative }));
        }
        slips
    }

    pub(super) fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.places.iter().copied()
    }

    /// Components that are held at nothing.
    pub(super) fn held(&self) -> impl Iterator<Item = (u32, u8, f64)> + '_ {
        self.held.iter().map(|&(node, component)| (node, component, 0.0))
    }

    /// Nodes of a piece: those of its host, and its own two places if it slips.
    pub(super) fn nodes(&self, bar: usize, piece: usize, host: &[u32; 8]) -> Vec<u32> {
        let own = self.first[bar]
            .into_iter()
            .flat_map(|first| [first + piece as u32, first + piece as u32 + 1]);
        host.iter().copied().chain(own).collect()
    }

    /// Slips of the ends of a piece; none: perfect bond.
    fn of(&self, bar: usize, piece: usize, x: &[f64]) -> Option<[f64; 2]> {
        let first = self.first[bar]? as usize + piece;
        Some([x[3 * first], x[3 * first + 3]])
    }
}

impl System<'_> {
    /// The system's node of the slip where piece `piece` of a bar begins (or, one beyond the last,
    /// where the bar ends); none for perfect bond.
    #[must_use]
    pub fn slip_node(&self, bar: usize, piece: usize) -> Option<u32> {
        let within = piece <= self.model.steel.get(bar)?.pieces.len();
        (*self.slips.first.get(bar)?).filter(|_| within).map(|first| first + piece as u32)
    }

    /// Stiffness and force of a piece that slips, on its host and its two places; false: it does
    /// not slip.
    pub(super) fn slipping(
        &self,
        [bar, piece]: [usize; 2],
        host: &[f64; 24],
        trial: Trial,
        x: &[f64],
        k: &mut [f64],
        f: &mut [f64],
    ) -> Result<bool, Failure> {
        let steel = &self.model.steel[bar];
        let (Some(ends), Some(slipping)) = (self.slips.of(bar, piece, x), &steel.bond) else {
            return Ok(false);
        };
        let unknowns: [f64; 26] =
            std::array::from_fn(|i| if i < 24 { host[i] } else { ends[i - 24] });
        let (before, span) = (&trial.history.steel[bar][piece], [trial.history.time, trial.time]);
        let law = |strain: f64| {
            let (stress, tangent, _) = steel.answer(piece, strain, f64::NAN, before, span);
            (stress, tangent)
        };
        let bond = |end: usize, slip: f64| {
            let (stress, slope, _) = slipping.bond.respond(slip, &before.bond[end]);
            // Symmetric and positive: past the strength the iteration is left to find the way.
            (stress, slope.max(FLAT * slipping.bond.stiffness))
        };
        let element = steel.pieces[piece].slipping(
            &unknowns,
            steel.area_at(piece, trial.time),
            slipping.perimeter,
            law,
            bond,
        );
        let element: Element<26> =
            element.map_err(|source| Failure::Element { element: steel.name.clone(), source })?;
        // The two slips are the first components of places of three.
        let at = |i: usize| if i < 24 { i } else { 24 + 3 * (i - 24) };
        for i in 0..26 {
            f[at(i)] = element.force[i];
            (0..26).for_each(|j| k[at(i) * WIDTH + at(j)] = element.stiffness[i][j]);
        }
        Ok(true)
    }

    /// How much more a piece strains than its host.
    pub(super) fn stretch(&self, bar: usize, piece: usize, x: &[f64]) -> f64 {
        self.slips
            .of(bar, piece, x)
            .map_or(0.0, |[a, b]| (b - a) / self.model.steel[bar].pieces[piece].length())
    }

    /// What bond at the ends of a piece remembers.
    pub(super) fn bonded(
        &self,
        bar: usize,
        piece: usize,
        x: &[f64],
        before: [BondState; 2],
    ) -> [BondState; 2] {
        let Some((ends, Slipping { bond, .. })) =
            self.slips.of(bar, piece, x).zip(self.model.steel[bar].bond.as_ref())
        else {
            return before;
        };
        std::array::from_fn(|end| bond.respond(ends[end], &before[end]).2)
    }
}

/// Unknowns of ten nodes.
const WIDTH: usize = 30;
/// Least slope of bond in the stiffness, over its first.
const FLAT: f64 = 1e-3;
