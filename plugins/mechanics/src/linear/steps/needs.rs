//! What a step needs before it can be computed: of materials, of elements, of the steps before it.

use super::State;
use crate::{
    linear::{
        law::Elastic,
        model::{Material, Procedure, Pull, Spring},
        read::{Kind, Reader},
        shape::Shape,
    },
    read::Fault,
};

impl Reader {
    /// Materials have what the step needs, and the step follows one that it rests on.
    pub(super) fn suits(
        &self,
        procedure: Procedure,
        state: &State,
        line: u32,
    ) -> Result<(), Fault> {
        let used =
            self.deck.cells.iter().map(|c| c.material).chain(state.materials.values().copied());
        let lacks = |has: fn(&Material) -> bool, what: &str| {
            let mut used = used.clone().map(|m| &self.deck.materials[m as usize]);
            match used.find(|m| !has(m)) {
                Some(m) => Err(Fault::at(line, format!("material {} has no {what}", m.name))),
                None => Ok(()),
            }
        };
        let heats =
            matches!(procedure, Procedure::Heat { .. } | Procedure::Modes { heat: true, .. });
        let is_large = state.large && procedure == Procedure::Static;
        if !heats {
            let has: fn(&Material) -> bool = if is_large {
                |m| m.elastic.is_some() || m.finite.is_some()
            } else {
                |m| m.elastic.is_some()
            };
            lacks(
                has,
                "*ELASTIC, nor with NLGEOM *HYPERELASTIC, *HYPERFOAM or *DEFORMATION PLASTICITY",
            )?;
            let flows = match procedure {
                Procedure::Static => state.large,
                other => matches!(other, Procedure::Modes { .. }),
            };
            let is_known = |m: &Material| {
                (flows && matches!(m.elastic, Some(Elastic::Isotropic(_)))) || m.plastic.is_none()
            };
            let mut used = used.clone().map(|m| &self.deck.materials[m as usize]);
            if let Some(material) = used.find(|m| !is_known(m)) {
                let why = "*PLASTIC is computed of what is isotropic, with NLGEOM";
                return Err(Fault::at(line, format!("material {}: {why}", material.name)));
            }
        }
        if is_large {
            return self.turns();
        }
        let bends = |s: &Spring| !s.law.is_empty() || s.gap.is_some();
        if !heats && self.deck.springs.iter().any(bends) {
            let why = "*SPRING, NONLINEAR and *GAP are computed with NLGEOM alone";
            return Err(Fault::at(line, why));
        }
        let was_large = self.deck.steps.last().is_some_and(|s| s.large);
        if was_large && matches!(procedure, Procedure::Buckling { .. }) {
            return Err(Fault::at(line, "*BUCKLE after large displacements is not computed"));
        }
        if let Procedure::Modes { heat: false, .. } = procedure {
            lacks(|m| m.density.is_some(), "*DENSITY")?;
        }
        if let Procedure::Modes { stressed: true, .. } = procedure {
            let before = self.deck.steps.last();
            if before.is_none_or(|s| s.procedure != Procedure::Static) {
                return Err(Fault::at(
                    line,
                    "PERTURBATION: needed is a *STATIC step before this one",
                ));
            }
            if before.is_some_and(|s| s.pulls.iter().any(|p| matches!(p.1, Pull::Spin { .. }))) {
                return Err(Fault::at(line, "vibrations of what spins are not computed"));
            }
        }
        if !heats {
            return Ok(());
        }
        if let Some(raw) = self.raw.iter().find(|r| matches!(r.kind, Kind::Thin(_))) {
            let why = "heat in beams and shells is not computed";
            return Err(Fault::at(raw.line, format!("element {}: {why}", raw.label)));
        }
        lacks(|m| m.conductivity.is_some(), "*CONDUCTIVITY")?;
        if !matches!(procedure, Procedure::Heat { steady: true, .. }) {
            lacks(|m| m.density.is_some(), "*DENSITY")?;
            lacks(|m| m.specific_heat.is_some(), "*SPECIFIC HEAT")?;
        }
        if self.tied {
            return Err(Fault::at(line, "heat through a *TIE is not computed"));
        }
        Ok(())
    }

    /// Every element is known where displacements are large.
    fn turns(&self) -> Result<(), Fault> {
        let lacks = |kind: Kind| match kind {
            Kind::Solid(Shape::Hex8Mean | Shape::Bar) => Some("C3D8R and T3D2"),
            _ => None,
        };
        match self.raw.iter().find_map(|raw| Some((raw, lacks(raw.kind)?))) {
            None => Ok(()),
            Some((raw, what)) => {
                let why = "are not computed where displacements are large (NLGEOM)";
                Err(Fault::at(raw.line, format!("element {}: {what} {why}", raw.label)))
            }
        }
    }
}
