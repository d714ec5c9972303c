//! The whole of a scene: reactions, end forces of every member through its life, and what becomes
//! of them where one is taken away.
//!
//! Elastic, by E_cm and whole sections: where all creeps alike, what does not change its supports
//! keeps its forces under constant loads (first theorem of linear viscoelasticity), and they are in
//! proportion to the loads. What cracks hands load on to what does not; that is not computed here.

use std::collections::BTreeMap;

use glam::DVec3;
use intrados_scene::{
    MemberKind, Scene,
    structure::{Action, JointKind, Load},
};
use intrados_stage::{Job, time::DAY};
use serde::Serialize;

use super::{
    beam::Along,
    draft::{Built, Draft, Part},
    model::{Case, Equilibrium, FrameError, System},
    shape::Shape,
};
use crate::member::{GRAVITY, Handed, UP_TO_SYMMETRY};

/// The whole structure, computed.
#[derive(Debug, Clone, Serialize)]
pub struct Whole {
    /// Unknowns of the frame.
    pub unknowns: usize,
    /// Beams and plates that it is made of.
    pub beams: usize,
    /// See `beams`.
    pub plates: usize,
    /// Force and moment that loads and reactions leave over all loads, the worst of all cases.
    pub unbalanced: f64,
    /// Moments that are told, s.
    pub times_s: Vec<f64>,
    /// What the ground does, at the last moment.
    pub reactions: Vec<Reaction>,
    /// All members that bear.
    pub members: Vec<MemberForces>,
    /// Where members are joined.
    pub joints: Vec<JointForces>,
    /// Ids of members that nothing holds: they hang in the air.
    pub hanging: Vec<String>,
    /// Ids of members that are no part of the whole, and why.
    pub left_out: Vec<(String, String)>,
    /// What becomes of the others where a member is taken away; empty where nobody asked.
    pub redundancy: Vec<Redundancy>,
    /// What a user should know.
    pub notes: Vec<String>,
    /// What the others do to every member, by id.
    #[serde(skip)]
    pub(super) handed: BTreeMap<String, Handed>,
    /// For pictures.
    #[serde(skip)]
    pub(super) picture: super::picture::Picture,
}

/// What the ground does to a member.
#[derive(Debug, Clone, Serialize)]
pub struct Reaction {
    /// Id of the member.
    pub member: String,
    /// Where, m.
    pub at_m: [f64; 3],
    /// In the world, N.
    pub force_n: [f64; 3],
    /// About that place, N m.
    pub moment_nm: [f64; 3],
}

/// Forces and moments of a section: what the part beyond does to the part before, in the member's
/// axes (x along, y towards angle 0, z across both); N is tension.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SectionForces {
    /// m along the bar.
    pub at_m: f64,
    /// N (N).
    pub n: f64,
    /// V_y (N).
    pub v_y: f64,
    /// V_z (N).
    pub v_z: f64,
    /// T (N m).
    pub t: f64,
    /// M_y (N m).
    pub m_y: f64,
    /// M_z (N m); above 0 where a beam sags.
    pub m_z: f64,
}

/// A member's forces.
#[derive(Debug, Clone, Serialize)]
pub struct MemberForces {
    /// Its id.
    pub name: String,
    /// What it is.
    pub kind: MemberKind,
    /// `beam` or `plates`.
    pub computed_as: &'static str,
    /// Of a bar: its length, m.
    pub length_m: f64,
    /// Of a bar, at every moment: its two ends, where they leave what they are joined to.
    pub ends: Vec<[SectionForces; 2]>,
    /// Of a bar: along it, at the moment of its largest stress.
    pub along: Vec<SectionForces>,
    /// Largest stress at an edge of an uncracked section, Pa: |N|/A + |M_y|/W_y + |M_z|/W_z; of
    /// plates n/t + 6 m/t², the larger direction.
    pub peak_edge_stress_pa: f64,
    /// When, s.
    pub peak_at_s: f64,
    /// Largest displacement of it, m.
    pub peak_displacement_m: f64,
}

