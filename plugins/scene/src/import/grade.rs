//! What a member and a bar are made of: by properties, then by the materials' names, and only where
//! a name says a whole class (`C30/37`), by its own. A mark such as C20 or B15 is no grade.

use serde_json::Value;

use super::{
    matter::{self, Substance, understand},
    quantity::{Guess, Quantity, number_in, only_plausible},
    source::{Element, Matter, Properties},
    strength::{self, Reading},
};
use crate::structure::{self, Grade};

/// What a member is made of, as far as it is said.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Concrete {
    /// A class of Eurocode 2.
    Class(String),
    /// Characteristic cylinder strength, MPa.
    Strength(f32),
}

/// What a member is made of.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Composition {
    pub(super) concrete: Option<Concrete>,
    /// What it is taken for where it is no concrete, or lightweight.
    pub(super) other: Option<structure::Matter>,
    /// Whether `other` is a concrete, which bars reinforce.
    pub(super) is_lightweight: bool,
    /// Materials of which the file says a name that is not known.
    pub(super) unknown: Vec<String>,
    /// Sentences about what was read with a doubt.
    pub(super) doubts: Vec<String>,
    /// Each material by name, with what was made of it.
    pub(super) materials: Vec<(String, String)>,
}

/// What is said of a member's matter.
pub(super) fn composition(element: &Element) -> Composition {
    let mut found = Composition::default();
    let is_named = element.class.starts_with("Ifc");
    let mut concrete: Option<Reading> = None;
    let mut others = Vec::new();
    let mut is_concrete = false;
    for material in &element.materials {
        let mut understood = understand(material, is_named);
        if let Substance::Concrete(by_name) = &mut understood.substance {
            is_concrete = true;
            if let Some((_, reading)) = strength_of(&material.properties, &mut found.doubts) {
                understood.taken_for = format!("concrete: {}", reading.meaning);
                *by_name = Some(reading);
            }
            if let Some(reading) = by_name.take() {
                if reading.is_doubtful {
                    let name = label(material);
                    found.doubts.push(format!("material \"{name}\": {}", reading.meaning));
                }
                let first = concrete.get_or_insert_with(|| reading.clone());
                if mpa(&first.concrete) != mpa(&reading.concrete) {
                    found.doubts.push(format!(
                        "its materials are {} and {}: the first is taken for all of it",
                        words(&first.concrete),
                        words(&reading.concrete)
                    ));
                }
            }
        }
        if let Some(doubt) = matter::doubt(material) {
            found.doubts.push(format!("material \"{}\": {doubt}", label(material)));
        }
        match &understood.substance {
            Substance::Other(matter) => others.push(matter.clone()),
            Substance::Unknown | Substance::Bars => found.unknown.push(label(material)),
            Substance::Concrete(_) | Substance::Unsaid => {}
        }
        found.materials.push((label(material), understood.taken_for));
    }
    if !is_concrete && !others.is_empty() {
        found.other = dominant(others);
        found.unknown.clear();
        return found;
    }
    let light: Vec<&str> = (others.iter())
        .filter(|matter| is_concrete && matter.density_kg_m3 < 7000.0)
        .map(|matter| matter.name.as_str())
        .collect();
    if !light.is_empty() {
        found.doubts.push(format!(
            "it is of concrete and {}: all of it is computed as concrete",
            light.join(" and ")
        ));
    }
    // What is said of the element itself comes before its materials.
    if let Some((place, own)) = strength_of(&element.properties, &mut found.doubts) {
        found.materials.push((place, format!("concrete: {}", own.meaning)));
        if let Some(other) = concrete.as_ref().filter(|c| c.concrete != own.concrete) {
            found.doubts.push(format!(
                "a property says {} and the material {}: the property is taken",
                words(&own.concrete),
                words(&other.concrete)
            ));
        }
        concrete = Some(own);
    }
    let names = || element.words.iter().chain([&element.name]);
    let by_name = || names().find_map(|name| strength::pair(&name.to_uppercase()));
    let has_concrete = concrete.is_some();
    let reading = concrete.or_else(|| by_name().filter(|r| !r.is_doubtful));
    // A grid's axes may be called so, too.
    let is_mark = |name: &str| name.trim().chars().all(|c| "cC/0123456789".contains(c));
    if let Some(by_mark) = reading.as_ref().filter(|_| !has_concrete && is_mark(&element.name)) {
        let class = words(&by_mark.concrete);
        let mark = &element.name;
        found
            .doubts
            .push(format!("its name, {mark}, is taken for its class, {class}: it may be its mark"));
    }
    if is_concrete || reading.is_some() {
        found.unknown.clear();
    } else if others.is_empty() && found.unknown.is_empty() {
        let rolled = names().find(|name| matter::is_rolled_steel(name));
        found
            .unknown
            .extend(rolled.map(|name| format!("none, but a name of rolled steel, {name}")));
    }
    if let Some(light) = reading.as_ref().filter(|r| r.is_lightweight) {
        let fck = match &light.concrete {
            Concrete::Class(class) => crate::file::concrete_class(class).unwrap_or(30.0),
            Concrete::Strength(mpa) => *mpa,
        };
        let name = format!("lightweight concrete L{}", words(&light.concrete));
        found.other = Some(matter::lightweight(&name, f64::from(fck)));
        found.is_lightweight = true;
    }
    found.concrete = reading.map(|r| r.concrete);
    found
}

