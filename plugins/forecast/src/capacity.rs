//! *Capacity*: how many times its loads a member bears after its life, and what is known of its
//! damage costs of that.
//!
//! The member lives three times and its loads are raised until it fails
//! (`intrados_mechanics::strength`): sound; with the damage that is known of it; and with one
//! standard error more of that in every zone at once, as if all zones erred together. The difference
//! of the last two is the error that damage makes; what the model errs by is [`MODEL_ERROR`], and
//! falls out of what damage costs, a ratio of two runs of one model.
//!
//! A brick of a zone that has lost d of its concrete bears (1 − d) of what its law says in every
//! direction, and of its steel's section the rest is there. Cracks and crushing that the life itself
//! foretells arise anew in each of them and are taken out of what is known of concrete, 1 − (1 −
//! d)/(1 − d_foretold): in a bent beam they cost no strength. Rust is what is known of it, not what
//! the life would compute.

use std::collections::BTreeMap;

use glam::DVec3;
use intrados_damage::zone::{ZONES, zone_at};
use intrados_mechanics::{
    analysis::analyze,
    member::{Along, Handed, Meshing, Prepared, Reach, Weakening, elastic, prepare_within},
    model::{Failure, MarchSettings},
    strength::{Mode, Strength},
};
use intrados_scene::Scene;
use intrados_stage::{Estimate, Job};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    ForecastError,
    life::{along, assumed_error, failed},
};

/// Relative standard error of a computed strength: the coefficient of variation of computed over
/// measured of five beams and eight columns is .07, of those of today's law alone .09
/// (mechanics/docs/experiments.md).
pub const MODEL_ERROR: f64 = 0.1;

/// What is known to be lost of a member, by zone.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Losses {
    /// Of its concrete, beyond what its life foretells.
    pub concrete: [Estimate; ZONES],
    /// Of its steel's section.
    pub steel: [Estimate; ZONES],
}

impl Losses {
    /// Whether nothing is lost, for certain.
    fn are_none(&self) -> bool {
        let none = |e: &Estimate| e.value == 0.0 && e.std_error == 0.0;
        self.concrete.iter().chain(&self.steel).all(none)
    }

    /// With so many standard errors more of each.
    fn and(&self, errors: f64, zone: usize) -> Weakening {
        let share = |e: Estimate| (e.value + errors * e.std_error).clamp(0.0, 1.0);
        Weakening { concrete: share(self.concrete[zone]), steel: share(self.steel[zone]) }
    }
}

/// What of a loss of concrete is beyond what was foretold.
#[must_use]
pub fn beyond(known: Estimate, foretold: f64) -> Estimate {
    let left = (1.0 - foretold).max(1e-6);
    Estimate {
        value: (1.0 - (1.0 - known.value) / left).clamp(0.0, 1.0),
        std_error: known.std_error / left,
    }
}

/// What a member bears.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Capacity {
    /// The loads that were raised.
    pub loads: Vec<String>,
    /// How many times these it bears, with what is known of its damage; at least so many where it
    /// did not fail.
    pub load_factor: Estimate,
    /// How many times these it would bear if it were sound.
    pub sound: f64,
    /// Share of its strength that the damage costs.
    pub cost: Estimate,
    /// How it fails, with its damage.
    pub mode: Mode,
    /// Why that is said.
    pub because: String,
}

impl Capacity {
    /// One sentence for people.
    #[must_use]
    pub fn told(&self) -> String {
        let Estimate { value, std_error } = self.load_factor;
        let least = if self.mode == Mode::None { "at least " } else { "" };
        let loads = self.loads.join(", ");
        let costs = match self.cost {
            Estimate { value: 0.0, std_error: 0.0 } => String::new(),
            Estimate { value, std_error } => format!(
                "; damage costs {:.0} ± {:.0} % of its strength",
                100.0 * value,
                100.0 * std_error
            ),
        };
        format!(
            "bears {least}{value:.2} ± {std_error:.2} times {loads} (fails by {}){costs}",
            self.mode.words()
        )
    }
}