/// A joint of two members.
#[derive(Debug, Clone, Serialize)]
pub struct JointForces {
    /// Ids.
    pub of: [String; 2],
    /// `Monolithic`, `Hinge`, `Bearing`.
    pub kind: String,
    /// Middle of where they touch, m.
    pub at_m: [f64; 3],
    /// Whether the scene says so; else they touch.
    pub is_given: bool,
    /// Of a hinge or bearing, at the last moment: pressure across it, N; pulled below 0.
    pub pressure_n: Option<f64>,
}

/// What becomes of the others where one member is taken away.
#[derive(Debug, Clone, Serialize)]
pub struct Redundancy {
    /// Which.
    pub without: String,
    /// Whether the others stand.
    pub stands: bool,
    /// Members that fall with it, or one of them where all are joined and move freely.
    pub falls: Vec<String>,
    /// Where stress rises most; none where it rises nowhere.
    pub largest_rise: Option<Rise>,
}

/// What a member has to bear in the place of one that is gone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rise {
    /// Id of the member: that whose largest edge stress rises most, in strengths f_ctm of its
    /// concrete. (In shares of what it was, members that bore next to nothing would be the first.)
    pub member: String,
    /// Its largest edge stress with all members, Pa.
    pub before_pa: f64,
    /// The same without that one, Pa.
    pub after_pa: f64,
    /// The latter over f_ctm: above 1 a section cracks where the edge is pulled.
    pub after_over_strength: f64,
}

impl Whole {
    /// What the others do to a member, for [`prepare_within`](crate::member::prepare_within); none:
    /// it bears nothing.
    #[must_use]
    pub fn handed(&self, member: &str) -> Option<&Handed> {
        self.handed.get(member)
    }
}

/// The whole of a scene whose members [bear as one](intrados_scene::Scene::bears_as_one); none
/// where they do not, and each is as its own supports hold it.
///
/// # Errors
/// As [`whole`].
pub fn joined(scene: &Scene, job: &Job) -> Result<Option<Whole>, FrameError> {
    scene.bears_as_one().then(|| whole(scene, false, job)).transpose()
}

/// A model with the equilibria of all its cases.
struct Solved {
    built: Built,
    cases: Vec<Case>,
    equilibria: Vec<Equilibrium>,
    unknowns: usize,
    /// Loads that are left out.
    notes: Vec<String>,
}

/// Computes the whole of a scene; with `redundancy`, also without each of its members.
///
/// # Errors
/// [`FrameError`]: nothing is held, or part of it moves freely.
pub fn whole(scene: &Scene, redundancy: bool, job: &Job) -> Result<Whole, FrameError> {
    job.relabel("the whole structure");
    let mut draft = Draft::new(scene, job)?;
    let times = times(scene);
    let weight = [own_weight()];
    let loads: &[Load] = if scene.structure.loads.is_empty() {
        draft.notes.push("the scene has no loads: its own weight alone acts".into());
        &weight
    } else {
        &scene.structure.loads
    };
    tell_assumptions(&mut draft);
    if !draft.parts.iter().any(|p| draft.is_held(p)) {
        return Err(FrameError::NotHeld(
            draft.parts.first().map_or_else(String::new, |p| p.assembly.id.clone()),
        ));
    }
    let solved = solve(&draft, loads, None, job)?;
    let factors: Vec<Vec<f64>> = times.iter().map(|&t| factors(loads, t)).collect();
    let mut whole = told(&draft, &solved, &factors, &times);
    if redundancy {
        for p in (0..draft.parts.len()).filter(|p| !solved.built.hanging.contains(p)) {
            job.step(p, draft.parts.len())?;
            let found = without(&draft, loads, &factors, p, &whole.members, job)?;
            whole.redundancy.push(found);
        }
    }
    whole.handed =
        super::hand::over(&draft, &solved.built, loads, &solved.cases, &solved.equilibria);
    whole.notes = [draft.notes, solved.notes].concat();
    Ok(whole)
}

