//! What the rest of a structure does to a member: forces and moments where it is joined, as
//! statically equivalent forces on the nodes there. Then six components hold it, statically
//! determinate, and bear nothing where all that acts is in balance.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::{Draft, FROM_WHOLE, GRAVITY, MemberError};
use crate::model::{Action, Load};

/// Nodes whose smallest moment of inertia is less than this share of the largest cannot take a
/// moment about every axis.
const ROUND: f64 = 1e-4;

/// What the others do to a member, load by load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Handed {
    /// Each load of the scene.
    pub(crate) loads: Vec<HandedLoad>,
    /// Whether the member's own weight acts though the scene has no loads.
    pub(crate) weighs: bool,
}

/// What the others do to a member under one load.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct HandedLoad {
    pub(crate) name: String,
    /// Time, s, and factor.
    pub(crate) history: Vec<(f64, f64)>,
    pub(crate) pushes: Vec<Push>,
}

/// A force and a moment where a member is joined.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Push {
    /// m.
    pub(crate) at: DVec3,
    /// N.
    pub(crate) force: DVec3,
    /// About that place, N m.
    pub(crate) moment: DVec3,
    /// Where it touches: places and areas.
    pub(crate) touches: Vec<(DVec3, f64)>,
}

impl Draft<'_> {
    /// Three nodes far apart hold it in six components.
    pub(super) fn hold_lightly(&mut self) -> Result<(), MemberError> {
        let nodes = &self.model.mesh.nodes;
        let farthest = |off: &dyn Fn(DVec3) -> f64| {
            (0..nodes.len()).max_by(|&a, &b| off(nodes[a]).total_cmp(&off(nodes[b])))
        };
        let found = (|| {
            let first = farthest(&|p| -p.element_sum())?;
            let second = farthest(&|p| p.distance(nodes[first]))?;
            let along = (nodes[second] - nodes[first]).try_normalize()?;
            let beside = |p: DVec3| (p - nodes[first]).reject_from(along);
            let third = farthest(&|p| beside(p).length())?;
            let normal = along.cross(beside(nodes[third]).try_normalize()?);
            let main = |v: DVec3| {
                let v = v.abs();
                if v.x >= v.y && v.x >= v.z { 0 } else { 1 + u8::from(v.z > v.y) }
            };
            let (along, normal) = (main(along), main(normal));
            let mut holds: Vec<(u32, u8)> = (0..3).map(|c| (first as u32, c)).collect();
            holds.extend((0..3).filter(|c| *c != along).map(|c| (second as u32, c)));
            // Across the plane of the three, or, where that is the way along, across the rest.
            let last = if normal == along { (along + 1) % 3 } else { normal };
            holds.push((third as u32, last));
            Some(holds)
        })();
        self.model.holds = found.ok_or_else(|| self.unsupported("its mesh has no extent"))?;
        Ok(())
    }

    /// Adds what the others do to it.
    pub(super) fn take(&mut self, handed: &Handed) -> Result<(), MemberError> {
        self.notes.push("what the rest of the structure does to it is that of the whole".into());
        if handed.weighs {
            let action = Action::Weight(-GRAVITY * DVec3::Y);
            self.model.loads.push(Load { name: "own weight".into(), action, history: vec![] });
        }
        let outside: Vec<u32> = {
            let mesh = &self.model.mesh;
            let mut nodes: Vec<u32> =
                mesh.outer_faces().into_iter().flat_map(|face| mesh.face(face)).collect();
            nodes.sort_unstable();
            nodes.dedup();
            nodes
        };
        for load in &handed.loads {
            let mut sums: BTreeMap<u32, DVec3> = BTreeMap::new();
            for push in &load.pushes {
                for (node, force) in self.equivalent(push, &outside) {
                    *sums.entry(node).or_default() += force;
                }
            }
            if !sums.is_empty() {
                self.model.loads.push(Load {
                    name: format!("{}{FROM_WHOLE}", load.name),
                    action: Action::Nodes(sums.into_iter().collect()),
                    history: load.history.clone(),
                });
            }
        }
        Ok(())
    }

    /// Forces f = w (F + ω × d) on nodes near where it touches, w by area and d from their middle:
    /// F and ω so that force and moment are those of the push.
    fn equivalent(&self, push: &Push, outside: &[u32]) -> Vec<(u32, DVec3)> {
        let place = |n: u32| self.model.mesh.nodes[n as usize];
        let nearest = |p: DVec3| {
            let off = |n: &&u32| place(**n).distance_squared(p);
            outside.iter().min_by(|a, b| off(a).total_cmp(&off(b))).copied()
        };
        let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
        for (at, area) in &push.touches {
            if let Some(node) = nearest(*at) {
                *weights.entry(node).or_default() += area;
            }
        }
        let mut reach = 0.05 * self.axes.length;
        loop {
            let (middle, inertia) = about(&weights, place);
            let eigen =
                nalgebra::Matrix3::from_fn(|r, c| inertia.col(c)[r]).symmetric_eigenvalues();
            let is_round = eigen.min() > ROUND * eigen.max();
            if is_round || weights.len() >= outside.len() {
                let moment = push.moment + (push.at - middle).cross(push.force);
                let spin = if is_round { inertia.inverse() * moment } else { DVec3::ZERO };
                let all: f64 = weights.values().sum();
                let force = |(n, w): (&u32, &f64)| {
                    (*n, *w * (push.force / all + spin.cross(place(*n) - middle)))
                };
                return weights.iter().map(force).collect();
            }
            // What touches along a line or in a point takes what is around along.
            let near = outside.iter().filter(|n| place(**n).distance(push.at) < reach);
            let few = weights.values().sum::<f64>().max(1e-9) / weights.len().max(1) as f64;
            for n in near {
                weights.entry(*n).or_insert(few);
            }
            reach *= 1.5;
        }
    }
}

/// Middle and Σ w (d² 1 − d dᵀ) of weighed nodes.
fn about(weights: &BTreeMap<u32, f64>, place: impl Fn(u32) -> DVec3) -> (DVec3, DMat3) {
    let all: f64 = weights.values().sum();
    let middle = weights.iter().map(|(n, w)| *w / all.max(1e-300) * place(*n)).sum();
    let mut inertia = DMat3::ZERO;
    for (n, w) in weights {
        let d: DVec3 = place(*n) - middle;
        let outer = DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        inertia += *w * (DMat3::IDENTITY * d.length_squared() - outer);
    }
    (middle, inertia)
}
