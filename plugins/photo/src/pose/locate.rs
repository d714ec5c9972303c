//! From picks to a pose: starts, fits, one wrong pick, and what cannot be.

use glam::DVec3;
use intrados_scene::Lens;
use nalgebra::{DMatrix, SMatrix};
use rayon::prelude::*;

use super::{
    Covariance, Pick, Pose,
    fit::{Fit, Loss, fit, residuals},
    start::starts,
};
use crate::taken::Focal;

/// What is known of a photograph before it is placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Of the picture, pixels.
    pub size: [u32; 2],
    /// Its focal length, where anything is known of it.
    pub focal: Option<Focal>,
    /// Its lens.
    pub lens: Lens,
    /// Standard error of the lens's k1; 0: known.
    pub k1_error: f64,
    /// Standard error of a pick in each direction, pixels.
    pub picking_px: f64,
}

/// Where a camera stood.
#[derive(Debug, Clone, PartialEq)]
pub struct Located {
    /// The pose.
    pub pose: Pose,
    /// Its covariance: by the error of picking, or by the residuals where these are larger.
    pub covariance: Covariance,
    /// Residual of each pick, to the right and down, pixels; of one that was left out too.
    pub residuals: Vec<[f64; 2]>,
    /// Root mean square of the distances of the picks that count, pixels.
    pub rms_px: f64,
    /// χ² of the picks that count over its degrees of freedom.
    pub reduced_chi2: f64,
    /// The pick that contradicts all others and was left out.
    pub left_out: Option<usize>,
    /// Another pose that fits nearly as well: the picks lie in a plane seen from far away. Pick a
    /// point out of it.
    pub other: Option<Pose>,
    /// What the model's edges in the photograph made of it, where they were asked.
    pub edges: Option<ByEdges>,
}

/// What the model's edges made of a pose that was picked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByEdges {
    /// Straight edges of members that the camera sees at some length.
    pub seen: usize,
    /// How many of them the photograph shows where one pose draws them.
    pub answered: usize,
    /// Root mean square of what these are off in the end, pixels.
    pub off_px: f64,
    /// Root mean square of how far the picked places moved in the picture, pixels.
    pub moved_px: f64,
    /// Why the picked pose was kept, in a few words; `None` where the edges improved it.
    pub kept: Option<&'static str>,
}

impl ByEdges {
    /// The same in one sentence.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { seen, answered, off_px, moved_px, kept } = self;
        match kept {
            None => format!(
                "{answered} of {seen} edges of the model that are in sight place it better: it moved by {moved_px:.1} px, and they are off by {off_px:.1} px"
            ),
            Some(why) => {
                format!("placed by the picks alone, since {why} ({answered} of {seen} in sight)")
            }
        }
    }
}

/// Why a photograph is not placed. One sentence each.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// Too few.
    #[error("{got} picks are too few: {needed} are needed {why}")]
    TooFew {
        /// How many there are.
        got: usize,
        /// How many it takes.
        needed: usize,
        /// With what is known.
        why: &'static str,
    },
    /// Too many.
    #[error("{0} picks are more than the {MOST} that are read: leave out some")]
    TooMany(usize),
    /// A number that cannot be.
    #[error("pick {0}: {1}")]
    Pick(usize, &'static str),
    /// They say too little.
    #[error("{0}")]
    Degenerate(&'static str),
    /// No camera sees them so.
    #[error(
        "no camera sees the picks so{}: is this the photograph of that member, are left and right exchanged, or picks of two members mixed up?",
        left(*rms_px, *picking_px)
    )]
    NoFit {
        /// Root mean square of the best, pixels; infinite where none has all of them before it.
        rms_px: f64,
        /// What was stated.
        picking_px: f64,
    },
    /// Seen through concrete.
    #[error(
        "the picks fit a camera that would see them through concrete alone: are left and right exchanged, or is it another member?"
    )]
    Hidden,
    /// Known too badly to be of use.
    #[error(
        "the picks leave the camera's place open by {error_m:.2} m at a distance of {distance_m:.1} m: pick points farther apart, out of one plane, or give the focal length"
    )]
    Open {
        /// Standard error, m.
        error_m: f64,
        /// From the picks' middle, m.
        distance_m: f64,
    },
}

fn left(rms_px: f64, picking_px: f64) -> String {
    if rms_px.is_finite() {
        format!(": the best leaves {rms_px:.1} px where {picking_px} px of picking are expected")
    } else {
        String::new()
    }
}

/// Largest χ² over its degrees of freedom that is a fit: three standard errors of picking.
const WORST: f64 = 9.0;
/// Another pose is worth mentioning while its χ² is no larger by more than this.
const RIVAL: f64 = 9.0;
/// Largest error of the place, as a share of the distance.
const OPEN: f64 = 0.2;
/// Most picks: nobody picks more by hand, and one wrong among them is looked for one by one.
const MOST: usize = 100;
/// How many starts are followed downhill.
const FOLLOWED: usize = 16;
/// Farthest place, m, as in scenes.
const FAR: f64 = 1e5;

