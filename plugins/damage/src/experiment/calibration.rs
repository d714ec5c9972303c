//! Whether error bars tell the truth: scenes predicted again and again with other damage planted.
//!
//! What is planted is drawn once for all by [`planted`], whose odds are those that the grading profile declares: rust and lost stiffness that nobody can see are as frequent and as bad as its `fusion.unknown` says.

use std::sync::Arc;

use intrados_scene::{Damage, Member, Scene, Slices};
use intrados_stage::{Job, random::Key};
use serde::Serialize;

use crate::{
    evidence::{Evidence, EvidenceSource},
    forecast::FORECAST,
    predict::{MemberPrediction, PredictError, Settings, predict, score},
    score::{Figure, MemberScore},
};

/// Schema of the JSON.
pub const SCHEMA: &str = "intrados.experiment.calibration/1";

/// Coverage of the error bars over all plantings. Serialises to [`SCHEMA`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Scenes that were predicted.
    pub scenes: Vec<String>,
    /// Plantings of each.
    pub plantings: usize,
    /// Members, zones and slices whose 95 % interval holds the truth, over all that have one.
    pub coverage_95: Option<Figure>,
    /// One by one, and all other scores.
    pub score: MemberScore,
    /// The members, planting by planting.
    pub members: Vec<Judged>,
}

/// What was said of one member under one planting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Name of the scene.
    pub scene: String,
    /// Number of the planting, from 1.
    pub planting: usize,
    /// Id of the member.
    pub member: String,
    /// Damage d of its worst zone.
    pub damage: f64,
    /// Its standard error.
    pub std_error: f64,
    /// The true one.
    pub truth: f64,
}

impl Judged {
    fn of(scene: &Scene, planting: usize, member: &MemberPrediction) -> Option<Self> {
        let (damage, std_error, truth) = (member.damage?, member.damage_std_error?, member.truth.as_ref()?.damage);
        Some(Self { scene: scene.name.clone(), planting, member: member.id.clone(), damage, std_error, truth })
    }
}

/// Predicts each scene under `plantings` different damages. Lives do not depend on what is planted: they are computed once.
///
/// # Errors
/// As [`predict`].
pub fn calibration(scenes: &[Scene], plantings: usize, settings: &Settings, job: &Job) -> Result<Calibration, PredictError> {
    let (mut members, mut judged) = (Vec::new(), Vec::new());
    for (n, scene) in scenes.iter().enumerate() {
        let share = |k: usize| (n as f64 + k as f64 / (plantings + 1) as f64) / scenes.len() as f64;
        let foretold = Foretold::of(scene, settings, &job.part(share(0), share(1)))?;
        let settings = Settings { forecast: None, ..settings.clone() };
        for k in 0..plantings {
            let planted = replanted(scene, 1 + k as u64);
            let prediction = predict(&planted, settings.clone(), &[&foretold], &job.part(share(k + 1), share(k + 2)))?;
            judged.extend(prediction.members.iter().filter_map(|m| Judged::of(scene, 1 + k, m)));
            members.extend(prediction.members);
        }
    }
    Ok(Calibration::of(scenes, plantings, score(&members, settings), judged))
}

impl Calibration {
    fn of(scenes: &[Scene], plantings: usize, score: MemberScore, members: Vec<Judged>) -> Self {
        let parts = [score.coverage_95, score.zone_coverage_95, score.slice_coverage_95].into_iter().flatten();
        let (n, mean, error) = parts.fold((0, 0.0, 0.0_f64), |(n, mean, error), part: Figure| {
            let weight = part.n as f64;
            // A quarter of the interval stands for a standard error.
            (n + part.n, mean + weight * part.value, error + (weight * 0.25 * (part.ci95[1] - part.ci95[0])).powi(2))
        });
        let whole = f64::from(u32::try_from(n).unwrap_or(u32::MAX).max(1));
        let (value, error) = (mean / whole, error.sqrt() / whole);
        Self {
            schema: SCHEMA,
            scenes: scenes.iter().map(|s| s.name.clone()).collect(),
            plantings,
            coverage_95: (n > 0).then_some(Figure { value, ci95: [value - 1.96 * error, (value + 1.96 * error).min(1.0)], n }),
            score,
            members,
        }
    }
}

/// Lives that have been computed.
struct Foretold(Vec<Option<Evidence>>);

