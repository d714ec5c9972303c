//! The characteristic cylinder strength f_ck out of what people write of concrete: `C30/37`,
//! `Beton C35/45`, `f'c = 4000 psi`, `Rck 30`, `B25`.
//!
//! Cubes are converted by the pairs of EN 206, table 12, and of BS 8500-1, linearly between them.
//! Old marks in kg/cm² are means of cubes: of them (1 − 1.64 · .135) is characteristic (GOST 26633,
//! appendix A: B = .0764 M). Where a notation has two meanings the lower strength is taken and a
//! doubt is said.

use super::{
    grade::Concrete,
    quantity::{decimal, number_in},
};

/// A strength with how it was understood.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reading {
    pub(super) concrete: Concrete,
    /// What the notation means, as it was taken.
    pub(super) meaning: String,
    /// Whether it can mean something else.
    pub(super) is_doubtful: bool,
    /// Of lightweight concrete.
    pub(super) is_lightweight: bool,
}

/// Strength of cylinders and of cubes, MPa: EN 206, table 12; C28/35 and C32/40 of BS 8500-1.
const PAIRS: [(u32, u32); 17] = [
    (8, 10),
    (12, 15),
    (16, 20),
    (20, 25),
    (25, 30),
    (28, 35),
    (30, 37),
    (32, 40),
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

/// Lightweight concrete: EN 206, table 13.
const LIGHT: [(u32, u32); 14] = [
    (8, 9),
    (12, 13),
    (16, 18),
    (20, 22),
    (25, 28),
    (30, 33),
    (35, 38),
    (40, 44),
    (45, 50),
    (50, 55),
    (55, 60),
    (60, 66),
    (70, 77),
    (80, 88),
];

/// Classes of DIN 1045 (1978), by cubes of 200 mm, and those that DIN 1045-1 put in their place.
const GERMAN: [(f64, f64); 6] =
    [(10.0, 8.0), (15.0, 12.0), (25.0, 20.0), (35.0, 30.0), (45.0, 35.0), (55.0, 45.0)];

/// kg/cm² in MPa.
const KG_CM2: f64 = 0.098_066_5;
/// psi in MPa.
const PSI: f64 = 0.006_894_757;
/// Strengths that concrete can have, MPa.
const STRENGTHS: std::ops::RangeInclusive<f64> = 5.0..=150.0;

/// Strength of cylinders by that of cubes, MPa.
pub(super) fn of_cube(cube: f64) -> f64 {
    let pairs = PAIRS.map(|(a, b)| (f64::from(a), f64::from(b)));
    let [first, .., last] = pairs;
    if cube <= first.1 {
        return cube * first.0 / first.1;
    }
    let between = pairs.windows(2).find(|w| cube <= w[1].1);
    between.map_or(cube * last.0 / last.1, |w| {
        w[0].0 + (cube - w[0].1) / (w[1].1 - w[0].1) * (w[1].0 - w[0].0)
    })
}

/// A strength in MPa, if concrete can have it: a class where it is one.
pub(super) fn strength(mpa: f64) -> Option<Concrete> {
    let known = PAIRS.iter().find(|(cylinder, _)| (f64::from(*cylinder) - mpa).abs() < 0.01);
    match known {
        Some((cylinder, cube)) => Some(Concrete::Class(format!("C{cylinder}/{cube}"))),
        None => STRENGTHS
            .contains(&mpa)
            .then_some(Concrete::Strength(((100.0 * mpa).round() / 100.0) as f32)),
    }
}

pub(super) fn reading(mpa: f64, meaning: impl Into<String>, is_doubtful: bool) -> Option<Reading> {
    Some(Reading {
        concrete: strength(mpa)?,
        meaning: meaning.into(),
        is_doubtful,
        is_lightweight: false,
    })
}

/// Where a text comes from, by its own words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Origin {
    Cyrillic,
    /// GB 50010, BS 8110, IS 456 and all that tests cubes.
    Cubes,
    German,
    Unknown,
}

fn origin(text: &str) -> Origin {
    let low = text.to_lowercase();
    let is_chinese = |c: char| ('\u{4e00}'..='\u{9fff}').contains(&c);
    let words = || low.split(|c: char| !c.is_alphanumeric());
    if low.chars().any(|c| ('\u{400}'..='\u{4ff}').contains(&c)) {
        Origin::Cyrillic
    } else if is_cube(&low)
        || low.chars().any(is_chinese)
        || words().any(|w| ["gb", "bs", "bs8110", "gb50010", "is456"].contains(&w))
        || low.contains("is 456")
        || low.contains("is:456")
    {
        Origin::Cubes
    } else if ["beton", "ortbet", "fertigteil", "festigkeit", "güte", "din"]
        .iter()
        .any(|word| low.contains(word))
    {
        Origin::German
    } else {
        Origin::Unknown
    }
}

