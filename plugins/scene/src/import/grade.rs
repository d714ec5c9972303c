//! Concrete and steel out of what people write: `C30/37`, `Beton C35/45`, `fc=40 MPa`, `BSt 500 S`.

use serde_json::Value;

use super::source::{Element, Matter};
use crate::{
    file::concrete_class,
    structure::{self, Grade},
};

/// What a member is made of, as far as it is said.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Concrete {
    /// A class of Eurocode 2.
    Class(String),
    /// Characteristic cylinder strength, MPa.
    Strength(f32),
}

/// Classes of EN 206 by their cylinder strength.
const CLASSES: [(u32, u32); 15] = [
    (8, 10),
    (12, 15),
    (16, 20),
    (20, 25),
    (25, 30),
    (30, 37),
    (35, 45),
    (40, 50),
    (45, 55),
    (50, 60),
    (55, 67),
    (60, 75),
    (70, 85),
    (80, 95),
    (90, 105),
];

/// Classes of DIN 1045 (1978), by cubes, and those of today that DIN 1045-1 put in their place.
const GERMAN: [(&str, u32); 5] = [("B15", 12), ("B25", 20), ("B35", 30), ("B45", 35), ("B55", 45)];

/// A material that is no concrete: words by which it goes; what it is taken for: Young's modulus,
/// GPa, Poisson's ratio, density, kg/m³, thermal expansion, 1e-6/K; and what it bears in tension,
/// MPa, where it is not brittle.
type Other = (&'static [&'static str], [f32; 4], Option<f32>);

/// Materials that are no concrete. Words of reinforced concrete are taken out before.
///
/// Wood: C24 of EN 338, expansion and Poisson's ratio ours. Steel: S235 of EN 1993-1-1, 3.2.6, where
/// its name says no other; copper alike in stiffness to within a factor of two. Aluminium: EN
/// 1999-1-1, 3.2.5, and EN AW-6063 T6 of its table 3.2b. Glass: EN 572-1. Masonry: E = 1000 f_k of EN
/// 1996-1-1, 3.7.2, with f_k = 5 MPa. Stone, soil, asphalt and insulation: ours.
const OTHERS: [Other; 9] = [
    (&["wood", "timber", "holz", "glulam", "bois"], [11.0, 0.3, 420.0, 5.0], Some(24.0)),
    (&["alumin"], [70.0, 0.3, 2700.0, 23.0], Some(160.0)),
    (
        &["steel", "stahl", "acier", "acero", "metal", "copper"],
        [210.0, 0.3, 7850.0, 12.0],
        Some(235.0),
    ),
    (&["glass", "glas"], [70.0, 0.23, 2500.0, 9.0], None),
    (&["masonry", "mauerwerk", "brick", "ziegel"], [5.0, 0.2, 1800.0, 6.0], None),
    (&["stone", "granite", "naturstein"], [40.0, 0.25, 2600.0, 8.0], None),
    (&["asphalt"], [3.0, 0.35, 2400.0, 25.0], None),
    (&["soil"], [0.05, 0.3, 1900.0, 10.0], None),
    (&["insulation", "dämmung"], [0.01, 0.2, 50.0, 10.0], None),
];
const CONCRETES: [&str; 8] =
    ["stahlbeton", "reinforced", "concrete", "beton", "béton", "hormig", "calcestruzzo", "betong"];

/// What a member's properties and materials say of its concrete.
pub(super) fn concrete(element: &Element) -> Option<Concrete> {
    let sets =
        std::iter::once(&element.properties).chain(element.materials.iter().map(|m| &m.properties));
    for (name, value) in sets.flat_map(|sets| sets.values()).flatten() {
        if let Some(found) = of_property(name, value) {
            return Some(found);
        }
    }
    let names = element.materials.iter().flat_map(|m| [&m.name, &m.category]);
    names.chain(&element.words).chain([&element.name]).find_map(|text| of_text(text))
}

fn of_property(name: &str, value: &Value) -> Option<Concrete> {
    let name: String = name.to_lowercase().chars().filter(|c| c.is_alphanumeric()).collect();
    let says_class = [
        "strengthclass",
        "concreteclass",
        "concretegrade",
        "betongüte",
        "betonklasse",
        "festigkeitsklasse",
    ];
    if says_class.iter().any(|word| name.contains(word)) && !name.contains("reinforcement") {
        return of_text(value.as_str()?);
    }
    if ["compressivestrength", "fck", "druckfestigkeit"].iter().any(|word| name.contains(word)) {
        let number = value.as_f64().or_else(|| first_number(value.as_str()?))?;
        return strength(if number > 1e4 { number / 1e6 } else { number });
    }
    None
}