/// Where the camera stood that drew places where they were picked: four picks with a focal length,
/// six without. One pick of six or more may be wrong and is left out. Of poses that fit, those
/// count that `admits` lets pass: that do not see through concrete, say.
///
/// # Errors
/// [`PoseError`].
pub fn locate(
    picks: &[Pick],
    prior: &Prior,
    admits: &(dyn Fn(&Pose) -> bool + Sync),
) -> Result<Located, PoseError> {
    check(picks, prior)?;
    let all = best(picks, prior, admits);
    if all.as_ref().is_ok_and(|(fit, _)| fits(fit, picks, prior)) || picks.len() < 6 {
        return told(all?, picks, None, prior);
    }
    // One of them may be wrong: the one without which the others agree, if there is only one.
    let without = |k: usize| -> Vec<Pick> {
        picks.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, pick)| *pick).collect()
    };
    let mut tried: Vec<(usize, Found)> = (0..picks.len())
        .into_par_iter()
        .filter(|&k| check(&without(k), prior).is_ok())
        .filter_map(|k| Some((k, best(&without(k), prior, admits).ok()?)))
        .collect();
    tried.sort_by(|(_, a), (_, b)| a.0.chi2.total_cmp(&b.0.chi2));
    let chi2 = |i: usize| tried.get(i).map_or(f64::INFINITY, |(_, found)| found.0.chi2);
    let is_alone = chi2(1) > 4.0 * chi2(0) + RIVAL;
    match tried.into_iter().next() {
        Some((k, found)) if is_alone && fits(&found.0, &without(k), prior) => {
            told(found, picks, Some(k), prior)
        }
        _ => told(all?, picks, None, prior),
    }
}

/// A fit, and another that is nearly as good.
type Found = (Fit, Option<Fit>);

fn fits(fit: &Fit, picks: &[Pick], prior: &Prior) -> bool {
    fit.chi2 <= WORST * freedom(picks, prior)
}

/// Degrees of freedom of χ²: what was known of f and k1 counts with what is unknown.
fn freedom(picks: &[Pick], prior: &Prior) -> f64 {
    let known = if prior.focal.is_some() { 2.0 } else { 1.0 };
    (2.0 * picks.len() as f64 + known - 8.0).max(1.0)
}

/// The best pose, and its rival if there is one.
fn best(
    picks: &[Pick],
    prior: &Prior,
    admits: &(dyn Fn(&Pose) -> bool + Sync),
) -> Result<Found, PoseError> {
    let robust = Loss::Robust(10.0 * prior.picking_px);
    let mut begun: Vec<(f64, Pose)> = focals(prior)
        .into_iter()
        .flat_map(|focal| starts(picks, focal, prior.lens, prior.size))
        .filter_map(|pose| Some((rough(&pose, picks, prior)?, pose)))
        .collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found: Vec<Fit> = Vec::new();
    let mut followed: Vec<Pose> = Vec::new();
    for (_, pose) in begun {
        if followed.len() >= FOLLOWED {
            break;
        }
        if followed.iter().any(|other| is_same(other, &pose, picks, 0.03)) {
            continue;
        }
        followed.push(pose);
        let near = fit(pose, picks, prior, robust).map_or(pose, |fit| fit.pose);
        found.extend(fit(near, picks, prior, Loss::Squares));
    }
    found.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let any_fits = found.first().is_some_and(|fit| fits(fit, picks, prior));
    let rms_px = found.first().and_then(|fit| rms(&fit.pose, picks)).unwrap_or(f64::INFINITY);
    let nothing = PoseError::NoFit { rms_px, picking_px: prior.picking_px };
    found.retain(|fit| admits(&fit.pose));
    match found.first().cloned() {
        Some(first) if fits(&first, picks, prior) || !any_fits => {
            let other = found.into_iter().skip(1).find(|fit| {
                fit.chi2 < first.chi2 + RIVAL && !is_same(&fit.pose, &first.pose, picks, 0.02)
            });
            Ok((first, other))
        }
        _ => Err(if any_fits { PoseError::Hidden } else { nothing }),
    }
}

/// Focal lengths to begin with, pixels: the one that is known, or from very wide to very long.
fn focals(prior: &Prior) -> Vec<f64> {
    let width = f64::from(prior.size[0].max(prior.size[1]));
    prior.focal.map_or_else(
        || (0..14).map(|k| 0.35 * width * 1.25_f64.powi(k)).collect(),
        |focal| vec![focal.px],
    )
}

/// How badly a start fits: three of its picks exactly, others by the noise of these, and a wrong
/// one not at all, so that distances count by their logarithm.
fn rough(pose: &Pose, picks: &[Pick], prior: &Prior) -> Option<f64> {
    let scale = (5.0 * prior.picking_px).powi(2);
    let off = residuals(pose, picks)?;
    Some(off.iter().map(|[x, y]| ((x * x + y * y) / scale).ln_1p()).sum())
}

/// Root mean square of the residuals, pixels.
fn rms(pose: &Pose, picks: &[Pick]) -> Option<f64> {
    let squares: f64 = residuals(pose, picks)?.iter().map(|[x, y]| x * x + y * y).sum();
    Some((squares / picks.len() as f64).sqrt())
}

