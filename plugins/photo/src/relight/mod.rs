//! The light taken off: what of a photograph is reflectance.
//!
//! A photograph is y = e·v·Σ_k a_k L_k: L_k is the picture of the scene with lamp k alone, as our
//! walks find it; how brightly each burnt (a_k, by channel: white balance is in it), and what the
//! lens took away at the rim (v), are fitted with a loss by which damage does not count. The
//! quotient of the photograph and of what is expected corrects the reflectance: ρ ← ρ y/ŷ.
//!
//! Reflectance is relative: (ρ, a) and (cρ, a/c) give the same direct light. As a whole it stays
//! where the scene has it.

mod fit;
mod frame;
mod lamps;
mod map;
mod merge;
mod noise;
mod pictures;
mod record;
mod smooth;

use glam::Vec3;
use intrados_scene::Scene;
use intrados_stage::{Cancelled, Job};
use rayon::prelude::*;

use crate::{Located, Photograph, Site};
use fit::{Fit, Sample, vignetting};
use frame::Frame;
use lamps::Source;
use noise::Noise;
use pictures::Picture;

pub use map::ReflectanceMap;
pub use merge::{Merged, merged};
pub use record::{LampRecord, RelitRecord};

/// Tiles of the frame within which residuals go together, pixels.
const TILE: usize = 16;
/// Most lamps.
const MOST_LAMPS: usize = 24;
/// Fewest pixels by which anything is fitted.
const FEWEST: usize = 100;
/// Sine of the angle between two lamps' pictures below which they are one.
const ALIKE: f64 = 0.1;
/// A lamp that brings less than this share of all light to what is seen does not reach it.
const UNSEEN: f64 = 1e-4;
/// Share of a piece's median light below which it lies in the shadow.
const SHADOW: f64 = 0.03;
/// Light that is known worse than this (standard error of its logarithm) is unknown.
const VAGUE: f64 = 0.5;
/// Reflectance is not corrected again once that changes light by less than this share.
const SETTLED: f64 = 0.01;
/// Fewest pixels by which an object's reflectance is corrected, and by how much at most.
const CORRECTED: usize = 50;
const MOST_CORRECTED: f64 = 4.0;

/// Which light is taken off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Light {
    /// All of it.
    #[default]
    All,
    /// What comes from the lamps without being reflected on its way: for comparison.
    Direct,
}

/// How light is computed and what of the scene may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct RelightSettings {
    /// Pixels of the longer side of the pictures of light.
    pub longest: u32,
    /// Walks a pixel and lamp.
    pub samples: u64,
    /// Seed of the walks.
    pub seed: u64,
    /// Most times that light is computed, each with the reflectance that the one before found.
    pub rounds: u32,
    /// How far shadows may lie from where the scene has them, m: standard error.
    pub shadow_error_m: f64,
    /// Which light is taken off.
    pub light: Light,
}

impl Default for RelightSettings {
    fn default() -> Self {
        Self {
            longest: 256,
            samples: 64,
            seed: 1,
            rounds: 3,
            shadow_error_m: 0.02,
            light: Light::All,
        }
    }
}

/// Why a photograph keeps its light.
#[derive(Debug, thiserror::Error)]
pub enum RelightError {
    /// No lamp.
    #[error(
        "no lamp of the scene reaches what it shows: add the lamps, the sky or the sun that burnt when it was taken"
    )]
    Dark,
    /// Too many.
    #[error(
        "the scene has {0} lamps of different kinds, {MOST_LAMPS} at most can be told apart: give those that burn alike one material"
    )]
    Lamps(usize),
    /// Nothing to see.
    #[error(
        "only {0} of its pixels show one surface of the scene and are neither burnt out nor black, {FEWEST} are needed: expose it otherwise, or go nearer"
    )]
    Few(usize),
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Lamps that were fitted as one.
#[derive(Debug, Clone)]
struct Group {
    names: Vec<String>,
    /// Indices among the sources.
    of: Vec<usize>,
}

/// What light fell on what a photograph shows.
#[derive(Debug, Clone)]
pub struct Relit {
    frame: Frame,
    noise: Noise,
    groups: Vec<Group>,
    unseen: Vec<String>,
    fit: Fit,
    /// By pixel of the frame: ŷ over the reflectance that it was computed with, by channel, and the
    /// variance of its logarithm; NaN where light is unknown.
    expected: Vec<[f64; 6]>,
    /// Share of the frame's pixels that show members' faces of which nothing is known.
    unknown: f64,
    rounds: u32,
    reflected_share: f64,
    samples: u64,
}

