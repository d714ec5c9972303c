//! From the members of a scene to a model: what each is, where they touch, what holds them.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};
use intrados_scene::{
    Assembly, MemberKind, Scene,
    structure::{Action, Hold, JointKind, Place, Support},
};
use intrados_stage::{Cancelled, Job};
use nalgebra::Matrix3;

use super::{
    beam::Beam,
    contact::{self, Patch},
    model::{End, Link, Model},
    shape::Shape,
    solid::{Sample, Solid},
};
use crate::{
    element::shell::Shell,
    member::{Axes, ElasticMatter, imported, matter},
};

/// Stations of a bar closer than this share of its length are one.
const CLOSE: f64 = 0.01;
/// A bar that touches over more than so many of its depths, and than this share of its length,
/// touches all along; it then has so many stations over its length.
const LONG: [f64; 2] = [2.5, 0.15];
const STATIONS: f64 = 16.0;
/// Samples of a place on a member.
const SAMPLES: usize = 800;
/// Samples count as lying at a line across from so far, shares of the length.
const NEAR: f64 = 0.02;
/// A node of a sheet is part of a contact where this share of the most that any node has of it is
/// its.
const PART: f64 = 0.4;
/// Stiffness of what a hinge or bearing holds, over that of the stiffer member beside it: soft by a
/// hundred-thousandth, and far from what double precision loses.
const STIFF: f64 = 1e5;
/// Faces look along a direction by this cosine, as where members are computed alone.
const LOOKS: f64 = 0.7;

/// A member in the whole.
pub(super) struct Part<'a> {
    pub(super) assembly: &'a Assembly,
    pub(super) axes: Axes,
    pub(super) solid: Solid,
    pub(super) shape: Shape,
    pub(super) matter: ElasticMatter,
    /// Of a bar: m along it, ascending, a point each.
    pub(super) stations: Vec<f64>,
    /// The first of its points among all, and how many it has.
    pub(super) first: usize,
    pub(super) points: Vec<DVec3>,
}

/// Two members that are joined.
pub(super) struct Joined {
    /// Places among the parts.
    pub(super) of: [usize; 2],
    pub(super) kind: JointKind,
    pub(super) patch: Patch,
    /// Whether the scene says so.
    pub(super) is_given: bool,
}

/// The members of a scene, and how they are joined.
pub(super) struct Draft<'a> {
    pub(super) scene: &'a Scene,
    pub(super) parts: Vec<Part<'a>>,
    pub(super) joints: Vec<Joined>,
    /// Members that are no part of the whole, and why.
    pub(super) left_out: Vec<(String, String)>,
    pub(super) notes: Vec<String>,
}

impl<'a> Draft<'a> {
    pub(super) fn new(scene: &'a Scene, job: &Job) -> Result<Self, Cancelled> {
        let (mut parts, mut left_out) = (Vec::new(), Vec::new());
        let assemblies = &scene.structure.assemblies;
        for (i, assembly) in assemblies.iter().enumerate() {
            job.step(i, 2 * assemblies.len())?;
            match Part::new(scene, assembly) {
                Ok(part) => parts.push(part),
                Err(why) => left_out.push((assembly.id.clone(), why)),
            }
        }
        let mut draft = Self { scene, parts, joints: Vec::new(), left_out, notes: Vec::new() };
        draft.join(job)?;
        draft.divide();
        Ok(draft)
    }

