//! Fusion: several pieces of evidence of one member made one damage, zone by zone and cause by
//! cause.
//!
//! The best linear estimate of one damage d from pieces m with covariance C is d =
//! (1ᵀC⁻¹m)/(1ᵀC⁻¹1), its variance 1/(1ᵀC⁻¹1) (Aitken 1935); C has the variances that the pieces
//! claim, widened by what their physics is blind to, and the correlations that the grading profile
//! declares. What a slice says is fused with what was foretold of the slice's own plane; what lies
//! between that and the rest of the zone, which widens the zone's error, is common to both: as a
//! part of the slice's own error it would let the prior, from which it comes, count twice. For the
//! same reason what was estimated about a prior leaves that out. What is only foretold is the prior
//! of what is measured, and yields where the two differ by more than chance gives once in twenty.
//! Pieces that contradict each other (once in a hundred) are never averaged: measured pieces that
//! disagree leave the largest damage, with an error bar that reaches the others. Causes are then
//! taken together, 1 − Π(1 − d); one that nothing speaks of counts as nothing, with the error that
//! the profile declares for it.
//!
//! A slow pulse and the pores of a slice speak of the same concrete. What is lost by the one, 1 − m,
//! is what pores leave of stiffness times what is lost without a trace, (1 − a c)(1 − d): c is known
//! from whoever measured it in that zone, and a is what a loss of strength takes of stiffness, from
//! .3 (sound concretes of several strengths: EN 1992-1-1, table 3.1, E goes with f to the .3) to 1
//! (holes, which take both alike), equally likely.

use std::collections::{BTreeMap, BTreeSet};

use intrados_stage::Estimate;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::{
    evidence::{Cause, Evidence, Stands, all_causes, called},
    zone::{Zones, place},
};

/// How evidence is fused: part of the grading profile.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FusionRule {
    /// Of a source and a cause: the standard error, in damage, of what its physics cannot show.
    #[serde(default)]
    pub blindness: Vec<(String, Cause, f64)>,
    /// Standard error of a cause that no evidence speaks of.
    #[serde(default)]
    pub unknown: BTreeMap<Cause, f64>,
    /// Of a cause: the length over which damage along a member is alike, m. What slices say fades
    /// over it, see `predict`.
    #[serde(default)]
    pub correlation_m: BTreeMap<Cause, f64>,
    /// Correlation of the errors of two sources, −1 to 1; pairs that are not listed have none.
    #[serde(default)]
    pub correlation: Vec<(String, String, f64)>,
}

/// Several pieces of evidence made one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fused {
    /// Damage d and its standard error.
    pub damage: Estimate,
    /// χ² of the pieces about their mean, where there is more than one.
    pub chi2: Option<f64>,
    /// Whether they contradict each other: χ² above what chance gives once in a hundred.
    pub conflict: bool,
    /// Whether what is foretold was left out, since it yields to what is measured.
    pub yielded: bool,
}

/// All evidence of a member made one.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Whole {
    /// By zone, all causes together.
    pub zones: Zones,
    /// By cause.
    pub causes: BTreeMap<Cause, Zones>,
    /// The worst zone, which counts for the member.
    pub worst: Option<usize>,
    /// Contradictions, one line each.
    pub conflicts: Vec<String>,
    /// The sources on which at least one zone rests.
    pub counted: BTreeSet<&'static str>,
}

impl Whole {
    /// Damage of the member: that of its worst zone. Its error bar reaches as high as that of any
    /// zone, of those too that nobody looked into.
    #[must_use]
    pub fn damage(&self) -> Option<Estimate> {
        let Estimate { value, .. } = self.zones.0[self.worst?]?;
        let highest = self
            .zones
            .0
            .iter()
            .flatten()
            .map(|zone| zone.value + zone.std_error)
            .fold(value, f64::max);
        Some(Estimate { value, std_error: highest - value })
    }
}

