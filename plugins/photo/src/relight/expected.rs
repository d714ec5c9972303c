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
    let walks = |k: usize| {
        let shares = || {
            groups.iter().zip(&fit.strength).flat_map(|(g, a)| g.of.iter().map(move |l| (*l, a)))
        };
        [0, 1, 2].map(|c| {
            let of = |(l, a): (usize, &[f64; 3])| a[c] * a[c] * pictures[l].field.variance[k][c];
            shares().map(of).sum::<f64>() / lit[k][c].powi(2)
        })
    };
    let around = Around {
        frame,
        log: lit.iter().map(|lit| lit.map(|l| (l > 0.0).then(|| l.ln()))).collect(),
        walks: (0..lit.len()).map(walks).collect(),
    };
    let at = |k: usize| {
        let unknown = [f64::NAN; 6];
        let Some(shown) = frame.shown[k] else { return unknown };
        if lit[k].iter().sum::<f64>() <= shadow(&shown.piece) || lit[k].iter().any(|l| *l <= 0.0) {
            return unknown;
        }
        let radius2 = frame.radius2(frame.middle(k));
        let v = vignetting(fit.bends, radius2);
        let shift = around.shifted(k, located, settings.shadow_error_m);
        let mut found = unknown;
        for c in 0..3 {
            found[c] = v * lit[k][c];
            found[3 + c] = around.walks[k][c] + fit.variance(&light[k], c, radius2) + shift[c];
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

/// What is known of ŷ about a pixel.
struct Around<'a> {
    frame: &'a Frame,
    /// ln ŷ; none where no light falls.
    log: Vec<[Option<f64>; 3]>,
    /// Its variance by the walks.
    walks: Vec<[f64; 3]>,
}

/// A step is one where it exceeds so many standard errors of the walks' difference: the largest of
/// a thousand differences is about as large by chance.
const CHANCE: f64 = 3.0;

impl Around<'_> {
    /// Steps of ln ŷ from pixel k, with where they lead; into darkness they are 1.
    fn steps(&self, k: usize, reach: f64) -> impl Iterator<Item = ([f64; 2], [f64; 3])> {
        let log = move |q: usize, c: usize| match (self.log[q][c], self.log[k][c]) {
            (Some(there), Some(here)) => there - here,
            _ => 1.0,
        };
        let near = self.frame.around(k, (reach.ceil() as usize).max(1));
        near.map(move |(q, at)| (at, [0, 1, 2].map(|c| log(q, c))))
    }

    /// Variance of ln ŷ because it may belong to another place. By its slope where that is a matter
    /// of the pose or lies within a pixel; within the stated error of shadows by the mean square of
    /// the plane through its steps (shading that is evenly off) and by the largest step that this
    /// plane leaves (the edge of a shadow).
    fn shifted(&self, k: usize, located: &Located, shadow_error_m: f64) -> [f64; 3] {
        let Some(shown) = self.frame.shown[k] else { return [0.0; 3] };
        let pixels_m =
            located.pose.focal_px / located.pose.position.distance(shown.place) / self.frame.scale;
        let reach = (shadow_error_m * pixels_m).min(24.0);
        let next = plane(self.steps(k, 1.0));
        // Half a pixel's width, evenly: 1/12. Steps within a fraction of a pixel go as the slope
        // does.
        let wide = if reach < 1.0 { reach * reach } else { 0.0 } + 1.0 / 12.0;
        let cover = [shown.shift[0] + wide, shown.shift[1], shown.shift[2] + wide];
        let mut shifted =
            next.map(|[x, y]| x * x * cover[0] + 2.0 * x * y * cover[1] + y * y * cover[2]);
        if reach >= 1.0 {
            let within =
                || self.steps(k, reach).filter(|([i, j], _)| i * i + j * j <= reach * reach);
            let even = plane(within());
            let mut step = [0.0_f64; 3];
            for ([i, j], log) in within() {
                (0..3).for_each(|c| {
                    step[c] = step[c].max((log[c] - i * even[c][0] - j * even[c][1]).abs());
                });
            }
            for c in 0..3 {
                let [x, y] = even[c];
                let edge = (step[c] - CHANCE * (2.0 * self.walks[k][c]).sqrt()).max(0.0);
                shifted[c] += 0.25 * reach * reach * (x * x + y * y) + edge * edge;
            }
        }
        shifted
    }
}

/// The slope of the plane through the middle that leaves least of the steps.
fn plane(steps: impl Iterator<Item = ([f64; 2], [f64; 3])>) -> [[f64; 2]; 3] {
    let (mut moment, mut slope) = ([0.0_f64; 3], [[0.0_f64; 2]; 3]);
    for ([i, j], log) in steps {
        moment = [moment[0] + i * i, moment[1] + i * j, moment[2] + j * j];
        (0..3).for_each(|c| slope[c] = [slope[c][0] + i * log[c], slope[c][1] + j * log[c]]);
    }
    let [xx, xy, yy] = moment;
    let det = xx * yy - xy * xy;
    slope.map(|[x, y]| match det > 0.0 {
        true => [(yy * x - xy * y) / det, (xx * y - xy * x) / det],
        false => [0.0; 2],
    })
}
