//! What a monitored gauge would show through a life.

use serde::{Deserialize, Serialize};

/// What a forecast says that a gauge shows through the life of a sound member.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GaugeCourse {
    /// Name of the gauge.
    pub gauge: String,
    /// Age of the member, days, rising.
    pub days: Vec<f64>,
    /// Strain then, since the beginning.
    pub strain: Vec<f64>,
    /// The elastic part of it now.
    pub elastic: f64,
}

impl GaugeCourse {
    /// Strain at an age in days, between those that are known; the nearest beyond them.
    pub fn at(&self, day: f64) -> f64 {
        let after = self.days.partition_point(|d| *d <= day);
        let (Some(&last), true) = (self.strain.last(), after > 0) else {
            return self.strain.first().copied().unwrap_or_default();
        };
        let (Some(&d1), Some(&s1)) = (self.days.get(after), self.strain.get(after)) else {
            return last;
        };
        let (d0, s0) = (self.days[after - 1], self.strain[after - 1]);
        s0 + (s1 - s0) * (day - d0) / (d1 - d0)
    }
}
