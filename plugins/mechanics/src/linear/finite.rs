//! Elastic laws for strains that are not small, by principal stretches: rubber (Ogden 1972), foam
//! (Storåkers 1986), and the curve of Ramberg and Osgood (1943).

use nalgebra::{Matrix3, Vector3};

use crate::tensor::{Tangent, Voigt};

/// A law of what is isotropic.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Finite {
    /// U = Σ 2μ/α² (λ̄₁ᵅ + λ̄₂ᵅ + λ̄₃ᵅ − 3) + Σ (J − 1)²ⁱ/Dᵢ, λ̄ = J^(−⅓) λ.
    Rubber {
        /// μ, Pa, and α.
        terms: Vec<[f64; 2]>,
        /// D, 1/Pa.
        volume: Vec<f64>,
    },
    /// U = Σ 2μ/α² (λ₁ᵅ + λ₂ᵅ + λ₃ᵅ − 3 + (J^(−αβ) − 1)/β): μ, Pa, α and β = ν/(1 − 2ν).
    Foam(Vec<[f64; 3]>),
    /// E e = σ + α (σ/σ₀)ⁿ⁻¹ σ: true stress by Almansi's strain, e = ½ (1 − 1/λ²).
    Curve {
        /// Young's modulus, Pa, and Poisson's ratio.
        elastic: [f64; 2],
        /// σ₀, Pa.
        yields: f64,
        /// n.
        exponent: f64,
        /// α.
        offset: f64,
    },
}

/// Newton's steps to a stress on the curve.
const STEPS: usize = 100;
/// Strain of a difference.
const SMALL: f64 = 1e-7;
/// μ D of rubber that is said not to change its volume: ν = .475.
const NEARLY: f64 = 0.1;

impl Finite {
    /// Rubber of these μ and α; where the first D is nothing, of one that it stands for.
    pub(super) fn rubber(terms: Vec<[f64; 2]>, volume: &[f64]) -> Option<Self> {
        let shear: f64 = terms.iter().map(|t| t[0]).sum();
        let known = terms.iter().all(|t| t[1] != 0.0) && volume.iter().all(|d| *d >= 0.0);
        let stands = |(i, d): (usize, &f64)| match (i, *d == 0.0) {
            (0, true) => NEARLY / shear,
            (_, true) => f64::INFINITY,
            (_, false) => *d,
        };
        let volume = volume.iter().enumerate().map(stands).collect();
        (known && shear > 0.0 && shear.is_finite()).then_some(Self::Rubber { terms, volume })
    }

    /// Foam of these μ, α and Poisson's ratios.
    pub(super) fn foam(terms: &[[f64; 2]], poisson: &[f64]) -> Option<Self> {
        let known = |(t, v): (&[f64; 2], &f64)| {
            let known = t[1] != 0.0 && (-1.0..0.5).contains(v);
            known.then(|| [t[0], t[1], v / (1.0 - 2.0 * v)])
        };
        let terms: Option<Vec<[f64; 3]>> = terms.iter().zip(poisson).map(known).collect();
        let shear: f64 = terms.iter().flatten().map(|t| t[0]).sum();
        terms.filter(|_| shear > 0.0 && shear.is_finite()).map(Self::Foam)
    }

    /// Stress (second Piola-Kirchhoff) at a strain (Green's), and its slopes; none of what is turned
    /// inside out.
    pub(super) fn tangent(&self, strain: &Voigt) -> Option<(Voigt, Tangent)> {
        Some((self.stress(strain)?, slopes(strain, |other| self.stress(other))?))
    }

    fn stress(&self, strain: &Voigt) -> Option<Voigt> {
        if !strain.iter().all(|e| e.is_finite()) {
            return None;
        }
        let found = metric(strain).symmetric_eigen();
        let squares = found.eigenvalues;
        if squares.min() <= 0.0 {
            return None;
        }
        let forces = self.principal([squares[0], squares[1], squares[2]].map(f64::sqrt));
        let mut stress = Matrix3::zeros();
        for (i, force) in forces.into_iter().enumerate() {
            let axis: Vector3<f64> = found.eigenvectors.column(i).into_owned();
            stress += axis * axis.transpose() * (force / squares[i]);
        }
        Some(voigt(&stress))
    }

    /// Kirchhoff's principal stresses, λ ∂U/∂λ.
    fn principal(&self, stretches: [f64; 3]) -> [f64; 3] {
        let ratio: f64 = stretches.iter().product();
        match self {
            Self::Rubber { terms, volume } => {
                let shape = 1.0 / ratio.cbrt();
                let of = |l: f64| {
                    terms.iter().map(|[m, a]| 2.0 * m / a * (shape * l).powf(*a)).sum::<f64>()
                };
                let shear: [f64; 3] = stretches.map(of);
                let mean = shear.iter().sum::<f64>() / 3.0;
                let grown = ratio - 1.0;
                let slope = |(i, d): (i32, &f64)| f64::from(2 * i) / d * grown.powi(2 * i - 1);
                let even: f64 = (1..).zip(volume).map(slope).sum();
                shear.map(|s| s - mean + ratio * even)
            }
            Self::Foam(terms) => {
                let of =
                    |l: f64, [m, a, b]: &[f64; 3]| 2.0 * m / a * (l.powf(*a) - ratio.powf(-a * b));
                stretches.map(|l| terms.iter().map(|term| of(l, term)).sum())
            }
            Self::Curve { elastic: [young, poisson], .. } => {
                let strains = stretches.map(|l| 0.5 * (1.0 - 1.0 / (l * l)));
                let mean = strains.iter().sum::<f64>() / 3.0;
                let shear = strains.map(|e| e - mean);
                let equivalent = (2.0 / 3.0 * shear.iter().map(|e| e * e).sum::<f64>()).sqrt();
                let factor = if equivalent > 0.0 {
                    2.0 / 3.0 * self.mises(equivalent) / equivalent
                } else {
                    0.0
                };
                shear.map(|e| ratio * (factor * e + young * mean / (1.0 - 2.0 * poisson)))
            }
        }
    }

