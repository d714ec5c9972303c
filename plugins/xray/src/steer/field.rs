//! What going on or coming brings, by place, energy and direction.

use intrados_transport::Side;
use rayon::prelude::*;

use super::domain::{DIRECTIONS, Domain, GROUPS, targets};
use crate::problem::PhotonProblem;

/// What one bin has been taught.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Taught {
    /// Photons of the other side: Σv, Σv² of what they bring, v per walk.
    photons: [f64; 2],
    /// Suffixes of the own side: of scores s and weights w Σs, Σw, Σs², Σsw, Σw².
    suffixes: [f64; 5],
    /// How many suffixes.
    n: f64,
}

impl Taught {
    /// A photon that brings `v`; as in [`FieldEvidence`](intrados_transport::field::FieldEvidence)
    /// what is no number teaches nothing.
    pub(crate) fn photon(&mut self, v: f64) {
        if !v.is_finite() {
            return;
        }
        self.photons[0] += v;
        self.photons[1] += v * v;
    }

    /// A suffix that scored `s` with weight `w`.
    pub(crate) fn suffix(&mut self, s: f64, w: f64) {
        if !s.is_finite() || !w.is_finite() {
            return;
        }
        [s, w, s * s, s * w, w * w]
            .into_iter()
            .zip(&mut self.suffixes)
            .for_each(|(x, sum)| *sum += x);
        self.n += 1.0;
    }
}

/// A field: two tables over the bins of a [`Domain`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PhotonField {
    /// What going from here brings, and what coming here brings.
    pub(crate) tables: [Vec<f32>; 2],
}

/// Going, coming.
pub(crate) const GO: usize = 0;
/// See [`GO`].
pub(crate) const COME: usize = 1;

/// What a set of bins came to, over what had been promised.
#[derive(Debug, Clone, Copy, Default)]
struct Ratio {
    came: [f64; 2],
    promised: [f64; 2],
    /// Σ of the squares of photons; of suffixes s², s·m·w, (m·w)².
    squares: [f64; 4],
    n: f64,
}

impl Ratio {
    fn take(&mut self, m: f64, extent: f64, taught: &Taught) {
        let [s, w, ss, sw, ww] = taught.suffixes;
        self.came[0] += taught.photons[0];
        self.promised[0] += m * extent;
        self.squares[0] += taught.photons[1];
        self.came[1] += s;
        self.promised[1] += m * w;
        self.squares[1] += ss;
        self.squares[2] += m * sw;
        self.squares[3] += m * m * ww;
        self.n += taught.n;
    }

    /// The factor by which the set's bins were wrong: photons and suffixes by inverse variance (of
    /// logarithms), and a prior that says 1 with precision `prior`.
    fn correction(&self, prior: f64) -> f64 {
        let (mut sum, mut all) = (0.0, prior);
        if self.came[0] > 0.0 && self.promised[0] > 0.0 {
            // How many photons come is itself a matter of chance: relVar = Σv²/(Σv)².
            let precision = self.came[0] * self.came[0] / self.squares[0];
            sum += precision * (self.came[0] / self.promised[0]).ln();
            all += precision;
        }
        if self.came[1] > 0.0 && self.promised[1] > 0.0 {
            // That so many suffixes were asked for is not: what counts is how far each is from what
            // it promised, corrected.
            let r = self.came[1] / self.promised[1];
            let rest =
                (self.squares[1] - 2.0 * r * self.squares[2] + r * r * self.squares[3]).max(0.0);
            let precision = 1.0 / (rest / (self.came[1] * self.came[1]) + 1.0 / (self.n * self.n));
            sum += precision * r.ln();
            all += precision;
        }
        (sum / all).clamp(-20.0, 20.0).exp()
    }
}

/// The sets of bins that are corrected together, coarse ones first: edge of the block of cells,
/// energies apart, cones apart; and the prior.
const LEVELS: [(u32, bool, bool, f64); 13] = [
    (u32::MAX, false, false, 0.0),
    (u32::MAX, true, false, 5.0),
    (u32::MAX, false, true, 5.0),
    (u32::MAX, true, true, 20.0),
    (4, false, false, 20.0),
    (4, true, false, 40.0),
    (4, false, true, 40.0),
    (2, false, false, 40.0),
    (2, true, false, 80.0),
    (2, false, true, 80.0),
    (1, false, false, 80.0),
    (2, true, true, 160.0),
    (1, false, true, 160.0),
];

