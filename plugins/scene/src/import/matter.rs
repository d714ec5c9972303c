//! What a material is, by its name, category and properties: concrete with its strength, steel,
//! timber, something else, or nothing that is known.

use super::{
    source::Matter,
    strength::{self, Reading},
};
use crate::structure;

/// What a material is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Substance {
    /// Concrete, with its strength where that is said.
    Concrete(Option<Reading>),
    /// Something else that bears.
    Other(structure::Matter),
    /// Steel of bars, which no member is made of alone.
    Bars,
    /// The name says no material.
    Unsaid,
    /// A name that is not known, or that says two things.
    Unknown,
}

/// A material as it was understood.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Understanding {
    pub(super) substance: Substance,
    /// In words, for the record.
    pub(super) taken_for: String,
}

/// A family of materials: words by which it goes, its name, what it is taken for.
struct Family {
    name: &'static str,
    words: &'static [&'static str],
    /// GPa.
    modulus: f32,
    poisson: f32,
    /// kg/m³.
    density: f32,
    /// 1e-6/K.
    expansion: f32,
    /// What it bears in tension, MPa, where it is not brittle.
    strength: Option<f32>,
}

const CONCRETES: [&str; 12] = [
    "concrete",
    "beton",
    "béton",
    "hormig",
    "calcestruzzo",
    "concreto",
    "betão",
    "бетон",
    "混凝土",
    "コンクリート",
    "콘크리트",
    "ortbet",
];
/// Whole words that say concrete where nothing else is said.
const SHORT: [&str; 4] = ["conc", "rc", "reinforced", "armeret"];
/// Words of what has concrete in it, or is no usual one: who knows what it weighs and bears.
const MIXED: [&str; 17] = [
    "composite",
    "filled",
    "encased",
    "verbund",
    "foamed",
    "cellular",
    "schaum",
    "styropor",
    "block",
    "polymer",
    "fiber reinforced",
    "fibre reinforced",
    "carbon",
    "glass",
    "autoclaved",
    "perlite",
    "no-fines",
];

