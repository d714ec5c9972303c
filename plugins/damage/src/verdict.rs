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
//! looked enough, and what is to be done is to look. Where cracks were found that the exposure class
//! admits, they are to be watched.
//!
//! *At once* has to be earned: the worst state calls for it where it is as likely as [`CALLED`], and
//! not where an error bar merely reaches it. Of a member that was never looked at the worst state
//! counts that it has, or worse, as likely as not. A life that ends by computation
//! ([`Verdict::failing`]) is the worst of all.

use intrados_stage::Estimate;
use std::collections::BTreeMap;

use serde::Serialize;
use statrs::function::erf::erfc;

use crate::{
    evidence::{Evidence, LifeEnd},
    grading::{NO_EVIDENCE, Profile, State},
    zone::ZONES,
};

/// Probability from which a state, or a run of neighbouring states, is named.
pub const NAMED: f64 = 0.8;
/// Probability of being severe from which a member is called severe, named or not.
pub(crate) const CALLED: f64 = 0.5;
/// Damage that readings beside an admitted crack may add before something else was found (ours).
const ADMITTED_MARGIN: f64 = 0.03;

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
    /// The widest crack that was found and what is admitted, mm, where no crack is wider than that.
    pub admitted: Option<[f64; 2]>,
}

impl Looked {
    /// Nobody has looked at anything.
    pub const NOWHERE: Self = Self { found: false, unseen: 1.0, admitted: None };

    /// By what is said of a member: a place counts as looked at where somebody measured or saw it,
    /// and not where the word of another place reaches. A crack that was measured was found if it is
    /// wider than `limit_mm`, which the exposure class admits, and so was a damage that the profile
    /// does not call sound (and that admitted cracks do not explain), and a defect that somebody has
    /// listed, `is_listed`.
    #[must_use]
    pub fn of(
        profile: &Profile,
        evidence: &[&Evidence],
        is_listed: bool,
        limit_mm: Option<f64>,
    ) -> Self {
        let measured = || evidence.iter().filter(|e| e.measured);
        let own = |e: &Evidence, zone: usize| {
            e.zones.iter().any(|(cause, zones)| {
                let stands = e.stands.get(cause).map(|s| s[zone]);
                zones.0[zone].is_some() && stands.is_none_or(|s| s.prior.is_none())
            })
        };
        let is_unseen = |&zone: &usize| !measured().any(|e| own(e, zone));
        let unseen = (0..ZONES).filter(is_unseen).count();
        let limit = limit_mm.unwrap_or(0.0);
        let admitted = |e: &Evidence| e.crack_width_mm.filter(|w| *w > 0.0 && *w <= limit);
        // What a crack of unknown depth costs by the profile's rule: half of the section, by its
        // width.
        let explained = |e: &Evidence| {
            let open = admitted(e).map(|w| (w / profile.rule.open_crack_mm).min(1.0));
            open.map_or(0.0, |open| 0.5 * open + ADMITTED_MARGIN)
        };
        let damaged = |e: &Evidence| {
            let from = profile.damaged_from().max(explained(e));
            e.by_zone().0.iter().flatten().any(|d| d.value >= from)
        };
        let found = |e: &Evidence| e.crack_width_mm.is_some_and(|w| w > limit) || damaged(e);
        let found = is_listed || measured().any(|e| found(e));
        let widest = measured().filter_map(|e| admitted(e)).reduce(f64::max);
        Self {
            found,
            unseen: unseen as f64 / ZONES as f64,
            admitted: widest.filter(|_| !found).map(|w| [w, limit]),
        }
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
        let state = profile.state(damage.value, widest);
        let is_probably_sound = state == profile.states.first();
        let is_admitted =
            looked.admitted.is_some() && profile.states.iter().take(2).any(|s| Some(s) == state);
        let to_inspect = (is_probably_sound || is_admitted) && !looked.found && !is_settled;
        if let Some(admitted) = looked.admitted.filter(|_| to_inspect) {
            return Self::watched(profile, &likely, basis, looked.unseen, admitted);
        }
        let urgent = urgent(&likely, [best, worst], basis);
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
                advice(profile, [best, worst], urgent, basis)
            },
            within_months: if to_inspect {
                profile.inspect_within_months
            } else {
                let months = profile.states[urgent].within_months;
                match basis {
                    // To look is the first thing to do.
                    Basis::Forecast => sooner(months, profile.inspect_within_months),
                    _ => months,
                }
            },
            to_inspect,
        }
    }

    /// Of a member on which only cracks were found that its exposure class admits.
    fn watched(
        profile: &Profile,
        likely: &[f64],
        basis: Basis,
        unseen: f64,
        [width, limit]: [f64; 2],
    ) -> Self {
        let names = || profile.states.iter().map(|s| s.name.as_str());
        let said: Vec<&str> = names().take(2).collect();
        let percent = (100.0 * unseen).round();
        let rest = match percent > 0.0 {
            true => format!("; {percent} % of the length has not been looked at"),
            false => String::new(),
        };
        let months = profile.states.get(1).and_then(|s| s.within_months);
        let months =
            if percent > 0.0 { sooner(months, profile.inspect_within_months) } else { months };
        Self {
            state: match said[..] {
                [sound, fair] => format!("between {sound} and {fair}"),
                _ => said.concat(),
            },
            probability: names().map(str::to_owned).zip(likely.iter().copied()).collect(),
            run: Some([0, said.len().saturating_sub(1)]),
            basis,
            advice: format!(
                "Monitor: cracks up to {width:.2} mm are within the {limit:.2} mm that its exposure class admits{rest}. Look again at the next inspection."
            ),
            within_months: months,
            to_inspect: true,
        }
    }

    /// The same of a member whose computed life ends: it is in the worst state, whatever was seen.
    #[must_use]
    pub fn failing(self, profile: &Profile, end: &LifeEnd) -> Self {
        let (Some(worst), last) = (profile.states.last(), profile.states.len() - 1) else {
            return self;
        };
        let basis = if self.basis == Basis::None { Basis::Forecast } else { self.basis };
        let is_past = end.ahead_years <= 0.0;
        let before = profile.states[..last].last().and_then(|s| s.within_months);
        // At least as likely as a state has to be to be named; the rest as it was.
        let was = self.probability.get(&worst.name).copied().unwrap_or(0.0);
        let (now, others) = (was.max(NAMED), 1.0 - was);
        let share = if others > 0.0 { (1.0 - now) / others } else { 0.0 };
        let probability = profile.states.iter().map(|state| {
            let known = self.probability.get(&state.name).copied();
            let p = if state == worst { now } else { share * known.unwrap_or(0.0) };
            (state.name.clone(), p)
        });
        let probability: BTreeMap<String, f64> = match self.probability.is_empty() {
            false => probability.collect(),
            true => profile
                .states
                .iter()
                .map(|s| (s.name.clone(), if s == worst { 1.0 } else { 0.0 }))
                .collect(),
        };
        Self {
            state: match basis {
                Basis::Forecast => format!("forecast: {}", worst.name),
                _ => worst.name.clone(),
            },
            probability,
            run: Some([last, last]),
            basis,
            advice: format!("{}. {}", end.sentence().trim_end_matches('.'), worst.advice),
            within_months: if is_past {
                worst.within_months
            } else {
                sooner(before, self.within_months)
            },
            to_inspect: false,
        }
    }

    /// Whether one state is named that something measured stands behind.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn is_settled(&self) -> bool {
        self.basis == Basis::Measured && self.run.is_some_and(|[best, worst]| best == worst)
    }
}