    /// Finds where members touch, and what the scene says of it.
    fn join(&mut self, job: &Job) -> Result<(), Cancelled> {
        let given = |a: &str, b: &str| {
            let told = self.scene.structure.joints.iter();
            told.clone().find(|j| [&j.of.0, &j.of.1] == [a, b] || [&j.of.1, &j.of.0] == [a, b])
        };
        let n = self.parts.len();
        for i in 0..n {
            job.step(n + i, 2 * n)?;
            for k in i + 1..n {
                let told = given(&self.parts[i].assembly.id, &self.parts[k].assembly.id);
                // The first that the scene names is the first here.
                let of = match told {
                    Some(joint) if joint.of.0 != self.parts[i].assembly.id => [k, i],
                    _ => [i, k],
                };
                let [a, b] = of.map(|p| &self.parts[p].solid);
                let touching = contact::patch(a, b, contact::tolerance(a, b));
                let patch = match told {
                    Some(_) => touching.or_else(|| contact::gap(a, b)),
                    None => touching,
                };
                let kind = told.map_or(JointKind::Monolithic, |joint| joint.kind);
                if let (Some(patch), true) = (patch, kind != JointKind::Apart) {
                    self.joints.push(Joined { of, kind, patch, is_given: told.is_some() });
                }
            }
        }
        Ok(())
    }

    /// Gives bars a station wherever something happens, and every member its points.
    fn divide(&mut self) {
        let mut first = 0;
        for p in 0..self.parts.len() {
            let part = &self.parts[p];
            let (stations, points) = match &part.shape {
                Shape::Bar(bar) => {
                    let lengths = bar.lengths();
                    let mut stations = lengths.clone();
                    let length = lengths[lengths.len() - 1];
                    let mut add = |s: f64, gap: f64| {
                        let s = s.clamp(0.0, length);
                        if stations.iter().all(|other| (other - s).abs() > gap) {
                            stations.push(s);
                        }
                    };
                    let along = |share: f64| part.station(share);
                    self.marks(part).into_iter().for_each(|m| add(along(m), 1e-6 * length));
                    for joint in self.joints.iter().filter(|j| j.of.contains(&p)) {
                        touched(part, joint, length)
                            .into_iter()
                            .for_each(|s| add(s, CLOSE * length));
                    }
                    stations.sort_unstable_by(f64::total_cmp);
                    let points = stations.iter().map(|&s| bar.at(s).0).collect();
                    (stations, points)
                }
                Shape::Sheet(sheet) => (Vec::new(), sheet.nodes.clone()),
            };
            let part = &mut self.parts[p];
            (part.stations, part.points, part.first) = (stations, points, first);
            first += part.points.len();
        }
    }

    /// Shares of a member's axis where supports and loads begin and end.
    fn marks(&self, part: &Part) -> Vec<f64> {
        let told = &self.scene.structure;
        let mine = |id: &String| *id == part.assembly.id;
        let held = self.supports(part).flat_map(|s| ends(&s.place));
        let loads =
            told.loads.iter().filter(|l| l.members.is_empty() || l.members.iter().any(mine));
        let acting = loads.flat_map(|l| match &l.action {
            Action::Force { place, .. } | Action::Pressure { place, .. } => ends(place),
            Action::Line { from, to, .. } => vec![f64::from(*from), f64::from(*to)],
            _ => Vec::new(),
        });
        held.chain(acting).collect()
    }

    /// Members that are joined to each other, however far: a number each.
    pub(super) fn bodies(&self, without: Option<usize>) -> Vec<usize> {
        let mut all = Groups::new(self.parts.len());
        let whole = self.joints.iter().filter(|j| without.is_none_or(|w| !j.of.contains(&w)));
        whole.for_each(|j| all.join(j.of[0], j.of[1]));
        (0..self.parts.len()).map(|p| all.root(p)).collect()
    }

    /// Whether the ground holds a member: by a support, or since it is a footing of which no
    /// support is said.
    pub(super) fn is_held(&self, part: &Part) -> bool {
        part.assembly.kind == MemberKind::Footing || self.supports(part).next().is_some()
    }

    /// The supports of a member; not those that stand for the rest of the structure, which is here.
    pub(super) fn supports(&self, part: &Part) -> impl Iterator<Item = &Support> {
        let id = part.assembly.id.clone();
        let all = self.scene.structure.supports.iter();
        all.filter(move |s| s.member == id && !s.alone)
    }
}