impl Foretold {
    fn of(scene: &Scene, settings: &Settings, job: &Job) -> Result<Self, PredictError> {
        let mut bare = scene.clone();
        bare.members.iter_mut().for_each(|m| m.slices.clear());
        Arc::make_mut(&mut bare.file).tests.clear();
        let told = predict(&bare, settings.clone(), &[], job)?;
        Ok(Self(told.members.into_iter().map(|mut m| m.evidence.remove(FORECAST)).collect()))
    }
}

impl EvidenceSource for Foretold {
    fn evidence(&self, _: &Scene, index: usize, _: &Job) -> Result<Option<Evidence>, PredictError> {
        Ok(self.0.get(index).cloned().flatten())
    }
}

/// The scene with other damage in every member that has slices, and slices drawn with other dice.
fn replanted(scene: &Scene, planting: u64) -> Scene {
    let mut scene = scene.clone();
    for (index, member) in scene.members.iter_mut().enumerate().filter(|(_, m)| !m.slices.is_empty()) {
        member.truth = planted(member, planting, index as u32);
        for slices in &mut member.slices {
            if let Slices::Drawn { seed, .. } | Slices::Scanned { seed, .. } = slices {
                *seed += 1000 * planting;
            }
        }
    }
    scene
}

/// Air of 0.5 to 6 %; no, one or two cracks of 0.1 to 2 mm; honeycomb and spalls in three members of ten each; rust of 5 to 30 % of the bars in three of ten; stiffness lost by
/// 10 to 50 % somewhere in one of ten.
fn planted(member: &Member, planting: u64, index: u32) -> Vec<Damage> {
    let key = Key::new(planting, u64::from(index));
    let mut next = 0;
    let mut dice = || {
        next += 1;
        key.unit(next)
    };
    let log = |low: f32, high: f32, u: f32| low * (high / low).powf(u);
    let span = |low: f32, high: f32, u: f32| low + (high - low) * u;
    let length = member.frame.axis.length();
    let mut planted = vec![Damage::Voids { from: 0.0, to: 1.0, porosity: log(0.005, 0.06, dice()), median_mm: span(2.0, 5.0, dice()) }];
    for _ in 0..(3.0 * dice()) as u32 {
        planted.push(Damage::Crack {
            along: span(0.05, 0.95, dice()),
            width_mm: log(0.1, 2.0, dice()),
            depth: span(0.2, 0.8, dice()),
            angle_deg: 90.0 * (4.0 * dice()).floor(),
        });
    }
    if dice() < 0.3 {
        planted.push(Damage::Honeycomb {
            along: span(0.1, 0.9, dice()),
            length_m: span(0.1, 0.2, dice()) * length,
            porosity: span(0.1, 0.3, dice()),
        });
    }
    if dice() < 0.3 {
        planted.push(Damage::Spall {
            along: span(0.1, 0.9, dice()),
            angle_deg: 90.0 * (4.0 * dice()).floor(),
            diameter_m: span(0.1, 0.3, dice()),
            depth_m: span(0.02, 0.05, dice()),
        });
    }
    if dice() < 0.3 {
        let from = span(0.0, 0.6, dice());
        planted.push(Damage::Corrosion { from, to: from + span(0.2, 0.4, dice()), section_loss: span(0.05, 0.3, dice()) });
    }
    if dice() < 0.1 {
        let from = span(0.0, 0.7, dice());
        planted.push(Damage::Softened { from, to: from + span(0.1, 0.3, dice()), damage: span(0.1, 0.5, dice()), side_deg: None });
    }
    planted
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;

    #[test]
    fn plantings_differ_and_repeat() {
        let column = Scene::load_bundled("column", &Job::default()).unwrap();
        let [first, again, second] = [1, 1, 2].map(|planting| replanted(&column, planting).members);
        assert_eq!(first.iter().map(|m| &m.truth).collect::<Vec<_>>(), again.iter().map(|m| &m.truth).collect::<Vec<_>>());
        for (one, two) in first.iter().zip(&second).filter(|(m, _)| !m.slices.is_empty()) {
            assert_ne!(one.truth, two.truth);
            assert!(one.truth.iter().all(|d| !matches!(d, Damage::Crack { width_mm, .. } if !(0.1..=2.0).contains(width_mm))));
        }
    }
}
