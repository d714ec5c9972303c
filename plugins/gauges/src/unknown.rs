//! What besides damage nobody knows exactly when readings are inverted: the modulus of the
//! concrete, the loads of the tests, how far supports give.

use glam::DVec3;
use intrados_mechanics::model::{Bedding, Linear, Matter};
use intrados_scene::{Scene, structure::Concrete};
use intrados_stage::random::Key;
use serde::Serialize;

use crate::{grip::given, rig::Rig};

/// How far off each may be: standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Priors {
    /// Of the logarithm of the modulus, where nobody measured it.
    pub modulus: f64,
    /// Of the logarithm of the load of a test.
    pub load: f64,
    /// Of the logarithm of the stiffness of springs.
    pub springs: f64,
    /// Of what supports that hold nodes give: the energy in them over that in the member, under all
    /// tests.
    pub give: f64,
}

impl Default for Priors {
    fn default() -> Self {
        Self { modulus: 0.15, load: 0.03, springs: 0.4, give: 0.05 }
    }
}

impl Priors {
    /// All is as the scene says.
    pub const KNOWN: Self = Self { modulus: 0.0, load: 0.0, springs: 0.0, give: 0.0 };

    /// With the modulus of a member's concrete as it was measured, where it was.
    #[must_use]
    pub fn measured(self, scene: &Scene, member: &str) -> Self {
        let measured = |c: &Concrete| Some(f64::from(c.ecm_error_gpa?) / f64::from(c.ecm_gpa?));
        let structure = &scene.structure;
        let error = structure
            .assembly(member)
            .and_then(|a| structure.concrete(&a.concrete))
            .and_then(measured);
        Self { modulus: error.filter(|_| self.modulus > 0.0).unwrap_or(self.modulus), ..self }
    }
}

/// One of them. In standard deviations of its prior it is called z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Unknown {
    /// E, as a factor exp(σ z).
    Modulus,
    /// The load of a test, as a factor exp(σ z).
    Load(usize),
    /// Springs of this stiffness (Pa/m), as a factor exp(σ z).
    Springs(DVec3),
    /// What supports that hold nodes give, σ z.
    Give,
}

/// What is not known of a rig, and how far off it may be.
#[must_use]
pub fn unknowns(rig: &Rig, priors: &Priors) -> Vec<(Unknown, f64)> {
    let loads = (0..rig.tests.len()).map(|t| (Unknown::Load(t), priors.load));
    let springs = springs(rig).into_iter().map(|k| (Unknown::Springs(k), priors.springs));
    let give = (!rig.giving.is_empty()).then_some((Unknown::Give, priors.give));
    let all =
        std::iter::once((Unknown::Modulus, priors.modulus)).chain(loads).chain(springs).chain(give);
    all.filter(|u| u.1 > 0.0).collect()
}

/// The kinds of springs under a member, by their stiffness.
fn springs(rig: &Rig) -> Vec<DVec3> {
    let mut kinds = Vec::new();
    for ground in &rig.model.ground {
        if let Bedding::Springs { stiffness, .. } = ground.bedding
            && !kinds.contains(&stiffness)
        {
            kinds.push(stiffness);
        }
    }
    kinds
}

/// What is really so in a simulation, drawn by the priors.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Truth {
    loads: Vec<f64>,
    give: f64,
}

impl Truth {
    /// Draws, and puts modulus and springs into the rig. A support that holds nodes never gives
    /// less than nothing.
    pub(crate) fn draw(rig: &mut Rig, priors: &Priors, modulus: f64, seed: u64) -> Self {
        let dice = |what: u64| Key::new(seed, 0x0ff0 + what).normal(0);
        let modulus = modulus * (priors.modulus * dice(0)).exp();
        for body in &mut rig.model.bodies {
            if let Matter::Elastic(law) = &mut body.matter {
                law.modulus *= modulus;
            }
        }
        let kinds = springs(rig);
        for ground in &mut rig.model.ground {
            if let Bedding::Springs { stiffness, .. } = &mut ground.bedding
                && let Some(kind) = kinds.iter().position(|k| k == stiffness)
            {
                *stiffness *= (priors.springs * dice(2 + kind as u64)).exp();
            }
        }
        let loads =
            (0..rig.tests.len()).map(|t| (priors.load * dice(100 + t as u64)).exp()).collect();
        Self { loads, give: priors.give * dice(1).abs() }
    }

    /// Readings as loads and supports make them, of those that the softened rig gives where all is
    /// as the scene says.
    ///
    /// # Errors
    /// [`Failure`](intrados_mechanics::model::Failure).
    pub(crate) fn change(
        &self,
        rig: &Rig,
        linear: &mut Linear,
        readings: &mut [f64],
    ) -> Result<(), intrados_mechanics::model::Failure> {
        if self.give > 0.0 {
            readings
                .iter_mut()
                .zip(given(rig, linear)?)
                .for_each(|(reading, given)| *reading += self.give * given);
        }
        let gauges = rig.gauges.len().max(1);
        readings.iter_mut().enumerate().for_each(|(i, r)| *r *= self.loads[i / gauges]);
        Ok(())
    }
}
