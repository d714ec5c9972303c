//! What stains, spalls and cracks do to pixels and meters.
//!
//! A damage lowers what a piece of surface reflects: f_r → f_r (1 − d s), s the share that all of
//! it takes. Walks know nothing of it; a [`SensitivityTally`] keeps how often each has been
//! reflected there. The walk from the camera carries the importance up to the stain and finds the
//! radiance from there on, the walk from a lamp the other way round, so that both give ∂I/∂d_j =
//! −⟨Φ*, s_j K Φ⟩ over the stain: a certificate of its own.
//!
//! Not covered: that a spall or a crack has a shape (shadows, another normal), and that it shows
//! another colour.

use glam::Vec3;
use intrados_stage::{Cancelled, Job};
use intrados_transport::{
    Change, Links, Perturbed, Sensitivities, SensitivityTally, Side, TransportProblem, Value,
    WalkObserver, WalkRule, differentiate, severity,
};

use crate::{
    Guide, LightProblem, LitScene, Rgb, Sensor,
    eight::{self, WIDE},
    problem::LightStates,
};

/// Where surfaces are damaged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extent {
    /// Everywhere.
    All,
    /// Within a ball.
    Ball {
        /// m.
        centre: Vec3,
        /// m.
        radius: f32,
    },
    /// Within a block.
    Block {
        /// m.
        centre: Vec3,
        /// Half its edges, across each other, m.
        half: [Vec3; 3],
    },
}

impl Extent {
    /// Whether `p` is in it.
    #[must_use]
    pub fn contains(&self, p: Vec3) -> bool {
        match *self {
            Self::All => true,
            Self::Ball { centre, radius } => (p - centre).length_squared() <= radius * radius,
            Self::Block { centre, half } => {
                half.iter().all(|h| (p - centre).dot(*h).abs() <= h.length_squared())
            }
        }
    }
}

/// A damage of surfaces: where it is whole, they reflect less by a share.
#[derive(Debug, Clone, PartialEq)]
pub struct Stain {
    /// Objects of the scene that have it, by their place; none: all.
    pub objects: Vec<usize>,
    /// Where on them.
    pub extent: Extent,
    /// By which share reflectance falls where damage is whole, 0 to 1: of a crack its part of the
    /// band that stands for it, times the blackness of its mouth.
    pub share: f64,
}

/// The light problem of a scene as its stains grow from nothing (0) to whole (1).
#[derive(Debug)]
pub struct StainedLight<'a> {
    /// The scene.
    pub lit: &'a LitScene,
    /// Who reads it.
    pub sensors: Vec<Sensor>,
    /// Pixels of cameras that are readings, in order; `None`: all.
    pub pixels: Option<Vec<u32>>,
    /// Damages.
    pub stains: Vec<Stain>,
    /// From which side walks come: [`Side::Primal`] gives each pixel its walks, [`Side::Dual`]
    /// serves all sensors with the same.
    pub side: Side,
    /// How they score; by links.
    pub rule: WalkRule,
    /// Seed.
    pub seed: u64,
    /// Walks: for each reading those of its own (primal), or in all (dual).
    pub walks: u64,
    /// What steers them: learnt for these very sensors.
    pub guide: Option<&'a Guide>,
    /// The work.
    pub job: Job,
}

impl<'a> StainedLight<'a> {
    /// Unsteered walks from `sensors` by the usual rule.
    #[must_use]
    pub fn new(
        lit: &'a LitScene,
        sensors: Vec<Sensor>,
        stains: Vec<Stain>,
        walks: u64,
        seed: u64,
    ) -> Self {
        let (side, rule) = (Side::Primal, WalkRule::default());
        Self {
            lit,
            sensors,
            pixels: None,
            stains,
            side,
            rule,
            seed,
            walks,
            guide: None,
            job: Job::default(),
        }
    }

    fn size(&self, sensor: &Sensor) -> usize {
        match (sensor, &self.pixels) {
            (Sensor::Camera(_), Some(pixels)) => pixels.len(),
            _ => sensor.bins(),
        }
    }

    /// Of every bin of some sensors the reading that it is, if it is one.
    fn places(&self, sensors: &[Sensor]) -> (Vec<u32>, usize) {
        let (mut places, mut readings) = (Vec::new(), 0);
        for sensor in sensors {
            let first = places.len();
            match (sensor, &self.pixels) {
                (Sensor::Camera(_), Some(pixels)) => {
                    places.resize(first + sensor.bins(), u32::MAX);
                    for (&pixel, reading) in pixels.iter().zip(readings..) {
                        if let Some(place) = places
                            .get_mut(first + pixel as usize)
                            .filter(|_| (pixel as usize) < sensor.bins())
                        {
                            *place = reading;
                        }
                    }
                }
                _ => places.extend((readings..).take(sensor.bins())),
            }
            readings += self.size(sensor) as u32;
        }
        (places, readings as usize)
    }

