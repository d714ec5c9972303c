//! What is computed: bodies and what they are made of, steel in them, what holds and loads them,
//! and when.

mod anchor;
mod anderson;
mod crushing;
mod dual;
mod ground;
mod history;
mod law;
mod linear;
mod march;
mod nonlocal;
mod slip;
mod stability;
mod steel;
mod structure;
mod thin;
mod ties;

#[cfg(test)]
mod tests;

pub use anchor::Plate;
pub use dual::{Gauge, Influence};
pub use ground::{Bedding, Ground};
pub use history::History;
pub use law::{Elastic, Matter, Memory, Record};
pub use linear::Linear;
pub(crate) use march::Equations;
pub use march::{Control, Drive, Failure, March, MarchSettings, Step};
pub use nonlocal::Regularisation;
pub(crate) use steel::JACKING;
pub use steel::{Piecework, Rust, Slipping, Steel, SteelKind, Tendon};
pub(crate) use structure::Trial;
pub use structure::{Point, System};
pub use thin::Rotations;

use std::collections::BTreeMap;

use glam::DVec3;

use crate::{
    element::hex8::Kind,
    material::law::Cracks,
    mesh::{ElementId, HexFace, Mesh},
    tensor::Voigt,
};

/// A structure and its life.
#[derive(Debug, Clone)]
pub struct Model {
    /// Where it is.
    pub mesh: Mesh,
    /// Displacements of its bricks.
    pub kind: Kind,
    /// One a region of the mesh.
    pub bodies: Vec<Body>,
    /// Bars and tendons.
    pub steel: Vec<Steel>,
    /// Ground around and under it.
    pub ground: Vec<Ground>,
    /// Temperature without stress, K.
    pub temperature: f64,
    /// Nodes that are held: node, component, at displacement 0. Rotations of shells are nodes too,
    /// see [`Rotations`].
    pub holds: Vec<(u32, u8)>,
    /// What acts on it.
    pub loads: Vec<Load>,
    /// Softening d of every brick, beside what its law knows: σ = (1 − d)·law. Empty: none.
    pub softening: Vec<f64>,
    /// Stress of bricks and rods (their first number) before anything acts, Pa.
    pub initial: BTreeMap<ElementId, Voigt>,
    /// What keeps the width of cracks from depending on the mesh.
    pub regularisation: Regularisation,
}

impl Model {
    /// Lets all its concrete crack so.
    pub fn crack(&mut self, cracks: Cracks) {
        for body in &mut self.bodies {
            if let Matter::Concrete(mix) = &mut body.matter {
                mix.1.cracks = cracks;
            }
        }
    }

    /// Whether all of it is elastic: what it answers is in proportion to what acts.
    #[must_use]
    pub(crate) fn is_elastic(&self) -> bool {
        let is_elastic = |b: &Body| matches!(b.matter, Matter::Elastic(_) | Matter::Shell { .. });
        self.bodies.iter().all(is_elastic) && self.steel.is_empty()
    }

    /// What a crack leaves in its concrete and what gives it its width, in words; none without
    /// concrete.
    #[must_use]
    pub(crate) fn cracking(&self) -> Option<String> {
        let law = |body: &Body| {
            if let Matter::Concrete(mix) = &body.matter { Some(mix.1.cracks) } else { None }
        };
        let leaves = match self.bodies.iter().find_map(law)? {
            Cracks::Diffuse => "one damage for all directions",
            Cracks::Planes => "planes that know directions",
        };
        Some(match self.regularisation {
            Regularisation::Band => format!("{leaves}, in bands of one element"),
            Regularisation::Gradient { length } => {
                format!("{leaves}, by the implicit gradient of {length} m")
            }
        })
    }
}

/// What a region is made of, and since when it is there.
#[derive(Debug, Clone)]
pub struct Body {
    /// What it is made of.
    pub matter: Matter,
    /// When it was poured, s: before, it is not there. Minus infinity: it was always there.
    pub birth: f64,
}

impl Default for Model {
    /// Nothing, at 20 °C.
    fn default() -> Self {
        Self {
            mesh: Mesh::default(),
            kind: Kind::default(),
            bodies: Vec::new(),
            steel: Vec::new(),
            ground: Vec::new(),
            temperature: 293.15,
            holds: Vec::new(),
            loads: Vec::new(),
            softening: Vec::new(),
            initial: BTreeMap::new(),
            regularisation: Regularisation::Band,
        }
    }
}

/// An action and how it grows.
#[derive(Debug, Clone)]
pub struct Load {
    /// For people.
    pub name: String,
    /// What acts at factor 1.
    pub action: Action,
    /// (s, factor), ascending; linear between, constant outside. Empty: 1 always.
    pub history: Vec<(f64, f64)>,
}

/// What acts.
#[derive(Debug, Clone)]
pub enum Action {
    /// Forces at nodes, N.
    Nodes(Vec<(u32, DVec3)>),
    /// Pressures on faces, Pa, positive into the element.
    Faces(Vec<(HexFace, f64)>),
    /// Pressures on shells, Pa, positive along their right-hand normal.
    Shells(Vec<(u32, f64)>),
    /// Weight under this acceleration, m/s².
    Weight(DVec3),
    /// Prescribed displacements: node, component, m.
    Displacement(Vec<(u32, u8, f64)>),
    /// Temperature over that without stress, K, one a node.
    Temperature(Vec<f64>),
}

/// Compressive damage at the peak of the curve is no damage yet; what counts is beyond it.
const HARDENING: f64 = 0.35;
/// Damage (of tension, of compression) that is past the peak of its curve.
#[must_use]
pub fn past_peak([tension, compression]: [f64; 2]) -> f64 {
    tension.max((compression - HARDENING).max(0.0) / (1.0 - HARDENING))
}

/// Name of loads that are temperatures found by conduction, one a moment.
pub const CONDUCTED: &str = "conducted heat";

impl Load {
    /// Its factor at a time.
    #[must_use]
    pub(crate) fn factor(&self, time: f64) -> f64 {
        interpolate(&self.history, time).unwrap_or(1.0)
    }
}

/// Linear between points (ascending in the first number), constant outside; `None` without points.
#[must_use]
pub(crate) fn interpolate(points: &[(f64, f64)], at: f64) -> Option<f64> {
    let i = points.partition_point(|p| p.0 <= at);
    match (i.checked_sub(1).map(|i| points[i]), points.get(i)) {
        (Some((t0, f0)), Some(&(t1, f1))) => Some(f0 + (f1 - f0) * (at - t0) / (t1 - t0)),
        (Some((_, f)), None) | (None, Some(&(_, f))) => Some(f),
        (None, None) => None,
    }
}
