//! The pose that draws picks nearest to where they were picked (Levenberg and Marquardt), and its
//! covariance.

use super::{Covariance, Pick, Pose, Prior, UNKNOWNS};

/// A pose that fits as well as any near it.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) pose: Pose,
    /// Σ of squared residuals over the variance of picking, and of what was known before.
    pub(super) chi2: f64,
    /// By picking alone; `None` where the picks leave something open.
    pub(super) covariance: Option<Covariance>,
}

/// How residuals count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Loss {
    /// By their squares.
    Squares,
    /// By their squares where they are small, hardly beyond so many pixels (Geman and McClure): ρ =
    /// r²/(1 + r²/c²).
    Robust(f64),
}

/// Residuals of picks, pixels; `None` where one is not drawn at all.
pub(super) fn residuals(pose: &Pose, picks: &[Pick]) -> Option<Vec<[f64; 2]>> {
    let off = |pick: &Pick| {
        let [x, y] = pose.project(pick.place)?;
        Some([x - pick.pixel[0], y - pick.pixel[1]])
    };
    picks.iter().map(off).collect()
}

/// What is to be made small.
fn cost(pose: &Pose, picks: &[Pick], prior: &Prior, loss: Loss) -> Option<f64> {
    let of = |[x, y]: [f64; 2]| {
        let square = x * x + y * y;
        match loss {
            Loss::Squares => square,
            Loss::Robust(c) => square / (1.0 + square / (c * c)),
        }
    };
    let sum: f64 = residuals(pose, picks)?.into_iter().map(of).sum();
    let known = off_prior(pose, prior).iter().map(|[off, weight]| off * off * weight).sum::<f64>();
    Some(sum / prior.picking_px.powi(2) + known)
}

/// How far ln f and k1 are from what was known, and the weight (1/variance) of that.
fn off_prior(pose: &Pose, prior: &Prior) -> [[f64; 2]; 2] {
    let weight = |error: f64| 1.0 / error.max(1e-8).powi(2);
    let focal = prior
        .focal
        .map_or([0.0; 2], |focal| [(pose.focal_px / focal.px).ln(), weight(focal.rel_error)]);
    let k1 = f64::from(pose.lens.k1) - f64::from(prior.lens.k1);
    [focal, [k1, weight(prior.k1_error)]]
}

/// JᵀJ and Jᵀr.
fn normal(
    pose: &Pose,
    picks: &[Pick],
    prior: &Prior,
    loss: Loss,
) -> Option<(Covariance, nalgebra::SVector<f64, UNKNOWNS>)> {
    let (mut matrix, mut side) = (Covariance::zeros(), nalgebra::SVector::zeros());
    for pick in picks {
        let ([x, y], slopes) = pose.slopes(pick.place)?;
        let off = nalgebra::Vector2::new(x - pick.pixel[0], y - pick.pixel[1]);
        let weight = match loss {
            Loss::Squares => 1.0,
            Loss::Robust(c) => (1.0 + off.norm_squared() / (c * c)).powi(-2),
        } / prior.picking_px.powi(2);
        matrix += slopes.transpose() * slopes * weight;
        side += slopes.transpose() * off * weight;
    }
    for (k, [off, weight]) in off_prior(pose, prior).into_iter().enumerate() {
        matrix[(6 + k, 6 + k)] += weight;
        side[6 + k] += off * weight;
    }
    Some((matrix, side))
}

/// Goes downhill from `start` until nothing is gained. `None` where a pick is not drawn at all.
pub(super) fn fit(start: Pose, picks: &[Pick], prior: &Prior, loss: Loss) -> Option<Fit> {
    let (mut pose, mut chi2) = (start, cost(&start, picks, prior, loss)?);
    let mut damping = 1e-3;
    for _ in 0..100 {
        let (matrix, side) = normal(&pose, picks, prior, loss)?;
        let mut damped = matrix;
        for k in 0..UNKNOWNS {
            damped[(k, k)] += damping * matrix[(k, k)].max(1e-12);
        }
        let step = damped.cholesky().map(|factor| -factor.solve(&side));
        let next = step.map(|step| pose.moved(&step.into()));
        let tried = next.and_then(|next| Some((next, cost(&next, picks, prior, loss)?)));
        match tried {
            Some((next, less)) if less < chi2 => {
                let gain = chi2 - less;
                (pose, chi2, damping) = (next, less, damping * 0.2);
                if gain < 1e-10 * (1.0 + chi2) {
                    break;
                }
            }
            _ if damping > 1e10 => break,
            _ => damping *= 8.0,
        }
    }
    let (matrix, _) = normal(&pose, picks, prior, loss)?;
    Some(Fit { pose, chi2, covariance: inverse(matrix) })
}

/// Inverse of a positive matrix whose unknowns have units of their own; `None` where it leaves a
/// direction open.
pub(crate) fn inverse(matrix: Covariance) -> Option<Covariance> {
    let scale: [f64; UNKNOWNS] = std::array::from_fn(|k| matrix[(k, k)].sqrt());
    if !scale.iter().all(|s| *s > 0.0) {
        return None;
    }
    let even = Covariance::from_fn(|i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let is_closed = even.symmetric_eigenvalues().min() > 1e-13;
    if !is_closed {
        return None;
    }
    let inverse = even.cholesky()?.inverse();
    Some(Covariance::from_fn(|i, j| inverse[(i, j)] / (scale[i] * scale[j])))
}
