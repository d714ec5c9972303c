//! Carves zones out of meshes: the face loses their mouths, which get floors and walls.
//!
//! Each triangle is cut in its own plane, in double precision from its own corner. Points that two
//! triangles share come out within rounding of each other and are welded; where one triangle's edge
//! got a point, its neighbour's gets the same. So the surface stays in one piece: flat or faceted,
//! over edges of the member, where cracks cross.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3, dvec2};
use rayon::prelude::*;

use super::{
    cut::{ON_EDGE, Piece, Region, cut},
    zone::Zone,
};
use crate::Mesh;

/// Points nearer than this are one, m.
const WELD: f64 = 1e-6;
/// Points on an edge settle within so many rounds.
const ROUNDS: usize = 6;
/// Floors less deep than this are none, m.
const SHALLOW: f64 = 1e-5;
/// Faces that look further aside than this are not cut by a zone: cosine.
const ASIDE: f64 = 0.3;

/// What became of the meshes.
#[derive(Debug, Default)]
pub(super) struct Carved {
    /// The faces, in the order of the meshes; none where nothing was cut.
    pub(super) faces: Vec<Option<Mesh>>,
    /// Walls and floors of cracks.
    pub(super) slots: Mesh,
    /// Floors of missing cover, one each.
    pub(super) bowls: Vec<Mesh>,
}

/// A group of zones, with what lies about it to keep triangles in shape.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) zones: std::ops::Range<usize>,
    /// Points, the distance that each keeps, and the outward direction there.
    pub(super) points: Vec<(DVec3, f64, DVec3)>,
    /// Lowest and highest corner of its zones.
    pub(super) bounds: [DVec3; 2],
}

/// Points on edges of triangles, by edge.
type Edges = HashMap<[[u32; 3]; 2], Vec<DVec3>>;

/// A triangle in its own plane.
struct Plane {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    normal: DVec3,
    corners: [DVec2; 3],
    bounds: [DVec3; 2],
}

impl Plane {
    fn new(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let x = (b - a).try_normalize()?;
        let y = normal.cross(x);
        let flat = |p: DVec3| dvec2((p - a).dot(x), (p - a).dot(y));
        let corners = [a, b, c].map(flat);
        Some(Self { origin: a, x, y, normal, corners, bounds: [a.min(b).min(c), a.max(b).max(c)] })
    }

    /// A point laid onto the plane along `way`.
    fn lay(&self, p: DVec3, way: DVec3) -> DVec2 {
        let to = self.origin - p;
        let p = p + way * (to.dot(self.normal) / way.dot(self.normal)) - self.origin;
        dvec2(p.dot(self.x), p.dot(self.y))
    }

    fn raise(&self, p: DVec2) -> DVec3 {
        self.origin + p.x * self.x + p.y * self.y
    }

    /// Weights of the three corners at a place.
    fn weights(&self, p: DVec2) -> [f32; 3] {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a);
        let (v, w) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
        [1.0 - v - w, v, w].map(|w| w as f32)
    }

    fn overlaps(&self, [low, high]: [DVec3; 2]) -> bool {
        self.bounds[0].cmple(high).all() && low.cmple(self.bounds[1]).all()
    }

    /// Whether a zone lies on this face rather than on one behind or beside it.
    fn bears(&self, zone: &Zone) -> bool {
        if zone.outward().dot(self.normal) < ASIDE || !self.overlaps(zone.bounds()) {
            return false;
        }
        let off = |p: DVec3| (p - self.origin).dot(self.normal).abs();
        let nearest = zone.border().iter().flatten().map(|&p| off(p)).fold(f64::INFINITY, f64::min);
        nearest < zone.reach()
    }

    /// Points of pieces on the edge from corner `k` to the next.
    fn on_edge(&self, pieces: &[Piece], k: usize) -> Vec<DVec2> {
        let (a, b) = (self.corners[k], self.corners[(k + 1) % 3]);
        let (way, length) = ((b - a).normalize(), a.distance(b));
        let mut on: Vec<DVec2> = pieces
            .iter()
            .flat_map(|piece| piece.corners)
            .filter(|p| {
                let along = way.dot(*p - a);
                way.perp_dot(*p - a).abs() < ON_EDGE && along > WELD && along < length - WELD
            })
            .collect();
        on.sort_by(|p, q| way.dot(*p).total_cmp(&way.dot(*q)));
        on.dedup_by(|p, q| p.distance(*q) < WELD);
        on
    }
}

