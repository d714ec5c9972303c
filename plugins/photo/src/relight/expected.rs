//! What light a photograph is expected to have, and how well that is known.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{
    Group, RelightSettings,
    fit::{Fit, vignetting},
    frame::Frame,
    of_groups,
    pictures::Picture,
};
use crate::{Located, site::Piece};

/// Share of a piece's median light below which it lies in the shadow.
const SHADOW: f64 = 0.03;
/// Light that is known worse than this (standard error of its logarithm) is unknown.
const VAGUE: f64 = 0.5;

/// ŷ and the variance of its logarithm by pixel; NaN in shadows and where it is vague.
pub(super) fn light(
    frame: &Frame,
    groups: &[Group],
    pictures: &[Picture],
    fit: &Fit,
    located: &Located,
    settings: &RelightSettings,
) -> Vec<[f64; 6]> {
    let light: Vec<Vec<[f64; 3]>> =
        (0..frame.shown.len()).into_par_iter().map(|k| of_groups(groups, pictures, k)).collect();
    let lit: Vec<[f64; 3]> = light
        .iter()
        .map(|light| {
            light
                .iter()
                .zip(&fit.strength)
                .fold([0.0; 3], |sum, (l, a)| [0, 1, 2].map(|c| sum[c] + a[c] * l[c]))
        })
        .collect();
    let shadow = shadows(frame, &lit);
    let at = |k: usize| {
        let unknown = [f64::NAN; 6];
        let Some(shown) = frame.shown[k] else { return unknown };
        if lit[k].iter().sum::<f64>() <= shadow(&shown.piece) || lit[k].iter().any(|l| *l <= 0.0) {
            return unknown;
        }
        let radius2 = frame.radius2(frame.middle(k));
        let v = vignetting(fit.bends, radius2);
        let shift = shifted(frame, &lit, k, located, settings.shadow_error_m);
        let mut found = unknown;
        for c in 0..3 {
            let walks: f64 = groups
                .iter()
                .zip(&fit.strength)
                .flat_map(|(group, a)| group.of.iter().map(move |l| (l, a[c])))
                .map(|(l, a)| a * a * pictures[*l].field.variance[k][c])
                .sum::<f64>()
                / lit[k][c].powi(2);
            found[c] = v * lit[k][c];
            found[3 + c] = walks + fit.variance(&light[k], c, radius2) + shift[c];
        }
        let is_sure = found[3..].iter().all(|variance| *variance < VAGUE * VAGUE);
        if is_sure { found } else { unknown }
    };
    (0..lit.len()).into_par_iter().map(at).collect()
}

/// Share of the pixels that show a member's face of which nothing can be said.
pub(super) fn unknown(frame: &Frame, averaged: &[Option<[f64; 3]>], expected: &[[f64; 6]]) -> f64 {
    let faces: Vec<usize> = (0..frame.shown.len()).filter(|k| frame.has_face[*k]).collect();
    let dark = faces.iter().filter(|k| averaged[**k].is_none() || !expected[**k][0].is_finite());
    dark.count() as f64 / faces.len().max(1) as f64
}

/// Light of a piece below which it lies in the shadow.
fn shadows(frame: &Frame, lit: &[[f64; 3]]) -> impl Fn(&Piece) -> f64 + Sync {
    let mut of: BTreeMap<_, Vec<f64>> = BTreeMap::new();
    for (shown, lit) in frame.shown.iter().zip(lit) {
        if let Some(shown) = shown {
            of.entry(shown.piece).or_default().push(lit.iter().sum());
        }
    }
    let median = |mut all: Vec<f64>| {
        let middle = all.len() / 2;
        SHADOW * *all.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let limits: BTreeMap<_, f64> =
        of.into_iter().map(|(piece, all)| (piece, median(all))).collect();
    move |piece| limits.get(piece).copied().unwrap_or(0.0)
}

/// Variance of log ŷ because it may belong to another place: by its slope where that is a matter of
/// the pose or lies within a pixel, by the largest step within the stated error of shadows.
fn shifted(
    frame: &Frame,
    lit: &[[f64; 3]],
    k: usize,
    located: &Located,
    shadow_error_m: f64,
) -> [f64; 3] {
    let Some(shown) = frame.shown[k] else { return [0.0; 3] };
    let pixels_m =
        located.pose.focal_px / located.pose.position.distance(shown.place) / frame.scale;
    let reach = (shadow_error_m * pixels_m).min(24.0);
    let (mut moment, mut slope) = ([0.0_f64; 3], [[0.0_f64; 2]; 3]);
    let mut step = [0.0_f64; 3];
    for (q, [i, j]) in frame.around(k, (reach.ceil() as usize).max(1)) {
        let log: [f64; 3] =
            [0, 1, 2].map(|c| if lit[q][c] > 0.0 { (lit[q][c] / lit[k][c]).ln() } else { 1.0 });
        if i * i + j * j <= reach * reach {
            (0..3).for_each(|c| step[c] = step[c].max(log[c].abs()));
        }
        if i.abs() <= 1.0 && j.abs() <= 1.0 {
            moment = [moment[0] + i * i, moment[1] + i * j, moment[2] + j * j];
            (0..3).for_each(|c| slope[c] = [slope[c][0] + i * log[c], slope[c][1] + j * log[c]]);
        }
    }
    let [xx, xy, yy] = moment;
    let det = xx * yy - xy * xy;
    // Half a pixel's width, evenly: 1/12.
    let cover = [shown.shift[0] + 1.0 / 12.0, shown.shift[1], shown.shift[2] + 1.0 / 12.0];
    [0, 1, 2].map(|c| {
        let by_slope = if det > 0.0 {
            let [x, y] = slope[c];
            let [gx, gy] = [(yy * x - xy * y) / det, (xx * y - xy * x) / det];
            // Steps within a fraction of a pixel go as the slope does.
            let wide = if reach < 1.0 { reach * reach } else { 0.0 };
            gx * gx * (cover[0] + wide) + 2.0 * gx * gy * cover[1] + gy * gy * (cover[2] + wide)
        } else {
            0.0
        };
        by_slope + if reach >= 1.0 { step[c].powi(2) } else { 0.0 }
    })
}
