//! Evidence: what one physics says of one member. Today there is one kind, `seen` in CT slices; stress, sensitivities and fresh X-ray
//! scans are further [`EvidenceSource`]s, or write into [`AllEvidence`] of a member's entity.

use bevy_ecs::component::Component;
use intrados_scene::Scene;
use intrados_stage::Job;
use serde::Serialize;

use crate::{detect::Reading, predict::PredictError};

/// What one physics says of one member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Which physics: one word, unique in the program.
    #[serde(skip)]
    pub source: &'static str,
    /// Damage d, 0 to 1.
    pub damage: f64,
    /// Its standard error.
    pub std_error: f64,
    /// What it rests on, one line for people.
    pub basis: String,
    /// Widest crack that it knows of, mm.
    pub crack_width_mm: Option<f64>,
    /// Further numbers, for scripts.
    pub details: serde_json::Map<String, serde_json::Value>,
}

/// Something that can say how damaged a member is.
pub trait EvidenceSource: Send + Sync {
    /// What it knows of member `index`; `None` where it knows nothing, which is not the same as sound.
    ///
    /// # Errors
    /// The input is bad, or the job was cancelled.
    fn evidence(&self, scene: &Scene, index: usize, job: &Job) -> Result<Option<Evidence>, PredictError>;
}

/// Everything said of one member; lives on the member's entity. Any plugin may add to it.
#[derive(Component, Debug, Clone, Default, PartialEq)]
pub struct AllEvidence(Vec<Evidence>);

impl AllEvidence {
    /// Adds evidence, in the place of what the same source said before.
    pub fn put(&mut self, evidence: Evidence) {
        self.0.retain(|e| e.source != evidence.source);
        self.0.push(evidence);
        self.0.sort_by_key(|e| e.source);
    }

    /// All of it, in the order of the sources' names.
    #[must_use]
    pub fn list(&self) -> &[Evidence] {
        &self.0
    }
}

/// Several pieces of evidence made one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fused {
    /// Damage d and its standard error.
    pub damage: Reading,
    /// χ² of the pieces about their mean, where there is more than one.
    pub chi2: Option<f64>,
    /// Whether they contradict each other: χ² above what chance gives once in a hundred.
    pub conflict: bool,
}

/// No physics is surer than this: keeps a reading that claims no error from silencing all others.
const SMALLEST_ERROR: f64 = 0.005;

/// Mean weighted by inverse variance. Where the pieces contradict each other the error is widened by √(χ²/(n−1)) (Birge 1932).
/// `None` where there is no evidence.
#[must_use]
pub fn fuse(pieces: &[Evidence]) -> Option<Fused> {
    let weight = |e: &Evidence| e.std_error.max(SMALLEST_ERROR).powi(-2);
    let total: f64 = pieces.iter().map(weight).sum();
    if pieces.is_empty() || !total.is_finite() {
        return None;
    }
    let value = pieces.iter().map(|e| weight(e) * e.damage).sum::<f64>() / total;
    let chi2: f64 = pieces.iter().map(|e| weight(e) * (e.damage - value).powi(2)).sum();
    let freedom = pieces.len() as f64 - 1.0;
    let conflict = freedom > 0.0 && chi2 > chi2_99(freedom);
    let widened = if conflict { (chi2 / freedom).sqrt() } else { 1.0 };
    let damage = Reading { value: value.clamp(0.0, 1.0), std_error: total.sqrt().recip() * widened };
    Some(Fused { damage, chi2: (freedom > 0.0).then_some(chi2), conflict })
}

/// The 99 % point of χ² (Wilson and Hilferty 1931; within 2 %).
fn chi2_99(freedom: f64) -> f64 {
    let a = 2.0 / (9.0 * freedom);
    freedom * (1.0 - a + 2.326_348 * a.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(source: &'static str, damage: f64, std_error: f64) -> Evidence {
        Evidence { source, damage, std_error, basis: String::new(), crack_width_mm: None, details: serde_json::Map::new() }
    }

    #[test]
    fn the_surer_piece_weighs_more() {
        let fused = fuse(&[says("a", 0.2, 0.1), says("b", 0.4, 0.2)]).unwrap();
        assert!((fused.damage.value - 0.24).abs() < 1e-12);
        assert!((fused.damage.std_error - (1.0_f64 / 125.0).sqrt()).abs() < 1e-12);
        assert!(!fused.conflict);
        assert_eq!(fuse(&[]), None);
    }

    #[test]
    fn contradiction_is_flagged_and_widens_the_error() {
        let fused = fuse(&[says("a", 0.1, 0.05), says("b", 0.6, 0.05)]).unwrap();
        assert!(fused.conflict);
        assert!((fused.damage.std_error - 0.25).abs() < 1e-12);
    }

    #[test]
    fn a_source_speaks_once() {
        let mut all = AllEvidence::default();
        [says("seen", 0.1, 0.1), says("felt", 0.2, 0.1), says("seen", 0.3, 0.1)].into_iter().for_each(|e| all.put(e));
        assert_eq!(all.list().iter().map(|e| (e.source, e.damage)).collect::<Vec<_>>(), [("felt", 0.2), ("seen", 0.3)]);
    }

    #[test]
    fn chi2_points() {
        for (freedom, point) in [(1.0, 6.635), (2.0, 9.210), (5.0, 15.086)] {
            assert!((chi2_99(freedom) / point - 1.0).abs() < 0.02);
        }
    }
}
