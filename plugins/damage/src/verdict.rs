//! What state a member is in, as far as its error bar lets anybody say.
//!
//! What is known of a damage is m ± s, and that it lies between 0 and 1. With every damage alike
//! likely beforehand and an error of Gauss that is a normal distribution about m, truncated to
//! \[0, 1\]; of a crack's width likewise, truncated at 0. A state holds from a damage on *or* from
//! a crack width on, and the two are taken as if they knew nothing of each other: P(at least) = 1 −
//! (1 − P(d ≥ from)) Π (1 − P(w ≥ width)). A state is named when it is as likely as [`NAMED`]; else
//! the smallest run of neighbours that is.
//!
//! What follows from that: nothing unknown is called sound, and nothing unknown is called poor.
//! Where nothing was found and the best estimate is sound, the error bar is wide because nobody has
//! looked enough, and what is to be done is to look.

use intrados_stage::Estimate;
use std::collections::BTreeMap;

use serde::Serialize;
use statrs::function::erf::erfc;

use crate::{
    evidence::Evidence,
    grading::{NO_EVIDENCE, Profile, State},
    zone::ZONES,
};

/// Probability from which a state, or a run of neighbouring states, is named.
pub const NAMED: f64 = 0.8;
/// Probability of being severe from which scores take a member as called severe, named or not.
pub(crate) const CALLED: f64 = 0.5;

/// What a statement rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Something was measured there.
    Measured,
    /// Nothing was: a forecast alone.
    Forecast,
    /// Nothing is known.
    #[default]
    None,
}

impl Basis {
    /// Its name, as in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Forecast => "forecast",
            Self::None => "none",
        }
    }

    /// What a member's evidence is by zone.
    #[must_use]
    pub fn by_zone(evidence: &[&Evidence]) -> [Self; ZONES] {
        let speaks = |e: &Evidence, zone: usize| e.zones.values().any(|z| z.0[zone].is_some());
        std::array::from_fn(|zone| {
            let measured = evidence.iter().filter(|e| speaks(e, zone)).map(|e| e.measured);
            measured.reduce(|a, b| a || b).map_or(Self::None, |measured| {
                if measured { Self::Measured } else { Self::Forecast }
            })
        })
    }

    /// Of a whole member: measured where anything is.
    #[must_use]
    pub fn of(zones: &[Self; ZONES]) -> Self {
        [Self::Measured, Self::Forecast]
            .into_iter()
            .find(|basis| zones.contains(basis))
            .unwrap_or_default()
    }
}

/// How far somebody has looked at a member.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looked {
    /// Whether anything was found to be wrong with it.
    pub found: bool,
    /// Share of its length that nobody has measured or seen, 0 to 1.
    pub unseen: f64,
}

impl Looked {
    /// Nobody has looked at anything.
    pub const NOWHERE: Self = Self { found: false, unseen: 1.0 };

    /// By what is said of a member: a place counts as looked at where somebody measured or saw it,
    /// and not where the word of another place reaches. A crack that was measured was found, and so
    /// was a damage that the profile does not call sound, and a defect that somebody has listed.
    #[must_use]
    pub fn of(profile: &Profile, evidence: &[&Evidence], is_listed: bool) -> Self {
        let measured = || evidence.iter().filter(|e| e.measured);
        let own = |e: &Evidence, zone: usize| {
            e.zones.iter().any(|(cause, zones)| {
                let stands = e.stands.get(cause).map(|s| s[zone]);
                zones.0[zone].is_some() && stands.is_none_or(|s| s.prior.is_none())
            })
        };
        let is_unseen = |&zone: &usize| !measured().any(|e| own(e, zone));
        let unseen = (0..ZONES).filter(is_unseen).count();
        let damaged = |e: &Evidence| {
            let zones = e.by_zone().0;
            zones.iter().flatten().any(|d| d.value >= profile.damaged_from())
        };
        let found = |e: &Evidence| e.crack_width_mm.is_some_and(|w| w > 0.0) || damaged(e);
        let found = is_listed || measured().any(|e| found(e));
        Self { found, unseen: unseen as f64 / ZONES as f64 }
    }
}

