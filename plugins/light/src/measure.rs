//! Readings of all sensors from both sides, with error bars and the duality gap: M(S) of eq. 2.5,
//! 2.8 and 2.15.

use std::sync::Arc;

use bevy_ecs::resource::Resource;
use intrados_transport::{
    Converged, Moments, Scores, Side, Unmet, WalkEstimate, WalkRule, duality_z, figure_of_merit,
    unmet,
};
use serde::Serialize;

use crate::{
    Exposure, Guide, LitScene, Mismatch, Sensor, Shard, Sides,
    certificate::{ALONE, bounds, disagreement, missing},
    reach,
};

/// Readings in progress.
#[derive(Resource, Debug, Clone)]
pub struct Measurement {
    lit: Arc<LitScene>,
    /// What is read.
    pub sensors: Vec<Sensor>,
    /// One a sensor: a primal walk starts at one sensor.
    pub primal: Vec<Exposure>,
    /// One for all: a dual walk finds every sensor.
    pub dual: Option<Exposure>,
    next: usize,
    /// What steers the walks.
    guide: Option<Arc<Guide>>,
}

/// What one side says of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SideReading {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
    /// n·Var(mean)/mean².
    pub rel_var_per_walk: f64,
    /// Walks, zeros included.
    pub walks: u64,
    /// CPU-seconds of these walks alone (dual walks serve all sensors at once).
    pub own_cpu_seconds: f64,
    /// CPU-seconds charged: training and discarded walks included.
    pub cpu_seconds: f64,
    /// CPU-seconds of training among them.
    pub training_cpu_seconds: f64,
    /// 1/(relVar of the mean · cpu_seconds).
    pub figure_of_merit: f64,
    /// Largest one-step residual ratio; `None` where no field steers.
    pub max_residual: Option<f64>,
    /// Whether the error bar may be trusted: the scores say so, the other side agrees, and no light
    /// is missing that would show.
    pub converged: bool,
    /// Why not, in words.
    pub complaint: String,
    /// The most that this side may lack because its walks have not met it, in the reading's unit;
    /// `None` where one side alone was walked.
    pub unaccounted: Option<f64>,
    /// The evidence of the scores.
    pub evidence: Converged,
    /// Which estimator.
    pub estimator: String,
    /// Whether a field steered.
    pub steered: bool,
}

/// Both sides as one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CombinedReading {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
    /// 1/(relVar · CPU-seconds of both sides).
    pub figure_of_merit: f64,
    /// CPU-seconds of both sides.
    pub cpu_seconds: f64,
    /// Whether the error bar may be trusted: the scores of every side that carries a tenth of the
    /// weight or more say so, both sides agree, and no light is missing that would show.
    pub converged: bool,
    /// Why not, in words.
    pub complaint: String,
    /// The most that it may lack because walks have not met it, in the reading's unit; `None` where
    /// one side alone was walked.
    pub unaccounted: Option<f64>,
    /// Which side carries more weight.
    pub side: Side,
    /// Weight of the primal side.
    pub share: f64,
}

/// All that is known of one sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeterReading {
    /// Name of the sensor.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// From the sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub primal: Option<SideReading>,
    /// From the lamps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dual: Option<SideReading>,
    /// Both.
    pub combined: CombinedReading,
    /// (primal − dual)/√(s²_p + s²_d): N(0,1) if both are right.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duality_z: Option<f64>,
}

impl Measurement {
    /// Starts measuring `sensors`; `samples` walks a pixel (a meter counts 4096 pixels) at most on
    /// each side.
    #[must_use]
    pub fn new(
        lit: Arc<LitScene>,
        sensors: Vec<Sensor>,
        sides: Sides,
        rule: WalkRule,
        seed: u64,
        shard: Shard,
        samples: Option<u64>,
    ) -> Self {
        let limit = |sensor: &Sensor| {
            samples.map_or(u64::MAX, |n| n.saturating_mul(sensor.walks_a_sample()))
        };
        let primal = if sides.has(Side::Primal) {
            let start = |s| {
                Exposure::new(
                    &lit,
                    std::slice::from_ref(s),
                    Side::Primal,
                    rule,
                    seed,
                    shard,
                    limit(s),
                    false,
                )
                .noting_reach()
            };
            sensors.iter().map(start).collect()
        } else {
            Vec::new()
        };
        let longest = sensors.iter().map(limit).max().unwrap_or(0);
        let dual = (sides.has(Side::Dual) && !sensors.is_empty())
            .then(|| {
                Exposure::new(&lit, &sensors, Side::Dual, rule, seed, shard, longest, false)
                    .noting_reach()
            })
            .map(|mut e| {
                // Nobody looks at the picture: no splats to sort.
                e.drop_film();
                e
            });
        Self { lit, sensors, primal, dual, next: 0, guide: None }
    }