impl PhotonField {
    /// A first guess: what comes straight to the target, and rather forward.
    #[must_use]
    pub(crate) fn guess(problem: &PhotonProblem, domain: &Domain, side: Side) -> Self {
        let target = targets(problem.scanner)[side as usize];
        let depths = |cell: usize| -> Vec<f64> {
            let from = domain.lattice.centre(cell);
            let way = (target - from).normalize();
            let depth = |g: usize| {
                let [low, high] = domain.range(g);
                let local = problem.specimen.local((low * high).sqrt());
                problem.specimen.depth(&local, from, way, 0.0, f64::INFINITY)
            };
            (0..GROUPS).map(depth).collect()
        };
        let values: Vec<f32> = (0..domain.lattice.len())
            .into_par_iter()
            .flat_map_iter(|cell| {
                let there = domain.volume[cell] > 0.0;
                depths(cell).into_iter().flat_map(move |depth| {
                    (0..DIRECTIONS).map(move |d| {
                        if there {
                            (-0.8 * depth + 2.0 * Domain::cosine(d)).exp() as f32
                        } else {
                            0.0
                        }
                    })
                })
            })
            .collect();
        Self { tables: [values.clone(), values] }
    }

    /// Whether it holds nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tables[GO].is_empty()
    }

    /// Memory, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tables.iter().map(|t| 4 * t.len()).sum()
    }

    /// Corrects both tables by what has been taught since: ratios of what came to what was
    /// promised, from coarse sets of bins to fine ones, each as far as its evidence goes. `walks`
    /// is how many the other side's photons come from.
    pub(crate) fn learn(&mut self, domain: &Domain, taught: &[Vec<Taught>; 2], walks: f64) {
        let extents = domain.extents();
        self.tables.par_iter_mut().zip(taught).for_each(|(table, taught)| {
            for level in LEVELS {
                correct(table, domain, taught, &extents, walks, level);
            }
        });
    }
}

fn correct(
    table: &mut [f32],
    domain: &Domain,
    taught: &[Taught],
    extents: &[f64],
    walks: f64,
    level: (u32, bool, bool, f64),
) {
    let (edge, by_group, by_cone, prior) = level;
    let [x, y, z] = domain.lattice.cells.to_array();
    let blocks = [x, y, z].map(|n| n.div_ceil(edge) as usize);
    let (groups, cones) = (if by_group { GROUPS } else { 1 }, if by_cone { DIRECTIONS } else { 1 });
    let block = |cell: usize| {
        let (x, y) = (x as usize, y as usize);
        let at = [cell % x, cell / x % y, cell / (x * y)].map(|k| k / edge as usize);
        (at[2] * blocks[1] + at[1]) * blocks[0] + at[0]
    };
    let inner = GROUPS * DIRECTIONS;
    let set = |block: usize, k: usize| {
        let (group, cone) =
            (if by_group { k / DIRECTIONS } else { 0 }, if by_cone { k % DIRECTIONS } else { 0 });
        (block * groups + group) * cones + cone
    };
    let mut ratios = vec![Ratio::default(); blocks.iter().product::<usize>() * groups * cones];
    for cell in (0..domain.lattice.len()).filter(|&c| domain.volume[c] > 0.0) {
        let (block, volume) = (block(cell), domain.volume[cell] * walks);
        for k in 0..inner {
            let i = cell * inner + k;
            ratios[set(block, k)].take(f64::from(table[i]), volume * extents[k], &taught[i]);
        }
    }
    let factors: Vec<f32> = ratios.iter().map(|r| r.correction(prior) as f32).collect();
    for cell in 0..domain.lattice.len() {
        let block = block(cell);
        for k in 0..inner {
            let value = &mut table[cell * inner + k];
            *value = (*value * factors[set(block, k)]).clamp(f32::MIN_POSITIVE, f32::MAX);
        }
    }
}