/// Whether a text in small letters speaks of cubes.
pub(super) fn is_cube(low: &str) -> bool {
    ["cube", "cubic", "würfel", "wuerfel", "rck", "fcu", "cubo", "cubique", "kub"]
        .iter()
        .any(|word| low.contains(word))
}

/// A class or a strength somewhere in a text.
pub(super) fn of_text(text: &str) -> Option<Reading> {
    // С, В and М of the Cyrillic alphabet look like the Latin ones.
    let upper: String = text.to_uppercase().replace('С', "C").replace('В', "B").replace('М', "M");
    pair(&upper)
        .or_else(|| bare_pair(&upper))
        .or_else(|| by_unit(text))
        .or_else(|| notation(&upper, origin(text)))
}

/// `30/37` alone: nothing else goes by such a pair.
fn bare_pair(upper: &str) -> Option<Reading> {
    let (cylinder, cube) = upper.trim().split_once('/')?;
    let pair = (cylinder.trim().parse().ok()?, cube.trim().parse().ok()?);
    PAIRS.contains(&pair).then_some(())?;
    let name = format!("C{}/{}", pair.0, pair.1);
    let meaning = format!("class {name}, its C being left out");
    Some(Reading {
        concrete: Concrete::Class(name),
        meaning,
        is_doubtful: true,
        is_lightweight: false,
    })
}

/// A class by cylinders and cubes, `C30/37`; with another sign between them (`C35-45`) only where
/// the pair is one of EN 206.
pub(super) fn pair(upper: &str) -> Option<Reading> {
    upper.match_indices('C').find_map(|(at, _)| {
        let before = upper.get(..at)?;
        let is_light = before.ends_with('L') && !ends_in_word(&before[..before.len() - 1]);
        // LC is light, HC heavy, RC reinforced.
        let is_heavy = before.ends_with(['H', 'R']) && !ends_in_word(&before[..before.len() - 1]);
        if ends_in_word(before) && !is_light && !is_heavy {
            return None;
        }
        let (cylinder, rest) = whole(upper.get(at + 1..)?.trim_start_matches([' ', '_', '-']))?;
        let rest = rest.trim_start();
        let sign = rest.chars().next().filter(|c| "/-_\\".contains(*c));
        let (cube, _) = whole(rest.get(sign?.len_utf8()..)?.trim_start())?;
        let is_known = PAIRS.contains(&(cylinder, cube)) || LIGHT.contains(&(cylinder, cube));
        if sign != Some('/') && !is_known {
            return None;
        }
        let name = format!("C{cylinder}/{cube}");
        crate::file::concrete_class(&name)?;
        let is_light = is_light || (is_known && !PAIRS.contains(&(cylinder, cube)));
        let meaning = match (is_light, is_known) {
            (true, _) => format!(
                "lightweight concrete L{name}, f_ck {cylinder} MPa; 1800 kg/m³ and its lower stiffness (EN 1992-1-1, 11.3.2) are assumed"
            ),
            (false, true) => format!("class {name}"),
            (false, false) => {
                format!("no class of EN 206: its first number, {cylinder} MPa on cylinders, is taken")
            }
        };
        Some(Reading {
            concrete: Concrete::Class(name),
            meaning,
            is_doubtful: is_light || !is_known,
            is_lightweight: is_light,
        })
    })
}

fn ends_in_word(text: &str) -> bool {
    text.chars().next_back().is_some_and(char::is_alphanumeric)
}

/// A whole number of at most three digits that a text begins with, and what follows.
fn whole(text: &str) -> Option<(u32, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let number = text.get(..end).filter(|d| (1..=3).contains(&d.len()))?.parse().ok()?;
    Some((number, text.get(end..)?))
}

