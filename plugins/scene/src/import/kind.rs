//! What an element is: by its class, then its property sets, then its name, then its shape.

use crate::MemberKind;

use super::{
    shape::{Box3, Tube},
    source::Element,
};

/// What an element is, and by which word that was told.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Verdict {
    /// A member.
    Member(MemberKind, By),
    /// A bar, a stirrup, a tendon: part of the member around it.
    Steel(MemberKind),
    /// It bears nothing, or its class and name do not say that it does.
    Scenery(Why),
}

/// Why an element is no member.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Why {
    /// Its class bears nothing: windows, railings, terrain.
    Class,
    /// Its name or its user says so: signs, backfill, formwork.
    Name,
    /// A bearing: what joins members, and is none.
    Bearing,
    /// Lean concrete below footings: it carries nothing.
    Blinding,
    /// Asphalt, wearing courses, kerb stones: weight that others carry.
    Surfacing,
    /// It may bear, and nothing says whether it does.
    Unknown,
}

/// What told the kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum By {
    User,
    Model,
    Class,
    Properties,
    Name,
    Shape,
}

impl By {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::User => "--kind",
            Self::Model => "what the model itself says",
            Self::Class => "class",
            Self::Properties => "property sets",
            Self::Name => "name",
            Self::Shape => "shape",
        }
    }
}

/// Classes that are one kind (IFC2X3 to IFC4X3), without `StandardCase` and `ElementedCase`.
const CLASSES: [(&str, MemberKind); 15] = [
    ("IfcColumn", MemberKind::Column),
    ("IfcBeam", MemberKind::Beam),
    ("IfcSlab", MemberKind::Slab),
    ("IfcPlate", MemberKind::Slab),
    ("IfcWall", MemberKind::Wall),
    ("IfcFooting", MemberKind::Footing),
    ("IfcPile", MemberKind::Footing),
    ("IfcDeepFoundation", MemberKind::Footing),
    ("IfcCaissonFoundation", MemberKind::Footing),
    ("IfcReinforcingBar", MemberKind::Bar),
    ("IfcReinforcingMesh", MemberKind::Bar),
    ("IfcTendon", MemberKind::Tendon),
    ("IfcTendonConduit", MemberKind::Pipe),
    ("IfcPipeSegment", MemberKind::Pipe),
    ("IfcPipeFitting", MemberKind::Pipe),
];

/// Classes that bear, whatever they are.
const BEARING: [&str; 7] = [
    "IfcMember",
    "IfcBuildingElementPart",
    "IfcElementAssembly",
    "IfcCivilElement",
    "IfcBuiltElement",
    "IfcTunnelElement",
    "IfcUndergroundExcavation",
];

/// Classes of which only properties or a name can tell that they bear: what has no class, and parts
/// of a structure in space, which have bodies of their own in some models.
const PERHAPS: [&str; 8] = [
    "",
    "IfcBuildingElementProxy",
    "IfcProxy",
    "IfcBridgePart",
    "IfcTunnelPart",
    "IfcFacilityPart",
    "IfcFacilityPartCommon",
    "IfcMarinePart",
];

/// Classes that bear as a rule, and of which no kind of member is known.
const ASKED: [&str; 6] =
    ["IfcRoof", "IfcStair", "IfcStairFlight", "IfcRamp", "IfcRampFlight", "IfcChimney"];

/// Classes that drawings of decks, slabs and piers have ended in: asked about where a name says so.
const DRAWN_AS: [&str; 8] = [
    "IfcCovering",
    "IfcDiscreteAccessory",
    "IfcFlowSegment",
    "IfcFurnishingElement",
    "IfcFurniture",
    "IfcGeographicElement",
    "IfcShadingDevice",
    "IfcTransportElement",
];
/// Classes that lie on others, or on the ground.
const SURFACING: [&str; 3] = ["IfcPavement", "IfcCourse", "IfcKerb"];