/// An edge by the bits of its ends, whichever way round.
fn edge_key([a, b]: [Vec3; 2]) -> [[u32; 3]; 2] {
    let bits = |p: Vec3| p.to_array().map(|x| (x + 0.0).to_bits());
    let (a, b) = (bits(a), bits(b));
    if a < b { [a, b] } else { [b, a] }
}

/// Points in space, each once.
#[derive(Default)]
struct Weld {
    cells: HashMap<[i64; 3], Vec<u32>>,
    points: Vec<DVec3>,
}

impl Weld {
    const SIDE: f64 = 8.0 * WELD;

    fn put(&mut self, p: DVec3) -> u32 {
        let cell = |p: DVec3| (p / Self::SIDE).floor().to_array().map(|x| x as i64);
        let (low, high) = (cell(p - WELD), cell(p + WELD));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let near = self.cells.get(&[x, y, z]).into_iter().flatten();
                    let same = |&&i: &&u32| self.points[i as usize].distance(p) < WELD;
                    if let Some(&found) = near.into_iter().find(same) {
                        return found;
                    }
                }
            }
        }
        self.points.push(p);
        let index = self.points.len() as u32 - 1;
        self.cells.entry(cell(p)).or_default().push(index);
        index
    }
}

/// One triangle of one mesh, cut.
struct CutTriangle {
    mesh: usize,
    triangle: usize,
    plane: Plane,
    pieces: Vec<Piece>,
}

/// Carves `zones`, in groups, out of `meshes` (in the world's frame). `bowls` is the number of
/// floors that are asked for on their own.
pub(super) fn carve(meshes: &[Mesh], zones: &[Zone], groups: &[Group], bowls: usize) -> Carved {
    let places: Vec<(usize, usize)> = meshes
        .iter()
        .enumerate()
        .flat_map(|(m, mesh)| (0..mesh.triangles.len()).map(move |t| (m, t)))
        .collect();
    // Where a neighbour's edge got a point, this triangle's gets it too, and may cross it anew.
    let mut edges = Edges::new();
    let mut cuts = Vec::new();
    for _ in 0..ROUNDS {
        cuts = places
            .par_iter()
            .filter_map(|&place| cut_triangle(meshes, place, zones, groups, &edges))
            .collect();
        if !note_edges(meshes, &cuts, &mut edges) {
            break;
        }
    }
    assemble(meshes, zones, &cuts, bowls)
}

/// Notes the points on edges of cut triangles; whether any is new.
fn note_edges(meshes: &[Mesh], cuts: &[CutTriangle], edges: &mut Edges) -> bool {
    let mut grew = false;
    for done in cuts {
        let corners = meshes[done.mesh].corners(done.triangle);
        for k in 0..3 {
            for p in done.plane.on_edge(&done.pieces, k).into_iter().map(|p| done.plane.raise(p)) {
                let on = edges.entry(edge_key([corners[k], corners[(k + 1) % 3]])).or_default();
                if on.iter().all(|q| q.distance(p) >= WELD) {
                    on.push(p);
                    grew = true;
                }
            }
        }
    }
    grew
}

