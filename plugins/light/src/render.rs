//! A picture from one side, the other, or both.

use std::sync::Arc;

use bevy_ecs::resource::Resource;
use glam::Vec3;
use intrados_scene::{self as scene, Camera, Scene};
use intrados_stage::cpu_seconds;
use intrados_transport::{
    BATCH, Roulette, Side, Tally, WalkEstimate, WalkRule, Workspace, combine, duality_z, run, unmet,
};
use serde::{Deserialize, Serialize};

use crate::{
    Exposure, Film, Guide, LightProblem, LitScene, Mismatch, Rgb, Sensor, Shard,
    certificate::{self, ALONE},
    reach,
};

/// Which walks make the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sides {
    /// From the camera only.
    #[default]
    Primal,
    /// From the lamps only.
    Dual,
    /// Both, combined by variance.
    Both,
}

impl Sides {
    /// Whether `side` is among them.
    #[must_use]
    pub fn has(self, side: Side) -> bool {
        matches!(
            (self, side),
            (Self::Both, _) | (Self::Primal, Side::Primal) | (Self::Dual, Side::Dual)
        )
    }
}

/// How to render.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// From which sides.
    pub sides: Sides,
    /// Estimator, depth, roulette.
    pub rule: WalkRule,
    /// Seed.
    pub seed: u64,
    /// Walks per pixel at most, on each side; `None`: until told to stop.
    pub samples: Option<u64>,
    /// Which shard of the passes.
    pub shard: Shard,
    /// Whether to keep the orders of the Neumann series apart.
    pub orders: bool,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            sides: Sides::Both,
            rule: WalkRule::default(),
            seed: 1,
            samples: None,
            shard: Shard::default(),
            orders: true,
        }
    }
}

/// The rule that a scene asks for: its own depth and roulette, where it has any.
#[must_use]
pub fn scene_rule(scene: &Scene) -> WalkRule {
    let scene::Transport { max_depth, roulette_from, roulette } = scene.transport;
    let usual = WalkRule::default();
    WalkRule {
        max_order: max_depth.unwrap_or(usual.max_order),
        roulette_from: roulette_from.unwrap_or(usual.roulette_from),
        roulette: match roulette {
            scene::Roulette::Event => Roulette::Event,
            scene::Roulette::Weight => Roulette::Weight,
        },
        ..usual
    }
}

/// Which picture to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum View {
    /// Of the primal walks.
    Primal,
    /// Of the dual walks.
    Dual,
    /// Of both, if there are both.
    #[default]
    Combined,
}

/// A picture in linear radiance with its variance.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Mean radiance, W·m⁻²·sr⁻¹, row-major from the top left.
    pub mean: Vec<Vec3>,
    /// Variance of the mean; infinite where unknown.
    pub variance: Vec<Vec3>,
    /// Walks per pixel.
    pub samples: Vec<f32>,
}

/// What has been seen so far of one picture: all that a checkpoint holds. It can be looked at
/// without the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plate {
    /// What it looks through.
    camera: Camera,
    /// Primal, dual.
    exposures: [Option<Exposure>; 2],
    /// relVar of one walk of each side, from a pilot run that is thrown away: the weights of the
    /// combination must not come from the very scores that they weigh (design §3; no bias).
    pilot: [f64; 2],
    /// CPU-seconds of that run.
    pilot_cpu_seconds: f64,
    /// The camera sees smooth glass, through which no link goes: what the dual misses there it
    /// cannot vouch for.
    through_glass: bool,
}

/// The mean luminance of a picture over its pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// By primal and by dual walks.
    pub sides: [Option<WalkEstimate>; 2],
    /// By both.
    pub combined: WalkEstimate,
    /// Weight of the primal side in it.
    pub share: f64,
    /// The duality gap, if both sides have found light and see the same.
    pub duality_z: Option<f64>,
    /// Whether the error bar of `combined` may be trusted.
    pub trust: Trust,
}

/// Whether the error bar of a picture's mean may be trusted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trust {
    /// What its own scores say against it; empty: nothing.
    pub complaint: String,
    /// Why nothing vouches for what its walks have not met.
    pub unvouched: Option<String>,
    /// Only one side walks, so that nothing ever will.
    pub alone: bool,
}

impl Trust {
    /// Neither its own scores nor the other side speak against it.
    #[must_use]
    pub fn is_certified(&self) -> bool {
        self.complaint.is_empty() && self.unvouched.is_none()
    }

