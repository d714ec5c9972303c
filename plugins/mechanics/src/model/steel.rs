//! Bars and tendons in bricks.

use super::Plate;
use crate::{
    element::{ElementError, rod::Piece},
    material::{
        bond::{Bond, BondState},
        chloride::corroded,
        steel::{Bar, BarState, Strand, remaining_section},
    },
};

/// A bar or a tendon.
#[derive(Debug, Clone)]
pub struct Steel {
    /// Its name; tendons are reported by it.
    pub name: String,
    /// Where it lies.
    pub pieces: Vec<Piece>,
    /// Cross-section, m².
    pub area: f64,
    /// How many bars it stands for, which share its section and lie too near each other to be told
    /// apart.
    pub count: f64,
    /// What it is.
    pub kind: SteelKind,
    /// What takes its section; none: nothing.
    pub rust: Option<Rust>,
    /// Share of every piece's section that is gone from the beginning, 0 to 1; empty: nothing is.
    pub gone: Vec<f64>,
    /// How it slips; none: perfect bond. For bars.
    pub bond: Option<Slipping>,
    /// Whether there is no concrete where it lies; else it is added to the concrete, as closed
    /// forms and decks of other programs have it.
    pub displaces: bool,
}

/// Bond that gives way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slipping {
    /// Its law.
    pub bond: Bond,
    /// Of the bar, m.
    pub perimeter: f64,
    /// Whether its first and its last end are anchored: they do not slip.
    pub anchored: [bool; 2],
}

/// Rust on a bar: Faraday's loss all around, from the moment on when enough chloride has come to
/// it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rust {
    /// Of the sound bar, m.
    pub diameter: f64,
    /// Corrosion current, A/m².
    pub current: f64,
    /// When each piece begins to rust, s; infinite: never.
    pub since: Vec<f64>,
    /// Concrete over each piece, m.
    pub cover: Vec<f64>,
}

impl Rust {
    /// Share of the section that is left at a time of a piece that rusts since `since`.
    #[must_use]
    pub(crate) fn left(&self, since: f64, time: f64) -> f64 {
        if time > since {
            remaining_section(self.diameter, corroded(self.current, time - since, 1.0))
        } else {
            1.0
        }
    }
}

/// Reinforcement and prestressing steel.
#[derive(Debug, Clone)]
pub enum SteelKind {
    /// A ribbed bar, bonded from the beginning of its host.
    Bar(Bar),
    /// The same, each piece with a stress before anything acts, Pa.
    Stressed(Bar, Vec<f64>),
    /// A tendon, stressed at a time.
    Tendon(Tendon),
}

/// How a tendon is stressed.
#[derive(Debug, Clone)]
pub struct Tendon {
    /// Its steel.
    pub strand: Strand,
    /// When it is stressed, s: before, it does nothing.
    pub at: f64,
    /// Stress at the jack, Pa.
    pub jacking: f64,
    /// Stress of each piece right after stressing: friction and slip of the anchor are lost, Pa.
    pub stress: Vec<f64>,
    /// Whether it is bonded afterwards; else its stress changes with the mean strain of its whole
    /// length.
    pub bonded: bool,
    /// What its ends press against the concrete with; none: they pull at points.
    pub plates: [Option<Plate>; 2],
}

/// What a piece remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Piecework {
    /// Of a bar.
    pub bar: BarState,
    /// Strain of the host when the tendon was stressed; NaN before.
    pub locked: f64,
    /// Lost by relaxation, Pa.
    pub relaxed: f64,
    /// Stress, Pa.
    pub stress: f64,
    /// Of bond at its ends.
    pub bond: [BondState; 2],
}

/// How long jacking takes, s.
pub(crate) const JACKING: f64 = 21_600.0;

impl Steel {
    /// Diameter of one of its bars, m.
    #[must_use]
    pub fn diameter(&self) -> f64 {
        (4.0 * self.area / (std::f64::consts::PI * self.count)).sqrt()
    }

    /// What its pieces remember before anything has happened.
    pub(super) fn rest(&self) -> Vec<Piecework> {
        let initial = |piece: usize| match &self.kind {
            // A strain that was lost beforehand.
            SteelKind::Stressed(bar, stress) => {
                BarState { plastic: -stress[piece] / bar.modulus, ..BarState::default() }
            }
            _ => BarState::default(),
        };
        (0..self.pieces.len())
            .map(|piece| Piecework {
                locked: f64::NAN,
                bar: initial(piece),
                ..Piecework::default()
            })
            .collect()
    }

    /// Mean strain of the host along the whole tendon, where that is what counts.
    pub(super) fn mean_strain(&self, u: impl Fn(usize) -> [f64; 24]) -> f64 {
        match &self.kind {
            SteelKind::Tendon(tendon) if !tendon.bonded => {}
            _ => return f64::NAN,
        }
        let (mut sum, mut length) = (0.0, 0.0);
        for piece in &self.pieces {
            if let Ok(row) = piece.strain_row() {
                sum +=
                    piece.length() * row.iter().zip(u(piece.host)).map(|(r, u)| r * u).sum::<f64>();
                length += piece.length();
            }
        }
        sum / length
    }

