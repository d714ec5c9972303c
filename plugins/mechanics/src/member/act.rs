//! What holds a member, what acts on it, and when.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use intrados_scene::structure::{self, Body as Shape, GroundModel, Hold, Place};

use super::{
    Along, Draft, MemberError, Raised, Reach, anchor::END, body::LINING, raised_by, warmth::Air,
};
use crate::{
    element::spring::Winkler,
    material::{DAY, YEAR},
    mesh::HexFace,
    model::{Action, Bedding, Ground, JACKING, Load, SteelKind},
};

/// How long the ground takes to press on a lining, s.
const SETTLES: f64 = DAY;
/// m/s².
pub(crate) const GRAVITY: f64 = 9.81;
/// Of water, N/m³.
const WATER: f64 = 9.81e3;
/// How far a load stretches over time before the steps that follow creep may grow: each is so many
/// times as long as what lies behind.
const GROWTH: f64 = 1.5;
/// Cosine of the steepest face that looks up or down.
const LOOKS: f64 = 0.7;
/// First step after an event, s.
const FIRST: f64 = DAY;
/// Cosine from which on a member lies along an axis of the world: single precision turns it less.
const ALONG: f64 = 1.0 - 1e-8;
/// How far off a line across may lie that stands for one, of the length.
const NEAR_LINE: f64 = 0.1;
/// Said of a ring that its ground only beds.
const UNPRESSED: &str = "nothing presses the ring on its ground: as it shrinks it may part from it, and rest where no equilibrium is found; give cover_m and weight_kn_m3, or water_m";
/// Said of what is computed up to a plane of symmetry.
pub(crate) const UP_TO_SYMMETRY: &str = "what is symmetric is computed up to its plane of symmetry: weight, loads and forces are those of that part";

