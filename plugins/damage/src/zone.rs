//! Zones: a member's axis in tenths. Evidence is compared zone by zone, since one physics looks
//! where another does not.

use intrados_stage::Estimate;
use serde::{Deserialize, Serialize};

/// Zones of a member.
pub const ZONES: usize = 10;

/// What is known of each zone; `None` where nothing is, which is not the same as sound.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Zones(pub [Option<Estimate>; ZONES]);

impl Zones {
    /// The same of every zone: of what stands for the whole member.
    #[must_use]
    pub fn all(reading: Estimate) -> Self {
        Self([Some(reading); ZONES])
    }

    /// The zone with the largest damage, the first of equals.
    #[must_use]
    pub fn worst(&self) -> Option<(usize, Estimate)> {
        let known =
            self.0.iter().enumerate().filter_map(|(zone, reading)| Some((zone, (*reading)?)));
        known.reduce(|worst, next| if next.1.value > worst.1.value { next } else { worst })
    }
}

/// The zone that a place on the axis (0 to 1) lies in.
///
/// ```
/// use intrados_damage::zone::zone_at;
/// assert_eq!([zone_at(0.0), zone_at(0.35), zone_at(1.0)], [0, 3, 9]);
/// ```
#[must_use]
pub fn zone_at(along: f64) -> usize {
    ((along * ZONES as f64).floor().max(0.0) as usize).min(ZONES - 1)
}

/// Middle of a zone on the axis, 0 to 1.
#[must_use]
pub fn middle(zone: usize) -> f64 {
    (zone as f64 + 0.5) / ZONES as f64
}

/// Where a zone is, for people: `"20 to 30 %"`.
#[must_use]
pub fn place(zone: usize) -> String {
    format!("{} to {} %", 100 * zone / ZONES, 100 * (zone + 1) / ZONES)
}

/// What is lost by several causes that know nothing of each other: 1 − Π(1 − d).
#[must_use]
pub fn together(causes: impl IntoIterator<Item = f64>) -> f64 {
    1.0 - causes.into_iter().map(|d| 1.0 - d.clamp(0.0, 1.0)).product::<f64>()
}
