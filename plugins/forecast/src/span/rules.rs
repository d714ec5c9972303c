//! What is assumed of a span of which its length and its year are known. `docs/network.md` says the
//! same with the sources; none of it replaces a drawing.

use intrados_mechanics::material::concrete::Class;
use intrados_scene::import::concrete_of;
use serde::{Deserialize, Serialize};

use super::Bridge;

/// What of a span is forecast.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A solid slab, a metre of its width.
    Slab,
    /// A reinforced beam with the deck that it carries.
    Beam,
    /// The concrete deck on girders of steel or prestressed concrete; not the girders.
    Deck,
}

impl Kind {
    /// Its name, as in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Slab => "slab",
            Self::Beam => "beam",
            Self::Deck => "deck on girders",
        }
    }
}

/// A span as it is assumed. SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// What of it is forecast.
    pub kind: Kind,
    /// Length of the span, m; what bends is `reach` long.
    pub length: f64,
    /// From support to support of what bends, m: the span, or of a deck from girder to girder.
    pub reach: f64,
    /// Whether it goes on over a support.
    pub continuous: bool,
    /// Across and down, m.
    pub section: [f64; 2],
    /// Name of the strength class.
    pub class: &'static str,
    /// Characteristic strength, Pa.
    pub fck: f64,
    /// Concrete over the bars below and above, m.
    pub cover: [f64; 2],
    /// Diameter of its bars, m.
    pub diameter: f64,
    /// Area of bars below, in the middle, and above, over the supports, m².
    pub steel: [f64; 2],
    /// What always acts, and what traffic adds at most, in the middle; N·m.
    pub moments: [f64; 2],
    /// The same over a support, downwards positive; 0 where it does not go on.
    pub over_support: [f64; 2],
    /// What always acts beside its own weight, N/m.
    pub surfacing: f64,
    /// The line load that bends it as much as traffic does, N/m.
    pub traffic: f64,
    /// The years from which salt and air attack it from below and from above.
    pub attacked: [i32; 2],
}

/// Reinforced concrete with surfacing, N/m³.
const CONCRETE: f64 = 24.5e3;
/// 90 mm of asphalt, N/m².
const ASPHALT: f64 = 0.09 * 23.5e3;
/// Distance of beams and girders, m.
const APART: f64 = 2.4;
/// Width of a beam's web, m.
const WEB: f64 = 0.45;
/// Thickness of a deck on beams and girders, m.
const DECK: f64 = 0.2;
/// Longest slab and longest reinforced beam, m.
const LONGEST: [f64; 2] = [12.0, 25.0];
/// Roads are salted from then on.
const SALT: i32 = 1955;
/// Width of a lane, m.
const LANE: f64 = 3.05;

/// The spans of a bridge, in their order; those that nothing is computed of are told apart by why.
#[must_use]
pub fn spans(bridge: &Bridge) -> Vec<Result<Span, &'static str>> {
    if bridge.spans.is_empty() {
        return vec![Err("no length of a span is given")];
    }
    let continuous = bridge.spans.len() > 1;
    let span = |&length: &f64| {
        let year = bridge.year.ok_or("no year of building is given")?;
        span(length, continuous, year, bridge.rehabilitated)
    };
    bridge.spans.iter().map(span).collect()
}

fn span(
    length: f64,
    continuous: bool,
    year: i32,
    rehabilitated: Option<i32>,
) -> Result<Span, &'static str> {
    if length < 2.0 {
        return Err("shorter than 2 m: no length of a bridge's span");
    }
    let kind = match length {
        l if l <= LONGEST[0] => Kind::Slab,
        l if l <= LONGEST[1] => Kind::Beam,
        _ => Kind::Deck,
    };
    let class = concrete_of(Some(year));
    let fck = class.parse::<Class>().map_err(|_| "its class of concrete is not known")?.fck;
    // What bends: a deck goes on over every girder.
    let (reach, continuous) = if kind == Kind::Deck { (APART, true) } else { (length, continuous) };
    let section = section(kind, length, continuous);
    let cover = cover(kind, year);
    let carried = if kind == Kind::Beam { APART } else { 1.0 };
    let deck = if kind == Kind::Beam { DECK * (APART - WEB) } else { 0.0 };
    let surfacing = ASPHALT * carried + deck * CONCRETE;
    let dead = CONCRETE * section[0] * section[1] + surfacing;
    let live = traffic(kind, reach, carried);
    // A beam on many supports: .07 q l² between and .1 q l² over them (the usual coefficients of
    // equal spans, rounded), a simple one q l²/8.
    let [between, over] = if continuous { [0.08, 0.1] } else { [0.125, 0.0] };
    let simple = reach * reach;
    let moments = [dead * simple * between, live * between / 0.125];
    let over_support = [dead * simple * over, live * over / 0.125];
    let allowed = if year < 1975 { 140e6 } else { 165e6 };
    let diameter = if kind == Kind::Beam { 0.035 } else { 0.025_f64.min(0.5 * cover[0] + 0.005) };
    let steel = |moments: [f64; 2], cover: f64| {
        let depth = (section[1] - cover - 0.5 * diameter).max(0.3 * section[1]);
        let least = 0.0015 * section[0] * depth;
        ((moments[0] + moments[1]) / (allowed * 0.9 * depth)).max(least)
    };
    Ok(Span {
        kind,
        length,
        reach,
        continuous,
        section,
        class,
        fck,
        cover,
        diameter,
        steel: [steel(moments, cover[0]), steel(over_support, cover[1])],
        moments,
        over_support,
        surfacing,
        traffic: 8.0 * live / simple,
        attacked: [year.max(SALT), rehabilitated.unwrap_or(year).max(year).max(SALT)],
    })
}

