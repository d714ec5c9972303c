//! A pose by the model's edges: where the photograph shows the straight edges of members that a
//! picked pose draws, and the pose that draws them there.
//!
//! Each edge is looked for along its normals, no farther away than the pose's covariance allows
//! (Harris and Stennett 1990), and answers where one straight line collects the steps of light on
//! most of its length and no second one nearly does. It then counts as two measurements, which are
//! fitted together with what the picks say (Gauss and Newton, Geman and McClure's loss).

use glam::{DVec3, Vec3};
use nalgebra::SVector;
use rayon::prelude::*;

use crate::{
    Located, Photograph, Pick, Pose, PoseError, Prior, Site, locate,
    pose::{ByEdges, Covariance, UNKNOWNS, inverse},
};

/// Points of an edge lie so far apart, and light is averaged over as much along it, pixels.
const SPACING: f64 = 12.0;
/// Fewest points of an edge that can answer.
const FEWEST_POINTS: usize = 6;
/// Light is read so densely across an edge, pixels.
const DENSE: f64 = 0.5;
/// Steps are found by the slope of a Gaussian of this deviation, pixels.
const SMOOTH: f64 = 1.0;
/// An edge is looked for within three standard errors of where it is expected, and this, pixels.
const BEYOND: f64 = 1.5;
/// A step is compared with the others within so many pixels at least, and looked for within so many
/// at most.
const AROUND: [f64; 2] = [6.0, 40.0];
/// Share of an edge whose steps one line must collect, each weighed by the strongest beside it.
const ANSWER: f64 = 0.5;
/// A line elsewhere that collects this share as much makes an edge ambiguous.
const RIVAL: f64 = 0.7;
/// Sine of the angle below which two edges near each other are taken for one another.
const PARALLEL: f64 = 0.4;
/// What a whole edge is off, pixels: chamfers, dirt, and models that are no more exact.
const EDGE_PX: f64 = 0.3;
/// Fewest edges that move a pose.
const FEWEST_EDGES: usize = 3;
/// 99 % quantile of χ² with as many degrees of freedom as a pose has unknowns.
const CONTRADICTED: f64 = 20.09;
/// Largest misfit of edges, in squares of what they are expected to be off.
const WORST: f64 = 100.0;
/// How often edges are looked for, each time nearer.
const ROUNDS: usize = 8;

/// A point of an edge that the camera sees.
#[derive(Debug, Clone, Copy)]
struct Point {
    place: DVec3,
    /// In the picture, pixels.
    at: [f64; 2],
    /// Unit, across the edge in the picture.
    across: [f64; 2],
}

/// Where the photograph shows an edge: how far across from where it is drawn at two of its points.
/// Of a fitted straight line the values one deviation before and after the middle of its points are
/// independent, and known as well as by half of the points each.
#[derive(Debug, Clone, Copy)]
struct Answer {
    /// Slopes of how far across the point is drawn, by what is unknown of the pose.
    slopes: [SVector<f64, UNKNOWNS>; 2],
    off: [f64; 2],
    variance: f64,
}

/// A pose between what the picks and what the edges say.
struct Balance {
    step: SVector<f64, UNKNOWNS>,
    covariance: Covariance,
    answered: usize,
    off_px: f64,
    /// χ² of the edges over its degrees of freedom.
    misfit: f64,
}

impl Site {
    /// Where a photograph was taken from: by its picks, and then by the edges of the model that it
    /// shows.
    ///
    /// # Errors
    /// [`PoseError`], of the picks.
    pub fn locate(
        &self,
        photograph: &Photograph,
        picks: &[Pick],
        prior: &Prior,
    ) -> Result<Located, PoseError> {
        let picked = locate(picks, prior, &|pose| self.admits(pose, picks))?;
        Ok(by_edges(picked, photograph, self, picks))
    }
}

