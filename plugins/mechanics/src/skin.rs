//! What is to be seen of a member from outside: its surface at every equilibrium, the forces in its
//! tendons, its cracks.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use glam::{DVec3, Vec3};
use intrados_scene::{CrackSurface, Mouth, Spalled, SurfaceDamage};

use crate::{
    analysis::Observer,
    element::hex8,
    member::Prepared,
    mesh::{HexFace, hex::FACES},
    model::{Failure, History, Point, SteelKind, Step, System, past_peak},
    tensor::Principal,
};

/// Cracks narrower than this are not seen, m.
const CT: f64 = 5e-5;
/// Compressive damage past its peak from which cover comes off.
const CRUSHED: f64 = 0.8;
/// Cover is not thicker than this, m.
const COVER: f32 = 0.04;
/// Least share of the direction of the largest tension within a face at which a crack runs across
/// that face.
const ACROSS: f64 = 0.3;

/// A piece of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facet {
    /// Indices of vertices, counterclockwise seen from outside.
    pub corners: [u32; 4],
    /// The brick and its face.
    pub face: HexFace,
    /// The brick on the other side, if there is one.
    pub behind: Option<u32>,
    /// Index of the member within the model; `u32::MAX`: of none.
    pub part: u32,
}

/// A tendon along its length.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name.
    pub name: String,
    /// Middle of its pieces along it, m.
    pub along: Vec<f64>,
    /// Force at the jack, N.
    pub jacking: f64,
    /// Which steel of the model.
    index: usize,
    area: f64,
}

/// The surface of a model, at rest.
#[derive(Debug, Clone)]
pub struct Skin {
    /// Positions of vertices, m. A node has one for each region that it belongs to, so that
    /// stresses may jump between regions.
    pub rest: Vec<Vec3>,
    /// Faces that are outside or may be, because what is behind them is another region.
    pub facets: Vec<Facet>,
    /// Members of the model: ids.
    pub parts: Vec<String>,
    /// Tendons.
    pub tendons: Vec<Line>,
    /// A point of the axis and its direction, where the member goes round one.
    pub axis: Option<[DVec3; 2]>,
    /// Moments that its life stops at, s.
    times: Vec<f64>,
    /// When each brick is poured, s.
    births: Vec<f64>,
    part_of: Vec<u32>,
    node: Vec<u32>,
    /// Bricks at a vertex, and which of their corners it is.
    at: Vec<Vec<(u32, u8)>>,
}

/// An equilibrium as seen from outside. What has several values at a vertex is their mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Snapshot {
    /// s.
    pub time: f64,
    /// Largest factor of a load.
    pub load_factor: f64,
    /// Unbalanced over all that acts.
    pub residual: f64,
    /// Of vertices, m.
    pub displacement: Vec<Vec3>,
    /// Of vertices, Pa, in the world's frame.
    pub stress: Vec<[f32; 6]>,
    /// Of vertices: damage of tension, or of compression past its peak.
    pub damage: Vec<f32>,
    /// Of vertices: opening of the widest crack, m.
    pub crack: Vec<f32>,
    /// Of the tendons' pieces: force, N.
    pub tendons: Vec<Vec<f64>>,
    /// Length of the largest displacement, and the widest crack, m.
    pub largest: [f32; 2],
}