/// A strength in MPa, if concrete can have it: a class where it is one.
fn strength(mpa: f64) -> Option<Concrete> {
    let known = CLASSES.iter().find(|(cylinder, _)| (f64::from(*cylinder) - mpa).abs() < 0.01);
    match known {
        Some((cylinder, cube)) => Some(Concrete::Class(format!("C{cylinder}/{cube}"))),
        None => (5.0..=150.0).contains(&mpa).then_some(Concrete::Strength(mpa as f32)),
    }
}

/// A class or a strength somewhere in a text.
pub(super) fn of_text(text: &str) -> Option<Concrete> {
    let words = || text.split(|c: char| !(c.is_alphanumeric() || "/.=".contains(c)));
    for word in words() {
        let word = word.trim_start_matches(['L', 'H']);
        if concrete_class(word).is_some() {
            return Some(Concrete::Class(word.into()));
        }
        // `C35/45-XC4` was cut above; `C35/45XC4` is cut here.
        let digits = |c: char| c.is_ascii_digit() || c == '/';
        let cut =
            word.strip_prefix('C').map(|rest| rest.find(|c| !digits(c)).unwrap_or(rest.len()));
        if let Some(start) = cut.and_then(|end| word.get(..=end))
            && concrete_class(start).is_some()
        {
            return Some(Concrete::Class(start.into()));
        }
        let alone = word.strip_prefix('C').and_then(|n| n.parse::<u32>().ok());
        if let Some(found) = CLASSES.iter().find(|(cylinder, _)| alone == Some(*cylinder)) {
            return Some(Concrete::Class(format!("C{}/{}", found.0, found.1)));
        }
        if let Some((_, cylinder)) = GERMAN.iter().find(|(name, _)| *name == word) {
            return strength(f64::from(*cylinder));
        }
    }
    by_unit(text)
}

/// `fc = 40 MPa`, `f'c 5000 psi`, `40 N/mm²`.
fn by_unit(text: &str) -> Option<Concrete> {
    let low = text.to_lowercase();
    let (unit, scale) = [("mpa", 1.0), ("n/mm", 1.0), ("psi", 0.006_894_757)]
        .into_iter()
        .find(|(unit, _)| low.contains(unit))?;
    let before = low.split(unit).next()?.trim_end();
    let begin = before.rfind(|c: char| !(c.is_ascii_digit() || c == '.')).map_or(0, |i| {
        i + before.get(i..).and_then(|rest| rest.chars().next()).map_or(1, char::len_utf8)
    });
    strength(before.get(begin..)?.parse::<f64>().ok()? * scale)
}

fn first_number(text: &str) -> Option<f64> {
    let begin = text.find(|c: char| c.is_ascii_digit())?;
    let rest = text.get(begin..)?;
    let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(rest.len());
    rest.get(..end)?.parse().ok()
}

/// A material that is surely no concrete, with what it is taken for.
pub(super) fn other_matter(materials: &[Matter]) -> Option<structure::Matter> {
    let is_concrete = |text: &str| CONCRETES.iter().any(|word| text.contains(word));
    let other = |m: &Matter| {
        let text = format!("{} {}", m.name, m.category).to_lowercase();
        let is_it = |(words, ..): &&Other| words.iter().any(|w| text.contains(w));
        let (_, [modulus_gpa, poisson, density_kg_m3, expansion_1e6_k], strength) =
            *OTHERS.iter().find(is_it)?;
        let matter = structure::Matter {
            name: m.name.clone(),
            modulus_gpa,
            poisson,
            density_kg_m3,
            expansion_1e6_k,
            strength_mpa: strength.map(|least| of_class(&m.name).unwrap_or(least)),
        };
        (!is_concrete(&text)).then_some(matter)
    };
    let concrete = |m: &Matter| is_concrete(&m.name.to_lowercase());
    if materials.iter().any(concrete) {
        return None;
    }
    materials.iter().find_map(other)
}

