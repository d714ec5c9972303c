//! Meshes of hexahedra, with shells, rods and interfaces between them.
//!
//! - [`Mesh`]: nodes, elements, named sets; [`Mesh::check`] refuses what cannot be computed.
//! - [`section`] (rectangle, box girder, disc, extruded), [`block`], [`mapped`], [`Polar`] (rings
//!   and linings in r-θ-z): structured meshes.
//! - [`Mesh::separate`]: a body is cut open and interfaces put between.
//! - [`voxel`]: any closed surface to cubes, with the error that this makes.
//! - [`Locator`]: which hexahedron holds a point, and where in it.
//!
//! Metres. Local faces are Abaqus' S1 to S6, counted from 0 ([`hex::FACES`]).

mod check;
mod generate;
pub mod hex;
mod join;
mod locate;
mod polar;
pub(crate) mod section;
mod topology;
pub mod voxel;

use std::{collections::BTreeMap, fmt};

use glam::DVec3;

pub(crate) use generate::mapped;
pub use generate::{block, divide};
pub use locate::{Host, Locator};
pub(crate) use polar::{Layer, Polar, Rings};
pub(crate) use topology::FaceTable;

/// An element of `N` nodes that belongs to a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Cell<const N: usize> {
    /// Indices into [`Mesh::nodes`].
    pub nodes: [u32; N],
    /// Index into [`Mesh::regions`].
    pub region: u32,
}

/// Hexahedron of eight nodes: bottom face counterclockwise seen from the top, then the top face.
pub(crate) type Hex = Cell<8>;
/// Quadrilateral shell.
pub(crate) type Shell = Cell<4>;
/// Bar of two nodes, which are nodes of the mesh.
pub(crate) type Rod = Cell<2>;
/// Quadrilateral of no thickness (or of a small gap): nodes 0–3 are one face, node m+4 lies
/// opposite node m. The right-hand normal of 0–3 points to 4–7.
pub(crate) type Interface = Cell<8>;

/// Local face 0–5 of a hexahedron, see [`hex::FACES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct HexFace {
    /// Index into [`Mesh::hexes`].
    pub hex: u32,
    /// 0–5: Abaqus' S1–S6.
    pub face: u8,
}

/// An element of any kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ElementId {
    /// Index into [`Mesh::hexes`].
    Hex(u32),
    /// Index into [`Mesh::shells`].
    Shell(u32),
    /// Index into [`Mesh::rods`].
    Rod(u32),
    /// Index into [`Mesh::interfaces`].
    Interface(u32),
}

/// Numbers by which the user's file calls things. An empty list: counted from 1.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Labels {
    /// One a node.
    pub nodes: Vec<u32>,
    /// One a hexahedron.
    pub hexes: Vec<u32>,
    /// One a shell.
    pub shells: Vec<u32>,
    /// One a rod.
    pub rods: Vec<u32>,
}

/// What a body is computed on. Whoever fills it by hand calls [`Mesh::check`]; everything else here
/// makes meshes that pass it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Positions, m.
    pub nodes: Vec<DVec3>,
    /// Solids.
    pub hexes: Vec<Hex>,
    /// Thin steel.
    pub shells: Vec<Shell>,
    /// Bars.
    pub rods: Vec<Rod>,
    /// Joints.
    pub interfaces: Vec<Interface>,
    /// Names of the regions; one material each.
    pub regions: Vec<String>,
    /// Named nodes, sorted, each once.
    pub node_sets: BTreeMap<String, Vec<u32>>,
    /// Named elements.
    pub element_sets: BTreeMap<String, Vec<ElementId>>,
    /// Named faces of hexahedra.
    pub face_sets: BTreeMap<String, Vec<HexFace>>,
    /// What the user's file calls its nodes and elements.
    pub labels: Labels,
}

/// What a [`MeshError`] is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// One node.
    Node(u32),
    /// One element.
    Element(ElementId),
    /// All of it, or what was asked for.
    Whole,
}

/// Why a mesh cannot be used or made. One line, naming the element by its label.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct MeshError {
    /// Element or node that it is about.
    pub subject: Subject,
    /// What is wrong and what would help.
    pub reason: String,
}

impl MeshError {
    pub(crate) fn new(subject: Subject, reason: impl Into<String>) -> Self {
        Self { subject, reason: reason.into() }
    }

    pub(crate) fn whole(reason: impl Into<String>) -> Self {
        Self::new(Subject::Whole, reason)
    }
}

impl fmt::Display for HexFace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "face S{} of hex {}", self.face + 1, self.hex + 1)
    }
}