impl Skin {
    /// The surface of what is prepared.
    #[must_use]
    pub fn new(prepared: &Prepared) -> Self {
        let mesh = &prepared.model.mesh;
        let mut part_of = vec![u32::MAX; mesh.hexes.len()];
        for (p, part) in prepared.parts.iter().enumerate() {
            part.hexes.iter().for_each(|&h| part_of[h as usize] = p as u32);
        }
        let neighbours = mesh.neighbours();
        let region = |h: u32| mesh.hexes[h as usize].region;
        let mut vertices = BTreeMap::new();
        let mut facets = Vec::new();
        for (h, behind) in (0..mesh.hexes.len() as u32).zip(&neighbours) {
            for (face, &behind) in (0_u8..).zip(behind) {
                if behind.is_some_and(|b| {
                    region(b) == region(h) && part_of[b as usize] == part_of[h as usize]
                }) {
                    continue;
                }
                let face = HexFace { hex: h, face };
                let corners = mesh.face(face).map(|node| {
                    let next = vertices.len() as u32;
                    *vertices.entry((node, region(h))).or_insert(next)
                });
                facets.push(Facet { corners, face, behind, part: part_of[h as usize] });
            }
        }
        let mut node = vec![0; vertices.len()];
        vertices.iter().for_each(|(&(n, _), &v)| node[v as usize] = n);
        let mut at = vec![Vec::new(); node.len()];
        for (h, hex) in (0_u32..).zip(&mesh.hexes) {
            for (corner, &n) in (0_u8..).zip(&hex.nodes) {
                if let Some(&v) = vertices.get(&(n, hex.region)) {
                    at[v as usize].push((h, corner));
                }
            }
        }
        Self {
            part_of,
            rest: node.iter().map(|&n| mesh.nodes[n as usize].as_vec3()).collect(),
            facets,
            parts: prepared.parts.iter().map(|p| p.id.clone()).collect(),
            tendons: tendons(prepared),
            axis: prepared.axis,
            times: prepared.times.clone(),
            births: mesh
                .hexes
                .iter()
                .map(|h| prepared.model.bodies.get(h.region as usize).map_or(0.0, |b| b.birth))
                .collect(),
            node,
            at,
        }
    }

    /// Share of the life's moments that are over at a time.
    #[must_use]
    pub fn progress(&self, time: f64) -> f32 {
        self.times.partition_point(|t| *t <= time) as f32 / self.times.len().max(1) as f32
    }

    fn is_there(&self, hex: u32, time: f64) -> bool {
        self.births.get(hex as usize).is_some_and(|&birth| birth <= time)
    }

    /// Whether a face is outside at a time: of the whole model, or of one member alone.
    #[must_use]
    pub fn is_outside(&self, facet: &Facet, time: f64, part: Option<u32>) -> bool {
        let same = |b: u32| part.is_none_or(|p| self.part_of.get(b as usize) == Some(&p));
        self.is_there(facet.face.hex, time)
            && part.is_none_or(|p| facet.part == p)
            && !facet.behind.is_some_and(|b| self.is_there(b, time) && same(b))
    }