/// Boards on studs are boards: a framed wall is not solid steel.
fn dominant(others: Vec<structure::Matter>) -> Option<structure::Matter> {
    let stiffest = |list: &[structure::Matter]| {
        list.iter().max_by(|a, b| a.modulus_gpa.total_cmp(&b.modulus_gpa)).cloned()
    };
    let is_board = |m: &&structure::Matter| m.density_kg_m3 < 1000.0 && m.strength_mpa.is_none();
    let has_masonry = others.iter().any(|m| m.strength_mpa.is_none() && m.density_kg_m3 > 1500.0);
    match others.iter().find(|m| is_board(m) && m.modulus_gpa > 1.0) {
        Some(board) if !has_masonry => Some(board.clone()),
        _ => stiffest(&others),
    }
}

fn label(material: &Matter) -> String {
    let name = if material.name.trim().is_empty() { &material.category } else { &material.name };
    if name.trim().is_empty() { "without a name".into() } else { name.trim().to_owned() }
}

/// A strength in a few words.
fn words(concrete: &Concrete) -> String {
    match concrete {
        Concrete::Class(class) => class.clone(),
        Concrete::Strength(mpa) => format!("{mpa} MPa"),
    }
}

/// The first strength that properties say, and which one; doubts are added to a list, also of others
/// that say another.
fn strength_of(sets: &Properties, doubts: &mut Vec<String>) -> Option<(String, Reading)> {
    let mut found: Vec<(String, Reading)> = Vec::new();
    for (set, values) in sets {
        // Tested on what, said beside it.
        let on_cubes = values.iter().any(|(name, value)| {
            name.to_lowercase().contains("specimen")
                && value.as_str().is_some_and(|text| strength::is_cube(&text.to_lowercase()))
        });
        for (name, value) in values {
            let place = format!("{set}.{name}");
            let named = if on_cubes { format!("{name} cube") } else { name.clone() };
            match of_property(&named, value) {
                Some(Ok(reading)) => found.push((place, reading)),
                Some(Err(why)) => doubts.push(format!("{place} says {}: {why}", said(value))),
                None => {}
            }
        }
    }
    let (place, reading) = found.first().cloned()?;
    let differs =
        |one: &&(String, Reading)| (mpa(&one.1.concrete) - mpa(&reading.concrete)).abs() > 0.05;
    if let Some((other, its)) = found.iter().find(differs) {
        doubts.push(format!(
            "{place} says {} and {other} says {}: the first is taken",
            words(&reading.concrete),
            words(&its.concrete)
        ));
    }
    if reading.is_doubtful {
        doubts.push(format!("{place}: {}", reading.meaning));
    }
    Some((place, reading))
}