pub(super) fn own_weight() -> Load {
    Load {
        name: "own weight".into(),
        members: Vec::new(),
        action: Action::SelfWeight,
        history: Vec::new(),
        loading: None,
    }
}

/// Days on which a load changes, s.
fn times(scene: &Scene) -> Vec<f64> {
    let days = scene.structure.loads.iter().flat_map(|l| l.history.iter().map(|h| h.0));
    let mut times: Vec<f64> = days.map(|d| f64::from(d) * DAY).collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    if times.is_empty() {
        times.push(0.0);
    }
    times
}

/// The factor of every load at a moment: linear between points of its history, constant outside.
fn factors(loads: &[Load], time: f64) -> Vec<f64> {
    let of = |load: &Load| {
        let points: Vec<[f64; 2]> =
            load.history.iter().map(|h| [f64::from(h.0) * DAY, f64::from(h.1)]).collect();
        let (Some(first), Some(last)) = (points.first(), points.last()) else { return 1.0 };
        if time <= first[0] {
            return first[1];
        }
        let between = points.windows(2).find(|w| time <= w[1][0]);
        between.map_or(last[1], |w| {
            w[0][1] + (w[1][1] - w[0][1]) * (time - w[0][0]) / (w[1][0] - w[0][0]).max(1e-9)
        })
    };
    loads.iter().map(of).collect()
}

/// What nobody said and is assumed.
fn tell_assumptions(draft: &mut Draft) {
    let footings = draft
        .parts
        .iter()
        .filter(|p| p.assembly.kind == MemberKind::Footing && draft.supports(p).next().is_none());
    let count = footings.count();
    if count > 0 {
        draft.notes.push(format!(
            "{count} footings have no support in the scene: their soffits are held fast"
        ));
    }
    let touching = draft.joints.iter().filter(|j| !j.is_given).count();
    if touching > 0 {
        draft.notes.push(format!(
            "{touching} joints by touching alone are monolithic: name bearings and hinges in joints of the scene"
        ));
    }
    if touching > 0 && !draft.scene.bears_as_one() {
        draft.notes.push("without --whole and in `predict` each of these members is computed by its own supports: name joints, or mark supports that stand for other members alone: true, and loads are handed on there, too".into());
    }
    let mirrored = draft.parts.iter().map(|p| draft.scene.structure.mirrored(&p.assembly.id));
    if mirrored.flatten().any(|is_plane| is_plane) {
        draft.notes.push(UP_TO_SYMMETRY.into());
    }
    let steel = draft
        .parts
        .iter()
        .filter(|p| p.assembly.steel.iter().any(|line| line.part == intrados_scene::Part::Tendon));
    let tendons = steel.count();
    if tendons > 0 {
        draft.notes.push(format!(
            "tendons of {tendons} members are not used: what they do to the whole is left out"
        ));
    }
}

/// All cases of a model.
fn solve(
    draft: &Draft,
    loads: &[Load],
    without: Option<usize>,
    job: &Job,
) -> Result<Solved, FrameError> {
    let built = draft.build(without);
    let mut notes = Vec::new();
    let cases: Vec<Case> = loads.iter().map(|load| case(draft, &built, load, &mut notes)).collect();
    notes.sort_unstable();
    notes.dedup();
    let solved = System::new(&built.model, job).and_then(|mut system| {
        cases.iter().map(|case| system.solve(case, job)).collect::<Result<Vec<_>, _>>()
    });
    let equilibria = solved.map_err(|why| named(draft, &built, why))?;
    let unknowns = 6 * built.model.nodes.len();
    Ok(Solved { built, cases, equilibria, unknowns, notes })
}

/// The same failure with the name of a member where it had a node.
fn named(draft: &Draft, built: &Built, failed: FrameError) -> FrameError {
    let FrameError::Solve(mut why) = failed else { return failed };
    let count = built.model.nodes.len();
    let Some(node) = why.node_mut().map(|node| *node % count) else { return why.into() };
    let of = |part: &&Part| {
        let mut ends = built.ends[part.first..part.first + part.points.len()].iter();
        ends.any(|end| end.node as usize == node)
    };
    match draft.parts.iter().find(of) {
        Some(part) => FrameError::Mechanism { member: part.assembly.id.clone(), why },
        None => why.into(),
    }
}

