//! Meshes of Gmsh (`.msh`): version 4.1 as text and binary, 2.2 as text.
//!
//! Solids are tetrahedra of 4 and 10 nodes (types 4 and 11), prisms of 6 and 15 (6, 18) and hexahedra
//! of 8 and 20 (5, 17); triangles, quadrilaterals, lines and points of the same orders only name
//! places of them. Physical groups become lists of elements; what belongs to none is left out where
//! there are groups, as Gmsh itself does. Nodes of an element come in the order of Abaqus.

mod source;
mod v2;
mod v4;

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::DVec3;

use super::{Fault, LabelMap, MAX_ENTRIES, Units, quote};
use source::Source;

/// Nodes or elements of a file.
const MAX_COUNT: usize = 100_000_000;

/// Faults after which no more are looked for.
const MAX_FAULTS: usize = 100;

/// What is read, for messages.
const SUPPORTED: &str = "tetrahedra of 4 and 10 nodes, prisms of 6 and 15, hexahedra of 8 and 20, \
                         triangles of 3 and 6, quadrilaterals of 4 and 8, lines of 2 and 3, and points";

/// Nodes, elements and physical groups of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Mesh {
    /// Numbers of the nodes in the file.
    pub(crate) labels: Vec<u32>,
    /// Where they are, m.
    pub(crate) points: Vec<DVec3>,
    /// Each once, in however many groups it is.
    pub(crate) elements: Vec<Element>,
    /// Indices of elements, ascending, by dimension and name of their physical group.
    pub(crate) groups: BTreeMap<(u8, String), Vec<u32>>,
    /// Elements of the file that belong to no group, where there are groups.
    pub(crate) left_out: usize,
}

/// An element of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Element {
    /// Its number in the file.
    pub(crate) label: u32,
    /// 0 to 3: point, line, surface, solid.
    pub(crate) dimension: u8,
    /// Indices of its nodes, in the order of Abaqus.
    pub(crate) nodes: Vec<u32>,
}

/// What both versions of the format say.
#[derive(Default)]
struct Raw {
    labels: Vec<u32>,
    points: Vec<DVec3>,
    /// Names of physical groups by (dimension, tag).
    names: HashMap<(u8, i32), String>,
    elements: Vec<RawElement>,
    /// Node labels of all elements, one element after the other.
    nodes: Vec<u32>,
    /// Which physical groups elements belong to: dimension and tags.
    groups: Vec<(u8, Vec<i32>)>,
    known: HashMap<(u8, Vec<i32>), u32>,
}

impl Raw {
    /// The number of a combination of physical groups.
    fn group(&mut self, dimension: u8, tags: Vec<i32>) -> u32 {
        let Self { groups, known, .. } = self;
        *known.entry((dimension, tags)).or_insert_with_key(|key| {
            groups.push(key.clone());
            groups.len() as u32 - 1
        })
    }

    /// Names of the physical groups of each combination.
    fn group_names(&self) -> Vec<Vec<String>> {
        let unnamed = |dimension: u8, tag: i32| {
            format!(
                "{}-{tag}",
                ["point", "line", "surface", "volume"][usize::from(dimension.min(3))]
            )
        };
        let name =
            |d: u8, tag: i32| self.names.get(&(d, tag)).cloned().unwrap_or_else(|| unnamed(d, tag));
        self.groups
            .iter()
            .map(|(d, tags)| tags.iter().map(|&tag| name(*d, tag)).collect())
            .collect()
    }
}

struct RawElement {
    label: u32,
    /// Where its nodes begin in [`Raw::nodes`]; how many, by the kind.
    first: usize,
    kind: Kind,
    /// Index into [`Raw::groups`].
    group: u32,
    line: Option<u32>,
}

/// What an element is, by Gmsh's number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Kind(i64);

impl Kind {
    /// Nodes of an element, for all types that Gmsh writes by default; none: unknown.
    fn nodes(self) -> Option<usize> {
        Some(match self.0 {
            15 => 1,
            1 => 2,
            2 | 8 => 3,
            3 | 4 | 26 => 4,
            7 | 27 => 5,
            6 | 9 | 28 => 6,
            5 | 16 => 8,
            10 | 20 => 9,
            11 | 21 => 10,
            22 => 12,
            19 => 13,
            14 => 14,
            18 | 23 | 24 => 15,
            13 => 18,
            17 | 29 => 20,
            25 => 21,
            12 => 27,
            _ => return None,
        })
    }

    fn dimension(self) -> u8 {
        match self.0 {
            15 => 0,
            1 | 8 | 26..=28 => 1,
            2 | 3 | 9 | 10 | 16 | 20..=25 => 2,
            _ => 3,
        }
    }

    /// Where each of its nodes in the order of Abaqus stands in Gmsh's, which numbers the middles of
    /// edges otherwise (Gmsh's manual, "Node ordering"); none: not supported.
    fn order(self) -> Option<&'static [usize]> {
        let order: &'static [usize] = match self.0 {
            15 => &[0],
            1 => &[0, 1],
            2 | 8 => &[0, 1, 2],
            3 | 4 => &[0, 1, 2, 3],
            6 | 9 => &[0, 1, 2, 3, 4, 5],
            5 | 16 => &[0, 1, 2, 3, 4, 5, 6, 7],
            11 => &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
            17 => &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
            18 => &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
            _ => return None,
        };
        Some(order)
    }

    fn name(self) -> String {
        let name = match self.0 {
            7 => "pyramid of 5 nodes",
            10 => "quadrilateral of 9 nodes",
            12 => "hexahedron of 27 nodes",
            13 => "prism of 18 nodes",
            14 => "pyramid of 14 nodes",
            19 => "pyramid of 13 nodes",
            _ => "of higher order",
        };
        format!("{} ({name})", self.0)
    }
}

