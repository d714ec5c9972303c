//! Rust of bars, by everything that speaks of it: the likelihood of each reading for each of the
//! things that the exposure class leaves open (`intrados_mechanics::material::durability`).
//!
//! | reading | likelihood | source |
//! |---|---|---|
//! | cover | normal about the drawing's cover and its deviation; 5 mm between bars | ours |
//! | carbonation | normal about the front's depth; the model is 15 % off | ours |
//! | chloride | normal about Fick's profile beneath what splashes; the model is 15 % off | ours |
//! | half-cell | 1/(1 + exp((E + 275 mV)/34.1 mV)) of rust: 10 % at −200, 90 % at −350 mV, never nearer to sure than 5 % | ASTM C876, appendix; logistic between, ours |
//! | crack along | lognormal (.5) about w = .0575 mm⁻¹ (ΔA − ΔA₀), ΔA₀ at (7.53 + 9.32 c/φ) µm; one in ten has other causes | Vidal et al. 2004, Alonso et al. 1998; shares ours |
//! | intact | no crack that an eye finds: half of them at .15 mm; by a photograph, on the share of the surface that it shows, at the width that it could have shown | ours |
//! | hollow | half of what is cracked to .4 mm | ours |
//! | spall | half of what is cracked to 1 mm, the width taken as spalling | Vu, Stewart and Mullard 2005; curve ours |
//! | rust stains | half of what is cracked to .2 mm, fewer without cracks | ours |
//! | efflorescence, wet spot | 1.5 times as often over bars that rust | ours |
//!
//! No class knows of a leaking joint or of salt that somebody spilt: of all that may be, one in
//! twenty ([`UNFORESEEN`]) rusts since any day of its life, as with salt, whatever its cover (ours).
//! Without that, no reading could speak against a class that lets nothing rust.
//!
//! Readings of one kind in one zone err together by their model: of n of them each counts 1/n. Only
//! of covers each speaks for itself.

use std::collections::BTreeMap;

use intrados_damage::{
    evidence::Cause,
    grading::Profile,
    zone::{ZONES, Zones},
};
use intrados_mechanics::material::durability::{Attack, Bars, Corrosion, Other};
use intrados_scene::structure::{Course, Observation, Shows};
use intrados_stage::{Estimate, random::Key, time::YEAR};
use serde_json::json;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::site::{FORECAST_YEARS, HEARD, Placed, Site};

/// Things that may be; the posterior of three readings that agree still rests on hundreds.
pub(crate) const DRAWS: usize = 8192;
/// So many of them the posterior must rest on (Kish's effective number); else all readings count by
/// a smaller power.
const LEAST: f64 = 50.0;
/// Readings of which a share so large may be wrong in any way.
const WRONG: f64 = 0.02;

/// Between bars of one place, m.
const COVER_LOCAL: f64 = 0.005;
/// Of a front or profile, relative to itself.
const MODEL: f64 = 0.15;

/// Share of all that may be in which something attacks that the class does not know of, and the
/// share of the draws that are spent on it.
const UNFORESEEN: f64 = 0.05;
const DRAWN: f64 = 0.25;
/// Its rust, µm a year: of chloride, dried and wetted (fib MC2020, table 30.1-6).
const SALT_RATE: [f64; 2] = [30.0, 40.0];
/// Seed of when it begins and how fast it goes.
const SEED: u64 = 0x006c_6561_6b73;

/// One of the things that may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Possible {
    pub(crate) other: Other,
    /// Logarithm of its weight before anything is read.
    prior: f64,
}

/// All that may be of a corrosion, of steel that is `age` (s) old.
pub(crate) fn possible(corrosion: &Corrosion, count: usize, age: f64) -> Vec<Possible> {
    let is_drawn = |k: usize| k % 4 == 3;
    let one = |(k, other): (usize, Other)| {
        if !is_drawn(k) {
            return Possible { other, prior: ((1.0 - UNFORESEEN) / (1.0 - DRAWN)).ln() };
        }
        let key = Key::new(SEED, k as u64);
        let since = Some(age * key.unit64(0));
        let other = Other { current: salt_rate(key.unit64(1)), since, ..other };
        Possible { other, prior: (UNFORESEEN / DRAWN).ln() }
    };
    corrosion.possible(count).into_iter().enumerate().map(one).collect()
}

