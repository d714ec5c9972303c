//! Meshes of members.

use std::{collections::BTreeMap, f64::consts::PI};

use glam::DVec3;
use intrados_scene::{
    MemberKind,
    structure::{Action, Assembly, Body, BoxSection, GroundModel, Pipe, Place, Section},
};

use super::{Axes, Draft, MemberError, Meshing, Part};
use crate::mesh::{
    ElementId, Interface, Layer, Mesh, MeshError, Polar, Rings, Shell, divide,
    section::{Girder, Section as Plane},
};

/// Bricks that a member is cut into by default, at most about so many.
const MANY: f64 = 1500.0;

/// Bricks over the depth of a section that is bent, at least. Of four the first points of
/// integration lie a twentieth of the depth below the edge, while all that is pressed in bending
/// may be a seventh of it: such a section bears 3 % too much where one of five bears 1.
const DEEP: f64 = 5.0;

/// Region names of a tunnel.
pub(super) const LINING: &str = "lining";
pub(super) const SEGMENTS: &str = "segments";
pub(super) const CUSHION: &str = "cushion";
pub(super) const JOINT: &str = "joint";
pub(super) const RING_JOINT: &str = "ring joint";
pub(super) const GROUND: &str = "ground";
pub(super) const PIPE: &str = "pipe";
pub(super) const PIPE_CUSHION: &str = "pipe cushion";

