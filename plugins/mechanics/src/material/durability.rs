//! What makes steel rust in an exposure class of EN 206, where a scene names the class and nothing
//! else.
//!
//! Every value here is *assumed*, has a source and a spread; whoever uses one must say so
//! ([`Corrosion::assumed`]).
//!
//! | what | value | source |
//! |---|---|---|
//! | water/cement | .65, .60, .55, .45 of C20, C25, C30, C35 and better (the largest that goes with it), within .45 to .60 | EN 206-1, table F.1 |
//! | R_ACC,0⁻¹ | 5.2, 6.8, 9.8, 13.4 e-11 m²/s per kg/m³ at w/c .45, .50, .55, .60 (CEM I), s = .69 m^.78 | fib Bulletin 34, B1 |
//! | k_t, ε_t, C_s | 1.25 ± .35, 315.5 ± 48 mm²/a per kg/m³, (8.2 ± 1) e-4 kg/m³ of CO₂ | fib Bulletin 34, B1 |
//! | D_RCM,0 | 10.0, 15.8, 19.7, 25.0 e-12 m²/s at the same w/c (CEM I), s = .2 m | fib Bulletin 34, B2 |
//! | ageing, b_e | Beta(.30, .12) on 0 to 1; 4800 ± 700 K | fib Bulletin 34, B2 |
//! | critical chloride | Beta(.60, .15) on .2 to 2 % of the binder | fib Bulletin 34, B2 |
//! | convection Δx | Beta(8.9, 5.6) on 0 to 50 mm in splash, else 0 | fib Bulletin 34, B2 |
//! | chloride at the surface, XS | A w/c: A 2.565 ± .356 (air), 10.348 ± .714 (submerged), 7.758 ± 1.360 (tide and splash), ± .405, .580, 1.105 of the fit, % of the binder | DuraCrete R17 (2000) |
//! | chloride at the surface, XD1, XD3 | .465 − .051 ln(x_a + 1) − .00065 (x_a + 1)^−.187 x_h % of the concrete (cm from the road, above it), s = .75 m, concrete of 2350 kg/m³ | fib Bulletin 34, B2 |
//! | cement | 300 (XD1), 320 kg/m³ (XD3) | EN 206-1, table F.1 |
//! | rust, µm a year | carbonated: sheltered 2 ± 3, in the rain 5 ± 7; chloride: dried and wetted, sea air 30 ± 40, submerged 4 ± 7, tide 50 ± 100; lognormal | fib MC2020, table 30.1-6, fib Bulletin 111 |
//! | cover | ± 8 mm | fib Bulletin 34, B1 |
//!
//! Ours, since no code gives them: humidity 65 % in XC1, 90 % in XC2, 75 % in XC3, 80 % in XC4, ± 8
//! points; three days of curing; no rain (W = 1, on the safe side); XD3 1.5 m from the road and 1 m
//! above it, XD1 five metres and 1.5 m. For XD2 (pools, industrial water) no source of ours knows
//! how much salt there is: nothing is computed. Most values were read in transcriptions (fib's
//! StructuralCodes, rational-rc, pyre), and nobody has held them against the printed codes yet.

use intrados_stage::random::Key;
use statrs::distribution::{Beta, ContinuousCDF, LogNormal, Normal};

use super::{
    YEAR,
    carbonation::{self, Front},
    chloride::{Ingress, corroded},
    steel::remaining_section,
};

/// What takes the skin of steel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attack {
    /// Salt.
    Chloride {
        /// How it comes.
        ingress: Ingress,
        /// Content at which steel begins to rust.
        critical: f64,
        /// Depth that splashes carry it to at once, Δx, m.
        convection: f64,
    },
    /// Carbonic acid.
    Carbonation(Front),
}

/// Rust of a member's bars: when it begins and how fast it goes on.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrosion {
    /// What begins it.
    pub attack: Attack,
    /// Corrosion current afterwards, A/m².
    pub current: f64,
    /// What was assumed, and whose value it is; empty: all was given.
    pub assumed: Vec<String>,
    /// Where air attacks beside salt: how, by the means of what was assumed.
    pub beside: Option<Carbonated>,
    /// What else it may be, equally likely each; empty: nothing else.
    others: Vec<Other>,
    /// By which class that is, and the strength of the concrete, Pa.
    acid: Option<(&'static Acid, f64)>,
    /// Where all that may be is drawn from.
    spread: Spread,
}

