//! What a lens does to a picture: Brown's distortion.
//!
//! It is the gradient of a potential, so its Jacobian is symmetric, with eigenvalues of at least
//! min(1 + k1 r² + k2 r⁴, 1 + 3 k1 r² + 5 k2 r⁴) − 6 r |(p1, p2)|. Up to the radius where that
//! bound falls to [`Lens::STEEPEST`] the potential is convex: no two points are drawn at one place,
//! and Newton's method finds the one that was. Beyond it the lens shows nothing.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Distortion of a lens (D. C. Brown, "Decentering distortion of lenses", 1966), as OpenCV and
/// COLMAP write it: with x and y to the right and downwards from the optical axis, tangents, and r²
/// = x² + y², what a pinhole would draw at (x, y) is drawn at x (1 + k1 r² + k2 r⁴) + 2 p1 x y + p2
/// (r² + 2 x²) and y (1 + k1 r² + k2 r⁴) + p1 (r² + 2 y²) + 2 p2 x y.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Lens {
    /// Of r²: negative of a barrel, positive of a pincushion.
    pub k1: f32,
    /// Of r⁴.
    pub k2: f32,
    /// Decentering, downwards.
    pub p1: f32,
    /// Decentering, to the right.
    pub p2: f32,
    /// Where the optical axis meets the picture, from its centre to the right and downwards, in
    /// widths of the picture.
    pub centre: [f32; 2],
}

impl Lens {
    /// Least eigenvalue of the Jacobian that is still trusted.
    const STEEPEST: f64 = 0.1;
    /// Farther from the axis than this tangent (86°) no lens of this kind is looked through.
    const FARTHEST: f64 = 14.0;