/// A corrosion current of [`SALT_RATE`], A/m² (11.6 µm a year are .01 A/m²), at a share of its
/// distribution.
fn salt_rate(share: f64) -> f64 {
    let [mean, deviation] = SALT_RATE;
    let variance = (1.0 + (deviation / mean).powi(2)).ln();
    let z = Normal::standard().inverse_cdf(share.clamp(1e-6, 1.0 - 1e-6));
    0.01 / 11.6 * mean * (variance.sqrt() * z - 0.5 * variance).exp()
}

#[cfg(test)]
impl Possible {
    pub(crate) fn is_unforeseen(&self) -> bool {
        self.other.since.is_some()
    }
}

/// Whether it says anything of rust.
pub(crate) fn speaks(shows: &Shows) -> bool {
    !matches!(shows, Shows::Rebound { .. } | Shows::Velocity { .. } | Shows::CoreStrength { .. })
        && !matches!(shows, Shows::Crack { course, .. } if *course != Course::Along)
}

/// All that may be, weighed.
pub(crate) struct Weighed {
    draws: Vec<Possible>,
    /// By zone: weights that sum to one; none where nothing is heard.
    weights: [Option<Vec<f64>>; ZONES],
    /// The smallest power that all readings of a zone had to be raised to.
    power: f64,
    /// By zone, the share of bars' section that is gone, and the probability that any rusts.
    found: [Option<(Estimate, f64)>; ZONES],
}

impl Weighed {
    /// Of the readings of a member; those that cannot be weighed become `unused`.
    pub(crate) fn new(
        site: &Site,
        placed: &[Placed],
        profile: &Profile,
        unused: &mut BTreeMap<usize, String>,
    ) -> Self {
        let mut weighed = Self {
            draws: Vec::new(),
            weights: Default::default(),
            power: 1.0,
            found: [None; ZONES],
        };
        let Ok(corrosion) = &site.corrosion else {
            let why = site.corrosion.as_ref().err().map_or("", String::as_str);
            for p in placed.iter().filter(|p| speaks(p.shows) && only_of_rust(p.shows)) {
                unused.insert(p.number, format!("it speaks of rust, and {why}"));
            }
            return weighed;
        };
        let heard: Vec<&Placed> = placed.iter().filter(|p| speaks(p.shows)).collect();
        let heard: Vec<&Placed> = heard
            .into_iter()
            .filter(|p| match deaf(site, corrosion, p) {
                None => true,
                Some(_) if !only_of_rust(p.shows) => false,
                Some(why) => {
                    unused.insert(p.number, why);
                    false
                }
            })
            .collect();
        if heard.is_empty() {
            return weighed;
        }
        weighed.draws = possible(corrosion, DRAWS, site.age);
        let said: Vec<Vec<f64>> =
            heard.iter().map(|p| logarithms(site, &weighed.draws, p)).collect();
        let reach = profile.fusion.correlation_m.get(&Cause::Steel).copied().unwrap_or(1.0);
        for zone in 0..ZONES {
            let powers: Vec<f64> =
                heard.iter().map(|p| site.heard(p, zone, reach) / alike(&heard, p)).collect();
            let loudest = powers.iter().copied().fold(0.0, f64::max);
            if loudest < HEARD || site.bars[zone].is_empty() {
                continue;
            }
            let sum = |k: usize| said.iter().zip(&powers).map(|(said, p)| p * said[k]).sum();
            let logs: Vec<f64> = (0..weighed.draws.len()).map(sum).collect();
            let priors: Vec<f64> = weighed.draws.iter().map(|draw| draw.prior).collect();
            let (weights, power) = weights(&logs, &priors);
            weighed.power = weighed.power.min(power);
            weighed.found[zone] =
                Some(posterior(&weighed.draws, &weights, &site.bars[zone], site.age));
            weighed.weights[zone] = Some(weights);
        }
        weighed
    }

    /// Share of the bars' section that is gone, by zone.
    pub(crate) fn zones(&self) -> Option<(Cause, Zones)> {
        let zones = Zones(self.found.map(|found| found.map(|(lost, _)| lost)));
        zones.worst().map(|_| (Cause::Steel, zones))
    }

