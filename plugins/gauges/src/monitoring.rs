//! Gauges that are read over months and years: what neither temperature nor creep explains is
//! damage.
//!
//! A reading of strain is m(t) = c + α ΔT + (1 + κ) C(t) + Δ s(t) + noise. C is what the forecast
//! says of the sound member: creep, shrinkage, loads as they come. α is expansion less what the
//! gauge compensates. s(t) rises from 0 at the first reading to 1 at the last: evenly, evenly
//! between the first and the last fifth of the time, or at once at one of [`STEPS`] moments. c, α
//! (which has a prior) and Δ are found by least squares for each of these shapes, and shapes are
//! averaged by how well they fit (Bayesian model averaging, Hoeting et al. 1999). Creep that is off
//! by κ looks like slow drift, and no reading of one gauge tells them apart: κ is 0 ± [`CREEP`], and
//! its share of C is in the error of Δ. Concrete that is softened by d carries the same force with
//! strain ε/(1 − d): Δ = ε d/(1 − d), ε being the elastic part of what the forecast says.

use glam::{DMat3, DVec3};
use intrados_damage::{
    evidence::{Cause, Evidence},
    zone::{ZONES, Zones, zone_at},
};
use intrados_forecast::{Forecast, GaugeCourse};
use intrados_scene::{
    Scene,
    structure::{Date, Sample, Series},
};
use intrados_stage::{
    Estimate,
    time::{DAY, YEAR},
};
use serde::Serialize;
use serde_json::json;

/// The source name of evidence from monitoring.
pub const MONITORING: &str = "monitoring";

/// Fewest readings of a series, and over how many days.
const LEAST: usize = 8;
const SHORTEST: i64 = 30;
/// Strain that a gauge must bear for long to say anything (a gauge's own error of some millionths).
const LEAST_STRAIN: f64 = 5e-6;
/// Expansion of concrete less what a gauge compensates, 1/K, and its standard deviation: from
/// nothing (compensated for concrete) to all of it.
const EXPANSION: [f64; 2] = [5e-6, 5e-6];
/// Standard deviation of a forecast's creep and shrinkage, as a share (Bažant and Baweja 1995: 23 %
/// of creep, 34 % of shrinkage by the best models).
const CREEP: f64 = 0.3;
/// Moments at which what is not explained may have come at once.
const STEPS: usize = 19;
/// Standard deviation of the elastic strain that is foretold, as a share: loads 10 %, stiffness
/// 10 %.
const ELASTIC: f64 = 0.15;

/// What a series says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// Name of the gauge.
    pub gauge: String,
    /// Readings.
    pub samples: usize,
    /// Of the first.
    pub from: String,
    /// Of the last.
    pub to: String,
    /// From the first fifth of the time to the last, in the mean: what was read …
    pub read: f64,
    /// … of that by temperature …
    pub by_temperature: f64,
    /// … and by creep, shrinkage and loads.
    pub by_creep: f64,
    /// What neither explains, from the first reading to the last.
    pub left: Estimate,
    /// What the sound member bears there for long.
    pub elastic: f64,
    /// 1/K.
    pub per_kelvin: Estimate,
    /// What creep is of what was foretold.
    pub creep_factor: Estimate,
    /// Damage there.
    pub damage: Estimate,
}

/// What the series of a member's gauges say, and why others say nothing: their gauges, and why.
pub fn heard(
    scene: &Scene,
    index: usize,
    forecast: &Forecast,
) -> (Option<Evidence>, Vec<(String, String)>) {
    let structure = &scene.structure;
    let Some(member) = scene.members.get(index) else { return (None, Vec::new()) };
    let (mut zones, mut drifts, mut unused) = ([None; ZONES], Vec::new(), Vec::new());
    for series in &structure.series {
        let gauge = structure.gauges.iter().find(|g| g.name == series.gauge);
        let Some(gauge) = gauge.filter(|g| g.member == member.id) else { continue };
        match heard_of(scene, series, forecast) {
            Ok(drift) => {
                let zone: &mut Option<Estimate> = &mut zones[zone_at(f64::from(gauge.along))];
                // A zone is as damaged as its worst side.
                if zone.is_none_or(|known| known.value < drift.damage.value) {
                    *zone = Some(drift.damage);
                }
                drifts.push(drift);
            }
            Err(why) => unused.push((series.gauge.clone(), why)),
        }
    }
    (told(drifts, Zones(zones)), unused)
}