/// One of the things that may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Other {
    /// What begins the rust.
    pub attack: Attack,
    /// Corrosion current afterwards, A/m².
    pub current: f64,
    /// By how much covers differ from the drawing, m.
    pub cover: f64,
    /// Where air attacks beside salt: rust begins with the front that comes first, and goes on as
    /// with salt once that is there, too.
    pub beside: Option<Carbonated>,
    /// Where something else has begun the rust, whatever the cover: when, s after the attack began.
    pub since: Option<f64>,
}

/// Carbonation where salt attacks, too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carbonated {
    /// Its front.
    pub front: Front,
    /// Corrosion current of steel that it has reached and salt has not, A/m².
    pub current: f64,
}

/// What is not known exactly of an attack.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Spread {
    /// Of an exposure class by carbonation, in a concrete of this strength (Pa).
    Acid(&'static Acid, f64),
    /// Of an exposure class by salt, in a concrete of this strength (Pa) at this temperature (K).
    Salt(&'static Salt, f64, f64),
    /// What somebody gave: he has measured or looked it up, and is off by some tenths.
    Given(Attack, f64),
}

/// Why nothing is computed of the rust of a member.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CorrosionError {
    /// A drawing without steel, or a model that shows none.
    #[error("no bars are known of it")]
    NoBars,
    /// Nothing says where the member stands.
    #[error("no exposure class is given: add exposure: (class: \"XC3\", years: …)")]
    NoClass,
    /// A file that knows members by their bricks alone.
    #[error("a deck says nothing of exposure")]
    Deck,
    /// Class XD2.
    #[error(
        "XD2: how much chloride there is in pools and industrial water no code says: give exposure.chloride"
    )]
    UnknownChloride,
    /// Classes of frost or of other attack on concrete alone.
    #[error(
        "{0} speaks of no attack on steel: name an XC, XD or XS class beside it if there is one"
    )]
    NoAttack(String),
}

/// A group of bars that lie alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bars {
    /// Any measure of how much steel they are.
    pub weight: f64,
    /// Concrete over them, m.
    pub cover: f64,
    /// Diameter, m.
    pub diameter: f64,
}

/// How much of some bars is gone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Lost {
    /// Share of their section.
    pub share: f64,
    /// Standard error from what was assumed; 0 where all was given.
    pub std_error: f64,
    /// Probability that any of them rusts at all.
    pub depassivated: f64,
}

impl Attack {
    /// When steel under `cover` (m) begins to rust, s after the attack began; infinite: never.
    #[must_use]
    pub(crate) fn initiation(&self, cover: f64) -> f64 {
        match self {
            Self::Chloride { ingress, critical, convection } => {
                ingress.initiation((cover - convection).max(0.0), *critical)
            }
            Self::Carbonation(front) => front.initiation(cover),
        }
    }

    /// Its name, for people.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Chloride { .. } => "chloride",
            Self::Carbonation(_) => "carbonation",
        }
    }
}

/// µA/cm² of 1 µm a year (Faraday, 11.6 µm), as A/m².
const PER_MICROMETRE: f64 = 0.01 / 11.6;
/// Things that may be, a member.
const OTHERS: u64 = 512;
/// Seed of all of them: the same of every member, so that neighbours of one kind are alike.
const SEED: u64 = 0x7275_7374;
/// The same of carbonation beside salt.
const SEED_BESIDE: u64 = 0x0061_6972;

impl Corrosion {
    /// By an attack that is known.
    #[must_use]
    pub(crate) fn given(attack: Attack, current: f64) -> Self {
        let spread = Spread::Given(attack, current);
        Self {
            attack,
            current,
            assumed: Vec::new(),
            beside: None,
            others: Vec::new(),
            acid: None,
            spread,
        }
    }

    /// By exposure classes alone (`"XC4, XD3"`), see the table of this module: `fck` in Pa,
    /// `temperature` in K.
    ///
    /// # Errors
    /// Why nothing is computed.
    pub fn of_class(class: &str, fck: f64, temperature: f64) -> Result<Self, CorrosionError> {
        Self::assumed(class.split(", "), fck, temperature)
    }

