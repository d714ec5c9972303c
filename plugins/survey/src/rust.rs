//! Rust of bars, by everything that speaks of it: the likelihood of each reading for each of the
//! things that the exposure class leaves open (`intrados_mechanics::material::durability`).
//!
//! | reading | likelihood | source |
//! |---|---|---|
//! | cover, carbonation, chloride | none: they move what may be, see [`crate::measured`] | ours |
//! | half-cell | 1/(1 + exp((E + 275 mV)/34.1 mV)) of rust: 10 % at −200, 90 % at −350 mV, never nearer to sure than 5 % | ASTM C876, appendix; logistic between, ours |
//! | crack along | lognormal (.7) about w = .0575 mm⁻¹ (ΔA − ΔA₀), ΔA₀ at (7.53 + 9.32 c/φ) µm; one in ten has other causes, about .15 mm; wider than the model opens any of the bars' cracks counts as the widest of these | Vidal et al. 2004, Alonso et al. 1998; shares and spread ours |
//! | intact | no crack that an eye finds: half of them at .15 mm; by a photograph, on the share of the surface that it shows, at the width that it could have shown | ours |
//! | hollow | half of what is cracked to .4 mm | ours |
//! | spall | half of what is cracked to 1 mm, the width taken as spalling | Vu, Stewart and Mullard 2005; curve ours |
//! | rust stains | half of what is cracked to .2 mm, fewer without cracks | ours |
//! | efflorescence, wet spot | 1.5 times as often over bars that rust | ours |
//!
//! No class knows of a leaking joint or of salt that somebody spilt: of all that may be, one in
//! twenty (`UNFORESEEN`) rusts since any day of its life, as with salt, whatever its cover (ours).
//! Without that, no reading could speak against a class that lets nothing rust.
//!
//! Readings of one kind in one zone err together by their model: of n of them each counts 1/n. Only
//! of covers each speaks for itself.
//!
//! **Cost.** Readings are gathered by the zones that they lie in. Half-cell potentials are summed by
//! their dates, exactly; of findings of one kind in one place equal ones count as one, and of more
//! than [`MOST_SIGHTS`] different ones neighbours by size are pooled (approximate from there on).
//! Work grows with the number of readings, and every step asks whether it is cancelled.

use std::{collections::BTreeMap, sync::Arc};

use intrados_damage::{
    evidence::Cause,
    grading::Profile,
    zone::{ZONES, Zones},
};
use intrados_mechanics::material::durability::{Attack, Bars, Corrosion};
use intrados_scene::structure::{Course, Date, Observation, Shows};
use intrados_stage::{Cancelled, Estimate, Job, time::YEAR};
use serde_json::json;

use crate::{
    cell::{ReadingCell, bars_of_cell, gather_cells},
    measured::MeasuredState,
    site::{FORECAST_YEARS, HEARD, Placed, Site},
};

pub(crate) use crate::possible::{Possible, possible};

/// Things that may be; the posterior of three readings that agree still rests on hundreds.
pub(crate) const DRAWS: usize = 8192;
/// So many of them the posterior must rest on (Kish's effective number); else all readings count by
/// a smaller power.
const LEAST: f64 = 50.0;
/// Different findings of one kind in one place; of more, neighbours are pooled.
const MOST_SIGHTS: usize = 64;
/// Dates that the course of rust is told for.
const MOST_DATES: usize = 24;

/// Whether it says anything of rust.
pub(crate) fn speaks(shows: &Shows) -> bool {
    !matches!(shows, Shows::Rebound { .. } | Shows::Velocity { .. } | Shows::CoreStrength { .. })
        && !matches!(shows, Shows::Crack { course, .. } if *course != Course::Along)
}

/// What may be in a zone, weighed.
struct ZonePosterior {
    draws: Arc<Vec<Possible>>,
    /// They sum to one.
    weights: Vec<f64>,
    /// The share of bars' section that is gone.
    lost: Estimate,
    /// The probability that any rusts.
    active: f64,
}

/// All that may be, weighed.
pub(crate) struct Weighed {
    /// None where nothing is heard.
    found: [Option<ZonePosterior>; ZONES],
    /// The smallest power that all readings of a zone had to be raised to.
    power: f64,
    /// Readings far from what was expected, for people.
    surprises: Vec<String>,
}