    /// Whether more walks would not make it more trustworthy: of one side alone its own scores are
    /// all that can be had.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.complaint.is_empty() && (self.alone || self.unvouched.is_none())
    }

    /// All of it in words; empty if it is [certified](Self::is_certified).
    #[must_use]
    pub fn words(&self) -> String {
        let own = (!self.complaint.is_empty()).then(|| self.complaint.clone());
        own.into_iter().chain(self.unvouched.clone()).collect::<Vec<_>>().join("; ")
    }
}

/// A picture in progress.
#[derive(Resource, Debug, Clone)]
pub struct Render {
    lit: Arc<LitScene>,
    sensors: [Sensor; 1],
    plate: Plate,
    turn: u64,
}

/// A picture can be looked at while it is in progress.
impl std::ops::Deref for Render {
    type Target = Plate;

    fn deref(&self) -> &Plate {
        &self.plate
    }
}

/// The pilot draws from another stream.
const PILOT: u64 = 0x9110_7000_0000_0000;

impl Render {
    /// Starts a picture of what `camera` sees.
    #[must_use]
    pub fn new(lit: Arc<LitScene>, camera: &Camera, settings: &RenderSettings) -> Self {
        Self::guided(lit, camera, settings, None)
    }

    /// The same, its walks steered by a guide that was learnt for this camera.
    #[must_use]
    pub fn guided(
        lit: Arc<LitScene>,
        camera: &Camera,
        settings: &RenderSettings,
        guide: Option<&Arc<Guide>>,
    ) -> Self {
        let sensors = [Sensor::Camera(camera.clone())];
        let limit =
            settings.samples.map_or(u64::MAX, |n| n.saturating_mul(sensors[0].bins() as u64));
        let start = |side| {
            let exposure = || {
                Exposure::new(
                    &lit,
                    &sensors,
                    side,
                    settings.rule,
                    settings.seed,
                    settings.shard,
                    limit,
                    settings.orders,
                )
            };
            // Where only one side walks there is nobody to compare with.
            let noting = || {
                if settings.sides == Sides::Both { exposure().noting_reach() } else { exposure() }
            };
            settings.sides.has(side).then(|| steered(noting(), guide))
        };
        let exposures = Side::BOTH.map(start);
        let through_glass = lit.has_smooth_glass();
        let plate = Plate {
            camera: camera.clone(),
            exposures,
            pilot: [1.0; 2],
            pilot_cpu_seconds: 0.0,
            through_glass,
        };
        let mut render = Self { lit, sensors, plate, turn: 0 };
        if settings.sides == Sides::Both {
            let begin = cpu_seconds();
            render.plate.pilot =
                Side::BOTH.map(|side| render.pilot_variance(side, settings, guide));
            render.plate.pilot_cpu_seconds = cpu_seconds() - begin;
        }
        render
    }

    fn pilot_variance(
        &self,
        side: Side,
        settings: &RenderSettings,
        guide: Option<&Arc<Guide>>,
    ) -> f64 {
        if side == Side::Dual && self.lit.has_smooth_glass() {
            // No link goes through smooth glass, and no walk meets the pinhole: what the camera
            // sees there the dual misses.
            return 1e300;
        }
        // One batch: enough to tell a hopeless side, short enough to start anew in every frame of
        // an orbit. The film is so small that every pixel gets four walks: what pixels differ by is
        // no error of the primal's, whose walks are shared out among them, and would cost it most
        // of its weight.
        let sensors = [Sensor::Camera(pilot_camera(&self.plate.camera))];
        let pilot = Exposure::new(
            &self.lit,
            &sensors,
            side,
            settings.rule,
            settings.seed ^ PILOT,
            Shard::default(),
            BATCH,
            false,
        );
        let mut pilot = steered(pilot, guide);
        pilot.advance(&self.lit, &sensors, 1);
        let reading = pilot.reading(0);
        // A side that has not found the lamp or the camera yet gets next to nothing.
        if reading.mean > 0.0 && reading.std_error.is_finite() {
            reading.rel_var_per_walk()
        } else {
            1e12
        }
    }

