//! Evidence: what one physics says of one member. The kinds that the program brings are `forecast`, `seen` and `felt`; whoever has another writes it into
//! [`AllEvidence`] of a member's entity, or is an [`EvidenceSource`] of the function [`crate::predict`].

use bevy_ecs::component::Component;
use intrados_scene::Scene;
use intrados_stage::Job;
use serde::Serialize;

use crate::{detect::Reading, predict::PredictError, zone::Zones};

/// What one physics says of one member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Which physics: one word, unique in the program.
    #[serde(skip)]
    pub source: &'static str,
    /// Damage d of the worst zone, 0 to 1.
    pub damage: f64,
    /// Its standard error, without what this physics is blind to.
    pub std_error: f64,
    /// By zone; `None` where it did not look.
    pub zones: Zones,
    /// Whether it was measured on the member, and not foretold.
    pub measured: bool,
    /// What it rests on, one line for people.
    pub basis: String,
    /// Widest crack that it knows of, mm.
    pub crack_width_mm: Option<f64>,
    /// Further numbers, for scripts.
    pub details: serde_json::Map<String, serde_json::Value>,
}

impl Evidence {
    /// Measured evidence; `None` if it looked nowhere.
    #[must_use]
    pub fn measured(source: &'static str, zones: Zones, basis: String) -> Option<Self> {
        let (_, Reading { value, std_error }) = zones.worst()?;
        let details = serde_json::Map::new();
        Some(Self { source, damage: value, std_error, zones, measured: true, basis, crack_width_mm: None, details })
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_speaks_once() {
        let says = |source, value| {
            Evidence::measured(source, Zones::all(Reading { value, std_error: 0.1 }), String::new()).unwrap()
        };
        let mut all = AllEvidence::default();
        [says("seen", 0.1), says("felt", 0.2), says("seen", 0.3)].into_iter().for_each(|e| all.put(e));
        assert_eq!(all.list().iter().map(|e| (e.source, e.damage)).collect::<Vec<_>>(), [("felt", 0.2), ("seen", 0.3)]);
        assert_eq!(Evidence::measured("felt", Zones::default(), String::new()), None);
    }
}
