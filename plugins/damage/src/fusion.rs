//! Fusion: several pieces of evidence of one member made one damage, zone by zone.
//!
//! The best linear estimate of one damage d from pieces m with covariance C is d = (1ᵀC⁻¹m)/(1ᵀC⁻¹1), its variance 1/(1ᵀC⁻¹1)
//! (Aitken 1935); C has the variances that the pieces claim, widened by what their physics is blind to, and the correlations that the grading profile declares.
//! What is only foretold is the prior of what is measured. Pieces that contradict each other are never averaged:
//! first the prior yields; measured pieces that still disagree leave the largest damage, with an error bar that reaches the others.

use std::collections::BTreeMap;

use faer::{Mat, Side, linalg::solvers::Solve};
use serde::{Deserialize, Serialize};

use crate::{
    detect::Reading,
    evidence::Evidence,
    zone::{ZONES, Zones, place},
};

/// How evidence is fused: part of the grading profile.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    /// By source: the standard error, in damage, of what its physics cannot show.
    #[serde(default)]
    pub blindness: BTreeMap<String, f64>,
    /// Correlation of the errors of two sources, −1 to 1; pairs that are not listed have none.
    #[serde(default)]
    pub correlation: Vec<(String, String, f64)>,
}

/// Several pieces of evidence made one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fused {
    /// Damage d and its standard error.
    pub damage: Reading,
    /// χ² of the pieces about their mean, where there is more than one.
    pub chi2: Option<f64>,
    /// Whether they contradict each other: χ² above what chance gives once in a hundred.
    pub conflict: bool,
}

/// All evidence of a member made one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Whole {
    /// By zone.
    pub zones: Zones,
    /// The worst zone, which counts for the member.
    pub worst: Option<usize>,
    /// Contradictions, one line each.
    pub conflicts: Vec<String>,
}

impl Whole {
    /// Damage of the member: that of its worst zone.
    #[must_use]
    pub fn damage(&self) -> Option<Reading> {
        self.zones.0[self.worst?]
    }
}

/// What one source says of one zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<'a> {
    /// Which source.
    pub source: &'a str,
    /// What it says.
    pub reading: Reading,
    /// Whether it was measured, and not foretold.
    pub measured: bool,
}

/// No physics is surer than this: keeps a reading that claims no error from silencing all others.
const SMALLEST_ERROR: f64 = 0.005;

impl Rule {
    /// Standard error of a piece with what its source is blind to.
    fn error(&self, piece: &Piece) -> f64 {
        let blind = self.blindness.get(piece.source).copied().unwrap_or(0.0);
        piece.reading.std_error.hypot(blind).max(SMALLEST_ERROR)
    }

    fn correlation(&self, a: &str, b: &str) -> f64 {
        let is = |pair: &&(String, String, f64)| (pair.0 == a && pair.1 == b) || (pair.0 == b && pair.1 == a);
        self.correlation.iter().find(is).map_or(0.0, |pair| pair.2)
    }

    /// The best linear estimate and χ²; `None` where the declared correlations make no covariance.
    fn estimate(&self, pieces: &[Piece]) -> Option<(Reading, f64)> {
        let covariance = Mat::from_fn(pieces.len(), pieces.len(), |i, j| {
            let r = if i == j { 1.0 } else { self.correlation(pieces[i].source, pieces[j].source) };
            r * self.error(&pieces[i]) * self.error(&pieces[j])
        });
        let weights = covariance.llt(Side::Lower).ok()?.solve(Mat::<f64>::full(pieces.len(), 1, 1.0));
        let weight = |i: usize| weights[(i, 0)];
        let total: f64 = (0..pieces.len()).map(weight).sum();
        let value = (0..pieces.len()).map(|i| weight(i) * pieces[i].reading.value).sum::<f64>() / total;
        let apart = Mat::from_fn(pieces.len(), 1, |i, _| pieces[i].reading.value - value);
        let solved = covariance.llt(Side::Lower).ok()?.solve(&apart);
        let chi2 = (0..pieces.len()).map(|i| apart[(i, 0)] * solved[(i, 0)]).sum();
        (total.is_finite() && total > 0.0).then(|| (Reading { value: value.clamp(0.0, 1.0), std_error: total.sqrt().recip() }, chi2))
    }

    /// One zone. `None` where there is no evidence.
    #[must_use]
    pub fn fuse(&self, pieces: &[Piece]) -> Option<Fused> {
        if pieces.is_empty() {
            return None;
        }
        let agree = |pieces: &[Piece]| {
            let (damage, chi2) = self.estimate(pieces)?;
            let freedom = pieces.len() - 1;
            Some((damage, chi2, freedom == 0 || chi2 <= chi2_99(freedom as f64)))
        };
        let (damage, chi2, fine) = agree(pieces)?;
        let chi2 = (pieces.len() > 1).then_some(chi2);
        if fine {
            return Some(Fused { damage, chi2, conflict: false });
        }
        let measured: Vec<Piece> = pieces.iter().copied().filter(|p| p.measured).collect();
        let left = if measured.is_empty() { pieces } else { &measured };
        let damage = match agree(left)? {
            (damage, _, true) => damage,
            _ => self.largest(left)?,
        };
        Some(Fused { damage, chi2, conflict: true })
    }