fn told(drifts: Vec<Drift>, zones: Zones) -> Option<Evidence> {
    let samples: usize = drifts.iter().map(|d| d.samples).sum();
    let lines: Vec<String> = drifts
        .iter()
        .map(|d| {
            let [left, error] = [d.left.value, d.left.std_error].map(|x| 1e6 * x);
            format!(
                "{}: {left:.0} ± {error:.0} µε since {} that neither temperature nor creep explains",
                d.gauge, d.from
            )
        })
        .collect();
    let basis = format!(
        "{samples} readings over the years; {}; says nothing beyond its zone",
        lines.join("; ")
    );
    let evidence = Evidence::new(MONITORING, true, [(Cause::Stiffness, zones)].into(), basis)?;
    let serde_json::Value::Object(details) = json!({ "series": drifts }) else { return None };
    Some(Evidence { details, ..evidence })
}

/// What a series is called in the ledger.
pub fn name(series: &Series) -> String {
    let ends = series.samples.first().zip(series.samples.last());
    let span = ends.map_or(String::new(), |(a, b)| format!(", {} to {}", a.date, b.date));
    format!("{} over the years{span} ({} readings)", series.gauge, series.samples.len())
}

/// Why a series says nothing, as far as the file tells; none where it may.
#[must_use]
pub fn refusal(scene: &Scene, series: &Series) -> Option<String> {
    let gauge = scene.structure.gauges.iter().find(|g| g.name == series.gauge)?;
    let is_strain = matches!(gauge.measures, intrados_scene::structure::Measures::Strain(_));
    (!is_strain).then(|| {
        "it measures no strain of its member: of displacement and stress a load test says more"
            .into()
    })
}

fn heard_of(scene: &Scene, series: &Series, forecast: &Forecast) -> Result<Drift, String> {
    if let Some(why) = refusal(scene, series) {
        return Err(why);
    }
    let course = forecast
        .gauges
        .iter()
        .find(|c| c.gauge == series.gauge)
        .ok_or("it lies on no part of its member that is computed")?;
    drift(series, course, forecast.age_years, scene.structure.today())
}

/// Takes temperature and creep out of a series of a member that is `age_years` old at the day
/// `now`.
///
/// # Errors
/// Why it says nothing: too few readings, too short, before the member was there, or hardly any
/// strain.
fn drift(
    series: &Series,
    course: &GaugeCourse,
    age_years: f64,
    now: Option<Date>,
) -> Result<Drift, String> {
    let samples = &series.samples;
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return Err("it has no readings".into());
    };
    let span = first.date.days_until(last.date);
    if samples.len() < LEAST || span < SHORTEST {
        return Err(format!(
            "{} readings over {span} days are too few to take temperature and creep out: it takes {LEAST} over {SHORTEST}",
            samples.len()
        ));
    }
    let now = now.unwrap_or(last.date);
    let age = |date: Date| YEAR / DAY * age_years - date.days_until(now) as f64;
    if age(first.date) < 0.0 {
        return Err(format!(
            "it was first read on {}, when the member was not there yet by its age of {age_years:.0} years: state its years",
            first.date
        ));
    }
    if course.elastic.abs() < LEAST_STRAIN {
        return Err(format!(
            "its place bears {:.1} µε for long, too little for damage to show",
            1e6 * course.elastic
        ));
    }
    let rows = rows(samples, course, age, span);
    let fit = DriftFit::of(&rows);
    let mean = |of: &dyn Fn(&Row) -> f64| {
        let by = |late: bool| {
            let own = rows.iter().filter(|r| if late { r.share >= 0.8 } else { r.share <= 0.2 });
            let (sum, n) = own.fold((0.0, 0.0), |(sum, n), r| (sum + of(r), n + 1.0));
            sum / f64::max(n, 1.0)
        };
        by(true) - by(false)
    };
    let crept =
        rows.iter().map(|r| r.creep).fold([0.0_f64; 2], |[low, high], c| [low.min(c), high.max(c)]);
    let of_creep = CREEP * (crept[1] - crept[0]);
    let left = Estimate { value: fit.drift.value, std_error: fit.drift.std_error.hypot(of_creep) };
    Ok(Drift {
        gauge: series.gauge.clone(),
        samples: samples.len(),
        from: first.date.to_string(),
        to: last.date.to_string(),
        read: mean(&|r| r.value),
        by_temperature: fit.per_kelvin.value * mean(&|r| r.warmth),
        by_creep: mean(&|r| r.creep),
        left,
        elastic: course.elastic,
        per_kelvin: fit.per_kelvin,
        creep_factor: Estimate { value: 1.0, std_error: CREEP },
        damage: damage(left, course.elastic),
    })
}

