//! Every hexahedron into equal parts.

use std::collections::HashMap;

use glam::DVec3;

use super::{Cell, ElementId, HexFace, Mesh, MeshError, Subject, generate::MAX_CELLS, hex};

/// Corners of the old mesh that a new node lies between, with their shares, sorted; unused places
/// are zero. The same place has the same key from every side.
type Between = [(u32, u32); 4];

/// Where a new node comes from.
enum Origin {
    /// An edge or a face.
    Between(Between),
    /// The inside of a hexahedron.
    Inside(u32),
}

struct Refiner<'a> {
    old: &'a Mesh,
    new: Mesh,
    found: HashMap<Between, u32>,
    /// For each node after the old ones.
    origins: Vec<Origin>,
    /// Parts of each edge, and who asked for them first.
    edges: HashMap<[u32; 2], (u8, ElementId)>,
}

impl Mesh {
    /// Splits every hexahedron, shell, interface and rod into `parts` along each direction.
    ///
    /// # Errors
    /// As [`Mesh::refine_by`].
    pub fn refine(&self, parts: u8) -> Result<Self, MeshError> {
        self.refine_by(|_| [parts; 3])
    }

    /// Splits each hexahedron into `parts(region)` parts along its ξ, η, ζ. Shells, interfaces and
    /// rods follow the edges that they share with hexahedra, else their own region. Nodes keep
    /// their numbers, regions and sets are kept (a new node is in a set if all corners that it lies
    /// between are), labels are dropped. Geometry stays trilinear: an arc keeps its corners.
    ///
    /// # Errors
    /// No parts, too many elements, or two elements that want their common edge split differently
    /// (hanging nodes are not supported).
    pub fn refine_by(&self, parts: impl Fn(u32) -> [u8; 3]) -> Result<Self, MeshError> {
        let parts = |region: u32| parts(region).map(|p| p.max(1));
        let total: usize = self
            .hexes
            .iter()
            .map(|h| parts(h.region).iter().map(|&p| usize::from(p)).product::<usize>())
            .sum();
        if total > MAX_CELLS {
            return Err(MeshError::whole(format!(
                "{total} hexahedra after refinement: at most {MAX_CELLS}"
            )));
        }
        let new =
            Self { nodes: self.nodes.clone(), regions: self.regions.clone(), ..Self::default() };
        let mut refiner = Refiner {
            old: self,
            new,
            found: HashMap::new(),
            origins: Vec::new(),
            edges: HashMap::new(),
        };
        refiner.agree(&parts)?;
        let children = refiner.split(&parts)?;
        Ok(refiner.name(&children))
    }
}

/// What became of the old elements: the first child and the parts of each.
struct Children {
    hexes: Vec<(u32, [u8; 3])>,
    shells: Vec<(u32, u32)>,
    rods: Vec<(u32, u32)>,
    interfaces: Vec<(u32, u32)>,
}