/// Takes stock of the light on what a photograph shows: renders the scene with each lamp alone,
/// and fits them.
///
/// # Errors
/// [`RelightError`]: no light, too little to see, too many lamps, or cancelled.
pub fn relight(
    site: &Site,
    scene: &Scene,
    (photograph, located): (&Photograph, &Located),
    settings: &RelightSettings,
    job: &Job,
) -> Result<Relit, RelightError> {
    let mut even = lamps::evened(scene);
    let sources = lamps::of(scene);
    if sources.len() > MOST_LAMPS {
        return Err(RelightError::Lamps(sources.len()));
    }
    let frame = Frame::new(site, located, settings.longest, job)?;
    let averaged = frame.averaged(photograph);
    let camera = frame.camera(&located.pose);
    let mut round = 0;
    loop {
        let pictures =
            pictures::taken(&even, &sources, &frame, &camera, settings, u64::from(round), job)?;
        let (groups, unseen) = grouped(&frame, &sources, &pictures);
        if groups.is_empty() {
            return Err(RelightError::Dark);
        }
        let samples = samples(&frame, &averaged, &groups, &pictures);
        let known: Vec<Sample> = samples.iter().flatten().cloned().collect();
        if known.len() < FEWEST {
            return Err(RelightError::Few(known.len()));
        }
        let fit = Fit::new(&known, groups.len());
        let reflected_share = reflected_share(&frame, &groups, &pictures, &fit);
        round += 1;
        let by = corrections(&frame, &samples, &fit, even.objects.len());
        let change = by.iter().map(|f| f.map(|f| f.ln().abs()).max_element()).fold(0.0, f32::max);
        if round >= settings.rounds || f64::from(change) * reflected_share < SETTLED {
            let mut expected = expected(&frame, &groups, &pictures, &fit, located, settings);
            for (expected, shown) in expected.iter_mut().zip(&frame.shown) {
                let Some(shown) = shown else { continue };
                let colour = even.materials[shown.piece.object as usize].base_colour;
                (0..3).for_each(|c| expected[c] /= f64::from(colour[c]).max(1e-4));
            }
            let unknown = unknown(&frame, &averaged, &expected);
            let noise = Noise::of(photograph);
            let samples = settings.samples;
            return Ok(Relit {
                frame,
                noise,
                groups,
                unseen,
                fit,
                expected,
                unknown,
                rounds: round,
                reflected_share,
                samples,
            });
        }
        for (material, by) in even.materials.iter_mut().zip(by) {
            material.base_colour = (material.base_colour * by).min(Vec3::splat(0.98));
        }
    }
}

/// Lamps that pictures tell apart, and the names of those that do not reach what is seen.
fn grouped(frame: &Frame, sources: &[Source], pictures: &[Picture]) -> (Vec<Group>, Vec<String>) {
    let seen: Vec<usize> = (0..frame.shown.len()).filter(|k| frame.shown[*k].is_some()).collect();
    let all = |k: usize| pictures.iter().map(|p| p.field.mean[k].iter().sum::<f64>()).sum::<f64>();
    // Shares of all light at each pixel, so that bright places count no more than dark ones.
    let share = |l: usize, k: usize| {
        let all = all(k);
        if all > 0.0 { pictures[l].field.mean[k].map(|v| v / all) } else { [0.0; 3] }
    };
    let dot = |a: usize, b: usize| {
        let at = |k: &usize| {
            let (a, b) = (share(a, *k), share(b, *k));
            (0..3).map(|c| a[c] * b[c]).sum::<f64>()
        };
        seen.iter().map(at).sum::<f64>()
    };
    let mut groups: Vec<Group> = Vec::new();
    let mut unseen = Vec::new();
    for (l, source) in sources.iter().enumerate() {
        let own = dot(l, l);
        let sum: f64 = seen.iter().map(|k| share(l, *k).iter().sum::<f64>()).sum();
        if sum < UNSEEN * seen.len() as f64 || own <= 0.0 {
            unseen.push(source.name.clone());
            continue;
        }
        let alike = |group: &&mut Group| {
            let first = group.of[0];
            let cosine = dot(l, first) / (own * dot(first, first)).sqrt();
            1.0 - cosine * cosine < ALIKE * ALIKE
        };
        match groups.iter_mut().find(alike) {
            Some(group) => {
                group.names.push(source.name.clone());
                group.of.push(l);
            }
            None => groups.push(Group { names: vec![source.name.clone()], of: vec![l] }),
        }
    }
    (groups, unseen)
}

/// Light of each group at a pixel.
fn light(groups: &[Group], pictures: &[Picture], k: usize) -> Vec<[f64; 3]> {
    let of = |group: &Group| {
        let add = |sum: [f64; 3], l: &usize| {
            let mean = pictures[*l].field.mean[k];
            [0, 1, 2].map(|c| sum[c] + mean[c])
        };
        group.of.iter().fold([0.0; 3], add)
    };
    groups.iter().map(of).collect()
}

