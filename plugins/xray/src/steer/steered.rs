//! The photon problem with its walks of one side steered by a field.
//!
//! *Starts* come from a map over the random numbers of the plain start, whose cells hold what their
//! first flights promise. *Ways* are picked from several of the kernel's own, by what the field
//! says that they bring (resampled importance sampling: Talbot, Cline and Egbert 2005). *Flights*
//! end where the field says that collisions bring much: the density is Σ_t e^{−τ(s)} V(s), V
//! constant in a cell. Of each a share ignores the field. Splitting and roulette go by
//! [`TransportProblem::expected_contribution`].

use std::{f64::consts::TAU, ops::Range};

use glam::DVec3;
use intrados_stage::random::{Draw, Key};
use intrados_transport::{Ends, Links, Side, Steps, TransportProblem, field::promise};

use super::{
    Domain, PhotonField,
    field::{COME, GO},
};
use crate::{
    problem::{FLIGHT, Photon, PhotonProblem, PhotonStates, Place, Plan, Turn, WAY, Way, tilted},
    specimen::Local,
};

/// Ways that one is picked from.
const CANDIDATES: usize = 6;
/// Share of picks, flights and starts that ignore the field.
const DEFENCE: f64 = 0.1;
/// Cells of the map of starts along the numbers of the direction, and energies.
const START: [usize; 3] = [8, 8, 24];
/// Starts by which a cell of the map is judged.
const TRIALS: u32 = 4;
/// Most pieces of a flight.
const PIECES: usize = 160;
/// Seed of the trials.
const STARTS: u64 = 0x57A2;

/// Where to start: shares of the cells of the unit cube of the plain start's first three random
/// numbers.
#[derive(Debug, Clone)]
pub(crate) struct Starts {
    /// Ends of the cells of the third number.
    edges: Vec<f64>,
    /// Sum of shares up to and with each cell.
    sum: Vec<f64>,
    /// Share over volume.
    density: Vec<f64>,
}

/// A piece of a flight: its ends, its optical depth, what colliding there brings, and the sum of
/// what all up to it promise.
#[derive(Debug, Clone, Copy, Default)]
struct Piece {
    from: f64,
    to: f64,
    depth: f64,
    value: f64,
    sum: f64,
}

/// A photon problem whose walks of one side a field steers.
#[derive(Debug)]
pub struct SteeredPhotons<'a> {
    pub(crate) plain: PhotonProblem<'a>,
    pub(crate) domain: &'a Domain,
    field: &'a PhotonField,
    starts: Starts,
    /// The reading that a walk is expected to score.
    reading: f64,
    /// Cosine and sine of the azimuth between two ways that one is picked from.
    step: [f64; 2],
}

impl<'a> SteeredPhotons<'a> {
    /// Steers `side` of `plain` by `field`; a walk is expected to score `reading`.
    #[must_use]
    pub fn new(
        plain: PhotonProblem<'a>,
        domain: &'a Domain,
        field: &'a PhotonField,
        side: Side,
        reading: f64,
    ) -> Self {
        let starts = Starts { edges: Vec::new(), sum: Vec::new(), density: Vec::new() };
        let (sin, cos) = (TAU / CANDIDATES as f64).sin_cos();
        let mut steered = Self { plain, domain, field, starts, reading, step: [cos, sin] };
        steered.starts = Starts::new(&steered, side);
        steered
    }

    /// A field's table at a place.
    #[inline]
    fn value(&self, table: usize, side: Side, cell: usize, kev: f64, way: DVec3) -> f64 {
        f64::from(self.field.tables[table][self.domain.bin(side, cell, kev, way)])
    }

    /// Looks along a flight: visits each piece of it within one cell with its ends, its depth, what
    /// colliding there brings, and how likely that is.
    #[inline]
    fn look(
        &self,
        side: Side,
        local: &Local,
        way: &Way,
        mut visit: impl FnMut([f64; 2], f64, f64, f64),
    ) {
        let group = self.domain.group(way.kev);
        let table = &self.field.tables[COME];
        let (specimen, lattice) = (self.plain.specimen, &self.domain.lattice);
        let mut reached = 1.0;
        let mut piece = |cell: usize, a: f64, b: f64, depth: f64| {
            if depth > 0.0 {
                let passes = (-depth).exp();
                let value = f64::from(table[self.domain.bin_of(side, cell, group, way.way)]);
                visit([a, b], depth, value, reached * (1.0 - passes));
                reached *= passes;
            }
        };
        if specimen.only().is_some() {
            specimen.trace(way.at, way.way, 0.0, f64::INFINITY, |label, from, to| {
                lattice.march(way.at, way.way, from, to, |cell, a, b| {
                    piece(cell, a, b, local[label as usize] * (b - a));
                    true
                });
                true
            });
        } else {
            lattice.march(way.at, way.way, 0.0, f64::INFINITY, |cell, a, b| {
                piece(cell, a, b, specimen.depth(local, way.at, way.way, a, b));
                true
            });
        }
    }

