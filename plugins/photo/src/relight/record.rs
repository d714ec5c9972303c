//! What is written of the light that was taken off. Part of schema `intrados.photo/1`.

use serde::Serialize;

use super::{Relit, fit::BENDS};

/// A lamp, or lamps that the photograph cannot tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LampRecord {
    /// Their names.
    pub lamps: Vec<String>,
    /// How brightly they burnt, red, green and blue: as a multiple of what the scene says, times
    /// the photograph's exposure and white balance.
    pub strength: [f64; 3],
    /// Standard errors of these.
    pub strength_error: [f64; 3],
}

/// What was fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RelitRecord {
    /// Each lamp.
    pub lamps: Vec<LampRecord>,
    /// Lamps of which nothing reaches what is seen: nothing is known of them.
    pub unseen: Vec<String>,
    /// v₁ and v₂ of the vignetting 1 + v₁r² + v₂r⁴, r = 1 in the picture's corners.
    pub vignetting: [f64; BENDS],
    /// Standard errors of these.
    pub vignetting_error: [f64; BENDS],
    /// Robust standard deviation of the photograph over what was expected, by channel: texture,
    /// noise, and what the scene does not know.
    pub residual_scatter: [f64; 3],
    /// Share of light on members that was reflected on its way.
    pub reflected_share: f64,
    /// Share of the pixels that show members' faces of which the reflectance is unknown.
    pub unknown: f64,
    /// Times that light was computed.
    pub rounds: u32,
    /// Walks a pixel and lamp.
    pub samples: u64,
    /// Pixels of the pictures of light.
    pub size: [usize; 2],
}

impl Relit {
    /// What is written of it.
    #[must_use]
    pub fn record(&self) -> RelitRecord {
        let n = self.groups.len();
        let error = |k: usize| self.fit.covariance[(k, k)].max(0.0).sqrt();
        let lamp = |(k, group): (usize, &super::Group)| LampRecord {
            lamps: group.names.clone(),
            strength: self.fit.strength[k],
            strength_error: [0, 1, 2].map(|c| error(c * n + k)),
        };
        RelitRecord {
            lamps: self.groups.iter().enumerate().map(lamp).collect(),
            unseen: self.unseen.clone(),
            vignetting: self.fit.bends,
            vignetting_error: [3 * n, 3 * n + 1].map(error),
            residual_scatter: self.fit.scatter,
            reflected_share: self.reflected_share,
            unknown: self.unknown,
            rounds: self.rounds,
            samples: self.samples,
            size: self.frame.size,
        }
    }
}