/// What can be said of a member's state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// In words: a state, or *between* two, after *forecast:* where nothing was measured; or
    /// [`NO_EVIDENCE`].
    pub state: String,
    /// Probability of each state.
    pub probability: BTreeMap<String, f64>,
    /// The best and the worst of the states that it may be in, from 0; none without evidence.
    pub run: Option<[usize; 2]>,
    /// What it rests on.
    pub basis: Basis,
    /// What to do.
    pub advice: String,
    /// Within how many months: the inspection's own time where one is all that is to be done, else
    /// by the worst state that it may be in.
    pub within_months: Option<u32>,
    /// Whether an inspection is all that is to be done: nothing was found, what is most probable is
    /// sound, and the error bar is wide because nobody has looked enough.
    pub to_inspect: bool,
}

impl Verdict {
    /// Of a damage and the widest cracks that each source knows of (mm); `None` of the damage:
    /// nothing is known.
    #[must_use]
    pub fn of(
        profile: &Profile,
        damage: Option<Estimate>,
        cracks: &[Estimate],
        basis: Basis,
        looked: Looked,
    ) -> Self {
        let Some(damage) = damage.filter(|_| basis != Basis::None) else {
            return Self {
                state: NO_EVIDENCE.into(),
                probability: BTreeMap::new(),
                run: None,
                basis: Basis::None,
                advice: String::new(),
                within_months: None,
                to_inspect: false,
            };
        };
        let likely = probabilities(&profile.states, damage, cracks);
        let [best, worst] = run(&likely);
        let widest = cracks.iter().map(|w| w.value).fold(0.0, f64::max);
        let is_settled = basis == Basis::Measured && best == worst;
        let is_probably_sound = profile.state(damage.value, widest) == profile.states.first();
        let to_inspect = is_probably_sound && !looked.found && !is_settled;
        let name = |k: usize| profile.states[k].name.as_str();
        let said = if best == worst {
            name(best).to_owned()
        } else {
            format!("between {} and {}", name(best), name(worst))
        };
        Self {
            state: if basis == Basis::Forecast { format!("forecast: {said}") } else { said },
            probability: profile
                .states
                .iter()
                .zip(&likely)
                .map(|(s, &p)| (s.name.clone(), p))
                .collect(),
            run: Some([best, worst]),
            basis,
            advice: if to_inspect {
                inspection(basis, looked)
            } else {
                advice(profile, [best, worst], basis)
            },
            within_months: if to_inspect {
                profile.inspect_within_months
            } else {
                profile.states[worst].within_months
            },
            to_inspect,
        }
    }

    /// Whether one state is named that something measured stands behind.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn is_settled(&self) -> bool {
        self.basis == Basis::Measured && self.run.is_some_and(|[best, worst]| best == worst)
    }
}

/// Where nothing was found and what is most probable is sound: what is not known is no damage, and
/// calls for eyes, not for repair.
fn inspection(basis: Basis, looked: Looked) -> String {
    let percent = (100.0 * looked.unseen).round();
    if basis == Basis::Forecast {
        "Inspect: nobody has looked at it yet, and the forecast expects no damage.".into()
    } else if percent > 0.0 {
        format!("Inspect: nothing was found, but {percent} % of the length has not been looked at.")
    } else {
        "Inspect: nothing was found, but what has been looked at so far does not rule damage out."
            .into()
    }
}