/// A reading and what explains it.
struct Row {
    value: f64,
    std_error: f64,
    /// Over the mean, K.
    warmth: f64,
    /// By the forecast, since the first reading.
    creep: f64,
    /// Share of the time that has passed, 0 to 1.
    share: f64,
}

fn rows(
    samples: &[Sample],
    course: &GaugeCourse,
    age: impl Fn(Date) -> f64,
    span: i64,
) -> Vec<Row> {
    let first = samples[0].date;
    let warm: Vec<f64> = samples.iter().filter_map(|s| s.temperature_c).collect();
    let mean = warm.iter().sum::<f64>() / (warm.len() as f64).max(1.0);
    let begun = course.at(age(first));
    samples
        .iter()
        .map(|s| {
            let share = first.days_until(s.date) as f64 / span as f64;
            Row {
                value: s.value,
                std_error: s.std_error,
                warmth: s.temperature_c.map_or(0.0, |t| t - mean),
                creep: course.at(age(s.date)) - begun,
                share,
            }
        })
        .collect()
}

/// How what is not explained has come.
#[derive(Debug, Clone, Copy)]
enum DriftShape {
    /// Evenly over all of the time.
    Line,
    /// Evenly between the first and the last fifth.
    Ramp,
    /// At once, after a share of the time.
    Step(f64),
}

impl DriftShape {
    /// All of them, each with its prior probability: as likely slowly as at once.
    fn all() -> impl Iterator<Item = (Self, f64)> {
        let step = |k: usize| (k as f64 + 1.0) / (STEPS as f64 + 1.0);
        let steps = (0..STEPS).map(move |k| (Self::Step(step(k)), 0.5 / STEPS as f64));
        [(Self::Line, 0.25), (Self::Ramp, 0.25)].into_iter().chain(steps)
    }

    /// What has come after a share of the time.
    fn at(self, share: f64) -> f64 {
        match self {
            Self::Line => share,
            Self::Ramp => ((share - 0.2) / 0.6).clamp(0.0, 1.0),
            Self::Step(moment) => f64::from(u8::from(share > moment)),
        }
    }
}

/// Units in which constant, expansion and drift are of order one.
const UNITS: DVec3 = DVec3::new(1e-4, EXPANSION[1], 1e-4);

/// The fit of one shape.
struct ShapeFit {
    matrix: DMat3,
    right: DVec3,
    /// Residuals over their standard errors.
    residuals: Vec<f64>,
    prior: f64,
}

impl ShapeFit {
    fn of(rows: &[Row], (shape, prior): (DriftShape, f64)) -> Self {
        let design = |r: &Row| DVec3::new(1.0, r.warmth, shape.at(r.share)) * UNITS / r.std_error;
        let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for row in rows {
            let design = design(row);
            for k in 0..3 {
                *matrix.col_mut(k) += design * design[k];
            }
            right += design * (row.value - row.creep) / row.std_error;
        }
        let mut fit = Self { matrix, right, residuals: Vec::new(), prior };
        let (at, _) = fit.solve(1.0);
        let residual = |r: &Row| (r.value - r.creep) / r.std_error - design(r).dot(at);
        fit.residuals = rows.iter().map(residual).collect();
        fit
    }

    /// Constant, expansion and drift, and their covariance, where noise has so many times the
    /// variance that was given.
    fn solve(&self, inflate: f64) -> (DVec3, DMat3) {
        let mut matrix = self.matrix * (1.0 / inflate);
        // The constant and the drift are free; the ridge only keeps the matrix regular.
        matrix.x_axis.x += 1e-12;
        matrix.y_axis.y += 1.0;
        matrix.z_axis.z += 1e-12;
        let inverse = matrix.inverse();
        let prior = DVec3::new(0.0, EXPANSION[0] / EXPANSION[1], 0.0);
        (inverse * (self.right / inflate + prior), inverse)
    }

    fn chi2(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }

    /// By how much noise is larger than was given: by the residuals' scatter, and by how alike
    /// neighbours are: of n readings of correlation ρ only n (1 − ρ)/(1 + ρ) count.
    fn inflation(&self) -> f64 {
        let chi2 = self.chi2();
        let scatter = (chi2 / (self.residuals.len() as f64 - 3.0).max(1.0)).max(1.0);
        let alike = self.residuals.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / chi2.max(1e-12);
        let alike = alike.clamp(0.0, 0.95);
        scatter * (1.0 + alike) / (1.0 - alike)
    }
}