    /// What a flight promises.
    fn promise(&self, side: Side, way: &Way) -> f64 {
        let mut sum = 0.0;
        self.look(side, &self.plain.specimen.local(way.kev), way, |_, _, value, collides| {
            sum += value * collides
        });
        sum
    }

    /// Draws a flight and what it brings into the weight.
    fn plan(&self, side: Side, way: &Way, key: Key, draw: &mut Draw) -> (Plan, f64) {
        let local = self.plain.specimen.local(way.kev);
        let mut pieces = [Piece::default(); PIECES];
        let (mut count, mut sum) = (0, 0.0);
        self.look(side, &local, way, |[from, to], depth, value, collides| {
            if count < PIECES {
                sum += value * collides;
                pieces[count] = Piece { from, to, depth, value, sum };
                count += 1;
            }
        });
        let pieces = &pieces[..count];
        let defence = if sum > 0.0 { DEFENCE } else { 1.0 };
        let density =
            |value: f64| defence + if sum > 0.0 { (1.0 - defence) * value / sum } else { 0.0 };
        if draw.unit() < defence {
            let Some((s, label)) = self.plain.flight(way.at, way.way, way.kev, key) else {
                return (Plan::Leave, 1.0 / defence);
            };
            let value = pieces.iter().find(|p| p.from <= s && s <= p.to).map_or(0.0, |p| p.value);
            return (Plan::Collide(s, label), 1.0 / density(value));
        }
        let wanted = draw.unit() * sum;
        let Some(piece) =
            pieces.get(pieces.partition_point(|p| p.sum <= wanted).min(count.saturating_sub(1)))
        else {
            return (Plan::Leave, 0.0);
        };
        // Within the piece by the exponential law, cut at its end.
        let depth = -(draw.unit() * (-piece.depth).exp_m1()).ln_1p();
        if let Some(label) = self.plain.specimen.only() {
            let s = piece.from + (piece.to - piece.from) * (depth / piece.depth).min(1.0);
            return (Plan::Collide(s, label), 1.0 / density(piece.value));
        }
        match self.plain.specimen.reach(&local, way.at, way.way, piece.from, depth) {
            Some((s, label)) => (Plan::Collide(s, label), 1.0 / density(piece.value)),
            None => (Plan::Leave, 0.0),
        }
    }

    /// Picks one of several ways on from a collision. They are drawn with kinds and azimuths spread
    /// evenly: of resampling only their mean density counts.
    fn pick(&self, turn: &Turn, side: Side, photon: &Photon, draw: &mut Draw) -> Way {
        let mut ways =
            [Way { at: photon.at, way: photon.way, kev: photon.kev, factor: 0.0 }; CANDIDATES];
        let mut value = [0.0; CANDIDATES];
        let (a, b) = photon.way.any_orthonormal_pair();
        let even = 1.0 / CANDIDATES as f64;
        let (kind, (sin, cos)) = (draw.unit(), (TAU * draw.unit()).sin_cos());
        let mut across = cos * a + sin * b;
        for (i, (way, value)) in ways.iter_mut().zip(&mut value).enumerate() {
            let bend = turn.draw((i as f64 + kind) * even, draw);
            if bend.factor > 0.0 {
                (way.way, way.kev, way.factor) =
                    (tilted(photon.way, across, bend.cosine), bend.kev, bend.factor);
                *value = way.factor * self.value(GO, side, photon.cell as usize, way.kev, way.way);
            }
            across = self.step[0] * across + self.step[1] * photon.way.cross(across);
        }
        let sum: f64 = value.iter().sum();
        let share =
            |v: f64| if sum > 0.0 { (1.0 - DEFENCE) * v / sum + DEFENCE * even } else { even };
        let mut left = draw.unit();
        let mut chosen = CANDIDATES - 1;
        for (i, &v) in value.iter().enumerate() {
            left -= share(v);
            if left < 0.0 {
                chosen = i;
                break;
            }
        }
        Way {
            factor: ways[chosen].factor * even / share(value[chosen]),
            way: ways[chosen].way.normalize(),
            ..ways[chosen]
        }
    }
}

