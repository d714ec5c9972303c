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
    /// It bears nothing, or nobody knows.
    Scenery,
}

/// What told the kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum By {
    Model,
    Class,
    Properties,
    Name,
    Shape,
}

impl By {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Model => "what the model itself says",
            Self::Class => "class",
            Self::Properties => "property sets",
            Self::Name => "name",
            Self::Shape => "shape",
        }
    }
}

/// Classes that are one kind (IFC2X3 to IFC4X3), without `StandardCase` and `ElementedCase`.
const CLASSES: [(&str, MemberKind); 16] = [
    ("IfcColumn", MemberKind::Column),
    ("IfcBeam", MemberKind::Beam),
    ("IfcSlab", MemberKind::Slab),
    ("IfcPlate", MemberKind::Slab),
    ("IfcPavement", MemberKind::Slab),
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
const BEARING: [&str; 10] = [
    "IfcMember",
    "IfcBuildingElementPart",
    "IfcElementAssembly",
    "IfcCivilElement",
    "IfcBuiltElement",
    "IfcBridgePart",
    "IfcTunnelPart",
    "IfcTunnelElement",
    "IfcFacilityPart",
    "IfcUndergroundExcavation",
];

/// Classes of which only properties or a name can tell that they bear.
const PERHAPS: [&str; 3] = ["", "IfcBuildingElementProxy", "IfcProxy"];

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

/// Beginnings of words in names, in English, German, French, Italian, Spanish and Dutch. What
/// stands further up is the more special: a pile cap is no cap, a wall footing no wall.
const NAMES: [(&str, MemberKind); 62] = [
    ("footing", MemberKind::Footing),
    ("foundation", MemberKind::Footing),
    ("fundament", MemberKind::Footing),
    ("fundering", MemberKind::Footing),
    ("fondation", MemberKind::Footing),
    ("zapata", MemberKind::Footing),
    ("pilecap", MemberKind::Footing),
    ("pile", MemberKind::Footing),
    ("pfahl", MemberKind::Footing),
    ("bohrpfahl", MemberKind::Footing),
    ("pieu", MemberKind::Footing),
    ("pilote", MemberKind::Footing),
    ("tübbing", MemberKind::Segment),
    ("tuebbing", MemberKind::Segment),
    ("voussoir", MemberKind::Segment),
    ("segment", MemberKind::Segment),
    ("dovela", MemberKind::Segment),
    ("lining", MemberKind::Lining),
    ("innenschale", MemberKind::Lining),
    ("aussenschale", MemberKind::Lining),
    ("tunnelschale", MemberKind::Lining),
    ("revestimiento", MemberKind::Lining),
    ("tunnel", MemberKind::Lining),
    ("tendon", MemberKind::Tendon),
    ("spannglied", MemberKind::Tendon),
    ("rebar", MemberKind::Bar),
    ("stirrup", MemberKind::Bar),
    ("bügel", MemberKind::Bar),
    ("pipe", MemberKind::Pipe),
    ("rohr", MemberKind::Pipe),
    ("column", MemberKind::Column),
    ("col", MemberKind::Column),
    ("pier", MemberKind::Column),
    ("pierstem", MemberKind::Column),
    ("pillar", MemberKind::Column),
    ("stütze", MemberKind::Column),
    ("stuetze", MemberKind::Column),
    ("pfeiler", MemberKind::Column),
    ("poteau", MemberKind::Column),
    ("pilar", MemberKind::Column),
    ("pilastro", MemberKind::Column),
    ("kolom", MemberKind::Column),
    ("beam", MemberKind::Beam),
    ("girder", MemberKind::Beam),
    ("lintel", MemberKind::Beam),
    ("rafter", MemberKind::Beam),
    ("träger", MemberKind::Beam),
    ("balken", MemberKind::Beam),
    ("unterzug", MemberKind::Beam),
    ("poutre", MemberKind::Beam),
    ("viga", MemberKind::Beam),
    ("trave", MemberKind::Beam),
    ("slab", MemberKind::Slab),
    ("deck", MemberKind::Slab),
    ("decke", MemberKind::Slab),
    ("bodenplatte", MemberKind::Slab),
    ("dalle", MemberKind::Slab),
    ("losa", MemberKind::Slab),
    ("wall", MemberKind::Wall),
    ("wand", MemberKind::Wall),
    ("abutment", MemberKind::Wall),
    ("widerlager", MemberKind::Wall),
];

/// Words that say that a thing bears nothing, whatever stands beside them.
const FURNITURE: [&str; 14] = [
    "sign",
    "railing",
    "handrail",
    "guardrail",
    "filler",
    "backfill",
    "terrain",
    "light",
    "lamp",
    "paper",
    "cladding",
    "curtain",
    "formwork",
    "wallpaper",
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
    if let Some((_, kind)) = CLASSES.iter().find(|(known, _)| *known == class) {
        return match kind {
            MemberKind::Bar | MemberKind::Tendon => Verdict::Steel(*kind),
            kind => Verdict::Member(*kind, By::Class),
        };
    }
    let bears = BEARING.contains(&class);
    if !bears && !PERHAPS.contains(&class) {
        return Verdict::Scenery;
    }
    if let Some(kind) = by_properties(element) {
        return Verdict::Member(kind, By::Properties);
    }
    match by_name(element, bears) {
        Some(kind @ (MemberKind::Bar | MemberKind::Tendon)) => return Verdict::Steel(kind),
        // A segment of an arch or a deck is none of a ring.
        Some(MemberKind::Segment) if !is_bent(element) => {}
        Some(kind) => return Verdict::Member(kind, By::Name),
        None => {}
    }
    match by_shape(solid, tube) {
        Some(kind) if bears || kind == MemberKind::Lining => Verdict::Member(kind, By::Shape),
        _ if bears && !element.surface.is_empty() => Verdict::Member(MemberKind::Other, By::Class),
        _ => Verdict::Scenery,
    }
}

/// Whether it lies on the ground over its length, by its class, predefined type or name: slabs on
/// fill behind an abutment and on the soil under a house, pavements.
pub(super) fn lies_on_ground(element: &Element) -> bool {
    const NAMES: [&str; 6] =
        ["approach", "schleppplatte", "bodenplatte", "sohlplatte", "baseslab", "groundslab"];
    let mut own = std::iter::once(&element.name).chain(&element.words).flat_map(|n| words(n));
    element.class == "IfcPavement"
        || matches!(element.predefined.as_str(), "BASESLAB" | "APPROACH_SLAB" | "TRACKSLAB")
        || own.any(|word| NAMES.iter().any(|name| word.starts_with(name)))
}

fn by_properties(element: &Element) -> Option<MemberKind> {
    let found = SETS.iter().find(|(set, _)| element.properties.contains_key(*set));
    found.map(|(_, kind)| *kind).filter(|kind| *kind != MemberKind::Other)
}

/// By its own name, its type's, its predefined type, and, of what surely bears, by the names of
/// what it is part of.
fn by_name(element: &Element, bears: bool) -> Option<MemberKind> {
    let own = || std::iter::once(&element.name).chain(&element.words);
    if own().any(|name| words(name).any(|word| FURNITURE.contains(&word.as_str()))) {
        return None;
    }
    let predefined = PREDEFINED.iter().find(|(word, _)| *word == element.predefined);
    let told = |name: &String| {
        let words: Vec<String> = words(name).collect();
        let known = |start: &str| words.iter().any(|word| begins(word, start));
        NAMES.iter().find(|(start, _)| known(start)).map(|(_, kind)| *kind)
    };
    let above = || element.above.iter().take(2).map(|a| &a.name).find_map(told);
    predefined
        .map(|(_, kind)| *kind)
        .or_else(|| own().find_map(told))
        .or_else(|| if bears { above() } else { None })
}

/// Words of a name, in small letters: `COL_1`, `PierStem 2`, `Pfeiler-3`.
fn words(name: &str) -> impl Iterator<Item = String> {
    name.split(|c: char| !c.is_alphabetic()).filter(|w| !w.is_empty()).map(str::to_lowercase)
}

/// Whether a word is another or its plural or compound: short words must be whole.
fn begins(word: &str, start: &str) -> bool {
    word == start
        || word.strip_suffix(['s', 'n', 'e']).is_some_and(|stem| stem == start)
        || (start.chars().count() >= 5 && word.starts_with(start))
        || (start.chars().count() >= 5 && word.ends_with(start))
}

/// Whether something above it is round about a tunnel, so that a segment is one of a ring.
fn is_bent(element: &Element) -> bool {
    let round = |name: &str| {
        words(name).any(|w| ["tunnel", "ring", "lining", "tübbing"].iter().any(|r| w.contains(r)))
    };
    round(&element.name)
        || element.words.iter().any(|w| round(w))
        || element.above.iter().any(|a| round(&a.name) || a.class.contains("Tunnel"))
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
        assert_eq!(told(&named("IfcRailing", "beam")), Verdict::Scenery);
        assert_eq!(told(&named("IfcTendon", "x")), Verdict::Steel(MemberKind::Tendon));
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
