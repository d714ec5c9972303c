//! The life of a span's decisive sections: cracks by what has bent them, salt, carbonic acid and
//! rust by exposure class.

use std::collections::BTreeMap;

use intrados_damage::{
    evidence::{Cause, Evidence},
    grading::Profile,
    verdict::{Basis, Looked, Verdict},
    zone::{ZONES, Zones, together},
};
use intrados_mechanics::material::{
    concrete::{secant_modulus, tensile_strength},
    durability::{Bars, Corrosion, CorrosionError},
};
use intrados_stage::{Estimate, time::YEAR};
use serde::{Deserialize, Serialize};

use super::{Kind, Span};
use crate::{
    FORECAST, Foretold, Tie, crack_width,
    life::{CONCRETE_ASSUMED, STEEL_ASSUMED},
    width::E_STEEL,
};

/// From when to when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The year that is now.
    pub now: i32,
    /// Years from then on.
    pub ahead_years: f64,
}

/// What is said of a span.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    /// Damage now with its standard error, and as it is foretold for later.
    pub damage: Estimate,
    /// Later, without an error of its own.
    pub later: f64,
    /// The worst of its sections now.
    pub worst: Foretold,
    /// Probability that bars rust now.
    pub rusts: f64,
    /// Widest cracks now, mm.
    pub crack_mm: f64,
    /// What that is called, and how probable each state is.
    pub verdict: Verdict,
}

/// Creep of concrete that is loaded when it is a month old and stays outside (EN 1992-1-1, figure
/// 3.1, sections of .3 to .5 m).
const CREEP: f64 = 2.0;
/// Of the air, K: Ontario's mean.
const TEMPERATURE: f64 = 280.15;
/// What guessed measures of the section add to the relative error of cracks: their stress is off by
/// a half.
const MEASURES: f64 = 0.5;
/// Bars that are nearer or farther than this are not laid, m.
const SPACING: [f64; 2] = [0.075, 0.3];

/// What attacks sections of the same concrete is worked out once.
#[derive(Debug, Default)]
pub struct Sections(BTreeMap<(&'static str, &'static str), Result<Corrosion, CorrosionError>>);

/// One section: what is below or above.
struct Section {
    cover: f64,
    steel: f64,
    /// What always acts, and that with all traffic, N·m.
    moments: [f64; 2],
    classes: &'static str,
    attacked: i32,
}

impl Sections {
    /// The life of a span by its sections.
    ///
    /// # Errors
    /// Why nothing is computed of rust.
    pub fn live(
        &mut self,
        span: &Span,
        settings: Settings,
        profile: &Profile,
    ) -> Result<Life, CorrosionError> {
        let section = |k: usize, [dead, live]: [f64; 2], classes| Section {
            cover: span.cover[k],
            steel: span.steel[k],
            moments: [dead, dead + live],
            classes,
            attacked: span.attacked[k],
        };
        // Below: spray of the road under it. Above: the salted deck itself.
        let below =
            self.foretell(span, &section(0, span.moments, "XD1, XC4"), settings, profile)?;
        let above =
            self.foretell(span, &section(1, span.over_support, "XD3, XC4"), settings, profile)?;
        // Between the supports its soffit counts, near them, where it goes on, its top. Of a deck
        // both are everywhere: the worse counts.
        let is_above = |zone: usize| match span.kind {
            Kind::Deck => above.0[0].damage > below.0[0].damage,
            _ => span.continuous && !(2..ZONES - 2).contains(&zone),
        };
        let told = |then: usize| {
            std::array::from_fn(|zone| if is_above(zone) { above.0[then] } else { below.0[then] })
        };
        let rusts = (0..ZONES)
            .map(|zone| if is_above(zone) { above.1 } else { below.1 })
            .fold(0.0, f64::max);
        Ok(of_foretold([told(0), told(1)], rusts, profile))
    }

    /// Now and later, and the probability that its bars rust now.
    fn foretell(
        &mut self,
        span: &Span,
        section: &Section,
        settings: Settings,
        profile: &Profile,
    ) -> Result<([Foretold; 2], f64), CorrosionError> {
        let corrosion = self
            .0
            .entry((span.class, section.classes))
            .or_insert_with(|| Corrosion::of_class(section.classes, span.fck, TEMPERATURE));
        let corrosion = corrosion.as_ref().map_err(Clone::clone)?;
        let bars = [Bars { weight: 1.0, cover: section.cover, diameter: span.diameter }];
        let (share, width) = cracks(span, section);
        let concrete = share * (1e3 * width / profile.rule.open_crack_mm).min(1.0);
        let foretell = |years: f64| {
            let lost = corrosion.lost(&bars, years.max(0.0) * YEAR);
            let told = Foretold {
                cracked: share,
                crack_mm: 1e3 * width,
                crushed: 0.0,
                steel_lost: Some(lost.share),
                steel_lost_std_error: lost.std_error,
                concrete,
                damage: together([concrete, lost.share]),
            };
            (told, lost.depassivated)
        };
        let age = f64::from(settings.now - section.attacked);
        let (now, rusts) = foretell(age);
        let (later, _) = foretell(age + settings.ahead_years);
        Ok(([now, later], rusts))
    }
}