/// Where a place on an axis begins and ends.
fn ends(place: &Place) -> Vec<f64> {
    match *place {
        Place::Section(at) | Place::Pipe(at) => vec![f64::from(at)],
        Place::Surface { from, to, .. } => vec![f64::from(from), f64::from(to)],
        Place::Start | Place::End | Place::Top | Place::Bottom | Place::Whole => Vec::new(),
    }
}

/// Where along a bar a joint needs stations: at its edges and its middle, or all along.
fn touched(part: &Part, joint: &Joined, length: f64) -> Vec<f64> {
    let Shape::Bar(bar) = &part.shape else { return Vec::new() };
    let at: Vec<f64> = joint.patch.samples.iter().map(|s| bar.project(s.at)).collect();
    let [from, to] =
        at.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], s| [l.min(*s), h.max(*s)]);
    let range = to - from;
    if range > LONG[0] * bar.depth() && range > LONG[1] * length {
        let count = (range * STATIONS / length).ceil();
        return (0..=count as u32).map(|k| from + range * f64::from(k) / count).collect();
    }
    let middle = bar.project(joint.patch.middle);
    vec![middle, from, to]
}

impl<'a> Part<'a> {
    fn new(scene: &Scene, assembly: &'a Assembly) -> Result<Self, String> {
        if assembly.is_tunnel() {
            return Err("a tunnel bears by itself: analyze it without --whole".into());
        }
        let member = scene.members.iter().find(|m| m.id == assembly.id);
        let member = member.ok_or("it has no surface")?;
        let (points, triangles, turn) = imported::surface(scene, member);
        let solid = Solid::new(&points, &triangles).ok_or("its surface encloses nothing")?;
        let axes = match &assembly.body {
            Some(_) => Axes::of(&assembly.frame),
            None => imported::axes(member, &points, turn),
        };
        let shape = Shape::of(assembly, &axes, &solid)
            .ok_or("its surface is cut into no sections: close it")?;
        let matter = matter::unbroken(scene, assembly).map_err(|why| why.to_string())?;
        let (stations, points) = (Vec::new(), Vec::new());
        Ok(Self { assembly, axes, solid, shape, matter, stations, first: 0, points })
    }

    /// How far along its axis a place is, 0 to 1.
    pub(super) fn share(&self, at: DVec3) -> f64 {
        self.axes.local(at).z / self.axes.length
    }

    /// How far along its bar the section is that is at a share of its axis, m.
    pub(super) fn station(&self, share: f64) -> f64 {
        let Shape::Bar(bar) = &self.shape else { return 0.0 };
        let lengths = bar.lengths();
        let off = |p: DVec3| self.share(p) - share;
        let crossed =
            bar.points.windows(2).zip(&lengths).find(|(w, _)| off(w[0]) * off(w[1]) <= 0.0);
        match crossed {
            Some((w, begin)) if off(w[0]) != off(w[1]) => {
                begin + w[0].distance(w[1]) * off(w[0]) / (off(w[0]) - off(w[1]))
            }
            _ => bar.project(self.axes.start + share * self.axes.length * self.axes.unit[2]),
        }
    }

    /// What of its surface a place is; the middle of a section counts as 1 m².
    pub(super) fn samples(&self, place: &Place) -> Vec<Sample> {
        let point = |share: f64| {
            let at = match &self.shape {
                Shape::Bar(bar) => bar.at(self.station(share)).0,
                Shape::Sheet(_) => self.axes.start + share * self.axes.length * self.axes.unit[2],
            };
            vec![Sample { at, area: 1.0, normal: DVec3::Y }]
        };
        let along = self.axes.unit[2];
        let all = self.solid.samples(SAMPLES);
        let of = |keep: &dyn Fn(&Sample) -> bool| -> Vec<Sample> {
            all.iter().copied().filter(|s| keep(s)).collect()
        };
        match *place {
            Place::Section(at) | Place::Pipe(at) => point(f64::from(at)),
            Place::Start => of(&|s| s.normal.dot(along) < -LOOKS && self.share(s.at) < 0.02),
            Place::End => of(&|s| s.normal.dot(along) > LOOKS && self.share(s.at) > 0.98),
            Place::Whole => of(&|s| s.normal.dot(along).abs() < 0.5),
            Place::Top => of(&|s| s.normal.y > LOOKS),
            Place::Bottom => of(&|s| s.normal.y < -LOOKS),
            Place::Surface { from, to, side_deg } => {
                let (from, to) = (f64::from(from), f64::from(to));
                let towards = side_deg.map(|deg| {
                    let (sin, cos) = f64::from(deg).to_radians().sin_cos();
                    cos * self.axes.unit[0] + sin * self.axes.unit[1]
                });
                let is_side = |s: &Sample| {
                    s.normal.dot(along).abs() < 0.5
                        && towards.is_none_or(|t| s.normal.dot(t) > LOOKS)
                };
                if to - from < 1e-6 {
                    return self.line_across(of(&is_side), from, towards);
                }
                of(&|s| is_side(s) && (from..=to).contains(&self.share(s.at)))
            }
        }
    }