/// What is fitted, by pixel: where one piece is shown, well exposed, and any lamp reaches it.
fn samples(
    frame: &Frame,
    averaged: &[Option<[f64; 3]>],
    groups: &[Group],
    pictures: &[Picture],
) -> Vec<Option<Sample>> {
    let columns = frame.size[0];
    let of = |k: usize| {
        frame.shown[k]?;
        let y = averaged[k].filter(|y| y.iter().all(|y| *y > 0.0))?;
        let light = light(groups, pictures, k);
        let is_lit = (0..3).all(|c| light.iter().any(|l| l[c] > 0.0));
        let tile = (k / columns / TILE * columns.div_ceil(TILE) + k % columns / TILE) as u32;
        let radius2 = frame.radius2(frame.middle(k));
        is_lit.then_some(Sample { y, light, radius2, tile })
    };
    (0..frame.shown.len()).map(of).collect()
}

/// Share of light on members that was reflected on its way.
fn reflected_share(frame: &Frame, groups: &[Group], pictures: &[Picture], fit: &Fit) -> f64 {
    let (mut reflected, mut all) = (0.0, 0.0);
    for (k, _) in
        frame.shown.iter().enumerate().filter(|(_, s)| s.is_some_and(|s| s.piece.member.is_some()))
    {
        for (group, a) in groups.iter().zip(&fit.strength) {
            for c in 0..3 {
                reflected +=
                    group.of.iter().map(|l| a[c] * pictures[*l].reflected[k][c]).sum::<f64>();
                all += group.of.iter().map(|l| a[c] * pictures[*l].field.mean[k][c]).sum::<f64>();
            }
        }
    }
    if all > 0.0 { (reflected / all).clamp(0.0, 1.0) } else { 0.0 }
}

/// By what each object's reflectance is off, as one factor a channel: the median of y/ŷ. As a
/// whole, over all that is seen, it stays as it is, since only relative reflectance is known.
fn corrections(frame: &Frame, samples: &[Option<Sample>], fit: &Fit, objects: usize) -> Vec<Vec3> {
    let mut ratios: Vec<[Vec<f64>; 3]> = vec![Default::default(); objects];
    for (sample, shown) in samples.iter().zip(&frame.shown) {
        let (Some(sample), Some(shown)) = (sample, shown) else { continue };
        let expected = fit.expected(sample);
        for c in 0..3 {
            if expected[c] > 0.0 {
                ratios[shown.piece.object as usize][c].push((sample.y[c] / expected[c]).ln());
            }
        }
    }
    let median = |mut of: Vec<f64>| {
        let n = of.len();
        let most = MOST_CORRECTED.ln();
        let known = n >= CORRECTED;
        known.then(|| {
            (n as f64, of.select_nth_unstable_by(n / 2, f64::total_cmp).1.clamp(-most, most))
        })
    };
    let logs: Vec<[Option<(f64, f64)>; 3]> = ratios.into_iter().map(|of| of.map(median)).collect();
    let level: [f64; 3] = std::array::from_fn(|c| {
        let (sum, n) =
            logs.iter().filter_map(|l| l[c]).fold((0.0, 0.0), |(s, m), (n, l)| (s + n * l, m + n));
        if n > 0.0 { sum / n } else { 0.0 }
    });
    let factor = |l: [Option<(f64, f64)>; 3]| {
        Vec3::from([0, 1, 2].map(|c| l[c].map_or(1.0, |(_, l)| (l - level[c]).exp() as f32)))
    };
    logs.into_iter().map(factor).collect()
}

/// ŷ and the variance of its logarithm by pixel; NaN in shadows and where it is vague.
fn expected(
    frame: &Frame,
    groups: &[Group],
    pictures: &[Picture],
    fit: &Fit,
    located: &Located,
    settings: &RelightSettings,
) -> Vec<[f64; 6]> {
    let light: Vec<Vec<[f64; 3]>> =
        (0..frame.shown.len()).into_par_iter().map(|k| light(groups, pictures, k)).collect();
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
        if (3..6).any(|c| !(found[c] < VAGUE * VAGUE)) { unknown } else { found }
    };
    (0..lit.len()).into_par_iter().map(at).collect()
}

/// Share of the pixels that show a member's face of which nothing can be said.
fn unknown(frame: &Frame, averaged: &[Option<[f64; 3]>], expected: &[[f64; 6]]) -> f64 {
    let faces: Vec<usize> = (0..frame.shown.len()).filter(|k| frame.has_face[*k]).collect();
    let dark = faces.iter().filter(|k| averaged[**k].is_none() || !expected[**k][0].is_finite());
    dark.count() as f64 / faces.len().max(1) as f64
}

/// Light of a piece below which it lies in the shadow.
fn shadows(frame: &Frame, lit: &[[f64; 3]]) -> impl Fn(&crate::site::Piece) -> f64 + Sync {
    let mut of: std::collections::BTreeMap<_, Vec<f64>> = std::collections::BTreeMap::new();
    for (shown, lit) in frame.shown.iter().zip(lit) {
        if let Some(shown) = shown {
            of.entry(shown.piece).or_default().push(lit.iter().sum());
        }
    }
    let median = |mut all: Vec<f64>| {
        let middle = all.len() / 2;
        SHADOW * *all.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let limits: std::collections::BTreeMap<_, f64> =
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