    /// So many things that may be, equally likely each: for whoever knows more and weighs them. The
    /// first are those that [`lost`](Self::lost) is the mean of, where something was assumed.
    #[must_use]
    pub fn possible(&self, count: usize) -> Vec<Other> {
        (0..count as u64).map(|k| drawn(self.spread, self.acid, k)).collect()
    }

    /// With the carbonation of a class that is named beside salt; as it is where none is.
    #[must_use]
    pub(crate) fn beside<'a>(mut self, classes: impl Iterator<Item = &'a str>, fck: f64) -> Self {
        let named: Vec<&str> = classes.collect();
        let class = CARBONATION.iter().find(|c| named.contains(&c.name));
        let Some(class) = class.filter(|_| matches!(self.attack, Attack::Chloride { .. })) else {
            return self;
        };
        self.acid = Some((class, fck));
        let (attack, current, assumed) = class.means(fck);
        if let Attack::Carbonation(front) = attack {
            self.beside = Some(Carbonated { front, current });
        }
        self.assumed.extend(assumed);
        self.others =
            (0..self.others.len() as u64).map(|k| drawn(self.spread, self.acid, k)).collect();
        self
    }

    /// Whether carbonation is computed, alone or beside salt.
    #[must_use]
    pub fn carbonates(&self) -> bool {
        self.beside.is_some() || matches!(self.attack, Attack::Carbonation(_))
    }

    /// By the exposure class alone, of a concrete of characteristic strength `fck` (Pa) at a mean
    /// `temperature` (K). Of several classes the first in the order XS3, XS2, XS1, XD3, XD1, XC4 …
    /// counts.
    ///
    /// # Errors
    /// Why nothing is computed.
    pub(crate) fn assumed<'a>(
        classes: impl Iterator<Item = &'a str>,
        fck: f64,
        temperature: f64,
    ) -> Result<Self, CorrosionError> {
        let named: Vec<&str> = classes.collect();
        if let Some(class) = CHLORIDE.iter().find(|c| named.contains(&c.name)) {
            let salt = Spread::Salt(class, fck, temperature).corrosion();
            return Ok(salt.beside(named.iter().copied(), fck));
        }
        if named.contains(&"XD2") {
            return Err(CorrosionError::UnknownChloride);
        }
        match CARBONATION.iter().find(|c| named.contains(&c.name)) {
            Some(class) => Ok(Spread::Acid(class, fck).corrosion()),
            None if named.is_empty() => Err(CorrosionError::NoClass),
            None => Err(CorrosionError::NoAttack(named.join(", "))),
        }
    }

    /// When steel under `cover` (m) begins to rust, s after the attack began.
    #[must_use]
    pub fn initiation(&self, cover: f64) -> f64 {
        let beside = self.beside.map_or(f64::INFINITY, |air| air.front.initiation(cover));
        self.attack.initiation(cover).min(beside)
    }

    /// What some bars have lost at an age (s), by Faraday's law all around: the mean over all that
    /// may be.
    #[must_use]
    pub fn lost(&self, bars: &[Bars], age: f64) -> Lost {
        if bars.iter().map(|b| b.weight).sum::<f64>() <= 0.0 {
            return Lost::default();
        }
        if self.others.is_empty() {
            let (attack, current, beside) = (self.attack, self.current, self.beside);
            let nominal = Other { attack, current, cover: 0.0, beside, since: None };
            let (share, any) = nominal.lost(bars, age);
            return Lost { share, std_error: 0.0, depassivated: f64::from(u8::from(any)) };
        }
        let n = self.others.len() as f64;
        let (mut sum, mut squares, mut begun) = (0.0, 0.0, 0.0);
        for other in &self.others {
            let (share, any) = other.lost(bars, age);
            let any = f64::from(u8::from(any));
            (sum, squares, begun) = (sum + share, squares + share * share, begun + any);
        }
        let share = sum / n;
        Lost {
            share,
            std_error: (squares / n - share * share).max(0.0).sqrt(),
            depassivated: begun / n,
        }
    }
}

impl Other {
    /// Share of the section of some bars that is gone at an age (s), and whether any rusts.
    #[must_use]
    pub fn lost(&self, bars: &[Bars], age: f64) -> (f64, bool) {
        let whole: f64 = bars.iter().map(|b| b.weight).sum();
        let (mut share, mut any) = (0.0, false);
        for b in bars {
            let depth = self.depth(b.cover, age);
            if self.is_active(b.cover, age) {
                any = true;
                share += b.weight / whole * (1.0 - remaining_section(b.diameter, depth));
            }
        }
        (share, any)
    }

