//! Nodes, elements, sets and surfaces.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::{
    link::Link,
    model::Cell,
    read::{Kind, Raw, Reader, Section, Surface, plain},
    shape::Shape,
    thin::Thin,
};
use crate::read::{
    Fault, LabelMap,
    abaqus::card::{Card, Row, side_number},
    label, quote,
};

/// Nodes or elements of a deck: more are a mistake.
pub(super) const MAX_COUNT: usize = 5_000_000;

/// What an element type is; `None`: not computed.
pub(super) fn kind(name: &str) -> Option<Kind> {
    let solid = match name {
        "C3D8" => Some(Shape::Hex8),
        "C3D8I" => Some(Shape::Hex8Bubbles),
        "C3D8R" => Some(Shape::Hex8Mean),
        "C3D20" => Some(Shape::Hex20),
        "C3D20R" => Some(Shape::Hex20Reduced),
        "C3D4" => Some(Shape::Tet4),
        "C3D10" => Some(Shape::Tet10),
        "C3D6" => Some(Shape::Wedge6),
        "C3D15" => Some(Shape::Wedge15),
        "T3D2" => Some(Shape::Bar),
        _ => None,
    };
    if let Some(shape) = solid {
        return Some(Kind::Solid(shape));
    }
    if let Some(link) = Link::of(name) {
        return Some(Kind::Link(link));
    }
    Thin::of(name).map(Kind::Thin)
}

impl Kind {
    fn nodes(self) -> usize {
        match self {
            Self::Solid(shape) => shape.nodes(),
            Self::Link(link) => link.nodes(),
            Self::Thin(thin) => thin.nodes(),
        }
    }

    /// The face of the solid that side `number`, from 1, is.
    fn face(self, number: u8) -> Option<u8> {
        match self {
            Self::Solid(shape) => {
                (1..=shape.faces().len()).contains(&usize::from(number)).then(|| number - 1)
            }
            Self::Link(_) | Self::Thin(_) => None,
        }
    }
}

impl Reader {
    /// Nodes first; elements name them.
    pub(super) fn meshed(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        match plain(card).as_str() {
            "NODE" => self.read_nodes(card),
            _ => Ok(()),
        }
    }

    /// Elements, sets and surfaces in the order of the file.
    pub(super) fn grouped(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        match plain(card).as_str() {
            "ELEMENT" => self.read_elements(card),
            "NSET" => self.node_set(card),
            "ELSET" => self.element_set(card),
            "SURFACE" => self.surface(card),
            _ => Ok(()),
        }
    }

    fn read_nodes(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NSET"])?;
        let first = self.deck.labels.len() as u32;
        for row in card.rows() {
            let fields: Vec<&str> = row.fields().collect();
            // Coordinates that are not there are nothing; what follows them (normals of shells)
            // says nothing of solids.
            let [number, rest @ ..] = fields.as_slice() else { continue };
            let mut place = [0.0; 3];
            for (slot, word) in place.iter_mut().zip(rest).filter(|(_, w)| !w.is_empty()) {
                *slot = row.number(word)?;
            }
            if self.deck.labels.len() == MAX_COUNT {
                return Err(row.fault(format!("more than {MAX_COUNT} nodes")));
            }
            self.deck.labels.push(label(number).map_err(|e| row.fault(e))?);
            self.deck.nodes.push(self.units.length() * DVec3::from_array(place));
        }
        let last = self.deck.labels.len() as u32;
        if let Some(set) = name_of(card, "NSET")? {
            self.node_sets.entry(set).or_default().extend(first..last);
        }
        let pairs = self.deck.labels.iter().copied().zip(0..).collect();
        self.nodes = LabelMap::new(pairs)
            .map_err(|twice| card.fault(format!("node {twice} is defined a second time")))?;
        Ok(())
    }

