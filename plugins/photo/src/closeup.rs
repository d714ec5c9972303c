//! Close-ups of a plane: a ruler, or points whose places on it are known.

use nalgebra::{DMatrix, Matrix3, Vector3};

/// What a pixel of a close-up is long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Millimetres a pixel.
    pub mm_px: f64,
    /// Standard error, mm a pixel.
    pub std_error: f64,
}

/// By a ruler that is photographed squarely: `mm` from one pixel to the other, each picked to
/// `picking_px`. `None` where they are the same.
///
/// ```
/// let scale = intrados_photo::closeup::ruler([0.0, 0.0], [300.0, 400.0], 100.0, 1.0).unwrap();
/// assert_eq!(scale.mm_px, 0.2);
/// // √2 pixels in 500
/// assert!((scale.std_error - 0.2 * 2.0_f64.sqrt() / 500.0).abs() < 1e-12);
/// ```
#[must_use]
pub fn ruler(from: [f64; 2], to: [f64; 2], mm: f64, picking_px: f64) -> Option<Scale> {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let mm_px = mm / length;
    let is_sane = mm > 0.0 && mm.is_finite() && length > 0.0 && length.is_finite();
    is_sane.then(|| Scale { mm_px, std_error: mm_px * 2.0_f64.sqrt() * picking_px / length })
}

/// A plane that is photographed from anywhere, by points of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// From pixels to mm, both homogeneous.
    to_mm: Matrix3<f64>,
    points: Vec<([f64; 2], [f64; 2])>,
    picking_px: f64,
    /// Root mean square of what the points are off, mm.
    pub rms_mm: f64,
}

impl Plane {
    /// From points (pixel, place on the plane in mm), four or more, no three of the first four on a
    /// line (R. Hartley, "In defence of the eight-point algorithm", 1997: both are centred and
    /// scaled first). `None` where they say too little.
    #[must_use]
    pub fn through(points: &[([f64; 2], [f64; 2])], picking_px: f64) -> Option<Self> {
        let to_mm = homography(points)?;
        let mut plane = Self { to_mm, points: points.to_vec(), picking_px, rms_mm: 0.0 };
        let off = |(pixel, mm): &([f64; 2], [f64; 2])| {
            let [x, y] = plane.mm(*pixel)?;
            Some((x - mm[0]).powi(2) + (y - mm[1]).powi(2))
        };
        let sum: f64 = points.iter().map(off).sum::<Option<f64>>()?;
        plane.rms_mm = (sum / points.len() as f64).sqrt();
        Some(plane)
    }

    /// Where on the plane a pixel is, mm; `None` beyond its horizon.
    #[must_use]
    pub fn mm(&self, pixel: [f64; 2]) -> Option<[f64; 2]> {
        apply(&self.to_mm, pixel)
    }

    /// Millimetres a pixel about a place of the picture (the root of the area that a pixel covers),
    /// and its error by that of picking: each point's shift changes the plane.
    #[must_use]
    pub fn scale(&self, pixel: [f64; 2]) -> Option<Scale> {
        let mm_px = area(&self.to_mm, pixel)?.sqrt();
        let mut variance = 0.0;
        for (i, k) in (0..self.points.len()).flat_map(|i| [(i, 0), (i, 1)]) {
            let mut moved = self.points.clone();
            moved[i].0[k] += self.picking_px;
            variance += (area(&homography(&moved)?, pixel)?.sqrt() - mm_px).powi(2);
        }
        Some(Scale { mm_px, std_error: variance.sqrt() })
    }
}

fn apply(h: &Matrix3<f64>, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let p = h * Vector3::new(x, y, 1.0);
    (p.z > 1e-12).then(|| [p.x / p.z, p.y / p.z])
}

/// mm² a pixel: |det H| / w³.
fn area(h: &Matrix3<f64>, [x, y]: [f64; 2]) -> Option<f64> {
    let w = (h * Vector3::new(x, y, 1.0)).z;
    (w > 1e-12).then(|| h.determinant().abs() / w.powi(3))
}

