//! From what is seen in a section to a damage between 0 and 1, and from damage to a state: numbers
//! that an engineer can edit.

use std::path::Path;

use intrados_assets::GRADING;
use intrados_ct::crack::Crack;
use intrados_scene::Scene;
use intrados_stage::{Estimate, access};
use serde::{Deserialize, Serialize};

use crate::{evidence::Evidence, fusion};

pub use crate::error::ProfileError;

/// Longest profile, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// What a member is called that nothing is known about.
pub const NO_EVIDENCE: &str = "no evidence";

/// A grading profile: a RON file that says who stands behind its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// `"intrados.grading/1"`.
    pub schema: String,
    /// Name, printed in the report.
    pub name: String,
    /// Where its numbers come from.
    pub source: String,
    /// Which edition of that.
    pub edition: String,
    /// Who checked the numbers against the source; empty: nobody.
    pub checked_by: String,
    /// From a section to a damage.
    pub rule: GradingRule,
    /// How evidence is fused.
    #[serde(default)]
    pub fusion: fusion::FusionRule,
    /// Relative standard error of a forecast's damage: of the model and of what it assumes.
    #[serde(default)]
    pub forecast_error: f64,
    /// Whether a member's damage is the share of its strength that what is known of it costs, as it
    /// is computed by finite elements, and not that of its worst zone by the rule. Where that
    /// is not computed its worst zone counts, and the limits of a prediction say so.
    #[serde(default)]
    pub by_strength: bool,
    /// Crack widths that are admitted, by exposure.
    #[serde(default)]
    pub crack_limits: Vec<CrackLimit>,
    /// Damage from which a member counts as severe in scores.
    pub severe_from: f64,
    /// Within how many months to inspect what is probably sound and has not been looked at enough;
    /// none: nobody says.
    #[serde(default = "two_years")]
    pub inspect_within_months: Option<u32>,
    /// From best to worst.
    pub states: Vec<State>,
}

/// Where a profile does not say (ours), months.
fn two_years() -> Option<u32> {
    Some(24)
}

/// How pores and cracks of a section become a damage d: of the strength that sound concrete would
/// have, the share that is lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GradingRule {
    /// Porosity of ordinary concrete, which costs nothing.
    pub sound_porosity: f64,
    /// k in d = 1 − exp(−k (porosity − sound porosity)).
    pub strength_loss: f64,
    /// Opening from which a crack carries nothing across it, mm.
    pub open_crack_mm: f64,
    /// Relative standard error of a crack's share.
    pub crack_error: f64,
}

/// One state of a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Its name.
    pub name: String,
    /// Damage from which it holds.
    pub from: f64,
    /// Crack width from which it holds whatever the damage, mm.
    pub crack_width_mm: Option<f64>,
    /// What to do.
    pub advice: String,
    /// Within how many months it should be done; none: nobody says.
    #[serde(default)]
    pub within_months: Option<u32>,
}

/// Crack widths that a code admits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrackLimit {
    /// Exposure classes that it holds for.
    pub exposure: Vec<String>,
    /// Of reinforced concrete, mm.
    pub reinforced_mm: f64,
    /// Of prestressed concrete with bonded tendons, mm.
    pub prestressed_mm: f64,
}

impl Default for Profile {
    fn default() -> Self {
        Self::parse(GRADING[0].1).unwrap_or_else(|why| {
            unreachable!("this text is part of the program, and a test reads it: {why}")
        })
    }
}

impl Profile {
    /// The profile that a scene names: a file beside it or one that is built in; `None` where it
    /// names none, or none of these, which is said.
    ///
    /// # Errors
    /// There is such a file, and it is wrong.
    pub fn of(scene: &Scene) -> Result<Option<Self>, ProfileError> {
        let Some(name) = scene.structure.profile.as_deref() else { return Ok(None) };
        let beside = scene.path.parent().unwrap_or(Path::new("")).join(name);
        if beside.is_file() {
            return Self::read(&beside).map(Some);
        }
        let known = Self::built_in(name);
        if known.is_none() {
            let names = Self::names().collect::<Vec<_>>().join(", ");
            tracing::warn!(
                "{}: the grading profile \"{name}\" is neither a file beside the scene nor one of {names}; the usual one is used",
                scene.name
            );
        }
        Ok(known)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// Names the file, and says what is wrong.
    pub fn read(path: &Path) -> Result<Self, ProfileError> {
        let bytes = access::read(path, MAX_BYTES)
            .map_err(|why| ProfileError::Unread { path: path.to_owned(), why })?;
        let text = String::from_utf8_lossy(&bytes);
        Self::parse(&text)
            .map_err(|why| ProfileError::File { path: path.to_owned(), why: Box::new(why) })
    }

    /// A profile that is built in.
    ///
    /// ```
    /// use intrados_damage::grading::Profile;
    /// let profile = Profile::built_in("tight_cracks").unwrap();
    /// assert_eq!(profile.state(0.0, 0.15).unwrap().name, "fine");
    /// ```
    #[must_use]
    pub fn built_in(name: &str) -> Option<Self> {
        let (_, text) = GRADING.iter().find(|(known, _)| *known == name)?;
        Self::parse(text).ok()
    }

    /// Names of those that are built in.
    pub fn names() -> impl Iterator<Item = &'static str> {
        GRADING.iter().map(|(name, _)| *name)
    }