/// A strength with its unit, MPa, and as it is written: `fc = 40 MPa`, `f'c 5,000 psi`, `40 N/mm²`, `280 kg/cm²`.
pub(super) fn mpa_in(text: &str) -> Option<(f64, String)> {
    let low = text.to_lowercase();
    let units = [
        ("mpa", 1.0, "MPa"),
        ("n/mm", 1.0, "N/mm²"),
        ("mn/m", 1.0, "MN/m²"),
        ("ksi", 1e3 * PSI, "ksi"),
        ("psi", PSI, "psi"),
        ("kgf/cm", KG_CM2, "kg/cm²"),
        ("kg/cm", KG_CM2, "kg/cm²"),
        ("kp/cm", KG_CM2, "kg/cm²"),
    ];
    let (unit, scale, name) = units.into_iter().find(|(unit, ..)| low.contains(unit))?;
    let before = low.split(unit).next()?.trim_end();
    let begin =
        before.rfind(|c: char| !(c.is_ascii_digit() || c == '.' || c == ',')).map_or(0, |i| {
            i + before.get(i..).and_then(|r| r.chars().next()).map_or(1, char::len_utf8)
        });
    let number = decimal(before.get(begin..)?.trim_matches(['.', ',']))?;
    // Of a range the lower end.
    let lower = before.get(..begin).and_then(|rest| {
        let rest = rest.trim_end().strip_suffix(['-', '–', '/'])?.trim_end();
        let start = rest
            .rfind(|c: char| !(c.is_ascii_digit() || c == '.'))
            .map_or(0, |i| i + rest[i..].chars().next().map_or(1, char::len_utf8));
        decimal(rest.get(start..)?).filter(|lower| *lower < number)
    });
    Some((lower.unwrap_or(number) * scale, format!("{} {name}", lower.unwrap_or(number))))
}

/// What stands before a number says that it is another strength than the characteristic one in
/// compression: in tension, for design, of some days.
fn is_another(low: &str) -> bool {
    const OTHERS: [&str; 12] = [
        "fct", "ftk", "fcd", "tensile", "tension", "flexural", "bending", "design", "zug", "biege",
        "days", "tage",
    ];
    OTHERS.iter().any(|word| low.contains(word)) && !low.contains("28 d") && !low.contains("28d")
}

fn by_unit(text: &str) -> Option<Reading> {
    let (mpa, said) = mpa_in(text)?;
    let low = text.to_lowercase();
    if is_another(&low) {
        return None;
    }
    if ["fcm", "mean", "mittel"].iter().any(|word| low.contains(word)) {
        // EN 1992-1-1, table 3.1.
        let meaning = format!("{said} in the mean, f_ck = {:.1} MPa", mpa - 8.0);
        return reading(mpa - 8.0, meaning, true);
    }
    if is_cube(&low) {
        return reading(of_cube(mpa), format!("{said} on cubes"), false);
    }
    reading(mpa, format!("{said} on cylinders"), false)
}

/// A number after a prefix that begins a word: `HA-30`, `RCK 30`, `B22.5`.
fn prefixed(upper: &str, prefix: &str) -> Option<f64> {
    upper.match_indices(prefix).find_map(|(at, _)| {
        if ends_in_word(upper.get(..at)?) {
            return None;
        }
        let rest = upper.get(at + prefix.len()..)?.trim_start_matches([' ', '-', '_', '=', ',']);
        if !rest.starts_with(|c: char| c.is_ascii_digit()) {
            return None;
        }
        let (number, after) = number_in(rest)?;
        let is_whole_word = !after.starts_with(|c: char| c.is_alphanumeric() || c == '/');
        (is_whole_word || prefix == "HA" || prefix == "HP" || prefix == "HM").then_some(number)
    })
}

/// Notations of one letter or a few, which some standard gives a meaning.
fn notation(upper: &str, origin: Origin) -> Option<Reading> {
    if let Some(cube) = ["RCK", "FCU,K", "FCU", "FCK,CUBE", "FCK CUBE"]
        .iter()
        .find_map(|prefix| prefixed(upper, prefix))
    {
        return reading(of_cube(cube), format!("{cube} MPa on cubes"), false);
    }
    let of_cylinders = [
        ("FCK", "characteristic strength of cylinders"),
        ("F'C", "specified strength of cylinders"),
        ("FC", "specified strength of cylinders, as in Japan (Fc) and America (f'c)"),
        ("HA", "Spanish class, of cylinders"),
        ("HP", "Spanish class, of cylinders"),
        ("HM", "Spanish class, of cylinders"),
    ];
    for (prefix, meaning) in of_cylinders {
        match prefixed(upper, prefix) {
            Some(mpa) if (8.0..=120.0).contains(&mpa) => {
                return reading(mpa, format!("{meaning}, {mpa} MPa"), false);
            }
            Some(kg) if (100.0..=900.0).contains(&kg) => {
                return reading(
                    kg * KG_CM2,
                    format!("{meaning}: {kg} is no MPa, {kg} kg/cm² is taken"),
                    true,
                );
            }
            _ => {}
        }
    }
    class_b(upper, origin).or_else(|| class_m(upper)).or_else(|| class_c(upper, origin))
}