/// Whether two poses are the same, to a share of the distance.
fn is_same(a: &Pose, b: &Pose, picks: &[Pick], share: f64) -> bool {
    let distance = a.position.distance(middle(picks));
    a.position.distance(b.position) < share * distance
}

fn middle(picks: &[Pick]) -> DVec3 {
    picks.iter().map(|pick| pick.place).sum::<DVec3>() / picks.len() as f64
}

/// The result, or why it is none.
fn told(
    (fit, other): Found,
    picks: &[Pick],
    left_out: Option<usize>,
    prior: &Prior,
) -> Result<Located, PoseError> {
    let counts: Vec<Pick> =
        picks.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, p)| *p).collect();
    let rms_px = rms(&fit.pose, &counts).unwrap_or(f64::INFINITY);
    let reduced_chi2 = fit.chi2 / freedom(&counts, prior);
    if reduced_chi2 > WORST {
        return Err(PoseError::NoFit { rms_px, picking_px: prior.picking_px });
    }
    let distance_m = fit.pose.position.distance(middle(&counts));
    let covariance = fit.covariance.map(|c| c * reduced_chi2.max(1.0));
    let error_m =
        covariance.map_or(f64::INFINITY, |c| c.fixed_view::<3, 3>(3, 3).trace().max(0.0).sqrt());
    let Some(covariance) = covariance.filter(|_| error_m < OPEN * distance_m) else {
        return Err(PoseError::Open { error_m, distance_m });
    };
    let located = Located {
        pose: fit.pose,
        covariance,
        residuals: Vec::new(),
        rms_px,
        reduced_chi2,
        left_out,
        other: other.map(|fit| fit.pose),
        edges: None,
    };
    Ok(located.with(fit.pose, picks))
}

/// Refuses what says nothing before anything is computed.
fn check(picks: &[Pick], prior: &Prior) -> Result<(), PoseError> {
    let (needed, why) = match prior.focal {
        Some(_) => (4, "with a focal length"),
        None => (6, "without a focal length (4 with one: --focal-px, or a photograph with EXIF)"),
    };
    if picks.len() < needed {
        return Err(PoseError::TooFew { got: picks.len(), needed, why });
    }
    if picks.len() > MOST {
        return Err(PoseError::TooMany(picks.len()));
    }
    let [width, height] = prior.size.map(f64::from);
    for (i, pick) in picks.iter().enumerate() {
        let [x, y] = pick.pixel;
        let fault = if !(pick.place.is_finite() && pick.place.abs().max_element() <= FAR) {
            "its place is no point within 100 km: give x, y, z in m"
        } else if !((0.0..=width).contains(&x) && (0.0..=height).contains(&y)) {
            "its pixel is outside the picture: count pixels of the upright photograph from its top left"
        } else if picks[..i].iter().any(|p| p.place == pick.place || p.pixel == pick.pixel) {
            "its place or its pixel was picked before: pick each once"
        } else {
            continue;
        };
        return Err(PoseError::Pick(i + 1, fault));
    }
    let places = DMatrix::from_fn(picks.len(), 3, |i, k| picks[i].place[k]);
    if spread(places) < 1e-3 {
        return Err(PoseError::Degenerate("the picked places lie on a line: pick some beside it"));
    }
    if spread(DMatrix::from_fn(picks.len(), 2, |i, k| picks[i].pixel[k])) < 1e-3 {
        return Err(PoseError::Degenerate(
            "the picked pixels lie on a line: pick points of another face as well",
        ));
    }
    Ok(())
}

/// Extent of points across their longest direction, as a share of it.
fn spread(mut points: DMatrix<f64>) -> f64 {
    let mean = points.row_mean();
    points.row_iter_mut().for_each(|mut row| row -= &mean);
    let values = points.singular_values();
    values[1] / values[0].max(f64::MIN_POSITIVE)
}

impl Located {
    /// The same with another pose, and how far it draws the picks from where they are.
    pub(crate) fn with(self, pose: Pose, picks: &[Pick]) -> Self {
        let off = |pick: &Pick| {
            let at = pose.project(pick.place);
            at.map_or([f64::NAN; 2], |[x, y]| [x - pick.pixel[0], y - pick.pixel[1]])
        };
        let residuals: Vec<[f64; 2]> = picks.iter().map(off).collect();
        let counts = residuals.iter().enumerate().filter(|(i, _)| self.left_out != Some(*i));
        let (sum, count) =
            counts.fold((0.0, 0.0), |(sum, n), (_, [x, y])| (sum + x * x + y * y, n + 1.0));
        Self { pose, residuals, rms_px: (sum / f64::max(count, 1.0)).sqrt(), ..self }
    }

    /// Covariance of where a place is drawn, pixels²: by the pose alone. `None` where it is not.
    #[must_use]
    pub(crate) fn pixel_covariance(&self, place: DVec3) -> Option<SMatrix<f64, 2, 2>> {
        let (_, slopes) = self.pose.slopes(place)?;
        Some(slopes * self.covariance * slopes.transpose())
    }
}
