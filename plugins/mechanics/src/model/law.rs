//! The laws a region may follow, behind one question: strain and memory in, stress, tangent and new memory out.

use crate::tensor::{self, Tangent, Voigt};

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
pub enum Law {
    /// Hooke's.
    Elastic(Elastic),
}

/// What one point remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Memory {
    /// Nothing.
    #[default]
    None,
}

/// When, and how warm: what a point's answer depends on besides strain and memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Beginning and end of the step, s.
    pub span: [f64; 2],
    /// When the point was born, s.
    pub birth: f64,
    /// Temperature over that without stress at the end of the step, K.
    pub warmth: f64,
}

/// A point's answer.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// Pa.
    pub stress: Voigt,
    /// ∂stress/∂strain, symmetric: consistent where that is, secant otherwise. Pa.
    pub tangent: Tangent,
    /// Its memory at the end of the step.
    pub memory: Memory,
}

impl Law {
    /// Mass per volume, kg/m³.
    #[must_use]
    pub fn density(&self) -> f64 {
        match self {
            Self::Elastic(law) => law.density,
        }
    }

    /// What a point answers to a strain.
    #[must_use]
    pub fn answer(&self, strain: &Voigt, memory: &Memory, moment: &Moment) -> Answer {
        match self {
            Self::Elastic(law) => {
                let tangent = tensor::stiffness(law.modulus, law.poisson);
                let free = tensor::isotropic(law.expansion * moment.warmth);
                Answer { stress: tensor::apply(&tangent, &tensor::sub(strain, &free)), tangent, memory: *memory }
            }
        }
    }
}