/// Reads a mesh from memory.
///
/// # Errors
/// Something in it is damaged, beyond the limits, or not supported: named with its line (text) or
/// section (binary).
pub(crate) fn parse(bytes: &[u8], units: Units) -> Result<Mesh, Fault> {
    let mut source = Source::new(bytes);
    source.expect("$MeshFormat")?;
    let (version, binary, size) =
        (source.word()?.to_owned(), source.word()?.to_owned(), source.word()?.to_owned());
    let line = source.line();
    let binary = match binary.as_str() {
        "0" => false,
        "1" => true,
        other => {
            return Err(Fault {
                line,
                reason: format!("the file type is {}, not 0 (text) or 1 (binary)", quote(other)),
            });
        }
    };
    if size != "8" {
        return Err(Fault {
            line,
            reason: format!("numbers of {} bytes: 8 are supported", quote(&size)),
        });
    }
    let raw = match (version.as_str(), binary) {
        ("4.1", false) => v4::read(source),
        ("4.1", true) => {
            source.begin_binary()?;
            v4::read(source)
        }
        ("2.2", false) => v2::read(source),
        ("2.2", true) => {
            Err(Fault { line, reason: "version 2.2 is read as text only: save it as version 4.1 (Mesh.MshFileVersion = 4.1)".into() })
        }
        _ => Err(Fault { line, reason: format!("version {}: 4.1 and 2.2 are supported (Mesh.MshFileVersion = 4.1)", quote(&version)) }),
    }?;
    build(raw, units)
}

/// Labels to nodes, groups to lists; all faults that elements have.
fn build(raw: Raw, units: Units) -> Result<Mesh, Fault> {
    let names = raw.group_names();
    let pairs = raw.labels.iter().copied().zip(0u32..).collect();
    let nodes = LabelMap::new(pairs)
        .map_err(|twice| Fault::whole(format!("node {twice} is defined twice")))?;
    let is_grouped = names.iter().any(|g| !g.is_empty());
    let (mut elements, mut left_out) = (Vec::new(), 0);
    // Version 2.2 repeats an element for every group that it is in.
    let mut known: HashMap<(u8, Vec<u32>), u32> = HashMap::new();
    let mut sets: Vec<Vec<u32>> = vec![Vec::new(); names.len()];
    let (mut faults, mut refused) = (Vec::new(), HashSet::new());
    for e in &raw.elements {
        if faults.len() == MAX_FAULTS {
            break;
        }
        if is_grouped && names.get(e.group as usize).is_none_or(Vec::is_empty) {
            left_out += 1;
            continue;
        }
        let Some(order) = e.kind.order() else {
            if refused.insert(e.kind) {
                faults.push(e.unsupported());
            }
            continue;
        };
        match e.place(order, &raw.nodes, &nodes) {
            Ok(nodes) => {
                let dimension = e.kind.dimension();
                let next = elements.len() as u32;
                let number = *known.entry((dimension, nodes.clone())).or_insert(next);
                if number == next {
                    elements.push(Element { label: e.label, dimension, nodes });
                }
                if let Some(set) = sets.get_mut(e.group as usize) {
                    set.push(number);
                }
            }
            Err(fault) => faults.push(fault),
        }
    }
    Fault::all(faults)?;
    if elements.iter().all(|e| e.dimension != 3) {
        let why = "no solids in it: mesh its volumes, and put them into physical groups";
        return Err(Fault::whole(why));
    }
    let dimensions = raw.groups.iter().map(|g| g.0);
    let groups = grouped(dimensions.zip(&names).zip(sets))?;
    let points = raw.points.iter().map(|&p| units.length() * p).collect();
    Ok(Mesh { labels: raw.labels, points, elements, groups, left_out })
}

/// Elements of combinations of groups to those of each group.
fn grouped<'a>(
    combinations: impl Iterator<Item = ((u8, &'a Vec<String>), Vec<u32>)>,
) -> Result<BTreeMap<(u8, String), Vec<u32>>, Fault> {
    let mut groups: BTreeMap<(u8, String), Vec<u32>> = BTreeMap::new();
    let mut left = MAX_ENTRIES;
    for ((dimension, names), set) in combinations {
        left = left.checked_sub(names.len().saturating_mul(set.len())).ok_or_else(|| {
            Fault::whole(format!("physical groups expand to more than {MAX_ENTRIES} entries"))
        })?;
        for name in names {
            groups.entry((dimension, name.clone())).or_default().extend(&set);
        }
    }
    for set in groups.values_mut() {
        set.sort_unstable();
        set.dedup();
    }
    groups.retain(|_, set| !set.is_empty());
    Ok(groups)
}

impl RawElement {
    /// What is said of an element that is not read.
    fn unsupported(&self) -> Fault {
        let reason = format!(
            "element {}: type {} is not supported; supported are {SUPPORTED} (Mesh.ElementOrder up to 2, Mesh.SecondOrderIncomplete = 1)",
            self.label,
            self.kind.name()
        );
        Fault { line: self.line, reason }
    }

    /// Node labels of the file to nodes, in the order of Abaqus.
    fn place(
        &self,
        order: &[usize],
        labels: &[u32],
        nodes: &LabelMap<u32>,
    ) -> Result<Vec<u32>, Fault> {
        let find = |&at: &usize| {
            let label = labels[self.first + at];
            nodes.get(label).ok_or_else(|| Fault {
                line: self.line,
                reason: format!("element {}: node {label} is not defined", self.label),
            })
        };
        order.iter().map(find).collect()
    }
}

#[cfg(test)]
mod tests;
