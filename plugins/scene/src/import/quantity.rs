//! Numbers of property sets with their units: what has a dimension arrives in SI units; what has
//! none is read in the one unit that makes it plausible, and doubted.

use std::ops::RangeInclusive;

use serde_json::Value;

/// A number as the file has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Quantity {
    pub(super) raw: f64,
    /// In SI units, where the file says its dimension or its unit.
    pub(super) si: Option<f64>,
}

/// A unit that a number without one may have been written in.
pub(super) type Unit = (&'static str, f64);

impl Quantity {
    /// The number of a value: `35`, `{"value": 35, "si": 0.035}`. `None` of texts.
    pub(super) fn of(value: &Value) -> Option<Self> {
        let plain = |v: &Value| v.as_f64().filter(|n| n.is_finite());
        match value {
            Value::Object(fields) => Some(Self {
                raw: fields.get("value").and_then(plain)?,
                si: fields.get("si").and_then(plain),
            }),
            other => plain(other).map(|raw| Self { raw, si: None }),
        }
    }
}

/// What a number is taken for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Guess {
    /// In this unit alone it is plausible.
    Only(f64, &'static str),
    /// In none, or in several.
    No,
}

/// The only unit in which a number is plausible.
pub(super) fn only_plausible(raw: f64, units: &[Unit], plausible: &RangeInclusive<f64>) -> Guess {
    let mut fit = units.iter().filter(|(_, factor)| plausible.contains(&(raw * factor)));
    match (fit.next(), fit.next()) {
        (Some((name, factor)), None) => Guess::Only(raw * factor, name),
        _ => Guess::No,
    }
}

/// The first number of a text, with a comma or a point: `4,5 cm`, `4,000 psi`, and what follows it.
pub(super) fn number_in(text: &str) -> Option<(f64, &str)> {
    let begin = text.find(|c: char| c.is_ascii_digit())?;
    let rest = text.get(begin..)?;
    let end =
        rest.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == ',')).unwrap_or(rest.len());
    let digits = rest.get(..end)?.trim_end_matches(['.', ',']);
    Some((decimal(digits)?, rest.get(end..)?))
}

/// `4,000` and `12.500.000` have thousands, `4,5` a decimal comma.
pub(super) fn decimal(digits: &str) -> Option<f64> {
    let groups: Vec<&str> = digits.split(',').collect();
    let are_thousands = groups.len() > 1
        && groups.first().is_some_and(|g| (1..=3).contains(&g.len()) && *g != "0")
        && groups.iter().skip(1).all(|g| g.len() == 3 && !g.contains('.'));
    let plain = if are_thousands { digits.replace(',', "") } else { digits.replacen(',', ".", 1) };
    plain.parse().ok()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn numbers_keep_their_units() {
        let typed = Quantity::of(&json!({"value": 6.0, "si": 0.06, "unit": "LENGTHUNIT"}));
        assert_eq!(typed, Some(Quantity { raw: 6.0, si: Some(0.06) }));
        assert_eq!(Quantity::of(&json!(35)), Some(Quantity { raw: 35.0, si: None }));
        assert_eq!(Quantity::of(&json!("35 mm")), None);
    }

    #[test]
    fn a_comma_is_thousands_or_a_point() {
        let of = |text| number_in(text).map(|(number, _)| number);
        assert_eq!(
            ["4,000 psi", "4,5 cm", "d = 3.5", "0,035", "none"].map(of),
            [Some(4000.0), Some(4.5), Some(3.5), Some(0.035), None]
        );
    }

    #[test]
    fn one_unit_fits_or_none() {
        let units = [("mm", 1e-3), ("m", 1.0)];
        let of = |raw| only_plausible(raw, &units, &(0.01..=0.12));
        assert_eq!(of(35.0), Guess::Only(0.035, "mm"));
        assert_eq!(of(0.05), Guess::Only(0.05, "m"));
        assert_eq!(of(500.0), Guess::No);
    }
}
