//! How slices are read.

use serde::{Deserialize, Serialize};

use crate::{crack, error::DetectError};

/// How it is decided which pixels are dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Method {
    /// A local threshold, and a ridge filter for cracks.
    #[default]
    Classical,
    /// The [`Network`](crate::Network) that has learnt on mortar, scanned sharply.
    Network,
    /// The [`Network`](crate::Network) that has learnt on scans of whole members, with their blur, noise and
    /// grains.
    Members,
}

/// How to detect. Lengths in pixels of `chosen_at_mm` and no fewer than so many of the slice's own,
/// grey relative to sound concrete.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetectSettings {
    /// Who decides.
    pub method: Method,
    /// Edge of the pixels that lengths and areas were chosen on, mm: on finer ones windows and
    /// filters cover the same millimetres. None where the size of a pixel is not known: pixels as
    /// they are.
    pub chosen_at_mm: Option<f32>,
    /// The network's probability from which a pixel is dark.
    pub chance: f32,
    /// Standard uncertainty of that.
    pub chance_error: f32,
    /// Edge of the window of the local threshold, odd.
    pub window: usize,
    /// Sauvola's k.
    pub k: f32,
    /// Sauvola's r: the standard deviation at which the threshold is the mean.
    pub r: f32,
    /// Grey above which a pixel is as good as sound: aggregate and the blurred edge of a bar.
    pub ceiling: f32,
    /// Grey above which a pixel is metal, not concrete.
    pub metal: f32,
    /// Smallest pore, pixels.
    pub min_area: usize,
    /// Smallest missing mass Σ (1 − grey) of a pore.
    pub min_mass: f32,
    /// The same for a pore that touches the body's outline, where slices are darker by themselves.
    pub rim_mass: f32,
    /// Lets a pore grow over pixels that lie at most so much above the threshold.
    pub hysteresis: Option<f32>,
    /// Splits touching pores where the distance map has two peaks at least so much above the saddle
    /// between them.
    pub split: Option<f32>,
    /// Standard uncertainty of the threshold: where on its blurred edge a pore is said to end is a
    /// convention.
    pub threshold_error: f32,
    /// How cracks are found.
    pub crack: crack::CrackSettings,
}

impl Default for DetectSettings {
    fn default() -> Self {
        Self {
            method: Method::Classical,
            chosen_at_mm: Some(0.1),
            chance: 0.72,
            chance_error: 0.2,
            window: 51,
            k: 0.08,
            r: 0.5,
            ceiling: 1.2,
            metal: 1.5,
            min_area: 3,
            min_mass: 0.5,
            rim_mass: 1.5,
            hysteresis: None,
            split: None,
            threshold_error: 0.008,
            crack: crack::CrackSettings::default(),
        }
    }
}

impl DetectSettings {
    /// For scans of members: a pixel that is half air is dark, and cracks may be faint, as chosen
    /// on rehearsals of `experiment table-3-1`.
    #[must_use]
    pub fn of_members() -> Self {
        let crack = crack::CrackSettings {
            possible: 0.08,
            likely: 0.5,
            min_pixels: 12,
            ..crack::CrackSettings::default()
        };
        Self { method: Method::Members, chance: 0.6, chance_error: 0.1, crack, ..Self::default() }
            .in_members()
    }

    /// The same for slices of members: what is shorter than the usual largest grain (16 mm) cracks
    /// none. Two pores that touch, or one that a bar cuts, are as long for their width.
    #[must_use]
    pub fn in_members(self) -> Self {
        const GRAIN_MM: f32 = 16.0;
        Self {
            crack: crack::CrackSettings {
                likely_length_mm: self.crack.likely_length_mm.max(GRAIN_MM),
                ..self.crack
            },
            ..self
        }
    }

    /// The same in pixels of `pixel_mm`.
    #[must_use]
    pub(crate) fn on_pixels(&self, pixel_mm: f32) -> Self {
        let finer = self.chosen_at_mm.map_or(1.0, |chosen| (chosen / pixel_mm).max(1.0));
        let area = finer * finer;
        let count = |n: usize, by: f32| (n as f32 * by).round() as usize;
        let crack = crack::CrackSettings {
            min_length: self.crack.min_length * finer,
            min_pixels: count(self.crack.min_pixels, area),
            ..self.crack
        };
        Self {
            window: count(self.window, finer) | 1,
            min_area: count(self.min_area, area),
            min_mass: self.min_mass * area,
            rim_mass: self.rim_mass * area,
            chosen_at_mm: None,
            crack,
            ..*self
        }
    }

    /// How it is decided what is a pore in a slice of this pixel, for people.
    #[must_use]
    pub fn says(&self, pixel_mm: f32) -> String {
        let Self { window, min_mass, rim_mass, .. } = self.on_pixels(pixel_mm);
        let filters = format!("missing mass at least {min_mass} px, at the rim {rim_mass} px");
        let network = |taught: &str| {
            format!(
                "network taught on {taught}, dark from a probability of {} ± {}; {filters}",
                self.chance, self.chance_error
            )
        };
        match self.method {
            Method::Classical => format!(
                "local threshold (Sauvola) in a window of {:.2} mm ({} px of {pixel_mm} mm), k = {}, r = {}; ridge filter for cracks; {filters}",
                window as f32 * pixel_mm,
                window,
                self.k,
                self.r
            ),
            Method::Network => network("simulated mortar"),
            Method::Members => network("simulated scans of members"),
        }
    }

    /// Refuses what cannot work.
    ///
    /// # Errors
    /// Names the setting.
    pub fn check(&self) -> Result<(), DetectError> {
        let numbers =
            [self.k, self.ceiling, self.metal, self.min_mass, self.rim_mass, self.threshold_error];
        match () {
            () if self.window < 3 || self.window.is_multiple_of(2) => {
                Err(DetectError::Setting("window: must be odd and at least 3"))
            }
            () if !(0.0 < self.chance
                && self.chance < 1.0
                && 0.0 <= self.chance_error
                && self.chance_error < 1.0) =>
            {
                Err(DetectError::Setting("chance: must lie between 0 and 1"))
            }
            () if self.chosen_at_mm.is_some_and(|mm| !(mm.is_finite() && mm > 0.0 && mm < 1e3)) => {
                Err(DetectError::Setting("chosen_at_mm: must be above 0 mm"))
            }
            () if !(self.r.is_finite() && self.r > 0.0) => {
                Err(DetectError::Setting("r: must be above 0"))
            }
            () if numbers.iter().any(|v| !(v.is_finite() && *v >= 0.0)) => {
                Err(DetectError::Setting("must be a number from 0 up"))
            }
            () => Ok(()),
        }
    }
}