impl Draft<'_> {
    /// Ground on the outermost face.
    pub(super) fn surround(&mut self) -> Result<(), MemberError> {
        let Some(Shape::Tunnel { ground: Some(ground), .. }) = &self.member.body else {
            return Ok(());
        };
        let outer = self.model.mesh.face_sets.get("outer").cloned().unwrap_or_default();
        let [vertical, water] =
            [f64::from(ground.weight_kn_m3) * 1e3, ground.water_m.map_or(0.0, f64::from)];
        let (cover, lateral) = (f64::from(ground.cover_m), f64::from(ground.lateral_ratio));
        let axes = self.axes;
        // The ground closes on the segments before anything else is built.
        let comes = [self.early(), self.early() + SETTLES];
        let pressure = |at: DVec3| {
            let out = axes.local(at);
            let normal = (axes.unit[0] * out.x + axes.unit[1] * out.y).normalize_or_zero();
            let depth = (cover - (at.y - axes.start.y)).max(0.0);
            let pore =
                ground.water_m.map_or(0.0, |_| WATER * (water - (at.y - axes.start.y)).max(0.0));
            let upright = (vertical * depth - pore).max(0.0);
            pore + upright * (normal.y.powi(2) + lateral * (1.0 - normal.y.powi(2)))
        };
        match ground.model {
            GroundModel::Springs { radial_mpa_m, tangential_mpa_m } => {
                let springs = |face: HexFace| {
                    let (at, _) = self.model.mesh.face_middle(face);
                    Winkler {
                        radial: f64::from(radial_mpa_m) * 1e6,
                        tangential: f64::from(tangential_mpa_m) * 1e6,
                        pressure: pressure(at),
                    }
                };
                if outer.iter().all(|&face| springs(face).pressure <= 0.0) {
                    self.notes.push(UNPRESSED.into());
                }
                let around = |face| Bedding::Around {
                    axis: [axes.start, axes.unit[2]],
                    springs: springs(face),
                    comes,
                };
                self.model.ground =
                    outer.iter().map(|&face| Ground { face, bedding: around(face) }).collect();
            }
            GroundModel::Solid { .. } => {
                // Far enough away nothing moves; the pressure at rest acts where the lining meets
                // the ground, as if it had been dug in one.
                let held: Vec<u32> =
                    outer.iter().flat_map(|&face| self.model.mesh.face(face)).collect();
                self.model.holds.extend(held.into_iter().flat_map(|n| (0..3).map(move |c| (n, c))));
                if vertical > 0.0 {
                    self.notes.push("solid ground: its own weight and the pressure at rest are not applied; springs carry them".into());
                }
            }
        }
        Ok(())
    }

    /// A moment before anything of the scene acts, s.
    fn early(&self) -> f64 {
        let first = self
            .scene
            .structure
            .loads
            .iter()
            .flat_map(|l| l.history.iter().map(|h| f64::from(h.0) * DAY))
            .fold(self.begin(), f64::min);
        first - 2.0 * SETTLES
    }

    /// Supports of the scene.
    pub(super) fn hold(&mut self) -> Result<(), MemberError> {
        for support in self.scene.structure.supports.iter().filter(|s| s.member == self.member.id) {
            if let Hold::Springs { stiffness_mpa_m, lifts } = support.hold {
                let bedding =
                    Bedding::Springs { stiffness: stiffness_mpa_m.as_dvec3() * 1e6, lifts };
                let faces = self.faces(&support.place);
                if faces.is_empty() {
                    return Err(self.unsupported("springs act on no face: give Start, End, Top, Bottom or a surface as their place"));
                }
                self.model.ground.extend(faces.into_iter().map(|face| Ground { face, bedding }));
                continue;
            }
            let nodes = self.nodes(&support.place);
            if nodes.is_empty() {
                return Err(self.unsupported("a support holds no node: widen its place or choose smaller elements (--element)"));
            }
            let held: [bool; 3] = match support.hold {
                Hold::Fixed => [true; 3],
                Hold::Directions { x, y, z } => [x, y, z],
                Hold::Symmetry => self.across_symmetry(&support.place)?,
                Hold::Springs { .. } => [false; 3],
            };
            let components = (0..3).filter(|&c| held[c]).map(|c| c as u8);
            for component in components {
                self.model.holds.extend(nodes.iter().map(|&n| (n, component)));
            }
        }
        self.model.holds.sort_unstable();
        self.model.holds.dedup();
        if self.model.holds.is_empty() && self.model.ground.is_empty() {
            let id = &self.member.id;
            let what = format!(
                "nothing holds it: add a support to the scene, such as (member: \"{id}\", place: Bottom, hold: Fixed)"
            );
            return Err(self.unsupported(what));
        }
        Ok(())
    }

    /// The direction of the world that a plane of symmetry at this end holds.
    fn across_symmetry(&self, place: &Place) -> Result<[bool; 3], MemberError> {
        let held = self.axes.unit[2].to_array().map(|cosine| cosine.abs() > ALONG);
        if held.contains(&true) {
            return Ok(held);
        }
        Err(self.unsupported(format!(
            "its plane of symmetry ({place:?}) lies askew in the world: turn the member along x, y or z"
        )))
    }

    /// Faces in its planes of symmetry, in order: concrete goes on there.
    pub(super) fn mirrored(&self) -> Vec<HexFace> {
        let planes = self.scene.structure.mirrored(&self.member.id);
        let places = [Place::Start, Place::End].into_iter().zip(planes);
        let mut faces: Vec<HexFace> =
            places.filter(|p| p.1).flat_map(|(place, _)| self.faces(&place)).collect();
        faces.sort_unstable();
        faces
    }

    /// Whether a place is in a plane of symmetry, and not only near to it.
    pub(super) fn is_mirrored(&self, at: DVec3) -> bool {
        let along = self.axes.local(at).z / self.axes.length;
        let planes = self.scene.structure.mirrored(&self.member.id).into_iter().zip([0.0, 1.0]);
        planes.filter(|p| p.0).any(|(_, face)| (along - face).abs() < END)
    }

    /// Loads of the scene.
    pub(super) fn load(&mut self) -> Result<(), MemberError> {
        let id = &self.member.id;
        for load in self
            .scene
            .structure
            .loads
            .iter()
            .filter(|l| l.members.is_empty() || l.members.iter().any(|m| m == id))
        {
            let history = load
                .history
                .iter()
                .map(|&(day, factor)| (f64::from(day) * DAY, f64::from(factor)))
                .collect();
            if let structure::Action::Air { inside_k, outside_k } = load.action {
                self.air.push(Air { warmer: [inside_k, outside_k].map(f64::from), history });
                continue;
            }
            let Some(action) = self.action(load)? else { continue };
            self.model.loads.push(Load { name: load.name.clone(), action, history });
        }
        if self.model.loads.is_empty()
            && self.air.is_empty()
            && self.model.steel.iter().all(|s| matches!(s.kind, SteelKind::Bar(_)))
        {
            self.notes.push("nothing loads this member: only shrinkage acts".into());
        }
        Ok(())
    }

    /// Loads that the scene raises until the member fails, by the first one's way.
    pub(super) fn raised(&self) -> Option<Raised> {
        let loads = self.scene.structure.loads.iter().filter(|l| l.loading.is_some());
        let names: Vec<&str> = loads.clone().map(|l| l.name.as_str()).collect();
        let along = match loads.clone().find_map(|l| l.loading)? {
            structure::Loading::Automatic => Along::Automatic,
            structure::Loading::Displacement { to_mm } => {
                Along::Displacement(to_mm.map(|mm| 1e-3 * f64::from(mm)))
            }
            structure::Loading::ArcLength => Along::ArcLength,
        };
        let loads = raised_by(&self.model, &names);
        (!loads.is_empty()).then_some(Raised { loads, along, to: Reach::default() })
    }

    fn action(&mut self, load: &structure::Load) -> Result<Option<Action>, MemberError> {
        use structure::Action as Written;
        let newtons = |kn: glam::Vec3| kn.as_dvec3() * 1e3;
        Ok(Some(match &load.action {
            Written::SelfWeight => Action::Weight(-GRAVITY * DVec3::Y),
            Written::Force { place, force_kn } => {
                Action::Nodes(self.spread(place, newtons(*force_kn), &load.name)?)
            }
            Written::Line { from, to, force_kn_m } => {
                let (from, to) = (f64::from(*from), f64::from(*to));
                let total = newtons(*force_kn_m) * (to - from) * self.axes.length;
                Action::Nodes(self.through(from, to, total, &load.name)?)
            }
            Written::Pressure { place, pressure_kpa } => {
                let pressure = f64::from(*pressure_kpa) * 1e3;
                Action::Faces(self.faces(place).into_iter().map(|face| (face, pressure)).collect())
            }
            Written::InnerPressure { pressure_kpa } => {
                let pressure = f64::from(*pressure_kpa) * 1e3;
                if self.pipe().is_some() {
                    let shells = 0..self.model.mesh.shells.len() as u32;
                    return Ok(Some(Action::Shells(shells.map(|s| (s, pressure)).collect())));
                }
                let inner = self.model.mesh.face_sets.get("inner").cloned().unwrap_or_default();
                if inner.is_empty() {
                    return Err(self.unsupported(format!(
                        "load {}: only a tunnel has an inside that water can press on",
                        load.name
                    )));
                }
                Action::Faces(inner.into_iter().map(|face| (face, pressure)).collect())
            }
            Written::Displacement { place, displacement_mm } => {
                let nodes = self.nodes(place);
                if nodes.is_empty() {
                    return Err(self.unsupported(format!(
                        "load {} moves no node: widen its place, or give the member the pipe that it names",
                        load.name
                    )));
                }
                let move_by = displacement_mm.as_dvec3() / 1000.0;
                Action::Displacement(
                    nodes
                        .into_iter()
                        .flat_map(|n| {
                            (0..3)
                                .filter(move |&c| move_by[c] != 0.0)
                                .map(move |c| (n, c as u8, move_by[c]))
                        })
                        .collect(),
                )
            }
            // Its heat is conducted first.
            Written::Air { .. } => return Ok(None),
            Written::PipeTemperature { warmer_k } => {
                if self.pipe().is_none() {
                    return Err(self.unsupported(format!(
                        "load {} warms a pipe, and it has none: give its tunnel a pipe",
                        load.name
                    )));
                }
                let mut warmth = vec![0.0; self.model.mesh.nodes.len()];
                for node in self.model.mesh.shells.iter().flat_map(|shell| shell.nodes) {
                    warmth[node as usize] = f64::from(*warmer_k);
                }
                Action::Temperature(warmth)
            }
            Written::Temperature { uniform_k, difference_k } => {
                Action::Temperature(self.warmth(f64::from(*uniform_k), f64::from(*difference_k)))
            }
        }))
    }

    /// Temperature of every node: uniform, and linear from the side at 0 degrees (inside, for a
    /// tunnel) to the opposite.
    fn warmth(&self, uniform: f64, difference: f64) -> Vec<f64> {
        let across = |p: DVec3| {
            let local = self.axes.local(p);
            if self.is_tunnel() { -local.truncate().length() } else { local.x }
        };
        let lining = self.model.mesh.regions.iter().position(|r| r == LINING);
        let of_lining = self.model.mesh.hexes.iter().filter(|h| {
            lining.is_none_or(|_| self.model.mesh.regions[h.region as usize].starts_with(LINING))
        });
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for node in of_lining.flat_map(|h| h.nodes) {
            let at = across(self.model.mesh.nodes[node as usize]);
            (low, high) = (low.min(at), high.max(at));
        }
        let share = |p: DVec3| ((across(p) - low) / (high - low).max(1e-9)).clamp(0.0, 1.0) - 0.5;
        self.model.mesh.nodes.iter().map(|&p| uniform + difference * share(p)).collect()
    }

    /// A force spread over the faces of a place by their areas, or over the nodes of a section.
    fn spread(
        &self,
        place: &Place,
        force: DVec3,
        name: &str,
    ) -> Result<Vec<(u32, DVec3)>, MemberError> {
        let faces = self.faces(place);
        let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
        for face in &faces {
            let area = self.model.mesh.face_middle(*face).1.length();
            self.model
                .mesh
                .face(*face)
                .into_iter()
                .for_each(|n| *shares.entry(n).or_default() += 0.25 * area);
        }
        if faces.is_empty() {
            self.nodes(place).into_iter().for_each(|n| *shares.entry(n).or_default() += 1.0);
        }
        let sum: f64 = shares.values().sum();
        if sum <= 0.0 {
            return Err(self
                .unsupported(format!("load {name} acts on no part of the mesh: widen its place or choose smaller elements (--element)")));
        }
        Ok(shares.into_iter().map(|(n, share)| (n, force * (share / sum))).collect())
    }

    /// A force spread over the volume between two places on the axis.
    fn through(
        &self,
        from: f64,
        to: f64,
        force: DVec3,
        name: &str,
    ) -> Result<Vec<(u32, DVec3)>, MemberError> {
        let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
        for h in 0..self.model.mesh.hexes.len() as u32 {
            let along = self.axes.local(self.model.mesh.centre(h)).z / self.axes.length;
            if (from..=to).contains(&along) {
                let volume = self.model.mesh.hex_volume(h);
                self.model.mesh.hexes[h as usize]
                    .nodes
                    .into_iter()
                    .for_each(|n| *shares.entry(n).or_default() += volume / 8.0);
            }
        }
        let sum: f64 = shares.values().sum();
        if sum <= 0.0 {
            return Err(
                self.unsupported(format!("load {name} acts on no part of the mesh: widen it or choose smaller elements (--element)"))
            );
        }
        Ok(shares.into_iter().map(|(n, share)| (n, force * (share / sum))).collect())
    }

    /// Faces of the outside within a place.
    fn faces(&self, place: &Place) -> Vec<HexFace> {
        let length = self.axes.length;
        let near = |a: f64, b: f64| (a - b).abs() < 1e-6 * length.max(1.0);
        let mesh = &self.model.mesh;
        let outer = mesh.outer_faces().into_iter();
        let keep = |face: &HexFace| {
            let (middle, normal) = mesh.face_middle(*face);
            let (at, normal) = (self.axes.local(middle), normal.normalize_or_zero());
            let is_side = normal.dot(self.axes.unit[2]).abs() < 0.5;
            match *place {
                Place::Start => near(at.z, 0.0),
                Place::End => near(at.z, length),
                Place::Section(_) | Place::Pipe(_) => false,
                Place::Whole => is_side,
                Place::Top => normal.y > LOOKS,
                Place::Bottom => normal.y < -LOOKS,
                Place::Surface { from, to, side_deg } => {
                    let within = (f64::from(from) * length - 1e-6..=f64::from(to) * length + 1e-6)
                        .contains(&at.z);
                    let faces_it = side_deg.is_none_or(|deg| {
                        let (sin, cos) = f64::from(deg).to_radians().sin_cos();
                        let towards = cos * self.axes.unit[0] + sin * self.axes.unit[1];
                        // A quarter of the way round, on the side where the place lies.
                        normal.dot(towards) > 0.7 && (at.x * cos + at.y * sin) > 0.0
                    });
                    is_side && within && faces_it
                }
            }
        };
        outer.filter(keep).collect()
    }

    /// Nodes of a place.
    fn nodes(&self, place: &Place) -> Vec<u32> {
        let mesh = &self.model.mesh;
        if let Place::Section(at) | Place::Pipe(at) = *place {
            let (z, reach) = (f64::from(at) * self.axes.length, 1e-6 * self.axes.length.max(1.0));
            let of_pipe: BTreeSet<u32> = mesh.shells.iter().flat_map(|s| s.nodes).collect();
            let is_pipe = matches!(place, Place::Pipe(_));
            return (0..mesh.nodes.len() as u32)
                .filter(|n| of_pipe.contains(n) == is_pipe)
                .filter(|&n| (self.axes.local(mesh.nodes[n as usize]).z - z).abs() < reach)
                .collect();
        }
        let mut nodes: Vec<u32> = match *place {
            // A line across: a bearing that lets the member turn.
            Place::Surface { from, to, side_deg } if to - from < 1e-6 => {
                let around = Place::Surface { from: 0.0, to: 1.0, side_deg };
                let of_side = self.faces(&around).into_iter().flat_map(|face| mesh.face(face));
                self.line_across(of_side.collect(), f64::from(from) * self.axes.length)
            }
            _ => self.faces(place).into_iter().flat_map(|face| mesh.face(face)).collect(),
        };
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Of the nodes of a side, those on a line across it at `z` along the axis. Cubes that fill a
    /// surface need no layer of corners there, and none of full width at an end that is cut
    /// askew: the nearest layer counts that is half as wide as the widest.
    fn line_across(&self, side: BTreeSet<u32>, z: f64) -> Vec<u32> {
        let reach = 1e-6 * self.axes.length.max(1.0);
        let mut nodes: Vec<(DVec3, u32)> = side
            .into_iter()
            .map(|n| (self.axes.local(self.model.mesh.nodes[n as usize]), n))
            .collect();
        nodes.retain(|(at, _)| (at.z - z).abs() <= NEAR_LINE * self.axes.length + reach);
        nodes.sort_by(|a, b| a.0.z.total_cmp(&b.0.z));
        let layers: Vec<&[(DVec3, u32)]> =
            nodes.chunk_by(|a, b| (b.0.z - a.0.z).abs() <= reach).collect();
        let width = |layer: &[(DVec3, u32)]| {
            let [low, high] =
                layer.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[l, h], (at, _)| {
                    [l.min(at.truncate()), h.max(at.truncate())]
                });
            (high - low).max_element()
        };
        let widest = layers.iter().map(|l| width(l)).fold(0.0, f64::max);
        let off =
            |layer: &[(DVec3, u32)]| layer.first().map_or(f64::INFINITY, |n| (n.0.z - z).abs());
        let nearest = (layers.into_iter().filter(|l| width(l) >= 0.5 * widest))
            .min_by(|a, b| off(a).total_cmp(&off(b)));
        nearest.into_iter().flatten().map(|n| n.1).collect()
    }

    /// Moments to stop at, s: all events, and between them steps that grow with the time since the
    /// last.
    pub(super) fn times(&self) -> Vec<f64> {
        let begin = self.begin();
        let mut events = vec![begin];
        events.extend(self.model.bodies.iter().map(|b| b.birth));
        events.extend(self.model.loads.iter().flat_map(|l| l.history.iter().map(|h| h.0)));
        events.extend(self.air.iter().flat_map(|a| a.history.iter().map(|h| h.0)));
        events.extend(self.model.steel.iter().flat_map(|s| match &s.kind {
            SteelKind::Tendon(t) => vec![t.at, t.at + JACKING],
            SteelKind::Bar(_) | SteelKind::Stressed(..) => Vec::new(),
        }));
        // Of what a tunnel is made of, segments may be exposed for themselves.
        let own = self.scene.members.iter().filter(|m| self.member.holds(&m.id));
        let exposures = self.member.exposure.iter().chain(own.filter_map(|m| m.exposure.as_ref()));
        events.extend(exposures.map(|e| f64::from(e.years) * YEAR));
        events.retain(|&t| t >= begin && t.is_finite());
        events.sort_unstable_by(f64::total_cmp);
        events.dedup_by(|b, a| *b - *a < 60.0);
        let mut times = vec![begin];
        for &event in &events[1..] {
            let from = times[times.len() - 1];
            let mut step = FIRST;
            while times[times.len() - 1] + GROWTH * step < event {
                times.push(times[times.len() - 1] + step);
                step = step.max((times[times.len() - 1] - from) * GROWTH);
            }
            times.push(event);
        }
        if self.model.ground.iter().any(|g| matches!(g.bedding, Bedding::Around { .. })) {
            let early = self.early();
            times.splice(0..0, [early, early + SETTLES]);
        }
        times
    }
}