impl Refiner<'_> {
    /// Collects how often each edge is split.
    fn agree(&mut self, parts: &impl Fn(u32) -> [u8; 3]) -> Result<(), MeshError> {
        for (h, cell) in (0u32..).zip(&self.old.hexes) {
            let n = parts(cell.region);
            for (e, edge) in hex::EDGES.iter().enumerate() {
                self.edge(edge.map(|c| cell.nodes[c]), n[e / 4], ElementId::Hex(h))?;
            }
        }
        Ok(())
    }

    /// Parts of an edge: as asked before, or as wanted now.
    fn edge(&mut self, mut nodes: [u32; 2], wanted: u8, by: ElementId) -> Result<u8, MeshError> {
        nodes.sort_unstable();
        let (parts, first) = *self.edges.entry(nodes).or_insert((wanted, by));
        if parts != wanted {
            let (first, by_name) = (self.old.name(first), self.old.name(by));
            let reason = format!(
                "{by_name}: an edge of {wanted} parts, but {first} has it in {parts}; refine regions that touch alike"
            );
            return Err(MeshError::new(Subject::Element(by), reason));
        }
        Ok(parts)
    }

    /// As hexahedra ask for an edge, else as wanted.
    fn follow(&self, mut nodes: [u32; 2], wanted: u8) -> u8 {
        nodes.sort_unstable();
        self.edges.get(&nodes).map_or(wanted, |e| e.0)
    }

    /// The node between old corners with these shares (at most four of them not zero).
    fn between(&mut self, corners: impl Iterator<Item = (u32, u32)>) -> u32 {
        let mut key: Between = [(u32::MAX, 0); 4];
        let mut used = 0;
        for (node, share) in corners.filter(|c| c.1 > 0) {
            // Both faces of an interface may share a node, and so may its halves at a tip.
            key[used] = (node, share);
            used += 1;
        }
        if used == 1 {
            return key[0].0;
        }
        let divisor = key[..used].iter().fold(0, |d, k| gcd(d, k.1));
        key[..used].iter_mut().for_each(|k| k.1 /= divisor);
        key[..used].sort_unstable();
        let Self { found, new, origins, old, .. } = self;
        *found.entry(key).or_insert_with(|| {
            let total: u32 = key[..used].iter().map(|k| k.1).sum();
            let sum: DVec3 = key[..used]
                .iter()
                .map(|&(n, share)| f64::from(share) * old.nodes[n as usize])
                .sum();
            origins.push(Origin::Between(key));
            new.nodes.push(sum / f64::from(total));
            new.nodes.len() as u32 - 1
        })
    }

    fn split(&mut self, parts: &impl Fn(u32) -> [u8; 3]) -> Result<Children, MeshError> {
        let old = self.old;
        let mut children =
            Children { hexes: vec![], shells: vec![], rods: vec![], interfaces: vec![] };
        for (h, cell) in (0u32..).zip(&old.hexes) {
            let n = parts(cell.region);
            children.hexes.push((self.new.hexes.len() as u32, n));
            self.split_hex(h, cell.nodes, n.map(u32::from), cell.region);
        }
        for (s, cell) in (0u32..).zip(&old.shells) {
            let wanted = parts(cell.region);
            let n = self.quad_parts(cell.nodes, [wanted[0], wanted[1]], ElementId::Shell(s))?;
            children.shells.push((self.new.shells.len() as u32, n[0] * n[1]));
            let grid = self.quad(cell.nodes, n);
            self.new
                .shells
                .extend(pieces(&grid, n).map(|nodes| Cell { nodes, region: cell.region }));
        }
        for (i, cell) in (0u32..).zip(&old.interfaces) {
            let [first, last]: [[u32; 4]; 2] =
                std::array::from_fn(|half| std::array::from_fn(|m| cell.nodes[4 * half + m]));
            let (wanted, id) = (parts(cell.region), ElementId::Interface(i));
            let n = self.quad_parts(first, [wanted[0], wanted[1]], id)?;
            self.quad_parts(last, n.map(|n| n as u8), id)?;
            children.interfaces.push((self.new.interfaces.len() as u32, n[0] * n[1]));
            let grids = [self.quad(first, n), self.quad(last, n)];
            let both = pieces(&grids[0], n).zip(pieces(&grids[1], n));
            self.new.interfaces.extend(both.map(|(a, b)| Cell {
                nodes: std::array::from_fn(|m| if m < 4 { a[m] } else { b[m - 4] }),
                region: cell.region,
            }));
        }
        for cell in &old.rods {
            let n = u32::from(self.follow(cell.nodes, parts(cell.region)[0]));
            children.rods.push((self.new.rods.len() as u32, n));
            let line: Vec<u32> = (0..=n)
                .map(|i| self.between([(cell.nodes[0], n - i), (cell.nodes[1], i)].into_iter()))
                .collect();
            self.new
                .rods
                .extend(line.windows(2).map(|w| Cell { nodes: [w[0], w[1]], region: cell.region }));
        }
        Ok(children)
    }

    fn split_hex(&mut self, hex: u32, nodes: [u32; 8], [ni, nj, nk]: [u32; 3], region: u32) {
        let mut grid = Vec::with_capacity(((ni + 1) * (nj + 1) * (nk + 1)) as usize);
        for k in 0..=nk {
            for j in 0..=nj {
                for i in 0..=ni {
                    let share = |c: usize| {
                        let [x, y, z] = [(i, ni, 0), (j, nj, 1), (k, nk, 2)].map(|(i, n, axis)| {
                            if hex::CORNERS[c][axis] > 0.0 { i } else { n - i }
                        });
                        x * y * z
                    };
                    let inside =
                        (1..ni).contains(&i) && (1..nj).contains(&j) && (1..nk).contains(&k);
                    grid.push(if inside {
                        let natural = DVec3::new(
                            f64::from(i) / f64::from(ni),
                            f64::from(j) / f64::from(nj),
                            f64::from(k) / f64::from(nk),
                        );
                        self.new
                            .nodes
                            .push(hex::place(&self.old.corners(hex), 2.0 * natural - 1.0));
                        self.origins.push(Origin::Inside(hex));
                        self.new.nodes.len() as u32 - 1
                    } else {
                        self.between((0..8).map(|c| (nodes[c], share(c))))
                    });
                }
            }
        }
        let at = |i: u32, j: u32, k: u32| grid[(i + (ni + 1) * (j + (nj + 1) * k)) as usize];
        for k in 0..nk {
            for j in 0..nj {
                for i in 0..ni {
                    let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                    let nodes =
                        std::array::from_fn(|c| at(ring[c % 4].0, ring[c % 4].1, k + c as u32 / 4));
                    self.new.hexes.push(Cell { nodes, region });
                }
            }
        }
    }

    /// Parts of a quadrilateral along its first two edges, which the other two must share.
    fn quad_parts(
        &mut self,
        nodes: [u32; 4],
        wanted: [u8; 2],
        by: ElementId,
    ) -> Result<[u32; 2], MeshError> {
        let n: [u8; 2] = std::array::from_fn(|e| self.follow([nodes[e], nodes[e + 1]], wanted[e]));
        for e in 0..4 {
            self.edge([nodes[e], nodes[(e + 1) % 4]], n[e % 2], by)?;
        }
        Ok(n.map(u32::from))
    }

    fn quad(&mut self, nodes: [u32; 4], [ni, nj]: [u32; 2]) -> Vec<u32> {
        let mut grid = Vec::with_capacity(((ni + 1) * (nj + 1)) as usize);
        for j in 0..=nj {
            for i in 0..=ni {
                let shares = [(ni - i) * (nj - j), i * (nj - j), i * j, (ni - i) * j];
                grid.push(self.between(nodes.into_iter().zip(shares)));
            }
        }
        grid
    }

    /// Carries the sets over.
    fn name(self, children: &Children) -> Mesh {
        let Self { old, mut new, origins, .. } = self;
        for (name, set) in &old.node_sets {
            let mut within = vec![false; old.nodes.len()];
            set.iter().for_each(|&n| within[n as usize] = true);
            let all = |origin: &Origin| match origin {
                Origin::Between(corners) => {
                    corners.iter().all(|&(n, share)| share == 0 || within[n as usize])
                }
                Origin::Inside(hex) => {
                    old.hexes[*hex as usize].nodes.iter().all(|&n| within[n as usize])
                }
            };
            let more = (old.nodes.len() as u32..)
                .zip(&origins)
                .filter(|(_, origin)| all(origin))
                .map(|(n, _)| n);
            new.node_sets.insert(name.clone(), set.iter().copied().chain(more).collect());
        }
        for (name, set) in &old.element_sets {
            let all = set.iter().flat_map(|&e| {
                let (first, count, id): (u32, u32, fn(u32) -> ElementId) = match e {
                    ElementId::Hex(h) => {
                        let (first, n) = children.hexes[h as usize];
                        (first, n.iter().map(|&n| u32::from(n)).product(), ElementId::Hex)
                    }
                    ElementId::Shell(s) => (
                        children.shells[s as usize].0,
                        children.shells[s as usize].1,
                        ElementId::Shell,
                    ),
                    ElementId::Rod(r) => {
                        (children.rods[r as usize].0, children.rods[r as usize].1, ElementId::Rod)
                    }
                    ElementId::Interface(i) => (
                        children.interfaces[i as usize].0,
                        children.interfaces[i as usize].1,
                        ElementId::Interface,
                    ),
                };
                (first..first + count).map(id)
            });
            new.element_sets.insert(name.clone(), all.collect());
        }
        for (name, set) in &old.face_sets {
            let all = set.iter().flat_map(|f| {
                let (first, n) = children.hexes[f.hex as usize];
                let [ni, nj, nk] = n.map(u32::from);
                // Which coordinate is held, and where.
                let (axis, at) = [(2, 0), (2, nk - 1), (1, 0), (0, ni - 1), (1, nj - 1), (0, 0)]
                    [usize::from(f.face)];
                let on_face = move |&c: &u32| [c % ni, c / ni % nj, c / ni / nj][axis] == at;
                (0..ni * nj * nk)
                    .filter(on_face)
                    .map(move |c| HexFace { hex: first + c, face: f.face })
            });
            new.face_sets.insert(name.clone(), all.collect());
        }
        new
    }
}