/// Characteristic strength of cylinders, MPa.
fn mpa(concrete: &Concrete) -> f64 {
    match concrete {
        Concrete::Class(class) => f64::from(crate::file::concrete_class(class).unwrap_or(30.0)),
        Concrete::Strength(mpa) => f64::from(*mpa),
    }
}

fn said(value: &Value) -> String {
    match (Quantity::of(value), value.as_str()) {
        (Some(quantity), _) => quantity.raw.to_string(),
        (None, Some(text)) => format!("\"{text}\""),
        _ => value.to_string(),
    }
}

/// What a property says of the strength of concrete. `None`: it is about something else. An error
/// says why it is not used.
fn of_property(name: &str, value: &Value) -> Option<Result<Reading, String>> {
    let joined: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let words = words_of(name);
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    let holds = |list: &[&str]| list.iter().any(|part| joined.contains(part));
    const OTHERS: [&str; 16] = [
        "reinforcement",
        "rebar",
        "steel",
        "yield",
        "bewehrung",
        "masonry",
        "mortar",
        "rock",
        "aggregate",
        "grout",
        "cement",
        "zement",
        "insulation",
        "dämm",
        "screed",
        "estrich",
    ];
    if holds(&OTHERS)
        || has(&["grain", "wood", "timber", "soil", "stone", "brick", "block", "factor", "ratio"])
    {
        return None;
    }
    const STRENGTHS: [&str; 9] = [
        "compressivestrength",
        "compressionstrength",
        "cubestrength",
        "cylinderstrength",
        "fck",
        "fcu",
        "rck",
        "druckfestigkeit",
        "specifiedstrength",
    ];
    const CLASSES: [&str; 7] = [
        "concretestrength",
        "strengthclass",
        "concreteclass",
        "concretegrade",
        "betongüte",
        "betonklasse",
        "festigkeitsklasse",
    ];
    let is_class = holds(&CLASSES);
    // Whatever it is called, a whole class is no number of something else.
    let is_whole =
        || value.as_str().is_some_and(|text| strength::pair(&text.to_uppercase()).is_some());
    let is_about = holds(&["concrete", "beton", "strength", "resist"]);
    if has(&[
        "blinding",
        "sauberkeit",
        "sauberkeitsschicht",
        "topping",
        "infill",
        "filling",
        "foundation",
    ]) && (is_class || holds(&STRENGTHS))
    {
        return Some(Err("it is of another part than this, and is not used".into()));
    }
    let is_said = is_class || is_about && !holds(&STRENGTHS) && is_whole();
    let is_number = |text: &str| text.trim().trim_end_matches('.').parse::<f64>().is_ok();
    if let Some(text) = value.as_str().filter(|text| is_said && !is_number(text)) {
        if text.trim().is_empty() {
            return None;
        }
        let unread = "it is no class that is known, and is not used".to_owned();
        return Some(strength::of_text(text).ok_or(unread));
    }
    if !holds(&STRENGTHS) && joined != "fc" && !is_class {
        return None;
    }
    // CompressiveStrength150x150x150, fck7.
    let sizes: Vec<u32> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let is_prism = sizes.len() > 1 && sizes.iter().all(|n| (100..=300).contains(n));
    if let [days] = sizes[..]
        && days < 28
    {
        return Some(Err(format!("this is the strength after {days} days, and is not used")));
    }
    // Of a test: when it was made, by which method, on which day.
    if has(&["age", "alter", "prüfalter", "date", "datum", "method", "standard", "norm", "number"])
        || (has(&["days", "day", "tage", "d"]) && !joined.contains("28"))
    {
        return early(&words).map(Err);
    }
    const EARLY: [&str; 12] = [
        "early",
        "transfer",
        "release",
        "stripping",
        "initial",
        "frühfestigkeit",
        "demoulding",
        "demolding",
        "prestressing",
        "loading",
        "lifting",
        "handling",
    ];
    if has(&EARLY) {
        return Some(Err("this is no strength after 28 days, and is not used".into()));
    }
    if has(&["target", "measured", "core", "actual", "insitu", "test", "ziel"]) {
        return Some(Err(
            "a target or a measured strength is no characteristic one, and is not used".into(),
        ));
    }
    if has(&["design", "fcd", "bemessung", "bemessungswert"]) {
        return Some(Err("a design strength has its safety factor in it, and is not used".into()));
    }
    let is_mean = has(&["mean", "average", "mittel", "mittelwert", "fcm"]);
    let is_cube = strength::is_cube(&format!("{} {joined}", name.to_lowercase()))
        || is_prism && sizes.iter().all(|n| *n == sizes[0]);
    Some(of_number(value, is_cube, is_mean))
}