impl Mesh {
    /// Corners of a hexahedron, m.
    #[must_use]
    pub fn corners(&self, hex: u32) -> [DVec3; 8] {
        self.hexes[hex as usize].nodes.map(|n| self.nodes[n as usize])
    }

    /// Volume of a hexahedron, m³ (exact for trilinear faces).
    #[must_use]
    pub fn hex_volume(&self, hex: u32) -> f64 {
        hex::volume(&self.corners(hex))
    }

    /// Three edges of the parallelepiped nearest to a hexahedron: the columns of twice its Jacobian
    /// at the middle, each the mean of four edges, m.
    #[must_use]
    pub(crate) fn edges(&self, hex: u32) -> [DVec3; 3] {
        let jacobian = hex::jacobian(&self.corners(hex), DVec3::ZERO);
        [jacobian.x_axis, jacobian.y_axis, jacobian.z_axis].map(|e| 2.0 * e)
    }

    /// The longest of them, m.
    #[must_use]
    pub fn longest(&self, hex: u32) -> f64 {
        self.edges(hex).iter().map(|e| e.length()).fold(0.0, f64::max)
    }

    /// Size of a hexahedron whatever the direction: V^(1/3), m.
    #[must_use]
    pub(crate) fn size(&self, hex: u32) -> f64 {
        self.hex_volume(hex).cbrt()
    }

    /// Mean of the corners of a hexahedron, m.
    #[must_use]
    pub fn centre(&self, hex: u32) -> DVec3 {
        self.corners(hex).iter().sum::<DVec3>() / 8.0
    }

    /// Volume of all hexahedra, m³.
    #[must_use]
    pub(crate) fn volume(&self) -> f64 {
        (0..self.hexes.len() as u32).map(|h| self.hex_volume(h)).sum()
    }

    /// Nodes of a face, counterclockwise seen from outside.
    #[must_use]
    pub(crate) fn face(&self, face: HexFace) -> [u32; 4] {
        let nodes = &self.hexes[face.hex as usize].nodes;
        hex::FACES[usize::from(face.face)].map(|c| nodes[c])
    }

    /// Middle of a face and its outward normal, whose length is the area, m and m².
    #[must_use]
    pub(crate) fn face_middle(&self, face: HexFace) -> (DVec3, DVec3) {
        let [a, b, c, d] = self.face(face).map(|n| self.nodes[n as usize]);
        ((a + b + c + d) / 4.0, 0.5 * (c - a).cross(d - b))
    }

    /// Corners of the box around all nodes, m; `None` without nodes.
    #[must_use]
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let first = *self.nodes.first()?;
        Some(self.nodes.iter().fold([first; 2], |[low, high], &p| [low.min(p), high.max(p)]))
    }

    /// The region of that name, made if there is none.
    pub(crate) fn region(&mut self, name: &str) -> u32 {
        let found = self.regions.iter().position(|r| r == name);
        found.unwrap_or_else(|| {
            self.regions.push(name.to_owned());
            self.regions.len() - 1
        }) as u32
    }

    /// Moves the hexahedra whose centre fulfils `within` to the region `name`: pours, softened
    /// zones.
    pub fn assign(&mut self, name: &str, within: impl Fn(DVec3) -> bool) {
        let region = self.region(name);
        for h in 0..self.hexes.len() {
            if within(self.centre(h as u32)) {
                self.hexes[h].region = region;
            }
        }
    }

    /// Moves every node.
    pub fn transform(&mut self, place: impl Fn(DVec3) -> DVec3) {
        self.nodes.iter_mut().for_each(|p| *p = place(*p));
    }

    /// What the user calls an element: `hex 17`, with the label of their file where there is one.
    #[must_use]
    pub(crate) fn name(&self, element: ElementId) -> String {
        let label = |labels: &[u32], i: u32| labels.get(i as usize).copied().unwrap_or(i + 1);
        match element {
            ElementId::Hex(i) => format!("hex {}", label(&self.labels.hexes, i)),
            ElementId::Shell(i) => format!("shell {}", label(&self.labels.shells, i)),
            ElementId::Rod(i) => format!("rod {}", label(&self.labels.rods, i)),
            ElementId::Interface(i) => format!("interface {}", i + 1),
        }
    }

    /// What the user calls a node.
    #[must_use]
    pub(crate) fn node_name(&self, node: u32) -> String {
        format!("node {}", self.labels.nodes.get(node as usize).copied().unwrap_or(node + 1))
    }
}