/// What one source says of one cause in one zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<'a> {
    /// Which source.
    pub source: &'a str,
    /// Which cause.
    pub cause: Cause,
    /// What it says.
    pub reading: Estimate,
    /// Whether it was measured, and not foretold.
    pub measured: bool,
    /// How it stands for all of the zone.
    pub stands: Stands,
}

/// The least that an estimate must know of its own to be told from what it was given beforehand, as
/// a share of that.
const OWN: f64 = 1e-9;

impl Piece<'_> {
    /// What it says without what it was given beforehand: whoever has a prior of his own must not
    /// count that twice.
    fn alone(self) -> Self {
        let Some(prior) = self.stands.prior else { return self };
        let [own, given] = [self.reading.std_error.max(SMALLEST_ERROR), prior.max(SMALLEST_ERROR)]
            .map(|s| s.powi(-2));
        let precision = (own - given).max(OWN * given);
        let reading = Estimate {
            value: self.reading.value * own / precision,
            std_error: precision.sqrt().recip(),
        };
        Self { reading, ..self }
    }
}

/// What a loss of strength takes of stiffness, see the module.
const OF_STIFFNESS: [f64; 2] = [0.3, 1.0];
/// In how many places stiffness is lost without a trace, evenly up to what makes the profile's
/// standard error of that (ours).
const SOMEWHERE: f64 = 0.1;

/// What is lost without a trace, of a stiffness that is lost by that and by a known loss of
/// concrete: mean and deviation of its posterior, where beforehand it is nothing ± `unknown`.
fn without(mixed: Estimate, concrete: Estimate, unknown: f64) -> Estimate {
    const STEPS: usize = 24;
    let part = |k: usize| (k as f64 + 0.5) / STEPS as f64;
    let most = (unknown * (3.0 / SOMEWHERE).sqrt()).min(1.0);
    let [low, high] =
        [-3.0, 3.0].map(|z| (concrete.value + z * concrete.std_error).clamp(0.0, 1.0));
    let normal = |x: f64, of: Estimate| {
        let z = (x - of.value) / of.std_error.max(SMALLEST_ERROR);
        (-0.5 * z * z).exp()
    };
    // How probable what was read is, if so much is lost without a trace.
    let likelihood = |lost: f64| {
        let mut sum = 0.0;
        for c in (0..STEPS).map(|k| low + (high - low) * part(k)) {
            let shares =
                (0..STEPS).map(|k| OF_STIFFNESS[0] + (OF_STIFFNESS[1] - OF_STIFFNESS[0]) * part(k));
            let read = |share: f64| normal(1.0 - (1.0 - share * c) * (1.0 - lost), mixed);
            sum += normal(c, concrete) * shares.map(read).sum::<f64>();
        }
        sum
    };
    let weights = |k: usize| (most * part(k), SOMEWHERE / STEPS as f64);
    let all = (0..STEPS).map(weights).chain(std::iter::once((0.0, 1.0 - SOMEWHERE)));
    let [mut total, mut sum, mut squares] = [1e-300, 0.0, 0.0];
    for (lost, prior) in all {
        let weight = prior * likelihood(lost);
        (total, sum, squares) =
            (total + weight, sum + weight * lost, squares + weight * lost * lost);
    }
    let value = sum / total;
    Estimate { value, std_error: (squares / total - value * value).max(0.0).sqrt() }
}

/// No physics is surer than this: keeps a reading that claims no error from silencing all others.
const SMALLEST_ERROR: f64 = 0.005;

impl FusionRule {
    /// Standard error of a piece with what its source is blind to.
    fn error(&self, piece: &Piece) -> f64 {
        piece.reading.std_error.hypot(self.blind(piece.source, piece.cause)).max(SMALLEST_ERROR)
    }

    /// What a source is blind to within a cause.
    #[must_use]
    pub fn blind(&self, source: &str, cause: Cause) -> f64 {
        self.blindness.iter().find(|b| b.0 == source && b.1 == cause).map_or(0.0, |b| b.2)
    }