    fn read_elements(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["TYPE", "ELSET"])?;
        let kind = card.word("TYPE").and_then(|t| kind(&t));
        let kind = kind.ok_or_else(|| card.fault("*ELEMENT needs TYPE=…"))?;
        let first = self.raw.len() as u32;
        // CalculiX reads no further than an element has nodes.
        let more = |row: &Row<'_>| row.fields().count() > kind.nodes() + 1;
        if let Some(row) = card.rows().find(more) {
            let own = kind.nodes();
            self.deck.notes.push(format!(
                "line {}: of an element with more than {own} nodes the first {own} are its own",
                row.line
            ));
        }
        let mut rows = card.rows();
        while let Some(row) = rows.next() {
            let element = self.element(kind, row, &mut rows)?;
            if self.raw.len() == MAX_COUNT {
                return Err(row.fault(format!("more than {MAX_COUNT} elements")));
            }
            self.raw.push(element);
        }
        if let Some(set) = name_of(card, "ELSET")? {
            self.element_sets.entry(set).or_default().extend(first..self.raw.len() as u32);
        }
        let pairs = self.raw.iter().map(|r| r.label).zip(0..).collect();
        self.elements = LabelMap::new(pairs)
            .map_err(|twice| card.fault(format!("element {twice} is defined a second time")))?;
        Ok(())
    }

    /// An element whose nodes go on in the next lines until all are there.
    fn element<'a>(
        &self,
        kind: Kind,
        row: Row<'a>,
        rows: &mut impl Iterator<Item = Row<'a>>,
    ) -> Result<Raw, Fault> {
        let mut fields: Vec<&str> = row.fields().take(kind.nodes() + 1).collect();
        while fields.len() < kind.nodes() + 1 {
            let next = rows.next().ok_or_else(|| {
                row.fault(format!("{} nodes, not {}", fields.len() - 1, kind.nodes()))
            })?;
            fields.extend(next.fields());
        }
        let [number, nodes @ ..] = fields.as_slice() else {
            return Err(row.fault("an element needs its number and its nodes"));
        };
        if nodes.len() > kind.nodes() {
            return Err(row.fault(format!("{} nodes, not {}", nodes.len(), kind.nodes())));
        }
        let label = label(number).map_err(|e| row.fault(e))?;
        let nodes = nodes.iter().map(|n| self.node(n, row)).collect::<Result<Vec<_>, _>>()?;
        Ok(Raw { label, kind, nodes, section: None, cell: None, line: row.line })
    }

    fn node_set(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NSET", "GENERATE", "UNSORTED"])?;
        let mut set = Vec::new();
        for row in card.rows() {
            if card.get("GENERATE").is_some() {
                set.extend(generated(&self.nodes, row)?);
                continue;
            }
            for word in row.fields().filter(|w| !w.is_empty()) {
                match label(word).ok().filter(|&number| self.nodes.get(number).is_none()) {
                    // Sets that only results are asked of often name what is not there.
                    Some(number) => self.deck.notes.push(format!(
                        "line {}: node {number} is not defined, and the set goes without it",
                        row.line
                    )),
                    None => set.extend(self.some_nodes(word, row)?),
                }
            }
        }
        join(self.node_sets.entry(card.need("NSET")?).or_default(), set);
        Ok(())
    }

    fn element_set(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["ELSET", "GENERATE", "UNSORTED"])?;
        let mut set = Vec::new();
        for row in card.rows() {
            if card.get("GENERATE").is_some() {
                set.extend(generated(&self.elements, row)?);
                continue;
            }
            for word in row.fields().filter(|w| !w.is_empty()) {
                set.extend(self.some_elements(word, row)?);
            }
        }
        join(self.element_sets.entry(card.need("ELSET")?).or_default(), set);
        Ok(())
    }

    fn surface(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&["NAME", "TYPE"])?;
        let surface = match card.word("TYPE").as_deref() {
            Some("NODE") => {
                let mut nodes = Vec::new();
                for row in card.rows() {
                    for word in row.fields().filter(|w| !w.is_empty()) {
                        nodes.extend(self.some_nodes(word, row)?);
                    }
                }
                Surface::Nodes(nodes)
            }
            None | Some("ELEMENT") => {
                let mut faces = Vec::new();
                for row in card.rows() {
                    let [target, side] = row.exactly("element or element set, S1 to S6")?;
                    for element in self.some_elements(target, row)? {
                        faces.push((element, self.face(element, side, "S", row)?));
                    }
                }
                Surface::Faces(faces)
            }
            Some(other) => {
                let other = quote(other);
                return Err(card.fault(format!("TYPE={other}: NODE and ELEMENT are supported")));
            }
        };
        self.surfaces.insert(card.need("NAME")?, surface);
        Ok(())
    }

    /// The face that `P3` or `S3` (by `letter`) is.
    pub(super) fn face(
        &self,
        element: u32,
        side: &str,
        letter: &str,
        row: Row<'_>,
    ) -> Result<u8, Fault> {
        let raw = &self.raw[element as usize];
        side_number(side, letter)
            .and_then(|n| raw.kind.face(n))
            .ok_or_else(|| row.fault(format!("element {} has no side {}", raw.label, quote(side))))
    }

    /// Elements to solids, now that all is known of them.
    pub(super) fn make(&mut self) -> Result<(), Fault> {
        if self.raw.is_empty() {
            return Err(Fault::whole("no elements: a deck needs *NODE and *ELEMENT"));
        }
        let bare = |r: &&Raw| !matches!(r.kind, Kind::Link(_)) && r.section.is_none();
        if let Some(raw) = self.raw.iter().find(bare) {
            let why = format!("element {} has no section", raw.label);
            return Err(Fault::at(raw.line, why));
        }
        self.ring()?;
        for i in 0..self.raw.len() {
            let raw = &self.raw[i];
            let Some(section) = &raw.section else { continue };
            let cell = match raw.kind {
                Kind::Link(_) => continue,
                Kind::Thin(thin) => self.thickened(i as u32, thin, section),
                Kind::Solid(shape) => {
                    // Of a bar the first number is an area: it came as a length.
                    let across = section.thickness * self.units.length();
                    Cell { across, ..whole(raw, shape, raw.nodes.clone(), section) }
                }
            };
            self.raw[i].cell = Some(self.deck.cells.len() as u32);
            self.deck.cells.push(cell);
        }
        self.deck.cold = vec![0.0; self.deck.nodes.len()];
        Ok(())
    }

    /// Every spring is described.
    pub(super) fn unlinked(&self) -> Result<(), Fault> {
        let open = |(i, raw): (usize, &Raw)| {
            let open = matches!(raw.kind, Kind::Link(_)) && !self.sprung.contains(&(i as u32));
            open.then(|| {
                let why = "has no *SPRING";
                Fault::at(raw.line, format!("element {} {why}", raw.label))
            })
        };
        self.raw.iter().enumerate().find_map(open).map_or(Ok(()), Err)
    }

    /// Solids of an element or a set.
    pub(super) fn some_cells(&self, word: &str, row: Row<'_>) -> Result<Vec<u32>, Fault> {
        let elements = self.some_elements(word, row)?;
        Ok(elements.into_iter().filter_map(|e| self.raw[e as usize].cell).collect())
    }
}