    /// The zone where bars most probably rust, and how probably.
    pub(crate) fn worst(&self) -> Option<(usize, f64)> {
        let known = self.found.iter().enumerate().filter_map(|(z, f)| Some((z, f.as_ref()?.1)));
        known.reduce(|worst, next| if next.1 > worst.1 { next } else { worst })
    }

    /// The power that readings count by where they contradict all that the class leaves open.
    pub(crate) fn tempered(&self) -> Option<f64> {
        (self.power < 0.5).then_some(self.power)
    }

    /// Share that is gone in the worst zone at some age, s.
    fn at(&self, site: &Site, age: f64) -> Option<Estimate> {
        let zones = self.weights.iter().zip(&site.bars).filter_map(|(weights, bars)| {
            Some(posterior(&self.draws, weights.as_ref()?, bars, age).0)
        });
        zones.reduce(|worst, next| if next.value > worst.value { next } else { worst })
    }

    /// The course of rust over the dates of the observations and on, for scripts and plots.
    pub(crate) fn details(&self, site: &Site, all: &[(usize, &Observation)]) -> serde_json::Value {
        let mut dates: Vec<_> = all.iter().filter_map(|(_, o)| o.date).collect();
        dates.sort_unstable();
        dates.dedup();
        let last = dates.last().copied();
        let point = |date: Option<String>, age: f64| {
            let lost = self.at(site, age)?;
            Some(json!({
                "date": date, "age_years": age / YEAR, "steel_lost": lost.value, "std_error": lost.std_error,
            }))
        };
        let then = dates.iter().filter_map(|date| {
            let days = date.days_until(last?) as f64;
            point(Some(date.to_string()), site.age - days * intrados_stage::time::DAY)
        });
        let ahead = site.age + FORECAST_YEARS * YEAR;
        let now = if last.is_none() { point(None, site.age) } else { None };
        let course: Vec<_> = then.chain(now).chain(point(None, ahead)).collect();
        json!({
            "probability_active": self.found.map(|f| f.map(|(_, active)| active)),
            "power": self.power,
            "course": course,
        })
    }
}

/// Why a profile of salt is not heard where the exposure class knows of none.
pub(crate) const NO_SALT: &str = "by its exposure class there is no salt: name an XD or XS class in exposure, so that the profile can be weighed";
/// Why a depth of carbonation is not heard where the exposure class names salt alone.
pub(crate) const SALT_ALONE: &str = "by its exposure class salt alone attacks: name an XC class beside it in exposure, so that the depth can be weighed";

/// Whether it says nothing of anything but rust.
pub(crate) fn only_of_rust(shows: &Shows) -> bool {
    matches!(
        shows,
        Shows::Cover { .. }
            | Shows::HalfCell { .. }
            | Shows::Chloride { .. }
            | Shows::Carbonation { .. }
            | Shows::Rust { .. }
            | Shows::Efflorescence { .. }
            | Shows::WetSpot { .. }
    )
}

/// Why an observation says nothing of the rust of these bars.
fn deaf(site: &Site, corrosion: &Corrosion, placed: &Placed) -> Option<String> {
    let by_salt = matches!(corrosion.attack, Attack::Chloride { .. });
    match placed.shows {
        Shows::Chloride { .. } if !by_salt => Some(NO_SALT.into()),
        Shows::Carbonation { .. } if !corrosion.carbonates() => Some(SALT_ALONE.into()),
        _ if bars_at(site, placed).is_none() => {
            Some("no bars are known there: add them to the member's reinforcement".into())
        }
        _ => None,
    }
}

/// The bars with the least cover where it was made, and the concrete over the outermost steel.
fn bars_at(site: &Site, placed: &Placed) -> Option<(Bars, f64)> {
    let [from, to] = placed.zones;
    let bars = (from..=to).flat_map(|zone| &site.bars[zone]).copied();
    let least = bars.min_by(|a, b| a.cover.total_cmp(&b.cover))?;
    let outer = (from..=to).filter_map(|zone| site.outer[zone]).fold(least.cover, f64::min);
    Some((least, outer))
}

