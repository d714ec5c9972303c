//! Measured cover, carbonation and chloride take the place of what the exposure class assumes.
//!
//! A possible state is *moved* by these readings, not weighted: an instrument is not disbelieved
//! because an assumption disagrees, and no state has to be near the reading by chance. Each state
//! keeps its rank, and mean and deviation become those of the normal posterior (conjugate prior,
//! Gelman et al. 2013, 2.5), so that every state has less cover, or a deeper front, where less
//! cover or a deeper front is read:
//!
//! | reading | moved | error |
//! |---|---|---|
//! | cover | the cover's deviation from the drawing, m | its own and 5 mm between bars |
//! | carbonation | logarithm of the front's rate | its own, relative to the expected or, if that is more, the read depth (10 mm at least), and 15 % of the model |
//! | chloride | surface content (never below 1.25 × what is read) and diffusion, so that Fick's profile passes through the samples; those near the bars count most, by exp(−distance/15 mm) | its own, and 15 % of the model |
//!
//! What is stated has the deviation that the class's model gives it. What is assumed yields: 20 mm
//! for a cover, a factor of e for rate and diffusion (both ours).

use intrados_mechanics::material::durability::{Attack, Bars, Corrosion, Other};
use intrados_scene::structure::Shows;
use intrados_stage::{Cancelled, Job, random::Key};
use statrs::function::erf::erfc_inv;

use crate::{
    cell::{ReadingCell, bars_of_cell},
    possible::{MODEL, Possible},
    site::Site,
};

/// Between bars of one place, m.
const COVER_LOCAL: f64 = 0.005;
/// Deviation of a cover that was only assumed, m (ours).
const ASSUMED_COVER: f64 = 0.02;
/// Deviation of the logarithm of a rate or a diffusion that was only assumed (ours).
const ASSUMED_LOG: f64 = 1.0;
/// Depth of carbonation below which the error of a reading is as of this, m.
const LEAST_FRONT: f64 = 0.01;
/// The least depth that a logarithm is taken of, m.
const LEAST_DEPTH: f64 = 0.001;
/// How near the bars a sample of a profile must be to count, m.
const NEAR_BARS: f64 = 0.015;
/// A surface content is at least so many times what is read beneath it.
const ABOVE: f64 = 1.25;
/// Shares of the surface's content between which a profile tells its diffusion.
const SHARES: [f64; 2] = [1e-4, 0.98];
/// More profiles of one place than this are pooled by depth.
const MOST_PROFILES: usize = 16;
/// Depths that are pooled, mm.
const POOLED_MM: f64 = 5.0;
/// From so many deviations on a reading is said to be far from what was expected.
const FAR: f64 = 3.0;
/// Seed of the errors of chloride profiles.
const SEED: u64 = 0x7361_6c74;

/// Readings as their precision and their weighted sum.
#[derive(Debug, Clone, Copy, Default)]
struct PrecisionSum {
    precision: f64,
    weighted: f64,
}

impl PrecisionSum {
    fn add(&mut self, value: f64, error: f64, power: f64) {
        let precision = power / (error * error);
        self.precision += precision;
        self.weighted += precision * value;
    }

    fn extend(&mut self, other: Self, power: f64) {
        self.precision += power * other.precision;
        self.weighted += power * other.weighted;
    }
}

/// Mean and deviation of something over all possible states.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PriorSpread {
    mean: f64,
    deviation: f64,
}