/// A cell of one material, integrated as its shape is.
fn whole(raw: &Raw, shape: Shape, nodes: Vec<u32>, section: &Section) -> Cell {
    Cell {
        label: raw.label,
        shape,
        nodes,
        material: section.material,
        orientation: section.orientation,
        across: 0.0,
        points: Vec::new(),
    }
}

/// `first, last, increment`: those that exist.
fn generated(map: &LabelMap<u32>, row: Row<'_>) -> Result<Vec<u32>, Fault> {
    let numbers = row.fields().map(label).collect::<Result<Vec<u32>, _>>();
    let (first, last, step) = match numbers.map_err(|e| row.fault(e))?.as_slice() {
        [first] => (*first, *first, 1),
        [first, last] => (*first, *last, 1),
        [first, last, step] => (*first, *last, *step),
        _ => return Err(row.fault("GENERATE needs: first, last, increment")),
    };
    let range: RangeInclusive<u32> = first..=last;
    let found = map.range(*range.start(), *range.end()).iter();
    Ok(found.filter(|(l, _)| (l - first) % step == 0).map(|p| p.1).collect())
}

fn join(set: &mut Vec<u32>, more: Vec<u32>) {
    set.extend(more);
    set.sort_unstable();
    set.dedup();
}

pub(super) fn name_of(card: &Card<'_>, parameter: &str) -> Result<Option<String>, Fault> {
    card.get(parameter).map(|_| card.need(parameter)).transpose()
}