    /// Goes on from a plate of an earlier run.
    ///
    /// # Errors
    /// If it is not of this picture.
    pub fn restore(&mut self, plate: Plate) -> Result<(), Mismatch> {
        let continued = self.plate.exposures.iter().zip(&plate.exposures).all(|pair| match pair {
            (None, None) => true,
            (Some(mine), Some(theirs)) => mine.is_continued_by(theirs),
            _ => false,
        });
        if !continued
            || self.plate.camera != plate.camera
            || self.plate.pilot != plate.pilot
            || !plate.is_consistent()
        {
            return Err(Mismatch::Picture);
        }
        self.turn = plate.passes();
        let mine = std::mem::take(&mut self.plate.exposures);
        self.plate = plate;
        for (mine, theirs) in mine.into_iter().zip(&mut self.plate.exposures) {
            *theirs = mine.zip(theirs.take()).map(|(mine, theirs)| mine.continued(theirs));
        }
        Ok(())
    }

    /// The scene.
    #[must_use]
    pub fn lit(&self) -> &Arc<LitScene> {
        &self.lit
    }

    /// The plate alone.
    #[must_use]
    pub fn plate(&self) -> &Plate {
        &self.plate
    }

    /// Runs `passes` passes, the two sides in turns. False once there is nothing left to do.
    pub fn advance(&mut self, passes: u32) -> bool {
        let sides =
            self.plate.exposures.iter().flatten().filter(|e| !e.is_finished()).count() as u32;
        if sides == 0 {
            return false;
        }
        // The turn decides who gets the odd pass, so that 8×1 and 2×4 are the same walks.
        for k in 0..2_u64 {
            let side = ((self.turn + k) % 2) as usize;
            let share = if sides == 2 { (passes + 1 - k as u32) / 2 } else { passes };
            if let Some(exposure) =
                self.plate.exposures[side].as_mut().filter(|e| share > 0 && !e.is_finished())
            {
                exposure.advance(&self.lit, &self.sensors, share);
            }
        }
        self.turn += u64::from(passes);
        self.plate.exposures.iter().flatten().any(|e| !e.is_finished())
    }

    /// A batch for every thread, of the side that has walked less: the least that keeps the machine
    /// busy. False once there is nothing left to do. Together with other steps and passes it makes
    /// the same bits as passes alone.
    pub fn step(&mut self) -> bool {
        let sides = self.plate.exposures.iter_mut().flatten();
        if let Some(exposure) = sides.filter(|e| !e.is_finished()).min_by_key(|e| e.walks) {
            exposure.advance_batches(&self.lit, &self.sensors, rayon::current_num_threads() as u64);
        }
        self.plate.exposures.iter().flatten().any(|e| !e.is_finished())
    }

    /// Has the system give the films their memory before the first walk needs it.
    pub(crate) fn settle(&mut self) {
        self.plate
            .exposures
            .iter_mut()
            .flatten()
            .filter_map(|e| e.film.as_mut())
            .for_each(Film::settle);
    }
}

impl Plate {
    /// The camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Primal and dual state.
    #[must_use]
    pub fn exposures(&self) -> &[Option<Exposure>; 2] {
        &self.exposures
    }

    /// Takes out what differs from run to run: CPU-seconds.
    pub fn forget_clock(&mut self) {
        self.pilot_cpu_seconds = 0.0;
        self.exposures.iter_mut().flatten().for_each(|e| e.cpu_seconds = 0.0);
    }

    /// The state of one side.
    #[must_use]
    pub fn exposure(&self, side: Side) -> Option<&Exposure> {
        self.exposures[side as usize].as_ref()
    }

    /// Passes done, of both sides.
    #[must_use]
    pub fn passes(&self) -> u64 {
        self.exposures.iter().flatten().flat_map(|e| &e.passes).map(|p| p.count).sum()
    }

