//! Any closed triangle mesh to cubes, with the error that this makes. Where many of its triangles
//! lie in one plane across an axis of the grid, the grid has that plane: webs, flanges and steps
//! are met exactly, and cubes beside them are somewhat narrower than asked for.
//!
//! Inside is decided three times for the middle of every cube, along x, y and z: how often the ray
//! winds through the surface (overlapping solids are their union), or, where triangles are not
//! oriented alike, whether it crosses an odd number of times. Two votes win. A shared edge is
//! judged by the same arithmetic from both sides, so that no ray slips between two triangles.

pub(crate) mod distance;

use std::collections::VecDeque;

use glam::{DVec3, USizeVec3};
use intrados_stage::{Cancelled, Job};
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use super::{
    Mesh, MeshError,
    generate::{Lattice, MAX_CELLS},
    join::first_within,
};
use distance::Triangles;

/// Vertices nearer than this share of the diagonal are one.
const WELD: f64 = 1e-7;

/// A body of cubes, and how far it is from the surface that it was made of.
#[derive(Debug, Clone)]
pub(crate) struct Voxels {
    /// The largest face-connected body. Sides that touch the box around the surface are the sets
    /// `x0`, `x1`, `y0`, `y1`, `z0`, `z1`.
    pub mesh: Mesh,
    /// Mean edges of the cubes: the edge asked for, or less, so that they fill the box around the
    /// surface and end at its planes, m.
    pub spacing: DVec3,
    /// How well cubes and surface agree.
    pub error: GeometricError,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// How well cubes and surface agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeometricError {
    /// Enclosed by the triangles (overlaps counted twice), m³.
    pub surface_volume: f64,
    /// Of the cubes kept, m³.
    pub voxel_volume: f64,
    /// Of bodies that were left out because they do not hang together with the largest, m³.
    pub dropped_volume: f64,
    /// Largest distance of the cubes' outer corners and face middles from the surface, m.
    pub largest_distance: f64,
    /// Mean distance of the cubes' outer faces from the surface, m.
    pub mean_distance: f64,
    /// Share of the surface's area that has no cube nearby (within one or two edges): parts too
    /// thin for the edge, or left out.
    pub missed_area: f64,
    /// Cubes about which the three directions disagreed.
    pub undecided: usize,
}

impl GeometricError {
    /// (voxels − surface) / surface volume.
    #[must_use]
    pub fn relative_volume(&self) -> f64 {
        (self.voxel_volume - self.surface_volume) / self.surface_volume
    }
}