    /// Whether steel under a cover of the drawing (m) rusts at an age (s).
    #[must_use]
    pub fn is_active(&self, cover: f64, age: f64) -> bool {
        age > self.initiation(cover)
    }

    /// When steel under a cover of the drawing (m) begins to rust, s after the attack began.
    #[must_use]
    pub fn initiation(&self, cover: f64) -> f64 {
        let [by_attack, beside] = self.fronts(cover);
        self.since.unwrap_or(by_attack.min(beside))
    }

    /// When the attack and when carbonation beside it reach steel under a cover of the drawing (m),
    /// s after the attack began.
    fn fronts(&self, cover: f64) -> [f64; 2] {
        let cover = (cover + self.cover).max(0.0);
        let beside = self.beside.map_or(f64::INFINITY, |air| air.front.initiation(cover));
        [self.attack.initiation(cover), beside]
    }

    /// The front of carbonation, alone or beside salt.
    #[must_use]
    pub fn front(&self) -> Option<Front> {
        match self.attack {
            Attack::Carbonation(front) => Some(front),
            Attack::Chloride { .. } => self.beside.map(|air| air.front),
        }
    }

    /// How deep rust has gone into it all around, m.
    #[must_use]
    pub fn depth(&self, cover: f64, age: f64) -> f64 {
        if let Some(since) = self.since {
            return corroded(self.current, age - since, 1.0);
        }
        let [by_attack, beside] = self.fronts(cover);
        let before =
            self.beside.map_or(0.0, |air| corroded(air.current, age.min(by_attack) - beside, 1.0));
        before + corroded(self.current, age - by_attack, 1.0)
    }
}

/// A class with salt.
#[derive(Debug, PartialEq)]
struct Salt {
    name: &'static str,
    surface: Surface,
    /// Whether splashes carry it inwards.
    splash: bool,
    /// Rust, µm a year.
    rate: [f64; 2],
}

/// Chloride at the surface, % of the binder.
#[derive(Debug, PartialEq)]
enum Surface {
    /// A w/c with the errors of A and of the fit.
    Sea([f64; 3]),
    /// Distance from the road and height above it, cm; kg of cement in a cubic metre.
    Road([f64; 3]),
}

const CHLORIDE: [Salt; 5] = [
    Salt {
        name: "XS3",
        surface: Surface::Sea([7.758, 1.360, 1.105]),
        splash: true,
        rate: [50.0, 100.0],
    },
    Salt {
        name: "XS2",
        surface: Surface::Sea([10.348, 0.714, 0.580]),
        splash: false,
        rate: [4.0, 7.0],
    },
    Salt {
        name: "XS1",
        surface: Surface::Sea([2.565, 0.356, 0.405]),
        splash: false,
        rate: [30.0, 40.0],
    },
    Salt {
        name: "XD3",
        surface: Surface::Road([150.0, 100.0, 320.0]),
        splash: true,
        rate: [30.0, 40.0],
    },
    Salt {
        name: "XD1",
        surface: Surface::Road([500.0, 150.0, 300.0]),
        splash: false,
        rate: [30.0, 40.0],
    },
];

/// A class with carbonic acid.
#[derive(Debug, PartialEq)]
struct Acid {
    name: &'static str,
    humidity: f64,
    rate: [f64; 2],
}

const CARBONATION: [Acid; 4] = [
    Acid { name: "XC4", humidity: 0.80, rate: [5.0, 7.0] },
    Acid { name: "XC3", humidity: 0.75, rate: [2.0, 3.0] },
    Acid { name: "XC2", humidity: 0.90, rate: [5.0, 7.0] },
    Acid { name: "XC1", humidity: 0.65, rate: [2.0, 3.0] },
];

/// Water/cement ratio of a strength.
fn water_cement(fck: f64) -> f64 {
    interpolate(&[(20e6, 0.60), (25e6, 0.60), (30e6, 0.55), (35e6, 0.45)], fck)
}