    /// A line across: samples of a side, moved to where it lies. Of a flange, a void's ceiling and
    /// a haunch it is the outermost that is there: a bearing lies below all of it, and lets it turn
    /// about itself.
    fn line_across(&self, mut side: Vec<Sample>, from: f64, towards: Option<DVec3>) -> Vec<Sample> {
        let (along, length) = (self.axes.unit[2], self.axes.length);
        let level = |s: &Sample| towards.map_or(0.0, |t| (s.at - self.axes.start).dot(t));
        let beside = |s: &Sample| (self.share(s.at) - from).abs();
        let nearest = side.iter().map(beside).fold(f64::INFINITY, f64::min);
        let near = side.iter().filter(|s| beside(s) <= nearest + NEAR);
        let outermost = near.map(level).fold(f64::NEG_INFINITY, f64::max);
        for s in &mut side {
            s.at += (from - self.share(s.at)) * length * along;
            if let Some(towards) = towards {
                s.at += (outermost - level(s)) * towards;
            }
        }
        side
    }

    /// Its points that bear what is at `at`, with their shares: the stations on both sides, or the
    /// nearest node.
    pub(super) fn bearers(&self, at: DVec3) -> [(usize, f64); 2] {
        match &self.shape {
            Shape::Bar(bar) => {
                let s = bar.project(at);
                let after =
                    self.stations.partition_point(|&t| t < s).clamp(1, self.stations.len() - 1);
                let [a, b] = [self.stations[after - 1], self.stations[after]];
                let share = ((s - a) / (b - a)).clamp(0.0, 1.0);
                [(after - 1, 1.0 - share), (after, share)]
            }
            Shape::Sheet(_) => [(self.nearest(at), 1.0), (0, 0.0)],
        }
    }

    /// Its point that is nearest to a place: of a bar, along it.
    pub(super) fn nearest(&self, at: DVec3) -> usize {
        let by = |off: &dyn Fn(usize) -> f64| {
            (0..self.points.len()).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0)
        };
        match &self.shape {
            Shape::Bar(bar) => {
                let s = bar.project(at);
                by(&|i| (self.stations[i] - s).abs())
            }
            Shape::Sheet(_) => by(&|i| self.points[i].distance_squared(at)),
        }
    }
}

/// Things that belong together.
pub(super) struct Groups(Vec<usize>);

