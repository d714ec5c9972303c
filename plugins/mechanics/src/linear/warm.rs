//! What heats: temperatures that are held, fluxes, films and radiation.

use super::{
    model::Heating,
    read::{Reader, plain},
    steps::{Given, State, clear},
};
use crate::read::{
    Fault,
    abaqus::card::{Card, Row},
    quote,
};

/// The component that a temperature is; CalculiX also writes 0.
pub(super) fn is_temperature(word: &str) -> bool {
    matches!(word, "11" | "0")
}

impl Reader {
    /// `*PHYSICAL CONSTANTS`
    pub(super) fn constants(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ABSOLUTE ZERO", "STEFAN BOLTZMANN", "NEWTON GRAVITY"])?;
        let number = |name: &str| {
            let wrong = |w| card.fault(format!("{name}={} is not a number", quote(w)));
            card.get(name).map(|w| w.parse::<f64>().map_err(|_| wrong(w))).transpose()
        };
        if let Some(zero) = number("ABSOLUTE ZERO")? {
            self.deck.absolute_zero = zero;
        }
        // W/(m²·K⁴) by length: watts are of newtons and lengths.
        self.boltzmann = number("STEFAN BOLTZMANN")?.map(|s| s / self.units.length());
        Ok(())
    }

    /// `*CFLUX`, `*DFLUX`, `*FILM` and `*RADIATE`.
    pub(super) fn heating(&mut self, card: &Card<'_>, state: &mut State) -> Result<(), Fault> {
        card.only(&["OP", "AMPLITUDE"])?;
        let name = plain(card);
        let of_card = |h: Heating| match name.as_str() {
            "CFLUX" => h == Heating::Node,
            "DFLUX" => matches!(h, Heating::Volume | Heating::Face),
            "FILM" => h == Heating::Film,
            _ => h == Heating::Radiation,
        };
        clear(card, state.step, &mut state.heating, |key| of_card(key.0))?;
        let amplitude = super::mesh::name_of(card, "AMPLITUDE")?;
        for row in card.rows() {
            let step = state.step;
            let mut put = |key, value| {
                state.heating.insert(key, Given { value, amplitude: amplitude.clone(), step });
            };
            match name.as_str() {
                "CFLUX" => {
                    let [target, direction, value] = row.exactly("node or set, 11, flux")?;
                    if !is_temperature(direction) {
                        return Err(row.fault("the component of a *CFLUX is 11"));
                    }
                    let value = row.number(value)? * self.units.length();
                    for node in self.some_nodes(target, row)? {
                        put((Heating::Node, node, 0), [value, 0.0]);
                    }
                }
                "DFLUX" => {
                    let [target, kind, value] =
                        row.exactly("element or set, S1 to S6 or BF, flux")?;
                    let value = row.number(value)? / self.units.length();
                    if kind.eq_ignore_ascii_case("BF") {
                        for cell in self.some_cells(target, row)? {
                            put((Heating::Volume, cell, 0), [value / self.units.length(), 0.0]);
                        }
                    } else {
                        for (cell, face) in self.faces(target, kind, "S", row)? {
                            put((Heating::Face, cell, face), [value, 0.0]);
                        }
                    }
                }
                _ => {
                    let what = "element or set, side, temperature beyond it, coefficient";
                    let [target, side, beyond, factor] = row.exactly(what)?;
                    side_number(side, if name == "FILM" { "F" } else { "R" }, row)?;
                    let (letter, heating, unit) = if name == "FILM" {
                        ("F", Heating::Film, 1.0 / self.units.length())
                    } else {
                        let missing =
                            || card.fault("*RADIATE needs *PHYSICAL CONSTANTS, STEFAN BOLTZMANN=…");
                        ("R", Heating::Radiation, self.boltzmann.ok_or_else(missing)?)
                    };
                    let value = [row.number(factor)? * unit, row.number(beyond)?];
                    for (cell, face) in self.faces(target, side, letter, row)? {
                        put((heating, cell, face), value);
                    }
                }
            }
        }
        Ok(())
    }

    /// Faces of solids that a side of elements is.
    fn faces(
        &self,
        target: &str,
        side: &str,
        letter: &str,
        row: Row<'_>,
    ) -> Result<Vec<(u32, u8)>, Fault> {
        side_number(side, letter, row)?;
        let elements = self.some_elements(target, row)?;
        let face = |e: u32| Ok((self.raw[e as usize].cell, self.face(e, side, letter, row)?));
        let all = elements.into_iter().map(face).collect::<Result<Vec<_>, Fault>>()?;
        Ok(all.into_iter().filter_map(|(cell, face)| Some((cell?, face))).collect())
    }
}

/// Refuses sides of cavities, of fluids and of user subroutines.
fn side_number(side: &str, letter: &str, row: Row<'_>) -> Result<(), Fault> {
    let side = side.to_ascii_uppercase();
    if side.strip_prefix(letter).is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit())) {
        return Ok(());
    }
    let side = quote(&side);
    Err(row.fault(format!(
        "{side} is not computed: {letter}1 to {letter}6 are, without cavities, fluids and user subroutines"
    )))
}