/// Why there are no voxels.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VoxelError {
    /// The surface or the edge cannot be used.
    #[error(transparent)]
    Refused(#[from] MeshError),
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A welded surface.
struct Surface {
    points: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Whether neighbours wind alike.
    oriented: bool,
}

/// Where cubes lie.
struct Grid {
    /// Along each axis: where cubes begin and end, m, ascending.
    planes: [Vec<f64>; 3],
    /// Middles of the cubes, m.
    middles: [Vec<f64>; 3],
    size: USizeVec3,
}

/// Triangles across an axis by this cosine lie in one plane; planes nearer than this share of the
/// diagonal are one.
const ACROSS: f64 = 1.0 - 1e-6;
const SAME: f64 = 1e-5;
/// A plane is one of the grid's where it has this share of the box's side, and where none that has
/// more is nearer than this share of the edge.
const LARGE: f64 = 0.02;
const NEAR: f64 = 0.2;

/// Fills the closed surface with cubes of `edge` metres or somewhat less.
///
/// # Errors
/// An open surface (with the place of its first open edge), an index or coordinate out of range, an
/// edge that makes no cube or too many; cancelled.
pub(crate) fn voxelise(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    edge: f64,
    region: &str,
    job: &Job,
) -> Result<Voxels, VoxelError> {
    let surface = Surface::weld(positions, triangles)?;
    let grid = Grid::around(&surface, edge)?;
    let (mut inside, undecided) = grid.inside(&surface, job)?;
    let all: f64 = (0..inside.len()).filter(|&c| inside[c]).map(|c| grid.volume(c)).sum();
    if all == 0.0 {
        return Err(MeshError::whole(format!(
            "no cube of {edge} m has its middle inside the surface: choose a smaller edge"
        ))
        .into());
    }
    let bodies = grid.keep_largest(&mut inside);
    let cells = grid.size.to_array();
    let number = |i: usize, j: usize, k: usize| i + cells[0] * (j + cells[1] * k);
    let lattice = Lattice {
        cells,
        closed: false,
        sides: ["x0", "x1", "y0", "y1", "z0", "z1"],
        regions: vec![region.to_owned()],
    };
    let [x, y, z] = &grid.planes;
    let point = |i: usize, j: usize, k: usize| DVec3::new(x[i], y[j], z[k]);
    let (mesh, _) = lattice.build(point, |i, j, k| inside[number(i, j, k)].then_some(0))?;
    let error = measure(&surface, &grid, &inside, &mesh, all, undecided, job)?;
    let mut notes = Vec::new();
    if bodies > 1 {
        notes.push(format!(
            "{bodies} separate bodies; the largest was kept, {:.3e} m³ left out",
            error.dropped_volume
        ));
    }
    if !surface.oriented {
        notes
            .push("triangles are not oriented alike; inside was decided by counting crossings, and overlapping solids become holes".into());
    }
    if undecided > 0 {
        notes.push(format!("about {undecided} cubes the three directions disagreed (the surface crosses itself or is nearly open there)"));
    }
    if error.missed_area > 0.01 {
        notes.push(format!(
            "{:.1} % of the surface has no cube nearby: parts of it are thinner than {edge} m",
            100.0 * error.missed_area
        ));
    }
    Ok(Voxels { mesh, spacing: grid.spacing(), error, notes })
}

impl Surface {
    fn weld(positions: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        if let Some(p) = positions.iter().find(|p| !p.is_finite() || p.abs().max_element() > 1e9) {
            return Err(MeshError::whole(format!(
                "a vertex at {p} is not finite or further than 1e9 m from the origin"
            )));
        }
        if let Some(t) =
            triangles.iter().position(|t| t.iter().any(|&v| v as usize >= positions.len()))
        {
            return Err(MeshError::whole(format!(
                "triangle {} names a vertex that is not there ({} vertices)",
                t + 1,
                positions.len()
            )));
        }
        let used = triangles.iter().flatten().map(|&v| positions[v as usize]);
        let Some(first) = used.clone().next() else {
            return Err(MeshError::whole("a surface without triangles"));
        };
        let (low, high) = used.fold((first, first), |(l, h), p| (l.min(p), h.max(p)));
        let diagonal = (high - low).length();
        if diagonal.is_nan() || diagonal <= 0.0 {
            return Err(MeshError::whole("a surface whose vertices are all in one place"));
        }
        let (target, points) = first_within(positions, WELD * diagonal);
        let triangles: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| target[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let oriented = closed(&points, &triangles)?;
        Ok(Self { points, triangles, oriented })
    }

    fn corners(&self, t: [u32; 3]) -> [DVec3; 3] {
        t.map(|v| self.points[v as usize])
    }

    /// By the divergence theorem, m³; positive if triangles wind anticlockwise seen from outside.
    fn volume(&self, origin: DVec3) -> f64 {
        let cone = |&t: &[u32; 3]| {
            let [a, b, c] = self.corners(t).map(|p| p - origin);
            a.dot(b.cross(c)) / 6.0
        };
        self.triangles.iter().map(cone).sum()
    }
}

/// Refuses a surface with an edge that an odd number of triangles share; tells whether all wind
/// alike.
fn closed(points: &[DVec3], triangles: &[[u32; 3]]) -> Result<bool, MeshError> {
    let mut edges: Vec<([u32; 2], bool)> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| ([a.min(b), a.max(b)], a < b))
        .collect();
    edges.sort_unstable();
    let runs = || edges.chunk_by(|a, b| a.0 == b.0);
    let open: Vec<[u32; 2]> = runs().filter(|run| run.len() % 2 == 1).map(|run| run[0].0).collect();
    if let Some(edge) = open.first() {
        let [a, b] = edge.map(|v| points[v as usize]);
        return Err(MeshError::whole(format!(
            "the surface is open: {} of {} edges have a triangle on one side only, \
             the first from ({:.6}, {:.6}, {:.6}) to ({:.6}, {:.6}, {:.6}) m; close its holes",
            open.len(),
            runs().count(),
            a.x,
            a.y,
            a.z,
            b.x,
            b.y,
            b.z
        )));
    }
    if triangles.is_empty() {
        return Err(MeshError::whole("a surface whose triangles are all without area"));
    }
    Ok(runs().all(|run| 2 * run.iter().filter(|e| e.1).count() == run.len()))
}

impl Grid {
    fn around(surface: &Surface, edge: f64) -> Result<Self, MeshError> {
        if !(edge > 0.0 && edge.is_finite()) {
            return Err(MeshError::whole(format!("cubes of {edge} m: give an edge above 0")));
        }
        let used = || surface.triangles.iter().flat_map(|&t| surface.corners(t));
        let low = used().fold(DVec3::INFINITY, DVec3::min);
        let extent = used().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
        // A flat box has no inside, but still a grid.
        let extent = extent.max(DVec3::splat(1e-9 * extent.max_element()));
        let count = |length: f64| (length / edge - 1e-9).ceil().max(1.0);
        let ends = [0, 1, 2].map(|axis| marks(surface, axis, low, extent, edge));
        let cells =
            |ends: &Vec<f64>| ends.windows(2).map(|ends| count(ends[1] - ends[0])).sum::<f64>();
        let size = DVec3::from_array(ends.each_ref().map(cells));
        if size.x * size.y * size.z > MAX_CELLS as f64 {
            let least = edge * (size.x * size.y * size.z / MAX_CELLS as f64).cbrt();
            return Err(MeshError::whole(format!(
                "cubes of {edge} m make a grid of {} × {} × {}: at most {MAX_CELLS}; an edge of {least:.3} m would do",
                size.x, size.y, size.z
            )));
        }
        let planes = ends.map(|ends| {
            let parts = |ends: &[f64]| {
                let (from, parts) = (ends[0], count(ends[1] - ends[0]));
                let step = (ends[1] - from) / parts;
                (0..parts as usize).map(move |i| from + step * i as f64)
            };
            let last = ends[ends.len() - 1];
            ends.windows(2).flat_map(parts).chain([last]).collect::<Vec<f64>>()
        });
        let middle = |planes: &Vec<f64>| planes.windows(2).map(|p| 0.5 * (p[0] + p[1])).collect();
        Ok(Self { middles: planes.each_ref().map(middle), planes, size: size.as_usizevec3() })
    }

    /// Mean edges of its cubes, m.
    fn spacing(&self) -> DVec3 {
        let extent = |p: &Vec<f64>| p[p.len() - 1] - p[0];
        DVec3::from_array(self.planes.each_ref().map(extent)) / self.size.as_dvec3()
    }

    /// Of a cube, m³.
    fn volume(&self, cell: usize) -> f64 {
        let at = self.place(cell).to_array();
        (0..3).map(|axis| self.planes[axis][at[axis] + 1] - self.planes[axis][at[axis]]).product()
    }

    fn place(&self, cell: usize) -> USizeVec3 {
        let USizeVec3 { x, y, .. } = self.size;
        USizeVec3::new(cell % x, cell / x % y, cell / x / y)
    }

    fn number(&self, at: USizeVec3) -> usize {
        at.x + self.size.x * (at.y + self.size.y * at.z)
    }

    /// Votes of the three directions for every cube, and how many were not unanimous.
    fn inside(&self, surface: &Surface, job: &Job) -> Result<(Vec<bool>, usize), Cancelled> {
        let mut votes = vec![0u8; self.size.element_product()];
        for axis in 0..3 {
            job.step(axis, 4)?;
            self.vote(surface, axis, &mut votes, job)?;
        }
        let undecided = votes.iter().filter(|&&v| v == 1 || v == 2).count();
        Ok((votes.iter().map(|&v| v >= 2).collect(), undecided))
    }

    /// Along one axis: sorts where triangles cross the lines through the middles of the cubes, and
    /// counts along each line.
    fn vote(
        &self,
        surface: &Surface,
        axis: usize,
        votes: &mut [u8],
        job: &Job,
    ) -> Result<(), Cancelled> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut crossings: Vec<(u32, u32, f64, i32)> = Vec::new();
        for (n, &t) in surface.triangles.iter().enumerate() {
            if n % 4096 == 0 {
                job.step(axis, 4)?;
            }
            self.cross(surface, t, [axis, u, v], &mut crossings);
        }
        crossings.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
        for line in crossings.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let mut at = USizeVec3::ZERO;
            (at[u], at[v]) = (line[0].0 as usize, line[0].1 as usize);
            let (mut next, mut winding) = (0, 0);
            for i in 0..self.size[axis] {
                let middle = self.middles[axis][i];
                while next < line.len() && line[next].2 <= middle {
                    winding += if surface.oriented { line[next].3 } else { 1 };
                    next += 1;
                }
                let inside = if surface.oriented { winding != 0 } else { winding % 2 == 1 };
                at[axis] = i;
                votes[self.number(at)] += u8::from(inside);
            }
        }
        Ok(())
    }

    /// Lines along an axis that one triangle crosses, where, and in which sense.
    fn cross(
        &self,
        surface: &Surface,
        t: [u32; 3],
        [axis, u, v]: [usize; 3],
        crossings: &mut Vec<(u32, u32, f64, i32)>,
    ) {
        let corners = surface.corners(t);
        let range = |a: usize| {
            let (low, high) = corners
                .iter()
                .map(|c| c[a])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
            let before = |p: f64| self.middles[a].partition_point(|&middle| middle < p);
            // A hair more on either side, so that rounding loses none.
            let hair = 1e-6 * (self.planes[a][1] - self.planes[a][0]);
            (before(low - hair), before(high + hair))
        };
        let ((u0, u1), (v0, v1)) = (range(u), range(v));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        for iv in v0..v1 {
            for iu in u0..u1 {
                let line = [self.middles[u][iu], self.middles[v][iv]];
                let sides = [0, 1, 2].map(|e| left_of(surface, t[e], t[(e + 1) % 3], [u, v], line));
                if sides[0] != sides[1] || sides[1] != sides[2] || normal[axis] == 0.0 {
                    continue;
                }
                // Where the line meets the plane, kept within the triangle against rounding of
                // steep ones.
                let depth = corners[0][axis]
                    - (normal[u] * (line[0] - corners[0][u])
                        + normal[v] * (line[1] - corners[0][v]))
                        / normal[axis];
                let (low, high) =
                    corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| {
                        (l.min(c[axis]), h.max(c[axis]))
                    });
                crossings.push((
                    iu as u32,
                    iv as u32,
                    depth.clamp(low, high),
                    if sides[0] { 1 } else { -1 },
                ));
            }
        }
    }

    /// Clears all cubes but the largest face-connected body; tells how many bodies there were.
    fn keep_largest(&self, inside: &mut [bool]) -> usize {
        let mut body = vec![0u32; inside.len()];
        let (mut sizes, mut queue) = (vec![0usize], VecDeque::new());
        for start in 0..inside.len() {
            if !inside[start] || body[start] != 0 {
                continue;
            }
            let number = sizes.len() as u32;
            sizes.push(0);
            body[start] = number;
            queue.push_back(start);
            while let Some(cell) = queue.pop_front() {
                sizes[number as usize] += 1;
                self.around_cell(cell, |next| {
                    if inside[next] && body[next] == 0 {
                        body[next] = number;
                        queue.push_back(next);
                    }
                });
            }
        }
        let largest =
            (1..sizes.len()).max_by_key(|&b| (sizes[b], std::cmp::Reverse(b))).unwrap_or(0) as u32;
        inside.iter_mut().zip(&body).for_each(|(inside, &b)| *inside &= b == largest);
        sizes.len() - 1
    }

    fn around_cell(&self, cell: usize, mut visit: impl FnMut(usize)) {
        let at = self.place(cell);
        let strides = [1, self.size.x, self.size.x * self.size.y];
        for axis in 0..3 {
            if at[axis] > 0 {
                visit(cell - strides[axis]);
            }
            if at[axis] + 1 < self.size[axis] {
                visit(cell + strides[axis]);
            }
        }
    }
}