    /// Lets `guide`, learnt for these sensors, steer the walks. To be called before the first pass.
    #[must_use]
    pub fn guided(mut self, guide: Arc<Guide>) -> Self {
        self.primal = self
            .primal
            .into_iter()
            .enumerate()
            .map(|(sensor, e)| e.steered_by(&guide, sensor))
            .collect();
        self.dual = self.dual.map(|e| e.steered_by(&guide, 0));
        self.guide = Some(guide);
        self
    }

    /// What steers the walks.
    #[must_use]
    pub fn guide(&self) -> Option<&Arc<Guide>> {
        self.guide.as_ref()
    }

    /// Passes of each side in a round: a guide that knows which side is better gives it more.
    #[must_use]
    pub(crate) fn turns(&self) -> [u32; 2] {
        self.guide
            .as_ref()
            .filter(|_| !self.primal.is_empty() && self.dual.is_some())
            .map_or([1; 2], |guide| guide.turns())
    }

    /// Rounds: passes for the sensor whose turn it is, and for the lamps. False once all are
    /// finished.
    pub fn advance(&mut self, rounds: u32) -> bool {
        let turns = self.turns();
        for _ in 0..rounds {
            if !self.primal.is_empty() {
                let i = self.next % self.primal.len();
                self.primal[i].advance(&self.lit, std::slice::from_ref(&self.sensors[i]), turns[0]);
            }
            if let Some(dual) = &mut self.dual {
                dual.advance(&self.lit, &self.sensors, turns[1]);
            }
            self.next += 1;
        }
        self.primal.iter().chain(&self.dual).any(|e| !e.is_finished())
    }

    /// A batch for every thread, for the sensor or the lamps, whichever has walked less. False once
    /// all are finished.
    pub fn step(&mut self) -> bool {
        let batches = rayon::current_num_threads() as u64;
        let primal_walks: u64 = self.primal.iter().map(|e| e.walks).sum();
        let lamps_turn = self.primal.iter().all(Exposure::is_finished)
            || self.dual.as_ref().is_some_and(|d| d.walks < primal_walks);
        match self.dual.as_mut().filter(|d| lamps_turn && !d.is_finished()) {
            Some(dual) => dual.advance_batches(&self.lit, &self.sensors, batches),
            None => {
                let open =
                    self.primal.iter_mut().zip(&self.sensors).filter(|(e, _)| !e.is_finished());
                if let Some((exposure, sensor)) = open.min_by_key(|(e, _)| e.walks) {
                    exposure.advance_batches(&self.lit, std::slice::from_ref(sensor), batches);
                }
            }
        }
        self.primal.iter().chain(&self.dual).any(|e| !e.is_finished())
    }

    /// Rounds that give every sensor its passes at once, so that both cores have work.
    pub fn advance_all(&mut self, rounds: u32) -> bool {
        let turns = self.turns();
        for (exposure, sensor) in self.primal.iter_mut().zip(&self.sensors) {
            exposure.advance(&self.lit, std::slice::from_ref(sensor), rounds * turns[0]);
        }
        if let Some(dual) = &mut self.dual {
            dual.advance(
                &self.lit,
                &self.sensors,
                rounds * turns[1] * self.primal.len().max(1) as u32,
            );
        }
        self.primal.iter().chain(&self.dual).any(|e| !e.is_finished())
    }

