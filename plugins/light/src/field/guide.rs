//! What steers the walks of a scene, and what is known of how well it does.

use std::{collections::BTreeMap, sync::Arc};

use intrados_transport::{Course, Residual, Round, Scores, Side};
use serde::{Deserialize, Serialize};

use super::{Charts, LightField, steer::SteeredLight};
use crate::{LightProblem, LitScene, Sensor, bsdf::warp::Discrete};

/// Both fields of one scene and its sensors, ready to steer.
#[derive(Debug, Serialize, Deserialize)]
pub struct Guide {
    /// Follow from the scene: see [`Guide::back`].
    #[serde(skip)]
    pub(crate) charts: Arc<Charts>,
    /// By side: radiance steers the primal walk, importance the dual.
    pub(crate) fields: [LightField; 2],
    /// What walks from the lamps choose their lamp by: flux times the importance of where it goes.
    pub(crate) lamps: Option<Discrete>,
    /// What a walk is expected to score: primal, one a sensor, then dual.
    pub(crate) readings: Vec<f32>,
    /// Share of ways that ignore the field.
    pub(crate) defence: f32,
    /// What a score in each sensor counts for the importance.
    pub(crate) gains: Vec<f32>,
    /// By side and key: how well the field foretold the last round's steps.
    pub(crate) residuals: [BTreeMap<u32, Residual>; 2],
    /// By side: what the last round's walks scored in each sensor; empty where they are no reading
    /// (a part of a picture is not the picture).
    pub(crate) last: [Vec<Scores>; 2],
    /// How learning went, and what it decided.
    pub(crate) course: Course,
    /// Whether every pixel is to be equally exact, not their mean.
    for_picture: bool,
    fingerprint: u64,
    /// CPU-seconds spent on it.
    pub cpu_seconds: f64,
}

/// Two guides that steer alike are one.
impl PartialEq for Guide {
    fn eq(&self, other: &Self) -> bool {
        self.fingerprint == other.fingerprint
    }
}

impl Guide {
    /// One that knows nothing yet of `sensors` sensors.
    pub(crate) fn new(charts: Arc<Charts>, sensors: usize) -> Self {
        Self {
            charts,
            fields: Default::default(),
            lamps: None,
            readings: vec![f32::NAN; sensors + 1],
            defence: 1.0,
            gains: vec![1.0; sensors],
            residuals: Default::default(),
            last: Default::default(),
            course: Course::default(),
            for_picture: false,
            fingerprint: 0,
            cpu_seconds: 0.0,
        }
    }

    /// One that was stored, for the scene and the sensors that it was learnt for; `None` if it is of
    /// others.
    #[must_use]
    pub fn back(mut self, lit: &LitScene, sensors: &[Sensor]) -> Option<Self> {
        self.charts = Arc::clone(lit.charts());
        let fits = self.readings.len() == sensors.len() + 1
            && self.gains.len() == sensors.len()
            && self.lamps.as_ref().is_none_or(|lamps| {
                let all = lit.choice.as_ref().map(Discrete::len);
                lamps.is_consistent() && all == Some(lamps.len())
            })
            && self.fields.iter().all(|field| field.fits(2 * self.charts.len()));
        fits.then_some(self)
    }

    /// Takes the course of its learning, after which it never changes.
    pub(crate) fn seal(&mut self, course: Course) {
        let mut hash = blake(&[course.steers.map(u64::from), course.turns.map(u64::from)].concat());
        for field in &self.fields {
            hash = blake(&[hash, field.fingerprint()]);
        }
        self.course = course;
        self.fingerprint = hash.max(1);
    }