/// Masonry and what is laid like it: E = 1000 f_k of EN 1996-1-1, 3.7.2, with f_k = 5 MPa.
const MASONRY: Family = Family {
    name: "masonry",
    words: &[
        "masonry",
        "mauerwerk",
        "brick",
        "ziegel",
        "cmu",
        "kalksandstein",
        "porenbeton",
        "gasbeton",
        "ytong",
        "aerated",
        "blockwork",
        "hohlblock",
        "aac",
        "adobe",
        "maçonnerie",
        "muratura",
        "mampost",
        "кирпич",
    ],
    modulus: 5.0,
    poisson: 0.2,
    density: 1800.0,
    expansion: 6.0,
    strength: None,
};
/// Ours.
const ASPHALT: Family = Family {
    name: "asphalt",
    words: &["asphalt", "bitum", "tarmac"],
    modulus: 3.0,
    poisson: 0.35,
    density: 2400.0,
    expansion: 25.0,
    strength: None,
};
/// Ours.
const INSULATION: Family = Family {
    name: "insulation",
    words: &[
        "insulation",
        "dämm",
        "daemm",
        "isolier",
        "mineralwolle",
        "glaswolle",
        "steinwolle",
        "wool",
        "eps",
        "xps",
        "polystyr",
        "styropor",
        "isolation",
        "foam",
    ],
    modulus: 0.01,
    poisson: 0.2,
    density: 50.0,
    expansion: 10.0,
    strength: None,
};
/// Gypsum boards: EN 520 asks for a strength only; stiffness and weight ours.
const GYPSUM: Family = Family {
    name: "gypsum board",
    words: &[
        "drywall",
        "gypsum",
        "gips",
        "plasterboard",
        "gyproc",
        "rigips",
        "placo",
        "wallboard",
        "plaster",
        "putz",
        "gkb",
    ],
    modulus: 2.0,
    poisson: 0.2,
    density: 800.0,
    expansion: 15.0,
    strength: None,
};
/// PVC-U; others are softer. Ours.
const PLASTIC: Family = Family {
    name: "plastic",
    words: &[
        "pvc",
        "plastic",
        "kunststoff",
        "polyethyl",
        "polypropyl",
        "polycarbon",
        "acryl",
        "hdpe",
        "plexi",
        "pmma",
        "abs",
        "nylon",
        "vinyl",
        "rubber",
        "gummi",
        "elastomer",
        "neoprene",
    ],
    modulus: 3.0,
    poisson: 0.38,
    density: 1400.0,
    expansion: 70.0,
    strength: None,
};
/// EN 572-1.
const GLASS: Family = Family {
    name: "glass",
    words: &[
        "glass", "glas", "crystal", "kristall", "cristal", "verre", "vetro", "vidrio", "glazing",
    ],
    modulus: 70.0,
    poisson: 0.23,
    density: 2500.0,
    expansion: 9.0,
    strength: None,
};
/// C24 of EN 338; expansion and Poisson's ratio ours.
const TIMBER: Family = Family {
    name: "timber",
    words: &[
        "wood",
        "timber",
        "holz",
        "glulam",
        "bois",
        "lumber",
        "plywood",
        "kvh",
        "bsh",
        "osb",
        "lvl",
        "clt",
        "mdf",
        "spruce",
        "fichte",
        "pine",
        "kiefer",
        "larch",
        "lärche",
        "douglas",
        "oak",
        "eiche",
        "beech",
        "buche",
        "madera",
        "legno",
        "hout",
        "madeira",
        "древес",
        "木",
    ],
    modulus: 11.0,
    poisson: 0.3,
    density: 420.0,
    expansion: 5.0,
    strength: Some(24.0),
};
/// EN 1999-1-1, 3.2.5, and EN AW-6063 T6 of its table 3.2b.
const ALUMINIUM: Family = Family {
    name: "aluminium",
    words: &["alumin", "alu"],
    modulus: 70.0,
    poisson: 0.3,
    density: 2700.0,
    expansion: 23.0,
    strength: Some(160.0),
};
/// S235 of EN 1993-1-1, 3.2.6; copper alike in stiffness to within a factor of two.
const STEEL: Family = Family {
    name: "steel",
    words: &[
        "steel",
        "stahl",
        "acier",
        "acero",
        "acciaio",
        "aço",
        "metal",
        "copper",
        "iron",
        "staal",
        "stål",
        "сталь",
        "钢",
        "鋼",
        "강재",
    ],
    modulus: 210.0,
    poisson: 0.3,
    density: 7850.0,
    expansion: 12.0,
    strength: Some(235.0),
};
/// Ours.
const STONE: Family = Family {
    name: "stone",
    words: &["stone", "granit", "stein", "marble", "marmor", "pierre", "pietra", "basalt"],
    modulus: 40.0,
    poisson: 0.25,
    density: 2600.0,
    expansion: 8.0,
    strength: None,
};
/// Ours.
const SOIL: Family = Family {
    name: "soil",
    words: &["soil", "earth", "boden", "gravel", "kies", "sand", "clay", "schotter", "ballast"],
    modulus: 0.05,
    poisson: 0.3,
    density: 1900.0,
    expansion: 10.0,
    strength: None,
};

/// In the order in which they are asked; those before concrete may have its word in their names.
const BEFORE_CONCRETE: [&Family; 2] = [&MASONRY, &ASPHALT];
const AFTER_CONCRETE: [&Family; 9] =
    [&INSULATION, &GYPSUM, &PLASTIC, &GLASS, &TIMBER, &ALUMINIUM, &STEEL, &STONE, &SOIL];

/// Softwood of EN 338, table 1: class (bending strength, MPa), mean modulus along the grain, GPa.
const SOFTWOOD: [(u32, f32); 12] = [
    (14, 7.0),
    (16, 8.0),
    (18, 9.0),
    (20, 9.5),
    (22, 10.0),
    (24, 11.0),
    (27, 11.5),
    (30, 12.0),
    (35, 13.0),
    (40, 14.0),
    (45, 15.0),
    (50, 16.0),
];
/// Hardwood of EN 338.
const HARDWOOD: [(u32, f32); 10] = [
    (18, 9.5),
    (24, 10.0),
    (27, 10.5),
    (30, 11.0),
    (35, 12.0),
    (40, 13.0),
    (45, 13.5),
    (50, 14.0),
    (60, 17.0),
    (70, 20.0),
];
/// Glued laminated timber of EN 14080, table 5.
const GLULAM: [(u32, f32); 7] =
    [(20, 8.4), (22, 10.5), (24, 11.5), (26, 12.1), (28, 12.6), (30, 13.6), (32, 14.2)];

