//! *How strong is its skin?* Rebound numbers as evidence of damage.

use std::collections::BTreeMap;

use bevy_app::{App, Plugin};
use intrados_damage::prelude::*;
use intrados_scene::Scene;
use intrados_stage::{Estimate, Job, access};
use serde::Deserialize;

/// The table beside the scene's file: one row a place that was struck.
pub const TABLE: &str = "rebound.csv";
/// Longest table that is read, bytes.
const MOST: u64 = 1 << 20;
/// What the outer 30 mm, all that a hammer feels, may differ by from the concrete behind them: our
/// own guess, declared as such.
const SKIN: f64 = 0.15;

/// Reads [`TABLE`] and lets it speak in every prediction.
#[derive(Debug, Clone, Copy, Default)]
pub struct HammerPlugin;

impl Plugin for HammerPlugin {
    fn build(&self, app: &mut App) {
        app.add_evidence(ReboundHammer);
    }
}

/// One place.
#[derive(Debug, Clone, Deserialize)]
struct Place {
    /// Id of the member.
    member: String,
    /// Place on its axis, 0 to 1.
    along: f64,
    /// Mean rebound number.
    rebound: f64,
    /// Standard deviation of single strokes.
    scatter: f64,
    /// How many strokes; EN 12504-2 asks for nine.
    strokes: u32,
    /// Mean rebound number where the member is sound.
    sound: f64,
}

impl Place {
    /// Why it cannot be believed.
    fn fault(&self, scene: &Scene) -> Option<String> {
        let known = scene.members.iter().any(|m| m.id == self.member);
        let number = |r: f64| (20.0..=70.0).contains(&r);
        match () {
            () if !known => Some(format!("no member has the id \"{}\"", self.member)),
            () if !(0.0..=1.0).contains(&self.along) => Some(format!("along is {}: give a share of the axis, 0 to 1", self.along)),
            () if !number(self.rebound) || !number(self.sound) => Some("rebound numbers lie between 20 and 70".into()),
            () if self.strokes < 9 => Some(format!("{} strokes are too few: EN 12504-2 asks for nine", self.strokes)),
            () if self.scatter.is_finite() && self.scatter >= 0.0 => None,
            () => Some("the scatter of the strokes must be a number from 0 on".into()),
        }
    }

    /// What is lost of the strength that sound concrete has. EN 13791's basic curve, f = 1.73 R −
    /// 34.5 MPa, from 24 on.
    fn damage(&self) -> Estimate {
        let strength = |rebound: f64| (1.73 * rebound - 34.5).max(1.0);
        let left = strength(self.rebound) / strength(self.sound);
        let scatter = 1.73 / strength(self.sound) * self.scatter / f64::from(self.strokes).sqrt();
        Estimate { value: (1.0 - left).clamp(0.0, 1.0), std_error: scatter.hypot(SKIN) }
    }
}

#[derive(Debug)]
struct ReboundHammer;

impl ReboundHammer {
    /// All places of the table; none where there is no table.
    fn places(scene: &Scene) -> Result<Vec<Place>, EvidenceError> {
        let path = scene.path.with_file_name(TABLE);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let refused = |why: String| EvidenceError::Refused(format!("{}: {why}", path.display()));
        let bytes = access::read(&path, MOST).map_err(|e| refused(e.to_string()))?;
        let mut places = Vec::new();
        for (row, place) in csv::Reader::from_reader(&bytes[..]).deserialize().enumerate() {
            let place: Place = place.map_err(|e| refused(e.to_string()))?;
            if let Some(why) = place.fault(scene) {
                return Err(refused(format!("line {}: {why}", row + 2)));
            }
            places.push(place);
        }
        Ok(places)
    }
}

impl EvidenceSource for ReboundHammer {
    fn name(&self) -> &'static str {
        "hammer"
    }

    fn items(&self, scene: &Scene, index: usize) -> Vec<String> {
        match Self::places(scene) {
            Ok(places) => places
                .iter()
                .filter(|p| p.member == scene.members[index].id)
                .map(|p| format!("{} strokes at {} of the axis", p.strokes, p.along))
                .collect(),
            // A table that cannot be read is an item, too: its reason is told once.
            Err(_) if index == 0 => vec![TABLE.into()],
            Err(_) => Vec::new(),
        }
    }

    fn evidence(&self, scene: &Scene, index: usize, _: &Job) -> Result<Said, EvidenceError> {
        let mut zones = Zones([None; ZONES]);
        for place in Self::places(scene)?.iter().filter(|p| p.member == scene.members[index].id) {
            let (now, before) = (place.damage(), &mut zones.0[zone_at(place.along)]);
            if before.is_none_or(|b| b.value < now.value) {
                *before = Some(now);
            }
        }
        let basis = "rebound numbers of the skin against those of sound places (EN 13791)".to_owned();
        let evidence = Evidence::new(self.name(), true, BTreeMap::from([(Cause::Concrete, zones)]), basis);
        Ok(Said { evidence, ..Said::default() })
    }
}