/// A load of the scene on a model.
pub(super) fn case(draft: &Draft, built: &Built, load: &Load, notes: &mut Vec<String>) -> Case {
    let mut case = Case::default();
    for (p, part) in draft.parts.iter().enumerate() {
        let elements = &built.elements[p];
        let is_there = !elements.beams.is_empty() || !elements.plates.is_empty();
        if is_there && (load.members.is_empty() || load.members.contains(&part.assembly.id)) {
            part.act(built, p, &load.action, &mut case, notes);
        }
    }
    case
}

impl Part<'_> {
    /// Its volume over that of the bars or plates that stand for it: what its sections, taken in
    /// the middle of each piece, miss of a tapered or ragged body weighs all the same. A member
    /// by its measures has that of its measures.
    fn fullness(&self, built: &Built, p: usize) -> f64 {
        if self.assembly.body.is_some() {
            return 1.0;
        }
        let elements = &built.elements[p];
        let bars = built.model.beams[elements.beams.clone()].iter();
        let bars: f64 = bars.map(|(beam, _)| beam.section.area * beam.length()).sum();
        let plates = built.model.plates[elements.plates.clone()].iter();
        let plates: f64 = plates.map(|(plate, _)| plate.thickness * plate.area()).sum();
        self.solid.volume / (bars + plates)
    }

    /// Adds what an action does to it.
    fn act(
        &self,
        built: &Built,
        p: usize,
        action: &Action,
        case: &mut Case,
        notes: &mut Vec<String>,
    ) {
        let elements = &built.elements[p];
        let force = |force: DVec3| Along { force, ..Along::default() };
        match action {
            Action::SelfWeight => {
                let weight =
                    -GRAVITY * self.matter.law.density * self.fullness(built, p) * DVec3::Y;
                for b in elements.beams.clone() {
                    let area = built.model.beams[b].0.section.area;
                    case.beams.push((b as u32, force(area * weight)));
                }
                for k in elements.plates.clone() {
                    let thickness = built.model.plates[k].0.thickness;
                    case.plates.push((k as u32, thickness * weight));
                }
            }
            Action::Force { place, force_kn } => {
                let samples = self.samples(place);
                let area: f64 = samples.iter().map(|s| s.area).sum();
                let total = 1e3 * force_kn.as_dvec3();
                samples
                    .iter()
                    .for_each(|s| self.press(built, p, s.at, s.area / area * total, case));
            }
            Action::Pressure { place, pressure_kpa } => {
                let pressure = 1e3 * f64::from(*pressure_kpa);
                for s in self.samples(place) {
                    self.press(built, p, s.at, -pressure * s.area * s.normal, case);
                }
            }
            Action::Line { from, to, force_kn_m } => {
                let total = 1e3 * force_kn_m.as_dvec3() * self.axes.length;
                let (from, to) = (f64::from(*from), f64::from(*to));
                self.line(built, p, [from, to], (to - from) * total, case);
            }
            Action::Temperature { uniform_k, difference_k } => {
                let alpha = self.matter.law.expansion;
                for b in elements.beams.clone() {
                    let height = 2.0 * built.model.beams[b].0.section.reach[0];
                    let bend = alpha * f64::from(*difference_k) / height;
                    let strain = [alpha * f64::from(*uniform_k), bend];
                    case.beams.push((b as u32, Along { strain, ..Along::default() }));
                }
                if !elements.plates.is_empty() {
                    notes.push(format!("{}: temperature of plates is left out", self.assembly.id));
                }
            }
            Action::InnerPressure { .. }
            | Action::Displacement { .. }
            | Action::PipeTemperature { .. }
            | Action::Air { .. } => {
                notes.push(format!(
                    "{}: given displacements, air and inner pressure are left out of the whole",
                    self.assembly.id
                ));
            }
        }
    }

    /// A force at a place on its surface: what its bearers take, and the couple that brings it from
    /// the bar to where it is.
    fn press(&self, built: &Built, p: usize, at: DVec3, force: DVec3, case: &mut Case) {
        let bearers = self.bearers(at);
        let middle: DVec3 = bearers.iter().map(|(i, share)| *share * self.points[*i]).sum();
        let couple = (at - middle).cross(force);
        for (point, share) in bearers.into_iter().filter(|b| b.1 > 0.0) {
            let end = built.ends[self.first + point];
            case.points.push((p as u32, end, [share * force, share * couple]));
        }
    }

    /// A force in all, even along the axis between two shares of it.
    fn line(&self, built: &Built, p: usize, [from, to]: [f64; 2], total: DVec3, case: &mut Case) {
        let elements = &built.elements[p];
        let within = |at: DVec3| (from..=to).contains(&self.share(at));
        let beams: Vec<usize> = elements
            .beams
            .clone()
            .filter(|&b| {
                let ends = built.model.beams[b].0.ends;
                within(0.5 * (ends[0] + ends[1]))
            })
            .collect();
        let length: f64 = beams.iter().map(|&b| built.model.beams[b].0.length()).sum();
        for b in beams {
            case.beams.push((b as u32, Along { force: total / length, ..Along::default() }));
        }
        let area = |k: usize| {
            let [a, b, c, d] = built.model.plates[k].0.nodes;
            0.5 * (c - a).cross(d - b).length()
        };
        let plates: Vec<usize> = elements
            .plates
            .clone()
            .filter(|&k| within(built.model.plates[k].0.nodes.iter().sum::<DVec3>() / 4.0))
            .collect();
        let all: f64 = plates.iter().map(|&k| area(k)).sum();
        plates.into_iter().for_each(|k| case.plates.push((k as u32, total / all)));
    }
}