    /// Walks of one side for `sensors`, which begin at number `first`.
    fn run(
        &self,
        sensors: &[Sensor],
        first: usize,
        damage: &[f64],
    ) -> Result<Sensitivities, Cancelled> {
        let (places, readings) = self.places(sensors);
        let size = [readings, self.stains.len()];
        let total =
            if self.side == Side::Primal { self.walks * readings as u64 } else { self.walks };
        let chosen = self.pixels.as_deref().filter(|_| matches!(sensors, [Sensor::Camera(_)]));
        let begin = || Stains::new(self, &places, damage);
        let (shared, side) = (self.side == Side::Dual, self.side);
        match self.guide.filter(|guide| guide.steers(side)) {
            Some(guide) => {
                let problem = guide.steer(self.lit, sensors, side, first).of_pixels(chosen);
                differentiate(
                    &problem,
                    side,
                    &self.rule,
                    self.seed,
                    0..total,
                    size,
                    shared,
                    begin,
                    &self.job,
                )
            }
            None => {
                let problem = LightProblem::new(self.lit, sensors).of_pixels(chosen);
                differentiate(
                    &problem,
                    side,
                    &self.rule,
                    self.seed,
                    0..total,
                    size,
                    shared,
                    begin,
                    &self.job,
                )
            }
        }
    }
}

/// Readings sensor by sensor: pixels in their order, or the meter.
impl Perturbed for StainedLight<'_> {
    type Error = Cancelled;

    fn damages(&self) -> usize {
        self.stains.len()
    }

    /// By the walks of the sound scene, weighed for the damaged one: exact for any damage.
    fn readings(&mut self, damage: &[f64]) -> Result<Vec<f64>, Cancelled> {
        Ok(self.sensitivities(damage)?.readings)
    }

    fn sensitivities(&mut self, damage: &[f64]) -> Result<Sensitivities, Cancelled> {
        if self.side == Side::Dual {
            return self.run(&self.sensors, 0, damage);
        }
        let mut all = Sensitivities::exact(Vec::new(), Vec::new());
        for (i, sensor) in self.sensors.iter().enumerate() {
            all.extend(self.run(std::slice::from_ref(sensor), i, damage)?);
        }
        Ok(all)
    }
}

/// Notes where walks are reflected by stains.
struct Stains<'s> {
    ledger: SensitivityTally,
    lit: &'s LitScene,
    stains: &'s [Stain],
    /// 1 − d s and the slope of its logarithm, by stain.
    left: Vec<[f64; 2]>,
    places: &'s [u32],
    linking: bool,
    change: Change,
}

impl<'s> Stains<'s> {
    fn new(of: &'s StainedLight, places: &'s [u32], damage: &[f64]) -> Self {
        let left = |(stain, &d): (&Stain, &f64)| {
            let lost = severity(d * stain.share);
            [1.0 - lost, -stain.share / (1.0 - lost)]
        };
        let left = of.stains.iter().zip(damage).map(left).collect();
        let (ledger, change) = (SensitivityTally::new(of.stains.len()), Change::default());
        Self { ledger, lit: of.lit, stains: &of.stains, left, places, linking: false, change }
    }

    /// What reflection at `p` on `triangle` loses.
    fn reflect(&mut self, triangle: u32, p: Vec3) {
        self.change.clear();
        let object = self.lit.object_index(triangle) as usize;
        for (k, stain) in self.stains.iter().enumerate() {
            if (stain.objects.is_empty() || stain.objects.contains(&object))
                && stain.extent.contains(p)
            {
                self.change.factor *= self.left[k][0];
                self.change.slopes.push((k as u32, self.left[k][1]));
            }
        }
    }
}

impl From<Stains<'_>> for SensitivityTally {
    fn from(stains: Stains) -> Self {
        stains.ledger
    }
}

impl<P: TransportProblem<Value = Rgb, States = LightStates>> WalkObserver<P> for Stains<'_> {
    fn begin(&mut self, n: usize) {
        self.ledger.begin(n);
        self.linking = false;
    }

    fn follow(&mut self, rows: &[u32]) {
        self.ledger.follow(rows);
    }

    fn depart(&mut self, _: u32, _: &LightStates, _: &[Rgb], _: &[f32]) {
        self.ledger.depart();
    }

    fn land(&mut self, _: u32, states: &LightStates, _: &[Rgb]) {
        self.linking = false;
        for (block, place) in states.places.iter().enumerate() {
            for lane in eight::lanes(place.plain | place.special) {
                let row = block * WIDE + lane;
                self.reflect(states.hits[row].triangle, place.position.lane(lane));
                if !self.change.slopes.is_empty() {
                    self.ledger.leave(row, &self.change);
                }
            }
        }
    }

    fn link(&mut self, _: u32, _: usize, _: &LightStates, _: &Links<Rgb>) {
        self.linking = true;
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        let Some(reading) =
            self.places.get(bin as usize).map(|&r| r as usize).filter(|&r| r != u32::MAX as usize)
        else {
            return;
        };
        let value = value.reading();
        self.change.clear();
        match self.linking {
            true => self.ledger.linked(row, reading, value, &self.change),
            false => self.ledger.found(row, reading, value),
        }
    }
}