impl PriorSpread {
    fn of(draws: &[Possible], value: impl Fn(&Other) -> f64) -> Self {
        let (mut whole, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for draw in draws {
            let (weight, x) = (draw.prior.exp(), value(&draw.other));
            whole += weight;
            sum += weight * x;
            squares += weight * x * x;
        }
        let mean = sum / whole;
        Self { mean, deviation: (squares / whole - mean * mean).max(0.0).sqrt() }
    }

    /// With the deviation of an assumption, as far (0 to 1) as readings are heard.
    fn yielding(self, assumed: Option<f64>, heard: f64) -> f64 {
        let own = self.deviation.powi(2);
        let more = assumed.map_or(0.0, |assumed| (assumed * assumed - own).max(0.0));
        (own + heard.min(1.0) * more).sqrt()
    }

    /// Where a value of rank (x − mean)/deviation moves to by what was read; `deviation` is the
    /// prior's.
    fn posterior(self, deviation: f64, read: PrecisionSum) -> impl Fn(f64) -> f64 {
        let prior = deviation.max(1e-9).powi(-2);
        let variance = (prior + read.precision).recip();
        let mean = variance * (prior * self.mean + read.weighted);
        let shrunk = if self.deviation > 0.0 { variance.sqrt() / self.deviation } else { 0.0 };
        move |x| mean + shrunk * (x - self.mean)
    }
}

/// A profile of chloride.
#[derive(Debug, Clone)]
struct SaltProfile {
    /// Depth (m) and content (% of the binder).
    samples: Vec<[f64; 2]>,
    error: f64,
    /// Of the concrete then, s.
    age: f64,
    power: f64,
}

/// What was measured in the zones of one cell.
struct MeasuredCell {
    zones: [usize; 2],
    bars: Bars,
    cover: PrecisionSum,
    front: PrecisionSum,
    profiles: Vec<SaltProfile>,
}

/// All that was measured of cover, carbonation and chloride on a member.
pub(crate) struct MeasuredState {
    cells: Vec<MeasuredCell>,
    cover: PriorSpread,
    front: Option<PriorSpread>,
    salt: Option<PriorSpread>,
    is_cover_assumed: bool,
    is_class_assumed: bool,
    /// What is far from what was expected, for people.
    pub(crate) surprises: Vec<String>,
}

impl MeasuredState {
    pub(crate) fn new(
        site: &Site,
        corrosion: &Corrosion,
        draws: &[Possible],
        cells: &[ReadingCell],
    ) -> Self {
        let has_front = draws.first().is_some_and(|d| d.other.front().is_some());
        let front = has_front.then(|| PriorSpread::of(draws, log_rate));
        let has_salt = matches!(corrosion.attack, Attack::Chloride { .. });
        let salt = has_salt.then(|| PriorSpread::of(draws, log_diffusion));
        let mut state = Self {
            cells: Vec::new(),
            cover: PriorSpread::of(draws, |other| other.cover),
            front,
            salt,
            is_cover_assumed: site.is_steel_assumed,
            is_class_assumed: !corrosion.assumed.is_empty(),
            surprises: Vec::new(),
        };
        state.cells = cells.iter().filter_map(|cell| state.measured(site, draws, cell)).collect();
        state.surprises = state.surprising(site);
        state
    }

    fn measured(
        &self,
        site: &Site,
        draws: &[Possible],
        cell: &ReadingCell,
    ) -> Option<MeasuredCell> {
        let (bars, outer) = bars_of_cell(site, cell.zones)?;
        let weather = draws.first().and_then(|d| d.other.front());
        let count = |is: fn(&Shows) -> bool| {
            cell.readings.iter().filter(|p| is(p.shows)).count().max(1) as f64
        };
        // Covers each speak for themselves, fronts and profiles of one place err together.
        let fronts = count(|shows| matches!(shows, Shows::Carbonation { .. }));
        let profiles = count(|shows| matches!(shows, Shows::Chloride { .. }));
        let mut found = MeasuredCell {
            zones: cell.zones,
            bars,
            cover: PrecisionSum::default(),
            front: PrecisionSum::default(),
            profiles: Vec::new(),
        };
        for p in &cell.readings {
            let age = site.age_at(p);
            match p.shows {
                Shows::Cover { mm, std_error_mm } => {
                    let error = (1e-3 * std_error_mm).hypot(COVER_LOCAL);
                    found.cover.add(1e-3 * mm - outer, error, 1.0);
                }
                Shows::Carbonation { mm, std_error_mm } => {
                    let (Some(prior), Some(front)) = (self.front, weather) else { continue };
                    // Depth of a front of rate 1 in the same weather.
                    let unit = front.depth(age) / front.rate.max(LEAST_RATE);
                    if unit <= 0.0 || !unit.is_finite() {
                        continue;
                    }
                    // Not relative to a shallow reading: a small one would say the less, the less
                    // it is.
                    let depth = (prior.mean.exp() * unit).max(1e-3 * mm).max(LEAST_FRONT);
                    let error = (1e-3 * std_error_mm / depth).hypot(MODEL);
                    let rate = (1e-3 * mm).max(LEAST_DEPTH) / unit;
                    found.front.add(rate.ln(), error, 1.0 / fronts);
                }
                Shows::Chloride { depths_mm, percent_of_cement, std_error_percent } => {
                    let samples = depths_mm.iter().zip(percent_of_cement);
                    found.profiles.push(SaltProfile {
                        samples: samples.map(|(mm, content)| [1e-3 * mm, *content]).collect(),
                        error: *std_error_percent,
                        age,
                        power: 1.0 / profiles,
                    });
                }
                _ => {}
            }
        }
        if found.profiles.len() > MOST_PROFILES {
            found.profiles = vec![pooled(&found.profiles)];
        }
        let is_measured = found.cover.precision > 0.0
            || found.front.precision > 0.0
            || !found.profiles.is_empty();
        is_measured.then_some(found)
    }

