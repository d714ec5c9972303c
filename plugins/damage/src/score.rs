//! How good a prediction of members is, where the truth is known.

use intrados_ct::score::{Figure, Score, ratio, wilson};
use intrados_stage::{Estimate, random::Key};
use serde::{Deserialize, Serialize};

use crate::verdict::{CALLED, NAMED, beyond};

/// A predicted value beside the true one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// True value.
    pub truth: f64,
    /// Predicted value.
    pub damage: f64,
    /// Standard error of the prediction.
    pub std_error: f64,
}

impl Outcome {
    /// Whether the 95 % interval holds the truth.
    fn is_covered(&self) -> bool {
        (self.damage - self.truth).abs() <= 1.96 * self.std_error
    }
}

/// What a prediction of members is scored by.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cases {
    /// Damage of members with evidence and truth.
    pub members: Vec<Outcome>,
    /// Damage from which a member counts as severe.
    pub severe_from: f64,
    /// Damage from which a zone counts as damaged.
    pub damaged_from: f64,
    /// Damage of zones, by member.
    pub zones: Vec<Vec<Outcome>>,
    /// Porosities of slices.
    pub porosities: Vec<Outcome>,
    /// Widest cracks of slices where there is one and one was found, mm.
    pub widths: Vec<Outcome>,
    /// Pixels and objects of slices.
    pub slices: Score,
}

/// How good a prediction of members is. `None` where there was nothing to score: no truth, or no
/// severe member.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MemberScore {
    /// Members with evidence and truth.
    pub members: usize,
    /// Of these, truly severe.
    pub severe: usize,
    /// Damage that counts as severe.
    pub severe_from: f64,
    /// Probability of such damage from which a member is taken as called severe, whether its state
    /// is named or left between two.
    #[serde(default)]
    pub called_from: f64,
    /// Members that are neither called severe nor called not severe with the probability from which
    /// states are named.
    #[serde(default)]
    pub undecided: usize,
    /// Of the members called severe, the share that is.
    pub precision: Option<Figure>,
    /// Of the severe members, the share that was called so: the number that safety rests on.
    pub recall: Option<Figure>,
    /// 2 TP / (2 TP + FP + FN).
    pub f1: Option<Figure>,
    /// Mean |d − truth|.
    pub mean_absolute_error: Option<Figure>,
    /// Share of the members whose 95 % interval holds the truth.
    pub coverage_95: Option<Figure>,
    /// 1 − mean |d − truth| / mean |truth|: what is gained over calling every member sound.
    pub skill_over_all_sound: Option<f64>,
    /// Of the zones that are damaged or called so, the share that is both: TP / (TP + FP + FN).
    pub zone_iou: Option<Figure>,
    /// Share of the zones whose 95 % interval holds the truth. Zones of a member err together: its
    /// interval is a bootstrap over members.
    pub zone_coverage_95: Option<Figure>,
    /// Share of the slices whose 95 % interval of the porosity holds the truth.
    pub slice_coverage_95: Option<Figure>,
    /// Mean relative |porosity − truth| of slices.
    pub porosity_error: Option<Figure>,
    /// Mean |width − truth| of the widest crack of a slice, mm.
    pub crack_width_error_mm: Option<Figure>,
    /// Pixels and objects of all slices with truth.
    pub slices: Score,
}