    /// Von Mises' stress of the curve at an equivalent strain.
    fn mises(&self, strain: f64) -> f64 {
        let Self::Curve { elastic: [young, poisson], yields, exponent, offset } = *self else {
            return 0.0;
        };
        let (wanted, straight) = (young * strain, 2.0 / 3.0 * (1.0 + poisson));
        // From above Newton's method comes down evenly, because the curve bends upward.
        let bent = yields * (wanted / (offset * yields)).powf(1.0 / exponent);
        let mut stress = bent.min(wanted / straight);
        for _ in 0..STEPS {
            let beyond = offset * (stress / yields).powf(exponent - 1.0);
            let by = ((straight + beyond) * stress - wanted) / (straight + exponent * beyond);
            stress -= by;
            if by.abs() <= 1e-14 * stress {
                break;
            }
        }
        stress
    }
}

/// 1 + 2 E of Green's strain: squares of stretches.
pub(super) fn metric(e: &Voigt) -> Matrix3<f64> {
    let [x, y, z] = [e[0], e[1], e[2]].map(|e| 1.0 + 2.0 * e);
    Matrix3::new(x, e[3], e[5], e[3], y, e[4], e[5], e[4], z)
}

/// A stress as six numbers.
pub(super) fn voigt(m: &Matrix3<f64>) -> Voigt {
    let mean = |i: usize, j: usize| 0.5 * (m[(i, j)] + m[(j, i)]);
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], mean(0, 1), mean(1, 2), mean(2, 0)]
}

/// Slopes of a stress by differences: their symmetric part, which is nearly all of them and what
/// solvers take.
pub(super) fn slopes(strain: &Voigt, stress: impl Fn(&Voigt) -> Option<Voigt>) -> Option<Tangent> {
    let mut slopes = [[0.0; 6]; 6];
    for j in 0..6 {
        let at = |by: f64| {
            let mut other = *strain;
            other[j] += by;
            stress(&other)
        };
        let (up, down) = (at(SMALL)?, at(-SMALL)?);
        for i in 0..6 {
            let half = 0.25 * (up[i] - down[i]) / SMALL;
            slopes[i][j] += half;
            slopes[j][i] += half;
        }
    }
    Some(slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, by: f64) {
        assert!((a - b).abs() <= by, "{a} is not {b} within {by}");
    }

    /// What is stretched by 1.3 along x and held across: rubber, foam and the curve by hand.
    #[test]
    fn laws_are_those_of_their_authors() {
        let (stretch, stretches) = (1.3f64, [1.3, 1.0, 1.0]);
        let rubber = Finite::rubber(vec![[20.0, 2.0], [6.0, -2.0]], &[0.1]).unwrap();
        // U = 10 (Ī₁ − 3) + 3 (Ī₂ − 3) + (J − 1)²/.1 (Mooney 1940).
        let energy = |l: f64| {
            let (one, two) =
                ((l * l + 2.0) / l.powf(2.0 / 3.0), (2.0 * l * l + 1.0) / l.powf(4.0 / 3.0));
            10.0 * (one - 3.0) + 3.0 * (two - 3.0) + 10.0 * (l - 1.0).powi(2)
        };
        let slope = (energy(stretch + 1e-6) - energy(stretch - 1e-6)) / 2e-6;
        near(rubber.principal(stretches)[0], stretch * slope, 1e-6);
        let foam = Finite::foam(&[[3.0, 5.0]], &[0.25]).unwrap();
        let alone = 6.0 / 5.0 * (stretch.powi(5) - stretch.powf(-2.5));
        near(foam.principal(stretches)[0], alone, 1e-12);
        near(foam.principal([1.0; 3])[0], 0.0, 1e-15);
        let curve =
            Finite::Curve { elastic: [200.0, 0.3], yields: 2.0, exponent: 5.0, offset: 0.4 };
        let stress = curve.mises(0.03);
        let straight = 2.6 / 3.0 * stress;
        near(straight + 0.4 * (stress / 2.0).powi(4) * stress, 6.0, 1e-12);
    }

    #[test]
    fn rubber_of_no_volume_is_nearly_so_and_nothing_else_is_taken() {
        let Some(Finite::Rubber { volume, .. }) = Finite::rubber(vec![[4.0, 2.0]], &[0.0, 0.0])
        else {
            panic!("a law")
        };
        assert_eq!(volume, [0.025, f64::INFINITY]);
        assert_eq!(Finite::rubber(vec![[-1.0, 2.0]], &[0.1]), None);
        assert_eq!(Finite::foam(&[[1.0, 2.0]], &[0.5]), None);
    }
}