/// Words of predefined types (of IfcMember, parts of bridges and tunnels, IfcReinforcingBar).
const PREDEFINED: [(&str, MemberKind); 14] = [
    ("POST", MemberKind::Column),
    ("STUD", MemberKind::Column),
    ("PIER", MemberKind::Column),
    ("PYLON", MemberKind::Column),
    ("PIERSTEM", MemberKind::Column),
    ("GIRDER", MemberKind::Beam),
    ("RAFTER", MemberKind::Beam),
    ("PURLIN", MemberKind::Beam),
    ("STRINGER", MemberKind::Beam),
    ("DECK", MemberKind::Slab),
    ("DECK_SEGMENT", MemberKind::Slab),
    ("ABUTMENT", MemberKind::Wall),
    ("FOUNDATION", MemberKind::Footing),
    ("LINING", MemberKind::Lining),
];

/// Property sets that only one kind has.
const SETS: [(&str, MemberKind); 10] = [
    ("Pset_ColumnCommon", MemberKind::Column),
    ("Pset_BeamCommon", MemberKind::Beam),
    ("Pset_SlabCommon", MemberKind::Slab),
    ("Pset_WallCommon", MemberKind::Wall),
    ("Pset_FootingCommon", MemberKind::Footing),
    ("Pset_PileCommon", MemberKind::Footing),
    ("Pset_PlateCommon", MemberKind::Slab),
    ("Pset_PrecastConcreteElementGeneral", MemberKind::Other),
    ("Pset_ConcreteElementGeneral", MemberKind::Other),
    ("Pset_TunnelLiningCommon", MemberKind::Lining),
];

/// What a word in a name says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Is(MemberKind),
    /// What spans: a slab, or a beam where it is narrow for its depth.
    Spans,
}

/// Beginnings or ends of words in names, in English, German, French, Italian, Spanish and Dutch,
/// without accents; ä is ae or a. What stands further up is the more special: a pile cap is no pile,
/// a wall footing no wall.
const NAMES: [(Word, &[&str]); 15] = [
    (
        Word::Is(MemberKind::Footing),
        &[
            "footing",
            "foundation",
            "fundament",
            "fundering",
            "fondation",
            "fondazione",
            "cimentacion",
            "zapata",
            "encepado",
            "semelle",
            "radier",
            "plinto",
            "pilecap",
            "pfahlkopfplatte",
            "raft",
        ],
    ),
    (
        Word::Is(MemberKind::Beam),
        &[
            "pierhead",
            "crosshead",
            "capbeam",
            "bentcap",
            "piercap",
            "chevetre",
            "pulvino",
            "pfeilerkopf",
            "auflagerbank",
            "cabezal",
            "columncap",
            "columnhead",
            "hammerhead",
        ],
    ),
    (
        Word::Is(MemberKind::Footing),
        &["pile", "pfahl", "bohrpfahl", "pieu", "pilote", "palo", "pali"],
    ),
    (Word::Is(MemberKind::Segment), &["tuebbing", "tubbing", "voussoir", "segment", "dovela"]),
    (
        Word::Is(MemberKind::Lining),
        &["lining", "innenschale", "aussenschale", "tunnelschale", "revestimiento", "tunnel"],
    ),
    (Word::Is(MemberKind::Tendon), &["tendon", "spannglied"]),
    (Word::Is(MemberKind::Bar), &["rebar", "stirrup", "buegel", "bugel"]),
    (Word::Is(MemberKind::Pipe), &["pipe", "rohr"]),
    (
        Word::Is(MemberKind::Wall),
        &[
            "abutment",
            "widerlager",
            "landhoofd",
            "culee",
            "spalla",
            "estribo",
            "wingwall",
            "headwall",
            "fluegelwand",
            "flugelwand",
            "kammerwand",
        ],
    ),
    (
        Word::Is(MemberKind::Column),
        &[
            "column", "col", "pier", "pierstem", "pillar", "pylon", "stuetze", "stutze", "pfeiler",
            "poteau", "pilar", "pilastro", "pilastri", "pila", "kolom", "pijler",
        ],
    ),
    (Word::Is(MemberKind::Slab), &["fahrbahnplatte", "brueckenplatte", "kragplatte"]),
    (
        Word::Is(MemberKind::Beam),
        &[
            "beam",
            "crossbeam",
            "girder",
            "lintel",
            "rafter",
            "diaphragm",
            "traeger",
            "trager",
            "balken",
            "unterzug",
            "riegel",
            "hohlkasten",
            "kappe",
            "gesims",
            "poutre",
            "entretoise",
            "longeron",
            "longrine",
            "viga",
            "riostra",
            "dintel",
            "diafragma",
            "trave",
            "travi",
            "traverso",
            "cordolo",
            "ligger",
            "kerb",
            "curb",
        ],
    ),
    (
        Word::Is(MemberKind::Slab),
        &[
            "slab",
            "decke",
            "bodenplatte",
            "dalle",
            "hourdis",
            "losa",
            "forjado",
            "soletta",
            "solaio",
            "vloer",
        ],
    ),
    (
        Word::Spans,
        &["ueberbau", "uberbau", "superstructure", "deck", "tablier", "tablero", "impalcato"],
    ),
    (
        Word::Is(MemberKind::Wall),
        &["wall", "retainingwall", "wand", "mauer", "stuetzwand", "voile", "muro"],
    ),
];