/// The pieces of a triangle; none if it stays whole.
fn cut_triangle(
    meshes: &[Mesh],
    (mesh, triangle): (usize, usize),
    zones: &[Zone],
    groups: &[Group],
    edges: &Edges,
) -> Option<CutTriangle> {
    let corners = meshes[mesh].corners(triangle);
    let plane = Plane::new(corners)?;
    let mut on: [Vec<DVec2>; 3] = Default::default();
    for (k, on) in on.iter_mut().enumerate() {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let points = edges.get(&edge_key([a, b])).into_iter().flatten();
        *on = points.map(|&p| plane.lay(p, plane.normal)).collect();
    }
    let near: Vec<&Group> = groups.iter().filter(|g| plane.overlaps(g.bounds)).collect();
    let mut regions = Vec::new();
    for index in near.iter().flat_map(|g| g.zones.clone()) {
        let zone = &zones[index];
        if plane.bears(zone) {
            let way = zone.outward();
            let lay = |p: DVec3| plane.lay(p, way);
            regions.push(Region {
                label: index as u32,
                triangles: zone.triangles().iter().map(|t| t.map(lay)).collect(),
                border: zone.border().iter().map(|e| e.map(lay)).collect(),
            });
        }
    }
    if regions.is_empty() && on.iter().all(Vec::is_empty) {
        return None;
    }
    let mut points = Vec::new();
    if !regions.is_empty() {
        for &(p, apart, outward) in near.iter().flat_map(|g| &g.points) {
            let off = (p - plane.origin).dot(plane.normal).abs();
            if outward.dot(plane.normal) > ASIDE && off < 1e-3 + 0.3 * apart {
                points.push((plane.lay(p, outward), apart));
            }
        }
        // The finest first: the others keep off them.
        points.sort_by(|p, q| p.1.total_cmp(&q.1));
    }
    let pieces = cut(plane.corners, &on, &regions, &points);
    let is_whole = pieces.iter().all(|piece| piece.label.is_none())
        && on.iter().all(Vec::is_empty)
        && (0..3).all(|k| plane.on_edge(&pieces, k).is_empty());
    (!is_whole).then_some(CutTriangle { mesh, triangle, plane, pieces })
}

/// A piece by its welded corners.
struct Facet {
    corners: [u32; 3],
    label: Option<u32>,
}

fn assemble(meshes: &[Mesh], zones: &[Zone], cuts: &[CutTriangle], bowls: usize) -> Carved {
    let mut weld = Weld::default();
    // Corners of the meshes stay where they are, to the bit.
    for done in cuts {
        for p in meshes[done.mesh].corners(done.triangle) {
            weld.put(p.as_dvec3());
        }
    }
    let mut faces: Vec<Option<Mesh>> = vec![None; meshes.len()];
    let mut gone: Vec<Vec<usize>> = vec![Vec::new(); meshes.len()];
    let mut facets = Vec::new();
    for done in cuts {
        let face = faces[done.mesh].get_or_insert_with(|| meshes[done.mesh].clone());
        gone[done.mesh].push(done.triangle);
        for piece in &done.pieces {
            let corners = piece.corners.map(|p| weld.put(done.plane.raise(p)));
            let [a, b, c] = corners;
            if a == b || b == c || c == a {
                continue;
            }
            if piece.label.is_none() {
                let positions = corners.map(|i| weld.points[i as usize].as_vec3());
                let weights = piece.corners.map(|p| done.plane.weights(p));
                append(face, done.triangle, positions, weights);
            }
            facets.push(Facet { corners, label: piece.label });
        }
    }
    for (face, gone) in faces.iter_mut().zip(gone) {
        if let Some(face) = face {
            let mut index = 0;
            let mut gone = gone.into_iter().peekable();
            face.triangles.retain(|_| {
                let leaves = gone.peek() == Some(&index);
                if leaves {
                    gone.next();
                }
                index += 1;
                !leaves
            });
        }
    }
    let mut carved = Carved { faces, slots: Mesh::default(), bowls: vec![Mesh::default(); bowls] };
    floors_and_walls(&facets, &weld.points, zones, &mut carved);
    carved
}

