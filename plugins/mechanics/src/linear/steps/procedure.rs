//! What a step computes, and how: its procedure with its numbers.

use super::{Open, State};
use crate::{
    linear::{
        matter::all_numbers,
        model::{Damping, Procedure},
    },
    read::{
        Fault,
        abaqus::card::{Card, Row},
    },
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
        damping: Damping::None,
        diameters: None,
        coupled: false,
    });
    if let Some(word) = card.word("NLGEOM") {
        state.large = word != "NO";
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
    let has = |parameter: &str| card.get(parameter).is_some();
    let modes =
        |stressed, heat| Ok(Procedure::Modes { count: many(card, &numbers)?, stressed, heat });
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
            modes(open.perturbs, false)?
        }
        "BUCKLE" if open.perturbs => {
            return Err(card.fault("*BUCKLE in a step of PERTURBATION is not computed"));
        }
        "BUCKLE" => {
            card.only(&["SOLVER"])?;
            Procedure::Buckling { count: many(card, &numbers)? }
        }
        "DYNAMIC" => {
            card.only(&["SOLVER", "DIRECT", "ALPHA"])?;
            open.duration = duration(card, &numbers)?;
            dynamic(card, &numbers, open.duration)?
        }
        "MODALDYNAMIC" => {
            card.only(&["SOLVER", "DIRECT", "DELTMX"])?;
            open.duration = duration(card, &numbers)?;
            motion(card, &numbers, open.duration)?
        }
        "STEADYSTATEDYNAMICS" => {
            card.only(&["SOLVER", "HARMONIC"])?;
            open.duration = 0.0;
            vibration(card, &numbers)?
        }
        "COUPLEDTEMPERATURE-DISPLACEMENT" | "UNCOUPLEDTEMPERATURE-DISPLACEMENT" => {
            card.only(&["STEADY STATE", "SOLVER", "DIRECT", "DELTMX"])?;
            if !has("STEADY STATE") || state.large || !state.warm.is_empty() {
                let what = "is computed with STEADY STATE, and without NLGEOM and *TEMPERATURE";
                return Err(card.fault(format!("*{} {what}", card.name)));
            }
            open.duration = duration(card, &numbers)?;
            open.coupled = true;
            Procedure::Heat { steady: true, first: open.duration, duration: open.duration }
        }
        _ => {
            const ALLOWED: [&str; 7] = [
                "STEADY STATE",
                "FREQUENCY",
                "SOLVER",
                "DIRECT",
                "DELTMX",
                "TIME RESET",
                "STORAGE",
            ];
            card.only(&ALLOWED)?;
            if has("FREQUENCY") {
                modes(false, true)?
            } else {
                open.duration = duration(card, &numbers)?;
                let first = numbers.first().map_or(open.duration, |f| f.min(open.duration));
                if first.is_nan() || first <= 0.0 {
                    return Err(card.fault(format!("a first increment of {first} s")));
                }
                let steady = has("STEADY STATE");
                Procedure::Heat { steady, first, duration: open.duration }
            }
        }
    };
    open.procedure = Some(procedure);
    Ok(())
}

/// Motion by the equations themselves.
fn dynamic(card: &Card<'_>, numbers: &[f64], duration: f64) -> Result<Procedure, Fault> {
    let alpha = card.get("ALPHA").map_or(Ok(-0.05), |word| {
        let range = -1.0 / 3.0 - 1e-9..=0.0;
        let found = word.parse::<f64>().ok().filter(|alpha| range.contains(alpha));
        found.ok_or_else(|| card.fault("ALPHA is a number from −1/3 to 0"))
    })?;
    let fixed = card.word("DIRECT").is_some_and(|word| word != "NO");
    match numbers.first().copied().unwrap_or(duration) {
        first if first > 0.0 && duration / first <= 1e6 => {
            Ok(Procedure::Dynamic { increment: first.min(duration), fixed, duration, alpha })
        }
        first => Err(card.fault(format!("increments of {first} s in {duration} s"))),
    }
}