    /// Radius, a tangent from the optical axis, within which the distortion can be undone.
    #[must_use]
    pub fn reach(&self) -> f64 {
        let is_good = |r: f64| self.least(r) >= Self::STEEPEST;
        // From one step to the next the bound moves little; the first fall counts, not a later one.
        const STEPS: u32 = 128;
        let radius = |step: u32| Self::FARTHEST * (f64::from(step) / f64::from(STEPS)).powi(2);
        let Some(bad) = (1..=STEPS).find(|&step| !is_good(radius(step))) else {
            return Self::FARTHEST;
        };
        let (mut low, mut high) = (radius(bad - 1), radius(bad));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if is_good(middle) { low = middle } else { high = middle }
        }
        low
    }

    /// Lower bound of the Jacobian's eigenvalues at radius `r`.
    fn least(&self, r: f64) -> f64 {
        let [k1, k2, p1, p2] = self.coefficients();
        let s = r * r;
        let [around, along] = [1.0 + s * (k1 + s * k2), 1.0 + s * (3.0 * k1 + s * 5.0 * k2)];
        around.min(along) - 6.0 * r * p1.hypot(p2)
    }

    fn coefficients(&self) -> [f64; 4] {
        [self.k1, self.k2, self.p1, self.p2].map(f64::from)
    }

    /// Where a point is drawn, and the Jacobian there (symmetric: xx, xy, yy).
    #[must_use]
    pub fn distort(&self, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
        let [k1, k2, p1, p2] = self.coefficients();
        let s = x * x + y * y;
        let (gain, slope) = (1.0 + s * (k1 + s * k2), 2.0 * (k1 + 2.0 * s * k2));
        (
            [
                x * gain + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
                y * gain + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
            ],
            [
                gain + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
                slope * x * y + 2.0 * (p1 * x + p2 * y),
                gain + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x,
            ],
        )
    }

    /// The point that is drawn at `drawn`, by Newton's method on the convex potential, its steps
    /// halved until they help; `None` where it is not within `reach` ([`Lens::reach`]).
    #[must_use]
    pub fn undistort(&self, drawn: [f64; 2], reach: f64) -> Option<[f64; 2]> {
        let off = |p: [f64; 2]| {
            let ([x, y], slopes) = self.distort(p);
            ([x - drawn[0], y - drawn[1]], slopes)
        };
        let within = |[x, y]: [f64; 2]| x.hypot(y) <= reach;
        let shrink = (0.9 * reach / drawn[0].hypot(drawn[1])).min(1.0);
        let mut at = drawn.map(|x| x * shrink);
        let (mut error, mut slopes) = off(at);
        for _ in 0..50 {
            let size = error[0].hypot(error[1]);
            if size <= 1e-13 * (1.0 + drawn[0].hypot(drawn[1])) {
                return Some(at);
            }
            let [a, b, c] = slopes;
            let det = a * c - b * b;
            let step = [(c * error[0] - b * error[1]) / det, (a * error[1] - b * error[0]) / det];
            let tried = (0..30).map(|halvings| {
                let share = 0.5_f64.powi(halvings);
                [at[0] - share * step[0], at[1] - share * step[1]]
            });
            let better = tried.filter(|p| within(*p)).find_map(|p| {
                let (left, slopes) = off(p);
                (left[0].hypot(left[1]) < size).then_some((p, left, slopes))
            });
            let Some(next) = better else {
                // Rounding is all that is left, or the point lies beyond.
                return (size < 1e-9).then_some(at);
            };
            (at, error, slopes) = next;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::{Draw, Key};

    fn lenses() -> impl Iterator<Item = Lens> {
        (0..200).map(|i| {
            let mut draw = Draw::new(Key::new(3, i));
            let mut any = |size: f64| draw.between(-size, size) as f32;
            Lens { k1: any(0.4), k2: any(0.2), p1: any(0.01), p2: any(0.01), centre: [0.0; 2] }
        })
    }

    #[test]
    fn what_is_distorted_within_reach_is_undone() {
        for (i, lens) in (0..).zip(lenses()) {
            let reach = lens.reach();
            assert!(reach > 0.2, "{lens:?}");
            for k in 0..100 {
                let mut draw = Draw::new(Key::new(4 + i, k));
                let (r, angle) = (0.999 * reach * draw.unit().sqrt(), draw.between(0.0, 6.3));
                let p = [r * angle.cos(), r * angle.sin()];
                let (drawn, _) = lens.distort(p);
                let back = lens.undistort(drawn, reach).expect("within reach");
                let off = (back[0] - p[0]).hypot(back[1] - p[1]);
                assert!(off < 1e-8 * (1.0 + r), "{lens:?} at {p:?}: off by {off}");
            }
        }
    }

    /// The bound holds everywhere within reach, and the Jacobian is that of differences.
    #[test]
    fn the_jacobian_is_the_slope_and_positive_within_reach() {
        for lens in lenses() {
            for k in 0..60 {
                let mut draw = Draw::new(Key::new(5, k));
                let (r, angle) = (lens.reach() * draw.unit(), draw.between(0.0, 6.3));
                let [x, y] = [r * angle.cos(), r * angle.sin()];
                let [a, b, c] = lens.distort([x, y]).1;
                let h = 1e-5 * (1.0 + r);
                let slope = |dx: f64, dy: f64| {
                    let [to, from] = [1.0, -1.0].map(|s| lens.distort([x + s * dx, y + s * dy]).0);
                    [0, 1].map(|i| (to[i] - from[i]) / (2.0 * h))
                };
                let ([aa, bb], [b2, cc]) = (slope(h, 0.0), slope(0.0, h));
                let scale = 1.0 + a.abs() + c.abs();
                for (is, by) in [(a, aa), (b, bb), (b, b2), (c, cc)] {
                    assert!((is - by).abs() < 1e-6 * scale, "{is} {by}");
                }
                let least = 0.5 * (a + c) - (0.25 * (a - c).powi(2) + b * b).sqrt();
                assert!(least >= Lens::STEEPEST - 1e-9, "{lens:?} at {r}: {least}");
            }
        }
    }

    /// x (1 − 0.1 x²) turns at x = √(10/3), where it is 1.217: nothing is drawn beyond, and what is
    /// near the turn is not trusted.
    #[test]
    fn what_a_barrel_never_draws_is_not_undone() {
        let barrel = Lens { k1: -0.1, ..Lens::default() };
        assert!((barrel.reach() - (0.9_f64 / 0.3).sqrt()).abs() < 1e-6);
        assert_eq!(barrel.undistort([1.3, 0.0], barrel.reach()), None);
        assert!(barrel.undistort([0.0, 1.2], barrel.reach()).is_some());
        assert!(Lens::default().undistort([3.0, 4.0], Lens::default().reach()).is_some());
    }
}