/// The pose that draws the members' edges where the photograph shows them, the picks counting by
/// their covariance. A pose whose covariance leaves nothing open to edges is returned as it is.
#[must_use]
pub fn by_edges(located: Located, photograph: &Photograph, site: &Site, picks: &[Pick]) -> Located {
    let Some(known) = inverse(located.covariance) else { return located };
    let edges = edges(&located.pose, site);
    let (mut pose, mut covariance) = (located.pose, located.covariance);
    let mut by = ByEdges { seen: 0, answered: 0, off_px: 0.0, moved_px: 0.0, kept: None };
    for _ in 0..ROUNDS {
        let drawn = drawn(&pose, site, &edges);
        by.seen = drawn.len();
        let answers = answers(&pose, &covariance, photograph, &drawn);
        let gone = off(&pose, &located.pose);
        let Some(balance) = balance(&known, &gone, &answers) else { break };
        (by.answered, by.off_px) = (balance.answered, balance.off_px);
        if balance.answered < FEWEST_EDGES {
            break;
        }
        if balance.misfit > WORST {
            by.kept = Some("the edges that are to be seen contradict each other");
            break;
        }
        pose = pose.moved(&balance.step.into());
        covariance = balance.covariance;
        let gone = off(&pose, &located.pose);
        if (gone.transpose() * known * gone)[0] > CONTRADICTED {
            by.kept = Some("the picks contradict the edges that are to be seen");
            break;
        }
        if moved(&pose.moved(&(-balance.step).into()), &pose, picks) < 0.01 {
            break;
        }
    }
    if by.answered < FEWEST_EDGES {
        by.kept = Some("too few edges of the model are to be seen as clear lines");
    }
    if by.kept.is_some() {
        return Located { edges: Some(by), ..located };
    }
    by.moved_px = moved(&located.pose, &pose, picks);
    Located { covariance, edges: Some(by), ..located.with(pose, picks) }
}

/// Straight edges of the members that the camera sees.
fn edges(pose: &Pose, site: &Site) -> Vec<[DVec3; 2]> {
    let mut members: Vec<usize> = site.seen_faces(pose).iter().map(|seen| seen.member).collect();
    members.dedup();
    let surfaces = members.into_iter().filter_map(|member| site.surface(member));
    surfaces.flat_map(|surface| surface.lines_from(pose.position)).collect()
}

/// Points of the edges in the picture, edge by edge, of those that are long enough.
fn drawn(pose: &Pose, site: &Site, edges: &[[DVec3; 2]]) -> Vec<Vec<Point>> {
    let points = |edge: &[DVec3; 2]| -> Vec<Point> {
        let way = edge[1] - edge[0];
        let point = |place: DVec3| {
            let [x, y] = pose.slopes_by_place(place)?.map(|slope| slope.dot(way));
            let length = x.hypot(y);
            let at = pose.project(place)?;
            (length > 0.0).then_some(Point { place, at, across: [-y / length, x / length] })
        };
        // Near its ends an edge is hidden or not by a hair, and meets others.
        let seen = site.seen_along(pose, edge, SPACING);
        let inner = seen.get(1..seen.len().saturating_sub(1)).unwrap_or_default();
        inner.iter().filter_map(|place| point(*place)).collect()
    };
    let all = edges.par_iter().map(points);
    all.filter(|points: &Vec<Point>| points.len() >= FEWEST_POINTS).collect()
}

/// What the photograph answers, of the edges that it shows.
fn answers(
    pose: &Pose,
    covariance: &Covariance,
    photograph: &Photograph,
    drawn: &[Vec<Point>],
) -> Vec<Answer> {
    let reach: Vec<f64> = drawn.iter().map(|points| reach(pose, covariance, points)).collect();
    (0..drawn.len())
        .into_par_iter()
        .filter_map(|i| {
            let others = || (0..drawn.len()).filter(|&j| j != i).flat_map(|j| &drawn[j]);
            let is_alone = |point: &&Point| !others().any(|o| is_beside(point, o, reach[i] + 2.0));
            let points: Vec<Point> = drawn[i].iter().filter(is_alone).copied().collect();
            (points.len() >= FEWEST_POINTS).then(|| answer(pose, photograph, &points, reach[i]))?
        })
        .collect()
}