/// Across and down, m: the depths that AASHTO (LRFD, table 2.5.2.6.3-1) gives for constant depth.
fn section(kind: Kind, length: f64, continuous: bool) -> [f64; 2] {
    match (kind, continuous) {
        (Kind::Slab, false) => [1.0, 1.2 * (length + 3.0) / 30.0],
        (Kind::Slab, true) => [1.0, ((length + 3.0) / 30.0).max(0.165)],
        (Kind::Beam, false) => [WEB, 0.070 * length],
        (Kind::Beam, true) => [WEB, 0.065 * length],
        (Kind::Deck, _) => [1.0, DECK],
    }
}

/// Concrete over the bars below and above, m. Ours, by what was ordinary: one inch and one and a
/// half before 1965, one and a half and two until 1979, 50 and 70 mm since.
fn cover(kind: Kind, year: i32) -> [f64; 2] {
    let [below, above]: [f64; 2] = match year {
        y if y < 1965 => [0.025, 0.038],
        y if y < 1979 => [0.038, 0.050],
        _ => [0.050, 0.070],
    };
    // A deck is too thin for more.
    if kind == Kind::Deck { [below.min(0.04), above] } else { [below, above] }
}

/// The moment of traffic of a simple span of what bends, N·m: HS20-44's lane or truck with its
/// impact, on the width that it carries (AASHTO Standard Specifications, 3.7 and 3.8.2, 3.24.3 for
/// decks).
fn traffic(kind: Kind, reach: f64, carried: f64) -> f64 {
    let impact = 1.0 + (15.24 / (reach + 38.1)).min(0.3);
    if kind == Kind::Deck {
        // Strip of a metre, P = 72 kN: (S + .61)/9.74 P.
        return impact * (reach + 0.61) / 9.74 * 72e3;
    }
    let lane = 9.34e3 * reach * reach / 8.0 + 80e3 * reach / 4.0;
    // Two axles of 142 kN and one of 36 kN, 4.27 m apart, about the middle.
    let truck = 142e3 * reach / 4.0 + (142e3 + 36e3) * (0.5 * reach - 4.27).max(0.0) / 2.0;
    impact * lane.max(truck) * carried / LANE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bridge(spans: &[f64], year: i32) -> Bridge {
        Bridge { spans: spans.to_vec(), year: Some(year), ..Bridge::default() }
    }

    /// A slab of 9 m from 1970, by hand: 1.2 · 12/30 = .48 m deep; dead 24.5 · .48 + 2.115 = 13.875
    /// kN/m, 140.5 kN·m; impact .3; lane 9.34 · 81/8 + 80 · 9/4 = 274.6, truck 142 · 9/4 + 178 ·
    /// .23/2 = 340 kN·m: 1.3 · 340/3.05 = 144.9 kN·m; depth .48 − .038 − .012 = .430 m; A_s = 285.4
    /// kN·m/(140 MPa · .9 · .430 m) = 5271 mm².
    #[test]
    fn a_slab_by_hand() {
        let slab = spans(&bridge(&[9.0], 1970)).remove(0).unwrap();
        assert_eq!((slab.kind, slab.class, slab.continuous), (Kind::Slab, "C20/25", false));
        assert!((slab.section[1] - 0.48).abs() < 1e-12);
        assert!((slab.moments[0] - 140.5e3).abs() < 0.2e3, "{slab:?}");
        assert!((slab.moments[1] - 144.9e3).abs() < 0.3e3, "{slab:?}");
        assert!((slab.steel[0] / 5271e-6 - 1.0).abs() < 5e-3, "{slab:?}");
    }

    #[test]
    fn what_is_not_known_is_not_computed() {
        let nameless = Bridge { spans: vec![10.0], ..Bridge::default() };
        assert!(spans(&nameless)[0].is_err());
        assert!(spans(&bridge(&[], 1970))[0].is_err());
        assert!(spans(&bridge(&[1.0], 1970))[0].is_err());
        let deck = spans(&bridge(&[60.0], 1990)).remove(0).unwrap();
        assert_eq!((deck.kind, deck.reach), (Kind::Deck, 2.4));
    }

    /// A major rehabilitation renews the cover above, not that below.
    #[test]
    fn rehabilitation_renews_what_lies_above() {
        let renewed = Bridge { rehabilitated: Some(2005), ..bridge(&[10.0, 10.0], 1950) };
        let span = spans(&renewed).remove(0).unwrap();
        assert_eq!(span.attacked, [1955, 2005]);
    }
}