/// Words that say that a thing bears nothing, whatever stands beside them.
const IDLE: [(Why, &[&str]); 4] = [
    (
        Why::Blinding,
        &[
            "blinding",
            "unterbeton",
            "sauberkeitsschicht",
            "magerbeton",
            "magrone",
            "proprete",
            "limpieza",
            "leanconcrete",
            "werkvloer",
        ],
    ),
    (
        Why::Surfacing,
        &[
            "asphalt",
            "asphaltbelag",
            "gussasphalt",
            "fahrbahnbelag",
            "belag",
            "surfacing",
            "pavement",
            "wearing",
            "enrobe",
            "enrobes",
            "pavimentazione",
            "conglomerato",
            "bitumen",
            "schutzschicht",
            "deckschicht",
            "tragschicht",
            "binderschicht",
            "schotter",
            "ballast",
        ],
    ),
    (
        Why::Bearing,
        &[
            "bearing",
            "bearings",
            "lager",
            "elastomerlager",
            "kalottenlager",
            "topflager",
            "gleitlager",
            "festlager",
            "brueckenlager",
            "verformungslager",
            "neopreno",
            "appareil",
            "appoggio",
            "apoyo",
        ],
    ),
    (
        Why::Name,
        &[
            "sign",
            "railing",
            "handrail",
            "guardrail",
            "gelaender",
            "gelander",
            "schutzplanke",
            "leitplanke",
            "filler",
            "backfill",
            "hinterfuellung",
            "hinterfullung",
            "terrain",
            "gelaende",
            "baugrube",
            "boeschung",
            "light",
            "lamp",
            "leuchte",
            "paper",
            "cladding",
            "curtain",
            "formwork",
            "schalung",
            "wallpaper",
            "entwaesserung",
        ],
    ),
];

/// What an element is. `tube`: its shape, if it is a ring.
pub(super) fn kind(element: &Element, solid: Option<&Box3>, tube: Option<&Tube>) -> Verdict {
    if let Some(said) = &element.said {
        return match said.kind {
            kind @ (MemberKind::Bar | MemberKind::Tendon) => Verdict::Steel(kind),
            kind => Verdict::Member(kind, By::Model),
        };
    }
    let class = element.class.trim_end_matches("StandardCase").trim_end_matches("ElementedCase");
    let idle = idle(element);
    if let Some((_, kind)) = CLASSES.iter().find(|(known, _)| *known == class) {
        return match (kind, idle) {
            (MemberKind::Bar | MemberKind::Tendon, _) => Verdict::Steel(*kind),
            // A layer that a tool knows only as a slab or a footing.
            (
                MemberKind::Slab | MemberKind::Footing,
                Some(why @ (Why::Blinding | Why::Surfacing)),
            ) => Verdict::Scenery(why),
            (kind, _) => Verdict::Member(*kind, By::Class),
        };
    }
    if SURFACING.contains(&class) {
        return Verdict::Scenery(Why::Surfacing);
    }
    let bears = BEARING.contains(&class);
    if !bears && !PERHAPS.contains(&class) {
        // A slab that was drawn as furniture is asked about.
        let is_called = || by_name(element, false, solid).is_some();
        let is_asked =
            ASKED.contains(&class) || DRAWN_AS.contains(&class) && idle.is_none() && is_called();
        return Verdict::Scenery(if is_asked { Why::Unknown } else { Why::Class });
    }
    if let Some(kind) = by_properties(element) {
        return Verdict::Member(kind, By::Properties);
    }
    if let (Some(why), false) = (idle, bears && idle == Some(Why::Name)) {
        return Verdict::Scenery(why);
    }
    match by_name(element, bears, solid) {
        Some(kind @ (MemberKind::Bar | MemberKind::Tendon)) => return Verdict::Steel(kind),
        Some(kind) => return Verdict::Member(kind, By::Name),
        None => {}
    }
    match by_shape(solid, tube) {
        Some(kind) if bears || kind == MemberKind::Lining => Verdict::Member(kind, By::Shape),
        _ if bears && !element.surface.is_empty() => Verdict::Member(MemberKind::Other, By::Class),
        _ if idle.is_some() => Verdict::Scenery(Why::Name),
        _ => Verdict::Scenery(Why::Unknown),
    }
}

