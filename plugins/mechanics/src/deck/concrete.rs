//! Concrete of decks that cracks: what Abaqus' tables say of it, by the law of members.

use super::{DeckError, unfit};
use crate::{
    material::{
        MPA,
        concrete::{Given, Properties},
        law::{Cracks, Setting},
    },
    model::Matter,
    read::{self, Material, Stiffening},
};

/// The law of cracks in planes for bricks of a mean edge of `size` m; a note says what was taken
/// for it.
///
/// # Errors
/// No concrete is like that.
pub(super) fn concrete(
    material: &Material,
    said: &read::Concrete,
    elastic: (f64, f64),
    size: f64,
    notes: &mut Vec<String>,
) -> Result<Matter, DeckError> {
    let place = format!("line {}: material {}", said.line, material.name);
    let Some((fctm, energy, by)) = said.stiffening.as_ref().map(|s| tension(s, size)) else {
        return unfit(format!("{place}: its tension is missing"));
    };
    let (fcm, inelastic) = said
        .hardening
        .iter()
        .fold((0.0, 0.0), |most: (f64, f64), &p| if p.0 > most.0 { p } else { most });
    let peak = fcm / elastic.0 + inelastic;
    let given = Given {
        fcm: Some(fcm),
        fctm: Some(fctm),
        modulus: Some(elastic.0),
        poisson: Some(elastic.1),
        fracture_energy: Some(energy),
        // A table that is flat from the beginning says nothing of it.
        peak_strain: Some(peak).filter(|peak| *peak > STEEP * fcm / elastic.0),
        density: material.density,
        expansion: Some(material.expansion.unwrap_or(0.0)),
        ..Given::default()
    };
    let complete = given.complete().map_err(|why| DeckError::Unfit(format!("{place}: {why}")))?;
    notes.push(format!("{place}: {}", taken(&complete, &by, said.damage)));
    // Without a density it has no weight, as everything else of a deck.
    let properties = Properties { density: material.density.unwrap_or(0.0), ..complete };
    // A deck's time is no age.
    let setting = Setting { cracks: Cracks::Planes, ..Setting::short_term(size) };
    Ok(Matter::Concrete(Box::new((properties, setting))))
}

/// Strain at the peak over that of the modulus, from which on a curve is round enough.
const STEEP: f64 = 1.05;

/// Strength (Pa), fracture energy (J/m²), and where the energy is from.
fn tension(said: &Stiffening, size: f64) -> (f64, f64, String) {
    let strength = |points: &[(f64, f64)]| points.first().map_or(0.0, |p| p.0);
    match said {
        Stiffening::Strain(points) => {
            let by =
                format!("what the table encloses times the mean edge of its bricks, {size:.4} m");
            (strength(points), size * enclosed(points), by)
        }
        Stiffening::Opening(points) => {
            (strength(points), enclosed(points), "what the table encloses".into())
        }
        Stiffening::Energy { strength, energy } => (*strength, *energy, "as given".into()),
    }
}

/// Area under lines between points.
fn enclosed(points: &[(f64, f64)]) -> f64 {
    points.windows(2).map(|p| 0.5 * (p[0].0 + p[1].0) * (p[1].1 - p[0].1)).sum()
}

/// What the user should know.
fn taken(p: &Properties, energy: &str, damage: bool) -> String {
    let assumed: Vec<_> = p
        .assumed
        .iter()
        .filter(|a| matches!(a.quantity, "crushing energy" | "peak strain"))
        .map(|a| format!("{} {:.4e} by {}", a.quantity, a.value, a.source))
        .collect();
    format!(
        "damaged plasticity is computed as concrete that cracks in planes: E {:.4} GPa, ν {}, f_c {:.4} MPa, f_ct {:.4} MPa, G_f {:.4} N/m ({energy}), its curve of tension and \
         of compression past the peak that of MC2010 ({}); not taken: dilation angle, eccentricity, f_b0/f_c0, K, viscosity{}",
        p.modulus / 1e9,
        p.poisson,
        p.fcm / MPA,
        p.fctm / MPA,
        p.fracture_energy,
        assumed.join("; "),
        if damage { ", tables of damage" } else { "" },
    )
}