fn pieces(grid: &[u32], [ni, nj]: [u32; 2]) -> impl Iterator<Item = [u32; 4]> + '_ {
    (0..ni * nj).map(move |q| {
        let (i, j) = (q % ni, q / ni);
        [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            .map(|(i, j)| grid[(i + (ni + 1) * j) as usize])
    })
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{Layer, Polar, Rod, Shell, block};
    use super::*;

    #[test]
    fn a_block_refined_is_the_finer_block() {
        let coarse = block(&[0.0, 1.0, 3.0], &[0.0, 1.0], &[0.0, 2.0], "c").unwrap();
        for parts in [1, 2, 3] {
            let fine = coarse.refine(parts).unwrap();
            let p = usize::from(parts);
            assert_eq!(
                (fine.hexes.len(), fine.nodes.len()),
                (2 * p.pow(3), (2 * p + 1) * (p + 1) * (p + 1))
            );
            assert!((fine.volume() - 6.0).abs() < 1e-13);
            assert_eq!(fine.check(), Ok(vec![]));
            assert_eq!(fine.outer_faces().len(), 10 * p * p);
            for (set, axis, at) in [("x0", 0, 0.0), ("x1", 0, 3.0), ("y1", 1, 1.0), ("z0", 2, 0.0)]
            {
                let on =
                    (0..fine.nodes.len() as u32).filter(|&n| fine.nodes[n as usize][axis] == at);
                assert_eq!(fine.node_sets[set], on.collect::<Vec<_>>(), "{set}");
                let area: f64 =
                    fine.face_sets[set].iter().map(|&f| fine.face_middle(f).1.length()).sum();
                let before: f64 =
                    coarse.face_sets[set].iter().map(|&f| coarse.face_middle(f).1.length()).sum();
                assert!((area - before).abs() < 1e-13);
                assert!(fine.face_sets[set].iter().all(|&f| fine.face_middle(f).0[axis] == at));
            }
        }
    }

    #[test]
    fn interfaces_shells_and_rods_follow() {
        let ring = |region: &str, radii: [f64; 2], interface: Option<&str>| Layer {
            region: region.into(),
            radii: radii.to_vec(),
            interface: interface.map(Into::into),
            rings: None,
        };
        let layers = vec![ring("a", [1.0, 1.2], None), ring("b", [1.2, 1.5], Some("joint"))];
        let mut mesh =
            Polar { layers, angles: Polar::angles(0.0, TAU, &[], 0.6), z: vec![0.0, 1.0] }
                .build()
                .unwrap();
        let pipe = mesh.region("pipe");
        for face in mesh.face_sets["inner"].clone() {
            mesh.shells.push(Shell { nodes: mesh.face(face), region: pipe });
        }
        mesh.rods
            .push(Rod { nodes: [mesh.hexes[0].nodes[0], mesh.hexes[0].nodes[4]], region: pipe });
        mesh.element_sets.insert("bar".into(), vec![ElementId::Rod(0)]);
        let fine = mesh.refine(2).unwrap();
        assert_eq!(fine.check(), Ok(vec![]));
        assert_eq!(
            [fine.hexes.len(), fine.shells.len(), fine.rods.len(), fine.interfaces.len()],
            [mesh.hexes.len() * 8, mesh.shells.len() * 4, 2, mesh.interfaces.len() * 4]
        );
        assert_eq!(fine.element_sets["bar"].len(), 2);
        assert_eq!(fine.bodies().1, 2);
        for joint in &fine.interfaces {
            assert!((0..4).all(|m| {
                fine.nodes[joint.nodes[m] as usize]
                    .distance(fine.nodes[joint.nodes[m + 4] as usize])
                    < 1e-15
            }));
        }
        // Shell faces are still faces of hexahedra.
        let table = fine.face_table();
        assert!(fine.shells.iter().all(|s| table.find(s.nodes).len() == 1));
    }

    #[test]
    fn regions_that_touch_must_agree() {
        let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 1.0], &[0.0, 1.0], "c").unwrap();
        mesh.assign("right", |p| p.x > 1.0);
        // Only across the common face: fine.
        let fine = mesh.refine_by(|r| if r == 1 { [4, 1, 1] } else { [1, 1, 1] }).unwrap();
        assert_eq!((fine.hexes.len(), fine.check()), (5, Ok(vec![])));
        assert_eq!(fine.regions, ["c", "right"]);
        let error = mesh.refine_by(|r| if r == 1 { [1, 2, 1] } else { [1, 1, 1] }).unwrap_err();
        assert!(error.reason.starts_with("hex 2: an edge of 2 parts, but hex 1 has it in 1"));
    }
}