impl Groups {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    pub(super) fn root(&self, mut i: usize) -> usize {
        while self.0[i] != i {
            i = self.0[i];
        }
        i
    }

    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Elements of a member in a model.
#[derive(Debug, Clone, Default)]
pub(super) struct Elements {
    pub(super) beams: std::ops::Range<usize>,
    pub(super) plates: std::ops::Range<usize>,
}

/// A model, and which of its elements and nodes are whose.
pub(super) struct Built {
    pub(super) model: Model,
    /// By part; of those that are no part of it, none.
    pub(super) elements: Vec<Elements>,
    /// Where every point of the draft is fastened.
    pub(super) ends: Vec<End>,
    /// By link: the joint that it is part of; none: it is a support's.
    pub(super) links: Vec<Option<usize>>,
    /// By node that the ground holds: the part that it belongs to.
    pub(super) grounds: BTreeMap<u32, usize>,
    /// Parts that nothing holds.
    pub(super) hanging: Vec<usize>,
}

/// A support as it is laid out.
struct Ground {
    part: usize,
    /// Root of the points that it holds.
    root: usize,
    middle: DVec3,
    /// Directions held, and turns.
    holds: Vec<(bool, DVec3)>,
    /// Springs along and about the axes of the world.
    springs: [f64; 6],
}

impl Draft<'_> {
    /// The model of all members that something holds, or of all but one.
    pub(super) fn build(&self, without: Option<usize>) -> Built {
        let bodies = self.bodies(without);
        let is_there = |p: usize| without != Some(p);
        let held: Vec<usize> = (0..self.parts.len())
            .filter(|&p| is_there(p) && self.is_held(&self.parts[p]))
            .map(|p| bodies[p])
            .collect();
        let bears = |p: usize| is_there(p) && held.contains(&bodies[p]);
        let hanging = (0..self.parts.len()).filter(|&p| is_there(p) && !bears(p)).collect();
        let points = self.parts.last().map_or(0, |p| p.first + p.points.len());
        let mut rigid = Groups::new(points);
        let mut linked = Vec::new();
        for (j, joint) in self.joints.iter().enumerate() {
            if joint.of.iter().any(|&p| !bears(p)) {
                continue;
            }
            match joint.kind {
                JointKind::Monolithic => {
                    self.pairs(joint).into_iter().for_each(|(a, b)| rigid.join(a, b));
                }
                _ => linked.extend(self.bearings(joint).into_iter().map(|b| (j, b))),
            }
        }
        let grounds: Vec<Ground> = (0..self.parts.len())
            .filter(|&p| bears(p))
            .flat_map(|p| self.grounds(p, &rigid))
            .collect();
        let (ends, nodes) = self.fasten(&rigid, &grounds, &bears);
        let mut built = Built {
            model: Model { nodes, ..Model::default() },
            elements: vec![Elements::default(); self.parts.len()],
            ends,
            links: Vec::new(),
            grounds: BTreeMap::new(),
            hanging,
        };
        for p in (0..self.parts.len()).filter(|&p| bears(p)) {
            self.parts[p].lay(&mut built, p);
        }
        linked.iter().for_each(|&(j, bearing)| self.link(&mut built, j, bearing));
        for ground in &grounds {
            built.hold(ground, self.parts[ground.part].stiffness());
        }
        built
    }

    /// Nodes, one for all points that are rigidly joined: where the ground holds them, else in
    /// their middle.
    fn fasten(
        &self,
        rigid: &Groups,
        grounds: &[Ground],
        bears: &impl Fn(usize) -> bool,
    ) -> (Vec<End>, Vec<DVec3>) {
        let all: Vec<(usize, DVec3)> = (self.parts.iter().enumerate())
            .flat_map(|(p, part)| part.points.iter().map(move |&at| (p, at)))
            .collect();
        let mut sums: BTreeMap<usize, (DVec3, f64)> = BTreeMap::new();
        for (i, (_, at)) in all.iter().enumerate().filter(|(_, (p, _))| bears(*p)) {
            let sum = sums.entry(rigid.root(i)).or_default();
            *sum = (sum.0 + *at, sum.1 + 1.0);
        }
        let number: BTreeMap<usize, u32> = sums.keys().copied().zip(0..).collect();
        let node = |(root, sum): (&usize, &(DVec3, f64))| {
            let ground = grounds.iter().find(|g| g.root == *root);
            ground.map_or(sum.0 / sum.1, |g| g.middle)
        };
        let nodes: Vec<DVec3> = sums.iter().map(node).collect();
        let end = |(i, (_, at)): (usize, &(usize, DVec3))| {
            let node = number.get(&rigid.root(i)).copied().unwrap_or(u32::MAX);
            let arm = nodes.get(node as usize).map_or(DVec3::ZERO, |n| *at - *n);
            End { node, arm }
        };
        (all.iter().enumerate().map(end).collect(), nodes)
    }