/// How far an edge may be from where it is drawn, pixels.
fn reach(pose: &Pose, covariance: &Covariance, points: &[Point]) -> f64 {
    let variance = |point: &Point| {
        let slopes = slopes(pose, point)?;
        Some((slopes.transpose() * covariance * slopes)[0])
    };
    let most = points.iter().filter_map(variance).fold(0.0, f64::max);
    (3.0 * most.sqrt() + BEYOND).min(AROUND[1])
}

/// Slopes of how far across a point is drawn.
fn slopes(pose: &Pose, point: &Point) -> Option<SVector<f64, UNKNOWNS>> {
    let (_, slopes) = pose.slopes(point.place)?;
    Some(slopes.transpose() * nalgebra::Vector2::from(point.across))
}

/// Whether a point of another edge is so near that the one may be seen in place of the other.
fn is_beside(point: &Point, other: &Point, reach: f64) -> bool {
    let [x, y] = [0, 1].map(|k| other.at[k] - point.at[k]);
    let sine = point.across[0] * other.across[1] - point.across[1] * other.across[0];
    x.hypot(y) < reach && sine.abs() < PARALLEL
}

/// A step of light: how far across, pixels, and how strong beside the strongest around, 0 to 1.
type Step = (f64, f64);

/// A line beside an edge: how far across it is at the edge's middle, and how much farther a pixel
/// along.
type Line = (f64, f64);

/// Where the photograph shows an edge, if it does.
fn answer(pose: &Pose, photograph: &Photograph, points: &[Point], reach: f64) -> Option<Answer> {
    let along = |point: &Point| {
        let [x, y] = [0, 1].map(|k| point.at[k] - points[0].at[k]);
        y * -point.across[0] + x * point.across[1]
    };
    let half = 0.5 * along(points.last()?);
    let steps: Vec<(f64, Vec<Step>)> = points
        .iter()
        .filter_map(|point| {
            Some((along(point) - half, steps(photograph, point, reach.max(AROUND[0]))?))
        })
        .collect();
    if steps.len() < FEWEST_POINTS {
        return None;
    }
    let (line, window) = best_line(&steps, half.abs(), reach)?;
    let fit = fitted(&steps, fitted(&steps, line, window)?.line, 1.0)?;
    let slope = |u: f64| {
        let near = |p: &&Point| (along(p) - half - u).abs();
        slopes(pose, points.iter().min_by(|a, b| near(a).total_cmp(&near(b)))?)
    };
    let at = [fit.middle - fit.deviation, fit.middle + fit.deviation];
    Some(Answer {
        slopes: [slope(at[0])?, slope(at[1])?],
        off: at.map(|u| fit.line.0 + u * fit.line.1),
        variance: EDGE_PX * EDGE_PX + 2.0 * fit.scatter / fit.count,
    })
}

/// Steps of light across an edge: where the slope of light, smoothed, is steepest. `None` at the
/// picture's rim.
fn steps(photograph: &Photograph, point: &Point, reach: f64) -> Option<Vec<Step>> {
    let margin = 3.0 * SMOOTH;
    let count = ((reach + margin) / DENSE).ceil() as i32;
    let [nx, ny] = point.across;
    let light = |k: i32| -> Option<Vec3> {
        let across = f64::from(k) * DENSE;
        let mut sum = Vec3::ZERO;
        for k in 0..SPACING as u32 {
            let along = f64::from(k) + 0.5 - 0.5 * SPACING;
            let at =
                [point.at[0] + across * nx + along * ny, point.at[1] + across * ny - along * nx];
            sum += photograph.light_at(at)?;
        }
        Some(sum / SPACING as f32)
    };
    let light: Vec<Vec3> = (-count..=count).map(light).collect::<Option<_>>()?;
    let wing = (margin / DENSE) as usize;
    let kernel = |m: i32| {
        let x = f64::from(m) * DENSE / SMOOTH;
        (x * (-0.5 * x * x).exp()) as f32
    };
    let kernel: Vec<f32> = (-(wing as i32)..=wing as i32).map(kernel).collect();
    let slope = |window: &[Vec3]| {
        let sum: Vec3 = window.iter().zip(&kernel).map(|(light, k)| *light * *k).sum();
        f64::from(sum.length())
    };
    let slopes: Vec<f64> = light.windows(2 * wing + 1).map(slope).collect();
    let most = slopes.iter().copied().fold(0.0, f64::max);
    let first = -0.5 * (slopes.len() - 1) as f64;
    let step = |(i, three): (usize, &[f64])| {
        let [a, b, c] = [three[0], three[1], three[2]];
        // The top of a parabola through three.
        let top = 0.5 * (a - c) / (a - 2.0 * b + c);
        (b > a && b >= c).then(|| ((first + 1.0 + i as f64 + top) * DENSE, b / most))
    };
    Some(slopes.windows(3).enumerate().filter_map(step).collect())
}

