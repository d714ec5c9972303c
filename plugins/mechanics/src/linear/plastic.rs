//! Plasticity of metals where displacements are large: F = Fₑ Fₚ, a stored energy of what is elastic
//! alone, von Mises' yield by true stresses, and the return to it (Simo 1988; Simo and Hughes,
//! *Computational Inelasticity*, ch. 9), all by quantities of the body as it was: Cₚ⁻¹ and the
//! back stress, which rotations leave alone.

use nalgebra::Matrix3;

use super::finite::{metric, slopes, voigt};
use crate::{
    model::interpolate,
    tensor::{Tangent, Voigt},
};

/// How the surface of yield widens and moves with plastic strain: from 0 on, and true stress, Pa.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hardening {
    pub(super) widens: Vec<(f64, f64)>,
    /// Empty: it stays where it is.
    pub(super) moves: Vec<(f64, f64)>,
}

impl Hardening {
    /// Only widens.
    pub(super) fn isotropic(table: Vec<(f64, f64)>) -> Self {
        Self { widens: table, moves: Vec::new() }
    }

    /// Only moves, as wide as the table begins.
    pub(super) fn kinematic(table: Vec<(f64, f64)>) -> Self {
        Self { widens: table.iter().take(1).copied().collect(), moves: table }
    }
}

/// What has flowed at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flow {
    strain: f64,
    /// Cₚ⁻¹.
    metric: Matrix3<f64>,
    /// Pa.
    back: Matrix3<f64>,
}

impl Default for Flow {
    fn default() -> Self {
        Self { strain: 0.0, metric: Matrix3::identity(), back: Matrix3::zeros() }
    }
}

/// Newton's steps to the yield surface, which is piecewise linear.
const STEPS: usize = 50;
/// Part of the yield stress by which a stress may be beyond it.
const BEYOND: f64 = 1e-10;

/// A metal by Young's modulus and Poisson's ratio.
pub(super) struct Metal<'a> {
    pub(super) elastic: [f64; 2],
    pub(super) hardening: &'a Hardening,
}

impl Metal<'_> {
    /// Stress (second Piola-Kirchhoff) at a strain (Green's), its slopes, and what has flowed then;
    /// none of what is turned inside out.
    pub(super) fn tangent(&self, strain: &Voigt, flow: &Flow) -> Option<(Voigt, Tangent, Flow)> {
        let (stress, flowed) = self.stress(strain, flow, true)?;
        // What does not flow has the slopes of what is elastic, also where it is about to.
        let flows = flowed.strain > flow.strain;
        let slopes = slopes(strain, |other| Some(self.stress(other, flow, flows)?.0))?;
        Some((stress, slopes, flowed))
    }

    fn stress(&self, strain: &Voigt, flow: &Flow, may_flow: bool) -> Option<(Voigt, Flow)> {
        let [young, poisson] = self.elastic;
        let (bulk, shear) = (young / 3.0 / (1.0 - 2.0 * poisson), young / 2.0 / (1.0 + poisson));
        let c = metric(strain);
        let square = c.determinant();
        let inverse = c.try_inverse().filter(|_| square > 0.0)?;
        let volume = square.sqrt();
        let shape = volume.powf(-2.0 / 3.0);
        let third = |m: &Matrix3<f64>| (c * m).trace() / 3.0;
        let (metric, back) = (shape * flow.metric, shape * flow.back);
        let (mean, behind) = (third(&metric), third(&back));
        let tried = shear * (metric - mean * inverse);
        let beyond = tried - (back - behind * inverse);
        let across = beyond * c;
        let size = (across * across).trace().max(0.0).sqrt();
        let stiff = shear * mean - behind;
        let gain =
            if may_flow { self.gain(size, volume, [stiff, shear], flow.strain) } else { 0.0 };
        let volumetric = 0.5 * bulk * (square - 1.0) * inverse;
        let mut flowed = *flow;
        if gain == 0.0 {
            return Some((voigt(&(volumetric + tried)), flowed));
        }
        let back = 2.0 * stiff * gain / size * beyond;
        let strain = flow.strain + ROOT * gain;
        // Beside the flow, the surface moves along with it.
        let moves = volume * (self.moved(strain) - self.moved(flow.strain)) / (ROOT * gain);
        flowed.strain = strain;
        flowed.metric -= back / (shear * shape);
        flowed.back += moves / (3.0 * shear * shape) * back;
        Some((voigt(&(volumetric + tried - back)), flowed))
    }

    /// How much flows so that the stress is on the surface.
    fn gain(&self, size: f64, volume: f64, [stiff, shear]: [f64; 2], strain: f64) -> f64 {
        let yields = ROOT * volume * self.width(strain);
        if size - yields <= BEYOND * yields {
            return 0.0;
        }
        let left = |gain: f64| {
            let now = strain + ROOT * gain;
            let moved = ROOT * volume / shear * (self.moved(now) - self.moved(strain));
            size - ROOT * volume * self.width(now) - stiff * (2.0 * gain + moved)
        };
        // Each step takes the slope of the piece that it lies in.
        let mut gain = (size - yields) / (2.0 * stiff);
        for _ in 0..STEPS {
            let by = 1e-6 * gain;
            let slope = (left(gain + by) - left(gain - by)) / (2.0 * by);
            let next = (gain - left(gain) / slope).max(0.1 * gain);
            if (next - gain).abs() <= 1e-12 * gain {
                return next;
            }
            gain = next;
        }
        gain
    }

    /// True stress at the surface, seen from its middle.
    fn width(&self, strain: f64) -> f64 {
        interpolate(&self.hardening.widens, strain).unwrap_or(0.0)
    }

    /// How far its middle has gone, from any origin.
    fn moved(&self, strain: f64) -> f64 {
        interpolate(&self.hardening.moves, strain).unwrap_or(0.0)
    }
}

