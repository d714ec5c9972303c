//! Bodies cut open, and points that are one.

use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

use super::{FaceTable, HexFace, Interface, Mesh};

impl Mesh {
    /// Cuts the body open along inner faces: where `cut` names a region for a face (its two sides,
    /// the lower hexahedron first), nodes are doubled and an interface of that region is put
    /// between. Where cuts cross or end, every piece keeps what still hangs together through uncut
    /// faces: at the tip of a cut both sides share nodes. Copies join the sets of their originals;
    /// shells and existing interfaces stay with their hexahedron, rods with the lowest one.
    pub(crate) fn separate(&mut self, cut: impl Fn(&Self, [HexFace; 2]) -> Option<u32>) {
        let table = self.face_table();
        let cuts: Vec<([HexFace; 2], u32)> = {
            let mut cuts: Vec<_> =
                table.inner().filter_map(|sides| Some((sides, cut(self, sides)?))).collect();
            cuts.sort_unstable();
            cuts
        };
        let owners = self.owners(&table);
        let before = self.hexes.clone();
        self.double(&table, &cuts);
        self.follow(&before, &owners);
        for &([a, b], region) in &cuts {
            let (first, second) = (self.face(a), self.face(b));
            // The original numbers tell which corner of b lies opposite which of a.
            let (old_a, old_b) = (old_face(&before, a), old_face(&before, b));
            let opposite =
                old_a.map(|n| old_b.iter().position(|&m| m == n).map_or(n, |at| second[at]));
            let mut nodes = [0; 8];
            nodes[..4].copy_from_slice(&first);
            nodes[4..].copy_from_slice(&opposite);
            self.interfaces.push(Interface { nodes, region });
        }
    }

