//! What a mesh must fulfil before anything is computed on it.

use std::collections::HashMap;

use super::{Cell, ElementId, Mesh, MeshError, Subject, hex};

/// A corner whose Jacobian is below this share of the product of its edges counts as flat.
const FLAT: f64 = 1e-9;

impl Mesh {
    /// Checks everything that elements rely on and returns notes for the user (unused nodes, bodies
    /// that overlap).
    ///
    /// # Errors
    /// The first thing wrong, naming node or element: a coordinate that is not finite, a node,
    /// region or set member out of range, a node twice in one element, an inverted or flat
    /// hexahedron (its Jacobian at all corners), a shell or interface without area, a rod without
    /// length, a duplicate.
    pub(crate) fn check(&self) -> Result<Vec<String>, MeshError> {
        self.check_size()?;
        if let Some(n) = self.nodes.iter().position(|p| !p.is_finite()) {
            let (n, p) = (n as u32, self.nodes[n]);
            return Err(MeshError::new(
                Subject::Node(n),
                format!(
                    "{}: coordinates ({}, {}, {}) are not finite",
                    self.node_name(n),
                    p.x,
                    p.y,
                    p.z
                ),
            ));
        }
        self.check_nodes(&self.hexes, ElementId::Hex, true)?;
        self.check_nodes(&self.shells, ElementId::Shell, true)?;
        self.check_nodes(&self.rods, ElementId::Rod, true)?;
        // At the tip of a joint both faces share nodes.
        self.check_nodes(&self.interfaces, ElementId::Interface, false)?;
        self.check_shapes()?;
        self.check_duplicates(&self.hexes, ElementId::Hex)?;
        self.check_duplicates(&self.shells, ElementId::Shell)?;
        self.check_duplicates(&self.rods, ElementId::Rod)?;
        self.check_duplicates(&self.interfaces, ElementId::Interface)?;
        self.check_sets()?;
        Ok(self.notes())
    }

    fn check_size(&self) -> Result<(), MeshError> {
        let most = [
            self.nodes.len(),
            self.hexes.len(),
            self.shells.len(),
            self.rods.len(),
            self.interfaces.len(),
        ]
        .into_iter()
        .max();
        match most {
            Some(n) if n > u32::MAX as usize / 8 => Err(MeshError::whole(format!(
                "{n} nodes or elements are too many: at most 536 million"
            ))),
            _ => Ok(()),
        }
    }

    fn check_nodes<const N: usize>(
        &self,
        cells: &[Cell<N>],
        id: impl Fn(u32) -> ElementId,
        distinct: bool,
    ) -> Result<(), MeshError> {
        for (i, cell) in cells.iter().enumerate() {
            let wrong = |what: String| {
                let id = id(i as u32);
                Err(MeshError::new(Subject::Element(id), format!("{}: {what}", self.name(id))))
            };
            if let Some(n) = cell.nodes.iter().find(|&&n| n as usize >= self.nodes.len()) {
                return wrong(format!(
                    "node index {n} is not in the mesh, which has {} nodes",
                    self.nodes.len()
                ));
            }
            if cell.region as usize >= self.regions.len() {
                return wrong(format!(
                    "region {} is not in the mesh, which has {} regions",
                    cell.region,
                    self.regions.len()
                ));
            }
            for a in 0..N {
                if distinct && cell.nodes[..a].contains(&cell.nodes[a]) {
                    return wrong(format!(
                        "{} occurs twice in it; collapsed elements are not supported",
                        self.node_name(cell.nodes[a])
                    ));
                }
            }
        }
        Ok(())
    }