    /// The possible states of a zone by what was measured there and near it; none where nothing
    /// was.
    ///
    /// # Errors
    /// The job was cancelled.
    pub(crate) fn moved(
        &self,
        site: &Site,
        zone: usize,
        reach_m: f64,
        draws: &[Possible],
        job: &Job,
    ) -> Result<Option<Vec<Possible>>, Cancelled> {
        if self.cells.is_empty() {
            return Ok(None);
        }
        let heard = |cell: &MeasuredCell| site.heard(cell.zones, zone, reach_m);
        let (mut cover, mut front) = (PrecisionSum::default(), PrecisionSum::default());
        let [mut covers_heard, mut fronts_heard] = [0.0_f64; 2];
        for cell in &self.cells {
            let power = heard(cell);
            cover.extend(cell.cover, power);
            front.extend(cell.front, power);
            if cell.cover.precision > 0.0 {
                covers_heard = covers_heard.max(power);
            }
            if cell.front.precision > 0.0 {
                fronts_heard = fronts_heard.max(power);
            }
        }
        let mut moved = draws.to_vec();
        if cover.precision > 0.0 {
            let assumed = self.is_cover_assumed.then_some(ASSUMED_COVER);
            let deviation = self.cover.yielding(assumed, covers_heard);
            let to = self.cover.posterior(deviation, cover);
            moved.iter_mut().for_each(|draw| draw.other.cover = to(draw.other.cover));
        }
        if let Some(prior) = self.front.filter(|_| front.precision > 0.0) {
            let assumed = self.is_class_assumed.then_some(ASSUMED_LOG);
            let to = prior.posterior(prior.yielding(assumed, fronts_heard), front);
            moved.iter_mut().for_each(|draw| {
                let rate = to(log_rate(&draw.other)).exp();
                set_rate(&mut draw.other, rate);
            });
        }
        let profiles: Vec<(&SaltProfile, f64, &Bars)> = self
            .cells
            .iter()
            .flat_map(|cell| cell.profiles.iter().map(|p| (p, p.power * heard(cell), &cell.bars)))
            .filter(|(_, power, _)| *power > 1e-6)
            .collect();
        if let Some(prior) = self.salt.filter(|_| !profiles.is_empty()) {
            let assumed = self.is_class_assumed.then_some(ASSUMED_LOG);
            let loudest = profiles.iter().map(|p| p.1).fold(0.0, f64::max);
            let deviation = prior.yielding(assumed, loudest);
            for (k, draw) in moved.iter_mut().enumerate() {
                if k % 256 == 0 {
                    job.check()?;
                }
                salt(&mut draw.other, k as u64, &profiles, deviation);
            }
        }
        Ok(Some(moved))
    }