/// How many of its kind lie in the same zones, where these err together.
fn alike(heard: &[&Placed], one: &Placed) -> f64 {
    if matches!(one.shows, Shows::Cover { .. }) {
        return 1.0;
    }
    // What is intact at one face says nothing of another.
    let is_beside = |p: &Placed| matches!(p.shows, Shows::Intact { .. }) && p.face != one.face;
    let same =
        |p: &&&Placed| p.shows.kind() == one.shows.kind() && p.zones == one.zones && !is_beside(p);
    heard.iter().filter(same).count() as f64
}

/// The logarithm of the likelihood of a reading, for each thing that may be.
fn logarithms(site: &Site, draws: &[Possible], placed: &Placed) -> Vec<f64> {
    let Some((bars, outer)) = bars_at(site, placed) else { return vec![0.0; draws.len()] };
    let age = (site.age - placed.before).max(0.0);
    let shows = match *placed.shows {
        Shows::Intact { seen, limit_mm } => {
            Shows::Intact { seen: seen * placed.around(), limit_mm }
        }
        ref other => other.clone(),
    };
    draws.iter().map(|draw| logarithm(&shows, draw, &bars, outer, age)).collect()
}

/// The same for one of them.
fn logarithm(shows: &Shows, draw: &Possible, bars: &Bars, outer: f64, age: f64) -> f64 {
    let width = || crack_mm(draw, bars, age);
    let likelihood = match shows {
        Shows::Cover { mm, std_error_mm } => {
            let error = (1e-3 * std_error_mm).hypot(COVER_LOCAL);
            return robust((1e-3 * mm - (outer + draw.other.cover).max(0.0)) / error);
        }
        Shows::Carbonation { mm, std_error_mm } => {
            let Some(front) = draw.other.front() else { return 0.0 };
            let depth = 1e3 * front.depth(age);
            let error = std_error_mm.hypot(MODEL * depth);
            return robust((mm - depth) / error) - error.ln();
        }
        Shows::Chloride { depths_mm, percent_of_cement, std_error_percent } => {
            return chloride(&draw.other, depths_mm, percent_of_cement, *std_error_percent, age);
        }
        Shows::HalfCell { mv, std_error_mv, .. } => {
            let rusts = rusts(*mv, *std_error_mv);
            if draw.other.is_active(bars.cover, age) { rusts } else { 1.0 - rusts }
        }
        Shows::Crack { width_mm, std_error_mm, .. } => along(*width_mm, *std_error_mm, width()),
        Shows::Intact { seen, limit_mm } => {
            (1.0 - seen * half_at(width(), *limit_mm, 0.4)) * (1.0 - seen * OTHER_CAUSES)
        }
        Shows::Sounding { hollow_m2, tapped_m2 } => {
            let hollow = 0.03 + 0.94 * half_at(width(), 0.4, 0.5);
            let share = (hollow_m2 / tapped_m2.max(1e-9)).clamp(0.0, 1.0);
            // A hollow spot is one reading, however small beside what was tapped.
            if share > 0.0 { hollow } else { 1.0 - hollow }
        }
        Shows::Spall { bars_bare, .. } => {
            let background = if *bars_bare { 0.01 } else { 0.03 };
            background + 0.9 * half_at(width(), 1.0, 0.4)
        }
        Shows::Rust { .. } => {
            let active = f64::from(u8::from(draw.other.is_active(bars.cover, age)));
            0.03 + 0.15 * active + 0.6 * half_at(width(), 0.2, 0.5)
        }
        Shows::Efflorescence { .. } | Shows::WetSpot { .. } => {
            if draw.other.is_active(bars.cover, age) { 0.3 } else { 0.2 }
        }
        Shows::Rebound { .. } | Shows::Velocity { .. } | Shows::CoreStrength { .. } => 1.0,
    };
    likelihood.max(1e-300).ln()
}

/// Normal, with some readings that are wrong.
fn robust(z: f64) -> f64 {
    ((1.0 - WRONG) * (-0.5 * z * z).exp() + WRONG * 0.1).ln()
}