/// Where cubes must begin and end along an axis: the ends of the box, and the planes in which much
/// of the surface lies, the largest first.
fn marks(surface: &Surface, axis: usize, low: DVec3, extent: DVec3, edge: f64) -> Vec<f64> {
    let [from, to] = [low[axis], low[axis] + extent[axis]];
    let flat = surface.triangles.iter().filter_map(|&t| {
        let [a, b, c] = surface.corners(t);
        let normal = (b - a).cross(c - a);
        let is_across = normal[axis].abs() >= ACROSS * normal.length();
        is_across.then(|| ((a[axis] + b[axis] + c[axis]) / 3.0, 0.5 * normal.length()))
    });
    let mut flat: Vec<(f64, f64)> = flat.collect();
    flat.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let same = SAME * extent.length();
    let planes = flat.chunk_by(|a, b| b.0 - a.0 < same).map(|plane| {
        let area: f64 = plane.iter().map(|p| p.1).sum();
        (plane.iter().map(|p| p.0 * p.1).sum::<f64>() / area.max(f64::MIN_POSITIVE), area)
    });
    let side = extent.element_product() / extent[axis];
    let mut planes: Vec<(f64, f64)> = planes.filter(|p| p.1 > LARGE * side).collect();
    planes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut ends = vec![from, to];
    for (at, _) in planes {
        if ends.iter().all(|end| (end - at).abs() > NEAR * edge) {
            ends.push(at);
        }
    }
    ends.sort_unstable_by(f64::total_cmp);
    ends
}

