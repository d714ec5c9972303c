//! Whether error bars tell the truth: scenes predicted again and again with other damage planted.
//!
//! What is planted is drawn once for all, by two kinds of odds. [`Odds::Declared`] are those that
//! the grading profile itself declares: rust and lost stiffness that nobody can see are as frequent
//! and as bad as its `fusion.unknown` says, so error bars that hold there hold under their own
//! assumptions. [`Odds::Clustered`] are not: damage is rarer, worse, of other shapes and comes
//! together. Members, zones and porosities are never added up: most of all intervals are porosities
//! of drawings of our own.

use std::{collections::BTreeMap, sync::Arc};

use intrados_damage::{evidence::Sources, score::MemberScore};
use intrados_forecast::Forecast;
use intrados_gauges as gauges;
use intrados_predict::{Compared, MemberPrediction, PredictError, PredictSettings, Predictor};
use intrados_scene::{Damage, Member, Scene, Slices};
use intrados_stage::{
    Job,
    file::Set as Parts,
    random::{Draw, Key},
};
use serde::{Deserialize, Serialize};

/// Schema of the JSON.
pub(crate) const SCHEMA: &str = "intrados.experiment.calibration/2";

/// By what odds damage is planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Odds {
    /// As the grading profile declares them. Air of 0.5 to 6 %; no, one or two cracks of 0.1 to 2
    /// mm; honeycomb and spalls in three members of ten each; rust of 5 to 30 % of the bars in
    /// three of ten; stiffness lost by 10 to 50 % somewhere in one of ten.
    Declared,
    /// Half of the members have nothing but .3 to 1.5 % of air. In the others everything comes
    /// together round one place: coarse air of 3 to 10 % over a stretch, two to five cracks of .3
    /// to 4 mm from any side, with even odds each honeycomb of 20 to 45 %, a large spall, rust of
    /// 20 to 60 %, and stiffness lost by 30 to 80 %.
    Clustered,
}

impl Odds {
    /// Both.
    pub(crate) const ALL: [Self; 2] = [Self::Declared, Self::Clustered];
}

/// Coverage of the error bars over all plantings. Serialises to [`SCHEMA`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Scenes that were predicted.
    pub scenes: Vec<String>,
    /// Plantings of each, by each kind of odds.
    pub plantings: usize,
    /// By the declared odds.
    #[serde(flatten)]
    pub declared: OddsSet,
    /// By other odds.
    pub clustered: OddsSet,
}

/// Error bars of members, of zones and of porosities, each by themselves, under one kind of odds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OddsSet {
    /// By what odds damage was planted.
    pub odds: Odds,
    /// Coverage of members, zones and slices, each with its n, and all other scores.
    pub score: MemberScore,
    /// The members, planting by planting.
    pub members: Vec<JudgedMember>,
}

/// What was said of one member under one planting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JudgedMember {
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

impl JudgedMember {
    fn of(scene: &Scene, planting: usize, member: &MemberPrediction) -> Option<Self> {
        let (damage, std_error, truth) =
            (member.damage?, member.damage_std_error?, member.truth.as_ref()?.damage);
        Some(Self {
            scene: scene.name.clone(),
            planting,
            member: member.id.clone(),
            damage,
            std_error,
            truth,
        })
    }
}

/// What came of one planting: all that figures are made of.
#[derive(Serialize, Deserialize)]
struct Planting {
    judged: Vec<JudgedMember>,
    compared: Compared,
}

/// Predicts each scene under `plantings` different damages by each kind of odds, gauges read with
/// modulus, loads and supports off by their priors. Lives do not depend on what is planted: they
/// are computed once. Lives and plantings are kept in `parts` as they are finished, and those that
/// an earlier run has kept there are not computed again; its key names the settings.
///
/// # Errors
/// As [`Predictor::advance`].
pub fn calibration(
    scenes: &[Scene],
    plantings: usize,
    settings: &PredictSettings,
    mut parts: Option<&mut Parts>,
    job: &Job,
) -> Result<Calibration, PredictError> {
    let mut sets = Odds::ALL.map(|_| (Compared::default(), Vec::new()));
    for (n, scene) in scenes.iter().enumerate() {
        let share = |k: usize| {
            (n as f64 + k as f64 / (Odds::ALL.len() * plantings + 1) as f64) / scenes.len() as f64
        };
        let lives = lives(scene, settings, parts.as_deref_mut(), &job.part(share(0), share(1)))?;
        for (set, odds) in Odds::ALL.into_iter().enumerate() {
            for k in 0..plantings {
                let done = set * plantings + k;
                // Nobody knows modulus, loads and supports exactly: readings come from others than
                // the scene says, drawn by the priors with the noise.
                let simulation = gauges::Simulation {
                    seed: 1 + k as u64,
                    off: gauges::Priors::default(),
                    ..settings.simulation
                };
                let settings = PredictSettings { simulation, ..settings.clone() };
                let job = job.part(share(done + 1), share(done + 2));
                let planted = || -> Result<Planting, PredictError> {
                    let planted = replanted(scene, odds, 1 + k as u64);
                    let mut predictor = Predictor::new(&planted, settings, &Sources::default());
                    predictor.learn_lives(lives.clone());
                    while predictor.advance(&planted, &job)? {}
                    let found = predictor.finish(&planted).members;
                    let judged =
                        found.iter().filter_map(|m| JudgedMember::of(scene, 1 + k, m)).collect();
                    Ok(Planting { judged, compared: Compared::of(&found) })
                };
                let Planting { judged, compared } = match parts.as_deref_mut() {
                    Some(parts) => {
                        parts.part(&format!("{}, {odds:?} {k}", scene.hash), |_| planted())?
                    }
                    None => planted()?,
                };
                sets[set].0.extend(compared);
                sets[set].1.extend(judged);
            }
        }
    }
    let [declared, clustered] =
        sets.map(|(compared, judged)| (compared.score(&settings.profile), judged));
    let set = |odds, (score, members)| OddsSet { odds, score, members };
    let [declared, clustered] = [set(Odds::Declared, declared), set(Odds::Clustered, clustered)];
    Ok(Calibration {
        schema: SCHEMA,
        scenes: scenes.iter().map(|s| s.name.clone()).collect(),
        plantings,
        declared,
        clustered,
    })
}

