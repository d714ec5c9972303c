//! Which node is which structural member.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use glam::Vec3;
use intrados_stage::Access;
use serde_json::Value;

use super::Notes;
use crate::{
    Frame, Member, MemberKind, Object, Part,
    gltf::{NO_CLASS, json::Json, steel},
};

/// What a node says of itself.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Identity {
    id: String,
    name: Option<String>,
    kind: Option<MemberKind>,
    pub part: Part,
    concrete: Option<String>,
    frame: Option<Frame>,
    /// Two nodes with this id are two members (ids from names need not be unique).
    alone: bool,
}

impl Identity {
    /// Where so much is taken off all coordinates.
    pub(super) fn moved(mut self, offset: Vec3) -> Self {
        if let Some(frame) = &mut self.frame {
            frame.start -= offset;
        }
        self
    }

    /// That of another instance of the same node: a member of its own, unless it is a part of one.
    pub(super) fn again(&self) -> Self {
        Self { alone: self.alone || self.part == Part::Concrete, ..self.clone() }
    }
}

/// Prefixes of node names, and words in IFC types, that tell the kind.
const KINDS: [(&str, &str, MemberKind); 10] = [
    ("COL_", "column", MemberKind::Column),
    ("BEAM_", "beam", MemberKind::Beam),
    ("SLAB_", "slab", MemberKind::Slab),
    ("WALL_", "wall", MemberKind::Wall),
    ("FOOTING_", "footing", MemberKind::Footing),
    ("LINING_", "lining", MemberKind::Lining),
    ("SEGMENT_", "segment", MemberKind::Segment),
    ("TENDON_", "tendon", MemberKind::Tendon),
    ("BAR_", "bar", MemberKind::Bar),
    ("PIPE_", "pipe", MemberKind::Pipe),
];

/// IFC types that are structural. Railings, proxies, ground and what else a model holds stay
/// scenery.
const IFC: [(&str, MemberKind); 13] = [
    ("IfcColumn", MemberKind::Column),
    ("IfcBeam", MemberKind::Beam),
    ("IfcSlab", MemberKind::Slab),
    ("IfcWall", MemberKind::Wall),
    ("IfcWallStandardCase", MemberKind::Wall),
    ("IfcFooting", MemberKind::Footing),
    ("IfcPile", MemberKind::Footing),
    ("IfcMember", MemberKind::Other),
    ("IfcPlate", MemberKind::Slab),
    ("IfcReinforcingBar", MemberKind::Bar),
    ("IfcTendon", MemberKind::Tendon),
    ("IfcPipeSegment", MemberKind::Pipe),
    ("IfcTunnelPart", MemberKind::Lining),
];

/// IFC types that are no solid bodies: rendered, they would fill the rooms they describe.
const VOID: [&str; 7] = [
    "IfcOpeningElement",
    "IfcSpace",
    "IfcSpatialZone",
    "IfcAlignment",
    "IfcAnnotation",
    "IfcGrid",
    "IfcVirtualElement",
];

/// The kind's word, as in `extras.intrados.kind`.
pub(in crate::gltf) fn kind_name(kind: MemberKind) -> &'static str {
    KINDS.iter().find(|(_, _, k)| *k == kind).map_or("other", |(_, word, _)| word)
}

/// The part's word, as in `extras.intrados.part`.
pub(in crate::gltf) fn part_name(part: Part) -> Option<&'static str> {
    match part {
        Part::Scenery => None,
        Part::Concrete => Some("concrete"),
        Part::Bar => Some("bar"),
        Part::Stirrup => Some("stirrup"),
        Part::Tendon => Some("tendon"),
    }
}

/// The properties file beside a model.
#[derive(Debug, Default)]
pub(super) struct Properties(HashMap<String, Value>);