/// Structural steel by other names than its yield strength: EN 10027-2 numbers, DIN 17100, EN 10025
/// of 1990, ASTM, JIS, GB; yield strength up to 16 mm, MPa.
const STEELS: [(&str, f32); 30] = [
    ("ST33", 185.0),
    ("ST37", 235.0),
    ("ST44", 275.0),
    ("ST52", 355.0),
    ("FE360", 235.0),
    ("FE430", 275.0),
    ("FE510", 355.0),
    ("A36", 250.0),
    ("A572", 345.0),
    ("A992", 345.0),
    ("A588", 345.0),
    ("A500", 315.0),
    ("Q195", 195.0),
    ("Q235", 235.0),
    ("Q345", 345.0),
    ("Q355", 355.0),
    ("Q390", 390.0),
    ("Q420", 420.0),
    ("SS400", 245.0),
    ("SM400", 245.0),
    ("SN400", 235.0),
    ("SM490", 325.0),
    ("SN490", 325.0),
    ("1.0037", 235.0),
    ("1.0038", 235.0),
    ("1.0044", 275.0),
    ("1.0045", 355.0),
    ("1.0570", 355.0),
    ("1.0577", 355.0),
    ("1.4301", 210.0),
];

/// Yield strengths of EN 10025, EN 10210 and EN 10149 in names of the form S355, MPa.
const YIELDS: [u32; 14] = [185, 235, 275, 315, 355, 420, 450, 460, 550, 620, 690, 770, 890, 960];
/// Russian steels, C245 and the like (GOST 27772).
const RUSSIAN: [u32; 10] = [235, 245, 255, 285, 345, 355, 375, 390, 440, 590];

/// Whether a text in small letters has a word: short ones whole, middling ones at a word's begin or
/// end, long ones anywhere.
fn has(text: &str, word: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
    match word.chars().count() {
        _ if !word.is_ascii() => text.contains(word),
        0..=3 => words.any(|w| w.trim_end_matches(|c: char| c.is_ascii_digit()) == word),
        4..=5 => words.any(|w| w.starts_with(word) || w.ends_with(word)),
        _ => text.contains(word),
    }
}

fn is_of(text: &str, family: &Family) -> bool {
    family.words.iter().any(|word| has(text, word))
}

/// A word like `S355J2`, in capitals; a number that follows it, `S 355`, is drawn to it.
fn tokens(name: &str) -> Vec<String> {
    let upper = name.to_uppercase().replace('С', "C");
    let split = upper.split(|c: char| !(c.is_alphanumeric() || c == '.'));
    let words: Vec<&str> = split.filter(|w| !w.is_empty()).collect();
    let mut tokens: Vec<String> = words.iter().map(|w| (*w).to_owned()).collect();
    for pair in words.windows(2) {
        let is_prefix = pair[0].chars().all(char::is_alphabetic) && pair[0].len() <= 3;
        if is_prefix && pair[1].starts_with(|c: char| c.is_ascii_digit()) {
            tokens.push(format!("{}{}", pair[0], pair[1]));
        }
    }
    tokens
}

/// Number after a prefix, and what follows it: `S355J2` is 355 and `J2`.
fn after<'a>(token: &'a str, prefix: &str) -> Option<(u32, &'a str)> {
    let rest = token.strip_prefix(prefix)?;
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    Some((rest.get(..end)?.parse().ok()?, rest.get(end..)?))
}

/// Yield strength of a structural steel that a name says, MPa.
fn steel_grade(name: &str) -> Option<f32> {
    tokens(name).iter().find_map(|token| {
        let by_yield = after(token, "S").filter(|(mpa, _)| YIELDS.contains(mpa));
        let russian = after(token, "C").filter(|(mpa, _)| RUSSIAN.contains(mpa));
        let named = || {
            let of = |known: &&(&str, f32)| {
                let rest = token.strip_prefix(known.0);
                rest.is_some_and(|r| !r.starts_with(|c: char| c.is_ascii_digit()))
            };
            STEELS.iter().find(of).map(|(_, mpa)| *mpa)
        };
        by_yield.or(russian).map(|(mpa, _)| mpa as f32).or_else(named)
    })
}

/// Whether a name is that of a rolled section, as `HEA 300` or `W14X90`. S355 may be a mark.
pub(super) fn is_rolled_steel(name: &str) -> bool {
    const SERIES: [&str; 16] = [
        "HEA", "HEB", "HEM", "HD", "HL", "HP", "IPE", "IPN", "INP", "UPN", "UPE", "UNP", "UB",
        "UC", "RHS", "SHS",
    ];
    // The least of a series is 80 mm high, or 100 by its name.
    let of_series = |token: &String| {
        SERIES.iter().any(|series| after(token, series).is_some_and(|(mm, _)| mm >= 80))
            || after(token, "W").is_some_and(|(inch, rest)| {
                (4..=44).contains(&inch)
                    && after(rest, "X").is_some_and(|(_, rest)| rest.is_empty())
            })
    };
    tokens(name).iter().any(of_series)
}