/// Share of an edge's steps that a line collects, those nearer than `window` pixels.
fn collected(steps: &[(f64, Vec<Step>)], (middle, slope): Line, window: f64) -> f64 {
    let best = |(u, steps): &(f64, Vec<Step>)| {
        let at = middle + slope * u;
        let worth = |(across, strength): &Step| {
            let x = (across - at) / window;
            if x.abs() < 1.0 { strength * (1.0 - x * x) } else { 0.0 }
        };
        steps.iter().map(worth).fold(0.0, f64::max)
    };
    steps.iter().map(best).sum::<f64>() / steps.len() as f64
}

/// The line that collects most, and how near to it steps count; `None` where it is not enough or
/// another one is nearly as good.
fn best_line(steps: &[(f64, Vec<Step>)], half: f64, reach: f64) -> Option<(Line, f64)> {
    let count = 16.0_f64.min((reach / DENSE).ceil());
    let apart = reach / count;
    let window = apart.max(1.0);
    let ends: Vec<f64> = (-count as i32..=count as i32).map(|k| f64::from(k) * apart).collect();
    let tried: Vec<(f64, [f64; 2])> = ends
        .iter()
        .flat_map(|a| ends.iter().map(move |b| [*a, *b]))
        .map(|[a, b]| {
            let line = (0.5 * (a + b), 0.5 * (b - a) / half);
            (collected(steps, line, window), [a, b])
        })
        .collect();
    let (most, [a, b]) = tried.iter().copied().max_by(|x, y| x.0.total_cmp(&y.0))?;
    // Another line: farther away on the whole than both windows together.
    let is_other = |[c, d]: [f64; 2]| (0.5 * (a + b - c - d)).abs() > 2.0 * window;
    let rival = tried.iter().filter(|(_, ends)| is_other(*ends)).map(|t| t.0).fold(0.0, f64::max);
    let is_clear = most > ANSWER && rival < RIVAL * most;
    is_clear.then(|| ((0.5 * (a + b), 0.5 * (b - a) / half), window))
}

/// A straight line through steps near another.
struct Fitted {
    line: Line,
    /// Mean and deviation of where along the edge its steps are, pixels.
    middle: f64,
    deviation: f64,
    count: f64,
    /// Variance of a step about it, pixels².
    scatter: f64,
}

/// The line through the nearest strong step of each point within a window (least squares).
fn fitted(steps: &[(f64, Vec<Step>)], (middle, slope): Line, window: f64) -> Option<Fitted> {
    let near = |(u, steps): &(f64, Vec<Step>)| {
        let at = middle + slope * u;
        let worth = |(across, strength): &Step| strength * (1.0 - ((across - at) / window).powi(2));
        let best = steps.iter().max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
        ((best.0 - at).abs() < window).then_some([*u, best.0])
    };
    let near: Vec<[f64; 2]> = steps.iter().filter_map(near).collect();
    if 2 * near.len() < FEWEST_POINTS {
        return None;
    }
    let count = near.len() as f64;
    let [u, o] = [0, 1].map(|k| near.iter().map(|p| p[k]).sum::<f64>() / count);
    let square = near.iter().map(|p| (p[0] - u).powi(2)).sum::<f64>();
    let slope = near.iter().map(|p| (p[0] - u) * (p[1] - o)).sum::<f64>() / square;
    let line = (o - slope * u, slope);
    let off = near.iter().map(|p| (p[1] - line.0 - slope * p[0]).powi(2)).sum::<f64>();
    let deviation = (square / count).sqrt();
    Some(Fitted { line, middle: u, deviation, count, scatter: off / (count - 2.0) })
}