    fn correlation(&self, a: &str, b: &str) -> f64 {
        let is = |pair: &&(String, String, f64)| {
            (pair.0 == a && pair.1 == b) || (pair.0 == b && pair.1 == a)
        };
        self.correlation.iter().find(is).map_or(0.0, |pair| pair.2)
    }

    /// The best linear estimate and χ²; `None` where the declared correlations make no covariance.
    fn estimate(&self, pieces: &[Piece]) -> Option<(Estimate, f64)> {
        let n = pieces.len();
        // What is foretold is the prior of the place that was looked at: what lies between that and
        // the rest of the zone, neither knows of.
        let most = pieces.iter().map(|p| p.stands.between).fold(0.0, f64::max);
        let between = |p: &Piece| if p.measured { p.stands.between } else { most };
        let own = |p: &Piece| {
            (self.error(p).powi(2) - p.stands.between.powi(2)).max(SMALLEST_ERROR.powi(2)).sqrt()
        };
        let covariance = DMatrix::from_fn(n, n, |i, j| {
            let r = if i == j { 1.0 } else { self.correlation(pieces[i].source, pieces[j].source) };
            r * own(&pieces[i]) * own(&pieces[j]) + between(&pieces[i]) * between(&pieces[j])
        });
        let factor = covariance.cholesky()?;
        let said = DVector::from_fn(n, |i, _| pieces[i].reading.value);
        let weights = factor.solve(&DVector::repeat(n, 1.0));
        let total = weights.sum();
        let value = weights.dot(&said) / total;
        let apart = said.add_scalar(-value);
        let chi2 = apart.dot(&factor.solve(&apart));
        (total.is_finite() && total > 0.0).then(|| {
            (Estimate { value: value.clamp(0.0, 1.0), std_error: total.sqrt().recip() }, chi2)
        })
    }

    /// One cause in one zone. `None` where there is no evidence.
    #[must_use]
    pub(crate) fn fuse(&self, pieces: &[Piece]) -> Option<Fused> {
        if pieces.is_empty() {
            return None;
        }
        let (damage, chi2) = self.estimate(pieces)?;
        let freedom = pieces.len() - 1;
        let beyond =
            |freedom: usize, chi2: f64, z: f64| freedom > 0 && chi2 > chi2_point(freedom as f64, z);
        let conflict = beyond(freedom, chi2, ONCE_IN_A_HUNDRED);
        let told = (freedom > 0).then_some(chi2);
        if !beyond(freedom, chi2, ONCE_IN_TWENTY) {
            let has_prior = pieces.iter().any(|p| !p.measured);
            let alone: Vec<Piece> =
                pieces.iter().map(|p| if has_prior { p.alone() } else { *p }).collect();
            let damage = self.estimate(&alone).map_or(damage, |found| found.0);
            return Some(Fused { damage, chi2: told, conflict, yielded: false });
        }
        let measured: Vec<Piece> = pieces.iter().copied().filter(|p| p.measured).collect();
        let left = if measured.is_empty() { pieces } else { &measured };
        let (damage, chi2) = self.estimate(left)?;
        let damage = if beyond(left.len() - 1, chi2, ONCE_IN_A_HUNDRED) {
            self.largest(left)?
        } else {
            damage
        };
        Some(Fused { damage, chi2: told, conflict, yielded: left.len() < pieces.len() })
    }

    /// The safe side: the largest damage that is claimed. Its error bar of one σ reaches half way
    /// to the smallest.
    fn largest(&self, pieces: &[Piece]) -> Option<Estimate> {
        let most = pieces.iter().max_by(|a, b| a.reading.value.total_cmp(&b.reading.value))?;
        let least = pieces.iter().map(|p| p.reading.value).fold(f64::INFINITY, f64::min);
        Some(Estimate {
            value: most.reading.value,
            std_error: self.error(most).max(0.5 * (most.reading.value - least)),
        })
    }