/// Bending strength, MPa, and modulus, GPa, of timber by a class in its name: `C24`, `GL28h`,
/// `D30`. Alone, without a word of wood, only what can be nothing else.
fn timber_class(name: &str, is_timber: bool) -> Option<(f32, f32)> {
    let found = |table: &[(u32, f32)], mpa: u32| {
        table.iter().find(|(class, _)| *class == mpa).map(|(class, e)| (*class as f32, *e))
    };
    tokens(name).iter().find_map(|token| {
        if let Some((mpa, rest)) = after(token, "GL")
            && matches!(rest, "" | "H" | "C" | "K")
        {
            return found(&GLULAM, mpa);
        }
        let (softwood, hardwood) = (after(token, "C"), after(token, "D"));
        if let Some((mpa, rest)) = softwood
            && rest.is_empty()
            && (is_timber || [14, 18, 22, 24, 27].contains(&mpa))
        {
            return found(&SOFTWOOD, mpa);
        }
        hardwood.filter(|_| is_timber).and_then(|(mpa, _)| found(&HARDWOOD, mpa))
    })
}

/// What speaks against what a name alone was taken for: C24 and C27 are classes of concrete, too.
pub(super) fn doubt(material: &Matter) -> Option<String> {
    let name = material.name.trim();
    let low = name.to_lowercase();
    let is_light = ["lightweight", "light weight", "leichtbeton"].iter().any(|w| low.contains(w));
    if is_light && !strength::of_text(name).is_some_and(|reading| reading.is_lightweight) {
        return Some(
            "lightweight concrete without its class (LC30/33): normal concrete is taken".into(),
        );
    }
    let is_alone = name.strip_prefix(['C', 'c']).is_some_and(|n| n.parse::<u32>().is_ok());
    (is_alone && timber_class(name, false).is_some() && material.category.trim().is_empty()).then(
        || {
            format!(
                "{name} is a class of timber (EN 338), and in some countries one of concrete: timber is taken"
            )
        },
    )
}

/// Whether a name is one that programs give where nobody chose a material.
fn is_unsaid(name: &str) -> bool {
    const NAMES: [&str; 18] = [
        "default",
        "unnamed",
        "none",
        "undefined",
        "notdefined",
        "unknown",
        "by",
        "category",
        "material",
        "standard",
        "unbenannt",
        "keine",
        "null",
        "object",
        "layer",
        "wall",
        "n",
        "a",
    ];
    let low = name.to_lowercase();
    let mut words = low.split(|c: char| !c.is_alphabetic()).filter(|w| !w.is_empty());
    words.all(|word| NAMES.contains(&word)) && strength::of_text(name).is_none()
}

/// What a material is. `is_named`: whether its format names materials, rather than colours.
pub(super) fn understand(material: &Matter, is_named: bool) -> Understanding {
    let text = format!("{} {}", material.name, material.category).to_lowercase();
    let substance = substance(material, &text, is_named);
    let taken_for = match &substance {
        Substance::Concrete(None) => "concrete, its strength not said".into(),
        Substance::Concrete(Some(reading)) => format!("concrete: {}", reading.meaning),
        Substance::Other(matter) => described(matter, &text),
        Substance::Bars => "steel of bars".into(),
        Substance::Unsaid => "no material: its name says none".into(),
        Substance::Unknown => "unknown".into(),
    };
    Understanding { substance, taken_for }
}

fn described(matter: &structure::Matter, text: &str) -> String {
    let all = BEFORE_CONCRETE.iter().chain(&AFTER_CONCRETE);
    let near = |f: &&&Family| (f.density - matter.density_kg_m3).abs() < 0.5;
    let name = all.clone().find(|f| is_of(text, f) && near(f)).or_else(|| all.clone().find(near));
    let strength = matter.strength_mpa.map_or(String::new(), |mpa| format!(", {mpa} MPa"));
    format!(
        "{}{strength}; E {} GPa, {} kg/m³",
        name.map_or("no concrete", |f| f.name),
        matter.modulus_gpa,
        matter.density_kg_m3
    )
}

