//! Four-node surfaces in space: shape functions, integration rules, area vectors. Faces of bricks,
//! joints, ground and shells stand on them.

use super::ElementError;
use glam::DVec3;

/// Natural coordinates of the four nodes, counterclockwise.
pub(crate) const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Two Gauss points a direction, with weights: [`Quadrature::gauss`]`(2)` without a list.
pub(crate) const GAUSS: [(f64, f64, f64); 4] = {
    const G: f64 = 0.577_350_269_189_625_8;
    [(-G, -G, 1.0), (G, -G, 1.0), (-G, G, 1.0), (G, G, 1.0)]
};

/// Bilinear shape functions N_a = (1 + r r_a)(1 + s s_a)/4.
#[must_use]
pub(crate) fn shape(r: f64, s: f64) -> [f64; 4] {
    CORNERS.map(|[a, b]| 0.25 * (1.0 + r * a) * (1.0 + s * b))
}

/// ∂N_a/∂r and ∂N_a/∂s.
#[must_use]
pub(crate) fn slopes(r: f64, s: f64) -> [[f64; 4]; 2] {
    [CORNERS.map(|[a, b]| 0.25 * a * (1.0 + s * b)), CORNERS.map(|[a, b]| 0.25 * b * (1.0 + r * a))]
}

/// Σ N_a x_a.
#[must_use]
pub(crate) fn blend(weights: &[f64; 4], nodes: &[DVec3; 4]) -> DVec3 {
    weights.iter().zip(nodes).map(|(w, x)| *w * *x).sum()
}

/// A rule of integration on −1…1 × −1…1: the product of a rule on −1…1 with itself.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quadrature {
    line: Vec<(f64, f64)>,
}

impl Quadrature {
    /// Points at the corners (Lobatto): couples no two nodes, so joints of high penalty do not
    /// oscillate.
    #[must_use]
    pub(crate) fn nodal() -> Self {
        Self { line: vec![(-1.0, 1.0), (1.0, 1.0)] }
    }

    /// Gauss–Legendre with n points a direction (1 ≤ n ≤ 64, clamped), roots of P_n by Newton.
    #[must_use]
    pub(crate) fn gauss(n: usize) -> Self {
        let n = n.clamp(1, 64);
        Self { line: (0..n).map(|i| legendre_root(n, i)).collect() }
    }

    /// Points (r, s) and weights.
    pub(crate) fn points(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        self.line.iter().flat_map(|&(s, ws)| self.line.iter().map(move |&(r, wr)| (r, s, wr * ws)))
    }

    /// How many points the rule has.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn len(&self) -> usize {
        self.line.len() * self.line.len()
    }
}

/// Root i of P_n and its weight 2/((1 − x²) P_n′²).
fn legendre_root(n: usize, i: usize) -> (f64, f64) {
    let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
    let mut slope = 1.0;
    for _ in 0..100 {
        let (mut last, mut p) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (last, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * last) / k);
        }
        slope = n as f64 * (x * p - last) / (x * x - 1.0);
        let step = p / slope;
        x -= step;
        if step.abs() < 1e-15 {
            break;
        }
    }
    (x, 2.0 / ((1.0 - x * x) * slope * slope))
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// Shape functions.
    pub shape: [f64; 4],
    /// Position (m).
    pub at: DVec3,
    /// Weight times area (m²); the areas of all spots add up to the surface.
    pub area: f64,
    /// Unit normal, right-handed to the nodes' order.
    pub normal: DVec3,
    /// First tangent, along r.
    pub tangent: DVec3,
}

/// The surface at natural coordinates, `weight` being that of the integration rule.
///
/// # Errors
/// [`ElementError::Degenerate`] where the surface has no normal.
pub(crate) fn spot(
    nodes: &[DVec3; 4],
    (r, s, weight): (f64, f64, f64),
    point: usize,
) -> Result<Spot, ElementError> {
    let [dr, ds] = slopes(r, s).map(|d| blend(&d, nodes));
    let cross = dr.cross(ds);
    let size = cross.length();
    if !size.is_finite() || size <= 1e-14 * dr.length_squared().max(ds.length_squared()) {
        return Err(ElementError::Degenerate { point });
    }
    let shape = shape(r, s);
    Ok(Spot {
        shape,
        at: blend(&shape, nodes),
        area: weight * size,
        normal: cross / size,
        tangent: dr.normalize_or_zero(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rules_are_exact_to_degree_2n_minus_1() {
        for n in 1..=64 {
            let rule = Quadrature::gauss(n);
            assert_eq!(rule.len(), n * n);
            assert!(
                n != 2
                    || rule
                        .points()
                        .zip(GAUSS)
                        .all(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1) < 1e-15
                            && (a.2 - b.2).abs() < 1e-15)
            );
            for power in 0..2 * n {
                let sum: f64 = rule.line.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                let exact = if power % 2 == 0 { 2.0 / (power as f64 + 1.0) } else { 0.0 };
                assert!((sum - exact).abs() < 2e-14, "n {n}, x^{power}: {sum} for {exact}");
            }
        }
    }

    #[test]
    fn area_of_a_parallelogram() {
        let nodes = [
            DVec3::ZERO,
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(3.0, 1.0, 1.0),
            DVec3::new(1.0, 1.0, 1.0),
        ];
        let area: f64 =
            Quadrature::gauss(2).points().map(|p| spot(&nodes, p, 0).unwrap().area).sum();
        assert!((area - 2.0 * 2f64.sqrt()).abs() < 1e-14);
        assert_eq!(
            spot(&[DVec3::ZERO; 4], (0.0, 0.0, 4.0), 3).unwrap_err(),
            ElementError::Degenerate { point: 3 }
        );
    }
}