/// The sooner of two times.
fn sooner(a: Option<u32>, b: Option<u32>) -> Option<u32> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

/// The state by which it is urgent: the worst that it may be in, but the worst of all only where it
/// is likely enough; of a member that was never looked at the worst that it has, or worse, as
/// likely as not.
fn urgent(likely: &[f64], [best, worst]: [usize; 2], basis: Basis) -> usize {
    let at_least = |k: usize| likely[k..].iter().sum::<f64>();
    if basis == Basis::Forecast {
        return (0..=worst).rev().find(|&k| at_least(k) >= CALLED).unwrap_or(0);
    }
    let is_last = worst + 1 == likely.len();
    if is_last && at_least(worst) < CALLED { worst.saturating_sub(1).max(best) } else { worst }
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
fn advice(profile: &Profile, [best, worst]: [usize; 2], urgent: usize, basis: Basis) -> String {
    let state = &profile.states[urgent];
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
    if urgent == 0 {
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
        let looked = Looked { found: true, unseen: 0.0, admitted: None };
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
        let looked = Looked { found: true, unseen: 0.0, admitted: None };
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
        let half = Looked { found: false, unseen: 0.5, admitted: None };
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
        // Damage that was found, or is more probable than not, counts as before.
        let found = Looked { found: true, ..half };
        for verdict in [
            of(reading(0.08, 0.27), &[], Basis::Measured, found),
            of(reading(0.12, 0.27), &[], Basis::Measured, half),
            of(reading(0.2, 0.34), &[], Basis::Forecast, Looked::NOWHERE),
        ] {
            assert!(!verdict.to_inspect && verdict.advice.contains("treat it as"), "{verdict:?}");
            assert_eq!(verdict.within_months, Some(12), "{verdict:?}");
        }
        // Of a forecast alone cracks ask for eyes within the time of an inspection.
        let cracks =
            of(reading(0.0, 0.34), &[reading(0.4, 0.16)], Basis::Forecast, Looked::NOWHERE);
        assert!(!cracks.to_inspect && cracks.within_months == Some(24), "{cracks:?}");
    }

    /// An error bar that reaches the worst state does not call for the worst.
    #[test]
    fn at_once_is_earned() {
        let profile = Profile::default();
        let looked = Looked { found: true, unseen: 0.0, admitted: None };
        let mut last = u32::MAX;
        for step in 0..=20 {
            let damage = reading(0.05 * f64::from(step), 0.3);
            for (basis, looked) in [(Basis::Measured, looked), (Basis::Forecast, Looked::NOWHERE)] {
                let verdict = Verdict::of(&profile, Some(damage), &[], basis, looked);
                let is_at_once = verdict.within_months == Some(0);
                assert!(!is_at_once || verdict.probability["severe"] >= CALLED, "{verdict:?}");
                assert_eq!(
                    is_at_once,
                    verdict.advice.contains("severe") || verdict.advice.contains("without delay"),
                    "{verdict:?}"
                );
            }
            // More damage is never less urgent.
            let verdict = Verdict::of(&profile, Some(damage), &[], Basis::Measured, looked);
            let months = verdict.within_months.unwrap();
            assert!(months <= last, "{step}: {verdict:?}");
            last = months;
        }
        assert_eq!(last, 0);
    }

    /// Cracks about what the exposure class admits, from the finest to the widest.
    #[test]
    fn cracks_within_what_is_admitted_are_watched() {
        let profile = Profile::default();
        let limit = 0.3;
        let mut last = u32::MAX;
        for width in [0.02_f64, 0.05, 0.1, 0.2, 0.28, 0.3, 0.31, 0.35, 0.5, 1.0, 2.0] {
            for unseen in [0, 5, 9] {
                let damage = reading(0.5 * width.min(1.0), 0.1);
                let own = |zone| (zone >= unseen).then_some(damage);
                let zones = Zones(std::array::from_fn(own));
                let evidence =
                    Evidence::new("survey", true, [(Cause::Concrete, zones)].into(), "".into());
                let evidence = Evidence { crack_width_mm: Some(width), ..evidence.unwrap() };
                let listed = width > limit;
                let looked = Looked::of(&profile, &[&evidence], listed, Some(limit));
                let whole = reading(damage.value, 0.3);
                let cracks = profile.cracks(&[&evidence]);
                let verdict = Verdict::of(&profile, Some(whole), &cracks, Basis::Measured, looked);
                let is_watched = verdict.advice.starts_with("Monitor");
                assert_eq!(is_watched, width <= limit, "{width} {unseen} {verdict:?}");
                if is_watched {
                    assert_eq!(verdict.state, "between sound and fair");
                    assert!(verdict.to_inspect && verdict.within_months >= Some(24));
                }
                if unseen == 5 {
                    let months = verdict.within_months.unwrap();
                    assert!(months <= last, "{width}: {verdict:?}");
                    last = months;
                }
            }
        }
    }

    /// Whatever was seen of it, a member that fails by computation is in the worst state, and what
    /// was assumed is named.
    #[test]
    fn a_life_that_ends_is_the_worst() {
        let profile = Profile::default();
        let end = |ahead_years| LifeEnd {
            age_years: 22.0,
            ahead_years,
            why: "no equilibrium".into(),
            assumed: vec!["reinforcement".into()],
        };
        let looked = Looked { found: false, unseen: 0.0, admitted: None };
        for damage in [None, Some(reading(0.0, 0.03)), Some(reading(0.9, 0.1))] {
            let was = Verdict::of(&profile, damage, &[], Basis::Measured, looked);
            let now = was.clone().failing(&profile, &end(0.0));
            assert!(now.state.ends_with("severe") && now.run == Some([3, 3]), "{now:?}");
            assert!(now.within_months == Some(0) && now.probability["severe"] >= NAMED);
            assert!((now.probability.values().sum::<f64>() - 1.0).abs() < 1e-12, "{now:?}");
            assert!(now.advice.contains("year 22") && now.advice.contains("reinforcement"));
            let later = was.failing(&profile, &end(15.0));
            assert!(later.state.ends_with("severe") && later.within_months <= Some(12));
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
        let of = |e: &Evidence| Looked::of(&profile, &[e], false, None);
        assert_eq!(of(&said(0.0, true)), Looked { found: false, unseen: 0.7, admitted: None });
        assert_eq!(of(&said(0.3, true)), Looked { found: true, unseen: 0.7, admitted: None });
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
