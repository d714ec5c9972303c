//! Units that a header or a row below it gives to a column.

use super::table::{Column, GaugeUnit};
use crate::structure::Electrode;

/// A name and the unit behind it in brackets.
pub(super) fn split_unit(name: &str) -> (&str, &str) {
    let name = name.trim();
    let Some(open) = name.find(['[', '(']).filter(|_| name.ends_with([']', ')'])) else {
        return (name, "");
    };
    let (base, unit) = name.split_at(open);
    (base.trim(), unit.trim_matches(['[', ']', '(', ')', ' ']))
}

/// What makes a number in a unit that of the column: a factor, and what is added behind it. `None`:
/// the unit does not fit.
pub(super) fn scale_of(column: Column, unit: &str) -> Option<[f64; 2]> {
    let unit = unit.trim_matches(['[', ']', '(', ')', ' ']);
    if matches!(unit, "" | "-" | "--") {
        return Some([1.0, 0.0]);
    }
    let factors: &[(&str, f64)] = match column {
        Column::Of(super::Kind::HalfCell) => &[("mV", 1.0), ("V", 1000.0)],
        Column::Of(super::Kind::Cover | super::Kind::Carbonation) | Column::Depth => {
            &[("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4), ("inch", 25.4)]
        }
        Column::Of(super::Kind::Velocity) => &[("m/s", 1.0), ("km/s", 1000.0)],
        Column::Of(super::Kind::Rebound) | Column::Along => &[("1", 1.0)],
        Column::Height => {
            &[("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("ft", 0.3048), ("in", 0.0254)]
        }
        Column::Angle => &[("°", 1.0), ("deg", 1.0)],
        Column::OfCement | Column::OfConcrete => &[("%", 1.0)],
        Column::Temperature => match unit {
            "°F" | "F" | "degF" | "deg F" => return Some([5.0 / 9.0, -160.0 / 9.0]),
            _ => &[("°C", 1.0), ("C", 1.0), ("degC", 1.0), ("deg C", 1.0), ("Deg C", 1.0)],
        },
        // What a date, a face or a name is in, changes nothing; that of `value` is read elsewhere.
        _ => return Some([1.0, 0.0]),
    };
    let found = factors.iter().find(|(name, _)| *name == unit).map(|(_, factor)| [*factor, 0.0]);
    let is_electrode = column == Column::Of(super::Kind::HalfCell) && electrode(unit).is_some();
    found.or(is_electrode.then_some([1.0, 0.0]))
}

/// The electrode that a header names beside mV.
pub(super) fn electrode(unit: &str) -> Option<Electrode> {
    match unit.to_ascii_uppercase().as_str() {
        "CSE" | "CU/CUSO4" | "CUSO4" => Some(Electrode::CopperSulphate),
        "SSC" | "SSE" | "AG/AGCL" | "AGCL" => Some(Electrode::SilverChloride),
        "SCE" | "CALOMEL" => Some(Electrode::Calomel),
        _ => None,
    }
}

/// Whether a cell below a header is a unit.
pub(super) fn is_unit(cell: &str) -> bool {
    const OTHERS: [&str; 34] = [
        "mm", "cm", "m", "in", "inch", "ft", "mV", "V", "Volts", "volts", "mA", "m/s", "km/s", "°",
        "deg", "%", "°C", "°F", "C", "F", "degC", "degF", "deg C", "Deg C", "kN", "N", "Hz", "s",
        "h", "TS", "RN", "1", "date", "time",
    ];
    let cell = cell.trim_matches(['[', ']', '(', ')', ' ']);
    // A lone number is a value.
    cell != "1"
        && (OTHERS.contains(&cell) || GaugeUnit::named(cell).is_some() || electrode(cell).is_some())
}