    /// Stress, ∂stress/∂strain and memory of a piece at a strain of its host at the end of a step.
    pub(super) fn answer(
        &self,
        piece: usize,
        strain: f64,
        mean: f64,
        before: &Piecework,
        span: [f64; 2],
    ) -> (f64, f64, Piecework) {
        match &self.kind {
            SteelKind::Bar(bar) | SteelKind::Stressed(bar, _) => {
                let (stress, tangent, state) = bar.respond(strain, &before.bar);
                (stress, tangent, Piecework { bar: state, stress, ..*before })
            }
            SteelKind::Tendon(tendon) => {
                let (strain, slope) =
                    if tendon.bonded { (strain, tendon.strand.modulus) } else { (mean, 0.0) };
                if before.locked.is_nan() {
                    // The jack gives the force, whatever the concrete does, until it is locked.
                    let share = ((span[1] - tendon.at) / JACKING).clamp(0.0, 1.0);
                    let stress = share * tendon.stress[piece];
                    let locked = if share < 1.0 { f64::NAN } else { strain };
                    return (stress, 0.0, Piecework { locked, stress, ..*before });
                }
                let strand = &tendon.strand;
                let relaxed =
                    before.relaxed + strand.relax(before.stress, before.relaxed, span[1] - span[0]);
                let strained = strain - before.locked - before.bar.plastic;
                let trial = tendon.stress[piece] + strand.modulus * strained - relaxed;
                // Beyond the proof stress it hardens; plastic strain is kept as that of a bar is.
                let slower =
                    strand.modulus * strand.hardening() / (strand.modulus - strand.hardening());
                let over = trial - strand.proof - slower * before.bar.accumulated;
                if over <= 0.0 {
                    return (trial, slope, Piecework { relaxed, stress: trial, ..*before });
                }
                let flow = over / (strand.modulus + slower);
                let bar = BarState {
                    plastic: before.bar.plastic + flow,
                    accumulated: before.bar.accumulated + flow,
                    ..before.bar
                };
                let stress = trial - strand.modulus * flow;
                let slope = if slope > 0.0 { strand.hardening() } else { 0.0 };
                (stress, slope, Piecework { relaxed, stress, bar, ..*before })
            }
        }
    }

    /// Cross-section of a piece at a time, m².
    #[must_use]
    pub(crate) fn area_at(&self, piece: usize, time: f64) -> f64 {
        let since = |rust: &Rust| rust.since.get(piece).copied().unwrap_or(f64::INFINITY);
        let rusted = self.rust.as_ref().map_or(1.0, |rust| rust.left(since(rust), time));
        self.area * rusted * (1.0 - self.gone.get(piece).copied().unwrap_or(0.0))
    }

    /// Adds stiffness and force of a bonded piece to those of its host.
    pub(super) fn add(
        &self,
        piece: usize,
        u: &[f64; 24],
        mean: f64,
        before: &Piecework,
        span: [f64; 2],
        both: [&mut [f64]; 2],
    ) -> Result<(), ElementError> {
        let law = |strain: f64| {
            let (stress, tangent, _) = self.answer(piece, strain, mean, before, span);
            (stress, tangent)
        };
        self.pieces[piece].add_bonded(u, self.area_at(piece, span[1]), law, both)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        element::{embed::embed, hex8},
        material::YEAR,
    };
    use glam::DVec3;

    /// A bar of 8 mm that begins to rust after ten years at 1 µA/cm²: twenty years later 11.6 µm a
    /// year are gone all around, and so much less it bears.
    #[test]
    fn rust_takes_the_bar() {
        let corners = hex8::CORNERS;
        let find = |p: DVec3| hex8::locate(&corners, p).map(|natural| (0, natural));
        let pieces =
            embed(&[DVec3::new(-0.9, 0.1, 0.2), DVec3::new(0.9, 0.1, 0.2)], find, |_| corners)
                .unwrap();
        let rust =
            Rust { diameter: 8e-3, current: 0.01, since: vec![10.0 * YEAR], cover: vec![0.03] };
        let kind = SteelKind::Bar(Bar::new(500e6).unwrap());
        let steel = Steel {
            name: "bar".into(),
            pieces,
            area: 5e-5,
            count: 1.0,
            kind,
            rust: Some(rust),
            gone: Vec::new(),
            bond: None,
            displaces: true,
        };
        let u: [f64; 24] =
            std::array::from_fn(|i| if i % 3 == 0 { 1e-3 * corners[i / 3].x } else { 0.0 });
        let force = |time: f64| {
            let (mut k, mut force) = ([0.0; 24 * 24], [0.0; 24]);
            let before = &steel.rest()[0];
            steel.add(0, &u, f64::NAN, before, [0.0, time], [&mut k, &mut force]).unwrap();
            force
        };
        let (sound, rusty) = (force(9.9 * YEAR), force(30.0 * YEAR));
        let left = (1.0 - 2.0 * 20.0 * 11.6e-6 / 8e-3_f64).powi(2);
        assert!(sound[3].abs() > 1.0);
        assert!(
            sound.iter().zip(rusty).all(|(s, r)| (left * s - r).abs() < 1e-9 * sound[3].abs()),
            "{sound:?} {rusty:?} {left}"
        );
    }
}
