//! A mesh of Gmsh with what its groups are as a [`Deck`] of one step.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use glam::DVec3;

use super::{
    element::Element,
    groups::{Action, Groups, Load, Material as Given, Support},
    law::{Elastic, Expansion, Table},
    mesh::MAX_COUNT,
    model::{Cell, Deck, Material, Step},
    shape::Shape,
};
use crate::read::{Fault, ReadError, Units, gmsh, quote};

/// Names of what has so many dimensions.
const KINDS: [&str; 4] = ["point", "line", "surface", "volume"];
/// Dimensions of solids, and of whatever has nodes.
const VOLUMES: &[u8] = &[3];
const ANY: &[u8] = &[0, 1, 2, 3];

/// Reads a mesh of Gmsh from memory, and makes a deck of it by what its groups are; `name` is what
/// errors call it, and units are those of its lengths.
///
/// # Errors
/// What is damaged or not computed in the mesh; or all values that cannot be, and all groups that
/// are not there, no place of what is said of them, or of which too little is said. In one line.
pub fn parse_mesh(
    bytes: &[u8],
    name: &Path,
    units: Units,
    groups: &Groups,
) -> Result<Deck, ReadError> {
    let mesh = gmsh::parse(bytes, units).map_err(|fault| fault.of(name))?;
    if mesh.points.len().max(mesh.elements.len()) > MAX_COUNT {
        return Err(Fault::whole(format!("more than {MAX_COUNT} nodes or elements")).of(name));
    }
    Builder::new(mesh, groups).deck().map_err(|fault| fault.of(&groups.path))
}

/// The corners of a face, ascending; of a triangle the last is no node.
type Corners = [u32; 4];

fn corners(nodes: &[u32]) -> Corners {
    let count = if nodes.len().is_multiple_of(3) { 3 } else { 4 };
    let mut corners = [u32::MAX; 4];
    corners.iter_mut().zip(nodes).take(count).for_each(|(corner, &node)| *corner = node);
    corners.sort_unstable();
    corners
}

/// Nodes of a face of a solid.
fn face_nodes(cell: &Cell, face: usize) -> Vec<u32> {
    let face = cell.shape.faces().nth(face).into_iter().flatten();
    face.map(|&i| cell.nodes[i]).collect()
}

/// What a solid of so many nodes is; bricks of eight bend by bubbles, as C3D8I.
fn shape(nodes: usize) -> Option<Shape> {
    Some(match nodes {
        4 => Shape::Tet4,
        10 => Shape::Tet10,
        6 => Shape::Wedge6,
        15 => Shape::Wedge15,
        8 => Shape::Hex8Bubbles,
        20 => Shape::Hex20,
        _ => return None,
    })
}

/// Of which dimension a group is that a load acts on.
fn acted_on(action: &Action) -> &'static [u8] {
    match action {
        Action::Pressure { .. } | Action::Traction { .. } => &[2],
        Action::Force { .. } => &[0, 1, 2],
        Action::Weight { .. } => VOLUMES,
        Action::Temperature { .. } => ANY,
    }
}

/// A physical group of which something is said.
struct Group<'a> {
    /// Where that is said, for messages.
    place: String,
    name: &'a str,
    /// Its elements; none where there is no such group, which is a fault.
    elements: Vec<u32>,
}

struct Builder<'a> {
    elements: Vec<gmsh::Element>,
    named: BTreeMap<(u8, String), Vec<u32>>,
    groups: &'a Groups,
    deck: Deck,
    step: Step,
    /// The solid that each element of the mesh is.
    cells: Vec<Option<u32>>,
    /// Nodes that belong to a solid.
    is_solid: Vec<bool>,
    /// Faces of solids where the mesh has an element of a surface.
    faces: BTreeMap<Corners, Vec<(u32, usize)>>,
    /// Groups of which something is said.
    used: BTreeSet<(u8, String)>,
    faults: Vec<Fault>,
}