    /// Points of the two members of a joint that belong together, numbers among all. Each point of
    /// the member with more of them has one partner, so that what touches all along does not become
    /// one block.
    fn pairs(&self, joint: &Joined) -> Vec<(usize, usize)> {
        let [a, b] = joint.of.map(|p| &self.parts[p]);
        let mut weights: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for sample in &joint.patch.samples {
            let pair = (a.nearest(sample.at), b.nearest(sample.at));
            *weights.entry(pair).or_default() += sample.area;
        }
        let sum = |of: &dyn Fn(&(usize, usize)) -> usize| {
            let mut sums: BTreeMap<usize, f64> = BTreeMap::new();
            weights.iter().for_each(|(pair, w)| *sums.entry(of(pair)).or_default() += w);
            sums
        };
        let (of_a, of_b) = (sum(&|p| p.0), sum(&|p| p.1));
        let fine_first = of_a.len() >= of_b.len();
        let (fine, is_sheet) = match fine_first {
            true => (of_a, matches!(a.shape, Shape::Sheet(_))),
            false => (of_b, matches!(b.shape, Shape::Sheet(_))),
        };
        let most = fine.values().copied().fold(0.0, f64::max);
        let partner = |f: usize| {
            let mine =
                weights.iter().filter(|(pair, _)| f == if fine_first { pair.0 } else { pair.1 });
            mine.max_by(|x, y| x.1.total_cmp(y.1))
                .map(|(pair, _)| (a.first + pair.0, b.first + pair.1))
        };
        let enough = |w: f64| !is_sheet || w >= PART * most;
        fine.iter().filter(|(_, w)| enough(**w)).filter_map(|(f, _)| partner(*f)).collect()
    }

    /// Where hinges or bearings of a joint are, with the points that they join: one in its middle
    /// where a bar touches with part of it, else one for each pair of points, in what is theirs.
    fn bearings(&self, joint: &Joined) -> Vec<((usize, usize), DVec3)> {
        let [a, b] = joint.of.map(|p| &self.parts[p]);
        let is_short = |part: &Part| match &part.shape {
            Shape::Bar(bar) => touched(part, joint, bar.lengths()[bar.pieces.len()]).len() < 4,
            Shape::Sheet(_) => false,
        };
        let middle = joint.patch.middle;
        if is_short(a) || is_short(b) {
            let pair = (a.first + a.nearest(middle), b.first + b.nearest(middle));
            return vec![(pair, middle)];
        }
        let place = |pair: (usize, usize)| {
            let mine = |s: &&Sample| (a.first + a.nearest(s.at), b.first + b.nearest(s.at)) == pair;
            let (sum, area) = (joint.patch.samples.iter().filter(mine))
                .fold((DVec3::ZERO, 0.0), |(p, w), s| (p + s.area * s.at, w + s.area));
            (pair, if area > 0.0 { sum / area } else { middle })
        };
        self.pairs(joint).into_iter().map(place).collect()
    }

    /// What holds a member.
    fn grounds(&self, p: usize, rigid: &Groups) -> Vec<Ground> {
        let part = &self.parts[p];
        let mut found: Vec<Ground> =
            self.supports(part).flat_map(|s| grounds(p, part, &s.place, &s.hold, rigid)).collect();
        if found.is_empty() && part.assembly.kind == MemberKind::Footing {
            found = grounds(p, part, &Place::Bottom, &Hold::Fixed, rigid);
        }
        found
    }