/// The step in what is unknown of a pose that is `gone` from the picked one, of which `known` is
/// the inverse covariance: between what the picks and what the edges say.
fn balance(
    known: &Covariance,
    gone: &SVector<f64, UNKNOWNS>,
    answers: &[Answer],
) -> Option<Balance> {
    let mut weights = vec![1.0; answers.len()];
    let mut step = SVector::<f64, UNKNOWNS>::zeros();
    let off = |answer: &Answer, step: &SVector<f64, UNKNOWNS>| {
        [0, 1].map(|k| answer.slopes[k].dot(step) - answer.off[k])
    };
    let size = |answer: &Answer, step: &SVector<f64, UNKNOWNS>| {
        let [a, b] = off(answer, step);
        ((a * a + b * b) / (2.0 * answer.variance)).sqrt()
    };
    let mut by_edges = Covariance::zeros();
    for _ in 0..20 {
        by_edges = Covariance::zeros();
        let mut side = -known * gone;
        for (answer, weight) in answers.iter().zip(&weights) {
            for (slopes, off) in answer.slopes.iter().zip(answer.off) {
                let weight = weight / answer.variance;
                by_edges += slopes * slopes.transpose() * weight;
                side += slopes * (off * weight);
            }
        }
        step = inverse(known + by_edges)? * side;
        // While all are off by much, none is an outlier.
        let mut sizes: Vec<f64> = answers.iter().map(|answer| size(answer, &step)).collect();
        let of = |size: f64, scale: f64| (1.0 + (size / (3.0 * scale)).powi(2)).powi(-2);
        let all = sizes.clone();
        sizes.sort_by(f64::total_cmp);
        let scale = sizes.get(sizes.len() / 2).map_or(1.0, |median| median.max(1.0));
        weights = all.into_iter().map(|size| of(size, scale)).collect();
    }
    let agree: Vec<&Answer> =
        answers.iter().zip(&weights).filter(|(_, w)| **w > 0.25).map(|(a, _)| a).collect();
    let rows = 2.0 * agree.len() as f64;
    let (mut chi2, mut squares) = (0.0, 0.0);
    for answer in &agree {
        let square = off(answer, &step).iter().map(|o| o * o).sum::<f64>();
        (chi2, squares) = (chi2 + square / answer.variance, squares + square);
    }
    // Of the unknowns, the edges determine as many as their share of what is known says.
    let taken = (inverse(known + by_edges)? * by_edges).trace();
    let misfit = chi2 / (rows - taken).max(1.0);
    Some(Balance {
        step,
        covariance: inverse(known + by_edges / misfit.max(1.0))?,
        answered: agree.len(),
        off_px: (squares / rows.max(1.0)).sqrt(),
        misfit,
    })
}

/// What one pose is away from another, in what is unknown.
fn off(pose: &Pose, from: &Pose) -> SVector<f64, UNKNOWNS> {
    let turn = glam::DQuat::from_mat3(&(pose.rotation * from.rotation.transpose()));
    let (turn, shift) = (turn.to_scaled_axis(), pose.position - from.position);
    let focal = (pose.focal_px / from.focal_px).ln();
    let k1 = f64::from(pose.lens.k1) - f64::from(from.lens.k1);
    SVector::from([turn.x, turn.y, turn.z, shift.x, shift.y, shift.z, focal, k1])
}

/// Root mean square of how far places move in the picture between two poses, pixels.
fn moved(from: &Pose, to: &Pose, picks: &[Pick]) -> f64 {
    let square = |pick: &Pick| {
        let [[a, b], [c, d]] = [from.project(pick.place)?, to.project(pick.place)?];
        Some((a - c).powi(2) + (b - d).powi(2))
    };
    let squares: Vec<f64> = picks.iter().filter_map(square).collect();
    (squares.iter().sum::<f64>() / f64::max(squares.len() as f64, 1.0)).sqrt()
}
