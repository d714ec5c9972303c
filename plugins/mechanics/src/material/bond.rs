//! Bond of ribbed bars: shear stress against slip (CEB-FIP MC1990, fib MC2010 §6.1.1).
//!
//! τ = τ_max (s/s₁)^.4 up to s₁, then τ_max up to s₂, then down to τ_f at s₃, and friction τ_f. The
//! power has an infinite slope at zero slip; up to the slip s₀ where both meet, a straight line of
//! slope `stiffness` takes its place. s₀ = s₁/10 makes that the secant at a tenth of a millimetre,
//! the slip by which bond tests judge a bar (RILEM RC6), 61 MPa/mm for τ_max = 15.4 MPa, which is
//! also what OOFEM's tests take.

/// Bond by its curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Strength τ_max, Pa.
    pub strength: f64,
    /// Friction τ_f, Pa.
    pub friction: f64,
    /// Slips s₁, s₂, s₃, m.
    pub slips: [f64; 3],
    /// Slope before s₀ and on unloading, Pa/m.
    pub stiffness: f64,
}

/// What a point of bond remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BondState {
    /// Slip that would be left without stress, m.
    pub permanent: f64,
    /// Largest |slip|, m.
    pub reached: f64,
}

/// Where the initial line meets the power: s₀/s₁. There τ = .1^.4 τ_max = .4 τ_max.
const INITIAL: f64 = 0.1;

impl Bond {
    /// Good bond conditions, pull-out failure (well confined): τ_max = 2.5 √f_cm MPa, s = 1 mm, 2
    /// mm and the clear spacing of ribs (m), τ_f = .4 τ_max.
    #[must_use]
    pub fn good(fcm: f64, rib_spacing: f64) -> Self {
        let slips = [1e-3, 2e-3, rib_spacing.max(2.5e-3)];
        let strength = 2.5 * (fcm.max(0.0) / 1e6).sqrt() * 1e6;
        let stiffness = strength * INITIAL.powf(0.4) / (INITIAL * slips[0]);
        Self { strength, friction: 0.4 * strength, slips, stiffness }
    }

    /// τ (Pa) and dτ/ds (Pa/m) of the curve at a slip (m) of either sign.
    #[must_use]
    pub(crate) fn envelope(&self, slip: f64) -> (f64, f64) {
        let [s1, s2, s3] = self.slips;
        let s = slip.abs();
        let power = self.strength * (s / s1).powf(0.4);
        let (stress, slope) = if self.stiffness * s <= power && s < s1 {
            (self.stiffness * s, self.stiffness)
        } else if s < s1 {
            (power, 0.4 * power / s)
        } else if s < s2 {
            (self.strength, 0.0)
        } else if s < s3 {
            let slope = (self.friction - self.strength) / (s3 - s2);
            (self.strength + slope * (s - s2), slope)
        } else {
            (self.friction, 0.0)
        };
        (stress.copysign(slip), slope)
    }

    /// τ (Pa), dτ/ds and the state at the end: the curve while |slip| grows, lines of slope
    /// `stiffness` on the way back, bounded by the curve's value at the largest slip so far (in
    /// both directions: friction on reversal is not reduced further).
    #[must_use]
    pub(crate) fn respond(&self, slip: f64, state: &BondState) -> (f64, f64, BondState) {
        let reached = state.reached.max(slip.abs());
        let (limit, slope) = self.envelope(reached);
        let trial = self.stiffness * (slip - state.permanent);
        if trial.abs() <= limit {
            return (trial, self.stiffness, BondState { reached, ..*state });
        }
        let stress = limit.copysign(trial);
        let slope = if slip.abs() >= state.reached { slope } else { 0.0 };
        (stress, slope, BondState { permanent: slip - stress / self.stiffness, reached })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// OOFEM's reference values for its deck `bondceb01.in`: τ_max 15.41 MPa = 2.5 √38, τ_f 6.164
    /// MPa, s = 1, 2, 6.5 mm, k_s 6.135e10 Pa/m.
    #[test]
    fn curve_agrees_with_oofem() {
        let bond = Bond {
            strength: 15.41e6,
            friction: 6.164e6,
            stiffness: 6.135e10,
            slips: [1e-3, 2e-3, 6.5e-3],
        };
        for (mm, mpa) in [(0.2918, 9.4151), (2.933, 13.4928), (5.809, 7.5834)] {
            let (mut state, mut stress) = (BondState::default(), 0.0);
            for k in 1..=1000 {
                (stress, _, state) = bond.respond(mm * 1e-3 * f64::from(k) / 1000.0, &state);
            }
            assert!((stress / 1e6 / mpa - 1.0).abs() < 2e-4, "{mm} {stress}");
            assert!((stress - bond.envelope(mm * 1e-3).0).abs() < 1.0);
        }
        let ours = Bond::good(38e6, 6.5e-3);
        assert!((ours.strength / bond.strength - 1.0).abs() < 1e-4);
        assert!((ours.stiffness / bond.stiffness - 1.0).abs() < 1e-3, "{:e}", ours.stiffness);
    }

    #[test]
    fn curve_is_continuous_odd_and_has_its_slope() {
        let bond = Bond::good(38e6, 8e-3);
        for k in 1..20_000 {
            let s = 1e-2 * (f64::from(k) + 0.5) / 20_000.0;
            let ((a, slope), (b, _)) = (bond.envelope(s), bond.envelope(s + 1e-10));
            assert_eq!(bond.envelope(-s).0, -a);
            assert!((b - a).abs() <= 1.1e-10 * bond.stiffness, "jump at {s}");
            if bond.slips.iter().all(|corner| (s - corner).abs() > 1e-9) {
                assert!(((b - a) / 1e-10 - slope).abs() < 2e-3 * bond.stiffness, "{s}");
            }
        }
    }

    #[test]
    fn unloading_is_steep_and_reversal_dissipates() {
        let bond = Bond::good(38e6, 6.5e-3);
        let (top, _, state) = bond.respond(0.5e-3, &BondState::default());
        let (down, slope, state) = bond.respond(0.5e-3 - 1e-7, &state);
        assert!((top - down - 1e-7 * bond.stiffness).abs() < 1.0 && slope == bond.stiffness);
        let (back, _, _) = bond.respond(0.0, &state);
        assert!(back < 0.0 && back >= -bond.strength);
    }
}