    fn check_shapes(&self) -> Result<(), MeshError> {
        let wrong = |id: ElementId, what: String| {
            Err(MeshError::new(Subject::Element(id), format!("{}: {what}", self.name(id))))
        };
        for h in 0..self.hexes.len() as u32 {
            let corners = self.corners(h);
            if let Some(c) = (0..8).find(|&c| {
                hex::corner_quality(&corners, c).is_nan()
                    || hex::corner_quality(&corners, c) <= FLAT
            }) {
                let jacobian = hex::jacobian(&corners, hex::CORNERS[c]).determinant();
                let node = self.node_name(self.hexes[h as usize].nodes[c]);
                return wrong(
                    ElementId::Hex(h),
                    format!(
                        "inverted or flat: its Jacobian at corner {} ({node}) is {jacobian:.3e} m³; \
                         nodes 1–4 must run counterclockwise seen from nodes 5–8",
                        c + 1
                    ),
                );
            }
        }
        for (i, shell) in self.shells.iter().enumerate() {
            let [a, b, c, d] = shell.nodes.map(|n| self.nodes[n as usize]);
            let normal = (c - a).cross(d - b);
            // Each corner must turn the same way as the whole: no bow tie, no re-entrant or flat
            // corner.
            let turns = [(a, b, d), (b, c, a), (c, d, b), (d, a, c)]
                .map(|(p, next, last)| (next - p).cross(last - p).dot(normal));
            if turns.iter().any(|&t| t.is_nan() || t <= FLAT * normal.length_squared()) {
                return wrong(
                    ElementId::Shell(i as u32),
                    "without area, twisted or re-entrant: its four nodes must run around it".into(),
                );
            }
        }
        for (i, joint) in self.interfaces.iter().enumerate() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|m| {
                0.5 * (self.nodes[joint.nodes[m] as usize]
                    + self.nodes[joint.nodes[m + 4] as usize])
            });
            let (area, reach) = (
                (c - a).cross(d - b).length(),
                (c - a).length_squared().max((d - b).length_squared()),
            );
            if area.is_nan() || area <= FLAT * reach {
                return wrong(
                    ElementId::Interface(i as u32),
                    "without area: its first four nodes are one face, its last four the other"
                        .into(),
                );
            }
        }
        let reach = self.bounds().map_or(0.0, |[low, high]| (high - low).length());
        for (i, rod) in self.rods.iter().enumerate() {
            let [a, b] = rod.nodes.map(|n| self.nodes[n as usize]);
            if (b - a).length() <= 1e-12 * reach {
                return wrong(
                    ElementId::Rod(i as u32),
                    "without length: its two nodes are in one place".into(),
                );
            }
        }
        Ok(())
    }

    fn check_duplicates<const N: usize>(
        &self,
        cells: &[Cell<N>],
        id: impl Fn(u32) -> ElementId,
    ) -> Result<(), MeshError> {
        let mut seen = HashMap::with_capacity(cells.len());
        for (i, cell) in (0u32..).zip(cells) {
            let mut key = cell.nodes;
            key.sort_unstable();
            if let Some(first) = seen.insert(key, i) {
                let (first, id) = (self.name(id(first)), id(i));
                return Err(MeshError::new(
                    Subject::Element(id),
                    format!("{}: has the same nodes as {first}; remove one of them", self.name(id)),
                ));
            }
        }
        Ok(())
    }

    fn check_sets(&self) -> Result<(), MeshError> {
        let wrong = |set: &str, what: &str| {
            Err(MeshError::whole(format!("set {set}: names {what} that is not in the mesh")))
        };
        let has = |e: ElementId| match e {
            ElementId::Hex(i) => (i as usize) < self.hexes.len(),
            ElementId::Shell(i) => (i as usize) < self.shells.len(),
            ElementId::Rod(i) => (i as usize) < self.rods.len(),
            ElementId::Interface(i) => (i as usize) < self.interfaces.len(),
        };
        for (set, nodes) in &self.node_sets {
            if nodes.iter().any(|&n| n as usize >= self.nodes.len()) {
                return wrong(set, "a node");
            }
        }
        for (set, elements) in &self.element_sets {
            if elements.iter().any(|&e| !has(e)) {
                return wrong(set, "an element");
            }
        }
        for (set, faces) in &self.face_sets {
            if faces.iter().any(|f| f.face > 5 || !has(ElementId::Hex(f.hex))) {
                return wrong(set, "a face");
            }
        }
        Ok(())
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let unused = self.unused_nodes();
        if let Some(&first) = unused.first() {
            notes.push(format!(
                "{} of {} nodes belong to no element, {} first; they are left out",
                unused.len(),
                self.nodes.len(),
                self.node_name(first)
            ));
        }
        if let Some(run) = self.face_table().shared().find(|run| run.len() > 2) {
            let names: Vec<String> =
                run.iter().map(|(_, f)| self.name(ElementId::Hex(f.hex))).collect();
            notes.push(format!("{} share one face: bodies overlap there", names.join(", ")));
        }
        notes
    }

    /// Nodes that belong to no element, in order.
    #[must_use]
    pub fn unused_nodes(&self) -> Vec<u32> {
        let mut used = vec![false; self.nodes.len()];
        let solids = self.hexes.iter().chain(&self.interfaces).flat_map(|c| c.nodes);
        let thin =
            self.shells.iter().flat_map(|c| c.nodes).chain(self.rods.iter().flat_map(|c| c.nodes));
        for node in solids.chain(thin) {
            used[node as usize] = true;
        }
        (0..self.nodes.len() as u32).filter(|&n| !used[n as usize]).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::{Rod, Shell, block};
    use super::*;

    fn two() -> Mesh {
        block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap()
    }

    fn reason(mesh: &Mesh) -> String {
        mesh.check().unwrap_err().to_string()
    }

    #[test]
    fn good_meshes_pass_and_unused_nodes_are_told() {
        let mut mesh = two();
        assert_eq!(mesh.check(), Ok(vec![]));
        mesh.nodes.push(DVec3::ONE);
        assert!(
            mesh.check().unwrap()[0].contains("1 of 13 nodes belong to no element, node 13 first")
        );
    }

    #[test]
    fn every_flaw_names_its_element() {
        let mut mesh = two();
        mesh.hexes[1].nodes.swap(1, 3);
        assert!(reason(&mesh).starts_with("hex 2: inverted or flat"), "{}", reason(&mesh));
        mesh.labels.hexes = vec![70, 71];
        assert!(reason(&mesh).starts_with("hex 71: inverted"));
        let mut mesh = two();
        for n in 6..12 {
            mesh.nodes[n].z = 0.0;
        }
        assert!(reason(&mesh).starts_with("hex 1: inverted or flat"));
        let mut mesh = two();
        mesh.hexes.push(mesh.hexes[0]);
        mesh.hexes[2].nodes.rotate_left(4);
        mesh.hexes[2].nodes =
            [4, 5, 6, 7, 0, 1, 2, 3].map(|i: usize| mesh.hexes[0].nodes[(i + 4) % 8]);
        assert_eq!(reason(&mesh), "hex 3: has the same nodes as hex 1; remove one of them");
        let mut mesh = two();
        mesh.hexes[0].nodes[5] = 99;
        assert_eq!(reason(&mesh), "hex 1: node index 99 is not in the mesh, which has 12 nodes");
        let mut mesh = two();
        mesh.hexes[0].nodes[5] = mesh.hexes[0].nodes[1];
        assert!(reason(&mesh).starts_with("hex 1: node 2 occurs twice"));
        let mut mesh = two();
        mesh.nodes[3].y = f64::NAN;
        assert!(reason(&mesh).starts_with("node 4: coordinates (0, NaN, 0) are not finite"));
        let mut mesh = two();
        mesh.shells.push(Shell { nodes: [0, 1, 3, 4], region: 0 });
        assert!(reason(&mesh).starts_with("shell 1: without area, twisted"));
        let mut mesh = two();
        mesh.nodes.push(mesh.nodes[0]);
        mesh.rods.push(Rod { nodes: [0, 12], region: 0 });
        assert!(reason(&mesh).starts_with("rod 1: without length"));
        let mut mesh = two();
        mesh.node_sets.insert("far".into(), vec![12]);
        assert_eq!(reason(&mesh), "set far: names a node that is not in the mesh");
        let mut mesh = two();
        mesh.hexes[1].region = 1;
        assert!(reason(&mesh).starts_with("hex 2: region 1 is not in the mesh"));
    }
}