/// What a model bears with what is lost of its members, by their ids; `None` where no load acts on
/// it that could be raised. As part of a structure, by what the rest of it hands on.
///
/// # Errors
/// It cannot be computed, or does not even bear what acts on it now; or the job was cancelled.
pub fn capacity(
    scene: &Scene,
    model: &str,
    handed: Option<&Handed>,
    losses: &BTreeMap<String, Losses>,
    job: &Job,
) -> Result<Option<Capacity>, ForecastError> {
    let because = |e: &dyn std::fmt::Display| ForecastError::Because(e.to_string());
    let no_member = || because(&format!("{model}: no such member"));
    let assembly = scene.structure.assembly(model).ok_or_else(no_member)?;
    if let (Some(_), Some(matter)) = (elastic(assembly), &assembly.matter) {
        return Err(because(&format!(
            "it is of {}, whose failure is not computed: its forecast tells how it is stressed",
            matter.name
        )));
    }
    let mut sound = prepare_within(scene, assembly, handed, Meshing::default(), job)
        .map_err(|e| if job.is_cancelled() { ForecastError::Cancelled } else { because(&e) })?;
    if sound.raised.is_none() {
        let loads = scene.structure.loads.iter().filter(|l| l.action.can_be_raised());
        let names: Vec<&str> = loads.map(|l| l.name.as_str()).collect();
        sound.raise(&names, Along::Automatic);
    }
    if sound.raised.is_none() {
        return Ok(None);
    }
    // What is known of damage, and its error; nothing of either is nothing to compute.
    let is_sound = losses.values().all(Losses::are_none);
    let errors = if is_sound { &[None][..] } else { &[None, Some(0.0), Some(1.0)] };
    let of_zone = zones(scene, &sound);
    let strengths = errors.par_iter().map(|errors| {
        let mut prepared = sound.clone();
        prepared.weaken(|hex| match (errors, &of_zone[hex as usize]) {
            (Some(errors), Some((id, zone))) => {
                losses.get(id).map_or(Weakening::default(), |l| l.and(*errors, *zone))
            }
            _ => Weakening::default(),
        });
        let is_told = is_sound || *errors == Some(0.0);
        if let Some(raised) = &mut prepared.raised {
            raised.to = if is_told { Reach::Mode } else { Reach::Peak };
        }
        let state = match errors {
            None => "as if it were sound",
            Some(0.0) => "with what is known of its damage",
            Some(_) => "with one standard error more of its damage than is known",
        };
        strength(&prepared, state, job)
    });
    let mut strengths: Vec<Result<Strength, ForecastError>> = strengths.collect();
    // With one standard error more it may not even carry what acts: then that error is as large.
    let worse = match strengths.len() {
        3 => strengths.pop(),
        _ => None,
    };
    let strengths = strengths.into_iter().collect::<Result<Vec<Strength>, ForecastError>>()?;
    let factor = |k: usize| strengths[k.min(strengths.len() - 1)].peak.load_factor;
    let [whole, known] = [0, 1].map(factor);
    let worse = match worse {
        Some(Ok(found)) => found.peak.load_factor,
        Some(Err(ForecastError::Fails(_))) => 0.0,
        Some(Err(other)) => return Err(other),
        None => known,
    };
    let told = &strengths[1.min(strengths.len() - 1)];
    let of_damage = (known - worse).max(0.0);
    let of_model = MODEL_ERROR.hypot(assumed_error(assembly)) * known;
    Ok(Some(Capacity {
        loads: told.loads.clone(),
        load_factor: Estimate { value: known, std_error: of_damage.hypot(of_model) },
        sound: whole,
        cost: Estimate {
            value: (1.0 - known / whole).clamp(0.0, 1.0),
            std_error: of_damage / whole,
        },
        mode: told.mode,
        because: told.because.clone(),
    }))
}

/// Of every brick the member and its zone.
fn zones(scene: &Scene, prepared: &Prepared) -> Vec<Option<(String, usize)>> {
    let mesh = &prepared.model.mesh;
    let mut zones = vec![None; mesh.hexes.len()];
    for part in &prepared.parts {
        let frame = scene.members.iter().find(|m| m.id == part.id).map(|m| m.frame);
        let frame = frame.unwrap_or_default();
        for &hex in &part.hexes {
            let middle = mesh.corners(hex).into_iter().sum::<DVec3>() / 8.0;
            zones[hex as usize] = Some((part.id.clone(), zone_at(along(&frame, middle))));
        }
    }
    zones
}