impl Starts {
    fn new(steered: &SteeredPhotons, side: Side) -> Self {
        let edges = steered.plain.energy_numbers(side, START[2]);
        let [a, b, c] = START;
        let cells = a * b * c;
        let mut promise = Vec::with_capacity(cells);
        for cell in 0..cells {
            let volume = (edges[cell % c + 1] - edges[cell % c]) / (a * b) as f64;
            let mut sum = 0.0;
            for trial in 0..TRIALS {
                let mut draw =
                    Draw::new(Key::new(STARTS, cell as u64 * u64::from(TRIALS) + u64::from(trial)));
                let numbers = Self::numbers(&edges, cell, [draw.unit(), draw.unit(), draw.unit()]);
                // Pixels in turn, where walks start at pixels.
                let bin = (cell as u32 * TRIALS + trial) % steered.plain.scanner.panel.len();
                let way = steered.plain.depart(side, bin, numbers, &mut draw);
                sum +=
                    if way.factor > 0.0 { way.factor * steered.promise(side, &way) } else { 0.0 };
            }
            promise.push(if volume > 0.0 { volume * sum / f64::from(TRIALS) } else { 0.0 });
        }
        let all: f64 = promise.iter().sum();
        let volume = |cell: usize| (edges[cell % c + 1] - edges[cell % c]) / (a * b) as f64;
        let share: Vec<f64> = promise
            .iter()
            .enumerate()
            .map(|(cell, p)| {
                if all > 0.0 {
                    (1.0 - DEFENCE) * p / all + DEFENCE * volume(cell)
                } else {
                    volume(cell)
                }
            })
            .collect();
        let density = share
            .iter()
            .enumerate()
            .map(|(cell, s)| if volume(cell) > 0.0 { s / volume(cell) } else { 0.0 })
            .collect();
        let sum =
            share.iter().scan(0.0, |sum, s| Some(std::mem::replace(sum, *sum + s) + s)).collect();
        Self { edges, sum, density }
    }

    fn numbers(edges: &[f64], cell: usize, u: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = START;
        let (i, j, k) = (cell / (b * c), cell / c % b, cell % c);
        [
            (i as f64 + u[0]) / a as f64,
            (j as f64 + u[1]) / b as f64,
            edges[k] + u[2] * (edges[k + 1] - edges[k]),
        ]
    }

    /// Three numbers for the plain start, and one over their density.
    fn draw(&self, draw: &mut Draw) -> ([f64; 3], f64) {
        let wanted = draw.unit() * self.sum.last().copied().unwrap_or(1.0);
        let cell = self.sum.partition_point(|&s| s <= wanted).min(self.sum.len() - 1);
        let numbers = Self::numbers(&self.edges, cell, [draw.unit(), draw.unit(), draw.unit()]);
        (numbers, 1.0 / self.density[cell])
    }
}

impl TransportProblem for SteeredPhotons<'_> {
    type Value = f64;
    type States = PhotonStates;

    fn channels(&self, side: Side) -> usize {
        self.plain.channels(side)
    }

    fn bins(&self) -> usize {
        self.plain.bins()
    }

    fn start(&self, side: Side, walks: Range<u64>, keys: &[Key], states: &mut PhotonStates) {
        self.plain.start(side, walks, keys, states);
    }

    fn arrive(
        &self,
        side: Side,
        channel: usize,
        states: &PhotonStates,
        ends: &mut Ends<f64>,
    ) -> bool {
        self.plain.arrive(side, channel, states, ends)
    }

    fn expected_contribution(
        &self,
        side: Side,
        _: u32,
        weight: &[f64],
        states: &mut PhotonStates,
        expected: &mut [f64],
    ) -> bool {
        for (i, photon) in states.photons.iter_mut().enumerate() {
            expected[i] = match photon.place {
                Place::Start => -1.0,
                Place::Away => 0.0,
                Place::Collision(label) => match self.domain.lattice.cell(photon.at) {
                    None => -self.plain.survival(side, label, photon.kev),
                    Some(cell) => {
                        photon.cell = cell as u32;
                        let brings = self.value(COME, side, cell, photon.kev, photon.way);
                        promise(weight[i] * brings, self.reading)
                    }
                },
            };
        }
        true
    }

    fn link(
        &self,
        side: Side,
        channel: usize,
        event: u32,
        keys: &[Key],
        states: &mut PhotonStates,
        links: &mut Links<f64>,
    ) -> bool {
        self.plain.link(side, channel, event, keys, states, links)
    }

    fn reveal(&self, side: Side, states: &mut PhotonStates, links: &mut Links<f64>) {
        self.plain.reveal(side, states, links);
    }

    fn scatter(
        &self,
        side: Side,
        event: u32,
        keys: &[Key],
        states: &mut PhotonStates,
        steps: &mut Steps<f64>,
    ) {
        for (i, key) in keys.iter().enumerate() {
            let mut draw = Draw::new(key.split(event, WAY));
            let photon = &states.photons[i];
            let way = match photon.place {
                Place::Start => {
                    let (numbers, factor) = self.starts.draw(&mut draw);
                    let way = self.plain.depart(side, photon.bin, numbers, &mut draw);
                    Way { factor: way.factor * factor, ..way }
                }
                Place::Collision(label) => {
                    let turn = self.plain.turn(side, label, photon.kev);
                    steps.survival[i] = turn.survival();
                    self.pick(&turn, side, photon, &mut draw)
                }
                Place::Away => continue,
            };
            let key = key.split(event, FLIGHT);
            let photon = &mut states.photons[i];
            photon.go(&way, key);
            if way.factor > 0.0 {
                (photon.plan, photon.flown) = self.plan(side, &way, key, &mut draw);
            }
            steps.factor[i] = way.factor * photon.flown;
        }
    }

    fn fly(&self, side: Side, states: &mut PhotonStates) {
        self.plain.fly(side, states);
    }
}
