//! Predictions beside the truth, where it is known.

use intrados_ct::score::Tally;
use intrados_damage::{
    grading::Profile,
    score::{Cases, MemberScore, Outcome},
};
use intrados_stage::Estimate;
use serde::Deserialize;
use serde::Serialize;

use crate::{PredictSettings, SliceReading, prediction::MemberPrediction};

/// Scores members whose truth is known, of one scene or of many.
#[must_use]
pub fn score(members: &[MemberPrediction], settings: &PredictSettings) -> MemberScore {
    Compared::of(members).score(&settings.profile)
}

/// Predictions beside what is true: all that scores rest on.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Compared {
    members: Vec<Outcome>,
    zones: Vec<Vec<Outcome>>,
    porosities: Vec<Outcome>,
    widths: Vec<Outcome>,
    slices: Vec<Tally>,
}

impl Compared {
    /// Of members whose truth is known.
    #[must_use]
    pub fn of(members: &[MemberPrediction]) -> Self {
        let outcome = |m: &MemberPrediction| {
            Some(Outcome {
                truth: m.truth.as_ref()?.damage,
                damage: m.damage?,
                std_error: m.damage_std_error?,
            })
        };
        let zones = |m: &MemberPrediction| {
            let truth = m.truth.as_ref()?.zones?;
            let of = |(truth, known): (f64, &Option<Estimate>)| {
                known.map(|r| Outcome { truth, damage: r.value, std_error: r.std_error })
            };
            Some(truth.into_iter().zip(&m.zones.0).filter_map(of).collect::<Vec<_>>())
        };
        let readings = || members.iter().flat_map(|m| &m.slices);
        let porosity = |r: &SliceReading| {
            Some(Outcome {
                truth: r.truth.as_ref()?.porosity,
                damage: r.porosity.value,
                std_error: r.porosity.std_error,
            })
        };
        let width = |r: &SliceReading| {
            let found = r.cracks.iter().map(|c| c.width_mm).reduce(f64::max)?;
            Some(Outcome { truth: r.truth.as_ref()?.widest_mm?, damage: found, std_error: 0.0 })
        };
        Self {
            members: members.iter().filter_map(outcome).collect(),
            zones: members.iter().filter_map(zones).collect(),
            porosities: readings().filter_map(porosity).collect(),
            widths: readings().filter_map(width).collect(),
            slices: readings().filter_map(|r| Some(r.truth.as_ref()?.tally)).collect(),
        }
    }

    /// Adds others, which come after these.
    pub fn extend(&mut self, more: Self) {
        self.members.extend(more.members);
        self.zones.extend(more.zones);
        self.porosities.extend(more.porosities);
        self.widths.extend(more.widths);
        self.slices.extend(more.slices);
    }

    /// How good they are.
    #[must_use]
    pub fn score(self, profile: &Profile) -> MemberScore {
        let mut tally = Tally::default();
        self.slices.into_iter().for_each(|t| tally += t);
        MemberScore::of(&Cases {
            members: self.members,
            severe_from: profile.severe_from,
            damaged_from: profile.damaged_from(),
            zones: self.zones,
            porosities: self.porosities,
            widths: self.widths,
            slices: tally.score(),
        })
    }
}