    /// Reads a profile.
    ///
    /// # Errors
    /// Says what is wrong, and for syntax where.
    pub fn parse(text: &str) -> Result<Self, ProfileError> {
        let profile: Self = ron::from_str(text).map_err(Box::new)?;
        let GradingRule { sound_porosity, strength_loss, open_crack_mm, crack_error } =
            profile.rule;
        let share = |v: f64| (0.0..=1.0).contains(&v);
        let from_zero = |v: f64| v.is_finite() && v >= 0.0;
        let rises = profile.states.windows(2).all(|w| w[0].from < w[1].from);
        let check = [
            (profile.schema == "intrados.grading/1", "schema must be \"intrados.grading/1\""),
            (share(sound_porosity), "rule.sound_porosity must be from 0 to 1"),
            (from_zero(strength_loss), "rule.strength_loss must be a number from 0 up"),
            (
                open_crack_mm.is_finite() && open_crack_mm > 0.0,
                "rule.open_crack_mm must be above 0",
            ),
            (from_zero(crack_error), "rule.crack_error must be a number from 0 up"),
            (from_zero(profile.forecast_error), "forecast_error must be a number from 0 up"),
            (
                profile.fusion.blindness.iter().all(|b| from_zero(b.2)),
                "fusion.blindness must be numbers from 0 up",
            ),
            (
                profile.fusion.unknown.values().all(|&v| from_zero(v)),
                "fusion.unknown must be numbers from 0 up",
            ),
            (
                profile.fusion.correlation_m.values().all(|&v| v.is_finite() && v > 0.0),
                "fusion.correlation_m must be lengths above 0 m",
            ),
            (
                profile.fusion.correlation.iter().all(|c| c.2.abs() < 1.0),
                "fusion.correlation must lie between -1 and 1",
            ),
            (
                profile
                    .crack_limits
                    .iter()
                    .all(|l| l.reinforced_mm > 0.0 && l.prestressed_mm > 0.0),
                "crack_limits must be above 0 mm",
            ),
            (share(profile.severe_from), "severe_from must be from 0 to 1"),
            (
                profile.states.first().is_some_and(|s| s.from == 0.0) && rises,
                "states must start from 0 and rise",
            ),
            (profile.states.iter().all(|s| share(s.from)), "states must lie from 0 to 1"),
            (
                profile.states.iter().all(|s| s.crack_width_mm.is_none_or(|w| w >= 0.0)),
                "crack_width_mm must be from 0 up",
            ),
        ];
        match check.iter().find(|(fine, _)| !fine) {
            Some((_, reason)) => Err(ProfileError::Value(reason)),
            None => Ok(profile),
        }
    }

    /// The crack width that is admitted in an exposure class, of several the least, mm; `None`
    /// where the profile says nothing.
    #[must_use]
    pub fn crack_limit(&self, exposure: &str, prestressed: bool) -> Option<f64> {
        let classes: Vec<&str> = exposure.split(|c: char| !c.is_ascii_alphanumeric()).collect();
        let limits = self
            .crack_limits
            .iter()
            .filter(|l| l.exposure.iter().any(|e| classes.contains(&e.as_str())));
        limits
            .map(|l| if prestressed { l.prestressed_mm } else { l.reinforced_mm })
            .reduce(f64::min)
    }

    /// Damage from which a member or zone is not sound any more: that of the second state.
    #[must_use]
    pub fn damaged_from(&self) -> f64 {
        self.states.get(1).map_or(self.severe_from, |s| s.from)
    }