    /// Rounds of [`Self::advance_all`] that have been begun.
    #[must_use]
    pub fn rounds(&self) -> u64 {
        let count = |e: &Exposure| e.passes.iter().map(|p| p.count).sum::<u64>();
        let turns = self.turns().map(u64::from);
        let primal = self.primal.iter().map(count).max().unwrap_or(0).div_ceil(turns[0]);
        // A dual pass serves all sensors, and gets as many as all of them together.
        let dual = self
            .dual
            .as_ref()
            .map_or(0, |e| count(e).div_ceil(turns[1] * self.primal.len().max(1) as u64));
        primal.max(dual)
    }

    /// What is known so far.
    #[must_use]
    pub fn readings(&self) -> Vec<MeterReading> {
        let training = self.guide.as_ref().map_or(0.0, |guide| guide.cpu_seconds);
        readings(&self.sensors, &self.primal, self.dual.as_ref(), self.guide.as_deref(), training)
    }

    /// Goes on from the exposures of an earlier run.
    ///
    /// # Errors
    /// If they are not of this measurement.
    pub fn restore(
        &mut self,
        primal: Vec<Exposure>,
        dual: Option<Exposure>,
    ) -> Result<(), Mismatch> {
        let one = |mine: &Exposure, theirs: &Exposure| {
            mine.is_continued_by(theirs) && theirs.is_consistent()
        };
        let dual_fits = match (&self.dual, &dual) {
            (None, None) => true,
            (Some(mine), Some(theirs)) => one(mine, theirs),
            _ => false,
        };
        if !dual_fits
            || self.primal.len() != primal.len()
            || !self.primal.iter().zip(&primal).all(|(a, b)| one(a, b))
        {
            return Err(Mismatch::Measurement);
        }
        self.primal =
            self.primal.iter().zip(primal).map(|(mine, theirs)| mine.continued(theirs)).collect();
        self.dual = self.dual.as_ref().zip(dual).map(|(mine, theirs)| mine.continued(theirs));
        Ok(())
    }
}

/// The readings of `sensors` from their exposures, one primal a sensor (or none at all) and one
/// dual for all. `training`: CPU-seconds spent on the fields that steer them. With the `guide` that
/// was learnt for them, its last round counts too.
#[must_use]
pub fn readings(
    sensors: &[Sensor],
    primal: &[Exposure],
    dual: Option<&Exposure>,
    guide: Option<&Guide>,
    training: f64,
) -> Vec<MeterReading> {
    let lesson = |side, sensor| guide.and_then(|guide| guide.lesson(side, sensor));
    let reading = |(i, sensor): (usize, &Sensor)| {
        let (primal_exposure, dual_exposure) = (primal.get(i), dual);
        let primal = primal_exposure
            .map(|e| (side_reading(e, 0, lesson(Side::Primal, i), training), &e.scores[0]));
        let dual = dual_exposure.and_then(|e| {
            Some((side_reading(e, i, lesson(Side::Dual, i), training), e.scores.get(i)?))
        });
        let mut combined = combined(primal.as_ref(), dual.as_ref(), training);
        let z = match (&primal, &dual) {
            (Some((p, _)), Some((d, _))) => {
                Some(duality_z(p.mean, p.std_error, d.mean, d.std_error))
                    .filter(|z| z.is_finite() && p.std_error.hypot(d.std_error).is_finite())
            }
            _ => None,
        };
        let reaches = (
            primal_exposure.and_then(|e| e.reach.as_ref()),
            dual_exposure.and_then(|e| e.reach.as_ref()),
        );
        let unmet = if let (Some(p), Some(d)) = reaches { unmet(p, d, reach::near) } else { None };
        let (mut primal, mut dual) = (primal.map(|(r, _)| r), dual.map(|(r, _)| r));
        certify(&mut primal, &mut dual, &mut combined, z, unmet);
        MeterReading {
            name: sensor.name().to_owned(),
            unit: sensor.unit(),
            primal,
            dual,
            combined,
            duality_z: z,
        }
    };
    sensors.iter().enumerate().map(reading).collect()
}

