//! What a camera sees of every patch.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use intrados_scene::Camera;

use super::{
    mesh::{GAUSS, Mesh, Patch, Walls},
    polygon::{Plane, Polygon, TINY, area},
};

/// ∫ m, ∫ m s, ∫ m t and ∫ m s t over every patch, m = 1/π · share of the picture a m²: what is
/// visible of a patch is projected on the picture. s and t are the patch's coordinates, ±1 at its
/// four points.
pub(super) fn response(walls: &Walls, mesh: &Mesh, camera: &Camera) -> Vec<[f64; 4]> {
    let eye = camera.position.as_dvec3();
    let mut responses = vec![[0.0; 4]; mesh.patches.len()];
    let [mut one, mut other] = [Polygon::new(), Polygon::new()];
    let picture = Picture::new(camera);
    for (quad, range) in &mesh.ranges {
        let plane = &walls.faces[*quad].plane;
        if plane.height(eye) <= TINY {
            continue;
        }
        let view = walls.view(eye, *quad, &walls.obstacles(&[eye], *quad));
        for j in range.clone() {
            let patch = &mesh.patches[j];
            walls.pieces(&view, patch, [&mut one, &mut other], |piece| {
                picture.each_point(piece, plane, |p, share| {
                    let [s, t] = local(walls, patch, p);
                    responses[j]
                        .iter_mut()
                        .zip([1.0, s, t, s * t])
                        .for_each(|(r, x)| *r += FRAC_1_PI * share * x);
                });
            });
        }
    }
    responses
}

/// A patch's coordinates of a point on it.
fn local(walls: &Walls, patch: &Patch, p: DVec3) -> [f64; 2] {
    let c = walls.faces[patch.quad].coordinates(p);
    [0, 1].map(|k| {
        let [lo, hi] = patch.part[k];
        (2.0 * c[k] - lo - hi) / (hi - lo) / GAUSS
    })
}

struct Picture {
    eye: DVec3,
    /// Right, up and forward; a point of the picture is forward + x · right + y · up, x and y from
    /// −1 to 1.
    axes: [DVec3; 3],
    sides: [Plane; 4],
}

impl Picture {
    fn new(camera: &Camera) -> Self {
        let eye = camera.position.as_dvec3();
        let [right, up, forward] = camera.frame().map(|e| e.as_dvec3());
        let [x, y] = camera.half_extent().map(f64::from);
        let sides = [forward * x - right, forward * x + right, forward * y - up, forward * y + up];
        Self {
            eye,
            axes: [right * x, up * y, forward],
            sides: sides.map(|n| Plane::through(eye, n.normalize())),
        }
    }

    /// Calls with points of a polygon in the plane and the share of the picture that each stands
    /// for: the middles of the edges of triangles, exact for polynomials of degree 2 over the
    /// picture.
    fn each_point(&self, polygon: &[DVec3], plane: &Plane, mut with: impl FnMut(DVec3, f64)) {
        let [right, up, forward] = self.axes;
        let inside = self.sides.iter().fold(polygon.to_vec(), |rest, side| side.cut_new(&rest));
        let project = |p: &DVec3| {
            let d = *p - self.eye;
            DVec3::new(d.dot(right) / right.length_squared(), d.dot(up) / up.length_squared(), 0.0)
                / d.dot(forward)
        };
        let projected: Polygon = inside.iter().map(project).collect();
        for pair in projected.windows(2).skip(1) {
            let triangle = [projected[0], pair[0], pair[1]];
            for k in 0..3 {
                let p = 0.5 * (triangle[k] + triangle[(k + 1) % 3]);
                let d = forward + right * p.x + up * p.y;
                let hit = self.eye - d * (plane.height(self.eye) / plane.n.dot(d));
                // The whole picture is 2 × 2.
                with(hit, area(&triangle) / 4.0 / 3.0);
            }
        }
    }
}
