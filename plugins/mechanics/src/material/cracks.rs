//! Cracks in three planes across each other that stay where the first one opened (fixed orthogonal smeared cracks: de Borst and Nauta 1985, Rots and
//! Blaauwendraad 1989).
//!
//! In the axes of the planes, strain is that of Hooke's law and of each plane's crack:
//!
//! E εᵢ = σᵢ/(1 − dᵢ) − ν Σ σⱼ (j ≠ i) where σᵢ is tension, the same with dᵢ = 0 where it is compression (the crack is shut);
//! G γᵢⱼ = τᵢⱼ (1 + sᵢ + sⱼ), s = 1/β − 1 with the share β of shear stiffness that a crack leaves.
//!
//! It is convex in σ, so that strain has one stress, and what cracks in one direction bears tension along it as before. Each plane is judged by the stress on
//! what is left of it, σᵢ/(1 − dᵢ), alone (Rankine). Compression is crushed by the part of the stress that presses: σ = σ⁺ + (1 − d_c) σ⁻ (Faria, Oliver and
//! Cervera 1998).

use super::softening::Damage;
use crate::tensor::{self, Frame, Principal, Tangent, Voigt};

/// What the planes of a point remember.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planes {
    /// Their normals as rows, once one has cracked.
    pub axes: Frame,
    /// Largest strain σᵢ/(1 − dᵢ)/E of each; 0: not cracked.
    pub kappa: [f64; 3],
    /// The same strain as it was last.
    pub asked: [f64; 3],
}

/// No cracks.
pub const SOUND: Planes = Planes { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], kappa: [0.0; 3], asked: [0.0; 3] };

/// Stress in the planes' axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cracked {
    /// Without crushing, along the planes' axes, Pa.
    stress: Voigt,
    /// ∂stress/∂strain at constant damage along those axes.
    tangent: Tangent,
    /// σᵢ/(1 − dᵢ)/E.
    pub(super) asked: [f64; 3],
    /// Strain of each crack's opening.
    pub(super) opening: [f64; 3],
}

impl Planes {
    /// Whether any has cracked.
    #[must_use]
    pub fn cracked(&self) -> bool {
        self.kappa.iter().any(|k| *k > 0.0)
    }
}

/// Stress under `strain` (along the planes' axes) at damages d and shares β of shear stiffness.
pub(super) fn solve(modulus: f64, nu: f64, strain: &Voigt, damage: [f64; 3], shear: [f64; 3]) -> Cracked {
    let pattern = |open: u8| {
        let p: [f64; 3] = std::array::from_fn(|i| if open >> i & 1 == 1 { 1.0 / (1.0 - damage[i]) + nu } else { 1.0 + nu });
        let weight = 1.0 - nu * p.iter().map(|p| 1.0 / p).sum::<f64>();
        let trace = modulus * (0..3).map(|i| strain[i] / p[i]).sum::<f64>() / weight;
        let stress: [f64; 3] = std::array::from_fn(|i| (modulus * strain[i] + nu * trace) / p[i]);
        let wrong = (0..3).map(|i| if open >> i & 1 == 1 { -stress[i] } else { stress[i] }).fold(0.0, f64::max);
        (wrong, p, weight, stress)
    };
    let guess = (0..3).fold(0, |open, i| open | u8::from(strain[i] > 0.0) << i);
    let first = pattern(guess);
    let (_, p, weight, normal) = match first.0 > 0.0 {
        true => (0..8).map(pattern).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(first),
        false => first,
    };
    let mut tangent = [[0.0; 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            tangent[i][j] = modulus * (f64::from(u8::from(i == j)) / p[i] + nu / (p[i] * p[j] * weight));
        }
    }
    let soft = shear.map(|beta| 1.0 / beta - 1.0);
    for (k, (i, j)) in [(3, (0, 1)), (4, (1, 2)), (5, (2, 0))] {
        tangent[k][k] = 0.5 * modulus / (1.0 + nu) / (1.0 + soft[i] + soft[j]);
    }
    let section = |i: usize| if normal[i] > 0.0 { 1.0 / (1.0 - damage[i]) } else { 1.0 };
    Cracked {
        stress: std::array::from_fn(|k| if k < 3 { normal[k] } else { tangent[k][k] * strain[k] }),
        tangent,
        asked: std::array::from_fn(|i| (normal[i] * section(i) / modulus).max(0.0)),
        opening: std::array::from_fn(|i| normal[i].max(0.0) * (section(i) - 1.0) / modulus),
    }
}

impl Cracked {
    /// Stress in the world's axes, without crushing.
    pub(super) fn sound(&self, axes: &Frame) -> Voigt {
        tensor::rotate_stress(&self.stress, &tensor::transposed(axes))
    }

    /// Stress and tangent in the world's axes at a damage of compression: each principal component that presses counts 1 − d_c. The tangent is symmetric and
    /// positive, and the secant as long as one component presses.
    pub(super) fn crushed(&self, axes: &Frame, principal: &Principal, crushed: f64) -> (Voigt, Tangent) {
        let tangent = tensor::rotate_tangent(&self.tangent, axes);
        if crushed == 0.0 {
            return (principal.to_stress(), tangent);
        }
        let left = principal.values.map(|s| if s < 0.0 { 1.0 - crushed } else { 1.0 });
        let stress = Principal { values: std::array::from_fn(|i| left[i] * principal.values[i]), ..*principal };
        let root: Voigt = [
            left[0].sqrt(),
            left[1].sqrt(),
            left[2].sqrt(),
            (left[0] * left[1]).powf(0.25),
            (left[1] * left[2]).powf(0.25),
            (left[2] * left[0]).powf(0.25),
        ];
        let mut local = tensor::rotate_tangent(&tangent, &tensor::transposed(&principal.directions));
        for (i, row) in local.iter_mut().enumerate() {
            row.iter_mut().enumerate().for_each(|(j, k)| *k *= root[i] * root[j]);
        }
        (stress.to_stress(), tensor::rotate_tangent(&local, &principal.directions))
    }
}

/// Damage of each plane.
pub(super) fn damages(law: impl Fn(usize) -> Damage) -> [f64; 3] {
    std::array::from_fn(|i| law(i).0)
}
