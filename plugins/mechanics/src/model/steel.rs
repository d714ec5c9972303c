//! Bars and tendons in bricks.

use crate::{
    element::{Element, ElementError, rod::Piece},
    material::steel::{Bar, BarState, Strand},
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
    /// What it is.
    pub kind: SteelKind,
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
    /// Whether it is bonded afterwards; else its stress changes with the mean strain of its whole length.
    pub bonded: bool,
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
}

/// How long jacking takes, s.
pub const JACKING: f64 = 21_600.0;

impl Steel {
    /// What its pieces remember before anything has happened.
    pub(super) fn rest(&self) -> Vec<Piecework> {
        let initial = |piece: usize| match &self.kind {
            // A strain that was lost beforehand.
            SteelKind::Stressed(bar, stress) => BarState { plastic: -stress[piece] / bar.modulus, ..BarState::default() },
            _ => BarState::default(),
        };
        (0..self.pieces.len()).map(|piece| Piecework { locked: f64::NAN, bar: initial(piece), ..Piecework::default() }).collect()
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
                sum += piece.length() * row.iter().zip(u(piece.host)).map(|(r, u)| r * u).sum::<f64>();
                length += piece.length();
            }
        }
        sum / length
    }

    /// Stress, ∂stress/∂strain and memory of a piece at a strain of its host at the end of a step.
    pub(super) fn answer(&self, piece: usize, strain: f64, mean: f64, before: &Piecework, span: [f64; 2]) -> (f64, f64, Piecework) {
        match &self.kind {
            SteelKind::Bar(bar) | SteelKind::Stressed(bar, _) => {
                let (stress, tangent, state) = bar.respond(strain, &before.bar);
                (stress, tangent, Piecework { bar: state, stress, ..*before })
            }
            SteelKind::Tendon(tendon) => {
                let (strain, slope) = if tendon.bonded { (strain, tendon.strand.modulus) } else { (mean, 0.0) };
                if before.locked.is_nan() {
                    // The jack gives the force, whatever the concrete does, until it is locked.
                    let share = ((span[1] - tendon.at) / JACKING).clamp(0.0, 1.0);
                    let stress = share * tendon.stress[piece];
                    let locked = if share < 1.0 { f64::NAN } else { strain };
                    return (stress, 0.0, Piecework { locked, stress, ..*before });
                }
                let relaxed = before.relaxed + tendon.strand.relax(before.stress, before.relaxed, span[1] - span[0]);
                let stress = tendon.stress[piece] + tendon.strand.modulus * (strain - before.locked) - relaxed;
                (stress, slope, Piecework { relaxed, stress, ..*before })
            }
        }
    }

    /// Stiffness and force of a piece on its host.
    pub(super) fn element(
        &self,
        piece: usize,
        u: &[f64; 24],
        mean: f64,
        before: &Piecework,
        span: [f64; 2],
    ) -> Result<Element<24>, ElementError> {
        self.pieces[piece].bonded(u, self.area, |strain| {
            let (stress, tangent, _) = self.answer(piece, strain, mean, before, span);
            (stress, tangent)
        })
    }
}