/// Adds a triangle whose corners lie in triangle `of`, with all that belongs to corners.
fn append(mesh: &mut Mesh, of: usize, positions: [Vec3; 3], weights: [[f32; 3]; 3]) {
    let old = mesh.triangles[of].map(|i| i as usize);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(positions);
    for w in weights {
        if !mesh.normals.is_empty() {
            let n = mesh.normals[old[0]] * w[0]
                + mesh.normals[old[1]] * w[1]
                + mesh.normals[old[2]] * w[2];
            mesh.normals.push(n.normalize_or(mesh.normals[old[0]]));
        }
        if !mesh.tangents.is_empty() {
            let [a, b, c] = old.map(|i| mesh.tangents[i]);
            let t = (a * w[0] + b * w[1] + c * w[2]).truncate();
            mesh.tangents.push(t.normalize_or(a.truncate()).extend(a.w));
        }
        for set in &mut mesh.uv {
            if !set.is_empty() {
                set.push(set[old[0]] * w[0] + set[old[1]] * w[1] + set[old[2]] * w[2]);
            }
        }
        if !mesh.colours.is_empty() {
            let [a, b, c] = old.map(|i| mesh.colours[i]);
            mesh.colours.push(a * w[0] + b * w[1] + c * w[2]);
        }
    }
    mesh.triangles.push([first, first + 1, first + 2]);
}

/// Every labelled piece is pushed to its floor; wherever two neighbours are pushed differently a
/// wall joins them.
fn floors_and_walls(facets: &[Facet], points: &[DVec3], zones: &[Zone], carved: &mut Carved) {
    // A corner between two pieces of one crack has one floor: that of the first.
    let kind = |label: u32| usize::from(matches!(zones[label as usize], Zone::Bowl(_)));
    let mut owner = vec![[u32::MAX; 2]; points.len()];
    let mut sides: HashMap<[u32; 2], u32> = HashMap::new();
    for facet in facets {
        let Some(label) = facet.label else { continue };
        for k in 0..3 {
            let own = &mut owner[facet.corners[k] as usize][kind(label)];
            *own = (*own).min(label);
            sides.insert([facet.corners[k], facet.corners[(k + 1) % 3]], label);
        }
    }
    let floor = |corner: u32, label: Option<u32>| {
        let p = points[corner as usize];
        let below = label.map_or(p, |l| zones[owner[corner as usize][kind(l)] as usize].floor(p));
        // On a rim the floor is the face, to the bit.
        if below.distance(p) < SHALLOW { p } else { below }
    };
    for facet in facets {
        let Some(label) = facet.label else { continue };
        let mesh = match &zones[label as usize] {
            Zone::Bowl(bowl) => match bowl.spall {
                Some(spall) => &mut carved.bowls[spall],
                None => &mut carved.slots,
            },
            Zone::Slot(_) => &mut carved.slots,
        };
        add(mesh, &facet.corners.map(|c| floor(c, Some(label))));
        for k in 0..3 {
            let (a, b) = (facet.corners[k], facet.corners[(k + 1) % 3]);
            let beyond = sides.get(&[b, a]).copied();
            // Between two labelled neighbours one of them builds the wall.
            if beyond.is_some_and(|other| kind(other) == kind(label) || other < label) {
                continue;
            }
            let (low, high) =
                ([a, b].map(|c| floor(c, Some(label))), [a, b].map(|c| floor(c, beyond)));
            let apart = |k: usize| low[k] != high[k];
            match (apart(0), apart(1)) {
                (true, true) => {
                    add(mesh, &[low[1], low[0], high[0]]);
                    add(mesh, &[low[1], high[0], high[1]]);
                }
                (true, false) => add(mesh, &[low[1], low[0], high[0]]),
                (false, true) => add(mesh, &[low[1], high[0], high[1]]),
                (false, false) => {}
            }
        }
    }
}

fn add(mesh: &mut Mesh, corners: &[DVec3; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners.iter().map(|p| p.as_vec3()));
    mesh.triangles.push([first, first + 1, first + 2]);
}