/// The share of a section that is cracked and the width of its cracks, m: cracked if all that has
/// acted exceeds the cracking moment, open by what always acts, after creep.
fn cracks(span: &Span, section: &Section) -> (f64, f64) {
    let [width, height] = span.section;
    let depth = height - section.cover - 0.5 * span.diameter;
    let [dead, most] = section.moments;
    let strength = tensile_strength(span.fck);
    if depth <= 0.0 || most <= strength * width * height * height / 6.0 {
        return (0.0, 0.0);
    }
    let modulus = secant_modulus(span.fck + 8e6);
    let ratio = (1.0 + CREEP) * E_STEEL / modulus * section.steel / width;
    // ½ b x² = n A_s (d − x).
    let neutral = ratio * ((1.0 + 2.0 * depth / ratio).sqrt() - 1.0);
    let one = std::f64::consts::FRAC_PI_4 * span.diameter.powi(2);
    let tie = Tie {
        stress: dead / (section.steel * (depth - neutral / 3.0)),
        diameter: span.diameter,
        spacing: (one * width / section.steel).clamp(SPACING[0], SPACING[1]),
        cover: section.cover,
        tensile_strength: strength,
        modular_ratio: E_STEEL / modulus,
    };
    (1.0 - neutral / height, crack_width(&tie))
}

/// What is said of a span by what is foretold of its zones now and later, whoever has: everything
/// about it is assumed.
#[must_use]
pub fn of_foretold([now, later]: [[Foretold; ZONES]; 2], rusts: f64, profile: &Profile) -> Life {
    let assumed = CONCRETE_ASSUMED.hypot(STEEL_ASSUMED).hypot(MEASURES);
    let relative = profile.forecast_error.hypot(assumed);
    let concrete = now
        .each_ref()
        .map(|t| Some(Estimate { value: t.concrete, std_error: relative * t.concrete }));
    let steel = now.each_ref().map(|t| {
        let value = t.steel_lost?;
        Some(Estimate { value, std_error: t.steel_lost_std_error })
    });
    let mut zones = BTreeMap::from([(Cause::Concrete, Zones(concrete))]);
    if steel.iter().any(Option::is_some) {
        zones.insert(Cause::Steel, Zones(steel));
    }
    let most = |of: fn(&Foretold) -> f64| now.iter().map(of).fold(0.0, f64::max);
    let crack_mm = most(|t| t.crack_mm);
    let basis = "assumed from the length and the year of a span".to_owned();
    let evidence = Evidence::new(FORECAST, false, zones, basis)
        .map(|e| Evidence { crack_width_mm: (crack_mm > 0.0).then_some(crack_mm), ..e });
    let evidence: Vec<&Evidence> = evidence.iter().collect();
    let damage = profile.fusion.whole(&evidence).damage();
    let cracks = profile.cracks(&evidence);
    let verdict = Verdict::of(profile, damage, &cracks, Basis::Forecast, Looked::NOWHERE);
    let worst = now.iter().copied().max_by(|a, b| a.damage.total_cmp(&b.damage));
    Life {
        damage: damage.unwrap_or_default(),
        later: later.iter().map(|t| t.damage).fold(0.0, f64::max),
        worst: worst.unwrap_or_default(),
        rusts,
        crack_mm,
        verdict,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::span::{Bridge, spans};

    fn life(length: f64, year: i32, now: i32) -> Life {
        let bridge = Bridge { spans: vec![length], year: Some(year), ..Bridge::default() };
        let span = spans(&bridge).remove(0).unwrap();
        let settings = Settings { now, ahead_years: 20.0 };
        Sections::default().live(&span, settings, &Profile::default()).unwrap()
    }

    /// The slab of the rules' test, by hand: E_cm = 22 · 2.8^.3 = 29.96 GPa, n = 3 · 200/29.96 =
    /// 20.03, n A_s = .1056 m² a metre, x = .1056 (√(1 + 2 · .4295/.1056) − 1) = .2140 m; stress
    /// 140.5e3/(5.274e-3 (.4295 − .0713)) = 74.4 MPa.
    #[test]
    fn cracks_by_hand() {
        let bridge = Bridge { spans: vec![9.0], year: Some(1970), ..Bridge::default() };
        let span = spans(&bridge).remove(0).unwrap();
        let section = Section {
            cover: span.cover[0],
            steel: span.steel[0],
            moments: [span.moments[0], span.moments[0] + span.moments[1]],
            classes: "XD1, XC4",
            attacked: 1970,
        };
        let (share, width) = cracks(&span, &section);
        assert!((share - (1.0 - 0.2140 / 0.48)).abs() < 5e-3, "{share}");
        let by_hand = crack_width(&Tie {
            stress: 74.4e6,
            diameter: span.diameter,
            spacing: std::f64::consts::FRAC_PI_4 * span.diameter.powi(2) / span.steel[0],
            cover: 0.038,
            tensile_strength: tensile_strength(20e6),
            modular_ratio: 200.0 / 29.96,
        });
        assert!((width / by_hand - 1.0).abs() < 0.02, "{width} {by_hand}");
        // What never reached the cracking moment has none.
        let sound = Section { moments: [1.0, 2.0], ..section };
        assert_eq!(cracks(&span, &sound), (0.0, 0.0));
    }

    /// The older of two spans of one kind has lost no less, and error bars are wide: nothing was
    /// measured.
    #[test]
    fn age_costs_steel_and_certainty_is_never_claimed() {
        let [young, old] = [2020, 1980].map(|year| life(10.0, year, 2026));
        assert!(old.worst.steel_lost > young.worst.steel_lost, "{old:?} {young:?}");
        assert!(old.rusts > young.rusts && old.later >= old.worst.damage);
        for life in [&young, &old] {
            assert!(life.damage.std_error > 0.2, "{life:?}");
            assert!((life.verdict.probability.values().sum::<f64>() - 1.0).abs() < 1e-9);
        }
    }
}