impl Properties {
    /// Reads `FILE.props.json` beside `FILE.glb`; none is no fault, a damaged one only a warning.
    pub(super) fn beside(model: &Path, access: &Access, notes: &mut Notes) -> Self {
        const MAX_BYTES: u64 = 8 << 20;
        let path = model.with_extension("props.json");
        if !path.exists() {
            return Self::default();
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let text = match access.read(path.parent().unwrap_or(Path::new("")), &path, MAX_BYTES) {
            Ok(text) => text,
            Err(why) => {
                notes.push(format!("{name} {why}; left out"));
                return Self::default();
            }
        };
        match serde_json::from_slice(&text) {
            Ok(map) => Self(map),
            Err(error) => {
                notes.push(format!("{name}: {error}; members are told from names alone"));
                Self::default()
            }
        }
    }
}

/// What stands at a node: a member's part, nothing solid, or whatever its parent is.
pub(super) enum Standing {
    Member(Identity),
    Void,
    Inherited,
}

/// Asks the node's extras, the properties, its name, in this order.
pub(super) fn standing(
    node: &Value,
    name: &str,
    properties: &Properties,
    notes: &mut Notes,
) -> Standing {
    let ours = node.field("extras").field("intrados");
    if let Some(id) = ours.text("member").filter(|id| !id.is_empty()) {
        return Standing::Member(from_extras(ours, id, notes));
    }
    if let Some(entry) = properties.0.get(name) {
        let class = entry.text("type").unwrap_or("");
        if VOID.iter().any(|void| class.starts_with(void)) {
            return Standing::Void;
        }
        let kind = IFC.iter().find(|(ifc, _)| *ifc == class).map(|(_, kind)| *kind);
        return kind.map_or(Standing::Inherited, |kind| {
            Standing::Member(from_properties(entry, name, kind))
        });
    }
    let prefixed = |prefix: &str| {
        name.get(..prefix.len()).is_some_and(|start| start.eq_ignore_ascii_case(prefix))
    };
    let kind = KINDS.iter().find(|(prefix, _, _)| prefixed(prefix)).map(|(_, _, kind)| *kind);
    kind.map_or(Standing::Inherited, |kind| {
        let id = name.to_owned();
        Standing::Member(Identity {
            id,
            name: None,
            kind: Some(kind),
            part: part_of(kind),
            concrete: None,
            frame: None,
            alone: true,
        })
    })
}

fn part_of(kind: MemberKind) -> Part {
    match kind {
        MemberKind::Bar => Part::Bar,
        MemberKind::Tendon => Part::Tendon,
        _ => Part::Concrete,
    }
}

fn from_extras(ours: &Value, id: &str, notes: &mut Notes) -> Identity {
    let kind = ours.text("kind").and_then(|word| {
        let kind = serde_json::from_value(Value::from(word)).ok();
        if kind.is_none() {
            notes.push(format!("member {id:?}: kind {word:?} is unknown, taken as other"));
        }
        kind
    });
    let part = match ours.text("part") {
        None => part_of(kind.unwrap_or(MemberKind::Other)),
        Some("concrete") => Part::Concrete,
        Some("bar") => Part::Bar,
        Some("stirrup") => Part::Stirrup,
        Some("tendon") => Part::Tendon,
        Some(word) => {
            notes.push(format!("member {id:?}: part {word:?} is unknown, taken as concrete"));
            Part::Concrete
        }
    };
    let text = |key| ours.text(key).filter(|t| !t.is_empty()).map(str::to_owned);
    Identity {
        id: id.into(),
        name: text("name"),
        kind,
        part,
        concrete: text("concrete"),
        frame: steel::read_frame(ours.field("frame")),
        alone: false,
    }
}

fn from_properties(entry: &Value, id: &str, kind: MemberKind) -> Identity {
    // A class may stand among the materials' names, `C30/37` or `Concrete C30/37`.
    let words = entry
        .list("materials")
        .iter()
        .filter_map(Value::as_str)
        .flat_map(|m| m.split([' ', ',', ';', '_']));
    let concrete = words.filter(|w| is_concrete_class(w)).map(str::to_owned).next();
    let name = entry.text("name").filter(|t| !t.is_empty()).map(str::to_owned);
    Identity {
        id: id.into(),
        name,
        kind: Some(kind),
        part: part_of(kind),
        concrete,
        frame: None,
        alone: true,
    }
}

/// `C` cylinder strength `/` cube strength, as in EN 206.
fn is_concrete_class(word: &str) -> bool {
    let number = |text: &str| {
        !text.is_empty() && text.len() <= 3 && text.bytes().all(|b| b.is_ascii_digit())
    };
    word.strip_prefix('C')
        .and_then(|rest| rest.split_once('/'))
        .is_some_and(|(cylinder, cube)| number(cylinder) && number(cube))
}

/// Members as their nodes are met.
#[derive(Debug, Default)]
pub(super) struct Members {
    list: Vec<Member>,
    known: HashMap<String, usize>,
    /// The last number given to nodes of one name.
    numbers: HashMap<String, u64>,
    /// Whether an extent of concrete was met yet, per member.
    concrete: Vec<bool>,
    /// Whether a kind was said, per member.
    kind_said: Vec<bool>,
}

impl Members {
    /// The member of an identity, made if it is new.
    pub(super) fn enter(&mut self, identity: &Identity, notes: &mut Notes) -> usize {
        let known = self.known.get(&identity.id).copied();
        let index = match known {
            Some(index) if !identity.alone => index,
            _ => {
                let id = if known.is_some() {
                    self.unused(&identity.id, notes)
                } else {
                    identity.id.clone()
                };
                self.known.insert(id.clone(), self.list.len());
                self.concrete.push(false);
                self.kind_said.push(false);
                self.list.push(Member {
                    name: id.clone(),
                    id,
                    kind: MemberKind::Other,
                    concrete: "C30/37".into(),
                    concrete_assumed: true,
                    exposure: None,
                    frame: Frame::default(),
                    bounds: [Vec3::INFINITY, Vec3::NEG_INFINITY],
                    volume: 0.0,
                    slices: Vec::new(),
                    truth: Vec::new(),
                });
                self.list.len() - 1
            }
        };
        if let (Some(member), Some(kind_said)) =
            (self.list.get_mut(index), self.kind_said.get_mut(index))
        {
            if let Some(name) = &identity.name {
                member.name.clone_from(name);
            }
            // A part that says no kind leaves what another part said.
            if let Some(kind) = identity.kind {
                member.kind = kind;
                *kind_said = true;
            }
            if let Some(frame) = identity.frame {
                member.frame = frame;
            }
            if let Some(class) = &identity.concrete {
                member.concrete.clone_from(class);
                member.concrete_assumed = false;
            }
        }
        index
    }

