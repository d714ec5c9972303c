//! The score of a case: 100 × the mean of what applies of three terms.
//!
//! - *pores*: F1 of objects (4-connected, at least three pixels), matched where intersection over
//!   union exceeds one half;
//! - *cracks*: F1 of pixels, found and true ones within two pixels of each other;
//! - *porosity*: 1 − |p − t|/t of the areas of these pores, not below 0.
//!
//! A case without pores has neither the first nor the last term, one without cracks not the second,
//! whatever was found.

use intrados_stage::random::Key;
use serde::{Deserialize, Serialize};

use super::{reference::MethodMarks, shapes::PlantedTruth};
use intrados_ct::score::MIN_OBJECT;
use intrados_raster::grid::{Grid, Mask};

/// Pixels that a crack may be off.
const TOLERANCE: f32 = 2.0;
/// Edge of the blocks of the bootstrap, pixels.
const BLOCK: usize = 40;
/// Draws of the bootstrap.
const DRAWS: u64 = 1000;

/// What a score is made of; that of several blocks adds up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ScoreCounts {
    /// Objects matched, found, true.
    objects: [f64; 3],
    /// Pixels of pores found, true.
    area: [f64; 2],
    /// Pixels of cracks: found near a true one, found, true near a found one, true.
    cracks: [f64; 4],
}

/// The three terms, each from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Terms {
    /// F1 of the pores.
    pub pores: Option<f64>,
    /// F1 of the cracks.
    pub cracks: Option<f64>,
    /// 1 − relative error of the porosity.
    pub porosity: Option<f64>,
}

/// A score with its 95 % interval: a bootstrap over blocks of the slice, which keeps neighbouring
/// objects together (Künsch 1989).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IntervalScore {
    /// 0 to 100.
    pub score: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// What it is the mean of.
    pub terms: Terms,
}

impl ScoreCounts {
    fn add(&mut self, other: &Self) {
        (0..3).for_each(|k| self.objects[k] += other.objects[k]);
        (0..2).for_each(|k| self.area[k] += other.area[k]);
        (0..4).for_each(|k| self.cracks[k] += other.cracks[k]);
    }

    /// The terms that apply: `pores` and `cracks` say what the case has.
    fn terms(&self, pores: bool, cracks: bool) -> Terms {
        let [near, found, reached, all] = self.cracks;
        let f1 = |hits: f64, all: f64| if all > 0.0 { hits / all } else { 0.0 };
        let [precision, recall] = [f1(near, found), f1(reached, all)];
        let crack = if precision + recall > 0.0 {
            2.0 * precision * recall / (precision + recall)
        } else {
            0.0
        };
        Terms {
            pores: pores.then(|| f1(2.0 * self.objects[0], self.objects[1] + self.objects[2])),
            cracks: cracks.then_some(crack),
            porosity: pores.then(|| {
                if self.area[1] > 0.0 {
                    (1.0 - (self.area[0] - self.area[1]).abs() / self.area[1]).max(0.0)
                } else {
                    0.0
                }
            }),
        }
    }
}

impl Terms {
    /// 100 × the mean of those there are.
    #[must_use]
    pub(crate) fn score(&self) -> f64 {
        let terms: Vec<f64> =
            [self.pores, self.cracks, self.porosity].into_iter().flatten().collect();
        100.0 * terms.iter().sum::<f64>() / terms.len().max(1) as f64
    }
}

/// Scores marks against the truth.
#[must_use]
pub(crate) fn scored(marks: &MethodMarks, truth: &PlantedTruth, seed: u64) -> IntervalScore {
    let blocks = blocks(marks, truth);
    let (pores, cracks) = (truth.pores.data.contains(&true), truth.cracks.data.contains(&true));
    let sum = |blocks: &mut dyn Iterator<Item = &ScoreCounts>| {
        let mut sum = ScoreCounts::default();
        blocks.for_each(|b| sum.add(b));
        sum
    };
    let terms = sum(&mut blocks.iter()).terms(pores, cracks);
    let n = blocks.len();
    let draw = |d: u64| {
        let key = Key::new(seed, d);
        let pick = |k: usize| &blocks[((key.unit64(k as u32) * n as f64) as usize).min(n - 1)];
        sum(&mut (0..n).map(pick)).terms(pores, cracks).score()
    };
    let mut draws: Vec<f64> = (0..DRAWS).map(draw).collect();
    draws.sort_by(f64::total_cmp);
    let at = |q: f64| draws[((q * draws.len() as f64) as usize).min(draws.len() - 1)];
    IntervalScore { score: terms.score(), ci95: [at(0.025), at(0.975)], terms }
}