    /// Looks at an equilibrium.
    #[must_use]
    pub(crate) fn look(
        &self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Snapshot {
        let mut shot = Snapshot { time: step.time, residual: step.residual, ..Snapshot::default() };
        shot.load_factor =
            structure.model.loads.iter().map(|l| l.factor(step.time)).fold(0.0, f64::max);
        // Stress is known at the points of Gauss; of the trilinear field through them, the value at
        // the corner.
        let to_corner = hex8::CORNERS.map(|c| hex8::shape(c * 3_f64.sqrt()));
        for (at, &node) in self.at.iter().zip(&self.node) {
            let u = history
                .x
                .get(3 * node as usize..3 * node as usize + 3)
                .map_or(DVec3::ZERO, DVec3::from_slice);
            shot.displacement.push(u.as_vec3());
            let (mut stress, mut damage, mut crack, mut count) = ([0.0; 6], 0.0, 0.0, 0.0_f64);
            for &(hex, corner) in at.iter().filter(|(h, _)| self.is_there(*h, step.time)) {
                let (points, weights) = (&points[hex as usize], &to_corner[usize::from(corner)]);
                for (k, sum) in stress.iter_mut().enumerate() {
                    *sum += points.iter().zip(weights).map(|(p, w)| w * p.stress[k]).sum::<f64>();
                }
                // What only grows is not led beyond its points, where it might come out negative.
                damage += past_peak(points[usize::from(corner)].damage);
                crack += points[usize::from(corner)].crack;
                count += 1.0;
            }
            let mean = |sum: f64| (sum / count.max(1.0)) as f32;
            shot.stress.push(stress.map(mean));
            shot.damage.push(mean(damage));
            shot.crack.push(mean(crack));
        }
        let longest =
            shot.displacement.iter().map(|u| u.length_squared()).fold(0.0, f32::max).sqrt();
        shot.largest = [longest, shot.crack.iter().copied().fold(0.0, f32::max)];
        shot.tendons = self
            .tendons
            .iter()
            .map(|line| {
                history.steel.get(line.index).map_or(Vec::new(), |works| {
                    works.iter().map(|w| w.stress * line.area).collect()
                })
            })
            .collect();
        shot
    }

    /// What of the damage is to be seen on the surface, by member of the model: a crack runs across
    /// a face where the largest tension within it is, and goes on where its neighbours' do; cover
    /// has come off where concrete is crushed. Planes of symmetry are no surface.
    #[must_use]
    pub fn surface_damage(
        &self,
        prepared: &Prepared,
        time: f64,
        points: &[[Point; 8]],
    ) -> Vec<SurfaceDamage> {
        let mesh = &prepared.model.mesh;
        let neighbours = mesh.neighbours();
        let outside = |f: &&Facet| {
            f.part != u32::MAX
                && prepared.mirrored.binary_search(&f.face).is_err()
                && self.is_there(f.face.hex, time)
                && !f.behind.is_some_and(|b| self.is_there(b, time))
        };
        let mut found: Vec<SurfaceDamage> = self
            .parts
            .iter()
            .map(|id| SurfaceDamage { member: id.clone(), ..SurfaceDamage::default() })
            .collect();
        let mut traces: Vec<Vec<Trace>> = vec![Vec::new(); found.len()];
        for facet in self.facets.iter().filter(outside) {
            let of_part = facet.part as usize;
            if let Some(trace) = Trace::across(mesh, &neighbours, facet.face, points) {
                traces[of_part].push(trace);
            }
            let near = FACES[usize::from(facet.face.face)];
            let here = &points[facet.face.hex as usize];
            if near.iter().all(|&p| here[p].crushing() > CRUSHED) {
                let (centre, normal) = mesh.face_middle(facet.face);
                let radius = (normal.length() / std::f64::consts::PI).sqrt() as f32;
                let outward = normal.normalize_or_zero().as_vec3();
                found[of_part].spalls.push(Spalled {
                    centre: centre.as_vec3(),
                    outward,
                    radius,
                    depth: COVER.min(0.5 * radius),
                });
            }
        }
        for (found, traces) in found.iter_mut().zip(traces) {
            found.cracks = join(&traces);
        }
        found
    }
}

fn tendons(prepared: &Prepared) -> Vec<Line> {
    let line = |(index, steel): (usize, &crate::model::Steel)| {
        let SteelKind::Tendon(tendon) = &steel.kind else { return None };
        let along = steel.pieces.iter().map(|p| 0.5 * (p.along[0] + p.along[1])).collect();
        Some(Line {
            name: steel.name.clone(),
            along,
            jacking: tendon.jacking * steel.area,
            index,
            area: steel.area,
        })
    };
    prepared.model.steel.iter().enumerate().filter_map(line).collect()
}

/// Where a crack crosses one face.
#[derive(Debug, Clone)]
struct Trace {
    /// The edges that it crosses, by their nodes, and where.
    ends: [([u32; 2], DVec3); 2],
    outward: DVec3,
    normal: DVec3,
    width: f64,
    depth: f64,
}

impl Trace {
    fn across(
        mesh: &crate::mesh::Mesh,
        neighbours: &[[Option<u32>; 6]],
        face: HexFace,
        points: &[[Point; 8]],
    ) -> Option<Self> {
        let near = FACES[usize::from(face.face)];
        let here = &points[face.hex as usize];
        let width = near.iter().map(|&p| here[p].crack).sum::<f64>() / 4.0;
        if width < CT {
            return None;
        }
        let mean: [f64; 6] =
            std::array::from_fn(|k| near.iter().map(|&p| here[p].stress[k]).sum::<f64>() / 4.0);
        let normal = DVec3::from_array(Principal::of_stress(&mean).directions[0]);
        let (centre, outward) = mesh.face_middle(face);
        let outward = outward.normalize_or_zero();
        let along = outward.cross(normal);
        if along.length() < ACROSS {
            return None;
        }
        // The plane through the middle cuts the edges where the distance from it changes its sign.
        let nodes = mesh.face(face);
        let side = nodes.map(|n| (mesh.nodes[n as usize] - centre).dot(normal));
        let mut ends = (0..4).filter_map(|i| {
            let j = (i + 1) % 4;
            let cut = (side[i] < 0.0) != (side[j] < 0.0);
            let at = || {
                mesh.nodes[nodes[i] as usize]
                    .lerp(mesh.nodes[nodes[j] as usize], side[i] / (side[i] - side[j]))
            };
            cut.then(|| ([nodes[i].min(nodes[j]), nodes[i].max(nodes[j])], at()))
        });
        let ends = [ends.next()?, ends.next()?];
        Some(Self { ends, outward, normal, width, depth: depth(mesh, neighbours, face, points) })
    }
}

/// How far inwards from a face bricks are cracked, m.
fn depth(
    mesh: &crate::mesh::Mesh,
    neighbours: &[[Option<u32>; 6]],
    mut face: HexFace,
    points: &[[Point; 8]],
) -> f64 {
    const OPPOSITE: [u8; 6] = [1, 0, 4, 5, 2, 3];
    let mut depth = 0.0;
    // No more bricks than there are.
    for _ in 0..mesh.hexes.len() {
        let mean = points[face.hex as usize].iter().map(|p| p.crack).sum::<f64>() / 8.0;
        if mean < 0.5 * CT {
            break;
        }
        let far = HexFace { hex: face.hex, face: OPPOSITE[usize::from(face.face)] };
        depth += mesh.face_middle(face).0.distance(mesh.face_middle(far).0);
        let Some(next) = neighbours[face.hex as usize][usize::from(far.face)] else { break };
        let Some(back) = neighbours[next as usize].iter().position(|n| *n == Some(face.hex)) else {
            break;
        };
        face = HexFace { hex: next, face: back as u8 };
    }
    depth
}

/// Traces that cross the same edge become one crack. Where two meet, both bend to the middle.
fn join(traces: &[Trace]) -> Vec<CrackSurface> {
    let mut at_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (t, trace) in traces.iter().enumerate() {
        trace.ends.iter().for_each(|(edge, _)| at_edge.entry(*edge).or_default().push(t));
    }
    // Only pairs are joined; at a T the crack ends.
    let other = |edge: &[u32; 2], t: usize| match at_edge.get(edge).map(Vec::as_slice) {
        Some(&[a, b]) if a != b => Some(if a == t { b } else { a }),
        _ => None,
    };
    let mut used = vec![false; traces.len()];
    let mut cracks = Vec::new();
    // First those with a free end, then rings.
    let free = |t: &usize| traces[*t].ends.iter().any(|(edge, _)| other(edge, *t).is_none());
    for start in (0..traces.len()).filter(free).chain(0..traces.len()) {
        if used[start] {
            continue;
        }
        let mut enter = usize::from(
            other(&traces[start].ends[0].0, start).is_some()
                && other(&traces[start].ends[1].0, start).is_none(),
        );
        let (mut t, mut chain) = (start, Vec::new());
        loop {
            used[t] = true;
            chain.push((t, enter));
            let edge = traces[t].ends[1 - enter].0;
            match other(&edge, t).filter(|n| !used[*n]) {
                Some(next) => {
                    enter = usize::from(traces[next].ends[1].0 == edge);
                    t = next;
                }
                None => break,
            }
        }
        cracks.push(crack(traces, &chain));
    }
    cracks
}

fn crack(traces: &[Trace], chain: &[(usize, usize)]) -> CrackSurface {
    let mut mouth = Vec::with_capacity(chain.len() + 1);
    let (mut normal, mut depth) = (DVec3::ZERO, 0.0_f64);
    for k in 0..=chain.len() {
        // The end of the trace before and the beginning of the one after, as far as there are such.
        let before = k.checked_sub(1).map(|k| (chain[k].0, 1 - chain[k].1));
        let ends: Vec<(&Trace, usize)> = before
            .into_iter()
            .chain(chain.get(k).copied())
            .map(|(t, end)| (&traces[t], end))
            .collect();
        let n = ends.len() as f64;
        let outward =
            ends.iter().map(|(t, _)| t.outward).sum::<DVec3>().normalize_or(ends[0].0.outward);
        mouth.push(Mouth {
            at: (ends.iter().map(|(t, end)| t.ends[*end].1).sum::<DVec3>() / n).as_vec3(),
            outward: outward.as_vec3(),
            width: (ends.iter().map(|(t, _)| t.width).sum::<f64>() / n) as f32,
        });
    }
    for &(t, _) in chain {
        let n = traces[t].normal;
        normal += if normal.dot(n) < 0.0 { -n } else { n };
        depth = depth.max(traces[t].depth);
    }
    CrackSurface {
        mouth,
        normal: normal.normalize_or(traces[chain[0].0].normal).as_vec3(),
        depth: depth as f32,
    }
}

/// What has been seen so far; shared with whoever looks on while the analysis runs.
#[derive(Debug, Clone, Default)]
pub struct Seen(Arc<Mutex<Inside>>);

#[derive(Debug, Default)]
struct Inside {
    skin: Option<Arc<Skin>>,
    shots: Vec<Arc<Snapshot>>,
}

impl Seen {
    /// The surface, once the member is prepared.
    #[must_use]
    pub fn skin(&self) -> Option<Arc<Skin>> {
        self.lock().skin.clone()
    }

