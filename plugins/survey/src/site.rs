//! A member's observations where they were made, and what is known of the member.

use intrados_damage::zone::ZONES;
use intrados_forecast::BarsOf;
use intrados_mechanics::material::durability::{Bars, Corrosion};
use intrados_scene::{Scene, structure::Shows};
use intrados_stage::Estimate;

/// How far the course of rust is followed, years.
pub(crate) const FORECAST_YEARS: f64 = 20.0;
/// A zone must be told at least so much (the largest power of a likelihood) to be spoken of.
pub(crate) const HEARD: f64 = 0.1;

/// By zone, what is said of a cause.
pub(crate) type ByZone = [Option<Estimate>; ZONES];

/// An observation where it was made, and when.
pub(crate) struct Placed<'a> {
    pub(crate) number: usize,
    pub(crate) shows: &'a Shows,
    /// Zones that it lies in, from and to.
    pub(crate) zones: [usize; 2],
    /// Before the last of them, s.
    pub(crate) before: f64,
    /// On which of four faces, where somebody says.
    pub(crate) face: Option<u8>,
}

impl Placed<'_> {
    /// The share of the surface around that it may speak for: one of four faces is a quarter.
    pub(crate) fn around(&self) -> f64 {
        if self.face.is_some() { 0.25 } else { 1.0 }
    }
}

/// What is known of a member whose observations are read.
pub(crate) struct Site {
    /// What may attack its bars, or why nobody knows.
    pub(crate) corrosion: Result<Corrosion, String>,
    /// By zone.
    pub(crate) bars: [Vec<Bars>; ZONES],
    /// Concrete over its outermost steel, m, by zone.
    pub(crate) outer: [Option<f64>; ZONES],
    /// Since the attack began, at the time of the last observation, s.
    pub(crate) age: f64,
    /// Whether its bars, and so their cover, were only assumed.
    pub(crate) is_steel_assumed: bool,
    /// m.
    pub(crate) length: f64,
    /// Sides of its section, m.
    pub(crate) sides: [f64; 2],
}

impl Site {
    /// Of a member by itself, before its bars are known.
    pub(crate) fn new(scene: &Scene, index: usize) -> Self {
        let member = &scene.members[index];
        let length = f64::from(member.frame.axis.length()).max(1e-3);
        let size = (member.bounds[1] - member.bounds[0]).as_dvec3();
        // Of what lies askew in its box the volume still tells the section.
        let area = if member.volume > 0.0 { member.volume / length } else { size.x * size.z };
        let least = size.min_element().min(area.sqrt()).max(1e-3);
        Self {
            corrosion: Err("nothing is known of its bars".into()),
            bars: Default::default(),
            outer: [None; ZONES],
            age: 0.0,
            is_steel_assumed: scene
                .structure
                .assembly_of(&member.id)
                .is_some_and(|assembly| assembly.steel_assumed),
            length,
            sides: [least, (area / least).max(least)],
        }
    }

    pub(crate) fn take(&mut self, known: BarsOf, id: &str) {
        let BarsOf { corrosion, age, parts } = known;
        self.corrosion = corrosion.map_err(|why| why.to_string());
        self.age = age;
        if let Some(part) = parts.into_iter().find(|part| part.id == id) {
            (self.bars, self.outer) = (part.bars, part.outer);
        }
    }

    /// Age of the attack when an observation was made, s.
    pub(crate) fn age_at(&self, placed: &Placed) -> f64 {
        (self.age - placed.before).max(0.0)
    }

    /// How far an observation of some zones is heard in a zone, 0 to 1.
    pub(crate) fn heard(&self, [from, to]: [usize; 2], zone: usize, reach_m: f64) -> f64 {
        let far = |zones: f64| (-zones * self.length / ZONES as f64 / reach_m.max(1e-6)).exp();
        far(from.saturating_sub(zone).max(zone.saturating_sub(to)) as f64)
    }
}
