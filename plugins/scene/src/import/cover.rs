//! Cover and exposure as property sets say them.

use serde_json::Value;

use super::{
    quantity::{Guess, Quantity, Unit, number_in, only_plausible},
    source::Element,
};
use crate::structure::Exposure;

/// A value with the doubt that it was read with.
pub(super) type Doubted<T> = (Option<T>, Option<String>);

/// Covers that are plausible where no unit is said, m.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 0.01..=0.12;
/// Covers that are believed where a unit is said, m.
const BELIEVED: std::ops::RangeInclusive<f64> = 0.005..=0.2;
/// More cover than this is unusual, m.
const UNUSUAL: f64 = 0.1;

const COVERS: [&str; 9] = [
    "concretecover",
    "betondeckung",
    "betonüberdeckung",
    "betonueberdeckung",
    "nominalcover",
    "clearcover",
    "enrobage",
    "recubrimiento",
    "copriferro",
];

fn letters(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| c.is_alphabetic()).collect()
}

/// What follows in names of what is said about a cover and is none.
const ABOUT: [&str; 14] = [
    "deviation",
    "tolerance",
    "toleranz",
    "vorhalte",
    "utili",
    "count",
    "number",
    "class",
    "klasse",
    "fire",
    "ratio",
    "loss",
    "check",
    "spacer",
];

/// The cover that property sets say, mm: the least of several, with a doubt. `metres`: of the file's
/// unit of length.
pub(super) fn cover_mm(element: &Element, metres: f64) -> Doubted<f32> {
    let all = element.properties.iter().flat_map(|(set, v)| v.iter().map(move |p| (set, p)));
    let is_cover = |name: &str| {
        let name = letters(name);
        COVERS.iter().any(|cover| {
            let rest = name.strip_prefix(cover);
            rest.is_some_and(|rest| !ABOUT.iter().any(|about| rest.contains(about)))
        })
    };
    let mut least: Doubted<f32> = (None, None);
    let mut differ: Option<String> = None;
    for (set, (name, value)) in all.filter(|(_, (name, _))| is_cover(name)) {
        let (mm, doubt) = cover_of(&format!("{set}.{name} says"), value, metres);
        match (mm, least.0) {
            (Some(mm), Some(known)) if mm != known => {
                let lower = mm.min(known);
                differ = Some(format!(
                    "{set}.{name} says {mm} mm and another property {known} mm: the least, {lower} mm, is taken all around"
                ));
                if mm < known {
                    least = (Some(mm), doubt);
                }
            }
            (None, Some(_)) | (Some(_), Some(_)) => {}
            (mm, None) => least = (mm, least.1.or(doubt)),
        }
    }
    (least.0, differ.or(least.1))
}

fn cover_of(place: &str, value: &Value, metres: f64) -> Doubted<f32> {
    let (metres, doubt) = match value.as_str() {
        Some(text) => of_text(text, metres),
        None => match Quantity::of(value) {
            Some(quantity) => of_quantity(quantity, metres),
            None => Err(format!("{value}: it is no number, and is not used")),
        },
    }
    .map_or_else(|why| (None, Some(why)), |(metres, doubt)| (Some(metres), doubt));
    let unusual = metres
        .filter(|m| *m > UNUSUAL)
        .map(|m| format!("{:.0} mm, which is unusual: it is used; is its unit right?", 1e3 * m));
    let rounded = metres.map(|m| ((1e4 * m).round() / 10.0) as f32);
    (rounded, doubt.or(unusual).map(|why| format!("{place} {why}")))
}

type Read = Result<(f64, Option<String>), String>;