impl MemberScore {
    /// Scores members, and zones and slices beside them.
    #[must_use]
    pub fn of(cases: &Cases) -> Self {
        let likely = |o: &Outcome| {
            beyond(Estimate { value: o.damage, std_error: o.std_error }, cases.severe_from, 1.0)
        };
        let (is, called) =
            (|o: &Outcome| o.truth >= cases.severe_from, |o: &Outcome| likely(o) >= CALLED);
        let members = cases.members.as_slice();
        let count = |f: &dyn Fn(&Outcome) -> bool| members.iter().filter(|o| f(o)).count();
        let hits = count(&|o| is(o) && called(o));
        let covered =
            |list: &[Outcome]| wilson(list.iter().filter(|o| o.is_covered()).count(), list.len());
        let f1 = |sample: &[Outcome]| {
            let hits = sample.iter().filter(|o| is(o) && called(o)).count();
            ratio(
                2 * hits,
                sample.iter().filter(|o| is(o)).count()
                    + sample.iter().filter(|o| called(o)).count(),
            )
        };
        let error = |sample: &[Outcome]| mean(sample, |o| (o.damage - o.truth).abs());
        let all_sound = mean(members, |o| o.truth.abs()).filter(|&e| e > 0.0);
        let marks = |o: &Outcome| [o.truth, o.damage].map(|d| d >= cases.damaged_from);
        let iou = |sample: &[Vec<Outcome>]| {
            let zones = || sample.iter().flatten().map(marks);
            ratio(
                zones().filter(|m| m[0] && m[1]).count(),
                zones().filter(|m| m[0] || m[1]).count(),
            )
        };
        let held = |sample: &[Vec<Outcome>]| {
            ratio(
                sample.iter().flatten().filter(|o| o.is_covered()).count(),
                sample.iter().map(Vec::len).sum(),
            )
        };
        let relative = |sample: &[Outcome]| mean(sample, |o| (o.damage - o.truth).abs() / o.truth);
        let porous: Vec<Outcome> =
            cases.porosities.iter().copied().filter(|o| o.truth > 0.0).collect();
        Self {
            members: members.len(),
            severe: count(&is),
            severe_from: cases.severe_from,
            called_from: CALLED,
            undecided: count(&|o| likely(o).max(1.0 - likely(o)) < NAMED),
            precision: wilson(hits, count(&called)),
            recall: wilson(hits, count(&is)),
            f1: bootstrap(members, f1),
            mean_absolute_error: bootstrap(members, error),
            coverage_95: covered(members),
            skill_over_all_sound: all_sound.and_then(|e| error(members).map(|a| 1.0 - a / e)),
            zone_iou: bootstrap(&cases.zones, iou),
            zone_coverage_95: bootstrap(&cases.zones, held),
            slice_coverage_95: covered(&cases.porosities),
            porosity_error: bootstrap(&porous, relative),
            crack_width_error_mm: bootstrap(&cases.widths, error),
            slices: cases.slices,
        }
    }
}

fn mean(sample: &[Outcome], f: impl Fn(&Outcome) -> f64) -> Option<f64> {
    (!sample.is_empty()).then(|| sample.iter().map(f).sum::<f64>() / sample.len() as f64)
}

/// A figure with its percentile interval over 1000 resamples of the cases (Efron 1979). Samples in
/// which it is not defined are left out.
fn bootstrap<T: Clone>(sample: &[T], figure: impl Fn(&[T]) -> Option<f64>) -> Option<Figure> {
    const DRAWS: u64 = 1000;
    let value = figure(sample)?;
    let n = sample.len();
    let draw = |d: u64| {
        let key = Key::new(0x626f_6f74, d);
        let resampled: Vec<T> = (0..n)
            .map(|k| sample[((key.unit64(k as u32) * n as f64) as usize).min(n - 1)].clone())
            .collect();
        figure(&resampled)
    };
    let mut draws: Vec<f64> = (0..DRAWS).filter_map(draw).collect();
    draws.sort_by(f64::total_cmp);
    let at = |q: f64| draws.get((q * draws.len() as f64) as usize).copied().unwrap_or(value);
    Some(Figure { value, ci95: [at(0.025), at(0.975)], n })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_by_hand() {
        let of = |truth, damage| Outcome { truth, damage, std_error: 0.1 };
        let members = vec![of(0.8, 0.7), of(0.6, 0.3), of(0.1, 0.6), of(0.1, 0.1)];
        let zones = vec![vec![of(0.3, 0.3), of(0.0, 0.5)], vec![of(0.4, 0.1), of(0.0, 0.0)]];
        let cases = Cases {
            members,
            zones,
            severe_from: 0.5,
            damaged_from: 0.2,
            porosities: vec![of(0.04, 0.05)],
            ..Cases::default()
        };
        let score = MemberScore::of(&cases);
        let value = |f: Option<Figure>| f.unwrap().value;
        assert_eq!(
            (score.members, score.severe, score.undecided, score.called_from),
            (4, 2, 0, 0.5)
        );
        assert_eq!(
            [
                value(score.precision),
                value(score.recall),
                value(score.f1),
                value(score.coverage_95)
            ],
            [0.5; 4]
        );
        assert!((value(score.mean_absolute_error) - 0.9 / 4.0).abs() < 1e-12);
        assert!((score.skill_over_all_sound.unwrap() - (1.0 - 0.9 / 1.6)).abs() < 1e-12);
        let [low, high] = score.mean_absolute_error.unwrap().ci95;
        assert!((0.0..0.225).contains(&low) && (0.225..=0.5).contains(&high));
        assert_eq!([value(score.zone_iou), value(score.zone_coverage_95)], [1.0 / 3.0, 0.5]);
        assert!(
            (value(score.porosity_error) - 0.25).abs() < 1e-12
                && score.crack_width_error_mm.is_none()
        );
        assert!(MemberScore::of(&Cases::default()).f1.is_none());
    }
}
