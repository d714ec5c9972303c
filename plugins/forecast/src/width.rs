//! Crack width from the stress of steel (EN 1992-1-1, 7.3.4), which does not depend on the mesh.
//!
//! Expression 7.9 asks for the stress *at a crack* and deducts from its strain what the concrete
//! carries between cracks. Elements with smeared cracks give the mean stress between cracks, from
//! which that is missing already: [`Tie::at_crack`] adds it first.

/// Steel's modulus, Pa (EN 1992-1-1, 3.2.7).
pub(crate) const E_STEEL: f64 = 200e9;
/// k_t: load that stays.
const LASTING: f64 = 0.4;

/// A bar and the concrete that it pulls on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tie {
    /// Stress of the bar at a crack, Pa.
    pub stress: f64,
    /// Its diameter, m.
    pub diameter: f64,
    /// Distance to the next bar, m.
    pub spacing: f64,
    /// Concrete outside it, m.
    pub cover: f64,
    /// Mean tensile strength of the concrete, Pa.
    pub tensile_strength: f64,
    /// E_s/E_cm.
    pub modular_ratio: f64,
}

impl Tie {
    /// ρ_p,eff: its section over that of the concrete within 2.5 (c + φ/2) of the face and half way
    /// to the next bars; bars farther apart than 5 (c + φ/2) have none farther.
    fn ratio(&self) -> f64 {
        let depth = 2.5 * (self.cover + 0.5 * self.diameter);
        let area = 0.25 * std::f64::consts::PI * self.diameter.powi(2);
        area / (depth * self.spacing.clamp(self.diameter, 2.0 * depth))
    }

    /// The same bar at a crack, if its stress so far is the mean between cracks, where the concrete
    /// that it pulls on has a mean tension (Pa): across a crack the bar takes over that force.
    #[must_use]
    pub(crate) fn at_crack(self, concrete: f64) -> Self {
        if self.stress <= 0.0 {
            return self;
        }
        let force = concrete.clamp(0.0, self.tensile_strength) / self.ratio();
        Self { stress: self.stress + force, ..self }
    }
}

/// w_k = s_r,max (ε_sm − ε_cm), m: expressions 7.8, 7.9 and 7.11 for ribbed bars in bending (k₁ =
/// .8, k₂ = .5).
#[must_use]
pub(crate) fn crack_width(tie: &Tie) -> f64 {
    let ratio = tie.ratio();
    let spacing = 3.4 * tie.cover + 0.425 * 0.8 * 0.5 * tie.diameter / ratio;
    let bare = tie.stress / E_STEEL;
    let stiffened =
        bare - LASTING * tie.tensile_strength / ratio * (1.0 + tie.modular_ratio * ratio) / E_STEEL;
    spacing * stiffened.max(0.6 * bare).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: c 50 mm, φ 25 mm, bars 80 mm apart: effective depth 156.25 mm, ρ = 490.87/12 500 =
    /// .03927, s_r,max = 170 + 108.2 = 278.2 mm. At 250 MPa with f_ct 3 MPa, α 6: ε = (250 −
    /// .4·3/.03927·(1 + .23562))/200 000 = 1.0612e-3, above .6·1.25e-3; w = .2952 mm.
    #[test]
    fn by_hand() {
        let tie = Tie {
            stress: 250e6,
            diameter: 0.025,
            spacing: 0.08,
            cover: 0.05,
            tensile_strength: 3e6,
            modular_ratio: 6.0,
        };
        assert!((crack_width(&tie) - 2.952e-4).abs() < 2e-7, "{}", crack_width(&tie));
        assert_eq!(crack_width(&Tie { stress: -1e6, ..tie }), 0.0);
        // Little stress: .6 σ/E.
        assert!((crack_width(&Tie { stress: 10e6, ..tie }) - 0.2782 * 0.6 * 5e-5).abs() < 1e-8);
    }

    /// Five sections by hand, EN 1992-1-1:2004, expressions 7.8, 7.9 and 7.11: stress at the crack
    /// σ_s (MPa), φ, spacing and c (mm), f_ct (MPa), α_e, and then ρ_p,eff, s_r,max (mm), ε_sm −
    /// ε_cm (10⁻³) and w (mm).
    const BY_HAND: [([f64; 6], [f64; 4]); 5] = [
        ([250.0, 25.0, 80.0, 50.0, 3.0, 6.0], [0.03927, 278.23, 1.0612, 0.29526]),
        ([200.0, 16.0, 100.0, 35.0, 2.9, 6.1], [0.018703, 264.43, 0.65452, 0.17307]),
        ([120.0, 12.0, 150.0, 30.0, 2.6, 6.5], [0.0083776, 345.51, 0.36, 0.12438]),
        ([280.0, 20.0, 120.0, 45.0, 3.5, 5.7], [0.01904, 331.57, 0.99245, 0.32907]),
        ([180.0, 32.0, 160.0, 60.0, 3.2, 6.0], [0.026456, 409.63, 0.61968, 0.25384]),
    ];

    /// A bar of which elements give the mean stress between cracks has the width that its stress at
    /// a crack has by hand: what the concrete carries is deducted once.
    #[test]
    fn mean_stresses_have_the_widths_of_the_code() {
        for ([stress, diameter, spacing, cover, f_ct, modular_ratio], [ratio, _, _, width]) in
            BY_HAND
        {
            let tie = Tie {
                stress: 1e6 * stress,
                diameter: 1e-3 * diameter,
                spacing: 1e-3 * spacing,
                cover: 1e-3 * cover,
                tensile_strength: 1e6 * f_ct,
                modular_ratio,
            };
            assert!((tie.ratio() / ratio - 1.0).abs() < 1e-3, "{tie:?}");
            let at_crack = 1e3 * crack_width(&tie);
            assert!((at_crack / width - 1.0).abs() < 1e-3, "{at_crack} {width}");
            // Between cracks the concrete carries k_t f_ct, or, of little stress, .4 of the bar's.
            let concrete = 1e6 * (LASTING * f_ct).min(0.4 * stress * ratio);
            let mean = Tie { stress: tie.stress - concrete / tie.ratio(), ..tie };
            let found = 1e3 * crack_width(&mean.at_crack(concrete));
            assert!((found / width - 1.0).abs() < 5e-3, "{found} {width}");
            // With the mean in place of the stress at a crack it would be too narrow by a seventh to
            // two fifths.
            let twice = 1e3 * crack_width(&mean) / width;
            assert!((0.55..0.9).contains(&twice), "{twice}");
        }
        assert!(crack_width(&Tie { stress: -1e6, ..mean_of_first() }.at_crack(1e6)) <= 0.0);
    }

    fn mean_of_first() -> Tie {
        Tie {
            stress: 219.4e6,
            diameter: 0.025,
            spacing: 0.08,
            cover: 0.05,
            tensile_strength: 3e6,
            modular_ratio: 6.0,
        }
    }
}