impl Solved {
    /// Displacements of all nodes under cases with these factors.
    fn at(&self, factors: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.unknowns];
        for (found, factor) in self.equilibria.iter().zip(factors) {
            sum.iter_mut().zip(&found.x).for_each(|(s, x)| *s += factor * x);
        }
        sum
    }

    /// What acts along every beam.
    fn along(&self, factors: &[f64]) -> Vec<Along> {
        let mut all = vec![Along::default(); self.built.model.beams.len()];
        for (case, factor) in self.cases.iter().zip(factors) {
            case.beams.iter().for_each(|(b, along)| all[*b as usize] += along.scaled(*factor));
        }
        all
    }

    /// A member's sections: both ends and the middle of each of its beams that is not within what
    /// it is joined to.
    fn sections(
        &self,
        part: &Part,
        p: usize,
        x: &[f64],
        along: &[Along],
    ) -> Vec<(SectionForces, f64)> {
        let Shape::Bar(_) = &part.shape else { return Vec::new() };
        let mut found = Vec::new();
        for (i, b) in self.built.elements[p].beams.clone().enumerate() {
            let (beam, ends) = &self.built.model.beams[b];
            if ends[0].node == ends[1].node {
                continue;
            }
            let held = self.built.model.held(b, x, &along[b]);
            for share in [0.0, 0.5, 1.0] {
                let at = share * beam.length();
                let f = beam.forces(&held, &along[b], at);
                let forces = SectionForces {
                    at_m: part.stations[i] + at,
                    n: f.force.x,
                    v_y: f.force.y,
                    v_z: f.force.z,
                    t: f.moment.x,
                    m_y: f.moment.y,
                    m_z: f.moment.z,
                };
                let stress = beam.section.edge_stress(f.force.x, f.moment.y, f.moment.z);
                found.push((forces, stress));
            }
        }
        found
    }

    /// The largest stress of a member's plates: of n/t ± 6 m/t², by principal values.
    fn plate_stress(&self, p: usize, x: &[f64]) -> f64 {
        let largest = |v: [f64; 3]| {
            let (mean, radius) = (0.5 * (v[0] + v[1]), (0.5 * (v[0] - v[1])).hypot(v[2]));
            mean.abs() + radius
        };
        let of = |k: usize| {
            let t = self.built.model.plates[k].0.thickness;
            let found = self.built.model.resultants(k, x).ok()?;
            let side = |sign: f64| {
                let stress =
                    |i: usize| found.membrane[i] / t + sign * 6.0 * found.bending[i] / (t * t);
                largest([stress(0), stress(1), stress(2)])
            };
            Some(side(1.0).max(side(-1.0)))
        };
        self.built.elements[p].plates.clone().filter_map(of).fold(0.0, f64::max)
    }

    /// The largest stress of every member over all moments, and at which.
    fn peaks(&self, draft: &Draft, factors: &[Vec<f64>]) -> Vec<(f64, usize)> {
        let mut peaks = vec![(0.0, 0); draft.parts.len()];
        for (t, factors) in factors.iter().enumerate() {
            let (x, along) = (self.at(factors), self.along(factors));
            for (p, part) in draft.parts.iter().enumerate() {
                let bars = self.sections(part, p, &x, &along);
                let stress = bars.iter().map(|s| s.1).fold(self.plate_stress(p, &x), f64::max);
                if stress > peaks[p].0 {
                    peaks[p] = (stress, t);
                }
            }
        }
        peaks
    }

    /// How far the points of a member move at most, m.
    fn moved(&self, part: &Part, x: &[f64]) -> f64 {
        let ends = &self.built.ends[part.first..part.first + part.points.len()];
        ends.iter().map(|e| e.moved(&self.built.model, x)[0].length()).fold(0.0, f64::max)
    }
}