/// What is not explained, and expansion, by all shapes together.
struct DriftFit {
    drift: Estimate,
    /// 1/K.
    per_kelvin: Estimate,
}

impl DriftFit {
    fn of(rows: &[Row]) -> Self {
        let fits: Vec<ShapeFit> = DriftShape::all().map(|s| ShapeFit::of(rows, s)).collect();
        let least = fits.iter().map(ShapeFit::chi2).fold(f64::INFINITY, f64::min);
        let best = fits.iter().min_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        let inflate = best.map_or(1.0, ShapeFit::inflation);
        let (mut whole, mut sums, mut squares) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for fit in &fits {
            let weight = fit.prior * (-0.5 * (fit.chi2() - least) / inflate).exp();
            let (at, covariance) = fit.solve(inflate);
            let variance = DVec3::from_array([0, 1, 2].map(|k| covariance.col(k)[k].max(0.0)));
            whole += weight;
            sums += weight * at;
            squares += weight * (variance + at * at);
        }
        let mean = sums / whole;
        let variance = squares / whole - mean * mean;
        let estimate = |k: usize| Estimate {
            value: mean[k] * UNITS[k],
            std_error: variance[k].max(0.0).sqrt() * UNITS[k],
        };
        Self { drift: estimate(2), per_kelvin: estimate(1) }
    }
}