/// Whether a point of the plane lies left of the edge a → b. The arithmetic is done from the lower
/// to the higher vertex, so that both triangles of an edge get opposite answers. A point on the
/// edge is judged as if it were moved by (ε, ε²), the same for all edges, so that a line through a
/// vertex crosses one triangle there as well (simulation of simplicity, Edelsbrunner and Mücke
/// 1990).
fn left_of(surface: &Surface, a: u32, b: u32, [u, v]: [usize; 2], point: [f64; 2]) -> bool {
    let (low, high) = (surface.points[a.min(b) as usize], surface.points[a.max(b) as usize]);
    let edge = [high[u] - low[u], high[v] - low[v]];
    let sides = [edge[0] * (point[1] - low[v]) - edge[1] * (point[0] - low[u]), -edge[1], edge[0]];
    let left = sides.into_iter().find(|&s| s != 0.0).is_some_and(|s| s > 0.0);
    left == (a < b)
}

fn measure(
    surface: &Surface,
    grid: &Grid,
    inside: &[bool],
    mesh: &Mesh,
    all: f64,
    undecided: usize,
    job: &Job,
) -> Result<GeometricError, Cancelled> {
    job.step(3, 4)?;
    let tree = Triangles::new(surface.triangles.iter().map(|&t| surface.corners(t)).collect());
    let outer = mesh.outer_faces();
    let mut corners: Vec<u32> = outer.iter().flat_map(|&f| mesh.face(f)).collect();
    corners.sort_unstable();
    corners.dedup();
    let middles: Vec<(f64, f64)> = outer
        .into_par_iter()
        .map(|f| {
            let (middle, normal) = mesh.face_middle(f);
            (tree.distance(middle), normal.length())
        })
        .collect();
    job.step(7, 8)?;
    let at_corners: Vec<f64> =
        corners.into_par_iter().map(|n| tree.distance(mesh.nodes[n as usize])).collect();
    let area: f64 = middles.iter().map(|m| m.1).sum();
    let kept: f64 = (0..inside.len()).filter(|&c| inside[c]).map(|c| grid.volume(c)).sum();
    let low = DVec3::from_array(grid.planes.each_ref().map(|p| p[0]));
    Ok(GeometricError {
        surface_volume: surface.volume(low).abs(),
        voxel_volume: kept,
        dropped_volume: all - kept,
        largest_distance: middles.iter().map(|m| m.0).chain(at_corners).fold(0.0, f64::max),
        mean_distance: middles.iter().map(|m| m.0 * m.1).sum::<f64>() / area,
        missed_area: missed(surface, grid, inside, job)?,
        undecided,
    })
}