/// Yield strength of a structural steel by its name in EN 10025, bending strength of wood by its
/// class in EN 338 (C for softwood, D for hardwood) or EN 14080 (GL), MPa: `S355J2`, `C24`, `GL28h`.
fn of_class(name: &str) -> Option<f32> {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let of_word = |word: &str| {
        let (prefix, range) = [("S", 235..=960), ("GL", 20..=36), ("C", 14..=50), ("D", 18..=80)]
            .into_iter()
            .find(|(prefix, _)| word.starts_with(prefix))?;
        let rest = word.strip_prefix(prefix)?;
        let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let mpa: u32 = rest.get(..digits)?.parse().ok()?;
        range.contains(&mpa).then_some(mpa as f32)
    };
    words.filter_map(of_word).next()
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

fn grade_in(text: &str) -> Option<Grade> {
    if let Some(grade) = Grade::named(text) {
        return Some(grade);
    }
    let low = text.to_lowercase();
    // DIN 488 (1984): BSt 500 S is of the ductility that is B today; BSt 420 S yields at 420 MPa.
    if low.contains("bst") {
        let fy = first_number(&low)? as f32;
        let named = Grade::named("B500B")?;
        return (200.0..=600.0).contains(&fy).then(|| named.at(Some(fy)));
    }
    let words = text.split(|c: char| !c.is_alphanumeric());
    words.map(str::to_uppercase).find_map(|word| Grade::named(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn class(text: &str) -> Option<String> {
        match of_text(text)? {
            Concrete::Class(name) => Some(name),
            Concrete::Strength(mpa) => Some(format!("{mpa:.1}")),
        }
    }

    #[test]
    fn classes_are_found_in_what_people_write() {
        let is = |text: &str, expected: &str| {
            assert_eq!(class(text).as_deref(), Some(expected), "{text}")
        };
        is("C30/37", "C30/37");
        is("Beton C35/45", "C35/45");
        is("Concrete_C25/30_XC4", "C25/30");
        is("LC30/33", "C30/33");
        is("Stahlbeton C40", "C40/50");
        is("B25 Ortbeton", "C20/25");
        is("fc=40 MPa", "C40/50");
        is("f'c = 4000 psi", "27.6");
        is("28 N/mm²", "28.0");
        for none in ["Concrete", "B500B", "C4 wall", "Stahlbeton 65690", "STB d=30", "", "250 MPa"]
        {
            assert_eq!(class(none), None, "{none}");
        }
    }

    #[test]
    fn properties_speak_before_names() {
        let mut element = Element { name: "C20/25".into(), ..Element::default() };
        assert_eq!(concrete(&element), Some(Concrete::Class("C20/25".into())));
        let mut put = |set: &str, name: &str, value: Value| {
            element.properties.entry(set.into()).or_default().insert(name.into(), value);
            concrete(&element)
        };
        let reinforcement = put("Pset", "ReinforcementStrengthClass", "C99/99".into());
        assert_eq!(reinforcement, Some(Concrete::Class("C20/25".into())));
        assert_eq!(
            put("Pset_MaterialConcrete", "CompressiveStrength", 4.2e7.into()),
            Some(Concrete::Strength(42.0))
        );
        assert_eq!(
            put("A", "StrengthClass", "C50/60".into()),
            Some(Concrete::Class("C50/60".into()))
        );
    }

    #[test]
    fn what_is_no_concrete_is_told_from_what_is() {
        let of = |name: &str| {
            let matter = [Matter { name: name.into(), ..Matter::default() }];
            other_matter(&matter).is_some()
        };
        assert!(of("wood-generic") && of("Steel S355") && of("stone_granite_masonry"));
        assert!(!of("Stahlbeton - Ortbeton") && !of("steel-reinforced concrete") && !of("Solid"));
    }

    #[test]
    fn what_bears_tension_says_how_much() {
        let of = |name: &str| {
            let matter = [Matter { name: name.into(), ..Matter::default() }];
            other_matter(&matter).unwrap().strength_mpa
        };
        assert_eq!(
            [of("wood-generic"), of("Holz C30"), of("Glulam GL28h")],
            [24.0, 30.0, 28.0].map(Some)
        );
        assert_eq!(
            [of("Steel S355J2"), of("Steel"), of("Masonry")],
            [Some(355.0), Some(235.0), None]
        );
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
