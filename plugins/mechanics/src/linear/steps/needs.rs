//! What a step needs before it can be computed: of materials, of elements, of the steps before it.

use crate::{
    linear::{
        model::{Material, Procedure},
        read::{Kind, Reader},
    },
    read::Fault,
};

impl Reader {
    /// Materials have what the step needs, and the step follows one that it rests on.
    pub(super) fn suits(&self, procedure: Procedure, line: u32) -> Result<(), Fault> {
        let used = self.deck.cells.iter().map(|c| &self.deck.materials[c.material as usize]);
        let lacks = |has: fn(&Material) -> bool, what: &str| match used.clone().find(|m| !has(m)) {
            Some(m) => Err(Fault::at(line, format!("material {} has no {what}", m.name))),
            None => Ok(()),
        };
        let heats = matches!(procedure, Procedure::Heat { .. });
        if !heats {
            lacks(|m| m.elastic.is_some(), "*ELASTIC")?;
        }
        if let Procedure::Modes { .. } = procedure {
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
}
