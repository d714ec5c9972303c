//! What a step computes, and how: its procedure with its numbers.

use super::{Open, State};
use crate::{
    linear::{matter::all_numbers, model::Procedure},
    read::{Fault, abaqus::card::Card},
};

/// Opens a step.
pub(super) fn begin(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    if let Some(open) = &state.open {
        return Err(card.fault(format!("the step of line {} has no *END STEP", open.line)));
    }
    state.step += 1;
    state.open = Some(Open {
        line: card.line,
        duration: 1.0,
        perturbs: card.get("PERTURBATION").is_some(),
        procedure: None,
    });
    if card.word("NLGEOM").is_some_and(|word| word != "NO") {
        return Err(card.fault(
            "*STEP, NLGEOM: large displacements are not computed; take NLGEOM out if small ones will do",
        ));
    }
    card.only(&["NAME", "INC", "AMPLITUDE", "NLGEOM", "PERTURBATION"])
}

/// What a step computes, and how.
pub(super) fn procedure(card: &Card<'_>, name: &str, state: &mut State) -> Result<(), Fault> {
    let Some(open) = &mut state.open else { return Ok(()) };
    if open.procedure.is_some() {
        return Err(card.fault("a step has one procedure: *END STEP is missing"));
    }
    let numbers = all_numbers(card)?;
    let procedure = match name {
        "STATIC" if open.perturbs => {
            return Err(card.fault("*STATIC in a step of PERTURBATION is not computed"));
        }
        "STATIC" => {
            card.only(&["SOLVER", "DIRECT"])?;
            open.duration = duration(card, &numbers)?;
            Procedure::Static
        }
        "FREQUENCY" => {
            card.only(&["SOLVER", "STORAGE", "GLOBAL"])?;
            Procedure::Modes { count: many(card, &numbers)?, stressed: open.perturbs }
        }
        "BUCKLE" if open.perturbs => {
            return Err(card.fault("*BUCKLE in a step of PERTURBATION is not computed"));
        }
        "BUCKLE" => {
            card.only(&["SOLVER"])?;
            Procedure::Buckling { count: many(card, &numbers)? }
        }
        _ => {
            card.only(&["STEADY STATE", "SOLVER", "DIRECT", "DELTMX", "TIME RESET"])?;
            open.duration = duration(card, &numbers)?;
            let first = numbers.first().map_or(open.duration, |f| f.min(open.duration));
            if first.is_nan() || first <= 0.0 {
                return Err(card.fault(format!("a first increment of {first} s")));
            }
            let steady = card.get("STEADY STATE").is_some();
            Procedure::Heat { steady, first, duration: open.duration }
        }
    };
    open.procedure = Some(procedure);
    Ok(())
}

fn duration(card: &Card<'_>, numbers: &[f64]) -> Result<f64, Fault> {
    match numbers.get(1) {
        Some(d) if d.is_nan() || *d <= 0.0 => Err(card.fault(format!("a duration of {d} s"))),
        other => Ok(other.copied().unwrap_or(1.0)),
    }
}

/// How many eigenvalues.
fn many(card: &Card<'_>, numbers: &[f64]) -> Result<usize, Fault> {
    let count = numbers.first().copied().unwrap_or(0.0);
    if (1.0..=10_000.0).contains(&count) && count.fract() == 0.0 {
        return Ok(count as usize);
    }
    Err(card.fault(format!("*{} needs how many eigenvalues, from 1 to 10000", card.name)))
}