    /// What is known of widest cracks (mm), by source: what is measured errs as the rule says, what
    /// is foretold as forecasts do.
    #[must_use]
    pub fn cracks(&self, evidence: &[&Evidence]) -> Vec<Estimate> {
        let error =
            |e: &Evidence| if e.measured { self.rule.crack_error } else { self.forecast_error };
        evidence
            .iter()
            .filter_map(|e| {
                Some(Estimate { value: e.crack_width_mm?, std_error: error(e) * e.crack_width_mm? })
            })
            .collect()
    }

    /// The worst state that a damage or a crack width (mm) calls for, both known exactly; else
    /// [`crate::verdict`].
    #[must_use]
    pub fn state(&self, damage: f64, crack_width_mm: f64) -> Option<&State> {
        let holds =
            |s: &&State| damage >= s.from || s.crack_width_mm.is_some_and(|w| crack_width_mm >= w);
        self.states.iter().rev().find(holds)
    }
}

impl GradingRule {
    /// Damage of a section from its porosity and cracks. `section_mm` is what a crack has to cross:
    /// the root of the body's area.
    ///
    /// d = 1 − (1 − d_pores)(1 − d_cracks), d_pores = 1 − exp(−k (p − p₀)₊), d_cracks = Σ
    /// length/section · min(1, width/open), at most 1. The error is that of reading porosity and
    /// cracks, and not of the rule.
    #[must_use]
    pub fn damage(&self, porosity: Estimate, cracks: &[Crack], section_mm: f64) -> Estimate {
        let of_pores =
            |p: f64| 1.0 - (-self.strength_loss * (p - self.sound_porosity).max(0.0)).exp();
        let cut = |c: &Crack| {
            c.length_mm / section_mm.max(1e-9) * (c.width_mm / self.open_crack_mm).min(1.0)
        };
        let pores = of_pores(porosity.value);
        let cut_all = cracks.iter().map(cut).sum::<f64>();
        let cut_error =
            self.crack_error * cracks.iter().map(|c| cut(c).powi(2)).sum::<f64>().sqrt();
        let cracked = cut_all.min(1.0);
        // Half the way between one standard error down and up, which also holds at the kinks.
        let pores_error = 0.5
            * (of_pores(porosity.value + porosity.std_error)
                - of_pores(porosity.value - porosity.std_error));
        let cracks_error = 0.5 * ((cut_all + cut_error).min(1.0) - (cut_all - cut_error).min(1.0));
        let std_error = (pores_error * (1.0 - cracked)).hypot(cracks_error * (1.0 - pores));
        Estimate { value: 1.0 - (1.0 - pores) * (1.0 - cracked), std_error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_profile_is_sound() {
        let profile = Profile::parse(GRADING[0].1).unwrap();
        let state = |d, w| profile.state(d, w).unwrap().name.clone();
        assert_eq!(
            [state(0.0, 0.0), state(0.1, 0.0), state(0.0, 1.3), state(0.9, 0.0)],
            ["sound", "fair", "poor", "severe"]
        );
    }

    #[test]
    fn all_that_are_built_in_can_be_read() {
        for name in Profile::names() {
            assert!(Profile::built_in(name).is_some(), "{name}");
        }
        assert_eq!(Profile::built_in("four_states"), Some(Profile::default()));
    }

    #[test]
    fn bad_profiles_are_refused_with_a_reason() {
        let says = |from: &str, to: &str| {
            Profile::parse(&GRADING[0].1.replace(from, to)).unwrap_err().to_string()
        };
        assert!(says("open_crack_mm: 1.0", "open_crack_mm: 0.0").contains("open_crack_mm"));
        assert!(says("from: 0.25", "from: 0.05").contains("rise"));
        assert!(says("grading/1", "grading/2").contains("schema"));
        assert!(says("severe_from", "severe").contains("severe"));
    }

    #[test]
    fn damage_by_hand() {
        let rule = Profile::default().rule;
        let p = |value| Estimate { value, std_error: 0.0 };
        assert_eq!(rule.damage(p(0.01), &[], 100.0).value, 0.0);
        let half = rule.damage(p(0.02 + 2_f64.ln() / 7.0), &[], 100.0);
        assert!((half.value - 0.5).abs() < 1e-12);
        let crack = Crack {
            length_px: 0.0,
            length_mm: 50.0,
            width_mm: 0.5,
            at_mm: [0.0; 2],
            box_mm: [0.0; 2],
        };
        let both = rule.damage(p(0.02 + 2_f64.ln() / 7.0), &[crack], 100.0);
        assert!((both.value - (1.0 - 0.5 * 0.75)).abs() < 1e-12);
        assert!((both.std_error - 0.25 * 0.25 * 0.5).abs() < 1e-12);
    }
}