/// A bearing is no larger, m³: what is, and is called so, stands below one.
const LARGEST_BEARING: f64 = 1.0;

/// Why its own names, or its material, say that it bears nothing.
fn idle(element: &Element) -> Option<Why> {
    let own: Vec<String> =
        std::iter::once(&element.name).chain(&element.words).flat_map(|n| words(n)).collect();
    let materials: Vec<Vec<String>> =
        element.materials.iter().map(|m| words(&m.name).collect()).collect();
    IDLE.iter().find_map(|(why, all)| {
        // A Widerlager is no Lager.
        let is_one = |word: &str, w: &str| {
            word == w
                || word.strip_suffix(['s', 'n', 'e']) == Some(w)
                || (*why != Why::Bearing && w.len() >= 5 && word.ends_with(w))
        };
        let said = |words: &[String]| words.iter().any(|word| all.iter().any(|w| is_one(word, w)));
        // A slab with asphalt on it is a slab.
        let is_all = !materials.is_empty() && materials.iter().all(|words| said(words));
        let is_said = said(&own) || (*why == Why::Surfacing && is_all);
        let is_small = *why != Why::Bearing || element.surface.volume() < LARGEST_BEARING;
        (is_said && is_small).then_some(*why)
    })
}

/// Whether it lies on the ground over its length, by its predefined type or name: slabs on fill
/// behind an abutment and on the soil under a house.
pub(super) fn lies_on_ground(element: &Element) -> bool {
    const NAMES: [&str; 6] =
        ["approach", "schleppplatte", "bodenplatte", "sohlplatte", "baseslab", "groundslab"];
    let mut own = std::iter::once(&element.name).chain(&element.words).flat_map(|n| words(n));
    matches!(element.predefined.as_str(), "BASESLAB" | "APPROACH_SLAB" | "TRACKSLAB")
        || own.any(|word| NAMES.iter().any(|name| word.starts_with(name)))
}

fn by_properties(element: &Element) -> Option<MemberKind> {
    let found = SETS.iter().find(|(set, _)| element.properties.contains_key(*set));
    found.map(|(_, kind)| *kind).filter(|kind| *kind != MemberKind::Other)
}

/// By its own name, its type's, its predefined type, and, of what surely bears, by the names of
/// what it is part of.
fn by_name(element: &Element, bears: bool, solid: Option<&Box3>) -> Option<MemberKind> {
    let own = || std::iter::once(&element.name).chain(&element.words);
    if idle(element).is_some() {
        return None;
    }
    let predefined = PREDEFINED.iter().find(|(word, _)| *word == element.predefined);
    let told = |name: &String| {
        let words: Vec<String> = words(name).collect();
        let joined = words.windows(2).map(|w| w.concat()).collect::<Vec<_>>();
        let whole = |start: &&str| joined.iter().any(|word| word == start);
        let known = |starts: &&[&str]| {
            starts.iter().any(|s| whole(s) || words.iter().any(|word| begins(word, s)))
        };
        // A segment of an arch or a deck is none of a ring.
        let is_meant = |word: &Word| *word != Word::Is(MemberKind::Segment) || is_bent(element);
        let found = NAMES.iter().find(|(word, starts)| known(starts) && is_meant(word));
        found.map(|(word, _)| match word {
            Word::Is(kind) => *kind,
            Word::Spans => spanning(solid),
        })
    };
    // Of the segments of an arch only their shape tells more.
    let is_segment = own().any(|name| words(name).any(|word| begins(&word, "segment")));
    let above = || element.above.iter().take(2).map(|a| &a.name).find_map(told);
    predefined
        .map(|(_, kind)| *kind)
        .or_else(|| own().find_map(told))
        .or_else(|| if bears && !is_segment { above() } else { None })
}