/// √(2/3).
const ROOT: f64 = 0.816_496_580_927_726;

#[cfg(test)]
mod tests {
    use super::*;

    fn metal(hardening: &Hardening) -> Metal<'_> {
        Metal { elastic: [210e3, 0.3], hardening }
    }

    /// Stress of a bar that is stretched, free across; true stress by its area.
    fn pulled(metal: &Metal<'_>, stretch: f64, flow: &Flow) -> (f64, Flow) {
        let along = 0.5 * (stretch * stretch - 1.0);
        let [mut low, mut high] = [0.8, 1.2];
        loop {
            let across = 0.5 * (low + high);
            let side = 0.5 * (across * across - 1.0);
            let (stress, flowed) =
                metal.stress(&[side, side, along, 0.0, 0.0, 0.0], flow, true).unwrap();
            if high - low < 1e-14 {
                return (stress[2] * stretch / (across * across), flowed);
            }
            if stress[0] > 0.0 { high = across } else { low = across }
        }
    }

    /// A bar beyond yield, back and beyond it on the other side: bilinear, and yielding again after
    /// twice the stress reached, after twice the first, or half way between where half of it moves.
    #[test]
    fn bars_follow_their_table_and_come_back() {
        let table = vec![(0.0, 800.0), (0.1, 1600.0)];
        let half = vec![(0.0, 800.0), (0.1, 1200.0)];
        let slope = 210e3 * 8e3 / 218e3;
        let bilinear = 800.0 + slope * (0.008 - 800.0 / 210e3);
        for (hardening, range) in [
            (Hardening::isotropic(table.clone()), 2.0 * bilinear),
            (Hardening::kinematic(table), 1600.0),
            (Hardening { widens: half.clone(), moves: half }, 800.0 + bilinear),
        ] {
            let metal = metal(&hardening);
            let (up, flow) = pulled(&metal, 1.008, &Flow::default());
            assert!((up / bilinear - 1.0).abs() < 0.01, "{up} is not {bilinear}");
            let (down, _) = pulled(&metal, 0.996, &flow);
            let expected = bilinear - range - slope * (0.012 - range / 210e3);
            assert!((down / expected - 1.0).abs() < 0.02, "{down} is not {expected}");
        }
    }

    /// CalculiX 2.20 on its deck `beampiso`: 990 MPa at 2.85 %, of which its forces are 1.2e-4 out of
    /// balance.
    #[test]
    fn a_bar_at_three_per_cent_bears_as_that_of_calculix() {
        let table = vec![(0.0, 800.0), (0.1, 1600.0)];
        let hardening = Hardening::isotropic(table);
        let (stress, flow) = pulled(&metal(&hardening), 1.0 + 0.227_984_1 / 8.0, &Flow::default());
        assert!((stress / 989.98 - 1.0).abs() < 1e-4, "{stress}");
        assert!((flow.strain - 0.023_748).abs() < 1e-5, "{}", flow.strain);
    }

    /// Without flow, and with it, stress changes as its slopes say.
    #[test]
    fn slopes_are_differences() {
        let table = vec![(0.0, 800.0), (0.1, 1600.0)];
        let hardening = Hardening::kinematic(table);
        let metal = metal(&hardening);
        for size in [1e-4, 1e-2] {
            let strain = [size, -0.3 * size, 0.2 * size, 0.7 * size, -0.4 * size, 0.1 * size];
            let (stress, slopes, _) = metal.tangent(&strain, &Flow::default()).unwrap();
            let mut other = strain;
            (0..6).for_each(|i| other[i] += 1e-6 * (i as f64 - 2.0));
            let (moved, _) = metal.stress(&other, &Flow::default(), true).unwrap();
            for i in 0..6 {
                let by: f64 = (0..6).map(|j| slopes[i][j] * (other[j] - strain[j])).sum();
                assert!((moved[i] - stress[i] - by).abs() < 2e-3, "{i}: {by}");
            }
        }
    }
}
