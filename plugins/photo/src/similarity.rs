//! The rotation, scale and shift between two sets of points.

use glam::{DMat3, DVec3};
use nalgebra::Matrix3;

/// q = scale · rotation · p + shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similarity {
    /// How much longer lengths become.
    pub(crate) scale: f64,
    /// A proper rotation.
    pub(crate) rotation: DMat3,
    /// In the units of q.
    pub(crate) shift: DVec3,
}

impl Similarity {
    /// The one that brings points p nearest to points q, by the sum of squares (S. Umeyama,
    /// "Least-squares estimation of transformation parameters between two point patterns", 1991).
    /// `None` of less than three pairs, and where either lie at one place or on a line.
    pub(crate) fn between(pairs: &[[DVec3; 2]]) -> Option<Self> {
        if pairs.len() < 3 {
            return None;
        }
        let count = pairs.len() as f64;
        let [p, q] = [0, 1].map(|k| pairs.iter().map(|pair| pair[k]).sum::<DVec3>() / count);
        let (mut covariance, mut spread) = (Matrix3::zeros(), 0.0);
        for pair in pairs {
            let (from, to) = (pair[0] - p, pair[1] - q);
            spread += from.length_squared();
            covariance += Matrix3::from_fn(|i, j| to[i] * from[j]);
        }
        let svd = covariance.svd(true, true);
        let (u, v) = (svd.u?, svd.v_t?);
        let [most, second, least] = [0, 1, 2].map(|k| svd.singular_values[k]);
        if !(second > 1e-9 * most && spread > 0.0) {
            return None;
        }
        // A reflection is no rotation: the least direction is turned round instead.
        let sign = (u.determinant() * v.determinant()).signum();
        let turned = u * Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, sign)) * v;
        let rotation = DMat3::from_cols_array(&std::array::from_fn(|k| turned[k]));
        let scale = (most + second + sign * least) / spread;
        Some(Self { scale, rotation, shift: q - scale * (rotation * p) })
    }

    /// Where a point goes.
    pub(crate) fn apply(&self, p: DVec3) -> DVec3 {
        self.scale * (self.rotation * p) + self.shift
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::{Draw, Key};

    #[test]
    fn a_planted_similarity_is_found() {
        for seed in 0..100 {
            let mut draw = Draw::new(Key::new(9, seed));
            let mut any =
                |size: f64| DVec3::from_array(std::array::from_fn(|_| draw.between(-size, size)));
            let rotation = DMat3::from_axis_angle(any(1.0).normalize(), any(3.0).x);
            let planted = Similarity { scale: any(1.0).x.abs() + 0.1, rotation, shift: any(9.0) };
            let pairs: Vec<_> = (0..3 + seed as usize % 4)
                .map(|_| any(2.0))
                .map(|p| [p, planted.apply(p)])
                .collect();
            let found = Similarity::between(&pairs).expect("three points off a line");
            assert!((found.scale - planted.scale).abs() < 1e-9);
            assert!(pairs.iter().all(|[p, q]| found.apply(*p).distance(*q) < 1e-9));
        }
        let line = [0.0, 1.0, 2.0, 3.0].map(|x| [DVec3::X * x; 2]);
        assert_eq!(Similarity::between(&line), None);
        assert_eq!(Similarity::between(&[[DVec3::ONE; 2]; 5]), None);
    }
}