    /// What is far from what was expected; each line says that the reading counts.
    fn surprising(&self, site: &Site) -> Vec<String> {
        let total = |of: fn(&MeasuredCell) -> PrecisionSum| {
            let mut sum = PrecisionSum::default();
            self.cells.iter().for_each(|cell| sum.extend(of(cell), 1.0));
            (sum.precision > 0.0).then_some(sum)
        };
        let mut lines = Vec::new();
        if let Some(read) = total(|cell| cell.cover) {
            let apart = read.weighted / read.precision - self.cover.mean;
            if apart.abs() > FAR * self.cover.deviation.hypot(read.precision.sqrt().recip()) {
                let expected = site.outer.iter().flatten().copied().fold(f64::INFINITY, f64::min);
                lines.push(format!(
                    "the measured cover is {:.0} mm where {:.0} mm {}: the reading counts, check it",
                    1e3 * (expected + apart),
                    1e3 * expected,
                    if self.is_cover_assumed { "was assumed" } else { "is stated" },
                ));
            }
        }
        if let (Some(read), Some(prior)) = (total(|cell| cell.front), self.front) {
            let apart = read.weighted / read.precision - prior.mean;
            if apart.abs() > FAR * prior.deviation.hypot(read.precision.sqrt().recip()) {
                lines.push(format!(
                    "the measured carbonation is {:.1} × what the exposure class lets expect: the reading counts, check it",
                    apart.exp()
                ));
            }
        }
        lines
    }
}

/// A rate that is not nothing, m/√s.
const LEAST_RATE: f64 = 1e-12;

fn log_rate(other: &Other) -> f64 {
    other.front().map_or(0.0, |front| front.rate.max(LEAST_RATE).ln())
}

fn set_rate(other: &mut Other, rate: f64) {
    if let Attack::Carbonation(front) = &mut other.attack {
        front.rate = rate;
    } else if let Some(air) = &mut other.beside {
        air.front.rate = rate;
    }
}

fn log_diffusion(other: &Other) -> f64 {
    match &other.attack {
        Attack::Chloride { ingress, .. } => ingress.diffusion.max(1e-18).ln(),
        Attack::Carbonation(_) => 0.0,
    }
}

/// Moves surface content and diffusion of the k-th state to what profiles tell, each with its
/// power.
fn salt(other: &mut Other, k: u64, profiles: &[(&SaltProfile, f64, &Bars)], deviation: f64) {
    let Attack::Chloride { ingress, convection, .. } = &mut other.attack else { return };
    let key = Key::new(SEED, k);
    let [of_model, of_reading] = [key.normal(0), key.normal(2)];
    let (mut weight, mut surface, mut diffusion) = (0.0, 0.0, 0.0);
    for (profile, power, bars) in profiles {
        let content = |c: f64| {
            let own = c * (MODEL * of_model).exp() + profile.error * of_reading;
            (own - ingress.initial).max(0.0)
        };
        let beneath = profile.samples.iter().filter(|s| s[0] > *convection + 1e-3);
        let most = beneath.clone().map(|s| content(s[1])).fold(0.0, f64::max);
        let above = (ingress.surface - ingress.initial).max(ABOVE * most).max(1e-6);
        let (mut near, mut sum) = (0.0, 0.0);
        for [depth, percent] in beneath {
            let share = (content(*percent) / above).clamp(SHARES[0], SHARES[1]);
            let root = (depth - *convection) / (2.0 * erfc_inv(share));
            let own = (-(depth - bars.cover).abs() / NEAR_BARS).exp().max(1e-6);
            near += own;
            sum += own * 2.0 * root.ln();
        }
        if near <= 0.0 || profile.age <= 0.0 {
            continue;
        }
        // D t is known, and D₀ by the exponent of ageing.
        let aged = (profile.age / ingress.reference).powf(ingress.ageing) / profile.age;
        weight += power;
        surface += power * above.ln();
        diffusion += power * (sum / near + aged.ln());
    }
    if weight <= 0.0 {
        return;
    }
    let [prior, read] = [deviation.max(1e-9).powi(-2), weight / (MODEL * MODEL)];
    let share = read / (prior + read);
    let between = |own: f64, told: f64| ((1.0 - share) * own.ln() + share * told / weight).exp();
    let own = (ingress.surface - ingress.initial).max(1e-6);
    ingress.surface = ingress.initial + between(own, surface);
    ingress.diffusion = between(ingress.diffusion.max(1e-18), diffusion);
}

/// Many profiles of one place as one: means by steps of depth.
fn pooled(profiles: &[SaltProfile]) -> SaltProfile {
    let mut steps: std::collections::BTreeMap<i64, [f64; 3]> = std::collections::BTreeMap::new();
    for [depth, content] in profiles.iter().flat_map(|p| &p.samples) {
        let step = steps.entry((1e3 * depth / POOLED_MM).round() as i64).or_default();
        *step = [step[0] + depth, step[1] + content, step[2] + 1.0];
    }
    let mean = |of: fn(&SaltProfile) -> f64| {
        profiles.iter().map(of).sum::<f64>() / profiles.len().max(1) as f64
    };
    SaltProfile {
        samples: steps.values().map(|[depth, content, n]| [depth / n, content / n]).collect(),
        error: mean(|p| p.error),
        age: mean(|p| p.age),
        power: 1.0,
    }
}