/// Counts of every block in which there is something of the body.
fn blocks(marks: &MethodMarks, truth: &PlantedTruth) -> Vec<ScoreCounts> {
    let width = truth.pores.width;
    let across = width.div_ceil(BLOCK);
    let mut blocks = vec![ScoreCounts::default(); across * truth.pores.height.div_ceil(BLOCK)];
    let block = |i: usize| i / width / BLOCK * across + i % width / BLOCK;
    let is_object = |pixels: &&Vec<usize>| pixels.len() >= MIN_OBJECT;
    let found: Vec<&Vec<usize>> = marks.objects.iter().filter(is_object).collect();
    let true_ones = truth.pores.components();
    let real: Vec<&Vec<usize>> = true_ones.members.iter().filter(is_object).collect();
    let mut label = Grid::new(width, truth.pores.height, 0_usize);
    for (n, pixels) in real.iter().enumerate() {
        pixels.iter().for_each(|i| label.data[*i] = n + 1);
        // An object counts where its first pixel is.
        let counts = &mut blocks[block(pixels[0])];
        counts.objects[2] += 1.0;
        counts.area[1] += pixels.len() as f64;
    }
    for pixels in found {
        let mut shared = std::collections::BTreeMap::new();
        pixels
            .iter()
            .filter(|i| label.data[**i] != 0)
            .for_each(|i| *shared.entry(label.data[*i]).or_insert(0_usize) += 1);
        // More than half of the union: no other can.
        let matched =
            shared.iter().find(|(n, both)| 3 * **both > pixels.len() + real[**n - 1].len());
        let counts = &mut blocks[block(matched.map_or(pixels[0], |(n, _)| real[*n - 1][0]))];
        counts.objects[0] += f64::from(u8::from(matched.is_some()));
        counts.objects[1] += 1.0;
        counts.area[0] += pixels.len() as f64;
    }
    let near = |of: &Mask| (of.count() > 0).then(|| of.map(|v| !v).distance_within());
    for (a, b, k) in [(&marks.cracks, &truth.cracks, 0), (&truth.cracks, &marks.cracks, 2)] {
        let away = near(b);
        for i in (0..a.data.len()).filter(|i| a.data[*i]) {
            let counts = &mut blocks[block(i)];
            counts.cracks[k + 1] += 1.0;
            counts.cracks[k] +=
                f64::from(u8::from(away.as_ref().is_some_and(|d| d.data[i] <= TOLERANCE)));
        }
    }
    let mut is_body = vec![false; blocks.len()];
    truth
        .body
        .data
        .iter()
        .enumerate()
        .filter(|(_, b)| **b)
        .for_each(|(i, _)| is_body[block(i)] = true);
    blocks
        .into_iter()
        .zip(is_body)
        .filter(|(counts, body)| *body || *counts != ScoreCounts::default())
        .map(|(counts, _)| counts)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_ct::score::Tally;

    fn drawn(rows: &[&str], of: u8) -> Mask {
        Mask {
            width: rows[0].len(),
            height: rows.len(),
            data: rows.iter().flat_map(|r| r.bytes().map(move |b| b == of)).collect(),
        }
    }

    fn marks(rows: &[&str]) -> MethodMarks {
        let pores = drawn(rows, b'o');
        MethodMarks { objects: pores.components().members, pores, cracks: drawn(rows, b'#') }
    }

    fn truth(rows: &[&str]) -> PlantedTruth {
        PlantedTruth {
            pores: drawn(rows, b'o'),
            cracks: drawn(rows, b'#'),
            body: drawn(rows, b' ').map(|v| !v),
            steel: drawn(rows, b'S'),
        }
    }

    /// By hand. Pores: true ones of 4 and 3 pixels (one of 2 is too small), found ones of 5 and 3;
    /// the first pair shares 4 of 5, the second 1 of 5: F1 = 2·1/4. Areas 8 and 7: 1 − 1/7. Cracks:
    /// six true pixels in a row, three found of them are there, one is three rows above: precision
    /// 3/4, recall 5/6 (the last true pixel is three columns away).
    #[test]
    fn a_case_by_hand() {
        let real = [
            "oooo....oo..",
            "............",
            ".......ooo..",
            "............",
            "............",
            "............",
            "######......",
        ];
        let said = [
            "ooooo.......",
            "............",
            ".....ooo....",
            "#...........",
            "............",
            "............",
            "###.........",
        ];
        let scored = scored(&marks(&said), &truth(&real), 1);
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        close(scored.terms.pores, 0.5);
        close(scored.terms.porosity, 6.0 / 7.0);
        close(scored.terms.cracks, 2.0 * 0.75 * (5.0 / 6.0) / (0.75 + 5.0 / 6.0));
        let mean = (0.5 + 6.0 / 7.0 + 2.0 * 0.75 * (5.0 / 6.0) / (0.75 + 5.0 / 6.0)) / 3.0;
        assert!((scored.score - 100.0 * mean).abs() < 1e-9);
        let tally = Tally::of(&drawn(&said, b'o'), &drawn(&real, b'o')).unwrap().score();
        close(scored.terms.pores, tally.f1.unwrap());
        close(scored.terms.porosity, 1.0 - tally.porosity_error.unwrap());
    }

    #[test]
    fn what_a_case_has_not_does_not_count() {
        let cracked = truth(&["....", "####", "...."]);
        let porous = truth(&["ooo.", "....", "...."]);
        let both = marks(&["ooo.", "....", "####"]);
        let [a, b] = [scored(&both, &cracked, 1), scored(&both, &porous, 1)];
        assert_eq!([a.terms.pores, a.terms.cracks, a.terms.porosity], [None, Some(1.0), None]);
        assert_eq!([b.terms.pores, b.terms.cracks, b.terms.porosity], [Some(1.0), None, Some(1.0)]);
        assert_eq!((a.score, a.ci95), (100.0, [100.0; 2]));
        let nothing = scored(&marks(&["....", "....", "...."]), &cracked, 1);
        assert_eq!(nothing.score, 0.0);
        // Twice too much air is no worse than none.
        let flood = scored(&marks(&["oooo", "oooo", "oooo"]), &porous, 1);
        assert_eq!(flood.terms.porosity, Some(0.0));
    }
}