    /// All causes and zones of a member.
    #[must_use]
    pub fn whole(&self, evidence: &[&Evidence]) -> Whole {
        let mut whole = Whole::default();
        for cause in Cause::ALL {
            let zones =
                Zones(std::array::from_fn(|zone| self.zone(evidence, cause, zone, &mut whole)));
            whole.causes.insert(cause, zones);
        }
        let unknown = |cause: &Cause| Estimate {
            value: 0.0,
            std_error: self.unknown.get(cause).copied().unwrap_or(0.0),
        };
        whole.zones = Zones(std::array::from_fn(|zone| {
            let known = whole.causes.values().any(|z| z.0[zone].is_some());
            let of =
                |(cause, zones): (&Cause, &Zones)| zones.0[zone].unwrap_or_else(|| unknown(cause));
            if known { all_causes(whole.causes.iter().map(of)) } else { None }
        }));
        whole.worst = whole.zones.worst().map(|(zone, _)| zone);
        whole
    }

    /// What one of them says of a cause in a zone, without what is known of causes that it mixes
    /// with it.
    fn piece<'a>(
        &self,
        one: &'a Evidence,
        evidence: &[&Evidence],
        whole: &Whole,
        cause: Cause,
        zone: usize,
    ) -> Option<Piece<'a>> {
        let reading = one.zones.get(&cause)?.0[zone]?;
        let mixed = one.mixed.iter().find(|mixed| mixed.0 == cause);
        let other = mixed.and_then(|mixed| measured(evidence, whole, mixed.1, zone));
        let unknown = self.unknown.get(&cause).copied().unwrap_or(0.0);
        Some(Piece {
            source: one.source,
            cause,
            reading: other.map_or(reading, |other| without(reading, other, unknown)),
            measured: one.measured,
            stands: one.stands.get(&cause).map_or(Stands::default(), |stands| stands[zone]),
        })
    }

    fn zone(
        &self,
        evidence: &[&Evidence],
        cause: Cause,
        zone: usize,
        whole: &mut Whole,
    ) -> Option<Estimate> {
        let speaks = |e: &&&Evidence| e.zones.get(&cause).is_some_and(|z| z.0[zone].is_some());
        // What another piece has taken in does not speak again.
        let is_in = |piece: &Piece| {
            evidence
                .iter()
                .filter(speaks)
                .any(|e| e.includes.iter().any(|(c, source)| *c == cause && source == piece.source))
        };
        let pieces: Vec<Piece> = evidence
            .iter()
            .filter_map(|e| self.piece(e, evidence, whole, cause, zone))
            .filter(|piece| !is_in(piece))
            .collect();
        let fused = self.fuse(&pieces)?;
        whole.counted.extend(
            evidence
                .iter()
                .filter(|e| speaks(e) && (e.measured || !fused.yielded))
                .map(|e| e.source),
        );
        if fused.conflict {
            let said: Vec<String> = pieces
                .iter()
                .map(|p| {
                    format!("{} {:.2} ± {:.2}", called(p.source), p.reading.value, self.error(p))
                })
                .collect();
            whole.conflicts.push(format!(
                "{}, {} of the axis: {}",
                cause.name(),
                place(zone),
                said.join(", ")
            ));
        }
        Some(fused.damage)
    }
}

/// What came of a cause that was fused before, where somebody measured it in the zone itself.
fn measured(evidence: &[&Evidence], whole: &Whole, cause: Cause, zone: usize) -> Option<Estimate> {
    let is_own = |e: &&Evidence| {
        let stands = e.stands.get(&cause).and_then(|stands| stands[zone].prior);
        let speaks = e.zones.get(&cause).is_some_and(|zones| zones.0[zone].is_some());
        e.measured && speaks && stands.is_none()
    };
    evidence.iter().any(is_own).then(|| whole.causes.get(&cause)?.0[zone]).flatten()
}