fn interpolate(points: &[(f64, f64)], x: f64) -> f64 {
    let (first, last) = (points[0], points[points.len() - 1]);
    let x = x.clamp(first.0, last.0);
    points
        .windows(2)
        .find(|w| x <= w[1].0)
        .map_or(last.1, |w| w[0].1 + (x - w[0].0) / (w[1].0 - w[0].0) * (w[1].1 - w[0].1))
}

/// How far covers are from the drawing, m.
const COVER: f64 = 0.008;
/// Chloride at which steel begins to rust, % of the binder, and its deviation.
const CRITICAL: [f64; 2] = [0.6, 0.15];
/// How far splashes carry salt at once, m.
const CONVECTION: f64 = 8.9e-3;
/// What is given is off by so much (ours): migration or resistance, and salt at the surface, by
/// three tenths, the current of rust by as much as it is.
const GIVEN: [f64; 2] = [0.3, 1.0];

/// The k-th thing that may be.
fn drawn(spread: Spread, acid: Option<(&'static Acid, f64)>, k: u64) -> Other {
    let beside = acid.and_then(|(class, fck)| {
        let draw = Draw(Key::new(SEED_BESIDE, k));
        let Attack::Carbonation(front) = class.draw(fck, &draw) else { return None };
        Some(Carbonated { front, current: PER_MICROMETRE * draw.lognormal(5, class.rate) })
    });
    Other { beside, ..spread.draw(&Draw(Key::new(SEED, k))) }
}

impl Spread {
    /// The corrosion of an exposure class: its means, and what else may be.
    fn corrosion(self) -> Corrosion {
        let others = (0..OTHERS).map(|k| drawn(self, None, k)).collect();
        let (attack, current, assumed) = match self {
            Self::Acid(class, fck) => class.means(fck),
            Self::Salt(class, fck, temperature) => class.means(fck, temperature),
            Self::Given(attack, current) => (attack, current, Vec::new()),
        };
        Corrosion { attack, current, assumed, beside: None, others, acid: None, spread: self }
    }

    fn draw(self, draw: &Draw) -> Other {
        let current = |rate| PER_MICROMETRE * draw.lognormal(5, rate);
        let cover = draw.scatter(6, COVER);
        match self {
            Self::Acid(class, fck) => Other {
                attack: class.draw(fck, draw),
                current: current(class.rate),
                cover,
                beside: None,
                since: None,
            },
            Self::Salt(class, fck, temperature) => Other {
                attack: class.draw(fck, temperature, draw),
                current: current(class.rate),
                cover,
                beside: None,
                since: None,
            },
            Self::Given(attack, given) => {
                let about = |dimension, mean: f64| match mean > 0.0 {
                    true => draw.lognormal(dimension, [mean, GIVEN[0] * mean]),
                    false => 0.0,
                };
                let attack = match attack {
                    Attack::Carbonation(front) => {
                        Attack::Carbonation(Front { rate: about(0, front.rate), ..front })
                    }
                    Attack::Chloride { ingress, critical, convection } => Attack::Chloride {
                        ingress: Ingress {
                            diffusion: about(0, ingress.diffusion),
                            surface: about(2, ingress.surface).max(ingress.initial),
                            ..ingress
                        },
                        critical: draw.normal(4, critical, critical * CRITICAL[1] / CRITICAL[0]),
                        convection,
                    },
                };
                let current = match given > 0.0 {
                    true => draw.lognormal(5, [given, GIVEN[1] * given]),
                    false => 0.0,
                };
                Other { attack, current, cover, beside: None, since: None }
            }
        }
    }
}

impl Acid {
    /// R_ACC,0⁻¹, 1e-11 m²/s per kg/m³.
    fn resistance(fck: f64) -> f64 {
        interpolate(&[(0.45, 5.2), (0.5, 6.8), (0.55, 9.8), (0.6, 13.4)], water_cement(fck))
    }

    fn front(resistance: f64, k_t: f64, error: f64, air: f64, humidity: f64) -> Attack {
        // 1e-11 m²/s per kg/m³ in mm²/a per kg/m³.
        let inverse = (k_t * resistance * 1e-5 * YEAR + error).max(1.0);
        let (environment, curing) =
            (carbonation::environment(humidity), carbonation::execution(3.0));
        let front = Front::new(inverse, environment, curing, air, 0.0);
        Attack::Carbonation(front.unwrap_or(Front { rate: 0.0, weather: 0.0 }))
    }

    fn draw(&self, fck: f64, draw: &Draw) -> Attack {
        let resistance = Self::resistance(fck);
        Self::front(
            draw.normal(0, resistance, 0.69 * resistance.powf(0.78)),
            draw.normal(1, 1.25, 0.35),
            draw.normal(2, 315.5, 48.0),
            draw.normal(3, 8.2e-4, 1e-4),
            draw.normal(4, self.humidity, 0.08).min(0.99),
        )
    }

    /// Means, and what was assumed.
    fn means(&self, fck: f64) -> (Attack, f64, Vec<String>) {
        let (wc, resistance) = (water_cement(fck), Self::resistance(fck));
        let assumed = vec![
            format!(
                "carbonation by fib Bulletin 34 and MC2010, 7.8.3: CEM I of w/c {wc:.2} (EN 206, table F.1), R_ACC,0⁻¹ {resistance:.1}e-11 m²/s per kg/m³, humidity {:.0} %, cured for 3 days, no rain",
                100.0 * self.humidity
            ),
            format!(
                "rust of {} ± {} µm a year once carbonated (fib MC2020, table 30.1-6, for {})",
                self.rate[0], self.rate[1], self.name
            ),
        ];
        let attack = Self::front(resistance, 1.25, 315.5, 8.2e-4, self.humidity);
        (attack, PER_MICROMETRE * self.rate[0], assumed)
    }
}

impl Salt {
    /// D_RCM,0, 1e-12 m²/s.
    fn migration(fck: f64) -> f64 {
        interpolate(&[(0.45, 10.0), (0.5, 15.8), (0.55, 19.7), (0.6, 25.0)], water_cement(fck))
    }

    /// Ingress by migration (1e-12 m²/s), b_e, salt at the surface and ageing.
    fn ingress([migration, b_e, surface, ageing]: [f64; 4], temperature: f64) -> Ingress {
        let warmth = (b_e * (1.0 / 293.0 - 1.0 / temperature.clamp(243.0, 333.0))).exp();
        let diffusion = migration * 1e-12 * warmth;
        Ingress { surface, initial: 0.0, diffusion, reference: 28.0 * super::DAY, ageing }
    }

    fn draw(&self, fck: f64, temperature: f64, draw: &Draw) -> Attack {
        let migration = Self::migration(fck);
        let (surface, spread) = self.surface.content(water_cement(fck));
        let drawn = [
            draw.normal(0, migration, 0.2 * migration),
            draw.normal(1, 4800.0, 700.0),
            draw.lognormal(2, [surface, spread]),
            draw.beta(3, [0.3, 0.12], [0.0, 1.0]).min(0.95),
        ];
        Attack::Chloride {
            ingress: Self::ingress(drawn, temperature),
            critical: draw.beta(4, CRITICAL, [0.2, 2.0]),
            convection: if self.splash {
                1e-3 * draw.beta(7, [8.9, 5.6], [0.0, 50.0])
            } else {
                0.0
            },
        }
    }

    /// Means, and what was assumed.
    fn means(&self, fck: f64, temperature: f64) -> (Attack, f64, Vec<String>) {
        let (wc, migration) = (water_cement(fck), Self::migration(fck));
        let (surface, spread) = self.surface.content(wc);
        let assumed = vec![
            format!(
                "chloride by fib Bulletin 34: CEM I of w/c {wc:.2} (EN 206, table F.1), D_RCM {migration:.1}e-12 m²/s, ageing 0.30, at {:.0} °C; {surface:.2} ± {spread:.2} % of the binder at the surface ({}), rust from 0.60 %",
                temperature - 273.15,
                self.surface.source()
            ),
            format!(
                "rust of {} ± {} µm a year then (fib MC2020, table 30.1-6, for {})",
                self.rate[0], self.rate[1], self.name
            ),
        ];
        let attack = Attack::Chloride {
            ingress: Self::ingress([migration, 4800.0, surface, 0.3], temperature),
            critical: CRITICAL[0],
            convection: if self.splash { CONVECTION } else { 0.0 },
        };
        (attack, PER_MICROMETRE * self.rate[0], assumed)
    }
}

impl Surface {
    /// Mean and standard deviation, % of the binder.
    fn content(&self, wc: f64) -> (f64, f64) {
        match *self {
            Self::Sea([a, of_a, fit]) => (a * wc, (of_a * wc).hypot(fit)),
            Self::Road([away, above, cement]) => {
                let of_concrete =
                    0.465 - 0.051 * (away + 1.0).ln() - 0.00065 * (away + 1.0).powf(-0.187) * above;
                let of_binder = of_concrete * 2350.0 / cement;
                (of_binder, 0.75 * of_binder)
            }
        }
    }

    fn source(&self) -> String {
        match *self {
            Self::Sea(_) => "DuraCrete R17".into(),
            Self::Road([away, above, _]) => {
                format!(
                    "fib Bulletin 34, {} m beside a salted road, {} m above it",
                    away / 100.0,
                    above / 100.0
                )
            }
        }
    }
}

/// Random numbers of one thing that may be, each of a dimension of its own.
struct Draw(Key);

impl Draw {
    fn share(&self, dimension: u32) -> f64 {
        self.0.unit64(dimension).clamp(1e-6, 1.0 - 1e-6)
    }

    fn scatter(&self, dimension: u32, deviation: f64) -> f64 {
        Normal::standard().inverse_cdf(self.share(dimension)) * deviation
    }

    /// Normal, and not below a hundredth of its mean.
    fn normal(&self, dimension: u32, mean: f64, deviation: f64) -> f64 {
        (mean + self.scatter(dimension, deviation)).max(0.01 * mean)
    }

    fn lognormal(&self, dimension: u32, [mean, deviation]: [f64; 2]) -> f64 {
        let variance = (1.0 + (deviation / mean).powi(2)).ln();
        LogNormal::new(mean.ln() - 0.5 * variance, variance.sqrt())
            .map_or(mean, |d| d.inverse_cdf(self.share(dimension)))
    }

    /// Beta of a mean and a standard deviation between bounds.
    fn beta(&self, dimension: u32, [mean, deviation]: [f64; 2], [low, high]: [f64; 2]) -> f64 {
        let (m, s) = ((mean - low) / (high - low), deviation / (high - low));
        let both = m * (1.0 - m) / (s * s) - 1.0;
        Beta::new(m * both, (1.0 - m) * both)
            .map_or(mean, |d| low + (high - low) * d.inverse_cdf(self.share(dimension)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(class: &str, fck: f64) -> Corrosion {
        Corrosion::assumed([class].into_iter(), fck, 283.15).unwrap()
    }

    /// XD3, C30/37, by hand: w/c .55, D_RCM 19.7e-12 · exp(4800 (1/293 − 1/283.15)) = 11.142e-12
    /// m²/s; C_s = (.465 − .051 ln 151 − .00065 · 151^−.187 · 100) · 2350/320 = 1.349 %; erfc(z) =
    /// .6/1.349 at z = .5409; of 43 mm the first 8.9 are flooded: (34.1e-3/1.0818)² = 9.936e-4 m² =
    /// D t₀^.3 t^.7, t = 13.2 years.
    #[test]
    fn salt_by_hand() {
        let Attack::Chloride { ingress, critical, convection } = of("XD3", 30e6).attack else {
            panic!()
        };
        assert!((ingress.diffusion / 11.142e-12 - 1.0).abs() < 1e-3, "{ingress:?}");
        assert!(
            (ingress.surface - 1.349).abs() < 2e-3 && (critical, convection) == (0.6, 8.9e-3),
            "{ingress:?}"
        );
        let years = of("XD3", 30e6).initiation(0.043) / YEAR;
        assert!((years - 13.2).abs() < 0.3, "{years}");
        // Thirty years of 30 µm but the first thirteen: .5 mm all around of 20.
        let Corrosion { attack, current, .. } = of("XD3", 30e6);
        let lost = Corrosion::given(attack, current)
            .lost(&[Bars { weight: 1.0, cover: 0.043, diameter: 0.02 }], 30.0 * YEAR);
        assert!(
            (lost.share - (1.0 - (1.0 - 2.0 * 0.03 * (30.0 - years) / 20.0_f64).powi(2))).abs()
                < 1e-3,
            "{lost:?}"
        );
        assert_eq!((lost.std_error, lost.depassivated), (0.0, 1.0));
    }

    /// XC3, C30/37, by hand: R⁻¹ = 1.25 · 9.8e-11 + 315.5 mm²/a = 4181.3; k_e(.75) = .6915, k_c(3)
    /// = 1.6168: √(2 · .6915 · 1.6168 · 4181.3 · 8.2e-4) = 2.769 mm/√a: 43 mm in 241.2 years.
    #[test]
    fn acid_by_hand() {
        let corrosion = of("XC3", 30e6);
        assert!(
            (corrosion.initiation(0.043) / YEAR - 241.2).abs() < 0.3,
            "{}",
            corrosion.initiation(0.043) / YEAR
        );
        let young =
            corrosion.lost(&[Bars { weight: 1.0, cover: 0.043, diameter: 0.02 }], 30.0 * YEAR);
        assert!(young.share < 1e-3 && young.depassivated < 0.05, "{young:?}");
        // Ten millimetres of cover are carbonated at once for most of what may be.
        let thin =
            corrosion.lost(&[Bars { weight: 1.0, cover: 0.010, diameter: 0.02 }], 50.0 * YEAR);
        assert!(
            thin.depassivated > 0.7 && thin.share > 0.005 && thin.std_error > thin.share,
            "{thin:?}"
        );
    }

    /// Rust that has begun at once, at a lognormal rate: mean and spread of the share lost by
    /// quadrature over 4000 rates. 512 draws: 4 % of a deviation, three of these.
    #[test]
    fn the_spread_is_that_of_what_may_be() {
        let bars = [Bars { weight: 1.0, cover: 0.0, diameter: 0.02 }];
        let corrosion = Corrosion {
            others: of("XD3", 30e6)
                .possible(OTHERS as usize)
                .into_iter()
                .map(|other| {
                    let attack = Attack::Carbonation(Front { rate: 1.0, weather: 0.0 });
                    Other { attack, cover: 0.0, ..other }
                })
                .collect(),
            ..of("XD3", 30e6)
        };
        let found = corrosion.lost(&bars, 30.0 * YEAR);
        let variance = (1.0 + (40.0 / 30.0_f64).powi(2)).ln();
        let rate = LogNormal::new(30_f64.ln() - 0.5 * variance, variance.sqrt()).unwrap();
        let shares: Vec<f64> = (0..4000)
            .map(|k| {
                1.0 - remaining_section(
                    0.02,
                    1e-6 * rate.inverse_cdf((f64::from(k) + 0.5) / 4000.0) * 30.0,
                )
            })
            .collect();
        let mean = shares.iter().sum::<f64>() / 4000.0;
        let deviation = (shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!(
            (found.share - mean).abs() < 3.0 * deviation / 512_f64.sqrt(),
            "{found:?}, {mean} ± {deviation}"
        );
        assert!(
            (found.std_error / deviation - 1.0).abs() < 0.15,
            "{found:?}, {mean} ± {deviation}"
        );
    }

    #[test]
    fn harsher_classes_come_first_and_what_no_code_knows_is_said() {
        let name = |classes: &[&str]| {
            Corrosion::assumed(classes.iter().copied(), 30e6, 283.15).map(|c| c.attack.name())
        };
        assert_eq!(name(&["XC4", "XD3", "XF4"]), Ok("chloride"));
        assert_eq!(name(&["XC4", "XF1"]), Ok("carbonation"));
        assert_eq!(name(&["XD2"]), Err(CorrosionError::UnknownChloride));
        assert_eq!(name(&["XF4"]), Err(CorrosionError::NoAttack("XF4".into())));
        assert_eq!(name(&[]), Err(CorrosionError::NoClass));
        for class in CHLORIDE.iter().map(|c| c.name).chain(CARBONATION.iter().map(|c| c.name)) {
            let corrosion = of(class, 30e6);
            assert!(
                corrosion.assumed.len() == 2 && corrosion.assumed.iter().any(|a| a.contains(class)),
                "{class}"
            );
            // Thicker cover is never worse, in what is taken and in what may be.
            let lost =
                |cover| corrosion.lost(&[Bars { weight: 1.0, cover, diameter: 0.02 }], 50.0 * YEAR);
            assert!(corrosion.initiation(0.06) >= corrosion.initiation(0.03), "{class}");
            assert!(lost(0.02).share >= lost(0.05).share && lost(0.02).std_error > 0.0, "{class}");
        }
    }
}