impl Draft<'_> {
    /// Makes the mesh and puts it into the world.
    pub(super) fn build(&mut self, meshing: Meshing) -> Result<(), MemberError> {
        let length = self.axes.length;
        let marks: Vec<f64> = self.marks().into_iter().map(|along| along * length).collect();
        let mesh = match &self.member.body {
            Some(body @ (Body::Column { section, .. } | Body::Beam { section, .. })) => {
                self.tell_coarseness(section, length, meshing);
                // Columns may bend any way.
                let across = if matches!(body, Body::Column { .. }) { DEEP } else { 1.0 };
                prism(section, length, &marks, meshing, [DEEP, across])
            }
            Some(Body::BoxGirder { section, .. }) => girder(section, length, &marks, meshing),
            Some(Body::Tunnel { .. }) => self.tunnel(length, &marks, meshing),
            // Its mesh is there already.
            None => return Ok(()),
        };
        let mut mesh = mesh.map_err(|source| self.mesh_error(source))?;
        let axes = self.axes;
        mesh.transform(|p| axes.world(p));
        self.model.mesh = mesh;
        self.cut_pours();
        Ok(())
    }

    /// A note where bricks are larger than would suit the section.
    fn tell_coarseness(&mut self, section: &Section, length: f64, meshing: Meshing) {
        let [suits, h] = [0.25 * measures(section).0, brick(section, length, meshing)];
        if meshing.element.is_none() && h > suits {
            self.notes.push(format!(
                "elements of {h:.3} m, where a quarter of the section's smallest measure is {suits:.3} m, to keep to some {MANY} bricks: --element asks for others"
            ));
        }
    }

    /// Places on the axis, 0 to 1, where a plane of the mesh must be: pours, supports, loads.
    fn marks(&self) -> Vec<f64> {
        let told = &self.scene.structure;
        let mine = |member: &String| *member == self.member.id;
        let places = told.supports.iter().filter(|s| mine(&s.member)).map(|s| &s.place);
        let loads =
            told.loads.iter().filter(|l| l.members.is_empty() || l.members.iter().any(mine));
        let of_loads = loads.filter_map(|l| match &l.action {
            Action::Force { place, .. }
            | Action::Pressure { place, .. }
            | Action::Displacement { place, .. } => Some(place),
            _ => None,
        });
        let of_places = places.chain(of_loads).flat_map(|place| match *place {
            Place::Section(at) | Place::Pipe(at) => vec![at],
            Place::Surface { from, to, .. } => vec![from, to],
            Place::Start | Place::End | Place::Top | Place::Bottom | Place::Whole => vec![],
        });
        let of_pours = self.member.pours.iter().flat_map(|p| [p.from, p.to]);
        of_places.chain(of_pours).map(f64::from).collect()
    }

    fn tunnel(&self, length: f64, marks: &[f64], meshing: Meshing) -> Result<Mesh, MeshError> {
        let Some(Body::Tunnel { radius_m, segments, cushion_mm, inner_lining, ground, .. }) =
            &self.member.body
        else {
            return Ok(Mesh::default());
        };
        let thinnest = [
            inner_lining.as_ref().map(|l| l.thickness_m),
            segments.as_ref().map(|s| s.thickness_m),
        ];
        let thinnest = thinnest.into_iter().flatten().fold(f32::INFINITY, f32::min);
        let radial = meshing.element.unwrap_or(f64::from(thinnest) / 2.0);
        let around = meshing
            .element
            .unwrap_or_else(|| (2.0 * PI * f64::from(*radius_m) / 48.0).max(2.0 * radial));
        let mut layers = Vec::new();
        let mut radius = f64::from(*radius_m);
        let mut planes = marks.to_vec();
        let mut joints = Vec::new();
        if let Some(lining) = inner_lining {
            let outer = radius + f64::from(lining.thickness_m);
            layers.push(Layer {
                region: LINING.into(),
                radii: divide(radius, outer, &[], radial),
                ..Layer::default()
            });
            radius = outer + f64::from(*cushion_mm) / 1000.0;
        }
        if let Some(s) = segments {
            let outer = radius + f64::from(s.thickness_m);
            let turn = 360.0 / f64::from(s.count);
            let of_ring = |ring: u32| {
                let first = f64::from(s.first_joint_deg)
                    + if ring % 2 == 1 { f64::from(s.stagger_deg) } else { 0.0 };
                (0..s.count)
                    .map(|k| (first + f64::from(k) * turn).to_radians())
                    .collect::<Vec<f64>>()
            };
            let rings = s.rings(length as f32);
            let cuts: Vec<f64> = (1..rings).map(|r| f64::from(r) * f64::from(s.ring_m)).collect();
            planes.extend(&cuts);
            joints.extend((0..2).flat_map(of_ring));
            layers.push(Layer {
                region: SEGMENTS.into(),
                radii: divide(radius, outer, &[], radial),
                interface: inner_lining.as_ref().map(|_| CUSHION.into()),
                rings: Some(Rings {
                    planes: cuts,
                    joints: vec![of_ring(0), of_ring(1)],
                    joint: JOINT.into(),
                    ring_joint: Some(RING_JOINT.into()),
                }),
            });
            radius = outer;
        }
        if let Some(GroundModel::Solid { thickness_m, .. }) = ground.as_ref().map(|g| &g.model) {
            // Each layer half as thick again as the one inside.
            let (mut radii, mut step) = (vec![radius], 2.0 * radial);
            let outer = radius + f64::from(*thickness_m);
            while radii.last().is_some_and(|r| r + 1.5 * step < outer) {
                radii.push(radii[radii.len() - 1] + step);
                step *= 1.5;
            }
            radii.push(outer);
            layers.push(Layer { region: GROUND.into(), radii, ..Layer::default() });
        }
        for pour in &self.member.pours {
            joints.extend(
                pour.angles_deg
                    .iter()
                    .flat_map(|&(a, b)| [f64::from(a).to_radians(), f64::from(b).to_radians()]),
            );
        }
        let angle = around / f64::from(*radius_m);
        let first = joints.first().copied().unwrap_or(0.0);
        let angles = Polar::angles(first, first + 2.0 * PI, &joints, angle);
        let z = divide(
            0.0,
            length,
            &planes,
            meshing.element.unwrap_or((length / 6.0).max(around).min(1.5 * around)),
        );
        let mut mesh = Polar { layers, angles, z }.build()?;
        if let Some(pipe) = self.pipe() {
            lay_pipe(&mut mesh, pipe);
            mesh.check()?;
        }
        Ok(mesh)
    }

    /// The steel pipe of a tunnel that has one.
    pub(super) fn pipe(&self) -> Option<&Pipe> {
        match &self.member.body {
            Some(Body::Tunnel { pipe, .. }) => pipe.as_ref(),
            _ => None,
        }
    }

    /// Every pour becomes a region of its own; bricks that belong to none go with the first.
    fn cut_pours(&mut self) {
        let poured = if self.is_tunnel() { LINING } else { "concrete" };
        let Some(region) = self.model.mesh.regions.iter().position(|r| r == poured) else { return };
        for (i, pour) in self.member.pours.iter().enumerate().skip(1) {
            let axes = self.axes;
            let inside = |world: DVec3| {
                let p = axes.local(world);
                let along = p.z / axes.length;
                let angle = p.y.atan2(p.x).to_degrees();
                let within = pour.angles_deg.is_none_or(|(from, to)| {
                    (angle - f64::from(from)).rem_euclid(360.0) <= f64::from(to - from)
                });
                (f64::from(pour.from)..=f64::from(pour.to)).contains(&along) && within
            };
            let name = format!("{poured}/pour {}", i + 1);
            let next = self.model.mesh.region(&name);
            for h in 0..self.model.mesh.hexes.len() {
                if self.model.mesh.hexes[h].region == region as u32
                    && inside(self.model.mesh.centre(h as u32))
                {
                    self.model.mesh.hexes[h].region = next;
                }
            }
        }
    }

    /// What all parts have in common.
    fn part(&self) -> Part {
        let assumed = self.member.concrete_assumed;
        Part {
            id: String::new(),
            kind: MemberKind::Other,
            hexes: Vec::new(),
            has_steel: false,
            assumed,
            geometry: self.geometry,
        }
    }

    /// The members that the mesh holds.
    pub(super) fn parts(&self) -> Vec<Part> {
        let mesh = &self.model.mesh;
        let of = |keep: &dyn Fn(&str) -> bool| {
            (0..mesh.hexes.len() as u32)
                .filter(|&h| keep(&mesh.regions[mesh.hexes[h as usize].region as usize]))
                .collect::<Vec<u32>>()
        };
        if !self.is_tunnel() {
            return vec![Part {
                id: self.id(),
                kind: self.member.kind,
                hexes: of(&|_| true),
                has_steel: true,
                ..self.part()
            }];
        }
        let lining = of(&|region| region.starts_with(LINING));
        let mut parts = Vec::new();
        if !lining.is_empty() {
            parts.push(Part {
                id: self.id(),
                kind: MemberKind::Lining,
                hexes: lining,
                has_steel: true,
                ..self.part()
            });
        }
        let prefix = format!("{SEGMENTS}/");
        let has_steel = matches!(
            &self.member.body,
            Some(Body::Tunnel { segments: Some(s), .. }) if s.reinforcement.is_some()
        );
        for (name, elements) in
            mesh.element_sets.iter().filter(|(name, _)| name.starts_with(&prefix))
        {
            let hexes = elements
                .iter()
                .filter_map(|e| if let ElementId::Hex(h) = e { Some(*h) } else { None })
                .collect();
            let id = format!("{}/{}", self.member.id, &name[prefix.len()..]);
            parts.push(Part { id, kind: MemberKind::Segment, hexes, has_steel, ..self.part() });
        }
        parts
    }
}