impl Weighed {
    /// Of the readings of a member; those that cannot be weighed become `unused`.
    ///
    /// # Errors
    /// The job was cancelled.
    pub(crate) fn new(
        site: &Site,
        placed: &[Placed],
        profile: &Profile,
        unused: &mut BTreeMap<usize, String>,
        job: &Job,
    ) -> Result<Self, Cancelled> {
        let mut weighed =
            Self { found: [const { None }; ZONES], power: 1.0, surprises: Vec::new() };
        let Ok(corrosion) = &site.corrosion else {
            let why = site.corrosion.as_ref().err().map_or("", String::as_str);
            for p in placed.iter().filter(|p| speaks(p.shows) && only_of_rust(p.shows)) {
                unused.insert(p.number, format!("it speaks of rust, and {why}"));
            }
            return Ok(weighed);
        };
        let mut heard: Vec<&Placed> = placed.iter().filter(|p| speaks(p.shows)).collect();
        heard.retain(|p| match deaf(site, corrosion, p) {
            None => true,
            Some(_) if !only_of_rust(p.shows) => false,
            Some(why) => {
                unused.insert(p.number, why);
                false
            }
        });
        if heard.is_empty() {
            return Ok(weighed);
        }
        let draws = Arc::new(possible(corrosion, DRAWS, site.age));
        let cells = gather_cells(&heard);
        let measured = MeasuredState::new(site, corrosion, &draws, &cells);
        let gathered: Vec<GatheredCell> =
            cells.iter().filter_map(|cell| GatheredCell::of(site, cell)).collect();
        let reach = profile.fusion.correlation_m.get(&Cause::Steel).copied().unwrap_or(1.0);
        for zone in 0..ZONES {
            // Of many alike in one place each counts less, and all of them as one.
            let loudest = cells.iter().map(|cell| site.heard(cell.zones, zone, reach));
            if loudest.fold(0.0, f64::max) < HEARD || site.bars[zone].is_empty() {
                continue;
            }
            let own = match measured.moved(site, zone, reach, &draws, job)? {
                Some(moved) => Arc::new(moved),
                None => Arc::clone(&draws),
            };
            let priors: Vec<f64> = own.iter().map(|draw| draw.prior).collect();
            let weights_of = |cracks: CracksAs| -> Result<(Vec<f64>, f64), Cancelled> {
                let mut logs = vec![0.0; own.len()];
                for cell in &gathered {
                    let power = site.heard(cell.zones, zone, reach);
                    cell.add(&own, power, cracks, &mut logs, job)?;
                }
                Ok(weights(&logs, &priors))
            };
            let (weights, power) = weights_of(CracksAs::Read)?;
            weighed.power = weighed.power.min(power);
            let (mut lost, active) = posterior(&own, &weights, &site.bars[zone], site.age);
            if gathered.iter().any(GatheredCell::has_cracks) {
                // A somewhat wider crack speaks for some rust against much of it, which other causes
                // may have opened: it must not say that less is lost than a hairline does.
                let (weights, _) = weights_of(CracksAs::Hairlines)?;
                let (least, _) = posterior(&own, &weights, &site.bars[zone], site.age);
                if least.value > lost.value {
                    lost = least;
                }
            }
            weighed.found[zone] = Some(ZonePosterior { draws: own, weights, lost, active });
        }
        weighed.surprises = measured.surprises;
        Ok(weighed)
    }

    /// Share of the bars' section that is gone, by zone.
    pub(crate) fn zones(&self) -> Option<(Cause, Zones)> {
        let zones = Zones(self.found.each_ref().map(|found| found.as_ref().map(|f| f.lost)));
        zones.worst().map(|_| (Cause::Steel, zones))
    }

    /// The zone where bars most probably rust, and how probably.
    pub(crate) fn worst(&self) -> Option<(usize, f64)> {
        let known =
            self.found.iter().enumerate().filter_map(|(z, f)| Some((z, f.as_ref()?.active)));
        known.reduce(|worst, next| if next.1 > worst.1 { next } else { worst })
    }

    /// Readings far from what was expected, for people.
    pub(crate) fn surprises(&self) -> &[String] {
        &self.surprises
    }

    /// The power that readings count by where they contradict all that the class leaves open.
    pub(crate) fn tempered(&self) -> Option<f64> {
        (self.power < 0.5).then_some(self.power)
    }