    /// Whether all parts fit together: what a plate from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let fits = |e: &Exposure| {
            e.is_consistent()
                && e.scores.len() == 1
                && e.film
                    .as_ref()
                    .is_some_and(|f| (f.width, f.height) == (self.camera.width, self.camera.height))
        };
        self.exposures.iter().flatten().all(fits)
            && self.exposures.iter().any(Option::is_some)
            && self.pilot.iter().all(|v| v.is_finite())
    }

    /// Adds the walks of another shard.
    ///
    /// # Errors
    /// Why the two do not go together; nothing is changed then.
    pub fn merge(&mut self, other: &Self) -> Result<(), Mismatch> {
        if self.camera != other.camera || self.pilot != other.pilot {
            return Err(Mismatch::Cameras);
        }
        let mut merged = self.exposures.clone();
        for pair in merged.iter_mut().zip(&other.exposures) {
            match pair {
                (None, None) => {}
                (Some(mine), Some(theirs)) => mine.merge(theirs)?,
                _ => return Err(Mismatch::Sides),
            }
        }
        self.exposures = merged;
        self.pilot_cpu_seconds += other.pilot_cpu_seconds;
        Ok(())
    }

    /// Weight of the primal side in the combination: as [planned](Self::planned_share), unless that
    /// would spoil the better side. Sums up the films.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.share_of(&Side::BOTH.map(|side| self.exposure(side).map(|e| e.reading(0))))
    }

    fn share_of(&self, sides: &[Option<WalkEstimate>; 2]) -> f64 {
        let planned = self.planned_share();
        match (&self.exposures, *sides) {
            ([Some(p), Some(d)], [Some(primal), Some(dual)]) => {
                let holds = |e: &Exposure| e.scores[0].converged().holds();
                settle(planned, [(primal, holds(p)), (dual, holds(d))])
            }
            _ => planned,
        }
    }

    /// Weight of the primal side by the pilot and the walks so far: independent of what the walks
    /// have found.
    #[must_use]
    pub fn planned_share(&self) -> f64 {
        let weight = |side: Side| {
            self.exposure(side)
                .map_or(0.0, |e| e.walks as f64 / self.pilot[side as usize].max(1e-12))
        };
        let (primal, dual) = (weight(Side::Primal), weight(Side::Dual));
        if primal + dual > 0.0 { primal / (primal + dual) } else { 0.5 }
    }

    /// All that is known of the picture's mean. Sums up the films, once.
    #[must_use]
    pub fn summary(&self) -> Summary {
        let sides = Side::BOTH.map(|side| self.exposure(side).map(|e| e.reading(0)));
        let share = self.share_of(&sides);
        let (combined, duality_z) = match sides {
            [Some(p), Some(d)] => (combine(&p, &d, share).reading, self.gap(&p, &d)),
            [p, d] => (p.or(d).unwrap_or_default(), None),
        };
        let complaint = self.own_complaints(share, &combined).join("; ");
        let unvouched = self.unvouched(&sides, share, &combined, duality_z);
        let alone = sides.iter().any(Option::is_none);
        Summary { sides, share, combined, duality_z, trust: Trust { complaint, unvouched, alone } }
    }

    /// The duality gap, if both sides have found light and see the same.
    fn gap(&self, p: &WalkEstimate, d: &WalkEstimate) -> Option<f64> {
        let known = |r: &WalkEstimate| r.std_error.is_finite() && r.mean > 0.0;
        let comparable = known(p) && known(d) && !self.through_glass;
        comparable
            .then(|| duality_z(p.mean, p.std_error, d.mean, d.std_error))
            .filter(|z| z.is_finite())
    }

    /// What speaks against the error bar by the scores themselves: every side that carries a tenth
    /// of the mean or more must converge.
    fn own_complaints(&self, share: f64, combined: &WalkEstimate) -> Vec<String> {
        let both = self.exposures.iter().all(Option::is_some);
        // A side that carries next to nothing may be as bad as it likes.
        let counts = |e: &&Exposure| {
            !both || if e.side == Side::Primal { share } else { 1.0 - share } >= 0.1
        };
        let unknown =
            (!combined.rel_error().is_finite()).then(|| "its error is not known yet".to_owned());
        unknown
            .into_iter()
            .chain(
                self.exposures
                    .iter()
                    .flatten()
                    .filter(counts)
                    .flat_map(|e| certificate::own_complaints(e, both)),
            )
            .collect()
    }

    /// Why nothing vouches for what the walks have not met; `None` if the other side does.
    fn unvouched(
        &self,
        sides: &[Option<WalkEstimate>; 2],
        share: f64,
        combined: &WalkEstimate,
        gap: Option<f64>,
    ) -> Option<String> {
        let ([Some(primal), Some(dual)], [Some(p), Some(d)]) = (&self.exposures, sides) else {
            return Some(ALONE.into());
        };
        if self.through_glass {
            return Some(
                "the camera sees smooth glass, through which no walk from the lamps finds it: nothing vouches for what is seen there"
                    .into(),
            );
        }
        let unmet = if let (Some(p), Some(d)) = (&primal.reach, &dual.reach) {
            unmet(p, d, reach::near)
        } else {
            None
        };
        let unaccounted = unmet.map(|unmet| {
            let [p, d] = certificate::bounds(&unmet, [p, d].map(|r| (r.mean, r.std_error)));
            share * p + (1.0 - share) * d
        });
        certificate::disagreement([p.mean, d.mean], gap)
            .or_else(|| certificate::missing(combined.mean, combined.std_error, unaccounted))
    }

    /// CPU-seconds spent on it, the pilot included.
    #[must_use]
    pub fn cpu_seconds(&self) -> f64 {
        self.pilot_cpu_seconds + self.exposures.iter().flatten().map(|e| e.cpu_seconds).sum::<f64>()
    }

    /// Walks per pixel, the larger of the sides'.
    #[must_use]
    pub fn samples_per_pixel(&self) -> f64 {
        self.exposures
            .iter()
            .flatten()
            .filter_map(|e| e.film.as_ref())
            .map(Film::samples_per_pixel)
            .fold(0.0, f64::max)
    }

    /// Share done, if it has a limit.
    #[must_use]
    pub fn done(&self) -> f64 {
        let live = self.exposures.iter().flatten();
        let n = live.clone().count().max(1) as f64;
        live.map(Exposure::done).sum::<f64>() / n
    }

    /// The picture, or the part of order `order` in it. Black where a side is wanted that is not
    /// walked.
    #[must_use]
    pub fn image(&self, view: View, order: Option<usize>) -> Image {
        let film = |side: Side| self.exposure(side).and_then(|e| e.film.as_ref());
        let parts: Vec<(&Film, f32)> = match (view, film(Side::Primal), film(Side::Dual)) {
            (View::Primal, Some(f), _)
            | (View::Dual, _, Some(f))
            | (View::Combined, Some(f), None)
            | (View::Combined, None, Some(f)) => {
                vec![(f, 1.0)]
            }
            (View::Combined, Some(p), Some(d)) => {
                let share = self.share() as f32;
                vec![(p, share), (d, 1.0 - share)]
            }
            _ => Vec::new(),
        };
        blend(&self.camera, &parts, order)
    }
}