/// That of the state where it is settled; else to look, and until then to do what the worst of what
/// may be asks for.
fn advice(profile: &Profile, [best, worst]: [usize; 2], basis: Basis) -> String {
    let state = &profile.states[worst];
    if best == worst && basis == Basis::Measured {
        return state.advice.clone();
    }
    let look = match basis {
        Basis::Measured => {
            "Inspect more closely: the findings so far leave its state open; more cores or gauges would settle it."
        }
        _ => {
            "Inspect: nothing was measured on it, and the forecast expects damage; an inspection, cores or gauges under a load test would show."
        }
    };
    if worst == 0 {
        look.to_owned()
    } else {
        let mut todo = state.advice.chars();
        let first = todo.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
        format!("{look} Until then, treat it as {}: {first}{}", state.name, todo.as_str())
    }
}

/// Probability of each state.
fn probabilities(states: &[State], damage: Estimate, cracks: &[Estimate]) -> Vec<f64> {
    let at_least = |k: usize| {
        if k == 0 {
            return 1.0;
        }
        let width = states[k..].iter().filter_map(|s| s.crack_width_mm).reduce(f64::min);
        let narrower = width.map_or(1.0, |width| {
            cracks.iter().map(|&w| 1.0 - beyond(w, width, f64::INFINITY)).product()
        });
        states.get(k).map_or(0.0, |s| 1.0 - (1.0 - beyond(damage, s.from, 1.0)) * narrower)
    };
    (0..states.len()).map(|k| (at_least(k) - at_least(k + 1)).max(0.0)).collect()
}

/// The shortest run of neighbours that is likely enough, the likeliest of equally long ones.
fn run(likely: &[f64]) -> [usize; 2] {
    let sum = |first: usize, length: usize| likely[first..first + length].iter().sum::<f64>();
    let longest = |length: usize| {
        let firsts = 0..=likely.len() - length;
        firsts.reduce(|a, b| if sum(b, length) > sum(a, length) { b } else { a }).unwrap_or(0)
    };
    let found = (1..=likely.len())
        .map(|length| (longest(length), length))
        .find(|&(first, length)| sum(first, length) >= NAMED);
    found.map_or([0, likely.len().saturating_sub(1)], |(first, length)| [first, first + length - 1])
}