    /// Share that is gone in the worst zone at some age, s.
    fn at(&self, site: &Site, age: f64) -> Option<Estimate> {
        let zones = self.found.iter().zip(&site.bars).filter_map(|(found, bars)| {
            let found = found.as_ref()?;
            Some(posterior(&found.draws, &found.weights, bars, age).0)
        });
        zones.reduce(|worst, next| if next.value > worst.value { next } else { worst })
    }

    /// The course of rust over the dates of the observations and on, for scripts and plots; of
    /// very many dates some.
    pub(crate) fn details(
        &self,
        site: &Site,
        all: &[(usize, &Observation)],
        job: &Job,
    ) -> Result<serde_json::Value, Cancelled> {
        let mut dates: Vec<Date> = all.iter().filter_map(|(_, o)| o.date).collect();
        dates.sort_unstable();
        dates.dedup();
        let last = dates.last().copied();
        let point = |date: Option<String>, age: f64| {
            job.check()?;
            Ok(self.at(site, age).map(|lost| {
                json!({
                    "date": date, "age_years": age / YEAR,
                    "steel_lost": lost.value, "std_error": lost.std_error,
                })
            }))
        };
        let mut course = Vec::new();
        for date in some_of(&dates) {
            let Some(last) = last else { break };
            let before = date.days_until(last) as f64 * intrados_stage::time::DAY;
            course.extend(point(Some(date.to_string()), site.age - before)?);
        }
        if last.is_none() {
            course.extend(point(None, site.age)?);
        }
        course.extend(point(None, site.age + FORECAST_YEARS * YEAR)?);
        let active = self.found.each_ref().map(|found| found.as_ref().map(|f| f.active));
        Ok(json!({ "probability_active": active, "power": self.power, "course": course }))
    }
}

/// The first and the last date, and of many some between them.
fn some_of(dates: &[Date]) -> impl Iterator<Item = &Date> {
    let count = dates.len().min(MOST_DATES);
    (0..count).map(move |k| &dates[k * (dates.len() - 1) / (count - 1).max(1)])
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
        _ if bars_of_cell(site, placed.zones).is_none() => {
            Some("no bars are known there: add them to the member's reinforcement".into())
        }
        _ => None,
    }
}

/// Half-cell potentials of a place by the age at which they were read.
#[derive(Default)]
struct HalfCells {
    /// Rising.
    ages: Vec<f64>,
    /// Of the readings before each, and after the last: sums of the logarithms of what they say of
    /// bars that do not rust yet …
    passive: Vec<f64>,
    /// … and of bars that rust.
    active: Vec<f64>,
}

impl HalfCells {
    fn of(mut readings: Vec<[f64; 2]>) -> Self {
        readings.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let sums = |log: fn(f64) -> f64| {
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            sums.extend(readings.iter().map(|[_, rusts]| {
                sum += log(*rusts);
                sum
            }));
            sums
        };
        let (passive, active) = (sums(|rusts| (1.0 - rusts).ln()), sums(f64::ln));
        Self { ages: readings.iter().map(|r| r[0]).collect(), passive, active }
    }

    /// Logarithm of the likelihood of all of them where rust began at an age.
    fn log(&self, begun: f64) -> f64 {
        let k = self.ages.partition_point(|age| *age <= begun);
        self.passive[k] + self.active[self.active.len() - 1] - self.active[k]
    }
}

/// How cracks along bars count.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CracksAs {
    /// As wide as they were read.
    Read,
    /// As the finest that can be read.
    Hairlines,
}

/// The finest crack that can be read, mm.
const HAIRLINE: f64 = 0.01;

/// A finding, or several that are alike.
struct Sight {
    shows: Shows,
    /// Of the attack then, s.
    age: f64,
    /// How much of all of its kind in its place.
    share: f64,
}

/// What is weighed of one place.
struct GatheredCell {
    zones: [usize; 2],
    bars: Bars,
    half_cells: HalfCells,
    /// By age.
    sights: Vec<Sight>,
}

/// What errs together in one place: readings of one kind; what is intact at one face says nothing
/// of another.
fn kind_of(p: &Placed) -> (&'static str, Option<u8>) {
    match p.shows {
        Shows::Intact { .. } => (p.shows.kind(), p.face),
        _ => (p.shows.kind(), None),
    }
}