    /// The problem of one side (primal: of sensor `sensor` of all), steered.
    pub(crate) fn steer_all<'a>(
        &'a self,
        lit: &'a LitScene,
        sensors: &[Sensor],
        side: Side,
        sensor: usize,
    ) -> SteeredLight<'a> {
        self.steer(
            lit,
            if side == Side::Primal { &sensors[sensor..=sensor] } else { sensors },
            side,
            sensor,
        )
    }

    /// The problem of one side, steered. Primal: `of` holds the one sensor, which is number
    /// `sensor` of the guide's.
    pub(crate) fn steer<'a>(
        &'a self,
        lit: &'a LitScene,
        of: &[Sensor],
        side: Side,
        sensor: usize,
    ) -> SteeredLight<'a> {
        let reading = match side {
            Side::Primal => self.readings[sensor],
            Side::Dual => self.readings[self.readings.len() - 1],
        };
        let start = 2 * self.charts.len() as u32 + sensor as u32;
        let plain = LightProblem::new(lit, of)
            .starting_by(self.lamps.as_ref().filter(|_| side == Side::Dual));
        SteeredLight::new(
            plain,
            &self.charts,
            &self.fields[side as usize],
            reading,
            self.defence,
            start,
        )
        .by_pixel(self.for_picture && side == Side::Primal)
    }

    /// For pictures: every walk from the camera is measured by what its own pixel is expected to
    /// see, so that dark pixels converge as well as bright ones (FW-CADIS, Wagner et al. 2014, with
    /// 1/I_p taken from the walk's first promise).
    #[must_use]
    pub fn for_picture(mut self) -> Self {
        self.for_picture = true;
        self.fingerprint = blake(&[self.fingerprint, 1]);
        self
    }

    /// Whether the field steers the walks of a side.
    #[must_use]
    pub fn steers(&self, side: Side) -> bool {
        self.course.steers(side)
    }

    /// Passes of each side in a round of both: the better side gets more.
    #[must_use]
    pub(crate) fn turns(&self) -> [u32; 2] {
        self.course.turns
    }

    /// What each round of learning was like.
    #[must_use]
    pub fn rounds(&self) -> &[Round] {
        &self.course.rounds
    }

    /// A number that two guides share only if they steer alike: walks may be added up only then.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// What a score in a bin of each sensor counts, for the walks of one side.
    pub(crate) fn gains(&self, side: Side, sensors: &[Sensor]) -> Vec<f32> {
        match side {
            Side::Primal => vec![1.0],
            Side::Dual => {
                self.gains.iter().zip(sensors).map(|(g, s)| g / s.bins() as f32).collect()
            }
        }
    }

    /// What the last round of learning scored in sensor `sensor`, walks that count in the result.
    #[must_use]
    pub fn lesson(&self, side: Side, sensor: usize) -> Option<&Scores> {
        self.last[side as usize].get(sensor).filter(|scores| scores.walks() > 0)
    }

    /// Memory of the fields, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.fields.iter().map(LightField::bytes).sum()
    }

    /// Where the variance comes from, worst first (theory §5, law D).
    #[must_use]
    pub fn explain(&self, lit: &LitScene) -> Vec<Culprit> {
        let mut out = Vec::new();
        for side in Side::BOTH {
            let walks =
                self.rounds().iter().rev().find(|r| r.side == side).map_or(1, |r| r.scores.walks());
            let mut by_surface: BTreeMap<&str, Residual> = BTreeMap::new();
            for (&key, residual) in &self.residuals[side as usize] {
                let chart = key as usize / 2;
                let name = if chart < self.charts.len() {
                    &lit.object(self.charts.triangles(chart)[0]).name
                } else {
                    "sensor"
                };
                by_surface.entry(name).or_default().merge(residual);
            }
            out.extend(by_surface.into_iter().map(|(surface, r)| {
                let steps = r.n as f64 / walks as f64;
                Culprit {
                    surface: surface.into(),
                    side,
                    rel_var: steps * r.variance(),
                    mean: r.mean(),
                    largest: r.largest,
                    steps,
                }
            }));
        }
        out.sort_by(|a, b| b.rel_var.total_cmp(&a.rel_var));
        out
    }
}

/// One surface's part in the variance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Culprit {
    /// The object whose surface it is.
    pub surface: String,
    /// Which side's walks.
    pub side: Side,
    /// Its part of relVar of one walk, by the error law: steps a walk times the variance of what
    /// they bring over what was promised.
    pub rel_var: f64,
    /// Mean of that ratio: 1 if the field is right.
    pub mean: f64,
    /// Its largest value.
    pub largest: f64,
    /// Steps a walk.
    pub steps: f64,
}

/// A hash of numbers.
pub(crate) fn blake(numbers: &[u64]) -> u64 {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    blake3::hash(&bytes).as_bytes().iter().take(8).fold(0, |sum, &byte| sum << 8 | u64::from(byte))
}
