//! How good a detection is: pixels, objects and porosity against label masks.
//!
//! Objects are 4-connected components of at least three pixels; smaller ones are dropped from both sides before anything is
//! counted. Two objects match where their intersection over union exceeds one half, so that no object can match twice. Pixels and objects are
//! pooled over slices before any ratio is taken; the porosity error is a mean over slices (Kirillov et al. 2019 for the panoptic quality).

use intrados_stage::random::Key;
use serde::{Deserialize, Serialize};

use crate::{
    detect::Reading,
    grid::{Grid, Mask},
    verdict::{CALLED, NAMED, beyond},
};

/// Smallest object, pixels.
pub const MIN_OBJECT: usize = 3;

/// Counts that scores are made of; those of several slices add up.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Tally {
    pixels_both: usize,
    pixels_found: usize,
    pixels_true: usize,
    matched: usize,
    objects_found: usize,
    objects_true: usize,
    iou_sum: f64,
    porosity_error_sum: f64,
    slices_with_truth: usize,
}

/// Scores, each from 0 to 1 but for the porosity error, which is relative. `None` where there was nothing to score.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Pixels: 2 both / (found + true).
    pub dice: Option<f64>,
    /// Pixels: both / either.
    pub iou: Option<f64>,
    /// Objects: matched / found.
    pub precision: Option<f64>,
    /// Objects: matched / true.
    pub recall: Option<f64>,
    /// Objects: 2 matched / (found + true).
    pub f1: Option<f64>,
    /// Objects: F1 times the mean intersection over union of those matched.
    pub panoptic_quality: Option<f64>,
    /// Mean over slices of |p − t|/t, p and t the porosity found and true; slices without any true pore are left out.
    pub porosity_error: Option<f64>,
}

impl Tally {
    /// Compares what was found in one slice with its label mask; `None` if the sizes differ.
    #[must_use]
    pub fn of(found: &Mask, truth: &Mask) -> Option<Self> {
        if !found.fits(truth) {
            return None;
        }
        let (found, truth) = (objects(found), objects(truth));
        let mut tally = Self { objects_found: found.areas.len(), objects_true: truth.areas.len(), ..Self::default() };
        let mut shared = std::collections::BTreeMap::new();
        for (&f, &t) in found.labels.data.iter().zip(&truth.labels.data) {
            tally.pixels_found += usize::from(f != 0);
            tally.pixels_true += usize::from(t != 0);
            if f != 0 && t != 0 {
                tally.pixels_both += 1;
                *shared.entry((f, t)).or_insert(0_usize) += 1;
            }
        }
        for ((f, t), both) in shared {
            let either = found.areas[f as usize - 1] + truth.areas[t as usize - 1] - both;
            if 2 * both > either {
                tally.matched += 1;
                tally.iou_sum += both as f64 / either as f64;
            }
        }
        if tally.pixels_true > 0 {
            // Both porosities have the same body area, which cancels.
            tally.porosity_error_sum = tally.pixels_found.abs_diff(tally.pixels_true) as f64 / tally.pixels_true as f64;
            tally.slices_with_truth = 1;
        }
        Some(tally)
    }

    /// The scores of everything counted.
    #[must_use]
    pub fn score(&self) -> Score {
        let f1 = ratio(2 * self.matched, self.objects_found + self.objects_true);
        let quality = if self.matched > 0 { self.iou_sum / self.matched as f64 } else { 0.0 };
        Score {
            dice: ratio(2 * self.pixels_both, self.pixels_found + self.pixels_true),
            iou: ratio(self.pixels_both, self.pixels_found + self.pixels_true - self.pixels_both),
            precision: ratio(self.matched, self.objects_found),
            recall: ratio(self.matched, self.objects_true),
            f1,
            panoptic_quality: f1.map(|f1| f1 * quality),
            porosity_error: (self.slices_with_truth > 0).then(|| self.porosity_error_sum / self.slices_with_truth as f64),
        }
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.pixels_both += other.pixels_both;
        self.pixels_found += other.pixels_found;
        self.pixels_true += other.pixels_true;
        self.matched += other.matched;
        self.objects_found += other.objects_found;
        self.objects_true += other.objects_true;
        self.iou_sum += other.iou_sum;
        self.porosity_error_sum += other.porosity_error_sum;
        self.slices_with_truth += other.slices_with_truth;
    }
}

impl std::ops::AddAssign for Sizes {
    fn add_assign(&mut self, other: Self) {
        let pairs = self.0.iter_mut().flatten().zip(other.0.into_iter().flatten());
        pairs.for_each(|(all, more)| *all += more);
    }
}

fn ratio(a: usize, b: usize) -> Option<f64> {
    (b > 0).then(|| a as f64 / b as f64)
}

struct Objects {
    labels: Grid<u32>,
    areas: Vec<usize>,
}

