//! The light taken off: what of a photograph is reflectance.
//!
//! A photograph is y = e·v·Σ_k a_k L_k: L_k is the picture of the scene with lamp k alone, as our
//! walks find it; how brightly each burnt (a_k, by channel: white balance is in it), and what the
//! lens took away at the rim (v), are fitted with a loss by which damage does not count. The
//! quotient of the photograph and of what is expected corrects the reflectance: ρ ← ρ y/ŷ.
//!
//! Reflectance is relative: (ρ, a) and (cρ, a/c) give the same direct light. As a whole it stays
//! where the scene has it.

mod expected;
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

use crate::{Located, Photograph, Site};
use fit::{Fit, Sample};
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
    /// The scene evenly coloured, its lamps as bright as they were found.
    burning: Scene,
    /// By pixel of the frame: ŷ over the reflectance that it was computed with, by channel, and the
    /// variance of its logarithm; NaN where light is unknown.
    expected: Vec<[f64; 6]>,
    /// Share of the frame's pixels that show members' faces of which nothing is known.
    unknown: f64,
    rounds: u32,
    reflected_share: f64,
    samples: u64,
}

impl Relit {
    /// The scene as it was lit: evenly coloured as was found, every lamp as bright as it was, in
    /// units of the photograph.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.burning
    }
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
            let mut expected = expected::light(&frame, &groups, &pictures, &fit, located, settings);
            for (expected, shown) in expected.iter_mut().zip(&frame.shown) {
                let Some(shown) = shown else { continue };
                let colour = even.materials[shown.piece.object as usize].base_colour;
                (0..3).for_each(|c| expected[c] /= f64::from(colour[c]).max(1e-4));
            }
            let unknown = expected::unknown(&frame, &averaged, &expected);
            let noise = Noise::of(photograph);
            let samples = settings.samples;
            let burning = lamps::burning(&even, &found(&sources, &groups, &fit));
            return Ok(Relit {
                frame,
                noise,
                groups,
                unseen,
                fit,
                burning,
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

/// Each lamp that was seen and how brightly it burnt.
fn found(sources: &[Source], groups: &[Group], fit: &Fit) -> Vec<(Source, Vec3)> {
    let of = |(group, a): (&Group, &[f64; 3])| {
        let by = Vec3::from(a.map(|a| a.max(0.0) as f32));
        group.of.iter().map(|&l| (sources[l].clone(), by)).collect::<Vec<_>>()
    };
    groups.iter().zip(&fit.strength).flat_map(of).collect()
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
fn of_groups(groups: &[Group], pictures: &[Picture], k: usize) -> Vec<[f64; 3]> {
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
        let light = of_groups(groups, pictures, k);
        let is_lit = (0..3).all(|c| light.iter().any(|l| l[c] > 0.0));
        let tile = (k / columns / TILE * columns.div_ceil(TILE) + k % columns / TILE) as u32;
        let radius2 = frame.radius2(frame.middle(k));
        is_lit.then_some(Sample { y, light, radius2, tile })
    };
    (0..frame.shown.len()).map(of).collect()
}

/// Share of light on members that was reflected on its way.
fn reflected_share(frame: &Frame, groups: &[Group], pictures: &[Picture], fit: &Fit) -> f64 {
    let is_member = |k: &usize| frame.shown[*k].is_some_and(|s| s.piece.member.is_some());
    let members: Vec<usize> = (0..frame.shown.len()).filter(is_member).collect();
    let (mut reflected, mut all) = (0.0, 0.0);
    for (group, a) in groups.iter().zip(&fit.strength) {
        let sum = |of: &[[f64; 3]]| {
            let at = |k: &usize| of[*k].iter().zip(a).map(|(l, a)| l * a).sum::<f64>();
            members.iter().map(at).sum::<f64>()
        };
        for picture in group.of.iter().map(|l| &pictures[*l]) {
            reflected += sum(&picture.reflected);
            all += sum(&picture.field.mean);
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
