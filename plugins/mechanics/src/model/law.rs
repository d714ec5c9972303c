//! The laws that regions may follow, behind one question: strain and memory in, stress, tangent and
//! new memory out.

use super::{Failure, Regularisation};
use crate::{
    element::interface::Friction,
    material::{
        DAY,
        concrete::Properties,
        law::{Concrete, Cracks, Edges, Setting, State, Step, Ties},
        steel::Bar,
    },
    mesh::{ElementId, Mesh},
    tensor::{self, Tangent, Voigt},
};

/// Hooke's law with thermal expansion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// Young's modulus, Pa.
    pub modulus: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// 1/K.
    pub expansion: f64,
    /// kg/m³.
    pub density: f64,
}

/// What a region is made of.
#[derive(Debug, Clone)]
pub enum Matter {
    /// Hooke's law.
    Elastic(Elastic),
    /// Concrete that may age, creep, crack and crush; the size in its setting is replaced by how
    /// far each brick reaches across its cracks.
    Concrete(Box<(Properties, Setting)>),
    /// A joint, for interfaces.
    Joint(Friction),
    /// A thin sheet, for shells.
    Shell {
        /// Its law.
        elastic: Elastic,
        /// m.
        thickness: f64,
    },
    /// A bar, for rods between nodes of the mesh.
    Bar {
        /// Its law.
        steel: Bar,
        /// m².
        area: f64,
        /// 1/K.
        expansion: f64,
        /// kg/m³.
        density: f64,
    },
}

impl Matter {
    /// Mass per volume, kg/m³.
    #[must_use]
    pub(crate) fn density(&self) -> f64 {
        match self {
            Self::Elastic(law) => law.density,
            Self::Concrete(mix) => mix.0.density,
            Self::Joint(_) => 0.0,
            Self::Shell { elastic, .. } => elastic.density,
            Self::Bar { density, .. } => *density,
        }
    }
}

/// The law of a brick, made for its size.
#[derive(Debug, Clone)]
pub(super) enum Law {
    Elastic(Elastic, Box<Tangent>),
    Concrete(Box<Concrete>),
}

/// What the points of a brick remember.
#[derive(Debug, Clone, PartialEq)]
pub enum Memory {
    /// Nothing.
    None,
    /// Of concrete.
    Concrete(Box<[Record; 8]>),
}

/// What a point of concrete remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Of its law.
    pub state: State,
    /// Equivalent strain of tension that it last had, the non-local one where that drives damage.
    pub strained: f64,
    /// By what share that is beyond what its damage can carry; zero where damage was found rather
    /// than given.
    pub excess: f64,
}

impl Record {
    fn new(state: State) -> Self {
        Self { state, strained: 0.0, excess: 0.0 }
    }
}

impl Memory {
    /// The largest excess of its points.
    pub(super) fn excess(&self) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Concrete(points) => points.iter().map(|p| p.excess).fold(0.0, f64::max),
        }
    }

    /// Whether any point is cracked or crushed.
    pub(super) fn is_damaged(&self) -> bool {
        match self {
            Self::None => false,
            Self::Concrete(points) => {
                points.iter().any(|p| p.state.damage[0] > 0.0 || p.state.damage[1] > CRUSHED)
            }
        }
    }
}

/// Damage of compression from which a brick counts as damaged: before the peak it is the curve of
/// the stress-strain law, which hardens.
const CRUSHED: f64 = 0.3;

/// When, and how warm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    /// Beginning and end of the step, s.
    pub(super) span: [f64; 2],
    /// Temperature at both, K.
    pub(super) temperature: [f64; 2],
    /// Temperature without stress, K.
    pub(super) neutral: f64,
    /// Edges of the brick, m.
    pub(super) edges: Edges,
    /// What bars do to the brick's cracks.
    pub(super) ties: Ties,
    /// How much of what lies along its pressure crushes together with the brick.
    pub(super) together: f64,
    /// Of the excess of the last equilibrium so much becomes damage, whatever the strain
    /// is now; none: damage is found.
    pub(super) growth: Option<f64>,
    /// Non-local strain, which then drives damage of tension.
    pub(super) nonlocal: Option<f64>,
}

/// A point's answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    /// Pa.
    pub(super) stress: Voigt,
    /// ∂stress/∂strain at constant damage, symmetric, Pa.
    pub(super) tangent: Tangent,
    /// What concrete remembers at the end of the step.
    pub(super) state: Option<Record>,
    /// Opening of the widest crack, m, and across which it opens.
    pub(super) crack: f64,
    pub(super) normal: [f64; 3],
    /// Local equivalent strain of tension.
    pub(super) local: f64,
}

/// Age of bodies that have always been there, s.
const MATURE: f64 = 28.0 * DAY;

