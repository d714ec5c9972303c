//! What bears, resolved: assemblies with their steel, what holds and loads and attacks them, and
//! what looks at them. Whether a member is parametric or came with a model no longer matters here,
//! and nothing here knows of files.

mod action;
mod body;
mod concrete;
mod date;
mod gauge;
mod georeference;
mod grade;
mod hook;
mod observation;
mod photograph;
mod project;
mod scanner;

use glam::Vec3;

pub use action::*;
pub use body::*;
pub use concrete::*;
pub use date::{Date, DateError};
pub use gauge::*;
pub use georeference::{Georeference, MapOrigin};
pub use grade::{Grade, StrandGrade};
pub(crate) use hook::bent;
pub use observation::*;
pub use photograph::Photographed;
pub use project::Project;
pub use scanner::*;

use crate::{Frame, Member, MemberKind, Object, Part};

/// The class that is assumed where none is named.
pub const ASSUMED_CONCRETE: &str = "C30/37";

/// All that bears in a scene, and what is known of it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Structure {
    /// Whose it is, and why it is looked at.
    pub project: Project,
    /// Where it stands on earth, as far as its model says so.
    pub georeference: Georeference,
    /// What is computed as one, each with its members.
    pub assemblies: Vec<Assembly>,
    /// Concretes that are no class of Eurocode 2.
    pub concretes: Vec<Concrete>,
    /// What holds the members.
    pub supports: Vec<Support>,
    /// How members are joined where touching does not tell.
    pub joints: Vec<MemberJoint>,
    /// What they carry.
    pub loads: Vec<Load>,
    /// Load tests.
    pub tests: Vec<Test>,
    /// Gauges of strain, displacement and stress.
    pub gauges: Vec<Gauge>,
    /// What gauges and meters were read to show on site.
    pub readings: Vec<Reading>,
    /// What gauges read over the years, a series each, in the order of the files.
    pub series: Vec<Series>,
    /// What was measured or seen on members, in the order of the files and of their entries.
    pub observations: Vec<Observation>,
    /// Photographs that are read, in the order of the files.
    pub photographs: Vec<Photographed>,
    /// X-ray scanners.
    pub scanners: Vec<Scanner>,
    /// Air about the members.
    pub climate: Climate,
    /// The grading profile: the name of one that comes with the program, or a path as the scene
    /// writes it; none: the usual one.
    pub profile: Option<String>,
}

/// A body that is computed as one: a column, a beam, a member of a model; or a tunnel with its
/// lining and all of its segments.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    /// Stable id, unique in the scene.
    pub id: String,
    /// What it is; of a tunnel, a lining.
    pub kind: MemberKind,
    /// Ids of the members of the scene that it is made of.
    pub members: Vec<String>,
    /// Its shape by measures; none: the closed surface of its member's objects.
    pub body: Option<Body>,
    /// Its axis, and where angles about it begin.
    pub frame: Frame,
    /// Concrete class, or a name from [`Structure::concretes`].
    pub concrete: String,
    /// Whether it had to be assumed.
    pub concrete_assumed: bool,
    /// What it is of where that is no concrete.
    pub matter: Option<Matter>,
    /// When its parts were poured. One pour at day 0 where there is none.
    pub pours: Vec<Pour>,
    /// What attacks it.
    pub exposure: Option<Exposure>,
    /// Its bars, stirrups and tendons.
    pub steel: Vec<SteelLine>,
    /// Whether these had to be assumed.
    pub steel_assumed: bool,
}

/// A bar, a stirrup or a tendon.
#[derive(Debug, Clone, PartialEq)]
pub struct SteelLine {
    /// Name within the member.
    pub name: String,
    /// [`Part::Bar`], [`Part::Stirrup`] or [`Part::Tendon`].
    pub part: Part,
    /// Diameter of the bar, m; of a tendon its duct.
    pub diameter: f32,
    /// Points of its axis in the world, m, without hooks. Closed ones end where they begin.
    pub line: Vec<Vec3>,
    /// Of a bar or stirrup: what it is made of.
    pub grade: Option<Grade>,
    /// Of a bar: how it holds to the concrete.
    pub bond: Bond,
    /// How its first and its last end hold, where it slips.
    pub ends: [BarEnd; 2],
    /// Towards where hooked ends are bent, as long as there is room, m; zero: no hook is drawn.
    pub inward: Vec3,
    /// How a tendon is stressed.
    pub prestress: Option<Prestress>,
}

impl SteelLine {
    /// One of no known grade, without hooks or prestress and perfectly bonded. Its diameter and its points
    /// are in m.
    #[must_use]
    pub fn new(name: String, part: Part, diameter: f32, line: Vec<Vec3>) -> Self {
        Self {
            name,
            part,
            diameter,
            line,
            grade: None,
            bond: Bond::Perfect,
            ends: [BarEnd::Anchored; 2],
            inward: Vec3::ZERO,
            prestress: None,
        }
    }