/// A mixture may be so many times worse than its better side while neither error bar may be
/// trusted.
const GROSS: f64 = 2.0;

/// Four walks a pixel from one batch.
fn pilot_camera(of: &Camera) -> Camera {
    let aspect = f64::from(of.width) / f64::from(of.height.max(1));
    let width = ((BATCH / 4) as f64 * aspect).sqrt().clamp(1.0, (BATCH / 4) as f64).floor() as u32;
    Camera { width, height: (BATCH / 4) as u32 / width, ..of.clone() }
}

/// Weight of the primal side, given what was `planned`, and of each side its reading and whether
/// its error bar may be trusted. The pilot knows of no tail, and its coarse pixels hold contrast
/// that the film's do not: where the planned mixture is worse than a side that may be trusted, or
/// [`GROSS`]ly worse than any, and the other side does not contradict it, this side stands alone.
/// (Which one that is depends on the walks themselves; since the two agree within their errors
/// then, it hardly moves the mean.)
fn settle(
    planned: f64,
    [(primal, primal_holds), (dual, dual_holds)]: [(WalkEstimate, bool); 2],
) -> f64 {
    let (better, holds, alone) = if primal.std_error <= dual.std_error {
        (primal, primal_holds, 1.0)
    } else {
        (dual, dual_holds, 0.0)
    };
    let gap = duality_z(primal.mean, primal.std_error, dual.mean, dual.std_error);
    let mixed = combine(&primal, &dual, planned).reading.std_error;
    let known = primal.std_error.is_finite() && dual.std_error.is_finite();
    let spoils = mixed > better.std_error * if holds { 1.0 } else { GROSS };
    if spoils && known && gap.abs() <= 3.0 { alone } else { planned }
}

fn steered(exposure: Exposure, guide: Option<&Arc<Guide>>) -> Exposure {
    match guide {
        Some(guide) => exposure.steered_by(guide, 0),
        None => exposure,
    }
}

fn blend(camera: &Camera, parts: &[(&Film, f32)], order: Option<usize>) -> Image {
    let n = camera.width as usize * camera.height as usize;
    let mut image = Image {
        width: camera.width,
        height: camera.height,
        mean: vec![Vec3::ZERO; n],
        variance: vec![Vec3::ZERO; n],
        samples: vec![0.0; n],
    };
    for &(film, share) in parts.iter().filter(|(_, share)| *share > 0.0) {
        for i in 0..n {
            let mean = match order {
                Some(order) => film.order_mean(i, order).unwrap_or(Vec3::ZERO),
                None => film.mean(i),
            };
            image.mean[i] += share * mean;
            image.variance[i] += share * share * film.variance(i);
            image.samples[i] += film.samples(i) as f32;
        }
    }
    image
}

/// One score of a replayed walk.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scored {
    /// Order of the Neumann series.
    pub order: u32,
    /// Which pixel.
    pub pixel: u32,
    /// Radiance, W·m⁻²·sr⁻¹.
    pub value: [f32; 3],
}

