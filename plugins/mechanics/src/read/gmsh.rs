//! Meshes of Gmsh (`.msh`): version 4.1 as text and binary, 2.2 as text.
//!
//! Hexahedra of 8 nodes (type 5) are solids, lines (1) rods. A quadrilateral (3) that is a face of
//! a hexahedron joins the face sets of its physical surfaces; if it is none, or one of its surfaces
//! has a name that begins with `shell`, it is a shell. Physical groups become sets of elements,
//! faces and nodes; the first physical group of an element is its region. Points (15) only name
//! nodes. What belongs to no physical group is left out where there are groups, as Gmsh itself
//! does.

mod source;
mod v2;
mod v4;

use std::{collections::HashMap, path::Path};

use glam::DVec3;

use super::{Deck, Fault, LabelMap, MAX_ENTRIES, ReadError, Units, bytes, quote};
use crate::mesh::{Cell, ElementId, FaceTable, HexFace, Mesh, Subject};
use source::Source;

/// Nodes or elements of a file.
const MAX_COUNT: usize = 100_000_000;

/// Reads a mesh. The deck has nodes, elements and sets, nothing else.
///
/// # Errors
/// The file is missing, or something in it is damaged, beyond the limits, or not supported: named
/// with its line (text) or section (binary).
pub fn read(path: &Path, units: Units) -> Result<Deck, ReadError> {
    parse(&bytes(path)?, path, units)
}

/// Reads a mesh from memory; `name` is what errors call it.
///
/// # Errors
/// As [`read`].
pub fn parse(bytes: &[u8], name: &Path, units: Units) -> Result<Deck, ReadError> {
    deck(bytes, units).map_err(|fault| fault.of(name))
}

/// What both versions of the format say.
#[derive(Default)]
struct Raw {
    labels: Vec<u32>,
    points: Vec<DVec3>,
    /// Names of physical groups by (dimension, tag).
    names: HashMap<(u8, i32), String>,
    elements: Vec<RawElement>,
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
    /// Node labels; how many, by the kind.
    nodes: [u32; 8],
    kind: Kind,
    /// Index into [`Raw::groups`].
    group: u32,
    line: Option<u32>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Point,
    Line,
    Quad,
    Hex,
    /// Not supported; matters only if it is wanted.
    Other(i64),
}

impl Kind {
    fn of(number: i64) -> Self {
        match number {
            15 => Self::Point,
            1 => Self::Line,
            3 => Self::Quad,
            5 => Self::Hex,
            other => Self::Other(other),
        }
    }

    /// Nodes of an element, for all types that Gmsh writes by default; none: unknown.
    fn nodes(self) -> Option<usize> {
        Some(match self {
            Self::Point => 1,
            Self::Line => 2,
            Self::Quad => 4,
            Self::Hex => 8,
            Self::Other(number) => match number {
                2 | 8 => 3,
                4 | 26 => 4,
                6 | 9 => 6,
                7 | 27 => 5,
                10 => 9,
                11 | 29 => match number {
                    11 => 10,
                    _ => 20,
                },
                12 => 27,
                13 => 18,
                14 => 14,
                16 => 8,
                17 => 20,
                18 => 15,
                19 => 13,
                20 => 9,
                21 => 10,
                22 => 12,
                23 => 15,
                24 => 15,
                25 => 21,
                28 => 6,
                _ => return None,
            },
        })
    }

    fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line => 1,
            Self::Quad => 2,
            Self::Hex => 3,
            Self::Other(n) => match n {
                8 | 26 | 27 | 28 => 1,
                2 | 9 | 10 | 16 | 20..=25 => 2,
                _ => 3,
            },
        }
    }

    fn name(self) -> String {
        match self {
            Self::Other(n) => {
                let name = match n {
                    2 => "triangle of 3 nodes",
                    4 => "tetrahedron of 4 nodes",
                    6 => "prism of 6 nodes",
                    7 => "pyramid of 5 nodes",
                    8 => "line of 3 nodes",
                    9 => "triangle of 6 nodes",
                    10 => "quadrilateral of 9 nodes",
                    11 => "tetrahedron of 10 nodes",
                    12 => "hexahedron of 27 nodes",
                    16 => "quadrilateral of 8 nodes",
                    17 => "hexahedron of 20 nodes",
                    _ => "unknown",
                };
                format!("{n} ({name})")
            }
            Self::Point => "15 (point)".into(),
            Self::Line => "1 (line)".into(),
            Self::Quad => "3 (quadrilateral)".into(),
            Self::Hex => "5 (hexahedron)".into(),
        }
    }
}