    /// Points of its axis as it is bent: with the hooks of its hooked ends (EN 1992-1-1, 8.3 and
    /// 8.4.1).
    #[must_use]
    pub fn bent(&self) -> Vec<Vec3> {
        bent(&self.line, self.ends, self.inward, self.diameter)
    }
}

impl Structure {
    /// The assembly of that id.
    #[must_use]
    pub fn assembly(&self, id: &str) -> Option<&Assembly> {
        self.assemblies.iter().find(|a| a.id == id)
    }

    /// The assembly that a member is part of, or that has this id itself.
    #[must_use]
    pub fn assembly_of(&self, member: &str) -> Option<&Assembly> {
        self.assemblies.iter().find(|a| a.holds(member))
    }

    /// A concrete of the scene's own, by its name.
    #[must_use]
    pub fn concrete(&self, name: &str) -> Option<&Concrete> {
        self.concretes.iter().find(|c| c.name == name)
    }

    /// The days on which something of it was seen or read, each once, in order.
    #[must_use]
    pub fn dates(&self) -> Vec<Date> {
        let seen = self.observations.iter().filter_map(|o| o.date);
        let taken = self.photographs.iter().filter_map(|p| p.date);
        let read = self.series.iter().flat_map(|s| &s.samples).map(|s| s.date);
        let mut dates: Vec<Date> = seen.chain(taken).chain(read).collect();
        dates.sort_unstable();
        dates.dedup();
        dates
    }

    /// The day that counts as now: that of the inspection, else the last on which something of it
    /// was seen or read; none: nobody says.
    #[must_use]
    pub fn today(&self) -> Option<Date> {
        self.project.inspected.or_else(|| self.dates().pop())
    }

    /// Whether anything holds the assembly of that id.
    #[must_use]
    pub fn is_held(&self, id: &str) -> bool {
        self.supports.iter().any(|s| s.member == id)
    }

    /// Whether the axis of the assembly of that id starts, and whether it ends, in a plane of
    /// symmetry.
    #[must_use]
    pub fn mirrored(&self, id: &str) -> [bool; 2] {
        [Place::Start, Place::End].map(|place| {
            let mut own = self.supports.iter().filter(|s| s.member == id && s.place == place);
            own.any(|s| s.hold == Hold::Symmetry)
        })
    }

    /// Whether something says that its members bear as one: how they are joined, or a support that
    /// is only there for members by themselves.
    pub(crate) fn is_joined(&self) -> bool {
        !self.joints.is_empty() || self.supports.iter().any(|s| s.alone)
    }

    /// Adds an assembly for every member of a model: those that are part of none yet, are no steel
    /// and have a surface of concrete.
    pub(crate) fn assemble(&mut self, members: &[Member], objects: &[Object]) {
        let ours: std::collections::HashSet<&str> =
            self.assemblies.iter().flat_map(|a| &a.members).map(String::as_str).collect();
        let mut is_solid = vec![false; members.len()];
        for object in objects.iter().filter(|o| o.part == Part::Concrete) {
            if let Some(solid) = object.member.and_then(|m| is_solid.get_mut(m)) {
                *solid = true;
            }
        }
        let bears = |member: &Member| {
            !matches!(member.kind, MemberKind::Tendon | MemberKind::Bar)
                && !ours.contains(member.id.as_str())
        };
        let solid =
            members.iter().zip(is_solid).filter(|(member, is_solid)| *is_solid && bears(member));
        let assemblies: Vec<Assembly> =
            solid.map(|(member, _)| Assembly::of_surface(member)).collect();
        self.assemblies.extend(assemblies);
    }
}

impl Assembly {
    /// A member of which nothing is known but its surface and what the member itself says.
    fn of_surface(member: &Member) -> Self {
        Self {
            id: member.id.clone(),
            kind: member.kind,
            members: vec![member.id.clone()],
            body: None,
            frame: member.frame,
            concrete: member.concrete.clone(),
            concrete_assumed: member.concrete_assumed,
            matter: None,
            pours: Vec::new(),
            exposure: member.exposure.clone(),
            steel: Vec::new(),
            steel_assumed: false,
        }
    }

    /// Whether a member is part of it, or has its id. Segments are called after their tunnel
    /// (`T/R1/S2`), so that nobody need look through thousands of them.
    #[must_use]
    pub fn holds(&self, member: &str) -> bool {
        let segment =
            || member.strip_prefix(self.id.as_str()).is_some_and(|rest| rest.starts_with('/'));
        member == self.id || self.is_tunnel() && segment()
    }

    /// Whether it is a tunnel: a round one with a lining, segments or both.
    #[must_use]
    pub fn is_tunnel(&self) -> bool {
        matches!(self.body, Some(Body::Tunnel { .. }))
    }

    /// Whether tendons run through one of its members: of a tunnel, through its inner lining alone.
    #[must_use]
    pub fn has_tendons(&self, member: &str) -> bool {
        (!self.is_tunnel() || member == self.id)
            && self.steel.iter().any(|line| line.part == Part::Tendon)
    }
}