    /// How many equilibria there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.lock().shots.len()
    }

    /// One of them.
    #[must_use]
    pub fn shot(&self, index: usize) -> Option<Arc<Snapshot>> {
        self.lock().shots.get(index).cloned()
    }

    /// All of them.
    #[must_use]
    pub fn shots(&self) -> Vec<Arc<Snapshot>> {
        self.lock().shots.clone()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Inside> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Looks at every equilibrium from outside, and keeps what each left on the surface.
pub struct Looking<'a> {
    prepared: &'a Prepared,
    skin: Arc<Skin>,
    seen: Seen,
    /// Of each equilibrium, and when that was, s.
    pub damage: Vec<(f64, Vec<SurfaceDamage>)>,
}

impl<'a> Looking<'a> {
    /// Begins with the surface of what is prepared.
    #[must_use]
    pub fn new(prepared: &'a Prepared, seen: Seen) -> Self {
        let skin = Arc::new(Skin::new(prepared));
        seen.lock().skin = Some(Arc::clone(&skin));
        Self { prepared, skin, seen, damage: Vec::new() }
    }

    /// What the last equilibrium left on the surface.
    #[must_use]
    pub fn last(self) -> Vec<SurfaceDamage> {
        self.damage.into_iter().next_back().map(|(_, damage)| damage).unwrap_or_default()
    }
}

impl Observer for Looking<'_> {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure> {
        let shot = Arc::new(self.skin.look(structure, history, step, points));
        self.seen.lock().shots.push(shot);
        let damage = self.skin.surface_damage(self.prepared, step.time, points);
        self.damage.push((step.time, damage));
        Ok(())
    }
}

/// Two who look.
impl<A: Observer, B: Observer> Observer for (&mut A, &mut B) {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure> {
        self.0.see(structure, history, step, points)?;
        self.1.see(structure, history, step, points)
    }
}
