//! Honeycomb: mortar is missing in clouds between the grains.

use std::{collections::HashMap, f64::consts::TAU};

use glam::DVec3;
use intrados_stage::random::Key;

use super::{
    Body, Recipe, recipe,
    steel::{Found, Rod},
};

/// Waves whose sum is the cloud.
const WAVES: usize = 40;
/// Points by which the threshold is found.
const POINTS: u64 = 250_000;

/// A Gaussian random field of waves of 8 to 25 mm, and the height above which there is nothing.
#[derive(Debug, Clone)]
pub(super) struct Nest {
    range: [f64; 2],
    /// Wave vectors and phases.
    waves: Vec<(DVec3, f64)>,
    threshold: f64,
}

impl Nest {
    /// The threshold is the height that leaves the planted share: a quantile over points of the
    /// range, of which those in grains, pores and steel stay what they are.
    pub(super) fn new(
        recipe: &Recipe,
        plan: &recipe::Honeycomb,
        number: usize,
        bodies: &[Body],
        rods: &[Rod],
    ) -> Self {
        let half = 0.5 * recipe.height;
        let range = [plan.from.max(-half), plan.to.min(half)];
        let key = Key::new(recipe.seed, number as u64 | 3 << 40);
        let wave = |i: u32| {
            let u = |k: u32| key.unit64(4 * i + k);
            let (z, phi) = (2.0 * u(0) - 1.0, TAU * u(1));
            let across = (1.0 - z * z).sqrt();
            let length = (0.5 * recipe.largest).max(2.0 * recipe.finest) * (1.0 + 2.0 * u(2));
            (TAU / length * DVec3::new(across * phi.cos(), across * phi.sin(), z), TAU * u(3))
        };
        let mut nest =
            Self { range, waves: (0..WAVES as u32).map(wave).collect(), threshold: f64::INFINITY };
        if range[0] >= range[1] {
            return nest;
        }
        let index = Index::new(bodies, recipe.largest);
        let (side, mut heights, mut all) = (recipe.outline.half(), Vec::new(), 0.0);
        for i in 0..POINTS {
            let u = |d| Key::new(recipe.seed, i | (number as u64 + 8) << 44).unit64(d);
            let p = DVec3::new(
                side.x * (2.0 * u(0) - 1.0),
                side.y * (2.0 * u(1) - 1.0),
                range[0] + (range[1] - range[0]) * u(2),
            );
            if recipe.outline.within(p) <= 0.0 {
                continue;
            }
            all += 1.0;
            let steel = rods
                .iter()
                .any(|rod| rod.pieces(p.z, p.z).any(|(k, _)| rod.at(k, p) != Found::Nothing));
            if !steel && !index.near(p).any(|b| bodies[b].contains(p)) {
                heights.push(nest.height(p));
            }
        }
        heights.sort_by(|a, b| b.total_cmp(a));
        nest.threshold =
            heights.get((plan.porosity * all) as usize).copied().unwrap_or(f64::NEG_INFINITY);
        nest
    }

    fn height(&self, p: DVec3) -> f64 {
        self.waves.iter().map(|(k, phase)| (k.dot(p) + phase).cos()).sum()
    }

    /// Whether the mortar is missing at `p`.
    pub(super) fn contains(&self, p: DVec3) -> bool {
        (self.range[0]..self.range[1]).contains(&p.z) && self.height(p) > self.threshold
    }

    /// Whether any of it may be between two heights.
    pub(super) fn meets(&self, from: f64, to: f64) -> bool {
        self.range[0] < to && self.range[1] > from
    }

    /// How far the field is above the threshold, and by how much it changes over `step` metres at
    /// most.
    pub(super) fn margin(&self, p: DVec3, step: f64) -> (f64, f64) {
        let slope: f64 =
            self.waves.iter().map(|(k, _)| k.length()).sum::<f64>() / (WAVES as f64).sqrt();
        (self.height(p) - self.threshold, 2.0 * slope * step)
    }
}

/// Which bodies are near a place.
struct Index {
    edge: f64,
    buckets: HashMap<[i32; 3], Vec<usize>>,
}

impl Index {
    fn new(bodies: &[Body], edge: f64) -> Self {
        let mut index = Self { edge, buckets: HashMap::new() };
        for (i, body) in bodies.iter().enumerate() {
            let [a, b] =
                [body.centre - body.extent(), body.centre + body.extent()].map(|p| index.key(p));
            for x in a[0]..=b[0] {
                for y in a[1]..=b[1] {
                    for z in a[2]..=b[2] {
                        index.buckets.entry([x, y, z]).or_default().push(i);
                    }
                }
            }
        }
        index
    }

    fn key(&self, p: DVec3) -> [i32; 3] {
        (p / self.edge).floor().as_ivec3().to_array()
    }

    fn near(&self, p: DVec3) -> impl Iterator<Item = usize> + '_ {
        self.buckets.get(&self.key(p)).into_iter().flatten().copied()
    }
}