/// What is told of a solution.
fn told(draft: &Draft, solved: &Solved, factors: &[Vec<f64>], times: &[f64]) -> Whole {
    let fields: Vec<(Vec<f64>, Vec<Along>)> =
        factors.iter().map(|f| (solved.at(f), solved.along(f))).collect();
    let peaks = solved.peaks(draft, factors);
    let (built, id) = (&solved.built, |p: &usize| draft.parts[*p].assembly.id.clone());
    let bears = |p: &usize| !built.hanging.contains(p);
    let members = (0..draft.parts.len()).filter(bears).map(|p| {
        let part = &draft.parts[p];
        let (peak, when) = peaks[p];
        let at = |t: usize| -> Vec<SectionForces> {
            let (x, along) = &fields[t];
            solved.sections(part, p, x, along).into_iter().map(|s| s.0).collect()
        };
        let ends = |t: usize| {
            let all = at(t);
            Some([*all.first()?, *all.last()?])
        };
        let (computed_as, length_m) = match &part.shape {
            Shape::Bar(bar) => ("beam", bar.lengths()[bar.pieces.len()]),
            Shape::Sheet(_) => ("plates", 0.0),
        };
        MemberForces {
            name: part.assembly.id.clone(),
            kind: part.assembly.kind,
            computed_as,
            length_m,
            ends: (0..times.len()).filter_map(ends).collect(),
            along: at(when),
            peak_edge_stress_pa: peak,
            peak_at_s: times[when],
            peak_displacement_m: fields
                .iter()
                .map(|(x, _)| solved.moved(part, x))
                .fold(0.0, f64::max),
        }
    });
    let members = members.collect();
    let last = factors.len() - 1;
    Whole {
        unknowns: solved.unknowns,
        beams: built.model.beams.len(),
        plates: built.model.plates.len(),
        unbalanced: solved.equilibria.iter().map(|e| e.unbalanced).fold(0.0, f64::max),
        times_s: times.to_vec(),
        reactions: reactions(draft, solved, &factors[last]),
        members,
        joints: joints(draft, solved, &fields[last].0),
        hanging: built.hanging.iter().map(id).collect(),
        left_out: draft.left_out.clone(),
        redundancy: Vec::new(),
        notes: Vec::new(),
        handed: BTreeMap::new(),
        picture: super::picture::Picture::new(draft, built, &fields[last].0),
    }
}