impl<'a> Builder<'a> {
    fn new(mesh: gmsh::Mesh, groups: &'a Groups) -> Self {
        let gmsh::Mesh { labels, points, elements, groups: named, left_out } = mesh;
        let mut deck =
            Deck { cold: vec![0.0; points.len()], nodes: points, labels, ..Deck::default() };
        if left_out > 0 {
            deck.notes
                .push(format!("{left_out} elements belong to no physical group and were left out"));
        }
        Self {
            groups,
            step: Step { name: "loads".into(), number: 1, ..Step::default() },
            cells: vec![None; elements.len()],
            is_solid: vec![false; deck.nodes.len()],
            faces: BTreeMap::new(),
            used: BTreeSet::new(),
            faults: Vec::new(),
            elements,
            named,
            deck,
        }
    }

    /// All of it. What rests on what solids are made of comes after that, but for its names.
    fn deck(mut self) -> Result<Deck, Fault> {
        let Groups { supports, loads, .. } = self.groups;
        self.faults = self.groups.faults();
        let before = self.faults.len();
        self.solids();
        let are_made = self.faults.len() == before;
        let named =
            |(i, s): (usize, &'a Support)| self.group(format!("supports[{i}]"), &s.group, ANY);
        let held: Vec<Group> = supports.iter().enumerate().map(named).collect();
        let named = |(i, l): (usize, &'a Load)| {
            Some(self.group(format!("loads[{i}]"), l.group.as_deref()?, acted_on(&l.action)))
        };
        let loaded: Vec<Option<Group>> = loads.iter().enumerate().map(named).collect();
        if are_made {
            self.surfaces();
            supports.iter().zip(&held).for_each(|(support, group)| self.support(support, group));
            for (i, (load, group)) in loads.iter().zip(&loaded).enumerate() {
                self.load(&format!("loads[{i}]"), load.action, group.as_ref());
            }
            self.swelling();
        }
        Fault::all(self.faults)?;
        let idle = self.named.keys().filter(|key| !self.used.contains(*key));
        self.deck.notes.extend(idle.map(|(dimension, name)| {
            format!("nothing is said of the {} {}", KINDS[usize::from(*dimension)], quote(name))
        }));
        self.deck.steps.push(self.step);
        Ok(self.deck)
    }

    fn fault(&mut self, place: &str, why: &str) {
        self.faults.push(Fault::whole(format!("{place}: {why}")));
    }

    /// The physical group of that name, which must have one of these dimensions.
    fn group(&mut self, place: String, name: &'a str, dimensions: &[u8]) -> Group<'a> {
        let key = |dimension: u8| (dimension, name.to_owned());
        let found: Vec<u8> =
            ANY.iter().copied().filter(|&d| self.named.contains_key(&key(d))).collect();
        let fit: Vec<u8> = found.iter().copied().filter(|d| dimensions.contains(d)).collect();
        let words = |all: &[u8]| {
            let words: Vec<&str> = all.iter().map(|&d| KINDS[usize::from(d)]).collect();
            words.join(" or ")
        };
        let why = match (found.as_slice(), fit.as_slice()) {
            (_, &[one]) => {
                self.used.insert(key(one));
                let elements = self.named.get(&key(one)).cloned().unwrap_or_default();
                return Group { place, name, elements };
            }
            ([], _) => format!("no physical group {}; the mesh has {}", quote(name), self.known()),
            (_, []) => format!(
                "{} is a {}, and needed is a {}",
                quote(name),
                words(&found),
                words(dimensions)
            ),
            _ => format!(
                "{} is a {} at once: give each a name of its own",
                quote(name),
                words(&fit).replace(" or ", " and a ")
            ),
        };
        self.fault(&place, &why);
        Group { place, name, elements: Vec::new() }
    }

    /// Names of the groups of the mesh.
    fn known(&self) -> String {
        /// So many are told.
        const MOST: usize = 12;
        let names = self.named.keys().map(|k| quote(&k.1)).take(MOST);
        let names: Vec<String> = names.collect();
        match (names.is_empty(), self.named.len() > MOST) {
            (true, _) => "none: name its volumes, surfaces, lines and points".into(),
            (_, true) => names.join(", ") + ", …",
            _ => names.join(", "),
        }
    }

    /// Solids, and what they are made of.
    fn solids(&mut self) {
        let solids: Vec<u32> = (0u32..)
            .zip(&self.elements)
            .filter_map(|(i, e)| (e.dimension == 3).then_some(i))
            .collect();
        let mut of: Vec<Option<u32>> = vec![None; self.elements.len()];
        for (i, given) in self.groups.materials.iter().enumerate() {
            let place = format!("materials[{i}]");
            let all = match &given.group {
                Some(name) => self.group(place.clone(), name, VOLUMES).elements,
                None => solids.clone(),
            };
            let twice = all.iter().find_map(|&e| Some((e, of[e as usize]?)));
            if let Some((e, other)) = twice {
                let label = self.elements[e as usize].label;
                self.fault(&place, &format!("element {label} is of materials[{other}] already"));
            }
            all.iter().for_each(|&e| of[e as usize] = Some(i as u32));
            self.deck.materials.push(material(given));
        }
        let bare: Vec<u32> = solids.iter().copied().filter(|&e| of[e as usize].is_none()).collect();
        if let [first, rest @ ..] = bare.as_slice() {
            let label = self.elements[*first as usize].label;
            let more =
                if rest.is_empty() { String::new() } else { format!(" and {} more", rest.len()) };
            let why = format!("element {label}{more} are in no volume that has a material");
            self.fault("materials", &why);
        }
        for e in solids {
            let element = &self.elements[e as usize];
            let (Some(material), Some(shape)) = (of[e as usize], shape(element.nodes.len())) else {
                continue;
            };
            self.cells[e as usize] = Some(self.deck.cells.len() as u32);
            element.nodes.iter().for_each(|&n| self.is_solid[n as usize] = true);
            self.deck.cells.push(Cell {
                label: element.label,
                shape,
                nodes: element.nodes.clone(),
                material,
                orientation: None,
                across: 0.0,
                points: Vec::new(),
            });
        }
    }

    /// Faces of solids where the mesh has surfaces.
    fn surfaces(&mut self) {
        let surfaces = self.elements.iter().filter(|e| e.dimension == 2);
        self.faces = surfaces.map(|e| (corners(&e.nodes), Vec::new())).collect();
        for (i, cell) in (0u32..).zip(&self.deck.cells) {
            for face in 0..cell.shape.faces().len() {
                if let Some(found) = self.faces.get_mut(&corners(&face_nodes(cell, face))) {
                    found.push((i, face));
                }
            }
        }
    }

    /// Nodes of solids in a group, or of all solids.
    fn nodes(&mut self, group: Option<&Group>) -> Vec<u32> {
        let Some(Group { place, name, elements }) = group else {
            let count = self.is_solid.len() as u32;
            return (0..count).filter(|&n| self.is_solid[n as usize]).collect();
        };
        let all = elements.iter().flat_map(|&e| &self.elements[e as usize].nodes).copied();
        let nodes: BTreeSet<u32> = all.filter(|&n| self.is_solid[n as usize]).collect();
        if nodes.is_empty() && !elements.is_empty() {
            self.fault(place, &format!("no node of {} belongs to a solid", quote(name)));
        }
        nodes.into_iter().collect()
    }

    fn support(&mut self, support: &Support, group: &Group) {
        let nodes = self.nodes(Some(group));
        let mut torn = None;
        for ((axis, is_held), moved) in (0u8..).zip(support.axes()).zip(support.moved_mm) {
            let value = 1e-3 * moved;
            for &node in nodes.iter().filter(|_| is_held) {
                let before = self.step.held.insert((node, axis), value);
                torn = torn.or(before.filter(|b| *b != value).map(|_| node));
            }
        }
        if let Some(node) = torn {
            let label = self.deck.labels[node as usize];
            let why = format!("node {label} is moved elsewhere by another support");
            self.fault(&group.place, &why);
        }
    }

    /// What acts on a group, or on all solids.
    fn load(&mut self, place: &str, action: Action, group: Option<&Group>) {
        match (action, group) {
            (Action::Pressure { pressure_kpa }, Some(group)) => {
                for (cell, face) in self.sides(group, true) {
                    let at = (cell, face as u8);
                    *self.step.pressures.entry(at).or_default() += 1e3 * pressure_kpa;
                }
            }
            (Action::Traction { traction_kpa }, Some(group)) => {
                let faces = self.sides(group, false);
                self.pull(&faces, 1e3 * DVec3::from_array(traction_kpa));
            }
            (Action::Force { force_kn }, Some(group)) => {
                self.force(group, 1e3 * DVec3::from_array(force_kn));
            }
            (Action::Weight { gravity_m_s2 }, _) => {
                self.weight(place, group, DVec3::from_array(gravity_m_s2));
            }
            (Action::Temperature { uniform_k }, _) => {
                let nodes = self.nodes(group);
                self.step.warm.resize(self.deck.nodes.len(), 0.0);
                nodes.into_iter().for_each(|n| self.step.warm[n as usize] = uniform_k);
            }
            // That it needs a group has been said.
            (_, None) => {}
        }
    }

    /// Faces of solids that a physical surface is, each once; a pressure asks for those `outside`.
    fn sides(&mut self, group: &Group, outside: bool) -> Vec<(u32, usize)> {
        let Group { place, name, elements } = group;
        let all: BTreeSet<Corners> =
            elements.iter().map(|&e| corners(&self.elements[e as usize].nodes)).collect();
        let (mut faces, mut bare, mut inner) = (Vec::new(), 0, 0);
        for corners in &all {
            match self.faces.get(corners).map(Vec::as_slice) {
                None | Some([]) => bare += 1,
                Some([one]) => faces.push(*one),
                Some([one, ..]) => {
                    inner += 1;
                    faces.push(*one);
                }
            }
        }
        let (name, count) = (quote(name), all.len());
        if bare > 0 {
            self.fault(place, &format!("{bare} of {count} faces of {name} belong to no solid"));
        }
        if outside && inner > 0 {
            let why = "lie between two solids, where a pressure has no side: give a traction";
            self.fault(place, &format!("{inner} of {count} faces of {name} {why}"));
        }
        faces
    }

    /// Adds what a traction (Pa) on faces is at their nodes.
    fn pull(&mut self, faces: &[(u32, usize)], traction: DVec3) {
        for &(cell, face) in faces {
            let nodes = face_nodes(&self.deck.cells[cell as usize], face);
            let element = Element::new(&self.deck, cell as usize);
            for (jets, area) in element.face_points(face) {
                let force = area.length() * traction;
                for (jet, &node) in jets.iter().zip(&nodes) {
                    add(&mut self.step.forces, node, jet.value * force);
                }
            }
        }
    }

    /// Spreads a force (N) over a surface by area, over a line by length, over points alike.
    fn force(&mut self, group: &Group, force: DVec3) {
        let Group { place, name, elements } = group;
        let Some(first) = elements.first() else { return };
        if self.elements[*first as usize].dimension == 2 {
            let faces = self.sides(group, false);
            let area = faces.iter().map(|&(cell, face)| {
                let element = Element::new(&self.deck, cell as usize);
                element.face_points(face).iter().map(|p| p.1.length()).sum::<f64>()
            });
            let area: f64 = area.sum();
            if area > 0.0 {
                self.pull(&faces, force / area);
            }
            return;
        }
        let shares: Vec<(u32, f64)> = elements.iter().flat_map(|&e| self.shares(e)).collect();
        let all: f64 = shares.iter().map(|s| s.1).sum();
        let loose = shares.iter().find(|s| !self.is_solid[s.0 as usize]);
        if let Some(&(node, _)) = loose {
            let label = self.deck.labels[node as usize];
            let name = quote(name);
            self.fault(place, &format!("node {label} of {name} belongs to no solid"));
        } else if all > 0.0 {
            for (node, share) in shares {
                add(&mut self.step.forces, node, share / all * force);
            }
        } else {
            self.fault(place, &format!("{} has no length", quote(name)));
        }
    }

    /// What an even load is at the nodes of a point (1) or of a line (its length, m): Simpson's
    /// shares where it has a node between its ends.
    fn shares(&self, element: u32) -> Vec<(u32, f64)> {
        let at = |node: u32| self.deck.nodes[node as usize];
        match *self.elements[element as usize].nodes.as_slice() {
            [a] => vec![(a, 1.0)],
            [a, b] => [a, b].map(|n| (n, 0.5 * at(a).distance(at(b)))).to_vec(),
            [a, b, middle] => {
                let sixth = (at(a).distance(at(middle)) + at(middle).distance(at(b))) / 6.0;
                vec![(a, sixth), (b, sixth), (middle, 4.0 * sixth)]
            }
            _ => Vec::new(),
        }
    }

    fn weight(&mut self, place: &str, group: Option<&Group>, acceleration: DVec3) {
        let cells: Vec<u32> = match group {
            Some(group) => group.elements.iter().filter_map(|&e| self.cells[e as usize]).collect(),
            None => (0..self.deck.cells.len() as u32).collect(),
        };
        self.lacks(place, &cells, |m| m.density.is_none(), "weight", "density_kg_m3");
        self.step.pulls.extend(cells.into_iter().map(|c| (c, acceleration)));
    }

    /// What is warmed says how it swells.
    fn swelling(&mut self) {
        if self.step.warm.is_empty() {
            return;
        }
        let is_warm = |c: &Cell| c.nodes.iter().any(|&n| self.step.warm[n as usize] != 0.0);
        let cells: Vec<u32> =
            (0u32..).zip(&self.deck.cells).filter(|c| is_warm(c.1)).map(|c| c.0).collect();
        self.lacks(
            "loads",
            &cells,
            |m| m.expansion.is_none(),
            "a temperature",
            "expansion_1e6_k (0 for none)",
        );
    }

    /// Names the materials of these cells that lack what a load asks for.
    fn lacks(
        &mut self,
        place: &str,
        cells: &[u32],
        lacks: impl Fn(&Material) -> bool,
        load: &str,
        field: &str,
    ) {
        let all: BTreeSet<u32> =
            cells.iter().map(|&c| self.deck.cells[c as usize].material).collect();
        let lacking: Vec<u32> =
            all.into_iter().filter(|&i| lacks(&self.deck.materials[i as usize])).collect();
        for i in lacking {
            let why = format!("{load} acts on materials[{i}], which has no {field}");
            self.fault(place, &why);
        }
    }
}

/// The material of a deck.
fn material(given: &Given) -> Material {
    let expansion = given
        .expansion_1e6_k
        .map(|a| Expansion { table: Table::constant([1e-6 * a; 3]), zero: 0.0 });
    Material {
        name: given.group.clone().unwrap_or_else(|| "all solids".into()),
        elastic: Some(Elastic::Isotropic(Table::constant([
            1e9 * given.modulus_gpa,
            given.poisson,
        ]))),
        expansion,
        density: given.density_kg_m3.map(|rho| Table::constant([rho])),
        ..Material::default()
    }
}

/// Adds a force at a node, component by component.
fn add(forces: &mut BTreeMap<(u32, u8), f64>, node: u32, force: DVec3) {
    for (axis, value) in (0u8..).zip(force.to_array()).filter(|c| c.1 != 0.0) {
        *forces.entry((node, axis)).or_default() += value;
    }
}

#[cfg(test)]
mod tests;