fn objects(mask: &Mask) -> Objects {
    let mut found = mask.components();
    found.members.retain(|pixels| pixels.len() >= MIN_OBJECT);
    found.labels.data.fill(0);
    for (n, pixels) in found.members.iter().enumerate() {
        pixels.iter().for_each(|&i| found.labels.data[i] = n as u32 + 1);
    }
    Objects { labels: found.labels, areas: found.members.iter().map(Vec::len).collect() }
}

/// Areas from which the classes of [`Sizes`] begin, pixels.
const SIZES: [usize; 5] = [3, 6, 10, 15, 25];

/// True objects by size, and how many of them were touched by what was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Sizes([[usize; 2]; SIZES.len()]);

/// How probably an object of a size is found: touched by anything that was found, however well outlined.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeClass {
    /// Smallest area, pixels; the class ends where the next one begins.
    pub from_px: usize,
    /// Share that was found, with Wilson's interval.
    pub probability: Option<Figure>,
}

impl Sizes {
    /// Counts the objects of one slice.
    pub fn count(&mut self, found: &Mask, truth: &Mask) {
        let truth = objects(truth);
        let mut touched = vec![false; truth.areas.len()];
        for (&label, _) in truth.labels.data.iter().zip(&found.data).filter(|(label, found)| **label != 0 && **found) {
            touched[label as usize - 1] = true;
        }
        for (area, touched) in truth.areas.into_iter().zip(touched) {
            if let Some(class) = SIZES.iter().rposition(|&from| area >= from) {
                self.0[class][0] += usize::from(touched);
                self.0[class][1] += 1;
            }
        }
    }

    /// The probability of detection against size.
    #[must_use]
    pub fn classes(&self) -> Vec<SizeClass> {
        let class = |(&from_px, [touched, all]): (&usize, [usize; 2])| SizeClass { from_px, probability: wilson(touched, all) };
        SIZES.iter().zip(self.0).map(class).collect()
    }
}

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

/// A figure with its 95 % interval and the number of cases it rests on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// The figure.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Cases.
    pub n: usize,
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

/// How good a prediction of members is. `None` where there was nothing to score: no truth, or no severe member.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MemberScore {
    /// Members with evidence and truth.
    pub members: usize,
    /// Of these, truly severe.
    pub severe: usize,
    /// Damage that counts as severe.
    pub severe_from: f64,
    /// Probability of such damage from which a member is taken as called severe, whether its state is named or left between two.
    #[serde(default)]
    pub called_from: f64,
    /// Members that are neither called severe nor called not severe with the probability from which states are named.
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
    /// Share of the zones whose 95 % interval holds the truth. Zones of a member err together: its interval is a bootstrap over members.
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
        let likely = |o: &Outcome| beyond(Reading { value: o.damage, std_error: o.std_error }, cases.severe_from, 1.0);
        let (is, called) = (|o: &Outcome| o.truth >= cases.severe_from, |o: &Outcome| likely(o) >= CALLED);
        let members = cases.members.as_slice();
        let count = |f: &dyn Fn(&Outcome) -> bool| members.iter().filter(|o| f(o)).count();
        let hits = count(&|o| is(o) && called(o));
        let covered = |list: &[Outcome]| wilson(list.iter().filter(|o| o.is_covered()).count(), list.len());
        let f1 = |sample: &[Outcome]| {
            let hits = sample.iter().filter(|o| is(o) && called(o)).count();
            ratio(2 * hits, sample.iter().filter(|o| is(o)).count() + sample.iter().filter(|o| called(o)).count())
        };
        let error = |sample: &[Outcome]| mean(sample, |o| (o.damage - o.truth).abs());
        let all_sound = mean(members, |o| o.truth.abs()).filter(|&e| e > 0.0);
        let marks = |o: &Outcome| [o.truth, o.damage].map(|d| d >= cases.damaged_from);
        let iou = |sample: &[Vec<Outcome>]| {
            let zones = || sample.iter().flatten().map(marks);
            ratio(zones().filter(|m| m[0] && m[1]).count(), zones().filter(|m| m[0] || m[1]).count())
        };
        let held =
            |sample: &[Vec<Outcome>]| ratio(sample.iter().flatten().filter(|o| o.is_covered()).count(), sample.iter().map(Vec::len).sum());
        let relative = |sample: &[Outcome]| mean(sample, |o| (o.damage - o.truth).abs() / o.truth);
        let porous: Vec<Outcome> = cases.porosities.iter().copied().filter(|o| o.truth > 0.0).collect();
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

/// A share with Wilson's 95 % interval (1927), which holds for small n too.
#[must_use]
pub fn wilson(hits: usize, n: usize) -> Option<Figure> {
    const Z: f64 = 1.959_964;
    let value = ratio(hits, n)?;
    let n_ = n as f64;
    let scale = 1.0 + Z * Z / n_;
    let middle = (value + Z * Z / (2.0 * n_)) / scale;
    let half = Z / scale * (value * (1.0 - value) / n_ + Z * Z / (4.0 * n_ * n_)).sqrt();
    Some(Figure { value, ci95: [(middle - half).max(0.0), (middle + half).min(1.0)], n })
}