/// The homography of pairs of points, its scale such that the points lie before its horizon.
fn homography(points: &[([f64; 2], [f64; 2])]) -> Option<Matrix3<f64>> {
    if points.len() < 4 {
        return None;
    }
    let [from, to] = [
        evened(points.iter().map(|p| p.0).collect())?,
        evened(points.iter().map(|p| p.1).collect())?,
    ];
    let mut rows = DMatrix::zeros(2 * points.len(), 9);
    for (i, (p, q)) in points.iter().enumerate() {
        let [x, y] = apply(&from, *p)?;
        let [u, v] = apply(&to, *q)?;
        let first = [x, y, 1.0, 0.0, 0.0, 0.0, -u * x, -u * y, -u];
        let second = [0.0, 0.0, 0.0, x, y, 1.0, -v * x, -v * y, -v];
        for (k, (a, b)) in first.into_iter().zip(second).enumerate() {
            (rows[(2 * i, k)], rows[(2 * i + 1, k)]) = (a, b);
        }
    }
    // The least eigenvector of AᵀA; the second least must stand apart.
    let eigen = (rows.transpose() * rows).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let stands_apart = eigen.eigenvalues[order[1]] > 1e-9 * eigen.eigenvalues[order[8]];
    if !stands_apart {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let even = Matrix3::from_fn(|i, j| h[3 * i + j]);
    let whole = to.try_inverse()? * even * from;
    let first = points.first()?.0;
    let w = (whole * Vector3::new(first[0], first[1], 1.0)).z;
    let whole = whole / w;
    let before = |p: &([f64; 2], [f64; 2])| (whole * Vector3::new(p.0[0], p.0[1], 1.0)).z > 0.0;
    points.iter().all(before).then_some(whole)
}

/// Takes points to a middle at 0 and a mean distance of √2.
fn evened(points: Vec<[f64; 2]>) -> Option<Matrix3<f64>> {
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let far = points.iter().map(|p| (p[0] - mean[0]).hypot(p[1] - mean[1])).sum::<f64>() / n;
    let s = 2.0_f64.sqrt() / far;
    let [x, y] = mean.map(|m| -s * m);
    s.is_finite().then(|| Matrix3::new(s, 0.0, x, 0.0, s, y, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pose;
    use glam::{DMat3, DVec3};
    use intrados_scene::Lens;
    use intrados_stage::random::Key;

    /// A plane 300 mm away, seen slantwise: its scale is that of a pinhole, and the stated error is
    /// the scatter of hundreds of noisy picks.
    #[test]
    fn a_slanted_plane_has_the_scale_of_its_pinhole() {
        let turn = DMat3::from_rotation_y(0.5);
        let pose = Pose::new(
            turn.transpose() * DVec3::NEG_Z * 300.0,
            turn,
            2000.0,
            Lens::default(),
            [2000, 1500],
        );
        let corners = [[-60.0, -40.0], [60.0, -40.0], [60.0, 40.0], [-60.0, 40.0], [10.0, 0.0]];
        let pixel = |mm: [f64; 2]| pose.project(DVec3::new(mm[0], mm[1], 0.0)).unwrap();
        let exact: Vec<_> = corners.iter().map(|mm| (pixel(*mm), *mm)).collect();
        let plane = Plane::through(&exact, 1.0).unwrap();
        let at = pixel([20.0, 10.0]);
        let back = plane.mm(at).unwrap();
        assert!((back[0] - 20.0).hypot(back[1] - 10.0) < 1e-6 && plane.rms_mm < 1e-6);
        let stated = plane.scale(at).unwrap();
        let h = 1e-4;
        let [o, a, b] = [[20.0, 10.0], [20.0 + h, 10.0], [20.0, 10.0 + h]].map(pixel);
        let px2 = ((a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])) / (h * h);
        assert!((stated.mm_px - px2.abs().powf(-0.5)).abs() < 1e-5 * stated.mm_px);
        let squares: f64 = (0..400)
            .map(|seed| {
                let key = Key::new(31, seed);
                let noisy: Vec<_> = (0..)
                    .zip(&exact)
                    .map(|(i, (p, mm))| {
                        ([p[0] + key.normal(4 * i), p[1] + key.normal(4 * i + 2)], *mm)
                    })
                    .collect();
                (Plane::through(&noisy, 1.0).unwrap().scale(at).unwrap().mm_px - stated.mm_px)
                    .powi(2)
            })
            .sum();
        let scatter = (squares / 400.0).sqrt();
        assert!((scatter / stated.std_error - 1.0).abs() < 0.15, "{scatter} {stated:?}");
    }

    #[test]
    fn points_on_a_line_are_no_plane() {
        let line: Vec<_> =
            (0..5).map(|i| [f64::from(i), 2.0 * f64::from(i)]).map(|p| (p, p)).collect();
        assert_eq!(Plane::through(&line, 1.0), None);
        assert_eq!(ruler([1.0; 2], [1.0; 2], 10.0, 1.0), None);
    }
}