/// Points of the normal distribution that are exceeded by chance so often.
const ONCE_IN_TWENTY: f64 = 1.644_854;
const ONCE_IN_A_HUNDRED: f64 = 2.326_348;

/// The point of χ² that belongs to a point z of the normal distribution (Wilson and Hilferty 1931;
/// within 2 %).
pub fn chi2_point(freedom: f64, z: f64) -> f64 {
    let a = 2.0 / (9.0 * freedom);
    freedom * (1.0 - a + z * a.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zone::ZONES;

    fn says(source: &str, value: f64, std_error: f64, measured: bool) -> Piece<'_> {
        Piece {
            source,
            cause: Cause::Concrete,
            reading: Estimate { value, std_error },
            measured,
            stands: Stands::default(),
        }
    }

    fn close(a: Estimate, b: [f64; 2]) {
        assert!((a.value - b[0]).abs() < 1e-9 && (a.std_error - b[1]).abs() < 1e-9, "{a:?} {b:?}");
    }

    #[test]
    fn the_surer_piece_weighs_more() {
        let fused = FusionRule::default()
            .fuse(&[says("a", 0.2, 0.1, true), says("b", 0.4, 0.2, true)])
            .unwrap();
        close(fused.damage, [0.24, (1.0_f64 / 125.0).sqrt()]);
        assert!(!fused.conflict);
        assert_eq!(FusionRule::default().fuse(&[]), None);
    }

    /// Two pieces of the same error σ and correlation r: their mean, with σ √((1 + r)/2).
    #[test]
    fn what_errs_together_counts_less() {
        let rule = FusionRule {
            correlation: vec![("b".into(), "a".into(), 0.5)],
            ..FusionRule::default()
        };
        let fused = rule.fuse(&[says("a", 0.2, 0.1, true), says("b", 0.3, 0.1, true)]).unwrap();
        close(fused.damage, [0.25, 0.1 * 0.75_f64.sqrt()]);
        let impossible = FusionRule {
            correlation: vec![("a".into(), "b".into(), 1.5)],
            ..FusionRule::default()
        };
        assert_eq!(impossible.fuse(&[says("a", 0.2, 0.1, true), says("b", 0.3, 0.1, true)]), None);
    }

    #[test]
    fn blindness_widens() {
        let rule = FusionRule {
            blindness: vec![("a".into(), Cause::Concrete, 0.4)],
            ..FusionRule::default()
        };
        close(rule.fuse(&[says("a", 0.2, 0.3, true)]).unwrap().damage, [0.2, 0.5]);
    }

    #[test]
    fn the_prior_yields_to_what_is_measured() {
        let fused = FusionRule::default()
            .fuse(&[says("forecast", 0.0, 0.1, false), says("ct", 0.6, 0.05, true)])
            .unwrap();
        close(fused.damage, [0.6, 0.05]);
        assert!(fused.conflict);
    }

    #[test]
    fn contradictory_measurements_stay_on_the_safe_side() {
        let fused = FusionRule::default()
            .fuse(&[
                says("a", 0.1, 0.05, true),
                says("b", 0.6, 0.05, true),
                says("p", 0.1, 0.1, false),
            ])
            .unwrap();
        close(fused.damage, [0.6, 0.25]);
        assert!(fused.conflict);
    }

    /// A slice that is read exactly is what its plane is, whatever was foretold of it; what lies
    /// between widens what follows of the zone. Of two places that both know a prior it counts
    /// once.
    #[test]
    fn what_lies_between_comes_after_what_both_speak_of() {
        let forecast = says("forecast", 0.0, 0.3, false);
        let seen = |stands| Piece { stands, ..says("ct", 0.4, 0.1_f64.hypot(0.15), true) };
        let [weight, both] = [0.09 / 0.1, 0.09 * 0.01 / 0.1];
        let fused = FusionRule::default()
            .fuse(&[forecast, seen(Stands { between: 0.15, prior: None })])
            .unwrap();
        close(fused.damage, [0.4 * weight, f64::sqrt(both + 0.15 * 0.15)]);
        // Alone it is what it was.
        close(
            FusionRule::default()
                .fuse(&[seen(Stands { between: 0.15, prior: None })])
                .unwrap()
                .damage,
            [0.4, 0.1_f64.hypot(0.15)],
        );
        // Estimated from elsewhere about nothing, with the forecast's own spread: the forecast says
        // nothing new.
        let krige =
            |prior| Piece { stands: Stands { between: 0.0, prior }, ..says("ct", 0.2, 0.2, true) };
        close(
            FusionRule::default().fuse(&[forecast, krige(Some(0.3))]).unwrap().damage,
            [0.2, 0.2],
        );
        // From so far away that it knows nothing: what is foretold.
        let far = Piece {
            stands: Stands { between: 0.0, prior: Some(0.3) },
            ..says("ct", 0.0, 0.3, true)
        };
        close(
            FusionRule::default().fuse(&[says("forecast", 0.1, 0.3, false), far]).unwrap().damage,
            [0.1, 0.3],
        );
    }

    /// χ² 4.9 of one degree of freedom: beyond once in twenty, within once in a hundred.
    #[test]
    fn the_prior_yields_before_it_contradicts() {
        let fused = FusionRule::default()
            .fuse(&[says("forecast", 0.0, 0.3, false), says("ct", 0.7, 0.1, true)])
            .unwrap();
        close(fused.damage, [0.7, 0.1]);
        assert!(!fused.conflict && fused.chi2.unwrap() > 3.84);
    }

    #[test]
    fn causes_come_together_and_the_unknown_widens() {
        let zones = |value| Zones::all(Estimate { value, std_error: 0.1 });
        let seen = Evidence::new("ct", true, [(Cause::Concrete, zones(0.5))].into(), String::new())
            .unwrap();
        let felt =
            Evidence::new("gauges", true, [(Cause::Stiffness, zones(0.5))].into(), String::new())
                .unwrap();
        let rule = FusionRule { unknown: [(Cause::Steel, 0.2)].into(), ..FusionRule::default() };
        let whole = rule.whole(&[&seen, &felt]);
        close(whole.damage().unwrap(), [0.75, (2.0 * 0.05_f64.powi(2) + 0.05_f64.powi(2)).sqrt()]);
        assert_eq!((whole.worst, whole.conflicts.len()), (Some(0), 0));
        assert_eq!(rule.whole(&[]).damage(), None);
        let contrary =
            Evidence::new("knocked", true, [(Cause::Concrete, zones(0.0))].into(), String::new())
                .unwrap();
        assert_eq!(rule.whole(&[&seen, &contrary]).conflicts.len(), ZONES);
    }

    /// A zone that nobody looked into may be worse than the worst that was seen.
    #[test]
    fn the_members_error_bar_reaches_as_high_as_any_zones() {
        let of = |value, std_error| Some(Estimate { value, std_error });
        let mut whole = Whole { worst: Some(1), ..Whole::default() };
        whole.zones.0[..3].copy_from_slice(&[of(0.05, 0.3), of(0.2, 0.05), None]);
        close(whole.damage().unwrap(), [0.2, 0.15]);
        whole.zones.0[0] = of(0.05, 0.1);
        close(whole.damage().unwrap(), [0.2, 0.05]);
    }

    #[test]
    fn chi2_points() {
        for (freedom, point, z) in [
            (1.0, 6.635, ONCE_IN_A_HUNDRED),
            (2.0, 9.210, ONCE_IN_A_HUNDRED),
            (5.0, 15.086, ONCE_IN_A_HUNDRED),
            (1.0, 3.841, ONCE_IN_TWENTY),
        ] {
            assert!((chi2_point(freedom, z) / point - 1.0).abs() < 0.025, "{freedom} {point}");
        }
    }
}