impl Law {
    /// The laws of all bricks, one a region: law of each brick, and laws. A concrete's is made for,
    /// and refused by, the largest brick of its region; how far each reaches across its cracks is
    /// told when the law is asked.
    pub(super) fn of_bricks(
        mesh: &Mesh,
        bodies: &[super::Body],
        regularisation: Regularisation,
    ) -> Result<(Vec<u32>, Vec<Self>), Failure> {
        let mut largest: Vec<Option<(usize, f64)>> = vec![None; bodies.len()];
        for (e, hex) in mesh.hexes.iter().enumerate() {
            let size = mesh.longest(e as u32);
            let region = &mut largest[hex.region as usize];
            if region.is_none_or(|(_, known)| size > known) {
                *region = Some((e, size));
            }
        }
        let (mut laws, mut number) = (Vec::new(), vec![0; bodies.len()]);
        for (region, body) in bodies.iter().enumerate() {
            let Some((e, size)) = largest[region] else { continue };
            number[region] = laws.len() as u32;
            let name = || mesh.name(ElementId::Hex(e as u32));
            laws.push(match &body.matter {
                Matter::Elastic(law) => {
                    Self::Elastic(*law, Box::new(tensor::stiffness(law.modulus, law.poisson)))
                }
                Matter::Concrete(mix) => {
                    let spread = regularisation
                        .spread(&mix.0, mesh.size(e as u32))
                        .map_err(|between| Failure::Length { element: name(), between })?;
                    let concrete =
                        Concrete::new(mix.0.clone(), Setting { size, spread, ..mix.1.clone() });
                    Self::Concrete(Box::new(
                        concrete.map_err(|source| Failure::Material { element: name(), source })?,
                    ))
                }
                Matter::Joint(_) | Matter::Shell { .. } | Matter::Bar { .. } => {
                    return Err(Failure::Kind { element: name() });
                }
            });
        }
        Ok((mesh.hexes.iter().map(|hex| number[hex.region as usize]).collect(), laws))
    }

    /// Thermal expansion, 1/K.
    pub(super) fn expansion(&self) -> f64 {
        match self {
            Self::Elastic(law, _) => law.expansion,
            Self::Concrete(law) => law.properties().expansion,
        }
    }

    /// What points remember that are born at `time`, or have always been there.
    pub(super) fn born(&self, time: f64, birth: f64) -> Memory {
        match self {
            Self::Elastic(..) => Memory::None,
            Self::Concrete(law) => {
                let (birth, age) =
                    if birth.is_finite() { (birth, time - birth) } else { (time, MATURE) };
                Memory::Concrete(Box::new([Record::new(law.born(birth + age, age)); 8]))
            }
        }
    }

    /// What point `point` answers to a strain.
    pub(super) fn answer(
        &self,
        point: usize,
        strain: &Voigt,
        memory: &Memory,
        moment: &Moment,
    ) -> Answer {
        match (self, memory) {
            (Self::Elastic(law, tangent), _) => {
                let free =
                    tensor::isotropic(law.expansion * (moment.temperature[1] - moment.neutral));
                let stress = tensor::apply(tangent, &tensor::sub(strain, &free));
                Answer {
                    stress,
                    tangent: **tangent,
                    state: None,
                    crack: 0.0,
                    normal: [0.0; 3],
                    local: 0.0,
                }
            }
            (Self::Concrete(law), memory) => {
                let born;
                let Record { state, strained, .. } = match memory {
                    Memory::Concrete(points) => &points[point],
                    Memory::None => {
                        born = Record::new(law.born(moment.span[0], MATURE));
                        &born
                    }
                };
                let step = Step {
                    from: moment.span[0],
                    to: moment.span[1],
                    temperature: moment.temperature,
                    edges: Some(moment.edges),
                    ties: moment.ties,
                    together: moment.together,
                };
                let grown = moment
                    .growth
                    .map(|share| state.kappa[0] + share * (strained - state.kappa[0]).max(0.0));
                let response = match (law.setting().cracks, grown.or(moment.nonlocal)) {
                    (Cracks::Planes, _) => law.respond_cracked(strain, moment.growth, state, &step),
                    (Cracks::Diffuse, Some(driving)) => {
                        law.respond_nonlocal(strain, driving, state, &step)
                    }
                    (Cracks::Diffuse, None) => law.respond(strain, state, &step),
                };
                let (local, crack) = (response.local.0, response.crack_width);
                let strained = moment.nonlocal.unwrap_or(local);
                let excess = (strained / response.bears - 1.0).max(response.crushes).max(0.0);
                let record = Record { state: response.state, strained, excess };
                Answer {
                    stress: response.stress,
                    tangent: response.tangent,
                    state: Some(record),
                    crack,
                    normal: response.crack_normal,
                    local,
                }
            }
        }
    }
}