fn substance(material: &Matter, text: &str, is_named: bool) -> Substance {
    let of = |family: &Family| Substance::Other(taken(material, family, text));
    if let Some(family) = BEFORE_CONCRETE.into_iter().find(|f| is_of(text, f)) {
        return of(family);
    }
    let whole = |word: &&str| text.split(|c: char| !c.is_alphanumeric()).any(|w| w == *word);
    let others = || AFTER_CONCRETE.into_iter().filter(|f| is_of(text, f));
    let is_named_so = CONCRETES.iter().any(|word| has(text, word));
    let is_concrete = is_named_so || SHORT.iter().any(whole) && others().next().is_none();
    let is_of_bars = has(text, "betonstahl") || has(text, "bewehrung");
    let names = [material.name.as_str(), material.category.as_str()];
    let by_name = || names.into_iter().find_map(strength::of_text);
    if is_of_bars && names.into_iter().any(|name| super::grade::grade_in(name).is_some()) {
        return Substance::Bars;
    }
    if is_concrete {
        // Steel in concrete is what its bars are, unless it is of sections; of wood and concrete,
        // PVC or foam, who knows.
        let clash = |f: &Family| {
            [TIMBER.name, PLASTIC.name, GYPSUM.name, INSULATION.name, SOIL.name].contains(&f.name)
        };
        let is_mixed = MIXED.iter().any(|word| text.contains(word));
        let has_section = steel_grade(&material.name).is_some();
        // What the material's own name says is more than its category.
        let own = material.name.to_lowercase();
        if has_section && is_of(&own, &STEEL) && !CONCRETES.iter().any(|word| has(&own, word)) {
            return of(&STEEL);
        }
        let pair = || names.into_iter().find_map(|name| strength::pair(&name.to_uppercase()));
        return match pair().filter(|pair| pair.is_lightweight) {
            Some(light) => Substance::Concrete(Some(light)),
            None if is_mixed || has_section || others().any(clash) => Substance::Unknown,
            None => Substance::Concrete(by_name()),
        };
    }
    if let Some(family) = others().next() {
        return of(family);
    }
    if steel_grade(&material.name).is_some() {
        return of(&STEEL);
    }
    let pair = |name: &str| strength::pair(&name.to_uppercase()).is_some();
    if timber_class(&material.name, false).is_some() && !names.into_iter().any(pair) {
        return of(&TIMBER);
    }
    // Of these a number says no concrete.
    const NO_CONCRETE: [&str; 10] = [
        "grout", "mortar", "mörtel", "bolt", "screw", "anchor", "screed", "estrich", "soil",
        "gravel",
    ];
    if NO_CONCRETE.iter().any(|word| text.contains(word)) {
        return Substance::Unknown;
    }
    if let Some(reading) = by_name() {
        return Substance::Concrete(Some(reading));
    }
    if names.into_iter().any(|name| super::grade::grade_in(name).is_some()) {
        return Substance::Bars;
    }
    if !is_named || is_unsaid(&material.name) { Substance::Unsaid } else { Substance::Unknown }
}

fn taken(material: &Matter, family: &Family, text: &str) -> structure::Matter {
    let [name, category] = [&material.name, &material.category];
    let mut matter = structure::Matter {
        name: if name.trim().is_empty() { category.clone() } else { name.clone() },
        modulus_gpa: family.modulus,
        poisson: family.poisson,
        density_kg_m3: family.density,
        expansion_1e6_k: family.expansion,
        strength_mpa: family.strength,
    };
    if family.name == TIMBER.name
        && let Some((mpa, modulus)) = timber_class(name, true)
    {
        (matter.strength_mpa, matter.modulus_gpa) = (Some(mpa), modulus);
    }
    if family.name == STEEL.name
        && let Some(mpa) = steel_grade(name)
    {
        matter.strength_mpa = Some(mpa);
    }
    if family.name == MASONRY.name && (has(text, "porenbeton") || has(text, "aerated")) {
        // EN 771-4: some 600 kg/m³ with f_k = 2 MPa.
        (matter.modulus_gpa, matter.density_kg_m3) = (2.0, 600.0);
    }
    matter
}