    /// A hinge or bearing between two points.
    fn link(&self, built: &mut Built, j: usize, ((a, b), place): ((usize, usize), DVec3)) {
        let joint = &self.joints[j];
        let [first, second] = joint.of.map(|p| &self.parts[p]);
        let along = [first, second].into_iter().find_map(|part| match &part.shape {
            Shape::Bar(bar) => {
                let along = bar.points[bar.points.len() - 1] - bar.points[0];
                // A bar that stands on the face says nothing of the line in it.
                let along = along.reject_from(joint.patch.normal) / along.length();
                (along.length() > 0.5).then(|| along.normalize())
            }
            Shape::Sheet(_) => None,
        });
        let normal = joint.patch.normal;
        // Between sheets the line is the way that they touch along.
        let far = |s: &&Sample| s.at.distance(joint.patch.middle);
        let edge = joint.patch.samples.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
        let edge = edge.and_then(|s| {
            let way = (s.at - joint.patch.middle).reject_from(normal);
            Some(way.try_normalize()?.cross(normal))
        });
        let slide = along.or(edge).unwrap_or_else(|| normal.any_orthonormal_vector());
        let line = normal.cross(slide);
        let (force, moment) =
            [first, second].iter().fold((0.0, 0.0), |(f, m): (f64, f64), part| {
                let (force, moment) = part.stiffness();
                (f.max(force), m.max(moment))
            });
        let slides = if joint.kind == JointKind::Bearing { 0.0 } else { STIFF * force };
        let ends = [a, b].map(|point| {
            let End { node, .. } = built.ends[point];
            Some(End { node, arm: place - built.model.nodes[node as usize] })
        });
        built.model.links.push(Link {
            ends,
            axes: [normal, line, slide],
            stiffness: [STIFF * force, STIFF * force, slides, STIFF * moment, 0.0, STIFF * moment],
        });
        built.links.push(Some(j));
    }
}

/// A support on a member, one for each rigid body that its place is on.
fn grounds(p: usize, part: &Part, place: &Place, hold: &Hold, rigid: &Groups) -> Vec<Ground> {
    let mut by_root: BTreeMap<usize, Vec<Sample>> = BTreeMap::new();
    for sample in part.samples(place) {
        by_root.entry(rigid.root(part.first + part.nearest(sample.at))).or_default().push(sample);
    }
    let of = |(root, samples): (usize, Vec<Sample>)| {
        let area: f64 = samples.iter().map(|s| s.area).sum();
        let middle = samples.iter().map(|s| s.area / area * s.at).sum::<DVec3>();
        let holds = held(part, hold, &samples, middle);
        let mut springs = [0.0; 6];
        if let Hold::Springs { stiffness_mpa_m, .. } = hold {
            let k = 1e6 * stiffness_mpa_m.as_dvec3();
            for s in &samples {
                let d = s.at - middle;
                let square = d * d;
                (0..3).for_each(|i| springs[i] += s.area * k[i]);
                for (i, [m, n]) in [[1, 2], [2, 0], [0, 1]].into_iter().enumerate() {
                    springs[3 + i] += s.area * (k[m] * square[n] + k[n] * square[m]);
                }
            }
        }
        Ground { part: p, root, middle, holds, springs }
    };
    by_root.into_iter().map(of).collect()
}

/// The directions in which a support holds a body, and about which it does not let it turn.
fn held(part: &Part, hold: &Hold, samples: &[Sample], middle: DVec3) -> Vec<(bool, DVec3)> {
    let held = match *hold {
        Hold::Fixed => [true; 3],
        Hold::Directions { x, y, z } => [x, y, z],
        Hold::Symmetry => {
            // However thin its section is.
            let [zero, ninety, along] = part.axes.unit;
            return vec![(false, along), (true, zero), (true, ninety)];
        }
        Hold::Springs { .. } => [false; 3],
    };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(held).filter(|axis| axis.1);
    let turns = turned(samples, middle, held).into_iter().map(|axis| (true, axis));
    axes.map(|(axis, _)| (false, axis)).chain(turns).collect()
}

