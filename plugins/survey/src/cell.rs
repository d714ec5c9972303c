//! Readings gathered by the zones that they lie in, so that work grows with the number of readings
//! and not with its square.

use std::collections::BTreeMap;

use intrados_mechanics::material::durability::Bars;

use crate::site::{Placed, Site};

/// The readings that lie in the same zones: each stands for another zone as far as all others of
/// the cell do.
pub(crate) struct ReadingCell<'a> {
    pub(crate) zones: [usize; 2],
    pub(crate) readings: Vec<&'a Placed<'a>>,
}

/// Gathers readings.
pub(crate) fn gather_cells<'a>(readings: &[&'a Placed<'a>]) -> Vec<ReadingCell<'a>> {
    let mut cells: BTreeMap<[usize; 2], Vec<&'a Placed<'a>>> = BTreeMap::new();
    readings.iter().for_each(|p| cells.entry(p.zones).or_default().push(p));
    cells.into_iter().map(|(zones, readings)| ReadingCell { zones, readings }).collect()
}

/// The bars with the least cover in some zones, and the concrete over the outermost steel there.
pub(crate) fn bars_of_cell(site: &Site, [from, to]: [usize; 2]) -> Option<(Bars, f64)> {
    let bars = (from..=to).flat_map(|zone| &site.bars[zone]).copied();
    let least = bars.min_by(|a, b| a.cover.total_cmp(&b.cover))?;
    let outer = (from..=to).filter_map(|zone| site.outer[zone]).fold(least.cover, f64::min);
    Some((least, outer))
}
