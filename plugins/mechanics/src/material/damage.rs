//! Damage in three dimensions.
//!
//! [`Unilateral`] keeps damage of tension and of compression apart and closes cracks. Its energy is
//! that of Ladevèze (1983) and La Borderie (1991),
//!
//! χ(σ) = Σ⟨σᵢ⟩²/(2E(1−d_t)) + Σ⟨−σᵢ⟩²/(2E(1−d_c)) + ν(σ:σ − (tr σ)²)/(2E),
//!
//! convex in σ, so that strain ε = ∂χ/∂σ has one stress, every cycle at constant damage gives back
//! what it took, and dissipation Y ḋ is never negative. Uniaxial tension and compression are
//! exactly (1 − d) E ε; an open crack does not contract its flanks. In principal axes E εᵢ =
//! (1/(1−dᵢ) + ν) σᵢ − ν tr σ, with dᵢ by the sign of σᵢ: linear for each of four sign patterns, so
//! it is solved without iteration, and at constant damage the tangent is also the secant, symmetric
//! and positive definite.

use crate::tensor::{self, Frame, Principal, Tangent, Voigt};

/// Elasticity with a damage of tension and a damage of compression.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unilateral {
    /// Modulus of elasticity, Pa.
    pub modulus: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

/// Stress and its parts in principal axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Split {
    /// Principal directions as rows, shared by all that follows.
    pub directions: Frame,
    /// Strain that was asked for.
    pub strain: [f64; 3],
    /// Stress, Pa.
    pub stress: [f64; 3],
    /// Strain of elasticity and damage, without the creep of the step.
    pub mechanical: [f64; 3],
    /// Strain of the undamaged material under the stress on what is left of the section, C⁻¹ σᵢ/(1
    /// − dᵢ): what the equivalent strain judges. (The mechanical strain itself would not do: an open
    /// crack does not contract its flanks, which it would take for more tension.)
    pub effective: [f64; 3],
    /// What drives creep: C_ν σ with compression counted on what is left of the section, σ/(1 −
    /// d_c), Pa.
    pub drive: [f64; 3],
    /// ∂stress/∂strain in principal axes at constant damage, symmetric.
    pub normal: [[f64; 3]; 3],
    /// Damage of tension and of compression.
    pub damage: [f64; 2],
}