/// Motion in increments that are fixed, or as fine as what acts.
fn motion(card: &Card<'_>, numbers: &[f64], duration: f64) -> Result<Procedure, Fault> {
    if card.word("DIRECT").is_some_and(|d| d == "NO") {
        return Ok(Procedure::Motion { increment: None, duration });
    }
    match numbers.first().copied().unwrap_or(duration) {
        first if first > 0.0 && duration / first <= 1e7 => {
            Ok(Procedure::Motion { increment: Some(first.min(duration)), duration })
        }
        first => Err(card.fault(format!("increments of {first} s in {duration} s"))),
    }
}

/// `*MODAL DAMPING`
pub(super) fn damping(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    card.only(&["RAYLEIGH"])?;
    let Some(open) = &mut state.open else { return Ok(()) };
    let positive = |word: &str, row: Row<'_>| match row.number(word)? {
        value if value >= 0.0 => Ok(value),
        other => Err(row.fault(format!("damping must not be below 0, not {other}"))),
    };
    if card.get("RAYLEIGH").is_some() {
        let row = card.one_row()?.ok_or_else(|| card.fault("needed are: , , α, β"))?;
        let [_, _, mass, stiffness] = row.exactly(", , α, β")?;
        let (mass, stiffness) = (positive(mass, row)?, positive(stiffness, row)?);
        open.damping = Damping::Rayleigh { mass, stiffness };
        return Ok(());
    }
    let mut shares = Vec::new();
    for row in card.rows() {
        let [first, last, share] = row.exactly("first and last mode, part of critical")?;
        let number = |w: &str| w.parse::<usize>().ok().filter(|n| (1..=10_000).contains(n));
        let (Some(first), Some(last)) = (number(first), number(last)) else {
            return Err(row.fault("a mode is a number from 1 to 10000"));
        };
        let share = positive(share, row)?;
        shares.resize(shares.len().max(last), 0.0);
        shares.iter_mut().take(last).skip(first - 1).for_each(|s| *s = share);
    }
    open.damping = Damping::Shares(shares);
    Ok(())
}

/// `*SELECT CYCLIC SYMMETRY MODES`
pub(super) fn diameters(card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
    card.only(&["NMIN", "NMAX"])?;
    let number = |name: &str| card.get(name).and_then(|word| word.parse::<u32>().ok());
    let (least, most) = (number("NMIN").unwrap_or(0), number("NMAX"));
    let most = most.filter(|m| (least..=10_000).contains(m));
    let most = most.ok_or_else(|| card.fault("needed are NMIN and NMAX, numbers that ascend"))?;
    if let Some(open) = &mut state.open {
        open.diameters = Some([least, most]);
    }
    Ok(())
}

/// Frequencies from and to, Hz; how many between two modes; how near to these.
fn vibration(card: &Card<'_>, numbers: &[f64]) -> Result<Procedure, Fault> {
    if card.word("HARMONIC").is_some_and(|h| h != "YES") {
        return Err(card.fault("loads that are not harmonic are not computed"));
    }
    let (&[from, to], rest) = numbers.split_first_chunk().ok_or_else(|| {
        card.fault("needed are: lowest and highest frequency, how many between two modes, bias")
    })?;
    let points = rest.first().copied().unwrap_or(20.0);
    let bias = rest.get(1).copied().unwrap_or(3.0);
    let ascend = from >= 0.0 && to >= from && to.is_finite();
    if !ascend {
        return Err(card.fault(format!("frequencies from {from} to {to}")));
    }
    if !(2.0..=10_000.0).contains(&points) || bias.is_nan() || bias < 1.0 || rest.len() > 2 {
        return Err(
            card.fault("2 to 10000 frequencies between two modes, with a bias of 1 or more")
        );
    }
    Ok(Procedure::Harmonic { range: [from, to], points: points as u32, bias })
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