/// A figure with its percentile interval over 1000 resamples of the cases (Efron 1979). Samples in which it is not defined are left out.
fn bootstrap<T: Clone>(sample: &[T], figure: impl Fn(&[T]) -> Option<f64>) -> Option<Figure> {
    const DRAWS: u64 = 1000;
    let value = figure(sample)?;
    let n = sample.len();
    let draw = |d: u64| {
        let key = Key::new(0x626f_6f74, d);
        let resampled: Vec<T> = (0..n).map(|k| sample[((key.unit64(k as u32) * n as f64) as usize).min(n - 1)].clone()).collect();
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

    fn drawn(rows: &[&str]) -> Mask {
        let data = rows.iter().flat_map(|r| r.bytes().map(|b| b == b'#')).collect();
        Mask { width: rows[0].len(), height: rows.len(), data }
    }

    /// By hand: true objects of 4 and 3 pixels (a single pixel is dropped), found ones of 6 and 3; the first pair shares 4 of 6 pixels
    /// (IoU 2/3, matched), the second pair 1 of 5 (IoU 1/5, not).
    #[test]
    fn scores_by_hand() {
        let truth = drawn(&["####....#", ".........", ".....###."]);
        let found = drawn(&["######...", ".........", "...###..."]);
        let score = Tally::of(&found, &truth).unwrap().score();
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        close(score.dice, 10.0 / 16.0);
        close(score.iou, 5.0 / 11.0);
        close(score.precision, 0.5);
        close(score.recall, 0.5);
        close(score.f1, 0.5);
        close(score.panoptic_quality, 0.5 * 4.0 / 6.0);
        close(score.porosity_error, 2.0 / 7.0);
    }

    #[test]
    fn tallies_pool_and_nothing_scores_nothing() {
        let [a, b] = [drawn(&["###", "..."]), drawn(&["...", "..."])];
        let mut both = Tally::of(&a, &a).unwrap();
        both += Tally::of(&a, &b).unwrap();
        assert_eq!(both.score().f1, Some(2.0 / 3.0));
        assert_eq!(both.score().porosity_error, Some(0.0));
        assert_eq!(Tally::of(&b, &b).unwrap().score().f1, None);
        assert!(Tally::of(&a, &drawn(&["#"])).is_none());
    }

    /// 27 of 30: the interval of Wilson is [74 %, 96 %].
    #[test]
    fn wilson_by_the_book() {
        let figure = wilson(27, 30).unwrap();
        assert!((figure.ci95[0] - 0.744).abs() < 5e-4 && (figure.ci95[1] - 0.965).abs() < 5e-4, "{figure:?}");
        assert_eq!(wilson(0, 0), None);
    }

    #[test]
    fn sizes_by_hand() {
        let mut truth = Mask::new(12, 3, false);
        (0..3).chain(5..12).for_each(|i| truth.data[i] = true);
        let mut found = truth.map(|_| false);
        found.data[6] = true;
        let mut sizes = Sizes::default();
        sizes.count(&found, &truth);
        let shares: Vec<_> = sizes.classes().iter().map(|c| c.probability.map(|p| (p.value, p.n))).collect();
        assert_eq!(shares, [Some((0.0, 1)), Some((1.0, 1)), None, None, None]);
    }

    #[test]
    fn members_by_hand() {
        let of = |truth, damage| Outcome { truth, damage, std_error: 0.1 };
        let members = vec![of(0.8, 0.7), of(0.6, 0.3), of(0.1, 0.6), of(0.1, 0.1)];
        let zones = vec![vec![of(0.3, 0.3), of(0.0, 0.5)], vec![of(0.4, 0.1), of(0.0, 0.0)]];
        let cases = Cases { members, zones, severe_from: 0.5, damaged_from: 0.2, porosities: vec![of(0.04, 0.05)], ..Cases::default() };
        let score = MemberScore::of(&cases);
        let value = |f: Option<Figure>| f.unwrap().value;
        assert_eq!((score.members, score.severe, score.undecided, score.called_from), (4, 2, 0, 0.5));
        assert_eq!([value(score.precision), value(score.recall), value(score.f1), value(score.coverage_95)], [0.5; 4]);
        assert!((value(score.mean_absolute_error) - 0.9 / 4.0).abs() < 1e-12);
        assert!((score.skill_over_all_sound.unwrap() - (1.0 - 0.9 / 1.6)).abs() < 1e-12);
        let [low, high] = score.mean_absolute_error.unwrap().ci95;
        assert!((0.0..0.225).contains(&low) && (0.225..=0.5).contains(&high));
        assert_eq!([value(score.zone_iou), value(score.zone_coverage_95)], [1.0 / 3.0, 0.5]);
        assert!((value(score.porosity_error) - 0.25).abs() < 1e-12 && score.crack_width_error_mm.is_none());
        assert!(MemberScore::of(&Cases::default()).f1.is_none());
    }
}