impl Unilateral {
    /// Stress under `strain` at damages [d_t, d_c], if a share of that strain creeps in the
    /// meantime: mechanical strain + `creep`·drive/E = strain. `creep` is 0 for elasticity with
    /// damage alone.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn solve(&self, strain: &Voigt, damage: [f64; 2], creep: f64) -> Split {
        self.solve_principal(&Principal::of_strain(strain), damage, creep)
    }

    /// The same for a strain whose principal axes are known.
    #[must_use]
    pub(crate) fn solve_principal(
        &self,
        strain: &Principal,
        damage: [f64; 2],
        creep: f64,
    ) -> Split {
        let Principal { values, directions } = *strain;
        let (e, nu) = (self.modulus, self.poisson);
        // E εᵢ = pᵢ σᵢ − ν q tr σ with pᵢ by the sign of σᵢ.
        let q = 1.0 + creep;
        let tension = 1.0 / (1.0 - damage[0]) + creep + nu * q;
        let compression = q / (1.0 - damage[1]) + nu * q;
        let guess = |tensile: usize| {
            let p: [f64; 3] =
                std::array::from_fn(|i| if i < tensile { tension } else { compression });
            let weight = 1.0 - nu * q * p.iter().map(|p| 1.0 / p).sum::<f64>();
            let trace = e * (0..3).map(|i| values[i] / p[i]).sum::<f64>() / weight;
            let stress: [f64; 3] = std::array::from_fn(|i| (e * values[i] + nu * q * trace) / p[i]);
            let wrong = (0..3)
                .map(|i| if i < tensile { -stress[i] } else { stress[i] })
                .fold(0.0, f64::max);
            (wrong, p, weight, stress)
        };
        // Stresses are ordered as strains, so the first k are tensile; exactly one k is right, up
        // to rounding.
        let patterns = [0, 1, 2, 3].map(guess);
        let (_, p, weight, stress) =
            patterns.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(guess(0));
        let trace: f64 = stress.iter().sum();
        let section = |i: usize| if stress[i] < 0.0 { 1.0 / (1.0 - damage[1]) } else { 1.0 };
        let drive = std::array::from_fn(|i| (section(i) + nu) * stress[i] - nu * trace);
        let whole: [f64; 3] =
            std::array::from_fn(|i| stress[i] / (1.0 - damage[usize::from(stress[i] < 0.0)]));
        let sum: f64 = whole.iter().sum();
        let effective = whole.map(|s| ((1.0 + nu) * s - nu * sum) / e);
        let normal = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                e * (f64::from(u8::from(i == j)) / p[i] + nu * q / (p[i] * p[j] * weight))
            })
        });
        let mechanical = std::array::from_fn(|i| values[i] - creep * drive[i] / e);
        Split { directions, strain: values, stress, mechanical, effective, drive, normal, damage }
    }

    /// Opening strain of cracks along each principal direction, dᵢσᵢ/(E(1 − dᵢ)) of the tensile
    /// ones.
    #[must_use]
    pub(crate) fn opening(&self, split: &Split) -> [f64; 3] {
        split
            .stress
            .map(|s| s.max(0.0) * split.damage[0] / (self.modulus * (1.0 - split.damage[0])))
    }

    /// Elastic energy that is stored, ½ σ:ε, J/m³.
    #[must_use]
    pub(crate) fn energy(&self, split: &Split) -> f64 {
        0.5 * (0..3).map(|i| split.stress[i] * split.mechanical[i]).sum::<f64>()
    }

    /// The derivative by the strain of a quantity of the axes of the strain, whose derivative by
    /// [`Split::effective`] is `outer` in principal axes, at constant damage.
    #[must_use]
    pub(crate) fn by_strain(&self, split: &Split, outer: [f64; 3]) -> Voigt {
        let nu = self.poisson;
        let sum: f64 = outer.iter().sum();
        let by_stress: [f64; 3] = std::array::from_fn(|i| {
            let left = 1.0 - split.damage[usize::from(split.stress[i] < 0.0)];
            ((1.0 + nu) * outer[i] - nu * sum) / (self.modulus * left)
        });
        let values =
            std::array::from_fn(|j| (0..3).map(|i| by_stress[i] * split.normal[i][j]).sum());
        Principal { values, directions: split.directions }.as_stress()
    }

    /// ∂σ/∂d_t, Pa: what more damage of tension does to the stress at constant strain.
    #[must_use]
    pub(crate) fn by_tension(&self, split: &Split) -> Voigt {
        let source =
            split.stress.map(|s| s.max(0.0) / (self.modulus * (1.0 - split.damage[0]).powi(2)));
        let values =
            std::array::from_fn(|i| -(0..3).map(|j| split.normal[i][j] * source[j]).sum::<f64>());
        Principal { values, directions: split.directions }.as_stress()
    }
}

impl Split {
    /// Stress in the axes of the strain, Pa.
    #[must_use]
    pub(crate) fn stress(&self) -> Voigt {
        Principal { values: self.stress, directions: self.directions }.as_stress()
    }

    /// Mechanical strain.
    #[must_use]
    pub(crate) fn mechanical(&self) -> Voigt {
        Principal { values: self.mechanical, directions: self.directions }.as_strain()
    }

    /// What drives creep, strain-like, Pa.
    #[must_use]
    pub(crate) fn drive(&self) -> Voigt {
        Principal { values: self.drive, directions: self.directions }.as_strain()
    }