/// About which axes a body cannot turn whose samples are held in these directions of the world:
/// those of d × e, as far as they are more than a thousandth of the most.
fn turned(samples: &[Sample], middle: DVec3, held: [bool; 3]) -> Vec<DVec3> {
    let mut sum = DMat3::ZERO;
    for s in samples {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(held).filter(|a| a.1) {
            let lever = (s.at - middle).cross(axis.0);
            sum += s.area * DMat3::from_cols(lever * lever.x, lever * lever.y, lever * lever.z);
        }
    }
    let eigen = Matrix3::from_fn(|r, c| sum.col(c)[r]).symmetric_eigen();
    let most = eigen.eigenvalues.max();
    (0..3)
        .filter(|&i| most > 0.0 && eigen.eigenvalues[i] > 1e-3 * most)
        .map(|i| {
            let v = eigen.eigenvectors.column(i);
            DVec3::new(v[0], v[1], v[2])
        })
        .collect()
}

impl Part<'_> {
    /// How stiff it is against force and moment, N/m and N m: E A/L and E I/L at most.
    fn stiffness(&self) -> (f64, f64) {
        let e = self.matter.law.modulus;
        match &self.shape {
            Shape::Bar(bar) => {
                let length = bar.lengths()[bar.pieces.len()];
                let over =
                    |of: &dyn Fn(usize) -> f64| (0..bar.pieces.len()).map(of).fold(0.0, f64::max);
                let area = over(&|i| bar.pieces[i].0.area);
                let second = over(&|i| bar.pieces[i].0.second[0].max(bar.pieces[i].0.second[1]));
                (e * area / length, e * second / length)
            }
            Shape::Sheet(sheet) => {
                let t = sheet.plates.iter().map(|p| p.1).fold(0.0, f64::max);
                (e * t, e * t.powi(3) / 12.0)
            }
        }
    }

    /// Lays its beams or plates into a model.
    fn lay(&self, built: &mut Built, p: usize) {
        let (e, nu) = (self.matter.law.modulus, self.matter.law.poisson);
        let ends = &built.ends[self.first..self.first + self.points.len()];
        let (beams, plates) = (built.model.beams.len(), built.model.plates.len());
        match &self.shape {
            Shape::Bar(bar) => {
                for (i, pair) in self.stations.windows(2).enumerate() {
                    let (section, across) = bar.pieces[bar.at(0.5 * (pair[0] + pair[1])).1];
                    let beam = Beam {
                        ends: [self.points[i], self.points[i + 1]],
                        across,
                        section,
                        moduli: [e, e / (2.0 * (1.0 + nu))],
                        released: [[false; 6]; 2],
                    };
                    built.model.beams.push((beam, [ends[i], ends[i + 1]]));
                }
            }
            Shape::Sheet(sheet) => {
                for (corners, thickness) in &sheet.plates {
                    let nodes = corners.map(|c| self.points[c as usize]);
                    let shell = Shell { nodes, thickness: *thickness, young: e, poisson: nu };
                    built.model.plates.push((shell, corners.map(|c| ends[c as usize])));
                }
            }
        }
        built.elements[p] = Elements {
            beams: beams..built.model.beams.len(),
            plates: plates..built.model.plates.len(),
        };
    }
}

impl Built {
    /// Lays out a support: where the node is its middle, exactly; a second one on a body by stiff
    /// springs.
    fn hold(&mut self, ground: &Ground, stiffness: (f64, f64)) {
        let node = self.ends[ground.root].node;
        let arm = ground.middle - self.model.nodes[node as usize];
        self.grounds.insert(node, ground.part);
        let mut springs = ground.springs;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        for (turns, direction) in &ground.holds {
            if arm.length() < 1e-9 {
                self.model.holds.push((node, *turns, *direction));
                continue;
            }
            let (first, stiff) = if *turns { (3, stiffness.1) } else { (0, stiffness.0) };
            for (i, axis) in axes.iter().enumerate() {
                springs[first + i] += STIFF * stiff * direction.dot(*axis).powi(2);
            }
        }
        if springs != [0.0; 6] {
            let ends = [Some(End { node, arm }), None];
            self.model.links.push(Link { ends, axes, stiffness: springs });
            self.links.push(None);
        }
    }
}