/// Withdraws trust where the other side does not vouch for an error bar, or where light is missing
/// that would show.
fn certify(
    primal: &mut Option<SideReading>,
    dual: &mut Option<SideReading>,
    combined: &mut CombinedReading,
    gap: Option<f64>,
    unmet: Option<Unmet>,
) {
    let (Some(p), Some(d)) = (&mut *primal, &mut *dual) else {
        [primal, dual]
            .into_iter()
            .flatten()
            .for_each(|side| withdraw(&mut side.converged, &mut side.complaint, ALONE.into()));
        return withdraw(&mut combined.converged, &mut combined.complaint, ALONE.into());
    };
    if !combined.converged {
        combined.complaint = "the side that counts most has not converged".into();
    }
    let plain = [(p.mean, p.std_error), (d.mean, d.std_error)];
    let disagrees = disagreement(plain.map(|r| r.0), gap);
    let bounds = unmet.map(|unmet| bounds(&unmet, plain));
    p.unaccounted = bounds.map(|b| b[0]);
    d.unaccounted = bounds.map(|b| b[1]);
    combined.unaccounted = bounds.map(|b| combined.share * b[0] + (1.0 - combined.share) * b[1]);
    for side in [p, d] {
        disagrees
            .iter()
            .for_each(|why| withdraw(&mut side.converged, &mut side.complaint, why.clone()));
        missing(side.mean, side.std_error, side.unaccounted)
            .into_iter()
            .for_each(|why| withdraw(&mut side.converged, &mut side.complaint, why));
    }
    let missing = missing(combined.mean, combined.std_error, combined.unaccounted);
    disagrees
        .into_iter()
        .chain(missing)
        .for_each(|why| withdraw(&mut combined.converged, &mut combined.complaint, why));
}

fn withdraw(converged: &mut bool, complaint: &mut String, why: String) {
    *converged = false;
    *complaint = if complaint.is_empty() { why } else { format!("{complaint}; {why}") };
}

/// Share of the weight of the run's own walks that a walk of the last round of learning gets: its
/// field was half as old. Fixed beforehand, so that it cannot depend on what it weighs.
const LESSON: f64 = 0.5;

/// The run's reading with what the last round of learning scored. The run is unbiased whatever was
/// learnt, so the two do not correlate.
fn with_lesson(run: WalkEstimate, lesson: Option<&Scores>) -> WalkEstimate {
    let Some(lesson) = lesson
        .map(Scores::reading)
        .filter(|lesson| lesson.std_error.is_finite() && run.std_error.is_finite())
    else {
        return run;
    };
    let share = LESSON * lesson.walks as f64 / (LESSON * lesson.walks as f64 + run.walks as f64);
    WalkEstimate {
        mean: share * lesson.mean + (1.0 - share) * run.mean,
        std_error: (share * lesson.std_error).hypot((1.0 - share) * run.std_error),
        walks: run.walks + lesson.walks,
    }
}

fn side_reading(
    exposure: &Exposure,
    sensor: usize,
    lesson: Option<&Scores>,
    training: f64,
) -> SideReading {
    let cpu_seconds = exposure.cpu_seconds + training;
    let reading = with_lesson(exposure.reading(sensor), lesson);
    let evidence = exposure.scores[sensor].converged();
    SideReading {
        mean: reading.mean,
        std_error: reading.std_error,
        rel_var_per_walk: reading.rel_var_per_walk(),
        walks: reading.walks,
        own_cpu_seconds: exposure.cpu_seconds,
        cpu_seconds,
        training_cpu_seconds: training,
        figure_of_merit: figure_of_merit(reading.rel_error(), cpu_seconds),
        max_residual: (exposure.field != 0).then_some(exposure.max_residual),
        converged: evidence.holds(),
        complaint: evidence.complaint(),
        unaccounted: None,
        evidence,
        estimator: serde_name(exposure.rule.estimator),
        steered: exposure.field != 0,
    }
}

fn serde_name(estimator: intrados_transport::Estimator) -> String {
    use intrados_transport::Estimator;
    match estimator {
        Estimator::Analog => "analog",
        Estimator::Collision => "collision",
        Estimator::LastEvent => "last-event",
        Estimator::NextEvent => "next-event",
    }
    .into()
}

type OneSide<'a> = (SideReading, &'a Scores);