/// What spans is a slab from five times its depth in width on (EN 1992-1-1, 5.3.1), else a beam.
fn spanning(solid: Option<&Box3>) -> MemberKind {
    let Some(solid) = solid else { return MemberKind::Slab };
    let up = (0..3).max_by(|&a, &b| solid.unit[a].y.abs().total_cmp(&solid.unit[b].y.abs()));
    let up = up.unwrap_or(1);
    let width = solid.size[(up + 1) % 3].min(solid.size[(up + 2) % 3]);
    if width < 5.0 * solid.size[up] { MemberKind::Beam } else { MemberKind::Slab }
}

/// Words of a name, in small letters without accents: `COL_1`, `PierStem 2`, `Pfeiler-3`.
fn words(name: &str) -> impl Iterator<Item = String> {
    let plain: String =
        name.chars().flat_map(char::to_lowercase).flat_map(without_accent).collect();
    let words: Vec<String> = plain
        .split(|c: char| !c.is_alphabetic())
        .filter(|w| !w.is_empty())
        .map(str::to_owned)
        .collect();
    words.into_iter()
}

/// ä is ae, as where a keyboard has none; accents go, also those that stand after their letter.
fn without_accent(letter: char) -> impl Iterator<Item = char> {
    let plain = match letter {
        'ä' | 'æ' => "ae",
        'ö' | 'ø' | 'œ' => "oe",
        'ü' | '\u{308}' => {
            if letter == 'ü' {
                "ue"
            } else {
                "e"
            }
        }
        'ß' => "ss",
        'à' | 'á' | 'â' | 'ã' | 'å' => "a",
        'è' | 'é' | 'ê' | 'ë' => "e",
        'ì' | 'í' | 'î' | 'ï' => "i",
        'ò' | 'ó' | 'ô' | 'õ' => "o",
        'ù' | 'ú' | 'û' => "u",
        'ç' => "c",
        'ñ' => "n",
        '\u{300}'..='\u{36f}' => "",
        _ => return [Some(letter), None].into_iter().flatten(),
    };
    let mut letters = plain.chars();
    [letters.next(), letters.next()].into_iter().flatten()
}

/// Whether a word is another or its plural or compound: short words must be whole.
fn begins(word: &str, start: &str) -> bool {
    let stem = word.strip_suffix(['s', 'n', 'e']).unwrap_or(word);
    let is_long = start.chars().count() >= 5;
    word == start
        || stem == start
        || (is_long && (word.starts_with(start) || word.ends_with(start) || stem.ends_with(start)))
}

/// Whether something above it is round about a tunnel, so that a segment is one of a ring.
fn is_bent(element: &Element) -> bool {
    let round = |name: &str| {
        words(name).any(|w| ["tunnel", "ring", "lining", "tuebbing"].iter().any(|r| w.contains(r)))
    };
    round(&element.name)
        || element.words.iter().any(|w| round(w))
        || element.above.iter().any(|a| round(&a.name) || a.class.contains("Tunnel"))
}

/// What its shape is like, where nothing else tells its kind: for who is asked.
pub(super) fn likely(solid: Option<&Box3>) -> MemberKind {
    by_shape(solid, None).unwrap_or(MemberKind::Other)
}

