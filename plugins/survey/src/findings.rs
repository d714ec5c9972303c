//! What an eye or a hammer finds, as the share of a section that carries no more.
//!
//! A crack across has opened the section over its length on the surface and to an unknown depth
//! (Beta(2, 2): half of it, ± .22), and counts by its width as the grading profile's rule has it. What
//! has come off or sounds hollow is lost to its depth: the cover's, where nobody measured it (± half
//! of it). All of that is ours; no code turns a finding into strength.

use std::collections::BTreeMap;

use intrados_damage::{grading::GradingRule, zone::ZONES};
use intrados_scene::structure::{Course, Shows};
use intrados_stage::Estimate;

use crate::site::{ByZone, Placed, Site};

/// Depth of an unknown crack as a share of the section, and its deviation.
const DEPTH: [f64; 2] = [0.5, 0.224];
/// Cover where nobody knows it, m.
const COVER: f64 = 0.04;
/// What is left open where somebody looked and found nothing: of sections an eye sees the outside.
const LOOKED: f64 = 0.05;

/// What may be lost where nobody looked: as of a member that nothing is known of (ours).
const UNSEEN: f64 = 0.15;

/// Whether it was found by going over the member.
pub(crate) fn is_seen(shows: &Shows) -> bool {
    matches!(
        shows,
        Shows::Crack { .. }
            | Shows::Spall { .. }
            | Shows::Rust { .. }
            | Shows::Efflorescence { .. }
            | Shows::WetSpot { .. }
            | Shows::Sounding { .. }
            | Shows::Intact { .. }
    )
}

/// The widest crack, mm.
pub(crate) fn widest(placed: &[Placed]) -> Option<f64> {
    let width = |p: &Placed| match p.shows {
        Shows::Crack { width_mm, .. } => Some(*width_mm),
        _ => None,
    };
    placed.iter().filter_map(width).reduce(f64::max)
}

/// By zone, the share of its worst section that carries no more.
pub(crate) fn lost(site: &Site, placed: &[Placed], rule: &GradingRule) -> ByZone {
    std::array::from_fn(|zone| {
        let inside = |p: &&Placed| (p.zones[0]..=p.zones[1]).contains(&zone);
        let found = placed.iter().filter(inside).filter_map(|p| one(site, zone, p.shows, rule));
        let found = found.chain(intact(placed.iter().filter(inside)));
        found.reduce(|worst, next| if next.value > worst.value { next } else { worst })
    })
}

/// Where nothing was found: each face that was looked at speaks for itself, and all of them for the
/// section. None where nobody looked.
fn intact<'a>(placed: impl Iterator<Item = &'a Placed<'a>>) -> Option<Estimate> {
    let mut faces: BTreeMap<Option<u8>, f64> = BTreeMap::new();
    for p in placed {
        if let Shows::Intact { seen, .. } = p.shows {
            let most = faces.entry(p.face).or_default();
            *most = most.max(seen * p.around());
        }
    }
    let seen = faces.values().sum::<f64>().min(1.0);
    (!faces.is_empty())
        .then(|| Estimate { value: 0.0, std_error: LOOKED.hypot(UNSEEN * (1.0 - seen)) })
}

fn one(site: &Site, zone: usize, shows: &Shows, rule: &GradingRule) -> Option<Estimate> {
    let [width, height] = site.sides;
    let cover = site.outer[zone.min(ZONES - 1)].unwrap_or(COVER);
    // Something that is `area` large and so deep, of the section's area; no wider than a face.
    let off = |area: f64, depth: f64, error: f64| {
        let wide = area.max(0.0).sqrt().min(2.0 * (width + height));
        let value = (depth.min(0.5 * width) * wide / (width * height)).min(1.0);
        Estimate { value, std_error: (error * value).hypot(LOOKED) }
    };
    match *shows {
        Shows::Crack { width_mm, std_error_mm, course, length_m } => {
            let share_open = |width: f64| (width / rule.open_crack_mm).clamp(0.0, 1.0);
            let opened = share_open(width_mm);
            let side = width.max(height);
            let share = match course {
                // It runs along the bars, and takes nothing of what is pressed along.
                Course::Along => 0.0,
                Course::Across | Course::Diagonal | Course::Map => {
                    length_m.map_or(1.0, |length| (length / side).min(1.0))
                }
            };
            let value = opened * share * DEPTH[0];
            // Half the way between one standard error down and up: an error of a width that is wide
            // open already changes nothing. What a net of cracks costs is uncertain by far more.
            let apart = share_open(width_mm + std_error_mm) - share_open(width_mm - std_error_mm);
            let error = match course {
                Course::Map => 0.0,
                _ => 0.5 * apart * share * DEPTH[0],
            };
            Some(Estimate {
                value,
                std_error: (opened * share * DEPTH[1]).hypot(error).hypot(LOOKED),
            })
        }
        Shows::Spall { area_m2, depth_mm, bars_bare } => Some(match depth_mm {
            Some(depth) => off(area_m2, 1e-3 * depth, 0.25),
            None if bars_bare => off(area_m2, cover + 0.02, 0.5),
            None => off(area_m2, 0.7 * cover, 0.5),
        }),
        Shows::Sounding { hollow_m2, .. } if hollow_m2 > 0.0 => Some(off(hollow_m2, cover, 0.5)),
        Shows::Sounding { .. } => Some(Estimate { value: 0.0, std_error: LOOKED }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing found at one face leaves the three others open; at all four, or all around, none.
    #[test]
    fn one_face_is_not_the_section() {
        let shows = Shows::Intact { seen: 1.0, limit_mm: 0.15 };
        let error = |faces: &[Option<u8>]| {
            let placed: Vec<Placed> = faces
                .iter()
                .map(|&face| Placed { number: 0, shows: &shows, zones: [4; 2], before: 0.0, face })
                .collect();
            intact(placed.iter()).unwrap().std_error
        };
        let around = error(&[None]);
        assert!((around - LOOKED).abs() < 1e-12);
        assert!((error(&[Some(0)]) - LOOKED.hypot(0.75 * UNSEEN)).abs() < 1e-12);
        assert!((error(&[Some(0), Some(0)]) - error(&[Some(0)])).abs() < 1e-12);
        assert!((error(&[Some(0), Some(1), Some(2), Some(3)]) - around).abs() < 1e-12);
    }
}
