//! How good a detection is: pixels, objects and porosity against label masks.
//!
//! Objects are 4-connected components of at least three pixels; smaller ones are dropped from both
//! sides before anything is counted. Two objects match where their intersection over union exceeds
//! one half, so that no object can match twice. Pixels and objects are pooled over slices before
//! any ratio is taken; the porosity error is a mean over slices (Kirillov et al. 2019 for the
//! panoptic quality).

use serde::{Deserialize, Serialize};

use intrados_raster::grid::{Grid, Mask};

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

/// Scores, each from 0 to 1 but for the porosity error, which is relative. `None` where there was
/// nothing to score.
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
    /// Mean over slices of |p − t|/t, p and t the porosity found and true; slices without any true
    /// pore are left out.
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
        let mut tally = Self {
            objects_found: found.areas.len(),
            objects_true: truth.areas.len(),
            ..Self::default()
        };
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
            tally.porosity_error_sum =
                tally.pixels_found.abs_diff(tally.pixels_true) as f64 / tally.pixels_true as f64;
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
            porosity_error: (self.slices_with_truth > 0)
                .then(|| self.porosity_error_sum / self.slices_with_truth as f64),
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

/// How probably an object of a size is found: touched by anything that was found, however well
/// outlined.
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
        for (&label, _) in truth
            .labels
            .data
            .iter()
            .zip(&found.data)
            .filter(|(label, found)| **label != 0 && **found)
        {
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
        let class = |(&from_px, [touched, all]): (&usize, [usize; 2])| SizeClass {
            from_px,
            probability: wilson(touched, all),
        };
        SIZES.iter().zip(self.0).map(class).collect()
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

/// a / b; none of nothing.
#[must_use]
pub fn ratio(a: usize, b: usize) -> Option<f64> {
    (b > 0).then(|| a as f64 / b as f64)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: true objects of 4 and 3 pixels (a single pixel is dropped), found ones of 6 and 3;
    /// the first pair shares 4 of 6 pixels (IoU 2/3, matched), the second pair 1 of 5 (IoU 1/5,
    /// not).
    #[test]
    fn scores_by_hand() {
        let truth = Mask::drawn(&["####....#", ".........", ".....###."]);
        let found = Mask::drawn(&["######...", ".........", "...###..."]);
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
        let [a, b] = [Mask::drawn(&["###", "..."]), Mask::drawn(&["...", "..."])];
        let mut both = Tally::of(&a, &a).unwrap();
        both += Tally::of(&a, &b).unwrap();
        assert_eq!(both.score().f1, Some(2.0 / 3.0));
        assert_eq!(both.score().porosity_error, Some(0.0));
        assert_eq!(Tally::of(&b, &b).unwrap().score().f1, None);
        assert!(Tally::of(&a, &Mask::drawn(&["#"])).is_none());
    }

    /// 27 of 30: the interval of Wilson is [74 %, 96 %].
    #[test]
    fn wilson_by_the_book() {
        let figure = wilson(27, 30).unwrap();
        assert!(
            (figure.ci95[0] - 0.744).abs() < 5e-4 && (figure.ci95[1] - 0.965).abs() < 5e-4,
            "{figure:?}"
        );
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
        let shares: Vec<_> =
            sizes.classes().iter().map(|c| c.probability.map(|p| (p.value, p.n))).collect();
        assert_eq!(shares, [Some((0.0, 1)), Some((1.0, 1)), None, None, None]);
    }
}
