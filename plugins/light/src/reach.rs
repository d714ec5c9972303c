//! Where walks have been: cells of surface, fine enough that a hidden corner of a scene is a cell
//! of its own.

use std::collections::HashMap;

use glam::Vec3;
use intrados_stage::random::Key;
use intrados_transport::{BATCH, Links, TransportProblem, Value, WalkObserver};

use crate::{LitScene, Rgb, bsdf::warp, eight, field::Charts, problem::LightStates};

/// Cells along the diagonal of the scene.
const ALONG: f32 = 64.0;
/// Least area of a cell, in squares of that edge: slivers are not brighter than the rest because
/// they are small.
const SLIVER: f32 = 1.0 / 16.0;
/// Points that areas are found by, in a cell of one edge square.
const POINTS: f32 = 16.0;
/// Batches that are all looked at, and one in so many of those after them: enough, and cheap.
const ALL: u64 = 64;
const SOME: u64 = 4;

/// Whether the arrivals of the batch that begins with walk `first` are looked at.
pub(crate) fn is_watched(first: u64) -> bool {
    let batch = first / BATCH;
    batch < ALL || batch.is_multiple_of(SOME)
}

/// Bits of a place along an axis.
const BITS: u32 = 7;

/// The cells around a cell on the same side of its chart.
pub(crate) fn near(key: u64) -> impl Iterator<Item = u64> {
    let at = move |axis: u32, by: u64| {
        let shift = 1 + BITS * axis;
        let moved = (key >> shift & ((1 << BITS) - 1)).checked_add(by)?.checked_sub(1)?;
        (moved < 1 << BITS).then_some(moved << shift)
    };
    let all = !0_u64 << (1 + 3 * BITS) | 1;
    (0..27_u64)
        .filter(|k| *k != 13)
        .filter_map(move |k| Some(key & all | at(0, k % 3)? | at(1, k / 3 % 3)? | at(2, k / 9)?))
}

/// Cells of the surfaces of a scene: the side of a chart, cut by a grid.
#[derive(Debug)]
pub(crate) struct Cells {
    origin: Vec3,
    edge: f32,
    /// Area by cell without its side, m².
    areas: HashMap<u64, f32>,
}

impl Cells {
    pub(crate) fn new(lit: &LitScene) -> Self {
        let [lo, hi] = lit.scene.bounds();
        let edge = ((hi - lo).length() / ALONG).max(1e-6);
        let mut cells = Self { origin: lo, edge, areas: HashMap::new() };
        for triangle in 0..lit.triangle_count() as u32 {
            let area = lit.area(triangle);
            let points = (POINTS * area / (edge * edge)).clamp(1.0, 65536.0).ceil();
            for k in 0..points as u64 {
                let [position, _] =
                    lit.place(triangle, warp::triangle(Key::new(k, u64::from(triangle)).pair(0)));
                *cells
                    .areas
                    .entry(cells.key(2 * lit.charts().of(triangle), position) & !1)
                    .or_default() += area / points;
            }
        }
        cells
    }

    /// The cell at `position` on the side of a chart that `side` (2 · chart + side) names: its last
    /// bit is the side.
    fn key(&self, side: u32, position: Vec3) -> u64 {
        let at = ((position - self.origin) / self.edge)
            .clamp(Vec3::ZERO, Vec3::splat(ALONG))
            .as_uvec3()
            .to_array();
        let place = at.iter().fold(u64::from(side >> 1), |key, &i| key << BITS | u64::from(i));
        place << 1 | u64::from(side & 1)
    }

    /// Measure of a cell in the space of places and directions, π A: what arrives there over it is
    /// a radiance (or an importance).
    pub(crate) fn size(&self, key: u64) -> f64 {
        let area = self
            .areas
            .get(&(key & !1))
            .copied()
            .unwrap_or_default()
            .max(SLIVER * self.edge * self.edge);
        std::f64::consts::PI * f64::from(area)
    }
}

/// Notes where the walks of a batch arrive, and passes on to who else looks on.
pub(crate) struct Landings<'a, W> {
    cells: Option<(&'a Cells, &'a Charts)>,
    /// Cell and weight, in the order of the walks.
    pub(crate) list: Vec<(u64, f64)>,
    pub(crate) other: W,
}

impl<'a, W> Landings<'a, W> {
    /// Of a batch in `lit` that is looked at or not.
    pub(crate) fn new(lit: &'a LitScene, is_watched: bool, other: W) -> Self {
        Self { cells: is_watched.then(|| (lit.cells(), &**lit.charts())), list: Vec::new(), other }
    }
}

impl<P: TransportProblem<Value = Rgb, States = LightStates>, W: WalkObserver<P>> WalkObserver<P>
    for Landings<'_, W>
{
    fn begin(&mut self, n: usize) {
        self.other.begin(n);
    }

    fn follow(&mut self, rows: &[u32]) {
        self.other.follow(rows);
    }

    fn depart(&mut self, event: u32, states: &LightStates, weight: &[Rgb], promise: &[f32]) {
        self.other.depart(event, states, weight, promise);
    }

    fn land(&mut self, event: u32, states: &LightStates, weight: &[Rgb]) {
        if let Some((cells, charts)) = self.cells {
            for (row, w) in weight.iter().enumerate().filter(|(row, _)| states.hits[*row].is_hit())
            {
                let (place, lane) = (&states.places[row / eight::WIDE], row % eight::WIDE);
                let behind = place.back.lane(lane).dot(place.normal.lane(lane)) <= 0.0;
                let side = 2 * charts.of(states.hits[row].triangle) + u32::from(behind);
                self.list.push((cells.key(side, place.position.lane(lane)), w.reading()));
            }
        }
        self.other.land(event, states, weight);
    }

    fn link(&mut self, event: u32, channel: usize, states: &LightStates, links: &Links<Rgb>) {
        self.other.link(event, channel, states, links);
    }

    fn score(&mut self, row: usize, bin: u32, value: Rgb) {
        self.other.score(row, bin, value);
    }

    fn weigh(&mut self, expected: &[f32]) {
        self.other.weigh(expected);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn cells_have_neighbours_on_their_own_side() {
        let cells = Cells { origin: Vec3::ZERO, edge: 1.0, areas: HashMap::new() };
        let key = |side, x: f32, y: f32, z: f32| cells.key(side, Vec3::new(x, y, z));
        let around: BTreeSet<u64> = near(key(7, 3.5, 0.5, 64.0)).collect();
        let mut expected = BTreeSet::new();
        for (x, y, z) in
            (2..=4).flat_map(|x| (0..=1).flat_map(move |y| (63..=65).map(move |z| (x, y, z))))
        {
            // Beyond the grid there is a place that nothing lies in.
            expected.insert(7_u64 >> 1 << 22 | x << 15 | y << 8 | z << 1 | 1);
        }
        expected.remove(&key(7, 3.5, 0.5, 64.0));
        assert_eq!(around, expected);
        assert!(
            !around.contains(&key(6, 2.5, 0.5, 64.0)) && around.contains(&key(7, 2.5, 1.5, 63.0))
        );
    }
}