/// The lives of a scene's assemblies, which do not depend on what is planted.
fn lives(
    scene: &Scene,
    settings: &PredictSettings,
    parts: Option<&mut Parts>,
    job: &Job,
) -> Result<BTreeMap<String, Vec<Forecast>>, PredictError> {
    let mut bare = scene.clone();
    bare.members.iter_mut().for_each(|m| m.slices.clear());
    Arc::make_mut(&mut bare.structure).tests.clear();
    let mut predictor = Predictor::new(&bare, settings.clone(), &Sources::default());
    match parts {
        Some(parts) => {
            while predictor.advance_kept(&bare, parts, &format!("{}, bare", scene.hash), job)? {}
        }
        None => while predictor.advance(&bare, job)? {},
    }
    Ok(predictor.known_lives().clone())
}

/// The scene with other damage in every member that has slices, and slices drawn with other dice.
fn replanted(scene: &Scene, odds: Odds, planting: u64) -> Scene {
    let mut scene = scene.clone();
    for (index, member) in
        scene.members.iter_mut().enumerate().filter(|(_, m)| !m.slices.is_empty())
    {
        member.truth = match odds {
            Odds::Declared => declared(member, &mut Dice::new(planting, index)),
            Odds::Clustered => clustered(member, &mut Dice::new(planting + (1 << 32), index)),
        };
        for slices in &mut member.slices {
            if let Slices::Drawn { seed, .. } | Slices::Scanned { seed, .. } = slices {
                *seed += 1000 * planting + 500 * odds as u64;
            }
        }
    }
    scene
}

/// Numbers drawn one after the other, in single precision.
struct Dice(Draw);

impl Dice {
    fn new(planting: u64, member: usize) -> Self {
        Self(Draw::coarse(Key::new(planting, member as u64)))
    }

    fn unit(&mut self) -> f32 {
        self.0.unit() as f32
    }

