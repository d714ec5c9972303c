//! Who looks on while walks teach.

use intrados_transport::{Side, Tally, Trace, TransportProblem, WalkObserver};

use super::{
    Domain,
    field::{COME, GO, Taught},
};
use crate::problem::{Photon, PhotonProblem, PhotonStates, Place};

const NONE: u32 = u32::MAX;

/// One step: where it left and where it came, bins and weights.
struct Note {
    bins: [u32; 2],
    weights: [f64; 2],
}

/// A photon for the other side's field.
pub(crate) struct Seen {
    table: usize,
    bin: u32,
    value: f64,
}

/// Looks on at one batch.
pub(crate) struct Recorder<'p, 'a> {
    plain: &'p PhotonProblem<'a>,
    domain: &'p Domain,
    side: Side,
    /// What a score in each pixel counts.
    gains: &'p [f64],
    trace: Trace<Note>,
    seen: Vec<Seen>,
}

impl<'p, 'a> Recorder<'p, 'a> {
    pub(crate) fn new(
        plain: &'p PhotonProblem<'a>,
        domain: &'p Domain,
        side: Side,
        gains: &'p [f64],
    ) -> Self {
        Self { plain, domain, side, gains, trace: Trace::default(), seen: Vec::new() }
    }

    /// Adds what was seen to the other side's lessons and what was found to the own ones.
    pub(crate) fn tell(self, other: &mut [Vec<Taught>; 2], own: &mut [Vec<Taught>; 2]) {
        for seen in self.seen {
            other[seen.table][seen.bin as usize].photon(seen.value);
        }
        for (note, score) in self.trace.suffixes() {
            for table in [GO, COME] {
                if note.bins[table] != NONE && note.weights[table] > 0.0 {
                    own[table][note.bins[table] as usize].suffix(score, note.weights[table]);
                }
            }
        }
    }

    /// Cell, and attenuation there in 1/m.
    fn at(&self, photon: &Photon) -> Option<(usize, f64)> {
        let label = PhotonProblem::label(photon)?;
        let specimen = self.plain.specimen;
        Some((
            self.domain.lattice.cell(photon.at)?,
            specimen.density(label) * specimen.matter(label).total(photon.kev),
        ))
    }

    fn see(&mut self, table: usize, cell: usize, photon: &Photon, value: f64) {
        let bin = self.domain.bin(self.side.other(), cell, photon.kev, -photon.way) as u32;
        if value > 0.0 {
            self.seen.push(Seen { table, bin, value });
        }
    }
}

impl<P: TransportProblem<Value = f64, States = PhotonStates>> WalkObserver<P> for Recorder<'_, '_> {
    fn begin(&mut self, n: usize) {
        self.trace.begin(n);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.trace.follow(rows);
    }

    /// Place and label are still those of the event, way and energy those of the flight to come.
    fn depart(&mut self, event: u32, states: &PhotonStates, weight: &[f64], _: &[f64]) {
        for (row, (photon, w)) in states.photons.iter().zip(weight).enumerate() {
            // Before the flight was drawn.
            let w = w / photon.flown;
            let mut note = Note { bins: [NONE; 2], weights: [w, 0.0] };
            if let Some((cell, mu)) = self.at(photon).filter(|_| event > 0) {
                note.bins[GO] = self.domain.bin(self.side, cell, photon.kev, photon.way) as u32;
                let gain =
                    if self.side == Side::Primal { self.gains[photon.bin as usize] } else { 1.0 };
                self.see(COME, cell, photon, gain * w / mu);
            }
            self.trace.step(row, note);
        }
    }

    fn land(&mut self, event: u32, states: &PhotonStates, weight: &[f64]) {
        for (row, (photon, &w)) in states.photons.iter().zip(weight).enumerate() {
            let Some((cell, mu)) = self.at(photon).filter(|_| photon.place != Place::Away) else {
                continue;
            };
            let bin = self.domain.bin(self.side, cell, photon.kev, photon.way) as u32;
            if let Some((note, _)) = self.trace.at(row) {
                (note.bins[COME], note.weights[COME]) = (bin, w);
            }
            // What comes straight from its start is found by links.
            if event > 1 {
                let gain =
                    if self.side == Side::Primal { self.gains[photon.bin as usize] } else { 1.0 };
                self.see(GO, cell, photon, gain * w / mu);
            }
        }
    }

    fn score(&mut self, row: usize, bin: u32, value: f64) {
        let unit = if self.side == Side::Dual { 1.0 / self.gains.len() as f64 } else { 1.0 };
        self.trace.score(row, value * unit * self.gains[bin as usize]);
    }
}

/// Scores a walk: mean over the pixels of what their gains make of it.
pub(crate) struct Totals<'p> {
    gains: &'p [f64],
    unit: f64,
    pub(crate) walks: Vec<f64>,
}

impl<'p> Totals<'p> {
    pub(crate) fn new(side: Side, gains: &'p [f64], n: u64) -> Self {
        let unit = if side == Side::Dual { 1.0 / gains.len() as f64 } else { 1.0 };
        Self { gains, unit, walks: vec![0.0; n as usize] }
    }
}

impl Tally<f64> for Totals<'_> {
    fn score(&mut self, walk: u32, bin: u32, _: u32, value: f64) {
        self.walks[walk as usize] += value * self.unit * self.gains[bin as usize];
    }
}