/// Share of the surface whose 3³ cubes around are all empty, sampled about once per cube's face.
fn missed(surface: &Surface, grid: &Grid, inside: &[bool], job: &Job) -> Result<f64, Cancelled> {
    let last = grid.size - USizeVec3::ONE;
    let spacing = grid.spacing();
    let home = |p: f64, axis: usize| {
        grid.planes[axis].partition_point(|&plane| plane <= p).saturating_sub(1)
    };
    let near = |p: DVec3| {
        let home = USizeVec3::new(home(p.x, 0), home(p.y, 1), home(p.z, 2)).min(last);
        let (from, to) = (home.saturating_sub(USizeVec3::ONE), (home + USizeVec3::ONE).min(last));
        (from.z..=to.z).any(|z| {
            (from.y..=to.y)
                .any(|y| (from.x..=to.x).any(|x| inside[grid.number(USizeVec3::new(x, y, z))]))
        })
    };
    let (mut total, mut lost) = (0.0, 0.0);
    for &t in &surface.triangles {
        job.step(7, 8)?;
        let [a, b, c] = surface.corners(t);
        let (ab, ac) = (b - a, c - a);
        let area = 0.5 * ab.cross(ac).length();
        // In cubes: those of a plate are as thin as it is, and its triangles as long as few of
        // them.
        let longest = [ab, ac, c - b]
            .into_iter()
            .map(|edge| (edge / spacing).abs().max_element())
            .fold(1.0, f64::max);
        let n = longest.ceil().min(1024.0) as usize;
        let samples = (0..n).flat_map(|i| {
            (0..n - i).map(move |j| {
                ((i as f64 + 1.0 / 3.0) / n as f64, (j as f64 + 1.0 / 3.0) / n as f64)
            })
        });
        let (count, far) = samples.fold((0, 0), |(count, far), (s, t)| {
            (count + 1, far + usize::from(!near(a + s * ab + t * ac)))
        });
        total += area;
        lost += area * far as f64 / f64::from(count);
    }
    Ok(if total > 0.0 { lost / total } else { 0.0 })
}

#[cfg(test)]
mod tests;