/// A profile against Fick's, beneath what splashes; two numbers of the model are learnt of it, so
/// that it counts as two readings however many samples it has.
fn chloride(draw: &Other, depths_mm: &[f64], percent: &[f64], error: f64, age: f64) -> f64 {
    let Attack::Chloride { ingress, convection, .. } = &draw.attack else { return 0.0 };
    let beneath = depths_mm.iter().zip(percent).filter(|(mm, _)| 1e-3 * **mm > *convection);
    let mut count = 0.0;
    let mut sum = 0.0;
    for (mm, percent) in beneath {
        let content = ingress.content(1e-3 * mm - convection, age);
        let error = error.hypot(MODEL * content);
        sum += robust((percent - content) / error) - error.ln();
        count += 1.0;
    }
    if count > 2.0 { sum * 2.0 / count } else { sum }
}

/// Probability of rust where a potential (mV against Cu/CuSO₄) was read.
pub(crate) fn rusts(mv: f64, error: f64) -> f64 {
    // Logistic and normal errors together, by their variances (π²/3 of the scale's square).
    let scale = 34.1_f64.hypot(error * 3f64.sqrt() / std::f64::consts::PI);
    (1.0 / (1.0 + ((mv + 275.0) / scale).exp())).clamp(0.05, 0.95)
}

/// Share of cracks along that rust has nothing to do with.
const OTHER_CAUSES: f64 = 0.1;

/// Likelihood of a crack along of width w where rust makes one of `rust` mm.
fn along(width: f64, error: f64, rust: f64) -> f64 {
    let spread = 0.5_f64.hypot(error / width.max(0.01));
    let z = (width.max(0.01) / rust.max(1e-6)).ln() / spread;
    let of_rust = (-0.5 * z * z).exp() / (spread * width.max(0.01) * 2.506_628);
    // Settling and shrinkage leave cracks of a few tenths.
    let of_others = (-width / 0.2).exp() / 0.2;
    half_at(rust, 0.15, 0.4) * of_rust + OTHER_CAUSES * of_others
}

/// A curve that rises from nothing to one about a width, mm; `spread` of its logarithm.
pub(crate) fn half_at(width: f64, half: f64, spread: f64) -> f64 {
    if width <= 0.0 { 0.0 } else { 1.0 / (1.0 + (half / width).powf(1.0 / spread)) }
}

/// Width of the crack that rust of a bar has driven into its cover, mm (Vidal, Castel and François
/// 2004, eqs. 3 and 5, for rust all around; Alonso et al. 1998 for the first crack).
pub(crate) fn crack_mm(draw: &Possible, bars: &Bars, age: f64) -> f64 {
    let (diameter, cover) = (1e3 * bars.diameter, 1e3 * (bars.cover + draw.other.cover).max(0.0));
    let first = 1e-3 * (7.53 + 9.32 * cover / diameter.max(1.0));
    let gone = |depth: f64| {
        let left = (1.0 - 2.0 * depth / diameter.max(1.0)).max(0.0);
        0.25 * std::f64::consts::PI * diameter * diameter * (1.0 - left * left)
    };
    (0.0575 * (gone(1e3 * draw.other.depth(bars.cover, age)) - gone(first))).max(0.0)
}

/// Weights from logarithms, raised to the largest power up to one at which enough of them count.
fn weights(logs: &[f64], priors: &[f64]) -> (Vec<f64>, f64) {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let at = |power: f64| {
        let raw: Vec<f64> =
            logs.iter().zip(priors).map(|(l, p)| (power * (l - most) + p).exp()).collect();
        let sum: f64 = raw.iter().sum();
        raw.into_iter().map(|w| w / sum).collect::<Vec<f64>>()
    };
    let number = |weights: &[f64]| 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    let whole = at(1.0);
    if number(&whole) >= LEAST {
        return (whole, 1.0);
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if number(&at(middle)) >= LEAST { low = middle } else { high = middle }
    }
    (at(low), low)
}

/// Mean and deviation of the share that is gone, and the probability that any bar rusts.
fn posterior(draws: &[Possible], weights: &[f64], bars: &[Bars], age: f64) -> (Estimate, f64) {
    let (mut sum, mut squares, mut active) = (0.0, 0.0, 0.0);
    for (draw, weight) in draws.iter().zip(weights) {
        let (share, any) = draw.other.lost(bars, age);
        sum += weight * share;
        squares += weight * share * share;
        active += if any { *weight } else { 0.0 };
    }
    (Estimate { value: sum, std_error: (squares - sum * sum).max(0.0).sqrt() }, active)
}
