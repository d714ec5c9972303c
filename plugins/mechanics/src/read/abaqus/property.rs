//! Materials, sections, amplitudes.

use super::{Card, Fault, Reader, concrete};
use crate::{
    mesh::ElementId,
    read::{Amplitude, Material, Section, SectionKind, quote},
};

/// What a material is said to be, beside concrete that cracks.
const PROPERTIES: [&str; 6] =
    ["ELASTIC", "DENSITY", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT", "PLASTIC"];

impl Reader {
    /// Materials and amplitudes. A property belongs to the material before it.
    pub(super) fn materials(&mut self, cards: &[Card<'_>]) -> Result<(), Fault> {
        let mut open = false;
        for card in cards {
            match card.name.as_str() {
                "MATERIAL" => {
                    card.only(&["NAME"])?;
                    card.no_rows()?;
                    let name = card.need("NAME")?;
                    if self
                        .materials
                        .insert(name.clone(), self.deck.materials.len() as u32)
                        .is_some()
                    {
                        return Err(card.fault(format!("material {name} is defined a second time")));
                    }
                    self.deck.materials.push(Material { name, ..Material::default() });
                    open = true;
                }
                name if PROPERTIES.contains(&name) || concrete::concerns(card) => {
                    let material = self.deck.materials.last_mut().filter(|_| open);
                    let material = material.ok_or_else(|| {
                        card.fault(format!("*{} must stand under a *MATERIAL", card.name))
                    })?;
                    match name {
                        "PLASTIC" => yielding(card, material, self.units)?,
                        _ if concrete::concerns(card) => {
                            concrete::read(card, material, self.units)?
                        }
                        _ => property(card, material, self.units)?,
                    }
                }
                "AMPLITUDE" => {
                    self.amplitude(card)?;
                    open = false;
                }
                _ => open = false,
            }
        }
        self.deck.materials.iter().try_for_each(concrete::is_whole)
    }

    fn amplitude(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "TIME", "VALUE", "DEFINITION"])?;
        let name = card.need("NAME")?;
        let total_time = match card.word("TIME").as_deref() {
            None | Some("STEP TIME") => false,
            Some("TOTAL TIME") => true,
            Some(other) => {
                return Err(card.fault(format!(
                    "TIME={}: STEP TIME and TOTAL TIME are supported",
                    quote(other)
                )));
            }
        };
        if card.word("VALUE").is_some_and(|v| v != "RELATIVE")
            || card.word("DEFINITION").is_some_and(|d| d != "TABULAR")
        {
            return Err(
                card.fault("*AMPLITUDE: only VALUE=RELATIVE and DEFINITION=TABULAR are supported")
            );
        }
        let mut points: Vec<(f64, f64)> = Vec::new();
        for row in card.rows() {
            for pair in row.numbers("time, factor, time, factor, …", 2..=8)?.chunks(2) {
                let [time, factor] = *pair else {
                    return Err(row.fault("a time without its factor"));
                };
                if points.last().is_some_and(|last| last.0 >= time) {
                    return Err(row.fault(format!(
                        "times of an amplitude must ascend, but {time} follows {}",
                        points.last().map_or(0.0, |p| p.0)
                    )));
                }
                points.push((time, factor));
            }
        }
        if points.is_empty() {
            return Err(card.fault(format!("amplitude {name} is empty")));
        }
        if self.amplitudes.insert(name.clone(), self.deck.amplitudes.len() as u32).is_some() {
            return Err(card.fault(format!("amplitude {name} is defined a second time")));
        }
        self.deck.amplitudes.push(Amplitude { name, points, total_time });
        Ok(())
    }

    /// Sections: every element gets its region, and no element two.
    pub(super) fn sections(&mut self, cards: &[Card<'_>]) -> Result<(), Fault> {
        for card in cards.iter().filter(|c| c.is("SOLID SECTION") || c.is("SHELL SECTION")) {
            card.only(&["ELSET", "MATERIAL"])?;
            let (set, material) = (card.need("ELSET")?, card.need("MATERIAL")?);
            let &material = self.materials.get(&material).ok_or_else(|| {
                card.fault(format!("material {} is not defined", quote(&material)))
            })?;
            let elements = self.target_elements(&set, card.line)?;
            let kind = self.section_kind(card, &set, &elements)?;
            let region = self.deck.sections.len() as u32;
            for &element in &elements {
                let mesh = &mut self.deck.mesh;
                let slot = match element {
                    ElementId::Hex(i) => &mut mesh.hexes[i as usize].region,
                    ElementId::Shell(i) => &mut mesh.shells[i as usize].region,
                    ElementId::Rod(i) => &mut mesh.rods[i as usize].region,
                    ElementId::Interface(_) => continue,
                };
                if std::mem::replace(slot, region) != u32::MAX {
                    let name = self.deck.mesh.name(element);
                    return Err(card.fault(format!(
                        "{name} has a section already; every element belongs to one"
                    )));
                }
            }
            // Two sections of one set cannot be: its elements would have two.
            self.deck.mesh.regions.push(set);
            self.deck.sections.push(Section { material, kind });
        }
        self.all_have_sections()
    }

    fn section_kind(
        &self,
        card: &Card<'_>,
        set: &str,
        elements: &[ElementId],
    ) -> Result<SectionKind, Fault> {
        let all = |test: fn(&ElementId) -> bool| elements.iter().all(test);
        let row = card.one_row()?;
        let measure = |what: &str, most: usize| -> Result<f64, Fault> {
            let row = row.ok_or_else(|| {
                card.fault(format!("*{} of {set}: the line with {what} is missing", card.name))
            })?;
            match row.numbers(what, 1..=most)?.first() {
                Some(&value) if value > 0.0 => Ok(value),
                _ => Err(row.fault(format!("{what} must be above 0"))),
            }
        };
        if card.is("SHELL SECTION") {
            if !all(|e| matches!(e, ElementId::Shell(_))) {
                return Err(
                    card.fault(format!("*SHELL SECTION: {set} has elements that are no shells"))
                );
            }
            return Ok(SectionKind::Shell {
                thickness: measure("the thickness", 2)? * self.units.length(),
            });
        }
        if all(|e| matches!(e, ElementId::Hex(_))) {
            // A thickness that some programs write means nothing for solids.
            if let Some(row) = row {
                row.numbers("nothing, for solids", 1..=3)?;
            }
            Ok(SectionKind::Solid)
        } else if all(|e| matches!(e, ElementId::Rod(_))) {
            Ok(SectionKind::Rod {
                area: measure("the cross-section's area", 1)? * self.units.area(),
            })
        } else {
            Err(card.fault(format!("*SOLID SECTION: {set} must have hexahedra only, or rods only")))
        }
    }

    fn all_have_sections(&self) -> Result<(), Fault> {
        let mesh = &self.deck.mesh;
        let hexes =
            mesh.hexes.iter().map(|c| c.region).zip(0..).map(|(r, i)| (r, ElementId::Hex(i)));
        let shells =
            mesh.shells.iter().map(|c| c.region).zip(0..).map(|(r, i)| (r, ElementId::Shell(i)));
        let rods = mesh.rods.iter().map(|c| c.region).zip(0..).map(|(r, i)| (r, ElementId::Rod(i)));
        match hexes.chain(shells).chain(rods).find(|(region, _)| *region == u32::MAX) {
            Some((_, element)) => {
                let line = self.lines.of(crate::mesh::Subject::Element(element));
                let card = if matches!(element, ElementId::Shell(_)) {
                    "*SHELL SECTION"
                } else {
                    "*SOLID SECTION"
                };
                Err(Fault {
                    line,
                    reason: format!(
                        "{} has no section; name it in the set of a {card}",
                        mesh.name(element)
                    ),
                })
            }
            None => Ok(()),
        }
    }
}

/// Of a metal: stress over plastic strain, from where it yields.
fn yielding(
    card: &Card<'_>,
    material: &mut Material,
    units: crate::read::Units,
) -> Result<(), Fault> {
    card.only(&["HARDENING"])?;
    if card.word("HARDENING").is_some_and(|word| word != "ISOTROPIC") {
        return Err(card.fault("*PLASTIC beside concrete: only HARDENING=ISOTROPIC is supported"));
    }
    let points = concrete::table(card, ["stress", "plastic strain"], [units.stress(), 1.0])?;
    if let Some(fall) = points.windows(2).find(|pair| pair[1].0 < pair[0].0) {
        return Err(card.fault(format!(
            "*PLASTIC: its stress falls at a plastic strain of {}; bars may harden, not soften",
            fall[1].1
        )));
    }
    if std::mem::replace(&mut material.yielding, points).is_empty() {
        Ok(())
    } else {
        Err(card.fault(format!("material {} has *PLASTIC already", material.name)))
    }
}

fn property(
    card: &Card<'_>,
    material: &mut Material,
    units: crate::read::Units,
) -> Result<(), Fault> {
    card.only(if card.is("EXPANSION") { &["TYPE", "ZERO"] } else { &["TYPE"] })?;
    if card.word("TYPE").is_some_and(|t| !matches!(t.as_str(), "ISO" | "ISOTROPIC")) {
        return Err(card.fault(format!("*{}: only TYPE=ISO is supported", card.name)));
    }
    let row = card.one_row()?.ok_or_else(|| card.fault(format!("*{} has no data", card.name)))?;
    let elastic = card.is("ELASTIC");
    // One more number: the temperature it holds at; alone, it says nothing.
    let numbers = if elastic {
        row.numbers("Young's modulus, Poisson's ratio", 2..=3)?
    } else {
        row.numbers("one value", 1..=2)?
    };
    let value = numbers[0];
    let positive = |what: &str| {
        if value > 0.0 {
            Ok(())
        } else {
            Err(row.fault(format!("{what} must be above 0, not {value}")))
        }
    };
    let twice = match card.name.as_str() {
        "ELASTIC" => {
            positive("Young's modulus")?;
            if !(numbers[1] > -1.0 && numbers[1] < 0.5) {
                return Err(row.fault(format!(
                    "Poisson's ratio must be above −1 and below 0.5, not {}",
                    numbers[1]
                )));
            }
            material.elastic.replace((value * units.stress(), numbers[1])).is_some()
        }
        "DENSITY" => {
            positive("density")?;
            material.density.replace(value * units.density()).is_some()
        }
        "EXPANSION" => {
            if let Some(zero) = card.get("ZERO") {
                material.reference_temperature = row.number(zero)?;
            }
            material.expansion.replace(value).is_some()
        }
        "CONDUCTIVITY" => {
            // N/(s·K) in both systems.
            positive("conductivity")?;
            material.conductivity.replace(value).is_some()
        }
        _ => {
            positive("specific heat")?;
            material.specific_heat.replace(value * units.specific_heat()).is_some()
        }
    };
    if twice {
        Err(card.fault(format!("material {} has *{} already", material.name, card.name)))
    } else {
        Ok(())
    }
}
