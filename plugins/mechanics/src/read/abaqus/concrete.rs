//! Concrete that cracks, as Abaqus' damaged plasticity says it.

use super::{Card, Fault};
use crate::read::{Concrete, Material, Stiffening, Units, quote};

const LAW: &str = "CONCRETE DAMAGED PLASTICITY";
const HARDENING: &str = "CONCRETE COMPRESSION HARDENING";
const STIFFENING: &str = "CONCRETE TENSION STIFFENING";
const DAMAGE: [&str; 2] = ["CONCRETE COMPRESSION DAMAGE", "CONCRETE TENSION DAMAGE"];

/// Whether a card is one of this law.
pub(super) fn concerns(card: &Card<'_>) -> bool {
    card.is(LAW) || card.is(HARDENING) || card.is(STIFFENING) || is_damage(card)
}

fn is_damage(card: &Card<'_>) -> bool {
    DAMAGE.contains(&card.name.as_str())
}

/// Takes one of its cards into its material.
pub(super) fn read(card: &Card<'_>, material: &mut Material, units: Units) -> Result<(), Fault> {
    if card.is(LAW) {
        flow(card)?;
        let concrete = Concrete { line: card.line, ..Concrete::default() };
        return match material.concrete.replace(concrete) {
            Some(_) => Err(twice(card, &material.name)),
            None => Ok(()),
        };
    }
    let Some(concrete) = &mut material.concrete else {
        return Err(card.fault(format!("*{} must stand below *{LAW} of its material", card.name)));
    };
    let known = if card.is(HARDENING) {
        card.only(&[])?;
        let points = table(card, ["stress", "inelastic strain"], [units.stress(), 1.0])?;
        !std::mem::replace(&mut concrete.hardening, points).is_empty()
    } else if card.is(STIFFENING) {
        concrete.stiffening.replace(stiffening(card, units)?).is_some()
    } else {
        damage(card)?;
        concrete.damage = true;
        false
    };
    if known { Err(twice(card, &material.name)) } else { Ok(()) }
}

fn twice(card: &Card<'_>, material: &str) -> Fault {
    card.fault(format!("material {material} has *{} already", card.name))
}

/// Refuses a concrete whose strengths nobody has given.
pub(super) fn is_whole(material: &Material) -> Result<(), Fault> {
    let Some(concrete) = &material.concrete else { return Ok(()) };
    let missing = if concrete.hardening.is_empty() {
        HARDENING
    } else if concrete.stiffening.is_none() {
        STIFFENING
    } else {
        return Ok(());
    };
    let reason = format!("material {}: *{LAW} needs *{missing} below it", material.name);
    Err(Fault::at(concrete.line, reason))
}

/// How it flows: up to five numbers, of which those that are left out have usual values.
fn flow(card: &Card<'_>) -> Result<(), Fault> {
    card.only(&[])?;
    let row = card.one_row()?.ok_or_else(|| card.fault(format!("*{LAW} has no data")))?;
    let fields = || row.fields().filter(|field| !field.is_empty());
    if fields().count() > 5 {
        return Err(row.fault(
            "at most five numbers: dilation angle, eccentricity, f_b0/f_c0, K, viscosity; none over temperature",
        ));
    }
    fields().try_for_each(|field| row.number(field).map(drop))
}

fn stiffening(card: &Card<'_>, units: Units) -> Result<Stiffening, Fault> {
    card.only(&["TYPE"])?;
    let stiffening = match card.word("TYPE").as_deref() {
        None | Some("STRAIN") => {
            Stiffening::Strain(falling(card, ["stress", "cracking strain"], [units.stress(), 1.0])?)
        }
        Some("DISPLACEMENT") => {
            let scale = [units.stress(), units.length()];
            Stiffening::Opening(falling(card, ["stress", "cracking displacement"], scale)?)
        }
        Some("GFI") => {
            let row =
                card.one_row()?.ok_or_else(|| card.fault(format!("*{STIFFENING} has no data")))?;
            let numbers = row.numbers("strength, fracture energy", 2..=2)?;
            if numbers.iter().any(|&n| n <= 0.0) {
                return Err(row.fault("strength and fracture energy must be above 0"));
            }
            let [strength, energy] =
                [numbers[0], numbers[1] * units.length()].map(|n| n * units.stress());
            Stiffening::Energy { strength, energy }
        }
        Some(other) => {
            return Err(card.fault(format!(
                "*{STIFFENING}: TYPE={}: STRAIN, DISPLACEMENT and GFI are supported",
                quote(other)
            )));
        }
    };
    Ok(stiffening)
}

/// A table that begins at the strength and falls from there.
fn falling(card: &Card<'_>, names: [&str; 2], scale: [f64; 2]) -> Result<Vec<(f64, f64)>, Fault> {
    let points = table(card, names, scale)?;
    if points.len() < 2 || points[0].0 <= 0.0 {
        return Err(card.fault(format!(
            "*{}: at least two lines are needed, from the strength at 0 down to what is left",
            card.name
        )));
    }
    match points.windows(2).find(|pair| pair[1].0 > pair[0].0) {
        Some(rise) => Err(card.fault(format!(
            "*{}: its stress grows up to {} {}; a crack must bear less the wider it is",
            card.name,
            names[1],
            rise[1].1 / scale[1]
        ))),
        None => Ok(points),
    }
}

/// Stress over a strain or an opening that begins at 0 and grows, each times its `scale`.
pub(super) fn table(
    card: &Card<'_>,
    names: [&str; 2],
    scale: [f64; 2],
) -> Result<Vec<(f64, f64)>, Fault> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    let needed = format!("{}, {}, no rate and no temperature", names[0], names[1]);
    for row in card.rows() {
        let numbers = row.numbers(&needed, 2..=2)?;
        if numbers.iter().any(|&n| n < 0.0) {
            return Err(row.fault(format!(
                "{} and {} must not be negative, in compression neither",
                names[0], names[1]
            )));
        }
        let point = (numbers[0] * scale[0], numbers[1] * scale[1]);
        match points.last() {
            None if point.1 != 0.0 => {
                return Err(row.fault(format!("the first line must be of {} 0", names[1])));
            }
            Some(last) if point.1 <= last.1 => {
                return Err(row.fault(format!("{} must grow from line to line", names[1])));
            }
            _ => points.push(point),
        }
    }
    if points.is_empty() {
        return Err(card.fault(format!("*{} has no data; needed are: {needed}", card.name)));
    }
    Ok(points)
}

/// A table of damage is checked, though nobody heeds it.
fn damage(card: &Card<'_>) -> Result<(), Fault> {
    card.only(&["TYPE", "TENSION RECOVERY", "COMPRESSION RECOVERY"])?;
    for row in card.rows() {
        let numbers =
            row.numbers("damage, strain or displacement, no rate and no temperature", 2..=2)?;
        if !(0.0..1.0).contains(&numbers[0]) {
            return Err(row.fault(format!("a damage of {}; it is from 0 to below 1", numbers[0])));
        }
    }
    Ok(())
}