    fn span(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    fn log(&mut self, low: f32, high: f32) -> f32 {
        low * (high / low).powf(self.unit())
    }

    fn chance(&mut self, share: f32) -> bool {
        self.unit() < share
    }

    /// One of the four sides.
    fn side(&mut self) -> f32 {
        90.0 * (4.0 * self.unit()).floor()
    }
}

/// See [`Odds::Clustered`].
fn clustered(member: &Member, dice: &mut Dice) -> Vec<Damage> {
    let mut planted = vec![Damage::Voids {
        from: 0.0,
        to: 1.0,
        porosity: dice.log(0.003, 0.015),
        median_mm: dice.span(1.0, 2.0),
    }];
    if dice.chance(0.5) {
        return planted;
    }
    let length = member.frame.axis.length();
    let middle = dice.span(0.15, 0.85);
    let near = |dice: &mut Dice| (middle + dice.span(-0.1, 0.1)).clamp(0.02, 0.98);
    let stretch = |half: f32| ((middle - half).max(0.0), (middle + half).min(1.0));
    let (from, to) = stretch(dice.span(0.05, 0.2));
    planted.push(Damage::Voids {
        from,
        to,
        porosity: dice.log(0.03, 0.1),
        median_mm: dice.span(4.0, 8.0),
    });
    for _ in 0..2 + (4.0 * dice.unit()) as u32 {
        planted.push(Damage::Crack {
            along: near(dice),
            width_mm: dice.log(0.3, 4.0),
            depth: dice.span(0.3, 1.0),
            angle_deg: dice.span(0.0, 360.0),
        });
    }
    if dice.chance(0.5) {
        let length_m = dice.span(0.05, 0.15) * length;
        planted.push(Damage::Honeycomb {
            along: near(dice),
            length_m,
            porosity: dice.span(0.2, 0.45),
        });
    }
    if dice.chance(0.5) {
        let diameter_m = dice.span(0.2, 0.4);
        planted.push(Damage::Spall {
            along: near(dice),
            angle_deg: dice.span(0.0, 360.0),
            diameter_m,
            depth_m: dice.span(0.04, 0.08),
        });
    }
    if dice.chance(0.5) {
        let (from, to) = stretch(dice.span(0.05, 0.25));
        planted.push(Damage::Corrosion { from, to, section_loss: dice.span(0.2, 0.6) });
    }
    if dice.chance(0.5) {
        let (from, to) = stretch(dice.span(0.05, 0.2));
        planted.push(Damage::Softened { from, to, damage: dice.span(0.3, 0.8), side_deg: None });
    }
    planted
}

/// See [`Odds::Declared`].
fn declared(member: &Member, dice: &mut Dice) -> Vec<Damage> {
    let length = member.frame.axis.length();
    let mut planted = vec![Damage::Voids {
        from: 0.0,
        to: 1.0,
        porosity: dice.log(0.005, 0.06),
        median_mm: dice.span(2.0, 5.0),
    }];
    for _ in 0..(3.0 * dice.unit()) as u32 {
        planted.push(Damage::Crack {
            along: dice.span(0.05, 0.95),
            width_mm: dice.log(0.1, 2.0),
            depth: dice.span(0.2, 0.8),
            angle_deg: dice.side(),
        });
    }
    if dice.chance(0.3) {
        planted.push(Damage::Honeycomb {
            along: dice.span(0.1, 0.9),
            length_m: dice.span(0.1, 0.2) * length,
            porosity: dice.span(0.1, 0.3),
        });
    }
    if dice.chance(0.3) {
        planted.push(Damage::Spall {
            along: dice.span(0.1, 0.9),
            angle_deg: dice.side(),
            diameter_m: dice.span(0.1, 0.3),
            depth_m: dice.span(0.02, 0.05),
        });
    }
    if dice.chance(0.3) {
        let from = dice.span(0.0, 0.6);
        planted.push(Damage::Corrosion {
            from,
            to: from + dice.span(0.2, 0.4),
            section_loss: dice.span(0.05, 0.3),
        });
    }
    if dice.chance(0.1) {
        let from = dice.span(0.0, 0.7);
        planted.push(Damage::Softened {
            from,
            to: from + dice.span(0.1, 0.3),
            damage: dice.span(0.1, 0.5),
            side_deg: None,
        });
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
        let harsh = replanted(&column, Odds::Clustered, 1);
        let [first, again, second] =
            [1, 1, 2].map(|planting| replanted(&column, Odds::Declared, planting).members);
        assert!(
            harsh
                .members
                .iter()
                .zip(&first)
                .all(|(a, b)| a.slices.is_empty() || a.truth != b.truth)
        );
        assert_eq!(
            first.iter().map(|m| &m.truth).collect::<Vec<_>>(),
            again.iter().map(|m| &m.truth).collect::<Vec<_>>()
        );
        for (one, two) in first.iter().zip(&second).filter(|(m, _)| !m.slices.is_empty()) {
            assert_ne!(one.truth, two.truth);
            assert!(one.truth.iter().all(
                |d| !matches!(d, Damage::Crack { width_mm, .. } if !(0.1..=2.0).contains(width_mm))
            ));
        }
    }

    /// Half of the members are as good as sound, the others much worse than the profile expects;
    /// all that is planted may stand in a scene.
    #[test]
    fn other_odds_are_rarer_and_worse() {
        let column = Scene::load_bundled("column", &Job::default()).unwrap();
        let member = &column.members[0];
        let of = |plant: fn(&Member, &mut Dice) -> Vec<Damage>| -> Vec<Vec<Damage>> {
            (1..200).map(|k| plant(member, &mut Dice::new(k, 0))).collect()
        };
        let widest = |all: &[Vec<Damage>]| {
            let width =
                |d: &Damage| if let Damage::Crack { width_mm, .. } = d { *width_mm } else { 0.0 };
            let mut widths: Vec<f32> =
                all.iter().flatten().map(width).filter(|w| *w > 0.0).collect();
            widths.sort_by(f32::total_cmp);
            widths[widths.len() / 2]
        };
        let [usual, other] = [of(declared), of(clustered)];
        let sound = other.iter().filter(|planted| planted.len() == 1).count();
        assert!((70..130).contains(&sound), "{sound}");
        assert!(widest(&other) > 1.5 * widest(&usual), "{} {}", widest(&other), widest(&usual));
        let proper = |d: &Damage| match *d {
            Damage::Voids { from, to, .. }
            | Damage::Corrosion { from, to, .. }
            | Damage::Softened { from, to, .. } => 0.0 <= from && from < to && to <= 1.0,
            Damage::Crack { along, .. }
            | Damage::Honeycomb { along, .. }
            | Damage::Spall { along, .. } => (0.0..=1.0).contains(&along),
        };
        assert!(other.iter().flatten().all(proper));
    }
}