fn deck(bytes: &[u8], units: Units) -> Result<Deck, Fault> {
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

/// Labels to nodes, groups to sets.
fn build(raw: Raw, units: Units) -> Result<Deck, Fault> {
    let groups = raw.group_names();
    let pairs = (0u32..).zip(&raw.labels).map(|(i, &l)| (l, i)).collect();
    let nodes = LabelMap::new(pairs)
        .map_err(|twice| Fault::whole(format!("node {twice} is defined twice")))?;
    let mesh =
        Mesh { nodes: raw.points.iter().map(|&p| units.length() * p).collect(), ..Mesh::default() };
    let mut builder = Builder {
        mesh,
        sets: vec![Sets::default(); groups.len()],
        groups,
        regions: HashMap::new(),
        lines: Default::default(),
    };
    builder.mesh.labels.nodes = raw.labels;
    let grouped = builder.groups.iter().any(|g| !g.is_empty());
    let (mut quads, mut skipped) = (Vec::new(), 0usize);
    for e in &raw.elements {
        if grouped && builder.names(e).is_empty() {
            skipped += 1;
            continue;
        }
        let found = e.place(&nodes)?;
        if let Some(sets) = builder.sets.get_mut(e.group as usize) {
            sets.nodes.extend(&found[..e.kind.nodes().unwrap_or(0).min(8)]);
        }
        match e.kind {
            // Whether it is a face is known when all hexahedra are.
            Kind::Quad => quads.push((e, [found[0], found[1], found[2], found[3]])),
            Kind::Hex => builder.hex(e, found),
            Kind::Line => builder.rod(e, [found[0], found[1]]),
            Kind::Point | Kind::Other(_) => {}
        }
    }
    let table = builder.mesh.face_table();
    quads.into_iter().for_each(|(e, nodes)| builder.quad(&table, e, nodes));
    let (mesh, mut notes) = builder.finish()?;
    if skipped > 0 {
        notes.push(format!("{skipped} elements belong to no physical group and were left out"));
    }
    Ok(Deck {
        formulations: vec![Default::default(); mesh.hexes.len()],
        mesh,
        notes,
        ..Deck::default()
    })
}

impl RawElement {
    /// Node labels to nodes; refuses what is not supported.
    fn place(&self, nodes: &LabelMap<u32>) -> Result<[u32; 8], Fault> {
        if let Kind::Other(_) = self.kind {
            let reason = format!(
                "element {}: type {} is not supported; supported are 5 (hexahedron of 8 nodes), 3 (quadrilateral of 4), 1 (line of 2), \
                 15 (point): recombine to hexahedra of first order (Mesh.RecombineAll, transfinite or extruded volumes)",
                self.label,
                self.kind.name()
            );
            return Err(Fault { line: self.line, reason });
        }
        let mut found = [0; 8];
        for (slot, &label) in
            found.iter_mut().zip(&self.nodes[..self.kind.nodes().unwrap_or(0).min(8)])
        {
            let undefined = || Fault {
                line: self.line,
                reason: format!("element {}: node {label} is not defined", self.label),
            };
            *slot = nodes.get(label).ok_or_else(undefined)?;
        }
        Ok(found)
    }
}

/// What belongs to one combination of physical groups.
#[derive(Default, Clone)]
struct Sets {
    nodes: Vec<u32>,
    elements: Vec<ElementId>,
    faces: Vec<HexFace>,
}

struct Builder {
    mesh: Mesh,
    groups: Vec<Vec<String>>,
    sets: Vec<Sets>,
    regions: HashMap<String, u32>,
    /// Lines of hexahedra, shells, rods.
    lines: [Vec<Option<u32>>; 3],
}

impl Builder {
    fn names(&self, e: &RawElement) -> &[String] {
        self.groups.get(e.group as usize).map_or(&[], Vec::as_slice)
    }

    fn region(&mut self, e: &RawElement, unnamed: &str) -> u32 {
        let Self { groups, regions, mesh, .. } = self;
        let name =
            groups.get(e.group as usize).and_then(|g| g.first()).map_or(unnamed, String::as_str);
        if let Some(&region) = regions.get(name) {
            return region;
        }
        mesh.regions.push(name.to_owned());
        regions.insert(name.to_owned(), mesh.regions.len() as u32 - 1);
        mesh.regions.len() as u32 - 1
    }

    fn list(&mut self, e: &RawElement, element: ElementId) {
        if let Some(sets) = self.sets.get_mut(e.group as usize) {
            sets.elements.push(element);
        }
    }

    fn hex(&mut self, e: &RawElement, nodes: [u32; 8]) {
        let region = self.region(e, "solids");
        self.list(e, ElementId::Hex(self.mesh.hexes.len() as u32));
        self.mesh.hexes.push(Cell { nodes, region });
        self.mesh.labels.hexes.push(e.label);
        self.lines[0].push(e.line);
    }

    fn rod(&mut self, e: &RawElement, nodes: [u32; 2]) {
        let region = self.region(e, "rods");
        self.list(e, ElementId::Rod(self.mesh.rods.len() as u32));
        self.mesh.rods.push(Cell { nodes, region });
        self.mesh.labels.rods.push(e.label);
        self.lines[2].push(e.line);
    }

    /// A face of a hexahedron, or a shell.
    fn quad(&mut self, table: &FaceTable, e: &RawElement, nodes: [u32; 4]) {
        let meant = self
            .names(e)
            .iter()
            .any(|g| g.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("shell")));
        if let (Some((_, face)), false) = (table.find(nodes).first(), meant) {
            if let Some(sets) = self.sets.get_mut(e.group as usize) {
                sets.faces.push(*face);
            }
            return;
        }
        let region = self.region(e, "shells");
        self.list(e, ElementId::Shell(self.mesh.shells.len() as u32));
        self.mesh.shells.push(Cell { nodes, region });
        self.mesh.labels.shells.push(e.label);
        self.lines[1].push(e.line);
    }

    /// Names the sets and checks the mesh.
    fn finish(mut self) -> Result<(Mesh, Vec<String>), Fault> {
        let mesh = &mut self.mesh;
        if mesh.hexes.is_empty() && mesh.shells.is_empty() && mesh.rods.is_empty() {
            return Err(Fault::whole("no hexahedra, shells or rods in it"));
        }
        let mut left = MAX_ENTRIES;
        for (names, sets) in self.groups.iter().zip(&self.sets) {
            let entries = names
                .len()
                .saturating_mul(sets.nodes.len() + sets.elements.len() + sets.faces.len());
            left = left.checked_sub(entries).ok_or_else(|| {
                Fault::whole(format!("physical groups expand to more than {MAX_ENTRIES} entries"))
            })?;
            for name in names {
                mesh.node_sets.entry(name.clone()).or_default().extend(&sets.nodes);
                if !sets.elements.is_empty() {
                    mesh.element_sets.entry(name.clone()).or_default().extend(&sets.elements);
                }
                if !sets.faces.is_empty() {
                    mesh.face_sets.entry(name.clone()).or_default().extend(&sets.faces);
                }
            }
        }
        for set in mesh.node_sets.values_mut() {
            set.sort_unstable();
            set.dedup();
        }
        let line_of = |subject| match subject {
            Subject::Element(ElementId::Hex(i)) => self.lines[0].get(i as usize).copied().flatten(),
            Subject::Element(ElementId::Shell(i)) => {
                self.lines[1].get(i as usize).copied().flatten()
            }
            Subject::Element(ElementId::Rod(i)) => self.lines[2].get(i as usize).copied().flatten(),
            _ => None,
        };
        let notes =
            self.mesh.check().map_err(|e| Fault { line: line_of(e.subject), reason: e.reason })?;
        Ok((self.mesh, notes))
    }
}

#[cfg(test)]
mod tests;
