//! What a deck says, in SI and by positions in the mesh.

use glam::DVec3;

use crate::{
    mesh::{ElementId, Mesh},
    tensor::Voigt,
};

/// A model as a file describes it. Plain data: nothing is computed yet.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Deck {
    /// Nodes, elements and sets; region i is section i.
    pub mesh: Mesh,
    /// How each hexahedron is to be computed.
    pub(crate) formulations: Vec<Formulation>,
    /// Materials, each with at least what the file gives.
    pub materials: Vec<Material>,
    /// One a region.
    pub sections: Vec<Section>,
    /// Loads over time.
    pub(crate) amplitudes: Vec<Amplitude>,
    /// Supports that hold from the beginning.
    pub boundary: Vec<Fixed>,
    /// Stress before the first step.
    pub(crate) initial_stress: Vec<InitialStress>,
    /// Temperature of nodes before the first step (nodes not named: 0).
    pub initial_temperature: Vec<(u32, f64)>,
    /// Bars that move with the solids around them.
    pub(crate) embedded: Vec<Embedded>,
    /// In order.
    pub steps: Vec<Step>,
    /// What the user should know: cards that were skipped, elements that are computed otherwise.
    pub notes: Vec<String>,
}

/// How a hexahedron is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Formulation {
    /// Plain trilinear with 2×2×2 points (C3D8): locks in bending.
    Full,
    /// With incompatible modes (C3D8I).
    #[default]
    Incompatible,
}

/// A material. What the file does not say is none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Young's modulus, Pa, and Poisson's ratio.
    pub elastic: Option<(f64, f64)>,
    /// kg/m³.
    pub density: Option<f64>,
    /// Thermal expansion, 1/K.
    pub expansion: Option<f64>,
    /// Temperature without thermal strain.
    pub reference_temperature: f64,
    /// W/(m·K).
    pub conductivity: Option<f64>,
    /// J/(kg·K).
    pub specific_heat: Option<f64>,
    /// Stress (Pa) over plastic strain of a metal; empty: it does not yield.
    pub(crate) yielding: Vec<(f64, f64)>,
    /// Of a concrete that cracks; none: it does not.
    pub(crate) concrete: Option<Concrete>,
}

/// What Abaqus' cards of damaged plasticity say of a concrete.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Concrete {
    /// Where the file says it.
    pub line: u32,
    /// Compressive stress (Pa, positive) over inelastic strain.
    pub hardening: Vec<(f64, f64)>,
    /// Tension past its strength.
    pub stiffening: Option<Stiffening>,
    /// Whether tables of damage say what unloading costs.
    pub damage: bool,
}

/// What a crack still bears, by stresses in Pa.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Stiffening {
    /// Over its strain.
    Strain(Vec<(f64, f64)>),
    /// Over its opening, m.
    Opening(Vec<(f64, f64)>),
    /// From a strength down to nothing.
    Energy {
        /// Pa.
        strength: f64,
        /// G_f, J/m².
        energy: f64,
    },
}

/// What a region is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Index into [`Deck::materials`].
    pub material: u32,
    /// Its measure.
    pub(crate) kind: SectionKind,
}

/// The measure of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SectionKind {
    /// Hexahedra.
    Solid,
    /// Rods.
    Rod {
        /// m².
        area: f64,
    },
    /// Shells.
    Shell {
        /// m.
        thickness: f64,
    },
}

/// A factor over time, linear between points, constant outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Amplitude {
    /// Name in the file.
    pub name: String,
    /// Time (s) and factor, times ascending.
    pub points: Vec<(f64, f64)>,
    /// Whether time counts from the beginning of the analysis, not of the step.
    pub total_time: bool,
}

/// A prescribed displacement (m) or rotation (rad) of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fixed {
    /// Index of the node.
    pub node: u32,
    /// 0–2: x, y, z; 3–5: rotations about them (nodes of shells; elsewhere without meaning).
    pub component: u8,
    /// m or rad.
    pub value: f64,
    /// Index into [`Deck::amplitudes`]; none: as the step ramps.
    pub amplitude: Option<u32>,
}

/// A force (N) or moment (N·m) at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Index of the node.
    pub node: u32,
    /// As for [`Fixed`].
    pub component: u8,
    /// N or N·m.
    pub value: f64,
    /// Index into [`Deck::amplitudes`].
    pub amplitude: Option<u32>,
}

/// A pressure on a face of a hexahedron (positive: into it) or on a shell (positive: along its
/// right-hand normal).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressure {
    /// A hexahedron or a shell.
    pub element: ElementId,
    /// 0–5: P1–P6 of a hexahedron; 0 for shells.
    pub face: u8,
    /// Pa.
    pub value: f64,
    /// Index into [`Deck::amplitudes`].
    pub amplitude: Option<u32>,
}

/// An acceleration that acts on the mass of elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Their elements.
    pub elements: Vec<ElementId>,
    /// m/s².
    pub acceleration: DVec3,
    /// Index into [`Deck::amplitudes`].
    pub amplitude: Option<u32>,
}

/// A prescribed temperature of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Temperature {
    /// Index of the node.
    pub node: u32,
    /// In the file's scale; only differences act.
    pub value: f64,
    /// Index into [`Deck::amplitudes`].
    pub amplitude: Option<u32>,
}

/// Stress that an element has before the first step, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InitialStress {
    /// Name of the element.
    pub element: ElementId,
    /// xx, yy, zz, xy, yz, zx; of a rod: its axial stress first.
    pub stress: Voigt,
}

/// Bars that move with the solids around them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Embedded {
    /// Rods.
    pub rods: Vec<u32>,
    /// Hexahedra that may hold them; empty: all.
    pub hosts: Vec<u32>,
}

/// Elements that are taken out or put in at the beginning of a step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModelChange {
    /// Put in, free of strain, rather than taken out.
    pub add: bool,
    /// Their elements.
    pub elements: Vec<ElementId>,
}

/// A step, with everything that is in force at its end (what earlier steps left in force included).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Step {
    /// Name in the file, or its number.
    pub name: String,
    /// s.
    pub duration: f64,
    /// First, least and largest increment, s; none: as the program sees fit.
    pub increments: [Option<f64>; 3],
    /// Whether loads without amplitude grow linearly over the step, rather than act from its
    /// beginning.
    pub ramp: bool,
    /// Supports.
    pub boundary: Vec<Fixed>,
    /// Forces.
    pub loads: Vec<Load>,
    /// Pressures.
    pub pressures: Vec<Pressure>,
    /// Weight.
    pub bodies: Vec<Body>,
    /// Temperatures.
    pub temperatures: Vec<Temperature>,
    /// Births and removals, of this step only.
    pub(crate) changes: Vec<ModelChange>,
}