/// Lightweight concrete of a strength: density class 1.8, E_lcm = E_cm (ρ/2200)² (EN 1992-1-1,
/// 11.3.2), the density being assumed.
pub(super) fn lightweight(name: &str, fck: f64) -> structure::Matter {
    let modulus = 22.0 * ((fck + 8.0) / 10.0).powf(0.3) * (1800.0_f64 / 2200.0).powi(2);
    structure::Matter {
        name: name.to_owned(),
        modulus_gpa: ((10.0 * modulus).round() / 10.0) as f32,
        poisson: 0.2,
        density_kg_m3: 1900.0,
        expansion_1e6_k: 8.0,
        strength_mpa: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Substance {
        understand(&Matter { name: name.into(), ..Matter::default() }, true).substance
    }

    fn strength_of(name: &str) -> Option<f32> {
        match of(name) {
            Substance::Other(matter) => matter.strength_mpa,
            other => panic!("{name}: {other:?}"),
        }
    }

    #[test]
    fn steel_goes_by_its_grades_alone() {
        for (name, mpa) in [
            ("S355J2", 355.0),
            ("S235JR", 235.0),
            ("STEEL/S355J2", 355.0),
            ("STEEL_S355", 355.0),
            ("S 460 NL", 460.0),
            ("St37-2", 235.0),
            ("St 52-3", 355.0),
            ("A992", 345.0),
            ("Q345B", 345.0),
            ("SS400", 245.0),
            ("1.0577", 355.0),
            ("С245", 245.0),
            ("Steel", 235.0),
            ("Cold formed C20 steel section", 235.0),
        ] {
            assert_eq!(strength_of(name), Some(mpa), "{name}");
        }
    }

    #[test]
    fn timber_goes_by_its_classes() {
        for (name, mpa) in [
            ("C24", 24.0),
            ("GL24h", 24.0),
            ("GL 28c", 28.0),
            ("Wood C30", 30.0),
            ("Eiche D30", 30.0),
            ("KVH C24", 24.0),
            ("wood-generic", 24.0),
            ("Glulam GL28h", 28.0),
        ] {
            assert_eq!(strength_of(name), Some(mpa), "{name}");
        }
        assert_eq!(of("D30"), Substance::Unknown);
    }

    #[test]
    fn what_is_no_concrete_is_not_made_concrete() {
        let density = |name: &str| match of(name) {
            Substance::Other(matter) => matter.density_kg_m3,
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(density("Drywall - metal stud"), GYPSUM.density);
        assert_eq!(density("Crystal"), GLASS.density);
        assert_eq!(density("PVC"), PLASTIC.density);
        assert_eq!(density("Concrete Masonry Units"), MASONRY.density);
        assert_eq!(density("Porenbeton PP4"), 600.0);
        assert_eq!(density("Asphaltbeton"), ASPHALT.density);
        assert_eq!(density("stone_granite_masonry"), MASONRY.density);
        assert_eq!(density("Wärmedämmung - hart"), INSULATION.density);
        assert_eq!(density("Reinforced earth"), SOIL.density);
        for steel in ["Reinforced steel S355", "Concealed steel S355"] {
            assert_eq!(density(steel), STEEL.density, "{steel}");
        }
        for unknown in [
            "Concrete filled steel tube",
            "Steel-concrete composite",
            "Steel S355 concrete encased",
            "Styroporbeton",
            "Foamed concrete",
            "Mortar M10",
            "Bolts M20",
        ] {
            assert_eq!(of(unknown), Substance::Unknown, "{unknown}");
        }
        assert_eq!(of("Betonstahl B500B"), Substance::Bars);
        assert!(matches!(of("C24/30"), Substance::Concrete(_)));
        for unknown in ["Solid 397409098", "XK-12", "Holz-Beton-Verbund", "PVC concrete"] {
            assert_eq!(of(unknown), Substance::Unknown, "{unknown}");
        }
        assert_eq!([of("Default"), of(""), of("Material.001")], [const { Substance::Unsaid }; 3]);
        assert_eq!(of("B500B"), Substance::Bars);
    }

    #[test]
    fn concrete_is_concrete() {
        for name in [
            "Stahlbeton - Ortbeton",
            "steel-reinforced concrete",
            "concrete_reinforced_in-situ",
            "Leichtbeton 102890359",
            "C30/37",
            "Reinforced",
            "钢筋混凝土",
            "M30",
            "Fc24",
        ] {
            assert!(matches!(of(name), Substance::Concrete(_)), "{name}: {:?}", of(name));
        }
        let colour = Matter { name: "Grey paint".into(), ..Matter::default() };
        assert_eq!(understand(&colour, false).substance, Substance::Unsaid);
    }
}