    /// Gives every piece around a cut node its own copy.
    fn double(&mut self, table: &FaceTable, cuts: &[([HexFace; 2], u32)]) {
        let mut on_cut = vec![false; self.nodes.len()];
        for (sides, _) in cuts {
            self.face(sides[0]).iter().for_each(|&n| on_cut[n as usize] = true);
        }
        // Union-find over (hexahedron, corner): joined through every face that is not cut.
        let mut parent: Vec<u32> = (0..8 * self.hexes.len() as u32).collect();
        let slot = |mesh: &Self, hex: u32, node: u32| {
            let corner =
                mesh.hexes[hex as usize].nodes.iter().position(|&n| n == node).unwrap_or(0);
            8 * hex + corner as u32
        };
        for sides in table.inner() {
            let nodes = self.face(sides[0]);
            if nodes.iter().all(|&n| !on_cut[n as usize])
                || cuts.binary_search_by(|(s, _)| s.cmp(&sides)).is_ok()
            {
                continue;
            }
            for node in nodes.into_iter().filter(|&n| on_cut[n as usize]) {
                let (a, b) = (
                    root(&mut parent, slot(self, sides[0].hex, node)),
                    root(&mut parent, slot(self, sides[1].hex, node)),
                );
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        // The piece with the lowest hexahedron keeps the node, the others get copies in order.
        let mut first = HashMap::new();
        let mut copies: HashMap<u32, u32> = HashMap::new();
        let mut originals = Vec::new();
        for hex in 0..self.hexes.len() {
            for corner in 0..8 {
                let node = self.hexes[hex].nodes[corner];
                if !on_cut.get(node as usize).copied().unwrap_or(false) {
                    continue;
                }
                let piece = root(&mut parent, (8 * hex + corner) as u32);
                if *first.entry(node).or_insert(piece) == piece {
                    continue;
                }
                self.hexes[hex].nodes[corner] = *copies.entry(piece).or_insert_with(|| {
                    self.nodes.push(self.nodes[node as usize]);
                    originals.push(node);
                    self.nodes.len() as u32 - 1
                });
            }
        }
        let base = on_cut.len() as u32;
        let mut copies_of: HashMap<u32, Vec<u32>> = HashMap::new();
        for (i, &original) in (0u32..).zip(&originals) {
            copies_of.entry(original).or_default().push(base + i);
        }
        for set in self.node_sets.values_mut() {
            let more: Vec<u32> =
                set.iter().filter_map(|n| copies_of.get(n)).flatten().copied().collect();
            set.extend(more);
            set.sort_unstable();
        }
        if !self.labels.nodes.is_empty() {
            self.labels.nodes.extend(
                originals.iter().map(|&n| self.labels.nodes[n as usize]).collect::<Vec<_>>(),
            );
        }
    }

    /// The hexahedron behind each shell, and behind both faces of each interface.
    fn owners(&self, table: &FaceTable) -> (Vec<Option<u32>>, Vec<[Option<u32>; 2]>) {
        let owner = |nodes: [u32; 4]| table.find(nodes).first().map(|(_, f)| f.hex);
        let shells = self.shells.iter().map(|s| owner(s.nodes)).collect();
        let half = |c: &Interface, from: usize| std::array::from_fn(|m| c.nodes[from + m]);
        (shells, self.interfaces.iter().map(|c| [owner(half(c, 0)), owner(half(c, 4))]).collect())
    }

    /// Renumbers shells and interfaces as the hexahedra behind them were.
    fn follow(
        &mut self,
        before: &[super::Hex],
        owners: &(Vec<Option<u32>>, Vec<[Option<u32>; 2]>),
    ) {
        let Self { hexes, shells, interfaces, .. } = self;
        let renumber = |nodes: &mut [u32], owner: Option<u32>| {
            let Some(hex) = owner.map(|h| h as usize) else { return };
            for node in nodes {
                if let Some(corner) = before[hex].nodes.iter().position(|n| n == node) {
                    *node = hexes[hex].nodes[corner];
                }
            }
        };
        for (shell, owner) in shells.iter_mut().zip(&owners.0) {
            renumber(&mut shell.nodes, *owner);
        }
        for (joint, owner) in interfaces.iter_mut().zip(&owners.1) {
            let (first, second) = joint.nodes.split_at_mut(4);
            renumber(first, owner[0]);
            renumber(second, owner[1]);
        }
    }
}

fn old_face(hexes: &[super::Hex], face: HexFace) -> [u32; 4] {
    super::hex::FACES[usize::from(face.face)].map(|c| hexes[face.hex as usize].nodes[c])
}

fn root(parent: &mut [u32], mut slot: u32) -> u32 {
    while parent[slot as usize] != slot {
        parent[slot as usize] = parent[parent[slot as usize] as usize];
        slot = parent[slot as usize];
    }
    slot
}

/// For every point the number of the first kept one within `tolerance`, and the kept points.
pub(super) fn first_within(points: &[DVec3], tolerance: f64) -> (Vec<u32>, Vec<DVec3>) {
    // Boxes of the tolerance's size: whatever is near is in one of 27.
    let place = |p: DVec3| (p / tolerance).floor().as_i64vec3();
    let mut boxes: HashMap<I64Vec3, Vec<u32>> = HashMap::new();
    let mut kept: Vec<DVec3> = Vec::new();
    let mut target = Vec::with_capacity(points.len());
    for &p in points {
        let home = place(p);
        let near = (0..27i64).flat_map(|i| {
            let there = home.saturating_add(I64Vec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
            boxes.get(&there).into_iter().flatten().copied()
        });
        let found = near.filter(|&n| kept[n as usize].distance(p) <= tolerance).min();
        target.push(found.unwrap_or_else(|| {
            let new = kept.len() as u32;
            boxes.entry(home).or_default().push(new);
            kept.push(p);
            new
        }));
    }
    (target, kept)
}

#[cfg(test)]
mod tests {
    use super::super::{Shell, block};
    use super::*;

    #[test]
    fn merging_does_not_depend_on_boxes() {
        let points: Vec<DVec3> =
            (0..50).map(|i| DVec3::new(0.1 * f64::from(i), 0.0, -1e-12 * f64::from(i))).collect();
        let twice: Vec<DVec3> =
            points.iter().chain(&points).map(|p| *p + DVec3::splat(4.9e-7)).collect();
        let (target, kept) = first_within(&twice, 1e-6);
        assert_eq!(kept.len(), 50);
        assert!((0..50).all(|i| target[i] == i as u32 && target[i + 50] == i as u32));
    }

    #[test]
    fn a_cut_through_puts_interfaces_with_their_normal_from_first_to_last() {
        let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0], &[0.0, 1.0], "c").unwrap();
        let joint = mesh.region("joint");
        mesh.separate(|m, [a, _]| (m.face_middle(a).0.x == 1.0).then_some(joint));
        assert_eq!((mesh.nodes.len(), mesh.interfaces.len(), mesh.bodies().1), (18 + 6, 2, 2));
        assert_eq!(mesh.check(), Ok(vec![]));
        for joint in &mesh.interfaces {
            let p = joint.nodes.map(|n| mesh.nodes[n as usize]);
            assert!((0..4).all(|m| p[m] == p[m + 4] && joint.nodes[m] != joint.nodes[m + 4]));
            assert_eq!((p[2] - p[0]).cross(p[3] - p[1]).normalize(), DVec3::X);
            // First face: the lower hexahedron, on the left.
            assert!(
                mesh.hexes.iter().any(|h| h.nodes.contains(&joint.nodes[0])
                    && mesh.nodes[h.nodes[0] as usize].x == 0.0)
            );
        }
        assert_eq!(mesh.node_sets["z0"].len(), 12);
        mesh.hexes
            .iter()
            .for_each(|h| assert!(h.nodes.iter().all(|&n| (n as usize) < mesh.nodes.len())));
    }

    #[test]
    fn crossing_cuts_make_four_pieces_and_a_half_cut_keeps_its_tip() {
        let four = || block(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0], &[0.0, 1.0], "c").unwrap();
        let mut mesh = four();
        mesh.separate(|_, _| Some(0));
        assert_eq!((mesh.nodes.len(), mesh.interfaces.len(), mesh.bodies().1), (32, 4, 4));
        assert_eq!(mesh.check(), Ok(vec![]));
        // In two calls: the interfaces of the first follow their hexahedra.
        let mut steps = four();
        steps.separate(|m, [a, _]| (m.face_middle(a).0.x == 1.0).then_some(0));
        steps.separate(|m, [a, _]| (m.face_middle(a).0.y == 1.0).then_some(0));
        assert_eq!((steps.nodes.len(), steps.interfaces.len(), steps.bodies().1), (32, 4, 4));
        let behind = |mesh: &Mesh, half: &[u32]| {
            mesh.hexes.iter().filter(|h| half.iter().all(|n| h.nodes.contains(n))).count()
        };
        assert!(
            steps
                .interfaces
                .iter()
                .all(|i| behind(&steps, &i.nodes[..4]) == 1 && behind(&steps, &i.nodes[4..]) == 1)
        );
        let mut half = four();
        half.separate(|m, [a, _]| (m.face_middle(a).0 == DVec3::new(1.0, 0.5, 0.5)).then_some(0));
        // The tip at y = 1 stays one node: only the two at y = 0 are doubled.
        assert_eq!((half.nodes.len(), half.interfaces.len(), half.bodies().1), (20, 1, 1));
        assert_eq!(half.check(), Ok(vec![]));
    }

    #[test]
    fn a_shell_stays_with_the_lower_hexahedron() {
        let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        mesh.shells.push(Shell { nodes: mesh.face(HexFace { hex: 0, face: 3 }), region: 0 });
        let before = mesh.shells.clone();
        mesh.separate(|_, _| Some(0));
        assert_eq!(mesh.shells, before);
        assert_eq!(mesh.face(HexFace { hex: 0, face: 3 }), before[0].nodes);
    }
}