/// What the ground does under cases with these factors.
fn reactions(draft: &Draft, solved: &Solved, factors: &[f64]) -> Vec<Reaction> {
    let mut sums: BTreeMap<u32, [DVec3; 2]> = BTreeMap::new();
    for (found, factor) in solved.equilibria.iter().zip(factors) {
        for (node, acts) in &found.reactions {
            let sum = sums.entry(*node).or_default();
            (0..2).for_each(|i| sum[i] += *factor * acts[i]);
        }
    }
    let of = |(node, [force, moment]): (u32, [DVec3; 2])| {
        let part = solved.built.grounds.get(&node)?;
        Some(Reaction {
            member: draft.parts[*part].assembly.id.clone(),
            at_m: solved.built.model.nodes[node as usize].to_array(),
            force_n: force.to_array(),
            moment_nm: moment.to_array(),
        })
    };
    sums.into_iter().filter_map(of).collect()
}

/// The joints of members that bear.
fn joints(draft: &Draft, solved: &Solved, x: &[f64]) -> Vec<JointForces> {
    let built = &solved.built;
    let of = |(j, joint): (usize, &super::draft::Joined)| {
        if joint.of.iter().any(|p| built.hanging.contains(p)) {
            return None;
        }
        let links = built.model.links.iter().zip(&built.links).filter(|(_, of)| **of == Some(j));
        // What the second does to the first, along the way from the first to the second: pressure
        // pushes back.
        let pressure =
            links.map(|(link, _)| -link.forces(&built.model, x)[0].dot(joint.patch.normal));
        let id = |k: usize| draft.parts[joint.of[k]].assembly.id.clone();
        Some(JointForces {
            of: [id(0), id(1)],
            kind: format!("{:?}", joint.kind),
            at_m: joint.patch.middle.to_array(),
            is_given: joint.is_given,
            pressure_n: (joint.kind != JointKind::Monolithic).then(|| pressure.sum()),
        })
    };
    draft.joints.iter().enumerate().filter_map(of).collect()
}

/// What becomes of the others without one member: it takes its own weight and what acts on it
/// along, and what it bore goes other ways, if there are any.
fn without(
    draft: &Draft,
    loads: &[Load],
    factors: &[Vec<f64>],
    gone: usize,
    before: &[MemberForces],
    job: &Job,
) -> Result<Redundancy, FrameError> {
    let name = draft.parts[gone].assembly.id.clone();
    let cannot = |falls: Vec<String>| Redundancy {
        without: name.clone(),
        stands: false,
        falls,
        largest_rise: None,
    };
    let solved = match solve(draft, loads, Some(gone), job) {
        Ok(solved) => solved,
        Err(FrameError::Mechanism { member, .. }) => return Ok(cannot(vec![member])),
        Err(other) => return Err(other),
    };
    let fallen = |p: &&usize| before.iter().any(|m| m.name == draft.parts[**p].assembly.id);
    let falls: Vec<String> = solved
        .built
        .hanging
        .iter()
        .filter(fallen)
        .map(|p| draft.parts[*p].assembly.id.clone())
        .collect();
    let peaks = solved.peaks(draft, factors);
    let rises = before.iter().filter_map(|m| {
        let p = draft.parts.iter().position(|part| part.assembly.id == m.name)?;
        let (before_pa, after_pa) = (m.peak_edge_stress_pa, peaks[p].0);
        let strength = draft.parts[p].matter.strength;
        let [rise, after_over_strength] = [after_pa - before_pa, after_pa].map(|s| s / strength);
        let of = Rise { member: m.name.clone(), before_pa, after_pa, after_over_strength };
        (p != gone && rise > 0.0).then_some((rise, of))
    });
    let largest_rise = rises.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, of)| of);
    Ok(Redundancy { without: name.clone(), stands: falls.is_empty(), falls, largest_rise })
}