    /// ∂σ/∂ε at constant damage: symmetric, positive definite, and by homogeneity also the secant.
    #[must_use]
    pub(crate) fn tangent(&self) -> Tangent {
        let mut local = [[0.0; 6]; 6];
        for (i, row) in self.normal.iter().enumerate() {
            local[i][..3].copy_from_slice(row);
        }
        for (k, (i, j)) in [(3, (0, 1)), (4, (1, 2)), (5, (2, 0))] {
            // Principal axes turn with the strain: τ/γ = (σᵢ − σⱼ)/(2(εᵢ − εⱼ)).
            let (apart, size) =
                (self.strain[i] - self.strain[j], self.strain[i].abs().max(self.strain[j].abs()));
            local[k][k] = match apart.abs() > 1e-9 * size {
                true => 0.5 * (self.stress[i] - self.stress[j]) / apart,
                false => 0.5 * (self.normal[i][i] - self.normal[i][j]),
            };
        }
        tensor::rotate_tangent(&local, &self.directions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::tests::{largest, random};

    const E: f64 = 30e9;
    const NU: f64 = 0.2;

    fn assert_tangent(
        tangent: &Tangent,
        stress: impl Fn(&Voigt) -> Voigt,
        at: &Voigt,
        tolerance: f64,
    ) {
        let step = 1e-5 * largest(at);
        for j in 0..6 {
            let (mut up, mut down) = (*at, *at);
            up[j] += step;
            down[j] -= step;
            let (up, down) = (stress(&up), stress(&down));
            for i in 0..6 {
                let numeric = (up[i] - down[i]) / (2.0 * step);
                assert!(
                    (numeric - tangent[i][j]).abs() < tolerance * E,
                    "{i} {j}: {numeric:e} {:e}",
                    tangent[i][j]
                );
            }
        }
    }

    #[test]
    fn unilateral_is_hooke_without_damage() {
        let (law, c) = (Unilateral { modulus: E, poisson: NU }, tensor::stiffness(E, NU));
        for walk in 0..100 {
            let strain = random(walk, 1e-3);
            let split = law.solve(&strain, [0.0; 2], 0.0);
            assert!(
                largest(&tensor::sub(&split.stress(), &tensor::apply(&c, &strain)))
                    < 1e-12 * E * 1e-3
            );
            assert!(largest(&tensor::sub(&split.mechanical(), &strain)) < 1e-17);
            for (a, b) in split.tangent().iter().zip(&c) {
                assert!(largest(&tensor::sub(a, b)) < 1e-9 * E);
            }
        }
    }

    #[test]
    fn cracks_close() {
        let law = Unilateral { modulus: E, poisson: NU };
        let uniaxial = |stress: f64, damage: [f64; 2]| {
            let d = if stress > 0.0 { damage[0] } else { damage[1] };
            let (axial, lateral) = (stress / (E * (1.0 - d)), -NU * stress / E);
            law.solve(&[lateral, axial, lateral, 0.0, 0.0, 0.0], damage, 0.0)
        };
        let open = uniaxial(0.5e6, [0.9, 0.3]);
        assert!((open.stress()[1] - 0.5e6).abs() < 1e-3 && open.stress()[0].abs() < 1e-3);
        assert!((law.opening(&open)[0] - 0.9 * 0.5e6 / (E * 0.1)).abs() < 1e-12);
        // On reversal the crack is shut and only the damage of compression counts.
        let closed = uniaxial(-10e6, [0.9, 0.3]);
        assert!((closed.stress()[1] + 10e6).abs() < 1e-2 && closed.stress()[0].abs() < 1e-2);
        assert_eq!(law.opening(&closed), [0.0; 3]);
    }

    #[test]
    fn tangent_of_unilateral_damage_is_secant_and_that_of_finite_differences() {
        let law = Unilateral { modulus: E, poisson: NU };
        for walk in 0..100 {
            let strain = random(walk, 1e-3);
            let (damage, creep) = ([0.95, 0.4], if walk % 2 == 0 { 0.0 } else { 0.7 });
            let split = law.solve(&strain, damage, creep);
            let tangent = split.tangent();
            assert!(
                largest(&tensor::sub(&tensor::apply(&tangent, &strain), &split.stress()))
                    < 1e-11 * E * 1e-3
            );
            assert_tangent(&tangent, |e| law.solve(e, damage, creep).stress(), &strain, 2e-5);
            let transposed: Tangent = std::array::from_fn(|i| tangent.map(|row| row[i]));
            assert!(
                tangent
                    .iter()
                    .zip(&transposed)
                    .all(|(a, b)| largest(&tensor::sub(a, b)) < 1e-9 * E)
            );
            // What creeps and what does not add up, and the mechanical part alone gives the same
            // stress.
            let sum = tensor::add(&split.mechanical(), &tensor::scale(&split.drive(), creep / E));
            assert!(largest(&tensor::sub(&sum, &strain)) < 1e-15);
            let again = law.solve(&split.mechanical(), damage, 0.0);
            assert!(largest(&tensor::sub(&again.stress(), &split.stress())) < 1e-9 * E * 1e-3);
        }
    }

    #[test]
    fn more_damage_of_tension_changes_stress_as_said() {
        let law = Unilateral { modulus: E, poisson: NU };
        for walk in 0..20 {
            let strain = random(walk, 1e-3);
            let stress = |d: f64| law.solve(&strain, [d, 0.2], 0.3).stress();
            let said = law.by_tension(&law.solve(&strain, [0.6, 0.2], 0.3));
            let numeric =
                tensor::scale(&tensor::sub(&stress(0.6 + 1e-6), &stress(0.6 - 1e-6)), 1.0 / 2e-6);
            assert!(
                largest(&tensor::sub(&numeric, &said)) < 1e-4 * E * 1e-3,
                "{walk} {numeric:?} {said:?}"
            );
        }
    }
}