/// A strength after so many days is early where there are fewer than 28.
fn early(words: &[String]) -> Option<String> {
    let days = words.iter().find_map(|word| word.parse::<u32>().ok())?;
    (days != 28).then(|| format!("this is the strength after {days} days, and is not used"))
}

/// Words of a property's name, in small letters: `CompressiveStrength28Days`.
fn words_of(name: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![String::new()];
    let mut last = ' ';
    for c in name.chars() {
        let begins = (c.is_uppercase() && last.is_lowercase())
            || (c.is_numeric() != last.is_numeric() && c.is_alphanumeric());
        if !c.is_alphanumeric() || begins {
            words.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
        last = c;
    }
    words.retain(|w| !w.is_empty());
    words
}

/// Units that a strength without one, or with a wrong one, may have been written in, MPa.
const UNITS: [(&str, f64); 6] = [
    ("MPa", 1.0),
    ("kPa", 1e-3),
    ("Pa", 1e-6),
    ("psi", 0.006_894_757),
    ("ksi", 6.894_757),
    ("kg/cm²", 0.098_066_5),
];
/// Strengths that are plausible where no unit is said, MPa.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 8.0..=120.0;

fn of_number(value: &Value, is_cube: bool, is_mean: bool) -> Result<Reading, String> {
    if let Some(text) = value.as_str() {
        if let Some((mpa, _)) = strength::mpa_in(text) {
            let low = text.to_lowercase();
            let is_mean = is_mean || low.contains("fcm") || low.contains("mean");
            return of_mpa((mpa, None), is_cube || strength::is_cube(&low), is_mean);
        }
        if let Some(reading) = strength::of_text(text) {
            return Ok(reading);
        }
        let (number, rest) = number_in(text).ok_or("it is no strength, and is not used")?;
        let is_bare = rest.trim().is_empty();
        return match is_bare {
            true => of_mpa(guessed(number)?, is_cube, is_mean),
            false => Err("it is no strength that is known, and is not used".into()),
        };
    }
    let Some(Quantity { raw, si }) = Quantity::of(value) else {
        return Err("it is no number, and is not used".into());
    };
    if raw == 0.0 {
        return Err("it is taken for not said".into());
    }
    match si.map(|pascal| 1e-6 * pascal) {
        Some(mpa) if (5.0..=150.0).contains(&mpa) => of_mpa((mpa, None), is_cube, is_mean),
        _ => of_mpa(guessed(raw)?, is_cube, is_mean),
    }
}

/// A number without a unit that can be believed: MPa where that is plausible, else the only unit in
/// which it is, with its name.
fn guessed(raw: f64) -> Result<(f64, Option<&'static str>), String> {
    if PLAUSIBLE.contains(&raw) {
        return Ok((raw, Some("MPa")));
    }
    match only_plausible(raw, &UNITS, &PLAUSIBLE) {
        Guess::Only(mpa, unit) => Ok((mpa, Some(unit))),
        Guess::No => Err("no unit makes that a strength of concrete, and it is not used".into()),
    }
}

fn of_mpa(
    (mpa, guess): (f64, Option<&str>),
    is_cube: bool,
    is_mean: bool,
) -> Result<Reading, String> {
    let mut meaning = format!("{:.4} MPa", mpa).replace(".0000", "");
    if let Some(unit) = guess {
        meaning += &format!(", its number being taken for {unit}");
    }
    let mut cylinder = mpa;
    if is_cube {
        cylinder = strength::of_cube(mpa);
        meaning += &format!(" on cubes, {cylinder:.1} MPa on cylinders");
    }
    if is_mean {
        // EN 1992-1-1, table 3.1.
        cylinder -= 8.0;
        meaning += &format!(" in the mean, f_ck = {cylinder:.1} MPa");
    }
    let is_doubtful = guess.is_some_and(|unit| unit != "MPa") || is_mean;
    strength::reading(cylinder, meaning, is_doubtful)
        .ok_or_else(|| "no concrete is so strong or so weak, and it is not used".into())
}

/// The grade of a bar: by its attribute, its materials, its names.
pub(super) fn steel(element: &Element) -> Option<Grade> {
    let said = element.attributes.get("SteelGrade").and_then(Value::as_str);
    let sets = element.properties.values().flatten();
    let properties = sets.filter(|(name, _)| {
        let name = name.to_lowercase();
        name.contains("grade") || name.contains("strengthclass")
    });
    said.into_iter()
        .chain(properties.filter_map(|(_, value)| value.as_str()))
        .chain(element.materials.iter().map(|m| m.name.as_str()))
        .chain(element.words.iter().map(String::as_str))
        .find_map(grade_in)
}

/// The grade of bars that a text names: `B500B`, `BSt 500 S`, `Rebar b450c`.
pub(super) fn grade_in(text: &str) -> Option<Grade> {
    if let Some(grade) = Grade::named(text) {
        return Some(grade);
    }
    let low = text.to_lowercase();
    // DIN 488 (1984): BSt 500 S is of the ductility that is B today; BSt 420 S yields at 420 MPa.
    if low.contains("bst") {
        let fy = number_in(&low)?.0 as f32;
        let named = Grade::named("B500B")?;
        return (200.0..=600.0).contains(&fy).then(|| named.at(Some(fy)));
    }
    let words = text.split(|c: char| !c.is_alphanumeric());
    words.map(str::to_uppercase).find_map(|word| Grade::named(&word))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn class(element: &Element) -> Option<String> {
        composition(element).concrete.map(|c| words(&c))
    }

    fn with(set: &str, name: &str, value: Value) -> Element {
        let mut element = Element::default();
        element.properties.entry(set.into()).or_default().insert(name.into(), value);
        element
    }

    /// A name alone is believed with a doubt, and that of a rolled section makes no concrete.
    #[test]
    fn a_name_alone_is_doubted() {
        let named = |name: &str| Element { name: name.into(), ..Element::default() };
        for (name, doubts, unknown) in [
            ("C12/15", 1, 0),
            ("Column C30/37", 0, 0),
            ("Column 4", 0, 0),
            ("HEA 300", 0, 1),
            ("Beam IPE400:12345", 0, 1),
            ("W14X90", 0, 1),
            ("UB 4", 0, 0),
            ("S355", 0, 0),
        ] {
            let found = composition(&named(name));
            assert_eq!((found.doubts.len(), found.unknown.len()), (doubts, unknown), "{name}");
        }
    }

    #[test]
    fn properties_speak_before_names() {
        let mut element = Element { name: "C20/25".into(), ..Element::default() };
        assert_eq!(class(&element).as_deref(), Some("C20/25"));
        let mut put = |set: &str, name: &str, value: Value| {
            element.properties.entry(set.into()).or_default().insert(name.into(), value);
            class(&element)
        };
        assert_eq!(put("Pset", "ReinforcementStrengthClass", "C99/99".into()).unwrap(), "C20/25");
        let strength = put("Pset_MaterialConcrete", "CompressiveStrength", 4.2e7.into());
        assert_eq!(strength.unwrap(), "42 MPa");
        assert_eq!(put("A", "StrengthClass", "C50/60".into()).unwrap(), "C50/60");
    }

    /// What another matter, another part or another day has is no strength of this concrete; whether
    /// it says so or is passed over.
    #[test]
    fn only_what_is_said_of_this_concrete_counts() {
        for name in [
            "RockUnconfinedCompressiveStrength",
            "AggregateCompressiveStrength",
            "GroutCompressiveStrength",
            "CementCompressiveStrength",
            "CompressiveStrengthReductionFactor",
            "DemouldingCompressiveStrength",
            "CompressiveStrengthAtPrestressing",
            "TargetCompressiveStrength",
            "CoreCompressiveStrength",
            "fck7",
            "CompressiveStrength90Days",
        ] {
            assert_eq!(class(&with("P", name, 45.0.into())), None, "{name}");
        }
        for name in ["ConcreteGradeOfFoundation", "BlindingConcreteClass", "ToppingStrengthClass"] {
            assert_eq!(class(&with("P", name, "C12/15".into())), None, "{name}");
        }
        for (name, value, expected) in [
            ("CompressiveStrength", "30-37 MPa".into(), "C30/37"),
            ("CompressiveStrength", "fcm = 38 MPa".into(), "C30/37"),
            ("CompressiveStrength150x150x150", 37.0.into(), "C30/37"),
            ("CompressiveStrength28Days", 30.0.into(), "C30/37"),
            ("ConcreteStrength", "C40/50".into(), "C40/50"),
            ("StrengthClass", "30.".into(), "C30/37"),
        ] {
            assert_eq!(class(&with("P", name, value)).as_deref(), Some(expected), "{name}");
        }
        let mut two = with("P", "CompressiveStrength", 30.0.into());
        two.properties.get_mut("P").unwrap().insert("StrengthClass".into(), "C50/60".into());
        let found = composition(&two);
        assert_eq!(found.concrete.map(|c| words(&c)).as_deref(), Some("C30/37"));
        assert!(
            found.doubts.iter().any(|d| d.contains("the first is taken")),
            "{:?}",
            found.doubts
        );
        let mut on_cubes = with("P", "CompressiveStrength", 37.0.into());
        on_cubes.properties.get_mut("P").unwrap().insert("SpecimenType".into(), "Cube".into());
        assert_eq!(class(&on_cubes).as_deref(), Some("C30/37"));
    }

    /// Columns are called C20, beams B15, and walls M30: none is a grade.
    #[test]
    fn a_mark_is_no_grade() {
        for mark in ["C20", "C50", "B15", "B25", "M30", "Stütze C25", "Fc24", "HA-30", "S355"] {
            let element = Element {
                class: "IfcColumn".into(),
                name: mark.into(),
                words: vec![mark.into()],
                ..Element::default()
            };
            assert_eq!(composition(&element), Composition::default(), "{mark}");
        }
    }

    #[test]
    fn numbers_of_properties_are_read_by_what_they_mean() {
        let typed = |value: f64, si: f64| json!({"value": value, "si": si, "unit": "PRESSUREUNIT"});
        for (name, value, expected, is_doubted) in [
            ("CompressiveStrength", typed(30.0, 30e6), Some("C30/37"), false),
            ("CompressiveStrength", typed(30e3, 30e6), Some("C30/37"), false),
            // No unit of pressure in the file, and MPa written.
            ("CompressiveStrength", typed(30.0, 30.0), Some("C30/37"), false),
            ("Fck,cube", json!(37.0), Some("C30/37"), false),
            ("CharacteristicCubeStrength", json!(37.0), Some("C30/37"), false),
            ("f_ck,cube", json!("37 MPa"), Some("C30/37"), false),
            ("CompressiveStrength28Days", json!(35.0), Some("C35/45"), false),
            ("CompressiveStrength", json!(4000.0), Some("27.58 MPa"), true),
            ("CompressiveStrength", json!("4,000 psi"), Some("27.58 MPa"), false),
            ("MeanCompressiveStrength", json!(38.0), Some("C30/37"), true),
            ("CompressiveStrengthTestAge", json!(28.0), None, false),
            ("Compressive strength test age days", json!(28), None, false),
            ("CompressiveStrength at 7 days", json!(20), None, true),
            ("DesignCompressiveStrength", json!(20), None, true),
            ("CompressiveStrength", json!(1e12), None, true),
            ("CompressiveStrength", json!(15000), None, true),
            ("StrengthClass", json!("strong"), None, true),
            ("CompressiveStrengthParallelToGrain", json!(21), None, false),
        ] {
            let found = composition(&with("Pset", name, value.clone()));
            let class = found.concrete.as_ref().map(words);
            assert_eq!(class.as_deref(), expected, "{name} {value}");
            assert_eq!(!found.doubts.is_empty(), is_doubted, "{name} {value}: {:?}", found.doubts);
        }
    }

    #[test]
    fn materials_decide_together() {
        let of = |names: &[&str]| {
            let material = |name: &&str| Matter { name: (*name).into(), ..Matter::default() };
            composition(&Element {
                class: "IfcWall".into(),
                materials: names.iter().map(material).collect(),
                ..Element::default()
            })
        };
        let sandwich = of(&["Wärmedämmung - hart", "Stahlbeton - Ortbeton"]);
        assert_eq!((sandwich.other, sandwich.unknown), (None, vec![]));
        let framed = of(&["Gypsum board", "Metal stud", "Gypsum board"]).other.unwrap();
        assert_eq!(framed.strength_mpa, None);
        assert_eq!(of(&["Brick", "Plaster"]).other.unwrap().density_kg_m3, 1800.0);
        assert_eq!(of(&["XK-12"]).unknown, ["XK-12"]);
        assert_eq!(of(&["B500B"]).unknown, ["B500B"]);
        let light = of(&["LC30/33"]);
        assert!(light.is_lightweight && light.other.is_some() && !light.doubts.is_empty());
        assert_eq!(
            of(&["C30/37", "B500B"]),
            Composition { doubts: vec![], ..of(&["C30/37", "B500B"]) }
        );
    }

    /// What is not all of one concrete is computed so, and said.
    #[test]
    fn layers_of_other_matter_are_doubted() {
        let of = |names: &[&str]| {
            let matter = |name: &&str| Matter { name: (*name).into(), ..Matter::default() };
            let materials = names.iter().map(matter).collect();
            composition(&Element { class: "IfcSlab".into(), materials, ..Element::default() })
        };
        for (names, doubt) in [
            (&["Concrete C30/37", "Insulation EPS"][..], "computed as concrete"),
            (&["Concrete C30/37", "Brick"], "computed as concrete"),
            (&["C20/25", "C50/60"], "the first is taken"),
        ] {
            let found = of(names);
            assert!(found.doubts.iter().any(|d| d.contains(doubt)), "{names:?} {:?}", found.doubts);
        }
        for names in [&["Concrete C30/37"][..], &["Concrete C30/37", "Steel B500B"]] {
            assert_eq!(of(names).doubts, [""; 0], "{names:?}");
        }
    }

    #[test]
    fn grades_of_steel_are_found() {
        let fy = |text: &str| grade_in(text).map(|g| g.yield_mpa);
        assert_eq!(
            [fy("B500B"), fy("BSt 420 S"), fy("Rebar b450c")].map(|f| f.unwrap()),
            [500.0, 420.0, 450.0]
        );
        assert_eq!(fy("ReinforcingSteel"), None);
    }
}