    /// The safe side: the largest damage that is claimed. Its error bar of one σ reaches half way to the smallest.
    fn largest(&self, pieces: &[Piece]) -> Option<Reading> {
        let most = pieces.iter().max_by(|a, b| a.reading.value.total_cmp(&b.reading.value))?;
        let least = pieces.iter().map(|p| p.reading.value).fold(f64::INFINITY, f64::min);
        Some(Reading { value: most.reading.value, std_error: self.error(most).max(0.5 * (most.reading.value - least)) })
    }

    /// All zones of a member.
    #[must_use]
    pub fn whole(&self, evidence: &[&Evidence]) -> Whole {
        let mut whole = Whole::default();
        for zone in 0..ZONES {
            let says = |e: &&'_ Evidence| Some(Piece { source: e.source, reading: e.zones.0[zone]?, measured: e.measured });
            let pieces: Vec<Piece> = evidence.iter().filter_map(|e| says(e)).collect();
            let Some(fused) = self.fuse(&pieces) else { continue };
            whole.zones.0[zone] = Some(fused.damage);
            if fused.conflict {
                let said: Vec<String> =
                    pieces.iter().map(|p| format!("{} {:.2} ± {:.2}", p.source, p.reading.value, self.error(p))).collect();
                whole.conflicts.push(format!("{} of the axis: {}", place(zone), said.join(", ")));
            }
        }
        whole.worst = whole.zones.worst().map(|(zone, _)| zone);
        whole
    }
}

/// The 99 % point of χ² (Wilson and Hilferty 1931; within 2 %).
fn chi2_99(freedom: f64) -> f64 {
    let a = 2.0 / (9.0 * freedom);
    freedom * (1.0 - a + 2.326_348 * a.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(source: &str, value: f64, std_error: f64, measured: bool) -> Piece<'_> {
        Piece { source, reading: Reading { value, std_error }, measured }
    }

    fn close(a: Reading, b: [f64; 2]) {
        assert!((a.value - b[0]).abs() < 1e-9 && (a.std_error - b[1]).abs() < 1e-9, "{a:?} {b:?}");
    }

    #[test]
    fn the_surer_piece_weighs_more() {
        let fused = Rule::default().fuse(&[says("a", 0.2, 0.1, true), says("b", 0.4, 0.2, true)]).unwrap();
        close(fused.damage, [0.24, (1.0_f64 / 125.0).sqrt()]);
        assert!(!fused.conflict);
        assert_eq!(Rule::default().fuse(&[]), None);
    }

    /// Two pieces of the same error σ and correlation r: their mean, with σ √((1 + r)/2).
    #[test]
    fn what_errs_together_counts_less() {
        let rule = Rule { correlation: vec![("b".into(), "a".into(), 0.5)], ..Rule::default() };
        let fused = rule.fuse(&[says("a", 0.2, 0.1, true), says("b", 0.3, 0.1, true)]).unwrap();
        close(fused.damage, [0.25, 0.1 * 0.75_f64.sqrt()]);
        let impossible = Rule { correlation: vec![("a".into(), "b".into(), 1.5)], ..Rule::default() };
        assert_eq!(impossible.fuse(&[says("a", 0.2, 0.1, true), says("b", 0.3, 0.1, true)]), None);
    }

    #[test]
    fn blindness_widens() {
        let rule = Rule { blindness: [("a".into(), 0.4)].into(), ..Rule::default() };
        close(rule.fuse(&[says("a", 0.2, 0.3, true)]).unwrap().damage, [0.2, 0.5]);
    }

    #[test]
    fn the_prior_yields_to_what_is_measured() {
        let fused = Rule::default().fuse(&[says("forecast", 0.0, 0.1, false), says("seen", 0.6, 0.05, true)]).unwrap();
        close(fused.damage, [0.6, 0.05]);
        assert!(fused.conflict);
    }

    #[test]
    fn contradictory_measurements_stay_on_the_safe_side() {
        let fused = Rule::default().fuse(&[says("a", 0.1, 0.05, true), says("b", 0.6, 0.05, true), says("p", 0.1, 0.1, false)]).unwrap();
        close(fused.damage, [0.6, 0.25]);
        assert!(fused.conflict);
    }

    #[test]
    fn chi2_points() {
        for (freedom, point) in [(1.0, 6.635), (2.0, 9.210), (5.0, 15.086)] {
            assert!((chi2_99(freedom) / point - 1.0).abs() < 0.02);
        }
    }
}