    /// A new id out of one that is taken: `COL_1 #2`.
    fn unused(&mut self, id: &str, notes: &mut Notes) -> String {
        notes.once("several nodes have the same name; their members are told apart by a number");
        let Self { numbers, known, .. } = self;
        // Numbers go on from the last one: thousands of nodes may have one name.
        let number = numbers.entry(id.to_owned()).or_insert(1);
        loop {
            *number += 1;
            let candidate = format!("{id} #{number}");
            if !known.contains_key(&candidate) {
                return candidate;
            }
        }
    }

    /// Adds an object's extent (and its volume, if its mesh is closed) to its member. Concrete
    /// counts; other parts only until there is any.
    pub(super) fn extend(
        &mut self,
        index: usize,
        part: Part,
        bounds: [Vec3; 2],
        volume: Option<f64>,
    ) {
        let (Some(member), Some(concrete)) =
            (self.list.get_mut(index), self.concrete.get_mut(index))
        else {
            return;
        };
        let own = part == Part::Concrete || part == part_of(member.kind);
        if own && !*concrete {
            *concrete = true;
            member.bounds = bounds;
            member.volume = volume.unwrap_or(f64::NAN);
        } else if own == *concrete {
            member.bounds = [member.bounds[0].min(bounds[0]), member.bounds[1].max(bounds[1])];
            if own {
                member.volume += volume.unwrap_or(f64::NAN);
            }
        }
    }

    /// The finished members, those that no object shows left out, and the objects' indices with
    /// them. One open mesh leaves the volume unknown, which is 0.
    pub(super) fn finish(mut self, objects: &mut [Object], notes: &mut Notes) -> Vec<Member> {
        let mut shown = vec![false; self.list.len()];
        for member in objects.iter().filter_map(|o| o.member) {
            if let Some(shown) = shown.get_mut(member) {
                *shown = true;
            }
        }
        let hidden = shown.iter().filter(|shown| !**shown).count();
        if hidden > 0 {
            notes.push(format!("{hidden} members have no surface and were left out"));
        }
        let places: Vec<usize> = shown
            .iter()
            .scan(0, |next, &shown| Some(std::mem::replace(next, *next + usize::from(shown))))
            .collect();
        for member in objects.iter_mut().filter_map(|o| o.member.as_mut()) {
            *member = places.get(*member).copied().unwrap_or(0);
        }
        let keep = |i: usize| shown.get(i).copied().unwrap_or(false);
        self.kind_said = self
            .kind_said
            .into_iter()
            .enumerate()
            .filter(|(i, _)| keep(*i))
            .map(|(_, said)| said)
            .collect();
        let mut list: Vec<Member> = self
            .list
            .into_iter()
            .enumerate()
            .filter(|(i, _)| keep(*i))
            .map(|(_, member)| member)
            .collect();
        let assumed = list
            .iter()
            .filter(|m| {
                m.concrete_assumed && !matches!(m.kind, MemberKind::Bar | MemberKind::Tendon)
            })
            .count();
        if assumed > 0 {
            notes.push(format!("{assumed} {NO_CLASS}: C30/37 is assumed"));
        }
        let silent: HashSet<_> = list
            .iter()
            .zip(&self.kind_said)
            .filter(|(_, said)| !**said)
            .map(|(m, _)| m.id.as_str())
            .collect();
        if !silent.is_empty() {
            notes.push(format!(
                "{} members state no kind (extras.intrados.kind): taken as other",
                silent.len()
            ));
        }
        for member in &mut list {
            if !member.volume.is_finite() {
                member.volume = 0.0;
            }
            if member.bounds[0].x > member.bounds[1].x {
                member.bounds = [Vec3::ZERO; 2];
            }
            if member.frame == Frame::default() {
                member.frame = Frame::of_box(member.kind, member.bounds);
            }
        }
        list
    }
}