impl GatheredCell {
    fn of(site: &Site, cell: &ReadingCell) -> Option<Self> {
        let (bars, _) = bars_of_cell(site, cell.zones)?;
        let mut potentials = Vec::new();
        let mut kinds: BTreeMap<(&str, Option<u8>), Vec<Sight>> = BTreeMap::new();
        for p in &cell.readings {
            let age = site.age_at(p);
            let shows = match *p.shows {
                Shows::HalfCell { mv, std_error_mv, .. } => {
                    potentials.push([age, rusts(mv, std_error_mv)]);
                    continue;
                }
                Shows::Cover { .. } | Shows::Carbonation { .. } | Shows::Chloride { .. } => {
                    continue;
                }
                Shows::Intact { seen, limit_mm } => {
                    Shows::Intact { seen: seen * p.around(), limit_mm }
                }
                ref other => other.clone(),
            };
            kinds.entry(kind_of(p)).or_default().push(Sight { shows, age, share: 1.0 });
        }
        let mut sights: Vec<Sight> = kinds.into_values().flat_map(pooled).collect();
        sights.sort_by(|a, b| a.age.total_cmp(&b.age));
        Some(Self { zones: cell.zones, bars, half_cells: HalfCells::of(potentials), sights })
    }

    fn has_cracks(&self) -> bool {
        self.sights.iter().any(|sight| matches!(sight.shows, Shows::Crack { .. }))
    }

    /// Adds what its readings say of each state, heard with some power.
    fn add(
        &self,
        draws: &[Possible],
        power: f64,
        cracks: CracksAs,
        logs: &mut [f64],
        job: &Job,
    ) -> Result<(), Cancelled> {
        job.check()?;
        let cover = self.bars.cover;
        let count = self.half_cells.ages.len() as f64;
        if count > 0.0 {
            for (log, draw) in logs.iter_mut().zip(draws) {
                *log += power / count * self.half_cells.log(draw.other.initiation(cover));
            }
        }
        for sights in self.sights.chunk_by(|a, b| a.age.total_cmp(&b.age).is_eq()) {
            let Some(age) = sights.first().map(|sight| sight.age) else { continue };
            let states: Vec<(f64, bool)> = draws
                .iter()
                .map(|d| (crack_mm(d, &self.bars, age), d.other.is_active(cover, age)))
                .collect();
            let widest = widest_explained(&states);
            for sight in sights {
                job.check()?;
                let likelihood = likelihood_of(&sight.shows, cracks, widest);
                for (log, (width, active)) in logs.iter_mut().zip(&states) {
                    *log += power * sight.share * likelihood(*width, *active).max(1e-300).ln();
                }
            }
        }
        Ok(())
    }
}

/// Findings of one kind in one place: equal ones as one, and of too many neighbours by size as one.
/// Their shares sum to one.
fn pooled(mut sights: Vec<Sight>) -> Vec<Sight> {
    let count = sights.len().max(1) as f64;
    sights.sort_by(|a, b| size(&a.shows).total_cmp(&size(&b.shows)).then(a.age.total_cmp(&b.age)));
    let mut some: Vec<Sight> = Vec::new();
    for sight in sights {
        match some.last_mut() {
            Some(last) if last.shows == sight.shows && last.age == sight.age => last.share += 1.0,
            _ => some.push(sight),
        }
    }
    let each = some.len().div_ceil(MOST_SIGHTS).max(1);
    let mut pooled: Vec<Sight> = Vec::new();
    let mut rest = some.into_iter().peekable();
    while rest.peek().is_some() {
        let group: Vec<Sight> = rest.by_ref().take(each).collect();
        let share = group.iter().map(|sight| sight.share).sum::<f64>() / count;
        let middle = group.len() / 2;
        pooled.extend(group.into_iter().nth(middle).map(|sight| Sight { share, ..sight }));
    }
    pooled
}

/// What findings of one kind are sorted by.
fn size(shows: &Shows) -> f64 {
    match *shows {
        Shows::Crack { width_mm, .. } => width_mm,
        Shows::Intact { seen, .. } => -seen,
        Shows::Sounding { hollow_m2, .. } => f64::from(u8::from(hollow_m2 > 0.0)),
        Shows::Spall { bars_bare, .. } => f64::from(u8::from(bars_bare)),
        _ => 0.0,
    }
}