/// Damage from a drift: mean and standard deviation of d = r/(1 + r) for r = Δ/ε ≥ 0, nothing below,
/// r being normal.
fn damage(left: Estimate, elastic: f64) -> Estimate {
    const STEPS: i32 = 64;
    let ratio = left.value / elastic;
    let spread = (left.std_error / elastic).hypot(ELASTIC * ratio);
    let (mut sum, mut squares, mut weight) = (0.0, 0.0, 0.0);
    for k in -STEPS..=STEPS {
        let z = 4.0 * f64::from(k) / f64::from(STEPS);
        let r = (ratio + z * spread).max(0.0);
        let (d, w) = (r / (1.0 + r), (-0.5 * z * z).exp());
        sum += w * d;
        squares += w * d * d;
        weight += w;
    }
    let mean = sum / weight;
    Estimate { value: mean, std_error: (squares / weight - mean * mean).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use intrados_stage::random::Key;

    use super::*;

    /// Strain of a column: −100 µε at once, and that and half again by creep.
    fn course() -> GaugeCourse {
        let days: Vec<f64> = (0..60).map(|k| 200.0 * f64::from(k)).collect();
        let creep = |d: f64| -1e-4 * (1.0 + 1.5 * (d / (d + 700.0)).powf(0.3));
        let strain = days.iter().map(|&d| creep(d)).collect();
        GaugeCourse { gauge: "G".into(), days, strain, elastic: -1e-4 }
    }

    /// Three years of weekly readings of that column at the age of ten, by a gauge of 3 µε that
    /// lags 2 µε behind, softened by `d` in the middle of the time.
    fn series(d: f64, key: Key, warm: bool) -> Series {
        let course = course();
        let begin: Date = "2021-01-04".parse().unwrap();
        let (creep, expansion) = (1.0 + 0.3 * key.normal(0), 5e-6 + 5e-6 * key.normal(1));
        let elastic = course.elastic * (1.0 + ELASTIC * key.normal(2));
        let mut lag = 0.0;
        let samples = (0..156_i32).map(|week| {
            let date = begin.plus_days(7 * i64::from(week));
            let day = 7.0 * 365.25 + 7.0 * f64::from(week);
            let season = (f64::from(week) / 52.0 * std::f64::consts::TAU).sin();
            let celsius = 10.0 - 9.0 * season + 3.0 * key.normal(10 + 4 * week as u32);
            lag = 0.7 * lag + 2e-6 * key.normal(11 + 4 * week as u32);
            let left = if week > 80 { elastic * d / (1.0 - d) } else { 0.0 };
            let value = creep * (course.at(day) - course.at(7.0 * 365.25))
                + expansion * (celsius - 10.0)
                + left
                + lag
                + 3e-6 * key.normal(12 + 4 * week as u32);
            Sample { date, value, std_error: 3e-6, temperature_c: warm.then_some(celsius) }
        });
        Series { gauge: "G".into(), samples: samples.collect() }
    }

    /// Two hundred plantings: intervals of 95 % hold 90 to 99 % of the time.
    #[test]
    fn intervals_hold_what_they_say() {
        let mut held = 0;
        for n in 0..200 {
            let key = Key::new(7, n);
            let truth = 0.6 * f64::from(key.unit(99_999));
            let found = drift(&series(truth, key, true), &course(), 10.0, None).unwrap().damage;
            held += u32::from((found.value - truth).abs() < 1.96 * found.std_error);
        }
        println!("{held} of 200 hold");
        assert!((180..=198).contains(&held), "{held}");
    }

    /// Weekly readings of a column of an age of ten years, by a gauge that errs by `noise`, with or
    /// without summers that it does not compensate.
    fn planted(
        drift: impl Fn(f64) -> f64,
        noise: f64,
        weeks: i32,
        summers: bool,
        seed: u64,
    ) -> Series {
        let course = course();
        let key = Key::new(seed, 0);
        let begin: Date = "2024-01-01".parse().unwrap();
        let start = 8.0 * 365.25;
        let samples = (0..weeks).map(|week| {
            let share = f64::from(week) / f64::from(weeks - 1);
            let season = (f64::from(week) / 52.0 * std::f64::consts::TAU).sin();
            let celsius = 10.0 - 9.0 * season + 3.0 * key.normal(4 * week as u32);
            let warm = if summers { 8e-6 * (celsius - 10.0) } else { 0.0 };
            let crept = course.at(start + 7.0 * f64::from(week)) - course.at(start);
            Sample {
                date: begin.plus_days(7 * i64::from(week)),
                value: crept + warm + drift(share) + noise * key.normal(4 * week as u32 + 2),
                std_error: noise,
                temperature_c: summers.then_some(celsius),
            }
        });
        Series { gauge: "G".into(), samples: samples.collect() }
    }

    /// What was planted comes back: nothing, drifts of several rates either way, steps early and
    /// late, by exact and poor gauges; and with an error that is fair.
    #[test]
    fn planted_drifts_come_back() {
        for noise in [1e-7, 1e-6, 5e-6, 2e-5] {
            for summers in [false, true] {
                for weeks in [30, 104, 260] {
                    let close = |name: String, total: f64, drift: &dyn Fn(f64) -> f64| {
                        let series = planted(drift, noise, weeks, summers, 9);
                        let now = series.samples.last().unwrap().date;
                        let age = 8.0 + f64::from(weeks) / 52.18;
                        let found = super::drift(&series, &course(), age, Some(now)).unwrap().left;
                        let Estimate { value, std_error } = found;
                        let place = format!("{name}, {noise}, {weeks}, {summers}: {found:?}");
                        assert!((value - total).abs() < 3.0 * std_error + 2e-6, "{place}");
                        let half_year = weeks < 52 && summers;
                        let fair = 6.0 * noise + 0.12 * total.abs() + 5e-6;
                        assert!(std_error < if half_year { 1e-4 } else { fair }, "{place}");
                        assert!(
                            (value - total).abs() < if half_year { 2e-4 } else { fair },
                            "{place}"
                        );
                    };
                    close("flat".into(), 0.0, &|_| 0.0);
                    for total in [-2e-4, -5e-5, 2e-5, 5e-5, 2e-4, 1e-3] {
                        close(format!("line of {total}"), total, &|share| total * share);
                        for moment in [0.2, 0.5, 0.83] {
                            close(format!("step of {total} at {moment}"), total, &|share| {
                                if share > moment { total } else { 0.0 }
                            });
                        }
                    }
                }
            }
        }
    }

    /// A sound column that creeps through three summers drifts by nothing; the raw readings would
    /// say otherwise.
    #[test]
    fn creep_and_summers_are_no_damage() {
        let quiet = Key::new(3, 5);
        let found = drift(&series(0.0, quiet, true), &course(), 10.0, None).unwrap();
        assert!(found.left.value.abs() < 3.0 * found.left.std_error, "{found:?}");
        assert!(found.damage.value < 0.1 && found.damage.std_error < 0.1, "{found:?}");
        // Without temperatures summers are noise: the error says so.
        let blind = drift(&series(0.0, quiet, false), &course(), 10.0, None).unwrap();
        assert!(blind.left.std_error > 2.0 * found.left.std_error, "{blind:?}");
    }

    #[test]
    fn what_says_nothing_says_why() {
        let whole = series(0.2, Key::new(1, 1), true);
        let few = Series { samples: whole.samples[..5].to_vec(), ..whole.clone() };
        assert!(drift(&few, &course(), 10.0, None).unwrap_err().contains("too few"));
        assert!(drift(&whole, &course(), 1.0, None).unwrap_err().contains("not there yet"));
        let idle = GaugeCourse { elastic: 1e-7, ..course() };
        assert!(drift(&whole, &idle, 10.0, None).unwrap_err().contains("too little"));
    }
}