/// A life, and what is borne after it. In what `state` it lives, for people.
fn strength(prepared: &Prepared, state: &str, job: &Job) -> Result<Strength, ForecastError> {
    // Solvers report shares of their own, and three are under way.
    let job = &job.part(0.0, 0.0);
    let lived = analyze(prepared, MarchSettings::of_life(), job, &mut ());
    let (outcome, _) = lived.map_err(|why| failed(&why, job))?;
    let complaint = outcome.complaint;
    let is_laborious = complaint == Failure::Laborious.to_string();
    outcome.strength.ok_or_else(|| match is_laborious {
        true => ForecastError::Because(format!("{state}: {complaint}")),
        false => {
            ForecastError::Fails(format!("{state} it does not carry what acts on it: {complaint}"))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loaded(member: &str, supports: &str, loads: &str) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.ron");
        let text = format!(
            "(schema: \"intrados.scene/1\", members: [(id: \"M\", at: (0, 0, 0), concrete: \"C30/37\", body: {member})],
              supports: [{supports}], loads: [(name: \"jack\", {loads}, history: [(28, 0), (29, 1)])])"
        );
        std::fs::write(&path, text).unwrap();
        Scene::load(&path, &Job::default()).unwrap()
    }

    fn lost(concrete: f64, steel: Estimate) -> BTreeMap<String, Losses> {
        let exact = Estimate { value: concrete, std_error: 0.0 };
        let losses = Losses { concrete: [exact; ZONES], steel: [steel; ZONES] };
        BTreeMap::from([("M".to_owned(), losses)])
    }

    /// Half of a beam with four bars of 12 mm bears M = A_s f_y z, z by the block of stresses that the
    /// bars need, and a little more as they harden: a fifth of their section less is nearly a fifth
    /// less, and a twentieth more or less of that so much of its strength. What concrete has lost of
    /// its strength changes z alone.
    #[test]
    fn a_beam_loses_what_its_bars_lose() {
        let scene = loaded(
            "Beam(section: Rectangle(width_m: 0.4, depth_m: 0.4), length_m: 1.1,
                reinforcement: (cover_mm: 35, bars: [Row(side_deg: 180, count: 4, diameter_mm: 12)], stirrups: (diameter_mm: 8, spacing_mm: 100)))",
            "(member: \"M\", place: Surface(from: 0.0909, to: 0.0909, side_deg: 180), hold: Directions(x: false, y: true, z: true)),
             (member: \"M\", place: End, hold: Symmetry)",
            "action: Force(place: Surface(from: 0.9, to: 1, side_deg: 0), force_kn: (0, -20, 0))",
        );
        let losses = lost(0.1, Estimate { value: 0.2, std_error: 0.05 });
        let found = capacity(&scene, "M", None, &losses, &Job::default()).unwrap().unwrap();
        let by_hand = |steel: f64, concrete: f64| {
            let force = steel * 452.4e-6 * 500e6;
            force * (0.351 - 0.5 * force / (concrete * 38e6 * 0.4)) / 0.95 / 20e3
        };
        let cost = 1.0 - by_hand(0.8, 0.9) / by_hand(1.0, 1.0);
        assert!((found.cost.value - cost).abs() < 0.03, "{cost} {found:?}");
        assert!((found.cost.std_error - 0.05).abs() < 0.02, "{found:?}");
        assert!((1.0..1.25).contains(&(found.sound / by_hand(1.0, 1.0))), "{found:?}");
        let error = found.load_factor.std_error / found.load_factor.value;
        assert!((error - MODEL_ERROR.hypot(0.05 / 0.8)).abs() < 0.02, "{found:?}");
        assert!(matches!(found.mode, Mode::Yielding | Mode::BarRupture), "{found:?}");
        assert!(found.told().contains("damage costs"), "{}", found.told());
    }

    /// Plain concrete that is pressed evenly bears A f_cm, of which d is gone.
    #[test]
    fn a_stub_loses_what_its_concrete_loses() {
        let scene = loaded(
            "Column(section: Rectangle(width_m: 0.2, depth_m: 0.2), height_m: 0.4)",
            "(member: \"M\", place: Start, hold: Directions(x: true, y: true, z: true))",
            "action: Force(place: End, force_kn: (0, -100, 0))",
        );
        let none = Estimate { value: 0.0, std_error: 0.0 };
        let found =
            capacity(&scene, "M", None, &lost(0.25, none), &Job::default()).unwrap().unwrap();
        assert!((found.cost.value - 0.25).abs() < 0.01, "{found:?}");
        assert!((found.sound * 100e3 / (0.04 * 38e6) - 1.0).abs() < 0.05, "{found:?}");
        assert!(found.cost.std_error < 1e-9 && found.mode != Mode::None, "{found:?}");
    }

    /// What the life foretells is not lost a second time.
    #[test]
    fn only_what_is_beyond_the_foretold_is_taken() {
        let known = |value| Estimate { value, std_error: 0.1 };
        assert_eq!(beyond(known(0.2), 0.3).value, 0.0);
        let more = beyond(known(0.44), 0.3);
        assert!((more.value - 0.2).abs() < 1e-12 && (more.std_error - 0.1 / 0.7).abs() < 1e-12);
    }
}