/// Units that a cover may have been written in: inches only in a file in feet or inches.
fn units(metres: f64) -> Vec<Unit> {
    let mut units = vec![("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    if ["0.3048", "0.0254"].iter().any(|unit| format!("{metres:.4}") == *unit) {
        units.extend([("in", 0.0254), ("ft", 0.3048)]);
    }
    units
}

fn of_quantity(Quantity { raw, si }: Quantity, metres: f64) -> Read {
    if raw == 0.0 {
        return Err("0: it is taken for not said".into());
    }
    if let Some(si) = si
        && BELIEVED.contains(&si)
    {
        return Ok((si, None));
    }
    // Without a dimension it is in the file's unit, if that can be.
    let own = raw * metres;
    if si.is_none() && PLAUSIBLE.contains(&own) {
        return Ok((own, None));
    }
    let in_file = format!("{raw}, {:.4} m in its unit", si.unwrap_or(own));
    match only_plausible(raw, &units(metres), &PLAUSIBLE) {
        Guess::Only(cover, unit) => {
            let doubt = format!("{in_file}, which is no cover: {raw} {unit} is taken");
            Ok((cover, Some(doubt)))
        }
        Guess::No => Err(format!("{in_file}, which is no cover: it is not used")),
    }
}

/// `35 mm`, `4,5 cm`, `1 1/2"` is not read, `35`.
fn of_text(text: &str, metres: f64) -> Read {
    let unread = || format!("\"{text}\", which is no cover that is understood: it is not used");
    let (number, rest) = number_in(text).ok_or_else(unread)?;
    let rest = rest.trim().to_lowercase();
    let unit = match rest.as_str() {
        "" => return of_quantity(Quantity { raw: number, si: None }, metres),
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        "in" | "inch" | "inches" | "\"" => 0.0254,
        "ft" | "feet" | "'" => 0.3048,
        _ => return Err(unread()),
    };
    let cover = number * unit;
    if BELIEVED.contains(&cover) { Ok((cover, None)) } else { Err(unread()) }
}

/// The exposure classes of EN 206 that a property set says.
pub(super) fn exposure(element: &Element) -> Doubted<String> {
    let mut said = element.properties.values().flatten();
    let found = said.find(|(name, _)| {
        let name = letters(name);
        name.contains("exposureclass") || name.contains("expositionsklasse")
    });
    let Some(text) = found.and_then(|(_, value)| Value::as_str(value)) else {
        return (None, None);
    };
    let upper = text.to_uppercase();
    let words: Vec<&str> =
        upper.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty()).collect();
    let (known, strange): (Vec<&str>, Vec<&str>) =
        words.into_iter().partition(|word| Exposure::CLASSES.contains(word));
    // Classes of moisture for the alkali-silica reaction (DIN EN 206) stand beside the others.
    let strange: Vec<&str> =
        strange.into_iter().filter(|w| !["WO", "WF", "WA", "WS"].contains(w)).collect();
    if known.is_empty() {
        let doubt = (!text.trim().is_empty()).then(|| {
            format!("exposure \"{text}\" is no class of EN 206 (XC4, XD3 …): it is not used")
        });
        return (None, doubt);
    }
    let doubt = (!strange.is_empty()).then(|| {
        format!(
            "exposure \"{text}\": {} is no class of EN 206, and is not used",
            strange.join(", ")
        )
    });
    (Some(known.join(", ")), doubt)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn with(name: &str, value: Value) -> Element {
        let mut element = Element::default();
        element.properties.entry("Pset".into()).or_default().insert(name.into(), value);
        element
    }

    /// What is said about a cover is none; of several the least holds, with a doubt.
    #[test]
    fn what_is_about_a_cover_is_no_cover() {
        for name in [
            "ConcreteCoverDeviation",
            "ConcreteCoverTolerance",
            "ConcreteCoverUtilisation",
            "ConcreteCoverCount",
            "ConcreteCoverClass",
        ] {
            assert_eq!(cover_mm(&with(name, json!(12.0)), 1e-3), (None, None), "{name}");
        }
        let mut several = with("ConcreteCoverTop", json!(60.0));
        let set = several.properties.get_mut("Pset").unwrap();
        set.insert("ConcreteCoverBottom".into(), json!(30.0));
        set.insert("ConcreteCoverDeviation".into(), json!(10.0));
        let (mm, doubt) = cover_mm(&several, 1e-3);
        assert!(mm == Some(30.0) && doubt.unwrap().contains("the least, 30 mm"));
    }

    #[test]
    fn covers_are_read_in_their_own_unit() {
        let typed = |value: f64, si: f64| json!({"value": value, "si": si, "unit": "LENGTHUNIT"});
        for (value, metres, expected, is_doubted) in [
            (typed(35.0, 0.035), 1e-3, Some(35.0), false),
            (typed(6.0, 0.06), 1e-3, Some(60.0), false),
            (typed(4.5, 0.045), 1.0, Some(45.0), false),
            (typed(12.0, 0.12), 1e-3, Some(120.0), true),
            (typed(0.115, 0.115 * 0.3048), 0.3048, Some(35.1), false),
            // Written in mm by a program whose file is in m.
            (typed(35.0, 35.0), 1.0, Some(35.0), true),
            (json!(35.0), 1.0, Some(35.0), true),
            (json!(0.035), 1e-3, Some(35.0), true),
            (json!(35.0), 1e-3, Some(35.0), false),
            (json!("35 mm"), 1.0, Some(35.0), false),
            (json!("3,5 cm"), 1e-3, Some(35.0), false),
            (json!("1.5 in"), 1e-3, Some(38.1), false),
            (json!("enough"), 1e-3, None, true),
            (json!(0.0), 1e-3, None, true),
            (json!(5e5), 1e-3, None, true),
        ] {
            let (cover, doubt) = cover_mm(&with("ConcreteCover", value.clone()), metres);
            assert_eq!((cover, doubt.is_some()), (expected, is_doubted), "{value} {doubt:?}");
        }
    }

    #[test]
    fn exposure_classes_are_found_or_named() {
        for (text, expected, is_doubted) in [
            ("XC4/XD1/XF2", Some("XC4, XD1, XF2"), false),
            ("xc4, xd1", Some("XC4, XD1"), false),
            ("XC4 XD3", Some("XC4, XD3"), false),
            ("XC4, XD3, WA", Some("XC4, XD3"), false),
            ("XC4, Q7", Some("XC4"), true),
            ("S2", None, true),
            ("", None, false),
        ] {
            let (classes, doubt) = exposure(&with("ExposureClass", text.into()));
            assert_eq!((classes.as_deref(), doubt.is_some()), (expected, is_doubted), "{text}");
        }
    }
}