struct Log(Vec<Scored>);

impl Tally<Rgb> for Log {
    fn score(&mut self, _: u32, bin: u32, order: u32, value: Rgb) {
        self.0.push(Scored { order, pixel: bin, value: value.0.into() });
    }
}

/// Walks one sample again, alone: sample `sample` of pixel (x, y) from the camera, or, for the
/// dual, walk `sample` (x, y ignored). Returns all that it scored: the same numbers, to the bit,
/// that went into the picture.
#[must_use]
pub fn replay(
    lit: &LitScene,
    camera: &Camera,
    side: Side,
    rule: &WalkRule,
    seed: u64,
    [x, y]: [u32; 2],
    sample: u64,
) -> Vec<Scored> {
    let sensors = [Sensor::Camera(camera.clone())];
    let problem = LightProblem::new(lit, &sensors);
    let walk = match side {
        Side::Primal => {
            sample * sensors[0].bins() as u64
                + u64::from(y) * u64::from(camera.width)
                + u64::from(x)
        }
        Side::Dual => sample,
    };
    let mut log = Log(Vec::new());
    run(&problem, side, rule, seed, walk..walk + 1, &mut Workspace::default(), &mut log);
    log.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(mean: f64, std_error: f64) -> WalkEstimate {
        WalkEstimate { mean, std_error, walks: 1000 }
    }

    #[test]
    fn a_mixture_that_is_worse_than_its_better_side_gives_way_to_it() {
        let (good, bad) = (reading(1.0, 0.01), reading(1.05, 0.4));
        assert_eq!(settle(0.5, [(good, true), (bad, false)]), 1.0);
        assert_eq!(settle(0.5, [(bad, false), (good, true)]), 0.0);
        // A mixture that helps stays as it was planned.
        assert_eq!(settle(0.5, [(good, true), (good, true)]), 0.5);
        // An error bar that may not be trusted is no better one, unless it is by far; nor is one
        // that the other side contradicts or cannot vouch for yet.
        assert_eq!(settle(0.5, [(good, false), (reading(1.0, 0.03), false)]), 0.5);
        assert_eq!(settle(0.5, [(good, false), (bad, false)]), 1.0);
        assert_eq!(settle(0.5, [(good, true), (reading(0.0, f64::INFINITY), false)]), 0.5);
        assert_eq!(settle(0.5, [(good, true), (reading(3.0, 0.4), true)]), 0.5);
    }

    #[test]
    fn a_pilot_has_four_walks_a_pixel_whatever_the_shape() {
        for (width, height) in [(960, 600), (1, 1), (16_384, 1), (1, 16_384), (64, 48)] {
            let camera = Camera { width, height, ..Camera::overview(Scene::default().bounds()) };
            let camera = pilot_camera(&camera);
            let pixels = camera.width * camera.height;
            assert!(
                camera.width > 0 && camera.height > 0 && u64::from(pixels) <= BATCH / 4,
                "{width} × {height}: {pixels}"
            );
        }
    }

    /// The picture's contrast is no error of the primal's: where its pixels are known well the plan
    /// must say so.
    #[test]
    fn the_plan_does_not_spoil_the_better_side() {
        for name in ["cornell", "room", "corridor"] {
            let scene = Arc::new(
                Scene::open(std::path::Path::new(name), &intrados_stage::Job::default()).unwrap(),
            );
            let mut camera = scene.cameras[0].clone();
            (camera.width, camera.height) = (64, 48);
            let rule = scene_rule(&scene);
            let lit = Arc::new(LitScene::build(scene, &intrados_stage::Job::default()).unwrap());
            for seed in 1..=4 {
                let mut render = Render::new(
                    Arc::clone(&lit),
                    &camera,
                    &RenderSettings { seed, rule, ..RenderSettings::default() },
                );
                render.advance(16);
                let [p, d] = [Side::Primal, Side::Dual]
                    .map(|side| render.exposure(side).unwrap().reading(0).std_error);
                let planned =
                    (render.planned_share() * p).hypot((1.0 - render.planned_share()) * d);
                // 4096 walks tell a variance to some 20 %, which costs a per cent of the mixture;
                // the pilot's pixels are larger than the film's.
                assert!(
                    planned < 1.25 * p.min(d),
                    "{name}, seed {seed}: {planned:.2e} of {p:.2e} and {d:.2e}"
                );
            }
        }
    }
}
