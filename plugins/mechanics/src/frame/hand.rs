//! What the others do to each member: what its elements take from the nodes where it is joined or
//! held, less what acts on it there itself.

use std::collections::BTreeMap;

use glam::DVec3;
use intrados_scene::structure::{Load, Place};
use intrados_stage::time::DAY;

use super::{
    beam::Along,
    draft::{Built, Draft},
    model::{Case, End, Equilibrium},
};
use crate::member::{Handed, HandedLoad, Push};

/// Forces and moments below this share of a member's largest are rounding: nothing is joined there.
const NOTHING: f64 = 1e-9;

/// Of every member that bears, by id.
pub(super) fn over(
    draft: &Draft,
    built: &Built,
    loads: &[Load],
    cases: &[Case],
    equilibria: &[Equilibrium],
) -> BTreeMap<String, Handed> {
    let mut all: BTreeMap<String, Handed> = BTreeMap::new();
    let bears: Vec<usize> = (0..draft.parts.len()).filter(|p| !built.hanging.contains(p)).collect();
    let touches: Vec<_> = bears.iter().map(|&p| touches(draft, built, p)).collect();
    for ((load, case), found) in loads.iter().zip(cases).zip(equilibria) {
        let acting = Acting::new(built, case);
        for (&p, touches) in bears.iter().zip(&touches) {
            let sums = taken(built, p, case, &acting, found);
            let most = |i: usize| sums.values().map(|acts| acts[i].length()).fold(0.0, f64::max);
            // A plane of symmetry may take a moment alone, which is none beside those of forces
            // along the member.
            let force = most(0);
            let least = [force, most(1).max(force * draft.parts[p].axes.length)];
            let joined = sums.into_iter().filter(move |(_, acts)| {
                acts.iter().zip(least).any(|(acts, least)| acts.length() > NOTHING * least)
            });
            let push = |(node, [force, moment]): (u32, [DVec3; 2])| {
                let at = built.model.nodes[node as usize];
                let touches = touches.get(&node).cloned().unwrap_or_else(|| vec![(at, 1.0)]);
                Push { at, force, moment, touches }
            };
            let days = load.history.iter();
            let handed = all.entry(draft.parts[p].assembly.id.clone()).or_default();
            handed.weighs = draft.scene.structure.loads.is_empty();
            handed.loads.push(HandedLoad {
                name: load.name.clone(),
                history: days.map(|h| (f64::from(h.0) * DAY, f64::from(h.1))).collect(),
                pushes: joined.map(push).collect(),
            });
        }
    }
    all
}

/// What acts on every element of a model.
struct Acting {
    beams: Vec<Along>,
    plates: Vec<DVec3>,
}

impl Acting {
    fn new(built: &Built, case: &Case) -> Self {
        let mut beams = vec![Along::default(); built.model.beams.len()];
        case.beams.iter().for_each(|(b, along)| beams[*b as usize] += *along);
        let mut plates = vec![DVec3::ZERO; built.model.plates.len()];
        case.plates.iter().for_each(|(k, pressure)| plates[*k as usize] += *pressure);
        Self { beams, plates }
    }
}

/// Where a member touches others or the ground: places and areas, by node.
fn touches(draft: &Draft, built: &Built, p: usize) -> BTreeMap<u32, Vec<(DVec3, f64)>> {
    let part = &draft.parts[p];
    let mut found: BTreeMap<u32, Vec<(DVec3, f64)>> = BTreeMap::new();
    let node = |at: DVec3| {
        let ends = &built.ends[part.first..part.first + part.points.len()];
        ends[part.nearest(at)].node
    };
    let joints = draft.joints.iter().filter(|j| j.of.contains(&p));
    let bears = |q: &usize| !built.hanging.contains(q);
    for joint in joints.filter(|j| j.of.iter().all(bears)) {
        for s in &joint.patch.samples {
            found.entry(node(s.at)).or_default().push((s.at, s.area));
        }
    }
    let mut places: Vec<Place> = draft.supports(part).map(|s| s.place.clone()).collect();
    if places.is_empty() && draft.is_held(part) {
        places.push(Place::Bottom);
    }
    for s in places.iter().flat_map(|place| part.samples(place)) {
        found.entry(node(s.at)).or_default().push((s.at, s.area));
    }
    found
}

/// Force and moment about the node that a member takes from each of its nodes, without what acts
/// on it there itself.
fn taken(
    built: &Built,
    p: usize,
    case: &Case,
    acting: &Acting,
    found: &Equilibrium,
) -> BTreeMap<u32, [DVec3; 2]> {
    let mut sums: BTreeMap<u32, [DVec3; 2]> = BTreeMap::new();
    let mut add = |end: &End, [force, moment]: [DVec3; 2]| {
        let sum = sums.entry(end.node).or_default();
        sum[0] += force;
        sum[1] += moment + end.arm.cross(force);
    };
    let (model, x) = (&built.model, &found.x);
    for b in built.elements[p].beams.clone() {
        let (beam, ends) = &model.beams[b];
        let held = model.held(b, x, &acting.beams[b]);
        let axes = beam.axes();
        let world = |first: usize| (0..3).map(|i| held[first + i] * axes[i]).sum::<DVec3>();
        ends.iter().enumerate().for_each(|(e, end)| add(end, [world(6 * e), world(6 * e + 3)]));
    }
    for k in built.elements[p].plates.clone() {
        let held = model.held_plate(k, x, acting.plates[k]);
        for (end, acts) in model.plates[k].1.iter().zip(held) {
            add(end, acts);
        }
    }
    for (_, end, [force, moment]) in case.points.iter().filter(|c| c.0 as usize == p) {
        add(end, [-*force, -*moment]);
    }
    sums
}