/// Shells along the inner faces of a ring about the z axis, in the middle of the pipe's wall, and
/// the cushion between: an interface whose lower face is the pipe.
fn lay_pipe(mesh: &mut Mesh, pipe: &Pipe) {
    let [wall, cushion] =
        [pipe.thickness_mm, pipe.cushion_mm].map(|millimetres| f64::from(millimetres) / 1000.0);
    let [steel, soft] = [PIPE, PIPE_CUSHION].map(|name| mesh.region(name));
    let inner = mesh.face_sets.get("inner").cloned().unwrap_or_default();
    let mut of_pipe: BTreeMap<u32, u32> = BTreeMap::new();
    for face in inner {
        // A face looks out of its brick, towards the axis: turned round, outward.
        let mut concrete = mesh.face(face);
        concrete.reverse();
        let nodes = concrete.map(|node| {
            *of_pipe.entry(node).or_insert_with(|| {
                let at = mesh.nodes[node as usize];
                let radius = at.truncate().length();
                let share = 1.0 - (cushion + 0.5 * wall) / radius;
                mesh.nodes.push(DVec3::new(share * at.x, share * at.y, at.z));
                (mesh.nodes.len() - 1) as u32
            })
        });
        mesh.shells.push(Shell { nodes, region: steel });
        let [a, b, c, d] = nodes;
        let [e, f, g, h] = concrete;
        mesh.interfaces.push(Interface { nodes: [a, b, c, d, e, f, g, h], region: soft });
    }
}