/// P(x ≥ from) of x normal about a reading and truncated to 0 ≤ x ≤ `most`.
#[must_use]
pub(crate) fn beyond(reading: Estimate, from: f64, most: f64) -> f64 {
    let Estimate { value, std_error } = reading;
    if from <= 0.0 {
        return 1.0;
    }
    if std_error.is_nan() || std_error <= 0.0 {
        return f64::from(u8::from(value >= from));
    }
    // Probabilities of the upper tail lose no digits.
    let tail = |x: f64| 0.5 * erfc((x - value) / (std_error * std::f64::consts::SQRT_2));
    let end = if most.is_finite() { tail(most) } else { 0.0 };
    let all = tail(0.0) - end;
    if all > 0.0 {
        ((tail(from) - end) / all).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(value >= from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        evidence::{Cause, Stands},
        zone::Zones,
    };

    fn reading(value: f64, std_error: f64) -> Estimate {
        Estimate { value, std_error }
    }

    /// Against Simpson's rule on the density of Gauss between the bounds.
    #[test]
    fn beyond_is_the_integral_of_the_truncated_density() {
        let integral = |m: f64, s: f64, from: f64, to: f64| {
            let n = 4000;
            let h = (to - from) / f64::from(n);
            let f = |i: i32| {
                (-0.5 * ((from + h * f64::from(i) - m) / s).powi(2)).exp()
                    * if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) }
            };
            (0..=n).map(f).sum::<f64>() * h / 3.0
        };
        for (m, s) in [(0.0, 0.34), (0.3, 0.1), (0.95, 0.2), (0.5, 2.0), (1.0, 0.05)] {
            for from in [0.1, 0.25, 0.5, 0.9] {
                let expected = integral(m, s, from, 1.0) / integral(m, s, 0.0, 1.0);
                assert!(
                    (beyond(reading(m, s), from, 1.0) - expected).abs() < 1e-9,
                    "{m} {s} {from}"
                );
            }
            let expected = integral(m, s, 0.4, m + 12.0 * s) / integral(m, s, 0.0, m + 12.0 * s);
            assert!((beyond(reading(m, s), 0.4, f64::INFINITY) - expected).abs() < 1e-7, "{m} {s}");
        }
        assert_eq!(
            [beyond(reading(0.3, 0.0), 0.3, 1.0), beyond(reading(0.3, 0.0), 0.31, 1.0)],
            [1.0, 0.0]
        );
    }

    /// .00 ± .34 was called sound, no action. It is: below .1 with P = .232, up to .25 .308, up to
    /// .5 .322, beyond .139.
    #[test]
    fn nobody_looked_is_not_sound() {
        let profile = Profile::default();
        let verdict =
            Verdict::of(&profile, Some(reading(0.0, 0.34)), &[], Basis::Forecast, Looked::NOWHERE);
        let likely: Vec<f64> =
            ["sound", "fair", "poor", "severe"].map(|s| verdict.probability[s]).to_vec();
        for (found, expected) in likely.iter().zip([0.2321, 0.3075, 0.3218, 0.1386]) {
            assert!((found - expected).abs() < 1e-4, "{likely:?}");
        }
        assert_eq!(verdict.state, "forecast: between sound and poor");
        assert!(
            verdict.advice.starts_with("Inspect")
                && !verdict.advice.to_lowercase().contains("no action"),
            "{}",
            verdict.advice
        );
    }

    #[test]
    fn a_state_is_named_when_it_is_likely_enough() {
        let profile = Profile::default();
        let looked = Looked { found: true, unseen: 0.0 };
        let of =
            |d: f64, s: f64, basis| Verdict::of(&profile, Some(reading(d, s)), &[], basis, looked);
        let sound = of(0.0, 0.03, Basis::Measured);
        assert_eq!(
            (sound.state.as_str(), sound.run, sound.is_settled()),
            ("sound", Some([0, 0]), true)
        );
        assert_eq!(sound.advice, profile.states[0].advice);
        assert_eq!(of(0.25, 0.05, Basis::Measured).state, "between fair and poor");
        let forecast = of(0.0, 0.03, Basis::Forecast);
        assert_eq!(forecast.state, "forecast: sound");
        assert!(!forecast.is_settled() && !forecast.advice.contains("No action"));
        // Nobody who is undecided or of which only a forecast speaks is told to do nothing, and the worst that may be
        // counts.
        for (d, s) in [(0.05, 0.1), (0.2, 0.3), (0.45, 0.1), (0.6, 0.2)] {
            for basis in [Basis::Measured, Basis::Forecast] {
                let verdict = of(d, s, basis);
                assert!(
                    verdict.is_settled() || verdict.advice.starts_with("Inspect"),
                    "{verdict:?}"
                );
                assert!(
                    verdict.is_settled() || !verdict.advice.contains("No action"),
                    "{verdict:?}"
                );
                assert!((verdict.probability.values().sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        assert_eq!(Verdict::of(&profile, None, &[], Basis::None, looked).state, NO_EVIDENCE);
    }

    /// A crack of .3 mm calls for *fair* whatever the damage: .32 ± .08 mm is beyond it with P =
    /// .5987.
    #[test]
    fn cracks_have_errors_too() {
        let profile = Profile::default();
        let looked = Looked { found: true, unseen: 0.0 };
        let of = |w: f64, s: f64| {
            let crack = [reading(w, s)];
            Verdict::of(&profile, Some(reading(0.0, 0.02)), &crack, Basis::Measured, looked)
        };
        let likely = of(0.32, 0.08).probability["sound"];
        assert!((likely - (1.0 - 0.5987)).abs() < 1e-3, "{likely}");
        assert_eq!(
            [of(0.32, 0.08).state, of(0.6, 0.1).state, of(2.0, 0.3).state],
            ["between sound and fair", "fair", "poor"]
        );
        // Two sources that both know of one: the wider of the two counts.
        let both = Verdict::of(
            &profile,
            Some(reading(0.0, 0.02)),
            &[reading(0.32, 0.08), reading(0.32, 0.08)],
            Basis::Measured,
            looked,
        );
        assert!((both.probability["sound"] - (1.0_f64 - 0.5987).powi(2)).abs() < 1e-3);
    }

    /// A slab of which one face was seen and found intact was to be treated as poor, with a repair
    /// planned within a year.
    #[test]
    fn nobody_looked_is_not_poor_either() {
        let profile = Profile::default();
        let of = |damage, cracks: &[Estimate], basis, looked| {
            Verdict::of(&profile, Some(damage), cracks, basis, looked)
        };
        let half = Looked { found: false, unseen: 0.5 };
        let seen = of(reading(0.0, 0.24), &[], Basis::Measured, half);
        assert!(seen.to_inspect && seen.state == "between sound and poor");
        assert_eq!(
            seen.advice,
            "Inspect: nothing was found, but 50 % of the length has not been looked at."
        );
        assert_eq!(seen.within_months, Some(24));
        let forecast = of(reading(0.0, 0.34), &[], Basis::Forecast, Looked::NOWHERE);
        assert!(forecast.to_inspect && !forecast.advice.contains("poor"));
        assert_eq!(forecast.within_months, profile.inspect_within_months);
        // What is settled needs no inspection of its own.
        let settled = of(reading(0.0, 0.03), &[], Basis::Measured, half);
        assert!(!settled.to_inspect && settled.within_months == Some(72));
        // Damage that was found, is more probable than not, or cracks that are forecast count as
        // before.
        let found = Looked { found: true, ..half };
        for verdict in [
            of(reading(0.08, 0.27), &[], Basis::Measured, found),
            of(reading(0.12, 0.27), &[], Basis::Measured, half),
            of(reading(0.2, 0.34), &[], Basis::Forecast, Looked::NOWHERE),
            of(reading(0.0, 0.34), &[reading(0.4, 0.16)], Basis::Forecast, Looked::NOWHERE),
        ] {
            assert!(!verdict.to_inspect && verdict.advice.contains("treat it as"), "{verdict:?}");
            assert!(verdict.within_months.is_some_and(|months| months <= 12), "{verdict:?}");
        }
    }

    /// What reaches a zone from another one is no look at it.
    #[test]
    fn a_zone_is_looked_at_where_somebody_was() {
        let profile = Profile::default();
        let said = |value, measured| {
            let zones = Zones(std::array::from_fn(|_| Some(reading(value, 0.1))));
            let mut e = Evidence::new("x", measured, [(Cause::Concrete, zones)].into(), "".into());
            let stands = std::array::from_fn(|zone| Stands {
                between: 0.0,
                prior: (zone >= 3).then_some(0.3),
            });
            if let Some(e) = &mut e {
                e.stands.insert(Cause::Concrete, stands);
            }
            e.unwrap()
        };
        let of = |e: &Evidence| Looked::of(&profile, &[e], false);
        assert_eq!(of(&said(0.0, true)), Looked { found: false, unseen: 0.7 });
        assert_eq!(of(&said(0.3, true)), Looked { found: true, unseen: 0.7 });
        assert_eq!(of(&said(0.3, false)), Looked::NOWHERE);
        let cracked = Evidence { crack_width_mm: Some(0.1), ..said(0.0, true) };
        assert!(of(&cracked).found);
    }

    #[test]
    fn runs_are_as_short_as_can_be() {
        assert_eq!(run(&[0.85, 0.1, 0.05, 0.0]), [0, 0]);
        assert_eq!(run(&[0.1, 0.45, 0.4, 0.05]), [1, 2]);
        assert_eq!(run(&[0.25, 0.25, 0.25, 0.25]), [0, 3]);
        assert_eq!(run(&[1.0]), [0, 0]);
    }
}
