//! Readings that no damage explains, however modulus, loads and supports are turned within their
//! priors: why that may be.

use crate::GaugeReading;

/// How often chance makes χ² larger than what is still believed: once in a thousand, as a point of
/// the normal distribution.
pub(crate) const ONCE_IN_A_THOUSAND: f64 = 3.090_232;

/// A unit that somebody may have typed for another: how many times too large the numbers are, and
/// what they probably are.
const UNITS: [(f64, &str, &str); 5] = [
    (1e6, "1", "microstrain (µε)"),
    (1e3, "1", "millimetres per metre"),
    (1e2, "1", "per cent"),
    (1e3, "m", "millimetres"),
    (1e6, "m", "micrometres"),
];
/// How far from its unit's factor a median may lie: damage and modulus matter less.
const NEAR: f64 = 2.0;
/// A test whose load is off more than this, as a factor, is named.
const OFF: f64 = 1.15;
/// A gauge with this share of χ² is named.
const MOST: f64 = 0.8;

/// The likely reason, one clause for people. `readings`: of one member, `sound` being what it would
/// show without damage, and z its distance from the best fit.
#[must_use]
pub(crate) fn reason(readings: &[GaugeReading]) -> String {
    for unit in ["1", "m"] {
        let Some(times) = median(readings.iter().filter(|r| r.unit == unit)) else { continue };
        let quantity = if unit == "m" { "displacements" } else { "strains" };
        for (factor, of, what) in UNITS.into_iter().filter(|u| u.1 == unit) {
            let is_near = |ratio: f64| (1.0 / NEAR..NEAR).contains(&ratio);
            if is_near(times.abs() / factor) {
                let si = if of == "m" { "metres" } else { "m/m" };
                return format!(
                    "the unit: {quantity} are {times:.1e} times what is expected, as {what} are that were typed as {si}"
                );
            }
        }
        if times < -0.3 {
            return format!(
                "the sign: {quantity} are {times:.2} times what is expected; shortening is negative, and a reading is what the gauge shows under the load less what it showed before"
            );
        }
    }
    let mut tests: Vec<&str> = readings.iter().map(|r| r.test.as_str()).collect();
    tests.dedup();
    let of_test = |test: &str| {
        median(readings.iter().filter(|r| r.test == test)).map(|times| (times, test.to_owned()))
    };
    let ratios: Vec<(f64, String)> = tests.iter().filter_map(|test| of_test(test)).collect();
    let all = median(readings.iter()).unwrap_or(1.0);
    let is_off = |times: f64| times.abs() > OFF || times.abs() < 1.0 / OFF;
    let odd: Vec<&(f64, String)> = ratios.iter().filter(|r| is_off(r.0)).collect();
    if let [(times, test)] = odd[..]
        && ratios.len() > 1
    {
        return format!(
            "the load of test {test}, or its place: its readings are {times:.2} times what is expected"
        );
    }
    let chi2: f64 = readings.iter().map(|r| r.z * r.z).sum();
    let share = |gauge: &str| {
        readings.iter().filter(|r| r.gauge == gauge).map(|r| r.z * r.z).sum::<f64>() / chi2
    };
    let worst =
        readings.iter().map(|r| (share(&r.gauge), &r.gauge)).max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((share, gauge)) =
        worst.filter(|w| w.0 > MOST && readings.iter().any(|r| &r.gauge != w.1))
    {
        return format!(
            "the place of gauge {gauge} or its contact: it accounts for {:.0} % of the misfit",
            100.0 * share
        );
    }
    if is_off(all) {
        return format!(
            "modulus or loads: readings are {all:.2} times what is expected; a measured modulus of elasticity of the concrete would tell"
        );
    }
    "supports that are not as described, cracks that open under the load, or damage in more than two places".into()
}

/// Median of what was read over what a sound member shows, of the readings that show most.
fn median<'a>(readings: impl Iterator<Item = &'a GaugeReading>) -> Option<f64> {
    let all: Vec<&GaugeReading> = readings.collect();
    let most = all.iter().map(|r| r.sound.abs()).fold(0.0, f64::max);
    let mut ratios: Vec<f64> = all
        .iter()
        .filter(|r| r.sound.abs() > 0.3 * most && r.sound != 0.0)
        .map(|r| r.read / r.sound)
        .collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(
        gauge: &str,
        test: &str,
        unit: &'static str,
        sound: f64,
        read: f64,
        z: f64,
    ) -> GaugeReading {
        GaugeReading {
            gauge: gauge.into(),
            test: test.into(),
            unit: unit.into(),
            read,
            std_error: 1e-6,
            sound,
            damaged: sound,
            z,
        }
    }

    #[test]
    fn likely_reasons_are_named() {
        let of = |times: [f64; 4], unit| {
            let sound = [-3e-5, -4e-5, -3e-5, -4e-5];
            let z = |k: usize| 50.0 * (times[k] - 1.0);
            (0..4)
                .map(|k| {
                    read(
                        ["a", "b"][k % 2],
                        ["t", "u"][k / 2],
                        unit,
                        sound[k],
                        times[k] * sound[k],
                        z(k),
                    )
                })
                .collect::<Vec<_>>()
        };
        for (times, unit, named) in [
            ([1.1e6, 1e6, 0.8e6, 1e6], "1", "microstrain"),
            ([1e3, 1e3, 900.0, 1e3], "m", "millimetres"),
            ([-1.0, -1.0, -0.9, -1.1], "1", "the sign"),
            ([1.0, 1.0, 1.5, 1.5], "1", "load of test u"),
            ([1.0, 3.0, 1.0, 3.0], "1", "gauge b"),
            ([1.9, 2.0, 1.9, 2.0], "1", "modulus or loads"),
        ] {
            let why = reason(&of(times, unit));
            assert!(why.contains(named), "{times:?}: {why}");
        }
    }
}