/// Edge of the cubes of an imported member, of which its box is known.
pub(super) fn cube(meshing: Meshing, size: DVec3, volume: f64) -> f64 {
    edge(meshing, size.min_element(), volume, 1.0)
}

impl Meshing {
    /// As it is or, of a beam or a column of which no edge was asked for, a quarter of the smallest
    /// measure every way: what stays elastic bends exactly on any number of bricks over its depth.
    #[must_use]
    pub fn elastic(self, member: &Assembly) -> Self {
        let Some(Body::Column { section, .. } | Body::Beam { section, .. }) = &member.body else {
            return self;
        };
        Self { element: Some(brick(section, Axes::of(&member.frame).length, self)) }
    }
}

/// Edge of the bricks of a prism, along it.
fn brick(section: &Section, length: f64, meshing: Meshing) -> f64 {
    let (smallest, area) = measures(section);
    edge(meshing, smallest, area, length)
}

/// Edge of elements: what was asked for, or a quarter of the section's smallest measure, coarser
/// where there would be too many.
fn edge(meshing: Meshing, smallest: f64, area: f64, length: f64) -> f64 {
    meshing.element.unwrap_or_else(|| (smallest / 4.0).max((area * length / MANY).cbrt()))
}

/// Smallest measure of a section, m, and its area, m².
fn measures(section: &Section) -> (f64, f64) {
    match *section {
        Section::Rectangle { width_m, depth_m } => {
            (f64::from(width_m.min(depth_m)), f64::from(width_m) * f64::from(depth_m))
        }
        Section::Round { diameter_m } => {
            (f64::from(diameter_m), PI * f64::from(diameter_m).powi(2) / 4.0)
        }
    }
}

/// A prism of which a rectangular section has at least `least` bricks over its depth and its width,
/// unless their edge was asked for.
fn prism(
    section: &Section,
    length: f64,
    marks: &[f64],
    meshing: Meshing,
    least: [f64; 2],
) -> Result<Mesh, MeshError> {
    let h = brick(section, length, meshing);
    let plane = match *section {
        Section::Rectangle { width_m, depth_m } => {
            let [depth, width] = [depth_m, width_m].map(f64::from);
            let side = |measure: f64, least: f64| {
                let h = meshing.element.unwrap_or(h.min(measure / least));
                divide(-0.5 * measure, 0.5 * measure, &[], h)
            };
            Plane::rectangle(&side(depth, least[0]), &side(width, least[1]))?
        }
        Section::Round { diameter_m } => {
            let diameter = f64::from(diameter_m);
            let divisions = ((PI * diameter / 4.0) / h).ceil().max(2.0) as usize;
            Plane::disc(0.5 * diameter, divisions, divisions.div_ceil(2))?
        }
    };
    plane.extrude(&divide(0.0, length, marks, h), "concrete")
}

fn girder(s: &BoxSection, length: f64, marks: &[f64], meshing: Meshing) -> Result<Mesh, MeshError> {
    let measure = f64::from;
    let thinnest = measure(s.top_m.min(s.bottom_m).min(s.web_m));
    let h = meshing.element.unwrap_or(thinnest);
    let girder = Girder {
        top_width: measure(s.top_width_m),
        web_top_width: measure(s.bottom_width_m),
        bottom_width: measure(s.bottom_width_m),
        depth: measure(s.depth_m),
        top: measure(s.top_m),
        bottom: measure(s.bottom_m),
        web: measure(s.web_m),
    };
    let mut mesh =
        Plane::girder(&girder, h)?.extrude(&divide(0.0, length, marks, 1.5 * h), "concrete")?;
    // Its own x is across and its y up; a member's x is towards angle 0, which is up.
    mesh.transform(|p| DVec3::new(p.y, -p.x, p.z));
    Ok(mesh)
}
