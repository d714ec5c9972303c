//! Poses to begin with: three points and a focal length leave at most four.

use glam::{DMat3, DVec3};
use intrados_scene::Lens;
use intrados_stage::random::{Draw, Key};
use nalgebra::Matrix4;

use super::{Pick, Pose};
use crate::similarity::Similarity;

/// Of more picks than this, not all threes are tried, but some by lot.
const ALL_THREES: usize = 9;
const SOME_THREES: u64 = 120;

/// Poses that draw three of the picks where they were picked, of many threes.
pub(super) fn starts(picks: &[Pick], focal_px: f64, lens: Lens, size: [u32; 2]) -> Vec<Pose> {
    let at_origin = Pose::new(DVec3::ZERO, DMat3::IDENTITY, focal_px, lens, size);
    let rays: Vec<Option<DVec3>> = picks.iter().map(|p| at_origin.ray(p.pixel)).collect();
    let of_three = |three: [usize; 3]| {
        let [Some(a), Some(b), Some(c)] = three.map(|i| rays[i]) else { return Vec::new() };
        let places = three.map(|i| picks[i].place);
        let found = three_points(places, [a, b, c]).into_iter();
        let pose = |(position, rotation)| Pose::new(position, rotation, focal_px, lens, size);
        found.map(pose).collect()
    };
    threes(picks.len()).into_iter().flat_map(of_three).collect()
}

fn threes(count: usize) -> Vec<[usize; 3]> {
    if count <= ALL_THREES {
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j]));
        return pairs.flat_map(|[i, j]| (j + 1..count).map(move |k| [i, j, k])).collect();
    }
    let draw = |n: u64| {
        let mut draw = Draw::new(Key::new(0x7033, n));
        [(); 3].map(|()| (draw.unit() * count as f64) as usize)
    };
    (0..SOME_THREES).map(draw).filter(|[i, j, k]| i != j && j != k && i != k).collect()
}

/// Positions and rotations (world to camera) of cameras that see three places along unit rays
/// (J. A. Grunert 1841; as R. M. Haralick and others give it in "Review and analysis of solutions
/// of the three point perspective pose estimation problem", 1994, eq. 9). With distances s and u =
/// s₂/s₁, v = s₃/s₁ the law of cosines leaves a quartic in v.
fn three_points(places: [DVec3; 3], rays: [DVec3; 3]) -> Vec<(DVec3, DMat3)> {
    let square = |i: usize, j: usize| places[i].distance_squared(places[j]);
    let (aa, bb, cc) = (square(1, 2), square(0, 2), square(0, 1));
    let cosine = |i: usize, j: usize| rays[i].dot(rays[j]);
    let (alpha, beta, gamma) = (cosine(1, 2), cosine(0, 2), cosine(0, 1));
    if aa.min(bb).min(cc) < 1e-18 * aa.max(bb).max(cc) {
        return Vec::new();
    }
    let (less, more, c) = ((aa - cc) / bb, (aa + cc) / bb, cc / bb);
    let (without_c, without_a) = ((bb - cc) / bb, (bb - aa) / bb);
    let quartic = [
        (1.0 + less).powi(2) - 4.0 * aa / bb * gamma * gamma,
        4.0 * (-less * (1.0 + less) * beta + 2.0 * aa / bb * gamma * gamma * beta
            - (1.0 - more) * alpha * gamma),
        2.0 * (less * less - 1.0
            + 2.0 * less * less * beta * beta
            + 2.0 * without_c * alpha * alpha
            - 4.0 * more * alpha * beta * gamma
            + 2.0 * without_a * gamma * gamma),
        4.0 * (less * (1.0 - less) * beta - (1.0 - more) * alpha * gamma
            + 2.0 * c * alpha * alpha * beta),
        (less - 1.0).powi(2) - 4.0 * c * alpha * alpha,
    ];
    let mut found = Vec::new();
    for v in roots(quartic).into_iter().filter(|v| *v > 0.0) {
        let u = ((less - 1.0) * v * v - 2.0 * less * beta * v + 1.0 + less)
            / (2.0 * (gamma - v * alpha));
        let first = (bb / (1.0 + v * v - 2.0 * v * beta)).sqrt();
        if !(u > 0.0 && first.is_finite()) {
            continue;
        }
        let seen = [first * rays[0], first * u * rays[1], first * v * rays[2]];
        let pairs: [_; 3] = std::array::from_fn(|i| [places[i], seen[i]]);
        if let Some(Similarity { rotation, shift, .. }) = Similarity::between(&pairs) {
            found.push((-(rotation.transpose() * shift), rotation));
        }
    }
    found
}

/// Real roots of Σ cᵢ xⁱ, and the real parts of those that noise has made a little complex: the
/// eigenvalues of its companion.
fn roots(c: [f64; 5]) -> Vec<f64> {
    if !c.iter().all(|x| x.is_finite()) || c[4].abs() < 1e-14 {
        return Vec::new();
    }
    let mut companion = Matrix4::zeros();
    for i in 0..4 {
        companion[(0, i)] = -c[3 - i] / c[4];
        if i > 0 {
            companion[(i, i - 1)] = 1.0;
        }
    }
    let Some(schur) = nalgebra::Schur::try_new(companion, 1e-14, 500) else { return Vec::new() };
    let near = |z: &&nalgebra::Complex<f64>| z.im.abs() < 0.1 * (1e-3 + z.re.abs());
    schur.complex_eigenvalues().iter().filter(near).map(|z| z.re).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a thousand planted cameras, three places give a pose that is the planted one.
    #[test]
    fn three_places_leave_the_planted_pose_among_four() {
        let mut missed = 0;
        for seed in 0..1000 {
            let mut draw = Draw::new(Key::new(11, seed));
            let mut any = |low: f64, high: f64| {
                DVec3::from_array(std::array::from_fn(|_| draw.between(low, high)))
            };
            let places = [any(-1.0, 1.0), any(-1.0, 1.0), any(-1.0, 1.0)];
            let position = any(-1.0, 1.0).normalize() * 4.0;
            let forward = (any(-0.5, 0.5) - position).normalize();
            let right = forward.cross(any(-1.0, 1.0)).normalize();
            let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
            let rays = places.map(|p| (rotation * (p - position)).normalize());
            let found = three_points(places, rays);
            assert!(found.len() <= 4);
            let is_planted = |(p, r): &(DVec3, DMat3)| {
                p.distance(position) < 1e-4 && r.abs_diff_eq(rotation, 1e-4)
            };
            missed += u32::from(!found.iter().any(is_planted));
        }
        // Where the three lie nearly on a line or on the danger cylinder, roots fall together.
        assert!(missed <= 10, "{missed} of 1000");
    }
}
