//! Whether meshes enclose a volume.

use glam::{DVec3, Vec3};
use intrados_stage::{Cancelled, Job};

use crate::Mesh;

/// Triangles up to which closedness is looked into; sorting more would take seconds.
const MAX_TRIANGLES: usize = 4 << 20;

/// The volume that the meshes enclose together, m³, or `None` if they have a hole.
///
/// Vertices are welded by position. The surface is closed if every edge is walked as often one way
/// as the other (a cycle: its boundary is zero), and then the divergence theorem gives V = Σ
/// a·(b×c)/6, about a point near the mesh so that little cancels.
pub(super) fn volume(meshes: &[&Mesh], job: &Job) -> Result<Option<f64>, Cancelled> {
    let count: usize = meshes.iter().map(|m| m.triangles.len()).sum();
    if count == 0 || count > MAX_TRIANGLES {
        return Ok(None);
    }
    let corners = || meshes.iter().flat_map(|m| (0..m.triangles.len()).map(|i| m.corners(i)));
    // −0 and 0 are one place.
    let key = |p: Vec3| (p + 0.0).to_array().map(f32::to_bits);
    let mut places: Vec<[u32; 3]> = corners().flatten().map(key).collect();
    places.sort_unstable();
    places.dedup();
    job.step(8, 10)?;
    let place = |p: Vec3| places.binary_search(&key(p)).unwrap_or(0);
    let mut edges = Vec::with_capacity(3 * count);
    for [a, b, c] in corners() {
        let [a, b, c] = [a, b, c].map(place);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from != to {
                edges.push(if from < to { (from, to, 1_i8) } else { (to, from, -1) });
            }
        }
    }
    edges.sort_unstable();
    job.step(8, 10)?;
    let closed = edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .all(|edge| edge.iter().map(|e| i64::from(e.2)).sum::<i64>() == 0);
    if !closed {
        return Ok(None);
    }
    let origin = corners().next().map_or(DVec3::ZERO, |[a, _, _]| a.as_dvec3());
    let sixfold = |corners: [Vec3; 3]| {
        let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
        a.dot(b.cross(c))
    };
    Ok(Some((corners().map(sixfold).sum::<f64>() / 6.0).abs()))
}