/// By the measures of its box: a tube that one can walk through, something upright and slender,
/// lying and slender, flat and level, flat and upright.
fn by_shape(solid: Option<&Box3>, tube: Option<&Tube>) -> Option<MemberKind> {
    /// Least radius of what is a tunnel rather than a pipe, m.
    const WALKED: f64 = 0.9;
    /// So many times longer than the next measure is slender.
    const SLENDER: f64 = 2.5;
    if let Some(tube) = tube {
        return Some(if tube.inner >= WALKED { MemberKind::Lining } else { MemberKind::Pipe });
    }
    let solid = solid?;
    let mut sizes: Vec<(f64, f64)> =
        (0..3).map(|i| (solid.size[i], solid.unit[i].y.abs())).collect();
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [(thin, thin_up), (middle, _), (long, long_up)] = sizes[..] else { return None };
    if long > SLENDER * middle {
        return Some(if long_up > 0.7 { MemberKind::Column } else { MemberKind::Beam });
    }
    if middle > SLENDER * thin {
        return Some(if thin_up > 0.7 { MemberKind::Slab } else { MemberKind::Wall });
    }
    None
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn named(class: &str, name: &str) -> Element {
        Element { class: class.into(), name: name.into(), ..Element::default() }
    }

    fn told(element: &Element) -> Verdict {
        kind(element, None, None)
    }

    #[test]
    fn some_slabs_lie_on_the_ground() {
        let slab = |name| named("IfcSlab", name);
        assert!(lies_on_ground(&slab("Bridge road - Approach slab #2")));
        assert!(lies_on_ground(&Element { predefined: "BASESLAB".into(), ..slab("level 0") }));
        assert!(!lies_on_ground(&slab("bridge deck")));
    }

    #[test]
    fn the_class_comes_before_properties_and_these_before_the_name() {
        let mut column = named("IfcColumn", "wall beam");
        column.properties.insert("Pset_SlabCommon".into(), Default::default());
        assert_eq!(told(&column), Verdict::Member(MemberKind::Column, By::Class));
        let standard = named("IfcWallStandardCase", "column");
        assert_eq!(told(&standard), Verdict::Member(MemberKind::Wall, By::Class));
        let mut member = named("IfcMember", "column 3");
        assert_eq!(told(&member), Verdict::Member(MemberKind::Column, By::Name));
        member.properties.insert("Pset_BeamCommon".into(), Default::default());
        assert_eq!(told(&member), Verdict::Member(MemberKind::Beam, By::Properties));
    }

    #[test]
    fn names_are_read_as_words() {
        let name = |name: &str| match told(&named("", name)) {
            Verdict::Member(kind, By::Name) => Some(kind),
            _ => None,
        };
        assert_eq!(name("COL_12"), Some(MemberKind::Column));
        assert_eq!(name("Brückenpfeiler 3"), Some(MemberKind::Column));
        assert_eq!(name("wall footing"), Some(MemberKind::Footing));
        assert_eq!(name("Stahlbetondecke EG"), Some(MemberKind::Slab));
        assert_eq!(name("name sign of the wall"), None);
        assert_eq!(name("color swatch"), None);
        assert_eq!(name("tunnel segment 4"), Some(MemberKind::Segment));
        assert_eq!(told(&named("IfcRailing", "beam")), Verdict::Scenery(Why::Class));
        for (class, name, why) in [
            ("IfcFurnishingElement", "Deck slab", Why::Unknown),
            ("IfcShadingDevice", "Slab", Why::Unknown),
            ("IfcFlowSegment", "Pier 2", Why::Unknown),
            ("IfcFurniture", "chair", Why::Class),
        ] {
            assert_eq!(told(&named(class, name)), Verdict::Scenery(why), "{class} {name}");
        }
        assert_eq!(told(&named("IfcTendon", "x")), Verdict::Steel(MemberKind::Tendon));
    }

    /// Usual names of the parts of bridges, with and without umlauts and accents.
    #[test]
    fn parts_of_bridges_are_known_by_their_usual_names() {
        use MemberKind::{Beam, Column, Footing, Slab, Wall};
        let name = |name: &str| told(&named("IfcBuildingElementProxy", name));
        let members = [
            (
                Slab,
                "Überbau|Ueberbau|UBERBAU|U\u{308}berbau Feld 2|Superstructure|Bridge deck:1:42",
            ),
            (Slab, "Tablier|Tablero|Impalcato|Fahrbahnplatte|Decke|Soletta|Hourdis"),
            (
                Beam,
                "Längsträger 1|Laengstraeger|Langstrager|Querträger|cross girder|Girder 1:Girder 1:1667",
            ),
            (Beam, "Kappe Nord|Randkappen|Kerb|Pier cap 3|Cross-head|Chevêtre|Pulvino|diaphragm 2"),
            (Beam, "Entretoise|Traverso|Viga 3|Poutre|Riostra|Hohlkasten|Crossbeam"),
            (Column, "Stütze 4|Stuetze|Stutze|Brückenpfeiler|Pier 2|Pila 1|Pylon|Poteau|Pilastro"),
            (Wall, "Widerlager Achse 10|Abutment A|Culée C0|Spalla|Estribo|Flügelwand|Stützmauer"),
            (Footing, "Fundament|Pile cap|Semelle|Zapata|Fondazione|Cimentación|Plinto|Encepado"),
        ];
        for (kind, names) in members {
            for one in names.split('|') {
                assert_eq!(name(one), Verdict::Member(kind, By::Name), "{one}");
            }
        }
        let idle = [
            (Why::Bearing, "Lager|Elastomerlager 3|Bearing B2|Appareil d'appui|Lager Achse 20"),
            (Why::Blinding, "Unterbeton|Sauberkeitsschicht|Blinding|Béton de propreté|Magrone"),
            (Why::Surfacing, "Asphalt|Fahrbahnbelag|Gussasphalt|wearing course|Enrobé"),
            (Why::Name, "Geländer|Hinterfüllung|Backfill|name sign of the wall|Deckenleuchte"),
            (Why::Unknown, "Generic Models 1:Family1:123456|Solid|Körper 3"),
        ];
        for (why, names) in idle {
            for one in names.split('|') {
                assert_eq!(name(one), Verdict::Scenery(why), "{one}");
            }
        }
        // Whatever its class says a layer is.
        for (class, one) in [("IfcSlab", "Sauberkeitsschicht"), ("IfcFooting", "blinding")] {
            assert_eq!(told(&named(class, one)), Verdict::Scenery(Why::Blinding), "{one}");
        }
        assert_eq!(told(&named("IfcPavement", "road")), Verdict::Scenery(Why::Surfacing));
        assert_eq!(told(&named("IfcFacilityPart", "part 3")), Verdict::Scenery(Why::Unknown));
        let deck = named("IfcFacilityPart", "deck");
        assert_eq!(told(&deck), Verdict::Member(Slab, By::Name));
    }

    /// A box girder spans as a beam, a plate as a slab, whatever their length.
    #[test]
    fn what_spans_is_a_slab_where_it_is_wide_for_its_depth() {
        let of = |size: [f64; 3]| {
            let solid = Box3 { centre: DVec3::ZERO, unit: [DVec3::X, DVec3::Y, DVec3::Z], size };
            match kind(&named("", "Überbau"), Some(&solid), None) {
                Verdict::Member(kind, By::Name) => kind,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(of([56.0, 2.0, 9.0]), MemberKind::Beam);
        assert_eq!(of([56.0, 0.3, 9.0]), MemberKind::Slab);
        assert_eq!(of([8.0, 0.6, 0.4]), MemberKind::Beam);
    }

    #[test]
    fn the_shape_speaks_where_nothing_else_does() {
        let of = |size: [f64; 3]| {
            let solid = Box3 { centre: DVec3::ZERO, unit: [DVec3::X, DVec3::Y, DVec3::Z], size };
            match kind(&named("IfcMember", ""), Some(&solid), None) {
                Verdict::Member(kind, By::Shape) => Some(kind),
                _ => None,
            }
        };
        assert_eq!(of([0.4, 4.0, 0.4]), Some(MemberKind::Column));
        assert_eq!(of([8.0, 0.6, 0.4]), Some(MemberKind::Beam));
        assert_eq!(of([5.0, 0.2, 6.0]), Some(MemberKind::Slab));
        assert_eq!(of([5.0, 4.0, 0.3]), Some(MemberKind::Wall));
        assert_eq!(of([1.0, 1.0, 1.0]), None);
    }
}
