//! Bars in a slice: how much of the steel that was laid is left.
//!
//! A bar ends half way between the grey of concrete and that of solid steel (what CT metrology
//! calls iso 50). Pixels between a quarter and three quarters of the way count in part, so that
//! areas are finer than pixels, while glow around steel and the dark hearts of thick bars count for
//! nothing. Rust that has stayed at a bar is brighter than concrete and moves that edge outward; how
//! much of it has stayed nobody knows. The sum over all bars is set against what was laid, which needs no match of places.
//! Where what shows cannot be the bars that were laid, nothing is said, which is not the same as no
//! loss.

use intrados_raster::grid::median;
use intrados_stage::Estimate;
use serde::{Deserialize, Serialize};

use crate::{detect::Detection, slice::Slice};
use intrados_raster::grid::{Grid, Mask};

/// Rolled bars weigh up to so much more or less than their nominal mass (EN 10080:2005, 7.3.2,
/// diameters above 8 mm), equally likely anywhere within and alike in all bars of a delivery.
const ROLLED: f64 = 0.045;

/// Standard error of where the edges of all bars of a slice lie, pixels: .05 and .32 in two slices
/// of a simulated scan (`scan scenes/column.ron --member C4 --along 0.12 --along 0.6`).
const EDGE: f64 = 0.2;

/// Relative standard error of the edge of a pixel.
const PIXEL: f64 = 0.005;

/// Share of the loss that rust hides where it is thin beside the blur: its volume over that of the
/// steel (2, of what stays at a bar) times its contrast over that of steel (3600 kg/m³ with 63 % of
/// iron, .24 of it between 150 and 300 keV).
const HIDDEN: f64 = 0.48;

/// How far it moves an edge where it is thick, pixels: to where a blurred edge between steel and
/// rust is half way from steel to concrete, .4 of the blur's standard deviation.
const RUST_EDGE: f64 = 0.4;

/// How far around a bar's bright pixels its edge may lie, and how deep within everything is steel,
/// pixels.
const REACH: f32 = 2.0;

/// Bars thinner than so many pixels show nowhere what solid steel looks like.
const THINNEST: f64 = 6.0;

/// Bright specks are smaller than this share of a bar, and what is larger than so many of the
/// largest with their glow is another thing.
const BAR: std::ops::Range<f64> = 0.1..2.0;

/// Bright streaks are paler than this share of the grey of all that is bright.
const PALE: f32 = 0.7;

/// The bars of one slice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Steel {
    /// Bars that show.
    pub bars: usize,
    /// Bars that were laid.
    pub laid: usize,
    /// Their area by the slice, mm².
    pub area_mm2: f64,
    /// Their nominal area, mm².
    pub laid_mm2: f64,
    /// Share of it that is lost, from 0.
    pub loss: Estimate,
}

/// Measures the bars of a slice of a whole section in which bars of the areas `laid` (pixels) were
/// laid; `None` where it does not show them: none or too thin a bar, metal that is masked out or
/// cannot be they.
#[must_use]
pub fn steel(slice: &Slice, found: &Detection, laid: &[f64]) -> Option<Steel> {
    let [least, most] =
        [f64::min as fn(f64, f64) -> f64, f64::max].map(|pick| laid.iter().copied().reduce(pick));
    let (least, most) = (least?, most?);
    if 4.0 * least < std::f64::consts::PI * THINNEST * THINNEST {
        return None;
    }
    let (metal, bars) = bright(&slice.grey, found, BAR.start * least);
    let are_bars = bars.iter().all(|&area| area < BAR.end * most)
        && bars.len() <= laid.len()
        && 2 * bars.len() >= laid.len();
    let area = if are_bars { area(&slice.grey, found, &metal)? } else { return None };
    let all: f64 = laid.iter().sum();
    let left = area / all;
    let around = bars.iter().map(|&area| 2.0 * (std::f64::consts::PI * area).sqrt()).sum::<f64>();
    let rusted = rusted((1.0 - left).clamp(0.0, 1.0), around / all);
    // Alike in all bars: their rolling, the pixel, and where edges lie on a circumference of 2 √(π
    // area) each.
    let std_error = (left * ROLLED / 3.0_f64.sqrt())
        .hypot(left * 2.0 * PIXEL)
        .hypot(EDGE * around / all)
        .hypot(rusted.std_error);
    let mm2 = f64::from(slice.pixel_mm).powi(2);
    let loss = Estimate { value: rusted.value, std_error };
    Some(Steel {
        bars: bars.len(),
        laid: laid.len(),
        area_mm2: area * mm2,
        laid_mm2: all * mm2,
        loss,
    })
}

/// The loss behind what an edge half way to concrete says: that itself where the rust has gone, more
/// where it is still there; equally likely anywhere between. `around`: length of edges over area,
/// 1/pixel.
fn rusted(lost: f64, around: f64) -> Estimate {
    let hidden = (lost / (1.0 - HIDDEN)).min(lost + RUST_EDGE * around).min(1.0) - lost;
    Estimate { value: lost + 0.5 * hidden, std_error: hidden / 12.0_f64.sqrt() }
}

/// The metal that shows, and the pixels of each of its pieces that is no speck and no streak.
fn bright(grey: &Grid<f32>, found: &Detection, least: f64) -> (Mask, Vec<f64>) {
    let metal = Mask {
        data: found.seen.data.iter().zip(&found.body.data).map(|(&s, &b)| s && !b).collect(),
        ..found.seen
    };
    let mut pieces = metal.components().members;
    let middle = |pixels: &[usize]| median(pixels.iter().map(|&i| grey.data[i])).unwrap_or(0.0);
    let level = middle(&pieces.concat());
    pieces.retain(|pixels| pixels.len() as f64 >= least && middle(pixels) > PALE * level);
    let mut bars = Mask::new(metal.width, metal.height, false);
    pieces.iter().flatten().for_each(|&i| bars.data[i] = true);
    (bars, pieces.iter().map(|pixels| pixels.len() as f64).collect())
}

/// Area of the steel, pixels; `None` where a slice shows no solid steel or no concrete around it.
fn area(grey: &Grid<f32>, found: &Detection, metal: &Mask) -> Option<f64> {
    let (depth, away) = (metal.distance(), metal.map(|m| !m).distance_within());
    let sound =
        |i: usize| found.body.data[i] && found.labels.data[i] == 0 && !found.crack_mask.data[i];
    let around = |i: &usize| sound(*i) && (REACH + 1.0..REACH + 5.0).contains(&away.data[*i]);
    let all = 0..grey.data.len();
    let concrete = median(all.clone().filter(around).map(|i| grey.data[i]))?;
    let solid = median(all.clone().filter(|&i| depth.data[i] > REACH).map(|i| grey.data[i]))?;
    let share = |i: usize| match depth.data[i] > REACH {
        true => 1.0,
        false => {
            (2.0 * f64::from((grey.data[i] - concrete) / (solid - concrete)) - 0.5).clamp(0.0, 1.0)
        }
    };
    let near = all.filter(|&i| found.seen.data[i] && away.data[i] <= REACH);
    (solid > concrete).then(|| near.map(share).sum())
}