/// Old marks: the mean strength of cubes, kg/cm².
fn mark(kg: f64, name: &str, where_: &str) -> Option<Reading> {
    let cube = kg * KG_CM2 * (1.0 - 1.64 * 0.135);
    reading(
        of_cube(cube),
        format!(
            "{name}{kg}: an old mark, the mean of cubes in kg/cm² ({where_}), of which {cube:.1} MPa on cubes is characteristic"
        ),
        true,
    )
}

/// `B25`: Russian and Polish cubes, Germany's before 2001, `B300` before 1972; France's cylinders.
fn class_b(upper: &str, origin: Origin) -> Option<Reading> {
    let number = prefixed(upper, "B");
    if let Some(kg) = prefixed(upper, "BN") {
        let of_it = GERMAN.iter().find(|(cube, _)| (10.0 * cube - kg).abs() < 0.1)?;
        return reading(of_it.1, format!("Bn{kg} of DIN 1045 (1972), cubes in kg/cm²"), false);
    }
    let number = number?;
    if (100.0..=600.0).contains(&number) {
        // B500 and B550 are steel of bars.
        let is_mark = [120.0, 160.0, 225.0, 300.0, 450.0, 600.0].contains(&number);
        return if is_mark {
            mark(number, "B", "Germany, Austria, Switzerland before 1972")
        } else {
            None
        };
    }
    if !(5.0..=100.0).contains(&number) {
        return None;
    }
    let german = GERMAN.iter().find(|(cube, _)| *cube == number).map(|(_, cylinder)| *cylinder);
    match (origin, german) {
        (Origin::Cyrillic, _) => {
            reading(of_cube(number), format!("class B{number} of GOST 26633, of cubes"), false)
        }
        (Origin::German, Some(cylinder)) => {
            reading(cylinder, format!("B{number} of DIN 1045 (1978 to 2001), of cubes"), false)
        }
        (_, german) => {
            let cubes = of_cube(number);
            let lower = german.map_or(cubes, |german| german.min(cubes));
            reading(
                lower,
                format!(
                    "B{number} is a class of cubes in most countries and was one of cylinders in France: the lower, {lower:.1} MPa on cylinders, is taken"
                ),
                true,
            )
        }
    }
}

/// `M30`: Indian cubes; `M300`, `K300`: kg/cm².
fn class_m(upper: &str) -> Option<Reading> {
    // Mortars and bolts are called so, too.
    const NO_CONCRETE: [&str; 8] =
        ["BOLT", "SCREW", "ANCHOR", "NUT", "STUD", "MORTAR", "MÖRTEL", "DÜBEL"];
    if NO_CONCRETE.iter().any(|word| upper.contains(word)) {
        return None;
    }
    if let Some(number) = prefixed(upper, "M") {
        if (100.0..=800.0).contains(&number) {
            return mark(number, "M", "Soviet Union, GOST");
        }
        if (10.0..=100.0).contains(&number) {
            let meaning = format!("grade M{number} of IS 456, of cubes");
            return reading(of_cube(number), meaning, false);
        }
    }
    let number = prefixed(upper, "K")?;
    if (100.0..=800.0).contains(&number) {
        let cube = number * KG_CM2;
        let meaning = format!("K{number}: cubes in kg/cm², as in Indonesia, {cube:.1} MPa");
        return reading(of_cube(cube), meaning, true);
    }
    (10.0..=100.0)
        .contains(&number)
        .then(|| reading(of_cube(number), format!("K{number}: cubes, as in Sweden"), true))?
}