/// The widest crack that enough states open, mm: what is read beyond that speaks for these.
fn widest_explained(states: &[(f64, bool)]) -> f64 {
    let mut widths: Vec<f64> = states.iter().map(|s| s.0).filter(|w| *w > 0.0).collect();
    widths.sort_by(f64::total_cmp);
    let enough = 2 * LEAST as usize;
    widths.len().checked_sub(enough).map_or(0.0, |k| widths[k]).max(OTHER_WIDTH)
}

/// The likelihood of a finding where rust has opened a crack of a width (mm), and where bars rust.
fn likelihood_of(shows: &Shows, cracks: CracksAs, widest: f64) -> Box<dyn Fn(f64, bool) -> f64> {
    match *shows {
        Shows::Crack { width_mm, std_error_mm, .. } => {
            let crack = CrackReading::new(width_mm, std_error_mm, widest);
            let crack = match cracks {
                CracksAs::Read => crack,
                CracksAs::Hairlines => CrackReading { width: HAIRLINE, spread: WIDTH_SPREAD },
            };
            Box::new(move |width, _| crack.likelihood(width))
        }
        Shows::Intact { seen, limit_mm } => Box::new(move |width, _| {
            (1.0 - seen * half_at(width, limit_mm, 0.4)) * (1.0 - seen * OTHER_CAUSES)
        }),
        Shows::Sounding { hollow_m2, .. } => Box::new(move |width, _| {
            let hollow = 0.03 + 0.94 * half_at(width, 0.4, 0.5);
            // A hollow spot is one reading, however small beside what was tapped.
            if hollow_m2 > 0.0 { hollow } else { 1.0 - hollow }
        }),
        Shows::Spall { bars_bare, .. } => {
            let background = if bars_bare { 0.01 } else { 0.03 };
            Box::new(move |width, _| background + 0.9 * half_at(width, 1.0, 0.4))
        }
        Shows::Rust { .. } => Box::new(|width, active| {
            0.03 + 0.15 * f64::from(u8::from(active)) + 0.6 * half_at(width, 0.2, 0.5)
        }),
        Shows::Efflorescence { .. } | Shows::WetSpot { .. } => {
            Box::new(|_, active| if active { 0.3 } else { 0.2 })
        }
        _ => Box::new(|_, _| 1.0),
    }
}

/// Probability of rust where a potential (mV against Cu/CuSO₄) was read.
pub(crate) fn rusts(mv: f64, error: f64) -> f64 {
    // Logistic and normal errors together, by their variances (π²/3 of the scale's square).
    let scale = 34.1_f64.hypot(error * 3f64.sqrt() / std::f64::consts::PI);
    (1.0 / (1.0 + ((mv + 275.0) / scale).exp())).clamp(0.05, 0.95)
}

/// Share of cracks along that rust has nothing to do with: settling and shrinkage leave some of a
/// few tenths, mm.
const OTHER_CAUSES: f64 = 0.1;
const OTHER_WIDTH: f64 = 0.15;
/// Deviation of the logarithm of a crack's width about what rust or another cause opens. One for
/// both: the wider a crack, the less another cause explains it, at every width.
const WIDTH_SPREAD: f64 = 0.7;

/// Width to which the error of a reading is relative at least, mm: relative to a fine crack it would
/// make it say nothing, and a somewhat wider one speak for other causes.
const ERROR_WIDTH: f64 = 1.0;

/// A crack along bars, as it was read.
struct CrackReading {
    /// mm.
    width: f64,
    /// Deviation of the logarithm of a width, by what opens cracks and by the reading.
    spread: f64,
}

impl CrackReading {
    /// `widest`: what is read beyond that speaks for no more.
    fn new(width: f64, error: f64, widest: f64) -> Self {
        let spread = WIDTH_SPREAD.hypot(error / width.max(ERROR_WIDTH));
        Self { width: width.clamp(HAIRLINE, widest.max(HAIRLINE)), spread }
    }

    /// Where rust has opened a crack of `rust` mm.
    fn likelihood(&self, rust: f64) -> f64 {
        let density = |about: f64| {
            let z = (self.width / about).ln() / self.spread;
            (-0.5 * z * z).exp() / (self.spread * self.width * 2.506_628)
        };
        let of_rust = half_at(rust, 0.15, 0.4) * density(rust.max(OTHER_WIDTH));
        of_rust + OTHER_CAUSES * density(OTHER_WIDTH)
    }
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