fn combined(primal: Option<&OneSide>, dual: Option<&OneSide>, training: f64) -> CombinedReading {
    match (primal, dual) {
        (Some((p, ps)), Some((d, ds))) => {
            let (mean, share) = match (p.converged, d.converged) {
                // An error bar that cannot be trusted is mostly too small, and would drag the sound
                // side's mean along.
                (true, false) => (p.mean, 1.0),
                (false, true) => (d.mean, 0.0),
                _ => cross_combine(ps.halves(), ds.halves(), p, d),
            };
            let part = |share: f64, error: f64| if share > 0.0 { share * error } else { 0.0 };
            let std_error = part(share, p.std_error).hypot(part(1.0 - share, d.std_error));
            // Both sides' fields were learnt together.
            let cpu_seconds = p.own_cpu_seconds + d.own_cpu_seconds + training;
            CombinedReading {
                mean,
                std_error,
                figure_of_merit: figure_of_merit(std_error / mean.abs(), cpu_seconds),
                cpu_seconds,
                converged: (share < 0.1 || p.converged) && (share > 0.9 || d.converged),
                complaint: String::new(),
                unaccounted: None,
                side: if share >= 0.5 { Side::Primal } else { Side::Dual },
                share,
            }
        }
        (Some((r, _)), None) => alone(r, Side::Primal),
        (None, Some((r, _))) => alone(r, Side::Dual),
        (None, None) => CombinedReading {
            mean: 0.0,
            std_error: f64::INFINITY,
            figure_of_merit: 0.0,
            cpu_seconds: 0.0,
            converged: false,
            complaint: String::new(),
            unaccounted: None,
            side: Side::Primal,
            share: 1.0,
        },
    }
}

fn alone(r: &SideReading, side: Side) -> CombinedReading {
    CombinedReading {
        mean: r.mean,
        std_error: r.std_error,
        figure_of_merit: r.figure_of_merit,
        cpu_seconds: r.cpu_seconds,
        converged: r.converged,
        complaint: String::new(),
        unaccounted: None,
        side,
        share: if side == Side::Primal { 1.0 } else { 0.0 },
    }
}

/// Combines two sides with weights by variance, each half weighted by what the *other* half says of
/// the variances: the weights are independent of what they weigh, so the mean is unbiased. Returns
/// it and the mean weight of the primal.
fn cross_combine(
    p: [Moments; 2],
    d: [Moments; 2],
    primal: &SideReading,
    dual: &SideReading,
) -> (f64, f64) {
    let weight = |h: usize| {
        let (vp, vd) = (p[h].std_error().powi(2), d[h].std_error().powi(2));
        match (vp.is_finite() && p[h].mean > 0.0, vd.is_finite() && d[h].mean > 0.0) {
            (true, true) if vp + vd > 0.0 => vd / (vp + vd),
            (true, false) => 1.0,
            (false, true) => 0.0,
            _ => 0.5,
        }
    };
    let w = [weight(1), weight(0)];
    let share = 0.5 * (w[0] + w[1]);
    // ½ Σ (w_h p_h + (1 − w_h) d_h), the weights' mean on the sides' own means (stratified where
    // they are), the rest on the halves.
    let rest: f64 = (0..2)
        .filter(|&h| p[h].n > 0 && d[h].n > 0)
        .map(|h| 0.5 * (w[h] - share) * (p[h].mean - d[h].mean))
        .sum();
    (share * primal.mean + (1.0 - share) * dual.mean + rest, share)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 walks of learning with half the weight of 300 of the run: a quarter of the whole.
    #[test]
    fn the_last_round_of_learning_counts() {
        let mut lesson = Scores::default();
        (0..200).for_each(|i| lesson.add([3.0, 5.0][i % 2], 0));
        let run = WalkEstimate { mean: 8.0, std_error: 0.1, walks: 300 };
        let both = with_lesson(run, Some(&lesson));
        assert!((both.mean - 7.0).abs() < 1e-12 && both.walks == 500, "{both:?}");
        assert!(
            (both.std_error - (0.25 * lesson.std_error()).hypot(0.075)).abs() < 1e-12,
            "{both:?}"
        );
        assert_eq!(with_lesson(run, None), run);
        let nothing = WalkEstimate { mean: 0.0, std_error: f64::INFINITY, walks: 0 };
        assert_eq!(with_lesson(nothing, Some(&lesson)), nothing);
    }
}