/// `C40` alone: cylinders in Europe, cubes in China and, of old, in Britain.
fn class_c(upper: &str, origin: Origin) -> Option<Reading> {
    let number = prefixed(upper, "C")?;
    let is = |mpa: u32| (f64::from(mpa) - number).abs() < 0.01;
    let cylinders = PAIRS.iter().find(|(cylinder, _)| is(*cylinder));
    let is_cubes =
        PAIRS.iter().any(|(_, cube)| is(*cube)) || (number % 5.0 == 0.0 && number >= 15.0);
    if !STRENGTHS.contains(&number) || (cylinders.is_none() && !is_cubes) {
        return None;
    }
    let cube = of_cube(number);
    match (origin, cylinders) {
        (Origin::German, Some((cylinder, other))) => {
            reading(number, format!("C{cylinder}/{other} of EN 206, in short"), false)
        }
        (Origin::Cubes, _) => {
            reading(cube, format!("class C{number} of cubes (GB 50010, BS 8110)"), false)
        }
        (_, Some((cylinder, other))) => reading(
            cube,
            format!(
                "C{number} can be a class of cubes (GB 50010, BS 8110), {cube:.0} MPa on cylinders, or C{cylinder}/{other} in short: the lower is taken"
            ),
            true,
        ),
        (_, None) => {
            reading(cube, format!("C{number} is a class of cubes (GB 50010, BS 8110)"), true)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn class(text: &str) -> Option<String> {
        match of_text(text)?.concrete {
            Concrete::Class(name) => Some(name),
            Concrete::Strength(mpa) => Some(format!("{mpa:.1}")),
        }
    }

    fn is_doubtful(text: &str) -> bool {
        of_text(text).unwrap().is_doubtful
    }

    #[test]
    fn classes_are_found_in_what_people_write() {
        let is = |text: &str, expected: &str| {
            assert_eq!(class(text).as_deref(), Some(expected), "{text}")
        };
        for (text, expected) in [
            ("C30/37", "C30/37"),
            ("c30/37", "C30/37"),
            ("Beton C35/45", "C35/45"),
            ("C 35/45", "C35/45"),
            ("C35-45", "C35/45"),
            ("Concrete_C25/30_XC4", "C25/30"),
            ("C35/45XC4", "C35/45"),
            ("Beton C30/37 + BSt 500 S", "C30/37"),
            ("C32/40", "C32/40"),
            ("LC30/33", "C30/33"),
            ("Stahlbeton C40", "C40/50"),
            ("B25 Ortbeton", "C20/25"),
            ("Stahlbeton B35", "C30/37"),
            ("Бетон В35", "C28/35"),
            ("Бетон B22,5", "18.0"),
            ("fc=40 MPa", "C40/50"),
            ("f'c = 4000 psi", "27.6"),
            ("Concrete, 4,000 psi", "27.6"),
            ("5 ksi", "34.5"),
            ("f'c 280 kg/cm2", "27.5"),
            ("28 N/mm²", "C28/35"),
            ("Rck 37", "C30/37"),
            ("HA-30/B/20/IIa", "C30/37"),
            ("Fc24", "24.0"),
            ("M30", "C25/30"),
            ("C40 混凝土", "C32/40"),
            ("BS 8110 C40", "C32/40"),
            ("37 MPa cube", "C30/37"),
            ("RC32/40", "C32/40"),
            ("RC 25/30", "C25/30"),
            ("30/37", "C30/37"),
            ("30-37 MPa", "C30/37"),
            ("fcm 38 MPa", "C30/37"),
        ] {
            is(text, expected);
        }
        for none in [
            "Concrete",
            "B500B",
            "B500",
            "C4 wall",
            "Stahlbeton 65690",
            "STB d=30",
            "",
            "250 MPa",
            "C24",
            "COL 30",
            "fctk 6.0 MPa",
            "fcd 20 MPa",
            "7 days 20 MPa",
            "Bolts M20",
            "Mortar M10",
        ] {
            assert_eq!(class(none), None, "{none}");
        }
    }

    /// What has two meanings is the lower one, and doubted; with a word of where it comes from it
    /// is not.
    #[test]
    fn two_meanings_are_doubted() {
        assert_eq!(class("C40").as_deref(), Some("C32/40"));
        assert!(is_doubtful("This is C40 concrete"));
        assert!(is_doubtful("C40") && is_doubtful("B35") && is_doubtful("B300"));
        assert!(is_doubtful("LC30/33") && is_doubtful("C30/33"));
        assert!(!is_doubtful("C30/37") && !is_doubtful("Stahlbeton C40") && !is_doubtful("M30"));
        assert_eq!(class("B35").as_deref(), Some("C28/35"));
        assert_eq!(class("M300").as_deref(), Some("18.3"));
    }

    #[test]
    fn cubes_bear_more_than_cylinders_at_every_strength() {
        let mut last = 0.0;
        for cube in 1..200 {
            let cylinder = of_cube(f64::from(cube));
            assert!(cylinder > last && cylinder < f64::from(cube), "{cube}");
            last = cylinder;
        }
        assert_eq!([37.0, 30.0, 50.0].map(of_cube), [30.0, 25.0, 40.0]);
    }
}
